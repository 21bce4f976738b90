//! `scene.glb` read back by the `gltf` crate. What Khronos' validator says of it:
//! tests/readers/validate_glb.mjs.

use elastocap_geometry::export::gltf::{BodyRole, GltfError, SceneBody, glb, part_name};
use elastocap_geometry::scene::Box3;

fn body(name: &str, role: BodyRole, poses: &[Box3]) -> SceneBody {
    SceneBody { name: name.into(), role, poses: poses.to_vec() }
}

fn labels(steps: usize) -> Vec<String> {
    (0..steps).map(|s| format!("U/H = 0.{s}")).collect()
}

/// Two electrodes in a layer on a substrate, of size `l`, at three load steps.
fn pair(l: f64) -> Vec<SceneBody> {
    let cuboid = |min: [f64; 3], max: [f64; 3]| Box3 { min: min.map(|x| x * l), max: max.map(|x| x * l) };
    vec![
        body("substrate", BodyRole::Substrate, &[cuboid([-3.0, -1.0, -1.0], [3.0, 0.0, 1.0]); 3]),
        body(
            "layer",
            BodyRole::Layer,
            &[
                cuboid([-2.0, 0.0, -1.0], [2.0, 1.0, 1.0]),
                cuboid([-2.1, 0.0, -1.0], [2.1, 0.9, 1.0]),
                cuboid([-2.2, 0.0, -1.0], [2.2, 0.8, 1.0]),
            ],
        ),
        body(
            "left",
            BodyRole::Conductor,
            &[
                cuboid([-0.7, 0.5, -0.5], [-0.1, 0.500001, 0.5]),
                cuboid([-0.8, 0.45, -0.5], [-0.2, 0.4500009, 0.5]),
                cuboid([-0.9, 0.4, -0.5], [-0.3, 0.4000008, 0.5]),
            ],
        ),
        body("right", BodyRole::Conductor, &[cuboid([0.1, 0.5, -0.5], [0.7, 0.5, 0.5]); 3]),
    ]
}

struct ReadBack {
    document: gltf::Document,
    blob: Vec<u8>,
}

impl ReadBack {
    fn of(bytes: &[u8]) -> Self {
        let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(bytes).unwrap();
        Self { document, blob: blob.unwrap() }
    }

    fn root(&self) -> gltf::Node<'_> {
        self.document.default_scene().unwrap().nodes().next().unwrap()
    }

    fn extras(&self) -> serde_json::Value {
        serde_json::from_str(self.root().extras().as_ref().unwrap().get()).unwrap()
    }

    /// Metres from the scene's centre: base positions and normals of a body's corners.
    fn corners(&self, node: &gltf::Node) -> (Vec<[f64; 3]>, Vec<[f32; 3]>, Vec<u32>) {
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(&self.blob));
        let home = node.transform().decomposed().0;
        let positions = reader.read_positions().unwrap();
        (
            positions.map(|p| [0, 1, 2].map(|a| f64::from(p[a]) + f64::from(home[a]))).collect(),
            reader.read_normals().unwrap().collect(),
            reader.read_indices().unwrap().into_u32().collect(),
        )
    }

    /// The box that a body fills at a load step, in metres of the case file.
    fn pose(&self, node: &gltf::Node, step: usize) -> Box3 {
        let centre: [f64; 3] = serde_json::from_value(self.extras()["scene_centre_m"].clone()).unwrap();
        let (mut corners, ..) = self.corners(node);
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(&self.blob));
        if let Some((Some(displacement), ..)) =
            (step > 0).then(|| reader.read_morph_targets().nth(step - 1)).flatten()
        {
            for (corner, d) in corners.iter_mut().zip(displacement) {
                *corner = [0, 1, 2].map(|a| corner[a] + f64::from(d[a]));
            }
        }
        let fold = |pick: fn(f64, f64) -> f64, start| {
            corners.iter().fold([start; 3], |b, c| [0, 1, 2].map(|a| pick(b[a], c[a] + centre[a])))
        };
        Box3 { min: fold(f64::min, f64::INFINITY), max: fold(f64::max, f64::NEG_INFINITY) }
    }
}

#[test]
fn every_body_is_where_it_was_put_at_every_step_at_any_scale() {
    for length in [1e-9, 450e-6, 1.0, 1e3] {
        let bodies = pair(length);
        let file = ReadBack::of(&glb(&bodies, &labels(3)).unwrap());
        let nodes: Vec<_> = file.root().children().collect();
        assert_eq!(nodes.len(), bodies.len());
        for (node, body) in nodes.iter().zip(&bodies) {
            assert_eq!(node.name(), Some(body.name.as_str()));
            assert_eq!(node.mesh().unwrap().primitives().next().unwrap().material().name(), node.name());
            for (step, wanted) in body.poses.iter().enumerate() {
                let found = file.pose(node, step);
                for a in 0..3 {
                    assert!(
                        (found.min[a] - wanted.min[a]).abs() < 1e-6 * length,
                        "{body:?} {step} {found:?}"
                    );
                    assert!(
                        (found.max[a] - wanted.max[a]).abs() < 1e-6 * length,
                        "{body:?} {step} {found:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn an_electrode_a_millionth_of_the_scene_keeps_its_thickness() {
    let bodies = pair(1e-3);
    let file = ReadBack::of(&glb(&bodies, &labels(3)).unwrap());
    let left = file.root().children().nth(2).unwrap();
    let (corners, ..) = file.corners(&left);
    let thickness = corners.iter().map(|c| c[1]).fold(f64::NEG_INFINITY, f64::max)
        - corners.iter().map(|c| c[1]).fold(f64::INFINITY, f64::min);
    assert!((thickness / 1e-9 - 1.0).abs() < 1e-6, "{thickness:e}");
}

#[test]
fn normals_and_winding_point_outward() {
    let file = ReadBack::of(&glb(&pair(1.0)[..3], &labels(3)).unwrap());
    for node in file.root().children() {
        let (corners, normals, indices) = file.corners(&node);
        assert_eq!((corners.len(), indices.len()), (24, 36));
        let middle = [0, 1, 2].map(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 24.0);
        let mut signed_volume = 0.0;
        for triangle in indices.chunks(3) {
            let [p, q, r] = [0, 1, 2].map(|i| corners[triangle[i] as usize]);
            let (u, v) = ([0, 1, 2].map(|a| q[a] - p[a]), [0, 1, 2].map(|a| r[a] - p[a]));
            let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let dot = |n: [f64; 3], w: [f64; 3]| (0..3).map(|a| n[a] * w[a]).sum::<f64>();
            for &i in triangle {
                let normal = normals[i as usize].map(f64::from);
                assert!(dot(normal, cross) > 0.0);
                assert!(dot(normal, [0, 1, 2].map(|a| p[a] - middle[a])) > 0.0);
            }
            signed_volume += dot(cross, [0, 1, 2].map(|a| p[a] - middle[a])) / 6.0;
        }
        let pose = file.pose(&node, 0);
        let volume: f64 = (0..3).map(|a| pose.extent(a)).product();
        assert!((signed_volume / volume - 1.0).abs() < 1e-3, "{signed_volume} {volume}");
    }
}

#[test]
fn a_sheet_is_one_face_seen_from_both_sides() {
    for axis in 0..3 {
        let mut region = Box3 { min: [0.0; 3], max: [1e-3; 3] };
        region.max[axis] = 0.0;
        let file = ReadBack::of(&glb(&[body("sheet", BodyRole::Conductor, &[region])], &labels(1)).unwrap());
        let node = file.root().children().next().unwrap();
        let (corners, normals, indices) = file.corners(&node);
        assert_eq!((corners.len(), indices.len()), (4, 6));
        assert!(normals.iter().all(|n| n[axis] == 1.0));
        assert!(node.mesh().unwrap().primitives().next().unwrap().material().double_sided());
    }
}

#[test]
fn a_sheet_that_becomes_thick_is_a_solid_from_the_start() {
    let poses = [0.0, 1e-3].map(|top| Box3 { min: [0.0; 3], max: [1.0, top, 1.0] });
    let file = ReadBack::of(&glb(&[body("swelling", BodyRole::Dielectric, &poses)], &labels(2)).unwrap());
    assert_eq!(file.corners(&file.root().children().next().unwrap()).0.len(), 24);
}

#[test]
fn the_root_scales_the_scene_to_between_one_and_two_and_a_half_units_and_says_so() {
    for (length, name) in [
        (450e-6, "elastocap scene, scaled by 5000 (1 unit = 200 um)"),
        (1e-3, "elastocap scene, scaled by 1000 (1 unit = 1 mm)"),
        (1e-9, "elastocap scene, scaled by 1000000000 (1 unit = 1 nm)"),
        (7e3, "elastocap scene, scaled by 0.0002 (1 unit = 5 km)"),
        (0.999_999_999_999_999_9, "elastocap scene, scaled by 2 (1 unit = 500 mm)"),
        (1.0, "elastocap scene, scaled by 1 (1 unit = 1 m)"),
        (3e20, "elastocap scene, scaled by 0.000000000000000000005 (1 unit = 2e20 m)"),
    ] {
        let cube = body("cube", BodyRole::Conductor, &[Box3 { min: [0.0; 3], max: [length; 3] }]);
        let file = ReadBack::of(&glb(&[cube], &labels(1)).unwrap());
        assert_eq!(file.root().name(), Some(name));
        let scale = f64::from(file.root().transform().decomposed().2[0]);
        assert!((0.999_999..2.500_001).contains(&(scale * length)), "{length}: {scale}");
        let extras = file.extras();
        let said = (extras["metres_per_unit"].as_f64().unwrap(), extras["scale"].as_f64().unwrap());
        assert!((said.0 * said.1 - 1.0).abs() < 1e-15 && (said.1 / scale - 1.0).abs() < 1e-6);
    }
}

#[test]
fn accessor_bounds_are_those_of_the_written_numbers_to_the_last_bit() {
    let file = ReadBack::of(&glb(&pair(0.1 / 3.0), &labels(3)).unwrap());
    for mesh in file.document.meshes() {
        for primitive in mesh.primitives() {
            let mut positions = vec![primitive.get(&gltf::Semantic::Positions).unwrap()];
            positions.extend(primitive.morph_targets().map(|t| t.positions().unwrap()));
            for accessor in positions {
                let start = accessor.view().unwrap().offset() + accessor.offset();
                let at = |i: usize, a: usize| {
                    let bytes = file.blob[start + 12 * i + 4 * a..][..4].try_into().unwrap();
                    f32::from_le_bytes(bytes)
                };
                let least =
                    [0, 1, 2].map(|a| (0..accessor.count()).map(|i| at(i, a)).fold(f32::INFINITY, f32::min));
                let said: [f32; 3] = serde_json::from_value(accessor.min().unwrap()).unwrap();
                assert_eq!(said, least);
            }
        }
    }
}

#[test]
fn moving_bodies_follow_the_animation_and_still_ones_have_no_targets() {
    let file = ReadBack::of(&glb(&pair(1e-3), &labels(3)).unwrap());
    let animation = file.document.animations().next().unwrap();
    assert_eq!(animation.name(), Some("load steps"));
    let targets: Vec<_> =
        animation.channels().map(|c| c.target().node().name().unwrap().to_owned()).collect();
    assert_eq!(targets, ["layer", "left"]);
    for channel in animation.channels() {
        let mesh = channel.target().node().mesh().unwrap();
        let extras: serde_json::Value = serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap();
        assert_eq!(extras["targetNames"], serde_json::json!(["U/H = 0.1", "U/H = 0.2"]));
        assert_eq!(mesh.weights().unwrap(), [0.0, 0.0]);
        let reader = channel.reader(|_| Some(&file.blob));
        assert_eq!(reader.read_inputs().unwrap().collect::<Vec<_>>(), [0.0, 1.0, 2.0]);
        let Some(gltf::animation::util::ReadOutputs::MorphTargetWeights(weights)) = reader.read_outputs()
        else {
            panic!("not weights");
        };
        assert_eq!(weights.into_f32().collect::<Vec<_>>(), [0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    }
    let still = ReadBack::of(&glb(&[pair(1.0).remove(0)], &labels(3)).unwrap());
    assert_eq!(still.document.animations().count(), 0);
}

#[test]
fn metals_are_opaque_layer_and_substrate_are_translucent_and_conductors_differ_in_colour() {
    let file = ReadBack::of(&glb(&pair(1e-3), &labels(3)).unwrap());
    let looks: Vec<_> = (file.document.materials())
        .map(|m| (m.alpha_mode(), m.pbr_metallic_roughness().base_color_factor()))
        .collect();
    assert_eq!(looks[0].0, gltf::material::AlphaMode::Blend);
    assert_eq!(looks[1].0, gltf::material::AlphaMode::Blend);
    assert!(looks[1].1[3] < 0.5);
    assert_eq!(looks[2].0, gltf::material::AlphaMode::Opaque);
    assert_ne!(looks[2].1, looks[3].1);
}

#[test]
fn parts_of_one_conductor_have_its_colour() {
    let cube = |k: usize| Box3 { min: [k as f64, 0.0, 0.0], max: [k as f64 + 0.5, 1.0, 1.0] };
    let part = |name: &str, k: usize| body(&part_name(name, k), BodyRole::Conductor, &[cube(k)]);
    let bodies = [part("left", 0), part("left", 1), part("right", 0), part("right", 1), part("right", 2)];
    let file = ReadBack::of(&glb(&bodies, &labels(1)).unwrap());
    let colours: Vec<_> =
        file.document.materials().map(|m| m.pbr_metallic_roughness().base_color_factor()).collect();
    assert!(colours[0] == colours[1] && colours[2] == colours[3] && colours[3] == colours[4]);
    assert_ne!(colours[1], colours[2]);
    assert_eq!(file.root().children().nth(4).unwrap().name(), Some("right, part 3"));
}

#[test]
fn scenes_that_cannot_be_shown_are_refused_with_the_body_and_the_step() {
    let good = Box3 { min: [0.0; 3], max: [1.0; 3] };
    let open = Box3 { max: [1.0, f64::INFINITY, 1.0], ..good };
    let rod = Box3 { max: [1.0, 0.0, 0.0], ..good };
    let inverted = Box3 { max: [1.0, -1.0, 1.0], ..good };
    let try_poses = |poses: &[Box3]| glb(&[body("b", BodyRole::Layer, poses)], &labels(2)).unwrap_err();
    assert_eq!(try_poses(&[good, open]), GltfError::NotFinite { body: "b".into(), step: 1 });
    assert_eq!(try_poses(&[rod, good]), GltfError::NotABody { body: "b".into(), step: 0 });
    assert_eq!(try_poses(&[good, inverted]), GltfError::NotABody { body: "b".into(), step: 1 });
    assert_eq!(try_poses(&[good]), GltfError::PoseCount { body: "b".into(), found: 1, expected: 2 });
    assert_eq!(glb(&[], &labels(2)), Err(GltfError::Empty));
    let atom = Box3 { max: [1e-40; 3], ..good };
    assert_eq!(try_poses(&[atom, atom]), GltfError::OutOfRange { extent: 1e-40 });
}

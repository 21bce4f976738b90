//! Bodies of any shape as a binary glTF file, drawn by the surfaces that the solver works with.

use elastocap_linalg::vector::{length, normal};
use gltf_json as json;

use super::gltf::{BodyRole, File, GltfError, Materials, SceneUnit, centre, extras, triangles};
use crate::meshing::plane as planar;
use crate::meshing::tets::{FaceRole, TetMesh, determinant};
use crate::scene::Box3;
use std::collections::BTreeMap;

/// A body, given by the triangles of its surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceBody {
    /// Name of its node, mesh and material.
    pub name: String,
    /// The kind of body, which decides how it looks.
    pub role: BodyRole,
    /// Corners of each triangle, m, anticlockwise as seen from outside.
    pub triangles: Vec<[[f64; 3]; 3]>,
}

/// The surfaces of the conductors of a mesh, and those of its regions except for the background, which is
/// region 0. `conductors` is the number of conductors, and `regions` that of regions, the background
/// included.
///
/// The triangles of a conductor run anticlockwise as seen from the space around it; a sheet has triangles for
/// both sides.
pub fn surfaces(mesh: &TetMesh, conductors: usize, regions: usize) -> (Vec<Vec<Corners>>, Vec<Vec<Corners>>) {
    let mut roles = BTreeMap::new();
    for face in &mesh.boundary {
        let mut key = face.face;
        key.sort_unstable();
        if let FaceRole::Conductor(c) = face.role {
            roles.insert(key, c as usize);
        }
    }
    let mut metal = vec![Vec::new(); conductors];
    let mut filled = vec![Vec::new(); regions.saturating_sub(1)];
    let mut faces: BTreeMap<[u32; 3], (u32, Corners)> = BTreeMap::new();
    for (t, tet) in mesh.tets.iter().enumerate() {
        let region = mesh.regions[t];
        for skip in 0..4 {
            let ids = [0, 1, 2].map(|k| tet[if k < skip { k } else { k + 1 }]);
            let mut corners = ids.map(|p| mesh.points[p as usize]);
            // Anticlockwise as seen from outside the tetrahedron.
            if determinant(mesh.points[tet[skip] as usize], corners[0], corners[1], corners[2]) < 0.0 {
                corners.swap(1, 2);
            }
            let mut key = ids;
            key.sort_unstable();
            if let Some(&c) = roles.get(&key) {
                if let Some(triangles) = metal.get_mut(c) {
                    triangles.push([corners[0], corners[2], corners[1]]);
                }
                add(&mut filled, region, corners);
            } else if let Some((other, other_corners)) = faces.remove(&key) {
                if other != region {
                    add(&mut filled, region, corners);
                    add(&mut filled, other, other_corners);
                }
            } else {
                faces.insert(key, (region, corners));
            }
        }
    }
    for (region, corners) in faces.into_values() {
        add(&mut filled, region, corners);
    }
    (metal, filled)
}

/// The corners of a triangle, m.
pub type Corners = [[f64; 3]; 3];

/// Adds a triangle to the surface of its region, unless that is the background. `filled` has the surfaces of
/// the other regions.
fn add(filled: &mut [Vec<Corners>], region: u32, corners: Corners) {
    if let Some(triangles) = (region as usize).checked_sub(1).and_then(|r| filled.get_mut(r)) {
        triangles.push(corners);
    }
}

/// The surface of a prism along `axis`, 0 to 2 for x1 to x3, between the two `ends`, m. Its `outline` is a
/// simple polygon, m, in the two other coordinates in ascending order, clockwise or anticlockwise. Where an
/// outline crosses itself, its caps may be incomplete.
pub fn prism(axis: usize, ends: [f64; 2], outline: &[[f64; 2]]) -> Vec<Corners> {
    let place = |p: [f64; 2], z: f64| match axis {
        0 => [z, p[0], p[1]],
        1 => [p[0], z, p[1]],
        _ => [p[0], p[1], z],
    };
    // Seen from above along x2, the two other axes in ascending order are left-handed.
    let turned = (planar::area(outline) < 0.0) != (axis == 1);
    let mut triangles = Vec::new();
    let mut add = |[a, b, c]: Corners| triangles.push(if turned { [a, c, b] } else { [a, b, c] });
    for (k, p) in outline.iter().enumerate() {
        let q = outline[(k + 1) % outline.len()];
        let [a, b] = ends.map(|z| place(*p, z));
        let [d, c] = ends.map(|z| place(q, z));
        add([a, d, c]);
        add([a, c, b]);
    }
    for [p, q, r] in planar::fill_polygon(outline) {
        let is_clockwise = planar::area(outline) < 0.0;
        let [low, high] = ends.map(|z| [p, q, r].map(|p| place(p, z)));
        // The triangles of `fill_polygon` are anticlockwise, whichever way the outline runs, and `add` turns
        // those of clockwise outlines.
        let (low, high) =
            if is_clockwise { (low, [high[0], high[2], high[1]]) } else { ([low[0], low[2], low[1]], high) };
        add(low);
        add(high);
    }
    triangles
}

/// The bodies at each load step, which has a label, as a binary glTF file, scaled for viewing as
/// [`super::gltf::glb`] does.
///
/// Each step has separate nodes. At first the first step is shown; the animation "load steps" shows one step
/// after the other for one second each.
///
/// # Errors
/// [`GltfError`] if there is nothing to show, a corner is not finite, or the scene is too large or too small
/// for the format.
///
/// ```
/// use elastocap_geometry::export::gltf::BodyRole;
/// use elastocap_geometry::export::surfaces::{SurfaceBody, surfaces_glb};
///
/// let triangles = vec![[[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]]];
/// let body = SurfaceBody { name: "flag".into(), role: BodyRole::Conductor, triangles };
/// assert_eq!(&surfaces_glb(&[("unloaded".into(), vec![body])])?[..4], b"glTF");
/// # Ok::<(), elastocap_geometry::export::gltf::GltfError>(())
/// ```
pub fn surfaces_glb(steps: &[(String, Vec<SurfaceBody>)]) -> Result<Vec<u8>, GltfError> {
    let bounds = |body: &SurfaceBody| {
        let corners = body.triangles.iter().flatten();
        corners.map(|&p| Box3 { min: p, max: p }).reduce(|all, p| all.union(&p))
    };
    let finite =
        |body: &SurfaceBody| body.triangles.as_flattened().as_flattened().iter().all(|x| x.is_finite());
    for (step, (_, bodies)) in steps.iter().enumerate() {
        if let Some(body) = bodies.iter().find(|body| !finite(body)) {
            return Err(GltfError::NotFinite { body: body.name.clone(), step });
        }
    }
    let all_bounds = steps.iter().flat_map(|(_, bodies)| bodies).filter_map(bounds);
    let bounds_of_all = all_bounds.reduce(|a, b| a.union(&b)).ok_or(GltfError::Empty)?;
    let unit = SceneUnit::for_extent((0..3).fold(0.0, |l, a| bounds_of_all.extent(a).max(l)))?;
    let middle = centre(&bounds_of_all);
    let mut file = File::default();
    let times = (steps.len() > 1).then(|| file.seconds(steps.len()));
    let mut groups = Vec::new();
    for (step, (label, bodies)) in steps.iter().enumerate() {
        // Bodies keep their colours from step to step.
        let mut materials = Materials::default();
        let mut children = Vec::new();
        for body in bodies {
            let Some(bounds) = bounds(body) else { continue };
            let home = centre(&bounds);
            let positions: Vec<[f32; 3]> =
                body.triangles.iter().flatten().map(|p| [0, 1, 2].map(|a| (p[a] - home[a]) as f32)).collect();
            let normals: Vec<[f32; 3]> = body.triangles.iter().flat_map(|t| [direction(*t); 3]).collect();
            let positions = file.vectors(&positions, true);
            let normals = file.vectors(&normals, false);
            let material = file.root.push(materials.material(&body.name, body.role, false));
            let mesh = file.root.push(triangles(&body.name, material, positions, normals));
            children.push(file.root.push(json::Node {
                name: Some(body.name.clone()),
                mesh: Some(mesh),
                translation: Some([0, 1, 2].map(|a| (home[a] - middle[a]) as f32)),
                extras: extras(&serde_json::json!({ "role": body.role.name() }))?,
                ..Default::default()
            }));
        }
        let Some(times) = times else {
            groups = children;
            continue;
        };
        let group = file.root.push(json::Node {
            name: Some(label.clone()),
            children: Some(children),
            scale: Some([if step == 0 { 1.0 } else { 0.0 }; 3]),
            ..Default::default()
        });
        file.show_at(group, times, step, steps.len());
        groups.push(group);
    }
    let labels: Vec<String> = steps.iter().map(|(label, _)| label.clone()).collect();
    file.finish(groups, &unit, middle, &labels)
}

/// The unit normal of a triangle; x3 where it has no area.
fn direction(corners: Corners) -> [f32; 3] {
    let n = normal(corners);
    let largest = n.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest <= 0.0 {
        return [0.0, 0.0, 1.0];
    }
    let n = n.map(|x| x / largest);
    n.map(|x| (x / length(n)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meshing::tets::{Sizing, mesh};
    use crate::scene::{Body, Scene, Wall};
    use crate::shapes::Shape;

    #[test]
    fn surfaces_enclose_the_volume_of_their_bodies() {
        let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
        let ball = Shape::Sphere { center: [0.0; 3], radius: 0.7 };
        let scene = Scene {
            bodies: vec![
                Body::conductor("inner", Shape::Box(cube(0.25))),
                Body::dielectric("rubber", ball, 3.0),
            ],
            background_permittivity: 1.0,
            domain: cube(1.0),
            walls: [[Wall::Grounded; 2]; 3],
        };
        let mesh = mesh(&scene, &Sizing::default()).unwrap().mesh;
        let (metal, filled) = surfaces(&mesh, 1, 2);
        let volume = |all: &[Corners]| -> f64 {
            all.iter().map(|[a, b, c]| determinant([0.0; 3], *a, *b, *c) / 6.0).sum()
        };
        assert!((volume(&metal[0]) - 0.125).abs() < 1e-12, "{}", volume(&metal[0]));
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.7_f64.powi(3) - 0.125;
        assert!((volume(&filled[0]) - ball).abs() < 1e-9, "{}", volume(&filled[0]));
        let body =
            SurfaceBody { name: "inner".into(), role: BodyRole::Conductor, triangles: metal[0].clone() };
        let file =
            gltf::Gltf::from_slice(&surfaces_glb(&[("unloaded".into(), vec![body])]).unwrap()).unwrap();
        let positions = file.accessors().next().unwrap();
        assert_eq!(positions.count(), 3 * metal[0].len());
    }

    #[test]
    fn a_prism_is_closed_along_every_axis_and_whichever_way_its_outline_goes() {
        // An L: not convex.
        let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let mut back = outline;
        back.reverse();
        for axis in 0..3 {
            for outline in [&outline, &back] {
                let triangles = prism(axis, [-1.0, 1.0], outline);
                let signed_volume = |[a, b, c]: &Corners| determinant([9.0; 3], *a, *b, *c) / 6.0;
                let volume: f64 = triangles.iter().map(signed_volume).sum();
                assert!((volume - 8.0).abs() < 1e-12, "{axis} {volume}");
                let key = |p: [f64; 3]| p.map(f64::to_bits);
                for [a, b, c] in &triangles {
                    for (p, q) in [(a, b), (b, c), (c, a)] {
                        let against = triangles.iter().flat_map(|[a, b, c]| [(b, a), (c, b), (a, c)]);
                        let count = against.filter(|(s, t)| (key(**s), key(**t)) == (key(*p), key(*q)));
                        assert_eq!(count.count(), 1);
                    }
                }
            }
        }
    }

    #[test]
    fn each_step_is_shown_at_its_own_time_only() {
        let step = |x: f64| {
            let outline = [[0.0, 0.0], [x, 0.0], [0.0, 1.0]];
            let triangles = prism(2, [0.0, 1.0], &outline);
            let body = SurfaceBody { name: "wedge".into(), role: BodyRole::Conductor, triangles };
            (format!("U/H = {x}"), vec![body])
        };
        let bytes = surfaces_glb(&[step(1.0), step(2.0), step(3.0)]).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = file.blob.as_deref().unwrap();
        let animation = file.animations().next().unwrap();
        assert_eq!(animation.channels().count(), 3);
        for (k, channel) in animation.channels().enumerate() {
            let reader = channel.reader(|_| Some(blob));
            let Some(gltf::animation::util::ReadOutputs::Scales(scales)) = reader.read_outputs() else {
                panic!("no scales")
            };
            let sizes: Vec<f32> = scales.map(|s| s[0]).collect();
            assert!((0..3).all(|s| sizes[s] == if s == k { 1.0 } else { 0.0 }), "{sizes:?}");
            assert_eq!(channel.sampler().interpolation(), gltf::animation::Interpolation::Step);
        }
    }
}

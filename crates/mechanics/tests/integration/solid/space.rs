//! The solver in three dimensions.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber, Volume};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::mesh::{Mesh, graded, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::refinement::Refinable;
use elastocap_mechanics::solid::space::layer::{SideCondition, SpaceLayerMesh};

/// A unit cube whose inner nodes are out of place: its hexahedra have curved sides and volumes of many sizes.
fn crooked_cube() -> Mesh<Space> {
    let cuts = uniform(0.0, 1.0, 2);
    let mut mesh = Mesh::tensor(&cuts, &cuts, &cuts);
    for (n, x) in mesh.nodes.iter_mut().enumerate() {
        if x.iter().all(|x| *x > 0.0 && *x < 1.0) {
            for k in 0..3 {
                x[k] += 0.04 * (2.3 * n as f64 + k as f64).sin();
            }
        }
    }
    mesh
}

/// A unit cube with hexahedra of many sizes, whose nodes hang on sides, edges and on nodes that hang
/// themselves.
fn cut_cube() -> Mesh<Space> {
    let cuts = uniform(0.0, 1.0, 2);
    let mut cube = Refinable::<Space>::new(Mesh::tensor(&cuts, &cuts, &[0.0, 0.3, 1.0]));
    for step in 0..3_usize {
        let axes: Vec<u8> = (0..cube.mesh().elements.len())
            .map(|e| if (e + step) % 3 == 0 { [1, 6, 3, 7][(e + step) / 3 % 4] } else { 0 })
            .collect();
        cube = cube.cut(&axes).0;
    }
    assert!(cube.mesh().hanging.nodes.len() > 200);
    cube.mesh().clone()
}

#[test]
fn a_linear_displacement_of_the_boundary_goes_on_inside() {
    // Sheared in three ways, with det F = 1 on the whole way there; where the volume can change, stretched
    // too.
    let shear = [[1.0, 0.3, 0.1], [0.0, 1.0, -0.2], [0.0, 0.0, 1.0]];
    let stretch = [[1.25, 0.3, 0.1], [0.2, 0.7, -0.2], [0.0, 0.1, 1.1]];
    let states = [(Volume::Incompressible, shear), (Volume::BulkModulus(50.0), stretch)];
    for (mesh, (volume, f)) in [crooked_cube(), cut_cube()].iter().flat_map(|mesh| states.map(|s| (mesh, s)))
    {
        let rubber = Rubber {
            distortion: HyperelasticLaw::MooneyRivlin { c10: 0.3, c01: 0.2 },
            volume,
            volume_barrier: 1.5,
        };
        let mut body = Body::new(mesh.clone(), rubber);
        for axis in 0..3 {
            body.hold(axis, |x| x.iter().any(|x| *x == 0.0 || *x == 1.0));
        }
        let exact = |x: [f64; 3], k: usize| f[k][0] * x[0] + f[k][1] * x[1] + f[k][2] * x[2] - x[k];
        let (mut state, mut load) = (body.at_rest(), body.no_load());
        let mut goal = load.clone();
        for (d, u) in goal.displacement.iter_mut().enumerate() {
            *u = exact(body.mesh.nodes[d / 3], d % 3);
        }
        let mut equations = Equations::new(body).unwrap();
        assert!(equations.unknowns() >= 81);
        equations.advance(&mut state, &mut load, &goal, &NewtonSettings::default()).unwrap();
        for (d, u) in state.displacement.iter().enumerate() {
            let error = u - exact(equations.body().mesh.nodes[d / 3], d % 3);
            assert!(error.abs() < 1e-10, "{volume:?}: {error}");
        }
    }
}

#[test]
fn a_cube_pressed_between_smooth_plates_follows_the_closed_form_of_every_law() {
    let yeoh = [0.5, -0.04, 0.02];
    let ogden = vec![(1.2, 1.3), (0.02, 5.0), (-0.1, -2.0)];
    // Nominal stress of incompressible rubber under a simple stretch, by hand for each law.
    let first = |l: f64| l * l + 2.0 / l - 3.0;
    let slope = |l: f64| 2.0 * (l - l.powi(-2));
    type Nominal<'a> = Box<dyn Fn(f64) -> f64 + 'a>;
    let laws: [(HyperelasticLaw, Nominal<'_>); 5] = [
        (HyperelasticLaw::NeoHookean { shear_modulus: 1.3 }, Box::new(|l| 0.65 * slope(l))),
        (HyperelasticLaw::MooneyRivlin { c10: 0.2, c01: 0.5 }, Box::new(|l| (0.2 + 0.5 / l) * slope(l))),
        (
            HyperelasticLaw::Yeoh { constants: yeoh },
            Box::new(|l| (yeoh[0] + 2.0 * yeoh[1] * first(l) + 3.0 * yeoh[2] * first(l).powi(2)) * slope(l)),
        ),
        (
            HyperelasticLaw::Ogden { terms: ogden.clone() },
            Box::new(|l| ogden.iter().map(|(mu, a)| mu * (l.powf(a - 1.0) - l.powf(-0.5 * a - 1.0))).sum()),
        ),
        (
            HyperelasticLaw::Gent { shear_modulus: 1.3, limiting_invariant: 2.0 },
            Box::new(|l| 0.65 * slope(l) / (1.0 - first(l) / 2.0)),
        ),
    ];
    for (distortion, nominal) in laws {
        for (volume, tolerance) in [(Volume::Incompressible, 1e-8), (Volume::BulkModulus(1e7), 1e-5)] {
            let rubber = Rubber { distortion: distortion.clone(), volume, volume_barrier: 1.5 };
            let mut body = Body::new(crooked_cube(), rubber);
            for k in 0..3 {
                body.hold(k, |x| x[k] == 0.0);
            }
            body.hold(1, |x| x[1] == 1.0);
            let mut equations = Equations::new(body).unwrap();
            let (mut state, mut load) = (equations.body().at_rest(), equations.body().no_load());
            for stretch in [0.8f64, 0.5] {
                let mut goal = load.clone();
                for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
                    if x[1] == 1.0 {
                        goal.displacement[3 * n + 1] = stretch - 1.0;
                    }
                }
                equations.advance(&mut state, &mut load, &goal, &NewtonSettings::default()).unwrap();
                let (force, exact) = (equations.reaction(1, |x| x[1] == 1.0), nominal(stretch));
                assert!(
                    (force / exact - 1.0).abs() < tolerance,
                    "{distortion:?} {volume:?} {stretch}: {force} {exact}"
                );
            }
        }
    }
}

/// Force of a layer in plane strain over that of the same section in space, per width, and the largest
/// difference of a displacement over the thickness.
fn plane_against_space(
    section: LayerMesh,
    indenter: Indenter,
    compression: f64,
    half_width: f64,
    electrode: Option<[[f64; 2]; 2]>,
) -> (f64, f64) {
    let rubber = Rubber::neo_hookean(1.0);
    let stiff = Rubber::neo_hookean(30.0);
    let plane_inclusions: Vec<Inclusion> =
        electrode.iter().map(|&[min, max]| Inclusion { min, max, rubber: stiff.clone() }).collect();
    let through = |[x, y]: [f64; 2], z: f64| [x, y, z];
    let space_inclusions: Vec<Inclusion<Space>> = electrode
        .iter()
        .map(|&[min, max]| Inclusion {
            min: through(min, 0.0),
            max: through(max, half_width),
            rubber: stiff.clone(),
        })
        .collect();
    let settings =
        NewtonSettings { tolerance: 1e-12, first_step: 1.0, final_gap: 1e-6, ..Default::default() };
    let mut plane =
        LayerModel::with_inclusions(&section, &rubber, &plane_inclusions, indenter, End::Free).unwrap();
    let force = plane.press(compression, &settings).unwrap().force;
    let mesh = SpaceLayerMesh { section, across: vec![0.0, 0.4 * half_width, half_width], side_fan: None };
    let (inclusions, side) = (&space_inclusions, SideCondition::Symmetric);
    let mut space =
        LayerModel::of_finite_width_with_inclusions(&mesh, rubber, inclusions, indenter, End::Free, side)
            .unwrap();
    let reaction = space.press(compression, &settings).unwrap().force / (2.0 * half_width);
    let nodes = space.equations().body().mesh.nodes.iter();
    let worst = nodes.zip(space.state().displacement.chunks_exact(3)).fold(0.0f64, |worst, (x, got)| {
        let exact = plane.displacement_near([x[0], x[1]]);
        worst.max((got[0] - exact[0]).abs()).max((got[1] - exact[1]).abs()).max(got[2].abs())
    });
    (reaction / force, worst)
}

#[test]
fn a_layer_that_cannot_spread_along_its_width_is_in_plane_strain() {
    let section = LayerMesh::uniform(1.0, 2.0, 2, 0.5, 1);
    let (ratio, difference) = plane_against_space(section, Indenter::WholeTop, 0.15, 0.7, None);
    assert!((ratio - 1.0).abs() < 1e-10 && difference < 1e-10, "{ratio} {difference}");
}

#[test]
fn so_is_a_layer_with_an_electrode_through_its_width() {
    let section = || LayerMesh::uniform(1.0, 2.5, 4, 0.5, 1);
    let electrode = [[0.25, 0.25], [1.0, 0.5]];
    let (ratio, difference) = plane_against_space(section(), Indenter::WholeTop, 0.1, 0.7, Some(electrode));
    assert!((ratio - 1.0).abs() < 1e-10 && difference < 1e-10, "{ratio} {difference}");
    // It is there: the layer is stiffer with it.
    let force = |inclusions: &[Inclusion]| {
        let rubber = Rubber::neo_hookean(1.0);
        let mut layer =
            LayerModel::with_inclusions(&section(), &rubber, inclusions, Indenter::WholeTop, End::Free)
                .unwrap();
        layer.press(0.1, &NewtonSettings::default()).unwrap().force
    };
    let [min, max] = electrode;
    let with = force(&[Inclusion { min, max, rubber: Rubber::neo_hookean(30.0) }]);
    assert!(with > 1.02 * force(&[]), "{with}");
}

#[test]
fn so_is_a_layer_under_a_rounded_punch() {
    let section = LayerMesh::uniform(1.0, 2.5, 3, 0.5, 1);
    let punch = Indenter::Smooth(IndenterProfile::Punch { half_width: 0.8, corner_radius: 0.3 });
    let (ratio, difference) = plane_against_space(section, punch, 0.1, 1.0, None);
    assert!((ratio - 1.0).abs() < 1e-7 && difference < 1e-7, "{ratio} {difference}");
}

#[test]
fn a_sphere_meets_the_formula_for_thin_layers() {
    // F = 16/3 mu R^(1/2) d^(3/2) (1 + 1.133 c + 1.283 c^2 + 0.769 c^3 + 0.0975 c^4) with c = (R d)^(1/2) /
    // H, for an incompressible layer bonded below (Dimitriadis and others, 2002): linear elastic, without
    // end.
    let (radius, depth) = (1.0, 0.02);
    let c = f64::sqrt(radius * depth);
    let formula = 16.0 / 3.0
        * radius.sqrt()
        * depth.powf(1.5)
        * (1.0 + c * (1.133 + c * (1.283 + c * (0.769 + c * 0.0975))));
    let finer = |x: f64| 0.05 + 0.4 * x;
    let section = LayerMesh {
        along: graded(0.0, 1.5, finer),
        up: graded(0.0, 1.0, |y| finer(1.0 - y)),
        end_top: uniform(1.5, 2.5, 1),
        radii: vec![0.0, 1.0],
        punch: None,
    };
    let mesh = SpaceLayerMesh { section, across: graded(0.0, 1.5, finer), side_fan: Some(1.0) };
    let mut model = LayerModel::of_finite_width(
        &mesh,
        Rubber::neo_hookean(1.0),
        Indenter::Smooth(IndenterProfile::Sphere { radius }),
        End::Free,
        SideCondition::Free,
    )
    .unwrap();
    let settings = NewtonSettings { tolerance: 1e-8, first_step: 1.0, final_gap: 1e-5, ..Default::default() };
    let step = model.press(depth, &settings).unwrap();
    println!("force {} formula {formula}, {:?}", step.force, step);
    assert!((step.force / formula - 1.0).abs() < 0.03, "{} {formula}", step.force);
    assert!(step.imbalance < 1e-6 && step.penetration == 0.0, "{step:?}");
    // No tension anywhere, and no pressure where there is a gap.
    for (_, gap, pressure) in model.equations().contact_pressure(0, model.state()) {
        assert!(pressure > 0.0 && gap > 0.0 && (gap < 1e-3 || pressure < 1e-1), "{gap} {pressure}");
    }
}

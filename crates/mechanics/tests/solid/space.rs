//! The solver in three dimensions.

use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::material::{Distortion, Rubber, Volume};
use elastocap_mechanics::solid::mesh::{Mesh, uniform};
use elastocap_mechanics::solid::model::{Body, Equations, State};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::space::mesh::Sweep;

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

#[test]
fn a_linear_displacement_of_the_boundary_goes_on_inside() {
    // Sheared in three ways, with det F = 1 on the whole way there; where the volume can change, stretched too.
    let shear = [[1.0, 0.3, 0.1], [0.0, 1.0, -0.2], [0.0, 0.0, 1.0]];
    let stretch = [[1.25, 0.3, 0.1], [0.2, 0.7, -0.2], [0.0, 0.1, 1.1]];
    for (volume, f) in [(Volume::Incompressible, shear), (Volume::BulkModulus(50.0), stretch)] {
        let rubber = Rubber {
            distortion: Distortion::MooneyRivlin { c10: 0.3, c01: 0.2 },
            volume,
            volume_barrier: 1.5,
        };
        let mut body = Body::new(crooked_cube(), rubber);
        for axis in 0..3 {
            body.hold(axis, |x| x.iter().any(|x| *x == 0.0 || *x == 1.0));
        }
        let exact = |x: [f64; 3], k: usize| f[k][0] * x[0] + f[k][1] * x[1] + f[k][2] * x[2] - x[k];
        let (mut state, mut load) = (body.at_rest(Vec::new()), body.no_load());
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
    let laws: [(Distortion, Nominal<'_>); 4] = [
        (Distortion::NeoHookean { shear_modulus: 1.3 }, Box::new(|l| 0.65 * slope(l))),
        (Distortion::MooneyRivlin { c10: 0.2, c01: 0.5 }, Box::new(|l| (0.2 + 0.5 / l) * slope(l))),
        (
            Distortion::Yeoh { constants: yeoh },
            Box::new(|l| (yeoh[0] + 2.0 * yeoh[1] * first(l) + 3.0 * yeoh[2] * first(l).powi(2)) * slope(l)),
        ),
        (
            Distortion::Ogden { terms: ogden.clone() },
            Box::new(|l| ogden.iter().map(|(mu, a)| mu * (l.powf(a - 1.0) - l.powf(-0.5 * a - 1.0))).sum()),
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
            let (mut state, mut load) = (equations.body().at_rest(Vec::new()), equations.body().no_load());
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

#[test]
fn a_layer_that_cannot_spread_along_its_width_is_in_plane_strain() {
    let mesh = LayerMesh::uniform(1.0, 2.0, 2, 0.5, 1);
    let rubber = Rubber::neo_hookean(1.0);
    let compression = 0.15;
    let settings = NewtonSettings { tolerance: 1e-12, ..Default::default() };
    let mut plane = LayerModel::new(&mesh, rubber.clone(), Indenter::WholeTop, End::Free).unwrap();
    let force = plane.press(compression, &settings).unwrap().force / 2.0;

    let section = mesh.mesh();
    let width = 0.7;
    let mut body = Body::new(
        Mesh::from_sweeps(&[Sweep { section: &section, along: &[0.0, 0.3, width], map: &|x| x }]),
        rubber,
    );
    body.hold(0, |x| x[0] == 0.0 || x[1] == 0.0);
    body.hold(1, |x| x[1] == 0.0 || x[1] == 1.0);
    body.hold(2, |x| x[1] == 0.0 || x[2] == 0.0 || x[2] == width);
    let mut equations = Equations::new(body).unwrap();
    let (mut state, mut load): (State<Space>, _) =
        (equations.body().at_rest(Vec::new()), equations.body().no_load());
    let mut goal = load.clone();
    for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
        if x[1] == 1.0 {
            goal.displacement[3 * n + 1] = -compression;
        }
    }
    equations.advance(&mut state, &mut load, &goal, &settings).unwrap();
    let reaction = -equations.reaction(1, |x| x[1] == 1.0) / width;
    assert!((reaction / force - 1.0).abs() < 1e-10, "{reaction} {force}");
    for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
        let exact = plane.displacement_near([x[0], x[1]]);
        let got = &state.displacement[3 * n..3 * n + 3];
        let error = (got[0] - exact[0]).abs().max((got[1] - exact[1]).abs()).max(got[2].abs());
        assert!(error < 1e-10, "{x:?}: {got:?} {exact:?}");
    }
}

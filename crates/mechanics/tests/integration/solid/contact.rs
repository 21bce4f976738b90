//! Contact: against the closed form of line contact, by the contact conditions, by symmetry, and round a
//! corner.

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::mesh::{Mesh, Patch, geometric, graded, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::{IndenterProfile, Obstacle, ObstacleShape};

const HALF_WIDTH: f64 = 500.0 / 450.0;

fn rounded(n: usize, per_radius: f64, radius: f64, whole: bool) -> LayerModel {
    rounded_at(0.0, n, per_radius, radius, whole)
}

fn rounded_at(position: f64, n: usize, per_radius: f64, radius: f64, whole: bool) -> LayerModel {
    // Fine where the surface slides around the corner.
    let (coarse, fine) = (1.0 / n as f64, 0.3 * radius / per_radius);
    let size = |x: f64| (fine + 0.25 * (0.5 - x).max(x - HALF_WIDTH).max(0.0)).min(coarse);
    let mesh = LayerMesh {
        along: graded(0.0, 2.0, size),
        up: graded(0.0, 1.0, |y| (fine + 0.25 * (1.0 - y)).min(coarse)),
        end_top: uniform(2.0, 3.0, (n / 2).max(2)),
        radii: geometric(0.5, 1),
        punch: None,
    };
    let mesh = if whole { mesh.mirrored() } else { mesh };
    let indenter = Indenter::Smooth(IndenterProfile::Punch { half_width: HALF_WIDTH, corner_radius: radius });
    let rubber = Rubber { volume_barrier: 20.0, ..Rubber::neo_hookean(1.0) };
    LayerModel::with_indenter_at(position, &mesh, &rubber, &[], indenter, End::Free).unwrap()
}

#[test]
fn a_cylinder_on_a_thick_block_has_the_force_and_the_pressure_of_line_contact() {
    // Half of a block of 60 x 60, a cylinder of radius 10, contact half width b about 0.3.
    let (radius, size) = (10.0, 60.0);
    let step = |away: f64| 0.015 + 0.3 * (away - 0.4).max(0.0);
    let along = graded(0.0, size, step);
    let up = graded(0.0, size, |y| step(size - y));
    let mesh = Mesh::from_patches(&[Patch::tensor(&along, &up)]);
    let mut body = Body::new(mesh, Rubber::neo_hookean(1.0));
    body.hold(0, |x| x[0] == 0.0 || x[1] == 0.0);
    body.hold(1, |x| x[1] == 0.0);
    let sides = body.mesh.boundary_where(|x| x[1] == size && x[0] < 3.0);
    body.obstacles.push(Obstacle {
        shape: ObstacleShape::Indenter(IndenterProfile::Cylinder { radius }),
        sides,
        carrier: None,
    });
    let mut from = body.no_load();
    from.shift[0] = [0.0, size];
    let mut to = from.clone();
    to.shift[0][1] = size - 0.02;
    let mut state = body.at_rest();
    state.shift[0] = [0.0, size + 0.02];
    let mut equations = Equations::new(body).unwrap();
    // Gaps are measured by the body, which is large: what matters here is the contact.
    let settings = NewtonSettings { moving_gap: 1e-5, final_gap: 1e-8, ..NewtonSettings::default() };
    equations.advance(&mut state, &mut from, &to, &settings).unwrap();
    let force = -2.0 * equations.contact_force(0, &state)[1];
    // E* = E / (1 - nu^2) = 4 mu; b^2 = 4 P R / (pi E*), p(x) = 2 P / (pi b^2) sqrt(b^2 - x^2).
    let b2 = force * radius / std::f64::consts::PI;
    let exact = |x: f64| 2.0 * force / (std::f64::consts::PI * b2) * (b2 - x * x).max(0.0).sqrt();
    let touching =
        |x: &[([f64; 2], f64, f64)]| x.iter().filter(|p| p.2 > 1e-3).fold(0.0, |m: f64, p| m.max(p.0[0]));
    let points = equations.contact_pressure(0, &state);
    let touching = touching(&points);
    // Four Gauss points a side: single ones share the force of a side somehow, their mean is the pressure.
    let mut worst: f64 = 0.0;
    for side in points.chunks(4).filter(|side| side[0].0[0].max(side[3].0[0]) < 0.8 * b2.sqrt()) {
        let mean = |f: &dyn Fn(usize) -> f64| {
            [0.3478548451, 0.6521451549, 0.6521451549, 0.3478548451]
                .iter()
                .enumerate()
                .map(|(k, w)| 0.5 * w * f(k))
                .sum::<f64>()
        };
        let (found, exact) = (mean(&|k| side[k].2), mean(&|k| exact(side[k].0[0])));
        worst = worst.max((found / exact - 1.0).abs());
    }
    println!(
        "force {force:.6}, half width {:.4}, touching to {touching:.4}, worst pressure {worst:.1e}",
        b2.sqrt()
    );
    // To the width of a side.
    assert!((touching - b2.sqrt()).abs() < 0.015);
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn the_layer_goes_round_a_corner_to_forty_per_cent_without_penetration_or_tension() {
    let mut model = rounded(4, 1.0, 0.1, false);
    let mut last = 0.0;
    for compression in [0.1, 0.2, 0.3, 0.4] {
        let step = model.press(compression, &NewtonSettings::default()).unwrap();
        println!("{compression} {:.5} {:?}", step.force, step.effort);
        assert!(step.penetration == 0.0 && step.imbalance < 1e-8 && step.effort.residual < 1e-9);
        assert!(step.force > last && step.effort.negative_pivots == 0);
        last = step.force;
        // Pressed or away: never both, and the pressure only pushes.
        for (_, gap, pressure) in model.equations().contact_pressure(0, model.state()) {
            assert!(gap > 0.0 && pressure > 0.0 && gap * pressure < 1.1e-8, "{gap} {pressure}");
        }
    }
    // The flank carries some of it by now.
    let sideways = model.equations().contact_force(0, model.state())[0];
    assert!(sideways > 0.1, "{sideways}");
}

#[test]
fn both_halves_of_a_layer_do_what_one_does_and_mirrored_loads_mirror_the_answer() {
    let settings = NewtonSettings::default();
    let half = rounded(4, 0.5, 0.2, false).press(0.1, &settings).unwrap();
    let whole = rounded(4, 0.5, 0.2, true).press(0.1, &settings).unwrap();
    println!("{} {}", half.force, whole.force);
    assert!((half.force / whole.force - 1.0).abs() < 1e-7);
    let at = |offset: f64| {
        let mut model = rounded_at(offset, 4, 0.5, 0.2, true);
        let force = model.press(0.1, &settings).unwrap().force;
        // To either side of its middle.
        (
            force,
            [0, 1].map(|part| model.equations().contact_force(part, model.state())[0]).iter().sum::<f64>(),
        )
    };
    let (right, left) = (at(0.3), at(-0.3));
    println!("{right:?} {left:?}");
    assert!((right.0 / left.0 - 1.0).abs() < 1e-7 && (right.1 + left.1).abs() < 1e-7);
    assert!(right.1.abs() > 1e-4 && right.0 != whole.force);
}

#[test]
fn pressing_with_a_force_is_the_inverse_of_pressing_by_a_displacement() {
    let settings = NewtonSettings::default();
    let force = rounded(4, 0.5, 0.2, false).press(0.12, &settings).unwrap().force;
    let step = rounded(4, 0.5, 0.2, false).press_with(force, &settings).unwrap();
    println!("{} {}", step.compression, step.effort.solves);
    assert!((step.compression - 0.12).abs() < 1e-6);
}

#[test]
fn the_sharp_punch_goes_to_twenty_per_cent_with_a_force_that_meshes_agree_on() {
    let force = |rings: usize| {
        let mesh = LayerMesh::under_punch(1.0, 6.0, [HALF_WIDTH, 0.5], 8, 0.7, rings);
        let rubber = Rubber { volume_barrier: 5.0, ..Rubber::neo_hookean(1.0) };
        let indenter = Indenter::Held { half_width: HALF_WIDTH };
        let mut model = LayerModel::new(&mesh, rubber, indenter, End::Free).unwrap();
        [0.1, 0.2].map(|u| {
            let step = model.press(u, &NewtonSettings::default()).unwrap();
            assert!(step.penetration == 0.0 && step.imbalance < 1e-8 && step.effort.negative_pivots == 0);
            step.force
        })
    };
    let (coarse, fine) = (force(10), force(14));
    println!("{coarse:?} {fine:?}");
    assert!((0..2).all(|k| (coarse[k] / fine[k] - 1.0).abs() < 5e-3), "{coarse:?} {fine:?}");
}

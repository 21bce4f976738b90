//! Capsules against an integral equation, the ball and themselves.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;
use std::sync::Arc;

use elastocap_case::parse;
use elastocap_coupling::outcome::{Row, Status, StepResult};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_electrostatics::VACUUM_PERMITTIVITY as EPSILON_0;

fn solve(bodies: &str, tolerance: f64) -> StepResult {
    let text = format!(
        "format = 1\n{bodies}[surroundings]\nboundary = \"open\"\n[electrostatics]\nrelative_tolerance = {tolerance}\n"
    );
    let case = parse(&text, Path::new("capsule.toml")).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { prune: true, fields: false, scene: false, model_error: false };
    let mut outcome = run(&case, &Plan::new(&case, &options), &options, &Arc::default(), &());
    outcome.steps.remove(0)
}

fn conductor(from: [f64; 3], to: [f64; 3], radius: f64) -> String {
    let point = |p: [f64; 3]| p.map(|x| format!("\"{x} mm\"")).join(", ");
    format!(
        "[[conductor]]\nname = \"finger\"\ncapsule = {{ from = [{}], to = [{}], radius = \"{radius} mm\" }}\n",
        point(from),
        point(to)
    )
}

/// The capacitance of a capsule in open space, with its bounds, F, and the estimate of what its flat faces
/// change.
fn alone(from: [f64; 3], to: [f64; 3], radius: f64, tolerance: f64) -> ([f64; 3], f64) {
    let step = solve(&conductor(from, to, radius), tolerance);
    assert_eq!(step.row.status, Status::Ok);
    let entry = &step.maxwell.as_ref().expect("a matrix")[0][0];
    ([entry.value, entry.lower, entry.upper], geometry(&step.row))
}

fn geometry(row: &Row) -> f64 {
    row.geometry_error_estimate.expect("faces are flat")
}

/// The capacitance of a capsule in open space, F, by charges on its meridian: constant on each of 2 n panels,
/// with the potential 1 in the middle of each. A ring of charge q and radius s has, at the distance rho from
/// its axis and z from its plane, the potential q / (4 pi eps0 agm(A, B)), where A and B are the largest and
/// the least distance from it.
fn by_integral_equation(distance: f64, radius: f64, n: usize) -> f64 {
    let half = 0.5 * distance + FRAC_PI_2 * radius;
    let step = half / n as f64;
    // Half of the meridian; the other half is its mirror image.
    let place = |s: f64| {
        let angle = (s - 0.5 * distance).max(0.0) / radius;
        [radius * angle.cos(), s.min(0.5 * distance) + radius * angle.sin()]
    };
    let middle = |k: usize| (k as f64 + 0.5) * step;
    let ring = |[rho, z]: [f64; 2], [s, w]: [f64; 2]| {
        let (mut a, mut b) = ((rho + s).hypot(z - w), (rho - s).hypot(z - w));
        while (a - b).abs() > 1e-14 * a {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        1.0 / (4.0 * PI * EPSILON_0 * a)
    };
    // The points are denser towards the middle of a panel, where the potential of the panel itself is
    // logarithmic.
    let points: Vec<[f64; 2]> = (0..24)
        .flat_map(|k| {
            let t = (f64::from(k) + 0.5) / 24.0;
            [-1.0, 1.0].map(|side| [side * 0.5 * t.powi(3), 0.5 * 3.0 * t * t / 24.0])
        })
        .collect();
    let charges = |k: usize| {
        points.iter().map(move |[at, weight]| {
            let [s, z] = place(middle(k) + at * step);
            ([s, z], TAU * s * weight * step)
        })
    };
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let at = place(middle(i));
            let potential =
                |k: usize| charges(k).map(|([s, z], q)| q * (ring(at, [s, z]) + ring(at, [s, -z]))).sum();
            (0..n).map(potential).chain([1.0]).collect()
        })
        .collect();
    // By elimination; the largest entries are on the diagonal.
    for k in 0..n {
        for i in k + 1..n {
            let factor = rows[i][k] / rows[k][k];
            for j in k..=n {
                rows[i][j] -= factor * rows[k][j];
            }
        }
    }
    let mut density = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * density[j]).sum();
        density[k] = (rows[k][n] - known) / rows[k][k];
    }
    (0..n).map(|k| 2.0 * density[k] * charges(k).map(|(_, q)| q).sum::<f64>()).sum()
}

#[test]
fn the_integral_equation_has_the_capacitance_of_a_ball() {
    let found = by_integral_equation(0.0, 1.0, 60);
    assert!((found / (4.0 * PI * EPSILON_0) - 1.0).abs() < 2e-4, "{found:e}");
}

#[test]
fn capsules_have_the_capacitance_of_the_integral_equation() {
    for (length, tolerance) in [(2.0, 4e-3), (20.0, 4e-3), (200.0, 2e-2)] {
        let expected = by_integral_equation(1e-3 * length, 1e-3, 160);
        let ([value, lower, upper], flat) =
            alone([0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length], 1.0, tolerance);
        let off = flat * value;
        assert!(
            lower - off <= expected && expected <= upper + off,
            "{length}: {lower:e} {expected:e} {upper:e}, {off:e}"
        );
        assert!((value / expected - 1.0).abs() < 0.5 * tolerance, "{length}: {value:e} {expected:e}");
        // A spheroid inside, and one around it that is 1.5 times as thick, have closed forms.
        let spheroid = |a: f64, b: f64| {
            let c = 1e-3 * (a * a - b * b).sqrt();
            4.0 * PI * EPSILON_0 * c / (c / (1e-3 * a)).atanh()
        };
        let (h, b): (f64, f64) = (0.5 * length, 1.5);
        // Through the ends of the cylinder and beyond those of the caps.
        let a = (h / (1.0 - 1.0 / (b * b)).sqrt()).max(h + b);
        assert!(spheroid(h + 1.0, 1.0) < upper && lower < spheroid(a, b), "{length}");
    }
}

#[test]
fn a_capsule_whose_ends_coincide_is_a_ball() {
    let ([value, lower, upper], flat) = alone([1.0; 3], [1.0; 3], 2.0, 2e-3);
    let ball = 4.0 * PI * EPSILON_0 * 2e-3;
    assert!(lower - flat * value <= ball && ball <= upper + flat * value, "{lower:e} {ball:e} {upper:e}");
    assert!((value / ball - 1.0).abs() < 1e-3);
}

#[test]
fn a_capsule_is_the_same_either_way_round_in_any_direction_and_any_size() {
    // All of length sqrt(300) and radius 1, or twice that.
    let along = 300.0_f64.sqrt();
    let tolerance = 2e-2;
    let capsules = [
        alone([0.0; 3], [10.0, 10.0, 10.0], 1.0, tolerance).0,
        alone([10.0, 10.0, 10.0], [0.0; 3], 1.0, tolerance).0,
        alone([0.0; 3], [0.0, along, 0.0], 1.0, tolerance).0,
        alone([0.0; 3], [2.0 * along, 0.0, 0.0], 2.0, tolerance).0.map(|c| 0.5 * c),
    ];
    for [value, ..] in capsules {
        assert!(capsules.iter().all(|[_, lower, upper]| *lower <= value && value <= *upper), "{capsules:?}");
    }
    let longer = alone([0.0; 3], [0.0, 1.2 * along, 0.0], 1.0, tolerance).0;
    assert!(longer[1] > capsules[2][2], "{longer:?} {capsules:?}");
}

#[test]
fn a_capsule_of_a_dielectric_raises_the_capacitance_of_the_body_in_it() {
    let body = conductor([0.0, 3.0, 0.0], [2.0, 6.0, 0.0], 1.0);
    let skin = |permittivity: f64| {
        format!(
            "[[dielectric]]\nname = \"skin\"\nrelative_permittivity = {permittivity:?}\n\
             capsule = {{ from = [\"0 mm\", \"3 mm\", \"0 mm\"], to = [\"2 mm\", \"6 mm\", \"0 mm\"], radius = \"1.5 mm\" }}\n"
        )
    };
    let bounds = |permittivity| {
        let step = solve(&format!("{body}{}", skin(permittivity)), 3e-2);
        let entry = &step.maxwell.as_ref().expect("a matrix")[0][0];
        [entry.lower, entry.upper]
    };
    let (air, bare, silicone) =
        (bounds(1.0), alone([0.0, 3.0, 0.0], [2.0, 6.0, 0.0], 1.0, 3e-2).0, bounds(5.0));
    assert!(air[0] <= bare[2] && bare[1] <= air[1], "a skin of air is none");
    assert!(silicone[0] > 1.1 * air[1], "{silicone:?} {air:?}");
}

#[test]
fn capsules_that_touch_other_conductors_are_refused() {
    let finger = conductor([0.0, 0.0, -10.0], [0.0, 0.0, 10.0], 1.0);
    for other in [
        // Across it, and a box that it goes through.
        "capsule = { from = [\"-5 mm\", \"0 mm\", \"0 mm\"], to = [\"5 mm\", \"1 mm\", \"0 mm\"], radius = \"0.5 mm\" }",
        "box = { min = [\"-5 mm\", \"0 mm\", \"0 mm\"], max = [\"9 mm\", \"0.5 mm\", \"1 mm\"] }",
        "sphere = { center = [\"0 mm\", \"1.5 mm\", \"3 mm\"], radius = \"0.6 mm\" }",
    ] {
        let step = solve(&format!("{finger}[[conductor]]\nname = \"other\"\n{other}\n"), 5e-2);
        let Status::Failed(failure) = &step.row.status else { panic!("{other}: {:?}", step.row.status) };
        let message = failure.to_string();
        assert!(
            message.contains("finger") && message.contains("other") && message.contains("touch"),
            "{message}"
        );
    }
}

//! Energies against closed forms, against finer rules, and against each other.

use super::functions::orthonormal;
use super::rules::{MORE_POINTS, triangle_rule};
use super::*;
use crate::bent::{Curve, WHOLE};
use elastocap_linalg::dense::{self, Llt};
use faer::Mat;

const SKEW: Triangle = Triangle { corners: [[0.3, -0.1], [1.7, 0.4], [0.1, 0.9]], bent: None };

/// Between an arc of 45 degrees of the unit circle and a point, inside or outside of it, and a part of that
/// at the arc.
fn bent(third: [f64; 2]) -> [Triangle; 2] {
    let end = [0.5_f64.sqrt(); 2];
    let curve = Curve::Arc { center: [0.0; 2] };
    let whole = Bent { corners: [[1.0, 0.0], end, third], curve };
    let places = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [0.2, 0.0], [0.1, 0.3]]];
    places.map(|shares| Triangle { corners: shares.map(|s| whole.place(s)), bent: Some((whole, shares)) })
}

#[test]
fn the_area_of_a_bent_triangle_is_that_of_the_straight_one_and_of_the_segment_of_the_circle() {
    let angle = std::f64::consts::FRAC_PI_4;
    let segment = 0.5 * (angle - angle.sin());
    for (third, sign) in [([0.0, 0.0], 1.0), ([1.2, 0.9], -1.0)] {
        let [whole, _] = bent(third);
        let (mass, _) = PotentialIntegrals::new(3).on(&whole).unwrap();
        let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
        let exact = 0.5 * whole.double_area() + sign * segment;
        assert!((area - exact).abs() < 1e-13, "{third:?}: {area} {exact}");
    }
}

/// Between a cubic and a point, and a part of that at the cubic; the control points are off a third of the
/// chord by `bow` times what `random` says.
fn at_cubic(bow: f64, mut random: impl FnMut() -> f64) -> [Triangle; 2] {
    let mut off = |place: f64| [place + bow * random(), bow * random()];
    let control = [off(1.0 / 3.0), off(2.0 / 3.0)];
    let third = [0.5 + 0.6 * random(), 0.6 + 0.4 * random()];
    let whole = Bent { corners: [[0.0; 2], [1.0, 0.0], third], curve: Curve::Cubic { control } };
    [WHOLE, [[0.1, 0.0], [0.3, 0.0], [0.2, 0.4]]]
        .map(|shares| Triangle { corners: shares.map(|s| whole.place(s)), bent: Some((whole, shares)) })
}

/// Numbers between -1/2 and 1/2.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// At least the greatest relative difference of the energies that two forms give.
fn relative_error(found: &Mat<f64>, exact: &Mat<f64>) -> f64 {
    let root = Llt::new(exact.as_ref()).unwrap();
    let mut differ = Mat::from_fn(exact.nrows(), exact.ncols(), |i, j| found[(i, j)] - exact[(i, j)]);
    dense::solve_lower_triangular(root.lower(), differ.as_mut());
    let mut differ = differ.transpose().to_owned();
    dense::solve_lower_triangular(root.lower(), differ.as_mut());
    differ.norm_l2()
}

#[test]
fn more_points_change_no_energy_on_a_bent_triangle_by_the_allowance_for_them() {
    let mut random = noise();
    let cubics = (0..40).flat_map(|k| at_cubic(0.04 * f64::from(k % 20), &mut random));
    let triangles = bent([0.0, 0.0]).into_iter().chain(bent([1.3, 0.7])).chain(cubics);
    let degrees = [2, 6].map(|p| (PotentialIntegrals::new(p), FluxIntegrals::new(p)));
    let mut used = std::collections::BTreeSet::new();
    for (k, triangle) in triangles.enumerate() {
        let (potentials, fluxes) = &degrees[k / 2 % 2];
        let Some((whole, part)) = triangle.bent else { panic!() };
        let evenness = whole.stretch(part).evenness();
        let Some(rule) = MORE_POINTS.iter().position(|(least, _)| evenness >= *least) else { continue };
        used.insert(rule);
        compare(&triangle, potentials, fluxes, 0.0);
    }
    assert!(used.len() == MORE_POINTS.len(), "{used:?}");
}

/// Compares the energies on a bent triangle with those by more points.
fn compare(triangle: &Triangle, potentials: &PotentialIntegrals, fluxes: &FluxIntegrals, rounding: f64) {
    let forms = |further: usize| {
        let (mass, stiffness) = potentials.on_bent(triangle, further).unwrap();
        let beyond = potentials.beyond_bent(triangle, 1.0, further).unwrap();
        [&mass + &stiffness, mass, fluxes.on_bent(triangle, further).unwrap().mass, beyond]
    };
    for (found, exact) in forms(0).iter().zip(&forms(12)) {
        let mut exact = exact.clone();
        // Energies that are much smaller than others of the same triangle, as in slivers, are lost in
        // rounding.
        let greatest = (0..exact.nrows()).map(|i| exact[(i, i)]).fold(0.0, f64::max);
        let mut found = found.clone();
        for i in 0..exact.nrows() {
            exact[(i, i)] += rounding * greatest;
            found[(i, i)] += rounding * greatest;
        }
        let error = relative_error(&found, &exact);
        assert!(
            error < 5e-11,
            "{triangle:?}: {:?}, {error:e}",
            triangle.bent.map(|(b, part)| b.stretch(part))
        );
    }
}

/// Between an arc from (1, 0) and a point on the tangent there, or off it by an angle, either way round.
fn needles(angle: f64, off: f64, length: f64) -> [Triangle; 3] {
    let [p, q] = [[1.0, 0.0], [angle.cos(), angle.sin()]];
    let third = [1.0 + length * off.sin(), length * off.cos()];
    let curve = Curve::Arc { center: [0.0; 2] };
    let whole = Bent { corners: [p, q, third], curve };
    let reversed = Bent { corners: [q, p, third], curve };
    let [a, b, c] = WHOLE;
    let part = [[0.0, 0.0], [0.2, 0.0], [0.1, 0.3]];
    [(whole, WHOLE), (reversed, [c, a, b]), (whole, part)].map(|(whole, shares)| Triangle {
        corners: shares.map(|s| whole.place(s)),
        bent: Some((whole, shares)),
    })
}

#[test]
fn needles_between_an_arc_and_its_tangent_are_integrated_up_to_the_tip_or_refused() {
    let degrees = [2, 5].map(|p| (PotentialIntegrals::new(p), FluxIntegrals::new(p)));
    let [mut found, mut refused] = [0; 2];
    for angle in [0.3_f64, 0.78] {
        for off in [0.0, 1e-13, 1e-6, 1e-2] {
            for share in [0.3, 0.5, 0.6, 1.0] {
                for triangle in needles(angle, off, share * angle) {
                    for (potentials, fluxes) in &degrees {
                        match potentials.on(&triangle) {
                            Ok(_) => {
                                found += 1;
                                compare(&triangle, potentials, fluxes, 1e-3);
                            }
                            Err(Folded) => {
                                refused += 1;
                                assert!(share <= 0.6, "{angle} {off} {share}");
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(found > 90 && refused > 0, "{found} {refused}");
}

#[test]
fn the_area_of_a_needle_is_that_between_the_tangent_and_the_circle() {
    let angle = 0.4_f64;
    for triangle in &needles(angle, 0.0, angle)[..2] {
        let (mass, _) = PotentialIntegrals::new(3).on(triangle).unwrap();
        let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
        let exact = 0.5 * triangle.double_area() - 0.5 * (angle - angle.sin());
        assert!((area - exact).abs() < 1e-15, "{area} {exact}");
    }
}

#[test]
fn the_area_at_a_cubic_is_that_of_the_straight_triangle_and_of_what_lies_between_the_cubic_and_its_chord() {
    let mut random = noise();
    for _ in 0..10 {
        let [whole, _] = at_cubic(0.2, &mut random);
        let Some((Bent { curve: Curve::Cubic { control: [p, q] }, .. }, _)) = whole.bent else { panic!() };
        let (mass, _) = PotentialIntegrals::new(2).on(&whole).unwrap();
        let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
        // From Green's formula: the integral of (x dy - y dx) / 2 along a Bezier curve from (0, 0) to (1, 0).
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let beside = 0.15 * (cross(p, q) + cross(p, [1.0, 0.0]) + 2.0 * cross(q, [1.0, 0.0]));
        let exact = 0.5 * whole.double_area() + beside;
        assert!((area - exact).abs() < 1e-14, "{area} {exact}");
    }
}

#[test]
fn the_constant_has_no_flux_and_leaves_none_on_a_bent_triangle() {
    let cubics = (0..4).flat_map(|_| at_cubic(0.2, noise()));
    for triangle in bent([0.0, 0.0]).into_iter().chain(bent([1.3, 0.7])).chain(cubics) {
        let p = 4;
        let FluxForms { constraints, one, .. } = FluxIntegrals::new(p).on(&triangle).unwrap();
        for flux in 0..constraints.ncols() {
            let inside: f64 = one.iter().enumerate().map(|(i, x)| x * constraints[(i, flux)]).sum();
            let through: f64 = (0..3)
                .map(|side| constraints[(divergences(p) + side * p, flux)] * triangle.length(side).sqrt())
                .sum();
            assert!((inside - through).abs() < 1e-12, "{flux}: {inside} {through}");
        }
    }
}

#[test]
fn a_triangle_on_the_wrong_side_of_its_arc_is_refused() {
    let [whole, _] = bent([0.9, 0.38]);
    assert_eq!(PotentialIntegrals::new(2).on(&whole).err(), Some(Folded));
    assert_eq!(FluxIntegrals::new(2).on(&whole), Err(Folded));
}

#[test]
fn a_linear_potential_has_the_energy_of_its_gradient() {
    let (mass, stiffness) = PotentialIntegrals::new(4).on(&SKEW).unwrap();
    let area = 0.5 * SKEW.double_area();
    // 2 x - 3 y has its values at the corners as coefficients.
    let u = SKEW.corners.map(|c| 2.0 * c[0] - 3.0 * c[1]);
    let form = |m: &Mat<f64>, u: &[f64; 3]| {
        (0..3).map(|i| (0..3).map(|j| u[i] * m[(i, j)] * u[j]).sum::<f64>()).sum::<f64>()
    };
    assert!((form(&stiffness, &u) - 13.0 * area).abs() < 1e-12);
    assert!((form(&mass, &[1.0; 3]) - area).abs() < 1e-14);
}

#[test]
fn what_a_flux_diverges_leaves_through_the_sides_in_either_orientation() {
    let [a, b, c] = SKEW.corners;
    for (p, triangle) in [(1, SKEW), (3, SKEW), (4, Triangle { corners: [a, c, b], bent: None })] {
        let constraints = FluxIntegrals::new(p).on(&triangle).unwrap().constraints;
        let count = divergences(p);
        for flux in 0..constraints.ncols() {
            let inside = constraints[(0, flux)] * (0.5 * triangle.double_area()).sqrt();
            let through: f64 =
                (0..3).map(|side| constraints[(count + side * p, flux)] * triangle.length(side).sqrt()).sum();
            assert!((inside - through).abs() < 1e-12, "{p} {flux}: {inside} {through}");
        }
    }
}

#[test]
fn the_flux_between_the_traces_of_a_linear_potential_is_its_gradient() {
    let (p, triangle) = (3, SKEW);
    let FluxForms { mass, constraints, .. } = FluxIntegrals::new(p).on(&triangle).unwrap();
    // On each side the trace of 2 x - 3 y, inside minus its mean: the flux has no divergence then.
    let u = |x: [f64; 2]| 2.0 * x[0] - 3.0 * x[1];
    let mut drive = Mat::zeros(constraints.nrows(), 1);
    for (side, [a, b]) in SIDES.iter().enumerate() {
        let (from, to) = (u(triangle.corners[*a]), u(triangle.corners[*b]));
        let root = triangle.length(side).sqrt();
        let first = divergences(p) + side * p;
        drive[(first, 0)] = 0.5 * (from + to) * root;
        drive[(first + 1, 0)] = 0.5 * (to - from) * root / 3.0_f64.sqrt();
    }
    for (point, w) in triangle_rule(p + 2) {
        let [v, t] = triangle.sides();
        let a = triangle.corners[0];
        let x = [0, 1].map(|k| a[k] + point[0] * v[k] + point[1] * t[k]);
        for (i, q) in orthonormal(p - 1, point).iter().enumerate() {
            drive[(i, 0)] -= w * q.value * u(x) * triangle.double_area().sqrt();
        }
    }
    let source = dense::product(constraints.transpose(), drive.as_ref());
    let flux = Llt::new(mass.as_ref()).unwrap().solve(source.as_ref());
    let energy = dense::product(flux.transpose(), source.as_ref())[(0, 0)];
    assert!((energy - 13.0 * 0.5 * triangle.double_area()).abs() < 1e-11, "{energy}");
    let rest = dense::product(constraints.as_ref(), flux.as_ref());
    assert!((0..divergences(p)).all(|i| rest[(i, 0)].abs() < 1e-11));
}

//! The sensitivity dC/dF of a curve, by differences between its steps.
//!
//! The value is the derivative of the parabola through a step and the two nearest ones. Its error is the
//! distance to other estimates of the same derivative. Around a step, the polynomials through three or four
//! neighbouring steps that include it bracket the derivative of a smooth curve, as their errors have both
//! signs. At the first and the last step they do not: there all of them are on one side of the derivative. If
//! the force grows faster than the compression, the curve is steep at rest, although capacitance and force
//! are both smooth functions of the compression. So derivatives by the compression U count as estimates, too:
//! dC/dF = (dC/dU) / (dF/dU).
//!
//! The errors of the capacitances are added. Those from bounds, the layer's mesh and flat faces may differ
//! from step to step. The error of the model of the layer grows with the load as the change does, and has the
//! same sign at all steps: the error of the derivative is the derivative of that error, and at least the
//! relative error of the change up to the step. If the sign of a change is not known, that of its slope is
//! not either.

use elastocap_case::Case;
use elastocap_electrostatics::Bounded;

use crate::load_steps::StepLoad;
use crate::outcome::StepResult;

/// A step with a force.
#[derive(Debug, Clone, Copy)]
struct Point {
    force: f64,
    /// The estimated relative error of the force; 0 where there is no estimate.
    force_error: f64,
    compression: f64,
    capacitance: Bounded,
    /// The estimated error of the capacitance from the layer's mesh and flat faces, F.
    mesh_error: f64,
    /// The error of the capacitance from the model of the layer, F.
    model_error: f64,
}

/// An estimate of dC/dF with its uncertainty from the errors of the capacitances, F/N.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    value: f64,
    /// The part from bounds, the layer's mesh and flat faces.
    field: f64,
    /// The part from the model of the layer.
    model: f64,
}

/// Writes dC/dF and its error to the rows of a curve, whose errors are known, replacing earlier values. They
/// are left empty where steps differ not only in the force.
pub(crate) fn note_sensitivities(case: &Case, steps: &mut [StepResult]) {
    // Before contact there is no force.
    let mut pressed = case.poses.iter().filter(|pose| pose.distance == 0.0);
    let first = pressed.next();
    let is_pure = pressed.all(|pose| Some(pose) == first);
    let mut points: Vec<Point> = if is_pure { steps.iter().filter_map(point).collect() } else { Vec::new() };
    points.sort_by(|a, b| a.force.total_cmp(&b.force));
    points.dedup_by(|a, b| a.force == b.force);
    for step in steps {
        let found = point(step)
            .and_then(|point| points.iter().position(|other| other.force == point.force))
            .and_then(|at| sensitivity(&points, at));
        step.row.sensitivity_f_per_n = found.map(|(value, _)| value);
        step.row.sensitivity_error_f_per_n = found.and_then(|(_, error)| error);
    }
}

fn point(step: &StepResult) -> Option<Point> {
    if step.row.is_before_contact() {
        return None;
    }
    let row = &step.row;
    // If the force is given, the error of the model is included in that of the capacitance.
    let force_error = match step.load {
        StepLoad::Compression(_) => row.force_error_estimate,
        StepLoad::None | StepLoad::ForceN(_) => {
            step.layer.as_ref().and_then(|layer| layer.relative_error_estimate)
        }
    };
    let capacitance = step.measured?;
    let absolute = |errors: &[Option<f64>]| errors.iter().flatten().sum::<f64>() * capacitance.value.abs();
    Some(Point {
        force: row.force_n.filter(|force| force.is_finite())?,
        force_error: force_error.filter(|error| error.is_finite()).unwrap_or(0.0),
        compression: row.compression.filter(|compression| compression.is_finite())?,
        capacitance,
        mesh_error: absolute(&[row.mechanics_error_estimate, row.geometry_error_estimate]),
        model_error: absolute(&[row.model_error_estimate]),
    })
}

/// The derivative at one of the points, in ascending order, by the parabola through it and the two nearest,
/// F/N, and its error: the distance to other estimates, with the uncertainty of each, and the error of the
/// force. Two points give the slope of a line without an error. There is no error either at an end where the
/// force is not known well enough as a function of the compression. `None` for a derivative without an error
/// whose sign is uncertain.
fn sensitivity(points: &[Point], at: usize) -> Option<(f64, Option<f64>)> {
    let force = points.get(at)?.force;
    let by_force = |window: &[Point]| estimate(window, force, |point| point.force);
    let three = nearest(points, at, 3);
    let nearest = three.or_else(|| nearest(points, at, 2))?;
    let found = by_force(nearest)?;
    let share = model_share(points, at);
    let open = |estimate: &Estimate| estimate.field + estimate.model.max(share * found.value.abs());
    let has_sign = found.value == 0.0 || open(&found) < found.value.abs();
    let without_error = || has_sign.then_some((found.value, None));
    if three.is_none() {
        return without_error();
    }
    let is_end = at == 0 || at + 1 == points.len();
    // With three points there is only one parabola, which is compared with the secants.
    let fewest = if is_end || points.len() == 3 { 2 } else { 3 };
    let windows = || (fewest..=4).flat_map(|count| around(points, at, count));
    let by_compression: Vec<Option<Estimate>> =
        windows().map(|window| over_compression(window, force)).collect();
    if is_end && by_compression.iter().any(Option::is_none) {
        return without_error();
    }
    let others = windows().filter_map(by_force).chain(by_compression.into_iter().flatten());
    let off =
        others.map(|other| (other.value - found.value).abs() + open(&other)).fold(open(&found), f64::max);
    let force_error = nearest.iter().map(|point| point.force_error).fold(0.0, f64::max);
    let error = off + force_error * found.value.abs();
    error.is_finite().then_some((found.value, Some(error)))
}

/// The largest relative error, from the model of the layer, of the change from the first point to one of the
/// points or its neighbours. The change counts the absolute changes between all points on the way.
fn model_share(points: &[Point], at: usize) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let mut change = 0.0;
    let shares = points.windows(2).map(|pair| {
        let [before, after] = pair else { return 0.0 };
        change += (after.capacitance.value - before.capacitance.value).abs();
        (after.model_error + first.model_error) / change
    });
    // The share at `place` is that of the point after it.
    let near =
        shares.enumerate().filter(|(place, share)| share.is_finite() && (*place..*place + 3).contains(&at));
    near.map(|(_, share)| share).fold(0.0, f64::max)
}

/// The windows of `count` neighbouring points that include the point `at`.
fn around(points: &[Point], at: usize, count: usize) -> impl Iterator<Item = &[Point]> {
    points
        .windows(count)
        .enumerate()
        .filter(move |(first, _)| (*first..first + count).contains(&at))
        .map(|(_, window)| window)
}

/// The `count` points nearest to the point `at`, including it; `None` if there are fewer.
fn nearest(points: &[Point], at: usize, count: usize) -> Option<&[Point]> {
    let force = points.get(at)?.force;
    let reach =
        |window: &&[Point]| window.iter().map(|point| (point.force - force).abs()).fold(0.0, f64::max);
    around(points, at, count).min_by(|a, b| reach(a).total_cmp(&reach(b)))
}

/// The derivative of the capacitance by `x`, at the point with this force, of the polynomial through all
/// points; `None` where points are too close together.
fn estimate(points: &[Point], force: f64, x: fn(&Point) -> f64) -> Option<Estimate> {
    let weights = weights(points, force, x)?;
    let half = |point: &Point| 0.5 * (point.capacitance.upper - point.capacitance.lower) + point.mesh_error;
    let pairs = || points.iter().zip(&weights);
    let value = pairs().map(|(point, weight)| weight * point.capacitance.value).sum::<f64>();
    let field = pairs().map(|(point, weight)| weight.abs() * half(point)).sum::<f64>();
    let model = pairs().map(|(point, weight)| weight * point.model_error).sum::<f64>().abs();
    (value.is_finite() && field.is_finite() && model.is_finite()).then_some(Estimate { value, field, model })
}

/// dC/dF at the point with this force, by polynomials of the compression; `None` where the force does not
/// increase with the compression.
fn over_compression(points: &[Point], force: f64) -> Option<Estimate> {
    let compression: fn(&Point) -> f64 = |point| point.compression;
    let weights = weights(points, force, compression)?;
    let stiffness = points.iter().zip(&weights).map(|(point, weight)| weight * point.force).sum::<f64>();
    let Estimate { value, field, model } = estimate(points, force, compression)?;
    let by_force = |slope: f64| slope / stiffness;
    (stiffness > 0.0).then(|| Estimate {
        value: by_force(value),
        field: by_force(field),
        model: by_force(model),
    })
}

/// The weights of the values at all points in the derivative by `x`, at the point with this force, of the
/// polynomial through them.
fn weights(points: &[Point], force: f64, x: fn(&Point) -> f64) -> Option<Vec<f64>> {
    let at = points.iter().position(|point| point.force == force)?;
    let places: Vec<f64> = points.iter().map(x).collect();
    let others = |j: usize| places.iter().enumerate().filter(move |(m, _)| *m != j);
    let weight = |j: usize| {
        if j == at {
            return others(j).map(|(_, x)| 1.0 / (places[at] - x)).sum::<f64>();
        }
        let above: f64 = others(j).filter(|(m, _)| *m != at).map(|(_, x)| places[at] - x).product();
        let below: f64 = others(j).map(|(_, x)| places[j] - x).product();
        above / below
    };
    let weights: Vec<f64> = (0..points.len()).map(weight).collect();
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Formula = fn(f64) -> f64;

    /// Points at some compressions, with capacitance and force as functions of the compression.
    fn points(compressions: &[f64], half: f64, capacitance: Formula, force: Formula) -> Vec<Point> {
        let point = |compression: &f64| {
            let value = capacitance(*compression);
            let capacitance = Bounded { value, lower: value - half, upper: value + half };
            Point {
                force: force(*compression),
                force_error: 0.0,
                compression: *compression,
                capacitance,
                mesh_error: 0.0,
                model_error: 0.0,
            }
        };
        compressions.iter().map(point).collect()
    }

    #[test]
    fn a_parabola_has_its_own_slope_at_uneven_steps() {
        let points = points(&[0.0, 1.0, 3.0, 4.5], 0.0, |x| 2.0 - 3.0 * x + 0.25 * x * x, |x| x);
        for (at, point) in points.iter().enumerate().skip(1).take(2) {
            let (slope, error) = sensitivity(&points, at).unwrap();
            assert!((slope - (-3.0 + 0.5 * point.force)).abs() < 1e-12, "{slope}");
            assert!(error.unwrap() < 1e-12);
        }
    }

    /// Capacitance and force as functions of the compression, with their derivatives: a pair that opens,
    /// plates that close, and a decaying fringing field, under stiffening forces.
    const SENSORS: [[Formula; 4]; 3] = [
        [
            |u| 44.0 - 22.0 * u - 10.0 * u * u,
            |u| u / (1.0 - u).powi(2),
            |u| -22.0 - 20.0 * u,
            |u| (1.0 + u) / (1.0 - u).powi(3),
        ],
        [
            |u| 1.0 / (1.0 - 1.5 * u),
            |u| u + 4.0 * u.powi(3),
            |u| 1.5 / (1.0 - 1.5 * u).powi(2),
            |u| 1.0 + 12.0 * u * u,
        ],
        [
            |u| (-4.0 * u).exp(),
            |u| (1.0 - u).powi(-4) - 1.0,
            |u| -4.0 * (-4.0 * u).exp(),
            |u| 4.0 * (1.0 - u).powi(-5),
        ],
    ];

    #[test]
    fn the_error_covers_the_slope_at_random_steps_and_is_a_share_of_it_where_they_are_many() {
        let mut state = 5_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for [capacitance, force, rise, stiffness] in SENSORS {
            let exact = |point: &Point| rise(point.compression) / stiffness(point.compression);
            let (mut rows, mut covered, mut known) = (0, 0, 0);
            for round in 0..400 {
                let mut steps: Vec<f64> =
                    (0..2 + round % 6).map(|_| 0.05 + 0.4 * random().powi(1 + round % 2)).collect();
                steps.push(0.0);
                steps.sort_by(f64::total_cmp);
                let points = points(&steps, 0.0, capacitance, force);
                for (at, point) in points.iter().enumerate() {
                    let (slope, error) = sensitivity(&points, at).unwrap();
                    rows += 1;
                    let Some(error) = error else { continue };
                    known += 1;
                    covered += u32::from((slope - exact(point)).abs() <= error);
                }
            }
            assert!(f64::from(covered) >= 0.99 * f64::from(known), "{covered} of {known}");
            assert!(f64::from(known) >= 0.8 * f64::from(rows), "{known} of {rows}");
            let even: Vec<f64> = (0..9).map(|k| 0.05 * f64::from(k)).collect();
            let points = points(&even, 0.0, capacitance, force);
            let largest = points.iter().map(|point| exact(point).abs()).fold(0.0, f64::max);
            for at in 1..8 {
                let error = sensitivity(&points, at).unwrap().1.unwrap();
                assert!(error < 0.1 * largest, "{at}: {error} of {largest}");
            }
        }
    }

    #[test]
    fn the_bounds_of_steps_leave_a_slope_open() {
        // Two states 1 N apart, each known to 0.1 F, with another in the middle: the secants are known to 0.4
        // F/N.
        let rough = points(&[0.0, 0.5, 1.0], 0.1, |x| 5.0 - x, |x| x);
        assert!((sensitivity(&rough, 1).unwrap().1.unwrap() - 0.4).abs() < 1e-12);
    }

    /// Points whose model error is this share of the change of the capacitance.
    fn in_model(compressions: &[f64], share: f64) -> Vec<Point> {
        let mut points = points(compressions, 0.0, |u| 40.0 - 20.0 * u, |u| u + u * u);
        points.iter_mut().for_each(|point| point.model_error = share * (40.0 - point.capacitance.value));
        points
    }

    #[test]
    fn a_slope_is_off_by_the_share_that_the_model_leaves_open_of_the_change_and_has_no_sign_where_that_has_none()
     {
        let steps = [0.0, 0.05, 0.1, 0.15, 0.2];
        for (share, is_signed) in [(0.3, true), (1.2, false)] {
            let (points, exact) = (in_model(&steps, share), in_model(&steps, 0.0));
            for at in 0..steps.len() {
                let ((slope, error), (_, alone)) =
                    (sensitivity(&points, at).unwrap(), sensitivity(&exact, at).unwrap());
                let (error, alone) = (error.unwrap(), alone.unwrap());
                assert!(error >= alone + 0.999 * share * slope.abs(), "{at}: {slope} +- {error}, {alone}");
                assert!(
                    error <= (1.0 + share) * alone + 1.001 * share * slope.abs(),
                    "{at}: {error}, {alone}"
                );
                assert!(is_signed == (error < slope.abs()) || at == 0, "{at}: {slope} +- {error}");
            }
            // With two steps the slope has no error, so only its sign decides.
            assert_eq!(sensitivity(&in_model(&[0.0, 0.2], share), 1).is_some(), is_signed);
        }
    }

    #[test]
    fn an_error_of_the_mesh_counts_as_the_bounds_do() {
        let mut rough = points(&[0.0, 0.5, 1.0], 0.0, |x| 5.0 - x, |x| x);
        rough.iter_mut().for_each(|point| point.mesh_error = 0.1);
        assert!((sensitivity(&rough, 1).unwrap().1.unwrap() - 0.4).abs() < 1e-12);
    }

    #[test]
    fn two_steps_have_a_slope_without_an_error_and_one_has_none() {
        let two = points(&[0.0, 2.0], 0.0, |x| 1.0 + x, |x| x);
        assert_eq!(sensitivity(&two, 1), Some((1.0, None)));
        assert!(sensitivity(&two[..1], 0).is_none());
    }
}

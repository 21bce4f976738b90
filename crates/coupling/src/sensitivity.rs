//! The sensitivity dC/dF of a curve, by differences between its steps.

use elastocap_case::Case;
use elastocap_electrostatics::Bounded;

use crate::outcome::StepResult;

/// A step with a force.
#[derive(Debug, Clone, Copy)]
struct Point {
    force: f64,
    /// The estimated relative error of the force; 0 where there is no estimate.
    force_error: f64,
    capacitance: Bounded,
}

/// Notes dC/dF and its error in the rows of a curve, in place of what they had before. Left empty where steps differ by more than
/// the force.
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
            .and_then(|own| points.iter().position(|other| other.force == own.force))
            .and_then(|at| sensitivity(&points, at));
        step.row.sensitivity_f_per_n = found.map(|(value, _)| value);
        step.row.sensitivity_error_f_per_n = found.and_then(|(_, error)| error);
    }
}

fn point(step: &StepResult) -> Option<Point> {
    if step.row.is_before_contact() {
        return None;
    }
    let layer = step.layer.as_ref().and_then(|layer| layer.relative_error_estimate);
    Some(Point {
        force: step.row.force_n.filter(|force| force.is_finite())?,
        force_error: layer.filter(|error| error.is_finite()).unwrap_or(0.0),
        capacitance: step.measured?,
    })
}

/// The derivative at one of the points, which ascend, by the parabola through it and the two nearest, F/N, and its error: what the bounds
/// leave open, what one point more changes, and the error of the force. With two points it is that of a line, without an error.
fn sensitivity(points: &[Point], at: usize) -> Option<(f64, Option<f64>)> {
    let by = |count: usize| {
        let nearest = nearest(points, at, count)?;
        let weights = weights(nearest, points.get(at)?.force)?;
        Some((nearest, weights))
    };
    let value = |(near, weights): &(&[Point], Vec<f64>)| {
        near.iter().zip(weights).map(|(point, weight)| weight * point.capacitance.value).sum::<f64>()
    };
    let line = by(2)?;
    let Some(parabola) = by(3) else { return Some((value(&line), None)) };
    let found = value(&parabola);
    let other = by(4).as_ref().map_or_else(|| value(&line), value);
    let (near, weights) = &parabola;
    let half = |point: &Point| 0.5 * (point.capacitance.upper - point.capacitance.lower);
    let field: f64 = near.iter().zip(weights).map(|(point, weight)| weight.abs() * half(point)).sum();
    let force = near.iter().map(|point| point.force_error).fold(0.0, f64::max);
    let error = field + (found - other).abs() + force * found.abs();
    (found.is_finite() && error.is_finite()).then_some((found, Some(error)))
}

/// The `count` points nearest to one of them, itself among them; `None` if there are fewer.
fn nearest(points: &[Point], at: usize, count: usize) -> Option<&[Point]> {
    let own = points.get(at)?.force;
    let reach = |window: &&[Point]| window.iter().map(|point| (point.force - own).abs()).fold(0.0, f64::max);
    let around = points.windows(count).filter(|window| window.iter().any(|point| point.force == own));
    around.min_by(|a, b| reach(a).total_cmp(&reach(b)))
}

/// The weights of the values at points in the derivative, at one of them, of the polynomial through all.
fn weights(points: &[Point], at: f64) -> Option<Vec<f64>> {
    let others = |j: usize| points.iter().enumerate().filter(move |(m, _)| *m != j).map(|(_, p)| p.force);
    let weight = |(j, own): (usize, &Point)| {
        if own.force == at {
            return others(j).map(|x| 1.0 / (at - x)).sum::<f64>();
        }
        let above: f64 = others(j).filter(|x| *x != at).map(|x| at - x).product();
        let below: f64 = others(j).map(|x| own.force - x).product();
        above / below
    };
    let weights: Vec<f64> = points.iter().enumerate().map(weight).collect();
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(forces: &[f64], half: f64, of: impl Fn(f64) -> f64) -> Vec<Point> {
        let point = |force: &f64| {
            let value = of(*force);
            let capacitance = Bounded { value, lower: value - half, upper: value + half };
            Point { force: *force, force_error: 0.0, capacitance }
        };
        forces.iter().map(point).collect()
    }

    #[test]
    fn a_parabola_has_its_own_slope_at_uneven_steps() {
        let points = points(&[0.0, 1.0, 3.0, 4.5], 0.0, |x| 2.0 - 3.0 * x + 0.25 * x * x);
        for (at, point) in points.iter().enumerate() {
            let (slope, error) = sensitivity(&points, at).unwrap();
            assert!((slope - (-3.0 + 0.5 * point.force)).abs() < 1e-12, "{slope}");
            assert!(error.unwrap() < 1e-12);
        }
    }

    #[test]
    fn the_error_holds_the_slope_of_a_smooth_curve_and_what_the_bounds_leave_open() {
        let forces = [0.0, 0.014, 0.032, 0.083, 0.173, 0.344];
        let curve = |x: f64| 44.0 - 12.0 * (1.0 - (-6.0 * x).exp());
        let exact = |x: f64| -72.0 * (-6.0 * x).exp();
        let smooth = points(&forces, 0.0, curve);
        for (at, force) in forces.iter().enumerate().take(4) {
            let (slope, error) = sensitivity(&smooth, at).unwrap();
            let missed = (slope - exact(*force)).abs();
            assert!(missed <= 2.0 * error.unwrap(), "{force}: {slope} {error:?} {}", exact(*force));
        }
        // Two states 1 N apart, each known to 0.1 F, with another in the middle: the slope is known to 0.2 F/N.
        let rough = points(&[0.0, 0.5, 1.0], 0.1, |x| 5.0 - x);
        assert!((sensitivity(&rough, 1).unwrap().1.unwrap() - 0.2).abs() < 1e-12);
    }

    #[test]
    fn two_steps_have_a_slope_without_an_error_and_one_has_none() {
        let two = points(&[0.0, 2.0], 0.0, |x| 1.0 + x);
        assert_eq!(sensitivity(&two, 1), Some((1.0, None)));
        assert!(sensitivity(&two[..1], 0).is_none());
    }
}

//! A capacitance as a function of the force, with its bounds: cubics in Bernstein form between the steps.
//!
//! On the interval from step `k` to the next, with `t` from 0 to 1,
//!
//! ```text
//! C = P0 (1-t)^3 + 3 P1 t (1-t)^2 + 3 P2 t^2 (1-t) + P3 t^3
//! ```
//!
//! `P0` and `P3` are the values at the steps. A cubic lies between the least and the largest of its four
//! coefficients, so that limits of these hold for every force, also in floating-point arithmetic, since no
//! term is subtracted. With `d` the derivative at a step and `h` the distance to its neighbour,
//!
//! - the reported value takes the limited derivatives of a monotone cubic, |d| <= 3 |secant|, so that `P1`
//!   and `P2` lie between `P0` and `P3`;
//! - the upper bound has the same derivatives, so that its distance from the value varies monotonically from
//!   one step to the next;
//! - the lower bound has the derivative nearest to that of the value for which `P1` and `P2` are not
//!   negative. It does not cross the value either, because |d| <= 3 (value)/h wherever the value falls
//!   towards a neighbour at distance `h`.
//!
//! The band interpolates between the three: `band` = -1, 0, 1 are lower bound, value and upper bound, and
//! values in between are means of two.

use elastocap_results::force_answer::{CurveLimits, MonotoneCubic};

/// A capacitance and its derivative at one force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The capacitance, F.
    pub capacitance: f64,
    /// The derivative dC/dF, F/N.
    pub derivative: f64,
}

/// Value and bounds of a capacitance at one load step, F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepValue {
    /// The lower bound, not negative.
    pub lower: f64,
    /// The reported value.
    pub value: f64,
    /// The upper bound.
    pub upper: f64,
}

/// The four coefficients of a cubic in Bernstein form, F, on one interval between steps, for lower bound,
/// value and upper bound.
pub type Piece = [[f64; 4]; 3];

/// A capacitance with bounds over the force.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedCurve {
    /// The forces, N, strictly increasing.
    forces: Vec<f64>,
    /// The values and bounds at the forces.
    steps: Vec<StepValue>,
    /// The cubics, one for each interval between forces.
    pieces: Vec<Piece>,
}

/// The weights of lower bound, value and upper bound for a `band`.
fn weights(band: f64) -> [f64; 3] {
    let band = band.clamp(-1.0, 1.0);
    [(-band).max(0.0), 1.0 - band.abs(), band.max(0.0)]
}

/// The four coefficients for the derivatives `d` at the ends of an interval of length `h`.
fn bernstein(ends: [f64; 2], d: [f64; 2], h: f64) -> [f64; 4] {
    [ends[0], ends[0] + h * d[0] / 3.0, ends[1] - h * d[1] / 3.0, ends[1]]
}

impl BoundedCurve {
    /// The curve through values at `forces` (N, strictly increasing, at least two, as many as `steps`), each
    /// with 0 <= lower <= value <= upper.
    pub fn through(forces: Vec<f64>, steps: Vec<StepValue>) -> Self {
        let cubic = MonotoneCubic::through(forces.clone(), steps.iter().map(|s| s.value).collect());
        let slopes = cubic.slopes();
        let last = forces.len() - 1;
        // The derivatives with which the lower bound is not negative beside a step.
        let lower_slopes: Vec<f64> = (0..=last)
            .map(|k| {
                let limit = |h: f64| 3.0 * steps[k].lower / h;
                let falling = if k < last { limit(forces[k + 1] - forces[k]) } else { f64::INFINITY };
                let growing = if k > 0 { limit(forces[k] - forces[k - 1]) } else { f64::INFINITY };
                slopes[k].max(-falling).min(growing)
            })
            .collect();
        let pieces = (0..last)
            .map(|k| {
                let h = forces[k + 1] - forces[k];
                let [a, b] = [steps[k], steps[k + 1]];
                let d = [slopes[k], slopes[k + 1]];
                // Inequalities that hold in exact arithmetic are enforced for the rounded numbers.
                let mut value = bernstein([a.value, b.value], d, h);
                let [least, greatest] = [a.value.min(b.value), a.value.max(b.value)];
                value[1..3].iter_mut().for_each(|p| *p = p.clamp(least, greatest));
                let mut lower = bernstein([a.lower, b.lower], [lower_slopes[k], lower_slopes[k + 1]], h);
                let mut upper = bernstein([a.upper, b.upper], d, h);
                for i in 1..3 {
                    lower[i] = lower[i].min(value[i]).max(0.0);
                    upper[i] = upper[i].max(value[i]);
                }
                [lower, value, upper]
            })
            .collect();
        Self { forces, steps, pieces }
    }

    /// The forces of the steps, N.
    pub fn forces(&self) -> &[f64] {
        &self.forces
    }

    /// The values and bounds at the steps.
    pub fn steps(&self) -> &[StepValue] {
        &self.steps
    }

    /// The cubics, one for each interval between steps.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The capacitance at a force, which is clamped to the range of the steps, for a band from -1 to 1.
    pub fn at(&self, force: f64, band: f64) -> Point {
        let last = self.forces.len() - 1;
        let force = force.clamp(self.forces[0], self.forces[last]);
        let k = self.forces.partition_point(|f| *f <= force).saturating_sub(1).min(last - 1);
        let h = self.forces[k + 1] - self.forces[k];
        let t = (force - self.forces[k]) / h;
        let s = 1.0 - t;
        let mut point = Point { capacitance: 0.0, derivative: 0.0 };
        for (weight, [p0, p1, p2, p3]) in weights(band).into_iter().zip(self.pieces[k]) {
            point.capacitance +=
                weight * (p0 * s * s * s + 3.0 * p1 * t * s * s + 3.0 * p2 * t * t * s + p3 * t * t * t);
            let slope = (p1 - p0) * s * s + 2.0 * (p2 - p1) * t * s + (p3 - p2) * t * t;
            point.derivative += weight * 3.0 * slope / h;
        }
        point
    }

    /// Whether all numbers computed from the curve are finite: capacitances, derivatives, and shares of the
    /// curve's scale. Some are not if two steps have almost the same force, or if bounds are near the largest
    /// floating-point number.
    pub fn is_finite(&self) -> bool {
        // No sum of a cubic has larger coefficients.
        const LARGEST_SUM: f64 = 16.0;
        let scale = self.scale();
        let lengths = self.forces.windows(2).map(|pair| pair[1] - pair[0]);
        self.pieces.iter().zip(lengths).all(|(piece, h)| {
            let finite =
                |number: &f64| [1.0, h, scale].iter().all(|over| (LARGEST_SUM * number / over).is_finite());
            piece.iter().flatten().all(finite)
        })
    }

    /// The scale of the curve: the largest value at the steps, or, if all are zero, the largest upper bound;
    /// F.
    pub fn scale(&self) -> f64 {
        let largest = |pick: fn(&StepValue) -> f64| self.steps.iter().map(pick).fold(0.0, f64::max);
        let value = largest(|s| s.value);
        if value > 0.0 { value } else { largest(|s| s.upper) }
    }

    /// Whether the lower bound, the value and the upper bound are each monotone over the whole range. The
    /// ends of the band may not be if bounds are as far apart as steps differ.
    pub fn is_monotone(&self) -> [bool; 3] {
        let direction = (self.steps[self.steps.len() - 1].value - self.steps[0].value).signum();
        let goes_one_way = |[p0, p1, p2, p3]: [f64; 4]| {
            // A third of the derivative is a parabola in Bernstein form: if its ends are not negative, the
            // rest is not negative unless its vertex is inside and below zero.
            let [a, b, c] = [direction * (p1 - p0), direction * (p2 - p1), direction * (p3 - p2)];
            let small = -1e-14 * (p0.abs() + p3.abs());
            a >= small && c >= small && (b >= small || b * b <= a * c * (1.0 + 1e-9) + small * small)
        };
        [0, 1, 2].map(|i| self.pieces.iter().all(|piece| goes_one_way(piece[i])))
    }

    /// For each interval, an estimate of the error by interpolation, F: the distance by which the true value
    /// may lie outside the two bounds of the curve. `None` where the steps give no estimate, such as with two
    /// steps.
    pub fn interpolation_errors(&self) -> Vec<Option<f64>> {
        let at_steps = self.steps.iter().map(|step| [step.lower, step.upper]).collect();
        let limits = CurveLimits::through(self.forces.clone(), at_steps, false);
        let bound = |at, band| self.at(at, band).capacitance;
        let excess =
            |at: f64, [low, high]: [f64; 2]| (bound(at, -1.0) - low).max(high - bound(at, 1.0)).max(0.0);
        (1..self.forces.len()).map(|k| limits.largest(k - 1, excess)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between 0 and 1, the same at each run.
    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Curves of any shape: growing, falling and turning, with lower bounds at zero and bounds wider than the
    /// differences of steps.
    fn curves() -> impl Iterator<Item = BoundedCurve> {
        let mut random = random(7);
        (0..400).map(move |k| {
            let count = 2 + k % 9;
            let mut force = random() * 0.1;
            let mut c = 5.0;
            let (forces, steps) = (0..count)
                .map(|_| {
                    force += 1e-3 + random().powi(3);
                    let away = 4.0 * random().powi(4);
                    c = match k % 3 {
                        0 => c + away,
                        1 => c / (1.0 + away),
                        _ => c * (0.5 + random()),
                    };
                    let lower = if random() < 0.2 { 0.0 } else { c * random() };
                    let upper = if random() < 0.2 { c } else { c * (1.0 + random()) };
                    (force, StepValue { lower, value: c, upper })
                })
                .unzip();
            BoundedCurve::through(forces, steps)
        })
    }

    /// Forces over the range, the steps among them.
    fn mesh(curve: &BoundedCurve) -> Vec<f64> {
        let pairs = curve.forces().windows(2);
        let inner = pairs.flat_map(|p| (0..50).map(|i| p[0] + (p[1] - p[0]) * f64::from(i) / 50.0));
        inner.chain(curve.forces().last().copied()).collect()
    }

    #[test]
    fn the_curve_and_its_bounds_go_through_the_steps_exactly() {
        for curve in curves() {
            for (force, step) in curve.forces().iter().zip(curve.steps()) {
                let at = |band| curve.at(*force, band).capacitance;
                assert_eq!([at(-1.0), at(0.0), at(1.0)], [step.lower, step.value, step.upper]);
            }
        }
    }

    #[test]
    fn between_steps_the_value_lies_between_theirs_and_goes_one_way() {
        for curve in curves() {
            for (k, pair) in curve.forces().windows(2).enumerate() {
                let ends = [curve.steps()[k].value, curve.steps()[k + 1].value];
                let direction = (ends[1] - ends[0]).signum();
                let values: Vec<f64> = (0..=200)
                    .map(|i| curve.at(pair[0] + (pair[1] - pair[0]) * f64::from(i) / 200.0, 0.0).capacitance)
                    .collect();
                assert!(
                    values.windows(2).all(|p| direction * (p[1] - p[0]) >= -1e-14 * ends[0]),
                    "{curve:?}"
                );
                let [least, greatest] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                let slack = 1e-15 * greatest;
                assert!(values.iter().all(|c| (least - slack..=greatest + slack).contains(c)), "{curve:?}");
            }
        }
    }

    #[test]
    fn lower_bound_value_and_upper_bound_never_cross_and_none_is_negative() {
        for curve in curves() {
            for force in mesh(&curve) {
                let [lower, half, value, more, upper] =
                    [-1.0, -0.5, 0.0, 0.25, 1.0].map(|band| curve.at(force, band).capacitance);
                let slack = 1e-14 * upper;
                assert!(0.0 <= lower, "{lower} at {force} of {curve:?}");
                assert!(lower <= half + slack && half <= value + slack, "{lower} {value} at {force}");
                assert!(value <= more + slack && more <= upper + slack, "{value} {upper} at {force}");
            }
        }
    }

    #[test]
    fn the_derivative_is_continuous_and_is_that_of_the_curve() {
        for curve in curves() {
            for band in [-1.0, -0.3, 0.0, 0.6, 1.0] {
                let (forces, scale) = (curve.forces(), curve.scale());
                for k in 1..forces.len() - 1 {
                    let h = (forces[k + 1] - forces[k]).min(forces[k] - forces[k - 1]);
                    let [before, after] =
                        [-1e-9, 1e-9].map(|away| curve.at(forces[k] + away * h, band).derivative);
                    assert!((before - after).abs() < 1e-6 * scale / h, "{before} {after} at step {k}");
                }
                let force = forces[0] + 0.37 * (forces[1] - forces[0]);
                let e = 1e-5 * (forces[1] - forces[0]);
                let difference = (curve.at(force + e, band).capacitance
                    - curve.at(force - e, band).capacitance)
                    / (2.0 * e);
                let exact = curve.at(force, band).derivative;
                assert!((difference - exact).abs() < 1e-7 * scale / (forces[1] - forces[0]));
            }
        }
    }

    #[test]
    fn beyond_the_steps_the_curve_stays_as_it_is_at_the_last_one() {
        for curve in curves().take(20) {
            let forces = curve.forces();
            for band in [-1.0, 0.0, 1.0] {
                assert_eq!(curve.at(forces[0] - 1.0, band), curve.at(forces[0], band));
                let last = forces[forces.len() - 1];
                assert_eq!(curve.at(last + 1.0, band), curve.at(last, band));
            }
        }
    }

    #[test]
    fn curves_that_go_one_way_are_told_from_others() {
        let curve = |values: [[f64; 3]; 3]| {
            let step = |[lower, value, upper]: [f64; 3]| StepValue { lower, value, upper };
            BoundedCurve::through(vec![0.0, 1.0, 3.0], values.map(step).to_vec()).is_monotone()
        };
        assert_eq!(curve([[3.9, 4.0, 4.1], [2.9, 3.0, 3.1], [0.9, 1.0, 1.1]]), [true; 3]);
        assert_eq!(curve([[3.9, 4.0, 4.1], [2.9, 3.0, 4.2], [0.9, 1.0, 1.1]]), [true, true, false]);
        assert_eq!(curve([[1.9, 2.0, 2.1], [2.9, 3.0, 3.1], [2.0, 4.0, 4.1]]), [false, true, true]);
        assert_eq!(curve([[3.9, 4.0, 4.1], [2.9, 3.0, 3.1], [3.4, 3.5, 3.6]]), [false; 3]);
    }

    #[test]
    fn the_estimate_of_the_interpolation_error_falls_with_more_steps() {
        let error = |count: usize| {
            let forces: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
            let step = |f: &f64| {
                let value = 1.0 / (1.0 + f);
                StepValue { lower: value, value, upper: value }
            };
            let steps = forces.iter().map(step).collect();
            let curve = BoundedCurve::through(forces.clone(), steps);
            let estimate = curve.interpolation_errors().into_iter().flatten().fold(0.0, f64::max);
            let mesh = (0..1000).map(|i| f64::from(i) / 1000.0);
            let wrong = mesh.map(|f| (curve.at(f, 0.0).capacitance - 1.0 / (1.0 + f)).abs());
            (estimate, wrong.fold(0.0, f64::max))
        };
        let ((coarse, wrong_coarse), (fine, wrong_fine)) = (error(5), error(17));
        assert!(wrong_coarse < coarse && wrong_fine < fine && fine < 0.1 * coarse, "{coarse} {fine}");
        assert_eq!(error(2).0, 0.0);
    }
}

//! Limits of a smooth curve between known points.
//!
//! Let the derivative of order n of a curve keep its sign over n + 1 neighbouring points. Between any two of
//! these points the curve then lies between two polynomials of degree n - 1, the one through the first n of
//! the points and the one through the last n: the error of each is a divided difference of order n, which has
//! the sign of the derivative, times the product of the distances from the points of the polynomial, and the
//! two products have opposite signs. Order 1 says that a monotone curve lies between the values of its
//! neighbouring points, and order 2 that a convex curve lies between a chord and the neighbouring chords,
//! continued. The distances between the points are part of the argument, so that unequal ones do no harm.
//!
//! Points do not prove that a derivative keeps its sign. The divided differences of order n are means of that
//! derivative, and the order is used where several of them around an interval have one sign.

use std::ops::Range;

/// The highest order in use: polynomials of degree two. Higher orders are hardly narrower, and carry the
/// errors of the points farther.
const MAX_ORDER: usize = 3;

/// The number of places in an interval at which limits are compared. Not tuned: they only have to be close
/// together.
const PLACES: usize = 32;

/// A safe bound of the relative rounding of a sum of a few products.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Limits of a curve between points.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveLimits {
    x: Vec<f64>,
    /// The least and the greatest value at each point.
    y: Vec<[f64; 2]>,
    /// A further error at each point, which varies slowly from point to point.
    shared_errors: Vec<f64>,
    /// The orders in use in each interval between points, ascending.
    orders: Vec<Vec<usize>>,
}

impl CurveLimits {
    /// The limits of a curve that has values between `y` at the points `x`, which ascend. `is_monotone` says
    /// that the curve is known to be monotone; otherwise the points have to show it.
    pub fn through(x: Vec<f64>, y: Vec<[f64; 2]>, is_monotone: bool) -> Self {
        let mut limits = Self { shared_errors: vec![0.0; x.len()], x, y, orders: Vec::new() };
        let used = |k: usize, order: &usize| (*order == 1 && is_monotone) || limits.keeps_sign(*order, k);
        limits.orders = (0..limits.x.len().saturating_sub(1))
            .map(|k| (1..=MAX_ORDER).filter(|order| used(k, order)).collect())
            .collect();
        limits
    }

    /// The limits of the curve if its values have further `errors`, one at each point, which vary slowly from
    /// point to point. Between points these errors are interpolated, whereas a polynomial extrapolates the
    /// independent error of each value.
    pub fn with_shared_errors(self, errors: Vec<f64>) -> Self {
        Self { shared_errors: errors, ..self }
    }

    /// Whether the points limit the curve between point `k` and the next by more than that it is monotone.
    pub fn is_curved(&self, k: usize) -> bool {
        self.orders[k].iter().any(|order| *order > 1)
    }

    /// The least and the greatest value of the curve at `at`, between point `k` and the next; `None` where
    /// the points give no limit.
    pub fn at(&self, k: usize, at: f64) -> Option<[f64; 2]> {
        let mut known = [f64::NEG_INFINITY, f64::INFINITY];
        for order in &self.orders[k] {
            // The first points of those windows of order + 1 points that hold the interval.
            let last = k.min(self.x.len() - 1 - order);
            let windows = (k + 1).saturating_sub(*order)..=last;
            let narrowed = windows.fold(known, |[low, high], first| {
                let [a, b] = [first, first + 1].map(|j| self.polynomial(j..j + order, at));
                [low.max(a[0].min(b[0])), high.min(a[1].max(b[1]))]
            });
            // Contradictory limits show that the derivative of this order changes its sign.
            if narrowed[0] <= narrowed[1] {
                known = narrowed;
            }
        }
        let share = (at - self.x[k]) / (self.x[k + 1] - self.x[k]);
        let shared = self.shared_errors[k] * (1.0 - share) + self.shared_errors[k + 1] * share;
        let [low, high] = known;
        (low.is_finite() && high.is_finite()).then_some([low - shared, high + shared])
    }

    /// The largest value of `excess`, given an argument and the limits there, over the interval from point
    /// `k` to the next; `None` where the points give no limit.
    pub fn largest(&self, k: usize, excess: impl Fn(f64, [f64; 2]) -> f64) -> Option<f64> {
        let excesses = self.places(k).map(|at| Some(excess(at, self.at(k, at)?)));
        excesses.collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)
    }

    /// Where a curve that does not decrease may reach `value` first, in the interval from point `k` to the
    /// next; the end of the interval if it does not.
    pub fn first_reach(&self, k: usize, value: f64) -> f64 {
        self.first(k, self.places(k), |[_, high]| high >= value)
    }

    /// Where a curve that does not decrease may have `value` last, in the interval from point `k` to the
    /// next; the beginning of the interval if it is above the value everywhere.
    pub fn last_hold(&self, k: usize, value: f64) -> f64 {
        self.first(k, self.places(k).rev(), |[low, _]| low <= value)
    }

    /// The first argument along `places` whose limits meet a condition, and otherwise the last place.
    fn first(&self, k: usize, places: impl Iterator<Item = f64>, meets: impl Fn([f64; 2]) -> bool) -> f64 {
        let meets = |at: f64| self.at(k, at).is_none_or(&meets);
        let mut last_failing = None;
        for place in places {
            match last_failing {
                _ if !meets(place) => last_failing = Some(place),
                None => return place,
                Some(mut failing) => {
                    let mut meeting = place;
                    // Bisection ends where no number is left between the two.
                    loop {
                        let middle = failing + 0.5 * (meeting - failing);
                        if middle == failing || middle == meeting {
                            return meeting;
                        }
                        if meets(middle) { meeting = middle } else { failing = middle }
                    }
                }
            }
        }
        last_failing.unwrap_or(self.x[k])
    }

    /// Evenly spaced arguments from point `k` to the next.
    fn places(&self, k: usize) -> impl DoubleEndedIterator<Item = f64> {
        let [from, to] = [self.x[k], self.x[k + 1]];
        (0..=PLACES)
            .map(move |i| if i == PLACES { to } else { from + (to - from) * i as f64 / PLACES as f64 })
    }

    /// Whether the derivative of an order may keep its sign around the interval from point `k` to the next:
    /// whether the divided differences of the windows that hold the interval, and of two more windows on
    /// either side, may all have one sign. There must be at least as many such windows as the order, and at
    /// least two.
    fn keeps_sign(&self, order: usize, k: usize) -> bool {
        let Some(last) = self.x.len().checked_sub(order + 1) else { return false };
        let windows = k.saturating_sub(order + 1)..=last.min(k + 2);
        let differences: Vec<[f64; 2]> =
            windows.map(|first| self.divided_difference(first..first + order + 1)).collect();
        differences.len() >= order.max(2)
            && (differences.iter().all(|[low, _]| *low <= 0.0)
                || differences.iter().all(|[_, high]| *high >= 0.0))
    }

    /// The limits of the divided difference of some points.
    fn divided_difference(&self, points: Range<usize>) -> [f64; 2] {
        let weight = |j: usize| {
            let others = points.clone().filter(|m| *m != j);
            1.0 / others.map(|m| self.x[j] - self.x[m]).product::<f64>()
        };
        self.sum(points.clone(), weight)
    }

    /// The limits of the polynomial through some points.
    fn polynomial(&self, points: Range<usize>, at: f64) -> [f64; 2] {
        let weight = |j: usize| {
            let others = points.clone().filter(|m| *m != j);
            others.map(|m| (at - self.x[m]) / (self.x[j] - self.x[m])).product::<f64>()
        };
        self.sum(points.clone(), weight)
    }

    /// The limits of a weighted sum of the values at some points.
    fn sum(&self, points: Range<usize>, weight: impl Fn(usize) -> f64) -> [f64; 2] {
        points.fold([0.0, 0.0], |[low, high], j| {
            let weight = weight(j);
            let ends = self.y[j].map(|y| weight * y);
            let rounding = ROUNDING * ends[0].abs().max(ends[1].abs());
            [low + ends[0].min(ends[1]) - rounding, high + ends[0].max(ends[1]) + rounding]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Formula = fn(f64) -> f64;

    /// Numbers between 0 and 1, the same at each run.
    fn random() -> impl FnMut() -> f64 {
        let mut state = 3_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// From 0 to 1: curves whose derivatives keep their signs, one of them vertical at its beginning.
    const SMOOTH: [Formula; 4] =
        [|x| (-5.0 * x).exp(), |x| 1.0 / (1.2 - x), |x| 2.0 + x.powf(2.0 / 3.0), |x| 1.0 + 2.0 * x];

    #[test]
    fn a_curve_whose_derivatives_keep_their_signs_is_within_its_limits_at_any_steps() {
        let mut random = random();
        for formula in SMOOTH {
            for round in 0..300 {
                // Evenly spread, and crowded at the beginning.
                let power = [1.0, 6.0][round % 2];
                let mut x: Vec<f64> = (0..2 + round % 8).map(|_| random().powf(power)).collect();
                x.extend([0.0, 1.0]);
                x.sort_by(f64::total_cmp);
                x.dedup();
                let error = [0.0, 1e-3][round % 2];
                let y = x.iter().map(|x| {
                    let middle = formula(*x) + error * (2.0 * random() - 1.0);
                    [middle - error, middle + error]
                });
                let limits = CurveLimits::through(x.clone(), y.collect(), true);
                for k in 0..x.len() - 1 {
                    let at = x[k] + (x[k + 1] - x[k]) * random();
                    let [low, high] = limits.at(k, at).unwrap();
                    let value = formula(at);
                    assert!(
                        low <= value && value <= high,
                        "{value} at {at} is not in {low}..{high} of {x:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn limits_are_narrow_where_steps_are_many() {
        let x: Vec<f64> = (0..9).map(|k| f64::from(k) / 8.0).collect();
        let y = x.iter().map(|x| [(-x).exp(); 2]).collect();
        let limits = CurveLimits::through(x, y, false);
        for k in 0..8 {
            let width = limits.largest(k, |_, [low, high]| high - low).unwrap();
            // A chord is wrong by 2e-3. Beside an end of the curve there are no steps on the one side.
            let allowed = if k == 0 || k == 7 { 2e-3 } else { 4e-4 };
            assert!(width < allowed, "{k}: {width}");
        }
    }

    #[test]
    fn points_that_turn_tell_no_monotone_curve_and_two_points_tell_nothing() {
        let y = [0.0, 1.0, 0.0, 1.0, 0.0].map(|y| [y; 2]).to_vec();
        let turning = CurveLimits::through(vec![0.0, 1.0, 2.0, 3.0, 4.0], y, false);
        assert_eq!(turning.at(1, 1.5), None);
        let two = CurveLimits::through(vec![0.0, 1.0], vec![[0.0; 2], [1.0; 2]], false);
        assert_eq!(two.at(0, 0.5), None);
    }

    #[test]
    fn a_value_is_reached_where_the_limits_say() {
        let x = vec![0.0, 1.0, 3.0, 4.0];
        let limits = CurveLimits::through(x.clone(), x.iter().map(|x| [x - 0.1, x + 0.1]).collect(), true);
        let [first, last] = [limits.first_reach(1, 2.0), limits.last_hold(1, 2.0)];
        for (reached, exact) in
            [(first, limits.at(1, first).unwrap()[1]), (last, limits.at(1, last).unwrap()[0])]
        {
            assert!((exact - 2.0).abs() < 1e-9, "{reached}: {exact}");
        }
        assert_eq!([limits.first_reach(1, 0.0), limits.last_hold(1, 9.0)], [1.0, 3.0]);
    }
}

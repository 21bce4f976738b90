//! Monotone cubic interpolation.

/// A function through given points, cubic between neighbours and monotone wherever the points are: the
/// derivative at a point is that of the parabola through three points, limited as Fritsch and Carlson (1980)
/// and de Boor and Swartz (1977) do.
#[derive(Debug, Clone, PartialEq)]
pub struct MonotoneCubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slopes: Vec<f64>,
}

impl MonotoneCubic {
    /// The interpolation through the points (x, y), with `x` strictly increasing; at least two points.
    pub fn through(x: Vec<f64>, y: Vec<f64>) -> Self {
        let slopes = (0..x.len()).map(|k| slope(&x, &y, k)).collect();
        Self { x, y, slopes }
    }

    /// The derivatives at the points, in the unit of y over that of x.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// The value at `at`, which is between the first and the last point.
    pub fn value(&self, at: f64) -> f64 {
        // The interval that begins at or before `at`.
        let k = self.x.partition_point(|x| *x <= at).saturating_sub(1).min(self.x.len() - 2);
        let h = self.x[k + 1] - self.x[k];
        let t = (at - self.x[k]) / h;
        let s = 1.0 - t;
        let ends = self.y[k] * s * s * (1.0 + 2.0 * t) + self.y[k + 1] * t * t * (1.0 + 2.0 * s);
        ends + h * t * s * (self.slopes[k] * s - self.slopes[k + 1] * t)
    }

    /// The derivative at `at`, which is between the first and the last point.
    pub(crate) fn slope(&self, at: f64) -> f64 {
        let k = self.x.partition_point(|x| *x <= at).saturating_sub(1).min(self.x.len() - 2);
        let h = self.x[k + 1] - self.x[k];
        let t = (at - self.x[k]) / h;
        let secant = (self.y[k + 1] - self.y[k]) / h;
        let s = 1.0 - t;
        6.0 * s * t * secant + s * (1.0 - 3.0 * t) * self.slopes[k] + t * (3.0 * t - 2.0) * self.slopes[k + 1]
    }

    /// The argument at which a nondecreasing function has a value, in the interval from point `k` to the
    /// next; the nearer end where it does not have it.
    pub fn argument(&self, k: usize, value: f64) -> f64 {
        let (mut low, mut high) = (self.x[k], self.x[k + 1]);
        if value <= self.y[k] {
            return low;
        }
        if value >= self.y[k + 1] {
            return high;
        }
        // Bisection ends when no floating-point number lies between the two.
        loop {
            let middle = low + 0.5 * (high - low);
            if middle <= low || middle >= high {
                return middle;
            }
            if self.value(middle) < value { low = middle } else { high = middle }
        }
    }
}

/// The derivative at point `k`.
fn slope(x: &[f64], y: &[f64], k: usize) -> f64 {
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let last = x.len() - 1;
    if last == 1 {
        return secant(0);
    }
    // The parabola through point `k` and its neighbours; at an end, through the three points nearest to it.
    let (parabola, neighbours) = if k == 0 {
        let (near, far) = (secant(0), secant(1));
        (near - (far - near) * (x[1] - x[0]) / (x[2] - x[0]), [near, near])
    } else if k == last {
        let (near, far) = (secant(last - 1), secant(last - 2));
        (near + (near - far) * (x[last] - x[last - 1]) / (x[last] - x[last - 2]), [near, near])
    } else {
        let (left, right) = (secant(k - 1), secant(k));
        let share = (x[k + 1] - x[k]) / (x[k + 1] - x[k - 1]);
        (left * share + right * (1.0 - share), [left, right])
    };
    // A cubic is monotone if its slopes have the sign of the flatter secant and are at most three times as
    // large.
    let [a, b] = neighbours;
    if a * b <= 0.0 {
        return 0.0;
    }
    let limit = 3.0 * a.abs().min(b.abs());
    if parabola * a <= 0.0 { 0.0 } else { parabola.clamp(-limit, limit) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotone_parabola_is_reproduced() {
        let x = vec![0.0, 0.3, 1.0, 1.2, 2.0];
        let parabola = |x: f64| 1.0 + 4.0 * x + 0.5 * x * x;
        let cubic = MonotoneCubic::through(x.clone(), x.iter().map(|x| parabola(*x)).collect());
        for k in 0..=40 {
            let at = 0.05 * f64::from(k);
            assert!((cubic.value(at) - parabola(at)).abs() < 1e-13, "{at}");
        }
    }

    #[test]
    fn points_that_do_not_decrease_give_a_function_that_does_not() {
        let cubic = MonotoneCubic::through(vec![0.0, 1.0, 2.0, 2.1, 5.0], vec![0.0, 0.0, 0.1, 9.0, 9.1]);
        let values: Vec<f64> = (0..=500).map(|k| cubic.value(0.01 * f64::from(k))).collect();
        assert!(values.windows(2).all(|pair| pair[1] >= pair[0] - 1e-14), "{values:?}");
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_value() {
        let cubic = MonotoneCubic::through(vec![0.0, 1.0, 3.0, 3.5], vec![0.0, 2.0, 3.0, 0.0]);
        for at in [0.1, 0.9, 1.2, 2.5, 3.1, 3.4] {
            let difference = (cubic.value(at + 1e-5) - cubic.value(at - 1e-5)) / 2e-5;
            assert!((cubic.slope(at) - difference).abs() < 1e-6, "{at}: {} {difference}", cubic.slope(at));
        }
    }

    #[test]
    fn the_argument_of_a_value_is_where_the_function_takes_it() {
        let cubic = MonotoneCubic::through(vec![0.0, 1.0, 3.0], vec![0.0, 2.0, 3.0]);
        for (k, at) in [(0, 0.2), (0, 0.9), (1, 1.1), (1, 2.9)] {
            assert!((cubic.argument(k, cubic.value(at)) - at).abs() < 1e-12);
        }
        assert_eq!([cubic.argument(1, 1.0), cubic.argument(1, 4.0)], [1.0, 3.0]);
    }
}

//! The uncertainty of fitted parameters: covariances of a linearised least-squares fit, and combinations that
//! the data do not determine.

use distrs::{Normal, StudentsT};
use nalgebra::{DMatrix, DVector};

/// A linearised fit: derivatives and residuals over the standard deviation (or any common scale) of each
/// point.
pub(crate) struct Linearised {
    /// The derivatives: a row for each point, a column for each parameter.
    pub(crate) jacobian: DMatrix<f64>,
    /// The residual of each point.
    pub(crate) residuals: DVector<f64>,
    /// The error of the prediction at each point, in its scale.
    pub(crate) errors: DVector<f64>,
    /// Whether the scales are the standard deviations of the points; otherwise these are estimated from the
    /// residuals.
    pub(crate) noise_is_known: bool,
}

/// The uncertainty of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Uncertainty {
    /// The standard errors.
    pub(crate) standard_errors: Vec<f64>,
    /// The half widths of the 95 % intervals.
    pub(crate) half_widths: Vec<f64>,
    /// The largest shift of each parameter by errors of the curve.
    pub(crate) shifts: Vec<f64>,
    /// The correlations of the estimates.
    pub(crate) correlations: Vec<Vec<f64>>,
    /// The condition number of the Jacobian with columns of length one.
    pub(crate) condition: f64,
    /// The least determined combination of parameters, in columns of length one.
    pub(crate) weakest: Vec<f64>,
    /// The standard deviation of the points over their scales: 1 if the scales are standard deviations.
    pub(crate) noise: f64,
    /// The sum of squares over the degrees of freedom.
    pub(crate) reduced: f64,
    /// The number of points less that of the parameters.
    pub(crate) freedom: usize,
}

/// The ratio to the largest singular value below which a singular value is only rounding and noise of
/// differences. It is not tuned.
const SMALLEST: f64 = 1e-8;

impl Linearised {
    /// The uncertainty of the parameters.
    ///
    /// # Errors
    /// `None` if there are no more points than parameters; the condition number and the least determined
    /// combination if that combination changes nothing at all.
    pub(crate) fn uncertainty(&self) -> Result<Uncertainty, Option<(f64, Vec<f64>)>> {
        let (points, count) = self.jacobian.shape();
        if points <= count || count == 0 {
            return Err(None);
        }
        let lengths: Vec<f64> = (0..count).map(|k| self.jacobian.column(k).norm()).collect();
        if let Some(k) = lengths.iter().position(|length| *length == 0.0 || !length.is_finite()) {
            let mut alone = vec![0.0; count];
            alone[k] = 1.0;
            return Err(Some((f64::INFINITY, alone)));
        }
        let mut scaled = self.jacobian.clone();
        for (k, length) in lengths.iter().enumerate() {
            scaled.column_mut(k).unscale_mut(*length);
        }
        let svd = scaled.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err(None) };
        let values = svd.singular_values;
        let least = values.imin();
        let condition = values.max() / values[least];
        let weakest: Vec<f64> = v_t.row(least).iter().copied().collect();
        if !condition.is_finite() || values[least] < SMALLEST * values.max() {
            return Err(Some((condition, weakest)));
        }
        let freedom = points - count;
        let reduced = self.residuals.norm_squared() / freedom as f64;
        let noise = if self.noise_is_known { 1.0 } else { reduced.sqrt() };
        let quantile = if self.noise_is_known {
            Normal::ppf(0.975, 0.0, 1.0)
        } else {
            StudentsT::ppf(0.975, freedom as f64)
        };
        // The rows of the pseudo-inverse map the points to the parameters.
        let inverse = DMatrix::from_fn(count, points, |row, point| {
            (0..count).map(|s| v_t[(s, row)] / values[s] * u[(point, s)]).sum::<f64>() / lengths[row]
        });
        let covariance = &inverse * inverse.transpose();
        let standard_errors: Vec<f64> = (0..count).map(|k| noise * covariance[(k, k)].sqrt()).collect();
        let correlation =
            |i: usize, j: usize| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        let shift = |k: usize| (0..points).map(|p| inverse[(k, p)].abs() * self.errors[p]).sum();
        Ok(Uncertainty {
            half_widths: standard_errors.iter().map(|error| quantile * error).collect(),
            standard_errors,
            shifts: (0..count).map(shift).collect(),
            correlations: (0..count).map(|i| (0..count).map(|j| correlation(i, j)).collect()).collect(),
            condition,
            weakest,
            noise,
            reduced,
            freedom,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line through four points, whose standard errors are known in closed form.
    fn line(noise_is_known: bool) -> Linearised {
        let x = [0.0, 1.0, 2.0, 3.0];
        Linearised {
            jacobian: DMatrix::from_fn(4, 2, |row, column| if column == 0 { 1.0 } else { x[row] }),
            residuals: DVector::from_vec(vec![0.1, -0.2, 0.1, 0.0]),
            errors: DVector::from_element(4, 0.01),
            noise_is_known,
        }
    }

    #[test]
    fn the_errors_of_a_straight_line_are_those_of_the_textbook() {
        let found = line(false).uncertainty().unwrap();
        // s^2 = 0.06 / 2; the slope has s / sqrt(sum (x - mean)^2) = s / sqrt(5); Student's t with 2 degrees
        // is 4.30265.
        let noise = 0.03_f64.sqrt();
        assert!((found.standard_errors[1] - noise / 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((found.half_widths[1] / found.standard_errors[1] - 4.302_652_729_911_275).abs() < 1e-6);
        assert!((found.correlations[0][1] + 6.0 / (4.0_f64 * 14.0).sqrt()).abs() < 1e-12);
        let known = line(true).uncertainty().unwrap();
        assert!((known.half_widths[1] - 1.959_963_984_540_054 / 5.0_f64.sqrt()).abs() < 1e-7);
        // An equal shift of all points moves the intercept by the same amount; the worst mixture of signs
        // moves it more.
        assert!(known.shifts[0] >= 0.01);
    }

    #[test]
    fn columns_that_are_the_same_cannot_be_told_apart() {
        let mut twice = line(false);
        twice.jacobian.set_column(1, &DVector::from_element(4, 3.0));
        let Err(Some((condition, weakest))) = twice.uncertainty() else { panic!("told apart") };
        assert!(condition > 1e8 && (weakest[0].abs() - weakest[1].abs()).abs() < 1e-6);
    }

    #[test]
    fn as_many_parameters_as_points_leave_no_error() {
        let mut few = line(false);
        few.jacobian = few.jacobian.rows(0, 2).into_owned();
        few.residuals = few.residuals.rows(0, 2).into_owned();
        few.errors = few.errors.rows(0, 2).into_owned();
        assert_eq!(few.uncertainty(), Err(None));
    }
}

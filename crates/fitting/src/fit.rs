//! Fits parameters of a case to its measured points by bounded least squares.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Correction, MeasuredPoint, MeasuredPoints, OverrideError, with_value};
use elastocap_results::load_curve::LoadCurve;
use elastocap_results::measured::Comparison;
use nalgebra::{DMatrix, DVector};
use rmpfit::{MPError, MPFitter as _, MPSuccess};
use serde::Serialize;

use crate::curves::{CurveError, Curves, Effort};
use crate::findings::{FitResults, findings};
use crate::parameter::{Free, Parameter, ParameterError, parameters};
use crate::residuals::{Prediction, Problem, correction_of};
use crate::uncertainty::{Linearised, Uncertainty};

/// The distance to a limit, over the range, up to which a parameter counts as being at it. It is not tuned.
const AT_LIMIT: f64 = 1e-6;

/// The reason why there is no fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A free parameter is not in the case, or its range is unsuitable.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The case has no measured points.
    #[error(
        "the case has no measured points; add `[measurement]` with `file` and `columns`, as docs/fits.md describes"
    )]
    NoPoints,
    /// There are no more points than parameters.
    #[error(
        "{points} measured points cannot determine {parameters} parameters and their errors; there must be more points than parameters"
    )]
    TooFewPoints {
        /// The number of points.
        points: usize,
        /// The number of free parameters.
        parameters: usize,
    },
    /// The run has no curve for the values at the start or at the end of the fit.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The least-squares library failed.
    #[error("the least-squares library cannot go on: {0}")]
    Library(&'static str),
}

/// A fitted parameter, in SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fitted {
    /// The name that the caller gave.
    pub name: String,
    /// The path of its key in the case.
    pub path: String,
    /// The best value.
    pub value: f64,
    /// The 95 % interval from the scatter of the points; `None` at a limit, and where the data do not
    /// determine the parameter.
    pub interval_95: Option<[f64; 2]>,
    /// The standard error.
    pub standard_error: Option<f64>,
    /// The largest additional shift by errors of the computed curve: bounds, stated errors and interpolation.
    pub shift_by_curve: Option<f64>,
    /// The value at the start of the fit.
    pub start: f64,
    /// The least and the greatest allowed value; `None` without a limit.
    pub range: [Option<f64>; 2],
    /// "lower" or "upper", if the parameter ended at a limit.
    pub at_limit: Option<&'static str>,
}

/// The result of a fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// The parameters, in the order of the caller.
    pub parameters: Vec<Fitted>,
    /// Whether the search converged; otherwise the values are the best so far.
    pub converged: bool,
    /// Whether the search was stopped on request.
    pub stopped: bool,
    /// The number of measured points.
    pub points: usize,
    /// The number of points less that of the parameters that are not at a limit.
    pub degrees_of_freedom: usize,
    /// The standard deviation of the points, F: the root mean square of given deviations, or an estimate from
    /// the residuals; `None` where a stopped search has no estimate.
    pub noise_f: Option<f64>,
    /// Whether the measurement gives the deviations of its points.
    pub noise_is_given: bool,
    /// The sum of squares over the degrees of freedom, with the given deviations: about 1 if they are right.
    pub reduced_chi_squared: Option<f64>,
    /// The root mean square of the residuals, F.
    pub rms_residual_f: f64,
    /// The root mean square of the residuals at the start of the fit, F.
    pub rms_residual_at_start_f: f64,
    /// Correlations of the parameters that are not at a limit, in the order of `correlated`.
    pub correlations: Vec<Vec<f64>>,
    /// The names of the parameters that are not at a limit.
    pub correlated: Vec<String>,
    /// The condition number of the Jacobian with columns of length one; `None` where it is not known.
    pub condition: Option<f64>,
    /// Findings for the user, in words.
    pub findings: Vec<String>,
    /// The largest stated error of the curve at a point, in the reading of the meter, F.
    pub curve_error_f: f64,
    /// The largest estimated error of interpolation between steps at a point, F; `None` where it is not
    /// known.
    pub interpolation_error_f: Option<f64>,
    /// The number of iterations of the least-squares library.
    pub iterations: usize,
    /// The number of curves solved for the fit.
    pub effort: Effort,
    /// The corrected points compared with the fitted curve.
    pub measured_points: Comparison,
    /// The curves before and after the fit, for pictures.
    #[serde(skip)]
    pub curves: FittedCurves,
}

/// The curves before and after a fit, and the corrections of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCurves {
    /// The curve at the start of the fit.
    pub start: LoadCurve,
    /// The correction at the start of the fit.
    pub start_correction: Correction,
    /// The fitted curve.
    pub fitted: LoadCurve,
    /// The correction of the points by the fit.
    pub correction: Correction,
}

impl Fit {
    /// Whether every parameter is determined by the data.
    pub fn is_determined(&self) -> bool {
        self.parameters.iter().all(|parameter| parameter.interval_95.is_some())
    }
}

/// Fits the parameters `free` to the measured points of a case.
///
/// `source` is the text of the case, `case` its content, `origin` its file. `cancel` stops the search; the
/// best values by then are returned.
///
/// # Errors
/// [`FitError`] if the case has no points or too few, if a parameter is not in it, or if it cannot be solved
/// at the start.
pub fn fit(
    source: &str,
    case: &Case,
    origin: &Path,
    free: &[Free],
    cancel: &Arc<AtomicBool>,
) -> Result<Fit, FitError> {
    let measured = case.measured_points.as_ref().ok_or(FitError::NoPoints)?;
    let parameters = parameters(free, source, Some(measured))?;
    let curves = Curves::new(source, origin, measured.load, Arc::clone(cancel));
    fit_with(&curves, &parameters, measured)
}

/// Fits `parameters` to measured points, as [`fit`] does, with curves of which some may already be solved.
///
/// # Errors
/// As for [`fit`].
pub fn fit_with(
    curves: &Curves,
    parameters: &[Parameter],
    measured: &MeasuredPoints,
) -> Result<Fit, FitError> {
    let points = measured.points.as_slice();
    if points.len() <= parameters.len() {
        return Err(FitError::TooFewPoints { points: points.len(), parameters: parameters.len() });
    }
    let deviations: Option<Vec<f64>> = points.iter().map(|point| point.deviation).collect();
    let noise_is_given = deviations.is_some();
    let largest = points.iter().map(|point| point.capacitance.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let scales = deviations.clone().unwrap_or_else(|| vec![1e-3 * largest; points.len()]);
    let mut problem = Problem::new(curves, parameters, points, measured.correction, scales);
    let start: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    // A case that cannot be solved at the start is reported before anything else.
    let at_start = problem.predict(&start)?;
    let start_curve = problem.curve(&start)?.curve.clone();
    let mut values = start.clone();
    let (converged, iterations) = match problem.mpfit(&mut values) {
        Ok(status) => (!matches!(status.success, MPSuccess::NotDone | MPSuccess::MaxIter), status.n_iter),
        Err(error) => match problem.failure.take() {
            Some(CurveError::Stopped) => (false, problem.jacobians),
            Some(error) => return Err(error.into()),
            None => return Err(FitError::Library(in_words(&error))),
        },
    };
    if let Some((_, best)) = &problem.best {
        values.clone_from(best);
    }
    let at_end = problem.predict(&values)?;
    let at_limit: Vec<Option<&'static str>> =
        parameters.iter().zip(&values).map(|(parameter, value)| limit(parameter, *value)).collect();
    let inner: Vec<usize> = (0..parameters.len()).filter(|k| at_limit[*k].is_none()).collect();
    let columns = match problem.columns(&values) {
        Ok(columns) => Some(columns),
        Err(CurveError::Stopped) => None,
        Err(error) => return Err(error.into()),
    };
    let stopped = curves.is_stopped();
    let linearised =
        columns.map(|columns| linearise(&problem.scales, points, &at_end, &columns, &inner, noise_is_given));
    let uncertainty = linearised.as_ref().map(Linearised::uncertainty);
    let (known, undetermined) = match uncertainty {
        Some(Ok(known)) => (Some(known), None),
        Some(Err(why)) => (None, why),
        None => (None, None),
    };

    let names: Vec<&str> = inner.iter().map(|k| parameters[*k].name.as_str()).collect();
    let solved = problem.curve(&values)?;
    let correction = problem.correction(&values);
    let corrected = MeasuredPoints { correction, ..measured.clone() }.corrected();
    let comparison = Comparison::new(&measured.file, measured.load, &corrected, &solved.curve);
    let noise_f = match &deviations {
        Some(deviations) => Some(rms(deviations)),
        None => known.as_ref().map(|known| known.noise * 1e-3 * largest),
    };
    let findings = findings(&FitResults {
        parameters,
        at_limit: &at_limit,
        weak: &problem.weak,
        inner: &names,
        known: known.as_ref(),
        undetermined: undetermined.as_ref(),
        missing_steps: solved.missing_steps,
        comparison: &comparison,
        load: measured.load.name(),
        noise_is_given,
        stopped,
        converged,
    });

    let fitted = |k: usize| {
        let parameter = &parameters[k];
        let place = inner.iter().position(|inner| *inner == k);
        let uncertainty = |pick: fn(&Uncertainty) -> &[f64]| Some(pick(known.as_ref()?)[place?]);
        let half = uncertainty(|known| &known.half_widths);
        let finite = |limit: f64| Some(limit).filter(|limit| limit.is_finite());
        Fitted {
            name: parameter.name.clone(),
            path: parameter.path.clone(),
            value: values[k],
            interval_95: half.map(|half| [values[k] - half, values[k] + half]),
            standard_error: uncertainty(|known| &known.standard_errors),
            shift_by_curve: uncertainty(|known| &known.shifts),
            start: parameter.start,
            range: parameter.range.map(finite),
            at_limit: at_limit[k],
        }
    };
    let residual =
        |(point, prediction): (&MeasuredPoint, &Prediction)| point.capacitance - prediction.capacitance;
    let residuals =
        |predictions: &[Prediction]| -> Vec<f64> { points.iter().zip(predictions).map(residual).collect() };
    let interpolation = at_end.iter().map(|prediction| prediction.interpolation_error);
    Ok(Fit {
        parameters: (0..parameters.len()).map(fitted).collect(),
        converged,
        stopped,
        points: points.len(),
        degrees_of_freedom: points.len() - inner.len(),
        noise_f,
        noise_is_given,
        reduced_chi_squared: known.as_ref().filter(|_| noise_is_given).map(|known| known.reduced),
        rms_residual_f: rms(&residuals(&at_end)),
        rms_residual_at_start_f: rms(&residuals(&at_start)),
        correlations: known.as_ref().map_or_else(Vec::new, |known| known.correlations.clone()),
        correlated: names.iter().map(|name| (*name).to_owned()).collect(),
        condition: known.as_ref().map(|known| known.condition),
        findings,
        curve_error_f: at_end.iter().map(|prediction| prediction.error).fold(0.0, f64::max),
        interpolation_error_f: interpolation.reduce(|a, b| a.zip(b).map(|(a, b)| a.max(b))).flatten(),
        iterations,
        effort: curves.effort(),
        measured_points: comparison,
        curves: FittedCurves {
            start: start_curve,
            start_correction: correction_of(parameters, &start, measured.correction),
            fitted: solved.curve.clone(),
            correction,
        },
    })
}

/// The text of a case with its fitted values, comments kept.
///
/// # Errors
/// [`OverrideError`] where a path does not fit the text.
pub fn fitted_case(source: &str, parameters: &[Parameter], fit: &Fit) -> Result<String, OverrideError> {
    parameters.iter().zip(&fit.parameters).try_fold(source.to_owned(), |text, (parameter, fitted)| {
        with_value(&text, &parameter.path, &parameter.to_toml(fitted.value))
    })
}

/// The root mean square.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// "lower" or "upper", if a value is at a limit of its parameter.
fn limit(parameter: &Parameter, value: f64) -> Option<&'static str> {
    let [low, high] = parameter.range;
    let is_at = |limit: f64| {
        let width = if low.is_finite() && high.is_finite() { high - low } else { limit.abs() };
        limit.is_finite() && (value - limit).abs() <= AT_LIMIT * width
    };
    if is_at(low) {
        Some("lower")
    } else if is_at(high) {
        Some("upper")
    } else {
        None
    }
}

/// The linearised fit in the parameters `inner`, given the predictions at the points and their derivatives by
/// all parameters. Everything is divided by the `scales` of the points.
fn linearise(
    scales: &[f64],
    points: &[MeasuredPoint],
    predictions: &[Prediction],
    columns: &[Vec<f64>],
    inner: &[usize],
    noise_is_known: bool,
) -> Linearised {
    let of_points = |value: &dyn Fn(usize) -> f64| {
        DVector::from_iterator(points.len(), (0..points.len()).map(|k| value(k) / scales[k]))
    };
    Linearised {
        jacobian: DMatrix::from_fn(points.len(), inner.len(), |row, column| {
            columns[inner[column]][row] / scales[row]
        }),
        residuals: of_points(&|k| points[k].capacitance - predictions[k].capacitance),
        errors: of_points(&|k| predictions[k].whole_error),
        noise_is_known,
    }
}

/// An error of the least-squares library in words.
fn in_words(error: &MPError) -> &'static str {
    match error {
        MPError::Input => "its input is not valid",
        MPError::Nan => "a residual is not a number",
        MPError::Empty => "there are no points",
        MPError::NoFree => "nothing is free",
        MPError::InitBounds => "a start is outside of its range",
        MPError::Bounds => "a range is empty",
        MPError::DoF => "there are fewer points than parameters",
        MPError::Eval => "the curve cannot be computed",
    }
}

//! Residuals of measured points and their derivatives, for the least-squares library.

use elastocap_case::{Correction, MeasuredPoint};
use rayon::prelude::*;
use rmpfit::{MPConfig, MPError, MPFitter, MPMaxFev, MPPar, MPResult, MPSide};

use crate::curves::{CurveError, Curves, SolvedCurve};
use crate::parameter::{Parameter, Quantity};

/// The first step of a difference quotient, over the value of the parameter (or, at zero, over a tenth of its
/// range). Measured: `benches/fits/orthosis.py`.
const FIRST_STEP: f64 = 0.02;
/// A difference is trusted if it is this many times larger than the stated error of the curve. The values are
/// usually ten times more accurate than the bounds, and their errors vary little between neighbouring values
/// of the parameter.
const TRUSTED: f64 = 5.0;
/// The largest step, over the range of the parameter. It is not tuned.
const LONGEST_STEP: f64 = 0.25;
/// The largest number of iterations. Not tuned: a limit that ordinary cases do not reach.
const MAX_ITERATIONS: usize = 60;

/// The predicted reading at a measured point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prediction {
    /// The capacitance that the meter should show, F.
    pub(crate) capacitance: f64,
    /// The stated error of the curve, in the reading, F.
    pub(crate) error: f64,
    /// The estimated error of interpolation, in the reading, F; `None` where it is not known.
    pub(crate) interpolation_error: Option<f64>,
    /// The sum of both errors, F; the interpolation error of any monotonic curve replaces an unknown one.
    pub(crate) whole_error: f64,
    /// The derivatives of the capacitance by offset, parasitic capacitance and gain.
    by_correction: [f64; 3],
}

/// The derivatives by one parameter, the factor by which its step was stretched, and whether even that step
/// was too small to be trusted.
type Column = (Vec<f64>, f64, bool);

/// Measured points, and the curves to be fitted to them.
pub(crate) struct Problem<'a> {
    curves: &'a Curves,
    parameters: &'a [Parameter],
    points: &'a [MeasuredPoint],
    /// The correction of the case, for its parts that are not free.
    correction: Correction,
    /// The divisor of each residual, F.
    pub(crate) scales: Vec<f64>,
    /// The ranges of the parameters, for the library.
    bounds: Vec<MPPar>,
    /// The settings of the library.
    config: MPConfig,
    /// The smallest sum of squares so far, and the values that gave it.
    pub(crate) best: Option<(f64, Vec<f64>)>,
    /// The error that ended the search.
    pub(crate) failure: Option<CurveError>,
    /// The factors by which the difference steps of the parameters have been stretched.
    stretch: Vec<f64>,
    /// Whether the curve changed too little with each parameter for a trusted difference.
    pub(crate) weak: Vec<bool>,
    /// The number of Jacobians so far.
    pub(crate) jacobians: usize,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        curves: &'a Curves,
        parameters: &'a [Parameter],
        points: &'a [MeasuredPoint],
        correction: Correction,
        scales: Vec<f64>,
    ) -> Self {
        let bound = |parameter: &Parameter| MPPar {
            limited_low: parameter.range[0].is_finite(),
            limited_up: parameter.range[1].is_finite(),
            limit_low: if parameter.range[0].is_finite() { parameter.range[0] } else { 0.0 },
            limit_up: if parameter.range[1].is_finite() { parameter.range[1] } else { 0.0 },
            side: MPSide::User,
            ..MPPar::new()
        };
        // Solved curves are smooth to about these tolerances.
        let config = MPConfig {
            ftol: 1e-9,
            xtol: 1e-7,
            gtol: 1e-9,
            max_iter: MAX_ITERATIONS,
            max_fev: MPMaxFev::Limited(4 * MAX_ITERATIONS),
            ..MPConfig::new()
        };
        Self {
            curves,
            parameters,
            points,
            correction,
            scales,
            bounds: parameters.iter().map(bound).collect(),
            config,
            best: None,
            failure: None,
            stretch: vec![1.0; parameters.len()],
            weak: vec![false; parameters.len()],
            jacobians: 0,
        }
    }

    /// The curve at these values of the parameters.
    pub(crate) fn curve(&self, values: &[f64]) -> Result<std::sync::Arc<SolvedCurve>, CurveError> {
        self.curves.curve(&keys(self.parameters, values))
    }

    /// Offset, parasitic capacitance and gain at these values of the parameters.
    pub(crate) fn correction(&self, values: &[f64]) -> Correction {
        correction_of(self.parameters, values, self.correction)
    }

    /// The predicted reading at each point, with its errors.
    pub(crate) fn predict(&self, values: &[f64]) -> Result<Vec<Prediction>, CurveError> {
        let solved = self.curve(values)?;
        let correction = self.correction(values);
        let predict = |point: &MeasuredPoint| {
            let Correction { offset, parasitic, gain } = correction;
            let value = solved.curve.continued(point.load - offset);
            Prediction {
                capacitance: gain * value.capacitance + parasitic,
                error: gain * value.error,
                interpolation_error: value.interpolation_error.map(|error| gain * error),
                whole_error: gain * value.whole_error(),
                by_correction: [-gain * value.slope, 1.0, value.capacitance],
            }
        };
        Ok(self.points.iter().map(predict).collect())
    }

    /// The derivatives of the predictions, a column for each parameter: exact for the corrections, by
    /// differences for keys.
    pub(crate) fn columns(&mut self, values: &[f64]) -> Result<Vec<Vec<f64>>, CurveError> {
        self.jacobians += 1;
        let predictions = self.predict(values)?;
        // Curves of different keys are solved side by side.
        let found: Vec<Result<Column, CurveError>> = (0..self.parameters.len())
            .into_par_iter()
            .map(|k| match self.parameters[k].quantity {
                Quantity::Key => self.difference(values, k, &predictions),
                Quantity::Offset => Ok((pick(&predictions, 0), 1.0, false)),
                Quantity::Parasitic => Ok((pick(&predictions, 1), 1.0, false)),
                Quantity::Gain => Ok((pick(&predictions, 2), 1.0, false)),
            })
            .collect();
        let mut columns = Vec::with_capacity(found.len());
        for (k, found) in found.into_iter().enumerate() {
            let (column, stretch, weak) = found?;
            (self.stretch[k], self.weak[k]) = (stretch, weak);
            columns.push(column);
        }
        Ok(columns)
    }

    /// The column of one key, the stretch of its step, and whether the difference is too small to be trusted.
    fn difference(&self, values: &[f64], k: usize, predictions: &[Prediction]) -> Result<Column, CurveError> {
        let [low, high] = self.parameters[k].range;
        let value = values[k];
        let size = if value == 0.0 { 0.1 * (high - low) } else { value.abs() };
        let mut stretch = self.stretch[k];
        loop {
            let longest = LONGEST_STEP * (high - low);
            let step = (FIRST_STEP * stretch * size).min(longest);
            let (below, above) = ((value - step).max(low), (value + step).min(high));
            let at = |moved_value: f64| {
                let mut moved = values.to_vec();
                moved[k] = moved_value;
                self.predict(&moved)
            };
            let (below_found, above_found) = rayon::join(|| at(below), || at(above));
            // If the case does not allow one side, the difference is one-sided.
            let sides = match (below_found, above_found) {
                (Ok(before), Ok(after)) => ((below, before), (above, after)),
                (Err(CurveError::Stopped), _) | (_, Err(CurveError::Stopped)) => {
                    return Err(CurveError::Stopped);
                }
                (Ok(before), Err(_)) if below < value => ((below, before), (value, predictions.to_vec())),
                (Err(_), Ok(after)) if above > value => ((value, predictions.to_vec()), (above, after)),
                (Err(error), _) | (_, Err(error)) => return Err(error),
            };
            let ((from, before), (to, after)) = sides;
            let changes: Vec<f64> =
                before.iter().zip(&after).map(|(a, b)| b.capacitance - a.capacitance).collect();
            let change = changes.iter().map(|change| change.abs()).fold(0.0, f64::max);
            let error = predictions.iter().map(|prediction| prediction.error).fold(0.0, f64::max);
            let is_weak = change < TRUSTED * error;
            if !is_weak || step >= longest {
                let column = changes.iter().map(|change| change / (to - from)).collect();
                return Ok((column, stretch, is_weak));
            }
            stretch *= 3.0;
        }
    }

    /// Remembers the values if their sum of squares is the smallest so far.
    fn note(&mut self, values: &[f64], sum: f64) {
        if sum.is_finite() && self.best.as_ref().is_none_or(|(least, _)| sum < *least) {
            self.best = Some((sum, values.to_vec()));
        }
    }

    /// Computes the residuals over their scales.
    fn fill(&mut self, values: &[f64], deviates: &mut [f64]) -> MPResult<()> {
        match self.predict(values) {
            Ok(found) => {
                for (k, (deviate, prediction)) in deviates.iter_mut().zip(&found).enumerate() {
                    *deviate = (self.points[k].capacitance - prediction.capacitance) / self.scales[k];
                }
                self.note(values, deviates.iter().map(|deviate| deviate * deviate).sum());
                Ok(())
            }
            Err(CurveError::Stopped) => {
                self.failure = Some(CurveError::Stopped);
                Err(MPError::Eval)
            }
            // Values that the case does not allow count as worse than all others; the search then takes a
            // shorter step.
            Err(_) => {
                let worst = self.best.as_ref().map_or(1e6, |(least, _)| 1e3 * least.sqrt() + 1e3);
                deviates.fill(worst);
                Ok(())
            }
        }
    }
}

/// The derivatives of the predictions by one of the corrections.
fn pick(predictions: &[Prediction], which: usize) -> Vec<f64> {
    predictions.iter().map(|prediction| prediction.by_correction[which]).collect()
}

/// The keys of the case among the parameters, with their values as TOML.
pub(crate) fn keys<'a>(parameters: &'a [Parameter], values: &[f64]) -> Vec<(&'a str, String)> {
    let keys = parameters.iter().zip(values).filter(|(parameter, _)| parameter.quantity == Quantity::Key);
    keys.map(|(parameter, value)| (parameter.path.as_str(), parameter.to_toml(*value))).collect()
}

/// The correction with these values of the parameters, and with the parts of `fixed` that are not free.
pub(crate) fn correction_of(parameters: &[Parameter], values: &[f64], fixed: Correction) -> Correction {
    let mut correction = fixed;
    for (parameter, value) in parameters.iter().zip(values) {
        match parameter.quantity {
            Quantity::Key => {}
            Quantity::Offset => correction.offset = *value,
            Quantity::Parasitic => correction.parasitic = *value,
            Quantity::Gain => correction.gain = *value,
        }
    }
    correction
}

impl MPFitter for Problem<'_> {
    fn eval(&mut self, params: &[f64], deviates: &mut [f64]) -> MPResult<()> {
        self.fill(params, deviates)
    }

    fn number_of_points(&self) -> usize {
        self.points.len()
    }

    fn config(&self) -> &MPConfig {
        &self.config
    }

    fn parameters(&self) -> &[MPPar] {
        &self.bounds
    }

    fn jacobian(
        &mut self,
        params: &[f64],
        deviates: &mut [f64],
        derivs: &mut [Option<Vec<f64>>],
    ) -> MPResult<()> {
        self.fill(params, deviates)?;
        let columns = match self.columns(params) {
            Ok(columns) => columns,
            Err(error) => {
                self.failure = Some(error);
                return Err(MPError::Eval);
            }
        };
        for (derivative, column) in derivs.iter_mut().zip(columns) {
            if let Some(out) = derivative {
                for (k, (entry, slope)) in out.iter_mut().zip(column).enumerate() {
                    *entry = -slope / self.scales[k];
                }
            }
        }
        Ok(())
    }
}

//! Residuals of measured points and their derivatives, for the least-squares library.

use elastocap_case::{Correction, MeasuredPoint};
use rayon::prelude::*;
use rmpfit::{MPConfig, MPError, MPFitter, MPMaxFev, MPPar, MPResult, MPSide};

use crate::curves::{CurveError, Curves, SolvedCurve};
use crate::parameter::{Parameter, Quantity};

/// The first step of a difference over the value of the parameter (or, at zero, over its range).
const FIRST_STEP: f64 = 0.02;
/// A difference is trusted if it is this much larger than the stated error of the curve. The values are usually ten times nearer to the
/// truth than the bounds, and their errors change little between neighbouring values.
const TRUSTED: f64 = 5.0;
/// No step is longer than this share of the range.
const LONGEST_STEP: f64 = 0.25;
/// The largest number of iterations.
const MAX_ITERATIONS: usize = 60;

/// The prediction for a measured point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prediction {
    /// The capacitance that the meter shows, F.
    pub(crate) capacitance: f64,
    /// The stated error of the curve there, in what the meter shows, F.
    pub(crate) error: f64,
    /// The estimated error of interpolation, in what the meter shows, F; `None` where nothing is known of it.
    pub(crate) interpolation_error: Option<f64>,
    /// Both errors, or the first and that of any monotonic curve where no other is known of interpolation, F.
    pub(crate) whole_error: f64,
    /// Its derivatives by offset, parasitic capacitance and gain.
    by_correction: [f64; 3],
}

/// The derivatives by one parameter, the stretch of the step that they took, and whether that was too small to be trusted.
type Column = (Vec<f64>, f64, bool);

/// Measured points, and the curves that should go through them.
pub(crate) struct Problem<'a> {
    curves: &'a Curves,
    parameters: &'a [Parameter],
    points: &'a [MeasuredPoint],
    /// The correction of the case, for those of its parts that are not free.
    correction: Correction,
    /// The number that each residual is divided by, F.
    pub(crate) scales: Vec<f64>,
    bounds: Vec<MPPar>,
    config: MPConfig,
    /// The smallest sum of squares so far, and the values that gave it.
    pub(crate) best: Option<(f64, Vec<f64>)>,
    /// Why the search had to end.
    pub(crate) failure: Option<CurveError>,
    /// How much longer the steps of the differences by each parameter have become.
    stretch: Vec<f64>,
    /// Whether a difference stayed below what can be trusted.
    pub(crate) weak: Vec<bool>,
    /// Jacobians so far.
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
        let bound = |own: &Parameter| MPPar {
            limited_low: own.range[0].is_finite(),
            limited_up: own.range[1].is_finite(),
            limit_low: if own.range[0].is_finite() { own.range[0] } else { 0.0 },
            limit_up: if own.range[1].is_finite() { own.range[1] } else { 0.0 },
            side: MPSide::User,
            ..MPPar::new()
        };
        // Solved curves are not smooth to more digits than these.
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

    /// The capacitances that the meter should show at each point, with their errors.
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

    /// The derivatives of the predictions, a column for each parameter: exact for the corrections, by differences for keys.
    pub(crate) fn columns(&mut self, values: &[f64]) -> Result<Vec<Vec<f64>>, CurveError> {
        self.jacobians += 1;
        let here = self.predict(values)?;
        // Curves of different keys are solved side by side.
        let found: Vec<Result<Column, CurveError>> = (0..self.parameters.len())
            .into_par_iter()
            .map(|k| match self.parameters[k].quantity {
                Quantity::Key => self.difference(values, k, &here),
                Quantity::Offset => Ok((pick(&here, 0), 1.0, false)),
                Quantity::Parasitic => Ok((pick(&here, 1), 1.0, false)),
                Quantity::Gain => Ok((pick(&here, 2), 1.0, false)),
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
    fn difference(&self, values: &[f64], k: usize, here: &[Prediction]) -> Result<Column, CurveError> {
        let [low, high] = self.parameters[k].range;
        let own = values[k];
        let size = if own == 0.0 { 0.1 * (high - low) } else { own.abs() };
        let mut stretch = self.stretch[k];
        loop {
            let longest = LONGEST_STEP * (high - low);
            let step = (FIRST_STEP * stretch * size).min(longest);
            let (below, above) = ((own - step).max(low), (own + step).min(high));
            let at = |value: f64| {
                let mut moved = values.to_vec();
                moved[k] = value;
                self.predict(&moved)
            };
            let (below_found, above_found) = rayon::join(|| at(below), || at(above));
            // Beyond the edge of what the case allows, the other side will do.
            let sides = match (below_found, above_found) {
                (Ok(before), Ok(after)) => ((below, before), (above, after)),
                (Err(CurveError::Stopped), _) | (_, Err(CurveError::Stopped)) => {
                    return Err(CurveError::Stopped);
                }
                (Ok(before), Err(_)) if below < own => ((below, before), (own, here.to_vec())),
                (Err(_), Ok(after)) if above > own => ((own, here.to_vec()), (above, after)),
                (Err(error), _) | (_, Err(error)) => return Err(error),
            };
            let ((from, before), (to, after)) = sides;
            let changes: Vec<f64> =
                before.iter().zip(&after).map(|(a, b)| b.capacitance - a.capacitance).collect();
            let change = changes.iter().map(|change| change.abs()).fold(0.0, f64::max);
            let error = here.iter().map(|own| own.error).fold(0.0, f64::max);
            let is_weak = change < TRUSTED * error;
            if !is_weak || step >= longest {
                let column = changes.iter().map(|change| change / (to - from)).collect();
                return Ok((column, stretch, is_weak));
            }
            stretch *= 3.0;
        }
    }

    fn note(&mut self, values: &[f64], sum: f64) {
        if sum.is_finite() && self.best.as_ref().is_none_or(|(least, _)| sum < *least) {
            self.best = Some((sum, values.to_vec()));
        }
    }

    fn fill(&mut self, values: &[f64], deviates: &mut [f64]) -> MPResult<()> {
        match self.predict(values) {
            Ok(found) => {
                for (k, (deviate, own)) in deviates.iter_mut().zip(&found).enumerate() {
                    *deviate = (self.points[k].capacitance - own.capacitance) / self.scales[k];
                }
                self.note(values, deviates.iter().map(|deviate| deviate * deviate).sum());
                Ok(())
            }
            Err(CurveError::Stopped) => {
                self.failure = Some(CurveError::Stopped);
                Err(MPError::Eval)
            }
            // Values that the case does not allow are worse than all others; the search then takes a shorter step.
            Err(_) => {
                let worst = self.best.as_ref().map_or(1e6, |(least, _)| 1e3 * least.sqrt() + 1e3);
                deviates.fill(worst);
                Ok(())
            }
        }
    }
}

fn pick(predictions: &[Prediction], which: usize) -> Vec<f64> {
    predictions.iter().map(|own| own.by_correction[which]).collect()
}

/// The keys of the case among the parameters, with their values as TOML.
pub(crate) fn keys<'a>(parameters: &'a [Parameter], values: &[f64]) -> Vec<(&'a str, String)> {
    let keys = parameters.iter().zip(values).filter(|(own, _)| own.quantity == Quantity::Key);
    keys.map(|(own, value)| (own.path.as_str(), own.to_toml(*value))).collect()
}

pub(crate) fn correction_of(parameters: &[Parameter], values: &[f64], fixed: Correction) -> Correction {
    let mut found = fixed;
    for (own, value) in parameters.iter().zip(values) {
        match own.quantity {
            Quantity::Key => {}
            Quantity::Offset => found.offset = *value,
            Quantity::Parasitic => found.parasitic = *value,
            Quantity::Gain => found.gain = *value,
        }
    }
    found
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
                for (k, (entry, own)) in out.iter_mut().zip(column).enumerate() {
                    *entry = -own / self.scales[k];
                }
            }
        }
        Ok(())
    }
}

//! Varies keys of a case until a quantity is largest or smallest, within limits on others.
//!
//! The method is Powell's COBYLA, in the implementation of NLopt: linear models of the quantity and of the
//! limits through values at a few points, without derivatives. It finds a local optimum.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use cobyla::{Func, RhoBeg, StopTols, minimize};
use elastocap_case::{Case, OverrideError, with_value};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use serde::Serialize;

use crate::objective::{Constraint, NoValue, Quantity, WishError, case_at};
use crate::parameter::{Free, Parameter, ParameterError, parameters};

/// The first step of each key over its range. Measured: `benches/fits/optimum.py`.
const FIRST_STEP: f64 = 0.25;
/// The default of the largest number of evaluations.
pub const MAX_EVALUATIONS: usize = 60;
/// The objective given to a place where it cannot be computed, over its value at the start. It is not tuned.
const FAILED: f64 = 10.0;

/// The task of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// The quantity to be made largest or smallest.
    pub quantity: Quantity,
    /// Whether the quantity is to be made largest.
    pub maximise: bool,
    /// The limits to be respected.
    pub constraints: Vec<Constraint>,
    /// The wanted tolerance of the keys, over their ranges.
    pub tolerance: f64,
    /// The largest number of evaluations.
    pub max_evaluations: usize,
}

/// The reason why there is no search.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OptimiseError {
    /// A varied key is not in the case, or its range is unsuitable.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A key has no range.
    #[error("{0} needs a range to vary in, such as {0}=a..b")]
    Unbounded(String),
    /// Some loads are forces and others compressions.
    #[error(transparent)]
    Wish(#[from] WishError),
    /// The case has no mechanics or no capacitance; the text names the missing part.
    #[error("the case needs [mechanics] and a capacitance for this search: {0}")]
    NoCurve(&'static str),
    /// The evaluation at the start fails.
    #[error("the search cannot begin at {place}: {reason}; give another start, such as KEY=a..b@start")]
    Start {
        /// The values of the keys, in words.
        place: String,
        /// The reason of the failure.
        reason: Box<EvaluationError>,
    },
    /// The work was stopped on request before the first value.
    #[error("stopped")]
    Stopped,
}

/// The reason why an evaluation has no value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// A key cannot be set.
    #[error(transparent)]
    Path(#[from] OverrideError),
    /// The case is not valid with these values; the first error in it, in one line.
    #[error("{0}")]
    Case(String),
    /// Some loads are forces and others compressions.
    #[error(transparent)]
    Wish(#[from] WishError),
    /// The run does not give a quantity.
    #[error(transparent)]
    Value(#[from] NoValue),
    /// The work was stopped on request.
    #[error("stopped")]
    Stopped,
}

/// Serialized as its message.
impl Serialize for EvaluationError {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// One evaluation of a search: the values of the keys, and its results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evaluation {
    /// The values of the keys, in SI units.
    pub values: Vec<f64>,
    /// The value of the quantity to be made smallest or largest, in its SI unit; `None` if it could not be
    /// computed.
    pub objective: Option<f64>,
    /// The error of the objective from bounds and stated errors, in its SI unit.
    pub objective_error: Option<f64>,
    /// The values of the limited quantities, in their SI units; empty if they could not be computed.
    pub limited: Vec<f64>,
    /// Whether all limits are respected.
    pub is_allowed: bool,
    /// The reason why the values could not be computed.
    pub failure: Option<EvaluationError>,
    /// Wall-clock seconds of the evaluation.
    pub seconds: f64,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Optimum {
    /// The position of the best allowed evaluation in `evaluations`; `None` if none was allowed.
    pub best: Option<usize>,
    /// All evaluations, in their order.
    pub evaluations: Vec<Evaluation>,
    /// Whether the search ended because its steps had become as small as the tolerance.
    pub converged: bool,
    /// Whether the search was stopped on request.
    pub stopped: bool,
    /// The names of keys that ended at a limit of their range.
    pub at_limit: Vec<String>,
}

/// Evaluates the quantities of a search at values of the keys, once for each set of values.
struct Evaluator<'a> {
    /// The text of the case.
    source: &'a str,
    /// The file that the case is from.
    origin: &'a Path,
    /// The keys that vary.
    parameters: &'a [Parameter],
    search: &'a Search,
    /// Set when the search is to stop.
    cancel: &'a Arc<AtomicBool>,
    /// The evaluations so far.
    done: Mutex<Vec<Evaluation>>,
    /// A callback that gets each evaluation and its number.
    report: &'a (dyn Fn(&Evaluation, usize) + Sync),
}

/// The keys that vary, with their ranges.
///
/// # Errors
/// [`OptimiseError`] if a key is not in the case or has no range.
pub fn varied(free: &[Free], source: &str) -> Result<Vec<Parameter>, OptimiseError> {
    if let Some(open) = free.iter().find(|free| free.range.is_none()) {
        return Err(OptimiseError::Unbounded(open.name.clone()));
    }
    Ok(parameters(free, source, None)?)
}

/// Searches from the values of the case, or from the middle of the ranges. `report` gets each evaluation and
/// its number.
///
/// # Errors
/// [`OptimiseError`] where the search cannot begin.
pub fn optimise(
    source: &str,
    origin: &Path,
    parameters: &[Parameter],
    search: &Search,
    cancel: &Arc<AtomicBool>,
    report: &(dyn Fn(&Evaluation, usize) + Sync),
) -> Result<Optimum, OptimiseError> {
    let evaluator = Evaluator { source, origin, parameters, search, cancel, done: Mutex::default(), report };
    evaluator.check()?;
    let share_of_range = |parameter: &Parameter, value: f64| {
        (value - parameter.range[0]) / (parameter.range[1] - parameter.range[0])
    };
    let start: Vec<f64> =
        parameters.iter().map(|parameter| share_of_range(parameter, parameter.start)).collect();
    let first = evaluator.at(&start);
    let size = match (first.objective, first.failure) {
        (Some(value), None) if value != 0.0 => value.abs(),
        (Some(_) | None, None) => 1.0,
        (_, Some(EvaluationError::Stopped)) => return Err(OptimiseError::Stopped),
        (_, Some(reason)) => {
            let place = evaluator.in_words(&first.values);
            return Err(OptimiseError::Start { place, reason: Box::new(reason) });
        }
    };
    let sign = if search.maximise { -1.0 } else { 1.0 };
    let objective = |x: &[f64], (): &mut ()| match evaluator.at(x).objective {
        Some(value) => sign * value / size,
        None => FAILED,
    };
    let limit = |k: usize| {
        let evaluator = &evaluator;
        move |x: &[f64], (): &mut ()| match evaluator.at(x).limited.get(k) {
            Some(value) => search.constraints[k].margin(*value),
            None => -FAILED,
        }
    };
    let limits: Vec<_> = (0..search.constraints.len()).map(limit).collect();
    let constraints: Vec<&dyn Func<()>> = limits.iter().map(|limit| limit as &dyn Func<()>).collect();
    let tolerances = StopTols { xtol_abs: vec![search.tolerance; start.len()], ..StopTols::default() };
    let bounds = vec![(0.0, 1.0); start.len()];
    let ended = minimize(
        objective,
        &start,
        &bounds,
        &constraints,
        (),
        search.max_evaluations,
        RhoBeg::All(FIRST_STEP),
        Some(tolerances),
    );
    let converged = matches!(
        ended,
        Ok((
            cobyla::SuccessStatus::Success
                | cobyla::SuccessStatus::XtolReached
                | cobyla::SuccessStatus::FtolReached,
            ..
        ))
    );
    let stopped = cancel.load(Ordering::Relaxed);
    let evaluations = evaluator.done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let best = best(&evaluations, search.maximise);
    let at_limit = best.map_or_else(Vec::new, |k| {
        let is_at_limit = |(parameter, value): &(&Parameter, &f64)| {
            let share = share_of_range(parameter, **value);
            !(search.tolerance..=1.0 - search.tolerance).contains(&share)
        };
        parameters
            .iter()
            .zip(&evaluations[k].values)
            .filter(is_at_limit)
            .map(|(parameter, _)| parameter.name.clone())
            .collect()
    });
    Ok(Optimum { best, evaluations, converged: converged && !stopped, stopped, at_limit })
}

/// The text of a case with the values of an evaluation, comments kept.
///
/// # Errors
/// [`OverrideError`] where a path does not fit the text.
pub fn case_of(source: &str, parameters: &[Parameter], values: &[f64]) -> Result<String, OverrideError> {
    parameters.iter().zip(values).try_fold(source.to_owned(), |text, (parameter, value)| {
        with_value(&text, &parameter.path, &parameter.to_toml(*value))
    })
}

/// The position of the best of the allowed evaluations.
fn best(evaluations: &[Evaluation], maximise: bool) -> Option<usize> {
    let value = |k: &usize| {
        let objective = evaluations[*k].objective.unwrap_or(f64::NEG_INFINITY);
        if maximise { objective } else { -objective }
    };
    let allowed = (0..evaluations.len()).filter(|k| evaluations[*k].is_allowed);
    allowed.reduce(|best, k| if value(&k) > value(&best) { k } else { best })
}

impl Evaluator<'_> {
    /// The evaluation at the place `x`, whose coordinates run from 0 to 1 over the ranges of the keys.
    fn at(&self, x: &[f64]) -> Evaluation {
        let values: Vec<f64> = self
            .parameters
            .iter()
            .zip(x)
            .map(|(parameter, x)| {
                parameter.range[0] + x.clamp(0.0, 1.0) * (parameter.range[1] - parameter.range[0])
            })
            .collect();
        let known = |done: &[Evaluation]| done.iter().find(|evaluation| evaluation.values == values).cloned();
        if let Some(known) = known(&self.done.lock().unwrap_or_else(PoisonError::into_inner)) {
            return known;
        }
        let started = Instant::now();
        let found = self.evaluate(&values);
        let mut evaluation = Evaluation {
            values,
            objective: None,
            objective_error: None,
            limited: Vec::new(),
            is_allowed: false,
            failure: None,
            seconds: started.elapsed().as_secs_f64(),
        };
        match found {
            Ok(((value, error), limited)) => {
                evaluation.is_allowed = self
                    .search
                    .constraints
                    .iter()
                    .zip(&limited)
                    .all(|(constraint, value)| constraint.margin(*value) >= 0.0);
                (evaluation.objective, evaluation.objective_error) = (Some(value), Some(error));
                evaluation.limited = limited;
            }
            Err(reason) => evaluation.failure = Some(reason),
        }
        // An evaluation cut short by a signal does not count.
        if !self.cancel.load(Ordering::Relaxed) {
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            done.push(evaluation.clone());
            (self.report)(&evaluation, done.len());
        }
        evaluation
    }

    /// The objective with its error, and the limited quantities, in SI units.
    fn evaluate(&self, values: &[f64]) -> Result<((f64, f64), Vec<f64>), EvaluationError> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(EvaluationError::Stopped);
        }
        let case = case_at(self.case(values)?, &self.quantities())?;
        let options = Options { prune: true, fields: false, scene: false, model_error: false };
        let plan = Plan::new(&case, &options);
        let outcome = run(&case, &plan, &options, self.cancel, &());
        if outcome.stopped {
            return Err(EvaluationError::Stopped);
        }
        let objective = self.search.quantity.value(&outcome)?;
        let limited =
            self.search.constraints.iter().map(|constraint| Ok(constraint.quantity.value(&outcome)?.0));
        Ok((objective, limited.collect::<Result<_, NoValue>>()?))
    }

    /// The case with these values, and with the loads of its file.
    fn case(&self, values: &[f64]) -> Result<Case, EvaluationError> {
        let text = case_of(self.source, self.parameters, values)?;
        elastocap_case::parse(&text, self.origin)
            .map_err(|error| EvaluationError::Case(error.diagnostics()[0].message.clone()))
    }

    /// The objective and the limited quantities.
    fn quantities(&self) -> Vec<Quantity> {
        let limited = self.search.constraints.iter().map(|constraint| constraint.quantity);
        std::iter::once(self.search.quantity).chain(limited).collect()
    }

    /// Checks that the case has the mechanics and the capacitance that the search needs.
    fn check(&self) -> Result<(), OptimiseError> {
        let values: Vec<f64> = self.parameters.iter().map(|parameter| parameter.start).collect();
        let case = self.case(&values).map_err(|reason| OptimiseError::Start {
            place: self.in_words(&values),
            reason: Box::new(reason),
        })?;
        if !case.has_conductors() {
            return Err(OptimiseError::NoCurve("it has no conductors"));
        }
        if case.mechanics.is_none() || case.load.is_none() {
            return Err(OptimiseError::NoCurve("it has no [load]"));
        }
        case_at(case, &self.quantities())?;
        Ok(())
    }

    /// Values of the keys in words.
    fn in_words(&self, values: &[f64]) -> String {
        let shown = self
            .parameters
            .iter()
            .zip(values)
            .map(|(parameter, value)| format!("{} = {}", parameter.name, parameter.show(*value, 5)));
        shown.collect::<Vec<_>>().join(", ")
    }
}

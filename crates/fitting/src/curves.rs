//! Computes the curve of a case for any values of its keys, and remembers it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use elastocap_case::{
    Case, CaseError, Load, MeasuredLoad, Mechanics, OverrideError, ShearLength, with_value,
};
use elastocap_coupling::deform::prepare;
use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_coupling::scene::scene_of;
use elastocap_results::load_curve::{CurveStep, LoadCurve, NoCurve};

/// The reason why there is no curve for some values.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// A key cannot be set.
    #[error(transparent)]
    Path(#[from] OverrideError),
    /// The case with these values is not valid.
    #[error("with {values} the case is not valid:\n{error}")]
    Case {
        /// The values, in words.
        values: String,
        /// The error in the case.
        error: Box<CaseError>,
    },
    /// Too few steps of the case were solved.
    #[error("with {values} {error}{}", .reason.as_ref().map(|reason| format!(" (a step failed: {reason})")).unwrap_or_default())]
    NoCurve {
        /// The values, in words.
        values: String,
        /// The error, with the number of usable steps.
        error: NoCurve,
        /// The reason why a step failed, if one did.
        reason: Option<String>,
    },
    /// The work was stopped on request.
    #[error("stopped")]
    Stopped,
}

/// The number of curves solved so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Effort {
    /// The number of curves with newly solved fields.
    pub curves_solved: usize,
    /// The number of curves whose bodies lay in the same places as for other values, so that no field had to
    /// be solved.
    pub curves_shared: usize,
}

/// A curve of a case, with the steps missing on it.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedCurve {
    /// The capacitance against the load.
    pub curve: LoadCurve,
    /// The number of steps of the case that are not on the curve, because they failed or have no force.
    pub missing_steps: usize,
}

/// The computed capacitance of a scene, F, and its error from bounds and faceting, F.
type Known = (f64, f64);

/// The curves of a case for different values of its keys.
#[derive(Debug)]
pub struct Curves {
    /// The text of the case.
    source: String,
    /// The file that the case is from.
    origin: PathBuf,
    /// The kind of load that the curves are over.
    load: MeasuredLoad,
    /// Set when the work is to stop.
    cancel: Arc<AtomicBool>,
    /// The known curves by the values of the keys, in words.
    by_values: Mutex<HashMap<String, Arc<SolvedCurve>>>,
    /// The known capacitances by a text of the deformed scene.
    by_scene: Mutex<HashMap<String, Known>>,
    /// The number of curves with newly solved fields.
    solved: AtomicUsize,
    /// The number of curves whose capacitances were all known.
    shared: AtomicUsize,
}

/// The options of the runs: nothing but the capacitances is wanted.
const OPTIONS: Options = Options { prune: true, fields: false, scene: false, model_error: false };

impl Curves {
    /// The curves of the case with the text `source` from a file `origin`, over loads of this kind; each is
    /// solved on request. `cancel` stops the work.
    pub fn new(source: &str, origin: &Path, load: MeasuredLoad, cancel: Arc<AtomicBool>) -> Self {
        Self {
            source: source.to_owned(),
            origin: origin.to_owned(),
            load,
            cancel,
            by_values: Mutex::default(),
            by_scene: Mutex::default(),
            solved: AtomicUsize::new(0),
            shared: AtomicUsize::new(0),
        }
    }

    /// The number of curves solved so far.
    pub fn effort(&self) -> Effort {
        Effort {
            curves_solved: self.solved.load(Ordering::Relaxed),
            curves_shared: self.shared.load(Ordering::Relaxed),
        }
    }

    /// Whether the work was stopped.
    pub fn is_stopped(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// The text of the case with these values of its keys, as TOML.
    ///
    /// # Errors
    /// [`OverrideError`] where a path does not fit.
    pub fn text(&self, values: &[(&str, String)]) -> Result<String, OverrideError> {
        values.iter().try_fold(self.source.clone(), |text, (path, value)| with_value(&text, path, value))
    }

    /// The curve with these values of keys.
    ///
    /// # Errors
    /// [`CurveError`] if the case is not valid with the values, if too few of its steps can be solved, and
    /// when the work is stopped.
    pub fn curve(&self, values: &[(&str, String)]) -> Result<Arc<SolvedCurve>, CurveError> {
        let key = in_words(values);
        if let Some(known) = lock(&self.by_values).get(&key) {
            return Ok(Arc::clone(known));
        }
        let text = self.text(values)?;
        let case = elastocap_case::parse(&text, &self.origin)
            .map_err(|error| CurveError::Case { values: key.clone(), error: Box::new(error) })?;
        let solved = Arc::new(self.of_case(&case, &key)?);
        lock(&self.by_values).insert(key, Arc::clone(&solved));
        Ok(solved)
    }

    /// The curve of a case, from known capacitances if all of its scenes have them.
    fn of_case(&self, case: &Case, values: &str) -> Result<SolvedCurve, CurveError> {
        let plan = Plan::new(case, &OPTIONS);
        if let Some((steps, total)) = self.known_steps(case, &plan) {
            let missing_steps = total - steps.len();
            if let Ok(curve) = LoadCurve::through(steps) {
                self.shared.fetch_add(1, Ordering::Relaxed);
                return Ok(SolvedCurve { curve, missing_steps });
            }
        }
        if self.is_stopped() {
            return Err(CurveError::Stopped);
        }
        let outcome = run(case, &plan, &OPTIONS, &self.cancel, &());
        if outcome.stopped {
            return Err(CurveError::Stopped);
        }
        self.solved.fetch_add(1, Ordering::Relaxed);
        self.remember(case, &outcome);
        let curve = LoadCurve::of(case, &outcome, self.load).map_err(|error| {
            let failed = outcome.steps.iter().find(|step| matches!(step.row.status, Status::Failed(_)));
            let reason = failed.map(|step| step.row.status.to_string());
            CurveError::NoCurve { values: values.to_owned(), error, reason }
        })?;
        let missing_steps = outcome.steps.len().saturating_sub(curve.steps().len());
        Ok(SolvedCurve { curve, missing_steps })
    }

    /// The steps of a case from known capacitances, and the total number of steps; `None` unless the bodies
    /// of all steps lie in the same places as for other values of keys. Steps without a force are left out.
    /// Only for layers whose deformation is given by formulas.
    fn known_steps(&self, case: &Case, plan: &Plan) -> Option<(Vec<CurveStep>, usize)> {
        if !has_quick_mechanics(case) || plan.steps.iter().any(|step| step.pose != Default::default()) {
            return None;
        }
        let layer = prepare(case, &plan.loads(), plan.layer_memory_limit, &self.cancel, &|_| ());
        let known = lock(&self.by_scene);
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in &plan.steps {
            let state = layer.deformation(case, step.index, step.load, true).ok()?;
            let scene = scene_of(case, state.as_ref(), &step.pose).ok()?;
            let (capacitance, error) = *known.get(&scene_key(case, &scene))?;
            let compression = state.as_ref().map_or(0.0, |state| state.compression());
            let beyond = plan.force_limit.is_some_and(|limit| compression > limit.compression);
            let load = match self.load {
                MeasuredLoad::Force if beyond && matches!(case.load, Some(Load::Compression(_))) => continue,
                MeasuredLoad::Force => state.as_ref().map_or(0.0, |state| state.force()),
                MeasuredLoad::Displacement => state.as_ref().map_or(0.0, |state| state.top_displacement()),
                MeasuredLoad::Compression => compression,
            };
            steps.push(CurveStep { load, load_error: 0.0, capacitance, error });
        }
        Some((steps, plan.steps.len()))
    }

    /// Remembers the capacitances of the scenes of a run.
    fn remember(&self, case: &Case, outcome: &Outcome) {
        if !has_quick_mechanics(case) {
            return;
        }
        let mut known = lock(&self.by_scene);
        for step in &outcome.steps {
            if let (Some(scene), Some(capacitance)) = (&step.scene, step.row.capacitance_f) {
                let errors = [step.row.relative_error_estimate, step.row.geometry_error_estimate];
                let error: f64 = errors.iter().flatten().sum();
                known.insert(scene_key(case, scene), (capacitance, error * capacitance.abs()));
            }
        }
    }
}

/// Whether closed-form formulas give the deformation of the layer.
fn has_quick_mechanics(case: &Case) -> bool {
    matches!(case.mechanics, Some(Mechanics::ClosedForm { shear_length: ShearLength::Given(_), .. }))
}

/// A text of everything that a field solve depends on, with all digits of the numbers.
fn scene_key(case: &Case, scene: &elastocap_coupling::scene::DeformedScene) -> String {
    format!("{:?} {:?} {:?} {:?}", scene.scene, case.electrostatics, case.terminals, case.measured)
}

/// The values of keys in words.
fn in_words(values: &[(&str, String)]) -> String {
    values.iter().map(|(path, value)| format!("{path} = {value}")).collect::<Vec<_>>().join(", ")
}

/// Locks a mutex, ignoring poisoning: its data are consistent at any time, also after a panic elsewhere.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

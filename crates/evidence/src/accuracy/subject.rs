//! The subject of a study: one state of a case, and one timed solve of its field.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use elastocap_electrostatics::{Bounded, Effort, ResolutionLevel, Settings, Solution, forecast, solve};

use super::Refused;
use elastocap_case::{Case, Measurement};
use elastocap_coupling::deform::prepare;
use elastocap_coupling::failure::{StepFailure, Stop};
use elastocap_coupling::plan::{Options, Plan, PlannedStep};
use elastocap_coupling::route::{Bending, Bodies, Route, asked, route};
use elastocap_coupling::scene::{DeformedScene, scene_of};
use elastocap_coupling::terminals::shown;

/// The capacitance that is studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The capacitance that the case measures.
    Measured(Measurement),
    /// The first diagonal entry of the Maxwell matrix, if the case measures the whole matrix.
    FirstEntry,
}

/// The result of one solve.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measured {
    /// Wall-clock seconds of the solve.
    pub(super) seconds: f64,
    /// The studied capacitance.
    pub(super) value: Bounded,
    /// The error that the solver compares with the tolerance: a spread or an estimate, of the whole matrix if
    /// that is measured.
    pub(super) reported_error: f64,
    /// The order and the layers of the last grid.
    pub(super) level: Option<ResolutionLevel>,
    /// The number of unknowns of the largest problem.
    pub(super) unknowns: usize,
}

/// One state of a case, ready to be solved.
pub(super) struct Subject {
    settings: Settings,
    /// The bodies of the state.
    deformed: DeformedScene,
    pub(super) quantity: Quantity,
    /// The parallel-plate value, F, and its computing time with mechanics, s.
    pub(super) plates: Option<(f64, f64)>,
}

impl Subject {
    /// The state of a load step, with the settings of a run.
    ///
    /// # Errors
    /// A step that a run does not solve, or not by the box solver alone.
    pub(super) fn new(
        case: &Case,
        plan: &Plan,
        step: &PlannedStep,
        cancel: &Arc<AtomicBool>,
    ) -> Result<Self, Refused> {
        let failed = |failure: StepFailure| Refused::Step { step: step.index, failure: Box::new(failure) };
        let by_boxes = |taken: Route| match taken {
            Route::BOXES => Ok(()),
            _ => Err(Refused::Route { step: step.index, taken }),
        };
        // Known failures come before the layer is pressed, which may take minutes.
        if let Some(failure) = &step.failure {
            return Err(failed(failure.clone()));
        }
        step.route.map_or(Ok(()), by_boxes)?;
        let options = Options { prune: true, fields: false, scene: false, model_error: false };
        let settings =
            Settings { cancel: Some(Arc::clone(cancel)), ..plan.solver_settings(case, &options).boxes() };
        let layer = prepare(case, &plan.loads(), plan.layer_memory_limit, cancel, &|_| ());
        let deform = || -> Result<(DeformedScene, Bending), StepFailure> {
            let state = layer.deformation(case, step.index, step.load, options.prune)?;
            let deformed = scene_of(case, state.as_ref(), &step.pose)?;
            let bending = Bending::found(case, &deformed, state.as_ref(), step.pose.distance);
            Ok((deformed, bending))
        };
        // Timed the second time: the first call loads the program from the disk.
        deform().map_err(failed)?;
        let start = Instant::now();
        let (deformed, bending) = deform().map_err(failed)?;
        let seconds = start.elapsed().as_secs_f64();
        let taken = route(Bodies::of(&deformed.scene), bending, asked(case));
        by_boxes(taken.map_err(|error| failed(error.into()))?)?;
        let plates = deformed.pair.map(|pair| (pair.parallel_plate, seconds));
        let quantity = match case.measurement() {
            Measurement::Matrix { .. } => Quantity::FirstEntry,
            measurement => Quantity::Measured(measurement),
        };
        Ok(Self { settings, deformed, quantity, plates })
    }

    fn settings(&self, tolerance: f64, bounds: bool, resolution: Option<ResolutionLevel>) -> Settings {
        Settings { relative_tolerance: tolerance, bounds, resolution, ..self.settings.clone() }
    }

    /// The expected seconds on a grid or with the solver's choice; `None` if the solve does not fit into
    /// memory or is impossible, for which the solve gives the reason.
    pub(super) fn expected_seconds(
        &self,
        level: Option<ResolutionLevel>,
        tolerance: f64,
        bounds: bool,
    ) -> Option<f64> {
        let settings = self.settings(tolerance, bounds, level);
        let found = forecast(&self.deformed.scene, &settings, &mut Effort::default()).ok()?;
        (found.memory_bytes <= settings.memory_limit).then_some(found.seconds)
    }

    /// Solves to a tolerance on a given grid, or with the solver's choice.
    pub(super) fn solve(
        &self,
        level: Option<ResolutionLevel>,
        tolerance: f64,
        bounds: bool,
    ) -> Result<Measured, Stop> {
        let settings = self.settings(tolerance, bounds, level);
        let start = Instant::now();
        let solution = solve(&self.deformed.scene, &settings)?;
        let seconds = start.elapsed().as_secs_f64();
        let value = match self.quantity {
            Quantity::Measured(measurement) => shown(measurement, &solution),
            Quantity::FirstEntry => solution.maxwell.first().and_then(|row| row.first()).copied(),
        };
        let value = value.filter(|c| c.value != 0.0).ok_or(StepFailure::ZeroCapacitance)?;
        if !(value.lower <= value.value && value.value <= value.upper) {
            return Err(StepFailure::BoundsExcludeValue.into());
        }
        let reported_error = reported_error_of(&solution, &settings);
        Ok(Measured {
            seconds,
            value,
            reported_error,
            level: solution.resolution.grid(),
            unknowns: solution.unknowns,
        })
    }
}

/// The error that the solver compares with the tolerance, for one capacitance: the spread, or the estimate.
fn reported_error(c: &Bounded, bounds: bool) -> f64 {
    if bounds { 2.0 * c.relative_error() } else { c.relative_error() }
}

/// The error that the solver compares with the tolerance: see [`Target`](elastocap_electrostatics::Target).
fn reported_error_of(solution: &Solution, settings: &Settings) -> f64 {
    if let Some(capacitance) = &solution.measured {
        return reported_error(capacitance, settings.bounds);
    }
    let pair = solution.two_terminal.as_ref().map(|c| reported_error(c, settings.bounds));
    let maxwell = &solution.maxwell;
    let absolute_error =
        |i: usize| reported_error(&maxwell[i][i], settings.bounds) * maxwell[i][i].value.abs();
    let entries = (0..maxwell.len()).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| {
        if i == j {
            return reported_error(&maxwell[i][i], settings.bounds);
        }
        let least = 0.1 * (maxwell[i][i].upper * maxwell[j][j].upper).sqrt();
        (absolute_error(i) * absolute_error(j)).sqrt() / maxwell[i][j].value.abs().max(least)
    });
    entries.chain(pair).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Two plates of unlike size: every entry of the matrix counts.
    const PLATES: &str = r#"
        format = 1
        title = "plates"
        [[conductor]]
        name = "a"
        sheet = { normal = "x2", at = "0 m", min = ["-1 m", "-1 m"], max = ["1 m", "1 m"] }
        [[conductor]]
        name = "b"
        box = { min = ["-0.5 m", "0.4 m", "-0.5 m"], max = ["0.5 m", "0.6 m", "0.5 m"] }
        [surroundings]
        boundary = "open"
    "#;

    #[test]
    fn what_is_compared_with_the_tolerance_is_what_the_solver_compares() {
        let case = elastocap_case::parse(PLATES, Path::new("plates.toml")).unwrap();
        let plan = Plan::new(&case, &Options::default());
        let subject = Subject::new(&case, &plan, &plan.steps[0], &Arc::new(AtomicBool::new(false))).unwrap();
        for bounds in [true, false] {
            let level = Some(ResolutionLevel { order: 3, levels: 1 });
            let settings = subject.settings(1e-4, bounds, level);
            let solution = solve(&subject.deformed.scene, &settings).unwrap();
            // The message of the solver has the number that it compared, to two digits.
            let message = solution.shortfall.as_ref().unwrap().to_string();
            let reported_error = reported_error_of(&solution, &settings);
            assert!(message.contains(&format!("{reported_error:.1e}")), "{reported_error:e}: {message}");
        }
    }
}

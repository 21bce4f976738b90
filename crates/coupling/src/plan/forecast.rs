//! The forecast of a plan for outlines and tetrahedra. It needs a mesh of the scene, and is computed on
//! request.

use elastocap_case::{Case, FieldSolver};
use elastocap_electrostatics::forecast_extruded;

use super::electrostatics::PROGRAM;
use super::electrostatics::is_on_tetrahedra;
use super::{Options, Plan};
use crate::failure::StepFailure;
use crate::memory::max_memory;
use crate::route::{Bending, Bodies, Route, asked, route};
use crate::tetrahedra::forecast;
use crate::words::seconds;
use elastocap_linalg::memory::bytes_in_words;

/// The largest observed ratio of the number of unknowns for bent electrodes to that for straight ones. The
/// first mesh that follows bent electrodes has 40 to 170 thousand already, hence the minima below. Measured:
/// `benches/forecast.py`.
const BENT: f64 = 2.5;
/// The largest observed ratio of the number of unknowns for outlines of bent electrodes to that of straight
/// ones: the meshes in the plane follow every bend. Measured: `benches/forecast.py`.
const BENT_OUTLINES: f64 = 6.0;
/// Memory of a solve of outlines beyond the counted part, mostly freed memory that the allocator keeps,
/// bytes. Measured: `benches/forecast.py`.
const OF_OUTLINES: u64 = 20 << 20;
const MIN_UNKNOWNS: usize = 120_000;
const MIN_BYTES: u64 = 300_000_000;
const MIN_SECONDS: f64 = 0.8;

/// The forecast time above which a run is warned of, s: half a day.
const LONG: f64 = 12.0 * 3600.0;

impl Plan {
    /// Forecasts the cost of the solvers for outlines and for tetrahedra, which [`Plan::new`] does not: the
    /// scene is meshed, and solved on a small mesh. The plan holds the forecast of the box solver already.
    /// Electrodes that the load may bend are counted as at rest, with factors for their bending. A step whose
    /// scene has no mesh or no solution gets the error as its failure. Memory and time beyond this machine
    /// are added to the warnings.
    pub fn forecast(&mut self, case: &Case, options: &Options) {
        self.forecast_tetrahedra(case, options);
        self.warn_of_cost();
    }

    fn forecast_tetrahedra(&mut self, case: &Case, options: &Options) {
        self.forecast_outlines(case, options);
        let Some((index, scene)) = self.first_scene(case, options, is_on_tetrahedra) else {
            return;
        };
        let solves = self.count(is_on_tetrahedra) as f64;
        // At rest the bodies are boxes for the box solver: it is the load that sends them to the tetrahedra.
        let bends = route(Bodies::of(&scene), Bending::Straight, asked(case)) == Ok(Route::BOXES);
        let at_rest = match forecast(&scene, case.mesh.as_ref(), &self.solver_settings(case, options)) {
            Ok(at_rest) => at_rest,
            // The layer bent may have a mesh where the one at rest has none.
            Err(_) if bends => return,
            Err(error) => return self.fails(index, &error.into()),
        };
        self.is_rough |= at_rest.is_rough;
        if bends {
            self.unknowns = ((BENT * at_rest.unknowns as f64) as usize).max(MIN_UNKNOWNS);
            self.memory_bytes = ((BENT * at_rest.memory_bytes as f64) as u64).max(MIN_BYTES);
            self.seconds += (BENT * at_rest.seconds).max(MIN_SECONDS) * solves;
            return;
        }
        self.unknowns = at_rest.unknowns;
        self.memory_bytes = at_rest.memory_bytes;
        self.seconds = at_rest.seconds * solves;
        self.mirrored = at_rest.mirrored;
    }

    /// Forecasts the cost of the solver for outlines by solving its first meshes. Bent electrodes are counted
    /// as at rest, with factors for their bending.
    fn forecast_outlines(&mut self, case: &Case, options: &Options) {
        let is_extruded = |route: Route| route.solver() == FieldSolver::Extruded;
        let Some((_, scene)) = self.first_scene(case, options, is_extruded) else { return };
        let solves = self.count(is_extruded) as f64;
        // Scenes on which it fails go to tetrahedra, whose cost is not known here.
        let Ok(at_rest) = forecast_extruded(&scene, &self.solver_settings(case, options).boxes()) else {
            return;
        };
        self.is_rough |= at_rest.is_rough;
        let bends = self.count(|route| route == Route::EXTRUDED) == 0;
        let [larger, longer] = if bends { [BENT_OUTLINES, BENT] } else { [1.0, 1.0] };
        self.unknowns = self.unknowns.max((larger * at_rest.unknowns as f64) as usize);
        let memory = (larger * at_rest.memory_bytes as f64) as u64;
        self.memory_bytes = self.memory_bytes.max(memory.saturating_add(PROGRAM + OF_OUTLINES));
        self.seconds += longer * at_rest.seconds * solves;
        self.mirrored = at_rest.mirrored;
    }

    /// Marks a step as failing, and the steps that take its result over.
    fn fails(&mut self, index: usize, failure: &StepFailure) {
        for step in self.steps.iter_mut().filter(|step| step.index == index || step.same_as == Some(index)) {
            (step.route, step.failure) = (None, Some(failure.clone()));
        }
    }

    /// Marks all steps on such routes as failing.
    pub(super) fn fail(&mut self, on: impl Fn(Route) -> bool, failure: &StepFailure) {
        for step in self.steps.iter_mut().filter(|step| step.route.is_some_and(&on)) {
            (step.route, step.failure) = (None, Some(failure.clone()));
        }
    }

    /// Warns where the forecast is rough, and where memory or time exceed the limits.
    fn warn_of_cost(&mut self) {
        if self.is_rough {
            self.warnings.push(
                "unknowns, memory and time of the fields are rough counts: finer ones would take longer than a plan may".to_owned(),
            );
        }
        let layer = self.layer.as_ref();
        let memory = self.memory_bytes.max(layer.map_or(0, |layer| layer.memory_bytes));
        let free = max_memory();
        if memory > free {
            self.warnings.push(format!(
                "the run may take {} of memory, and {} is free: what does not fit is not refined further, or fails",
                bytes_in_words(memory),
                bytes_in_words(free)
            ));
        }
        let expected = self.seconds + layer.map_or(0.0, |layer| layer.seconds);
        if expected > LONG {
            self.warnings.push(format!(
                "the run is expected to take {}; a larger `relative_tolerance`, fewer steps or fewer bodies shorten it",
                seconds(expected)
            ));
        }
    }
}

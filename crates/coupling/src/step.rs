//! One load step: the layer deforms, the electrodes move, the field is solved.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use elastocap_electrostatics::{Bounded, Field, FloatingPotential, Settings, Solution, SolveError, solve};
use elastocap_geometry::export::body::BodyMesh;
use elastocap_mechanics::ForceLimit;

use crate::deform::{Deformation, Prepared};
use crate::layer_outlines::{LayerScene, bent_scene, is_flat};
use crate::outcome::{FloatingConductor, Row, SolverReport, Status, StepResult};
use crate::plan::{PlannedStep, StepLoad};
use elastocap_case::{Case, FieldSolver};
use elastocap_geometry::scene::Scene;

use crate::scene::{DeformedScene, Enclosing, scene_of};
use crate::terminals::pair_among;
use crate::tetrahedra::{Solved, shown, solve_shapes};
use crate::view::window;

/// The field of a step, on whatever it was solved.
#[derive(Debug)]
pub enum StepField {
    /// Samples on the grid of the box solver.
    Grid(Field),
    /// The potential on tetrahedra.
    Tetrahedra(BodyMesh),
}

/// What a scene is for the solvers.
enum Fields {
    /// Solved as boxes.
    Boxes(Box<(Solution, Option<Bounded>)>),
    /// Yet to be solved as shapes.
    Shapes(LayerScene),
}

/// What the solver for any shape is given.
struct Shaped<'a> {
    scene: &'a Scene,
    /// Rows of the Maxwell matrix of the pair whose capacitance it is, where there are other conductors.
    pair: Option<[usize; 2]>,
    /// Relative error of the capacitance for flat faces that the scene has already.
    facets: f64,
}

/// What all steps of a run have in common.
pub(crate) struct Solver<'a> {
    pub(crate) case: &'a Case,
    pub(crate) settings: Settings,
    pub(crate) prune: bool,
    pub(crate) force_limit: Option<ForceLimit>,
    pub(crate) layer: &'a Prepared,
}

impl Solver<'_> {
    /// Solves one step. Whatever goes wrong is in the result's status; what was known before is kept.
    pub(crate) fn solve(&self, step: &PlannedStep) -> (StepResult, Option<StepField>) {
        let start = Instant::now();
        let mut result = StepResult::not_run(step);
        let mut field = None;
        // A defect in one step must not take the others with it.
        let outcome = catch_unwind(AssertUnwindSafe(|| self.run(step, &mut result, &mut field)));
        match outcome {
            Ok(Ok(())) => {}
            Ok(Err(Stop::Cancelled)) => result = StepResult::not_run(step),
            Ok(Err(Stop::Failed(reason))) => result.fail(reason),
            Err(defect) => {
                let said = defect.downcast_ref::<String>().map(String::as_str);
                let said = said.or_else(|| defect.downcast_ref::<&str>().copied()).unwrap_or("no message");
                result.fail(format!("a defect of elastocap, please report it with the case file: {said}"));
            }
        }
        result.seconds.total = start.elapsed().as_secs_f64();
        (result, field)
    }

    fn run(
        &self,
        step: &PlannedStep,
        result: &mut StepResult,
        field: &mut Option<StepField>,
    ) -> Result<(), Stop> {
        if self.case.layer.is_none() && !self.case.has_only_boxes() {
            let scene = scene_of(self.case, None)?.scene;
            let shaped = Shaped { scene: &scene, pair: None, facets: 0.0 };
            return self.solve_shaped(shaped, result, field, (None, None));
        }
        let start = Instant::now();
        let state = self.layer.deformation(self.case, step, self.prune).map_err(Stop::Failed)?;
        let beyond = self.note_mechanics(result, state.as_ref());
        let layer_missed = layer_missed(state.as_ref());
        if !self.case.has_conductors() {
            if let Some(Deformation::FiniteElement(layer)) = &state {
                // What the row is about is the force, so that its error is the one to tell.
                result.row.relative_error_estimate = layer.relative_error_estimate;
            }
            result.mark(layer_missed.is_none(), layer_missed, beyond);
            result.seconds.mechanics = start.elapsed().as_secs_f64();
            return Ok(());
        }
        let deformed = scene_of(self.case, state.as_ref())?;
        if let Some(pair) = &deformed.pair {
            result.row.gap_m = Some(pair.gap);
            result.row.electrode_height_m = Some(pair.height);
            result.row.electrode_thickness_m = Some(pair.thickness);
            result.row.parallel_plate_f = Some(pair.parallel_plate);
        }
        let deformed = result.scene.insert(deformed);
        result.seconds.mechanics = start.elapsed().as_secs_f64();

        let (mut solution, two_terminal) = match self.shaped(deformed, state.as_ref())? {
            Fields::Boxes(found) => *found,
            Fields::Shapes(layer) => {
                let window = window(&[&*deformed]);
                let pair = deformed.pair_among_others();
                let shaped = Shaped { scene: &layer.scene, pair, facets: layer.facets };
                self.solve_shaped(shaped, result, field, (layer_missed, beyond))?;
                // The mesh of what is flat-faced shows no more, and is a thousand times larger.
                result.surfaces = match result.surfaces.as_slice() {
                    [] => Vec::new(),
                    meshed => layer.surfaces(&window, meshed),
                };
                return Ok(());
            }
        };
        *field = solution.field.take().map(StepField::Grid);
        result.floating = floating_of(&deformed.scene, std::mem::take(&mut solution.floating));
        note_solution(result, solution, two_terminal, layer_missed, beyond)
    }

    /// Which solver takes the scene: the one for boxes, with its solution, or the one for any shape.
    fn shaped(&self, deformed: &DeformedScene, state: Option<&Deformation<'_>>) -> Result<Fields, Stop> {
        let solver = self.case.electrostatics.and_then(|e| e.solver);
        let shapes = !self.case.has_only_boxes() || solver == Some(FieldSolver::Tetrahedra);
        let bent = match (&deformed.bent, state) {
            (None, _) if shapes => return Ok(Fields::Shapes(LayerScene::of_boxes(deformed))),
            (None, _) => return Ok(Fields::Boxes(Box::new(field_of(deformed, &self.settings)?))),
            (Some(bent), Some(Deformation::FiniteElement(layer))) => (bent, &layer.curves),
            // Only finite elements bend anything.
            (Some(Err(error)), _) => return Err(error.clone().into()),
            (Some(Ok(enclosing)), _) => {
                return Ok(Fields::Boxes(Box::new(between(deformed, *enclosing, &self.settings)?)));
            }
        };
        let (enclosing, curves) = bent;
        let in_space = curves.electrodes.is_empty();
        if in_space && shapes {
            return Err(Stop::Failed(
                "electrodes that the load bends in three dimensions are known to the solver for boxes only: leave out \
                 `solver` in [electrostatics], and bodies that are no boxes"
                    .to_owned(),
            ));
        }
        if in_space || solver == Some(FieldSolver::Boxes) {
            return Ok(Fields::Boxes(Box::new(between(deformed, enclosing.clone()?, &self.settings)?)));
        }
        // Boxes inside and around are solved in no time, and may do where nothing else is bent.
        if let Ok(enclosing) = enclosing
            && !shapes
            && is_flat(curves)
            && deformed.scene.conductors().count() == 2
        {
            let found = between(deformed, *enclosing, &self.settings)?;
            if found.0.reached {
                return Ok(Fields::Boxes(Box::new(found)));
            }
        }
        let layer = bent_scene(deformed, curves, self.settings.relative_tolerance).map_err(Stop::Failed)?;
        Ok(Fields::Shapes(layer))
    }

    /// A scene of any shapes. `mechanics` has what there is to say of the layer: why its accuracy was missed, and why there is
    /// no force.
    fn solve_shaped(
        &self,
        Shaped { scene, pair, facets: polygons }: Shaped<'_>,
        result: &mut StepResult,
        field: &mut Option<StepField>,
        mechanics: (Option<String>, Option<String>),
    ) -> Result<(), Stop> {
        let solved = solve_shapes(scene, self.case.mesh.as_ref(), &self.settings)?;
        if self.settings.field {
            *field = Some(StepField::Tetrahedra(shown(scene, &solved)));
        }
        let Solved { mut general, facets, surfaces, .. } = solved;
        if !scene.is_boxes() {
            result.surfaces = surfaces;
        }
        let facets = facets + polygons;
        if facets > 0.0 {
            result.warnings.push(format!(
                "curved surfaces are solved with flat faces, which adds a relative error of about {facets:.0e} (an estimate) to \
                 the capacitances: their bounds are those of the flat-faced bodies"
            ));
        }
        result.floating = floating_of(scene, std::mem::take(&mut general.solution.floating));
        let mut solution = general.solution;
        let two_terminal = pair.map_or(solution.two_terminal, |pair| pair_among(&solution.maxwell, pair));
        if let Some(found) = two_terminal.filter(|_| pair.is_some())
            && 2.0 * found.relative_error() > self.settings.relative_tolerance
        {
            solution.reached = false;
            solution.shortfall.get_or_insert_with(|| MATRIX_ONLY.to_owned());
        }
        note_solution(result, solution, two_terminal, mechanics.0, mechanics.1)
    }

    /// Notes what the mechanics say; returns why there is no force, if there is none.
    fn note_mechanics(&self, result: &mut StepResult, state: Option<&Deformation<'_>>) -> Option<String> {
        let row = &mut result.row;
        let Some(state) = state else {
            // Nothing presses: the layer is as it was.
            if self.case.layer.is_some() {
                (row.compression, row.force_n, row.top_displacement_m) = (Some(0.0), Some(0.0), Some(0.0));
            }
            return None;
        };
        row.compression = Some(state.compression());
        row.top_displacement_m = Some(state.top_displacement());
        if let Deformation::FiniteElement(step) = state {
            result.layer = Some((*step).clone());
        }
        if let (StepLoad::Compression(compression), Some(limit)) = (result.load, self.force_limit)
            && compression > limit.compression
        {
            return Some(format!(
                "the force of eq. (50) has its maximum of {:.4e} N at U/H = {:.4}; beyond it the formula means nothing \
                 and no force is given; the deformation and the capacitance are not affected",
                limit.force, limit.compression
            ));
        }
        row.force_n = Some(state.force());
        None
    }
}

fn floating_of(scene: &Scene, potentials: Vec<FloatingPotential>) -> Vec<FloatingConductor> {
    let named = potentials.into_iter().filter_map(|potential| {
        let conductor = scene.conductors().nth(potential.conductor)?;
        Some(FloatingConductor {
            name: conductor.body.name.clone(),
            charge: conductor.floating_charge?,
            per_volt: potential.per_driven,
            from_charges: potential.from_charges,
        })
    });
    named.collect()
}

/// Notes what was found of the field.
fn note_solution(
    result: &mut StepResult,
    solution: Solution,
    two_terminal: Option<Bounded>,
    layer_missed: Option<String>,
    beyond: Option<String>,
) -> Result<(), Stop> {
    let all = solution.maxwell.iter().flatten().chain(&two_terminal);
    if all.into_iter().any(|c| !(c.lower <= c.value && c.value <= c.upper)) {
        return Err(Stop::Failed("the solver's bounds do not enclose its value".to_owned()));
    }
    if let Some(capacitance) = &two_terminal {
        result.row.set_capacitance(capacitance);
    }
    result.row.unknowns = Some(solution.unknowns);
    let reached = solution.reached && layer_missed.is_none();
    let shortfall: Vec<String> = solution.shortfall.into_iter().chain(layer_missed).collect();
    result.mark(reached, (!shortfall.is_empty()).then(|| shortfall.join("; ")), beyond);
    result.two_terminal = two_terminal;
    result.maxwell = Some(solution.maxwell);
    result.seconds.electrostatics = solution.seconds;
    result.solver = Some(SolverReport {
        iterations: solution.iterations,
        grids: solution.grids,
        resolution: solution.resolution,
        mirrored: solution.mirrored,
        repair_share: solution.repair_share,
    });
    Ok(())
}

/// What is said of a pair among other conductors.
const MATRIX_ONLY: &str = "the pair's capacitance is known less well than the Maxwell matrix it comes from";

/// The solution, and the two-terminal capacitance.
pub fn field_of(deformed: &DeformedScene, asked_for: &Settings) -> Result<(Solution, Option<Bounded>), Stop> {
    let mut settings = asked_for.clone();
    let mut tries = 3;
    loop {
        let mut solution = solve(&deformed.scene, &settings)?;
        let Some(pair) = deformed.pair_among_others() else {
            let two_terminal = solution.two_terminal;
            return Ok((solution, two_terminal));
        };
        // The solver's tolerance is that of the matrix; what is asked for is that of the pair.
        let pair = pair_among(&solution.maxwell, pair);
        let error = pair.map_or(0.0, |pair| 2.0 * pair.relative_error());
        let asked = asked_for.relative_tolerance;
        let allowed = if settings.bounds { asked } else { 2.0 * asked };
        tries -= 1;
        if error <= allowed || tries == 0 || !solution.reached {
            if error <= allowed {
                (solution.reached, solution.shortfall) = (true, None);
            } else {
                solution.reached = false;
                solution.shortfall.get_or_insert_with(|| MATRIX_ONLY.to_owned());
            }
            return Ok((solution, pair));
        }
        settings.relative_tolerance *= 0.7 * allowed / error;
    }
}

/// The capacitance of electrodes that are no boxes, from boxes inside them (which have less) and boxes around them (which
/// have more): see [`crate::deform::ElectrodeBox`]. The field and the counts are those of the boxes around.
fn between(
    deformed: &DeformedScene,
    enclosing: Enclosing,
    settings: &Settings,
) -> Result<(Solution, Option<Bounded>), Stop> {
    if deformed.scene.conductors().count() > 2 {
        return Err(Stop::Failed(
            "the electrodes are bent by the load, and beside other conductors the solver for boxes has no bounds for that"
                .to_owned(),
        ));
    }
    // What the shape leaves open comes on top of what the solver does.
    let each = Settings { relative_tolerance: 0.5 * settings.relative_tolerance, ..settings.clone() };
    let of = |regions, settings: &Settings| {
        let scene = deformed.with_pair(regions);
        field_of(&DeformedScene { scene, bent: None, ..deformed.clone() }, settings)
    };
    let (less, low) = of(enclosing.inside, &Settings { field: false, ..each.clone() })?;
    let (mut solution, high) = of(enclosing.around, &each)?;
    let join = |low: &Bounded, high: &Bounded| Bounded {
        value: 0.5 * (low.value + high.value),
        lower: low.lower.min(high.lower),
        upper: high.upper.max(low.upper),
    };
    let two_terminal = low.zip(high).map(|(low, high)| join(&low, &high));
    for (row, other) in solution.maxwell.iter_mut().zip(&less.maxwell) {
        for (entry, other) in row.iter_mut().zip(other) {
            *entry = join(other, entry);
        }
    }
    solution.seconds = less.seconds.plus(&solution.seconds);
    let error = two_terminal.map_or(0.0, |c| 2.0 * c.relative_error());
    let allowed =
        if settings.bounds { settings.relative_tolerance } else { 2.0 * settings.relative_tolerance };
    solution.reached = error <= allowed;
    solution.shortfall = (!solution.reached).then(|| {
        "the electrodes are bent and tilted, and the solver takes boxes: the bounds are those of boxes inside and around them"
            .to_owned()
    });
    Ok((solution, two_terminal))
}

/// Why the finite elements of the layer do not have the accuracy asked for, if they do not.
fn layer_missed(state: Option<&Deformation<'_>>) -> Option<String> {
    let Some(Deformation::FiniteElement(step)) = state else { return None };
    if step.negative_pivots > 0 {
        return Some(format!(
            "the equilibrium of the layer is unstable (its tangent has {} negative pivots)",
            step.negative_pivots
        ));
    }
    if step.converged {
        return None;
    }
    Some(match step.relative_error_estimate {
        Some(error) => format!("the finest mesh of the layer leaves a relative error of {error:.1e}"),
        None => {
            "less than three meshes of the layer got to this load, so that its error is not known".to_owned()
        }
    })
}

/// Why a step ended early.
#[derive(Debug)]
pub enum Stop {
    /// Asked to stop.
    Cancelled,
    /// It cannot be solved, for this reason.
    Failed(String),
}

impl From<SolveError> for Stop {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Cancelled => Self::Cancelled,
            error => Self::Failed(error.to_string()),
        }
    }
}

impl From<crate::scene::SceneError> for Stop {
    fn from(error: crate::scene::SceneError) -> Self {
        Self::Failed(error.to_string())
    }
}

impl StepResult {
    /// A step of which only the load is known.
    pub(crate) fn not_run(step: &PlannedStep) -> Self {
        let mut row = Row::default();
        match step.load {
            StepLoad::None => {}
            StepLoad::Compression(compression) => row.compression = Some(compression),
            StepLoad::ForceN(force) => row.force_n = Some(force),
        }
        Self {
            index: step.index,
            load: step.load,
            same_as: step.same_as,
            row,
            reason: None,
            warnings: Vec::new(),
            layer: None,
            scene: None,
            surfaces: Vec::new(),
            maxwell: None,
            floating: Vec::new(),
            two_terminal: None,
            solver: None,
            seconds: Default::default(),
        }
    }

    /// How a step went that was carried to its end.
    fn mark(&mut self, reached: bool, shortfall: Option<String>, no_force: Option<String>) {
        self.row.status = match (reached, &no_force) {
            (false, _) => Status::ToleranceNotReached,
            (true, Some(_)) => Status::BeyondForceLimit,
            (true, None) => Status::Ok,
        };
        let reasons: Vec<_> = shortfall.into_iter().chain(no_force).collect();
        self.reason = (!reasons.is_empty()).then(|| reasons.join("; "));
    }

    fn fail(&mut self, reason: String) {
        self.row.status = Status::Failed(reason.clone());
        self.reason = Some(reason);
    }
}

//! One load step: the layer deforms, the electrodes move, the field is solved.

mod fields;
mod notes;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use elastocap_case::{Case, FieldSolver, Measurement, Pose};
use elastocap_electrostatics::{Bounded, Field, Foresight, SolveError, Target};
use elastocap_geometry::export::body::BodyMesh;
use elastocap_geometry::scene::Scene;
use elastocap_mechanics::ForceLimit;

use crate::common_base::{CommonBase, Known, Purposes};
use crate::deform::{DeformError, Deformation, Prepared};
use crate::failure::{StepFailure, Stop, panic_message};
use crate::finished::FinishedStep;
use crate::layer_outlines::{LayerScene, Sides};
use crate::outcome::{EntryStatus, Row, StepResult};
use crate::plan::PlannedStep;
use crate::reason::Reason;
use crate::route::{Bending, Bodies, Route, RouteError, asked, route};
use crate::route_change::{NoBase, RouteChange};
use crate::scene::{DeformedScene, SceneError, scene_of};
use crate::settings::FieldSettings;
use crate::tetrahedra::solve_shapes;
use crate::view::window;
use fields::Fields;
use notes::{Shortfalls, floating_of, layer_missed};

/// The field of a step, on whatever it was solved.
#[derive(Debug, Clone)]
pub enum StepField {
    /// Samples on the grid of the box solver.
    Grid(Field),
    /// The potential on tetrahedra.
    Tetrahedra(BodyMesh),
}

/// The scene that the solvers for other shapes than boxes are given.
struct Shaped<'a> {
    scene: &'a Scene,
    /// Relative error of the capacitance for flat faces that the scene has already, or for its curves.
    facets: f64,
    /// Whether outlines have curves in it.
    is_curved: bool,
    /// See [`LayerScene::ends`].
    ends: f64,
    /// See [`LayerScene::under_wall`].
    under_wall: f64,
}

impl<'a> From<&'a LayerScene> for Shaped<'a> {
    fn from(layer: &'a LayerScene) -> Self {
        let LayerScene { scene, facets, is_curved, ends, under_wall } = layer;
        Self { scene, facets: *facets, is_curved: *is_curved, ends: *ends, under_wall: *under_wall }
    }
}

/// Spread of the bounds of a draft, over the value. It is not tuned.
const DRAFT: f64 = 0.1;

/// The spread at which a solve to another tolerance may stop, over that tolerance. A change is known with it
/// all the same: the shares of its two states leave that much.
pub(crate) const ACCEPTED: f64 = 1.08;

/// How a step is to be solved again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sharper {
    pub(crate) relative_tolerance: f64,
    /// Bytes.
    pub(crate) memory_limit: u64,
    /// Findings of the solve before.
    pub(crate) foresight: Option<Foresight>,
}

/// The parts that all steps of a run have in common.
pub(crate) struct Solver<'a> {
    pub(crate) case: &'a Case,
    pub(crate) settings: FieldSettings,
    pub(crate) prune: bool,
    pub(crate) force_limit: Option<ForceLimit>,
    pub(crate) layer: &'a Prepared,
    /// By how many meshes the layer is coarser than the finest that reached a load: none, but where errors of
    /// the layer are looked for.
    pub(crate) coarser: usize,
    /// The solution that the fields of steps under a map are added to where that is possible.
    pub(crate) base: Option<&'a CommonBase>,
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
            Ok(Err(Stop::Cancelled)) => result = self.not_run(step),
            Ok(Err(Stop::Failed(failure))) => result.fail(*failure),
            Err(defect) => result.fail(StepFailure::Defect(panic_message(&*defect).to_owned())),
        }
        result.seconds.total = start.elapsed().as_secs_f64();
        (result, field)
    }

    /// Solves the field of a step to another tolerance for what the curve shows alone: of the whole matrix
    /// for the entry that it shows.
    pub(crate) fn solve_to(
        &self,
        step: &PlannedStep,
        sharper: Sharper,
        base: Option<&CommonBase>,
    ) -> StepResult {
        let asked = &self.settings;
        let Sharper { relative_tolerance, memory_limit, foresight } = sharper;
        let settings = self.settings_to(relative_tolerance, memory_limit);
        // What was found of the whole matrix says little of one entry.
        let foresight = foresight.filter(|_| settings.target == asked.target);
        let settings = FieldSettings { foresight, ..settings };
        let again = Solver { settings, base, ..*self };
        let mut result = again.solve(step).0;
        // The entries are compared with what the case asks of them.
        let allowed = (asked.boxes().allowed_spread(), asked.least_scale);
        result.entry_status = result.maxwell.as_ref().map(|all| EntryStatus::of(all, allowed, asked.target));
        result
    }

    fn settings_to(&self, relative_tolerance: f64, memory_limit: u64) -> FieldSettings {
        let asked = &self.settings;
        let target = match (self.case.measurement(), asked.target) {
            (Measurement::Matrix { shown: [i, j], .. }, Target::Matrix) if i == j => Target::Own(i),
            (Measurement::Matrix { shown, .. }, Target::Matrix) => Target::Mutual(shown),
            (_, target) => target,
        };
        FieldSettings {
            relative_tolerance,
            accepted: ACCEPTED,
            target,
            target_alone: true,
            memory_limit,
            field: false,
            ..asked.clone()
        }
    }

    /// The settings of a draft: bounds that are near enough for a first look, and no field for a file.
    pub(crate) fn settings_of_draft(&self) -> FieldSettings {
        let relative_tolerance = self.settings.relative_tolerance.max(DRAFT);
        FieldSettings {
            field: false,
            shared: None,
            ..self.settings_to(relative_tolerance, self.settings.memory_limit)
        }
    }

    /// The base that the fields of steps like this one are added to, for solves to a tolerance within so much
    /// memory (bytes). The steps are known to have these `capacitances`, F. `None` where nothing is meant to
    /// be added.
    ///
    /// # Errors
    /// Why there is no base where one is meant.
    pub(crate) fn common_base(
        &self,
        step: &PlannedStep,
        relative_tolerance: f64,
        memory_limit: u64,
        capacitances: &[Bounded],
        purposes: Purposes,
    ) -> Result<Option<CommonBase>, NoBase> {
        // In contact the gap beside an indenter is squeezed so much that a base does not serve.
        if step.pose.distance <= 0.0 {
            return Ok(None);
        }
        // Where there is no layer, scene, route or map, the step itself has said so.
        let Ok(state) = self.deformation(step) else { return Ok(None) };
        let Ok(deformed) = scene_of(self.case, state.as_ref(), &step.pose) else { return Ok(None) };
        let bending = Bending::found(self.case, &deformed, state.as_ref(), step.pose.distance);
        let taken = route(Bodies::of(&deformed.scene), bending, asked(self.case));
        let Some(bent) =
            self.first_bent(step, &deformed, state.as_ref()).filter(|_| taken == Ok(Route::MAPPED_BOXES))
        else {
            return Ok(None);
        };
        let farthest = self.case.poses.iter().map(|pose| pose.distance).fold(0.0, f64::max);
        let reach = bent.reach() + farthest - step.pose.distance;
        let known = Known { capacitances, relative_tolerance: self.settings.relative_tolerance };
        let distances = self.case.poses.iter().map(|pose| pose.distance).filter(|distance| *distance > 0.0);
        let nearest = distances.fold(step.pose.distance, f64::min);
        let nearer = purposes.differences.then_some(step.pose.distance - nearest);
        CommonBase::of(
            &bent,
            (reach, nearer),
            known,
            purposes.number,
            &self.settings_to(relative_tolerance, memory_limit).boxes(),
        )
    }

    /// The layer under the load of a step.
    fn deformation(&self, step: &PlannedStep) -> Result<Option<Deformation<'_>>, DeformError> {
        let finest = self.layer.deformation(self.case, step.index, step.load, self.prune)?;
        let coarser = self.layer.coarser(step.index);
        match (finest, self.coarser) {
            (Some(Deformation::FiniteElement(_)), back @ 1..) => {
                let own = coarser.len().checked_sub(back).and_then(|mesh| coarser.get(mesh));
                own.map(|own| Some(Deformation::FiniteElement(own))).ok_or(DeformError::NotSolved)
            }
            (finest, _) => Ok(finest),
        }
    }

    /// A step that the run was stopped before, with what is known of the layer.
    pub(crate) fn not_run(&self, step: &PlannedStep) -> StepResult {
        let mut result = StepResult::not_run(step);
        let Ok(state) = self.deformation(step) else { return result };
        let missed = layer_missed(state.as_ref());
        if !self.case.has_conductors() && missed.is_none() {
            // There is nothing else to solve.
            return self.solve(step).0;
        }
        result.reason = missed.map(Reason::from);
        self.note_mechanics(&mut result, state.as_ref(), &step.pose);
        if let (Some(Deformation::FiniteElement(layer)), false) = (&state, self.case.has_conductors()) {
            result.row.relative_error_estimate = layer.relative_error_estimate;
        }
        result
    }

    fn run(
        &self,
        step: &PlannedStep,
        result: &mut StepResult,
        field: &mut Option<StepField>,
    ) -> Result<(), Stop> {
        if self.case.layer.is_none() && !self.case.has_only_boxes() {
            let deformed = scene_of(self.case, None, &Pose::default())?;
            if !deformed.scene.is_boxes() {
                return self.without_layer(step, deformed, result, field);
            }
        }
        let start = Instant::now();
        let state = self.deformation(step)?;
        let no_force = self.note_mechanics(result, state.as_ref(), &step.pose);
        let mut shortfalls = Shortfalls::of_force(no_force);
        if let Some(cause) = layer_missed(state.as_ref()) {
            shortfalls.add(cause);
        }
        if !self.case.has_conductors() {
            if let Some(Deformation::FiniteElement(layer)) = &state {
                // The row is about the force, so its error is reported.
                result.row.relative_error_estimate = layer.relative_error_estimate;
            }
            result.mark(shortfalls);
            result.seconds.mechanics = start.elapsed().as_secs_f64();
            return Ok(());
        }
        let deformed = self.bodies(&mut result.row, state.as_ref(), &step.pose)?;
        result.row.mechanics_error_estimate = self.mechanics_error(step, state.as_ref(), &deformed)?;
        let deformed = result.scene.insert(deformed);
        result.seconds.mechanics = start.elapsed().as_secs_f64();

        let bending = Bending::found(self.case, deformed, state.as_ref(), step.pose.distance);
        let taken = route(Bodies::of(&deformed.scene), bending, asked(self.case))?;
        result.route = Some(taken);
        let changes = &mut result.route_changes;
        let mut solution = match self.fields(taken, step, deformed, state.as_ref(), changes)? {
            Fields::Boxes(found) => *found,
            Fields::Mapped { found, deviation, beyond, surfaces } => {
                result.surfaces = surfaces;
                self.note_deviation(&mut result.row, deviation, beyond, &mut shortfalls);
                *found
            }
            Fields::Shapes(mut layer) => {
                let window = window(&[&*deformed]);
                if taken.solver() == FieldSolver::Extruded {
                    let mut found = self.extruded(&layer.scene);
                    // Curves may come too close to one another, or be bent too sharply for its triangles.
                    if let Err(error) = &found
                        && layer.is_curved
                        && *error != SolveError::Cancelled
                        && !error.is_contradiction()
                    {
                        result.route_changes.push(RouteChange::Polygons(error.clone()));
                        layer = self.outlines(deformed, state.as_ref(), Sides::Polygons)?;
                        found = self.extruded(&layer.scene);
                    }
                    if let Some(found) = self.or_tetrahedra(found, &mut result.route_changes)? {
                        result.surfaces = layer.surfaces(&window, &[]);
                        return self.note_shapes(
                            step,
                            &Shaped::from(&layer),
                            found,
                            result,
                            field,
                            shortfalls,
                        );
                    }
                }
                let shaped = Shaped::from(&layer);
                result.route = Some(taken.on_tetrahedra());
                self.solve_shaped(step, &shaped, result, field, shortfalls)?;
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
        self.note_solution(step, result, solution, shortfalls, self.settings.boxes().allowed_spread())
    }

    /// The bodies as deformed, and what they say of the pair of electrodes.
    fn bodies(
        &self,
        row: &mut Row,
        state: Option<&Deformation<'_>>,
        pose: &Pose,
    ) -> Result<DeformedScene, SceneError> {
        let deformed = scene_of(self.case, state, pose)?;
        if let Some(pair) = &deformed.pair {
            row.gap_m = Some(pair.gap);
            row.electrode_height_m = Some(pair.height);
            row.electrode_thickness_m = Some(pair.thickness);
            row.parallel_plate_f = self.case.electrodes_are_measured().then_some(pair.parallel_plate);
        }
        Ok(deformed)
    }

    /// A step as an earlier run found it, with the layer and the bodies of this one. `None` if it does not
    /// fit them.
    pub(crate) fn restored(&self, step: &PlannedStep, found: FinishedStep) -> Option<StepResult> {
        let mut result = StepResult::not_run(step);
        let state = self.deformation(step).ok()?;
        self.note_mechanics(&mut result, state.as_ref(), &step.pose);
        result.scene = Some(self.bodies(&mut result.row, state.as_ref(), &step.pose).ok()?);
        found.add_to(&mut result).then_some(result)
    }

    /// A scene of any shapes without a layer.
    fn without_layer(
        &self,
        step: &PlannedStep,
        deformed: DeformedScene,
        result: &mut StepResult,
        field: &mut Option<StepField>,
    ) -> Result<(), Stop> {
        let taken = route(Bodies::of(&deformed.scene), Bending::Straight, asked(self.case))?;
        result.route = Some(taken);
        let layer = LayerScene::of_boxes(&deformed);
        let shaped = Shaped::from(&layer);
        match taken.solver() {
            FieldSolver::Tetrahedra => {}
            FieldSolver::Extruded => {
                let found = self.extruded(shaped.scene);
                if let Some(found) = self.or_tetrahedra(found, &mut result.route_changes)? {
                    result.surfaces = layer.surfaces(&window(&[&deformed]), &[]);
                    return self.note_shapes(step, &shaped, found, result, field, Shortfalls::default());
                }
                result.route = Some(taken.on_tetrahedra());
            }
            FieldSolver::Boxes => return Err(RouteError::BoxesOnly.into()),
        }
        self.solve_shaped(step, &shaped, result, field, Shortfalls::default())
    }

    /// A scene of any shapes; `shortfalls` are those of the layer.
    fn solve_shaped(
        &self,
        step: &PlannedStep,
        shaped: &Shaped<'_>,
        result: &mut StepResult,
        field: &mut Option<StepField>,
        shortfalls: Shortfalls,
    ) -> Result<(), Stop> {
        if self.coarser > 0 {
            // The finest mesh is solved on no tetrahedra, or nobody would look at this one.
            return Err(StepFailure::NoMap.into());
        }
        let mut solved = solve_shapes(shaped.scene, self.case.mesh.as_ref(), &self.settings)?;
        if !shaped.scene.is_boxes() {
            result.surfaces = std::mem::take(&mut solved.surfaces);
        }
        self.note_shapes(step, shaped, solved, result, field, shortfalls)
    }
}

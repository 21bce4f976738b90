//! One load step: the layer deforms, the electrodes move, the field is solved.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use elastocap_case::{Case, FieldSolver, Measurement, Pose};
use elastocap_electrostatics::{
    Bounded, ExtrudedSolution, Field, FloatingPotential, MeshSolution, Solution, SolveError, Target, solve,
    solve_extruded,
};
use elastocap_geometry::export::body::BodyMesh;
use elastocap_geometry::export::surfaces::SurfaceBody;
use elastocap_geometry::scene::Scene;
use elastocap_mechanics::ForceLimit;

use crate::box_fields::{between, enclosing, mapped};
use crate::deform::shear_force::shear_force;
use crate::deform::{Deformation, FiniteElementStep, ForceCheck, Prepared};
use crate::failure::{StepFailure, Stop};
use crate::finished::FinishedStep;
use crate::layer_outlines::{LayerScene, outlined};
use crate::load_steps::StepLoad;
use crate::mapped::{BentScene, Found, bent_scene, films};
use crate::outcome::{EntryStatus, FloatingConductor, Missed, Row, SolverReport, Status, StepResult};
use crate::plan::PlannedStep;
use crate::route::{Bending, Bodies, Route, RouteError, asked, route};
use crate::scene::neutral::indenter_in_field;
use crate::scene::{DeformedScene, SceneError, scene_of};
use crate::settings::FieldSettings;
use crate::terminals::shown as shown_of;
use crate::tetrahedra::{Solved, shown, solve_shapes};
use crate::view::window;
use crate::words::FORCE_FORMULA;

/// The field of a step, on whatever it was solved.
#[derive(Debug)]
pub enum StepField {
    /// Samples on the grid of the box solver.
    Grid(Field),
    /// The potential on tetrahedra.
    Tetrahedra(BodyMesh),
}

/// A field that is solved, or the scene of one that is yet to be.
enum Fields {
    /// Solved as boxes.
    Boxes(Box<Solution>),
    /// Solved as boxes under a map.
    Mapped {
        found: Box<Solution>,
        /// The estimated relative error that the map leaves.
        deviation: f64,
        /// The bent bodies for a viewer.
        surfaces: Vec<SurfaceBody>,
    },
    /// Solved as boxes inside and around bent electrodes, for want of a map.
    Enclosed(Box<Solution>),
    /// Yet to be solved as outlines or other shapes.
    Shapes(LayerScene),
}

/// What the solvers for other shapes than boxes are given.
struct Shaped<'a> {
    scene: &'a Scene,
    /// Relative error of the capacitance for flat faces that the scene has already.
    facets: f64,
}

/// The route of a scene that the extruded solver failed on.
fn on_tetrahedra_instead(taken: Route) -> Route {
    match taken {
        Route::Extruded => Route::Tetrahedra,
        Route::Outlines => Route::OutlinesOnTetrahedra,
        other => other,
    }
}

/// What a step that was carried to its end does not have of what was asked for.
#[derive(Default)]
struct Shortfalls {
    /// Which errors are too large, and why.
    missed: Vec<(Missed, String)>,
    /// Why there is no force, if there is none.
    no_force: Option<String>,
    /// Whether entries of the matrix are known to the tolerance of the diagonal only.
    to_diagonal: bool,
}

impl Shortfalls {
    fn add(&mut self, missed: Missed, reason: String) {
        self.missed.push((missed, reason));
    }
}

/// What all steps of a run have in common.
pub(crate) struct Solver<'a> {
    pub(crate) case: &'a Case,
    pub(crate) settings: FieldSettings,
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
            Ok(Err(Stop::Cancelled)) => result = self.not_run(step),
            Ok(Err(Stop::Failed(failure))) => result.fail(*failure),
            Err(defect) => {
                let said = defect.downcast_ref::<String>().map(String::as_str);
                let said = said.or_else(|| defect.downcast_ref::<&str>().copied()).unwrap_or("no message");
                result.fail(StepFailure::Defect(said.to_owned()));
            }
        }
        result.seconds.total = start.elapsed().as_secs_f64();
        (result, field)
    }

    /// Solves the field of a step to another tolerance, for what the curve shows alone: of the whole matrix for the entry that it shows.
    pub(crate) fn solve_to(&self, step: &PlannedStep, relative_tolerance: f64) -> StepResult {
        let asked = &self.settings;
        let target = match (self.case.measurement(), asked.target) {
            (Measurement::Matrix(_), Target::Matrix) => Target::Mutual([0, 1]),
            (_, target) => target,
        };
        let settings = FieldSettings { relative_tolerance, target, field: false, ..asked.clone() };
        let again = Solver { settings, ..*self };
        let mut result = again.solve(step).0;
        // The entries are compared with what the case asks of them.
        let allowed = asked.boxes().allowed_spread();
        result.entry_status = result.maxwell.as_ref().map(|all| EntryStatus::of(all, allowed, asked.target));
        result
    }

    /// A step that the run was stopped before, with what is known of the layer.
    pub(crate) fn not_run(&self, step: &PlannedStep) -> StepResult {
        let mut result = StepResult::not_run(step);
        let Ok(state) = self.layer.deformation(self.case, step.index, step.load, self.prune) else {
            return result;
        };
        let missed = layer_missed(state.as_ref());
        if !self.case.has_conductors() && missed.is_none() {
            // There is nothing else to solve.
            return self.solve(step).0;
        }
        result.reason = missed;
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
                return self.without_layer(deformed, result, field);
            }
        }
        let start = Instant::now();
        let state = self.layer.deformation(self.case, step.index, step.load, self.prune)?;
        let no_force = self.note_mechanics(result, state.as_ref(), &step.pose);
        let mut shortfalls = Shortfalls { no_force, ..Shortfalls::default() };
        if let Some(reason) = layer_missed(state.as_ref()) {
            shortfalls.add(Missed::Mechanics, reason);
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
        if let Some(error) = self.mechanics_error(state.as_ref(), &deformed)? {
            result.row.mechanics_error_estimate = Some(error);
            let asked = self.settings.relative_tolerance;
            if error > asked {
                let reason = format!(
                    "from the finest mesh of the layer but one to the finest, the gap or the parallel-plate capacitance changes by \
                     {error:.1e} of itself, where {asked:.0e} was asked for"
                );
                shortfalls.add(Missed::Mechanics, reason);
            }
        }
        let deformed = result.scene.insert(deformed);
        result.seconds.mechanics = start.elapsed().as_secs_f64();

        let bending = Bending::found(self.case, deformed, state.as_ref(), step.pose.distance);
        let taken = route(Bodies::of(&deformed.scene), bending, asked(self.case))?;
        result.route = Some(taken);
        let mut solution = match self.fields(taken, step, deformed, state.as_ref())? {
            Fields::Boxes(found) => *found,
            Fields::Mapped { found, deviation, surfaces } => {
                result.surfaces = surfaces;
                self.note_deviation(&mut result.row, deviation, &mut shortfalls);
                *found
            }
            Fields::Enclosed(found) => {
                result.route = Some(Route::EnclosingBoxes);
                *found
            }
            Fields::Shapes(layer) => {
                let window = window(&[&*deformed]);
                let shaped = Shaped { scene: &layer.scene, facets: layer.facets };
                let by_outlines = !taken.is_on_tetrahedra();
                if by_outlines && let Some(found) = self.by_outlines(shaped.scene)? {
                    result.surfaces = layer.surfaces(&window, &[]);
                    return self.note_shapes(&shaped, found, result, field, shortfalls);
                }
                if by_outlines && taken != Route::EnclosingBoxesThenOutlines {
                    result.route = Some(on_tetrahedra_instead(taken));
                }
                self.solve_shaped(&shaped, result, field, shortfalls)?;
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
        self.note_solution(result, solution, shortfalls, self.settings.boxes().allowed_spread())
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

    /// A step as an earlier run found it, with the layer and the bodies of this one. `None` if it does not fit them.
    pub(crate) fn restored(&self, step: &PlannedStep, found: FinishedStep) -> Option<StepResult> {
        let mut result = StepResult::not_run(step);
        let state = self.layer.deformation(self.case, step.index, step.load, self.prune).ok()?;
        self.note_mechanics(&mut result, state.as_ref(), &step.pose);
        result.scene = Some(self.bodies(&mut result.row, state.as_ref(), &step.pose).ok()?);
        found.add_to(&mut result).then_some(result)
    }

    /// A scene of any shapes without a layer.
    fn without_layer(
        &self,
        deformed: DeformedScene,
        result: &mut StepResult,
        field: &mut Option<StepField>,
    ) -> Result<(), Stop> {
        let taken = route(Bodies::of(&deformed.scene), Bending::Straight, asked(self.case))?;
        result.route = Some(taken);
        let shaped = Shaped { scene: &deformed.scene, facets: 0.0 };
        match taken {
            Route::Tetrahedra => {}
            Route::Extruded => {
                if let Some(found) = self.by_outlines(shaped.scene)? {
                    result.surfaces = LayerScene::of_boxes(&deformed).surfaces(&window(&[&deformed]), &[]);
                    return self.note_shapes(&shaped, found, result, field, Shortfalls::default());
                }
                result.route = Some(on_tetrahedra_instead(taken));
            }
            // These want boxes, or a layer that bends electrodes.
            Route::Boxes
            | Route::EnclosingBoxes
            | Route::MappedBoxes
            | Route::EnclosingBoxesThenOutlines
            | Route::Outlines
            | Route::OutlinesOnTetrahedra => return Err(RouteError::BoxesOnly.into()),
        }
        self.solve_shaped(&shaped, result, field, Shortfalls::default())
    }

    /// A scene of outlines by the solver for them. `None` where that fails and nobody asked for it: tetrahedra may serve.
    fn by_outlines(&self, scene: &Scene) -> Result<Option<Solved>, Stop> {
        match solve_extruded(scene, &self.settings.boxes()) {
            Ok(ExtrudedSolution { solution, turn, planes, field }) => {
                let (mesh, potentials) = field.unwrap_or_default();
                let general = MeshSolution { mesh, potentials, solution };
                Ok(Some(Solved { general, turn, planes, surfaces: Vec::new(), facets: 0.0 }))
            }
            Err(SolveError::Cancelled) => Err(Stop::Cancelled),
            Err(error) if asked(self.case) == Some(FieldSolver::Extruded) => Err(error.into()),
            Err(_) => Ok(None),
        }
    }

    /// Relative error of gap and capacitance for the finite elements of the layer: how far the larger of the gap and the
    /// parallel-plate capacitance moved from the finest mesh but one to the finest. `None` without finite elements, without a
    /// pair, and where one mesh alone reached the load.
    fn mechanics_error(
        &self,
        state: Option<&Deformation<'_>>,
        deformed: &DeformedScene,
    ) -> Result<Option<f64>, Stop> {
        let (Some(Deformation::FiniteElement(layer)), Some(fine)) = (state, &deformed.pair) else {
            return Ok(None);
        };
        if layer.coarser_electrodes.is_empty() {
            return Ok(None);
        }
        let electrodes = layer.coarser_electrodes.clone();
        let coarser = FiniteElementStep { electrodes, ..(*layer).clone() };
        let scene = scene_of(self.case, Some(&Deformation::FiniteElement(&coarser)), &Pose::default())?;
        Ok(scene.pair.map(|coarse| {
            let moved = |coarse: f64, fine: f64| (coarse - fine).abs() / fine.abs();
            moved(coarse.gap, fine.gap).max(moved(coarse.parallel_plate, fine.parallel_plate))
        }))
    }

    /// The field of a step on its route, or the scene for the solver on tetrahedra.
    fn fields(
        &self,
        taken: Route,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        match taken {
            Route::Boxes => Ok(Fields::Boxes(Box::new(solve(&deformed.scene, &settings)?))),
            Route::EnclosingBoxes => {
                Ok(Fields::Boxes(Box::new(between(deformed, enclosing(deformed)?, &settings)?)))
            }
            Route::MappedBoxes => self.under_map(step, deformed, state),
            Route::EnclosingBoxesThenOutlines => {
                // Boxes inside and around are solved in no time.
                let found = between(deformed, enclosing(deformed)?, &settings)?;
                if found.reached {
                    Ok(Fields::Boxes(Box::new(found)))
                } else {
                    self.outlines(deformed, state)
                }
            }
            Route::Outlines | Route::OutlinesOnTetrahedra => self.outlines(deformed, state),
            Route::Extruded | Route::Tetrahedra => Ok(Fields::Shapes(LayerScene::of_boxes(deformed))),
        }
    }

    /// Boxes under the map that bends them; boxes inside and around the electrodes where there is no such map.
    fn under_map(
        &self,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        if let Some(map) = &deformed.tilt {
            let bent = BentScene { scene: deformed.scene.clone(), map: Arc::clone(map), deviation: 0.0 };
            let found = Box::new(mapped(&bent, &settings)?);
            let surfaces = bent.surfaces(&window(&[deformed]));
            return Ok(Fields::Mapped { found, deviation: 0.0, surfaces });
        }
        let enclosed = || Ok(Fields::Enclosed(Box::new(between(deformed, enclosing(deformed)?, &settings)?)));
        // Boxes inside and around a pair know nothing of what else is bent.
        let is_pressed_in_field = indenter_in_field(self.case).is_some();
        let may_be_enclosed = deformed.scene.conductors().count() <= 2 && !is_pressed_in_field;
        let (Some(Deformation::FiniteElement(layer)), Some(displacement)) =
            (state, self.layer.displacement(step.index))
        else {
            return enclosed();
        };
        let found = Found { step: layer, displacement: &displacement, distance: step.pose.distance };
        let mut films = films(self.settings.relative_tolerance);
        loop {
            let Some(film) = films.next() else {
                return if may_be_enclosed { enclosed() } else { Err(StepFailure::NoMap.into()) };
            };
            let bent = match bent_scene(self.case, deformed, &found, film) {
                Ok(Some(bent)) => bent,
                Ok(None) | Err(_) if may_be_enclosed => return enclosed(),
                Ok(None) => return Err(StepFailure::NoMap.into()),
                Err(error) => return Err(error.into()),
            };
            match mapped(&bent, &settings) {
                Ok(found) => {
                    let surfaces = bent.surfaces(&window(&[deformed]));
                    let found = Box::new(found);
                    return Ok(Fields::Mapped { found, deviation: bent.deviation, surfaces });
                }
                // Only the film of an indenter can be chosen.
                Err(Stop::Failed(failure)) if no_map(&failure) && is_pressed_in_field => {}
                Err(Stop::Failed(failure)) if no_map(&failure) && may_be_enclosed => return enclosed(),
                Err(stop) => return Err(stop),
            }
        }
    }

    /// Notes how far the bodies of a field are from those of the layer's finite elements.
    fn note_deviation(&self, row: &mut Row, deviation: f64, shortfalls: &mut Shortfalls) {
        row.geometry_error_estimate = Some(deviation);
        let asked = self.settings.relative_tolerance;
        if deviation > asked {
            let reason = format!(
                "the polynomials that bend electrodes and layer leave a relative error of about {deviation:.0e} (an estimate), where \
                 {asked:.0e} was asked for"
            );
            shortfalls.add(Missed::Geometry, reason);
        }
    }

    /// Electrodes and layer in their own outlines.
    fn outlines(&self, deformed: &DeformedScene, state: Option<&Deformation<'_>>) -> Result<Fields, Stop> {
        let layer = match state {
            Some(Deformation::FiniteElement(layer)) => {
                outlined(deformed, &layer.curves, self.settings.relative_tolerance)?
            }
            // Nothing but finite elements bends anything.
            Some(Deformation::ClosedForm(_)) | None => LayerScene::of_boxes(deformed),
        };
        Ok(Fields::Shapes(layer))
    }

    /// A scene of any shapes; `shortfalls` are those of the layer.
    fn solve_shaped(
        &self,
        shaped: &Shaped<'_>,
        result: &mut StepResult,
        field: &mut Option<StepField>,
        shortfalls: Shortfalls,
    ) -> Result<(), Stop> {
        let mut solved = solve_shapes(shaped.scene, self.case.mesh.as_ref(), &self.settings)?;
        if !shaped.scene.is_boxes() {
            result.surfaces = std::mem::take(&mut solved.surfaces);
        }
        self.note_shapes(shaped, solved, result, field, shortfalls)
    }

    /// Notes what was found of a scene of any shapes.
    fn note_shapes(
        &self,
        &Shaped { scene, facets: polygons }: &Shaped<'_>,
        solved: Solved,
        result: &mut StepResult,
        field: &mut Option<StepField>,
        mut shortfalls: Shortfalls,
    ) -> Result<(), Stop> {
        if self.settings.field && !solved.general.mesh.tets.is_empty() {
            *field = Some(StepField::Tetrahedra(shown(scene, &solved, self.settings.target)));
        }
        let Solved { mut general, turn, facets, .. } = solved;
        let facets = facets + polygons;
        result.row.geometry_error_estimate = Some(facets);
        if facets > 0.0 {
            result.warnings.push(format!(
                "curved surfaces are solved with flat faces, which adds a relative error of about {facets:.0e} (an estimate) to \
                 the capacitances: their bounds are those of the flat-faced bodies"
            ));
        }
        let asked = self.settings.relative_tolerance;
        if facets > asked {
            let reason = format!(
                "flat faces in place of curved ones leave a relative error of about {facets:.0e} (an estimate), where {asked:.0e} \
                 was asked for"
            );
            shortfalls.add(Missed::Geometry, reason);
        }
        result.floating = floating_of(scene, std::mem::take(&mut general.solution.floating));
        self.note_solution(result, general.solution, shortfalls, asked)?;
        if let Some(report) = &mut result.solver {
            report.turned_degrees = turn.map(|turn| turn.degrees());
        }
        Ok(())
    }

    /// Notes what the mechanics say; returns why there is no force, if there is none.
    fn note_mechanics(
        &self,
        result: &mut StepResult,
        state: Option<&Deformation<'_>>,
        pose: &Pose,
    ) -> Option<String> {
        let row = &mut result.row;
        row.distance_m = self.case.approaches().then_some(pose.distance);
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
        [row.force_x1_n, row.force_x3_n] = shear_force(state, pose);
        if let (StepLoad::Compression(compression), Some(limit)) = (result.load, self.force_limit)
            && compression > limit.compression
        {
            return Some(format!(
                "the force has its maximum of {:.4e} N at U/H = {:.4} by {FORCE_FORMULA}; beyond it the formula means nothing \
                 and no force is given; the deformation and the capacitance are not affected",
                limit.force, limit.compression
            ));
        }
        row.force_n = Some(state.force());
        result.force_check = ForceCheck::of(self.case, state);
        None
    }

    /// The capacitance that the row of a step shows. That of the whole matrix is one of its entries, which only a curve needs.
    fn measured(&self, solution: &Solution) -> Option<Bounded> {
        match self.case.measurement() {
            Measurement::Matrix(_) if self.case.load.is_none() => None,
            measurement => shown_of(measurement, solution),
        }
    }

    /// Notes what was found of the field; `allowed_spread` is what the solver was asked for, over the value.
    fn note_solution(
        &self,
        result: &mut StepResult,
        solution: Solution,
        mut shortfalls: Shortfalls,
        allowed_spread: f64,
    ) -> Result<(), Stop> {
        let measured = self.measured(&solution);
        let all = solution.maxwell.iter().flatten().chain(&measured);
        if all.into_iter().any(|c| !(c.lower <= c.value && c.value <= c.upper)) {
            return Err(StepFailure::BoundsExcludeValue.into());
        }
        match &measured {
            Some(capacitance) => result.row.set_capacitance(capacitance, self.case.measurement(), &solution),
            None if self.settings.target != Target::Matrix => {
                shortfalls
                    .add(Missed::Field, "no flux leaves what is measured: it has no capacitance".to_owned());
            }
            None => {}
        }
        result.row.unknowns = Some(solution.unknowns);
        result.row.geometry_error_estimate.get_or_insert(0.0);
        if !solution.reached {
            let reason = solution.shortfall.unwrap_or_else(|| TOO_FAR_APART.to_owned());
            shortfalls.missed.insert(0, (Missed::Field, reason));
        }
        let entries = EntryStatus::of(&solution.maxwell, allowed_spread, self.settings.target);
        let matrix_asked = self.settings.target == Target::Matrix;
        shortfalls.to_diagonal = matrix_asked && entries.iter().flatten().any(|e| *e != EntryStatus::Ok);
        result.mark(shortfalls);
        result.entry_status = Some(entries);
        result.measured = measured;
        result.maxwell = Some(solution.maxwell);
        result.seconds.electrostatics = solution.seconds;
        result.solver = Some(SolverReport {
            iterations: solution.iterations,
            grids: solution.grids,
            resolution: solution.resolution,
            mirrored: solution.mirrored,
            turned_degrees: None,
            repair_share: solution.repair_share,
        });
        Ok(())
    }
}

fn floating_of(scene: &Scene, potentials: Vec<FloatingPotential>) -> Vec<FloatingConductor> {
    let named = potentials.into_iter().filter_map(|potential| {
        let conductor = scene.conductors().nth(potential.conductor)?;
        Some(FloatingConductor {
            name: conductor.body.name.clone(),
            charge: conductor.potential.floating_charge()?,
            per_volt: potential.per_driven,
            from_charges: potential.from_charges,
        })
    });
    named.collect()
}

/// Whether a solve failed because the map that bends its boxes is none.
fn no_map(failure: &StepFailure) -> bool {
    matches!(failure, StepFailure::Field(SolveError::InsideOut | SolveError::TornMap))
}

/// What is said where a solver has nothing more to say.
const TOO_FAR_APART: &str = "the bounds are farther apart than asked for";

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
            route: None,
            row,
            reason: None,
            interrupted: false,
            warnings: Vec::new(),
            layer: None,
            force_check: None,
            scene: None,
            surfaces: Vec::new(),
            maxwell: None,
            entry_status: None,
            floating: Vec::new(),
            measured: None,
            solver: None,
            before_change: None,
            seconds: Default::default(),
        }
    }

    /// How a step went that was carried to its end.
    fn mark(&mut self, shortfalls: Shortfalls) {
        let Shortfalls { missed, no_force, to_diagonal } = shortfalls;
        self.row.status = match (missed.first(), &no_force) {
            (Some((first, _)), _) => Status::ToleranceNotReached(*first),
            (None, Some(_)) => Status::BeyondForceLimit,
            (None, None) if to_diagonal => Status::OkToDiagonal,
            (None, None) => Status::Ok,
        };
        let reasons: Vec<_> = missed.into_iter().map(|(_, reason)| reason).chain(no_force).collect();
        self.reason = (!reasons.is_empty()).then(|| reasons.join("; "));
    }

    fn fail(&mut self, failure: StepFailure) {
        self.reason = Some(failure.to_string());
        self.row.status = failure.into();
    }
}

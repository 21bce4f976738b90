//! Notes of a step in its result: the layer, what was found of the field, and what is missing of what was
//! asked for.

use std::sync::atomic::Ordering;

use elastocap_case::{Measurement, Mechanics, Pose};
use elastocap_electrostatics::{Bounded, Discretisation, FloatingPotential, Solution, Target};
use elastocap_geometry::scene::{Purpose, Scene};
use elastocap_mechanics::solid::mesh_error::error_on_finest;

use super::{Shaped, Solver, StepField};
use crate::common_base::CommonBase;
use crate::deform::shear_force::shear_force;
use crate::deform::{Deformation, Displacement, FiniteElementStep, ForceCheck, Rods};
use crate::failure::{StepFailure, Stop};
use crate::load_steps::StepLoad;
use crate::outcome::{
    EntryStatus, FloatingConductor, Missed, Row, SolverReport, Status, StepResult, StepSeconds,
};
use crate::plan::PlannedStep;
use crate::reason::{Cause, Reason};
use crate::scene::{DeformedScene, scene_of};
use crate::settings::FieldSettings;
use crate::terminals::shown as shown_of;
use crate::tetrahedra::{Solved, shown};

/// The shortfalls of a step that was carried to its end: what was asked for and is missing.
#[derive(Default)]
pub(super) struct Shortfalls {
    /// Why errors are too large.
    missed: Vec<Cause>,
    /// Why there is no force, if there is none.
    no_force: Option<Cause>,
    /// Whether entries of the matrix are known to the tolerance of the diagonal only.
    to_diagonal: bool,
}

impl Shortfalls {
    /// Nothing but why there is no force, if there is none.
    pub(super) fn of_force(no_force: Option<Cause>) -> Self {
        Self { no_force, ..Self::default() }
    }

    /// Adds a cause. Shortfalls of the layer come before those of the shapes that replace its bodies.
    pub(super) fn add(&mut self, cause: Cause) {
        let is_mechanics = cause.missed() == Some(Missed::Mechanics);
        let is_geometry = |other: &Cause| is_mechanics && other.missed() == Some(Missed::Geometry);
        let at = self.missed.iter().position(is_geometry).unwrap_or(self.missed.len());
        self.missed.insert(at, cause);
    }
}

/// Coarser meshes of the layer that are looked at for the error of a capacitance: with the finest, as many as
/// show an order of convergence. The difference between two may vanish by accident.
const ERRORS_FROM: usize = 2;

/// The least share of the difference between the capacitances on two meshes that is stated as the error on
/// the finer one. Measured: `benches/total_errors.py`.
const LEAST_LEFT: f64 = 0.25;
/// The most of it: where distances changed by less, what the capacitance changed by is not what is left of
/// it. Measured: `benches/total_errors.py`.
const MOST_LEFT: f64 = 10.0;

impl Solver<'_> {
    /// Notes what the mechanics say; returns why there is no force, if there is none.
    pub(super) fn note_mechanics(
        &self,
        result: &mut StepResult,
        state: Option<&Deformation<'_>>,
        pose: &Pose,
    ) -> Option<Cause> {
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
        if self.case.lacks_force() {
            return None;
        }
        [row.force_x1_n, row.force_x3_n] = shear_force(state, pose);
        if let (StepLoad::Compression(compression), Some(limit)) = (result.load, self.force_limit)
            && compression > limit.compression
        {
            return Some(Cause::NoForce(limit));
        }
        row.force_n = Some(state.force());
        result.force_check = ForceCheck::of(self.case, state);
        None
    }

    /// The relative error of gaps and capacitance that the finite elements of the layer leave: the largest of
    /// those of a pair and of other bodies in the layer. It is the one estimated on the finest mesh, or
    /// follows from the differences between the meshes. `None` without finite elements, with nothing in the
    /// layer, where no other mesh reached the load, and on a coarser mesh than the finest.
    pub(super) fn mechanics_error(
        &self,
        step: &PlannedStep,
        state: Option<&Deformation<'_>>,
        deformed: &DeformedScene,
    ) -> Result<Option<f64>, Stop> {
        if self.coarser > 0 {
            return Ok(None);
        }
        if let Some(Deformation::FiniteElement(layer)) = state
            && layer.places_error.is_some()
        {
            return Ok(layer.places_error);
        }
        let of_pair = self.error_of_pair(step, state, deformed)?;
        Ok([of_pair, self.error_of_bodies(step, state)].into_iter().flatten().reduce(f64::max))
    }

    /// The relative error, an estimate, of the bodies that move with the layer's material.
    fn error_of_bodies(&self, step: &PlannedStep, state: Option<&Deformation<'_>>) -> Option<f64> {
        let Some(Deformation::FiniteElement(layer)) = state else { return None };
        let rods = Rods::of(self.case);
        if rods.is_empty() {
            return None;
        }
        let is_half = layer.curves.half || matches!(self.case.mechanics, Some(Mechanics::Solid(_)));
        let read = |displacement: &Displacement<'_>| rods.lengths_under(self.case, is_half, displacement);
        let on_meshes = self.layer.on_meshes(step.index, &read);
        let (_, finest) = on_meshes.last()?;
        let errors: Option<Vec<f64>> = (0..finest.len())
            .map(|k| {
                let values: Vec<(f64, f64)> = on_meshes.iter().map(|(size, own)| (*size, own[k])).collect();
                Some(error_on_finest(&values)? / finest[k])
            })
            .collect();
        Some(rods.error(errors?.into_iter()))
    }

    /// The relative error, an estimate, of the pair: the larger of those of its gap and of its parallel-plate
    /// capacitance.
    fn error_of_pair(
        &self,
        step: &PlannedStep,
        state: Option<&Deformation<'_>>,
        deformed: &DeformedScene,
    ) -> Result<Option<f64>, Stop> {
        let (Some(Deformation::FiniteElement(layer)), Some(fine)) = (state, &deformed.pair) else {
            return Ok(None);
        };
        let (mut gaps, mut plates) = (Vec::new(), Vec::new());
        for coarser in self.layer.coarser(step.index) {
            if let Some([gap, plate]) = self.facing(coarser)? {
                gaps.push((coarser.element_size, gap));
                plates.push((coarser.element_size, plate));
            }
        }
        gaps.push((layer.element_size, fine.gap));
        plates.push((layer.element_size, fine.parallel_plate));
        let relative = |values: &[(f64, f64)], fine: f64| Some(error_on_finest(values)? / fine.abs());
        let errors = [relative(&gaps, fine.gap), relative(&plates, fine.parallel_plate)];
        Ok(errors.into_iter().flatten().reduce(f64::max))
    }

    /// The gap in m and the parallel-plate capacitance in F of the pair where the layer is as this says;
    /// `None` without a pair.
    fn facing(&self, layer: &FiniteElementStep) -> Result<Option<[f64; 2]>, Stop> {
        let scene = scene_of(self.case, Some(&Deformation::FiniteElement(layer)), &Pose::default())?;
        Ok(scene.pair.map(|pair| [pair.gap, pair.parallel_plate]))
    }

    /// The error of the pair's distances on the finest mesh, divided by their change since the mesh before;
    /// `None` where that error is not estimated on one mesh, and where they hardly changed.
    fn share_left(&self, finest: &FiniteElementStep, before: &FiniteElementStep) -> Option<f64> {
        let error = finest.places_error?;
        let [now, then] = [finest, before].map(|layer| self.facing(layer).ok().flatten());
        let (now, then) = (now?, then?);
        let moved = (0..2).map(|k| (then[k] / now[k] - 1.0).abs()).fold(0.0, f64::max);
        let left = (error / moved).max(LEAST_LEFT);
        (left <= MOST_LEFT).then_some(left)
    }

    /// Compares the error that the layer's finite elements leave with what was asked for. Where the one
    /// estimated from distances is too large, the `capacitance` itself (F) is solved for on the coarser
    /// meshes: it may depend on these distances weakly. That is given where the field has all that was asked
    /// for. A second solve of a step leaves this to the first one.
    fn judge_mechanics(
        &self,
        step: &PlannedStep,
        result: &mut StepResult,
        capacitance: Option<f64>,
        shortfalls: &mut Shortfalls,
    ) -> Result<(), Stop> {
        let asked = self.settings.relative_tolerance;
        let Some(of_distances) = result.row.mechanics_error_estimate.filter(|error| *error > asked) else {
            return Ok(());
        };
        if self.settings.target_alone {
            return Ok(());
        }
        let mut spent = StepSeconds::default();
        let of_capacitance = match capacitance {
            Some(own) => self.error_of_capacitance(step, result, own, &mut spent).map_err(Stop::Failed)?,
            None => None,
        };
        result.seconds.electrostatics = result.seconds.electrostatics.plus(&spent.electrostatics);
        result.mechanics_by_capacitance = of_capacitance.is_some();
        let error = of_capacitance.unwrap_or(of_distances);
        result.row.mechanics_error_estimate = Some(error);
        if error <= asked {
            return Ok(());
        }
        let is_pair = result.scene.as_ref().is_some_and(|scene| scene.pair.is_some());
        let has_bodies = self.case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
        let what = match (of_capacitance, is_pair, has_bodies) {
            (Some(_), ..) => "the capacitance",
            (None, true, false) => "the gap or the parallel-plate capacitance",
            (None, true, true) => {
                "the gap, the parallel-plate capacitance, or the distances between and across the bodies in it"
            }
            (None, false, _) => "the distances between and across the bodies in it",
        };
        shortfalls.add(Cause::LayerDifferences { error, what, asked });
        Ok(())
    }

    /// The relative error that the layer's finite elements leave in the `capacitance` (F) that a step was
    /// `found` to have, from those on its last coarser meshes, or from that on the last of them and the
    /// estimated error of distances, where there is one. These are solved for as that was: grids are then
    /// much the same, and so is what they miss. `None` on tetrahedra, whose solves take too long for it, of a
    /// whole matrix, with less than three meshes, and where the solves are not alike. Adds the time that it
    /// takes to `spent`.
    ///
    /// # Errors
    /// A defect that one of these solves met with, such as bounds that contradict each other.
    pub(crate) fn error_of_capacitance(
        &self,
        step: &PlannedStep,
        found: &StepResult,
        capacitance: f64,
        spent: &mut StepSeconds,
    ) -> Result<Option<f64>, Box<StepFailure>> {
        let is_on_grid = |step: &StepResult| {
            step.solver.as_ref().is_some_and(|report| matches!(report.resolution, Discretisation::Grid(_)))
        };
        if !is_on_grid(found) || self.settings.target == Target::Matrix {
            return Ok(None);
        }
        let Ok(Some(Deformation::FiniteElement(finest))) = self.deformation(step) else { return Ok(None) };
        let coarser = self.layer.coarser(step.index);
        let left = coarser.last().and_then(|before| self.share_left(finest, before));
        let count = if left.is_some() { 1 } else { ERRORS_FROM };
        let Some(first) = coarser.len().checked_sub(count) else { return Ok(None) };
        let settings =
            FieldSettings { target_alone: true, field: false, shared: None, ..self.settings.clone() };
        let mut values = Vec::new();
        for (mesh, layer) in coarser.iter().enumerate().skip(first) {
            let back = coarser.len() - mesh;
            let own = Solver { settings: settings.clone(), coarser: back, base: None, ..*self }.solve(step).0;
            spent.electrostatics = spent.electrostatics.plus(&own.seconds.electrostatics);
            spent.total += own.seconds.total;
            if let Some(defect) = own.row.status.defect() {
                return Err(Box::new(defect.clone()));
            }
            let is_known = !matches!(own.row.status, Status::ToleranceNotReached(Missed::Field));
            let is_alike = own.route == found.route && is_on_grid(&own);
            let is_stopped = settings.cancel.as_ref().is_some_and(|cancel| cancel.load(Ordering::Relaxed));
            let Some(measured) = own.measured.filter(|_| !is_stopped && is_known && is_alike) else {
                return Ok(None);
            };
            values.push((layer.element_size, measured.value));
        }
        let at_least = |error: f64| error.max(finest.least_places_error);
        if let (Some(left), [(_, before)]) = (left, values.as_slice()) {
            return Ok(Some(at_least(left * (before / capacitance - 1.0).abs())));
        }
        values.push((finest.element_size, capacitance));
        Ok(error_on_finest(&values).map(|error| at_least(error / capacitance.abs())))
    }

    /// Notes how far the bodies of a field are from those of the layer's finite elements, within the map and
    /// `beyond` it.
    pub(super) fn note_deviation(
        &self,
        row: &mut Row,
        deviation: f64,
        beyond: f64,
        shortfalls: &mut Shortfalls,
    ) {
        row.geometry_error_estimate = Some(deviation + beyond);
        let asked = self.settings.relative_tolerance;
        if deviation > asked {
            shortfalls.add(Cause::Map { error: deviation, asked });
        }
        if beyond > asked {
            shortfalls.add(Cause::LevelBeyond { error: beyond, asked });
        }
    }

    /// Notes the relative error of a capacitance for a bent surface on which a wall lies.
    pub(super) fn note_under_wall(&self, error: f64, shortfalls: &mut Shortfalls) {
        let asked = self.settings.relative_tolerance;
        if error > asked {
            shortfalls.add(Cause::FlatWall { error, asked });
        }
    }

    /// Notes what was found of a scene of any shapes.
    pub(super) fn note_shapes(
        &self,
        step: &PlannedStep,
        &Shaped { scene, facets: polygons, is_curved, ends, under_wall }: &Shaped<'_>,
        solved: Solved,
        result: &mut StepResult,
        field: &mut Option<StepField>,
        mut shortfalls: Shortfalls,
    ) -> Result<(), Stop> {
        if self.settings.field && !solved.found.mesh.tets.is_empty() {
            *field = Some(StepField::Tetrahedra(shown(scene, &solved, self.settings.target)));
        }
        let Solved { mut found, turn, facets, .. } = solved;
        let facets = facets + polygons;
        result.row.geometry_error_estimate = Some(facets + ends + under_wall);
        let instead = if is_curved {
            "outlines that follow what is bent"
        } else {
            "flat faces in place of curved ones"
        };
        if facets > 0.0 {
            result.warnings.push(format!(
                "{instead} add a relative error of about {facets:.0e} (an estimate) to the capacitances: their bounds are those of the \
                 bodies with them"
            ));
        }
        let asked = self.settings.relative_tolerance;
        // What is printed is half the distance between the bounds and this estimate.
        let bounds =
            self.measured(&found.solution).map_or(0.5 * asked, |c| c.relative_error()).min(0.5 * asked);
        if facets > 0.0 && bounds + facets > asked {
            shortfalls.add(Cause::Faces { instead, error: facets, together: bounds + facets, asked });
        }
        if ends > asked {
            shortfalls.add(Cause::SurfaceEnds { error: ends, asked });
        }
        self.note_under_wall(under_wall, &mut shortfalls);
        result.floating = floating_of(scene, std::mem::take(&mut found.solution.floating));
        self.note_solution(step, result, found.solution, shortfalls, asked)?;
        if let Some(report) = &mut result.solver {
            report.turned_degrees = turn.map(|turn| turn.degrees());
        }
        Ok(())
    }

    /// The capacitance that the row of a step shows. That of the whole matrix is one of its entries, which
    /// only a curve needs.
    fn measured(&self, solution: &Solution) -> Option<Bounded> {
        match self.case.measurement() {
            Measurement::Matrix { .. } if self.case.load.is_none() && self.case.measured.is_none() => None,
            measurement => shown_of(measurement, solution),
        }
    }

    /// The two-terminal capacitance where the tolerance is its tolerance too, or is met besides and nothing
    /// else was named.
    fn two_terminal(&self, measured: &Bounded, solution: &Solution) -> Option<Bounded> {
        match self.case.measurement() {
            Measurement::TwoTerminal(_) => Some(*measured),
            Measurement::Own(_) => (solution.maxwell.len() == 1).then_some(*measured),
            Measurement::Mutual(_) if self.settings.target == Target::Matrix => solution.two_terminal,
            Measurement::Mutual(_) if self.case.measured.is_none() => solution
                .two_terminal
                .filter(|own| own.spread_over_value() <= self.settings.relative_tolerance),
            Measurement::Mutual(_) | Measurement::Guarded(_) | Measurement::Matrix { .. } => None,
        }
    }

    /// Notes what was found of the field; `allowed_spread` is what the solver was asked for, over the value.
    pub(super) fn note_solution(
        &self,
        step: &PlannedStep,
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
            Some(capacitance) => {
                result.two_terminal = self.two_terminal(capacitance, &solution);
                result.row.set_capacitance(capacitance, result.two_terminal);
            }
            None if self.settings.target != Target::Matrix => {
                shortfalls.add(Cause::NoFlux);
            }
            None => {}
        }
        result.row.unknowns = Some(solution.unknowns);
        result.row.geometry_error_estimate.get_or_insert(0.0);
        result.solver = Some(SolverReport {
            iterations: solution.iterations,
            grids: solution.grids,
            resolution: solution.resolution,
            mirrored: solution.mirrored,
            turned_degrees: None,
            repair_share: solution.repair_share,
        });
        let known = measured.filter(|_| solution.reached).map(|own| own.value);
        self.judge_mechanics(step, result, known, &mut shortfalls)?;
        if !solution.reached {
            shortfalls.missed.insert(0, solution.shortfall.map_or(Cause::TooFarApart, Cause::Field));
        }
        // A solve for the target alone may come without the matrix.
        let maxwell = Some(solution.maxwell).filter(|all| !all.is_empty());
        let entries = maxwell.as_ref().map(|all| {
            EntryStatus::of(all, (allowed_spread, self.settings.least_scale), self.settings.target)
        });
        let matrix_asked = self.settings.target == Target::Matrix;
        shortfalls.to_diagonal =
            matrix_asked && entries.iter().flatten().flatten().any(|e| *e != EntryStatus::Ok);
        result.mark(shortfalls);
        result.entry_status = entries;
        result.measured = measured;
        result.with_error_of_base = self.base.map(CommonBase::number).zip(solution.with_error_of_base);
        result.maxwell = maxwell;
        result.seconds.electrostatics = result.seconds.electrostatics.plus(&solution.seconds);
        result.foresight = solution.foresight;
        Ok(())
    }
}

pub(super) fn floating_of(scene: &Scene, potentials: Vec<FloatingPotential>) -> Vec<FloatingConductor> {
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

/// Why the finite elements of the layer do not have the accuracy asked for, if they do not.
pub(super) fn layer_missed(state: Option<&Deformation<'_>>) -> Option<Cause> {
    let Some(Deformation::FiniteElement(step)) = state else { return None };
    if step.negative_pivots > 0 {
        return Some(Cause::UnstableLayer { negative_pivots: step.negative_pivots });
    }
    if step.converged {
        return None;
    }
    Some(match step.relative_error_estimate {
        Some(error) => Cause::LayerMesh { error },
        None => Cause::FewLayerMeshes,
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
            route_changes: Vec::new(),
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
            two_terminal: None,
            with_error_of_base: None,
            solver: None,
            foresight: None,
            before_change: None,
            mechanics_by_capacitance: false,
            seconds: Default::default(),
        }
    }

    /// How a step went that was carried to its end.
    pub(super) fn mark(&mut self, shortfalls: Shortfalls) {
        let Shortfalls { missed, no_force, to_diagonal } = shortfalls;
        self.row.status = match (missed.iter().find_map(Cause::missed), &no_force) {
            (Some(first), _) => Status::ToleranceNotReached(first),
            (None, Some(_)) => Status::BeyondForceLimit,
            (None, None) if to_diagonal => Status::OkToDiagonal,
            (None, None) => Status::Ok,
        };
        self.reason = Reason::of(missed.into_iter().chain(no_force).collect());
    }

    pub(crate) fn fail(&mut self, failure: StepFailure) {
        self.reason = Some(Cause::Failure(Box::new(failure.clone())).into());
        self.row.status = failure.into();
    }
}

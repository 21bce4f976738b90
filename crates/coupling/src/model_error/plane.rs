//! The layer of a closed-form case in plane strain, coarsely: what the closed form is compared with.

use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Indenter, LayerEnd, Layout, Load, Mechanics, PlaneStrain, Pose};
use elastocap_geometry::scene::Purpose;

use super::compared_at;
use super::shares::Shares;
use crate::deform::{Deformation, prepare};
use crate::failure::StepFailure;
use crate::outcome::{Outcome, Row, Status, StepResult};
use crate::plan::{Options, Plan};
use crate::scene::scene_of;

/// The relative error of capacitances that is asked for.
const TOLERANCE: f64 = 2e-2;
/// The relative error of forces that is asked for; they are not needed.
const FORCE_TOLERANCE: f64 = 0.2;
/// The largest compression that is solved: deeper ones take long.
const DEEPEST: f64 = 0.2;
/// The number of compressions that are solved at most. Between them changes are interpolated.
const MOST: usize = 2;
/// A comparison whose forecast is longer than this, in seconds, is left out. Forecasts count work and do not depend on the machine.
const AFFORDABLE: f64 = 3.0;
/// The layer goes so many thicknesses beyond its electrodes at least.
const BEYOND: f64 = 1.2;

/// Capacitances in plane strain over the compression.
#[derive(Debug)]
pub(crate) struct PlaneStrainCurve {
    /// U/H, capacitance in F and its error in F, ascending from rest.
    states: Vec<[f64; 3]>,
    /// Whether these are capacitances of parallel plates: that of stacked plates changes in proportion to them.
    of_plates: bool,
}

/// The reason why the closed form is not compared with plane strain.
#[derive(Debug, Clone, thiserror::Error)]
pub(crate) enum NotCompared {
    /// Nothing that the rubber stretches lies in the layer, so that there is nothing to compare.
    #[error("nothing in the layer moves with the rubber")]
    Needless,
    /// The indenter is part of the field.
    #[error("the indenter is part of the field")]
    Indenter,
    /// Bodies ride on the top of the layer, or on the indenter.
    #[error("bodies ride on the layer or on the indenter")]
    Riders,
    /// Some bodies are no boxes.
    #[error("some bodies are no boxes")]
    Shapes,
    /// The layer is a foam, or has no electrostatics.
    #[error("finite elements do not know this layer")]
    Layer,
    /// No load is small enough.
    #[error("no load is below U/H = {DEEPEST}")]
    Loads,
    /// The comparison would take so many seconds.
    #[error("that would take about {0:.0} s")]
    Cost(f64),
    /// Plane strain has no result at one of the loads.
    #[error("plane strain failed: {0}")]
    Failed(Box<StepFailure>),
}

impl PlaneStrainCurve {
    /// Solves the layer of a closed-form case under a smooth plate as long as the contact, at the compressions of its steps. `run` solves a case.
    ///
    /// # Errors
    /// The reason why the two are not compared.
    pub(crate) fn of(
        case: &Case,
        steps: &[StepResult],
        cancel: &AtomicBool,
        run: &dyn Fn(&Case, &Plan, &Options) -> Outcome,
    ) -> Result<Self, NotCompared> {
        let mut compressions: Vec<f64> = steps.iter().filter_map(|step| compared_at(case, step)).collect();
        compressions.retain(|compression| *compression > 0.0 && *compression <= DEEPEST);
        compressions.sort_by(f64::total_cmp);
        compressions.dedup();
        let own = plane_strain(case, thinned(&compressions))?;
        let options = Options { prune: true, fields: false, scene: false, model_error: false };
        let mut plan = Plan::new(&own, &options);
        let of_plates = case.electrodes.as_ref().is_some_and(|pair| pair.layout == Layout::Stacked);
        if !of_plates {
            plan.forecast(&own, &options);
        }
        if let Some(failure) = plan.steps.iter().find_map(|step| step.failure.clone()) {
            return Err(NotCompared::Failed(Box::new(failure)));
        }
        let of_fields = if of_plates { 0.0 } else { plan.seconds };
        let seconds = of_fields + plan.layer.as_ref().map_or(0.0, |layer| layer.seconds);
        if seconds > AFFORDABLE {
            return Err(NotCompared::Cost(seconds));
        }
        let states: Result<Vec<[f64; 3]>, StepFailure> = if of_plates {
            plates(&own, &plan, cancel)
        } else {
            run(&own, &plan, &options).steps.iter().filter_map(state).collect()
        };
        Ok(Self { states: states.map_err(|failure| NotCompared::Failed(Box::new(failure)))?, of_plates })
    }

    /// Gives by how much the capacitance of a step has changed from that at rest by this model, and what that is off by, F; `own` is what it
    /// changed by in its own model. `None` beyond the compressions that were solved.
    pub(super) fn change(&self, compression: f64, step: &Row, rest: &Row, own: f64) -> Option<[f64; 2]> {
        let [change, error] = self.change_at(compression)?;
        if !self.of_plates {
            return Some([change, error]);
        }
        let scale = own / (step.parallel_plate_f? - rest.parallel_plate_f?);
        Some([scale * change, (scale * error).abs()])
    }

    fn change_at(&self, compression: f64) -> Option<[f64; 2]> {
        let after = self.states.iter().position(|[known, ..]| *known >= compression * (1.0 - 1e-9))?;
        let (next, before) = (self.states.get(after)?, self.states.get(after.saturating_sub(1))?);
        let share = match next[0] - before[0] {
            0.0 => 1.0,
            length => (compression - before[0]) / length,
        };
        let [value, error] = [1, 2].map(|k| before[k] + share * (next[k] - before[k]));
        let [_, at_rest, its_error] = *self.states.first()?;
        Some([value - at_rest, error + its_error])
    }
}

/// Reads compression, capacitance and error off a step, or why it failed; a step that was stopped has nothing.
fn state(step: &StepResult) -> Option<Result<[f64; 3], StepFailure>> {
    if let Status::Failed(failure) = &step.row.status {
        return Some(Err((**failure).clone()));
    }
    let row = &step.row;
    let value = row.capacitance_f?;
    Some(Ok([row.compression?, value, row.error_in_model()? * value.abs()]))
}

/// Finds the parallel-plate capacitances of a pair in its layer.
fn plates(case: &Case, plan: &Plan, cancel: &AtomicBool) -> Result<Vec<[f64; 3]>, StepFailure> {
    let layer = prepare(case, &plan.loads(), plan.layer_memory_limit, cancel, &|_| ());
    let mut states = Vec::new();
    for step in &plan.steps {
        let state = layer.deformation(case, step.index, step.load, false)?;
        let pair = scene_of(case, state.as_ref(), &Pose::default())?.pair;
        if let (Some(Deformation::FiniteElement(layer)), Some(pair)) = (&state, pair) {
            let value = pair.parallel_plate;
            states.push([layer.compression, value, layer.places_error.unwrap_or(TOLERANCE) * value]);
        }
    }
    Ok(states)
}

/// Picks at most [`MOST`] of ascending compressions, the last among them.
fn thinned(all: &[f64]) -> Vec<f64> {
    let count = all.len();
    (0..count)
        .filter(|k| count <= MOST || (k + 1) * MOST / count > k * MOST / count)
        .map(|k| all[k])
        .collect()
}

/// Makes the case with its layer in plane strain under a plate as long as the contact, at rest and at these compressions.
fn plane_strain(case: &Case, compressions: Vec<f64>) -> Result<Case, NotCompared> {
    // What lies on the faces goes where the top goes.
    if !Shares::of(case).is_some_and(|shares| shares.closed_form > 0.0) {
        return Err(NotCompared::Needless);
    }
    let rides = case.bodies.iter().any(|body| matches!(body.purpose, Purpose::OnTop | Purpose::OnIndenter));
    let refused = [
        (case.indenter.is_some(), NotCompared::Indenter),
        (rides, NotCompared::Riders),
        (!case.has_only_boxes(), NotCompared::Shapes),
        (case.is_foam(), NotCompared::Layer),
        (compressions.is_empty(), NotCompared::Loads),
    ];
    if let Some((_, reason)) = refused.into_iter().find(|(is_so, _)| *is_so) {
        return Err(reason);
    }
    let mut own = case.clone();
    let (Some(Mechanics::ClosedForm { contact_half_length, contact_width, .. }), Some(layer), Some(asked)) =
        (case.mechanics, &mut own.layer, &mut own.electrostatics)
    else {
        return Err(NotCompared::Layer);
    };
    let in_layer = case.bodies.iter().filter(|body| body.purpose == Purpose::InLayer);
    let boxes = in_layer.flat_map(|body| body.boxes().unwrap_or_default());
    let regions = boxes.chain(case.electrodes.iter().flat_map(|own| own.regions()));
    let reach = regions.map(|region| region.max[0].max(-region.min[0])).fold(0.0, f64::max);
    layer.half_length = Some(contact_half_length.max(reach + BEYOND * layer.thickness));
    asked.relative_tolerance = asked.relative_tolerance.max(TOLERANCE);
    asked.change_tolerance = None;
    own.mechanics = Some(Mechanics::PlaneStrain(PlaneStrain {
        indenter: Indenter::WholeTop,
        end: LayerEnd::FreeOnSubstrate,
        width: contact_width,
        relative_tolerance: FORCE_TOLERANCE,
    }));
    own.load = Some(Load::Compression([vec![0.0], compressions].concat()));
    own.poses = Vec::new();
    own.measured_points = None;
    Ok(own)
}

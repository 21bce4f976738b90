//! A coarse plane-strain solution of the layer of a closed-form case, with which the closed form is compared.

use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Indenter, LayerEnd, Layout, Load, Mechanics, PlaneStrain, Pose};
use elastocap_geometry::scene::Purpose;

use super::compared_at;
use super::shares::Shares;
use crate::deform::{Deformation, prepare};
use crate::failure::StepFailure;
use crate::load_steps::StepLoad;
use crate::outcome::{Outcome, Row, Status, StepResult};
use crate::plan::{Options, Plan};
use crate::scene::scene_of;

/// The relative tolerance of the capacitances. Tuned: `cargo bench --bench curve`.
const TOLERANCE: f64 = 2e-2;
/// The relative tolerance of the forces, which are not needed. Tuned: `cargo bench --bench curve`.
const FORCE_TOLERANCE: f64 = 0.2;
/// The largest compression that is solved: larger ones take long. Tuned: `cargo bench --bench curve`.
const MAX_COMPRESSION: f64 = 0.2;
/// The largest number of compressions that are solved. The change of the capacitance is interpolated between
/// them. Tuned: `cargo bench --bench curve`.
const MAX_COMPRESSIONS: usize = 2;
/// A comparison with a longer forecast, in seconds, is skipped. Forecasts count work and do not depend on the
/// machine. It is not tuned.
const MAX_SECONDS: f64 = 3.0;
/// The least distance of the ends of the layer from the electrodes, in thicknesses of the layer. Tuned:
/// `cargo bench --bench curve`.
const BEYOND: f64 = 1.2;

/// Capacitances in plane strain over the compression.
#[derive(Debug)]
pub(crate) struct PlaneStrainCurve {
    /// U/H, capacitance in F and its error in F, ascending from rest.
    states: Vec<[f64; 3]>,
    /// Whether these are parallel-plate capacitances; the capacitance of stacked plates changes in proportion
    /// to them.
    of_plates: bool,
}

/// The reason why the closed form is not compared with plane strain.
#[derive(Debug, Clone, thiserror::Error)]
pub(crate) enum NotCompared {
    /// No body in the layer moves with the rubber.
    #[error("nothing in the layer moves with the rubber")]
    Needless,
    /// The indenter is part of the field.
    #[error("the indenter is part of the field")]
    Indenter,
    /// Bodies are attached to the top of the layer or to the indenter.
    #[error("bodies ride on the layer or on the indenter")]
    Riders,
    /// Some bodies are not boxes.
    #[error("some bodies are no boxes")]
    Shapes,
    /// The layer is a foam, or has no electrostatics.
    #[error("finite elements do not know this layer")]
    Layer,
    /// No load is small enough.
    #[error("no load is below U/H = {MAX_COMPRESSION}")]
    Loads,
    /// The forecast of the comparison, in seconds, is too long.
    #[error("that would take about {0:.0} s")]
    Cost(f64),
    /// The plane-strain model failed at one of the loads.
    #[error("plane strain failed: {0}")]
    Failed(Box<StepFailure>),
}

impl PlaneStrainCurve {
    /// Solves the layer of a closed-form case at the compressions of its steps, under a smooth plate as long
    /// as the contact. `run` solves a case.
    ///
    /// # Errors
    /// The reason that the two models are not compared.
    pub(crate) fn of(
        case: &Case,
        steps: &[StepResult],
        cancel: &AtomicBool,
        run: &dyn Fn(&Case, &Plan, &Options) -> Outcome,
    ) -> Result<Self, NotCompared> {
        let options = OPTIONS;
        let (plane_case, plan) = comparison(case, steps.iter().map(|step| step.load))?;
        let of_plates = is_of_plates(case);
        let states: Result<Vec<[f64; 3]>, StepFailure> = if of_plates {
            plates(&plane_case, &plan, cancel)
        } else {
            run(&plane_case, &plan, &options).steps.iter().filter_map(state).collect()
        };
        Ok(Self { states: states.map_err(|failure| NotCompared::Failed(Box::new(failure)))?, of_plates })
    }

    /// The change of the capacitance of a step from rest by plane strain, and its error, F; `closed_form` is
    /// the change by the closed form. `None` beyond the compressions that were solved.
    pub(super) fn change(
        &self,
        compression: f64,
        step: &Row,
        rest: &Row,
        closed_form: f64,
    ) -> Option<[f64; 2]> {
        let [change, error] = self.change_at(compression)?;
        if !self.of_plates {
            return Some([change, error]);
        }
        let scale = closed_form / (step.parallel_plate_f? - rest.parallel_plate_f?);
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
        let [_, at_rest, error_at_rest] = *self.states.first()?;
        Some([value - at_rest, error + error_at_rest])
    }
}

/// The options of the comparison.
const OPTIONS: Options = Options { prune: true, fields: false, scene: false, model_error: false };

/// Whether parallel-plate capacitances are compared, for which no field is solved.
fn is_of_plates(case: &Case) -> bool {
    case.electrodes.as_ref().is_some_and(|pair| pair.layout == Layout::Stacked)
}

/// The case in plane strain that a closed-form case is compared with at these loads, and its plan.
///
/// # Errors
/// The reason that the two models are not compared.
pub(super) fn comparison(
    case: &Case,
    loads: impl Iterator<Item = StepLoad>,
) -> Result<(Case, Plan), NotCompared> {
    let mut compressions: Vec<f64> = loads.filter_map(|load| compared_at(case, load)).collect();
    compressions.retain(|compression| *compression > 0.0 && *compression <= MAX_COMPRESSION);
    compressions.sort_by(f64::total_cmp);
    compressions.dedup();
    let plane_case = plane_strain(case, thinned(&compressions))?;
    let mut plan = Plan::new(&plane_case, &OPTIONS);
    if is_of_plates(case) {
        plan.seconds = 0.0;
    } else {
        plan.forecast(&plane_case, &OPTIONS);
    }
    if let Some(failure) = plan.steps.iter().find_map(|step| step.failure.clone()) {
        return Err(NotCompared::Failed(Box::new(failure)));
    }
    let seconds = plan.seconds + plan.layer.as_ref().map_or(0.0, |layer| layer.seconds);
    if seconds > MAX_SECONDS {
        return Err(NotCompared::Cost(seconds));
    }
    Ok((plane_case, plan))
}

/// Compression, capacitance (F) and its error (F) of a step, or its failure; `None` for a step that was
/// interrupted.
fn state(step: &StepResult) -> Option<Result<[f64; 3], StepFailure>> {
    if let Status::Failed(failure) = &step.row.status {
        return Some(Err((**failure).clone()));
    }
    let row = &step.row;
    let value = row.capacitance_f?;
    Some(Ok([row.compression?, value, row.error_in_model()? * value.abs()]))
}

/// Compression, parallel-plate capacitance (F) and its error (F) of a stacked pair at each step.
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

/// At most [`MAX_COMPRESSIONS`] of ascending compressions, including the last.
fn thinned(compressions: &[f64]) -> Vec<f64> {
    let count = compressions.len();
    (0..count)
        .filter(|k| {
            count <= MAX_COMPRESSIONS || (k + 1) * MAX_COMPRESSIONS / count > k * MAX_COMPRESSIONS / count
        })
        .map(|k| compressions[k])
        .collect()
}

/// The case with its layer in plane strain under a plate as long as the contact, at rest and at these
/// compressions.
fn plane_strain(case: &Case, compressions: Vec<f64>) -> Result<Case, NotCompared> {
    // Bodies on the faces of the layer move the same in both models.
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
    let mut plane_case = case.clone();
    let (Some(Mechanics::ClosedForm { contact_half_length, contact_width, .. }), Some(layer), Some(settings)) =
        (case.mechanics, &mut plane_case.layer, &mut plane_case.electrostatics)
    else {
        return Err(NotCompared::Layer);
    };
    let in_layer = case.bodies.iter().filter(|body| body.purpose == Purpose::InLayer);
    let boxes = in_layer.flat_map(|body| body.boxes().unwrap_or_default());
    let regions = boxes.chain(case.electrodes.iter().flat_map(|pair| pair.regions()));
    let reach = regions.map(|region| region.max[0].max(-region.min[0])).fold(0.0, f64::max);
    layer.half_length = Some(contact_half_length.max(reach + BEYOND * layer.thickness));
    settings.relative_tolerance = settings.relative_tolerance.max(TOLERANCE);
    settings.change_tolerance = None;
    plane_case.mechanics = Some(Mechanics::PlaneStrain(PlaneStrain {
        indenter: Indenter::WholeTop,
        end: LayerEnd::FreeOnSubstrate,
        width: contact_width,
        relative_tolerance: FORCE_TOLERANCE,
    }));
    plane_case.load = Some(Load::Compression([vec![0.0], compressions].concat()));
    plane_case.poses = Vec::new();
    plane_case.measured_points = None;
    Ok(plane_case)
}

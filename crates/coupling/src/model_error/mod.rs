//! The error of a capacitance that is due to the mechanical model of the layer.
//!
//! The closed form of the paper and plane strain each neglect effects that the next better model includes:
//! plane strain resolves the electrodes as stiffer inclusions, the ends of the layer, and the bulging beside
//! the indenter; in three dimensions the rubber also moves along x3. The effect on a capacitance is computed
//! where that costs little. Otherwise it is estimated as a share of the change of the capacitance, by tables
//! of such comparisons (`benches/model_errors.py`, docs/trust.md). Finite elements in three dimensions have
//! no better model here: their error is zero.

mod force;
mod plane;
mod shares;

use elastocap_case::{Case, Mechanics};

use crate::deform::ContactPunch;
use crate::deform::foam::Foam;
use crate::load_steps::StepLoad;
use crate::outcome::{Status, StepResult};
use crate::plan::{Options, Plan};
pub(crate) use plane::{NotCompared, PlaneStrainCurve};
use shares::Shares;

/// The source of a model error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    /// The better model, at loads of this run.
    Computed,
    /// Tables of other scenes.
    Estimated,
}

/// The change of a capacitance from rest by plane strain, with its error, F.
#[derive(Debug, Clone, Copy)]
struct InPlane {
    change: f64,
    error: f64,
    source: Source,
}

/// Whether a run compares the closed form of this case with plane strain.
pub(crate) fn is_compared(case: &Case, options: &Options) -> bool {
    options.model_error && matches!(case.mechanics, Some(Mechanics::ClosedForm { .. }))
}

/// Adds the time and the memory of the comparison with plane strain to the forecast of a plan, after
/// [`Plan::forecast`].
pub fn add_forecast(case: &Case, options: &Options, plan: &mut Plan) {
    if !is_compared(case, options) {
        return;
    }
    let loads = plan.distinct_steps().map(|step| step.load);
    // A comparison that is refused costs nothing, and the run says why.
    let Ok((_, plane)) = plane::comparison(case, loads) else { return };
    let layer = plane.layer.as_ref();
    plan.seconds += plane.seconds + layer.map_or(0.0, |layer| layer.seconds);
    let memory = plane.memory_bytes.saturating_add(layer.map_or(0, |layer| layer.usual_memory_bytes));
    plan.memory_bytes = plan.memory_bytes.max(memory);
}

/// Writes the error of the model, and the sum of all errors, to every row. `better` is the plane-strain
/// solution of a closed-form layer, or the reason that there is none, where one was tried. Returns warnings
/// for the user.
pub(crate) fn note_model_errors(
    case: &Case,
    better: Option<&Result<PlaneStrainCurve, NotCompared>>,
    steps: &mut [StepResult],
) -> Vec<String> {
    let tolerance = case.electrostatics.map_or(f64::INFINITY, |settings| settings.relative_tolerance);
    let shares = Shares::of(case);
    for step in steps.iter_mut() {
        step.row.force_error_estimate = force::force_error(case, shares, step);
    }
    let errors = errors(case, shares, better.and_then(|better| better.as_ref().ok()), steps);
    let mut worst: Option<(f64, Source)> = None;
    for (step, found) in steps.iter_mut().zip(errors) {
        let row = &mut step.row;
        let Some(value) = row.capacitance_f else { continue };
        let error = found.map_or(0.0, |(error, _)| error / value.abs());
        row.model_error_estimate = Some(error).filter(|error| error.is_finite());
        row.total_error_estimate = row.total_error();
        let total = row.total_error_estimate.unwrap_or(0.0);
        if error > 0.0 && total > tolerance && matches!(row.status, Status::Ok | Status::OkToDiagonal) {
            row.status = Status::OkInModel;
        }
        if let Some((_, source)) = found.filter(|_| error > 0.0 && total > tolerance)
            && worst.is_none_or(|(before, _)| error > before)
        {
            worst = Some((error, source));
        }
    }
    note_change_totals(steps);
    let why = better.and_then(|better| better.as_ref().err());
    worst.map(|(error, source)| warning(case, error, source, why)).into_iter().collect()
}

/// Writes the largest distance of each change from the true one, from its bounds and all estimated errors of
/// both capacitances.
fn note_change_totals(steps: &mut [StepResult]) {
    let Some(first) = steps.first().map(|step| step.row.clone()) else { return };
    for row in steps.iter_mut().map(|step| &mut step.row) {
        let limits = row.change_limits(&first).zip(row.change_f);
        row.change_total_error_f =
            limits.map(|([lower, upper], change)| (upper - change).max(change - lower));
    }
}

/// The error of the capacitance of each step that is due to the model, F, with its source; `None` for a step
/// without a better model.
fn errors(
    case: &Case,
    shares: Option<Shares>,
    better: Option<&PlaneStrainCurve>,
    steps: &[StepResult],
) -> Vec<Option<(f64, Source)>> {
    let (Some(_), Some(shares)) = (&case.load, shares) else {
        return vec![None; steps.len()];
    };
    if let Some(foam) = Foam::of(case) {
        let of_foam = |step: &StepResult| {
            let error = foam.error_of_free_sides(case, step.load)? * step.row.capacitance_f?.abs();
            Some((error, Source::Estimated))
        };
        return steps.iter().map(of_foam).collect();
    }
    let at_rest = steps.iter().rev().find(|step| step.load.is_zero()).map(|step| &step.row);
    // Without a step at rest, a relative decrease of 1.5 times the compression is assumed.
    let change = |step: &StepResult| {
        let value = step.row.capacitance_f?;
        let compression = step.row.compression.unwrap_or(0.0);
        let rest = at_rest.and_then(|row| row.capacitance_f);
        Some(rest.map_or(-1.5 * compression * value, |rest| value - rest))
    };
    let is_closed_form = matches!(case.mechanics, Some(Mechanics::ClosedForm { .. }));
    let compared = |step: &StepResult, change: f64| {
        better?.change(compared_at(case, step.load)?, &step.row, at_rest?, change)
    };
    // Beyond the loads at which the two models were compared, their ratio is taken to stay that at the
    // largest of these.
    let ratio = steps.iter().filter(|step| !step.load.is_zero()).filter_map(|step| {
        let closed_form = change(step)?;
        let [plane, error] = compared(step, closed_form)?;
        Some((step.row.compression?, plane / closed_form, error / closed_form.abs()))
    });
    let last = ratio
        .filter(|(_, ratio, error)| ratio.is_finite() && error.is_finite())
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let in_plane = |step: &StepResult, solved: f64| -> InPlane {
        if !is_closed_form {
            return InPlane { change: solved, error: 0.0, source: Source::Estimated };
        }
        if let Some([change, error]) = compared(step, solved) {
            return InPlane { change, error, source: Source::Computed };
        }
        match last {
            Some((_, ratio, error)) => InPlane {
                change: ratio * solved,
                error: 2.0 * error * solved.abs(),
                source: Source::Estimated,
            },
            None => {
                let of_force = match (step.load, step.force_check) {
                    (StepLoad::ForceN(_), Some(check)) => check.relative_difference.abs(),
                    (StepLoad::ForceN(_), None) => shares.closed_form_force,
                    (StepLoad::None | StepLoad::Compression(_), _) => 0.0,
                };
                let change = (1.0 + shares.closed_form) * solved;
                InPlane { change, error: of_force * solved.abs(), source: Source::Estimated }
            }
        }
    };
    let error = |step: &StepResult| {
        let solved = change(step)?;
        if step.load.is_zero() {
            return Some((0.0, Source::Estimated));
        }
        let InPlane { change, error, source } = in_plane(step, solved);
        // In three dimensions the change is that in plane strain or smaller, and under a force also larger.
        let more = match step.load {
            StepLoad::ForceN(_) => shares.in_plane_force,
            StepLoad::None | StepLoad::Compression(_) => 0.0,
        };
        let away = |share: f64| (solved - share * change).abs();
        let stretch = shares.of_stretch * step.row.compression.unwrap_or(0.0);
        let stretched = stretch * step.row.capacitance_f?.abs();
        Some((away(1.0 + more).max(away(1.0 - shares.in_plane)).max(stretched) + error, source))
    };
    steps.iter().map(error).collect()
}

/// The compression at which a closed-form step is compared with the better model: that of the step, or, where
/// its force is given, that at which a flat punch has the same force. `None` beyond the table of such
/// punches.
fn compared_at(case: &Case, load: StepLoad) -> Option<f64> {
    match load {
        load if load.is_zero() => Some(0.0),
        StepLoad::None => Some(0.0),
        StepLoad::Compression(compression) => Some(compression),
        StepLoad::ForceN(force) => ContactPunch::of(case)?.compression(force),
    }
}

fn warning(case: &Case, error: f64, source: Source, why: Option<&NotCompared>) -> String {
    if Foam::of(case).is_some() {
        return format!(
            "the foam is taken to get wider without resistance, and what holds it at its faces adds up to {error:.1e} to the relative error \
             of the capacitance, by the limit of a wide foam that gets no wider (`model_error_estimate`, which `total_error_estimate` \
             includes); [mechanics.plane_strain] or [mechanics.solid] solves for the bonded bottom"
        );
    }
    let advice = match &case.mechanics_chosen {
        Some(_) => "make what presses, and the pair, longer along x3, or name [mechanics.solid]",
        None => "`[mechanics.auto]` chooses a model that fits the scene",
    };
    let (model, how) = match (case.mechanics, source) {
        (Some(Mechanics::PlaneStrain(_)), _) => {
            ("plane strain", "a table of such comparisons with three dimensions")
        }
        (_, Source::Computed) => (
            "the closed form",
            "the same layer in plane strain, and a table of comparisons of that with three dimensions",
        ),
        (_, Source::Estimated) => {
            ("the closed form", "tables of comparisons with plane strain and three dimensions")
        }
    };
    let why = why.map_or_else(String::new, |why| format!("; the two are not compared here, because {why}"));
    format!(
        "{model} as a model of the layer adds up to {error:.1e} to the relative error of the capacitance, by {how} \
         (`model_error_estimate`, which `total_error_estimate` includes){why}; {advice}"
    )
}

//! The closed form with its shear length L, eq. (45), from finite elements.
//!
//! The layer is pressed by a sharp, smooth punch of the contact's half-length, and L follows from the balance
//! of the axial force, eq. (43): see [`elastocap_mechanics::solid::shear_length`]. L depends on the
//! compression, and is interpolated between the compressions at which it is computed.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::HyperelasticLaw;
use elastocap_mechanics::solid::forecast::MeshSize;
use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::shear_length::{Contact, ShearLengths, mesh_sizes, shear_lengths};
use elastocap_mechanics::{ClosedFormSettings, ForceLimit, LayerState, MechanicsError, MooneyRivlin};

use super::error::{DeformError, ShearLengthError};
use crate::load_steps::StepLoad;
use elastocap_case::{Case, Mechanics, ShearLength};

/// Number of quadrilaterals over the thickness. Measured:
/// `cargo run --release -p elastocap-mechanics --example shear_length -- 8`, and with 4 or 12.
const ELEMENTS: usize = 8;
/// Compressions at which L is computed in addition to those of the loads, up to the largest of these; all of
/// them if the loads are forces. It is not tuned.
const LADDER: [f64; 10] = [0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4];
/// Number of compressions at which the force is sampled to find its maximum. It is not tuned.
const SAMPLES: usize = 400;

/// The closed form at all loads, with L at each compression.
#[derive(Debug)]
pub struct ShearLengthRun {
    /// The layer at each load.
    pub states: Vec<Result<LayerState, DeformError>>,
    /// The maximum of the force, if it lies below the largest load.
    pub force_limit: Option<ForceLimit>,
}

struct Layer {
    thickness: f64,
    material: MooneyRivlin,
    contact_half_length: f64,
    contact_width: f64,
}

/// The meshes for the shear length, and the number of compressions; `None` where the case needs none.
///
/// # Errors
/// The contact cannot be meshed.
pub(crate) fn forecast(
    case: &Case,
    loads: &[StepLoad],
) -> Result<Option<(Vec<MeshSize>, usize)>, DeformError> {
    let (Some(layer), Some(_), Some(Mechanics::ClosedForm { contact_half_length, shear_length, .. })) =
        (&case.layer, &case.load, case.mechanics)
    else {
        return Ok(None);
    };
    if shear_length != ShearLength::FiniteElement || layer.has_foam_law() {
        return Ok(None);
    }
    let contact = Contact::Punch(contact_half_length / layer.thickness);
    let meshes = mesh_sizes(contact, End::Free, ELEMENTS)?;
    Ok(Some((meshes, compressions(loads).len())))
}

/// The compressions at which L is computed, ascending.
fn compressions(loads: &[StepLoad]) -> Vec<f64> {
    let by_force = loads.iter().any(|load| matches!(load, StepLoad::ForceN(_)));
    // Without load any L serves; that of a small load is used.
    let mut out: Vec<f64> = loads.iter().map(|load| compression_of(*load).max(LADDER[0])).collect();
    // The maximum of the force may lie below the compression of a given force.
    let largest = if by_force { f64::INFINITY } else { out.iter().copied().fold(0.0, f64::max) };
    out.extend(LADDER.into_iter().filter(|compression| *compression < largest));
    out.sort_by(f64::total_cmp);
    out.dedup();
    out
}

/// The layer at each load. `cancel` stops the work; loads that are not reached by then are errors.
pub(super) fn solve(case: &Case, loads: &[StepLoad], cancel: &AtomicBool) -> ShearLengthRun {
    let failed =
        |reason: DeformError| ShearLengthRun { states: vec![Err(reason); loads.len()], force_limit: None };
    let (Some(layer), Some(Mechanics::ClosedForm { contact_half_length, contact_width, .. })) =
        (&case.layer, case.mechanics)
    else {
        return failed(ShearLengthError::NoClosedForm.into());
    };
    let Some(material) = layer.material.as_ref().and_then(HyperelasticLaw::as_mooney_rivlin) else {
        return failed(ShearLengthError::Material.into());
    };
    let layer = Layer { thickness: layer.thickness, material, contact_half_length, contact_width };
    let contact = Contact::Punch(contact_half_length / layer.thickness);
    let found = match shear_lengths(contact, End::Free, &compressions(loads), ELEMENTS, Some(cancel)) {
        Ok(found) => found,
        Err(error) => return failed(error.into()),
    };
    let force_limit = layer.force_limit(&found);
    let states = loads.iter().map(|load| layer.state(*load, &found, force_limit)).collect();
    ShearLengthRun { states, force_limit }
}

fn compression_of(load: StepLoad) -> f64 {
    match load {
        StepLoad::Compression(compression) => compression,
        StepLoad::None | StepLoad::ForceN(_) => 0.0,
    }
}

impl Layer {
    fn state(
        &self,
        load: StepLoad,
        found: &ShearLengths,
        force_limit: Option<ForceLimit>,
    ) -> Result<LayerState, DeformError> {
        match load {
            StepLoad::None => self.at(0.0, found),
            StepLoad::Compression(compression) => self.at(compression, found),
            StepLoad::ForceN(force) => self.under(force, found, force_limit),
        }
    }

    /// The layer at a compression.
    fn at(&self, compression: f64, found: &ShearLengths) -> Result<LayerState, DeformError> {
        let settings = ClosedFormSettings {
            contact_half_length: self.contact_half_length,
            contact_width: self.contact_width,
            shear_length: self.thickness * length(compression.max(LADDER[0]), found)?,
        };
        Ok(LayerState::new(self.thickness, self.material, compression, settings)?)
    }

    /// The maximum of the force over the compression, as far as L is known; `None` if the force rises
    /// throughout.
    fn force_limit(&self, found: &ShearLengths) -> Option<ForceLimit> {
        let last = found.points.last()?.shear.compression;
        let force = |compression: f64| self.at(compression, found).map_or(f64::NAN, |state| state.force());
        let at = |sample: usize| last * sample as f64 / SAMPLES as f64;
        let mut before = 0.0;
        for sample in 1..=SAMPLES {
            let next = force(at(sample));
            if next <= before {
                let compression = largest_between(at(sample.saturating_sub(2)), at(sample), force);
                return Some(ForceLimit { compression, force: force(compression).max(0.0) });
            }
            before = next;
        }
        None
    }

    /// The layer under a force, by bisection between compressions at which L is known and the force rises.
    fn under(
        &self,
        force: f64,
        found: &ShearLengths,
        force_limit: Option<ForceLimit>,
    ) -> Result<LayerState, DeformError> {
        if force == 0.0 {
            return self.at(0.0, found);
        }
        if let Some(ForceLimit { compression, force: largest_force }) =
            force_limit.filter(|l| l.force < force)
        {
            return Err(MechanicsError::ForceOutOfReach { force, largest_force, compression }.into());
        }
        let known = found.points.last().map_or(0.0, |p| p.shear.compression);
        let last = force_limit.map_or(known, |limit| limit.compression);
        let most = self.at(last, found)?;
        if most.force() < force {
            let stopped = found.stopped.clone();
            return Err(ShearLengthError::Force { compression: last, force: most.force(), stopped }.into());
        }
        let (mut low, mut high) = (0.0, last);
        let mut state = most;
        while high - low > 1e-15 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            state = self.at(middle, found)?;
            if state.force() < force { low = middle } else { high = middle }
        }
        Ok(state)
    }
}

/// The maximiser of `f`, which has one maximum between `low` and `high`, by golden section.
fn largest_between(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    while high - low > 1e-9 {
        let (left, right) = (high - share * (high - low), low + share * (high - low));
        if f(left) < f(right) { low = left } else { high = right }
    }
    0.5 * (low + high)
}

/// L over the thickness at a compression, by the parabola through the three nearest known values.
fn length(compression: f64, found: &ShearLengths) -> Result<f64, ShearLengthError> {
    let known: Vec<(f64, f64)> =
        found.points.iter().filter_map(|p| Some((p.shear.compression, p.shear.from_balance?))).collect();
    if let Some((_, length)) = known.iter().find(|(c, _)| (c - compression).abs() < 1e-12) {
        return Ok(*length);
    }
    let reached = known.last().map_or(0.0, |k| k.0);
    if known.len() < 3 || compression > reached {
        return Err(ShearLengthError::Compression { compression, reached, stopped: found.stopped.clone() });
    }
    let after = known.partition_point(|k| k.0 < compression);
    let first = after.saturating_sub(2).min(known.len() - 3);
    let three = &known[first..first + 3];
    Ok((0..3)
        .map(|i| {
            let factor = |j: usize| (compression - three[j].0) / (three[i].0 - three[j].0);
            three[i].1 * (0..3).filter(|j| *j != i).map(factor).product::<f64>()
        })
        .sum())
}

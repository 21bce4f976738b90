//! The check of the closed form's force against finite elements of the same contact.

use elastocap_mechanics::ForceLimit;
use elastocap_mechanics::materials::MooneyRivlin;
use elastocap_mechanics::punch_force::{COMPRESSIONS, plate_force, punch_force};
use serde::Serialize;

use super::Deformation;
use elastocap_case::{Case, Mechanics};

/// Relative difference above which the user is warned.
const NOTABLE: f64 = 0.05;

/// The indenter with which a closed form is compared, by finite elements in plane strain: a frictionless flat
/// punch of the contact's half-length and width on a layer that extends beyond it, or a smooth plate over a
/// layer that ends with the contact. Both are tables: [`elastocap_mechanics::punch_force`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactPunch {
    /// The shear modulus times the thickness and the width, N.
    unit: f64,
    /// The half-length over the thickness.
    half_length: f64,
    /// Whether the layer ends with the contact, or less than a thickness beyond it.
    ends: bool,
    /// Whether the layer extends beyond the contact.
    extends_beyond: bool,
}

impl ContactPunch {
    /// The indenter of a closed-form case. `None` for other mechanics, and for materials outside the tables.
    pub(crate) fn of(case: &Case) -> Option<Self> {
        let Mechanics::ClosedForm { contact_half_length, contact_width, .. } = case.mechanics? else {
            return None;
        };
        let layer = case.layer.as_ref()?;
        let modulus = layer.material.as_ref()?.as_mooney_rivlin()?.shear_modulus();
        Some(Self {
            unit: modulus * layer.thickness * contact_width,
            half_length: contact_half_length / layer.thickness,
            ends: layer.half_length.is_some_and(|half| half < contact_half_length + layer.thickness),
            extends_beyond: layer.half_length.is_none_or(|half| half > contact_half_length * (1.0 + 1e-6)),
        })
    }

    /// The force at a compression U/H, N; `None` outside the tables.
    pub(crate) fn force(&self, compression: f64) -> Option<f64> {
        let table = if self.ends { plate_force } else { punch_force };
        Some(self.unit * table(self.half_length, compression)?)
    }

    /// The largest force at a compression, N: a short overhang beyond the contact may restrain the layer like
    /// a long one.
    pub(crate) fn largest_force(&self, compression: f64) -> Option<f64> {
        let force = self.force(compression)?;
        if !self.extends_beyond {
            return Some(force);
        }
        Some(force.max(self.unit * punch_force(self.half_length, compression)?))
    }

    fn name(&self) -> &'static str {
        if self.ends {
            "a smooth plate over a layer that ends with this contact"
        } else {
            "a flat punch without friction with this contact on a longer layer"
        }
    }

    /// The compression under a force, N; `None` beyond the table.
    pub(crate) fn compression(&self, force: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, COMPRESSIONS[COMPRESSIONS.len() - 1]);
        if self.force(high)? < force {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.force(middle)? < force { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    }
}

/// The force of the contact's area of rubber that slides on both faces and expands freely, N: a lower limit
/// for bonded layers. `None` for mechanics other than the closed form, and for laws other than Mooney-Rivlin.
pub(crate) fn uniaxial_force(case: &Case, compression: f64) -> Option<f64> {
    let Mechanics::ClosedForm { contact_half_length, contact_width, .. } = case.mechanics? else {
        return None;
    };
    let MooneyRivlin { c10, c01 } = case.layer.as_ref()?.material.as_ref()?.as_mooney_rivlin()?;
    let stretch = 1.0 - compression;
    let pressure = 2.0 * (c10 + c01 / stretch) * (stretch.powi(-2) - stretch);
    Some(2.0 * contact_half_length * contact_width * pressure)
}

/// The comparison of the closed form's force with finite elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ForceCheck {
    /// The force at the same compression by finite elements in plane strain, N: of a frictionless flat punch
    /// of the contact's half-length and width on a layer that extends beyond it, or of a smooth plate over a
    /// layer that ends with the contact. From tables: [`elastocap_mechanics::punch_force`].
    pub punch_force_n: f64,
    /// The closed form's force less `punch_force_n`, over `punch_force_n`.
    pub relative_difference: f64,
}

impl ForceCheck {
    /// The check of a closed-form layer under load; `None` for other layers, without load, and outside the
    /// tables.
    pub fn of(case: &Case, state: &Deformation<'_>) -> Option<Self> {
        let punch_force_n = ContactPunch::of(case)?.force(state.compression())?;
        (punch_force_n > 0.0).then(|| Self {
            punch_force_n,
            relative_difference: (state.force() - punch_force_n) / punch_force_n,
        })
    }
}

/// The warning that forces of the closed form differ notably, if any does; beyond `limit` there are no
/// forces.
pub(crate) fn force_warning(
    case: &Case,
    states: impl Iterator<Item = Deformation<'static>>,
    limit: Option<ForceLimit>,
) -> Option<String> {
    if case.is_foam() {
        return super::foam::force_warning(case, states);
    }
    let has_force =
        |state: &Deformation<'_>| limit.is_none_or(|limit| state.compression() <= limit.compression);
    let checks = states.filter(has_force).filter_map(|state| ForceCheck::of(case, &state));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for check in checks {
        (low, high) = (low.min(check.relative_difference), high.max(check.relative_difference));
    }
    if !(low < -NOTABLE || high > NOTABLE) {
        return None;
    }
    let share = |difference: f64| format!("{:+.0} %", 100.0 * difference);
    let range =
        if share(low) == share(high) { share(low) } else { format!("{} to {}", share(low), share(high)) };
    let punch = ContactPunch::of(case)?.name();
    Some(format!(
        "the force of the closed form differs by {range} from that of {punch}, by finite elements; result.json has both for each step, \
         docs/mechanics.md says why, and `[mechanics.plane_strain]` solves for it"
    ))
}

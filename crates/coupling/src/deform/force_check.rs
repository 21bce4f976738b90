//! How far the force of the closed form may be trusted: the same contact by finite elements.

use elastocap_mechanics::ForceLimit;
use elastocap_mechanics::punch_force::punch_force;
use serde::Serialize;

use super::Deformation;
use elastocap_case::{Case, Mechanics};

/// Relative difference from which it is said.
const NOTABLE: f64 = 0.05;

/// The closed form's force beside that of finite elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ForceCheck {
    /// Force of a flat punch without friction, of the contact's half-length and width, on a layer that goes on beyond it, at the same
    /// compression, N: from a table of finite elements in plane strain, see [`elastocap_mechanics::punch_force`].
    pub punch_force_n: f64,
    /// The closed form's force less that one, over that one.
    pub relative_difference: f64,
}

impl ForceCheck {
    /// Of a closed-form layer under load; `None` for other layers, without load, and outside the table.
    pub fn of(case: &Case, state: &Deformation<'_>) -> Option<Self> {
        let (Some(layer), Some(Mechanics::ClosedForm { contact_half_length, contact_width, .. })) =
            (&case.layer, case.mechanics)
        else {
            return None;
        };
        // A layer that ends under the contact has nothing beside it that holds the rubber back.
        if layer.half_length.is_some_and(|half| half < contact_half_length + layer.thickness) {
            return None;
        }
        let modulus = layer.material.as_ref()?.as_mooney_rivlin()?.shear_modulus();
        let unit = modulus * layer.thickness * contact_width;
        let punch_force_n = unit * punch_force(contact_half_length / layer.thickness, state.compression())?;
        (punch_force_n > 0.0).then(|| Self {
            punch_force_n,
            relative_difference: (state.force() - punch_force_n) / punch_force_n,
        })
    }
}

/// What the user should know of the closed form's forces, if any of them differs notably; beyond `limit` there are none.
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
    Some(format!(
        "the force of the closed form differs by {range} from that of a flat punch without friction with this contact on a \
         longer layer, by finite elements; result.json has both for each step, docs/mechanics.md says why, and \
         `[mechanics.plane_strain]` solves for such a punch"
    ))
}

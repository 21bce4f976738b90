//! The error of the force of a step at its compression.

use elastocap_case::{Case, Mechanics};

use super::shares::Shares;
use crate::deform::foam::Foam;
use crate::deform::{ContactPunch, uniaxial_force};
use crate::outcome::StepResult;

/// The relative error of the force of a step, from the finite elements and the model of the layer. `None`
/// without a force, or where one of the two errors is not known.
pub(super) fn force_error(case: &Case, shares: Option<Shares>, step: &StepResult) -> Option<f64> {
    let force = step.row.force_n?;
    if force == 0.0 {
        return Some(0.0);
    }
    // Rubber that also moves along x3 is softer.
    let of_plane = shares.map_or(0.0, |shares| shares.in_plane_force);
    let in_space = |in_plane: f64| in_plane / (1.0 + of_plane);
    match case.mechanics? {
        Mechanics::Solid(_) => step.layer.as_ref()?.relative_error_estimate,
        Mechanics::PlaneStrain(_) => {
            Some(step.layer.as_ref()?.relative_error_estimate? + 1.0 - in_space(1.0))
        }
        Mechanics::ClosedForm { .. } => {
            let compression = step.row.compression?;
            if let Some(foam) = Foam::of(case) {
                return Some((foam.force_between_walls(compression)? / force - 1.0).abs());
            }
            let punch = ContactPunch::of(case)?;
            let of_punch = punch.force(compression)?;
            // A layer that slides freely on its faces has the least force.
            let least = in_space(of_punch.min(force)).max(uniaxial_force(case, compression)?).min(force);
            let most = punch.largest_force(compression)? * (1.0 + shares?.of_force_by_pair);
            let most = most.max(force);
            Some((force - least).max(most - force) / force)
        }
    }
}

//! An evenly compressed foam layer, and its force law.

use elastocap_case::{Case, HyperelasticLaw, Mechanics};
use elastocap_mechanics::{FoamLaw, FoamState, MechanicsError};

use super::Deformation;
use crate::load_steps::StepLoad;
use crate::words::listed;

/// The foam of a case.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foam<'a> {
    thickness: f64,
    law: FoamLaw<'a>,
    /// The area of the contact before loading, m^2.
    area: f64,
}

/// Whether the layer of a case is a foam with a force law.
pub(crate) fn has_law(case: &Case) -> bool {
    case.layer.as_ref().is_some_and(|layer| layer.has_foam_law())
}

impl<'a> Foam<'a> {
    /// The foam of a case whose mechanics are the closed form; `None` for other layers.
    pub(crate) fn of(case: &'a Case) -> Option<Self> {
        let layer = case.layer.as_ref()?;
        let Mechanics::ClosedForm { contact_half_length, contact_width, .. } = case.mechanics? else {
            return None;
        };
        let law = match (&layer.stress_table, &layer.material) {
            (Some(table), _) => FoamLaw::Measured(table),
            (None, Some(HyperelasticLaw::Hyperfoam { terms })) => FoamLaw::Hyperfoam(terms),
            (None, _) => return None,
        };
        Some(Self { thickness: layer.thickness, law, area: 2.0 * contact_half_length * contact_width })
    }

    /// The foam under a load.
    ///
    /// # Errors
    /// The law refuses the load, for instance one beyond its table.
    pub(crate) fn state(&self, load: StepLoad) -> Result<FoamState, MechanicsError> {
        let Self { thickness, law, area } = *self;
        match load {
            StepLoad::None => FoamState::new(thickness, law, 0.0, area),
            StepLoad::Compression(compression) => FoamState::new(thickness, law, compression, area),
            StepLoad::ForceN(force) => FoamState::under_force(thickness, law, force, area),
        }
    }

    /// The force at a compression, N, if the foam cannot expand laterally; `None` beyond a table.
    pub(crate) fn force_between_walls(&self, compression: f64) -> Option<f64> {
        self.law.force_between_walls(compression, self.area)
    }

    /// The largest relative error of the capacitance between the faces of the foam due to its bonding. The
    /// evenly compressed foam expands laterally without resistance, and a wide foam between bonded faces does
    /// not expand. The true layer is between the two, whose permittivity over thickness is compared. `None`
    /// under a load that the law refuses.
    pub(crate) fn error_of_free_sides(&self, case: &Case, load: StepLoad) -> Option<f64> {
        let layer = case.layer.as_ref()?;
        let free = self.state(load).ok()?;
        if free.lateral_stretch() == 1.0 {
            return Some(0.0);
        }
        let compression = match load {
            StepLoad::ForceN(force) => self.law.compression_between_walls(force, self.area)?,
            StepLoad::None | StepLoad::Compression(_) => free.compression(),
        };
        let held = layer.foam.map(|foam| foam.relative_permittivity(1.0 - compression));
        let held = held.or(layer.relative_permittivity)? / (1.0 - compression);
        let sliding = layer.permittivity_at(free.compression())? / (1.0 - free.compression());
        Some((held / sliding - 1.0).abs())
    }
}

/// The warning about the force of a foam, if there is one: that a foam without a law has no force, or that
/// unloading differs from loading in a table.
pub(crate) fn force_warning<'a>(
    case: &Case,
    states: impl Iterator<Item = Deformation<'a>>,
) -> Option<String> {
    if case.lacks_force() {
        return Some(
            "no force is given: the material of this foam is that of a rubber; compressions are taken as they are, and the permittivity \
             follows from them. `[layer.material.hyperfoam]` or `[layer.material.foam_table]` gives a foam its force"
                .to_owned(),
        );
    }
    let unloading: Vec<String> = states
        .filter_map(|state| {
            let Deformation::Foam(state) = state else { return None };
            let force = state.unloading_force().filter(|force| *force != state.force())?;
            Some(format!(
                "{force:.4} N in place of {:.4} N at U/H = {:.4}",
                state.force(),
                state.compression()
            ))
        })
        .collect();
    (!unloading.is_empty()).then(|| {
        format!(
            "the forces are those of loading; where the load comes down from the end of the table, the foam takes {}, so that one force has \
             two compressions and the way back is not on the curve of this result",
            listed(&unloading)
        )
    })
}

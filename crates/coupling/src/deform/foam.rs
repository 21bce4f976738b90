//! A layer of foam that is compressed evenly, with its law of force.

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
    /// The contact before loading, m^2.
    area: f64,
}

/// Whether the layer of a case is a foam with a law of force.
pub(crate) fn has_law(case: &Case) -> bool {
    case.layer.as_ref().is_some_and(|layer| layer.has_foam_law())
}

impl<'a> Foam<'a> {
    /// The foam of a case whose mechanics are the closed form; `None` of other layers.
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
    /// A refusal of the law: of a load beyond its table, for instance.
    pub(crate) fn state(&self, load: StepLoad) -> Result<FoamState, MechanicsError> {
        let Self { thickness, law, area } = *self;
        match load {
            StepLoad::None => FoamState::new(thickness, law, 0.0, area),
            StepLoad::Compression(compression) => FoamState::new(thickness, law, compression, area),
            StepLoad::ForceN(force) => FoamState::under_force(thickness, law, force, area),
        }
    }

    /// The force at a compression where the faces hold the foam so that it gets no wider, N; `None` beyond a table.
    pub(crate) fn force_between_walls(&self, compression: f64) -> Option<f64> {
        self.law.force_between_walls(compression, self.area)
    }

    /// By how much the capacitance between the faces of the foam is off at most, relative to it, because the faces may hold the foam: the
    /// evenly compressed foam gets wider without resistance, and a wide one between faces that it sticks to gets no wider. The true layer is
    /// between the two, of which this compares the permittivity over the thickness. `None` under a load that the law refuses.
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
        let own = layer.permittivity_at(free.compression())? / (1.0 - free.compression());
        Some((held / own - 1.0).abs())
    }
}

/// The warning about the force of a foam, if there is one: that there is no force without a law, or the remark on the unloading of a table.
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

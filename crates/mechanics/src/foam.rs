//! A layer of foam that is compressed evenly: the same stretch everywhere, and no stress along the layer.
//!
//! The nominal stress is that of a test between plates that do not hold the foam: by the law of Ogden and
//! Storåkers with the lateral stretch at which the lateral stress vanishes, or by a table of such a test. The
//! force is that stress times the area of the contact.

use elastocap_materials::hyperfoam::{compression_under, pressed_between_walls, pressed_freely};
use elastocap_materials::stress_table::CompressionMatch;
use elastocap_materials::{HyperfoamTerm, StressTable};

use crate::error::{MechanicsError, require_positive};

/// The law that says how much stress a foam takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FoamLaw<'a> {
    /// The terms of the law of Ogden and Storåkers.
    Hyperfoam(&'a [HyperfoamTerm]),
    /// Measured stress over compression.
    Measured(&'a StressTable),
}

/// The foam in one load step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoamState {
    /// The thickness at rest, m.
    thickness: f64,
    /// `U/H`.
    compression: f64,
    /// The compressive force while the load grows, N.
    force: f64,
    /// The compressive force at the same compression while the load is taken off, N, if a table has it.
    unloading_force: Option<f64>,
    /// The stretch along the layer.
    lateral_stretch: f64,
}

impl FoamLaw<'_> {
    /// The compression `U/H` under this `force` (N) on `area` (m^2) if the foam cannot get wider, as in a
    /// wide layer between plates that it sticks to. `None` for a table, which does not say.
    pub fn compression_between_walls(&self, force: f64, area: f64) -> Option<f64> {
        match self {
            Self::Hyperfoam(terms) => {
                Some(compression_under(force / area, |c| pressed_between_walls(terms, c).nominal_pressure))
            }
            Self::Measured(_) => None,
        }
    }

    /// The force in N on `area` (m^2) at a compression `U/H` if the foam cannot get wider. A table gives the
    /// force that was measured, without such walls, and `None` beyond its end.
    pub fn force_between_walls(&self, compression: f64, area: f64) -> Option<f64> {
        let pressure = match self {
            Self::Hyperfoam(terms) => pressed_between_walls(terms, compression).nominal_pressure,
            Self::Measured(table) => table.loading_at(compression)?,
        };
        Some(area * pressure)
    }
}

impl FoamState {
    /// The foam of reference `thickness` (m) under a `compression` `U/H` in `[0, 1)`, pressed over an `area`
    /// at rest in m^2.
    ///
    /// # Errors
    /// [`MechanicsError::NotPositive`], [`MechanicsError::Compression`], and [`MechanicsError::BeyondTable`].
    pub fn new(
        thickness: f64,
        law: FoamLaw<'_>,
        compression: f64,
        area: f64,
    ) -> Result<Self, MechanicsError> {
        let thickness = require_positive("thickness of the layer", thickness, "m")?;
        let area = require_positive("area of the contact", area, "m^2")?;
        if !(0.0..1.0).contains(&compression) {
            return Err(MechanicsError::Compression { compression });
        }
        let (lateral_stretch, stress, unloading) = match law {
            FoamLaw::Hyperfoam(terms) => {
                let pressed = pressed_freely(terms, compression);
                (pressed.lateral_stretch, pressed.nominal_pressure, None)
            }
            FoamLaw::Measured(table) => {
                let stress = table.loading_at(compression).ok_or(MechanicsError::BeyondTable {
                    compression,
                    last_compression: table.last_compression(),
                })?;
                (1.0, stress, table.unloading_at(compression))
            }
        };
        Ok(Self {
            thickness,
            compression,
            force: area * stress,
            unloading_force: unloading.map(|stress| area * stress),
            lateral_stretch,
        })
    }

    /// The foam of reference `thickness` (m) under a compressive `force` (N) on an `area` at rest in m^2, as
    /// it is loaded.
    ///
    /// # Errors
    /// [`MechanicsError::Force`], [`MechanicsError::BeyondTableForce`], [`MechanicsError::Plateau`], and as
    /// [`FoamState::new`].
    pub fn under_force(
        thickness: f64,
        law: FoamLaw<'_>,
        force: f64,
        area: f64,
    ) -> Result<Self, MechanicsError> {
        let area = require_positive("area of the contact", area, "m^2")?;
        if !(force >= 0.0 && force.is_finite()) {
            return Err(MechanicsError::Force { force });
        }
        let compression = match law {
            _ if force == 0.0 => 0.0,
            FoamLaw::Hyperfoam(terms) => {
                compression_under(force / area, |c| pressed_freely(terms, c).nominal_pressure)
            }
            FoamLaw::Measured(table) => match table.compression_under(force / area) {
                CompressionMatch::At(compression) => compression,
                CompressionMatch::Between([from, to]) => {
                    return Err(MechanicsError::Plateau { force, from, to });
                }
                CompressionMatch::Beyond => {
                    let largest_force = area * table.last_stress();
                    let last_compression = table.last_compression();
                    return Err(MechanicsError::BeyondTableForce { force, largest_force, last_compression });
                }
            },
        };
        Ok(Self { force, ..Self::new(thickness, law, compression, area)? })
    }

    /// Compression `U/H`, without unit.
    pub fn compression(&self) -> f64 {
        self.compression
    }

    /// Displacement `U` of the top surface towards the substrate, in m.
    pub fn top_displacement(&self) -> f64 {
        self.thickness * self.compression
    }

    /// Deformed thickness `H - U` in m.
    pub fn deformed_thickness(&self) -> f64 {
        self.thickness - self.top_displacement()
    }

    /// Compressive force in N while the load grows.
    pub fn force(&self) -> f64 {
        self.force
    }

    /// Compressive force in N at this compression while the load is taken off, where a table has it.
    pub fn unloading_force(&self) -> Option<f64> {
        self.unloading_force
    }

    /// Stretch along the layer; 1 for a table, which does not say.
    pub fn lateral_stretch(&self) -> f64 {
        self.lateral_stretch
    }
}

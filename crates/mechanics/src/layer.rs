//! One load step of the layer: deformation, stress, force and poses of electrodes.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use crate::closed_form::{ClosedFormSettings, ForceCurve, LayerMap, LayerStress, shear_stiffness};
use crate::electrode::{ElectrodePose, ElectrodeStiffness};
use crate::error::MechanicsError;
use crate::inverse::phase_for_force;
use elastocap_materials::MooneyRivlin;

/// The layer in one load step: its deformation, its stress, the force on it and the poses of electrodes in
/// it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerState {
    /// The stress, which contains the deformation.
    stress: LayerStress,
    rubber: MooneyRivlin,
    /// The area of the contact before loading, m^2.
    contact_area: f64,
    /// Compressive force of the punch, N.
    force: f64,
}

impl LayerState {
    /// The layer of reference `thickness` `H` (m) under a `compression` `U/H` in `[0, 1)`.
    ///
    /// The force is that of equation (50) at any compression; beyond
    /// [`crate::force_limit`] it has no meaning.
    ///
    /// # Errors
    /// [`MechanicsError::NotPositive`] for the thickness, the rubber's shear modulus or a length of the
    /// settings, [`MechanicsError::Compression`], and [`MechanicsError::ForceDoesNotRise`] if the contact is
    /// too long for the shear length.
    pub fn new(
        thickness: f64,
        rubber: MooneyRivlin,
        compression: f64,
        settings: ClosedFormSettings,
    ) -> Result<Self, MechanicsError> {
        let curve = settings.force_curve(thickness, rubber)?;
        Self::with_map(LayerMap::new(thickness, compression)?, rubber, settings, &curve)
    }

    /// The layer of reference `thickness` `H` (m) under a compressive `force` (N).
    ///
    /// # Errors
    /// As [`LayerState::new`] and [`crate::compression_for_force`].
    pub fn under_force(
        thickness: f64,
        rubber: MooneyRivlin,
        force: f64,
        settings: ClosedFormSettings,
    ) -> Result<Self, MechanicsError> {
        let curve = settings.force_curve(thickness, rubber)?;
        let phase = phase_for_force(&curve, force)?;
        Self::with_map(LayerMap::from_phase(thickness, phase), rubber, settings, &curve)
    }

    /// The layer under the deformation `map`, with the force on `curve`.
    fn with_map(
        map: LayerMap,
        rubber: MooneyRivlin,
        settings: ClosedFormSettings,
        curve: &ForceCurve,
    ) -> Result<Self, MechanicsError> {
        Ok(Self {
            stress: LayerStress::new(map, rubber, settings.shear_length)?,
            rubber,
            contact_area: 2.0 * settings.contact_half_length * settings.contact_width,
            force: curve.force(map.phase()),
        })
    }

    /// The deformation of the layer.
    pub fn map(&self) -> &LayerMap {
        self.stress.map()
    }

    /// The stress in the layer.
    pub fn stress(&self) -> &LayerStress {
        &self.stress
    }

    /// Compression `U/H`, without unit.
    pub fn compression(&self) -> f64 {
        self.map().compression()
    }

    /// Displacement `U` of the top surface towards the substrate, in m; never negative.
    pub fn top_displacement(&self) -> f64 {
        self.map().top_displacement()
    }

    /// Deformed thickness `h = H - U` in m.
    pub fn deformed_thickness(&self) -> f64 {
        self.map().deformed_thickness()
    }

    /// Force of the punch on the layer in N, positive in compression: minus the `F` of equation (50).
    pub fn force(&self) -> f64 {
        self.force
    }

    /// The horizontal force in N, along `x1` and `x3`, that shifts a plate with the area of the contact by
    /// `shift` (m) along these axes. The plate is bonded to the compressed layer: simple shear. Without
    /// compression it is too stiff by about a quarter of the thickness over the contact's length, because its
    /// free ends do not shear; more so with it (`docs/mechanics.md`).
    ///
    /// `None` along `x3` where the rubber does not resist that shear: one of its constants is negative then,
    /// and the layer stretched.
    pub fn shear_force(&self, shift: [f64; 2]) -> [Option<f64>; 2] {
        let (along1, along3) = shear_stiffness(self.map(), self.rubber, self.contact_area);
        let force = |stiffness: f64, shift: f64| if shift == 0.0 { 0.0 } else { stiffness * shift };
        let along3 = if shift[1] == 0.0 { Some(0.0) } else { along3.map(|k| force(k, shift[1])) };
        [Some(force(along1, shift[0])), along3]
    }

    /// The pose of an electrode whose mid-plane is at reference height `reference_height` `S` (m).
    ///
    /// # Errors
    /// As [`ElectrodePose::new`].
    pub fn electrode_pose(
        &self,
        reference_height: f64,
        stiffness: ElectrodeStiffness,
    ) -> Result<ElectrodePose, MechanicsError> {
        ElectrodePose::new(self.map(), self.rubber.shear_modulus(), reference_height, stiffness)
    }
}

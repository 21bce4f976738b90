//! The results for a layer in an equilibrium.

use super::newton::{Effort, NewtonSettings};

/// One step of a pressed layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerStep {
    /// Displacement of the indenter over the thickness.
    pub compression: f64,
    /// Force of the indenter on the *whole* layer, including the parts that are not modelled for symmetry, in
    /// N, positive in compression; in the plane in N per metre of width.
    pub force: f64,
    /// Force that the substrate carries by contact beyond the bonded bottom, of the whole layer, in N or N/m.
    pub end_contact_force: f64,
    /// Sum of all vertical forces on the layer over the largest of them.
    pub imbalance: f64,
    /// Deepest penetration of a contact point into an obstacle in m, at least 0.
    pub penetration: f64,
    /// The work spent on the step.
    pub effort: Effort,
}

impl LayerStep {
    /// Whether the force of the step is `target` (N, in the plane N per metre of width).
    pub(super) fn meets(&self, target: f64, settings: &NewtonSettings) -> bool {
        (self.force - target).abs() <= settings.force_tolerance() * target.abs()
    }
}

//! Settings of a run for its field solves, whichever solver they go to.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_electrostatics::{Foresight, Settings, Target, TetrahedraSettings};

use crate::shared_fields::SharedFields;

/// The settings of all field solves of a run. Each solver takes its own settings from them: [`FieldSettings::boxes`] and
/// [`FieldSettings::tetrahedra`].
#[derive(Debug, Clone)]
pub struct FieldSettings {
    /// Largest relative spread (upper - lower) / value of the target; without bounds, largest relative error estimate.
    pub relative_tolerance: f64,
    /// The scale, F, that the spread of smaller capacitances is compared with: see [`Settings::least_scale`].
    pub least_scale: f64,
    /// The spread that is accepted as well, over the tolerance: see [`Settings::accepted`].
    pub accepted: f64,
    /// The capacitances that the tolerance is for.
    pub target: Target,
    /// Whether nothing but the target is wanted: see [`Settings::target_alone`].
    pub target_alone: bool,
    /// Whether a lower bound is proved as well. The solver on tetrahedra always does.
    pub bounds: bool,
    /// Whether mirror symmetry is used to solve a part of the scene only.
    pub symmetry: bool,
    /// Whether the potential is kept for export.
    pub field: bool,
    /// Where the load acts, [x1, x3] in m: see [`Settings::loaded_at`].
    pub loaded_at: Option<[f64; 2]>,
    /// Order of the potentials on tetrahedra, 1 to 3. The box solver chooses its own.
    pub tetrahedra_order: usize,
    /// Findings of a solve to another tolerance.
    pub foresight: Option<Foresight>,
    /// Largest memory one solve may take, bytes.
    pub memory_limit: u64,
    /// Set from outside to stop at the next opportunity.
    pub cancel: Option<Arc<AtomicBool>>,
    /// Fields that other cases have solved already, for scenes of boxes.
    pub shared: Option<Arc<SharedFields>>,
}

impl Default for FieldSettings {
    fn default() -> Self {
        let Settings {
            relative_tolerance,
            least_scale,
            accepted,
            target,
            target_alone,
            bounds,
            symmetry,
            field,
            loaded_at,
            foresight,
            memory_limit,
            cancel,
            resolution: _,
        } = Settings::default();
        let tetrahedra_order = TetrahedraSettings::USUAL_ORDER;
        Self {
            relative_tolerance,
            least_scale,
            accepted,
            target,
            target_alone,
            bounds,
            symmetry,
            field,
            loaded_at,
            foresight,
            tetrahedra_order,
            memory_limit,
            cancel,
            shared: None,
        }
    }
}

impl FieldSettings {
    /// For the box solver, which chooses order and grading of its grid.
    pub fn boxes(&self) -> Settings {
        Settings {
            relative_tolerance: self.relative_tolerance,
            least_scale: self.least_scale,
            accepted: self.accepted,
            target: self.target,
            target_alone: self.target_alone,
            bounds: self.bounds,
            symmetry: self.symmetry,
            resolution: None,
            field: self.field,
            loaded_at: self.loaded_at,
            foresight: self.foresight,
            memory_limit: self.memory_limit,
            cancel: self.cancel.clone(),
        }
    }

    /// For the solver on tetrahedra.
    pub fn tetrahedra(&self) -> TetrahedraSettings {
        TetrahedraSettings {
            relative_tolerance: self.relative_tolerance,
            least_scale: self.least_scale,
            target: self.target,
            order: self.tetrahedra_order,
            memory_limit: self.memory_limit,
            cancel: self.cancel.clone(),
        }
    }
}

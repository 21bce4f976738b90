//! The settings of a run for its field solves, common to all solvers.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_electrostatics::{Foresight, Settings, Target, TetrahedraSettings};

use crate::shared_fields::SharedFields;

/// A change whose bounds include zero counts as none where they are at most this far apart, relative to the
/// capacitance of the first step.
pub const NO_CHANGE: f64 = 1e-6;

/// The settings of all field solves of a run, from which those of each solver follow:
/// [`FieldSettings::boxes`] and [`FieldSettings::tetrahedra`].
#[derive(Debug, Clone)]
pub struct FieldSettings {
    /// Largest relative spread (upper - lower) / value of the target; without bounds, largest relative error
    /// estimate.
    pub relative_tolerance: f64,
    /// The scale, F, that the spread of smaller capacitances is compared with: see [`Settings::least_scale`].
    pub least_scale: f64,
    /// The spread at which a solve may stop, over the tolerance: see [`Settings::accepted`].
    pub accepted: f64,
    /// The capacitances to which the tolerance applies.
    pub target: Target,
    /// Whether only the target is computed: see [`Settings::target_alone`].
    pub target_alone: bool,
    /// Whether a lower bound is proved as well. The solver on tetrahedra always proves one.
    pub bounds: bool,
    /// Whether mirror symmetry is used to solve only a part of the scene.
    pub symmetry: bool,
    /// Whether the potential is kept for export.
    pub field: bool,
    /// The place of the load, [x1, x3] in m: see [`Settings::loaded_at`].
    pub loaded_at: Option<[f64; 2]>,
    /// Order of the potentials on tetrahedra, 1 to 3. The box solver chooses the order itself.
    pub tetrahedra_order: usize,
    /// The results of a solve to another tolerance from which a solve may start.
    pub foresight: Option<Foresight>,
    /// Memory limit of one solve, bytes.
    pub memory_limit: u64,
    /// Stops a solve at the next opportunity when set.
    pub cancel: Option<Arc<AtomicBool>>,
    /// Solutions that are shared with other cases, for scenes of boxes.
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
    /// The settings of the box solver, which chooses the order and grading of its grid.
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

    /// The settings of the solver on tetrahedra.
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

//! The plan of a run before anything is solved: its work, omitted work with the reasons, and the forecast of
//! memory and time.

mod boxes;
mod electrostatics;
mod forecast;
mod layer;
mod savings;
mod steps;

use elastocap_case::Case;
use elastocap_mechanics::ForceLimit;
use serde::Serialize;

pub use electrostatics::MEASURED;
pub use layer::{HELD_PATCH, LayerForecast};
pub use savings::{Decision, LeftOut};
pub use steps::PlannedStep;

use crate::memory::max_memory;
use crate::settings::FieldSettings;
use crate::terminals::target;
use crate::view::loaded_at;
use steps::planned_steps;

/// The output that a run should produce besides the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Whether work that the scene does not need is omitted. The numbers do not depend on it.
    pub prune: bool,
    /// Whether the fields are wanted, as one `.vtu` per step.
    pub fields: bool,
    /// Whether `scene.glb` is wanted.
    pub scene: bool,
    /// Whether a simple model of the layer is compared with the next better one where that costs little.
    /// Otherwise their difference is estimated.
    pub model_error: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { prune: true, fields: true, scene: true, model_error: true }
    }
}

/// The work of a run, in its order, and the work that is omitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// The kind of result that the case asks for.
    pub kind: Kind,
    /// The load steps in the order of the case; a case without load has one step.
    pub steps: Vec<PlannedStep>,
    /// The parts that are solved and written.
    pub solved: Vec<Planned>,
    /// The parts that are omitted, with the reasons.
    pub left_out: Vec<LeftOut>,
    /// Unknowns of the largest problem, primal plus dual; 0 if there is no field problem.
    pub unknowns: usize,
    /// Peak memory of the field solves, bytes: an upper estimate.
    pub memory_bytes: u64,
    /// Expected seconds of all field solves on two cores.
    pub seconds: f64,
    /// The forecast for the layer's finite elements; `None` without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerForecast>,
    /// Mirror planes used, by axis.
    pub mirrored: [bool; 3],
    /// Largest number of field problems that are solved at the same time.
    pub at_once: usize,
    /// Warnings for the user before the run.
    pub warnings: Vec<String>,
    /// Memory limit of all field solves together, bytes.
    #[serde(skip)]
    pub memory_limit: u64,
    /// The number of solves among which `memory_limit` is divided.
    #[serde(skip)]
    pub memory_shares: u64,
    /// Memory limit of the finite elements of the layer, bytes.
    #[serde(skip)]
    pub layer_memory_limit: u64,
    /// The limit of the force formula of the closed form, equation (50) of the paper.
    #[serde(skip)]
    pub force_limit: Option<ForceLimit>,
    /// Whether work that the scene does not need is omitted.
    pub pruned: bool,
    /// Whether the forecast of a field is a rough one.
    #[serde(skip)]
    pub is_rough: bool,
}

/// The kind of result that a case asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Capacitance against load.
    Curve,
    /// The capacitances of a scene without load.
    Capacitance,
    /// Force against compression, without conductors.
    Mechanics,
}

/// A part of the work that is done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    /// Mechanics, electrostatics, or files.
    pub part: &'static str,
    /// A description of the work.
    pub what: String,
}

impl Plan {
    /// Plans a case. Nothing is solved but the closed-form mechanics, which takes microseconds.
    pub fn new(case: &Case, options: &Options) -> Self {
        let steps = planned_steps(case, options);
        let kind = match (&case.load, case.has_conductors()) {
            (Some(_), true) => Kind::Curve,
            (None, _) => Kind::Capacitance,
            (Some(_), false) => Kind::Mechanics,
        };
        let mut plan = Self {
            kind,
            steps,
            solved: Vec::new(),
            left_out: Vec::new(),
            unknowns: 0,
            memory_bytes: 0,
            seconds: 0.0,
            layer: None,
            mirrored: [false; 3],
            at_once: 1,
            warnings: Vec::new(),
            memory_limit: FieldSettings::default().memory_limit,
            memory_shares: 1,
            layer_memory_limit: max_memory(),
            force_limit: None,
            pruned: options.prune,
            is_rough: false,
        };
        plan.mechanics(case);
        plan.electrostatics(case, options);
        plan.neutral_bodies(case, options);
        plan.repeated_steps();
        plan.measured_points(case);
        plan
    }

    /// The settings of every field solve of the case.
    pub fn solver_settings(&self, case: &Case, options: &Options) -> FieldSettings {
        let given = case.electrostatics;
        let usual = FieldSettings::default();
        let absolute = given.and_then(|e| Some(e.absolute_tolerance? / e.relative_tolerance));
        FieldSettings {
            relative_tolerance: given.map_or(usual.relative_tolerance, |e| e.relative_tolerance),
            least_scale: absolute.unwrap_or(usual.least_scale),
            bounds: given.map_or(usual.bounds, |e| e.bounds),
            target: target(case),
            symmetry: options.prune,
            // Without pruning the fields are computed even if no files are requested.
            field: options.fields || !options.prune,
            loaded_at: loaded_at(case),
            foresight: None,
            target_alone: false,
            accepted: usual.accepted,
            memory_limit: self.memory_limit / self.memory_shares,
            tetrahedra_order: given.and_then(|e| e.order).map_or(usual.tetrahedra_order, usize::from),
            cancel: None,
            shared: None,
        }
    }

    fn measured_points(&mut self, case: &Case) {
        if let Some(measured) = &case.measured_points {
            let (count, load) = (measured.points.len(), measured.load.name());
            let what = format!("{count} points by {load} from `{}` are drawn over the curve", measured.file);
            self.solved.push(Planned { part: "points", what });
        }
    }
}

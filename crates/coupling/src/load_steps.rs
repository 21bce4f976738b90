//! The load of a step.

use elastocap_case::{Case, Load};
use serde::Serialize;

/// The load of one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepLoad {
    /// No load.
    None,
    /// The compression U/H.
    Compression(f64),
    /// The compressive force, N.
    ForceN(f64),
}

impl StepLoad {
    /// The loads of a case in order; a case without load has one step.
    pub fn all_of(case: &Case) -> Vec<Self> {
        match &case.load {
            None => vec![Self::None],
            Some(Load::Compression(steps)) => steps.iter().map(|c| Self::Compression(*c)).collect(),
            Some(Load::Force(steps)) => steps.iter().map(|f| Self::ForceN(*f)).collect(),
        }
    }

    /// Bits by which to compare the loads of one case, which are all compressions or all forces: they are
    /// equal for equal loads only.
    pub(crate) fn bits(self) -> u64 {
        match self {
            Self::None => 0,
            Self::Compression(x) | Self::ForceN(x) => (x + 0.0).to_bits(),
        }
    }

    /// Whether the layer is undeformed: there is no load, or a load of zero.
    pub fn is_zero(self) -> bool {
        match self {
            Self::None => true,
            Self::Compression(x) | Self::ForceN(x) => x == 0.0,
        }
    }
}

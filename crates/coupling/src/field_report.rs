//! The report of a step's field solve besides its capacitances: floating potentials, solver statistics and
//! times.

use elastocap_electrostatics::{Bounded, Discretisation, PhaseSeconds};
use serde::{Deserialize, Serialize};

/// A floating conductor and its potential: the sum over the driven conductors of `per_volt` times their
/// potentials, plus `from_charges`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FloatingConductor {
    /// The name of the conductor.
    pub name: String,
    /// The charge, C.
    pub charge: f64,
    /// The potential with 1 V on one driven conductor, 0 V on the others and no charge on any floating one,
    /// for each driven conductor in the order of
    /// [`Outcome::conductors`](crate::outcome::Outcome::conductors), V/V.
    pub per_volt: Vec<Bounded>,
    /// The potential with the charges of the case on the floating conductors and 0 V on all driven ones, V.
    pub from_charges: Bounded,
}

/// The statistics of a field solve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverReport {
    /// Iterations of all solves on the final grid.
    pub iterations: usize,
    /// Number of grids or meshes, including the final one.
    pub grids: usize,
    /// The final grid: its largest order and number of layers; on tetrahedra the order, and the number of
    /// refinements of the first mesh.
    pub resolution: Discretisation,
    /// Mirror planes used, by axis; those of the rotated scene where it was rotated.
    pub mirrored: [bool; 3],
    /// Angle in degrees by which the scene was rotated about the axis of its outlines, if that gave it more
    /// mirror planes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turned_degrees: Option<f64>,
    /// Share of the lower bound that the repair of the divergence took.
    pub repair_share: f64,
}

/// Wall-clock seconds of one step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct StepSeconds {
    /// The layer and the electrodes.
    pub mechanics: f64,
    /// The field, by phase.
    pub electrostatics: PhaseSeconds,
    /// The whole step.
    pub total: f64,
}

//! The report of a step's field solve besides its capacitances: floating potentials, how the field was solved, where the time went.

use elastocap_electrostatics::{Bounded, Discretisation, PhaseSeconds};
use serde::{Deserialize, Serialize};

/// A floating conductor and its potential: the sum over the driven conductors of `per_volt` times their potentials, plus
/// `from_charges`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FloatingConductor {
    /// Its name.
    pub name: String,
    /// Its charge, C.
    pub charge: f64,
    /// Its potential with 1 V on one driven conductor, 0 V on the others and no charge on any floating one, for each driven
    /// one in the order of [`Outcome::conductors`](crate::outcome::Outcome::conductors), V/V.
    pub per_volt: Vec<Bounded>,
    /// Its potential with the charges of the case on the floating conductors and 0 V on all driven ones, V.
    pub from_charges: Bounded,
}

/// How a field was solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverReport {
    /// Iterations of all solves on the final grid.
    pub iterations: usize,
    /// Grids or meshes solved on, the final one included.
    pub grids: usize,
    /// The final grid, by its largest order and number of layers; on tetrahedra the order, and how often the first mesh was
    /// refined.
    pub resolution: Discretisation,
    /// Mirror planes used, by axis; of the turned scene where it was turned.
    pub mirrored: [bool; 3],
    /// By how many degrees the scene was turned about the axis of its outlines, if that gave it more mirror planes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turned_degrees: Option<f64>,
    /// Share of the lower bound that the repair of the divergence took.
    pub repair_share: f64,
}

/// Wall-clock seconds of one step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct StepSeconds {
    /// Layer and electrodes.
    pub mechanics: f64,
    /// The field, by phase.
    pub electrostatics: PhaseSeconds,
    /// All of it.
    pub total: f64,
}

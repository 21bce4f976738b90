//! Settings and solutions of the field solvers.

use crate::bounded::Bounded;
use crate::shortfall::Shortfall;
use crate::target::Target;
use elastocap_geometry::section::SectionPlane;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Target, tolerance and limits of the box solver and of the solver for extruded scenes; those of the solver
/// on tetrahedra are [`crate::TetrahedraSettings`].
#[derive(Debug, Clone)]
pub struct Settings {
    /// Largest relative spread (upper - lower) / value of the target; without bounds, largest relative error
    /// estimate.
    pub relative_tolerance: f64,
    /// The scale, F, that the spread is compared with where the value is smaller: an absolute tolerance over
    /// the relative one. Zero without an absolute tolerance; then a capacitance that is zero never meets its
    /// tolerance.
    pub least_scale: f64,
    /// Factor on the tolerance, at least one: the search for one grid of boxes aims at the tolerance, and
    /// accepts an error that is larger by this factor.
    pub accepted: f64,
    /// The quantity that the tolerance applies to.
    pub target: Target,
    /// Whether nothing but the target is wanted. A two-terminal capacitance may then come with an empty
    /// Maxwell matrix and without a field, where opposite potentials alone are enough for it.
    pub target_alone: bool,
    /// Whether the dual problem is solved for a proved lower bound.
    pub bounds: bool,
    /// Whether mirror planes and half turns are used to solve only a half, a quarter or an eighth of the
    /// scene.
    pub symmetry: bool,
    /// A fixed grid; `None` lets the solver choose.
    pub resolution: Option<ResolutionLevel>,
    /// Whether the potential is kept for export.
    pub field: bool,
    /// Where the scene is loaded, [x1, x3] in m: the section of the field goes through that place.
    pub loaded_at: Option<[f64; 2]>,
    /// The findings of a solve of nearly the same scene to another tolerance, for the first guess of how fine
    /// a grid must be.
    pub foresight: Option<Foresight>,
    /// Largest memory the solve may take, bytes.
    pub memory_limit: u64,
    /// Set from outside to stop at the next opportunity, with the best bounds by then, or with
    /// [`crate::SolveError::Cancelled`] if there are none.
    pub cancel: Option<Arc<AtomicBool>>,
}

/// Memory and time that a solve will probably take, estimated from a small one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// Unknowns of the largest single problem, primal plus dual.
    pub unknowns: usize,
    /// Peak memory, bytes: an upper estimate.
    pub memory_bytes: u64,
    /// Expected seconds on two cores.
    pub seconds: f64,
    /// Unknowns and seconds if no symmetry were used.
    pub unmirrored: (usize, f64),
    /// Mirror planes that will be used, by axis.
    pub mirrored: [bool; 3],
    /// Whether a half turn about x2 leaves half of the scene, where no mirror plane across x1 or x3 does.
    pub turned: bool,
    /// Number of independent right-hand sides.
    pub right_hand_sides: usize,
    /// Whether the forecast is rough, without any solve, because that alone would take long.
    pub is_rough: bool,
}

impl Settings {
    /// The largest spread (upper - lower) / value that meets the tolerance. Without bounds the tolerance is
    /// that of the error estimate, which is half the spread.
    pub fn allowed_spread(&self) -> f64 {
        if self.bounds { self.relative_tolerance } else { 2.0 * self.relative_tolerance }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-3,
            least_scale: 0.0,
            accepted: 1.0,
            target: Target::Matrix,
            target_alone: false,
            bounds: true,
            symmetry: true,
            resolution: None,
            field: false,
            loaded_at: None,
            foresight: None,
            memory_limit: 16 << 30,
            cancel: None,
        }
    }
}

/// The relation of the error on a grid to its forecast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foresight {
    /// Half the error over the missing energy that the grid before had forecast.
    pub amplification: f64,
    /// The error: the spread of the bounds over the value.
    pub error: f64,
}

/// Order and grading of a grid of the box solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ResolutionLevel {
    /// Polynomial degree away from edges.
    pub order: usize,
    /// Geometric layers at each edge.
    pub levels: usize,
}

/// The last grid or mesh of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Discretisation {
    /// A graded grid of the box solver: its largest order and number of layers.
    Grid(ResolutionLevel),
    /// A mesh of tetrahedra.
    Tetrahedra {
        /// Order of the potentials.
        order: usize,
        /// How often the initial mesh was refined; `levels` in result.json.
        #[serde(rename = "levels")]
        refinements: usize,
    },
}

impl Discretisation {
    /// The grid, if it was the box solver's.
    pub fn grid(self) -> Option<ResolutionLevel> {
        match self {
            Self::Grid(level) => Some(level),
            Self::Tetrahedra { .. } => None,
        }
    }
}

/// Wall-clock seconds of the phases of a solve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PhaseSeconds {
    /// Symmetry, grid, line matrices and modes.
    pub setup: f64,
    /// Upper bounds.
    pub primal: f64,
    /// Lower bounds.
    pub dual: f64,
    /// Solves on coarser grids, to choose the resolution.
    pub choosing: f64,
}

impl PhaseSeconds {
    /// The seconds of two solves together.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            setup: self.setup + other.setup,
            primal: self.primal + other.primal,
            dual: self.dual + other.dual,
            choosing: self.choosing + other.choosing,
        }
    }
}

/// Which body of the scene fills a cell of a [`Field`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellBody {
    /// None: the background.
    Background,
    /// The dielectric with this index among the scene's dielectrics.
    Dielectric(usize),
    /// The conductor with this index among the scene's conductors.
    Conductor(usize),
}

/// The potential and the field on a grid, for export.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Node coordinates per axis, m, of the cells of the field's grid.
    pub nodes: [Vec<f64>; 3],
    /// Where the nodes `[i][j][k]` are, m, in a scene that a map bends: `nodes` are those of its boxes then.
    pub points: Option<Vec<[f64; 3]>>,
    /// V at the nodes `[i][j][k]`, conductors at the potentials `potentials`.
    pub potential: Vec<f64>,
    /// V/m at the nodes `[i][j][k]`, from the gradient of the solution itself. The component along an axis
    /// may jump from the cells below a node along that axis to those above it: the first has each component
    /// below, the second above.
    pub electric_field: Vec<[[f64; 3]; 2]>,
    /// Relative permittivity of the cells.
    pub relative_permittivity: Vec<f64>,
    /// Which body fills each cell.
    pub body: Vec<CellBody>,
    /// V of each conductor in the state shown.
    pub potentials: Vec<f64>,
    /// The field in sections; a section itself has none, and the whole has as many as
    /// [`SectionPlane::of_scene`] gives.
    pub sections: Vec<FieldSection>,
}

/// The potential on a thin slab around a plane, on a finer grid than that of the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldSection {
    /// The plane; the slab is thin along its axis.
    pub plane: SectionPlane,
    /// The field on it. Where a mirror plane lies in the middle there is a cell on either side, else one.
    pub field: Field,
}

/// The potential of a floating conductor. It is linear in the potentials of the driven conductors: the sum
/// over them of `per_driven` times the driven potential, plus `from_charges`.
#[derive(Debug, Clone, PartialEq)]
pub struct FloatingPotential {
    /// Its index among the scene's conductors.
    pub conductor: usize,
    /// For each driven conductor, in the order of the scene: this conductor's potential, V/V, with 1 V on the
    /// driven one, 0 V on the others and no charge on any floating conductor.
    pub per_driven: Vec<Bounded>,
    /// Its potential, V, with the given charges on the floating conductors and 0 V on all driven ones. The
    /// limits are infinite where the bounds of the matrix are too wide to prove any.
    pub from_charges: Bounded,
}

/// The capacitances that one of the solvers found, with their bounds, and how the solve went.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Maxwell capacitance matrix of the driven conductors, F, in the order of the scene: Q = C V. The
    /// floating conductors are uncharged and have been eliminated; grounded ones are at zero. Empty where
    /// [`Settings::target_alone`] let it be left out.
    pub maxwell: Vec<Vec<Bounded>>,
    /// Charge over voltage with equal and opposite charges (two driven conductors), or against ground or
    /// infinity (one), F; `None` for more than two of them, or for one conductor between insulated walls
    /// only, which can hold no charge.
    pub two_terminal: Option<Bounded>,
    /// The capacitance that [`Settings::target`] names, F; `None` where that is the whole matrix.
    pub measured: Option<Bounded>,
    /// Potentials of the floating conductors, in the order of the scene. Their limits are proved where the
    /// matrix's are.
    pub floating: Vec<FloatingPotential>,
    /// Whether the tolerance was reached.
    pub reached: bool,
    /// Why the tolerance was not reached.
    pub shortfall: Option<Shortfall>,
    /// Largest number of unknowns solved for at once (primal plus dual).
    pub unknowns: usize,
    /// Iterations of all solves on the final grid.
    pub iterations: usize,
    /// Number of grids or meshes solved on, the final one included.
    pub grids: usize,
    /// Mirror planes used, by axis.
    pub mirrored: [bool; 3],
    /// The last grid or mesh.
    pub resolution: Discretisation,
    /// Share of the lower bound's energy by which the repair of the flux lowers the bound: the linear solver
    /// leaves a small divergence, which a second flux cancels.
    pub repair_share: f64,
    /// Wall-clock time of the phases.
    pub seconds: PhaseSeconds,
    /// The sampled field, if [`Settings::field`] asks for it.
    pub field: Option<Field>,
    /// The sum of the capacitance that [`Settings::target`] names and the contribution of the error of a
    /// base, F, where it is known. That contribution is the same for all scenes that are added to one base,
    /// so that the differences of these sums are those of the capacitances. See
    /// [`solve_superposed`](crate::solve_superposed).
    pub with_error_of_base: Option<Bounded>,
    /// The findings that a solve to another tolerance may begin with, where there are bounds on a grid of
    /// boxes.
    pub foresight: Option<Foresight>,
}

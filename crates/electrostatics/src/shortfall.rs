//! Why a solve ended before its tolerance was reached.

use elastocap_linalg::memory::bytes_in_words;

use crate::error::SolveError;

/// Why a [`Solution`](crate::Solution) did not reach its tolerance. The text is a sentence for the user.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Shortfall {
    /// The caller has set the cancel flag, and bounds were known by then.
    #[error("it was stopped on request")]
    Stopped,
    /// The caller has fixed the resolution.
    #[error("the error is {error:.1e} at the fixed resolution")]
    FixedResolution {
        /// Relative error.
        error: f64,
    },
    /// The linear solver does not reach its goal.
    #[error("the iteration does not converge: sizes or permittivities are too unequal")]
    NoConvergence,
    /// The number of grids is limited.
    #[error("the error is still above the tolerance after {grids} grids")]
    MaxGrids {
        /// Grids that were solved on.
        grids: usize,
    },
    /// The number of meshes of tetrahedra is limited.
    #[error("the error is still above the tolerance after {refinements} refinements")]
    MaxRefinements {
        /// Refinements of the first mesh.
        refinements: usize,
    },
    /// Rounding alone exceeds the tolerance.
    #[error(
        "rounding alone leaves an error of {error:.1e}: permittivities or the couplings of conductors are too unequal for double precision"
    )]
    Rounding {
        /// Relative error that rounding leaves.
        error: f64,
    },
    /// The error is the smallest that double precision allows, and above the tolerance.
    #[error("the error is {error:.1e}: double precision gives no more")]
    DoublePrecision {
        /// Relative error.
        error: f64,
    },
    /// Finer grids do not reduce the error.
    #[error("the error stays at {error:.1e}: double precision gives no more")]
    Stagnation {
        /// Relative error.
        error: f64,
    },
    /// Finer meshes do not reduce the error, or there are none.
    #[error("the error stays at {error:.1e} on the finest mesh that this solver makes")]
    FinestMesh {
        /// Relative error.
        error: f64,
    },
    /// A finer grid exceeds the memory limit, or the largest number of unknowns.
    #[error("a finer grid would take {unknowns} unknowns and {} MB", bytes >> 20)]
    LargeGrid {
        /// Unknowns of the finer grid.
        unknowns: usize,
        /// Memory of the finer grid, bytes.
        bytes: u64,
    },
    /// A finer mesh of tetrahedra exceeds the memory limit.
    #[error(
        "a finer mesh, of {tetrahedra} tetrahedra, would take about {}, more than the limit of {}",
        bytes_in_words(*bytes),
        bytes_in_words(*limit)
    )]
    LargeMesh {
        /// Tetrahedra of the finer mesh.
        tetrahedra: usize,
        /// Memory of the finer mesh, bytes.
        bytes: u64,
        /// The memory allowed, bytes.
        limit: u64,
    },
    /// The error lies where there is no mesh to refine.
    #[error("the remaining error lies in open space beyond the mesh, which ends too near the conductors")]
    OpenSpace,
    /// The field on a finer mesh cannot be solved for.
    #[error("a finer mesh cannot be solved: {0}")]
    FinerMesh(Box<SolveError>),
    /// The bounds of a capacitance include zero.
    #[error(
        "a capacitance may be zero: it is less than {share:e} of what it would be with all other conductors at zero potential, and no \
         mesh gives zero a relative accuracy"
    )]
    MayBeZero {
        /// An upper bound on that share.
        share: f64,
    },
}

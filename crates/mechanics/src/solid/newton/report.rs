//! The effort that a load took, and the reason why a load was not reached.

/// The work spent to reach a load, and the quality of the result.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Effort {
    /// The number of load steps that converged.
    pub steps: usize,
    /// The number of load steps that were given up and cut.
    pub cuts: usize,
    /// The number of linear systems solved.
    pub solves: usize,
    /// Smallest `J` of the quadrature points at the end.
    pub smallest_j: f64,
    /// Largest unbalanced force over the largest force at the end.
    pub residual: f64,
    /// Largest residual of a linear system.
    pub linear_residual: f64,
    /// The number of negative pivots of the last tangent: zero for a stable equilibrium.
    pub negative_pivots: usize,
}

/// Why Newton's method stopped short. The state is the last one in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "no equilibrium found beyond {reached} of this load step: {reason}; the smallest J is {smallest_j} in element \
     {element}, the smallest part tried {step}"
)]
pub struct Stopped {
    /// The fraction of the way from the last load to this one up to which equilibria were found.
    pub reached: f64,
    /// The fraction of the way at the last attempt.
    pub step: f64,
    /// The reason why the last attempt failed.
    pub reason: StopReason,
    /// Smallest `J` of the quadrature points in the last attempt.
    pub smallest_j: f64,
    /// The element it is in.
    pub element: usize,
    /// The effort so far.
    pub effort: Effort,
}

impl Stopped {
    /// The report that no equilibrium was found near that of a coarser mesh, and nothing else was tried.
    pub(crate) fn not_near() -> Box<Self> {
        let reason = StopReason::NoConvergence;
        let effort = Effort::default();
        Box::new(Self { reached: 0.0, step: 1.0, reason, smallest_j: 0.0, element: 0, effort })
    }
}

/// Why a load step failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StopReason {
    /// The steps that keep `J > 0` became too short.
    #[error("every step would turn an element inside out")]
    Inversion,
    /// The steps that keep the rubber within its limit of extension became too short.
    #[error("every step would extend the rubber beyond the limit of its law")]
    ExtensionLimit,
    /// The residual did not fall.
    #[error("Newton's method did not converge")]
    NoConvergence,
    /// [`NewtonSettings::max_solves`](super::NewtonSettings::max_solves) is used up.
    #[error("the number of linear systems has reached its limit")]
    TooLong,
    /// Stopped on request: the caller has set [`NewtonSettings::cancel`](super::NewtonSettings::cancel).
    #[error("it was stopped on request")]
    Cancelled,
    /// A linear system had no solution.
    #[error("the tangent is singular")]
    Singular,
}

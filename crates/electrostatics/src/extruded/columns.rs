//! The columns of space over the triangles of the plan, and the chains of sides between the columns.

use std::collections::HashMap;

/// The filling of the space over one triangle of the plan. Along the axis, *cuts* are the planes at which
/// something begins or ends, and the ends of the scene; *intervals* lie between them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    /// The conductor that fills each interval.
    pub conductor: Vec<Option<u32>>,
    /// The conductor that each cut belongs to, a sheet or the face of a body.
    pub held: Vec<Option<u32>>,
    /// Relative permittivity of each interval.
    pub permittivity: Vec<f64>,
}

/// The conductors that hold sides of triangles, where sheets parallel to the axis stand over them. Intervals
/// and cuts are those of a [`Column`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    /// The conductor that holds the sides over each interval.
    pub conductor: Vec<Option<u32>>,
    /// The conductor that holds the sides at each cut.
    pub held: Vec<Option<u32>>,
}

/// For sides of triangles in chains, by their ends in ascending order, the number of the chain.
pub(super) type ChainOfSide = HashMap<[u32; 2], u32>;

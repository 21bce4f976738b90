//! The unknown displacements, and their numbers in the linear system.

use super::body::Body;
use super::expansion::Expansion;
use crate::solid::dimension::{Dimension, Numbering};

/// Marks a prescribed displacement or one of a hanging node. One number instead of an `Option` per
/// displacement keeps assembly fast.
const HELD: u32 = u32::MAX;

/// The number of each displacement among the unknowns of the linear system; held ones, and those of nodes
/// that hang, have none.
#[derive(Debug)]
pub(crate) struct Unknowns {
    /// For each displacement its number, or [`HELD`].
    numbers: Vec<u32>,
    /// The number of unknown displacements.
    count: u32,
}

impl Unknowns {
    /// Numbers the free displacements of `body` in an order that keeps the factor of the matrix sparse.
    pub(super) fn new<S: Dimension>(body: &Body<S>) -> Self {
        let hanging = &body.mesh.hanging;
        let coupled = |e: &S::Nodes| {
            Expansion::new(e.as_ref(), hanging).map_or(*e, |more| {
                // The order is computed from as many nodes as an element has. If an element is coupled to
                // more of them, its neighbours contain the others.
                S::Nodes::from_fn(|n| more.nodes[n.min(more.nodes.len() - 1)])
            })
        };
        let coupled: Vec<S::Nodes> = body.mesh.elements.iter().map(coupled).collect();
        let mut order = S::order(&body.mesh.nodes, &coupled);
        // A node that carries an obstacle is coupled to all nodes that may touch it. Eliminated early, it
        // would fill the factor.
        order.sort_by_key(|&n| body.obstacles.iter().any(|o| o.carrier == Some(n)));
        let (mut numbers, mut count) = (vec![HELD; body.held.len()], 0);
        for n in order {
            for d in S::AXES * n as usize..S::AXES * (n as usize + 1) {
                if !body.held[d] {
                    numbers[d] = count;
                    count += 1;
                }
            }
        }
        Self { numbers, count }
    }

    /// The number of unknown displacements.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// The number of displacements, including prescribed ones.
    pub(super) fn displacements(&self) -> usize {
        self.numbers.len()
    }

    /// The number of displacement `d` in the linear system, or `None` if it is prescribed or follows others.
    pub(super) fn number(&self, d: usize) -> Option<u32> {
        (self.numbers[d] != HELD).then_some(self.numbers[d])
    }

    /// The number of displacement `d` in the linear system as an index, or `None` if it is prescribed or
    /// follows others.
    pub(crate) fn index(&self, d: usize) -> Option<usize> {
        self.number(d).map(|number| number as usize)
    }
}

//! Which displacements are unknown, and their numbers in the linear system.

use super::body::Body;
use super::expansion::Expansion;
use crate::solid::dimension::{Dimension, Numbering};

/// Stands for a displacement that is held, or that of a node that hangs; one number instead of two for each displacement keeps assembly fast.
const HELD: u32 = u32::MAX;

/// The number of each displacement among the unknowns of the linear system; held ones, and those of nodes that hang, have none.
#[derive(Debug)]
pub(crate) struct Unknowns {
    numbers: Vec<u32>,
    count: u32,
}

impl Unknowns {
    /// Numbers the free displacements of `body` in an order that keeps the factor of the matrix sparse.
    pub(super) fn new<S: Dimension>(body: &Body<S>) -> Self {
        let hanging = &body.mesh.hanging;
        let coupled = |e: &S::Nodes| {
            Expansion::new(e.as_ref(), hanging).map_or(*e, |more| {
                // As many as an element has nodes: where it is coupled to more, its neighbours know the others.
                S::Nodes::from_fn(|n| more.nodes[n.min(more.nodes.len() - 1)])
            })
        };
        let coupled: Vec<S::Nodes> = body.mesh.elements.iter().map(coupled).collect();
        let mut order = S::order(&body.mesh.nodes, &coupled);
        // A node that carries an obstacle is coupled to all that may touch it: eliminated early, it would couple them.
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

    /// How many displacements are unknown.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// How many displacements there are, held ones included.
    pub(super) fn displacements(&self) -> usize {
        self.numbers.len()
    }

    /// The number of displacement `d` in the linear system, or `None` if it is held or follows others.
    pub(super) fn number(&self, d: usize) -> Option<u32> {
        (self.numbers[d] != HELD).then_some(self.numbers[d])
    }

    /// The number of displacement `d` in the linear system as an index, or `None` if it is held or follows others.
    pub(crate) fn index(&self, d: usize) -> Option<usize> {
        self.number(d).map(|number| number as usize)
    }
}

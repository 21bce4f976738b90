//! Matrices and forces of elements with hanging nodes, in terms of the nodes that these follow.

use crate::solid::dimension::{Dimension, ElementSystem};
use crate::solid::hanging::Hanging;

/// The nodes that an element with hanging nodes is coupled to.
#[derive(Debug, Clone)]
pub(crate) struct Expansion {
    /// The nodes, none of which hangs.
    pub(super) nodes: Vec<u32>,
    /// For each node of the element the indices in `nodes` of those that it follows, with the weight of each.
    parts: Vec<Vec<(u32, f64)>>,
}

/// Forces and tangent of an element in terms of the nodes that it is coupled to; see [`ElementSystem`].
#[derive(Debug, Clone, Default)]
pub(super) struct Expanded {
    pub(super) force: Vec<f64>,
    pub(super) condensed_force: Vec<f64>,
    pub(super) stiffness: Vec<f64>,
}

impl Expansion {
    /// The expansion of an element with the given nodes; `None` if none of them hangs.
    pub(super) fn new(element: &[u32], hanging: &Hanging) -> Option<Self> {
        if !element.iter().any(|n| hanging.nodes.contains_key(n)) {
            return None;
        }
        let mut nodes: Vec<u32> = Vec::new();
        let mut place = |node: u32| {
            let index = nodes.iter().position(|n| *n == node).unwrap_or_else(|| {
                nodes.push(node);
                nodes.len() - 1
            });
            index as u32
        };
        let parts = element
            .iter()
            .map(|n| match hanging.nodes.get(n) {
                Some(masters) => masters.iter().map(|&(m, part)| (place(m), part)).collect(),
                None => vec![(place(*n), 1.0)],
            })
            .collect();
        Some(Self { nodes, parts })
    }

    /// Expresses the forces and the tangent of an element in terms of the nodes that it is coupled to.
    pub(super) fn expand<S: Dimension>(&self, system: &ElementSystem<S>, out: &mut Expanded) {
        let (local, coupled) = (S::AXES * self.parts.len(), S::AXES * self.nodes.len());
        for (from, to) in
            [(&system.force, &mut out.force), (&system.condensed_force, &mut out.condensed_force)]
        {
            to.clear();
            to.resize(coupled, 0.0);
            for (a, parts) in self.parts.iter().enumerate() {
                for &(m, part) in parts {
                    for k in 0..S::AXES {
                        to[S::AXES * m as usize + k] += part * from[S::AXES * a + k];
                    }
                }
            }
        }
        // The columns of the tangent are expanded first, then its rows.
        let mut by_columns = vec![0.0; local * coupled];
        for (row, line) in system.stiffness.chunks_exact(local).zip(by_columns.chunks_exact_mut(coupled)) {
            for (b, parts) in self.parts.iter().enumerate() {
                for &(m, part) in parts {
                    for k in 0..S::AXES {
                        line[S::AXES * m as usize + k] += part * row[S::AXES * b + k];
                    }
                }
            }
        }
        out.stiffness.clear();
        out.stiffness.resize(coupled * coupled, 0.0);
        for (a, parts) in self.parts.iter().enumerate() {
            for &(m, part) in parts {
                for k in 0..S::AXES {
                    let row = S::AXES * m as usize + k;
                    let from = &by_columns[(S::AXES * a + k) * coupled..][..coupled];
                    for (to, value) in out.stiffness[row * coupled..][..coupled].iter_mut().zip(from) {
                        *to += part * value;
                    }
                }
            }
        }
    }
}

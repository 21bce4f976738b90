//! Lookup of nodes by position: points of several parts of a mesh at the same position are one node.

use std::collections::HashMap;

/// Finds nodes by their places.
pub(super) struct NodesByPlace {
    /// Points that are this close along each axis, m, are one node.
    tolerance: f64,
    /// The place of each node, m.
    places: Vec<[f64; 3]>,
    /// The last node that was added to each cell of a grid.
    last: HashMap<[i64; 3], u32>,
    /// For each node, the one that was added to the same cell before it.
    before: Vec<Option<u32>>,
}

impl NodesByPlace {
    /// Length of a cell in tolerances. Cells are so large that a point is rarely within the tolerance of a
    /// face, where neighbouring cells have to be searched as well. It is not tuned.
    const CELL: f64 = 1e3;

    /// An empty list; points closer than `tolerance` (m) along each axis will be one node.
    pub(super) fn new(tolerance: f64) -> Self {
        Self { tolerance, places: Vec::new(), last: HashMap::new(), before: Vec::new() }
    }

    /// Places of all nodes in m, by their numbers.
    pub(super) fn places(&self) -> &[[f64; 3]] {
        &self.places
    }

    /// The node at a place (m), if there is one.
    pub(super) fn find(&self, place: [f64; 3]) -> Option<u32> {
        let [low, high] = [-1.0, 1.0].map(|side| place.map(|x| self.cell(x + side * self.tolerance)));
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    let mut next = self.last.get(&[i, j, k]).copied();
                    while let Some(node) = next {
                        let known = self.places[node as usize];
                        if (0..3).all(|a| (known[a] - place[a]).abs() <= self.tolerance) {
                            return Some(node);
                        }
                        next = self.before[node as usize];
                    }
                }
            }
        }
        None
    }

    /// The node at a place (m), a new one if there is none.
    pub(super) fn node_at(&mut self, place: [f64; 3]) -> u32 {
        self.find(place).unwrap_or_else(|| {
            let node = self.places.len() as u32;
            self.places.push(place);
            self.before.push(self.last.insert(place.map(|x| self.cell(x)), node));
            node
        })
    }

    /// The cell that a coordinate lies in. Cells are shifted by half a cell, since many nodes have
    /// coordinates of zero.
    fn cell(&self, x: f64) -> i64 {
        (x / (Self::CELL * self.tolerance) + 0.5).floor() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_differ_by_rounding_are_one_node_wherever_cells_end() {
        let tolerance = 1e-9;
        let mut found = NodesByPlace::new(tolerance);
        let cell = NodesByPlace::CELL * tolerance;
        for face in [0.0, 0.5 * cell, -2.5 * cell] {
            let at = |x: f64| [face + x, 0.5 * cell - 0.5 * x, 0.3];
            let node = found.node_at(at(0.0));
            for x in [0.9, -0.9] {
                assert_eq!(found.node_at(at(x * tolerance)), node, "{face} {x}");
            }
            assert_ne!(found.node_at(at(1.1 * tolerance)), node, "{face}");
            assert_ne!(found.node_at(at(-1.1 * tolerance)), node, "{face}");
        }
        assert_eq!(found.places().len(), 9);
    }
}

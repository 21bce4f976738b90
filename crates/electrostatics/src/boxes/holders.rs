//! How a half turn permutes the conductors of a scene, or the blocks of a domain: found from the cells,
//! faces, edges and corners that each of them holds, since a conductor and its image may be cut into
//! different blocks.

use crate::boxes::domain::Block;
use std::collections::BTreeSet;

/// The axes that the half turn about the second axis reverses.
pub(crate) const ACROSS: [usize; 2] = [0, 2];

/// Mirrors across several axes at once: across two a half turn about the third, across all three a point
/// reflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct HalfTurn {
    /// Whether there is a mirror across each axis.
    across: [bool; 3],
}

impl HalfTurn {
    /// The mirrors across the marked axes.
    pub(crate) fn across(across: [bool; 3]) -> Self {
        Self { across }
    }

    pub(crate) fn is_across(self, axis: usize) -> bool {
        self.across[axis]
    }

    /// The image of a place of a grid that has `n` places on each axis, in ascending order.
    pub(crate) fn of(self, place: [usize; 3], n: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|a| if self.across[a] { n[a] - 1 - place[a] } else { place[a] })
    }
}

/// The conductor or block that holds each *place* of a grid. On each axis planes and intervals are places in
/// turn, so that a place in space is a corner, an edge, a face or a cell.
pub(crate) struct Holders {
    /// Number of places on each axis.
    n: [usize; 3],
    /// For each place, 1 + the number of its holder, or 0 where no block holds it.
    holder: Vec<u32>,
}

impl Holders {
    /// Finds the holders among so many `cells`; each block comes with the number of the conductor or block
    /// that holds its places.
    pub(crate) fn new<'b>(cells: [usize; 3], blocks: impl Iterator<Item = (usize, &'b Block)>) -> Self {
        let n = cells.map(|n| 2 * n + 1);
        let mut holder = vec![0; n.iter().product()];
        for (index, b) in blocks {
            for i in 2 * b.lo[0]..=2 * b.hi[0] {
                for j in 2 * b.lo[1]..=2 * b.hi[1] {
                    let row = (i * n[1] + j) * n[2];
                    holder[row + 2 * b.lo[2]..=row + 2 * b.hi[2]].fill(index as u32 + 1);
                }
            }
        }
        Self { n, holder }
    }

    /// The entry of [`Holders::holder`] for a place.
    fn holder_at(&self, [i, j, k]: [usize; 3]) -> u32 {
        self.holder[(i * self.n[1] + j) * self.n[2] + k]
    }

    /// The pairs of holders for which a turn takes a part of the first to the second; `None` where it takes a
    /// part to a place without a holder.
    pub(crate) fn pairs(&self, turn: HalfTurn) -> Option<BTreeSet<(usize, usize)>> {
        let mut pairs = BTreeSet::new();
        for place in places(self.n) {
            match (self.holder_at(place), self.holder_at(turn.of(place, self.n))) {
                (0, 0) => {}
                (0, _) | (_, 0) => return None,
                (from, to) => drop(pairs.insert((from as usize - 1, to as usize - 1))),
            }
        }
        Some(pairs)
    }
}

/// All places, `n` on each axis.
pub(crate) fn places(n: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..n[0]).flat_map(move |i| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |k| [i, j, k])))
}

//! The permutation of conductors or blocks under a half turn, however they are cut into blocks.

use crate::boxes::domain::Block;
use std::collections::BTreeSet;

/// The axes that the half turn is across.
pub(crate) const ACROSS: [usize; 2] = [0, 2];

/// Mirrors of some axes, together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct HalfTurn {
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

    /// The image of a place, of which there are `n` on each axis.
    pub(crate) fn of(self, place: [usize; 3], n: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|a| if self.across[a] { n[a] - 1 - place[a] } else { place[a] })
    }
}

/// The holder of every plane and interval of each axis in turn, and so of every corner, edge, face and cell.
pub(crate) struct Holders {
    n: [usize; 3],
    /// 1 + number of the holder of one of the blocks, 0 outside of all.
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

    fn at(&self, [i, j, k]: [usize; 3]) -> u32 {
        self.holder[(i * self.n[1] + j) * self.n[2] + k]
    }

    /// The pairs of holders for which a turn brings a part of the first to the second; `None` where it brings
    /// a part to no holder.
    pub(crate) fn pairs(&self, turn: HalfTurn) -> Option<BTreeSet<(usize, usize)>> {
        let mut pairs = BTreeSet::new();
        for place in places(self.n) {
            match (self.at(place), self.at(turn.of(place, self.n))) {
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

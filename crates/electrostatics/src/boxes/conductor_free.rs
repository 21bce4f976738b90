//! Maximal conductor-free boxes: the overlapping subdomains of the Schwarz preconditioner.

use crate::boxes::domain::{Block, Domain};
use std::collections::BTreeSet;

/// A box of intervals without a conductor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct FreeBox {
    /// The intervals.
    pub block: Block,
    /// Outer planes `[axis][side]` that the box reaches but on which a sheet lies: functions of the box
    /// vanish there.
    pub held: [[bool; 2]; 3],
}

impl FreeBox {
    /// Number of cells.
    pub(crate) fn volume(&self) -> usize {
        (0..3).map(|a| self.block.hi[a] - self.block.lo[a]).product()
    }

    /// Whether the conductor has a point inside: the open boxes meet, or a sheet cuts the box or lies on an
    /// outer plane that belongs to it.
    fn meets(&self, conductor: &Block, cells: [usize; 3]) -> bool {
        (0..3).all(|a| {
            let (lo, hi) = (self.block.lo[a], self.block.hi[a]);
            let on_wall = conductor.lo[a] == conductor.hi[a] && {
                (conductor.lo[a] == 0 && lo == 0 && !self.held[a][0])
                    || (conductor.lo[a] == cells[a] && hi == cells[a] && !self.held[a][1])
            };
            on_wall || (lo < conductor.hi[a] && conductor.lo[a] < hi)
        })
    }

    /// Whether this box is a part of another, and every function that vanishes outside of this box is one of
    /// the other.
    fn inside(&self, other: &FreeBox) -> bool {
        let (p, q) = (&self.block, &other.block);
        self != other
            && (0..3).all(|a| {
                q.lo[a] <= p.lo[a]
                    && p.hi[a] <= q.hi[a]
                    && (0..2).all(|side| {
                        let shared = if side == 0 { p.lo[a] == q.lo[a] } else { p.hi[a] == q.hi[a] };
                        !(shared && other.held[a][side] && !self.held[a][side])
                    })
            })
    }
}

/// Largest number of boxes that are enumerated; beyond it the search keeps the largest found so far. Not
/// tuned: a limit that ordinary cases do not reach.
const ENUMERATION_LIMIT: usize = 20_000;

/// The maximal boxes of intervals without a conductor, thinned to a set in which every point outside the
/// conductors is interior to some box.
pub(crate) fn free_boxes(domain: &Domain) -> Vec<FreeBox> {
    free_boxes_within(domain, &mut Work { left: u64::MAX }).unwrap_or_default()
}

/// The boxes that [`free_boxes`] finds, or `None` if finding them takes more than the remaining `work`, from
/// which the work done is deducted.
pub(crate) fn free_boxes_within(domain: &Domain, work: &mut Work) -> Option<Vec<FreeBox>> {
    let maximal = maximal(domain, work)?;
    thin(domain, maximal, work)
}

/// Remaining number of comparisons of boxes and of visits to features: each takes some nanoseconds.
#[derive(Debug)]
pub(crate) struct Work {
    pub(crate) left: u64,
}

impl Work {
    /// Deducts some work; `None` where too little is left.
    pub(crate) fn count(&mut self, more: usize) -> Option<()> {
        self.left = self.left.checked_sub(more as u64)?;
        Some(())
    }
}

/// All maximal free boxes. The whole domain is split around one conductor after the other, and boxes that lie
/// inside another one are dropped.
fn maximal(domain: &Domain, work: &mut Work) -> Option<Vec<FreeBox>> {
    let cells = domain.cells();
    let mut boxes = vec![FreeBox { block: Block { lo: [0; 3], hi: cells }, held: [[false; 2]; 3] }];
    for conductor in &domain.conductors {
        work.count(boxes.len())?;
        let (hit, clear): (Vec<_>, Vec<_>) = boxes.into_iter().partition(|b| b.meets(conductor, cells));
        let mut pieces = BTreeSet::new();
        for b in hit {
            for a in 0..3 {
                let (mut below, mut above) = (b, b);
                below.block.hi[a] = conductor.lo[a].min(b.block.hi[a]);
                above.block.lo[a] = conductor.hi[a].max(b.block.lo[a]);
                let sheet = conductor.lo[a] == conductor.hi[a];
                if below.block.hi[a] < cells[a] {
                    below.held[a][1] = false;
                } else {
                    below.held[a][1] |= sheet && conductor.lo[a] == cells[a];
                }
                if above.block.lo[a] > 0 {
                    above.held[a][0] = false;
                } else {
                    above.held[a][0] |= sheet && conductor.lo[a] == 0;
                }
                for piece in [below, above] {
                    if piece.block.lo[a] < piece.block.hi[a] && !piece.meets(conductor, cells) {
                        pieces.insert(piece);
                    }
                }
            }
        }
        let mut maximal_boxes = clear;
        let candidates: Vec<FreeBox> = pieces.into_iter().collect();
        for p in &candidates {
            work.count(maximal_boxes.len() + candidates.len())?;
            if !maximal_boxes.iter().any(|q| q == p || p.inside(q)) && !candidates.iter().any(|q| p.inside(q))
            {
                maximal_boxes.push(*p);
            }
        }
        if maximal_boxes.len() > ENUMERATION_LIMIT {
            maximal_boxes.sort_by_key(|b| std::cmp::Reverse(b.volume()));
            maximal_boxes.truncate(ENUMERATION_LIMIT);
        }
        boxes = maximal_boxes;
    }
    boxes.sort_by_key(|b| (std::cmp::Reverse(b.volume()), *b));
    Some(boxes)
}

/// Greedy cover of the *features* of the coarse grid of planes: every vertex, edge, face and cell outside the
/// conductors must be interior to a box. With few boxes all are kept, since more overlap makes a better
/// preconditioner.
fn thin(domain: &Domain, boxes: Vec<FreeBox>, work: &mut Work) -> Option<Vec<FreeBox>> {
    // Largest number of boxes that are all kept. Tuned: `benches/outlines.py bus`.
    const KEEP_ALL: usize = 8;
    if boxes.len() <= KEEP_ALL {
        return Some(boxes);
    }
    // Along an axis, feature 2 m is plane m and feature 2 m + 1 is interval m. A box lo..hi holds the
    // features from 2 lo + 1 to 2 hi - 1, and the outer planes where it reaches the scene's end.
    let cells = domain.cells();
    let size = cells.map(|n| 2 * n + 1);
    let span = |b: &FreeBox, a: usize| {
        let (block, held) = (&b.block, &b.held[a]);
        let lo = if block.lo[a] == 0 && !held[0] { 0 } else { 2 * block.lo[a] + 1 };
        let hi = if block.hi[a] == cells[a] && !held[1] { size[a] } else { 2 * block.hi[a] };
        lo..hi
    };
    let features = |b: &FreeBox| {
        let (si, sj, sk) = (span(b, 0), span(b, 1), span(b, 2));
        si.flat_map(move |i| {
            let sk = sk.clone();
            sj.clone().flat_map(move |j| sk.clone().map(move |k| (i * size[1] + j) * size[2] + k))
        })
    };
    let mut covered = vec![false; size.iter().product()];
    let mut chosen = Vec::new();
    let mut rest: Vec<(usize, FreeBox)> = boxes.into_iter().map(|b| (usize::MAX, b)).collect();
    loop {
        // Lazy greedy: gains only fall, so the first candidate whose fresh gain still leads is the best.
        work.count(rest.len())?;
        rest.sort_by_key(|(gain, b)| (std::cmp::Reverse(*gain), *b));
        let mut best: Option<(usize, usize)> = None;
        for (index, entry) in rest.iter_mut().enumerate() {
            if best.is_some_and(|(gain, _)| gain >= entry.0) {
                break;
            }
            // A box of intervals has about eight features for each cell.
            work.count(8 * entry.1.volume())?;
            entry.0 = features(&entry.1).filter(|&f| !covered[f]).count();
            if best.is_none_or(|(gain, _)| entry.0 > gain) {
                best = Some((entry.0, index));
            }
        }
        match best {
            Some((gain, index)) if gain > 0 => {
                let (_, b) = rest.swap_remove(index);
                for f in features(&b) {
                    covered[f] = true;
                }
                chosen.push(b);
            }
            _ => break,
        }
    }
    // Where not all boxes could be enumerated a feature may be uncovered: the box of the cells around it
    // covers it.
    for feature in 0..covered.len() {
        if covered[feature] {
            continue;
        }
        let place = [feature / (size[1] * size[2]), feature / size[2] % size[1], feature % size[2]];
        let block = Block {
            lo: place.map(|f| (f.saturating_sub(1)) / 2),
            hi: [0, 1, 2].map(|a| (place[a] / 2 + 1).min(cells[a])),
        };
        let around = FreeBox { block, held: [[false; 2]; 3] };
        if !domain.conductors.iter().any(|c| around.meets(c, cells)) {
            for f in features(&around) {
                covered[f] = true;
            }
            chosen.push(around);
        }
    }
    Some(chosen)
}

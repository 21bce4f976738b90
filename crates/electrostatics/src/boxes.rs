//! Maximal conductor-free boxes: the overlapping subdomains of the Schwarz preconditioner.

use crate::domain::{Block, Domain};
use std::collections::BTreeSet;

/// More boxes than this are never enumerated; the search then keeps the largest found so far.
const ENUMERATION_LIMIT: usize = 20_000;

/// The boxes of intervals that contain no conductor and cannot grow, thinned to those needed to hold every point that
/// is not in a conductor in the interior of some box.
pub fn free_boxes(domain: &Domain) -> Vec<Block> {
    thin(domain, maximal(domain))
}

fn volume(b: &Block) -> usize {
    (0..3).map(|a| b.hi[a] - b.lo[a]).product()
}

/// All maximal free boxes: split around one conductor after the other, dropping what lies inside another box.
fn maximal(domain: &Domain) -> Vec<Block> {
    let mut boxes = vec![Block { lo: [0; 3], hi: domain.cells() }];
    for conductor in &domain.conductors {
        let (hit, clear): (Vec<_>, Vec<_>) = boxes.into_iter().partition(|b| b.meets(conductor));
        let mut pieces = BTreeSet::new();
        for b in hit {
            for a in 0..3 {
                let (mut below, mut above) = (b, b);
                below.hi[a] = conductor.lo[a];
                above.lo[a] = conductor.hi[a];
                pieces.extend([below, above].into_iter().filter(|p| p.lo[a] < p.hi[a]));
            }
        }
        let inside = |p: &Block, q: &Block| p != q && (0..3).all(|a| q.lo[a] <= p.lo[a] && p.hi[a] <= q.hi[a]);
        let mut kept = clear;
        let candidates: Vec<Block> = pieces.into_iter().collect();
        for p in &candidates {
            if !kept.iter().any(|q| q == p || inside(p, q)) && !candidates.iter().any(|q| inside(p, q)) {
                kept.push(*p);
            }
        }
        if kept.len() > ENUMERATION_LIMIT {
            kept.sort_by_key(|b| std::cmp::Reverse(volume(b)));
            kept.truncate(ENUMERATION_LIMIT);
        }
        boxes = kept;
    }
    boxes.sort_by_key(|b| (std::cmp::Reverse(volume(b)), *b));
    boxes
}

/// Greedy cover of the *features* of the coarse grid of planes: every vertex, edge, face and cell outside the
/// conductors must be interior to a box. With few boxes all are kept, for the overlap they bring.
fn thin(domain: &Domain, boxes: Vec<Block>) -> Vec<Block> {
    const KEEP_ALL: usize = 8;
    if boxes.len() <= KEEP_ALL {
        return boxes;
    }
    // Feature 2 m is plane m, feature 2 m + 1 interval m; a box lo..hi holds the features 2 lo + 1 .. 2 hi - 1, and the
    // outer planes where it reaches the scene's end.
    let cells = domain.cells();
    let size = cells.map(|n| 2 * n + 1);
    let span = |b: &Block, a: usize| {
        let lo = if b.lo[a] == 0 { 0 } else { 2 * b.lo[a] + 1 };
        let hi = if b.hi[a] == cells[a] { size[a] } else { 2 * b.hi[a] };
        lo..hi
    };
    let features = |b: &Block| {
        let (si, sj, sk) = (span(b, 0), span(b, 1), span(b, 2));
        si.flat_map(move |i| {
            let sk = sk.clone();
            sj.clone().flat_map(move |j| sk.clone().map(move |k| (i * size[1] + j) * size[2] + k))
        })
    };
    let mut covered = vec![false; size.iter().product()];
    let mut chosen = Vec::new();
    let mut rest: Vec<(usize, Block)> = boxes.into_iter().map(|b| (usize::MAX, b)).collect();
    loop {
        // Lazy greedy: gains only fall, so the first candidate whose fresh gain still leads is the best.
        rest.sort_by_key(|(gain, b)| (std::cmp::Reverse(*gain), *b));
        let mut best: Option<(usize, usize)> = None;
        for (index, entry) in rest.iter_mut().enumerate() {
            if best.is_some_and(|(gain, _)| gain >= entry.0) {
                break;
            }
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
    chosen
}

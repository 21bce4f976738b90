//! Choosing order and grading.
//!
//! Grids form a ladder on which the error falls by about the same factor from rung to rung. A cheap low rung or two
//! tell how far the error lies above the tolerance; the next solve is made where it should be met.

use crate::layout::Layout;
use crate::solution::{ResolutionLevel, Settings};
use elastocap_geometry::grid::Resolution;

/// Size of a layer over the next larger one: between 0.12 (best below 1e-4) and 0.15 (best above), measured on the
/// in-plane pair.
const RATIO: f64 = 0.13;

/// Without bounds, the error left over the gain of the last rung. Between neighbouring rungs the error falls by 1.6
/// to 5; the remainder is then 1.7 to 0.25 gains.
pub const REMAINDER: f64 = 1.7;

/// One rung: a resolution and how far to iterate on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rung {
    /// For grids.
    pub resolution: Resolution,
    /// For people.
    pub level: ResolutionLevel,
    /// Largest error of the iteration over the energy.
    pub iteration_share: f64,
}

/// The state of the search.
#[derive(Debug)]
pub struct Ladder {
    tolerance: f64,
    bounds: bool,
    fixed: Option<ResolutionLevel>,
    memory_limit: u64,
    /// Current rung.
    index: usize,
    /// Rungs solved and the spread found.
    seen: Vec<(usize, f64)>,
    shortfall: Option<String>,
}

/// Highest rung: beyond it line matrices reach the end of double precision.
const TOP: usize = 22;

/// Expected factor of the spread from one rung to the next, until two rungs have been seen.
const EXPECTED: f64 = 0.4;

impl Ladder {
    /// Starts a search.
    pub fn new(settings: &Settings) -> Self {
        // Where the pair of the paper would need to be, less two rungs.
        let guess = ((settings.relative_tolerance / 1.5e-2).ln() / EXPECTED.ln()).floor().max(0.0) as usize;
        Self {
            tolerance: settings.relative_tolerance,
            bounds: settings.bounds,
            fixed: settings.resolution,
            memory_limit: settings.memory_limit,
            index: if settings.bounds { (guess / 2).min(3) } else { guess.saturating_sub(2).min(4) },
            seen: Vec::new(),
            shortfall: None,
        }
    }

    /// The rung to solve on now.
    pub fn rung(&self) -> Rung {
        match self.fixed {
            Some(level) => fixed(level, self.tolerance),
            None => rung(self.index, self.tolerance),
        }
    }

    /// Why the tolerance will not be reached, if it will not.
    pub fn shortfall(&self) -> Option<String> {
        self.shortfall.clone()
    }

    /// Takes the spread found on the current rung; `Some(())` if another rung is to be solved.
    pub fn judge(&mut self, spread: f64, memory: impl Fn(&Rung) -> u64) -> Option<()> {
        if let Some(level) = self.fixed {
            // Without bounds the estimate needs a coarser neighbour: solved first, at one order and layer less.
            if !self.bounds && self.seen.is_empty() {
                self.seen.push((0, spread));
                return Some(()).filter(|()| level.order > 0);
            }
            if spread > self.tolerance {
                self.shortfall = Some(format!("spread {spread:.1e} at the fixed resolution"));
            }
            return None;
        }
        self.seen.push((self.index, spread));
        if spread <= self.tolerance && (self.bounds || self.seen.len() > 1) {
            return None;
        }
        let factor = match self.seen[..] {
            [.., (i, a), (j, b)] if a > b && b > 0.0 && a < 1.9 => {
                ((b / a).ln() / (j - i) as f64).exp().clamp(0.15, 0.75)
            }
            _ => EXPECTED,
        };
        let steps = if spread < 1.9 {
            ((0.8 * self.tolerance / spread).ln() / factor.ln()).ceil().max(1.0) as usize
        } else {
            1
        };
        // Without bounds the estimate compares neighbours: the last step must be a single one.
        let jump = if self.bounds { steps.min(6) } else if self.seen.len() < 2 { 1 } else { steps.min(6) };
        let mut next = (self.index + jump).min(TOP);
        while next > self.index && memory(&rung(next, self.tolerance)) > self.memory_limit {
            next -= 1;
        }
        if next == self.index {
            self.shortfall = Some(if self.index == TOP {
                format!("spread {spread:.1e} on the finest grid that double precision allows")
            } else {
                format!("spread {spread:.1e}: a finer grid would take more than {} MB", self.memory_limit >> 20)
            });
            return None;
        }
        self.index = next;
        Some(())
    }
}

/// Rung 0 has one layer and order 2; even rungs begin at degree 2 at the edges, odd ones at 3, and every second rung
/// adds a layer and an order.
fn rung(index: usize, tolerance: f64) -> Rung {
    let (levels, first) = (1 + index / 2, 2 + index % 2);
    let order = levels + 2 + index % 2;
    with(levels, order, first, tolerance)
}

fn fixed(level: ResolutionLevel, tolerance: f64) -> Rung {
    with(level.levels, level.order, 2.min(level.order), tolerance)
}

fn with(levels: usize, order: usize, first: usize, tolerance: f64) -> Rung {
    Rung {
        resolution: Resolution { order, levels, ratio: RATIO, slope: 1.0, first, outer: ((2.0 / tolerance).ln() / -RATIO.ln()).ceil().max(1.0) as usize },
        level: ResolutionLevel { order, levels },
        iteration_share: 0.01 * tolerance,
    }
}

/// Peak bytes of one part at a resolution: vectors of the iterations, boxes of the preconditioner, line matrices.
pub fn memory(layout: &Layout, rung: &Rung, right_hand_sides: usize, bounds: bool) -> u64 {
    let (domain, _) = layout.domain(&rung.resolution);
    let dims = domain.primal_dims();
    let n = dims.iter().product::<usize>() as u64;
    // Per unknown: six double vectors, the scratch of the operator (two more), single-precision copies, the boxes
    // (about twice the array, two buffers each), and what is kept per right-hand side.
    let one = n * (8 * 8 + 2 * 4 + 2 * 2 * 4 + 2 * 8 * right_hand_sides as u64);
    let lines: u64 = dims.iter().map(|d| (d * d * 8 * 12) as u64).sum();
    (if bounds { 2 } else { 1 }) * (one + lines)
}

//! Choosing order and grading.
//!
//! Grids form a ladder on which the error falls by about the same factor from rung to rung. A cheap low rung or two
//! tell how far the error lies above the tolerance; the next solve is made where it should be met.

use crate::layout::Layout;
use crate::solution::{ResolutionLevel, Settings, Target};
use elastocap_geometry::grid::Resolution;

/// Size of a layer over the next larger one: between 0.12 (best below 1e-4) and 0.15 (best above), measured on the
/// in-plane pair.
const RATIO: f64 = 0.13;

/// Without bounds, the estimated error over what refining by two rungs (one layer, one order) gained. Two rungs lower
/// the error by a factor of 8 to 14 at the edges of boxes and of 3 to 5 at those of sheets: the true remainder is 0.08
/// to 0.47 gains.
pub const REMAINDER: f64 = 0.6;

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

/// What a grid is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Goal {
    tolerance: f64,
    target: Target,
    /// Layers outside the scene beyond what the target asks for.
    extra: usize,
}

impl Goal {
    fn new(settings: &Settings) -> Self {
        Self { tolerance: settings.relative_tolerance, target: settings.target, extra: 0 }
    }

    /// Layers between the scene and the element that reaches infinity.
    ///
    /// What the lower bound loses beyond a box R falls as 1 / R with a net charge (half of size / R on the isolated
    /// cube), as 1 / R^3 without.
    fn outer(&self) -> usize {
        let layers = match self.target {
            Target::Matrix => (2.0 / self.tolerance).ln() / -RATIO.ln(),
            Target::TwoTerminal => (0.02 / self.tolerance).ln() / (3.0 * -RATIO.ln()),
        };
        if let Some(o) = std::env::var("OUTER").ok().and_then(|o| o.parse().ok()) { return o; }
        layers.ceil().clamp(1.0, 12.0) as usize + self.extra
    }
}

/// The state of the search.
#[derive(Debug)]
pub struct Ladder {
    goal: Goal,
    /// Whether more layers outside the scene may help.
    open: bool,
    bounds: bool,
    fixed: Option<ResolutionLevel>,
    memory_limit: u64,
    /// Current rung.
    index: usize,
    /// Where the search goes once the current rung, its coarser companion, is solved.
    pending: Option<usize>,
    /// Rungs judged and the error found.
    seen: Vec<(usize, f64)>,
    shortfall: Option<String>,
}

/// Highest rung: eight layers, order ten, an error of about 1e-9 on the pair; beyond it rounding takes over.
const TOP: usize = 14;

/// Spread on each rung over that on rung 0. The in-plane pair and the cube in a cube agree on it within a fifth;
/// sheets, whose singularity is stronger, follow a power of it, which two rungs tell.
fn expected(index: usize) -> f64 {
    const MEASURED: [f64; 10] = [1.0, 0.39, 0.09, 0.033, 0.0082, 2.5e-3, 9e-4, 2.2e-4, 1.2e-4, 3e-5];
    MEASURED.get(index).copied().unwrap_or_else(|| MEASURED[9] * 0.36_f64.powi(index as i32 - 9))
}

impl Ladder {
    /// Starts a search; `contrast` is the permittivity contrast of open space (`None` in a closed scene).
    pub fn new(settings: &Settings, contrast: Option<f64>) -> Self {
        let t = settings.relative_tolerance;
        let first = usize::from(t < 2e-3) + usize::from(t < 2e-5);
        let fixed = settings.resolution;
        // Without bounds the error is told by comparing with the grid two rungs below: that one is solved first.
        let (index, pending) = match (settings.bounds, fixed) {
            (true, _) => (first, None),
            (false, None) => (0, Some(2)),
            (false, Some(_)) => (0, Some(1)),
        };
        Self {
            // Flux that goes on through layers is counted at the least favourable permittivity.
            goal: Goal { extra: usize::from(contrast.is_some_and(|c| c > 1.0)), ..Goal::new(settings) },
            open: contrast.is_some(),
            bounds: settings.bounds,
            fixed,
            memory_limit: settings.memory_limit,
            index,
            pending,
            seen: Vec::new(),
            shortfall: None,
        }
    }

    /// The rung to solve on now.
    pub fn rung(&self) -> Rung {
        match self.fixed {
            Some(level) if self.pending.is_some() => {
                let coarser = ResolutionLevel {
                    order: level.order.saturating_sub(1).max(1),
                    levels: level.levels.saturating_sub(1),
                };
                fixed(coarser, &self.goal)
            }
            Some(level) => fixed(level, &self.goal),
            None => rung(self.index, &self.goal),
        }
    }

    /// Identifies the current rung, and the coarser one its error is told from.
    pub fn rung_and_companion(&self) -> (usize, Option<usize>) {
        let step = if self.fixed.is_some() { 1 } else { 2 };
        (self.index, if self.bounds { None } else { self.index.checked_sub(step) })
    }

    /// Why the tolerance will not be reached, if it will not.
    pub fn shortfall(&self) -> Option<String> {
        self.shortfall.clone()
    }

    /// Takes the error found on the current rung (unknown on a rung that only serves as companion); whether another
    /// rung is to be solved.
    pub fn judge(&mut self, error: Option<f64>, memory: impl Fn(&Rung) -> u64) -> bool {
        if let Some(next) = self.pending.take() {
            self.index = next;
            return true;
        }
        let error = error.unwrap_or(f64::INFINITY);
        if self.fixed.is_some() {
            if error > self.goal.tolerance || error.is_nan() {
                self.shortfall = Some(format!("the error is {error:.1e} at the fixed resolution"));
            }
            return false;
        }
        let stagnates = self.seen.last().is_some_and(|(_, before)| error > 0.8 * before);
        self.seen.push((self.index, error));
        if error <= self.goal.tolerance {
            return false;
        }
        if stagnates && self.open && self.goal.extra < 4 {
            // Refining the scene did not help: it is open space that is too short.
            self.goal.extra += 1;
            self.seen.clear();
            return true;
        }
        if stagnates || error.is_nan() {
            let best = self.seen.iter().map(|(_, e)| *e).fold(f64::INFINITY, f64::min);
            self.shortfall = Some(format!("the error stays at {best:.1e}: double precision gives no more"));
            return false;
        }
        let power = match self.seen[..] {
            [.., (i, a), (j, b)] if a > b && b > 0.0 && a < 1.9 => {
                ((b / a).ln() / (expected(j) / expected(i)).ln()).clamp(0.3, 1.3)
            }
            _ => 1.0,
        };
        let foretold = |r: usize| error.min(1.9) * (expected(r) / expected(self.index)).powf(power);
        let mut next = (self.index + 1..=TOP).find(|r| foretold(*r) <= self.goal.tolerance).unwrap_or(TOP);
        // A large error says little about how far the goal is.
        next = next.min(self.index + if error > 0.5 { 2 } else { 6 });
        while next > self.index && memory(&rung(next, &self.goal)) > self.memory_limit {
            next -= 1;
        }
        if next == self.index {
            self.shortfall = Some(if self.index == TOP {
                format!("the error is {error:.1e} on the finest grid that double precision allows")
            } else {
                format!(
                    "the error is {error:.1e}; a finer grid would take more than {} MB",
                    self.memory_limit >> 20
                )
            });
            return false;
        }
        if !self.bounds && next - self.index != 2 {
            // The companion first, unless it is the rung just solved or lies below it.
            if next - self.index > 2 {
                (self.index, self.pending) = (next - 2, Some(next));
                return true;
            }
            next = self.index + 2;
        }
        self.index = next;
        true
    }
}

/// The rung on which a scene like the in-plane pair meets the tolerance.
pub fn foretold(settings: &Settings) -> Rung {
    const PAIR: f64 = 0.05;
    let goal = Goal::new(settings);
    match settings.resolution {
        Some(level) => fixed(level, &goal),
        None => {
            let met = |r: &usize| PAIR * expected(*r) <= settings.relative_tolerance;
            rung((0..TOP).find(met).unwrap_or(TOP), &goal)
        }
    }
}

/// Rung 0 has one layer and order 2; even rungs begin at degree 2 at the edges, odd ones at 3, and every second rung
/// adds a layer and an order.
fn rung(index: usize, goal: &Goal) -> Rung {
    let (levels, first) = (1 + index / 2, 2 + index % 2);
    let order = levels + 2 + index % 2;
    with(levels, order, first, goal)
}

fn fixed(level: ResolutionLevel, goal: &Goal) -> Rung {
    with(level.levels, level.order, 2.min(level.order), goal)
}

fn with(levels: usize, order: usize, first: usize, goal: &Goal) -> Rung {
    Rung {
        resolution: Resolution { order, levels, ratio: RATIO, slope: 1.0, first, outer: goal.outer() },
        level: ResolutionLevel { order, levels },
        // A part and the whole scene see other rounding in the single-precision preconditioner: they agree to 1e-10
        // only where the iteration's own error is small.
        iteration_share: (2e-3 * goal.tolerance.min(1e-3)).max(1e-14),
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

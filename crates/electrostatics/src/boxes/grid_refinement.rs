//! Refines a grid: next to edges by splitting elements, elsewhere by raising degrees, on each axis
//! independently.
//!
//! A tensor-product grid is refined by whole slabs. The energy of a slab's functions of the highest degree
//! along the axis (their *surplus*), and how fast the surplus falls with the degree, say how much energy
//! refining the slab would gain.

use crate::boxes::domain::Domain;
use crate::boxes::layout::Grid;
use elastocap_fem::line::Numbering;
use elastocap_geometry::meshing::grid::{Change, GradedAxis};
use std::collections::BTreeMap;

/// The energies of an element's functions of the highest degrees along its axis. They tell how much energy
/// the element misses, and the factor by which one more degree lowers that.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Missing {
    /// Energies of the two highest degrees, `[p - 1, p]`.
    pub surplus: [f64; 2],
    /// Energy of degree p - 2.
    pub third_highest: f64,
}

/// For every element of every axis, what tells how much energy it misses.
pub(crate) type Indicator = [Vec<Missing>; 3];

/// The surplus of every element, from the energies of the functions of each axis.
pub(crate) fn indicator(domain: &Domain, slices: &[Vec<f64>; 3]) -> Indicator {
    [0, 1, 2].map(|a| {
        let line = &domain.axes[a].line;
        let numbering = Numbering::new(line);
        let trim = domain.axes[a].functions().start;
        (0..line.elements())
            .map(|e| {
                let p = line.degree(e);
                let energy = |degree: usize| match degree {
                    0 | 1 => 0.0,
                    _ => slices[a].get(numbering.bubble[e] + degree - 2 - trim).copied().unwrap_or(0.0),
                };
                Missing {
                    surplus: [energy(p.saturating_sub(1)), energy(p)],
                    third_highest: energy(p.saturating_sub(2)),
                }
            })
            .collect()
    })
}

/// The indicator of a reflected grid, as one of the grid that was reflected.
pub(crate) fn folded(indicator: Indicator, mirrored: [bool; 3]) -> Indicator {
    let mut a = 0;
    indicator.map(|whole| {
        a += 1;
        if !mirrored[a - 1] {
            return whole;
        }
        let half = whole.len() / 2;
        (0..half)
            .map(|e| {
                let (x, y) = (whole[half + e], whole[half - 1 - e]);
                let surplus = [x.surplus[0] + y.surplus[0], x.surplus[1] + y.surplus[1]];
                Missing { surplus, third_highest: x.third_highest + y.third_highest }
            })
            .collect()
    })
}

/// `total += weight * part`.
pub(crate) fn add(total: &mut Indicator, part: &Indicator, weight: f64) {
    for (t, p) in total.iter_mut().zip(part) {
        t.resize(p.len(), Missing::default());
        for (t, p) in t.iter_mut().zip(p) {
            t.surplus[0] += weight * p.surplus[0];
            t.surplus[1] += weight * p.surplus[1];
            t.third_highest += weight * p.third_highest;
        }
    }
}

/// Size of the part at an edge over the element that is split there: between 0.12 and 0.15 is best (Gui and
/// Babuska's 0.15 holds for one edge alone), measured on the in-plane pair. Tuned:
/// `cargo bench --bench solver`.
const RATIO: f64 = 0.13;

/// Share of the missing energy that remains after a split at an edge: between 0.066 at the edges of boxes and
/// 0.13 at those of sheets. Tuned: the grids and unknowns that `cargo bench --bench targets` prints.
const SPLIT: f64 = 0.1;

impl Missing {
    /// The factor by which one more degree lowers the missing energy; pairs of degrees are compared since one
    /// alone may vanish by symmetry.
    fn rate(&self, degree: usize) -> f64 {
        let [second, top] = self.surplus;
        let by_one_degree = if degree >= 3 && second > 0.0 { top / second } else { 0.25 };
        let by_two_degrees = if degree >= 4 && self.third_highest > 0.0 {
            (top / self.third_highest).sqrt()
        } else {
            by_one_degree
        };
        by_one_degree.max(by_two_degrees).clamp(0.02, 0.8)
    }

    /// The energy that the element is estimated to miss: that of all higher degrees; or, if it is to be
    /// split, the energy of its highest degree.
    fn missed(&self, degree: usize, is_split: bool) -> f64 {
        let [second, top] = self.surplus;
        let rate = self.rate(degree);
        let top = top.max(second * rate * rate);
        if is_split { top } else { top * rate / (1.0 - rate) }
    }
}

/// One element, and the changes planned for it.
struct Item {
    /// Energy that the element should miss after the planned changes.
    missing: f64,
    /// The factor by which one more degree lowers that energy.
    rate: f64,
    /// Where the element is split, as a share of its length; `None` where its degree is raised instead.
    split: Option<f64>,
    /// Number of changes planned.
    planned: usize,
    /// Largest number of changes at a time.
    max_planned: usize,
    /// Functions on the axis that one change adds, over those the axis has.
    cost: f64,
}

impl Item {
    fn new(axis: &GradedAxis, e: usize, missing: &Missing) -> Self {
        let degree = axis.line.degree(e);
        let functions = Numbering::new(&axis.line).len as f64;
        let at_edge = axis.touches(e);
        let rate = missing.rate(degree);
        let length = |e: Option<usize>| e.and_then(|e| axis.length(e)).unwrap_or(f64::INFINITY);
        let split = match (at_edge, axis.length(e)) {
            (_, None) => None,
            ([true, true], _) => Some(0.5),
            ([true, false], _) => Some(RATIO),
            ([false, true], _) => Some(1.0 - RATIO),
            // Where a higher degree gains little the field varies within the element: split next to the
            // shorter neighbour.
            _ if rate > 0.45 && degree > 4 => {
                let (below, above) = (length(e.checked_sub(1)), length(Some(e + 1)));
                Some(if below < above { 2.0 * RATIO } else { 1.0 - 2.0 * RATIO })
            }
            _ => None,
        };
        let missing = missing.missed(degree, split.is_some());
        let added = if split.is_some() { degree as f64 + 1.0 } else { 1.0 };
        let max_planned = if split.is_some() { 2 } else { 4 };
        Self { missing, rate, split, planned: 0, max_planned, cost: added / functions }
    }

    /// Missing energy removed per relative growth of the grid.
    fn value(&self) -> f64 {
        if self.planned == self.max_planned { 0.0 } else { self.missing / self.cost }
    }

    /// Plans one more change.
    fn plan(&mut self) {
        self.planned += 1;
        self.missing *= if self.split.is_some() { SPLIT } else { self.rate };
    }
}

/// The energy missing on a grid, in the unit of the indicator.
pub(crate) fn missing(grid: &Grid, indicator: &Indicator) -> f64 {
    items(grid, indicator).iter().map(|(_, i)| i.missing).sum()
}

/// All elements of a grid, without changes, each after its axis and its number.
fn items(grid: &Grid, indicator: &Indicator) -> Vec<((usize, usize), Item)> {
    let elements = |a: usize| indicator[a].iter().enumerate().map(move |(e, m)| ((a, e), m));
    (0..3).flat_map(elements).map(|((a, e), m)| ((a, e), Item::new(&grid.axes[a], e, m))).collect()
}

/// Where elements that cannot be changed further miss more energy than the target, all others together need
/// not miss less than this share of it. Tuned: the grids and unknowns that `cargo bench --bench targets`
/// prints.
const BESIDE_EXHAUSTED: f64 = 0.3;

/// Plans changes where they reduce the missing energy most for their cost, until no more than `target` should
/// be missing or nothing more is worth planning.
fn plan(items: &mut [((usize, usize), Item)], target: f64) {
    let mut missing: f64 = items.iter().map(|(_, i)| i.missing).sum();
    let mut last: Option<f64> = None;
    loop {
        let exhausted = items.iter().filter(|(_, item)| item.planned == item.max_planned);
        let exhausted: f64 = exhausted.map(|(_, item)| item.missing).sum();
        let target = target.max((1.0 + BESIDE_EXHAUSTED) * exhausted);
        let best = (0..items.len()).max_by(|&i, &j| items[i].1.value().total_cmp(&items[j].1.value()));
        let Some((_, best)) = best.and_then(|i| items.get_mut(i)) else { break };
        let value = best.value();
        // Axes with equal errors are refined equally, whichever rounding puts first.
        let alike = last.is_some_and(|last| value >= last * (1.0 - 1e-3));
        if value <= 0.0 || !alike && missing <= target {
            break;
        }
        if !alike {
            last = Some(value);
        }
        missing -= best.missing;
        best.plan();
        missing += best.missing;
    }
}

/// Number of functions on each axis of the grid on which no more than `target` should be missing.
pub(crate) fn functions_wanted(grid: &Grid, indicator: &Indicator, target: f64) -> [usize; 3] {
    let mut items = items(grid, indicator);
    items.iter_mut().for_each(|(_, item)| item.max_planned = usize::MAX);
    plan(&mut items, target);
    [0, 1, 2].map(|a| {
        let line = &grid.axes[a].line;
        let added = items.iter().filter(|((axis, _), _)| *axis == a).map(|((_, e), item)| {
            // Every further layer next to an edge begins one degree higher than the one nearer to it.
            let n = item.planned;
            if item.split.is_some() { n * (line.degree(*e) + 1) + n * n.saturating_sub(1) / 2 } else { n }
        });
        Numbering::new(line).len + added.sum::<usize>()
    })
}

/// Refines where this reduces the missing energy most for its cost, until no more than `target` should be
/// missing. Returns the energy that should be missing afterwards.
pub(crate) fn refine(grid: &mut Grid, indicator: &Indicator, target: f64) -> f64 {
    refine_weighted(grid, indicator, target, |_, _| 1.0)
}

/// Refines as [`refine`] does, but counts the energy that an element misses `weight` times: an element is
/// given by its axis and its number.
pub(crate) fn refine_weighted(
    grid: &mut Grid,
    indicator: &Indicator,
    target: f64,
    weight: impl Fn(usize, usize) -> f64,
) -> f64 {
    let mut items = items(grid, indicator);
    items.iter_mut().for_each(|((a, e), item)| item.missing *= weight(*a, *e));
    plan(&mut items, target);
    let left = items.iter().map(|((a, e), item)| item.missing / weight(*a, *e)).sum();
    let mut changes: [BTreeMap<usize, Change>; 3] = Default::default();
    let mut again: [Vec<usize>; 3] = Default::default();
    for ((a, e), item) in &items {
        match (item.planned, item.split) {
            (0, _) => {}
            (by, None) => drop(changes[*a].insert(*e, Change::Raise(by))),
            (by, Some(share)) => {
                changes[*a].insert(*e, Change::Split(share));
                if by > 1 {
                    again[*a].push(*e);
                }
            }
        }
    }
    for a in 0..3 {
        let axis = &mut grid.axes[a];
        let first: Vec<(usize, Change)> = changes[a].iter().map(|(e, c)| (*e, *c)).collect();
        axis.change(&first);
        // A second split goes to the part at the edge. The number of that part has grown by the number of the
        // first splits below it.
        let splits_before =
            |e: usize| first.iter().filter(|(s, c)| *s < e && matches!(c, Change::Split(_))).count();
        let mut second: Vec<(usize, Change)> = Vec::new();
        for &e in &again[a] {
            let lower_part = e + splits_before(e);
            for part in [lower_part, lower_part + 1] {
                match axis.touches(part) {
                    [true, false] => second.push((part, Change::Split(RATIO))),
                    [false, true] => second.push((part, Change::Split(1.0 - RATIO))),
                    _ => {}
                }
            }
        }
        axis.change(&second);
    }
    left
}

//! The discrete domain of one solve: a graded grid, the conductors as blocks of it, the permittivity and the
//! walls.
//!
//! Lengths are in a unit that makes the scene of order one ([`crate::boxes::layout::Layout::unit`]); energies
//! are in the same unit.

use crate::boxes::placed_map::PlacedMap;
use elastocap_fem::embedding::embedding;
use elastocap_fem::line::{Line, LineEnd, Numbering};
use elastocap_fem::mixed::{FluxEnd, potential_offsets};
use elastocap_fem::reflection::{is_centre, is_symmetric};
use elastocap_geometry::scene::Wall;
use faer::Mat;
use std::ops::Range;

/// One axis of the grid. *Planes* are the coordinates at which a body or the scene begins or ends; the
/// elements between two neighbouring planes form an *interval*.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// The elements.
    pub line: Line,
    /// First element of each interval, and one past the last: one more entry than intervals.
    pub cuts: Vec<usize>,
    /// The wall at each of the two ends.
    pub walls: [Wall; 2],
    /// How flux continues to infinity beyond open ends; `None` where none may leave.
    pub rays: Option<Rays>,
}

/// Straight lines from a pole, along which flux that leaves the last finite nodes continues, decaying with
/// the square of the distance. Either all axes have them, with the same radius, or none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rays {
    /// Coordinate of the pole on this axis.
    pub pole: f64,
    /// Distance of the last finite nodes from the pole.
    pub radius: f64,
}

/// A block of intervals, `lo[a] .. hi[a]` on each axis; on the normal axis of a sheet `lo == hi`, the plane
/// it lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Block {
    /// First interval (= lower plane) on each axis.
    pub lo: [usize; 3],
    /// One past the last interval (= upper plane) on each axis.
    pub hi: [usize; 3],
}

/// A grid with conductors and permittivity.
#[derive(Debug, Clone)]
pub(crate) struct Domain {
    /// Three axes.
    pub axes: [Axis; 3],
    /// The blocks of all conductors. Several may belong to one conductor; those may touch or overlap.
    pub conductors: Vec<Block>,
    /// Relative permittivity of each cell of intervals, `[i][j][k]`.
    pub permittivity: Vec<f64>,
    /// The map that bends the scene, if one does.
    pub map: Option<PlacedMap>,
    /// Set where the domain is the half of a scene, for potentials that are even or odd under a half turn:
    /// the other parts of the scene.
    pub turn: Option<Box<OtherParts>>,
}

/// Parts of a scene on which a potential that is even or odd under a half turn is represented, besides the
/// half above the middle of the first axis.
#[derive(Debug, Clone)]
pub(crate) struct OtherParts {
    /// The half above the middle of the last axis.
    pub(crate) half: Domain,
    /// The quarter above both middles, with the conductors of both sides of the middle of the last axis:
    /// first with the walls for potentials that are odd across that middle, then with those for even ones.
    pub(crate) quarters: [Domain; 2],
    /// Whether the potential is odd under the turn.
    pub(crate) odd: bool,
}

impl Axis {
    /// Number of intervals.
    pub(crate) fn intervals(&self) -> usize {
        self.cuts.len() - 1
    }

    /// Index among the finite nodes of the plane below interval `m`; `None` for the end at infinity.
    pub(crate) fn plane_node(&self, m: usize) -> Option<usize> {
        let first = self.line.first_finite();
        let element = self.cuts[m];
        (element >= first && element - first < self.line.nodes.len()).then(|| element - first)
    }

    /// Whether the potential is held at zero at end `side`.
    fn held(&self, side: usize) -> bool {
        self.walls[side] == Wall::Grounded
    }

    /// Continuous functions of the axis that are not held by a wall, as a range of the line's numbering.
    pub(crate) fn functions(&self) -> Range<usize> {
        let n = Numbering::new(&self.line).len;
        usize::from(self.held(0))..n - usize::from(self.held(1))
    }

    /// The axis's functions that no wall holds (columns) in those of a finer axis with the same walls (rows);
    /// `None` where `finer` is not a refinement.
    pub(crate) fn functions_in(&self, finer: &Axis) -> Option<Mat<f64>> {
        let (rows, columns) = (finer.functions(), self.functions());
        let whole = embedding(&self.line, &finer.line)?;
        Some(whole.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len()).to_owned())
    }

    /// Functions (in the trimmed numbering of [`Axis::functions`]) strictly inside the intervals `lo..hi`:
    /// those that vanish on the planes bounding them, except on walls that hold nothing.
    ///
    /// Where `held[side]` is set, they vanish on the outer plane of that side, too.
    pub(crate) fn open(&self, lo: usize, hi: usize, held: [bool; 2]) -> Range<usize> {
        let numbering = Numbering::new(&self.line);
        let trim = usize::from(self.held(0));
        let start = if lo == 0 && !(held[0] && trim == 0) {
            0
        } else {
            self.plane_node(lo).map_or(0, |n| numbering.vertex[n] + 1 - trim)
        };
        let end = if hi == self.intervals() && (!held[1] || self.held(1)) {
            self.functions().len()
        } else {
            self.plane_node(hi).map_or(0, |n| numbering.vertex[n] - trim)
        };
        start..end
    }

    /// Functions (trimmed) of the closed intervals `lo..hi`, planes included; `lo == hi` is one plane.
    pub(crate) fn closed(&self, lo: usize, hi: usize) -> Range<usize> {
        let numbering = Numbering::new(&self.line);
        let trim = usize::from(self.held(0));
        let len = self.functions().len();
        let start = self.plane_node(lo).map_or(0, |n| numbering.vertex[n].saturating_sub(trim));
        let end = self.plane_node(hi).map_or(len, |n| (numbering.vertex[n] + 1 - trim).min(len));
        start..end
    }

    /// Trimmed indices of the vertex functions.
    pub(crate) fn vertices(&self) -> Vec<usize> {
        let range = self.functions();
        let numbering = Numbering::new(&self.line);
        numbering.vertex.iter().filter(|v| range.contains(v)).map(|v| v - range.start).collect()
    }

    /// For each finite node the trimmed index of the function that is 1 there; `None` where a wall holds it.
    pub(crate) fn vertex_functions(&self) -> Vec<Option<usize>> {
        let range = self.functions();
        let numbering = Numbering::new(&self.line);
        numbering.vertex.iter().map(|v| range.contains(v).then(|| v - range.start)).collect()
    }

    /// The function of highest degree of each element that has one of these degrees (in the trimmed numbering
    /// of [`Axis::functions`]), for each of the degrees.
    pub(crate) fn last_functions(&self, degrees: [usize; 2]) -> [Vec<usize>; 2] {
        let numbering = Numbering::new(&self.line);
        let trim = self.functions().start;
        degrees.map(|degree| {
            let elements =
                (0..self.line.elements()).filter(|e| degree >= 2 && self.line.degree(*e) == degree);
            elements.map(|e| numbering.bubble[e] + degree - 2 - trim).collect()
        })
    }

    /// Whether the axis is mirror-symmetric.
    pub(crate) fn is_symmetric(&self) -> bool {
        let centred = |rays: Rays| is_centre(&self.line, rays.pole);
        let cuts = self.cuts.iter().zip(self.cuts.iter().rev()).all(|(x, y)| x + y == self.line.elements());
        self.walls[0] == self.walls[1] && cuts && self.rays.is_none_or(centred) && is_symmetric(&self.line)
    }

    /// Potential modes of the intervals `lo..hi`.
    pub(crate) fn modes(&self, lo: usize, hi: usize) -> Range<usize> {
        let offsets = potential_offsets(&self.line);
        offsets[self.cuts[lo]]..offsets[self.cuts[hi]]
    }

    /// The condition on the flux at the two ends of the intervals `lo..hi`. An end inside the axis is taken
    /// to lie on a conductor.
    pub(crate) fn flux_ends(&self, lo: usize, hi: usize) -> [FluxEnd; 2] {
        let end = |side: usize, outer: bool| match (outer, self.walls[side]) {
            (true, Wall::Insulated) => FluxEnd::Blocked,
            (true, Wall::Open) if self.rays.is_none() => FluxEnd::Blocked,
            (true, Wall::Grounded | Wall::Open) | (false, _) => FluxEnd::Free,
        };
        [end(0, lo == 0), end(1, hi == self.intervals())]
    }

    /// Energy of the flux's continuation to infinity beyond the two ends of the intervals `lo..hi`, per
    /// squared flux through the last node and for unit permittivity: `factor` times that of a straight line,
    /// and zero where no flux leaves.
    pub(crate) fn continuation(&self, lo: usize, hi: usize, factor: [f64; 2]) -> [f64; 2] {
        let end = |side: usize, outer: bool| match self.rays {
            Some(rays) if outer && self.walls[side] == Wall::Open => factor[side] * rays.radius,
            _ => 0.0,
        };
        [end(0, lo == 0), end(1, hi == self.intervals())]
    }

    /// The axis without its infinite elements.
    pub(crate) fn truncated(&self) -> Self {
        let mut out = self.clone();
        let low = self.line.first_finite();
        for cut in &mut out.cuts {
            *cut = cut.saturating_sub(low).min(self.line.degrees.len());
        }
        out.line.ends = [LineEnd::Finite; 2];
        out
    }

    /// The axis for the preconditioner of the primal problem: where rays go to infinity, the outermost
    /// function decays as 1 / x. The number of functions and their order are unchanged.
    pub(crate) fn tailed(&self) -> Self {
        let Some(rays) = self.rays else { return self.clone() };
        let mut out = self.clone();
        let open = self.walls.map(|w| w == Wall::Open);
        let tail = LineEnd::Infinite { degree: 1, pole: rays.pole };
        out.line.ends = open.map(|open| if open { tail } else { LineEnd::Finite });
        let last = out.cuts.len() - 1;
        out.cuts[1..].iter_mut().for_each(|c| *c += usize::from(open[0]));
        out.cuts[last] += usize::from(open[1]);
        out
    }
}

impl OtherParts {
    /// These parts without infinite elements, see [`Domain::truncated`].
    pub(crate) fn truncated(&self) -> Self {
        let quarters = self.quarters.each_ref().map(Domain::truncated);
        Self { half: self.half.truncated(), quarters, odd: self.odd }
    }

    /// Parity under the turn: 1 for even potentials, -1 for odd ones.
    pub(crate) fn parity(&self) -> f64 {
        if self.odd { -1.0 } else { 1.0 }
    }
}

impl Domain {
    /// The domain up to the last finite nodes. Beyond them fluxes continue along rays, or not at all.
    pub(crate) fn truncated(&self) -> Self {
        let [a, b, c] = &self.axes;
        let turn = self.turn.as_ref().map(|turn| Box::new(turn.truncated()));
        Self { axes: [a.truncated(), b.truncated(), c.truncated()], turn, ..self.clone() }
    }

    /// Numbers of intervals.
    pub(crate) fn cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].intervals())
    }

    /// Permittivity of one cell of intervals.
    pub(crate) fn permittivity_of(&self, cell: [usize; 3]) -> f64 {
        let n = self.cells();
        self.permittivity[(cell[0] * n[1] + cell[1]) * n[2] + cell[2]]
    }

    /// Unknowns of the primal problem, conductors not subtracted.
    pub(crate) fn primal_dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].functions().len())
    }

    /// Unknowns of the dual problem, conductors not subtracted.
    pub(crate) fn dual_dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.axes[a].modes(0, self.axes[a].intervals()).len())
    }

    /// The permittivity as a product of one factor per axis and interval, if the whole domain has such a
    /// product.
    pub(crate) fn product(&self) -> Option<[Vec<f64>; 3]> {
        let n = self.cells();
        let corner = self.permittivity_of([0; 3]);
        let along = |a: usize| -> Vec<f64> {
            (0..n[a])
                .map(|m| {
                    let mut cell = [0; 3];
                    cell[a] = m;
                    // Layers lie across x2: that axis carries the absolute value.
                    self.permittivity_of(cell) / if a == 1 { 1.0 } else { corner }
                })
                .collect()
        };
        let f = [along(0), along(1), along(2)];
        let exact = (0..n[0]).all(|i| {
            (0..n[1]).all(|j| {
                (0..n[2]).all(|k| {
                    let e = self.permittivity_of([i, j, k]);
                    (f[0][i] * f[1][j] * f[2][k] - e).abs() <= 1e-14 * e
                })
            })
        });
        exact.then_some(f)
    }

    /// The permittivity over `block` as a product of one factor per axis and interval: exactly where it is
    /// one over the whole domain, else by geometric means.
    pub(crate) fn separable(&self, block: &Block) -> [Vec<f64>; 3] {
        if let Some(product) = self.product() {
            return product;
        }
        let n = self.cells();
        // A power of two is taken out. If all permittivities are larger by a power of two, the factors are
        // larger by exactly that: rounding, and with it every iterate, is the same.
        let least = self.permittivity.iter().copied().fold(f64::INFINITY, f64::min);
        let unit = power_of_two_in(least);
        let cells = || {
            (block.lo[0]..block.hi[0]).flat_map(move |i| {
                (block.lo[1]..block.hi[1])
                    .flat_map(move |j| (block.lo[2]..block.hi[2]).map(move |k| [i, j, k]))
            })
        };
        let count = cells().count().max(1) as f64;
        let log_of = |c: [usize; 3]| (self.permittivity_of(c) / unit).ln();
        let mean = cells().map(log_of).sum::<f64>() / count;
        let mut logs = [vec![0.0; n[0]], vec![0.0; n[1]], vec![0.0; n[2]]];
        for (a, log) in logs.iter_mut().enumerate() {
            let per = count / (block.hi[a] - block.lo[a]).max(1) as f64;
            for c in cells() {
                log[c[a]] += log_of(c) / per;
            }
            if a != 1 {
                log[block.lo[a]..block.hi[a]].iter_mut().for_each(|l| *l -= mean);
            }
        }
        let mut factors: [Vec<f64>; 3] = logs.map(|f| f.into_iter().map(f64::exp).collect());
        // As in [`Domain::product`], the second axis carries the absolute value.
        factors[1][block.lo[1]..block.hi[1]].iter_mut().for_each(|f| *f *= unit);
        factors
    }
}

/// The greatest power of two that is not above `x`, which is positive and normal.
fn power_of_two_in(x: f64) -> f64 {
    // The bits of the exponent are those of infinity.
    f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
}

/// Spreads values per interval to elements.
pub(crate) fn per_element(axis: &Axis, per_interval: &[f64]) -> Vec<f64> {
    (0..axis.intervals())
        .flat_map(|m| std::iter::repeat_n(per_interval[m], axis.cuts[m + 1] - axis.cuts[m]))
        .collect()
}

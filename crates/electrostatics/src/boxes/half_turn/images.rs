//! Half turns and point reflections: scenes that are their own image under mirrors of two or three axes together, but of none alone.
//!
//! Two interdigitated combs are the common example: a half turn puts each in the place of the other. The scene cannot be cut, but the
//! potential of one right-hand side is the turned potential of another, which the iteration then starts from and finds to be the
//! solution. Nothing is taken on trust: a start that is not the solution costs iterations, and a flux that aims at another field costs
//! sharpness of the lower bound.

use crate::boxes::domain::{Axis, Domain};
use elastocap_fem::reflection::reflected_functions;
use elastocap_fem::tensor::{Dims, SparseRows, along};
use faer::Mat;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Mirrors of all the axes that are marked, together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct HalfTurn {
    across: [bool; 3],
}

/// A right-hand side that is an earlier one after a half turn, times a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Image {
    /// The number of the earlier one.
    pub of: usize,
    turn: HalfTurn,
    sign: f64,
}

impl Image {
    /// The coefficients of the potential, given those of the one that it is an image of.
    pub(crate) fn of_potential(&self, domain: &Domain, u: &[f64]) -> Vec<f64> {
        self.applied(u, domain.primal_dims(), |a| {
            let free = domain.axes[a].functions();
            let all = reflected_functions(&domain.axes[a].line);
            all.as_ref().submatrix(free.start, free.start, free.len(), free.len()).to_owned()
        })
    }

    /// An array of coefficients, reflected along each axis that the turn is across by the matrix that `reflection` gives.
    pub(crate) fn applied(&self, x: &[f64], dims: Dims, reflection: impl Fn(usize) -> Mat<f64>) -> Vec<f64> {
        let mut out: Vec<f64> = x.par_iter().map(|x| self.sign * x).collect();
        for a in (0..3).filter(|a| self.turn.across[*a]) {
            (out, _) = along(a, &SparseRows::from_mat(reflection(a).as_ref()), &out, dims);
        }
        out
    }
}

/// For each right-hand side, given by the potentials of the domain's blocks, the earlier one whose image it is.
pub(crate) fn images(domain: &Domain, potentials: &[Vec<f64>]) -> Vec<Option<Image>> {
    let turns = if potentials.len() > 1 { half_turns(domain) } else { Vec::new() };
    let image = |k: usize| {
        (0..k).flat_map(|of| turns.iter().map(move |turn| (of, turn))).find_map(|(of, (turn, pairs))| {
            let goes =
                |sign: &f64| pairs.iter().all(|(b, to)| potentials[k][*to] == sign * potentials[of][*b]);
            [1.0, -1.0].into_iter().find(goes).map(|sign| Image { of, turn: *turn, sign })
        })
    };
    (0..potentials.len()).map(image).collect()
}

/// The half turns and point reflections of a domain, each with the pairs of blocks of which it brings a part of the first to the
/// second: the same conductor may be cut into blocks in more than one way.
fn half_turns(domain: &Domain) -> Vec<(HalfTurn, BTreeSet<(usize, usize)>)> {
    let symmetric = domain.axes.each_ref().map(Axis::is_symmetric);
    let several = [[true, false, true], [true, true, false], [false, true, true], [true; 3]];
    // A map is its own image where it is mirrored along each of the axes.
    let mirrored = |a: usize| domain.map.as_ref().is_none_or(|map| map.is_mirrored(a));
    let possible =
        several.into_iter().filter(|across| (0..3).all(|a| symmetric[a] && mirrored(a) || !across[a]));
    let turns: Vec<HalfTurn> = possible.map(|across| HalfTurn { across }).collect();
    if turns.is_empty() {
        return Vec::new();
    }
    let holders = Holders::new(domain);
    turns
        .into_iter()
        .filter(|turn| turn.keeps_permittivity(domain))
        .filter_map(|turn| Some((turn, holders.pairs(turn)?)))
        .collect()
}

impl HalfTurn {
    /// Where it brings a place, one of `n` on each axis.
    fn of(self, place: [usize; 3], n: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|a| if self.across[a] { n[a] - 1 - place[a] } else { place[a] })
    }

    fn keeps_permittivity(self, domain: &Domain) -> bool {
        let n = domain.cells();
        places(n).all(|cell| domain.permittivity_of(cell) == domain.permittivity_of(self.of(cell, n)))
    }
}

/// For every plane and interval of each axis in turn, and so for every corner, edge, face and cell, the block that it lies in.
struct Holders {
    n: [usize; 3],
    /// 1 + index of one of the blocks, 0 outside of all.
    block: Vec<u32>,
}

impl Holders {
    fn new(domain: &Domain) -> Self {
        let n = domain.cells().map(|n| 2 * n + 1);
        let mut block = vec![0; n.iter().product()];
        for (index, b) in domain.conductors.iter().enumerate() {
            for i in 2 * b.lo[0]..=2 * b.hi[0] {
                for j in 2 * b.lo[1]..=2 * b.hi[1] {
                    let row = (i * n[1] + j) * n[2];
                    block[row + 2 * b.lo[2]..=row + 2 * b.hi[2]].fill(index as u32 + 1);
                }
            }
        }
        Self { n, block }
    }

    fn at(&self, [i, j, k]: [usize; 3]) -> u32 {
        self.block[(i * self.n[1] + j) * self.n[2] + k]
    }

    /// The pairs of blocks of which a turn brings parts of the first to the second; `None` where it brings a part to no block.
    fn pairs(&self, turn: HalfTurn) -> Option<BTreeSet<(usize, usize)>> {
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
fn places(n: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..n[0]).flat_map(move |i| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |k| [i, j, k])))
}

//! Half turns and point reflections, for scenes that are symmetric under mirrors of two or three axes
//! together, but not under any mirror alone.
//!
//! The scene is then not cut (for some scenes, [`super::halves`] does that). The potential of one right-hand
//! side is the turned potential of another, from which the iteration starts and which it finds to be the
//! solution. Correctness does not rest on the symmetry: a start that is not the solution costs iterations,
//! and a flux that aims at another field makes the lower bound less sharp.

use super::halves::reflected;
use crate::boxes::domain::{Axis, Domain};
use crate::boxes::holders::{HalfTurn, Holders, places};
use elastocap_fem::tensor::{Dims, SparseRows, along};
use faer::Mat;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A right-hand side that is an earlier one after a half turn, times a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Image {
    /// The number of the earlier right-hand side.
    pub original: usize,
    /// The turn that takes the potential of the earlier one to that of this one, up to sign.
    turn: HalfTurn,
    /// The sign by which the turned potential of the earlier one is multiplied.
    sign: f64,
}

impl Image {
    /// The coefficients of the potential, given those of the one that it is an image of.
    pub(crate) fn of_potential(&self, domain: &Domain, u: &[f64]) -> Vec<f64> {
        self.applied(u, domain.primal_dims(), |a| reflected(&domain.axes[a]))
    }

    /// An array of coefficients, reflected along each axis that the turn is across. `reflection` gives the
    /// matrix of an axis.
    pub(crate) fn applied(&self, x: &[f64], dims: Dims, reflection: impl Fn(usize) -> Mat<f64>) -> Vec<f64> {
        let mut out: Vec<f64> = x.par_iter().map(|x| self.sign * x).collect();
        for a in (0..3).filter(|a| self.turn.is_across(*a)) {
            (out, _) = along(a, &SparseRows::from_mat(reflection(a).as_ref()), &out, dims);
        }
        out
    }
}

/// For each right-hand side, given by the potentials of the domain's blocks, the earlier one whose image it
/// is.
pub(crate) fn images(domain: &Domain, potentials: &[Vec<f64>]) -> Vec<Option<Image>> {
    // On half of a scene, the potential already is symmetric.
    let turns = if potentials.len() > 1 && domain.turn.is_none() { half_turns(domain) } else { Vec::new() };
    let image = |k: usize| {
        let mut candidates = (0..k).flat_map(|original| turns.iter().map(move |turn| (original, turn)));
        candidates.find_map(|(original, (turn, pairs))| {
            let is_image = |sign: &f64| {
                pairs.iter().all(|(b, to)| potentials[k][*to] == sign * potentials[original][*b])
            };
            [1.0, -1.0].into_iter().find(is_image).map(|sign| Image { original, turn: *turn, sign })
        })
    };
    (0..potentials.len()).map(image).collect()
}

/// The half turns and point reflections of a domain. With each come the pairs of blocks such that it takes a
/// part of the first block to a part of the second. A block may be in several pairs, since a conductor and
/// its image may be cut into different blocks.
fn half_turns(domain: &Domain) -> Vec<(HalfTurn, BTreeSet<(usize, usize)>)> {
    let symmetric = domain.axes.each_ref().map(Axis::is_symmetric);
    let sets_of_axes = [[true, false, true], [true, true, false], [false, true, true], [true; 3]];
    // A map is symmetric where it is mirrored along each of the axes.
    let mirrored = |a: usize| domain.map.as_ref().is_none_or(|map| map.is_mirrored(a));
    let possible =
        sets_of_axes.into_iter().filter(|across| (0..3).all(|a| symmetric[a] && mirrored(a) || !across[a]));
    let turns: Vec<HalfTurn> = possible.map(HalfTurn::across).collect();
    if turns.is_empty() {
        return Vec::new();
    }
    let holders = Holders::new(domain.cells(), domain.conductors.iter().enumerate());
    turns
        .into_iter()
        .filter(|turn| keeps_permittivity(*turn, domain))
        .filter_map(|turn| Some((turn, holders.pairs(turn)?)))
        .collect()
}

/// Whether a turn takes every cell to one of the same permittivity.
fn keeps_permittivity(turn: HalfTurn, domain: &Domain) -> bool {
    let n = domain.cells();
    places(n).all(|cell| domain.permittivity_of(cell) == domain.permittivity_of(turn.of(cell, n)))
}

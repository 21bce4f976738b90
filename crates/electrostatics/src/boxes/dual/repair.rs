//! The repair: a flux that cancels the divergence left by the linear solver.
//!
//! The scene's whole box without conductors is separable and can be inverted exactly, by the modes of its
//! axes.

use super::lines::mixed;
use super::precondition::modes_of;
use super::{Basis, Weights, others};
use crate::boxes::domain::{Axis, Block, Domain, per_element};
use crate::boxes::half_turn::fold::Fold;
use crate::boxes::ray_permittivity::RayPermittivity;
use crate::boxes::schwarz::{Modes, SeparableBox, row_block};
use crate::error::SolveError;
use elastocap_fem::condensed::Condensed;
use elastocap_fem::line::Numbering;
use elastocap_fem::mixed::{FluxCoordinates, FluxEnd};
use elastocap_fem::tensor::{Dims, add, dot, left, right, target};
use elastocap_linalg::dense;
use faer::Mat;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of a residual that may be left: the energy of the repair, a small share of the whole, is then known
/// to about as many digits.
const ENOUGH: f64 = 1e-9;

/// Rounding error of one entry of a product with the operator of the repair, as a share of the operator's
/// largest eigenvalue times the norm of the vector. An entry is a sum of some hundred products, whose errors
/// are not all of one sign.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A flux that cancels a divergence, except for a small rest.
#[derive(Debug)]
pub(crate) struct Repaired {
    /// psi = A'^-1 r, the potential of the flux.
    pub(crate) potential: Vec<f64>,
    /// The norm of the rest over that of r.
    pub(crate) left: f64,
    /// An upper bound on the energy of a flux that cancels the rest: its squared norm over the least
    /// eigenvalue of A'. It has to be multiplied by [`Dual::repair_excess`](super::Dual::repair_excess), as
    /// the energy of psi does.
    pub(crate) energy_left: f64,
}

/// The exact solver of the whole box without conductors.
#[derive(Debug)]
pub(super) struct Repair {
    /// The inverse of the box's operator, with the separable permittivity.
    solver: SeparableBox<f64>,
    /// Whether the constant has no energy, as where every wall is insulated.
    pub(super) singular: bool,
    /// Largest ratio of the separable permittivity of the repair to the true one, by which the repair's
    /// energy is multiplied.
    pub(super) excess: f64,
    /// T of each axis over its whole length, in the scaling of the separable permittivity.
    operator: [Condensed; 3],
    /// Root of the ratio of the separable permittivity to that of the scene, per cell of intervals; `None`
    /// where they agree.
    ratio: Option<Vec<f64>>,
    /// The separable permittivity, a product of one factor per axis and interval.
    factors: [Vec<f64>; 3],
    /// The factor by which straight continuations to infinity are multiplied.
    obliqueness: f64,
}

/// The repair of a domain.
#[derive(Debug)]
pub(super) enum Repairs {
    /// That of a whole scene, on its box.
    Whole(Box<Repair>),
    /// Where the domain is the half of a scene: one on each of two quarters of it, for what is odd across the
    /// middle of the last axis, and for what is even.
    Quarters(Box<Quarters>),
}

/// The repairs of the odd and the even part.
#[derive(Debug)]
pub(super) struct Quarters {
    /// The split of an array into its odd and its even part.
    fold: Fold,
    /// The solver of each part, and the scaling of its unknowns.
    parts: [(Repair, Weights); 2],
}

impl Repairs {
    /// The repairs on two quarters of a scene, given the domain and the bases of each.
    pub(super) fn of_quarters(
        fold: Fold,
        domains: &[Domain; 2],
        basis: [[Option<Basis>; 3]; 2],
    ) -> Result<Self, SolveError> {
        let part = |domain: &Domain, basis: &[Option<Basis>; 3]| -> Result<_, SolveError> {
            let repair = Repair::new(domain, basis, &RayPermittivity::new(domain))?;
            Ok((repair, Weights::new(domain, basis)))
        };
        let [odd, even] = [0, 1].map(|k| part(&domains[k], &basis[k]));
        Ok(Self::Quarters(Box::new(Quarters { fold, parts: [odd?, even?] })))
    }

    /// See [`Repair::solve`].
    pub(super) fn solve(&self, r: &[f64], near: Option<Vec<f64>>, dims: Dims, weights: &Weights) -> Repaired {
        let Quarters { fold, parts } = match self {
            Self::Whole(repair) => return repair.solve(r, near, dims, weights),
            Self::Quarters(quarters) => &**quarters,
        };
        let mut near = near.map_or([None, None], |near| fold.parts_of(&near).map(Some));
        let residuals = fold.parts_of(r);
        let [odd, even] = [0, 1].map(|k| {
            let (repair, weights) = &parts[k];
            repair.solve(&residuals[k], near[k].take(), fold.parts()[k], weights)
        });
        let mut psi = vec![0.0; r.len()];
        fold.add([&odd.potential, &even.potential], &mut psi);
        let square = |k: usize, left: f64| left * left * dot(&residuals[k], &residuals[k]);
        let size = dot(r, r);
        let left =
            if size > 0.0 { ((square(0, odd.left) + square(1, even.left)) / size).sqrt() } else { 0.0 };
        Repaired { potential: psi, left, energy_left: odd.energy_left + even.energy_left }
    }

    /// Whether the constant has no energy.
    pub(super) fn is_singular(&self) -> bool {
        match self {
            Self::Whole(repair) => repair.singular,
            Self::Quarters(quarters) => quarters.parts.iter().any(|(repair, _)| repair.singular),
        }
    }

    /// See [`Repair::excess`].
    pub(super) fn excess(&self) -> f64 {
        match self {
            Self::Whole(repair) => repair.excess,
            Self::Quarters(quarters) => {
                quarters.parts.iter().map(|(repair, _)| repair.excess).fold(1.0, f64::max)
            }
        }
    }
}

impl Repair {
    /// The solver for a domain. It assumes the greatest obliqueness and contrast for all flux that leaves:
    /// the true energy is never larger than that.
    pub(super) fn new(
        domain: &Domain,
        basis: &[Option<Basis>; 3],
        ray_permittivity: &RayPermittivity,
    ) -> Result<Self, SolveError> {
        let whole = Block { lo: [0; 3], hi: domain.cells() };
        let factors = domain.separable(&whole);
        let singular = domain.axes.iter().all(|a| a.flux_ends(0, a.intervals()) == [FluxEnd::Blocked; 2]);
        let mut operator = Vec::new();
        let mut modes = Vec::new();
        let largest = 3.0 * ray_permittivity.greatest_contrast(domain);
        for ((axis, factor), basis) in domain.axes.iter().zip(&factors).zip(basis) {
            let (n, basis) = (axis.intervals(), basis.as_ref());
            let segment = mixed(axis, basis, 0, n, factor, axis.flux_ends(0, n), [largest; 2])?;
            modes.push(Arc::new(Modes::new(&modes_of(axis, basis, 0, n, [false; 2], factor, largest)?)));
            operator.push(segment.operator()?);
        }
        let cells = domain.cells();
        let (mut excess, mut ratio, mut differs) = (1.0_f64, Vec::new(), false);
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                for k in 0..cells[2] {
                    let separable = factors[0][i] * factors[1][j] * factors[2][k];
                    let r = separable / domain.permittivity_of([i, j, k]);
                    differs |= (r - 1.0).abs() > 1e-14;
                    excess = excess.max(r);
                    ratio.push(r.sqrt());
                }
            }
        }
        let window = domain.dual_dims().map(|n| 0..n);
        let [m0, m1, m2]: [_; 3] = modes.try_into().map_err(|_| SolveError::Eigenvalues)?;
        let [o0, o1, o2]: [_; 3] = operator.try_into().map_err(|_| SolveError::Eigenvalues)?;
        let solver = SeparableBox::new(window, [m0, m1, m2]);
        Ok(Self {
            solver: if singular { solver.without_constant() } else { solver },
            singular,
            excess,
            operator: [o0, o1, o2],
            ratio: differs.then_some(ratio),
            factors,
            obliqueness: largest,
        })
    }

    /// The flux along axis `a` of unit entries of psi on a line: coefficients of the functions of the axis
    /// (rows) for modes (columns), with psi in the scaling of the separable permittivity and times
    /// [`Repair::root_across`].
    pub(super) fn flux_functions(
        &self,
        axis: &Axis,
        a: usize,
        basis: Option<&Basis>,
    ) -> Result<Mat<f64>, SolveError> {
        let (n, factor) = (axis.intervals(), &self.factors[a]);
        let ends = axis.flux_ends(0, n);
        let segment = mixed(axis, basis, 0, n, factor, ends, [self.obliqueness; 2])?;
        let continuation = axis.continuation(0, n, [self.obliqueness; 2]);
        let elements = axis.cuts[0]..axis.cuts[n];
        let coordinates =
            FluxCoordinates::new(&axis.line, elements, &per_element(axis, factor), ends, continuation)?;
        let free = dense::product(coordinates.coefficients().as_ref(), segment.root.as_ref());
        let mut out = Mat::zeros(Numbering::new(&axis.line).len, free.ncols());
        let first = usize::from(ends[0] == FluxEnd::Blocked);
        out.as_mut().subrows_mut(first, free.nrows()).copy_from(&free);
        Ok(out)
    }

    /// Root of the separable permittivity across axis `a`, at intervals of the two other axes.
    pub(super) fn root_across(&self, a: usize, [s, t]: [usize; 2]) -> f64 {
        let (p, q) = others(a);
        (self.factors[p][s] * self.factors[q][t]).sqrt()
    }

    /// Rescales `psi` of [`Repair::solve`] to the separable permittivity of the repair.
    pub(super) fn separable_scaling(&self, mut psi: Vec<f64>, dims: Dims, weights: &Weights) -> Vec<f64> {
        self.rescale(&mut psi, dims, weights, |x, ratio| x * ratio);
        psi
    }

    /// Replaces every entry of an array by `change` of the entry and of [`Repair::ratio`] there.
    fn rescale(
        &self,
        v: &mut [f64],
        [_, n1, n2]: Dims,
        weights: &Weights,
        change: impl Fn(f64, f64) -> f64 + Sync,
    ) {
        let Some(ratio) = &self.ratio else { return };
        let Weights { interval, cells, .. } = weights;
        v.par_chunks_mut((n1 * n2).max(1)).enumerate().for_each(|(i, slab)| {
            for (j, row) in slab.chunks_exact_mut(n2.max(1)).enumerate() {
                let row_ratios =
                    &ratio[(interval[0][i] * cells[1] + interval[1][j]) * cells[2]..][..cells[2]];
                row.iter_mut().zip(&interval[2]).for_each(|(v, c)| *v = change(*v, row_ratios[*c]));
            }
        });
    }

    /// The flux that cancels the divergence `r`. Starts from `near` if that is given.
    pub(super) fn solve(&self, r: &[f64], near: Option<Vec<f64>>, dims: Dims, weights: &Weights) -> Repaired {
        // r is scaled by the root of the scene's permittivity, the repair's operator by that of the separable
        // one.
        let to_own = |x: f64, ratio: f64| x / ratio;
        let mut target = r.to_vec();
        self.rescale(&mut target, dims, weights, to_own);
        let size = dot(&target, &target).sqrt();
        let relative_size = |rest: &[f64]| if size > 0.0 { dot(rest, rest).sqrt() / size } else { 0.0 };
        let mut rest = target.clone();
        let (mut psi, mut left) = match near {
            Some(near) if size > 0.0 => {
                let psi = self.separable_scaling(near, dims, weights);
                self.subtract_product(&psi, &mut rest, dims);
                let left = relative_size(&rest);
                (psi, left)
            }
            Some(_) | None => (vec![0.0; r.len()], 1.0),
        };
        let (mut work, mut step) = (Vec::new(), Vec::new());
        // One pass is exact up to rounding; a second removes most of the rounding, where there is much.
        for _ in 0..2 {
            if left < ENOUGH {
                break;
            }
            self.solver.solve(&rest, dims, &mut work, &mut step);
            add(&mut psi, &step);
            rest.copy_from_slice(&target);
            self.subtract_product(&psi, &mut rest, dims);
            left = relative_size(&rest);
        }
        let [least, greatest] = self.solver.eigenvalues();
        let rest = left * size + ROUNDING * greatest * dot(&psi, &psi).sqrt();
        let energy_left = if rest > 0.0 { rest * rest / least } else { 0.0 };
        self.rescale(&mut psi, dims, weights, to_own);
        Repaired { potential: psi, left, energy_left }
    }

    /// `rest -= A' psi`.
    fn subtract_product(&self, psi: &[f64], rest: &mut [f64], dims: Dims) {
        let [n0, n1, n2] = dims;
        let plane = n1 * n2;
        let minus: Vec<f64> = psi.par_iter().map(|p| -p).collect();
        // The results of `Condensed::between` for the lines of the first axis, one row of the second after
        // the other.
        let [along, second, third] = &self.operator;
        let width = along.nodes() * n2;
        let between = along.between_each(right(&minus, 0, n2, plane), n1, n2);
        let block = row_block(n0, plane);
        rest.par_chunks_mut(block * plane).enumerate().for_each_init(Vec::new, |work, (b, slabs)| {
            let first = b * block;
            let rows = first..first + slabs.len() / plane;
            for j in 0..n1 {
                let from = right(&minus, j * n2, n2, plane);
                let between = &between[j * width..(j + 1) * width];
                along.add_rows(rows.clone(), from, between, target(slabs, j * n2, plane));
            }
            for (i, slab) in slabs.chunks_exact_mut(plane).enumerate() {
                let start = (first + i) * plane;
                third.add_along_rows(left(&minus, start, n1, n2, n2), target(slab, 0, n2), work);
                second.add_along_columns(right(&minus, start, n2, n2), target(slab, 0, n2), work);
            }
        });
    }
}

//! Dirichlet's principle: continuous potentials of order p, whose energy bounds the capacitance from above.
//!
//! Unknowns are the coefficients of products of the hierarchical 1D functions, `[i][j][k]`; those of a
//! conductor's closed block are prescribed. In this basis both 1D matrices have a handful of entries per row,
//! so that the operator is cheap compared with the preconditioner.

mod energies;
pub(crate) mod faces;
mod surplus;
pub(crate) mod terms;
#[cfg(test)]
mod tests;

use crate::boxes::conductor_free::{FreeBox, free_boxes};
use crate::boxes::domain::{Domain, per_element};
use crate::boxes::half_turn::fold::Fold;
use crate::boxes::half_turn::halves::{not_in_quarters, reflected};
use crate::boxes::mapped::gradients::{EXTRA, Gradients, Work};
use crate::boxes::schwarz::{Modes, Schwarz, SchwarzWork, SeparableBox};
use crate::error::SolveError;
use elastocap_fem::line::line_matrices;
use elastocap_fem::modes::primal_modes;
use elastocap_fem::tensor::{Dims, SparseRows, Strips, Window, axpy, clear, target};
use elastocap_geometry::scene::Wall;
use elastocap_linalg::conjugate_gradients::{ITERATION_LIMIT, Operator};
use energies::Gradient;
use faces::Faces;
use faer::Mat;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use terms::{Product, separable_terms};

/// Factor by which the iteration limit is larger under a map. Not tuned: a limit that ordinary cases do not
/// reach.
const UNDER_MAP: usize = 2;

/// Rows of a strip of the matrices of the last axis. The columns of a strip reach beyond its rows by the
/// degree on either side: narrower strips spend more work on this overlap, wider ones more on zeros. Tuned:
/// `cargo bench --bench solver`.
const STRIP: usize = 16;

/// One separable part of the operator, K0 M1 M2 + M0 K1 M2 + M0 M1 K2, on a window of the array.
#[derive(Debug)]
struct Term {
    window: Window,
    /// The mass matrix M of each axis, with indices relative to the window.
    mass: [SparseRows<f64>; 3],
    /// The stiffness matrix K of each axis, with indices relative to the window.
    stiffness: [SparseRows<f64>; 3],
    /// Mass and stiffness of the last axis, for products with rows.
    last: [Strips; 2],
    /// The gradient along each axis, for energies.
    gradient: [Gradient; 3],
}

/// The operator, without open space beyond the last nodes and without what a map adds.
#[derive(Debug)]
struct Terms {
    /// Dimensions of the array of unknowns.
    dims: Dims,
    /// The separable parts that add up to the operator.
    terms: Vec<Term>,
    /// Results along the last two axes, between two passes over the array.
    scratch: Vec<f64>,
}

impl Term {
    /// Makes the part of the operator that belongs to a product of one factor per axis and interval, which is
    /// zero outside a block.
    fn new(domain: &Domain, (block, factors): &Product) -> Result<Self, SolveError> {
        let window = [0, 1, 2].map(|a| domain.axes[a].closed(block.lo[a], block.hi[a]));
        let matrices = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            let first = axis.functions().start + window[a].start;
            let (m, k) = line_matrices(&axis.line, &per_element(axis, &factors[a]));
            let cut = |m: Mat<f64>| {
                SparseRows::from_mat(m.as_ref().submatrix(first, first, window[a].len(), window[a].len()))
            };
            [cut(m), cut(k)]
        });
        let gradient = |a: usize| Gradient::new(&domain.axes[a], &factors[a], &window[a]);
        let gradient = [gradient(0)?, gradient(1)?, gradient(2)?];
        let last = matrices[2].each_ref().map(|matrix| Strips::of_rows(matrix, STRIP));
        let [[m0, k0], [m1, k1], [m2, k2]] = matrices;
        Ok(Self { mass: [m0, m1, m2], stiffness: [k0, k1, k2], last, window, gradient })
    }
}

impl Terms {
    /// y = A x on all functions, prescribed ones included.
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        let dims = self.dims;
        let plane = dims[1] * dims[2];
        if self.terms.len() != 1 {
            y.fill(0.0);
        }
        for (index, term) in self.terms.iter().enumerate() {
            let [w0, w1, w2] = &term.window;
            let (n0, n1, n2) = (w0.len(), w1.len(), w2.len());
            let sheet = n1 * n2;
            // c = M1 M2 x and d = (M1 K2 + K1 M2) x, side by side per slab; from a = M2 x and b = K2 x.
            self.scratch.resize(n0 * 2 * sheet, 0.0);
            self.scratch.par_chunks_mut(2 * sheet).enumerate().with_min_len(batch(sheet)).for_each_init(
                || vec![0.0; 2 * sheet],
                |ab, (i, cd)| {
                    let offset = ((w0.start + i) * dims[1] + w1.start) * dims[2] + w2.start;
                    for (matrix, first) in term.last.iter().zip([0, n2]) {
                        matrix.times_rows(&x[offset..], n1, dims[2], target(ab, first, 2 * n2), false);
                    }
                    let (c, d) = cd.split_at_mut(sheet);
                    for j in 0..n1 {
                        let (c, d) = (&mut c[j * n2..(j + 1) * n2], &mut d[j * n2..(j + 1) * n2]);
                        c.fill(0.0);
                        d.fill(0.0);
                        for &(s, m) in term.mass[1].row(j) {
                            let (a, b) = ab[s * 2 * n2..(s + 1) * 2 * n2].split_at(n2);
                            axpy(c, m, a);
                            axpy(d, m, b);
                        }
                        for &(s, k) in term.stiffness[1].row(j) {
                            axpy(d, k, &ab[s * 2 * n2..s * 2 * n2 + n2]);
                        }
                    }
                },
            );
            let (scratch, replace) = (&self.scratch, index == 0 && self.terms.len() == 1);
            let slabs = &mut y[w0.start * plane..w0.end * plane];
            slabs.par_chunks_mut(plane).enumerate().with_min_len(batch(sheet)).for_each(|(i, slab)| {
                if replace {
                    slab.fill(0.0);
                }
                let mut add = |weight: f64, source: &[f64]| {
                    if sheet == slab.len() {
                        axpy(slab, weight, source);
                    } else {
                        for j in 0..n1 {
                            let start = (w1.start + j) * dims[2] + w2.start;
                            axpy(&mut slab[start..start + n2], weight, &source[j * n2..(j + 1) * n2]);
                        }
                    }
                };
                for &(s, k) in term.stiffness[0].row(i) {
                    add(k, &scratch[s * 2 * sheet..][..sheet]);
                }
                for &(s, m) in term.mass[0].row(i) {
                    add(m, &scratch[s * 2 * sheet + sheet..][..sheet]);
                }
            });
        }
    }
}

/// Slabs handled by one task: enough work to be worth the start of a task.
fn batch(plane: usize) -> usize {
    (2048 / plane.max(1)).max(1)
}

/// The primal problem on one domain.
#[derive(Debug)]
pub(crate) struct Primal {
    /// Dimensions of the array of unknowns.
    dims: Dims,
    /// The functions that do not vanish on each block of the conductors.
    conductors: Vec<Window>,
    /// The vertex functions of each axis.
    vertices: [Vec<usize>; 3],
    terms: Terms,
    /// Open space beyond the last nodes.
    faces: Faces,
    /// The operator that the map of a bent scene adds, and the domain, for energies by a finer rule.
    bent: Option<(Gradients, Domain)>,
    /// Buffers of `bent`.
    bent_work: Work,
    /// Set where the potential is even or odd under a half turn.
    fold: Option<Fold>,
    /// The preconditioner.
    schwarz: Schwarz<f32>,
    /// Buffers of `schwarz`.
    work: SchwarzWork<f32>,
}

impl Primal {
    /// Assembles line matrices and box modes.
    pub(crate) fn new(domain: &Domain) -> Result<Self, SolveError> {
        Self::preconditioned(domain, schwarz(domain, domain.primal_dims())?)
    }

    /// Assembles line matrices only, for energies of known potentials: nothing can be solved for.
    pub(crate) fn without_preconditioner(domain: &Domain) -> Result<Self, SolveError> {
        Self::preconditioned(domain, Schwarz::new(Vec::new(), domain.primal_dims()))
    }

    /// Assembles line matrices, for a given preconditioner.
    fn preconditioned(domain: &Domain, schwarz: Schwarz<f32>) -> Result<Self, SolveError> {
        let dims = domain.primal_dims();
        let terms = separable_terms(domain)
            .iter()
            .map(|product| Term::new(domain, product))
            .collect::<Result<Vec<_>, SolveError>>()?;
        Ok(Self {
            dims,
            conductors: domain
                .conductors
                .iter()
                .map(|c| [0, 1, 2].map(|a| domain.axes[a].closed(c.lo[a], c.hi[a])))
                .collect(),
            vertices: [0, 1, 2].map(|a| domain.axes[a].vertices()),
            terms: Terms { dims, terms, scratch: Vec::new() },
            faces: Faces::new(domain),
            bent: Gradients::new(domain, EXTRA)?.map(|gradients| (gradients, domain.clone())),
            bent_work: Work::default(),
            fold: fold(domain)?,
            schwarz,
            work: SchwarzWork::default(),
        })
    }

    /// Iterations before giving up. The preconditioner is that of the boxes without a map: where the map
    /// squeezes space a hundredfold, as under a wide indenter, iterations make progress for longer.
    pub(crate) fn iteration_limit(&self) -> usize {
        if self.bent.is_some() { UNDER_MAP * ITERATION_LIMIT } else { ITERATION_LIMIT }
    }

    /// Coefficients that are `potentials[c]` on block c of the conductors and zero elsewhere.
    pub(crate) fn lift(&self, potentials: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.unknowns()];
        for (window, potential) in self.conductors.iter().zip(potentials) {
            let inside = |a: usize| self.vertices[a].iter().filter(move |v| window[a].contains(v));
            for i in inside(0) {
                for j in inside(1) {
                    for k in inside(2) {
                        u[(i * self.dims[1] + j) * self.dims[2] + k] = *potential;
                    }
                }
            }
        }
        u
    }

    /// y = A x over all functions, prescribed ones included.
    fn product(&mut self, x: &[f64], y: &mut [f64]) {
        self.terms.apply(x, y);
        self.faces.add_product(x, y, self.dims);
        if let Some((gradients, _)) = &self.bent {
            gradients.add_product(x, y, self.dims, &mut self.bent_work);
        }
    }

    /// The operator that the map adds, where one bends the scene.
    pub(crate) fn bent(&self) -> Option<&Gradients> {
        self.bent.as_ref().map(|(gradients, _)| gradients)
    }

    /// A u over all functions, prescribed ones included. Its products with the results of [`Primal::lift`]
    /// are charges.
    pub(crate) fn full_product(&mut self, u: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; u.len()];
        self.product(u, &mut out);
        out
    }

    /// A u without a map, over all functions.
    pub(crate) fn straight_product(&mut self, u: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; u.len()];
        self.terms.apply(u, &mut out);
        self.faces.add_product(u, &mut out, self.dims);
        out
    }

    /// Zeroes the prescribed entries, and projects on the parity under a half turn, if there is one.
    pub(crate) fn clear_prescribed(&self, v: &mut [f64]) {
        for window in &self.conductors {
            clear(v, self.dims, window);
        }
        if let Some(fold) = &self.fold {
            fold.project(v);
        }
    }
}

impl Operator for Primal {
    type Precision = f32;
    fn unknowns(&self) -> usize {
        self.dims.iter().product()
    }
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.product(x, y);
        self.clear_prescribed(y);
    }
    fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.schwarz.apply(r, z, &mut self.work);
    }
}

/// The split of potentials on the half of a scene into parts on its quarters; `None` for a whole scene.
fn fold(domain: &Domain) -> Result<Option<Fold>, SolveError> {
    let Some(turn) = &domain.turn else { return Ok(None) };
    // The function of the middle of the first axis is odd across the middle of the last where the potential
    // is odd under the turn, else even.
    let skipped = if turn.odd { [0, 1] } else { [1, 0] };
    Fold::new(domain.primal_dims(), reflected(&domain.axes[2]).as_ref(), skipped).map(Some)
}

/// The preconditioner of a domain; for the half of a scene, with the boxes of its quarters.
fn schwarz(domain: &Domain, dims: Dims) -> Result<Schwarz<f32>, SolveError> {
    let schwarz = boxes(domain, dims)?;
    let (Some(turn), Some(fold)) = (&domain.turn, fold(domain)?) else { return Ok(schwarz) };
    let [odd, even] = turn.quarters.each_ref().map(|quarter| boxes(quarter, quarter.primal_dims()));
    Ok(schwarz.with_quarters(fold, [odd?, even?]))
}

/// The inverses of the conductor-free boxes of a domain; for the half of a scene, without those that lie on
/// quarters of it.
fn boxes(domain: &Domain, dims: Dims) -> Result<Schwarz<f32>, SolveError> {
    let window =
        |b: &FreeBox| [0, 1, 2].map(|a| domain.axes[a].open(b.block.lo[a], b.block.hi[a], b.held[a]));
    let boxes: Vec<FreeBox> = not_in_quarters(domain, free_boxes(domain))
        .into_iter()
        .filter(|b| window(b).iter().all(|w| !w.is_empty()))
        .collect();
    let keyed: Vec<_> = boxes.iter().map(|b| axis_keys(domain, b)).collect();
    let mut distinct: BTreeMap<AxisKey, usize> = BTreeMap::new();
    for key in keyed.iter().flatten() {
        let next = distinct.len();
        distinct.entry(key.clone()).or_insert(next);
    }
    let mut modes: Vec<(AxisKey, usize)> = distinct.iter().map(|(k, v)| (k.clone(), *v)).collect();
    modes.sort_by_key(|(_, index)| *index);
    let modes: Vec<Arc<Modes<f32>>> = modes
        .par_iter()
        .map(|((a, lo, hi, closed, bits), _)| {
            let axis = &domain.axes[*a].tailed();
            let coefficient: Vec<f64> = bits.iter().map(|b| f64::from_bits(*b)).collect();
            let held = [0, 1].map(|side| {
                let outer = if side == 0 { *lo == 0 } else { *hi == axis.intervals() };
                !outer || closed[side] || axis.walls[side] == Wall::Grounded
            });
            let elements = axis.cuts[*lo]..axis.cuts[*hi];
            Ok(Arc::new(Modes::new(&primal_modes(
                &axis.line,
                elements,
                &per_element(axis, &coefficient),
                held,
            )?)))
        })
        .collect::<Result<_, SolveError>>()?;
    let boxes = boxes
        .iter()
        .zip(&keyed)
        .map(|(b, keys)| {
            SeparableBox::new(window(b), [0, 1, 2].map(|a| Arc::clone(&modes[distinct[&keys[a]]])))
        })
        .collect();
    Ok(Schwarz::new(boxes, dims))
}

/// What the modes of one axis of a box depend on: the axis, the first interval and one past the last, the
/// outer planes that are held, and the bits of the permittivity factor of every interval (1 outside the box).
pub(crate) type AxisKey = (usize, usize, usize, [bool; 2], Vec<u64>);

/// The keys of the modes of a box, one for each axis.
pub(crate) fn axis_keys(domain: &Domain, b: &FreeBox) -> [AxisKey; 3] {
    let (lo, hi) = (b.block.lo, b.block.hi);
    let factors = domain.separable(&b.block);
    [0, 1, 2].map(|a| {
        let bits = (0..domain.cells()[a])
            .map(|m| if (lo[a]..hi[a]).contains(&m) { factors[a][m] } else { 1.0 })
            .map(f64::to_bits)
            .collect();
        (a, lo[a], hi[a], b.held[a], bits)
    })
}

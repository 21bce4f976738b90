//! Sums A + lambda M on a part of the plan, for all modes of a line: what the preconditioner and the repair solve with.
//!
//! Each triangle has unknowns of its own, which are eliminated one by one because both of its matrices are diagonal in them; what
//! remains lives on corners and sides and is factorised for [`LANES`] modes at a time.

use elastocap_fem::modes::LineModes;
use elastocap_fem::tensor::{Real, left, multiply, right, target};
use elastocap_linalg::lanes::{Elimination, LANES, Lane, LaneFactor, Root, vectorized};
use elastocap_linalg::ordering::dissection_order;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// The matrices A and M of a triangle. In its inner unknowns A is diagonal and M the identity.
#[derive(Debug, Default)]
pub(super) struct Local {
    /// Unknowns on corners and sides.
    pub outer: usize,
    /// A between them, row by row.
    pub a: Vec<f64>,
    /// M between them; empty where it is zero.
    pub m: Vec<f64>,
    /// A between outer (rows) and inner ones.
    pub a_inner: Vec<f64>,
    /// M between outer and inner ones; empty where it is zero.
    pub m_inner: Vec<f64>,
    /// A of the inner unknowns.
    pub inner: Vec<f64>,
}

/// A form on some corners and sides besides those of the triangles: what continues beyond the frame.
#[derive(Debug, Clone)]
pub(super) struct Beyond {
    pub entities: Vec<u32>,
    /// Row by row.
    pub a: Vec<f64>,
    pub m: Vec<f64>,
}

/// The numbering of unknowns on a mesh: *entities*, corners or sides with some unknowns each, then the inner ones of the triangles.
#[derive(Debug)]
pub(super) struct Numbering {
    /// Of each triangle, in the order of its local matrices.
    pub entities: Vec<Vec<u32>>,
    /// The first row of each entity, and one past the last.
    pub rows: Vec<u32>,
    /// The first inner row of each triangle, and one past the last.
    pub inner_rows: Vec<u32>,
    /// Where each entity is, for the order of elimination.
    pub places: Vec<[f64; 2]>,
}

impl Numbering {
    pub(super) fn size(&self, entity: u32) -> usize {
        (self.rows[entity as usize + 1] - self.rows[entity as usize]) as usize
    }

    pub(super) fn len(&self) -> usize {
        self.inner_rows.last().map_or(0, |r| *r as usize)
    }
}

/// A part of the plan with a weight for each of its triangles.
#[derive(Debug)]
pub(super) struct PlaneSystem {
    elimination: Elimination,
    /// Triangles, each with the root of its weight.
    triangles: Vec<(u32, f64)>,
    /// For each of them the places in its local matrices, and among the unknowns, of what is free of it.
    places: Vec<Vec<(u32, u32)>>,
    beyond: Vec<(Beyond, Vec<Option<u32>>)>,
    /// The row of each unknown: those of the skeleton in the order of elimination, then inner ones.
    pub rows: Vec<u32>,
}

impl PlaneSystem {
    /// On the triangles with a weight; `free` tells which entities are unknown, `beyond` is added.
    pub(super) fn new(
        numbering: &Numbering,
        weights: &[Option<f64>],
        free: impl Fn(u32) -> bool,
        beyond: &[Beyond],
    ) -> Self {
        let triangles: Vec<(u32, f64)> =
            weights.iter().zip(0..).filter_map(|(w, t)| w.map(|w| (t, w.sqrt()))).collect();
        let order = order(numbering, &triangles);
        let mut block = vec![None; numbering.places.len()];
        let mut sizes = Vec::new();
        let mut starts = Vec::new();
        let mut rows: Vec<u32> = Vec::new();
        for entity in order {
            let size = numbering.size(entity);
            if size > 0 && free(entity) {
                block[entity as usize] = Some(sizes.len() as u32);
                sizes.push(size);
                starts.push(rows.len() as u32);
                let first = numbering.rows[entity as usize];
                rows.extend(first..first + size as u32);
            }
        }
        for (t, _) in &triangles {
            rows.extend(numbering.inner_rows[*t as usize]..numbering.inner_rows[*t as usize + 1]);
        }
        let blocks = |entities: &[u32]| entities.iter().map(|e| block[*e as usize]).collect::<Vec<_>>();
        let beyond: Vec<&Beyond> =
            beyond.iter().filter(|b| b.entities.iter().any(|e| block[*e as usize].is_some())).collect();
        let mut groups: Vec<Vec<Option<u32>>> =
            triangles.iter().map(|(t, _)| blocks(&numbering.entities[*t as usize])).collect();
        groups.extend(beyond.iter().map(|b| blocks(&b.entities)));
        let first = |group: &Vec<Option<u32>>| -> Vec<Option<u32>> {
            group.iter().map(|b| b.map(|b| starts[b as usize])).collect()
        };
        let (own, others) = groups.split_at(triangles.len());
        let of_triangle = |(group, (t, _)): (&Vec<Option<u32>>, &(u32, f64))| {
            places(&numbering.entities[*t as usize], &first(group), numbering)
        };
        Self {
            elimination: Elimination::new(&sizes, &groups),
            places: own.iter().zip(&triangles).map(of_triangle).collect(),
            beyond: beyond.into_iter().cloned().zip(others.iter().map(first)).collect(),
            triangles,
            rows,
        }
    }

    /// Factorises the sums for some modes. `None` if one is not positive definite.
    fn factorise<T: Real + Root>(
        &self,
        numbering: &Numbering,
        locals: &[Local],
        lambda: &Lane<f64>,
    ) -> Option<LaneFactor<T>> {
        let sizes = |group: u32| -> Vec<usize> {
            let entities = match self.triangles.get(group as usize) {
                Some((t, _)) => &numbering.entities[*t as usize],
                None => &self.beyond[group as usize - self.triangles.len()].0.entities,
            };
            entities.iter().map(|e| numbering.size(*e)).collect()
        };
        let mut coupling: Vec<Lane<f64>> = Vec::new();
        self.elimination.factorise(sizes, |group, out| {
            let Some((t, root)) = self.triangles.get(group as usize) else {
                let (beyond, firsts) = &self.beyond[group as usize - self.triangles.len()];
                let places = places(&beyond.entities, firsts, numbering);
                let n: usize = beyond.entities.iter().map(|e| numbering.size(*e)).sum();
                for (i, _) in &places {
                    for (j, _) in &places {
                        let k = *i as usize * n + *j as usize;
                        out.push(combined(beyond.a[k], at(&beyond.m, k), lambda));
                    }
                }
                return;
            };
            let local = &locals[*t as usize];
            let places = &self.places[group as usize];
            let inner = local.inner.len();
            // With the roots of the diagonal taken into the coupling.
            let mut inverse = [Lane::splat(0.0); 64];
            for (d, s) in inverse.iter_mut().zip(&local.inner) {
                for k in 0..LANES {
                    d.0[k] = 1.0 / (s + lambda.0[k]).sqrt();
                }
            }
            coupling.clear();
            for (i, _) in places {
                for k in 0..inner {
                    coupling.push(local.coupling(*i as usize, k, lambda).times(inverse[k]));
                }
            }
            let weight = root * root;
            let (n, width) = (local.outer, places.len());
            out.resize(width * width, Lane::splat(0.0));
            for (row, (i, _)) in places.iter().enumerate() {
                for (column, (j, _)) in places[..=row].iter().enumerate() {
                    let k = *i as usize * n + *j as usize;
                    let mut value = combined(local.a[k], at(&local.m, k), lambda);
                    let (a, b) = (&coupling[row * inner..][..inner], &coupling[column * inner..][..inner]);
                    for (a, b) in a.iter().zip(b) {
                        value = value.minus(a.times(*b));
                    }
                    let value = value.times(Lane::splat(weight));
                    out[row * width + column] = value;
                    out[column * width + row] = value;
                }
            }
        })
    }

    /// Overwrites each of several `x`, which have a row of lanes for each of the unknowns, with the solution.
    fn solve<T: Real + Root>(
        &self,
        locals: &[Local],
        lambda: &Lane<f64>,
        factor: &LaneFactor<T>,
        all: &mut [Vec<Lane<T>>],
    ) {
        let unknowns = self.elimination.unknowns();
        let (mut skeletons, mut inner) = (Vec::new(), Vec::new());
        for x in all {
            let (skeleton, own) = x.split_at_mut(unknowns);
            skeletons.push(skeleton);
            inner.push(own);
        }
        vectorized(|| self.eliminate_inner(locals, lambda, &mut skeletons, &mut inner));
        self.elimination.solve(factor, &mut skeletons);
        vectorized(|| self.substitute_inner(locals, lambda, &skeletons, &mut inner));
    }

    /// Divides the inner unknowns by their diagonal, and takes what they contribute off those of the skeleton.
    #[inline(always)]
    fn eliminate_inner<T: Real>(
        &self,
        locals: &[Local],
        lambda: &Lane<f64>,
        skeletons: &mut [&mut [Lane<T>]],
        inner: &mut [&mut [Lane<T>]],
    ) {
        let mut first = 0;
        let mut couplings = Vec::new();
        for ((t, root), places) in self.triangles.iter().zip(&self.places) {
            let local = &locals[*t as usize];
            let count = local.inner.len();
            local.couplings(places, lambda, &mut couplings);
            let root = T::from_f64(*root);
            for (skeleton, inner) in skeletons.iter_mut().zip(inner.iter_mut()) {
                let own = &mut inner[first..first + count];
                for (y, s) in own.iter_mut().zip(&local.inner) {
                    *y = y.times(inverse_of(*s, lambda));
                }
                for ((_, place), line) in places.iter().zip(couplings.chunks_exact(count.max(1))) {
                    let mut sum = Lane::default();
                    for (c, y) in line.iter().zip(own.iter()) {
                        sum = sum.plus(c.times(*y));
                    }
                    let at = &mut skeleton[*place as usize];
                    *at = at.minus(sum.times(Lane::splat(root)));
                }
            }
            first += count;
        }
    }

    /// Takes what the skeleton contributes off the inner unknowns.
    #[inline(always)]
    fn substitute_inner<T: Real>(
        &self,
        locals: &[Local],
        lambda: &Lane<f64>,
        skeletons: &[&mut [Lane<T>]],
        inner: &mut [&mut [Lane<T>]],
    ) {
        let mut first = 0;
        let mut couplings = Vec::new();
        for ((t, root), places) in self.triangles.iter().zip(&self.places) {
            let local = &locals[*t as usize];
            let count = local.inner.len();
            local.couplings(places, lambda, &mut couplings);
            let root = T::from_f64(*root);
            for (skeleton, inner) in skeletons.iter().zip(inner.iter_mut()) {
                let own = &mut inner[first..first + count];
                let mut sums = [Lane::default(); 64];
                for ((_, place), line) in places.iter().zip(couplings.chunks_exact(count.max(1))) {
                    let value = skeleton[*place as usize].times(Lane::splat(root));
                    for (c, sum) in line.iter().zip(&mut sums) {
                        *sum = sum.plus(c.times(value));
                    }
                }
                for ((y, s), sum) in own.iter_mut().zip(&local.inner).zip(&sums) {
                    *y = y.minus(sum.times(inverse_of(*s, lambda)));
                }
            }
            first += count;
        }
    }
}

#[inline(always)]
fn rounded<T: Real>(x: Lane<f64>) -> Lane<T> {
    let mut out = Lane::default();
    for k in 0..LANES {
        out.0[k] = T::from_f64(x.0[k]);
    }
    out
}

/// The inverses of A + lambda M for an inner unknown.
#[inline(always)]
fn inverse_of<T: Real>(a: f64, lambda: &Lane<f64>) -> Lane<T> {
    let mut out = Lane::default();
    for k in 0..LANES {
        // Divided after rounding: vectors of single precision divide several times as fast.
        out.0[k] = T::from_f64(1.0) / T::from_f64(a + lambda.0[k]);
    }
    out
}

impl Local {
    /// Couplings of the outer unknowns at `places` with the inner ones, row by row.
    #[inline(always)]
    fn couplings<T: Real>(&self, places: &[(u32, u32)], lambda: &Lane<f64>, out: &mut Vec<Lane<T>>) {
        out.clear();
        for (i, _) in places {
            out.extend((0..self.inner.len()).map(|j| rounded(self.coupling(*i as usize, j, lambda))));
        }
    }

    #[inline(always)]
    fn coupling(&self, outer: usize, inner: usize, lambda: &Lane<f64>) -> Lane<f64> {
        let k = outer * self.inner.len() + inner;
        combined(self.a_inner[k], at(&self.m_inner, k), lambda)
    }
}

#[inline(always)]
fn combined(a: f64, m: f64, lambda: &Lane<f64>) -> Lane<f64> {
    let mut out = Lane::splat(0.0);
    for k in 0..LANES {
        out.0[k] = a + lambda.0[k] * m;
    }
    out
}

/// An entry of a matrix, of which nothing is stored where it is zero.
#[inline(always)]
fn at(matrix: &[f64], k: usize) -> f64 {
    matrix.get(k).copied().unwrap_or(0.0)
}

/// The places in a local matrix, and among the unknowns, of what is free of some entities, given the first unknown of each.
fn places(entities: &[u32], firsts: &[Option<u32>], numbering: &Numbering) -> Vec<(u32, u32)> {
    let mut out = Vec::new();
    let mut local = 0;
    for (entity, first) in entities.iter().zip(firsts) {
        let size = numbering.size(*entity);
        if let Some(first) = first {
            out.extend((0..size as u32).map(|k| (local + k, first + k)));
        }
        local += size as u32;
    }
    out
}

/// The order in which entities are eliminated.
fn order(numbering: &Numbering, triangles: &[(u32, f64)]) -> Vec<u32> {
    let of = |t: u32| &numbering.entities[t as usize];
    match triangles.first().map(|(t, _)| of(*t).len()) {
        None => Vec::new(),
        Some(3) => {
            let elements: Vec<[u32; 3]> =
                triangles.iter().map(|(t, _)| [0, 1, 2].map(|k| of(*t)[k])).collect();
            dissection_order(&numbering.places, &elements)
        }
        Some(_) => {
            let elements: Vec<[u32; 6]> =
                triangles.iter().map(|(t, _)| [0, 1, 2, 3, 4, 5].map(|k| of(*t)[k])).collect();
            dissection_order(&numbering.places, &elements)
        }
    }
}

/// The inverse on the product of a part of the plan and a part of the line.
#[derive(Debug)]
pub(super) struct Region<T> {
    system: Arc<PlaneSystem>,
    /// The part of the line.
    window: Range<usize>,
    /// For each batch of modes their vectors, one row for each function of the window.
    vectors: Vec<Vec<T>>,
    /// Transposed.
    transposed: Vec<Vec<T>>,
    batches: Vec<(Lane<f64>, LaneFactor<T>)>,
    /// What the unknowns are multiplied by before and after.
    scaling: Scaling,
}

/// What unknowns are multiplied by: a number for each piece of the window and each row.
#[derive(Debug, Clone, Default)]
pub(super) struct Scaling {
    /// Where the pieces are in the window; none for 1 everywhere.
    pub pieces: Vec<Range<usize>>,
    /// Row after row, a number for each piece.
    pub factors: Vec<f64>,
}

impl Scaling {
    fn apply<T: Real>(&self, row: usize, values: &mut [T]) {
        let own = self.factors.get(row * self.pieces.len()..).unwrap_or(&[]);
        for (piece, factor) in self.pieces.iter().zip(own) {
            let factor = T::from_f64(*factor);
            values[piece.clone()].iter_mut().for_each(|x| *x = *x * factor);
        }
    }
}

/// Rows of one product.
const ROWS: usize = 256;

impl<T: Real + Root> Region<T> {
    /// On the functions of the window, whose modes are given. `None` if a sum is not positive definite.
    fn new(
        system: Arc<PlaneSystem>,
        numbering: &Numbering,
        locals: &[Local],
        window: Range<usize>,
        modes: &LineModes,
    ) -> Option<Self> {
        let LineModes { vectors, values } = modes;
        let count = values.len();
        let starts: Vec<usize> = (0..count).step_by(LANES).collect();
        // The last batch is filled up with its last mode, whose copies count for nothing.
        let mode = |start: usize, k: usize| (start + k).min(count - 1);
        let n = window.len();
        let of = |start: usize, i: usize, k: usize| {
            if start + k < count { T::from_f64(vectors[(i, start + k)]) } else { T::default() }
        };
        let lanes = starts.iter().map(|s| {
            (0..n).flat_map(|i| (0..LANES).map(move |k| (i, k))).map(|(i, k)| of(*s, i, k)).collect()
        });
        let across = starts.iter().map(|s| {
            (0..LANES).flat_map(|k| (0..n).map(move |i| (i, k))).map(|(i, k)| of(*s, i, k)).collect()
        });
        let (vectors, transposed) = (lanes.collect(), across.collect());
        let batches: Option<Vec<_>> = starts
            .par_iter()
            .map(|&start| {
                let mut lambda = Lane::splat(0.0);
                (0..LANES).for_each(|k| lambda.0[k] = values[mode(start, k)]);
                Some((lambda, system.factorise(numbering, locals, &lambda)?))
            })
            .collect();
        Some(Self { system, window, vectors, transposed, batches: batches?, scaling: Scaling::default() })
    }

    /// Adds the solutions for several right-hand sides `r`, arrays of rows with `width` numbers each, to `z`.
    pub(super) fn add_solutions<U: Real>(
        &self,
        locals: &[Local],
        r: &[&[U]],
        z: &mut [&mut [U]],
        width: usize,
    ) {
        let (n, rows) = (self.window.len(), self.system.rows.len());
        let place = |row: u32| row as usize * width + self.window.start;
        let gather = |r: &&[U]| {
            let mut gathered = vec![T::default(); rows * n];
            gathered.par_chunks_mut(n).with_min_len(ROWS).enumerate().for_each(|(k, out)| {
                let own = &r[place(self.system.rows[k])..][..n];
                out.iter_mut().zip(own).for_each(|(x, r)| *x = T::from_f64(r.to_f64()));
                self.scaling.apply(k, out);
            });
            gathered
        };
        let mut gathered: Vec<Vec<T>> = r.iter().map(gather).collect();
        // For each batch of modes those of all right-hand sides.
        let solutions: Vec<Vec<Vec<T>>> = self
            .batches
            .par_iter()
            .zip(&self.vectors)
            .map(|((lambda, factor), vectors)| {
                let mut flat = vec![T::default(); rows * LANES];
                let lanes = |gathered: &Vec<T>| -> Vec<Lane<T>> {
                    multiply(
                        left(gathered, 0, rows, n, n),
                        right(vectors, 0, LANES, LANES),
                        target(&mut flat, 0, LANES),
                        false,
                    );
                    let lane = |c: &[T]| {
                        let mut lane = Lane::default();
                        lane.0.copy_from_slice(c);
                        lane
                    };
                    flat.chunks_exact(LANES).map(lane).collect()
                };
                let mut all: Vec<Vec<Lane<T>>> = gathered.iter().map(lanes).collect();
                self.system.solve(locals, lambda, factor, &mut all);
                all.iter().map(|x| x.iter().flat_map(|lane| lane.0).collect()).collect()
            })
            .collect();
        for (side, (gathered, z)) in gathered.iter_mut().zip(z).enumerate() {
            gathered.par_chunks_mut(n * ROWS).enumerate().for_each(|(chunk, out)| {
                let rows = out.len() / n;
                for (k, (solution, vectors)) in solutions.iter().zip(&self.transposed).enumerate() {
                    let own = left(&solution[side], chunk * ROWS * LANES, rows, LANES, LANES);
                    multiply(own, right(vectors, 0, n, n), target(out, 0, n), k > 0);
                }
            });
            for (k, (own, row)) in gathered.chunks_exact_mut(n).zip(&self.system.rows).enumerate() {
                let out = &mut z[place(*row)..][..n];
                self.scaling.apply(k, own);
                out.iter_mut().zip(own).for_each(|(z, x)| *z += U::from_f64(x.to_f64()));
            }
        }
    }
}

/// An inverse, in single or in double precision.
#[derive(Debug)]
pub(super) enum Inverse {
    Single(Region<f32>),
    Double(Region<f64>),
}

impl Inverse {
    /// In single precision, or in double precision where triangles are too flat for that; see [`Region::new`]. `None` if a sum is not
    /// positive definite in double precision either.
    pub(super) fn new(
        system: PlaneSystem,
        numbering: &Numbering,
        locals: &[Local],
        window: Range<usize>,
        modes: &LineModes,
    ) -> Option<Self> {
        let system = Arc::new(system);
        let single =
            Region::new(Arc::clone(&system), numbering, locals, window.clone(), modes).map(Self::Single);
        single.or_else(|| Region::new(system, numbering, locals, window, modes).map(Self::Double))
    }

    /// The same in double precision, of what is in single precision here. `None` if it is in double precision already, or a sum is not
    /// positive definite.
    pub(super) fn doubled(&self, numbering: &Numbering, locals: &[Local], modes: &LineModes) -> Option<Self> {
        let Self::Single(region) = self else { return None };
        let (system, window) = (Arc::clone(&region.system), region.window.clone());
        Region::new(system, numbering, locals, window, modes).map(Self::Double)
    }

    /// Sets what the unknowns are multiplied by before and after.
    pub(super) fn scale(&mut self, scaling: Scaling) {
        match self {
            Self::Single(region) => region.scaling = scaling,
            Self::Double(region) => region.scaling = scaling,
        }
    }

    /// Adds the solutions for several right-hand sides `r` to `z`.
    pub(super) fn add_solutions<U: Real>(
        &self,
        locals: &[Local],
        r: &[&[U]],
        z: &mut [&mut [U]],
        width: usize,
    ) {
        match self {
            Self::Single(region) => region.add_solutions(locals, r, z, width),
            Self::Double(region) => region.add_solutions(locals, r, z, width),
        }
    }
}

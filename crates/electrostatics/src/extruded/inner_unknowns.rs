//! Elimination of the unknowns inside triangles from the system for those on corners and sides.

use super::local::{Local, Place};
use elastocap_fem::tensor::Real;
use elastocap_linalg::lanes::{LANES, Lane, vectorized};

/// Largest number of unknowns on the corners and sides of a triangle, and largest number of its inner
/// unknowns.
const MAX_UNKNOWNS: usize = 64;

/// Rows or columns that are summed side by side, since each sum is a chain of dependent additions. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const AT_ONCE: usize = 4;

/// The couplings of the inner unknowns of some triangles to those on their corners and sides, in the
/// precision of an inverse.
#[derive(Debug)]
pub(super) struct InnerUnknowns<T> {
    /// Number of inner unknowns of each triangle.
    counts: Vec<usize>,
    /// The diagonal of A in the inner unknowns, triangle after triangle.
    diagonal: Vec<T>,
    /// Couplings in A times the root of the weight: triangle after triangle, a row for each place.
    a: Vec<T>,
    /// Couplings in M times the root of the weight, in the order of those in A; empty where all are zero.
    m: Vec<T>,
}

impl<T: Real> InnerUnknowns<T> {
    /// Gathers the couplings of `triangles`, each of which is given with the root of its weight; `places` has
    /// the places of the unknowns on its corners and sides that are free.
    pub(super) fn new(locals: &[Local], triangles: &[(u32, f64)], places: &[Vec<Place>]) -> Self {
        let elements = || triangles.iter().map(|(t, root)| (&locals[*t as usize], *root)).zip(places);
        let coupled = elements().any(|((local, _), _)| !local.m_inner.is_empty());
        let (mut a, mut m) = (Vec::new(), Vec::new());
        for ((local, root), places) in elements() {
            let count = local.inner.len();
            for (i, _) in places {
                let row = *i as usize * count..(*i as usize + 1) * count;
                a.extend(local.a_inner[row.clone()].iter().map(|x| T::from_f64(root * x)));
                if coupled {
                    let value = |k: usize| local.m_inner.get(k).map_or(0.0, |x| root * x);
                    m.extend(row.map(|k| T::from_f64(value(k))));
                }
            }
        }
        Self {
            counts: elements().map(|((local, _), _)| local.inner.len()).collect(),
            diagonal: elements().flat_map(|((local, _), _)| &local.inner).map(|x| T::from_f64(*x)).collect(),
            a,
            m,
        }
    }

    /// Divides the inner unknowns by their diagonal, and subtracts their contributions from the unknowns of
    /// the skeleton. Each of the `R` right-hand sides has the `skeleton` unknowns on corners and sides first,
    /// then the inner ones.
    pub(super) fn eliminate<const R: usize>(
        &self,
        places: &[Vec<Place>],
        lambda: &Lane<T>,
        skeleton: usize,
        vectors: &mut [&mut [Lane<T>]; R],
    ) {
        vectorized(|| match self.m.is_empty() {
            true => self.eliminate_with::<R, false>(places, lambda, skeleton, vectors),
            false => self.eliminate_with::<R, true>(places, lambda, skeleton, vectors),
        });
    }

    /// Subtracts the contributions of the skeleton from the inner unknowns, after
    /// [`InnerUnknowns::eliminate`] and the solution for the skeleton.
    pub(super) fn substitute<const R: usize>(
        &self,
        places: &[Vec<Place>],
        lambda: &Lane<T>,
        skeleton: usize,
        vectors: &mut [&mut [Lane<T>]; R],
    ) {
        vectorized(|| match self.m.is_empty() {
            true => self.substitute_with::<R, false>(places, lambda, skeleton, vectors),
            false => self.substitute_with::<R, true>(places, lambda, skeleton, vectors),
        });
    }

    /// The couplings of a triangle in A and M from `offset` on, a row for each place; those in A twice
    /// without `WITH_M`.
    #[inline(always)]
    fn rows<const WITH_M: bool>(&self, offset: usize, entries: usize) -> (&[T], &[T]) {
        let a = &self.a[offset..][..entries];
        (a, if WITH_M { &self.m[offset..][..entries] } else { a })
    }

    /// [`InnerUnknowns::eliminate`], with or without couplings in M.
    #[inline(always)]
    fn eliminate_with<const R: usize, const WITH_M: bool>(
        &self,
        places: &[Vec<Place>],
        lambda: &Lane<T>,
        skeleton: usize,
        vectors: &mut [&mut [Lane<T>]; R],
    ) {
        let mut y = [[Lane::default(); R]; MAX_UNKNOWNS];
        let (mut first, mut offset) = (skeleton, 0);
        for (places, &count) in places.iter().zip(&self.counts) {
            let (a, m) = self.rows::<WITH_M>(offset, places.len() * count);
            let y = &mut y[..count];
            for (k, y) in y.iter_mut().enumerate() {
                let inverse = inverse(self.diagonal[first - skeleton + k], lambda);
                for s in 0..R {
                    let unknown = &mut vectors[s][first + k];
                    *unknown = unknown.times(inverse);
                    y[s] = *unknown;
                }
            }
            let whole = places.len() / AT_ONCE * AT_ONCE;
            for row in (0..whole).step_by(AT_ONCE) {
                let mut sum = [[Lane::default(); R]; AT_ONCE];
                for (k, y) in y.iter().enumerate() {
                    for i in 0..AT_ONCE {
                        let index = (row + i) * count + k;
                        let c = coupling::<T, WITH_M>(a[index], m[index], lambda);
                        for s in 0..R {
                            sum[i][s] = sum[i][s].plus(c.times(y[s]));
                        }
                    }
                }
                for i in 0..AT_ONCE {
                    for s in 0..R {
                        let unknown = &mut vectors[s][places[row + i].1 as usize];
                        *unknown = unknown.minus(sum[i][s]);
                    }
                }
            }
            for row in whole..places.len() {
                let mut sum = [Lane::default(); R];
                for (k, y) in y.iter().enumerate() {
                    let c = coupling::<T, WITH_M>(a[row * count + k], m[row * count + k], lambda);
                    for s in 0..R {
                        sum[s] = sum[s].plus(c.times(y[s]));
                    }
                }
                for s in 0..R {
                    let unknown = &mut vectors[s][places[row].1 as usize];
                    *unknown = unknown.minus(sum[s]);
                }
            }
            first += count;
            offset += places.len() * count;
        }
    }

    /// [`InnerUnknowns::substitute`], with or without couplings in M.
    #[inline(always)]
    fn substitute_with<const R: usize, const WITH_M: bool>(
        &self,
        places: &[Vec<Place>],
        lambda: &Lane<T>,
        skeleton: usize,
        vectors: &mut [&mut [Lane<T>]; R],
    ) {
        let mut x = [[Lane::default(); R]; MAX_UNKNOWNS];
        let (mut first, mut offset) = (skeleton, 0);
        for (places, &count) in places.iter().zip(&self.counts) {
            let (a, m) = self.rows::<WITH_M>(offset, places.len() * count);
            let x = &mut x[..places.len()];
            for (x, (_, place)) in x.iter_mut().zip(places) {
                for s in 0..R {
                    x[s] = vectors[s][*place as usize];
                }
            }
            let whole = count / AT_ONCE * AT_ONCE;
            for k in (0..whole).step_by(AT_ONCE) {
                let mut sum = [[Lane::default(); R]; AT_ONCE];
                for (row, x) in x.iter().enumerate() {
                    for i in 0..AT_ONCE {
                        let index = row * count + k + i;
                        let c = coupling::<T, WITH_M>(a[index], m[index], lambda);
                        for s in 0..R {
                            sum[i][s] = sum[i][s].plus(c.times(x[s]));
                        }
                    }
                }
                for i in 0..AT_ONCE {
                    let inverse = inverse(self.diagonal[first - skeleton + k + i], lambda);
                    for s in 0..R {
                        let unknown = &mut vectors[s][first + k + i];
                        *unknown = unknown.minus(sum[i][s].times(inverse));
                    }
                }
            }
            for k in whole..count {
                let mut sum = [Lane::default(); R];
                for (row, x) in x.iter().enumerate() {
                    let c = coupling::<T, WITH_M>(a[row * count + k], m[row * count + k], lambda);
                    for s in 0..R {
                        sum[s] = sum[s].plus(c.times(x[s]));
                    }
                }
                let inverse = inverse(self.diagonal[first - skeleton + k], lambda);
                for s in 0..R {
                    let unknown = &mut vectors[s][first + k];
                    *unknown = unknown.minus(sum[s].times(inverse));
                }
            }
            first += count;
            offset += places.len() * count;
        }
    }
}

/// a + lambda m; without `WITH_M`, m is zero.
#[inline(always)]
fn coupling<T: Real, const WITH_M: bool>(a: T, m: T, lambda: &Lane<T>) -> Lane<T> {
    if WITH_M { Lane::splat(a).plus(lambda.times(Lane::splat(m))) } else { Lane::splat(a) }
}

/// The inverses of A + lambda M for an inner unknown.
#[inline(always)]
fn inverse<T: Real>(a: T, lambda: &Lane<T>) -> Lane<T> {
    let mut out = Lane::default();
    for k in 0..LANES {
        out.0[k] = T::from_f64(1.0) / (a + lambda.0[k]);
    }
    out
}

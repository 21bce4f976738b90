//! The contribution of each function of an axis to the energy. The contribution of the functions of the
//! highest degree, the surplus, shows where a grid is too coarse, and in which direction.

use super::{Primal, Term};
use elastocap_fem::tensor::{Dims, SparseRows, axpy, target};
use rayon::prelude::*;

impl Primal {
    /// Energy of the part of `u` that each function of each axis carries: its square, without its products
    /// with others.
    pub(crate) fn slice_energies(&self, u: &[f64]) -> [Vec<f64>; 3] {
        let mut out = self.dims.map(|n| vec![0.0; n]);
        for term in &self.terms.terms {
            let energies = term.slice_energies(u, self.dims);
            for a in 0..3 {
                out[a][term.window[a].clone()].iter_mut().zip(&energies[a]).for_each(|(o, e)| *o += e);
            }
        }
        out
    }
}

/// Adds to `out` row `i` of the product of a matrix with slabs of `x`, which are as long as `out`, begin at
/// `offset` and are `stride` entries apart.
fn combine(out: &mut [f64], matrix: &SparseRows<f64>, i: usize, x: &[f64], offset: usize, stride: usize) {
    for &(s, weight) in matrix.row(i) {
        let start = s * stride + offset;
        axpy(out, weight, &x[start..start + out.len()]);
    }
}

fn diagonal(matrix: &SparseRows<f64>, i: usize) -> f64 {
    matrix.row(i).iter().find(|(j, _)| *j == i).map_or(0.0, |(_, v)| *v)
}

impl Term {
    /// What the term contributes to [`Primal::slice_energies`], for the functions of its window.
    fn slice_energies(&self, u: &[f64], dims: Dims) -> [Vec<f64>; 3] {
        let [w0, w1, w2] = &self.window;
        let (n0, n1, n2) = (w0.len(), w1.len(), w2.len());
        let sheet = n1 * n2;
        let mut values = vec![0.0; n0 * sheet];
        // u M2 and u K2, one after the other per slab.
        let mut products = vec![0.0; n0 * 2 * sheet];
        values.par_chunks_mut(sheet).zip(products.par_chunks_mut(2 * sheet)).enumerate().for_each(
            |(i, (values, products))| {
                let offset = ((w0.start + i) * dims[1] + w1.start) * dims[2] + w2.start;
                for (j, row) in values.chunks_exact_mut(n2).enumerate() {
                    row.copy_from_slice(&u[offset + j * dims[2]..offset + j * dims[2] + n2]);
                }
                for (matrix, out) in self.last.iter().zip(products.chunks_exact_mut(sheet)) {
                    matrix.times_rows(values, n1, n2, target(out, 0, n2), false);
                }
            },
        );
        let [m0, m1, m2] = &self.mass;
        let [k0, k1, k2] = &self.stiffness;
        let last: Vec<[f64; 2]> = (0..n2).map(|k| [diagonal(m2, k), diagonal(k2, k)]).collect();
        let per_slab: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..n0)
            .into_par_iter()
            .map(|i| {
                let slab_values = &values[i * sheet..(i + 1) * sheet];
                let slab = |parts: &[(&SparseRows<f64>, &[f64], usize, usize)]| {
                    let mut out = vec![0.0; sheet];
                    parts.iter().for_each(|(m, x, from, stride)| combine(&mut out, m, i, x, *from, *stride));
                    out
                };
                // M0 M2 u, (K0 M2 + M0 K2) u, M0 u and K0 u.
                let mass = slab(&[(m0, &products, 0, 2 * sheet)]);
                let rest = slab(&[(k0, &products, 0, 2 * sheet), (m0, &products, sheet, 2 * sheet)]);
                let by_mass = slab(&[(m0, &values, 0, sheet)]);
                let by_stiffness = slab(&[(k0, &values, 0, sheet)]);
                let slab_products = &products[i * 2 * sheet..(i + 1) * 2 * sheet];
                let (mut first, mut second, mut third) = (0.0, vec![0.0; n1], vec![0.0; n2]);
                // Rows of M1 M2 u, (K1 M2 + M1 K2) u, M1 M0 u and (K1 M0 + M1 K0) u.
                let (mut p, mut q, mut r, mut s) =
                    (vec![0.0; n2], vec![0.0; n2], vec![0.0; n2], vec![0.0; n2]);
                for j in 0..n1 {
                    for v in [&mut p, &mut q, &mut r, &mut s] {
                        v.fill(0.0);
                    }
                    combine(&mut p, m1, j, slab_products, 0, n2);
                    combine(&mut q, k1, j, slab_products, 0, n2);
                    combine(&mut q, m1, j, &slab_products[sheet..], 0, n2);
                    combine(&mut r, m1, j, &by_mass, 0, n2);
                    combine(&mut s, k1, j, &by_mass, 0, n2);
                    combine(&mut s, m1, j, &by_stiffness, 0, n2);
                    let row = j * n2..(j + 1) * n2;
                    let u = &slab_values[row.clone()];
                    let dot = |x: &[f64]| u.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
                    first += diagonal(k0, i) * dot(&p) + diagonal(m0, i) * dot(&q);
                    second[j] +=
                        diagonal(k1, j) * dot(&mass[row.clone()]) + diagonal(m1, j) * dot(&rest[row]);
                    for k in 0..n2 {
                        third[k] += u[k] * (last[k][1] * r[k] + last[k][0] * s[k]);
                    }
                }
                (first, second, third)
            })
            .collect();
        let mut out = [Vec::with_capacity(n0), vec![0.0; n1], vec![0.0; n2]];
        for (first, second, third) in per_slab {
            out[0].push(first);
            out[1].iter_mut().zip(second).for_each(|(o, x)| *o += x);
            out[2].iter_mut().zip(third).for_each(|(o, x)| *o += x);
        }
        out
    }
}

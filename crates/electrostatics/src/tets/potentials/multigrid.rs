//! The preconditioner: one symmetric multigrid cycle.
//!
//! From order p to order 1 on the same mesh, from there on by smoothed aggregation (Vanek, Mandel, Brezina 1996) of points
//! that are strongly connected; symmetric Gauss-Seidel smoothing everywhere, and the last few hundred unknowns exactly.

use super::csr::Csr;
use super::space::{NONE, Space};
use rayon::prelude::*;

/// Unknowns that are solved for directly.
const DIRECT: usize = 400;
/// Of the geometric mean of two diagonal entries, what makes a connection strong on the finest level of aggregates.
const STRONG: f64 = 0.08;

/// Levels from fine to coarse.
#[derive(Debug)]
pub(super) struct Multigrid {
    levels: Vec<Level>,
    last: Option<Cholesky>,
}

#[derive(Debug)]
struct Level {
    matrix: Csr,
    inverse_diagonal: Vec<f64>,
    /// From the next level to this one, and its transpose.
    transfer: Option<(Csr, Csr)>,
}

/// Memory of one cycle at a time, per level.
#[derive(Debug)]
pub(super) struct Work(Vec<Vectors>);

#[derive(Debug)]
struct Vectors {
    residual: Vec<f64>,
    right: Vec<f64>,
    coarse: Vec<f64>,
    step: Vec<f64>,
}

impl Multigrid {
    /// For the matrix of `space`; `linear` is the matrix of order 1 on the same mesh, unless `space` is that.
    pub(super) fn new(matrix: Csr, linear: Option<(Csr, &Space)>, space: &Space) -> Self {
        let mut levels = Vec::new();
        let mut matrix = matrix;
        if let Some((coarse, coarse_space)) = linear {
            let transfer = from_linear(space, coarse_space);
            levels.push(Level::new(matrix, Some(transfer)));
            matrix = coarse;
        }
        let mut strong = STRONG;
        while matrix.rows() > DIRECT {
            let Some(transfer) = smoothed_aggregates(&matrix, strong) else { break };
            let down = transfer.transposed();
            let coarse = down.times(&matrix.times(&transfer));
            levels.push(Level::new(matrix, Some(transfer)));
            matrix = coarse;
            strong *= 0.5;
        }
        let last = (matrix.rows() <= 4 * DIRECT).then(|| Cholesky::new(&matrix));
        levels.push(Level::new(matrix, None));
        Self { levels, last }
    }

    /// The matrix whose inverse the cycle stands in for.
    pub(super) fn matrix(&self) -> &Csr {
        &self.levels[0].matrix
    }

    pub(super) fn work(&self) -> Work {
        let of = |level: &Level| {
            let coarse = level.transfer.as_ref().map_or(0, |t| t.0.columns);
            let zeros = |n: usize| vec![0.0; n];
            Vectors {
                residual: zeros(level.matrix.rows()),
                right: zeros(coarse),
                coarse: zeros(coarse),
                step: zeros(coarse),
            }
        };
        Work(self.levels.iter().map(of).collect())
    }

    /// x = M^-1 r.
    pub(super) fn apply(&self, r: &[f64], x: &mut [f64], work: &mut Work) {
        self.cycle(0, r, x, &mut work.0);
    }

    fn cycle(&self, at: usize, r: &[f64], x: &mut [f64], work: &mut [Vectors]) {
        let level = &self.levels[at];
        let Some((here, below)) = work.split_first_mut() else { return };
        let Some((up, down)) = &level.transfer else {
            match &self.last {
                Some(exact) => exact.solve(r, x),
                None => {
                    level.forward(r, x);
                    level.backward(r, x);
                }
            }
            return;
        };
        level.forward(r, x);
        level.residual_after_forward(x, &mut here.residual);
        down.product(&here.residual, &mut here.right, |new, _| new);
        self.cycle(at + 1, &here.right, &mut here.coarse, below);
        // Levels of aggregates are so much smaller each that a second visit costs little; it keeps the rate.
        if at > 0 {
            self.levels[at + 1].matrix.product(&here.coarse, &mut here.right, |product, old| old - product);
            self.cycle(at + 1, &here.right, &mut here.step, below);
            for (x, step) in here.coarse.iter_mut().zip(&here.step) {
                *x += step;
            }
        }
        up.product(&here.coarse, x, |correction, x| x + correction);
        level.backward(r, x);
    }
}

impl Level {
    fn new(matrix: Csr, up: Option<Csr>) -> Self {
        let inverse_diagonal =
            matrix.diagonal().into_iter().map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
        let transfer = up.map(|up| {
            let down = up.transposed();
            (up, down)
        });
        Self { matrix, inverse_diagonal, transfer }
    }

    /// (D + L) x = r: a forward sweep from zero.
    fn forward(&self, r: &[f64], x: &mut [f64]) {
        for i in 0..x.len() {
            let mut sum = r[i];
            for (j, a) in self.matrix.terms(i) {
                if j >= i {
                    break;
                }
                sum -= a * x[j];
            }
            x[i] = sum * self.inverse_diagonal[i];
        }
    }

    /// r - A x after [`Level::forward`], which leaves the upper triangle only.
    fn residual_after_forward(&self, x: &[f64], residual: &mut [f64]) {
        residual.par_iter_mut().enumerate().with_min_len(4096).for_each(|(i, residual)| {
            let (columns, values) = self.matrix.row(i);
            let mut sum = 0.0;
            for (c, a) in columns.iter().zip(values).rev() {
                let j = *c as usize;
                if j <= i {
                    break;
                }
                sum -= a * x[j];
            }
            *residual = sum;
        });
    }

    /// A backward sweep.
    fn backward(&self, r: &[f64], x: &mut [f64]) {
        for i in (0..x.len()).rev() {
            let product: f64 = self.matrix.terms(i).map(|(j, a)| a * x[j]).sum();
            x[i] += (r[i] - product) * self.inverse_diagonal[i];
        }
    }
}

/// Values at the places of the functions of `space` of a potential of order 1 on the same mesh.
fn from_linear(space: &Space, linear: &Space) -> Csr {
    let free: Vec<usize> = (0..space.functions()).filter(|&d| space.unknown()[d] != NONE).collect();
    Csr::build(free.len(), linear.unknowns(), |i, terms| {
        for (point, weight) in space.linear(free[i]) {
            let unknown = linear.unknown()[point as usize];
            if unknown != NONE {
                terms.push((unknown, weight));
            }
        }
    })
}

/// The map from aggregates of strongly connected unknowns, smoothed once; `None` if there are hardly fewer of them.
fn smoothed_aggregates(matrix: &Csr, strong: f64) -> Option<Csr> {
    let n = matrix.rows();
    let diagonal = matrix.diagonal();
    let is_strong =
        |i: usize, j: usize, a: f64| i != j && a * a > strong * strong * (diagonal[i] * diagonal[j]).abs();
    let mut aggregate = vec![NONE; n];
    let mut count = 0_u32;
    // Unknowns none of whose neighbours is taken yet begin an aggregate with all of them.
    for i in 0..n {
        let neighbours = || matrix.terms(i).filter(|&(j, a)| is_strong(i, j, a)).map(|(j, _)| j);
        if aggregate[i] != NONE || neighbours().any(|j| aggregate[j] != NONE) || neighbours().next().is_none()
        {
            continue;
        }
        aggregate[i] = count;
        neighbours().for_each(|j| aggregate[j] = count);
        count += 1;
    }
    // Others join where their strongest neighbour is.
    let first = aggregate.clone();
    for i in (0..n).filter(|&i| first[i] == NONE) {
        let weight = |j: usize, a: f64| a.abs() / diagonal[j].abs().sqrt();
        let best = matrix
            .terms(i)
            .filter(|&(j, a)| first[j] != NONE && is_strong(i, j, a))
            .max_by(|p, q| weight(p.0, p.1).total_cmp(&weight(q.0, q.1)));
        if let Some((j, _)) = best {
            aggregate[i] = first[j];
        }
    }
    for i in 0..n {
        if aggregate[i] != NONE {
            continue;
        }
        aggregate[i] = count;
        for (j, a) in matrix.terms(i) {
            if aggregate[j] == NONE && is_strong(i, j, a) {
                aggregate[j] = count;
            }
        }
        count += 1;
    }
    if f64::from(count) > 0.8 * n as f64 {
        return None;
    }
    Some(Csr::build(n, count as usize, |i, terms| {
        // Weak connections count on the diagonal, so that constants stay constants.
        let (mut on_diagonal, mut size) = (0.0, 0.0);
        for (j, a) in matrix.terms(i) {
            if is_strong(i, j, a) {
                size += a.abs();
            } else {
                on_diagonal += a;
            }
        }
        terms.push((aggregate[i], 1.0));
        size += on_diagonal.abs();
        if size > 0.0 {
            let step = 4.0 / 3.0 / size;
            terms.push((aggregate[i], -step * on_diagonal));
            let strongly = matrix.terms(i).filter(|&(j, a)| is_strong(i, j, a));
            terms.extend(strongly.map(|(j, a)| (aggregate[j], -step * a)));
        }
    }))
}

/// A dense factor L L^T.
#[derive(Debug)]
struct Cholesky {
    /// Lower triangle, row after row, full rows.
    factor: Vec<f64>,
    n: usize,
}

impl Cholesky {
    fn new(matrix: &Csr) -> Self {
        let n = matrix.rows();
        let mut factor = vec![0.0; n * n];
        for i in 0..n {
            for (j, a) in matrix.terms(i) {
                factor[i * n + j] = a;
            }
        }
        for i in 0..n {
            let (above, row) = factor.split_at_mut(i * n);
            for j in 0..i {
                let other = &above[j * n..j * n + j + 1];
                let sum: f64 = row[..j].iter().zip(other).map(|(a, b)| a * b).sum();
                row[j] = (row[j] - sum) / other[j];
            }
            let sum: f64 = row[..i].iter().map(|a| a * a).sum();
            // A part of space that touches no conductor has a constant that costs nothing: it gets a little.
            row[i] = (row[i] - sum).max(1e-13 * row[i].abs()).max(f64::MIN_POSITIVE).sqrt();
        }
        Self { factor, n }
    }

    fn solve(&self, r: &[f64], x: &mut [f64]) {
        let n = self.n;
        for i in 0..n {
            let row = &self.factor[i * n..i * n + i + 1];
            let sum: f64 = row[..i].iter().zip(&*x).map(|(a, b)| a * b).sum();
            x[i] = (r[i] - sum) / row[i];
        }
        for i in (0..n).rev() {
            let row = &self.factor[i * n..i * n + i + 1];
            x[i] /= row[i];
            let value = x[i];
            for (x, a) in x[..i].iter_mut().zip(row) {
                *x -= a * value;
            }
        }
    }
}

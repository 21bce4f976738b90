//! What the map of a domain does to energies: in the coordinates of the boxes the permittivity eps becomes the tensor
//! K = eps J F^-1 F^-T, with F the gradient of the map and J its determinant.

use super::points::AxisPoints;
use crate::SolveError;
use crate::boxes::domain::{Axis, Domain};
use rayon::prelude::*;
use std::ops::Range;

/// A symmetric tensor: 00, 11, 22, 01, 02, 12.
pub(crate) type Symmetric = [f64; 6];

/// Weighted tensors at Gauss points where the map is not the identity.
#[derive(Debug)]
pub(crate) struct Metric {
    pub(crate) points: [AxisPoints; 3],
    /// Weight times (K - eps) at each point `[i][j][k]`; zero in conductors.
    pub(crate) permittivity: Vec<Symmetric>,
    /// Weight times (K^-1 - 1 / eps).
    pub(crate) resistance: Vec<Symmetric>,
    /// The largest of eps K^-1 in any direction, at least 1.
    pub(crate) largest: f64,
}

impl Metric {
    /// With `extra` more points on each element than its degree; `None` where the map changes nothing.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn new(domain: &Domain, extra: usize) -> Result<Option<Self>, SolveError> {
        let Some(map) = &domain.map else { return Ok(None) };
        let points = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            AxisPoints::new(axis, bent(axis, |x| map.reaches(a, x)), extra)
        });
        let dims = points.each_ref().map(AxisPoints::len);
        if dims.contains(&0) {
            return Ok(None);
        }
        let gradients = map.gradients(&points.each_ref().map(|p| p.places.clone()));
        let held = held(domain);
        let tensors = |index: usize, f: &[[f64; 3]; 3]| -> Option<(Symmetric, Symmetric, f64)> {
            let at = [index / (dims[1] * dims[2]), index / dims[2] % dims[1], index % dims[2]];
            let cell = [0, 1, 2].map(|a| points[a].interval[at[a]]);
            let cells = domain.cells();
            if held[(cell[0] * cells[1] + cell[1]) * cells[2] + cell[2]] {
                return Some(([0.0; 6], [0.0; 6], 1.0));
            }
            let weight: f64 = (0..3).map(|a| points[a].weights[at[a]]).product();
            let eps = domain.permittivity_of(cell);
            let (adjugate, volume) = adjugate(f);
            if volume.is_nan() || volume <= 0.0 {
                return None;
            }
            let row = |m: &[[f64; 3]; 3], r: usize, s: usize| (0..3).map(|k| m[r][k] * m[s][k]).sum::<f64>();
            let column = |r: usize, s: usize| (0..3).map(|k| f[k][r] * f[k][s]).sum::<f64>();
            let places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
            let own = |(r, s): (usize, usize)| if r == s { 1.0 } else { 0.0 };
            let k = places.map(|p| weight * eps * (row(&adjugate, p.0, p.1) / volume - own(p)));
            let inverse = places.map(|p| weight / eps * (column(p.0, p.1) / volume - own(p)));
            // The trace is no less than the largest eigenvalue.
            let largest = (0..3).map(|r| column(r, r)).sum::<f64>() / volume;
            Some((k, inverse, largest))
        };
        let found: Option<Vec<_>> =
            gradients.par_iter().enumerate().map(|(index, f)| tensors(index, f)).collect();
        let found = found.ok_or(SolveError::InsideOut)?;
        let largest = found.iter().map(|(.., largest)| *largest).fold(1.0, f64::max);
        let (permittivity, resistance) = found.into_iter().map(|(k, inverse, _)| (k, inverse)).unzip();
        Ok(Some(Self { points, permittivity, resistance, largest }))
    }
}

/// The finite elements of an axis whose middles fulfil a condition, from the first to the last of them.
fn bent(axis: &Axis, reaches: impl Fn(f64) -> bool) -> Range<usize> {
    let line = &axis.line;
    let first = line.first_finite();
    let middle = |e: usize| 0.5 * (line.nodes[e - first] + line.nodes[e - first + 1]);
    let mut own = (first..first + line.degrees.len()).filter(|e| reaches(middle(*e)));
    match own.next() {
        Some(low) => low..own.next_back().unwrap_or(low) + 1,
        None => first..first,
    }
}

/// Which cells of intervals lie in conductors.
fn held(domain: &Domain) -> Vec<bool> {
    let cells = domain.cells();
    let mut out = vec![false; cells.iter().product()];
    for block in &domain.conductors {
        for i in block.lo[0]..block.hi[0] {
            for j in block.lo[1]..block.hi[1] {
                let row = (i * cells[1] + j) * cells[2];
                out[row + block.lo[2]..row + block.hi[2]].fill(true);
            }
        }
    }
    out
}

/// J F^-1 and J.
fn adjugate(f: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let minor = |r: usize, c: usize| {
        let ([r0, r1], [c0, c1]) = ([(r + 1) % 3, (r + 2) % 3], [(c + 1) % 3, (c + 2) % 3]);
        f[r0][c0] * f[r1][c1] - f[r0][c1] * f[r1][c0]
    };
    let out = [0, 1, 2].map(|r| [0, 1, 2].map(|c| minor(c, r)));
    (out, (0..3).map(|c| f[0][c] * out[c][0]).sum())
}

/// Sum of x K y over points.
pub(crate) fn product(tensors: &[Symmetric], x: &[Vec<f64>; 3], y: &[Vec<f64>; 3]) -> f64 {
    // Pieces of a fixed length, added in order: the sum does not depend on the number of threads.
    const PIECE: usize = 4096;
    let pieces: Vec<f64> = tensors
        .par_chunks(PIECE)
        .enumerate()
        .map(|(piece, tensors)| {
            let first = piece * PIECE;
            let one = |(n, k): (usize, &Symmetric)| {
                let (x, y) = ([0, 1, 2].map(|a| x[a][first + n]), [0, 1, 2].map(|a| y[a][first + n]));
                let image = times(k, y);
                x[0] * image[0] + x[1] * image[1] + x[2] * image[2]
            };
            tensors.iter().enumerate().map(one).sum()
        })
        .collect();
    pieces.iter().sum()
}

/// K x.
pub(crate) fn times(k: &Symmetric, x: [f64; 3]) -> [f64; 3] {
    [
        k[0] * x[0] + k[3] * x[1] + k[4] * x[2],
        k[3] * x[0] + k[1] * x[1] + k[5] * x[2],
        k[4] * x[0] + k[5] * x[1] + k[2] * x[2],
    ]
}

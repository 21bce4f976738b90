//! How the next coarser level is made: each of its unknowns is an aggregate of strongly connected unknowns.

use crate::sparse::SparseMatrix;

/// A partition of the unknowns into aggregates.
struct Aggregates {
    /// The aggregate of each unknown.
    aggregate: Vec<u32>,
    /// The number of aggregates.
    count: u32,
}

/// Marks an unknown that is in no aggregate yet.
const NONE: u32 = u32::MAX;

/// A symmetric matrix and its strong connections, the entries with a_ij^2 > share^2 |a_ii a_jj|.
struct StrongConnections<'a> {
    matrix: &'a SparseMatrix,
    diagonal: Vec<f64>,
    share: f64,
}

/// The map from values of aggregates to values of unknowns, constant on each aggregate and smoothed once by
/// damped Jacobi; `None` if there are hardly fewer aggregates than unknowns.
///
/// A connection is strong if it exceeds the share `share` of the geometric mean of the two diagonal entries.
pub(super) fn smoothed_aggregates(matrix: &SparseMatrix, share: f64) -> Option<SparseMatrix> {
    let n = matrix.rows();
    let strong = StrongConnections { matrix, diagonal: matrix.diagonal(), share };
    let Aggregates { aggregate, count } = strong.aggregates();
    if f64::from(count) > 0.8 * n as f64 {
        return None;
    }
    Some(SparseMatrix::build(n, count as usize, |i, terms| {
        // Weak connections are added to the diagonal, so that constants stay constants. `size` is the sum of
        // the magnitudes of the row without them, on which the damping depends.
        let (mut on_diagonal, mut size) = (0.0, 0.0);
        for (j, a) in matrix.terms(i) {
            if strong.is_strong(i, j, a) {
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
            let neighbours = matrix.terms(i).filter(|&(j, a)| strong.is_strong(i, j, a));
            terms.extend(neighbours.map(|(j, a)| (aggregate[j], -step * a)));
        }
    }))
}

impl StrongConnections<'_> {
    /// Whether the entry `a` of row `i` and column `j` is a strong connection.
    fn is_strong(&self, i: usize, j: usize, a: f64) -> bool {
        i != j && a * a > self.share * self.share * (self.diagonal[i] * self.diagonal[j]).abs()
    }

    /// Partitions the unknowns into aggregates.
    fn aggregates(&self) -> Aggregates {
        let n = self.matrix.rows();
        let mut aggregate = vec![NONE; n];
        let mut count = 0_u32;
        // Unknowns none of whose neighbours is taken yet begin an aggregate with all of them.
        for i in 0..n {
            let neighbours =
                || self.matrix.terms(i).filter(|&(j, a)| self.is_strong(i, j, a)).map(|(j, _)| j);
            if aggregate[i] != NONE
                || neighbours().any(|j| aggregate[j] != NONE)
                || neighbours().next().is_none()
            {
                continue;
            }
            aggregate[i] = count;
            neighbours().for_each(|j| aggregate[j] = count);
            count += 1;
        }
        // Other unknowns join the aggregate of their strongest neighbour.
        let after_first_pass = aggregate.clone();
        for i in (0..n).filter(|&i| after_first_pass[i] == NONE) {
            let weight = |j: usize, a: f64| a.abs() / self.diagonal[j].abs().sqrt();
            let best = self
                .matrix
                .terms(i)
                .filter(|&(j, a)| after_first_pass[j] != NONE && self.is_strong(i, j, a))
                .max_by(|p, q| weight(p.0, p.1).total_cmp(&weight(q.0, q.1)));
            if let Some((j, _)) = best {
                aggregate[i] = after_first_pass[j];
            }
        }
        // The remaining unknowns begin aggregates with the remaining unknowns around them.
        for i in 0..n {
            if aggregate[i] != NONE {
                continue;
            }
            aggregate[i] = count;
            for (j, a) in self.matrix.terms(i) {
                if aggregate[j] == NONE && self.is_strong(i, j, a) {
                    aggregate[j] = count;
                }
            }
            count += 1;
        }
        Aggregates { aggregate, count }
    }
}

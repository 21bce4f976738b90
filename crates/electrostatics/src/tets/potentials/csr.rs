//! Sparse matrices by rows.

use rayon::prelude::*;

/// Rows of one task, so that results do not depend on the number of threads.
const TASK: usize = 4096;

/// A sparse matrix: per row its columns, ascending, and their values.
#[derive(Debug, Clone, Default)]
pub(super) struct Csr {
    pub(super) columns: usize,
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<f64>,
}

/// Rows that follow one another, on their way into a matrix.
#[derive(Default)]
pub(super) struct Rows {
    lengths: Vec<u32>,
    column: Vec<u32>,
    value: Vec<f64>,
}

impl Rows {
    /// Appends a row from terms in any order; those of one column are added. Empties `terms`.
    pub(super) fn push(&mut self, terms: &mut Vec<(u32, f64)>) {
        // Not stable, but the same for the same input.
        terms.sort_unstable_by_key(|t| t.0);
        let before = self.column.len();
        for &(column, value) in terms.iter() {
            if self.column.len() > before && self.column.last() == Some(&column) {
                if let Some(last) = self.value.last_mut() {
                    *last += value;
                }
            } else {
                self.column.push(column);
                self.value.push(value);
            }
        }
        self.lengths.push((self.column.len() - before) as u32);
        terms.clear();
    }
}

impl Csr {
    /// A matrix from rows in order.
    pub(super) fn from_rows(columns: usize, parts: Vec<Rows>) -> Self {
        let entries = parts.iter().map(|p| p.column.len()).sum();
        let mut matrix = Self {
            columns,
            start: vec![0],
            column: Vec::with_capacity(entries),
            value: Vec::with_capacity(entries),
        };
        for part in parts {
            let mut end = matrix.column.len();
            for length in part.lengths {
                end += length as usize;
                matrix.start.push(end);
            }
            matrix.column.extend(part.column);
            matrix.value.extend(part.value);
        }
        matrix
    }

    /// A matrix whose row `i` is the sum of the terms that `row` appends for it.
    pub(super) fn build(
        rows: usize,
        columns: usize,
        row: impl Fn(usize, &mut Vec<(u32, f64)>) + Sync,
    ) -> Self {
        let parts = (0..rows.div_ceil(TASK)).into_par_iter().map(|task| {
            let (mut part, mut terms) = (Rows::default(), Vec::new());
            for i in task * TASK..((task + 1) * TASK).min(rows) {
                row(i, &mut terms);
                part.push(&mut terms);
            }
            part
        });
        Self::from_rows(columns, parts.collect())
    }

    pub(super) fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// Columns and values of a row.
    #[inline]
    pub(super) fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.start[i]..self.start[i + 1];
        (&self.column[range.clone()], &self.value[range])
    }

    #[inline]
    pub(super) fn terms(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).map(|(c, v)| (*c as usize, *v))
    }

    pub(super) fn diagonal(&self) -> Vec<f64> {
        let at = |i: usize| {
            let (columns, values) = self.row(i);
            columns.binary_search(&(i as u32)).map_or(0.0, |k| values[k])
        };
        (0..self.rows()).into_par_iter().with_min_len(TASK).map(at).collect()
    }

    /// y_i = f(i, (A x)_i, y_i).
    pub(super) fn product(&self, x: &[f64], y: &mut [f64], f: impl Fn(f64, f64) -> f64 + Sync) {
        y.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(i, y)| {
            let sum: f64 = self.terms(i).map(|(j, a)| a * x[j]).sum();
            *y = f(sum, *y);
        });
    }

    pub(super) fn transposed(&self) -> Self {
        let mut start = vec![0_usize; self.columns + 1];
        for &c in &self.column {
            start[c as usize + 1] += 1;
        }
        for k in 0..self.columns {
            start[k + 1] += start[k];
        }
        let mut next = start.clone();
        let (mut column, mut value) = (vec![0; self.column.len()], vec![0.0; self.column.len()]);
        for i in 0..self.rows() {
            for (j, a) in self.terms(i) {
                column[next[j]] = i as u32;
                value[next[j]] = a;
                next[j] += 1;
            }
        }
        Self { columns: self.rows(), start, column, value }
    }

    /// A B.
    pub(super) fn times(&self, other: &Self) -> Self {
        Self::build(self.rows(), other.columns, |i, terms| {
            for (k, a) in self.terms(i) {
                terms.extend(other.terms(k).map(|(j, b)| (j as u32, a * b)));
            }
        })
    }
}

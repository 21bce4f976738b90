//! Blocks of consecutive rows, of which each thread that assembles a sparse matrix writes one.

use nalgebra_sparse::CsrMatrix;

/// Consecutive rows of a future [`SparseMatrix`](super::SparseMatrix).
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// The number of entries of each row.
    lengths: Vec<u32>,
    /// The columns of all entries, row after row, ascending in each row.
    columns: Vec<u32>,
    /// The values of all entries, in the order of `columns`.
    values: Vec<f64>,
}

impl Rows {
    /// Appends the row that is the sum of `terms` (column, value), in any order. Empties `terms` and keeps
    /// its memory.
    pub fn push(&mut self, terms: &mut Vec<(u32, f64)>) {
        // Not stable, but the same for the same input.
        terms.sort_unstable_by_key(|t| t.0);
        let before = self.columns.len();
        for &(column, value) in terms.iter() {
            if self.columns.len() > before && self.columns.last() == Some(&column) {
                if let Some(last) = self.values.last_mut() {
                    *last += value;
                }
            } else {
                self.columns.push(column);
                self.values.push(value);
            }
        }
        self.lengths.push((self.columns.len() - before) as u32);
        terms.clear();
    }
}

/// The matrix of all rows of all `parts`, one after the other.
///
/// # Panics
/// If an entry is in a column that is not below `columns`.
pub(super) fn joined(columns: usize, parts: Vec<Rows>) -> CsrMatrix<f64> {
    let entries = parts.iter().map(|p| p.columns.len()).sum();
    let (mut offsets, mut indices) = (vec![0], Vec::with_capacity(entries));
    let mut values = Vec::with_capacity(entries);
    for part in parts {
        let mut end = indices.len();
        for length in part.lengths {
            end += length as usize;
            offsets.push(end);
        }
        indices.extend(part.columns.into_iter().map(|c| c as usize));
        values.extend(part.values);
    }
    CsrMatrix::try_from_csr_data(offsets.len() - 1, columns, offsets, indices, values).unwrap_or_else(
        |error| unreachable!("rows are sorted and complete, hence a column is too large: {error}"),
    )
}

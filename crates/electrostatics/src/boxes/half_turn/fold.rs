//! Arrays of coefficients on a half of a scene as their odd and their even part across the middle of the last
//! axis.
//!
//! The half lies above the middle of the first axis and includes all of the last axis. Consider functions
//! that are odd under a half turn about the second axis. Their part that is odd across the middle of the last
//! axis is even across that of the first, and the other way round. Of functions that are even under the turn,
//! each part has the same parity across both. Either part is a function on a quarter of the scene, with
//! different walls ([`crate::boxes::domain::OtherParts::quarters`]).

use super::mirror_images;
use crate::error::SolveError;
use elastocap_fem::tensor::{Dims, Real, sized};
use faer::MatRef;
use rayon::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2;

/// Least number of rows for a parallel task. Tuned: `benches/outlines.py comb`.
const SMALL_TASK: usize = 64;

/// Splits coefficients into the two parts, and adds parts up to coefficients.
#[derive(Debug, Clone)]
pub(crate) struct Fold {
    /// Dimensions of the arrays.
    dims: Dims,
    /// For each function above the middle of the last axis: its index, that of its mirror image, and the sign
    /// of the image.
    pairs: Vec<(usize, usize, f64)>,
    /// The function in the middle, if there is one.
    middle: Option<usize>,
    /// Number of functions of the first axis that the odd and the even part lack, since they do not vanish in
    /// its middle.
    skipped: [usize; 2],
}

impl Fold {
    /// The fold of arrays of dimensions `dims`. `reflection` takes coefficients of the last axis to those of
    /// the mirror image; each function is the image of one function, up to sign. The odd and the even part
    /// lack the first `skipped` functions of the first axis.
    ///
    /// # Errors
    /// [`SolveError::Eigenvalues`] if functions are not images of each other, which only rounding of their
    /// basis could cause.
    pub(crate) fn new(
        dims: Dims,
        reflection: MatRef<'_, f64>,
        skipped: [usize; 2],
    ) -> Result<Self, SolveError> {
        let n = dims[2];
        let images = mirror_images(reflection)
            .ok_or(SolveError::Eigenvalues)?
            .into_iter()
            .enumerate()
            .skip(n.div_ceil(2));
        let pairs = images.map(|(k, (image, sign))| (k, image, sign)).collect();
        Ok(Self { dims, pairs, middle: (n % 2 == 1).then_some(n / 2), skipped })
    }

    /// Dimensions of the odd and of the even part.
    pub(crate) fn parts(&self) -> [Dims; 2] {
        let [n0, n1, _] = self.dims;
        let (half, middle) = (self.pairs.len(), usize::from(self.middle.is_some()));
        let [odd, even] = self.skipped.map(|skipped| n0 - skipped);
        [[odd, n1, half], [even, n1, half + middle]]
    }

    /// The odd and the even part: the products of the array with functions that are extended from half of the
    /// axis, over the root of two. Without a function in the middle of the axis, the squares of the two parts
    /// add up to that of the array.
    pub(crate) fn parts_of<T: Real>(&self, x: &[T]) -> [Vec<T>; 2] {
        let mut out = [Vec::new(), Vec::new()];
        self.write_parts(x, &mut out);
        out
    }

    /// Writes the odd and the even part, as [`Fold::parts_of`] gives them, into existing arrays.
    pub(crate) fn write_parts<T: Real>(&self, x: &[T], out: &mut [Vec<T>; 2]) {
        for (part, dims) in out.iter_mut().zip(self.parts()) {
            sized(part, dims.iter().product());
        }
        let [odd, even] = out;
        let ([_, n1, n2], [[_, _, odd_width], [_, _, even_width]]) = (self.dims, self.parts());
        let root = T::from_f64(FRAC_1_SQRT_2);
        let signs: Vec<T> = self.pairs.iter().map(|pair| T::from_f64(pair.2)).collect();
        let [rows, even_rows] =
            self.skipped.map(|skipped| x[skipped * n1 * n2..].par_chunks_exact(n2.max(1)));
        odd.par_chunks_exact_mut(odd_width.max(1)).zip(rows).with_min_len(SMALL_TASK).for_each(
            |(to, row)| {
                for ((to, (upper, lower, _)), sign) in to.iter_mut().zip(&self.pairs).zip(&signs) {
                    *to = root * (row[*upper] - *sign * row[*lower]);
                }
            },
        );
        even.par_chunks_exact_mut(even_width.max(1)).zip(even_rows).with_min_len(SMALL_TASK).for_each(
            |(to, row)| {
                let (middle, to) = to.split_at_mut(usize::from(self.middle.is_some()));
                for (to, index) in middle.iter_mut().zip(self.middle) {
                    *to = root * row[index];
                }
                for ((to, (upper, lower, _)), sign) in to.iter_mut().zip(&self.pairs).zip(&signs) {
                    *to = root * (row[*upper] + *sign * row[*lower]);
                }
            },
        );
    }

    /// Adds to an array the functions that the odd and the even part extend to: the transpose of
    /// [`Fold::parts_of`].
    pub(crate) fn add<T: Real>(&self, [odd, even]: [&[T]; 2], out: &mut [T]) {
        let ([_, n1, n2], [[_, _, odd_width], [_, _, even_width]]) = (self.dims, self.parts());
        let root = T::from_f64(FRAC_1_SQRT_2);
        let signs: Vec<T> = self.pairs.iter().map(|pair| T::from_f64(pair.2)).collect();
        let skipped = self.skipped.map(|skipped| skipped * n1);
        out.par_chunks_exact_mut(n2.max(1)).enumerate().with_min_len(SMALL_TASK).for_each(|(row, out)| {
            let [of_odd, of_even] = skipped.map(|skipped| row.checked_sub(skipped));
            let odd_row = of_odd.map_or(&[][..], |row| &odd[row * odd_width..(row + 1) * odd_width]);
            for ((x, (upper, lower, _)), sign) in odd_row.iter().zip(&self.pairs).zip(&signs) {
                out[*upper] += root * *x;
                out[*lower] += T::default() - *sign * root * *x;
            }
            let Some(row) = of_even else { return };
            let (middle, pairs) =
                even[row * even_width..(row + 1) * even_width].split_at(usize::from(self.middle.is_some()));
            for (x, index) in middle.iter().zip(self.middle) {
                out[index] += root * *x;
            }
            for ((x, (upper, lower, _)), sign) in pairs.iter().zip(&self.pairs).zip(&signs) {
                out[*upper] += root * *x;
                out[*lower] += *sign * root * *x;
            }
        });
    }

    /// Projects the functions that do not vanish in the middle of the first axis on the parity across the
    /// middle of the last axis that they must have.
    pub(crate) fn project(&self, x: &mut [f64]) {
        let [_, n1, n2] = self.dims;
        let [skipped_odd, skipped_even] = self.skipped;
        let (skipped, parity) = if skipped_odd > 0 { (skipped_odd, 1.0) } else { (skipped_even, -1.0) };
        for row in x[..skipped * n1 * n2].chunks_exact_mut(n2.max(1)) {
            if let (Some(index), true) = (self.middle, parity < 0.0) {
                row[index] = 0.0;
            }
            for (upper, lower, sign) in &self.pairs {
                let half = 0.5 * (row[*upper] + parity * sign * row[*lower]);
                (row[*upper], row[*lower]) = (half, parity * sign * half);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_fem::line::{Line, LineEnd};
    use elastocap_fem::reflection::reflected_functions;
    use elastocap_fem::tensor::dot;

    /// Makes the fold of arrays of potentials that are odd under the turn, or even.
    fn fold(odd: bool) -> Fold {
        let line = Line {
            nodes: vec![-1.0, -0.25, 0.0, 0.25, 1.0],
            degrees: vec![3; 4],
            ends: [LineEnd::Finite; 2],
        };
        let reflection = reflected_functions(&line);
        Fold::new([3, 2, reflection.nrows()], reflection.as_ref(), if odd { [0, 1] } else { [1, 0] }).unwrap()
    }

    fn some(n: usize, step: usize) -> Vec<f64> {
        (0..n).map(|k| ((k * step) % 13) as f64 - 6.0).collect()
    }

    #[test]
    fn the_parts_are_the_products_with_what_is_extended_from_them() {
        for fold in [true, false].map(fold) {
            let n = fold.dims.iter().product();
            let x = some(n, 5);
            let parts = fold.parts().map(|dims| some(dims.iter().product(), 7));
            let mut extended = vec![0.0; n];
            fold.add(parts.each_ref().map(Vec::as_slice), &mut extended);
            let folded = fold.parts_of(&x);
            let sum = dot(&folded[0], &parts[0]) + dot(&folded[1], &parts[1]);
            assert!((dot(&x, &extended) - sum).abs() < 1e-12 * sum.abs().max(1.0));
        }
    }

    #[test]
    fn what_is_extended_from_parts_is_not_changed_by_the_projection_and_nothing_else_passes_it() {
        for fold in [true, false].map(fold) {
            let n: usize = fold.dims.iter().product();
            let parts = fold.parts().map(|dims| some(dims.iter().product(), 7));
            let mut extended = vec![0.0; n];
            fold.add(parts.each_ref().map(Vec::as_slice), &mut extended);
            let mut projected = extended.clone();
            fold.project(&mut projected);
            assert!(projected.iter().zip(&extended).all(|(a, b)| (a - b).abs() < 1e-14));
            // The projection is orthogonal, and to apply it twice is to apply it once.
            let x = some(n, 5);
            let mut once = x.clone();
            fold.project(&mut once);
            let mut twice = once.clone();
            fold.project(&mut twice);
            let rest: Vec<f64> = x.iter().zip(&once).map(|(x, once)| x - once).collect();
            assert!(once == twice && dot(&rest, &rest) > 1.0 && dot(&rest, &extended).abs() < 1e-12);
        }
    }
}

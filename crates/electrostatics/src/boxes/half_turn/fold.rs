//! Arrays of coefficients on a half of a scene as their odd and their even part across the middle of the last axis.
//!
//! The half lies above the middle of the first axis, and all of the last axis belongs to it. Of a state that is odd under a half turn about
//! the second axis, the part that is odd across the middle of the last axis is even across that of the first, and the other way round.
//! Each is a function on a quarter of the scene, with walls of its own ([`super::odd::OtherParts::quarters`]).

use elastocap_fem::tensor::{Dims, Real};
use faer::MatRef;
use rayon::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2;

/// Rows that are worth a task of their own.
const SMALL_TASK: usize = 64;

/// How the two parts are made from coefficients, and the coefficients from them.
#[derive(Debug, Clone)]
pub(crate) struct Fold {
    dims: Dims,
    /// For each function above the middle of the last axis: its index, that of its mirror image, and the sign of that.
    pairs: Vec<(usize, usize, f64)>,
    /// The function in the middle, if there is one.
    middle: Option<usize>,
    /// Functions of the first axis that the even part does not have.
    skipped: usize,
}

impl Fold {
    /// For arrays of these dimensions. `reflection` takes coefficients of the last axis to those of the mirror image; each function is the
    /// image of one, but for its sign. The first `skipped` functions of the first axis do not vanish in its middle.
    pub(crate) fn new(dims: Dims, reflection: MatRef<'_, f64>, skipped: usize) -> Self {
        let n = dims[2];
        let partner = |k: usize| (0..n).find(|other| reflection[(*other, k)].abs() > 0.5);
        let first = n.div_ceil(2);
        let pairs = (first..n).filter_map(|k| partner(k).map(|other| (k, other, reflection[(other, k)].signum())));
        Self { dims, pairs: pairs.collect(), middle: (n % 2 == 1).then_some(n / 2), skipped }
    }

    /// Dimensions of the odd and of the even part.
    pub(crate) fn parts(&self) -> [Dims; 2] {
        let [n0, n1, _] = self.dims;
        let (half, middle) = (self.pairs.len(), usize::from(self.middle.is_some()));
        [[n0, n1, half], [n0 - self.skipped, n1, half + middle]]
    }

    /// The odd and the even part: the products of the array with functions that are extended from half of the axis, over the root of two.
    /// Without a function in the middle they are orthogonal to each other, and as large together as the array.
    pub(crate) fn parts_of<T: Real>(&self, x: &[T]) -> [Vec<T>; 2] {
        let [mut odd, mut even] = self.parts().map(|dims| vec![T::default(); dims.iter().product()]);
        let ([_, n1, n2], [[_, _, w], [_, _, v]]) = (self.dims, self.parts());
        let root = T::from_f64(FRAC_1_SQRT_2);
        let signs: Vec<T> = self.pairs.iter().map(|pair| T::from_f64(pair.2)).collect();
        let skipped = self.skipped * n1;
        if w > 0 {
            odd.par_chunks_exact_mut(w).zip(x.par_chunks_exact(n2)).with_min_len(SMALL_TASK).for_each(|(to, row)| {
                for ((to, (upper, lower, _)), sign) in to.iter_mut().zip(&self.pairs).zip(&signs) {
                    *to = root * (row[*upper] - *sign * row[*lower]);
                }
            });
        }
        let rows = x[skipped * n2..].par_chunks_exact(n2);
        even.par_chunks_exact_mut(v.max(1)).zip(rows).with_min_len(SMALL_TASK).for_each(|(to, row)| {
            let (middle, to) = to.split_at_mut(usize::from(self.middle.is_some()));
            for (to, at) in middle.iter_mut().zip(self.middle) {
                *to = root * row[at];
            }
            for ((to, (upper, lower, _)), sign) in to.iter_mut().zip(&self.pairs).zip(&signs) {
                *to = root * (row[*upper] + *sign * row[*lower]);
            }
        });
        [odd, even]
    }

    /// Adds the extended functions with these coefficients.
    pub(crate) fn add<T: Real>(&self, [odd, even]: [&[T]; 2], out: &mut [T]) {
        let ([_, n1, n2], [[_, _, w], [_, _, v]]) = (self.dims, self.parts());
        let root = T::from_f64(FRAC_1_SQRT_2);
        let signs: Vec<T> = self.pairs.iter().map(|pair| T::from_f64(pair.2)).collect();
        let skipped = self.skipped * n1;
        out.par_chunks_exact_mut(n2).enumerate().with_min_len(SMALL_TASK).for_each(|(row, out)| {
            let own = &odd[row * w..(row + 1) * w];
            for ((x, (upper, lower, _)), sign) in own.iter().zip(&self.pairs).zip(&signs) {
                out[*upper] += root * *x;
                out[*lower] += T::default() - *sign * root * *x;
            }
            let Some(row) = row.checked_sub(skipped) else { return };
            let (middle, own) = even[row * v..(row + 1) * v].split_at(usize::from(self.middle.is_some()));
            for (x, at) in middle.iter().zip(self.middle) {
                out[at] += root * *x;
            }
            for ((x, (upper, lower, _)), sign) in own.iter().zip(&self.pairs).zip(&signs) {
                out[*upper] += root * *x;
                out[*lower] += *sign * root * *x;
            }
        });
    }

    /// Takes from the functions that do not vanish in the middle of the first axis what is even across the middle of the last.
    pub(crate) fn make_middle_odd(&self, x: &mut [f64]) {
        let [_, n1, n2] = self.dims;
        for row in x[..self.skipped * n1 * n2].chunks_exact_mut(n2.max(1)) {
            if let Some(at) = self.middle {
                row[at] = 0.0;
            }
            for (upper, lower, sign) in &self.pairs {
                let half = 0.5 * (row[*upper] - sign * row[*lower]);
                (row[*upper], row[*lower]) = (half, -sign * half);
            }
        }
    }
}

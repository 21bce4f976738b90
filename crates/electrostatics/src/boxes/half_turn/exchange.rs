//! Arrays that are even or odd under a half turn, on two halves of a scene: the half above the middle of the
//! first axis, and the half above the middle of the last.
//!
//! Lines of the first axis that cross its middle are complete on the second half only, lines of the last axis
//! on the first half only. The rest of each half is the turned image of a part of the other.

use super::mirror_images;
use crate::error::SolveError;
use elastocap_fem::tensor::{Dims, sized};
use faer::Mat;
use rayon::prelude::*;

/// Carries arrays of the first half to the second and back.
#[derive(Debug, Clone)]
pub(crate) struct Exchange {
    /// The places of the first axis above its middle.
    first: Vec<Image>,
    /// The places of the last axis above its middle.
    last: Vec<Image>,
    /// The number of places of the second axis.
    between: usize,
}

/// A place above the middle of an axis: a function, a mode or a point.
#[derive(Debug, Clone, Copy)]
struct Image {
    /// Its number on the whole axis.
    index: usize,
    /// The number of its mirror image on the whole axis.
    image: usize,
    /// The sign of the mirror image.
    sign: f64,
}

impl Exchange {
    /// The exchange for `between` places on the second axis. `first` and `last` take the places of these two
    /// axes to their mirror images; each place is the image of one other place, up to sign.
    ///
    /// # Errors
    /// [`SolveError::Eigenvalues`] if places are not images of each other, which only rounding of their basis
    /// could cause.
    pub(crate) fn new(first: &Mat<f64>, between: usize, last: &Mat<f64>) -> Result<Self, SolveError> {
        let images = |reflection: &Mat<f64>| {
            let above =
                mirror_images(reflection.as_ref()).ok_or(SolveError::Eigenvalues)?.into_iter().enumerate();
            let above = above.skip(reflection.nrows() / 2);
            Ok::<_, SolveError>(above.map(|(index, (image, sign))| Image { index, image, sign }).collect())
        };
        Ok(Self { first: images(first)?, between, last: images(last)? })
    }

    /// The exchange with this many points of the first axis above its middle in place of modes.
    pub(crate) fn at_points(&self, points: usize) -> Self {
        let image = |k: usize| Image { index: points + k, image: points - 1 - k, sign: 1.0 };
        Self { first: (0..points).map(image).collect(), ..self.clone() }
    }

    /// Dimensions of arrays of the first half and of the second.
    pub(crate) fn dims(&self) -> [Dims; 2] {
        let (n0, n2) = (self.first.len(), self.last.len());
        [[n0, self.between, 2 * n2], [2 * n0, self.between, n2]]
    }

    /// The array on the second half that belongs to an array on the first. `parity` is 1 for arrays that are
    /// even under the turn, -1 for odd ones.
    pub(crate) fn to_second(&self, x: &[f64], parity: f64) -> Vec<f64> {
        let mut out = Vec::new();
        self.write_second(x, parity, &mut out);
        out
    }

    /// Writes the result of [`Exchange::to_second`] into an existing array.
    pub(crate) fn write_second(&self, x: &[f64], parity: f64, out: &mut Vec<f64>) {
        let [[_, n1, n2], [m0, _, m2]] = self.dims();
        let (from, to) = (n1 * n2, n1 * m2);
        sized(out, m0 * to);
        // For each place of the whole axis, the place above the middle that it is, or that it is the image
        // of.
        let mut above = vec![0; m0];
        for (k, pair) in self.first.iter().enumerate() {
            (above[pair.index], above[pair.image]) = (k, k);
        }
        out.par_chunks_exact_mut(to.max(1)).zip(above).enumerate().for_each(|(place, (slab, k))| {
            let pair = &self.first[k];
            let rows = x[k * from..(k + 1) * from].chunks_exact(n2.max(1));
            for (to, row) in slab.chunks_exact_mut(m2.max(1)).zip(rows) {
                for (to, last) in to.iter_mut().zip(&self.last) {
                    *to = match place == pair.index {
                        true => row[last.index],
                        false => parity * pair.sign * last.sign * row[last.image],
                    };
                }
            }
        });
    }

    /// Adds an array of the second half, carried to the first, to `out`.
    pub(crate) fn add_to_first(&self, x: &[f64], parity: f64, out: &mut [f64]) {
        let [[_, n1, n2], [_, _, m2]] = self.dims();
        let (to, from) = (n1 * n2, n1 * m2);
        out.par_chunks_exact_mut(to.max(1)).zip(&self.first).for_each(|(out, pair)| {
            let [above, below] = [pair.index, pair.image].map(|slab| &x[slab * from..(slab + 1) * from]);
            for ((above, below), row) in
                above.chunks_exact(m2).zip(below.chunks_exact(m2)).zip(out.chunks_exact_mut(n2))
            {
                for ((above, below), last) in above.iter().zip(below).zip(&self.last) {
                    row[last.index] += above;
                    row[last.image] += parity * pair.sign * last.sign * below;
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_fem::line::{Line, LineEnd};
    use elastocap_fem::reflection::reflected_modes;

    fn line(nodes: &[f64], degrees: &[usize]) -> Line {
        Line { nodes: nodes.to_vec(), degrees: degrees.to_vec(), ends: [LineEnd::Finite; 2] }
    }

    #[test]
    fn what_is_even_or_odd_under_the_turn_is_the_same_on_both_halves() {
        let reflections =
            [line(&[-2.0, -0.5, 0.0, 0.5, 2.0], &[2, 3, 3, 2]), line(&[-1.0, 0.0, 1.0], &[4, 4])]
                .map(|line| reflected_modes(&line));
        let [n0, n2] = reflections.each_ref().map(Mat::nrows);
        let exchange = Exchange::new(&reflections[0], 3, &reflections[1]).unwrap();
        assert_eq!(exchange.dims(), [[n0 / 2, 3, n2], [n0, 3, n2 / 2]]);
        for parity in [1.0, -1.0] {
            // On the whole: an array and its turned image, times the parity.
            let some = |i: usize, j: usize, k: usize| ((7 * i + 5 * j + 3 * k) % 11) as f64;
            let turned = |i: usize, j: usize, k: usize| -> f64 {
                let term =
                    |p: usize, q: usize| reflections[0][(i, p)] * reflections[1][(k, q)] * some(p, j, q);
                (0..n0 * n2).map(|pq| term(pq / n2, pq % n2)).sum()
            };
            let whole = |i: usize, j: usize, k: usize| some(i, j, k) + parity * turned(i, j, k);
            let part = |first: std::ops::Range<usize>, last: std::ops::Range<usize>| -> Vec<f64> {
                let rows = first.flat_map(|i| (0..3).map(move |j| (i, j)));
                rows.flat_map(|(i, j)| last.clone().map(move |k| (i, j, k)))
                    .map(|(i, j, k)| whole(i, j, k))
                    .collect()
            };
            let (first, second) = (part(n0 / 2..n0, 0..n2), part(0..n0, n2 / 2..n2));
            assert_eq!(exchange.to_second(&first, parity), second);
            let mut back = vec![1.0; first.len()];
            exchange.add_to_first(&second, parity, &mut back);
            assert!(back.iter().zip(&first).all(|(back, x)| *back == x + 1.0));
        }
    }
}

//! Half turns and point reflections, under which a scene is symmetric although no single mirror is a
//! symmetry.
//!
//! Where a half turn about the second axis takes a scene to itself, potentials that are even and those that
//! are odd under it are solved on half of the scene ([`halves`]): two interdigitated combs on a board are the
//! common example. Under other turns, and where the permittivity is not mirror-symmetric, the potential of
//! one conductor is the turned potential of another ([`images`]).

pub(crate) mod exchange;
pub(crate) mod fold;
pub(crate) mod halves;
pub(crate) mod images;

use faer::MatRef;

/// Rounding error of the entries of a reflection, which are 0, 1 and -1. Not tuned: any value between 1e-12
/// and 0.1 gives the same results.
const ROUNDING: f64 = 1e-9;

/// For each function or point of an axis the number of its mirror image and the sign of that image, from the
/// matrix that reflects coefficients. `None` where the matrix does not exchange pairs: a problem built on it
/// would be a different one.
fn mirror_images(reflection: MatRef<'_, f64>) -> Option<Vec<(usize, f64)>> {
    let n = reflection.ncols();
    let image = |k: usize| {
        let to = (0..n).find(|to| (reflection[(*to, k)].abs() - 1.0).abs() < ROUNDING)?;
        Some((to, reflection[(to, k)].signum()))
    };
    let images: Vec<(usize, f64)> = (0..n).map(image).collect::<Option<_>>()?;
    let exchanged = |k: usize| images.get(images[k].0) == Some(&(k, images[k].1));
    (reflection.nrows() == n && (0..n).all(exchanged)).then_some(images)
}

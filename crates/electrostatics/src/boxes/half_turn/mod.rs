//! Half turns and point reflections, which take a scene to itself though no mirror does.
//!
//! Where a half turn about the second axis takes a scene to itself, potentials that are even and those that are odd under it are solved on
//! half of the scene ([`halves`]): two interdigitated combs on a board are the common example. Under other turns, and where the
//! permittivity is not its own mirror image, the potential of one conductor is the turned potential of another ([`images`]).

pub(crate) mod exchange;
pub(crate) mod fold;
pub(crate) mod halves;
pub(crate) mod images;

use faer::MatRef;

/// How far the entries of a reflection may be from one or minus one, by rounding.
const ROUNDING: f64 = 1e-9;

/// For each function or place of an axis the one that is its mirror image, and the sign of that, from what takes coefficients to those of
/// the mirror image. `None` where this does not exchange pairs: what is made of it would belong to another problem.
fn mirror_images(reflection: MatRef<'_, f64>) -> Option<Vec<(usize, f64)>> {
    let n = reflection.ncols();
    let of = |k: usize| {
        let to = (0..n).find(|to| (reflection[(*to, k)].abs() - 1.0).abs() < ROUNDING)?;
        Some((to, reflection[(to, k)].signum()))
    };
    let images: Vec<(usize, f64)> = (0..n).map(of).collect::<Option<_>>()?;
    let exchanged = |k: usize| images.get(images[k].0) == Some(&(k, images[k].1));
    (reflection.nrows() == n && (0..n).all(exchanged)).then_some(images)
}

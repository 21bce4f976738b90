//! Half turns and point reflections, which take a scene to itself though no mirror does.
//!
//! Of a half turn about the second axis, potentials that are even and those that are odd under it are solved on half of the scene
//! ([`halves`]): two interdigitated combs on a board are the common example. Of others, and where the scene has no mirror image of its own
//! permittivity, the potential of one conductor is the turned potential of another ([`images`]).

pub(crate) mod exchange;
pub(crate) mod fold;
pub(crate) mod halves;
pub(crate) mod holders;
pub(crate) mod images;

use faer::MatRef;

/// For each function or place of an axis the one that is its mirror image, and the sign of that, from what takes coefficients to those of
/// the mirror image.
fn mirror_images(reflection: MatRef<'_, f64>) -> Vec<(usize, f64)> {
    let largest = |k: usize| (0..reflection.nrows()).find(|to| reflection[(*to, k)].abs() > 0.5);
    (0..reflection.ncols()).filter_map(|k| largest(k).map(|to| (to, reflection[(to, k)].signum()))).collect()
}

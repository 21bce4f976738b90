//! The error of a map whose surface is level outside it, where the true surface of the layer is still bent.

use elastocap_geometry::scene::{Purpose, Scene, Wall};

use crate::deform::Material;
use crate::layer_outlines::far_off;

/// Number of sampled places on each side. It is not tuned.
const PLACES: usize = 40;

/// An estimate of the relative error of a capacitance for a surface that is level outside the map, where the
/// true surface returns to the height `flat` only farther away. It is the largest value of [`far_off`] for
/// the height differences at sampled places. A place nearer to the conductors than one thickness counts as
/// that far away. `image` is the map of the layer, and `surface` the height of the surface before the map.
/// All lengths in m.
pub(super) fn level_beyond(
    scene: &Scene,
    image: &dyn Fn([f64; 3]) -> [f64; 3],
    surface: f64,
    flat: f64,
    material: &Material<'_>,
    is_plane: bool,
) -> f64 {
    let thickness = material.pad[1];
    let conductors = scene.conductors().filter(|conductor| conductor.body.purpose != Purpose::Indenter);
    let bounds = conductors.filter_map(|conductor| conductor.body.bounds());
    let Some(hull) = bounds.reduce(|a, b| a.union(&b)) else { return 0.0 };
    let mut largest_error: f64 = 0.0;
    // In plane strain the surface is the same all along x3.
    for axis in if is_plane { &[0][..] } else { &[0, 2][..] } {
        for side in (0..2).filter(|side| scene.walls[*axis][*side] == Wall::Open) {
            let outward = if side == 0 { -1.0 } else { 1.0 };
            let edge = (if side == 0 { -hull.min[*axis] } else { hull.max[*axis] }).max(0.0);
            let end = material.pad[*axis];
            // The error for a height difference at this distance from the middle.
            let error =
                |distance: f64, difference: f64| far_off(difference, (distance - edge).max(thickness), &hull);
            for k in 1..PLACES {
                let distance = edge + (end - edge).max(0.0) * k as f64 / PLACES as f64;
                let mut point = [0.0, surface, 0.0];
                point[*axis] = outward * distance;
                let to = image(point);
                let height = material.height_at([to[0], thickness, to[2]], [to[0], to[2]]);
                largest_error = largest_error.max(error(outward * to[*axis], to[1] - height));
            }
            largest_error = largest_error.max(error(end, surface - flat));
        }
    }
    largest_error.min(1.0)
}

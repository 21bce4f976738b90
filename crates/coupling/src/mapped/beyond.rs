//! The error that a map leaves of the bent surface of a layer in open space, where the map ends.

use elastocap_geometry::scene::{Purpose, Scene, Wall};

use crate::deform::Material;
use crate::layer_outlines::far_off;

/// Places on each side at which the surface is looked at.
const PLACES: usize = 40;

/// The relative error of a capacitance for a surface that is level where the map ends and in truth comes back to its height, `flat`, later:
/// the largest of [`far_off`] for its distances from the true one, at those from the conductors, but at a thickness at least. An estimate.
/// `image` takes points of the boxes' surface, at this height, to where the map has them. All lengths in m.
pub(super) fn level_beyond(
    scene: &Scene,
    image: &dyn Fn([f64; 3]) -> [f64; 3],
    surface: f64,
    flat: f64,
    material: &Material<'_>,
    is_plane: bool,
) -> f64 {
    let thickness = material.pad[1];
    let conductors = scene.conductors().filter(|own| own.body.purpose != Purpose::Indenter);
    let bounds = conductors.filter_map(|own| own.body.bounds());
    let Some(hull) = bounds.reduce(|a, b| a.union(&b)) else { return 0.0 };
    let mut largest: f64 = 0.0;
    // In plane strain the surface is the same all along x3.
    for axis in if is_plane { &[0][..] } else { &[0, 2][..] } {
        for side in (0..2).filter(|side| scene.walls[*axis][*side] == Wall::Open) {
            let outward = if side == 0 { -1.0 } else { 1.0 };
            let edge = (if side == 0 { -hull.min[*axis] } else { hull.max[*axis] }).max(0.0);
            let end = material.pad[*axis];
            let error = |at: f64, off: f64| far_off(off, (at - edge).max(thickness), &hull);
            for k in 1..PLACES {
                let at = edge + (end - edge).max(0.0) * k as f64 / PLACES as f64;
                let mut point = [0.0, surface, 0.0];
                point[*axis] = outward * at;
                let to = image(point);
                let height = material.height_at([to[0], thickness, to[2]], [to[0], to[2]]);
                largest = largest.max(error(outward * to[*axis], to[1] - height));
            }
            largest = largest.max(error(end, surface - flat));
        }
    }
    largest.min(1.0)
}

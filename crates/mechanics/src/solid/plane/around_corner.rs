//! The size of the elements that the surface needs to bend around the rounded corner of a punch.
//!
//! The surface is stretched there, up to six times, and the rubber below it is squeezed. Elements are
//! therefore cut along the surface only, and deformed they are about as long as they are thick. Those that
//! are square at rest become thin, and a corner that moves into them turns them inside out.

use crate::solid::adaptive::Halvings;
use crate::solid::layer::LayerModel;
use crate::solid::model::State;
use crate::solid::obstacle::ObstacleShape;

/// Longest side of an element at a corner, deformed, over the radius of the corner. A side is a parabola,
/// which cannot follow a larger part of the arc. Tuned:
/// `cargo run --release -p elastocap-mechanics --example sharp_punch -- 1 1e-3 0.01 : 0.01 0.1`.
const LONGEST_SIDE: f64 = 0.25;
/// The largest distance from the indenter of a side at its corner, over the radius. Tuned:
/// `cargo run --release -p elastocap-mechanics --example sharp_punch -- 1 1e-3 0.01 : 0.01 0.1`.
const NEAR: f64 = 0.5;
/// The largest number of halvings from one mesh to the next: a state with a fault may be stretched without
/// limit. It is not tuned.
const MAX_HALVINGS: f64 = 4.0;
/// Points of a side that are examined. It is not tuned.
const POINTS: usize = 5;

/// The halvings that each element needs before the surface of a layer can bend around corners of the radius
/// `least` (m) or, if that is larger, of the radius of the punch's corners. Elements that are not at a corner
/// in the configuration `state` need none.
pub(super) fn halvings(model: &LayerModel, state: &State, least: f64) -> Vec<Halvings> {
    let body = model.equations().body();
    let mut halvings = vec![Halvings::default(); body.mesh.elements.len()];
    let Some(corner_radius) = model.indenter.corner_radius(least) else { return halvings };
    for (obstacle, shift) in body.obstacles.iter().zip(&state.shift) {
        let ObstacleShape::Indenter(profile) = obstacle.shape else { continue };
        let Some((half_width, radius)) = profile.flat_face() else { continue };
        for side in &obstacle.sides {
            let [a, middle, b] = side.nodes.map(|n| {
                let n = n as usize;
                [0, 1].map(|k| body.mesh.nodes[n][k] + state.displacement[2 * n + k] - shift[k])
            });
            // The point of the side at the coordinate `t` from -1 to 1.
            let point = |t: f64| {
                let shape = [0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)];
                [0, 1].map(|k| shape[0] * a[k] + shape[1] * middle[k] + shape[2] * b[k])
            };
            let is_at_corner = |x: [f64; 2]| {
                let from_face = half_width - radius - x[0].abs();
                profile.gap([x[0], x[1], 0.0]).distance < NEAR * radius
                    && from_face < NEAR * radius
                    && x[1] < (1.0 + NEAR) * radius
            };
            let along = (0..POINTS).map(|p| point(2.0 * p as f64 / (POINTS - 1) as f64 - 1.0));
            if along.clone().any(is_at_corner) {
                let points: Vec<[f64; 2]> = along.collect();
                let length: f64 =
                    points.windows(2).map(|two| (two[1][0] - two[0][0]).hypot(two[1][1] - two[0][1])).sum();
                let times = (length / (LONGEST_SIDE * corner_radius)).log2().ceil().clamp(0.0, MAX_HALVINGS);
                let nodes = &body.mesh.elements[side.element as usize];
                let index = |n: u32| nodes.iter().position(|m| *m == n).unwrap_or(0);
                // The nodes of an element are numbered in rows of three along its first axis.
                let is_along_first = index(side.nodes[0]).abs_diff(index(side.nodes[2])) == 2;
                let axes = if is_along_first { 0b01 } else { 0b10 };
                let of_element = &mut halvings[side.element as usize];
                *of_element = of_element.and(Halvings { times: times as u8, axes });
            }
        }
    }
    halvings
}

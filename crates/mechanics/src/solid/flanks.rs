//! The flanks of a sharp punch as obstacles for the free surface next to it.

use super::dimension::Dimension;
use super::model::Body;
use super::obstacle::{Obstacle, ObstacleShape};
use super::side::Side;
use super::symmetry::Symmetry;

/// Obstacles that keep the surface next to a sharp punch out of it: the free surface turns up, and the
/// punch's flank moves with the last point under the punch. For the same reason the points under a punch
/// without friction may not pass that point. In space there is one obstacle per strip of the surface.
pub(super) fn flanks<S: Dimension>(
    body: &Body<S>,
    half_width: f64,
    top: f64,
    symmetry: Symmetry,
    bonded: bool,
) -> Vec<Obstacle<S>> {
    let tiny = 1e-9 * top;
    let nodes = &body.mesh.nodes;
    let mut obstacles = Vec::new();
    let ends: &[f64] = if symmetry == Symmetry::None { &[1.0, -1.0] } else { &[1.0] };
    for &end in ends {
        let out = |x: &S::Point| end * x[0] - half_width;
        let corners = (0..nodes.len()).filter(|&n| nodes[n][1] > top - tiny && out(&nodes[n]).abs() < tiny);
        let corners: Vec<usize> = corners.collect();
        // Outside the punch; under it only where the surface can slide.
        let parts: &[bool] = if bonded { &[true] } else { &[true, false] };
        for &outside in parts {
            let surface = body.mesh.boundary_where(|x| {
                let on = if outside { out(&x) > -tiny } else { out(&x) < tiny && end * x[0] > -tiny };
                x[1] > top - tiny && on
            });
            let mut strips: Vec<(usize, Vec<Side<S>>)> = corners.iter().map(|&n| (n, Vec::new())).collect();
            for side in surface {
                let middle = nodes[side.middle()];
                let along = |n: usize| (2..S::AXES).map(|k| (nodes[n][k] - middle[k]).abs()).sum::<f64>();
                if let Some(strip) = strips.iter_mut().min_by(|a, b| along(a.0).total_cmp(&along(b.0))) {
                    strip.1.push(side);
                }
            }
            let shape = ObstacleShape::Flank { side: if outside { end } else { -end } };
            let strips = strips.into_iter().filter(|strip| !strip.1.is_empty());
            obstacles.extend(strips.map(|(n, sides)| Obstacle { shape, sides, carrier: Some(n as u32) }));
        }
    }
    obstacles
}

//! The flanks of a sharp punch as obstacles for the free surface next to it.

use super::dimension::Dimension;
use super::model::Body;
use super::obstacle::{Obstacle, ObstacleShape};
use super::side::Side;
use super::symmetry::Symmetry;

/// Obstacles that keep the surface next to a sharp punch out of it. The free surface turns up beside the
/// punch, whose flank moves along `x1` with the last point under it. Unless the surface is `bonded` to the
/// punch, the points under it slide; further obstacles keep them from passing that last point. In space there
/// is one obstacle for each strip of the surface along `x1`.
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
        let beyond_edge = |x: &S::Point| end * x[0] - half_width;
        let is_corner = |n: &usize| nodes[*n][1] > top - tiny && beyond_edge(&nodes[*n]).abs() < tiny;
        let corners = (0..nodes.len()).filter(is_corner);
        let corners: Vec<usize> = corners.collect();
        // The surface beside the punch and, where it can slide, the surface under the punch.
        let parts: &[bool] = if bonded { &[true] } else { &[true, false] };
        for &outside in parts {
            let surface = body.mesh.boundary_where(|x| {
                let beyond = beyond_edge(&x);
                let is_in_part = if outside { beyond > -tiny } else { beyond < tiny && end * x[0] > -tiny };
                x[1] > top - tiny && is_in_part
            });
            let mut strips: Vec<(usize, Vec<Side<S>>)> = corners.iter().map(|&n| (n, Vec::new())).collect();
            for side in surface {
                let middle = nodes[side.middle()];
                let distance = |n: usize| (2..S::AXES).map(|k| (nodes[n][k] - middle[k]).abs()).sum::<f64>();
                if let Some(strip) = strips.iter_mut().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))
                {
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

//! Round bodies so close together that the flat faces in their place cross although the bodies do not.

use super::Point;
use super::faceting::geodesic;
use crate::shapes::Shape;
use elastocap_linalg::vector::{length, minus};
use std::f64::consts::TAU;

/// The distance of flat faces from the surface that they replace, relative to the radius, over the square of their relative
/// size.
const FACE_DISTANCE: f64 = 0.1;

/// The share of a surface that may be closer to another surface than flat faces are to what they replace. Surfaces that cross at
/// an angle are that close on a strip, one that touches another from inside on a spot.
const MAX_SHARE: f64 = 0.3;

/// A surface of revolution: of a ball, of a cylinder, or inside or outside a tube.
#[derive(Debug, Clone, Copy)]
struct Round {
    center: Point,
    radius: f64,
    /// The axis of a cylinder, and half its height.
    rod: Option<(usize, f64)>,
}

impl Round {
    fn of(shape: &Shape) -> Vec<Self> {
        let rod = |axis: usize, base: &Point, radius: f64, height: f64| {
            let mut center = *base;
            center[axis] += 0.5 * height;
            Self { center, radius, rod: Some((axis, 0.5 * height)) }
        };
        match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                vec![Self { center: *center, radius: *radius, rod: None }]
            }
            Shape::Cylinder { axis, base, radius, height } => vec![rod(*axis, base, *radius, *height)],
            Shape::Tube { axis, base, radii, height } => {
                radii.map(|radius| rod(*axis, base, radius, *height)).to_vec()
            }
            Shape::Box(_) | Shape::Extrusion { .. } | Shape::Surface(_) | Shape::Physical(_) => Vec::new(),
        }
    }

    /// Points spread over the curved part of the surface, m.
    fn samples(&self) -> Vec<Point> {
        let Some((axis, half)) = self.rod else { return geodesic(self.center, self.radius, 0.1).points };
        let turns = (0..64).map(|k| (TAU * f64::from(k) / 64.0).sin_cos());
        let place = |(s, c): (f64, f64), z: f64| {
            let mut p = self.center;
            p[axis] += z;
            p[(axis + 1) % 3] += self.radius * c;
            p[(axis + 2) % 3] += self.radius * s;
            p
        };
        turns.flat_map(|t| (-20..=20).map(move |k| place(t, half * f64::from(k) / 20.0))).collect()
    }

    /// The distance of a point from the curved part of the surface, m.
    fn distance(&self, p: Point) -> f64 {
        let mut d = minus(p, self.center);
        let Some((axis, half)) = self.rod else { return (length(d) - self.radius).abs() };
        let beyond = (d[axis].abs() - half).max(0.0);
        d[axis] = 0.0;
        (length(d) - self.radius).hypot(beyond)
    }
}

/// Whether two round bodies have surfaces that are, over a large share of one of them, closer together than flat faces are to
/// what they replace. `facet` is the size of the faces relative to the radius.
pub(super) fn nearly_coincide(one: &Shape, other: &Shape, facet: f64) -> bool {
    let much = |a: &Round, b: &Round| {
        let off = FACE_DISTANCE * facet * facet * (a.radius + b.radius);
        let all = a.samples();
        let near = all.iter().filter(|p| b.distance(**p) < off).count();
        near as f64 > MAX_SHARE * all.len() as f64
    };
    let (ones, others) = (Round::of(one), Round::of(other));
    ones.iter().any(|one| others.iter().any(|other| much(one, other) || much(other, one)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_bodies_with_a_thin_layer_between_them_nearly_coincide_and_crossing_ones_do_not() {
        let ball = |x: f64, radius: f64| Shape::Sphere { center: [x, 0.0, 0.0], radius };
        let rod = |radius| Shape::Cylinder { axis: 2, base: [0.0, 0.0, -1.0], radius, height: 2.0 };
        assert!(nearly_coincide(&ball(0.0, 1.0), &ball(0.0, 1.01), 0.3));
        assert!(!nearly_coincide(&ball(0.0, 1.0), &ball(0.0, 1.01), 0.1));
        assert!(nearly_coincide(&rod(1.0), &rod(1.005), 0.3));
        assert!(!nearly_coincide(&ball(0.0, 1.0), &ball(0.5, 1.0), 0.3));
        // A ball that touches the rod around it along a circle, one that touches a ball from inside.
        assert!(!nearly_coincide(&ball(0.0, 1.0), &rod(1.0), 0.3));
        assert!(!nearly_coincide(&ball(0.0, 1.0), &ball(0.5, 0.5), 0.3));
    }
}

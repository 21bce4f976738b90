//! Round bodies so close together that the flat faces in their place cross although the bodies do not.

use super::faceting::geodesic;
use super::{Point, capsule};
use crate::segments::distance_to_segment;
use crate::shapes::Shape;
use elastocap_linalg::vector::{length, minus};
use std::f64::consts::TAU;

/// The distance of flat faces from the surface that they replace, relative to the radius, over the square of
/// their relative size.
const FACE_DISTANCE: f64 = 0.1;

/// The largest share of a surface that may be closer to another surface than the faceting error. Surfaces
/// that cross at an angle are that close on a strip, and a surface that touches another one from inside on a
/// spot. It is not tuned.
const MAX_SHARE: f64 = 0.3;

/// A round surface.
#[derive(Debug, Clone, Copy)]
enum Round {
    /// The surface of a ball.
    Ball { center: Point, radius: f64 },
    /// The surface of a capsule.
    Capsule { ends: [Point; 2], radius: f64 },
    /// The curved surface of a cylinder, or the inner or the outer one of a tube; `half` is half its height.
    Rod { center: Point, radius: f64, axis: usize, half: f64 },
}

impl Round {
    /// The round surfaces of a shape.
    fn of(shape: &Shape) -> Vec<Self> {
        let rod = |axis: usize, base: &Point, radius: f64, height: f64| {
            let mut center = *base;
            center[axis] += 0.5 * height;
            Self::Rod { center, radius, axis, half: 0.5 * height }
        };
        match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                vec![Self::Ball { center: *center, radius: *radius }]
            }
            Shape::Capsule { from, to, radius } => {
                vec![Self::Capsule { ends: [*from, *to], radius: *radius }]
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
        let (center, radius, axis, half) = match *self {
            Self::Ball { center, radius } => return geodesic(center, radius, 0.1).points,
            Self::Capsule { ends, radius } => return capsule::samples(ends, radius),
            Self::Rod { center, radius, axis, half } => (center, radius, axis, half),
        };
        let turns = (0..64).map(|k| (TAU * f64::from(k) / 64.0).sin_cos());
        let place = |(s, c): (f64, f64), z: f64| {
            let mut p = center;
            p[axis] += z;
            p[(axis + 1) % 3] += radius * c;
            p[(axis + 2) % 3] += radius * s;
            p
        };
        turns.flat_map(|t| (-20..=20).map(move |k| place(t, half * f64::from(k) / 20.0))).collect()
    }

    /// The radius, m.
    fn radius(&self) -> f64 {
        match self {
            Self::Ball { radius, .. } | Self::Capsule { radius, .. } | Self::Rod { radius, .. } => *radius,
        }
    }

    /// The distance of a point from the curved part of the surface, m.
    fn distance(&self, p: Point) -> f64 {
        let (center, radius, axis, half) = match *self {
            Self::Ball { center, radius } => return (length(minus(p, center)) - radius).abs(),
            Self::Capsule { ends, radius } => return (distance_to_segment(p, ends) - radius).abs(),
            Self::Rod { center, radius, axis, half } => (center, radius, axis, half),
        };
        let mut d = minus(p, center);
        let beyond = (d[axis].abs() - half).max(0.0);
        d[axis] = 0.0;
        (length(d) - radius).hypot(beyond)
    }
}

/// Whether the surfaces of two round bodies are closer together than the faceting error over a large share of
/// one of them. `facet` is the size of the faces relative to the radius.
pub(super) fn nearly_coincide(one: &Shape, other: &Shape, facet: f64) -> bool {
    let is_close_over_much = |a: &Round, b: &Round| {
        let faceting_error = FACE_DISTANCE * facet * facet * (a.radius() + b.radius());
        let samples = a.samples();
        let near = samples.iter().filter(|p| b.distance(**p) < faceting_error).count();
        near as f64 > MAX_SHARE * samples.len() as f64
    };
    let (ones, others) = (Round::of(one), Round::of(other));
    ones.iter().any(|one| {
        others.iter().any(|other| is_close_over_much(one, other) || is_close_over_much(other, one))
    })
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
        let finger = |radius| Shape::Capsule { from: [0.0; 3], to: [3.0, 4.0, 5.0], radius };
        assert!(nearly_coincide(&finger(1.0), &finger(1.01), 0.3));
        assert!(!nearly_coincide(&finger(1.0), &finger(1.5), 0.3));
        // A ball that touches the rod around it along a circle, one that touches a ball from inside.
        assert!(!nearly_coincide(&ball(0.0, 1.0), &rod(1.0), 0.3));
        assert!(!nearly_coincide(&ball(0.0, 1.0), &ball(0.5, 0.5), 0.3));
    }
}

//! Round bodies so near to one another that flat faces in their place cross where they do not.

use super::bodies::geodesic;
use crate::shapes::Shape;
use elastocap_linalg::vector::{length, minus};
use std::f64::consts::TAU;

type P = [f64; 3];

/// The distance of flat faces from the surface that they stand for, over their size squared and the radius.
const OFF: f64 = 0.1;

/// The part of a surface that may be nearer to another than flat faces are: those that cross at an angle have a strip of it,
/// one that touches from inside a spot.
const PART: f64 = 0.3;

/// A body of revolution: a ball or a cylinder.
#[derive(Debug, Clone, Copy)]
struct Round {
    center: P,
    radius: f64,
    /// The axis of a cylinder, and half its height.
    rod: Option<(usize, f64)>,
}

impl Round {
    fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                Some(Self { center: *center, radius: *radius, rod: None })
            }
            Shape::Cylinder { axis, base, radius, height } => {
                let mut center = *base;
                center[*axis] += 0.5 * height;
                Some(Self { center, radius: *radius, rod: Some((*axis, 0.5 * height)) })
            }
            _ => None,
        }
    }

    /// Points all over the curved part.
    fn samples(&self) -> Vec<P> {
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

    /// The distance of a point from the curved part of the surface.
    fn distance(&self, p: P) -> f64 {
        let mut d = minus(p, self.center);
        let Some((axis, half)) = self.rod else { return (length(d) - self.radius).abs() };
        let beyond = (d[axis].abs() - half).max(0.0);
        d[axis] = 0.0;
        (length(d) - self.radius).hypot(beyond)
    }
}

/// Whether the surfaces of two round bodies are, over much of one of them, nearer than faces of this size over the radius are to
/// what they stand for.
pub(super) fn too_near(one: &Shape, other: &Shape, facet: f64) -> bool {
    let (Some(one), Some(other)) = (Round::of(one), Round::of(other)) else { return false };
    let off = OFF * facet * facet * (one.radius + other.radius);
    let much = |a: &Round, b: &Round| {
        let all = a.samples();
        let near = all.iter().filter(|p| b.distance(**p) < off).count();
        near as f64 > PART * all.len() as f64
    };
    much(&one, &other) || much(&other, &one)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thin_layers_between_round_bodies_are_too_near_and_crossings_are_not() {
        let ball = |x: f64, radius: f64| Shape::Sphere { center: [x, 0.0, 0.0], radius };
        let rod = |radius| Shape::Cylinder { axis: 2, base: [0.0, 0.0, -1.0], radius, height: 2.0 };
        assert!(too_near(&ball(0.0, 1.0), &ball(0.0, 1.01), 0.3));
        assert!(!too_near(&ball(0.0, 1.0), &ball(0.0, 1.01), 0.1));
        assert!(too_near(&rod(1.0), &rod(1.005), 0.3));
        assert!(!too_near(&ball(0.0, 1.0), &ball(0.5, 1.0), 0.3));
        // A ball that touches the rod around it along a circle, one that touches a ball from inside.
        assert!(!too_near(&ball(0.0, 1.0), &rod(1.0), 0.3));
        assert!(!too_near(&ball(0.0, 1.0), &ball(0.5, 0.5), 0.3));
    }
}

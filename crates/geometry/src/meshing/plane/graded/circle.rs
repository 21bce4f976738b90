//! Circles in the plane.

use std::f64::consts::{PI, TAU};

/// A circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its middle.
    pub center: [f64; 2],
    /// Its radius, positive.
    pub radius: f64,
}

impl Circle {
    /// The point at an angle.
    pub(super) fn at(&self, angle: f64) -> [f64; 2] {
        // Where the circle crosses an axis through its middle, the point is exactly on that axis.
        let (sine, cosine) = angle.sin_cos();
        let clean = |x: f64| if x.abs() < 1e-15 { 0.0 } else { x };
        [self.center[0] + self.radius * clean(cosine), self.center[1] + self.radius * clean(sine)]
    }

    /// Whether a point lies inside the circle.
    pub fn contains(&self, p: [f64; 2]) -> bool {
        (p[0] - self.center[0]).hypot(p[1] - self.center[1]) < self.radius
    }

    /// The angle at which a point lies, as seen from the middle.
    pub(super) fn angle(&self, p: [f64; 2]) -> f64 {
        (p[1] - self.center[1]).atan2(p[0] - self.center[0])
    }

    /// The angle, less than half a turn, by which the circle turns from a point to another; positive
    /// anticlockwise.
    pub fn turn(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let turn = (self.angle(to) - self.angle(from)).rem_euclid(TAU);
        if turn > PI { turn - TAU } else { turn }
    }

    /// The unit vector along the circle at one of its points. Of the two, the one that is closer to the
    /// direction `towards`.
    pub fn tangent(&self, at: [f64; 2], towards: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| (at[k] - self.center[k]) / self.radius);
        let sign = if x * towards[1] - y * towards[0] < 0.0 { -1.0 } else { 1.0 };
        [-sign * y, sign * x]
    }

    /// The middle of the shorter arc between two points.
    pub(super) fn between(&self, p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
        let [a, b] = [p, q].map(|p| [p[0] - self.center[0], p[1] - self.center[1]]);
        let sum = [a[0] + b[0], a[1] + b[1]];
        let length = sum[0].hypot(sum[1]);
        [0, 1].map(|k| self.center[k] + self.radius * sum[k] / length)
    }

    /// The points at which a segment meets the circle, as shares of the way along the segment.
    pub(super) fn crossings(&self, [a, b]: [[f64; 2]; 2]) -> Vec<f64> {
        let along = [b[0] - a[0], b[1] - a[1]];
        let from = [a[0] - self.center[0], a[1] - self.center[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let half = along[0] * from[0] + along[1] * from[1];
        let constant = from[0] * from[0] + from[1] * from[1] - self.radius * self.radius;
        let root = half * half - square * constant;
        if root <= 0.0 || square == 0.0 {
            return Vec::new();
        }
        let root = root.sqrt();
        // With this sign of the square root, neither of the roots suffers from cancellation.
        let far = -(half + root.copysign(half));
        let roots = [far / square, if far == 0.0 { f64::NAN } else { constant / far }];
        roots.into_iter().filter(|t| (0.0..=1.0).contains(t)).collect()
    }
}

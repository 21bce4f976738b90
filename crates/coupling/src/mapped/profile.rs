//! The outline of an indenter that is the same all along x3: flat in the middle, round at its edges, with
//! upright sides unless it is a cylinder.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::scene::indenter::{IndenterForm, Rounding};

/// The right half of the outline, from its lowest point in the middle to the middle of its top. Lengths in m,
/// from the lowest point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    /// Half of the width of the flat face; zero for a cylinder.
    pub(super) flat: f64,
    /// The radius of the rounded edge.
    pub(super) radius: f64,
    /// How tall the indenter is.
    pub(super) height: f64,
    /// Whether the rounded edge continues around the upper side.
    pub(super) is_cylinder: bool,
}

/// A point of the outline that faces a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// The length of the outline up to the point; negative on the left half.
    pub(super) along: f64,
    /// The coordinates of the point along x1 and x2.
    pub(super) at: [f64; 2],
    /// The outward normal of the outline.
    pub(super) normal: [f64; 2],
    /// The signed distance of the given point from the outline; negative inside.
    pub(super) gap: f64,
}

impl Profile {
    /// The profile of an indenter of this form; `None` for a ball or a box.
    pub(super) fn of(form: &IndenterForm) -> Option<Self> {
        match form.rounding {
            Rounding::AlongX3 { radius, is_cylinder } => {
                Some(Self { flat: form.flat(), radius, height: form.height, is_cylinder })
            }
            Rounding::Sharp | Rounding::Ball { .. } => None,
        }
    }

    /// The nearest point of the outline to a point below or beside it.
    pub(super) fn foot(&self, [x, y]: [f64; 2]) -> Foot {
        let sign = if x < 0.0 { -1.0 } else { 1.0 };
        let out = x.abs() - self.flat;
        let along = if out <= 0.0 {
            x.abs()
        } else if y >= self.radius && !self.is_cylinder {
            self.round_end() + y - self.radius
        } else {
            self.flat + self.radius * out.atan2(self.radius - y)
        };
        let ([at, height], [normal, up]) = self.point(along);
        let gap = (x.abs() - at) * normal + (y - height) * up;
        Foot { along: sign * along, at: [sign * at, height], normal: [sign * normal, up], gap }
    }

    /// The point of the outline that faces a point below or beside it.
    ///
    /// Where indenter and layer touch, with a `film` between them (m), the facing point is the foot. Where
    /// the outline is vertical, it is moved up by the distance between the two, so that the space beside an
    /// indenter does not fold; the normal is that of the foot. Without a `film`, it is the point of the
    /// outline vertically above, as far as the outline extends, and the gap is the vertical distance.
    pub(super) fn facing(&self, point: [f64; 2], film: Option<f64>) -> Foot {
        let (along, gap, normal) = match film {
            Some(film) => {
                let foot = self.foot(point);
                (foot.along.abs() + (foot.gap + film) * foot.normal[0].abs(), foot.gap, foot.normal)
            }
            None => {
                let out = (point[0].abs() - self.flat) / self.radius;
                let angle = out.min(1.0).asin();
                let along = if out <= 0.0 { point[0].abs() } else { self.flat + self.radius * angle };
                let (at, normal) = self.point(along);
                (along, at[1] - point[1], [normal[0].copysign(point[0]), normal[1]])
            }
        };
        let sign = if point[0] < 0.0 { -1.0 } else { 1.0 };
        let (at, _) = self.point(along);
        Foot { along: sign * along, at: [sign * at[0], at[1]], normal, gap }
    }

    /// The length of the outline up to the end of the rounded edge; for a cylinder, up to its uppermost
    /// point.
    pub(super) fn round_end(&self) -> f64 {
        self.flat + self.radius * if self.is_cylinder { PI } else { FRAC_PI_2 }
    }

    /// The length of the outline up to the end of the side of the indenter's box, if the side begins at the
    /// length `begin`: at the upper edge, or as far from a cylinder's uppermost point as it begins from the
    /// lowest one.
    pub(super) fn side_end(&self, begin: f64) -> f64 {
        if self.is_cylinder { self.round_end() - begin } else { self.round_end() + self.height - self.radius }
    }

    /// The point of the right half at a length along it, and the outward normal.
    pub(super) fn point(&self, along: f64) -> ([f64; 2], [f64; 2]) {
        if along <= self.flat {
            return ([along, 0.0], [0.0, -1.0]);
        }
        if along > self.round_end() {
            return ([self.flat + self.radius, self.radius + along - self.round_end()], [1.0, 0.0]);
        }
        let (sin, cos) = ((along - self.flat) / self.radius).sin_cos();
        ([self.flat + self.radius * sin, self.radius * (1.0 - cos)], [sin, -cos])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PUNCH: Profile = Profile { flat: 1.0, radius: 0.5, height: 3.0, is_cylinder: false };
    const CYLINDER: Profile = Profile { flat: 0.0, radius: 0.5, height: 1.0, is_cylinder: true };

    #[test]
    fn the_foot_of_a_point_beside_the_outline_is_where_its_normal_goes_through_the_point() {
        for profile in [PUNCH, CYLINDER] {
            for k in 0..40 {
                let along = profile.side_end(0.1) * (f64::from(k) + 0.5) / 40.0;
                let (at, normal) = profile.point(along);
                for gap in [0.2, -0.1] {
                    for sign in [1.0, -1.0] {
                        let foot = profile.foot([sign * (at[0] + gap * normal[0]), at[1] + gap * normal[1]]);
                        assert!((foot.gap - gap).abs() < 1e-12, "{along} {gap}: {foot:?}");
                        assert!((foot.along - sign * along).abs() < 1e-12, "{along}: {foot:?}");
                        assert!((foot.at[0] - sign * at[0]).hypot(foot.at[1] - at[1]) < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn the_outline_is_as_long_as_its_parts_and_turns_without_a_jump() {
        assert!((PUNCH.side_end(0.0) - (1.0 + 0.25 * PI + 2.5)).abs() < 1e-12);
        assert_eq!(PUNCH.point(PUNCH.side_end(0.0)).0, [1.5, 3.0]);
        assert!((CYLINDER.side_end(0.1) - (0.5 * PI - 0.1)).abs() < 1e-12);
        for corner in [PUNCH.flat, PUNCH.round_end()] {
            let [a, b] = [-1e-9, 1e-9].map(|d| PUNCH.point(corner + d));
            assert!((a.0[0] - b.0[0]).hypot(a.0[1] - b.0[1]) < 3e-9);
            assert!((a.1[0] - b.1[0]).hypot(a.1[1] - b.1[1]) < 1e-8);
        }
    }
}

//! Rigid bodies that the rubber may touch but not enter.

use super::dimension::{Dimension, Plane};
use super::side::Side;

/// Points along each direction of a side that are kept out of an obstacle. Nodes alone are not enough: the
/// side between two of them would cut through a corner of the obstacle, and the layer would slide past it.
/// Tuned: `benches/layer_errors.py --plane`.
pub(crate) const SIDE_POINTS: usize = 4;

/// A rigid body and the surface that may touch it.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle<S: Dimension = Plane> {
    /// The form of the body.
    pub shape: ObstacleShape,
    /// The sides of elements that may touch it.
    pub sides: Vec<Side<S>>,
    /// A node of the rubber that carries the body along `x1` and takes its horizontal force; `None` for a
    /// body that moves only with its load.
    pub carrier: Option<u32>,
}

/// The form of a rigid body, given by the distance to its surface. In plane strain it is cut at `x3 = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObstacleShape {
    /// The substrate: everything below `x2 = 0`.
    Substrate,
    /// The flank of a sharp punch: everything with `side * x1 < 0`.
    Flank {
        /// 1 or -1.
        side: f64,
    },
    /// An indenter above `x2 = 0`.
    Indenter(IndenterProfile),
}

/// The form of a rigid indenter whose lowest point is the origin. In plane strain it is cut at `x3 = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IndenterProfile {
    /// A flat-faced punch with `|x1| <= half_width`, its corners rounded, the same all along `x3`.
    Punch {
        /// Half the width of the punch in m.
        half_width: f64,
        /// Radius of the corners in m, above zero and at most the half width.
        corner_radius: f64,
    },
    /// A cylinder with its axis along `x3`.
    Cylinder {
        /// Its radius in m.
        radius: f64,
    },
    /// A sphere; in plane strain a cylinder.
    Sphere {
        /// Its radius in m.
        radius: f64,
    },
    /// A flat-faced punch with `|x1|` and `|x3|` at most the half widths, its edges and corners rounded; in
    /// plane strain a [`IndenterProfile::Punch`].
    Block {
        /// Half the widths along `x1` and `x3` in m.
        half_widths: [f64; 2],
        /// Radius of the edges in m, above zero and at most the half widths.
        corner_radius: f64,
    },
}

/// Distance of a point from a surface with its first two derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Signed distance in m: negative inside the body.
    pub distance: f64,
    /// Gradient: the unit normal out of the body.
    pub normal: [f64; 3],
    /// Second derivatives in 1/m.
    pub hessian: [[f64; 3]; 3],
}

impl Gap {
    /// The distance from a flat part of the surface.
    fn flat(distance: f64, normal: [f64; 3]) -> Self {
        Self { distance, normal, hessian: [[0.0; 3]; 3] }
    }

    /// The distance from a surface all of whose points are `radius` away from a point, line or plane. `from`
    /// is the vector to the given point from the nearest point of these; its coordinates along the line or
    /// plane are zero, and marked `false` in `across`.
    fn round(from: [f64; 3], across: [bool; 3], radius: f64) -> Self {
        let r = from.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let normal = from.map(|x| x / r);
        let mut hessian = [[0.0; 3]; 3];
        for k in (0..3).filter(|&k| across[k]) {
            for m in (0..3).filter(|&m| across[m]) {
                let unit = if k == m { 1.0 } else { 0.0 };
                hessian[k][m] = (unit - normal[k] * normal[m]) / r;
            }
        }
        Self { distance: r - radius, normal, hessian }
    }
}

impl ObstacleShape {
    /// Distance of a point from the body; `x` is its position (m) from where the body has been moved to.
    pub fn gap(&self, x: [f64; 3]) -> Gap {
        match self {
            Self::Substrate => Gap::flat(x[1], [0.0, 1.0, 0.0]),
            Self::Flank { side } => Gap::flat(side * x[0], [*side, 0.0, 0.0]),
            Self::Indenter(profile) => profile.gap(x),
        }
    }

    /// The smallest radius (m) of the rounded edges: a point farther inside may be nearer to another face
    /// than to the one that it came through.
    pub(crate) fn radius(&self) -> f64 {
        match *self {
            Self::Substrate | Self::Flank { .. } => f64::INFINITY,
            Self::Indenter(profile) => match profile {
                IndenterProfile::Punch { corner_radius, .. }
                | IndenterProfile::Block { corner_radius, .. } => corner_radius,
                IndenterProfile::Cylinder { radius } | IndenterProfile::Sphere { radius } => radius,
            },
        }
    }
}

impl IndenterProfile {
    /// Distance of a point from the indenter; `x` is its position (m) from the lowest point of the indenter.
    pub fn gap(&self, x: [f64; 3]) -> Gap {
        match *self {
            Self::Punch { half_width, corner_radius } => block([half_width, f64::INFINITY], corner_radius, x),
            Self::Block { half_widths, corner_radius } => block(half_widths, corner_radius, x),
            Self::Cylinder { radius } => Gap::round([x[0], x[1] - radius, 0.0], [true, true, false], radius),
            Self::Sphere { radius } => Gap::round([x[0], x[1] - radius, x[2]], [true; 3], radius),
        }
    }

    /// Half the width along `x1` and the radius of the corners in m, of an indenter with a flat face in the
    /// plane `x3 = 0`.
    pub fn flat_face(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Punch { half_width, corner_radius } => Some((half_width, corner_radius)),
            Self::Block { half_widths: [half_width, _], corner_radius } => Some((half_width, corner_radius)),
            Self::Cylinder { .. } | Self::Sphere { .. } => None,
        }
    }

    /// The radius (m) of the corners of an indenter with a flat face, but at least `least` (m) or half its
    /// width, whichever is smaller.
    pub(crate) fn corner_radius(&self, least: f64) -> Option<f64> {
        self.flat_face().map(|(half_width, radius)| radius.max(least.min(half_width)))
    }
}

/// Distance of the point `x` from a block with a flat lower face and with edges and corners of this `radius`.
/// Above the centre lines of the rounded lower edges, it is the distance from the flank or upright edge.
fn block(half_widths: [f64; 2], radius: f64, x: [f64; 3]) -> Gap {
    let side = [x[0], x[2]].map(|x| if x < 0.0 { -1.0 } else { 1.0 });
    let out = [side[0] * x[0] - (half_widths[0] - radius), side[1] * x[2] - (half_widths[1] - radius)];
    let beyond = out.map(|o| o > 0.0);
    if beyond == [false, false] {
        return Gap::flat(-x[1], [0.0, -1.0, 0.0]);
    }
    let up = x[1] - radius;
    let across = [beyond[0], up < 0.0, beyond[1]];
    let from = [
        if beyond[0] { side[0] * out[0] } else { 0.0 },
        if up < 0.0 { up } else { 0.0 },
        if beyond[1] { side[1] * out[1] } else { 0.0 },
    ];
    Gap::round(from, across, radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_and_curvatures_are_derivatives_of_the_distance() {
        let indenters = [
            IndenterProfile::Punch { half_width: 1.0, corner_radius: 0.3 },
            IndenterProfile::Cylinder { radius: 2.0 },
            IndenterProfile::Sphere { radius: 2.0 },
            IndenterProfile::Block { half_widths: [1.0, 0.8], corner_radius: 0.3 },
        ];
        let shapes = [ObstacleShape::Substrate, ObstacleShape::Flank { side: -1.0 }];
        let shapes = shapes.into_iter().chain(indenters.map(ObstacleShape::Indenter));
        let h = 1e-5;
        for shape in shapes {
            for y in [
                [0.2, -0.3, 0.1],
                [0.9, -0.1, 0.7],
                [-0.95, 0.1, -0.75],
                [1.2, 0.9, 0.3],
                [-1.4, 0.7, 1.0],
                [0.85, 0.02, 0.0],
                [0.3, 0.1, 0.2],
                [0.95, 0.1, 0.3],
                [0.85, 0.15, 0.65],
                [0.96, 0.7, -0.1],
            ] {
                let g = shape.gap(y);
                let at = |k: usize, s: f64| {
                    let mut z = y;
                    z[k] += s;
                    shape.gap(z)
                };
                for k in 0..3 {
                    let (a, b) = (at(k, h), at(k, -h));
                    let slope = (a.distance - b.distance) / (2.0 * h);
                    assert!((slope - g.normal[k]).abs() < 1e-8, "{shape:?} {y:?}");
                    for m in 0..3 {
                        let slope = (a.normal[m] - b.normal[m]) / (2.0 * h);
                        assert!((slope - g.hessian[k][m]).abs() < 1e-7, "{shape:?} {y:?}");
                    }
                }
            }
        }
    }
}

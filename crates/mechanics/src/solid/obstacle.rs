//! Rigid bodies that the rubber may touch but not enter.

use super::mesh::BoundaryEdge;

/// A rigid body and the surface that may touch it.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Its form.
    pub shape: Shape,
    /// The sides that may touch it.
    pub edges: Vec<BoundaryEdge>,
    /// A node of the rubber that carries it along `x1`, and takes its horizontal force: an obstacle that is fixed to a
    /// point of the rubber.
    pub carrier: Option<u32>,
}

/// The form of a rigid body, given by the distance to its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Everything below `x2 = 0`.
    Below,
    /// Everything with `side * x1 < 0`.
    Wall {
        /// 1 or -1.
        side: f64,
    },
    /// A flat-faced punch above `x2 = 0` with `|x1| <= half_width`, its corners rounded.
    Punch {
        /// Half its width in m.
        half_width: f64,
        /// Radius of its corners in m, above zero and at most the half width.
        corner_radius: f64,
    },
    /// A cylinder above `x2 = 0`, its axis along `x3`.
    Cylinder {
        /// Its radius in m.
        radius: f64,
    },
}

/// Distance of a point from a surface with its first two derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Signed distance in m: negative inside the body.
    pub distance: f64,
    /// Gradient: the unit normal out of the body.
    pub normal: [f64; 2],
    /// Curvature of the surfaces of equal distance in 1/m: the Hessian is `curvature (1 - n n')`.
    pub curvature: f64,
}

impl Shape {
    /// Distance of `y` (m) from the body moved by `shift` (m).
    pub fn gap(&self, y: [f64; 2], shift: [f64; 2]) -> Gap {
        let x = [y[0] - shift[0], y[1] - shift[1]];
        match *self {
            Self::Below => Gap { distance: x[1], normal: [0.0, 1.0], curvature: 0.0 },
            Self::Wall { side } => Gap { distance: side * x[0], normal: [side, 0.0], curvature: 0.0 },
            Self::Punch { half_width, corner_radius } => {
                let side = if x[0] < 0.0 { -1.0 } else { 1.0 };
                let out = side * x[0] - (half_width - corner_radius);
                let up = x[1] - corner_radius;
                if out <= 0.0 {
                    Gap { distance: -x[1], normal: [0.0, -1.0], curvature: 0.0 }
                } else if up >= 0.0 {
                    Gap { distance: out - corner_radius, normal: [side, 0.0], curvature: 0.0 }
                } else {
                    let radius = out.hypot(up);
                    let normal = [side * out / radius, up / radius];
                    Gap { distance: radius - corner_radius, normal, curvature: 1.0 / radius }
                }
            }
            Self::Cylinder { radius } => {
                let from = [x[0], x[1] - radius];
                let r = from[0].hypot(from[1]).max(f64::MIN_POSITIVE);
                Gap { distance: r - radius, normal: [from[0] / r, from[1] / r], curvature: 1.0 / r }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_and_curvatures_are_derivatives_of_the_distance() {
        let shapes = [
            Shape::Below,
            Shape::Wall { side: -1.0 },
            Shape::Punch { half_width: 1.0, corner_radius: 0.3 },
            Shape::Cylinder { radius: 2.0 },
        ];
        let h = 1e-5;
        for shape in shapes {
            for y in [[0.2, -0.3], [0.9, -0.1], [-0.95, 0.1], [1.2, 0.9], [-1.4, 0.7], [0.85, 0.02]] {
                let shift = [0.01, -0.02];
                let g = shape.gap(y, shift);
                let at = |k: usize, s: f64| {
                    let mut z = y;
                    z[k] += s;
                    shape.gap(z, shift)
                };
                for k in 0..2 {
                    let (a, b) = (at(k, h), at(k, -h));
                    assert!(
                        ((a.distance - b.distance) / (2.0 * h) - g.normal[k]).abs() < 1e-8,
                        "{shape:?} {y:?}"
                    );
                    for m in 0..2 {
                        let unit = if k == m { 1.0 } else { 0.0 };
                        let hessian = g.curvature * (unit - g.normal[k] * g.normal[m]);
                        assert!(
                            ((a.normal[m] - b.normal[m]) / (2.0 * h) - hessian).abs() < 1e-7,
                            "{shape:?} {y:?}"
                        );
                    }
                }
            }
        }
    }
}

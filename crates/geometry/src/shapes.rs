//! Shapes of bodies, in SI units.

use crate::box3::Box3;
use crate::cubic::Cubic;
use crate::outline;
use crate::segments::distance_to_segment;
pub use crate::triangle_surface::TriangleSurface;
use crate::winding;
use std::ops::Range;

/// The shape and position of a body. Lengths in metres; axis 0, 1, 2 is x1, x2, x3.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// An axis-aligned box, or a sheet (a conductor only); a dielectric slab has infinite bounds.
    Box(Box3),
    /// A ball.
    Sphere {
        /// Its middle.
        center: [f64; 3],
        /// Its radius, positive.
        radius: f64,
    },
    /// Everything outside a ball: a closed conducting surface, with nothing solved beyond it. A conductor
    /// only.
    Shell {
        /// The middle of the hollow.
        center: [f64; 3],
        /// The radius of the hollow, positive.
        radius: f64,
    },
    /// All points within a radius of a segment: a cylinder of any direction between two half balls.
    Capsule {
        /// One end of the segment.
        from: [f64; 3],
        /// The other end; where both are the same, the body is a ball.
        to: [f64; 3],
        /// Its radius, positive.
        radius: f64,
    },
    /// A circular cylinder along a coordinate axis.
    Cylinder {
        /// The axis of the cylinder.
        axis: usize,
        /// The middle of the end with the lower coordinate.
        base: [f64; 3],
        /// Its radius, positive.
        radius: f64,
        /// Its length along the axis, positive; zero for a disc, which only a conductor may be.
        height: f64,
    },
    /// A circular tube along a coordinate axis.
    Tube {
        /// The axis of the tube.
        axis: usize,
        /// The middle of the end with the lower coordinate.
        base: [f64; 3],
        /// Its radii inside and outside, ascending and positive.
        radii: [f64; 2],
        /// Its length along the axis, positive; zero for a ring, which only a conductor may be.
        height: f64,
    },
    /// A polygon pulled along a coordinate axis; a conductor may have `from == to`, a sheet.
    Extrusion {
        /// The axis along which the polygon is pulled.
        axis: usize,
        /// Lower end along the axis.
        from: f64,
        /// Upper end along the axis.
        to: f64,
        /// The corners of one simple polygon, either way round, in the two other coordinates in ascending
        /// order of axis.
        outline: Vec<[f64; 2]>,
        /// The parts of the outline that stand for curves, in the order of the corners; empty if the sides of
        /// the polygon are the true ones.
        arcs: Vec<Arc>,
    },
    /// The space that a closed surface of triangles encloses.
    Surface(TriangleSurface),
    /// The cells of a group of an imported volume mesh.
    Physical(String),
}

/// Sides of an outline that stand for an arc of a curve: the ends of the sides lie on the curve, close
/// together.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// The curve, in the coordinates of the outline.
    pub curve: Curve,
    /// The numbers of the sides, which are those of the corners in which the sides begin. The arc ends in the
    /// corner after them; after the last corner of the outline comes the first one again.
    pub sides: Range<usize>,
}

/// A curve that an outline may follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// A circle, of which the arc is a part.
    Circle {
        /// Its middle.
        center: [f64; 2],
        /// Its radius.
        radius: f64,
    },
    /// A cubic from the first corner of the arc to the last.
    Cubic(Cubic),
}

impl Shape {
    /// The smallest box that contains the body, infinite where the body is. For a [`Shape::Shell`] it is the
    /// box around the hollow. `None` for a group of a mesh.
    pub fn bounds(&self) -> Option<Box3> {
        match self {
            Shape::Box(b) => Some(*b),
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                Some(Box3 { min: center.map(|x| x - radius), max: center.map(|x| x + radius) })
            }
            Shape::Capsule { from, to, radius } => Some(Box3 {
                min: [0, 1, 2].map(|k| from[k].min(to[k]) - radius),
                max: [0, 1, 2].map(|k| from[k].max(to[k]) + radius),
            }),
            Shape::Cylinder { axis, base, radius, height }
            | Shape::Tube { axis, base, radii: [_, radius], height } => {
                let mut b = Box3 { min: base.map(|x| x - radius), max: base.map(|x| x + radius) };
                b.min[*axis] = base[*axis];
                b.max[*axis] = base[*axis] + height;
                Some(b)
            }
            Shape::Extrusion { axis, from, to, outline, .. } => {
                let corner = |q: &[f64; 2], z: f64| match axis {
                    0 => [z, q[0], q[1]],
                    1 => [q[0], z, q[1]],
                    _ => [q[0], q[1], z],
                };
                around(outline.iter().flat_map(|q| [*from, *to].map(|z| corner(q, z))))
            }
            Shape::Surface(surface) => around(surface.points.iter().copied()),
            Shape::Physical(_) => None,
        }
    }

    /// The box or sheet, if the shape is one.
    pub fn as_box(&self) -> Option<Box3> {
        match self {
            Shape::Box(region) => Some(*region),
            Shape::Sphere { .. }
            | Shape::Shell { .. }
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. }
            | Shape::Tube { .. }
            | Shape::Extrusion { .. }
            | Shape::Surface(_)
            | Shape::Physical(_) => None,
        }
    }

    /// This shape moved by the vector `by`, m; `None` for a group of a mesh, which stays where the mesh is.
    #[must_use]
    pub fn moved(&self, by: [f64; 3]) -> Option<Self> {
        let place = |x: &[f64; 3]| [0, 1, 2].map(|k| x[k] + by[k]);
        Some(match self {
            Shape::Box(b) => Shape::Box(Box3 { min: place(&b.min), max: place(&b.max) }),
            Shape::Sphere { center, radius } => Shape::Sphere { center: place(center), radius: *radius },
            Shape::Shell { center, radius } => Shape::Shell { center: place(center), radius: *radius },
            Shape::Capsule { from, to, radius } => {
                Shape::Capsule { from: place(from), to: place(to), radius: *radius }
            }
            Shape::Cylinder { axis, base, radius, height } => {
                Shape::Cylinder { axis: *axis, base: place(base), radius: *radius, height: *height }
            }
            Shape::Tube { axis, base, radii, height } => {
                Shape::Tube { axis: *axis, base: place(base), radii: *radii, height: *height }
            }
            Shape::Extrusion { axis, from, to, outline, arcs } => {
                let across = match axis {
                    0 => [by[1], by[2]],
                    1 => [by[0], by[2]],
                    _ => [by[0], by[1]],
                };
                let place = |p: &[f64; 2]| [p[0] + across[0], p[1] + across[1]];
                let moved = |arc: &Arc| {
                    let curve = match &arc.curve {
                        Curve::Circle { center, radius } => {
                            Curve::Circle { center: place(center), radius: *radius }
                        }
                        Curve::Cubic(Cubic { control }) => {
                            Curve::Cubic(Cubic { control: control.each_ref().map(place) })
                        }
                    };
                    Arc { curve, sides: arc.sides.clone() }
                };
                Shape::Extrusion {
                    axis: *axis,
                    from: from + by[*axis],
                    to: to + by[*axis],
                    outline: outline.iter().map(place).collect(),
                    arcs: arcs.iter().map(moved).collect(),
                }
            }
            Shape::Surface(surface) => Shape::Surface(TriangleSurface {
                points: surface.points.iter().map(place).collect(),
                faces: surface.faces.clone(),
            }),
            Shape::Physical(_) => return None,
        })
    }

    /// Whether the shape contains the point; on its surface, either answer is possible. A sheet contains no
    /// point, nor does a group of a mesh, whose cells only the mesh knows.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let squared = |c: &[f64; 3]| (0..3).map(|k| (point[k] - c[k]).powi(2)).sum::<f64>();
        match self {
            Shape::Box(b) => b.sheet_normal().is_none() && b.contains(point),
            Shape::Sphere { center, radius } => squared(center) < radius * radius,
            Shape::Shell { center, radius } => squared(center) > radius * radius,
            Shape::Capsule { from, to, radius } => distance_to_segment(point, [*from, *to]) < *radius,
            Shape::Cylinder { axis, base, radius, height } => {
                let z = point[*axis] - base[*axis];
                let across = squared(base) - z * z;
                (0.0..*height).contains(&z) && across < radius * radius
            }
            Shape::Tube { axis, base, radii, height } => {
                let z = point[*axis] - base[*axis];
                let across = squared(base) - z * z;
                let [inner, outer] = radii.map(|radius| radius * radius);
                (0.0..*height).contains(&z) && inner < across && across < outer
            }
            Shape::Extrusion { axis, from, to, outline: corners, .. } => {
                let q = match axis {
                    0 => [point[1], point[2]],
                    1 => [point[0], point[2]],
                    _ => [point[0], point[1]],
                };
                from.min(*to) < point[*axis] && point[*axis] < from.max(*to) && outline::contains(corners, q)
            }
            Shape::Surface(surface) => winding::contains(surface, point),
            Shape::Physical(_) => false,
        }
    }
}

/// The smallest box that contains all points; `None` if there are none.
fn around(points: impl Iterator<Item = [f64; 3]>) -> Option<Box3> {
    points.map(|p| Box3 { min: p, max: p }).reduce(|all, p| all.union(&p))
}

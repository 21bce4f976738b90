//! A scene of bodies of any shape, in SI units: what the solver on tetrahedra takes.

use crate::scene::{Box3, BoxScene, Wall};

/// Where a body is. Lengths in metres; axis 0, 1, 2 is x1, x2, x3.
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
    /// Everything outside a ball: a closed conducting surface, with nothing solved beyond it. A conductor only.
    Shell {
        /// The middle of the hollow.
        center: [f64; 3],
        /// The radius of the hollow, positive.
        radius: f64,
    },
    /// A circular cylinder along a coordinate axis.
    Cylinder {
        /// Along which it stands.
        axis: usize,
        /// The middle of the end with the lower coordinate.
        base: [f64; 3],
        /// Its radius, positive.
        radius: f64,
        /// Its length along the axis, positive.
        height: f64,
    },
    /// A polygon pulled along a coordinate axis; a conductor may have `from == to`, a sheet.
    Extrusion {
        /// Along which it is pulled.
        axis: usize,
        /// Lower end along the axis.
        from: f64,
        /// Upper end along the axis.
        to: f64,
        /// Corners in the two other coordinates in ascending order of axis, one simple polygon, either way round.
        outline: Vec<[f64; 2]>,
    },
    /// What a closed surface of triangles encloses.
    Surface(TriangleSurface),
    /// The cells of a group of an imported volume mesh.
    Physical(String),
}

impl Shape {
    /// The smallest box that holds the body, infinite where the body is; that of the hollow for a [`Shape::Shell`]; `None` where
    /// only a mesh knows.
    pub fn bounds(&self) -> Option<Box3> {
        match self {
            Shape::Box(b) => Some(*b),
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                Some(Box3 { min: center.map(|x| x - radius), max: center.map(|x| x + radius) })
            }
            Shape::Cylinder { axis, base, radius, height } => {
                let mut b = Box3 { min: base.map(|x| x - radius), max: base.map(|x| x + radius) };
                b.min[*axis] = base[*axis];
                b.max[*axis] = base[*axis] + height;
                Some(b)
            }
            Shape::Extrusion { axis, from, to, outline } => {
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
}

fn around(points: impl Iterator<Item = [f64; 3]>) -> Option<Box3> {
    points.map(|p| Box3 { min: p, max: p }).reduce(|all, p| all.union(&p))
}

/// A closed surface of triangles, seen anticlockwise from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleSurface {
    /// m.
    pub points: Vec<[f64; 3]>,
    /// Indices into `points`.
    pub faces: Vec<[u32; 3]>,
}

/// A perfect conductor.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapedConductor {
    /// Unique within the scene.
    pub name: String,
    /// Where it is.
    pub shape: Shape,
    /// Its charge, C, if it floats: its potential is what it will be. `None` for a driven conductor.
    pub floating_charge: Option<f64>,
}

/// A linear isotropic dielectric; where two overlap, the later one wins.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapedDielectric {
    /// Name for exports and messages.
    pub name: String,
    /// Where it is.
    pub shape: Shape,
    /// eps_r, positive and finite.
    pub relative_permittivity: f64,
}

/// A scene of bodies of any shape.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeScene {
    /// Conductors, pairwise without a common point.
    pub conductors: Vec<ShapedConductor>,
    /// Dielectrics, in the order in which they override one another.
    pub dielectrics: Vec<ShapedDielectric>,
    /// eps_r wherever no dielectric is.
    pub background_permittivity: f64,
    /// Outer walls; a bound is infinite exactly where the wall is [`Wall::Open`]. Everywhere inside a [`Shape::Shell`].
    pub domain: Box3,
    /// `walls[axis][side]`, side 0 at `domain.min`, side 1 at `domain.max`.
    pub walls: [[Wall; 2]; 3],
}

impl From<&BoxScene> for ShapeScene {
    fn from(scene: &BoxScene) -> Self {
        let conductors = scene.conductors.iter().map(|c| ShapedConductor {
            name: c.name.clone(),
            shape: Shape::Box(c.region),
            floating_charge: c.floating_charge,
        });
        let dielectrics = scene.dielectrics.iter().map(|d| ShapedDielectric {
            name: d.name.clone(),
            shape: Shape::Box(d.region),
            relative_permittivity: d.relative_permittivity,
        });
        Self {
            conductors: conductors.collect(),
            dielectrics: dielectrics.collect(),
            background_permittivity: scene.background_permittivity,
            domain: scene.domain,
            walls: scene.walls,
        }
    }
}

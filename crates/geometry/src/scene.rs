//! The scene as the solvers see it: bodies, walls and what fills the rest, in SI units.
//!
//! There is one [`Scene`] for all solvers. Each of them says which shapes it takes: the box solver boxes and
//! sheets alone ([`Scene::is_boxes`]), the meshers any shape.

pub use crate::box3::Box3;
use crate::shapes::Shape;

/// The condition on the field on one outer side of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wall {
    /// No flux passes through the side.
    Insulated,
    /// The side is at potential zero.
    Grounded,
    /// There is no wall: the field decays to zero at infinity.
    Open,
}

/// How the potential of a conductor is determined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Potential {
    /// A source: the conductor may be given any potential, and has a row in the capacitance matrix.
    Driven,
    /// The conductor is at potential zero, as grounded walls are, and has no row in the matrix.
    Grounded,
    /// The conductor floats: its potential is an unknown, which the field and its charge determine.
    Floating {
        /// The charge that it carries, C.
        charge: f64,
    },
}

impl Potential {
    /// The potential of a conductor that floats with this charge, C, or, without a charge, is driven.
    pub fn of_charge(charge: Option<f64>) -> Self {
        charge.map_or(Self::Driven, |charge| Self::Floating { charge })
    }

    /// The charge, C, of a conductor that floats.
    pub fn floating_charge(self) -> Option<f64> {
        match self {
            Self::Floating { charge } => Some(charge),
            Self::Driven | Self::Grounded => None,
        }
    }
}

/// The electrical role of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// A perfect conductor, at one potential everywhere.
    Conductor {
        /// How that potential is determined.
        potential: Potential,
    },
    /// A linear isotropic dielectric.
    Dielectric {
        /// eps_r, positive and finite.
        relative_permittivity: f64,
    },
}

/// The part that a body plays in the device, which decides how it moves and how a viewer shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Purpose {
    /// An electrode in the layer, which moves with it.
    Electrode,
    /// A body in the layer that goes where its material goes.
    InLayer,
    /// The soft layer.
    Layer,
    /// The substrate, on which the layer lies.
    Substrate,
    /// The medium above the layer.
    Cover,
    /// A body that moves with the top of the layer.
    OnTop,
    /// The indenter, which presses on the layer.
    Indenter,
    /// A body that moves with the indenter.
    OnIndenter,
    /// A body that stays where it is; every body of a scene without a layer.
    Fixed,
}

/// A body of one or several parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Unique within the scene.
    pub name: String,
    /// The shapes whose union the body is. They may touch, overlap or lie apart; there is at least one.
    pub parts: Vec<Shape>,
    /// Its electrical role.
    pub role: Role,
    /// The part that it plays in the device.
    pub purpose: Purpose,
}

impl Body {
    /// A fixed, driven conductor of one part.
    pub fn conductor(name: impl Into<String>, shape: Shape) -> Self {
        let role = Role::Conductor { potential: Potential::Driven };
        Self { name: name.into(), parts: vec![shape], role, purpose: Purpose::Fixed }
    }

    /// A fixed conductor of one part at potential zero.
    pub fn grounded(name: impl Into<String>, shape: Shape) -> Self {
        let role = Role::Conductor { potential: Potential::Grounded };
        Self { role, ..Self::conductor(name, shape) }
    }

    /// A fixed, floating conductor of one part with this charge, C.
    pub fn floating(name: impl Into<String>, shape: Shape, charge: f64) -> Self {
        let role = Role::Conductor { potential: Potential::Floating { charge } };
        Self { role, ..Self::conductor(name, shape) }
    }

    /// A fixed dielectric of one part.
    pub fn dielectric(name: impl Into<String>, shape: Shape, relative_permittivity: f64) -> Self {
        Self { role: Role::Dielectric { relative_permittivity }, ..Self::conductor(name, shape) }
    }

    /// This body with another purpose.
    #[must_use]
    pub fn with_purpose(self, purpose: Purpose) -> Self {
        Self { purpose, ..self }
    }

    /// Whether it is a conductor, whatever its potential.
    pub fn is_conductor(&self) -> bool {
        match self.role {
            Role::Conductor { .. } => true,
            Role::Dielectric { .. } => false,
        }
    }

    /// Whether it is a conductor with a row in the capacitance matrix.
    pub fn is_driven(&self) -> bool {
        self.role == Role::Conductor { potential: Potential::Driven }
    }

    /// Whether it is a conductor that floats.
    pub fn floats(&self) -> bool {
        match self.role {
            Role::Conductor { potential } => potential.floating_charge().is_some(),
            Role::Dielectric { .. } => false,
        }
    }

    /// The boxes (and sheets) that it consists of; `None` if a part has another shape.
    pub fn boxes(&self) -> Option<Vec<Box3>> {
        self.parts.iter().map(Shape::as_box).collect()
    }

    /// The smallest box that holds it, infinite where the body is; `None` if a part is a group of a mesh.
    pub fn bounds(&self) -> Option<Box3> {
        let parts: Option<Vec<Box3>> = self.parts.iter().map(Shape::bounds).collect();
        parts?.into_iter().reduce(|all, part| all.union(&part))
    }

    /// Whether a part of it holds the point; see [`Shape::contains`].
    pub fn contains(&self, point: [f64; 3]) -> bool {
        self.parts.iter().any(|part| part.contains(point))
    }
}

/// A plane, normal to a coordinate axis, about which a scene is symmetric.
#[derive(Debug, Clone, PartialEq)]
pub struct MirrorPlane {
    /// The coordinate of the plane along the axis, m.
    pub at: f64,
    /// For each conductor of the scene the index of its mirror image: its own, if the plane cuts it in two.
    pub conductors: Vec<usize>,
    /// For each dielectric of the scene the index of its mirror image: its own, if the plane cuts it in two.
    pub dielectrics: Vec<usize>,
}

impl MirrorPlane {
    /// Whether every conductor is mapped to itself: potentials are then even about the plane, which has no
    /// flux through it.
    pub fn keeps_conductors(&self) -> bool {
        self.conductors.iter().enumerate().all(|(k, &image)| k == image)
    }
}

/// A conductor of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductor<'a> {
    /// Its place among the conductors, grounded and floating ones included.
    pub index: usize,
    /// The body.
    pub body: &'a Body,
    /// How its potential is determined.
    pub potential: Potential,
}

/// A dielectric of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric<'a> {
    /// Its place among the dielectrics.
    pub index: usize,
    /// The body.
    pub body: &'a Body,
    /// eps_r.
    pub relative_permittivity: f64,
}

/// What a point of the scene lies in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling<'a> {
    /// In no body.
    Background,
    /// In a conductor, whatever else is there.
    Conductor(Conductor<'a>),
    /// In a dielectric.
    Dielectric(Dielectric<'a>),
}

/// The two axes other than `axis`, ascending.
pub fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

/// A scene of bodies of any shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The bodies. Conductors stand in the order of the capacitance matrix and have pairwise no common point;
    /// dielectrics stand in the order in which they override one another: where several overlap, the last one
    /// counts. The order of a conductor and a dielectric does not matter: conductors override dielectrics.
    pub bodies: Vec<Body>,
    /// eps_r wherever no dielectric is.
    pub background_permittivity: f64,
    /// The box in which the scene ends; a bound is infinite exactly where the wall is [`Wall::Open`]. In a
    /// [`Shape::Shell`], which bounds the scene itself, it is the box around the hollow. It is infinite for a
    /// scene of [`Shape::Physical`] bodies, which ends where their mesh does.
    pub domain: Box3,
    /// The walls as `walls[axis][side]`, side 0 at `domain.min`, side 1 at `domain.max`.
    pub walls: [[Wall; 2]; 3],
}

/// How much around the conductors belongs to [`Scene::sensor`], as a share of their largest extent. It is not
/// tuned.
const AROUND: f64 = 0.5;

impl Scene {
    /// The box that field files show: the conductors, some space around them, and the whole height of the
    /// layer, if there is one. All of space where no bounds of conductors are known.
    pub fn sensor(&self) -> Box3 {
        let conductors = self.conductor_parts().filter_map(|(_, part)| part.bounds());
        let Some(conductors) = conductors.reduce(|all, part| all.union(&part)) else { return Box3::SPACE };
        let margin = AROUND * (0..3).map(|a| conductors.extent(a)).fold(0.0, f64::max);
        let mut shown =
            Box3 { min: conductors.min.map(|x| x - margin), max: conductors.max.map(|x| x + margin) };
        let layers = self.bodies.iter().filter(|body| body.purpose == Purpose::Layer);
        for layer in layers.filter_map(Body::bounds) {
            for end in [layer.min[1], layer.max[1]].into_iter().filter(|end| end.is_finite()) {
                (shown.min[1], shown.max[1]) = (shown.min[1].min(end), shown.max[1].max(end));
            }
        }
        shown
    }

    /// The conductors, driven, grounded and floating, in order.
    pub fn conductors(&self) -> impl Iterator<Item = Conductor<'_>> + Clone {
        let conductors = self.bodies.iter().filter_map(|body| match body.role {
            Role::Conductor { potential } => Some((body, potential)),
            Role::Dielectric { .. } => None,
        });
        conductors.enumerate().map(|(index, (body, potential))| Conductor { index, body, potential })
    }

    /// How the potential of each conductor is determined, in their order.
    pub fn potentials(&self) -> Vec<Potential> {
        self.conductors().map(|c| c.potential).collect()
    }

    /// The dielectrics, in the order in which they override one another.
    pub fn dielectrics(&self) -> impl Iterator<Item = Dielectric<'_>> + Clone {
        let dielectrics = self.bodies.iter().filter_map(|body| match body.role {
            Role::Conductor { .. } => None,
            Role::Dielectric { relative_permittivity } => Some((body, relative_permittivity)),
        });
        dielectrics.enumerate().map(|(index, (body, relative_permittivity))| Dielectric {
            index,
            body,
            relative_permittivity,
        })
    }

    /// The conductor with this index, to be changed.
    pub fn conductor_mut(&mut self, index: usize) -> Option<&mut Body> {
        self.bodies.iter_mut().filter(|body| body.is_conductor()).nth(index)
    }

    /// Shapes of all parts of conductors, each with the index of its conductor.
    pub fn conductor_parts(&self) -> impl Iterator<Item = (usize, &Shape)> + Clone {
        self.conductors().flat_map(|c| c.body.parts.iter().map(move |part| (c.index, part)))
    }

    /// The bounds of all parts of conductors that have any, each with the index of its conductor.
    pub fn conductor_bounds(&self) -> impl Iterator<Item = (usize, Box3)> + Clone {
        self.conductor_parts().filter_map(|(index, part)| Some((index, part.bounds()?)))
    }

    /// Shapes of all parts of dielectrics, each with the index of its dielectric.
    pub fn dielectric_parts(&self) -> impl Iterator<Item = (usize, &Shape)> + Clone {
        self.dielectrics().flat_map(|d| d.body.parts.iter().map(move |part| (d.index, part)))
    }

    /// Shapes of all parts, those of conductors first.
    pub fn shapes(&self) -> impl Iterator<Item = &Shape> + Clone {
        self.conductor_parts().chain(self.dielectric_parts()).map(|(_, part)| part)
    }

    /// Indices of the driven conductors, ascending: the rows of the capacitance matrix.
    pub fn driven(&self) -> impl Iterator<Item = usize> + Clone {
        self.conductors().filter(|c| c.potential == Potential::Driven).map(|c| c.index)
    }

    /// Indices of the floating conductors, ascending, each with its charge in C.
    pub fn floating(&self) -> impl Iterator<Item = (usize, f64)> + Clone {
        self.conductors().filter_map(|c| Some((c.index, c.potential.floating_charge()?)))
    }

    /// Whether all bodies consist of boxes and sheets, as the box solver takes them.
    pub fn is_boxes(&self) -> bool {
        self.shapes().all(|shape| shape.as_box().is_some())
    }

    /// eps_r of each region of a mesh: the background, then the dielectrics.
    pub fn permittivities(&self) -> Vec<f64> {
        let permittivities = self.dielectrics().map(|d| d.relative_permittivity);
        std::iter::once(self.background_permittivity).chain(permittivities).collect()
    }

    /// A lookup of the bodies that contain points.
    pub fn lookup(&self) -> Lookup<'_> {
        let background_permittivity = self.background_permittivity;
        Lookup {
            conductors: self.conductors().collect(),
            dielectrics: self.dielectrics().collect(),
            background_permittivity,
        }
    }
}

/// Finds the body of a scene that contains a point; see [`Scene::lookup`].
#[derive(Debug, Clone, PartialEq)]
pub struct Lookup<'a> {
    /// The conductors, in order.
    conductors: Vec<Conductor<'a>>,
    /// The dielectrics, in the order in which they override one another.
    dielectrics: Vec<Dielectric<'a>>,
    /// eps_r wherever no dielectric is.
    background_permittivity: f64,
}

impl<'a> Lookup<'a> {
    /// The body, if any, that contains a point. Sheets contain none.
    pub fn body_at(&self, point: [f64; 3]) -> Filling<'a> {
        match self.conductors.iter().find(|c| c.body.contains(point)) {
            Some(conductor) => Filling::Conductor(*conductor),
            None => self.dielectric_at(point).map_or(Filling::Background, Filling::Dielectric),
        }
    }

    /// The dielectric at a point, conductors put aside; `None` for the background.
    pub fn dielectric_at(&self, point: [f64; 3]) -> Option<Dielectric<'a>> {
        self.dielectrics.iter().rfind(|d| d.body.contains(point)).copied()
    }

    /// eps_r at a point, conductors put aside.
    pub fn permittivity_at(&self, point: [f64; 3]) -> f64 {
        self.dielectric_at(point).map_or(self.background_permittivity, |d| d.relative_permittivity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: f64, half: f64) -> Shape {
        Shape::Box(Box3 { min: [center - half; 3], max: [center + half; 3] })
    }

    fn scene(bodies: Vec<Body>) -> Scene {
        Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
    }

    #[test]
    fn conductors_and_dielectrics_are_counted_apart_however_they_are_mixed() {
        let scene = scene(vec![
            Body::dielectric("board", cube(0.0, 2.0), 4.0),
            Body::conductor("a", cube(-1.0, 0.1)),
            Body::floating("b", cube(1.0, 0.1), 1e-12),
            Body::dielectric("drop", cube(0.0, 0.5), 80.0),
            Body::grounded("ground", cube(-3.0, 0.1)),
            Body::conductor("c", cube(3.0, 0.1)),
        ]);
        let index_and_name = |c: Conductor<'_>| (c.index, c.body.name.clone());
        let named = |k: usize, name: &str| (k, name.to_owned());
        assert_eq!(
            scene.conductors().map(index_and_name).collect::<Vec<_>>(),
            [named(0, "a"), named(1, "b"), named(2, "ground"), named(3, "c")]
        );
        assert_eq!(scene.driven().collect::<Vec<_>>(), [0, 3]);
        assert_eq!(scene.floating().collect::<Vec<_>>(), [(1, 1e-12)]);
        assert_eq!(scene.permittivities(), [1.0, 4.0, 80.0]);
    }

    #[test]
    fn a_point_lies_in_a_conductor_before_the_last_dielectric_and_in_any_part_of_a_body() {
        let mut pair = Body::conductor("pair", cube(-1.0, 0.1));
        pair.parts.push(cube(1.0, 0.1));
        let sheet = Shape::Box(Box3 { min: [-0.4, 0.0, -0.4], max: [0.4, 0.0, 0.4] });
        let scene = scene(vec![
            pair,
            Body::conductor("sheet", sheet),
            Body::dielectric("board", cube(0.0, 2.0), 4.0),
            Body::dielectric("drop", cube(0.0, 0.5), 80.0),
        ]);
        let lookup = scene.lookup();
        let name = |point| match lookup.body_at(point) {
            Filling::Background => "none",
            Filling::Conductor(c) => c.body.name.as_str(),
            Filling::Dielectric(d) => d.body.name.as_str(),
        };
        let found = [[1.0; 3], [-1.0; 3], [1.5; 3], [0.0; 3], [2.5; 3]].map(name);
        assert_eq!(found, ["pair", "pair", "board", "drop", "none"]);
        assert_eq!(lookup.permittivity_at([1.0; 3]), 4.0);
    }
}

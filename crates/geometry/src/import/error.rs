//! What may be wrong with an imported file.

use std::fmt;

/// What is wrong with an imported file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct ImportError {
    /// The file, as the caller named it.
    pub file: String,
    /// What is wrong, where, and the cure.
    pub problem: Problem,
}

impl ImportError {
    pub(super) fn new(file: &str, problem: Problem) -> Self {
        Self { file: file.to_owned(), problem }
    }
}

/// Where in the scene, and where in the file if that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// m, in the scene: scaled and placed.
    pub at: [f64; 3],
    /// Line of the file, counted from 1.
    pub line: Option<usize>,
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.at;
        write!(out, "at ({x:.6e}, {y:.6e}, {z:.6e}) m")?;
        self.line.map_or(Ok(()), |line| write!(out, ", line {line}"))
    }
}

/// One finding; its text says where and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be read at all.
    #[error("cannot be read: {0}; check the path and the permissions")]
    Unreadable(String),
    /// The text or the bytes are not what the format asks for. `place` is a line or a byte.
    #[error("{place}: {what}; export the file again")]
    Malformed {
        /// "line 12" or "byte 345".
        place: String,
        /// What was met.
        what: String,
    },
    /// Well-formed, but not read here.
    #[error("{what} is not supported; {cure}")]
    Unsupported {
        /// The version, element or feature.
        what: String,
        /// What to do.
        cure: String,
    },
    /// Neither faces nor cells.
    #[error("holds no {0}; export the body itself, not only points, lines or references")]
    Empty(&'static str),
    /// More points or faces than 32-bit indices can count.
    #[error("holds more than {} points or faces; export a coarser version", u32::MAX)]
    TooLarge,
    /// The scale is not a positive finite number, or the translation not finite.
    #[error(
        "unit of {unit:e} m with a translation by {translate:?} m; the unit must be positive, both finite"
    )]
    Placement {
        /// m per unit of the file.
        unit: f64,
        /// m.
        translate: [f64; 3],
    },
    /// The size in metres is absurd: the unit is likely wrong.
    #[error(
        "is {size:e} m large with a unit of {unit:e} m; 1e-12 m to 1e6 m is allowed: set the unit it was drawn in"
    )]
    Size {
        /// Largest extent of its bounding box, m.
        size: f64,
        /// m per unit of the file.
        unit: f64,
    },
    /// So far from the origin that double precision cannot tell its points apart.
    #[error(
        "is {size:e} m large but {distance:e} m from the origin; move it closer, its points cannot be told apart there"
    )]
    FarAway {
        /// Largest extent of its bounding box, m.
        size: f64,
        /// Largest coordinate, m.
        distance: f64,
    },
    /// An edge with a single face.
    #[error(
        "not closed: an edge has only one face, {0}; {1} such edges in all. Fill the hole before exporting"
    )]
    NotClosed(Place, usize),
    /// An edge with more than two faces.
    #[error("{1} faces meet in one edge, {0}; separate the bodies or remove the inner faces")]
    NonManifoldEdge(Place, usize),
    /// Parts of the surface that meet in a single point only.
    #[error("two parts of the surface meet in a single point, {0}; separate or join them")]
    Pinched(Place),
    /// A component whose faces cannot be turned the same way.
    #[error(
        "the faces cannot be turned the same way, {0}: the surface has one side only; model it as a solid"
    )]
    OneSided(Place),
    /// A face without area whose corners are three different points.
    #[error("a face without area, {0}; collapse it before exporting")]
    DegenerateFace(Place),
    /// Two faces of one surface that cross, touch or cover one another.
    #[error("the surface meets itself: a face {0} and one {1}; unite the bodies or remove the overlap")]
    SelfIntersection(Place, Place),
    /// A closed part without a volume.
    #[error("a closed part encloses no volume, {0}; remove it or give it a thickness")]
    NoVolume(Place),
    /// A closed part inside another, turned the same way: a hollow or a second body?
    #[error(
        "a closed part lies inside another and is turned the same way, {0}; turn its faces inwards if it is a hollow, \
         remove it if it is not"
    )]
    Nested(Place),
    /// Two surfaces that cross or touch.
    #[error("crosses or touches the surface of {other}, {place}; move them apart")]
    Overlap {
        /// The other one's name.
        other: String,
        /// Where.
        place: Place,
    },
    /// One surface wholly inside another.
    #[error("lies inside {other}, {place}; move it out, or cut a hollow for it")]
    Inside {
        /// The one around it.
        other: String,
        /// A point of the inner one.
        place: Place,
    },
    /// A cell without a volume.
    #[error("a tetrahedron without volume, {0}; mesh again with better quality")]
    FlatTet(Place),
    /// A face with more than two tetrahedra.
    #[error("{count} tetrahedra share one face, {place}; an element is there twice, or two volumes overlap")]
    SharedFace {
        /// How many.
        count: usize,
        /// The face's middle.
        place: Place,
    },
    /// Faces that lie on one another without being the same.
    #[error(
        "the mesh does not conform: faces without a common neighbour meet {0} and {1}; mesh all volumes together \
         (in Gmsh: BooleanFragments, or Coherence)"
    )]
    NonConforming(Place, Place),
    /// A name that the file does not have.
    #[error("has no physical group \"{name}\" {wanted}; it has {known}")]
    UnknownGroup {
        /// The name asked for.
        name: String,
        /// "of volumes" or "of volumes or surfaces".
        wanted: &'static str,
        /// Those there are.
        known: String,
    },
    /// A surface group whose faces are not those of tetrahedra.
    #[error(
        "a face of \"{name}\" is not a face of any tetrahedron, {place}; mesh surface and volumes together"
    )]
    LooseFace {
        /// The group.
        name: String,
        /// The face's middle.
        place: Place,
    },
    /// Two conductors with a common point.
    #[error(
        "conductors \"{first}\" and \"{second}\" touch, {place}; leave a gap, or make them one conductor"
    )]
    Touching {
        /// The earlier one.
        first: String,
        /// The later one.
        second: String,
        /// A common point.
        place: Place,
    },
    /// A conductor with a point on a grounded wall.
    #[error("conductor \"{name}\" touches a grounded wall, {place}; leave a gap, or make the wall insulated")]
    TouchingWall {
        /// The conductor.
        name: String,
        /// A common point.
        place: Place,
    },
    /// A conductor at the end of the mesh, beside faces to open space.
    #[error(
        "conductor \"{name}\" ends the mesh, {place}, and the space beyond it is not meshed; mesh the space around it too \
         (Gmsh saves the volumes of physical groups only: name the air as well)"
    )]
    EndsAtOpenSpace {
        /// The conductor.
        name: String,
        /// The middle of a face of it.
        place: Place,
    },
    /// A shape of a scene that the mesh cannot give.
    #[error("{0}; with a mesh every conductor and dielectric is a physical group of it")]
    NotPhysical(String),
    /// An outer face that belongs to no side, or does not see the middle of the conductors.
    #[error("{what}, {place}; {cure}")]
    OuterFace {
        /// What is wrong.
        what: &'static str,
        /// The face's middle.
        place: Place,
        /// What to do.
        cure: &'static str,
    },
}

//! Errors of imported files.

use std::fmt;

/// The error of a refused file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct ImportError {
    /// The file, as the caller named it.
    pub file: String,
    /// The fault, its place, and what to do about it.
    pub problem: ImportProblem,
}

impl ImportError {
    /// The error of a fault of this file.
    pub(super) fn new(file: &str, problem: ImportProblem) -> Self {
        Self { file: file.to_owned(), problem }
    }
}

/// A place in the scene, and in the file where that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position in the scene, m, after scaling and translation.
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

/// A fault of a file; its message names the place and the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportProblem {
    /// The file cannot be read at all.
    #[error("cannot be read: {0}; check the path and the permissions")]
    Unreadable(String),
    /// A device, a pipe, a socket or a folder: reading it may never end.
    #[error("is not a regular file; name a file that ends by itself")]
    NotAFile,
    /// A file of another kind, by its name.
    #[error("{kind} is not read here; {cure}")]
    OtherKind {
        /// The name of the kind.
        kind: &'static str,
        /// The remedy.
        cure: &'static str,
    },
    /// A line that is invalid in an OBJ file, before any point. The message does not quote it, since the file
    /// may be anything.
    #[error(
        "line {line} is none of an OBJ file, and no point stands above it: this seems to be no OBJ file; export the surface of the body as OBJ"
    )]
    NoObj {
        /// The first invalid line, counted from 1.
        line: usize,
    },
    /// A file larger than the limit.
    #[error("is larger than {} MiB; export a coarser version", super::LARGEST_FILE >> 20)]
    LargeFile,
    /// The text or the bytes break the rules of the format.
    #[error("{place}: {what}; export the file again")]
    Malformed {
        /// "line 12" or "byte 345".
        place: String,
        /// The fault at that place.
        what: String,
    },
    /// A well-formed file with a feature that this program does not read.
    #[error("{what} is not supported; {cure}")]
    Unsupported {
        /// The version, element or feature.
        what: String,
        /// The remedy.
        cure: String,
    },
    /// A file without faces, or without cells.
    #[error("holds no {0}; export the body itself, not only points, lines or references")]
    Empty(&'static str),
    /// More points or faces than 32 bits can count.
    #[error("holds more than {} points or faces; export a coarser version", u32::MAX)]
    TooLarge,
    /// The scale is not a positive finite number, or the translation not finite.
    #[error(
        "has a unit of {unit:e} m and a translation by {translate:?} m; both must be finite, and the unit positive"
    )]
    Placement {
        /// Metres per unit of the file.
        unit: f64,
        /// Translation along x1, x2, x3, m.
        translate: [f64; 3],
    },
    /// An absurd size in metres: most likely the unit is wrong.
    #[error(
        "is {size:e} m large with a unit of {unit:e} m, but only 1e-12 m to 1e6 m is allowed; set the unit in which it was \
         drawn"
    )]
    Size {
        /// Largest extent of its bounding box, m.
        size: f64,
        /// Metres per unit of the file.
        unit: f64,
    },
    /// So far from the origin that double precision cannot tell its points apart.
    #[error(
        "is {size:e} m large but {distance:e} m from the origin, where its points cannot be told apart; move it closer"
    )]
    FarAway {
        /// Largest extent of its bounding box, m.
        size: f64,
        /// Largest coordinate, m.
        distance: f64,
    },
    /// An edge with a single face.
    #[error(
        "not closed: an edge has only one face, {0}; there are {1} such edges. Fill the hole before exporting"
    )]
    NotClosed(Place, usize),
    /// An edge with more than two faces.
    #[error("{1} faces meet in one edge, {0}; separate the bodies or remove the inner faces")]
    NonManifoldEdge(Place, usize),
    /// Two parts of the surface that share a single point only.
    #[error("two parts of the surface meet in a single point, {0}; separate or join them")]
    Pinched(Place),
    /// A closed part whose faces cannot all be turned the same way, such as a Klein bottle.
    #[error(
        "the surface has only one side, {0}: its faces cannot all be turned the same way; model it as a solid"
    )]
    OneSided(Place),
    /// A face without area whose corners are three different points.
    #[error("a face without area, {0}; collapse it before exporting")]
    DegenerateFace(Place),
    /// Two faces of one surface that cross, touch or overlap.
    #[error("the surface meets itself: a face {0} and a face {1}; unite the bodies or remove the overlap")]
    SelfIntersection(Place, Place),
    /// A closed part that encloses no volume.
    #[error("a closed part encloses no volume, {0}; remove it or give it a thickness")]
    NoVolume(Place),
    /// A closed part inside another, turned the same way, so that it is unclear whether it is a hollow or a
    /// second body.
    #[error(
        "a closed part lies inside another and is turned the same way, {0}; turn its faces inwards if it is a hollow, \
         remove it if it is not"
    )]
    Nested(Place),
    /// Two surfaces that cross or touch.
    #[error("crosses or touches the surface of {other}, {place}; move them apart")]
    Overlap {
        /// Name of the other surface.
        other: String,
        /// Approximate common point: the middle of a face that meets the other surface.
        place: Place,
    },
    /// One surface wholly inside another.
    #[error("lies inside {other}, {place}; move it out, or cut a hollow for it")]
    Inside {
        /// Name of the surface around it.
        other: String,
        /// A point of the inner surface.
        place: Place,
    },
    /// A cell without a volume.
    #[error("a tetrahedron without volume, {0}; mesh again with better quality")]
    FlatTet(Place),
    /// A face that more than two tetrahedra share, or two on the same side.
    #[error("{count} tetrahedra share one face, {place}; an element is listed twice, or two volumes overlap")]
    SharedFace {
        /// The number of tetrahedra.
        count: usize,
        /// The face's middle.
        place: Place,
    },
    /// Faces that lie on one another without having the same corners.
    #[error(
        "the mesh does not conform: faces without a common neighbour meet {0} and {1}; mesh all volumes together \
         (in Gmsh: BooleanFragments, or Coherence)"
    )]
    NonConforming(Place, Place),
    /// The scene names a group that the file does not have.
    #[error("has no physical group \"{name}\" {wanted}; it has {known}")]
    UnknownGroup {
        /// The name asked for.
        name: String,
        /// "of volumes" or "of volumes or surfaces".
        wanted: &'static str,
        /// The groups that the file has.
        known: String,
    },
    /// A group of surfaces with a face that no tetrahedron has.
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
        /// The conductor that the scene lists first.
        first: String,
        /// The other conductor.
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
    /// A conductor on the outer surface of the mesh, next to faces that border open space.
    #[error(
        "conductor \"{name}\" ends the mesh, {place}, and the space beyond it is not meshed; mesh the space around it too \
         (Gmsh saves the volumes of physical groups only: name the air as well)"
    )]
    EndsAtOpenSpace {
        /// The conductor.
        name: String,
        /// The middle of one of its faces.
        place: Place,
    },
    /// A body of the scene that is given as a shape instead of a physical group of the mesh.
    #[error("{0}; with a mesh every conductor and dielectric is a physical group of it")]
    NotPhysical(String),
    /// An outer face that lies in no side of the mesh's bounding box, or that does not face away from the
    /// middle of the conductors.
    #[error("{what}, {place}; {cure}")]
    OuterFace {
        /// The fault.
        what: &'static str,
        /// The face's middle.
        place: Place,
        /// The remedy.
        cure: &'static str,
    },
}

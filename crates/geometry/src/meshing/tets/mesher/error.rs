//! Errors of the mesher.

/// The reason why a scene cannot be meshed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A body that cannot be meshed.
    #[error("{body} has {what}; it cannot be meshed")]
    Unsupported {
        /// The name of the body.
        body: String,
        /// The property of the body that the mesher cannot handle.
        what: &'static str,
    },
    /// A body is so small that rounding takes its corners for one point.
    #[error("{body} is less than a billionth of the scene in size; it cannot be meshed in double precision")]
    TooSmall {
        /// The name of the body.
        body: String,
    },
    /// There are too many bodies for one mesh.
    #[error("too many bodies, or too many of them that meet, for one mesh; leave some out")]
    TooMany,
    /// Two conductors, or a conductor and a grounded wall, have a point in common.
    #[error("the surfaces of {first} and {second} touch or cross at ({}, {}, {}) m; keep them apart", at[0], at[1], at[2])]
    Crossing {
        /// One body.
        first: String,
        /// The other one.
        second: String,
        /// A point of both, m.
        at: [f64; 3],
    },
    /// The flat faces that replace the curved surfaces of two bodies cross over large parts of them.
    #[error(
        "{first} and {second} are so close that the flat faces of their meshes cross; make their surfaces coincide, or make \
         the layer between them thicker"
    )]
    Near {
        /// One body.
        first: String,
        /// The other one.
        second: String,
    },
    /// The search for intersections of surfaces came to no end.
    #[error("too many surfaces cross at ({}, {}, {}) m; move one of the bodies there a little", at[0], at[1], at[2])]
    Tangled {
        /// The place, m.
        at: [f64; 3],
    },
    /// A surface could not be built from faces of tetrahedra.
    #[error("{points} points do not suffice to build the surfaces at ({}, {}, {}) m from faces of tetrahedra; look for surfaces that touch or cross there, or allow more points", at[0], at[1], at[2])]
    Unreachable {
        /// The place, m.
        at: [f64; 3],
        /// The number of points when the mesher gave up.
        points: usize,
    },
    /// A tetrahedron without volume remains.
    #[error("a tetrahedron at ({}, {}, {}) m has no volume; another element size may help", at[0], at[1], at[2])]
    Flat {
        /// The place, m.
        at: [f64; 3],
    },
    /// Two regions are not separated by faces: a defect of the mesher, found before anything is computed with
    /// the mesh.
    #[error("a surface of the mesh has a gap near ({}, {}, {}) m, which is a defect of elastocap; slightly finer or coarser elements may help", at[0], at[1], at[2])]
    Leak {
        /// The place, m.
        at: [f64; 3],
    },
    /// The mesh ends where there is no wall: a defect of the mesher, found before anything is computed with
    /// the mesh.
    #[error("the mesh ends inside the walls at ({}, {}, {}) m, which is a defect of elastocap; slightly finer or coarser elements may help", at[0], at[1], at[2])]
    Torn {
        /// The place, m.
        at: [f64; 3],
    },
    /// Walls on both sides of one axis and open space along another: rays to infinity would hit the walls.
    #[error(
        "open space between two opposite walls cannot be meshed; make one of the two walls open, or all sides walls"
    )]
    OpenBetweenWalls,
    /// The caller cancelled the mesher.
    #[error("the mesher was asked to stop")]
    Cancelled,
    /// Nothing in the scene has an extent.
    #[error("the scene has no body and no walls; add one")]
    Empty,
}

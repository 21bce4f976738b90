//! Triangulations of patterns in the plane: small triangles at outlines, larger ones with the distance from
//! them.

pub mod graded;
mod outlines;
mod triangulation;

pub(crate) use outlines::area;
pub(super) use outlines::{Outline, OutlineFault, cleaned, contains, join_coincident_corners, perimeter};
pub(crate) use triangulation::constrained_triangles;
pub(crate) use triangulation::fill_polygon;
pub(super) use triangulation::{PlaneMesh, triangulate};

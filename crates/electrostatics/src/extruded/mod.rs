//! The solver for extruded scenes: outlines pulled along one axis.
//!
//! The plan is divided into triangles that shrink geometrically towards corners and edges, the axis like one
//! of the box solver; both carry polynomials of high degree. Upper bound, lower bound, Schwarz method, open
//! space and Maxwell matrix are those of the box solver (ARCHITECTURE.md, "The method") with two of the three
//! axes replaced by a mesh: the regions without conductors are parts of the plan times parts of the axis, and
//! each is inverted by the modes of the axis and one sparse factor of the plan per mode.

mod columns;
mod confined;
mod dual;
mod family;
mod fluxes;
mod free_regions;
mod inner_unknowns;
mod layout;
mod local;
mod marks;
mod mesh;
mod one_mesh;
mod plane_system;
mod primal;
mod rays;
mod region;
pub(crate) mod search;
mod shown;
mod size;
pub(crate) mod solve;

//! A conforming mesh of tetrahedra for a scene of bodies of any shape.
//!
//! # Method
//!
//! 1. Every body becomes flat facets ([`scene_surfaces`]): boxes and imported triangles as they are, curved
//!    bodies as polygons and triangles that enclose the same area or volume.
//! 2. Where surfaces meet, all of them get the same points and segments ([`surface_intersections`]), and
//!    faces with the same filling on both sides are removed ([`hidden_faces`]). This leaves a piecewise
//!    linear complex ([`piecewise_linear_complex`]).
//! 3. A Delaunay triangulation ([`delaunay`]) of its points gets more points until every segment consists of
//!    edges ([`boundary_recovery`]). Then tetrahedra that facets pierce are exchanged for others until every
//!    facet consists of faces ([`facet_recovery`]). From then on these edges and faces are kept.
//! 4. Delaunay refinement (Ruppert, J. Algorithms 18, 1995; Shewchuk, Proc. 14th Symp. Comput. Geom., 1998)
//!    adds points until tetrahedra are small and round enough ([`refinement`]), and points move to make the
//!    flattest of them rounder ([`smoothing`]). Flat tetrahedra that are left are exchanged for others or get
//!    points ([`flat_tets`]).
//!
//! # Why not a library
//!
//! Capacitances with proved bounds need a mesh whose faces lie exactly on the surfaces of many bodies that
//! touch, contain or cross one another. TetGen makes such meshes but is licensed under the AGPL. fTetWild
//! (MPL) lets surfaces move within an envelope. No Rust crate meshes several bodies with conforming faces;
//! `spade`, used elsewhere here, works in the plane.

mod body_surfaces;
mod boundary_recovery;
mod box_surfaces;
mod capsule;
mod delaunay;
mod error;
mod facet_exchange;
mod facet_recovery;
mod faceting;
mod flat_clusters;
mod flat_tets;
mod flips;
mod hidden_faces;
mod piecewise_linear_complex;
mod quality;
mod refinement;
mod region;
mod regions;
mod result_mesh;
mod scene_surfaces;
mod smoothing;
mod surface_intersections;
mod thin_edges;
mod thin_gaps;

use super::TetMesh;
use crate::scene::{Scene, Wall};
pub(crate) use body_surfaces::flat_parts;
use boundary_recovery::MeshInProgress;
pub use error::MeshError;
use hidden_faces::remove_hidden_faces;
pub use quality::Quality;
use regions::{Filling, assign_regions, check_regions};
pub(crate) use scene_surfaces::bounds;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use thin_edges::{points_along, thin_edges};

/// A point, or the difference between two points, m.
type Point = [f64; 3];

/// The least roundness of tetrahedra that a new point on a surface may make: points of one plane, rounded,
/// may span tetrahedra without volume.
///
/// There is no such limit where thin metal gets fine edges: a side that is split around a flat tetrahedron
/// gets triangles so obtuse that the lower bound does not converge. Should a tetrahedron without volume
/// remain there, it ends the mesh. It is not tuned.
const LEAST_ROUNDNESS: f64 = 1e-9;

/// The requirements on the size and shape of the elements of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizing {
    /// Element size at a body, relative to the radius of a round one and to the largest extent of any other.
    pub facet: f64,
    /// Length of edges along conductors that are less than a twentieth as thick as they are wide, relative to
    /// their width. It is no less than half their thickness. Infinite if thin conductors are meshed as any
    /// other.
    pub thin_edge: f64,
    /// Growth of the element size per distance from the bodies, below 1.
    pub growth: f64,
    /// Circumradius of a tetrahedron, relative to its shortest edge, above which it is refined. Refinement is
    /// sure to end by itself only from 2 on.
    pub radius_to_edge: f64,
    /// Size of the mesh in open space, relative to the largest extent of the scene.
    pub far: f64,
    /// Limit on the number of points.
    pub max_points: usize,
    /// Limit on the number of attempts to insert a point. Exchanges of tetrahedra for the recovery of a
    /// surface count as well, in proportion to their time. Beyond the limit the mesher stops as if cancelled,
    /// so that the result does not depend on the speed of the machine.
    pub most_insertions: usize,
}

impl Default for Sizing {
    fn default() -> Self {
        Self {
            facet: 0.3,
            thin_edge: f64::INFINITY,
            growth: 0.5,
            radius_to_edge: 2.0,
            far: 20.0,
            max_points: 500_000,
            most_insertions: usize::MAX,
        }
    }
}

impl Sizing {
    /// The approximate number of points of a mesh of the scene along the edges of thin conductors, see
    /// [`Sizing::thin_edge`]; `None` if the scene has no thin conductors.
    pub fn points_along_thin_edges(&self, scene: &Scene) -> Option<f64> {
        points_along(&thin_edges(scene, self), &scene.domain)
    }
}

/// A mesh and its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Meshed {
    /// The mesh.
    pub mesh: TetMesh,
    /// The shapes of the worst tetrahedra.
    pub quality: Quality,
    /// Whether element sizes and shapes meet the requirements; `false` if the limit on points came first. The
    /// mesh conforms either way.
    pub refined: bool,
}

/// Meshes the space around the conductors.
///
/// Spheres become geodesic polyhedra of the volume of the ball, cylinders prisms of the area of the circle;
/// their corners lie outside the curved surface by O(`facet`^2) of the radius. Boxes, extrusions and
/// triangles are exact. Where a side is open, the mesh ends far outside. All walls but grounded ones may cut
/// through conductors. Where bodies overlap, conductors take precedence over dielectrics, and later
/// dielectrics over earlier ones.
///
/// # Errors
///
/// [`MeshError`]: conductors that meet each other or a grounded wall, round bodies whose surfaces almost
/// coincide, open space between opposite walls, and surfaces that cannot be built from faces within the limit
/// on points.
pub fn mesh(scene: &Scene, sizing: &Sizing) -> Result<Meshed, MeshError> {
    mesh_unless(scene, sizing, None)
}

/// Meshes the space around the conductors as [`mesh()`] does, unless the caller cancels it by setting
/// `cancel`.
///
/// # Errors
///
/// As [`mesh()`], and [`MeshError::Cancelled`], also beyond [`Sizing::most_insertions`].
pub fn mesh_unless(
    scene: &Scene,
    sizing: &Sizing,
    cancel: Option<&Arc<AtomicBool>>,
) -> Result<Meshed, MeshError> {
    let open = |a: usize| scene.walls[a].map(|w| w == Wall::Open);
    if (0..3).any(|a| open(a) == [false; 2]) && (0..3).any(|a| open(a) != [false; 2]) {
        return Err(MeshError::OpenBetweenWalls);
    }
    let domain = scene_surfaces::domain(scene, sizing)?;
    let filling = Filling::new(scene, sizing);
    let mut complex = scene_surfaces::complex(scene, &domain, sizing)?;
    if complex.surfaces_cross {
        remove_hidden_faces(&mut complex, &domain, |p| filling.at(p));
    }
    let thin = thin_edges(scene, sizing);
    complex.divide_edges(&thin);
    let most = sizing.most_insertions;
    let mut work = MeshInProgress::new(complex, domain.min, domain.max, cancel.cloned(), most)?;
    work.recover_boundaries(sizing)?;
    assign_regions(&mut work.mesh, &filling)?;
    if thin.is_empty() {
        work.least_roundness = LEAST_ROUNDNESS;
    }
    let refined = work.refine(sizing);
    work.smooth();
    let flat = work.remove_flat_tets(sizing);
    work.go_on()?;
    flat.map_err(|at| MeshError::Flat { at })?;
    check_regions(&work.mesh)?;
    let mesh = result_mesh::extract(&work, scene, &domain)?;
    Ok(Meshed { quality: Quality::of(&mesh), mesh, refined })
}

#[cfg(test)]
mod tests;

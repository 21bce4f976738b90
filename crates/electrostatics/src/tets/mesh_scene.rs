//! A mesh that stands for a scene, and the solution on it.

use crate::error::SolveError;
use crate::solution::Solution;
use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_geometry::scene::{MirrorPlane, Potential};

/// The scene that a mesh stands for: its permittivities, the potentials of its conductors and its symmetry.
#[derive(Debug, Clone, Copy)]
pub struct MeshScene<'a> {
    /// Relative permittivity of each region of the mesh: the background, then the dielectrics.
    pub permittivity: &'a [f64],
    /// How the potential of each conductor of the whole scene is determined.
    pub potentials: &'a [Potential],
    /// For each axis the mirror plane of the scene, if the mesh is the half above it. The results are
    /// those of the whole scene, by whose conductors the faces of the mesh are numbered.
    pub planes: &'a [Option<MirrorPlane>; 3],
}

impl MeshScene<'_> {
    /// How many copies of the mesh make the whole scene.
    pub(super) fn copies(&self) -> u32 {
        1 << self.planes.iter().flatten().count()
    }

    /// Checks that every mirror plane has an image for each conductor.
    ///
    /// # Errors
    /// [`SolveError::MirrorPlane`] if a plane does not have an image among the conductors for each of them.
    pub(super) fn check(&self) -> Result<(), SolveError> {
        let conductors = self.potentials.len();
        for (axis, plane) in self.planes.iter().enumerate() {
            if let Some(plane) = plane
                && (plane.conductors.len() != conductors || plane.conductors.iter().any(|c| *c >= conductors))
            {
                return Err(SolveError::MirrorPlane { axis, conductors });
            }
        }
        Ok(())
    }

    /// Axes along which the mesh is one half of the scene.
    pub(super) fn mirrored(&self) -> [bool; 3] {
        self.planes.each_ref().map(Option::is_some)
    }
}

/// The result of [`solve_mesh`](crate::solve_mesh): the last mesh, the potentials on it and the capacitances.
#[derive(Debug, Clone)]
pub struct MeshSolution {
    /// The mesh as refined.
    pub mesh: TetMesh,
    /// For each conductor of the whole scene, the potential with 1 V on it and 0 V on all others: V, at the
    /// points of the mesh.
    pub potentials: Vec<Vec<f64>>,
    /// The capacitances. Their bounds are proved for the bodies as the mesh has them, with flat faces.
    pub solution: Solution,
}

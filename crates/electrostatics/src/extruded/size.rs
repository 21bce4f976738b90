//! The number of unknowns of the problems on a mesh, and the memory that they take.

use super::mesh::PlanMesh;
use super::one_mesh::BATCH_SIZE;
use crate::boxes::domain::Axis;

/// The size of the problems on a mesh.
pub(super) struct Size {
    /// The unknowns of both problems together.
    pub unknowns: usize,
    /// Entries of the factors of one mode of the whole plan, both problems.
    entries: f64,
    /// Number of functions of the line, which is that of the modes.
    modes: usize,
}

impl Size {
    /// The size of the problems of a degree on a mesh.
    pub(super) fn of(mesh: &PlanMesh, axis: &Axis, degree: usize) -> Self {
        let (points, edges, triangles) = (mesh.points.len(), mesh.edges.len(), mesh.triangles.len());
        let modes = axis.functions().len();
        let inner = (degree - 1) * degree.saturating_sub(2) / 2;
        let upper = points + edges * (degree - 1) + triangles * inner;
        let lower = edges * degree + triangles * degree * (degree + 1) / 2;
        // Nested dissection of a plane mesh: the entries per unknown grow with the logarithm of its size.
        let skeleton = (edges * degree) as f64;
        let entries = 2.0 * skeleton * degree as f64 * (2.0 + 1.5 * (edges.max(2) as f64).log2());
        Self { unknowns: (upper + lower) * modes, entries, modes }
    }

    /// Peak memory in bytes for a number of right-hand sides.
    pub(super) fn memory(&self, right_hand_sides: usize) -> u64 {
        // Vectors of the iterations, then factors in single precision for some regions and in double
        // precision for the repair.
        let batch = right_hand_sides.clamp(1, BATCH_SIZE);
        let vectors = (30 + 24 * right_hand_sides + 70 * batch) * self.unknowns;
        let factors = self.entries * (self.modes + 8) as f64 * (4.0 * 2.0 + 8.0);
        vectors as u64 + factors as u64 + (16 << 20)
    }
}

//! Surfaces of triangles.

/// A closed surface of triangles, seen anticlockwise from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleSurface {
    /// Positions, m.
    pub points: Vec<[f64; 3]>,
    /// Indices into `points`.
    pub faces: Vec<[u32; 3]>,
}

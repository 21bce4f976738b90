//! Triangles of a file before the audit.

/// The triangles of a file before the audit: indices are valid and coordinates finite, nothing else is
/// guaranteed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Triangles {
    /// All points, in the order and the units of the file.
    pub points: Vec<[f64; 3]>,
    /// Corners of each triangle, indices into `points`.
    pub faces: Vec<[u32; 3]>,
    /// Line of the file that each triangle comes from, counted from 1.
    pub lines: Vec<u32>,
}

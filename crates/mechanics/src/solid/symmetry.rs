//! The part of a layer that has to be meshed, by its planes of symmetry.

/// Which part of the layer the mesh covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Symmetry {
    /// The whole layer.
    None,
    /// One side of `x1 = 0`.
    Half,
    /// One side of `x1 = 0` and of `x3 = 0`.
    Quarter,
}

impl Symmetry {
    /// The number of equal parts of the layer, one of which is meshed.
    pub(super) fn parts(self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Half => 2.0,
            Self::Quarter => 4.0,
        }
    }
}

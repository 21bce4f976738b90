//! The symmetry of a layer.

/// Which part of the layer the mesh covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Symmetry {
    /// All of it.
    None,
    /// One side of `x1 = 0`.
    Half,
    /// One side of `x1 = 0` and of `x3 = 0`.
    Quarter,
}

impl Symmetry {
    /// How many such parts the layer has.
    pub(super) fn parts(self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Half => 2.0,
            Self::Quarter => 4.0,
        }
    }
}

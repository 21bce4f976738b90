//! The reasons why fields cannot be written for VTK.

/// The reason why a field cannot be written as VTK.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VtkError {
    /// Fewer than two coordinates on an axis, or coordinates that do not increase.
    #[error("the grid's coordinates along x{} do not increase, or are fewer than two", axis + 1)]
    Axis {
        /// 0, 1, 2 for x1, x2, x3.
        axis: usize,
    },
    /// An array does not fit the grid.
    #[error("the grid has {expected} values of `{array}`, but {found} were given")]
    Length {
        /// Name in the file.
        array: &'static str,
        /// Nodes or cells of the grid.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value is infinite, not a number, or beyond single precision where that is what is written.
    #[error("value {index} of `{array}` is not a finite number")]
    NotFinite {
        /// Name in the file.
        array: &'static str,
        /// Position in the array.
        index: usize,
    },
    /// More nodes, or corners of cells, than 31 bits can count.
    #[error("a grid of {cells} cells is too large for one .vtu file; write a coarser one")]
    TooLarge {
        /// Cells of the grid.
        cells: usize,
    },
    /// A file of a series has an absolute path, which would break where the folder is moved.
    #[error("`{file}` must be named relative to the .pvd file")]
    AbsolutePath {
        /// The name.
        file: String,
    },
    /// `vtkio` refused the grid; not expected.
    #[error("the VTK writer failed: {0}")]
    Writer(String),
}

//! Errors of the glTF writer.

/// The reason why a scene cannot be written as glTF.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GltfError {
    /// There is nothing to show.
    #[error("a scene file needs at least one body and one load step")]
    Empty,
    /// A body does not have one pose for each load step.
    #[error("body `{body}` has {found} poses, but there are {expected} load steps")]
    PoseCount {
        /// Name of the body.
        body: String,
        /// Number of its poses.
        found: usize,
        /// Number of load steps.
        expected: usize,
    },
    /// A bound is infinite or not a number.
    #[error("body `{body}` has no finite box at load step {step}; cut it off at the scene's walls first")]
    NotFinite {
        /// Name of the body.
        body: String,
        /// Number of the load step, counted from 0.
        step: usize,
    },
    /// Upper bound below the lower one, or no extent along two axes.
    #[error("body `{body}` is neither a box nor a sheet at load step {step}")]
    NotABody {
        /// Name of the body.
        body: String,
        /// Number of the load step, counted from 0.
        step: usize,
    },
    /// A scene too large or too small for 32-bit positions.
    #[error("the scene is {extent:e} m large; a scene file holds 1e-30 m to 1e30 m")]
    OutOfRange {
        /// Largest extent, m.
        extent: f64,
    },
    /// More than the 4 GB that the format can address.
    #[error("the scene is too large for a binary glTF file")]
    TooLarge,
    /// The writer refused; not expected.
    #[error("the glTF writer failed: {0}")]
    Writer(String),
}

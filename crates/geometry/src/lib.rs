//! Geometry of scenes: shapes of bodies, outlines, symmetries of a scene, recognition of boxes and prisms,
//! meshes, and the import and export of files of other programs.

mod box3;
pub mod contact;
pub mod cubic;
pub mod drawing;
pub mod export;
pub mod import;
mod intersect;
pub mod meshing;
pub mod mirror;
pub mod outline;
pub mod perforated;
pub mod recognition;
#[cfg(test)]
mod samples;
pub mod scene;
pub mod section;
pub mod segments;
pub mod shapes;
mod triangle_surface;
pub mod turn;
pub mod winding;

//! Bodies, outlines drawn side by side and with holes, and the scene that they make up, its mirror planes and turns that give it more of them, boxes recognised in it, meshes of it, and the files that other programs read and write.

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

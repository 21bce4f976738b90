//! Layers in plane strain, of which a section is solved, and punches with sharp corners, which only these can have.
//!
//! The equations, the contact and Newton's method are written once for the plane and for space; see [`super::dimension`].
//!
//! | module | what is in it |
//! |---|---|
//! | [`press`] | a layer pressed to given loads on finer and finer meshes |
//! | `meshes` | the meshes of a layer at a level of refinement |
//! | `around_corner` | how short elements have to be at a rounded corner |
//! | `contact_end` | which point of the surface lies at the corner of a sharp punch |

mod around_corner;
mod contact_end;
mod meshes;
pub mod press;

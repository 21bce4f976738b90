//! Layers in plane strain, of which a section is solved.
//!
//! The equations, the contact and Newton's method are written once for the plane and for space; see [`super::dimension`].
//!
//! | module | what is in it |
//! |---|---|
//! | [`press`] | a layer pressed to given loads on finer and finer meshes |
//! | `around_corner` | how short elements have to be at a rounded corner |

mod around_corner;
pub mod press;

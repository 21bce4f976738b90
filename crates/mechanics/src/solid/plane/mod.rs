//! Layers in plane strain: a section of the layer is modelled.
//!
//! The equations, the contact and Newton's method are written once for the plane and for space; see
//! [`super::dimension`].
//!
//! | module | contents |
//! |---|---|
//! | [`press`] | a layer pressed to given loads on finer and finer meshes |
//! | `around_corner` | the size of elements at a rounded corner |

mod around_corner;
pub mod press;

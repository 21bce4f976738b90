//! Finite elements in plane strain: large deformations of nearly or exactly incompressible rubber, with contact.
//!
//! | module | what is in it |
//! |---|---|
//! | [`material`] | energies as functions of `F:F` and `det F`, with exact stress and tangent |
//! | [`element`] | biquadratic displacement, discontinuous linear pressure, condensed |
//! | [`mesh`] | mapped patches, fans around corners, the order of elimination |
//! | [`obstacle`] | rigid bodies by their distance |
//! | [`sparse`] | a symmetric matrix with one symbolic factorisation |
//! | [`model`] | a body, its equations and contact conditions |
//! | [`newton`] | Newton's method with load steps |
//! | [`layer`] | the layer of the paper under an indenter |
//!
//! # Corners that open
//! Where the bonded bottom meets the free face, and where a sharp punch ends, a right or straight angle opens by 90 degrees
//! and more. One quadrilateral in such a corner has to turn inside out; that is where other implicit codes stop. A
//! *fan* of sectors around the corner shares the angle, and the layer goes to 40 % on 300 elements.
//!
//! # Current limitations
//! - Contact acts at nodes and without friction. The corner radius of a punch, a twentieth of an element here, makes
//!   the set of touching nodes go back and forth: the rounded punch does not converge yet.
//! - The free end without contact has no stable equilibrium at the smallest scale, where the folding face is
//!   compressed beyond what a surface bears: meshes that resolve it stop, coarser ones go on.

pub mod element;
pub mod layer;
pub mod material;
pub mod mesh;
pub mod model;
pub mod newton;
pub mod obstacle;
pub mod sparse;

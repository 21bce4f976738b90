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
//! | [`stress`] | Cauchy stress at points, at nodes, along lines |
//! | [`shear_length`] | the length `L` that the closed form leaves open, from finite elements |
//! | [`layer`] | the layer of the paper under an indenter |
//!
//! # Corners that open
//! Where the bonded bottom meets the free face, and where a sharp punch ends, a right or straight angle opens by 90 degrees
//! and more. One quadrilateral in such a corner has to turn inside out; that is where other implicit codes stop. A
//! *fan* of sectors around the corner shares the angle, and the layer goes to 40 % on 300 elements.
//!
//! # Current limitations
//! - Contact acts at nodes and without friction. Under a punch with rounded corners the set of touching nodes goes back
//!   and forth, and the load steps become tiny: do not use [`layer::Indenter::Smooth`] yet.
//! - The flank of a sharp punch carries nothing, so that the surface beside it may fold into the punch; the solver stops
//!   there between 5 and 20 % compression, the earlier the finer the fan.
//! - The free end without contact folds so sharply at the bonded corner that the surface buckles at the smallest scale:
//!   meshes that resolve it stop at 10 to 15 % compression, coarser ones go on to 60 %. Their forces differ by 1 %.
//! - A dead load on a block can be unstable: with the closed form's own tractions the tangent has negative pivots
//!   beyond 38 % compression, and the solver may end on a branch that is not the closed form.

pub mod element;
pub mod layer;
pub mod material;
pub mod mesh;
pub mod model;
pub mod newton;
pub mod obstacle;
pub mod shear_length;
pub mod sparse;
pub mod stress;

//! Finite elements in plane strain and in three dimensions: large deformations of nearly or exactly incompressible
//! rubber, with contact.
//!
//! | module | what is in it |
//! |---|---|
//! | [`material`] | energies as functions of `F:F` and `det F`, with exact stress and tangent |
//! | [`element`] | biquadratic displacement, discontinuous linear pressure, condensed |
//! | [`dimension`] | what the plane and space have in common |
//! | [`mesh`] | meshes, mapped patches, fans around corners |
//! | [`obstacle`] | rigid bodies by their distance |
//! | `contact` | what keeps surfaces out of rigid bodies: an interior-point method |
//! | [`model`] | a body, its equations and contact conditions |
//! | [`newton`] | Newton's method with load steps |
//! | [`side`] | the surface, its quadrature and loads |
//! | [`space`] | what only three dimensions have: stresses, the hexahedron, swept meshes, layers of finite width |
//! | [`stress`] | Cauchy stress at points, at nodes, along lines |
//! | `transfer` | from the equilibrium of one mesh to that of a finer one |
//! | [`folds`] | through loads at which an equilibrium ceases to be |
//! | [`shear_length`] | the length `L` that the closed form leaves open, from finite elements |
//! | [`layer`] | the layer of the paper under an indenter |
//! | `levels` | the meshes for that, coarse to fine |
//! | [`forecast`] | what that will take |
//! | [`press`] | the layer pressed to given loads on finer and finer meshes |
//!
//! # Corners that open
//! Where the bonded bottom meets the free face, and where a sharp punch ends, a right or straight angle opens by 90 degrees
//! and more. One quadrilateral in such a corner has to turn inside out; that is where other implicit codes stop. A
//! *fan* of sectors around the corner shares the angle, and the layer goes to 40 % on 300 elements.
//!
//! # Current limitations
//! - Contact is without friction, at four points of every side of an element.
//! - Under a punch with rounded corners the surface slides around the corner side by side, six times as long there as at rest
//!   (40 %, radius 0.02 H). Sides of elements as long as the radius make ripples, which hold it back: load steps are short, and the
//!   force scatters by 1 %. With one and a half sides per radius it scatters by 0.2 %. A
//!   [`material::Rubber::volume_barrier`] of 20 keeps the elements at the corner from turning inside out.
//! - Beside a sharp punch the surface turns up by 90 degrees and more, and the points under it crowd towards its end. A flank that
//!   goes along with the last point, and the rule that no point under the punch passes that point, take it through; the
//!   force of the flank acts on that one point. The surface under the punch is piled up there, `J` becomes small at single
//!   points of the mesh. Rings and the quadrilaterals around them have to be refined together: 18 rings among eight
//!   quadrilaterals over the thickness stop at once. Beyond 20 % the force is not that of a punch that rubber can leave.
//! - The free end without contact rolls up at the bonded corner, at any load and from the smallest scale on, and passes
//!   through the bonded bottom and through itself: that is the equilibrium without contact (see `docs/free-end.md`), but no
//!   layer can do it. Incompressible rubbers other than Ogden's follow it ([`folds`]); others keep a fan in the corner that
//!   does not roll up, and are too stiff by 1 % at 10 % and 4.5 % at 20 % compression.
//! - A dead load on a block can be unstable: with the closed form's own tractions the tangent has negative pivots
//!   beyond 38 % compression, and the solver may end on a branch that is not the closed form.

mod contact;
pub mod dimension;
pub mod element;
pub mod folds;
pub mod forecast;
pub mod layer;
mod layer_mesh;
mod levels;
pub mod material;
pub mod mesh;
pub mod model;
pub mod newton;
pub mod obstacle;
pub mod press;
pub mod shear_length;
pub mod side;
pub mod space;
pub mod stress;
mod transfer;

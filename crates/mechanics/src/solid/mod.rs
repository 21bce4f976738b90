//! Finite elements in plane strain and in three dimensions: large deformations of nearly or exactly
//! incompressible rubber, with contact.
//!
//! | module | contents |
//! |---|---|
//! | [`element`] | the quadrilateral: biquadratic displacement, condensed linear pressure |
//! | `shape_functions` | the shape functions of all elements, and the fit to their quadrature points |
//! | [`dimension`] | the common interface of plane strain and space |
//! | [`mesh`] | meshes, mapped patches, fans around corners |
//! | [`refinement`] | local refinement: elements cut in two |
//! | `hanging` | hanging nodes and sides, and the nodes that they follow |
//! | [`obstacle`] | rigid bodies, described by the distance to their surface |
//! | `contact` | contact with rigid bodies by an interior-point method |
//! | [`model`] | a body, its equations and contact conditions |
//! | [`newton`] | Newton's method with load steps |
//! | [`side`] | the surface and its quadrature |
//! | `nodes_by_place` | lookup of nodes by their positions |
//! | [`plane`] | plane strain only: layers of which a section is modelled, sharp punches |
//! | [`space`] | three dimensions only: stresses, the hexahedron, swept meshes, layers of finite width |
//! | `point_stress` | Cauchy stress at a point, from the deformation gradient there |
//! | [`stress`] | Cauchy stress of a configuration: at points, at nodes, along lines |
//! | `transfer` | the equilibrium on one mesh as a first guess on a finer one |
//! | [`probe`] | the displacement between nodes |
//! | [`folds`] | continuation past loads at which an equilibrium ceases to exist |
//! | [`shear_length`] | the length `L` that the closed form does not determine, from finite elements |
//! | [`layer`] | the layer of the paper under an indenter |
//! | `layer_step` | the results for a layer in an equilibrium |
//! | `layer_mesh` | meshes of a layer in the plane, with fans at singular corners |
//! | `symmetry` | the part of the layer that a mesh covers |
//! | `flanks` | the flanks beside a held or bonded patch, as obstacles |
//! | `first_mesh` | the first mesh of a layer |
//! | `adaptive` | the layer pressed on adaptively refined meshes |
//! | [`forecast`] | memory and time of pressing, estimated in advance |
//! | `estimate` | error estimates of an equilibrium on one mesh, element by element |
//! | [`mesh_error`] | the error of a value from the differences between meshes |
//! | `force_goal` | the displacement that gives a force |
//! | `given_force` | an indenter that is pressed with a given force: its place is one more unknown |
//! | [`soundness`] | checks that an equilibrium is one that a layer can be in |
//! | `level` | the equilibria under several loads on one mesh |
//! | [`press`] | the layer pressed to given loads on finer and finer meshes |
//!
//! # Corners that open
//! Where the bonded bottom meets the free face, and where a sharp punch ends, a right or straight angle opens
//! by 90 degrees and more. One quadrilateral in such a corner has to turn inside out; that is where other
//! implicit codes stop. A *fan* of sectors around the corner shares the angle, and the layer goes to 40 % on
//! 300 elements.
//!
//! # Current limitations
//! - Contact is without friction, at four points of every side of an element.
//! - Under a punch with rounded corners the sides of elements slide around the corner one by one, stretched
//!   sixfold there (40 %, radius 0.02 H). Sides as long as the radius make ripples that hold the surface
//!   back, and the force scatters by 1 %. With one and a half sides per radius it scatters by 0.2 %. A
//!   [`elastocap_materials::Rubber::volume_barrier`] of 20 keeps the elements at the corner from turning
//!   inside out.
//! - Around the corner of a sharp punch the surface is stretched without limit, and a mesh stretches it as
//!   far as its smallest ring allows. Beyond 40 % compression, or under punches wider than three thicknesses,
//!   finer meshes may not get to the load; the step is then marked or refused. In space, punches are
//!   rounded, or patches that are held or bonded.
//! - A held patch is not a punch: its points move down together and spread, 13 to 43 % too stiff for a punch
//!   of its width at 5 to 20 %. The points under it crowd towards its edge. Two conditions make this
//!   possible: a flank that moves with the last point, and no point of the patch may pass that point. The
//!   force of the flank acts on that one point. Rings and the quadrilaterals around them have to be refined
//!   together: 18 rings among eight quadrilaterals over the thickness fail at once.
//! - The free end without contact rolls up at the bonded corner, at any load and from the smallest scale on,
//!   and passes through the bonded bottom and through itself. That is the equilibrium without contact (see
//!   `docs/free-end.md`), but no real layer can do it. Incompressible neo-Hookean, Mooney-Rivlin and Yeoh
//!   rubbers follow it ([`folds`]). Other rubbers keep a fan in the corner that does not roll up, and are too
//!   stiff by 1 % at 10 % and 4.5 % at 20 % compression.
//! - A rubber with a limit of extension (Gent) is never taken beyond it. At the singular corners of a layer
//!   every mesh finds larger strains than the one before, so that finer meshes may stop at smaller
//!   compressions: the limit has to leave room.
//! - A dead load on a block can be unstable: with the tractions of the closed form the tangent has negative
//!   pivots beyond 38 % compression, and the solver may end on a branch that is not the closed form.

mod adaptive;
mod contact;
pub mod dimension;
pub mod element;
mod estimate;
mod first_mesh;
mod flanks;
pub mod folds;
mod force_goal;
pub mod forecast;
mod given_force;
mod hanging;
pub mod layer;
mod layer_mesh;
mod layer_step;
mod level;
pub mod mesh;
pub mod mesh_error;
pub mod model;
pub mod newton;
mod nodes_by_place;
pub mod obstacle;
pub mod plane;
mod point_stress;
pub mod press;
pub mod probe;
pub mod refinement;
mod shape_functions;
pub mod shear_length;
pub mod side;
pub mod soundness;
pub mod space;
pub mod stress;
mod symmetry;
mod transfer;

//! The code that only three dimensions need: layers of finite width.
//!
//! Equations, contact and Newton's method are those of the plane; see [`super::dimension`].
//!
//! | module | contents |
//! |---|---|
//! | [`element`] | the hexahedron: triquadratic displacement, condensed linear pressure |
//! | [`mesh`] | plane meshes swept along the third direction |
//! | [`layer`] | a quarter of a layer, with fans around the bonded edges of its end and its side |
//! | [`press`] | that layer pressed to given loads on finer and finer meshes |
//! | [`stress`] | Cauchy stress at the nodes |
//!
//! # Current limitations
//! - A fan around the edge of a sharp punch goes straight to the side of the layer; the bonded edge of that
//!   side then has no fan, and its hexahedra turn inside out in wide layers under much compression.
//! - A rounded edge has to be resolved: on hexahedra larger than its radius the force depends on the mesh by
//!   some percent, and there may be more than one equilibrium.
//! - The linear systems are factorised on one thread for each of two loads, or on two threads: 60,000
//!   unknowns take about 1 s.

pub mod element;
pub mod layer;
pub mod mesh;
pub mod press;
pub mod stress;

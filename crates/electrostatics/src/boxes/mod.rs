//! Laplace's equation among axis-aligned boxes and sheets, on graded tensor-product grids, with proved
//! bounds. [`solve`] is the entry.

mod common_line;
pub(crate) mod conductor_free;
pub(crate) mod domain;
pub(crate) mod dual;
pub(crate) mod energies;
pub(crate) mod energy;
pub(crate) mod field;
pub(crate) mod forecast;
pub(crate) mod grid_problem;
pub(crate) mod grid_refinement;
mod grid_search;
pub(crate) mod half_turn;
mod holders;
pub(crate) mod layout;
pub(crate) mod mapped;
pub(crate) mod one_grid;
mod one_part;
mod open_space;
pub(crate) mod placed_map;
pub(crate) mod primal;
pub(crate) mod ray_permittivity;
pub(crate) mod resolution;
pub(crate) mod scene_map;
pub(crate) mod schwarz;
pub(crate) mod solve;
pub(crate) mod solve_base;
pub(crate) mod superposed;
pub(crate) mod symmetry;
pub(crate) mod tensor;
mod two_states;

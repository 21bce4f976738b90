//! Scenes that differ from a common one, the *base*, by a body that comes near and by what a map bends around
//! it: a sharp solution of the base is added to a coarse one for the difference. The body is a conductor or a
//! dielectric.
//!
//! Edges of electrodes take most of the unknowns, and they are the same with and without the body. So the
//! base, without a map, is solved once on a fine grid, for all loads. The change due to the body is smooth at
//! those edges, and takes a coarse grid under the map.
//!
//! **Potential.** In the coordinates of the boxes let u0 be the potential of the base on its grid, and B a
//! block of the coarse grid that holds the body and all that the map bends, and no electrode. Let p be u0
//! interpolated by the functions of the coarse grid that do not vanish on B, so that p = u0 on B up to the
//! interpolation error. With y any function of the coarse grid that has the potential of the body there, and
//! is zero on the electrodes,
//!
//! u = u0 - z + y - p,
//!
//! where z removes the interpolation error: on the common refinement of both grids, the functions of u0 - p
//! that do not vanish on B. So u = y on B, where everything is a polynomial of the coarse grid, and u has the
//! right values on all conductors: its energy U is an upper bound. Outside of B the map is the identity, and
//! the energy is that of the boxes on the common refinement. The best y solves the coarse problem under the
//! map with p as a source.
//!
//! **Flux.** Let d0 be the flux of the base without divergence, and s one of the coarse grid, without
//! divergence outside the conductors and near K grad y - eps grad p. Their sum has no divergence either, and
//! its distance from K grad u is, by Prager and Synge, at least the root of U - C. By the triangle inequality
//!
//! U - C <= (|d0 - eps grad u0| + |s - (K grad y - eps grad p)| + |eps grad z|)^2
//!
//! in the norm of K^-1, for every combination of potentials. The square of the first term is the gap G0
//! between the bounds of the base, except that the norm in B is a different one; that part is integrated. The
//! second is computed on the coarse grid alone. The last is as small as the interpolation error.
//!
//! Where the body is a dielectric, eps is the permittivity without it, and K that with it under the map.
//!
//! **Differences.** Let the body be a conductor, e the error of u0 as a potential in space, and H the
//! function that is e on the body, zero on the electrodes and without sources elsewhere. X is the energy that
//! the body sees of e ([`sight`]). In open space the map bends nothing but coordinates, so that both u0 and
//! d0 have images in the coordinates of the boxes. Consider the sum of both fluxes less the image of d0, and
//! u less the image of u0. Let R bound the distance of the former from K times the gradient of the latter: it
//! is the sum of the second and the third term above and, in B, of |d0 - eps grad u0| in the norm of K^-1 and
//! once more without a map. For any function w that is zero on all conductors the products of
//! grad u with K grad w, and of grad u0 with that of w in space, differ by at most R |w|. With e - H for w,
//! and with u less the true potential,
//!
//! | (U - C)^(1/2) - |e - H| | <= R,        |e - H|^2 = |e|^2 - X,
//!
//! so that C + |e|^2 is at least U - 2 |e| R - R^2 and at most U + X + 2 |e| R, with |e|^2 <= G0. |e|^2 is
//! the same for all scenes that are added to the base.

pub(crate) mod added;
mod base;
mod errors;
mod grids;
mod products;
mod sight;
mod squares;

pub(crate) use added::Added;
pub use base::Base;
pub(crate) use base::BasePart;
pub(crate) use sight::Sight;

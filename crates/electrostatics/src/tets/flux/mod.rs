//! Lower bounds on capacitance on tetrahedra: a flux without divergence near that of the discrete potential.
//!
//! Thomson's principle: for potentials V on the conductors, and any square-integrable flux `sigma` without
//! divergence and with none through insulated faces,
//!
//! `V^T C V >= 2 sum_i V_i Q_i(sigma) - int |sigma|^2 / eps`
//!
//! with `Q_i` the flux that comes out of conductor i. Equality holds for `sigma = -eps grad u`, so that a
//! good flux is near the one of the discrete potential. It is made vertex by vertex (Destuynder and Métivet,
//! Math. Comp. 68, 1999; Braess and Schöberl, Math. Comp. 77, 2008; Ern and Vohralík, SIAM J. Numer. Anal.
//! 53, 2015): in the patch of vertex a, with hat function `psi_a`, a Raviart-Thomas flux with divergence
//! `grad psi_a . (-eps grad u)` that is nearest, in energy, to the interpolated `-psi_a eps grad u`. The hats
//! sum to one: the divergences cancel, and a discrete flux that needs no repair comes back as it was.
//!
//! **Why the bound holds at any residual.** A flux is stored as one number per face and moment: its normal
//! component cannot jump. Of its basis, only functions of constant divergence and functions without
//! divergence are used, so that the divergence in a tetrahedron is the sum of four face moments. A potential
//! solved to a finite residual leaves some divergence there. It is carried from tetrahedron to tetrahedron
//! along the cheapest path to a face where flux may leave, and is then zero up to rounding, see
//! [`Flux::divergence`]. Whatever the gradients are, the result is an admissible flux; only how near the
//! bound is depends on them. The flux is zero in a part of the mesh that no flux can leave.
//!
//! **Open space.** Beyond an open face the flux continues along rays from the centre of the mesh; its energy
//! is taken with the smallest permittivity that the rays cross.
//!
//! Permittivities are relative, lengths in metres, so that charges per volt and energies are in metres: times
//! eps_0 they are farads.

mod element;
mod faces;
mod patch;
mod reference;
#[cfg(test)]
mod tests;

use crate::error::FluxError;
use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_linalg::dense;
use element::{Element, times};
use faces::{Forest, Growth, NONE, Passages};
use faer::{Mat, MatRef};
use patch::{FluxProblem, Workspace};
use rayon::prelude::*;
use reference::Reference;

/// Charges, energies and error indicators of the fluxes of several states.
#[derive(Debug, Clone)]
pub(crate) struct Flux {
    /// Flux that comes out of each conductor (rows) in each state (columns): its charge over eps_0 per volt,
    /// m. Conductors up to the last one with a face in the mesh.
    pub charges: Mat<f64>,
    /// (sigma_i, sigma_j) / eps over all space, open space included, m.
    pub energy: Mat<f64>,
    /// (sigma_i + eps grad u_i, sigma_j + eps grad u_j) / eps over the mesh, m. In a mesh without open faces
    /// this is the upper minus the lower bound (Prager and Synge, Quart. Appl. Math. 5, 1947); with them the
    /// difference also contains that of the two continuations.
    pub gap: Mat<f64>,
    /// Per state and tetrahedron, its contribution to the diagonal of `gap`, m.
    pub gaps: Vec<Vec<f64>>,
    /// Largest divergence in a tetrahedron over the largest flux through its faces: rounding only.
    #[cfg_attr(not(test), expect(dead_code, reason = "the tests assert that it is no more than rounding"))]
    pub divergence: f64,
}

impl Flux {
    /// Lower bound on P^T C P for the Maxwell matrix C of the mesh, over eps_0, m: the true one less this is
    /// positive semidefinite.
    ///
    /// `potentials` has the conductors' potentials (rows, V) in each state (columns); for unit potentials it
    /// is the identity and the bound is one on C.
    ///
    /// # Panics
    ///
    /// If `potentials` has not as many rows as `charges`, or not as many columns as there are states.
    pub(crate) fn lower(&self, potentials: MatRef<f64>) -> Mat<f64> {
        let n = self.energy.nrows();
        assert_eq!(potentials.ncols(), n, "one column of potentials per state");
        let work = dense::product(potentials.transpose(), self.charges.as_ref());
        Mat::from_fn(n, n, |i, j| work[(i, j)] + work[(j, i)] - self.energy[(i, j)])
    }
}

/// Number of vertices whose patches are solved in parallel before their contributions are added in order.
/// Tuned: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const BATCH: usize = 4096;

/// Number of tetrahedra whose energies one task sums. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const CHUNK: usize = 1024;

/// Computes the fluxes of discrete potentials of order 1, 2 or 3.
///
/// `permittivity` is relative, for the background and then each dielectric. `gradients` has for each state
/// the gradients, V/m, of the potential in each tetrahedron, as nodal values of polynomials of one degree
/// less than `order`: one value, or those at the four corners, or those followed by the middles of the edges
/// 01, 02, 03, 12, 13, 23, tetrahedron after tetrahedron.
///
/// If `add_up` the gradients of all states add up to zero, and so do the fluxes: that of the last state
/// follows from the others.
///
/// # Errors
///
/// [`FluxError`] if lists do not fit the mesh, numbers are not finite, or open faces do not see the centre of
/// the mesh.
pub(crate) fn equilibrate(
    mesh: &TetMesh,
    permittivity: &[f64],
    order: usize,
    gradients: &[Vec<[f64; 3]>],
    add_up: bool,
) -> Result<Flux, FluxError> {
    if !(1..=3).contains(&order) {
        return Err(FluxError::Order { order });
    }
    let reference = Reference::new(order - 1);
    check(mesh, permittivity, &reference, gradients)?;
    let passages = Passages::new(mesh, permittivity)?;
    let independent = &gradients[..gradients.len() - usize::from(add_up && !gradients.is_empty())];
    let problem = FluxProblem {
        mesh,
        passages: &passages,
        reference: &reference,
        permittivity,
        gradients: independent,
    };
    let mut moments = collect(&problem);
    drain(&problem, &mut moments);
    if independent.len() < gradients.len() {
        let minus_sum = |k: usize| -moments.iter().map(|x| x[k]).sum::<f64>();
        moments.push((0..passages.tets.len() * reference.on_face).map(minus_sum).collect());
    }
    Ok(measure(&FluxProblem { gradients, ..problem }, &moments))
}

/// Checks that lists fit the mesh and that numbers are sound.
fn check(
    mesh: &TetMesh,
    permittivity: &[f64],
    reference: &Reference,
    gradients: &[Vec<[f64; 3]>],
) -> Result<(), FluxError> {
    let length = |what, found, expected| {
        if found == expected { Ok(()) } else { Err(FluxError::Length { what, found, expected }) }
    };
    length("regions of tetrahedra", mesh.regions.len(), mesh.tets.len())?;
    if let Some(&last) = mesh.regions.iter().max().filter(|&&last| last as usize >= permittivity.len()) {
        return Err(FluxError::Length {
            what: "permittivities",
            found: permittivity.len(),
            expected: last as usize + 1,
        });
    }
    let wrong = permittivity.iter().position(|e| !(e.is_finite() && *e > 0.0));
    if let Some(region) = wrong {
        return Err(FluxError::Permittivity { region, value: permittivity[region] });
    }
    let nodes = reference.nodes;
    for state in gradients {
        length("gradients", state.len(), nodes * mesh.tets.len())?;
    }
    let is_sound = |t: usize| {
        let finite = gradients
            .iter()
            .all(|g| g[t * nodes..(t + 1) * nodes].as_flattened().iter().all(|g| g.is_finite()));
        finite && mesh.determinant(t) > 0.0
    };
    match (0..mesh.tets.len()).into_par_iter().find_first(|&t| !is_sound(t)) {
        Some(tetrahedron) => Err(FluxError::NotFinite { tetrahedron }),
        None => Ok(()),
    }
}

/// Solves the patches of all vertices and sums their contributions: per state the moments of all passages.
fn collect(problem: &FluxProblem) -> Vec<Vec<f64>> {
    let per = problem.reference.on_face;
    let corners = &problem.passages.corners;
    let vertices = problem.mesh.points.len();
    // The tetrahedra around each vertex, one vertex after the other, and where those of each begin.
    let mut starts = vec![0_usize; vertices + 1];
    corners.iter().flatten().for_each(|&c| starts[c as usize + 1] += 1);
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut around = vec![0_u32; 4 * corners.len()];
    for (t, tet) in corners.iter().enumerate() {
        for &c in tet {
            around[next[c as usize]] = t as u32;
            next[c as usize] += 1;
        }
    }
    let mut moments = vec![vec![0.0; problem.passages.tets.len() * per]; problem.gradients.len()];
    for first in (0..vertices).step_by(BATCH) {
        let shares: Vec<_> = (first..vertices.min(first + BATCH))
            .into_par_iter()
            .map_init(Workspace::default, |work, v| {
                work.solve(problem, v as u32, &around[starts[v]..starts[v + 1]])
            })
            .collect();
        for share in shares {
            let length = share.passages.len() * per;
            for (s, total) in moments.iter_mut().enumerate() {
                let of_state = &share.moments[s * length..(s + 1) * length];
                for (&p, part) in share.passages.iter().zip(of_state.chunks_exact(per)) {
                    let sums = &mut total[p as usize * per..][..per];
                    sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
                }
            }
        }
    }
    moments
}

/// Carries the remaining divergence out of the mesh.
fn drain(problem: &FluxProblem, moments: &mut [Vec<f64>]) {
    let passages = problem.passages;
    let per = problem.reference.on_face;
    let mut forest = Forest::default();
    let cost = |p: u32| passages.cost[p as usize];
    forest.grow(&passages.of_tet, &passages.tets, cost, Growth::Nearest);
    let (drained, closed) = forest.order.split_at(forest.drained);
    moments.par_iter_mut().for_each(|x| {
        for &t in closed {
            for &p in passages.of_tet[t as usize].iter().filter(|&&p| p != NONE) {
                x[p as usize * per..][..per].fill(0.0);
            }
        }
        for &t in drained.iter().rev() {
            let t = t as usize;
            let parent = passages.of_tet[t][forest.parent[t] as usize];
            x[parent as usize * per] -= passages.sign(parent, t) * outflow(passages, per, x, t).0;
        }
    });
}

/// The sum of the outward first moments of the faces of a tetrahedron, and the largest magnitude among them.
fn outflow(passages: &Passages, per: usize, x: &[f64], t: usize) -> (f64, f64) {
    passages.of_tet[t].iter().filter(|&&p| p != NONE).fold((0.0, 0.0), |(sum, largest): (f64, f64), &p| {
        let out = passages.sign(p, t) * x[p as usize * per];
        (sum + out, largest.max(out.abs()))
    })
}

/// Sums over a chunk of tetrahedra, and the gap of each of them.
struct Sums {
    /// The part of [`Flux::energy`], row by row.
    energy: Vec<f64>,
    /// The part of [`Flux::gap`], row by row.
    gap: Vec<f64>,
    /// The contribution to the diagonal of `gap`, tetrahedron after tetrahedron, for each state.
    gaps: Vec<f64>,
    /// See [`Flux::divergence`].
    divergence: f64,
}

/// Computes charges, energies and gaps of the finished fluxes.
fn measure(problem: &FluxProblem, moments: &[Vec<f64>]) -> Flux {
    let (passages, reference) = (problem.passages, problem.reference);
    let (states, per, tets) = (moments.len(), reference.on_face, problem.mesh.tets.len());
    let pairs = states * states;
    let chunks: Vec<Sums> =
        (0..tets.div_ceil(CHUNK)).into_par_iter().map(|c| sums(problem, moments, c)).collect();
    let mut energy = vec![0.0; pairs];
    let mut gap = vec![0.0; pairs];
    let mut gaps = vec![Vec::with_capacity(tets); states];
    let mut divergence = 0.0_f64;
    for chunk in chunks {
        energy.iter_mut().zip(chunk.energy).for_each(|(sum, part)| *sum += part);
        gap.iter_mut().zip(chunk.gap).for_each(|(sum, part)| *sum += part);
        for of_tet in chunk.gaps.chunks_exact(states.max(1)) {
            gaps.iter_mut().zip(of_tet).for_each(|(list, &value)| list.push(value));
        }
        divergence = divergence.max(chunk.divergence);
    }
    for beyond in &passages.open {
        let form = beyond.energy(reference);
        let on_face = |s: usize| &moments[s][beyond.passage as usize * per..][..per];
        for i in 0..states {
            for j in 0..states {
                energy[i * states + j] += product(&form, on_face(i), on_face(j));
            }
        }
    }
    let mut charges = Mat::zeros(passages.conductors, states);
    for (p, &conductor) in passages.conductor.iter().enumerate().filter(|p| *p.1 != NONE) {
        for (s, x) in moments.iter().enumerate() {
            // The first moment is sqrt(2) times the flux, which counts as going out of the mesh into the
            // conductor.
            charges[(conductor as usize, s)] -= x[p * per] / 2.0_f64.sqrt();
        }
    }
    let square = |list: Vec<f64>| Mat::from_fn(states, states, |i, j| list[i * states + j]);
    Flux { charges, energy: square(energy), gap: square(gap), gaps, divergence }
}

/// x . A y for a table stored by rows.
fn product(table: &[f64], x: &[f64], y: &[f64]) -> f64 {
    let row = |row: &[f64]| row.iter().zip(y).map(|(a, y)| a * y).sum::<f64>();
    table.chunks_exact(y.len()).zip(x).map(|(a, x)| x * row(a)).sum()
}

/// The sums over the tetrahedra of chunk `chunk`.
fn sums(problem: &FluxProblem, moments: &[Vec<f64>], chunk: usize) -> Sums {
    let (passages, reference) = (problem.passages, problem.reference);
    let (states, per, size) = (moments.len(), reference.on_face, reference.size());
    let (faces, retained) = (4 * per, 4 * per + reference.sources);
    let last = problem.mesh.tets.len().min((chunk + 1) * CHUNK);
    let mut sums = Sums {
        energy: vec![0.0; states * states],
        gap: vec![0.0; states * states],
        gaps: Vec::new(),
        divergence: 0.0,
    };
    let (mut element, mut carried) = (Element::default(), Vec::new());
    let mut fluxes = vec![Vec::new(); states];
    let mut difference = vec![Vec::new(); states];
    for t in chunk * CHUNK..last {
        let eps = problem.eps(t);
        element.load(problem.mesh, passages, reference, t, eps);
        for s in 0..states {
            let (flux, difference): (&mut Vec<f64>, &mut Vec<f64>) = (&mut fluxes[s], &mut difference[s]);
            element.carry(eps, passages.original[t], problem.gradient(s, t), &mut carried);
            // First the flux of the discrete potential; then the difference from it in face moments and
            // sources, and the loops of minimal energy that follow from these.
            times(&reference.interpolation, &carried, difference);
            flux.clear();
            flux.resize(size, 0.0);
            flux[retained..].copy_from_slice(&difference[retained..]);
            for (i, &p) in passages.of_tet[t].iter().enumerate().filter(|p| *p.1 != NONE) {
                let from = &moments[s][p as usize * per..][..per];
                let to = &mut flux[i * per..(i + 1) * per];
                to.iter_mut().zip(from).for_each(|(to, from)| *to = passages.sign(p, t) * from);
            }
            for k in 0..retained {
                difference[k] = if k < faces { flux[k] } else { 0.0 } - difference[k];
            }
            for l in 0..reference.loops {
                let row = &element.follow[l * retained..(l + 1) * retained];
                difference[retained + l] = row.iter().zip(&difference[..retained]).map(|(a, x)| a * x).sum();
                flux[retained + l] += difference[retained + l];
            }
            let (sum, largest) = outflow(passages, per, &moments[s], t);
            if largest > 0.0 {
                sums.divergence = sums.divergence.max(sum.abs() / largest);
            }
        }
        for i in 0..states {
            for j in 0..states {
                sums.energy[i * states + j] += product(&element.mass, &fluxes[i], &fluxes[j]);
                let gap = product(&element.mass, &difference[i], &difference[j]);
                sums.gap[i * states + j] += gap;
                if i == j {
                    sums.gaps.push(gap);
                }
            }
        }
    }
    sums
}

//! Fluxes around one vertex: the local problem that gives a flux its prescribed divergence at minimal energy.
//!
//! The unknowns are the moments of the faces at the vertex. In each tetrahedron one sum of moments is
//! prescribed. This constraint is solved for the moment of the face towards the root of a spanning tree, so
//! that it holds up to rounding; the energy is minimised over the other moments.

use super::element::{Element, times};
use super::faces::{Forest, Growth, NONE, Passages};
use super::reference::Reference;
use elastocap_geometry::meshing::tets::TetMesh;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::{factor, solve};
use faer::{Mat, Par};

/// The mesh, the permittivities and the gradients: the data that all patches share.
pub(super) struct FluxProblem<'a> {
    pub(super) mesh: &'a TetMesh,
    pub(super) passages: &'a Passages,
    pub(super) reference: &'a Reference,
    /// Relative permittivity per region.
    pub(super) permittivity: &'a [f64],
    /// Per state, nodal gradients of all tetrahedra.
    pub(super) gradients: &'a [Vec<[f64; 3]>],
}

impl FluxProblem<'_> {
    /// The relative permittivity of a tetrahedron.
    pub(super) fn eps(&self, t: usize) -> f64 {
        self.permittivity[self.mesh.regions[t] as usize]
    }

    /// Nodal gradients of one state in one tetrahedron.
    pub(super) fn gradient(&self, state: usize, t: usize) -> &[[f64; 3]] {
        let nodes = self.reference.nodes;
        &self.gradients[state][t * nodes..(t + 1) * nodes]
    }
}

/// Moments that one vertex contributes.
#[derive(Debug)]
pub(super) struct Share {
    /// Passages around the vertex.
    pub(super) passages: Vec<u32>,
    /// Moments, by state, passage and moment.
    pub(super) moments: Vec<f64>,
}

/// Buffers that successive patches reuse.
#[derive(Default)]
pub(super) struct Workspace {
    element: Element,
    forest: Forest,
    /// Like those of [`Passages`], with the passages and the tetrahedra as numbered in the patch.
    of_tet: Vec<[u32; 4]>,
    tets: Vec<[u32; 2]>,
    /// The matrix of the energy, row by row.
    matrix: Vec<f64>,
    /// The right-hand sides, state after state.
    right: Vec<f64>,
    /// The divergence that each tetrahedron must have, state after state.
    supply: Vec<f64>,
    /// The flux of the discrete potential in one tetrahedron: see [`Element::carry`].
    carried: Vec<f64>,
    /// The face moments, then the sources, of the flux to approximate in one tetrahedron.
    departure: Vec<f64>,
    /// The sources alone.
    sources: Vec<f64>,
    /// The products of the energy matrix of the tetrahedron with `departure`.
    pull: Vec<f64>,
}

impl Workspace {
    /// Solves the patch of `vertex`, which consists of the tetrahedra `around`.
    pub(super) fn solve(&mut self, problem: &FluxProblem, vertex: u32, around: &[u32]) -> Share {
        let passages = self.number(problem, vertex, around);
        let (per, states) = (problem.reference.on_face, problem.gradients.len());
        let unknowns = passages.len() * per;
        if unknowns == 0 {
            return Share { passages, moments: Vec::new() };
        }
        self.assemble(problem, vertex, around, &passages);
        let cost = |p: u32| problem.passages.cost[passages[p as usize] as usize];
        self.forest.grow(&self.of_tet, &self.tets, cost, Growth::Cheapest);
        let mut moments = vec![0.0; states * unknowns];
        self.fulfil(&mut moments, around.len(), per, unknowns);
        // The right-hand side at the flux that the trees alone carry.
        for (x, b) in moments.chunks_exact(unknowns).zip(self.right.chunks_exact_mut(unknowns)) {
            for (row, b) in self.matrix.chunks_exact(unknowns).zip(b) {
                *b -= row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
            }
        }
        self.reduce(per, unknowns);
        let mut is_free = vec![true; unknowns];
        for (t, &face) in self.forest.parent.iter().enumerate().filter(|p| *p.1 < 4) {
            is_free[self.of_tet[t][face as usize] as usize * per] = false;
        }
        let free: Vec<usize> = (0..unknowns).filter(|&k| is_free[k]).collect();
        // The factorisation reads the lower triangle only.
        let mut free_matrix = Mat::zeros(free.len(), free.len());
        for (j, &column) in free.iter().enumerate() {
            let from = &self.matrix[column * unknowns..(column + 1) * unknowns];
            let to = &mut free_matrix.col_as_slice_mut(j)[j..];
            to.iter_mut().zip(&free[j..]).for_each(|(to, &row)| *to = from[row]);
        }
        let mut solution = Mat::from_fn(free.len(), states, |i, s| self.right[s * unknowns + free[i]]);
        let scratch = factor::cholesky_in_place_scratch::<f64>(free.len(), Par::Seq, Default::default());
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        let factorised = factor::cholesky_in_place(
            free_matrix.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        // If rounding spoils the factorisation, the flux along the trees is still admissible, but not of
        // minimal energy.
        if factorised.is_ok() {
            solve::solve_in_place(free_matrix.as_ref(), solution.as_mut(), Par::Seq, stack);
            if (0..states).all(|s| solution.col(s).iter().all(|x| x.is_finite())) {
                for s in 0..states {
                    for (i, &k) in free.iter().enumerate() {
                        moments[s * unknowns + k] = solution[(i, s)];
                    }
                }
                self.fulfil(&mut moments, around.len(), per, unknowns);
            }
        }
        Share { passages, moments }
    }

    /// Lists the passages at the vertex, ascending, and fills in `of_tet` and `tets` with their numbers in
    /// this list.
    fn number(&mut self, problem: &FluxProblem, vertex: u32, around: &[u32]) -> Vec<u32> {
        let inner = |t: u32| {
            let (corners, of_tet) =
                (problem.passages.corners[t as usize], problem.passages.of_tet[t as usize]);
            (0..4).filter(move |&i| corners[i] != vertex && of_tet[i] != NONE).map(move |i| (i, of_tet[i]))
        };
        let mut passages: Vec<u32> = around.iter().flat_map(|&t| inner(t).map(|p| p.1)).collect();
        passages.sort_unstable();
        passages.dedup();
        self.of_tet.clear();
        self.tets.clear();
        self.tets.resize(passages.len(), [NONE; 2]);
        for (k, &t) in around.iter().enumerate() {
            let mut local = [NONE; 4];
            for (i, p) in inner(t) {
                if let Ok(index) = passages.binary_search(&p) {
                    local[i] = index as u32;
                    let first = problem.passages.tets[p as usize][0] == t;
                    self.tets[index][usize::from(!first)] = k as u32;
                }
            }
            self.of_tet.push(local);
        }
        passages
    }

    /// The energy's matrix and gradient, and the divergence that each tetrahedron must have.
    fn assemble(&mut self, problem: &FluxProblem, vertex: u32, around: &[u32], passages: &[u32]) {
        let reference = problem.reference;
        let (per, states) = (reference.on_face, problem.gradients.len());
        let retained = 4 * per + reference.sources;
        let unknowns = passages.len() * per;
        for (list, length) in [
            (&mut self.matrix, unknowns * unknowns),
            (&mut self.right, states * unknowns),
            (&mut self.supply, states * around.len()),
        ] {
            list.clear();
            list.resize(length, 0.0);
        }
        for (k, &t) in around.iter().enumerate() {
            let t = t as usize;
            let eps = problem.eps(t);
            self.element.load(problem.mesh, problem.passages, reference, t, eps);
            let corner = problem.passages.corners[t].iter().position(|&c| c == vertex).unwrap_or(0);
            let local = self.of_tet[k];
            let sides: Vec<(usize, usize, f64)> = (0..4)
                .filter(|&i| local[i] != NONE)
                .map(|i| {
                    let first = self.tets[local[i] as usize][0] == k as u32;
                    (i, local[i] as usize * per, if first { 1.0 } else { -1.0 })
                })
                .collect();
            for &(i, row, sign) in &sides {
                for &(j, column, other_sign) in &sides {
                    for a in 0..per {
                        let from = &self.element.energy[(i * per + a) * retained + j * per..][..per];
                        let to = &mut self.matrix[(row + a) * unknowns + column..][..per];
                        to.iter_mut().zip(from).for_each(|(to, from)| *to += sign * other_sign * from);
                    }
                }
            }
            let beyond = |i: usize| {
                let open = problem.passages.to_open[passages[local[i] as usize] as usize];
                (open != NONE).then(|| problem.passages.open[open as usize].energy(reference))
            };
            let open: Vec<(usize, usize, Vec<f64>)> =
                sides.iter().filter_map(|&(i, row, _)| Some((i, row, beyond(i)?))).collect();
            for (_, row, energy) in &open {
                for a in 0..per {
                    for b in 0..per {
                        self.matrix[(row + a) * unknowns + row + b] += energy[a * per + b];
                    }
                }
            }
            for s in 0..states {
                self.element.carry(
                    eps,
                    problem.passages.original[t],
                    problem.gradient(s, t),
                    &mut self.carried,
                );
                let supply = &reference.hat_supply[corner];
                self.supply[s * around.len() + k] =
                    supply.iter().zip(&self.carried).map(|(a, b)| a * b).sum::<f64>();
                // The flux to approximate: the interpolated product of hat and flux. Its divergence exceeds
                // the prescribed one by the product of the hat and the divergence of the flux.
                times(&reference.hat_moments[corner], &self.carried, &mut self.departure);
                times(&reference.hat_sources[corner], &self.carried, &mut self.sources);
                self.departure.extend_from_slice(&self.sources);
                times(&self.element.energy, &self.departure, &mut self.pull);
                let right = &mut self.right[s * unknowns..(s + 1) * unknowns];
                for &(i, row, sign) in &sides {
                    for a in 0..per {
                        right[row + a] += sign * self.pull[i * per + a];
                    }
                }
                for (i, row, energy) in &open {
                    for a in 0..per {
                        let target = &self.departure[i * per..(i + 1) * per];
                        right[row + a] += (0..per).map(|b| energy[a * per + b] * target[b]).sum::<f64>();
                    }
                }
            }
        }
    }

    /// Sets the first moment of each face towards the root so that the constraint of its tetrahedron holds.
    fn fulfil(&self, moments: &mut [f64], tets: usize, per: usize, unknowns: usize) {
        for (s, x) in moments.chunks_exact_mut(unknowns).enumerate() {
            for &t in self.forest.order.iter().rev() {
                let t = t as usize;
                let parent = self.forest.parent[t] as usize;
                if parent > 3 {
                    continue;
                }
                let mut remaining = self.supply[s * tets + t];
                for i in (0..4).filter(|&i| i != parent && self.of_tet[t][i] != NONE) {
                    let p = self.of_tet[t][i] as usize;
                    remaining -= self.sign(p, t) * x[p * per];
                }
                let p = self.of_tet[t][parent] as usize;
                x[p * per] = self.sign(p, t) * remaining;
            }
        }
    }

    /// Eliminates the moments that `fulfil` sets from the matrix A and the right-hand sides b: T^T A T and
    /// T^T b.
    ///
    /// The matrix is symmetric, hence T^T A T = T^T (T^T A)^T: rows are added to rows twice, with a
    /// transposition in between, since columns are far apart in memory.
    fn reduce(&mut self, per: usize, unknowns: usize) {
        let mut matrix = std::mem::take(&mut self.matrix);
        self.add_rows(&mut matrix, per, unknowns);
        for i in 0..unknowns {
            for j in 0..i {
                matrix.swap(i * unknowns + j, j * unknowns + i);
            }
        }
        self.add_rows(&mut matrix, per, unknowns);
        self.matrix = matrix;
        let mut right = std::mem::take(&mut self.right);
        right.chunks_exact_mut(unknowns).for_each(|b| self.add_rows(b, per, 1));
        self.right = right;
    }

    /// T^T A for a matrix A with `columns` columns: adds the row of each eliminated moment to the rows of the
    /// moments it follows from.
    fn add_rows(&self, rows: &mut [f64], per: usize, columns: usize) {
        for &t in &self.forest.order {
            let t = t as usize;
            let parent = self.forest.parent[t] as usize;
            if parent > 3 {
                continue;
            }
            let p = self.of_tet[t][parent] as usize;
            let from = p * per * columns;
            for i in (0..4).filter(|&i| i != parent && self.of_tet[t][i] != NONE) {
                let q = self.of_tet[t][i] as usize;
                let (to, c) = (q * per * columns, -self.sign(p, t) * self.sign(q, t));
                let (low, high) = rows.split_at_mut(from.max(to));
                let (to, from) = if to < from {
                    (&mut low[to..to + columns], &high[..columns])
                } else {
                    (&mut high[..columns], &low[from..from + columns])
                };
                to.iter_mut().zip(from).for_each(|(to, from)| *to += c * from);
            }
        }
    }

    /// +1 if flux through a passage of the patch counts as going out of tetrahedron `t` of it, else -1.
    fn sign(&self, passage: usize, t: usize) -> f64 {
        if self.tets[passage][0] as usize == t { 1.0 } else { -1.0 }
    }
}

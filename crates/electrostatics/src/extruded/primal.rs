//! Dirichlet's principle: continuous potentials, whose energy bounds the capacitance from above.
//!
//! Unknowns are an array of rows, one for each function of the plan, with a number for each function of the
//! line. The operator is the sum of K x M + M x K over the profiles of permittivity along the axis, K and M
//! being the stiffness and the mass of the triangles with that profile, and of the line with it.

use super::free_regions::{FreeRegion, Product, free_regions};
use super::local::Local;
use super::mesh::PlanMesh;
use super::plane_system::{Numbering, PlaneSystem};
use super::rays::PotentialRays;
use super::region::{Inverse, Scaling, Workspace};
use crate::boxes::domain::{Axis, per_element};
use crate::error::SolveError;
use elastocap_fem::line::line_matrices;
use elastocap_fem::tensor::{Dense, axpy, left, multiply, target};
use elastocap_fem::triangle::{PotentialIntegrals, continuous_functions};
use elastocap_geometry::scene::Wall;
use elastocap_linalg::conjugate_gradients::Operator;
use elastocap_linalg::dense::{self, Llt};
use elastocap_linalg::lanes::vectorized;
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// The upper problem on one mesh.
#[derive(Debug)]
pub(super) struct Primal {
    /// The number of functions of the line.
    width: usize,
    numbering: Numbering,
    /// The local matrices of each triangle.
    locals: Vec<Local>,
    profiles: Vec<Profile>,
    /// The inverses on the regions without conductors, of which the preconditioner is the sum.
    regions: Vec<Inverse>,
    workspace: Workspace,
    rays: PotentialRays,
    /// For each entity, the parts of the line where a conductor holds it, each with the number of the
    /// conductor.
    held: Vec<Vec<(Range<usize>, u32)>>,
    /// Entities that the walls of the plan hold at zero.
    grounded: Vec<bool>,
    /// Functions of the line that are 1 at a node of it.
    nodes: Vec<usize>,
    /// For each triangle the parts of the line where its inner functions are held.
    held_inner: Vec<Vec<Range<usize>>>,
    /// The number of points of the mesh, which are the first entities.
    points: usize,
}

/// The triangles with one profile of permittivity along the axis.
#[derive(Debug)]
struct Profile {
    /// For each row of the plan's matrices the index at which its entries begin, then the number of entries.
    starts: Vec<usize>,
    /// The columns of the entries.
    columns: Vec<u32>,
    /// The entries of the plan's stiffness.
    stiffness: Vec<f64>,
    /// The entries of the plan's mass.
    mass: Vec<f64>,
    /// The mass of the line, weighted by the permittivities of the profile.
    line_mass: Dense<f64>,
    /// The stiffness of the line, weighted in the same way.
    line_stiffness: Dense<f64>,
}

/// Rows that one parallel task computes. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const ROWS: usize = 64;

impl Primal {
    /// Assembles the problem for potentials of a degree; `radius` is the distance at which rays begin, if
    /// there are any.
    pub(super) fn new(
        mesh: &PlanMesh,
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        degree: usize,
        radius: Option<f64>,
    ) -> Result<Self, SolveError> {
        let numbering = numbering(mesh, degree);
        let integrals = PotentialIntegrals::new(degree);
        let triangles: Vec<(Local, Mat<f64>)> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|t| local(&integrals, mesh, t, degree))
            .collect::<Result<_, SolveError>>()?;
        let (locals, inner_bases): (Vec<Local>, Vec<Mat<f64>>) = triangles.into_iter().unzip();
        let trim = axis.functions();
        let width = trim.len();
        let trimmed =
            |m: Mat<f64>| Dense::from_mat(m.as_ref().submatrix(trim.start, trim.start, width, width));
        // Triangles by their profile: the bits of the permittivities along the axis, zero in conductors.
        let mut kinds: Vec<(Vec<u64>, Vec<u32>)> = Vec::new();
        for t in 0..mesh.triangles.len() {
            let c = mesh.column_of(t);
            let profile: Vec<u64> = c
                .conductor
                .iter()
                .zip(&c.permittivity)
                .map(|(conductor, e)| if conductor.is_some() { 0.0_f64 } else { *e }.to_bits())
                .collect();
            match kinds.iter_mut().find(|(kind, _)| *kind == profile) {
                Some((_, triangles)) => triangles.push(t as u32),
                None => kinds.push((profile, vec![t as u32])),
            }
        }
        let profiles = kinds
            .iter()
            .map(|(kind, triangles)| {
                let along: Vec<f64> = kind.iter().map(|b| f64::from_bits(*b)).collect();
                let (mass, stiffness) = line_matrices(&axis.line, &per_element(axis, &along));
                assembled(&numbering, &locals, triangles, trimmed(mass), trimmed(stiffness))
            })
            .collect();
        let entities = numbering.places.len();
        let mut grounded = vec![false; entities];
        for (e, ends) in mesh.edges.iter().enumerate() {
            if mesh.wall(e, walls) == Some(Wall::Grounded) {
                grounded[mesh.points.len() + e] = true;
                ends.iter().for_each(|p| grounded[*p as usize] = true);
            }
        }
        let mut held: Vec<Vec<(Range<usize>, u32)>> = vec![Vec::new(); entities];
        let mut held_inner = Vec::with_capacity(mesh.triangles.len());
        let of_column: Vec<Vec<(Range<usize>, u32)>> =
            mesh.columns.iter().map(|c| held_parts(&c.conductor, &c.held, axis)).collect();
        for t in 0..mesh.triangles.len() {
            let parts = &of_column[mesh.column[t] as usize];
            for e in &numbering.entities[t] {
                for part in parts {
                    if !held[*e as usize].contains(part) {
                        held[*e as usize].push(part.clone());
                    }
                }
            }
            held_inner.push(parts.iter().map(|(range, _)| range.clone()).collect());
        }
        let of_chain: Vec<Vec<(Range<usize>, u32)>> =
            mesh.chains.iter().map(|c| held_parts(&c.conductor, &c.held, axis)).collect();
        for (e, chain) in mesh.on_chains() {
            for part in &of_chain[chain as usize] {
                for entity in entities_of_edge(mesh, e) {
                    if !held[entity].contains(part) {
                        held[entity].push(part.clone());
                    }
                }
            }
        }
        let rays = PotentialRays::new(mesh, axis, walls, degree, radius, &inner_bases)?;
        let mut out = Self {
            width,
            numbering,
            locals,
            profiles,
            regions: Vec::new(),
            workspace: Workspace::default(),
            rays,
            held,
            grounded,
            nodes: axis.vertices(),
            held_inner,
            points: mesh.points.len(),
        };
        out.regions = out.regions(mesh, axis, walls, radius)?;
        Ok(out)
    }

    /// The inverses on all regions without conductors.
    fn regions(
        &self,
        mesh: &PlanMesh,
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        radius: Option<f64>,
    ) -> Result<Vec<Inverse>, SolveError> {
        let product = Product::new(mesh);
        let beyond = self.rays.beyond(mesh, walls, radius);
        let inverse_on = |free: &FreeRegion| {
            let elements = axis.cuts[free.cuts[0]]..axis.cuts[free.cuts[1]];
            let along = per_element(axis, &product.along);
            let modes = self.rays.modes(axis, elements, &along, free.held, radius)?;
            let window = axis.open(free.cuts[0], free.cuts[1], free.held);
            let weights: Vec<Option<f64>> = (0..mesh.triangles.len())
                .map(|t| {
                    let inside = free.columns[mesh.column[t] as usize];
                    inside.then(|| product.across(mesh.column_of(t), free.cuts))
                })
                .collect();
            let mut is_free: Vec<bool> = self.grounded.iter().map(|g| !g).collect();
            for (t, entities) in self.numbering.entities.iter().enumerate() {
                if weights[t].is_none() {
                    entities.iter().for_each(|e| is_free[*e as usize] = false);
                }
            }
            for (e, _) in mesh.on_chains().filter(|(_, chain)| !free.chains[*chain as usize]) {
                entities_of_edge(mesh, e).into_iter().for_each(|entity| is_free[entity] = false);
            }
            let system = PlaneSystem::new(&self.numbering, &weights, |e| is_free[e as usize], &beyond);
            let factors = inner_scaling(&self.numbering, &weights, &system.rows);
            let pieces =
                if factors.is_empty() { Vec::new() } else { std::iter::once(0..window.len()).collect() };
            let mut region = Inverse::new(system, &self.numbering, &self.locals, window, &modes)
                .ok_or(SolveError::Eigenvalues)?;
            region.scale(Scaling { pieces, factors });
            Ok(region)
        };
        free_regions(&mesh.columns, &mesh.chains, axis.walls).iter().map(inverse_on).collect()
    }

    /// The potential that is `potentials[c]` on conductor c and falls to zero within one element.
    pub(super) fn lift(&self, potentials: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.unknowns()];
        for (entity, parts) in self.held.iter().enumerate().take(self.points) {
            for (range, conductor) in parts {
                let row = self.numbering.rows[entity] as usize * self.width;
                for node in self.nodes.iter().filter(|n| range.contains(n)) {
                    u[row + node] = potentials[*conductor as usize];
                }
            }
        }
        u
    }

    /// The value of the potential `u` at a point of the plan and a node of the line, given by their numbers;
    /// `vertices` has the function of each node.
    pub(super) fn value_at(&self, u: &[f64], (corner, node): (u32, u32), vertices: &[Option<usize>]) -> f64 {
        vertices[node as usize].map_or(0.0, |function| u[corner as usize * self.width + function])
    }

    /// The product A x, with the rows of held unknowns.
    pub(super) fn full_product(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        self.set_to_full_product(x, &mut y);
        y
    }

    /// y = A x, with the rows of held unknowns.
    fn set_to_full_product(&self, x: &[f64], y: &mut [f64]) {
        let width = self.width;
        y.par_chunks_mut(ROWS * width).enumerate().for_each(|(task, out)| {
            out.fill(0.0);
            let rows = out.len() / width;
            let (mut k, mut m) = (vec![0.0; rows * width], vec![0.0; rows * width]);
            for profile in &self.profiles {
                let entries = profile.starts[task * ROWS]..profile.starts[task * ROWS + rows];
                if !entries.is_empty() {
                    k.fill(0.0);
                    m.fill(0.0);
                    vectorized(|| {
                        for i in 0..rows {
                            let row = task * ROWS + i;
                            let (k, m) = (&mut k[i * width..][..width], &mut m[i * width..][..width]);
                            for entry in profile.starts[row]..profile.starts[row + 1] {
                                let x = &x[profile.columns[entry] as usize * width..][..width];
                                let (s, c) = (profile.stiffness[entry], profile.mass[entry]);
                                for ((k, m), x) in k.iter_mut().zip(m.iter_mut()).zip(x) {
                                    *k += s * x;
                                    *m += c * x;
                                }
                            }
                        }
                    });
                    multiply(
                        left(&k, 0, rows, width, width),
                        profile.line_mass.right(),
                        target(out, 0, width),
                        true,
                    );
                    multiply(
                        left(&m, 0, rows, width, width),
                        profile.line_stiffness.right(),
                        target(out, 0, width),
                        true,
                    );
                }
            }
        });
        self.rays.add_product(x, y, width);
    }

    /// For each function of the line the energy of the part of a potential that has this function along the
    /// axis.
    pub(super) fn energies_along_axis(&self, u: &[f64]) -> Vec<f64> {
        let width = self.width;
        let mut out = vec![0.0; width];
        for profile in &self.profiles {
            let of_rows = |task: usize| {
                let mut energies = vec![0.0; width];
                let (mut k, mut m) = (vec![0.0; width], vec![0.0; width]);
                for row in task * ROWS..((task + 1) * ROWS).min(profile.starts.len() - 1) {
                    let entries = profile.starts[row]..profile.starts[row + 1];
                    if entries.is_empty() {
                        continue;
                    }
                    k.fill(0.0);
                    m.fill(0.0);
                    for entry in entries {
                        let x = &u[profile.columns[entry] as usize * width..][..width];
                        axpy(&mut k, profile.stiffness[entry], x);
                        axpy(&mut m, profile.mass[entry], x);
                    }
                    let x = &u[row * width..][..width];
                    for (f, energy) in energies.iter_mut().enumerate() {
                        let diagonal = f * width + f;
                        let (mass, stiffness) =
                            (profile.line_mass.data[diagonal], profile.line_stiffness.data[diagonal]);
                        *energy += x[f] * (k[f] * mass + m[f] * stiffness);
                    }
                }
                energies
            };
            let tasks = (profile.starts.len() - 1).div_ceil(ROWS);
            let parts: Vec<Vec<f64>> = (0..tasks).into_par_iter().map(of_rows).collect();
            parts.iter().for_each(|part| axpy(&mut out, 1.0, part));
        }
        out
    }

    /// Sets the unknowns that conductors and walls hold to zero.
    pub(super) fn clear_held<T: Copy + Default>(&self, y: &mut [T]) {
        let width = self.width;
        for (entity, parts) in self.held.iter().enumerate() {
            for row in self.numbering.rows[entity] as usize..self.numbering.rows[entity + 1] as usize {
                let line = &mut y[row * width..][..width];
                if self.grounded[entity] {
                    line.fill(T::default());
                }
                for (range, _) in parts {
                    line[range.clone()].fill(T::default());
                }
            }
        }
        for (t, parts) in self.held_inner.iter().enumerate() {
            for row in self.numbering.inner_rows[t] as usize..self.numbering.inner_rows[t + 1] as usize {
                for range in parts {
                    y[row * width..][range.clone()].fill(T::default());
                }
            }
        }
    }
}

impl Operator for Primal {
    type Precision = f32;

    fn unknowns(&self) -> usize {
        self.numbering.len() * self.width
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.set_to_full_product(x, y);
        self.clear_held(y);
    }

    fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.precondition_all(&[r], &mut [z]);
    }

    fn precondition_all(&mut self, r: &[&[f32]], z: &mut [&mut [f32]]) {
        z.iter_mut().for_each(|z| z.fill(0.0));
        for region in &self.regions {
            region.add_solutions(r, z, self.width, &mut self.workspace);
        }
        z.iter_mut().for_each(|z| self.clear_held(z));
    }
}

/// The entities of an edge: its ends, and the edge itself.
fn entities_of_edge(mesh: &PlanMesh, edge: usize) -> [usize; 3] {
    let [a, b] = mesh.edges[edge].map(|p| p as usize);
    [a, b, mesh.points.len() + edge]
}

/// The parts of the line where conductors hold a column or a chain, each with its conductor; `of_intervals`
/// and `of_cuts` give the conductor at each interval and each cut.
fn held_parts(
    of_intervals: &[Option<u32>],
    of_cuts: &[Option<u32>],
    axis: &Axis,
) -> Vec<(Range<usize>, u32)> {
    let mut out: Vec<(Range<usize>, u32)> = Vec::new();
    for (m, conductor) in of_cuts.iter().enumerate() {
        if let Some(c) = conductor {
            out.push((axis.closed(m, m), *c));
        }
    }
    for (m, conductor) in of_intervals.iter().enumerate() {
        if let Some(c) = conductor {
            out.push((axis.closed(m, m + 1), *c));
        }
    }
    out
}

/// Numbers the unknowns: those at corners first, then those on sides, then those inside triangles.
fn numbering(mesh: &PlanMesh, degree: usize) -> Numbering {
    let points = mesh.points.len() as u32;
    let per_edge = degree as u32 - 1;
    let edges = mesh.edges.len() as u32;
    let rows = (0..=points).chain((1..=edges).map(|e| points + e * per_edge)).collect();
    let inner = (continuous_functions(degree) - 3 * degree) as u32;
    let first = points + edges * per_edge;
    let entities = mesh
        .triangles
        .iter()
        .zip(&mesh.sides)
        .map(|(corners, sides)| corners.iter().copied().chain(sides.iter().map(|e| points + e)).collect())
        .collect();
    Numbering {
        entities,
        rows,
        inner_rows: (0..=mesh.triangles.len() as u32).map(|t| first + t * inner).collect(),
        places: mesh.points.iter().copied().chain((0..mesh.edges.len()).map(|e| mesh.middle(e))).collect(),
    }
}

/// The matrices of a triangle, in a basis of its inner functions in which both are diagonal, and that basis.
fn local(
    integrals: &PotentialIntegrals,
    mesh: &PlanMesh,
    t: usize,
    degree: usize,
) -> Result<(Local, Mat<f64>), SolveError> {
    let (mass, stiffness) = integrals.on(&mesh.triangle(t)).map_err(|_| SolveError::Eigenvalues)?;
    let outer = 3 * degree;
    let inner = mass.nrows() - outer;
    let block =
        |m: &Mat<f64>, i: usize, j: usize, r: usize, c: usize| m.as_ref().submatrix(i, j, r, c).to_owned();
    let flat = |m: &Mat<f64>| -> Vec<f64> {
        (0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)])).collect()
    };
    let mut out = Local {
        outer,
        a: flat(&block(&stiffness, 0, 0, outer, outer)),
        m: flat(&block(&mass, 0, 0, outer, outer)),
        ..Local::default()
    };
    if inner > 0 {
        let failed = |_| SolveError::Eigenvalues;
        let factor = Llt::new(block(&mass, outer, outer, inner, inner).as_ref()).map_err(failed)?;
        let lower = factor.lower();
        let mut half = block(&stiffness, outer, outer, inner, inner);
        dense::solve_lower_triangular(lower, half.as_mut());
        let mut reduced = half.transpose().to_owned();
        dense::solve_lower_triangular(lower, reduced.as_mut());
        let (mut vectors, values) = dense::symmetric_eigenvectors(reduced.as_ref()).map_err(failed)?;
        dense::solve_upper_triangular(lower.transpose(), vectors.as_mut());
        let coupled =
            |m: &Mat<f64>| flat(&dense::product(block(m, 0, outer, outer, inner).as_ref(), vectors.as_ref()));
        out.a_inner = coupled(&stiffness);
        out.m_inner = coupled(&mass);
        out.inner = values;
        return Ok((out, vectors));
    }
    Ok((out, Mat::zeros(0, 0)))
}

/// For each row the factor that scales it in the preconditioner: the inverse root of the triangle's weight
/// for inner unknowns, 1 for the others. Empty if all weights are 1.
fn inner_scaling(numbering: &Numbering, weights: &[Option<f64>], rows: &[u32]) -> Vec<f64> {
    if weights.iter().flatten().all(|w| *w == 1.0) {
        return Vec::new();
    }
    let first = numbering.inner_rows[0];
    let mut t = 0;
    rows.iter()
        .map(|row| {
            if *row < first {
                return 1.0;
            }
            while numbering.inner_rows[t + 1] <= *row {
                t += 1;
            }
            weights[t].map_or(1.0, |w| 1.0 / w.sqrt())
        })
        .collect()
}

/// The profile of some triangles: their stiffness and mass, and the matrices of the line with it.
fn assembled(
    numbering: &Numbering,
    locals: &[Local],
    triangles: &[u32],
    line_mass: Dense<f64>,
    line_stiffness: Dense<f64>,
) -> Profile {
    let mut entries: Vec<Vec<(u32, f64, f64)>> = vec![Vec::new(); numbering.len()];
    for &t in triangles {
        let local = &locals[t as usize];
        let outer: Vec<u32> = numbering.entities[t as usize]
            .iter()
            .flat_map(|e| numbering.rows[*e as usize]..numbering.rows[*e as usize + 1])
            .collect();
        let inner = numbering.inner_rows[t as usize]..numbering.inner_rows[t as usize + 1];
        let n = local.outer;
        for (i, row) in outer.iter().enumerate() {
            let row_entries = &mut entries[*row as usize];
            row_entries
                .extend(outer.iter().enumerate().map(|(j, c)| (*c, local.a[i * n + j], local.m[i * n + j])));
            let count = inner.len();
            row_entries.extend(
                inner
                    .clone()
                    .enumerate()
                    .map(|(j, c)| (c, local.a_inner[i * count + j], local.m_inner[i * count + j])),
            );
        }
        for (j, row) in inner.clone().enumerate() {
            let row_entries = &mut entries[row as usize];
            let count = inner.len();
            row_entries.extend(
                outer
                    .iter()
                    .enumerate()
                    .map(|(i, c)| (*c, local.a_inner[i * count + j], local.m_inner[i * count + j])),
            );
            row_entries.push((row, local.inner[j], 1.0));
        }
    }
    let mut out = Profile {
        starts: vec![0],
        columns: Vec::new(),
        stiffness: Vec::new(),
        mass: Vec::new(),
        line_mass,
        line_stiffness,
    };
    for mut row in entries {
        row.sort_by_key(|(c, ..)| *c);
        for (c, k, m) in row {
            if out.columns.len() > out.starts[out.starts.len() - 1] && out.columns.last() == Some(&c) {
                let last = out.columns.len() - 1;
                out.stiffness[last] += k;
                out.mass[last] += m;
            } else {
                out.columns.push(c);
                out.stiffness.push(k);
                out.mass.push(m);
            }
        }
        out.starts.push(out.columns.len());
    }
    out
}

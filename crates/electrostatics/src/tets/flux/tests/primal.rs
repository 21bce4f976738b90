//! A small conforming finite-element solver of orders 1 to 3 for the potentials from which the tests compute
//! fluxes.
//!
//! It shares no code with [`crate::tets::potentials`], so that the two can be compared, and factorises its
//! matrix directly.

use super::super::reference::{EDGES, tetrahedron_rule, triangle_rule};
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use std::collections::HashMap;

/// Potentials of all states, one for each conductor.
pub(super) struct Primal {
    /// Upper bound on the Maxwell matrix over eps_0, m.
    pub(super) upper: Mat<f64>,
    /// The gradients, as `equilibrate` takes them.
    pub(super) gradients: Vec<Vec<[f64; 3]>>,
}

/// All functions of an order on a simplex with this many corners: how often each corner counts, `order` in
/// total.
fn multiples(order: usize, corners: usize) -> Vec<Vec<usize>> {
    if corners == 1 {
        return vec![vec![order]];
    }
    (0..=order)
        .flat_map(|first| {
            multiples(order - first, corners - 1).into_iter().map(move |mut rest| {
                rest.insert(0, first);
                rest
            })
        })
        .collect()
}

/// Value and derivatives by the barycentric coordinates `l` of the Lagrange polynomial of a function.
fn lagrange(order: usize, times: &[usize], l: &[f64]) -> (f64, Vec<f64>) {
    let p = order as f64;
    let one = |n: usize, x: f64| (0..n).map(|j| (p * x - j as f64) / (j as f64 + 1.0)).product::<f64>();
    let slope = |n: usize, x: f64| -> f64 {
        let rest = |k: usize| {
            (0..n).filter(|&j| j != k).map(|j| (p * x - j as f64) / (j as f64 + 1.0)).product::<f64>()
        };
        (0..n).map(|k| p / (k as f64 + 1.0) * rest(k)).sum()
    };
    let values: Vec<f64> = times.iter().zip(l).map(|(&n, &x)| one(n, x)).collect();
    let derivatives = (0..l.len())
        .map(|i| slope(times[i], l[i]) * (0..l.len()).filter(|&k| k != i).map(|k| values[k]).product::<f64>())
        .collect();
    (values.iter().product(), derivatives)
}

/// Rows r_i with r_i . v_j = (i == j), and the determinant of the v_j.
fn dual(v: [[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let rows = [cross(v[1], v[2]), cross(v[2], v[0]), cross(v[0], v[1])];
    let det = (0..3).map(|a| v[0][a] * rows[0][a]).sum::<f64>();
    (rows.map(|r| r.map(|x| x / det)), det)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The gradient from the derivatives by the barycentric coordinates and their gradients.
fn combine(derivatives: &[f64], rows: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|a| derivatives.iter().zip(rows).map(|(d, r)| d * r[a]).sum())
}

/// Derivatives of all functions by the barycentric coordinates at one point.
type Derivatives = Vec<Vec<f64>>;

/// Entries (row, column, value) of a matrix; equal places are added.
type Triplets = Vec<(usize, usize, f64)>;

/// Numbers of the functions: each is known by its corners, repeated as often as they count.
#[derive(Default)]
struct Numbers {
    known: HashMap<Vec<u32>, usize>,
}

impl Numbers {
    /// The numbers of `functions` on a tetrahedron or a face; new functions get the next numbers.
    fn of(&mut self, corners: &[u32], functions: &[Vec<usize>]) -> Vec<usize> {
        let number = |times: &Vec<usize>| {
            let mut key: Vec<u32> =
                corners.iter().zip(times).flat_map(|(&c, &n)| std::iter::repeat_n(c, n)).collect();
            key.sort_unstable();
            let next = self.known.len();
            *self.known.entry(key).or_insert(next)
        };
        functions.iter().map(number).collect()
    }
}

/// Gradients of the barycentric coordinates of a tetrahedron, 1/m, and six times its volume, m^3.
fn barycentric(mesh: &TetMesh, t: usize) -> ([[f64; 3]; 4], f64) {
    let at = mesh.tets[t].map(|p| mesh.points[p as usize]);
    let (rows, det) = dual([1, 2, 3].map(|k| [0, 1, 2].map(|a| at[k][a] - at[0][a])));
    let first = [0, 1, 2].map(|a| -rows[0][a] - rows[1][a] - rows[2][a]);
    ([first, rows[0], rows[1], rows[2]], det.abs())
}

/// The energy of the tetrahedra.
fn inside(mesh: &TetMesh, permittivity: &[f64], order: usize, numbers: &mut Numbers) -> Triplets {
    let functions = multiples(order, 4);
    let volume: Vec<(f64, Derivatives)> = tetrahedron_rule()
        .iter()
        .map(|&(x, w)| {
            let l = [1.0 - x[0] - x[1] - x[2], x[0], x[1], x[2]];
            (w, functions.iter().map(|f| lagrange(order, f, &l).1).collect())
        })
        .collect();
    let mut triplets = Vec::new();
    for t in 0..mesh.tets.len() {
        let eps = permittivity[mesh.regions[t] as usize];
        let (rows, det) = barycentric(mesh, t);
        let dofs = numbers.of(&mesh.tets[t], &functions);
        let mut local = vec![0.0; dofs.len() * dofs.len()];
        for (w, derivatives) in &volume {
            let g: Vec<_> = derivatives.iter().map(|d| combine(d, &rows)).collect();
            for i in 0..dofs.len() {
                for j in 0..dofs.len() {
                    local[i * dofs.len() + j] += w * det * eps * dot(g[i], g[j]);
                }
            }
        }
        for i in 0..dofs.len() {
            for j in 0..dofs.len() {
                triplets.push((dofs[i], dofs[j], local[i * dofs.len() + j]));
            }
        }
    }
    triplets
}

/// The energy of open space beyond one face, where u(c + t x) = g(x) / t: the gradient w of u at t = 1 has w
/// . x = -g and falls off with t^-2.
fn beyond(mesh: &TetMesh, face: [u32; 3], eps: f64, order: usize, dofs: &[usize]) -> Triplets {
    let flat = multiples(order, 3);
    let at = face.map(|p| mesh.points[p as usize]);
    let edges = [1, 2].map(|k| [0, 1, 2].map(|a| at[k][a] - at[0][a]));
    let mut triplets = Vec::new();
    for (p, weight) in triangle_rule() {
        let x = [0, 1, 2].map(|a| at[0][a] + p[0] * edges[0][a] + p[1] * edges[1][a] - mesh.center[a]);
        let (rows, det) = dual([x, edges[0], edges[1]]);
        let w: Vec<[f64; 3]> = flat
            .iter()
            .map(|f| {
                let (value, d) = lagrange(order, f, &[1.0 - p[0] - p[1], p[0], p[1]]);
                combine(&[-value, d[1] - d[0], d[2] - d[0]], &rows)
            })
            .collect();
        for i in 0..dofs.len() {
            for j in 0..dofs.len() {
                triplets.push((dofs[i], dofs[j], weight * det.abs() * eps * dot(w[i], w[j])));
            }
        }
    }
    triplets
}

/// The potentials of minimal energy: one column of coefficients per conductor. `held` has the functions that
/// are prescribed, each with the conductor that holds it (at 1 V in the state of that conductor), or `None`
/// for the ground.
fn minimise(
    triplets: &Triplets,
    held: &HashMap<usize, Option<usize>>,
    total: usize,
    conductors: usize,
) -> Mat<f64> {
    let mut u = Mat::<f64>::zeros(total, conductors);
    for (&n, &on) in held {
        if let Some(c) = on {
            u[(n, c)] = 1.0;
        }
    }
    let mut unknown = vec![usize::MAX; total];
    let mut count = 0;
    for n in (0..total).filter(|n| !held.contains_key(n)) {
        unknown[n] = count;
        count += 1;
    }
    let mut right = Mat::<f64>::zeros(count, conductors);
    let mut inner = Vec::new();
    for &(i, j, a) in triplets.iter().filter(|t| unknown[t.0] != usize::MAX) {
        if unknown[j] == usize::MAX {
            for c in 0..conductors {
                right[(unknown[i], c)] -= a * u[(j, c)];
            }
        } else {
            inner.push(Triplet::new(unknown[i], unknown[j], a));
        }
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &inner).unwrap();
    let x = matrix.sp_cholesky(Side::Lower).unwrap().solve(&right);
    for n in (0..total).filter(|&n| unknown[n] != usize::MAX) {
        for c in 0..conductors {
            u[(n, c)] = x[(unknown[n], c)];
        }
    }
    u
}

/// Gradients of all states, as `equilibrate` takes them.
fn gradients(mesh: &TetMesh, order: usize, numbers: &mut Numbers, u: &Mat<f64>) -> Vec<Vec<[f64; 3]>> {
    let functions = multiples(order, 4);
    let mut nodes: Vec<[f64; 4]> = match order {
        1 => vec![[0.25; 4]],
        _ => (0..4).map(|i| [0, 1, 2, 3].map(|k| f64::from(u8::from(k == i)))).collect(),
    };
    if order == 3 {
        nodes.extend(EDGES.map(|[i, j]| [0, 1, 2, 3].map(|k| if k == i || k == j { 0.5 } else { 0.0 })));
    }
    let tables: Vec<Derivatives> =
        nodes.iter().map(|l| functions.iter().map(|f| lagrange(order, f, l).1).collect()).collect();
    let mut gradients = vec![Vec::new(); u.ncols()];
    for t in 0..mesh.tets.len() {
        let (rows, _) = barycentric(mesh, t);
        let dofs = numbers.of(&mesh.tets[t], &functions);
        for (c, list) in gradients.iter_mut().enumerate() {
            for table in &tables {
                let mut g = [0.0; 3];
                for (d, &n) in table.iter().zip(&dofs) {
                    let one = combine(d, &rows);
                    (0..3).for_each(|a| g[a] += u[(n, c)] * one[a]);
                }
                list.push(g);
            }
        }
    }
    gradients
}

/// Solves for 1 V on each conductor in turn.
pub(super) fn solve(mesh: &TetMesh, permittivity: &[f64], order: usize) -> Primal {
    let mut numbers = Numbers::default();
    let mut triplets = inside(mesh, permittivity, order, &mut numbers);
    let flat = multiples(order, 3);
    let mut held: HashMap<usize, Option<usize>> = HashMap::new();
    let mut conductors = 0;
    for boundary in &mesh.boundary {
        let dofs = numbers.of(&boundary.face, &flat);
        match boundary.role {
            FaceRole::Conductor(c) => {
                conductors = conductors.max(c as usize + 1);
                dofs.iter().for_each(|&n| _ = held.insert(n, Some(c as usize)));
            }
            FaceRole::Grounded => dofs.iter().for_each(|&n| _ = held.insert(n, None)),
            FaceRole::Open { permittivity: [_, eps] } => {
                triplets.extend(beyond(mesh, boundary.face, eps, order, &dofs));
            }
        }
    }
    let u = minimise(&triplets, &held, numbers.known.len(), conductors);
    let mut upper = Mat::zeros(conductors, conductors);
    for &(i, j, a) in &triplets {
        for c in 0..conductors {
            for d in 0..conductors {
                upper[(c, d)] += u[(i, c)] * a * u[(j, d)];
            }
        }
    }
    let gradients = gradients(mesh, order, &mut numbers, &u);
    Primal { upper, gradients }
}

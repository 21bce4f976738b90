//! A small conforming solver of orders 1 to 3, to have potentials to make fluxes of.

use super::super::reference::{EDGES, tetrahedron_rule, triangle_rule};
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use std::collections::HashMap;

/// Potentials of all states, one for each conductor.
pub(super) struct Primal {
    /// Upper bound on the Maxwell matrix, over eps_0.
    pub(super) upper: Mat<f64>,
    /// As `equilibrate` takes them.
    pub(super) gradients: Vec<Vec<[f64; 3]>>,
}

/// Functions of an order: how often each corner is counted.
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

/// Lagrange's polynomial of a function and its derivatives by the barycentric coordinates.
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

/// Rows r_i with r_i . v_j = (i == j).
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

/// Function times gradients.
fn combine(derivatives: &[f64], rows: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|a| derivatives.iter().zip(rows).map(|(d, r)| d * r[a]).sum())
}

/// Solves for unit potentials of all conductors.
pub(super) fn solve(mesh: &TetMesh, permittivity: &[f64], order: usize) -> Primal {
    let mut numbers: HashMap<Vec<u32>, usize> = HashMap::new();
    let mut number = |corners: &[u32], times: &[usize]| {
        let mut key: Vec<u32> =
            corners.iter().zip(times).flat_map(|(&c, &n)| std::iter::repeat_n(c, n)).collect();
        key.sort_unstable();
        let next = numbers.len();
        *numbers.entry(key).or_insert(next)
    };
    let functions = multiples(order, 4);
    let flat = multiples(order, 3);
    let mut triplets = Vec::new();
    let volume: Vec<_> = tetrahedron_rule()
        .iter()
        .map(|&(x, w)| {
            let l = [1.0 - x[0] - x[1] - x[2], x[0], x[1], x[2]];
            (w, functions.iter().map(|f| lagrange(order, f, &l).1).collect::<Vec<_>>())
        })
        .collect();
    let rows_of = |t: usize| {
        let at = mesh.tets[t].map(|p| mesh.points[p as usize]);
        let (rows, det) = dual([1, 2, 3].map(|k| [0, 1, 2].map(|a| at[k][a] - at[0][a])));
        let first = [0, 1, 2].map(|a| -rows[0][a] - rows[1][a] - rows[2][a]);
        ([first, rows[0], rows[1], rows[2]], det.abs())
    };
    for t in 0..mesh.tets.len() {
        let eps = permittivity[mesh.regions[t] as usize];
        let (rows, det) = rows_of(t);
        let own: Vec<usize> = functions.iter().map(|f| number(&mesh.tets[t], f)).collect();
        let mut local = vec![0.0; own.len() * own.len()];
        for (w, derivatives) in &volume {
            let g: Vec<_> = derivatives.iter().map(|d| combine(d, &rows)).collect();
            for i in 0..own.len() {
                for j in 0..own.len() {
                    local[i * own.len() + j] += w * det * eps * dot(g[i], g[j]);
                }
            }
        }
        for i in 0..own.len() {
            for j in 0..own.len() {
                triplets.push((own[i], own[j], local[i * own.len() + j]));
            }
        }
    }
    let mut held: HashMap<usize, Option<usize>> = HashMap::new();
    let mut conductors = 0;
    for boundary in &mesh.boundary {
        let own: Vec<usize> = flat.iter().map(|f| number(&boundary.face, f)).collect();
        match boundary.role {
            FaceRole::Conductor(c) => {
                conductors = conductors.max(c as usize + 1);
                own.iter().for_each(|&n| _ = held.insert(n, Some(c as usize)));
            }
            FaceRole::Grounded => own.iter().for_each(|&n| _ = held.insert(n, None)),
            FaceRole::Open { permittivity: [_, eps] } => {
                // u(c + t x) = g(x) / t: its gradient w at t = 1 has w . x = -g and falls off with t^-2.
                let at = boundary.face.map(|p| mesh.points[p as usize]);
                let edges = [1, 2].map(|k| [0, 1, 2].map(|a| at[k][a] - at[0][a]));
                for (p, weight) in triangle_rule() {
                    let x = [0, 1, 2]
                        .map(|a| at[0][a] + p[0] * edges[0][a] + p[1] * edges[1][a] - mesh.center[a]);
                    let (rows, det) = dual([x, edges[0], edges[1]]);
                    let w: Vec<[f64; 3]> = flat
                        .iter()
                        .map(|f| {
                            let (value, d) = lagrange(order, f, &[1.0 - p[0] - p[1], p[0], p[1]]);
                            combine(&[-value, d[1] - d[0], d[2] - d[0]], &rows)
                        })
                        .collect();
                    for i in 0..own.len() {
                        for j in 0..own.len() {
                            triplets.push((own[i], own[j], weight * det.abs() * eps * dot(w[i], w[j])));
                        }
                    }
                }
            }
        }
    }
    let total = numbers.len();
    let number = |corners: &[u32], times: &[usize]| {
        let mut key: Vec<u32> =
            corners.iter().zip(times).flat_map(|(&c, &n)| std::iter::repeat_n(c, n)).collect();
        key.sort_unstable();
        numbers[&key]
    };
    let mut u = Mat::<f64>::zeros(total, conductors);
    for (&n, &on) in &held {
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
    let mut upper = Mat::zeros(conductors, conductors);
    for &(i, j, a) in &triplets {
        for c in 0..conductors {
            for d in 0..conductors {
                upper[(c, d)] += u[(i, c)] * a * u[(j, d)];
            }
        }
    }
    let mut nodes: Vec<[f64; 4]> = match order {
        1 => vec![[0.25; 4]],
        _ => (0..4).map(|i| [0, 1, 2, 3].map(|k| f64::from(u8::from(k == i)))).collect(),
    };
    if order == 3 {
        nodes.extend(EDGES.map(|[i, j]| [0, 1, 2, 3].map(|k| if k == i || k == j { 0.5 } else { 0.0 })));
    }
    let tables: Vec<Vec<Vec<f64>>> =
        nodes.iter().map(|l| functions.iter().map(|f| lagrange(order, f, l).1).collect()).collect();
    let mut gradients = vec![Vec::new(); conductors];
    for t in 0..mesh.tets.len() {
        let (rows, _) = rows_of(t);
        let own: Vec<usize> = functions.iter().map(|f| number(&mesh.tets[t], f)).collect();
        for (c, list) in gradients.iter_mut().enumerate() {
            for table in &tables {
                let mut g = [0.0; 3];
                for (d, &n) in table.iter().zip(&own) {
                    let one = combine(d, &rows);
                    (0..3).for_each(|a| g[a] += u[(n, c)] * one[a]);
                }
                list.push(g);
            }
        }
    }
    Primal { upper, gradients }
}

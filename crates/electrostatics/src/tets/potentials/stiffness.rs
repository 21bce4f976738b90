//! The energy form on a mesh: tetrahedra, and faces to open space.
//!
//! # Open space
//! Beyond a face, at y = x t with x on the face (from the centre) and t >= 1, the potential continues as u(y)
//! = g(x) / t. The face has the unit normal n and the distance d = n x from the centre, so that dy = d t^2 dt
//! dS. Along the face t grad_tau u = grad_tau g / t; along the ray x grad u = -g / t^2, hence d n grad u =
//! -(g + x grad_tau g) / t^2. With the integral of t^2 t^-4 over t being 1, the energy beyond is d times the
//! integral over the face of |grad_tau g|^2 + (g + x grad_tau g)^2 / d^2. The largest permittivity along the
//! rays keeps it an upper bound.

use super::reference::{MAX_FUNCTIONS, PAIRS, Reference, lattice, shape, triangle_rule};
use super::space::{NONE, Space};
use crate::error::PotentialError;
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use elastocap_linalg::sparse::{Rows, SparseMatrix};
use elastocap_linalg::vector::{cross, dot, minus};
use faer::Mat;
use rayon::prelude::*;

/// The parts of the energy form.
#[derive(Debug, Clone)]
pub(super) struct Stiffness {
    reference: Reference,
    /// eps det(J) J^-1 J^-T of each tetrahedron, as [`PAIRS`] lists it.
    metrics: Vec<[f64; 6]>,
    /// The faces to open space.
    open: Vec<OpenFace>,
}

/// The energy beyond a face to open space.
#[derive(Debug, Clone)]
struct OpenFace {
    /// The functions on the face.
    dofs: Vec<u32>,
    /// The form of the energy in these functions, row by row.
    matrix: Vec<f64>,
}

/// The equations of the unknowns.
pub(super) struct System {
    /// The matrix between the unknowns.
    pub(super) matrix: SparseMatrix,
    /// The matrix between the unknowns (rows) and the held functions; it has a column for every function.
    pub(super) held: SparseMatrix,
}

impl Stiffness {
    /// Computes the parts of the form for the functions of a space.
    pub(super) fn new(mesh: &TetMesh, permittivity: &[f64], space: &Space) -> Result<Self, PotentialError> {
        let metric = |t: usize| {
            let eps =
                *permittivity.get(mesh.regions[t] as usize).ok_or(PotentialError::Region(mesh.regions[t]))?;
            let (gradients, determinant) = barycentric_gradients(mesh, t);
            if determinant.is_nan() || determinant <= 0.0 || !determinant.is_finite() {
                return Err(PotentialError::Flat(t));
            }
            Ok(PAIRS.map(|[a, b]| eps * determinant * dot(gradients[a], gradients[b])))
        };
        let metrics =
            (0..mesh.tets.len()).into_par_iter().with_min_len(1024).map(metric).collect::<Result<_, _>>()?;
        let faces: Vec<([u32; 3], f64)> = mesh
            .boundary
            .iter()
            .filter_map(|f| match f.role {
                FaceRole::Open { permittivity } => Some((f.face, permittivity[1])),
                FaceRole::Conductor(_) | FaceRole::Grounded => None,
            })
            .map(|(mut face, eps)| {
                face.sort_unstable();
                (face, eps)
            })
            .collect();
        let corners: Vec<[u32; 3]> = faces.iter().map(|f| f.0).collect();
        let open = faces
            .iter()
            .zip(space.of_faces(&corners)?)
            .map(|(&(face, eps), dofs)| {
                let from_center = face.map(|p| minus(mesh.points[p as usize], mesh.center));
                let matrix =
                    open_matrix(from_center, eps, space.order()).ok_or(PotentialError::OpenFace(face))?;
                Ok(OpenFace { dofs, matrix })
            })
            .collect::<Result<_, PotentialError>>()?;
        Ok(Self { reference: Reference::new(space.order()), metrics, open })
    }

    /// Assembles the equations row by row: no two threads write to one row, and sums do not depend on the
    /// number of threads.
    pub(super) fn assemble(&self, space: &Space) -> System {
        let n = self.reference.functions;
        let of_tets = incidence(space.dofs(), space.functions());
        let open_dofs: Vec<u32> = self.open.iter().flat_map(|f| f.dofs.iter().copied()).collect();
        let of_open = incidence(&open_dofs, space.functions());
        let free: Vec<u32> =
            (0..space.functions() as u32).filter(|&d| space.unknown()[d as usize] != NONE).collect();
        let task = |rows: &[u32]| {
            let (mut parts, mut terms) = ([Rows::default(), Rows::default()], [Vec::new(), Vec::new()]);
            let mut row = [0.0; MAX_FUNCTIONS];
            for &dof in rows {
                let mut add = |column: u32, value: f64| match space.unknown()[column as usize] {
                    NONE => terms[1].push((column, value)),
                    unknown => terms[0].push((unknown, value)),
                };
                for &place in of_tets.of(dof) {
                    let (t, i) = (place as usize / n, place as usize % n);
                    self.reference.row(i, &self.metrics[t], &mut row);
                    for (&column, value) in space.dofs()[t * n..(t + 1) * n].iter().zip(row) {
                        add(column, value);
                    }
                }
                for &place in of_open.of(dof) {
                    let m = lattice_size(space.order());
                    let (face, i) = (&self.open[place as usize / m], place as usize % m);
                    for (&column, &value) in face.dofs.iter().zip(&face.matrix[i * m..(i + 1) * m]) {
                        add(column, value);
                    }
                }
                parts[0].push(&mut terms[0]);
                parts[1].push(&mut terms[1]);
            }
            parts
        };
        let parts: Vec<[Rows; 2]> = free.par_chunks(4096).map(task).collect();
        let (inner, held) = parts.into_iter().map(|[a, b]| (a, b)).unzip();
        System {
            matrix: SparseMatrix::from_rows(free.len(), inner),
            held: SparseMatrix::from_rows(space.functions(), held),
        }
    }

    /// The energy form of each two potentials, m. Differences to the first corner are taken first, so that a
    /// common constant does not cost accuracy.
    pub(super) fn energies(&self, space: &Space, potentials: &[Vec<f64>]) -> Mat<f64> {
        let (n, k) = (self.reference.functions, potentials.len());
        let of_tets = |first: usize, metrics: &[[f64; 6]]| {
            let mut sums = vec![0.0; k * k];
            let (mut row, mut local) = ([0.0; MAX_FUNCTIONS], vec![[0.0; MAX_FUNCTIONS]; k]);
            for (t, metric) in metrics.iter().enumerate() {
                let dofs = &space.dofs()[(first + t) * n..(first + t + 1) * n];
                for (local, u) in local.iter_mut().zip(potentials) {
                    for (l, &d) in local.iter_mut().zip(dofs) {
                        *l = u[d as usize] - u[dofs[0] as usize];
                    }
                }
                for i in 1..n {
                    self.reference.row(i, metric, &mut row);
                    for b in 0..k {
                        let product: f64 = row[..n].iter().zip(&local[b][..n]).map(|(r, u)| r * u).sum();
                        for a in 0..=b {
                            sums[a * k + b] += local[a][i] * product;
                        }
                    }
                }
            }
            sums
        };
        let parts: Vec<Vec<f64>> =
            self.metrics.par_chunks(4096).enumerate().map(|(c, m)| of_tets(c * 4096, m)).collect();
        let mut total = Mat::zeros(k, k);
        for b in 0..k {
            for a in 0..=b {
                let inside: f64 = parts.iter().map(|p| p[a * k + b]).sum();
                let beyond: f64 = self.open.iter().map(|f| f.product(&potentials[a], &potentials[b])).sum();
                total[(a, b)] = inside + beyond;
                total[(b, a)] = inside + beyond;
            }
        }
        total
    }

    /// Gradients of a potential on each tetrahedron, at its lattice points of order p - 1.
    pub(super) fn gradients(&self, mesh: &TetMesh, space: &Space, u: &[f64]) -> Vec<[f64; 3]> {
        let (n, lattice) = (self.reference.functions, &self.reference.gradients);
        let mut gradients = vec![[0.0; 3]; mesh.tets.len() * lattice.len()];
        gradients.par_chunks_mut(lattice.len()).enumerate().with_min_len(1024).for_each(|(t, out)| {
            let dofs = &space.dofs()[t * n..(t + 1) * n];
            let (barycentric, _) = barycentric_gradients(mesh, t);
            for (out, slopes) in out.iter_mut().zip(lattice) {
                let mut by = [0.0; 3];
                for (&d, slope) in dofs.iter().zip(slopes) {
                    let difference = u[d as usize] - u[dofs[0] as usize];
                    for a in 0..3 {
                        by[a] += slope[a] * difference;
                    }
                }
                *out = [0, 1, 2].map(|x| (0..3).map(|a| by[a] * barycentric[a][x]).sum());
            }
        });
        gradients
    }
}

impl OpenFace {
    /// The form of two potentials.
    fn product(&self, u: &[f64], v: &[f64]) -> f64 {
        let n = self.dofs.len();
        let row = |i: usize| -> f64 {
            self.dofs.iter().zip(&self.matrix[i * n..]).map(|(&d, m)| m * v[d as usize]).sum()
        };
        self.dofs.iter().enumerate().map(|(i, &d)| u[d as usize] * row(i)).sum()
    }
}

/// The number of functions on a face.
fn lattice_size(order: usize) -> usize {
    (order + 1) * (order + 2) / 2
}

/// The form beyond a face with these corners, seen from the centre; `None` if the centre is in the plane of
/// the face.
fn open_matrix(corners: [[f64; 3]; 3], eps: f64, order: usize) -> Option<Vec<f64>> {
    let (u, v) = (minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    let normal = cross(u, v);
    let twice_area = dot(normal, normal).sqrt();
    let distance = dot(normal, corners[0]).abs() / twice_area;
    if distance.is_nan() || distance <= 0.0 || !distance.is_finite() {
        return None;
    }
    // Gradients along the face of its barycentric coordinates.
    let unit = normal.map(|x| x / twice_area);
    let slope =
        |from: usize, to: usize| cross(unit, minus(corners[to], corners[from])).map(|x| x / twice_area);
    let gradients = [slope(1, 2), slope(2, 0), slope(0, 1)];
    let points = lattice(order, 3);
    let n = points.len();
    let mut matrix = vec![0.0; n * n];
    for (at, weight) in triangle_rule() {
        let x = [0, 1, 2].map(|a| (0..3).map(|k| at[k] * corners[k][a]).sum::<f64>());
        let of_point = |&point: &[u8; 4]| {
            let (value, by) = shape(order, point, at);
            let along = [0, 1, 2].map(|a| (0..3).map(|k| by[k] * gradients[k][a]).sum::<f64>());
            (along, (value + dot(along, x)) / distance)
        };
        let values: Vec<([f64; 3], f64)> = points.iter().map(of_point).collect();
        for (i, a) in values.iter().enumerate() {
            for (j, b) in values.iter().enumerate() {
                let integrand = dot(a.0, b.0) + a.1 * b.1;
                matrix[i * n + j] += eps * distance * 0.5 * twice_area * weight * integrand;
            }
        }
    }
    Some(matrix)
}

/// Gradients of the barycentric coordinates 1, 2, 3, and six times the volume.
fn barycentric_gradients(mesh: &TetMesh, t: usize) -> ([[f64; 3]; 3], f64) {
    let [o, a, b, c] = mesh.tets[t].map(|p| mesh.points[p as usize]);
    let (u, v, w) = (minus(a, o), minus(b, o), minus(c, o));
    let determinant = dot(u, cross(v, w));
    ([cross(v, w), cross(w, u), cross(u, v)].map(|g| g.map(|x| x / determinant)), determinant)
}

/// For each function its places in a list of functions.
struct Incidence {
    /// For each function the index in `place` at which its places begin; then the length of `place`.
    start: Vec<u32>,
    /// The places, function after function.
    place: Vec<u32>,
}

impl Incidence {
    /// The places of a function.
    fn of(&self, dof: u32) -> &[u32] {
        &self.place[self.start[dof as usize] as usize..self.start[dof as usize + 1] as usize]
    }
}

/// The places of each function in the list `dofs`.
fn incidence(dofs: &[u32], functions: usize) -> Incidence {
    let mut start = vec![0_u32; functions + 1];
    for &d in dofs {
        start[d as usize + 1] += 1;
    }
    for k in 0..functions {
        start[k + 1] += start[k];
    }
    let mut next = start.clone();
    let mut place = vec![0; dofs.len()];
    for (at, &d) in dofs.iter().enumerate() {
        place[next[d as usize] as usize] = at as u32;
        next[d as usize] += 1;
    }
    Incidence { start, place }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_fem::quadrature::gauss_legendre;

    #[test]
    fn the_form_of_a_face_to_open_space_is_the_energy_beyond_it() {
        // A face aslant, seen from the origin; u(y) = g(x) / t, its gradient by differences, integrated over
        // s = 1 / t.
        let corners = [[1.0, 0.2, -0.1], [0.3, 1.1, 0.2], [0.4, 0.3, 1.3]];
        let (u, v) = (minus(corners[1], corners[0]), minus(corners[2], corners[0]));
        let normal = cross(u, v);
        let area = 0.5 * dot(normal, normal).sqrt();
        let (s, w) = gauss_legendre(3);
        for order in 1..=3 {
            let points = lattice(order, 3);
            let values: Vec<f64> = (0..points.len()).map(|k| (1.0 + 2.3 * k as f64).sin() + 0.5).collect();
            let potential = |y: [f64; 3]| {
                let t = dot(normal, y) / dot(normal, corners[0]);
                let x = y.map(|y| y / t);
                // Barycentric coordinates by areas.
                let area_ratio = |a: [f64; 3], b: [f64; 3]| {
                    dot(normal, cross(minus(a, x), minus(b, x))) / dot(normal, normal)
                };
                let at = [
                    area_ratio(corners[1], corners[2]),
                    area_ratio(corners[2], corners[0]),
                    area_ratio(corners[0], corners[1]),
                    0.0,
                ];
                points.iter().zip(&values).map(|(&p, g)| shape(order, p, at).0 * g).sum::<f64>() / t
            };
            let mut energy = 0.0;
            for (at, weight) in triangle_rule() {
                let x = [0, 1, 2].map(|a| (0..3).map(|k| at[k] * corners[k][a]).sum::<f64>());
                for (s, w) in s.iter().zip(&w) {
                    let t = 2.0 / (1.0 + s);
                    let slope = |a: usize| {
                        let (mut low, mut high) = (x.map(|x| t * x), x.map(|x| t * x));
                        low[a] -= 1e-4;
                        high[a] += 1e-4;
                        (potential(high) - potential(low)) / 2e-4
                    };
                    let square: f64 = (0..3).map(|a| slope(a).powi(2)).sum();
                    let distance = dot(normal, corners[0]) / (2.0 * area);
                    // dy = d t^2 dt dS, dt = t^2 ds.
                    energy += 7.0 * distance * area * weight * 0.5 * w * t.powi(4) * square;
                }
            }
            let matrix = open_matrix(corners, 7.0, order).unwrap();
            let n = values.len();
            let form: f64 = (0..n * n).map(|k| values[k / n] * matrix[k] * values[k % n]).sum();
            assert!((form / energy - 1.0).abs() < 1e-6, "{form} {energy}");
        }
        assert!(open_matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0]], 1.0, 2).is_none());
    }
}

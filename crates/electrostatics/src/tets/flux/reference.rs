//! Raviart-Thomas fluxes on the unit tetrahedron, in a basis in which their divergence can be read off.
//!
//! Corner 0 is the origin, corner 1 + a lies on axis a, face i is opposite corner i. A flux is carried to a
//! tetrahedron with Jacobian J by Piola's map, `sigma = J s / |det J|`, which preserves the flux through
//! every face and the total divergence. Three groups of functions follow one another:
//!
//! * for each face its moments against orthonormal polynomials (the first is constant), of constant
//!   divergence;
//! * for each polynomial but the constant one a flux with that divergence and none through the faces;
//! * loops: no divergence, and none through the faces (three for quadratics, none below).

use elastocap_fem::quadrature::gauss_legendre;
use elastocap_linalg::dense::Lu;
use elastocap_linalg::vector::dot;
use faer::Mat;

/// Tables of the unit tetrahedron for one degree.
#[derive(Debug)]
pub(super) struct Reference {
    /// Number of moments per face.
    pub(super) on_face: usize,
    /// Number of functions of the second group.
    pub(super) sources: usize,
    /// Number of functions of the third group.
    pub(super) loops: usize,
    /// Number of nodes of a polynomial of the same degree.
    pub(super) nodes: usize,
    /// Products of the functions by pairs of components 00, 11, 22, 01, 02, 12 (the mixed ones added both
    /// ways), each `size() x size()`.
    pub(super) mass: [Vec<f64>; 6],
    /// Coefficients of the flux with given nodal values: `size() x 3 nodes`, component by component within a
    /// node.
    pub(super) interpolation: Vec<f64>,
    /// Per corner: the face moments of the same flux times the corner's hat function, `4 on_face x 3 nodes`.
    pub(super) hat_moments: [Vec<f64>; 4],
    /// Per corner: moments of hat times divergence against the second group's polynomials, `sources x 3
    /// nodes`.
    pub(super) hat_sources: [Vec<f64>; 4],
    /// Per corner: sqrt(2) times the integral of grad hat . flux, `3 nodes`.
    pub(super) hat_supply: [Vec<f64>; 4],
    /// Integrals of q_i q_j times the barycentric products 00, 11, 22, 01, 02, 12 (mixed ones doubled) over
    /// the unit triangle, each `on_face x on_face`.
    pub(super) face_mass: [Vec<f64>; 6],
}

/// Pairs of components in the order of the tables.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// Edges in the order of the nodes of quadratics.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Corners of face `i`, ascending.
pub(super) fn corners_of_face(i: usize) -> [usize; 3] {
    [0, 1, 2].map(|k| if k < i { k } else { k + 1 })
}

/// Points per direction. Rules are exact to degree 9: collapsing a cube to a tetrahedron takes two of the 11
/// degrees that six Gauss points integrate.
const POINTS: usize = 6;

/// Gradients of the barycentric coordinates.
const GRADIENTS: [[f64; 3]; 4] = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Middle of the unit tetrahedron: monomials are taken around it.
const MIDDLE: f64 = 0.25;

/// The barycentric coordinates of a point.
fn barycentric(x: [f64; 3]) -> [f64; 4] {
    [1.0 - x[0] - x[1] - x[2], x[0], x[1], x[2]]
}

/// Points and weights on the unit triangle.
pub(super) fn triangle_rule() -> Vec<([f64; 2], f64)> {
    let (x, w) = gauss_legendre(POINTS);
    let mut rule = Vec::new();
    for i in 0..POINTS {
        for j in 0..POINTS {
            let (s, t) = (0.5 * (1.0 + x[i]), 0.5 * (1.0 + x[j]));
            rule.push(([s, t * (1.0 - s)], 0.25 * w[i] * w[j] * (1.0 - s)));
        }
    }
    rule
}

/// Points and weights in the unit tetrahedron.
pub(super) fn tetrahedron_rule() -> Vec<([f64; 3], f64)> {
    let (x, w) = gauss_legendre(POINTS);
    let mut rule = Vec::new();
    for ([s, t], weight) in triangle_rule() {
        for k in 0..POINTS {
            let rest = 1.0 - s - t;
            rule.push(([s, t, 0.5 * (1.0 + x[k]) * rest], 0.5 * w[k] * weight * rest));
        }
    }
    rule
}

/// Exponents of the monomials of three variables up to a degree, by degree.
fn exponents(degree: usize) -> Vec<[i32; 3]> {
    let mut exponents = Vec::new();
    for total in 0..=degree as i32 {
        for i in 0..=total {
            for j in 0..=total - i {
                exponents.push([total - i - j, i, j]);
            }
        }
    }
    exponents
}

/// The monomial with these exponents, in the coordinates relative to the middle.
fn monomial(e: [i32; 3], x: [f64; 3]) -> f64 {
    (0..3).map(|a| (x[a] - MIDDLE).powi(e[a])).product()
}

/// The gradient of [`monomial`].
fn monomial_gradient(e: [i32; 3], x: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|a| {
        let mut lower = e;
        lower[a] -= 1;
        if e[a] == 0 { 0.0 } else { f64::from(e[a]) * monomial(lower, x) }
    })
}

/// Values of `raw` functions at points (`points x raw`), made orthonormal one after the other.
fn orthonormal(mut values: Vec<Vec<f64>>, weights: &[f64]) -> Vec<Vec<f64>> {
    let count = values.first().map_or(0, Vec::len);
    let product = |v: &[Vec<f64>], i: usize, j: usize| -> f64 {
        v.iter().zip(weights).map(|(v, w)| w * v[i] * v[j]).sum()
    };
    for i in 0..count {
        // Twice is enough for orthogonality to rounding.
        for _ in 0..2 {
            for j in 0..i {
                let share = product(&values, i, j);
                values.iter_mut().for_each(|v| v[i] -= share * v[j]);
            }
        }
        let norm = product(&values, i, i).sqrt();
        values.iter_mut().for_each(|v| v[i] /= norm);
    }
    values
}

/// Nodal functions of a degree at a point, and their gradients.
fn nodal(degree: usize, x: [f64; 3]) -> Vec<(f64, [f64; 3])> {
    let l = barycentric(x);
    let scaled = |f: f64, i: usize| GRADIENTS[i].map(|g| f * g);
    match degree {
        0 => vec![(1.0, [0.0; 3])],
        1 => (0..4).map(|i| (l[i], GRADIENTS[i])).collect(),
        _ => {
            let corner = (0..4).map(|i| (l[i] * (2.0 * l[i] - 1.0), scaled(4.0 * l[i] - 1.0, i)));
            let edge = EDGES.iter().map(|&[i, j]| {
                let (a, b) = (scaled(4.0 * l[j], i), scaled(4.0 * l[i], j));
                (4.0 * l[i] * l[j], [0, 1, 2].map(|c| a[c] + b[c]))
            });
            corner.chain(edge).collect()
        }
    }
}

/// The functions from which the basis is formed: value and divergence at a point.
fn raw(degree: usize, x: [f64; 3]) -> Vec<([f64; 3], f64)> {
    let mut functions = Vec::new();
    for e in exponents(degree) {
        let (value, gradient) = (monomial(e, x), monomial_gradient(e, x));
        for a in 0..3 {
            let mut vector = [0.0; 3];
            vector[a] = value;
            functions.push((vector, gradient[a]));
        }
    }
    for e in exponents(degree).into_iter().filter(|e| e.iter().sum::<i32>() == degree as i32) {
        let value = monomial(e, x);
        functions.push((x.map(|x| (x - MIDDLE) * value), (degree as f64 + 3.0) * value));
    }
    functions
}

/// A vector field and its divergence at the points of the rules.
struct Field {
    /// The vector and its divergence at each point in the tetrahedron.
    volume: Vec<([f64; 3], f64)>,
    /// The vector at each point of each face.
    faces: [Vec<[f64; 3]>; 4],
}

/// Points, weights and test polynomials of the functionals that fix a flux.
struct Functionals {
    degree: usize,
    /// Points and weights in the tetrahedron.
    volume: Vec<([f64; 3], f64)>,
    /// Points and weights on the unit triangle.
    triangle: Vec<([f64; 2], f64)>,
    /// The orthonormal polynomials of a face at each point of `triangle`.
    on_face: Vec<Vec<f64>>,
    /// The orthonormal polynomials of the tetrahedron at each point of `volume`.
    inside: Vec<Vec<f64>>,
}

impl Functionals {
    /// The functionals for fluxes of a degree.
    fn new(degree: usize) -> Functionals {
        let (volume, triangle) = (tetrahedron_rule(), triangle_rule());
        let plane = exponents(degree);
        let flat = |p: [f64; 2]| {
            let x = [p[0], p[1], MIDDLE];
            plane.iter().filter(|e| e[2] == 0).map(|&e| monomial(e, x)).collect::<Vec<_>>()
        };
        let on_face = triangle.iter().map(|&(p, _)| flat(p)).collect();
        let inside =
            volume.iter().map(|&(x, _)| plane.iter().map(|&e| monomial(e, x)).collect()).collect::<Vec<_>>();
        Functionals {
            degree,
            on_face: orthonormal(on_face, &triangle.iter().map(|p| p.1).collect::<Vec<_>>()),
            inside: orthonormal(inside, &volume.iter().map(|p| p.1).collect::<Vec<_>>()),
            volume,
            triangle,
        }
    }

    /// The point of a face at the point `p` of the unit triangle.
    fn point(&self, face: usize, p: [f64; 2]) -> [f64; 3] {
        let corners = corners_of_face(face);
        let shares = [1.0 - p[0] - p[1], p[0], p[1]];
        let mut l = [0.0; 4];
        for k in 0..3 {
            l[corners[k]] = shares[k];
        }
        [l[1], l[2], l[3]]
    }

    /// Samples a field at all points; `at` gives value and divergence.
    fn sample(&self, at: impl Fn([f64; 3]) -> ([f64; 3], f64)) -> Field {
        Field {
            volume: self.volume.iter().map(|&(x, _)| at(x)).collect(),
            faces: [0, 1, 2, 3]
                .map(|i| self.triangle.iter().map(|&(p, _)| at(self.point(i, p)).0).collect::<Vec<_>>()),
        }
    }

    /// Moments of the outward component on each face: they determine the functions of the first group.
    fn face_moments(&self, field: &Field) -> Vec<f64> {
        let count = self.on_face[0].len();
        let mut moments = Vec::with_capacity(4 * count);
        for i in 0..4 {
            let outward = GRADIENTS[i].map(|g| -g);
            for j in 0..count {
                let samples = self.triangle.iter().zip(&self.on_face).zip(&field.faces[i]);
                moments.push(samples.map(|((p, q), &v)| p.1 * q[j] * dot(v, outward)).sum());
            }
        }
        moments
    }

    /// Moments of the divergence against all polynomials but the constant one: they determine those of the
    /// second group.
    fn source_moments(&self, field: &Field) -> Vec<f64> {
        let count = self.inside[0].len();
        let samples = || self.volume.iter().zip(&self.inside).zip(&field.volume);
        (1..count).map(|j| samples().map(|((p, r), v)| p.1 * r[j] * v.1).sum()).collect()
    }

    /// Moments against rotations: they determine the loops of quadratics.
    fn loop_moments(&self, field: &Field) -> Vec<f64> {
        let axes = if self.degree < 2 { 0..0 } else { 0..3 };
        axes.map(|a| {
            let samples = self.volume.iter().zip(&field.volume);
            samples
                .map(|((x, w), (v, _))| {
                    let (b, c) = ((a + 1) % 3, (a + 2) % 3);
                    w * (v[c] * (x[b] - MIDDLE) - v[b] * (x[c] - MIDDLE))
                })
                .sum()
        })
        .collect()
    }

    /// All functionals, in the order of the three groups.
    fn moments(&self, field: &Field) -> Vec<f64> {
        let mut moments = self.face_moments(field);
        moments.extend(self.source_moments(field));
        moments.extend(self.loop_moments(field));
        moments
    }
}

impl Reference {
    /// Tables for fluxes of a degree 0, 1 or 2.
    pub(super) fn new(degree: usize) -> Reference {
        let f = Functionals::new(degree);
        let size = raw(degree, [MIDDLE; 3]).len();
        let columns: Vec<_> = (0..size).map(|i| f.moments(&f.sample(|x| raw(degree, x)[i]))).collect();
        let functionals = Mat::from_fn(size, size, |i, j| columns[j][i]);
        let basis = Lu::new(functionals.as_ref()).solve(Mat::<f64>::identity(size, size).as_ref());
        let values: Vec<Vec<[f64; 3]>> = f
            .volume
            .iter()
            .map(|&(x, _)| {
                let raw = raw(degree, x);
                let sum = |i: usize, a: usize| (0..size).map(|k| raw[k].0[a] * basis[(k, i)]).sum();
                (0..size).map(|i| [sum(i, 0), sum(i, 1), sum(i, 2)]).collect()
            })
            .collect();
        let mass = PAIRS.map(|[a, b]| {
            let mut table = vec![0.0; size * size];
            for (v, p) in values.iter().zip(&f.volume) {
                for i in 0..size {
                    for j in 0..size {
                        let mixed = if a == b { 0.0 } else { v[i][b] * v[j][a] };
                        table[i * size + j] += p.1 * (v[i][a] * v[j][b] + mixed);
                    }
                }
            }
            table
        });
        let nodes = nodal(degree, [MIDDLE; 3]).len();
        let field = |node: usize, a: usize, hat: Option<usize>| {
            f.sample(|x| {
                let (value, gradient) = nodal(degree, x)[node];
                let l = hat.map_or(1.0, |c| barycentric(x)[c]);
                let mut vector = [0.0; 3];
                vector[a] = l * value;
                // The divergence without the contribution of the gradient of the hat.
                (vector, l * gradient[a])
            })
        };
        let table = |hat: Option<usize>, take: &dyn Fn(&Field) -> Vec<f64>| {
            let columns: Vec<_> = (0..3 * nodes).map(|c| take(&field(c / 3, c % 3, hat))).collect();
            let rows = columns[0].len();
            (0..rows * 3 * nodes).map(|k| columns[k % (3 * nodes)][k / (3 * nodes)]).collect::<Vec<f64>>()
        };
        let corners = [0, 1, 2, 3];
        let triangle_products = PAIRS.map(|[a, b]| {
            let count = f.on_face[0].len();
            let mut table = vec![0.0; count * count];
            for ((p, w), q) in f.triangle.iter().zip(&f.on_face) {
                let l = [1.0 - p[0] - p[1], p[0], p[1]];
                let weight = w * l[a] * l[b] * if a == b { 1.0 } else { 2.0 };
                for i in 0..count {
                    for j in 0..count {
                        table[i * count + j] += weight * q[i] * q[j];
                    }
                }
            }
            table
        });
        Reference {
            on_face: f.on_face[0].len(),
            sources: f.inside[0].len() - 1,
            loops: if degree < 2 { 0 } else { 3 },
            nodes,
            mass,
            interpolation: table(None, &|v| f.moments(v)),
            hat_moments: corners.map(|c| table(Some(c), &|v| f.face_moments(v))),
            hat_sources: corners.map(|c| table(Some(c), &|v| f.source_moments(v))),
            hat_supply: corners.map(|c| {
                table(None, &|v| {
                    let samples = f.volume.iter().zip(&v.volume);
                    vec![samples.map(|(p, v)| 2.0_f64.sqrt() * p.1 * dot(GRADIENTS[c], v.0)).sum()]
                })
            }),
            face_mass: triangle_products,
        }
    }

    /// The number of functions on a tetrahedron.
    pub(super) fn size(&self) -> usize {
        4 * self.on_face + self.sources + self.loops
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_functions_fill_the_whole_space_of_raviart_and_thomas() {
        for (degree, size) in [(0, 4), (1, 15), (2, 36)] {
            let reference = Reference::new(degree);
            assert_eq!(reference.size(), size);
            assert_eq!(reference.mass[0].len(), size * size);
            assert!(reference.mass.iter().flatten().all(|m| m.is_finite() && m.abs() < 1e3));
        }
    }

    #[test]
    fn a_constant_flux_leaves_what_it_brings() {
        for degree in 0..3 {
            let reference = Reference::new(degree);
            let columns = 3 * reference.nodes;
            let out = |row: usize| -> f64 {
                (0..reference.nodes).map(|n| reference.interpolation[row * columns + 3 * n]).sum()
            };
            // A unit flux along the first axis goes in through the face on it and out through the slanted
            // one; the moments carry a factor sqrt(2).
            let half = 0.5 * 2.0_f64.sqrt();
            let faces = [half, -half, 0.0, 0.0];
            for i in 0..4 {
                assert!((out(i * reference.on_face) - faces[i]).abs() < 1e-13);
            }
            for row in 4 * reference.on_face..4 * reference.on_face + reference.sources {
                assert!(out(row).abs() < 1e-13);
            }
        }
    }
}

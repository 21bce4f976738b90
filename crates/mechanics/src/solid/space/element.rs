//! The hexahedron with triquadratic displacement and a discontinuous, linear pressure (Q2/P1disc).
//!
//! The three-dimensional sibling of [`crate::solid::element`], where the condensation of the pressure is
//! explained. The tangent is three products of dense matrices: with the gradients as a matrix of 27 nodes by
//! 81 pairs of quadrature point and axis, the block of the axes `i` and `k` is that matrix times the
//! tangent's response to it.

use elastocap_fem::quadrature::gauss_legendre;
use elastocap_linalg::gemm::{Left, Right, Target, multiply};

use crate::solid::dimension::{Dimension, Element, ElementSystem, Space, Stress};
use crate::solid::point_stress::SpaceStress;
use crate::solid::shape_functions::quadratic;
use elastocap_materials::space::{Tensor, add_cofactor_slope, cofactor, determinant};
use elastocap_materials::{Response, Rubber};

/// The number of nodes of an element.
pub const NODES: usize = 27;
/// The number of quadrature points of an element.
pub const POINTS: usize = 27;
/// The number of displacements of an element.
pub const DISPLACEMENTS: usize = 81;

/// The data that an element keeps of the reference configuration.
#[derive(Debug, Clone)]
pub struct ReferenceElement {
    /// `dN_a/dX_k` at quadrature point `q`, in 1/m: entry `(3 q + k) 27 + a`.
    gradients: Vec<f64>,
    /// Volume of each quadrature point in m^3.
    volumes: [f64; POINTS],
    /// The pressure's basis at each quadrature point.
    pressure: [[f64; 4]; POINTS],
    /// Inverse of the pressure's mass matrix in 1/m^3.
    mass_inverse: [[f64; 4]; 4],
    /// Centre of volume in m.
    centre: [f64; 3],
    /// The largest distance of a quadrature point from the centre along each axis, in m: the unit of the
    /// coordinates of the pressure.
    size: [f64; 3],
}

impl ReferenceElement {
    /// `dN_a/dX_k` of all nodes at quadrature point `q`.
    fn gradient(&self, q: usize, k: usize) -> &[f64] {
        &self.gradients[(3 * q + k) * NODES..][..NODES]
    }

    /// Deformation gradient at quadrature point `q` under the nodal displacements `u` (m, `3 a + k`).
    pub fn deformation_gradient(&self, q: usize, u: &[f64]) -> Tensor {
        let mut f = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        for k in 0..3 {
            for (a, g) in self.gradient(q, k).iter().enumerate() {
                for i in 0..3 {
                    f[3 * i + k] += u[3 * a + i] * g;
                }
            }
        }
        f
    }

    /// The pressure field with the coefficients `p` at quadrature point `q`.
    pub(crate) fn pressure_at(&self, q: usize, p: &[f64; 4]) -> f64 {
        dot(&self.pressure[q], p)
    }

    /// Stored energy in J under `u` with the pressure `p` held: `w + p (J - 1) - p^2/(2 kappa)`.
    pub fn energy(&self, rubber: &Rubber, u: &[f64], p: &[f64; 4]) -> f64 {
        (0..POINTS)
            .map(|q| {
                let f = self.deformation_gradient(q, u);
                let mut w = rubber.response(&f).energy;
                if let Some(compliance) = rubber.pressure_compliance() {
                    let pressure = dot(&self.pressure[q], p);
                    w += pressure * (determinant(&f) - 1.0) - 0.5 * compliance * pressure * pressure;
                }
                self.volumes[q] * w
            })
            .sum()
    }

    /// The sum of `dN_a/dX_J A_iJkL dN_b/dX_L` over the quadrature points, from the weighted tangents: the
    /// upper triangle.
    fn assemble_stiffness(&self, tangents: &[[Tensor; 9]; POINTS], stiffness: &mut [f64]) {
        let mut response = [0.0; 3 * POINTS * DISPLACEMENTS];
        let mut block = [0.0; NODES * DISPLACEMENTS];
        for i in 0..3 {
            // Only the axes k >= i; the others follow from symmetry.
            let width = (3 - i) * NODES;
            for (row, line) in response.chunks_exact_mut(width).take(3 * POINTS).enumerate() {
                let (q, j) = (row / 3, row % 3);
                let [g0, g1, g2] = [0, 1, 2].map(|l| self.gradient(q, l));
                for (k, part) in (i..3).zip(line.chunks_exact_mut(NODES)) {
                    let a = &tangents[q][3 * i + j][3 * k..3 * k + 3];
                    for (b, value) in part.iter_mut().enumerate() {
                        *value = a[0] * g0[b] + a[1] * g1[b] + a[2] * g2[b];
                    }
                }
            }
            multiply(
                Left { data: &self.gradients, rows: NODES, cols: 3 * POINTS, row: 1, col: NODES },
                Right { data: &response, cols: width, stride: width },
                Target { data: &mut block, stride: width },
                false,
            );
            for a in 0..NODES {
                for k in i..3 {
                    // Within the block of one axis only half is taken, so that the matrix is symmetric to the
                    // last bit.
                    for b in if k == i { a..NODES } else { 0..NODES } {
                        let (r, c) = (3 * a + i, 3 * b + k);
                        stiffness[r.min(c) * DISPLACEMENTS + r.max(c)] =
                            block[a * width + (k - i) * NODES + b];
                    }
                }
            }
        }
    }
}

impl Dimension for Space {
    const AXES: usize = 3;
    type Point = [f64; 3];
    type Pressure = [f64; 4];
    type Nodes = [u32; 27];
    type SideNodes = [u32; 9];
    type Element = ReferenceElement;
    const SIDES: &'static [&'static [usize]] =
        &[&face(0, 3, 1), &face(18, 1, 3), &face(0, 1, 9), &face(6, 9, 1), &face(0, 9, 3), &face(2, 3, 9)];
    const SIDE_CORNERS: &'static [usize] = &[0, 2, 6, 8];
    fn normal(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }
    fn in_space(point: &[f64; 3]) -> [f64; 3] {
        *point
    }
    fn order(nodes: &[[f64; 3]], elements: &[[u32; 27]]) -> Vec<u32> {
        elastocap_linalg::ordering::dissection_order(nodes, elements)
    }
}

/// The face of a hexahedron that begins at node `corner` and goes on in steps of `a` and `b`.
const fn face(corner: usize, a: usize, b: usize) -> [usize; 9] {
    let mut nodes = [0; 9];
    let mut n = 0;
    while n < 9 {
        nodes[n] = corner + a * (n % 3) + b * (n / 3);
        n += 1;
    }
    nodes
}

impl Element<Space> for ReferenceElement {
    const NODES: usize = NODES;
    const POINTS: usize = POINTS;
    const ANY_VOLUME_RATIO: bool = false;

    fn new(x: &[[f64; 3]]) -> Option<Self> {
        let (points, weights) = gauss_legendre(3);
        let mut gradients = vec![0.0; POINTS * 3 * NODES];
        let mut volumes = [0.0; POINTS];
        let mut place = [[0.0; 3]; POINTS];
        for q in 0..POINTS {
            let indices = [q % 3, q / 3 % 3, q / 9];
            let line = indices.map(|k| quadratic(points[k]));
            // Value and slopes of the shape function of node n.
            let shape = |n: usize| {
                let (k, [a, b, c]) = ([n % 3, n / 3 % 3, n / 9], &line);
                let value = [a.0[k[0]], b.0[k[1]], c.0[k[2]]];
                let slope = [a.1[k[0]], b.1[k[1]], c.1[k[2]]];
                let slopes = [
                    slope[0] * value[1] * value[2],
                    value[0] * slope[1] * value[2],
                    value[0] * value[1] * slope[2],
                ];
                (value[0] * value[1] * value[2], slopes)
            };
            let mut jacobian = [0.0; 9];
            for n in 0..NODES {
                let (value, slopes) = shape(n);
                for i in 0..3 {
                    place[q][i] += x[n][i] * value;
                    for m in 0..3 {
                        jacobian[3 * i + m] += x[n][i] * slopes[m];
                    }
                }
            }
            let volume = determinant(&jacobian);
            if volume.is_nan() || volume <= 0.0 {
                return None;
            }
            let inverse = cofactor(&jacobian).map(|c| c / volume);
            for n in 0..NODES {
                let slopes = shape(n).1;
                // dN/dX_k = dN/ds_m ds_m/dX_k, and cof is the inverse transposed.
                for k in 0..3 {
                    gradients[(3 * q + k) * NODES + n] = (0..3).map(|m| inverse[3 * k + m] * slopes[m]).sum();
                }
            }
            volumes[q] = volume * indices.iter().map(|&k| weights[k]).product::<f64>();
        }
        let volume: f64 = volumes.iter().sum();
        let centre: [f64; 3] =
            std::array::from_fn(|k| (0..POINTS).map(|q| volumes[q] * place[q][k]).sum::<f64>() / volume);
        let size: [f64; 3] = std::array::from_fn(|k| {
            place.iter().map(|p| (p[k] - centre[k]).abs()).fold(f64::MIN_POSITIVE, f64::max)
        });
        let mut mass = nalgebra::Matrix4::<f64>::zeros();
        let pressure = place.map(|p| {
            let [a, b, c] = std::array::from_fn(|k| (p[k] - centre[k]) / size[k]);
            [1.0, a, b, c]
        });
        for (basis, volume) in pressure.iter().zip(&volumes) {
            for r in 0..4 {
                for c in 0..4 {
                    mass[(r, c)] += volume * basis[r] * basis[c];
                }
            }
        }
        let inverse = mass.try_inverse()?;
        let mass_inverse = std::array::from_fn(|r| std::array::from_fn(|c| inverse[(r, c)]));
        Some(Self { gradients, volumes, pressure, mass_inverse, centre, size })
    }

    fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }

    fn pressure_frame(&self) -> ([f64; 3], [f64; 3]) {
        (self.centre, self.size)
    }

    fn volume_ratio(&self, q: usize, u: &[f64]) -> f64 {
        determinant(&self.deformation_gradient(q, u))
    }

    fn stress(&self, rubber: &Rubber, q: usize, u: &[f64], p: &[f64; 4]) -> Stress {
        SpaceStress::new(rubber, &self.deformation_gradient(q, u), self.pressure_at(q, p)).cauchy
    }

    fn point_volume(&self, q: usize) -> f64 {
        self.volumes[q]
    }

    fn extension_left(&self, rubber: &Rubber, q: usize, u: &[f64]) -> Option<f64> {
        rubber.extension_left_in_space(&self.deformation_gradient(q, u))
    }

    fn mass_inverse(&self) -> &[[f64; 4]] {
        &self.mass_inverse
    }

    fn gradient_product(&self, a: usize, b: usize) -> f64 {
        let product = |q: usize| {
            self.volumes[q] * (0..3).map(|k| self.gradient(q, k)[a] * self.gradient(q, k)[b]).sum::<f64>()
        };
        (0..POINTS).map(product).sum()
    }

    fn integrate(&self, rubber: &Rubber, u: &[f64], p: &[f64; 4], out: &mut ElementSystem<Space>) {
        let compliance = rubber.pressure_compliance();
        out.clear();
        let mut tangents = [[[0.0; 9]; 9]; POINTS];
        for q in 0..POINTS {
            let f = self.deformation_gradient(q, u);
            let j = determinant(&f);
            out.smallest_j = out.smallest_j.min(j);
            let Response { mut stress, mut tangent, .. } = rubber.response(&f);
            let volume = self.volumes[q];
            if let Some(compliance) = compliance {
                let (basis, g) = (&self.pressure[q], cofactor(&f));
                let pressure = dot(basis, p);
                for r in 0..9 {
                    stress[r] += pressure * g[r];
                }
                add_cofactor_slope(&f, pressure, &mut tangent);
                let error = volume * (j - 1.0 - compliance * pressure);
                for m in 0..4 {
                    out.volume_error[m] += error * basis[m];
                }
                for a in 0..NODES {
                    for i in 0..3 {
                        let along: f64 = (0..3).map(|k| g[3 * i + k] * self.gradient(q, k)[a]).sum();
                        for m in 0..4 {
                            out.coupling[3 * a + i][m] += volume * along * basis[m];
                        }
                    }
                }
            }
            for a in 0..NODES {
                for i in 0..3 {
                    out.force[3 * a + i] +=
                        volume * (0..3).map(|k| stress[3 * i + k] * self.gradient(q, k)[a]).sum::<f64>();
                }
            }
            tangents[q] = tangent.map(|row| row.map(|x| volume * x));
        }
        self.assemble_stiffness(&tangents, &mut out.stiffness);
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_materials::{HyperelasticLaw, Volume};

    fn distorted() -> ReferenceElement {
        let x: [[f64; 3]; NODES] = std::array::from_fn(|n| {
            let [r, s, t] = [n % 3, n / 3 % 3, n / 9].map(|k| k as f64);
            [
                r + 0.2 * s + 0.05 * s * t,
                0.9 * s - 0.1 * r + 0.04 * (s - 1.0) * (t - 1.0),
                0.8 * t + 0.1 * r * s,
            ]
        });
        ReferenceElement::new(&x).unwrap()
    }

    fn wobble(scale: f64) -> [f64; DISPLACEMENTS] {
        std::array::from_fn(|k| scale * (1.7 * k as f64 + 0.3).sin())
    }

    const PRESSURE: [f64; 4] = [0.4, -0.2, 0.3, 0.1];

    #[test]
    fn the_forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces() {
        let element = distorted();
        let volumes = [Volume::Incompressible, Volume::BulkModulus(20.0), Volume::DisplacementOnly(5.0)];
        for volume in volumes {
            let distortion = HyperelasticLaw::MooneyRivlin { c10: 0.3, c01: 0.2 };
            let rubber = Rubber { distortion, volume, volume_barrier: 0.4 };
            // Differences see the tangent without the pressure eliminated: with p held there is nothing to
            // eliminate.
            let assemble = |u: &[f64]| {
                let mut s = ElementSystem::new(DISPLACEMENTS);
                element.assemble(&rubber, u, &PRESSURE, 1e-300, &mut s);
                s
            };
            let u = wobble(0.05);
            let system = assemble(&u);
            let h = 1e-5;
            for r in 0..DISPLACEMENTS {
                let (mut up, mut down) = (u, u);
                up[r] += h;
                down[r] -= h;
                let energy = |u| element.energy(&rubber, u, &PRESSURE);
                let slope = (energy(&up) - energy(&down)) / (2.0 * h);
                assert!(
                    (slope - system.force[r]).abs() < 1e-8,
                    "{volume:?} {r}: {slope} {}",
                    system.force[r]
                );
                let (a, b) = (assemble(&up), assemble(&down));
                for c in 0..DISPLACEMENTS {
                    let slope = (a.force[c] - b.force[c]) / (2.0 * h);
                    let exact = system.stiffness[c * DISPLACEMENTS + r];
                    assert!((slope - exact).abs() < 1e-7, "{volume:?} {r} {c}: {slope} {exact}");
                }
                for m in 0..4 {
                    let slope = (a.volume_error[m] - b.volume_error[m]) / (2.0 * h);
                    assert!((slope - system.coupling[r][m]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn eliminating_the_pressure_solves_the_whole_system() {
        let element = distorted();
        let distortion = HyperelasticLaw::NeoHookean { shear_modulus: 1.0 };
        let rubber = Rubber { distortion, volume: Volume::BulkModulus(50.0), volume_barrier: 0.0 };
        let (u, du, kappa_0) = (wobble(0.05), wobble(0.01), 200.0);
        let mut s = ElementSystem::new(DISPLACEMENTS);
        element.assemble(&rubber, &u, &PRESSURE, kappa_0, &mut s);
        let mut bare = ElementSystem::new(DISPLACEMENTS);
        element.assemble(&rubber, &u, &PRESSURE, 1e-300, &mut bare);
        let dp = element.pressure_increment(&rubber, &du, kappa_0, &s);
        let row = |matrix: &[f64], r: usize| -> f64 {
            matrix[r * DISPLACEMENTS..][..DISPLACEMENTS].iter().zip(&du).map(|(a, b)| a * b).sum()
        };
        for r in 0..DISPLACEMENTS {
            let whole = row(&bare.stiffness, r) + dot(&s.coupling[r], &dp) + s.force[r];
            let condensed = row(&s.stiffness, r) + s.condensed_force[r];
            assert!((whole - condensed).abs() < 1e-12, "{r}: {whole} {condensed}");
        }
    }

    #[test]
    fn a_turned_element_has_no_forces_and_six_free_motions() {
        let element = distorted();
        let rubber = Rubber::neo_hookean(1.0);
        let (s, c) = 1.1f64.sin_cos();
        let x: [[f64; 3]; NODES] = std::array::from_fn(|n| {
            let [r, s, t] = [n % 3, n / 3 % 3, n / 9].map(|k| k as f64);
            [
                r + 0.2 * s + 0.05 * s * t,
                0.9 * s - 0.1 * r + 0.04 * (s - 1.0) * (t - 1.0),
                0.8 * t + 0.1 * r * s,
            ]
        });
        let u: [f64; DISPLACEMENTS] = std::array::from_fn(|d| {
            let x = x[d / 3];
            [c * x[0] - s * x[2] + 0.3, x[1] - 2.0, s * x[0] + c * x[2]][d % 3] - x[d % 3]
        });
        let mut system = ElementSystem::new(DISPLACEMENTS);
        element.assemble(&rubber, &u, &[0.0; 4], 100.0, &mut system);
        assert!(system.force.iter().all(|f| f.abs() < 1e-13));
        let matrix = nalgebra::DMatrix::from_row_slice(DISPLACEMENTS, DISPLACEMENTS, &system.stiffness);
        let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
        values.sort_unstable_by(f64::total_cmp);
        assert!(values[..6].iter().all(|v| v.abs() < 1e-11), "{:?}", &values[..8]);
        assert!(values[6] > 1e-3, "{:?}", &values[..8]);
    }
}

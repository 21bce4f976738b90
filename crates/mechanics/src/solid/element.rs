//! The quadrilateral with biquadratic displacement and a discontinuous, linear pressure (Q2/P1disc).
//!
//! The pressure is linear in *reference coordinates*, three numbers per element, and belongs to no neighbour:
//! it is condensed out element by element. With `r_p = int q (J - 1 - p/kappa)`, the linearised system of one
//! element is
//!
//! `[ K   G ] [du]     [ r_u ]`
//! `[ G' -e M] [dp] = - [ r_p ]`,
//!
//! `e = 1/kappa + 1/kappa_0`, where the second term only appears on the left: a proximal term that lets the
//! pressure be eliminated (`K + G M^-1 G' / e`) also if the rubber is exactly incompressible, and that is
//! gone where the iteration has converged (`dp = 0`). It costs a factor `mu/kappa_0` of the convergence of
//! Newton's method.

use elastocap_fem::quadrature::gauss_legendre;

use super::dimension::{Dimension, Element, ElementSystem, Plane, Stress};
use super::point_stress::PointStress;
use super::shape_functions::quadratic;
use elastocap_materials::Rubber;
use elastocap_materials::plane::{Tensor, cofactor, determinant};

/// Quadrature points of an element.
pub const POINTS: usize = 9;

/// The data that an element keeps of the reference configuration.
#[derive(Debug, Clone)]
pub struct ReferenceElement {
    /// `dN_a/dX_k` at each quadrature point, in 1/m.
    pub gradients: [[[f64; 2]; 9]; POINTS],
    /// Area of each quadrature point in m^2.
    pub areas: [f64; POINTS],
    /// The pressure's basis at each quadrature point.
    pub pressure: [[f64; 3]; POINTS],
    /// Inverse of the pressure's mass matrix in 1/m^2.
    pub mass_inverse: [[f64; 3]; 3],
    /// Centre of area in m.
    centre: [f64; 2],
    /// The largest distance of a quadrature point from the centre along each axis, in m: the unit of the
    /// coordinates of the pressure.
    size: [f64; 2],
}

/// One point of the reference square, mapped to the reference configuration.
pub(crate) struct Mapped {
    /// `dN_a/dX_k` in 1/m.
    pub(crate) gradients: [[f64; 2]; 9],
    /// Reference position in m.
    pub(crate) place: [f64; 2],
    /// Reference area per area of the reference square, in m^2.
    area: f64,
}

impl Mapped {
    /// The point `(s, t)` of the element with nodes at `x` (m); `None` where it is turned inside out or
    /// collapsed.
    pub(crate) fn new(x: &[[f64; 2]], s: f64, t: f64) -> Option<Self> {
        let ((a, da), (b, db)) = (quadratic(s), quadratic(t));
        let slopes: [[f64; 2]; 9] = std::array::from_fn(|n| [da[n % 3] * b[n / 3], a[n % 3] * db[n / 3]]);
        let mut jacobian = [0.0; 4];
        let mut place = [0.0; 2];
        for n in 0..9 {
            for k in 0..2 {
                jacobian[2 * k] += x[n][k] * slopes[n][0];
                jacobian[2 * k + 1] += x[n][k] * slopes[n][1];
                place[k] += x[n][k] * a[n % 3] * b[n / 3];
            }
        }
        let area = determinant(&jacobian);
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let inverse = cofactor(&jacobian).map(|c| c / area);
        // dN/dX_k = dN/ds_m ds_m/dX_k, and cof is the inverse transposed.
        let gradients = slopes.map(|slope| {
            [inverse[0] * slope[0] + inverse[1] * slope[1], inverse[2] * slope[0] + inverse[3] * slope[1]]
        });
        Some(Self { gradients, place, area })
    }

    /// Deformation gradient at the point under the nodal displacements `u` (m).
    pub(crate) fn deformation_gradient(&self, u: &[f64]) -> Tensor {
        deformation_gradient(&self.gradients, u)
    }
}

/// Deformation gradient at a point with the `gradients` of the shape functions (1/m) under the nodal
/// displacements `u` (m).
fn deformation_gradient(gradients: &[[f64; 2]; 9], u: &[f64]) -> Tensor {
    let mut f = [1.0, 0.0, 0.0, 1.0];
    for (a, g) in gradients.iter().enumerate() {
        f[0] += u[2 * a] * g[0];
        f[1] += u[2 * a] * g[1];
        f[2] += u[2 * a + 1] * g[0];
        f[3] += u[2 * a + 1] * g[1];
    }
    f
}

/// Values of the nine shape functions at `(s, t)` of the reference square.
pub fn shape_functions(s: f64, t: f64) -> [f64; 9] {
    let (a, b) = (quadratic(s).0, quadratic(t).0);
    std::array::from_fn(|k| a[k % 3] * b[k / 3])
}

impl ReferenceElement {
    /// Reference area in m^2.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// Deformation gradient at quadrature point `q` under the nodal displacements `u` (m).
    pub fn deformation_gradient(&self, q: usize, u: &[f64]) -> Tensor {
        deformation_gradient(&self.gradients[q], u)
    }

    /// The pressure's basis at the reference position `x` (m).
    pub(crate) fn pressure_basis(&self, x: [f64; 2]) -> [f64; 3] {
        [1.0, (x[0] - self.centre[0]) / self.size[0], (x[1] - self.centre[1]) / self.size[1]]
    }

    /// Stored energy in J per metre of width under `u` with the pressure `p` held: `w + p (J - 1) - p^2/(2
    /// kappa)`.
    pub fn energy(&self, rubber: &Rubber, u: &[f64], p: &[f64; 3]) -> f64 {
        (0..POINTS)
            .map(|q| {
                let f = self.deformation_gradient(q, u);
                let mut w = rubber.derivatives(&f).w;
                if let Some(compliance) = rubber.pressure_compliance() {
                    let pressure = dot3(&self.pressure[q], p);
                    w += pressure * (determinant(&f) - 1.0) - 0.5 * compliance * pressure * pressure;
                }
                self.areas[q] * w
            })
            .sum()
    }
}

impl Dimension for Plane {
    const AXES: usize = 2;
    type Point = [f64; 2];
    type Pressure = [f64; 3];
    type Nodes = [u32; 9];
    type SideNodes = [u32; 3];
    type Element = ReferenceElement;
    const SIDES: &'static [&'static [usize]] = &[&[0, 1, 2], &[2, 5, 8], &[8, 7, 6], &[6, 3, 0]];
    const SIDE_CORNERS: &'static [usize] = &[0, 2];
    fn normal(first: [f64; 2], _: [f64; 2]) -> [f64; 2] {
        [first[1], -first[0]]
    }
    fn in_space(point: &[f64; 2]) -> [f64; 3] {
        [point[0], point[1], 0.0]
    }
    fn order(nodes: &[[f64; 2]], elements: &[[u32; 9]]) -> Vec<u32> {
        elastocap_linalg::ordering::dissection_order(nodes, elements)
    }
}

impl Element<Plane> for ReferenceElement {
    const NODES: usize = 9;
    const POINTS: usize = POINTS;
    const ANY_VOLUME_RATIO: bool = true;

    fn new(x: &[[f64; 2]]) -> Option<Self> {
        let (nodes, weights) = gauss_legendre(3);
        let mut element = Self {
            gradients: [[[0.0; 2]; 9]; POINTS],
            areas: [0.0; POINTS],
            pressure: [[0.0; 3]; POINTS],
            mass_inverse: [[0.0; 3]; 3],
            centre: [0.0; 2],
            size: [0.0; 2],
        };
        let mut place = [[0.0; 2]; POINTS];
        for q in 0..POINTS {
            let point = Mapped::new(x, nodes[q % 3], nodes[q / 3])?;
            element.gradients[q] = point.gradients;
            element.areas[q] = point.area * weights[q % 3] * weights[q / 3];
            place[q] = point.place;
        }
        let area: f64 = element.areas.iter().sum();
        element.centre =
            std::array::from_fn(|k| (0..POINTS).map(|q| element.areas[q] * place[q][k]).sum::<f64>() / area);
        element.size = std::array::from_fn(|k| {
            place.iter().map(|p| (p[k] - element.centre[k]).abs()).fold(f64::MIN_POSITIVE, f64::max)
        });
        let mut mass = nalgebra::Matrix3::<f64>::zeros();
        for q in 0..POINTS {
            let basis = element.pressure_basis(place[q]);
            element.pressure[q] = basis;
            for r in 0..3 {
                for c in 0..3 {
                    mass[(r, c)] += element.areas[q] * basis[r] * basis[c];
                }
            }
        }
        let inverse = mass.try_inverse()?;
        element.mass_inverse = std::array::from_fn(|r| std::array::from_fn(|c| inverse[(r, c)]));
        Some(element)
    }

    fn volume(&self) -> f64 {
        self.area()
    }

    fn pressure_frame(&self) -> ([f64; 2], [f64; 2]) {
        (self.centre, self.size)
    }

    fn volume_ratio(&self, q: usize, u: &[f64]) -> f64 {
        determinant(&self.deformation_gradient(q, u))
    }

    fn stress(&self, rubber: &Rubber, q: usize, u: &[f64], p: &[f64; 3]) -> Stress {
        let pressure = self.pressure[q].iter().zip(p).map(|(basis, p)| basis * p).sum();
        let stress = PointStress::new(rubber, &self.deformation_gradient(q, u), pressure);
        [stress.s11, stress.s22, stress.s33, stress.s12, 0.0, 0.0]
    }

    fn point_volume(&self, q: usize) -> f64 {
        self.areas[q]
    }

    fn extension_left(&self, rubber: &Rubber, q: usize, u: &[f64]) -> Option<f64> {
        rubber.extension_left(&self.deformation_gradient(q, u))
    }

    fn mass_inverse(&self) -> &[[f64; 3]] {
        &self.mass_inverse
    }

    fn gradient_product(&self, a: usize, b: usize) -> f64 {
        let product = |q: usize| {
            let (x, y) = (self.gradients[q][a], self.gradients[q][b]);
            self.areas[q] * (x[0] * y[0] + x[1] * y[1])
        };
        (0..POINTS).map(product).sum()
    }

    fn integrate(&self, rubber: &Rubber, u: &[f64], p: &[f64; 3], out: &mut ElementSystem) {
        let compliance = rubber.pressure_compliance();
        out.clear();
        for q in 0..POINTS {
            let f = self.deformation_gradient(q, u);
            let j = determinant(&f);
            out.smallest_j = out.smallest_j.min(j);
            let g = cofactor(&f);
            let area = self.areas[q];
            let mut d = rubber.derivatives(&f);
            if let Some(compliance) = compliance {
                let basis = &self.pressure[q];
                let pressure = dot3(basis, p);
                d.j += pressure;
                for m in 0..3 {
                    out.volume_error[m] += area * basis[m] * (j - 1.0 - compliance * pressure);
                }
                for (a, grad) in self.gradients[q].iter().enumerate() {
                    let along = [g[0] * grad[0] + g[1] * grad[1], g[2] * grad[0] + g[3] * grad[1]];
                    for m in 0..3 {
                        out.coupling[2 * a][m] += area * along[0] * basis[m];
                        out.coupling[2 * a + 1][m] += area * along[1] * basis[m];
                    }
                }
            }
            let stress = d.first_piola(&f);
            let tangent = d.tangent(&f);
            let gradients = &self.gradients[q];
            for b in 0..9 {
                let grad = gradients[b];
                out.force[2 * b] += area * (stress[0] * grad[0] + stress[1] * grad[1]);
                out.force[2 * b + 1] += area * (stress[2] * grad[0] + stress[3] * grad[1]);
                // t[iJ][k] = A_iJkL dN_b/dX_L
                let t: [[f64; 2]; 4] = std::array::from_fn(|r| {
                    let row = &tangent[r];
                    [
                        area * (row[0] * grad[0] + row[1] * grad[1]),
                        area * (row[2] * grad[0] + row[3] * grad[1]),
                    ]
                });
                for a in 0..=b {
                    let w = gradients[a];
                    for k in 0..2 {
                        out.stiffness[(2 * a) * 18 + 2 * b + k] += w[0] * t[0][k] + w[1] * t[1][k];
                        out.stiffness[(2 * a + 1) * 18 + 2 * b + k] += w[0] * t[2][k] + w[1] * t[3][k];
                    }
                }
            }
        }
    }
}

fn dot3(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_materials::{HyperelasticLaw, Volume};

    fn distorted() -> ReferenceElement {
        let x: [[f64; 2]; 9] = std::array::from_fn(|k| {
            let (s, t) = ((k % 3) as f64, (k / 3) as f64);
            [s + 0.2 * t + 0.05 * s * t, 0.9 * t - 0.1 * s + 0.04 * (s - 1.0) * (t - 1.0)]
        });
        ReferenceElement::new(&x).unwrap()
    }

    fn wobble(scale: f64) -> [f64; 18] {
        std::array::from_fn(|k| scale * (1.7 * k as f64 + 0.3).sin())
    }

    #[test]
    fn the_forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces() {
        let element = distorted();
        let volumes = [Volume::Incompressible, Volume::BulkModulus(20.0), Volume::DisplacementOnly(5.0)];
        for volume in volumes {
            let distortion = HyperelasticLaw::MooneyRivlin { c10: 0.3, c01: 0.2 };
            let rubber = Rubber { distortion, volume, volume_barrier: 0.4 };
            let (u, p) = (wobble(0.08), [0.4, -0.2, 0.3]);
            // Differences see the tangent without the pressure eliminated: with p held there is nothing to
            // eliminate.
            let mut system = ElementSystem::new(18);
            let assemble = |u: &[f64], p: &[f64; 3]| {
                let mut s = ElementSystem::new(18);
                element.assemble(&rubber, u, p, 1e-300, &mut s);
                s
            };
            element.assemble(&rubber, &u, &p, 1e-300, &mut system);
            let h = 1e-5;
            for r in 0..18 {
                let (mut up, mut down) = (u, u);
                up[r] += h;
                down[r] -= h;
                let slope =
                    (element.energy(&rubber, &up, &p) - element.energy(&rubber, &down, &p)) / (2.0 * h);
                assert!(
                    (slope - system.force[r]).abs() < 1e-8,
                    "{volume:?} {r}: {slope} {}",
                    system.force[r]
                );
                let (a, b) = (assemble(&up, &p), assemble(&down, &p));
                for c in 0..18 {
                    let slope = (a.force[c] - b.force[c]) / (2.0 * h);
                    let exact = system.stiffness[c * 18 + r];
                    assert!((slope - exact).abs() < 1e-7, "{volume:?} {r} {c}: {slope} {exact}");
                }
                for m in 0..3 {
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
        let (u, p, du, kappa_0) = (wobble(0.05), [0.4, -0.2, 0.3], wobble(0.01), 200.0);
        let mut s = ElementSystem::new(18);
        element.assemble(&rubber, &u, &p, kappa_0, &mut s);
        let mut bare = ElementSystem::new(18);
        element.assemble(&rubber, &u, &p, 1e-300, &mut bare);
        let dp = element.pressure_increment(&rubber, &du, kappa_0, &s);
        for r in 0..18 {
            let whole = (0..18).map(|c| bare.stiffness[r * 18 + c] * du[c]).sum::<f64>()
                + dot3(&s.coupling[r], &dp)
                + s.force[r];
            let condensed =
                (0..18).map(|c| s.stiffness[r * 18 + c] * du[c]).sum::<f64>() + s.condensed_force[r];
            assert!((whole - condensed).abs() < 1e-12, "{r}: {whole} {condensed}");
        }
    }
}

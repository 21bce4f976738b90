//! Stress and tangent of a [`Rubber`] in three dimensions.
//!
//! Every law is a function of the volume ratio `J` and of *measures* of the deformation, each homogeneous in `F`:
//! `I1 = F:F`, `I2 = G:G` with `G = cof F`, and `S = l1^a + l2^a + l3^a` of the principal stretches. A measure `e` of
//! degree `n` enters as `e / J^(n/3) - 3` where the volume can change, and as `e - 3 - n (J - 1)` where it cannot (see
//! [`Distortion`]). First Piola stress and tangent follow by the chain rule, from slope and curvature of `e`:
//!
//! `P = w_e e' + w_J G`, `dP/dF = w_e e'' + w_ee e'(x)e' + w_eJ (e'(x)G + G(x)e') + w_JJ G(x)G + w_J dG/dF`.

use nalgebra::Matrix3;

use crate::solid::material::{Distortion, EnergyDerivatives, Rubber, Volume};

/// A tensor, row after row: `F11, F12, F13, F21, ...`.
pub type Tensor = [f64; 9];

/// What a rubber answers to a deformation gradient, without the pressure field's part.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Energy per reference volume in Pa; infinite if `J <= 0`.
    pub energy: f64,
    /// First Piola stress in Pa.
    pub stress: Tensor,
    /// `dP/dF` in Pa, symmetric.
    pub tangent: [Tensor; 9],
}

/// `det F`.
pub fn determinant(f: &Tensor) -> f64 {
    f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6])
        + f[2] * (f[3] * f[7] - f[4] * f[6])
}

/// `cof F = J F^-T = dJ/dF`.
pub fn cofactor(f: &Tensor) -> Tensor {
    [
        f[4] * f[8] - f[5] * f[7],
        f[5] * f[6] - f[3] * f[8],
        f[3] * f[7] - f[4] * f[6],
        f[2] * f[7] - f[1] * f[8],
        f[0] * f[8] - f[2] * f[6],
        f[1] * f[6] - f[0] * f[7],
        f[1] * f[5] - f[2] * f[4],
        f[2] * f[3] - f[0] * f[5],
        f[0] * f[4] - f[1] * f[3],
    ]
}

/// Adds `factor dG/dF` to a tangent: the derivative of the cofactor, `e_ikm e_jln F_mn`.
pub fn add_cofactor_slope(f: &Tensor, factor: f64, tangent: &mut [Tensor; 9]) {
    for i in 0..3 {
        for j in 0..3 {
            let ([i1, i2], [j1, j2]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
            let row = &mut tangent[3 * i + j];
            row[3 * i1 + j1] += factor * f[3 * i2 + j2];
            row[3 * i2 + j2] += factor * f[3 * i1 + j1];
            row[3 * i1 + j2] -= factor * f[3 * i2 + j1];
            row[3 * i2 + j1] -= factor * f[3 * i1 + j2];
        }
    }
}

/// A measure of the deformation: a function of `F`, homogeneous of degree `degree` and 3 at rest.
struct Measure {
    degree: f64,
    value: f64,
    slope: Tensor,
    curvature: [Tensor; 9],
}

impl Measure {
    /// `I1 = F:F`.
    fn first_invariant(f: &Tensor) -> Self {
        let mut curvature = [[0.0; 9]; 9];
        for k in 0..9 {
            curvature[k][k] = 2.0;
        }
        Self { degree: 2.0, value: f.iter().map(|x| x * x).sum(), slope: f.map(|x| 2.0 * x), curvature }
    }

    /// `I2 = G:G = (I1^2 - tr C^2) / 2`, with slope `2 (I1 F - F C)`.
    fn second_invariant(f: &Tensor) -> Self {
        let first: f64 = f.iter().map(|x| x * x).sum();
        let sum = |at: &dyn Fn(usize) -> f64| at(0) + at(1) + at(2);
        let right: Tensor = std::array::from_fn(|a| sum(&|m| f[3 * m + a / 3] * f[3 * m + a % 3]));
        let left: Tensor = std::array::from_fn(|a| sum(&|m| f[3 * (a / 3) + m] * f[3 * (a % 3) + m]));
        let slope =
            std::array::from_fn(|a| 2.0 * (first * f[a] - sum(&|m| f[a / 3 * 3 + m] * right[3 * m + a % 3])));
        let curvature = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let (i, j, k, l) = (a / 3, a % 3, b / 3, b % 3);
                let mut c = 4.0 * f[a] * f[b] - 2.0 * f[3 * i + l] * f[3 * k + j];
                if i == k {
                    c -= 2.0 * right[3 * l + j];
                }
                if j == l {
                    c -= 2.0 * left[3 * i + k];
                }
                if a == b {
                    c += 2.0 * first;
                }
                c
            })
        });
        Self { degree: 4.0, value: cofactor(f).iter().map(|x| x * x).sum(), slope, curvature }
    }

    /// `l1^a + l2^a + l3^a`, a function of the eigenvalues `c = l^2` of `C = F'F`.
    ///
    /// In the basis of the eigenvectors, `dS/dC = diag(h)` with `h(c) = a/2 c^(a/2 - 1)`, and its derivative holds
    /// `h'(c_i)` and the divided differences `(h(c_i) - h(c_j)) / (c_i - c_j)`, which are taken without
    /// cancellation where stretches agree.
    fn power_sum(f: &Tensor, exponent: f64) -> Self {
        let matrix = Matrix3::from_row_slice(f);
        let eigen = (matrix.transpose() * matrix).symmetric_eigen();
        let (c, vectors) = (eigen.eigenvalues, eigen.eigenvectors);
        let (half, power) = (0.5 * exponent, 0.5 * exponent - 1.0);
        let h = c.map(|c| half * c.powf(power));
        // F in the eigenvectors' basis on the right: columns F N_a.
        let turned = matrix * vectors;
        let mut slope = [0.0; 9];
        for (a, s) in slope.iter_mut().enumerate() {
            *s = (0..3).map(|m| 2.0 * h[m] * turned[(a / 3, m)] * vectors[(a % 3, m)]).sum();
        }
        let divided = Matrix3::from_fn(|a, b| {
            let ratio = (c[a] - c[b]) / c[b];
            if ratio == 0.0 {
                half * power * c[b].powf(power - 1.0)
            } else {
                h[b] / c[b] * (power * ratio.ln_1p()).exp_m1() / ratio
            }
        });
        // dP_iJ = 2 dF H + 2 F dH; dH = sum_ab divided_ab (N_a . dC N_b) N_a (x) N_b, dC = dF'F + F'dF.
        let plain: Matrix3<f64> = vectors * Matrix3::from_diagonal(&h) * vectors.transpose();
        let mut curvature = [[0.0; 9]; 9];
        for k in 0..3 {
            for l in 0..3 {
                // N_a . dC N_b for dF = e_k (x) e_l.
                let bent = Matrix3::from_fn(|a, b| {
                    divided[(a, b)] * (vectors[(l, a)] * turned[(k, b)] + turned[(k, a)] * vectors[(l, b)])
                });
                let change = 2.0 * turned * bent * vectors.transpose();
                for i in 0..3 {
                    for j in 0..3 {
                        curvature[3 * i + j][3 * k + l] =
                            change[(i, j)] + if i == k { 2.0 * plain[(l, j)] } else { 0.0 };
                    }
                }
            }
        }
        Self { degree: exponent, value: c.iter().map(|c| c.powf(half)).sum(), slope, curvature }
    }

    /// The measure without its volume: value and derivatives by the measure (`i`) and by `J`.
    fn distortion(&self, j: f64, keeps_volume: bool) -> EnergyDerivatives {
        let n = self.degree;
        if keeps_volume {
            let w = self.value - 3.0 - n * (j - 1.0);
            return EnergyDerivatives { w, i: 1.0, j: -n, ..Default::default() };
        }
        let third = n / 3.0;
        let scale = j.powf(-third);
        let bar = scale * self.value;
        EnergyDerivatives {
            w: bar - 3.0,
            i: scale,
            j: -third * bar / j,
            ii: 0.0,
            ij: -third * scale / j,
            jj: third * (third + 1.0) * bar / (j * j),
        }
    }
}

impl Response {
    fn add(&mut self, measure: &Measure, d: &EnergyDerivatives, g: &Tensor) {
        self.energy += d.w;
        for r in 0..9 {
            self.stress[r] += d.i * measure.slope[r] + d.j * g[r];
            let by_slope = d.ii * measure.slope[r] + d.ij * g[r];
            let by_cofactor = d.ij * measure.slope[r] + d.jj * g[r];
            for c in 0..9 {
                self.tangent[r][c] +=
                    d.i * measure.curvature[r][c] + by_slope * measure.slope[c] + by_cofactor * g[c];
            }
        }
    }
}

impl Rubber {
    /// What the displacement alone decides (all but the pressure's part) at the deformation gradient `f`.
    ///
    /// Returns infinite energy, and no stress, if `J <= 0`.
    pub fn response(&self, f: &Tensor) -> Response {
        let mut response = Response { energy: 0.0, stress: [0.0; 9], tangent: [[0.0; 9]; 9] };
        let j = determinant(f);
        if j.is_nan() || j <= 0.0 {
            response.energy = f64::INFINITY;
            return response;
        }
        let g = cofactor(f);
        let keeps_volume = self.volume == Volume::Incompressible;
        let mut slope_by_j = 0.0;
        let mut add = |measure: &Measure, d: &EnergyDerivatives| {
            slope_by_j += d.j;
            response.add(measure, d, &g);
        };
        match (&self.distortion, self.volume) {
            (_, Volume::LogLame(_)) => {
                // The classical form is not split: mu/2 (I1 - 3 - 2 ln J).
                let (mu, e) = (self.shear_modulus(), Measure::first_invariant(f));
                let w = 0.5 * mu * (e.value - 3.0) - mu * j.ln();
                let d =
                    EnergyDerivatives { w, i: 0.5 * mu, j: -mu / j, jj: mu / (j * j), ..Default::default() };
                add(&e, &d);
            }
            (Distortion::NeoHookean { shear_modulus }, _) => {
                let e = Measure::first_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(0.5 * shear_modulus));
            }
            (Distortion::MooneyRivlin { c10, c01 }, _) => {
                let e = Measure::first_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(*c10));
                let e = Measure::second_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(*c01));
            }
            (Distortion::Yeoh { constants }, _) => {
                let e = Measure::first_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).yeoh(constants));
            }
            (Distortion::Ogden { terms }, _) => {
                for (mu, alpha) in terms {
                    let e = Measure::power_sum(f, *alpha);
                    add(&e, &e.distortion(j, keeps_volume).scaled(mu / alpha));
                }
            }
        }
        let d = self.volume_derivatives(j);
        slope_by_j += d.j;
        response.energy += d.w;
        for r in 0..9 {
            response.stress[r] += d.j * g[r];
            for c in 0..9 {
                response.tangent[r][c] += d.jj * g[r] * g[c];
            }
        }
        add_cofactor_slope(f, slope_by_j, &mut response.tangent);
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> Vec<Rubber> {
        let distortions = [
            Distortion::NeoHookean { shear_modulus: 1.3 },
            Distortion::MooneyRivlin { c10: 0.2, c01: 0.5 },
            Distortion::Yeoh { constants: [0.5, -0.04, 0.02] },
            Distortion::Ogden { terms: vec![(1.2, 1.3), (0.02, 5.0), (-0.1, -2.0)] },
        ];
        let volumes = [
            Volume::Incompressible,
            Volume::BulkModulus(30.0),
            Volume::LogLame(3.0),
            Volume::DisplacementOnly(7.0),
        ];
        distortions
            .iter()
            .flat_map(|d| volumes.map(|volume| Rubber { distortion: d.clone(), volume, volume_barrier: 0.7 }))
            .collect()
    }

    const STATES: [Tensor; 6] = [
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [1.001, 0.002, 0.0, -0.0005, 0.9995, 0.001, 0.0003, 0.0, 1.0002],
        [1.2, 0.4, 0.1, -0.1, 0.8, -0.2, 0.3, 0.2, 0.9],
        [2.5, 1.0, -0.4, 0.3, 0.6, 0.2, 0.5, 0.1, 0.7],
        [0.3, -2.0, 0.1, 0.9, 0.7, 0.3, -0.2, 0.4, 1.3],
        // Two stretches agree: a turned diag(1.4, 1.4, 0.5).
        [0.84, -1.12, 0.0, 1.12, 0.84, 0.0, 0.0, 0.0, 0.5],
    ];

    /// Central differences with a sixth-order stencil.
    fn difference(f: &Tensor, a: usize, value: impl Fn(&Tensor) -> f64) -> f64 {
        let h = 2e-3;
        let at = |s: f64| {
            let mut g = *f;
            g[a] += s * h;
            value(&g)
        };
        (45.0 * (at(1.0) - at(-1.0)) - 9.0 * (at(2.0) - at(-2.0)) + (at(3.0) - at(-3.0))) / (60.0 * h)
    }

    #[test]
    fn stress_is_the_slope_of_the_energy_and_the_tangent_that_of_the_stress() {
        for rubber in laws() {
            for f in &STATES {
                let here = rubber.response(f);
                let largest = here.tangent.iter().flatten().fold(1.0, |m: f64, x| m.max(x.abs()));
                for k in 0..9 {
                    let slope = difference(f, k, |g| rubber.response(g).energy);
                    let error = (slope - here.stress[k]).abs();
                    assert!(error < 2e-9 * largest, "{rubber:?} {f:?} P[{k}] {slope} {}", here.stress[k]);
                    for m in 0..9 {
                        let slope = difference(f, k, |g| rubber.response(g).stress[m]);
                        let exact = here.tangent[m][k];
                        let error = (slope - exact).abs();
                        assert!(error < 2e-8 * largest, "{rubber:?} {f:?} A[{m}][{k}] {slope} {exact}");
                    }
                }
            }
        }
    }

    #[test]
    fn at_rest_there_is_no_stress_and_the_shear_modulus_is_the_one_announced() {
        for rubber in laws() {
            let rest = rubber.response(&STATES[0]);
            assert!(rest.energy.abs() < 1e-14 && rest.stress.iter().all(|p| p.abs() < 1e-13), "{rubber:?}");
            for (a, b) in [(1, 1), (2, 2), (5, 5), (1, 3), (6, 2)] {
                assert!((rest.tangent[a][b] - rubber.shear_modulus()).abs() < 1e-12, "{rubber:?}");
            }
        }
    }

    #[test]
    fn the_energy_does_not_see_rotations_before_or_after() {
        let (s, c) = 0.7f64.sin_cos();
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
            * Matrix3::new(1.0, 0.0, 0.0, 0.0, s, c, 0.0, -c, s);
        for rubber in laws() {
            for f in &STATES {
                let one = rubber.response(f).energy;
                let matrix = Matrix3::from_row_slice(f);
                for turned in [turn * matrix, matrix * turn] {
                    let turned = std::array::from_fn(|a| turned[(a / 3, a % 3)]);
                    let two = rubber.response(&turned).energy;
                    assert!((one - two).abs() < 1e-12 * (1.0 + one.abs()), "{rubber:?} {one} {two}");
                }
            }
        }
    }

    #[test]
    fn where_the_third_stretch_is_one_it_is_the_law_of_plane_strain() {
        for rubber in laws() {
            for p in
                [[1.0, 0.0, 0.0, 1.0], [1.2, 0.4, -0.1, 0.8], [0.3, -2.0, 0.9, 0.7], [1.1, 0.0, 0.0, 1.1]]
            {
                let plane = rubber.derivatives(&p);
                let space = rubber.response(&[p[0], p[1], 0.0, p[2], p[3], 0.0, 0.0, 0.0, 1.0]);
                let near = |a: f64, b: f64| (a - b).abs() < 1e-11 * (1.0 + a.abs());
                assert!(near(plane.w, space.energy), "{rubber:?} {p:?}");
                const PLANE: [usize; 4] = [0, 1, 3, 4];
                for a in 0..4 {
                    assert!(near(plane.first_piola(&p)[a], space.stress[PLANE[a]]), "{rubber:?} {p:?}");
                    for b in 0..4 {
                        let (one, two) = (plane.tangent(&p)[a][b], space.tangent[PLANE[a]][PLANE[b]]);
                        assert!(near(one, two), "{rubber:?} {p:?}: {one} {two}");
                    }
                }
            }
        }
    }

    #[test]
    fn ogden_with_the_exponents_two_and_minus_two_is_mooney_rivlin_where_the_volume_is_kept() {
        let (c10, c01) = (0.3, 0.4);
        let rubber =
            |distortion| Rubber { distortion, volume: Volume::BulkModulus(1.0), volume_barrier: 0.0 };
        let mooney = rubber(Distortion::MooneyRivlin { c10, c01 });
        let ogden = rubber(Distortion::Ogden { terms: vec![(2.0 * c10, 2.0), (-2.0 * c01, -2.0)] });
        for f in &STATES {
            // I2 / J^(4/3) = tr C^-1 J^(2/3) for any J: the two laws agree everywhere.
            let (one, two) = (mooney.response(f), ogden.response(f));
            assert!((one.energy - two.energy).abs() < 1e-12 * (1.0 + one.energy), "{f:?}");
            for (a, b) in one.tangent.iter().flatten().zip(two.tangent.iter().flatten()) {
                assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{f:?}: {a} {b}");
            }
        }
    }
}

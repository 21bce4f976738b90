//! Tensors and measures of deformation in three dimensions, and stress and tangent from them.
//!
//! Every law is a function of the volume ratio `J` and of *measures* of the deformation, each homogeneous in
//! `F`: `I1 = F:F`, `I2 = G:G` with `G = cof F`, and `S = l1^a + l2^a + l3^a` of the principal stretches. A
//! measure `e` of degree `n` enters as `e / J^(n/3) - 3` where the volume can change, and as `e - 3 - n (J -
//! 1)` where it cannot (see [`HyperelasticLaw`](crate::HyperelasticLaw)). First Piola stress and tangent
//! follow by the chain rule, from slope and curvature of `e`:
//!
//! `P = w_e e' + w_J G`, `dP/dF = w_e e'' + w_ee e'(x)e' + w_eJ (e'(x)G + G(x)e') + w_JJ G(x)G + w_J dG/dF`.

use crate::plane::EnergyDerivatives;

/// A tensor, row after row: `F11, F12, F13, F21, ...`.
pub type Tensor = [f64; 9];

/// The response of a rubber to a deformation gradient, without the pressure field's part.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Energy per reference volume in Pa; infinite if `J <= 0` and beyond the limit of the law.
    pub energy: f64,
    /// First Piola stress in Pa.
    pub stress: Tensor,
    /// `dP/dF` in Pa, symmetric.
    pub tangent: [Tensor; 9],
}

/// `det F`.
#[inline]
pub fn determinant(f: &Tensor) -> f64 {
    f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6])
        + f[2] * (f[3] * f[7] - f[4] * f[6])
}

/// `cof F = J F^-T = dJ/dF`.
#[inline]
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

/// Adds `factor dG/dF` to a tangent: the derivative of the cofactor, `e_ikm e_jln F_mn` with the permutation
/// symbol `e`.
#[inline]
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

/// A measure of the deformation: a homogeneous function of `F` that is 3 at rest.
pub(crate) struct Measure {
    /// The degree of homogeneity.
    pub(crate) degree: f64,
    /// The value at a deformation gradient `F`.
    pub(crate) value: f64,
    /// The derivative by `F`.
    pub(crate) slope: Tensor,
    /// The second derivative by `F`.
    pub(crate) curvature: [Tensor; 9],
}

impl Measure {
    /// `I1 = F:F`.
    pub(crate) fn first_invariant(f: &Tensor) -> Self {
        let mut curvature = [[0.0; 9]; 9];
        for k in 0..9 {
            curvature[k][k] = 2.0;
        }
        Self { degree: 2.0, value: f.iter().map(|x| x * x).sum(), slope: f.map(|x| 2.0 * x), curvature }
    }

    /// `I2 = G:G = (I1^2 - tr C^2) / 2` with `C = F^T F`. Its slope is `2 (I1 F - F C)`.
    pub(crate) fn second_invariant(f: &Tensor) -> Self {
        let first: f64 = f.iter().map(|x| x * x).sum();
        let sum = |term: &dyn Fn(usize) -> f64| term(0) + term(1) + term(2);
        // C = F^T F and B = F F^T.
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

    /// The part of the measure that distortion changes, less its value at rest, with its derivatives by the
    /// measure (`i`) and by `J`.
    pub(crate) fn distortion(&self, j: f64, keeps_volume: bool) -> EnergyDerivatives {
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
    /// Adds the contribution of a measure, from the energy's derivatives `d` by the measure (`i`) and by `J`,
    /// and `g = cof F`; the term with the slope of the cofactor is left out.
    pub(crate) fn add(&mut self, measure: &Measure, d: &EnergyDerivatives, g: &Tensor) {
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

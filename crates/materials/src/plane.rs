//! Tensors and invariants in plane strain, and an energy's derivatives by them.
//!
//! With `F33 = 1` every isotropic energy is a function `w(I, J)` of `I = F:F` (in the plane) and `J = det F`:
//! the three-dimensional invariants are `I1 = I + 1` and `I2 = I + J^2`. First Piola stress and tangent
//! follow from six derivatives of `w`, exactly and without any eigenvalue problem:
//!
//! `P = 2 w_I F + w_J G`, `G = cof F`,
//! `dP/dF = 2 w_I 1 + 4 w_II F(x)F + 2 w_IJ (F(x)G + G(x)F) + w_JJ G(x)G + w_J dG/dF`.

/// `w(I, J)` per reference volume in Pa and its derivatives by `I` and `J`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergyDerivatives {
    /// `w`, zero at rest.
    pub w: f64,
    /// `dw/dI`.
    pub i: f64,
    /// `dw/dJ`.
    pub j: f64,
    /// `d2w/dI2`.
    pub ii: f64,
    /// `d2w/dIdJ`.
    pub ij: f64,
    /// `d2w/dJ2`.
    pub jj: f64,
}

/// An in-plane tensor, `[F11, F12, F21, F22]`.
pub type Tensor = [f64; 4];

/// `det F` of an in-plane tensor; `F33 = 1`.
#[inline]
pub fn determinant(f: &Tensor) -> f64 {
    f[0] * f[3] - f[1] * f[2]
}

/// `cof F = J F^-T = dJ/dF` of an in-plane tensor.
#[inline]
pub fn cofactor(f: &Tensor) -> Tensor {
    [f[3], -f[2], -f[1], f[0]]
}

impl EnergyDerivatives {
    /// First Piola stress `[P11, P12, P21, P22]` in Pa.
    #[inline]
    pub fn first_piola(&self, f: &Tensor) -> Tensor {
        let g = cofactor(f);
        std::array::from_fn(|a| 2.0 * self.i * f[a] + self.j * g[a])
    }

    /// Tangent `dP/dF`, 4 x 4 and symmetric, in Pa.
    #[inline]
    pub fn tangent(&self, f: &Tensor) -> [[f64; 4]; 4] {
        let g = cofactor(f);
        let mut a = [[0.0; 4]; 4];
        for r in 0..4 {
            for c in 0..4 {
                a[r][c] = 4.0 * self.ii * f[r] * f[c]
                    + 2.0 * self.ij * (f[r] * g[c] + g[r] * f[c])
                    + self.jj * g[r] * g[c];
            }
            a[r][r] += 2.0 * self.i;
        }
        a[0][3] += self.j;
        a[3][0] += self.j;
        a[1][2] -= self.j;
        a[2][1] -= self.j;
        a
    }

    /// The energy and its derivatives times `s`.
    pub(crate) fn scaled(&self, s: f64) -> Self {
        Self {
            w: s * self.w,
            i: s * self.i,
            j: s * self.j,
            ii: s * self.ii,
            ij: s * self.ij,
            jj: s * self.jj,
        }
    }

    /// The sum with another energy and its derivatives.
    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self {
            w: self.w + o.w,
            i: self.i + o.i,
            j: self.j + o.j,
            ii: self.ii + o.ii,
            ij: self.ij + o.ij,
            jj: self.jj + o.jj,
        }
    }

    /// The energy that is a function of this one, by the chain rule. Call with the derivatives of an
    /// invariant less its value at rest, and with the function and its derivatives at that value.
    pub(crate) fn chained(&self, outer: &FunctionOfInvariant) -> Self {
        let FunctionOfInvariant { value, slope, curvature } = *outer;
        Self {
            w: value,
            i: slope * self.i,
            j: slope * self.j,
            ii: slope * self.ii + curvature * self.i * self.i,
            ij: slope * self.ij + curvature * self.i * self.j,
            jj: slope * self.jj + curvature * self.j * self.j,
        }
    }
}

/// An energy as a function of one invariant: its value in Pa, and its first two derivatives by the invariant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FunctionOfInvariant {
    pub(crate) value: f64,
    pub(crate) slope: f64,
    pub(crate) curvature: f64,
}

/// `I1 - 3 - 2 (J - 1)`: equal to `I1 - 3` where `J = 1`, and stationary at rest.
fn plain_first_invariant(i: f64, j: f64) -> EnergyDerivatives {
    EnergyDerivatives { w: i - 2.0 - 2.0 * (j - 1.0), i: 1.0, j: -2.0, ..Default::default() }
}

/// `I2 - 3 - 4 (J - 1)`: equal to `I2 - 3` where `J = 1`, and stationary at rest.
pub(crate) fn plain_second_invariant(i: f64, j: f64) -> EnergyDerivatives {
    EnergyDerivatives {
        w: i + j * j - 3.0 - 4.0 * (j - 1.0),
        i: 1.0,
        j: 2.0 * j - 4.0,
        jj: 2.0,
        ..Default::default()
    }
}

/// The first invariant less its value at rest, in the form for a rubber that keeps its volume or for one that
/// does not.
pub(crate) fn first_invariant_for(i: f64, j: f64, keeps_volume: bool) -> EnergyDerivatives {
    if keeps_volume { plain_first_invariant(i, j) } else { first_invariant(i, j) }
}

/// `J^(-2/3) I1 - 3`.
fn first_invariant(i: f64, j: f64) -> EnergyDerivatives {
    let a = j.powf(-2.0 / 3.0);
    let bar = a * (i + 1.0);
    EnergyDerivatives {
        w: bar - 3.0,
        i: a,
        j: -2.0 / 3.0 * bar / j,
        ii: 0.0,
        ij: -2.0 / 3.0 * a / j,
        jj: 10.0 / 9.0 * bar / (j * j),
    }
}

/// `J^(-4/3) I2 - 3`.
pub(crate) fn second_invariant(i: f64, j: f64) -> EnergyDerivatives {
    let b = j.powf(-4.0 / 3.0);
    let j2 = j * j;
    EnergyDerivatives {
        w: b * (i + j2) - 3.0,
        i: b,
        j: b * (-4.0 / 3.0 * i / j + 2.0 / 3.0 * j),
        ii: 0.0,
        ij: -4.0 / 3.0 * b / j,
        jj: b * (28.0 / 9.0 * i / j2 - 2.0 / 9.0),
    }
}

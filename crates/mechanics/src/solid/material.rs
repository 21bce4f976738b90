//! Hyperelastic rubber in plane strain, as a function of two scalars.
//!
//! With `F33 = 1` every isotropic energy is a function `w(I, J)` of `I = F:F` (in the plane) and `J = det F`:
//! the three-dimensional invariants are `I1 = I + 1` and `I2 = I + J^2`. First Piola stress and tangent follow
//! from six derivatives of `w`, exactly and without any eigenvalue problem:
//!
//! `P = 2 w_I F + w_J G`, `G = cof F`,
//! `dP/dF = 2 w_I 1 + 4 w_II F(x)F + 2 w_IJ (F(x)G + G(x)F) + w_JJ G(x)G + w_J dG/dF`.

/// The law of distortion.
///
/// Where the volume can change, it is a function of `F / J^(1/3)`. An incompressible rubber takes it as a function
/// of `F` itself, less its slope at rest times `J - 1`: where `J = 1` that is the same, and it is a polynomial
/// for the first three laws, so that the quadrature of the element is exact.
#[derive(Debug, Clone, PartialEq)]
pub enum Distortion {
    /// `mu/2 (I1 - 3)`.
    NeoHookean {
        /// Shear modulus `mu` in Pa.
        shear_modulus: f64,
    },
    /// `c10 (I1 - 3) + c01 (I2 - 3)`.
    MooneyRivlin {
        /// Factor of `I1 - 3` in Pa.
        c10: f64,
        /// Factor of `I2 - 3` in Pa.
        c01: f64,
    },
    /// `c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3`.
    Yeoh {
        /// The factors `c10`, `c20`, `c30` in Pa.
        constants: [f64; 3],
    },
    /// `sum_p mu_p / alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3)`, so that `mu = sum mu_p alpha_p / 2`.
    Ogden {
        /// The pairs `(mu_p in Pa, alpha_p)`; no exponent may be zero.
        terms: Vec<(f64, f64)>,
    },
}

/// How a material answers to a change of volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volume {
    /// `J = 1`, kept by a pressure.
    Incompressible,
    /// `kappa/2 (J - 1)^2`, with the pressure as a field of its own.
    BulkModulus(f64),
    /// The compressible neo-Hookean solid `mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2` with the shear modulus of
    /// the distortion, without a pressure field: for materials far from incompressible.
    LogLame(f64),
    /// `kappa/4 (J^2 - 1 - 2 ln J)` beside the distortion, without a pressure field: locks where `kappa/mu` is large.
    DisplacementOnly(f64),
}

/// A rubber: how it distorts and how it changes volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Rubber {
    /// The law of distortion.
    pub distortion: Distortion,
    /// The law of volume.
    pub volume: Volume,
    /// Factor of `mu (J - 1 - ln J)`, added to the energy of an *incompressible* rubber at every quadrature point.
    ///
    /// It is zero with its slope where `J = 1`, so that it changes nothing but the discretisation: it keeps `J` of
    /// single points from running to zero where the mesh is coarse, and takes wrinkles of the size of an element
    /// out of the way of Newton's method. [`Rubber::USUAL_BARRIER`] gives the smallest error on the closed form of
    /// the layer over 5 to 40 % compression.
    pub volume_barrier: f64,
}

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
pub fn determinant(f: &Tensor) -> f64 {
    f[0] * f[3] - f[1] * f[2]
}

/// `cof F = J F^-T = dJ/dF` of an in-plane tensor.
pub fn cofactor(f: &Tensor) -> Tensor {
    [f[3], -f[2], -f[1], f[0]]
}

impl Rubber {
    /// A [`Rubber::volume_barrier`] that serves.
    pub const USUAL_BARRIER: f64 = 1.5;

    /// A neo-Hookean rubber with shear modulus `mu` in Pa that keeps its volume, with the usual barrier.
    pub fn neo_hookean(shear_modulus: f64) -> Self {
        Self {
            distortion: Distortion::NeoHookean { shear_modulus },
            volume: Volume::Incompressible,
            volume_barrier: Self::USUAL_BARRIER,
        }
    }

    /// Shear modulus at zero strain in Pa.
    pub fn shear_modulus(&self) -> f64 {
        match &self.distortion {
            Distortion::NeoHookean { shear_modulus } => *shear_modulus,
            Distortion::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
            Distortion::Yeoh { constants } => 2.0 * constants[0],
            Distortion::Ogden { terms } => terms.iter().map(|(mu, alpha)| 0.5 * mu * alpha).sum(),
        }
    }

    /// The compliance `1/kappa` in 1/Pa that the pressure field sees, or `None` if there is no such field.
    pub fn pressure_compliance(&self) -> Option<f64> {
        match self.volume {
            Volume::Incompressible => Some(0.0),
            Volume::BulkModulus(kappa) => Some(1.0 / kappa),
            Volume::LogLame(_) | Volume::DisplacementOnly(_) => None,
        }
    }

    /// Whether the energy has a value where `J <= 0`: an incompressible rubber's is a polynomial, but for Ogden's law and
    /// the barrier. Single points of an element can then turn inside out while the element keeps its volume.
    pub fn knows_inside_out(&self) -> bool {
        self.keeps_volume()
            && self.volume_barrier == 0.0
            && !matches!(self.distortion, Distortion::Ogden { .. })
    }

    fn keeps_volume(&self) -> bool {
        self.volume == Volume::Incompressible
    }

    /// The energy that the displacement alone decides (all but the pressure's part) at the in-plane tensor `f`.
    ///
    /// Returns a value with `w` infinite if `J <= 0`, unless [`Rubber::knows_inside_out`].
    pub fn derivatives(&self, f: &Tensor) -> EnergyDerivatives {
        let j = determinant(f);
        if j.is_nan() || (j <= 0.0 && !self.knows_inside_out()) {
            return EnergyDerivatives { w: f64::INFINITY, ..Default::default() };
        }
        let i = f.iter().map(|x| x * x).sum::<f64>();
        type Invariant = fn(f64, f64) -> EnergyDerivatives;
        let (first, second): (Invariant, Invariant) = if self.keeps_volume() {
            (plain_first_invariant, plain_second_invariant)
        } else {
            (first_invariant, second_invariant)
        };
        let powers = if self.keeps_volume() { plain_stretch_powers } else { stretch_powers };
        let mut d = match (&self.distortion, self.volume) {
            (_, Volume::LogLame(_)) => {
                // The classical form is not split: mu/2 (I1 - 3 - 2 ln J).
                let mu = self.shear_modulus();
                EnergyDerivatives {
                    w: 0.5 * mu * (i - 2.0) - mu * j.ln(),
                    i: 0.5 * mu,
                    j: -mu / j,
                    jj: mu / (j * j),
                    ..Default::default()
                }
            }
            (Distortion::NeoHookean { shear_modulus }, _) => first(i, j).scaled(0.5 * shear_modulus),
            (Distortion::MooneyRivlin { c10, c01 }, _) => {
                first(i, j).scaled(*c10).plus(&second(i, j).scaled(*c01))
            }
            (Distortion::Yeoh { constants }, _) => first(i, j).yeoh(constants),
            (Distortion::Ogden { terms }, _) => {
                // I - 2J without cancellation: it vanishes where the two stretches agree.
                let spread = (f[0] - f[3]).powi(2) + (f[1] + f[2]).powi(2);
                terms.iter().fold(EnergyDerivatives::default(), |sum, (mu, alpha)| {
                    sum.plus(&powers(spread, j, *alpha).scaled(mu / alpha))
                })
            }
        };
        let volume = self.volume_derivatives(j);
        d.w += volume.w;
        d.j += volume.j;
        d.jj += volume.jj;
        d
    }

    /// The volume's own part of the energy and its derivatives by `J`.
    pub(crate) fn volume_derivatives(&self, j: f64) -> EnergyDerivatives {
        let (w, slope, curvature) = match self.volume {
            Volume::Incompressible if self.volume_barrier == 0.0 => (0.0, 0.0, 0.0),
            Volume::Incompressible => {
                let b = self.volume_barrier * self.shear_modulus();
                (b * (j - 1.0 - (j - 1.0).ln_1p()), b * (1.0 - 1.0 / j), b / (j * j))
            }
            Volume::BulkModulus(_) => (0.0, 0.0, 0.0),
            Volume::LogLame(lambda) => {
                let log = j.ln();
                (0.5 * lambda * log * log, lambda * log / j, lambda * (1.0 - log) / (j * j))
            }
            Volume::DisplacementOnly(kappa) => (
                0.25 * kappa * (j * j - 1.0 - 2.0 * j.ln()),
                0.5 * kappa * (j - 1.0 / j),
                0.5 * kappa * (1.0 + 1.0 / (j * j)),
            ),
        };
        EnergyDerivatives { w, j: slope, jj: curvature, ..Default::default() }
    }
}

impl EnergyDerivatives {
    /// First Piola stress `[P11, P12, P21, P22]` in Pa.
    pub fn first_piola(&self, f: &Tensor) -> Tensor {
        let g = cofactor(f);
        std::array::from_fn(|a| 2.0 * self.i * f[a] + self.j * g[a])
    }

    /// Tangent `dP/dF`, 4 x 4 and symmetric, in Pa.
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

    fn plus(&self, o: &Self) -> Self {
        Self {
            w: self.w + o.w,
            i: self.i + o.i,
            j: self.j + o.j,
            ii: self.ii + o.ii,
            ij: self.ij + o.ij,
            jj: self.jj + o.jj,
        }
    }

    /// `c1 w + c2 w^2 + c3 w^3`, the law of Yeoh where `w` is the first invariant less its value at rest.
    pub(crate) fn yeoh(&self, [c1, c2, c3]: &[f64; 3]) -> Self {
        let slope = c1 + 2.0 * c2 * self.w + 3.0 * c3 * self.w * self.w;
        let curvature = 2.0 * c2 + 6.0 * c3 * self.w;
        Self {
            w: c1 * self.w + c2 * self.w * self.w + c3 * self.w.powi(3),
            i: slope * self.i,
            j: slope * self.j,
            ii: slope * self.ii + curvature * self.i * self.i,
            ij: slope * self.ij + curvature * self.i * self.j,
            jj: slope * self.jj + curvature * self.j * self.j,
        }
    }
}

/// `I1 - 3 - 2 (J - 1)`: where `J = 1` the first invariant, and stationary at rest.
fn plain_first_invariant(i: f64, j: f64) -> EnergyDerivatives {
    EnergyDerivatives { w: i - 2.0 - 2.0 * (j - 1.0), i: 1.0, j: -2.0, ..Default::default() }
}

/// `I2 - 3 - 4 (J - 1)`: where `J = 1` the second invariant, and stationary at rest.
fn plain_second_invariant(i: f64, j: f64) -> EnergyDerivatives {
    EnergyDerivatives {
        w: i + j * j - 3.0 - 4.0 * (j - 1.0),
        i: 1.0,
        j: 2.0 * j - 4.0,
        jj: 2.0,
        ..Default::default()
    }
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
fn second_invariant(i: f64, j: f64) -> EnergyDerivatives {
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

/// `J^(-alpha/3) (l1^alpha + l2^alpha + 1) - 3`, where `spread = I - 2J`.
///
/// `l1^alpha + l2^alpha = 2 J^(alpha/2) cosh(b acosh z)` with `b = alpha/2` and `z = I/(2J)`, a Chebyshev function
/// of `z`: smooth where the stretches coincide (`z = 1`), which formulas in `l1` and `l2` are not.
fn stretch_powers(spread: f64, j: f64, alpha: f64) -> EnergyDerivatives {
    let (t, t1, t2) = chebyshev(0.5 * alpha, 0.5 * spread / j);
    let z = 1.0 + 0.5 * spread / j;
    let e = alpha / 6.0;
    let je = j.powf(e);
    let (j1, j2) = (je / j, je / (j * j));
    let out = (-2.0 * e * j.ln()).exp();
    EnergyDerivatives {
        w: 2.0 * je * t + out - 3.0,
        i: j1 * t1,
        j: 2.0 * j1 * (e * t - z * t1) - 2.0 * e * out / j,
        ii: 0.5 * j2 * t2,
        ij: j2 * ((e - 1.0) * t1 - z * t2),
        jj: 2.0 * j2 * ((e - 1.0) * (e * t - z * t1) - z * ((e - 1.0) * t1 - z * t2))
            + 2.0 * e * (2.0 * e + 1.0) * out / (j * j),
    }
}

/// `l1^alpha + l2^alpha - 2 - alpha (J - 1)`, stationary at rest.
fn plain_stretch_powers(spread: f64, j: f64, alpha: f64) -> EnergyDerivatives {
    let (t, t1, t2) = chebyshev(0.5 * alpha, 0.5 * spread / j);
    let z = 1.0 + 0.5 * spread / j;
    let b = 0.5 * alpha;
    let jb = j.powf(b);
    let (j1, j2) = (jb / j, jb / (j * j));
    EnergyDerivatives {
        w: 2.0 * jb * t - 2.0 - alpha * (j - 1.0),
        i: j1 * t1,
        j: 2.0 * j1 * (b * t - z * t1) - alpha,
        ii: 0.5 * j2 * t2,
        ij: j2 * ((b - 1.0) * t1 - z * t2),
        jj: 2.0 * j2 * ((b - 1.0) * (b * t - z * t1) - z * ((b - 1.0) * t1 - z * t2)),
    }
}

/// `T(z) = cosh(b acosh z)` with its first two derivatives, for `z = 1 + excess`, `excess >= 0`.
fn chebyshev(b: f64, excess: f64) -> (f64, f64, f64) {
    if excess < 0.05 {
        // T is the hypergeometric series in -excess/2 with coefficients (-b)_k (b)_k / ((1/2)_k k!).
        let (mut t, mut t1, mut t2) = (1.0, 0.0, 0.0);
        let mut coefficient = 1.0;
        let mut power = [0.0, 0.0, 1.0]; // excess^(k-2), excess^(k-1), excess^k
        for k in 0..40 {
            let kf = f64::from(k);
            coefficient *= -0.5 * (kf - b) * (kf + b) / ((kf + 0.5) * (kf + 1.0));
            power = [power[1], power[2], power[2] * excess];
            let n = kf + 1.0;
            t += coefficient * power[2];
            t1 += coefficient * n * power[1];
            let second = coefficient * n * (n - 1.0) * power[0];
            t2 += second;
            if k > 2 && second.abs() <= 1e-18 * t2.abs() {
                break;
            }
        }
        (t, t1, t2)
    } else {
        let root = (excess * (excess + 2.0)).sqrt();
        let angle = (excess + root).ln_1p();
        let t = (b * angle).cosh();
        let t1 = b * (b * angle).sinh() / root;
        let z = 1.0 + excess;
        (t, t1, (b * b * t - z * t1) / (root * root))
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

    const STATES: [Tensor; 5] = [
        [1.0, 0.0, 0.0, 1.0],
        [1.001, 0.002, -0.0005, 0.9995],
        [1.2, 0.4, -0.1, 0.8],
        [2.5, 1.0, 0.3, 0.6],
        [0.3, -2.0, 0.9, 0.7],
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
                let d = rubber.derivatives(f);
                let (p, a) = (d.first_piola(f), d.tangent(f));
                for k in 0..4 {
                    let slope = difference(f, k, |g| rubber.derivatives(g).w);
                    assert!(
                        (slope - p[k]).abs() < 2e-9 * (1.0 + p[k].abs()),
                        "{rubber:?} {f:?} P[{k}] {slope} {}",
                        p[k]
                    );
                    for m in 0..4 {
                        let slope = difference(f, k, |g| rubber.derivatives(g).first_piola(g)[m]);
                        assert!(
                            (slope - a[m][k]).abs() < 2e-8 * (1.0 + a[m][k].abs()),
                            "{rubber:?} {f:?} A[{m}][{k}] {slope} {}",
                            a[m][k]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn at_rest_there_is_no_stress_and_the_shear_modulus_is_the_one_announced() {
        for rubber in laws() {
            let f = [1.0, 0.0, 0.0, 1.0];
            let d = rubber.derivatives(&f);
            assert!(d.w.abs() < 1e-14 && d.first_piola(&f).iter().all(|p| p.abs() < 1e-13), "{rubber:?}");
            assert!((d.tangent(&f)[1][1] - rubber.shear_modulus()).abs() < 1e-12, "{rubber:?}");
        }
    }

    #[test]
    fn the_energy_does_not_see_rotations() {
        for rubber in laws() {
            for f in &STATES {
                let (s, c) = 0.7f64.sin_cos();
                let turned =
                    [c * f[0] - s * f[2], c * f[1] - s * f[3], s * f[0] + c * f[2], s * f[1] + c * f[3]];
                let (one, two) = (rubber.derivatives(f).w, rubber.derivatives(&turned).w);
                assert!((one - two).abs() < 1e-13 * (1.0 + one.abs()));
            }
        }
    }

    #[test]
    fn ogden_with_one_exponent_two_is_neo_hookean() {
        let ogden = Rubber {
            distortion: Distortion::Ogden { terms: vec![(1.3, 2.0)] },
            volume: Volume::Incompressible,
            volume_barrier: Rubber::USUAL_BARRIER,
        };
        let neo = Rubber::neo_hookean(1.3);
        assert_ne!(ogden.derivatives(&STATES[3]).w, 0.0);
        for f in &STATES {
            let (a, b) = (ogden.derivatives(f), neo.derivatives(f));
            for (x, y) in [(a.w, b.w), (a.i, b.i), (a.j, b.j), (a.ii, b.ii), (a.ij, b.ij), (a.jj, b.jj)] {
                assert!((x - y).abs() < 1e-11 * (1.0 + y.abs()), "{f:?}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn ogden_is_a_sum_of_powers_of_the_principal_stretches() {
        let (mu, alpha) = (0.8, -3.3);
        let rubber = Rubber {
            distortion: Distortion::Ogden { terms: vec![(mu, alpha)] },
            volume: Volume::BulkModulus(1.0),
            volume_barrier: 0.0,
        };
        let (l1, l2) = (1.9f64, 0.4f64);
        let scale = (l1 * l2).powf(-1.0 / 3.0);
        let direct = mu / alpha * ([l1, l2, 1.0].iter().map(|l| (l * scale).powf(alpha)).sum::<f64>() - 3.0);
        assert!((rubber.derivatives(&[l1, 0.0, 0.0, l2]).w - direct).abs() < 1e-13 * direct.abs());
    }
}

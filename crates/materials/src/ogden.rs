//! The law of Ogden (Proceedings of the Royal Society A 326, 565-584, 1972): sums of powers of the principal
//! stretches.

use nalgebra::Matrix3;

use crate::plane::EnergyDerivatives;
use crate::space::{Measure, Tensor};

/// `J^(-alpha/3) (l1^alpha + l2^alpha + 1) - 3`, where `spread = I - 2J`.
///
/// `l1^alpha + l2^alpha = 2 J^(alpha/2) cosh(b acosh z)` with `b = alpha/2` and `z = I/(2J)`, a Chebyshev
/// function of `z`: smooth where the stretches coincide (`z = 1`), which formulas in `l1` and `l2` are not.
pub(crate) fn stretch_powers(spread: f64, j: f64, alpha: f64) -> EnergyDerivatives {
    let (t, t1, t2) = chebyshev(0.5 * alpha, 0.5 * spread / j);
    let z = 1.0 + 0.5 * spread / j;
    let e = alpha / 6.0;
    let je = j.powf(e);
    let (j1, j2) = (je / j, je / (j * j));
    // The power of the stretch across the plane.
    let across = (-2.0 * e * j.ln()).exp();
    EnergyDerivatives {
        w: 2.0 * je * t + across - 3.0,
        i: j1 * t1,
        j: 2.0 * j1 * (e * t - z * t1) - 2.0 * e * across / j,
        ii: 0.5 * j2 * t2,
        ij: j2 * ((e - 1.0) * t1 - z * t2),
        jj: 2.0 * j2 * ((e - 1.0) * (e * t - z * t1) - z * ((e - 1.0) * t1 - z * t2))
            + 2.0 * e * (2.0 * e + 1.0) * across / (j * j),
    }
}

/// `l1^alpha + l2^alpha - 2 - alpha (J - 1)`, stationary at rest.
pub(crate) fn plain_stretch_powers(spread: f64, j: f64, alpha: f64) -> EnergyDerivatives {
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

impl Measure {
    /// `l1^a + l2^a + l3^a`, a function of the eigenvalues `c = l^2` of `C = F'F`.
    ///
    /// In the basis of the eigenvectors, `dS/dC = diag(h)` with `h(c) = a/2 c^(a/2 - 1)`, and its derivative
    /// holds `h'(c_i)` and the divided differences `(h(c_i) - h(c_j)) / (c_i - c_j)`, which are taken without
    /// cancellation where stretches agree.
    pub(crate) fn power_sum(f: &Tensor, exponent: f64) -> Self {
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
}

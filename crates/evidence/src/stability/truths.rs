//! Independent knowledge: reference values, and the closed form evaluated in another way than in the
//! mechanics crate.

use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use std::f64::consts::PI;

/// 4 pi eps0.
pub(super) const FOUR_PI_EPS0: f64 = 4.0 * PI * VACUUM_PERMITTIVITY;

/// C / (4 pi eps0 a) of the isolated cube (Helsing and Perfekt 2013).
pub(super) const CUBE: f64 = 0.660_678_154_099_57;
/// C / (eps0 a) of a cube of side a in a grounded cube of side 2a; known to 1e-10.
pub(super) const CUBE_IN_CUBE: f64 = 19.127_134_997;
/// Relative uncertainty of [`CUBE_IN_CUBE`].
pub(super) const CUBE_IN_CUBE_ERROR: f64 = 1e-10;
/// C / (4 pi eps0 a) of two square sheets a tenth of their side apart.
pub(super) const PLATES_TENTH: f64 = 1.039_044_814_755;
/// C / (4 pi eps0 a) of two square sheets their side apart.
pub(super) const PLATES_SIDE: f64 = 0.266_026_251_586;

/// The state of the layer from plain bisection of eq. (40), which loses digits below a compression of about
/// 1e-3.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    n: f64,
    theta: f64,
}

impl Layer {
    pub(super) fn new(compression: f64) -> Self {
        let theta = |n: f64| n.sinh().atan();
        let (mut low, mut high) = (1e-9, 50.0);
        for _ in 0..200 {
            let n: f64 = 0.5 * (low + high);
            if n / (n.cosh() * theta(n)) > 1.0 - compression {
                low = n;
            } else {
                high = n;
            }
        }
        Self { n: low, theta: theta(low) }
    }

    /// f(x2) as printed in eq. (37), at a share of the thickness.
    pub(super) fn stretch(&self, share: f64) -> f64 {
        (self.theta * (1.0 - share)).cos() / self.theta.cos()
    }

    /// g(x2) over the thickness as printed in eq. (38), at a share of the thickness.
    pub(super) fn height(&self, share: f64) -> f64 {
        let inner = (self.theta * (1.0 - share)).tan().asinh();
        self.theta.cos() / self.theta * (self.n - inner)
    }

    /// |F| / (2 w L mu) of eq. (50) with B of eq. (45), as printed; `a` and `b` are the two lengths over H.
    pub(super) fn force(&self, a: f64, b: f64) -> f64 {
        let Self { n, theta } = *self;
        let lambda = n.cosh();
        let mean = (2.0 * n).sinh() / (2.0 * n);
        let constant =
            mean * (1.0 + 0.5 * (theta * a).powi(2)) - n.tanh() / (4.0 * n) - 0.25 / lambda.powi(2);
        lambda * (constant - 0.5 / lambda.powi(2) - (theta * b * lambda).powi(2) / 6.0)
    }
}

/// |F| / (2 w L mu) at a tiny compression, to first order in the compression.
pub(super) fn force_at_first(compression: f64, a: f64, b: f64) -> f64 {
    3.0 * compression * (1.5 + 0.5 * a * a - b * b / 6.0)
}

/// t/T, the root of s^2 - s^-2 = -k, by bisection.
pub(super) fn thinning(k: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let s: f64 = 0.5 * (low + high);
        if s * s - 1.0 / (s * s) < -k {
            low = s;
        } else {
            high = s;
        }
    }
    high
}

/// C / (4 pi eps0) of a prolate spheroid of semi-axes a > b = b, m.
pub(super) fn spheroid(a: f64, b: f64) -> f64 {
    (a * a - b * b).sqrt() / (a / b).acosh()
}

/// The limits of C / (4 pi eps0) of a needle of square cross-section, m: those of the spheroid inside it, and
/// of the best of some spheroids around it.
pub(super) fn needle(length: f64, side: f64) -> [f64; 2] {
    let (a, b) = (0.5 * length, 0.5 * side);
    // Spheroids through the corners: a^2 / A^2 + 2 b^2 / B^2 = 1.
    let around = (1..100).map(|k| f64::from(k) * 0.01).map(|q| {
        let (long, short) = (a / (1.0 - q).sqrt(), b * (2.0 / q).sqrt());
        if long > short { spheroid(long, short) } else { f64::INFINITY }
    });
    [spheroid(a, b), around.fold(f64::INFINITY, f64::min)]
}

/// The limits of the capacitance of two facing square sheets of side 1 m at the distance `gap`, F. The upper
/// one is that of parallel plates with the edges of two strips, of which the corners take away less than eps0
/// times the side; the lower one takes that off, but is at least eps0 A/d, which the uniform flux between the
/// sheets proves.
pub(super) fn near_plates(gap: f64) -> [f64; 2] {
    let edges = 2.0 / PI * (1.0 + (2.0 * PI / gap).ln());
    [
        VACUUM_PERMITTIVITY * (1.0 / gap + edges - 1.0).max(1.0 / gap),
        VACUUM_PERMITTIVITY * (1.0 / gap + edges),
    ]
}

/// The two-terminal capacitance of two unit cubes with their middles at this distance, F, and its relative
/// error: a cube has no quadrupole, and the effect of the charges that one cube induces on the other falls as
/// the fourth power of the distance.
pub(super) fn far_cubes(distance: f64) -> (f64, f64) {
    let alone = CUBE * FOUR_PI_EPS0;
    (0.5 * alone / (1.0 - CUBE / distance), distance.powi(-3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layer_has_the_values_of_the_audited_paper() {
        for (compression, ratio, expected) in [
            (0.05, 1.0, 0.608_943_435_2),
            (0.4, 1.0, 14.589_330_39),
            (0.05, 4.0, 9.430_809_956),
            (0.4, 4.0, 267.448_296_3),
        ] {
            let force = 2.0 * ratio * Layer::new(compression).force(ratio, ratio);
            assert!((force / expected - 1.0).abs() < 1e-9, "{force}");
        }
        assert!((force_at_first(1e-3, 1.0, 1.0) / Layer::new(1e-3).force(1.0, 1.0) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_limits_of_plates_hold_the_reference_value() {
        let [low, high] = near_plates(0.1);
        assert!(low < PLATES_TENTH * FOUR_PI_EPS0 && PLATES_TENTH * FOUR_PI_EPS0 < high);
        let [low, high] = needle(1.0001, 1.0);
        assert!(low < CUBE && CUBE < high);
    }
}

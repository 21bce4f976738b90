//! The law of Ogden and Storåkers for foams (Journal of the Mechanics and Physics of Solids 34, 125-145,
//! 1986).
//!
//! `W = sum_i 2 mu_i / a_i^2 [l1^a_i + l2^a_i + l3^a_i - 3 + (J^(-a_i b_i) - 1) / b_i]` with `b = nu / (1 - 2
//! nu)`; for `nu = 0` the last part is its limit, `-a ln J`. At rest the shear modulus is `sum mu_i` and the
//! bulk modulus `sum 2 mu_i (b_i + 1/3)`.
//!
//! Every term is a convex function of the logarithms of the stretches where its shear modulus is positive.
//! The lateral stretch of a foam that is pressed along one axis is therefore unique, and the nominal stress
//! rises with the compression.

use crate::plane::EnergyDerivatives;

/// One term of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HyperfoamTerm {
    /// The part `mu` of this term in the shear modulus at rest, Pa; positive.
    pub shear_modulus: f64,
    /// The exponent `a`, not zero.
    pub exponent: f64,
    /// Poisson's ratio `nu`, at least 0 and less than 0.5.
    pub poisson_ratio: f64,
}

/// A foam that is compressed along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressedFoam {
    /// Stretch along both other axes.
    pub lateral_stretch: f64,
    /// Compressive force over the area at rest, Pa.
    pub nominal_pressure: f64,
}

/// Halvings of the interval in which a scalar root lies: more than a double has digits.
const HALVINGS: usize = 200;

impl HyperfoamTerm {
    /// `b = nu / (1 - 2 nu)`.
    pub(crate) fn volume_exponent(&self) -> f64 {
        self.poisson_ratio / (1.0 - 2.0 * self.poisson_ratio)
    }

    /// The factor `2 mu / a^2` of the term in Pa.
    pub(crate) fn scale(&self) -> f64 {
        2.0 * self.shear_modulus / (self.exponent * self.exponent)
    }

    /// The part of the term in the bulk modulus at rest, `2 mu (b + 1/3)`, in Pa.
    fn bulk_modulus(&self) -> f64 {
        2.0 * self.shear_modulus * (self.volume_exponent() + 1.0 / 3.0)
    }

    /// `a (J - 1) + (J^(-a b) - 1) / b`, which completes `l1^a + l2^a + l3^a - 3 - a (J - 1)` to the bracket
    /// of the energy.
    pub(crate) fn volume_part(&self, j: f64) -> EnergyDerivatives {
        let (a, b) = (self.exponent, self.volume_exponent());
        let log = j.ln();
        let w = if b == 0.0 { -a * log } else { (-a * b * log).exp_m1() / b };
        let power = (-a * b * log).exp();
        EnergyDerivatives {
            w: w + a * (j - 1.0),
            j: a - a * power / j,
            jj: a * (a * b + 1.0) * power / (j * j),
            ..Default::default()
        }
    }

    /// The principal Kirchhoff stress in Pa along an axis whose stretch has this logarithm, where `J` has the
    /// logarithm `log_j`.
    fn kirchhoff(&self, log_stretch: f64, log_j: f64) -> f64 {
        let (a, b) = (self.exponent, self.volume_exponent());
        a * self.scale() * ((a * log_stretch).exp_m1() - (-a * b * log_j).exp_m1())
    }
}

/// Bulk modulus of the law at rest in Pa.
pub fn bulk_modulus(terms: &[HyperfoamTerm]) -> f64 {
    terms.iter().map(HyperfoamTerm::bulk_modulus).sum()
}

/// The foam at a compression `U/H` in `[0, 1)` along one axis, free to get wider along the others.
pub fn pressed_freely(terms: &[HyperfoamTerm], compression: f64) -> PressedFoam {
    let axial = (-compression).ln_1p();
    // The lateral stress of term i vanishes at the logarithm -nu_i of the axial one, and rises with the
    // lateral stretch.
    let ratios = terms.iter().map(|term| term.poisson_ratio);
    let least = ratios.clone().fold(0.5, f64::min);
    let most = ratios.fold(0.0, f64::max);
    let lateral_stress = |lateral: f64| -> f64 {
        terms.iter().map(|term| term.kirchhoff(lateral, axial + 2.0 * lateral)).sum()
    };
    let lateral = -axial * root([least, most], |ratio| lateral_stress(-axial * ratio));
    pressed(terms, axial, lateral)
}

/// The foam at a compression `U/H` in `[0, 1)` along one axis, with the others held: the limit of a wide
/// layer between plates that it sticks to.
pub fn pressed_between_walls(terms: &[HyperfoamTerm], compression: f64) -> PressedFoam {
    pressed(terms, (-compression).ln_1p(), 0.0)
}

/// The compression `U/H` at which `pressed`, a function that rises from 0 at 0, has the nominal pressure
/// `wanted` in Pa.
pub fn compression_under(wanted: f64, pressed: impl Fn(f64) -> f64) -> f64 {
    root([0.0, 1.0 - f64::EPSILON], |compression| pressed(compression) - wanted)
}

/// The foam with these logarithms of its stretches along the axis and across it.
fn pressed(terms: &[HyperfoamTerm], axial: f64, lateral: f64) -> PressedFoam {
    let stress: f64 = terms.iter().map(|term| term.kirchhoff(axial, axial + 2.0 * lateral)).sum();
    PressedFoam { lateral_stretch: lateral.exp(), nominal_pressure: -stress / axial.exp() }
}

/// The place where a rising function of one number changes its sign in an interval, by halving; the nearer
/// end where it does not.
fn root([mut low, mut high]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if value(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

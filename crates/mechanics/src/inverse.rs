//! The compression that a given force causes: equation (50) the other way round.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use crate::closed_form::{ClosedFormSettings, ForceCurve, Phase};
use crate::error::MechanicsError;
use elastocap_materials::MooneyRivlin;

/// Step of `n` in the search for a bracket. The force has one maximum, and nothing in it varies faster. It is
/// not tuned.
const SEARCH_STEP: f64 = 1.0 / 16.0;

/// Largest `n` searched. There `h/H = 2e-16`, and beyond it `U/H` is 1 to rounding.
const LARGEST_N: f64 = 40.0;

/// How far the force-compression curve of the closed form can be used.
///
/// Up to here the force rises with the compression; beyond, equation (50) falls and even turns negative,
/// because the pressure field of the closed form pulls at the outer part of the contact. That is the formula
/// leaving its range, not the rubber softening. For equal contact and shear lengths of 1, 4 and 100
/// thicknesses the limit is at 96, 77 and 74 % compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceLimit {
    /// Compression `U/H` of the largest force.
    pub compression: f64,
    /// The largest compressive force in N.
    pub force: f64,
}

/// The compression `U/H` under a compressive `force` in N, for a layer of reference `thickness` in m.
///
/// Zero force gives exactly zero. The relative error is about 1e-15 where the force rises steadily and grows
/// towards the maximum of the curve, where the force hardly depends on the compression.
///
/// # Errors
/// [`MechanicsError::Force`] if the force is negative or not finite, [`MechanicsError::ForceOutOfReach`] if
/// it exceeds the largest force of the closed form ([`force_limit`]), and what [`force_limit`] refuses.
pub fn compression_for_force(
    thickness: f64,
    rubber: MooneyRivlin,
    settings: ClosedFormSettings,
    force: f64,
) -> Result<f64, MechanicsError> {
    let curve = settings.force_curve(thickness, rubber)?;
    Ok(phase_for_force(&curve, force)?.compression)
}

/// The largest force of the closed form for a layer of reference `thickness` in m, and where it is reached.
///
/// For short contacts (under about a quarter of the thickness) the force rises until nothing is left of the
/// layer; the limit is then the largest compression below 1 that can be told from 1.
///
/// # Errors
/// [`MechanicsError::NotPositive`] for the thickness, the shear modulus or a length of the settings,
/// [`MechanicsError::ForceDoesNotRise`] if the contact is too long for the shear length.
pub fn force_limit(
    thickness: f64,
    rubber: MooneyRivlin,
    settings: ClosedFormSettings,
) -> Result<ForceLimit, MechanicsError> {
    let curve = settings.force_curve(thickness, rubber)?;
    let top = Phase::from_n(bracket(&curve, f64::INFINITY).1);
    Ok(ForceLimit { compression: top.compression, force: curve.force(&top) })
}

/// The state of compression on the rising branch of `curve` that carries `force` (N).
pub(crate) fn phase_for_force(curve: &ForceCurve, force: f64) -> Result<Phase, MechanicsError> {
    if !(force >= 0.0 && force.is_finite()) {
        return Err(MechanicsError::Force { force });
    }
    let target = force / curve.scale;
    if force == 0.0 || target == 0.0 {
        return Ok(Phase::from_n(0.0));
    }
    let (low, high) = bracket(curve, target);
    let top = Phase::from_n(high);
    if curve.normalised(&top) < target {
        let largest_force = curve.force(&top);
        return Err(MechanicsError::ForceOutOfReach { force, largest_force, compression: top.compression });
    }
    Ok(Phase::from_n(solve(curve, target, low, high)))
}

/// An interval of `n` from below at whose upper end the normalised force is at least `target` or, if it never
/// is, at its maximum; the last interval below [`LARGEST_N`] if the force rises up to there.
fn bracket(curve: &ForceCurve, target: f64) -> (f64, f64) {
    let mut low = 0.0;
    while low < LARGEST_N {
        let high = low + SEARCH_STEP;
        let phase = Phase::from_n(high);
        if curve.normalised_slope(&phase) <= 0.0 {
            return (low, maximum(curve, low, high));
        }
        if curve.normalised(&phase) >= target {
            return (low, high);
        }
        low = high;
    }
    (low - SEARCH_STEP, low)
}

/// The `n` between `low` (rising) and `high` (falling) at which the force is largest, by bisection.
fn maximum(curve: &ForceCurve, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if curve.normalised_slope(&Phase::from_n(middle)) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Solves `normalised(n) = target` in `[low, high]`, where the force rises.
///
/// Newton's method on the logarithms, in which the curve is close to a straight line, kept inside a shrinking
/// bracket.
fn solve(curve: &ForceCurve, target: f64, mut low: f64, mut high: f64) -> f64 {
    let mut n = (target / curve.initial_curvature()).sqrt();
    if !(low < n && n < high) {
        n = 0.5 * (low + high);
    }
    for _ in 0..200 {
        let phase = Phase::from_n(n);
        let value = curve.normalised(&phase);
        if value < target {
            low = n;
        } else {
            high = n;
        }
        let steepness = n * curve.normalised_slope(&phase) / value;
        let mut next = n * ((target / value).ln() / steepness).exp();
        if (next - n).abs() <= 2.0 * f64::EPSILON * n {
            return next.clamp(low, high);
        }
        if !(low < next && next < high) {
            next = 0.5 * (low + high);
            if next <= low || next >= high {
                return n;
            }
        }
        n = next;
    }
    n
}

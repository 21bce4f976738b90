//! The law of Gent (Rubber Chemistry and Technology 69, 59-61, 1996): chains of limited length.
//!
//! `W = -mu/2 J_m ln(1 - (I1 - 3)/J_m)` is the neo-Hookean law at small stretches, and grows without bound as
//! `I1 - 3` approaches `J_m`, where the chains are fully extended.

use crate::plane::FunctionOfInvariant;

/// `W` as a function of the first invariant `w = I1 - 3`, with `shear_modulus` in Pa; `None` at and beyond
/// the limit `w >= limiting_invariant`, where the energy is infinite.
pub(crate) fn energy(w: f64, shear_modulus: f64, limiting_invariant: f64) -> Option<FunctionOfInvariant> {
    let left = margin(w, limiting_invariant);
    // Also refuses NaN.
    (left > 0.0).then(|| FunctionOfInvariant {
        value: -0.5 * shear_modulus * limiting_invariant * (-w / limiting_invariant).ln_1p(),
        slope: 0.5 * shear_modulus / left,
        curvature: 0.5 * shear_modulus / (limiting_invariant * left * left),
    })
}

/// `1 - w/J_m`: 1 at rest, 0 where the chains are fully extended.
pub(crate) fn margin(w: f64, limiting_invariant: f64) -> f64 {
    1.0 - w / limiting_invariant
}

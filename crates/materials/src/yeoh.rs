//! The law of Yeoh (Rubber Chemistry and Technology 66, 754-771, 1993): a cubic polynomial in `I1 - 3`.

use crate::plane::FunctionOfInvariant;

/// `c1 w + c2 w^2 + c3 w^3` of the first invariant `w = I1 - 3`, with the constants in Pa.
pub(crate) fn energy(w: f64, [c1, c2, c3]: &[f64; 3]) -> FunctionOfInvariant {
    FunctionOfInvariant {
        value: c1 * w + c2 * w * w + c3 * w.powi(3),
        slope: c1 + 2.0 * c2 * w + 3.0 * c3 * w * w,
        curvature: 2.0 * c2 + 6.0 * c3 * w,
    }
}

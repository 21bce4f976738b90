//! The horizontal force on a plate that is bonded to the compressed layer and then shifted: simple shear.
//!
//! The shift adds displacements that depend on the height alone to those of the compressed layer,
//! `y = (x1 f(x2) + u(x2), g(x2), x3 + v(x2))`. They change neither the volume nor the energy of the
//! compression: in the energy of a Mooney-Rivlin rubber the added part is `mu/2 u'^2 + (c10 + c01 f^2) v'^2`
//! for each reference volume, where `mu = 2 (c10 + c01)`, once the term that is odd in `x1` is integrated
//! over the contact. It is least where the shear stresses `mu u'` and `2 (c10 + c01 f^2) v'` on reference
//! areas are the same at every height:
//!
//! `F1 = A mu s1 / H`, `F3 = A s3 / integral from 0 to H of dx2 / (2 c10 + 2 c01 f(x2)^2)`.
//!
//! `A` and `H` are those before loading. Along `x1` compression changes nothing, since the contact grows as
//! the layer thins. Along `x3` it changes nothing in a neo-Hookean rubber, and stiffens one with a positive
//! `c01`.

use elastocap_materials::MooneyRivlin;

use super::map::LayerMap;
use crate::numerics::integrate_from_zero;

/// The number of pieces of the thickness, over each of which [`integrate_from_zero`] is used. It is not
/// tuned.
const PIECES: u32 = 16;

/// The force over the shift, along x1 and along x3, in N/m, of a contact with this reference `area` in m^2.
/// `None` along x3 where the rubber has no positive stiffness against that shear at some height: one of its
/// constants is negative then.
pub(crate) fn shear_stiffness(map: &LayerMap, rubber: MooneyRivlin, area: f64) -> (f64, Option<f64>) {
    let thickness = map.thickness();
    let modulus = |stretch: f64| 2.0 * (rubber.c10 + rubber.c01 * stretch * stretch);
    let along1 = area * rubber.shear_modulus() / thickness;
    // The stretch grows from 1 at the bottom to lambda at the top.
    if !(modulus(1.0) > 0.0 && modulus(map.lambda()) > 0.0) {
        return (along1, None);
    }
    let piece = thickness / f64::from(PIECES);
    let compliance: f64 = (0..PIECES)
        .map(|k| {
            let from = f64::from(k) * piece;
            integrate_from_zero(piece, |s| 1.0 / modulus(map.stretch(from + s)))
        })
        .sum();
    (along1, Some(area / compliance))
}

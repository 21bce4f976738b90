//! Potentials split into those that are even and those that are odd about mirror planes.

/// The unit potential of a conductor, added up over its images in `planes` mirror planes. An image counts
/// with the factor minus one for every plane, among those it is mirrored in, about which potentials are odd;
/// the bits of these planes are set in `odd`. Divided by the number of images, which is `1 << planes`, this
/// is the part of the unit potential with that parity.
///
/// `image` says for a conductor and the number of a plane which of all `conductors` is its mirror image.
pub(crate) fn projected(
    conductor: usize,
    conductors: usize,
    planes: usize,
    odd: usize,
    image: impl Fn(usize, usize) -> usize,
) -> Vec<f64> {
    let mut potential = vec![0.0; conductors];
    for reflections in 0..1_usize << planes {
        let (mut mirrored, mut sign) = (conductor, 1.0);
        for plane in (0..planes).filter(|plane| reflections >> plane & 1 == 1) {
            mirrored = image(mirrored, plane);
            sign *= if odd >> plane & 1 == 1 { -1.0 } else { 1.0 };
        }
        potential[mirrored] += sign;
    }
    potential
}

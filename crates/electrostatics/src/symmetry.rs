//! Mirror symmetry: the scene's potentials split into parts that are even or odd across each mirror plane, each
//! solved on a half, a quarter or an eighth of the scene.

use crate::layout::Layout;

/// One part: a reduced layout and the potentials that live on it.
#[derive(Debug, Clone)]
pub struct Part {
    /// The reduced layout.
    pub layout: Layout,
    /// Copies of it that make the whole scene: its energies times this are the scene's.
    pub copies: f64,
    /// Potentials of all the scene's conductors, one vector per right-hand side.
    pub potentials: Vec<Vec<f64>>,
    /// The potential that is the same on every conductor of a scene with insulated walls only: it has no field, and
    /// its energy is known to be zero.
    pub fieldless: Vec<Vec<f64>>,
}

/// Splits a layout; without `use_mirrors` into the one part that is the whole.
///
/// The potentials of all parts together are a basis of all potentials.
pub fn parts(layout: &Layout, use_mirrors: bool) -> Vec<Part> {
    let n = layout.conductors.len();
    let axes: Vec<usize> = (0..3).filter(|&a| use_mirrors && layout.mirror[a].is_some()).collect();
    let mut out = Vec::new();
    for signs in 0..1_usize << axes.len() {
        let odd = |i: usize| signs >> i & 1 == 1;
        // Project each unit potential on this symmetry; keep one of every orbit that survives.
        let mut potentials: Vec<Vec<f64>> = Vec::new();
        for c in 0..n {
            let mut v = vec![0.0; n];
            for flips in 0..1_usize << axes.len() {
                let (mut image, mut sign) = (c, 1.0);
                for (i, &a) in axes.iter().enumerate() {
                    if flips >> i & 1 == 1 {
                        image = layout.image(image, a);
                        sign *= if odd(i) { -1.0 } else { 1.0 };
                    }
                }
                v[image] += sign;
            }
            // The first entry of an orbit is its lowest conductor: any other member gives the same vector again.
            let Some(first) = v.iter().position(|x| *x != 0.0) else { continue };
            if first == c {
                let scale = v[first];
                v.iter_mut().for_each(|x| *x /= scale);
                potentials.push(v);
            }
        }
        let insulated = layout.walls.iter().flatten().all(|w| *w == elastocap_geometry::scene::Wall::Insulated);
        let mut fieldless = Vec::new();
        if signs == 0 && insulated && !potentials.is_empty() {
            potentials.pop();
            fieldless.push(vec![1.0; n]);
        }
        if potentials.is_empty() && fieldless.is_empty() {
            continue;
        }
        let mut reduced = layout.clone();
        for (i, &a) in axes.iter().enumerate() {
            reduced = reduced.half(a, odd(i));
        }
        let copies = (1_usize << axes.len()) as f64;
        out.push(Part { layout: reduced, copies, potentials, fieldless });
    }
    out
}

//! Mirror symmetry: the scene's potentials split into parts that are even or odd across each mirror plane, each
//! solved on a half, a quarter or an eighth of the scene.

use crate::boxes::half_turn::odd::OddState;
use crate::boxes::layout::Layout;
use crate::projection::projected;

/// One part: a reduced layout and the potentials that live on it.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    /// The reduced layout.
    pub layout: Layout,
    /// Odd across the mirror plane of each axis.
    pub odd: [bool; 3],
    /// Number of copies that make up the whole scene, and the factor from the part's energies to the scene's.
    pub copies: f64,
    /// Potentials of all the scene's conductors, one vector per right-hand side.
    pub potentials: Vec<Vec<f64>>,
    /// The potential that is the same on every conductor of a scene with insulated walls only: it has no field, and
    /// its energy is known to be zero.
    pub fieldless: Vec<Vec<f64>>,
    /// Potentials of grounded conductors alone, or others that nobody asks for. Nothing is solved for them: they are there to complete the
    /// basis.
    pub unsolved: Vec<Vec<f64>>,
    /// Where the potential is odd under a half turn, the halves and quarters of the scene that it is solved on.
    pub turn: Option<Box<OddState>>,
}

impl Part {
    /// All its potentials: what is solved for, then the others.
    pub(crate) fn basis(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.potentials.iter().chain(&self.fieldless).chain(&self.unsolved)
    }
}

/// The state alone that is odd under a half turn.
pub(crate) fn odd_part(state: &OddState) -> Part {
    let potentials = &state.potentials;
    let driven: Vec<usize> = (0..potentials.len()).filter(|c| potentials[*c] != 0.0).collect();
    // Equal potentials of the two, and those of each other conductor, complete the basis.
    let common = potentials.iter().map(|v| v.abs()).collect();
    let others = (0..potentials.len()).filter(|c| !driven.contains(c));
    let unit = |c: usize| (0..potentials.len()).map(|k| f64::from(u8::from(k == c))).collect();
    Part {
        layout: state.half.clone(),
        odd: [false; 3],
        copies: state.copies,
        potentials: vec![potentials.clone()],
        fieldless: Vec::new(),
        unsolved: std::iter::once(common).chain(others.map(unit)).collect(),
        turn: Some(Box::new(state.clone())),
    }
}

/// Splits a layout into its symmetric parts. The potentials of all parts together are a basis of all potentials. `grounded` says
/// which conductors are at potential zero.
///
/// Without `use_mirrors` every part is solved on the whole scene, but the potentials are split all the same: an iteration that
/// starts symmetric stays symmetric, and the results are those of the reduced parts up to rounding.
pub(crate) fn parts(layout: &Layout, grounded: &[bool], use_mirrors: bool) -> Vec<Part> {
    let n = layout.conductors.len();
    let axes: Vec<usize> = (0..3).filter(|&a| layout.mirror[a].is_some()).collect();
    let mut out = Vec::new();
    for signs in 0..1_usize << axes.len() {
        let odd = |i: usize| signs >> i & 1 == 1;
        // Project each unit potential on this symmetry; keep one of every orbit that survives.
        let (mut potentials, mut unsolved): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for c in 0..n {
            let mut v = projected(c, n, axes.len(), signs, |conductor, i| layout.image(conductor, axes[i]));
            // The first entry of an orbit is its lowest conductor: any other member gives the same vector again.
            let Some(first) = v.iter().position(|x| *x != 0.0) else { continue };
            if first == c {
                let scale = v[first];
                v.iter_mut().for_each(|x| *x /= scale);
                let is_needed = v.iter().zip(grounded).any(|(x, grounded)| *x != 0.0 && !grounded);
                if is_needed { potentials.push(v) } else { unsolved.push(v) }
            }
        }
        let insulated =
            layout.walls.iter().flatten().all(|w| *w == elastocap_geometry::scene::Wall::Insulated);
        let mut fieldless = Vec::new();
        if signs == 0 && insulated && unsolved.is_empty() && !potentials.is_empty() {
            potentials.pop();
            fieldless.push(vec![1.0; n]);
        }
        if potentials.is_empty() && fieldless.is_empty() && unsolved.is_empty() {
            continue;
        }
        let mut reduced = layout.clone();
        let (mut odd_axes, mut copies) = ([false; 3], 1.0);
        if use_mirrors {
            for (i, &a) in axes.iter().enumerate() {
                reduced = reduced.half(a, odd(i));
                odd_axes[a] = odd(i);
                copies *= 2.0;
            }
        }
        out.push(Part { layout: reduced, odd: odd_axes, copies, potentials, fieldless, unsolved, turn: None });
    }
    out
}

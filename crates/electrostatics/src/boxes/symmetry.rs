//! Symmetry: the scene's potentials split into parts that are even or odd across each mirror plane, or under
//! a half turn, each solved on a half, a quarter or an eighth of the scene.

use crate::boxes::half_turn::halves::Halves;
use crate::boxes::layout::Layout;
use crate::projection::projected;

/// One part: a reduced layout and the potentials that live on it.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    /// The reduced layout.
    pub layout: Layout,
    /// Whether the potentials are odd across the mirror plane of each axis.
    pub odd: [bool; 3],
    /// Number of copies that make up the whole scene, and the factor from the part's energies to the scene's.
    pub copies: f64,
    /// Potentials of all the scene's conductors, one vector per right-hand side.
    pub potentials: Vec<Vec<f64>>,
    /// The potential that is the same on every conductor of a scene with insulated walls only: it has no
    /// field, and its energy is known to be zero.
    pub fieldless: Vec<Vec<f64>>,
    /// Potentials of grounded conductors alone, or others that are not needed. Nothing is solved for them;
    /// they complete the basis.
    pub unsolved: Vec<Vec<f64>>,
    /// Set where the potential is even or odd under a half turn: the halves of the scene that it is solved
    /// on, the layout among them.
    pub turn: Option<Box<Halves>>,
}

impl Part {
    /// All potentials of the part: those that are solved for, then the others.
    pub(crate) fn basis(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.potentials.iter().chain(&self.fieldless).chain(&self.unsolved)
    }
}

/// Splits a layout into its symmetric parts. The potentials of all parts together are a basis of all
/// potentials. `grounded` says which conductors are at potential zero.
///
/// Without `use_mirrors` every part is solved on the whole scene, but the potentials are split all the same:
/// an iteration that starts symmetric stays symmetric, and the results are those of the reduced parts up to
/// rounding.
pub(crate) fn parts(layout: &Layout, grounded: &[bool], use_mirrors: bool) -> Vec<Part> {
    let n = layout.conductors.len();
    let axes: Vec<usize> = (0..3).filter(|&a| layout.mirror[a].is_some()).collect();
    let mut out = Vec::new();
    // The turn counts as one more mirror.
    let symmetries = axes.len() + usize::from(layout.turn.is_some());
    let image = |conductor: usize, i: usize| match (axes.get(i), &layout.turn) {
        (Some(&a), _) => layout.image(conductor, a),
        (None, turn) => turn.as_ref().map_or(conductor, |turn| turn.images[conductor]),
    };
    for signs in 0..1_usize << symmetries {
        let odd = |i: usize| signs >> i & 1 == 1;
        // Project each unit potential on this symmetry; keep one of every orbit that survives.
        let (mut potentials, mut unsolved): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for c in 0..n {
            let mut v = projected(c, n, symmetries, signs, image);
            // The first entry of an orbit is its lowest conductor: any other member gives the same vector
            // again.
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
        let turn = reduced.turn.as_ref().filter(|_| use_mirrors).map(|turn| {
            copies *= 2.0;
            Box::new(Halves::of(&reduced, turn.planes, odd(axes.len())))
        });
        let layout = turn.as_ref().map_or(reduced, |halves| halves.half.clone());
        out.push(Part { layout, odd: odd_axes, copies, potentials, fieldless, unsolved, turn });
    }
    out
}

/// Leaves only one state of the parts to be solved: that with opposite potentials of two conductors, and all
/// others at potential zero. This needs a part that is solved on half of the scene, by a half turn, and has
/// the state. Returns whether there is such a part; if not, nothing is changed.
pub(crate) fn leave_opposite(parts: &mut [Part], [one, other]: [usize; 2]) -> bool {
    let is_opposite = |v: &Vec<f64>| {
        v.iter().enumerate().all(|(c, x)| (*x != 0.0) == (c == one || c == other)) && v[one] == -v[other]
    };
    let has_state = |part: &Part| part.turn.is_some() && part.potentials.iter().any(is_opposite);
    if !parts.iter().any(has_state) {
        return false;
    }
    for part in parts {
        let (opposite, others): (Vec<_>, Vec<_>) =
            std::mem::take(&mut part.potentials).into_iter().partition(is_opposite);
        part.potentials = opposite;
        part.unsolved.splice(0..0, others);
    }
    true
}

//! Where the finite elements of a layer put its material.

use elastocap_case::{Case, Mechanics};

/// Steps of the search for the material point at a place, each of which leaves a fifth of the distance or less.
const SEARCH_STEPS: usize = 12;

/// The layer as its finite elements describe it. They cover a quarter of it, or the half with positive x3 where an indenter stands beside the middle.
pub(crate) struct Material<'a> {
    /// The displacement at a point of it, m; `None` outside.
    pub(crate) displacement: &'a dyn Fn([f64; 3]) -> Option<[f64; 3]>,
    /// Half length, thickness and half width before loading, m.
    pub(crate) pad: [f64; 3],
    /// A length that means nothing, m.
    pub(crate) tiny: f64,
    /// Whether it is its own mirror image across x1 = 0, and only what lies at positive x1 is known.
    pub(crate) is_half: bool,
}

/// A material point as one of the part of the layer that is solved.
pub(crate) struct Folded {
    /// Where it is looked for, m: in the first of these places, or else in the second.
    pub(crate) places: [[f64; 3]; 2],
    /// By what its displacement there is multiplied along each axis.
    pub(crate) signs: [f64; 3],
}

impl<'a> Material<'a> {
    /// The material of the layer of a case; `None` where the layer is not computed by finite elements.
    pub(crate) fn of(
        case: &Case,
        is_half: bool,
        displacement: &'a dyn Fn([f64; 3]) -> Option<[f64; 3]>,
    ) -> Option<Self> {
        let layer = case.layer.as_ref()?;
        let width = match case.mechanics? {
            Mechanics::ClosedForm { .. } => return None,
            Mechanics::PlaneStrain(model) => model.width,
            Mechanics::Solid(model) => model.width,
        };
        let pad = [layer.half_length?, layer.thickness, 0.5 * width];
        Some(Self { displacement, pad, tiny: 1e-9 * layer.thickness, is_half })
    }

    /// The displacement of a material point on either side of the planes of symmetry, m; beyond the end and the side of the layer that of
    /// its edge.
    pub(crate) fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        let Folded { places, signs } = self.fold(x);
        let found = places.into_iter().find_map(self.displacement).unwrap_or([0.0; 3]);
        [0, 1, 2].map(|a| signs[a] * found[a])
    }

    /// Where the displacement of a material point is known.
    pub(crate) fn fold(&self, x: [f64; 3]) -> Folded {
        let known = [if self.is_half { x[0].abs() } else { x[0] }, x[1], x[2].abs()];
        let least = [if self.is_half { 0.0 } else { -self.pad[0] }, 0.0, 0.0];
        let within = |by: f64| [0, 1, 2].map(|a| known[a].clamp(least[a] + by, self.pad[a] - by));
        // Elements at a fan meet their own box with a tolerance: a point on the very edge is looked for a little inside.
        let places = [within(0.0), within(self.tiny)];
        Folded { places, signs: [0, 1, 2].map(|a| if known[a] == x[a] { 1.0 } else { -1.0 }) }
    }

    /// Where a material point of the quarter goes; beyond the end and the side of the layer as high as at its edge.
    pub(crate) fn position(&self, y: [f64; 3]) -> [f64; 3] {
        let u = self.displacement(y);
        let height = y[1].clamp(0.0, self.pad[1]);
        [y[0] + u[0], height + u[1], y[2] + u[2]]
    }

    /// The height of the material at depth `y2` (before loading) above the place `x1`, `x3`, starting from a material point.
    pub(crate) fn height_at(&self, mut y: [f64; 3], place: [f64; 2]) -> f64 {
        let mut found = self.position(y);
        for _ in 0..SEARCH_STEPS {
            let miss = [place[0] - found[0], place[1] - found[2]];
            if miss.iter().all(|m| m.abs() < self.tiny) {
                break;
            }
            (y[0], y[2]) = (y[0] + miss[0], y[2] + miss[1]);
            found = self.position(y);
        }
        found[1]
    }
}

//! The finite-element displacement of a layer, extended to all of its material and to the space beside it.

use elastocap_case::{Case, Mechanics};

/// Largest number of steps of the search for the material point at a place. Each step reduces the distance to
/// a fifth or less.
const SEARCH_STEPS: usize = 12;

/// The solved layer. The finite elements cover a quarter of it, or the half with positive x3 if the indenter
/// is not in the middle.
pub(crate) struct Material<'a> {
    /// The displacement at a point of the solved part, m; `None` outside.
    pub(crate) displacement: &'a dyn Fn([f64; 3]) -> Option<[f64; 3]>,
    /// Half length, thickness and half width before loading, m.
    pub(crate) pad: [f64; 3],
    /// The length below which coordinates count as equal, m.
    pub(crate) tiny: f64,
    /// Whether the layer is mirror-symmetric about x1 = 0, and solved only at positive x1.
    pub(crate) is_half: bool,
}

/// The image of a material point in the solved part of the layer.
pub(crate) struct Folded {
    /// Two places at which to look for the point, m: the second is tried if the first is in no element.
    pub(crate) places: [[f64; 3]; 2],
    /// The factors of the displacement components under the reflection, by axis.
    pub(crate) signs: [f64; 3],
}

impl<'a> Material<'a> {
    /// The material of the layer of a case; `None` for a layer without finite elements.
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

    /// The displacement of a material point on either side of the planes of symmetry, m. Beyond the end and
    /// the side of the layer it is that of the edge.
    pub(crate) fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        let Folded { places, signs } = self.fold(x);
        let found = places.into_iter().find_map(self.displacement).unwrap_or([0.0; 3]);
        [0, 1, 2].map(|a| signs[a] * found[a])
    }

    /// Reflects a material point into the solved part of the layer.
    pub(crate) fn fold(&self, x: [f64; 3]) -> Folded {
        let known = [if self.is_half { x[0].abs() } else { x[0] }, x[1], x[2].abs()];
        let least = [if self.is_half { 0.0 } else { -self.pad[0] }, 0.0, 0.0];
        let within = |by: f64| [0, 1, 2].map(|a| known[a].clamp(least[a] + by, self.pad[a] - by));
        // Elements of a fan fill their bounding box only to a tolerance: a point on the edge is also looked
        // for slightly inside.
        let places = [within(0.0), within(self.tiny)];
        Folded { places, signs: [0, 1, 2].map(|a| if known[a] == x[a] { 1.0 } else { -1.0 }) }
    }

    /// The deformed position of a material point of the quarter. Beyond the end and the side of the layer the
    /// height is that of the edge.
    pub(crate) fn position(&self, y: [f64; 3]) -> [f64; 3] {
        let u = self.displacement(y);
        let height = y[1].clamp(0.0, self.pad[1]);
        [y[0] + u[0], height + u[1], y[2] + u[2]]
    }

    /// The deformed height, above the place `x1`, `x3`, of the material plane at the undeformed height
    /// `y[1]`, starting the search at `y`.
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

//! The bodies in a layer that its map deforms along with the material.

use elastocap_case::Case;
use elastocap_geometry::scene::{Box3, Purpose};

use crate::scene::in_layer::lowered;

/// The extents of the bodies in the layer, for the map. Lengths in m: before loading along x1 and x3, and
/// along x2 as high as in the boxes of the layer, see [`super::surface::Bent::scale`].
#[derive(Debug, Clone)]
pub(super) struct InLayer {
    /// The height of the highest face of a body below the surface.
    pub(super) highest: f64,
    /// The shortest side along x1 or x3 of the bodies whose upper face is in the surface; infinite without
    /// such bodies.
    pub(super) narrowest: f64,
    /// The faces, by axis, of the electrodes that the layer's finite elements resolve: the strain of the
    /// material jumps there.
    pub(super) planes: [Vec<f64>; 3],
    /// The box around all bodies of finite extent; `None` if there are none.
    hull: Option<Box3>,
}

impl InLayer {
    /// The bodies in the layer of a case and the `pair` of electrodes. The heights of the bodies are
    /// multiplied by `scale`; those of the pair are already. Empty if the case has no such body besides
    /// the pair.
    pub(super) fn of(case: &Case, scale: f64, pair: &[Box3]) -> Self {
        let bodies = case.bodies.iter().filter(|body| body.purpose == Purpose::InLayer);
        let regions: Vec<Box3> = bodies
            .flat_map(|body| body.boxes().unwrap_or_default())
            .map(|region| lowered(&region, scale))
            .collect();
        let Some(thickness) =
            case.layer.as_ref().map(|layer| layer.thickness).filter(|_| !regions.is_empty())
        else {
            let planes = Default::default();
            return Self { highest: 0.0, narrowest: f64::INFINITY, planes, hull: None };
        };
        let all_regions = || regions.iter().chain(pair);
        let surface = (1.0 - 1e-9) * scale * thickness;
        let in_surface = all_regions().filter(|region| region.max[1] >= surface);
        let narrowest = in_surface.map(|region| region.extent(0).min(region.extent(2)));
        let narrowest = narrowest.fold(f64::INFINITY, f64::min);
        let tops = all_regions().map(|region| region.max[1]).filter(|top| *top < surface);
        let planes = [0, 1, 2].map(|a| pair.iter().flat_map(|r| [r.min[a], r.max[a]]).collect());
        let hull = all_regions().filter(|region| (0..3).all(|a| region.extent(a).is_finite())).copied();
        Self { highest: tops.fold(0.0, f64::max), narrowest, planes, hull: hull.reduce(|a, b| a.union(&b)) }
    }

    /// Whether there are no bodies of finite extent.
    pub(super) fn is_empty(&self) -> bool {
        self.hull.is_none()
    }

    /// The distance to which the bodies extend from the middle along an axis, towards its lower (side 0) or
    /// upper end (side 1), m; minus infinity without bodies.
    pub(super) fn reach(&self, axis: usize, side: usize) -> f64 {
        self.hull.map_or(f64::NEG_INFINITY, |hull| if side == 0 { -hull.min[axis] } else { hull.max[axis] })
    }
}

//! A map in the coordinates of a layout.

use super::scene_map::{MapGradients, SceneMap};
use std::sync::Arc;

/// A [`SceneMap`] where lengths are in units of `unit` from `origin`. Gradients are the same in any unit.
#[derive(Debug, Clone)]
pub(crate) struct PlacedMap {
    /// The map, in metres.
    pub(crate) map: Arc<SceneMap>,
    /// The origin of the layout's coordinates, m.
    pub(crate) origin: [f64; 3],
    /// The layout's unit of length, m.
    pub(crate) unit: f64,
}

impl PlacedMap {
    /// Whether the displacement at coordinate `x` of an axis may differ from zero.
    pub(crate) fn reaches(&self, axis: usize, x: f64) -> bool {
        self.map.axes[axis].reaches(self.origin[axis] + self.unit * x)
    }

    /// Whether the map on one side of the middle of an axis is the mirror image of that on the other.
    pub(crate) fn is_mirrored(&self, axis: usize) -> bool {
        self.map.axes[axis].mirrored
    }

    /// See [`SceneMap::gradients`].
    pub(crate) fn gradients(&self, places: &[Vec<f64>; 3]) -> MapGradients<'_> {
        let metres = [0, 1, 2].map(|a| places[a].iter().map(|x| self.origin[a] + self.unit * x).collect());
        self.map.gradients(&metres)
    }

    /// See [`SceneMap::steady_pieces`].
    pub(crate) fn steady_pieces(&self, places: &[f64]) -> Vec<Option<(usize, bool)>> {
        let metres: Vec<f64> = places.iter().map(|x| self.origin[2] + self.unit * x).collect();
        self.map.steady_pieces(&metres)
    }

    /// The ends of the map's polynomials on an axis, on both sides of a mirror plane.
    pub(crate) fn breaks(&self, axis: usize) -> Vec<f64> {
        let map_axis = &self.map.axes[axis];
        let mirrored = map_axis.breaks.iter().filter(|_| map_axis.mirrored).map(|x| -x);
        map_axis.breaks.iter().copied().chain(mirrored).map(|x| (x - self.origin[axis]) / self.unit).collect()
    }
}

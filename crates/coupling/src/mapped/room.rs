//! The bodies that a map must not change. A map ends below bodies that are far enough above the layer, and
//! refuses others in its zone.

use elastocap_case::{Case, Pose};
use elastocap_geometry::scene::{Body, Box3, Purpose, Scene};
use elastocap_geometry::shapes::Shape;

use crate::scene::SceneError;
use crate::scene::attached::moved;

/// Least distance of a body above the surface of the undeformed layer for a map to end below the body, in
/// thicknesses of the layer. It is not tuned.
pub(super) const ABOVE: f64 = 0.25;

/// The bodies that do not deform with the layer.
pub(super) struct Others {
    /// The boxes around the parts of the bodies, each with the name of the body.
    parts: Vec<(String, Box3)>,
    /// The height of its lower face from which on a body counts as above the layer, m.
    above: f64,
    /// The length below which overlaps are ignored, m.
    tiny: f64,
}

impl Others {
    /// The bodies of a case that do not deform with the layer; `scene` is the scene of the case. Attached
    /// bodies are moved as the pose says and with the top of the layer, by `top` (m) along x2.
    pub(super) fn of(case: &Case, scene: &Scene, top: f64, pose: &Pose) -> Result<Self, SceneError> {
        let thickness = case.layer.as_ref().map_or(0.0, |layer| layer.thickness);
        let is_other = |body: &&Body| match body.purpose {
            // Dielectrics that the field omits are not in the scene.
            Purpose::Fixed | Purpose::OnTop | Purpose::OnIndenter => {
                body.is_conductor() || scene.bodies.iter().any(|other| other.name == body.name)
            }
            Purpose::Layer
            | Purpose::Substrate
            | Purpose::Cover
            | Purpose::Electrode
            | Purpose::InLayer
            | Purpose::Indenter => false,
        };
        let bodies = moved(case.bodies.iter().filter(is_other).cloned().collect(), top, pose)?;
        let parts_of = |body: &Body| {
            let bounds = body.parts.iter().filter_map(Shape::bounds);
            bounds.map(|region| (body.name.clone(), region)).collect::<Vec<_>>()
        };
        let parts = bodies.iter().flat_map(parts_of).collect();
        Ok(Self { parts, above: (1.0 + ABOVE) * thickness, tiny: 1e-9 * thickness })
    }

    /// Whether a box overlaps the interval `ends` (m) along axis `a`.
    fn overlap(&self, region: &Box3, a: usize, ends: [f64; 2]) -> bool {
        region.max[a] > ends[0] + self.tiny && region.min[a] < ends[1] - self.tiny
    }

    /// The name of the first body that overlaps a zone.
    pub(super) fn first_in(&self, zone: &Box3) -> Option<&str> {
        let is_in = |region: &Box3| (0..3).all(|a| self.overlap(region, a, [zone.min[a], zone.max[a]]));
        self.parts.iter().find(|(_, region)| is_in(region)).map(|(name, _)| name.as_str())
    }

    /// Refuses bodies that overlap a zone.
    ///
    /// # Errors
    /// The first body that overlaps the zone.
    pub(super) fn check(&self, zone: &Box3) -> Result<(), SceneError> {
        match self.first_in(zone) {
            Some(body) => Err(SceneError::InTheIndentersWay { body: body.to_owned() }),
            None => Ok(()),
        }
    }

    /// The height of the lowest body above the layer between these `ends` along x1 and x3, m; infinite
    /// without such bodies.
    pub(super) fn ceiling(&self, ends: &[[f64; 2]; 2]) -> f64 {
        let above = self.parts.iter().map(|(_, region)| region).filter(|region| {
            region.min[1] >= self.above
                && self.overlap(region, 0, ends[0])
                && self.overlap(region, 2, ends[1])
        });
        above.map(|region| region.min[1]).fold(f64::INFINITY, f64::min)
    }
}

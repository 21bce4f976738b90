//! Builds the scene that the field solvers take from a case and one state of its layer.

mod assembly;
pub(crate) mod attached;
pub(crate) mod contacts;
mod electrodes;
pub(crate) mod in_layer;
pub(crate) mod indenter;
pub(crate) mod neutral;
mod walls;

use std::sync::Arc;

use elastocap_electrostatics::SceneMap;
use elastocap_geometry::scene::{Box3, Scene};
use elastocap_geometry::shapes::Shape;
use elastocap_mechanics::MechanicsError;

pub use assembly::scene_of;

/// A case in one state of its layer, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct DeformedScene {
    /// The input of the field solvers, with the lengths after loading.
    pub scene: Scene,
    /// The pair of electrodes, if the case has one.
    pub pair: Option<DeformedPair>,
    /// Whether the load bends the two electrodes. In `scene` bent electrodes are boxes at the mean positions
    /// of their faces.
    pub electrodes_are_bent: bool,
    /// The map that tilts what is attached, if it is tilted; in `scene` it is not.
    pub tilt: Option<Arc<SceneMap>>,
}

impl DeformedScene {
    /// The scene with these boxes in place of the electrodes of the pair.
    pub fn with_pair(&self, regions: [Box3; 2]) -> Scene {
        let mut scene = self.scene.clone();
        for (place, region) in self.pair.iter().flat_map(|pair| pair.places).zip(regions) {
            if let Some(part) = place.in_scene(&mut scene) {
                *part = Shape::Box(region);
            }
        }
        scene
    }
}

/// The position of an electrode among the bodies of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElectrodePlace {
    /// The index of the conductor that it belongs to.
    pub conductor: usize,
    /// The index among the parts of that conductor, which include other conductors on the same wire.
    pub part: usize,
}

impl ElectrodePlace {
    /// The shape of the electrode in a scene.
    pub(crate) fn in_scene(self, scene: &mut Scene) -> Option<&mut Shape> {
        scene.conductor_mut(self.conductor)?.parts.get_mut(self.part)
    }
}

/// Dimensions of the electrodes after loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeformedPair {
    /// The positions of the electrodes among the bodies of the scene.
    pub places: [ElectrodePlace; 2],
    /// The distance between the facing surfaces, m.
    pub gap: f64,
    /// The height above the substrate of the mid-plane of an in-plane pair, or of the middle of the gap of a
    /// stacked one, m.
    pub height: f64,
    /// The thickness along x2, m: for a stacked pair the mean of the two plates, which are thinned by the
    /// stretch at their heights.
    pub thickness: f64,
    /// The parallel-plate formula, F: the facing area times permittivity over the gap, no fringing.
    pub parallel_plate: f64,
}

/// The reason that a load step has no scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The layer or an electrode cannot be deformed like this.
    #[error(transparent)]
    Mechanics(#[from] MechanicsError),
    /// The plates of a stacked pair meet.
    #[error(
        "the gap of the stacked pair closes: its plates would overlap by {:.4} um; compress less, or make the plates \
         thinner or softer",
        -gap * 1e6
    )]
    GapCloses {
        /// Distance of the facing surfaces, m; not positive.
        gap: f64,
    },
    /// An electrode is thicker than the room that the deformed layer leaves for it.
    #[error(
        "`{electrode}` would leave the deformed layer at the {side} by {:.4} um; compress less, make it thinner or \
         softer, or place it farther from that face",
        by * 1e6
    )]
    LeavesLayer {
        /// The name of the electrode.
        electrode: &'static str,
        /// "top" or "bottom".
        side: &'static str,
        /// The protrusion, m.
        by: f64,
    },
    /// A body moves with the material of an evenly compressed foam; the case reader refuses such a file.
    #[error("where conductors within an evenly compressed foam go is not known; put them on its faces")]
    WithinFoam,
    /// A wall that moves with the layer reaches a body that stays in place.
    #[error(
        "the conductor `{conductor}` stays in place, and the wall {side} the layer, which moves with it, reaches it; make \
         the medium {side} the layer thicker"
    )]
    ReachesWall {
        /// The name of the conductor.
        conductor: String,
        /// "below" or "above".
        side: &'static str,
    },
    /// A body that is not attached stands beside those that are tilted.
    #[error(
        "`{body}` stands beside what is tilted, with no room for the tilt to fall off; move it away, or attach it too"
    )]
    InTheWay {
        /// The name of the body.
        body: String,
    },
    /// A body lies where the indenter is, or where the space between it and the layer is bent.
    #[error(
        "`{body}` lies in the way of the indenter, or where the layer's surface or the indenter bends the space around it, which would \
         bend it along; move it away, write `attached = \"layer\"` where it lies in the layer, or `role = \"absent\"` in [indenter]"
    )]
    InTheIndentersWay {
        /// The name of the body.
        body: String,
    },
    /// A body that moves with the material of the layer is of another shape than boxes.
    #[error(
        "`{body}` moves with the material of the layer under load, which is known of boxes and sheets alone: make it of `boxes`, or lay it \
         on a face of the layer"
    )]
    NoBoxInLayer {
        /// The name of the body.
        body: String,
    },
    /// Two conductors of different terminals touch under this load, or in this pose.
    #[error(
        "`{first}` and `{second}` touch in this step, and would be one conductor: make the gap between them wider, change the load, or \
         join them in one [[terminal]]"
    )]
    BodiesMeet {
        /// The name of one conductor.
        first: String,
        /// The name of the other conductor.
        second: String,
    },
    /// A conductor touches an indenter of metal that is part of the field.
    #[error(
        "`{body}` and `indenter`, a conductor too, touch in this step, and would be one conductor: leave a gap between them, write `role = \
         \"absent\"` or a permittivity in [indenter], or ground both: `role = \"grounded\"`, and `potential = \"ground\"` in a [[terminal]] \
         of `{body}`"
    )]
    TouchesIndenter {
        /// The name of the body.
        body: String,
    },
    /// A conductor in the surface of a layer that an indenter of metal, part of the field, bends.
    #[error(
        "`{body}` lies in the surface of the layer, which `indenter`, a conductor too, touches in this step, so that the two would be one \
         conductor: move it below the surface, or write `role = \"absent\"` or a permittivity in [indenter]"
    )]
    ShortedByIndenter {
        /// The name of the body.
        body: String,
    },
    /// The indenter reaches a wall.
    #[error(
        "the indenter reaches the walls of the computed region; make `side_margin` or the medium above the layer larger"
    )]
    IndenterAtWall,
    /// The file lacks what the scene needs; the case reader refuses such a file.
    #[error("the case has no {0}")]
    Missing(&'static str),
}

//! How much of a scene is shown to a viewer.

use elastocap_geometry::scene::{Box3, Wall};

use crate::scene::DeformedScene;

/// How much open space around the conductors is shown, as a share of their extent.
const SHOWN: f64 = 0.5;

/// The window to which infinite bodies are cropped: it holds all boxes and some open space around them, and is the same at all
/// steps. Bodies of other shapes are finite.
pub fn window(scenes: &[&DeformedScene]) -> Box3 {
    let mut inside: Option<Box3> = None;
    for scene in scenes.iter().map(|s| &s.scene) {
        let boxes = scene.conductor_parts().filter_map(|(_, part)| part.as_box());
        inside = boxes.chain(inside).reduce(|all, region| all.union(&region));
    }
    if inside.is_none() {
        for scene in scenes.iter().map(|s| &s.scene) {
            let bounds = scene.conductor_parts().filter_map(|(_, part)| part.bounds());
            inside = bounds.chain(inside).reduce(|all, region| all.union(&region));
        }
    }
    let conductors = inside.unwrap_or(Box3 { min: [0.0; 3], max: [1.0; 3] });
    let margin = SHOWN * (0..3).map(|a| conductors.extent(a)).fold(0.0, f64::max);
    let mut window = conductors;
    for scene in scenes.iter().map(|s| &s.scene) {
        let bounded = scene.dielectric_parts().filter_map(|(_, part)| part.as_box()).chain([scene.domain]);
        for region in bounded {
            for a in 0..3 {
                for at in [region.min[a], region.max[a]].into_iter().filter(|at| at.is_finite()) {
                    window.min[a] = window.min[a].min(at);
                    window.max[a] = window.max[a].max(at);
                }
            }
        }
    }
    for (a, sides) in scenes.first().map(|s| s.scene.walls).into_iter().flatten().enumerate() {
        if sides[0] == Wall::Open {
            window.min[a] -= margin;
        }
        if sides[1] == Wall::Open {
            window.max[a] += margin;
        }
    }
    window
}

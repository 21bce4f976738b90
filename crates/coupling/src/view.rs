//! The part of a scene that is shown in a viewer.

use elastocap_case::{Case, Mechanics};
use elastocap_geometry::scene::{Box3, Wall};

use crate::scene::DeformedScene;

/// The margin around the conductors within which open space and infinite bodies are shown, over the extent of
/// the conductors.
const MARGIN: f64 = 0.25;

/// The names of the bodies that are cropped for a viewer because they extend to infinity in open space.
pub fn cut_off(scene: &DeformedScene) -> Vec<String> {
    let scene = &scene.scene;
    let is_open = |a: usize, side: usize| scene.walls[a][side] == Wall::Open;
    let is_infinite = |bounds: &Box3| {
        (0..3).any(|a| {
            (is_open(a, 0) && bounds.min[a] == f64::NEG_INFINITY)
                || (is_open(a, 1) && bounds.max[a] == f64::INFINITY)
        })
    };
    let bodies = scene.dielectrics().map(|dielectric| dielectric.body);
    let infinite = bodies.filter(|body| body.bounds().is_some_and(|bounds| is_infinite(&bounds)));
    infinite.map(|body| body.name.clone()).collect()
}

/// The place of the load on a layer in three dimensions, [x1, x3] in m: the middle of the layer, below the
/// indenter. `None` for other cases, whose scenes are uniform along x3 or have no load.
pub fn loaded_at(case: &Case) -> Option<[f64; 2]> {
    case.load.as_ref()?;
    matches!(case.mechanics, Some(Mechanics::Solid(_))).then_some([0.0, 0.0])
}

/// The window to which infinite bodies are cropped. It contains all boxes and a margin of open space, and is
/// the same at all steps. Bodies of other shapes are finite.
pub fn window(scenes: &[&DeformedScene]) -> Box3 {
    let mut inside: Option<Box3> = None;
    for scene in scenes.iter().map(|s| &s.scene) {
        let boxes = scene.conductor_parts().filter_map(|(_, part)| part.as_box());
        inside = boxes.chain(inside).reduce(|hull, region| hull.union(&region));
    }
    if inside.is_none() {
        for scene in scenes.iter().map(|s| &s.scene) {
            let bounds = scene.conductor_parts().filter_map(|(_, part)| part.bounds());
            inside = bounds.chain(inside).reduce(|hull, region| hull.union(&region));
        }
    }
    let conductors = inside.unwrap_or(Box3 { min: [0.0; 3], max: [1.0; 3] });
    let margin = MARGIN * (0..3).map(|a| conductors.extent(a)).fold(0.0, f64::max);
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

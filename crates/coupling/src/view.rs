//! How much of a scene is shown to a viewer.

use elastocap_case::{Case, Mechanics};
use elastocap_geometry::scene::{Box3, Wall};

use crate::scene::DeformedScene;

/// How much around the conductors is shown of open space and of bodies that go on, as a share of the extent of the conductors.
const SHOWN: f64 = 0.25;

/// The names of the bodies of a scene that are cut off for a viewer: they go on without end where the scene does.
pub fn cut_off(scene: &DeformedScene) -> Vec<String> {
    let scene = &scene.scene;
    let is_open = |a: usize, side: usize| scene.walls[a][side] == Wall::Open;
    let goes_on = |own: &Box3| {
        (0..3).any(|a| {
            (is_open(a, 0) && own.min[a] == f64::NEG_INFINITY)
                || (is_open(a, 1) && own.max[a] == f64::INFINITY)
        })
    };
    let endless = scene.dielectrics().filter(|own| own.body.bounds().is_some_and(|bounds| goes_on(&bounds)));
    endless.map(|own| own.body.name.clone()).collect()
}

/// Where the load of a layer in three dimensions acts, [x1, x3] in m: the middle of the layer, above which its indenter stands. `None` for other
/// cases, whose scenes are alike along x3 or loaded all over.
pub fn loaded_at(case: &Case) -> Option<[f64; 2]> {
    case.load.as_ref()?;
    matches!(case.mechanics, Some(Mechanics::Solid(_))).then_some([0.0, 0.0])
}

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

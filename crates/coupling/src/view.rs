//! How much of a scene is shown to a viewer.

use elastocap_geometry::scene::{Box3, Wall};

use crate::scene::DeformedScene;

/// What is shown of open space beside the conductors, as a share of their extent.
const SHOWN: f64 = 0.5;

/// What is shown of bodies that go on for ever: up to where all boxes end, with some of open space around them, the same at all
/// steps. Bodies of other shapes end by themselves.
pub fn window(scenes: &[&DeformedScene]) -> Box3 {
    let mut inside: Option<Box3> = None;
    let mut hold = |region: Box3| inside = Some(inside.map_or(region, |b| b.union(&region)));
    for scene in scenes.iter().map(|s| &s.scene) {
        scene.conductor_parts().filter_map(|(_, part)| part.as_box()).for_each(&mut hold);
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

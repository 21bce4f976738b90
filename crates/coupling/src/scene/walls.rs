//! The outer walls of a scene.

use elastocap_geometry::scene::{Box3, Wall};

use super::SceneError;
use elastocap_case::{Case, Extent, Face, Surroundings};

/// `walls[axis][side]`, side 0 at the lower end.
pub(super) type Walls = [[Wall; 2]; 3];

/// The outer walls of a case whose layer is `top` thick, m, around conductors given by their names and
/// bounds.
///
/// # Errors
/// A conductor that reaches a wall below or above the layer.
pub(super) fn outer_walls(
    case: &Case,
    surroundings: &Surroundings,
    top: f64,
    conductors: &[(&str, Box3)],
) -> Result<(Box3, Walls), SceneError> {
    let boundary = surroundings.boundary;
    if case.mesh.is_some() {
        // The outer faces of the mesh are the walls.
        return Ok((Box3::SPACE, [[boundary; 2]; 3]));
    }
    if let Some((domain, wall)) = surroundings.end_without_layer(&case.bodies) {
        return Ok((domain, [[wall; 2]; 3]));
    }
    let Extent::AroundLayer { side_margin, below, above } = surroundings.extent else {
        return Err(SceneError::Missing("walls"));
    };
    let mut domain = Box3::SPACE;
    let mut walls = [[boundary; 2]; 3];
    if let Some(margin) = side_margin {
        let bodies = conductors.iter().map(|(_, region)| *region).reduce(|a, b| a.union(&b));
        let bodies = bodies.ok_or(SceneError::Missing("conductor"))?;
        for a in [0, 2] {
            domain.min[a] = bodies.min[a] - margin;
            domain.max[a] = bodies.max[a] + margin;
        }
    }
    let end = |face: Face, from: f64, outward: f64| match face {
        Face::Insulated => (from, Wall::Insulated),
        Face::Grounded => (from, Wall::Grounded),
        Face::Medium { thickness: Some(depth), then, .. } if then != Wall::Open => {
            (from + outward * depth, then)
        }
        Face::Medium { .. } => (outward * f64::INFINITY, Wall::Open),
    };
    (domain.min[1], walls[1][0]) = end(below, 0.0, -1.0);
    (domain.max[1], walls[1][1]) = end(above, top, 1.0);
    for (conductor, region) in conductors {
        let reaches = |side: usize| {
            let room = [region.min[1] - domain.min[1], domain.max[1] - region.max[1]][side];
            room < 0.0 || (room == 0.0 && walls[1][side] == Wall::Grounded)
        };
        for (side, name) in ["below", "above"].into_iter().enumerate() {
            if reaches(side) {
                return Err(SceneError::ReachesWall { conductor: (*conductor).to_owned(), side: name });
            }
        }
    }
    Ok((domain, walls))
}

//! Removal of dielectric faces so far from all conductors that it does not matter where they are.
//!
//! A board that is a kilometre thick is endless for a sensor of a millimetre. A grid that reaches its far
//! side spans so many orders of magnitude that double precision does not suffice; without that side, the grid
//! is as small as that of an endless board.
//!
//! Let the permittivity be changed by a factor of k at most, and only where the potential is at most m of
//! those of the conductors. With the flux of one scene in the other, Thomson's principle says that a
//! capacitance C changes by no more than k - 1 times the energy of the field there; and that energy is at
//! most m C in the part of space where the potential is at most m. At a distance d from conductors in a
//! ball of radius a, m is about a / d in a uniform medium and no more than k a / d in others. [`MARGIN`]
//! covers the approximation.

use elastocap_geometry::scene::{Body, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// The safety factor by which the change is multiplied. Not tuned: it only decides how far a face must be to
/// be left out.
const MARGIN: f64 = 4.0;

/// The share of a tolerance that the change of a capacitance may take. It is not tuned.
const SHARE: f64 = 0.01;

/// A scene without faces of dielectrics that are too far away to matter for a relative `tolerance`, and the
/// largest relative change of any capacitance without them. `None` where there are no such faces. Bodies keep
/// their numbers.
pub(crate) fn without_far_faces(scene: &Scene, tolerance: f64) -> Option<(Scene, f64)> {
    let conductors =
        scene.conductors().map(|conductor| conductor.body.bounds()).collect::<Option<Vec<_>>>()?;
    let hull = conductors.into_iter().reduce(|hull, bounds| hull.union(&bounds))?;
    let radius = 0.5 * (0..3).map(|a| hull.extent(a).powi(2)).sum::<f64>().sqrt();
    let permittivities = || {
        let dielectrics = scene.dielectrics().map(|dielectric| dielectric.relative_permittivity);
        dielectrics.chain([scene.background_permittivity])
    };
    let contrast = permittivities().fold(0.0, f64::max) / permittivities().fold(f64::INFINITY, f64::min);
    let influence = |distance: f64| MARGIN * contrast * contrast * radius / distance;
    let mut largest = 0.0_f64;
    let mut moved = |x: f64, a: usize| {
        let from_middle = x - 0.5 * (hull.min[a] + hull.max[a]);
        let changed = influence(from_middle.abs() - radius);
        let is_open = scene.walls[a][usize::from(from_middle > 0.0)] == Wall::Open;
        if !x.is_finite() || !is_open || !(0.0..=SHARE * tolerance).contains(&changed) {
            return x;
        }
        largest = largest.max(changed);
        f64::INFINITY.copysign(from_middle)
    };
    let mut without_its_far_faces = |body: &Body| {
        let (Role::Dielectric { .. }, Some(mut boxes)) = (body.role, body.boxes()) else {
            return body.clone();
        };
        for region in &mut boxes {
            for a in 0..3 {
                (region.min[a], region.max[a]) = (moved(region.min[a], a), moved(region.max[a], a));
            }
        }
        Body { parts: boxes.into_iter().map(Shape::Box).collect(), ..body.clone() }
    };
    let bodies = scene.bodies.iter().map(&mut without_its_far_faces).collect();
    // Faces on different sides, and above one another, add up.
    let faces = 2.0 * scene.dielectrics().count() as f64;
    (largest > 0.0).then(|| (Scene { bodies, ..scene.clone() }, faces * largest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_geometry::scene::Box3;

    fn on_board(from: f64, to: f64) -> Scene {
        let mut slab = Box3::SPACE;
        (slab.min[1], slab.max[1]) = (from, to);
        let cube = Box3 { min: [-0.5; 3], max: [0.5; 3] };
        let bodies =
            vec![Body::conductor("cube", Shape::Box(cube)), Body::dielectric("board", Shape::Box(slab), 3.0)];
        Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
    }

    #[test]
    fn a_face_that_is_far_enough_for_the_tolerance_goes_to_infinity_and_is_counted() {
        let faces = |scene: &Scene| {
            let board = scene.bodies[1].boxes().unwrap()[0];
            [board.min[1], board.max[1]]
        };
        let (scene, share) = without_far_faces(&on_board(-1e11, 0.0), 1e-3).unwrap();
        assert_eq!(faces(&scene), [f64::NEG_INFINITY, 0.0]);
        assert!(share > 1e-10 && share < 1e-8, "{share:e}");
        // Nothing is left of a board that is wholly far away.
        let (scene, _) = without_far_faces(&on_board(-2e11, -1e11), 1e-3).unwrap();
        assert_eq!(faces(&scene), [f64::NEG_INFINITY; 2]);
        assert!(without_far_faces(&on_board(-1e5, 0.0), 1e-3).is_none());
        assert!(without_far_faces(&on_board(-1e11, 0.0), 1e-10).is_none());
        assert!(without_far_faces(&on_board(f64::NEG_INFINITY, 0.0), 1e-3).is_none());
        let mut grounded = on_board(-1e11, 0.0);
        grounded.walls[1][0] = Wall::Grounded;
        assert!(without_far_faces(&grounded, 1e-3).is_none());
    }
}

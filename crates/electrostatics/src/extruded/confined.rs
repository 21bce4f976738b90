//! Scenes that are closed across one axis and open along another.
//!
//! Flux cannot spread in three dimensions there, so that no rays are followed to infinity. Open sides end at
//! a distance instead: the potentials of the upper bound are zero from there on, and no flux of the lower
//! bound passes. Both continue by zero, so that the truth lies between the bounds for any distance.

use super::layout::Layout;
use elastocap_geometry::scene::{Wall, across};
use elastocap_linalg::dense::product;
use faer::Mat;
use std::f64::consts::PI;

/// The wall that open sides become in the upper and in the lower problem.
pub(super) fn open_sides(is_confined: bool) -> [Wall; 2] {
    if is_confined { [Wall::Grounded, Wall::Insulated] } else { [Wall::Open; 2] }
}

/// The walls of a problem, with `open` in the place of open ones.
pub(super) fn with_open_sides(walls: [Wall; 2], open: Wall) -> [Wall; 2] {
    walls.map(|wall| if wall == Wall::Open { open } else { wall })
}

/// Largest distance of open sides along the axis, whose elements grow with the distance, in sizes of the
/// scene.
const FARTHEST_ALONG_AXIS: f64 = 4e3;
/// Largest distance of open sides in a plan that is open in both directions, so that triangles grow with the
/// distance; in sizes of the scene.
const FARTHEST_IN_PLAN: f64 = 1e3;
/// Largest distance of open sides in a plan whose closed sides do not let triangles grow, in sizes of the
/// scene.
const FARTHEST_IN_CHANNEL: f64 = 60.0;

/// Where open sides end for a tolerance, in units of the scene; `walls` are those of the whole scene.
///
/// Beyond the bodies a field between grounded walls falls exponentially. Between insulated walls across one
/// axis that of a neutral set of conductors falls like that of a dipole in the plane, and across two axes it
/// tends to a constant, which may differ from end to end.
pub(super) fn distance_of_ends(layout: &Layout, walls: [[Wall; 2]; 3], tolerance: f64) -> f64 {
    let allowed = 0.25 * tolerance;
    let is_closed = |a: &usize| !walls[*a].contains(&Wall::Open);
    let closed: Vec<usize> = (0..3).filter(is_closed).collect();
    let grounded = closed.iter().any(|a| walls[*a].contains(&Wall::Grounded));
    let open_count = walls.iter().flatten().filter(|wall| **wall == Wall::Open).count();
    let reach = layout.reach.max(1.0);
    // The slowest mode of a field between walls one of which is grounded falls by exp(-pi / 2) over their
    // distance, and its energy by the square of that.
    let width = closed.iter().map(|a| layout.width(*a)).fold(0.0, f64::max);
    let exponential = reach + width * (1.0 / allowed).ln().max(1.0) / PI;
    let far = match (grounded, closed.len(), open_count) {
        (true, ..) | (false, 2, 1) => exponential,
        (false, 1, _) => reach * (0.5 / allowed).sqrt(),
        (false, ..) => reach * (0.5 / allowed),
    };
    let in_plan = across(layout.axis);
    let farthest = match in_plan.map(|a| walls[a].contains(&Wall::Open)) {
        [true, true] => FARTHEST_IN_PLAN,
        [false, false] => FARTHEST_ALONG_AXIS,
        _ => FARTHEST_IN_CHANNEL,
    };
    far.clamp(1.5 * reach, farthest * reach)
}

/// The change of potentials V to V - (w . V) that lowers energies `upper` most, w being between 0 and 1.
///
/// Where all walls of a confined scene are insulated, infinity has no capacitance: a potential that all
/// conductors have in common costs nothing, since it can fall to zero over a distance so long that it has no
/// energy (as the logarithm in the plane). The truth then is the same for V and for V - w . V, and an upper
/// bound on the energy of either is one on that of both.
pub(super) fn without_common_potential(upper: &Mat<f64>) -> Mat<f64> {
    let n = upper.nrows();
    let charges: Vec<f64> = (0..n).map(|i| (0..n).map(|j| upper[(i, j)]).sum::<f64>()).collect();
    let total: f64 = charges.iter().sum();
    let size: f64 = (0..n).map(|i| upper[(i, i)]).sum();
    let share = |i: usize| if total > 1e-12 * size { (charges[i] / total).clamp(0.0, 1.0) } else { 0.0 };
    Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - share(j))
}

/// The form in V that `form` takes at the potentials `change` V.
pub(super) fn changed(form: &Mat<f64>, change: &Mat<f64>) -> Mat<f64> {
    product(change.transpose(), product(form.as_ref(), change.as_ref()).as_ref())
}

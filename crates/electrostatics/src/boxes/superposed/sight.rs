//! The part of the error of a base that is seen by a body that is added to the base and comes near.
//!
//! Let e be the error of the potential of the base, and H the function that is e on the body, zero on the
//! electrodes and without sources elsewhere. The energy X of e in the body and of H outside is what the body
//! *sees* of e. Let nothing else lie in a ball of radius b around the middle of a body of radius a, and let
//! q = a / b. The part of e without sources in the ball is a sum of solid harmonics. Of the energy of a
//! harmonic of degree l >= 1 in the ball, the body sees a share of at most
//! (2 l + 1) / l q^(2 l + 1) / (1 - q^(2 l + 1)), where H is taken to end where the ball ends. Of a
//! constant it sees at most q / (1 - q) of the energy that a function falling from it to zero has
//! outside of the ball. Where e is odd across a plane through the middle, the constant is zero. The rest of e
//! in the ball has at most the energy of the difference between the flux of the base and the gradient of its
//! potential in the ball.

use crate::boxes::layout::Frame;
use crate::boxes::scene_map::{MapAxis, SceneMap};
use elastocap_fem::line::Element;
use elastocap_geometry::meshing::grid::GradedAxis;
use elastocap_geometry::scene::{Box3, Role, Scene, Wall};
use std::f64::consts::PI;

/// A body in the middle of a ball that holds nothing else. It tells how much of the error of a base the body
/// sees.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// The middle, in a frame.
    pub(crate) middle: [f64; 3],
    /// Radius of the ball that holds nothing else, in the unit of the frame.
    pub(crate) clear: f64,
    /// Radius of a ball that holds the body, over `clear`.
    near: f64,
    /// The permittivity in the ball over the smallest anywhere.
    contrast: f64,
}

/// Sample points per degree of a polynomial: the zeros of the Chebyshev polynomial of this many times the
/// degree. Between them the polynomial exceeds its values there by a factor of 1 / cos(pi / 8) at most
/// (Ehlich and Zeller 1964).
const FINER: usize = 4;

/// The square of that factor, rounded up: it holds for polynomials of two coordinates.
const BETWEEN: f64 = 1.18;

/// Radius of the ball over the distance of the nearest other thing. The error of the base in the ball grows
/// towards that. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const CLEAR: f64 = 0.8;

impl Sight {
    /// The sight of the body that follows the first `others` conductors of a scene, under a map and in a
    /// frame. In other scenes that body may be closer to everything else, by at most `nearer` (m). `None` if
    /// there is no such body or more than one, if it is not a single box, if the map bends another one as
    /// well, if no ball around it is free of other things, or if a wall is insulated.
    pub(crate) fn of(
        scene: &Scene,
        map: &SceneMap,
        others: usize,
        frame: &Frame,
        nearer: f64,
    ) -> Option<Self> {
        let mut added = scene.conductors().skip(others);
        let (conductor, more) = (added.next()?, added.next());
        let [region] = conductor.body.boxes()?[..] else { return None };
        if more.is_some() || scene.walls.iter().flatten().any(|wall| *wall == Wall::Insulated) {
            return None;
        }
        let (middle, radius) = ball_around(&region, map)?;
        let bent = hull(map)?;
        let around = scene.dielectrics().filter(|dielectric| dielectric.body.contains(middle)).last();
        let permittivity =
            around.map_or(scene.background_permittivity, |dielectric| dielectric.relative_permittivity);
        let mut clear = f64::INFINITY;
        for body in scene.bodies.iter().filter(|body| *body != conductor.body) {
            if matches!(body.role, Role::Dielectric { relative_permittivity } if relative_permittivity == permittivity)
            {
                continue;
            }
            for part in body.boxes()? {
                if (0..3).all(|a| part.min[a] < bent.max[a] && bent.min[a] < part.max[a]) {
                    return None;
                }
                clear = clear.min(distance(&part, middle));
            }
        }
        if permittivity != scene.background_permittivity {
            // The dielectric around the body must be one box that holds all that the map bends.
            let [part] = around?.body.boxes()?[..] else { return None };
            if (0..3).any(|a| bent.min[a] < part.min[a] || part.max[a] < bent.max[a]) {
                return None;
            }
            for a in 0..3 {
                clear = clear.min(middle[a] - part.min[a]).min(part.max[a] - middle[a]);
            }
        }
        for a in 0..3 {
            clear = clear.min(middle[a] - scene.domain.min[a]).min(scene.domain.max[a] - middle[a]);
        }
        let clear = CLEAR * (clear - nearer);
        let least = scene.permittivities().into_iter().fold(f64::INFINITY, f64::min);
        let is_clear = clear.is_finite() && radius < clear;
        is_clear.then(|| Self {
            middle: [0, 1, 2].map(|a| (middle[a] - frame.origin[a]) / frame.unit),
            clear: clear / frame.unit,
            near: radius / clear,
            contrast: permittivity / least,
        })
    }

    /// An upper bound on the share that the body sees of the energy in the ball of an error without sources
    /// there.
    pub(crate) fn share(&self, is_odd: bool) -> f64 {
        let q = self.near;
        let linear = 3.0 * q.powi(3) / (1.0 - q.powi(3));
        if is_odd { linear } else { linear.max(self.contrast * q / (1.0 - q)) }
    }
}

/// Weight of the energy that a base misses in the ball: the body sees it from close by, and the energy that
/// is missing at edges from afar. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const WEIGHT: f64 = 40.0;

/// Least distance of an element of the ball from the origin of the frame, over that of the farthest point of
/// a conductor. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const BESIDE: f64 = 2.0;

impl Sight {
    /// Whether the ball is far enough from the conductors for elements in it to be refined separately. The
    /// conductors reach to `farthest` from the origin of the frame.
    pub(crate) fn is_far(&self, farthest: f64) -> bool {
        self.middle.iter().map(|x| x * x).sum::<f64>().sqrt() - self.clear >= BESIDE * farthest
    }

    /// The weight of the energy that element `e` of the axis `a` of a grid misses. The conductors reach to
    /// `farthest` from the origin of the frame.
    pub(crate) fn weight(&self, a: usize, axis: &GradedAxis, e: usize, farthest: f64) -> f64 {
        let Element::Finite { start, length } = axis.line.element(e) else { return 1.0 };
        let (low, high) = (self.middle[a] - self.clear, self.middle[a] + self.clear);
        let nearest = start.max(-(start + length));
        if nearest >= BESIDE * farthest && start < high && low < start + length { WEIGHT } else { 1.0 }
    }
}

/// The distance of a point from a box.
fn distance(region: &Box3, from: [f64; 3]) -> f64 {
    let along = |a: usize| (region.min[a] - from[a]).max(from[a] - region.max[a]).max(0.0);
    (0..3).map(|a| along(a).powi(2)).sum::<f64>().sqrt()
}

/// The box in which a map may bend space.
fn hull(map: &SceneMap) -> Option<Box3> {
    let mut out = Box3 { min: [0.0; 3], max: [0.0; 3] };
    for (a, axis) in map.axes().iter().enumerate() {
        let (first, last) = (*axis.breaks.first()?, *axis.breaks.last()?);
        (out.min[a], out.max[a]) = (if axis.mirrored { -last } else { first }, last);
    }
    Some(out)
}

/// Middle and radius (m) of a ball that holds the image of a box.
fn ball_around(region: &Box3, map: &SceneMap) -> Option<([f64; 3], f64)> {
    let places = [0, 1, 2].map(|a| places(&map.axes()[a], [region.min[a], region.max[a]]));
    let mut points = Vec::new();
    for a in 0..3 {
        for end in [region.min[a], region.max[a]] {
            let mut face = places.clone();
            face[a] = vec![end];
            points.extend(map.images(&face));
        }
    }
    let ends = |a: usize| {
        let coordinates = points.iter().map(|p| p[a]);
        coordinates.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    let middle = [0, 1, 2].map(|a| 0.5 * ends(a).iter().sum::<f64>());
    let squares = points.iter().map(|p| (0..3).map(|a| (p[a] - middle[a]).powi(2)).sum::<f64>());
    let [least, most] = squares.fold([f64::INFINITY, 0.0_f64], |[low, high], x| [low.min(x), high.max(x)]);
    let radius = (0.5 * (least + most) + 0.5 * BETWEEN * (most - least)).sqrt();
    radius.is_finite().then_some((middle, radius))
}

/// Sample points between two ends of an axis, as dense as squares of the polynomials of a map need.
fn places(axis: &MapAxis, [low, high]: [f64; 2]) -> Vec<f64> {
    let mut out = Vec::new();
    let mut add = |[from, to]: [f64; 2], degree: usize| {
        let (from, to) = (from.max(low), to.min(high));
        let count = 2 * FINER * degree;
        if from < to {
            let zero = |k: usize| (PI * (k as f64 + 0.5) / count as f64).cos();
            out.extend((0..count).map(|k| 0.5 * (from + to) + 0.5 * (to - from) * zero(k)));
        }
    };
    for (ends, &degree) in axis.breaks.windows(2).zip(&axis.degrees) {
        add([ends[0], ends[1]], degree);
        if axis.mirrored {
            add([-ends[1], -ends[0]], degree);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_geometry::scene::Body;
    use elastocap_geometry::shapes::Shape;

    /// A box 1 wide at a height of 10 that a map makes a ball of radius 0.5 and lowers by 0.25, over a slab
    /// and a box.
    fn scene() -> (Scene, SceneMap) {
        let cuboid = |min: [f64; 3], max: [f64; 3]| Shape::Box(Box3 { min, max });
        let bodies = vec![
            Body::conductor("electrode", cuboid([-3.0, 1.0, -1.0], [-1.0, 2.0, 1.0])),
            Body::dielectric("slab", cuboid([f64::NEG_INFINITY, 0.0, -9.0], [f64::INFINITY, 3.0, 9.0]), 4.0),
            Body::grounded("ball", cuboid([-0.5, 9.5, -0.5], [0.5, 10.5, 0.5])),
        ];
        let walls = [[Wall::Open; 2]; 3];
        let scene = Scene { bodies, background_permittivity: 2.0, domain: Box3::SPACE, walls };
        let axis = |breaks: &[f64], mirrored: bool| MapAxis {
            breaks: breaks.to_vec(),
            degrees: vec![10; breaks.len() - 1],
            mirrored,
        };
        let axes = [
            axis(&[0.0, 0.5, 2.0], true),
            axis(&[8.0, 9.5, 10.5, 12.0], false),
            axis(&[0.0, 0.5, 2.0], true),
        ];
        let bend = |[x, y, z]: [f64; 3]| {
            let relative = [x, y - 10.0, z];
            let size = relative.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let round = relative.iter().map(|x| x * x).sum::<f64>().sqrt();
            let fall = if size > 0.5 { (2.0 - size) / 1.5 } else { 1.0 };
            let to = |x: f64| if round > 0.0 { fall * x * (size / round - 1.0) } else { 0.0 };
            [to(relative[0]), to(relative[1]) - 0.25 * fall, to(relative[2])]
        };
        (scene, SceneMap::new(axes, bend))
    }

    #[test]
    fn a_ball_is_seen_to_be_as_large_and_as_far_away_as_it_is() {
        let (scene, map) = scene();
        let frame = Frame { origin: [0.0, 1.0, 0.0], unit: 2.0 };
        let sight = Sight::of(&scene, &map, 1, &frame, 0.0).unwrap();
        // From 9.75 to the slab at 3.
        let clear = CLEAR * 6.75;
        assert!(
            (sight.clear - 0.5 * clear).abs() < 1e-9 && (sight.middle[1] - 4.375).abs() < 1e-9,
            "{sight:?}"
        );
        let q = 0.5 / clear;
        assert!((sight.near / q - 1.0).abs() < 0.02 && sight.near > q * (1.0 - 1e-9), "{sight:?} {q}");
        // Air has the smallest permittivity there is.
        assert_eq!(sight.contrast, 1.0);
        let [odd, even] = [true, false].map(|odd| sight.share(odd));
        assert!((odd / (3.0 * q.powi(3)) - 1.0).abs() < 0.1 && (even / q - 1.0).abs() < 0.2, "{odd} {even}");
        let nearer = Sight::of(&scene, &map, 1, &frame, 3.0).unwrap();
        assert!((nearer.clear / sight.clear - 3.75 / 6.75).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_said_of_a_body_that_may_be_seen_through_other_things() {
        let frame = Frame { origin: [0.0; 3], unit: 1.0 };
        let has_sight = |change: &dyn Fn(&mut Scene)| {
            let (mut scene, map) = scene();
            change(&mut scene);
            Sight::of(&scene, &map, 1, &frame, 0.0).is_some()
        };
        assert!(has_sight(&|_| ()));
        assert!(!has_sight(&|scene| scene.walls[1][0] = Wall::Insulated));
        // A slab that the map bends, a second conductor after the electrode, and none.
        assert!(!has_sight(&|scene| scene.bodies[1] = Body::dielectric(
            "slab",
            Shape::Box(Box3 { min: [-1.0, 0.0, -1.0], max: [1.0, 8.5, 1.0] }),
            4.0
        )));
        assert!(!has_sight(&|scene| {
            let shape = Shape::Box(Box3 { min: [5.0, 9.0, 5.0], max: [6.0, 10.0, 6.0] });
            scene.bodies.push(Body::grounded("another", shape));
        }));
        assert!(!has_sight(&|scene| {
            scene.bodies.pop();
        }));
        // In a layer that holds all that the map bends, and in one that does not. A cover with the
        // permittivity of the background changes nothing.
        let cover = |from: f64, permittivity: f64| {
            let region = Box3 { min: [f64::NEG_INFINITY, from, f64::NEG_INFINITY], max: [f64::INFINITY; 3] };
            Body::dielectric("cover", Shape::Box(region), permittivity)
        };
        assert!(has_sight(&|scene| scene.bodies.insert(1, cover(5.0, 3.0))));
        assert!(!has_sight(&|scene| scene.bodies.insert(1, cover(9.0, 3.0))));
        assert!(has_sight(&|scene| scene.bodies.insert(1, cover(9.0, 2.0))));
    }

    /// A harmonic of degree 1 in a ball of radius b, and what a body of radius a sees of it: by quadrature
    /// along the radius.
    #[test]
    fn the_share_of_a_linear_error_is_that_of_the_solution_between_two_spheres() {
        let sight = Sight { middle: [0.0; 3], clear: 1.0, near: 0.4, contrast: 1.0 };
        let (a, b) = (0.4_f64, 1.0_f64);
        // e = r cos, and H = f cos with f = e at a and 0 at b.
        let c = a / (a - b.powi(3) / (a * a));
        let f = |r: f64| [c * (r - b.powi(3) / (r * r)), c * (1.0 + 2.0 * b.powi(3) / r.powi(3))];
        let energy = |f: &dyn Fn(f64) -> [f64; 2], from: f64, to: f64| -> f64 {
            let n = 20_000;
            let at = |k: usize| from + (to - from) * (k as f64 + 0.5) / n as f64;
            // Means of cos^2 and sin^2 over a sphere are 1/3 and 2/3.
            let density = |r: f64| {
                let [value, slope] = f(r);
                4.0 * PI * (slope * slope / 3.0 + 2.0 / 3.0 * (value / r).powi(2)) * r * r
            };
            (0..n).map(|k| density(at(k))).sum::<f64>() * (to - from) / n as f64
        };
        let straight = |r: f64| [r, 1.0];
        let seen = energy(&straight, 0.0, a) + energy(&f, a, b);
        let share = seen / energy(&straight, 0.0, b);
        assert!((sight.share(true) / share - 1.0).abs() < 1e-6, "{} {share}", sight.share(true));
    }
}

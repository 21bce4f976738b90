//! Bodies that move with the layer's top or with the indenter.

use std::sync::Arc;

use elastocap_case::Pose;
use elastocap_electrostatics::{MapAxis, SceneMap};
use elastocap_geometry::scene::{Body, Box3, Purpose};
use elastocap_geometry::shapes::Shape;

use super::SceneError;

/// Distance over which the map of a tilt decays beside and above the tilted bodies, over their length on that
/// axis, unless another body is closer. Tuned: `time elastocap run cases/quadrants.toml`.
const REACH: f64 = 0.5;

/// Distance over which the map of a tilt decays towards another body, over the distance to that body. Tuned:
/// `time elastocap run cases/quadrants.toml`.
const SHARE: f64 = 0.9;

/// Whether a body is attached to the top of the layer or to the indenter.
pub(super) fn is_attached(body: &Body) -> bool {
    matches!(body.purpose, Purpose::OnTop | Purpose::OnIndenter)
}

/// The bodies, with attached ones moved by the displacement of the top along x2 and by the shift of the pose,
/// m; bodies on the indenter also by its distance from the layer.
///
/// # Errors
/// A moved body has a shape that cannot be translated.
pub(crate) fn moved(bodies: Vec<Body>, top: f64, pose: &Pose) -> Result<Vec<Body>, SceneError> {
    let moved = |mut body: Body| {
        let distance = if body.purpose == Purpose::OnIndenter { pose.distance } else { 0.0 };
        let by = [pose.shift[0], top + distance, pose.shift[1]];
        if is_attached(&body) && by != [0.0; 3] {
            body.parts = body
                .parts
                .into_iter()
                .map(|part| part.moved(by))
                .collect::<Option<_>>()
                .ok_or(SceneError::Missing("shape of its own for what is attached"))?;
        }
        Ok(body)
    };
    bodies.into_iter().map(moved).collect()
}

/// The rotation of all attached bodies about the middle of their lower side.
pub(super) struct Tilt {
    /// The box around the attached bodies before the rotation, m.
    hull: Box3,
    /// The angles about x3 and about x1.
    angles: [f64; 2],
}

impl Tilt {
    /// The tilt of the attached bodies among `bodies`; `None` if the pose has no tilt or no body is attached.
    pub(super) fn of(bodies: &[Body], pose: &Pose) -> Option<Self> {
        if pose.tilt == [0.0; 2] {
            return None;
        }
        let bounds = bodies.iter().filter(|body| is_attached(body)).filter_map(Body::bounds);
        Some(Self { hull: bounds.reduce(|a, b| a.union(&b))?, angles: pose.tilt })
    }

    /// The position of a point of an attached body after the rotation, m.
    pub(super) fn image(&self, x: [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.hull;
        let pivot = [0.5 * (min[0] + max[0]), min[1], 0.5 * (min[2] + max[2])];
        turned(x, pivot, self.angles)
    }
}

/// The map that tilts the attached bodies and deforms the space between them and the substrate. `others` are
/// the bodies of the scene that are not attached, without the slabs.
///
/// The bodies rotate about the middle of their lower side. Below them the displacement falls linearly to zero
/// at the substrate, so that the layer follows them; above and beside them it falls to zero over half of
/// their lengths, or before the next body that is not attached, such as an indenter in the field.
///
/// # Errors
/// A body that is not attached lies so close to the attached ones that the map would deform it, or there is
/// no layer below them.
pub(super) fn tilted<'a>(
    tilt: &Tilt,
    others: impl Iterator<Item = &'a Body>,
    domain: &Box3,
) -> Result<Arc<SceneMap>, SceneError> {
    let hull = tilt.hull;
    let mut frame = Box3 {
        min: [0, 1, 2].map(|a| hull.min[a] - REACH * hull.extent(a)),
        max: [0, 1, 2].map(|a| hull.max[a] + REACH * hull.extent(a)),
    };
    // Along x2 the shorter length in the plane is used, since a plate is thin along x2. Below, the map ends
    // at the substrate.
    let reach = REACH * hull.extent(0).min(hull.extent(2));
    (frame.min[1], frame.max[1]) = (0.0, hull.max[1] + reach);
    for a in 0..3 {
        frame.min[a] = frame.min[a].max(domain.min[a]);
        frame.max[a] = frame.max[a].min(domain.max[a]);
    }
    for body in others {
        for region in body.parts.iter().filter_map(Shape::bounds) {
            make_room(&mut frame, &hull, &region)
                .ok_or_else(|| SceneError::InTheWay { body: body.name.clone() })?;
        }
    }
    if frame.min[1] >= hull.min[1] {
        return Err(SceneError::Missing("layer under what is tilted"));
    }
    let axis = |a: usize| {
        let mut breaks = vec![frame.min[a], hull.min[a], hull.max[a], frame.max[a]];
        breaks.dedup_by(|a, b| *a == *b);
        let mirrored = a != 1
            && keeps_mirror(a, tilt.angles)
            && breaks.iter().zip(breaks.iter().rev()).all(|(x, y)| *x == -y);
        if mirrored {
            breaks.retain(|x| *x > 0.0);
            breaks.insert(0, 0.0);
        }
        MapAxis { degrees: vec![1; breaks.len() - 1], breaks, mirrored }
    };
    let axes = [axis(0), axis(1), axis(2)];
    let map = SceneMap::new(axes, |x| {
        let near = [0, 1, 2].map(|a| x[a].clamp(hull.min[a], hull.max[a]));
        let rest: f64 = (0..3)
            .map(|a| match x[a] {
                x if x < hull.min[a] => (x - frame.min[a]) / (hull.min[a] - frame.min[a]),
                x if x > hull.max[a] => (frame.max[a] - x) / (frame.max[a] - hull.max[a]),
                _ => 1.0,
            })
            .product();
        let to = tilt.image(near);
        [0, 1, 2].map(|a| rest * (to[a] - near[a]))
    });
    Ok(Arc::new(map))
}

/// Whether a tilted scene keeps its mirror plane perpendicular to an axis.
fn keeps_mirror(axis: usize, [about_x3, about_x1]: [f64; 2]) -> bool {
    match axis {
        0 => about_x3 == 0.0,
        _ => about_x1 == 0.0,
    }
}

/// A point rotated about x3 and then about x1, right-handed.
fn turned(x: [f64; 3], pivot: [f64; 3], [about_x3, about_x1]: [f64; 2]) -> [f64; 3] {
    let [mut a, mut b, mut c] = [0, 1, 2].map(|k| x[k] - pivot[k]);
    let (sine, cosine) = about_x3.sin_cos();
    (a, b) = (cosine * a - sine * b, sine * a + cosine * b);
    let (sine, cosine) = about_x1.sin_cos();
    (b, c) = (cosine * b - sine * c, sine * b + cosine * c);
    [a + pivot[0], b + pivot[1], c + pivot[2]]
}

/// Shrinks the `frame` of the map until a body that is not attached lies outside; `None` if that body
/// overlaps the `hull` of the tilted bodies on every axis.
fn make_room(frame: &mut Box3, hull: &Box3, other: &Box3) -> Option<()> {
    let is_outside = (0..3).any(|a| other.max[a] <= frame.min[a] || other.min[a] >= frame.max[a]);
    if is_outside {
        return Some(());
    }
    // The side with the largest distance between the two.
    let rooms = (0..3).flat_map(|a| {
        let below = (hull.min[a] - other.max[a], a, false);
        let above = (other.min[a] - hull.max[a], a, true);
        [below, above]
    });
    let (room, a, is_above) = rooms.max_by(|x, y| x.0.total_cmp(&y.0))?;
    if room <= 0.0 {
        return None;
    }
    match is_above {
        true => frame.max[a] = hull.max[a] + SHARE * room,
        false => frame.min[a] = hull.min[a] - SHARE * room,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tilts_are_right_handed_about_x3_and_then_about_x1() {
        let near = |x: [f64; 3], y: [f64; 3]| (0..3).all(|k| (x[k] - y[k]).abs() < 1e-12);
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(near(turned([1.0, 0.0, 0.0], [0.0; 3], [quarter, 0.0]), [0.0, 1.0, 0.0]));
        assert!(near(turned([0.0, 0.0, 1.0], [0.0; 3], [0.0, quarter]), [0.0, -1.0, 0.0]));
        assert!(near(turned([2.0, 1.0, 1.0], [1.0; 3], [quarter, quarter]), [1.0, 1.0, 2.0]));
    }
}

//! Bodies that move with the layer's top or with the indenter.

use std::sync::Arc;

use elastocap_case::Pose;
use elastocap_electrostatics::{MapAxis, SceneMap};
use elastocap_geometry::scene::{Body, Box3, Purpose};
use elastocap_geometry::shapes::Shape;

use super::SceneError;

/// How far a tilt is felt beside and above the bodies that are tilted, in their own lengths, unless something is in the way.
const REACH: f64 = 0.5;

/// How far a tilt is felt toward a body that is in its way, as a share of the distance to that body.
const SHARE: f64 = 0.9;

/// Whether a body is attached to anything.
pub(super) fn is_attached(body: &Body) -> bool {
    matches!(body.purpose, Purpose::OnTop | Purpose::OnIndenter)
}

/// The bodies with those that are attached moved by the top's displacement along x2 and by the shift, m; those on the indenter by its
/// distance from the layer as well.
///
/// # Errors
/// A body that is moved and has no place of its own.
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

/// The turn of all that is attached, about the middle of its lower side.
pub(super) struct Tilt {
    /// The box around it before the turn, m.
    own: Box3,
    angles: [f64; 2],
}

impl Tilt {
    /// The tilt of the attached ones among some bodies; `None` without a tilt.
    pub(super) fn of(bodies: &[Body], pose: &Pose) -> Option<Self> {
        if pose.tilt == [0.0; 2] {
            return None;
        }
        let own = bodies.iter().filter(|body| is_attached(body)).filter_map(Body::bounds);
        Some(Self { own: own.reduce(|a, b| a.union(&b))?, angles: pose.tilt })
    }

    /// Where a point of an attached body comes to lie, m.
    pub(super) fn image(&self, x: [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.own;
        let pivot = [0.5 * (min[0] + max[0]), min[1], 0.5 * (min[2] + max[2])];
        turned(x, pivot, self.angles)
    }
}

/// The map that tilts what is attached, and bends what lies between it and the substrate along. The `others` are the bodies of the scene
/// that are not attached, slabs aside, in a domain.
///
/// The bodies turn about the middle of their lower side. Below them the displacement falls evenly to zero at the substrate, so that a
/// layer that they lie on follows them; above and beside them it falls to zero over half of their lengths, or up to the next body that
/// is not attached, the indenter of the field among them.
///
/// # Errors
/// A body that is not attached beside those that are, so that the map would bend it.
pub(super) fn tilted<'a>(
    tilt: &Tilt,
    others: impl Iterator<Item = &'a Body>,
    domain: &Box3,
) -> Result<Arc<SceneMap>, SceneError> {
    let own = tilt.own;
    let mut frame = Box3 {
        min: [0, 1, 2].map(|a| own.min[a] - REACH * own.extent(a)),
        max: [0, 1, 2].map(|a| own.max[a] + REACH * own.extent(a)),
    };
    // Along x2 in the lengths of the plane, of which a plate has less than any; down to the substrate.
    let reach = REACH * own.extent(0).min(own.extent(2));
    (frame.min[1], frame.max[1]) = (0.0, own.max[1] + reach);
    for a in 0..3 {
        frame.min[a] = frame.min[a].max(domain.min[a]);
        frame.max[a] = frame.max[a].min(domain.max[a]);
    }
    for body in others {
        for region in body.parts.iter().filter_map(Shape::bounds) {
            make_room(&mut frame, &own, &region)
                .ok_or_else(|| SceneError::InTheWay { body: body.name.clone() })?;
        }
    }
    if frame.min[1] >= own.min[1] {
        return Err(SceneError::Missing("layer under what is tilted"));
    }
    let axis = |a: usize| {
        let mut breaks = vec![frame.min[a], own.min[a], own.max[a], frame.max[a]];
        breaks.dedup_by(|a, b| *a == *b);
        let mirrored = a != 1
            && is_kept(a, tilt.angles)
            && breaks.iter().zip(breaks.iter().rev()).all(|(x, y)| *x == -y);
        if mirrored {
            breaks.retain(|x| *x > 0.0);
            breaks.insert(0, 0.0);
        }
        MapAxis { degrees: vec![1; breaks.len() - 1], breaks, mirrored }
    };
    let axes = [axis(0), axis(1), axis(2)];
    let map = SceneMap::new(axes, |x| {
        let near = [0, 1, 2].map(|a| x[a].clamp(own.min[a], own.max[a]));
        let rest: f64 = (0..3)
            .map(|a| match x[a] {
                x if x < own.min[a] => (x - frame.min[a]) / (own.min[a] - frame.min[a]),
                x if x > own.max[a] => (frame.max[a] - x) / (frame.max[a] - own.max[a]),
                _ => 1.0,
            })
            .product();
        let to = tilt.image(near);
        [0, 1, 2].map(|a| rest * (to[a] - near[a]))
    });
    Ok(Arc::new(map))
}

/// Whether a tilt leaves a scene its mirror image across an axis.
fn is_kept(axis: usize, [about_x3, about_x1]: [f64; 2]) -> bool {
    match axis {
        0 => about_x3 == 0.0,
        _ => about_x1 == 0.0,
    }
}

/// A point turned about x3 and then about x1, right-handed.
fn turned(x: [f64; 3], pivot: [f64; 3], [about_x3, about_x1]: [f64; 2]) -> [f64; 3] {
    let [mut a, mut b, mut c] = [0, 1, 2].map(|k| x[k] - pivot[k]);
    let (sine, cosine) = about_x3.sin_cos();
    (a, b) = (cosine * a - sine * b, sine * a + cosine * b);
    let (sine, cosine) = about_x1.sin_cos();
    (b, c) = (cosine * b - sine * c, sine * b + cosine * c);
    [a + pivot[0], b + pivot[1], c + pivot[2]]
}

/// Draws the frame in until the inner of it does not hold a body that stays where it is; `None` where that stands beside the bodies that
/// are tilted, or closer than they are wide apart.
fn make_room(frame: &mut Box3, own: &Box3, other: &Box3) -> Option<()> {
    let is_outside = (0..3).any(|a| other.max[a] <= frame.min[a] || other.min[a] >= frame.max[a]);
    if is_outside {
        return Some(());
    }
    // The side on which there is the most room for its size.
    let rooms = (0..3).flat_map(|a| {
        let below = (own.min[a] - other.max[a], a, false);
        let above = (other.min[a] - own.max[a], a, true);
        [below, above]
    });
    let (room, a, is_above) = rooms.max_by(|x, y| x.0.total_cmp(&y.0))?;
    if room <= 0.0 {
        return None;
    }
    match is_above {
        true => frame.max[a] = own.max[a] + SHARE * room,
        false => frame.min[a] = own.min[a] - SHARE * room,
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

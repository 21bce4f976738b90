//! The contact between the surface of a layer and the outline of an indenter: where the contact ends, and
//! where the edges of the lower face of the indenter's box are.

use std::f64::consts::{FRAC_PI_4, PI};

use super::films::Contact;
use super::profile::Profile;

/// Sampled places per thickness of the layer. It is not tuned.
const PER_THICKNESS: f64 = 100.0;

/// Length over which the surface is followed beyond the flat face, in thicknesses of the layer (the radius of
/// the round edge, if that is larger), and the largest number of sampled places. It is not tuned.
const FOLLOWED: f64 = 6.0;
const MAX_PLACES: f64 = 4000.0;

/// The lower face of a punch's box extends at least by the angle `AROUND` (rad) around the punch's corner. It
/// ends where the surface turns away from the outline by more than the angle `TURNED_AWAY` (rad), or is
/// farther from it than `AWAY` thicknesses of the layer. Tuned: time and `geometry_error_estimate` of
/// `elastocap run cases/comb-on-board.toml`.
const AROUND: f64 = FRAC_PI_4;
const TURNED_AWAY: f64 = 0.7;
const AWAY: f64 = 0.1;

/// Two lower limits of the length of the lower face of a cylinder's box, over that of the contact, and the
/// largest angle (rad) from the cylinder's lowest point to the edge of the face. Only the first of the lower
/// limits is capped by this angle. Tuned: time and `geometry_error_estimate` of
/// `elastocap run cases/approach-to-touch.toml`.
const BEYOND_CONTACT: [f64; 2] = [1.5, 1.1];
const WIDEST: f64 = 0.58;

/// The surface of a layer as seen from an indenter.
pub(super) struct Surface<'a> {
    /// The deformed position of the surface point at a place along x1, in the plane of symmetry: along x1
    /// from the middle of the indenter, and along x2 from its lowest point, m.
    pub(super) image: &'a dyn Fn(f64) -> [f64; 2],
    /// The undeformed thickness of the layer, m.
    pub(super) thickness: f64,
    /// The kind of contact.
    pub(super) contact: Contact,
}

/// One side of the lower face of an indenter's box. Places are coordinates before the layer deforms, from the
/// middle of the indenter outwards along x1, m.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Edge {
    /// The place of the edge of the face.
    pub(super) at: f64,
    /// The length of the outline up to it, m.
    pub(super) along: f64,
    /// The end of the contact; zero without contact.
    pub(super) contact: f64,
    /// The places where the outline changes its curvature, the contact ends and the face ends, ascending.
    pub(super) marks: Vec<f64>,
}

/// The left and the right edge; `None` where the surface does not separate from the outline within the
/// followed length.
pub(super) fn edges(profile: &Profile, surface: &Surface<'_>, is_half: bool) -> Option<[Edge; 2]> {
    let right = edge(profile, surface, 1.0)?;
    let left = if is_half { right.clone() } else { edge(profile, surface, -1.0)? };
    Some([left, right])
}

/// The edge on one side; `sign` is the direction along x1.
fn edge(profile: &Profile, surface: &Surface<'_>, sign: f64) -> Option<Edge> {
    let followed = profile.flat + profile.radius.max(FOLLOWED * surface.thickness);
    let step = (surface.thickness / PER_THICKNESS).max(followed / MAX_PLACES);
    // The position of the surface point at a place, mirrored to the right side.
    let position = |x: f64| {
        let to = (surface.image)(sign * x);
        [sign * to[0], to[1]]
    };
    let (moved, touching) = (surface.contact.moved(), surface.contact.touching());
    let foot = |x: f64| profile.facing(position(x), moved);
    let steps = (followed / step).ceil() as usize;
    let place = |k: usize| k as f64 * step;
    // The place that faces the outline at this length.
    let first_beyond = |length: f64| {
        let k = (0..=steps).find(|k| foot(place(*k)).along > length)?;
        Some(between(&|x| foot(x).along > length, place(k.saturating_sub(1)), place(k)))
    };
    let is_apart = |x: f64| foot(x).gap > touching;
    let first_apart = (0..=steps).find(|k| is_apart(place(*k)));
    let contact = match first_apart {
        Some(0) => 0.0,
        Some(k) => between(&is_apart, place(k - 1), place(k)),
        None => return None,
    };
    let end = if profile.is_cylinder {
        let gap = foot(0.0).gap.max(0.0);
        // The map compresses space by R angle^2 / (2 gap) under the face, and by pi / (2 angle) in the wedge
        // beside it. The angle balances the two.
        let narrow = gap + moved.unwrap_or(0.0);
        let balanced = (PI * narrow / profile.radius).cbrt();
        let touched = foot(contact).along / profile.radius;
        let angle = balanced.max(BEYOND_CONTACT[0] * touched).min(WIDEST).max(BEYOND_CONTACT[1] * touched);
        first_beyond(angle * profile.radius)?
    } else {
        let around = profile.flat + AROUND * profile.radius;
        let leaves = |x: f64| {
            let foot = foot(x);
            let [a, b] = [position(x - step), position(x + step)];
            // The normal rotated by a quarter turn: the tangent that points up along the outline.
            let tangent = [-foot.normal[1], foot.normal[0]];
            let along = [b[0] - a[0], b[1] - a[1]];
            let turned = (along[0] * tangent[1] - along[1] * tangent[0])
                .atan2(along[0] * tangent[0] + along[1] * tangent[1]);
            let is_away = moved.is_none() || foot.gap > AWAY * surface.thickness;
            foot.along >= around && (turned > TURNED_AWAY || is_away)
        };
        let k = (0..=steps).find(|k| leaves(place(*k)))?;
        between(&leaves, place(k.saturating_sub(1)), place(k))
    };
    let along = foot(end).along.max(0.0);
    let mut marks: Vec<f64> = [profile.flat, profile.round_end()]
        .into_iter()
        .filter(|length| *length < along && !(profile.is_cylinder && *length == 0.0))
        .filter_map(first_beyond)
        .chain([contact, end])
        .filter(|x| *x > 0.0 && *x <= end)
        .collect();
    marks.sort_by(f64::total_cmp);
    // If two marks nearly coincide, the outer one is kept.
    let closest = 2.0 * step;
    let pairs = marks.iter().zip(marks.iter().skip(1).chain([&f64::INFINITY]));
    let marks = pairs.filter(|(x, next)| *next - *x > closest).map(|(x, _)| *x).collect();
    Some(Edge { at: end, along, contact: contact.min(end), marks })
}

/// The first coordinate between `low` and `high`, m, at which a condition holds that does not hold at `low`,
/// by bisection.
fn between(holds: &dyn Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    const PUNCH: Profile = Profile { flat: 1.0, radius: 0.1, height: 2.0, is_cylinder: false };

    const CLOSED: Contact = Contact::Closed(1e-4);

    fn edge_of(profile: &Profile, contact: Contact, image: &dyn Fn(f64) -> [f64; 2]) -> Option<Edge> {
        let surface = Surface { image, thickness: 0.5, contact };
        edges(profile, &surface, true).map(|[left, _]| left)
    }

    #[test]
    fn a_flat_surface_leaves_a_punch_where_its_corner_begins() {
        let edge = edge_of(&PUNCH, CLOSED, &|x| [x, 0.0]).unwrap();
        // The outline is 1e-4 above its lowest point there: sqrt(2 r 1e-4).
        assert!((edge.contact - 1.0 - 0.0045).abs() < 2e-4, "{edge:?}");
        let leaves = 1.0 + 0.1 * TURNED_AWAY.max(AROUND).tan();
        assert!((edge.at - leaves).abs() < 0.02, "{edge:?}");
    }

    #[test]
    fn a_surface_that_clings_to_the_flank_is_left_where_it_turns_away() {
        // Up the flank for 0.3, then at 45 degrees.
        let image = |x: f64| {
            let on = PUNCH.round_end() + 0.3;
            if x < on {
                PUNCH.point(x.max(0.0)).0
            } else {
                [1.1 + (x - on) * 0.5_f64.sqrt(), 0.4 + (x - on) * 0.5_f64.sqrt()]
            }
        };
        let edge = edge_of(&PUNCH, CLOSED, &image).unwrap();
        let end = PUNCH.round_end() + 0.3;
        assert!((edge.contact - end).abs() < 2e-3 && (edge.at - end).abs() < 1.1e-2, "{edge:?}");
        assert_eq!(edge.marks.len(), 3, "{edge:?}");
        assert!((edge.marks[0] - 1.0).abs() < 1e-6 && (edge.marks[1] - PUNCH.round_end()).abs() < 1e-6);
        assert_eq!(edge_of(&PUNCH, CLOSED, &|x| PUNCH.point(x).0), None);
    }

    #[test]
    fn the_face_of_a_cylinder_is_wider_the_farther_it_is_from_the_layer() {
        let cylinder = Profile { flat: 0.0, radius: 1.0, height: 2.0, is_cylinder: true };
        let far = edge_of(&cylinder, Contact::Apart, &|x| [x, -0.04]).unwrap();
        let near = edge_of(&cylinder, Contact::Apart, &|x| [x, -0.02]).unwrap();
        assert!(far.at > near.at && far.contact == 0.0, "{far:?} {near:?}");
        // R angle^2 / (2 gap) = pi / (2 angle).
        assert!((far.along.powi(2) / 0.08 - 0.5 * PI / far.along).abs() < 1e-4, "{far:?}");
    }
}

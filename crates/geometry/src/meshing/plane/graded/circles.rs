//! Circles that outlines follow, divided where they cross.

use super::circle::Circle;
use std::f64::consts::TAU;

/// Points on a circle or a side that are closer together than this, relative to its size, are one. Not tuned:
/// it only has to lie above rounding errors and below distances that matter.
pub(super) const SAME: f64 = 1e-9;

/// Circles that come closer than this to touching, relative to their size, are not divided. Not tuned: it
/// only has to lie above rounding errors and below distances that matter.
pub(super) const TOUCH: f64 = 1e-6;

/// The ends of a straight line.
pub(super) type Segment = [[f64; 2]; 2];

/// A part of a circle, anticlockwise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// The angle at which it begins, from 0 to a whole turn.
    begin: f64,
    /// The angle by which it turns, positive.
    turn: f64,
    /// Where it begins and ends, unless it is the whole circle.
    ends: Option<[[f64; 2]; 2]>,
}

/// Angles beyond the ends of an arc that count as part of it. Not tuned: it only has to lie above rounding
/// errors and below distances that matter.
const BEYOND: f64 = 1e-6;

impl Span {
    /// A whole circle.
    pub(super) const WHOLE: Self = Self { begin: 0.0, turn: TAU, ends: None };

    /// The arc of a circle from a point to another that turns by an angle, positive anticlockwise.
    pub(super) fn arc(circle: &Circle, from: [f64; 2], to: [f64; 2], turn: f64) -> Self {
        let (begin, end) = if turn > 0.0 { (from, to) } else { (to, from) };
        Self { begin: circle.angle(begin).rem_euclid(TAU), turn: turn.abs(), ends: Some([begin, end]) }
    }

    /// Whether the part contains the point at an angle.
    fn contains(&self, angle: f64) -> bool {
        let along = (angle - self.begin).rem_euclid(TAU);
        along <= self.turn + BEYOND || along >= TAU - BEYOND
    }
}

/// A circle and the points on it between which it is divided, by their angles from 0 to a whole turn,
/// ascending.
#[derive(Debug)]
pub(super) struct DividedCircle {
    /// The circle.
    pub circle: Circle,
    /// The angle and the position of each point.
    pub points: Vec<(f64, [f64; 2])>,
    /// The sum of the angles of those arcs in the frame that outlines follow.
    pub within: f64,
    /// The parts of the circle that outlines follow.
    spans: Vec<Span>,
}

impl DividedCircle {
    /// The point at which something meets the circle at about this angle: a known point of the circle, if
    /// there is one so near, otherwise a new one.
    pub(super) fn meet(&mut self, angle: f64) -> [f64; 2] {
        match self.points.iter().find(|(other, _)| apart(angle, *other) < SAME) {
            Some((_, place)) => *place,
            None => {
                let place = self.circle.at(angle);
                self.points.push((angle, place));
                place
            }
        }
    }

    /// Notes that an outline follows a part of the circle.
    fn follow(&mut self, span: Span) {
        for place in span.ends.into_iter().flatten() {
            let angle = self.circle.angle(place).rem_euclid(TAU);
            if !self.points.iter().any(|(other, _)| apart(angle, *other) < SAME) {
                self.points.push((angle, place));
            }
        }
        self.spans.push(span);
    }

    /// Adds evenly spaced points where outlines follow the circle, `arcs` of them on a whole circle, except
    /// for those next to a known point; then sorts all points.
    pub(super) fn add_spaced_points(&mut self, arcs: usize) {
        let step = TAU / arcs as f64;
        let spaced = (0..arcs).map(|k| k as f64 * step);
        let is_far = |a: &f64| self.points.iter().all(|(met, _)| apart(*a, *met) > 0.25 * step);
        let is_wanted = |a: &f64| is_far(a) && self.is_followed(*a);
        let mut added: Vec<f64> = spaced.filter(is_wanted).collect();
        // Every arc needs a point between its ends, which distinguishes it from its chord.
        for span in self.spans.iter().filter(|span| span.ends.is_some()) {
            let is_inside = |a: f64| {
                let along = (a - span.begin).rem_euclid(TAU);
                along > SAME && along < span.turn - SAME
            };
            let known = self.points.iter().map(|(a, _)| *a).chain(added.iter().copied());
            if !known.into_iter().any(is_inside) {
                added.push((span.begin + 0.5 * span.turn).rem_euclid(TAU));
            }
        }
        self.points.extend(added.into_iter().map(|a| (a, self.circle.at(a))));
        self.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// Whether an outline follows the circle at an angle.
    pub(super) fn is_followed(&self, angle: f64) -> bool {
        self.spans.iter().any(|span| span.contains(angle))
    }

    /// Whether an outline follows the circle from one angle anticlockwise to another, between which the
    /// circle has no points.
    pub(super) fn is_followed_between(&self, from: f64, to: f64) -> bool {
        let turn = (to - from).rem_euclid(TAU);
        self.is_followed(from + 0.5 * turn)
    }

    /// An end of a part that an outline follows, within a distance from a place; `None` if there is none.
    pub(super) fn end_near(&self, place: [f64; 2], distance: f64) -> Option<[f64; 2]> {
        let ends = self.spans.iter().filter_map(|span| span.ends).flatten();
        ends.into_iter().find(|end| (end[0] - place[0]).hypot(end[1] - place[1]) <= distance)
    }
}

/// The points at which two circles cross, and whether they only touch, or nearly so.
fn crossings_of(one: &Circle, other: &Circle) -> (Vec<[f64; 2]>, bool) {
    let along = [0, 1].map(|k| other.center[k] - one.center[k]);
    let distance = along[0].hypot(along[1]);
    let (sum, difference) = (one.radius + other.radius, (one.radius - other.radius).abs());
    if distance > sum * (1.0 + TOUCH) || distance < difference - sum * TOUCH || distance == 0.0 {
        return (Vec::new(), false);
    }
    if distance > sum * (1.0 - TOUCH) || distance < difference + sum * TOUCH {
        // Of two circles, one in the other, the smaller one is touched on the side away from the middle of
        // the larger one.
        let sign = if distance > difference + sum * TOUCH || one.radius > other.radius { 1.0 } else { -1.0 };
        let touching = [0, 1].map(|k| one.center[k] + sign * one.radius * along[k] / distance);
        return (vec![touching], true);
    }
    let to_chord = 0.5 * (distance + (one.radius - other.radius) * sum / distance);
    let half = ((one.radius - to_chord) * (one.radius + to_chord)).sqrt();
    let [x, y] = along.map(|x| x / distance);
    let place = |side: f64| {
        [one.center[0] + to_chord * x - side * half * y, one.center[1] + to_chord * y + side * half * x]
    };
    (vec![place(1.0), place(-1.0)], false)
}

/// Distance from the end of an arc, over its radius, within which a straight side that goes on from there
/// does not cross it again. It is not tuned.
pub(super) const NEARBY: f64 = 1e-4;

/// The circles of which outlines follow parts, with the points where these parts cross. `None` if parts
/// touch, other than where an outline passes from one circle to the other.
pub(super) fn circles_of(followed: Vec<(Circle, Span)>) -> Option<Vec<DividedCircle>> {
    let mut circles: Vec<DividedCircle> = Vec::new();
    for (circle, span) in followed {
        let is_same = |other: &Circle| {
            let differ = (0..2).map(|k| (circle.center[k] - other.center[k]).abs());
            let most = differ.fold((circle.radius - other.radius).abs(), f64::max);
            most <= 1e-2 * SAME * circle.radius
        };
        let known = circles.iter().position(|known| is_same(&known.circle));
        let index = known.unwrap_or(circles.len());
        if known.is_none() {
            circles.push(DividedCircle { circle, points: Vec::new(), within: 0.0, spans: Vec::new() });
        }
        circles[index].follow(span);
    }
    for k in 1..circles.len() {
        let (before, rest) = circles.split_at_mut(k);
        let current = &mut rest[0];
        for other in before {
            let (places, touch) = crossings_of(&other.circle, &current.circle);
            for place in places {
                let near = NEARBY * current.circle.radius.min(other.circle.radius);
                let joins =
                    current.end_near(place, near).is_some_and(|end| other.end_near(place, near) == Some(end));
                let meets = current.is_followed(current.circle.angle(place))
                    && other.is_followed(other.circle.angle(place));
                if joins || !meets {
                    continue;
                }
                if touch {
                    return None;
                }
                let shared = other.meet(other.circle.angle(place).rem_euclid(TAU));
                let angle = current.circle.angle(shared).rem_euclid(TAU);
                if !current.points.iter().any(|(known, _)| apart(angle, *known) < SAME) {
                    current.points.push((angle, shared));
                }
            }
        }
    }
    Some(circles)
}

/// The angle between two directions, by the shorter way.
pub(super) fn apart(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(TAU);
    difference.min(TAU - difference)
}

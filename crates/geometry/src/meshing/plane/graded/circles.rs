//! Sides of outlines, straight or round, divided where they cross.

use super::cubics;
use super::outline::{Course, Outline};
use crate::cubic::Cubic;
use std::f64::consts::{PI, TAU};

/// A circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its middle.
    pub center: [f64; 2],
    /// Its radius, positive.
    pub radius: f64,
}

impl Circle {
    pub(super) fn at(&self, angle: f64) -> [f64; 2] {
        // Exactly on the axes where it crosses them.
        let (sine, cosine) = angle.sin_cos();
        let clean = |x: f64| if x.abs() < 1e-15 { 0.0 } else { x };
        [self.center[0] + self.radius * clean(cosine), self.center[1] + self.radius * clean(sine)]
    }

    /// Whether it holds a point.
    pub fn contains(&self, p: [f64; 2]) -> bool {
        (p[0] - self.center[0]).hypot(p[1] - self.center[1]) < self.radius
    }

    pub(super) fn angle(&self, p: [f64; 2]) -> f64 {
        (p[1] - self.center[1]).atan2(p[0] - self.center[0])
    }

    /// The arc from a point to another that turns by an angle, positive anticlockwise.
    fn arc(&self, from: [f64; 2], to: [f64; 2], turn: f64) -> Span {
        let (begin, end) = if turn > 0.0 { (from, to) } else { (to, from) };
        Span { begin: self.angle(begin).rem_euclid(TAU), turn: turn.abs(), ends: Some([begin, end]) }
    }

    /// The angle, less than half a turn, by which the circle turns from a point to another; positive anticlockwise.
    pub fn turn(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let turn = (self.angle(to) - self.angle(from)).rem_euclid(TAU);
        if turn > PI { turn - TAU } else { turn }
    }

    /// The direction of the circle at a point of it, of length one, to the side of another direction.
    pub fn tangent(&self, at: [f64; 2], towards: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| (at[k] - self.center[k]) / self.radius);
        let sign = if x * towards[1] - y * towards[0] < 0.0 { -1.0 } else { 1.0 };
        [-sign * y, sign * x]
    }

    /// The middle of the shorter arc between two points.
    pub(super) fn between(&self, p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
        let [a, b] = [p, q].map(|p| [p[0] - self.center[0], p[1] - self.center[1]]);
        let sum = [a[0] + b[0], a[1] + b[1]];
        let length = sum[0].hypot(sum[1]);
        [0, 1].map(|k| self.center[k] + self.radius * sum[k] / length)
    }

    /// Where a segment meets it, as shares of the segment.
    fn crossings(&self, [a, b]: [[f64; 2]; 2]) -> Vec<f64> {
        let along = [b[0] - a[0], b[1] - a[1]];
        let from = [a[0] - self.center[0], a[1] - self.center[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let half = along[0] * from[0] + along[1] * from[1];
        let constant = from[0] * from[0] + from[1] * from[1] - self.radius * self.radius;
        let root = half * half - square * constant;
        if root <= 0.0 || square == 0.0 {
            return Vec::new();
        }
        let root = root.sqrt();
        // Without cancellation.
        let far = -(half + root.copysign(half));
        let both = [far / square, if far == 0.0 { f64::NAN } else { constant / far }];
        both.into_iter().filter(|t| (0.0..=1.0).contains(t)).collect()
    }
}

/// Points on a circle or a side that are closer together than this, relative to its size, are one.
pub(super) const SAME: f64 = 1e-9;

/// Circles that come closer than this to touching, relative to their size, are not divided.
pub(super) const TOUCH: f64 = 1e-6;

/// The ends of a straight line.
pub(super) type Segment = [[f64; 2]; 2];

/// A part of a circle, anticlockwise.
#[derive(Debug, Clone, Copy)]
struct Span {
    /// From 0 to a whole turn.
    begin: f64,
    turn: f64,
    /// Where it begins and ends, unless it is the whole circle.
    ends: Option<[[f64; 2]; 2]>,
}

/// Angles beyond the ends of an arc that count as its own.
const BEYOND: f64 = 1e-6;

impl Span {
    const WHOLE: Self = Self { begin: 0.0, turn: TAU, ends: None };

    fn holds(&self, angle: f64) -> bool {
        let along = (angle - self.begin).rem_euclid(TAU);
        along <= self.turn + BEYOND || along >= TAU - BEYOND
    }
}

/// A circle and the points on it between which it is divided, by their angles from 0 to a whole turn, ascending.
#[derive(Debug)]
pub(super) struct DividedCircle {
    pub circle: Circle,
    pub points: Vec<(f64, [f64; 2])>,
    /// The sum of the angles of the arcs in the frame.
    pub within: f64,
    /// The parts of it that outlines follow.
    spans: Vec<Span>,
}

impl DividedCircle {
    /// Where the circle is met at about this angle: a point that it is already known to be met at, if there is one so near.
    fn meet(&mut self, angle: f64) -> [f64; 2] {
        match self.points.iter().find(|(other, _)| apart(angle, *other) < SAME) {
            Some((_, place)) => *place,
            None => {
                let place = self.circle.at(angle);
                self.points.push((angle, place));
                place
            }
        }
    }

    /// Follows a part of it.
    fn follow(&mut self, span: Span) {
        for place in span.ends.into_iter().flatten() {
            let angle = self.circle.angle(place).rem_euclid(TAU);
            if !self.points.iter().any(|(other, _)| apart(angle, *other) < SAME) {
                self.points.push((angle, place));
            }
        }
        self.spans.push(span);
    }

    /// Whether an outline follows it at an angle.
    pub(super) fn is_followed(&self, angle: f64) -> bool {
        self.spans.iter().any(|span| span.holds(angle))
    }

    /// Whether an outline follows it from an angle anticlockwise to another, between which it has no points.
    pub(super) fn is_followed_between(&self, from: f64, to: f64) -> bool {
        let turn = (to - from).rem_euclid(TAU);
        self.is_followed(from + 0.5 * turn)
    }

    /// An end of an arc at about this place.
    pub(super) fn end_near(&self, place: [f64; 2], distance: f64) -> Option<[f64; 2]> {
        let ends = self.spans.iter().filter_map(|span| span.ends).flatten();
        ends.into_iter().find(|end| (end[0] - place[0]).hypot(end[1] - place[1]) <= distance)
    }
}

/// Where two circles cross, and whether they touch there, or nearly so.
fn crossings_of(one: &Circle, other: &Circle) -> (Vec<[f64; 2]>, bool) {
    let along = [0, 1].map(|k| other.center[k] - one.center[k]);
    let distance = along[0].hypot(along[1]);
    let (sum, difference) = (one.radius + other.radius, (one.radius - other.radius).abs());
    if distance > sum * (1.0 + TOUCH) || distance < difference - sum * TOUCH || distance == 0.0 {
        return (Vec::new(), false);
    }
    if distance > sum * (1.0 - TOUCH) || distance < difference + sum * TOUCH {
        // The smaller of two, one in the other, is touched on the side away from the larger one's middle.
        let outside =
            if distance > difference + sum * TOUCH || one.radius > other.radius { 1.0 } else { -1.0 };
        let touching = [0, 1].map(|k| one.center[k] + outside * one.radius * along[k] / distance);
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

/// What outlines consist of, divided where it crosses.
pub(super) struct Divided {
    pub circles: Vec<DividedCircle>,
    /// Straight sides, and chords of circles.
    pub segments: Vec<Segment>,
    /// Parts of cubics, whose chords are not among the segments.
    pub cubics: Vec<Cubic>,
}

/// The circles, and all sides of outlines and chords of circles in the frame, divided where they cross, and the cubics divided where
/// straight sides cross them. `None` where circles touch, or cross the frame between their points, and where cubics meet other curves.
pub(super) fn divided(
    outlines: &[Outline],
    whole: &Outline,
    frame: [[f64; 2]; 2],
    arcs: usize,
) -> Option<Divided> {
    let mut sides: Vec<Segment> = Vec::new();
    let mut straight = |a: [f64; 2], b: [f64; 2]| {
        // From the same end whichever outline it is a side of: rounding would tell the points of neighbours apart.
        sides.extend(clipped(if a <= b { [a, b] } else { [b, a] }, frame));
    };
    let mut followed: Vec<(Circle, Span)> = Vec::new();
    for outline in std::iter::once(whole).chain(outlines) {
        if let Outline::Circle(circle) = outline {
            followed.push((*circle, Span::WHOLE));
        }
        for (side, to) in outline.sides() {
            match side.arc {
                None => straight(side.from, to),
                Some(Course::Circle(circle, turn)) => {
                    followed.push((circle, circle.arc(side.from, to, turn)));
                }
                Some(Course::Cubic(_)) => {}
            }
        }
    }
    let mut circles = circles_of(followed)?;
    let mut cuts: Vec<Vec<(f64, [f64; 2])>> = vec![Vec::new(); sides.len()];
    for divided in &mut circles {
        let circle = divided.circle;
        for (side, cuts) in sides.iter().zip(&mut cuts) {
            let [a, b] = *side;
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            for t in circle.crossings(*side) {
                let place = [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
                // Where an arc goes over into a straight side without a corner, rounding finds a crossing anywhere nearby.
                let goes_over = |end: &[f64; 2]| *end == a || *end == b;
                if divided.end_near(place, NEARBY * circle.radius).is_some_and(|end| goes_over(&end))
                    || !divided.is_followed(circle.angle(place))
                {
                    continue;
                }
                let nearest = if t * length < SAME * circle.radius {
                    a
                } else if (1.0 - t) * length < SAME * circle.radius {
                    b
                } else {
                    place
                };
                cuts.push((t, divided.meet(circle.angle(nearest).rem_euclid(TAU))));
            }
        }
        // The usual points, but for those next to a crossing.
        let step = TAU / arcs as f64;
        let usual = (0..arcs).map(|k| k as f64 * step);
        let is_far = |a: &f64| divided.points.iter().all(|(met, _)| apart(*a, *met) > 0.25 * step);
        let is_wanted = |a: &f64| is_far(a) && divided.is_followed(*a);
        let mut usual: Vec<f64> = usual.filter(is_wanted).collect();
        // A point between its ends distinguishes an arc from its chord.
        for span in divided.spans.iter().filter(|span| span.ends.is_some()) {
            let is_inside = |a: f64| {
                let along = (a - span.begin).rem_euclid(TAU);
                along > SAME && along < span.turn - SAME
            };
            let known = divided.points.iter().map(|(a, _)| *a).chain(usual.iter().copied());
            if !known.into_iter().any(is_inside) {
                usual.push((span.begin + 0.5 * span.turn).rem_euclid(TAU));
            }
        }
        divided.points.extend(usual.into_iter().map(|a| (a, circle.at(a))));
        divided.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let mut cubics = cubics::followed(outlines);
    for (side, cuts) in sides.iter().zip(&mut cuts) {
        cubics.iter_mut().for_each(|cubic| cuts.extend(cubic.cross(*side)));
    }
    let mut pieces = Vec::new();
    for (side, mut cuts) in sides.into_iter().zip(cuts) {
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut last = side[0];
        for (_, place) in cuts.into_iter().chain([(1.0, side[1])]) {
            if place != last {
                pieces.push([last, place]);
                last = place;
            }
        }
    }
    let inside = |p: [f64; 2]| (0..2).all(|k| frame[0][k] <= p[k] && p[k] <= frame[1][k]);
    for divided in &mut circles {
        let (circle, points) = (divided.circle, &divided.points);
        let mut within = 0.0;
        for (k, (from, place)) in points.iter().enumerate() {
            let (to, next) = points[(k + 1) % points.len()];
            if !divided.is_followed_between(*from, to) {
                continue;
            }
            let chord = [*place, next];
            match chord.map(inside) {
                [true, true] => {
                    pieces.push(chord);
                    within += apart(*from, to);
                }
                [false, false] => {}
                // A crossing with the frame is a point of the circle, up to rounding.
                _ => {
                    let ends = chord.map(|p| [0, 1].map(|k| p[k].clamp(frame[0][k], frame[1][k])));
                    let moved = (0..2).map(|e| (ends[e][0] - chord[e][0]).hypot(ends[e][1] - chord[e][1]));
                    if ends[0] != ends[1] && moved.fold(0.0, f64::max) <= SAME * circle.radius {
                        pieces.push(ends);
                        within += apart(*from, to);
                    }
                }
            }
        }
        divided.within = within;
    }
    let cubics = cubics::parts(&cubics, &circles, &pieces, frame, arcs)?;
    Some(Divided { circles, segments: pieces, cubics })
}

/// Distance from the end of an arc, over its radius, within which a straight side that goes on from there does not cross it again.
pub(super) const NEARBY: f64 = 1e-4;

/// The circles of which some parts are followed, with the points where these cross. `None` if they touch, other than where one goes over
/// into the other.
fn circles_of(followed: Vec<(Circle, Span)>) -> Option<Vec<DividedCircle>> {
    let mut circles: Vec<DividedCircle> = Vec::new();
    for (circle, span) in followed {
        let is_same = |other: &Circle| {
            let differ = (0..2).map(|k| (circle.center[k] - other.center[k]).abs());
            let most = differ.fold((circle.radius - other.radius).abs(), f64::max);
            most <= 1e-2 * SAME * circle.radius
        };
        let known = circles.iter().position(|known| is_same(&known.circle));
        let at = known.unwrap_or(circles.len());
        if known.is_none() {
            circles.push(DividedCircle { circle, points: Vec::new(), within: 0.0, spans: Vec::new() });
        }
        circles[at].follow(span);
    }
    for k in 1..circles.len() {
        let (before, from_here) = circles.split_at_mut(k);
        let own = &mut from_here[0];
        for other in before {
            let (places, touch) = crossings_of(&other.circle, &own.circle);
            for place in places {
                let near = NEARBY * own.circle.radius.min(other.circle.radius);
                let joins =
                    own.end_near(place, near).is_some_and(|end| other.end_near(place, near) == Some(end));
                let meets =
                    own.is_followed(own.circle.angle(place)) && other.is_followed(other.circle.angle(place));
                if joins || !meets {
                    continue;
                }
                if touch {
                    return None;
                }
                let shared = other.meet(other.circle.angle(place).rem_euclid(TAU));
                let angle = own.circle.angle(shared).rem_euclid(TAU);
                if !own.points.iter().any(|(known, _)| apart(angle, *known) < SAME) {
                    own.points.push((angle, shared));
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

/// The part of a segment in a rectangle (Liang and Barsky), with ends exactly on the sides where it leaves it. `None` if there is
/// none.
fn clipped([a, b]: Segment, [low, high]: [[f64; 2]; 2]) -> Option<Segment> {
    let mut ends = [(0.0, None), (1.0, None)];
    for k in 0..2 {
        let along = b[k] - a[k];
        for (limit, outward) in [(low[k], -1.0), (high[k], 1.0)] {
            let beyond = outward * (a[k] - limit);
            if along == 0.0 {
                if beyond > 0.0 {
                    return None;
                }
                continue;
            }
            let t = (limit - a[k]) / along;
            if outward * along < 0.0 && t > ends[0].0 {
                ends[0] = (t, Some((k, limit)));
            } else if outward * along > 0.0 && t < ends[1].0 {
                ends[1] = (t, Some((k, limit)));
            }
        }
    }
    if ends[0].0 >= ends[1].0 {
        return None;
    }
    let place = |(t, on): (f64, Option<(usize, f64)>), end: [f64; 2]| match on {
        None => end,
        Some((k, limit)) => {
            let mut p = [0, 1].map(|k| (a[k] + t * (b[k] - a[k])).clamp(low[k], high[k]));
            p[k] = limit;
            p
        }
    };
    Some([place(ends[0], a), place(ends[1], b)])
}

//! Sides of outlines and circles, divided where they cross.

use super::coarse::Outline;
use std::f64::consts::TAU;

/// A circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its middle.
    pub center: [f64; 2],
    /// Its radius, positive.
    pub radius: f64,
}

impl Circle {
    fn at(&self, angle: f64) -> [f64; 2] {
        // Exactly on the axes where it crosses them.
        let (sine, cosine) = angle.sin_cos();
        let clean = |x: f64| if x.abs() < 1e-15 { 0.0 } else { x };
        [self.center[0] + self.radius * clean(cosine), self.center[1] + self.radius * clean(sine)]
    }

    pub(super) fn angle(&self, p: [f64; 2]) -> f64 {
        (p[1] - self.center[1]).atan2(p[0] - self.center[0])
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

/// A circle and the points on it between which it is divided, by their angles from 0 to a whole turn, ascending.
#[derive(Debug)]
pub(super) struct DividedCircle {
    pub circle: Circle,
    pub points: Vec<(f64, [f64; 2])>,
    /// The sum of the angles of the arcs in the frame.
    pub within: f64,
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
}

/// Where two circles cross; `None` if they touch, or nearly so.
fn crossings_of(one: &Circle, other: &Circle) -> Option<Vec<[f64; 2]>> {
    let along = [0, 1].map(|k| other.center[k] - one.center[k]);
    let distance = along[0].hypot(along[1]);
    let (sum, difference) = (one.radius + other.radius, (one.radius - other.radius).abs());
    if distance > sum * (1.0 + TOUCH) || distance < difference - sum * TOUCH || distance == 0.0 {
        return Some(Vec::new());
    }
    if distance > sum * (1.0 - TOUCH) || distance < difference + sum * TOUCH {
        return None;
    }
    let to_chord = 0.5 * (distance + (one.radius - other.radius) * sum / distance);
    let half = ((one.radius - to_chord) * (one.radius + to_chord)).sqrt();
    let [x, y] = along.map(|x| x / distance);
    let place = |side: f64| {
        [one.center[0] + to_chord * x - side * half * y, one.center[1] + to_chord * y + side * half * x]
    };
    Some(vec![place(1.0), place(-1.0)])
}

/// The circles, and all sides of outlines and chords of circles in the frame, divided where they cross. `None` where circles touch, or
/// cross the frame between their points.
pub(super) fn divided(
    outlines: &[Outline],
    whole: &[[f64; 2]],
    frame: [[f64; 2]; 2],
    arcs: usize,
) -> Option<(Vec<DividedCircle>, Vec<Segment>)> {
    let mut circles: Vec<DividedCircle> = Vec::new();
    let mut sides: Vec<Segment> = Vec::new();
    let polygons = outlines.iter().filter_map(|outline| match outline {
        Outline::Polygon(corners) => Some(&corners[..]),
        Outline::Circle(_) => None,
    });
    for outline in std::iter::once(whole).chain(polygons) {
        for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            // From the same end whichever outline it is a side of: rounding would tell the points of neighbours apart.
            let (a, b) = if a <= b { (a, b) } else { (b, a) };
            sides.extend(clipped([*a, *b], frame));
        }
    }
    for outline in outlines {
        if let Outline::Circle(circle) = outline
            && !circles.iter().any(|known| known.circle == *circle)
        {
            let mut points = Vec::new();
            for other in &mut circles {
                for place in crossings_of(&other.circle, circle)? {
                    let shared = other.meet(other.circle.angle(place).rem_euclid(TAU));
                    points.push((circle.angle(shared).rem_euclid(TAU), shared));
                }
            }
            circles.push(DividedCircle { circle: *circle, points, within: 0.0 });
        }
    }
    let mut cuts: Vec<Vec<(f64, [f64; 2])>> = vec![Vec::new(); sides.len()];
    for divided in &mut circles {
        let circle = divided.circle;
        for (side, cuts) in sides.iter().zip(&mut cuts) {
            let [a, b] = *side;
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            for t in circle.crossings(*side) {
                let nearest = if t * length < SAME * circle.radius {
                    a
                } else if (1.0 - t) * length < SAME * circle.radius {
                    b
                } else {
                    [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
                };
                cuts.push((t, divided.meet(circle.angle(nearest).rem_euclid(TAU))));
            }
        }
        // The usual points, but for those next to a crossing.
        let step = TAU / arcs as f64;
        let usual = (0..arcs).map(|k| k as f64 * step);
        let is_far = |a: &f64| divided.points.iter().all(|(met, _)| apart(*a, *met) > 0.25 * step);
        let usual: Vec<(f64, [f64; 2])> = usual.filter(is_far).map(|a| (a, circle.at(a))).collect();
        divided.points.extend(usual);
        divided.points.sort_by(|a, b| a.0.total_cmp(&b.0));
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
    for DividedCircle { circle, points, within } in &mut circles {
        for (k, (from, place)) in points.iter().enumerate() {
            let (to, next) = points[(k + 1) % points.len()];
            let chord = [*place, next];
            match chord.map(inside) {
                [true, true] => {
                    pieces.push(chord);
                    *within += apart(*from, to);
                }
                [false, false] => {}
                // A crossing with the frame is a point of the circle, up to rounding.
                _ => {
                    let ends = chord.map(|p| [0, 1].map(|k| p[k].clamp(frame[0][k], frame[1][k])));
                    let moved = (0..2).map(|e| (ends[e][0] - chord[e][0]).hypot(ends[e][1] - chord[e][1]));
                    if ends[0] != ends[1] && moved.fold(0.0, f64::max) <= SAME * circle.radius {
                        pieces.push(ends);
                        *within += apart(*from, to);
                    }
                }
            }
        }
    }
    Some((circles, pieces))
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

//! Cubics that outlines follow, divided where straight sides cross them and until they are nearly straight.

use super::circles::{DividedCircle, NEARBY, SAME, Segment};
use super::outline::{Course, Outline};
use crate::cubic::{Cubic, distance};
use std::collections::HashMap;

/// The largest bow of the parts of a cubic ([`Cubic::bow`]) where a whole circle is divided into
/// [`USUAL_ARCS`] arcs: these arcs bow as much. For more arcs it is smaller in proportion. Tuned:
/// `benches/outlines.py punched-pair`.
const BOW: f64 = 0.07;
/// The number of arcs of a whole circle to which [`BOW`] belongs.
const USUAL_ARCS: f64 = 16.0;

/// Parts of a cubic whose bow is less than this are straight. Not tuned: it only has to lie above rounding
/// errors and below distances that matter.
const STRAIGHT: f64 = 1e-12;

/// How often a cubic is divided in halves at most. Not tuned: a limit that ordinary cases do not reach.
const MAX_HALVINGS: usize = 12;

/// A cubic and the points between its ends where straight sides cross it, by their parameters.
#[derive(Debug)]
pub(super) struct DividedCubic {
    /// The whole cubic.
    cubic: Cubic,
    /// The parameter and the position of each point.
    points: Vec<(f64, [f64; 2])>,
}

/// The cubics that outlines follow, each once.
pub(super) fn followed(outlines: &[Outline]) -> Vec<DividedCubic> {
    let mut out: Vec<DividedCubic> = Vec::new();
    for (side, _) in outlines.iter().flat_map(Outline::sides) {
        let Some(Course::Cubic(cubic)) = side.curve else { continue };
        let near = 1e-2 * SAME * distance(cubic.control[0], cubic.control[3]);
        let is_same =
            |other: &Cubic| cubic.control.iter().zip(&other.control).all(|(p, q)| distance(*p, *q) <= near);
        if !out.iter().any(|known| is_same(&known.cubic) || is_same(&known.cubic.reversed())) {
            out.push(DividedCubic { cubic, points: Vec::new() });
        }
    }
    out
}

impl DividedCubic {
    /// The points at which a straight side crosses the cubic, each with its share of the way along the side.
    /// A point that is very near to an end of the cubic or of the side is that end.
    pub(super) fn cross(&mut self, side: Segment) -> Vec<(f64, [f64; 2])> {
        let [a, b] = side;
        let [low, high] = self.cubic.bounds();
        let length = distance(a, b);
        let [from, .., to] = self.cubic.control;
        let size = distance(from, to);
        let near = SAME * size;
        let is_beside = |k: usize| a[k].max(b[k]) < low[k] - near || a[k].min(b[k]) > high[k] + near;
        if length == 0.0 || is_beside(0) || is_beside(1) {
            return Vec::new();
        }
        let mut cuts = Vec::new();
        for t in self.cubic.crossings(side) {
            let mut place = self.cubic.at(t);
            // On a side along an axis, the point lies exactly on it.
            (0..2).filter(|&k| a[k] == b[k]).for_each(|k| place[k] = a[k]);
            let share = (0..2).map(|k| (place[k] - a[k]) * (b[k] - a[k])).sum::<f64>() / (length * length);
            if share * length < -near || (share - 1.0) * length > near {
                continue;
            }
            // Where a curve continues as a straight side without a corner, rounding finds a crossing anywhere
            // nearby.
            let joins = |end: [f64; 2]| (end == a || end == b) && distance(place, end) < NEARBY * size;
            if joins(from) || joins(to) {
                continue;
            }
            if let Some(end) = [from, to].into_iter().find(|end| distance(place, *end) < near) {
                cuts.push((share, end));
                continue;
            }
            let known = self.points.iter().find(|(_, known)| distance(*known, place) < near).map(|(_, p)| *p);
            let end = [a, b].into_iter().find(|end| distance(place, *end) < near);
            let place = known.or(end).unwrap_or(place);
            if known.is_none() {
                self.points.push((t, place));
            }
            cuts.push((share, place));
        }
        cuts
    }

    /// The parts of the cubic in the frame, whose bow is at most `max_bow`. `None` if one crosses the frame
    /// between its ends.
    fn parts(&self, frame: [[f64; 2]; 2], max_bow: f64) -> Option<Vec<Cubic>> {
        let [from, .., to] = self.cubic.control;
        let mut points = vec![(0.0, from)];
        points.extend(&self.points);
        points.push((1.0, to));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let inside = |p: [f64; 2]| (0..2).all(|k| frame[0][k] <= p[k] && p[k] <= frame[1][k]);
        let mut out = Vec::new();
        for pair in points.windows(2) {
            let [(t, p), (u, q)] = [pair[0], pair[1]];
            let mut part = self.cubic.part([t, u]);
            (part.control[0], part.control[3]) = (p, q);
            if inside(part.at(0.5)) {
                if !(inside(p) && inside(q)) {
                    return None;
                }
                divide(part, max_bow, MAX_HALVINGS, &mut out)?;
            }
        }
        Some(out)
    }
}

/// Divides a cubic in halves until the bow of all parts is at most `max_bow`. `None` if that does not come to
/// an end, as at a cusp.
fn divide(cubic: Cubic, max_bow: f64, halvings: usize, out: &mut Vec<Cubic>) -> Option<()> {
    if cubic.bow() <= max_bow {
        out.push(cubic);
        return Some(());
    }
    halves(cubic).into_iter().try_for_each(|half| divide(half, max_bow, halvings.checked_sub(1)?, out))
}

/// The two halves of a cubic, which have their common end to the last bit.
fn halves(cubic: Cubic) -> [Cubic; 2] {
    let [one, mut other] = [cubic.part([0.0, 0.5]), cubic.part([0.5, 1.0])];
    other.control[0] = one.control[3];
    [one, other]
}

/// The parts of all cubics in the frame, so short that a whole circle of such would have the given number of
/// arcs. `None` where they meet one another, or circles, other than in common ends.
pub(super) fn parts(
    cubics: &[DividedCubic],
    circles: &[DividedCircle],
    straight: &[Segment],
    frame: [[f64; 2]; 2],
    arcs: usize,
) -> Option<Vec<Cubic>> {
    let max_bow = BOW * USUAL_ARCS / arcs as f64;
    let mut parts = Vec::new();
    for divided in cubics {
        parts.extend(divided.parts(frame, max_bow)?);
    }
    // A curve must not have its chord in common with anything else.
    let key = |[p, q]: Segment| {
        if p <= q { [p, q] } else { [q, p] }.as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let chord = |part: &Cubic| [part.control[0], part.control[3]];
    let mut count: HashMap<Vec<u64>, usize> = HashMap::new();
    for segment in straight.iter().copied().chain(parts.iter().map(chord)) {
        *count.entry(key(segment)).or_default() += 1;
    }
    let is_alone = |part: &Cubic| count[&key(chord(part))] == 1 || part.bow() < STRAIGHT;
    let parts: Vec<Cubic> = parts
        .into_iter()
        .flat_map(|part| if is_alone(&part) { vec![part] } else { halves(part).to_vec() })
        .collect();
    let boxes: Vec<[[f64; 2]; 2]> = parts.iter().map(Cubic::bounds).collect();
    for (k, part) in parts.iter().enumerate() {
        let meets = (0..k).any(|l| overlap(boxes[k], boxes[l]) && cubics_meet(part, &parts[l]));
        if meets || circles.iter().any(|circle| meets_circle(part, circle)) {
            return None;
        }
    }
    Some(parts)
}

/// Whether two rectangles, each by its lower and upper corner, share a point.
fn overlap([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    (0..2).all(|k| a[k] <= d[k] && c[k] <= b[k])
}

/// The diagonal of a rectangle.
fn size([low, high]: [[f64; 2]; 2]) -> f64 {
    distance(low, high)
}

/// Whether all of a rectangle lies within the distance `near` of a point.
fn is_near(rectangle: [[f64; 2]; 2], point: [f64; 2], near: f64) -> bool {
    rectangle.iter().all(|corner| distance(*corner, point) <= near)
}

/// Whether two cubics meet, or nearly so, other than in common ends.
fn cubics_meet(one: &Cubic, other: &Cubic) -> bool {
    let near = NEARBY * size(one.bounds()).min(size(other.bounds()));
    let ends = [other.control[0], other.control[3]];
    let common: Vec<[f64; 2]> =
        [one.control[0], one.control[3]].into_iter().filter(|end| ends.contains(end)).collect();
    let mut pairs = vec![(*one, *other)];
    while let Some((p, q)) = pairs.pop() {
        let [of_p, of_q] = [p.bounds(), q.bounds()];
        let at_end = |end: &[f64; 2]| is_near(of_p, *end, near) && is_near(of_q, *end, near);
        if !overlap(of_p, of_q) || common.iter().any(at_end) {
            continue;
        }
        if size(of_p).max(size(of_q)) < 0.1 * near {
            return true;
        }
        if size(of_p) > size(of_q) {
            pairs.extend(halves(p).map(|half| (half, q)));
        } else {
            pairs.extend(halves(q).map(|half| (p, half)));
        }
    }
    false
}

/// Whether a cubic meets a circle, or nearly so, where outlines follow the circle, other than where both end.
fn meets_circle(cubic: &Cubic, divided: &DividedCircle) -> bool {
    let circle = divided.circle;
    let near = NEARBY * size(cubic.bounds()).min(circle.radius);
    let is_common = |end: [f64; 2]| divided.end_near(end, 0.0).is_some();
    let common: Vec<[f64; 2]> =
        [cubic.control[0], cubic.control[3]].into_iter().filter(|end| is_common(*end)).collect();
    let mut remaining = vec![*cubic];
    while let Some(part) = remaining.pop() {
        let bounds = part.bounds();
        let [low, high] = bounds;
        let least = (0..2).map(|k| circle.center[k] - circle.center[k].clamp(low[k], high[k]));
        let most = (0..2).map(|k| (circle.center[k] - low[k]).abs().max((circle.center[k] - high[k]).abs()));
        let length = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0, f64::hypot);
        let [least, most] = [length(&mut { least }), length(&mut { most })];
        if least > circle.radius
            || most < circle.radius
            || common.iter().any(|end| is_near(bounds, *end, near))
        {
            continue;
        }
        if size(bounds) >= 0.1 * near {
            remaining.extend(halves(part));
        } else if divided.is_followed(circle.angle(part.at(0.5))) {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::super::circle::Circle;
    use super::super::{RoundSide, coarse};
    use super::*;
    use crate::drawing::{Drawn, Entry, drawn};

    const FRAME: [[f64; 2]; 2] = [[-3.0, -2.0], [4.0, 5.0]];

    fn outline(entries: &[Entry]) -> Outline {
        let Drawn { outline, arcs, .. } = drawn(entries).unwrap();
        Outline::with_arcs(&outline, &arcs)
    }

    fn closed(points: &[[f64; 2]]) -> Outline {
        let (to, through) = points.split_first().unwrap();
        outline(&[Entry::Spline { through: through.to_vec(), to: *to }])
    }

    /// Half the integral of x dy - y dx along an outline.
    fn swept(outline: &Outline) -> f64 {
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        let swept_side = |(side, to): (&super::super::Side, [f64; 2])| match side.curve {
            Some(Course::Cubic(cubic)) => swept_by(&cubic),
            _ => 0.5 * cross(side.from, to),
        };
        outline.sides().map(swept_side).sum::<f64>().abs()
    }

    fn swept_by(cubic: &Cubic) -> f64 {
        let [a, b, c, d] = cubic.control;
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        let near = 2.0 * cross(a, b) + cross(b, c) + 2.0 * cross(c, d);
        0.15 * (near + cross(a, c) + cross(b, d) + cross(a, d) / 3.0)
    }

    /// The area of the triangles whose middles are inside an outline, with their curved sides.
    fn area(outline: &Outline, outlines: &[Outline], frame: [[f64; 2]; 2]) -> f64 {
        let coarse = coarse(outlines, frame).unwrap();
        let inner = coarse.mesh.triangles.iter().filter(|t| outline.contains(coarse.middle(t)));
        inner
            .map(|t| {
                let along = |[a, b]: [u32; 2]| {
                    let [p, q] = [a, b].map(|p| coarse.mesh.points[p as usize]);
                    match coarse.arcs.get(&[a.min(b), a.max(b)]) {
                        Some(RoundSide::Cubic(cubic)) => swept_by(cubic) * if a < b { 1.0 } else { -1.0 },
                        _ => 0.5 * (p[0] * q[1] - p[1] * q[0]),
                    }
                };
                let [a, b, c] = *t;
                [[a, b], [b, c], [c, a]].into_iter().map(along).sum::<f64>().abs()
            })
            .sum()
    }

    /// The points of a spline that is symmetric about the second axis.
    const POINTS: [[f64; 2]; 6] =
        [[0.0, -1.0], [1.4, -0.6], [1.0, 1.6], [0.0, 0.9], [-1.0, 1.6], [-1.4, -0.6]];

    #[test]
    fn splines_are_followed_exactly_also_where_straight_sides_and_the_frame_cross_them() {
        let spline = closed(&POINTS);
        let exact = swept(&spline);
        let one = [spline.clone()];
        assert!((area(&spline, &one, FRAME) - exact).abs() < 1e-12);
        // Twice, from another point and the other way round; under an oblique side; cut by a mirror plane,
        // with a point there or not.
        let mut back = POINTS;
        back.reverse();
        let crossing = Outline::polygon(&[[-2.0, -1.5], [3.0, 0.4], [3.0, 1.2], [-2.0, -0.9]]);
        for other in [closed(&back), crossing] {
            assert!((area(&spline, &[spline.clone(), other], FRAME) - exact).abs() < 1e-12);
        }
        let between = closed(&[[0.6, -1.0], [1.0, 1.6], [-1.0, 1.6], [-0.6, -1.0]]);
        for symmetric in [spline, between] {
            let half = area(&symmetric, std::slice::from_ref(&symmetric), [[0.0, -2.0], [4.0, 5.0]]);
            assert!((2.0 * half - swept(&symmetric)).abs() < 1e-12, "{half}");
        }
    }

    #[test]
    fn splines_go_over_into_straight_sides_and_have_lines_between_their_ends_beside_them() {
        // A segment whose chord is the side of another outline, and a shape whose spline leaves along its
        // straight side.
        let bow = outline(&[
            Entry::Corner([1.0, 0.0]),
            Entry::Spline { through: vec![[0.0, 0.08]], to: [-1.0, 0.0] },
        ]);
        let below = Outline::polygon(&[[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0]]);
        let straight = [[2.0, 0.0], [2.2, 0.0], [2.4, 0.0], [2.6, 0.0]];
        let mut through = straight[1..].to_vec();
        through.extend([[3.2, 0.7], [2.6, 1.4]]);
        let smooth = outline(&[
            Entry::Corner([0.5, 1.0]),
            Entry::Corner([1.0, 0.0]),
            Entry::Corner(straight[0]),
            Entry::Spline { through, to: [1.8, 1.2] },
        ]);
        for outlines in [vec![bow.clone(), below], vec![bow], vec![smooth]] {
            assert!((area(&outlines[0], &outlines, FRAME) - swept(&outlines[0])).abs() < 1e-12);
        }
    }

    #[test]
    fn splines_that_cross_or_touch_other_curves_have_no_mesh() {
        let spline = || closed(&POINTS);
        let moved = |by: f64| closed(&POINTS.map(|[x, y]| [x + by, y]));
        let circle = |center: [f64; 2], radius: f64| Outline::Circle(Circle { center, radius });
        assert!(coarse(&[spline(), moved(0.3)], FRAME).is_none());
        assert!(coarse(&[spline(), circle([1.4, -0.6], 0.5)], FRAME).is_none());
        let inside = closed(&POINTS.map(|p| p.map(|x| 0.5 * x)));
        assert!(
            coarse(
                &[spline(), inside, circle([0.0, 0.0], 0.1), circle([0.5, 0.0], 3.0)],
                [[-4.0; 2], [4.0; 2]]
            )
            .is_some()
        );
    }
}

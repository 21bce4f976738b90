//! Sides of outlines, straight, circular or cubic, divided where they cross.

use super::circle::Circle;
use super::circles::{DividedCircle, NEARBY, SAME, Segment, Span, apart, circles_of};
use super::cubics;
use super::outline::{Course, Outline};
use crate::cubic::Cubic;
use std::f64::consts::TAU;

/// The circles, segments and cubics that outlines consist of, divided where they cross.
pub(super) struct Divided {
    /// The circles, each with the points that divide it.
    pub circles: Vec<DividedCircle>,
    /// Straight sides, and chords of circles.
    pub segments: Vec<Segment>,
    /// Parts of cubics, whose chords are not among the segments.
    pub cubics: Vec<Cubic>,
}

/// The circles, and all sides of outlines and chords of circles in the frame, divided where they cross, and
/// the cubics divided where straight sides cross them. `frame_outline` is the `frame` as an outline, and
/// `arcs` the number of arcs of a whole circle that nothing crosses. `None` where circles touch, where a
/// cubic crosses the frame between the points that divide it, and where cubics meet other curves.
pub(super) fn divided(
    outlines: &[Outline],
    frame_outline: &Outline,
    frame: [[f64; 2]; 2],
    arcs: usize,
) -> Option<Divided> {
    let mut sides: Vec<Segment> = Vec::new();
    let mut straight = |a: [f64; 2], b: [f64; 2]| {
        // A side begins at the same end, whichever outline it belongs to. Otherwise rounding would separate
        // the points of neighbouring outlines.
        sides.extend(clipped(if a <= b { [a, b] } else { [b, a] }, frame));
    };
    let mut followed: Vec<(Circle, Span)> = Vec::new();
    for outline in std::iter::once(frame_outline).chain(outlines) {
        if let Outline::Circle(circle) = outline {
            followed.push((*circle, Span::WHOLE));
        }
        for (side, to) in outline.sides() {
            match side.curve {
                None => straight(side.from, to),
                Some(Course::Circle(circle, turn)) => {
                    followed.push((circle, Span::arc(&circle, side.from, to, turn)));
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
                // Where an arc continues as a straight side without a corner, rounding finds a crossing
                // anywhere nearby.
                let is_end_of_side = |end: &[f64; 2]| *end == a || *end == b;
                if divided.end_near(place, NEARBY * circle.radius).is_some_and(|end| is_end_of_side(&end))
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
        divided.add_spaced_points(arcs);
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

/// The part of a segment in a rectangle (Liang and Barsky), with ends exactly on the sides where it leaves
/// it. `None` if there is none.
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

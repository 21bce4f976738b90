//! An outline drawn entry by entry: corners, arcs, splines and rounded corners.

use crate::cubic::{Cubic, distance, spline};
use crate::shapes::{Arc, Curve};
use std::f64::consts::{PI, TAU};

/// The number of sides for a whole circle, and for a curve that turns as much, where polygons replace curves.
/// It is not tuned.
const SIDES: f64 = 128.0;

/// Points closer together than this share of the outline's extent are the same point. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const SAME: f64 = 1e-12;

/// Neighbouring points of a spline closer together than this share of the outline's extent count as one: the
/// spline would not be defined, or be determined by rounding. It is not tuned.
const COINCIDENT: f64 = 1e-9;

/// One entry of an outline.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A corner, joined to the entry before by a straight side.
    Corner([f64; 2]),
    /// An arc of a circle from the end of the entry before.
    Arc {
        /// A point on the arc.
        through: [f64; 2],
        /// Where it ends.
        to: [f64; 2],
    },
    /// A cubic spline from the end of the entry before ([`spline`]). A spline that is the only entry begins
    /// at its end and is closed.
    Spline {
        /// Points on the spline, in order.
        through: Vec<[f64; 2]>,
        /// Where it ends.
        to: [f64; 2],
    },
    /// A corner between two straight sides, rounded.
    Rounded {
        /// The corner in which the sides would meet.
        corner: [f64; 2],
        /// The radius of the rounding, positive.
        radius: f64,
    },
}

/// A fault of an outline, with the number of the entry that has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flaw {
    /// The three points of an arc lie on a line, or two of them are the same.
    Straight(usize),
    /// Two neighbouring points of a spline are the same, or a closed spline has too few points to enclose an
    /// area.
    Coincident(usize),
    /// A rounded corner beside an arc or a spline.
    BesideArc(usize),
    /// A rounding that the sides are too short for.
    TooLarge(usize),
    /// A rounded corner where the outline does not turn, or turns back.
    NoCorner(usize),
}

/// An outline with its curves divided into sides.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drawn {
    /// Corners, those on curves among them.
    pub outline: Vec<[f64; 2]>,
    /// The parts of the outline that replace curves: one for each arc, and one for each cubic of a spline.
    pub arcs: Vec<Arc>,
    /// For each corner of `outline`, the number of the entry that it comes from.
    pub entries: Vec<usize>,
}

/// Draws an outline. Its last entry is joined to the first.
///
/// # Errors
/// [`Flaw`]
pub fn drawn(entries: &[Entry]) -> Result<Drawn, Flaw> {
    let n = entries.len();
    // The point at which an entry ends; for a rounded corner, the corner without the rounding.
    let place = |k: usize| match &entries[k % n] {
        Entry::Corner(place)
        | Entry::Arc { to: place, .. }
        | Entry::Spline { to: place, .. }
        | Entry::Rounded { corner: place, .. } => *place,
    };
    let points = entries.iter().zip(0..).flat_map(|(entry, k)| {
        let through = if let Entry::Spline { through, .. } = entry { &through[..] } else { &[] };
        through.iter().copied().chain([place(k)])
    });
    let extent = (0..2).map(|k| {
        let x = points.clone().map(|p| p[k]);
        x.clone().fold(f64::NEG_INFINITY, f64::max) - x.fold(f64::INFINITY, f64::min)
    });
    let extent = extent.fold(0.0, f64::max);
    let near = SAME * extent;
    let is_curve = |k: usize| matches!(entries[k % n], Entry::Arc { .. } | Entry::Spline { .. });
    let is_rounded = |k: usize| matches!(entries[k % n], Entry::Rounded { .. });
    // The length that a rounded corner removes from both straight sides; 0 for other entries.
    let taken = |k: usize| match entries[k % n] {
        Entry::Rounded { corner, radius } => {
            Angle::new([k + n - 1, k + 1].map(place), corner, near).map_or(0.0, |angle| angle.taken(radius))
        }
        Entry::Corner(_) | Entry::Arc { .. } | Entry::Spline { .. } => 0.0,
    };
    // A curve begins where the entry before it ends, so that the drawing starts with another entry.
    let first = (0..n).find(|k| !is_curve(*k));
    let mut out = Drawn::default();
    if let (None, true) = (first, n > 0) {
        out.push(place(n - 1), n - 1);
    }
    let first = first.unwrap_or(0);
    for k in (first..first + n).map(|k| k % n) {
        if is_curve(k) && is_rounded(k + n - 1) {
            return Err(Flaw::BesideArc((k + n - 1) % n));
        }
        match entries[k] {
            // The rounding before this corner may end in it: then it is drawn already.
            Entry::Corner(corner) if is_rounded(k + n - 1) && out.is_at(corner, near) => {}
            Entry::Corner(corner) => out.push(corner, k),
            Entry::Arc { through, to } => {
                let (center, radius) = circle(place(k + n - 1), through, to).ok_or(Flaw::Straight(k))?;
                let [from, middle, end] =
                    [place(k + n - 1), through, to].map(|p| (p[1] - center[1]).atan2(p[0] - center[0]));
                let (by_middle, whole) = ((middle - from).rem_euclid(TAU), (end - from).rem_euclid(TAU));
                let turn = if by_middle <= whole { whole } else { whole - TAU };
                out.arc(center, radius, (place(k + n - 1), to), turn, k, near);
            }
            Entry::Spline { ref through, to } => {
                let mut points = vec![place(k + n - 1)];
                points.extend(through.iter().chain([&to]));
                let differ = |p: &[[f64; 2]]| distance(p[0], p[1]) > COINCIDENT * extent;
                if n == 1 {
                    points.pop();
                }
                if !points.windows(2).all(differ)
                    || (n == 1 && (points.len() < 3 || !differ(&[points[points.len() - 1], to])))
                {
                    return Err(Flaw::Coincident(k));
                }
                out.spline(&spline(&points, n == 1), k, near);
            }
            Entry::Rounded { corner, radius } => {
                if is_curve(k + 1) {
                    return Err(Flaw::BesideArc(k));
                }
                let neighbours = [k + n - 1, k + 1];
                let angle = Angle::new(neighbours.map(place), corner, near).ok_or(Flaw::NoCorner(k))?;
                let cut = angle.taken(radius);
                if (0..2).any(|side| cut + taken(neighbours[side]) > angle.lengths[side] + near) {
                    return Err(Flaw::TooLarge(k));
                }
                let Angle { sides: [u, v], cosine, sine, .. } = angle;
                let [begin, end] = [u, v].map(|side| [0, 1].map(|a| corner[a] + cut * side[a]));
                // The center lies on the line that halves the angle.
                let sum = [u[0] + v[0], u[1] + v[1]];
                let along = radius.hypot(cut) / sum[0].hypot(sum[1]);
                let center = [0, 1].map(|a| corner[a] + along * sum[a]);
                let turn = (PI - sine.abs().atan2(cosine)) * if sine < 0.0 { 1.0 } else { -1.0 };
                out.arc(center, radius, (begin, end), turn, k, near);
            }
        }
    }
    out.close(near);
    Ok(out)
}

/// The angle between two straight sides that meet.
struct Angle {
    /// Unit vectors from the corner along the side before and the side after.
    sides: [[f64; 2]; 2],
    /// Lengths of these two sides.
    lengths: [f64; 2],
    /// The cosine of the angle.
    cosine: f64,
    /// The sine of the angle, negative where the outline turns to the left.
    sine: f64,
}

impl Angle {
    /// The angle at a corner, from the ends of its two sides; `None` where the sides have no length, or go
    /// straight on or back.
    fn new(ends: [[f64; 2]; 2], corner: [f64; 2], near: f64) -> Option<Self> {
        let sides = ends.map(|end| [end[0] - corner[0], end[1] - corner[1]]);
        let lengths = sides.map(|side| side[0].hypot(side[1]));
        let sides = [0, 1].map(|k| sides[k].map(|x| x / lengths[k]));
        let [u, v] = sides;
        let angle =
            Self { sides, lengths, cosine: u[0] * v[0] + u[1] * v[1], sine: u[0] * v[1] - u[1] * v[0] };
        let turns = (1e-9..1e9).contains(&angle.half_tangent());
        (lengths.iter().all(|length| *length > near) && turns).then_some(angle)
    }

    /// The tangent of half the angle.
    fn half_tangent(&self) -> f64 {
        self.sine.abs() / (1.0 + self.cosine)
    }

    /// The length that a rounding removes from both sides.
    fn taken(&self, radius: f64) -> f64 {
        radius / self.half_tangent()
    }
}

impl Drawn {
    /// Adds a corner that comes from this entry.
    fn push(&mut self, corner: [f64; 2], entry: usize) {
        self.outline.push(corner);
        self.entries.push(entry);
    }

    /// Whether the last corner is at a place.
    fn is_at(&self, place: [f64; 2], near: f64) -> bool {
        self.outline.last().is_some_and(|last| (last[0] - place[0]).hypot(last[1] - place[1]) <= near)
    }

    /// Adds the points of an arc between two places, which turns by `turn`, rad, positive if anticlockwise.
    /// Where the last corner is not where the arc begins, a corner is added there.
    fn arc(
        &mut self,
        center: [f64; 2],
        radius: f64,
        (from, to): ([f64; 2], [f64; 2]),
        turn: f64,
        entry: usize,
        near: f64,
    ) {
        if !self.is_at(from, near) {
            self.push(from, entry);
        }
        let begin = self.outline.len() - 1;
        let sides = (turn.abs() / TAU * SIDES - 1e-9).ceil().max(2.0);
        let angle = (from[1] - center[1]).atan2(from[0] - center[0]);
        for k in 1..sides as usize {
            let (sine, cosine) = (angle + turn * k as f64 / sides).sin_cos();
            self.push([center[0] + radius * cosine, center[1] + radius * sine], entry);
        }
        self.push(to, entry);
        let curve = Curve::Circle { center, radius };
        self.arcs.push(Arc { curve, sides: begin..self.outline.len() - 1 });
    }

    /// Adds the points of a spline, given by its cubics. Where the last corner is not where the spline
    /// begins, a corner is added there.
    fn spline(&mut self, pieces: &[Cubic], entry: usize, near: f64) {
        for piece in pieces {
            if !self.is_at(piece.control[0], near) {
                self.push(piece.control[0], entry);
            }
            let begin = self.outline.len() - 1;
            let sides = (piece.turn() / TAU * SIDES - 1e-9).ceil().max(2.0);
            (1..sides as usize).for_each(|k| self.push(piece.at(k as f64 / sides), entry));
            self.push(piece.control[3], entry);
            self.arcs.push(Arc { curve: Curve::Cubic(*piece), sides: begin..self.outline.len() - 1 });
        }
    }

    /// Drops the last corner of an outline with curves where it is the first one again.
    fn close(&mut self, near: f64) {
        if let (Some(first), Some(last), false) =
            (self.outline.first(), self.outline.last(), self.arcs.is_empty())
            && self.outline.len() > 3
            && (first[0] - last[0]).hypot(first[1] - last[1]) <= near
        {
            self.outline.pop();
            self.entries.pop();
        }
    }
}

/// The circle through three points; `None` if they lie on a line, or nearly so.
fn circle(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<([f64; 2], f64)> {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let (uu, vv) = (u[0] * u[0] + u[1] * u[1], v[0] * v[0] + v[1] * v[1]);
    let double = 2.0 * (u[0] * v[1] - u[1] * v[0]);
    if double.abs() <= 1e-9 * uu.max(vv) {
        return None;
    }
    let from_a = [(v[1] * uu - u[1] * vv) / double, (u[0] * vv - v[0] * uu) / double];
    Some(([a[0] + from_a[0], a[1] + from_a[1]], from_a[0].hypot(from_a[1])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[[f64; 2]]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>()
    }

    /// The exact area, from the corners between curves and the areas between the curves and their chords.
    fn area_with_arcs(drawn: &Drawn) -> f64 {
        let n = drawn.outline.len();
        let beside = |arc: &Arc| match arc.curve {
            Curve::Circle { center, radius } => {
                let turns = arc.sides.clone().map(|k| {
                    let [p, q] = [drawn.outline[k], drawn.outline[(k + 1) % n]]
                        .map(|p| (p[1] - center[1]).atan2(p[0] - center[0]));
                    (q - p + PI).rem_euclid(TAU) - PI
                });
                turns.map(|t| 0.5 * radius * radius * (t - t.sin())).sum::<f64>()
            }
            Curve::Cubic(cubic) => {
                let sides = arc.sides.clone().map(|k| [drawn.outline[k], drawn.outline[(k + 1) % n]]);
                swept(&cubic) - sides.map(|[p, q]| 0.5 * (p[0] * q[1] - p[1] * q[0])).sum::<f64>()
            }
        };
        area(&drawn.outline) + drawn.arcs.iter().map(beside).sum::<f64>()
    }

    /// Half the integral of x dy - y dx along a cubic.
    fn swept(cubic: &Cubic) -> f64 {
        let [a, b, c, d] = cubic.control;
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        let near = 2.0 * cross(a, b) + cross(b, c) + 2.0 * cross(c, d);
        0.15 * (near + cross(a, c) + cross(b, d) + cross(a, d) / 3.0)
    }

    #[test]
    fn a_square_with_rounded_corners_lacks_what_lies_outside_of_the_circles() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        for reversed in [false, true] {
            let mut entries: Vec<Entry> =
                corners.iter().map(|corner| Entry::Rounded { corner: *corner, radius: 0.5 }).collect();
            if reversed {
                entries.reverse();
            }
            let found = drawn(&entries).unwrap();
            assert_eq!(found.arcs.len(), 4);
            let expected = 12.0 - (4.0 - PI) * 0.25;
            assert!((area_with_arcs(&found).abs() - expected).abs() < 1e-12, "{}", area_with_arcs(&found));
            assert!((area(&found.outline).abs() - expected).abs() < 1e-3);
        }
    }

    #[test]
    fn roundings_may_use_up_their_sides_but_no_more() {
        let stadium = |radius: f64| {
            let corner = |corner| Entry::Rounded { corner, radius };
            drawn(&[corner([0.0, 0.0]), corner([5.0, 0.0]), corner([5.0, 2.0]), corner([0.0, 2.0])])
        };
        let found = stadium(1.0).unwrap();
        assert!((area_with_arcs(&found) - (6.0 + PI)).abs() < 1e-12);
        let twice = found.outline.iter().zip(found.outline.iter().cycle().skip(1)).any(|(p, q)| p == q);
        assert!(!twice);
        assert_eq!(stadium(1.01), Err(Flaw::TooLarge(0)));
    }

    #[test]
    fn arcs_turn_either_way_and_may_close_the_outline() {
        let half = |through: [f64; 2]| {
            drawn(&[
                Entry::Corner([1.0, 0.0]),
                Entry::Corner([1.0, 2.0]),
                Entry::Corner([-1.0, 2.0]),
                Entry::Corner([-1.0, 0.0]),
                Entry::Arc { through, to: [1.0, 0.0] },
            ])
            .unwrap()
        };
        assert!((area_with_arcs(&half([0.0, -1.0])) - (4.0 + PI / 2.0)).abs() < 1e-12);
        assert!((area_with_arcs(&half([0.0, 1.0])) - (4.0 - PI / 2.0)).abs() < 1e-12);
        let first_an_arc = drawn(&[
            Entry::Arc { through: [0.0, -1.0], to: [1.0, 0.0] },
            Entry::Corner([0.0, 3.0]),
            Entry::Corner([-1.0, 0.0]),
        ])
        .unwrap();
        assert!((area_with_arcs(&first_an_arc) - (3.0 + PI / 2.0)).abs() < 1e-12);
        let round = drawn(&[
            Entry::Arc { through: [0.0, -2.0], to: [2.0, 0.0] },
            Entry::Arc { through: [0.0, 2.0], to: [-2.0, 0.0] },
        ])
        .unwrap();
        assert!((area_with_arcs(&round) - 4.0 * PI).abs() < 1e-12);
        assert_eq!(round.outline.len(), 128);
    }

    #[test]
    fn splines_are_followed_by_their_cubics_and_may_close_the_outline() {
        // Closed, it is the same whichever of its points comes first.
        let place = |k: u32| {
            let angle = 0.25 * PI * f64::from(k);
            [3.0 * angle.cos(), 2.0 * angle.sin()]
        };
        let through: Vec<[f64; 2]> = (1..8).map(place).collect();
        let closed = drawn(&[Entry::Spline { through, to: place(0) }]).unwrap();
        assert_eq!(closed.arcs.len(), 8);
        assert!((area_with_arcs(&closed) / (6.0 * PI) - 1.0).abs() < 2e-3, "{}", area_with_arcs(&closed));
        assert!((area(&closed.outline) / area_with_arcs(&closed) - 1.0).abs() < 1e-3);
        let other = drawn(&[Entry::Spline { through: (4..11).map(place).collect(), to: place(3) }]).unwrap();
        assert!((area_with_arcs(&other) - area_with_arcs(&closed)).abs() < 1e-12);
        let beside = drawn(&[
            Entry::Spline { through: vec![[3.0, 1.0], [2.0, 2.0]], to: [0.0, 2.0] },
            Entry::Corner([0.0, 0.0]),
            Entry::Corner([2.0, 0.0]),
        ])
        .unwrap();
        assert_eq!(beside.arcs.len(), 3);
        assert_eq!(beside.entries.iter().filter(|entry| **entry == 1).count(), 1);
        let last = beside.arcs.iter().max_by_key(|arc| arc.sides.end).unwrap();
        assert_eq!(last.sides.end, beside.outline.len() - 1, "it ends in the last corner");
    }

    #[test]
    fn what_is_no_arc_or_corner_is_told_by_its_entry() {
        let spline = |through: &[[f64; 2]]| Entry::Spline { through: through.to_vec(), to: [1.0, 0.0] };
        let twice = [Entry::Corner([0.0, 0.0]), spline(&[[0.5, 0.2], [0.5, 0.2]])];
        assert_eq!(drawn(&twice), Err(Flaw::Coincident(1)));
        assert_eq!(drawn(&[spline(&[[0.5, 0.2]])]), Err(Flaw::Coincident(0)));
        assert_eq!(drawn(&[spline(&[[0.5, 0.2], [0.0, 1.0], [1.0, 0.0]])]), Err(Flaw::Coincident(0)));
        let rounded = Entry::Rounded { corner: [0.0, 0.0], radius: 0.1 };
        let beside = [rounded, spline(&[[0.5, 0.2]]), Entry::Corner([0.0, 5.0])];
        assert_eq!(drawn(&beside), Err(Flaw::BesideArc(0)));
        let line = [Entry::Corner([0.0, 0.0]), Entry::Arc { through: [1.0, 0.0], to: [2.0, 0.0] }];
        assert_eq!(drawn(&line), Err(Flaw::Straight(1)));
        let beside = [
            Entry::Rounded { corner: [0.0, 0.0], radius: 0.1 },
            Entry::Arc { through: [1.0, 1.0], to: [2.0, 0.0] },
            Entry::Corner([1.0, 5.0]),
        ];
        assert_eq!(drawn(&beside), Err(Flaw::BesideArc(0)));
        let straight = [
            Entry::Corner([0.0, 0.0]),
            Entry::Rounded { corner: [1.0, 0.0], radius: 0.1 },
            Entry::Corner([2.0, 0.0]),
            Entry::Corner([1.0, 2.0]),
        ];
        assert_eq!(drawn(&straight), Err(Flaw::NoCorner(1)));
    }
}

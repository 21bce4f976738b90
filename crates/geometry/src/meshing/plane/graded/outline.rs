//! Closed outlines of straight sides and curves.

use super::circle::Circle;
use crate::cubic::Cubic;
use crate::outline::passes;
use crate::shapes::{Arc, Curve};

/// A side of an outline, from a corner to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The corner in which it begins.
    pub from: [f64; 2],
    /// The curve that the side follows; `None` for a straight side.
    pub curve: Option<Course>,
}

/// The curve that a side which is not straight follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// A circle, turning by an angle, positive anticlockwise.
    Circle(Circle, f64),
    /// A cubic that begins and ends where the side does.
    Cubic(Cubic),
}

/// A closed outline.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// A circle.
    Circle(Circle),
    /// Sides, one after the other.
    Path(Vec<Side>),
}

impl Outline {
    /// A polygon by its corners.
    pub fn polygon(corners: &[[f64; 2]]) -> Self {
        Self::Path(corners.iter().map(|corner| Side { from: *corner, curve: None }).collect())
    }

    /// A polygon with each run of sides that stands for a curve replaced by that curve.
    pub fn with_arcs(corners: &[[f64; 2]], arcs: &[Arc]) -> Self {
        let mut sides = Vec::new();
        let mut k = 0;
        while k < corners.len() {
            let begun = arcs.iter().find(|arc| arc.sides.start == k && !arc.sides.is_empty());
            let curve = begun.map(|arc| match arc.curve {
                Curve::Circle { center, radius } => {
                    let circle = Circle { center, radius };
                    let turn = |side: usize| circle.turn(corners[side], corners[(side + 1) % corners.len()]);
                    Course::Circle(circle, arc.sides.clone().map(turn).sum())
                }
                // The ends are taken from the corners, so that they agree to the last bit.
                Curve::Cubic(Cubic { control: [_, first, second, _] }) => {
                    let ends = [arc.sides.start, arc.sides.end % corners.len()].map(|k| corners[k]);
                    Course::Cubic(Cubic { control: [ends[0], first, second, ends[1]] })
                }
            });
            sides.push(Side { from: corners[k], curve });
            k = begun.map_or(k + 1, |arc| arc.sides.end);
        }
        Self::Path(sides)
    }

    /// This outline in other coordinates: `place` moves points, and lengths are multiplied by `scale`.
    #[must_use]
    pub fn moved(&self, place: impl Fn([f64; 2]) -> [f64; 2], scale: f64) -> Self {
        let circle = |c: &Circle| Circle { center: place(c.center), radius: scale * c.radius };
        match self {
            Self::Circle(of) => Self::Circle(circle(of)),
            Self::Path(sides) => {
                let course = |course: Course| match course {
                    Course::Circle(of, turn) => Course::Circle(circle(&of), turn),
                    Course::Cubic(Cubic { control }) => Course::Cubic(Cubic { control: control.map(&place) }),
                };
                let moved = |side: &Side| Side { from: place(side.from), curve: side.curve.map(course) };
                Self::Path(sides.iter().map(moved).collect())
            }
        }
    }

    /// The points that give the outline its place: corners, centres of circles, and control points of cubics.
    pub fn places_mut(&mut self) -> Vec<&mut [f64; 2]> {
        match self {
            Self::Circle(circle) => vec![&mut circle.center],
            Self::Path(sides) => {
                let mut places = Vec::new();
                for Side { from, curve } in sides {
                    places.push(from);
                    match curve {
                        Some(Course::Circle(circle, _)) => places.push(&mut circle.center),
                        Some(Course::Cubic(cubic)) => places.extend(cubic.control.iter_mut()),
                        None => {}
                    }
                }
                places
            }
        }
    }

    /// The sides, each with the corner in which it ends; none for a circle.
    pub fn sides(&self) -> impl Iterator<Item = (&Side, [f64; 2])> {
        let sides = match self {
            Self::Circle(_) => &[][..],
            Self::Path(sides) => sides,
        };
        sides.iter().zip(sides.iter().cycle().skip(1).map(|next| next.from))
    }

    /// Whether a point is inside; on the outline, either answer is possible.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        match self {
            Self::Circle(circle) => circle.contains(point),
            Self::Path(_) => {
                let passed = self.sides().map(|(side, to)| {
                    let passes_chord = passes(side.from, to, point);
                    let (circle, turn) = match side.curve {
                        None => return usize::from(passes_chord),
                        Some(Course::Cubic(cubic)) => return cubic.passes(point),
                        Some(Course::Circle(circle, turn)) => (circle, turn),
                    };
                    // An arc that turns to the left lies to the right of its chord, and the other way round.
                    // The side of the chord on which the point lies follows from whether the ray to the right
                    // passes the chord: computed anew, rounding could contradict that near the chord.
                    let up = [side.from, to].map(|end| end[1] > point[1]);
                    let is_left = match up {
                        [false, true] => passes_chord,
                        [true, false] => !passes_chord,
                        _ => {
                            let along = [to[0] - side.from[0], to[1] - side.from[1]];
                            along[0] * (point[1] - side.from[1]) > along[1] * (point[0] - side.from[0])
                        }
                    };
                    usize::from(passes_chord != (circle.contains(point) && is_left != (turn > 0.0)))
                });
                passed.sum::<usize>() % 2 == 1
            }
        }
    }

    /// Points whose bounding box contains the outline, but for a hundredth of the extent of a curve at most.
    pub fn extremes(&self) -> Vec<[f64; 2]> {
        const POINTS: usize = 32;
        match self {
            Self::Circle(Circle { center, radius }) => {
                vec![center.map(|x| x - radius), center.map(|x| x + radius)]
            }
            Self::Path(sides) => {
                let points = |side: &Side| {
                    let (from, curve) = (side.from, side.curve);
                    let on_curve = move |k: usize| {
                        let share = k as f64 / POINTS as f64;
                        Some(match curve? {
                            Course::Circle(circle, turn) => circle.at(circle.angle(from) + turn * share),
                            Course::Cubic(cubic) => cubic.at(share),
                        })
                    };
                    std::iter::once(from).chain((1..POINTS).filter_map(on_curve))
                };
                sides.iter().flat_map(points).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cubic::distance;
    use crate::drawing::{Drawn, Entry, drawn};

    #[test]
    fn an_outline_with_curves_holds_what_its_polygon_does_but_for_what_lies_at_the_curves() {
        let Drawn { outline, arcs, .. } = drawn(&[
            Entry::Arc { through: [2.5, 0.3], to: [2.0, 2.0] },
            Entry::Rounded { corner: [-1.0, 2.0], radius: 0.7 },
            Entry::Corner([-1.0, 0.0]),
            Entry::Arc { through: [0.0, 0.6], to: [1.0, 0.0] },
            Entry::Spline { through: vec![[1.5, -0.4], [2.2, 0.1]], to: [2.3, -0.2] },
        ])
        .unwrap();
        let (round, polygon) = (Outline::with_arcs(&outline, &arcs), Outline::polygon(&outline));
        assert_eq!(round.sides().filter(|(side, _)| side.curve.is_some()).count(), 6);
        assert_eq!(round.sides().count(), 8);
        let mut differ = 0;
        for k in 0..200 {
            for l in 0..200 {
                let point = [-2.0 + 0.0271 * f64::from(k), -1.0 + 0.0173 * f64::from(l)];
                if round.contains(point) != polygon.contains(point) {
                    differ += 1;
                    let depth = |arc: &Arc| match arc.curve {
                        Curve::Circle { center, radius } => (distance(point, center) / radius - 1.0).abs(),
                        Curve::Cubic(cubic) => {
                            let places = (0..=1000).map(|k| cubic.at(f64::from(k) / 1e3));
                            places.map(|p| distance(p, point)).fold(f64::INFINITY, f64::min)
                        }
                    };
                    assert!(arcs.iter().any(|arc| depth(arc) < 4e-4), "{point:?}");
                }
            }
        }
        assert!(differ < 40, "{differ}");
        assert!(round.contains([2.3, 1.0]) && !round.contains([0.0, 0.3]) && !round.contains([-0.95, 1.95]));
    }
}

//! Closed outlines of straight sides and arcs.

use super::circles::Circle;
use crate::outline::passes;
use crate::shapes::Arc;

/// A side of an outline, from a corner to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The corner in which it begins.
    pub from: [f64; 2],
    /// The circle of which it is an arc, and the angle by which that turns, positive anticlockwise; `None` for a straight side.
    pub arc: Option<(Circle, f64)>,
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
        Self::Path(corners.iter().map(|corner| Side { from: *corner, arc: None }).collect())
    }

    /// A polygon of which some sides stand for arcs.
    pub fn with_arcs(corners: &[[f64; 2]], arcs: &[Arc]) -> Self {
        let mut sides = Vec::new();
        let mut k = 0;
        while k < corners.len() {
            let own = arcs.iter().find(|arc| arc.sides.start == k && !arc.sides.is_empty());
            let arc = own.map(|arc| {
                let circle = Circle { center: arc.center, radius: arc.radius };
                let turn = |side: usize| circle.turn(corners[side], corners[(side + 1) % corners.len()]);
                (circle, arc.sides.clone().map(turn).sum())
            });
            sides.push(Side { from: corners[k], arc });
            k = own.map_or(k + 1, |arc| arc.sides.end);
        }
        Self::Path(sides)
    }

    /// The same in other coordinates: `place` moves points, and lengths are multiplied by `scale`.
    #[must_use]
    pub fn moved(&self, place: impl Fn([f64; 2]) -> [f64; 2], scale: f64) -> Self {
        let circle = |c: &Circle| Circle { center: place(c.center), radius: scale * c.radius };
        match self {
            Self::Circle(of) => Self::Circle(circle(of)),
            Self::Path(sides) => {
                let arc = |side: &Side| side.arc.map(|(of, turn)| (circle(&of), turn));
                Self::Path(sides.iter().map(|s| Side { from: place(s.from), arc: arc(s) }).collect())
            }
        }
    }

    /// Its corners and the middles of its circles.
    pub fn places_mut(&mut self) -> Vec<&mut [f64; 2]> {
        match self {
            Self::Circle(circle) => vec![&mut circle.center],
            Self::Path(sides) => {
                let mut places = Vec::new();
                for Side { from, arc } in sides {
                    places.push(from);
                    places.extend(arc.as_mut().map(|(circle, _)| &mut circle.center));
                }
                places
            }
        }
    }

    /// Its sides, each with the corner in which it ends; none of a circle.
    pub fn sides(&self) -> impl Iterator<Item = (&Side, [f64; 2])> {
        let sides = match self {
            Self::Circle(_) => &[][..],
            Self::Path(sides) => sides,
        };
        sides.iter().zip(sides.iter().cycle().skip(1).map(|next| next.from))
    }

    /// Whether it holds a point; on the outline either answer may come.
    pub fn contains(&self, point: [f64; 2]) -> bool {
        match self {
            Self::Circle(circle) => circle.contains(point),
            Self::Path(_) => {
                let passed = self.sides().filter(|(side, to)| {
                    let passes_chord = passes(side.from, *to, point);
                    let Some((circle, turn)) = side.arc else { return passes_chord };
                    // An arc that turns to the left lies to the right of its chord, and the other way round. Points near the chord must
                    // lie on the side that the ray says.
                    let up = [side.from, *to].map(|end| end[1] > point[1]);
                    let is_left = match up {
                        [false, true] => passes_chord,
                        [true, false] => !passes_chord,
                        _ => {
                            let along = [to[0] - side.from[0], to[1] - side.from[1]];
                            along[0] * (point[1] - side.from[1]) > along[1] * (point[0] - side.from[0])
                        }
                    };
                    passes_chord != (circle.contains(point) && is_left != (turn > 0.0))
                });
                passed.count() % 2 == 1
            }
        }
    }

    /// Points between which it lies, up to a hundredth of an arc.
    pub fn extremes(&self) -> Vec<[f64; 2]> {
        const POINTS: usize = 32;
        match self {
            Self::Circle(Circle { center, radius }) => {
                vec![center.map(|x| x - radius), center.map(|x| x + radius)]
            }
            Self::Path(sides) => {
                let points = |side: &Side| {
                    let (from, arc) = (side.from, side.arc);
                    let on_arc = move |k: usize| {
                        let (circle, turn) = arc?;
                        Some(circle.at(circle.angle(from) + turn * k as f64 / POINTS as f64))
                    };
                    std::iter::once(from).chain((1..POINTS).filter_map(on_arc))
                };
                sides.iter().flat_map(points).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Drawn, Entry, drawn};

    #[test]
    fn an_outline_with_arcs_holds_what_its_polygon_does_but_for_what_lies_at_the_arcs() {
        let Drawn { outline, arcs, .. } = drawn(&[
            Entry::Arc { through: [2.5, 0.3], to: [2.0, 2.0] },
            Entry::Rounded { corner: [-1.0, 2.0], radius: 0.7 },
            Entry::Corner([-1.0, 0.0]),
            Entry::Arc { through: [0.0, 0.6], to: [1.0, 0.0] },
        ])
        .unwrap();
        let (round, polygon) = (Outline::with_arcs(&outline, &arcs), Outline::polygon(&outline));
        assert_eq!(round.sides().filter(|(side, _)| side.arc.is_some()).count(), 3);
        assert_eq!(round.sides().count(), 5);
        let mut differ = 0;
        for k in 0..200 {
            for l in 0..200 {
                let point = [-2.0 + 0.0271 * f64::from(k), -1.0 + 0.0173 * f64::from(l)];
                if round.contains(point) != polygon.contains(point) {
                    differ += 1;
                    let depth = |arc: &Arc| {
                        let away = (point[0] - arc.center[0]).hypot(point[1] - arc.center[1]);
                        (away / arc.radius - 1.0).abs()
                    };
                    assert!(arcs.iter().any(|arc| depth(arc) < 4e-4), "{point:?}");
                }
            }
        }
        assert!(differ < 40, "{differ}");
        assert!(round.contains([2.3, 1.0]) && !round.contains([0.0, 0.3]) && !round.contains([-0.95, 1.95]));
    }
}

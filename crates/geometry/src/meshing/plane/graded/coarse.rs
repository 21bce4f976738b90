//! The coarse triangulation that follows outlines.

use super::circle::Circle;
use super::circles::{DividedCircle, SAME, TOUCH, apart};
use super::divided::{Divided, divided};
use super::key;
use super::outline::Outline;
use crate::cubic::{Cubic, distance};
use elastocap_fem::bent::{Bent, Curve, LEAST_EVENNESS, WHOLE};
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Triangles of the coarse triangulation with an angle below this, in degrees, are refined; angles of the
/// outlines stay. With 20 degrees the error of one scene was at times five times that of another which
/// differed by a few per cent; with 30 meshes are larger by a quarter and the errors are the same. Tuned:
/// `benches/outlines.py`, and `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const MIN_ANGLE: f64 = 26.0;

/// The angle, in degrees, below which triangles are refined where the outlines have more than [`MANY_SIDES`]
/// sides: these divide the plane finely enough, and 26 degrees would take half as many triangles again for
/// the same error. Tuned: `benches/outlines.py`, and
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const MIN_ANGLE_OF_MANY: f64 = 20.0;
/// The largest number of sides of outlines that calls for [`MIN_ANGLE`]. Tuned with [`MIN_ANGLE_OF_MANY`].
const MANY_SIDES: usize = 25;

/// Triangles smaller than the square of this share of the frame are not refined. Not tuned: a limit that
/// ordinary cases do not reach.
const LEAST_AREA: f64 = 1e-7;

/// Limit on the number of points that refinement adds. Not tuned: a limit that ordinary cases do not reach.
const MAX_POINTS: usize = 100_000;

/// The least evenness of triangles at curves. It is larger than that which exact integrals need
/// ([`LEAST_EVENNESS`]), since other code works on parts of these triangles. It is not tuned.
const EVENNESS: f64 = 1.5 * LEAST_EVENNESS;

/// Numbers of arcs into which a whole circle is divided if nothing crosses it; other curves are divided as
/// finely. They are tried in this order until no triangle at a chord turns over, or is stretched too
/// unevenly, when the chord becomes an arc. Tuned: `benches/outlines.py discs`.
const ARCS: [usize; 4] = [16, 32, 64, 128];

/// A mesh of the plane: points, and triangles by the numbers of their corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Triangles {
    /// Positions, in the unit of the outlines.
    pub points: Vec<[f64; 2]>,
    /// Corners of each triangle, either way round.
    pub triangles: Vec<[u32; 3]>,
}

/// A triangulation that follows outlines.
#[derive(Debug, Clone, Default)]
pub struct Coarse {
    /// Its points and triangles, with straight sides.
    pub mesh: Triangles,
    /// Sides of triangles that stand for curves, by the numbers of their ends in ascending order.
    pub arcs: HashMap<[u32; 2], RoundSide>,
}

/// The curve that a side of a triangle stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RoundSide {
    /// The shorter arc of a circle.
    Circle(Circle),
    /// A cubic from the end with the lower number to the other one.
    Cubic(Cubic),
}

impl RoundSide {
    /// The curve for the map of a triangle.
    fn curve(&self) -> Curve {
        match self {
            Self::Circle(circle) => Curve::Arc { center: circle.center },
            Self::Cubic(Cubic { control: [_, first, second, _] }) => {
                Curve::Cubic { control: [*first, *second] }
            }
        }
    }

    /// The unit vectors along the curve at both of its ends, each towards the other end. The end with the
    /// lower number comes first, as in `[p, q]`.
    pub fn directions(&self, [p, q]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
        match self {
            Self::Circle(circle) => {
                let along = [q[0] - p[0], q[1] - p[1]];
                [circle.tangent(p, along), circle.tangent(q, along.map(|x| -x))]
            }
            Self::Cubic(cubic) => [cubic.begins(), cubic.reversed().begins()],
        }
    }

    /// A point near the middle of the curve from `p` to `q`, and the two parts of the curve. Each part leads
    /// from its end to that point; that at the end with the lower number, `p`, comes first.
    pub(super) fn halved(&self, [p, q]: [[f64; 2]; 2]) -> ([f64; 2], [Self; 2]) {
        match self {
            Self::Circle(circle) => (circle.between(p, q), [*self; 2]),
            Self::Cubic(cubic) => {
                (cubic.at(0.5), [[0.0, 0.5], [1.0, 0.5]].map(|ends| Self::Cubic(cubic.part(ends))))
            }
        }
    }
}

/// Triangulates the rectangle between the lower and the upper corner `frame` with as few triangles as a least
/// angle of 26 degrees allows (20 where there are many sides), so that every outline inside consists of sides
/// of triangles. `None` if that takes too many, if a number is not finite, if curves touch, if circles cross
/// the frame off their axes, or if cubics cross other curves.
pub fn coarse(outlines: &[Outline], frame: [[f64; 2]; 2]) -> Option<Coarse> {
    ARCS.into_iter().find_map(|arcs| coarse_with(outlines, frame, arcs))
}

/// As [`coarse()`], with a whole circle divided into this number of arcs.
fn coarse_with(outlines: &[Outline], frame: [[f64; 2]; 2], arcs: usize) -> Option<Coarse> {
    let [low, high] = frame;
    let whole = Outline::polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]]);
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let Divided { circles, segments, cubics } = divided(outlines, &whole, frame, arcs)?;
    let sides = segments.len() + cubics.len();
    let chords = cubics.iter().map(|cubic| [cubic.control[0], cubic.control[3]]);
    let mut ends = Vec::with_capacity(sides);
    for [a, b] in segments.iter().copied().chain(chords) {
        let a = cdt.insert(Point2::new(a[0], a[1])).ok()?;
        let b = cdt.insert(Point2::new(b[0], b[1])).ok()?;
        ends.push([a, b].map(|p| p.index() as u32));
        if a != b {
            cdt.add_constraint_and_split(a, b, |p| p);
        }
    }
    let cubics: Vec<([u32; 2], Cubic)> = ends.split_off(segments.len()).into_iter().zip(cubics).collect();
    let scale = (high[0] - low[0]).max(high[1] - low[1]);
    let least_angle = if sides > MANY_SIDES { MIN_ANGLE_OF_MANY } else { MIN_ANGLE };
    let outcome = cdt.refine(
        RefinementParameters::new()
            .with_angle_limit(AngleLimit::from_deg(least_angle))
            .with_min_required_area((LEAST_AREA * scale).powi(2))
            .with_max_additional_vertices(MAX_POINTS),
    );
    if !outcome.refinement_complete {
        return None;
    }
    // Rounding moves points on the sides of the frame off these; they move back.
    let place = |p: Point2<f64>| {
        let near = |x: f64, end: f64| (x - end).abs() <= SAME * scale;
        let on = |x: f64, k: usize| [low[k], high[k]].into_iter().find(|end| near(x, *end)).unwrap_or(x);
        [on(p.x, 0), on(p.y, 1)]
    };
    let points: Vec<[f64; 2]> = cdt.vertices().map(|v| place(v.position())).collect();
    let faces = cdt.inner_faces();
    let triangles = faces.map(|f| f.vertices().map(|v| v.index() as u32)).collect();
    let mut out = Coarse { mesh: Triangles { points, triangles }, arcs: HashMap::new() };
    if !(circles.is_empty() && cubics.is_empty()) {
        let constraints = cdt.undirected_edges().filter(|e| e.is_constraint_edge());
        let sides: Vec<[u32; 2]> = constraints.map(|e| e.vertices().map(|v| v.index() as u32)).collect();
        out.bend(&circles, &cubics, &sides)?;
    }
    out.mesh.ends_on(frame).then_some(out)
}

impl Triangles {
    /// Whether all sides that belong to one triangle alone lie on the frame.
    fn ends_on(&self, frame: [[f64; 2]; 2]) -> bool {
        let mut count: HashMap<[u32; 2], usize> = HashMap::new();
        for [a, b, c] in &self.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                *count.entry(side).or_default() += 1;
            }
        }
        count.iter().filter(|(_, n)| **n == 1).all(|(side, _)| {
            let [p, q] = side.map(|p| self.points[p as usize]);
            (0..2).any(|k| p[k] == q[k] && (p[k] == frame[0][k] || p[k] == frame[1][k]))
        })
    }
}

impl Coarse {
    /// A point well inside a triangle, as it is bent.
    pub fn middle(&self, t: &[u32; 3]) -> [f64; 2] {
        let point = |p: u32| self.mesh.points[p as usize];
        match bent_triangles(t, &self.arcs, point).first() {
            Some(bent) => bent.place([1.0 / 3.0; 2]),
            None => [0, 1].map(|k| t.iter().map(|p| point(*p)[k]).sum::<f64>() / 3.0),
        }
    }

    /// Moves points on chords onto the curves, and notes which sides stand for curves. `None` if a triangle
    /// turns over or is stretched too unevenly, or if chords of different curves cross where the curves do
    /// not.
    fn bend(
        &mut self,
        circles: &[DividedCircle],
        cubics: &[([u32; 2], Cubic)],
        sides: &[[u32; 2]],
    ) -> Option<()> {
        let before: Vec<f64> =
            self.mesh.triangles.iter().map(|t| signed_area(&self.mesh.points, t)).collect();
        self.bend_to_circles(circles, sides)?;
        self.bend_to_cubics(cubics, sides)?;
        let turned = |(t, before): (&[u32; 3], f64)| signed_area(&self.mesh.points, t) * before <= 0.0;
        let is_turned = self.mesh.triangles.iter().zip(before).any(turned);
        (!is_turned && self.mesh.triangles.iter().all(|t| self.is_even(t))).then_some(())
    }

    /// Whether a triangle is stretched evenly enough where its sides become curves. A triangle with several
    /// such sides will be divided from its middle first.
    fn is_even(&self, t: &[u32; 3]) -> bool {
        let bent = bent_triangles(t, &self.arcs, |p| self.mesh.points[p as usize]);
        let several = bent.len() > 1;
        let corners = t.map(|p| self.mesh.points[p as usize]);
        let middle = [0, 1].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 3.0);
        bent.into_iter().all(|mut bent| {
            if several {
                bent.corners[2] = middle;
            }
            bent.stretch(WHOLE).evenness() >= EVENNESS
        })
    }

    /// Moves the points on the chords of cubics onto the cubics, each of which is given with the numbers of
    /// its ends. `None` where something else ends on a chord, or two curves have the same chord.
    fn bend_to_cubics(&mut self, cubics: &[([u32; 2], Cubic)], sides: &[[u32; 2]]) -> Option<()> {
        let mut beside: Vec<Vec<u32>> = vec![Vec::new(); self.mesh.points.len()];
        for [a, b] in sides {
            beside[*a as usize].push(*b);
            beside[*b as usize].push(*a);
        }
        let mut moved = Vec::new();
        for ([first, last], cubic) in cubics {
            let [from, to] = [cubic.control[0], cubic.control[3]];
            let length = distance(from, to);
            let along = [0, 1].map(|k| (to[k] - from[k]) / length);
            let (mut current, mut share) = (*first, 0.0);
            while current != *last {
                // The next point on the chord.
                let next = beside[current as usize].iter().filter_map(|&p| {
                    let off = [0, 1].map(|k| self.mesh.points[p as usize][k] - from[k]);
                    let (far, aside) =
                        (off[0] * along[0] + off[1] * along[1], off[1] * along[0] - off[0] * along[1]);
                    let end_share = if p == *last { 1.0 } else { far / length };
                    let is_next = aside.abs() <= SAME * length && end_share > share && end_share <= 1.0;
                    is_next.then_some((p, end_share))
                });
                let (next, end_share) = next.min_by(|a, b| a.1.total_cmp(&b.1))?;
                let mut part = cubic.part([share, end_share]);
                if next != *last {
                    // Nothing else ends on a chord, or crosses it where it does not cross the curve.
                    if beside[next as usize].len() != 2 {
                        return None;
                    }
                    moved.push((next, part.control[3]));
                }
                if next < current {
                    part = part.reversed();
                }
                if self.arcs.insert(key(current, next), RoundSide::Cubic(part)).is_some() {
                    return None;
                }
                (current, share) = (next, end_share);
            }
        }
        for (p, place) in moved {
            self.mesh.points[p as usize] = place;
        }
        Some(())
    }

    /// Moves the points on chords of circles onto the circles. `None` where two curves have the same chord,
    /// or a part of a circle that outlines follow is not made up of sides.
    fn bend_to_circles(&mut self, circles: &[DividedCircle], sides: &[[u32; 2]]) -> Option<()> {
        let mut circles_at: Vec<Vec<usize>> = vec![Vec::new(); self.mesh.points.len()];
        for (c, divided) in circles.iter().enumerate() {
            let DividedCircle { circle, points, .. } = divided;
            for (p, point) in self.mesh.points.iter_mut().enumerate() {
                let [x, y] = [0, 1].map(|k| point[k] - circle.center[k]);
                let distance = x.hypot(y);
                if distance > circle.radius * (1.0 + SAME) || distance < 0.9 * circle.radius {
                    continue;
                }
                // The point moves if it lies on the chord between the two points of the circle next to it.
                let angle = circle.angle(*point).rem_euclid(TAU);
                let next = points.partition_point(|(a, _)| *a <= angle);
                let [(from, a), (to, b)] =
                    [next + points.len() - 1, next].map(|around| points[around % points.len()]);
                let is_arc = divided.is_followed_between(from, to);
                let cross = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
                let near = |q: [f64; 2]| (q[0] - point[0]).hypot(q[1] - point[1]) <= SAME * circle.radius;
                if near(a) || near(b) {
                    circles_at[p].push(c);
                } else if is_arc && cross.abs() <= SAME * circle.radius * (b[0] - a[0]).hypot(b[1] - a[1]) {
                    *point = [0, 1].map(|k| circle.center[k] + circle.radius * [x, y][k] / distance);
                    circles_at[p].push(c);
                }
            }
        }
        let mut found_turns = vec![0.0; circles.len()];
        for &[a, b] in sides {
            for &c in circles_at[a as usize].iter().filter(|c| circles_at[b as usize].contains(c)) {
                let divided = &circles[c];
                let DividedCircle { circle, points, .. } = divided;
                // A side of another outline may be a longer chord.
                let [p, q] = [a, b].map(|end| self.mesh.points[end as usize]);
                let [from, to] = [p, q].map(|end| circle.angle(end));
                let turn = apart(from, to);
                let mut between = points.iter().filter(|(angle, _)| {
                    [from, to].iter().all(|end| {
                        let distance = apart(*angle, *end);
                        distance > SAME && distance < turn - SAME
                    })
                });
                let is_arc = divided.is_followed(circle.angle(circle.between(p, q)));
                if between.next().is_none() && turn < 1.0 && is_arc {
                    found_turns[c] += turn;
                    if self.arcs.insert(key(a, b), RoundSide::Circle(*circle)).is_some() {
                        return None;
                    }
                }
            }
        }
        let is_whole = |(circle, turn): (&DividedCircle, f64)| (circle.within - turn).abs() < TOUCH;
        circles.iter().zip(found_turns).all(is_whole).then_some(())
    }
}

/// A triangle as it is bent at each of its round sides. Curves begin at the end with the lower number, so
/// that both triangles at a curve see it from the same end.
pub(super) fn bent_triangles(
    triangle: &[u32; 3],
    arcs: &HashMap<[u32; 2], RoundSide>,
    point: impl Fn(u32) -> [f64; 2],
) -> Vec<Bent> {
    let at_side = |k: usize| {
        let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
        let curve = arcs.get(&key(a, b))?.curve();
        Some(Bent { corners: [a.min(b), a.max(b), c].map(&point), curve })
    };
    (0..3).filter_map(at_side).collect()
}

/// The area of a triangle, negative if its corners run clockwise.
fn signed_area(points: &[[f64; 2]], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|p| points[p as usize]);
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

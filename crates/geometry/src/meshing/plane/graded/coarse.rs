//! The coarse triangulation that follows outlines.

use super::circles::{Circle, DividedCircle, SAME, TOUCH, apart, divided};
use super::key;
use super::outline::Outline;
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Triangles of the coarse triangulation with an angle below this, in degrees, are refined; angles of the outlines stay. With 20
/// degrees the error of one scene was at times five times that of another which differed by a few per cent; with 30 meshes are
/// larger by a quarter and the errors are the same.
const MIN_ANGLE: f64 = 26.0;

/// The same where the outlines have more than [`MANY_SIDES`]: these divide the plane finely enough, and 26 degrees would take half as
/// many triangles again for the same error.
const MIN_ANGLE_OF_MANY: f64 = 20.0;
const MANY_SIDES: usize = 25;

/// Triangles smaller than the square of this share of the frame are not refined.
const LEAST_AREA: f64 = 1e-7;

/// Limit on the number of points that refinement adds.
const MOST_POINTS: usize = 100_000;

/// Arcs that a whole circle is divided into, if nothing crosses it: the first number with which no triangle at a chord turns over when
/// that becomes an arc.
const ARCS: [usize; 4] = [16, 32, 64, 128];

/// A mesh of the plane: points, and triangles by the numbers of their corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Triangles {
    /// In the unit of the outlines.
    pub points: Vec<[f64; 2]>,
    /// Corners of each triangle, either way round.
    pub triangles: Vec<[u32; 3]>,
}

/// A triangulation that follows outlines.
#[derive(Debug, Clone, Default)]
pub struct Coarse {
    /// Its points and triangles, with straight sides.
    pub mesh: Triangles,
    /// Sides of triangles that stand for arcs, by the numbers of their ends in ascending order.
    pub arcs: HashMap<[u32; 2], Circle>,
}

/// Triangulates the rectangle between the lower and the upper corner `frame` with as few triangles as a least angle of 26 degrees
/// allows (20 where there are many sides), so that every outline inside consists of sides of triangles. `None` if that takes too
/// many, if a number is not finite, if circles touch, or if they cross the frame off their axes.
pub fn coarse(outlines: &[Outline], frame: [[f64; 2]; 2]) -> Option<Coarse> {
    ARCS.into_iter().find_map(|arcs| coarse_with(outlines, frame, arcs))
}

fn coarse_with(outlines: &[Outline], frame: [[f64; 2]; 2], arcs: usize) -> Option<Coarse> {
    let [low, high] = frame;
    let whole = Outline::polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]]);
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let (circles, pieces) = divided(outlines, &whole, frame, arcs)?;
    let sides = pieces.len();
    for [a, b] in pieces {
        let a = cdt.insert(Point2::new(a[0], a[1])).ok()?;
        let b = cdt.insert(Point2::new(b[0], b[1])).ok()?;
        if a != b {
            cdt.add_constraint_and_split(a, b, |p| p);
        }
    }
    let scale = (high[0] - low[0]).max(high[1] - low[1]);
    let least_angle = if sides > MANY_SIDES { MIN_ANGLE_OF_MANY } else { MIN_ANGLE };
    let outcome = cdt.refine(
        RefinementParameters::new()
            .with_angle_limit(AngleLimit::from_deg(least_angle))
            .with_min_required_area((LEAST_AREA * scale).powi(2))
            .with_max_additional_vertices(MOST_POINTS),
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
    if !circles.is_empty() {
        let constraints = cdt.undirected_edges().filter(|e| e.is_constraint_edge());
        let sides = constraints.map(|e| e.vertices().map(|v| v.index() as u32));
        out.bend(&circles, sides)?;
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
    /// Moves points on chords onto their circles, and notes which sides stand for arcs. `None` if a triangle turns over, or if chords of
    /// different circles cross where the circles do not.
    fn bend(&mut self, circles: &[DividedCircle], sides: impl Iterator<Item = [u32; 2]>) -> Option<()> {
        let before: Vec<f64> =
            self.mesh.triangles.iter().map(|t| signed_area(&self.mesh.points, t)).collect();
        let mut on: Vec<Vec<usize>> = vec![Vec::new(); self.mesh.points.len()];
        for (c, divided) in circles.iter().enumerate() {
            let DividedCircle { circle, points, .. } = divided;
            for (p, point) in self.mesh.points.iter_mut().enumerate() {
                let [x, y] = [0, 1].map(|k| point[k] - circle.center[k]);
                let distance = x.hypot(y);
                if distance > circle.radius * (1.0 + SAME) || distance < 0.9 * circle.radius {
                    continue;
                }
                // On the chord between the two points of the circle on either side?
                let angle = circle.angle(*point).rem_euclid(TAU);
                let next = points.partition_point(|(a, _)| *a <= angle);
                let [(from, a), (to, b)] =
                    [next + points.len() - 1, next].map(|around| points[around % points.len()]);
                let is_arc = divided.is_followed_between(from, to);
                let cross = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
                let near = |q: [f64; 2]| (q[0] - point[0]).hypot(q[1] - point[1]) <= SAME * circle.radius;
                if near(a) || near(b) {
                    on[p].push(c);
                } else if is_arc && cross.abs() <= SAME * circle.radius * (b[0] - a[0]).hypot(b[1] - a[1]) {
                    *point = [0, 1].map(|k| circle.center[k] + circle.radius * [x, y][k] / distance);
                    on[p].push(c);
                }
            }
        }
        let mut found = vec![0.0; circles.len()];
        for [a, b] in sides {
            for &c in on[a as usize].iter().filter(|c| on[b as usize].contains(c)) {
                let divided = &circles[c];
                let DividedCircle { circle, points, .. } = divided;
                // A side of another outline may be a longer chord.
                let [p, q] = [a, b].map(|end| self.mesh.points[end as usize]);
                let [from, to] = [p, q].map(|end| circle.angle(end));
                let turn = apart(from, to);
                let mut between = points.iter().filter(|(angle, _)| {
                    [from, to].iter().all(|end| {
                        let own = apart(*angle, *end);
                        own > SAME && own < turn - SAME
                    })
                });
                let is_arc = divided.is_followed(circle.angle(circle.between(p, q)));
                if between.next().is_none() && turn < 1.0 && is_arc {
                    found[c] += turn;
                    if self.arcs.insert(key(a, b), *circle).is_some() {
                        return None;
                    }
                }
            }
        }
        let is_whole = |(circle, found): (&DividedCircle, f64)| (circle.within - found).abs() < TOUCH;
        if !circles.iter().zip(found).all(is_whole) {
            return None;
        }
        let turned = |(t, before): (&[u32; 3], f64)| signed_area(&self.mesh.points, t) * before <= 0.0;
        (!self.mesh.triangles.iter().zip(before).any(turned)).then_some(())
    }
}

fn signed_area(points: &[[f64; 2]], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|p| points[p as usize]);
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

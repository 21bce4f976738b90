//! Triangulations of the plane for fields that are singular at corners and along edges.
//!
//! A coarse triangulation follows the outlines ([`coarse`]). Its triangles are then divided geometrically ([`graded`]): towards each
//! marked corner into rings, towards each marked edge into strips, every one a fixed share of the width of the one before. With
//! polynomials on such meshes the error falls exponentially with the number of layers (Babuska and Guo, Comput. Mech. 1, 1986).

use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};
use std::collections::{HashMap, HashSet};
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

/// A closed outline.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// A polygon by its corners.
    Polygon(Vec<[f64; 2]>),
    /// A circle.
    Circle(Circle),
}

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

    fn angle(&self, p: [f64; 2]) -> f64 {
        (p[1] - self.center[1]).atan2(p[0] - self.center[0])
    }

    /// The middle of the shorter arc between two points.
    fn between(&self, p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
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

/// Arcs that a whole circle is divided into, if nothing crosses it: the first number with which no triangle at a chord turns over when
/// that becomes an arc.
const ARCS: [usize; 4] = [16, 32, 64, 128];

/// Points on a circle or a side that are closer together than this, relative to its size, are one.
const SAME: f64 = 1e-9;

/// Circles that come closer than this to touching, relative to their size, are not divided.
const TOUCH: f64 = 1e-6;

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

/// Which corners and edges of a coarse triangulation are graded.
#[derive(Debug, Clone, Default)]
pub struct Marks {
    /// For each point whether it is a corner.
    pub corners: Vec<bool>,
    /// Sides of triangles, by the numbers of their ends in ascending order.
    pub edges: HashSet<[u32; 2]>,
}

/// How a triangulation is graded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Rings around each marked corner.
    pub corners: usize,
    /// Strips along each marked edge; at most as many as rings.
    pub edges: usize,
    /// Width of a layer over that of the next one outwards.
    pub ratio: f64,
}

/// Triangulates the rectangle between the lower and the upper corner `frame` with as few triangles as a least angle of 26 degrees
/// allows (20 where there are many sides), so that every outline inside consists of sides of triangles. `None` if that takes too
/// many, if a number is not finite, if circles touch, or if they cross the frame off their axes.
pub fn coarse(outlines: &[Outline], frame: [[f64; 2]; 2]) -> Option<Coarse> {
    ARCS.into_iter().find_map(|arcs| coarse_with(outlines, frame, arcs))
}

fn coarse_with(outlines: &[Outline], frame: [[f64; 2]; 2], arcs: usize) -> Option<Coarse> {
    let [low, high] = frame;
    let whole = [low, [high[0], low[1]], high, [low[0], high[1]]];
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

/// The ends of a straight line.
type Segment = [[f64; 2]; 2];

/// A circle and the points on it between which it is divided, by their angles from 0 to a whole turn, ascending.
#[derive(Debug)]
struct DividedCircle {
    circle: Circle,
    points: Vec<(f64, [f64; 2])>,
    /// The sum of the angles of the arcs in the frame.
    within: f64,
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
fn divided(
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
fn apart(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(TAU);
    difference.min(TAU - difference)
}

impl Coarse {
    /// Moves points on chords onto their circles, and notes which sides stand for arcs. `None` if a triangle turns over, or if chords of
    /// different circles cross where the circles do not.
    fn bend(&mut self, circles: &[DividedCircle], sides: impl Iterator<Item = [u32; 2]>) -> Option<()> {
        let before: Vec<f64> =
            self.mesh.triangles.iter().map(|t| signed_area(&self.mesh.points, t)).collect();
        let mut on: Vec<Vec<usize>> = vec![Vec::new(); self.mesh.points.len()];
        for (c, DividedCircle { circle, points, .. }) in circles.iter().enumerate() {
            for (p, point) in self.mesh.points.iter_mut().enumerate() {
                let [x, y] = [0, 1].map(|k| point[k] - circle.center[k]);
                let distance = x.hypot(y);
                if distance > circle.radius * (1.0 + SAME) || distance < 0.9 * circle.radius {
                    continue;
                }
                // On the chord between the two points of the circle on either side?
                let angle = circle.angle(*point).rem_euclid(TAU);
                let next = points.partition_point(|(a, _)| *a <= angle);
                let [a, b] = [next + points.len() - 1, next].map(|around| points[around % points.len()].1);
                let cross = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
                let near = |q: [f64; 2]| (q[0] - point[0]).hypot(q[1] - point[1]) <= SAME * circle.radius;
                if near(a) || near(b) {
                    on[p].push(c);
                } else if cross.abs() <= SAME * circle.radius * (b[0] - a[0]).hypot(b[1] - a[1]) {
                    *point = [0, 1].map(|k| circle.center[k] + circle.radius * [x, y][k] / distance);
                    on[p].push(c);
                }
            }
        }
        let mut found = vec![0.0; circles.len()];
        for [a, b] in sides {
            for &c in on[a as usize].iter().filter(|c| on[b as usize].contains(c)) {
                let DividedCircle { circle, points, .. } = &circles[c];
                // A side of another outline may be a longer chord.
                let [from, to] = [a, b].map(|p| circle.angle(self.mesh.points[p as usize]));
                let turn = apart(from, to);
                let mut between = points.iter().filter(|(angle, _)| {
                    [from, to].iter().all(|end| {
                        let own = apart(*angle, *end);
                        own > SAME && own < turn - SAME
                    })
                });
                if between.next().is_none() && turn < 1.0 {
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

/// A triangle one side of which is an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BentTriangle {
    /// The ends of the arc and the third corner.
    pub corners: [[f64; 2]; 3],
    /// The middle of the circle.
    pub center: [f64; 2],
}

/// A divided mesh.
#[derive(Debug, Clone, Default)]
pub struct Graded {
    /// Its points, those in bent triangles moved with them, and its triangles.
    pub mesh: Triangles,
    /// For each triangle the one of the coarse mesh that it is a part of.
    pub parents: Vec<u32>,
    /// For each triangle the bent one that it is a part of, if it is.
    pub bent: Vec<Option<BentTriangle>>,
    /// Where each point would be if nothing were bent.
    pub straight: Vec<[f64; 2]>,
}

/// Divides the triangles of a mesh towards marked corners and edges. `moved` says where a point of a triangle goes when the
/// arc that is one of its sides is put in the place of the chord.
pub fn graded(
    coarse: &Coarse,
    marks: &Marks,
    layers: Layers,
    moved: impl Fn(&BentTriangle, [f64; 2]) -> [f64; 2],
) -> Graded {
    let mesh = &coarse.mesh;
    let edges = if layers.edges == 0 { HashSet::new() } else { marks.edges.clone() };
    let mut work = Grading {
        points: mesh.points.clone(),
        triangles: mesh.triangles.iter().zip(0..).map(|(t, parent)| (*t, parent)).collect(),
        corner: marks.corners.clone(),
        on_edge: vec![false; mesh.points.len()],
        edges,
        arcs: coarse.arcs.clone(),
        layers,
        nodes: HashMap::new(),
    };
    for [a, b] in work.edges.iter().copied().collect::<Vec<_>>() {
        work.on_edge[a as usize] = true;
        work.on_edge[b as usize] = true;
    }
    if layers.corners == 0 {
        work.corner.fill(false);
    }
    work.separate();
    work.divide(moved)
}

/// A mesh on its way from coarse to graded.
struct Grading {
    points: Vec<[f64; 2]>,
    /// Each with its parent.
    triangles: Vec<([u32; 3], u32)>,
    corner: Vec<bool>,
    on_edge: Vec<bool>,
    edges: HashSet<[u32; 2]>,
    arcs: HashMap<[u32; 2], Circle>,
    layers: Layers,
    /// The point at the so-manyth layer from the first point towards the second.
    nodes: HashMap<(u32, u32, usize), u32>,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Grading {
    fn touched(&self, p: u32) -> bool {
        self.corner[p as usize] || self.on_edge[p as usize]
    }

    fn point(&mut self, at: [f64; 2], on_edge: bool) -> u32 {
        self.points.push(at);
        self.corner.push(false);
        self.on_edge.push(on_edge);
        (self.points.len() - 1) as u32
    }

    /// Divides triangles until each has at most one marked edge with at most one corner on it, and otherwise at most one point that
    /// is graded towards.
    fn separate(&mut self) {
        for ([a, b, c], parent) in std::mem::take(&mut self.triangles) {
            let sides = [key(a, b), key(b, c), key(c, a)];
            let arcs = sides.iter().filter(|side| self.arcs.contains_key(*side)).count();
            if arcs > 1 || sides.iter().all(|side| self.edges.contains(side)) {
                let [x, y, z] = [a, b, c].map(|p| self.points[p as usize]);
                let middle = self.point([0, 1].map(|k| (x[k] + y[k] + z[k]) / 3.0), false);
                self.triangles.extend([[a, b, middle], [b, c, middle], [c, a, middle]].map(|t| (t, parent)));
            } else {
                self.triangles.push(([a, b, c], parent));
            }
        }
        self.split(|grading, [a, b]| {
            grading.edges.contains(&[a, b]) && grading.corner[a as usize] && grading.corner[b as usize]
        });
        while self.split(|grading, [a, b]| {
            !grading.edges.contains(&[a, b]) && grading.touched(a) && grading.touched(b)
        }) {}
    }

    /// Cuts sides in two, and with them their triangles. Returns whether there were any.
    fn split(&mut self, cut: impl Fn(&Self, [u32; 2]) -> bool) -> bool {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for ([a, b, c], _) in self.triangles.clone() {
            for side in [key(a, b), key(b, c), key(c, a)] {
                if middles.contains_key(&side) || !cut(self, side) {
                    continue;
                }
                let [p, q] = side.map(|p| self.points[p as usize]);
                let marked = self.edges.contains(&side);
                let place = match self.arcs.get(&side) {
                    Some(circle) => circle.between(p, q),
                    None => [0, 1].map(|k| 0.5 * (p[k] + q[k])),
                };
                let middle = self.point(place, marked);
                middles.insert(side, middle);
            }
        }
        for (side, middle) in &middles {
            if self.edges.remove(side) {
                self.edges.extend(side.map(|end| key(end, *middle)));
            }
            if let Some(circle) = self.arcs.remove(side) {
                self.arcs.extend(side.map(|end| (key(end, *middle), circle)));
            }
        }
        for (triangle, parent) in std::mem::take(&mut self.triangles) {
            let middle = |k: usize| middles.get(&key(triangle[(k + 1) % 3], triangle[(k + 2) % 3])).copied();
            let halves = [0, 1, 2].map(middle);
            let pieces: Vec<[u32; 3]> = match halves.iter().flatten().count() {
                0 => vec![triangle],
                1 => {
                    let k = halves.iter().position(Option::is_some).unwrap_or(0);
                    let m = halves[k].unwrap_or(0);
                    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    vec![[a, b, m], [a, m, c]]
                }
                2 => {
                    let k = halves.iter().position(Option::is_none).unwrap_or(0);
                    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    let (m, n) = (halves[(k + 1) % 3].unwrap_or(0), halves[(k + 2) % 3].unwrap_or(0));
                    // m lies between c and a, n between a and b.
                    let length = |p: u32, q: u32| self.distance(p, q);
                    if length(b, m) <= length(c, n) {
                        vec![[a, n, m], [n, b, m], [b, c, m]]
                    } else {
                        vec![[a, n, m], [n, b, c], [n, c, m]]
                    }
                }
                _ => {
                    let [a, b, c] = triangle;
                    let [x, y, z] = halves.map(|m| m.unwrap_or(0));
                    vec![[a, z, y], [z, b, x], [y, x, c], [x, y, z]]
                }
            };
            self.triangles.extend(pieces.into_iter().map(|t| (t, parent)));
        }
        !middles.is_empty()
    }

    fn distance(&self, p: u32, q: u32) -> f64 {
        let [p, q] = [p, q].map(|p| self.points[p as usize]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    }

    /// The point at layer `k` from `from` towards `to`, which is at layer 0.
    fn node(&mut self, from: u32, to: u32, k: usize) -> u32 {
        if k == 0 {
            return to;
        }
        if let Some(&node) = self.nodes.get(&(from, to, k)) {
            return node;
        }
        let node = self.between(from, to, self.layers.ratio.powi(k as i32));
        self.nodes.insert((from, to, k), node);
        node
    }

    fn between(&mut self, from: u32, to: u32, share: f64) -> u32 {
        let [p, q] = [from, to].map(|p| self.points[p as usize]);
        self.point([0, 1].map(|k| p[k] + share * (q[k] - p[k])), false)
    }

    fn divide(mut self, moved: impl Fn(&BentTriangle, [f64; 2]) -> [f64; 2]) -> Graded {
        let mut out = Vec::new();
        let (mut parents, mut bent) = (Vec::new(), Vec::new());
        for (triangle, parent) in std::mem::take(&mut self.triangles) {
            let marked =
                (0..3).find(|&k| self.edges.contains(&key(triangle[(k + 1) % 3], triangle[(k + 2) % 3])));
            let pieces = match (marked, (0..3).find(|&k| self.touched(triangle[k]))) {
                (Some(k), _) => {
                    let [c, a, b] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    if self.corner[a as usize] {
                        self.towards_edge_and_corner(a, b, c)
                    } else if self.corner[b as usize] {
                        self.towards_edge_and_corner(b, a, c)
                    } else {
                        self.towards_edge(a, b, c)
                    }
                }
                (None, Some(k)) => {
                    let [a, x, y] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    self.towards_point(a, x, y)
                }
                (None, None) => vec![triangle],
            };
            let arc = (0..3).find_map(|k| {
                let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                let circle = self.arcs.get(&key(a, b))?;
                // From the lower number, so that both triangles at the arc see it from the same end.
                let corners = [a.min(b), a.max(b), c].map(|p| self.points[p as usize]);
                Some(BentTriangle { corners, center: circle.center })
            });
            bent.extend(std::iter::repeat_n(arc, pieces.len()));
            parents.extend(std::iter::repeat_n(parent, pieces.len()));
            out.extend(pieces);
        }
        let mut points = self.points.clone();
        for (triangle, arc) in out.iter().zip(&bent) {
            if let Some(arc) = arc {
                triangle.iter().for_each(|p| points[*p as usize] = moved(arc, self.points[*p as usize]));
            }
        }
        Graded { mesh: Triangles { points, triangles: out }, parents, bent, straight: self.points }
    }

    /// Two triangles between two segments, from `a` to `b` and from `d` to `c`.
    fn quadrilateral(&self, [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
        if self.distance(a, c) <= self.distance(b, d) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    }

    fn towards_point(&mut self, a: u32, x: u32, y: u32) -> Vec<[u32; 3]> {
        let layers = if self.corner[a as usize] { self.layers.corners } else { self.layers.edges };
        let mut out = Vec::new();
        let mut outer = [x, y];
        for k in 1..=layers {
            let inner = [self.node(a, x, k), self.node(a, y, k)];
            out.extend(self.quadrilateral([outer[0], outer[1], inner[1], inner[0]]));
            outer = inner;
        }
        out.push([a, outer[0], outer[1]]);
        out
    }

    /// Strips along the side from `a` to `b`, neither of which is a corner.
    fn towards_edge(&mut self, a: u32, b: u32, c: u32) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        let mut outer = [c, c];
        for k in 1..=self.layers.edges {
            let inner = [self.node(a, c, k), self.node(b, c, k)];
            if k == 1 {
                out.push([c, inner[0], inner[1]]);
            } else {
                out.extend(self.quadrilateral([outer[0], outer[1], inner[1], inner[0]]));
            }
            outer = inner;
        }
        out.extend(self.quadrilateral([outer[0], outer[1], b, a]));
        out
    }

    /// Rings around the corner `a`, each divided into strips along the side from `a` to `b`.
    fn towards_edge_and_corner(&mut self, a: u32, b: u32, c: u32) -> Vec<[u32; 3]> {
        let (rings, strips) = (self.layers.corners, self.layers.edges);
        // Ring by ring the points from the side to c down to that to b; the distance from the side to b falls like the rings.
        let lines: Vec<Vec<u32>> = (0..=rings)
            .map(|ring| {
                let far = self.node(a, c, ring);
                let near = self.node(a, b, ring);
                let mut line = vec![far];
                for strip in ring + 1..=strips {
                    let node = if ring == 0 {
                        self.node(b, c, strip)
                    } else {
                        self.between(near, far, self.layers.ratio.powi((strip - ring) as i32))
                    };
                    line.push(node);
                }
                line.push(near);
                line
            })
            .collect();
        let mut out = Vec::new();
        for pair in lines.windows(2) {
            let (outer, inner) = (&pair[0], &pair[1]);
            // Where the outer line has one point more, a triangle makes up for it.
            let extra = outer.len() - inner.len();
            if extra == 1 {
                out.push([outer[0], outer[1], inner[0]]);
            }
            for k in 1..inner.len() {
                out.extend(self.quadrilateral([
                    outer[k - 1 + extra],
                    outer[k + extra],
                    inner[k],
                    inner[k - 1],
                ]));
            }
        }
        let last = &lines[rings];
        out.extend((1..last.len()).map(|k| [a, last[k - 1], last[k]]));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const L: [[f64; 2]; 6] = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    const FRAME: [[f64; 2]; 2] = [[-3.0, -2.0], [4.0, 5.0]];

    fn area(mesh: &Triangles, t: &[u32; 3]) -> f64 {
        let [a, b, c] = t.map(|p| mesh.points[p as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }

    /// Each side belongs to two triangles, or to one and lies on the frame.
    fn is_conforming(mesh: &Triangles) -> bool {
        let mut count: HashMap<[u32; 2], usize> = HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                *count.entry(side).or_default() += 1;
            }
        }
        let on_frame = |side: &[u32; 2]| {
            let [p, q] = side.map(|p| mesh.points[p as usize]);
            (0..2).any(|k| p[k] == q[k] && (p[k] == FRAME[0][k] || p[k] == FRAME[1][k]))
        };
        count.iter().all(|(side, n)| *n == 2 || (*n == 1 && on_frame(side)))
    }

    fn on_outline(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
        outline.iter().zip(outline.iter().cycle().skip(1)).any(|(a, b)| {
            let along = [b[0] - a[0], b[1] - a[1]];
            let from = [p[0] - a[0], p[1] - a[1]];
            let cross = along[0] * from[1] - along[1] * from[0];
            let dot = (along[0] * from[0] + along[1] * from[1]) / (along[0].powi(2) + along[1].powi(2));
            cross.abs() < 1e-12 && (-1e-12..=1.0 + 1e-12).contains(&dot)
        })
    }

    fn marks(mesh: &Triangles, outline: &[[f64; 2]]) -> Marks {
        let mut edges = HashSet::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                let [p, q] = side.map(|p| mesh.points[p as usize]);
                let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
                if on_outline(outline, p) && on_outline(outline, q) && on_outline(outline, middle) {
                    edges.insert(side);
                }
            }
        }
        Marks { corners: mesh.points.iter().map(|p| outline.contains(p)).collect(), edges }
    }

    #[test]
    fn a_graded_mesh_fills_the_frame_and_conforms_at_any_number_of_layers() {
        let coarse = coarse(&[Outline::Polygon(L.to_vec())], FRAME).unwrap();
        let mesh = &coarse.mesh;
        assert!(is_conforming(mesh));
        let marks = marks(mesh, &L);
        assert!(marks.corners.iter().filter(|c| **c).count() == 6 && marks.edges.len() >= 6);
        for corners in 0..4 {
            for edges in 0..=corners {
                let Graded { mesh: fine, parents, .. } =
                    graded(&coarse, &marks, Layers { corners, edges, ratio: 0.15 }, |_, p| p);
                assert!(is_conforming(&fine), "{corners} {edges}");
                let total: f64 = fine.triangles.iter().map(|t| area(&fine, t)).sum();
                assert!((total - 49.0).abs() < 1e-11, "{corners} {edges}: {total}");
                let mut of_parent = vec![0.0; mesh.triangles.len()];
                fine.triangles
                    .iter()
                    .zip(&parents)
                    .for_each(|(t, p)| of_parent[*p as usize] += area(&fine, t));
                let differ = mesh.triangles.iter().zip(of_parent).map(|(t, a)| (a - area(mesh, t)).abs());
                assert!(differ.fold(0.0, f64::max) < 1e-12);
                let nearest = fine.points.iter().filter(|p| !on_outline(&L, **p));
                let nearest = nearest.map(|p| p[0].hypot(p[1])).fold(f64::INFINITY, f64::min);
                assert!(corners == 0 || nearest < 1.5 * 0.15_f64.powi(corners as i32));
            }
        }
    }

    #[test]
    fn a_triangle_and_a_needle_all_of_whose_edges_are_marked_are_graded_too() {
        for outline in [vec![[0.0, 0.0], [1.0, 0.1], [0.2, 0.9]], vec![[0.0, 0.0], [3.0, 0.0], [3.0, 0.02]]] {
            let coarse = coarse(&[Outline::Polygon(outline.clone())], FRAME).unwrap();
            let layers = Layers { corners: 3, edges: 2, ratio: 0.15 };
            let fine = graded(&coarse, &marks(&coarse.mesh, &outline), layers, |_, p| p);
            assert!(is_conforming(&fine.mesh));
        }
    }

    #[test]
    fn circles_are_followed_by_arcs_that_end_where_other_outlines_cross_them() {
        let circle = Circle { center: [0.0, 1.0], radius: 1.5 };
        let outlines = [Outline::Circle(circle), Outline::Polygon(L.to_vec())];
        // Whole, and cut in two by the frame through its middle.
        for frame in [FRAME, [[0.0, -2.0], [4.0, 5.0]]] {
            let coarse = coarse(&outlines, frame).unwrap();
            let turned: f64 = coarse
                .arcs
                .keys()
                .map(|side| {
                    let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                    for p in [p, q] {
                        let distance = (p[0] - circle.center[0]).hypot(p[1] - circle.center[1]);
                        assert!((distance - circle.radius).abs() < 1e-12);
                    }
                    apart(circle.angle(p), circle.angle(q))
                })
                .sum();
            let share = if frame[0][0] == 0.0 { 0.5 } else { 1.0 };
            assert!((turned - share * TAU).abs() < 1e-9, "{turned}");
            let crosses = |t: &[u32; 3]| {
                let x = t.map(|p| coarse.mesh.points[p as usize]);
                let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                let inside = crate::outline::contains(&L, middle);
                let strictly = |p: &[f64; 2]| crate::outline::contains(&L, *p) && !on_outline(&L, *p);
                !inside && x.iter().any(strictly)
            };
            assert!(!coarse.mesh.triangles.iter().any(crosses));
        }
    }

    #[test]
    fn circles_that_cross_are_divided_where_they_do_and_those_that_touch_have_no_mesh() {
        let one = Circle { center: [0.0, 1.0], radius: 1.5 };
        let coarse_of = |other: Circle| coarse(&[one, other].map(Outline::Circle), FRAME);
        for other in [
            Circle { center: [1.1, 1.7], radius: 0.9 },
            Circle { center: [0.0, 1.4], radius: 1.5 },
            Circle { center: [-0.3, 0.8], radius: 0.2 },
        ] {
            let coarse = coarse_of(other).unwrap();
            for circle in [one, other] {
                let own = coarse.arcs.iter().filter(|(_, of)| **of == circle);
                let turned: f64 = own
                    .map(|(side, _)| {
                        let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                        apart(circle.angle(p), circle.angle(q))
                    })
                    .sum();
                assert!((turned - TAU).abs() < 1e-9, "{circle:?}: {turned}");
            }
        }
        assert!(coarse_of(Circle { center: [2.0, 1.0], radius: 0.5 }).is_none());
        assert!(coarse_of(Circle { center: [0.5, 1.0], radius: 1.0 }).is_none());
    }

    #[test]
    fn outlines_that_reach_beyond_the_frame_end_on_it() {
        let wide = [[-9.0, 1.0], [9.0, 1.0], [9.0, 2.0], [-9.0, 2.0]];
        let mesh = coarse(&[wide.to_vec(), L.to_vec()].map(Outline::Polygon), FRAME).unwrap().mesh;
        assert!(is_conforming(&mesh));
        let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
        assert!((total - 49.0).abs() < 1e-12);
        let crosses = |t: &[u32; 3]| {
            let y = t.map(|p| mesh.points[p as usize][1]);
            y.iter().any(|y| *y < 1.0 - 1e-12) && y.iter().any(|y| *y > 1.0 + 1e-12)
        };
        assert!(!mesh.triangles.iter().any(crosses));
    }

    #[test]
    fn every_point_on_the_frame_is_on_it_to_the_last_bit() {
        for k in 0..40 {
            let shift = 0.013 * f64::from(k);
            let frame = [[-0.95 / 1.1 - shift, -1.0 / 0.7], [1.05 / 1.1 + shift, 3.0_f64.sqrt()]];
            let outline = vec![[-0.5, -0.3], [0.4, -0.3], [0.4, 0.35 + shift], [-0.5, 0.35]];
            let mesh = coarse(&[Outline::Polygon(outline)], frame).unwrap().mesh;
            for p in &mesh.points {
                for c in 0..2 {
                    for end in frame.map(|corner| corner[c]) {
                        assert!(p[c] == end || (p[c] - end).abs() > 1e-6, "{p:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn outlines_that_cross_are_both_followed() {
        let one = vec![[0.1, -0.4], [0.5, -0.4], [0.5, 0.5], [0.1, 0.5]];
        let other = vec![[-0.6, -0.5], [0.4, -0.5], [0.4, 0.3], [-0.6, 0.3]];
        for turn in [0.0_f64, 0.3, 1.1] {
            let turned = |outline: &[[f64; 2]]| -> Vec<[f64; 2]> {
                let (s, c) = turn.sin_cos();
                outline.iter().map(|p| [c * p[0] - s * p[1], s * p[0] + c * p[1]]).collect()
            };
            let outlines = [turned(&one), turned(&other)];
            let mesh = coarse(&outlines.clone().map(Outline::Polygon), FRAME).unwrap().mesh;
            for (outline, exact) in outlines.iter().zip([0.36, 0.8]) {
                let inside = mesh.triangles.iter().filter(|t| {
                    let x = t.map(|p| mesh.points[p as usize]);
                    let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                    crate::outline::contains(outline, middle)
                });
                let total: f64 = inside.map(|t| area(&mesh, t)).sum();
                assert!((total - exact).abs() < 1e-12, "{turn}: {total} {exact}");
            }
        }
    }
}

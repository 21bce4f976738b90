//! Intersections of surfaces: the points and segments in which they meet.
//!
//! A point that lies on a facet or segment becomes a point of it, segments are divided where they pass
//! through facets or meet other segments, and two facets that cross get their common line as a segment.
//! Points closer together than a tolerance become one: both surfaces then share the same points, and no
//! distance remains whose sign rounding could change.

mod conductor_contacts;
mod coplanar_facets;

use super::delaunay::sorted;
use super::piecewise_linear_complex::{AxisPlane, PiecewiseLinearComplex, Polygon};
use super::{MeshError, Point};
use crate::intersect::{Frame, Search};
use crate::outline;
use elastocap_linalg::vector::{dot, length, minus};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The distance within which points are the same, relative to the shortest segment. It is not tuned.
const NEAR: f64 = 1e-6;

/// Smallest and largest value of [`NEAR`] times the shortest segment, relative to the extent of the scene. It
/// is not tuned.
const NEAR_RANGE: [f64; 2] = [1e-13, 1e-8];

/// Where a segment of a ball crosses another surface this close to one of its ends, relative to its length,
/// the crossing is taken to be at that end: the corners of a ball may move a little. It is not tuned.
const MERGE_AT_END: f64 = 2e-3;

/// New segments of one round may meet further surfaces in the next. Each round puts the new points on one
/// facet more, so that few rounds suffice. Not tuned: a limit that ordinary cases do not reach.
const MAX_ROUNDS: usize = 12;

/// The largest number of pairs of surfaces or segments to compare, which takes some ten seconds. Scenes of
/// some hundred bodies need a hundredth of it. Not tuned: a limit that ordinary cases do not reach.
const MAX_PAIRS: usize = 30_000_000;

/// A polygon of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct PolygonId {
    /// The facet.
    facet: u32,
    /// The index among the polygons of the facet.
    polygon: usize,
}

/// Points at which segments will be divided.
type Divisions = BTreeMap<[u32; 2], Vec<u32>>;

/// The search for intersections.
struct Intersections<'a> {
    /// The complex whose surfaces are compared.
    complex: &'a mut PiecewiseLinearComplex,
    /// The distance within which points are the same, m.
    near: f64,
    /// The coordinates of the boxes in `search`.
    frame: Frame,
    /// The polygons in `search`, in its order.
    polygons: Vec<PolygonId>,
    /// The tree of the boxes around all polygons.
    search: Search,
    /// Points by the cells of a grid.
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Pairs of facets that may have a new line in common.
    pairs: BTreeSet<[u32; 2]>,
    /// Working memory of `search`.
    stack: Vec<u32>,
    /// The number of pairs compared so far.
    compared: usize,
}

/// Gives all surfaces the points and segments in which they meet.
///
/// # Errors
/// [`MeshError::Crossing`] if two conductors have a point in common, [`MeshError::Tangled`] if the search
/// comes to no end.
pub(super) fn resolve_intersections(complex: &mut PiecewiseLinearComplex) -> Result<(), MeshError> {
    let mut intersections = Intersections::new(complex);
    intersections.run()?;
    intersections.remove_seeds_near_surfaces();
    intersections.refuse_conductor_contacts()
}

/// Lower and upper corner of the box around the points, `near` larger on every side, m.
fn padded(points: &[Point], near: f64) -> [Point; 2] {
    [(f64::min as fn(f64, f64) -> f64, -near), (f64::max, near)].map(|(pick, by)| {
        [0, 1, 2].map(|k| points.iter().skip(1).fold(points[0][k], |m, p| pick(m, p[k])) + by)
    })
}

/// The nearest point of a segment, as a share of its length from the first end, and the distance from it, m.
fn nearest_on_segment(p: Point, [a, b]: [Point; 2]) -> (f64, f64) {
    let (u, v) = (minus(b, a), minus(p, a));
    let s = (dot(u, v) / dot(u, u)).clamp(0.0, 1.0);
    (s, length([0, 1, 2].map(|k| v[k] - s * u[k])))
}

/// The point at a share `s` of the way between two others; exact in coordinates that these have in common.
fn between([a, b]: [Point; 2], s: f64) -> Point {
    [0, 1, 2].map(|k| if a[k] == b[k] { a[k] } else { a[k] + s * (b[k] - a[k]) })
}

/// Whether a point lies in a polygon or within `near` of its outline.
fn in_or_near_polygon(polygon: &[[f64; 2]], q: [f64; 2], near: f64) -> bool {
    let in_space = |p: [f64; 2]| [p[0], p[1], 0.0];
    outline::contains(polygon, q)
        || (0..polygon.len()).any(|k| {
            let ends = [polygon[k], polygon[(k + 1) % polygon.len()]];
            let out = |a: usize| {
                q[a] < ends[0][a].min(ends[1][a]) - near || q[a] > ends[0][a].max(ends[1][a]) + near
            };
            !out(0) && !out(1) && nearest_on_segment(in_space(q), ends.map(in_space)).1 <= near
        })
}

impl<'a> Intersections<'a> {
    /// A search in which nothing has been compared yet.
    fn new(complex: &'a mut PiecewiseLinearComplex) -> Self {
        let shortest = complex
            .segments
            .keys()
            .map(|e| {
                let [a, b] = e.map(|p| complex.points[p as usize]);
                length(minus(a, b))
            })
            .fold(f64::INFINITY, f64::min);
        let whole = match &complex.points[..] {
            [] => 1.0,
            all => {
                let [low, high] = padded(all, 0.0);
                length(minus(high, low))
            }
        };
        let near = (NEAR * shortest).clamp(NEAR_RANGE[0] * whole, NEAR_RANGE[1] * whole);
        let frame = Frame::around(complex.points.iter());
        let (search, stack) = (Search::of(Vec::new()), Vec::new());
        let mut out = Self {
            complex,
            near,
            frame,
            polygons: Vec::new(),
            search,
            cells: HashMap::new(),
            pairs: BTreeSet::new(),
            stack,
            compared: 0,
        };
        for p in 0..out.complex.points.len() as u32 {
            let cell = out.cell(out.complex.points[p as usize]);
            out.cells.entry(cell).or_default().push(p);
        }
        out.index_polygons();
        out
    }

    /// Fills the search tree with all polygons.
    fn index_polygons(&mut self) {
        self.polygons.clear();
        let mut boxes = Vec::new();
        for (f, facet) in self.complex.facets.iter().enumerate() {
            for (k, polygon) in facet.polygons.iter().enumerate() {
                let corners: Vec<Point> = polygon.corners.iter().map(|&q| facet.point(q)).collect();
                boxes.push(self.frame.bounds(&padded(&corners, self.near)));
                self.polygons.push(PolygonId { facet: f as u32, polygon: k });
            }
        }
        self.search = Search::of(boxes);
    }

    /// The cell of a grid with sides of four times `near`.
    fn cell(&self, p: Point) -> [i64; 3] {
        p.map(|x| (x / (4.0 * self.near)).floor() as i64)
    }

    /// The positions of the ends of a segment, m.
    fn ends(&self, segment: [u32; 2]) -> [Point; 2] {
        segment.map(|p| self.complex.points[p as usize])
    }

    /// Polygons whose boxes meet that of the points, in ascending order.
    fn candidates(&mut self, points: &[Point]) -> Vec<PolygonId> {
        let mut out = Vec::new();
        let bounds = self.frame.bounds(&padded(points, self.near));
        self.search.near(&bounds, &mut self.stack, |k| out.push(self.polygons[k as usize]));
        self.compared += out.len();
        out.sort_unstable();
        out
    }

    /// Whether a point lies on a facet.
    fn is_on(&self, point: u32, facet: u32) -> bool {
        self.complex.facets_of_point[point as usize].contains(&facet)
    }

    /// Whether a point of the plane of a facet lies in or near one of its polygons.
    fn reaches(&self, PolygonId { facet, polygon }: PolygonId, p: Point) -> bool {
        let facet = &self.complex.facets[facet as usize];
        in_or_near_polygon(&facet.polygons[polygon].corners, facet.project(p), self.near)
    }

    /// Records that a point lies on a facet, and moves it there exactly if the plane of the facet is normal
    /// to an axis.
    fn put_on_facet(&mut self, point: u32, facet: u32) {
        if self.is_on(point, facet) {
            return;
        }
        for &other in &self.complex.facets_of_point[point as usize] {
            self.pairs.insert(sorted(other, facet));
        }
        self.complex.put_on_facet(point, facet);
        if let Some(AxisPlane { axis, at }) = self.complex.facets[facet as usize].plane {
            self.complex.points[point as usize][axis] = at;
        }
    }

    /// The point within `near` of `p`, else the nearest one of `around` within the distance `merge`, else a
    /// new one with this element size. All in m.
    fn point(&mut self, p: Point, around: &[u32], merge: f64, size: f64) -> u32 {
        let [i, j, k] = self.cell(p);
        let away = |this: &Self, q: u32| length(minus(this.complex.points[q as usize], p));
        for n in 0..27 {
            let cell = [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1];
            let in_cell = self.cells.get(&cell).into_iter().flatten();
            if let Some(&q) = in_cell.into_iter().find(|&&q| away(self, q) <= self.near) {
                return q;
            }
        }
        let nearest = around.iter().copied().min_by(|&q, &r| away(self, q).total_cmp(&away(self, r)));
        if let Some(q) = nearest.filter(|&q| away(self, q) <= merge) {
            return q;
        }
        let new = self.complex.points.len() as u32;
        self.complex.points.push(p);
        self.complex.facets_of_point.push(Vec::new());
        self.complex.sizes.push(size);
        self.cells.entry([i, j, k]).or_default().push(new);
        new
    }

    /// The smaller of the element sizes wanted at the ends of a segment, m.
    fn size(&self, ends: [u32; 2]) -> f64 {
        ends.iter().fold(f64::INFINITY, |s, &p| s.min(self.complex.sizes[p as usize]))
    }

    /// Finds all intersections, round by round.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] and [`MeshError::Tangled`].
    fn run(&mut self) -> Result<(), MeshError> {
        self.join_coplanar_facets();
        self.pair_with_planes();
        let mut points: Vec<u32> = (0..self.complex.points.len() as u32).collect();
        let mut segments: Vec<[u32; 2]> = self.complex.segments.keys().copied().collect();
        for _ in 0..MAX_ROUNDS {
            if self.compared > MAX_PAIRS {
                return Err(MeshError::TooMany);
            }
            if points.is_empty() && segments.is_empty() {
                return Ok(());
            }
            let old = self.complex.points.len() as u32;
            self.points_on_facets(&points);
            let mut divisions = Divisions::new();
            self.segments_through_facets(&segments, &mut divisions);
            self.segments_on_segments(&points, &segments, &mut divisions);
            self.divide(divisions);
            segments = self.add_common_lines();
            points = (old..self.complex.points.len() as u32).collect();
        }
        let at = points.first().map_or([0.0; 3], |&p| self.complex.points[p as usize]);
        Err(MeshError::Tangled { at })
    }

    /// Pairs planes normal to an axis with the other facets of the points that lie exactly on them: these
    /// points are on both already, but the line between the points may not be a segment yet.
    fn pair_with_planes(&mut self) {
        for facets in &self.complex.facets_of_point {
            for &plane in facets.iter().filter(|&&f| self.complex.facets[f as usize].plane.is_some()) {
                let others = facets.iter().filter(|&&f| f != plane);
                self.pairs.extend(others.map(|&other| sorted(plane, other)));
            }
        }
    }

    /// Removes seeds on a surface or next to one; they are meant to be inside.
    fn remove_seeds_near_surfaces(&mut self) {
        for seed in std::mem::take(&mut self.complex.seeds) {
            let close = 0.3 * seed.size;
            let [low, high] = padded(&[seed.at], close);
            let near = self.candidates(&[low, high]).into_iter().any(|PolygonId { facet, polygon }| {
                let facet = &self.complex.facets[facet as usize];
                let corners = &facet.polygons[polygon].corners;
                facet.height(seed.at).abs() <= close
                    && in_or_near_polygon(corners, facet.project(seed.at), close)
            });
            if !near {
                self.complex.seeds.push(seed);
            }
        }
    }

    /// Puts points on the facets on which they lie.
    fn points_on_facets(&mut self, points: &[u32]) {
        for &p in points {
            if self.compared > MAX_PAIRS {
                return;
            }
            let at = self.complex.points[p as usize];
            for id in self.candidates(&[at]) {
                let height = self.complex.facets[id.facet as usize].height(at);
                if !self.is_on(p, id.facet) && height.abs() <= self.near && self.reaches(id, at) {
                    self.put_on_facet(p, id.facet);
                }
            }
        }
    }

    /// Adds the points at which segments pass through facets.
    fn segments_through_facets(&mut self, segments: &[[u32; 2]], divisions: &mut Divisions) {
        for &segment in segments {
            if self.compared > MAX_PAIRS {
                return;
            }
            let ends = self.ends(segment);
            for id in self.candidates(&ends) {
                let f = id.facet;
                if segment.iter().any(|&p| self.is_on(p, f)) {
                    continue;
                }
                let facet = &self.complex.facets[f as usize];
                let [over, under] = ends.map(|p| facet.height(p));
                if over * under >= 0.0 {
                    continue;
                }
                let mut at = between(ends, over / (over - under));
                if !self.reaches(id, at) {
                    continue;
                }
                let facets = self.complex.segments.get(&segment).cloned().unwrap_or_default();
                for &g in facets.iter().chain([&f]) {
                    if let Some(AxisPlane { axis, at: x }) = self.complex.facets[g as usize].plane {
                        at[axis] = x;
                    }
                }
                let on_ball = self.note_crossing(&facets, id);
                let merge = if on_ball { MERGE_AT_END * length(minus(ends[1], ends[0])) } else { 0.0 };
                let v = self.point(at, &segment, merge, self.size(segment));
                self.put_on_facet(v, f);
                if !segment.contains(&v) {
                    facets.iter().for_each(|&g| self.put_on_facet(v, g));
                    divisions.entry(segment).or_default().push(v);
                }
            }
        }
    }

    /// Records that a segment on these facets passes through a polygon. Returns whether all of the facets are
    /// parts of balls only.
    fn note_crossing(&mut self, facets: &[u32], through: PolygonId) -> bool {
        let polygons = |facet: u32| &self.complex.facets[facet as usize].polygons;
        let part = polygons(through.facet)[through.polygon].part;
        let parts: Vec<Option<u32>> =
            facets.iter().flat_map(|&g| polygons(g).iter().map(|p| p.part)).collect();
        for &other in parts.iter().filter(|&&other| other != part) {
            self.complex.surfaces_cross = true;
            if let (Some(one), Some(other)) = (part, other) {
                self.complex.crossing_parts.insert(sorted(one, other));
            }
        }
        parts.iter().all(|part| part.is_some_and(|p| self.complex.parts[p as usize].ball))
    }

    /// Adds the points at which segments meet one another. Only `segments` and `points` are new, so that only
    /// these are compared with all segments.
    fn segments_on_segments(&mut self, points: &[u32], segments: &[[u32; 2]], divisions: &mut Divisions) {
        let known: Vec<[u32; 2]> = self.complex.segments.keys().copied().collect();
        let boxes = known.iter().map(|&s| self.frame.bounds(&padded(&self.ends(s), self.near))).collect();
        let search = Search::of(boxes);
        let near = |this: &mut Self, points: &[Point]| {
            let mut candidates = Vec::new();
            let bounds = this.frame.bounds(&padded(points, this.near));
            search.near(&bounds, &mut this.stack, |k| candidates.push(known[k as usize]));
            this.compared += candidates.len();
            candidates.sort_unstable();
            candidates
        };
        for &p in points {
            let at = self.complex.points[p as usize];
            for segment in near(self, &[at]) {
                self.point_on_segment(p, segment, divisions);
            }
        }
        for &one in segments {
            if self.compared > MAX_PAIRS {
                return;
            }
            for other in near(self, &self.ends(one)) {
                self.intersect_segments(one, other, divisions);
            }
        }
    }

    /// Divides a segment at a point that lies on it, other than its ends. Returns whether the point lies on
    /// it.
    fn point_on_segment(&mut self, p: u32, segment: [u32; 2], divisions: &mut Divisions) -> bool {
        let at = self.complex.points[p as usize];
        if segment.contains(&p) || nearest_on_segment(at, self.ends(segment)).1 > self.near {
            return false;
        }
        self.divide_at(segment, p, divisions);
        true
    }

    /// Divides a segment at a point, which is put on the facets of the segment.
    fn divide_at(&mut self, segment: [u32; 2], p: u32, divisions: &mut Divisions) {
        let facets = self.complex.segments.get(&segment).cloned().unwrap_or_default();
        facets.iter().for_each(|&f| self.put_on_facet(p, f));
        let points = divisions.entry(segment).or_default();
        if !points.contains(&p) {
            points.push(p);
        }
    }

    /// Divides two segments at the point in which they meet, if they do.
    fn intersect_segments(&mut self, one: [u32; 2], other: [u32; 2], divisions: &mut Divisions) {
        if one == other {
            return;
        }
        let mut met = one.iter().any(|p| other.contains(p));
        for p in one {
            met |= self.point_on_segment(p, other, divisions);
        }
        for p in other {
            met |= self.point_on_segment(p, one, divisions);
        }
        if met {
            return;
        }
        // The nearest points of two straight lines, which parallel ones do not have.
        let (s, t) = (self.ends(one), self.ends(other));
        let (u, v, w) = (minus(s[1], s[0]), minus(t[1], t[0]), minus(s[0], t[0]));
        let (uu, vv, uv, uw, vw) = (dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w));
        let det = uu * vv - uv * uv;
        if det <= 1e-20 * uu * vv {
            return;
        }
        let (a, b) = ((uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det);
        if !(0.0..=1.0).contains(&a) || !(0.0..=1.0).contains(&b) {
            return;
        }
        let (p, q) = (between(s, a), between(t, b));
        if length(minus(p, q)) > self.near {
            return;
        }
        let new = self.point(p, &[], 0.0, self.size(one).min(self.size(other)));
        for segment in [one, other] {
            if !segment.contains(&new) {
                self.divide_at(segment, new, divisions);
            }
        }
    }

    /// Divides segments at points on them.
    fn divide(&mut self, divisions: Divisions) {
        for (segment, mut chain) in divisions {
            let Some(facets) = self.complex.segments.remove(&segment) else { continue };
            let ends = self.ends(segment);
            let place = |p: u32| nearest_on_segment(self.complex.points[p as usize], ends).0;
            chain.extend(segment);
            chain.sort_by(|&p, &q| place(p).total_cmp(&place(q)).then(p.cmp(&q)));
            chain.dedup();
            for pair in chain.windows(2) {
                for &f in &facets {
                    self.put_on_facet(pair[0], f);
                    self.put_on_facet(pair[1], f);
                    self.complex.add_segment(pair[0], pair[1], f);
                }
            }
        }
    }

    /// Adds the segments along which facets cross, between the points that they have in common. Returns those
    /// that are new.
    fn add_common_lines(&mut self) -> Vec<[u32; 2]> {
        let of_facet = self.complex.points_of_facets();
        let mut lines = Vec::new();
        for [f, g] in std::mem::take(&mut self.pairs) {
            let (few, other) =
                if of_facet[f as usize].len() <= of_facet[g as usize].len() { (f, g) } else { (g, f) };
            let mut common: Vec<u32> =
                of_facet[few as usize].iter().copied().filter(|&p| self.is_on(p, other)).collect();
            let point = |p: u32| self.complex.points[p as usize];
            let Some(&first) = common.first() else { continue };
            let far = |from: Point| {
                let away = |p: &u32| length(minus(point(*p), from));
                common.iter().copied().max_by(|p, q| away(p).total_cmp(&away(q)))
            };
            let Some(end) = far(point(first)) else { continue };
            let direction = minus(point(end), point(first));
            let place = |p: u32| dot(direction, minus(point(p), point(first)));
            common.sort_by(|&p, &q| place(p).total_cmp(&place(q)).then(p.cmp(&q)));
            for pair in common.windows(2) {
                let middle = between([point(pair[0]), point(pair[1])], 0.5);
                let covered = |f: u32| {
                    let facet = &self.complex.facets[f as usize];
                    let q = facet.project(middle);
                    let reaches = |p: &Polygon| in_or_near_polygon(&p.corners, q, self.near);
                    facet.height(middle).abs() <= 2.0 * self.near && facet.polygons.iter().any(reaches)
                };
                if covered(f) && covered(g) {
                    lines.push(([pair[0], pair[1]], [f, g]));
                }
            }
        }
        let mut new = Vec::new();
        for ([a, b], facets) in lines {
            if !self.complex.segments.contains_key(&sorted(a, b)) {
                new.push(sorted(a, b));
            }
            facets.iter().for_each(|&f| self.complex.add_segment(a, b, f));
        }
        new.sort_unstable();
        new.dedup();
        new
    }
}

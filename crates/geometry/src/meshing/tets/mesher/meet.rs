//! Where surfaces meet: points and segments that they get in common.
//!
//! Points that lie on a facet or segment become theirs, segments are cut where they go through facets or meet others, and
//! facets get the segments along which they cut each other. What is nearer than a tolerance is one: then both surfaces have the
//! very same points, and no distance is left that rounding could turn around.

use super::MeshError;
use super::complex::{Complex, in_polygon};
use super::delaunay::sorted;
use crate::import::intersect::{Frame, Search};
use elastocap_linalg::vector::{dot, length, minus};
use std::collections::{BTreeMap, BTreeSet, HashMap};

type P = [f64; 3];

/// What is nearer than this part of the shortest segment is one point.
const NEAR: f64 = 1e-6;

/// That distance over the extent of everything: no smaller, no larger.
const NEAREST: [f64; 2] = [1e-13, 1e-8];

/// A crossing this near to an end of a segment, over its length, is at the end where the segment is of a ball, whose corners
/// may move a little.
const MERGED: f64 = 2e-3;

/// Lines of one round may meet further surfaces in the next: each new point lies on one facet more.
const ROUNDS: usize = 12;

/// The owner of walls.
pub(super) const NOBODY: u32 = u32::MAX;

struct Meeting<'a> {
    complex: &'a mut Complex,
    near: f64,
    frame: Frame,
    /// The facet and the place within it of each polygon in `search`.
    polygons: Vec<(u32, usize)>,
    search: Search,
    /// Points by the cells of a grid.
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Facets that may have a new line in common.
    pairs: BTreeSet<[u32; 2]>,
    stack: Vec<u32>,
}

/// Gives all surfaces the points and segments in which they meet.
///
/// # Errors
/// Two conductors that have a point in common.
pub(super) fn resolve(complex: &mut Complex) -> Result<(), MeshError> {
    let mut meeting = Meeting::new(complex);
    meeting.run()?;
    meeting.clear_seeds();
    meeting.shorts()
}

/// The points and `near` around them.
fn padded(points: &[P], near: f64) -> [P; 2] {
    [(f64::min as fn(f64, f64) -> f64, -near), (f64::max, near)].map(|(pick, by)| {
        [0, 1, 2].map(|k| points.iter().skip(1).fold(points[0][k], |m, p| pick(m, p[k])) + by)
    })
}

/// Where the point is along a segment, from 0 to 1, and its distance from it.
fn along(p: P, [a, b]: [P; 2]) -> (f64, f64) {
    let (u, v) = (minus(b, a), minus(p, a));
    let s = (dot(u, v) / dot(u, u)).clamp(0.0, 1.0);
    (s, length([0, 1, 2].map(|k| v[k] - s * u[k])))
}

fn between([a, b]: [P; 2], s: f64) -> P {
    [0, 1, 2].map(|k| if a[k] == b[k] { a[k] } else { a[k] + s * (b[k] - a[k]) })
}

/// Whether a point lies in a polygon or nearly on its outline.
fn within(polygon: &[[f64; 2]], q: [f64; 2], near: f64) -> bool {
    let at = |p: [f64; 2]| [p[0], p[1], 0.0];
    in_polygon(polygon, q)
        || (0..polygon.len()).any(|k| {
            let ends = [polygon[k], polygon[(k + 1) % polygon.len()]];
            let out = |a: usize| {
                q[a] < ends[0][a].min(ends[1][a]) - near || q[a] > ends[0][a].max(ends[1][a]) + near
            };
            !out(0) && !out(1) && along(at(q), ends.map(at)).1 <= near
        })
}

impl<'a> Meeting<'a> {
    fn new(complex: &'a mut Complex) -> Self {
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
        let near = (NEAR * shortest).clamp(NEAREST[0] * whole, NEAREST[1] * whole);
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
        };
        for p in 0..out.complex.points.len() as u32 {
            let cell = out.cell(out.complex.points[p as usize]);
            out.cells.entry(cell).or_default().push(p);
        }
        out.index();
        out
    }

    /// Fills the tree of polygons.
    fn index(&mut self) {
        self.polygons.clear();
        let mut boxes = Vec::new();
        for (f, facet) in self.complex.facets.iter().enumerate() {
            for (k, polygon) in facet.polygons.iter().enumerate() {
                let corners: Vec<P> = polygon.iter().map(|&q| facet.raise(q)).collect();
                boxes.push(self.frame.bounds(&padded(&corners, self.near)));
                self.polygons.push((f as u32, k));
            }
        }
        self.search = Search::of(boxes);
    }

    fn cell(&self, p: P) -> [i64; 3] {
        p.map(|x| (x / (4.0 * self.near)).floor() as i64)
    }

    fn ends(&self, segment: [u32; 2]) -> [P; 2] {
        segment.map(|p| self.complex.points[p as usize])
    }

    /// Polygons whose boxes meet that of the points, as facet and place within.
    fn candidates(&mut self, points: &[P]) -> Vec<(u32, usize)> {
        let mut out = Vec::new();
        let bounds = self.frame.bounds(&padded(points, self.near));
        self.search.near(&bounds, &mut self.stack, |k| out.push(self.polygons[k as usize]));
        out.sort_unstable();
        out
    }

    fn on(&self, point: u32, facet: u32) -> bool {
        self.complex.on[point as usize].contains(&facet)
    }

    /// Says that a point is on a facet, and moves it there where the facet is exact.
    fn touch(&mut self, point: u32, facet: u32) {
        if self.on(point, facet) {
            return;
        }
        for &other in &self.complex.on[point as usize] {
            self.pairs.insert(sorted(other, facet));
        }
        self.complex.touch(point, facet);
        if let Some((axis, at)) = self.complex.facets[facet as usize].plane {
            self.complex.points[point as usize][axis] = at;
        }
    }

    /// The point at that place or next to it; or one of `around` that is nearly there.
    fn point(&mut self, p: P, around: &[u32], merged: f64, size: f64) -> u32 {
        let [i, j, k] = self.cell(p);
        let away = |this: &Self, q: u32| length(minus(this.complex.points[q as usize], p));
        for n in 0..27 {
            let cell = [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1];
            let found = self.cells.get(&cell).into_iter().flatten();
            if let Some(&q) = found.into_iter().find(|&&q| away(self, q) <= self.near) {
                return q;
            }
        }
        let nearest = around.iter().copied().min_by(|&q, &r| away(self, q).total_cmp(&away(self, r)));
        if let Some(q) = nearest.filter(|&q| away(self, q) <= merged) {
            return q;
        }
        let new = self.complex.points.len() as u32;
        self.complex.points.push(p);
        self.complex.on.push(Vec::new());
        self.complex.sizes.push(size);
        self.cells.entry([i, j, k]).or_default().push(new);
        new
    }

    fn size(&self, ends: [u32; 2]) -> f64 {
        ends.iter().fold(f64::INFINITY, |s, &p| s.min(self.complex.sizes[p as usize]))
    }

    fn run(&mut self) -> Result<(), MeshError> {
        self.unite();
        let mut points: Vec<u32> = (0..self.complex.points.len() as u32).collect();
        let mut segments: Vec<[u32; 2]> = self.complex.segments.keys().copied().collect();
        for _ in 0..ROUNDS {
            if points.is_empty() && segments.is_empty() {
                return Ok(());
            }
            let old = self.complex.points.len() as u32;
            self.points_on_facets(&points);
            let mut cuts = BTreeMap::new();
            self.segments_through_facets(&segments, &mut cuts);
            self.segments_on_segments(&points, &segments, &mut cuts);
            self.part(cuts);
            segments = self.lines();
            points = (old..self.complex.points.len() as u32).collect();
        }
        let at = points.first().map_or([0.0; 3], |&p| self.complex.points[p as usize]);
        Err(MeshError::Tangled { at })
    }

    /// Takes away seeds on a surface, or next to one: they are meant to be inside.
    fn clear_seeds(&mut self) {
        let seeds = std::mem::take(&mut self.complex.seeds);
        for (p, size) in seeds {
            let close = 0.3 * size;
            let [low, high] = padded(&[p], close);
            let near = self.candidates(&[low, high]).into_iter().any(|(f, k)| {
                let facet = &self.complex.facets[f as usize];
                facet.height(p).abs() <= close && within(&facet.polygons[k], facet.flat(p), close)
            });
            if !near {
                self.complex.seeds.push((p, size));
            }
        }
    }

    /// Makes one facet of tilted ones in one plane that touch: what overlaps is then no crossing.
    fn unite(&mut self) {
        let mut root: Vec<u32> = (0..self.complex.facets.len() as u32).collect();
        fn find(root: &mut [u32], mut f: u32) -> u32 {
            while root[f as usize] != f {
                root[f as usize] = root[root[f as usize] as usize];
                f = root[f as usize];
            }
            f
        }
        for k in 0..self.polygons.len() {
            let (f, i) = self.polygons[k];
            let facet = &self.complex.facets[f as usize];
            if facet.plane.is_some() {
                continue;
            }
            let corners: Vec<P> = facet.polygons[i].iter().map(|&q| facet.raise(q)).collect();
            let owner = facet.owners[i];
            for (g, j) in self.candidates(&corners) {
                let (facet, other) = (&self.complex.facets[f as usize], &self.complex.facets[g as usize]);
                if g <= f || other.plane.is_some() || other.owners[j] == owner {
                    continue;
                }
                let theirs = other.polygons[j].iter().map(|&q| other.raise(q));
                let flat = corners.iter().all(|&p| other.height(p).abs() <= self.near)
                    && theirs.into_iter().all(|p| facet.height(p).abs() <= self.near);
                if flat {
                    let (a, b) = (find(&mut root, f), find(&mut root, g));
                    root[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let root: Vec<u32> = (0..root.len() as u32).map(|f| find(&mut root, f)).collect();
        if root.iter().enumerate().all(|(f, &r)| f as u32 == r) {
            return;
        }
        for f in 0..root.len() {
            let to = root[f] as usize;
            if to != f {
                let gone = std::mem::take(&mut self.complex.facets[f].polygons);
                let owners = std::mem::take(&mut self.complex.facets[f].owners);
                for (polygon, owner) in gone.into_iter().zip(owners) {
                    let corners: Vec<P> = polygon.iter().map(|&q| self.complex.facets[f].raise(q)).collect();
                    self.complex.area(to as u32, &corners, owner);
                }
            }
        }
        let rename = |list: &mut Vec<u32>| {
            list.iter_mut().for_each(|f| *f = root[*f as usize]);
            list.sort_unstable();
            list.dedup();
        };
        self.complex.on.iter_mut().for_each(rename);
        self.complex.segments.values_mut().for_each(rename);
        self.index();
    }

    fn points_on_facets(&mut self, points: &[u32]) {
        for &p in points {
            let at = self.complex.points[p as usize];
            for (f, k) in self.candidates(&[at]) {
                let facet = &self.complex.facets[f as usize];
                if !self.on(p, f)
                    && facet.height(at).abs() <= self.near
                    && within(&facet.polygons[k], facet.flat(at), self.near)
                {
                    self.touch(p, f);
                }
            }
        }
    }

    fn segments_through_facets(&mut self, segments: &[[u32; 2]], cuts: &mut BTreeMap<[u32; 2], Vec<u32>>) {
        for &segment in segments {
            let ends = self.ends(segment);
            for (f, k) in self.candidates(&ends) {
                if segment.iter().any(|&p| self.on(p, f)) {
                    continue;
                }
                let facet = &self.complex.facets[f as usize];
                let [over, under] = ends.map(|p| facet.height(p));
                if over * under >= 0.0 {
                    continue;
                }
                let mut at = between(ends, over / (over - under));
                if !within(&facet.polygons[k], facet.flat(at), self.near) {
                    continue;
                }
                let owner = facet.owners[k];
                let facets = self.complex.segments.get(&segment).cloned().unwrap_or_default();
                for &g in facets.iter().chain([&f]) {
                    if let Some((axis, x)) = self.complex.facets[g as usize].plane {
                        at[axis] = x;
                    }
                }
                let of = |g: &u32| self.complex.facets[*g as usize].owners.iter().copied();
                let owners: Vec<u32> = facets.iter().flat_map(of).collect();
                let others = owners.iter().copied().filter(|&o| o != owner);
                self.complex.crossed.extend(others.map(|o| sorted(o, owner)));
                let ball = |o: &u32| self.complex.bodies.get(*o as usize).is_some_and(|b| b.ball);
                let merged =
                    if owners.iter().all(ball) { MERGED * length(minus(ends[1], ends[0])) } else { 0.0 };
                let v = self.point(at, &segment, merged, self.size(segment));
                self.touch(v, f);
                if !segment.contains(&v) {
                    facets.iter().for_each(|&g| self.touch(v, g));
                    cuts.entry(segment).or_default().push(v);
                }
            }
        }
    }

    fn segments_on_segments(
        &mut self,
        points: &[u32],
        segments: &[[u32; 2]],
        cuts: &mut BTreeMap<[u32; 2], Vec<u32>>,
    ) {
        let all: Vec<[u32; 2]> = self.complex.segments.keys().copied().collect();
        let boxes = all.iter().map(|&s| self.frame.bounds(&padded(&self.ends(s), self.near))).collect();
        let search = Search::of(boxes);
        let near = |this: &mut Self, points: &[P]| {
            let mut found = Vec::new();
            let bounds = this.frame.bounds(&padded(points, this.near));
            search.near(&bounds, &mut this.stack, |k| found.push(all[k as usize]));
            found.sort_unstable();
            found
        };
        for &p in points {
            let at = self.complex.points[p as usize];
            for segment in near(self, &[at]) {
                self.point_on_segment(p, segment, cuts);
            }
        }
        for &one in segments {
            for other in near(self, &self.ends(one)) {
                self.two_segments(one, other, cuts);
            }
        }
    }

    fn point_on_segment(
        &mut self,
        p: u32,
        segment: [u32; 2],
        cuts: &mut BTreeMap<[u32; 2], Vec<u32>>,
    ) -> bool {
        let at = self.complex.points[p as usize];
        if segment.contains(&p) || along(at, self.ends(segment)).1 > self.near {
            return false;
        }
        let facets = self.complex.segments.get(&segment).cloned().unwrap_or_default();
        facets.iter().for_each(|&f| self.touch(p, f));
        let cut = cuts.entry(segment).or_default();
        if !cut.contains(&p) {
            cut.push(p);
        }
        true
    }

    fn two_segments(&mut self, one: [u32; 2], other: [u32; 2], cuts: &mut BTreeMap<[u32; 2], Vec<u32>>) {
        if one == other {
            return;
        }
        let mut met = one.iter().any(|p| other.contains(p));
        for p in one {
            met |= self.point_on_segment(p, other, cuts);
        }
        for p in other {
            met |= self.point_on_segment(p, one, cuts);
        }
        if met {
            return;
        }
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
                let facets = self.complex.segments.get(&segment).cloned().unwrap_or_default();
                facets.iter().for_each(|&f| self.touch(new, f));
                let cut = cuts.entry(segment).or_default();
                if !cut.contains(&new) {
                    cut.push(new);
                }
            }
        }
    }

    /// Cuts segments at points on them.
    fn part(&mut self, cuts: BTreeMap<[u32; 2], Vec<u32>>) {
        for (segment, mut chain) in cuts {
            let Some(facets) = self.complex.segments.remove(&segment) else { continue };
            let ends = self.ends(segment);
            let place = |p: u32| along(self.complex.points[p as usize], ends).0;
            chain.extend(segment);
            chain.sort_by(|&p, &q| place(p).total_cmp(&place(q)).then(p.cmp(&q)));
            chain.dedup();
            for pair in chain.windows(2) {
                for &f in &facets {
                    self.touch(pair[0], f);
                    self.touch(pair[1], f);
                    self.complex.segment(pair[0], pair[1], f);
                }
            }
        }
    }

    /// Gives facets the segments between points that they have in common; those that are new.
    fn lines(&mut self) -> Vec<[u32; 2]> {
        let mut of_facet: Vec<Vec<u32>> = vec![Vec::new(); self.complex.facets.len()];
        for (p, on) in self.complex.on.iter().enumerate() {
            on.iter().for_each(|&f| of_facet[f as usize].push(p as u32));
        }
        let mut out = Vec::new();
        for [f, g] in std::mem::take(&mut self.pairs) {
            let (few, other) =
                if of_facet[f as usize].len() <= of_facet[g as usize].len() { (f, g) } else { (g, f) };
            let mut common: Vec<u32> =
                of_facet[few as usize].iter().copied().filter(|&p| self.on(p, other)).collect();
            let at = |p: u32| self.complex.points[p as usize];
            let Some(&first) = common.first() else { continue };
            let far = |from: P| {
                let away = |p: &u32| length(minus(at(*p), from));
                common.iter().copied().max_by(|p, q| away(p).total_cmp(&away(q)))
            };
            let Some(end) = far(at(first)) else { continue };
            let direction = minus(at(end), at(first));
            let place = |p: u32| dot(direction, minus(at(p), at(first)));
            common.sort_by(|&p, &q| place(p).total_cmp(&place(q)).then(p.cmp(&q)));
            for pair in common.windows(2) {
                let middle = between([at(pair[0]), at(pair[1])], 0.5);
                let covered = |f: u32| {
                    let facet = &self.complex.facets[f as usize];
                    let q = facet.flat(middle);
                    facet.height(middle).abs() <= 2.0 * self.near
                        && facet.polygons.iter().any(|polygon| within(polygon, q, self.near))
                };
                if covered(f) && covered(g) {
                    out.push(([pair[0], pair[1]], [f, g]));
                }
            }
        }
        let mut new = Vec::new();
        for ([a, b], facets) in out {
            if !self.complex.segments.contains_key(&sorted(a, b)) {
                new.push(sorted(a, b));
            }
            facets.iter().for_each(|&f| self.complex.segment(a, b, f));
        }
        new.sort_unstable();
        new.dedup();
        new
    }

    /// Refuses different conductors that have a point in common.
    fn shorts(&self) -> Result<(), MeshError> {
        let Complex { bodies, facets, points, on, .. } = &*self.complex;
        let conductor = |o: u32| bodies.get(o as usize).and_then(|b| b.conductor);
        let metal: Vec<Vec<u32>> = facets
            .iter()
            .map(|f| {
                let mut all: Vec<u32> = f.owners.iter().filter_map(|&o| conductor(o)).collect();
                all.sort_unstable();
                all.dedup();
                all
            })
            .collect();
        for (p, on) in on.iter().enumerate() {
            let mut all: Vec<u32> = on.iter().flat_map(|&f| metal[f as usize].iter().copied()).collect();
            all.sort_unstable();
            all.dedup();
            if all.len() < 2 {
                continue;
            }
            let holds = |c: &u32| {
                on.iter().any(|&f| {
                    let facet = &facets[f as usize];
                    let q = facet.flat(points[p]);
                    let own =
                        facet.polygons.iter().zip(&facet.owners).filter(|x| conductor(*x.1) == Some(*c));
                    metal[f as usize].contains(c) && own.into_iter().any(|x| within(x.0, q, self.near))
                })
            };
            all.retain(holds);
            if let [first, second, ..] = all[..] {
                let named = |c: u32| bodies.iter().find(|b| b.conductor == Some(c));
                let name = |c: u32| named(c).map_or_else(String::new, |b| b.name.clone());
                return Err(MeshError::Crossing { first: name(first), second: name(second), at: points[p] });
            }
        }
        Ok(())
    }
}

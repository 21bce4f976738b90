//! The surface of one body as flat faces, cut off at walls and cut along planes.

use super::Point;
use super::delaunay::sorted;
use super::piecewise_linear_complex::{PiecewiseLinearComplex, Sheet};
use crate::meshing::indices::OptionalIndex;
use crate::meshing::tets::determinant;
use crate::shapes::TriangleSurface;
use elastocap_linalg::vector::{length, normal};
use std::collections::{BTreeMap, HashMap};

/// A point this near to a wall, relative to the extent of its body, is on the wall. Not tuned: it only has to
/// lie above rounding errors and below distances that matter.
const SNAP: f64 = 1e-9;

/// A flat part of a surface.
#[derive(Debug, Clone)]
struct Face {
    /// Points that span the plane of the face.
    frame: Vec<u32>,
    /// The polygons of the face; their corners need not be points of the mesh.
    polygons: Vec<Vec<u32>>,
    /// The edges of the outline, each in ascending order.
    edges: Vec<[u32; 2]>,
    /// Points of the mesh inside the face.
    inner: Vec<u32>,
    /// The conductor that the face is, if it is a sheet.
    sheet: Option<u32>,
}

/// An edge that lies on a wall or a cutting plane.
#[derive(Debug, Clone, Copy)]
struct Rim {
    /// The ends of the edge.
    edge: [u32; 2],
    /// The axis that the plane is normal to.
    axis: usize,
    /// The coordinate of the plane along the axis, m.
    at: f64,
}

/// The surface of a body.
#[derive(Debug, Clone, Default)]
pub(super) struct BodySurface {
    /// Positions, m.
    points: Vec<Point>,
    /// The flat parts.
    faces: Vec<Face>,
    /// The edges on walls and cutting planes.
    rims: Vec<Rim>,
}

/// A cutting plane normal to an axis, and the side of it that is kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// The axis, 0 to 2.
    pub(super) axis: usize,
    /// The coordinate along the axis, m.
    pub(super) at: f64,
    /// Whether the part above the plane is kept, and not the one below.
    pub(super) above: bool,
}

/// Points at which edges meet a cutting plane, by the ends of the edge.
type Crossings = HashMap<[u32; 2], u32>;

/// For each triangle the flat part of the surface that it belongs to, named by one of its triangles:
/// neighbours in one plane belong to the same part.
pub(crate) fn flat_parts(surface: &TriangleSurface) -> Vec<usize> {
    let faces = &surface.faces;
    let point = |p: u32| surface.points[p as usize];
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (t, f) in faces.iter().enumerate() {
        for k in 0..3 {
            edges.entry(sorted(f[k], f[(k + 1) % 3])).or_default().push(t);
        }
    }
    let mut parent: Vec<usize> = (0..faces.len()).collect();
    fn root(parent: &mut [usize], mut t: usize) -> usize {
        while parent[t] != t {
            parent[t] = parent[parent[t]];
            t = parent[t];
        }
        t
    }
    let whole = extent(surface.points.iter().copied());
    let area = |t: usize| length(normal(faces[t].map(point)));
    for pair in edges.values().filter(|p| p.len() == 2) {
        let (s, t) = if area(pair[0]) >= area(pair[1]) { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
        let [a, b, c] = faces[s].map(point);
        let least = 1e-10 * whole * area(s);
        if faces[t].iter().all(|&p| determinant(a, b, c, point(p)).abs() < least) {
            let (x, y) = (root(&mut parent, s), root(&mut parent, t));
            parent[x.max(y)] = x.min(y);
        }
    }
    (0..faces.len()).map(|t| root(&mut parent, t)).collect()
}

/// The largest extent of the points along an axis, m.
fn extent(points: impl Iterator<Item = Point> + Clone) -> f64 {
    let along = |k: usize| {
        let [low, high] = points
            .clone()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
        high - low
    };
    (0..3).map(along).fold(0.0, f64::max)
}

impl BodySurface {
    /// A polygon extruded along an axis, or, between equal ends, a sheet: then `sheet` is its conductor.
    pub(super) fn prism(axis: usize, ends: [f64; 2], outline: &[[f64; 2]], sheet: Option<u32>) -> Self {
        let n = outline.len() as u32;
        let place = |z: f64, q: [f64; 2]| match axis {
            0 => [z, q[0], q[1]],
            1 => [q[0], z, q[1]],
            _ => [q[0], q[1], z],
        };
        let polygon = |corners: Vec<u32>, sheet| {
            let next = |k: usize| corners[(k + 1) % corners.len()];
            let edges = (0..corners.len()).map(|k| sorted(corners[k], next(k))).collect();
            Face { frame: corners.clone(), edges, inner: Vec::new(), sheet, polygons: vec![corners] }
        };
        let mut out = Self::default();
        let flat = ends[0] == ends[1];
        for z in &ends[..if flat { 1 } else { 2 }] {
            let first = out.points.len() as u32;
            out.points.extend(outline.iter().map(|&q| place(*z, q)));
            out.faces.push(polygon((first..first + n).collect(), sheet.filter(|_| flat)));
        }
        if !flat {
            let side = |k: u32| polygon(vec![k, (k + 1) % n, n + (k + 1) % n, n + k], None);
            out.faces.extend((0..n).map(side));
        }
        out
    }

    /// A surface of triangles. If `merge`, neighbours in one plane become one face.
    pub(super) fn triangles(surface: &TriangleSurface, merge: bool) -> Self {
        let parts = if merge { flat_parts(surface) } else { (0..surface.faces.len()).collect::<Vec<_>>() };
        let mut numbers: HashMap<usize, usize> = HashMap::new();
        let mut faces: Vec<Face> = Vec::new();
        let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (t, corners) in surface.faces.iter().enumerate() {
            let number = *numbers.entry(parts[t]).or_insert(faces.len());
            if number == faces.len() {
                let frame = surface.faces[parts[t]].to_vec();
                let (edges, inner) = (Vec::new(), Vec::new());
                faces.push(Face { frame, polygons: Vec::new(), edges, inner, sheet: None });
            }
            faces[number].polygons.push(corners.to_vec());
            faces[number].inner.extend(corners);
            for k in 0..3 {
                edges.entry(sorted(corners[k], corners[(k + 1) % 3])).or_default().push(number);
            }
        }
        for (edge, sides) in edges {
            if sides.len() != 2 || sides[0] != sides[1] {
                sides.into_iter().for_each(|f| faces[f].edges.push(edge));
            }
        }
        for face in &mut faces {
            face.inner.sort_unstable();
            face.inner.dedup();
        }
        Self { points: surface.points.clone(), faces, rims: Vec::new() }
    }

    /// Moves faces normal to an axis onto one of the `planes` of that axis where they differ from it by
    /// rounding. The planes of other faces normal to an axis are added to the list.
    pub(super) fn align(&mut self, planes: &mut [Vec<f64>; 3]) {
        let near = SNAP * extent(self.points.iter().copied());
        for face in &self.faces {
            for axis in 0..3 {
                let at = self.points[face.frame[0] as usize][axis];
                if face.frame.iter().any(|&p| self.points[p as usize][axis] != at) {
                    continue;
                }
                let Some(&to) = planes[axis].iter().find(|&&x| (x - at).abs() <= near) else {
                    planes[axis].push(at);
                    continue;
                };
                self.points.iter_mut().filter(|p| p[axis] == at).for_each(|p| p[axis] = to);
            }
        }
    }

    /// The parts of the surface on either side of a plane, or the whole surface if it lies on one side.
    /// `None` if it is not closed.
    pub(super) fn split(mut self, axis: usize, at: f64) -> Option<Vec<Self>> {
        let near = SNAP * extent(self.points.iter().copied());
        let used =
            || self.faces.iter().flat_map(|f| f.edges.as_flattened()).map(|&p| self.points[p as usize][axis]);
        if !(used().any(|x| x < at - near) && used().any(|x| x > at + near)) {
            return Some(vec![self]);
        }
        let mut other = self.clone();
        self.cut(Cut { axis, at, above: false })?;
        other.cut(Cut { axis, at, above: true })?;
        Some(vec![self, other])
    }

    /// A corner that lies in a plane normal to an axis, m.
    pub(super) fn point_in_plane(&self, axis: usize, at: f64) -> Option<Point> {
        let corners = self.faces.iter().flat_map(|f| f.edges.as_flattened());
        corners.map(|&p| self.points[p as usize]).find(|p| p[axis] == at)
    }

    /// Removes the part beyond a plane; points that differ from the plane by rounding move onto it. `None` if
    /// the surface is not closed.
    ///
    /// A point in the plane counts as beyond it. Faces in the plane stay.
    pub(super) fn cut(&mut self, cut: Cut) -> Option<()> {
        let Cut { axis, at, above } = cut;
        let near = SNAP * extent(self.points.iter().copied());
        for p in self.points.iter_mut().filter(|p| (p[axis] - at).abs() <= near) {
            p[axis] = at;
        }
        let mut crossings = Crossings::new();
        for mut face in std::mem::take(&mut self.faces) {
            let corners = || face.polygons.iter().flatten().map(|&p| self.points[p as usize]);
            let beyond = |p: &Point| if above { p[axis] <= at } else { p[axis] >= at };
            if corners().all(|p| p[axis] == at) || corners().all(|p| !beyond(&p)) {
                self.faces.push(face);
                continue;
            }
            if corners().all(|p| beyond(&p)) {
                continue;
            }
            let mut ends = Vec::new();
            let mut edges = Vec::new();
            let mut marks = face.inner.clone();
            for &edge in &face.edges {
                marks.extend(edge);
                if let Some(RemainingEdge { edge, end_in_plane }) =
                    self.remaining_edge(edge, cut, &mut crossings)
                {
                    edges.push(edge);
                    ends.extend(end_in_plane);
                }
            }
            for edge in self.edges_in_plane(ends, marks, cut)? {
                edges.push(edge);
                self.rims.push(Rim { edge, axis, at });
            }
            face.edges = edges;
            face.polygons = face.polygons.iter().map(|p| self.clipped(p, cut, &mut crossings)).collect();
            face.polygons.retain(|p| p.len() > 2);
            face.inner.retain(|&p| self.stays(p, cut) || self.points[p as usize][axis] == at);
            self.faces.push(face);
        }
        for rim in std::mem::take(&mut self.rims) {
            if rim.axis == cut.axis && rim.at == cut.at {
                self.rims.push(rim);
            } else if let Some(RemainingEdge { edge, .. }) =
                self.remaining_edge(rim.edge, cut, &mut crossings)
            {
                self.rims.push(Rim { edge, ..rim });
            }
        }
        Some(())
    }

    /// Whether a point lies on the side of the plane that stays, not in the plane.
    fn stays(&self, p: u32, cut: Cut) -> bool {
        let x = self.points[p as usize][cut.axis];
        if cut.above { x > cut.at } else { x < cut.at }
    }

    /// The point where an edge meets the plane: one of its ends, or a new point between them.
    fn crossing(&mut self, [a, b]: [u32; 2], cut: Cut, crossings: &mut Crossings) -> u32 {
        let Cut { axis, at, .. } = cut;
        let [a, b] = sorted(a, b);
        let [p, q] = [a, b].map(|i| self.points[i as usize]);
        if let Some(end) = [(a, p), (b, q)].into_iter().find(|e| e.1[axis] == at) {
            return end.0;
        }
        *crossings.entry([a, b]).or_insert_with(|| {
            let s = (at - p[axis]) / (q[axis] - p[axis]);
            let mut x = [0, 1, 2].map(|k| if p[k] == q[k] { p[k] } else { p[k] + s * (q[k] - p[k]) });
            x[axis] = at;
            self.points.push(x);
            self.points.len() as u32 - 1
        })
    }

    /// The part of an edge that a cut leaves, if any.
    fn remaining_edge(
        &mut self,
        [a, b]: [u32; 2],
        cut: Cut,
        crossings: &mut Crossings,
    ) -> Option<RemainingEdge> {
        match [a, b].map(|p| self.stays(p, cut)) {
            [true, true] => Some(RemainingEdge { edge: [a, b], end_in_plane: None }),
            [false, false] => None,
            [first, _] => {
                let end = self.crossing([a, b], cut, crossings);
                let edge = sorted(if first { a } else { b }, end);
                Some(RemainingEdge { edge, end_in_plane: Some(end) })
            }
        }
    }

    /// The new edges of a face along the plane: between the points `ends` where its outline meets the plane,
    /// first to second, third to fourth and so on, divided at those `marks` that lie in the plane. `None` if
    /// the number of ends is odd.
    fn edges_in_plane(&self, mut ends: Vec<u32>, marks: Vec<u32>, cut: Cut) -> Option<Vec<[u32; 2]>> {
        let point = |p: u32| self.points[p as usize];
        let spread = |k: usize| {
            let coordinates = ends.iter().map(|&p| point(p)[k]);
            coordinates.clone().fold(f64::NEG_INFINITY, f64::max) - coordinates.fold(f64::INFINITY, f64::min)
        };
        let along = (0..3).max_by(|&a, &b| spread(a).total_cmp(&spread(b)))?;
        let order = |a: &u32, b: &u32| point(*a)[along].total_cmp(&point(*b)[along]);
        ends.sort_by(order);
        if !ends.len().is_multiple_of(2) {
            return None;
        }
        let mut marks: Vec<u32> = marks.into_iter().filter(|&p| point(p)[cut.axis] == cut.at).collect();
        marks.sort_by(|a, b| order(a, b).then(a.cmp(b)));
        marks.dedup();
        let mut out = Vec::new();
        for pair in ends.chunks_exact(2) {
            let mut last = pair[0];
            let inner = marks.iter().filter(|&&m| {
                point(pair[0])[along] < point(m)[along] && point(m)[along] < point(pair[1])[along]
            });
            for &next in inner.chain([&pair[1]]) {
                if next != last {
                    out.push(sorted(last, next));
                }
                last = next;
            }
        }
        Some(out)
    }

    /// The part of a polygon that a cut leaves (Sutherland and Hodgman, Commun. ACM 17, 1974). Parts of a
    /// polygon that is not convex stay joined along the plane.
    fn clipped(&mut self, polygon: &[u32], cut: Cut, crossings: &mut Crossings) -> Vec<u32> {
        let mut out = Vec::new();
        for (k, &a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            let [first, second] = [a, b].map(|p| self.stays(p, cut));
            if first {
                out.push(a);
            }
            if first != second {
                let end = self.crossing([a, b], cut, crossings);
                out.push(end);
            }
        }
        out.dedup();
        if out.len() > 1 && out.first() == out.last() {
            out.pop();
        }
        out
    }

    /// Adds the surface, as that of `part` and with elements of this size in m, to the complex. `None` if a
    /// face has no area.
    pub(super) fn add_to(&self, out: &mut PiecewiseLinearComplex, part: u32, size: f64) -> Option<()> {
        let mut used = vec![false; self.points.len()];
        for face in &self.faces {
            face.edges.as_flattened().iter().chain(&face.inner).for_each(|&p| used[p as usize] = true);
        }
        let numbers: Vec<OptionalIndex> = self
            .points
            .iter()
            .zip(used)
            .map(
                |(&p, used)| if used { OptionalIndex::some(out.point(p, size)) } else { OptionalIndex::NONE },
            )
            .collect();
        let number = |p: u32| numbers[p as usize].get();
        let places = |of: &[u32]| of.iter().map(|&p| self.points[p as usize]).collect::<Vec<_>>();
        for face in &self.faces {
            let facet = out.facet(&places(&face.frame))?;
            for polygon in &face.polygons {
                let polygon = out.add_polygon(facet, &places(polygon), Some(part));
                let sheet = face.sheet.map(|conductor| Sheet { conductor, polygon });
                out.facets[facet as usize].sheets.extend(sheet);
            }
            for &p in &face.inner {
                out.put_on_facet(number(p)?, facet);
            }
            for &[a, b] in &face.edges {
                out.add_segment(number(a)?, number(b)?, facet);
            }
        }
        for &Rim { edge: [a, b], axis, at } in &self.rims {
            let plane = out.plane(axis, at);
            out.add_segment(number(a)?, number(b)?, plane);
        }
        Some(())
    }
}

/// The part of an edge that a cut leaves.
struct RemainingEdge {
    /// The ends of that part.
    edge: [u32; 2],
    /// Its new end in the plane, if it has one.
    end_in_plane: Option<u32>,
}

//! Surfaces of bodies as flat faces, and what a wall leaves of them.

use super::complex::Complex;
use super::delaunay::sorted;
use crate::shapes::TriangleSurface;
use elastocap_linalg::vector::{length, normal};
use std::collections::{BTreeMap, HashMap};

type P = [f64; 3];

/// A point this near to a wall, relative to the extent of its body, is on the wall.
const SNAP: f64 = 1e-9;

/// A flat part of a surface.
#[derive(Debug, Clone)]
struct Face {
    /// Points that span its plane.
    frame: Vec<u32>,
    /// What it covers; corners need not be points of the mesh.
    polygons: Vec<Vec<u32>>,
    /// Around it.
    edges: Vec<[u32; 2]>,
    /// Points of the mesh within.
    inner: Vec<u32>,
    /// The conductor that it is all of.
    sheet: Option<u32>,
}

/// The surface of a body.
#[derive(Debug, Clone, Default)]
pub(super) struct Skin {
    points: Vec<P>,
    faces: Vec<Face>,
    /// Edges on a wall: the axis that it is normal to, and where it is.
    rims: Vec<([u32; 2], usize, f64)>,
}

/// A plane normal to an axis, and which side of it stays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub(super) axis: usize,
    pub(super) at: f64,
    /// Whether what lies above stays.
    pub(super) above: bool,
}

/// The flat part that each triangle belongs to, by a triangle of it: neighbours in one plane are of one part.
pub(crate) fn flat_parts(surface: &TriangleSurface) -> Vec<usize> {
    let faces = &surface.faces;
    let at = |p: u32| surface.points[p as usize];
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
    let area = |t: usize| length(normal(faces[t].map(at)));
    for pair in edges.values().filter(|p| p.len() == 2) {
        let (s, t) = if area(pair[0]) >= area(pair[1]) { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
        let [a, b, c] = faces[s].map(at);
        let least = 1e-10 * whole * area(s);
        if faces[t].iter().all(|&p| crate::meshing::tets::determinant(a, b, c, at(p)).abs() < least) {
            let (x, y) = (root(&mut parent, s), root(&mut parent, t));
            parent[x.max(y)] = x.min(y);
        }
    }
    (0..faces.len()).map(|t| root(&mut parent, t)).collect()
}

fn extent(points: impl Iterator<Item = P> + Clone) -> f64 {
    let along = |k: usize| {
        let [low, high] = points
            .clone()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
        high - low
    };
    (0..3).map(along).fold(0.0, f64::max)
}

impl Skin {
    /// A polygon pulled along an axis, or, between equal ends, the sheet of a conductor.
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

    /// A surface of triangles; neighbours in one plane become one face if `merge`.
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

    /// Brings flat ends that are next to one of the planes normal to an axis onto it, and adds those that are next to none.
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

    /// The parts on either side of a plane where it has something on both, else all of it. `None` if the surface is not closed.
    pub(super) fn parted(mut self, axis: usize, at: f64) -> Option<Vec<Self>> {
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

    /// A point of the skin in the plane.
    pub(super) fn touches(&self, axis: usize, at: f64) -> Option<P> {
        let corners = self.faces.iter().flat_map(|f| f.edges.as_flattened());
        corners.map(|&p| self.points[p as usize]).find(|p| p[axis] == at)
    }

    /// Takes away what lies beyond a wall; points that are next to it move onto it. `None` if the surface is not closed.
    ///
    /// A point in the plane counts as beyond it. So does a face there, which stays nevertheless.
    pub(super) fn cut(&mut self, cut: Cut) -> Option<()> {
        let Cut { axis, at, above } = cut;
        let near = SNAP * extent(self.points.iter().copied());
        for p in self.points.iter_mut().filter(|p| (p[axis] - at).abs() <= near) {
            p[axis] = at;
        }
        let mut known: HashMap<[u32; 2], u32> = HashMap::new();
        for mut face in std::mem::take(&mut self.faces) {
            let corners = || face.polygons.iter().flatten().map(|&p| self.points[p as usize]);
            let beyond = |p: &P| if above { p[axis] <= at } else { p[axis] >= at };
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
                match self.kept(edge, cut, &mut known) {
                    Some((edge, None)) => edges.push(edge),
                    Some((edge, Some(end))) => {
                        edges.push(edge);
                        ends.push(end);
                    }
                    None => {}
                }
            }
            for rim in self.between(ends, marks, cut)? {
                edges.push(rim);
                self.rims.push((rim, axis, at));
            }
            face.edges = edges;
            face.polygons = face.polygons.iter().map(|p| self.clipped(p, cut, &mut known)).collect();
            face.polygons.retain(|p| p.len() > 2);
            face.inner.retain(|&p| self.within(p, cut) || self.points[p as usize][axis] == at);
            self.faces.push(face);
        }
        for (edge, axis, at) in std::mem::take(&mut self.rims) {
            let here = axis == cut.axis && at == cut.at;
            if here {
                self.rims.push((edge, axis, at));
            } else if let Some((edge, _)) = self.kept(edge, cut, &mut known) {
                self.rims.push((edge, axis, at));
            }
        }
        Some(())
    }

    fn within(&self, p: u32, cut: Cut) -> bool {
        let x = self.points[p as usize][cut.axis];
        if cut.above { x > cut.at } else { x < cut.at }
    }

    /// Where an edge meets the plane: the end in it, or a point between.
    fn crossing(&mut self, [a, b]: [u32; 2], cut: Cut, known: &mut HashMap<[u32; 2], u32>) -> u32 {
        let Cut { axis, at, .. } = cut;
        let [a, b] = sorted(a, b);
        let [p, q] = [a, b].map(|i| self.points[i as usize]);
        if let Some(end) = [(a, p), (b, q)].into_iter().find(|e| e.1[axis] == at) {
            return end.0;
        }
        *known.entry([a, b]).or_insert_with(|| {
            let s = (at - p[axis]) / (q[axis] - p[axis]);
            let mut x = [0, 1, 2].map(|k| if p[k] == q[k] { p[k] } else { p[k] + s * (q[k] - p[k]) });
            x[axis] = at;
            self.points.push(x);
            self.points.len() as u32 - 1
        })
    }

    /// What is left of an edge, and its end in the plane if there is one.
    fn kept(
        &mut self,
        [a, b]: [u32; 2],
        cut: Cut,
        known: &mut HashMap<[u32; 2], u32>,
    ) -> Option<([u32; 2], Option<u32>)> {
        match [a, b].map(|p| self.within(p, cut)) {
            [true, true] => Some(([a, b], None)),
            [false, false] => None,
            [first, _] => {
                let end = self.crossing([a, b], cut, known);
                Some((sorted(if first { a } else { b }, end), Some(end)))
            }
        }
    }

    /// The edges of a face in the plane, from where its outline meets the plane; `marks` in the plane cut them.
    fn between(&self, mut ends: Vec<u32>, marks: Vec<u32>, cut: Cut) -> Option<Vec<[u32; 2]>> {
        let at = |p: u32| self.points[p as usize];
        let spread = |k: usize| {
            let all = ends.iter().map(|&p| at(p)[k]);
            all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
        };
        let along = (0..3).max_by(|&a, &b| spread(a).total_cmp(&spread(b)))?;
        let order = |a: &u32, b: &u32| at(*a)[along].total_cmp(&at(*b)[along]);
        ends.sort_by(order);
        if !ends.len().is_multiple_of(2) {
            return None;
        }
        let mut marks: Vec<u32> = marks.into_iter().filter(|&p| at(p)[cut.axis] == cut.at).collect();
        marks.sort_by(|a, b| order(a, b).then(a.cmp(b)));
        marks.dedup();
        let mut out = Vec::new();
        for pair in ends.chunks_exact(2) {
            let mut last = pair[0];
            let inner = marks
                .iter()
                .filter(|&&m| at(pair[0])[along] < at(m)[along] && at(m)[along] < at(pair[1])[along]);
            for &next in inner.chain([&pair[1]]) {
                if next != last {
                    out.push(sorted(last, next));
                }
                last = next;
            }
        }
        Some(out)
    }

    /// What is left of a polygon (Sutherland, Hodgman): parts of one that is not convex stay joined along the plane.
    fn clipped(&mut self, polygon: &[u32], cut: Cut, known: &mut HashMap<[u32; 2], u32>) -> Vec<u32> {
        let mut out = Vec::new();
        for (k, &a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            let [first, second] = [a, b].map(|p| self.within(p, cut));
            if first {
                out.push(a);
            }
            if first != second {
                let end = self.crossing([a, b], cut, known);
                out.push(end);
            }
        }
        out.dedup();
        if out.len() > 1 && out.first() == out.last() {
            out.pop();
        }
        out
    }

    /// Adds the skin with elements of this size; `None` if a face has no area.
    pub(super) fn put(&self, out: &mut Complex, owner: u32, size: f64) -> Option<()> {
        let mut used = vec![false; self.points.len()];
        for face in &self.faces {
            face.edges.as_flattened().iter().chain(&face.inner).for_each(|&p| used[p as usize] = true);
        }
        let ids: Vec<u32> = (0..self.points.len())
            .map(|k| if used[k] { out.point(self.points[k], size) } else { u32::MAX })
            .collect();
        let places = |of: &[u32]| of.iter().map(|&p| self.points[p as usize]).collect::<Vec<_>>();
        for face in &self.faces {
            let facet = out.facet(&places(&face.frame))?;
            for polygon in &face.polygons {
                out.area(facet, &places(polygon), owner);
                let number = out.facets[facet as usize].polygons.len() - 1;
                out.facets[facet as usize].sheets.extend(face.sheet.map(|c| (c, number)));
            }
            for &p in &face.inner {
                out.touch(ids[p as usize], facet);
            }
            for &[a, b] in &face.edges {
                out.segment(ids[a as usize], ids[b as usize], facet);
            }
        }
        for &([a, b], axis, at) in &self.rims {
            let wall = out.plane(axis, at);
            out.segment(ids[a as usize], ids[b as usize], wall);
        }
        Some(())
    }
}

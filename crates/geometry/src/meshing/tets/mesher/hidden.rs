//! Faces with the same on both sides, such as those of a dielectric within a conductor or a later dielectric, are left out.

use super::complex::Complex;
use super::delaunay::sorted;
use super::meet::NOBODY;
use crate::scene::Box3;
use elastocap_linalg::vector::{length, minus, normal};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::{BTreeMap, BTreeSet, HashMap};

type P = [f64; 3];

/// How far beside a face its two sides are asked what fills them, over the size of a triangle of it.
const BESIDE: f64 = 1e-3;

/// A facet in triangles: the points of each, and whether it is part of the facet and has something else on its other side.
struct Cells {
    triangles: Vec<([u32; 3], bool)>,
}

/// Takes away what has the same `region` on both sides: faces, and segments and points that were only theirs.
///
/// Walls and planes with sheets stay whole.
pub(super) fn drop_hidden(complex: &mut Complex, domain: &Box3, region: impl Fn(P) -> i32) {
    let mut of_facet: Vec<Vec<u32>> = vec![Vec::new(); complex.facets.len()];
    for (p, on) in complex.on.iter().enumerate() {
        on.iter().for_each(|&f| of_facet[f as usize].push(p as u32));
    }
    let mut edges: Vec<Vec<[u32; 2]>> = vec![Vec::new(); complex.facets.len()];
    for (segment, facets) in &complex.segments {
        facets.iter().for_each(|&f| edges[f as usize].push(*segment));
    }
    // Facets in parts, and the points and edges of what stays of them.
    let mut points: HashMap<u32, BTreeSet<u32>> = HashMap::new();
    let mut sides: HashMap<u32, BTreeSet<[u32; 2]>> = HashMap::new();
    for f in 0..complex.facets.len() as u32 {
        let facet = &complex.facets[f as usize];
        let wall = facet.plane.is_some_and(|(a, at)| at == domain.min[a] || at == domain.max[a]);
        if wall || !facet.sheets.is_empty() || facet.polygons.is_empty() {
            continue;
        }
        let Some(cells) = cells(complex, f, &of_facet[f as usize], &edges[f as usize], &region) else {
            continue;
        };
        if cells.triangles.iter().all(|t| t.1) {
            continue;
        }
        let (own, around) = (points.entry(f).or_default(), sides.entry(f).or_default());
        let facet = &mut complex.facets[f as usize];
        facet.polygons.clear();
        facet.owners.clear();
        for (ids, _) in cells.triangles.iter().filter(|t| t.1) {
            let corners = ids.map(|p| complex.points[p as usize]);
            complex.area(f, &corners, NOBODY);
            own.extend(ids);
            around.extend([[0, 1], [1, 2], [2, 0]].map(|[i, j]| sorted(ids[i], ids[j])));
        }
    }
    for (p, on) in complex.on.iter_mut().enumerate() {
        on.retain(|f| points.get(f).is_none_or(|all| all.contains(&(p as u32))));
    }
    for (segment, facets) in &mut complex.segments {
        facets.retain(|f| sides.get(f).is_none_or(|all| all.contains(segment)));
    }
    complex.segments.retain(|_, facets| !facets.is_empty());
    renumber(complex);
}

/// Points that are on nothing any more go.
fn renumber(complex: &mut Complex) {
    let mut ids = vec![u32::MAX; complex.points.len()];
    let mut next = 0;
    for (p, id) in ids.iter_mut().enumerate() {
        if !complex.on[p].is_empty() {
            complex.points.swap(next, p);
            complex.on.swap(next, p);
            complex.sizes.swap(next, p);
            *id = next as u32;
            next += 1;
        }
    }
    complex.points.truncate(next);
    complex.on.truncate(next);
    complex.sizes.truncate(next);
    let all = std::mem::take(&mut complex.segments);
    let named = |s: [u32; 2]| s.map(|p| ids[p as usize]);
    complex.segments =
        all.into_iter().map(|(s, f)| (named(s), f)).map(|([a, b], f)| (sorted(a, b), f)).collect();
}

/// The triangles between the segments of a facet; none if they cannot be made.
fn cells(
    complex: &Complex,
    f: u32,
    points: &[u32],
    edges: &[[u32; 2]],
    region: &impl Fn(P) -> i32,
) -> Option<Cells> {
    let facet = &complex.facets[f as usize];
    let place = |p: u32| complex.points[p as usize];
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = BTreeMap::new();
    let mut ids: HashMap<usize, u32> = HashMap::new();
    for &p in points {
        let [x, y] = facet.flat(place(p));
        let v = cdt.insert(Point2::new(x, y)).ok()?;
        handles.insert(p, v);
        if ids.insert(v.index(), p).is_some() {
            return None;
        }
    }
    for [a, b] in edges {
        let (from, to) = (*handles.get(a)?, *handles.get(b)?);
        if !cdt.can_add_constraint(from, to) {
            return None;
        }
        cdt.add_constraint(from, to);
    }
    let mut triangles = Vec::new();
    let mut cell: HashMap<usize, usize> = HashMap::new();
    let mut visible = Vec::new();
    for face in cdt.inner_faces() {
        if cell.contains_key(&face.fix().index()) {
            continue;
        }
        let mut stack = vec![face];
        cell.insert(face.fix().index(), visible.len());
        let (mut best, mut corners) = (0.0, [[0.0; 3]; 3]);
        while let Some(face) = stack.pop() {
            let own = face.vertices().map(|v| ids.get(&v.fix().index()).copied());
            let [Some(a), Some(b), Some(c)] = own else { return None };
            triangles.push(([a, b, c], visible.len()));
            let at = [a, b, c].map(place);
            if width(at) > best {
                (best, corners) = (width(at), at);
            }
            for edge in face.adjacent_edges() {
                let Some(next) = edge.rev().face().as_inner() else { continue };
                if !edge.is_constraint_edge() && !cell.contains_key(&next.fix().index()) {
                    cell.insert(next.fix().index(), visible.len());
                    stack.push(next);
                }
            }
        }
        let middle = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0);
        let across = normal(corners);
        let step = BESIDE * best / length(across);
        let beside = |s: f64| [0, 1, 2].map(|k| middle[k] + s * step * across[k]);
        // What is too thin to be asked stays.
        visible.push(facet.holds(middle) && !(best > 0.0 && region(beside(1.0)) == region(beside(-1.0))));
    }
    Some(Cells { triangles: triangles.into_iter().map(|(t, k)| (t, visible[k])).collect() })
}

/// Twice the area of a triangle over its longest side.
fn width(corners: [P; 3]) -> f64 {
    let side = |i: usize| length(minus(corners[(i + 1) % 3], corners[i]));
    let longest = (0..3).map(side).fold(0.0, f64::max);
    if longest > 0.0 { length(normal(corners)) / longest } else { 0.0 }
}

//! Removal of faces with the same filling on both sides, such as those of a dielectric inside a conductor.

use super::Point;
use super::delaunay::sorted;
use super::piecewise_linear_complex::PiecewiseLinearComplex;
use super::region::Region;
use crate::meshing::indices::Renumbering;
use crate::scene::Box3;
use elastocap_linalg::vector::{length, minus, normal};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The distance from a face at which the filling of its two sides is sampled, relative to the width of its
/// widest triangle. It is not tuned.
const SAMPLE_DISTANCE: f64 = 1e-3;

/// A triangle of a facet.
struct Triangle {
    /// The corners.
    points: [u32; 3],
    /// Whether it is part of the facet and has different fillings on its two sides.
    visible: bool,
}

/// Removes faces with the same `region` on both sides, and segments and points that belonged to such faces
/// only.
///
/// Walls and planes with sheets stay whole.
pub(super) fn remove_hidden_faces(
    complex: &mut PiecewiseLinearComplex,
    domain: &Box3,
    region: impl Fn(Point) -> Region,
) {
    let of_facet = complex.points_of_facets();
    let mut edges: Vec<Vec<[u32; 2]>> = vec![Vec::new(); complex.facets.len()];
    for (segment, facets) in &complex.segments {
        facets.iter().for_each(|&f| edges[f as usize].push(*segment));
    }
    // The remaining points and edges of facets that lose triangles.
    let mut points: HashMap<u32, BTreeSet<u32>> = HashMap::new();
    let mut sides: HashMap<u32, BTreeSet<[u32; 2]>> = HashMap::new();
    for f in 0..complex.facets.len() as u32 {
        let facet = &complex.facets[f as usize];
        let is_wall = facet.plane.is_some_and(|plane| plane.is_side_of(domain));
        if is_wall || !facet.sheets.is_empty() || facet.polygons.is_empty() {
            continue;
        }
        let Some(triangles) = triangles(complex, f, &of_facet[f as usize], &edges[f as usize], &region)
        else {
            continue;
        };
        if triangles.iter().all(|t| t.visible) {
            continue;
        }
        let (on_facet, around) = (points.entry(f).or_default(), sides.entry(f).or_default());
        complex.facets[f as usize].polygons.clear();
        for Triangle { points: ids, .. } in triangles.into_iter().filter(|t| t.visible) {
            let corners = ids.map(|p| complex.points[p as usize]);
            complex.add_polygon(f, &corners, None);
            on_facet.extend(ids);
            around.extend([[0, 1], [1, 2], [2, 0]].map(|[i, j]| sorted(ids[i], ids[j])));
        }
    }
    for (p, facets) in (0..).zip(&mut complex.facets_of_point) {
        facets.retain(|f| points.get(f).is_none_or(|all| all.contains(&p)));
    }
    for (segment, facets) in &mut complex.segments {
        facets.retain(|f| sides.get(f).is_none_or(|all| all.contains(segment)));
    }
    complex.segments.retain(|_, facets| !facets.is_empty());
    remove_unused_points(complex);
}

/// Removes points that lie on no facet any more.
fn remove_unused_points(complex: &mut PiecewiseLinearComplex) {
    let mut numbers = Renumbering::new(complex.points.len());
    let mut count = 0;
    for p in 0..complex.points.len() {
        if !complex.facets_of_point[p].is_empty() {
            complex.points.swap(count, p);
            complex.facets_of_point.swap(count, p);
            complex.sizes.swap(count, p);
            numbers.number(p, || count += 1);
        }
    }
    complex.points.truncate(count);
    complex.facets_of_point.truncate(count);
    complex.sizes.truncate(count);
    let number = |p: u32| numbers.get(p as usize);
    complex.segments = std::mem::take(&mut complex.segments)
        .into_iter()
        .filter_map(|([a, b], facets)| Some((sorted(number(a)?, number(b)?), facets)))
        .collect();
}

/// The triangles into which its points and segments divide a facet; `None` if they cannot be triangulated.
///
/// Segments bound cells whose triangles are all visible or all hidden, so that only the widest triangle of
/// each cell is sampled.
fn triangles(
    complex: &PiecewiseLinearComplex,
    f: u32,
    points: &[u32],
    edges: &[[u32; 2]],
    region: &impl Fn(Point) -> Region,
) -> Option<Vec<Triangle>> {
    let facet = &complex.facets[f as usize];
    let place = |p: u32| complex.points[p as usize];
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = BTreeMap::new();
    let mut ids: HashMap<usize, u32> = HashMap::new();
    for &p in points {
        let [x, y] = facet.project(place(p));
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
            let vertices = face.vertices().map(|v| ids.get(&v.fix().index()).copied());
            let [Some(a), Some(b), Some(c)] = vertices else { return None };
            triangles.push(([a, b, c], visible.len()));
            let places = [a, b, c].map(place);
            if width(places) > best {
                (best, corners) = (width(places), places);
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
        let step = SAMPLE_DISTANCE * best / length(across);
        let beside = |s: f64| [0, 1, 2].map(|k| middle[k] + s * step * across[k]);
        // Cells too thin to be sampled stay.
        visible.push(facet.contains(middle) && !(best > 0.0 && region(beside(1.0)) == region(beside(-1.0))));
    }
    Some(triangles.into_iter().map(|(points, k)| Triangle { points, visible: visible[k] }).collect())
}

/// The height of a triangle over its longest side, m; zero for a degenerate one.
fn width(corners: [Point; 3]) -> f64 {
    let side = |i: usize| length(minus(corners[(i + 1) % 3], corners[i]));
    let longest = (0..3).map(side).fold(0.0, f64::max);
    if longest > 0.0 { length(normal(corners)) / longest } else { 0.0 }
}

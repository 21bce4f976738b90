//! `section_NNN.svg`: the potential in a plane through the gap.

use std::collections::HashMap;

use elastocap_coupling::outcome::StepResult;
use elastocap_geometry::export::body::BodyMesh;
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::vtk::FieldGrid;
use elastocap_geometry::scene::{Box3, across};

use crate::plot::{Axis, Scale, Section, SectionCell};

/// How much around the conductors is shown, as a share of their largest extent in the plane.
const AROUND: f64 = 0.3;
/// How far the plane lies from the middle, as a share of the conductors' extent: meshes that are mirrored in the middle have faces there,
/// which would be cut along themselves.
const BESIDE: f64 = 1.3e-4;

/// A plane at right angles to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plane {
    axis: usize,
    at: f64,
}

/// The name of a step's section.
pub(crate) fn section_file(index: usize) -> String {
    format!("section_{index:03}.svg")
}

/// A conductor or one of its parts: its name and its bounds.
type Metal = (String, Box3);

/// The conductors of a step with their bounds, those of curved ones from their surfaces.
fn metal(step: &StepResult) -> Vec<Metal> {
    let surfaces = (step.surfaces.iter())
        .filter(|body| matches!(body.role, BodyRole::Conductor | BodyRole::FloatingConductor));
    let bounds = |corners: &[[f64; 3]]| {
        corners.iter().map(|&p| Box3 { min: p, max: p }).reduce(|all, p| all.union(&p))
    };
    let of_surfaces: Vec<Metal> = surfaces
        .filter_map(|body| Some((body.name.clone(), bounds(body.triangles.as_flattened())?)))
        .collect();
    if !of_surfaces.is_empty() {
        return of_surfaces;
    }
    let Some(scene) = &step.scene else { return Vec::new() };
    let parts = scene
        .scene
        .conductors()
        .flat_map(|c| c.body.parts.iter().filter_map(|part| Some((c.body.name.clone(), part.bounds()?))));
    parts.collect()
}

/// Across x3 in the middle of the conductors; across x1 if they lie beside each other along x3.
fn plane(metal: &[Metal]) -> Option<Plane> {
    let all = metal.iter().map(|(_, bounds)| *bounds).reduce(|all, bounds| all.union(&bounds))?;
    let apart = |a: usize| {
        let pairs = metal.iter().flat_map(|p| metal.iter().map(move |q| (p, q)));
        let mut pairs = pairs.filter(|(p, q)| p.0 != q.0);
        pairs.any(|(p, q)| p.1.max[a] < q.1.min[a])
    };
    let axis = if apart(2) && !apart(0) && !apart(1) { 0 } else { 2 };
    let (low, high) = (all.min[axis], all.max[axis]);
    Some(Plane { axis, at: 0.5 * (low + high) + BESIDE * (high - low) })
}

/// A section through a field on a grid; `metal_ids` are the bodies that are metal.
pub(crate) fn of_grid(
    step: &StepResult,
    title: &str,
    grid: &FieldGrid,
    metal_ids: std::ops::Range<i32>,
) -> Option<Section> {
    let metal = metal(step);
    let plane = plane(&metal)?;
    let [p, q] = across(plane.axis);
    let nodes = &grid.axes[plane.axis];
    let layer = nodes.partition_point(|x| *x <= plane.at).checked_sub(1)?;
    let upper = *nodes.get(layer + 1)?;
    let t = (plane.at - nodes[layer]) / (upper - nodes[layer]);
    let counts = grid.axes.each_ref().map(Vec::len);
    let place = |i: usize, j: usize, k: usize| {
        let mut at = [0; 3];
        (at[p], at[q], at[plane.axis]) = (i, j, k);
        at
    };
    let potential = |i: usize, j: usize| {
        let value = |k: usize| {
            let [a, b, c] = place(i, j, k);
            grid.potential[(a * counts[1] + b) * counts[2] + c]
        };
        (1.0 - t) * value(layer) + t * value(layer + 1)
    };
    let mut cells = Vec::new();
    for i in 0..counts[p].saturating_sub(1) {
        for j in 0..counts[q].saturating_sub(1) {
            let [a, b, c] = place(i, j, layer);
            let body = grid.body_id[(a * (counts[1] - 1) + b) * (counts[2] - 1) + c];
            if metal_ids.contains(&body) {
                continue;
            }
            let corner = |(i, j): (usize, usize)| {
                let key = (body as u64) << 40 | (i as u64) << 20 | j as u64;
                (key, [grid.axes[p][i], grid.axes[q][j], potential(i, j)])
            };
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(corner);
            cells.push(SectionCell { corners: corners.into() });
        }
    }
    section(title, &metal, plane, cells)
}

/// A section through a field on tetrahedra.
pub(crate) fn of_tetrahedra(step: &StepResult, title: &str, mesh: &BodyMesh) -> Option<Section> {
    let metal = metal(step);
    let plane = plane(&metal)?;
    let [p, q] = across(plane.axis);
    let values = &mesh.arrays.iter().find(|array| array.name == "potential")?.values;
    let above: Vec<f64> = mesh.points.iter().map(|x| x[plane.axis] - plane.at).collect();
    let corner = |from: u32, to: u32| {
        let (a, b) = (from.min(to) as usize, from.max(to) as usize);
        let t = above[a] / (above[a] - above[b]);
        let between = |x: f64, y: f64| x + t * (y - x);
        let at = [p, q].map(|k| between(mesh.points[a][k], mesh.points[b][k]));
        ((a as u64) << 32 | b as u64, [at[0], at[1], between(values[a], values[b])])
    };
    let mut cells = Vec::new();
    for tet in mesh.nodes.chunks_exact(4) {
        let (high, low): (Vec<u32>, Vec<u32>) = tet.iter().partition(|n| above[**n as usize] >= 0.0);
        let corners = match (high.as_slice(), low.as_slice()) {
            ([a], [b, c, d]) | ([b, c, d], [a]) => vec![corner(*a, *b), corner(*a, *c), corner(*a, *d)],
            // Around the four sides between the two above and the two below.
            ([a, b], [c, d]) => vec![corner(*a, *c), corner(*a, *d), corner(*b, *d), corner(*b, *c)],
            _ => continue,
        };
        cells.push(SectionCell { corners });
    }
    section(title, &metal, plane, cells)
}

fn section(title: &str, metal: &[Metal], plane: Plane, cells: Vec<SectionCell>) -> Option<Section> {
    let [p, q] = across(plane.axis);
    let corners = || cells.iter().flat_map(|cell| cell.corners.iter().map(|(_, at)| [at[0], at[1]]));
    let cut: Vec<&Metal> = (metal.iter())
        .filter(|(_, b)| b.min[plane.axis] <= plane.at && plane.at <= b.max[plane.axis])
        .collect();
    let all = cut.iter().map(|(_, bounds)| *bounds).reduce(|all, bounds| all.union(&bounds))?;
    let margin = AROUND * all.extent(p).max(all.extent(q));
    // No farther than the field is known.
    let ends = |k: usize, a: usize| {
        let known = corners()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at[k]), high.max(at[k])));
        ((all.min[a] - margin).max(known.0), (all.max[a] + margin).min(known.1))
    };
    let window = [ends(0, p), ends(1, q)];
    if window.iter().any(|(low, high)| low.partial_cmp(high) != Some(std::cmp::Ordering::Less)) {
        return None;
    }
    let flat = cut.iter().filter(|(_, b)| b.extent(p) == 0.0 || b.extent(q) == 0.0);
    let sheets = flat.map(|(_, b)| [[b.min[p], b.min[q]], [b.max[p], b.max[q]]]).collect();
    let mut bounds: HashMap<&str, Box3> = HashMap::new();
    for (name, part) in cut {
        bounds.entry(name).and_modify(|all| *all = all.union(part)).or_insert(*part);
    }
    let middle = |b: &Box3| [p, q].map(|a| 0.5 * (b.min[a] + b.max[a]));
    let mut names: Vec<_> = bounds.iter().map(|(name, b)| ((*name).to_owned(), middle(b))).collect();
    names.sort_by(|a, b| a.0.cmp(&b.0));
    let axis = |a: usize| Axis { label: format!("x{}", a + 1), unit: "m".into(), scale: Scale::Linear };
    Some(Section { title: title.to_owned(), x: axis(p), y: axis(q), window, cells, sheets, names })
}

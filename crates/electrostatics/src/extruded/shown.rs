//! The mesh and the potentials of an extruded scene as tetrahedra with straight edges, for a viewer.

use super::layout::Layout;
use super::mesh::PlanMesh;
use crate::boxes::domain::Axis;
use elastocap_geometry::meshing::tets::{TetMesh, determinant};
use elastocap_geometry::scene::{Filling, Scene, across};
use std::collections::HashMap;

/// For each point of a mesh of tetrahedra the number of the point of the plan and of the node of the line at
/// which it is.
pub(super) type Places = Vec<(u32, u32)>;

/// The prisms over the triangles, each as three tetrahedra, without those in conductors; `part` is the scene
/// that was laid out.
pub(super) fn tetrahedra(part: &Scene, layout: &Layout, mesh: &PlanMesh, axis: &Axis) -> (TetMesh, Places) {
    let [p, q] = across(layout.axis);
    let coordinate = |x: f64, a: usize| {
        let place = layout.origin[a] + layout.unit * x;
        // Mirror planes are met to the last bit.
        let near =
            |wall: f64| wall.is_finite() && (place - wall).abs() <= 1e-12 * layout.unit.max(wall.abs());
        [part.domain.min[a], part.domain.max[a]].into_iter().find(|wall| near(*wall)).unwrap_or(place)
    };
    let mut out = TetMesh { center: layout.origin, ..TetMesh::default() };
    let mut places: Places = Vec::new();
    let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
    let lookup = part.lookup();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let column = mesh.column_of(t);
        let middle = triangle
            .iter()
            .fold([0.0; 2], |sum, c| [0, 1].map(|k| sum[k] + mesh.points[*c as usize][k] / 3.0));
        for m in (0..axis.intervals()).filter(|&m| column.conductor[m].is_none()) {
            let nodes = &axis.line.nodes[axis.cuts[m]..=axis.cuts[m + 1]];
            let mut point = [0.0; 3];
            (point[p], point[q]) = (coordinate(middle[0], p), coordinate(middle[1], q));
            point[layout.axis] = coordinate(0.5 * (nodes[0] + nodes[nodes.len() - 1]), layout.axis);
            let region = match lookup.body_at(point) {
                Filling::Dielectric(d) => d.index as u32 + 1,
                Filling::Background | Filling::Conductor(_) => 0,
            };
            for e in axis.cuts[m]..axis.cuts[m + 1] {
                let ends = [e as u32, e as u32 + 1].map(|node| {
                    triangle.map(|corner| {
                        *numbers.entry((corner, node)).or_insert_with(|| {
                            let plan = mesh.points[corner as usize];
                            let mut point = [0.0; 3];
                            (point[p], point[q]) = (coordinate(plan[0], p), coordinate(plan[1], q));
                            point[layout.axis] = coordinate(axis.line.nodes[node as usize], layout.axis);
                            out.points.push(point);
                            places.push((corner, node));
                            places.len() as u32 - 1
                        })
                    })
                });
                // Corners ascend in every triangle, so that neighbours cut their common face along the same
                // diagonal.
                let [[a, b, c], [d, e, f]] = ends;
                for tet in [[a, b, c, f], [a, b, f, e], [a, e, f, d]] {
                    let corners = tet.map(|p| out.points[p as usize]);
                    let [i, j, k, l] = tet;
                    let positive = determinant(corners[0], corners[1], corners[2], corners[3]) > 0.0;
                    out.tets.push(if positive { tet } else { [i, j, l, k] });
                    out.regions.push(region);
                }
            }
        }
    }
    (out, places)
}

/// Prisms of a mesh, those in conductors included.
pub(super) fn prisms(mesh: &PlanMesh, axis: &Axis) -> usize {
    mesh.triangles.len() * axis.line.elements()
}

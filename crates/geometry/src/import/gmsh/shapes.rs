//! Groups of a volume mesh as surfaces, for solvers that do not use the mesh itself.

use super::roles::bounds;
use super::{VolumeMesh, outward, sides};
use crate::recognition::outlines_in_plane;
use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};
use std::collections::{BTreeMap, BTreeSet};

/// Coordinates that differ by less than this share of the size of the mesh are one. Not tuned: it only has to
/// lie above rounding errors and below distances that matter.
const NEAR: f64 = 1e-12;

impl VolumeMesh {
    /// The bodies of a scene of physical groups, described by their surfaces, and the box in which the scene
    /// ends, which is [`Box3::SPACE`] where the scene is open.
    ///
    /// Coordinates that differ by rounding are made equal. A group of volumes, and a group of surfaces around
    /// a hollow of the mesh, become closed surfaces; a group of surfaces in a plane normal to an axis becomes
    /// a sheet. `None` where there are other groups, where the walls differ, where the outer faces do not
    /// form a box, or where a dielectric ends at open faces, behind which it may go on.
    pub fn bodies(&self, scene: &Scene) -> Option<(Vec<Body>, Box3)> {
        let wall = scene.walls[0][0];
        if scene.walls.iter().flatten().any(|other| *other != wall) {
            return None;
        }
        let faces = Faces::new(self);
        let parts = |body: &Body| -> Option<Vec<Shape>> {
            body.parts.iter().map(|part| faces.shape(part, body.is_conductor())).collect()
        };
        let bodies = scene.bodies.iter().map(|body| Some(Body { parts: parts(body)?, ..body.clone() }));
        let bodies: Vec<Body> = bodies.collect::<Option<_>>()?;
        let [min, max] = bounds(faces.points.iter())?;
        let hull = Box3 { min, max };
        let domain = match wall {
            Wall::Open => faces.end_in_background(scene).then_some(Box3::SPACE),
            Wall::Grounded | Wall::Insulated => faces.end_on_box(&hull, scene).then_some(hull),
        };
        Some((bodies, domain?))
    }
}

/// The faces of a mesh, and its points without differences that are due to rounding.
struct Faces<'a> {
    /// The mesh.
    mesh: &'a VolumeMesh,
    /// The points of the mesh after [`joined`], m.
    points: Vec<[f64; 3]>,
    /// The group of each face in a group of surfaces, by its corners in ascending order.
    grouped: BTreeMap<[u32; 3], u32>,
    /// The outer faces, which belong to only one tetrahedron, by their corners in ascending order: the
    /// corners anticlockwise as seen from outside, and the tetrahedron.
    outer: BTreeMap<[u32; 3], ([u32; 3], usize)>,
}

impl<'a> Faces<'a> {
    /// The faces of a mesh.
    fn new(mesh: &'a VolumeMesh) -> Self {
        let grouped =
            mesh.faces.iter().zip(&mesh.face_groups).map(|(face, group)| (ascending(*face), *group));
        let faces = sides(mesh, |_| true);
        let outer = faces.chunk_by(|a, b| a.0 == b.0).filter_map(|group| match group {
            [one] => Some((one.0, (outward(one), one.1 as usize / 4))),
            _ => None,
        });
        Self { mesh, points: joined(&mesh.points), grouped: grouped.collect(), outer: outer.collect() }
    }

    /// The numbers of the groups of a dimension that a shape names.
    fn groups(&self, shape: &Shape, dimension: u8) -> BTreeSet<u32> {
        let Shape::Physical(name) = shape else { return BTreeSet::new() };
        let groups = self.mesh.groups.iter().zip(1..);
        groups.filter(|(g, _)| g.dimension == dimension && g.name == *name).map(|(_, k)| k).collect()
    }

    /// The shape of the group that a [`Shape::Physical`] names; `None` where it has no such shape.
    fn shape(&self, shape: &Shape, is_conductor: bool) -> Option<Shape> {
        let volumes = self.groups(shape, 3);
        let surfaces = if is_conductor { self.groups(shape, 2) } else { BTreeSet::new() };
        let of_surfaces: Vec<[u32; 3]> = self
            .grouped
            .iter()
            .filter(|(_, group)| surfaces.contains(group))
            .map(|(face, _)| *face)
            .collect();
        let of_volumes = sides(self.mesh, |t| volumes.contains(&self.mesh.tet_groups[t]));
        match (of_volumes.is_empty(), of_surfaces.is_empty()) {
            (false, true) => {
                let alone = of_volumes.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() == 1);
                Some(self.closed(alone.map(|group| outward(&group[0])).collect()))
            }
            (true, false) => {
                let around: Vec<[u32; 3]> = of_surfaces
                    .iter()
                    .filter_map(|face| self.outer.get(face))
                    // The outside of the body is the inside of the mesh.
                    .map(|([a, b, c], _)| [*a, *c, *b])
                    .collect();
                match around.len() {
                    0 => self.sheet(&of_surfaces),
                    n if n == of_surfaces.len() => Some(self.closed(around)),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// The closed surface of some faces.
    fn closed(&self, mut faces: Vec<[u32; 3]>) -> Shape {
        let used: BTreeSet<u32> = faces.iter().flatten().copied().collect();
        let number: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
        let points = used.iter().map(|p| self.points[*p as usize]).collect();
        faces.iter_mut().for_each(|face| *face = face.map(|p| number[&p]));
        Shape::Surface(TriangleSurface { points, faces })
    }

    /// Faces in a plane normal to an axis, as one polygon without thickness.
    fn sheet(&self, faces: &[[u32; 3]]) -> Option<Shape> {
        let triangles: Vec<[[f64; 3]; 3]> =
            faces.iter().map(|face| face.map(|p| self.points[p as usize])).collect();
        let corner = triangles.first()?[0];
        let axis = (0..3).find(|a| triangles.iter().flatten().all(|p| p[*a] == corner[*a]))?;
        let [outline] = <[_; 1]>::try_from(outlines_in_plane(&triangles, axis)).ok()?;
        Some(Shape::Extrusion { axis, from: corner[axis], to: corner[axis], outline, arcs: Vec::new() })
    }

    /// The outer faces at which the field ends, which are those that belong to no conductor, each with its
    /// tetrahedron.
    fn field_ends(&self, scene: &Scene) -> impl Iterator<Item = ([u32; 3], usize)> {
        let parts: Vec<&Shape> = scene.conductor_parts().map(|(_, part)| part).collect();
        let groups: BTreeSet<u32> =
            parts.iter().flat_map(|part| [2, 3].into_iter().flat_map(|d| self.groups(part, d))).collect();
        self.outer.iter().filter_map(move |(face, (_, tet))| {
            let of_conductor = groups.contains(&self.mesh.tet_groups[*tet])
                || self.grouped.get(face).is_some_and(|group| groups.contains(group));
            (!of_conductor).then_some((*face, *tet))
        })
    }

    /// Whether all faces at which the field ends lie in the sides of a box.
    fn end_on_box(&self, hull: &Box3, scene: &Scene) -> bool {
        self.field_ends(scene).all(|(face, _)| {
            let corners = face.map(|p| self.points[p as usize]);
            (0..3).any(|a| [hull.min[a], hull.max[a]].iter().any(|end| corners.iter().all(|p| p[a] == *end)))
        })
    }

    /// Whether no dielectric is at any of the faces at which the field ends.
    fn end_in_background(&self, scene: &Scene) -> bool {
        let parts = scene.dielectrics().flat_map(|d| &d.body.parts);
        let groups: BTreeSet<u32> = parts.flat_map(|part| self.groups(part, 3)).collect();
        self.field_ends(scene).all(|(_, tet)| !groups.contains(&self.mesh.tet_groups[tet]))
    }
}

/// The corners of a face in ascending order.
fn ascending(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// The points, with coordinates along an axis that differ by rounding alone made equal.
fn joined(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut out = points.to_vec();
    let Some([min, max]) = bounds(points.iter()) else { return out };
    let near = NEAR * (0..3).map(|a| max[a] - min[a]).fold(0.0, f64::max);
    for a in 0..3 {
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|i, j| points[*i][a].total_cmp(&points[*j][a]));
        for pair in 1..order.len() {
            let [below, above] = [order[pair - 1], order[pair]];
            if points[above][a] - points[below][a] <= near {
                out[above][a] = out[below][a];
            }
        }
    }
    out
}

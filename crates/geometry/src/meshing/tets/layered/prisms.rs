//! Tetrahedra and boundary faces of the prisms over a triangulated pattern.

use super::{Body, LayeredError};
use crate::meshing::indices::Renumbering;
use crate::meshing::plane::PlaneMesh;
use crate::meshing::tets::beyond_mesh::permittivity_beyond;
use crate::meshing::tets::{BoundaryFace, FaceRole, TetMesh, determinant};
use crate::scene::across;
use crate::scene::{Scene, Wall};
use std::collections::BTreeMap;

/// The prisms of a scene: all triangles of the plane extruded through all layers.
pub(super) struct Prisms<'a> {
    /// The scene.
    pub(super) scene: &'a Scene,
    /// The axis along which triangles are extruded.
    pub(super) axis: usize,
    /// The triangles.
    pub(super) planar: PlaneMesh,
    /// Planes between the layers, ascending along the axis, m.
    pub(super) nodes: Vec<f64>,
    /// Parts of conductors, then of dielectrics.
    pub(super) bodies: Vec<Body>,
    /// For each outline, whether each triangle lies in it.
    pub(super) inside: Vec<Vec<bool>>,
    /// Where the rays to infinity start, m.
    pub(super) center: [f64; 3],
}

/// The conductor or region that fills a prism.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filling {
    /// The conductor with this index; then the prism is no part of the mesh.
    Conductor(usize),
    /// A region as in [`TetMesh::regions`].
    Region(u32),
}

impl Filling {
    /// Whether a conductor fills the prism.
    pub(super) fn is_conductor(self) -> bool {
        match self {
            Self::Conductor(_) => true,
            Self::Region(_) => false,
        }
    }
}

impl Prisms<'_> {
    /// Whether a triangle lies in the outline of a body.
    fn covers(&self, body: usize, triangle: usize) -> bool {
        self.bodies[body].outline.is_none_or(|outline| self.inside[outline][triangle])
    }

    /// What fills the prism over a triangle in a layer.
    ///
    /// # Errors
    /// [`LayeredError::Touching`] where two conductors fill it.
    fn filling(&self, triangle: usize, layer: usize) -> Result<Filling, LayeredError> {
        let fills = |k: usize| {
            let [low, high] = self.bodies[k].ends;
            low <= self.nodes[layer] && self.nodes[layer + 1] <= high && self.covers(k, triangle)
        };
        let mut filler = Filling::Region(0);
        for (k, body) in self.bodies.iter().enumerate() {
            match (filler, body.filling) {
                (Filling::Conductor(first), Filling::Conductor(other)) if first != other && fills(k) => {
                    return Err(touching(self.scene, first, other));
                }
                // Conductors come first, and later dielectrics override earlier ones.
                (Filling::Region(_), filling) if fills(k) => filler = filling,
                (Filling::Conductor(_) | Filling::Region(_), Filling::Conductor(_) | Filling::Region(_)) => {}
            }
        }
        Ok(filler)
    }

    /// The conductors with a sheet that covers a triangle at a plane.
    fn sheets(&self, triangle: usize, plane: usize) -> impl Iterator<Item = usize> {
        let ends = [self.nodes[plane]; 2];
        self.bodies.iter().enumerate().filter_map(move |(k, body)| match body.filling {
            Filling::Conductor(c) if body.ends == ends && self.covers(k, triangle) => Some(c),
            Filling::Conductor(_) | Filling::Region(_) => None,
        })
    }

    /// The role of a face in a wall; `None` if the wall is insulated.
    fn wall(&self, axis: usize, side: usize, corners: [[f64; 3]; 3]) -> Option<FaceRole> {
        match self.scene.walls[axis][side] {
            Wall::Insulated => None,
            Wall::Grounded => Some(FaceRole::Grounded),
            Wall::Open => {
                Some(FaceRole::Open { permittivity: permittivity_beyond(self.scene, self.center, corners) })
            }
        }
    }
}

/// Divides each prism that is not in a conductor into three tetrahedra, and gives faces on conductors and
/// walls their roles.
///
/// # Errors
/// [`LayeredError::Touching`] where two conductors share a prism or a point.
pub(super) fn prisms(parts: &Prisms) -> Result<TetMesh, LayeredError> {
    let (planar, nodes) = (&parts.planar, &parts.nodes);
    let layers = nodes.len() - 1;
    let [u, v] = across(parts.axis);
    let mut mesh = TetMesh { center: parts.center, ..TetMesh::default() };
    let mut numbers = Renumbering::new(planar.points.len() * nodes.len());
    let mut fillings = vec![Filling::Region(0); planar.triangles.len() * layers];
    let place = |p: u32, level: usize| {
        let mut point = [0.0; 3];
        point[u] = planar.points[p as usize][0];
        point[v] = planar.points[p as usize][1];
        point[parts.axis] = nodes[level];
        point
    };
    for (t, triangle) in planar.triangles.iter().enumerate() {
        let mut corners = *triangle;
        corners.sort_unstable();
        let [p, q, r] = corners;
        for layer in 0..layers {
            let filling = parts.filling(t, layer)?;
            fillings[t * layers + layer] = filling;
            let Filling::Region(region) = filling else { continue };
            for tet in [
                [(p, 0), (q, 0), (r, 0), (r, 1)],
                [(p, 0), (q, 0), (q, 1), (r, 1)],
                [(p, 0), (p, 1), (q, 1), (r, 1)],
            ] {
                let mut tet = tet.map(|(p, up)| {
                    let corner = p as usize * nodes.len() + layer + up;
                    numbers.number(corner, || mesh.points.push(place(p, layer + up)))
                });
                let [a, b, c, d] = tet.map(|p| mesh.points[p as usize]);
                if determinant(a, b, c, d) < 0.0 {
                    tet.swap(2, 3);
                }
                mesh.tets.push(tet);
                mesh.regions.push(region);
            }
        }
    }
    let mut faces = Faces { parts, numbers, fillings, layers, boundary: Vec::new() };
    faces.across_axis(&mesh.points)?;
    faces.along_axis(&mesh.points);
    mesh.boundary = faces.boundary;
    refuse_common_points(&mesh, parts.scene)?;
    Ok(mesh)
}

/// The error that two conductors touch.
fn touching(scene: &Scene, one: usize, other: usize) -> LayeredError {
    let [first, second] = [one.min(other), one.max(other)]
        .map(|k| scene.conductors().nth(k).map_or_else(String::new, |c| c.body.name.clone()));
    LayeredError::Touching { first, second }
}

/// Fails if two conductors share a point of the mesh.
fn refuse_common_points(mesh: &TetMesh, scene: &Scene) -> Result<(), LayeredError> {
    let mut conductors: Vec<Option<u32>> = vec![None; mesh.points.len()];
    for face in &mesh.boundary {
        let FaceRole::Conductor(k) = face.role else { continue };
        for p in face.face {
            if let Some(other) = conductors[p as usize].replace(k)
                && other != k
            {
                return Err(touching(scene, other as usize, k as usize));
            }
        }
    }
    Ok(())
}

/// The boundary faces among the faces of prisms.
struct Faces<'a> {
    /// The prisms.
    parts: &'a Prisms<'a>,
    /// Numbers of those points of the plane, at each level, that are points of the mesh.
    numbers: Renumbering,
    /// What fills each prism: all layers over the first triangle, then those over the next one.
    fillings: Vec<Filling>,
    /// The number of layers.
    layers: usize,
    /// The boundary faces found so far.
    boundary: Vec<BoundaryFace>,
}

impl Faces<'_> {
    /// The number of a point of the plane at a level; `None` if all prisms at it are in conductors.
    fn point(&self, p: u32, level: usize) -> Option<u32> {
        self.numbers.get(p as usize * self.parts.nodes.len() + level)
    }

    /// The numbers of three points, each given by its point of the plane and its level.
    fn face(&self, corners: [(u32, usize); 3]) -> Option<[u32; 3]> {
        let [a, b, c] = corners.map(|(p, level)| self.point(p, level));
        Some([a?, b?, c?])
    }

    /// The conductor on one of two sides, if the other one has no conductor.
    fn conductor_beside(sides: [Filling; 2]) -> Option<usize> {
        match sides {
            [Filling::Conductor(k), Filling::Region(_)] | [Filling::Region(_), Filling::Conductor(k)] => {
                Some(k)
            }
            [Filling::Conductor(_), Filling::Conductor(_)] | [Filling::Region(_), Filling::Region(_)] => None,
        }
    }

    /// Adds the faces normal to the axis.
    fn across_axis(&mut self, points: &[[f64; 3]]) -> Result<(), LayeredError> {
        for (t, triangle) in self.parts.planar.triangles.iter().enumerate() {
            for level in 0..=self.layers {
                let below = level.checked_sub(1).map(|layer| self.fillings[t * self.layers + layer]);
                let above = (level < self.layers).then(|| self.fillings[t * self.layers + level]);
                let held = [below, above].into_iter().flatten().filter_map(|f| match f {
                    Filling::Conductor(k) => Some(k),
                    Filling::Region(_) => None,
                });
                let mut conductors = held.chain(self.parts.sheets(t, level));
                let conductor = conductors.next();
                if let Some(first) = conductor
                    && let Some(other) = conductors.find(|&k| k != first)
                {
                    return Err(touching(self.parts.scene, first, other));
                }
                if ![below, above].iter().any(|f| matches!(f, Some(Filling::Region(_)))) {
                    continue;
                }
                let Some(face) = self.face(triangle.map(|p| (p, level))) else { continue };
                let role = conductor.map(|k| FaceRole::Conductor(k as u32));
                let role = role.or_else(|| {
                    let side = usize::from(above.is_none());
                    let end = below.is_none() || above.is_none();
                    end.then(|| self.parts.wall(self.parts.axis, side, face.map(|p| points[p as usize])))?
                });
                if let Some(role) = role {
                    self.boundary.push(BoundaryFace { face, role });
                }
            }
        }
        Ok(())
    }

    /// Adds the faces parallel to the axis.
    fn along_axis(&mut self, points: &[[f64; 3]]) {
        let planar = &self.parts.planar;
        let mut edges: BTreeMap<[u32; 2], [Option<usize>; 2]> = BTreeMap::new();
        for (t, &[a, b, c]) in planar.triangles.iter().enumerate() {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let sides = edges.entry([a.min(b), a.max(b)]).or_default();
                sides[usize::from(sides[0].is_some())] = Some(t);
            }
        }
        for ([p, q], sides) in edges {
            let [Some(one), other] = sides else { continue };
            for layer in 0..self.layers {
                let filling = |t: usize| self.fillings[t * self.layers + layer];
                let faces = [[(p, 0), (q, 0), (q, 1)], [(p, 0), (p, 1), (q, 1)]];
                let faces = faces.into_iter().filter_map(|f| self.face(f.map(|(p, up)| (p, layer + up))));
                let faces: Vec<[u32; 3]> = faces.collect();
                if let Some(other) = other {
                    let Some(k) = Self::conductor_beside([filling(one), filling(other)]) else { continue };
                    let role = FaceRole::Conductor(k as u32);
                    self.boundary.extend(faces.into_iter().map(|face| BoundaryFace { face, role }));
                } else if matches!(filling(one), Filling::Region(_)) {
                    let [a, b] = [p, q].map(|p| planar.points[p as usize]);
                    let middle = planar.triangles[one].map(|p| planar.points[p as usize]);
                    // The edge lies on the side of the frame that is normal to the direction in which it has
                    // no extent.
                    let k = usize::from((a[1] - b[1]).abs() < (a[0] - b[0]).abs());
                    let side = usize::from(middle.iter().all(|m| m[k] <= a[k]));
                    for face in faces {
                        let corners = face.map(|p| points[p as usize]);
                        if let Some(role) = self.parts.wall(across(self.parts.axis)[k], side, corners) {
                            self.boundary.push(BoundaryFace { face, role });
                        }
                    }
                }
            }
        }
    }
}

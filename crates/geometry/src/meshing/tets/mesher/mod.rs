//! A conforming mesh of tetrahedra for a scene of bodies of any shape.
//!
//! Every body becomes flat facets: boxes and imported triangles as they are, curved bodies by polygons and triangles that
//! enclose the same area or volume. A Delaunay triangulation of their corners gets more points until every edge and facet is in
//! it (`conform`); then until tetrahedra are small and round enough (`refine`), now with edges and facets kept.

mod bodies;
mod complex;
mod conform;
mod delaunay;
mod hidden;
mod meet;
mod quality;
mod refine;
mod skin;
mod thin;

use super::beyond_mesh::beyond;
use super::{BoundaryFace, FaceRole, TetMesh};
use crate::scene::{Box3, Scene, Wall};
use crate::shapes::Shape;
pub(crate) use bodies::bounds;
use conform::Work;
use delaunay::NONE;
use elastocap_linalg::vector::{length, minus};
use hidden::drop_hidden;
pub use quality::Quality;
pub(crate) use skin::flat_parts;

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizing {
    /// Size of elements at a body: relative to the radius of a round one, to the largest extent of any other.
    pub facet: f64,
    /// By how much the size of elements grows per distance from the bodies, below 1.
    pub growth: f64,
    /// Radius of the sphere around a tetrahedron, relative to its shortest edge, above which it is refined; at least 2 for
    /// refinement that ends by itself.
    pub radius_to_edge: f64,
    /// Size of the mesh in open space, relative to the largest extent of the scene.
    pub far: f64,
    /// Limit on the number of points.
    pub most_points: usize,
}

impl Default for Sizing {
    fn default() -> Self {
        Self { facet: 0.3, growth: 0.5, radius_to_edge: 2.0, far: 20.0, most_points: 500_000 }
    }
}

/// A mesh and what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Meshed {
    /// The mesh.
    pub mesh: TetMesh,
    /// Its shapes.
    pub quality: Quality,
    /// Whether sizes and shapes are as asked; `false` if the limit on points came first. The mesh conforms either way.
    pub refined: bool,
}

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A body that cannot be meshed.
    #[error("{body} has {what}; it cannot be meshed")]
    Unsupported {
        /// Its name.
        body: String,
        /// What is the matter.
        what: &'static str,
    },
    /// Two conductors, or one and a grounded wall, have a point in common.
    #[error("the surfaces of {first} and {second} touch or cross at ({}, {}, {}) m; keep them apart", at[0], at[1], at[2])]
    Crossing {
        /// One body.
        first: String,
        /// The other one.
        second: String,
        /// Where, m.
        at: [f64; 3],
    },
    /// Flat faces in place of the curved surfaces of two bodies cross all over.
    #[error(
        "{first} and {second} are so near to one another that flat faces in their place cross; let their surfaces be the same, or thicken what is between them"
    )]
    Near {
        /// One body.
        first: String,
        /// The other one.
        second: String,
    },
    /// Surfaces that cross in more ways than can be followed.
    #[error("too many surfaces cross at ({}, {}, {}) m; move one of the bodies there a little", at[0], at[1], at[2])]
    Tangled {
        /// Where, m.
        at: [f64; 3],
    },
    /// A surface could not be made of faces of tetrahedra.
    #[error("the mesh does not meet the surfaces at ({}, {}, {}) m with {points} points; look for surfaces that touch or cross there, or allow more points", at[0], at[1], at[2])]
    Unreachable {
        /// Where, m.
        at: [f64; 3],
        /// The number of points then.
        points: usize,
    },
    /// A tetrahedron without a volume is left.
    #[error("a tetrahedron at ({}, {}, {}) m is left without a volume; another size of elements may help", at[0], at[1], at[2])]
    Flat {
        /// Where, m.
        at: [f64; 3],
    },
    /// What is filled differently is not kept apart: a defect of the mesher, found before anything is computed from it.
    #[error("a surface has a gap near ({}, {}, {}) m, which is a defect of elastocap; a little finer or coarser sizes may help", at[0], at[1], at[2])]
    Leak {
        /// Where, m.
        at: [f64; 3],
    },
    /// The mesh ends where no wall is: a defect of the mesher, found before anything is computed from it.
    #[error("the mesh ends inside the walls at ({}, {}, {}) m, which is a defect of elastocap; a little finer or coarser sizes may help", at[0], at[1], at[2])]
    Torn {
        /// Where, m.
        at: [f64; 3],
    },
    /// Walls on both sides of one axis, open space along another: rays to infinity would hit the walls.
    #[error("open space between two opposite walls cannot be meshed; make one of the two open, or none")]
    OpenBetweenWalls,
    /// There is nothing with an extent.
    #[error("the scene has no body and no walls; add one")]
    Empty,
}

/// Makes a mesh of the space around the conductors.
///
/// Spheres become geodesic polyhedra of the ball's volume and cylinders prisms of the circle's area: their corners lie outside
/// by O(`facet`^2) of the radius. Boxes, extrusions and triangles are exact. Where a side is open, the mesh ends far out.
///
/// # Errors
///
/// Conductors that meet each other or a grounded wall, round bodies nearly but not quite in the same place, open space between
/// opposite walls, and surfaces that are not met within the limit on points. Other walls cut through bodies. Where bodies
/// overlap, conductors come before dielectrics, and later dielectrics before earlier ones.
pub fn mesh(scene: &Scene, sizing: &Sizing) -> Result<Meshed, MeshError> {
    let open = |a: usize| scene.walls[a].map(|w| w == Wall::Open);
    if (0..3).any(|a| open(a) == [false; 2]) && (0..3).any(|a| open(a) != [false; 2]) {
        return Err(MeshError::OpenBetweenWalls);
    }
    let domain = bodies::domain(scene, sizing)?;
    let filling = Filling::new(scene, sizing);
    let mut complex = bodies::complex(scene, &domain, sizing)?;
    if !complex.crossed.is_empty() {
        drop_hidden(&mut complex, &domain, |p| filling.at(p));
    }
    let mut work = Work::new(complex, domain.min, domain.max)?;
    work.conform(sizing)?;
    fill(&mut work, &filling)?;
    let refined = work.refine(sizing);
    work.smooth();
    work.unflatten(sizing).map_err(|at| MeshError::Flat { at })?;
    let mesh = collect(&work, scene, &domain)?;
    Ok(Meshed { quality: Quality::of(&mesh), mesh, refined })
}

/// So many tetrahedra of each part between surfaces are asked what they are filled with.
const ASKED: usize = 24;

/// Those that have this part of the volume of the largest one.
const LARGE: f64 = 1e-3;

/// What is where: the parts of bodies as they are meshed, each with the index of its conductor or dielectric.
struct Filling {
    conductors: Vec<(usize, Filled)>,
    dielectrics: Vec<(usize, Filled)>,
}

struct Filled {
    shape: Shape,
    /// Whether it is everything but the shape.
    hollow: bool,
    /// The middle of a ball, a radius within and one beyond all of its faces.
    round: Option<([f64; 3], [f64; 2])>,
}

impl Filled {
    fn new(shape: &Shape, sizing: &Sizing) -> Self {
        let off = 0.5 * sizing.facet * sizing.facet;
        let round = match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                Some((*center, [(1.0 - off) * radius, (1.0 + off) * radius]))
            }
            _ => None,
        };
        let hollow = matches!(shape, Shape::Shell { .. });
        Self { shape: bodies::flat(shape, sizing), hollow, round }
    }

    fn holds(&self, p: [f64; 3]) -> bool {
        if let Some((center, [inner, outer])) = self.round {
            let distance = length(minus(p, center));
            if distance < inner || distance > outer {
                return (distance < inner) != self.hollow;
            }
        }
        self.shape.contains(p) != self.hollow
    }
}

impl Filling {
    fn new(scene: &Scene, sizing: &Sizing) -> Self {
        Self {
            conductors: scene.conductor_parts().map(|(c, part)| (c, Filled::new(part, sizing))).collect(),
            dielectrics: scene.dielectric_parts().map(|(d, part)| (d, Filled::new(part, sizing))).collect(),
        }
    }

    /// 0 background, 1 + k dielectric k, -1 - k conductor k.
    fn at(&self, p: [f64; 3]) -> i32 {
        let conductor = self.conductors.iter().find(|(_, part)| part.holds(p));
        let dielectric = || self.dielectrics.iter().rfind(|(_, part)| part.holds(p));
        conductor.map_or_else(|| dielectric().map_or(0, |(d, _)| *d as i32 + 1), |(c, _)| -1 - *c as i32)
    }
}

/// Says what fills each tetrahedron.
fn fill(work: &mut Work, filling: &Filling) -> Result<(), MeshError> {
    let mesh = &mut work.mesh;
    let mut seen = vec![false; mesh.tets.len()];
    for first in 0..mesh.tets.len() as u32 {
        if seen[first as usize] || !mesh.alive(first) {
            continue;
        }
        seen[first as usize] = true;
        let mut part = vec![first];
        let mut next = 0;
        while next < part.len() {
            let t = part[next] as usize;
            next += 1;
            for i in 0..4 {
                let n = mesh.near[t][i];
                if n != NONE && mesh.walls[t][i] == 0 && !seen[n as usize] {
                    seen[n as usize] = true;
                    part.push(n);
                }
            }
        }
        // The middles of large ones are the safest places to ask; they must agree.
        let volume = |t: u32| {
            let [a, b, c, d] = mesh.corners(t);
            super::determinant(a, b, c, d)
        };
        let mut large: Vec<(f64, u32)> = part.iter().map(|&t| (volume(t), t)).collect();
        large.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let least = large.first().map_or(0.0, |l| LARGE * l.0);
        large.retain(|l| l.0 >= least);
        let mut found = None;
        for (_, t) in large.iter().step_by(large.len().div_ceil(ASKED).max(1)) {
            let corners = mesh.corners(*t);
            let middle = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            let region = filling.at(middle);
            if *found.get_or_insert(region) != region {
                return Err(MeshError::Leak { at: middle });
            }
        }
        let Some(region) = found else { continue };
        for t in part {
            mesh.regions[t as usize] = region;
        }
    }
    Ok(())
}

fn collect(work: &Work, scene: &Scene, domain: &Box3) -> Result<TetMesh, MeshError> {
    let from = &work.mesh;
    let mut out = TetMesh::default();
    let mut ids = vec![NONE; from.points.len()];
    let all: Vec<Box3> = scene
        .conductor_parts()
        .filter(|(_, part)| !matches!(part, Shape::Shell { .. }))
        .map(|(_, part)| bodies::bounds(part))
        .collect();
    let open = |a: usize| scene.walls[a].map(|w| w == Wall::Open);
    if let Some(first) = all.first() {
        let around = all.iter().fold(*first, |all, b| all.union(b));
        out.center = [0, 1, 2].map(|a| match open(a) {
            // Rays from a point of the only wall stay on its inner side.
            [false, true] => domain.min[a],
            [true, false] => domain.max[a],
            _ => 0.5 * (around.min[a] + around.max[a]),
        });
    }
    for t in 0..from.tets.len() {
        if !from.alive(t as u32) || from.regions[t] < 0 {
            continue;
        }
        for p in from.tets[t] {
            if ids[p as usize] == NONE {
                ids[p as usize] = out.points.len() as u32;
                out.points.push(from.points[p as usize]);
            }
        }
        out.tets.push(from.tets[t].map(|p| ids[p as usize]));
        out.regions.push(from.regions[t] as u32);
        for i in 0..4 {
            let n = from.near[t][i];
            let face = from.face(t as u32, i);
            let wall = from.walls[t][i];
            let middle = || {
                let corners = face.map(|p| from.points[p as usize]);
                [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0)
            };
            let sheet = || wall.checked_sub(1).and_then(|f| work.complex.facets[f as usize].sheet(middle()));
            let role = if n == NONE {
                let on = face.map(|p| from.points[p as usize]);
                let side = |a: usize, at: f64| on.iter().all(|p| p[a] == at);
                let outer = (0..3).find_map(|a| {
                    let low = side(a, domain.min[a]).then_some(scene.walls[a][0]);
                    low.or(side(a, domain.max[a]).then_some(scene.walls[a][1]))
                });
                match (sheet(), outer) {
                    (Some(c), _) => Some(FaceRole::Conductor(c)),
                    (None, Some(Wall::Grounded)) => Some(FaceRole::Grounded),
                    (None, Some(Wall::Open)) => {
                        Some(FaceRole::Open { permittivity: beyond(scene, out.center, on) })
                    }
                    (None, Some(Wall::Insulated)) => None,
                    (None, None) => return Err(MeshError::Torn { at: middle() }),
                }
            } else if from.regions[n as usize] < 0 {
                Some(FaceRole::Conductor((-1 - from.regions[n as usize]) as u32))
            } else if wall != 0 && (t as u32) < n {
                sheet().map(FaceRole::Conductor)
            } else {
                None
            };
            if let Some(role) = role {
                out.boundary.push(BoundaryFace { face: face.map(|p| ids[p as usize]), role });
            }
        }
    }
    Ok(out)
}

#[cfg(test)]
mod meet_tests;
#[cfg(test)]
mod tests;

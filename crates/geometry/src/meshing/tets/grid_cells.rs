//! Tetrahedra from the cells of a grid, for scenes of boxes.

use super::{BoundaryFace, FaceRole, TetMesh, determinant};
use crate::meshing::indices::Renumbering;
use crate::scene::{Box3, Filling, Scene, Wall};

/// Divides every cell of a grid that lies in no conductor into six tetrahedra (Kuhn's triangulation), for a
/// scene of boxes and sheets.
///
/// `nodes` are the coordinates of the grid per axis, ascending, m. They begin and end where the mesh does and
/// include all bounds of bodies in between. Faces on open sides get the range of all permittivities of the
/// scene, and rays that start amid the conductors.
pub fn of_boxes(scene: &Scene, nodes: &[Vec<f64>; 3]) -> TetMesh {
    let counts = [0, 1, 2].map(|a| nodes[a].len());
    let index = |c: [usize; 3]| (c[0] * counts[1] + c[1]) * counts[2] + c[2];
    let point = |c: [usize; 3]| [nodes[0][c[0]], nodes[1][c[1]], nodes[2][c[2]]];
    let lookup = scene.lookup();
    let mut mesh = TetMesh::default();
    let mut numbers = Renumbering::new(counts.iter().product());
    for i in 0..counts[0] - 1 {
        for j in 0..counts[1] - 1 {
            for k in 0..counts[2] - 1 {
                let (low, high) = (point([i, j, k]), point([i + 1, j + 1, k + 1]));
                let middle = [0, 1, 2].map(|a| 0.5 * (low[a] + high[a]));
                let region = match lookup.body_at(middle) {
                    Filling::Conductor(_) => continue,
                    Filling::Background => 0,
                    Filling::Dielectric(d) => d.index as u32 + 1,
                };
                for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut corner = [i, j, k];
                    let mut tet = [0_u32; 4];
                    let mut points = [[0.0; 3]; 4];
                    for step in 0..4 {
                        tet[step] = numbers.number(index(corner), || mesh.points.push(point(corner)));
                        points[step] = point(corner);
                        if step < 3 {
                            corner[axes[step]] += 1;
                        }
                    }
                    if determinant(points[0], points[1], points[2], points[3]) < 0.0 {
                        tet.swap(2, 3);
                    }
                    mesh.tets.push(tet);
                    mesh.regions.push(region);
                }
            }
        }
    }
    let conductors = scene.conductor_parts().filter_map(|(_, part)| part.as_box());
    if let Some(all) = conductors.reduce(|all, next| all.union(&next)) {
        mesh.center = [0, 1, 2].map(|a| 0.5 * (all.min[a] + all.max[a]));
    }
    mark(&mut mesh, scene, nodes);
    mesh
}

/// Gives faces that lie on conductors, grounded walls or open sides their roles.
fn mark(mesh: &mut TetMesh, scene: &Scene, nodes: &[Vec<f64>; 3]) {
    let permittivities = scene.permittivities();
    let least = permittivities.iter().copied().fold(f64::INFINITY, f64::min);
    let most = permittivities.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let parts = scene.conductor_parts().filter_map(|(conductor, part)| Some((conductor, part.as_box()?)));
    let parts: Vec<(usize, Box3)> = parts.collect();
    let mut marked = std::collections::BTreeMap::new();
    for tet in &mesh.tets {
        for skip in 0..4 {
            let mut face = [0, 1, 2].map(|k| tet[if k < skip { k } else { k + 1 }]);
            face.sort_unstable();
            let points = face.map(|p| mesh.points[p as usize]);
            let Some(axis) = (0..3).find(|&a| points[0][a] == points[1][a] && points[0][a] == points[2][a])
            else {
                continue;
            };
            let plane = points[0][axis];
            let held = parts.iter().find(|(_, part)| points.iter().all(|&p| part.contains(p)));
            let role = if let Some((conductor, _)) = held {
                Some(FaceRole::Conductor(*conductor as u32))
            } else {
                let side =
                    [nodes[axis].first(), nodes[axis].last()].iter().position(|&end| end == Some(&plane));
                match side.map(|side| scene.walls[axis][side]) {
                    Some(Wall::Grounded) => Some(FaceRole::Grounded),
                    Some(Wall::Open) => Some(FaceRole::Open { permittivity: [least, most] }),
                    Some(Wall::Insulated) | None => None,
                }
            };
            if let Some(role) = role {
                marked.insert(face, role);
            }
        }
    }
    mesh.boundary = marked.into_iter().map(|(face, role)| BoundaryFace { face, role }).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Body;
    use crate::shapes::Shape;

    #[test]
    fn a_cube_in_a_cube_leaves_seven_eighths_with_faces_on_both() {
        let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
        let scene = Scene {
            bodies: vec![Body::conductor("inner", Shape::Box(cube(0.5)))],
            background_permittivity: 1.0,
            domain: cube(1.0),
            walls: [[Wall::Grounded; 2]; 3],
        };
        let line = vec![-1.0, -0.5, 0.0, 0.5, 1.0];
        let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
        let volume: f64 = (0..mesh.tets.len()).map(|t| mesh.determinant(t) / 6.0).sum();
        assert!((volume - 7.0).abs() < 1e-13);
        assert!((0..mesh.tets.len()).all(|t| mesh.determinant(t) > 0.0));
        let on = |role| mesh.boundary.iter().filter(|f| f.role == role).count();
        assert_eq!(on(FaceRole::Conductor(0)), 6 * 4 * 2);
        assert_eq!(on(FaceRole::Grounded), 6 * 16 * 2);
    }
}

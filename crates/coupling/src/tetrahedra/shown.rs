//! A solved scene for a viewer: surfaces, mesh and field of the whole scene, of which only a part may have
//! been meshed.

use super::{Planes, Solved};
use elastocap_electrostatics::{MeshSolution, Target};
use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray};
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::surfaces::{SurfaceBody, surfaces};
use elastocap_geometry::meshing::tets::{TetMesh, determinant};
use elastocap_geometry::scene::{Body, Box3, MirrorPlane, Scene};
use elastocap_geometry::shapes::Shape;
use elastocap_linalg::vector::{cross, dot, length, minus};
use std::collections::HashMap;

/// The surfaces of the conductors and of the finite dielectrics. A hollow conductor around the scene is drawn
/// as a transparent wall.
pub(super) fn surfaces_of(scene: &Scene, mesh: &TetMesh, planes: &Planes) -> Vec<SurfaceBody> {
    let mut mesh = std::borrow::Cow::Borrowed(mesh);
    for (axis, plane) in planes.iter().enumerate() {
        if let Some(plane) = plane {
            mesh = std::borrow::Cow::Owned(mesh.reflected(axis, plane).mesh);
        }
    }
    let (metal, filled) = surfaces(&mesh, scene.conductors().count(), 1 + scene.dielectrics().count());
    let conductors = scene.conductors().zip(metal).map(|(c, triangles)| {
        let around = c.body.parts.iter().any(|part| matches!(part, Shape::Shell { .. }));
        let role = if around { BodyRole::Wall } else { BodyRole::from(c.body) };
        SurfaceBody { name: c.body.name.clone(), role, triangles }
    });
    let is_finite = |body: &Body| {
        body.bounds().is_none_or(|b| (0..3).all(|a| b.min[a].is_finite() && b.max[a].is_finite()))
    };
    let dielectrics = scene.dielectrics().zip(filled).filter(|(d, _)| is_finite(d.body));
    let dielectrics = dielectrics.map(|(d, triangles)| SurfaceBody {
        name: d.body.name.clone(),
        role: BodyRole::from(d.body),
        triangles,
    });
    conductors.chain(dielectrics).collect()
}

/// The mesh and the field for a viewer within [`Scene::sensor`], including all mirror images: in the state of
/// the target ([`Target::shown`]), with floating conductors at their potentials.
pub(crate) fn shown(scene: &Scene, solved: &Solved, target: Target) -> BodyMesh {
    let MeshSolution { mesh, potentials, solution } = &solved.found;
    let driven: Vec<usize> = scene.driven().collect();
    let volts = target.shown(driven.len());
    let mut held = vec![0.0; scene.conductors().count()];
    for (&conductor, v) in driven.iter().zip(&volts) {
        held[conductor] = *v;
    }
    for floating in &solution.floating {
        held[floating.conductor] = floating.per_driven.iter().zip(&volts).map(|(p, v)| p.value * v).sum();
    }
    let (mut mesh, values) = on_whole(mesh, potentials, &held, &solved.planes);
    if let Some(turn) = solved.turn {
        mesh.points.iter_mut().for_each(|point| *point = turn.undone(*point));
    }
    let sensor = scene.sensor();
    let permittivities = scene.permittivities();
    let mut exported = ExportedPoints::default();
    let (mut nodes, mut permittivity, mut body_id) = (Vec::new(), Vec::new(), Vec::new());
    for (tet, &region) in mesh.tets.iter().zip(&mesh.regions) {
        let field = field(&mesh, *tet, &values);
        for piece in within(tet.map(|p| (mesh.points[p as usize], values[p as usize])), &sensor) {
            nodes.extend(exported.add(piece, region, field));
            permittivity.push(permittivities[region as usize]);
            body_id.push(region as i32);
        }
    }
    let names = scene.dielectrics().map(|d| d.body.name.clone());
    BodyMesh {
        element: Element::Tetrahedron,
        nodes,
        arrays: vec![
            NamedArray { name: "potential", components: 1, values: exported.potential },
            NamedArray {
                name: "electric_field",
                components: 3,
                values: exported.field.iter().flat_map(|(sum, volume)| sum.map(|e| e / volume)).collect(),
            },
        ],
        points: exported.points,
        in_elements: vec![NamedArray { name: "relative_permittivity", components: 1, values: permittivity }],
        body_id,
        body_names: std::iter::once("surroundings".to_owned()).chain(names).collect(),
    }
}

/// The exported points, separate for each region, because the field jumps between regions.
#[derive(Default)]
struct ExportedPoints {
    /// The number of each point, by its coordinates and its region.
    numbers: HashMap<([u64; 3], u32), u32>,
    /// The place of each point, m.
    points: Vec<[f64; 3]>,
    /// The potential at each point, V.
    potential: Vec<f64>,
    /// The sum of the fields in the tetrahedra around a point, each times its volume, and the sum of the
    /// volumes.
    field: Vec<([f64; 3], f64)>,
}

/// Pieces with less volume than this, over the product of three of their sides, are omitted. Not tuned: it
/// only has to lie above rounding errors and below distances that matter.
const FLAT: f64 = 1e-11;

/// A place, m, and the potential there, V.
type Corner = ([f64; 3], f64);

impl ExportedPoints {
    /// Adds a tetrahedron with this field, and returns the numbers of its corners.
    fn add(&mut self, tet: [Corner; 4], region: u32, field: [f64; 3]) -> [u32; 4] {
        let volume = determinant(tet[0].0, tet[1].0, tet[2].0, tet[3].0).abs();
        tet.map(|(place, potential)| {
            let key = (place.map(f64::to_bits), region);
            let number = *self.numbers.entry(key).or_insert_with(|| {
                self.points.push(place);
                self.potential.push(potential);
                self.field.push(([0.0; 3], 0.0));
                self.points.len() as u32 - 1
            });
            let (sum, volumes) = &mut self.field[number as usize];
            (0..3).for_each(|a| sum[a] += volume * field[a]);
            *volumes += volume;
            number
        })
    }
}

/// The part of a tetrahedron inside a box, as tetrahedra of the same orientation.
fn within(tet: [Corner; 4], shown: &Box3) -> Vec<[Corner; 4]> {
    if tet.iter().all(|(place, _)| shown.contains(*place)) {
        return vec![tet];
    }
    let mut pieces = vec![tet];
    for a in 0..3 {
        for (at, side) in
            [(shown.min[a], 1.0), (shown.max[a], -1.0)].into_iter().filter(|(at, _)| at.is_finite())
        {
            pieces = pieces.into_iter().flat_map(|tet| cut(tet, a, at, side)).collect();
        }
    }
    pieces
}

/// The part of a tetrahedron beyond the plane at the coordinate `at` of axis `a`: above the plane if `side`
/// is 1, below it if it is -1. Neighbours are cut along the same lines in their common face.
fn cut(mut tet: [Corner; 4], a: usize, at: f64, side: f64) -> Vec<[Corner; 4]> {
    let inside = |corner: &Corner| side * (corner.0[a] - at) > 0.0;
    let volume = |t: &[Corner; 4]| determinant(t[0].0, t[1].0, t[2].0, t[3].0);
    let positive = volume(&tet) > 0.0;
    // Corners inside come first. The order within each group is the same in the whole mesh.
    tet.sort_by_key(|corner| (!inside(corner), corner.0.map(f64::to_bits)));
    let crossing = |p: usize, q: usize| {
        let (from, to) = (&tet[p], &tet[q]);
        let t = (at - from.0[a]) / (to.0[a] - from.0[a]);
        let mut place = [0, 1, 2].map(|k| from.0[k] + t * (to.0[k] - from.0[k]));
        place[a] = at;
        (place, from.1 + t * (to.1 - from.1))
    };
    // In a face between two inside corners, the diagonal begins at the later one, in every tetrahedron of the
    // face.
    let prism =
        |[a, b, c]: [Corner; 3], [d, e, f]: [Corner; 3]| vec![[a, b, c, d], [b, c, d, e], [c, d, e, f]];
    let mut pieces = match tet.iter().filter(|corner| inside(corner)).count() {
        0 => Vec::new(),
        1 => vec![[tet[0], crossing(0, 1), crossing(0, 2), crossing(0, 3)]],
        2 => prism([tet[0], crossing(0, 2), crossing(0, 3)], [tet[1], crossing(1, 2), crossing(1, 3)]),
        3 => prism([tet[0], tet[1], tet[2]], [crossing(0, 3), crossing(1, 3), crossing(2, 3)]),
        _ => vec![tet],
    };
    // A corner just beyond the plane leaves negligible pieces whose orientation rounding may flip.
    let size = |t: &[Corner; 4]| (1..4).map(|k| length(minus(t[k].0, t[0].0))).product::<f64>();
    pieces.retain(|piece| volume(piece).abs() > FLAT * size(piece));
    for piece in &mut pieces {
        if (volume(piece) > 0.0) != positive {
            piece.swap(2, 3);
        }
    }
    pieces
}

/// The mesh of the whole scene, and the potential at its points, V, with conductors at the potentials `held`.
///
/// The potential at the mirror image of a point is that at the point with the conductors exchanged.
pub(super) fn on_whole(
    mesh: &TetMesh,
    potentials: &[Vec<f64>],
    held: &[f64],
    planes: &Planes,
) -> (TetMesh, Vec<f64>) {
    let planes: Vec<(usize, &MirrorPlane)> =
        planes.iter().enumerate().filter_map(|(axis, plane)| Some((axis, plane.as_ref()?))).collect();
    // For each set of planes, as bits, the potential with the conductors exchanged across all of them.
    let exchanged = |set: usize| {
        let mut values = vec![0.0; mesh.points.len()];
        for (c, v) in held.iter().enumerate() {
            let within = planes.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
            let image = within.fold(c, |c, (_, (_, plane))| plane.conductors[c]);
            values.iter_mut().zip(&potentials[image]).for_each(|(sum, u)| *sum += v * u);
        }
        values
    };
    let mut values: Vec<Vec<f64>> = (0..1_usize << planes.len()).map(exchanged).collect();
    let mut mesh = mesh.clone();
    for (axis, plane) in planes {
        let half = mesh.points.len();
        let whole = mesh.reflected(axis, plane);
        // The lowest bit is that of this plane.
        values = values
            .chunks_exact(2)
            .map(|halves| {
                let value = |(at, &p): (usize, &u32)| halves[usize::from(at >= half)][p as usize];
                whole.source.iter().enumerate().map(value).collect()
            })
            .collect();
        mesh = whole.mesh;
    }
    (mesh, values.swap_remove(0))
}

/// The electric field in a tetrahedron, minus the gradient of its linear potential, V/m.
fn field(mesh: &TetMesh, tet: [u32; 4], values: &[f64]) -> [f64; 3] {
    let at = tet.map(|p| mesh.points[p as usize]);
    let [u, v, w] = [1, 2, 3].map(|k| minus(at[k], at[0]));
    let normals = [cross(v, w), cross(w, u), cross(u, v)];
    let volume = dot(u, normals[0]);
    let rises = [1, 2, 3].map(|k| values[tet[k] as usize] - values[tet[0] as usize]);
    [0, 1, 2].map(|a| -(0..3).map(|k| rises[k] * normals[k][a]).sum::<f64>() / volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_off_at_a_box_leaves_its_volume_the_potential_and_faces_that_fit() {
        // A cube of side 2 as six tetrahedra around a diagonal, with a linear potential.
        let u = |p: [f64; 3]| p[0] - 2.0 * p[1] + 0.5 * p[2];
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let cube = orders.map(|order| {
            let mut at = [-1.0; 3];
            let mut tet = [(at, u(at)); 4];
            for (k, a) in order.into_iter().enumerate() {
                at[a] = 1.0;
                tet[k + 1] = (at, u(at));
            }
            tet
        });
        let shown = Box3 { min: [-0.3, -2.0, -0.7], max: [0.9, 0.4, 0.1] };
        let volume = |t: &[Corner; 4]| determinant(t[0].0, t[1].0, t[2].0, t[3].0) / 6.0;
        let mut whole = 0.0;
        let mut faces: HashMap<[[u64; 3]; 3], usize> = HashMap::new();
        for tet in cube {
            for piece in within(tet, &shown) {
                assert!((volume(&piece) > 0.0) == (volume(&tet) > 0.0));
                whole += volume(&piece).abs();
                for (place, potential) in piece {
                    assert!((potential - u(place)).abs() < 1e-12 && shown.contains(place), "{place:?}");
                }
                for skip in 0..4 {
                    let mut key =
                        [0, 1, 2].map(|k| piece[if k < skip { k } else { k + 1 }].0.map(f64::to_bits));
                    key.sort_unstable();
                    *faces.entry(key).or_default() += 1;
                }
            }
        }
        assert!((whole - 1.2 * 1.4 * 0.8).abs() < 1e-12, "{whole}");
        // A face of only one piece lies on the boundary.
        for (face, count) in faces {
            let corners = face.map(|p| p.map(f64::from_bits));
            let on = |a: usize, at: f64| corners.iter().all(|p| p[a] == at);
            let outside = on(0, -0.3) || on(0, 0.9) || on(1, -1.0) || on(1, 0.4) || on(2, -0.7) || on(2, 0.1);
            assert_eq!(count, if outside { 1 } else { 2 }, "{corners:?}");
        }
    }
}

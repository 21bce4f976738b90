//! A solved scene for a viewer: surfaces, the mesh and the field of the whole, of which one part may have been meshed.

use super::{Planes, Solved};
use elastocap_electrostatics::{MeshSolution, Target};
use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray};
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::surfaces::{SurfaceBody, surfaces};
use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_geometry::scene::{Body, MirrorPlane, Scene};
use elastocap_geometry::shapes::Shape;
use elastocap_linalg::vector::{cross, dot, minus};

/// Surfaces of the conductors and of the finite dielectrics. A hollow conductor around everything is drawn as a wall, which is transparent.
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
    let ends = |body: &Body| {
        body.bounds().is_none_or(|b| (0..3).all(|a| b.min[a].is_finite() && b.max[a].is_finite()))
    };
    let dielectrics = scene.dielectrics().zip(filled).filter(|(d, _)| ends(d.body));
    let dielectrics = dielectrics.map(|(d, triangles)| SurfaceBody {
        name: d.body.name.clone(),
        role: BodyRole::from(d.body),
        triangles,
    });
    conductors.chain(dielectrics).collect()
}

/// The mesh and the field for a viewer, of the whole: in the state of the target ([`Target::shown`]), floating conductors at their
/// potentials.
pub(crate) fn shown(scene: &Scene, solved: &Solved, target: Target) -> BodyMesh {
    let MeshSolution { mesh, potentials, solution } = &solved.general;
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
    let field = mesh.tets.iter().flat_map(|tet| field(&mesh, *tet, &values)).collect();
    let permittivities = scene.permittivities();
    let permittivity = mesh.regions.iter().map(|&r| permittivities[r as usize]).collect();
    let names = scene.dielectrics().map(|d| d.body.name.clone());
    BodyMesh {
        element: Element::Tetrahedron,
        nodes: mesh.tets.as_flattened().to_vec(),
        points: mesh.points,
        arrays: vec![NamedArray { name: "potential", components: 1, values }],
        in_elements: vec![
            NamedArray { name: "electric_field", components: 3, values: field },
            NamedArray { name: "relative_permittivity", components: 1, values: permittivity },
        ],
        body_id: mesh.regions.iter().map(|&r| r as i32).collect(),
        body_names: std::iter::once("surroundings".to_owned()).chain(names).collect(),
    }
}

/// The mesh of the whole scene, and on its points the potential, V, with conductors held at these.
///
/// What a point's mirror image sees is what the point sees when conductors have changed places.
pub(super) fn on_whole(
    mesh: &TetMesh,
    potentials: &[Vec<f64>],
    held: &[f64],
    planes: &Planes,
) -> (TetMesh, Vec<f64>) {
    let planes: Vec<(usize, &MirrorPlane)> =
        planes.iter().enumerate().filter_map(|(axis, plane)| Some((axis, plane.as_ref()?))).collect();
    // For each set of planes, a bit for each, the potential with conductors that have changed places about them all.
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
            .map(|both| {
                let of = |(at, &p): (usize, &u32)| both[usize::from(at >= half)][p as usize];
                whole.source.iter().enumerate().map(of).collect()
            })
            .collect();
        mesh = whole.mesh;
    }
    (mesh, values.swap_remove(0))
}

/// Minus the gradient of the potential that is linear between the corners, V/m.
fn field(mesh: &TetMesh, tet: [u32; 4], values: &[f64]) -> [f64; 3] {
    let at = tet.map(|p| mesh.points[p as usize]);
    let [u, v, w] = [1, 2, 3].map(|k| minus(at[k], at[0]));
    let normals = [cross(v, w), cross(w, u), cross(u, v)];
    let volume = dot(u, normals[0]);
    let rises = [1, 2, 3].map(|k| values[tet[k] as usize] - values[tet[0] as usize]);
    [0, 1, 2].map(|a| -(0..3).map(|k| rises[k] * normals[k][a]).sum::<f64>() / volume)
}

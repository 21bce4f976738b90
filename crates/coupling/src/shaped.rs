//! A scene of bodies of any shape: meshed, solved, and what flat faces leave out said.

use elastocap_electrostatics::general::{General, Shapes, solve_mesh};
use elastocap_electrostatics::{Settings, SolveError};
use elastocap_geometry::export::body::{BodyMesh, Element, NodalArray};
use elastocap_geometry::shapes::{Shape, ShapeScene};
use elastocap_geometry::tets::{FaceRole, LayeredSizing, Sizing, TetMesh, layered, mesh};

use crate::case::ImportedMesh;
use crate::step::Stop;

/// Order of the potentials: P2 is the best there is at edges of 90 degrees, where the error of C falls as N^(-4/3).
const ORDER: usize = 2;

/// The relative error of a capacitance, over the square of the faces' size over the radius: of balls and cylinders with
/// faces that keep their volume, from the mean distance of a face to the surface.
const FACETS: f64 = 0.05;

/// What part of the tolerance flat faces may take.
const SHARE: f64 = 0.2;

/// Sizes of faces over the radius of curved bodies: no larger, no smaller.
const FACE_SIZES: [f64; 2] = [0.02, 0.3];

/// A scene solved.
pub(crate) struct Solved {
    pub(crate) general: General,
    /// Estimate of the relative error that flat faces in place of curved ones add; zero where all bodies are flat-faced.
    pub(crate) facets: f64,
}

/// Meshes, unless there is a mesh, and solves.
pub(crate) fn solve_shapes(
    scene: &ShapeScene,
    imported: Option<&ImportedMesh>,
    settings: &Settings,
) -> Result<Solved, Stop> {
    let size = (SHARE * settings.relative_tolerance / FACETS).sqrt().clamp(FACE_SIZES[0], FACE_SIZES[1]);
    let mesh = match imported {
        Some(imported) => imported.tets.clone(),
        None => mesh_of(scene, size).map_err(Stop::Failed)?,
    };
    for (index, conductor) in scene.conductors.iter().enumerate() {
        if !mesh.boundary.iter().any(|f| f.role == FaceRole::Conductor(index as u32)) {
            return Err(Stop::Failed(format!(
                "the conductor `{}` has no surface in the space that is solved: it lies in another conductor or outside \
                 the walls",
                conductor.name
            )));
        }
    }
    let permittivity: Vec<f64> = std::iter::once(scene.background_permittivity)
        .chain(scene.dielectrics.iter().map(|d| d.relative_permittivity))
        .collect();
    let floating_charges: Vec<_> = scene.conductors.iter().map(|c| c.floating_charge).collect();
    let shapes = Shapes { permittivity: &permittivity, floating_charges: &floating_charges, order: ORDER };
    let general = solve_mesh(mesh, shapes, settings).map_err(|error| match error {
        SolveError::Cancelled => Stop::Cancelled,
        error => Stop::Failed(error.to_string()),
    })?;
    let curved = scene.conductors.iter().map(|c| &c.shape).chain(scene.dielectrics.iter().map(|d| &d.shape));
    let curved = curved
        .into_iter()
        .any(|shape| matches!(shape, Shape::Sphere { .. } | Shape::Shell { .. } | Shape::Cylinder { .. }));
    Ok(Solved { general, facets: if curved { FACETS * size * size } else { 0.0 } })
}

/// A mesh with faces of this size over the radius on curved bodies.
fn mesh_of(scene: &ShapeScene, size: f64) -> Result<TetMesh, String> {
    let circle = (std::f64::consts::TAU / size).ceil() as usize;
    if let Some(found) = layered(scene, &LayeredSizing { circle, ..LayeredSizing::default() }) {
        return found.map_err(|error| error.to_string());
    }
    mesh(scene, &Sizing { facet: size, ..Sizing::default() })
        .map(|found| found.mesh)
        .map_err(|error| error.to_string())
}

/// The mesh and the potential for a viewer: one volt on the first driven conductor, the others at zero.
pub(crate) fn shown(scene: &ShapeScene, general: &General) -> BodyMesh {
    let General { mesh, potentials, solution } = general;
    let driven: Vec<usize> =
        (0..scene.conductors.len()).filter(|&c| scene.conductors[c].floating_charge.is_none()).collect();
    let mut held = vec![0.0; scene.conductors.len()];
    if let Some(&first) = driven.first() {
        held[first] = 1.0;
    }
    for floating in &solution.floating {
        held[floating.conductor] = floating.per_driven.first().map_or(0.0, |v| v.value);
    }
    let mut values = vec![0.0; mesh.points.len()];
    for (v, potential) in held.iter().zip(potentials) {
        values.iter_mut().zip(potential).for_each(|(sum, u)| *sum += v * u);
    }
    let names = scene.dielectrics.iter().map(|d| d.name.clone());
    BodyMesh {
        element: Element::Tetrahedron,
        points: mesh.points.clone(),
        nodes: mesh.tets.as_flattened().to_vec(),
        arrays: vec![NodalArray { name: "potential", components: 1, values }],
        body_id: mesh.regions.iter().map(|&r| r as i32).collect(),
        body_names: std::iter::once("surroundings".to_owned()).chain(names).collect(),
    }
}

//! A scene of bodies of any shape: meshes it, solves it and estimates the faceting error.

use elastocap_electrostatics::{Forecast, MeshScene, MeshSolution, SolveError, forecast_mesh, solve_mesh};
use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray};
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::surfaces::{SurfaceBody, surfaces};
use elastocap_geometry::meshing::tets::{
    FaceRole, LayeredSizing, MeshError, Sizing, TetMesh, layered, mesh_unless,
};
use elastocap_geometry::mirror;
use elastocap_geometry::scene::{Body, Box3, Scene};
use elastocap_geometry::shapes::Shape;
use elastocap_linalg::vector::{cross, dot, length, minus};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::faceting_error::curvature_error;
use crate::failure::{Stop, TetrahedraError};
use crate::settings::FieldSettings;
use elastocap_case::ImportedMesh;

/// The relative error of a capacitance, over the square of the faces' size over the radius: of balls and cylinders with
/// faces that keep their volume, from the mean distance of a face to the surface.
const FACETS: f64 = 0.05;

/// Share of the tolerance that flat faces may use up.
const SHARE: f64 = 0.2;

/// Sizes of faces over the radius of curved bodies: no larger, no smaller.
const FACE_SIZES: [f64; 2] = [0.02, 0.3];

/// From which [`flatness`] on a scene in layers is meshed in layers, which needs no small triangles for thin gaps.
const FLAT: f64 = 12_000.0;

/// From how many [`strips`] on a scene in layers is meshed in layers, whose triangles may be longer than they are wide.
const STRIPS: f64 = 300.0;

/// Length of mesh edges along thin conductors, relative to their width, over the tolerance: the spread on the first mesh is then
/// two to three times the tolerance.
const THIN_EDGE: f64 = 4.0;

/// Growth of elements from the edges of thin conductors on.
const THIN_GROWTH: f64 = 0.3;

/// Largest number of points along the edges of thin conductors: the first mesh has some hundred tetrahedra for each.
const MAX_EDGE_POINTS: f64 = 8_000.0;

/// The same for a mesh that is to say no more than what the solve will take.
const FORECAST_EDGE_POINTS: f64 = 150.0;

/// A mesh with fine edges from the start has this many times the unknowns that refinement of a coarse one is expected to lead to.
const FINE_EDGES: f64 = 2.0;

/// Longer mesh edges along thin conductors than this, relative to their width, do not serve.
const MAX_THIN_EDGE: f64 = 0.1;

/// Meshes to try where the solver does not get through.
const AGAIN: usize = 3;

/// Sizes of faces to try.
const TRIES: usize = 4;

/// Where surfaces were not met by then other sizes are tried; with more points that would take too long.
const FEW_POINTS: usize = 100_000;

/// A scene solved.
pub(crate) struct Solved {
    /// Its mesh is of the part above the planes.
    pub(crate) general: MeshSolution,
    /// Per axis the plane about which the scene is its own mirror image, m, if only one half was solved.
    pub(crate) planes: [Option<f64>; 3],
    /// The surfaces of the bodies, whole, for a viewer.
    pub(crate) surfaces: Vec<SurfaceBody>,
    /// Estimate of the relative error that flat faces in place of curved ones add; zero where all bodies are flat-faced.
    pub(crate) facets: f64,
}

/// Meshes, unless there is a mesh, and solves.
pub(crate) fn solve_shapes(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
) -> Result<Solved, Stop> {
    let mut size = 1.0;
    let mut tries = AGAIN;
    loop {
        tries -= 1;
        // Where bodies cross at shallow angles, other faces may give rounder tetrahedra.
        match solve_at(scene, imported, settings, size) {
            Err(Unsolved::Solver(_)) if tries > 0 && imported.is_none() => size *= 0.8,
            Err(Unsolved::Solver(error)) => return Err(error.into()),
            Err(Unsolved::Stop(stop)) => return Err(stop),
            Ok(solved) => return Ok(solved),
        }
    }
}

/// Why there is no solution.
enum Unsolved {
    /// The solver did not get through on this mesh.
    Solver(SolveError),
    /// Another mesh would not help.
    Stop(Stop),
}

/// With faces smaller by a factor.
fn solve_at(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
    smaller: f64,
) -> Result<Solved, Unsolved> {
    let failed = |error: TetrahedraError| match error {
        TetrahedraError::Mesh(MeshError::Cancelled) => Unsolved::Stop(Stop::Cancelled),
        error => Unsolved::Stop(error.into()),
    };
    let First { mesh, planes, size, gap } =
        first(scene, imported, settings, smaller, MAX_EDGE_POINTS).map_err(failed)?;
    for conductor in scene.conductors() {
        if !mesh.boundary.iter().any(|f| f.role == FaceRole::Conductor(conductor.index as u32)) {
            return Err(failed(TetrahedraError::NoSurface { conductor: conductor.body.name.clone() }));
        }
    }
    // Before it is refined, which moves no surface but cuts its triangles.
    let surfaces = surfaces_of(scene, &mesh, planes);
    let facets = faceting_error(scene, &mesh, size, gap);
    let permittivity = scene.permittivities();
    let charges = charges(scene);
    let shapes = shapes(&permittivity, &charges, planes);
    let general = solve_mesh(mesh, shapes, &settings.tetrahedra()).map_err(|error| match error {
        SolveError::Cancelled => Unsolved::Stop(Stop::Cancelled),
        error => Unsolved::Solver(error),
    })?;
    Ok(Solved { general, planes, surfaces, facets })
}

/// Estimate of the relative error of the capacitances for flat faces in place of curved ones: of round bodies from the size of
/// their faces (see [`First`]), of imported surfaces and meshes from the angles at which theirs meet.
fn faceting_error(scene: &Scene, mesh: &TetMesh, size: f64, gap: f64) -> f64 {
    let round = if scene.shapes().any(is_curved) {
        FACETS * size * size + (size * size / (8.0 * gap)).powi(2)
    } else {
        0.0
    };
    let imported = |conductor: u32| {
        let is = |shape: &Shape| matches!(shape, Shape::Surface(_) | Shape::Physical(_));
        scene.conductor_parts().any(|(k, shape)| k == conductor as usize && is(shape))
    };
    round.max(curvature_error(mesh, imported))
}

/// What solving the scene will take: it is meshed, and solved on a small mesh. An estimate.
///
/// # Errors
/// Why the scene cannot be meshed or solved.
pub(crate) fn forecast(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
) -> Result<Forecast, TetrahedraError> {
    let First { mesh, planes, .. } = first(scene, imported, settings, 1.0, FORECAST_EDGE_POINTS)?;
    let permittivity = scene.permittivities();
    let charges = charges(scene);
    let shapes = shapes(&permittivity, &charges, planes);
    let found = forecast_mesh(mesh, shapes, &settings.tetrahedra())?;
    let edges = Sizing { thin_edge: THIN_EDGE * settings.relative_tolerance, ..Sizing::default() };
    let is_coarser = edges.points_along_thin_edges(scene).is_some_and(|points| points > FORECAST_EDGE_POINTS);
    if imported.is_some() || !is_coarser {
        return Ok(found);
    }
    let more = |count: usize| (FINE_EDGES * count as f64) as usize;
    let memory = (FINE_EDGES * found.memory_bytes as f64) as u64;
    Ok(Forecast {
        unknowns: more(found.unknowns),
        // The solver makes no mesh that would not fit into memory.
        memory_bytes: memory.min(settings.memory_limit.max(found.memory_bytes)),
        seconds: FINE_EDGES * found.seconds,
        unmirrored: (more(found.unmirrored.0), FINE_EDGES * found.unmirrored.1),
        ..found
    })
}

/// A mesh to start from.
struct First {
    mesh: TetMesh,
    /// The planes that it keeps to.
    planes: [Option<f64>; 3],
    /// Size of faces over the radius on curved bodies.
    size: f64,
    /// See [`ball_gap`].
    gap: f64,
}

fn first(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
    smaller: f64,
    edge_points: f64,
) -> Result<First, TetrahedraError> {
    // Between balls that are close together, faces must be small compared with the gap too.
    let gap = ball_gap(scene)?;
    let size = (SHARE * settings.relative_tolerance / FACETS)
        .sqrt()
        .min((8.0 * settings.relative_tolerance * gap).sqrt());
    let size = smaller * size.clamp(FACE_SIZES[0], FACE_SIZES[1]);
    let (mesh, planes) = match imported {
        Some(imported) => (imported.tets.clone(), [None; 3]),
        None => {
            let planes = if settings.symmetry { mirror::planes(scene) } else { [None; 3] };
            let cancel = settings.cancel.as_ref();
            let fineness = Fineness { size, tolerance: settings.relative_tolerance, edge_points, cancel };
            mesh_of(scene, fineness, planes)?
        }
    };
    Ok(First { mesh, planes, size, gap })
}

fn charges(scene: &Scene) -> Vec<Option<f64>> {
    scene.conductors().map(|c| c.floating_charge).collect()
}

fn shapes<'a>(
    permittivity: &'a [f64],
    floating_charges: &'a [Option<f64>],
    planes: [Option<f64>; 3],
) -> MeshScene<'a> {
    let mirrored = planes.map(|at| at.is_some());
    MeshScene { permittivity, floating_charges, mirrored }
}

/// Whether a mesh has flat faces in place of its surface.
fn is_curved(shape: &Shape) -> bool {
    match shape {
        Shape::Sphere { .. } | Shape::Shell { .. } | Shape::Cylinder { .. } => true,
        Shape::Box(_) | Shape::Extrusion { .. } | Shape::Surface(_) | Shape::Physical(_) => false,
    }
}

/// The least gap between balls of different conductors, or one and the hollow around it, over the radius of the smaller; at most 1.
///
/// # Errors
/// Two that touch or cross, by name.
fn ball_gap(scene: &Scene) -> Result<f64, TetrahedraError> {
    let mut least = 1.0_f64;
    let parts: Vec<(usize, &Shape)> = scene.conductor_parts().collect();
    let name = |k: usize| scene.conductors().nth(k).map_or("", |c| c.body.name.as_str());
    for (k, &(one, shape)) in parts.iter().enumerate() {
        for &(other, earlier) in parts[..k].iter().filter(|(other, _)| *other != one) {
            let Some((gap, radius)) = gap_between(shape, earlier) else { continue };
            if gap <= 0.0 {
                let [first, second] = [other, one].map(|conductor| name(conductor).to_owned());
                return Err(TetrahedraError::Touching { first, second });
            }
            least = least.min(gap / radius);
        }
    }
    Ok(least)
}

/// Surfaces of the conductors and of the finite dielectrics. A hollow conductor around everything is drawn as a wall, which is transparent.
fn surfaces_of(scene: &Scene, mesh: &TetMesh, planes: [Option<f64>; 3]) -> Vec<SurfaceBody> {
    let mut mesh = std::borrow::Cow::Borrowed(mesh);
    for (axis, at) in planes.into_iter().enumerate() {
        if let Some(at) = at {
            mesh = std::borrow::Cow::Owned(mesh.reflected(axis, at).mesh);
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

/// How fine a first mesh is, and who may stop the mesher.
#[derive(Debug, Clone, Copy)]
struct Fineness<'a> {
    /// Of faces over the radius on curved bodies.
    size: f64,
    /// Of the solve that it is for.
    tolerance: f64,
    /// Largest number of points along the edges of thin conductors.
    edge_points: f64,
    /// Set from outside to stop.
    cancel: Option<&'a Arc<AtomicBool>>,
}

/// A mesh of the part above the planes, and which of them it keeps to.
/// The whole is meshed where the part cannot be.
fn mesh_of(
    scene: &Scene,
    fineness: Fineness<'_>,
    planes: [Option<f64>; 3],
) -> Result<(TetMesh, [Option<f64>; 3]), TetrahedraError> {
    let part = mirror::part(scene, planes);
    match whole_of(&part, fineness) {
        Err(_) if part != *scene => whole_of(scene, fineness).map(|mesh| (mesh, [None; 3])),
        found => found.map(|mesh| (mesh, planes)),
    }
}

fn whole_of(scene: &Scene, fineness: Fineness<'_>) -> Result<TetMesh, TetrahedraError> {
    let Fineness { size, tolerance, cancel, .. } = fineness;
    let reach = reach(scene, tolerance);
    if strips(scene) <= STRIPS
        && let Some(sizing) = thin_metal(scene, fineness, reach)
    {
        match mesh_unless(scene, &sizing, cancel) {
            Ok(found) if found.refined => return Ok(found.mesh),
            Err(MeshError::Cancelled) => return Err(MeshError::Cancelled.into()),
            // The ways below may do.
            Ok(_) | Err(_) => {}
        }
    }
    if flatness(scene) > FLAT || strips(scene) > STRIPS {
        // A polygon with an even number of sides is its own mirror image as the circle is.
        let circle = ((std::f64::consts::TAU / size).ceil() as usize).next_multiple_of(2);
        let sizing = LayeredSizing { circle, reach, ..LayeredSizing::default() };
        if let Some(found) = layered(scene, &sizing) {
            return Ok(found?);
        }
    }
    // Where rounding leaves a flat tetrahedron behind, another size may not.
    let mut facet = size;
    let mut tries = TRIES;
    loop {
        tries -= 1;
        match mesh_unless(scene, &Sizing { facet, far: 2.0 * reach, ..Sizing::default() }, cancel) {
            Ok(found) => return Ok(found.mesh),
            Err(
                MeshError::Flat { .. }
                | MeshError::Torn { .. }
                | MeshError::Leak { .. }
                | MeshError::Tangled { .. }
                | MeshError::Unreachable { points: ..FEW_POINTS, .. },
            ) if tries > 0 => {
                facet *= 0.9;
            }
            // Corners of round bodies lie outside them: coarse ones may cross where the bodies do not.
            Err(MeshError::Crossing { .. } | MeshError::Near { .. }) if tries > 0 => {
                facet *= 0.5;
                tries = tries.min(1);
            }
            Err(error) => return Err(error.into()),
        }
    }
}

/// How to mesh a scene with thin conductors; `None` if it has none, or if their edges are too long to be divided finely.
fn thin_metal(scene: &Scene, fineness: Fineness<'_>, reach: f64) -> Option<Sizing> {
    let sizing = |thin_edge: f64| Sizing {
        facet: fineness.size,
        thin_edge,
        growth: THIN_GROWTH,
        far: 2.0 * reach,
        ..Sizing::default()
    };
    let wanted = THIN_EDGE * fineness.tolerance;
    let points = sizing(wanted).points_along_thin_edges(scene)?;
    let with = |most: f64| wanted * (points / most).max(1.0);
    let (finest, coarsest) = (with(MAX_EDGE_POINTS), wanted.max(MAX_THIN_EDGE));
    (finest <= coarsest).then(|| sizing(with(fineness.edge_points).clamp(finest, coarsest)))
}

/// Distance at which open space begins, over the size of the scene. The loss of the bounds beyond falls with its square (measured on
/// spheres and pads). Infinite dielectrics need more, since rays leave them.
fn reach(scene: &Scene, tolerance: f64) -> f64 {
    let endless = |b: Box3| (0..3).any(|a| b.min[a].is_infinite() || b.max[a].is_infinite());
    let layers = scene.dielectric_parts().any(|(_, part)| part.as_box().is_some_and(endless));
    let lost = if layers { 0.6 } else { 0.004 };
    (lost / (SHARE * tolerance)).sqrt().clamp(10.0, 40.0)
}

/// Approximate number of cubes, as high as the lowest gap or plate, that would cover the conductors.
fn flatness(scene: &Scene) -> f64 {
    let shapes: Vec<(&Shape, Box3)> =
        scene.conductor_parts().filter_map(|(_, part)| Some((part, part.bounds()?))).collect();
    let size = shapes.iter().flat_map(|(_, b)| [0, 1, 2].map(|a| b.extent(a))).fold(0.0, f64::max);
    let axes = (0..3).map(|axis| {
        let mut planes: Vec<f64> = shapes.iter().flat_map(|(_, b)| [b.min[axis], b.max[axis]]).collect();
        planes.sort_by(f64::total_cmp);
        let gaps = planes.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 1e-6 * size);
        let lowest = gaps.fold(f64::INFINITY, f64::min);
        shapes.iter().map(|(shape, b)| area(shape, b, axis)).sum::<f64>() / (lowest * lowest)
    });
    axes.fold(0.0, f64::max)
}

/// Approximate number of squares that would cover the sides of extrusions: many where an outline follows a curve.
fn strips(scene: &Scene) -> f64 {
    let of = |shape: &Shape| {
        let Shape::Extrusion { from, to, outline, .. } = shape else { return 0.0 };
        let next = outline.iter().cycle().skip(1);
        let sides = outline.iter().zip(next).map(|(p, q)| (q[0] - p[0]).hypot(q[1] - p[1]));
        sides.map(|side| (to - from) / side).filter(|ratio| *ratio > 1.0).sum()
    };
    scene.shapes().map(of).sum()
}

/// The gap between two balls, or a ball and the hollow around it, m, and the smaller radius, m. `None` for other shapes: their
/// gaps are those of their facets.
fn gap_between(one: &Shape, other: &Shape) -> Option<(f64, f64)> {
    /// Centre, radius, and whether the inside is what is hollow.
    fn round(shape: &Shape) -> Option<([f64; 3], f64, bool)> {
        match shape {
            Shape::Sphere { center, radius } => Some((*center, *radius, false)),
            Shape::Shell { center, radius } => Some((*center, *radius, true)),
            Shape::Box(_)
            | Shape::Cylinder { .. }
            | Shape::Extrusion { .. }
            | Shape::Surface(_)
            | Shape::Physical(_) => None,
        }
    }
    let ((c, r, r_hollow), (d, s, s_hollow)) = (round(one)?, round(other)?);
    let apart = length(minus(c, d));
    match (r_hollow, s_hollow) {
        (false, false) => Some((apart - r - s, r.min(s))),
        (false, true) => Some((s - apart - r, r)),
        (true, false) => Some((r - apart - s, s)),
        // A scene has one hollow at most.
        (true, true) => None,
    }
}

/// Approximate area of a body's projection along an axis, m^2.
fn area(shape: &Shape, b: &Box3, along: usize) -> f64 {
    match shape {
        Shape::Extrusion { axis, outline, .. } if *axis == along => {
            let next = outline.iter().cycle().skip(1);
            0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>().abs()
        }
        Shape::Box(_)
        | Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Cylinder { .. }
        | Shape::Extrusion { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => b.extent((along + 1) % 3) * b.extent((along + 2) % 3),
    }
}

/// The mesh and the field for a viewer, of the whole: with half a volt on the first of two driven conductors and minus half a
/// volt on the second, or one volt on the first of any other number; floating ones at their potentials.
pub(crate) fn shown(scene: &Scene, solved: &Solved) -> BodyMesh {
    let MeshSolution { mesh, potentials, solution } = &solved.general;
    let driven: Vec<usize> = scene.driven().collect();
    let volts: &[f64] = if driven.len() == 2 { &[0.5, -0.5] } else { &[1.0] };
    let mut held = vec![0.0; scene.conductors().count()];
    for (&conductor, v) in driven.iter().zip(volts) {
        held[conductor] = *v;
    }
    for floating in &solution.floating {
        held[floating.conductor] = floating.per_driven.iter().zip(volts).map(|(p, v)| p.value * v).sum();
    }
    let mut values = vec![0.0; mesh.points.len()];
    for (v, potential) in held.iter().zip(potentials) {
        values.iter_mut().zip(potential).for_each(|(sum, u)| *sum += v * u);
    }
    let mut mesh = mesh.clone();
    for (axis, at) in solved.planes.into_iter().enumerate() {
        if let Some(at) = at {
            let whole = mesh.reflected(axis, at);
            values = whole.source.iter().map(|&p| values[p as usize]).collect();
            mesh = whole.mesh;
        }
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

/// Minus the gradient of the potential that is linear between the corners, V/m.
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
    use elastocap_geometry::meshing::tets::determinant;
    use elastocap_geometry::scene::Wall;

    fn scene(shape: Shape) -> Scene {
        Scene {
            bodies: vec![Body::conductor("inner", shape)],
            background_permittivity: 1.0,
            domain: Box3 { min: [-1.0; 3], max: [1.0; 3] },
            walls: [[Wall::Grounded; 2]; 3],
        }
    }

    fn volume(body: &BodyMesh) -> f64 {
        let tets = body.nodes.chunks_exact(4);
        tets.map(|t| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| body.points[t[k] as usize]);
            let six = determinant(a, b, c, d);
            assert!(six > 0.0);
            six / 6.0
        })
        .sum()
    }

    #[test]
    fn symmetry_is_used_where_it_is_wanted_and_the_whole_is_shown_either_way() {
        let base = [0.0, -0.0025, 0.0];
        let disc = Shape::Cylinder { axis: 1, base, radius: 0.5, height: 0.005 };
        // By the mesher of layers, and by the other one.
        assert!(flatness(&scene(disc.clone())) > FLAT);
        for shape in [disc, Shape::Sphere { center: [0.0; 3], radius: 0.5 }] {
            let scene = scene(shape);
            let settings = FieldSettings { relative_tolerance: 0.15, ..FieldSettings::default() };
            let part = solve_shapes(&scene, None, &settings).unwrap();
            let without = FieldSettings { symmetry: false, ..settings };
            let whole = solve_shapes(&scene, None, &without).unwrap();
            assert_eq!(part.general.solution.mirrored, [true; 3]);
            assert_eq!(whole.general.solution.mirrored, [false; 3]);
            let [a, b] = [&part, &whole].map(|s| s.general.solution.maxwell[0][0]);
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
            let [a, b] = [&part, &whole].map(|s| shown(&scene, s));
            assert!((volume(&a) / volume(&b) - 1.0).abs() < 1e-9, "{} {}", volume(&a), volume(&b));
            let held = |body: &BodyMesh| body.arrays[0].values.iter().filter(|v| **v == 1.0).count();
            assert!(held(&a) > 8 && a.arrays[0].values.len() == a.points.len());
            assert!(part.general.mesh.tets.len() * 4 < a.nodes.len());
        }
    }

    #[test]
    fn balls_close_to_one_another_get_smaller_faces_and_touching_ones_are_named() {
        let ball =
            |name: &str, x: f64| Body::conductor(name, Shape::Sphere { center: [x, 0.0, 0.0], radius: 0.01 });
        let mut all = scene(Shape::Box(Box3 { min: [0.0; 3], max: [0.0; 3] }));
        all.domain = Box3::SPACE;
        all.walls = [[Wall::Open; 2]; 3];
        all.bodies = vec![ball("a", 0.0), ball("b", 0.0202)];
        assert!((ball_gap(&all).unwrap() - 0.02).abs() < 1e-12);
        let settings = FieldSettings { relative_tolerance: 3e-2, ..FieldSettings::default() };
        let c = solve_shapes(&all, None, &settings).unwrap();
        // Image series: 4 pi eps0 a sinh(mu) sum of 1 / sinh((2n - 1) mu), cosh(mu) = 1.01.
        let (found, known) = (c.general.solution.maxwell[0][0], 2.187_945_722_9e-12);
        let slack = c.facets * known;
        assert!(found.lower - slack < known && known < found.upper + slack, "{found:?} {slack:e}");
        all.bodies[1] = ball("b", 0.02);
        assert_eq!(ball_gap(&all).unwrap_err().to_string(), "the conductors `a` and `b` touch or cross");
    }
}

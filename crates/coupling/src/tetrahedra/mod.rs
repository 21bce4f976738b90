//! A scene of bodies of any shape: meshes it, solves it and estimates the faceting error.

mod first_mesh;
mod shown;

pub(crate) use shown::shown;

use crate::faceting_error::curvature_error;
use crate::failure::{Stop, TetrahedraError};
use crate::settings::FieldSettings;
use elastocap_case::ImportedMesh;
use elastocap_electrostatics::{
    Forecast, MeshScene, MeshSolution, SolveError, forecast_mesh, forecast_without_mesh, solve_mesh,
};
use elastocap_geometry::export::surfaces::SurfaceBody;
use elastocap_geometry::meshing::tets::{FaceRole, MeshError, Sizing, TetMesh};
use elastocap_geometry::scene::{MirrorPlane, Potential, Scene};
use elastocap_geometry::shapes::Shape;
use elastocap_geometry::turn::Turn;
use first_mesh::{FORECAST_EDGE_POINTS, First, Purpose, THIN_EDGE, first};
use shown::surfaces_of;

/// The relative error of a capacitance, over the square of the faces' size over the radius: of balls and cylinders with
/// faces that keep their volume, from the mean distance of a face to the surface.
const FACETS: f64 = 0.05;

/// A mesh with fine edges from the start has this many times the unknowns that refinement of a coarse one is expected to lead to.
const FINE_EDGES: f64 = 2.0;

/// Meshes to try where the solver does not get through.
const AGAIN: usize = 3;

/// Per axis a plane of symmetry, if there is one.
type Planes = [Option<MirrorPlane>; 3];

/// A scene solved.
pub(crate) struct Solved {
    /// Its mesh is of the part above the planes.
    pub(crate) general: MeshSolution,
    /// By which the scene was turned, if it was: mesh and planes are those of the turned scene.
    pub(crate) turn: Option<Turn>,
    /// Per axis the plane about which the scene is its own mirror image, if only one half was solved.
    pub(crate) planes: Planes,
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

/// Why a scene was not solved.
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
        first(scene, imported, settings, smaller, Purpose::Solve).map_err(failed)?;
    if let Some(conductor) = without_surface(scene, &mesh, &planes) {
        return Err(failed(TetrahedraError::NoSurface { conductor }));
    }
    // Before it is refined, which moves no surface but cuts its triangles.
    let surfaces = surfaces_of(scene, &mesh, &planes);
    let facets = faceting_error(scene, &mesh, size, gap);
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes = MeshScene { permittivity: &permittivity, potentials: &potentials, planes: &planes };
    let general = solve_mesh(mesh, shapes, &settings.tetrahedra()).map_err(|error| match error {
        SolveError::Cancelled => Unsolved::Stop(Stop::Cancelled),
        error => Unsolved::Solver(error),
    })?;
    Ok(Solved { general, turn: None, planes, surfaces, facets })
}

/// Estimate of the relative error of the capacitances for flat faces in place of curved ones: of round bodies from the size of
/// their faces (see [`First`]), of arcs, imported surfaces and meshes from the angles at which theirs meet.
fn faceting_error(scene: &Scene, mesh: &TetMesh, size: f64, gap: f64) -> f64 {
    let round = if scene.shapes().any(is_curved) {
        FACETS * size * size + (size * size / (8.0 * gap)).powi(2)
    } else {
        0.0
    };
    let faceted = |conductor: u32| {
        let is = |shape: &Shape| match shape {
            Shape::Surface(_) | Shape::Physical(_) => true,
            Shape::Extrusion { arcs, .. } => !arcs.is_empty(),
            _ => false,
        };
        scene.conductor_parts().any(|(k, shape)| k == conductor as usize && is(shape))
    };
    round.max(curvature_error(mesh, faceted))
}

/// A forecast of what solving the scene will take: it is meshed, and solved on a small mesh. An estimate, which is rough where that would take long.
///
/// # Errors
/// Why the scene cannot be meshed or solved.
pub(crate) fn forecast(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
) -> Result<Forecast, TetrahedraError> {
    let First { mesh, planes, .. } = match first(scene, imported, settings, 1.0, Purpose::Forecast) {
        Ok(first) => first,
        Err(TetrahedraError::Mesh(MeshError::Cancelled)) => {
            let sides = scene.conductors().filter(|own| own.potential != Potential::Grounded).count();
            return Ok(forecast_without_mesh(sides, &settings.tetrahedra()));
        }
        Err(error) => return Err(error),
    };
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes = MeshScene { permittivity: &permittivity, potentials: &potentials, planes: &planes };
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

/// The name of a conductor of which neither the mesh nor its mirror image has a face.
fn without_surface(scene: &Scene, mesh: &TetMesh, planes: &Planes) -> Option<String> {
    let mut meshed: Vec<bool> = vec![false; scene.conductors().count()];
    for face in &mesh.boundary {
        if let FaceRole::Conductor(k) = face.role {
            meshed.get_mut(k as usize).into_iter().for_each(|found| *found = true);
        }
    }
    for plane in planes.iter().flatten() {
        meshed = (0..meshed.len()).map(|k| meshed[k] || meshed[plane.conductors[k]]).collect();
    }
    let missing = meshed.iter().position(|found| !found)?;
    scene.conductors().nth(missing).map(|conductor| conductor.body.name.clone())
}

/// Whether a mesh has flat faces in place of its surface.
fn is_curved(shape: &Shape) -> bool {
    match shape {
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. } => true,
        Shape::Box(_) | Shape::Extrusion { .. } | Shape::Surface(_) | Shape::Physical(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_electrostatics::{ExtrudedSolution, Target, solve_extruded};
    use elastocap_geometry::export::body::BodyMesh;
    use elastocap_geometry::meshing::tets::determinant;
    use elastocap_geometry::scene::{Body, Box3, Wall};
    use first_mesh::{FLAT, ball_gap, flatness};

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
            let [a, b] = [&part, &whole].map(|s| shown(&scene, s, Target::Matrix));
            assert!((volume(&a) / volume(&b) - 1.0).abs() < 1e-9, "{} {}", volume(&a), volume(&b));
            let held = |body: &BodyMesh| body.arrays[0].values.iter().filter(|v| **v == 1.0).count();
            assert!(held(&a) > 8 && a.arrays[0].values.len() == a.points.len());
            assert!(part.general.mesh.tets.len() * 4 < a.nodes.len());
        }
    }

    #[test]
    fn bodies_that_change_places_are_shown_at_their_own_potentials() {
        let ball = |name: &str, x: f64, z: f64| {
            Body::conductor(name, Shape::Sphere { center: [x, 0.0, z], radius: 0.25 })
        };
        let mut all = scene(Shape::Sphere { center: [0.0; 3], radius: 1.0 });
        all.bodies =
            vec![ball("a", -0.5, -0.4), ball("b", 0.5, -0.4), ball("c", -0.5, 0.4), ball("d", 0.5, 0.4)];
        for wall in [Wall::Grounded, Wall::Insulated] {
            all.walls = [[wall; 2]; 3];
            let settings = FieldSettings { relative_tolerance: 0.2, ..FieldSettings::default() };
            let solved = solve_shapes(&all, None, &settings).unwrap();
            assert_eq!(solved.general.solution.mirrored, [true; 3]);
            let MeshSolution { mesh, potentials, .. } = &solved.general;
            let held = [1.0, 0.25, -0.5, 2.0];
            let (whole, values) = shown::on_whole(mesh, potentials, &held, &solved.planes);
            let mut faces = [0; 4];
            for face in &whole.boundary {
                if let FaceRole::Conductor(k) = face.role {
                    faces[k as usize] += 1;
                    for p in face.face {
                        let off = values[p as usize] - held[k as usize];
                        assert!(off.abs() < 1e-9, "{wall:?}, {k}: {off:e}");
                    }
                }
            }
            assert!(faces.iter().all(|count| *count > 8), "{faces:?}");
        }
    }

    #[test]
    fn the_field_of_a_scene_that_was_turned_is_shown_where_its_bodies_are() {
        let middles = [[0.4, 0.0, 0.1], [2.8, 0.0, 1.9]];
        let disc = |name: &str, base: [f64; 3]| {
            Body::conductor(name, Shape::Cylinder { axis: 1, base, radius: 1.0, height: 0.1 })
        };
        let mut all = scene(Shape::Sphere { center: [0.0; 3], radius: 1.0 });
        (all.domain, all.walls) = (Box3::SPACE, [[Wall::Open; 2]; 3]);
        all.bodies = vec![disc("a", middles[0]), disc("b", middles[1])];
        let settings = FieldSettings { relative_tolerance: 0.2, field: true, ..FieldSettings::default() };
        let ExtrudedSolution { solution, turn, planes, field } =
            solve_extruded(&all, &settings.boxes()).unwrap();
        assert!(turn.is_some());
        let (mesh, potentials) = field.unwrap();
        let general = MeshSolution { mesh, potentials, solution };
        let body =
            shown(&all, &Solved { general, turn, planes, surfaces: Vec::new(), facets: 0.0 }, Target::Matrix);
        let mut on = [0; 2];
        for (point, value) in body.points.iter().zip(&body.arrays[0].values) {
            for (k, volts) in [0.5, -0.5].into_iter().enumerate() {
                let [x, z] = [point[0] - middles[k][0], point[2] - middles[k][2]];
                if x.hypot(z) < 1.0 - 1e-9 && (0.0..=0.1).contains(&point[1]) {
                    assert!((value - volts).abs() < 1e-9, "{point:?}: {value}");
                    on[k] += 1;
                }
            }
        }
        assert!(on.iter().all(|count| *count > 8), "{on:?}");
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

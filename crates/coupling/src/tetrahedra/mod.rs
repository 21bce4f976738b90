//! The solver on tetrahedra for bodies of any shape: meshes a scene, solves it and estimates the faceting
//! error.

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

/// The relative faceting error of a capacitance, over the square of the ratio of face size to radius, for
/// balls and cylinders whose facets preserve their volume: the error is due to the mean distance of a facet
/// to the surface. Measured: `benches/peers/capacitance.py --only elastocap --scene two-spheres`.
const FACETS: f64 = 0.05;

/// The ratio of the unknowns of a mesh with fine edges to those expected from refinement of a coarse mesh.
/// Measured: `benches/forecast.py`.
const FINE_EDGES: f64 = 2.0;

/// Number of meshes to try if the solver fails. It is not tuned.
const MESH_TRIES: usize = 3;

/// The plane of symmetry of each axis, if there is one.
type Planes = [Option<MirrorPlane>; 3];

/// The solution of a scene.
pub(crate) struct Solved {
    /// The solution and its mesh, of the part of the scene above the mirror planes.
    pub(crate) found: MeshSolution,
    /// The rotation of the scene before the solve, if any: mesh and planes are those of the rotated scene.
    pub(crate) turn: Option<Turn>,
    /// For each axis, the mirror plane if only the half above it was solved.
    pub(crate) planes: Planes,
    /// The surfaces of the whole bodies for a viewer.
    pub(crate) surfaces: Vec<SurfaceBody>,
    /// An estimate of the relative faceting error; zero where all bodies are flat-faced.
    pub(crate) facets: f64,
}

/// Solves a scene on its imported mesh, or on one that is made for it.
pub(crate) fn solve_shapes(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
) -> Result<Solved, Stop> {
    let mut size = 1.0;
    let mut tries = MESH_TRIES;
    loop {
        tries -= 1;
        // Where bodies intersect at shallow angles, other face sizes may give rounder tetrahedra.
        match solve_at(scene, imported, settings, size) {
            Err(Unsolved::Solver(_)) if tries > 0 && imported.is_none() => size *= 0.8,
            Err(Unsolved::Solver(error)) => return Err(error.into()),
            Err(Unsolved::Stop(stop)) => return Err(stop),
            Ok(solved) => return Ok(solved),
        }
    }
}

/// The failure of a solve.
enum Unsolved {
    /// The solver failed on this mesh.
    Solver(SolveError),
    /// Another mesh would not help.
    Stop(Stop),
}

/// Solves a scene on its imported mesh, or on one whose face sizes are multiplied by `smaller`.
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
    // Taken before the refinement, which moves no surface but splits its triangles.
    let surfaces = surfaces_of(scene, &mesh, &planes);
    let facets = faceting_error(scene, &mesh, size, gap);
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes = MeshScene { permittivity: &permittivity, potentials: &potentials, planes: &planes };
    let found = solve_mesh(mesh, shapes, &settings.tetrahedra()).map_err(|error| match error {
        SolveError::Cancelled => Unsolved::Stop(Stop::Cancelled),
        error => Unsolved::Solver(error),
    })?;
    Ok(Solved { found, turn: None, planes, surfaces, facets })
}

/// An estimate of the relative faceting error of capacitances: for round bodies from the size of their faces
/// (see [`First`]), for arcs, imported surfaces and meshes from the angles at which their faces meet.
fn faceting_error(scene: &Scene, mesh: &TetMesh, size: f64, gap: f64) -> f64 {
    let round = if scene.shapes().any(is_curved) {
        FACETS * size * size + (size * size / (8.0 * gap)).powi(2)
    } else {
        0.0
    };
    let faceted = |conductor: u32| {
        let is_faceted = |shape: &Shape| match shape {
            Shape::Surface(_) | Shape::Physical(_) => true,
            Shape::Extrusion { arcs, .. } => !arcs.is_empty(),
            _ => false,
        };
        scene.conductor_parts().any(|(k, shape)| k == conductor as usize && is_faceted(shape))
    };
    round.max(curvature_error(mesh, faceted))
}

/// A forecast of the cost of solving a scene: it is meshed, and solved on a small mesh. The forecast is rough
/// where that would take long.
///
/// # Errors
/// The scene cannot be meshed or solved.
pub(crate) fn forecast(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
) -> Result<Forecast, TetrahedraError> {
    let First { mesh, planes, .. } = match first(scene, imported, settings, 1.0, Purpose::Forecast) {
        Ok(first) => first,
        Err(TetrahedraError::Mesh(MeshError::Cancelled)) => {
            let right_hand_sides =
                scene.conductors().filter(|conductor| conductor.potential != Potential::Grounded).count();
            return Ok(forecast_without_mesh(right_hand_sides, &settings.tetrahedra()));
        }
        Err(error) => return Err(error),
    };
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes = MeshScene { permittivity: &permittivity, potentials: &potentials, planes: &planes };
    let forecast = forecast_mesh(mesh, shapes, &settings.tetrahedra())?;
    let edges = Sizing { thin_edge: THIN_EDGE * settings.relative_tolerance, ..Sizing::default() };
    let is_coarser = edges.points_along_thin_edges(scene).is_some_and(|points| points > FORECAST_EDGE_POINTS);
    if imported.is_some() || !is_coarser {
        return Ok(forecast);
    }
    let scaled = |count: usize| (FINE_EDGES * count as f64) as usize;
    let memory = (FINE_EDGES * forecast.memory_bytes as f64) as u64;
    Ok(Forecast {
        unknowns: scaled(forecast.unknowns),
        // The solver makes no mesh beyond the memory limit.
        memory_bytes: memory.min(settings.memory_limit.max(forecast.memory_bytes)),
        seconds: FINE_EDGES * forecast.seconds,
        unmirrored: (scaled(forecast.unmirrored.0), FINE_EDGES * forecast.unmirrored.1),
        ..forecast
    })
}

/// The name of a conductor without a face in the mesh and its mirror images, if any.
fn without_surface(scene: &Scene, mesh: &TetMesh, planes: &Planes) -> Option<String> {
    let mut meshed: Vec<bool> = vec![false; scene.conductors().count()];
    for face in &mesh.boundary {
        if let FaceRole::Conductor(k) = face.role {
            meshed.get_mut(k as usize).into_iter().for_each(|is_meshed| *is_meshed = true);
        }
    }
    for plane in planes.iter().flatten() {
        meshed = (0..meshed.len()).map(|k| meshed[k] || meshed[plane.conductors[k]]).collect();
    }
    let missing = meshed.iter().position(|is_meshed| !is_meshed)?;
    scene.conductors().nth(missing).map(|conductor| conductor.body.name.clone())
}

/// Whether a mesh replaces the surface of a shape by facets.
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
        // The disc is meshed in layers, the sphere by the other mesher.
        assert!(flatness(&scene(disc.clone())) > FLAT);
        for shape in [disc, Shape::Sphere { center: [0.0; 3], radius: 0.5 }] {
            let scene = scene(shape);
            let settings = FieldSettings { relative_tolerance: 0.15, ..FieldSettings::default() };
            let part = solve_shapes(&scene, None, &settings).unwrap();
            let without = FieldSettings { symmetry: false, ..settings };
            let whole = solve_shapes(&scene, None, &without).unwrap();
            assert_eq!(part.found.solution.mirrored, [true; 3]);
            assert_eq!(whole.found.solution.mirrored, [false; 3]);
            let [a, b] = [&part, &whole].map(|s| s.found.solution.maxwell[0][0]);
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
            let [a, b] = [&part, &whole].map(|s| shown(&scene, s, Target::Matrix));
            assert!((volume(&a) / volume(&b) - 1.0).abs() < 1e-9, "{} {}", volume(&a), volume(&b));
            let held = |body: &BodyMesh| body.arrays[0].values.iter().filter(|v| **v == 1.0).count();
            assert!(held(&a) > 8 && a.arrays[0].values.len() == a.points.len());
            assert!(part.found.mesh.tets.len() * 4 < a.nodes.len());
        }
    }

    #[test]
    fn bodies_that_change_places_are_shown_at_their_own_potentials() {
        let ball = |name: &str, x: f64, z: f64| {
            Body::conductor(name, Shape::Sphere { center: [x, 0.0, z], radius: 0.25 })
        };
        let mut whole_scene = scene(Shape::Sphere { center: [0.0; 3], radius: 1.0 });
        whole_scene.bodies =
            vec![ball("a", -0.5, -0.4), ball("b", 0.5, -0.4), ball("c", -0.5, 0.4), ball("d", 0.5, 0.4)];
        for wall in [Wall::Grounded, Wall::Insulated] {
            whole_scene.walls = [[wall; 2]; 3];
            let settings = FieldSettings { relative_tolerance: 0.2, ..FieldSettings::default() };
            let solved = solve_shapes(&whole_scene, None, &settings).unwrap();
            assert_eq!(solved.found.solution.mirrored, [true; 3]);
            let MeshSolution { mesh, potentials, .. } = &solved.found;
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
        let mut whole_scene = scene(Shape::Sphere { center: [0.0; 3], radius: 1.0 });
        (whole_scene.domain, whole_scene.walls) = (Box3::SPACE, [[Wall::Open; 2]; 3]);
        whole_scene.bodies = vec![disc("a", middles[0]), disc("b", middles[1])];
        let settings = FieldSettings { relative_tolerance: 0.2, field: true, ..FieldSettings::default() };
        let ExtrudedSolution { solution, turn, planes, field } =
            solve_extruded(&whole_scene, &settings.boxes()).unwrap();
        assert!(turn.is_some());
        let (mesh, potentials) = field.unwrap();
        let found = MeshSolution { mesh, potentials, solution };
        let body = shown(
            &whole_scene,
            &Solved { found, turn, planes, surfaces: Vec::new(), facets: 0.0 },
            Target::Matrix,
        );
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
        let mut whole_scene = scene(Shape::Box(Box3 { min: [0.0; 3], max: [0.0; 3] }));
        whole_scene.domain = Box3::SPACE;
        whole_scene.walls = [[Wall::Open; 2]; 3];
        whole_scene.bodies = vec![ball("a", 0.0), ball("b", 0.0202)];
        assert!((ball_gap(&whole_scene).unwrap() - 0.02).abs() < 1e-12);
        let settings = FieldSettings { relative_tolerance: 3e-2, ..FieldSettings::default() };
        let c = solve_shapes(&whole_scene, None, &settings).unwrap();
        // Image series: 4 pi eps0 a sinh(mu) sum of 1 / sinh((2n - 1) mu), cosh(mu) = 1.01.
        let (found, known) = (c.found.solution.maxwell[0][0], 2.187_945_722_9e-12);
        let slack = c.facets * known;
        assert!(found.lower - slack < known && known < found.upper + slack, "{found:?} {slack:e}");
        whole_scene.bodies[1] = ball("b", 0.02);
        assert_eq!(
            ball_gap(&whole_scene).unwrap_err().to_string(),
            "the conductors `a` and `b` touch or cross"
        );
    }
}

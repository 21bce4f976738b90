//! Forecasts of the cost of a solve on tetrahedra: a small mesh is solved, and the spread of its bounds
//! extrapolated.

use crate::error::SolveError;
use crate::parity::Parity;
use crate::solution::Forecast;
use crate::tets::adaptive::solve_mesh;
use crate::tets::mesh_scene::{MeshScene, MeshSolution};
use crate::tets::one_mesh::{BYTES, memory_of};
use crate::tets::parity::parities;
use crate::tets::settings::TetrahedraSettings;
use crate::tets::spread::spread;
use elastocap_geometry::meshing::tets::TetMesh;

/// Largest number of tetrahedra of a mesh that is solved for a forecast, unless the initial mesh has more.
/// Measured: `benches/forecast.py`.
const MAX_FORECAST_TETRAHEDRA: usize = 20_000;

/// Largest processor time, seconds, with which the initial mesh is solved for a forecast. Not tuned: what
/// `check` may take.
const MAX_SECONDS: f64 = 3.0;

/// Largest memory, bytes, with which the initial mesh is solved for a forecast. Not tuned: what `check` may
/// take.
const MAX_BYTES: u64 = 120 << 20;

/// Approximate spread on an initial mesh that is not solved. Measured: `benches/forecast.py --drawn 200`.
const ROUGH_SPREAD: f64 = 0.4;

/// For each order, unknowns per tetrahedron. Measured: `benches/forecast.py --drawn 200`.
const UNKNOWNS: [f64; 3] = [0.2, 1.4, 4.7];

/// Tetrahedra of the initial mesh of a scene that could not be meshed for a forecast. Measured:
/// `benches/forecast.py --drawn 200`.
const ROUGH_TETRAHEDRA: usize = 200_000;

/// For each order, the power of the number of unknowns with which the spread falls from a small mesh to the
/// last one. Measured: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const RATE: [f64; 3] = [0.65, 1.2, 1.2];

/// For each order, seconds per unknown of the last mesh, for all meshes with one right-hand side, on two
/// cores. Measured: `benches/forecast.py`.
const PACE: [f64; 3] = [3e-5, 2.7e-5, 8e-5];

/// Time of each further right-hand side over that of the first. Measured: `benches/forecast.py`.
const FURTHER_SIDE: f64 = 0.25;

/// Factor on the unknowns from the usual rate where a small mesh does not reach the tolerance: 0.7 to 2.7
/// times as many were needed (`benches/forecast.py --drawn`), most where edges have yet to be resolved.
/// Measured: `benches/forecast.py`.
const UNRESOLVED: f64 = 1.4;

/// Safety factor on a forecast of memory. Measured: `benches/forecast.py --drawn 200`.
const SPARE: f64 = 2.0;

/// Safety factor on the limit of memory that the solver keeps to. Measured: `benches/forecast.py --drawn
/// 200`.
const SPARE_OF_LIMIT: f64 = 1.25;

/// The memory of the program without a mesh, bytes. Measured: `benches/forecast.py --drawn 200`.
const PROGRAM: u64 = 36 << 20;

/// Forecasts unknowns, memory and time of [`solve_mesh()`]. It solves as far as a small mesh goes and
/// extrapolates the spread from there at the rate that is usual for the order. The estimate is within a
/// factor of about two for scenes whose edges the small mesh resolves.
///
/// # Errors
///
/// Those of [`solve_mesh()`].
pub fn forecast_mesh(
    mesh: TetMesh,
    scene: MeshScene<'_>,
    settings: &TetrahedraSettings,
) -> Result<Forecast, SolveError> {
    scene.check()?;
    let n = scene.potentials.len();
    let parities: Vec<Parity> = parities(&mesh, scene.planes, scene.potentials)
        .into_iter()
        .filter(|parity| !parity.is_constant())
        .collect();
    let sides: usize = parities.iter().map(Parity::sides).sum();
    let order = settings.order.clamp(1, 3) - 1;
    let expected = UNKNOWNS[order] * mesh.tets.len() as f64;
    let bytes = memory_of(mesh.tets.len(), &parities, settings);
    if 2.0 * seconds_for(expected, order, parities.len(), sides) > MAX_SECONDS || bytes > MAX_BYTES {
        return Ok(rough(expected, bytes, [parities.len(), sides], scene.mirrored(), settings));
    }
    let small = TetrahedraSettings {
        memory_limit: settings
            .memory_limit
            .min(memory_of(MAX_FORECAST_TETRAHEDRA, &parities, settings))
            .min(MAX_BYTES),
        ..settings.clone()
    };
    let MeshSolution { mesh, solution, .. } = solve_mesh(mesh, scene, &small)?;
    // With zeros, no entry counts as negligible.
    let alone = vec![0.0; n];
    let pair = solution.two_terminal.as_ref();
    let error = spread(&solution.maxwell, pair, solution.measured.as_ref(), &alone, settings).error;
    let excess = if solution.reached { 1.0 } else { (error / settings.relative_tolerance).max(1.0) };
    let memory = |growth: f64| memory_of((mesh.tets.len() as f64 * growth) as usize, &parities, settings);
    // The solver makes no mesh that would not fit into memory.
    let max_growth = (settings.memory_limit as f64 / memory(1.0).max(1) as f64).max(1.0);
    let unresolved = if solution.reached { 1.0 } else { UNRESOLVED };
    let growth = (unresolved * excess.powf(1.0 / RATE[order])).min(max_growth);
    let unknowns = (solution.unknowns as f64 * growth) as usize;
    // There is one matrix per parity; the whole scene would have a single one.
    let time = |matrices: usize, sides: usize| seconds_for(unknowns as f64, order, matrices, sides);
    let seconds = time(parities.len(), sides);
    let copies = scene.copies();
    Ok(Forecast {
        unknowns,
        memory_bytes: with_spare(memory(growth) as f64, settings),
        seconds,
        unmirrored: (copies as usize * unknowns, f64::from(copies) * time(1, n)),
        mirrored: scene.mirrored(),
        turned: false,
        right_hand_sides: sides,
        is_rough: false,
    })
}

/// The memory of the program for a last mesh of `bytes` bytes.
fn with_spare(bytes: f64, settings: &TetrahedraSettings) -> u64 {
    let limit = SPARE_OF_LIMIT * bytes.max(settings.memory_limit as f64);
    PROGRAM + (SPARE * bytes).min(limit) as u64
}

/// Seconds for a number of matrices with `unknowns` unknowns; `sides` counts the right-hand sides of all of
/// them.
fn seconds_for(unknowns: f64, order: usize, matrices: usize, sides: usize) -> f64 {
    PACE[order] * unknowns * (matrices as f64 + FURTHER_SIDE * sides.saturating_sub(matrices) as f64)
}

/// The forecast from the size of an initial mesh that is not solved.
fn rough(
    unknowns: f64,
    bytes: u64,
    [matrices, sides]: [usize; 2],
    mirrored: [bool; 3],
    settings: &TetrahedraSettings,
) -> Forecast {
    let order = settings.order.clamp(1, 3) - 1;
    let growth = (ROUGH_SPREAD / settings.relative_tolerance).max(1.0).powf(1.0 / RATE[order]);
    // The solver makes no mesh that would not fit into memory.
    let growth = growth.min((settings.memory_limit as f64 / bytes.max(1) as f64).max(1.0));
    let unknowns = growth * unknowns;
    let seconds = seconds_for(unknowns, order, matrices, sides);
    let copies = 1_usize << mirrored.iter().filter(|m| **m).count();
    Forecast {
        unknowns: unknowns as usize,
        memory_bytes: with_spare(growth * bytes as f64, settings),
        seconds,
        unmirrored: (copies * unknowns as usize, copies as f64 * seconds),
        mirrored,
        turned: false,
        right_hand_sides: sides,
        is_rough: true,
    }
}

/// A rough forecast for a scene that takes too long to be meshed for one; `sides` is the number of its driven
/// and floating conductors.
pub fn forecast_without_mesh(sides: usize, settings: &TetrahedraSettings) -> Forecast {
    let order = settings.order.clamp(1, 3) - 1;
    let (each, per_side) = BYTES[order];
    let bytes = ROUGH_TETRAHEDRA as u64 * (each + sides as u64 * per_side);
    let unknowns = UNKNOWNS[order] * ROUGH_TETRAHEDRA as f64;
    let forecast = rough(unknowns, bytes, [1, sides.max(1)], [false; 3], settings);
    // The size of the initial mesh is unknown, but the solver makes no mesh that would exceed this limit.
    Forecast { memory_bytes: settings.memory_limit, ..forecast }
}

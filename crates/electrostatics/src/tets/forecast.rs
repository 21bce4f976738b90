//! What the solver on tetrahedra will take: a small mesh is solved, and the spread of its bounds extrapolated.

use crate::SolveError;
use crate::parity::Parity;
use crate::solution::Forecast;
use crate::tets::adaptive::{MeshScene, MeshSolution, TetrahedraSettings, memory_of, solve_mesh};
use crate::tets::parity::parities;
use crate::tets::spread::spread;
use elastocap_geometry::meshing::tets::TetMesh;

/// Largest number of tetrahedra of a mesh that is solved for a forecast, unless the initial mesh has more.
const MAX_FORECAST_TETRAHEDRA: usize = 20_000;

/// For each order, the power of the number of unknowns with which the spread falls from a small mesh to the last one.
const RATE: [f64; 3] = [0.65, 1.2, 1.2];

/// For each order, seconds per unknown of the last mesh, for all meshes with one right-hand side, on two cores.
const PACE: [f64; 3] = [3e-5, 2.7e-5, 8e-5];

/// Time of each further right-hand side over that of the first.
const FURTHER_SIDE: f64 = 0.25;

/// More unknowns than the usual rate says where a small mesh does not reach the tolerance: 0.7 to 2.7 times as many were needed
/// (docs/forecasts.md), most where edges have yet to be resolved.
const UNRESOLVED: f64 = 1.4;

/// Factor on a forecast of memory, and what the program takes without a mesh, bytes. With them the forecast was never too low.
const SPARE: f64 = 1.25;
const PROGRAM: u64 = 32 << 20;

/// Forecasts unknowns, memory and time of [`solve_mesh()`]. It solves as far as a small mesh goes and extrapolates the spread from
/// there at the rate that is usual for the order. The estimate is within a factor of about two for scenes whose edges the small
/// mesh resolves.
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
    let small = TetrahedraSettings {
        memory_limit: settings.memory_limit.min(memory_of(MAX_FORECAST_TETRAHEDRA, &parities, settings)),
        ..settings.clone()
    };
    let MeshSolution { mesh, solution, .. } = solve_mesh(mesh, scene, &small)?;
    let alone = vec![0.0; n];
    let pair = solution.two_terminal.as_ref();
    let error = spread(&solution.maxwell, pair, solution.measured.as_ref(), &alone, settings).error;
    let order = settings.order.clamp(1, 3) - 1;
    let far = if solution.reached { 1.0 } else { (error / settings.relative_tolerance).max(1.0) };
    let memory = |growth: f64| memory_of((mesh.tets.len() as f64 * growth) as usize, &parities, settings);
    // The solver makes no mesh that would not fit into memory.
    let max_growth = (settings.memory_limit as f64 / memory(1.0).max(1) as f64).max(1.0);
    let unresolved = if solution.reached { 1.0 } else { UNRESOLVED };
    let growth = (unresolved * far.powf(1.0 / RATE[order])).min(max_growth);
    let unknowns = (solution.unknowns as f64 * growth) as usize;
    // Each parity has a matrix of its own, and the whole would have one.
    let time = |matrices: usize, sides: usize| {
        PACE[order]
            * unknowns as f64
            * (matrices as f64 + FURTHER_SIDE * sides.saturating_sub(matrices) as f64)
    };
    let seconds = time(parities.len(), sides);
    let copies = scene.copies();
    Ok(Forecast {
        unknowns,
        memory_bytes: PROGRAM + (SPARE * memory(growth) as f64) as u64,
        seconds,
        unmirrored: (copies as usize * unknowns, f64::from(copies) * time(1, n)),
        mirrored: scene.mirrored(),
        turned: false,
        right_hand_sides: sides,
    })
}

//! The adaptive solver on tetrahedra, for scenes of any shape: solve, bound, refine where the bounds differ
//! most.
//!
//! On each mesh the potentials give the upper bound ([`crate::tets::potentials`]) and fluxes made from them
//! the lower one ([`crate::tets::flux`]). The gap between the two is a sum over tetrahedra. They are bisected
//! so that all of them hold equally much of the gap ([`Refinement`]). This is repeated until the tolerance is
//! met or the next mesh would not fit into memory.
//!
//! One part of a symmetric scene is solved once for each parity of potentials ([`crate::tets::parity`]), on
//! one mesh.

use crate::consistency::contradiction;
use crate::error::SolveError;
use crate::shortfall::Shortfall;
use crate::solution::{Discretisation, PhaseSeconds, Solution};
use crate::tets::mesh_scene::{MeshScene, MeshSolution};
use crate::tets::one_mesh::{Coarser, Task};
use crate::tets::refinement::Refinement;
use crate::tets::settings::TetrahedraSettings;
use elastocap_geometry::meshing::tets::{Bisected, TetMesh};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Largest spread at which the bounds of a coarser mesh are still worth reporting if a finer mesh cannot be
/// solved. Not tuned: a choice of what is still worth reporting.
const MAX_USEFUL_SPREAD: f64 = 0.3;

/// Solves for the Maxwell capacitance matrix of a mesh's conductors with proved bounds, refining the mesh
/// until they meet the tolerance. Where they cannot, [`Solution::shortfall`] says why.
///
/// # Errors
///
/// If the mesh is not what [`TetMesh`] promises, if the solve fails or is stopped before there are useful
/// bounds, or if proved bounds contradict each other.
pub fn solve_mesh(
    mesh: TetMesh,
    scene: MeshScene<'_>,
    settings: &TetrahedraSettings,
) -> Result<MeshSolution, SolveError> {
    scene.check()?;
    let task = Task::new(&mesh, scene, settings);
    let cancel = settings.cancel.as_deref();
    let mut mesh = mesh;
    let mut refinement = Refinement::new(&mesh);
    let mut seconds = PhaseSeconds::default();
    let mut iterations = 0;
    let mut meshes = 0;
    let mut coarser: Option<Coarser> = None;
    loop {
        meshes += 1;
        let (parities, bounds) = match task.bounded(&mesh, coarser.as_ref(), &mut seconds) {
            Ok(solved) => solved,
            Err(error @ SolveError::Contradiction(_)) => return Err(error),
            Err(error) => {
                // The bounds on the mesh before are proved all the same.
                let useful = coarser.filter(|c| c.error < MAX_USEFUL_SPREAD);
                let mut last = useful.ok_or_else(|| error.clone())?.solved;
                last.solution.shortfall = Some(match error {
                    SolveError::Cancelled => Shortfall::Stopped,
                    error => Shortfall::FinerMesh(Box::new(error)),
                });
                last.solution.seconds = seconds;
                return Ok(last);
            }
        };
        iterations += parities.iter().map(|parity| parity.potentials.iterations).max().unwrap_or(0);
        let error = bounds.spread.error;
        let (next, shortfall) = if error <= settings.relative_tolerance {
            (None, bounds.spread.may_be_zero.then(|| task.may_be_zero()))
        } else if cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            (None, Some(Shortfall::Stopped))
        } else {
            let refining = Instant::now();
            let refined = refinement.next(&task, &mesh, &bounds.unreduced, &parities, error);
            seconds.setup += refining.elapsed().as_secs_f64();
            match refined {
                Ok(finer) => (Some(finer), None),
                Err(shortfall) => (None, Some(shortfall)),
            }
        };
        let solved = MeshSolution {
            potentials: task.potentials(&parities, mesh.points.len()),
            solution: Solution {
                floating: task.floating.proved(&bounds.unreduced),
                maxwell: bounds.maxwell,
                two_terminal: bounds.two_terminal,
                measured: bounds.measured,
                reached: shortfall.is_none() && next.is_none(),
                shortfall,
                unknowns: parities.iter().map(|parity| parity.potentials.unknowns).max().unwrap_or(0),
                iterations,
                grids: meshes,
                mirrored: scene.mirrored(),
                resolution: Discretisation::Tetrahedra { order: settings.order, refinements: meshes - 1 },
                repair_share: 0.0,
                seconds,
                field: None,
                foresight: None,
                with_error_of_base: None,
            },
            mesh,
        };
        if let Some(what) = contradiction(&solved.solution, &bounds.unreduced, &task.floating) {
            return Err(SolveError::Contradiction(what));
        }
        let Some(Bisected { mesh: finer, origin, .. }) = next else { return Ok(solved) };
        mesh = finer;
        let potentials = parities.into_iter().map(|parity| parity.potentials.into_coarser()).collect();
        coarser = Some(Coarser { solved, potentials, origin, error });
    }
}

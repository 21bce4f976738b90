//! Refinement of meshes: bisection where the bounds differ most, as far as the tolerance needs.
//!
//! Tetrahedra are bisected so that all hold equally much of the gap (equidistribution: Babuška and
//! Rheinboldt, SIAM J. Numer. Anal. 15, 1978), nearer to an edge of a conductor if they touch one
//! ([`Grading`]).

use crate::matrix::MatrixBounds;
use crate::shortfall::Shortfall;
use crate::tets::marking::Growth;
use crate::tets::one_mesh::{SolvedParity, Task, memory_of};
use elastocap_geometry::meshing::tets::{Bisected, Grading, TetMesh};

/// Share of the tolerance that meshes aim at: forecasts are not exact, and one mesh more costs as much as all
/// before. Tuned: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const GOAL: f64 = 0.9;

/// Smallest ratio of the tetrahedra of a mesh to those of the one before: a mesh that is hardly finer would
/// cost as much as the last and gain nothing. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const MIN_GROWTH: f64 = 1.15;

/// How much larger a mesh may be than the one before; conformity about doubles both. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const GROWTH: Growth = Growth { usual: 1.3, last: 1.7 };

/// Largest factor by which the remaining gap is assumed to exceed its forecast, as it did on the mesh before.
/// Tuned: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const MAX_EXCESS: f64 = 1.3;

/// Refinement no longer helps where a larger share of the spread than this lies in open space beyond the
/// mesh.
const MAX_BEYOND: f64 = 0.66;

/// Largest number of refinements of one solve. Not tuned: a limit that ordinary cases do not reach.
const MAX_REFINEMENTS: usize = 60;

/// The refinements of one solve.
pub(super) struct Refinement {
    /// Where edges are divided in bisections.
    grading: Grading,
    /// Number of refinements so far.
    count: usize,
    /// The relative spread on the mesh before the last.
    spread: f64,
    /// The relative spread of the last mesh as forecast from the mesh before.
    forecast: Option<f64>,
}

impl Refinement {
    /// The state before the first refinement, of `mesh`.
    pub(super) fn new(mesh: &TetMesh) -> Self {
        Self { grading: Grading::towards_edges(mesh), count: 0, spread: f64::INFINITY, forecast: None }
    }

    /// The next mesh after one on which the relative spread is `error`.
    ///
    /// # Errors
    /// [`Shortfall`] if the mesh is not refined any more.
    pub(super) fn next(
        &mut self,
        task: &Task<'_>,
        mesh: &TetMesh,
        bounds: &MatrixBounds,
        parities: &[SolvedParity],
        error: f64,
    ) -> Result<Bisected, Shortfall> {
        let settings = task.settings;
        if self.count >= MAX_REFINEMENTS {
            return Err(Shortfall::MaxRefinements { refinements: self.count });
        }
        // Graded bisection can make tetrahedra so thin that the fluxes lose more than the potentials gain.
        // From then on edges are halved.
        if error > self.spread {
            self.grading = Grading::none(mesh);
        }
        let excess = self.forecast.map_or(1.0, |forecast| (error / forecast).clamp(1.0, MAX_EXCESS));
        let rounding = task.rounding_spread(bounds);
        if rounding > settings.relative_tolerance {
            return Err(Shortfall::Rounding { error: rounding });
        }
        let (gaps, outside) = task.gaps(parities, bounds);
        if gaps.are_zero() || (outside > MAX_BEYOND && outside * error > settings.relative_tolerance) {
            return Err(Shortfall::OpenSpace);
        }
        let enough = (MIN_GROWTH * mesh.tets.len() as f64) as usize;
        let aim = GOAL * settings.relative_tolerance / (error * excess);
        let mut share = aim;
        let (finer, grading, left) = loop {
            let mut grading = self.grading.clone();
            let bisections = gaps.bisected_to(share, &GROWTH);
            let finer = mesh.bisected_towards(&bisections.times, &mut grading);
            if finer.mesh.tets.len() >= enough || share < 1e-3 * aim {
                break (finer, grading, bisections.left);
            }
            share *= 0.8;
        };
        let tetrahedra = finer.mesh.tets.len();
        let memory = memory_of(tetrahedra, &task.parities, settings);
        if memory > settings.memory_limit {
            return Err(Shortfall::LargeMesh { tetrahedra, bytes: memory, limit: settings.memory_limit });
        }
        *self = Self { grading, count: self.count + 1, spread: error, forecast: Some(left * error) };
        Ok(finer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solution::PhaseSeconds;
    use crate::tets::mesh_scene::MeshScene;
    use crate::tets::settings::TetrahedraSettings;
    use elastocap_geometry::meshing::tets::of_boxes;
    use elastocap_geometry::scene::{Body, Box3, Potential, Scene, Wall};
    use elastocap_geometry::shapes::Shape;

    #[test]
    fn every_mesh_has_a_seventh_more_tetrahedra_than_the_one_before_however_near_the_goal_is() {
        let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
        let whole = Scene {
            bodies: vec![Body::conductor("inner", Shape::Box(cube(0.5)))],
            background_permittivity: 1.0,
            domain: cube(1.0),
            walls: [[Wall::Grounded; 2]; 3],
        };
        let line: Vec<f64> = (0..=8).map(|i| -1.0 + 0.25 * f64::from(i)).collect();
        let mesh = of_boxes(&whole, &[line.clone(), line.clone(), line]);
        let scene =
            MeshScene { permittivity: &[1.0], potentials: &[Potential::Driven], planes: &[None, None, None] };
        let mut settings = TetrahedraSettings::default();
        let task = Task::new(&mesh, scene, &settings);
        let (parities, bounds) = task.bounded(&mesh, None, &mut PhaseSeconds::default()).unwrap();
        let error = bounds.spread.error;
        for nearly in [0.5, 0.9, 0.99, 0.9999] {
            settings.relative_tolerance = nearly * error;
            let task = Task::new(&mesh, scene, &settings);
            let finer =
                Refinement::new(&mesh).next(&task, &mesh, &bounds.unreduced, &parities, error).unwrap().mesh;
            let growth = finer.tets.len() as f64 / mesh.tets.len() as f64;
            assert!(growth >= MIN_GROWTH, "{nearly}: {growth}");
        }
    }
}

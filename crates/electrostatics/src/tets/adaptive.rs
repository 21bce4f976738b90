//! The adaptive solver on tetrahedra, for scenes of any shape: solve, bound, refine where the bounds differ most.
//!
//! On each mesh the potentials give the upper bound ([`crate::tets::potentials`]) and fluxes made from them the lower one
//! ([`crate::tets::flux`]). The gap between the two is a sum over tetrahedra. Those that hold most of it are bisected (bulk
//! marking: Dörfler, SIAM J. Numer. Anal. 33, 1996), nearer to an edge of a conductor if they touch one ([`Grading`]). This is
//! repeated until the tolerance is met or the next mesh would not fit into memory.

use crate::SolveError;
use crate::VACUUM_PERMITTIVITY;
use crate::consistency::contradiction;
use crate::floating::Floating;
use crate::matrix::{MatrixBounds, contrast_of, rounding_alone, rounding_scale};
use crate::solution::{
    Bounded, Discretisation, Forecast, PhaseSeconds, SHARE_OF_DIAGONAL, STOPPED, Solution, Target,
};
use crate::tets::flux::{Flux, equilibrate};
use crate::tets::marking::{beyond, by_gap, states};
use crate::tets::potentials::{
    CoarserPotentials, PotentialProblem, PotentialSettings, Potentials, Start, add_up_to_one,
};
use elastocap_geometry::meshing::tets::{Bisected, Grading, TetMesh};
use elastocap_linalg::memory::bytes_in_words;
use faer::Mat;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Share of the gap that the marked tetrahedra hold together, as long as the tolerance is far.
const MARKED: f64 = 0.6;

/// Where the marked tetrahedra need to hold no larger share of the gap than this for the next mesh to meet the tolerance, they do.
const LAST_MARKED: f64 = 0.72;

/// Each mesh has this many times the tetrahedra of the one before at least: one that is hardly finer would cost as much as the last
/// and gain nothing.
const MIN_GROWTH: f64 = 1.15;

/// How often a marked tetrahedron is bisected: error over tolerance above which the row applies, bisections (three halve all
/// edges in most cases), and the share of the marked gap that this removes, neighbours included, as measured at edges.
const GENERATIONS: [(f64, u8, f64); 3] = [(8.0, 3, 0.85), (2.5, 2, 0.7), (0.0, 1, 0.55)];

/// Error of the linear solver over the energy, as a share of the tolerance. It is small because the residual is charge that the
/// fluxes must carry to a conductor, which costs more energy than the error of the potential itself.
const ITERATION: f64 = 1e-4;

/// Refinement no longer helps where a larger share of the spread than this lies in open space beyond the mesh.
const MAX_BEYOND: f64 = 0.66;

/// Bytes per tetrahedron for each order: for matrices, multigrid and flux moments, and for each right-hand side.
const BYTES: [(u64, u64); 3] = [(1_000, 200), (1_800, 400), (8_000, 1_500)];

/// Largest number of tetrahedra of a mesh that is solved for a forecast, unless the initial mesh has more.
const MAX_FORECAST_TETRAHEDRA: usize = 20_000;

/// For each order, the power of the number of unknowns with which the spread falls from a small mesh to the last one.
const RATE: [f64; 3] = [0.65, 1.2, 1.2];

/// For each order, seconds per unknown of the last mesh, for all meshes with one right-hand side, on two cores.
const PACE: [f64; 3] = [3e-5, 3e-5, 8e-5];

/// Time of each further right-hand side over that of the first.
const FURTHER_SIDE: f64 = 0.25;

/// Largest spread at which the bounds of a coarser mesh are still worth reporting if a finer mesh cannot be solved.
const MAX_USEFUL_SPREAD: f64 = 0.3;

/// Largest number of meshes of one solve.
const MAX_MESHES: usize = 60;

/// Tolerance, order and limits of the solver on tetrahedra.
///
/// It always proves both bounds: the flux behind the lower one steers the refinement.
#[derive(Debug, Clone)]
pub struct TetrahedraSettings {
    /// Largest relative spread (upper - lower) / value of the target.
    pub relative_tolerance: f64,
    /// The quantity that the tolerance applies to.
    pub target: Target,
    /// Order of the potentials, 1 to 3.
    pub order: usize,
    /// Largest memory the solve may take, bytes.
    pub memory_limit: u64,
    /// Set from outside to stop at the next opportunity, with [`SolveError::Cancelled`].
    pub cancel: Option<Arc<AtomicBool>>,
}

impl TetrahedraSettings {
    /// The default order. Quadratic potentials are the best choice at edges, where higher orders cost more than they gain.
    pub const USUAL_ORDER: usize = 2;
}

impl Default for TetrahedraSettings {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-3,
            target: Target::Matrix,
            order: Self::USUAL_ORDER,
            memory_limit: 16 << 30,
            cancel: None,
        }
    }
}

/// What a mesh stands for: its permittivities, its floating conductors and its symmetry.
#[derive(Debug, Clone, Copy)]
pub struct MeshScene<'a> {
    /// Relative permittivity of each region of the mesh: the background, then the dielectrics.
    pub permittivity: &'a [f64],
    /// One entry per conductor: its charge, C, if it floats, `None` if it is driven.
    pub floating_charges: &'a [Option<f64>],
    /// Axes along which the mesh is one half of a mirror-symmetric scene. The results are those of the whole scene.
    pub mirrored: [bool; 3],
}

impl MeshScene<'_> {
    /// How many copies of the mesh make the whole scene.
    fn copies(&self) -> u32 {
        1 << self.mirrored.iter().filter(|m| **m).count()
    }
}

/// The result of [`solve_mesh()`]: the last mesh, the potentials on it and the capacitances.
#[derive(Debug, Clone)]
pub struct MeshSolution {
    /// The mesh as refined.
    pub mesh: TetMesh,
    /// For each conductor, the potential with 1 V on it and 0 V on all others: V, at the points of the mesh.
    pub potentials: Vec<Vec<f64>>,
    /// The capacitances. Their bounds are proved for the bodies as the mesh has them, with flat faces.
    pub solution: Solution,
}

/// Solves for the Maxwell capacitance matrix of a mesh's conductors with proved bounds, refining the mesh until they meet the
/// tolerance. Where they cannot, [`Solution::shortfall`] says why.
///
/// # Errors
///
/// A mesh that is not what [`TetMesh`] promises, a linear solver that fails on the first meshes, a request to stop.
pub fn solve_mesh(
    mesh: TetMesh,
    scene: MeshScene<'_>,
    settings: &TetrahedraSettings,
) -> Result<MeshSolution, SolveError> {
    let task = Task::new(scene, settings);
    let cancel = settings.cancel.as_deref();
    let mut mesh = mesh;
    let mut grading = Grading::towards_edges(&mesh);
    let mut seconds = PhaseSeconds::default();
    let mut iterations = 0;
    let mut meshes = 0;
    let mut before = f64::INFINITY;
    let mut coarser: Option<Coarser> = None;
    loop {
        meshes += 1;
        let (found, flux) = match task.on_mesh(&mesh, coarser.as_ref(), &mut seconds) {
            Ok(found) => found,
            Err(error) => {
                // The bounds on the mesh before are proved all the same.
                let useful = coarser.filter(|c| c.error < MAX_USEFUL_SPREAD);
                let mut last = useful.ok_or_else(|| error.clone())?.solved;
                last.solution.shortfall = Some(match error {
                    SolveError::Cancelled => STOPPED.to_owned(),
                    error => format!("a finer mesh could not be solved: {error}"),
                });
                last.solution.seconds = seconds;
                return Ok(last);
            }
        };
        iterations += found.iterations;
        let bounds = task.bounds(&found, &flux);
        let error = bounds.spread.error;

        // Graded bisection can make tetrahedra so thin that the fluxes lose more than the potentials gain. From then on edges
        // are halved.
        if error > before {
            grading = Grading::none(&mesh);
        }
        before = error;

        let (next, shortfall) = if error <= settings.relative_tolerance {
            (None, bounds.spread.may_be_zero.then(|| task.may_be_zero()))
        } else if cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            (None, Some(STOPPED.to_owned()))
        } else {
            let refining = Instant::now();
            let refined = task.refined(&mesh, &mut grading, meshes, &bounds.all, &flux, error);
            seconds.setup += refining.elapsed().as_secs_f64();
            match refined {
                Ok(finer) => (Some(finer), None),
                Err(reason) => (None, Some(reason.to_string())),
            }
        };
        let points = mesh.points.len();
        let solved = MeshSolution {
            potentials: found.values.iter().map(|u| u[..points].to_vec()).collect(),
            solution: Solution {
                floating: task.floating.proved(&bounds.all),
                maxwell: bounds.maxwell,
                two_terminal: bounds.two_terminal,
                reached: shortfall.is_none() && next.is_none(),
                shortfall,
                unknowns: found.unknowns,
                iterations,
                grids: meshes,
                mirrored: scene.mirrored,
                resolution: Discretisation::Tetrahedra { order: settings.order, refinements: meshes - 1 },
                repair_share: 0.0,
                seconds,
                field: None,
            },
            mesh,
        };
        if let Some(what) = contradiction(&solved.solution, &bounds.all, &task.floating) {
            return Err(SolveError::Contradiction(what));
        }
        let Some(Bisected { mesh: finer, origin, .. }) = next else { return Ok(solved) };
        mesh = finer;
        coarser = Some(Coarser { solved, potentials: found.into_coarser(), origin, error });
    }
}

/// What is known on the mesh before the last refinement.
struct Coarser {
    solved: MeshSolution,
    potentials: CoarserPotentials,
    /// For each tetrahedron of the refined mesh the one that it is a part of.
    origin: Vec<u32>,
    /// The relative spread.
    error: f64,
}

/// Why a mesh is not refined any more.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
enum NoFinerMesh {
    /// The error lies where there is no mesh to refine.
    #[error("the remaining error lies in open space beyond the mesh, which ends too near the conductors")]
    OpenSpace,
    /// Rounding alone exceeds the tolerance.
    #[error("{}", rounding_alone(*error))]
    Rounding {
        /// The spread that rounding leaves.
        error: f64,
    },
    /// A finer mesh would exceed the memory limit, or the number of meshes is at its limit.
    #[error(
        "a finer mesh, of {tetrahedra} tetrahedra, would take about {}, more than the limit of {}",
        bytes_in_words(*bytes),
        bytes_in_words(*limit)
    )]
    TooLarge {
        /// Its tetrahedra.
        tetrahedra: usize,
        /// Its memory, bytes.
        bytes: u64,
        /// The memory allowed, bytes.
        limit: u64,
    },
}

/// What stays the same on all meshes of one solve.
struct Task<'a> {
    scene: MeshScene<'a>,
    settings: &'a TetrahedraSettings,
    floating: Floating,
    /// Farad per metre of the energies on the mesh: the mirrored copies count too.
    scale: f64,
}

/// Bounds found on one mesh.
struct MeshBounds {
    /// Of all conductors, the floating ones included.
    all: MatrixBounds,
    /// The Maxwell matrix of the driven conductors, F.
    maxwell: Vec<Vec<Bounded>>,
    /// Two-terminal capacitance, F.
    two_terminal: Option<Bounded>,
    spread: Spread,
}

impl<'a> Task<'a> {
    fn new(scene: MeshScene<'a>, settings: &'a TetrahedraSettings) -> Self {
        let floating = Floating::of_charges(scene.floating_charges);
        Self { scene, settings, floating, scale: VACUUM_PERMITTIVITY * f64::from(scene.copies()) }
    }

    /// Potentials and fluxes of all conductors on one mesh.
    fn on_mesh(
        &self,
        mesh: &TetMesh,
        coarser: Option<&Coarser>,
        seconds: &mut PhaseSeconds,
    ) -> Result<(Potentials, Flux), SolveError> {
        let (settings, permittivity) = (self.settings, self.scene.permittivity);
        let n = self.scene.floating_charges.len();
        let start = Instant::now();
        let problem = PotentialProblem { mesh, permittivity, conductors: n };
        let share = (ITERATION * settings.relative_tolerance).min(1e-6);
        let cancel = settings.cancel.as_deref();
        let first =
            coarser.map(|c| Start { mesh: &c.solved.mesh, potentials: &c.potentials, origin: &c.origin });
        let how = PotentialSettings { order: settings.order, share, cancel };
        let found = Potentials::solve_from(problem, how, first);
        seconds.primal += start.elapsed().as_secs_f64();
        let found = found?;
        let start = Instant::now();
        let gradients: Vec<_> = (0..n).map(|k| found.gradients(mesh, k)).collect();
        let flux = equilibrate(mesh, permittivity, settings.order, &gradients, add_up_to_one(mesh, n));
        seconds.dual += start.elapsed().as_secs_f64();
        Ok((found, flux?))
    }

    /// Bounds from the potentials and the fluxes on one mesh.
    fn bounds(&self, found: &Potentials, flux: &Flux) -> MeshBounds {
        let (n, scale) = (self.scene.floating_charges.len(), self.scale);
        let lower = flux.lower(Mat::<f64>::identity(flux.charges.nrows(), n).as_ref());
        let mut all = MatrixBounds {
            lower: Mat::from_fn(n, n, |i, j| scale * lower[(i, j)]),
            upper: Mat::from_fn(n, n, |i, j| scale * found.energies[(i, j)]),
        };
        all.count_rounding(&self.rounding_scale(&all), contrast_of(self.scene.permittivity));
        all.uncross();
        let (maxwell, two_terminal, spread) = self.reduced(&all);
        MeshBounds { all, maxwell, two_terminal, spread }
    }

    /// The Maxwell matrix of the driven conductors and their two-terminal capacitance, F, and how far apart their bounds are.
    fn reduced(&self, all: &MatrixBounds) -> (Vec<Vec<Bounded>>, Option<Bounded>, Spread) {
        let reduced = self.floating.reduced(all);
        let (maxwell, two_terminal) = (reduced.entries(), reduced.two_terminal());
        // The capacitance of each driven conductor with all others at zero potential.
        let alone: Vec<f64> = self.floating.driven.iter().map(|&i| all.upper[(i, i)]).collect();
        let spread = spread(&maxwell, two_terminal.as_ref(), &alone, self.settings);
        (maxwell, two_terminal, spread)
    }

    /// The form that rounding of the bounds is a share of: the right-hand sides are the conductors themselves.
    fn rounding_scale(&self, all: &MatrixBounds) -> Mat<f64> {
        let n = all.upper.nrows();
        rounding_scale(&Mat::identity(n, n), &all.upper)
    }

    /// The spread that rounding alone leaves, however fine the mesh.
    fn rounding_spread(&self, all: &MatrixBounds) -> f64 {
        let contrast = contrast_of(self.scene.permittivity);
        let (.., spread) = self.reduced(&all.upper_with_rounding(&self.rounding_scale(all), contrast));
        spread.error
    }

    /// The next mesh, bisected where the bounds differ most. `meshes` have been solved, and the relative spread on the last one is
    /// `error`.
    ///
    /// # Errors
    /// [`NoFinerMesh`] if the mesh is not refined any more.
    fn refined(
        &self,
        mesh: &TetMesh,
        grading: &mut Grading,
        meshes: usize,
        all: &MatrixBounds,
        flux: &Flux,
        error: f64,
    ) -> Result<Bisected, NoFinerMesh> {
        let settings = self.settings;
        let rounding = self.rounding_spread(all);
        if rounding > settings.relative_tolerance {
            return Err(NoFinerMesh::Rounding { error: rounding });
        }
        let states = states(&self.floating, all);
        let far = error / settings.relative_tolerance;
        let (_, bisections, removed) =
            *GENERATIONS.iter().find(|(above, ..)| far > *above).unwrap_or(&GENERATIONS[2]);
        let needed = (1.0 - 0.95 / far) / removed;
        let order = by_gap(&states, &flux.gaps);
        let mut count = order.holding(if needed <= LAST_MARKED { needed } else { MARKED });
        let outside = beyond(&states, all, &flux.gap, self.scale);
        if count == 0 || (outside > MAX_BEYOND && outside * error > settings.relative_tolerance) {
            return Err(NoFinerMesh::OpenSpace);
        }
        let enough = (MIN_GROWTH * mesh.tets.len() as f64) as usize;
        let finer = loop {
            let mut towards = grading.clone();
            let finer = mesh.bisected_towards(&order.tets[..count], bisections, &mut towards);
            if finer.mesh.tets.len() >= enough || count == order.tets.len() {
                *grading = towards;
                break finer;
            }
            let added = (finer.mesh.tets.len() - mesh.tets.len()).max(1);
            let missing = (enough - mesh.tets.len()) as f64 / added as f64;
            count = ((count as f64 * 1.1 * missing) as usize + 1).min(order.tets.len());
        };
        let tetrahedra = finer.mesh.tets.len();
        let memory = memory_of(tetrahedra, &self.scene, settings);
        if meshes >= MAX_MESHES || memory > settings.memory_limit {
            return Err(NoFinerMesh::TooLarge { tetrahedra, bytes: memory, limit: settings.memory_limit });
        }
        Ok(finer)
    }

    fn may_be_zero(&self) -> String {
        format!(
            "a capacitance may be zero: it is less than {:e} of what it would be with all other conductors at zero \
             potential, and no mesh gives zero a relative accuracy",
            self.settings.relative_tolerance
        )
    }
}

/// Estimated memory, bytes, that a mesh with this many tetrahedra takes.
fn memory_of(tetrahedra: usize, scene: &MeshScene<'_>, settings: &TetrahedraSettings) -> u64 {
    let (each, per_side) = BYTES[settings.order.clamp(1, 3) - 1];
    tetrahedra as u64 * (each + scene.floating_charges.len() as u64 * per_side)
}

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
    let n = scene.floating_charges.len();
    let small = TetrahedraSettings {
        memory_limit: settings.memory_limit.min(memory_of(MAX_FORECAST_TETRAHEDRA, &scene, settings)),
        ..settings.clone()
    };
    let MeshSolution { mesh, solution, .. } = solve_mesh(mesh, scene, &small)?;
    let alone = vec![0.0; n];
    let error = spread(&solution.maxwell, solution.two_terminal.as_ref(), &alone, settings).error;
    let order = settings.order.clamp(1, 3) - 1;
    let far = if solution.reached { 1.0 } else { (error / settings.relative_tolerance).max(1.0) };
    let memory = |growth: f64| memory_of((mesh.tets.len() as f64 * growth) as usize, &scene, settings);
    // The solver makes no mesh that would not fit into memory.
    let max_growth = (settings.memory_limit as f64 / memory(1.0).max(1) as f64).max(1.0);
    let unresolved = if solution.reached { 1.0 } else { UNRESOLVED };
    let growth = (unresolved * far.powf(1.0 / RATE[order])).min(max_growth);
    let unknowns = (solution.unknowns as f64 * growth) as usize;
    let seconds = PACE[order] * unknowns as f64 * (1.0 + FURTHER_SIDE * n.saturating_sub(1) as f64);
    let copies = scene.copies();
    Ok(Forecast {
        unknowns,
        memory_bytes: PROGRAM + (SPARE * memory(growth) as f64) as u64,
        seconds,
        unmirrored: (copies as usize * unknowns, f64::from(copies) * seconds),
        mirrored: scene.mirrored,
        right_hand_sides: n,
    })
}

/// The relative distance between the bounds.
#[derive(Debug, PartialEq)]
struct Spread {
    /// Relative spread of what the tolerance is about.
    error: f64,
    /// Whether an entry was left out because its bounds include zero and are small: it has no relative error.
    may_be_zero: bool,
}

/// The relative spread that is compared with the tolerance.
///
/// `alone` has for each driven conductor its capacitance with all others at zero potential, the floating ones included, F. An
/// entry that may be zero and is smaller than the tolerance times this is left out: its relative spread does not fall as the mesh
/// is refined.
fn spread(
    maxwell: &[Vec<Bounded>],
    two_terminal: Option<&Bounded>,
    alone: &[f64],
    settings: &TetrahedraSettings,
) -> Spread {
    let relative =
        |b: &Bounded, scale: f64| if b.upper > b.lower { (b.upper - b.lower) / scale } else { 0.0 };
    let negligible = |b: &Bounded, scale: f64| {
        b.lower <= 0.0 && b.upper.max(-b.lower) <= settings.relative_tolerance * scale
    };
    let mut found = Spread { error: 0.0, may_be_zero: false };
    let mut count = |b: &Bounded, scale: f64, can_be_zero: bool, alone: f64| {
        if can_be_zero && negligible(b, alone) {
            found.may_be_zero = true;
        } else {
            found.error = found.error.max(relative(b, scale));
        }
    };
    if let Some(pair) = two_terminal {
        count(pair, pair.value, true, alone.iter().copied().fold(f64::INFINITY, f64::min));
    }
    if settings.target == Target::Matrix || two_terminal.is_none() {
        for (i, row) in maxwell.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let diagonal = (maxwell[i][i].value * maxwell[j][j].value).max(0.0).sqrt();
                // The diagonal gives an off-diagonal entry its scale, unless the diagonal itself may be zero.
                let no_scale = [i, j].into_iter().any(|k| negligible(&maxwell[k][k], alone[k]));
                let scale = entry.value.abs().max(SHARE_OF_DIAGONAL * diagonal);
                count(entry, scale, i == j || no_scale, (alone[i] * alone[j]).sqrt());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_geometry::meshing::tets::of_boxes;
    use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
    use elastocap_geometry::shapes::Shape;

    #[test]
    fn an_entry_that_may_be_zero_is_left_out_once_it_is_small_compared_with_the_conductor_alone() {
        let bounded = |lower: f64, upper: f64| Bounded { value: 0.5 * (lower + upper), lower, upper };
        let settings = TetrahedraSettings { relative_tolerance: 1e-2, ..TetrahedraSettings::default() };
        let of = |b: Bounded| spread(&[vec![b]], Some(&b), &[1.0], &settings);
        assert_eq!(of(bounded(0.0, 5e-3)), Spread { error: 0.0, may_be_zero: true });
        assert_eq!(of(bounded(0.0, 5e-2)), Spread { error: 2.0, may_be_zero: false });
        // Small, but not zero.
        let small = of(bounded(4e-3, 5e-3));
        assert!(!small.may_be_zero && small.error > 0.2);
        // A screened pair: only the entry between the two may be zero.
        let own = bounded(0.999, 1.001);
        let between = bounded(-1e-3, 1e-3);
        let pair = spread(&[vec![own, between], vec![between, own]], None, &[1.0; 2], &settings);
        assert!(!pair.may_be_zero && (pair.error - 0.02).abs() < 1e-3, "{pair:?}");
    }

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
        let scene = MeshScene { permittivity: &[1.0], floating_charges: &[None], mirrored: [false; 3] };
        let mut settings = TetrahedraSettings::default();
        let (found, flux) =
            Task::new(scene, &settings).on_mesh(&mesh, None, &mut PhaseSeconds::default()).unwrap();
        let bounds = Task::new(scene, &settings).bounds(&found, &flux);
        let error = bounds.spread.error;
        for nearly in [0.5, 0.9, 0.99, 0.9999] {
            settings.relative_tolerance = nearly * error;
            let task = Task::new(scene, &settings);
            let finer =
                task.refined(&mesh, &mut Grading::none(&mesh), 1, &bounds.all, &flux, error).unwrap().mesh;
            let growth = finer.tets.len() as f64 / mesh.tets.len() as f64;
            assert!(growth >= MIN_GROWTH, "{nearly}: {growth}");
        }
    }
}

//! Any shape: a mesh of tetrahedra, solved, bounded and refined where the bounds differ.
//!
//! On each mesh the potentials give the upper bound ([`crate::tets::potentials`]) and fluxes made from them the lower one
//! ([`crate::tets::flux`]). The difference is a sum over tetrahedra; those that hold most of it are bisected (Dörfler, SIAM J. Numer.
//! Anal. 33, 1996), at edges of conductors nearer to them ([`Grading`]), until the tolerance is met or the next mesh would not fit.

use crate::SolveError;
use crate::VACUUM_PERMITTIVITY;
use crate::floating::Floating;
use crate::matrix::MatrixBounds;
use crate::solution::{Bounded, Discretisation, Forecast, PhaseSeconds, Solution, Target};
use crate::tets::flux::{Flux, equilibrate};
use crate::tets::potentials::{Potentials, Problem, TetSettings};
use elastocap_geometry::meshing::tets::{Grading, TetMesh};
use faer::Mat;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// The part of the gap that the marked tetrahedra hold, at most: less where the tolerance is near.
const MARKED: f64 = 0.6;

/// Bisections of a marked tetrahedron where the error is more than so many tolerances (three halve its edges in most cases), and
/// what part of the gap of those marked they take off, neighbours included, as seen at edges.
const GENERATIONS: [(f64, u8, f64); 3] = [(8.0, 3, 0.85), (2.5, 2, 0.7), (0.0, 1, 0.5)];

/// What the iteration may leave of the energy, as a share of the tolerance: little, since what it leaves is charge that the
/// fluxes must carry to a conductor, at more cost than the error of the energy.
const ITERATION: f64 = 1e-4;

/// Share of the spread from which on that of open space beyond the mesh no longer falls much as the mesh is refined.
const MOST_BEYOND: f64 = 0.66;

/// Bytes per tetrahedron for each order: matrices, multigrid, moments of fluxes; and more per right-hand side.
const BYTES: [(u64, u64); 3] = [(1_000, 200), (1_800, 400), (8_000, 1_500)];

/// Tetrahedra of a mesh that is solved for a forecast, at most, unless the first one has more.
const FORECAST: usize = 20_000;

/// For each order, with which power of the unknowns the spread falls from a small mesh to the last one, and seconds per unknown of the last mesh
/// for all meshes with one right-hand side on two cores; then the share of it that each further one adds.
const RATE: [f64; 3] = [0.65, 1.2, 1.2];
const PACE: [f64; 3] = [3e-5, 3e-5, 8e-5];
const SIDE: f64 = 0.25;

/// Spread from which on bounds are better than nothing where a finer mesh cannot be solved.
const OF_USE: f64 = 0.3;

/// Meshes at most.
const MOST_MESHES: usize = 60;

/// What the solver on tetrahedra solves for and how well.
///
/// It always proves both bounds: the flux behind the lower one steers the refinement.
#[derive(Debug, Clone)]
pub struct TetrahedraSettings {
    /// Largest relative spread (upper - lower) / value of the target.
    pub relative_tolerance: f64,
    /// What the tolerance is about.
    pub target: Target,
    /// Order of the potentials, 1 to 3.
    pub order: usize,
    /// Largest memory the solve may take, bytes.
    pub memory_limit: u64,
    /// Set from outside to stop at the next opportunity, with [`SolveError::Cancelled`].
    pub cancel: Option<Arc<AtomicBool>>,
}

impl TetrahedraSettings {
    /// The order where none is asked for: quadratic potentials are the best at edges, where higher orders cost more than they
    /// give.
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

/// What is solved on the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Shapes<'a> {
    /// eps_r of each region of the mesh: the background, then the dielectrics.
    pub permittivity: &'a [f64],
    /// For each conductor its charge, C, if it floats.
    pub floating_charges: &'a [Option<f64>],
    /// Axes along which the mesh is one half of a scene that is its own mirror image; the answers are of the whole.
    pub mirrored: [bool; 3],
}

/// The mesh at the end, and the answer.
#[derive(Debug, Clone)]
pub struct General {
    /// As refined.
    pub mesh: TetMesh,
    /// Potentials on it, V, per conductor for one volt on it: at the points of the mesh.
    pub potentials: Vec<Vec<f64>>,
    /// Its bounds are theorems for the bodies as the mesh has them, with flat faces.
    pub solution: Solution,
}

/// Solves a mesh: the Maxwell matrix of its conductors with bounds, the mesh refined until they are near enough.
///
/// `shapes` says what the mesh is a part of.
///
/// # Errors
///
/// A mesh that is not what [`TetMesh`] promises, a linear solver that fails, a request to stop.
pub fn solve_mesh(
    mesh: TetMesh,
    shapes: Shapes<'_>,
    settings: &TetrahedraSettings,
) -> Result<General, SolveError> {
    let n = shapes.floating_charges.len();
    let floating = Floating::of_charges(shapes.floating_charges);
    // Energies are those of as many parts.
    let scale = VACUUM_PERMITTIVITY * f64::from(1 << shapes.mirrored.iter().filter(|m| **m).count());
    let cancel = settings.cancel.as_deref();
    let mut mesh = mesh;
    let mut grading = Grading::towards_edges(&mesh);
    let mut seconds = PhaseSeconds::default();
    let mut iterations = 0;
    let mut meshes = 0;
    let mut before = f64::INFINITY;
    let mut coarser: Option<General> = None;
    loop {
        meshes += 1;
        let (found, flux) = match on_mesh(&mesh, &shapes, settings, &mut seconds) {
            Ok(found) => found,
            Err(SolveError::Cancelled) => return Err(SolveError::Cancelled),
            Err(error) => {
                // What the mesh before gave is proved all the same.
                let mut last = coarser.ok_or_else(|| error.clone())?;
                last.solution.shortfall = Some(format!("a finer mesh could not be solved: {error}"));
                last.solution.seconds = seconds;
                return Ok(last);
            }
        };
        iterations += found.iterations;
        let lower = flux.lower(Mat::<f64>::identity(flux.charges.nrows(), n).as_ref());
        let mut all = MatrixBounds {
            lower: Mat::from_fn(n, n, |i, j| scale * lower[(i, j)]),
            upper: Mat::from_fn(n, n, |i, j| scale * found.energies[(i, j)]),
        };
        all.part();
        let bounds = floating.reduced(&all);
        let (maxwell, two_terminal) = (bounds.entries(), bounds.two_terminal());
        // What each driven conductor would have with all others at zero.
        let alone: Vec<f64> = floating.driven.iter().map(|&i| all.upper[(i, i)]).collect();
        let Spread { error, nothing } = spread(&maxwell, two_terminal.as_ref(), &alone, settings);
        if cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Err(SolveError::Cancelled);
        }

        // Where tetrahedra become so lean that fluxes lose more than potentials gain, plain halves go on from here.
        if error > before {
            grading = Grading::none(&mesh);
        }
        before = error;

        let refining = Instant::now();
        let mut next = None;
        let shortfall = if error <= settings.relative_tolerance {
            nothing.then(|| {
                format!(
                    "a capacitance may be zero: it is less than {:e} of what it would be with all other conductors at zero \
                     potential, and no mesh gives zero a relative accuracy",
                    settings.relative_tolerance
                )
            })
        } else {
            let states = states(&floating, &all);
            let far = error / settings.relative_tolerance;
            let chosen = GENERATIONS.iter().find(|g| far > g.0).unwrap_or(&GENERATIONS[2]);
            let needed = (1.0 - 0.95 / far) / chosen.2;
            let marked = marked(&states, &flux.gaps, needed.min(MARKED));
            let outside = beyond(&states, &all, &flux.gap, scale);
            let finer = mesh.bisected_towards(&marked, chosen.1, &mut grading).mesh;
            seconds.setup += refining.elapsed().as_secs_f64();
            let memory = memory_of(finer.tets.len(), &shapes, settings);
            if marked.is_empty() || (outside > MOST_BEYOND && outside * error > settings.relative_tolerance) {
                Some("what is left of the error is beyond the mesh: open space begins too near".to_owned())
            } else if meshes >= MOST_MESHES || memory > settings.memory_limit {
                Some(format!(
                    "a finer mesh, of {} tetrahedra, would take about {:.1} GB, more than the limit of {:.1} GB",
                    finer.tets.len(),
                    memory as f64 * 1e-9,
                    settings.memory_limit as f64 * 1e-9
                ))
            } else {
                next = Some(finer);
                None
            }
        };
        let points = mesh.points.len();
        let solved = General {
            potentials: found.values.iter().map(|u| u[..points].to_vec()).collect(),
            solution: Solution {
                maxwell,
                two_terminal,
                floating: floating.proved(&all),
                reached: shortfall.is_none() && next.is_none(),
                shortfall,
                unknowns: found.unknowns,
                iterations,
                grids: meshes,
                mirrored: shapes.mirrored,
                resolution: Discretisation::Tetrahedra { order: settings.order, refinements: meshes - 1 },
                repair_share: 0.0,
                seconds,
                field: None,
            },
            mesh,
        };
        let Some(finer) = next else { return Ok(solved) };
        mesh = finer;
        coarser = (error < OF_USE).then_some(solved);
    }
}

/// Potentials and fluxes of all conductors on one mesh.
fn on_mesh(
    mesh: &TetMesh,
    shapes: &Shapes<'_>,
    settings: &TetrahedraSettings,
    seconds: &mut PhaseSeconds,
) -> Result<(Potentials, Flux), SolveError> {
    let n = shapes.floating_charges.len();
    let start = Instant::now();
    let problem = Problem { mesh, permittivity: shapes.permittivity, conductors: n };
    let share = (ITERATION * settings.relative_tolerance).min(1e-6);
    let cancel = settings.cancel.as_deref();
    let found = Potentials::solve(problem, TetSettings { order: settings.order, share, cancel });
    seconds.primal += start.elapsed().as_secs_f64();
    let found = found?;
    let start = Instant::now();
    let gradients: Vec<_> = (0..n).map(|k| found.gradients(mesh, k)).collect();
    let flux = equilibrate(mesh, shapes.permittivity, settings.order, &gradients);
    seconds.dual += start.elapsed().as_secs_f64();
    Ok((found, flux?))
}

/// Bytes that a mesh of so many tetrahedra takes, about.
fn memory_of(tetrahedra: usize, shapes: &Shapes<'_>, settings: &TetrahedraSettings) -> u64 {
    let (each, per_side) = BYTES[settings.order.clamp(1, 3) - 1];
    tetrahedra as u64 * (each + shapes.floating_charges.len() as u64 * per_side)
}

/// Forecasts what [`solve_mesh`] will take: it is run as far as a small mesh goes, and from there on the spread is taken to fall
/// as it does in general. An estimate: within a factor of about two for scenes whose edges the small mesh has seen.
///
/// # Errors
///
/// Those of [`solve_mesh`].
pub fn forecast_mesh(
    mesh: TetMesh,
    shapes: Shapes<'_>,
    settings: &TetrahedraSettings,
) -> Result<Forecast, SolveError> {
    let n = shapes.floating_charges.len();
    let small = TetrahedraSettings {
        memory_limit: settings.memory_limit.min(memory_of(FORECAST, &shapes, settings)),
        ..settings.clone()
    };
    let General { mesh, solution, .. } = solve_mesh(mesh, shapes, &small)?;
    let alone = vec![0.0; n];
    let error = spread(&solution.maxwell, solution.two_terminal.as_ref(), &alone, settings).error;
    let order = settings.order.clamp(1, 3) - 1;
    let far = if solution.reached { 1.0 } else { (error / settings.relative_tolerance).max(1.0) };
    let memory = |far: f64| memory_of((mesh.tets.len() as f64 * far) as usize, &shapes, settings);
    // No mesh is made that would not fit.
    let most = (settings.memory_limit as f64 / memory(1.0).max(1) as f64).max(1.0);
    let growth = far.powf(1.0 / RATE[order]).min(most);
    let unknowns = (solution.unknowns as f64 * growth) as usize;
    let seconds = PACE[order] * unknowns as f64 * (1.0 + SIDE * n.saturating_sub(1) as f64);
    let copies = 1_usize << shapes.mirrored.iter().filter(|m| **m).count();
    Ok(Forecast {
        unknowns,
        memory_bytes: memory(growth),
        seconds,
        unmirrored: (copies * unknowns, copies as f64 * seconds),
        mirrored: shapes.mirrored,
        right_hand_sides: n,
    })
}

/// Weights of the conductors' unit states, and energy, for each driven conductor at one volt.
fn states(floating: &Floating, all: &MatrixBounds) -> Vec<(Vec<f64>, f64)> {
    let driven = floating.driven.len();
    let uncharged = vec![0.0; floating.floating.len()];
    (0..driven)
        .map(|d| {
            let unit: Vec<f64> = (0..driven).map(|e| f64::from(u8::from(d == e))).collect();
            let potentials = floating.potentials(&all.upper, &unit, &uncharged);
            let n = potentials.len();
            let energy = (0..n)
                .flat_map(|i| (0..n).map(move |j| (i, j)))
                .map(|(i, j)| potentials[i] * all.upper[(i, j)] * potentials[j]);
            let energy = energy.sum();
            (potentials, energy)
        })
        .collect()
}

/// The fewest tetrahedra that hold a share of the gap, relative to the energy, in all states together.
///
/// Where conductors float, a state is a sum of unit states; its local gap is at most that of the sum of their roots, squared.
fn marked(states: &[(Vec<f64>, f64)], gaps: &[Vec<f64>], share: f64) -> Vec<u32> {
    let tets = gaps.first().map_or(0, Vec::len);
    let mut size: Vec<f64> = vec![0.0; tets];
    for (potentials, energy) in states.iter().filter(|(_, energy)| *energy > 0.0) {
        for (t, size) in size.iter_mut().enumerate() {
            let root: f64 =
                potentials.iter().zip(gaps).map(|(v, gap)| v.abs() * gap[t].max(0.0).sqrt()).sum();
            *size += root * root / energy;
        }
    }
    let goal = share * size.iter().sum::<f64>();
    let mut order: Vec<u32> = (0..tets as u32).collect();
    // Equal sizes keep their order, so that the same mesh is refined the same way.
    order.sort_by(|&a, &b| size[b as usize].total_cmp(&size[a as usize]));
    let mut held = 0.0;
    let count = order.iter().take_while(|&&t| {
        let wanted = held < goal && size[t as usize] > 0.0;
        held += size[t as usize];
        wanted
    });
    let count = count.count();
    order.truncate(count);
    order
}

/// What share of upper less lower bound is that of open space beyond the mesh, where the potential and the flux go on along
/// rays, each in its way. Refinement makes it smaller only as long as the two differ where the mesh ends for being coarse.
/// `scale` is F per m of the gap, for all mirrored parts together.
fn beyond(states: &[(Vec<f64>, f64)], all: &MatrixBounds, gap: &Mat<f64>, scale: f64) -> f64 {
    let (mut inside, mut total) = (0.0, 0.0);
    for (potentials, energy) in states.iter().filter(|(_, energy)| *energy > 0.0) {
        for (i, v) in potentials.iter().enumerate() {
            for (j, w) in potentials.iter().enumerate() {
                inside += v * w * scale * gap[(i, j)] / energy;
                total += v * w * (all.upper[(i, j)] - all.lower[(i, j)]) / energy;
            }
        }
    }
    if total > inside { 1.0 - inside / total } else { 0.0 }
}

/// How far bounds lie apart.
#[derive(Debug, PartialEq)]
struct Spread {
    /// Relative spread of what the tolerance is about.
    error: f64,
    /// Whether something was left out of it for being zero as far as one can tell.
    nothing: bool,
}

/// `alone` is what each conductor would have with all others at zero potential, the floating ones too, F. What may be zero and
/// is no more than the tolerance of that has no relative spread that falls as the mesh is refined.
fn spread(
    maxwell: &[Vec<Bounded>],
    two_terminal: Option<&Bounded>,
    alone: &[f64],
    settings: &TetrahedraSettings,
) -> Spread {
    let relative =
        |b: &Bounded, scale: f64| if b.upper > b.lower { (b.upper - b.lower) / scale } else { 0.0 };
    let nil = |b: &Bounded, scale: f64| {
        b.lower <= 0.0 && b.upper.max(-b.lower) <= settings.relative_tolerance * scale
    };
    let mut found = Spread { error: 0.0, nothing: false };
    let mut count = |b: &Bounded, scale: f64, may_be_nil: bool, alone: f64| {
        if may_be_nil && nil(b, alone) {
            found.nothing = true;
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
                // An entry off the diagonal has those on it for a scale, unless they are nothing themselves.
                let no_scale = [i, j].into_iter().any(|k| nil(&maxwell[k][k], alone[k]));
                let scale = entry.value.abs().max(0.1 * diagonal);
                count(entry, scale, i == j || no_scale, (alone[i] * alone[j]).sqrt());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_zero_is_left_out_once_it_is_small_beside_the_conductor_alone() {
        let bounded = |lower: f64, upper: f64| Bounded { value: 0.5 * (lower + upper), lower, upper };
        let settings = TetrahedraSettings { relative_tolerance: 1e-2, ..TetrahedraSettings::default() };
        let of = |b: Bounded| spread(&[vec![b]], Some(&b), &[1.0], &settings);
        assert_eq!(of(bounded(0.0, 5e-3)), Spread { error: 0.0, nothing: true });
        assert_eq!(of(bounded(0.0, 5e-2)), Spread { error: 2.0, nothing: false });
        // Small, but not zero.
        let small = of(bounded(4e-3, 5e-3));
        assert!(!small.nothing && small.error > 0.2);
        // A screened pair: the matrix has entries, only not between the two.
        let own = bounded(0.999, 1.001);
        let between = bounded(-1e-3, 1e-3);
        let pair = spread(&[vec![own, between], vec![between, own]], None, &[1.0; 2], &settings);
        assert!(!pair.nothing && (pair.error - 0.02).abs() < 1e-3, "{pair:?}");
    }
}

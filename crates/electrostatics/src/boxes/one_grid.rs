//! A scene on one grid: symmetric parts, both bounds, what is missing and where.
//!
//! The scene is split into parts that are even or odd across its mirror planes ([`crate::boxes::symmetry`]). On each grid every
//! part gives an upper and a lower energy matrix ([`crate::boxes::energy`]); together they are the bounds on the Maxwell matrix.

use crate::SolveError;
use crate::VACUUM_PERMITTIVITY;
use crate::boxes::domain::{Axis, Domain};
use crate::boxes::dual::across_grids::Fluxes;
use crate::boxes::dual::mapped::{Solved, lower as bent_lower};
use crate::boxes::energy::{Drive, Energies, Start, lower, upper};
use crate::boxes::field::{Share, sample};
use crate::boxes::grid_refinement::{Indicator, add, folded, indicator};
use crate::boxes::half_turn::{Image, images};
use crate::boxes::layout::{Frame, Grid, Layout};
use crate::boxes::mapped::map::SceneMap;
use crate::boxes::primal::Primal;
use crate::boxes::resolution::{first, memory};
use crate::boxes::superposed::{Added, Base, MOST_SQUEEZED};
use crate::boxes::symmetry::{Part, parts};
use crate::floating::Floating;
use crate::matrix::{MatrixBounds, contrast_of, from_energies, rounding_scale};
use crate::solution::{Bounded, Discretisation, Field, PhaseSeconds, Settings, Solution};
use crate::target::{SHARE_OF_DIAGONAL, Target};
use elastocap_fem::embedding::embedding;
use elastocap_fem::tensor::{Dims, SparseRows, along, axpy};
use elastocap_geometry::scene::{Potential, Scene};
use elastocap_linalg::dense::{self, Lu};
use faer::Mat;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Without bounds, the estimated error over the missing energy that the surplus indicates, which is 0.6 to 1.6 times the true error
/// on cubes, plates and pairs.
const SURPLUS_FACTOR: f64 = 1.75;

/// What [`Outcome::amplification`] may be of a coupling that is asked for by itself, however weak it is.
const LARGEST_AMPLIFICATION: f64 = 1e4;

/// What [`Outcome::overstated`] may be.
const MOST_UNDERSTATED: f64 = 0.5;
const MOST_OVERSTATED: f64 = 100.0;

/// A scene laid out for the box solver, with its symmetric parts and the settings.
pub(crate) struct GridProblem<'a> {
    pub(crate) layout: Layout,
    pub(crate) parts: Vec<Part>,
    /// The half, quarter or eighth of the scene that grids are made for.
    pub(crate) core: Layout,
    /// Axes across which a grid is reflected before it is solved on: none where mirrors are used.
    pub(crate) reflected: [bool; 3],
    /// Which conductors float.
    pub(crate) floating: Floating,
    pub(crate) settings: &'a Settings,
    /// Whether fluxes are kept, for products with those on another grid.
    pub(crate) keeps_fluxes: bool,
    /// A solution that the one of this problem is added to.
    pub(crate) base: Option<&'a Base>,
    /// How far a grid reaches into open space at least, and whether it must reach that far and no farther.
    pub(crate) reach: Option<(f64, bool)>,
}

/// A layout that has its frame from another one.
pub(crate) struct InFrame {
    pub(crate) frame: Frame,
    /// Mirror planes that may be used.
    pub(crate) mirrored: [bool; 3],
    /// Distance of the farthest face from the origin of the frame, in its unit.
    pub(crate) reach: f64,
    /// How many times as far rays to infinity begin at least.
    pub(crate) far: f64,
    /// Where rays to infinity begin, if that is given.
    pub(crate) radius: Option<f64>,
}

impl<'a> GridProblem<'a> {
    pub(crate) fn new(
        scene: &Scene,
        map: Option<&Arc<SceneMap>>,
        in_frame: Option<&InFrame>,
        settings: &'a Settings,
    ) -> Result<Self, SolveError> {
        let frame = in_frame.map(|own| own.frame);
        let mut layout = Layout::in_frame(scene, map, frame, settings.memory_limit)?;
        if let Some(own) = in_frame {
            (0..3).filter(|a| !own.mirrored[*a]).for_each(|a| layout.mirror[a] = None);
        }
        let reach =
            in_frame.map(|own| own.radius.map_or((own.reach * own.far, false), |radius| (radius, true)));
        let grounded: Vec<bool> =
            scene.conductors().map(|own| own.potential == Potential::Grounded).collect();
        let reflected = layout.mirror.map(|m| m.is_some() && !settings.symmetry);
        Ok(Self {
            parts: parts(&layout, &grounded, settings.symmetry),
            core: layout.core(),
            reflected,
            floating: Floating::new(scene),
            layout,
            settings,
            keeps_fluxes: false,
            base: None,
            reach,
        })
    }

    /// The first grid of a search, on which rays to infinity begin `far` times as far from the pole as the farthest conductor.
    ///
    /// # Errors
    /// [`SolveError::Superposition`] where that is farther than on the grid of a base.
    pub(crate) fn first_grid(&self, far: f64) -> Result<Grid, SolveError> {
        let mut grid = first(&self.core, far);
        match self.reach {
            None => {}
            Some((radius, true)) if grid.radius > radius => return Err(SolveError::Superposition),
            Some((radius, true)) => self.core.reach_to(&mut grid, radius),
            Some((least, false)) => {
                let radius = grid.radius.max(least);
                self.core.reach_to(&mut grid, radius);
            }
        }
        Ok(grid)
    }

    /// The potentials of all right-hand sides, in columns: a basis of all potentials of the conductors.
    pub(super) fn basis(&self) -> Mat<f64> {
        let columns: Vec<&Vec<f64>> = self.parts.iter().flat_map(Part::basis).collect();
        let n = self.layout.conductors.len();
        Mat::from_fn(n, n, |c, k| columns.get(k).map_or(0.0, |v| v[c]))
    }

    /// Refuses a grid that does not fit into the memory.
    pub(crate) fn check_memory(&self, grid: &Grid) -> Result<(), SolveError> {
        let (bytes, limit) = (self.memory(grid), self.settings.memory_limit);
        if bytes > limit { Err(SolveError::TooLarge { bytes, limit }) } else { Ok(()) }
    }

    /// Memory, bytes, that the solve of the largest part takes on a grid.
    pub(crate) fn memory(&self, grid: &Grid) -> u64 {
        let (domain, _) = self.core.domain(grid);
        self.memory_of(domain.primal_dims())
    }

    /// The same for a grid with `dims` functions on the axes of the core.
    pub(crate) fn memory_of(&self, dims: Dims) -> u64 {
        let dims = [0, 1, 2].map(|a| if self.reflected[a] { 2 * dims[a] } else { dims[a] });
        let right_hand_sides = self.parts.iter().map(|p| p.potentials.len()).max().unwrap_or(0);
        // A map has tensors, gradients and fluxes at the points of the finer rule.
        let points = dims.iter().map(|n| 2 * *n as u64).product::<u64>();
        let under_map = self.layout.map.as_ref().map_or(0, |_| points.saturating_mul(100));
        let boxes = memory(dims, self.layout.conductors.len().max(right_hand_sides), self.settings.bounds);
        boxes.saturating_add(under_map)
    }

    /// Unknowns of the largest part on a grid, primal plus dual.
    pub(crate) fn unknowns(&self, grid: &Grid) -> usize {
        let (domain, _) = self.core.domain(grid);
        let n: usize = domain.primal_dims().iter().product();
        if self.settings.bounds { 2 * n } else { n }
    }

    /// Whether other solutions are to be added to that of this problem.
    pub(crate) fn is_base(&self) -> bool {
        matches!(self.reach, Some((_, false)))
    }

    /// Whether the caller wants the solve to stop.
    pub(crate) fn cancelled(&self) -> bool {
        self.settings.cancel.as_ref().is_some_and(|c| c.load(Ordering::Relaxed))
    }
}

/// What the grid before gave, which the error estimate of a solve without bounds compares with.
pub(crate) struct Coarser {
    /// Relative energy that the surplus indicated to be missing.
    pub(crate) missing: f64,
    /// Upper energies of the driven conductors, F.
    pub(crate) upper: Mat<f64>,
}

/// Energies of all parts on one grid.
pub(crate) struct Outcome {
    /// Of the driven conductors: the matrix that is reported.
    pub(crate) bounds: MatrixBounds,
    /// Of all conductors.
    pub(crate) all: MatrixBounds,
    /// The form that rounding of `all` is a share of, F.
    pub(super) rounding: Mat<f64>,
    /// Potentials of the right-hand sides, in columns.
    pub(super) basis: Mat<f64>,
    /// Parts that have a field, each after the index of its first column in `basis`.
    pub(super) solved: Vec<(usize, SolvedPart)>,
    pub(crate) unknowns: usize,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
    pub(crate) repair_share: f64,
    pub(super) seconds: PhaseSeconds,
}

/// The potentials of all parts on a grid, from which iterations on a finer one start.
pub(crate) struct Potentials(Vec<PartPotentials>);

/// The potentials of one part on a grid.
struct PartPotentials {
    /// The number of the part's first right-hand side.
    first: usize,
    domain: Domain,
    /// Coefficients for each right-hand side.
    coefficients: Vec<Vec<f64>>,
}

/// The potentials of one part as functions of a finer grid.
pub(super) struct Embedded<'a> {
    coarse: &'a PartPotentials,
    /// Coefficients on the finer grid of the coarse functions of each axis.
    axes: Vec<SparseRows<f64>>,
}

impl Potentials {
    /// Those of the part whose first right-hand side has this number, on a finer grid; `None` where the grid is not finer.
    pub(super) fn on(&self, first: usize, domain: &Domain) -> Option<Embedded<'_>> {
        let coarse = self.0.iter().find(|part| part.first == first)?;
        let of_axis = |(from, to): (&Axis, &Axis)| {
            let (rows, columns) = (to.functions(), from.functions());
            let whole = embedding(&from.line, &to.line)?;
            let free = whole.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len());
            Some(SparseRows::from_mat(free))
        };
        let axes = coarse.domain.axes.iter().zip(&domain.axes).map(of_axis).collect::<Option<_>>()?;
        Some(Embedded { coarse, axes })
    }
}

impl Embedded<'_> {
    /// Coefficients of the potential of one right-hand side.
    pub(super) fn potential(&self, k: usize) -> Vec<f64> {
        let mut dims = self.coarse.domain.primal_dims();
        let mut out = Vec::new();
        for (axis, matrix) in self.axes.iter().enumerate() {
            let from = if axis == 0 { &self.coarse.coefficients[k] } else { &out };
            (out, dims) = along(axis, matrix, from, dims);
        }
        out
    }
}

/// The upper problem of one part.
pub(super) struct SolvedPart {
    pub(super) energies: Energies,
    primal: Primal,
    /// Of the conductors' blocks, for each right-hand side.
    potentials: Vec<Vec<f64>>,
    /// Which right-hand sides are images of others.
    images: Vec<Option<Image>>,
    /// The fluxes of the lower problem where the problem keeps them.
    pub(super) fluxes: Option<Fluxes>,
    /// Lower energies, if they are known at once.
    pub(super) lower: Option<Mat<f64>>,
    /// Where the solution is added to a base.
    added: Option<OnBase>,
    pub(super) domain: Domain,
    odd: [bool; 3],
    pub(super) copies: f64,
}

/// What a part that is added to a base has of its own.
pub(super) struct OnBase {
    /// The index of the part.
    index: usize,
    /// The energies of its own problem.
    under_map: Mat<f64>,
    /// What the interpolated base misses, where that was needed.
    missed: Mat<f64>,
    /// The interpolated base, for each right-hand side.
    cut: Vec<Vec<f64>>,
}

/// Which lower bounds a grid is to give.
#[derive(Clone, Copy)]
pub(crate) enum Lower<'a> {
    /// None: they are set equal to the upper ones.
    None,
    /// Those of the dual problem on the grid. Under a map the dual problem follows the primal one, and is left out where lower bounds that
    /// are `known` from another grid give, with the new upper ones, an error of `accepted`.
    Proved { known: Option<&'a Mat<f64>>, accepted: f64 },
}

impl Lower<'_> {
    /// Of the dual problem on the grid.
    pub(crate) const OF_GRID: Self = Self::Proved { known: None, accepted: 0.0 };
}

/// Solves all parts on one grid: the primal problem, and the dual one as far as it is needed. The linear solvers start from the potentials
/// on a coarser grid, if there are any, and stop when their error is about `share` of the energy.
///
/// # Errors
/// A grid whose matrices cannot be factorised, a request to stop.
pub(crate) fn on_grid(
    problem: &GridProblem<'_>,
    grid: &Grid,
    share: f64,
    lower: Lower<'_>,
    coarser: Option<&Potentials>,
) -> Result<Outcome, SolveError> {
    let n = problem.layout.conductors.len();
    let basis = problem.basis();
    let (mut up, mut low) = (Mat::zeros(n, n), Mat::zeros(n, n));
    let mut out = Outcome::empty();
    let grid = &grid.reflected(problem.reflected);
    let has_lower = !matches!(lower, Lower::None);
    let add = |to: &mut Mat<f64>, at: usize, part: &SolvedPart, own: &Mat<f64>| {
        for (i, j) in (0..own.nrows()).flat_map(|i| (0..own.ncols()).map(move |j| (i, j))) {
            to[(at + i, at + j)] = part.copies * own[(i, j)];
        }
    };
    let mut at = 0;
    for (index, part) in problem.parts.iter().enumerate() {
        if !part.potentials.is_empty() {
            let coarser = coarser.map(|coarser| (coarser, at));
            let (solved, dual) = solve_part(problem, index, grid, share, has_lower, coarser)?;
            add(&mut up, at, &solved, &solved.energies.matrix);
            if let Some(dual) = &dual {
                add(&mut low, at, &solved, &dual.matrix);
            }
            out.add_cost(&solved.energies, dual.as_ref());
            out.solved.push((at, solved));
        }
        at += part.basis().count();
    }
    let unit = VACUUM_PERMITTIVITY * problem.layout.unit;
    let scaled = |m: Mat<f64>| {
        let c = from_energies(&basis, &m);
        Mat::from_fn(n, n, |i, j| unit * c[(i, j)])
    };
    let rounding = rounding_scale(&basis, &up);
    out.rounding = Mat::from_fn(n, n, |i, j| unit * rounding[(i, j)]);
    let upper = scaled(up);
    if let (Lower::Proved { known: Some(known), accepted }, true) = (lower, problem.layout.map.is_some()) {
        out.set_bounds(problem, upper.clone(), known.clone());
        if out.error(problem.settings) <= accepted {
            out.basis = basis;
            return Ok(out);
        }
    }
    if has_lower && problem.layout.map.is_some() {
        for k in 0..out.solved.len() {
            let Some((at, part)) = out.solved.get(k) else { continue };
            let dual = part.bent_lower(problem, share)?;
            add(&mut low, *at, part, &dual.matrix);
            out.unknowns = out.unknowns.max(part.energies.unknowns + dual.unknowns);
            out.add_dual_cost(&dual);
        }
    }
    let lower = if has_lower { scaled(low) } else { upper.clone() };
    out.set_bounds(problem, upper, lower);
    out.basis = basis;
    Ok(out)
}

/// Solves one part on one grid: its primal problem, and, except under a map, the energies of its dual one if `lower_too`. The potentials of
/// a `coarser` grid come with the number of the part's first right-hand side.
fn solve_part(
    problem: &GridProblem<'_>,
    index: usize,
    grid: &Grid,
    share: f64,
    lower_too: bool,
    coarser: Option<(&Potentials, usize)>,
) -> Result<(SolvedPart, Option<Energies>), SolveError> {
    let cancel = problem.settings.cancel.as_deref();
    let part = &problem.parts[index];
    let (domain, held) = part.layout.domain(grid);
    let mut potentials: Vec<Vec<f64>> =
        part.potentials.iter().map(|v| held.iter().map(|&c| v[c]).collect()).collect();
    let images =
        if problem.settings.symmetry { images(&domain, &potentials) } else { vec![None; potentials.len()] };
    let added = match problem.base {
        Some(base) => Some(Added::new(base, part, &domain, &held).ok_or(SolveError::Superposition)?),
        None => None,
    };
    if let Some(added) = &added {
        potentials.clone_from(&added.potentials);
    }
    let embedded = coarser.and_then(|(coarser, first)| coarser.on(first, &domain));
    let start = |(k, image): (usize, &Option<Image>)| match (image, &embedded) {
        (Some(image), _) => Start::Image(*image),
        (None, Some(embedded)) => Start::Potential(embedded.potential(k)),
        (None, None) => Start::Nothing,
    };
    let starts: Vec<Start> = images.iter().enumerate().map(start).collect();
    let base_energies = added.as_ref().map(Added::base_energies).unwrap_or_default();
    let drive = added.as_ref().map(|added| Drive { pull: &added.cut, energies: &base_energies });
    let of_upper = || upper(&domain, &potentials, &starts, drive.as_ref(), share, cancel);
    let mut own = None;
    let (energies, primal, dual, fluxes) = if domain.map.is_some() {
        let (mut energies, mut primal) = of_upper()?;
        if added.is_some() && primal.bent().is_some_and(|bent| bent.largest() > MOST_SQUEEZED) {
            return Err(SolveError::Superposition);
        }
        if let Some(added) = &added {
            let under_map = energies.matrix.clone();
            let [upper, missed] = if lower_too {
                added.upper(&domain, &under_map, &energies.coefficients, &primal)?
            } else {
                [added.about(&under_map, &energies.coefficients, &mut primal), Mat::zeros(0, 0)]
            };
            energies.matrix = upper;
            own = Some((under_map, missed));
        }
        (energies, primal, None, None)
    } else {
        // The two problems are of the same size and run in parallel.
        let keep = problem.keeps_fluxes;
        let of_lower =
            || lower_too.then(|| lower(&domain, &potentials, &starts, share, keep, cancel)).transpose();
        let (upper, dual) = rayon::join(of_upper, of_lower);
        let (energies, primal) = upper?;
        let (dual, fluxes) = dual?.unzip();
        (energies, primal, dual, fluxes.flatten())
    };
    if problem.cancelled() {
        return Err(SolveError::Cancelled);
    }
    let (odd, copies) = (part.odd, part.copies);
    let added = own.zip(added).map(|((under_map, missed), added)| OnBase {
        index,
        under_map,
        missed,
        cut: added.cut,
    });
    let lower = dual.as_ref().map(|dual| dual.matrix.clone());
    Ok((SolvedPart { energies, primal, potentials, images, fluxes, lower, added, domain, odd, copies }, dual))
}

impl Outcome {
    /// Before any part is solved.
    pub(super) fn empty() -> Self {
        let none = || MatrixBounds { lower: Mat::zeros(0, 0), upper: Mat::zeros(0, 0) };
        Self {
            bounds: none(),
            all: none(),
            rounding: Mat::zeros(0, 0),
            basis: Mat::zeros(0, 0),
            solved: Vec::new(),
            unknowns: 0,
            iterations: 0,
            converged: true,
            repair_share: 0.0,
            seconds: PhaseSeconds::default(),
        }
    }

    /// The potentials of all parts.
    pub(crate) fn potentials(&self) -> Potentials {
        let of = |(first, part): &(usize, SolvedPart)| PartPotentials {
            first: *first,
            domain: part.domain.clone(),
            coefficients: part.energies.coefficients.clone(),
        };
        Potentials(self.solved.iter().map(of).collect())
    }

    /// Sets the bounds from energies of all conductors.
    fn set_bounds(&mut self, problem: &GridProblem<'_>, upper: Mat<f64>, lower: Mat<f64>) {
        self.all = MatrixBounds { lower, upper };
        self.all.count_rounding(&self.rounding, contrast_of(&problem.layout.permittivity));
        self.all.uncross();
        self.bounds = problem.floating.reduced(&self.all);
    }

    /// Adds what the problems of one part took.
    fn add_cost(&mut self, primal: &Energies, dual: Option<&Energies>) {
        self.iterations += primal.iterations;
        self.converged &= primal.converged;
        self.seconds.setup += primal.seconds[0];
        self.seconds.primal += primal.seconds[1];
        self.unknowns = self.unknowns.max(primal.unknowns + dual.map_or(0, |dual| dual.unknowns));
        if let Some(dual) = dual {
            self.add_dual_cost(dual);
        }
    }

    fn add_dual_cost(&mut self, dual: &Energies) {
        self.iterations += dual.iterations;
        self.converged &= dual.converged;
        self.seconds.setup = self.seconds.setup.max(dual.seconds[0]);
        self.seconds.dual += dual.seconds[1];
        self.repair_share = self.repair_share.max(dual.repair_share);
    }

    /// The field of one state for export, which is that of the target ([`Target::shown`]); the floating conductors carry their charge.
    pub(crate) fn field(&self, scene: &Scene, problem: &GridProblem<'_>) -> Field {
        let GridProblem { layout, parts, settings, floating, .. } = problem;
        let n = layout.conductors.len();
        let driven = settings.target.shown(floating.driven.len());
        let potentials = floating.potentials(&self.all.upper, &driven, &floating.charges);
        let target = Mat::from_fn(n, 1, |i, _| potentials[i]);
        let weights = Lu::new(self.basis.as_ref()).solve(target.as_ref());
        let mut shares = Vec::new();
        let (mut at, mut common) = (0, 0.0);
        for part in parts {
            let from = at + part.potentials.len();
            common += (from..from + part.fieldless.len()).map(|i| weights[(i, 0)]).sum::<f64>();
            at += part.basis().count();
        }
        for (first, part) in &self.solved {
            let weights: Vec<f64> =
                (0..part.energies.coefficients.len()).map(|i| weights[(first + i, 0)]).collect();
            if let Some(mut coefficients) = combined(&weights, &part.energies.coefficients) {
                if let Some(cut) = part.added.as_ref().and_then(|added| combined(&weights, &added.cut)) {
                    axpy(&mut coefficients, -1.0, &cut);
                }
                shares.push(Share { domain: &part.domain, coefficients, odd: part.odd });
            }
            if let (Some(base), Some(added)) = (problem.base, &part.added) {
                let part = &parts[added.index];
                shares.extend(base.shares(part, &weights));
            }
        }
        let mirrored = layout.mirror.map(|m| m.is_some() && settings.symmetry);
        let mut field = sample(scene, layout, &shares, mirrored, potentials);
        field.potential.iter_mut().for_each(|p| *p += common);
        field
    }

    /// The refinement indicator: relative missing energies of the primal solution along each axis, summed over the states that
    /// the target depends on.
    pub(crate) fn indicator(&self, problem: &GridProblem<'_>) -> Indicator {
        self.indicator_of(problem, problem.settings.target)
    }

    /// The same for the states that another target depends on.
    pub(super) fn indicator_of(&self, problem: &GridProblem<'_>, target: Target) -> Indicator {
        let n = self.basis.nrows();
        let GridProblem { floating, .. } = problem;
        let driven = floating.driven.len();
        let factor = Lu::new(self.basis.as_ref());
        let of_driven = |v: &[f64]| {
            let all = floating.potentials(&self.all.upper, v, &vec![0.0; floating.floating.len()]);
            let weights = factor.solve(Mat::from_fn(n, 1, |i, _| all[i]).as_ref());
            (0..n).map(|i| weights[(i, 0)]).collect::<Vec<f64>>()
        };
        // Weights of the right-hand sides in each state, and the state's energy.
        let mut states: Vec<(Vec<f64>, f64)> = Vec::new();
        if let Some([first, second]) = target.opposite(driven) {
            let own = self.bounds.of_rows(&[first, second]).upper;
            let charges = Mat::from_fn(2, 1, |i, _| if i == 0 { 1.0 } else { -1.0 });
            let voltages = Lu::new(own.as_ref()).solve(charges.as_ref());
            let energy = voltages[(0, 0)] - voltages[(1, 0)];
            if energy.is_finite() && energy > 0.0 {
                let mut potentials = vec![0.0; driven];
                (potentials[first], potentials[second]) = (voltages[(0, 0)], voltages[(1, 0)]);
                states.push((of_driven(&potentials), energy));
            }
        }
        let rows = target.rows(driven);
        if states.is_empty() && (driven < n || rows.len() < driven) {
            for d in rows {
                let unit: Vec<f64> = (0..driven).map(|e| f64::from(u8::from(d == e))).collect();
                states.push((of_driven(&unit), self.bounds.upper[(d, d)]));
            }
            states.retain(|(_, energy)| *energy > 0.0);
        } else if states.is_empty() {
            for i in 0..n {
                let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
                let v = self.basis.col(i).as_mat();
                let charges = dense::product(v.transpose(), self.bounds.upper.as_ref());
                states.push((unit, dense::product(charges.as_ref(), v)[(0, 0)].max(0.0)));
            }
        }
        let unit = VACUUM_PERMITTIVITY * problem.layout.unit;
        let mut total = Indicator::default();
        for (weights, energy) in states {
            for (first, part) in &self.solved {
                let own = &weights[*first..*first + part.energies.coefficients.len()];
                let mut note = |u: Option<Vec<f64>>| {
                    let Some(u) = u else { return };
                    let own = indicator(&part.domain, &part.primal.slice_energies(&u));
                    let own = folded(own, problem.reflected);
                    add(&mut total, &own, part.copies * unit / energy);
                };
                note(combined(own, &part.energies.coefficients));
                // What the grid misses of a base counts as well.
                note(part.added.as_ref().and_then(|added| combined(own, &added.cut)));
            }
        }
        total
    }

    /// The error of the target over the spread of the energies it follows from, where that error is about the tolerance: entries
    /// follow by polarisation, within the limits that the signs of a Maxwell matrix set.
    pub(crate) fn amplification(&self, tolerance: f64, settings: &Settings) -> f64 {
        let upper = &self.bounds.upper;
        let most = match settings.target {
            Target::Mutual(_) => LARGEST_AMPLIFICATION,
            Target::TwoTerminal | Target::Pair(_) | Target::Own(_) | Target::Matrix => {
                1.0 / SHARE_OF_DIAGONAL
            }
        };
        let ratio = |spread: f64| {
            let n = upper.nrows();
            let lower = Mat::from_fn(n, n, |i, j| upper[(i, j)] * if i == j { 1.0 - spread } else { 1.0 });
            let ratio = error_of(&MatrixBounds { lower, upper: upper.clone() }, settings) / spread;
            if ratio.is_finite() { ratio.clamp(1.0, most) } else { 1.0 }
        };
        // The ratio falls slowly with the spread.
        (0..3).fold(ratio(tolerance), |last, _| ratio(tolerance / last))
    }

    /// How much more energy the indicator says to be missing than any state of the target really misses: what it said that the
    /// energies would fall by from a coarser grid, over what they fell by at most.
    pub(crate) fn overstated(&self, coarser: &Coarser, missing: f64, settings: &Settings) -> Option<f64> {
        let falls = self.falls(&coarser.upper, settings);
        let most = falls.iter().fold(0.0_f64, |a, b| a.max(*b));
        let expected = coarser.missing - missing;
        (most > 0.0 && expected > 0.0).then(|| (expected / most).clamp(MOST_UNDERSTATED, MOST_OVERSTATED))
    }

    /// Without a dual problem: sets the lower energies to the upper ones minus the estimated error, which is what the surplus
    /// indicates (`missing`) and what open space adds (`beyond`).
    ///
    /// The surplus is judged by a coarser grid, if there is one: what the energies fell from there, over what the surplus said that
    /// they would.
    pub(crate) fn estimate(
        &mut self,
        coarser: Option<&Coarser>,
        missing: f64,
        beyond: f64,
        settings: &Settings,
    ) {
        let expected = coarser.map_or(0.0, |coarser| coarser.missing - missing);
        let understated = match coarser {
            Some(coarser) if expected > 0.0 => {
                self.falls(&coarser.upper, settings).iter().sum::<f64>() / expected
            }
            _ => 1.0,
        };
        let lacking = SURPLUS_FACTOR * understated.max(1.0) * missing + beyond;
        self.bounds.lower = self.bounds.upper.clone() * faer::Scale(1.0 - lacking.min(1.0));
    }

    /// How much the energies of the target fell from a coarser grid, relative, of each state that the target depends on.
    fn falls(&self, coarser: &Mat<f64>, settings: &Settings) -> Vec<f64> {
        let fall = |before: f64, now: f64| if now > 0.0 { ((before - now) / now).max(0.0) } else { 0.0 };
        let (target, upper) = (settings.target, &self.bounds.upper);
        let known = match target {
            Target::TwoTerminal | Target::Pair(_) => target.value(coarser).zip(target.value(upper)),
            Target::Mutual(_) | Target::Own(_) | Target::Matrix => None,
        };
        match known {
            Some((before, now)) => vec![fall(before, now)],
            None => {
                let rows = target.rows(upper.nrows()).into_iter();
                rows.map(|i| fall(coarser[(i, i)], upper[(i, i)])).collect()
            }
        }
    }

    /// The error that is compared with the tolerance: the largest relative spread of the target, or error estimate without bounds.
    pub(crate) fn error(&self, settings: &Settings) -> f64 {
        error_of(&self.bounds, settings)
    }

    /// The error that rounding alone leaves of the target, however fine the grid: that of bounds which differ by no more.
    pub(crate) fn rounding_error(&self, problem: &GridProblem<'_>) -> f64 {
        let all = self.all.upper_with_rounding(&self.rounding, contrast_of(&problem.layout.permittivity));
        error_of(&problem.floating.reduced(&all), problem.settings)
    }

    /// The solution: matrices with their bounds, and what they took.
    pub(crate) fn finish(
        self,
        problem: &GridProblem<'_>,
        grid: &Grid,
        shortfall: Option<String>,
    ) -> Solution {
        let (settings, layout) = (problem.settings, &problem.layout);
        let mut maxwell = self.bounds.entries();
        let mut two_terminal = self.bounds.two_terminal();
        let mut measured = settings.target.of(&self.bounds);
        let floating = if settings.bounds {
            problem.floating.proved(&self.all)
        } else {
            // The matrix of all conductors is taken to be as uncertain as the target.
            let lower = &self.all.upper * faer::Scale(1.0 - self.error(settings).min(0.5));
            problem.floating.estimated(&MatrixBounds { lower, upper: self.all.upper.clone() })
        };
        if !settings.bounds {
            // The reported value is the computed energy, with the error estimate on either side.
            let centred = |upper: f64, b: Bounded| {
                let error = b.upper - b.lower;
                Bounded { value: upper, lower: upper - error, upper: upper + error }
            };
            two_terminal = two_terminal.map(|b| centred(b.upper, b));
            measured =
                measured.map(|b| centred(settings.target.value(&self.bounds.upper).unwrap_or(b.upper), b));
            for (i, row) in maxwell.iter_mut().enumerate() {
                for (j, b) in row.iter_mut().enumerate() {
                    *b = centred(self.bounds.upper[(i, j)], *b);
                }
            }
        }
        let stalled = || {
            "the linear solver stopped before its goal: the elements of the grid differ too much in size"
                .to_owned()
        };
        // Bounds are proved wherever the linear solver stopped.
        let shortfall = shortfall.or_else(|| (!self.converged && !settings.bounds).then(stalled));
        Solution {
            two_terminal,
            measured,
            maxwell,
            floating,
            reached: shortfall.is_none(),
            shortfall,
            unknowns: self.unknowns,
            iterations: self.iterations,
            grids: 1,
            mirrored: if settings.symmetry { layout.mirror.map(|m| m.is_some()) } else { [false; 3] },
            resolution: Discretisation::Grid(grid.level()),
            repair_share: self.repair_share,
            seconds: self.seconds,
            field: None,
        }
    }
}

impl SolvedPart {
    /// The energies of the dual problem under a map.
    pub(super) fn bent_lower(&self, problem: &GridProblem<'_>, share: f64) -> Result<Energies, SolveError> {
        let cancel = problem.settings.cancel.as_deref();
        if let (Some(OnBase { index, under_map, missed, .. }), Some(base)) = (&self.added, problem.base) {
            let part = &problem.parts[*index];
            let held = part.layout.held();
            let added = Added::new(base, part, &self.domain, &held).ok_or(SolveError::Superposition)?;
            let own = (under_map, self.energies.coefficients.as_slice());
            let with = (self.images.as_slice(), &self.primal);
            let upper = [&self.energies.matrix, missed];
            return added.lower(&self.domain, upper, own, with, share, cancel);
        }
        let solved = Solved {
            coefficients: &self.energies.coefficients,
            less: None,
            energies: &self.energies.matrix,
            images: &self.images,
            bent: self.primal.bent(),
        };
        bent_lower(&self.domain, &self.potentials, &solved, share, cancel)
    }
}

/// The potential of right-hand sides with these weights; `None` if all are zero.
fn combined(weights: &[f64], potentials: &[Vec<f64>]) -> Option<Vec<f64>> {
    let mut out = vec![0.0; potentials.first()?.len()];
    for (w, u) in weights.iter().zip(potentials).filter(|(w, _)| **w != 0.0) {
        axpy(&mut out, *w, u);
    }
    weights.iter().any(|w| *w != 0.0).then_some(out)
}

/// The largest relative spread of the target within bounds, or error estimate without.
pub(crate) fn error_of(m: &MatrixBounds, settings: &Settings) -> f64 {
    let n = m.upper.nrows();
    let value = |lower: f64, upper: f64| if settings.bounds { 0.5 * (lower + upper) } else { upper };
    let relative = |lower: f64, upper: f64| {
        if upper > 0.0 { (upper - lower) / value(lower, upper).abs() } else { 0.0 }
    };
    if let Some(own) = settings.target.of(m) {
        return relative(own.lower, own.upper);
    }
    let pair = m.two_terminal().map(|t| relative(t.lower, t.upper));
    // Limits of an entry may be narrower than its own energies make them, because of the sign rules.
    let bounded = settings.bounds.then(|| m.entries());
    let entries = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| {
        let (lower, upper) = (&m.lower, &m.upper);
        let own = bounded.as_ref().map(|entries| entries[i][j]);
        if i == j {
            let (lower, upper) = own.map_or((lower[(i, i)], upper[(i, i)]), |own| (own.lower, own.upper));
            return relative(lower, upper);
        }
        let gap = |i: usize| (upper[(i, i)] - lower[(i, i)]).max(0.0);
        let least = SHARE_OF_DIAGONAL * (upper[(i, i)] * upper[(j, j)]).sqrt();
        match own {
            Some(own) => (own.upper - own.lower) / own.value.abs().max(least),
            None => (gap(i) * gap(j)).sqrt() / upper[(i, j)].abs().max(least),
        }
    });
    // NaN counts as the largest error.
    entries.chain(pair).fold(0.0, |a, b| if a >= b { a } else { b })
}

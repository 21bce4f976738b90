//! The solution of a scene on one grid: energies of its symmetric parts, both bounds, and the indicator of
//! where energy is missing.
//!
//! The scene is split into parts that are even or odd across its mirror planes ([`crate::boxes::symmetry`]).
//! On each grid every part gives an upper and a lower energy matrix ([`crate::boxes::energy`]); together they
//! are the bounds on the Maxwell matrix.

use crate::bounded::Bounded;
use crate::boxes::energies::Energies;
use crate::boxes::field::{Share, sample};
use crate::boxes::grid_problem::GridProblem;
use crate::boxes::grid_refinement::{Indicator, add, folded, indicator};
use crate::boxes::layout::Grid;
use crate::boxes::one_part::{OnBase, PartPotentials, Potentials, SolvedPart, combined, solve_part};
use crate::boxes::superposed::Sight;
use crate::error::SolveError;
use crate::matrix::{MatrixBounds, contrast_of, from_energies, of_squares, rounding_scale};
use crate::shortfall::Shortfall;
use crate::solution::{Discretisation, Field, PhaseSeconds, Settings, Solution};
use crate::target::{SHARE_OF_DIAGONAL, Target};
use crate::vacuum::VACUUM_PERMITTIVITY;
use elastocap_geometry::scene::Scene;
use elastocap_linalg::dense::{self, Lu};
use faer::{Mat, Scale};

/// Without bounds, the estimated error over the missing energy that the surplus indicates, which is 0.6 to
/// 1.6 times the true error on cubes, plates and pairs. Measured: the rows "true error" of
/// `cargo bench --bench targets`.
const SURPLUS_FACTOR: f64 = 1.75;

/// Largest [`Outcome::amplification`] of a coupling that is the target itself, however weak it is. Not tuned:
/// a limit that ordinary cases do not reach.
const LARGEST_AMPLIFICATION: f64 = 1e4;

/// The least and the largest value that [`Outcome::overstated`] may have. Not tuned: they keep a single grid
/// from misleading the search.
const MOST_UNDERSTATED: f64 = 0.5;
const MOST_OVERSTATED: f64 = 100.0;

/// The results on the grid before, with which the error estimate of a solve without bounds compares.
pub(crate) struct Coarser {
    /// Relative energy that the surplus indicated to be missing.
    pub(crate) missing: f64,
    /// Upper energies of the driven conductors, F.
    pub(crate) upper: Mat<f64>,
}

/// Least share of the error of the added solution that each part is assumed to have. Tuned: time the runs of
/// the balls in docs/change.md, section "Reach".
const LEAST_OF_PART: f64 = 0.1;

/// What a body sees of the error of a base in total, over what it sees of the part of that error that has no
/// sources around the body. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const SEEN_BESIDE: f64 = 1.3;

/// The solution on one grid: bounds on the capacitances, and the symmetric parts that they come from.
pub(crate) struct Outcome {
    /// Bounds on the matrix of the driven conductors, which is reported.
    pub(crate) bounds: MatrixBounds,
    /// Bounds on the matrix of all conductors.
    pub(crate) all_conductors: MatrixBounds,
    /// Bounds on the matrix that include the energies of the error of a base, where they are requested.
    pub(crate) with_error_of_base: Option<MatrixBounds>,
    /// Whether only one part was solved, so that the matrix is not a Maxwell matrix.
    is_part: bool,
    /// The form that the rounding error of `all_conductors` is proportional to, F.
    pub(super) rounding: Mat<f64>,
    /// Potentials of the right-hand sides, in columns.
    pub(super) basis: Mat<f64>,
    /// Parts that have a field, each after the index of its first column in `basis`.
    pub(super) solved: Vec<(usize, SolvedPart)>,
    /// Unknowns of the largest part, primal plus dual.
    pub(crate) unknowns: usize,
    /// Iterations of the linear solvers, of all parts together.
    pub(crate) iterations: usize,
    /// Whether the linear solvers reached their goals for all right-hand sides.
    pub(crate) converged: bool,
    /// The largest [`Energies::repair_share`] of any part.
    pub(crate) repair_share: f64,
    /// Times of all parts.
    pub(super) seconds: PhaseSeconds,
}

/// Which lower bounds a grid is to give.
#[derive(Clone, Copy)]
pub(crate) enum Lower<'a> {
    /// None: they are set equal to the upper ones.
    None,
    /// The bounds of the dual problem on the grid. Under a map the dual problem is solved after the primal
    /// one. It is skipped where the new upper bounds and the lower bounds `known` from another grid already
    /// give an error of at most `accepted`.
    Proved { known: Option<&'a Mat<f64>>, accepted: f64 },
}

impl Lower<'_> {
    /// Requests the bounds of the dual problem on the grid, whatever other grids gave.
    pub(crate) const OF_GRID: Self = Self::Proved { known: None, accepted: 0.0 };
}

/// Solves all parts on one grid: the primal problem, and the dual one as far as it is needed. The linear
/// solvers start from the potentials on a coarser grid, if there are any, and stop when their error is about
/// `share` of the energy.
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
    let mut out = Outcome { is_part: problem.is_part, ..Outcome::empty() };
    let (core, grid) = (grid, &grid.reflected(problem.reflected));
    let has_lower = !matches!(lower, Lower::None);
    let place = |to: &mut Mat<f64>, first: usize, part: &SolvedPart, energies: &Mat<f64>| {
        for (i, j) in (0..energies.nrows()).flat_map(|i| (0..energies.ncols()).map(move |j| (i, j))) {
            to[(first + i, first + j)] = part.copies * energies[(i, j)];
        }
    };
    let mut first = 0;
    for (index, part) in problem.parts.iter().enumerate() {
        if !part.potentials.is_empty() {
            let coarser = coarser.map(|coarser| (coarser, first));
            let (solved, dual) = solve_part(problem, index, [core, grid], share, has_lower, coarser)?;
            place(&mut up, first, &solved, &solved.energies.matrix);
            if let Some(dual) = &dual {
                place(&mut low, first, &solved, &dual.matrix);
            }
            out.add_cost(&solved.energies, dual.as_ref());
            out.solved.push((first, solved));
        }
        first += part.basis().count();
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
        out.set_bounds(problem, upper.clone(), known.clone())?;
        if out.error(problem.settings) <= accepted {
            out.basis = basis;
            return Ok(out);
        }
    }
    if has_lower && problem.layout.map.is_some() {
        let mut with_error = problem.sight.map(|_| [Mat::zeros(n, n), Mat::zeros(n, n)]);
        for k in 0..out.solved.len() {
            let Some((first, part)) = out.solved.get(k) else { continue };
            let dual = part.bent_lower(problem, share)?;
            place(&mut low, *first, part, &dual.matrix);
            match (&mut with_error, &dual.with_error_of_base) {
                (Some(sums), Some(forms)) => {
                    sums.iter_mut().zip(forms).for_each(|(sum, form)| place(sum, *first, part, form));
                }
                _ => with_error = None,
            }
            out.unknowns = out.unknowns.max(part.energies.unknowns + dual.unknowns);
            out.add_dual_cost(&dual);
        }
        out.with_error_of_base = with_error.map(|forms| {
            let [lower, upper] = forms.map(scaled);
            let mut bounds = MatrixBounds { lower, upper };
            bounds.count_rounding(&out.rounding, of_squares(contrast_of(&problem.layout.permittivity)));
            bounds
        });
    }
    let lower = if has_lower { scaled(low) } else { upper.clone() };
    out.set_bounds(problem, upper, lower)?;
    out.basis = basis;
    Ok(out)
}

impl Outcome {
    /// The outcome before any part is solved.
    pub(super) fn empty() -> Self {
        let none = || MatrixBounds { lower: Mat::zeros(0, 0), upper: Mat::zeros(0, 0) };
        Self {
            bounds: none(),
            all_conductors: none(),
            with_error_of_base: None,
            is_part: false,
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
        let part_potentials = |(first, part): &(usize, SolvedPart)| PartPotentials {
            first: *first,
            domain: part.domain.clone(),
            coefficients: part.energies.coefficients.clone(),
        };
        Potentials(self.solved.iter().map(part_potentials).collect())
    }

    /// Sets the bounds from energies of all conductors.
    ///
    /// # Errors
    /// Bounds that contradict each other.
    fn set_bounds(
        &mut self,
        problem: &GridProblem<'_>,
        upper: Mat<f64>,
        lower: Mat<f64>,
    ) -> Result<(), SolveError> {
        self.all_conductors = MatrixBounds { lower, upper };
        self.all_conductors
            .count_rounding(&self.rounding, of_squares(contrast_of(&problem.layout.permittivity)));
        if let Some(contradiction) = self.all_conductors.crossing() {
            return Err(SolveError::Contradiction(contradiction));
        }
        self.all_conductors.widen(&self.rounding, problem.left_out);
        self.all_conductors.uncross();
        self.bounds = problem.floating.reduced(&self.all_conductors);
        Ok(())
    }

    /// Adds the unknowns, iterations and times of one part.
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

    /// Adds the iterations and times of the dual problem of one part.
    fn add_dual_cost(&mut self, dual: &Energies) {
        self.iterations += dual.iterations;
        self.converged &= dual.converged;
        self.seconds.setup = self.seconds.setup.max(dual.seconds[0]);
        self.seconds.dual += dual.seconds[1];
        self.repair_share = self.repair_share.max(dual.repair_share);
    }

    /// The field for export, in the state that the target shows ([`Target::shown`]). Floating conductors
    /// carry their given charges.
    pub(crate) fn field(&self, scene: &Scene, problem: &GridProblem<'_>) -> Field {
        let GridProblem { layout, parts, settings, floating, .. } = problem;
        let n = layout.conductors.len();
        let driven = settings.target.shown(floating.driven.len());
        let potentials = floating.potentials(&self.all_conductors.upper, &driven, &floating.charges);
        let target = Mat::from_fn(n, 1, |i, _| potentials[i]);
        let weights = Lu::new(self.basis.as_ref()).solve(target.as_ref());
        let mut shares = Vec::new();
        let (mut first, mut common) = (0, 0.0);
        for part in parts {
            let first_fieldless = first + part.potentials.len();
            common += (first_fieldless..first_fieldless + part.fieldless.len())
                .map(|i| weights[(i, 0)])
                .sum::<f64>();
            first += part.basis().count();
        }
        for (first, part) in &self.solved {
            let weights: Vec<f64> =
                (0..part.energies.coefficients.len()).map(|i| weights[(first + i, 0)]).collect();
            if let Some(coefficients) = combined(&weights, &part.energies.coefficients) {
                shares.push(Share::new(&part.domain, coefficients, part.odd));
            }
        }
        let mirrored = layout.mirror.map(|m| m.is_some() && settings.symmetry);
        let mut field = sample((scene, settings.loaded_at), layout, &shares, mirrored, potentials);
        field.potential.iter_mut().for_each(|p| *p += common);
        field
    }

    /// The refinement indicator: relative missing energies of the primal solution along each axis, summed
    /// over the states that the target depends on.
    pub(crate) fn indicator(&self, problem: &GridProblem<'_>) -> Indicator {
        self.indicator_of(problem, problem.settings.target)
    }

    /// The refinement indicator: relative missing energies of the primal solution along each axis, summed
    /// over the states that `target` depends on.
    pub(super) fn indicator_of(&self, problem: &GridProblem<'_>, target: Target) -> Indicator {
        let n = self.basis.nrows();
        let GridProblem { floating, .. } = problem;
        let driven = floating.driven.len();
        let factor = Lu::new(self.basis.as_ref());
        let of_driven = |v: &[f64]| {
            let potentials =
                floating.potentials(&self.all_conductors.upper, v, &vec![0.0; floating.floating.len()]);
            let weights = factor.solve(Mat::from_fn(n, 1, |i, _| potentials[i]).as_ref());
            (0..n).map(|i| weights[(i, 0)]).collect::<Vec<f64>>()
        };
        // Weights of the right-hand sides in each state, and the state's energy.
        let mut states: Vec<(Vec<f64>, f64)> = Vec::new();
        if problem.opposite_alone {
            // The only right-hand side, with the potentials that it has.
            for (k, _) in &self.solved {
                let v = self.basis.col(*k).as_mat();
                let charges = dense::product(v.transpose(), self.all_conductors.upper.as_ref());
                let unit = (0..n).map(|i| f64::from(u8::from(i == *k))).collect();
                states.push((unit, dense::product(charges.as_ref(), v)[(0, 0)]));
            }
        } else if let Some([first, second]) = target.opposite(driven) {
            let upper = self.bounds.of_rows(&[first, second]).upper;
            let charges = Mat::from_fn(2, 1, |i, _| if i == 0 { 1.0 } else { -1.0 });
            let voltages = Lu::new(upper.as_ref()).solve(charges.as_ref());
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
                let weights = &weights[*first..*first + part.energies.coefficients.len()];
                let mut add_missing = |u: Option<Vec<f64>>| {
                    let Some(u) = u else { return };
                    let missing = indicator(&part.domain, &part.primal.slice_energies(&u));
                    let missing = folded(missing, problem.reflected);
                    add(&mut total, &missing, part.copies * unit / energy);
                };
                add_missing(combined(weights, &part.energies.coefficients));
                // The error of the interpolation of a base counts as well.
                add_missing(part.added.as_ref().and_then(|added| combined(weights, &added.interpolated)));
            }
        }
        total
    }

    /// The relative error of the target over the relative spread of the energies it follows from, where that
    /// error is about the tolerance. Entries of the matrix follow from energies by polarisation, within the
    /// limits that the signs of a Maxwell matrix set.
    pub(crate) fn amplification(&self, tolerance: f64, settings: &Settings) -> f64 {
        let upper = &self.bounds.upper;
        let most = match settings.target {
            Target::Mutual(_) | Target::Guarded(_) => LARGEST_AMPLIFICATION,
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

    /// How much more energy the indicator says to be missing than any state of the target misses: the
    /// decrease of the energies that it predicted on a coarser grid, over the largest decrease that was
    /// observed.
    pub(crate) fn overstated(&self, coarser: &Coarser, missing: f64, settings: &Settings) -> Option<f64> {
        let falls = self.falls(&coarser.upper, settings);
        let most = falls.iter().fold(0.0_f64, |a, b| a.max(*b));
        let expected = coarser.missing - missing;
        (most > 0.0 && expected > 0.0).then(|| (expected / most).clamp(MOST_UNDERSTATED, MOST_OVERSTATED))
    }

    /// Sets the lower energies to the upper ones minus an estimated error, where no dual problem is solved.
    /// The error is what the surplus indicates (`missing`) and what open space adds (`beyond`).
    ///
    /// The surplus is calibrated on a coarser grid, if there is one: by the observed decrease of the energies
    /// over the decrease that the surplus predicted.
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
        self.bounds.lower = self.bounds.upper.clone() * Scale(1.0 - lacking.min(1.0));
    }

    /// The relative decrease of the energy from a coarser grid, for each state that the target depends on.
    fn falls(&self, coarser: &Mat<f64>, settings: &Settings) -> Vec<f64> {
        let fall = |before: f64, now: f64| if now > 0.0 { ((before - now) / now).max(0.0) } else { 0.0 };
        let (target, upper) = (settings.target, &self.bounds.upper);
        let known = match target {
            Target::TwoTerminal | Target::Pair(_) => target.value(coarser).zip(target.value(upper)),
            Target::Mutual(_) | Target::Own(_) | Target::Guarded(_) | Target::Matrix => None,
        };
        match known {
            Some((before, now)) => vec![fall(before, now)],
            None => {
                let rows = target.rows(upper.nrows()).into_iter();
                rows.map(|i| fall(coarser[(i, i)], upper[(i, i)])).collect()
            }
        }
    }

    /// The error that is compared with the tolerance: the largest relative spread of the target, or error
    /// estimate without bounds.
    pub(crate) fn error(&self, settings: &Settings) -> f64 {
        match &self.with_error_of_base {
            Some(bounds) => linear_error(bounds, settings),
            None if self.is_part => linear_error(&self.bounds, settings),
            None => error_of(&self.bounds, settings),
        }
    }

    /// The effective error of the base for the target, and the error that a body sees of it. The error of the
    /// base enters in products with that of the added solution, so each part counts by the energy that is
    /// added to it.
    pub(crate) fn base_errors(&self, problem: &GridProblem<'_>, sight: &Sight) -> [f64; 2] {
        let forms = |form: &dyn Fn(&OnBase, &Mat<f64>) -> Mat<f64>| {
            self.of_gaps(problem, |part| {
                let none = || Mat::zeros(0, 0);
                part.added.as_ref().map_or_else(none, |added| form(added, &part.energies.matrix))
            })
        };
        let known = forms(&|added, _| added.base[0].clone());
        let seen = forms(&|added, _| &added.base[0] * Scale(sight.share(added.is_odd)));
        let added = forms(&|added, energies| energies - &added.base[1]);
        let total = added.iter().map(|x| x.abs()).sum::<f64>().max(f64::MIN_POSITIVE);
        let root: f64 = known
            .iter()
            .zip(&added)
            .map(|(known, added)| (known * (added.abs() / total).max(LEAST_OF_PART)).sqrt())
            .sum();
        [root * root, SEEN_BESIDE * seen.iter().sum::<f64>()]
    }

    /// For each part, the spread of the target that a gap in the energies of the part causes, over the
    /// target's value.
    pub(in crate::boxes) fn of_gaps(
        &self,
        problem: &GridProblem<'_>,
        gap: impl Fn(&SolvedPart) -> Mat<f64>,
    ) -> Vec<f64> {
        let (n, unit) = (self.basis.nrows(), VACUUM_PERMITTIVITY * problem.layout.unit);
        let target = problem.settings.target;
        let value = target.within(&self.bounds).map_or(f64::NAN, |bounded| bounded.value.abs());
        let of_part = |(first, part): &(usize, SolvedPart)| {
            let (gap, mut spread) = (gap(part), Mat::zeros(n, n));
            for (i, j) in (0..gap.nrows()).flat_map(|i| (0..gap.ncols()).map(move |j| (i, j))) {
                spread[(first + i, first + j)] = unit * part.copies * gap[(i, j)];
            }
            let bounds = MatrixBounds { lower: Mat::zeros(n, n), upper: from_energies(&self.basis, &spread) };
            target.within(&bounds).map_or(f64::NAN, |bounded| (bounded.upper - bounded.lower) / value)
        };
        self.solved.iter().map(of_part).collect()
    }

    /// The error of the target due to rounding alone, however fine the grid: that of bounds that differ by no
    /// more.
    pub(crate) fn rounding_error(&self, problem: &GridProblem<'_>) -> f64 {
        let bounds = self
            .all_conductors
            .upper_with_rounding(&self.rounding, of_squares(contrast_of(&problem.layout.permittivity)));
        error_of(&problem.floating.reduced(&bounds), problem.settings)
    }

    /// The solution: matrices with their bounds, unknowns, iterations and times.
    pub(crate) fn finish(
        self,
        problem: &GridProblem<'_>,
        grid: &Grid,
        shortfall: Option<Shortfall>,
    ) -> Solution {
        let (settings, layout) = (problem.settings, &problem.layout);
        let mut maxwell = self.bounds.entries();
        let mut two_terminal = self.bounds.two_terminal();
        let mut measured = settings.target.of(&self.bounds);
        let floating = if settings.bounds {
            problem.floating.proved(&self.all_conductors)
        } else {
            // The matrix of all conductors is taken to be as uncertain as the target.
            let lower = &self.all_conductors.upper * Scale(1.0 - self.error(settings).min(0.5));
            problem.floating.estimated(&MatrixBounds { lower, upper: self.all_conductors.upper.clone() })
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
        let with_error_of_base =
            self.with_error_of_base.as_ref().and_then(|bounds| settings.target.within(bounds));
        if problem.opposite_alone {
            // The matrix is that of the one state that was solved for.
            maxwell.clear();
        }
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
            foresight: None,
            with_error_of_base,
        }
    }
}

/// The relative spread of a linear target within bounds of a form that need not be a Maxwell matrix.
fn linear_error(bounds: &MatrixBounds, settings: &Settings) -> f64 {
    let relative =
        |target: Bounded| (target.upper - target.lower) / target.value.abs().max(settings.least_scale);
    settings.target.within(bounds).map_or(f64::INFINITY, relative)
}

/// The largest relative spread of the target within bounds, or the error estimate without bounds. Values
/// below [`Settings::least_scale`] are compared with that.
pub(crate) fn error_of(m: &MatrixBounds, settings: &Settings) -> f64 {
    let n = m.upper.nrows();
    let value = |lower: f64, upper: f64| if settings.bounds { 0.5 * (lower + upper) } else { upper };
    let relative = |lower: f64, upper: f64| {
        let scale = value(lower, upper).abs().max(settings.least_scale);
        if upper > 0.0 { (upper - lower) / scale } else { 0.0 }
    };
    if let Some(target) = settings.target.of(m) {
        return relative(target.lower, target.upper);
    }
    let pair = m.two_terminal().map(|t| relative(t.lower, t.upper));
    // The bounds on an entry may be narrower than the gap of its energy, because of the sign rules.
    let bounded = settings.bounds.then(|| m.entries());
    let entries = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| {
        let (lower, upper) = (&m.lower, &m.upper);
        let entry = bounded.as_ref().map(|entries| entries[i][j]);
        if i == j {
            let (lower, upper) =
                entry.map_or((lower[(i, i)], upper[(i, i)]), |entry| (entry.lower, entry.upper));
            return relative(lower, upper);
        }
        let gap = |i: usize| (upper[(i, i)] - lower[(i, i)]).max(0.0);
        let least = (SHARE_OF_DIAGONAL * (upper[(i, i)] * upper[(j, j)]).sqrt()).max(settings.least_scale);
        match entry {
            Some(entry) => (entry.upper - entry.lower) / entry.value.abs().max(least),
            None => (gap(i) * gap(j)).sqrt() / upper[(i, j)].abs().max(least),
        }
    });
    // NaN counts as the largest error.
    entries.chain(pair).fold(0.0, |a, b| if a >= b { a } else { b })
}

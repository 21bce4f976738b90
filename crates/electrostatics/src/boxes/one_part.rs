//! One symmetric part of a scene on one grid: the solution of its primal and dual problems, and its
//! potentials on the next grid.

use crate::boxes::domain::{Axis, Domain};
use crate::boxes::dual::across_grids::Fluxes;
use crate::boxes::dual::mapped::{Solved, lower as bent_lower};
use crate::boxes::energies::Energies;
use crate::boxes::energy::{Start, lower, upper};
use crate::boxes::grid_problem::GridProblem;
use crate::boxes::half_turn::images::{Image, images};
use crate::boxes::layout::Grid;
use crate::boxes::primal::Primal;
use crate::boxes::superposed::added::Added;
use crate::error::SolveError;
use elastocap_fem::tensor::{SparseRows, along, axpy};
use faer::Mat;

/// The potentials of all parts on a grid, from which iterations on a finer one start.
pub(crate) struct Potentials(pub(super) Vec<PartPotentials>);

/// The potentials of one part on a grid.
pub(super) struct PartPotentials {
    /// The number of the part's first right-hand side.
    pub(super) first: usize,
    /// The domain of the part on the grid.
    pub(super) domain: Domain,
    /// Coefficients for each right-hand side.
    pub(super) coefficients: Vec<Vec<f64>>,
}

/// The potentials of one part as functions of a finer grid.
pub(super) struct Embedded<'a> {
    /// The potentials on the coarser grid.
    coarse: &'a PartPotentials,
    /// Coefficients on the finer grid of the coarse functions of each axis.
    axes: Vec<SparseRows<f64>>,
}

impl Potentials {
    /// The potentials of the part whose first right-hand side has the number `first`, on a finer grid; `None`
    /// where the grid is not finer.
    pub(super) fn on(&self, first: usize, domain: &Domain) -> Option<Embedded<'_>> {
        let coarse = self.0.iter().find(|part| part.first == first)?;
        let of_axis =
            |(from, to): (&Axis, &Axis)| Some(SparseRows::from_mat(from.functions_in(to)?.as_ref()));
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

/// One symmetric part after its primal problem was solved.
pub(in crate::boxes) struct SolvedPart {
    /// Upper energies.
    pub(super) energies: Energies,
    /// The primal problem.
    pub(super) primal: Primal,
    /// The potentials of the conductors' blocks, one list for each right-hand side.
    potentials: Vec<Vec<f64>>,
    /// Which right-hand sides are images of others.
    images: Vec<Option<Image>>,
    /// The fluxes of the dual problem, where the problem keeps them.
    pub(super) fluxes: Option<Fluxes>,
    /// Lower energies, where they are computed together with the upper ones.
    pub(super) lower: Option<Mat<f64>>,
    /// Set where the solution is added to a base.
    pub(super) added: Option<OnBase>,
    /// The domain of the part on the grid.
    pub(super) domain: Domain,
    /// Whether the potentials are odd across the mirror plane of each axis.
    pub(super) odd: [bool; 3],
    /// Number of copies of the part that make up the whole scene.
    pub(super) copies: f64,
}

/// The data of a part that is added to a base.
pub(super) struct OnBase {
    /// The index of the part.
    pub(super) index: usize,
    /// The energies of y under the map. The symbols are those of [`crate::boxes::superposed`].
    under_map: Mat<f64>,
    /// The squares of z, where they were needed.
    missed: Mat<f64>,
    /// The interpolated base p, for each right-hand side.
    pub(super) interpolated: Vec<Vec<f64>>,
    /// The gap between the upper and lower energies of the base, and the upper energies.
    pub(super) base: [Mat<f64>; 2],
    /// Whether the base is odd across a mirror plane.
    pub(super) is_odd: bool,
}

/// Solves the primal problem of one part on one grid and, except under a map, its dual problem if
/// `lower_too`. The grid is given as that of the core and as reflected across some axes. The potentials of a
/// `coarser` grid come with the number of the part's first right-hand side.
pub(super) fn solve_part(
    problem: &GridProblem<'_>,
    index: usize,
    [core, grid]: [&Grid; 2],
    share: f64,
    lower_too: bool,
    coarser: Option<(&Potentials, usize)>,
) -> Result<(SolvedPart, Option<Energies>), SolveError> {
    let cancel = problem.settings.cancel.as_deref();
    let part = &problem.parts[index];
    let (mut domain, mut held) = part.layout.domain(grid);
    if let Some(turn) = &part.turn {
        let (others, conductors) = turn.other_parts(core);
        domain.turn = Some(Box::new(others));
        held.extend(conductors);
    }
    let mut potentials: Vec<Vec<f64>> =
        part.potentials.iter().map(|v| held.iter().map(|&c| v[c]).collect()).collect();
    let images =
        if problem.settings.symmetry { images(&domain, &potentials) } else { vec![None; potentials.len()] };
    let added = match problem.base {
        Some(base) => Some(Added::new(base, part, &domain, &held)?),
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
    let drive = added.as_ref().map(|added| added.drive(&base_energies));
    let of_upper = || upper(&domain, &potentials, &starts, drive.as_ref(), share, cancel);
    let mut on_base = None;
    let (energies, primal, dual, fluxes) = if domain.map.is_some() {
        let (mut energies, mut primal) = of_upper()?;
        if let Some(added) = &added {
            if primal.bent().is_some_and(|bent| bent.largest() > added.most_squeezed()) {
                return Err(SolveError::Superposition);
            }
            let under_map = energies.matrix.clone();
            let [upper, missed] = if lower_too {
                added.upper(&domain, &under_map, &energies.coefficients, &primal)?
            } else {
                [
                    added.approximate_energies(&under_map, &energies.coefficients, &mut primal),
                    Mat::zeros(0, 0),
                ]
            };
            energies.matrix = upper;
            on_base = Some((under_map, missed));
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
    let added = on_base.zip(added).map(|((under_map, missed), added)| OnBase {
        index,
        under_map,
        missed,
        base: added.base_forms(),
        is_odd: added.is_odd(),
        interpolated: added.interpolated,
    });
    let lower = dual.as_ref().map(|dual| dual.matrix.clone());
    Ok((SolvedPart { energies, primal, potentials, images, fluxes, lower, added, domain, odd, copies }, dual))
}

impl SolvedPart {
    /// The energies of the dual problem under a map.
    pub(super) fn bent_lower(&self, problem: &GridProblem<'_>, share: f64) -> Result<Energies, SolveError> {
        let cancel = problem.settings.cancel.as_deref();
        if let (Some(OnBase { index, under_map, missed, .. }), Some(base)) = (&self.added, problem.base) {
            let part = &problem.parts[*index];
            let held = part.layout.held();
            let added = Added::new(base, part, &self.domain, &held)?;
            let solution = (under_map, self.energies.coefficients.as_slice());
            let problem_data = (self.images.as_slice(), &self.primal);
            let upper = [&self.energies.matrix, missed];
            return added.lower(
                &self.domain,
                upper,
                solution,
                problem_data,
                problem.sight.as_ref(),
                share,
                cancel,
            );
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

/// The sum of the potentials of right-hand sides times these weights; `None` if all weights are zero.
pub(super) fn combined(weights: &[f64], potentials: &[Vec<f64>]) -> Option<Vec<f64>> {
    let mut out = vec![0.0; potentials.first()?.len()];
    for (w, u) in weights.iter().zip(potentials).filter(|(w, _)| **w != 0.0) {
        axpy(&mut out, *w, u);
    }
    weights.iter().any(|w| *w != 0.0).then_some(out)
}

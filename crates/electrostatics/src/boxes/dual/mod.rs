//! Thomson's principle: fluxes without divergence, whose energy bounds the capacitance from below.
//!
//! Unknowns are the discontinuous potentials of the mixed method, scaled by the square root of the
//! permittivity, in an orthonormal basis, `[i][j][k]`. Each grid line between two obstacles carries a matrix
//! T (`elastocap_fem::mixed`); products with it are formed piece by piece (`elastocap_fem::condensed`). The
//! operator is the sum of T over all lines of all three axes.
//!
//! The bound does not depend on the convergence of the linear solver. The solver leaves a small divergence r.
//! A second flux cancels it: the exact solution with source r on the whole box of the scene as if there were
//! no conductors. With A' the operator of that box the lower bound is
//!
//! J = (sigma, sigma) - r A'^-1 r,    sigma = M^-1 (g + D^T phi),
//!
//! for *any* phi: the flux of phi and the repair together have no divergence, and J is at most their Thomson
//! functional (J also subtracts the repair's energy inside conductors, which the functional does not
//! contain).

pub(crate) mod across_grids;
pub(crate) mod aim;
mod flux;
mod lines;
pub(crate) mod mapped;
mod operator;
mod pointwise;
mod precondition;
mod rays;
mod repair;
mod run_values;
pub(crate) mod superposed;

use crate::boxes::domain::{Axis, Domain};
use crate::boxes::half_turn::exchange::Exchange;
use crate::boxes::half_turn::fold::Fold;
use crate::boxes::half_turn::images::Image;
use crate::boxes::ray_permittivity::RayPermittivity;
use crate::boxes::schwarz::{Schwarz, SchwarzWork};
use crate::error::SolveError;
use elastocap_fem::mixed::{ones, potential_modes_of};
use elastocap_fem::radial::RadialBasis;
use elastocap_fem::reflection::reflected_modes;
use elastocap_fem::tensor::{Dims, SparseRows, Window, along, clear, dot, multiply, right, target};
use elastocap_linalg::conjugate_gradients::Operator;
use faer::Mat;
use lines::{Bundle, Run, Segment, bundles};
use rayon::prelude::*;
use rays::{inner, shares};
use repair::{Repair, Repaired, Repairs};
use std::borrow::Cow;
use std::ops::Range;

/// The dual problem on one domain.
#[derive(Debug)]
pub(crate) struct Dual {
    /// The lines of all axes; where `other` is set, of the last two.
    lines: Lines,
    /// Where the domain is the half of a scene: the lines of the first axis, which are whole on another half.
    other: Option<OtherLines>,
    /// The preconditioner.
    schwarz: Schwarz<f32>,
    /// Buffers of `schwarz`.
    work: SchwarzWork<f32>,
    /// The solver that finds the flux to cancel a divergence.
    repair: Repairs,
}

/// Lines on another half of a scene than the unknowns, and the exchange between the two halves.
#[derive(Debug)]
struct OtherLines {
    lines: Lines,
    exchange: Exchange,
    /// The parity of the potential under the turn: 1 if it is even, -1 if it is odd.
    parity: f64,
    /// For products with the operator: the unknowns on the other half, and the product there.
    work: [Vec<f64>; 2],
}

/// The lines of some axes of a domain, in an array of unknowns.
#[derive(Debug)]
struct Lines {
    /// Dimensions of the array of unknowns.
    dims: Dims,
    /// The unknowns in each block of the conductors.
    conductors: Vec<Window>,
    /// The lines of each axis, in bundles that meet the same obstacles.
    bundles: [Vec<Bundle>; 3],
    /// The distinct segments of lines between two obstacles, for each axis.
    segments: [Vec<Segment>; 3],
    /// The potentials' basis on each axis where flux leaves along rays.
    basis: [Option<Basis>; 3],
    /// The permittivity by which unknowns are scaled, and the constant potential 1.
    weights: Weights,
}

/// The potentials' basis on one axis where flux leaves along rays. On other axes the basis is that of scaled
/// Legendre polynomials.
#[derive(Debug)]
struct Basis {
    /// The basis, as combinations of scaled Legendre polynomials.
    radial: RadialBasis,
    /// Squared distance from the pole over that of the last nodes, per mode.
    shares: Vec<f64>,
}

impl Basis {
    fn new(axis: &Axis) -> Result<Option<Self>, SolveError> {
        let Some(rays) = axis.rays else { return Ok(None) };
        let radial = RadialBasis::new(&axis.line, rays.pole)?;
        let shares = radial.squares.iter().map(|s| s / (rays.radius * rays.radius)).collect();
        Ok(Some(Self { radial, shares }))
    }
}

/// Lines of one run along an axis, at one index `row` of the first transverse axis and the indices `columns`
/// of the second.
struct Strip<'a> {
    axis: usize,
    /// The modes along the axis between two obstacles.
    run: &'a Run,
    row: usize,
    columns: Range<usize>,
}

/// The constant potential 1, and the square root of the permittivity, by which the unknowns are scaled.
#[derive(Debug)]
struct Weights {
    /// Coefficients of the constant 1 in the modes of each axis.
    ones: [Vec<f64>; 3],
    /// Square root of the permittivity of each cell of intervals.
    root: Vec<f64>,
    /// Numbers of intervals.
    cells: [usize; 3],
    /// The interval of each mode of each axis.
    interval: [Vec<usize>; 3],
}

impl Weights {
    /// Square root of the permittivity at a position (i, j, k) in the array of unknowns.
    fn root_at(&self, position: [usize; 3]) -> f64 {
        let [i, j, k] = [0, 1, 2].map(|a| self.interval[a][position[a]]);
        self.root[(i * self.cells[1] + j) * self.cells[2] + k]
    }
}

/// The basis of each axis of a domain.
fn bases(domain: &Domain) -> Result<[Option<Basis>; 3], SolveError> {
    let [b0, b1, b2] = [0, 1, 2].map(|a| Basis::new(&domain.axes[a]));
    Ok([b0?, b1?, b2?])
}

impl Weights {
    fn new(domain: &Domain, basis: &[Option<Basis>; 3]) -> Self {
        let interval = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            (0..axis.intervals()).flat_map(|m| axis.modes(m, m + 1).map(move |_| m)).collect()
        });
        Self {
            ones: [0, 1, 2].map(|a| {
                let legendre = ones(&domain.axes[a].line);
                let Some(basis) = &basis[a] else { return legendre };
                let column = Mat::from_fn(legendre.len(), 1, |i, _| legendre[i]);
                basis.radial.rotate_rows(0, &column).col(0).iter().copied().collect()
            }),
            root: domain.permittivity.iter().map(|e| e.sqrt()).collect(),
            cells: domain.cells(),
            interval,
        }
    }
}

impl Dual {
    /// Assembles line matrices and box modes.
    pub(crate) fn new(domain: &Domain) -> Result<Self, SolveError> {
        let domain = &domain.truncated();
        let basis = bases(domain)?;
        let Some(turn) = &domain.turn else {
            let schwarz = precondition::schwarz(domain, &basis, domain.dual_dims())?;
            let repair =
                Repairs::Whole(Box::new(Repair::new(domain, &basis, &RayPermittivity::new(domain))?));
            let lines = Lines::new(domain, basis, [0, 1, 2])?;
            return Ok(Self { lines, other: None, schwarz, work: SchwarzWork::default(), repair });
        };
        let on_other = bases(&turn.half)?;
        let [first, last] = [reflection(&turn.half, &on_other, 0), reflection(domain, &basis, 2)];
        let exchange = Exchange::new(&first, domain.dual_dims()[1], &last)?;
        let fold = Fold::new(domain.dual_dims(), last.as_ref(), [0; 2])?;
        let on_quarters = turn.quarters.each_ref().map(bases);
        let quarter = |k: usize, basis: &[Option<Basis>; 3]| {
            precondition::schwarz(&turn.quarters[k], basis, turn.quarters[k].dual_dims())
        };
        let [odd, even] = on_quarters;
        let (odd, even) = (odd?, even?);
        let schwarz = precondition::schwarz(domain, &basis, domain.dual_dims())?
            .with_quarters(fold.clone(), [quarter(0, &odd)?, quarter(1, &even)?]);
        let repair = Repairs::of_quarters(fold, &turn.quarters, [odd, even])?;
        let lines = Lines::new(domain, basis, [1, 2])?;
        let mut other = Lines::new(&turn.half, on_other, [0])?;
        // The blocks of the other half come after those of this one.
        other.number_conductors_from(domain.conductors.len());
        let other =
            Some(OtherLines { lines: other, exchange, parity: turn.parity(), work: Default::default() });
        Ok(Self { lines, other, schwarz, work: SchwarzWork::default(), repair })
    }

    /// The set of lines in which those of axis `a` are whole.
    fn whole_lines(&self, a: usize) -> &Lines {
        match (&self.other, a) {
            (Some(other), 0) => &other.lines,
            _ => &self.lines,
        }
    }

    /// Unknowns in the array that the lines of an axis are in, see [`Dual::whole_lines`].
    fn unknowns_along<'x>(&self, a: usize, x: &'x [f64]) -> Cow<'x, [f64]> {
        match (&self.other, a) {
            (Some(other), 0) => Cow::Owned(other.exchange.to_second(x, other.parity)),
            _ => Cow::Borrowed(x),
        }
    }

    /// Adds to an array of unknowns what `add` adds for the lines of an axis to the array that these lines
    /// are in.
    fn add_along(&self, a: usize, y: &mut [f64], add: impl FnOnce(&Lines, &mut [f64])) {
        match (&self.other, a) {
            (Some(other), 0) => {
                let mut on_other = vec![0.0; other.lines.unknowns()];
                add(&other.lines, &mut on_other);
                other.exchange.add_to_first(&on_other, other.parity, y);
            }
            _ => add(&self.lines, y),
        }
    }

    /// Right-hand side b = -D M^-1 g for the given potential of each block of a conductor.
    pub(crate) fn source(&self, potentials: &[f64]) -> Vec<f64> {
        let mut b = vec![0.0; self.unknowns()];
        for a in 0..3 {
            self.add_along(a, &mut b, |lines, b| lines.add_source(a, potentials, b));
        }
        self.clear_conductors(&mut b);
        b
    }

    /// Zeroes the unknowns in conductors.
    fn clear_conductors(&self, x: &mut [f64]) {
        for window in &self.lines.conductors {
            clear(x, self.lines.dims, window);
        }
    }

    /// The unknowns of a continuous potential, given by its coefficients in the primal problem on the domain.
    /// They approximate those of the potential's flux.
    pub(crate) fn modes_of(&self, domain: &Domain, potential: &[f64]) -> Vec<f64> {
        let mut dims = domain.primal_dims();
        let mut x = potential.to_vec();
        for (a, axis) in domain.axes.iter().enumerate() {
            let modes = potential_modes_of(&axis.line);
            let functions = axis.functions();
            let free = modes.as_ref().subcols(functions.start, functions.len()).to_owned();
            let modes = self.lines.basis[a].as_ref().map_or_else(
                || SparseRows::from_mat(free.as_ref()),
                |basis| SparseRows::from_mat(basis.radial.rotate_rows(0, &free).as_ref()),
            );
            (x, dims) = along(a, &modes, &x, dims);
        }
        let [_, n1, n2] = self.lines.dims;
        x.par_chunks_mut(n1 * n2).enumerate().for_each(|(i, slab)| {
            for (index, x) in slab.iter_mut().enumerate() {
                // The flux of phi is M^-1 (g + D^T phi), that of a potential V is -eps grad V.
                *x *= -self.lines.weights.root_at([i, index / n2, index % n2]);
            }
        });
        self.clear_conductors(&mut x);
        x
    }

    /// The unknowns of the image of a right-hand side whose unknowns are `x`.
    pub(crate) fn image(&self, domain: &Domain, x: &[f64], image: &Image) -> Vec<f64> {
        let whole = domain.truncated();
        image.applied(x, self.lines.dims, |a| reflection(&whole, &self.lines.basis, a))
    }

    /// (sigma_i, sigma_j) weighted by 1 / permittivity, of the fluxes M^-1 (g_i + D^T phi_i).
    pub(crate) fn flux_energies(&self, potentials: &[&[f64]], phi: &[&[f64]]) -> Mat<f64> {
        let mut total = Mat::zeros(phi.len(), phi.len());
        for a in 0..3 {
            let on_lines: Vec<Cow<'_, [f64]>> = phi.iter().map(|x| self.unknowns_along(a, x)).collect();
            let phi: Vec<&[f64]> = on_lines.iter().map(AsRef::as_ref).collect();
            total += self.whole_lines(a).flux_energies(a, potentials, &phi);
        }
        total
    }

    /// r = b - A x, computed anew and not by the recursion of the linear solver.
    pub(crate) fn true_residual(&mut self, b: &[f64], x: &[f64], r: &mut [f64]) {
        self.apply(x, r);
        r.par_iter_mut().zip(b).with_min_len(16_384).for_each(|(r, b)| *r = b - *r);
    }

    /// Whether a residual must hold no net charge for the repair to cancel it, as where every wall is
    /// insulated.
    pub(crate) fn must_balance(&self) -> bool {
        self.repair.is_singular()
    }

    /// Adds a multiple of the constant potential to `x`, which also reduces the error of `x`, so that the
    /// residual `r` = b - A x holds no net charge.
    pub(crate) fn balance(&self, x: &mut [f64], r: &mut [f64]) {
        let constant = self.constant();
        let removed = self.flux_residual(&vec![0.0; self.blocks()], &constant);
        let step = -dot(&constant, r) / dot(&constant, &removed);
        for ((x, r), (c, t)) in x.iter_mut().zip(r).zip(constant.iter().zip(&removed)) {
            *x += step * c;
            *r += step * t;
        }
    }

    /// Number of blocks of conductors.
    pub(crate) fn blocks(&self) -> usize {
        let other = self.other.as_ref().map_or(0, |other| other.lines.conductors.len());
        self.lines.conductors.len() + other
    }

    /// The constant potential 1 on the free cells, in the scaled basis.
    fn constant(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns()];
        let [n0, n1, n2] = self.lines.dims;
        for i in 0..n0 {
            for j in 0..n1 {
                for k in 0..n2 {
                    let one = self.lines.weights.ones[0][i]
                        * self.lines.weights.ones[1][j]
                        * self.lines.weights.ones[2][k];
                    if one != 0.0 {
                        out[(i * n1 + j) * n2 + k] = one * self.lines.weights.root_at([i, j, k]);
                    }
                }
            }
        }
        self.clear_conductors(&mut out);
        out
    }

    /// The potential of the flux that cancels the residual `r`. Starts from `near` if that is given.
    pub(crate) fn repair(&self, r: &[f64], near: Option<Vec<f64>>) -> Repaired {
        self.repair.solve(r, near, self.lines.dims, &self.lines.weights)
    }

    /// Largest ratio of the true energy of the repair to its energy with the separable permittivity for which
    /// it is computed.
    pub(crate) fn repair_excess(&self) -> f64 {
        self.repair.excess()
    }
}

/// The matrix that reflects coefficients of the potential modes of an axis of a domain without infinite
/// elements.
fn reflection(domain: &Domain, basis: &[Option<Basis>; 3], a: usize) -> Mat<f64> {
    let legendre = reflected_modes(&domain.axes[a].line);
    let Some(basis) = &basis[a] else { return legendre };
    let rotated = |m: Mat<f64>| basis.radial.rotate_rows(0, &m);
    let rotation = rotated(Mat::identity(legendre.nrows(), legendre.ncols()));
    rotated(&legendre * rotation.transpose())
}

impl Lines {
    /// Makes the lines of some axes of a domain without infinite elements.
    fn new<const N: usize>(
        domain: &Domain,
        basis: [Option<Basis>; 3],
        axes: [usize; N],
    ) -> Result<Self, SolveError> {
        let ray_permittivity = RayPermittivity::new(domain);
        let lines_of = |a: usize| match axes.contains(&a) {
            true => bundles(domain, a, basis[a].as_ref(), &ray_permittivity),
            false => Ok((Vec::new(), Vec::new())),
        };
        let ((lines0, lines1), lines2) =
            rayon::join(|| rayon::join(|| lines_of(0), || lines_of(1)), || lines_of(2));
        let [(b0, s0), (b1, s1), (b2, s2)] = [lines0?, lines1?, lines2?];
        let windows = domain
            .conductors
            .iter()
            .map(|c| [0, 1, 2].map(|a| domain.axes[a].modes(c.lo[a], c.hi[a])))
            .collect();
        Ok(Self {
            dims: domain.dual_dims(),
            conductors: windows,
            bundles: [b0, b1, b2],
            segments: [s0, s1, s2],
            weights: Weights::new(domain, &basis),
            basis,
        })
    }

    fn unknowns(&self) -> usize {
        self.dims.iter().product()
    }

    /// Numbers the conductors' blocks from `first` on instead of from zero.
    fn number_conductors_from(&mut self, first: usize) {
        let runs = self.bundles.iter_mut().flatten().flat_map(|bundle| &mut bundle.runs);
        for end in runs.flat_map(|run| run.ends.iter_mut().flatten()) {
            *end += first;
        }
    }

    /// Adds -D M^-1 g on the lines of an axis, for the given potential of each block of a conductor.
    fn add_source(&self, a: usize, potentials: &[f64], b: &mut [f64]) {
        let (p, q) = others(a);
        let strides = [self.dims[1] * self.dims[2], self.dims[2], 1];
        let across = shares(&self.basis, a);
        for bundle in &self.bundles[a] {
            for run in &bundle.runs {
                let segment = &self.segments[a][run.segment];
                for side in 0..2 {
                    let Some(potential) = run.ends[side].map(|c| potentials[c]) else { continue };
                    if potential == 0.0 {
                        continue;
                    }
                    let mut add = |position: [usize; 3], weight: f64, along: &[f64]| {
                        let first = (position[0] * self.dims[1] + position[1]) * self.dims[2] + position[2];
                        b[first..]
                            .iter_mut()
                            .step_by(strides[a])
                            .zip(along)
                            .for_each(|(b, v)| *b -= weight * v);
                    };
                    for s in bundle.across[0].clone() {
                        for t in bundle.across[1].clone() {
                            let mut position = [0; 3];
                            (position[a], position[p], position[q]) = (run.range.start, s, t);
                            let drive = potential * self.area(a, position);
                            if drive == 0.0 {
                                continue;
                            }
                            add(position, drive, &segment.source[side]);
                            let Some(leaving) = &segment.leaving else { continue };
                            let mut trace = [0.0; 2];
                            for (trace, end) in trace.iter_mut().zip(&leaving.sides) {
                                *trace = inner(&segment.face[*end], &segment.face[side]);
                            }
                            let damped = leaving.damp(across[0][s] + across[1][t], trace);
                            for (d, v) in damped.iter().zip(&leaving.vectors) {
                                add(position, -drive * d, v);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Coefficient of a unit potential on the face of axis `a` at the two transverse modes of `position`,
    /// times the root of the permittivity of the run's first interval, to which the mode `position[a]`
    /// belongs.
    fn area(&self, a: usize, position: [usize; 3]) -> f64 {
        let (p, q) = others(a);
        let one = self.weights.ones[p][position[p]] * self.weights.ones[q][position[q]];
        if one == 0.0 { 0.0 } else { one * self.weights.root_at(position) }
    }

    /// (sigma_i, sigma_j) weighted by 1 / permittivity, of the parts of the fluxes M^-1 (g_i + D^T phi_i)
    /// along an axis.
    fn flux_energies(&self, a: usize, potentials: &[&[f64]], phi: &[&[f64]]) -> Mat<f64> {
        let count = phi.len();
        let mut total = Mat::zeros(count, count);
        let across = shares(&self.basis, a);
        for (bundle, run) in self.runs(a) {
            // One strip of lines at a time: rows of the first transverse axis.
            let partial: Vec<Mat<f64>> = bundle.across[0]
                .clone()
                .into_par_iter()
                .map(|s| {
                    let strip = Strip { axis: a, run, row: s, columns: bundle.across[1].clone() };
                    let fluxes: Vec<Vec<f64>> =
                        potentials.iter().zip(phi).map(|(v, x)| self.flux_of(&strip, v, x)).collect();
                    self.strip_energies(&strip, &fluxes, &across)
                })
                .collect();
            for m in &partial {
                total += m;
            }
        }
        total
    }

    /// The coordinates R phi + L^-1 g of the flux on the lines of a strip, `[coordinate][line]`, without the
    /// obliqueness of the flux that leaves along rays.
    fn flux_of(&self, strip: &Strip<'_>, potentials: &[f64], phi: &[f64]) -> Vec<f64> {
        let Strip { axis: a, run, row: s, columns } = strip;
        let (p, q) = others(*a);
        let strides = [self.dims[1] * self.dims[2], self.dims[2], 1];
        let segment = &self.segments[*a][run.segment];
        let root = &segment.root;
        let width = columns.len();
        let offset = run.range.start * strides[*a] + s * strides[p];
        let mut gathered = Vec::with_capacity(root.cols * width);
        for m in 0..root.cols {
            for t in columns.clone() {
                gathered.push(phi[offset + m * strides[*a] + t * strides[q]]);
            }
        }
        let mut flux = vec![0.0; root.rows * width];
        multiply(root.left(), right(&gathered, 0, width, width), target(&mut flux, 0, width), false);
        for side in 0..2 {
            let Some(end) = run.ends[side] else { continue };
            for (column, t) in columns.clone().enumerate() {
                let mut position = [0; 3];
                (position[*a], position[p], position[q]) = (run.range.start, *s, t);
                let drive = potentials[end] * self.area(*a, position);
                if drive != 0.0 {
                    for (i, f) in segment.face[side].iter().enumerate() {
                        flux[i * width + column] += drive * f;
                    }
                }
            }
        }
        flux
    }

    /// Corrects the result of [`Lines::flux_of`] for the obliqueness of the flux that leaves along rays.
    fn add_obliqueness(&self, strip: &Strip<'_>, flux: &mut [f64]) {
        let segment = &self.segments[strip.axis][strip.run.segment];
        let Some(leaving) = &segment.leaving else { return };
        let (across, width) = (shares(&self.basis, strip.axis), strip.columns.len());
        for (column, t) in strip.columns.clone().enumerate() {
            let mut trace = [0.0; 2];
            for (trace, end) in trace.iter_mut().zip(&leaving.sides) {
                let along = flux[column..].iter().step_by(width);
                *trace = along.zip(&segment.face[*end]).map(|(x, y)| x * y).sum();
            }
            let damped = leaving.damp(across[0][strip.row] + across[1][t], trace);
            for (side, d) in leaving.sides.iter().zip(damped) {
                for (flux, face) in flux[column..].iter_mut().step_by(width).zip(&segment.face[*side]) {
                    *flux -= d * face;
                }
            }
        }
    }

    /// Products in the energy of the fluxes of a strip with each other, from the results of
    /// [`Lines::flux_of`]; the oblique continuation along rays is included. `across` are the squared
    /// distances of the two transverse axes.
    fn strip_energies(&self, strip: &Strip<'_>, fluxes: &[Vec<f64>], across: &[&[f64]; 2]) -> Mat<f64> {
        let segment = &self.segments[strip.axis][strip.run.segment];
        let width = strip.columns.len();
        let count = fluxes.len();
        let mut energy = Mat::from_fn(count, count, |i, j| inner(&fluxes[i], &fluxes[j]));
        let Some(leaving) = &segment.leaving else { return energy };
        for (column, t) in strip.columns.clone().enumerate() {
            let traces: Vec<[f64; 2]> = fluxes
                .iter()
                .map(|flux| {
                    let mut trace = [0.0; 2];
                    for (trace, end) in trace.iter_mut().zip(&leaving.sides) {
                        let along = flux[column..].iter().step_by(width);
                        *trace = along.zip(&segment.face[*end]).map(|(x, y)| x * y).sum();
                    }
                    trace
                })
                .collect();
            let share = across[0][strip.row] + across[1][t];
            for (i, trace) in traces.iter().enumerate() {
                let damped = leaving.damp(share, *trace);
                for (j, other) in traces.iter().enumerate() {
                    energy[(i, j)] -= inner(&damped, other);
                }
            }
        }
        energy
    }
}

/// The two axes across `a`, ascending.
fn others(a: usize) -> (usize, usize) {
    match a {
        0 => (1, 2),
        1 => (0, 2),
        _ => (0, 1),
    }
}

//! Products of fluxes that were found on two grids of one scene.
//!
//! Let f_i be a flux without divergence in the state with potentials v_i, and g_i the charge of a flux on the
//! conductors, weighed by these potentials. By Thomson's principle, for fluxes on whatever grids,
//!
//! L_ij = g_i f_j + g_j f_i - (f_i, f_j)
//!
//! is a lower bound on the form of the capacitances: with the true fluxes t_i, g_i f = (t_i, f) for every f
//! without divergence, so that C_ij - L_ij = (f_i - t_i, f_j - t_j), which is positive semidefinite.
//!
//! The f_i are the fluxes of [`super`] with their repairs, one component along each axis. Those of two grids
//! belong to one space, that of the common refinement: along a line, the coordinates whose squares add up to
//! the energy are embedded isometrically, and across lines the modes are. Products therefore need matrices of
//! single axes only: the flux of one grid is taken to the other one axis after another, and no array of the
//! common refinement is ever made. Beyond the last nodes both fluxes continue along the same rays with the
//! same weights. These are at least the true ones, which only lowers L further.

use super::flux::Flux;
use super::lines::{Bundle, Run, Segment};
use super::rays::inner;
use super::repair::{Repair, Repairs};
use super::{Basis, Dual, Lines, Strip, others};
use crate::boxes::domain::{Axis, Domain};
use crate::error::SolveError;
use elastocap_fem::embedding::{embedding, mode_embedding};
use elastocap_fem::tensor::{Dense, Dims, SparseRows, along, dot, multiply, right, target};
use elastocap_linalg::dense;
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// The fluxes of one grid.
#[derive(Debug)]
pub(crate) struct Fluxes {
    /// The grid's lines.
    pub(super) lines: Lines,
    /// The solver of the repairs.
    repair: Repair,
    /// The domain up to the last finite nodes.
    pub(super) domain: Domain,
    /// The potentials from which the flux of each right-hand side is made.
    states: Vec<State>,
    /// The coordinates of the fluxes, once computed: see [`Fluxes::prepare`].
    pub(super) prepared: Vec<Flux>,
}

/// The potentials from which a flux without divergence is made.
#[derive(Debug)]
pub(crate) struct State {
    /// The potential of each block of a conductor.
    pub(crate) potentials: Vec<f64>,
    /// Potentials of the mixed method.
    pub(crate) phi: Vec<f64>,
    /// The potential of the repair. [`Fluxes::new`] scales it by the repair's separable permittivity.
    pub(crate) repair: Vec<f64>,
}

/// One axis of two grids and of their common refinement.
struct JointAxis {
    /// The axis of the first grid.
    first: Axis,
    /// The axis of the second grid.
    second: Axis,
    /// The axis of the common refinement.
    common: Axis,
    /// Flux functions of either grid in those of the common refinement.
    functions: [Mat<f64>; 2],
    /// Products of the modes of the second grid (rows) with those of the first (columns).
    modes: Mat<f64>,
    /// The same products, weighted by the squared distance from the pole over that of the last nodes; `None`
    /// where no flux leaves along rays.
    squares: Option<Mat<f64>>,
}

impl JointAxis {
    /// `None` where the common axis is not finer than both.
    fn new(axes: [&Axis; 2], bases: [Option<&Basis>; 2], common: &Axis) -> Result<Option<Self>, SolveError> {
        let functions = axes.map(|axis| embedding(&axis.line, &common.line));
        let modes = axes.map(|axis| mode_embedding(&axis.line, &common.line));
        let ([Some(f), Some(g)], [Some(x), Some(y)]) = (functions, modes) else { return Ok(None) };
        // Modes of each grid (rows) in the orthonormal ones of the common refinement (columns).
        let rotated = |basis: Option<&Basis>, embedded: Mat<f64>| {
            let rows = embedded.transpose().to_owned();
            basis.map_or_else(|| rows.clone(), |basis| basis.radial.rotate_rows(0, &rows))
        };
        let (x, y) = (rotated(bases[0], x), rotated(bases[1], y));
        let squares = Basis::new(common)?.map(|basis| {
            let in_common = |m: &Mat<f64>| basis.radial.rotate_rows(0, &m.transpose().to_owned());
            let (x, y) = (in_common(&x), in_common(&y));
            let weighed = Mat::from_fn(x.nrows(), x.ncols(), |i, j| basis.shares[i] * x[(i, j)]);
            dense::product(y.transpose(), weighed.as_ref())
        });
        let modes = dense::product(y.as_ref(), x.transpose());
        let [first, second] = axes.map(Axis::clone);
        Ok(Some(Self { first, second, common: common.clone(), functions: [f, g], modes, squares }))
    }

    /// Products of the coordinates of the fluxes of a segment on the second grid (rows) with those on the
    /// first (columns).
    fn coordinates(&self, first: &Segment, second: &Segment) -> Result<Mat<f64>, SolveError> {
        let common = first.coordinates(&self.common)?;
        let to = first.functions(&self.common);
        let embedded = |segment: &Segment, axis: &Axis, functions: &Mat<f64>| {
            let from = segment.functions(axis);
            let part = functions.as_ref().submatrix(to.start, from.start, to.len(), from.len());
            let coefficients = segment.coordinates(axis)?.coefficients();
            Ok::<_, SolveError>(common.of(dense::product(part, coefficients.as_ref()).as_ref()))
        };
        let x = embedded(first, &self.first, &self.functions[0])?;
        let y = embedded(second, &self.second, &self.functions[1])?;
        Ok(dense::product(y.transpose(), x.as_ref()))
    }
}

/// The flux of one run along its lines.
struct RunFlux {
    /// The coordinates whose squares add up to the energy, `[row][coordinate][column]`: a row and a column
    /// are the places of a line on the first and the second axis across.
    coordinates: Vec<f64>,
    /// Dimensions of that array.
    dims: Dims,
}

impl RunFlux {
    /// The flux through the faces at one end of the lines, outwards and weighed as in the coordinates:
    /// `[row][column]`.
    fn through(&self, face: &[f64]) -> Vec<f64> {
        let [_, len, width] = self.dims;
        let mut out = vec![0.0; self.dims[0] * width];
        let rows = self.coordinates.chunks_exact((len * width).max(1));
        for (out, lines) in out.chunks_exact_mut(width.max(1)).zip(rows) {
            for (line, f) in lines.chunks_exact(width.max(1)).zip(face).filter(|(_, f)| **f != 0.0) {
                out.iter_mut().zip(line).for_each(|(out, y)| *out += f * y);
            }
        }
        out
    }
}

impl Fluxes {
    /// Takes the fluxes over from a problem that is solved, and drops what only its solver needed. `None` for
    /// a problem on the half of a scene.
    pub(crate) fn new(dual: Dual, domain: &Domain, mut states: Vec<State>) -> Option<Self> {
        let Dual { lines, repair: Repairs::Whole(repair), .. } = dual else { return None };
        for state in &mut states {
            let psi = std::mem::take(&mut state.repair);
            state.repair = repair.separable_scaling(psi, lines.dims, &lines.weights);
        }
        Some(Self { lines, repair: *repair, domain: domain.truncated(), states, prepared: Vec::new() })
    }

    /// L_ij for state `i` of this grid and state `j` of another, in the domain's unit; `common` is their
    /// common refinement. `None` where the grids do not match.
    ///
    /// # Errors
    /// A common refinement whose elements differ too much in size.
    pub(crate) fn joint(
        &self,
        i: usize,
        (other, j): (&Self, usize),
        common: &Domain,
    ) -> Result<Option<f64>, SolveError> {
        let common = common.truncated();
        let axis = |a: usize| {
            let axes = [&self.domain.axes[a], &other.domain.axes[a]];
            JointAxis::new(axes, [self, other].map(|grid| grid.lines.basis[a].as_ref()), &common.axes[a])
        };
        let (Some(x), Some(y), Some(z)) = (axis(0)?, axis(1)?, axis(2)?) else { return Ok(None) };
        let axes = [x, y, z];
        let (Some(state), Some(other_state)) = (self.states.get(i), other.states.get(j)) else {
            return Ok(None);
        };
        let mut out = 0.0;
        for a in 0..3 {
            let (p, q) = others(a);
            let across = [&axes[p], &axes[q]];
            let couplings = self.lines.segments[a]
                .iter()
                .zip(&other.lines.segments[a])
                .map(|(x, y)| Ok(SparseRows::from_mat(axes[a].coordinates(x, y)?.as_ref())))
                .collect::<Result<Vec<_>, SolveError>>()?;
            let repairs = [self, other].map(|grid| grid.repair_functions(a));
            let [repairs, their_repairs] = repairs;
            let (repairs, their_repairs) = (repairs?, their_repairs?);
            let (bundles, their_bundles) = (&self.lines.bundles[a], &other.lines.bundles[a]);
            if bundles.len() != their_bundles.len() {
                return Ok(None);
            }
            for (bundle, their_bundle) in bundles.iter().zip(their_bundles) {
                for (run, their_run) in bundle.runs.iter().zip(&their_bundle.runs) {
                    let s = run.segment;
                    if their_run.segment != s {
                        return Ok(None);
                    }
                    let y = other.run_flux(other_state, a, their_bundle, their_run, &their_repairs[s]);
                    out += other.charge(&state.potentials, a, their_bundle, their_run, &y);
                    let x = self.run_flux(state, a, bundle, run, &repairs[s]);
                    out += self.charge(&other_state.potentials, a, bundle, run, &x);
                    let places = [&bundle.across, &their_bundle.across];
                    out -= product(&x, &y, &couplings[s], across, places);
                    let segments = [&self.lines.segments[a][s], &other.lines.segments[a][s]];
                    out -= oblique(&x, &y, segments, across, places);
                }
            }
        }
        Ok(Some(out))
    }

    /// Number of states.
    pub(super) fn states(&self) -> usize {
        self.states.len()
    }

    /// The coordinates of the flux of a state, its repair included: for each axis and each run of each bundle
    /// `[coordinate][line]`.
    pub(super) fn run_fluxes(&self, state: usize) -> Result<Flux, SolveError> {
        let mut out: [Vec<Vec<f64>>; 3] = Default::default();
        let Some(state) = self.states.get(state) else { return Ok(Flux(out)) };
        for a in 0..3 {
            let repairs = self.repair_functions(a)?;
            for bundle in &self.lines.bundles[a] {
                for run in &bundle.runs {
                    let RunFlux { coordinates, dims } =
                        self.run_flux(state, a, bundle, run, &repairs[run.segment]);
                    let [rows, len, width] = dims;
                    let mut by_coordinate = vec![0.0; coordinates.len()];
                    for (index, row) in coordinates.chunks_exact(width.max(1)).enumerate() {
                        let (line, coordinate) = (index / len.max(1), index % len.max(1));
                        let start = (coordinate * rows + line) * width;
                        by_coordinate[start..start + width].copy_from_slice(row);
                    }
                    out[a].push(by_coordinate);
                }
            }
        }
        Ok(Flux(out))
    }

    /// For each segment of an axis, the coordinates (rows) of the fluxes of repairs whose potentials are unit
    /// vectors on the whole line (columns).
    fn repair_functions(&self, a: usize) -> Result<Vec<Dense<f64>>, SolveError> {
        let axis = &self.domain.axes[a];
        let functions_of_axis = self.repair.flux_functions(axis, a, self.lines.basis[a].as_ref())?;
        let coordinates = |segment: &Segment| {
            let functions = segment.functions(axis);
            let part = functions_of_axis.as_ref().subrows(functions.start, functions.len());
            Ok(Dense::from_mat(segment.coordinates(axis)?.of(part).as_ref()))
        };
        self.lines.segments[a].iter().map(coordinates).collect()
    }

    /// The flux of one state on a run, its repair included.
    fn run_flux(&self, state: &State, a: usize, bundle: &Bundle, run: &Run, repair: &Dense<f64>) -> RunFlux {
        let lines = &self.lines;
        let (rows, columns) = (bundle.across[0].clone(), bundle.across[1].clone());
        let (len, width) = (lines.segments[a][run.segment].root.rows, columns.len());
        let mut coordinates = vec![0.0; rows.len() * len * width];
        coordinates.par_chunks_mut((len * width).max(1)).zip(rows.clone()).for_each(|(out, s)| {
            let strip = Strip { axis: a, run, row: s, columns: columns.clone() };
            let mut flux = lines.flux_of(&strip, &state.potentials, &state.phi);
            lines.add_obliqueness(&strip, &mut flux);
            let psi = self.gathered_repair(&strip, &state.repair);
            multiply(repair.left(), right(&psi, 0, width, width), target(&mut flux, 0, width), true);
            out.copy_from_slice(&flux);
        });
        RunFlux { coordinates, dims: [rows.len(), len, width] }
    }

    /// The repair's potential on the whole lines of a strip, in the scaling of the run: `[mode][column]`.
    fn gathered_repair(&self, strip: &Strip<'_>, repair: &[f64]) -> Vec<f64> {
        let (lines, a) = (&self.lines, strip.axis);
        let (p, q) = others(a);
        let stride = [lines.dims[1] * lines.dims[2], lines.dims[2], 1];
        let scale: Vec<f64> = (strip.columns.clone())
            .map(|t| {
                let mut position = [0; 3];
                (position[a], position[p], position[q]) = (strip.run.range.start, strip.row, t);
                let cells = [lines.weights.interval[p][strip.row], lines.weights.interval[q][t]];
                self.repair.root_across(a, cells) / lines.weights.root_at(position)
            })
            .collect();
        let mut out = Vec::with_capacity(lines.dims[a] * strip.columns.len());
        for m in 0..lines.dims[a] {
            let first = m * stride[a] + strip.row * stride[p];
            out.extend(
                strip.columns.clone().zip(&scale).map(|(t, scale)| scale * repair[first + t * stride[q]]),
            );
        }
        out
    }

    /// The charge of a run's flux on the conductors at its ends, each times its potential.
    fn charge(&self, potentials: &[f64], a: usize, bundle: &Bundle, run: &Run, flux: &RunFlux) -> f64 {
        let (p, q) = others(a);
        let segment = &self.lines.segments[a][run.segment];
        let mut out = 0.0;
        for side in 0..2 {
            let potential = run.ends[side].map_or(0.0, |c| potentials[c]);
            if potential == 0.0 {
                continue;
            }
            let through = flux.through(&segment.face[side]);
            let mut lines = through.iter();
            for s in bundle.across[0].clone() {
                for (t, flow) in bundle.across[1].clone().zip(&mut lines) {
                    let mut position = [0; 3];
                    (position[a], position[p], position[q]) = (run.range.start, s, t);
                    out += potential * self.lines.area(a, position) * flow;
                }
            }
        }
        out
    }
}

/// A block of the products of modes of two grids: columns for the lines of the first grid, rows for those of
/// the second.
fn part(matrix: &Mat<f64>, columns: &Range<usize>, rows: &Range<usize>) -> SparseRows<f64> {
    SparseRows::from_mat(matrix.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len()))
}

/// The product of the fluxes of a run on two grids, their straight continuations included.
fn product(
    x: &RunFlux,
    y: &RunFlux,
    coupling: &SparseRows<f64>,
    across: [&JointAxis; 2],
    [x_lines, y_lines]: [&[Range<usize>; 2]; 2],
) -> f64 {
    let (z, dims) = along(2, &part(&across[1].modes, &x_lines[1], &y_lines[1]), &x.coordinates, x.dims);
    let (z, dims) = along(1, coupling, &z, dims);
    let (z, _) = along(0, &part(&across[0].modes, &x_lines[0], &y_lines[0]), &z, dims);
    dot(&z, &y.coordinates)
}

/// The term that the obliqueness of rays adds to [`product`].
fn oblique(
    x: &RunFlux,
    y: &RunFlux,
    segments: [&Segment; 2],
    across: [&JointAxis; 2],
    [x_lines, y_lines]: [&[Range<usize>; 2]; 2],
) -> f64 {
    let [Some(leaving), Some(_)] = segments.map(|segment| segment.leaving.as_ref()) else { return 0.0 };
    let [Some(first), Some(second)] = across.map(|axis| axis.squares.as_ref()) else { return 0.0 };
    let [p, q] = [0, 1].map(|k| part(&across[k].modes, &x_lines[k], &y_lines[k]));
    let p2 = part(first, &x_lines[0], &y_lines[0]);
    let q2 = part(second, &x_lines[1], &y_lines[1]);
    let mut out = 0.0;
    for (side, straight) in leaving.sides.iter().zip(&leaving.straight) {
        let [x, y] = [(x, segments[0]), (y, segments[1])]
            .map(|(flux, segment)| (flux.through(&segment.face[*side]), flux.dims));
        for (rows, columns) in [(&p2, &q), (&p, &q2)] {
            let (z, dims) = along(2, columns, &x.0, [x.1[0], 1, x.1[2]]);
            let (z, _) = along(0, rows, &z, dims);
            out += straight * inner(&z, &y.0);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::grid_problem::GridProblem;
    use crate::boxes::layout::Grid;
    use crate::boxes::one_grid::{Lower, Outcome, on_grid};
    use crate::boxes::one_part::SolvedPart;
    use crate::boxes::resolution::graded;
    use crate::boxes::two_states::common;
    use crate::solution::{ResolutionLevel, Settings};
    use crate::vacuum::VACUUM_PERMITTIVITY;
    use elastocap_geometry::meshing::grid::Change;
    use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
    use elastocap_geometry::shapes::Shape;

    const FAR: f64 = 4.0;

    fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
        Shape::Box(Box3 { min, max })
    }

    /// A sheet and a block beside it, without symmetry.
    fn pair() -> Vec<Body> {
        vec![
            Body::conductor("sheet", cuboid([-1.0, 0.0, -0.8], [-0.1, 0.0, 0.9])),
            Body::conductor("block", cuboid([0.2, -0.1, -0.5], [0.9, 0.3, 0.7])),
        ]
    }

    /// The pair in open space with a block of glass between them, so that the permittivity is not a product
    /// of one factor for each axis.
    fn in_open_space() -> Scene {
        let mut bodies = pair();
        bodies.push(Body::dielectric("glass", cuboid([-0.6, 0.1, -0.4], [0.1, 0.5, 0.5]), 5.0));
        Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
    }

    /// The pair on a slab without end, through which rays pass.
    fn on_a_slab() -> Scene {
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut scene = in_open_space();
        let slab = cuboid([low, -0.6, low], [high, -0.2, high]);
        scene.bodies.push(Body::dielectric("slab", slab, 3.0));
        scene
    }

    /// Two sheets in an empty box, one wall of which is grounded.
    fn in_a_box() -> Scene {
        let mut bodies = pair();
        bodies[1] = Body::conductor("other", cuboid([0.2, 0.3, -0.5], [0.9, 0.3, 0.7]));
        let mut walls = [[Wall::Insulated; 2]; 3];
        walls[0][1] = Wall::Grounded;
        let domain = Box3 { min: [-1.5, -0.8, -1.2], max: [1.4, 0.9, 1.6] };
        Scene { bodies, background_permittivity: 2.0, domain, walls }
    }

    fn grid(problem: &GridProblem<'_>, order: usize, levels: usize) -> Grid {
        problem.core.grid(&graded(ResolutionLevel { order, levels }), FAR)
    }

    fn solved(problem: &GridProblem<'_>, grid: &Grid, share: f64) -> Outcome {
        on_grid(problem, grid, share, Lower::OF_GRID, None).unwrap()
    }

    fn only_part(outcome: &Outcome) -> (&SolvedPart, &Fluxes) {
        let part = &outcome.solved[0].1;
        (part, part.fluxes.as_ref().unwrap())
    }

    /// L_ij, F, for state i on one grid and state j on another.
    fn joint(problem: &GridProblem<'_>, (x, i): (&Outcome, usize), (y, j): (&Outcome, usize)) -> f64 {
        let ((one, f), (other, g)) = (only_part(x), only_part(y));
        let domain = common(&one.domain, &other.domain).unwrap();
        VACUUM_PERMITTIVITY * problem.layout.unit * f.joint(i, (g, j), &domain).unwrap().unwrap()
    }

    fn problem_of<'a>(scene: &Scene, settings: &'a Settings) -> GridProblem<'a> {
        let mut problem = GridProblem::new(scene, None, None, settings).unwrap();
        problem.keeps_fluxes = true;
        problem
    }

    #[test]
    fn products_of_fluxes_of_one_grid_are_its_lower_energies() {
        let settings = Settings::default();
        for scene in [on_a_slab(), in_a_box()] {
            let problem = problem_of(&scene, &settings);
            let outcome = solved(&problem, &grid(&problem, 3, 1), 1e-12);
            let lower = &outcome.all_conductors.lower;
            for i in 0..2 {
                for j in 0..2 {
                    let (found, scale) = (joint(&problem, (&outcome, i), (&outcome, j)), lower[(i, i)]);
                    assert!((found - lower[(i, j)]).abs() < 1e-9 * scale, "{i} {j}: {found} {lower:?}");
                }
            }
        }
    }

    #[test]
    fn the_repair_of_a_flux_that_was_hardly_iterated_is_part_of_it() {
        let settings = Settings::default();
        // Where permittivity and walls are those of the repair, its energy is known, else it is
        // overestimated.
        for (scene, is_exact) in [(in_a_box(), true), (in_open_space(), false), (on_a_slab(), false)] {
            let problem = problem_of(&scene, &settings);
            let outcome = solved(&problem, &grid(&problem, 3, 1), 1e-2);
            let (lower, upper) = (&outcome.all_conductors.lower, &outcome.all_conductors.upper);
            assert!(outcome.repair_share > 1e-4, "{}", outcome.repair_share);
            let found = Mat::from_fn(2, 2, |i, j| joint(&problem, (&outcome, i), (&outcome, j)));
            for i in 0..2 {
                let energy = found[(i, i)];
                let [least, most] = [lower[(i, i)] * (1.0 - 1e-9), upper[(i, i)]];
                assert!(energy >= least && energy <= most, "{energy} {lower:?}");
                for j in 0..2 {
                    let off = (found[(i, j)] - lower[(i, j)]).abs();
                    assert!(!is_exact || off < 1e-9 * lower[(i, i)], "{i} {j}: {found:?} {lower:?}");
                }
            }
            // The remaining gap is a positive semidefinite form.
            let missing = Mat::from_fn(2, 2, |i, j| upper[(i, j)] - found[(i, j)]);
            assert!(missing[(0, 1)].powi(2) <= missing[(0, 0)] * missing[(1, 1)], "{missing:?}");
        }
    }

    #[test]
    fn a_flux_of_a_coarse_grid_is_orthogonal_to_what_that_of_a_finer_one_misses() {
        let settings = Settings::default();
        for scene in [on_a_slab(), in_a_box()] {
            let problem = problem_of(&scene, &settings);
            let coarse = grid(&problem, 3, 1);
            let mut fine = coarse.clone();
            for axis in &mut fine.axes {
                let first = axis.line.first_finite();
                axis.change(&[(first, Change::Raise(2)), (first + 2, Change::Split(0.3))]);
            }
            let [coarse, fine] = [coarse, fine].map(|grid| solved(&problem, &grid, 1e-12));
            for i in 0..2 {
                for j in 0..2 {
                    // Among all fluxes of the fine grid, which include those of the coarse one, the solution
                    // has the least energy.
                    let (best, scale) =
                        (fine.all_conductors.lower[(i, j)], fine.all_conductors.lower[(i, i)]);
                    for found in
                        [joint(&problem, (&coarse, i), (&fine, j)), joint(&problem, (&fine, i), (&coarse, j))]
                    {
                        assert!((found - best).abs() < 1e-7 * scale, "{i} {j}: {found} {best}");
                    }
                    if i == j {
                        assert!(coarse.all_conductors.lower[(i, i)] < best - 1e-4 * scale);
                    }
                }
            }
        }
    }

    #[test]
    fn the_mean_of_both_products_on_two_grids_that_are_not_nested_is_as_near_as_their_gaps_say() {
        let settings = Settings::default();
        let scene = in_a_box();
        let problem = problem_of(&scene, &settings);
        let changed = |at: usize| {
            let mut grid = grid(&problem, 3, 1);
            let axis = &mut grid.axes[0];
            axis.change(&[(axis.line.first_finite() + at, Change::Split(0.4))]);
            solved(&problem, &grid, 1e-4)
        };
        let exact = solved(&problem, &grid(&problem, 4, 2), 1e-5).all_conductors;
        let (x, y) = (changed(1), changed(4));
        let [(one, _), (other, _)] = [&x, &y].map(only_part);
        let domain = common(&one.domain, &other.domain).unwrap();
        for (i, j) in [(0, 1), (1, 0), (0, 0), (1, 1)] {
            let potential =
                |outcome: &Outcome, at| outcome.potentials().on(0, &domain).unwrap().potential(at);
            let product = crate::boxes::primal::Primal::without_preconditioner(&domain)
                .unwrap()
                .product_of(&potential(&x, i), &potential(&y, j));
            let upper = VACUUM_PERMITTIVITY * problem.layout.unit * product;
            let lower = joint(&problem, (&x, i), (&y, j));
            let gap = |all: &crate::matrix::MatrixBounds, k| all.upper[(k, k)] - all.lower[(k, k)];
            let half = 0.5 * (gap(&x.all_conductors, i) * gap(&y.all_conductors, j)).sqrt();
            let truth = 0.5 * (exact.upper[(i, j)] + exact.lower[(i, j)]);
            let error = (0.5 * (upper + lower) - truth).abs();
            let uncertainty = 0.5 * (gap(&exact, i) * gap(&exact, j)).sqrt();
            assert!(error <= half + uncertainty, "{i} {j}: {upper} {lower} {truth} +- {half}");
            assert!(uncertainty < 0.5 * half, "{uncertainty} {half}");
        }
    }
}

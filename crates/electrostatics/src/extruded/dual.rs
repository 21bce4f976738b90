//! Thomson's principle: fluxes without divergence, whose energy bounds the capacitance from below.
//!
//! The linear solver leaves a small divergence, and small differences of the normal flux on the two sides of
//! edges. A second flux cancels both exactly: that of the whole scene as if there were no conductors, which
//! the modes of the axis invert. The bound counts its energy; see `boxes/dual/mod.rs` for the proof, which
//! holds word for word with the traces among the potentials.

use super::columns::Column;
use super::fluxes::{self, Cells, Fluxes, ones_along};
use super::free_regions::{FreeRegion, Product, free_regions};
use super::mesh::PlanMesh;
use super::plane_system::{Beyond, PlaneSystem};
use super::rays::met_by_rays;
use super::region::{Inverse, Scaling, Workspace};
use crate::boxes::domain::{Axis, per_element};
use crate::error::SolveError;
use elastocap_fem::mixed::FluxEnd;
use elastocap_fem::modes::{LineModes, dual_modes};
use elastocap_fem::tensor::dot;
use elastocap_geometry::scene::Wall;
use elastocap_linalg::conjugate_gradients::Operator;
use faer::Mat;

/// Energy of the flux beyond the frame in the preconditioner over that of the straight one; the true factor
/// is between 1 and 3. Tuned: the iterations that `benches/outlines.py discs` prints.
const MEAN: f64 = 1.5;

/// Share of a residual that the repair may leave. A pass in single precision usually leaves 1e-5 to 1e-3 of
/// the residual before it; where [`PASSES`] of them leave more than this share, the inverses are recomputed
/// in double precision. Tuned: `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const RESIDUAL_GOAL: f64 = 1e-6;
/// The largest number of passes of the repair in one precision; see [`RESIDUAL_GOAL`]. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const PASSES: usize = 6;

/// The lower problem on one mesh.
#[derive(Debug)]
pub(super) struct Dual {
    cells: Cells,
    fluxes: Fluxes,
    /// The inverses on the regions without conductors, of which the preconditioner is the sum.
    regions: Vec<Inverse>,
    workspace: Workspace,
    repair: Repair,
    /// For each interval the trace on each edge.
    traces: Vec<Vec<Trace>>,
    /// For each interval and triangle the root of the permittivity, zero in conductors.
    roots: Vec<Vec<f64>>,
    /// The functions of the line on each interval.
    ranges: Vec<std::ops::Range<usize>>,
    /// The length of each edge.
    lengths: Vec<f64>,
    /// The constant 1 on the line, times the root of the permittivity of each interval: see [`ones_along`].
    ones: Vec<f64>,
    /// The constant 1 on the line.
    ones_of_line: Vec<f64>,
}

/// The trace of the potential on an edge, in an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trace {
    /// An unknown of the problem.
    Unknown,
    /// The potential of the conductor with this index.
    Held(u32),
    /// Zero, on a grounded wall.
    Zero,
}

/// The inverse for the whole scene without conductors, whose permittivity is a product.
#[derive(Debug)]
struct Repair {
    /// The operator of this scene.
    fluxes: Fluxes,
    /// One inverse for all modes, or one for the lowest mode and one for the others; each with its modes.
    inverses: Vec<(Inverse, LineModes)>,
    /// Whether no flux can leave the scene.
    singular: bool,
    /// Largest ratio of the permittivity of the repair to the true one.
    excess: f64,
    /// Edges whose traces are zero.
    grounded: Vec<usize>,
    /// For each interval and triangle the root of the true permittivity over that of the repair; empty where
    /// they agree.
    ratios: Vec<Vec<f64>>,
}

impl Dual {
    /// Assembles the problem for fluxes of a degree; `radius` is the distance at which rays begin, if there
    /// are any.
    pub(super) fn new(
        mesh: &PlanMesh,
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        degree: usize,
        radius: Option<f64>,
    ) -> Result<Self, SolveError> {
        let cells = Cells::new(mesh, degree)?;
        let product = Product::new(mesh);
        let met = met_by_rays(mesh, axis);
        let beyond = match radius {
            None => fluxes::Beyond::Closed,
            Some(radius) => fluxes::Beyond::Rays { radius, met: &met },
        };
        let fluxes = Fluxes::new(mesh, &mesh.columns, axis, walls, &cells, &product, beyond)?;
        let regions = free_regions(&mesh.columns, &mesh.chains, axis.walls)
            .iter()
            .map(|free| region(mesh, axis, walls, &cells, &product, radius, free))
            .collect::<Result<_, SolveError>>()?;
        let repair = Repair::new(mesh, axis, walls, &cells, &product, radius.map(|r| (r, &met[..])))?;
        let n = axis.intervals();
        let traces = (0..n).map(|m| traces(mesh, walls, m)).collect();
        let root = |t: usize, m: usize| {
            let c = mesh.column_of(t);
            if c.conductor[m].is_some() { 0.0 } else { c.permittivity[m].sqrt() }
        };
        Ok(Self {
            fluxes,
            regions,
            workspace: Workspace::default(),
            repair,
            traces,
            roots: (0..n).map(|m| (0..mesh.triangles.len()).map(|t| root(t, m)).collect()).collect(),
            ranges: (0..n).map(|m| axis.modes(m, m + 1)).collect(),
            lengths: (0..mesh.edges.len()).map(|e| mesh.length(e)).collect(),
            ones: ones_along(axis, &product),
            ones_of_line: elastocap_fem::mixed::ones(&axis.line),
            cells,
        })
    }

    /// The unknowns with the traces on conductors at these potentials, and zero elsewhere.
    fn held(&self, potentials: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.unknowns()];
        let width = self.fluxes.width;
        for (range, traces) in self.ranges.iter().zip(&self.traces) {
            for (e, trace) in traces.iter().enumerate() {
                if let Trace::Held(c) = trace {
                    let v = potentials[*c as usize] * self.lengths[e].sqrt();
                    let row = &mut x[self.cells.numbering.rows[e] as usize * width..][range.clone()];
                    row.iter_mut().zip(&self.ones[range.clone()]).for_each(|(x, one)| *x = v * one);
                }
            }
        }
        x
    }

    /// The right-hand side for given potentials of the conductors.
    pub(super) fn source(&self, potentials: &[f64]) -> Vec<f64> {
        let held = self.held(potentials);
        let mut b = vec![0.0; held.len()];
        self.fluxes.product(&self.cells, &held, &mut b);
        b.iter_mut().for_each(|b| *b = -*b);
        self.fluxes.subtract_sources(&self.cells, potentials, &mut b);
        self.clear_held(&mut b);
        b
    }

    /// Sets the unknowns that conductors and walls hold, and those inside conductors, to zero.
    fn clear_held<T: Copy + Default>(&self, y: &mut [T]) {
        let width = self.fluxes.width;
        for (m, range) in self.ranges.iter().enumerate() {
            for (e, trace) in self.traces[m].iter().enumerate() {
                if *trace != Trace::Unknown {
                    for row in self.cells.numbering.rows[e]..self.cells.numbering.rows[e + 1] {
                        y[row as usize * width..][range.clone()].fill(T::default());
                    }
                }
            }
            for (t, root) in self.roots[m].iter().enumerate() {
                if *root == 0.0 {
                    for row in self.cells.numbering.inner_rows[t]..self.cells.numbering.inner_rows[t + 1] {
                        y[row as usize * width..][range.clone()].fill(T::default());
                    }
                }
            }
        }
    }

    /// Energy products of the fluxes of several solutions, each with the potentials that it belongs to.
    pub(super) fn energies(&self, mesh: &PlanMesh, x: &[&[f64]], potentials: &[Vec<f64>]) -> Mat<f64> {
        let whole: Vec<Vec<f64>> = x
            .iter()
            .zip(potentials)
            .map(|(x, v)| self.held(v).iter().zip(*x).map(|(a, b)| a + b).collect())
            .collect();
        self.fluxes.energies(&self.cells, mesh, &whole, potentials)
    }

    /// r = b - A x.
    pub(super) fn true_residual(&mut self, b: &[f64], x: &[f64], r: &mut [f64]) {
        self.apply(x, r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    }

    /// Where no flux can leave the scene, moves `x` along the constant so that the residual `r` holds no net
    /// charge, which the repair could not cancel.
    pub(super) fn balance(&mut self, x: &mut [f64], r: &mut [f64]) {
        if !self.repair.singular {
            return;
        }
        let constant = self.constant();
        let mut image = vec![0.0; r.len()];
        self.apply(&constant, &mut image);
        let step = dot(&constant, r) / dot(&constant, &image);
        if !step.is_finite() {
            return;
        }
        for ((x, r), (c, a)) in x.iter_mut().zip(r).zip(constant.iter().zip(&image)) {
            *x += step * c;
            *r -= step * a;
        }
    }

    /// The constant potential 1 where the potential is unknown, and zero elsewhere.
    fn constant(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.unknowns()];
        let width = self.fluxes.width;
        for (m, range) in self.ranges.iter().enumerate() {
            for (e, length) in self.lengths.iter().enumerate() {
                let row = &mut x[self.cells.numbering.rows[e] as usize * width..][range.clone()];
                row.iter_mut().zip(&self.ones[range.clone()]).for_each(|(x, one)| *x = length.sqrt() * one);
            }
            for (t, root) in self.roots[m].iter().enumerate() {
                for (k, coefficient) in self.cells.cells[t].one.iter().enumerate() {
                    let row = self.cells.numbering.inner_rows[t] as usize + k;
                    let row = &mut x[row * width..][range.clone()];
                    row.iter_mut()
                        .zip(&self.ones_of_line[range.clone()])
                        .for_each(|(x, one)| *x = -root * coefficient * one);
                }
            }
        }
        self.clear_held(&mut x);
        x
    }

    /// The potential whose flux cancels the residual `r`, and the share of the residual that it does not
    /// cancel.
    pub(super) fn repair(&mut self, r: &[f64]) -> (Vec<f64>, f64) {
        let mut target = r.to_vec();
        self.rescale(&mut target);
        let (mut psi, mut left) = self.repair.cancel(&self.cells, &target, &mut self.workspace);
        if left > RESIDUAL_GOAL && self.repair.in_double(&self.cells) {
            (psi, left) = self.repair.cancel(&self.cells, &target, &mut self.workspace);
        }
        self.rescale(&mut psi);
        (psi, left)
    }

    /// Multiplies values inside triangles by the ratios of the repair: residuals before it, potentials after
    /// it.
    fn rescale(&self, x: &mut [f64]) {
        let width = self.fluxes.width;
        for (range, ratios) in self.ranges.iter().zip(&self.repair.ratios) {
            for (t, ratio) in ratios.iter().enumerate() {
                for row in self.cells.numbering.inner_rows[t]..self.cells.numbering.inner_rows[t + 1] {
                    x[row as usize * width..][range.clone()].iter_mut().for_each(|x| *x *= ratio);
                }
            }
        }
    }

    /// Largest ratio of the repair's energy in the true permittivity to that in the permittivity of the
    /// repair.
    pub(super) fn repair_excess(&self) -> f64 {
        self.repair.excess
    }
}

impl Operator for Dual {
    type Precision = f32;

    fn unknowns(&self) -> usize {
        self.cells.numbering.len() * self.fluxes.width
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.fluxes.product(&self.cells, x, y);
        self.clear_held(y);
    }

    fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.precondition_all(&[r], &mut [z]);
    }

    fn precondition_all(&mut self, r: &[&[f32]], z: &mut [&mut [f32]]) {
        z.iter_mut().for_each(|z| z.fill(0.0));
        for region in &self.regions {
            region.add_solutions(r, z, self.fluxes.width, &mut self.workspace);
        }
        z.iter_mut().for_each(|z| self.clear_held(z));
    }
}

/// The traces on the edges in an interval.
fn traces(mesh: &PlanMesh, walls: &[[Wall; 2]; 2], m: usize) -> Vec<Trace> {
    let mut out: Vec<Trace> = (0..mesh.edges.len())
        .map(|e| if mesh.wall(e, walls) == Some(Wall::Grounded) { Trace::Zero } else { Trace::Unknown })
        .collect();
    for (t, sides) in mesh.sides.iter().enumerate() {
        if let Some(c) = mesh.column_of(t).conductor[m] {
            sides.iter().for_each(|e| out[*e as usize] = Trace::Held(c));
        }
    }
    for (e, chain) in mesh.on_chains() {
        if let Some(c) = mesh.chains[chain as usize].conductor[m] {
            out[e] = Trace::Held(c);
        }
    }
    out
}

/// The inverse on a region without conductors.
fn region(
    mesh: &PlanMesh,
    axis: &Axis,
    walls: &[[Wall; 2]; 2],
    cells: &Cells,
    product: &Product,
    radius: Option<f64>,
    free: &FreeRegion,
) -> Result<Inverse, SolveError> {
    let [lo, hi] = free.cuts;
    let mut ends = axis.flux_ends(lo, hi);
    (0..2).filter(|&side| free.held[side]).for_each(|side| ends[side] = FluxEnd::Free);
    let mut beyond = axis.continuation(lo, hi, [MEAN; 2]);
    (0..2).filter(|&side| free.held[side]).for_each(|side| beyond[side] = 0.0);
    let along = per_element(axis, &product.along);
    let modes = dual_modes(&axis.line, axis.cuts[lo]..axis.cuts[hi], &along, ends, beyond)?;
    let weights: Vec<Option<f64>> = (0..mesh.triangles.len())
        .map(|t| {
            let inside = free.columns[mesh.column[t] as usize];
            inside.then(|| product.across(mesh.column_of(t), free.cuts))
        })
        .collect();
    let mut is_free = free_edges(mesh, walls, &weights);
    for (e, chain) in mesh.on_chains() {
        is_free[e] &= free.chains[chain as usize];
    }
    let beyond = beyond_frame(mesh, walls, cells, radius.map(|r| 1.0 / (MEAN * r)));
    let system = PlaneSystem::new(&cells.numbering, &weights, |e| is_free[e as usize], &beyond);
    let window = axis.modes(lo, hi);
    let scaling = scaling(mesh, axis, cells, product, &weights, free.cuts, &system.rows);
    let mut inverse = Inverse::new(system, &cells.numbering, &cells.locals, window, &modes)
        .ok_or(SolveError::Eigenvalues)?;
    inverse.scale(scaling);
    Ok(inverse)
}

/// The factors between the unknowns of the scene and those of a region's inverse. Values inside triangles are
/// scaled by the root of the permittivity, which is that of the scene for the unknowns of the scene and a
/// product for those of the inverse.
fn scaling(
    mesh: &PlanMesh,
    axis: &Axis,
    cells: &Cells,
    product: &Product,
    weights: &[Option<f64>],
    [lo, hi]: [usize; 2],
    rows: &[u32],
) -> Scaling {
    let ratio = |t: usize, m: usize| match weights[t] {
        Some(weight) => (mesh.column_of(t).permittivity[m] / (weight * product.along[m])).sqrt(),
        None => 1.0,
    };
    let inside = (0..mesh.triangles.len()).filter(|t| weights[*t].is_some());
    if inside.into_iter().all(|t| (lo..hi).all(|m| (ratio(t, m) - 1.0).abs() < 1e-12)) {
        return Scaling::default();
    }
    let first = axis.modes(lo, lo + 1).start;
    let pieces = (lo..hi).map(|m| axis.modes(m, m + 1)).map(|r| r.start - first..r.end - first).collect();
    let inner = &cells.numbering.inner_rows;
    let mut t = 0;
    let mut factors = Vec::with_capacity(rows.len() * (hi - lo));
    for row in rows {
        if *row < inner[0] {
            factors.extend((lo..hi).map(|_| 1.0));
            continue;
        }
        while inner[t + 1] <= *row {
            t += 1;
        }
        factors.extend((lo..hi).map(|m| ratio(t, m)));
    }
    Scaling { pieces, factors }
}

/// For each edge whether its trace is unknown: it is not grounded, and no triangle outside the part of the
/// plan adjoins it.
fn free_edges(mesh: &PlanMesh, walls: &[[Wall; 2]; 2], weights: &[Option<f64>]) -> Vec<bool> {
    let mut free: Vec<bool> =
        (0..mesh.edges.len()).map(|e| mesh.wall(e, walls) != Some(Wall::Grounded)).collect();
    for (sides, weight) in mesh.sides.iter().zip(weights) {
        if weight.is_none() {
            sides.iter().for_each(|e| free[*e as usize] = false);
        }
    }
    free
}

/// The forms of the flux beyond the frame: at each of its open edges the same `conductance` to infinity.
fn beyond_frame(
    mesh: &PlanMesh,
    walls: &[[Wall; 2]; 2],
    cells: &Cells,
    conductance: Option<f64>,
) -> Vec<Beyond> {
    let Some(conductance) = conductance else { return Vec::new() };
    let open = (0..mesh.edges.len()).filter(|&e| mesh.wall(e, walls) == Some(Wall::Open));
    open.map(|e| {
        let n = cells.numbering.size(e as u32);
        let a = (0..n * n).map(|k| if k % (n + 1) == 0 { conductance } else { 0.0 }).collect();
        Beyond { entities: vec![e as u32], a, m: Vec::new() }
    })
    .collect()
}

impl Repair {
    /// Computes the inverses; `rays` has the distance at which rays begin and the permittivities that they
    /// meet.
    fn new(
        mesh: &PlanMesh,
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        cells: &Cells,
        product: &Product,
        rays: Option<(f64, &[[f64; 2]])>,
    ) -> Result<Self, SolveError> {
        let n = axis.intervals();
        let whole = [0, n];
        let across: Vec<f64> = mesh.columns.iter().map(|c| product.across(c, whole)).collect();
        // The scene with a product permittivity and without conductors.
        let columns: Vec<Column> = across
            .iter()
            .map(|a| Column {
                conductor: vec![None; n],
                held: vec![None; n + 1],
                permittivity: product.along.iter().map(|e| a * e).collect(),
            })
            .collect();
        let (mut excess, mut agree) = (1.0_f64, true);
        for (product_column, column) in columns.iter().zip(&mesh.columns) {
            for m in (0..n).filter(|&m| column.conductor[m].is_none()) {
                let ratio = product_column.permittivity[m] / column.permittivity[m];
                excess = excess.max(ratio);
                agree &= (ratio - 1.0).abs() < 1e-14;
            }
        }
        let ratio = |t: usize, m: usize| {
            let (product_column, column) = (&columns[mesh.column[t] as usize], mesh.column_of(t));
            match column.conductor[m] {
                Some(_) => 1.0,
                None => (column.permittivity[m] / product_column.permittivity[m]).sqrt(),
            }
        };
        let ratios = match agree {
            true => Vec::new(),
            false => (0..n).map(|m| (0..mesh.triangles.len()).map(|t| ratio(t, m)).collect()).collect(),
        };
        // All rays count as the most oblique one, through the lowest permittivity.
        let least = |met: &[[f64; 2]]| met.iter().map(|e| e[0]).fold(f64::INFINITY, f64::min);
        let greatest =
            columns.iter().flat_map(|c| &c.permittivity).chain(&product.along).copied().fold(0.0, f64::max);
        let contrast = rays.map_or(1.0, |(_, met)| (greatest / least(met)).max(1.0));
        let worst = match rays {
            None => fluxes::Beyond::Closed,
            Some((radius, _)) => fluxes::Beyond::Worst { radius, contrast },
        };
        let fluxes = Fluxes::new(mesh, &columns, axis, walls, cells, product, worst)?;
        let closed = |walls: &[Wall; 2]| *walls == [Wall::Insulated; 2];
        let singular = walls.iter().all(closed) && closed(&axis.walls);
        let along = per_element(axis, &product.along);
        let beyond = axis.continuation(0, n, [3.0 * contrast; 2]);
        let modes = dual_modes(&axis.line, 0..axis.line.elements(), &along, axis.flux_ends(0, n), beyond)?;
        let weights: Vec<Option<f64>> = mesh.column.iter().map(|c| Some(across[*c as usize])).collect();
        let is_free = free_edges(mesh, walls, &weights);
        let conductance = rays.map(|(radius, _)| 1.0 / (3.0 * contrast * radius));
        let frame = beyond_frame(mesh, walls, cells, conductance);
        let window = axis.modes(0, n);
        let grounded = (0..is_free.len()).filter(|e| !is_free[*e]).collect();
        let inverse_for = |beyond: &[Beyond], modes: LineModes| {
            let system = PlaneSystem::new(&cells.numbering, &weights, |e| is_free[e as usize], beyond);
            let inverse = Inverse::new(system, &cells.numbering, &cells.locals, window.clone(), &modes);
            Ok::<_, SolveError>((inverse.ok_or(SolveError::Eigenvalues)?, modes))
        };
        let inverses = match singular {
            false => vec![inverse_for(&frame, modes)?],
            // The mode that is constant along the axis leaves the potential undetermined up to a constant. A
            // resistor between one edge and ground fixes that constant; no flux passes through it, since
            // there is no net charge.
            true => {
                let (first, rest) = modes.parted();
                let n = cells.numbering.size(0);
                let a = (0..n * n).map(|k| if k == 0 { 1.0 } else { 0.0 }).collect();
                let ground = Beyond { entities: vec![0], a, m: Vec::new() };
                vec![inverse_for(&[ground], first)?, inverse_for(&frame, rest)?]
            }
        };
        Ok(Self { fluxes, inverses, singular, excess, grounded, ratios })
    }

    /// Recomputes the inverses in double precision. Returns whether any was in single precision.
    fn in_double(&mut self, cells: &Cells) -> bool {
        let mut changed = false;
        for (inverse, modes) in &mut self.inverses {
            if let Some(double) = inverse.doubled(&cells.numbering, &cells.locals, modes) {
                *inverse = double;
                changed = true;
            }
        }
        changed
    }

    /// The potential whose flux has the divergence `target`, and the share of the target that is missing.
    fn cancel(&self, cells: &Cells, target: &[f64], workspace: &mut Workspace) -> (Vec<f64>, f64) {
        let size = dot(target, target).sqrt();
        let (mut psi, mut rest, mut left) = (vec![0.0; target.len()], target.to_vec(), 1.0);
        for _ in 0..PASSES {
            self.pass(cells, target, &mut psi, &mut rest, workspace);
            left = if size > 0.0 { dot(&rest, &rest).sqrt() / size } else { 0.0 };
            if left <= RESIDUAL_GOAL {
                break;
            }
        }
        (psi, left)
    }

    /// Adds the solution for the right-hand side `rest` to `psi`, and replaces `rest` by what is then left of
    /// `target`.
    fn pass(
        &self,
        cells: &Cells,
        target: &[f64],
        psi: &mut [f64],
        rest: &mut [f64],
        workspace: &mut Workspace,
    ) {
        let width = self.fluxes.width;
        for (inverse, _) in &self.inverses {
            inverse.add_solutions(&[&*rest], &mut [&mut *psi], width, workspace);
        }
        self.fluxes.product(cells, psi, rest);
        rest.iter_mut().zip(target).for_each(|(r, t)| *r = t - *r);
        self.clear_grounded(cells, rest);
    }

    /// Sets the traces on grounded edges to zero.
    fn clear_grounded(&self, cells: &Cells, values: &mut [f64]) {
        let width = self.fluxes.width;
        for e in &self.grounded {
            let rows = cells.numbering.rows[*e] as usize..cells.numbering.rows[*e + 1] as usize;
            values[rows.start * width..rows.end * width].fill(0.0);
        }
    }
}

/// A split of modes into the lowest one and the others.
trait Parted: Sized {
    /// The lowest mode, and the others.
    fn parted(self) -> (Self, Self);
}

impl Parted for LineModes {
    fn parted(self) -> (Self, Self) {
        let columns = |from: usize, to: usize| self.vectors.as_ref().subcols(from, to - from).to_owned();
        let n = self.values.len();
        let first = Self { vectors: columns(0, 1), values: self.values[..1].to_vec() };
        (first, Self { vectors: columns(1, n), values: self.values[1..].to_vec() })
    }
}

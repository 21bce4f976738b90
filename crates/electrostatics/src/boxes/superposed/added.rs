//! The solution that is added to a base on a coarse grid.

use super::base::{Base, BasePart};
use super::grids::{bent_block, interpolation, only, permittivity_of};
use super::products::{Joint, Space};
use super::sight::Sight;
use super::squares::{squared_sum, twice_the_product};
use crate::boxes::domain::{Block, Domain};
use crate::boxes::dual::aim::Less;
use crate::boxes::dual::mapped::Solved;
use crate::boxes::dual::superposed::distances;
use crate::boxes::energies::Energies;
use crate::boxes::energy::Drive;
use crate::boxes::half_turn::images::Image;
use crate::boxes::mapped::gradients::FINER;
use crate::boxes::mapped::metric::{Metric, TensorKind};
use crate::boxes::primal::Primal;
use crate::boxes::symmetry::Part;
use crate::error::SolveError;
use elastocap_fem::tensor::{Window, along, dot};
use faer::{Mat, Scale};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Upper limit of the largest eigenvalue of eps K^-1 for adding a solution to a base. Where a gap is squeezed
/// further, as between an indenter and the layer it touches, the error of the base in the gap costs more than
/// the base saves. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const MOST_SQUEEZED: f64 = 60.0;

/// [`MOST_SQUEEZED`] for a dielectric body. At the edges of a box that a map makes round the eigenvalue is
/// always large, but the flux of the base is smooth there. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const MOST_SQUEEZED_INSIDE: f64 = 1e4;

/// Rounding error of a square of z in a body, relative to the square of u0 there: the sums have millions of
/// terms that cancel.
const ROUNDING: f64 = 1e-12;

/// The solution on a coarse grid that is added to one symmetric part of a base. The symbols are those of
/// [`crate::boxes::superposed`].
pub(crate) struct Added<'a> {
    /// That part of the base.
    pub(super) base: &'a BasePart,
    /// The potential of the base that belongs to each right-hand side; `None` where all electrodes are at
    /// zero.
    pub(super) base_index: Vec<Option<usize>>,
    /// The block B.
    pub(super) block: Block,
    /// The interpolated potential p of the base, for each right-hand side.
    pub(crate) interpolated: Vec<Vec<f64>>,
    /// Potentials that y has on all blocks of conductors: those of the body, and zero on the electrodes.
    pub(crate) potentials: Vec<Vec<f64>>,
    /// The grid with the permittivities without the body: set where the body is a dielectric.
    pub(super) without: Option<WithoutBody>,
}

/// A coarse grid with the permittivities of the base.
pub(super) struct WithoutBody {
    /// The domain of the grid, without a map.
    pub(super) domain: Domain,
    /// The primal problem on it.
    primal: Primal,
    /// The products of the operator with p, for each right-hand side.
    products: Vec<Vec<f64>>,
    /// Largest ratio of the base's permittivity to that of the scene.
    largest: f64,
    /// A block that holds all cells in which the permittivities differ.
    body: Block,
}

impl WithoutBody {
    /// `None` where base and scene have the same permittivities. They may differ inside `block` only.
    fn new(
        base: &Domain,
        coarse: &Domain,
        block: &Block,
        interpolated: &[Vec<f64>],
    ) -> Result<Option<Self>, SolveError> {
        let permittivity = permittivity_of(base, coarse).ok_or(SolveError::Superposition)?;
        let cells = coarse.cells();
        let mut largest = 1.0_f64;
        let mut body = Block { lo: cells, hi: [0; 3] };
        for (n, (eps, eps_with_body)) in permittivity.iter().zip(&coarse.permittivity).enumerate() {
            let cell = [n / (cells[1] * cells[2]), n / cells[2] % cells[1], n % cells[2]];
            if eps == eps_with_body {
                continue;
            }
            if (0..3).any(|a| cell[a] < block.lo[a] || block.hi[a] <= cell[a]) {
                return Err(SolveError::Superposition);
            }
            largest = largest.max(eps / eps_with_body);
            for a in 0..3 {
                (body.lo[a], body.hi[a]) = (body.lo[a].min(cell[a]), body.hi[a].max(cell[a] + 1));
            }
        }
        if permittivity == coarse.permittivity {
            return Ok(None);
        }
        let domain = Domain { permittivity, map: None, ..coarse.clone() };
        let mut primal = Primal::without_preconditioner(&domain)?;
        let products = interpolated.iter().map(|p| primal.straight_product(p)).collect();
        Ok(Some(Self { domain, primal, products, largest, body }))
    }
}

impl<'a> Added<'a> {
    /// What is added to a base for a part of a scene, on its coarse grid. `held` are the conductors that the
    /// blocks of the domain belong to; those of the base come first.
    ///
    /// # Errors
    /// [`SolveError::Superposition`] where the base does not have this part, or where an electrode lies in
    /// the region that the map bends; a grid whose matrices cannot be made.
    pub(crate) fn new(
        base: &'a Base,
        part: &Part,
        domain: &Domain,
        held: &[usize],
    ) -> Result<Self, SolveError> {
        let mut out = Self::of_conductors(base, part, domain, held).ok_or(SolveError::Superposition)?;
        out.without = WithoutBody::new(&out.base.domain, domain, &out.block, &out.interpolated)?;
        Ok(out)
    }

    /// [`Added::new`] without the permittivities of the base; `None` where the base does not have this part,
    /// or where an electrode lies in the region that the map bends.
    fn of_conductors(base: &'a Base, part: &Part, domain: &Domain, held: &[usize]) -> Option<Self> {
        let count = base.conductors;
        let (base_part, base_index) = base.part_of(part)?;
        let block = bent_block(domain)?;
        let is_apart = |conductor: &Block| {
            (0..3).any(|a| conductor.hi[a] < block.lo[a] || block.hi[a] < conductor.lo[a])
        };
        let is_inside = |conductor: &Block| {
            (0..3).all(|a| block.lo[a] <= conductor.lo[a] && conductor.hi[a] <= block.hi[a])
        };
        let fits = (domain.conductors.iter().zip(held))
            .all(|(block, &c)| if c < count { is_apart(block) } else { is_inside(block) });
        if !fits {
            return None;
        }
        let to = interpolation(&base_part.domain, domain, &block)?;
        let dims = domain.primal_dims();
        let window = closed(domain, &block);
        let interpolated = |k: &Option<usize>| {
            let Some(k) = k else { return vec![0.0; dims.iter().product()] };
            let (mut out, mut now) = (base_part.coefficients[*k].clone(), base_part.domain.primal_dims());
            for (a, matrix) in to.iter().enumerate() {
                (out, now) = along(a, matrix, &out, now);
            }
            only(&mut out, dims, &window);
            out
        };
        let interpolated = base_index.iter().map(interpolated).collect();
        let on_body = |v: &Vec<f64>| held.iter().map(|&c| if c < count { 0.0 } else { v[c] }).collect();
        let potentials = part.potentials.iter().map(on_body).collect();
        Some(Self { base: base_part, base_index, block, interpolated, potentials, without: None })
    }

    /// The source by which the base, whose energies are given, drives y.
    pub(crate) fn drive<'d>(&'d self, energies: &'d [f64]) -> Drive<'d> {
        let products = self.without.as_ref().map(|without| without.products.as_slice());
        Drive { pull: &self.interpolated, products, energies }
    }

    /// The limit of [`MOST_SQUEEZED`] for this body.
    pub(crate) fn most_squeezed(&self) -> f64 {
        if self.without.is_some() { MOST_SQUEEZED_INSIDE } else { MOST_SQUEEZED }
    }

    /// A form of the base, in terms of the right-hand sides.
    fn of_base(&self, form: &Mat<f64>) -> Mat<f64> {
        let n = self.base_index.len();
        Mat::from_fn(n, n, |i, j| match (self.base_index[i], self.base_index[j]) {
            (Some(i), Some(j)) => form[(i, j)],
            _ => 0.0,
        })
    }

    /// The gap between the upper and lower energies of the base, and the upper energies, as forms.
    pub(crate) fn base_forms(&self) -> [Mat<f64>; 2] {
        [self.of_base(&self.base.gap()), self.of_base(&self.base.upper)]
    }

    /// Whether the base is odd across a mirror plane.
    pub(crate) fn is_odd(&self) -> bool {
        self.base.is_odd()
    }

    /// Energies of the base, for each right-hand side.
    pub(crate) fn base_energies(&self) -> Vec<f64> {
        self.base_index.iter().map(|k| k.map_or(0.0, |k| self.base.upper[(k, k)])).collect()
    }

    /// Approximate energies of u, from those of y under the map: u0 is taken for the exact potential of the
    /// base.
    pub(crate) fn approximate_energies(
        &self,
        energies: &Mat<f64>,
        y: &[Vec<f64>],
        primal: &mut Primal,
    ) -> Mat<f64> {
        let pulled = match &self.without {
            Some(without) => without.products.clone(),
            None => self.interpolated.iter().map(|p| primal.straight_product(p)).collect(),
        };
        let product = |x: &[f64], k: usize| dot(x, &pulled[k]);
        let base = self.of_base(&self.base.upper);
        let n = y.len();
        Mat::from_fn(n, n, |i, j| {
            base[(i, j)] + energies[(i, j)] - product(&y[i], j) - product(&y[j], i)
                + 0.5 * (product(&self.interpolated[i], j) + product(&self.interpolated[j], i))
        })
    }

    /// The potentials of the base, for those right-hand sides that have one.
    fn base_potentials(&self) -> Vec<&[f64]> {
        self.base_index.iter().flatten().map(|k| self.base.coefficients[*k].as_slice()).collect()
    }

    /// Expands a matrix whose rows or columns (`is_base`) belong to [`Added::base_potentials`] to one whose
    /// rows and columns belong to all right-hand sides; the new entries are zero.
    fn expanded(&self, m: &Mat<f64>, is_base: [bool; 2]) -> Mat<f64> {
        let place = |k: usize, is_base: bool| match (is_base, self.base_index[k]) {
            (true, None) => None,
            (true, Some(_)) => Some(self.base_index[..k].iter().flatten().count()),
            (false, _) => Some(k),
        };
        let n = self.base_index.len();
        Mat::from_fn(n, n, |i, j| match (place(i, is_base[0]), place(j, is_base[1])) {
            (Some(i), Some(j)) => m[(i, j)],
            _ => 0.0,
        })
    }

    /// The squares of z, which is u0 - p restricted to the functions that do not vanish on the block, and
    /// those of u0 restricted in the same way.
    fn missed(&self, joint: &Joint) -> [Mat<f64>; 2] {
        let base_potentials = self.base_potentials();
        let interpolated: Vec<&[f64]> = self.interpolated.iter().map(Vec::as_slice).collect();
        let (on_block, interpolated) = (
            (Space::BaseOnBlock, base_potentials.as_slice()),
            (Space::CoarseOnBlock, interpolated.as_slice()),
        );
        let whole = self.expanded(&joint.products(on_block, on_block), [true, true]);
        let mixed = double(self.expanded(&joint.products(on_block, interpolated), [true, false]));
        [&whole - mixed + joint.products(interpolated, interpolated), whole]
    }

    /// An upper bound on the square of eps grad z in the norm of K^-1, from the square in the norm of
    /// 1 / eps. `largest` is that of eps K^-1.
    ///
    /// At the edges of a body that a map makes round, K^-1 is large and z almost zero: the part inside the
    /// body has a bound of its own.
    fn missed_under_map(
        &self,
        domain: &Domain,
        missed: &Mat<f64>,
        largest: f64,
    ) -> Result<Mat<f64>, SolveError> {
        let Some(without) = &self.without else { return Ok(missed * Scale(largest)) };
        let joint = Joint::within(&self.base.domain, &without.domain, &self.block, &without.body);
        let [mut in_body, whole] = self.missed(&joint.ok_or(SolveError::Superposition)?);
        for i in 0..in_body.nrows() {
            in_body[(i, i)] = in_body[(i, i)].max(0.0) + ROUNDING * whole[(i, i)];
        }
        let whole = domain.truncated();
        let metric = Metric::new(&whole, FINER, TensorKind::Resistance)?;
        let outside = metric.map_or(1.0, |metric| metric.largest_outside(&whole, &without.body));
        Ok((missed - &in_body) * Scale(outside) + in_body * Scale(largest))
    }

    /// The energies of u without the part that map and body add, and the squares of z.
    fn straight(&self, domain: &Domain, y: &[Vec<f64>], primal: &Primal) -> Option<[Mat<f64>; 2]> {
        let (domain, primal) = self.as_in_base(domain, primal);
        let joint = Joint::new(&self.base.domain, domain, &self.block)?;
        let n = y.len();
        let of_base: Vec<&[f64]> =
            self.base_index.iter().map(|k| k.map_or(&[][..], |k| &self.base.coefficients[k])).collect();
        let base_potentials = self.base_potentials();
        let difference: Vec<Vec<f64>> = (y.iter().zip(&self.interpolated))
            .map(|(y, p)| y.iter().zip(p).map(|(y, p)| y - p).collect())
            .collect();
        let coarse: Vec<&[f64]> = difference.iter().map(Vec::as_slice).collect();
        let interpolated: Vec<&[f64]> = self.interpolated.iter().map(Vec::as_slice).collect();
        let expanded = |m: Mat<f64>, rows: bool, columns: bool| self.expanded(&m, [rows, columns]);
        let (base, on_block) =
            ((Space::Base, base_potentials.as_slice()), (Space::BaseOnBlock, base_potentials.as_slice()));
        let (coarse, interpolated) =
            ((Space::Coarse, coarse.as_slice()), (Space::CoarseOnBlock, interpolated.as_slice()));
        let [missed, _] = self.missed(&joint);
        let mut out = self.of_base(&self.base.upper);
        out += double(expanded(joint.products(base, coarse), true, false));
        out += primal.straight_energies(&difference);
        out -= double(expanded(joint.products(base, on_block), true, true));
        out += double(expanded(joint.products(base, interpolated), true, false));
        out -= double(expanded(joint.products(on_block, coarse), true, false));
        out += double(joint.products(interpolated, coarse));
        out += &missed;
        // Beyond the last nodes z is zero. There, only the products of base and difference are still missing.
        let beyond = |base: bool, coarse: bool| {
            let none = vec![0.0; difference.first().map_or(0, Vec::len)];
            let base: Vec<Option<&[f64]>> =
                (0..n).map(|k| Some(of_base[k]).filter(|u| base && !u.is_empty())).collect();
            let coarse: Vec<&[f64]> =
                difference.iter().map(|v| if coarse { v.as_slice() } else { &none }).collect();
            joint.beyond(&base, &coarse)
        };
        out += beyond(true, true) - beyond(true, false) - beyond(false, true);
        Some([out, missed])
    }

    /// The grid and its primal problem with the permittivities of the base.
    fn as_in_base<'d>(&'d self, domain: &'d Domain, primal: &'d Primal) -> (&'d Domain, &'d Primal) {
        self.without.as_ref().map_or((domain, primal), |without| (&without.domain, &without.primal))
    }

    /// Upper energies of u, from the `energies` of y under the map, and the squares of z.
    ///
    /// # Errors
    /// Grids without a common refinement.
    pub(crate) fn upper(
        &self,
        domain: &Domain,
        energies: &Mat<f64>,
        y: &[Vec<f64>],
        primal: &Primal,
    ) -> Result<[Mat<f64>; 2], SolveError> {
        let [straight, missed] = self.straight(domain, y, primal).ok_or(SolveError::Superposition)?;
        let mut out = straight + energies - self.as_in_base(domain, primal).1.straight_energies(y);
        for i in 0..out.nrows() {
            // Covers the rounding of the sums.
            out[(i, i)] *= 1.0 + 256.0 * f64::EPSILON;
        }
        Ok([out, missed])
    }

    /// Lower energies, from the `upper` ones and the squares of z (`missed`).
    ///
    /// # Errors
    /// As for [`Added::upper`]; a request to stop.
    pub(crate) fn lower(
        &self,
        domain: &Domain,
        [upper, missed]: [&Mat<f64>; 2],
        (energies, y): (&Mat<f64>, &[Vec<f64>]),
        (images, primal): (&[Option<Image>], &Primal),
        sight: Option<&Sight>,
        share: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Energies, SolveError> {
        let permittivity =
            self.without.as_ref().map_or(&domain.permittivity, |without| &without.domain.permittivity);
        let less = Less { potentials: &self.interpolated, permittivity };
        let solved = Solved { coefficients: y, less: Some(less), energies, images, bent: primal.bent() };
        let distances_found =
            distances(domain, &self.potentials, &solved, &less, &self.block, share, cancel)?;
        // In terms of eps K^-1 with the permittivity of the base.
        let largest = distances_found.largest * self.without.as_ref().map_or(1.0, |without| without.largest);
        let begin = Instant::now();
        let n = y.len();
        let known = self.of_base(&self.base.gap());
        let [on_block, more] = self.under_map(domain, &known, largest)?;
        let missed = self.missed_under_map(domain, missed, largest)?;
        let added_errors = [&distances_found.apart, &distances_found.repair, &missed];
        let lowered_by = |by: &Mat<f64>| {
            let mut matrix = upper - by;
            for i in 0..n {
                matrix[(i, i)] -= 256.0 * f64::EPSILON * upper[(i, i)];
            }
            matrix
        };
        let lost = squared_sum([&(&known + &more)].into_iter().chain(added_errors));
        let mut matrix = lowered_by(&lost);
        let is_finite = |m: &Mat<f64>| (0..n).all(|i| (0..n).all(|j| m[(i, j)].is_finite()));
        let proved = distances_found.proved && is_finite(&lost);
        let with_error_of_base = match sight {
            Some(sight) if proved => {
                let in_ball = self.errors_around(domain, sight)?;
                let seen = squared_sum([&(&known * Scale(sight.share(self.base.is_odd()))), &in_ball]);
                let apart = squared_sum([&on_block, &(&on_block + &more)].into_iter().chain(added_errors));
                let product = twice_the_product(&known, &apart);
                Some([lowered_by(&(&product + &apart)), upper + seen + product])
            }
            _ => None,
        };
        if !proved {
            matrix = Mat::zeros(n, n);
        }
        let [setup, solve] = distances_found.seconds;
        Ok(Energies {
            matrix,
            unknowns: distances_found.unknowns,
            iterations: distances_found.iterations,
            converged: distances_found.converged,
            repair_share: 0.0,
            coefficients: Vec::new(),
            with_error_of_base,
            seconds: [setup, solve + begin.elapsed().as_secs_f64()],
        })
    }
}

/// The sum of a form and its transpose.
fn double(m: Mat<f64>) -> Mat<f64> {
    &m + m.transpose()
}

/// The functions of a domain that do not vanish on a block.
fn closed(domain: &Domain, block: &Block) -> Window {
    [0, 1, 2].map(|a| domain.axes[a].closed(block.lo[a], block.hi[a]))
}

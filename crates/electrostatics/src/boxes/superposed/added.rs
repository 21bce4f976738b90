//! The solution that is added to a base on a coarse grid.

use super::base::{Base, BasePart};
use super::grids::{bent_block, interpolation, only, permittivity_of};
use super::products::{As, Joint};
use super::sight::Sight;
use super::squares::{squared_sum, twice_the_product};
use crate::boxes::domain::{Block, Domain};
use crate::boxes::dual::aim::Less;
use crate::boxes::dual::mapped::Solved;
use crate::boxes::dual::superposed::distances;
use crate::boxes::energy::{Drive, Energies};
use crate::boxes::half_turn::images::Image;
use crate::boxes::mapped::gradients::FINER;
use crate::boxes::mapped::metric::{Metric, Of};
use crate::boxes::primal::Primal;
use crate::boxes::symmetry::Part;
use crate::error::SolveError;
use elastocap_fem::tensor::{Window, along, dot};
use faer::{Mat, Scale};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// The largest of eps K^-1 under which a solution is added to a base: where a gap is squeezed more, as between an indenter and the layer
/// that it touches, what the base has in there costs more than is gained.
const MOST_SQUEEZED: f64 = 60.0;

/// The largest of eps K^-1 in a dielectric body under which a solution is added to a base. At the edges of a box that a map makes round it
/// is always large, but the flux of the base is smooth there.
const MOST_SQUEEZED_INSIDE: f64 = 1e4;

/// The rounding of a square of z in a body, over that of u0 there: sums of millions of terms that cancel.
const ROUNDING: f64 = 1e-12;

/// The base of one part of a scene, on a coarse grid.
pub(crate) struct Added<'a> {
    pub(super) base: &'a BasePart,
    /// Which potential of the base belongs to each right-hand side; none where all electrodes are at zero.
    pub(super) of: Vec<Option<usize>>,
    /// B.
    pub(super) block: Block,
    /// p, for each right-hand side.
    pub(crate) cut: Vec<Vec<f64>>,
    /// Potentials of all blocks of conductors that y has: those of the body, and zero on the electrodes.
    pub(crate) potentials: Vec<Vec<f64>>,
    /// Set where the body is a dielectric.
    pub(super) without: Option<WithoutBody>,
}

/// A coarse grid with the permittivities of the base.
pub(super) struct WithoutBody {
    pub(super) domain: Domain,
    primal: Primal,
    /// The products of p, for each right-hand side.
    products: Vec<Vec<f64>>,
    /// The largest of the permittivities over those of the scene itself.
    largest: f64,
    /// Holds all cells in which they differ.
    body: Block,
}

impl WithoutBody {
    /// `None` where the permittivities are the same. They may differ in the block alone.
    fn new(base: &Domain, own: &Domain, block: &Block, cut: &[Vec<f64>]) -> Result<Option<Self>, SolveError> {
        let permittivity = permittivity_of(base, own).ok_or(SolveError::Superposition)?;
        let cells = own.cells();
        let mut largest = 1.0_f64;
        let mut body = Block { lo: cells, hi: [0; 3] };
        for (n, (eps, with)) in permittivity.iter().zip(&own.permittivity).enumerate() {
            let at = [n / (cells[1] * cells[2]), n / cells[2] % cells[1], n % cells[2]];
            if eps == with {
                continue;
            }
            if (0..3).any(|a| at[a] < block.lo[a] || block.hi[a] <= at[a]) {
                return Err(SolveError::Superposition);
            }
            largest = largest.max(eps / with);
            for a in 0..3 {
                (body.lo[a], body.hi[a]) = (body.lo[a].min(at[a]), body.hi[a].max(at[a] + 1));
            }
        }
        if permittivity == own.permittivity {
            return Ok(None);
        }
        let domain = Domain { permittivity, map: None, ..own.clone() };
        let mut primal = Primal::without_preconditioner(&domain)?;
        let products = cut.iter().map(|p| primal.straight_product(p)).collect();
        Ok(Some(Self { domain, primal, products, largest, body }))
    }
}

impl<'a> Added<'a> {
    /// `held` are the conductors that the blocks of the domain belong to; those of the base are the first.
    ///
    /// # Errors
    /// [`SolveError::Superposition`] where the base is not that of this part, or where an electrode lies in what the map bends; a grid whose
    /// matrices cannot be made.
    pub(crate) fn new(
        base: &'a Base,
        part: &Part,
        domain: &Domain,
        held: &[usize],
    ) -> Result<Self, SolveError> {
        let mut out = Self::of_conductors(base, part, domain, held).ok_or(SolveError::Superposition)?;
        out.without = WithoutBody::new(&out.base.domain, domain, &out.block, &out.cut)?;
        Ok(out)
    }

    fn of_conductors(base: &'a Base, part: &Part, domain: &Domain, held: &[usize]) -> Option<Self> {
        let count = base.conductors;
        let (own, of) = base.part_of(part)?;
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
        let to = interpolation(&own.domain, domain, &block)?;
        let dims = domain.primal_dims();
        let window = closed(domain, &block);
        let cut = |k: &Option<usize>| {
            let Some(k) = k else { return vec![0.0; dims.iter().product()] };
            let (mut out, mut now) = (own.coefficients[*k].clone(), own.domain.primal_dims());
            for (a, matrix) in to.iter().enumerate() {
                (out, now) = along(a, matrix, &out, now);
            }
            only(&mut out, dims, &window);
            out
        };
        let cut = of.iter().map(cut).collect();
        let on_body = |v: &Vec<f64>| held.iter().map(|&c| if c < count { 0.0 } else { v[c] }).collect();
        let potentials = part.potentials.iter().map(on_body).collect();
        Some(Self { base: own, of, block, cut, potentials, without: None })
    }

    /// The source by which the base drives y. The energies of the base are given.
    pub(crate) fn drive<'d>(&'d self, energies: &'d [f64]) -> Drive<'d> {
        let products = self.without.as_ref().map(|own| own.products.as_slice());
        Drive { pull: &self.cut, products, energies }
    }

    /// The largest of eps K^-1 under which it pays to add to a base.
    pub(crate) fn most_squeezed(&self) -> f64 {
        if self.without.is_some() { MOST_SQUEEZED_INSIDE } else { MOST_SQUEEZED }
    }

    /// A form of the base in the right-hand sides.
    fn of_base(&self, form: &Mat<f64>) -> Mat<f64> {
        let n = self.of.len();
        Mat::from_fn(n, n, |i, j| match (self.of[i], self.of[j]) {
            (Some(i), Some(j)) => form[(i, j)],
            _ => 0.0,
        })
    }

    /// By how much the energies of the base are known, and these.
    pub(crate) fn base_forms(&self) -> [Mat<f64>; 2] {
        [self.of_base(&self.base.gap()), self.of_base(&self.base.upper)]
    }

    /// Whether the base is odd across a mirror plane.
    pub(crate) fn is_odd(&self) -> bool {
        self.base.is_odd()
    }

    /// Energies of the base, for each right-hand side.
    pub(crate) fn base_energies(&self) -> Vec<f64> {
        self.of.iter().map(|k| k.map_or(0.0, |k| self.base.upper[(k, k)])).collect()
    }

    /// About the energies of u, from those of y under the map: as if u0 were the true potential of the base.
    pub(crate) fn about(&self, own: &Mat<f64>, y: &[Vec<f64>], primal: &mut Primal) -> Mat<f64> {
        let pulled = match &self.without {
            Some(own) => own.products.clone(),
            None => self.cut.iter().map(|p| primal.straight_product(p)).collect(),
        };
        let of = |x: &[f64], k: usize| dot(x, &pulled[k]);
        let base = self.of_base(&self.base.upper);
        let n = y.len();
        Mat::from_fn(n, n, |i, j| {
            base[(i, j)] + own[(i, j)] - of(&y[i], j) - of(&y[j], i)
                + 0.5 * (of(&self.cut[i], j) + of(&self.cut[j], i))
        })
    }

    /// The potentials of the base, for those right-hand sides that have one.
    fn solved(&self) -> Vec<&[f64]> {
        self.of.iter().flatten().map(|k| self.base.coefficients[*k].as_slice()).collect()
    }

    /// Rows or columns of those right-hand sides that have a base, among all.
    fn spread(&self, m: &Mat<f64>, is_base: [bool; 2]) -> Mat<f64> {
        let place = |k: usize, is_base: bool| match (is_base, self.of[k]) {
            (true, None) => None,
            (true, Some(_)) => Some(self.of[..k].iter().flatten().count()),
            (false, _) => Some(k),
        };
        let n = self.of.len();
        Mat::from_fn(n, n, |i, j| match (place(i, is_base[0]), place(j, is_base[1])) {
            (Some(i), Some(j)) => m[(i, j)],
            _ => 0.0,
        })
    }

    /// The squares of z, which is u0 on the block less p on the block, and those of u0 on the block.
    fn missed(&self, joint: &Joint) -> [Mat<f64>; 2] {
        let some = self.solved();
        let cut: Vec<&[f64]> = self.cut.iter().map(Vec::as_slice).collect();
        let (on_block, cut) = ((As::BaseOnBlock, some.as_slice()), (As::OwnOnBlock, cut.as_slice()));
        let whole = self.spread(&joint.products(on_block, on_block), [true, true]);
        let mixed = double(self.spread(&joint.products(on_block, cut), [true, false]));
        [&whole - mixed + joint.products(cut, cut), whole]
    }

    /// No less than the square of eps grad z in the norm of K^-1, from that in the norm of 1 / eps. The largest of eps K^-1 is given.
    ///
    /// In a body that a map makes round K^-1 is large at the edges, where z is next to nothing: so it is looked at by itself.
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
        let metric = Metric::new(&whole, FINER, Of::Resistance)?;
        let outside = metric.map_or(1.0, |metric| metric.largest_outside(&whole, &without.body));
        Ok((missed - &in_body) * Scale(outside) + in_body * Scale(largest))
    }

    /// The energies of u without the part that map and body add, and the squares of z.
    fn straight(&self, domain: &Domain, y: &[Vec<f64>], primal: &Primal) -> Option<[Mat<f64>; 2]> {
        let (domain, primal) = self.as_in_base(domain, primal);
        let joint = Joint::new(&self.base.domain, domain, &self.block)?;
        let n = y.len();
        let of_base: Vec<&[f64]> =
            self.of.iter().map(|k| k.map_or(&[][..], |k| &self.base.coefficients[k])).collect();
        let some = self.solved();
        let difference: Vec<Vec<f64>> =
            (y.iter().zip(&self.cut)).map(|(y, p)| y.iter().zip(p).map(|(y, p)| y - p).collect()).collect();
        let own: Vec<&[f64]> = difference.iter().map(Vec::as_slice).collect();
        let cut: Vec<&[f64]> = self.cut.iter().map(Vec::as_slice).collect();
        let spread = |m: Mat<f64>, rows: bool, columns: bool| self.spread(&m, [rows, columns]);
        let (base, on_block) = ((As::Base, some.as_slice()), (As::BaseOnBlock, some.as_slice()));
        let (own, cut) = ((As::Own, own.as_slice()), (As::OwnOnBlock, cut.as_slice()));
        let [missed, _] = self.missed(&joint);
        let mut out = self.of_base(&self.base.upper);
        out += double(spread(joint.products(base, own), true, false));
        out += primal.straight_energies(&difference);
        out -= double(spread(joint.products(base, on_block), true, true));
        out += double(spread(joint.products(base, cut), true, false));
        out -= double(spread(joint.products(on_block, own), true, false));
        out += double(joint.products(cut, own));
        out += &missed;
        // Beyond the last nodes z is nothing, and the rest was counted but for the products of base and difference.
        let beyond = |base: bool, own: bool| {
            let none = vec![0.0; difference.first().map_or(0, Vec::len)];
            let base: Vec<Option<&[f64]>> =
                (0..n).map(|k| Some(of_base[k]).filter(|u| base && !u.is_empty())).collect();
            let own: Vec<&[f64]> =
                difference.iter().map(|v| if own { v.as_slice() } else { &none }).collect();
            joint.beyond(&base, &own)
        };
        out += beyond(true, true) - beyond(true, false) - beyond(false, true);
        Some([out, missed])
    }

    /// A grid, and its problem, with the permittivities of the base.
    fn as_in_base<'d>(&'d self, domain: &'d Domain, primal: &'d Primal) -> (&'d Domain, &'d Primal) {
        self.without.as_ref().map_or((domain, primal), |own| (&own.domain, &own.primal))
    }

    /// Upper energies, from those of y under the map and without it, and the squares of z.
    ///
    /// # Errors
    /// Grids without a common refinement.
    pub(crate) fn upper(
        &self,
        domain: &Domain,
        own: &Mat<f64>,
        y: &[Vec<f64>],
        primal: &Primal,
    ) -> Result<[Mat<f64>; 2], SolveError> {
        let [straight, missed] = self.straight(domain, y, primal).ok_or(SolveError::Superposition)?;
        let mut out = straight + own - self.as_in_base(domain, primal).1.straight_energies(y);
        for i in 0..out.nrows() {
            // Covers the rounding of the sums.
            out[(i, i)] *= 1.0 + 256.0 * f64::EPSILON;
        }
        Ok([out, missed])
    }

    /// Lower energies, from the upper ones.
    ///
    /// # Errors
    /// As for [`Added::upper`]; a request to stop.
    pub(crate) fn lower(
        &self,
        domain: &Domain,
        [upper, missed]: [&Mat<f64>; 2],
        (own, y): (&Mat<f64>, &[Vec<f64>]),
        (images, primal): (&[Option<Image>], &Primal),
        sight: Option<&Sight>,
        share: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Energies, SolveError> {
        let permittivity = self.without.as_ref().map_or(&domain.permittivity, |own| &own.domain.permittivity);
        let less = Less { potentials: &self.cut, permittivity };
        let solved = Solved { coefficients: y, less: Some(less), energies: own, images, bent: primal.bent() };
        let found = distances(domain, &self.potentials, &solved, &less, &self.block, share, cancel)?;
        // Of eps K^-1 with the permittivity of the base.
        let largest = found.largest * self.without.as_ref().map_or(1.0, |own| own.largest);
        let begin = Instant::now();
        let n = y.len();
        let known = self.of_base(&self.base.gap());
        let [on_block, more] = self.under_map(domain, &known, largest)?;
        let missed = self.missed_under_map(domain, missed, largest)?;
        let own = [&found.apart, &found.repair, &missed];
        let below = |by: &Mat<f64>| {
            let mut matrix = upper - by;
            for i in 0..n {
                matrix[(i, i)] -= 256.0 * f64::EPSILON * upper[(i, i)];
            }
            matrix
        };
        let lost = squared_sum([&(&known + &more)].into_iter().chain(own));
        let mut matrix = below(&lost);
        let is_finite = |m: &Mat<f64>| (0..n).all(|i| (0..n).all(|j| m[(i, j)].is_finite()));
        let proved = found.proved && is_finite(&lost);
        let with_error_of_base = match sight {
            Some(sight) if proved => {
                let in_ball = self.errors_around(domain, sight)?;
                let seen = squared_sum([&(&known * Scale(sight.share(self.base.is_odd()))), &in_ball]);
                let apart = squared_sum([&on_block, &(&on_block + &more)].into_iter().chain(own));
                let product = twice_the_product(&known, &apart);
                Some([below(&(&product + &apart)), upper + seen + product])
            }
            _ => None,
        };
        if !proved {
            matrix = Mat::zeros(n, n);
        }
        let [setup, solve] = found.seconds;
        Ok(Energies {
            matrix,
            unknowns: found.unknowns,
            iterations: found.iterations,
            converged: found.converged,
            repair_share: 0.0,
            coefficients: Vec::new(),
            with_error_of_base,
            seconds: [setup, solve + begin.elapsed().as_secs_f64()],
        })
    }
}

/// A form and its transpose.
fn double(m: Mat<f64>) -> Mat<f64> {
    &m + m.transpose()
}

/// The functions of a domain that do not vanish on a block.
fn closed(domain: &Domain, block: &Block) -> Window {
    [0, 1, 2].map(|a| domain.axes[a].closed(block.lo[a], block.hi[a]))
}

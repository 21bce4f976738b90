//! Maxwell matrices from energies, and bounds of their entries and of the two-terminal capacitance.

use crate::bounded::Bounded;
use elastocap_linalg::dense::Lu;
use faer::Mat;

/// A lower and an upper bound on a symmetric matrix, in the sense of quadratic forms: both differences to the
/// true matrix are positive semidefinite.
#[derive(Debug, Clone)]
pub(crate) struct MatrixBounds {
    /// From Thomson's principle, F.
    pub lower: Mat<f64>,
    /// From Dirichlet's principle, F.
    pub upper: Mat<f64>,
}

/// The capacitance matrix C from energies E in the basis of the columns of `basis` (B): V^T C V = c^T E c for
/// V = B c.
pub(crate) fn from_energies(basis: &Mat<f64>, energies: &Mat<f64>) -> Mat<f64> {
    let factor = Lu::new(basis.transpose());
    // C = B^-T E B^-1
    let left = factor.solve(energies.as_ref());
    let c = factor.solve(left.transpose());
    let n = c.nrows();
    Mat::from_fn(n, n, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]))
}

/// Bounds that cross by less than this share of the value, beyond the rounding that is counted, are taken to
/// have crossed by rounding. Not tuned: it only has to lie above rounding errors and below errors that
/// matter.
const CROSSING: f64 = 1e-9;

/// Bounds that cross by less than this, F, have crossed by rounding whatever their size: it is a billionth of
/// the capacitance of a body of a nanometre. Where no flux can leave a conductor its upper bound is zero
/// exactly, and no share of it allows for rounding of the lower one.
const NEGLIGIBLE: f64 = 1e-29;

/// The rounding error that an energy may have, as a share of it and for each conductor, where the
/// permittivity is uniform.
///
/// Energies are sums of squares of differences of potentials, in which little cancels; this constant covers
/// the length of the sums, and the changes of basis.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The rounding error that a lower bound may have, in units of [`ROUNDING`]: where the field vanishes, the
/// computed flux is rounding alone, and its energy enters the bound on the wrong side. This is measured and
/// not derived: random stacks of layers with contrasts up to 1e24 need at most 40
/// (tests/integration/layers_in_series.rs).
const ROUNDING_OF_FLUXES: f64 = 64.0;

/// The form that rounding errors are a share of, from energies E in the basis of the columns of `basis` (B):
/// B^-T diag(E) B^-1.
///
/// A difference of potentials is wrong by up to delta, the last digit of the potentials themselves. Where the
/// permittivity eps is highest, this changes an energy E by up to 2 sqrt(E eps delta^2): a share of the order
/// of delta times the root of the contrast ([`of_squares`]). Rounding changes entry ij by such a share r of
/// sqrt(E_ii E_jj), hence c^T E c by at most r (sum_i |c_i| sqrt(E_ii))^2 <= n r sum_i c_i^2 E_ii.
pub(crate) fn rounding_scale(basis: &Mat<f64>, energies: &Mat<f64>) -> Mat<f64> {
    let n = energies.nrows();
    let diagonal = Mat::from_fn(n, n, |i, j| if i == j { energies[(i, i)].abs() } else { 0.0 });
    from_energies(basis, &diagonal)
}

/// The change, F, that rounding may make to each diagonal entry of a capacitance matrix when linear equations
/// are solved with it.
pub(crate) fn rounding(c: &Mat<f64>) -> Vec<f64> {
    let n = c.nrows();
    (0..n).map(|i| ROUNDING * n as f64 * c[(i, i)].abs()).collect()
}

/// The largest over the smallest of the permittivities of a scene.
pub(crate) fn contrast_of(permittivity: &[f64]) -> f64 {
    let (least, greatest) =
        permittivity.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), e| (a.min(*e), b.max(*e)));
    if least > 0.0 { (greatest / least).max(1.0) } else { 1.0 }
}

/// The factor on the rounding of energies that are sums of squares of differences, where permittivities have
/// this contrast.
pub(crate) fn of_squares(contrast: f64) -> f64 {
    contrast.sqrt()
}

/// The factor on the rounding of energies that are products of potentials u with A u, and of fluxes whose
/// divergence is such a product, where permittivities have this contrast: where the permittivity eps is
/// highest, nearly all of u cancels, and the rest is wrong by delta eps u^2.
pub(crate) fn of_products(contrast: f64) -> f64 {
    ROUNDING_OF_FLUXES * contrast
}

impl MatrixBounds {
    /// Moves the bounds apart by the rounding error of the energies. `scale` is the form that rounding is a
    /// share of, from [`rounding_scale`], and `factor` accounts for the contrast of the permittivities, from
    /// [`of_squares`] or [`of_products`].
    pub(crate) fn count_rounding(&mut self, scale: &Mat<f64>, factor: f64) {
        let n = self.upper.nrows();
        let share = ROUNDING * n as f64;
        for i in 0..n {
            // The rounding of the entry itself, whatever the contrast.
            let stored = share * self.upper[(i, i)].abs();
            for j in 0..n {
                let r = share * factor * scale[(i, j)] + if i == j { stored } else { 0.0 };
                self.upper[(i, j)] += r;
                self.lower[(i, j)] -= ROUNDING_OF_FLUXES * r;
            }
        }
    }

    /// Moves the bounds apart by a share of every energy; `scale` is the form from [`rounding_scale`].
    pub(crate) fn widen(&mut self, scale: &Mat<f64>, share: f64) {
        let by = scale * faer::Scale(share * self.upper.nrows() as f64);
        self.upper += &by;
        self.lower -= &by;
    }

    /// How the bounds contradict each other once rounding has been counted, as the end of a sentence, if they
    /// do.
    pub(crate) fn crossing(&self) -> Option<String> {
        let bounds = |i: usize| [self.lower[(i, i)], self.upper[(i, i)]];
        let crossed = |i: &usize| bounds(*i)[0] > bounds(*i)[1] * (1.0 + CROSSING) + NEGLIGIBLE;
        let [lower, upper] = bounds((0..self.upper.nrows()).find(crossed)?);
        Some(format!("a capacitance is proved to be at least {lower:e} F and at most {upper:e} F"))
    }

    /// Bounds around the upper matrix that allow for rounding alone, with the arguments of
    /// [`MatrixBounds::count_rounding`].
    pub(crate) fn upper_with_rounding(&self, scale: &Mat<f64>, factor: f64) -> Self {
        let mut exact = Self { lower: self.upper.clone(), upper: self.upper.clone() };
        exact.count_rounding(scale, factor);
        exact
    }

    /// Separates bounds on energies that have crossed by rounding: each is moved by twice the distance by
    /// which they crossed. Where the upper bound is zero, a negligible lower bound becomes zero too.
    pub(crate) fn uncross(&mut self) {
        for i in 0..self.upper.nrows() {
            let (lower, upper) = (self.lower[(i, i)], self.upper[(i, i)]);
            if upper == 0.0 && (0.0..=NEGLIGIBLE).contains(&lower) {
                self.lower[(i, i)] = 0.0;
            } else if upper < lower && lower - upper <= CROSSING * upper {
                self.upper[(i, i)] += 2.0 * (lower - upper);
                self.lower[(i, i)] -= 2.0 * (lower - upper);
            }
        }
    }

    /// Bounds on every entry, F.
    ///
    /// With G = upper - lower and C = lower + E, 0 <= E <= G: polarisation gives |E_ij - G_ij / 2| <=
    /// sqrt(G_ii G_jj) / 2. The sign rules of a Maxwell matrix narrow these limits: its diagonal is not
    /// negative, the other entries are not positive, and no row has a negative sum. The values obey them too;
    /// each is the middle of its limits, unless a row of middles had a negative sum.
    pub(crate) fn entries(&self) -> Vec<Vec<Bounded>> {
        let n = self.upper.nrows();
        let entry = |i: usize, j: usize| {
            let [value, half] = self.by_polarisation(i, j);
            let limits = Bounded { value, lower: value - half, upper: value + half };
            if i == j { limits.narrowed(0.0, f64::INFINITY) } else { limits.narrowed(f64::NEG_INFINITY, 0.0) }
        };
        let mut entries: Vec<Vec<Bounded>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        narrow_by_dominance(&mut entries);
        raise_negative_rows(&mut entries);
        entries
    }

    /// The middle of an entry's limits by polarisation alone, and half of their distance.
    pub(crate) fn by_polarisation(&self, i: usize, j: usize) -> [f64; 2] {
        let gap = |i: usize| (self.upper[(i, i)] - self.lower[(i, i)]).max(0.0);
        // Only the upper triangle is read, because the two triangles may differ by rounding.
        let (i, j) = (i.min(j), i.max(j));
        let value = 0.5 * (self.upper[(i, j)] + self.lower[(i, j)]);
        // Where rounding was counted, the two forms may be larger than the entry by many orders: so is the
        // rounding of this sum.
        let rounding = f64::EPSILON * (self.upper[(i, j)].abs() + self.lower[(i, j)].abs());
        // No energy is negative, so that an entry is at most this large; an excess is rounding that was not
        // counted.
        let largest = (self.upper[(i, i)] * self.upper[(j, j)]).sqrt();
        let excess = (self.upper[(i, j)].abs() - largest).max(0.0);
        [value, (0.5 + f64::EPSILON) * (gap(i) * gap(j)).sqrt() + rounding + excess]
    }

    /// Bounds on the matrix of these conductors with all others at potential zero.
    pub(crate) fn of_rows(&self, rows: &[usize]) -> Self {
        let block = |c: &Mat<f64>| Mat::from_fn(rows.len(), rows.len(), |i, j| c[(rows[i], rows[j])]);
        Self { lower: block(&self.lower), upper: block(&self.upper) }
    }

    /// Bounds on the form of two states: one volt on `conductor` alone, and one volt on its `guard` as well.
    pub(crate) fn with_guard(&self, conductor: usize, guard: usize) -> Self {
        let states = [&[conductor][..], &[conductor, guard]];
        let entry = |c: &Mat<f64>, k: usize, l: usize| -> f64 {
            states[k].iter().flat_map(|i| states[l].iter().map(move |j| c[(*i, *j)])).sum()
        };
        let form = |c: &Mat<f64>| Mat::from_fn(2, 2, |k, l| entry(c, k, l));
        Self { lower: form(&self.lower), upper: form(&self.upper) }
    }

    /// Two-terminal capacitance: charge over voltage with equal and opposite charges for two conductors,
    /// against ground or infinity for one.
    ///
    /// It is the minimum of the energy over all common potentials, hence monotone in the matrix: the bounds
    /// carry over. `None` for other numbers of conductors, or if the upper bound is zero.
    pub(crate) fn two_terminal(&self) -> Option<Bounded> {
        let (lower, upper) = match self.upper.nrows() {
            1 => (self.lower[(0, 0)], self.upper[(0, 0)]),
            2 => (
                // Where the lower form has no minimum over common potentials, it loses at most the flux that
                // leaves the pair at 1 V in common.
                two_terminal(&self.lower)
                    .unwrap_or_else(|| self.lower[(0, 0)] - common_energy(&self.upper).max(0.0)),
                two_terminal(&self.upper).unwrap_or(self.upper[(0, 0)]),
            ),
            _ => return None,
        };
        if upper.is_nan() || upper <= 0.0 {
            return None;
        }
        let lower = lower.clamp(0.0, upper);
        let pair = Bounded { value: 0.5 * (lower + upper), lower, upper };
        let entries = self.entries();
        // The capacitance of a pair lies between the mutual one and the smaller of the two on the diagonal.
        Some(match &entries[..] {
            [one, two] => pair.narrowed(-one[1].upper, one[0].upper.min(two[1].upper)),
            _ => pair,
        })
    }
}

/// Narrows each entry's limits by those of the others: as no row has a negative sum, -C_ij <= C_ii, C_jj and
/// C_ii >= -sum_j C_ij.
fn narrow_by_dominance(entries: &mut [Vec<Bounded>]) {
    let n = entries.len();
    for i in 0..n {
        for j in (0..n).filter(|j| *j != i) {
            let max = entries[i][i].upper.min(entries[j][j].upper);
            entries[i][j] = entries[i][j].narrowed(-max, f64::INFINITY);
        }
    }
    for i in 0..n {
        let drawn: f64 = (0..n).filter(|j| *j != i).map(|j| -entries[i][j].upper).sum();
        entries[i][i] = entries[i][i].narrowed(drawn, f64::INFINITY);
    }
}

/// Raises the values of a row whose sum is negative, within their limits, until it is not. The sum is the
/// charge of a conductor with all at 1 V, which is not negative; a circuit simulator would make a negative
/// capacitor of it.
fn raise_negative_rows(entries: &mut [Vec<Bounded>]) {
    for i in 0..entries.len() {
        let sum: f64 = entries[i].iter().map(|b| b.value).sum();
        let room: f64 = entries[i].iter().map(|b| b.upper - b.value).sum();
        if !(sum < 0.0 && room > 0.0) {
            continue;
        }
        // A little more, so that the sum is not negative after rounding.
        let share = ((-sum + 4.0 * f64::EPSILON * entries[i][i].value.abs()) / room).min(1.0);
        for j in 0..entries.len() {
            let b = entries[i][j];
            let raised = (b.value + share * (b.upper - b.value)).min(b.upper);
            entries[i][j].value = raised;
            entries[j][i].value = raised;
        }
    }
}

/// Twice the energy of a pair with both at 1 V, F V^2.
fn common_energy(c: &Mat<f64>) -> f64 {
    c[(0, 0)] + c[(0, 1)] + c[(1, 0)] + c[(1, 1)]
}

/// Twice the energy of a pair with 1 V between them at the common potential that makes it least, F V^2.
/// `None` where a common potential has no energy but rounding, or a negative one.
fn two_terminal(c: &Mat<f64>) -> Option<f64> {
    let (row, sum) = (c[(0, 0)] + c[(0, 1)], common_energy(c));
    (sum > 1e-12 * c[(0, 0)]).then(|| c[(0, 0)] - row * row / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_recovered_from_its_energies_in_another_basis() {
        let c = Mat::from_fn(2, 2, |i, j| [[3.0, -1.0], [-1.0, 2.0]][i][j]);
        let b = Mat::from_fn(2, 2, |i, j| [[1.0, 1.0], [-1.0, 1.0]][i][j]);
        let e = b.transpose() * &c * &b;
        let back = from_energies(&b, &e);
        assert!((0..2).all(|i| (0..2).all(|j| (back[(i, j)] - c[(i, j)]).abs() < 1e-14)));
    }

    #[test]
    fn no_value_breaks_the_sign_rules_of_a_maxwell_matrix_and_none_leaves_its_limits() {
        let matrix = |e: [[f64; 3]; 3]| Mat::from_fn(3, 3, |i, j| e[i][j]);
        // The middle has a first row that sums to -0.1, a positive coupling of 0.05, and limits 0.4 around
        // all.
        let middle = [[2.0, -1.5, -0.6], [-1.5, 3.0, 0.05], [-0.6, 0.05, 1.0]];
        let moved = |by: f64| {
            let mut c = matrix(middle);
            (0..3).for_each(|i| c[(i, i)] += by);
            c
        };
        let entries = MatrixBounds { lower: moved(-0.2), upper: moved(0.2) }.entries();
        for i in 0..3 {
            assert!(entries[i].iter().map(|b| b.value).sum::<f64>() >= 0.0, "{:?}", entries[i]);
            for j in 0..3 {
                let b = entries[i][j];
                assert!(b.lower <= b.value && b.value <= b.upper, "{b:?}");
                assert!((i == j) == (b.value > 0.0), "{b:?}");
                assert_eq!(b, entries[j][i]);
            }
        }
        // What obeys the rules stays as it is.
        assert_eq!(entries[1][1].value, 3.0);
    }

    /// A meshed stack of layers gave such a form: rounding was more than is counted for its contrast.
    #[test]
    fn an_upper_form_with_an_entry_beyond_its_diagonal_leaves_room_for_the_rounding_that_this_shows() {
        let upper = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { -1.01 });
        let entries = MatrixBounds { lower: Mat::zeros(2, 2), upper }.entries();
        assert_eq!((entries[0][1].upper, entries[0][0].lower), (0.0, 0.0));
    }

    #[test]
    fn bounds_that_cross_by_more_than_rounding_are_a_contradiction_and_others_are_moved_apart() {
        let c = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { -0.5 });
        let crossed = |by: f64| MatrixBounds { lower: &c * faer::Scale(1.0 + by), upper: c.clone() };
        assert!(crossed(1e-8).crossing().unwrap().contains("at most 1e0 F"));
        let mut little = crossed(1e-10);
        assert_eq!(little.crossing(), None);
        little.uncross();
        assert!(little.lower[(0, 0)] < 1.0 && 1.0 < little.upper[(0, 0)]);
        let mut rounded = crossed(1e-8);
        rounded.count_rounding(&rounding_scale(&Mat::identity(2, 2), &c), of_squares(1e12));
        assert_eq!(rounded.crossing(), None);
    }

    #[test]
    fn a_pair_from_which_no_flux_leaves_has_bounds_that_contain_rounding() {
        // Between insulated walls: a common potential has no energy.
        let c = Mat::from_fn(2, 2, |i, j| if i == j { 1e7 } else { -1e7 });
        let mut bounds = MatrixBounds { lower: c.clone(), upper: c.clone() };
        bounds.count_rounding(&rounding_scale(&Mat::identity(2, 2), &c), 1.0);
        let pair = bounds.two_terminal().unwrap();
        assert!(pair.lower < 1e7 && 1e7 < pair.upper && pair.upper - pair.lower < 1e-11 * 1e7, "{pair:?}");
    }

    #[test]
    fn two_terminal_capacitance_is_the_mutual_one_in_parallel_with_both_capacitors_to_ground_in_series() {
        // c_m = 1 between them, 2 and 1 to ground: 1 + 2 * 1 / 3
        let c = Mat::from_fn(2, 2, |i, j| [[3.0, -1.0], [-1.0, 2.0]][i][j]);
        assert!((two_terminal(&c).unwrap() - (1.0 + 2.0 / 3.0)).abs() < 1e-14);
    }
}

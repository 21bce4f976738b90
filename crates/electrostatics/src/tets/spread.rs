//! The relative distance between the bounds of a target.

use crate::bounded::Bounded;
use crate::target::{SHARE_OF_DIAGONAL, Target};
use crate::tets::settings::TetrahedraSettings;

/// The relative distance between the bounds.
#[derive(Debug, PartialEq)]
pub(super) struct Spread {
    /// Relative spread of the target.
    pub(super) error: f64,
    /// Whether an entry was left out because its bounds include zero and are small: it has no relative error.
    pub(super) may_be_zero: bool,
}

/// The relative spread that is compared with the tolerance: of the capacitance `measured`, or of the whole
/// matrix and the pair.
///
/// `alone` has for each driven conductor its capacitance with all others at zero potential, the floating ones
/// included, F. An entry that may be zero and is smaller than the tolerance times that capacitance is left
/// out: its relative spread does not fall as the mesh is refined.
pub(super) fn spread(
    maxwell: &[Vec<Bounded>],
    two_terminal: Option<&Bounded>,
    measured: Option<&Bounded>,
    alone: &[f64],
    settings: &TetrahedraSettings,
) -> Spread {
    let relative = |b: &Bounded, scale: f64| {
        if b.upper > b.lower { (b.upper - b.lower) / scale.max(settings.least_scale) } else { 0.0 }
    };
    let negligible = |b: &Bounded, scale: f64| {
        b.lower <= 0.0 && b.upper.max(-b.lower) <= settings.relative_tolerance * scale
    };
    let mut result = Spread { error: 0.0, may_be_zero: false };
    let mut include = |b: &Bounded, scale: f64, can_be_zero: bool, alone: f64| {
        let near_enough = relative(b, scale) <= settings.relative_tolerance;
        if !near_enough && can_be_zero && negligible(b, alone) {
            result.may_be_zero = true;
        } else {
            result.error = result.error.max(relative(b, scale));
        }
    };
    if let Some(target) = measured.or(two_terminal.filter(|_| settings.target == Target::Matrix)) {
        let rows = settings.target.rows(maxwell.len());
        include(target, target.value, true, rows.iter().map(|row| alone[*row]).fold(f64::INFINITY, f64::min));
    }
    if measured.is_none() {
        for (i, row) in maxwell.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let diagonal = (maxwell[i][i].value * maxwell[j][j].value).max(0.0).sqrt();
                // The diagonal gives an off-diagonal entry its scale, unless the diagonal itself may be zero.
                let no_scale = [i, j].into_iter().any(|k| negligible(&maxwell[k][k], alone[k]));
                let scale = entry.value.abs().max(SHARE_OF_DIAGONAL * diagonal);
                include(entry, scale, i == j || no_scale, (alone[i] * alone[j]).sqrt());
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_that_may_be_zero_is_left_out_once_it_is_small_compared_with_the_conductor_alone() {
        let bounded = |lower: f64, upper: f64| Bounded { value: 0.5 * (lower + upper), lower, upper };
        let settings = TetrahedraSettings { relative_tolerance: 1e-2, ..TetrahedraSettings::default() };
        let spread_of = |b: Bounded| spread(&[vec![b]], Some(&b), None, &[1.0], &settings);
        assert_eq!(spread_of(bounded(0.0, 5e-3)), Spread { error: 0.0, may_be_zero: true });
        assert_eq!(spread_of(bounded(0.0, 5e-2)), Spread { error: 2.0, may_be_zero: false });
        // Small, but not zero.
        let small = spread_of(bounded(4e-3, 5e-3));
        assert!(!small.may_be_zero && small.error > 0.2);
        // With an absolute tolerance, of which this is the scale, zero is known well enough.
        let absolute = TetrahedraSettings { least_scale: 0.6, ..settings.clone() };
        let near = spread(&[vec![bounded(0.0, 5e-3)]], Some(&bounded(0.0, 5e-3)), None, &[1.0], &absolute);
        assert!(!near.may_be_zero && near.error < 1e-2, "{near:?}");
        // A screened pair: only the entry between the two may be zero.
        let diagonal = bounded(0.999, 1.001);
        let between = bounded(-1e-3, 1e-3);
        let pair =
            spread(&[vec![diagonal, between], vec![between, diagonal]], None, None, &[1.0; 2], &settings);
        assert!(!pair.may_be_zero && (pair.error - 0.02).abs() < 1e-3, "{pair:?}");
    }
}

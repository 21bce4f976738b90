//! The quantity that the tolerance of a solve applies to.

use crate::bounded::Bounded;
use crate::matrix::MatrixBounds;
use serde::Serialize;

/// The quantity that the tolerance applies to. Rows are those of the Maxwell matrix, which are the driven
/// conductors in their order; a target with a row that does not exist, or with the same one twice, counts as
/// [`Target::Matrix`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Target {
    /// The two-terminal capacitance where there is one (else the matrix): a sensor's signal. Without a net
    /// charge the field decays quickly, and the grid need not reach far into open space. The Maxwell matrix
    /// is reported too, with the bounds that this grid gives.
    TwoTerminal,
    /// The two-terminal capacitance of these two of several driven conductors, with all others at potential
    /// zero.
    Pair([usize; 2]),
    /// The mutual capacitance of two driven conductors: minus their entry of the Maxwell matrix.
    Mutual([usize; 2]),
    /// The capacitance of one driven conductor with all others at potential zero: its diagonal entry of the
    /// Maxwell matrix.
    Own(usize),
    /// The charge of the first of two driven conductors over its voltage, where the second, a driven guard,
    /// has the same voltage and all others are at potential zero: the sum of two entries of the Maxwell
    /// matrix in one row.
    Guarded([usize; 2]),
    /// Every entry of the Maxwell matrix of the driven conductors, and the two-terminal capacitance where
    /// there is one. The error of an off-diagonal entry
    /// is relative to the entry, or to [`SHARE_OF_DIAGONAL`] of the geometric mean of its two diagonal
    /// entries where the entry is smaller.
    Matrix,
}

/// The share of the geometric mean of two diagonal entries that the error of the entry between them is at
/// least relative to; see [`Target::Matrix`]. A coupling that is a thousandth of the diagonal would need a
/// field a thousand times better to be known to the same relative error as the diagonal.
pub const SHARE_OF_DIAGONAL: f64 = 0.1;

impl Target {
    /// The two of the `driven` conductors that have equal and opposite charges in the state whose capacitance
    /// is the target.
    pub(crate) fn opposite(self, driven: usize) -> Option<[usize; 2]> {
        match self {
            Self::TwoTerminal if driven == 2 => Some([0, 1]),
            Self::Pair([i, j]) if i != j && i.max(j) < driven => Some([i, j]),
            Self::TwoTerminal
            | Self::Pair(_)
            | Self::Mutual(_)
            | Self::Own(_)
            | Self::Guarded(_)
            | Self::Matrix => None,
        }
    }

    /// The rows, of `driven` ones, whose states determine the target: one volt on the conductor of the row,
    /// and none on the others.
    pub(crate) fn rows(self, driven: usize) -> Vec<usize> {
        match self {
            Self::Pair([i, j]) | Self::Mutual([i, j]) | Self::Guarded([i, j])
                if i != j && i.max(j) < driven =>
            {
                vec![i, j]
            }
            Self::Own(i) if i < driven => vec![i],
            Self::TwoTerminal
            | Self::Pair(_)
            | Self::Mutual(_)
            | Self::Own(_)
            | Self::Guarded(_)
            | Self::Matrix => (0..driven).collect(),
        }
    }

    /// Bounds on the target, from those on the matrix; `None` where the target is the whole matrix.
    pub(crate) fn of(self, bounds: &MatrixBounds) -> Option<Bounded> {
        let driven = bounds.upper.nrows();
        match self {
            Self::TwoTerminal => bounds.two_terminal(),
            Self::Pair(_) => self.opposite(driven).and_then(|rows| bounds.of_rows(&rows).two_terminal()),
            Self::Mutual([i, j]) => (i != j && i.max(j) < driven).then(|| bounds.entries()[i][j].negative()),
            Self::Own(i) => (i < driven).then(|| bounds.entries()[i][i]),
            Self::Guarded([i, _]) => {
                let guarded = self.within(bounds)?;
                // The charge has the sign of the voltage, and a guard takes a part of it away.
                Some(guarded.narrowed(0.0, bounds.upper[(i, i)]))
            }
            Self::Matrix => None,
        }
    }

    /// Whether the target is a linear function of the matrix.
    pub(crate) fn is_linear(self, driven: usize) -> bool {
        match self {
            Self::Mutual([i, j]) | Self::Guarded([i, j]) => i != j && i.max(j) < driven,
            Self::Own(i) => i < driven,
            Self::TwoTerminal | Self::Pair(_) | Self::Matrix => false,
        }
    }

    /// Bounds on the target by polarisation alone, from those on a form that need not obey the sign rules of
    /// a Maxwell matrix; `None` where the target is not linear.
    pub(crate) fn within(self, bounds: &MatrixBounds) -> Option<Bounded> {
        let (i, j, sign) = match self {
            _ if !self.is_linear(bounds.upper.nrows()) => return None,
            Self::Mutual([i, j]) => (i, j, -1.0),
            Self::Own(i) => (i, i, 1.0),
            Self::Guarded([i, j]) => {
                let [value, half] = bounds.with_guard(i, j).by_polarisation(0, 1);
                return Some(Bounded { value, lower: value - half, upper: value + half });
            }
            Self::TwoTerminal | Self::Pair(_) | Self::Matrix => return None,
        };
        let [value, half] = bounds.by_polarisation(i, j);
        Some(Bounded { value: sign * value, lower: sign * value - half, upper: sign * value + half })
    }

    /// The value of the target for a known matrix.
    pub(crate) fn value(self, matrix: &faer::Mat<f64>) -> Option<f64> {
        let exact = MatrixBounds { lower: matrix.clone(), upper: matrix.clone() };
        self.of(&exact).map(|bounds| bounds.upper)
    }

    /// The potentials, V, of the `driven` conductors in the state that is shown: half a volt and minus half a
    /// volt on two that have opposite charges; else one volt on the first conductor that the target names and
    /// on its guard, or on the first of all.
    pub fn shown(self, driven: usize) -> Vec<f64> {
        let mut volts = vec![0.0; driven];
        let pair = match self {
            Self::Matrix if driven == 2 => Some([0, 1]),
            _ => self.opposite(driven),
        };
        if let Some([i, j]) = pair {
            (volts[i], volts[j]) = (0.5, -0.5);
        } else if let (Self::Guarded([i, j]), true) = (self, self.is_linear(driven)) {
            (volts[i], volts[j]) = (1.0, 1.0);
        } else if let Some(first) = self.rows(driven).first() {
            volts[*first] = 1.0;
        }
        volts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Three conductors, the gap between the bounds being a hundredth of the diagonal.
    fn bounds() -> MatrixBounds {
        let c = [[3.0, -1.0, -0.5], [-1.0, 4.0, -1.5], [-0.5, -1.5, 3.5]];
        let moved = |by: f64| Mat::from_fn(3, 3, |i, j| c[i][j] + if i == j { by * c[i][i] } else { 0.0 });
        MatrixBounds { lower: moved(-0.005), upper: moved(0.005) }
    }

    #[test]
    fn each_target_is_bounded_around_what_the_matrix_says() {
        let check = |target: Target, exact: f64| {
            let bounded = target.of(&bounds()).unwrap();
            assert!(
                bounded.lower <= exact && exact <= bounded.upper,
                "{target:?}: {exact} not in {bounded:?}"
            );
            assert!(bounded.upper - bounded.lower < 0.08, "{target:?}: {bounded:?}");
        };
        check(Target::Mutual([2, 1]), 1.5);
        check(Target::Own(1), 4.0);
        check(Target::Guarded([1, 2]), 2.5);
        // With the first conductor at zero: 1.5 in parallel with 2.5 and 2 in series.
        check(Target::Pair([1, 2]), 1.5 + 2.5 * 2.0 / 4.5);
        assert_eq!((Target::TwoTerminal.of(&bounds()), Target::Matrix.of(&bounds())), (None, None));
    }

    #[test]
    fn rows_that_there_are_not_leave_the_whole_matrix() {
        for target in [Target::Pair([0, 3]), Target::Mutual([1, 1]), Target::Own(3), Target::Matrix] {
            assert_eq!(target.of(&bounds()), None);
            assert_eq!((target.rows(3), target.opposite(3)), (vec![0, 1, 2], None));
            assert_eq!(target.shown(3), [1.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn the_state_that_is_shown_is_that_of_the_target() {
        assert_eq!(Target::Pair([2, 0]).shown(3), [-0.5, 0.0, 0.5]);
        assert_eq!(Target::Mutual([1, 2]).shown(3), [0.0, 1.0, 0.0]);
        assert_eq!(Target::Own(2).shown(3), [0.0, 0.0, 1.0]);
        assert_eq!(Target::Guarded([2, 0]).shown(3), [1.0, 0.0, 1.0]);
        assert_eq!(Target::TwoTerminal.shown(2), [0.5, -0.5]);
        assert_eq!(Target::Matrix.shown(2), [0.5, -0.5]);
        assert_eq!(Target::Matrix.shown(1), [1.0]);
    }
}

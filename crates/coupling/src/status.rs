//! The status of a step, and of each entry of its Maxwell matrix.

use std::fmt;

use elastocap_electrostatics::{Bounded, SHARE_OF_DIAGONAL, Target};
use serde::{Deserialize, Serialize, Serializer};

use crate::failure::StepFailure;

/// The status of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Status {
    /// Solved to its tolerance.
    Ok,
    /// Solved, with some entries of the matrix whose error is within the tolerance of a share of the
    /// diagonal, but not of the entry: see [`EntryStatus`]. Only where the whole matrix was requested.
    OkToDiagonal,
    /// Solved to its tolerance, but the model of the layer that the case names has a larger error:
    /// [`Row::model_error_estimate`](crate::outcome::Row::model_error_estimate).
    OkInModel,
    /// Solved, with an error above the tolerance.
    ToleranceNotReached(Missed),
    /// Deformed and solved, but compressed beyond the maximum of equation (50) of the paper, so that the row
    /// has no force.
    BeyondForceLimit,
    /// Failed for this reason. The row keeps the results from before the failure.
    Failed(Box<StepFailure>),
    /// The run was stopped before this step, whose results are estimates from the first meshes of the layer
    /// and a coarse field.
    Draft,
    /// The run was stopped before this step.
    #[default]
    NotRun,
}

/// The source of an error above the tolerance; the first one that applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Missed {
    /// The field: the bounds of the capacitance are too far apart.
    Field,
    /// The finite elements of the layer: the error of their force, or of the capacitance due to them.
    Mechanics,
    /// Flat faces in place of curved surfaces.
    Geometry,
    /// The field, for the change from the first step only: the capacitance meets its tolerance.
    Change,
}

impl Status {
    /// The defect of the program because of which the step failed, if any: a panic, or proved bounds that
    /// contradict each other.
    pub fn defect(&self) -> Option<&StepFailure> {
        match self {
            Self::Failed(failure) => Some(&**failure).filter(|failure| failure.is_defect()),
            Self::Ok
            | Self::OkToDiagonal
            | Self::OkInModel
            | Self::ToleranceNotReached(_)
            | Self::BeyondForceLimit
            | Self::Draft
            | Self::NotRun => None,
        }
    }

    /// Whether the step meets all tolerances, but for the model of the layer.
    pub fn is_ok(&self) -> bool {
        match self {
            Self::Ok | Self::OkToDiagonal | Self::OkInModel => true,
            Self::ToleranceNotReached(_)
            | Self::BeyondForceLimit
            | Self::Failed(_)
            | Self::Draft
            | Self::NotRun => false,
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ok => f.write_str("ok"),
            Self::OkToDiagonal => f.write_str("ok: small mutual capacitances are known less closely"),
            Self::OkInModel => f.write_str("ok: but for the model of the layer"),
            Self::ToleranceNotReached(Missed::Field) => f.write_str("tolerance not reached"),
            Self::ToleranceNotReached(Missed::Mechanics) => f.write_str("tolerance not reached: mechanics"),
            Self::ToleranceNotReached(Missed::Geometry) => f.write_str("tolerance not reached: geometry"),
            Self::ToleranceNotReached(Missed::Change) => f.write_str("tolerance not reached: change"),
            Self::BeyondForceLimit => f.write_str("no force: beyond the limit of eq. (50)"),
            Self::Failed(reason) => write!(f, "failed: {reason}"),
            Self::Draft => f.write_str("draft"),
            Self::NotRun => f.write_str("not run"),
        }
    }
}

impl<E: Into<StepFailure>> From<E> for Status {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error.into()))
    }
}

impl Serialize for Status {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The status of one entry of a Maxwell matrix. Its spread is the distance between its bounds.
///
/// The solvers aim at an error relative to the entry, or to [`SHARE_OF_DIAGONAL`] of sqrt(C_ii C_jj) where
/// the entry is smaller: see [`Target::Matrix`](elastocap_electrostatics::Target::Matrix).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum EntryStatus {
    /// The spread is at most the tolerance times the value, or at most the absolute tolerance.
    #[serde(rename = "ok")]
    Ok,
    /// The spread is at most the tolerance times [`SHARE_OF_DIAGONAL`] of sqrt(C_ii C_jj), but more than the
    /// tolerance times the value.
    // The alias is the name in results of earlier versions.
    #[serde(rename = "ok: small and less closely known", alias = "ok: to a tenth of the diagonal")]
    ToDiagonal,
    /// The spread is more than [`EntryStatus::ToDiagonal`] allows.
    #[serde(rename = "tolerance not reached")]
    NotReached,
    /// The spread is more than [`EntryStatus::ToDiagonal`] allows, but the tolerance applies to another
    /// capacitance, which is measured.
    #[serde(rename = "not measured")]
    NotMeasured,
}

impl EntryStatus {
    /// The status of each entry of `maxwell`, F, where the spread of the target was to be at most `allowed`,
    /// relative to the value or to `least_scale`, F, whichever is larger.
    pub fn of(
        maxwell: &[Vec<Bounded>],
        (allowed, least_scale): (f64, f64),
        target: Target,
    ) -> Vec<Vec<Self>> {
        let is_measured = |i: usize, j: usize| match target {
            Target::Matrix => true,
            Target::Mutual(rows) => rows == [i, j] || rows == [j, i],
            Target::Own(row) => (i, j) == (row, row),
            Target::TwoTerminal | Target::Pair(_) | Target::Guarded(_) => false,
        };
        // The margin covers rounding: the solvers apply the same test to sums of rounded numbers.
        let allowed = allowed * (1.0 + 1e-9);
        let diagonal = |i: usize| maxwell.get(i).and_then(|row| row.get(i)).map_or(0.0, |c| c.value.max(0.0));
        let entry = |(i, j): (usize, usize), c: &Bounded| {
            if c.spread_over_value() <= allowed || c.upper - c.lower <= allowed * least_scale {
                Self::Ok
            } else if c.upper - c.lower <= allowed * SHARE_OF_DIAGONAL * (diagonal(i) * diagonal(j)).sqrt() {
                Self::ToDiagonal
            } else if !is_measured(i, j) {
                Self::NotMeasured
            } else {
                Self::NotReached
            }
        };
        let row = |(i, row): (usize, &Vec<Bounded>)| -> Vec<Self> {
            row.iter().enumerate().map(|(j, c)| entry((i, j), c)).collect()
        };
        maxwell.iter().enumerate().map(row).collect()
    }
}

/// The text in the result files.
impl fmt::Display for EntryStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Serialize::serialize(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_entry_is_measured_by_itself_and_then_by_the_diagonal() {
        let bounded = |value: f64, half: f64| Bounded { value, lower: value - half, upper: value + half };
        let matrix = vec![
            vec![bounded(10.0, 0.04), bounded(-0.1, 0.004), bounded(-3.0, 0.2)],
            vec![bounded(-0.1, 0.004), bounded(10.0, 0.06), bounded(0.0, 0.0)],
        ];
        use EntryStatus::{NotMeasured, NotReached, Ok, ToDiagonal};
        let found = EntryStatus::of(&matrix, (1e-2, 0.0), Target::Matrix);
        assert_eq!(found, [[Ok, ToDiagonal, NotReached], [ToDiagonal, NotReached, Ok]]);
        let of_one_entry = EntryStatus::of(&matrix, (1e-2, 0.0), Target::Own(1));
        assert_eq!(of_one_entry, [[Ok, ToDiagonal, NotMeasured], [ToDiagonal, NotReached, Ok]]);
        // An absolute tolerance of 0.1 is met by all entries but one and two.
        let absolute = EntryStatus::of(&matrix, (1e-2, 10.0), Target::Matrix);
        assert_eq!(absolute, [[Ok, Ok, NotReached], [Ok, NotReached, Ok]]);
    }
}

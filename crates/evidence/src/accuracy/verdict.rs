//! Compares the solver's choice of grid with the fastest grid of the table.

use super::reference::{Honesty, Reference};
use super::run::{Choice, Kind, Run};

/// The largest time of a good choice of the solver, over that of the fastest grid.
pub const ALLOWED: f64 = 1.5;

/// The comparison of the solver's choice with the fastest grid at one tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The index of the run with the solver's choice.
    pub chosen: usize,
    /// The index of the fastest run of the table that meets the tolerance.
    pub best: usize,
    /// The seconds of the run `chosen` over those of the run `best`.
    pub ratio: f64,
}

impl Verdict {
    /// The verdict on the run with the index `chosen`; `None` if its grid is not the solver's choice, or
    /// nothing in the table meets its tolerance.
    ///
    /// A grid whose error estimate the reference shows to be too low does not count as meeting its tolerance.
    pub(super) fn of(runs: &[Run], chosen: usize, reference: Option<&Reference>) -> Option<Self> {
        let run = runs.get(chosen).filter(|run| run.choice == Choice::Own)?;
        let best = fastest(runs, run.kind, run.tolerance?, reference)?;
        let ratio = run.found()?.seconds / runs.get(best)?.found()?.seconds;
        Some(Self { chosen, best, ratio })
    }

    /// Whether the choice is good.
    pub fn is_good(&self) -> bool {
        self.ratio <= ALLOWED
    }
}

/// The fastest run of the table that meets a tolerance.
pub(super) fn fastest(
    runs: &[Run],
    kind: Kind,
    tolerance: f64,
    reference: Option<&Reference>,
) -> Option<usize> {
    let too_low = |run: &Run| {
        let judged = reference.zip(run.found().filter(|_| run.kind == Kind::Estimate));
        judged.is_some_and(|(r, f)| r.judge(f.value.value, f.value.relative_error()) == Honesty::TooLow)
    };
    let meets =
        |run: &Run| run.choice == Choice::Table && run.kind == kind && run.meets(tolerance) && !too_low(run);
    let timed = runs.iter().enumerate().filter(|(_, run)| meets(run));
    timed
        .filter_map(|(i, run)| Some((i, run.found()?.seconds)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use elastocap_electrostatics::Bounded;

    use super::*;
    use crate::accuracy::run::{Missing, Solved};

    fn run(kind: Kind, choice: Choice, seconds: f64, reported_error: f64) -> Run {
        let value =
            Bounded { value: 1.0, lower: 1.0 - 0.5 * reported_error, upper: 1.0 + 0.5 * reported_error };
        let found = Solved { level: None, unknowns: None, seconds, repeats: 1, value, reported_error };
        Run { kind, choice, tolerance: Some(1e-3), outcome: Ok(found) }
    }

    #[test]
    fn the_own_choice_is_compared_with_the_fastest_of_its_kind_that_meets_its_tolerance() {
        let runs = [
            run(Kind::Bounds, Choice::Own, 0.3, 0.8e-3),
            run(Kind::Bounds, Choice::Table, 0.1, 2e-3),   // misses
            run(Kind::Estimate, Choice::Table, 0.1, 1e-4), // another kind
            run(Kind::Bounds, Choice::Table, 0.25, 1e-3),
            run(Kind::Bounds, Choice::Table, 0.4, 1e-5),
            run(Kind::Bounds, Choice::Own, 0.01, 1e-5), // no fixed grid
        ];
        let verdict = Verdict::of(&runs, 0, None).unwrap();
        assert_eq!((verdict.best, verdict.is_good()), (3, true));
        assert!((verdict.ratio - 1.2).abs() < 1e-12);
        assert_eq!(Verdict::of(&runs, 3, None), None);
    }

    #[test]
    fn a_choice_that_takes_more_than_half_as_long_again_is_not_good() {
        let runs =
            [run(Kind::Estimate, Choice::Own, 0.31, 1e-3), run(Kind::Estimate, Choice::Table, 0.2, 1e-3)];
        assert!(!Verdict::of(&runs, 0, None).unwrap().is_good());
    }

    #[test]
    fn a_grid_whose_estimate_is_too_low_is_no_competitor() {
        let runs =
            [run(Kind::Estimate, Choice::Own, 0.3, 1e-3), run(Kind::Estimate, Choice::Table, 0.1, 1e-4)];
        let far = Reference { lower: 1.01, upper: 1.0100001, intervals: 1 };
        assert!(Verdict::of(&runs, 0, None).is_some());
        assert_eq!(Verdict::of(&runs, 0, Some(&far)), None);
    }

    #[test]
    fn where_nothing_meets_the_tolerance_there_is_no_verdict() {
        let missing = Run::missing(Kind::Bounds, Choice::Own, 1e-3, Missing::NotRun);
        let runs =
            [run(Kind::Bounds, Choice::Own, 0.3, 1e-3), run(Kind::Bounds, Choice::Table, 0.2, 2e-3), missing];
        assert_eq!(Verdict::of(&runs, 0, None), None);
        assert_eq!(Verdict::of(&runs, 2, None), None);
    }
}

//! The change of the capacitance from the first load step: its bounds, and the repeated solves that tighten
//! them to a tolerance.
//!
//! The lower bound of a change is the lower bound of the step less the upper bound of the first step; the
//! upper bound, the reverse. A change of 7.5e-4 C known to one hundredth therefore needs the bounds of both
//! states to about 1e-6 C. The tolerance that a step needs follows from the size of its change. So all steps
//! are solved to the tolerance of the capacitance first; steps whose change is not known well enough are then
//! solved again, to a tolerance derived from the results of all steps. These tolerances depend on the case
//! alone, so that a run gives the same numbers at any number of threads and after it was interrupted and
//! resumed.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use elastocap_case::Case;
use elastocap_electrostatics::{Bounded, Foresight, SolveError};

use crate::common_base::{CommonBase, Purposes};
use crate::failure::StepFailure;
use crate::finished::FinishedStep;
use crate::outcome::{Missed, Status, StepResult, StepSeconds};
use crate::plan::PlannedStep;
use crate::reason::{Cause, Unsharpened, WideChange};
use crate::route_change::{NoBase, RouteChange};
use crate::settings::NO_CHANGE;
use crate::side_by_side::side_by_side;
use crate::step::{ACCEPTED, Sharper, Solver};

/// Largest number of rounds in which steps are solved again. A change whose sign the bounds leave open is
/// resolved in one round, and meets the tolerance in the next.
const MAX_ROUNDS: usize = 4;

/// Largest share of the spread wanted for the smallest change that the first step may take. Tuned: time the
/// runs of docs/change.md, section "Reach".
const SHARE: f64 = 0.45;

/// The share of the spread wanted for a change that its two states may take together. The rest is a margin
/// for changes that turn out smaller than they were estimated.
const TOGETHER: f64 = 2.0 * SHARE;

/// The least share of the wanted spread that a step is given where the first step cannot be tightened. Where
/// the first step leaves less, it is the reason that the change is not known. It is not tuned.
const LEAST: f64 = 0.1;

/// Steps whose largest problem had more unknowns are solved again one after the other. Tuned: time the runs
/// of docs/change.md, section "Reach".
const LARGE: usize = 1_000_000;

/// Smallest size that is assumed for a change whose bounds include zero, relative to half their spread. The
/// middle of two bounds is usually ten times nearer to the true value than they are. Tuned: time the runs of
/// docs/change.md, section "Reach".
const HIDDEN: f64 = 0.1;

/// The bounds on the capacitance of a step, F.
#[derive(Debug, Clone, Copy)]
struct State {
    measured: Bounded,
    /// The number of the [`CommonBase`] that the field was added to, and the capacitance plus the error of
    /// this base, which cancels in differences of steps on the same base.
    with_error_of_base: Option<(usize, Bounded)>,
}

impl State {
    fn of(step: &StepResult) -> Option<Self> {
        let with_error_of_base = step.with_error_of_base;
        step.measured.map(|measured| Self { measured, with_error_of_base })
    }

    /// The bounds of this state and of another one from which their difference is taken: those with the error
    /// of a base where both states were added to the same base and these bounds are closer together.
    fn beside(&self, other: &Self) -> [Bounded; 2] {
        let measured = [self.measured, other.measured];
        match (self.with_error_of_base, other.with_error_of_base) {
            (Some((base, first)), Some((other_base, second))) if base == other_base => {
                let is_closer = spread(&first) + spread(&second) < measured.iter().map(spread).sum();
                if is_closer { [first, second] } else { measured }
            }
            _ => measured,
        }
    }
}

/// The spread aimed for where the bounds of a change include zero, over the spread that its assumed size
/// requires: the change may turn out smaller. Tuned: time the runs of docs/change.md, section "Reach".
const UNSURE: f64 = 0.85;

/// The change from `first` to `other`, F. Its bounds are those of the two states, rounded outwards.
fn change(first: &Bounded, other: &Bounded) -> Bounded {
    Bounded {
        value: other.value - first.value,
        lower: (other.lower - first.upper).next_down(),
        upper: (other.upper - first.lower).next_up(),
    }
}

fn spread(bounded: &Bounded) -> f64 {
    bounded.upper - bounded.lower
}

/// Whether the change from `first` to `other` is known to `tolerance`, or known to be none.
fn is_known(tolerance: f64, first: &Bounded, other: &Bounded) -> bool {
    let change = change(first, other);
    spread(&change) <= tolerance * change.value.abs()
        || (change.holds_zero() && spread(&change) <= NO_CHANGE * first.value.abs())
}

/// The spread wanted for the bounds of the change, F, from what is known of its size.
fn goal(tolerance: f64, first: &Bounded, other: &Bounded) -> f64 {
    let change = change(first, other);
    if change.holds_zero() {
        let size = change.value.abs().max(0.5 * HIDDEN * spread(&change));
        (UNSURE * tolerance * size).max(NO_CHANGE * first.value.abs())
    } else {
        tolerance * change.value.abs()
    }
}

/// The largest spreads of the first step and of the other steps, F, with which the changes of the others meet
/// these goals; `None` for a step that the first one leaves too little. The bounds of the first step are
/// `first` apart, and cannot be tightened if it is `exhausted`.
fn spreads(first: f64, exhausted: bool, goals: &[f64]) -> (f64, Vec<Option<f64>>) {
    let most = SHARE * goals.iter().copied().fold(f64::INFINITY, f64::min);
    let spread_left = |goal: &f64| {
        if exhausted {
            let left = TOGETHER * goal - first;
            return (left >= LEAST * goal).then_some(left);
        }
        Some(TOGETHER * goal - first.min(most))
    };
    (most, goals.iter().map(spread_left).collect())
}

/// Writes the changes to the rows of a curve, replacing earlier values.
pub(crate) fn note_changes(case: &Case, steps: &mut [StepResult]) {
    let first = steps.first().map(|step| (step.index, step.load, State::of(step)));
    for step in &mut *steps {
        let state = State::of(step);
        let row = &mut step.row;
        [row.change_f, row.change_lower_f, row.change_upper_f, row.change_relative] = [None; 4];
        let Some((index, load, Some(first))) = first.filter(|_| case.load.is_some()) else { continue };
        let Some(state) = state else { continue };
        let is_same = step.index == index
            || step.same_as == Some(index)
            || (step.load == load && case.poses.get(step.index) == case.poses.get(index));
        let none = Bounded { value: 0.0, lower: 0.0, upper: 0.0 };
        let [from, to] = first.beside(&state);
        let change = if is_same { none } else { change(&from, &to) };
        row.change_f = Some(change.value);
        row.change_lower_f = Some(change.lower);
        row.change_upper_f = Some(change.upper);
        row.change_relative = Some(change.value / first.measured.value).filter(|share| share.is_finite());
    }
}

/// The repeated solves of a run whose case asks for the change to a tolerance.
pub(crate) struct ChangeSearch<'a> {
    pub(crate) solver: &'a Solver<'a>,
    /// The distinct steps of the plan. Changes are measured from the first of them.
    pub(crate) work: &'a [&'a PlannedStep],
    /// Number of steps that are solved at the same time.
    pub(crate) at_once: usize,
    /// Memory limit of all steps that are solved at the same time, bytes.
    pub(crate) memory_limit: u64,
    pub(crate) cancel: &'a AtomicBool,
    /// Largest spread of the bounds of a change, over the change.
    pub(crate) tolerance: f64,
    /// Called with the number of repeated steps that are done, and with the number of all steps that are
    /// repeated.
    pub(crate) report: &'a (dyn Fn(usize, usize) + Sync),
}

/// For each step of the plan, the reason that its bounds cannot be tightened; `None` for a step that was not
/// tried, or met its tolerance.
type Exhausted = Vec<Option<Unsharpened>>;

impl ChangeSearch<'_> {
    /// Solves again the steps whose change is not known to the tolerance, and marks those that still miss it.
    /// `found` holds the results to the tolerance of the capacitance.
    pub(crate) fn run(&self, found: &mut [Option<StepResult>]) {
        for step in found.iter_mut().flatten() {
            step.before_change = FinishedStep::of(step).map(Box::new);
        }
        let before: Vec<Option<Bounded>> = found.iter().map(|step| step.as_ref()?.measured).collect();
        let mut exhausted: Exhausted = found.iter().map(|step| without_tolerance(step.as_ref()?)).collect();
        // The error of a base cancels in changes only while every step that is solved again is added to this
        // base.
        let mut differences = true;
        for number in 0..MAX_ROUNDS {
            let mut wanted = self.wanted(found, &exhausted, false);
            if wanted.is_empty() || self.cancel.load(Ordering::Relaxed) {
                break;
            }
            let (at_once, memory_limit) = self.shares(found);
            let least = wanted.iter().map(|(_, tolerance)| *tolerance).fold(f64::INFINITY, f64::min);
            let known: Vec<Bounded> = found.iter().flatten().filter_map(|step| step.measured).collect();
            let in_contact = |(place, _): &(usize, f64)| {
                self.work.get(*place).is_none_or(|step| step.pose.distance <= 0.0)
            };
            let purposes = Purposes { number, differences: differences && !wanted.iter().any(in_contact) };
            let base = match self.work.first() {
                Some(step) => self.solver.common_base(step, least, memory_limit, &known, purposes),
                None => Ok(None),
            };
            let (base, without_base) = match base {
                Ok(base) => (base, None),
                Err(NoBase::Solve(SolveError::Cancelled)) => break,
                Err(NoBase::Solve(error)) if error.is_contradiction() => {
                    for (place, _) in &wanted {
                        if let Some(Some(step)) = found.get_mut(*place) {
                            step.fail(StepFailure::Field(error.clone()));
                        }
                    }
                    break;
                }
                Err(why) => (None, Some(RouteChange::WithoutBase(why))),
            };
            let cancels = base.as_ref().is_some_and(CommonBase::cancels);
            if cancels {
                wanted = self.wanted(found, &exhausted, true);
            }
            let foreseen: Vec<Option<Foresight>> = wanted
                .iter()
                .map(|(place, _)| found.get(*place).and_then(Option::as_ref).and_then(|step| step.foresight))
                .collect();
            let done = AtomicUsize::new(0);
            let again = side_by_side(at_once, wanted.len(), self.cancel, |k| {
                (self.report)(done.load(Ordering::Relaxed), wanted.len());
                let (place, tolerance) = wanted.get(k)?;
                let sharper =
                    Sharper { relative_tolerance: *tolerance, memory_limit, foresight: *foreseen.get(k)? };
                let again = self.solver.solve_to(self.work.get(*place)?, sharper, base.as_ref());
                (self.report)(1 + done.fetch_add(1, Ordering::Relaxed), wanted.len());
                Some(again)
            });
            for ((place, _), again) in wanted.iter().zip(again) {
                let (Some(Some(step)), Some(Some(mut again))) = (found.get_mut(*place), again) else {
                    continue;
                };
                if let Some(why) = exhausted.get_mut(*place) {
                    *why = without_tolerance(&again);
                }
                if let Some(defect) = again.row.status.defect() {
                    step.fail(defect.clone());
                    continue;
                }
                differences &= !cancels || again.with_error_of_base.is_some();
                again.route_changes.extend(without_base.clone());
                step.take_sharper(again);
            }
        }
        self.look_at_coarser_meshes(found, &before);
        self.mark(found, &exhausted);
    }

    /// The number of steps that are solved again at the same time, and the memory limit of each, bytes. A
    /// large step keeps all cores busy, and is given all of the memory.
    fn shares(&self, found: &[Option<StepResult>]) -> (usize, u64) {
        let unknowns = found.iter().flatten().filter_map(|step| step.row.unknowns);
        if unknowns.max() > Some(LARGE) {
            (1, self.memory_limit)
        } else {
            (self.at_once, self.solver.settings.memory_limit)
        }
    }

    /// The places of the steps to be solved again, with the relative tolerance of each: those whose bounds
    /// are too wide. With `all`, the error of a base is disregarded, and every step is included whose
    /// capacitance alone does not give the change.
    fn wanted(&self, found: &[Option<StepResult>], exhausted: &Exhausted, all: bool) -> Vec<(usize, f64)> {
        let Some(first) = state(found, 0) else { return Vec::new() };
        let is_exhausted = |place: usize| exhausted.get(place).is_none_or(Option::is_some);
        let goal_of = |place: usize| {
            let other = state(found, place)?;
            let [from, to] = if all { [first.measured, other.measured] } else { first.beside(&other) };
            if is_known(self.tolerance, &from, &to) {
                return None;
            }
            let [from, to] = first.beside(&other);
            let goal = goal(self.tolerance, &from, &to);
            let is_lost = |place: usize, state: &Bounded| is_exhausted(place) && spread(state) > goal;
            (!is_lost(0, &from) && !is_lost(place, &to)).then_some((place, [from, to], goal))
        };
        let states: Vec<_> = (1..found.len()).filter_map(goal_of).collect();
        let goals: Vec<f64> = states.iter().map(|(_, _, goal)| *goal).collect();
        let Some(from) = states.iter().map(|(_, [from, _], _)| *from).reduce(wider) else {
            return Vec::new();
        };
        let (of_first, of_others) = spreads(spread(&from), is_exhausted(0), &goals);
        let others = states
            .into_iter()
            .zip(of_others)
            .filter_map(|((place, [_, other], _), most)| Some((place, other, most?)));
        let too_wide = std::iter::once((0, from, of_first)).chain(others).filter(|(place, state, most)| {
            !is_exhausted(*place) && (all || spread(state) > ACCEPTED * *most)
        });
        too_wide.map(|(place, state, most)| (place, most / state.value.abs())).collect()
    }

    /// The largest error, F, that the bounds of a state may leave out: the uncertainty that its change may
    /// have.
    fn allowed(&self, from: &Bounded, to: &Bounded) -> f64 {
        (self.tolerance * change(from, to).value.abs()).max(NO_CHANGE * from.value.abs())
    }

    /// Replaces the estimated error of the mechanics where it exceeds what a change allows: by the error of
    /// the capacitance that a coarser mesh of the layer shows. `before` holds the capacitances from before
    /// the repeated solves.
    fn look_at_coarser_meshes(&self, found: &mut [Option<StepResult>], before: &[Option<Bounded>]) {
        let Some(first) = state(found, 0) else { return };
        let is_wanted = |place: usize| {
            let (other, step) = (state(found, place)?, found.get(place)?.as_ref()?);
            let [from, to] = first.beside(&other);
            let error = step.row.mechanics_error_estimate? * to.value.abs();
            let is_spoilt = is_known(self.tolerance, &from, &to) && error > self.allowed(&from, &to);
            (is_spoilt && !step.mechanics_by_capacitance).then_some(place)
        };
        let wanted: Vec<usize> = (1..found.len()).filter_map(is_wanted).collect();
        let steps = &*found;
        let errors = side_by_side(self.at_once, wanted.len(), self.cancel, |k| {
            let place = *wanted.get(k)?;
            let (step, before) = (steps.get(place)?.as_ref()?, (*before.get(place)?)?);
            let mut spent = StepSeconds::default();
            let planned = self.work.get(place)?;
            let error = self.solver.error_of_capacitance(planned, step, before.value, &mut spent);
            Some((error, spent))
        });
        for (place, error) in wanted.into_iter().zip(errors) {
            let (Some(Some(step)), Some(Some((error, spent)))) = (found.get_mut(place), error) else {
                continue;
            };
            step.seconds.electrostatics = step.seconds.electrostatics.plus(&spent.electrostatics);
            step.seconds.total += spent.total;
            match error {
                Ok(Some(error)) => {
                    step.row.mechanics_error_estimate = Some(error);
                    step.mechanics_by_capacitance = true;
                }
                Ok(None) => {}
                Err(defect) => step.fail(*defect),
            }
        }
    }

    /// Marks the steps whose change is not known to the tolerance.
    fn mark(&self, found: &mut [Option<StepResult>], exhausted: &Exhausted) {
        let first = state(found, 0);
        let first_geometry =
            found.first().and_then(Option::as_ref).and_then(|s| s.row.geometry_error_estimate);
        let why_first = exhausted.first().and_then(Option::as_ref);
        for (place, step) in found.iter_mut().enumerate().skip(1) {
            let Some(step) = step else { continue };
            let Some(state) = State::of(step) else { continue };
            let Some(first) = first else {
                step.miss(Cause::NoFirstCapacitance);
                continue;
            };
            let [from, to] = first.beside(&state);
            let change = change(&from, &to);
            if !is_known(self.tolerance, &from, &to) {
                let why = exhausted.get(place).and_then(Option::as_ref).or(why_first);
                let stopped = self.cancel.load(Ordering::Relaxed);
                let why = if stopped { Some(Unsharpened::Stopped) } else { why.cloned() };
                step.interrupted |= stopped;
                step.miss(Cause::Change(WideChange { change, asked: self.tolerance, why }));
                continue;
            }
            // Errors outside the bounds of the states are outside the bounds of the change, too.
            let allowed = self.allowed(&from, &to);
            let geometry = step.row.geometry_error_estimate.unwrap_or(0.0) * to.value.abs()
                + first_geometry.unwrap_or(0.0) * from.value.abs();
            let mechanics = step.row.mechanics_error_estimate.unwrap_or(0.0) * to.value.abs();
            // The error of the capacitance on a coarser mesh may be smaller, but was not computed.
            step.interrupted |=
                mechanics > allowed && !step.mechanics_by_capacitance && self.cancel.load(Ordering::Relaxed);
            for (error, missed, what) in [
                (mechanics, Missed::Mechanics, "the finite elements of the layer leave"),
                (geometry, Missed::Geometry, "faces and polynomials in place of the bodies leave"),
            ] {
                if error > allowed {
                    let (change, asked) = (change.value, self.tolerance);
                    step.miss(Cause::ErrorOfChange { missed, what, error, change, asked });
                }
            }
        }
    }
}

fn state(found: &[Option<StepResult>], place: usize) -> Option<State> {
    State::of(found.get(place)?.as_ref()?)
}

fn wider(one: Bounded, other: Bounded) -> Bounded {
    if spread(&one) >= spread(&other) { one } else { other }
}

/// The reason that the field of a step misses its tolerance; `None` if it meets it.
fn without_tolerance(step: &StepResult) -> Option<Unsharpened> {
    match &step.row.status {
        Status::ToleranceNotReached(Missed::Field) | Status::Failed(_) | Status::Draft | Status::NotRun => {
            Some(step.reason.clone().map_or(Unsharpened::NotSolved, Unsharpened::Solve))
        }
        Status::ToleranceNotReached(Missed::Change | Missed::Mechanics | Missed::Geometry)
        | Status::Ok
        | Status::OkToDiagonal
        | Status::OkInModel
        | Status::BeyondForceLimit => None,
    }
}

impl StepResult {
    /// Takes over the results of the field from `again` where its bounds are closer together. Status, layer
    /// and bodies stay unchanged.
    fn take_sharper(&mut self, again: Self) {
        self.seconds.electrostatics = self.seconds.electrostatics.plus(&again.seconds.electrostatics);
        self.seconds.total += again.seconds.total;
        let (Some(before), Some(now)) = (self.measured, again.measured) else { return };
        self.with_error_of_base = again.with_error_of_base.or(self.with_error_of_base);
        if spread(&now) >= spread(&before) {
            return;
        }
        let row = &mut self.row;
        row.two_terminal_capacitance_f = again.row.two_terminal_capacitance_f;
        row.capacitance_f = again.row.capacitance_f;
        row.capacitance_lower_f = again.row.capacitance_lower_f;
        row.capacitance_upper_f = again.row.capacitance_upper_f;
        row.relative_error_estimate = again.row.relative_error_estimate;
        row.geometry_error_estimate = again.row.geometry_error_estimate;
        row.fringe_ratio = again.row.fringe_ratio;
        row.unknowns = again.row.unknowns;
        self.route = again.route;
        self.route_changes = again.route_changes;
        self.warnings = again.warnings;
        self.measured = again.measured;
        self.two_terminal = again.two_terminal;
        // A solve for the capacitance alone has no matrix; the earlier one is kept.
        if again.maxwell.is_some() {
            self.maxwell = again.maxwell;
            self.entry_status = again.entry_status;
            self.floating = again.floating;
        }
        self.solver = again.solver;
        self.foresight = again.foresight;
    }

    /// Marks that the change misses its tolerance. A more severe status of the step takes precedence.
    fn miss(&mut self, cause: Cause) {
        match (&self.row.status, cause.missed()) {
            (
                Status::Ok | Status::OkToDiagonal | Status::OkInModel | Status::BeyondForceLimit,
                Some(missed),
            ) => {
                self.row.status = Status::ToleranceNotReached(missed);
            }
            (Status::Ok | Status::OkToDiagonal | Status::OkInModel | Status::BeyondForceLimit, None)
            | (Status::ToleranceNotReached(_), _) => {}
            (Status::Failed(_) | Status::Draft | Status::NotRun, _) => return,
        }
        match &mut self.reason {
            Some(reason) => reason.push(cause),
            none => *none = Some(cause.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounded(value: f64, half: f64) -> Bounded {
        Bounded { value, lower: value - half, upper: value + half }
    }

    #[test]
    fn a_change_lies_between_the_bounds_of_both_states() {
        let found = change(&bounded(10.0, 0.25), &bounded(12.0, 0.5));
        assert_eq!(found.value, 2.0);
        assert!(found.lower <= 1.25 && 2.75 <= found.upper, "{found:?}");
        assert!(found.lower > 1.2499 && found.upper < 2.7501, "{found:?}");
        // The true change is inside for any true values within the bounds of the states.
        for (first, other) in [(9.75, 12.5), (10.25, 11.5), (9.8, 11.6)] {
            assert!(found.lower <= other - first && other - first <= found.upper);
        }
    }

    #[test]
    fn the_error_of_a_base_counts_where_both_states_have_the_same_and_are_closer_with_it() {
        let state =
            |measured: Bounded, base: Option<(usize, Bounded)>| State { measured, with_error_of_base: base };
        let (sharp, wide) = (bounded(10.01, 0.01), bounded(10.0, 0.1));
        let with_base = |number: usize, with: Bounded| state(wide, Some((number, with)));
        let pair = |a: State, b: State| a.beside(&b);
        assert_eq!(pair(with_base(0, sharp), with_base(0, sharp)), [sharp, sharp]);
        assert_eq!(pair(with_base(0, sharp), with_base(1, sharp)), [wide, wide]);
        assert_eq!(pair(with_base(0, sharp), state(wide, None)), [wide, wide]);
        assert_eq!(pair(with_base(0, sharp), with_base(0, bounded(10.0, 0.3))), [wide, wide]);
    }

    #[test]
    fn a_change_is_known_to_a_share_of_itself_or_known_to_be_none() {
        let first = bounded(10.0, 1e-6);
        assert!(is_known(1e-2, &first, &bounded(10.01, 4.8e-5)));
        assert!(!is_known(1e-2, &first, &bounded(10.01, 5.1e-5)));
        assert!(is_known(1e-2, &first, &bounded(10.0 + 1e-7, 3.9e-6)));
        assert!(!is_known(1e-2, &first, &bounded(10.0 + 1e-7, 4.1e-6)));
        // Bounds that exclude zero do not count as no change, however small.
        assert!(!is_known(1e-2, &first, &bounded(10.0 + 8e-6, 3.9e-6)));
    }

    #[test]
    fn a_larger_change_leaves_its_state_more_and_no_state_is_solved_in_vain() {
        let goals = [1.0, 4.0];
        // The first step is solved again, or is sharp enough already.
        assert_eq!(spreads(3.0, false, &goals), (SHARE, vec![Some(SHARE), Some(TOGETHER * 4.0 - SHARE)]));
        let (_, others) = spreads(0.125, false, &goals);
        assert_eq!(others, [Some(TOGETHER - 0.125), Some(TOGETHER * 4.0 - 0.125)]);
        // The bounds of the first step get no closer. What they leave is enough for the larger change, but
        // not for the smaller one.
        for first in [0.85, 0.95] {
            let (_, others) = spreads(first, true, &goals);
            assert!(others[0].is_none() && others[1].is_some_and(|other| first + other < 4.0), "{others:?}");
        }
        let (_, others) = spreads(0.5, true, &goals);
        let is_known =
            |(other, goal): (&Option<f64>, f64)| other.is_some_and(|other| other > 0.0 && 0.5 + other < goal);
        assert!(others.iter().zip(goals).all(is_known), "{others:?}");
    }

    #[test]
    fn bounds_that_meet_their_shares_of_the_goal_make_the_change_known() {
        for (first, other) in [(10.0, 10.0075), (10.0, 10.0), (3.0, 2.0), (1e-14, 1.000_01e-14)] {
            let (rough, rougher) = (bounded(first, 5e-4 * first), bounded(other, 5e-4 * other));
            let wanted = goal(1e-2, &rough, &rougher);
            let half = 0.5 * SHARE * wanted;
            let (sharp, sharper) = (bounded(first, half), bounded(other, half));
            let next = goal(1e-2, &sharp, &sharper);
            let is_met = is_known(1e-2, &sharp, &sharper);
            assert!(is_met || next < wanted, "{first} {other}: {wanted:e}, then {next:e}");
        }
    }
}

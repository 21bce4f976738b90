//! The change of the capacitance against the first load step: its bounds, and steps that are solved again until they are close enough.
//!
//! The change lies between the lower bound of the step less the upper one of the first step, and the upper bound less the lower one. A
//! signal of 7.5e-4 of C takes bounds of both states to some 1e-6 of C for one hundredth of itself. How close they must be is known only
//! when the change is, roughly: all steps are solved to the tolerance of the capacitance first, and those whose change is known less well
//! than asked for are solved again, to a tolerance that follows from what all steps have found. It depends on the case alone, so that a run
//! gives the same numbers at any number of threads, and after it was stopped and resumed.

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
use crate::side_by_side::side_by_side;
use crate::step::{ACCEPTED, Sharper, Solver};

/// A change whose bounds hold zero is known to be none where they are at most this far apart, over the capacitance of the first step.
pub const NO_CHANGE: f64 = 1e-6;

/// How often steps are solved again, at most: a change that was hidden in its bounds is seen one round, and met the next.
const MAX_ROUNDS: usize = 4;

/// Share of the distance between the bounds of the smallest change that the first step may take.
const SHARE: f64 = 0.45;

/// The share of the distance wanted between the bounds of a change that its two states may take together. The rest is for a change that turns
/// out smaller than it was taken for.
const TOGETHER: f64 = 2.0 * SHARE;

/// The least share of a step whose first step gets no sharper: where that takes more, it is what the change is not known for.
const LEAST: f64 = 0.1;

/// Steps whose largest problem had more unknowns are solved again one after the other.
const LARGE: usize = 1_000_000;

/// The least size that is assumed for a change whose bounds have zero between them, relative to half the distance between these bounds. The
/// middle of two bounds is usually ten times nearer to the truth than they are.
const HIDDEN: f64 = 0.1;

/// The capacitance of a step, as far as it is known.
#[derive(Debug, Clone, Copy)]
struct State {
    measured: Bounded,
    with_error_of_base: Option<(usize, Bounded)>,
}

impl State {
    fn of(step: &StepResult) -> Option<Self> {
        let with_error_of_base = step.with_error_of_base;
        step.measured.map(|measured| Self { measured, with_error_of_base })
    }

    /// Its capacitance and that of another step, whose difference is their change: with the error of a base, where it is the same for both
    /// and they are closer then.
    fn beside(&self, other: &Self) -> [Bounded; 2] {
        let measured = [self.measured, other.measured];
        match (self.with_error_of_base, other.with_error_of_base) {
            (Some((base, own)), Some((of, other))) if base == of => {
                let is_closer = spread(&own) + spread(&other) < measured.iter().map(spread).sum();
                if is_closer { [own, other] } else { measured }
            }
            _ => measured,
        }
    }
}

/// The distance between the bounds aimed for where a change is hidden, over the distance that its assumed size asks for: the change may turn
/// out to be smaller.
const UNSURE: f64 = 0.85;

/// The change from `first` to `own`, F. Its bounds are those of the two states, rounded outwards.
fn change(first: &Bounded, own: &Bounded) -> Bounded {
    Bounded {
        value: own.value - first.value,
        lower: (own.lower - first.upper).next_down(),
        upper: (own.upper - first.lower).next_up(),
    }
}

fn spread(bounded: &Bounded) -> f64 {
    bounded.upper - bounded.lower
}

/// Whether the change from `first` to `own` is known to `tolerance`, or known to be none.
fn is_known(tolerance: f64, first: &Bounded, own: &Bounded) -> bool {
    let change = change(first, own);
    spread(&change) <= tolerance * change.value.abs()
        || (change.holds_zero() && spread(&change) <= NO_CHANGE * first.value.abs())
}

/// How far the bounds of the change should be apart, F, for all that is known of it.
fn goal(tolerance: f64, first: &Bounded, own: &Bounded) -> f64 {
    let change = change(first, own);
    if change.holds_zero() {
        let size = change.value.abs().max(0.5 * HIDDEN * spread(&change));
        (UNSURE * tolerance * size).max(NO_CHANGE * first.value.abs())
    } else {
        tolerance * change.value.abs()
    }
}

/// How far the bounds of the first step and of the others may be apart, F, for the changes of the others to be known to these goals; none
/// for those that the first step leaves too little. Its bounds are `first` apart, and get no closer if it is `exhausted`.
fn spreads(first: f64, exhausted: bool, goals: &[f64]) -> (f64, Vec<Option<f64>>) {
    let most = SHARE * goals.iter().copied().fold(f64::INFINITY, f64::min);
    let of = |goal: &f64| {
        if exhausted {
            let left = TOGETHER * goal - first;
            return (left >= LEAST * goal).then_some(left);
        }
        Some(TOGETHER * goal - first.min(most))
    };
    (most, goals.iter().map(of).collect())
}

/// Notes the change in the rows of a curve, in place of what they had before.
pub(crate) fn note_changes(case: &Case, steps: &mut [StepResult]) {
    let first = steps.first().map(|step| (step.index, step.load, State::of(step)));
    for step in &mut *steps {
        let own = State::of(step);
        let row = &mut step.row;
        [row.change_f, row.change_lower_f, row.change_upper_f, row.change_relative] = [None; 4];
        let Some((index, load, Some(first))) = first.filter(|_| case.load.is_some()) else { continue };
        let Some(own) = own else { continue };
        let is_same = step.index == index
            || step.same_as == Some(index)
            || (step.load == load && case.poses.get(step.index) == case.poses.get(index));
        let none = Bounded { value: 0.0, lower: 0.0, upper: 0.0 };
        let [from, to] = first.beside(&own);
        let change = if is_same { none } else { change(&from, &to) };
        row.change_f = Some(change.value);
        row.change_lower_f = Some(change.lower);
        row.change_upper_f = Some(change.upper);
        row.change_relative = Some(change.value / first.measured.value).filter(|share| share.is_finite());
    }
}

/// The steps of a run that asks for the change to a tolerance.
pub(crate) struct ChangeSearch<'a> {
    pub(crate) solver: &'a Solver<'a>,
    /// The distinct steps of the plan. The first of them is the one that the others change against.
    pub(crate) work: &'a [&'a PlannedStep],
    /// Steps that are solved at the same time.
    pub(crate) at_once: usize,
    /// Memory that they may take together, bytes.
    pub(crate) memory_limit: u64,
    pub(crate) cancel: &'a AtomicBool,
    /// Largest distance between the bounds of a change, over the change.
    pub(crate) tolerance: f64,
    /// Is told how many of the steps that are being solved again are done, and how many they are.
    pub(crate) report: &'a (dyn Fn(usize, usize) + Sync),
}

/// Why a step cannot be solved more sharply, by the place of the step; `None` for one that was not tried, or met its tolerance.
type Exhausted = Vec<Option<Unsharpened>>;

impl ChangeSearch<'_> {
    /// Solves steps again whose change is not known to the tolerance, and marks those for which that does not help. `found` is what the
    /// steps gave that were solved to the tolerance of the capacitance.
    pub(crate) fn run(&self, found: &mut [Option<StepResult>]) {
        for step in found.iter_mut().flatten() {
            step.before_change = FinishedStep::of(step).map(Box::new);
        }
        let before: Vec<Option<Bounded>> = found.iter().map(|step| step.as_ref()?.measured).collect();
        let mut exhausted: Exhausted = found.iter().map(|step| without_tolerance(step.as_ref()?)).collect();
        // The error of a base cancels in changes as long as every step that is solved again is added to it.
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

    /// How many steps are solved again at the same time, and the memory that each may take, bytes. A large one keeps all cores busy alone,
    /// and has all of the memory then.
    fn shares(&self, found: &[Option<StepResult>]) -> (usize, u64) {
        let unknowns = found.iter().flatten().filter_map(|step| step.row.unknowns);
        if unknowns.max() > Some(LARGE) {
            (1, self.memory_limit)
        } else {
            (self.at_once, self.solver.settings.memory_limit)
        }
    }

    /// The places of the steps that are to be solved again, and the relative tolerance of each: those whose bounds are too wide, or, with
    /// `all`, all whose capacitances by themselves do not give the change.
    fn wanted(&self, found: &[Option<StepResult>], exhausted: &Exhausted, all: bool) -> Vec<(usize, f64)> {
        let Some(first) = state(found, 0) else { return Vec::new() };
        let is_exhausted = |place: usize| exhausted.get(place).is_none_or(Option::is_some);
        let goal_of = |place: usize| {
            let own = state(found, place)?;
            let [from, to] = if all { [first.measured, own.measured] } else { first.beside(&own) };
            if is_known(self.tolerance, &from, &to) {
                return None;
            }
            let [from, to] = first.beside(&own);
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
            .filter_map(|((place, [_, own], _), most)| Some((place, own, most?)));
        let too_wide = std::iter::once((0, from, of_first)).chain(others).filter(|(place, state, most)| {
            !is_exhausted(*place) && (all || spread(state) > ACCEPTED * *most)
        });
        too_wide.map(|(place, state, most)| (place, most / state.value.abs())).collect()
    }

    /// The largest error, F, that a state may have beyond its bounds: as much as the change of it may be uncertain by.
    fn allowed(&self, from: &Bounded, to: &Bounded) -> f64 {
        (self.tolerance * change(from, to).value.abs()).max(NO_CHANGE * from.value.abs())
    }

    /// Where distances in the layer leave more than a change may be uncertain by, takes the error that capacitances on coarser meshes of the
    /// layer leave instead: of those that the steps had `before` they were solved again.
    fn look_at_coarser_meshes(&self, found: &mut [Option<StepResult>], before: &[Option<Bounded>]) {
        let Some(first) = state(found, 0) else { return };
        let is_wanted = |place: usize| {
            let (own, step) = (state(found, place)?, found.get(place)?.as_ref()?);
            let [from, to] = first.beside(&own);
            let error = step.row.mechanics_error_estimate? * to.value.abs();
            let is_spoilt = is_known(self.tolerance, &from, &to) && error > self.allowed(&from, &to);
            (is_spoilt && !step.mechanics_by_capacitance).then_some(place)
        };
        let wanted: Vec<usize> = (1..found.len()).filter_map(is_wanted).collect();
        let steps = &*found;
        let looked = side_by_side(self.at_once, wanted.len(), self.cancel, |k| {
            let place = *wanted.get(k)?;
            let (step, before) = (steps.get(place)?.as_ref()?, (*before.get(place)?)?);
            let mut spent = StepSeconds::default();
            let planned = self.work.get(place)?;
            let error = self.solver.error_of_capacitance(planned, step, before.value, &mut spent);
            Some((error, spent))
        });
        for (place, looked) in wanted.into_iter().zip(looked) {
            let (Some(Some(step)), Some(Some((error, spent)))) = (found.get_mut(place), looked) else {
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
            let Some(own) = State::of(step) else { continue };
            let Some(first) = first else {
                step.miss(Cause::NoFirstCapacitance);
                continue;
            };
            let [from, to] = first.beside(&own);
            let change = change(&from, &to);
            if !is_known(self.tolerance, &from, &to) {
                let why = exhausted.get(place).and_then(Option::as_ref).or(why_first);
                let stopped = self.cancel.load(Ordering::Relaxed);
                let why = if stopped { Some(Unsharpened::Stopped) } else { why.cloned() };
                step.interrupted |= stopped;
                step.miss(Cause::Change(WideChange { change, asked: self.tolerance, why }));
                continue;
            }
            // What the bounds do not hold, they do not hold of the change either.
            let allowed = self.allowed(&from, &to);
            let geometry = step.row.geometry_error_estimate.unwrap_or(0.0) * to.value.abs()
                + first_geometry.unwrap_or(0.0) * from.value.abs();
            let mechanics = step.row.mechanics_error_estimate.unwrap_or(0.0) * to.value.abs();
            // The capacitance on coarser meshes may say less.
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

/// Why a step does not have the tolerance that its field was solved to; `None` if it has.
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
    /// Takes over what was found of the field where that is sharper. Status, layer and bodies stay as they are.
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
        // What a solve for the capacitance alone leaves out is known from before.
        if again.maxwell.is_some() {
            self.maxwell = again.maxwell;
            self.entry_status = again.entry_status;
            self.floating = again.floating;
        }
        self.solver = again.solver;
        self.foresight = again.foresight;
    }

    /// Notes that the change is not known to its tolerance. Where the step has another defect, its status says that one.
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
        // Whatever the two are within their bounds.
        for (first, own) in [(9.75, 12.5), (10.25, 11.5), (9.8, 11.6)] {
            assert!(found.lower <= own - first && own - first <= found.upper);
        }
    }

    #[test]
    fn the_error_of_a_base_counts_where_both_states_have_the_same_and_are_closer_with_it() {
        let state =
            |measured: Bounded, base: Option<(usize, Bounded)>| State { measured, with_error_of_base: base };
        let (sharp, wide) = (bounded(10.01, 0.01), bounded(10.0, 0.1));
        let own = |number: usize, with: Bounded| state(wide, Some((number, with)));
        let pair = |a: State, b: State| a.beside(&b);
        assert_eq!(pair(own(0, sharp), own(0, sharp)), [sharp, sharp]);
        assert_eq!(pair(own(0, sharp), own(1, sharp)), [wide, wide]);
        assert_eq!(pair(own(0, sharp), state(wide, None)), [wide, wide]);
        assert_eq!(pair(own(0, sharp), own(0, bounded(10.0, 0.3))), [wide, wide]);
    }

    #[test]
    fn a_change_is_known_to_a_share_of_itself_or_known_to_be_none() {
        let first = bounded(10.0, 1e-6);
        assert!(is_known(1e-2, &first, &bounded(10.01, 4.8e-5)));
        assert!(!is_known(1e-2, &first, &bounded(10.01, 5.1e-5)));
        assert!(is_known(1e-2, &first, &bounded(10.0 + 1e-7, 3.9e-6)));
        assert!(!is_known(1e-2, &first, &bounded(10.0 + 1e-7, 4.1e-6)));
        // Half of it away from zero it is small, but not none.
        assert!(!is_known(1e-2, &first, &bounded(10.0 + 8e-6, 3.9e-6)));
    }

    #[test]
    fn a_larger_change_leaves_its_state_more_and_no_state_is_solved_in_vain() {
        let goals = [1.0, 4.0];
        // The first step is solved again, or is sharp enough already.
        assert_eq!(spreads(3.0, false, &goals), (SHARE, vec![Some(SHARE), Some(TOGETHER * 4.0 - SHARE)]));
        let (_, others) = spreads(0.125, false, &goals);
        assert_eq!(others, [Some(TOGETHER - 0.125), Some(TOGETHER * 4.0 - 0.125)]);
        // The bounds of the first step get no closer. What they leave is enough for the larger change, but not for the smaller one.
        for first in [0.85, 0.95] {
            let (_, others) = spreads(first, true, &goals);
            assert!(others[0].is_none() && others[1].is_some_and(|own| first + own < 4.0), "{others:?}");
        }
        let (_, others) = spreads(0.5, true, &goals);
        let is_known =
            |(own, goal): (&Option<f64>, f64)| own.is_some_and(|own| own > 0.0 && 0.5 + own < goal);
        assert!(others.iter().zip(goals).all(is_known), "{others:?}");
    }

    #[test]
    fn bounds_that_meet_their_shares_of_the_goal_make_the_change_known() {
        for (first, own) in [(10.0, 10.0075), (10.0, 10.0), (3.0, 2.0), (1e-14, 1.000_01e-14)] {
            let (rough, rougher) = (bounded(first, 5e-4 * first), bounded(own, 5e-4 * own));
            let wanted = goal(1e-2, &rough, &rougher);
            let half = 0.5 * SHARE * wanted;
            let (sharp, sharper) = (bounded(first, half), bounded(own, half));
            let next = goal(1e-2, &sharp, &sharper);
            let is_met = is_known(1e-2, &sharp, &sharper);
            assert!(is_met || next < wanted, "{first} {own}: {wanted:e}, then {next:e}");
        }
    }
}

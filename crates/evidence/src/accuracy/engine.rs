//! Carries out a study: one stage for each tolerance and kind of error, within a given time.

use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use elastocap_electrostatics::ResolutionLevel;

use super::run::{Choice, Kind, Missing, Run};
use super::subject::Subject;
use super::verdict::fastest;
use super::walk::{LEVELS, ORDERS, Trial, walk};
use elastocap_coupling::failure::Stop;

/// The largest time of a stage, with the search over grids and the repeats, over that of the solver's choice.
/// Tuned: `elastocap accuracy cases/in-plane-pair.toml`.
const MOST: f64 = 40.0;
/// The least useful time of a stage, over that of the solver's choice. Tuned:
/// `elastocap accuracy cases/in-plane-pair.toml`.
const LEAST: f64 = 6.0;
/// The least time of a stage in seconds, however short its runs are. Tuned:
/// `elastocap accuracy cases/in-plane-pair.toml`.
const SHORTEST: f64 = 0.4;
/// The share of a stage for finding grids; the rest is for timing the best of them. Tuned:
/// `elastocap accuracy cases/in-plane-pair.toml`.
const SEARCH: f64 = 0.6;
/// The number of the fastest grids that are timed again, in turn with the solver's choice. Tuned:
/// `elastocap accuracy cases/in-plane-pair.toml`.
const CONTENDERS: usize = 4;
/// The share of the whole time for the finest grid, which only sharpens the reference. Tuned:
/// `elastocap accuracy cases/in-plane-pair.toml`.
const FOR_REFERENCE: f64 = 0.25;
/// The least and the largest number of timed solves on a grid.
const REPEATS: RangeInclusive<usize> = 2..=25;

/// One tolerance, with or without bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stage {
    tolerance: f64,
    bounds: bool,
}

/// A study in progress.
pub(super) struct Engine<'a> {
    pub(super) subject: &'a Subject,
    /// All solves so far, in their order.
    pub(super) runs: Vec<Run>,
    /// Set when the study is to stop.
    cancel: &'a AtomicBool,
    /// A callback that gets a description of each solve.
    report: &'a (dyn Fn(&str) + Sync),
    /// The time at which the study began.
    begun: Instant,
    /// The time for the whole study, s.
    seconds: f64,
    /// The time of the solver's choices over its forecast: with bounds, and without.
    scale: [f64; 2],
}

impl<'a> Engine<'a> {
    pub(super) fn new(
        subject: &'a Subject,
        seconds: f64,
        cancel: &'a AtomicBool,
        report: &'a (dyn Fn(&str) + Sync),
    ) -> Self {
        Self { subject, runs: Vec::new(), cancel, report, begun: Instant::now(), seconds, scale: [1.0; 2] }
    }

    /// Carries out the study, from coarse to fine.
    pub(super) fn study(&mut self, tolerances: &[f64]) {
        let _ = self.subject.solve(None, 0.1, true); // The first solve warms caches up.
        let stages: Vec<Stage> = tolerances
            .iter()
            .flat_map(|&tolerance| [true, false].map(|bounds| Stage { tolerance, bounds }))
            .collect();
        for (i, stage) in stages.iter().enumerate() {
            let expected = self.expected_seconds(stage);
            let left = (1.0 - FOR_REFERENCE) * self.seconds - self.elapsed();
            // Later stages that will not fit leave their time to the others.
            let mut ahead = 0.0;
            for seconds in stages[i..].iter().map(|s| self.expected_seconds(s)) {
                if LEAST * (ahead + seconds) <= left {
                    ahead += seconds;
                }
            }
            let share = left * (expected / ahead.max(expected));
            let missing = if self.stopped() {
                Some(Missing::NotRun)
            } else if left < LEAST * expected || left <= 0.0 {
                Some(Missing::LeftOut(expected))
            } else {
                None
            };
            match missing {
                Some(why) => {
                    let kind = Kind::of(stage.bounds);
                    self.runs.push(Run::missing(kind, Choice::Own, stage.tolerance, why));
                }
                None => self.carry_out(stage, share.min(MOST * expected).max(SHORTEST)),
            }
        }
        self.finest();
    }

    fn stopped(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    fn elapsed(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// The expected time of the solver's choice, s; infinite where it cannot be forecast.
    fn expected_seconds(&self, stage: &Stage) -> f64 {
        let forecast = self.subject.expected_seconds(None, stage.tolerance, stage.bounds);
        forecast.unwrap_or(f64::INFINITY) * self.scale[usize::from(!stage.bounds)]
    }

    /// Solves the solver's choice and the grids around it, then times the best of them in turn, within
    /// `share` seconds.
    fn carry_out(&mut self, stage: &Stage, share: f64) {
        let until = self.elapsed() + share;
        let Some(run) = self.solve(stage, None) else { return };
        let Some(found) = self.runs[run].found() else { return };
        let (seconds, start) = (found.seconds, found.level);
        if let Some(expected) = self.subject.expected_seconds(None, stage.tolerance, stage.bounds) {
            self.scale[usize::from(!stage.bounds)] = seconds / expected;
        }
        if let Some(start) = start {
            let room = self.best_room(stage, start);
            self.search(&room, stage.tolerance, start, until - (1.0 - SEARCH) * share);
            self.other_room(&room, stage.tolerance);
        }
        self.time_again(stage, run, until);
    }

    /// The stage whose tolerance gives the grids of this stage the best distance to the outer boundary.
    ///
    /// For a given grid that distance follows from the tolerance; the solver's choice adapts the distance
    /// together with the grid.
    fn best_room(&mut self, stage: &Stage, level: ResolutionLevel) -> Stage {
        let rooms = [10.0 * stage.tolerance, stage.tolerance, stage.tolerance / 10.0];
        let mut best: Option<(f64, Stage)> = None;
        for tolerance in rooms {
            let room = Stage { tolerance, ..*stage };
            let found = self.solve(&room, Some(level)).and_then(|run| self.runs[run].found());
            let sufficient =
                found.filter(|found| found.reported_error <= stage.tolerance).map(|found| found.seconds);
            if let Some(seconds) = sufficient.filter(|s| best.is_none_or(|(before, _)| *s < before)) {
                best = Some((seconds, room));
            }
        }
        best.map_or(Stage { tolerance: stage.tolerance / 10.0, ..*stage }, |(_, room)| room)
    }

    /// Tries the grids around the line where the tolerance is met, all with the same distance to the outer
    /// boundary.
    fn search(&mut self, stage: &Stage, tolerance: f64, start: ResolutionLevel, until: f64) {
        let subject = self.subject;
        let expected = |level| subject.expected_seconds(Some(level), stage.tolerance, stage.bounds);
        walk(start, tolerance, &expected, &mut |level| {
            if self.elapsed() > until {
                return None;
            }
            let run = self.solve(stage, Some(level))?;
            // A grid on which nothing can be solved meets no tolerance.
            let found = self.runs[run].found().map(|found| (found.seconds, found.reported_error));
            let (seconds, reported_error) = found.unwrap_or((f64::NAN, f64::INFINITY));
            Some(Trial { seconds, reported_error })
        });
    }

    /// Tries the best grid with a smaller distance to the outer boundary, and coarser ones with a larger one.
    fn other_room(&mut self, stage: &Stage, tolerance: f64) {
        let best = fastest(&self.runs, Kind::of(stage.bounds), tolerance, None);
        let Some(level) = best.and_then(|i| self.runs[i].found()).and_then(|found| found.level) else {
            return;
        };
        let less = Stage { tolerance: 10.0 * stage.tolerance, ..*stage };
        let more = Stage { tolerance: stage.tolerance / 10.0, ..*stage };
        self.solve(&less, Some(level));
        for at in [
            ResolutionLevel { order: level.order.saturating_sub(1).max(*ORDERS.start()), ..level },
            ResolutionLevel { levels: level.levels.saturating_sub(1).max(*LEVELS.start()), ..level },
        ] {
            self.solve(&more, Some(at));
        }
    }

    /// Times the solver's choice and the fastest grids in turn, so that other load on the machine affects all
    /// of them alike.
    fn time_again(&mut self, stage: &Stage, chosen: usize, until: f64) {
        let kind = Kind::of(stage.bounds);
        let competes =
            |run: &Run| run.choice == Choice::Table && run.kind == kind && run.meets(stage.tolerance);
        let timed = self.runs.iter().enumerate().filter(|(_, run)| competes(run));
        let mut best: Vec<(usize, f64)> =
            timed.filter_map(|(i, run)| Some((i, run.found()?.seconds))).collect();
        best.sort_by(|a, b| a.1.total_cmp(&b.1));
        best.truncate(CONTENDERS);
        for round in 1..*REPEATS.end() {
            if round >= *REPEATS.start() && self.elapsed() > until {
                return;
            }
            for i in std::iter::once(chosen).chain(best.iter().map(|(i, _)| *i)) {
                if self.stopped() {
                    return;
                }
                self.repeat(i, stage.bounds);
            }
        }
    }

    /// Times a run once more and keeps its shortest time.
    fn repeat(&mut self, index: usize, bounds: bool) {
        let run = &self.runs[index];
        let (Some(found), Some(tolerance)) = (run.found(), run.tolerance) else { return };
        let level = found.level.filter(|_| run.choice == Choice::Table);
        let Ok(again) = self.subject.solve(level, tolerance, bounds) else { return };
        if let Ok(found) = &mut self.runs[index].outcome {
            found.seconds = found.seconds.min(again.seconds);
            found.repeats += 1;
        }
    }

    /// Solves on a grid, unless that was done before. Returns the index of the run, or `None` if the study
    /// was stopped.
    fn solve(&mut self, stage: &Stage, level: Option<ResolutionLevel>) -> Option<usize> {
        let kind = Kind::of(stage.bounds);
        let choice = if level.is_some() { Choice::Table } else { Choice::Own };
        if self.stopped() {
            if choice == Choice::Own {
                self.runs.push(Run::missing(kind, choice, stage.tolerance, Missing::NotRun));
            }
            return None;
        }
        let is_same = |run: &Run| {
            (run.kind, run.choice, run.tolerance) == (kind, choice, Some(stage.tolerance))
                && run.found().is_some_and(|found| found.level == level)
        };
        if let Some(before) = self.runs.iter().position(is_same).filter(|_| level.is_some()) {
            return Some(before);
        }
        let what = match level {
            Some(level) => format!("order {}, layers {}", level.order, level.levels),
            None => "own choice".to_owned(),
        };
        (self.report)(&format!("{}, tolerance {:e}: {what}", kind.name(), stage.tolerance));
        let run = match self.subject.solve(level, stage.tolerance, stage.bounds) {
            Ok(measured) => Run::measured(kind, choice, stage.tolerance, measured),
            Err(Stop::Cancelled) if choice == Choice::Table => return None,
            Err(Stop::Cancelled) => Run::missing(kind, choice, stage.tolerance, Missing::NotRun),
            Err(Stop::Failed(failure)) => {
                Run::missing(kind, choice, stage.tolerance, Missing::Failed(failure))
            }
        };
        self.runs.push(run);
        Some(self.runs.len() - 1)
    }

    /// Solves on a finer grid than before, as fine as the time allows, which sharpens the reference.
    fn finest(&mut self) {
        let proved = self.runs.iter().filter(|run| run.kind == Kind::Bounds && run.choice == Choice::Table);
        let timed = proved.filter_map(|run| Some((run.tolerance?, run.found()?)));
        let Some((tolerance, finest)) =
            timed.min_by(|a, b| a.1.reported_error.total_cmp(&b.1.reported_error))
        else {
            return;
        };
        let Some((level, seconds)) = finest.level.map(|level| (level, finest.seconds)) else { return };
        let Some(expected) = self.subject.expected_seconds(Some(level), tolerance, true) else { return };
        let available = (self.seconds - self.elapsed()).max(FOR_REFERENCE * self.seconds);
        for more in (1..=4).rev() {
            let level = ResolutionLevel { order: level.order + more, levels: level.levels + more };
            let tolerance = tolerance / [1.0, 10.0, 100.0, 1e3, 1e4][more];
            let longer = self.subject.expected_seconds(Some(level), tolerance, true).map(|f| f / expected);
            if longer.is_some_and(|longer| 1.5 * longer * seconds <= available) {
                self.solve(&Stage { tolerance, bounds: true }, Some(level));
                return;
            }
        }
    }
}

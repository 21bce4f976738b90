//! The progress of a run, on a terminal and without one.

use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use elastocap_coupling::outcome::StepResult;
use elastocap_coupling::plan::Plan;
use elastocap_coupling::run::Observer;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::output;
use crate::units::seconds;

/// The time between two lines without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// Shows the number of finished steps and the remaining time: as a bar on a terminal, elsewhere as a line
/// every ten seconds.
pub(super) struct Progress {
    done: Arc<Mutex<Done>>,
    /// The bar; hidden without a terminal.
    bar: ProgressBar,
    /// Ends the lines when it is dropped.
    lines: Option<(Sender<()>, JoinHandle<()>)>,
}

/// The progress of a run so far.
#[derive(Debug)]
struct Done {
    /// The time when the run began.
    begun: Instant,
    /// The time when the first step began after the preparations, and the number of steps finished by then.
    steps_begun: Option<(Instant, usize)>,
    /// The number of finished steps.
    steps: usize,
    /// The number of steps to be solved.
    of: usize,
    /// The current work other than a step, in words; empty while steps are solved.
    doing: String,
    /// The forecast times of the layer and of the fields, s.
    forecast: [f64; 2],
}

impl Progress {
    pub(super) fn new(plan: &Plan, quiet: bool) -> Self {
        let of = plan.distinct_steps().count();
        let layer = plan.layer.as_ref().map_or(0.0, |layer| layer.seconds);
        let done = Arc::new(Mutex::new(Done {
            begun: Instant::now(),
            steps_begun: None,
            steps: 0,
            of,
            doing: String::new(),
            forecast: [layer, plan.seconds],
        }));
        let terminal = std::io::stderr().is_terminal();
        let shown = Arc::clone(&done);
        let text: Text = Arc::new(move || lock(&shown).text(Instant::now()));
        let bar = if quiet || !terminal { ProgressBar::hidden() } else { bar(&text, of) };
        let lines = if quiet || terminal { None } else { lines(&text) };
        Self { done, bar, lines }
    }

    /// Ends the bar, or the lines.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn update(&self, change: impl FnOnce(&mut Done)) {
        change(&mut lock(&self.done));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.lines.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

impl Observer for Progress {
    fn preparing(&self, what: &str) {
        self.update(|done| {
            done.doing = what.to_owned();
            done.steps_begun = None;
        });
    }

    fn step_begun(&self, _index: usize) {
        self.update(|done| {
            let steps = done.steps;
            done.steps_begun.get_or_insert_with(|| (Instant::now(), steps));
            done.doing.clear();
        });
    }

    fn step_done(&self, _step: &StepResult) {
        self.update(|done| done.steps += 1);
        self.bar.inc(1);
    }
}

fn lock(done: &Mutex<Done>) -> MutexGuard<'_, Done> {
    done.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A function that gives the text beside a bar, or of the next line without one.
type Text = Arc<dyn Fn() -> String + Send + Sync>;

fn bar(text: &Text, length: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length as u64), ProgressDrawTarget::stderr());
    let text = Arc::clone(text);
    let state = move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
        let _ = out.write_str(&text());
    };
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {state}") {
        bar.set_style(style.with_key("state", state));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Prints a line every ten seconds, until the sender is dropped.
fn lines(text: &Text) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (sender, receiver) = channel();
    let text = Arc::clone(text);
    let say = move || {
        while receiver.recv_timeout(BETWEEN_LINES) == Err(RecvTimeoutError::Timeout) {
            output::message(&text());
        }
    };
    // If no thread can be started, there are no lines, and the run goes on.
    let thread = std::thread::Builder::new().name("progress".to_owned()).spawn(say).ok()?;
    Some((sender, thread))
}

/// Shows the number of finished cases of a sweep and the remaining time, as [`Progress`] does for steps.
pub(super) struct CaseProgress {
    done: Arc<AtomicUsize>,
    bar: ProgressBar,
    /// Ends the lines when it is dropped.
    lines: Option<(Sender<()>, JoinHandle<()>)>,
}

impl CaseProgress {
    /// Shows the progress of `total` cases, of which `before` are already finished; nothing is shown if
    /// `quiet`.
    pub(super) fn new(total: usize, before: usize, quiet: bool) -> Self {
        let begun = Instant::now();
        let done = Arc::new(AtomicUsize::new(0));
        let shown = Arc::clone(&done);
        let text: Text =
            Arc::new(move || cases_text(total, before, shown.load(Ordering::Relaxed), begun.elapsed()));
        let terminal = std::io::stderr().is_terminal();
        let bar = if quiet || !terminal { ProgressBar::hidden() } else { bar(&text, total) };
        bar.set_position(before as u64);
        let lines = if quiet || terminal { None } else { lines(&text) };
        Self { done, bar, lines }
    }

    /// Ends the bar.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Counts another finished case.
    pub(super) fn case_done(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.bar.inc(1);
    }
}

impl Drop for CaseProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if let Some((sender, thread)) = self.lines.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

/// The text after `done` cases in `elapsed`, with `before` cases finished earlier.
fn cases_text(total: usize, before: usize, done: usize, elapsed: Duration) -> String {
    let mut text = format!("{}/{total} cases, {} elapsed", before + done, whole(elapsed));
    if done > 0 {
        let left = elapsed.as_secs_f64() / done as f64 * total.saturating_sub(before + done) as f64;
        let _ = write!(text, ", about {} left", seconds(left.max(1.0)));
    }
    text
}

impl Done {
    fn text(&self, now: Instant) -> String {
        let mut text = format!("{}/{} steps, {} elapsed", self.steps, self.of, whole(now - self.begun));
        if let Some(left) = self.left(now) {
            let _ = write!(text, ", about {} left", seconds(left.max(1.0)));
        }
        if !self.doing.is_empty() {
            let _ = write!(text, ", {}", self.doing);
        }
        text
    }

    /// The remaining seconds, by the finished steps or, before the first of them, by the forecast. `None` if
    /// the time of the forecast has passed without a finished step, if there is no forecast, and if all steps
    /// are done but other work goes on.
    fn left(&self, now: Instant) -> Option<f64> {
        let [layer, fields] = self.forecast;
        if self.steps >= self.of && !self.doing.is_empty() {
            return None;
        }
        match self.steps_begun {
            Some((begun, before)) if self.steps > before => {
                let each = (now - begun).as_secs_f64() / (self.steps - before) as f64;
                // The running step counts as not begun, so that the remaining time of the last step does not
                // fall to zero.
                Some(each * self.of.saturating_sub(self.steps) as f64)
            }
            Some((begun, _)) => positive(fields - (now - begun).as_secs_f64()),
            None => positive(layer - (now - self.begun).as_secs_f64()).map(|left| left + fields),
        }
    }
}

fn positive(value: f64) -> Option<f64> {
    (value > 0.0).then_some(value)
}

/// A duration in whole seconds.
fn whole(time: Duration) -> String {
    match time.as_secs() {
        few @ 0..60 => format!("{few} s"),
        many => format!("{} min {} s", many / 60, many % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_of_a_sweep_is_told_by_the_cases_of_this_run() {
        let text = |done, seconds| cases_text(100, 40, done, Duration::from_secs(seconds));
        assert_eq!(text(0, 5), "40/100 cases, 5 s elapsed");
        assert_eq!(text(20, 10), "60/100 cases, 10 s elapsed, about 20 s left");
    }

    #[test]
    fn the_rest_is_told_by_the_forecast_before_the_first_step_and_by_the_steps_after_it() {
        let begun = Instant::now();
        let at = |seconds: u64| begun + Duration::from_secs(seconds);
        let mut done = Done {
            begun,
            steps_begun: None,
            steps: 0,
            of: 4,
            doing: "layer".to_owned(),
            forecast: [60.0, 40.0],
        };
        assert_eq!(done.left(at(10)), Some(90.0));
        assert_eq!(done.left(at(70)), None, "later than expected: nothing is known");
        assert!(
            done.text(at(70)).starts_with("0/4 steps, ") && done.text(at(70)).ends_with(" elapsed, layer")
        );
        done.steps_begun = Some((at(80), 0));
        assert_eq!(done.left(at(90)), Some(30.0));
        assert_eq!(done.left(at(130)), None);
        done.steps = 1;
        assert_eq!(done.left(at(100)), Some(60.0));
        // One step was done before the layer.
        (done.steps, done.steps_begun) = (2, Some((at(80), 1)));
        assert_eq!(done.left(at(100)), Some(40.0));
        done.steps = 4;
        assert_eq!(done.left(at(160)), None, "how long steps take that are solved again is not known");
        done.doing.clear();
        assert_eq!(done.left(at(160)), Some(0.0));
        done.forecast = [0.0, 0.0];
        (done.steps, done.steps_begun) = (0, None);
        assert_eq!(done.left(at(1)), None, "without a forecast there is no remaining time");
    }
}

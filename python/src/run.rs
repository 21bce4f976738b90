//! Runs a case in separate threads. The calling thread waits without Python's lock, and takes it at intervals
//! to check for Ctrl-C and to report the progress.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use elastocap::case::Case;
use elastocap::coupling::deform::Solution;
use elastocap::coupling::failure::panic_message;
use elastocap::coupling::memory;
use elastocap::coupling::outcome::{Outcome, StepResult};
use elastocap::coupling::plan::{Options, Plan};
use elastocap::coupling::run::{Observer, run as solve};
use elastocap::results::{KeptFields, StepFields, Wanted};
use pyo3::prelude::*;

use crate::case::PyCase;
use crate::errors::failed;
use crate::outcome::PyOutcome;

/// The interval at which the calling thread checks for signals.
const INTERVAL: Duration = Duration::from_millis(20);

/// The stack size of each computing thread, bytes, equal to that of the main thread in which the command
/// prepares its runs.
const STACK: usize = 8 << 20;

/// A message of the computing threads to the calling thread.
enum News {
    /// The number of steps.
    Planned(usize),
    /// The current work that all steps need.
    Preparing(String),
    StepBegun,
    StepDone,
}

/// An observer that sends the progress of a run to the calling thread.
struct Messenger(Sender<News>);

impl Messenger {
    fn tell(&self, news: News) {
        // The receiver is gone if the run is being stopped.
        let _ = self.0.send(news);
    }
}

impl Observer for Messenger {
    fn preparing(&self, what: &str) {
        self.tell(News::Preparing(what.to_owned()));
    }

    fn layer_solved(&self, _solution: &Solution) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn step_begun(&self, _index: usize) {
        self.tell(News::StepBegun);
    }

    fn step_done(&self, _step: &StepResult) {
        self.tell(News::StepDone);
    }
}

/// The result of a finished run, the fields that were kept, and the time that planning took.
type Done = (Outcome, StepFields, Duration);

/// Runs a case on `threads` threads; without a number on as many as the command takes.
///
/// `notify` is called with the number of steps done, the number of steps, and what is being done, each time
/// one of them changes, by the thread that called. `max_seconds` stops the run after that time, and so does
/// `cancelled`, which is asked often, when it gives true. `at_once` is how many runs of this process share
/// its memory. `model_error` says whether a simple model of the layer is compared with a better one.
///
/// Returns what was found, and the exception that stopped the run: KeyboardInterrupt, or what `notify`
/// raised.
#[pyfunction]
#[pyo3(signature = (case, threads, prune, fields, model_error, max_seconds, at_once, notify, cancelled))]
pub(crate) fn run(
    py: Python<'_>,
    case: &PyCase,
    threads: Option<usize>,
    prune: bool,
    fields: bool,
    model_error: bool,
    max_seconds: Option<f64>,
    at_once: u64,
    notify: Option<Py<PyAny>>,
    cancelled: Option<Py<PyAny>>,
) -> PyResult<(PyOutcome, Option<PyErr>)> {
    let (case, text) = (Arc::clone(&case.case), case.text.clone());
    let options = Options { prune, fields, scene: true, model_error };
    let deadline = max_seconds.and_then(|seconds| {
        Instant::now().checked_add(Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::MAX))
    });
    let (done, stopped_by) = py.detach(|| {
        let cancel = Arc::new(AtomicBool::new(false));
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            let compute = || in_threads(&case, &options, threads, at_once, &cancel, Messenger(sender));
            let worker =
                match std::thread::Builder::new().name("elastocap".to_owned()).spawn_scoped(scope, compute) {
                    Ok(worker) => worker,
                    Err(error) => return (Err(failed(&format!("cannot start a thread: {error}"))), None),
                };
            let stopped_by = wait(&receiver, &cancel, deadline, notify.as_ref(), cancelled.as_ref());
            let done = worker
                .join()
                .unwrap_or_else(|_| Err(failed("a thread ended early; this is a defect of elastocap")));
            (done, stopped_by)
        })
    });
    let (outcome, fields, planning) = done?;
    Ok((PyOutcome { case, outcome, options, fields, planning, text }, stopped_by))
}

/// Plans and solves a case in a new pool of threads, so that runs of one process do not share threads, and
/// none is left over for a process that is forked later.
fn in_threads(
    case: &Case,
    options: &Options,
    threads: Option<usize>,
    at_once: u64,
    cancel: &Arc<AtomicBool>,
    messenger: Messenger,
) -> PyResult<Done> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or_else(usual_threads))
        .stack_size(STACK)
        .thread_name(|index| format!("elastocap-{index}"))
        .build()
        .map_err(|error| failed(&format!("cannot start the threads: {error}")))?;
    let work = || {
        let started = Instant::now();
        let mut plan = Plan::new(case, options);
        plan.memory_limit /= at_once.max(1);
        plan.layer_memory_limit /= at_once.max(1);
        Wanted::of(options).note_in(case, options, &mut plan);
        let planning = started.elapsed();
        messenger.tell(News::Planned(plan.distinct_steps().count()));
        let fields = KeptFields::new(options.fields, &messenger);
        let outcome = solve(case, &plan, options, cancel, &fields);
        (outcome, fields.finish(), planning)
    };
    // Panics in a step are handled by the run; this catches all others.
    catch_unwind(AssertUnwindSafe(|| pool.install(work))).map_err(|defect| {
        let message = panic_message(&*defect);
        failed(&format!("a defect of elastocap ended the run: {message}"))
    })
}

/// The default number of threads of the command: one for each processor, and fewer under a limit on the
/// address space.
fn usual_threads() -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    memory::max_threads().map_or(processors, |most| processors.min(most))
}

/// Waits until the run is finished. Returns the exception that stopped it.
fn wait(
    receiver: &Receiver<News>,
    cancel: &AtomicBool,
    deadline: Option<Instant>,
    notify: Option<&Py<PyAny>>,
    cancelled: Option<&Py<PyAny>>,
) -> Option<PyErr> {
    let (mut done, mut of, mut doing) = (0, 0, "planning".to_owned());
    let mut stopped_by = None;
    loop {
        let news = match receiver.recv_timeout(INTERVAL) {
            Ok(news) => Some(news),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return stopped_by,
        };
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            cancel.store(true, Ordering::Relaxed);
        }
        let is_news = news.is_some();
        match news {
            Some(News::Planned(steps)) => of = steps,
            Some(News::Preparing(what)) => doing = what,
            Some(News::StepBegun) => "solving".clone_into(&mut doing),
            Some(News::StepDone) => done += 1,
            None => {}
        }
        if stopped_by.is_some() {
            continue;
        }
        let called = Python::attach(|py| {
            py.check_signals()?;
            if let Some(cancelled) = cancelled
                && cancelled.call0(py)?.is_truthy(py)?
            {
                cancel.store(true, Ordering::Relaxed);
            }
            match notify.filter(|_| is_news) {
                Some(notify) => notify.call1(py, (done, of, doing.as_str())).map(drop),
                None => Ok(()),
            }
        });
        if let Err(error) = called {
            cancel.store(true, Ordering::Relaxed);
            stopped_by = Some(error);
        }
    }
}

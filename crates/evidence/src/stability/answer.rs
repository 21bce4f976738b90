//! The answer to one case file, which is read, planned and run as by `elastocap run`, within a time limit.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;

/// The outcome of a case.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// The case was refused as bad input.
    Refused(String),
    /// The case was run; steps may have failed. The number is the largest relative error of an acceptable
    /// step.
    Run(Box<Outcome>, f64),
    /// The case was not finished in time.
    TooLong(Duration),
    /// The user stopped the case.
    Stopped,
    /// The case ended in a way that must not happen, such as a panic.
    Broken(String),
}

/// The time to wait for a solve that was asked to stop; then its thread is abandoned.
const GRACE: Duration = Duration::from_millis(500);

/// Solves a case text on `threads` new threads, within `limit`.
pub(super) fn answer(text: &str, threads: usize, limit: Duration, stop: &AtomicBool) -> Answer {
    let cancel = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let (text, shared_cancel) = (text.to_owned(), Arc::clone(&cancel));
    let started = std::thread::Builder::new().name("entry".to_owned()).spawn(move || {
        // A separate pool, since an abandoned solve must not hold up the next one.
        let answer = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool.install(|| solve(&text, &shared_cancel)),
            Err(error) => Answer::Broken(format!("cannot start threads: {error}")),
        };
        // After too long a time the receiver is gone.
        let _ = sender.send(answer);
    });
    match started {
        Ok(_) => wait(&receiver, limit, &cancel, stop),
        Err(error) => Answer::Broken(format!("cannot start a thread: {error}")),
    }
}

/// Waits for the answer of the solving thread, until the time is up or the user stops the case.
fn wait(receiver: &Receiver<Answer>, limit: Duration, cancel: &AtomicBool, stop: &AtomicBool) -> Answer {
    let begin = Instant::now();
    loop {
        match receiver.recv_timeout(Duration::from_millis(20)) {
            Ok(answer) => return answer,
            Err(RecvTimeoutError::Disconnected) => return Answer::Broken("it panicked".to_owned()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let stopped = stop.load(Ordering::Relaxed);
        if stopped || begin.elapsed() > limit {
            cancel.store(true, Ordering::Relaxed);
            let _ = receiver.recv_timeout(GRACE);
            return if stopped { Answer::Stopped } else { Answer::TooLong(limit) };
        }
    }
}

/// Reads, plans and runs a case.
fn solve(text: &str, cancel: &Arc<AtomicBool>) -> Answer {
    let case = match elastocap_case::parse(text, Path::new("entry.toml")) {
        Ok(case) => case,
        Err(error) => {
            let first = error.diagnostics().first().map(|d| d.message.clone());
            return Answer::Refused(first.unwrap_or_else(|| "no reason was given".to_owned()));
        }
    };
    let options = Options { prune: true, fields: false, scene: false, model_error: false };
    let plan = Plan::new(&case, &options);
    let settings = plan.solver_settings(&case, &options);
    let allowed = settings.relative_tolerance * if settings.bounds { 0.5 } else { 1.0 };
    Answer::Run(Box::new(run(&case, &plan, &options, cancel, &())), allowed)
}

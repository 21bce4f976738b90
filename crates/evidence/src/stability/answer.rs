//! The answer to one case file: read, planned and run as `elastocap run` does it, within a time.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;

/// How a case ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// It was not read: bad input.
    Refused(String),
    /// It was run; steps may have failed. The number is the largest relative error that a step may have and be ok.
    Run(Box<Outcome>, f64),
    /// It was not done in time.
    TooLong(Duration),
    /// It was stopped by the user.
    Stopped,
    /// It ended in a way that must not happen: a panic, for instance.
    Broken(String),
}

/// How long to wait for a solve that was asked to stop; then its thread is abandoned.
const GRACE: Duration = Duration::from_millis(500);

/// Solves a case text on `threads` threads of its own, within `limit`.
pub(super) fn answer(text: &str, threads: usize, limit: Duration, stop: &AtomicBool) -> Answer {
    let cancel = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let (text, told) = (text.to_owned(), Arc::clone(&cancel));
    let started = std::thread::Builder::new().name("entry".to_owned()).spawn(move || {
        // Threads of its own: an abandoned solve must not hold up the next one.
        let answer = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            Ok(pool) => pool.install(|| solve(&text, &told)),
            Err(error) => Answer::Broken(format!("cannot start threads: {error}")),
        };
        // If it took too long, the receiver is gone.
        let _ = sender.send(answer);
    });
    match started {
        Ok(_) => wait(&receiver, limit, &cancel, stop),
        Err(error) => Answer::Broken(format!("cannot start a thread: {error}")),
    }
}

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

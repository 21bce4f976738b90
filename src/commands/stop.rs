//! The effect of Ctrl-C, and of the other signals that ask a process to end.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use elastocap_results::{OutputFolder, Unfinished};

use crate::exit::Exit;
use crate::output;

/// The longest time that work may go on after a request to stop. With the time for writing the results so
/// far, a command ends within two seconds.
const GRACE: Duration = Duration::from_secs(1);

/// The interval at which the request to stop is checked.
const INTERVAL: Duration = Duration::from_millis(20);

/// The stack size of a working thread, bytes, equal to that of a main thread.
pub(super) const STACK: usize = 8 << 20;

/// Does `work` on another thread and returns its result. If `cancel` is set and the work does not end within
/// [`GRACE`], because a part of it is long and cannot be interrupted, the process ends with the status that
/// `leave` returns, after `leave` has saved what there is.
pub(super) fn end_in_time<T: Send>(
    cancel: &AtomicBool,
    work: impl FnOnce() -> T + Send,
    leave: impl FnOnce() -> Exit,
) -> Result<T, Exit> {
    thread::scope(|scope| {
        let (done, ends) = mpsc::channel();
        let working = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || {
            let found = work();
            // The receiver is gone if the process is ending.
            let _ = done.send(());
            found
        });
        let working = working.map_err(|error| {
            output::error(&format!("cannot start a thread: {error}"));
            Exit::Failure
        })?;
        let mut stop_requested: Option<Instant> = None;
        while ends.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
            if stop_requested.is_none() && cancel.load(Ordering::Relaxed) {
                stop_requested = Some(Instant::now());
            }
            if stop_requested.is_some_and(|stop_requested| stop_requested.elapsed() >= GRACE) {
                // The working thread ends with the process.
                std::process::exit(leave().status().into());
            }
        }
        working.join().map_err(|defect| std::panic::resume_unwind(defect))
    })
}

/// Reports that a solve was abandoned, and with it the results of the command.
pub(super) fn left_a_solve() -> Exit {
    output::warning("stopped in the middle of a solve that cannot be interrupted: nothing is written");
    Exit::Incomplete
}

/// The first signal ends the work and keeps what is finished; the second ends the process, without
/// half-written files.
pub(super) fn stop_on_signal(cancel: &Arc<AtomicBool>, folder: &OutputFolder) {
    let unfinished = folder.unfinished().clone();
    on_signal(
        cancel,
        || true,
        move || {
            unfinished.give_up();
        },
    );
}

/// The effect of signals, as in [`stop_on_signal`], on a command that fills one folder after another: the
/// handler is installed once, and knows the current folder.
#[derive(Debug, Clone, Default)]
pub(super) struct Stop {
    /// The flag that the first signal sets.
    cancel: Arc<AtomicBool>,
    /// The staged files of the current folder.
    unfinished: Arc<Mutex<Option<Unfinished>>>,
    /// Set once the handler is installed.
    installed: Arc<OnceLock<()>>,
}

impl Stop {
    /// The flag that the first signal sets.
    pub(super) fn cancel(&self) -> &Arc<AtomicBool> {
        &self.cancel
    }

    /// Whether the work is to end.
    pub(super) fn is_asked(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// From now on signals are about the work on `folder`: the first keeps what is finished, and the second
    /// removes the staged files.
    pub(super) fn guard(&self, folder: &OutputFolder) {
        *self.unfinished.lock().unwrap_or_else(PoisonError::into_inner) = Some(folder.unfinished().clone());
        self.install();
    }

    /// Ends the effect of [`Stop::guard`] once the files are in place: later signals leave them alone.
    pub(super) fn release(&self) {
        *self.unfinished.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Installs the handler, unless it is already installed.
    pub(super) fn install(&self) {
        self.installed.get_or_init(|| {
            let (busy, unfinished) = (Arc::clone(&self.unfinished), Arc::clone(&self.unfinished));
            let is_busy = move || busy.lock().unwrap_or_else(PoisonError::into_inner).is_some();
            on_signal(&self.cancel, is_busy, move || {
                if let Some(unfinished) = &*unfinished.lock().unwrap_or_else(PoisonError::into_inner) {
                    unfinished.give_up();
                }
            });
        });
    }
}

/// Handles signals as [`stop_on_signal`] does, for a command that stages no files.
pub(super) fn stop_without_files(cancel: &Arc<AtomicBool>) {
    on_signal(cancel, || true, || ());
}

/// Stops the work when `time` has passed since `start`, as a signal does.
pub(super) fn stop_after(time: Duration, start: Instant, cancel: &Arc<AtomicBool>) {
    let cancel = Arc::clone(cancel);
    let watch = move || {
        std::thread::sleep(time.saturating_sub(start.elapsed()));
        if !cancel.swap(true, Ordering::Relaxed) {
            output::message("stopping: the time of --max-time is over; what is finished will be kept");
        }
    };
    if let Err(error) = std::thread::Builder::new().name("max-time".to_owned()).spawn(watch) {
        output::warning(&format!("--max-time has no effect: {error}"));
    }
}

/// Handles signals: the first one sets `cancel`, the second one calls `at_the_end` and ends the process.
/// `is_busy` tells whether there is work whose results are kept; otherwise the first signal prints nothing.
fn on_signal(
    cancel: &Arc<AtomicBool>,
    is_busy: impl Fn() -> bool + Send + 'static,
    at_the_end: impl Fn() + Send + 'static,
) {
    let cancel = Arc::clone(cancel);
    let already_requested = AtomicBool::new(false);
    let installed = install(move || {
        if already_requested.swap(true, Ordering::Relaxed) {
            at_the_end();
            std::process::exit(130);
        }
        cancel.store(true, Ordering::Relaxed);
        if is_busy() {
            output::message("stopping: what is finished will be kept; press Ctrl-C again to end at once");
        }
    });
    if let Err(error) = installed {
        output::warning(&format!("Ctrl-C will end the run without results: {error}"));
    }
}

/// Calls `act` at each Ctrl-C, and each time the system or another process asks this one to end (SIGTERM) or
/// its terminal is closed (SIGHUP).
#[cfg(unix)]
fn install(act: impl Fn() + Send + 'static) -> io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals_to_handle = vec![SIGINT, SIGTERM];
    if !hang_up_is_ignored() {
        signals_to_handle.push(SIGHUP);
    }
    let mut signals = signal_hook::iterator::Signals::new(signals_to_handle)?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || signals.forever().for_each(|_| act()))?;
    Ok(())
}

#[cfg(not(unix))]
fn install(act: impl Fn() + Send + 'static) -> io::Result<()> {
    ctrlc::set_handler(act).map_err(io::Error::other)
}

/// Whether this process is to outlive its terminal, as under `nohup`. Known on Linux only.
#[cfg(unix)]
fn hang_up_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal_hook::consts::SIGHUP - 1) & 1 == 1
}

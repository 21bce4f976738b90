//! Ends the process in order when its memory runs out: a message, nothing left behind, exit status 1.
//!
//! Rust ends a process whose allocation fails by `abort`, which runs no destructor. A thread of the guard is woken by that signal
//! and puts things in order while the thread that failed waits. Where the memory of the process is limited, another thread watches
//! how close the limit is: a control group would end the process by a signal that nobody can handle.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// What must not be left behind, and the threads that see to it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Guard {
    leftovers: Arc<Mutex<Leftovers>>,
    /// Whether the process is being ended.
    #[cfg(unix)]
    ending: Arc<std::sync::atomic::AtomicBool>,
}

/// Folders that are gone when the process ends early.
#[derive(Debug, Default)]
struct Leftovers {
    /// With all that is in them.
    whole: Vec<PathBuf>,
    /// Only if nothing is in them, innermost first.
    empty: Vec<PathBuf>,
}

/// How often the removal of a folder is tried, and the pause after each time.
#[cfg(unix)]
const TRIES: usize = 20;
#[cfg(unix)]
const BETWEEN_TRIES: std::time::Duration = std::time::Duration::from_millis(5);

impl Guard {
    /// Starts guarding.
    pub(crate) fn start() -> Self {
        let guard = Self::default();
        #[cfg(unix)]
        unix::start(&guard);
        guard
    }

    /// Removes `staging` with all its files, and the folders `made` for it where they are empty, if the process ends early.
    pub(crate) fn remove_on_failure(&self, staging: &Path, made: &[PathBuf]) {
        let mut leftovers = self.leftovers.lock().unwrap_or_else(PoisonError::into_inner);
        leftovers.whole.push(staging.to_owned());
        leftovers.empty.extend_from_slice(made);
    }

    /// Ends the process with a message, once.
    #[cfg(unix)]
    fn end(&self, message: &str) {
        if self.ending.swap(true, std::sync::atomic::Ordering::Relaxed) {
            return;
        }
        crate::output::error(message);
        // What cannot be removed cannot be reported either.
        let leftovers = self.leftovers.lock().unwrap_or_else(PoisonError::into_inner);
        for folder in &leftovers.whole {
            // Another thread may put a file into it in between.
            for _ in 0..TRIES {
                let _ = std::fs::remove_dir_all(folder);
                if !folder.exists() {
                    break;
                }
                std::thread::sleep(BETWEEN_TRIES);
            }
        }
        for folder in &leftovers.empty {
            let _ = std::fs::remove_dir(folder);
        }
        drop(leftovers);
        signal_hook::low_level::exit(1);
    }
}

#[cfg(unix)]
mod unix {
    use std::io::{self, ErrorKind, PipeReader, Read as _, Write as _};
    use std::os::fd::OwnedFd;
    use std::thread;
    use std::time::Duration;

    use elastocap_coupling::memory::{is_limited, limit_reached};
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use signal_hook::consts::SIGABRT;
    use signal_hook::low_level;

    use super::Guard;

    /// Memory that is given back before anything else is done about its end, bytes.
    const BALLAST: usize = 1 << 20;

    /// How often the limits are looked at.
    const INTERVAL: Duration = Duration::from_millis(10);

    /// Starts the threads. Without them the process ends as it would anyway.
    pub(super) fn start(guard: &Guard) {
        if let Ok((woken, held)) = on_abort() {
            let guard = guard.clone();
            let ballast = vec![1_u8; BALLAST];
            let _ =
                thread::Builder::new().stack_size(BALLAST).spawn(move || wait(&guard, woken, &held, ballast));
        }
        if is_limited() {
            let guard = guard.clone();
            let _ = thread::Builder::new().stack_size(BALLAST).spawn(move || watch(&guard));
        }
    }

    /// Two pipes: the first gets a byte when the process aborts, the second is full, so that the thread that aborts waits for ever
    /// at its byte for it. Both ends of the second must stay open.
    fn on_abort() -> io::Result<(PipeReader, (PipeReader, OwnedFd))> {
        let (woken, wakes) = io::pipe()?;
        low_level::pipe::register(SIGABRT, OwnedFd::from(wakes))?;
        let (held, mut holds) = io::pipe()?;
        let blocked = OwnedFd::from(holds.try_clone()?);
        // Registered, the pipe does not block: it is filled first.
        low_level::pipe::register(SIGABRT, OwnedFd::from(holds.try_clone()?))?;
        loop {
            match holds.write(&[0; 4096]) {
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        while holds.write(&[0]).is_ok() {}
        fcntl_setfl(&blocked, fcntl_getfl(&blocked)? - OFlags::NONBLOCK)?;
        Ok((woken, (held, blocked)))
    }

    /// Waits for the abort, and ends the process in order.
    fn wait(guard: &Guard, mut woken: PipeReader, _held: &(PipeReader, OwnedFd), ballast: Vec<u8>) {
        if woken.read_exact(&mut [0]).is_ok() {
            drop(ballast);
            guard.end("ended for the reason above; if it is memory: allow more, or solve less at a time");
        }
    }

    /// Ends the process before a limit does.
    fn watch(guard: &Guard) {
        loop {
            if let Some(limit) = limit_reached() {
                guard.end(&format!(
                    "out of memory: the process has used up its limit of {limit}; nothing was written"
                ));
            }
            thread::sleep(INTERVAL);
        }
    }
}

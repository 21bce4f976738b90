//! Ends the process cleanly when its memory runs out: with a message, without leftovers, with exit status 1.
//!
//! Rust ends a process whose allocation fails by `abort`, which runs no destructor. That signal wakes a
//! thread of the guard, which cleans up while the threads that failed wait. If the memory of the process is
//! limited, another thread watches how close the limit is, and wakes the first: a control group would end the
//! process by a signal that nobody can handle. Only the first thread ever ends the process, since every other
//! thread may itself fail half way.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use elastocap_results::Unfinished;

/// The files that must not be left behind; threads of the guard remove them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Guard {
    /// The files of the run, once there are any.
    unfinished: Arc<Mutex<Option<Unfinished>>>,
}

impl Guard {
    /// Starts guarding.
    ///
    /// # Errors
    /// An error if a thread cannot be started.
    pub(crate) fn start() -> io::Result<Self> {
        let guard = Self::default();
        #[cfg(unix)]
        unix::start(&guard)?;
        Ok(guard)
    }

    /// Removes these files if the process ends early.
    pub(crate) fn remove_on_failure(&self, unfinished: &Unfinished) {
        // Nothing is allocated under the lock: a thread that fails there would keep it for ever.
        let unfinished = Some(unfinished.clone());
        *self.unfinished.lock().unwrap_or_else(PoisonError::into_inner) = unfinished;
    }

    /// Returns at once, unless another thread is ending the process: then it never returns.
    pub(crate) fn let_end(&self) {
        drop(self.unfinished.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Ends the process with a message. On Linux this allocates nothing.
    #[cfg(unix)]
    fn end(&self, message: &str) -> ! {
        let unfinished = self.unfinished.lock().unwrap_or_else(PoisonError::into_inner);
        unix::say("error: ");
        unix::say(message);
        // Results that are already in place stay there. Files that cannot be removed cannot be reported
        // either.
        if unfinished.as_ref().is_some_and(Unfinished::give_up) {
            unix::say("; nothing of this run was written");
        }
        unix::say("\n");
        unix::exit()
    }
}

/// The threads of the guard, and the signals that wake them.
#[cfg(unix)]
mod unix {
    use std::io::{self, ErrorKind, PipeReader, PipeWriter, Read as _, Write as _};
    use std::os::fd::OwnedFd;
    use std::sync::{Arc, OnceLock};
    use std::time::Duration;
    use std::{panic, thread};

    use elastocap_coupling::memory::{is_limited, limit_reached};
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use signal_hook::consts::{SIGABRT, SIGXFSZ};
    use signal_hook::{flag, low_level};

    use super::Guard;

    /// Memory released before the process ends, bytes: only on Linux are files removed without allocating.
    const BALLAST: usize = if cfg!(target_os = "linux") { 0 } else { 1 << 20 };

    /// Stack of each thread, bytes.
    const STACK: usize = 1 << 20;

    /// The interval at which the limits are checked.
    const INTERVAL: Duration = Duration::from_millis(10);

    /// The longest time for cleaning up after the memory has run out.
    const PATIENCE: Duration = Duration::from_secs(5);

    /// Starts the threads.
    pub(super) fn start(guard: &Guard) -> io::Result<()> {
        // With a handler this signal does not end the process: a write beyond the limit on file sizes fails,
        // and is reported.
        flag::register(SIGXFSZ, Arc::default())?;
        let (waking, wakes) = on_abort()?;
        let guard = guard.clone();
        let reason = Arc::new(OnceLock::new());
        let ballast = vec![1_u8; BALLAST];
        let waiting = Arc::clone(&reason);
        let stack = || thread::Builder::new().stack_size(STACK);
        stack().spawn(move || wait(&guard, &waiting, waking, ballast))?;
        take_failed_threads_for_memory(Arc::clone(&reason));
        if is_limited() {
            stack().spawn(move || watch(wakes, &reason))?;
        }
        Ok(())
    }

    /// The pipes that wake the ending thread, and keep aborting threads from ending the process first.
    struct Waking {
        /// The pipe that gets a byte when the process aborts.
        woken: PipeReader,
        /// Both ends of a full pipe, at which an aborting thread waits for ever.
        _full: (PipeReader, OwnedFd),
    }

    /// Installs the two pipes; the writer wakes as an abort does.
    fn on_abort() -> io::Result<(Waking, PipeWriter)> {
        let (woken, wakes) = io::pipe()?;
        low_level::pipe::register(SIGABRT, OwnedFd::from(wakes.try_clone()?))?;
        let (held, mut holds) = io::pipe()?;
        let blocked = OwnedFd::from(holds.try_clone()?);
        // Registering makes the pipe nonblocking, so it is filled before.
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
        Ok((Waking { woken, _full: (held, blocked) }, wakes))
    }

    /// Treats a panic of the standard library for lack of memory for a thread's stack, which happens before
    /// the thread begins, like a failed allocation.
    fn take_failed_threads_for_memory(reason: Arc<OnceLock<String>>) {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if panic.to_string().contains("Cannot allocate memory") {
                let _ = reason.set("out of memory: a thread could not be started".to_owned());
                let _ = low_level::raise(SIGABRT);
            } else {
                usual(panic);
            }
        }));
    }

    /// Waits until it is woken, and ends the process cleanly.
    fn wait(guard: &Guard, reason: &OnceLock<String>, mut waking: Waking, ballast: Vec<u8>) {
        if waking.woken.read_exact(&mut [0]).is_ok() {
            drop(ballast);
            guard.end(reason.get().map_or(
                "ended for the reason above; if it is memory: allow more, or solve less at a time",
                String::as_str,
            ));
        }
    }

    /// Wakes the ending thread before a limit is reached.
    fn watch(mut wakes: PipeWriter, reason: &OnceLock<String>) {
        let limit = loop {
            if let Some(limit) = limit_reached() {
                break limit;
            }
            thread::sleep(INTERVAL);
        };
        let _ = reason.set(format!("out of memory: the process has used up its limit of {limit}"));
        let _ = wakes.write_all(&[0]);
        // The thread woken may itself find no memory, and wait like any other that aborts.
        thread::sleep(PATIENCE);
        exit()
    }

    /// Writes to stderr without its lock, which a failed thread may hold.
    pub(super) fn say(text: &str) {
        let _ = rustix::io::write(io::stderr(), text.as_bytes());
    }

    /// Ends the process at once, without waiting for other threads.
    pub(super) fn exit() -> ! {
        low_level::exit(1)
    }
}

//! Solves many cases in parallel on this machine.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::SweepError;
use crate::record::CaseRecord;
use crate::sweep::Sweep;

/// Watches a sweep while cases are solved. Its methods are called from several threads at once.
pub trait SweepObserver: Sync {
    /// Called with each solved case. An error ends the sweep.
    ///
    /// # Errors
    /// Any reason to end the sweep, such as a record that cannot be written.
    fn case_done(&self, record: CaseRecord) -> Result<(), SweepError>;
}

/// Solves the cases `wanted` on `threads` threads, which begin them in this order. With at least as many
/// cases as threads, each case has one thread; otherwise the threads are divided among the cases. `cancel`
/// ends the sweep, and unfinished cases are given up.
///
/// # Errors
/// The first error of the observer, or threads that cannot be started.
pub fn run(
    sweep: &Sweep,
    wanted: &[usize],
    threads: usize,
    cancel: &Arc<AtomicBool>,
    observer: &dyn SweepObserver,
) -> Result<(), SweepError> {
    let at_once = threads.max(1).min(wanted.len());
    if at_once == 0 {
        return Ok(());
    }
    let threads_of_each = threads.max(1) / at_once;
    keep_freed_memory();
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let fail = |error| {
        cancel.store(true, Ordering::Relaxed);
        failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    };
    let work = || {
        while !cancel.load(Ordering::Relaxed) {
            let Some(index) = wanted.get(next.fetch_add(1, Ordering::Relaxed)) else { return };
            if let Some(record) = sweep.solve(*index, at_once, cancel)
                && let Err(error) = observer.case_done(record)
            {
                fail(error);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..at_once {
            // A separate pool for each worker keeps the parallel parts of a case on the threads of that
            // worker.
            match rayon::ThreadPoolBuilder::new().num_threads(threads_of_each).build() {
                Ok(pool) => drop(scope.spawn(move || pool.install(work))),
                Err(error) => fail(SweepError::Thread(error.to_string())),
            }
        }
    });
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

/// The size of the largest block that glibc's allocator adapts to, bytes: its limit is 32 MiB.
const LEARNT_FROM: usize = 31 << 20;

/// Makes the allocator keep the memory freed by a case for the next one. Returning it to the system and
/// requesting it again cost an eighth of all processor time. glibc adapts its thresholds to the largest freed
/// block so far; on other allocators this has no effect.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LEARNT_FROM)));
}

//! Independent tasks that run concurrently.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The values of `task` for each of `0..count`, in order; at most `at_once` are computed at the same time.
/// `None` for tasks that were not begun when `cancel` was set.
pub(crate) fn side_by_side<T: Send>(
    at_once: usize,
    count: usize,
    cancel: &AtomicBool,
    task: impl Fn(usize) -> T + Sync,
) -> Vec<Option<T>> {
    let places: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let worker = || {
        while !cancel.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(place) = places.get(index) else { return };
            let value = task(index);
            *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
        }
    };
    // Not a parallel iterator: while a solve waits for a part of itself, its thread must not begin another
    // task.
    rayon::scope(|scope| {
        for _ in 0..at_once.min(count) {
            scope.spawn(|_| worker());
        }
    });
    places.into_iter().map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

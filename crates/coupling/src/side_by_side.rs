//! Independent pieces of work, some of them at the same time.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The values of `of` for each of `0..count`, in their order; at most `at_once` are computed at the same time. `None` for those not begun when
/// `cancel` was set.
pub(crate) fn side_by_side<T: Send>(
    at_once: usize,
    count: usize,
    cancel: &AtomicBool,
    of: impl Fn(usize) -> T + Sync,
) -> Vec<Option<T>> {
    let places: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let take = || {
        while !cancel.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(place) = places.get(index) else { return };
            let found = of(index);
            *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        }
    };
    // Not a parallel iterator: while a solve waits for a part of itself, its thread must not begin another piece.
    rayon::scope(|scope| {
        for _ in 0..at_once.min(count) {
            scope.spawn(|_| take());
        }
    });
    places.into_iter().map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

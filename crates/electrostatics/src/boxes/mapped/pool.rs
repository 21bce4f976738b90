//! Buffers that threads use one after the other.

use std::sync::{Mutex, PoisonError};

/// Buffers that are not in use. As many are made as threads need at the same time: what each piece of work that the threads share out makes
/// for itself takes new pages of memory every time, which costs as much as the work in them.
#[derive(Debug, Default)]
pub(crate) struct Pool<T>(Mutex<Vec<T>>);

impl<T: Default> Pool<T> {
    /// Does some work with one of them.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        let idle = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut own = idle().pop().unwrap_or_default();
        let out = work(&mut own);
        idle().push(own);
        out
    }
}

//! Buffers that threads share.

use std::sync::{Mutex, PoisonError};

/// Buffers that are not in use. No more are allocated than threads use at the same time: to allocate one for
/// each piece of work would touch new pages of memory every time, which costs as much as the work itself.
#[derive(Debug, Default)]
pub(crate) struct Pool<T>(Mutex<Vec<T>>);

impl<T: Default> Pool<T> {
    /// Runs some work with one of the buffers.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        let idle = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut buffer = idle().pop().unwrap_or_default();
        let out = work(&mut buffer);
        idle().push(buffer);
        out
    }
}

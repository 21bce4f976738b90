//! Functions that format counts, quantities, times and amounts of memory for messages.

pub(crate) use elastocap_coupling::words::{grouped, prefixed, seconds};
pub(crate) use elastocap_linalg::memory::bytes_in_words as bytes;

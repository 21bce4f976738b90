//! Numbers in the units that people use.

pub(crate) use elastocap_coupling::words::{grouped, prefixed, seconds};
pub(crate) use elastocap_linalg::memory::bytes_in_words as bytes;

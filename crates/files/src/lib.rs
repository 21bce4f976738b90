//! Reads files safely, writes files as a whole, and names results.
//!
//! A file may come from others, and a folder may be open to others. Three rules follow:
//!
//! - [`read`] and [`open`] accept only regular files, up to a given size: a pipe would block, and a device
//!   may be endless.
//! - [`Staged`] writes under a new unpredictable name, follows no link, and gives the file its name when it
//!   is complete.
//! - [`result_name`] makes a name for results from that of a case, and no such name leads out of the folder
//!   that it is in.

mod naming;
mod reading;
mod staged;

pub use naming::{is_plain_name, result_name};
pub use reading::{ReadError, copy, open, read};
pub use staged::{Staged, open_lock_file, remove_abandoned, unguessable};

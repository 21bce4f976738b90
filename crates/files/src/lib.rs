//! Files from elsewhere and files for the user: what may be read, how a file is written as a whole, and how results are named.
//!
//! A file may come from elsewhere, and a folder may be open to others. Three rules follow:
//!
//! - [`read`] and [`open`] take regular files alone, up to a given size: a pipe would be waited for, and a device may never end.
//! - [`Staged`] writes under a new name that cannot be guessed, follows no link, and gives the file its name when it is whole.
//! - [`result_name`] makes a name for results from that of a case, and no such name leads out of the folder that it is in.

mod naming;
mod reading;
mod staged;

pub use naming::{is_plain_name, result_name};
pub use reading::{ReadError, copy, open, read};
pub use staged::{Staged, open_lock_file, remove_abandoned, unguessable};

//! Does nothing, and is here because Cargo looks at build dependencies only where there is a build script.
//!
//! `cargo run --release` and `pip install ./python` compile the same crates. They can use each other's only
//! if each of these has the same features in both, down to the macros of serde. pyo3, which the Python
//! package uses, asks for features of syn and once_cell that the command does not need; two dependencies of
//! this package ask for the same. Without them nearly everything would be compiled twice.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}

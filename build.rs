//! Does nothing, and is here because Cargo looks at build dependencies only where there is a build script.
//!
//! `cargo run --release`, `cargo test --release --workspace` and `pip install ./python` compile the same
//! crates. They can use each other's only if each of these has the same features in all three, down to the
//! macros of serde. pyo3, which the Python package uses, and criterion, jsonschema and proptest, which the
//! tests and benches use, ask for features of syn, once_cell, either, hashbrown, num-bigint and num-rational
//! that the command does not need, and clap for features of anstyle, errno and rustix that the Python package
//! does not need; dependencies of this package ask for the same. Without them nearly everything would be
//! compiled twice.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}

//! Does nothing, and is here because Cargo looks at build dependencies only where there is a build script.
//!
//! `cargo run --release` and `pip install ./python` compile the same crates. They can use each other's only if each of these has the same
//! features in both, down to the macros of serde. The macros of pyo3, which the Python package uses, ask for two features of syn that the
//! command does not need; the build dependency of this package asks for the same. Without it everything would be compiled twice.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}

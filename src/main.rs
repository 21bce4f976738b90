//! The `elastocap` command.
fn main() {}

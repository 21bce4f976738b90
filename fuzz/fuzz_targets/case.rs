//! `cargo +nightly fuzz run case`: any text as a case file.

#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(text) = std::str::from_utf8(bytes) {
        match elastocap_case::parse(text, Path::new("fuzz.toml")) {
            Ok(case) => assert!(case.bodies.len() <= 6_000),
            // A message has to be found for whatever is wrong.
            Err(error) => assert!(!error.render(false).is_empty()),
        }
    }
});

//! `cargo +nightly fuzz run obj`: any bytes as an OBJ file.

#![no_main]

use elastocap_geometry::import::obj::{Placement, surface};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    drop(surface(bytes, "fuzz.obj", Placement { unit: 1.0, translate: [0.0; 3] }));
});

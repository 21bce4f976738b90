//! `cargo +nightly fuzz run msh`: any bytes as a .msh file.

#![no_main]

use elastocap_geometry::import::gmsh::mesh;
use elastocap_geometry::import::obj::Placement;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    drop(mesh(bytes, "fuzz.msh", Placement { unit: 1.0, translate: [0.0; 3] }));
});

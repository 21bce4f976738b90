//! Checks that `--threads` changes the duration of a run but none of its numbers.

use std::path::{Path, PathBuf};

use crate::support::{Sandbox, acceptance};

/// The numbers of a run as text: its tables, and result.json without the times.
fn numbers(case: &Path, threads: &str) -> String {
    let sandbox = Sandbox::new();
    sandbox.run(case, &["--threads", threads, "--no-fields", "--no-scene"]).exits_with(0);
    let names = sandbox.names("out");
    let tables: String = names
        .iter()
        .filter(|name| name.ends_with(".csv"))
        .map(|name| sandbox.read(&format!("out/{name}")))
        .collect();
    let json = sandbox.json("out/result.json");
    assert_eq!(json["threads"].to_string(), threads);
    let mut steps = json["steps"].clone();
    for step in steps.as_array_mut().expect("steps") {
        let step = step.as_object_mut().expect("a step");
        for key in ["seconds", "memory_bytes"] {
            step.remove(key);
        }
    }
    tables + &steps.to_string()
}

fn same_at_any_number_of_threads(case: &Path) {
    let alone = numbers(case, "1");
    for threads in ["2", "3"] {
        assert!(numbers(case, threads) == alone, "{} differs at {threads} threads", case.display());
    }
}

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name)
}

#[test]
fn cases_that_take_a_second_at_most_give_the_same_bytes_at_any_number_of_threads() {
    for name in [
        "cube-in-cube.toml",
        "floating-plate.toml",
        "in-plane-pair.toml",
        "in-plane-pair-by-force.toml",
        "isolated-cube.toml",
        "square-plates.toml",
    ] {
        same_at_any_number_of_threads(&case(name));
    }
}

#[test]
fn spheres_in_tetrahedra_give_the_same_bytes_at_any_number_of_threads() {
    same_at_any_number_of_threads(&acceptance("layered-spheres.toml"));
}

#[test]
fn a_layer_that_finite_elements_deform_gives_the_same_bytes_at_any_number_of_threads() {
    let text = std::fs::read_to_string(case("layer-on-substrate.toml")).expect("a case file");
    let sandbox = Sandbox::new();
    let loads = text.lines().find(|line| line.starts_with("compression")).expect("loads");
    let text = text.replace(loads, "compression = [0.1]");
    same_at_any_number_of_threads(&sandbox.case("layer.toml", &text));
}

/// Its lines are long enough for faer to share the work of their singular vectors out among threads, if it
/// may.
#[test]
fn the_fine_grids_of_the_stacked_pair_give_the_same_bytes_at_any_number_of_threads() {
    let text = std::fs::read_to_string(case("stacked-pair.toml")).expect("a case file");
    let steps = "{ from = 0.0, to = 0.4, points = 9 }";
    assert!(text.contains(steps), "{text}");
    let sandbox = Sandbox::new();
    same_at_any_number_of_threads(&sandbox.case("stacked.toml", &text.replace(steps, "[0.35]")));
}

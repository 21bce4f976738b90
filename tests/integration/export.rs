//! Tests of the files and refusals of `elastocap export`.

use crate::support::{STEPS, Sandbox, acceptance, quick_pair};

/// A sandbox with the result of a pair under these loads in `out`.
fn solved(load: &str, status: i32) -> Sandbox {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, load));
    sandbox.run(&case, &["--no-fields", "--no-scene", "--quiet"]).exits_with(status);
    sandbox
}

#[test]
fn each_format_goes_to_a_file_with_the_name_of_the_result() {
    let sandbox = solved("force = [\"0 N\", \"0.05 N\", \"0.1 N\"]", 0);
    for (format, file, words) in [
        ("spice", "out.lib", ".subckt out electrode_left electrode_right force outside"),
        ("verilog-a", "out.va", "module out(electrode_left, electrode_right, force_n, outside);"),
        ("table", "out.csv", "electrode-left,electrode-right,0,"),
    ] {
        let output = sandbox.elastocap(&["export", format, "out"]).exits_with(0);
        assert_eq!(output.stdout, format!("{file}\n"));
        assert!(sandbox.read(file).contains(words), "{words}");
        // The same text on the standard output, from the file in the folder too.
        let printed = sandbox.elastocap(&["export", format, "out/result.json", "-o", "-"]).exits_with(0);
        assert_eq!(printed.stdout, sandbox.read(file));
    }
    let output = sandbox.elastocap(&["export", "fmu", "out", "--no-binary"]).exits_with(0);
    assert_eq!(output.stdout, "out.fmu\n");
    sandbox.elastocap(&["export", "table", "out", "-o", "all.json", "--points", "3"]).exits_with(0);
    let table = sandbox.json("all.json");
    assert_eq!(table["forces_n"].as_array().map(Vec::len), Some(3));
    assert_eq!(table["capacitors"][0]["table"].as_array().map(Vec::len), Some(7));
}

#[test]
fn the_matrix_of_a_pair_and_a_given_name_can_be_asked_for() {
    let sandbox = solved("force = [\"0 N\", \"0.05 N\"]", 0);
    let output = sandbox.elastocap(&["export", "spice", "out", "--matrix", "--name", "my part", "-o", "-"]);
    let text = output.exits_with(0).stdout;
    assert!(text.contains(".subckt my_part electrode_left electrode_right common force outside"), "{text}");
    assert!(text.contains("band_ground=0"), "{text}");
}

#[test]
fn a_file_that_is_there_is_kept_unless_it_may_be_replaced() {
    let sandbox = solved("force = [\"0 N\", \"0.05 N\"]", 0);
    sandbox.case("part.lib", "mine");
    let export = |more: &[&str]| {
        let arguments = [&["export", "spice", "out", "-o", "part.lib"], more].concat();
        sandbox.elastocap(&arguments)
    };
    let output = export(&[]).exits_with(2);
    assert!(output.stderr.contains("`part.lib` is there already"), "{}", output.stderr);
    assert_eq!(sandbox.read("part.lib"), "mine");
    export(&["--overwrite"]).exits_with(0);
    assert!(sandbox.read("part.lib").contains(".subckt"));
    let output = sandbox.elastocap(&["export", "spice", "out", "-o", "no/such/part.lib"]).exits_with(1);
    assert!(output.stderr.contains("name another file"), "{}", output.stderr);
    assert_eq!(sandbox.names("."), ["out", "pair.toml", "part.lib"]);
}

#[test]
fn an_fmu_without_a_compiler_has_its_sources_and_says_so() {
    let sandbox = solved("force = [\"0 N\", \"0.05 N\"]", 0);
    let output = sandbox.elastocap(&["export", "fmu", "out", "--compiler", "no-such-compiler"]).exits_with(0);
    assert!(output.stderr.contains("`no-such-compiler` cannot be started"), "{}", output.stderr);
    let archive = std::fs::read(sandbox.path("out.fmu")).expect("an archive");
    let text = String::from_utf8_lossy(&archive);
    assert!(text.contains("sources/model.c") && !text.contains("binaries/"));
    let output = sandbox.elastocap(&["export", "fmu", "out", "-o", "-"]).exits_with(2);
    assert!(output.stderr.contains("does not go to the standard output"), "{}", output.stderr);
}

#[test]
fn results_that_have_no_model_are_refused_and_nothing_is_written() {
    let failed = solved("force = [\"0 N\", \"0.05 N\", \"1 MN\"]", 3);
    let beyond = solved("compression = [0.0, 0.2, 0.97]", 3);
    let is_static = Sandbox::new();
    is_static.run(&acceptance("cube-in-cube.toml"), &["--no-fields", "--no-scene", "--quiet"]).exits_with(0);
    for (sandbox, words) in [
        (&failed, "step 2 of the run has no result"),
        (&beyond, "step 2 of the run has no force"),
        (&is_static, "the result has no load"),
    ] {
        let before = sandbox.names(".");
        for format in ["spice", "verilog-a", "fmu", "table"] {
            let output = sandbox.elastocap(&["export", format, "out"]).exits_with(2);
            assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
            assert_eq!(output.stdout, "");
        }
        assert_eq!(sandbox.names("."), before);
    }
    let output = is_static.elastocap(&["export", "spice", "nowhere"]).exits_with(2);
    assert!(output.stderr.contains("name the output folder of a run"), "{}", output.stderr);
}

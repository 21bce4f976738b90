//! Checks that each mistake in the input gives one message, and that nothing is solved or written.

use crate::support::{STEPS, Sandbox, acceptance, quick_pair};

#[test]
fn every_bad_case_file_is_refused_before_anything_is_written() {
    let mut count = 0;
    for entry in std::fs::read_dir(acceptance("bad")).expect("the bad files").flatten() {
        let sandbox = Sandbox::new();
        count += 1;
        for command in ["run", "check", "mesh"] {
            let path = entry.path();
            let mut arguments = vec![command, path.to_str().expect("UTF-8")];
            if command != "check" {
                arguments.extend(["-o", "out"]);
            }
            let output = sandbox.elastocap(&arguments).exits_with(2);
            assert_eq!(output.stdout, "", "{arguments:?}");
            assert!(output.stderr.starts_with("error"), "{}", output.stderr);
            assert_eq!(output.stderr.matches("error").count(), 1, "{}", output.stderr);
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            assert!(output.stderr.contains(&name), "{name}: {}", output.stderr);
            assert!(output.stderr.contains("help"), "{name}: {}", output.stderr);
        }
        assert_eq!(sandbox.names("."), Vec::<String>::new(), "{entry:?}");
    }
    assert!(count >= 15, "{count} files");
}

#[test]
fn a_missing_file_and_a_folder_are_bad_input() {
    let sandbox = Sandbox::new();
    let missing = sandbox.elastocap(&["run", "nowhere.toml"]).exits_with(2);
    assert!(missing.stderr.contains("nowhere.toml"), "{}", missing.stderr);
    let folder = sandbox.elastocap(&["run", "."]).exits_with(2);
    assert!(folder.stderr.contains("folder"), "{}", folder.stderr);
    assert_eq!(sandbox.names("."), Vec::<String>::new());
}

#[test]
fn an_unknown_argument_is_bad_input() {
    let sandbox = Sandbox::new();
    sandbox.elastocap(&["run", "--frobnicate", "case.toml"]).exits_with(2);
    sandbox.elastocap(&["run"]).exits_with(2);
    sandbox.elastocap(&["check", "case.toml", "--threads", "0"]).exits_with(2);
    sandbox.elastocap(&["--help"]).exits_with(0);
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_to_is_reported_before_anything_is_solved() {
    let sandbox = Sandbox::new();
    sandbox.case("file", "");
    // Solving this takes far more than the ten seconds of processor time that the command gets.
    let text = std::fs::read_to_string(acceptance("stacked-pair.toml")).expect("the acceptance files");
    let text = text.replace("points = 9", "points = 900").replace("1e-3", "1e-5");
    let long = sandbox.case("long.toml", &text);
    let case = long.to_str().expect("UTF-8");
    for folder in ["file", "file/below"] {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", "ulimit -t 10; exec \"$@\"", "sh", crate::support::BINARY, "run", case]);
        command.args(["-o", folder]).current_dir(sandbox.path("."));
        let output = crate::support::Finished::from(command.output().expect("sh")).exits_with(1);
        assert!(output.stderr.contains("cannot write to the output folder"), "{}", output.stderr);
        assert_eq!(output.stdout, "");
        sandbox.elastocap(&["mesh", case, "-o", folder]).exits_with(1);
    }
    assert_eq!(sandbox.names("."), ["file", "long.toml"]);
}

#[test]
fn a_folder_in_the_place_of_a_result_is_an_error_that_changes_nothing() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.1]"));
    std::fs::create_dir_all(sandbox.path("out/curve.csv")).expect("a folder");
    let output = sandbox.run(&case, &[]).exits_with(1);
    assert!(output.stderr.contains("curve.csv"), "{}", output.stderr);
    assert_eq!(sandbox.names("out"), ["curve.csv"]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_file_half_written() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.1]"));
    // A limit on the size of files stands in for a full disk: writing fails part of the way in the same
    // manner.
    let script = "trap '' XFSZ; ulimit -f 4; exec \"$@\"";
    let case = case.to_str().expect("UTF-8");
    for more in [&[][..], &["--no-fields"]] {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", script, "sh", crate::support::BINARY, "run", case, "-o", "out"]).args(more);
        command.current_dir(sandbox.path("."));
        let output = crate::support::Finished::from(command.output().expect("sh")).exits_with(1);
        assert!(output.stderr.contains("cannot write `out"), "{}", output.stderr);
        assert_eq!(sandbox.names("."), ["pair.toml"], "the folder that was made is gone again");
    }
}

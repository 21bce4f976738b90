//! Tests of files read from folders of others, and of files written into folders that are open to others.

#![cfg(unix)]

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{BINARY, Finished, STEPS, Sandbox, acceptance, quick_pair};

/// A sandbox with a pair that is solved quickly.
fn with_case() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.case("pair.toml", &quick_pair(STEPS, "force = [\"0 N\", \"0.05 N\", \"0.1 N\"]"));
    sandbox
}

/// The same sandbox, with the pair solved into `out`.
fn solved() -> Sandbox {
    let sandbox = with_case();
    sandbox.elastocap(&RUN).exits_with(0);
    sandbox
}

const RUN: [&str; 7] = ["run", "pair.toml", "-o", "out", "--no-fields", "--no-scene", "--quiet"];

/// Runs the command, which must end by itself within two minutes, also on a busy machine.
fn ends(sandbox: &Sandbox, arguments: &[&str]) -> Finished {
    let mut child = sandbox
        .command(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let begin = Instant::now();
    while child.try_wait().expect("a process").is_none() {
        if begin.elapsed() > Duration::from_secs(120) {
            child.kill().expect("it can be ended");
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Finished::from(child.wait_with_output().expect("what it said"))
}

fn in_shell(sandbox: &Sandbox, script: &str) -> Finished {
    let mut command = Command::new("sh");
    command.args(["-c", script]).env("ELASTOCAP", BINARY).current_dir(sandbox.path("."));
    Finished::from(command.output().expect("a shell"))
}

type Made = fn(&Path);

/// Ways to make a file without an end, or whose end is never reached.
fn endless() -> [(&'static str, Made); 3] {
    [
        ("a pipe", |file| {
            assert!(Command::new("mkfifo").arg(file).status().expect("mkfifo").success());
        }),
        ("a link to a device", |file| symlink("/dev/zero", file).expect("a link")),
        ("a hole of a terabyte", |file| {
            std::fs::File::create(file).and_then(|f| f.set_len(1 << 40)).expect("a file");
        }),
    ]
}

fn is_refused(output: &Finished, what: &str) {
    assert!(
        output.stderr.contains("not a regular file") || output.stderr.contains("larger than"),
        "{what}: {output:?}"
    );
}

#[test]
fn a_result_that_does_not_end_is_refused_by_all_that_read_it() {
    let sandbox = solved();
    std::fs::rename(sandbox.path("out"), sandbox.path("good")).expect("moved");
    for (what, make) in endless() {
        std::fs::create_dir_all(sandbox.path("out")).expect("a folder");
        make(&sandbox.path("out/result.json"));
        for (arguments, status) in [
            (&RUN[..], 1),
            (&["compare", "good", "out"], 2),
            (&["force", "out", "--capacitance", "40fF"], 2),
            (&["export", "spice", "out"], 2),
            (&["export", "table", "out/result.json"], 2),
            (&["mesh", "pair.toml", "-o", "out"], 1),
        ] {
            let output = ends(&sandbox, arguments).exits_with(status);
            is_refused(&output, &format!("{what}, {arguments:?}"));
        }
        assert_eq!(sandbox.names("out"), ["result.json"], "{what}");
        std::fs::remove_dir_all(sandbox.path("out")).expect("removed");
    }
}

#[test]
fn a_stopped_run_whose_file_does_not_end_is_refused() {
    let sandbox = with_case();
    let resume = ["run", "pair.toml", "-o", "out", "--resume"];
    for (what, make) in endless() {
        std::fs::create_dir_all(sandbox.path("out.partial")).expect("a folder");
        let index = r#"{"versions": {"elastocap": "0.1.0"}, "status": "stopped", "files": ["resume.json"]}"#;
        sandbox.case("out.partial/result.json", index);
        make(&sandbox.path("out.partial/resume.json"));
        is_refused(&ends(&sandbox, &resume).exits_with(2), what);
        std::fs::remove_dir_all(sandbox.path("out.partial")).expect("removed");
    }
}

#[test]
fn a_plan_of_an_ended_run_moves_no_files_of_other_folders() {
    let sandbox = with_case();
    sandbox.case("precious.txt", "mine");
    for (what, plan) in [
        ("removed", r#"{"remove": ["../precious.txt"], "place": []}"#),
        ("replaced", r#"{"remove": [], "place": ["../precious.txt"]}"#),
    ] {
        std::fs::create_dir_all(sandbox.path("out/.elastocap-commit")).expect("a folder");
        std::fs::write(sandbox.path("out/.elastocap-commit/.plan"), plan).expect("a plan");
        ends(&sandbox, &RUN);
        assert_eq!(sandbox.read("precious.txt"), "mine", "{what}");
        std::fs::remove_dir_all(sandbox.path("out")).expect("removed");
    }
}

const SWEEP: [&str; 6] =
    ["sweep", "pair.toml", "-o", "swept", "--set", "electrodes.in_plane_pair.gap=50um,60um"];

#[test]
fn a_sweep_reads_files_alone_and_writes_through_no_link() {
    let sandbox = with_case();
    for (what, make) in endless() {
        std::fs::create_dir_all(sandbox.path("swept")).expect("a folder");
        make(&sandbox.path("swept/manifest.json"));
        for arguments in [&SWEEP[..], &["gather", "swept", "-o", "whole"]] {
            is_refused(&ends(&sandbox, arguments).exits_with(2), what);
        }
        std::fs::remove_dir_all(sandbox.path("swept")).expect("removed");
        make(&sandbox.path("list"));
        let output = ends(&sandbox, &["sweep", "pair.toml", "--list", "list", "-o", "swept"]).exits_with(2);
        is_refused(&output, what);
        std::fs::remove_file(sandbox.path("list")).expect("removed");
    }
    // A record that is not a regular file is solved again, and replaced.
    sandbox.elastocap(&SWEEP).exits_with(0);
    let table = sandbox.read("swept/sweep.csv");
    for (what, make) in endless() {
        std::fs::remove_file(sandbox.path("swept/cases/000001.jsonl")).expect("removed");
        make(&sandbox.path("swept/cases/000001.jsonl"));
        let output = ends(&sandbox, &SWEEP).exits_with(0);
        assert!(
            output.stderr.contains("case 1 is solved again: its file cannot be read"),
            "{what}: {output:?}"
        );
        assert_eq!(sandbox.read("swept/sweep.csv"), table, "{what}");
        assert!(sandbox.path("swept/cases/000001.jsonl").symlink_metadata().expect("a record").is_file());
    }
}

#[test]
fn links_that_lie_in_wait_in_a_folder_are_not_followed() {
    let sandbox = with_case();
    sandbox.case("precious.txt", "mine");
    std::fs::create_dir(sandbox.path("mine")).expect("a folder");
    std::fs::create_dir(sandbox.path("swept")).expect("a folder");
    let names = [".manifest.json.half", ".sweep.csv.half", "sweep.svg.half"];
    for name in names {
        symlink(sandbox.path("precious.txt"), sandbox.path("swept").join(name)).expect("a link");
    }
    sandbox.elastocap(&SWEEP).exits_with(0);
    assert_eq!(sandbox.read("precious.txt"), "mine");
    std::fs::remove_dir_all(sandbox.path("swept")).expect("removed");

    std::fs::create_dir(sandbox.path("swept")).expect("a folder");
    symlink(sandbox.path("mine"), sandbox.path("swept/cases")).expect("a link");
    let output = sandbox.elastocap(&SWEEP).exits_with(2);
    assert!(output.stderr.contains("`swept/cases` is not a folder itself but a link"), "{output:?}");
    assert!(sandbox.names("mine").is_empty());
    std::fs::remove_file(sandbox.path("swept/cases")).expect("removed");
    symlink(sandbox.path("new.txt"), sandbox.path("swept/.lock")).expect("a link");
    let output = sandbox.elastocap(&SWEEP).exits_with(1);
    assert!(output.stderr.contains(".lock"), "{output:?}");
    assert!(!sandbox.path("new.txt").exists());
}

#[test]
fn tables_of_an_earlier_sweep_stay_until_new_ones_stand_and_then_go() {
    let sandbox = with_case();
    let gap = "electrodes.in_plane_pair.gap=uniform(40um, 60um)";
    sandbox.elastocap(&["sweep", "pair.toml", "-o", "swept", "--random", "3", "--set", gap]).exits_with(0);
    assert!(sandbox.names("swept").contains(&"statistics.csv".to_owned()));
    assert_eq!(sandbox.names("swept/cases").len(), 3);
    let mut again = SWEEP.to_vec();
    again.push("--overwrite");
    // The sweep is killed after it has begun: earlier files are complete, and no file is half-written.
    let table = sandbox.read("swept/sweep.csv");
    let mut child =
        sandbox.command(&again).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    while !sandbox.read("swept/manifest.json").contains("60um\\\"") && child.try_wait().expect("it").is_none()
    {
    }
    child.kill().expect("ended");
    // The sweep may have ended before.
    if !child.wait().expect("it is over").success() {
        assert!(!sandbox.read("swept/sweep.csv").is_empty());
        assert!(sandbox.names("swept/cases").len() >= 3);
    }
    sandbox.elastocap(&again).exits_with(0);
    assert_ne!(sandbox.read("swept/sweep.csv"), table);
    assert!(!sandbox.names("swept").contains(&"statistics.csv".to_owned()));
    assert_eq!(sandbox.names("swept/cases"), ["000000.jsonl", "000001.jsonl"]);
}

#[test]
fn results_of_a_case_with_an_odd_name_stay_in_the_output_folder() {
    let sandbox = with_case();
    let text = sandbox.read("pair.toml");
    std::fs::create_dir(sandbox.path("inner")).expect("a folder");
    for (name, folder) in [
        ("...toml", "case"),
        ("..toml", "case"),
        ("con.toml", "con_"),
        ("a\nb .toml", "a_b"),
        ("x.partial.toml", "x.partial_"),
    ] {
        sandbox.case(&format!("inner/{name}"), &text);
        let inner = sandbox.path("inner");
        let run = |arguments: &[&str]| {
            let output =
                Command::new(BINARY).args(arguments).current_dir(&inner).output().expect("it starts");
            Finished::from(output).exits_with(0)
        };
        run(&["run", name, "--no-fields", "--no-scene", "--quiet"]);
        assert!(sandbox.path(&format!("inner/results/{folder}/result.json")).exists(), "{name:?}");
        run(&["sweep", name, "--quiet", "--set", "electrodes.in_plane_pair.gap=50um"]);
        assert!(sandbox.path(&format!("inner/results/{folder}-sweep/sweep.csv")).exists(), "{name:?}");
        assert_eq!(sandbox.names("."), ["inner", "pair.toml"], "{name:?}");
        assert_eq!(
            sandbox.names("inner/results"),
            [folder.to_owned(), format!("{folder}-sweep")],
            "{name:?}"
        );
        std::fs::remove_dir_all(sandbox.path("inner/results")).expect("removed");
        std::fs::remove_file(sandbox.path(&format!("inner/{name}"))).expect("removed");
    }
    // Two of several cases have no name left after cleaning.
    for name in ["...toml", "..toml"] {
        sandbox.case(name, &text);
    }
    let output = sandbox.elastocap(&["run", "...toml", "..toml", "-o", "both"]).exits_with(2);
    assert!(output.stderr.contains("would both be written to `both/case`"), "{output:?}");
}

#[test]
fn what_a_killed_command_left_is_removed_and_a_link_is_replaced_itself() {
    let sandbox = solved();
    let left = ".elastocap-0123456789abcdef.new";
    let fit =
        ["optimise", "pair.toml", "--vary", "electrodes.in_plane_pair.gap=40um..60um", "--maximise", "C0"];
    let fit = [&fit[..], &["--max-evaluations", "3", "-o", "best.toml", "--quiet"]].concat();
    let commands: [&[&str]; 5] = [
        &["export", "spice", "out"],
        &["compare", "out", "out", "--html", "page.html"],
        &["new", "pair", "new.toml"],
        &["man", "."],
        &fit,
    ];
    for arguments in commands {
        sandbox.case(left, "half");
        let output = sandbox.elastocap(arguments);
        assert!(matches!(output.status, Some(0 | 3)), "{output:?}");
        assert!(!sandbox.path(left).exists(), "{arguments:?}");
    }
    assert!(sandbox.names(".").iter().all(|name| !name.starts_with('.')), "{:?}", sandbox.names("."));
    sandbox.case("precious.txt", "mine");
    for (name, more) in
        [("new.toml", &["new", "pair", "new.toml", "--overwrite"][..]), ("page.html", commands[1])]
    {
        std::fs::remove_file(sandbox.path(name)).expect("removed");
        symlink(sandbox.path("precious.txt"), sandbox.path(name)).expect("a link");
        sandbox.elastocap(more).exits_with(0);
        assert!(sandbox.path(name).symlink_metadata().expect("a file").is_file(), "{name}");
        assert_eq!(sandbox.read("precious.txt"), "mine", "{name}");
        std::fs::remove_file(sandbox.path(name)).expect("removed");
        symlink("/dev/null", sandbox.path(name)).expect("a link");
        sandbox.elastocap(more).exits_with(1);
        assert!(sandbox.path(name).symlink_metadata().expect("a link").is_symlink(), "{name}");
    }
}

#[test]
fn a_limit_on_the_size_of_files_is_an_error_and_leaves_nothing() {
    let sandbox = solved();
    for command in [
        "new pair new.toml",
        "run pair.toml -o other --quiet",
        "export spice out",
        "sweep pair.toml --set electrodes.in_plane_pair.gap=50um -o swept",
    ] {
        let before = sandbox.names(".");
        let output = in_shell(&sandbox, &format!("ulimit -f 0; \"$ELASTOCAP\" {command}")).exits_with(1);
        assert!(
            output.stderr.contains("cannot write") && output.stderr.contains("File too large"),
            "{output:?}"
        );
        if !command.starts_with("sweep") {
            assert_eq!(sandbox.names("."), before, "{command}");
        }
    }
    // Files that could not be written leave nothing behind.
    sandbox.elastocap(&["new", "pair", "new.toml"]).exits_with(0);
}

#[test]
fn an_export_of_an_absurd_bound_is_refused() {
    let sandbox = solved();
    let mut result = sandbox.json("out/result.json");
    result["steps"][1]["capacitance_upper_f"] = serde_json::json!(1e308);
    sandbox.case("out/result.json", &result.to_string());
    for format in ["spice", "verilog-a", "table", "fmu"] {
        let output = sandbox.elastocap(&["export", format, "out", "--no-binary"]).exits_with(2);
        assert!(output.stderr.contains("step 1 of the result has an impossible"), "{output:?}");
    }
}

#[test]
fn a_file_named_by_mistake_is_not_shown() {
    let sandbox = Sandbox::new();
    for text in ["\"hunter2\"", "[\"hunter2\"]", "hunter2", "{\"title\": {\"hunter2\": 1}}"] {
        sandbox.case("secret.json", text);
        let pair = sandbox.path("pair.toml");
        sandbox
            .case("pair.toml", &std::fs::read_to_string(acceptance("in-plane-pair.toml")).expect("a case"));
        assert!(pair.exists());
        std::fs::create_dir_all(sandbox.path("swept")).expect("a folder");
        sandbox.case("swept/manifest.json", text);
        for arguments in [
            &["force", "secret.json", "--capacitance", "40fF"][..],
            &["compare", "secret.json", "secret.json"],
            &["export", "spice", "secret.json"],
            &["gather", "swept", "-o", "whole"],
            &SWEEP,
        ] {
            let output = ends(&sandbox, arguments).exits_with(2);
            assert!(!output.stderr.contains("hunter2"), "{arguments:?}: {output:?}");
        }
    }
}

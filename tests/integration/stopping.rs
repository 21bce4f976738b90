//! Tests of stopped runs, of the results that they keep, and of runs that resume them.

use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::support::{Finished, STEPS, Sandbox, acceptance, quick_pair};

/// A case of this many steps, each of which takes a while.
fn long_case(sandbox: &Sandbox, steps: usize) -> PathBuf {
    let text = quick_pair("relative_tolerance = 0.05", "relative_tolerance = 1e-4");
    let load = format!("compression = {{ from = 0.0, to = 0.4, points = {steps} }}");
    sandbox.case("long.toml", &text.replace(STEPS, &load))
}

#[cfg(unix)]
/// Whether this process, and with it those that it starts, ignores SIGHUP, as under `nohup`.
fn hang_up_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

#[test]
fn a_signal_keeps_what_is_done_and_marks_the_rest() {
    let signals = if hang_up_is_ignored() { vec!["-INT", "-TERM"] } else { vec!["-INT", "-TERM", "-HUP"] };
    for signal in signals {
        let sandbox = Sandbox::new();
        let case = long_case(&sandbox, 400);
        let child = sandbox
            .command(&["run", case.to_str().expect("UTF-8"), "-o", "out"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let staged = || {
            let staging = sandbox.names(".").into_iter().find(|name| name.starts_with(".out.elastocap-"));
            let fields =
                |name: String| sandbox.names(&name).iter().filter(|file| file.ends_with(".vtu")).count();
            staging.map_or(0, fields)
        };
        for _ in 0..6000 {
            if staged() >= 2 {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let id = child.id().to_string();
        assert!(std::process::Command::new("kill").args([signal, &id]).status().expect("kill").success());
        let output = Finished::from(child.wait_with_output().expect("it ends")).exits_with(3);
        assert!(output.stderr.contains("marked incomplete"), "{}", output.stderr);
        assert!(output.stderr.contains("`out.partial`"), "{}", output.stderr);
        let table = sandbox.table("out.partial/curve.csv");
        let count = |status: &str| table.texts("status").iter().filter(|s| s.starts_with(status)).count();
        // A step that was being solved has the bounds that were known by then, if any.
        let [done, halfway, not_run] = ["ok", "tolerance not reached", "not run"].map(count);
        assert_eq!(done + halfway + not_run, 400, "{:?}", table.texts("status"));
        assert!(done >= 2 && halfway <= 16 && not_run > 0, "{done} {halfway} {not_run}");
        // Forces need no field.
        assert!(table.numbers("force_n").iter().all(|force| *force >= 0.0));
        assert_eq!(sandbox.json("out.partial/result.json")["status"], "stopped");
        assert_eq!(sandbox.names("."), ["long.toml", "out.partial"]);
    }
}

#[test]
fn a_run_that_goes_on_from_a_stopped_one_ends_with_the_same_files() {
    let sandbox = Sandbox::new();
    let case = long_case(&sandbox, 12);
    sandbox.elastocap(&["run", case.to_str().expect("UTF-8"), "-o", "whole"]).exits_with(0);
    let (mut stopped, mut time) = (0, 0.4);
    let mut output = sandbox.run(&case, &["--max-time", "0.4s"]);
    while output.status == Some(3) {
        assert!(output.stderr.contains("the time of --max-time is over"), "{}", output.stderr);
        assert_eq!(sandbox.names("out"), Vec::<String>::new());
        stopped += 1;
        // The time grows, so that a busy machine also finishes.
        time *= 1.3;
        output = sandbox.run(&case, &["--resume", "--max-time", &format!("{time}s")]);
    }
    output.exits_with(0);
    assert!(stopped > 0, "it was never stopped");
    assert_eq!(sandbox.names("."), ["long.toml", "out", "whole"]);
    assert_eq!(sandbox.names("out"), sandbox.names("whole"));
    for name in
        sandbox.names("whole").iter().filter(|name| !["result.json", "report.html"].contains(&name.as_str()))
    {
        let [one, other] = ["whole", "out"].map(|folder| std::fs::read(sandbox.path(folder).join(name)));
        assert!(one.expect("a file") == other.expect("a file"), "{name} differs");
    }
}

#[test]
fn a_run_goes_on_from_nothing_but_itself() {
    let sandbox = Sandbox::new();
    let case = long_case(&sandbox, 400);
    let output = sandbox.run(&case, &["--resume"]).exits_with(2);
    assert!(output.stderr.contains("there is no stopped run to go on from"), "{}", output.stderr);
    assert_eq!(sandbox.names("."), ["long.toml"]);
    sandbox.run(&case, &["--max-time", "2 s"]).exits_with(3);
    let before = sandbox.read("out.partial/curve.csv");
    let output = sandbox.run(&case, &["--resume", "--no-prune"]).exits_with(2);
    assert!(output.stderr.contains("another choice of --no-prune"), "{}", output.stderr);
    let output = sandbox.run(&case, &["--resume", "--only", "curve,fields,sections,report"]).exits_with(2);
    assert!(output.stderr.contains("another choice of --only"), "{}", output.stderr);
    // A manipulated record must not have other files copied into the results.
    let record = sandbox.read("out.partial/resume.json");
    let changed = record.replace("\"step_", "\"../step_");
    // On a busy machine the record may have no step.
    if changed != record {
        sandbox.case("out.partial/resume.json", &changed);
        let output = sandbox.run(&case, &["--resume"]).exits_with(2);
        assert!(output.stderr.contains("it names a file that no run writes"), "{}", output.stderr);
        sandbox.case("out.partial/resume.json", &record);
    }
    let other = long_case(&sandbox, 399);
    let output = sandbox.run(&other, &["--resume"]).exits_with(2);
    assert!(output.stderr.contains("another case"), "{}", output.stderr);
    assert_eq!(sandbox.read("out.partial/curve.csv"), before);
    let output = sandbox.run(&case, &["--max-time", "10 minutes"]).exits_with(2);
    assert!(output.stderr.contains("a time with its unit"), "{}", output.stderr);
}

#[test]
fn a_run_into_its_own_current_folder_replaces_its_files_and_keeps_the_users() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0, 0.2]"));
    let name = case.to_str().expect("UTF-8");
    sandbox.elastocap(&["run", name, "-o", "."]).exits_with(0);
    assert!(sandbox.names(".").contains(&"step_001.vtu".to_owned()));
    sandbox.elastocap(&["run", name, "-o", ".", "--no-fields", "--no-scene"]).exits_with(0);
    assert_eq!(
        sandbox.names("."),
        ["capacitance.csv", "curve.csv", "curve.svg", "pair.toml", "report.html", "result.json"]
    );
}

#[test]
fn a_run_and_a_mesh_do_not_take_each_others_folder_nor_a_users() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.2]"));
    let name = case.to_str().expect("UTF-8");
    sandbox.elastocap(&["run", name]).exits_with(0);
    sandbox.elastocap(&["mesh", name]).exits_with(0);
    assert_eq!(sandbox.names("results"), ["pair", "pair-mesh"]);
    let output = sandbox.elastocap(&["mesh", name, "-o", "results/pair"]).exits_with(1);
    assert!(output.stderr.contains("holds the result of a run"), "{}", output.stderr);
    std::fs::create_dir(sandbox.path("mine")).expect("a folder");
    sandbox.case("mine/curve.csv", "measured");
    let output = sandbox.elastocap(&["run", name, "-o", "mine"]).exits_with(1);
    assert!(output.stderr.contains("is not from a run of elastocap"), "{}", output.stderr);
    assert_eq!((sandbox.read("mine/curve.csv").as_str(), sandbox.names("mine").len()), ("measured", 1));
}

#[test]
fn a_run_ends_soon_after_its_time_whatever_it_does() {
    // The first case chooses a grid for very many boxes without conductors, the second meshes round bodies.
    for name in ["no-stop-in-plan", "touch-2x2-round-finger"] {
        let sandbox = Sandbox::new();
        let case = acceptance(&format!("found3/{name}.toml"));
        let begin = Instant::now();
        let output = sandbox.run(&case, &["--max-time", "1s", "--no-fields"]).exits_with(3);
        // Two seconds on an idle machine; tests share theirs.
        assert!(
            begin.elapsed() < Duration::from_secs(15),
            "{name}: {:?}\n{}",
            begin.elapsed(),
            output.stderr
        );
        assert!(output.stderr.contains("the time of --max-time is over"), "{name}: {}", output.stderr);
        let left = sandbox.names(".");
        assert!(left.iter().all(|name| name == "out.partial"), "{left:?}");
    }
}

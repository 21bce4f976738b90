//! Tests of completions, manual pages, a case on the standard input, several cases at once, and watched
//! cases.

use std::io::Write as _;
use std::process::Stdio;

use crate::support::{Finished, Sandbox, quick_pair};

/// A case that is solved quickly.
const CUBE: &str = r#"
format = 1
title  = "A cube in a cube"

[[conductor]]
name = "inner"
box  = { min = ["-0.5 m", "-0.5 m", "-0.5 m"], max = ["0.5 m", "0.5 m", "0.5 m"] }

[surroundings]
boundary = "grounded"
walls    = { min = ["-1 m", "-1 m", "-1 m"], max = ["1 m", "1 m", "1 m"] }

[electrostatics]
relative_tolerance = 1e-2
"#;

/// The same case with a misspelled key.
fn misspelled() -> String {
    CUBE.replace("boundary", "boundery")
}

/// Runs the command with `text` on its standard input.
fn with_stdin(sandbox: &Sandbox, arguments: &[&str], text: &str) -> Finished {
    let mut command = sandbox.command(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    // The command may end before it has read all.
    let _ = stdin.write_all(text.as_bytes());
    drop(stdin);
    Finished::from(child.wait_with_output().expect("it ends"))
}

#[test]
fn completions_know_every_command_and_its_options() {
    let sandbox = Sandbox::new();
    let help = sandbox.elastocap(&["--help"]).exits_with(0).stdout;
    let commands = help.split("Commands:").nth(1).and_then(|text| text.split("\n\n").next()).expect("a list");
    let commands: Vec<_> = commands.lines().filter_map(|line| line.strip_prefix("  ")).collect();
    let commands: Vec<_> =
        commands.iter().filter_map(|line| line.split(' ').next()).filter(|w| !w.is_empty()).collect();
    assert!(commands.contains(&"run") && commands.contains(&"completions"), "{commands:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = sandbox.elastocap(&["completions", shell]).exits_with(0).stdout;
        for word in commands.iter().chain(&["max-time", "no-prune"]) {
            assert!(script.contains(word), "{shell}: no {word}");
        }
    }
    let refused = sandbox.elastocap(&["completions", "tcsh"]).exits_with(2);
    assert!(refused.stderr.contains("fish"), "{}", refused.stderr);
}

/// Checks that the completions of `elastocap run --m` in bash come from the script.
#[cfg(target_os = "linux")]
#[test]
fn bash_completes_an_option() {
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.path("script"), sandbox.elastocap(&["completions", "bash"]).stdout)
        .expect("written");
    let ask = "source ./script; COMP_WORDS=(elastocap run --m); COMP_CWORD=2; \
               _elastocap elastocap --m run; echo \"${COMPREPLY[@]}\"";
    let Ok(output) =
        std::process::Command::new("bash").args(["-c", ask]).current_dir(sandbox.path("")).output()
    else {
        return; // no bash here
    };
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "--max-time");
}

#[test]
fn every_command_has_a_manual_page() {
    let sandbox = Sandbox::new();
    let listed = sandbox.elastocap(&["man", "share/man1"]).exits_with(0).stdout;
    let names = sandbox.names("share/man1");
    assert_eq!(listed.lines().count(), names.len());
    for name in ["elastocap.1", "elastocap-run.1", "elastocap-check.1", "elastocap-man.1"] {
        assert!(names.contains(&name.to_owned()), "{names:?}");
    }
    let run = sandbox.read("share/man1/elastocap-run.1");
    assert!(run.contains(".SH EXAMPLES\n.nf\n  elastocap run cases/in\\-plane\\-pair.toml\n"), "{run}");
    let whole = sandbox.elastocap(&["man"]).exits_with(0).stdout;
    assert_eq!(whole, sandbox.read("share/man1/elastocap.1"));
    std::fs::write(sandbox.path("file"), "").expect("written");
    let refused = sandbox.elastocap(&["man", "file"]).exits_with(1);
    assert!(
        refused.stderr.contains("`file`") && refused.stderr.contains("name a folder"),
        "{}",
        refused.stderr
    );
}

#[test]
fn a_case_from_the_standard_input_gives_the_numbers_of_its_file() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("cube.toml", CUBE);
    sandbox.run(&case, &[]).exits_with(0);
    with_stdin(&sandbox, &["run", "-"], CUBE).exits_with(0);
    assert_eq!(sandbox.read("results/stdin/capacitance.csv"), sandbox.read("out/capacitance.csv"));
    with_stdin(&sandbox, &["mesh", "-"], CUBE).exits_with(0);
    assert!(sandbox.names("results/stdin-mesh").contains(&"mesh.json".to_owned()));
    // The report shows the case, though the standard input cannot be read twice.
    assert!(sandbox.read("results/stdin/report.html").contains("A cube in a cube"));
    assert!(sandbox.read("results/stdin/report.html").contains("relative_tolerance = 1e-2"));
    let planned = with_stdin(&sandbox, &["check", "-"], CUBE).exits_with(0);
    assert_eq!(planned.stdout, sandbox.elastocap(&["check", "cube.toml"]).stdout);
    let refused = with_stdin(&sandbox, &["run", "-"], &misspelled()).exits_with(2);
    assert!(
        refused.stderr.contains("<stdin>:10:1") && refused.stderr.contains("boundery"),
        "{}",
        refused.stderr
    );
    assert!(with_stdin(&sandbox, &["check", "-", "-"], CUBE).exits_with(2).stderr.contains("once only"));
    assert!(with_stdin(&sandbox, &["run", "-", "--watch"], CUBE).exits_with(2).stderr.contains("--watch"));
    assert!(with_stdin(&sandbox, &["run", "-"], "no case").exits_with(2).stderr.contains("not a case file"));
}

#[test]
fn files_that_a_case_from_the_standard_input_names_lie_in_the_current_folder() {
    let sandbox = Sandbox::new();
    let text = CUBE.replace(
        "box  = { min = [\"-0.5 m\", \"-0.5 m\", \"-0.5 m\"], max = [\"0.5 m\", \"0.5 m\", \"0.5 m\"] }",
        "surface = { file = \"none.obj\", unit = \"m\" }",
    );
    let refused = with_stdin(&sandbox, &["check", "-"], &text).exits_with(2);
    assert!(refused.stderr.contains("none.obj") && refused.stderr.contains("<stdin>:"), "{}", refused.stderr);
    let cube = "v -.5 -.5 -.5\nv .5 -.5 -.5\nv .5 .5 -.5\nv -.5 .5 -.5\nv -.5 -.5 .5\nv .5 -.5 .5\nv .5 .5 .5\nv -.5 .5 .5\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
    std::fs::write(sandbox.path("none.obj"), cube).expect("written");
    with_stdin(&sandbox, &["check", "-"], &text).exits_with(0);
}

#[test]
fn several_cases_are_solved_each_in_a_folder_of_its_own() {
    let sandbox = Sandbox::new();
    sandbox.case("cube.toml", CUBE);
    sandbox.case("pair.toml", &quick_pair("", ""));
    let output = sandbox.elastocap(&["run", "cube.toml", "pair.toml", "-o", "all"]).exits_with(0);
    assert_eq!(sandbox.names("all"), ["cube", "pair"]);
    for line in ["case 1 of 2: cube.toml", "case 2 of 2: pair.toml"] {
        assert!(output.stderr.lines().any(|output| output == line), "{}", output.stderr);
    }
    let alone = sandbox.elastocap(&["run", "pair.toml", "-o", "alone"]).exits_with(0);
    assert!(!alone.stderr.contains("case 1"), "{}", alone.stderr);
    assert_eq!(sandbox.read("all/pair/curve.csv"), sandbox.read("alone/curve.csv"));
    // One document after the other.
    let output = sandbox.elastocap(&["run", "cube.toml", "pair.toml", "--json", "-o", "json"]).exits_with(0);
    let documents = serde_json::Deserializer::from_str(&output.stdout).into_iter::<serde_json::Value>();
    let titles: Vec<_> = documents.map(|document| document.expect("JSON")["title"].clone()).collect();
    assert_eq!(titles[0], "A cube in a cube");
    assert_eq!(titles.len(), 2);
}

#[test]
fn all_that_is_wrong_in_several_cases_is_told_before_anything_is_solved() {
    let sandbox = Sandbox::new();
    sandbox.case("good.toml", CUBE);
    sandbox.case("bad.toml", &misspelled());
    let output = sandbox.elastocap(&["run", "good.toml", "bad.toml", "missing.toml"]).exits_with(2);
    assert!(
        output.stderr.contains("bad.toml:10:1") && output.stderr.contains("`missing.toml`"),
        "{}",
        output.stderr
    );
    assert_eq!(sandbox.names("."), ["bad.toml", "good.toml"]);
    let output = sandbox.elastocap(&["check", "good.toml", "bad.toml", "good.toml"]).exits_with(2);
    assert_eq!(output.stdout.matches("A cube in a cube").count(), 2, "{}", output.stdout);
    std::fs::create_dir(sandbox.path("sub")).expect("made");
    sandbox.case("sub/good.toml", CUBE);
    let output = sandbox.elastocap(&["run", "good.toml", "sub/good.toml"]).exits_with(2);
    assert!(output.stderr.contains("both be written to `results/good`"), "{}", output.stderr);
    let output = sandbox.elastocap(&["run", "good.toml", "bad.toml", "--watch"]).exits_with(2);
    assert!(output.stderr.contains("one case"), "{}", output.stderr);
}

#[test]
fn the_status_of_several_cases_is_the_worst() {
    let sandbox = Sandbox::new();
    sandbox.case("cube.toml", CUBE);
    // A tolerance that double precision does not reach.
    sandbox.case("sharp.toml", &CUBE.replace("1e-2", "1e-13"));
    let incomplete = sandbox.elastocap(&["run", "cube.toml", "--max-time", "1s", "sharp.toml"]);
    assert_eq!(incomplete.exits_with(3).status, Some(3));
    // A file stands in place of the first case's folder, which is a failure; the second case is solved all
    // the same.
    std::fs::create_dir(sandbox.path("out")).expect("made");
    std::fs::write(sandbox.path("out/cube"), "").expect("written");
    sandbox.case("other.toml", CUBE);
    sandbox.elastocap(&["run", "cube.toml", "other.toml", "-o", "out"]).exits_with(1);
    assert!(sandbox.names("out/other").contains(&"capacitance.csv".to_owned()));
}

#[cfg(unix)]
mod watched {
    use std::fs::File;
    use std::process::Child;
    use std::time::{Duration, Instant};

    use super::*;

    /// A command that watches a case and writes its messages to `log`; it ends with the test.
    struct Watch<'a> {
        sandbox: &'a Sandbox,
        child: Child,
    }

    impl<'a> Watch<'a> {
        fn start(sandbox: &'a Sandbox) -> Self {
            let log = File::create(sandbox.path("log")).expect("written");
            let mut command = sandbox.command(&["run", "case.toml", "--watch", "--no-fields", "-o", "out"]);
            let child = command.stdout(Stdio::null()).stderr(log).spawn().expect("the binary starts");
            Self { sandbox, child }
        }

        /// Waits until the command has printed `text` so many times.
        fn has_said(&self, text: &str, times: usize) {
            let begun = Instant::now();
            while self.sandbox.read("log").matches(text).count() < times {
                assert!(begun.elapsed() < Duration::from_secs(60), "{}", self.sandbox.read("log"));
                std::thread::sleep(Duration::from_millis(20));
            }
        }

        /// The value of the first capacitance in the results.
        fn capacitance(&self) -> f64 {
            self.sandbox.table("out/capacitance.csv").numbers("value_f")[0]
        }
    }

    impl Drop for Watch<'_> {
        fn drop(&mut self) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }

    #[test]
    fn a_watched_case_is_solved_again_when_it_or_its_mesh_changes_and_waits_while_it_is_broken() {
        let sandbox = Sandbox::new();
        let cube = |half: &str| {
            let corner = |x: &str, y: &str, z: &str| format!("v {x}{half} {y}{half} {z}{half}\n");
            let corners: String = ["-", ""]
                .iter()
                .flat_map(|z| [("-", "-"), ("", "-"), ("", ""), ("-", "")].map(|(x, y)| corner(x, y, z)))
                .collect();
            corners + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n"
        };
        std::fs::write(sandbox.path("cube.obj"), cube("0.5")).expect("written");
        let begin = CUBE.find("box").expect("a box");
        let end = begin + CUBE[begin..].find('\n').expect("a line");
        let text = [&CUBE[..begin], "surface = { file = \"cube.obj\", unit = \"m\" }", &CUBE[end..]].concat();
        sandbox.case("case.toml", &text);
        let mut watch = Watch::start(&sandbox);
        watch.has_said("waiting for a change of `case.toml`, `cube.obj`", 1);
        let first = watch.capacitance();
        // A smaller cube has a smaller capacitance.
        std::fs::write(sandbox.path("cube.obj"), cube("0.4")).expect("written");
        watch.has_said("waiting for a change", 2);
        let second = watch.capacitance();
        assert!(second < 0.8 * first, "{first} {second}");
        // A broken case is reported, and its earlier results stay.
        sandbox.case("case.toml", &text.replace("boundary", "boundery"));
        watch.has_said("waiting for a change", 3);
        assert!(sandbox.read("log").contains("boundery"));
        assert_eq!(watch.capacitance(), second);
        sandbox.case("case.toml", &text.replace("-1 m", "-0.8 m"));
        watch.has_said("waiting for a change", 4);
        assert!(watch.capacitance() > 1.02 * second);
        // Ctrl-C while it waits ends it in order.
        let id = watch.child.id().to_string();
        assert!(std::process::Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
        assert_eq!(watch.child.wait().expect("it ends").code(), Some(0), "{}", sandbox.read("log"));
        assert!(
            !sandbox.read("log").contains("stopping"),
            "nothing was being solved: {}",
            sandbox.read("log")
        );
    }
}

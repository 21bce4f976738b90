//! Checks that `check` and `run` answer any case file in time, within their limits of memory, with a
//! documented exit status.

use std::process::Command;
use std::time::{Duration, Instant};

use crate::support::{BINARY, Finished, STEPS, Sandbox, acceptance, quick_pair};

/// The time within which `check` must answer; generous, since tests share the machine with others.
const BUDGET: Duration = Duration::from_secs(20);

/// Runs the command in a limited address space, which must be refused or suffice.
fn limited(sandbox: &Sandbox, kibibytes: u64, arguments: &[&str]) -> Finished {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {kibibytes}; exec \"$@\""), "sh", BINARY]).args(arguments);
    Finished::from(command.current_dir(sandbox.path(".")).output().expect("sh"))
}

#[test]
fn the_files_that_once_aborted_or_never_ended_are_refused_with_a_reason() {
    for (name, reason) in [
        ("half-length-1e12mm.toml", "times as long as it is thick"),
        ("collinear-outline.toml", "the outline crosses or touches itself"),
        ("sphere-1fm-in-shell.toml", "less than a billionth of the scene"),
        ("device-file.toml", "is not a regular file"),
    ] {
        let sandbox = Sandbox::new();
        let path = acceptance("found").join(name);
        let begin = Instant::now();
        let output = limited(&sandbox, 4_000_000, &["check", path.to_str().expect("UTF-8")]).exits_with(2);
        assert!(begin.elapsed() < BUDGET, "{name}");
        assert!((output.stdout + &output.stderr).contains(reason), "{name}");
        let output = limited(&sandbox, 4_000_000, &["run", path.to_str().expect("UTF-8"), "-o", "out"]);
        assert!(matches!(output.status, Some(2 | 3)), "{name}: {output:?}");
        assert!(output.stderr.contains(reason), "{name}: {}", output.stderr);
    }
}

#[test]
fn punches_at_the_end_of_a_layer_are_pressed_or_refused_with_a_reason() {
    for (name, status) in
        [("panic-punch-run.toml", 0), ("panic-punch-rounded.toml", 0), ("panic-punch-check.toml", 3)]
    {
        let sandbox = Sandbox::new();
        let path = acceptance("found3").join(name);
        let path = path.to_str().expect("UTF-8");
        limited(&sandbox, 4_000_000, &["check", path]).exits_with(0);
        let output = limited(&sandbox, 4_000_000, &["run", path, "-o", "out"]).exits_with(status);
        let reason = "the meshes are too coarse for this load";
        assert!(
            status == 0 || output.stdout.contains(reason) || output.stderr.contains(reason),
            "{}",
            output.stdout
        );
    }
}

#[test]
fn planes_closer_together_than_rounding_are_planned_in_time() {
    let sandbox = Sandbox::new();
    let path = acceptance("found").join("planes-1e-21m-apart.toml");
    let begin = Instant::now();
    limited(&sandbox, 4_000_000, &["check", path.to_str().expect("UTF-8")]).exits_with(0);
    assert!(begin.elapsed() < BUDGET);
}

#[cfg(unix)]
#[test]
fn a_pipe_is_refused_as_case_file_surface_and_mesh() {
    let sandbox = Sandbox::new();
    for name in ["pipe.toml", "pipe.obj", "pipe.msh"] {
        assert!(Command::new("mkfifo").arg(sandbox.path(name)).status().expect("mkfifo").success());
    }
    let surface = "format = 1\n[surroundings]\nboundary = \"open\"\n[[conductor]]\nname = \"a\"\n\
         surface = { file = \"pipe.obj\", unit = \"mm\" }\n";
    let mesh = "format = 1\n[mesh]\nfile = \"pipe.msh\"\nunit = \"mm\"\n[surroundings]\nboundary = \"open\"\n[[conductor]]\n\
         name = \"a\"\nphysical = \"a\"\n";
    sandbox.case("surface.toml", surface);
    sandbox.case("mesh.toml", mesh);
    for name in ["pipe.toml", "surface.toml", "mesh.toml", "/dev/zero"] {
        for command in ["check", "run"] {
            let output = sandbox.elastocap(&[command, name]).exits_with(2);
            assert!(output.stderr.contains("not a regular file"), "{name}: {}", output.stderr);
        }
    }
}

/// Conductors in rows of ten, 1 mm large and 1 mm apart.
fn boxes(count: usize) -> String {
    let mut text = "format = 1\n[surroundings]\nboundary = \"open\"\n".to_owned();
    for k in 0..count {
        let [x, y, z] = [k % 10, k / 10 % 10, k / 100].map(|i| 2 * i);
        text += &format!(
            "[[conductor]]\nname = \"c{k}\"\nbox = {{ min = [\"{x} mm\", \"{y} mm\", \"{z} mm\"], max = [\"{} mm\", \"{} mm\", \
             \"{} mm\"] }}\n",
            x + 1,
            y + 1,
            z + 1
        );
    }
    text
}

fn slabs(count: usize) -> String {
    let mut text = boxes(1);
    for k in 0..count {
        text += &format!(
            "[[dielectric]]\nname = \"d{k}\"\nrelative_permittivity = 2\nslab = {{ axis = \"x2\", from = \"{} um\", to = \"{} um\" \
             }}\n",
            2000 + k,
            2001 + k
        );
    }
    text
}

/// The outline of a disc.
fn disc(corners: usize) -> String {
    let corner = |k: usize| {
        let (y, x) = (std::f64::consts::TAU * k as f64 / corners as f64).sin_cos();
        format!("[\"{x:.12} m\", \"{y:.12} m\"]")
    };
    let outline: Vec<String> = (0..corners).map(corner).collect();
    format!(
        "format = 1\n[surroundings]\nboundary = \"open\"\n[[conductor]]\nname = \"disc\"\nextrusion = {{ axis = \"x2\", from = \"0 \
         m\", to = \"1 m\", outline = [{}] }}\n",
        outline.join(", ")
    )
}

#[test]
fn many_bodies_and_corners_are_answered_in_time_and_memory() {
    let round = "[[conductor]]\nname = \"ball\"\nsphere = { center = [\"-10 mm\", \"0 mm\", \"0 mm\"], radius = \"1 mm\" }\n";
    for (name, text) in [
        ("1000 boxes", boxes(1000)),
        ("999 boxes and a ball", boxes(999) + round),
        ("5000 slabs", slabs(5000)),
        ("10000 corners", disc(10_000)),
    ] {
        let sandbox = Sandbox::new();
        sandbox.case("many.toml", &text);
        let begin = Instant::now();
        let output = limited(&sandbox, 4_000_000, &["check", "many.toml"]);
        assert!(begin.elapsed() < BUDGET, "{name}: {:?}", begin.elapsed());
        assert!(matches!(output.status, Some(0 | 2)), "{name}: {output:?}");
        assert!(!output.stderr.contains("panicked"), "{name}: {output:?}");
        assert!(output.status == Some(2) || output.stdout.contains("warning: "), "{name}: {output:?}");
    }
    let sandbox = Sandbox::new();
    sandbox.case("many.toml", &boxes(1001));
    let output = sandbox.elastocap(&["check", "many.toml"]).exits_with(2);
    assert!(
        output.stderr.contains("1001 conductors are more than elastocap takes, which is 1000"),
        "{}",
        output.stderr
    );
}

#[cfg(target_os = "linux")]
#[test]
fn little_address_space_ends_a_run_with_a_message_and_without_leftovers() {
    let text = quick_pair(STEPS, "compression = [0.1, 0.2]");
    let mut failed = 0;
    for megabytes in [60, 80, 100, 150, 200, 400, 2000] {
        let sandbox = Sandbox::new();
        sandbox.case("pair.toml", &text);
        for command in [&["run", "pair.toml", "-o", "out"][..], &["check", "pair.toml"]] {
            let output = limited(&sandbox, 1000 * megabytes, command);
            // A step that does not fit into the memory makes the run incomplete, and a check foresees it.
            assert!(matches!(output.status, Some(0..=3)), "{megabytes} MB, {command:?}: {output:?}");
            assert!(!output.stderr.contains("panicked"), "{megabytes} MB: {output:?}");
            if output.status == Some(1) {
                failed += 1;
                assert!(output.stderr.contains("error: "), "{megabytes} MB: {output:?}");
                // Results that were completely in place before memory ran out stay.
                if !sandbox.names("out").contains(&"result.json".to_owned()) {
                    assert_eq!(sandbox.names("."), ["pair.toml"], "{megabytes} MB");
                }
            }
            if megabytes == 2000 {
                assert_eq!(output.status, Some(0), "{output:?}");
            }
        }
    }
    assert!(failed > 0, "no limit was small enough");
}

#[test]
fn a_check_counts_roughly_where_a_finer_count_takes_long_and_its_answer_is_the_same_every_time() {
    for name in ["spiral8-and-box", "spiral5-two-boxes", "no-stop-in-plan", "many-rings"] {
        let sandbox = Sandbox::new();
        let path = acceptance(&format!("found3/{name}.toml"));
        let check = || limited(&sandbox, 4_000_000, &["check", path.to_str().expect("UTF-8")]).exits_with(0);
        let begin = Instant::now();
        let output = check();
        assert!(begin.elapsed() < BUDGET, "{name}: {:?}", begin.elapsed());
        assert!(output.stdout.contains("rough counts"), "{name}: {}", output.stdout);
        assert!(output.stdout.contains("in the largest problem"), "{name}: {}", output.stdout);
    }
}

#[test]
fn a_file_that_is_no_case_is_not_quoted() {
    let sandbox = Sandbox::new();
    sandbox.case("passwords", "root:x:0:0:secret-of-root:/root\nother:x:1:1:secret-of-other:/\n");
    let surface = "format = 1\n[surroundings]\nboundary = \"open\"\n[[conductor]]\nname = \"a\"\n\
         surface = { file = \"passwords\", unit = \"mm\" }\n";
    sandbox.case("surface.toml", surface);
    for name in ["passwords", "surface.toml"] {
        let output = sandbox.elastocap(&["check", name]).exits_with(2);
        assert!(!output.stderr.contains("secret") && !output.stderr.contains("root"), "{}", output.stderr);
    }
}

//! Tests of `elastocap sweep` and `gather`: grids, lists, random cases; killed and resumed sweeps, shards,
//! and failures.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant, SystemTime};

use crate::support::{Finished, Sandbox};

/// A pair that is solved in milliseconds.
const PAIR: &str = r#"format = 1
title = "pair"
[layer]
thickness = "450 um"   # varied
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "90 kPa"
[electrodes.in_plane_pair]
gap = "50 um"
length = "300 um"
thickness = "20 um"
width = "500 um"
height = "225 um"
shear_modulus = "rigid"
[mechanics.closed_form]
contact_half_length = "500 um"
contact_width = "500 um"
shear_length = "500 um"
[load]
compression = [0.0, 0.2]
[surroundings]
boundary = "open"
[electrostatics]
relative_tolerance = 5e-2
"#;

const GAP: &str = "electrodes.in_plane_pair.gap";

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.case("case.toml", PAIR);
    sandbox
}

/// Sweeps the case into a folder.
fn sweep(sandbox: &Sandbox, folder: &str, more: &[&str]) -> Finished {
    let mut arguments = vec!["sweep", "case.toml", "-o", folder, "--quiet"];
    arguments.extend(more);
    sandbox.elastocap(&arguments)
}

#[track_caller]
fn done(finished: &Finished) {
    assert_eq!(finished.status, Some(0), "{finished:?}");
}

#[track_caller]
fn refused(finished: &Finished, words: &str) {
    assert_eq!(finished.status, Some(2), "{finished:?}");
    assert!(finished.stderr.contains(words), "{}\nlacks: {words}", finished.stderr);
}

/// The lines of a table, field by field, without the header; the fields hold no commas here.
fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// The time at which each record was written.
fn written(folder: &Path) -> BTreeMap<String, SystemTime> {
    let entries = std::fs::read_dir(folder.join("cases")).into_iter().flatten().flatten();
    let entries = entries.map(|entry| {
        (entry.file_name().to_string_lossy().into_owned(), entry.metadata().unwrap().modified().unwrap())
    });
    entries.filter(|(name, _)| !name.starts_with('.')).collect()
}

#[test]
fn a_grid_has_a_row_for_each_case_and_step_with_the_digits_of_a_run() {
    let sandbox = sandbox();
    let set = ["--set", &format!("{GAP}=40um..60um:3"), "--set", "layer.thickness=440um,450um"];
    done(&sweep(&sandbox, "out", &set));
    let table = sandbox.read("out/sweep.csv");
    assert!(table.starts_with(&format!("case,{GAP},layer.thickness,step,compression,")), "{table}");
    assert!(table.lines().next().unwrap().ends_with(",unknowns,status,message"));
    let rows = rows(&table);
    let starts: Vec<String> = rows.iter().map(|row| row[..4].join(" ")).collect();
    assert_eq!(starts.len(), 12);
    assert_eq!(starts[..3], ["0 4e-5 0.00044 0", "0 4e-5 0.00044 1", "1 4e-5 0.00045 0"]);
    assert_eq!(starts[11], "5 6e-5 0.00045 1");
    // Case 3 has the values of the file. The model error is computed in a run, and estimated in a sweep.
    let of_model = [
        "model_error_estimate",
        "total_error_estimate",
        "change_total_error_f",
        "sensitivity_f_per_n",
        "sensitivity_error_f_per_n",
        "status",
    ];
    done(&sandbox.elastocap(&["run", "case.toml", "-o", "run", "--quiet", "--no-fields", "--no-scene"]));
    let curve = sandbox.read("run/curve.csv");
    let names: Vec<&str> = curve.lines().next().unwrap().split(',').collect();
    let compared = |row: &[String]| -> Vec<String> {
        let known = names.iter().zip(row).filter(|(name, _)| !of_model.contains(name));
        known.map(|(name, value)| format!("{name}: {value}")).collect()
    };
    let of_case = rows.iter().filter(|row| row[0] == "3").map(|row| compared(&row[4..row.len() - 1]));
    let of_run = self::rows(&curve);
    assert_eq!(of_case.collect::<Vec<_>>(), of_run.iter().map(|row| compared(row)).collect::<Vec<_>>());
    let names = sandbox.names("out");
    assert_eq!(names, [".lock", "cases", "manifest.json", "sweep.csv", "sweep.json", "sweep.svg"]);
    assert_eq!(sandbox.json("out/sweep.json")["ok"], 6);
    assert!(sandbox.read("out/sweep.svg").contains("at the last load step"));
}

#[test]
fn the_number_of_threads_does_not_change_the_table() {
    let sandbox = sandbox();
    let set = format!("{GAP}=40um..60um:4");
    for threads in ["1", "2", "7"] {
        done(&sweep(&sandbox, threads, &["--set", &set, "--threads", threads]));
    }
    let one = sandbox.read("1/sweep.csv");
    assert_eq!(one, sandbox.read("2/sweep.csv"));
    assert_eq!(one, sandbox.read("7/sweep.csv"), "seven threads for four cases");
}

#[test]
fn fields_that_cases_have_in_common_are_solved_once_and_are_the_same() {
    let sandbox = sandbox();
    // Around rigid electrodes the modulus changes only the force.
    let set = ["--set", "layer.material.neo_hookean.shear_modulus=80kPa,90kPa,100kPa", "--threads", "1"];
    let finished = sandbox.elastocap(&[&["sweep", "case.toml", "-o", "out"][..], &set].concat());
    done(&finished);
    assert!(finished.stdout.contains("4 fields were those of other cases"), "{finished:?}");
    let table = sandbox.read("out/sweep.csv");
    // Solved alone, a case is the same.
    std::fs::remove_file(sandbox.path("out/cases/000002.jsonl")).unwrap();
    done(&sweep(&sandbox, "out", &set));
    assert_eq!(sandbox.read("out/sweep.csv"), table);
    let rows = rows(&table);
    let column = |name: &str| table.lines().next().unwrap().split(',').position(|n| n == name).unwrap();
    let [force, capacitance] = [column("force_n"), column("capacitance_f")];
    assert_eq!(rows[1][capacitance], rows[5][capacitance]);
    assert_ne!(rows[1][force], rows[5][force]);
}

#[test]
fn a_list_has_one_case_for_each_row() {
    let sandbox = sandbox();
    let list =
        format!("layer.thickness, {GAP}, load.compression\n440um, 40um, [0.1]\n450um,,\"[0.0, 0.1]\"\n");
    sandbox.case("list.csv", &list);
    let finished = sandbox.elastocap(&["sweep", "case.toml", "--list", "list.csv", "-o", "out", "--json"]);
    done(&finished);
    let summary: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!((&summary["cases"], &summary["finished"]), (&2.into(), &2.into()));
    let rows = rows(&sandbox.read("out/sweep.csv"));
    assert_eq!(rows.len(), 3);
    assert_eq!(rows[0][1..3], ["0.00044", "4e-5"]);
    // Empty cells of the list take the values of the file.
    assert_eq!(rows[1][1..3], ["0.00045", "5e-5"]);
}

#[test]
fn the_same_seed_gives_the_same_table_and_statistics_name_what_matters() {
    let sandbox = sandbox();
    let set = [
        "--set",
        &format!("{GAP}=normal(50um, 2um, 45um, 55um)"),
        "--set",
        "layer.material.neo_hookean.shear_modulus=lognormal(90kPa, 10%)",
        "--set",
        "layer.thickness=450um",
    ];
    let random = |folder: &str, seed: &str| {
        let arguments = [&set[..], &["--random", "12", "--seed", seed]].concat();
        done(&sweep(&sandbox, folder, &arguments));
        sandbox.read(&format!("{folder}/sweep.csv"))
    };
    let first = random("a", "1");
    assert_eq!(first, random("b", "1"));
    assert_ne!(first, random("c", "2"));
    let summary = sandbox.json("a/sweep.json");
    let statistics = summary["scatter"]["statistics"].as_array().unwrap();
    let statistic = |quantity: &str, step: u64| {
        statistics.iter().find(|s| s["quantity"] == quantity && s["step"] == step).unwrap()
    };
    // The modulus of a layer around rigid electrodes changes only the force.
    assert_eq!(statistic("capacitance_f", 1)["influence"]["shares"][0]["key"], GAP);
    assert_eq!(
        statistic("force_n", 1)["influence"]["shares"][0]["key"],
        "layer.material.neo_hookean.shear_modulus"
    );
    // The mean is that statistic the table.
    let rows = rows(&first);
    let column = first.lines().next().unwrap().split(',').position(|name| name == "capacitance_f").unwrap();
    let values: Vec<f64> =
        rows.iter().filter(|row| row[4] == "1").map(|row| row[column].parse().unwrap()).collect();
    let mean = values.iter().sum::<f64>() / 12.0;
    let reported = statistic("capacitance_f", 1)["mean"].as_f64().unwrap();
    assert!((reported / mean - 1.0).abs() < 1e-12, "{reported} for {mean}");
    assert_eq!(sandbox.read("a/statistics.csv").lines().count(), 1 + statistics.len());
}

#[cfg(unix)]
#[test]
fn killed_at_any_time_and_resumed_the_table_is_the_same_and_no_case_is_solved_twice() {
    let sandbox = sandbox();
    let set = format!("{GAP}=30um..70um:60");
    let whole = ["--set", set.as_str()];
    let begun = Instant::now();
    done(&sweep(&sandbox, "whole", &whole));
    let took = begun.elapsed();
    let folder = sandbox.path("killed");
    let mut known = BTreeMap::new();
    for kill in 1..=4 {
        let arguments = ["sweep", "case.toml", "-o", "killed", "--quiet", "--set", &set];
        let mut child =
            sandbox.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(took.mul_f64(0.12 * f64::from(kill)).max(Duration::from_millis(5)));
        // SIGKILL leaves no time to clean up.
        child.kill().unwrap();
        child.wait().unwrap();
        let now = written(&folder);
        assert!(
            known.iter().all(|(name, time)| now.get(name) == Some(time)),
            "a finished case was written again"
        );
        known = now;
    }
    done(&sweep(&sandbox, "killed", &whole));
    let now = written(&folder);
    assert_eq!(now.len(), 60);
    assert!(known.iter().all(|(name, time)| now[name] == *time), "a finished case was written again");
    assert_eq!(sandbox.read("killed/sweep.csv"), sandbox.read("whole/sweep.csv"));
    let left = sandbox.names("killed/cases").into_iter().filter(|name| name.ends_with(".half"));
    assert_eq!(left.count(), 0);
}

#[test]
fn a_damaged_record_is_noticed_and_solved_again() {
    let sandbox = sandbox();
    let set = ["--set", &format!("{GAP}=40um,50um,60um")];
    done(&sweep(&sandbox, "out", &set));
    let table = sandbox.read("out/sweep.csv");
    let [flipped, cut, swapped] =
        ["out/cases/000000.jsonl", "out/cases/000001.jsonl", "out/cases/000002.jsonl"];
    // One digit of a number is changed; the line remains valid JSON.
    let record = sandbox.read(flipped);
    let at = record.find("e-14").unwrap() - 1;
    let digit = if &record[at..=at] == "7" { "3" } else { "7" };
    let mut changed = record.clone();
    changed.replace_range(at..=at, digit);
    std::fs::write(sandbox.path(flipped), changed).unwrap();
    let half = sandbox.read(cut);
    std::fs::write(sandbox.path(cut), &half[..half.len() / 2]).unwrap();
    std::fs::write(sandbox.path(swapped), &record).unwrap();
    let finished = sweep(&sandbox, "out", &set);
    done(&finished);
    assert!(finished.stderr.contains("case 0 is solved again: its file has been changed"), "{finished:?}");
    assert!(finished.stderr.contains("case 1 is solved again: its file is cut off"), "{finished:?}");
    assert!(finished.stderr.contains("case 2 is solved again: its file holds another case"), "{finished:?}");
    assert_eq!(sandbox.read("out/sweep.csv"), table);
}

#[test]
fn shards_gathered_give_the_table_of_a_single_run() {
    let sandbox = sandbox();
    let set = format!("{GAP}=40um..60um:5");
    done(&sweep(&sandbox, "whole", &["--set", &set]));
    for (shard, folder) in [("1/2", "one"), ("2/2", "two")] {
        done(&sweep(&sandbox, folder, &["--set", &set, "--shard", shard]));
    }
    assert_eq!(rows(&sandbox.read("two/sweep.csv")).len(), 4);
    done(&sandbox.elastocap(&["gather", "two", "one", "-o", "joined"]));
    assert_eq!(sandbox.read("joined/sweep.csv"), sandbox.read("whole/sweep.csv"));
    // The gathered folder resumes like that of a single run.
    let before = written(&sandbox.path("joined"));
    done(&sweep(&sandbox, "joined", &["--set", &set]));
    assert_eq!(written(&sandbox.path("joined")), before);

    refused(&sandbox.elastocap(&["gather", "one", "-o", "x"]), "a shard is missing: 2 of 2");
    refused(&sandbox.elastocap(&["gather", "one", "two", "one", "-o", "x"]), "are both shard 1/2");
    refused(&sandbox.elastocap(&["gather", "one", "none", "-o", "x"]), "`none` holds no sweep");
    let other = format!("{GAP}=40um..61um:5");
    done(&sweep(&sandbox, "other", &["--set", &other, "--shard", "2/2"]));
    let finished = sandbox.elastocap(&["gather", "one", "other", "-o", "x"]);
    refused(&finished, "`one` and `other` are not shards of the same sweep");
    refused(&finished, "other values");
    std::fs::remove_file(sandbox.path("two/cases/000003.jsonl")).unwrap();
    let finished = sandbox.elastocap(&["gather", "one", "two", "-o", "x"]);
    refused(&finished, "shard 2/2 in `two` has no result for 1 of its 2 cases (the first is case 3)");
    assert!(!sandbox.path("x").exists());
}

#[test]
fn a_folder_of_another_sweep_is_refused_with_what_differs() {
    let sandbox = sandbox();
    let set = format!("{GAP}=40um,50um");
    done(&sweep(&sandbox, "out", &["--set", &set]));
    let table = sandbox.read("out/sweep.csv");
    refused(&sweep(&sandbox, "out", &["--set", &format!("{GAP}=40um,51um")]), "other values");
    refused(&sweep(&sandbox, "out", &["--set", &set, "--no-prune"]), "other settings");
    refused(
        &sweep(&sandbox, "out", &["--set", &set, "--shard", "1/2"]),
        "holds shard 1/1 of this sweep and not 1/2",
    );
    sandbox.case("case.toml", &PAIR.replace("2.8", "2.9"));
    let finished = sweep(&sandbox, "out", &["--set", &set]);
    refused(&finished, "another text of the case file");
    refused(&finished, "--overwrite");
    assert_eq!(sandbox.read("out/sweep.csv"), table);
    done(&sweep(&sandbox, "out", &["--set", &set, "--overwrite"]));
    assert_ne!(sandbox.read("out/sweep.csv"), table);

    std::fs::create_dir(sandbox.path("mine")).unwrap();
    std::fs::write(sandbox.path("mine/sweep.csv"), "mine").unwrap();
    for more in [&["--set", set.as_str()][..], &["--set", &set, "--overwrite"]] {
        refused(&sweep(&sandbox, "mine", more), "is not from a sweep");
    }
    assert_eq!(sandbox.names("mine"), ["sweep.csv"]);
}

#[test]
fn a_file_that_the_case_imports_belongs_to_the_fingerprint() {
    let sandbox = Sandbox::new();
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    sandbox.case("body.obj", tetrahedron);
    let case = "format = 1\n[[conductor]]\nname = \"a\"\nsurface = { file = \"body.obj\", unit = \"mm\" }\n\
                [surroundings]\nboundary = \"open\"\n[electrostatics]\nrelative_tolerance = 0.2\n";
    sandbox.case("case.toml", case);
    let set = ["--set", "electrostatics.relative_tolerance=0.2,0.3"];
    done(&sweep(&sandbox, "out", &set));
    sandbox.case("body.obj", &tetrahedron.replace("v 1 0 0", "v 2 0 0"));
    refused(&sweep(&sandbox, "out", &set), "another content of `body.obj`");
}

#[test]
fn failed_cases_are_marked_and_solved_again_on_request_only() {
    let sandbox = sandbox();
    // A layer of 230 um does not cover electrodes of 20 um at a height of 225 um.
    let set = ["--set", "layer.thickness=230um,450um"];
    let finished = sweep(&sandbox, "out", &set);
    assert_eq!(finished.status, Some(3), "{finished:?}");
    assert!(finished.stderr.contains("warning: case 0 failed: "), "{finished:?}");
    let table = sandbox.read("out/sweep.csv");
    let first = table.lines().nth(1).unwrap();
    assert!(first.starts_with("0,0.00023,,,") && first.contains(",refused,"), "{first}");
    assert_eq!(table.lines().count(), 4);
    assert_eq!(sandbox.json("out/sweep.json")["failed"], serde_json::json!([0]));
    let before = written(&sandbox.path("out"));
    assert_eq!(sweep(&sandbox, "out", &set).status, Some(3));
    assert_eq!(written(&sandbox.path("out")), before);
    let again = [&set[..], &["--retry-failed"]].concat();
    assert_eq!(sweep(&sandbox, "out", &again).status, Some(3));
    let after = written(&sandbox.path("out"));
    assert_ne!(after["000000.jsonl"], before["000000.jsonl"]);
    assert_eq!(after["000001.jsonl"], before["000001.jsonl"]);
    assert_eq!(sandbox.read("out/sweep.csv"), table);
}

#[test]
fn a_sweep_that_is_stopped_says_so_and_goes_on() {
    let sandbox = sandbox();
    let set = ["--set", &format!("{GAP}=40um..60um:40"), "--threads", "1"];
    let stopped = sweep(&sandbox, "out", &[&set[..], &["--max-time", "0.02s"]].concat());
    assert_eq!(stopped.status, Some(3), "{stopped:?}");
    assert!(stopped.stderr.contains("the same command goes on"), "{stopped:?}");
    assert!(sandbox.read("out/sweep.csv").contains(",not run,"));
    done(&sweep(&sandbox, "out", &set));
    done(&sweep(&sandbox, "whole", &set));
    assert_eq!(sandbox.read("out/sweep.csv"), sandbox.read("whole/sweep.csv"));
}

#[test]
fn bad_arguments_are_refused_and_nothing_is_written() {
    let sandbox = sandbox();
    sandbox.case("bad.csv", "layer.thickness\n");
    for (more, words) in [
        (&[][..], "nothing is varied"),
        (&["--set", "gap"], "has no `=`"),
        (&["--set", "layer.thickness=1um..2um"], "does not say how many"),
        (&["--set", "layer.thickness=400um", "--set", "layer.thickness=450um"], "is set twice"),
        (&["--set", "layer.thickness=normal(450um, 5um)"], "--random N"),
        (&["--random", "5", "--set", "layer.thickness=400um,450um"], "has several values"),
        (&["--random", "5", "--set", "layer.thickness=gauss(450um, 5um)"], "there are normal"),
        (&["--random", "0", "--set", "layer.thickness=normal(450um, 5um)"], "0 is not in 1..=1000000"),
        (&["--seed", "1", "--set", "layer.thickness=450um"], "--random"),
        (&["--set", "layer..thickness=450um"], "case 0: cannot set `layer..thickness`: a key is missing"),
        (&["--set", "layer.thicknes=450um,460um"], "unknown key `thicknes`"),
        (&["--set", "layer.thickness=450,460"], "none of the 2 cases is valid"),
        (&["--list", "none.csv"], "cannot read the list `none.csv`"),
        (&["--list", "bad.csv"], "no rows below its header"),
        (&["--shard", "3/2", "--set", "layer.thickness=450um"], "a shard is written I/N"),
    ] {
        refused(&sweep(&sandbox, "out", more), words);
        assert!(!sandbox.path("out").exists(), "{more:?}");
    }
    sandbox.case("case.toml", "format = 1\n");
    assert_eq!(sweep(&sandbox, "out", &["--set", "title=a,b"]).status, Some(2));
    assert!(!sandbox.path("out").exists());
}

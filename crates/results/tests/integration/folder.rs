//! An output folder has whole files or none, those of one run, and whatever the user put there.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use elastocap_results::{Finish, OutputError, OutputFolder};

/// `result.json` of a run with these files.
fn index(status: &str, files: &[&str]) -> String {
    let files: Vec<String> =
        files.iter().map(|name| (*name).to_owned()).chain(["result.json".to_owned()]).collect();
    serde_json::json!({ "status": status, "versions": { "elastocap": "0" }, "files": files }).to_string()
}

/// Stages the files of a run; each holds `mark`, but for the index.
fn staged(folder: &Path, status: &str, files: &[&str], mark: &str) -> OutputFolder {
    let output = OutputFolder::open(folder).unwrap();
    for name in files {
        output.stage(name, mark.as_bytes()).unwrap();
    }
    output.stage("result.json", index(status, files).as_bytes()).unwrap();
    output
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn read(file: &Path) -> String {
    fs::read_to_string(file).unwrap()
}

#[test]
fn an_output_folder_that_is_given_up_leaves_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("results/deep");
    let output = OutputFolder::open(&folder).unwrap();
    output.stage("curve.csv", b"half").unwrap();
    drop(output);
    assert_eq!(names(place.path()), Vec::<String>::new());
}

#[test]
fn a_committed_folder_has_its_files_and_loses_those_of_an_earlier_run_of_any_kind() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    let finite_elements = ["curve.csv", "layer.pvd", "layer_003.vtu", "mechanics.csv", "profile_003.csv"];
    staged(&folder, "complete", &finite_elements, "first").commit_run(Finish::Complete).unwrap();
    fs::write(folder.join("mine.txt"), "a file of the user").unwrap();
    let output = staged(&folder, "complete", &["curve.csv", "step_000.vtu"], "second");
    assert_eq!(read(&folder.join("curve.csv")), "first", "not before all of it is there");
    output.commit_run(Finish::Complete).unwrap();
    assert_eq!(names(&folder), ["curve.csv", "mine.txt", "result.json", "step_000.vtu"]);
    assert_eq!(read(&folder.join("curve.csv")), "second");
    assert_eq!(read(&folder.join("mine.txt")), "a file of the user");
    assert_eq!(names(place.path()), ["out"]);
}

#[cfg(unix)]
#[test]
fn the_users_files_stay_the_same_files_and_the_folder_keeps_its_permissions_and_the_link_to_it() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, symlink};
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    staged(&folder, "complete", &["curve.csv"], "first").commit_run(Finish::Complete).unwrap();
    fs::write(folder.join("mine.txt"), "a file of the user").unwrap();
    symlink("nowhere", folder.join("link")).unwrap();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o750)).unwrap();
    let before = fs::metadata(folder.join("mine.txt")).unwrap().ino();
    let latest = place.path().join("latest");
    symlink("out", &latest).unwrap();
    let placed = staged(&latest, "complete", &["curve.csv"], "second").commit_run(Finish::Complete).unwrap();
    assert_eq!(placed.folder, latest);
    assert_eq!(names(&folder), ["curve.csv", "link", "mine.txt", "result.json"]);
    assert_eq!(read(&folder.join("curve.csv")), "second");
    assert_eq!(fs::metadata(folder.join("mine.txt")).unwrap().ino(), before);
    assert_eq!(fs::metadata(&folder).unwrap().permissions().mode() & 0o777, 0o750);
    assert!(latest.is_symlink());
    assert_eq!(names(place.path()), ["latest", "out"]);
}

#[test]
fn a_folder_with_folders_of_the_user_in_it_gets_its_files_in_place() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    staged(&folder, "complete", &["curve.csv", "step_000.vtu"], "first")
        .commit_run(Finish::Complete)
        .unwrap();
    fs::create_dir(folder.join("plots")).unwrap();
    fs::write(folder.join("plots/mine.txt"), "a file of the user").unwrap();
    staged(&folder, "complete", &["curve.csv"], "second").commit_run(Finish::Complete).unwrap();
    assert_eq!(names(&folder), ["curve.csv", "plots", "result.json"]);
    assert_eq!(read(&folder.join("curve.csv")), "second");
    assert_eq!(read(&folder.join("plots/mine.txt")), "a file of the user");
    assert_eq!(names(place.path()), ["out"]);
}

#[test]
fn a_folder_in_the_place_of_a_file_leaves_everything_as_it_was() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    staged(&folder, "complete", &["curve.csv", "step_000.vtu"], "first")
        .commit_run(Finish::Complete)
        .unwrap();
    fs::create_dir(folder.join("scene.glb")).unwrap();
    let refused = staged(&folder, "complete", &["curve.csv", "scene.glb"], "second").commit();
    assert!(matches!(refused, Err(OutputError::Place { .. })), "{refused:?}");
    assert_eq!(names(&folder), ["curve.csv", "result.json", "scene.glb", "step_000.vtu"]);
    assert_eq!(read(&folder.join("curve.csv")), "first");
    assert_eq!(names(place.path()), ["out"]);
}

#[test]
fn a_file_that_is_not_from_elastocap_is_not_replaced_by_a_run() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("curve.csv"), "measured").unwrap();
    let output = OutputFolder::open(place.path()).unwrap();
    let refused = output.holds_nothing_foreign();
    assert!(
        matches!(&refused, Err(OutputError::Foreign { file }) if file.ends_with("curve.csv")),
        "{refused:?}"
    );
    fs::write(place.path().join("result.json"), index("complete", &["curve.csv"])).unwrap();
    assert!(output.holds_nothing_foreign().is_ok());
    assert!(matches!(output.holds_no_run(), Err(OutputError::HoldsRun { .. })));
}

#[test]
fn only_a_complete_result_replaces_a_complete_one_and_a_stopped_run_replaces_none() {
    let place = tempfile::tempdir().unwrap();
    let (folder, partial) = (place.path().join("out"), place.path().join("out.partial"));
    // First run, stopped.
    let placed = staged(&folder, "stopped", &["curve.csv"], "0").commit_run(Finish::Stopped).unwrap();
    assert_eq!(placed.folder, partial);
    assert!(placed.warnings.iter().any(|w| w.contains("out.partial")), "{:?}", placed.warnings);
    assert_eq!(names(place.path()), ["out.partial"]);
    // A run with failed steps may replace a stopped one.
    staged(&folder, "incomplete", &["curve.csv"], "1").commit_run(Finish::Incomplete).unwrap();
    assert_eq!(names(place.path()), ["out"]);
    staged(&folder, "complete", &["curve.csv"], "2").commit_run(Finish::Complete).unwrap();
    let placed = staged(&folder, "incomplete", &["curve.csv"], "3").commit_run(Finish::Incomplete).unwrap();
    assert_eq!(placed.files[0], partial.join("curve.csv"));
    assert!(placed.warnings.iter().any(|w| w.contains("keeps the complete result")), "{:?}", placed.warnings);
    assert_eq!([&folder, &partial].map(|f| read(&f.join("curve.csv"))), ["2", "3"]);
    fs::write(partial.join("mine.txt"), "a file of the user").unwrap();
    staged(&folder, "complete", &["curve.csv"], "4").commit_run(Finish::Complete).unwrap();
    assert_eq!(read(&folder.join("curve.csv")), "4");
    assert_eq!(names(&partial), ["mine.txt"]);
}

#[test]
fn files_added_beside_a_result_leave_it_as_it_is() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    staged(&folder, "complete", &["curve.csv"], "run").commit_run(Finish::Complete).unwrap();
    for mark in ["first", "second"] {
        let output = OutputFolder::open(&folder).unwrap();
        output.stage("accuracy.csv", mark.as_bytes()).unwrap();
        output.commit_beside().unwrap();
        assert_eq!(read(&folder.join("accuracy.csv")), mark);
    }
    assert_eq!(names(&folder), ["accuracy.csv", "curve.csv", "result.json"]);
    assert_eq!(names(place.path()), ["out"]);
}

#[test]
fn what_a_killed_run_staged_is_removed_and_what_a_living_one_stages_is_not() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    let living = staged(&folder, "complete", &["curve.csv"], "living");
    for left in [".out.elastocap-1-0", ".out.elastocap-1-1"] {
        fs::create_dir(place.path().join(left)).unwrap();
        fs::write(place.path().join(left).join("figure-9.svg"), "half").unwrap();
    }
    drop(OutputFolder::open(&folder).unwrap());
    let left = names(place.path());
    assert!(left.len() == 1 && left[0].starts_with(".out.elastocap-"), "{left:?}");
    assert!(![".out.elastocap-1-0", ".out.elastocap-1-1"].contains(&left[0].as_str()), "{left:?}");
    living.commit_run(Finish::Complete).unwrap();
    assert_eq!(names(&folder), ["curve.csv", "result.json"]);
}

#[test]
fn nothing_is_left_of_files_given_up_nor_of_folders_made_for_them_and_they_are_announced_before() {
    let place = tempfile::tempdir().unwrap();
    let mut announced = Vec::new();
    let output = OutputFolder::open_announced(&place.path().join("a/b/out"), |unfinished| {
        // The folders above are there: nothing is in them yet.
        assert_eq!(names(&place.path().join("a/b")), [""; 0]);
        announced.push(unfinished.clone());
    })
    .unwrap();
    // More than a folder can be read of at once.
    for k in 0..300 {
        output.stage(&format!("step_{k:03}.vtu"), b"field").unwrap();
    }
    let [unfinished] = &announced[..] else { panic!("{announced:?}") };
    assert!(unfinished.give_up());
    assert_eq!(names(place.path()), [""; 0]);
    assert!(!unfinished.give_up(), "there is nothing more");
}

#[test]
fn files_given_up_while_they_are_put_in_place_are_there_all_or_none_and_so_are_those_before() {
    let files: Vec<String> = (0..40).map(|k| format!("step_{k:03}.vtu")).collect();
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    for before in [false, true] {
        // Broken off at times spread over a whole commit, whose duration the first commit gives.
        let mut commit = Duration::ZERO;
        for part in 0..80 {
            let place = tempfile::tempdir().unwrap();
            let folder = place.path().join("out");
            if before {
                staged(&folder, "complete", &["curve.csv"], "first").commit_run(Finish::Complete).unwrap();
            }
            let output = staged(&folder, "complete", &files, "second");
            let unfinished = output.unfinished().clone();
            let pause = if part == 0 { Duration::from_secs(1) } else { commit * part / 70 };
            let ending = std::thread::spawn(move || {
                std::thread::sleep(pause);
                unfinished.give_up()
            });
            let begin = Instant::now();
            let placed = output.commit_run(Finish::Complete).is_ok();
            if part == 0 {
                commit = begin.elapsed();
            }
            let given_up = ending.join().unwrap();
            assert!(placed != given_up, "{part}: placed {placed}, given up {given_up}");
            let left = match (placed, before) {
                (true, _) => files.len() + 1,
                (false, true) => 2,
                (false, false) => 0,
            };
            assert_eq!(names(&folder).len(), left, "{part}: {:?}", names(&folder));
        }
    }
}

#[test]
fn a_run_killed_between_two_renamings_leaves_the_old_result_to_be_found_again() {
    let place = tempfile::tempdir().unwrap();
    let (folder, old) = (place.path().join("out"), place.path().join(".out.elastocap-1-0.old"));
    staged(&folder, "complete", &["curve.csv"], "first").commit_run(Finish::Complete).unwrap();
    fs::rename(&folder, &old).unwrap();
    let output = OutputFolder::open(&folder).unwrap();
    assert!(output.warnings()[0].contains("is there again"), "{:?}", output.warnings());
    assert_eq!(names(&folder), ["curve.csv", "result.json"]);
    drop(output);
    assert_eq!(names(place.path()), ["out"]);
}

#[test]
fn an_unfinished_result_without_a_place_is_found_again_under_its_own_name() {
    let place = tempfile::tempdir().unwrap();
    let (folder, old) = (place.path().join("out"), place.path().join(".out.partial.elastocap-1-0.old"));
    staged(&folder, "stopped", &["curve.csv"], "first").commit_run(Finish::Stopped).unwrap();
    fs::rename(place.path().join("out.partial"), &old).unwrap();
    drop(OutputFolder::open(&folder).unwrap());
    assert_eq!(names(place.path()), ["out.partial"]);
}

#[cfg(unix)]
#[test]
fn a_run_killed_after_the_folders_changed_places_leaves_the_new_result_and_no_file_of_the_user_behind() {
    use std::os::unix::fs::MetadataExt as _;
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    staged(&folder, "complete", &["curve.csv"], "second").commit_run(Finish::Complete).unwrap();
    // The old folder, under the name that has the number of the new one.
    let number = fs::metadata(&folder).unwrap().ino();
    let old = place.path().join(format!(".out.elastocap-1-0.swap-{number}"));
    fs::create_dir(&old).unwrap();
    for (name, text) in [("curve.csv", "first"), ("result.json", "{}"), ("came-late.txt", "late")] {
        fs::write(old.join(name), text).unwrap();
    }
    fs::write(folder.join("mine.txt"), "a file of the user").unwrap();
    fs::hard_link(folder.join("mine.txt"), old.join("mine.txt")).unwrap();
    drop(OutputFolder::open(&folder).unwrap());
    assert_eq!(names(place.path()), ["out"]);
    assert_eq!(names(&folder), ["came-late.txt", "curve.csv", "mine.txt", "result.json"]);
    assert_eq!(read(&folder.join("curve.csv")), "second");
}

#[test]
fn a_run_killed_while_it_put_files_in_place_is_completed_from_any_point() {
    let files = ["curve.csv", "scene.glb", "step_000.vtu"];
    // States after a kill, by how many files had been renamed: old ones out of the way, and new ones in.
    for (out, placed) in [(0, 0), (1, 0), (3, 0), (4, 0), (4, 1), (4, 3), (4, 4)] {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("out");
        let stale = ["curve.csv", "scene.glb", "step_009.vtu"];
        staged(&folder, "complete", &stale, "first").commit_run(Finish::Complete).unwrap();
        let commit = folder.join(".elastocap-commit");
        fs::create_dir_all(commit.join("old")).unwrap();
        for name in files {
            fs::write(commit.join(name), "second").unwrap();
        }
        fs::write(commit.join("result.json"), index("complete", &files)).unwrap();
        let leaving = ["result.json", "curve.csv", "scene.glb", "step_009.vtu"];
        let coming = ["curve.csv", "scene.glb", "step_000.vtu", "result.json"];
        let plan = serde_json::json!({ "remove": leaving, "place": coming }).to_string();
        fs::write(commit.join(".plan"), plan).unwrap();
        for name in &leaving[..out] {
            fs::rename(folder.join(name), commit.join("old").join(name)).unwrap();
        }
        for name in &coming[..placed] {
            fs::rename(commit.join(name), folder.join(name)).unwrap();
        }
        let output = OutputFolder::open(&folder).unwrap();
        assert!(output.warnings()[0].contains("completed"), "{:?}", output.warnings());
        drop(output);
        assert_eq!(
            names(&folder),
            ["curve.csv", "result.json", "scene.glb", "step_000.vtu"],
            "{out} {placed}"
        );
        assert!(files.iter().all(|name| read(&folder.join(name)) == "second"), "{out} {placed}");
    }
}

//! An output folder has whole files or none.

use elastocap_results::OutputFolder;

#[test]
fn an_output_folder_that_is_given_up_leaves_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("results/deep");
    let output = OutputFolder::open(&folder).unwrap();
    output.stage("curve.csv", b"half").unwrap();
    drop(output);
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn a_committed_folder_has_its_files_and_loses_those_of_an_earlier_run() {
    let place = tempfile::tempdir().unwrap();
    let index =
        br#"{"versions": {"elastocap": "0"}, "files": ["curve.csv", "step_007.vtu", "../keep", "mine.txt"]}"#;
    for (name, bytes) in [("result.json", &index[..]), ("step_007.vtu", b"old"), ("mine.txt", b"own")] {
        std::fs::write(place.path().join(name), bytes).unwrap();
    }
    let output = OutputFolder::open(place.path()).unwrap();
    output.stage("curve.csv", b"new").unwrap();
    output.stage("result.json", b"{}").unwrap();
    assert!(!place.path().join("curve.csv").exists(), "not before all of it is there");
    output.commit().unwrap();
    let mut names: Vec<_> = std::fs::read_dir(place.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["curve.csv", "mine.txt", "result.json"]);
}

//! Tests of files that must be refused: those of the acceptance set, and files that are no case files.

use std::path::{Path, PathBuf};

fn bad(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/bad").join(name)
}

/// Checks that there is one message, at this line and column, with these words in its text.
fn refused(name: &str, place: (usize, usize), words: &[&str]) {
    let error = elastocap_case::load(&bad(name)).unwrap_err();
    let shown = error.render(false);
    let [diagnostic] = error.diagnostics() else { panic!("{name}: one message expected:\n{shown}") };
    assert_eq!(error.line_column(diagnostic), Some(place), "{shown}");
    let header = format!("{name}:{}:{}", place.0, place.1);
    for word in words.iter().copied().chain([header.as_str(), "error: ", "^", "= help: "]) {
        assert!(shown.contains(word), "{name}: {word:?} is not in\n{shown}");
    }
}

#[test]
fn a_bare_number_is_refused_with_the_line_that_would_be_right() {
    refused(
        "missing-unit.toml",
        (6, 25),
        &["`thickness` in [layer] needs a unit", "write the unit that is meant: \"450 um\" or \"450 mm\""],
    );
}

#[test]
fn a_pressure_is_not_a_length() {
    refused(
        "wrong-dimension.toml",
        (6, 25),
        &["expected a length, found a pressure", "\"450 um\" or \"450 mm\""],
    );
}

#[test]
fn an_unknown_key_is_told_the_nearest_known_one_and_that_one_is_not_called_missing() {
    refused(
        "unknown-key.toml",
        (14, 1),
        &["unknown key `gapp` in [electrodes.in_plane_pair]", "`gap = \"50 um\"`"],
    );
}

#[test]
fn an_electrode_must_fit_into_the_layer() {
    refused(
        "electrode-outside-layer.toml",
        (18, 17),
        &["reach out of the layer at the top", "the layer ends at \"450 um\"", "`height = \"440 um\"`"],
    );
}

#[test]
fn the_layer_cannot_be_crushed_flat() {
    refused("crushed-flat.toml", (27, 21), &["`compression` in [load]", "at least 0 and less than 1"]);
}

#[test]
fn a_negative_gap_is_refused() {
    refused("negative-gap.toml", (14, 17), &["`gap`", "must be greater than zero", "`gap = \"50 um\"`"]);
}

#[test]
fn a_negative_modulus_is_refused() {
    refused("negative-modulus.toml", (11, 7), &["`c01`", "must not be negative", "`c01 = \"43931.9 Pa\"`"]);
}

#[test]
fn nan_is_refused() {
    refused("not-a-number.toml", (10, 7), &["`c10`", "must be a finite number"]);
}

#[test]
fn a_load_without_steps_is_refused() {
    refused("no-load-steps.toml", (27, 15), &["no load steps", "`compression = [0.1]`"]);
}

#[test]
fn a_tolerance_of_zero_is_refused() {
    refused(
        "zero-tolerance.toml",
        (36, 22),
        &["greater than 0 and less than 1", "`relative_tolerance = 1e-3`"],
    );
}

#[test]
fn a_newer_format_is_refused_and_nothing_else_is_said_of_the_file() {
    refused("newer-format.toml", (2, 10), &["written for a newer elastocap", "`format = 1`"]);
}

#[test]
fn an_inside_out_box_is_shown_the_right_way_round() {
    refused(
        "inside-out-box.toml",
        (7, 46),
        &["inside-out along x1", "`min = [\"-1 m\", \"0 m\", \"0 m\"], max = [\"0 m\", \"1 m\", \"1 m\"]`"],
    );
}

#[test]
fn touching_conductors_are_both_named_and_shown() {
    refused(
        "touching-conductors.toml",
        (10, 9),
        &["\"lower\" and \"upper\" touch or overlap", "\"lower\" is here", "6 | sheet"],
    );
}

#[test]
fn a_file_that_was_cut_off_says_so() {
    refused("cut-off.toml", (9, 1), &["lacks `c10` and `c01`", "the file ends here"]);
}

#[test]
fn a_file_that_is_no_text_is_refused_with_the_place() {
    let error = elastocap_case::load(&bad("not-a-text.toml")).unwrap_err();
    let shown = error.render(false);
    assert!(shown.contains("not-a-text.toml` is not a text file: line 1 is not UTF-8"), "{shown}");
}

#[test]
fn a_missing_file_and_a_folder_are_refused_by_name() {
    let shown = elastocap_case::load(&bad("no-such-file.toml")).unwrap_err().render(false);
    assert!(shown.contains("there is no case file") && shown.contains("no-such-file.toml"), "{shown}");
    let shown = elastocap_case::load(&bad(".")).unwrap_err().render(false);
    assert!(shown.contains("is a folder, not a case file"), "{shown}");
}

#[test]
fn a_huge_file_is_refused_before_it_is_read_whole() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("huge.toml");
    std::fs::File::create(&path).and_then(|file| file.set_len((16 << 20) + 1)).unwrap();
    let shown = elastocap_case::load(&path).unwrap_err().render(false);
    std::fs::remove_file(&path).unwrap();
    assert!(shown.contains("larger than 16 MiB"), "{shown}");
}

#[test]
fn colours_are_given_only_where_asked_for() {
    let error = elastocap_case::load(&bad("unknown-key.toml")).unwrap_err();
    assert!(!error.render(false).contains('\u{1b}'));
    assert!(error.render(true).contains('\u{1b}'));
    assert_eq!(error.to_string(), error.render(false));
}

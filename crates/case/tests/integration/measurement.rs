//! Tests of measured points of a case, and of the permittivity of a foam.

use std::path::PathBuf;

use elastocap_case::{self, Case, CaseError, Foam, MeasuredLoad};

const CASE: &str = r#"
format = 1
[layer]
thickness = "450 um"
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
compression = [0.0, 0.1, 0.2]
[surroundings]
boundary = "open"
[measurement]
file = "points.csv"
columns = { force = { name = "f", unit = "mN" }, capacitance = { name = "c", unit = "fF" } }
"#;

const POINTS: &str = "# a meter\nf, c ,s,run\n0,44.0,0.1,up\n10,43.1,0.2,up\n\n20,42.5,0.1,down\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(points: &str) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        std::fs::write(folder.0.path().join("points.csv"), points).unwrap();
        folder
    }

    fn case(&self) -> PathBuf {
        self.0.path().join("case.toml")
    }

    fn parse(&self, text: &str) -> Result<Case, CaseError> {
        elastocap_case::parse(text, &self.case())
    }

    /// Checks that there is one message with these words.
    fn refused(&self, text: &str, words: &[&str]) {
        let error = self.parse(text).expect_err(text);
        let shown = error.render(false);
        assert_eq!(error.diagnostics().len(), 1, "{shown}");
        assert!(error.diagnostics()[0].span.is_some(), "{shown}");
        for word in words {
            assert!(shown.contains(word), "`{word}` is not in\n{shown}");
        }
    }
}

fn with(from: &str, to: &str) -> String {
    assert!(CASE.contains(from), "{from}");
    CASE.replace(from, to)
}

#[test]
fn points_are_read_in_si_units_with_their_lines() {
    let measured = Folder::new(POINTS).parse(CASE).unwrap().measured_points.unwrap();
    assert_eq!((measured.load, measured.points.len()), (MeasuredLoad::Force, 3));
    let second = measured.points[1];
    assert_eq!((second.line, second.deviation), (4, None));
    assert!((second.load - 0.01).abs() < 1e-15 && (second.capacitance - 43.1e-15).abs() < 1e-27);
    assert_eq!(measured.points[2].line, 6);
}

#[test]
fn rows_deviations_and_corrections_are_taken_from_the_case() {
    let text = with(
        "capacitance = { name = \"c\", unit = \"fF\" } }\n",
        "capacitance = { name = \"c\", unit = \"fF\" }, deviation = { name = \"s\", unit = \"fF\" } }\n\
         rows = { column = \"run\", equals = \"up\" }\noffset = \"2 mN\"\nparasitic = \"-1 fF\"\ngain = 2.0\n",
    );
    let measured = Folder::new(POINTS).parse(&text).unwrap().measured_points.unwrap();
    assert_eq!(measured.points.len(), 2);
    let corrected = measured.corrected()[1];
    assert!((corrected.load - 8e-3).abs() < 1e-15);
    assert!((corrected.capacitance - 22.05e-15).abs() < 1e-27);
    assert!((corrected.deviation.unwrap() - 0.1e-15).abs() < 1e-28);
}

#[test]
fn what_is_wrong_with_the_points_is_told_with_file_and_line() {
    let folder = Folder::new(POINTS);
    folder.refused(&with("name = \"c\"", "name = \"cap\""), &["has no column `cap`", "`f`, `c`, `s`, `run`"]);
    folder
        .refused(&with("\"points.csv\"", "\"other.csv\""), &["other.csv", "cannot use the measured points"]);
    folder.refused(&with("\"points.csv\"", "\"case.toml\""), &["does not end in .csv"]);
    folder.refused(&with("unit = \"mN\"", "unit = \"mm\""), &["is not a unit of a force", "unit = \"N\""]);
    folder.refused(&with(", unit = \"fF\"", ""), &["the column `c` needs a unit"]);
    folder.refused(&with("force = { name = \"f\", unit = \"mN\" }, ", ""), &["exactly one of `force`"]);
    folder.refused(&with("\"points.csv\"\n", "\"points.csv\"\ngain = 0.0\n"), &["between 1e-3 and 1e3"]);
    folder.refused(&with("\"points.csv\"\n", "\"points.csv\"\noffset = 0.1\n"), &["must be a force"]);
    folder.refused(
        &with("\"points.csv\"\n", "\"points.csv\"\nrows = { column = \"run\", equals = \"x\" }\n"),
        &["no row with \"x\""],
    );
    folder.refused(&with("[load]\ncompression = [0.0, 0.1, 0.2]\n", ""), &["[measurement] needs [load]"]);
    for (points, words) in [
        (
            "f,c\n0,44\n10,lots\n",
            ["points.csv:3: \"lots\" in the column `c` is not a number", "decimal point"],
        ),
        ("f,c\n0,44\n10\n", ["points.csv:3", "number of columns"]),
        ("f,c\n0,nan\n", ["points.csv:2", "is not a number"]),
        ("f,c\n", ["no row below the names", "points.csv"]),
    ] {
        Folder::new(points).refused(CASE, &words);
    }
    let deviation = with("\"points.csv\"\n", "\"points.csv\"\ndeviation = \"1 fF\"\n");
    assert!(folder.parse(&deviation).is_ok());
    let twice = deviation
        .replace("unit = \"fF\" } }", "unit = \"fF\" }, deviation = { name = \"s\", unit = \"fF\" } }");
    folder.refused(&twice, &["is given twice"]);
}

#[test]
fn a_foam_gets_denser_under_load() {
    let foam =
        with("relative_permittivity = 2.8", "foam = { solid_permittivity = 8.0, solid_fraction = 0.25 }");
    let folder = Folder::new(POINTS);
    let layer = folder.parse(&foam).unwrap().layer.unwrap();
    assert_eq!(layer.foam, Some(Foam { solid_permittivity: 8.0, solid_fraction: 0.25 }));
    // The cube root is 1 + f (2 - 1): 1.25 at rest, 1.5 at half the thickness, and 2 where all pores are
    // closed.
    for (compression, root) in [(0.0, 1.25_f64), (0.5, 1.5), (0.75, 2.0), (0.9, 2.0)] {
        assert!((layer.permittivity_at(compression).unwrap() - root.powi(3)).abs() < 1e-12, "{compression}");
    }
    assert_eq!(layer.relative_permittivity, layer.permittivity_at(0.0));
    let both = foam.replace("foam =", "relative_permittivity = 2.0\nfoam =");
    folder.refused(&both, &["both `foam` and `relative_permittivity`"]);
    let by_force = foam.replace("compression = [", "force = [\"0 N\"] # [");
    folder.refused(&by_force, &["[layer.foam] cannot be loaded by a force", "[layer.material.hyperfoam]"]);
    folder.refused(
        &foam.replace("solid_fraction = 0.25", "solid_fraction = 25.0"),
        &["solid_fraction", "0.25"],
    );
}

#[test]
fn a_file_that_is_no_table_is_not_shown() {
    let folder = Folder::new("export API_KEY=do-not-show-this-line\nsecond line\n");
    let error = folder.parse(CASE).unwrap_err().to_string();
    assert!(error.contains("is no table of measured points"), "{error}");
    assert!(!error.contains("API_KEY") && !error.contains("second"), "{error}");
}

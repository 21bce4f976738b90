//! The files that a run may write: one table, from which the groups of `--only`, the plan, the help and the
//! names that a later run may replace follow.

use std::fmt;
use std::str::FromStr;

use elastocap_case::Case;
use elastocap_coupling::plan::Kind;

/// The file that lists what the results folder of a run holds.
pub(crate) const INDEX: &str = "result.json";

/// The file that lists what `elastocap mesh` has written.
pub(crate) const MESH_INDEX: &str = "mesh.json";

/// The file from which a stopped run can be resumed.
pub(crate) const RESUME: &str = "resume.json";

/// The report as one page for a browser.
pub(crate) const REPORT: &str = "report.html";

/// The name of a file, or of one file for each load step.
#[derive(Debug, Clone, Copy)]
pub(crate) enum FileName {
    /// One file.
    One(&'static str),
    /// A file for each step: the texts before and after its number.
    EachStep(&'static str, &'static str),
}

impl FileName {
    /// The name of the file of the step of this index, or of the one file.
    pub(crate) fn at(self, index: usize) -> String {
        match self {
            Self::One(name) => name.to_owned(),
            Self::EachStep(before, after) => format!("{before}{index:03}{after}"),
        }
    }

    /// Whether a file of this name is one of these.
    fn matches(self, name: &str) -> bool {
        match self {
            Self::One(known) => name == known,
            Self::EachStep(before, after) => {
                let number = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
                number.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
            }
        }
    }
}

/// The field of a step.
pub(crate) const FIELD: FileName = FileName::EachStep("step_", ".vtu");
/// The section through the field of a step, through its gap.
pub(crate) const SECTION: FileName = FileName::EachStep("section_", ".svg");
/// The section through the field of a step, through its electrodes.
pub(crate) const SECTION_OF_ELECTRODES: FileName = FileName::EachStep("section_", "_electrodes.svg");
/// Displacement and stress of the layer in a step.
pub(crate) const LAYER: FileName = FileName::EachStep("layer_", ".vtu");
/// Profiles of the layer in a step.
pub(crate) const PROFILE: FileName = FileName::EachStep("profile_", ".csv");

/// A file that a run may write.
pub(crate) struct OutputFile {
    pub(crate) name: FileName,
    /// The group of `--only`; `None` for files that no word asks for.
    pub(crate) group: Option<FileGroup>,
    /// The file in the words of a plan; `None` where another entry mentions it.
    pub(crate) planned: Option<&'static str>,
    /// Whether a run of this kind of this case writes the file.
    pub(crate) when: fn(&Case, Kind) -> bool,
    /// The content of the file, for the help; empty where the help does not mention it.
    pub(crate) content: &'static str,
}

const fn file(
    name: FileName,
    group: FileGroup,
    planned: Option<&'static str>,
    when: fn(&Case, Kind) -> bool,
    content: &'static str,
) -> OutputFile {
    OutputFile { name, group: Some(group), planned, when, content }
}

/// Every file, in the order in which a plan and the help list them.
#[rustfmt::skip]
pub(crate) const FILES: [OutputFile; 17] = [
    file(FileName::One("curve.csv"), FileGroup::Curve, Some("curve.csv"), has_curve,
        "one row for each load step, in SI units"),
    file(FileName::One("curve.svg"), FileGroup::Curve, Some("curve.svg"), has_curve_under_load,
        "the change of C under load, with bounds; C itself beside that of parallel plates"),
    file(FileName::One("approach.svg"), FileGroup::Curve, Some("approach.svg"), has_approach,
        "the same against the distance of the indenter, with `approach`"),
    file(FileName::One("capacitance.csv"), FileGroup::Capacitance, Some("capacitance.csv"), has_field,
        "all capacitances of each step"),
    file(FileName::One(INDEX), FileGroup::Json, Some(INDEX), always,
        "all results, with the Maxwell matrices, the plan and the time of each phase"),
    file(FileName::One(REPORT), FileGroup::Report, Some(REPORT), always,
        "all of this as one page for a browser, with charts, a 3D view and the case file"),
    file(FileName::One("scene.glb"), FileGroup::Scene, Some("scene.glb"), always,
        "bodies and indenter for any glTF viewer, the load steps as an animation"),
    file(FileName::One("mechanics.csv"), FileGroup::Mechanics, Some("mechanics.csv"), has_finite_elements,
        "for finite-element layers, the force and its error on each mesh"),
    file(LAYER, FileGroup::Layer, Some("layer_NNN.vtu and profile_NNN.csv for each step"), has_finite_elements,
        "displacement and stress of the layer for ParaView, by layer.pvd"),
    file(PROFILE, FileGroup::Layer, None, has_finite_elements,
        "displacement and stress along lines through the layer"),
    file(FileName::One("layer.pvd"), FileGroup::Layer, Some("layer.pvd"), has_finite_elements, ""),
    file(FIELD, FileGroup::Fields, Some("step_NNN.vtu for each step"), has_field,
        "the fields around the sensor for ParaView, by fields.pvd"),
    file(FileName::One("fields.pvd"), FileGroup::Fields, Some("fields.pvd"), has_field, ""),
    file(SECTION, FileGroup::Sections, Some("section_NNN.svg for the first and the last"), has_field,
        "potential and field in a plane through the gap, of the first and the last step"),
    file(SECTION_OF_ELECTRODES, FileGroup::Sections, None, has_field, ""),
    OutputFile { name: FileName::One(MESH_INDEX), group: None, planned: None, when: never, content: "" },
    OutputFile { name: FileName::One(RESUME), group: None, planned: None, when: never, content: "" },
];

/// The files of a run and their contents, a line for each, for the help of `elastocap run`.
pub fn files_in_words() -> String {
    let line = |file: &OutputFile| {
        let name = match file.name {
            FileName::One(name) => name.to_owned(),
            FileName::EachStep(before, after) => format!("{before}NNN{after}"),
        };
        format!("  {name:<15}  {}\n", file.content)
    };
    FILES.iter().filter(|file| !file.content.is_empty()).map(line).collect()
}

fn always(_: &Case, _: Kind) -> bool {
    true
}

/// Files of `elastocap mesh`, and of runs that are stopped: no plan foresees them.
fn never(_: &Case, _: Kind) -> bool {
    false
}

fn has_field(_: &Case, kind: Kind) -> bool {
    kind != Kind::Mechanics
}

fn has_curve(_: &Case, kind: Kind) -> bool {
    kind != Kind::Capacitance
}

/// Where the indenter is away from the layer in all steps, there is only a curve over its distance.
fn has_curve_under_load(case: &Case, kind: Kind) -> bool {
    let stays_away = case.approaches() && case.poses.iter().all(|pose| pose.distance > 0.0);
    has_curve(case, kind) && !(kind == Kind::Curve && stays_away)
}

fn has_approach(case: &Case, kind: Kind) -> bool {
    kind == Kind::Curve && case.approaches()
}

fn has_finite_elements(case: &Case, _: Kind) -> bool {
    case.load.is_some() && case.mechanics.is_some_and(|mechanics| mechanics.is_finite_element())
}

/// Whether a run or `mesh` gives files this name. Only such files are ever removed, whatever an index lists.
pub(crate) fn is_result_name(name: &str) -> bool {
    FILES.iter().any(|file| file.name.matches(name))
}

/// A group of files that one word asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FileGroup {
    /// `curve.csv`, `curve.svg` and `approach.svg`.
    Curve,
    /// `capacitance.csv`.
    Capacitance,
    /// `result.json`, which is always written: it lists the files that a later run may replace.
    Json,
    /// `report.html`.
    Report,
    /// `scene.glb`.
    Scene,
    /// `step_NNN.vtu` and `fields.pvd`.
    Fields,
    /// `section_NNN.svg`.
    Sections,
    /// `mechanics.csv`.
    Mechanics,
    /// `layer_NNN.vtu`, `layer.pvd` and `profile_NNN.csv`.
    Layer,
}

impl FileGroup {
    /// Every group.
    pub const ALL: [Self; 9] = [
        Self::Curve,
        Self::Capacitance,
        Self::Json,
        Self::Report,
        Self::Scene,
        Self::Fields,
        Self::Sections,
        Self::Mechanics,
        Self::Layer,
    ];

    /// The word that asks for the group.
    pub fn name(self) -> &'static str {
        match self {
            Self::Curve => "curve",
            Self::Capacitance => "capacitance",
            Self::Json => "json",
            Self::Report => "report",
            Self::Scene => "scene",
            Self::Fields => "fields",
            Self::Sections => "sections",
            Self::Mechanics => "mechanics",
            Self::Layer => "layer",
        }
    }
}

impl fmt::Display for FileGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is not the name of a group.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` names no files of a run: curve, capacitance, json, report, scene, fields, sections, mechanics, layer"
)]
pub struct UnknownFileGroup(String);

impl FromStr for FileGroup {
    type Err = UnknownFileGroup;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let word = text.trim();
        Self::ALL
            .into_iter()
            .find(|group| group.name() == word)
            .ok_or_else(|| UnknownFileGroup(word.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_reads_back_and_others_are_answered_with_the_words_there_are() {
        for group in FileGroup::ALL {
            assert_eq!(group.name().parse(), Ok(group));
            assert!(FILES.iter().any(|file| file.group == Some(group)), "{group} has no files");
        }
        let error = "pictures".parse::<FileGroup>().unwrap_err().to_string();
        assert!(FileGroup::ALL.iter().all(|group| error.contains(group.name())), "{error}");
    }

    #[test]
    fn a_file_of_each_step_has_a_name_that_is_known_again_and_others_are_not() {
        for file in [FIELD, SECTION, SECTION_OF_ELECTRODES, LAYER, PROFILE] {
            assert!(is_result_name(&file.at(7)) && is_result_name(&file.at(12_345)));
        }
        for name in ["step_.vtu", "step_1a.vtu", "my_step_001.vtu", "curve.csv.bak", "../curve.csv"] {
            assert!(!is_result_name(name), "{name}");
        }
    }
}

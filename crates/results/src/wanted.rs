//! Which files a run writes.

use std::fmt;
use std::str::FromStr;

use elastocap_coupling::plan::{Decision, LeftOut, Options, Plan};

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

    /// The group of a file, by the beginning of its name; `None` for files of no group.
    fn of(name: &str) -> Option<Self> {
        const BEGINNINGS: [(&str, FileGroup); 13] = [
            ("curve.", FileGroup::Curve),
            ("approach.svg", FileGroup::Curve),
            ("capacitance.csv", FileGroup::Capacitance),
            ("result.json", FileGroup::Json),
            ("report.html", FileGroup::Report),
            ("scene.glb", FileGroup::Scene),
            ("step_", FileGroup::Fields),
            ("fields.pvd", FileGroup::Fields),
            ("section_", FileGroup::Sections),
            ("mechanics.csv", FileGroup::Mechanics),
            ("layer_", FileGroup::Layer),
            ("layer.pvd", FileGroup::Layer),
            ("profile_", FileGroup::Layer),
        ];
        BEGINNINGS.iter().find(|(beginning, _)| name.starts_with(beginning)).map(|(_, group)| *group)
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

/// The files that a run writes; all of them by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted([bool; FileGroup::ALL.len()]);

impl Default for Wanted {
    fn default() -> Self {
        Self([true; FileGroup::ALL.len()])
    }
}

impl Wanted {
    /// These groups alone, and `result.json`, which is always written.
    pub fn only(groups: &[FileGroup]) -> Self {
        let is_wanted = |group| group == FileGroup::Json || groups.contains(&group);
        Self(FileGroup::ALL.map(is_wanted))
    }

    /// The files that the options of a run ask for.
    pub fn of(options: &Options) -> Self {
        let mut wanted = Self::default();
        if !options.scene {
            wanted = wanted.without(&[FileGroup::Scene]);
        }
        if !options.fields {
            wanted = wanted.without(&[FileGroup::Fields, FileGroup::Sections, FileGroup::Layer]);
        }
        wanted
    }

    /// The same files without these groups.
    #[must_use]
    pub fn without(self, groups: &[FileGroup]) -> Self {
        let mut remaining = self;
        for (wanted, group) in remaining.0.iter_mut().zip(FileGroup::ALL) {
            *wanted &= group == FileGroup::Json || !groups.contains(&group);
        }
        remaining
    }

    /// Whether these files are written.
    pub fn has(&self, group: FileGroup) -> bool {
        FileGroup::ALL.iter().zip(self.0).any(|(known, wanted)| *known == group && wanted)
    }

    /// Whether the fields must be evaluated: for their files, or for the pictures of them.
    pub fn needs_fields(&self) -> bool {
        [FileGroup::Fields, FileGroup::Sections, FileGroup::Report].into_iter().any(|group| self.has(group))
    }

    /// Whether sections through the field are drawn, as files or in the report.
    pub fn needs_sections(&self) -> bool {
        self.has(FileGroup::Sections) || self.has(FileGroup::Report)
    }

    /// The names of the wanted groups, in the order of [`FileGroup::ALL`].
    pub fn names(&self) -> Vec<String> {
        FileGroup::ALL
            .iter()
            .zip(self.0)
            .filter(|(_, wanted)| *wanted)
            .map(|(group, _)| group.to_string())
            .collect()
    }

    /// Makes a plan say which files are written, and which are left out because the caller does not want
    /// them.
    pub fn note_in(&self, plan: &mut Plan) {
        let mut unwanted: Vec<String> = Vec::new();
        for planned in plan.solved.iter_mut().filter(|planned| planned.part == "files") {
            let (wanted, left_out): (Vec<&str>, Vec<&str>) = planned
                .what
                .split(", ")
                .partition(|file| FileGroup::of(file).is_none_or(|group| self.has(group)));
            unwanted.extend(left_out.iter().map(|file| (*file).to_owned()));
            planned.what = wanted.join(", ");
        }
        if !unwanted.is_empty() {
            plan.left_out.push(LeftOut {
                what: unwanted.join(", "),
                why: "not asked for".to_owned(),
                by: Decision::Caller,
                saving: "Saves making and writing them.".to_owned(),
                saved_unknowns: None,
                saved_seconds: None,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output_folder::is_result_name;

    #[test]
    fn every_word_reads_back_and_others_are_answered_with_the_words_there_are() {
        for group in FileGroup::ALL {
            assert_eq!(group.name().parse(), Ok(group));
        }
        let error = "pictures".parse::<FileGroup>().unwrap_err().to_string();
        assert!(FileGroup::ALL.iter().all(|group| error.contains(group.name())), "{error}");
    }

    #[test]
    fn every_file_of_a_run_belongs_to_a_group() {
        let files = [
            "curve.csv",
            "curve.svg",
            "approach.svg",
            "capacitance.csv",
            "result.json",
            "report.html",
            "scene.glb",
        ];
        let more = [
            "step_001.vtu",
            "fields.pvd",
            "section_000.svg",
            "mechanics.csv",
            "layer_000.vtu",
            "layer.pvd",
            "profile_000.csv",
        ];
        for file in files.into_iter().chain(more) {
            assert!(is_result_name(file) && FileGroup::of(file).is_some(), "{file}");
        }
    }

    #[test]
    fn the_list_of_files_is_there_whatever_is_asked_for() {
        let wanted = Wanted::only(&[FileGroup::Curve]);
        assert_eq!(wanted.names(), ["curve", "json"]);
        assert!(!wanted.needs_fields() && Wanted::only(&[FileGroup::Report]).needs_fields());
        assert!(Wanted::default().without(&[FileGroup::Json]).has(FileGroup::Json));
    }
}

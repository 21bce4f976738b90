//! Which files a run writes.

use elastocap_case::Case;
use elastocap_coupling::plan::{Decision, Kind, LeftOut, Options, Plan, Planned};

use crate::output_files::{FILES, FileGroup};

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

    /// Adds the files to a plan: those that are written, and those that are left out because the caller does
    /// not want them.
    pub fn note_in(&self, case: &Case, options: &Options, plan: &mut Plan) {
        let mut left_out = |what: &str, saving: &str| {
            plan.left_out.push(LeftOut {
                what: what.to_owned(),
                why: "not asked for".to_owned(),
                by: Decision::Caller,
                saving: saving.to_owned(),
                saved_unknowns: None,
                saved_seconds: None,
            });
        };
        if !options.scene {
            left_out("scene.glb", "Saves milliseconds.");
        }
        if !options.fields && plan.kind != Kind::Mechanics {
            left_out("fields (.vtu)", "Saves evaluating and compressing the field of each step.");
        }
        let planned = FILES.iter().filter_map(|file| Some((file.group?, file.planned?, file.when)));
        let is_possible = |group| match group {
            FileGroup::Scene => options.scene,
            FileGroup::Fields | FileGroup::Sections => options.fields,
            _ => true,
        };
        let planned = planned.filter(|(group, _, when)| is_possible(*group) && when(case, plan.kind));
        let (written, unwanted): (Vec<_>, Vec<_>) = planned.partition(|(group, _, _)| self.has(*group));
        let names = |files: &[Entry]| files.iter().map(|file| file.1).collect::<Vec<_>>().join(", ");
        if !unwanted.is_empty() {
            left_out(&names(&unwanted), "Saves making and writing them.");
        }
        plan.solved.push(Planned { part: "files", what: names(&written) });
    }
}

/// An entry of [`FILES`] that a plan may list: its group, its name in a plan, and when it is written.
type Entry = (FileGroup, &'static str, fn(&Case, Kind) -> bool);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_files_is_there_whatever_is_asked_for() {
        let wanted = Wanted::only(&[FileGroup::Curve]);
        assert_eq!(wanted.names(), ["curve", "json"]);
        assert!(!wanted.needs_fields() && Wanted::only(&[FileGroup::Report]).needs_fields());
        assert!(Wanted::default().without(&[FileGroup::Json]).has(FileGroup::Json));
    }

    #[test]
    fn a_plan_lists_the_files_that_a_run_writes_and_those_that_nobody_asked_for() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/in-plane-pair.toml");
        let case = elastocap_case::load(&path).unwrap();
        let noted = |wanted: Wanted, options: Options| {
            let mut plan = Plan::new(&case, &options);
            let before = plan.left_out.len();
            wanted.note_in(&case, &options, &mut plan);
            let left_out: Vec<String> =
                plan.left_out[before..].iter().map(|left| left.what.clone()).collect();
            (plan.solved.last().unwrap().what.clone(), left_out)
        };
        let tables = "curve.csv, curve.svg, capacitance.csv, result.json, report.html, scene.glb";
        let fields = "step_NNN.vtu for each step, fields.pvd, section_NNN.svg for the first and the last";
        let (written, left_out) = noted(Wanted::default(), Options::default());
        assert_eq!((written, left_out.len()), (format!("{tables}, {fields}"), 0));
        let (written, left_out) = noted(Wanted::only(&[FileGroup::Curve]), Options::default());
        assert_eq!(written, "curve.csv, curve.svg, result.json");
        assert_eq!(left_out, [format!("capacitance.csv, report.html, scene.glb, {fields}")]);
        let without = Options { fields: false, ..Options::default() };
        let (written, left_out) = noted(Wanted::of(&without), without);
        assert_eq!((written.as_str(), left_out), (tables, vec!["fields (.vtu)".to_owned()]));
    }
}

//! The files with the fields of a run: their names and their warnings.

use std::collections::BTreeMap;

use crate::output_files::FIELD;

/// The name of a step's field file.
pub fn field_file(index: usize) -> String {
    FIELD.at(index)
}

/// The files with the fields of a run, and the warnings about them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FieldFiles {
    /// The field file of each step, by the index of the step.
    pub(crate) steps: BTreeMap<usize, FieldFile>,
    /// The pictures of the field of each step as SVG, for the report.
    pub(crate) sections: BTreeMap<usize, Vec<String>>,
    /// Warnings about what the files of the layer could not hold.
    pub(crate) layer_warnings: Vec<String>,
}

/// The file with the field of a step, if one was written, and the warning about it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FieldFile {
    /// The name of the file; `None` if none was written.
    pub(crate) name: Option<String>,
    /// The reason why the field could not be written.
    pub(crate) warning: Option<String>,
    /// Wall-clock seconds of making and writing the field and its pictures.
    pub(crate) seconds: f64,
}

impl FieldFiles {
    /// The file with the field of a step, if there is one.
    pub fn name(&self, step: usize) -> Option<&str> {
        self.steps.get(&step)?.name.as_deref()
    }

    /// Why the field of a step was not written, if it could not be.
    pub fn warning(&self, step: usize) -> Option<&str> {
        self.steps.get(&step)?.warning.as_deref()
    }

    /// Wall-clock seconds that making and writing the field of a step took.
    pub fn seconds(&self, step: usize) -> f64 {
        self.steps.get(&step).map_or(0.0, |file| file.seconds)
    }

    /// The sections through the field of a step as SVG; empty if none was drawn.
    pub fn sections(&self, step: usize) -> &[String] {
        self.sections.get(&step).map_or(&[], Vec::as_slice)
    }

    /// Warnings about what the files of the layer could not hold.
    pub fn layer_warnings(&self) -> &[String] {
        &self.layer_warnings
    }

    pub(crate) fn set_name(&mut self, step: usize, name: String) {
        self.steps.entry(step).or_default().name = Some(name);
    }
}

//! A sensor as a network of capacitors that depend on the force.

mod error;
mod network;

use std::collections::BTreeSet;
use std::path::Path;

use elastocap_results::fault;
use elastocap_results::force_answer::read_document;

use crate::curve::{BoundedCurve, StepValue};
use crate::document::{Document, Step};
use crate::identifiers::{identifier, unique};
pub use error::ModelError;

/// The largest number of terminals. The number of capacitors grows with its square.
pub const MOST_TERMINALS: usize = 64;

/// The smallest distance between two forces, as a share of the largest: derivatives between closer forces are
/// meaningless. It is not tuned.
const LEAST_DISTANCE: f64 = 1e-9;

/// The part of a result that becomes a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Content {
    /// The measured capacitance, or the matrix if the run measured that.
    #[default]
    Measured,
    /// The whole Maxwell matrix.
    Matrix,
}

/// The settings of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// The part of the result that becomes a model.
    pub content: Content,
    /// The name of the model; by default that of the folder of the result.
    pub name: Option<String>,
    /// Whether a capacitance may grow with the force in one place and fall in another.
    pub allow_turns: bool,
}

/// A terminal of a sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Terminal {
    /// The name in the case.
    pub name: String,
    /// The name in a model: letters, digits and underscores.
    pub identifier: String,
}

/// A capacitor of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// The terminals at its ends, by their position in [`Model::terminals`]; the second is `None` for the
    /// common node.
    pub ends: (usize, Option<usize>),
    /// The capacitance over the force.
    pub curve: BoundedCurve,
}

/// A sensor as a network of capacitors that depend on the force.
///
/// The charge that flows into terminal `i` is the sum of `C (V_i - V_j)` over the capacitors at it. No
/// capacitor is negative at any force, so that the Maxwell matrix is positive semidefinite.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The name of the model: an identifier.
    pub identifier: String,
    /// The title of the case.
    pub title: String,
    /// The path of the case file, as the result names it.
    pub case: String,
    /// The version of elastocap that solved the case.
    pub solved_by: String,
    /// The kind of capacitance, in words.
    pub quantity: String,
    /// The terminals, in the order of the result.
    pub terminals: Vec<Terminal>,
    /// Whether there is a common node: the zero of all potentials.
    pub has_common: bool,
    /// The forces of the steps, N, strictly increasing; at least two.
    pub forces: Vec<f64>,
    /// The capacitors: mutual capacitances by rows, then those to the common node.
    pub branches: Vec<Branch>,
    /// Whether the bounds are proved; otherwise they are estimates.
    pub is_proved: bool,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

impl Model {
    /// The model of a result, given its folder or the `result.json` in it.
    ///
    /// # Errors
    /// [`ModelError`] if the result cannot be read or has no model.
    pub fn read(result: &Path, settings: &Settings) -> Result<Self, ModelError> {
        let document: Document = read_document(result)?;
        let folder = if result.is_dir() { Some(result) } else { result.parent() };
        // `.` has no name, and neither has the folder of a bare `result.json`.
        let folder = folder.map(|f| if f.as_os_str().is_empty() { Path::new(".") } else { f });
        let folder = folder.and_then(|folder| folder.canonicalize().ok());
        let named =
            folder.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
        let name = settings.name.clone().or(named).unwrap_or_else(|| "sensor".to_owned());
        Self::of(document, &name, settings)
    }

    /// The model of the text of a `result.json`, with a name.
    ///
    /// # Errors
    /// [`ModelError`] if the text is no result or has no model.
    pub fn parse(text: &str, name: &str, settings: &Settings) -> Result<Self, ModelError> {
        Self::of(serde_json::from_str(text).map_err(|error| ModelError::Json(fault(&error)))?, name, settings)
    }

    /// The model of a result, with a name.
    fn of(document: Document, name: &str, settings: &Settings) -> Result<Self, ModelError> {
        if document.status == "stopped" {
            return Err(ModelError::Stopped);
        }
        let steps = pressed_steps(&document)?;
        let measured = document.measurement.as_ref();
        let is_matrix = match (settings.content, measured) {
            (Content::Matrix, _) => true,
            (Content::Measured, Some(measurement)) => measurement.kind == "matrix",
            (Content::Measured, None) => return Err(ModelError::NoCapacitances),
        };
        let forces: Vec<f64> = steps.iter().filter_map(|step| step.force_n).collect();
        let mut notes = notes(&document, &steps);
        let (names, quantity, has_common, values) = match measured {
            Some(measurement) if !is_matrix => {
                let values = network::measured(&steps)?;
                let (quantity, has_common, ends) = match (
                    measurement.kind.as_str(),
                    measurement.terminals.as_slice(),
                ) {
                    ("own", [one]) => (format!("capacitance of \"{one}\" against ground"), true, (0, None)),
                    ("mutual", [a, b]) => {
                        notes.push(
                            "This is the mutual capacitance of two terminals; those to ground and to others are not in the model. \
                             A model of the whole matrix has them."
                                .to_owned(),
                        );
                        (format!("mutual capacitance of \"{a}\" and \"{b}\""), false, (0, Some(1)))
                    }
                    ("guarded", [one, guard]) => {
                        notes.push(format!(
                            "The guard \"{guard}\" has the potential of \"{one}\" and is not in the model: it draws no charge from it."
                        ));
                        (format!("capacitance of \"{one}\" against ground"), true, (0, None))
                    }
                    (_, [a, b]) => {
                        (format!("two-terminal capacitance of \"{a}\" and \"{b}\""), false, (0, Some(1)))
                    }
                    (_, [one]) => (format!("capacitance of \"{one}\" against ground"), true, (0, None)),
                    (_, _) => return Err(ModelError::NoCapacitances),
                };
                let pins =
                    if ends.1.is_none() { &measurement.terminals[..1] } else { &measurement.terminals[..] };
                (pins.to_vec(), quantity, has_common, vec![(ends, values)])
            }
            Some(_) | None => {
                if document.conductors.len() > MOST_TERMINALS {
                    return Err(ModelError::TooManyTerminals(document.conductors.len()));
                }
                let values = network::matrix(&steps, document.conductors.len())?;
                let quantity =
                    "Maxwell matrix as a network: mutual capacitances and those to common".to_owned();
                (document.conductors.clone(), quantity, true, values)
            }
        };
        let identifiers = unique(&names);
        let terminals: Vec<Terminal> = names
            .into_iter()
            .zip(identifiers)
            .map(|(name, identifier)| Terminal { name, identifier })
            .collect();
        let mut branches = Vec::new();
        for (ends, values) in values {
            // A capacitance that is proved to be zero at every step needs no capacitor.
            if values.iter().all(|v| v.upper == 0.0) && is_matrix {
                continue;
            }
            let branch = Branch { ends, curve: BoundedCurve::through(forces.clone(), values) };
            if !branch.curve.is_finite() {
                let with_steps = branch.curve.steps().iter().zip(&steps);
                let largest = with_steps.max_by(|a, b| a.0.upper.total_cmp(&b.0.upper));
                return Err(ModelError::Damaged(largest.map_or(0, |(_, step)| step.index)));
            }
            refuse_turns(&branch, &terminals, settings.allow_turns)?;
            branches.push(branch);
        }
        if branches.is_empty() {
            return Err(ModelError::NoCapacitances);
        }
        notes.extend(notes_of_shape(&branches, &terminals));
        Ok(Self {
            identifier: identifier(name),
            title: document.title,
            case: document.case,
            solved_by: document.versions.elastocap,
            quantity,
            terminals,
            has_common,
            forces,
            branches,
            is_proved: document.bounds.as_deref() != Some("estimated"),
            notes,
        })
    }

    /// The smallest and the largest force, N.
    pub fn range(&self) -> [f64; 2] {
        [self.forces[0], self.forces[self.forces.len() - 1]]
    }

    /// Whether the model has only one capacitor.
    pub fn is_single(&self) -> bool {
        self.branches.len() == 1
    }

    /// Whether capacitances to the common node have another band than the mutual ones: those of a matrix do,
    /// since they are less accurate.
    pub fn has_ground_band(&self) -> bool {
        !self.is_single() && self.branches.iter().any(|branch| branch.ends.1.is_none())
    }

    /// The names of a capacitor's ends in the case.
    pub fn ends(&self, branch: &Branch) -> [&str; 2] {
        let (i, j) = branch.ends;
        [&self.terminals[i].name, j.map_or("common", |j| &self.terminals[j].name)]
    }

    /// An identifier for each capacitor: `capacitance` for a single one, otherwise with the identifiers of
    /// its ends.
    pub fn branch_identifiers(&self) -> Vec<String> {
        if self.is_single() {
            return vec!["capacitance".to_owned()];
        }
        let joined_name = |branch: &Branch| {
            let (i, j) = branch.ends;
            let other = j.map_or("common", |j| self.terminals[j].identifier.as_str());
            format!("capacitance_{}_{other}", self.terminals[i].identifier)
        };
        // The joined names of different pairs may be equal, also once an ending such as `_lower` is added to
        // one of them.
        let mut taken = BTreeSet::new();
        let mut distinct = |name: String| {
            let with_endings = |name: &str| {
                ["", "_lower", "_upper", "_derivative"].map(|end| format!("{name}{end}").to_ascii_lowercase())
            };
            let mut identifier = name.clone();
            let mut number = 2;
            while with_endings(&identifier).iter().any(|name| taken.contains(name)) {
                identifier = format!("{name}__{number}");
                number += 1;
            }
            taken.extend(with_endings(&identifier));
            identifier
        };
        self.branches.iter().map(|branch| distinct(joined_name(branch))).collect()
    }

    /// The largest distance of a bound from the value at a step, as a share of the capacitor's largest value.
    /// Capacitors to the common node count only where there are no others: those of a matrix are less
    /// accurate.
    pub fn largest_relative_error(&self) -> f64 {
        let error_of = |branch: &Branch| {
            let scale = branch.curve.scale();
            let steps = branch.curve.steps().iter();
            steps.map(|s| (s.upper - s.value).max(s.value - s.lower) / scale).fold(0.0, f64::max)
        };
        let counted = self.branches.iter().filter(|b| self.is_single() || b.ends.1.is_some());
        counted.map(error_of).fold(0.0, f64::max)
    }

    /// The largest estimated error of interpolation, as a share of the capacitor's largest value; `None` if
    /// the steps of a capacitor give no estimate.
    pub fn interpolation_error(&self) -> Option<f64> {
        let error_of = |branch: &Branch| {
            let errors: Option<Vec<f64>> = branch.curve.interpolation_errors().into_iter().collect();
            Some(errors?.into_iter().fold(0.0, f64::max) / branch.curve.scale())
        };
        self.branches.iter().map(error_of).try_fold(0.0, |largest: f64, error| Some(largest.max(error?)))
    }
}

/// The steps from contact on, in the order of their forces, which must differ.
fn pressed_steps(document: &Document) -> Result<Vec<&Step>, ModelError> {
    let planned = document.plan.steps.iter().zip(&document.steps);
    let poses: Vec<_> =
        planned.filter(|(_, step)| !step.is_before_contact()).map(|(plan, _)| &plan.pose).collect();
    if poses.windows(2).any(|pair| pair[0] != pair[1]) {
        return Err(ModelError::Moved);
    }
    let mut steps: Vec<&Step> = document.steps.iter().filter(|step| !step.is_before_contact()).collect();
    if steps.iter().all(|step| step.force_n.is_none() && step.compression.is_none()) {
        return Err(ModelError::NoLoad);
    }
    for step in &steps {
        if step.status.starts_with("failed") || step.status == "not run" {
            return Err(ModelError::FailedStep { step: step.index, reason: step.why() });
        }
        match step.force_n {
            None => return Err(ModelError::NoForce { step: step.index, reason: step.why() }),
            Some(force) if !force.is_finite() || force < 0.0 => return Err(ModelError::Damaged(step.index)),
            Some(_) => {}
        }
    }
    // The force must grow with the compression, or one force would have two states.
    if steps.iter().all(|step| step.compression.is_some()) {
        steps.sort_by(|a, b| a.compression.unwrap_or(0.0).total_cmp(&b.compression.unwrap_or(0.0)));
        steps.dedup_by(|later, earlier| {
            later.compression == earlier.compression && later.force_n == earlier.force_n
        });
    } else {
        steps.sort_by(|a, b| a.force_n.unwrap_or(0.0).total_cmp(&b.force_n.unwrap_or(0.0)));
    }
    if let Some(pair) = steps.windows(2).find(|pair| pair[1].force_n <= pair[0].force_n) {
        let force = |k: usize| pair[k].force_n.unwrap_or(0.0);
        return Err(ModelError::ForceTurns {
            before: pair[0].index,
            force_before: force(0),
            after: pair[1].index,
            force_after: force(1),
        });
    }
    if steps.len() < 2 {
        return Err(ModelError::TooFewSteps(steps.len()));
    }
    let last = steps.last().and_then(|step| step.force_n).unwrap_or(0.0);
    let distance = |pair: &[&Step]| pair[1].force_n.unwrap_or(0.0) - pair[0].force_n.unwrap_or(0.0);
    if let Some(pair) = steps.windows(2).find(|pair| distance(pair) < LEAST_DISTANCE * last) {
        return Err(ModelError::TooClose { one: pair[0].index, other: pair[1].index });
    }
    Ok(steps)
}

/// The name of a capacitor, in words.
fn name_of(branch: &Branch, terminals: &[Terminal]) -> String {
    let (i, j) = branch.ends;
    match j {
        Some(j) => format!("between \"{}\" and \"{}\"", terminals[i].name, terminals[j].name),
        None => format!("of \"{}\" to ground", terminals[i].name),
    }
}

/// Refuses a capacitor whose bounds prove that it grows with the force in one place and falls in another.
fn refuse_turns(branch: &Branch, terminals: &[Terminal], allowed: bool) -> Result<(), ModelError> {
    let (mut least_upper, mut greatest_lower) = (f64::INFINITY, 0.0_f64);
    let (mut grows, mut falls) = (false, false);
    for (k, StepValue { lower, upper, .. }) in branch.curve.steps().iter().enumerate() {
        grows |= *lower > least_upper;
        falls |= *upper < greatest_lower;
        least_upper = least_upper.min(*upper);
        greatest_lower = greatest_lower.max(*lower);
        if grows && falls && !allowed {
            let force = branch.curve.forces()[k.saturating_sub(1)];
            return Err(ModelError::Turns { name: name_of(branch, terminals), force });
        }
    }
    Ok(())
}

/// Notes on capacitors that are not monotone, one sentence for all of a kind.
fn notes_of_shape(branches: &[Branch], terminals: &[Terminal]) -> Vec<String> {
    let (mut turning, mut loose) = (Vec::new(), Vec::new());
    for branch in branches {
        let [lower, value, upper] = branch.curve.is_monotone();
        if !value {
            turning.push(name_of(branch, terminals));
        } else if !(lower && upper) && branch.curve.steps().iter().any(|step| step.value > 0.0) {
            loose.push(name_of(branch, terminals));
        }
    }
    let note = |names: &[String], text: &str| {
        let first = names.first()?;
        let others = match names.len() {
            1 => String::new(),
            2 => " and of one other".to_owned(),
            count => format!(" and of {} others", count - 1),
        };
        Some(format!("The capacitance {first}{others} {text}"))
    };
    let turning = note(
        &turning,
        "does not grow or fall with the force everywhere, by less than its bounds tell or as allowed; between two steps it goes one way.",
    );
    let loose = note(
        &loose,
        "has bounds as far apart as some of its steps are: at the ends of the band it does not grow or fall everywhere. A smaller \
         `relative_tolerance` brings them together.",
    );
    [turning, loose].into_iter().flatten().collect()
}

/// Notes for the user of the model.
fn notes(document: &Document, steps: &[&Step]) -> Vec<String> {
    let mut out = Vec::new();
    if document.bounds.as_deref() == Some("estimated") {
        out.push("The bounds are estimated errors and not proved (`bounds = false` in the case).".to_owned());
    }
    let missed: Vec<String> = steps
        .iter()
        .filter(|step| step.status.starts_with("tolerance not reached"))
        .map(|step| step.index.to_string())
        .collect();
    if !missed.is_empty() {
        out.push(format!(
            "The run missed its tolerance at step {}; the bounds there are proved, and wider.",
            missed.join(", ")
        ));
    }
    if steps.iter().any(|step| step.estimates() > 0.0) {
        out.push(
            "The bounds include the estimated errors of the layer's finite elements and of flat faces, which are not proved."
                .to_owned(),
        );
    }
    let of_model = steps.iter().filter_map(|step| step.model_error_estimate).fold(0.0, f64::max);
    if of_model > 0.0 {
        out.push(format!(
            "The model of the layer may be off by up to {:.2} % of the capacitance, which is not in the bounds.",
            1e2 * of_model
        ));
    }
    let forces = || steps.iter().filter(|step| step.force_n.is_some_and(|force| force > 0.0));
    if forces().any(|step| step.force_error_estimate.is_none()) {
        out.push("The error of the forces is not known at all steps, and not in the bounds.".to_owned());
    }
    let error = forces().filter_map(|step| step.force_error_estimate).fold(0.0, f64::max);
    if error > 0.0 {
        out.push(format!(
            "The forces have an estimated error of up to {:.2} %, which is not in the bounds: scale the force to see it.",
            1e2 * error
        ));
    }
    if let Some(first) = steps.first().and_then(|step| step.force_n).filter(|force| *force > 0.0) {
        out.push(format!(
            "The run begins at {first} N, and so does the model; a step with `force` or `compression` 0 takes it to zero."
        ));
    }
    out
}

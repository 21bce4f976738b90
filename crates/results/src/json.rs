//! `result.json`: everything that a run found and how it found it.

use elastocap_electrostatics::{Bounded, PhaseSeconds};
use serde::Serialize;

use crate::FieldFiles;
use crate::measured::{Comparison, compare};
use elastocap_case::{Case, Terminal};
use elastocap_coupling::deform::{FiniteElementStep, ForceCheck, MeshReport};
use elastocap_coupling::outcome::{EntryStatus, FloatingConductor, Outcome, Row, SolverReport, StepResult};
use elastocap_coupling::plan::{Kind, Plan};
use elastocap_coupling::reason::Reason;
use elastocap_coupling::route::Route;
use elastocap_coupling::route_change::RouteChange;
use elastocap_coupling::terminals::{named, shown_terminals};

/// Wall-clock seconds of a whole run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct RunSeconds {
    /// Reading the case and planning.
    pub plan: f64,
    /// All steps, fields staged as they are done.
    pub solve: f64,
    /// The other files, but for result.json itself.
    pub files: f64,
    /// From the start to result.json.
    pub total: f64,
}

#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    case: String,
    /// The text of the case file, where the caller gave it.
    #[serde(skip_serializing_if = "Option::is_none")]
    case_text: Option<&'a str>,
    /// "complete", "incomplete" (steps failed or missed their tolerance), "stopped".
    status: &'static str,
    conductors: &'a [String],
    /// The terminals that the case names, each with the conductors on its wire.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    terminals: Vec<Wire<'a>>,
    /// The capacitance that is measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    measurement: Option<Measured<'a>>,
    /// The capacitances of a scene without load, whose only state is also the first of `steps`.
    #[serde(flatten)]
    capacitance: Option<Capacitance<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    parallel_plate_f: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fringe_ratio: Option<f64>,
    /// "proved" or "estimated".
    bounds: Option<&'static str>,
    relative_tolerance: Option<f64>,
    /// The tolerance asked for of the change against the first load step.
    #[serde(skip_serializing_if = "Option::is_none")]
    change_tolerance: Option<f64>,
    /// Measured points beside the curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_points: Option<&'a Comparison>,
    steps: Vec<Step<'a>>,
    /// The meshes of a layer of finite elements, in the order of refinement.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    layer_meshes: &'a [MeshReport],
    #[serde(skip_serializing_if = "Option::is_none")]
    layer_seconds: Option<f64>,
    plan: &'a Plan,
    warnings: Vec<String>,
    seconds: RunSeconds,
    threads: usize,
    versions: Versions,
    /// The names of all files of the run.
    files: Vec<String>,
}

/// A terminal: the conductors that one wire joins.
#[derive(Serialize)]
struct Wire<'a> {
    name: &'a str,
    conductors: &'a [String],
    /// "driven" or "ground".
    potential: &'static str,
}

impl<'a> Wire<'a> {
    fn of(terminal: &'a Terminal, driven: &[String]) -> Self {
        let Terminal { name, conductors, .. } = terminal;
        Self { name, conductors, potential: if driven.contains(name) { "driven" } else { "ground" } }
    }
}

/// The measurement that `capacitance_f` and its bounds are of.
#[derive(Serialize)]
struct Measured<'a> {
    /// "two_terminal", "mutual", "own" (against ground), "guarded" (the first against ground, the second at
    /// its potential) or "matrix", of which one entry is shown.
    kind: &'static str,
    terminals: Vec<&'a str>,
    /// The terminals of the capacitance that `capacitance_f` is.
    shown: Vec<&'a str>,
}

/// The capacitances of one state, under the names that stand at the top of a static scene's result as well.
#[derive(Serialize)]
struct Capacitance<'a> {
    maxwell_matrix_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_lower_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_upper_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_status: Option<&'a [Vec<EntryStatus>]>,
    two_terminal_capacitance_f: Option<f64>,
    capacitance_f: Option<f64>,
    capacitance_lower_f: Option<f64>,
    capacitance_upper_f: Option<f64>,
    relative_error_estimate: Option<f64>,
    geometry_error_estimate: Option<f64>,
    unknowns: Option<usize>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    floating_conductors: Vec<Floating>,
}

/// Potentials of a floating conductor: per volt on each of the document's conductors, and from the charges. A
/// limit that is not known is null.
#[derive(Serialize)]
struct Floating {
    name: String,
    charge_c: f64,
    potential_per_volt: Vec<f64>,
    potential_per_volt_lower: Vec<f64>,
    potential_per_volt_upper: Vec<f64>,
    potential_from_charges_v: f64,
    potential_from_charges_lower_v: f64,
    potential_from_charges_upper_v: f64,
}

impl Floating {
    fn of(conductor: &FloatingConductor) -> Self {
        let per_volt = |pick: fn(&Bounded) -> f64| conductor.per_volt.iter().map(pick).collect();
        let Bounded { value, lower, upper } = conductor.from_charges;
        Self {
            name: conductor.name.clone(),
            charge_c: conductor.charge,
            potential_per_volt: per_volt(|b| b.value),
            potential_per_volt_lower: per_volt(|b| b.lower),
            potential_per_volt_upper: per_volt(|b| b.upper),
            potential_from_charges_v: value,
            potential_from_charges_lower_v: lower,
            potential_from_charges_upper_v: upper,
        }
    }
}

impl<'a> Capacitance<'a> {
    fn of(step: &'a StepResult) -> Self {
        let matrix = |pick: fn(&Bounded) -> f64| step.maxwell.as_ref().map(|m| entries(m, pick));
        Self {
            maxwell_matrix_f: matrix(|c| c.value),
            maxwell_matrix_lower_f: matrix(|c| c.lower),
            maxwell_matrix_upper_f: matrix(|c| c.upper),
            maxwell_matrix_status: step.entry_status.as_deref(),
            two_terminal_capacitance_f: step.row.two_terminal_capacitance_f,
            capacitance_f: step.row.capacitance_f,
            capacitance_lower_f: step.row.capacitance_lower_f,
            capacitance_upper_f: step.row.capacitance_upper_f,
            relative_error_estimate: step.row.relative_error_estimate,
            geometry_error_estimate: step.row.geometry_error_estimate,
            unknowns: step.row.unknowns,
            floating_conductors: step.floating.iter().map(Floating::of).collect(),
        }
    }
}

#[derive(Serialize)]
struct Step<'a> {
    index: usize,
    #[serde(flatten)]
    row: &'a Row,
    reason: Option<&'a Reason>,
    warnings: Vec<&'a str>,
    same_as: Option<usize>,
    /// How the field was solved.
    route: Option<Route>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    route_changes: &'a [RouteChange],
    maxwell_matrix_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_lower_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_upper_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_status: Option<&'a [Vec<EntryStatus>]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    floating_conductors: Vec<Floating>,
    solver: Option<&'a SolverReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    layer: Option<&'a FiniteElementStep>,
    /// How far the closed form's force may be trusted.
    #[serde(skip_serializing_if = "Option::is_none")]
    closed_form_check: Option<ForceCheck>,
    seconds: Seconds,
    field_file: Option<&'a str>,
}

#[derive(Serialize)]
struct Seconds {
    mechanics: f64,
    electrostatics: PhaseSeconds,
    files: f64,
    total: f64,
}

#[derive(Serialize)]
struct Versions {
    elastocap: &'static str,
    case_format: u32,
    /// The architecture of the processor and the operating system.
    system: String,
    /// Whether the program was built with debug assertions.
    debug_assertions: bool,
}

/// One number of each entry of a matrix.
fn entries(matrix: &[Vec<Bounded>], pick: fn(&Bounded) -> f64) -> Vec<Vec<f64>> {
    matrix.iter().map(|row| row.iter().map(pick).collect()).collect()
}

impl<'a> Step<'a> {
    fn of(step: &'a StepResult, fields: &'a FieldFiles) -> Self {
        let Capacitance {
            maxwell_matrix_f,
            maxwell_matrix_lower_f,
            maxwell_matrix_upper_f,
            maxwell_matrix_status,
            floating_conductors,
            ..
        } = Capacitance::of(step);
        Self {
            index: step.index,
            row: &step.row,
            reason: step.reason.as_ref(),
            warnings: step.warnings.iter().map(String::as_str).chain(fields.warning(step.index)).collect(),
            same_as: step.same_as,
            route: step.route,
            route_changes: &step.route_changes,
            maxwell_matrix_f,
            maxwell_matrix_lower_f,
            maxwell_matrix_upper_f,
            maxwell_matrix_status,
            floating_conductors,
            solver: step.solver.as_ref(),
            layer: step.layer.as_ref(),
            closed_form_check: step.force_check,
            seconds: Seconds {
                mechanics: step.seconds.mechanics,
                electrostatics: step.seconds.electrostatics,
                files: fields.seconds(step.index),
                total: step.seconds.total,
            },
            field_file: fields.name(step.index),
        }
    }
}

/// The text of `mesh.json`: what the case was, and the files made of it.
pub(crate) fn mesh_document(case: &Case, files: &[String]) -> String {
    let document = serde_json::json!({
        "title": case.title,
        "case": case.source.display().to_string(),
        "versions": { "elastocap": env!("CARGO_PKG_VERSION"), "case_format": 1 },
        "files": files,
    });
    format!("{document:#}\n")
}

/// The text of `result.json`; `files` are the run's files, `warnings` what came up while they were written,
/// `case_text` is the text of the case file.
///
/// # Errors
/// An error of serialization, which is not expected: every value of the document has a form in JSON.
pub fn document(
    case: &Case,
    outcome: &Outcome,
    fields: &FieldFiles,
    files: Vec<String>,
    warnings: Vec<String>,
    seconds: RunSeconds,
    case_text: Option<&str>,
) -> serde_json::Result<String> {
    let static_step = (outcome.plan.kind == Kind::Capacitance).then(|| outcome.steps.first()).flatten();
    let measured_points = compare(case, outcome).and_then(Result::ok);
    let document = Document {
        title: &case.title,
        case: case.source.display().to_string(),
        case_text,
        status: match (outcome.is_complete(), outcome.stopped) {
            (true, _) => "complete",
            (false, true) => "stopped",
            (false, false) => "incomplete",
        },
        conductors: &outcome.conductors,
        terminals: case.terminals.iter().map(|wire| Wire::of(wire, &outcome.conductors)).collect(),
        measurement: outcome.measurement.map(|measurement| {
            let (kind, terminals) = named(measurement, &outcome.conductors);
            Measured { kind, terminals, shown: shown_terminals(measurement, &outcome.conductors) }
        }),
        capacitance: static_step.map(Capacitance::of),
        parallel_plate_f: static_step.and_then(|s| s.row.parallel_plate_f),
        fringe_ratio: static_step.and_then(|s| s.row.fringe_ratio),
        bounds: case.electrostatics.map(|e| if e.bounds { "proved" } else { "estimated" }),
        relative_tolerance: case.electrostatics.map(|e| e.relative_tolerance),
        change_tolerance: case.electrostatics.and_then(|e| e.change_tolerance),
        measured_points: measured_points.as_ref(),
        steps: outcome.steps.iter().map(|step| Step::of(step, fields)).collect(),
        layer_meshes: &outcome.layer_meshes,
        layer_seconds: (!outcome.layer_meshes.is_empty()).then_some(outcome.layer_seconds),
        plan: &outcome.plan,
        warnings: [outcome.plan.warnings.clone(), warnings].concat(),
        seconds,
        threads: outcome.threads,
        versions: Versions {
            elastocap: env!("CARGO_PKG_VERSION"),
            case_format: 1,
            system: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            debug_assertions: cfg!(debug_assertions),
        },
        files,
    };
    let mut text = serde_json::to_string_pretty(&document)?;
    text.push('\n');
    Ok(text)
}

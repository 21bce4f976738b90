//! The work that a plan omits, and the savings.

use elastocap_case::{Case, FieldIndenter};
use elastocap_electrostatics::Forecast;
use elastocap_geometry::scene::Role;
use serde::Serialize;

use super::{Options, Plan};
use crate::words::{counted, grouped, listed, seconds};

/// A part of the work that is omitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// A description of the omitted work.
    pub what: String,
    /// The reason.
    pub why: String,
    /// The origin of the choice; `--no-prune` undoes only those of the plan.
    pub by: Decision,
    /// The saving, a sentence.
    pub saving: String,
    /// The number of unknowns that it saves.
    pub saved_unknowns: Option<usize>,
    /// The forecast of the time that it saves, seconds.
    pub saved_seconds: Option<f64>,
}

/// The origin of the choice to omit something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// The plan's: the result does not need it.
    Plan,
    /// The case's: it does not ask for it.
    Case,
    /// The caller's, by an option.
    Caller,
}

impl LeftOut {
    pub(super) fn new(
        by: Decision,
        what: impl Into<String>,
        why: impl Into<String>,
        saving: impl Into<String>,
    ) -> Self {
        let (what, why, saving) = (what.into(), why.into(), saving.into());
        Self { what, why, by, saving, saved_unknowns: None, saved_seconds: None }
    }
}

impl Plan {
    /// Notes the mirror images that `solves` solves of the box solver omit.
    pub(super) fn mirror_images(&mut self, forecast: &Forecast, solves: usize) {
        let planes = axes(forecast.mirrored);
        let images = (!planes.is_empty()).then(|| format!("mirror images along {}", listed(&planes)));
        let turned =
            forecast.turned.then(|| "what a half turn about x2 brings to the place of the rest".to_owned());
        let what = match (images, turned) {
            (None, None) => return,
            (Some(one), None) | (None, Some(one)) => one,
            (Some(images), Some(turned)) => format!("{images}, and {turned}"),
        };
        let why = match (planes.is_empty(), forecast.turned) {
            (false, false) => "the scene is its own mirror image",
            (false, true) => "the scene is its own mirror image, and its own image after the turn",
            (true, _) => "the scene is its own image after the turn",
        };
        let (unknowns, unmirrored_seconds) = forecast.unmirrored;
        let saved_seconds = (unmirrored_seconds - forecast.seconds).max(0.0) * solves as f64;
        let saving = format!(
            "Symmetry cuts the unknowns from {} to {} and saves about {}.",
            grouped(unknowns),
            grouped(forecast.unknowns),
            seconds(saved_seconds)
        );
        let mut left = LeftOut::new(Decision::Plan, what, why, saving);
        left.saved_unknowns = Some(unknowns.saturating_sub(forecast.unknowns));
        left.saved_seconds = Some(saved_seconds);
        self.left_out.push(left);
    }

    /// Notes the mirror images that a mesh of unknown size omits; `turned` describes an earlier rotation of
    /// the scene.
    pub(super) fn mirrored_mesh(&mut self, turned: &str) {
        let planes = axes(self.mirrored);
        let share = match planes.len() {
            0 => return,
            1 => "half",
            2 => "a quarter",
            _ => "an eighth",
        };
        let what = format!("mirror images along {}{turned}", listed(&planes));
        let saving = format!("Symmetry cuts the mesh to {share}.");
        let why = "the scene is its own mirror image";
        self.left_out.push(LeftOut::new(Decision::Plan, what, why, saving));
    }

    /// Notes the dielectrics that the field of the first step omits because their surroundings have the same
    /// permittivity.
    pub(super) fn neutral_bodies(&mut self, case: &Case, options: &Options) {
        let Some((_, scene)) = self.first_scene(case, options, |_| true) else { return };
        let named = |name: &str| scene.bodies.iter().any(|body| body.name == name);
        let dielectrics =
            case.bodies.iter().filter(|body| !body.is_conductor()).map(|body| body.name.as_str());
        let indenter = case.indenter.filter(|indenter| matches!(indenter.role, Role::Dielectric { .. }));
        let names: Vec<String> = dielectrics
            .chain(indenter.map(|_| FieldIndenter::NAME))
            .filter(|name| !named(name))
            .map(|name| format!("`{name}`"))
            .collect();
        if !names.is_empty() {
            let why = "the permittivity there is the same without";
            let saving = "Saves its shape in the mesh; steps that differ in it alone are one.";
            self.left_out.push(LeftOut::new(Decision::Case, listed(&names), why, saving));
        }
    }

    /// Notes the steps that take over the result of an earlier one.
    pub(super) fn repeated_steps(&mut self) {
        let repeated: Vec<_> = self.steps.iter().filter(|s| s.same_as.is_some()).map(|s| s.index).collect();
        if repeated.is_empty() {
            return;
        }
        let distinct = self.steps.len() - repeated.len();
        let saved_seconds = self.seconds / distinct.max(1) as f64 * repeated.len() as f64;
        let list: Vec<_> = repeated.iter().take(8).map(ToString::to_string).collect();
        let more = if repeated.len() > 8 { ", ..." } else { "" };
        let mut left = LeftOut::new(
            Decision::Plan,
            format!("step{} {}{more}", if repeated.len() == 1 { "" } else { "s" }, list.join(", ")),
            "an earlier step has the same load and the same scene: its result is taken over",
            format!(
                "Solving {} of {} saves about {}.",
                grouped(distinct),
                counted(self.steps.len(), "step"),
                seconds(saved_seconds)
            ),
        );
        left.saved_seconds = Some(saved_seconds);
        self.left_out.push(left);
    }
}

/// The names of the axes with mirror planes.
fn axes(mirrored: [bool; 3]) -> Vec<String> {
    (0..3).filter(|a| mirrored[*a]).map(|a| format!("x{}", a + 1)).collect()
}

//! The layer under its loads, by whichever mechanics the case asks for.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under compressive loading
//! for a MEMS tactile sensor application".

mod curves;
mod electrode_box;
mod finite_element;
mod plane_strain;
mod shear_length;
mod solid;

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use elastocap_mechanics::{ClosedFormSettings, LayerState, MechanicsError, MooneyRivlin, force_limit};

pub use curves::{Curve, DeformedCurves, simplified};
pub use electrode_box::{ElectrodeBox, Ends};
pub use finite_element::{FiniteElementRun, FiniteElementStep, MeshReport, Solution};
pub use plane_strain::forecast;
pub use solid::forecast as forecast_solid;

use crate::plan::{Plan, PlannedStep, StepLoad};
use elastocap_case::{Case, Mechanics, ShearLength};

/// The layer at one load.
#[derive(Debug, Clone)]
pub enum Deformation<'a> {
    /// By the closed form.
    ClosedForm(LayerState),
    /// By finite elements.
    FiniteElement(&'a FiniteElementStep),
}

impl Deformation<'_> {
    /// U/H.
    pub fn compression(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.compression(),
            Self::FiniteElement(step) => step.compression,
        }
    }

    /// U, m.
    pub fn top_displacement(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.top_displacement(),
            Self::FiniteElement(step) => step.top_displacement,
        }
    }

    /// Thickness that is left under the indenter, m.
    pub fn deformed_thickness(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.deformed_thickness(),
            Self::FiniteElement(step) => step.deformed_thickness,
        }
    }

    /// Compressive, N.
    pub fn force(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.force(),
            Self::FiniteElement(step) => step.force,
        }
    }
}

/// What had to be solved before the steps can be taken one by one.
#[derive(Debug)]
pub enum Prepared {
    /// Nothing: every step has its closed form, or nothing deforms.
    StepByStep,
    /// The whole path of the layer.
    FiniteElement(FiniteElementRun),
    /// The closed form of each step of the plan, with a shear length from finite elements.
    ClosedForm(Vec<Result<LayerState, String>>),
}

/// Solves what the steps of `plan` have in common. `tell` is told what is being worked on.
pub fn prepare(case: &Case, plan: &Plan, cancel: &AtomicBool, tell: &dyn Fn(&str)) -> Prepared {
    let Some(mechanics) = case.mechanics.filter(|_| case.load.is_some()) else { return Prepared::StepByStep };
    let start = Instant::now();
    let count = plan.steps.len();
    let told = |mesh: usize, done: usize| tell(&format!("layer, mesh {}: {done} of {count} loads", mesh + 1));
    let run = match &mechanics {
        Mechanics::ClosedForm { shear_length: ShearLength::FiniteElement, .. } => {
            tell("shear length by finite elements");
            return Prepared::ClosedForm(shear_length::states(case, plan));
        }
        Mechanics::ClosedForm { .. } => return Prepared::StepByStep,
        Mechanics::PlaneStrain(model) => plane_strain::solve(case, model, plan, cancel, &told),
        Mechanics::Solid(model) => solid::solve(case, model, plan, cancel, &told),
    };
    let mut run = run.unwrap_or_else(|reason| FiniteElementRun::failed(&reason, plan));
    run.seconds = start.elapsed().as_secs_f64();
    Prepared::FiniteElement(run)
}

impl Prepared {
    /// The layer in one step; `None` if there is no layer or nothing deforms it.
    ///
    /// # Errors
    /// What the mechanics refuses or did not reach.
    pub fn deformation(
        &self,
        case: &Case,
        step: &PlannedStep,
        prune: bool,
    ) -> Result<Option<Deformation<'_>>, String> {
        match self {
            Self::StepByStep => layer_state(case, step.load, prune)
                .map(|state| state.map(Deformation::ClosedForm))
                .map_err(|error| error.to_string()),
            Self::FiniteElement(run) => match run.steps.get(step.index) {
                Some(Ok(step)) => Ok(Some(Deformation::FiniteElement(step))),
                Some(Err(error)) => Err(error.clone()),
                None => Err("the step has no equilibrium".to_owned()),
            },
            Self::ClosedForm(states) => match states.get(step.index) {
                Some(Ok(state)) => Ok(Some(Deformation::ClosedForm(*state))),
                Some(Err(error)) => Err(error.clone()),
                None => Err("the step has no closed form".to_owned()),
            },
        }
    }
}

/// Thickness, material and lengths of the case's closed-form layer; `None` also where a length is yet to be found.
pub(crate) fn closed_form(case: &Case) -> Option<(f64, MooneyRivlin, ClosedFormSettings)> {
    let layer = case.layer.as_ref()?;
    let material = layer.material.as_ref()?.as_mooney_rivlin()?;
    let Mechanics::ClosedForm { contact_half_length, contact_width, shear_length } = case.mechanics? else {
        return None;
    };
    let ShearLength::Given(shear_length) = shear_length else { return None };
    Some((layer.thickness, material, ClosedFormSettings { contact_half_length, contact_width, shear_length }))
}

/// How far eq. (50) can be used, where the case does.
pub(crate) fn closed_form_limit(case: &Case) -> Option<elastocap_mechanics::ForceLimit> {
    closed_form(case).and_then(|c| force_limit(c.0, c.1, c.2).ok())
}

/// The closed-form layer under a load; `None` if there is none or nothing deforms it.
///
/// # Errors
/// What the mechanics refuses: a force that the layer cannot carry, for instance.
pub(crate) fn layer_state(
    case: &Case,
    load: StepLoad,
    prune: bool,
) -> Result<Option<LayerState>, MechanicsError> {
    let Some((thickness, material, settings)) = closed_form(case) else { return Ok(None) };
    match load {
        StepLoad::None if prune => Ok(None),
        StepLoad::None => LayerState::new(thickness, material, 0.0, settings).map(Some),
        StepLoad::Compression(compression) => {
            LayerState::new(thickness, material, compression, settings).map(Some)
        }
        StepLoad::ForceN(force) => LayerState::under_force(thickness, material, force, settings).map(Some),
    }
}

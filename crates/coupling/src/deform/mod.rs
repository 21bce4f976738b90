//! The deformation of the layer under its loads, by the mechanics that the case names.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

mod curves;
mod electrode_box;
mod error;
mod finite_element;
pub(crate) mod foam;
mod force_check;
mod material;
mod places;
mod plane_strain;
mod rods;
pub(crate) mod shear_force;
pub(crate) mod shear_length;
mod skin;
mod solid;

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use elastocap_mechanics::solid::dimension::{Dimension, Plane, Space};
use elastocap_mechanics::solid::press::Pressing;
use elastocap_mechanics::solid::probe::Probe;
use elastocap_mechanics::{
    ClosedFormSettings, FoamState, ForceLimit, LayerState, MechanicsError, MooneyRivlin, force_limit,
};

pub use curves::{Curve, DeformedCurves, PIECES, off_segment, simplified};
pub use electrode_box::{ElectrodeBox, Ends};
pub use error::{DeformError, LayerSetupError, ShearLengthError};
pub use finite_element::{FiniteElementRun, FiniteElementStep, MeshReport, Solution};
pub use force_check::ForceCheck;
pub use plane_strain::forecast;
pub use shear_length::ShearLengthRun;
pub use skin::Skin;
pub use solid::forecast as forecast_solid;

pub(crate) use force_check::{ContactPunch, force_warning, uniaxial_force};
pub(crate) use material::Material;
pub(crate) use rods::Rods;
pub(crate) use shear_force::shear_warning;

use crate::load_steps::StepLoad;
use elastocap_case::{Case, Mechanics, ShearLength};

/// The layer at one load.
#[derive(Debug, Clone)]
pub enum Deformation<'a> {
    /// The closed form.
    ClosedForm(LayerState),
    /// An evenly compressed foam.
    Foam(FoamState),
    /// Finite elements.
    FiniteElement(&'a FiniteElementStep),
}

impl Deformation<'_> {
    /// The compression U/H.
    pub fn compression(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.compression(),
            Self::Foam(state) => state.compression(),
            Self::FiniteElement(step) => step.compression,
        }
    }

    /// The displacement U of the top, m.
    pub fn top_displacement(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.top_displacement(),
            Self::Foam(state) => state.top_displacement(),
            Self::FiniteElement(step) => step.top_displacement,
        }
    }

    /// The thickness under the indenter, m.
    pub fn deformed_thickness(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.deformed_thickness(),
            Self::Foam(state) => state.deformed_thickness(),
            Self::FiniteElement(step) => step.deformed_thickness,
        }
    }

    /// The compressive force, N.
    pub fn force(&self) -> f64 {
        match self {
            Self::ClosedForm(state) => state.force(),
            Self::Foam(state) => state.force(),
            Self::FiniteElement(step) => step.force,
        }
    }
}

/// The finite-element displacement of a layer, interpolated between nodes.
pub(crate) enum Displacement<'a> {
    /// Plane strain: the displacement along x3 is zero.
    Plane(Probe<'a, Plane>),
    /// Three dimensions: the solved quarter.
    Space(Probe<'a, Space>),
}

impl Displacement<'_> {
    /// The displacement of a point of the undeformed layer, both in m; `None` outside the solved part.
    pub(crate) fn at(&self, x: [f64; 3]) -> Option<[f64; 3]> {
        match self {
            Self::Plane(probe) => probe.displacement([x[0], x[1]]).map(|[u1, u2]| [u1, u2, 0.0]),
            Self::Space(probe) => probe.displacement(x),
        }
    }
}

/// The results that all steps need.
#[derive(Debug)]
pub enum Prepared {
    /// No results: each step is computed by a closed form, or nothing deforms.
    StepByStep,
    /// The finite-element solution of the layer at all loads.
    FiniteElement(FiniteElementRun),
    /// The closed form at each load, with a shear length from finite elements.
    ClosedForm(ShearLengthRun),
}

/// Checks that the finite elements of a case's layer can be set up, if it has any; nothing is meshed or
/// solved.
///
/// # Errors
/// The reason that they cannot be set up; then no step of the case has a result.
pub fn check_setup(case: &Case, loads: &[StepLoad]) -> Result<(), LayerSetupError> {
    if case.load.is_none() {
        return Ok(());
    }
    match &case.mechanics {
        None | Some(Mechanics::ClosedForm { .. }) => Ok(()),
        Some(Mechanics::PlaneStrain(model)) => plane_strain::check(case, model, loads),
        Some(Mechanics::Solid(model)) => solid::check(case, model, loads),
    }
}

/// Solves the layer at all `loads` together, if it has finite elements, with at most `memory_limit` bytes.
/// `report` is called with the current work.
pub fn prepare(
    case: &Case,
    loads: &[StepLoad],
    memory_limit: u64,
    cancel: &AtomicBool,
    report: &(dyn Fn(&str) + Sync),
) -> Prepared {
    prepare_with_drafts(case, loads, memory_limit, (cancel, report), &|_| ())
}

/// Solves like [`prepare`]. `drafted` is called with the solution so far of a layer in three dimensions
/// before each further mesh.
pub(crate) fn prepare_with_drafts(
    case: &Case,
    loads: &[StepLoad],
    memory_limit: u64,
    (cancel, report): (&AtomicBool, &(dyn Fn(&str) + Sync)),
    drafted: &dyn Fn(&Prepared),
) -> Prepared {
    let Some(mechanics) = case.mechanics.filter(|_| case.load.is_some()) else { return Prepared::StepByStep };
    let start = Instant::now();
    let count = loads.len();
    let report_mesh =
        |mesh: usize, done: usize| report(&format!("layer, mesh {}: {done} of {count} loads", mesh + 1));
    let run = match &mechanics {
        Mechanics::ClosedForm { .. } if foam::has_law(case) => return Prepared::StepByStep,
        Mechanics::ClosedForm { shear_length: ShearLength::FiniteElement, .. } => {
            report("shear length by finite elements");
            return Prepared::ClosedForm(shear_length::solve(case, loads, cancel));
        }
        Mechanics::ClosedForm { shear_length: ShearLength::Given(_), .. } => return Prepared::StepByStep,
        Mechanics::PlaneStrain(model) => plane_strain::solve(case, model, loads, cancel, &report_mesh),
        Mechanics::Solid(model) => {
            let drafted = |run: FiniteElementRun| drafted(&Prepared::FiniteElement(run));
            solid::solve(case, model, loads, memory_limit, (cancel, &report_mesh), &drafted)
        }
    };
    let mut run = run.unwrap_or_else(|reason| FiniteElementRun::failed(reason, count));
    run.seconds = start.elapsed().as_secs_f64();
    Prepared::FiniteElement(run)
}

impl Prepared {
    /// The displacement of a finite-element layer in the step of this `index` on this `mesh`; `None` for any
    /// other layer.
    pub(crate) fn displacement(&self, index: usize, mesh: usize) -> Option<Displacement<'_>> {
        fn probe<S: Dimension>(pressing: &Pressing<S>, index: usize, mesh: usize) -> Option<Probe<'_, S>> {
            let (model, state) = pressing.levels.get(mesh)?.state(index)?;
            Some(Probe::new(model.equations(), state))
        }
        let Self::FiniteElement(run) = self else { return None };
        match run.solution.as_ref()? {
            Solution::Plane(pressing) => probe(pressing, index, mesh).map(Displacement::Plane),
            Solution::Space(pressing) => probe(pressing, index, mesh).map(Displacement::Space),
        }
    }

    /// The layer in the step of this `index` on the coarser meshes that reached its load, coarse to fine;
    /// empty for a layer without finite elements.
    pub(crate) fn coarser(&self, index: usize) -> &[FiniteElementStep] {
        match self {
            Self::FiniteElement(run) => run.coarser.get(index).map_or(&[], Vec::as_slice),
            Self::StepByStep | Self::ClosedForm(_) => &[],
        }
    }

    /// The values of `read` for the displacement of a finite-element layer in the step of this `index`, on
    /// each mesh that reached its load, coarse to fine, with the element size of the mesh. Empty for any
    /// other layer.
    pub(crate) fn on_meshes<T>(&self, index: usize, read: &dyn Fn(&Displacement<'_>) -> T) -> Vec<(f64, T)> {
        let Self::FiniteElement(run) = self else { return Vec::new() };
        let Some(Ok(finest)) = run.steps.get(index) else { return Vec::new() };
        let on_mesh =
            |step: &FiniteElementStep| Some((step.element_size, read(&self.displacement(index, step.mesh)?)));
        self.coarser(index).iter().chain([finest]).filter_map(on_mesh).collect()
    }

    /// The maximum of the force of the closed form with a shear length from finite elements; `None` where the
    /// force rises at all loads.
    pub fn force_limit(&self) -> Option<ForceLimit> {
        match self {
            Self::ClosedForm(run) => run.force_limit,
            Self::StepByStep | Self::FiniteElement(_) => None,
        }
    }

    /// The layer in the step of this `index`, with the load for which it was prepared; `None` without a layer
    /// or deformation.
    ///
    /// # Errors
    /// The mechanics refuse the load, or did not reach it.
    pub fn deformation(
        &self,
        case: &Case,
        index: usize,
        load: StepLoad,
        prune: bool,
    ) -> Result<Option<Deformation<'_>>, DeformError> {
        match self {
            Self::StepByStep => Ok(layer_state(case, load, prune)?),
            Self::FiniteElement(run) => match run.steps.get(index) {
                Some(Ok(step)) => Ok(Some(Deformation::FiniteElement(step))),
                Some(Err(error)) => Err(error.clone()),
                None => Err(DeformError::NotSolved),
            },
            Self::ClosedForm(run) => match run.states.get(index) {
                Some(Ok(state)) => Ok(Some(Deformation::ClosedForm(*state))),
                Some(Err(error)) => Err(error.clone()),
                None => Err(DeformError::NotSolved),
            },
        }
    }
}

/// Thickness (m), material and lengths of the case's closed-form layer; `None` also where the shear length is
/// to be computed.
pub(crate) fn closed_form(case: &Case) -> Option<(f64, MooneyRivlin, ClosedFormSettings)> {
    let layer = case.layer.as_ref()?;
    let material = layer.material.as_ref()?.as_mooney_rivlin()?;
    let Mechanics::ClosedForm { contact_half_length, contact_width, shear_length } = case.mechanics? else {
        return None;
    };
    let ShearLength::Given(shear_length) = shear_length else { return None };
    Some((layer.thickness, material, ClosedFormSettings { contact_half_length, contact_width, shear_length }))
}

/// The limit of eq. (50). `None` where the case does not use it, or where the force never rises; then every
/// load is refused with the reason.
pub(crate) fn closed_form_limit(case: &Case) -> Option<ForceLimit> {
    let (thickness, material, settings) = closed_form(case)?;
    force_limit(thickness, material, settings).ok()
}

/// The closed-form layer, or the evenly compressed foam, under a load. `None` if the case has no such layer,
/// or without load if `prune` omits the layer.
///
/// # Errors
/// The mechanics refuse the load, for instance a force that the layer cannot carry.
pub(crate) fn layer_state(
    case: &Case,
    load: StepLoad,
    prune: bool,
) -> Result<Option<Deformation<'static>>, MechanicsError> {
    if load == StepLoad::None && prune {
        return Ok(None);
    }
    if let Some(foam) = foam::Foam::of(case) {
        return foam.state(load).map(|state| Some(Deformation::Foam(state)));
    }
    let Some((thickness, material, settings)) = closed_form(case) else { return Ok(None) };
    let state = match load {
        StepLoad::None => LayerState::new(thickness, material, 0.0, settings),
        StepLoad::Compression(compression) => LayerState::new(thickness, material, compression, settings),
        StepLoad::ForceN(force) => LayerState::under_force(thickness, material, force, settings),
    };
    state.map(|state| Some(Deformation::ClosedForm(state)))
}

//! The common part of finite-element layers in plane strain and in three dimensions: load steps from their
//! solutions.

use std::sync::Arc;

use elastocap_mechanics::materials::HyperelasticLaw;
use elastocap_mechanics::solid::dimension::{Dimension, Space};
use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::model::ModelError;
use elastocap_mechanics::solid::press::{Goal, Level, Pressed, Pressing};
use serde::Serialize;

use super::curves::DeformedCurves;
use super::electrode_box::ElectrodeBox;
use super::error::{DeformError, LayerSetupError};
use super::skin::Skin;
use crate::load_steps::StepLoad;
use elastocap_case::{Case, Electrodes, Layer, LayerEnd, Stiffness};

/// The layer at one load, by finite elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FiniteElementStep {
    /// U/H: displacement of the indenter over the thickness.
    #[serde(skip)]
    pub compression: f64,
    /// U, m.
    #[serde(skip)]
    pub top_displacement: f64,
    /// H - U, m.
    #[serde(skip)]
    pub deformed_thickness: f64,
    /// Compressive force on the whole layer, N.
    #[serde(skip)]
    pub force: f64,
    /// Relative discretisation error of the force, or of the compression where the force is given. `None`
    /// where fewer than three meshes reached the load.
    pub relative_error_estimate: Option<f64>,
    /// Whether that error is within the tolerance.
    pub converged: bool,
    /// Relative discretisation error of the distances in the layer on which capacitances depend, if it was
    /// estimated.
    #[serde(skip)]
    pub places_error: Option<f64>,
    /// The smallest relative error that is stated for these distances.
    #[serde(skip)]
    pub least_places_error: f64,
    /// The force in N (or the compression) on each mesh, coarse to fine.
    pub refinement: Vec<f64>,
    /// Index of the mesh of the step.
    pub mesh: usize,
    /// Smallest J of the quadrature points.
    pub smallest_j: f64,
    /// Largest unbalanced force over the largest force.
    pub residual: f64,
    /// Negative pivots of the tangent; above zero, the equilibrium is unstable.
    pub negative_pivots: usize,
    /// Largest penetration into indenter or substrate, m.
    pub penetration_m: f64,
    /// Contact force on the substrate beside the bonded bottom, N.
    pub end_contact_force_n: f64,
    /// Numbers of load steps, cut-backs and linear systems since the previous step.
    pub effort: [usize; 3],
    /// The electrodes: the right (or lower) one, and the upper one of a stacked pair.
    #[serde(skip)]
    pub electrodes: Vec<ElectrodeBox>,
    /// Element size of the mesh of the step, to be compared with those of the coarser meshes.
    #[serde(skip)]
    pub element_size: f64,
    /// The deformed outlines of the electrodes, and the layer's surface.
    #[serde(skip)]
    pub curves: DeformedCurves,
    /// Layer and electrodes for a viewer.
    #[serde(skip)]
    pub skin: Skin,
}

/// A mesh of the solution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeshReport {
    /// Number of quadrilaterals or hexahedra.
    pub elements: usize,
    /// Number of unknown displacements and pressures.
    pub unknowns: usize,
    /// Wall-clock seconds of all loads on this mesh.
    pub seconds: f64,
}

/// The solution of the layer at all loads.
#[derive(Debug)]
pub struct FiniteElementRun {
    /// The layer at each load, in order.
    pub steps: Vec<Result<FiniteElementStep, DeformError>>,
    /// Each load on the coarser meshes that reached it, coarse to fine, without skin and error estimates.
    pub coarser: Vec<Vec<FiniteElementStep>>,
    /// The meshes, coarse to fine.
    pub meshes: Vec<MeshReport>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The error of the mesh that exceeded the memory, if this ended the refinement.
    pub too_large: Option<ModelError>,
    /// The solution for the result files; `None` where the run failed as a whole.
    pub solution: Option<Solution>,
}

/// The equilibria on all meshes.
#[derive(Debug)]
pub enum Solution {
    /// In plane strain.
    Plane(Pressing),
    /// In three dimensions.
    Space(Pressing<Space>),
}

/// The factors that convert results of the mechanics to SI units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Thickness of the layer in m.
    pub(super) thickness: f64,
    /// Width in m if forces are per metre of width; 1 otherwise.
    pub(super) width: f64,
}

impl FiniteElementRun {
    /// A run in which none of `count` loads has an equilibrium, for this `reason`.
    pub(super) fn failed(reason: DeformError, count: usize) -> Self {
        Self {
            steps: vec![Err(reason); count],
            coarser: Vec::new(),
            meshes: Vec::new(),
            seconds: 0.0,
            too_large: None,
            solution: None,
        }
    }

    /// The results of `pressing` for each of `goals`. `bodies` gives the electrodes and the curves.
    pub(super) fn new<S: Dimension>(
        pressing: &Pressing<S>,
        goals: &[Goal],
        scale: Scale,
        bodies: impl Fn(&Pressed<S>) -> (Vec<ElectrodeBox>, DeformedCurves),
    ) -> Self {
        let step_of = |pressed: &Pressed<S>, goal: Goal| FiniteElementStep {
            element_size: pressing.size_of(pressed),
            ..step(pressed, goal, scale, bodies(pressed))
        };
        let steps = pressing.goals.iter().zip(goals).map(|(found, goal)| match found {
            Ok(pressed) => Ok(step_of(pressed, *goal)),
            Err(error) => Err(error.clone().into()),
        });
        let steps = steps.collect();
        let coarser = goals.iter().enumerate().map(|(g, goal)| {
            let coarser = pressing.on_coarser_meshes(g);
            coarser.iter().map(|(_, pressed)| step_of(pressed, *goal)).collect()
        });
        let coarser = coarser.collect();
        let report = |level: &Arc<Level<S>>| {
            let equations = level.model.equations();
            MeshReport {
                elements: equations.body().mesh.elements.len(),
                unknowns: equations.mixed_unknowns(),
                seconds: level.seconds,
            }
        };
        let meshes: Vec<MeshReport> = pressing.levels.iter().map(report).collect();
        Self { steps, coarser, meshes, seconds: 0.0, too_large: pressing.too_large.clone(), solution: None }
    }

    /// Sets the skin of every step whose load was reached, as given by `skin`.
    pub(super) fn clothe<S: Dimension>(
        &mut self,
        pressing: &Pressing<S>,
        skin: impl Fn(&Pressed<S>, &FiniteElementStep) -> Skin,
    ) {
        for (step, found) in self.steps.iter_mut().zip(&pressing.goals) {
            if let (Ok(step), Ok(pressed)) = (step, found) {
                step.skin = skin(pressed, step);
            }
        }
    }
}

fn step<S: Dimension>(
    pressed: &Pressed<S>,
    goal: Goal,
    scale: Scale,
    (electrodes, curves): (Vec<ElectrodeBox>, DeformedCurves),
) -> FiniteElementStep {
    let found = &pressed.step;
    let top_displacement = found.compression * scale.thickness;
    let by_force = matches!(goal, Goal::Force(_));
    let found_quantity = if by_force { found.compression } else { found.force };
    let unit = if by_force { 1.0 } else { scale.width };
    let relative = |error: f64| if error == 0.0 { 0.0 } else { error / found_quantity.abs() };
    FiniteElementStep {
        compression: found.compression,
        top_displacement,
        deformed_thickness: scale.thickness - top_displacement,
        force: found.force * scale.width,
        relative_error_estimate: pressed.error.map(relative),
        converged: pressed.converged,
        places_error: pressed.places_error,
        least_places_error: pressed.least_places_error,
        refinement: pressed.refinement.iter().map(|value| value * unit).collect(),
        mesh: pressed.level,
        smallest_j: found.effort.smallest_j,
        residual: found.effort.residual,
        negative_pivots: found.effort.negative_pivots,
        penetration_m: found.penetration,
        end_contact_force_n: found.end_contact_force * scale.width,
        effort: [found.effort.steps, found.effort.cuts, found.effort.solves],
        electrodes,
        element_size: 0.0,
        curves,
        skin: Skin::default(),
    }
}

/// The goal of the mechanics at each load. `width` is the width in m if the mechanics takes forces per metre
/// of width, and 1 otherwise.
pub(super) fn goals(loads: &[StepLoad], width: f64) -> Vec<Goal> {
    let goal = |load: &StepLoad| match *load {
        StepLoad::None => Goal::Compression(0.0),
        StepLoad::Compression(compression) => Goal::Compression(compression),
        StepLoad::ForceN(force) => Goal::Force(force / width),
    };
    loads.iter().map(goal).collect()
}

/// The layer of the case, its half-length in m and its material, or the missing item.
pub(super) fn layer(case: &Case) -> Result<(&Layer, f64, &HyperelasticLaw), LayerSetupError> {
    let missing = LayerSetupError::Missing;
    let layer = case.layer.as_ref().ok_or(missing("[layer]"))?;
    let half_length = layer.half_length.ok_or(missing("`half_length` in [layer]"))?;
    let material = layer.material.as_ref().ok_or(missing("material in [layer]"))?;
    Ok((layer, half_length, material))
}

/// Shear modulus of a rigid electrode over that of the layer: its strain is below 1e-5 at any reachable load.
const RIGID: f64 = 1e6;

/// Shear modulus of the electrodes, Pa.
pub(super) fn electrode_modulus(electrodes: &Electrodes, material: &HyperelasticLaw) -> f64 {
    match electrodes.stiffness {
        Stiffness::Rigid => RIGID * material.shear_modulus(),
        Stiffness::ShearModulus(modulus) => modulus,
    }
}

pub(super) fn end(layer_end: LayerEnd) -> End {
    match layer_end {
        LayerEnd::Free => End::Free,
        LayerEnd::FreeOnSubstrate => End::FreeOnSubstrate,
        LayerEnd::Far => End::Far,
    }
}

//! The layer of a case by finite elements in plane strain: the case becomes a problem, its solution becomes load steps.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use elastocap_mechanics::solid::layer::{End, Inclusion, Indenter as Press};
use elastocap_mechanics::solid::material::{Distortion, Rubber, Volume};
use elastocap_mechanics::solid::obstacle::Shape;
use elastocap_mechanics::solid::press::{Goal, LayerProblem, Pressed, Pressing, Refinement};
use serde::Serialize;

use super::electrode_box::{ElectrodeBox, Face};
use crate::case::{Case, Electrodes, Indenter, Layer, LayerEnd, Layout, Material, PlaneStrain, Stiffness};
use crate::plan::{Plan, StepLoad};

/// How much stiffer than the layer a rigid electrode is taken: its strain is then below 1e-5 at any load in reach.
const RIGID: f64 = 1e6;

/// The layer at one load, by finite elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneStep {
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
    /// Discretisation error of the force over the force; of the compression over the compression, where the force is
    /// given. `None` where less than three meshes reached the load.
    pub relative_error_estimate: Option<f64>,
    /// Whether that is within the tolerance asked for.
    pub converged: bool,
    /// The force in N (or the compression) on each mesh, coarse to fine.
    pub refinement: Vec<f64>,
    /// Number of the mesh that the step is from.
    pub mesh: usize,
    /// Smallest J of the quadrature points.
    pub smallest_j: f64,
    /// Largest unbalanced force over the largest force.
    pub residual: f64,
    /// Negative pivots of the tangent; above zero, the equilibrium is unstable.
    pub negative_pivots: usize,
    /// Deepest penetration into indenter or substrate, m.
    pub penetration_m: f64,
    /// Contact force beyond the bonded bottom, N.
    pub end_contact_force_n: f64,
    /// Load steps, cut-backs and linear systems that it took from the step before.
    pub effort: [usize; 3],
    /// The electrodes in what is solved: the right one of an in-plane pair, or left and right; lower and upper plate of a
    /// stacked pair, or their right halves.
    #[serde(skip)]
    pub electrodes: Vec<ElectrodeBox>,
}

/// One mesh that was solved on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeshReport {
    /// Quadrilaterals.
    pub elements: usize,
    /// Unknown displacements and pressures.
    pub unknowns: usize,
    /// Wall-clock seconds of all loads on it.
    pub seconds: f64,
}

/// The path of the layer through all loads.
#[derive(Debug)]
pub struct PlaneStrainRun {
    /// Step by step as planned; a step that another one is taken from has that one's result.
    pub steps: Vec<Result<PlaneStep, String>>,
    /// The meshes, coarse to fine.
    pub meshes: Vec<MeshReport>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The solution itself, for the files; `None` if there is no model.
    pub pressing: Option<Pressing>,
}

/// Elements and unknowns of the meshes that a run may need, coarse to fine.
pub fn forecast(case: &Case, model: &PlaneStrain) -> Vec<(usize, usize)> {
    let Ok(problem) = problem(case, model) else { return Vec::new() };
    let refinement = Refinement::to(model.relative_tolerance);
    (0..refinement.meshes)
        .map(|k| {
            let mesh = problem.mesh(k).mesh();
            (mesh.elements.len(), 2 * mesh.nodes.len() + 3 * mesh.elements.len())
        })
        .collect()
}

impl PlaneStrainRun {
    pub(super) fn new(
        case: &Case,
        model: &PlaneStrain,
        plan: &Plan,
        cancel: &AtomicBool,
        tell: &dyn Fn(&str),
    ) -> Self {
        let start = Instant::now();
        let failed = |reason: String| Self {
            steps: vec![Err(reason); plan.steps.len()],
            meshes: Vec::new(),
            seconds: start.elapsed().as_secs_f64(),
            pressing: None,
        };
        let problem = match problem(case, model) {
            Ok(problem) => problem,
            Err(reason) => return failed(reason),
        };
        let goals: Vec<Goal> = plan
            .steps
            .iter()
            .map(|step| match step.load {
                StepLoad::None => Goal::Compression(0.0),
                StepLoad::Compression(compression) => Goal::Compression(compression),
                StepLoad::ForceN(force) => Goal::Force(force / model.width),
            })
            .collect();
        let refinement = Refinement::to(model.relative_tolerance);
        let told = |mesh: usize, done: usize| {
            tell(&format!("layer, mesh {}: {done} of {} loads", mesh + 1, goals.len()));
        };
        let pressing = match problem.press(&goals, &refinement, cancel, &told) {
            Ok(pressing) => pressing,
            Err(error) => return failed(error.to_string()),
        };
        let steps = pressing
            .goals
            .iter()
            .zip(&goals)
            .map(|(found, goal)| match found {
                Ok(pressed) => Ok(step(&problem, model, &pressing, pressed, *goal)),
                Err(error) => Err(error.to_string()),
            })
            .collect();
        let meshes = pressing
            .levels
            .iter()
            .map(|level| {
                let equations = level.model.equations();
                MeshReport {
                    elements: equations.body().mesh.elements.len(),
                    unknowns: equations.mixed_unknowns(),
                    seconds: level.seconds,
                }
            })
            .collect();
        Self { steps, meshes, seconds: start.elapsed().as_secs_f64(), pressing: Some(pressing) }
    }
}

fn step(
    problem: &LayerProblem,
    model: &PlaneStrain,
    pressing: &Pressing,
    pressed: &Pressed,
    goal: Goal,
) -> PlaneStep {
    let found = &pressed.step;
    let top_displacement = found.compression * problem.thickness;
    let by_force = matches!(goal, Goal::Force(_));
    let known = if by_force { found.compression } else { found.force };
    let scale = if by_force { 1.0 } else { model.width };
    let relative = |error: f64| if error == 0.0 { 0.0 } else { error / known.abs() };
    PlaneStep {
        compression: found.compression,
        top_displacement,
        deformed_thickness: problem.thickness - top_displacement,
        force: found.force * model.width,
        relative_error_estimate: pressed.error.map(relative),
        converged: pressed.converged,
        refinement: pressed.refinement.iter().map(|value| value * scale).collect(),
        mesh: pressed.level,
        smallest_j: found.effort.smallest_j,
        residual: found.effort.residual,
        negative_pivots: found.effort.negative_pivots,
        penetration_m: found.penetration,
        end_contact_force_n: found.end_contact_force * model.width,
        effort: [found.effort.steps, found.effort.cuts, found.effort.solves],
        electrodes: problem.inclusions.iter().map(|i| outline(i, pressing, pressed)).collect(),
    }
}

/// The deformed outline of an inclusion as a box.
fn outline(inclusion: &Inclusion, pressing: &Pressing, pressed: &Pressed) -> ElectrodeBox {
    let mesh = &pressing.levels[pressed.level].model.equations().body().mesh;
    let tiny = 1e-9 * (inclusion.max[0] - inclusion.min[0]);
    let face = |across: usize, at: f64| -> Face {
        let along = 1 - across;
        let mut points: Vec<(f64, [f64; 2])> = mesh
            .nodes
            .iter()
            .enumerate()
            .filter(|(_, x)| {
                (x[across] - at).abs() < tiny
                    && x[along] > inclusion.min[along] - tiny
                    && x[along] < inclusion.max[along] + tiny
            })
            .map(|(n, x)| {
                let u = &pressed.state.displacement[2 * n..2 * n + 2];
                (x[along], [x[0] + u[0], x[1] + u[1]])
            })
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Weights of the trapezoidal rule over the reference length.
        let place: Vec<f64> = points.iter().map(|p| p.0).collect();
        let (first, last) = (place[0], place[place.len() - 1]);
        for (k, point) in points.iter_mut().enumerate() {
            let before = place[k.saturating_sub(1)];
            let after = place[(k + 1).min(place.len() - 1)];
            point.0 = 0.5 * (after - before) / (last - first);
        }
        points
    };
    ElectrodeBox::new(&[
        face(0, inclusion.min[0]),
        face(0, inclusion.max[0]),
        face(1, inclusion.min[1]),
        face(1, inclusion.max[1]),
    ])
}

/// The layer of the case; the reason if its finite elements cannot be set up.
fn problem(case: &Case, model: &PlaneStrain) -> Result<LayerProblem, String> {
    let lacks = |what: &str| format!("the case has no {what}");
    let layer = case.layer.as_ref().ok_or_else(|| lacks("[layer]"))?;
    let half_length = layer.half_length.ok_or_else(|| lacks("`half_length` in [layer]"))?;
    let material = layer.material.as_ref().ok_or_else(|| lacks("material in [layer]"))?;
    let (indenter, position) = match model.indenter {
        Indenter::WholeTop => (Press::WholeTop, 0.0),
        Indenter::FlatPunch { half_width, corner_radius, bonded, position } => {
            let punch = match (corner_radius > 0.0, bonded) {
                (false, false) => Press::Sharp { half_width },
                (false, true) => Press::Bonded { half_width },
                (true, false) => Press::Smooth(Shape::Punch { half_width, corner_radius }),
                (true, true) => {
                    return Err(
                        "a punch with rounded corners that the layer sticks to is not supported".to_owned()
                    );
                }
            };
            (punch, position)
        }
        Indenter::Cylinder { radius, position } => (Press::Smooth(Shape::Cylinder { radius }), position),
    };
    let end = match model.end {
        LayerEnd::Free => End::Free,
        LayerEnd::FreeOnSubstrate => End::FreeOnSubstrate,
        LayerEnd::Far => End::Far,
    };
    let inclusions = match &case.electrodes {
        Some(electrodes) => inclusions(electrodes, layer, half_length, material, position != 0.0)?,
        None => Vec::new(),
    };
    Ok(LayerProblem {
        thickness: layer.thickness,
        half_length,
        rubber: rubber(material, layer.bulk_modulus),
        inclusions,
        indenter,
        position,
        end,
    })
}

fn rubber(material: &Material, bulk_modulus: Option<f64>) -> Rubber {
    let distortion = match material {
        Material::MooneyRivlin { c10, c01 } => Distortion::MooneyRivlin { c10: *c10, c01: *c01 },
        Material::NeoHookean { shear_modulus } => Distortion::NeoHookean { shear_modulus: *shear_modulus },
        Material::Yeoh { constants } => Distortion::Yeoh { constants: *constants },
        Material::Ogden { terms } => Distortion::Ogden { terms: terms.clone() },
    };
    match bulk_modulus {
        Some(kappa) => Rubber { distortion, volume: Volume::BulkModulus(kappa), volume_barrier: 0.0 },
        None => Rubber { distortion, volume: Volume::Incompressible, volume_barrier: Rubber::USUAL_BARRIER },
    }
}

/// The electrodes in the right half of the layer, or in the `whole` of it: what is solved.
fn inclusions(
    electrodes: &Electrodes,
    layer: &Layer,
    half_length: f64,
    material: &Material,
    whole: bool,
) -> Result<Vec<Inclusion>, String> {
    let modulus = match electrodes.stiffness {
        Stiffness::Rigid => RIGID * material.shear_modulus(),
        Stiffness::ShearModulus(modulus) => modulus,
    };
    let regions = electrodes.regions();
    let solved = match electrodes.layout {
        Layout::InPlane if !whole => &regions[1..],
        Layout::InPlane | Layout::Stacked => &regions[..],
    };
    let axis = if whole { f64::NEG_INFINITY } else { 0.0 };
    solved
        .iter()
        .map(|region| {
            let inclusion = Inclusion {
                min: [region.min[0].max(axis), region.min[1]],
                max: [region.max[0], region.max[1]],
                rubber: Rubber::neo_hookean(modulus),
            };
            if inclusion.max[0] > half_length - layer.thickness {
                return Err(
                    "the electrodes reach into the last thickness of the layer before its end; make \
                            `half_length` in [layer] larger"
                        .to_owned(),
                );
            }
            Ok(inclusion)
        })
        .collect()
}

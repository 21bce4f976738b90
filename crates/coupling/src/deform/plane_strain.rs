//! The layer of a case by finite elements in plane strain: the case becomes a problem.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::solid::layer::{Inclusion, Indenter as Press};
use elastocap_mechanics::solid::material::Rubber;
use elastocap_mechanics::solid::obstacle::Shape;
use elastocap_mechanics::solid::press::{LayerProblem, Pressed, Pressing, Refinement};

use super::electrode_box::{ElectrodeBox, Face};
use super::finite_element::{FiniteElementRun, Scale, Solution, end, goals, rubber};
use crate::case::{Case, Electrodes, Indenter, Layer, Layout, Material, PlaneStrain, Stiffness};
use crate::plan::Plan;

/// How much stiffer than the layer a rigid electrode is taken: its strain is then below 1e-5 at any load in reach.
const RIGID: f64 = 1e6;

/// Elements and unknowns of the meshes that a run may need, coarse to fine.
pub fn forecast(case: &Case, model: &PlaneStrain) -> Vec<(usize, usize)> {
    let Ok(problem) = problem(case, model) else { return Vec::new() };
    let refinement = Refinement::to(model.relative_tolerance);
    let count = |&n: &usize| {
        let mesh = problem.mesh(n).mesh();
        (mesh.elements.len(), 2 * mesh.nodes.len() + 3 * mesh.elements.len())
    };
    refinement.meshes.iter().map(count).collect()
}

/// The path of the layer through the loads of `plan`; the reason if there is no model.
pub(super) fn solve(
    case: &Case,
    model: &PlaneStrain,
    plan: &Plan,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<FiniteElementRun, String> {
    let problem = problem(case, model)?;
    let goals = goals(plan, model.width);
    let refinement = Refinement::to(model.relative_tolerance);
    let pressing = problem.press(&goals, &refinement, cancel, tell).map_err(|error| error.to_string())?;
    let scale = Scale { thickness: problem.thickness, width: model.width };
    let electrodes = |pressed: &Pressed| {
        problem.inclusions.iter().map(|i| outline(i, &pressing, pressed)).collect::<Vec<_>>()
    };
    let mut run = FiniteElementRun::new(&pressing, &goals, scale, electrodes);
    run.solution = Some(Solution::Plane(pressing));
    Ok(run)
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
    let (layer, half_length, material) = super::finite_element::layer(case)?;
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
        end: end(model.end),
    })
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

//! The finite elements of a layer in plane strain: builds the problem from the case, and solves it.

use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::dimension::Plane;
use elastocap_mechanics::solid::forecast::{MeshSize, PressingRegime};
use elastocap_mechanics::solid::layer::{Inclusion, Indenter as Press, LayerModel};
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::plane::press::{PlaneLayer, sharp_punch};
use elastocap_mechanics::solid::press::{Places, Pressed, Pressing, Refinement, deepest};

use super::curves::{DeformedCurves, range, through};
use super::electrode_box::ElectrodeBox;
use super::error::{DeformError, LayerSetupError};
use super::finite_element::{FiniteElementRun, Scale, Solution, electrode_modulus, end, goals};
use super::places::LayerPlaces;
use super::skin;
use crate::load_steps::StepLoad;
use elastocap_case::{Case, Electrodes, Indenter, Layout, PlaneStrain, PunchContact};

/// Checks that the layer can be set up.
///
/// # Errors
/// The finite elements cannot be set up.
pub(super) fn check(case: &Case, model: &PlaneStrain, loads: &[StepLoad]) -> Result<(), LayerSetupError> {
    let (problem, goals) = (problem(case, model)?, goals(loads, model.width));
    problem.mesh_sizes(deepest(&goals)).map_err(LayerSetupError::too_large)?;
    Ok(())
}

/// The sizes of the meshes that a run may need, coarse to fine, and the regime of their linear systems.
///
/// # Errors
/// The finite elements cannot be set up.
pub fn forecast(
    case: &Case,
    model: &PlaneStrain,
    loads: &[StepLoad],
) -> Result<(Vec<MeshSize>, PressingRegime), LayerSetupError> {
    let problem = problem(case, model)?;
    let deepest = deepest(&goals(loads, model.width));
    let meshes = problem.mesh_sizes(deepest).map_err(LayerSetupError::too_large)?;
    Ok((meshes, problem.regime()))
}

/// The solution of the layer at the loads.
///
/// # Errors
/// The layer cannot be set up or meshed. A load that is not reached has its error in the result instead.
pub(super) fn solve(
    case: &Case,
    model: &PlaneStrain,
    loads: &[StepLoad],
    cancel: &AtomicBool,
    report: &(dyn Fn(usize, usize) + Sync),
) -> Result<FiniteElementRun, DeformError> {
    let problem = problem(case, model)?;
    let goals = goals(loads, model.width);
    let refinement = Refinement::to(model.relative_tolerance);
    let layer_places =
        LayerPlaces::new(case, problem.thickness, &problem.inclusions, problem.position == 0.0);
    let (means, numbers) =
        (|model: &LayerModel| layer_places.means(model), |means: &[f64]| layer_places.numbers(means));
    let tolerances = |numbers: &[f64]| layer_places.tolerances(numbers);
    let places = case.electrostatics.as_ref();
    let places = places.map(|_| Places { means: &means, of: &numbers, tolerances: &tolerances });
    let pressing = problem.press(&goals, &refinement, places.as_ref(), cancel, report)?;
    let scale = Scale { thickness: problem.thickness, width: model.width };
    let width = case.electrodes.as_ref().map_or(0.0, |e| e.width);
    let bodies = |pressed: &Pressed| bodies(&problem, &layer_places, &pressing, pressed);
    let mut run = FiniteElementRun::new(&pressing, &goals, scale, bodies);
    let is_side_by_side = case.electrodes.as_ref().is_some_and(|e| e.layout == Layout::InPlane);
    // Once a run is stopped no field is solved any more, and no step of it is drawn.
    if !(cancel.load(Ordering::Relaxed) && case.electrostatics.is_some()) {
        run.clothe(&pressing, |pressed, step| {
            let body = pressing.model_of(pressed).equations().body();
            skin::of_plane(body, &pressed.state, &step.curves, is_side_by_side, [model.width, width])
        });
    }
    run.solution = Some(Solution::Plane(pressing));
    Ok(run)
}

/// The electrodes as boxes, and the curves of the deformed electrodes and surface.
fn bodies(
    problem: &PlaneLayer,
    places: &LayerPlaces<'_, Plane>,
    pressing: &Pressing,
    pressed: &Pressed,
) -> (Vec<ElectrodeBox>, DeformedCurves) {
    let body = pressing.model_of(pressed).equations().body();
    let mesh = &body.mesh;
    let tiny = 1e-9 * problem.thickness;
    // Reference coordinates and deformed positions of the nodes on a line, ascending.
    let line = |across: usize, at: f64, [from, to]: [f64; 2]| -> Vec<(f64, [f64; 2])> {
        let along = 1 - across;
        let on =
            |x: &[f64; 2]| (x[across] - at).abs() < tiny && x[along] > from - tiny && x[along] < to + tiny;
        let mut points: Vec<_> = mesh
            .nodes
            .iter()
            .enumerate()
            .filter(|(_, x)| on(x))
            .map(|(n, x)| {
                let u = &pressed.state.displacement[2 * n..2 * n + 2];
                (x[along], [x[0] + u[0], x[1] + u[1]])
            })
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let curve = |line: &[(f64, [f64; 2])]| through(&line.iter().map(|p| p.1).collect::<Vec<_>>());
    let mut electrodes = Vec::new();
    for Inclusion { min, max, .. } in &problem.inclusions {
        let side = |across: usize, at: f64| line(across, at, [min[1 - across], max[1 - across]]);
        let [left, right, lower, upper] =
            [side(0, min[0]), side(0, max[0]), side(1, min[1]), side(1, max[1])];
        let back = |side: &[_]| curve(side).into_iter().rev().collect();
        electrodes.push([curve(&lower), curve(&right), back(&upper), back(&left)]);
    }
    let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
    let surface = curve(&line(1, problem.thickness, everywhere));
    let half = mesh.nodes.iter().all(|x| x[0] > -tiny);
    let heights = range(surface.iter().map(|p| p[1]));
    let boxes = places.boxes(body, &pressed.state);
    (boxes, DeformedCurves { electrodes, surface, half, heights })
}

/// The problem of the case's layer, or the reason that it cannot be set up.
fn problem(case: &Case, model: &PlaneStrain) -> Result<PlaneLayer, LayerSetupError> {
    let (layer, half_length, material) = super::finite_element::layer(case)?;
    LayerSetupError::check_length(half_length, layer.thickness)?;
    let (indenter, position) = match model.indenter {
        Indenter::WholeTop => (Press::WholeTop, 0.0),
        Indenter::FlatPunch { half_width, contact, position } => {
            let punch = match contact {
                PunchContact::Held => Press::Held { half_width },
                PunchContact::Bonded => Press::Bonded { half_width },
                PunchContact::Smooth { corner_radius: None } => sharp_punch(half_width, layer.thickness),
                PunchContact::Smooth { corner_radius: Some(corner_radius) } => {
                    Press::Smooth(IndenterProfile::Punch { half_width, corner_radius })
                }
            };
            (punch, position)
        }
        Indenter::Cylinder { radius, position } => {
            (Press::Smooth(IndenterProfile::Cylinder { radius }), position)
        }
        Indenter::Block { .. } | Indenter::Sphere { .. } => {
            return Err(LayerSetupError::Missing("indenter all along x3"));
        }
    };
    let inclusions = match &case.electrodes {
        Some(electrodes) => inclusions(electrodes, material, position != 0.0),
        None => Vec::new(),
    };
    let problem = PlaneLayer {
        thickness: layer.thickness,
        half_length,
        rubber: Rubber::of_law(material.clone(), layer.bulk_modulus),
        inclusions,
        indenter,
        position,
        end: end(model.end),
    };
    problem.check_room().map_err(|error| LayerSetupError::NoRoom(Box::new(error)))?;
    if problem.inclusions.iter().any(|i| i.max[0] > problem.room()) {
        return Err(LayerSetupError::ElectrodesNearEnd);
    }
    Ok(problem)
}

/// The electrodes in the solved part of the layer: its right half, or the `whole` layer.
fn inclusions(electrodes: &Electrodes, material: &HyperelasticLaw, whole: bool) -> Vec<Inclusion> {
    let modulus = electrode_modulus(electrodes, material);
    let regions = electrodes.regions();
    let solved = match electrodes.layout {
        Layout::InPlane if !whole => &regions[1..],
        Layout::InPlane | Layout::Stacked => &regions[..],
    };
    let left_end = if whole { f64::NEG_INFINITY } else { 0.0 };
    solved
        .iter()
        .map(|region| Inclusion {
            min: [region.min[0].max(left_end), region.min[1]],
            max: [region.max[0], region.max[1]],
            rubber: Rubber::neo_hookean(modulus),
        })
        .collect()
}

//! The finite elements of a layer in three dimensions: builds the problem from the case, and solves it.

use std::sync::atomic::AtomicBool;

use elastocap_geometry::scene::Box3;
use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::forecast::MeshSize;
use elastocap_mechanics::solid::layer::{Inclusion, Indenter as Press, LayerModel};
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::press::{Places, Pressed, Pressing, Refinement, deepest};
use elastocap_mechanics::solid::space::layer::SideCondition;
use elastocap_mechanics::solid::space::press::SpaceLayer;

use super::curves::{DeformedCurves, range};
use super::error::{DeformError, LayerSetupError};
use super::finite_element::{FiniteElementRun, Scale, Solution, electrode_modulus, end, goals, layer};
use super::places::LayerPlaces;
use super::skin;
use crate::load_steps::StepLoad;
use elastocap_case::{Case, Electrodes, Indenter, LayerSide, Layout, PunchContact, Solid};

/// Checks that the layer can be set up.
///
/// # Errors
/// The finite elements cannot be set up.
pub(super) fn check(case: &Case, model: &Solid, loads: &[StepLoad]) -> Result<(), LayerSetupError> {
    let problem = problem(case, model)?;
    let coarsest = problem.coarsest();
    problem.mesh_within_limit(coarsest, deepest(&goals(loads, 1.0))).map_err(LayerSetupError::too_large)?;
    Ok(())
}

/// The sizes of the meshes that a run may need, coarse to fine: exact for the first mesh, approximate for the
/// finer ones.
///
/// # Errors
/// The finite elements cannot be set up.
pub fn forecast(case: &Case, model: &Solid, loads: &[StepLoad]) -> Result<Vec<MeshSize>, LayerSetupError> {
    let problem = problem(case, model)?;
    problem.mesh_sizes(deepest(&goals(loads, 1.0))).map_err(LayerSetupError::too_large)
}

/// The solution of the layer at the loads, with at most `memory_limit` bytes. `drafted` is called with the
/// solution so far before each further mesh.
///
/// # Errors
/// The layer cannot be set up or meshed. A load that is not reached has its error in the result instead.
pub(super) fn solve(
    case: &Case,
    model: &Solid,
    loads: &[StepLoad],
    memory_limit: u64,
    (cancel, report): (&AtomicBool, &(dyn Fn(usize, usize) + Sync)),
    drafted: &dyn Fn(FiniteElementRun),
) -> Result<FiniteElementRun, DeformError> {
    let problem = problem(case, model)?;
    let goals = goals(loads, 1.0);
    let refinement = Refinement::in_space(model.relative_tolerance);
    let layer_places = LayerPlaces::new(case, problem.thickness, &problem.inclusions, true);
    let (means, numbers) =
        (|model: &LayerModel<Space>| layer_places.means(model), |means: &[f64]| layer_places.numbers(means));
    let tolerances = |numbers: &[f64]| layer_places.tolerances(numbers);
    let places = case.electrostatics.as_ref();
    let places = places.map(|_| Places { means: &means, of: &numbers, tolerances: &tolerances });
    let scale = Scale { thickness: problem.thickness, width: 1.0 };
    let run = |pressing: Pressing<Space>| {
        let boxes = |pressed: &Pressed<Space>| {
            let body = pressing.model_of(pressed).equations().body();
            let mesh = &body.mesh;
            let on_top = |n: &usize| problem.thickness - mesh.nodes[*n][1] < 1e-9 * problem.thickness;
            let top = (0..mesh.nodes.len()).filter(on_top);
            let heights = range(top.map(|n| mesh.nodes[n][1] + pressed.state.displacement[3 * n + 1]));
            (
                layer_places.boxes(body, &pressed.state),
                DeformedCurves { heights, ..DeformedCurves::default() },
            )
        };
        let mut run = FiniteElementRun::new(&pressing, &goals, scale, boxes);
        let pair = case.electrodes.as_ref().is_some_and(|e| e.layout == Layout::InPlane);
        run.clothe(&pressing, |pressed, _| {
            let body = pressing.model_of(pressed).equations().body();
            skin::of_space(body, &pressed.state, problem.inclusions.len(), pair)
        });
        run.solution = Some(Solution::Space(pressing));
        run
    };
    let draft = |pressing: Pressing<Space>| drafted(run(pressing));
    let watched = (cancel, report);
    let pressing =
        problem.press_with_drafts(&goals, &refinement, places.as_ref(), memory_limit, watched, &draft)?;
    Ok(run(pressing))
}

/// The electrodes in the solved quarter.
fn inclusions(electrodes: &Electrodes, material: &HyperelasticLaw) -> Vec<Inclusion<Space>> {
    let rubber = Rubber::neo_hookean(electrode_modulus(electrodes, material));
    let regions = electrodes.regions();
    let solved = match electrodes.layout {
        Layout::InPlane => &regions[1..],
        Layout::Stacked => &regions[..],
    };
    let inclusion = |region: &Box3| Inclusion {
        min: [region.min[0].max(0.0), region.min[1], 0.0],
        max: region.max,
        rubber: rubber.clone(),
    };
    solved.iter().map(inclusion).collect()
}

/// The problem of the case's layer, or the reason that it cannot be set up.
fn problem(case: &Case, model: &Solid) -> Result<SpaceLayer, LayerSetupError> {
    let (layer, half_length, material) = layer(case)?;
    LayerSetupError::check_length(half_length.max(0.5 * model.width), layer.thickness)?;
    let indenter = match model.indenter {
        Indenter::WholeTop => Press::WholeTop,
        Indenter::FlatPunch { half_width, contact, .. } => match contact {
            PunchContact::Bonded => Press::Bonded { half_width },
            PunchContact::Held => Press::Held { half_width },
            PunchContact::Smooth { corner_radius } => {
                let corner_radius =
                    corner_radius.ok_or(LayerSetupError::Missing("rounded corners of its punch"))?;
                Press::Smooth(IndenterProfile::Punch { half_width, corner_radius })
            }
        },
        Indenter::Block { half_widths, corner_radius } => {
            Press::Smooth(IndenterProfile::Block { half_widths, corner_radius })
        }
        Indenter::Cylinder { radius, .. } => Press::Smooth(IndenterProfile::Cylinder { radius }),
        Indenter::Sphere { radius } => Press::Smooth(IndenterProfile::Sphere { radius }),
    };
    let problem = SpaceLayer {
        thickness: layer.thickness,
        half_length,
        half_width: 0.5 * model.width,
        rubber: Rubber::of_law(material.clone(), layer.bulk_modulus),
        inclusions: case.electrodes.as_ref().map_or_else(Vec::new, |e| inclusions(e, material)),
        indenter,
        end: end(model.end),
        side: match model.side {
            LayerSide::Free => SideCondition::Free,
            LayerSide::Symmetric => SideCondition::Symmetric,
        },
    };
    let [length, width] = problem.room();
    for (room, axis, key) in
        [(length, 0, "`half_length` in [layer]"), (width, 2, "`width` in [mechanics.solid]")]
    {
        if problem.inclusions.iter().any(|i| i.max[axis] > room) {
            let reach = problem.inclusions.iter().map(|i| i.max[axis]).fold(0.0, f64::max);
            return Err(LayerSetupError::ElectrodesNearEdge { reach, room, axis, key });
        }
    }
    Ok(problem)
}

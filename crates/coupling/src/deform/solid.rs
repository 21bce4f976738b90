//! The layer of a case by finite elements in three dimensions: the case becomes a problem.

use std::sync::atomic::AtomicBool;

use elastocap_geometry::scene::Box3;
use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::layer::{Inclusion, Indenter as Press, LayerModel};
use elastocap_mechanics::solid::mesh::Mesh;
use elastocap_mechanics::solid::model::State;
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::press::{Places, Pressed, Refinement, deepest};
use elastocap_mechanics::solid::probe::Probe;
use elastocap_mechanics::solid::space::layer::SideCondition;
use elastocap_mechanics::solid::space::press::SpaceLayer;

use super::Displacement;
use super::curves::{DeformedCurves, range};
use super::electrode_box::{ElectrodeBox, Face};
use super::error::{DeformError, LayerSetupError};
use super::finite_element::{FiniteElementRun, Scale, Solution, electrode_modulus, end, goals, layer};
use super::rods::Rods;
use super::skin;
use crate::load_steps::StepLoad;
use elastocap_case::{Case, Electrodes, LayerSide, Layout, PunchContact, Solid, SolidIndenter};

/// Whether the layer can be set up.
///
/// # Errors
/// Why not.
pub(super) fn check(case: &Case, model: &Solid, loads: &[StepLoad]) -> Result<(), LayerSetupError> {
    let problem = problem(case, model)?;
    let refinement = Refinement::in_space(model.relative_tolerance, problem.indenter);
    let coarsest = refinement.meshes.first().copied().unwrap_or(1);
    problem.mesh_within_limit(coarsest, deepest(&goals(loads, 1.0))).map_err(LayerSetupError::too_large)?;
    Ok(())
}

/// The meshes that a run may need, coarse to fine: how many hexahedra and unknowns each has, and the size of its smallest
/// hexahedra at the surface in m.
///
/// # Errors
/// Why the finite elements cannot be set up.
pub fn forecast(
    case: &Case,
    model: &Solid,
    loads: &[StepLoad],
) -> Result<Vec<(usize, usize, f64)>, LayerSetupError> {
    let problem = problem(case, model)?;
    let refinement = Refinement::in_space(model.relative_tolerance, problem.indenter);
    let deepest = deepest(&goals(loads, 1.0));
    // The first mesh with too many elements ends the refinement.
    let count = |&n: &usize| {
        let mesh = problem.mesh_within_limit(n, deepest).ok()?.mesh();
        Some((mesh.elements.len(), 3 * mesh.nodes.len() + 4 * mesh.elements.len(), problem.finest(n)))
    };
    Ok(refinement.meshes.iter().map_while(count).collect())
}

/// The path of the layer through the loads, within a memory of `memory_limit` bytes.
///
/// # Errors
/// A layer that cannot be set up or meshed. A load that is not reached has its error in the result instead.
pub(super) fn solve(
    case: &Case,
    model: &Solid,
    loads: &[StepLoad],
    memory_limit: u64,
    cancel: &AtomicBool,
    report: &(dyn Fn(usize, usize) + Sync),
) -> Result<FiniteElementRun, DeformError> {
    let problem = problem(case, model)?;
    let goals = goals(loads, 1.0);
    let refinement = Refinement::in_space(model.relative_tolerance, problem.indenter);
    let layout = case.electrodes.as_ref().map(|e| e.layout);
    let rods = Rods::of(case);
    let places = |model: &LayerModel<Space>, state: &State<Space>| {
        let mut all = facing(layout, &boxes(&problem, &model.equations().body().mesh, state));
        if !rods.is_empty() {
            let displacement = Displacement::Space(Probe::new(model.equations(), state));
            all.extend(rods.lengths_under(case, true, &displacement));
        }
        all
    };
    let together = |errors: &[f64]| {
        let (of_pair, of_rods) = errors.split_at(errors.len().saturating_sub(rods.count()));
        of_pair.iter().copied().fold(rods.error(of_rods.iter().copied()), f64::max)
    };
    let places = case.electrostatics.as_ref().map(|field| Places {
        of: &places,
        relative_tolerance: field.relative_tolerance,
        together: &together,
    });
    let pressing = problem.press(&goals, &refinement, places.as_ref(), memory_limit, cancel, report)?;
    let scale = Scale { thickness: problem.thickness, width: 1.0 };
    let boxes = |pressed: &Pressed<Space>| {
        let mesh = &pressing.model_of(pressed).equations().body().mesh;
        let on_top = |n: &usize| problem.thickness - mesh.nodes[*n][1] < 1e-9 * problem.thickness;
        let top = (0..mesh.nodes.len()).filter(on_top);
        let heights = range(top.map(|n| mesh.nodes[n][1] + pressed.state.displacement[3 * n + 1]));
        (boxes(&problem, mesh, &pressed.state), DeformedCurves { heights, ..DeformedCurves::default() })
    };
    let mut run = FiniteElementRun::new(&pressing, &goals, scale, boxes);
    let pair = case.electrodes.as_ref().is_some_and(|e| e.layout == Layout::InPlane);
    run.clothe(&pressing, |pressed, _| {
        let body = pressing.model_of(pressed).equations().body();
        skin::of_space(body, &pressed.state, problem.inclusions.len(), pair)
    });
    run.solution = Some(Solution::Space(pressing));
    Ok(run)
}

/// The gap of a pair in m, and the area over the gap, in m, that its parallel-plate capacitance is proportional to; nothing without a pair.
fn facing(layout: Option<Layout>, electrodes: &[ElectrodeBox]) -> Vec<f64> {
    let extent = |e: &ElectrodeBox, axis: usize| e.mean[axis][1] - e.mean[axis][0];
    let (gap, along, across) = match (layout, electrodes) {
        (Some(Layout::InPlane), [right]) => (2.0 * right.mean[0][0], extent(right, 1), extent(right, 2)),
        (Some(Layout::Stacked), [lower, upper]) => {
            let least = |axis: usize| extent(lower, axis).min(extent(upper, axis));
            (upper.mean[1][0] - lower.mean[1][1], least(0), least(2))
        }
        _ => return Vec::new(),
    };
    vec![gap, along * across / gap]
}

/// The electrodes as boxes.
fn boxes(problem: &SpaceLayer, mesh: &Mesh<Space>, state: &State<Space>) -> Vec<ElectrodeBox> {
    let tiny = 1e-9 * problem.thickness;
    let face = |inclusion: &Inclusion<Space>, axis: usize, at: f64| -> Face {
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let within =
            |x: &[f64; 3], k: usize| x[k] > inclusion.min[k] - tiny && x[k] < inclusion.max[k] + tiny;
        let on = |x: &[f64; 3]| (x[axis] - at).abs() < tiny && others.iter().all(|&k| within(x, k));
        let nodes: Vec<usize> = (0..mesh.nodes.len()).filter(|&n| on(&mesh.nodes[n])).collect();
        // The nodes are a grid: parts of the reference area by the trapezoidal rule along either axis.
        let weights = others.map(|k| Trapezoid::new(nodes.iter().map(|&n| mesh.nodes[n][k]), tiny));
        nodes
            .iter()
            .map(|&n| {
                let x = mesh.nodes[n];
                let u = &state.displacement[3 * n..];
                let weight = weights[0].at(x[others[0]]) * weights[1].at(x[others[1]]);
                (weight, [0, 1, 2].map(|k| x[k] + u[k]))
            })
            .collect()
    };
    let of = |inclusion: &Inclusion<Space>| {
        let ends = |a: usize| [inclusion.min[a], inclusion.max[a]].map(|at| face(inclusion, a, at));
        ElectrodeBox::new(&[0, 1, 2].map(ends)).across()
    };
    problem.inclusions.iter().map(of).collect()
}

/// The trapezoidal rule over places on a line.
struct Trapezoid {
    places: Vec<f64>,
}

impl Trapezoid {
    fn new(places: impl Iterator<Item = f64>, tiny: f64) -> Self {
        let mut places: Vec<f64> = places.collect();
        places.sort_by(f64::total_cmp);
        places.dedup_by(|a, b| (*a - *b).abs() < tiny);
        Self { places }
    }

    /// Weight of the place nearest to `x`; all of them add up to 1.
    fn at(&self, x: f64) -> f64 {
        let last = self.places.len() - 1;
        let after = self.places.partition_point(|p| *p < x).min(last);
        let k =
            if after > 0 && x - self.places[after - 1] < self.places[after] - x { after - 1 } else { after };
        let around = self.places[(k + 1).min(last)] - self.places[k.saturating_sub(1)];
        0.5 * around / (self.places[last] - self.places[0])
    }
}

/// The electrodes in the quarter that is solved.
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

/// The layer of the case; the reason if its finite elements cannot be set up.
fn problem(case: &Case, model: &Solid) -> Result<SpaceLayer, LayerSetupError> {
    let (layer, half_length, material) = layer(case)?;
    LayerSetupError::check_length(half_length.max(0.5 * model.width), layer.thickness)?;
    let indenter = match model.indenter {
        SolidIndenter::WholeTop => Press::WholeTop,
        SolidIndenter::FlatPunch { half_width, corner_radius, contact } => match contact {
            PunchContact::Bonded => Press::Bonded { half_width },
            PunchContact::Held => Press::Held { half_width },
            PunchContact::Smooth => Press::Smooth(IndenterProfile::Punch { half_width, corner_radius }),
        },
        SolidIndenter::Block { half_widths, corner_radius } => {
            Press::Smooth(IndenterProfile::Block { half_widths, corner_radius })
        }
        SolidIndenter::Cylinder { radius } => Press::Smooth(IndenterProfile::Cylinder { radius }),
        SolidIndenter::Sphere { radius } => Press::Smooth(IndenterProfile::Sphere { radius }),
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

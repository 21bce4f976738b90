//! The layer of a case by finite elements in three dimensions: the case becomes a problem.

use std::sync::atomic::AtomicBool;

use elastocap_geometry::scene::Box3;
use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::dimension::{Dimension, Space};
use elastocap_mechanics::solid::forecast::MeshSize;
use elastocap_mechanics::solid::layer::{Inclusion, Indenter as Press, LayerModel};
use elastocap_mechanics::solid::model::{Body, State};
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::press::{Mean, Places, Pressed, Refinement, deepest};
use elastocap_mechanics::solid::probe::Probe;
use elastocap_mechanics::solid::space::layer::SideCondition;
use elastocap_mechanics::solid::space::press::SpaceLayer;

use super::curves::{DeformedCurves, range};
use super::electrode_box::{ElectrodeBox, Ends, Face};
use super::error::{DeformError, LayerSetupError};
use super::finite_element::{FiniteElementRun, Scale, Solution, electrode_modulus, end, goals, layer};
use super::material::{Folded, Material};
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
    let coarsest = problem.coarsest();
    problem.mesh_within_limit(coarsest, deepest(&goals(loads, 1.0))).map_err(LayerSetupError::too_large)?;
    Ok(())
}

/// The sizes of the meshes that a run may need, coarse to fine: the first as it is, the finer ones about.
///
/// # Errors
/// Why the finite elements cannot be set up.
pub fn forecast(case: &Case, model: &Solid, loads: &[StepLoad]) -> Result<Vec<MeshSize>, LayerSetupError> {
    let problem = problem(case, model)?;
    problem.mesh_sizes(deepest(&goals(loads, 1.0))).map_err(LayerSetupError::too_large)
}

/// The least relative error of distances that is asked for: at small loads these hardly change.
const LEAST_TOLERANCE: f64 = 1e-4;

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
    let refinement = Refinement::in_space(model.relative_tolerance);
    let layout = case.electrodes.as_ref().map(|e| e.layout);
    let rods = Rods::of(case);
    let inclusions = problem.inclusions.len();
    let nowhere = |_: [f64; 3]| None;
    let folded: Vec<Folded> = match Material::of(case, true, &nowhere) {
        Some(material) => rods.ends().into_iter().map(|x| material.fold(x)).collect(),
        None => Vec::new(),
    };
    let means = |model: &LayerModel<Space>| {
        let body = model.equations().body();
        let faces = (0..inclusions).flat_map(|k| [0, 1, 2].map(|axis| (k, axis)));
        let mut all: Vec<Mean> = faces.flat_map(|(k, axis)| face_means(&problem, body, k, axis)).collect();
        if !folded.is_empty() {
            let probe = Probe::new(model.equations(), model.state());
            let of_end = |end: &Folded| {
                let found = end.places.iter().find_map(|place| probe.weights(*place)).unwrap_or_default();
                [0, 1, 2].map(|axis| {
                    found
                        .iter()
                        .map(|&(node, weight)| (3 * node + axis, end.signs[axis] * weight))
                        .collect::<Mean>()
                })
            };
            all.extend(folded.iter().flat_map(of_end));
        }
        all
    };
    let numbers = |means: &[f64]| {
        let (of_faces, of_ends) = means.split_at(6 * inclusions);
        let ends: Vec<[f64; 3]> = of_ends.chunks_exact(3).map(|u| [u[0], u[1], u[2]]).collect();
        let mut all = facing(layout, &moved(&problem.inclusions, of_faces));
        all.extend(rods.mean_stretches(&ends));
        all
    };
    let at_rest = numbers(&vec![0.0; 6 * inclusions + 3 * folded.len()]);
    let places = case.electrostatics.as_ref();
    let tolerances = |numbers: &[f64]| {
        let of = |(number, rest): (&f64, &f64)| {
            let of_value = places.map_or(f64::INFINITY, |field| field.relative_tolerance);
            let of_change = places.and_then(|field| field.change_tolerance).unwrap_or(f64::INFINITY);
            // The capacitance changes roughly in proportion to the distances.
            of_value.min(of_change * (number / rest - 1.0).abs()).max(LEAST_TOLERANCE)
        };
        numbers.iter().zip(&at_rest).map(of).collect()
    };
    let places = places.map(|_| Places { means: &means, of: &numbers, tolerances: &tolerances });
    let pressing = problem.press(&goals, &refinement, places.as_ref(), memory_limit, cancel, report)?;
    let scale = Scale { thickness: problem.thickness, width: 1.0 };
    let boxes = |pressed: &Pressed<Space>| {
        let body = pressing.model_of(pressed).equations().body();
        let mesh = &body.mesh;
        let on_top = |n: &usize| problem.thickness - mesh.nodes[*n][1] < 1e-9 * problem.thickness;
        let top = (0..mesh.nodes.len()).filter(on_top);
        let heights = range(top.map(|n| mesh.nodes[n][1] + pressed.state.displacement[3 * n + 1]));
        (boxes(&problem, body, &pressed.state), DeformedCurves { heights, ..DeformedCurves::default() })
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
fn facing(layout: Option<Layout>, electrodes: &[Ends]) -> Vec<f64> {
    let extent = |e: &Ends, axis: usize| e[axis][1] - e[axis][0];
    let (gap, along, across) = match (layout, electrodes) {
        (Some(Layout::InPlane), [right]) => (2.0 * right[0][0], extent(right, 1), extent(right, 2)),
        (Some(Layout::Stacked), [lower, upper]) => {
            let least = |axis: usize| extent(lower, axis).min(extent(upper, axis));
            (upper[1][0] - lower[1][1], least(0), least(2))
        }
        _ => return Vec::new(),
    };
    vec![gap, along * across / gap]
}

/// The ends of the electrodes where the mean displacements of their faces are these, of each along each axis at the lower and the upper
/// end. Only the half with positive x3 is solved, of which the lower end is the image of the upper one.
fn moved(inclusions: &[Inclusion<Space>], means: &[f64]) -> Vec<Ends> {
    let of = |(inclusion, means): (&Inclusion<Space>, &[f64])| {
        let mut ends =
            [0, 1, 2].map(|a| [inclusion.min[a] + means[2 * a], inclusion.max[a] + means[2 * a + 1]]);
        ends[2][0] = -ends[2][1];
        ends
    };
    inclusions.iter().zip(means.chunks_exact(6)).map(of).collect()
}

/// The mean displacements along `axis` of the lower and the upper face of an electrode there.
fn face_means(problem: &SpaceLayer, body: &Body<Space>, electrode: usize, axis: usize) -> [Mean; 2] {
    let along = |(node, weight): (usize, f64)| (3 * node + axis, weight);
    faces(problem, body, electrode, axis).map(|face| face.into_iter().map(along).collect())
}

/// Integrals of the shape functions of the nine nodes of a rectangle, over its area.
const NINE: [f64; 9] = {
    let line = [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0];
    let mut all = [0.0; 9];
    let mut n = 0;
    while n < 9 {
        all[n] = line[n % 3] * line[n / 3];
        n += 1;
    }
    all
};

/// The nodes of the lower and the upper face of an electrode across `axis`, and the part of the face at rest that belongs to each, over
/// its area. Nodes that several elements share are there several times.
fn faces(problem: &SpaceLayer, body: &Body<Space>, electrode: usize, axis: usize) -> [Vec<(usize, f64)>; 2] {
    let (inclusion, tiny) = (&problem.inclusions[electrode], 1e-9 * problem.thickness);
    let of_electrode = |material: u16| usize::from(material) == electrode + 1;
    let mesh = &body.mesh;
    let own = mesh.elements.iter().zip(&body.material).filter(|(_, material)| of_electrode(**material));
    let elements: Vec<&[u32; 27]> = own.map(|(element, _)| element).collect();
    [inclusion.min[axis], inclusion.max[axis]].map(|at| {
        let mut nodes = Vec::new();
        for (element, side) in elements.iter().flat_map(|e| Space::SIDES.iter().map(move |side| (*e, *side)))
        {
            let place = |k: usize| mesh.nodes[element[side[k]] as usize];
            if (0..9).any(|k| (place(k)[axis] - at).abs() > tiny) {
                continue;
            }
            let size = [0, 1, 2].map(|a| (place(8)[a] - place(0)[a]).abs());
            let area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
            nodes.extend(side.iter().zip(NINE).map(|(&n, part)| (element[n] as usize, area * part)));
        }
        let area: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        nodes.into_iter().map(|(node, weight)| (node, weight / area)).collect()
    })
}

/// The electrodes as boxes.
fn boxes(problem: &SpaceLayer, body: &Body<Space>, state: &State<Space>) -> Vec<ElectrodeBox> {
    let place = |(node, weight): (usize, f64)| {
        let (x, u) = (body.mesh.nodes[node], &state.displacement[3 * node..]);
        (weight, [0, 1, 2].map(|k| x[k] + u[k]))
    };
    let of = |electrode: usize| {
        let across = |axis: usize| -> [Face; 2] {
            faces(problem, body, electrode, axis).map(|face| face.into_iter().map(place).collect())
        };
        ElectrodeBox::new(&[0, 1, 2].map(across)).across()
    };
    (0..problem.inclusions.len()).map(of).collect()
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

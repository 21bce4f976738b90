//! The layer of a case by finite elements in three dimensions: the case becomes a problem.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::solid::layer::Indenter as Press;
use elastocap_mechanics::solid::obstacle::Shape;
use elastocap_mechanics::solid::press::Refinement;
use elastocap_mechanics::solid::space::layer::Side;
use elastocap_mechanics::solid::space::press::SpaceProblem;

use super::finite_element::{FiniteElementRun, Scale, Solution, end, goals, layer, rubber};
use crate::case::{Case, LayerSide, Solid, SolidIndenter};
use crate::plan::Plan;

/// The meshes that a run may need, coarse to fine: how many hexahedra and unknowns each has, and the size of its smallest
/// hexahedra at the surface in m.
pub fn forecast(case: &Case, model: &Solid) -> Vec<(usize, usize, f64)> {
    let Ok(problem) = problem(case, model) else { return Vec::new() };
    let refinement = Refinement::in_space(model.relative_tolerance);
    let count = |&n: &usize| {
        let mesh = problem.mesh(n).mesh();
        (mesh.elements.len(), 3 * mesh.nodes.len() + 4 * mesh.elements.len(), problem.finest(n))
    };
    refinement.meshes.iter().map(count).collect()
}

/// The path of the layer through the loads of `plan`; the reason if there is no model.
pub(super) fn solve(
    case: &Case,
    model: &Solid,
    plan: &Plan,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
) -> Result<FiniteElementRun, String> {
    let problem = problem(case, model)?;
    let goals = goals(plan, 1.0);
    let refinement = Refinement::in_space(model.relative_tolerance);
    let pressing = problem
        .press(&goals, &refinement, plan.layer_memory_limit, cancel, tell)
        .map_err(|error| error.to_string())?;
    let scale = Scale { thickness: problem.thickness, width: 1.0 };
    let mut run = FiniteElementRun::new(&pressing, &goals, scale, |_| Default::default());
    run.solution = Some(Solution::Space(pressing));
    Ok(run)
}

/// The layer of the case; the reason if its finite elements cannot be set up.
fn problem(case: &Case, model: &Solid) -> Result<SpaceProblem, String> {
    let (layer, half_length, material) = layer(case)?;
    let indenter = match model.indenter {
        SolidIndenter::WholeTop => Press::WholeTop,
        SolidIndenter::FlatPunch { half_width, bonded: true, .. } => Press::Bonded { half_width },
        SolidIndenter::FlatPunch { half_width, corner_radius: 0.0, .. } => Press::Sharp { half_width },
        SolidIndenter::FlatPunch { half_width, corner_radius, .. } => {
            Press::Smooth(Shape::Punch { half_width, corner_radius })
        }
        SolidIndenter::Block { half_widths, corner_radius } => {
            Press::Smooth(Shape::Block { half_widths, corner_radius })
        }
        SolidIndenter::Cylinder { radius } => Press::Smooth(Shape::Cylinder { radius }),
        SolidIndenter::Sphere { radius } => Press::Smooth(Shape::Sphere { radius }),
    };
    Ok(SpaceProblem {
        thickness: layer.thickness,
        half_length,
        half_width: 0.5 * model.width,
        rubber: rubber(material, layer.bulk_modulus),
        indenter,
        end: end(model.end),
        side: match model.side {
            LayerSide::Free => Side::Free,
            LayerSide::Symmetric => Side::Symmetric,
        },
    })
}

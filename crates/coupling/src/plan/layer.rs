//! What is planned of the layer: its mechanics, and what its shape means for the field.

use elastocap_geometry::scene::Wall;
use elastocap_mechanics::solid::dimension::{Dimension, Plane, Space};
use elastocap_mechanics::solid::forecast::{MeshSize, PressingRegime, memory_bytes, seconds};
use serde::Serialize;

use super::{Decision, LeftOut, Plan, Planned, counted, listed};
use crate::deform::{self, closed_form_limit};
use elastocap_case::{
    Case, Extent, Face, FieldSolver, Indenter, Load, Mechanics, PlaneStrain, Solid, SolidIndenter,
    Surroundings,
};

/// What the finite elements of a layer take: estimates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerForecast {
    /// Unknowns of each mesh, coarse to fine: displacements and pressures.
    pub unknowns: Vec<usize>,
    /// Peak memory, bytes: an upper estimate.
    pub memory_bytes: u64,
    /// Expected seconds on two cores if every load needs every mesh.
    pub seconds: f64,
}

impl Plan {
    pub(super) fn mechanics(&mut self, case: &Case) {
        let count = self.steps.len();
        match (&case.load, &case.mechanics) {
            (Some(load), Some(Mechanics::ClosedForm { .. })) => {
                let by = match load {
                    Load::Compression(_) => "by compression",
                    Load::Force(_) => "by force: the compression is found by inverting eq. (50)",
                };
                let what = format!("closed form of the layer at {}, {by}", counted(count, "load step"));
                self.solved.push(Planned { part: "mechanics", what });
                self.force_limit = closed_form_limit(case);
                self.warn_beyond_limit(load);
            }
            (Some(load), Some(Mechanics::PlaneStrain(model))) => self.plane_strain(case, load, model),
            (Some(load), Some(Mechanics::Solid(model))) => self.solid(case, load, model),
            (None, mechanics) if case.layer.is_some() => {
                let none = mechanics.is_none();
                if none || self.pruned {
                    let why = "there is no load, so that nothing deforms";
                    let by = if none { Decision::Case } else { Decision::Plan };
                    self.left_out.push(LeftOut::new(by, "mechanics", why, "microseconds"));
                } else {
                    let what = "closed form of the layer without load".to_owned();
                    self.solved.push(Planned { part: "mechanics", what });
                }
            }
            _ => {}
        }
    }

    fn plane_strain(&mut self, case: &Case, load: &Load, model: &PlaneStrain) {
        let (meshes, regime) = deform::forecast(case, model, self);
        self.finite_elements::<Plane>("in plane strain", load, &meshes, regime, model.relative_tolerance);
        self.warn_of_bulge(case, model.indenter == Indenter::WholeTop);
    }

    fn solid(&mut self, case: &Case, load: &Load, model: &Solid) {
        let forecast = deform::forecast_solid(case, model);
        let size = |&(elements, unknowns, _): &(usize, usize, f64)| MeshSize { elements, unknowns };
        let meshes: Vec<MeshSize> = forecast.iter().map(size).collect();
        // Rounded corners are coarse in space: the surface hardly slides around them.
        let regime = match model.indenter {
            SolidIndenter::FlatPunch { corner_radius: 0.0, .. } => PressingRegime::Sharp,
            SolidIndenter::WholeTop
            | SolidIndenter::FlatPunch { .. }
            | SolidIndenter::Block { .. }
            | SolidIndenter::Cylinder { .. }
            | SolidIndenter::Sphere { .. } => PressingRegime::Smooth,
        };
        let what = "of a quarter of the layer";
        self.finite_elements::<Space>(what, load, &meshes, regime, model.relative_tolerance);
        let rounded = match model.indenter {
            SolidIndenter::FlatPunch { corner_radius, .. } | SolidIndenter::Block { corner_radius, .. } => {
                corner_radius
            }
            SolidIndenter::WholeTop | SolidIndenter::Cylinder { .. } | SolidIndenter::Sphere { .. } => 0.0,
        };
        if let Some(&(.., finest)) = forecast.last()
            && rounded > 0.0
            && rounded < finest
        {
            self.warnings.push(format!(
                "the corner radius of {rounded:.2e} m is smaller than the hexahedra of the finest mesh, {finest:.2e} m: the \
                 force may be off by more than its error estimate says"
            ));
        }
        self.warn_of_bulge(case, model.indenter == SolidIndenter::WholeTop);
    }

    /// Notes what is solved on `meshes`, and what it will take.
    fn finite_elements<S: Dimension>(
        &mut self,
        what: &str,
        load: &Load,
        meshes: &[MeshSize],
        regime: PressingRegime,
        tolerance: f64,
    ) {
        let by_force = matches!(load, Load::Force(_));
        let by = if by_force { "compression" } else { "force" };
        let loads = self.distinct_steps().count();
        if !meshes.is_empty() {
            self.layer = Some(LayerForecast {
                unknowns: meshes.iter().map(|mesh| mesh.unknowns).collect(),
                memory_bytes: memory_bytes::<S>(meshes, self.steps.len()),
                seconds: seconds::<S>(meshes, loads, regime, by_force),
            });
        }
        let meshes: Vec<String> = meshes.iter().map(|mesh| mesh.unknowns.to_string()).collect();
        let what = format!(
            "finite elements {what} at {}, on meshes of {} unknowns, each only if the {by} is not yet known to a \
             relative {tolerance:e}",
            counted(self.steps.len(), "load step"),
            listed(&meshes),
        );
        self.solved.push(Planned { part: "mechanics", what });
    }

    fn warn_of_bulge(&mut self, case: &Case, whole_top: bool) {
        if !case.has_conductors() || whole_top || follows_surface(case) {
            return;
        }
        let cure = if may_bend(case) {
            "; it follows the surface where `side_margin` ends the scene by walls and there is a medium above"
        } else {
            ""
        };
        self.warnings.push(format!(
            "the field solver takes the surface of the layer as flat, at its height under the indenter; beside the indenter \
             the rubber bulges above that{cure}"
        ));
    }

    fn warn_beyond_limit(&mut self, load: &Load) {
        let (Some(limit), Load::Compression(steps)) = (self.force_limit, load) else { return };
        let beyond = steps.iter().filter(|c| **c > limit.compression).count();
        if beyond > 0 {
            self.warnings.push(format!(
                "{} beyond U/H = {:.4}, where the force of eq. (50) has its maximum: there the formula means nothing, and \
                 the step gets a capacitance but no force",
                if beyond == 1 { "1 step lies".to_owned() } else { format!("{beyond} steps lie") },
                limit.compression,
            ));
        }
    }
}

/// Whether the load may bend the electrodes, and the solver for any shape takes them then.
pub(super) fn may_bend(case: &Case) -> bool {
    let solver = case.electrostatics.and_then(|e| e.solver);
    matches!(case.mechanics, Some(Mechanics::PlaneStrain(_)))
        && case.load.is_some()
        && case.electrodes.is_some()
        && solver != Some(FieldSolver::Boxes)
}

/// Whether that solver has the surface of the layer as it is: see [`crate::layer_outlines`].
fn follows_surface(case: &Case) -> bool {
    let ended = |surroundings: &Surroundings| match &surroundings.extent {
        Extent::AroundLayer { side_margin: Some(_), above: Face::Medium { .. }, .. } => {
            surroundings.boundary != Wall::Open
        }
        _ => false,
    };
    may_bend(case) && case.surroundings.as_ref().is_some_and(ended)
}

//! The part of a plan about the mechanics of the layer, and the consequences of its shape for the field.

use elastocap_mechanics::solid::dimension::{Dimension, Plane, Space};
use elastocap_mechanics::solid::forecast::{MeshSize, PressingRegime, memory_bytes, seconds};
use serde::Serialize;

use super::{Decision, LeftOut, Plan, Planned, PlannedStep};
use crate::deform::{self, closed_form_limit, foam, force_warning, layer_state, shear_length, shear_warning};
use crate::failure::StepFailure;
use crate::route::Route;
use crate::words::{FORCE_FORMULA, counted, grouped, listed};
use elastocap_case::{
    Case, Extent, Face, Indenter, Load, Mechanics, PlaneStrain, PunchContact, Solid, Surroundings,
};

/// Estimates of memory and time of a layer's finite elements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerForecast {
    /// The indenter that presses the layer, in words.
    pub indenter: &'static str,
    /// Unknowns of each mesh, coarse to fine: displacements and pressures.
    pub unknowns: Vec<usize>,
    /// Peak memory, bytes: an upper estimate.
    pub memory_bytes: u64,
    /// Peak memory, bytes, if no load needs the finest meshes, as in most cases.
    #[serde(skip)]
    pub usual_memory_bytes: u64,
    /// Expected seconds on two cores: no load needs the finest mesh, as in most cases.
    pub seconds: f64,
    /// Seconds on two cores if every load needs every mesh.
    pub most_seconds: f64,
}

/// The meshes that most loads need: at least three, or half of them where there are many, as in plane strain.
fn usual(meshes: &[MeshSize]) -> &[MeshSize] {
    &meshes[..meshes.len().min(3.max(meshes.len() / 2))]
}

/// The words for a held patch in place of a punch.
pub const HELD_PATCH: &str = "a patch of its top that is held and moved down, not a punch";

fn words_of_punch(contact: PunchContact) -> &'static str {
    match contact {
        PunchContact::Held => HELD_PATCH,
        PunchContact::Bonded => "a sharp punch that it sticks to",
        PunchContact::Smooth { corner_radius: Some(_) } => {
            "a punch with rounded corners, in contact without friction"
        }
        PunchContact::Smooth { corner_radius: None } => "a sharp punch, in contact without friction",
    }
}

fn indenter_in_words(indenter: Indenter) -> &'static str {
    match indenter {
        Indenter::WholeTop => "a smooth plate over its whole top",
        Indenter::FlatPunch { contact, .. } => words_of_punch(contact),
        Indenter::Cylinder { .. } => "a cylinder, in contact without friction",
        Indenter::Block { .. } => "a block with rounded edges, in contact without friction",
        Indenter::Sphere { .. } => "a sphere, in contact without friction",
    }
}

impl Plan {
    pub(super) fn mechanics(&mut self, case: &Case) {
        let count = self.steps.len();
        if let (Some(_), Some(why)) = (&case.load, &case.mechanics_chosen) {
            self.solved.push(Planned { part: "mechanics", what: why.clone() });
        }
        match (&case.load, &case.mechanics) {
            (Some(load), Some(Mechanics::ClosedForm { .. })) => {
                let by = match load {
                    Load::Compression(_) => "by compression",
                    Load::Force(_) if foam::has_law(case) => {
                        "by force: the compression is found by inverting the law of the foam"
                    }
                    Load::Force(_) => "by force: the compression is found by inverting the force formula",
                };
                let model = if foam::has_law(case) {
                    "even compression of the foam"
                } else {
                    "closed form of the layer"
                };
                let what = format!("{model} at {}, {by}", counted(count, "load step"));
                self.solved.push(Planned { part: "mechanics", what });
                self.force_limit = closed_form_limit(case);
                self.warn_beyond_limit(case, load);
                self.warn_of_force(case);
                self.shear_length(case);
            }
            (Some(load), Some(Mechanics::PlaneStrain(model))) => self.plane_strain(case, load, model),
            (Some(load), Some(Mechanics::Solid(model))) => self.solid(case, load, model),
            (None, mechanics) if case.layer.is_some() => {
                let none = mechanics.is_none();
                if none || self.pruned {
                    let why = "there is no load, so that nothing deforms";
                    let by = if none { Decision::Case } else { Decision::Plan };
                    self.left_out.push(LeftOut::new(by, "mechanics", why, "Saves microseconds."));
                } else {
                    let what = "closed form of the layer without load".to_owned();
                    self.solved.push(Planned { part: "mechanics", what });
                }
            }
            // Without a layer there are no mechanics, and the case reader refuses a load without them.
            (None, _) | (Some(_), None) => {}
        }
    }

    /// Adds the forecast of the finite elements that determine the shear length of a closed form.
    fn shear_length(&mut self, case: &Case) {
        match shear_length::forecast(case, &self.loads()) {
            Ok(None) => {}
            Ok(Some((meshes, compressions))) => {
                let unknowns: Vec<usize> = meshes.iter().map(|mesh| mesh.unknowns).collect();
                let listed_unknowns: Vec<String> = unknowns.iter().map(|n| grouped(*n)).collect();
                let regime = PressingRegime::Patch;
                self.layer = Some(LayerForecast {
                    unknowns,
                    memory_bytes: memory_bytes::<Plane>(&meshes, compressions, self.layer_memory_limit),
                    usual_memory_bytes: memory_bytes::<Plane>(
                        usual(&meshes),
                        compressions,
                        self.layer_memory_limit,
                    ),
                    seconds: seconds::<Plane>(usual(&meshes), compressions, regime, false),
                    most_seconds: seconds::<Plane>(&meshes, compressions, regime, false),
                    indenter: HELD_PATCH,
                });
                let what = format!(
                    "its shear length by finite elements at {}, on meshes of {} unknowns",
                    counted(compressions, "compression"),
                    listed(&listed_unknowns)
                );
                self.solved.push(Planned { part: "mechanics", what });
            }
            Err(error) => {
                for step in &mut self.steps {
                    (step.route, step.failure) = (None, Some(StepFailure::Layer(error.clone())));
                }
            }
        }
    }

    fn plane_strain(&mut self, case: &Case, load: &Load, model: &PlaneStrain) {
        // Where the layer cannot be set up every step is known to fail, with the reason.
        let Ok((meshes, regime)) = deform::forecast(case, model, &self.loads()) else { return };
        let what = ["in plane strain", indenter_in_words(model.indenter)];
        self.finite_elements::<Plane>(what, load, &meshes, regime, model.relative_tolerance);
        self.warn_of_wall(case, model.indenter == Indenter::WholeTop);
    }

    fn solid(&mut self, case: &Case, load: &Load, model: &Solid) {
        // Where the layer cannot be set up every step is known to fail, with the reason.
        let Ok(meshes) = deform::forecast_solid(case, model, &self.loads()) else { return };
        // The mesh at rounded corners is coarse in three dimensions: the surface hardly slides around them.
        let is_sharp = matches!(model.indenter, Indenter::FlatPunch { contact, .. } if contact.corner_radius().is_none());
        let regime = if is_sharp { PressingRegime::Patch } else { PressingRegime::Smooth };
        let what = ["of a quarter of the layer", indenter_in_words(model.indenter)];
        self.finite_elements::<Space>(what, load, &meshes, regime, model.relative_tolerance);
        self.warn_of_wall(case, model.indenter == Indenter::WholeTop);
    }

    /// Adds the finite elements on `meshes` to the plan, with their memory and time.
    fn finite_elements<S: Dimension>(
        &mut self,
        [what, indenter]: [&'static str; 2],
        load: &Load,
        meshes: &[MeshSize],
        regime: PressingRegime,
        tolerance: f64,
    ) {
        let by_force = matches!(load, Load::Force(_));
        let by = if by_force { "compression" } else { "force" };
        let loads = self.distinct_steps().count();
        let memory =
            |meshes: &[MeshSize]| memory_bytes::<S>(meshes, self.steps.len(), self.layer_memory_limit);
        // In three dimensions, meshes that exceed the memory limit are not started.
        let fits = |meshes: &&[MeshSize]| S::AXES == 2 || memory(meshes) <= self.layer_memory_limit;
        let begun = (2..=meshes.len())
            .rev()
            .map(|n| &meshes[..n])
            .find(fits)
            .unwrap_or(&meshes[..meshes.len().min(1)]);
        self.layer = Some(LayerForecast {
            indenter,
            unknowns: meshes.iter().map(|mesh| mesh.unknowns).collect(),
            memory_bytes: memory(begun),
            usual_memory_bytes: memory(usual(begun)),
            seconds: seconds::<S>(usual(meshes), loads, regime, by_force),
            most_seconds: seconds::<S>(meshes, loads, regime, by_force),
        });
        let meshes: Vec<String> = meshes.iter().map(|mesh| grouped(mesh.unknowns)).collect();
        let what = format!(
            "finite elements {what}, under {indenter}, at {}, on meshes of {} unknowns, each only if the {by} is not yet known to a \
             relative {tolerance:e}",
            counted(self.steps.len(), "load step"),
            listed(&meshes),
        );
        self.solved.push(Planned { part: "mechanics", what });
        if indenter == HELD_PATCH {
            self.warnings.push(
                "`contact = \"held\"` is not a punch: the patch that lies under it at rest is moved down and spreads, past the width of the \
                 punch; a punch of that width takes less force, by 10 to 30 % at compressions of 5 to 20 %"
                    .to_owned(),
            );
        }
    }

    /// Warns where the force of the closed form differs from that of a punch. If its shear length is still to
    /// be computed, the run warns instead.
    fn warn_of_force(&mut self, case: &Case) {
        let states = self.distinct_steps().filter_map(|step| layer_state(case, step.load, true).ok()?);
        let warning = force_warning(case, states, self.force_limit);
        self.warnings.extend(warning);
        if case.lacks_force() {
            return;
        }
        let with_pose = |step: &PlannedStep| Some((layer_state(case, step.load, true).ok()??, step.pose));
        let warning = shear_warning(self.distinct_steps().filter_map(with_pose));
        self.warnings.extend(warning);
    }

    /// Warns of a wall on the layer: the field has a flat surface under it.
    fn warn_of_wall(&mut self, case: &Case, whole_top: bool) {
        let is_medium = |surroundings: &Surroundings| match &surroundings.extent {
            Extent::AroundLayer { above, .. } => matches!(above, Face::Medium { .. }),
            Extent::Everywhere | Extent::Walls(_) => true,
        };
        // Under a map the wall is bent along.
        let is_mapped = self.count(|route| route == Route::MAPPED_BOXES) > 0;
        if !case.has_conductors()
            || whole_top
            || is_mapped
            || case.surroundings.as_ref().is_none_or(is_medium)
        {
            return;
        }
        self.warnings.push(
            "the wall that lies on the layer is taken as flat in the field, at the height under the indenter; beside the indenter the rubber \
             bulges above that, and what this changes is counted by a rough estimate; put a medium on the layer, with `above = { \
             relative_permittivity = 1.0, thickness = .. }`"
                .to_owned(),
        );
    }

    fn warn_beyond_limit(&mut self, case: &Case, load: &Load) {
        let (Some(limit), Load::Compression(steps)) = (self.force_limit, load) else { return };
        let beyond = steps.iter().filter(|c| **c > limit.compression).count();
        if beyond > 0 && !case.is_foam() {
            self.warnings.push(format!(
                "{} beyond U/H = {:.4}, where the force has its maximum by {FORCE_FORMULA}: there the formula means nothing, \
                 and the step gets a capacitance but no force",
                if beyond == 1 { "1 step lies".to_owned() } else { format!("{beyond} steps lie") },
                limit.compression,
            ));
        }
    }
}

//! The load steps of a plan, each with its route, or with its failure where that is known beforehand.

use std::collections::HashMap;

use elastocap_case::{Case, Pose};
use elastocap_geometry::scene::Scene;
use serde::{Serialize, Serializer};

use super::{Options, Plan};
use crate::deform::{check_setup, layer_state};
use crate::failure::StepFailure;
use crate::load_steps::StepLoad;
use crate::mapped::in_the_way;
use crate::route::{Bending, Bodies, Route, SolvedShape, asked, route};
use crate::scene::contacts::check_pressed;
use crate::scene::scene_of;

/// One load step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedStep {
    /// The index of the step in the case.
    pub index: usize,
    /// The load.
    pub load: StepLoad,
    /// The pose of attached bodies and of the indenter.
    #[serde(skip_serializing_if = "is_at_rest", serialize_with = "in_si_units")]
    pub pose: Pose,
    /// The earlier step with the same load and scene whose result is reused.
    pub same_as: Option<usize>,
    /// The planned route of the field, before the layer is deformed; `None` without a field.
    pub route: Option<Route>,
    /// The reason that the step cannot be solved, if it is known in advance.
    pub failure: Option<StepFailure>,
    /// The reason that the step may fail once the layer is deformed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doubt: Option<StepFailure>,
}

fn is_at_rest(pose: &Pose) -> bool {
    *pose == Pose::default()
}

fn in_si_units<S: Serializer>(pose: &Pose, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct InSiUnits {
        distance_m: f64,
        shift_m: [f64; 2],
        tilt_rad: [f64; 2],
    }
    InSiUnits { distance_m: pose.distance, shift_m: pose.shift, tilt_rad: pose.tilt }.serialize(serializer)
}

impl Plan {
    /// The steps whose result is not taken over from an earlier one.
    pub fn distinct_steps(&self) -> impl Iterator<Item = &PlannedStep> {
        self.steps.iter().filter(|step| step.same_as.is_none())
    }

    /// The loads of all steps.
    pub fn loads(&self) -> Vec<StepLoad> {
        self.steps.iter().map(|step| step.load).collect()
    }

    /// The steps among [`Plan::distinct_steps`] that are not known to fail.
    pub(super) fn solvable_steps(&self) -> impl Iterator<Item = &PlannedStep> {
        self.distinct_steps().filter(|step| step.failure.is_none())
    }

    /// The number of solvable steps on such a route.
    pub(super) fn count(&self, on: impl Fn(Route) -> bool) -> usize {
        self.solvable_steps().filter_map(|step| step.route).filter(|route| on(*route)).count()
    }

    /// The first solvable step on such a route, and its scene; `None` without such a step.
    pub(super) fn first_scene(
        &self,
        case: &Case,
        options: &Options,
        on: impl Fn(Route) -> bool,
    ) -> Option<(usize, Scene)> {
        let mut steps = self.solvable_steps().filter(|step| step.route.is_some_and(&on));
        // A step whose scene is refused is not solvable.
        steps.find_map(|step| Some((step.index, scene_at(case, step.load, &step.pose, options.prune).ok()?)))
    }
}

/// The steps of a case.
pub(super) fn planned_steps(case: &Case, options: &Options) -> Vec<PlannedStep> {
    let mut first_with = HashMap::new();
    let mut steps: Vec<PlannedStep> = Vec::new();
    let mut first_scene: Option<Scene> = None;
    let loads = StepLoad::all_of(case);
    let setup = check_setup(case, &loads);
    for (index, load) in loads.into_iter().enumerate() {
        let pose = case.pose(index);
        let moves =
            pose.shift.into_iter().chain(pose.tilt).chain([pose.distance]).map(|x| (x + 0.0).to_bits());
        let key = (load.bits(), moves.collect::<Vec<u64>>());
        let first = *first_with.entry(key).or_insert(index);
        let mut same_as = (options.prune && first != index).then_some(first);
        let (route, failure, doubt) = match same_as.and_then(|first| steps.get(first)) {
            Some(original) => (original.route, original.failure.clone(), original.doubt.clone()),
            None => match setup.clone().map_err(|error| StepFailure::Layer(error.into())) {
                Err(failure) => (None, Some(failure), None),
                Ok(()) => match outlook(case, load, &pose, options.prune) {
                    Ok(Outlook { route, scene, doubt }) => {
                        // An approaching indenter may not be part of the field.
                        let moved = |pose: &Pose| (pose.shift, pose.tilt);
                        let is_same = steps.first().is_some_and(|first| {
                            first.load == load && moved(&first.pose) == moved(&pose) && scene == first_scene
                        });
                        same_as = (is_same && scene.is_some()).then_some(0);
                        if index == 0 && options.prune && case.approaches() {
                            first_scene = scene;
                        }
                        (route, None, doubt)
                    }
                    Err(failure) => (None, Some(failure), None),
                },
            },
        };
        steps.push(PlannedStep { index, load, pose, same_as, route, failure, doubt });
    }
    steps
}

/// The outlook of a step before the layer is solved.
#[derive(Default)]
struct Outlook {
    /// The route of the field, if the step has one.
    route: Option<Route>,
    scene: Option<Scene>,
    doubt: Option<StepFailure>,
}

/// The outlook of a step.
///
/// # Errors
/// The first failure, in the order of a run, that is known in advance.
fn outlook(case: &Case, load: StepLoad, pose: &Pose, prune: bool) -> Result<Outlook, StepFailure> {
    if !case.has_conductors() {
        layer_state(case, load, prune).map_err(|error| StepFailure::Layer(error.into()))?;
        return Ok(Outlook::default());
    }
    let scene = scene_at(case, load, pose, prune)?;
    if let (Some(layer), StepLoad::Compression(compression)) = (&case.layer, load)
        && case.mechanics.is_some_and(|mechanics| mechanics.is_finite_element())
    {
        check_pressed(case, compression * layer.thickness, pose)?;
    }
    let route = route(Bodies::of(&scene), Bending::expected(case, load, pose), asked(case))?;
    // The map of a tilt is made together with the scene: the surface of the layer that the tilt follows stays
    // flat.
    let doubt = match route.shape() {
        SolvedShape::Mapped if pose.tilt == [0.0; 2] => {
            in_the_way(case, &scene, load, pose)?.map(StepFailure::from)
        }
        SolvedShape::Mapped | SolvedShape::Straight | SolvedShape::Outlines => None,
    };
    Ok(Outlook { route: Some(route), scene: Some(scene), doubt })
}

/// The scene of a step. With finite elements, which a plan does not solve, it is the scene at rest.
pub(super) fn scene_at(case: &Case, load: StepLoad, pose: &Pose, prune: bool) -> Result<Scene, StepFailure> {
    let state = layer_state(case, load, prune).map_err(|error| StepFailure::Layer(error.into()))?;
    Ok(scene_of(case, state.as_ref(), pose)?.scene)
}

//! What the box solver will take for the steps of a plan. A load may leave a scene without a mirror plane that it has at rest, so that
//! the steps are counted as they are.

use elastocap_case::{Case, Indenter, Mechanics};
use elastocap_electrostatics::{Forecast, SolveError, forecast, mirror_planes};
use elastocap_geometry::scene::Scene;

use super::electrostatics::is_by_boxes;
use super::steps::scene_at;
use super::{Options, Plan, PlannedStep};
use crate::settings::FieldSettings;

/// Steps that are looked at, at most: of more, as many that lie evenly among them.
const MAX_STEPS: usize = 64;

/// Steps with the same mirror planes.
struct Group {
    mirrored: [bool; 3],
    /// Planes that the load takes away, which is known although its scene is not.
    lost: [bool; 3],
    steps: usize,
    /// That of the last step: loads usually ascend, and the layer thins.
    scene: Scene,
}

impl Plan {
    /// What the box solver takes for one step of those that it takes, on average, and at most where it is about memory and unknowns;
    /// `None` without such a step.
    ///
    /// # Errors
    /// See [`forecast`].
    pub(super) fn forecast_boxes(
        &self,
        case: &Case,
        options: &Options,
        settings: &FieldSettings,
    ) -> Result<Option<Forecast>, SolveError> {
        let by_boxes = |step: &&PlannedStep| step.route.is_some_and(is_by_boxes);
        let all: Vec<&PlannedStep> = self.solvable_steps().filter(by_boxes).collect();
        let stride = all.len().div_ceil(MAX_STEPS).max(1);
        let mut groups: Vec<Group> = Vec::new();
        // From the last one, so that the last step of each group is the one that is kept.
        for step in all.iter().rev().step_by(stride) {
            // A step whose scene is refused is known to fail, and not among them.
            let Ok(scene) = scene_at(case, step.load, &step.pose, options.prune) else { continue };
            let mirrored = mirror_planes(&scene, &settings.boxes())?;
            let lost = if step.load.is_zero() { [false; 3] } else { lost_under_load(case) };
            match groups.iter_mut().find(|group| (group.mirrored, group.lost) == (mirrored, lost)) {
                Some(group) => group.steps += 1,
                None => groups.push(Group { mirrored, lost, steps: 1, scene }),
            }
        }
        let mut largest: Option<Forecast> = None;
        let (mut seconds, mut unmirrored, mut memory) = (0.0, 0.0, 0);
        for group in &groups {
            let own = without(forecast(&group.scene, &settings.boxes())?, group.lost);
            seconds += own.seconds * group.steps as f64;
            unmirrored += own.unmirrored.1 * group.steps as f64;
            memory = own.memory_bytes.max(memory);
            if largest.as_ref().is_none_or(|most| most.unknowns < own.unknowns) {
                largest = Some(own);
            }
        }
        let steps = groups.iter().map(|group| group.steps).sum::<usize>() as f64;
        Ok(largest.map(|largest| Forecast {
            seconds: seconds / steps,
            unmirrored: (largest.unmirrored.0, unmirrored / steps),
            memory_bytes: memory,
            ..largest
        }))
    }
}

/// The axes along which a load makes the two halves of a layer different, by finite elements, of which only the scene at rest is known:
/// the top moves and the bottom does not, and an indenter may stand beside the middle.
fn lost_under_load(case: &Case) -> [bool; 3] {
    match &case.mechanics {
        None | Some(Mechanics::ClosedForm { .. }) => [false; 3],
        Some(Mechanics::PlaneStrain(model)) => {
            let aside = match model.indenter {
                Indenter::WholeTop => false,
                Indenter::FlatPunch { position, .. } | Indenter::Cylinder { position, .. } => position != 0.0,
            };
            [aside, true, false]
        }
        Some(Mechanics::Solid(_)) => [false, true, false],
    }
}

/// The forecast for a scene that has lost its mirror planes along some axes.
fn without(own: Forecast, lost: [bool; 3]) -> Forecast {
    let gone = (0..3).filter(|&a| lost[a] && own.mirrored[a]).count() as u32;
    let copies = 1_usize << gone;
    Forecast {
        unknowns: own.unknowns * copies,
        memory_bytes: own.memory_bytes.saturating_mul(copies as u64),
        // As with the unknowns of all mirrored scenes: the axes become longer too.
        seconds: own.seconds * (copies as f64).powf(4.0 / 3.0),
        mirrored: [0, 1, 2].map(|a| own.mirrored[a] && !lost[a]),
        ..own
    }
}

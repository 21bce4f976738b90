//! A forecast of what the box solver takes for the steps of a plan. A load may leave a scene without a mirror plane that it has at rest, so
//! that the steps are counted as they are.

use elastocap_case::{Case, Indenter, Mechanics};
use elastocap_electrostatics::{Effort, Forecast, SolveError, forecast, symmetries};
use elastocap_geometry::mirror::planes;
use elastocap_geometry::scene::Scene;

use super::electrostatics::is_by_boxes;
use super::steps::scene_at;
use super::{Options, Plan, PlannedStep};
use crate::route::Route;
use crate::scene::neutral::indenter_in_field;
use crate::settings::FieldSettings;

/// Steps that are looked at, at most, and these times the bodies of the scene: of more, as many that lie evenly among them.
const MAX_STEPS: usize = 64;
const MAX_BODIES: usize = 12_800;

/// How many times as much boxes take under a map as without one: at most what was observed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MapFactors {
    unknowns: usize,
    memory: u64,
    seconds: f64,
}

impl MapFactors {
    /// The factors for boxes without a map.
    const NONE: Self = Self { unknowns: 1, memory: 1, seconds: 1.0 };
    /// The factors for tilted bodies, which need a tensor at every point of the elements.
    const TILTED: Self = Self { unknowns: 1, memory: 1, seconds: 3.0 };
    /// The factors for a bent layer and bent electrodes, which need such a tensor, and for which the map itself has to be found.
    const BENT: Self = Self { unknowns: 1, memory: 2, seconds: 20.0 };
    /// The factors for the narrow space under an indenter, which needs all that, and finer grids and more iterations besides.
    const UNDER_INDENTER: Self = Self { unknowns: 2, memory: 8, seconds: 30.0 };

    fn of(case: &Case, step: &PlannedStep) -> Self {
        match step.route {
            Some(Route::MAPPED_BOXES) if step.pose.tilt != [0.0; 2] => Self::TILTED,
            Some(Route::MAPPED_BOXES) if indenter_in_field(case).is_some() => Self::UNDER_INDENTER,
            Some(Route::MAPPED_BOXES) => Self::BENT,
            _ => Self::NONE,
        }
    }

    fn times(self, own: Forecast) -> Forecast {
        Forecast {
            unknowns: self.unknowns * own.unknowns,
            memory_bytes: own.memory_bytes.saturating_mul(self.memory),
            seconds: self.seconds * own.seconds,
            unmirrored: (self.unknowns * own.unmirrored.0, self.seconds * own.unmirrored.1),
            ..own
        }
    }
}

/// Steps with the same symmetries under the same kind of map.
struct Group {
    symmetries: ([bool; 3], bool),
    map: MapFactors,
    /// Planes that the load takes away, which is known although its scene is not.
    lost: [bool; 3],
    steps: usize,
    /// The scene of the last step: loads usually ascend, and the layer thins.
    scene: Scene,
}

impl Plan {
    /// The unknowns, memory and time of the box solver for one step of those that it solves: on average, and at most where it is about memory
    /// and unknowns; `None` without such a step.
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
        let most = (MAX_BODIES / case.bodies.len().max(1)).clamp(2, MAX_STEPS);
        let stride = all.len().div_ceil(most).max(1);
        let mut groups: Vec<Group> = Vec::new();
        // From the last one, so that the last step of each group is the one that is kept.
        for step in all.iter().rev().step_by(stride) {
            // A step whose scene is refused is known to fail, and not among them.
            let Ok(scene) = scene_at(case, step.load, &step.pose, options.prune) else { continue };
            let symmetries = symmetries(&scene, &settings.boxes())?;
            let lost = if step.load.is_zero() { [false; 3] } else { lost_under_load(case, &scene, step) };
            let map = MapFactors::of(case, step);
            let is_same =
                |group: &&mut Group| (group.symmetries, group.lost, group.map) == (symmetries, lost, map);
            match groups.iter_mut().find(is_same) {
                Some(group) => group.steps += 1,
                None => groups.push(Group { symmetries, map, lost, steps: 1, scene }),
            }
        }
        let mut largest: Option<Forecast> = None;
        let (mut seconds, mut unmirrored, mut memory, mut is_rough) = (0.0, 0.0, 0, false);
        let mut effort = Effort::default();
        for group in &groups {
            let own = forecast(&group.scene, &settings.boxes(), &mut effort)?;
            let own = group.map.times(without(own, group.lost));
            seconds += own.seconds * group.steps as f64;
            unmirrored += own.unmirrored.1 * group.steps as f64;
            memory = own.memory_bytes.max(memory);
            is_rough |= own.is_rough;
            if largest.as_ref().is_none_or(|most| most.unknowns < own.unknowns) {
                largest = Some(own);
            }
        }
        let steps = groups.iter().map(|group| group.steps).sum::<usize>() as f64;
        Ok(largest.map(|largest| Forecast {
            seconds: seconds / steps,
            unmirrored: (largest.unmirrored.0, unmirrored / steps),
            memory_bytes: memory,
            is_rough,
            ..largest
        }))
    }
}

/// The axes along which a load makes the two halves of a layer different, by finite elements, of which only the scene at rest is known:
/// the top moves and the bottom does not, an indenter may stand beside the middle, and a map bends both sides of the middle alike and no
/// other ones.
fn lost_under_load(case: &Case, scene: &Scene, step: &PlannedStep) -> [bool; 3] {
    let off_the_middle = match step.route {
        Some(Route::MAPPED_BOXES) => planes(scene).map(|plane| plane.is_some_and(|plane| plane.at != 0.0)),
        _ => [false; 3],
    };
    let by_mechanics = match &case.mechanics {
        None | Some(Mechanics::ClosedForm { .. }) => [false; 3],
        Some(Mechanics::PlaneStrain(model)) => {
            let aside = match model.indenter {
                Indenter::WholeTop => false,
                Indenter::FlatPunch { position, .. } | Indenter::Cylinder { position, .. } => position != 0.0,
            };
            [aside, true, false]
        }
        Some(Mechanics::Solid(_)) => [false, true, false],
    };
    [0, 1, 2].map(|a| by_mechanics[a] || off_the_middle[a])
}

/// The forecast for a scene that has lost its mirror planes along some axes, and with x1 or x3 its half turn.
fn without(own: Forecast, lost: [bool; 3]) -> Forecast {
    let turn_is_lost = own.turned && (lost[0] || lost[2]);
    let gone = (0..3).filter(|&a| lost[a] && own.mirrored[a]).count() + usize::from(turn_is_lost);
    let copies = 1_usize << gone;
    Forecast {
        unknowns: own.unknowns * copies,
        memory_bytes: own.memory_bytes.saturating_mul(copies as u64),
        // As with the unknowns of all mirrored scenes: the axes become longer too.
        seconds: own.seconds * (copies as f64).powf(4.0 / 3.0),
        mirrored: [0, 1, 2].map(|a| own.mirrored[a] && !lost[a]),
        turned: own.turned && !turn_is_lost,
        ..own
    }
}

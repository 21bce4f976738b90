//! A forecast of unknowns, memory and time of the box solver for the steps of a plan. A load may remove
//! mirror planes that the scene has at rest, so that steps are grouped by their symmetries.

use elastocap_case::Case;
use elastocap_electrostatics::{Effort, Forecast, SolveError, forecast, symmetries};
use elastocap_geometry::mirror::planes;
use elastocap_geometry::scene::Scene;

use super::electrostatics::is_by_boxes;
use super::steps::scene_at;
use super::{Options, Plan, PlannedStep};
use crate::route::Route;
use crate::scene::neutral::indenter_in_field;
use crate::settings::FieldSettings;

/// Largest number of steps that are examined, and largest product of that number and the number of bodies. Of
/// more steps, this many are examined at equal distances. Not tuned: what `check` may take.
const MAX_STEPS: usize = 64;
const MAX_BODIES: usize = 12_800;

/// The cost of boxes under a map over their cost without one: the largest values observed.
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
    /// The factors for a bent layer and bent electrodes, which need such a tensor, and whose map has to be
    /// computed first.
    const BENT: Self = Self { unknowns: 1, memory: 2, seconds: 20.0 };
    /// The factors for the narrow space under an indenter, which also needs finer grids and more iterations.
    const UNDER_INDENTER: Self = Self { unknowns: 2, memory: 8, seconds: 30.0 };

    fn of(case: &Case, step: &PlannedStep) -> Self {
        match step.route {
            Some(Route::MAPPED_BOXES) if step.pose.tilt != [0.0; 2] => Self::TILTED,
            Some(Route::MAPPED_BOXES) if indenter_in_field(case).is_some() => Self::UNDER_INDENTER,
            Some(Route::MAPPED_BOXES) => Self::BENT,
            _ => Self::NONE,
        }
    }

    fn times(self, forecast: Forecast) -> Forecast {
        Forecast {
            unknowns: self.unknowns * forecast.unknowns,
            memory_bytes: forecast.memory_bytes.saturating_mul(self.memory),
            seconds: self.seconds * forecast.seconds,
            unmirrored: (self.unknowns * forecast.unmirrored.0, self.seconds * forecast.unmirrored.1),
            ..forecast
        }
    }
}

/// Steps with the same symmetries under the same kind of map.
struct Group {
    symmetries: ([bool; 3], bool),
    map: MapFactors,
    /// The mirror planes that the load removes, known although the deformed scene is not.
    lost: [bool; 3],
    steps: usize,
    /// The scene of the last step: loads usually ascend, and the layer thins.
    scene: Scene,
}

impl Plan {
    /// The forecast of the box solver for one of its steps: the mean time, and the largest memory and number
    /// of unknowns; `None` without such a step.
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
        let steps: Vec<&PlannedStep> = self.solvable_steps().filter(by_boxes).collect();
        let most = (MAX_BODIES / case.bodies.len().max(1)).clamp(2, MAX_STEPS);
        let stride = steps.len().div_ceil(most).max(1);
        let mut groups: Vec<Group> = Vec::new();
        // In reverse, so that each group keeps the scene of its last step.
        for step in steps.iter().rev().step_by(stride) {
            // A step whose scene is refused fails without a solve.
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
            let at_rest = forecast(&group.scene, &settings.boxes(), &mut effort)?;
            let under_load = group.map.times(without(at_rest, group.lost));
            seconds += under_load.seconds * group.steps as f64;
            unmirrored += under_load.unmirrored.1 * group.steps as f64;
            memory = under_load.memory_bytes.max(memory);
            is_rough |= under_load.is_rough;
            if largest.as_ref().is_none_or(|most| most.unknowns < under_load.unknowns) {
                largest = Some(under_load);
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

/// The axes whose mirror planes a load removes in a layer by finite elements, of which only the scene at rest
/// is known: the top moves and the bottom does not, an indenter may stand beside the middle, and a map keeps
/// mirror planes only if they pass through the origin.
fn lost_under_load(case: &Case, scene: &Scene, step: &PlannedStep) -> [bool; 3] {
    let off_the_middle = match step.route {
        Some(Route::MAPPED_BOXES) => planes(scene).map(|plane| plane.is_some_and(|plane| plane.at != 0.0)),
        _ => [false; 3],
    };
    let indenter = case.mechanics.and_then(|mechanics| mechanics.indenter());
    let by_mechanics = indenter.map_or([false; 3], |(indenter, _)| [indenter.position() != 0.0, true, false]);
    [0, 1, 2].map(|a| by_mechanics[a] || off_the_middle[a])
}

/// The forecast for a scene without its mirror planes on the `lost` axes; without that of x1 or x3 it loses
/// its half turn, too.
fn without(forecast: Forecast, lost: [bool; 3]) -> Forecast {
    let turn_is_lost = forecast.turned && (lost[0] || lost[2]);
    let gone = (0..3).filter(|&a| lost[a] && forecast.mirrored[a]).count() + usize::from(turn_is_lost);
    let copies = 1_usize << gone;
    Forecast {
        unknowns: forecast.unknowns * copies,
        memory_bytes: forecast.memory_bytes.saturating_mul(copies as u64),
        // The exponent of other mirrored scenes: longer axes also cost more per unknown.
        seconds: forecast.seconds * (copies as f64).powf(4.0 / 3.0),
        mirrored: [0, 1, 2].map(|a| forecast.mirrored[a] && !lost[a]),
        turned: forecast.turned && !turn_is_lost,
        ..forecast
    }
}

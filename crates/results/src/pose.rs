//! The shift and tilt of steps: in words, and which steps a line may join.

use elastocap_case::Pose;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::words::prefixed;

use crate::csv::number;
use crate::typeset::quantity;

/// If more poses than this are beside the curve, they share one entry of the legend.
const MOST_ENTRIES: usize = 3;

/// The displacement of the attached bodies at a step, in addition to that by the load.
fn pose(outcome: &Outcome, step: &StepResult) -> Pose {
    outcome.plan.steps.get(step.index).map(|planned| planned.pose).unwrap_or_default()
}

/// The shift and the tilt of a step, such as `shift 100 µm along x1, tilt 0.2° about x3`; `None` if it has
/// neither.
pub(crate) fn of_step(outcome: &Outcome, step: &StepResult) -> Option<String> {
    in_words(&pose(outcome, step))
}

fn in_words(pose: &Pose) -> Option<String> {
    words(pose, |x| quantity(x, 3, "m"), "\u{b0}")
}

/// The shift and the tilt of a pose in ASCII, for a terminal, such as `shift 100 um along x1, tilt 0.2 deg
/// about x3`; `None` if it has neither.
pub(crate) fn in_plain_words(pose: &Pose) -> Option<String> {
    words(pose, |x| prefixed(x, 3, "m"), " deg")
}

/// The shift and the tilt of a pose, given how a length is written and the symbol of degrees.
fn words(pose: &Pose, length: impl Fn(f64) -> String, degrees: &str) -> Option<String> {
    let angle = |x: f64| format!("{}{degrees}", number((1e4 * x.to_degrees()).round() / 1e4));
    let shift = parts(pose.shift, length, ["along x1", "along x3"]);
    let tilt = parts(pose.tilt, angle, ["about x3", "about x1"]);
    let words = [("shift", shift), ("tilt", tilt)];
    let words = words.into_iter().filter(|(_, parts)| !parts.is_empty());
    let words: Vec<String> = words.map(|(word, parts)| format!("{word} {}", parts.join(" and "))).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// The nonzero ones of two values, in words, each with its axis.
fn parts(values: [f64; 2], shown: impl Fn(f64) -> String, axes: [&str; 2]) -> Vec<String> {
    let nonzero = values.into_iter().zip(axes).filter(|(value, _)| *value != 0.0);
    nonzero.map(|(value, axis)| format!("{} {axis}", shown(value))).collect()
}

/// The position of a step in the outcome, and its coordinate on the horizontal axis of a chart.
pub(crate) type Place = (usize, f64);

/// Steps of a chart by how they are shifted and tilted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ByPose {
    /// The steps that a line may join, since they differ in the load or the distance alone: the steps without
    /// shift and tilt, or, if there are none, those with the pose of the first step.
    pub(crate) curve: Vec<Place>,
    /// The other steps, in groups with their words for a legend: one for each pose, or one for all of them if
    /// there are more than [`MOST_ENTRIES`] poses.
    pub(crate) beside: Vec<(String, Vec<Place>)>,
}

/// The pose without its distance.
fn without_distance(pose: Pose) -> Pose {
    Pose { distance: 0.0, ..pose }
}

/// Which poses belong to the curve: those without shift and tilt, or, if there are none, those with the shift
/// and tilt of the first one.
pub(crate) fn on_curve(poses: &[Pose]) -> Vec<bool> {
    let aligned = poses.iter().any(Pose::is_aligned);
    let of_curve = poses.first().filter(|_| !aligned).copied().map(without_distance).unwrap_or_default();
    poses.iter().map(|pose| without_distance(*pose) == of_curve).collect()
}

/// Sorts steps by their poses; steps of one pose keep their order.
pub(crate) fn by_pose(outcome: &Outcome, places: &[Place]) -> ByPose {
    let pose = |(k, _): &Place| {
        outcome.steps.get(*k).map(|step| without_distance(pose(outcome, step))).unwrap_or_default()
    };
    let poses: Vec<Pose> = places.iter().map(pose).collect();
    let mut sorted = ByPose { curve: Vec::new(), beside: Vec::new() };
    let mut beside: Vec<(Pose, Vec<Place>)> = Vec::new();
    for ((place, pose), on_curve) in places.iter().zip(&poses).zip(on_curve(&poses)) {
        match beside.iter_mut().find(|(other, _)| other == pose) {
            _ if on_curve => sorted.curve.push(*place),
            Some((_, places)) => places.push(*place),
            None => beside.push((*pose, vec![*place])),
        }
    }
    sorted.beside = match beside.len() {
        0..=MOST_ENTRIES => {
            let named = |(pose, places)| (in_words(&pose).unwrap_or_default(), places);
            beside.into_iter().map(named).collect()
        }
        _ => {
            let aligned = poses.iter().any(Pose::is_aligned);
            let name = if aligned { "shifted or tilted" } else { "shifted or tilted otherwise" };
            vec![(name.to_owned(), beside.into_iter().flat_map(|(_, places)| places).collect())]
        }
    };
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_moved_is_left_out_of_the_words() {
        let pose = |shift, tilt: [f64; 2]| Pose { distance: 0.0, shift, tilt: tilt.map(f64::to_radians) };
        assert_eq!(in_words(&pose([0.0; 2], [0.0; 2])), None);
        assert_eq!(in_words(&pose([1e-4, 0.0], [0.0; 2])).unwrap(), "shift 100\u{a0}\u{b5}m along x1");
        assert_eq!(
            in_plain_words(&pose([-1e-4, 5e-5], [0.0, 0.2])).unwrap(),
            "shift -100 um along x1 and 50.0 um along x3, tilt 0.2 deg about x1"
        );
    }

    #[test]
    fn a_curve_is_of_aligned_steps_or_of_those_like_the_first() {
        let shifted = |x| Pose { shift: [x, 0.0], ..Pose::default() };
        let near = Pose { distance: 1e-3, ..Pose::default() };
        assert_eq!(on_curve(&[shifted(1e-4), Pose::default(), near]), [false, true, true]);
        assert_eq!(on_curve(&[shifted(1e-4), shifted(2e-4), shifted(1e-4)]), [true, false, true]);
        assert!(on_curve(&[]).is_empty());
    }
}

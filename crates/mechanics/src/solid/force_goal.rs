//! The displacement of the indenter that gives a force.

use super::layer_step::LayerStep;
use super::newton::{NewtonSettings, StopReason, Stopped};

/// The largest number of displacements to try. Not tuned: a limit that ordinary cases do not reach.
const MAX_TRIES: usize = 60;
/// The relative error of the force that is accepted if no try comes nearer: with stiff inclusions, forces
/// vary by more than 1e-10 from rounding alone. It is not tuned.
const ACCEPTED: f64 = 1e-6;
/// The relative distance from the goal up to which the first displacement is tried with the slope of the line
/// from rest. Tuned:
/// `time elastocap run cases/comb-on-board.toml`.
pub(super) const NEAR: f64 = 0.1;

/// A function that presses a layer to a displacement of the indenter, given over the thickness.
type Press<'a> = dyn FnMut(f64, &NewtonSettings) -> Result<LayerStep, Box<Stopped>> + 'a;

/// Calls `press` with one displacement of the indenter, over the thickness, after the other until the force
/// on the *whole* layer is `target` (N, in the plane N per metre of width) to a relative `tolerance`. `last`
/// is the step from which the layer starts.
///
/// The next displacement follows from secants, and is kept between one that is too small and one that is too
/// large. Where the force has fallen as the displacement grew, as on the way to another equilibrium, it is
/// taken from the straight line between those two, and if that happens again, halfway between them.
///
/// # Errors
/// [`Stopped`], if `press` stops or the force is not met.
pub(super) fn meet_force(
    target: f64,
    tolerance: f64,
    settings: &NewtonSettings,
    mut last: LayerStep,
    press: &mut Press<'_>,
) -> Result<LayerStep, Box<Stopped>> {
    let mut low = (last.compression, last.force - target);
    let mut high: Option<(f64, f64)> = None;
    let mut slope = None;
    if low.1 > 0.0 {
        high = Some(low);
        low = (0.0, -target);
    }
    if last.force > 0.0 && low.1.abs().min(high.map_or(f64::INFINITY, |h| h.1)) < NEAR * target {
        // A layer becomes stiffer as it is pressed, so that this slope is rather too small. For such a short
        // way it is good enough.
        slope = Some(last.force / last.compression);
    }
    // The settings with the number of linear systems that are left.
    let mut left = *settings;
    // Whether the last displacement was interpolated between two others for lack of a slope.
    let mut on_chord = false;
    for _ in 0..MAX_TRIES {
        let miss = last.force - target;
        if miss.abs() <= tolerance * target.abs() || target == 0.0 && miss == 0.0 {
            return Ok(last);
        }
        let newton = slope.map(|s: f64| last.compression - miss / s).filter(|c: &f64| c.is_finite());
        let next = match high {
            Some(high) => {
                let inside = |c: &f64| *c > low.0 && *c < high.0;
                let chord = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
                let guess = newton.or((!on_chord).then_some(chord)).filter(inside);
                on_chord = newton.is_none();
                guess.unwrap_or(0.5 * (low.0 + high.0))
            }
            // No displacement above the goal is known yet: steps are limited, and stay short of a closed
            // layer.
            None => {
                let highest = low.0 + (0.1_f64).min(0.5 * (1.0 - low.0));
                newton.unwrap_or(low.0 + 0.01).clamp(low.0 + 1e-12, highest)
            }
        };
        let before = last;
        last = press(next, &left)?;
        left.max_solves = left.max_solves.saturating_sub(last.effort.solves);
        let miss = last.force - target;
        if miss < 0.0 {
            low = (last.compression, miss)
        } else {
            high = Some((last.compression, miss))
        }
        let moved = last.compression - before.compression;
        if moved != 0.0 {
            slope = Some((last.force - before.force) / moved).filter(|s| *s > 0.0);
        }
        if high.is_some_and(|h| h.0 - low.0 <= 1e-13 * h.0) {
            break;
        }
    }
    if (last.force - target).abs() <= ACCEPTED.max(tolerance) * target.abs() {
        return Ok(last);
    }
    let effort = last.effort;
    let (reason, smallest_j) = (StopReason::NoConvergence, effort.smallest_j);
    Err(Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j, element: 0, effort }))
}

#[cfg(test)]
mod tests {
    use super::super::newton::Effort;
    use super::*;

    fn step(compression: f64, force: f64) -> LayerStep {
        let effort = Effort::default();
        LayerStep { compression, force, end_contact_force: 0.0, imbalance: 0.0, penetration: 0.0, effort }
    }

    #[test]
    fn a_force_that_falls_while_the_displacement_grows_does_not_send_the_search_far_away() {
        // The first equilibrium is on another branch than those that follow from it, as on coarse meshes at a
        // corner.
        let start = step(0.1911, 4010.1);
        let mut tried = Vec::new();
        let press = &mut |compression: f64, _: &NewtonSettings| {
            tried.push(compression);
            Ok(step(compression, 4022.5 + 22_000.0 * (compression - 0.190_607)))
        };
        let found = meet_force(4000.0, 1e-10, &NewtonSettings::default(), start, press).unwrap();
        assert!((found.force / 4000.0 - 1.0).abs() < 1e-9, "{found:?}");
        assert!(tried.len() < 8 && tried.iter().all(|c| (c / 0.19 - 1.0).abs() < 0.02), "{tried:?}");
    }
}

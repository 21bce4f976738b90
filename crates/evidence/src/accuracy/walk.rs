//! Chooses the grids to try: those along the boundary between grids that meet the tolerance and grids that do
//! not.
//!
//! Higher order and more layers both cost time and reduce the error, so in the plane of order and layers the
//! grids that meet a tolerance lie above a staircase, with the fastest of them on it. The walk follows the
//! staircase both ways from a given grid.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use elastocap_electrostatics::ResolutionLevel;

/// The result on one grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trial {
    pub(super) seconds: f64,
    /// The error that the solver compares with the tolerance.
    pub(super) reported_error: f64,
}

/// Grids expected to take more than this times the fastest one that meets the tolerance are not tried. The
/// factor leaves room for errors of the time forecast. Tuned: `elastocap accuracy cases/in-plane-pair.toml`.
const WORTH: f64 = 1.6;
/// The orders to try. Error estimates compare with the next lower order, so they mean nothing below order 2.
/// It is not tuned.
pub(super) const ORDERS: RangeInclusive<usize> = 2..=14;
/// The numbers of layers to try. It is not tuned.
pub(super) const LEVELS: RangeInclusive<usize> = 1..=10;

/// Tries grids around the staircase, from `start` on, and returns the result on each of them.
///
/// `expected` gives the expected seconds of a grid in any unit, or `None` for an impossible grid; `attempt`
/// solves on it, or returns `None` if the walk must end.
pub(super) fn walk(
    start: ResolutionLevel,
    tolerance: f64,
    expected: &dyn Fn(ResolutionLevel) -> Option<f64>,
    attempt: &mut dyn FnMut(ResolutionLevel) -> Option<Trial>,
) -> Vec<(ResolutionLevel, Trial)> {
    let mut walk = Walk { tried: BTreeMap::new(), tolerance, expected, attempt, scale: None };
    let _ = walk.follow_staircase(start);
    walk.tried.into_iter().collect()
}

/// A walk in progress.
struct Walk<'a> {
    /// The result on each grid so far.
    tried: BTreeMap<ResolutionLevel, Trial>,
    tolerance: f64,
    expected: &'a dyn Fn(ResolutionLevel) -> Option<f64>,
    attempt: &'a mut dyn FnMut(ResolutionLevel) -> Option<Trial>,
    /// The ratio of the measured to the expected seconds of the last grid.
    scale: Option<f64>,
}

/// The signal that the walk must end, since `attempt` solves no more.
struct Halt;

impl Walk<'_> {
    /// Climbs from `start` to a grid that meets the tolerance, in three steps at most, and follows the
    /// staircase from there to more and to fewer layers.
    fn follow_staircase(&mut self, start: ResolutionLevel) -> Result<(), Halt> {
        let mut at = start;
        let mut climbs = 0;
        while self.meets(at)? != Some(true) {
            climbs += 1;
            if climbs > 3 {
                return Ok(());
            }
            if climbs % 2 == 0 { at.order += 1 } else { at.levels += 1 }
        }
        let Some(first) = self.lowest_order(at)? else { return Ok(()) };
        for direction in [1, -1] {
            let (mut order, mut levels) = (first, at.levels);
            while let Some(next) = levels.checked_add_signed(direction).filter(|l| LEVELS.contains(l)) {
                levels = next;
                // More layers allow for a lower order, fewer layers need a higher one.
                let from = if direction > 0 { (order - 1).max(*ORDERS.start()) } else { order };
                match self.lowest_order(ResolutionLevel { order: from, levels })? {
                    Some(lowest) => order = lowest,
                    None => break,
                }
            }
        }
        Ok(())
    }

    /// The lowest order that meets the tolerance with this number of layers, searched from the given order;
    /// `None` if none seems to, or grids that would are not worth trying.
    fn lowest_order(&mut self, from: ResolutionLevel) -> Result<Option<usize>, Halt> {
        let mut at = from;
        while self.meets(at)? == Some(false) {
            if self.is_hopeless(at) {
                return Ok(None);
            }
            at.order += 1;
        }
        if self.meets(at)?.is_none() {
            return Ok(None);
        }
        loop {
            let lower = ResolutionLevel { order: at.order - 1, ..at };
            match self.meets(lower)? {
                Some(true) => at = lower,
                _ => return Ok(Some(at.order)),
            }
        }
    }

    /// Whether a grid meets the tolerance; `None` if it is not worth trying.
    fn meets(&mut self, at: ResolutionLevel) -> Result<Option<bool>, Halt> {
        if let Some(trial) = self.tried.get(&at) {
            return Ok(Some(trial.reported_error <= self.tolerance));
        }
        if !ORDERS.contains(&at.order) || !LEVELS.contains(&at.levels) {
            return Ok(None);
        }
        let Some(expected) = (self.expected)(at) else { return Ok(None) };
        let sufficient = self.tried.values().filter(|t| t.reported_error <= self.tolerance);
        let fastest = sufficient.map(|t| t.seconds).reduce(f64::min);
        if let (Some(fastest), Some(scale)) = (fastest, self.scale)
            && scale * expected > WORTH * fastest
        {
            return Ok(None);
        }
        let trial = (self.attempt)(at).ok_or(Halt)?;
        if trial.seconds.is_finite() {
            self.scale = Some(trial.seconds / expected);
        }
        self.tried.insert(at, trial);
        Ok(Some(trial.reported_error <= self.tolerance))
    }

    /// Whether no higher order is expected to meet the tolerance, if each gains as much as the last one did:
    /// with too few layers the gain of one more order becomes small.
    fn is_hopeless(&self, at: ResolutionLevel) -> bool {
        let reported_error =
            |order| self.tried.get(&ResolutionLevel { order, ..at }).map(|trial| trial.reported_error);
        let (Some(now), Some(before)) = (reported_error(at.order), reported_error(at.order - 1)) else {
            return false;
        };
        let left = ORDERS.end().saturating_sub(at.order) as i32;
        now * (now / before).powi(left) > self.tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(order: usize, levels: usize) -> ResolutionLevel {
        ResolutionLevel { order, levels }
    }

    fn error(at: ResolutionLevel) -> f64 {
        0.2_f64.powi(at.order as i32) + 0.13_f64.powi(at.levels as i32)
    }

    fn seconds(at: ResolutionLevel) -> f64 {
        ((at.order + 2) as f64 * (at.levels + 1) as f64).powi(3)
    }

    fn trial(at: ResolutionLevel) -> Trial {
        Trial { seconds: seconds(at), reported_error: error(at) }
    }

    /// The seconds of the fastest grid that meets the tolerance.
    fn fastest(tried: &[(ResolutionLevel, Trial)], tolerance: f64) -> Option<f64> {
        tried.iter().filter(|(_, t)| t.reported_error <= tolerance).map(|(_, t)| t.seconds).reduce(f64::min)
    }

    #[test]
    fn the_fastest_grid_of_all_is_among_those_tried_wherever_the_walk_begins() {
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
            let grids = ORDERS.flat_map(|order| LEVELS.map(move |levels| level(order, levels)));
            let best = grids.filter(|at| error(*at) <= tolerance).map(seconds).fold(f64::INFINITY, f64::min);
            for start in [level(5, 3), level(9, 6), level(7, 5), level(10, 7)] {
                let tried = walk(start, tolerance, &|at| Some(1e-3 * seconds(at)), &mut |at| Some(trial(at)));
                if let Some(found) = fastest(&tried, tolerance) {
                    assert_eq!(found, best, "tolerance {tolerance} from {start:?}");
                } else {
                    assert!(error(start) > 3.0 * tolerance, "tolerance {tolerance} from {start:?}");
                }
                assert!(tried.len() < 40, "{} grids", tried.len());
            }
        }
    }

    #[test]
    fn both_sides_of_the_line_are_tried() {
        let tried = walk(level(7, 5), 1e-4, &|at| Some(seconds(at)), &mut |at| Some(trial(at)));
        assert!(
            tried.iter().any(|(_, t)| t.reported_error <= 1e-4)
                && tried.iter().any(|(_, t)| t.reported_error > 1e-4)
        );
        let orders: std::collections::BTreeSet<_> = tried.iter().map(|(at, _)| at.order).collect();
        let levels: std::collections::BTreeSet<_> = tried.iter().map(|(at, _)| at.levels).collect();
        assert!(orders.len() > 2 && levels.len() > 1, "{orders:?} {levels:?}");
    }

    #[test]
    fn the_walk_ends_when_it_must_and_keeps_what_it_has() {
        let mut left = 2;
        let tried = walk(level(7, 5), 1e-4, &|at| Some(seconds(at)), &mut |at| {
            left -= 1;
            (left >= 0).then(|| trial(at))
        });
        assert_eq!(tried.len(), 2);
    }

    #[test]
    fn a_tolerance_that_nothing_meets_ends_the_walk() {
        let tried = walk(level(3, 2), 1e-4, &|_| Some(1.0), &mut |_| {
            Some(Trial { seconds: 1.0, reported_error: 1.0 })
        });
        assert_eq!(tried.len(), 4);
    }

    #[test]
    fn orders_that_gain_nothing_for_want_of_layers_are_not_tried() {
        let tried =
            walk(level(7, 5), 1e-4, &|_| Some(1.0), &mut |at| Some(Trial { seconds: 1.0, ..trial(at) }));
        let of_four_layers = tried.iter().filter(|(at, _)| at.levels == 4 && at.order > 7).count();
        assert!(of_four_layers < 3, "{tried:?}");
    }
}

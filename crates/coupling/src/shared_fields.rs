//! Field solutions that several cases share: a sweep of a modulus at given compressions changes forces, but
//! not the bodies.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, PoisonError};

use elastocap_electrostatics::{Settings, Solution, SolveError};
use elastocap_geometry::scene::Scene;

/// Largest number of stored solutions, beyond which the oldest is discarded. One takes a few kilobytes,
/// including its key. Not tuned: a limit that ordinary cases do not reach.
const MAX_SOLUTIONS: usize = 4096;

/// Solutions of scenes of boxes, by everything on which they depend, so that a result is the same whether or
/// not it is taken from here.
#[derive(Debug, Default)]
pub struct SharedFields(Mutex<Solutions>);

#[derive(Debug, Default)]
struct Solutions {
    by_scene: HashMap<String, Solution>,
    oldest_first: VecDeque<String>,
    hits: usize,
}

impl SharedFields {
    /// The number of solves that were saved so far.
    pub fn spared(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).hits
    }

    /// The solution of a scene: a stored one, or that of `solve`.
    ///
    /// # Errors
    /// The errors of `solve`, which are not stored.
    pub(crate) fn get_or_solve(
        &self,
        scene: &Scene,
        settings: &Settings,
        solve: impl FnOnce(&Scene, &Settings) -> Result<Solution, SolveError>,
    ) -> Result<Solution, SolveError> {
        // Fields are too large to store, and runs of many cases do not request them.
        if settings.field {
            return solve(scene, settings);
        }
        // The Debug format of a number determines it uniquely.
        let Settings { relative_tolerance, least_scale, accepted, target, target_alone, .. } = settings;
        let Settings { bounds, symmetry, resolution, foresight, .. } = settings;
        let key = format!(
            "{scene:?} {relative_tolerance:?} {least_scale:?} {accepted} {target:?} {target_alone} {bounds} {symmetry} {resolution:?} {foresight:?}"
        );
        {
            let mut solutions = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(solution) = solutions.by_scene.get(&key).cloned() {
                solutions.hits += 1;
                return Ok(Solution { seconds: Default::default(), ..solution });
            }
        }
        let solution = solve(scene, settings)?;
        // A solve that was limited by memory or cancelled does not depend on the scene alone.
        if solution.reached {
            let mut solutions = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if solutions.by_scene.len() >= MAX_SOLUTIONS
                && let Some(oldest) = solutions.oldest_first.pop_front()
            {
                solutions.by_scene.remove(&oldest);
            }
            if solutions.by_scene.insert(key.clone(), solution.clone()).is_none() {
                solutions.oldest_first.push_back(key);
            }
        }
        Ok(solution)
    }
}

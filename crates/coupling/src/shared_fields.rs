//! Fields that several cases have in common: a sweep of a modulus at given compressions moves the force and leaves the bodies where they are.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, PoisonError};

use elastocap_electrostatics::{Settings, Solution, SolveError};
use elastocap_geometry::scene::Scene;

/// Solutions that are kept at most; the oldest gives way. One has some kilobytes, with the text that it is found by.
const MAX_KEPT: usize = 4096;

/// Solutions of scenes of boxes, by all that they depend on. A solution is a function of that alone, so that a result does not depend on
/// whether it was found here.
#[derive(Debug, Default)]
pub struct SharedFields(Mutex<Kept>);

#[derive(Debug, Default)]
struct Kept {
    by_scene: HashMap<String, Solution>,
    oldest_first: VecDeque<String>,
    found: usize,
}

impl SharedFields {
    /// How many solves were spared so far.
    pub fn spared(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).found
    }

    /// The solution of a scene: one that is kept, or that of `solve`.
    ///
    /// # Errors
    /// The errors of `solve`, which are not kept.
    pub(crate) fn get_or_solve(
        &self,
        scene: &Scene,
        settings: &Settings,
        solve: impl FnOnce(&Scene, &Settings) -> Result<Solution, SolveError>,
    ) -> Result<Solution, SolveError> {
        // Fields are too large to keep, and nobody asks for them where many cases are solved.
        if settings.field {
            return solve(scene, settings);
        }
        // Debug writes every number so that it reads back as the same one.
        let Settings { relative_tolerance, least_scale, accepted, target, target_alone, .. } = settings;
        let Settings { bounds, symmetry, resolution, foresight, .. } = settings;
        let key = format!(
            "{scene:?} {relative_tolerance:?} {least_scale:?} {accepted} {target:?} {target_alone} {bounds} {symmetry} {resolution:?} {foresight:?}"
        );
        {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(solution) = kept.by_scene.get(&key).cloned() {
                kept.found += 1;
                return Ok(Solution { seconds: Default::default(), ..solution });
            }
        }
        let solution = solve(scene, settings)?;
        // What memory or a cancelled run has cut short is not what the scene gives by itself.
        if solution.reached {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if kept.by_scene.len() >= MAX_KEPT
                && let Some(oldest) = kept.oldest_first.pop_front()
            {
                kept.by_scene.remove(&oldest);
            }
            if kept.by_scene.insert(key.clone(), solution.clone()).is_none() {
                kept.oldest_first.push_back(key);
            }
        }
        Ok(solution)
    }
}

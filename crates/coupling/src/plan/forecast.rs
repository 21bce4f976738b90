//! What a plan for tetrahedra will take: not known before the scene is meshed, so that it is asked for apart.

use super::layer::may_bend;
use super::{Options, Plan};
use crate::scene::DeformedScene;
use crate::tetrahedra::foretell;
use elastocap_case::Case;

/// What bent electrodes take over straight ones, at most: as observed, two to three and a half times as many unknowns; and at least,
/// since the first mesh that follows them has 60 to 170 thousand already.
const BENT: f64 = 3.5;
const LEAST_UNKNOWNS: usize = 200_000;
const LEAST_BYTES: u64 = 300_000_000;
const LEAST_SECONDS: f64 = 2.0;

impl Plan {
    /// Foretells what tetrahedra take, which the plan does not: the scene is meshed, and solved on a small mesh. Scenes for the
    /// solver for boxes are foretold by the plan already. Electrodes that may bend count as at rest
    /// on tetrahedra, three and a half times.
    ///
    /// # Errors
    /// Why the scene cannot be meshed or solved.
    pub fn foretell(&mut self, case: &Case, options: &Options) -> Result<(), String> {
        let bends = may_bend(case) && !self.on_tetrahedra(case);
        if !(bends || self.on_tetrahedra(case)) {
            return Ok(());
        }
        let Some(DeformedScene { scene, .. }) = self.scene_at_first(case, options) else { return Ok(()) };
        let distinct = self.distinct_steps().filter(|s| s.failure.is_none()).count() as f64;
        let own = match foretell(&scene, case.mesh.as_ref(), &self.solver_settings(case, options)) {
            Ok(own) => own,
            // The layer bent may have a mesh where the one at rest has none.
            Err(_) if bends => return Ok(()),
            Err(error) => return Err(error),
        };
        if bends {
            self.unknowns = ((BENT * own.unknowns as f64) as usize).max(LEAST_UNKNOWNS);
            self.memory_bytes = ((BENT * own.memory_bytes as f64) as u64).max(LEAST_BYTES);
            self.seconds += (BENT * own.seconds).max(LEAST_SECONDS) * distinct;
            return Ok(());
        }
        self.unknowns = own.unknowns;
        self.memory_bytes = own.memory_bytes;
        self.seconds = own.seconds * distinct;
        self.mirrored = own.mirrored;
        Ok(())
    }
}

//! What a plan for tetrahedra will take: not known before the scene is meshed, so that it is asked for apart.

use crate::case::Case;
use crate::plan::{Options, Plan};
use crate::shaped::foretell;

impl Plan {
    /// Foretells what tetrahedra take, which the plan does not: the scene is meshed, and solved on a small mesh. Scenes for the
    /// solver for boxes are foretold by the plan already.
    ///
    /// # Errors
    /// Why the scene cannot be meshed or solved.
    pub fn foretell(&mut self, case: &Case, options: &Options) -> Result<(), String> {
        let boxes = self.on_tetrahedra(case).then(|| self.scene_on_tetrahedra(case, options)).flatten();
        let Some(scene) = case.shapes.as_ref().or(boxes.as_ref()) else { return Ok(()) };
        let own = foretell(scene, case.mesh.as_ref(), &self.solver_settings(case, options))?;
        let distinct = self.distinct_steps().filter(|s| s.failure.is_none()).count();
        self.unknowns = own.unknowns;
        self.memory_bytes = own.memory_bytes;
        self.seconds = own.seconds * distinct as f64;
        self.mirrored = own.mirrored;
        Ok(())
    }
}

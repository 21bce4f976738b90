//! The field of one step on its route: boxes, boxes under a map, outlines, or the scene that is left to
//! tetrahedra.

use std::sync::Arc;

use elastocap_case::FieldSolver;
use elastocap_electrostatics::{
    ExtrudedSolution, MeshSolution, Settings, Solution, SolveError, solve, solve_extruded, solve_mapped,
};
use elastocap_geometry::export::surfaces::SurfaceBody;
use elastocap_geometry::scene::Scene;

use super::Solver;
use crate::deform::{Deformation, Displacement};
use crate::failure::{StepFailure, Stop};
use crate::layer_outlines::{LayerScene, Sides, outlined};
use crate::mapped::{BentScene, Films, LayerSolution, bent_scene};
use crate::plan::PlannedStep;
use crate::route::{Route, SolvedShape, asked};
use crate::route_change::{NoBase, RouteChange};
use crate::scene::DeformedScene;
use crate::scene::neutral::indenter_in_field;
use crate::tetrahedra::Solved;
use crate::view::window;

/// A field that is solved, or the scene of one that is yet to be.
pub(super) enum Fields {
    /// Solved as boxes.
    Boxes(Box<Solution>),
    /// Solved as boxes under a map.
    Mapped {
        found: Box<Solution>,
        /// The estimated relative error that the map leaves.
        deviation: f64,
        /// The estimated relative error for a surface that is taken as level where the map ends.
        beyond: f64,
        /// The bent bodies for a viewer.
        surfaces: Vec<SurfaceBody>,
    },
    /// Yet to be solved as outlines or other shapes.
    Shapes(LayerScene),
}

impl Solver<'_> {
    /// The field of a step on its route, or the scene for the solver on tetrahedra. A change of the route is
    /// added to `changes`.
    pub(super) fn fields(
        &self,
        taken: Route,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
        changes: &mut Vec<RouteChange>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        match (taken.shape(), taken.solver()) {
            (SolvedShape::Mapped, _) => self.under_map(step, deformed, state, changes),
            (SolvedShape::Outlines, FieldSolver::Extruded) => {
                Ok(Fields::Shapes(self.outlines(deformed, state, Sides::Curves)?))
            }
            (SolvedShape::Outlines, _) => {
                Ok(Fields::Shapes(self.outlines(deformed, state, Sides::Polygons)?))
            }
            (SolvedShape::Straight, FieldSolver::Boxes) => {
                let found = match &self.settings.shared {
                    Some(shared) => shared.get_or_solve(&deformed.scene, &settings, solve)?,
                    None => solve(&deformed.scene, &settings)?,
                };
                Ok(Fields::Boxes(Box::new(found)))
            }
            (SolvedShape::Straight, FieldSolver::Extruded | FieldSolver::Tetrahedra) => {
                Ok(Fields::Shapes(LayerScene::of_boxes(deformed)))
            }
        }
    }

    /// A scene of outlines by the solver for them.
    pub(super) fn extruded(&self, scene: &Scene) -> Result<Solved, SolveError> {
        let ExtrudedSolution { solution, turn, planes, field } =
            solve_extruded(scene, &self.settings.boxes())?;
        let (mesh, potentials) = field.unwrap_or_default();
        let found = MeshSolution { mesh, potentials, solution };
        Ok(Solved { found, turn, planes, surfaces: Vec::new(), facets: 0.0 })
    }

    /// The solution that the solver for outlines `found`. `None` where it cannot take the scene, tetrahedra
    /// may serve, and nobody asked for that solver; `changes` then says so.
    pub(super) fn or_tetrahedra(
        &self,
        found: Result<Solved, SolveError>,
        changes: &mut Vec<RouteChange>,
    ) -> Result<Option<Solved>, Stop> {
        match found {
            Ok(found) => Ok(Some(found)),
            Err(error)
                if error.another_solver_may_serve() && asked(self.case) != Some(FieldSolver::Extruded) =>
            {
                changes.push(RouteChange::Tetrahedra(error));
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The displacement of a layer by finite elements in this state.
    fn displacement(&self, step: &PlannedStep, state: Option<&Deformation<'_>>) -> Option<Displacement<'_>> {
        let Some(Deformation::FiniteElement(layer)) = state else { return None };
        self.layer.displacement(step.index, layer.mesh)
    }

    /// The scene of a step under its map, with the film that is tried first.
    pub(super) fn first_bent(
        &self,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
    ) -> Option<BentScene> {
        let (Some(Deformation::FiniteElement(layer)), Some(displacement)) =
            (state, self.displacement(step, state))
        else {
            return None;
        };
        let found = LayerSolution { step: layer, displacement: &displacement, pose: &step.pose };
        let film = Films::new(self.case, self.settings.relative_tolerance).next()?;
        bent_scene(self.case, deformed, &found, film).ok()?
    }

    /// The field of a scene under its map: added to that of the base, where that is possible and enough.
    fn mapped(
        &self,
        bent: &BentScene,
        settings: &Settings,
        changes: &mut Vec<RouteChange>,
    ) -> Result<Solution, Stop> {
        let Some(base) = self.base else { return mapped(bent, settings) };
        match base.add(bent, settings) {
            Ok(found) => Ok(found),
            Err(NoBase::Solve(error)) if !error.another_solver_may_serve() => Err(error.into()),
            Err(why) => {
                let found = mapped(bent, settings)?;
                changes.push(RouteChange::WithoutBase(why));
                Ok(found)
            }
        }
    }

    /// Boxes under the map that bends or tilts them.
    fn under_map(
        &self,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
        changes: &mut Vec<RouteChange>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        if let Some(map) = &deformed.tilt {
            let bent = BentScene {
                scene: deformed.scene.clone(),
                map: Arc::clone(map),
                deviation: 0.0,
                film_error: 0.0,
                beyond: 0.0,
            };
            let found = Box::new(mapped(&bent, &settings)?);
            let surfaces = bent.surfaces(&window(&[deformed]));
            return Ok(Fields::Mapped { found, deviation: 0.0, beyond: 0.0, surfaces });
        }
        let is_pressed_in_field = indenter_in_field(self.case).is_some();
        let (Some(Deformation::FiniteElement(layer)), Some(displacement)) =
            (state, self.displacement(step, state))
        else {
            return Err(StepFailure::NoMap.into());
        };
        let found = LayerSolution { step: layer, displacement: &displacement, pose: &step.pose };
        let mut films = Films::new(self.case, self.settings.relative_tolerance);
        loop {
            let Some(film) = films.next() else { return Err(StepFailure::NoMap.into()) };
            let bent = match bent_scene(self.case, deformed, &found, film) {
                Ok(Some(bent)) => bent,
                Ok(None) if is_pressed_in_field => {
                    films.make_thicker();
                    continue;
                }
                Ok(None) => return Err(StepFailure::NoMap.into()),
                Err(error) => return Err(error.into()),
            };
            if films.made_thinner(bent.film_error) {
                continue;
            }
            match self.mapped(&bent, &settings, changes) {
                Ok(found) => {
                    let surfaces = bent.surfaces(&window(&[deformed]));
                    let found = Box::new(found);
                    let BentScene { deviation, beyond, .. } = bent;
                    return Ok(Fields::Mapped { found, deviation, beyond, surfaces });
                }
                // Only the film of an indenter can be chosen.
                Err(Stop::Failed(failure)) => match *failure {
                    StepFailure::Field(SolveError::InsideOut | SolveError::TornMap)
                        if is_pressed_in_field =>
                    {
                        films.make_thicker();
                    }
                    failure => return Err(failure.into()),
                },
                Err(Stop::Cancelled) => return Err(Stop::Cancelled),
            }
        }
    }

    /// Electrodes and layer in their own outlines.
    pub(super) fn outlines(
        &self,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
        sides: Sides,
    ) -> Result<LayerScene, Stop> {
        match state {
            Some(Deformation::FiniteElement(layer)) => {
                let covers_all = self.case.mechanics.is_some_and(|mechanics| mechanics.covers_all());
                let at_rest = self.case.layer.as_ref().filter(|_| !covers_all).map(|own| own.thickness);
                let flat = at_rest.unwrap_or(layer.deformed_thickness);
                Ok(outlined(deformed, &layer.curves, flat, self.settings.relative_tolerance, sides)?)
            }
            // Nothing but finite elements bends anything.
            Some(Deformation::ClosedForm(_) | Deformation::Foam(_)) | None => {
                Ok(LayerScene::of_boxes(deformed))
            }
        }
    }
}

/// The boxes of a scene under the map that bends them.
fn mapped(bent: &BentScene, settings: &Settings) -> Result<Solution, Stop> {
    Ok(solve_mapped(&bent.scene, &bent.map, settings)?)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::deform::Prepared;
    use crate::plan::{Options, Plan};

    const DISCS: &str = r#"
        format = 1
        [[conductor]]
        name = "a"
        cylinder = { axis = "x2", base = ["0 mm", "0 mm", "0 mm"], radius = "1 mm", height = "0.1 mm" }
        [[conductor]]
        name = "b"
        cylinder = { axis = "x2", base = ["0 mm", "1 mm", "0 mm"], radius = "1 mm", height = "0.1 mm" }
        [surroundings]
        boundary = "open"
    "#;

    /// What becomes of an error of the solver for outlines: whether tetrahedra follow, with how many changes
    /// of the route, or the failure.
    fn after(error: SolveError, text: &str) -> (Result<bool, StepFailure>, usize) {
        let case = elastocap_case::parse(text, Path::new("discs.toml")).unwrap();
        let options = Options::default();
        let settings = Plan::new(&case, &options).solver_settings(&case, &options);
        let layer = Prepared::StepByStep;
        let solver = Solver {
            case: &case,
            settings,
            prune: true,
            force_limit: None,
            layer: &layer,
            coarser: 0,
            base: None,
        };
        let mut changes = Vec::new();
        let went = match solver.or_tetrahedra(Err(error), &mut changes) {
            Ok(found) => Ok(found.is_none()),
            Err(Stop::Failed(failure)) => Err(*failure),
            Err(Stop::Cancelled) => unreachable!(),
        };
        (went, changes.len())
    }

    #[test]
    fn tetrahedra_follow_what_outlines_cannot_take_and_no_error() {
        assert_eq!(after(SolveError::NoPlan, DISCS), (Ok(true), 1));
        assert_eq!(after(SolveError::TooLarge { bytes: 2, limit: 1 }, DISCS), (Ok(true), 1));
        let touching = SolveError::Touching { first: "a".to_owned(), second: "b".to_owned() };
        for error in [touching, SolveError::Contradiction("a diagonal is negative".to_owned())] {
            let is_defect = error.is_contradiction();
            let (went, changes) = after(error.clone(), DISCS);
            let failure = went.unwrap_err();
            assert_eq!((&failure, changes), (&StepFailure::Field(error), 0));
            assert_eq!(failure.is_defect(), is_defect);
        }
        let asked = format!("{DISCS}[electrostatics]\nsolver = \"extruded\"");
        assert_eq!(after(SolveError::NoPlan, &asked), (Err(StepFailure::Field(SolveError::NoPlan)), 0));
    }
}

//! The field of one step on its route: boxes, boxes under a map, outlines, or the scene that is left to tetrahedra.

use std::sync::Arc;

use elastocap_case::FieldSolver;
use elastocap_electrostatics::{
    ExtrudedSolution, MeshSolution, Settings, Solution, SolveError, solve, solve_extruded,
};
use elastocap_geometry::export::surfaces::SurfaceBody;
use elastocap_geometry::scene::{Purpose, Scene};

use super::Solver;
use crate::box_fields::{between, enclosing, mapped};
use crate::deform::{Deformation, Displacement};
use crate::failure::{StepFailure, Stop};
use crate::layer_outlines::{LayerScene, Sides, outlined};
use crate::mapped::{BentScene, Films, Found, bent_scene};
use crate::plan::PlannedStep;
use crate::route::{Route, asked};
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
        /// The bent bodies for a viewer.
        surfaces: Vec<SurfaceBody>,
    },
    /// Solved as boxes inside and around bent electrodes, for want of a map.
    Enclosed(Box<Solution>),
    /// Yet to be solved as outlines or other shapes.
    Shapes(LayerScene),
}

impl Solver<'_> {
    /// The field of a step on its route, or the scene for the solver on tetrahedra.
    pub(super) fn fields(
        &self,
        taken: Route,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        match taken {
            Route::Boxes => {
                let found = match &self.settings.shared {
                    Some(shared) => shared.get_or_solve(&deformed.scene, &settings, solve)?,
                    None => solve(&deformed.scene, &settings)?,
                };
                Ok(Fields::Boxes(Box::new(found)))
            }
            Route::EnclosingBoxes => {
                Ok(Fields::Boxes(Box::new(between(deformed, enclosing(deformed)?, &settings)?)))
            }
            Route::MappedBoxes => self.under_map(step, deformed, state),
            Route::EnclosingBoxesThenOutlines => {
                // Boxes inside and around are solved in no time.
                let found = between(deformed, enclosing(deformed)?, &settings)?;
                if found.reached {
                    Ok(Fields::Boxes(Box::new(found)))
                } else {
                    Ok(Fields::Shapes(self.outlines(deformed, state, Sides::Curves)?))
                }
            }
            Route::Outlines => Ok(Fields::Shapes(self.outlines(deformed, state, Sides::Curves)?)),
            Route::OutlinesOnTetrahedra => {
                Ok(Fields::Shapes(self.outlines(deformed, state, Sides::Polygons)?))
            }
            Route::Extruded | Route::Tetrahedra => Ok(Fields::Shapes(LayerScene::of_boxes(deformed))),
        }
    }

    /// A scene of outlines by the solver for them. `None` where that fails and nobody asked for it: tetrahedra may serve.
    pub(super) fn by_outlines(&self, scene: &Scene) -> Result<Option<Solved>, Stop> {
        match solve_extruded(scene, &self.settings.boxes()) {
            Ok(ExtrudedSolution { solution, turn, planes, field }) => {
                let (mesh, potentials) = field.unwrap_or_default();
                let general = MeshSolution { mesh, potentials, solution };
                Ok(Some(Solved { general, turn, planes, surfaces: Vec::new(), facets: 0.0 }))
            }
            Err(SolveError::Cancelled) => Err(Stop::Cancelled),
            Err(error) if asked(self.case) == Some(FieldSolver::Extruded) => Err(error.into()),
            Err(_) => Ok(None),
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
        let found = Found { step: layer, displacement: &displacement, distance: step.pose.distance };
        let film = Films::new(self.case, self.settings.relative_tolerance).next()?;
        bent_scene(self.case, deformed, &found, film).ok()?
    }

    /// The field of a scene under its map: added to that of the base, where that is possible and enough.
    fn mapped(&self, bent: &BentScene, settings: &Settings) -> Result<Solution, Stop> {
        match self.base.and_then(|base| base.add(bent, settings)) {
            Some(found) => Ok(found?),
            None => mapped(bent, settings),
        }
    }

    /// Boxes under the map that bends them; boxes inside and around the electrodes where there is no such map.
    fn under_map(
        &self,
        step: &PlannedStep,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
    ) -> Result<Fields, Stop> {
        let settings = self.settings.boxes();
        if let Some(map) = &deformed.tilt {
            let bent = BentScene {
                scene: deformed.scene.clone(),
                map: Arc::clone(map),
                deviation: 0.0,
                film_error: 0.0,
            };
            let found = Box::new(mapped(&bent, &settings)?);
            let surfaces = bent.surfaces(&window(&[deformed]));
            return Ok(Fields::Mapped { found, deviation: 0.0, surfaces });
        }
        let enclosed = || Ok(Fields::Enclosed(Box::new(between(deformed, enclosing(deformed)?, &settings)?)));
        // Boxes inside and around a pair know nothing of what else is bent.
        let is_pressed_in_field = indenter_in_field(self.case).is_some();
        let is_in_layer = self.case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
        let is_pair_alone =
            deformed.bent.is_some() && deformed.scene.conductors().count() <= 2 && !is_in_layer;
        let may_be_enclosed = is_pair_alone && !is_pressed_in_field;
        let (Some(Deformation::FiniteElement(layer)), Some(displacement)) =
            (state, self.displacement(step, state))
        else {
            return enclosed();
        };
        let found = Found { step: layer, displacement: &displacement, distance: step.pose.distance };
        let mut films = Films::new(self.case, self.settings.relative_tolerance);
        loop {
            let Some(film) = films.next() else {
                return if may_be_enclosed { enclosed() } else { Err(StepFailure::NoMap.into()) };
            };
            let bent = match bent_scene(self.case, deformed, &found, film) {
                Ok(Some(bent)) => bent,
                Ok(None) | Err(_) if may_be_enclosed => return enclosed(),
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
            match self.mapped(&bent, &settings) {
                Ok(found) => {
                    let surfaces = bent.surfaces(&window(&[deformed]));
                    let found = Box::new(found);
                    return Ok(Fields::Mapped { found, deviation: bent.deviation, surfaces });
                }
                // Only the film of an indenter can be chosen.
                Err(Stop::Failed(failure)) if no_map(&failure) && is_pressed_in_field => films.make_thicker(),
                Err(Stop::Failed(failure)) if no_map(&failure) && may_be_enclosed => return enclosed(),
                Err(stop) => return Err(stop),
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
                Ok(outlined(deformed, &layer.curves, self.settings.relative_tolerance, sides)?)
            }
            // Nothing but finite elements bends anything.
            Some(Deformation::ClosedForm(_)) | None => Ok(LayerScene::of_boxes(deformed)),
        }
    }
}

/// Whether a solve failed because the map that bends its boxes is none.
fn no_map(failure: &StepFailure) -> bool {
    matches!(failure, StepFailure::Field(SolveError::InsideOut | SolveError::TornMap))
}

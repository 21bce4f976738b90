//! Which field solver takes a scene: one decision, for the plan, the run and every study of it.
//!
//! | bodies         | how the load bends the electrodes                | asked for      | route                              |
//! |----------------|--------------------------------------------------|----------------|------------------------------------|
//! | boxes          | not at all                                       | -, boxes       | [`Route::Boxes`]                   |
//! | boxes          | not at all                                       | tetrahedra     | [`Route::Tetrahedra`]              |
//! | others         | not at all                                       | -, tetrahedra  | [`Route::Tetrahedra`]              |
//! | two electrodes | in the plane, under a flat surface, boxes fit    | -              | [`Route::EnclosingBoxesThenOutlines`] |
//! | boxes          | in the plane, any other way                      | -              | [`Route::Outlines`]                |
//! | others         | in the plane                                     | -, tetrahedra  | [`Route::Outlines`]                |
//! | boxes          | in the plane                                     | tetrahedra     | [`Route::Outlines`]                |
//! | two electrodes | in the plane                                     | boxes          | [`Route::EnclosingBoxes`]          |
//! | two electrodes | in space                                         | -, boxes       | [`Route::EnclosingBoxes`]          |
//!
//! Everything else has no solver: see [`RouteError`].

use std::fmt;

use elastocap_case::{Case, FieldSolver, Indenter, Mechanics};
use elastocap_geometry::scene::Scene;
use serde::{Deserialize, Serialize};

use crate::deform::Deformation;
use crate::load_steps::StepLoad;
use crate::scene::DeformedScene;

/// How the field of a scene is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Route {
    /// By the box solver: every body is a box, a sheet or a slab.
    Boxes,
    /// By the box solver, twice: boxes inside and boxes around the bent electrodes bound their capacitance.
    EnclosingBoxes,
    /// As [`Route::EnclosingBoxes`]; where these bounds are too far apart, as [`Route::Outlines`].
    EnclosingBoxesThenOutlines,
    /// On tetrahedra: electrodes bent in the plane of x1 and x2, as their outlines pulled along x3, under the surface of the layer
    /// as it bulges where the scene has it.
    Outlines,
    /// On tetrahedra: bodies of any shape.
    Tetrahedra,
}

impl Route {
    /// Whether the solver on tetrahedra may be needed, which takes all threads and all memory for itself.
    pub fn may_need_tetrahedra(self) -> bool {
        match self {
            Self::Boxes | Self::EnclosingBoxes => false,
            Self::EnclosingBoxesThenOutlines | Self::Outlines | Self::Tetrahedra => true,
        }
    }
}

/// In words, as what a field is solved by.
impl fmt::Display for Route {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Boxes => "the box solver",
            Self::EnclosingBoxes => "the box solver, with boxes inside and around the bent electrodes",
            Self::EnclosingBoxesThenOutlines => {
                "the box solver, with boxes inside and around the bent electrodes, and their outlines on tetrahedra where these \
                 boxes do not bound the capacitance as closely as asked"
            }
            Self::Outlines => "the outlines of the bent electrodes on tetrahedra",
            Self::Tetrahedra => "tetrahedra",
        })
    }
}

/// What the bodies of a scene are, without the bending of electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Axis-aligned boxes, sheets and slabs only.
    Boxes {
        /// How many of them are conductors, the electrodes and floating ones included.
        conductors: usize,
    },
    /// At least one of another shape, or a mesh.
    AnyShape,
}

impl Bodies {
    /// Those of a scene, in which bent electrodes are still boxes.
    pub fn of(scene: &Scene) -> Self {
        if scene.is_boxes() { Self::Boxes { conductors: scene.conductors().count() } } else { Self::AnyShape }
    }
}

/// How the load bends the electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bending {
    /// Not at all: they are boxes, or there are none.
    Straight,
    /// In the plane of x1 and x2, where their outlines are known.
    InPlane(PlaneBending),
    /// In three dimensions.
    InSpace,
}

/// How electrodes are bent in the plane, as far as it matters to the solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneBending {
    /// The surface of the layer is flat, and boxes fit inside and around the electrodes: these may do instead of the outlines.
    BoxesMayDo,
    /// The surface bulges, or no such boxes fit.
    OutlinesOnly,
}

impl Bending {
    /// What `load` is expected to do to the electrodes of a case, known before the layer is deformed: plane strain and finite
    /// elements in space bend them at any load, the closed form never does.
    pub fn expected(case: &Case, load: StepLoad) -> Self {
        if case.electrodes.is_none() || load.is_zero() {
            return Self::Straight;
        }
        match &case.mechanics {
            None | Some(Mechanics::ClosedForm { .. }) => Self::Straight,
            Some(Mechanics::PlaneStrain(model)) => Self::InPlane(match model.indenter {
                Indenter::WholeTop => PlaneBending::BoxesMayDo,
                Indenter::FlatPunch { .. } | Indenter::Cylinder { .. } => PlaneBending::OutlinesOnly,
            }),
            Some(Mechanics::Solid(_)) => Self::InSpace,
        }
    }

    /// What the load did to the electrodes: the layer in `state` and the scene that it gave.
    pub fn found(deformed: &DeformedScene, state: Option<&Deformation<'_>>) -> Self {
        let Some(enclosing) = &deformed.bent else { return Self::Straight };
        match state {
            Some(Deformation::FiniteElement(layer)) if !layer.curves.electrodes.is_empty() => {
                if enclosing.is_ok() && layer.curves.surface_is_flat() {
                    Self::InPlane(PlaneBending::BoxesMayDo)
                } else {
                    Self::InPlane(PlaneBending::OutlinesOnly)
                }
            }
            // No outlines are known.
            Some(Deformation::FiniteElement(_) | Deformation::ClosedForm(_)) | None => Self::InSpace,
        }
    }
}

/// Why no field solver takes a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RouteError {
    /// The box solver is asked for, and a body is no box.
    #[error(
        "the box solver cannot take bodies of other shapes: leave out `solver` in [electrostatics], or say \
         `solver = \"tetrahedra\"`"
    )]
    BoxesOnly,
    /// Electrodes that are bent in space, and what only tetrahedra can take.
    #[error(
        "only the box solver supports electrodes that the load bends in three dimensions: leave out `solver` in \
         [electrostatics], and bodies that are not boxes"
    )]
    BentInSpace,
    /// Enclosing boxes bound the capacitance of two conductors, not the matrix of more.
    #[error(
        "the electrodes are bent by the load, and with other conductors beside them the box solver has no bounds for that"
    )]
    BentAmongOthers,
}

/// The route of a scene of these bodies, with electrodes bent like this; `asked` is the solver that the case asks for.
///
/// # Errors
/// When no solver takes the scene: see [`RouteError`].
pub fn route(bodies: Bodies, bending: Bending, asked: Option<FieldSolver>) -> Result<Route, RouteError> {
    let conductors = match (bodies, asked) {
        (Bodies::AnyShape, Some(FieldSolver::Boxes)) => return Err(RouteError::BoxesOnly),
        (Bodies::AnyShape, None | Some(FieldSolver::Tetrahedra))
        | (Bodies::Boxes { .. }, Some(FieldSolver::Tetrahedra)) => {
            return match bending {
                Bending::Straight => Ok(Route::Tetrahedra),
                Bending::InPlane(_) => Ok(Route::Outlines),
                Bending::InSpace => Err(RouteError::BentInSpace),
            };
        }
        (Bodies::Boxes { conductors }, None | Some(FieldSolver::Boxes)) => conductors,
    };
    let enclosing = if conductors > 2 { Err(RouteError::BentAmongOthers) } else { Ok(Route::EnclosingBoxes) };
    match (bending, asked) {
        (Bending::Straight, None | Some(_)) => Ok(Route::Boxes),
        (Bending::InSpace, None | Some(_)) | (Bending::InPlane(_), Some(_)) => enclosing,
        (Bending::InPlane(PlaneBending::BoxesMayDo), None) if conductors == 2 => {
            Ok(Route::EnclosingBoxesThenOutlines)
        }
        (Bending::InPlane(PlaneBending::BoxesMayDo | PlaneBending::OutlinesOnly), None) => {
            Ok(Route::Outlines)
        }
    }
}

/// The solver that a case asks for.
pub fn asked(case: &Case) -> Option<FieldSolver> {
    case.electrostatics.and_then(|electrostatics| electrostatics.solver)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: Bodies = Bodies::Boxes { conductors: 2 };
    const THREE: Bodies = Bodies::Boxes { conductors: 3 };
    const FLAT: Bending = Bending::InPlane(PlaneBending::BoxesMayDo);
    const BULGING: Bending = Bending::InPlane(PlaneBending::OutlinesOnly);
    const BOXES: Option<FieldSolver> = Some(FieldSolver::Boxes);
    const TETRAHEDRA: Option<FieldSolver> = Some(FieldSolver::Tetrahedra);

    #[test]
    fn straight_boxes_go_to_the_box_solver_unless_tetrahedra_are_asked_for() {
        for bodies in [Bodies::Boxes { conductors: 1 }, PAIR, THREE] {
            assert_eq!(route(bodies, Bending::Straight, None), Ok(Route::Boxes));
            assert_eq!(route(bodies, Bending::Straight, BOXES), Ok(Route::Boxes));
            assert_eq!(route(bodies, Bending::Straight, TETRAHEDRA), Ok(Route::Tetrahedra));
        }
    }

    #[test]
    fn other_shapes_go_to_tetrahedra_and_never_to_the_box_solver() {
        for asked in [None, TETRAHEDRA] {
            assert_eq!(route(Bodies::AnyShape, Bending::Straight, asked), Ok(Route::Tetrahedra));
            assert_eq!(route(Bodies::AnyShape, FLAT, asked), Ok(Route::Outlines));
            assert_eq!(route(Bodies::AnyShape, BULGING, asked), Ok(Route::Outlines));
        }
        for bending in [Bending::Straight, FLAT, BULGING, Bending::InSpace] {
            assert_eq!(route(Bodies::AnyShape, bending, BOXES), Err(RouteError::BoxesOnly));
        }
    }

    #[test]
    fn boxes_are_tried_before_outlines_only_for_a_pair_alone_under_a_flat_surface() {
        assert_eq!(route(PAIR, FLAT, None), Ok(Route::EnclosingBoxesThenOutlines));
        assert_eq!(route(PAIR, BULGING, None), Ok(Route::Outlines));
        assert_eq!(route(THREE, FLAT, None), Ok(Route::Outlines));
        assert_eq!(route(THREE, BULGING, None), Ok(Route::Outlines));
    }

    #[test]
    fn a_solver_that_is_asked_for_is_the_only_one_for_electrodes_bent_in_the_plane() {
        for bending in [FLAT, BULGING] {
            assert_eq!(route(PAIR, bending, BOXES), Ok(Route::EnclosingBoxes));
            assert_eq!(route(THREE, bending, BOXES), Err(RouteError::BentAmongOthers));
            assert_eq!(route(PAIR, bending, TETRAHEDRA), Ok(Route::Outlines));
            assert_eq!(route(THREE, bending, TETRAHEDRA), Ok(Route::Outlines));
        }
    }

    #[test]
    fn electrodes_bent_in_space_have_enclosing_boxes_or_nothing() {
        for asked in [None, BOXES] {
            assert_eq!(route(PAIR, Bending::InSpace, asked), Ok(Route::EnclosingBoxes));
            assert_eq!(route(THREE, Bending::InSpace, asked), Err(RouteError::BentAmongOthers));
        }
        assert_eq!(route(PAIR, Bending::InSpace, TETRAHEDRA), Err(RouteError::BentInSpace));
        for asked in [None, TETRAHEDRA] {
            assert_eq!(route(Bodies::AnyShape, Bending::InSpace, asked), Err(RouteError::BentInSpace));
        }
    }
}

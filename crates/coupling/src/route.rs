//! Which field solver takes a scene: one decision, for the plan, the run and every study of it.
//!
//! | bodies             | how the load bends the electrodes                | asked for         | route                              |
//! |--------------------|--------------------------------------------------|-------------------|------------------------------------|
//! | boxes              | not at all                                       | -, boxes          | [`Route::Boxes`]                   |
//! | outlines with few edges | not at all                                  | -                 | [`Route::Extruded`]                |
//! | boxes, outlines    | not at all                                       | extruded          | [`Route::Extruded`]                |
//! | others             | not at all                                       | -                 | [`Route::Tetrahedra`]              |
//! | any                | not at all                                       | tetrahedra        | [`Route::Tetrahedra`]              |
//! | two electrodes     | in the plane, under a flat surface, boxes fit    | -                 | [`Route::EnclosingBoxesThenOutlines`] |
//! | boxes, outlines along x3 | in the plane, any other way                | -                 | [`Route::Outlines`]                |
//! | boxes, outlines along x3 | in the plane                               | extruded          | [`Route::Outlines`]                |
//! | others             | in the plane                                     | -                 | [`Route::OutlinesOnTetrahedra`]    |
//! | any                | in the plane                                     | tetrahedra        | [`Route::OutlinesOnTetrahedra`]    |
//! | two electrodes     | in the plane                                     | boxes             | [`Route::EnclosingBoxes`]          |
//! | boxes              | in space                                         | -, boxes          | [`Route::MappedBoxes`]             |
//! | boxes              | the surface is bent, or an indenter in the field is round | -, boxes | [`Route::MappedBoxes`]             |
//! | boxes              | not, but attached bodies are tilted              | -, boxes          | [`Route::MappedBoxes`]             |
//!
//! *Outlines* are bodies that are outlines pulled along one axis.
//! Where the solver for them fails though nobody asked for it, the scene goes to tetrahedra after all. Where no map bends the boxes,
//! [`Route::MappedBoxes`] becomes [`Route::EnclosingBoxes`] for two electrodes.
//!
//! Everything else has no solver: see [`RouteError`].

use std::fmt;

use elastocap_case::{Case, FieldSolver, Indenter, Mechanics, Pose};
use elastocap_electrostatics::{has_few_edges, is_extruded};
use elastocap_geometry::scene::{Purpose, Scene};
use serde::{Deserialize, Serialize};

use crate::deform::Deformation;
use crate::load_steps::StepLoad;
use crate::scene::DeformedScene;
use crate::scene::indenter::{IndenterForm, Rounding};
use crate::scene::neutral::indenter_in_field;

/// How the field of a scene is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Route {
    /// By the box solver: every body is a box, a sheet or a slab.
    Boxes,
    /// By the box solver, twice: boxes inside and boxes around the bent electrodes bound their capacitance.
    EnclosingBoxes,
    /// By the box solver, under a map that bends its boxes as the load bends electrodes and layer in three dimensions.
    MappedBoxes,
    /// As [`Route::EnclosingBoxes`]; where these bounds are too far apart, as [`Route::Outlines`].
    EnclosingBoxesThenOutlines,
    /// By the solver for extruded scenes: every body is an outline pulled along one axis.
    Extruded,
    /// By the solver for extruded scenes, for electrodes bent in the plane of x1 and x2: their outlines are pulled along x3, under the surface
    /// of the layer as it bulges where the scene has it.
    Outlines,
    /// As [`Route::Outlines`], on tetrahedra.
    OutlinesOnTetrahedra,
    /// On tetrahedra: bodies of any shape.
    Tetrahedra,
}

impl Route {
    /// Whether another solver than that for boxes may be needed, which takes all threads and all memory for itself.
    pub fn may_need_more_than_boxes(self) -> bool {
        match self {
            Self::Boxes | Self::EnclosingBoxes | Self::MappedBoxes => false,
            Self::EnclosingBoxesThenOutlines
            | Self::Extruded
            | Self::Outlines
            | Self::OutlinesOnTetrahedra
            | Self::Tetrahedra => true,
        }
    }

    /// Whether a step on this route is solved on tetrahedra in any case.
    pub fn is_on_tetrahedra(self) -> bool {
        matches!(self, Self::OutlinesOnTetrahedra | Self::Tetrahedra)
    }
}

/// In words, as what a field is solved by.
impl fmt::Display for Route {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Boxes => "the box solver",
            Self::EnclosingBoxes => "the box solver, with boxes inside and around the bent electrodes",
            Self::MappedBoxes => "the box solver, under a map that bends its boxes as the load bends the electrodes",
            Self::EnclosingBoxesThenOutlines => {
                "the box solver, with boxes inside and around the bent electrodes, and their outlines by the extruded solver where \
                 these boxes do not bound the capacitance as closely as asked"
            }
            Self::Extruded => "the extruded solver",
            Self::Outlines => "the extruded solver, with the outlines of the bent electrodes",
            Self::OutlinesOnTetrahedra => "the outlines of the bent electrodes on tetrahedra",
            Self::Tetrahedra => "tetrahedra",
        })
    }
}

/// The kind of bodies in a scene, without the bending of electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Axis-aligned boxes, sheets and slabs only.
    Boxes {
        /// How many of them are conductors, the electrodes and floating ones included.
        conductors: usize,
        /// Along which axes the extruded solver takes them.
        along: [bool; 3],
    },
    /// Outlines that are pulled along some axis, which the extruded solver takes.
    Outlines {
        /// Along which.
        along: [bool; 3],
        /// Whether that solver is faster than tetrahedra while nothing is bent.
        few_edges: bool,
    },
    /// At least one of another shape, or a mesh.
    AnyShape,
}

impl Bodies {
    /// The kind of bodies in a scene, in which bent electrodes are still boxes.
    pub fn of(scene: &Scene) -> Self {
        let along = [0, 1, 2].map(|axis| is_extruded(scene, axis));
        if scene.is_boxes() {
            Self::Boxes { conductors: scene.conductors().count(), along }
        } else if along.contains(&true) {
            Self::Outlines { along, few_edges: has_few_edges(scene) }
        } else {
            Self::AnyShape
        }
    }

    /// Along which axes the extruded solver takes them.
    fn along(self) -> [bool; 3] {
        match self {
            Self::Boxes { along, .. } | Self::Outlines { along, .. } => along,
            Self::AnyShape => [false; 3],
        }
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
    /// The surface of the layer is bent, an indenter in the field is round, or bodies move with the material of the layer; electrodes may
    /// be bent along.
    UnderIndenter,
    /// Not by the load, but bodies that are attached to layer or indenter are tilted.
    Tilted,
    /// By the load, while bodies that are attached are tilted.
    TiltedAndBent,
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
    /// The bending of the electrodes of a case that `load` is expected to cause, known before the layer is deformed: plane strain and finite
    /// elements in space bend them at any load, the closed form never does. `pose` is that of what is attached.
    pub fn expected(case: &Case, load: StepLoad, pose: &Pose) -> Self {
        Self::level(case, load, pose).tilted(pose.tilt != [0.0; 2])
    }

    /// The bending under `load` with bodies tilted as well, if they are.
    fn tilted(self, is_tilted: bool) -> Self {
        match self {
            untilted if !is_tilted => untilted,
            Self::Straight => Self::Tilted,
            _ => Self::TiltedAndBent,
        }
    }

    /// The bending that `load` is expected to cause, whether or not bodies are tilted besides.
    fn level(case: &Case, load: StepLoad, pose: &Pose) -> Self {
        if bends_the_field(case, load.is_zero(), pose.distance > 0.0) {
            return Self::UnderIndenter;
        }
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

    /// The bending of the electrodes that the load caused: from the layer in `state` and the scene that it gave, with the indenter this far
    /// from it, m.
    pub fn found(
        case: &Case,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
        distance: f64,
    ) -> Self {
        Self::found_level(case, deformed, state, distance).tilted(deformed.tilt.is_some())
    }

    /// The bending that the load caused, whether or not bodies are tilted besides.
    fn found_level(
        case: &Case,
        deformed: &DeformedScene,
        state: Option<&Deformation<'_>>,
        distance: f64,
    ) -> Self {
        let is_at_rest = state.is_none_or(|state| state.top_displacement() == 0.0);
        if bends_the_field(case, is_at_rest, distance > 0.0) {
            return Self::UnderIndenter;
        }
        let Some(enclosing) = &deformed.bent else { return Self::Straight };
        match state {
            Some(Deformation::FiniteElement(layer)) if !layer.curves.electrodes.is_empty() => {
                if enclosing.is_ok() && layer.curves.bent_between().is_none() {
                    Self::InPlane(PlaneBending::BoxesMayDo)
                } else {
                    Self::InPlane(PlaneBending::OutlinesOnly)
                }
            }
            // No outlines are known.
            Some(Deformation::FiniteElement(_) | Deformation::ClosedForm(_) | Deformation::Foam(_))
            | None => Self::InSpace,
        }
    }
}

/// Whether the field needs the surface of the layer as finite elements have it, or a round indenter.
fn bends_the_field(case: &Case, is_at_rest: bool, is_before_contact: bool) -> bool {
    if !case.mechanics.is_some_and(|mechanics| mechanics.is_finite_element()) {
        return false;
    }
    let Some(form) = IndenterForm::of(case, None) else { return false };
    let covers_all = case.mechanics.is_none_or(|mechanics| mechanics.covers_all());
    let is_in_field = indenter_in_field(case).is_some();
    if form.rounding != Rounding::Sharp && is_in_field {
        return true;
    }
    // A plate over the whole layer leaves the surface flat; electrodes in it are looked at as those without one.
    let is_bent = !is_at_rest && !is_before_contact;
    if is_bent && case.bodies.iter().any(|body| body.purpose == Purpose::InLayer) {
        return true;
    }
    let is_space = matches!(case.mechanics, Some(Mechanics::Solid(_)));
    is_bent
        && if covers_all {
            is_in_field && is_space && case.electrodes.is_some()
        } else {
            is_in_field || case.electrodes.is_none()
        }
}

/// Why no field solver takes a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RouteError {
    /// Bodies are tilted that are no boxes, or another solver is asked for.
    #[error(
        "`tilt` is solved as boxes under a map that tilts them: the scene must consist of boxes, sheets and slabs, and `solver` must be \
         left out or \"boxes\""
    )]
    TiltedShapes,
    /// Bodies are tilted while the finite elements of the layer bend what the field sees.
    #[error(
        "`tilt` turns bodies about a layer that stays flat, and here the load bends its surface or the electrodes in it: leave out `tilt` \
         in this step, or use [mechanics.closed_form]"
    )]
    TiltedAndBent,
    /// The box solver is asked for, and a body is no box.
    #[error(
        "the box solver cannot take bodies of other shapes: leave out `solver` in [electrostatics], or say \
         `solver = \"tetrahedra\"`"
    )]
    BoxesOnly,
    /// The extruded solver is asked for, and the scene is none for it.
    #[error(
        "the extruded solver takes outlines that are pulled along one axis (boxes, sheets, extrusions): leave out `solver` in \
         [electrostatics], or say `solver = \"tetrahedra\"`"
    )]
    OutlinesOnly,
    /// The surface is bent or the indenter is round, and bodies are no boxes.
    #[error(
        "the indenter, the surface under it and what moves with the layer are solved as boxes under a map: all bodies must be boxes, sheets \
         and slabs, and `solver` must be left out or \"boxes\""
    )]
    UnderIndenter,
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
    let along = bodies.along();
    match (asked, bending) {
        (_, Bending::TiltedAndBent) => Err(RouteError::TiltedAndBent),
        (Some(FieldSolver::Boxes), _) => by_boxes(bodies, bending),
        (None, Bending::Tilted | Bending::UnderIndenter) if matches!(bodies, Bodies::Boxes { .. }) => {
            Ok(Route::MappedBoxes)
        }
        (_, Bending::UnderIndenter) => Err(RouteError::UnderIndenter),
        (_, Bending::Tilted) => Err(RouteError::TiltedShapes),
        (Some(FieldSolver::Tetrahedra) | None, Bending::InSpace)
            if !matches!(bodies, Bodies::Boxes { .. }) =>
        {
            Err(RouteError::BentInSpace)
        }
        (Some(FieldSolver::Tetrahedra | FieldSolver::Extruded), Bending::InSpace) => {
            Err(RouteError::BentInSpace)
        }
        (Some(FieldSolver::Tetrahedra), Bending::Straight) => Ok(Route::Tetrahedra),
        (Some(FieldSolver::Tetrahedra), Bending::InPlane(_)) => Ok(Route::OutlinesOnTetrahedra),
        (Some(FieldSolver::Extruded), Bending::Straight) if along.contains(&true) => Ok(Route::Extruded),
        (Some(FieldSolver::Extruded), Bending::InPlane(_)) if along[2] => Ok(Route::Outlines),
        (Some(FieldSolver::Extruded), _) => Err(RouteError::OutlinesOnly),
        (None, Bending::InSpace) => by_boxes(bodies, bending),
        (None, Bending::Straight) => Ok(match bodies {
            Bodies::Boxes { .. } => Route::Boxes,
            Bodies::Outlines { few_edges: true, .. } => Route::Extruded,
            Bodies::Outlines { few_edges: false, .. } | Bodies::AnyShape => Route::Tetrahedra,
        }),
        (None, Bending::InPlane(plane)) => Ok(match (bodies, plane) {
            (Bodies::Boxes { conductors: 2, .. }, PlaneBending::BoxesMayDo) => {
                Route::EnclosingBoxesThenOutlines
            }
            _ if along[2] => Route::Outlines,
            _ => Route::OutlinesOnTetrahedra,
        }),
    }
}

/// The route by the box solver alone.
fn by_boxes(bodies: Bodies, bending: Bending) -> Result<Route, RouteError> {
    match (bodies, bending) {
        (Bodies::Outlines { .. } | Bodies::AnyShape, _) => Err(RouteError::BoxesOnly),
        (Bodies::Boxes { .. }, Bending::Straight) => Ok(Route::Boxes),
        (Bodies::Boxes { .. }, Bending::Tilted | Bending::InSpace | Bending::UnderIndenter) => {
            Ok(Route::MappedBoxes)
        }
        (Bodies::Boxes { conductors: 0..=2, .. }, Bending::InPlane(_)) => Ok(Route::EnclosingBoxes),
        (Bodies::Boxes { .. }, _) => Err(RouteError::BentAmongOthers),
    }
}

/// The solver that a case asks for; an order is one of potentials on tetrahedra.
pub fn asked(case: &Case) -> Option<FieldSolver> {
    let electrostatics = case.electrostatics?;
    electrostatics.solver.or(electrostatics.order.map(|_| FieldSolver::Tetrahedra))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERY: [bool; 3] = [true; 3];
    const PAIR: Bodies = Bodies::Boxes { conductors: 2, along: EVERY };
    const THREE: Bodies = Bodies::Boxes { conductors: 3, along: EVERY };
    /// Two boxes that the extruded solver does not take.
    const NOT_EXTRUDED: Bodies = Bodies::Boxes { conductors: 2, along: [false; 3] };
    const UPRIGHT: Bodies = Bodies::Outlines { along: [false, true, false], few_edges: true };
    const ALONG: Bodies = Bodies::Outlines { along: [false, false, true], few_edges: true };
    const COMB: Bodies = Bodies::Outlines { along: [false, true, false], few_edges: false };
    const FLAT: Bending = Bending::InPlane(PlaneBending::BoxesMayDo);
    const BULGING: Bending = Bending::InPlane(PlaneBending::OutlinesOnly);
    const BOXES: Option<FieldSolver> = Some(FieldSolver::Boxes);
    const EXTRUDED: Option<FieldSolver> = Some(FieldSolver::Extruded);
    const TETRAHEDRA: Option<FieldSolver> = Some(FieldSolver::Tetrahedra);

    #[test]
    fn straight_boxes_go_to_the_box_solver_unless_another_is_asked_for() {
        for bodies in [Bodies::Boxes { conductors: 1, along: EVERY }, PAIR, THREE, NOT_EXTRUDED] {
            assert_eq!(route(bodies, Bending::Straight, None), Ok(Route::Boxes));
            assert_eq!(route(bodies, Bending::Straight, BOXES), Ok(Route::Boxes));
            assert_eq!(route(bodies, Bending::Straight, TETRAHEDRA), Ok(Route::Tetrahedra));
        }
        assert_eq!(route(PAIR, Bending::Straight, EXTRUDED), Ok(Route::Extruded));
        assert_eq!(route(NOT_EXTRUDED, Bending::Straight, EXTRUDED), Err(RouteError::OutlinesOnly));
    }

    #[test]
    fn outlines_go_to_the_extruded_solver_and_other_shapes_to_tetrahedra() {
        for asked in [None, EXTRUDED] {
            assert_eq!(route(UPRIGHT, Bending::Straight, asked), Ok(Route::Extruded));
            assert_eq!(route(ALONG, BULGING, asked), Ok(Route::Outlines));
        }
        assert_eq!(route(COMB, Bending::Straight, None), Ok(Route::Tetrahedra));
        assert_eq!(route(COMB, Bending::Straight, EXTRUDED), Ok(Route::Extruded));
        assert_eq!(route(UPRIGHT, BULGING, None), Ok(Route::OutlinesOnTetrahedra));
        assert_eq!(route(UPRIGHT, BULGING, EXTRUDED), Err(RouteError::OutlinesOnly));
        assert_eq!(route(UPRIGHT, Bending::Straight, TETRAHEDRA), Ok(Route::Tetrahedra));
        for asked in [None, TETRAHEDRA] {
            assert_eq!(route(Bodies::AnyShape, Bending::Straight, asked), Ok(Route::Tetrahedra));
            assert_eq!(route(Bodies::AnyShape, FLAT, asked), Ok(Route::OutlinesOnTetrahedra));
            assert_eq!(route(Bodies::AnyShape, BULGING, asked), Ok(Route::OutlinesOnTetrahedra));
        }
        for bending in [Bending::Straight, FLAT, BULGING, Bending::InSpace] {
            assert_eq!(route(Bodies::AnyShape, bending, BOXES), Err(RouteError::BoxesOnly));
            assert_eq!(route(UPRIGHT, bending, BOXES), Err(RouteError::BoxesOnly));
        }
    }

    #[test]
    fn boxes_are_tried_before_outlines_only_for_a_pair_alone_under_a_flat_surface() {
        assert_eq!(route(PAIR, FLAT, None), Ok(Route::EnclosingBoxesThenOutlines));
        assert_eq!(route(PAIR, BULGING, None), Ok(Route::Outlines));
        assert_eq!(route(THREE, FLAT, None), Ok(Route::Outlines));
        assert_eq!(route(THREE, BULGING, None), Ok(Route::Outlines));
        assert_eq!(route(NOT_EXTRUDED, BULGING, None), Ok(Route::OutlinesOnTetrahedra));
    }

    #[test]
    fn a_solver_that_is_asked_for_is_the_only_one_for_electrodes_bent_in_the_plane() {
        for bending in [FLAT, BULGING] {
            assert_eq!(route(PAIR, bending, BOXES), Ok(Route::EnclosingBoxes));
            assert_eq!(route(THREE, bending, BOXES), Err(RouteError::BentAmongOthers));
            for pair in [PAIR, THREE] {
                assert_eq!(route(pair, bending, EXTRUDED), Ok(Route::Outlines));
                assert_eq!(route(pair, bending, TETRAHEDRA), Ok(Route::OutlinesOnTetrahedra));
            }
        }
    }

    #[test]
    fn nothing_takes_a_tilt_while_the_load_bends_what_the_field_sees() {
        for bending in [FLAT, BULGING, Bending::InSpace, Bending::UnderIndenter] {
            assert_eq!(bending.tilted(false), bending);
            for asked in [None, BOXES, EXTRUDED, TETRAHEDRA] {
                assert_eq!(route(PAIR, bending.tilted(true), asked), Err(RouteError::TiltedAndBent));
            }
        }
        assert_eq!(Bending::Straight.tilted(true), Bending::Tilted);
        assert_eq!(route(PAIR, Bending::Tilted, None), Ok(Route::MappedBoxes));
    }

    #[test]
    fn electrodes_bent_in_space_have_mapped_boxes_or_nothing() {
        for asked in [None, BOXES] {
            assert_eq!(route(PAIR, Bending::InSpace, asked), Ok(Route::MappedBoxes));
            assert_eq!(route(THREE, Bending::InSpace, asked), Ok(Route::MappedBoxes));
        }
        for asked in [EXTRUDED, TETRAHEDRA] {
            assert_eq!(route(PAIR, Bending::InSpace, asked), Err(RouteError::BentInSpace));
            assert_eq!(route(UPRIGHT, Bending::InSpace, asked), Err(RouteError::BentInSpace));
        }
        for asked in [None, TETRAHEDRA] {
            assert_eq!(route(Bodies::AnyShape, Bending::InSpace, asked), Err(RouteError::BentInSpace));
        }
    }
}

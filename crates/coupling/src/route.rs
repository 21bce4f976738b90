//! Which field solver takes a scene: one decision, for the plan, the run and every study of it.
//!
//! | bodies             | how the load bends the electrodes                | asked for         | route                              |
//! |--------------------|--------------------------------------------------|-------------------|------------------------------------|
//! | boxes              | not at all                                       | -, boxes          | [`Route::BOXES`]                   |
//! | outlines with few edges | not at all                                  | -                 | [`Route::EXTRUDED`]                |
//! | boxes, outlines    | not at all                                       | extruded          | [`Route::EXTRUDED`]                |
//! | others             | not at all                                       | -                 | [`Route::TETRAHEDRA`]              |
//! | any                | not at all                                       | tetrahedra        | [`Route::TETRAHEDRA`]              |
//! | boxes, outlines along x3 | in the plane                               | -, extruded       | [`Route::OUTLINES`]                |
//! | others             | in the plane                                     | -                 | [`Route::OUTLINES_ON_TETRAHEDRA`]  |
//! | any                | in the plane                                     | tetrahedra        | [`Route::OUTLINES_ON_TETRAHEDRA`]  |
//! | boxes              | in space                                         | -, boxes          | [`Route::MAPPED_BOXES`]            |
//! | boxes              | the surface is bent, or an indenter in the field is round | -, boxes | [`Route::MAPPED_BOXES`]            |
//! | boxes              | not, but attached bodies are tilted              | -, boxes          | [`Route::MAPPED_BOXES`]            |
//!
//! *Outlines* are bodies that are outlines pulled along one axis. Where the extruded solver fails though
//! nobody asked for it, the scene goes to tetrahedra after all. Everything else has no solver: see
//! [`RouteError`].

use std::fmt;

use elastocap_case::{Case, FieldSolver, Mechanics, Pose};
use elastocap_electrostatics::{has_few_edges, is_extruded};
use elastocap_geometry::scene::{Purpose, Scene};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::deform::Deformation;
use crate::load_steps::StepLoad;
use crate::scene::DeformedScene;
use crate::scene::indenter::{IndenterForm, Rounding};
use crate::scene::neutral::indenter_in_field;

/// The shape in which a solver is given the bodies of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolvedShape {
    /// Bodies as the scene has them: nothing is bent.
    Straight,
    /// The outlines of what is bent in the plane of x1 and x2, pulled along x3.
    Outlines,
    /// Boxes under a map that bends them as the load bends electrodes and layer, or that tilts them.
    Mapped,
}

/// How the field of a scene is solved: which solver is given the bodies in which shape. Only the constants
/// below exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Route {
    shape: SolvedShape,
    solver: FieldSolver,
}

impl Route {
    /// Boxes, sheets and slabs by the box solver.
    pub const BOXES: Self = Self { shape: SolvedShape::Straight, solver: FieldSolver::Boxes };
    /// Boxes by the box solver, under a map.
    pub const MAPPED_BOXES: Self = Self { shape: SolvedShape::Mapped, solver: FieldSolver::Boxes };
    /// Outlines pulled along one axis, by the extruded solver.
    pub const EXTRUDED: Self = Self { shape: SolvedShape::Straight, solver: FieldSolver::Extruded };
    /// Bent outlines by the extruded solver.
    pub const OUTLINES: Self = Self { shape: SolvedShape::Outlines, solver: FieldSolver::Extruded };
    /// Bent outlines on tetrahedra.
    pub const OUTLINES_ON_TETRAHEDRA: Self =
        Self { shape: SolvedShape::Outlines, solver: FieldSolver::Tetrahedra };
    /// Bodies of any shape on tetrahedra.
    pub const TETRAHEDRA: Self = Self { shape: SolvedShape::Straight, solver: FieldSolver::Tetrahedra };

    const ALL: [Self; 6] = [
        Self::BOXES,
        Self::MAPPED_BOXES,
        Self::EXTRUDED,
        Self::OUTLINES,
        Self::OUTLINES_ON_TETRAHEDRA,
        Self::TETRAHEDRA,
    ];

    /// The shape in which the solver is given the bodies.
    pub fn shape(self) -> SolvedShape {
        self.shape
    }

    /// The solver.
    pub fn solver(self) -> FieldSolver {
        self.solver
    }

    /// This route on tetrahedra: where the extruded solver cannot take a scene.
    pub(crate) fn on_tetrahedra(self) -> Self {
        Self { solver: FieldSolver::Tetrahedra, ..self }
    }

    /// The name of the route in result.json.
    pub fn name(self) -> &'static str {
        match (self.shape, self.solver) {
            (SolvedShape::Mapped, _) => "mapped_boxes",
            (_, FieldSolver::Boxes) => "boxes",
            (SolvedShape::Straight, FieldSolver::Extruded) => "extruded",
            (SolvedShape::Outlines, FieldSolver::Extruded) => "outlines",
            (SolvedShape::Outlines, FieldSolver::Tetrahedra) => "outlines_on_tetrahedra",
            (SolvedShape::Straight, FieldSolver::Tetrahedra) => "tetrahedra",
        }
    }
}

/// The route as what a field is solved by, in words.
impl fmt::Display for Route {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.shape, self.solver) {
            (SolvedShape::Mapped, _) => {
                "the box solver, under a map that bends its boxes as the load bends the electrodes"
            }
            (_, FieldSolver::Boxes) => "the box solver",
            (SolvedShape::Straight, FieldSolver::Extruded) => "the extruded solver",
            (SolvedShape::Outlines, FieldSolver::Extruded) => {
                "the extruded solver, with the outlines of the bent electrodes"
            }
            (SolvedShape::Outlines, FieldSolver::Tetrahedra) => {
                "the outlines of the bent electrodes on tetrahedra"
            }
            (SolvedShape::Straight, FieldSolver::Tetrahedra) => "tetrahedra",
        })
    }
}

impl Serialize for Route {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Route {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let known = Self::ALL.into_iter().find(|route| route.name() == name);
        known.ok_or_else(|| D::Error::custom(format_args!("no route is called `{name}`")))
    }
}

/// The kind of bodies in a scene, without the bending of electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Axis-aligned boxes, sheets and slabs only.
    Boxes {
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
            Self::Boxes { along }
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
    InPlane,
    /// In three dimensions.
    InSpace,
    /// The surface of the layer is bent, an indenter in the field is round, or bodies move with the material
    /// of the layer; electrodes may be bent along.
    UnderIndenter,
    /// Not by the load, but bodies that are attached to layer or indenter are tilted.
    Tilted,
    /// By the load, while bodies that are attached are tilted.
    TiltedAndBent,
}

impl Bending {
    /// The bending of the electrodes of a case that `load` is expected to cause, known before the layer is
    /// deformed: plane strain and finite elements in space bend them at any load, the closed form never does.
    /// `pose` is that of what is attached.
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
            Some(Mechanics::PlaneStrain(_)) => Self::InPlane,
            Some(Mechanics::Solid(_)) => Self::InSpace,
        }
    }

    /// The bending of the electrodes that the load caused: from the layer in `state` and the scene that it
    /// gave, with the indenter this far from it, m.
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
        if !deformed.electrodes_are_bent {
            return Self::Straight;
        }
        match state {
            Some(Deformation::FiniteElement(layer)) if !layer.curves.electrodes.is_empty() => Self::InPlane,
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
    // A plate over the whole layer leaves the surface flat; electrodes in it are looked at as those without
    // one.
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
    /// The box solver is asked for, and the load bends electrodes in the plane.
    #[error(
        "the box solver does not take electrodes that the load bends in the plane: leave out `solver` in [electrostatics]"
    )]
    BentInPlane,
}

/// The route of a scene of these bodies, with electrodes bent like this; `asked` is the solver that the case
/// asks for.
///
/// # Errors
/// When no solver takes the scene: see [`RouteError`].
pub fn route(bodies: Bodies, bending: Bending, asked: Option<FieldSolver>) -> Result<Route, RouteError> {
    let along = bodies.along();
    match (asked, bending) {
        (_, Bending::TiltedAndBent) => Err(RouteError::TiltedAndBent),
        (Some(FieldSolver::Boxes), _) => by_boxes(bodies, bending),
        (None, Bending::Tilted | Bending::UnderIndenter) if matches!(bodies, Bodies::Boxes { .. }) => {
            Ok(Route::MAPPED_BOXES)
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
        (Some(FieldSolver::Tetrahedra), Bending::Straight) => Ok(Route::TETRAHEDRA),
        (Some(FieldSolver::Tetrahedra), Bending::InPlane) => Ok(Route::OUTLINES_ON_TETRAHEDRA),
        (Some(FieldSolver::Extruded), Bending::Straight) if along.contains(&true) => Ok(Route::EXTRUDED),
        (Some(FieldSolver::Extruded), Bending::InPlane) if along[2] => Ok(Route::OUTLINES),
        (Some(FieldSolver::Extruded), _) => Err(RouteError::OutlinesOnly),
        (None, Bending::InSpace) => by_boxes(bodies, bending),
        (None, Bending::Straight) => Ok(match bodies {
            Bodies::Boxes { .. } => Route::BOXES,
            Bodies::Outlines { few_edges: true, .. } => Route::EXTRUDED,
            Bodies::Outlines { few_edges: false, .. } | Bodies::AnyShape => Route::TETRAHEDRA,
        }),
        (None, Bending::InPlane) if along[2] => Ok(Route::OUTLINES),
        (None, Bending::InPlane) => Ok(Route::OUTLINES_ON_TETRAHEDRA),
    }
}

/// The route by the box solver alone.
fn by_boxes(bodies: Bodies, bending: Bending) -> Result<Route, RouteError> {
    match (bodies, bending) {
        (Bodies::Outlines { .. } | Bodies::AnyShape, _) => Err(RouteError::BoxesOnly),
        (Bodies::Boxes { .. }, Bending::Straight) => Ok(Route::BOXES),
        (Bodies::Boxes { .. }, Bending::InPlane) => Err(RouteError::BentInPlane),
        (Bodies::Boxes { .. }, Bending::TiltedAndBent) => Err(RouteError::TiltedAndBent),
        (Bodies::Boxes { .. }, Bending::Tilted | Bending::InSpace | Bending::UnderIndenter) => {
            Ok(Route::MAPPED_BOXES)
        }
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
    const PAIR: Bodies = Bodies::Boxes { along: EVERY };
    /// Boxes that the extruded solver does not take.
    const NOT_EXTRUDED: Bodies = Bodies::Boxes { along: [false; 3] };
    const UPRIGHT: Bodies = Bodies::Outlines { along: [false, true, false], few_edges: true };
    const ALONG: Bodies = Bodies::Outlines { along: [false, false, true], few_edges: true };
    const COMB: Bodies = Bodies::Outlines { along: [false, true, false], few_edges: false };
    const BOXES: Option<FieldSolver> = Some(FieldSolver::Boxes);
    const EXTRUDED: Option<FieldSolver> = Some(FieldSolver::Extruded);
    const TETRAHEDRA: Option<FieldSolver> = Some(FieldSolver::Tetrahedra);

    #[test]
    fn straight_boxes_go_to_the_box_solver_unless_another_is_asked_for() {
        for bodies in [PAIR, NOT_EXTRUDED] {
            assert_eq!(route(bodies, Bending::Straight, None), Ok(Route::BOXES));
            assert_eq!(route(bodies, Bending::Straight, BOXES), Ok(Route::BOXES));
            assert_eq!(route(bodies, Bending::Straight, TETRAHEDRA), Ok(Route::TETRAHEDRA));
        }
        assert_eq!(route(PAIR, Bending::Straight, EXTRUDED), Ok(Route::EXTRUDED));
        assert_eq!(route(NOT_EXTRUDED, Bending::Straight, EXTRUDED), Err(RouteError::OutlinesOnly));
    }

    #[test]
    fn outlines_go_to_the_extruded_solver_and_other_shapes_to_tetrahedra() {
        for asked in [None, EXTRUDED] {
            assert_eq!(route(UPRIGHT, Bending::Straight, asked), Ok(Route::EXTRUDED));
            assert_eq!(route(ALONG, Bending::InPlane, asked), Ok(Route::OUTLINES));
        }
        assert_eq!(route(COMB, Bending::Straight, None), Ok(Route::TETRAHEDRA));
        assert_eq!(route(COMB, Bending::Straight, EXTRUDED), Ok(Route::EXTRUDED));
        assert_eq!(route(UPRIGHT, Bending::InPlane, None), Ok(Route::OUTLINES_ON_TETRAHEDRA));
        assert_eq!(route(UPRIGHT, Bending::InPlane, EXTRUDED), Err(RouteError::OutlinesOnly));
        assert_eq!(route(UPRIGHT, Bending::Straight, TETRAHEDRA), Ok(Route::TETRAHEDRA));
        for asked in [None, TETRAHEDRA] {
            assert_eq!(route(Bodies::AnyShape, Bending::Straight, asked), Ok(Route::TETRAHEDRA));
            assert_eq!(route(Bodies::AnyShape, Bending::InPlane, asked), Ok(Route::OUTLINES_ON_TETRAHEDRA));
        }
        for bending in [Bending::Straight, Bending::InPlane, Bending::InSpace] {
            assert_eq!(route(Bodies::AnyShape, bending, BOXES), Err(RouteError::BoxesOnly));
            assert_eq!(route(UPRIGHT, bending, BOXES), Err(RouteError::BoxesOnly));
        }
    }

    #[test]
    fn electrodes_bent_in_the_plane_are_outlines_unless_tetrahedra_are_asked_for_and_never_boxes() {
        for asked in [None, EXTRUDED] {
            assert_eq!(route(PAIR, Bending::InPlane, asked), Ok(Route::OUTLINES));
        }
        assert_eq!(route(PAIR, Bending::InPlane, TETRAHEDRA), Ok(Route::OUTLINES_ON_TETRAHEDRA));
        assert_eq!(route(PAIR, Bending::InPlane, BOXES), Err(RouteError::BentInPlane));
        assert_eq!(route(NOT_EXTRUDED, Bending::InPlane, None), Ok(Route::OUTLINES_ON_TETRAHEDRA));
    }

    #[test]
    fn a_route_is_read_back_from_its_name_and_no_two_have_one_name() {
        for route in Route::ALL {
            let text = serde_json::to_string(&route).unwrap();
            assert_eq!(serde_json::from_str::<Route>(&text).unwrap(), route);
        }
        assert!(serde_json::from_str::<Route>("\"enclosing_boxes\"").is_err());
    }

    #[test]
    fn nothing_takes_a_tilt_while_the_load_bends_what_the_field_sees() {
        for bending in [Bending::InPlane, Bending::InSpace, Bending::UnderIndenter] {
            assert_eq!(bending.tilted(false), bending);
            for asked in [None, BOXES, EXTRUDED, TETRAHEDRA] {
                assert_eq!(route(PAIR, bending.tilted(true), asked), Err(RouteError::TiltedAndBent));
            }
        }
        assert_eq!(Bending::Straight.tilted(true), Bending::Tilted);
        assert_eq!(route(PAIR, Bending::Tilted, None), Ok(Route::MAPPED_BOXES));
    }

    #[test]
    fn electrodes_bent_in_space_have_mapped_boxes_or_nothing() {
        for asked in [None, BOXES] {
            assert_eq!(route(PAIR, Bending::InSpace, asked), Ok(Route::MAPPED_BOXES));
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

//! Conductors that touch where a step has them: bodies that load or pose bring together, and what presses.
//!
//! The reader of cases refuses conductors that touch where the file puts them. What finite elements bend is not looked at here: maps keep
//! apart what was apart before.

use elastocap_case::{Case, Pose, Terminal};
use elastocap_geometry::scene::{Body, Box3, Potential, Purpose, Role};
use elastocap_geometry::shapes::{Shape, TriangleSurface};

use super::SceneError;
use super::attached::{Tilt, is_attached, moved};
use super::indenter::{self, IndenterForm};
use super::neutral::indenter_in_field;
use super::walls::outer_walls;
use crate::deform::Deformation;

/// Gaps up to this share of the layer's thickness are rounding of sums of lengths.
const ROUNDING: f64 = 1e-9;

/// Refuses a step in which conductors touch. The `conductors` are those of its scene, before those of one terminal are joined and without the
/// indenter, whose lowest point is at the height `lowest`, m.
///
/// Returns the grounded conductor that the indenter, grounded too, is one with, if the two touch.
///
/// # Errors
/// Two conductors of different terminals that touch.
pub(super) fn check<'a>(
    case: &Case,
    conductors: &'a [Body],
    state: Option<&Deformation<'_>>,
    lowest: f64,
    (pose, tilt): (&Pose, Option<&Tilt>),
) -> Result<Option<&'a str>, SceneError> {
    if case.layer.is_none() {
        return Ok(None);
    }
    let is_bent = state.is_some_and(|state| match state {
        Deformation::ClosedForm(_) | Deformation::Foam(_) => false,
        Deformation::FiniteElement(step) => step.top_displacement != 0.0,
    });
    let is_known = |body: &&Body| !is_bent || !moves_with_material(body);
    let known: Vec<&Body> = conductors.iter().filter(is_known).collect();
    let places = Places::of(case, &known, tilt);
    places.check_apart(matches!(state, Some(Deformation::ClosedForm(_) | Deformation::Foam(_))))?;
    check_surface(case, pose)?;
    places.check_indenter(lowest)
}

/// Refuses a step in which conductors touch one another or a wall, of those that finite elements do not bend, before these are solved: the
/// top of the layer sinks by the length `sinks`, m.
///
/// # Errors
/// Two conductors of different terminals that touch, or one that reaches a wall.
pub(crate) fn check_pressed(case: &Case, sinks: f64, pose: &Pose) -> Result<(), SceneError> {
    let Some(layer) = &case.layer else { return Ok(()) };
    let own = case.bodies.iter().filter(|body| !moves_with_material(body));
    let all = moved(own.cloned().collect(), -sinks, pose)?;
    let known: Vec<&Body> = all.iter().filter(|body| body.is_conductor()).collect();
    let places = Places::of(case, &known, Tilt::of(&all, pose).as_ref());
    places.check_apart(false)?;
    let top = layer.thickness - sinks;
    places.check_indenter(top + pose.distance)?;
    let metal = indenter::body(case, top + pose.distance).filter(Body::is_conductor);
    let conductors: Vec<(&str, Box3)> = known
        .into_iter()
        .chain(&metal)
        .filter_map(|body| Some((body.name.as_str(), body.bounds()?)))
        .collect();
    match &case.surroundings {
        Some(surroundings) if !conductors.is_empty() => {
            outer_walls(case, surroundings, top, &conductors).map(|_| ())
        }
        Some(_) | None => Ok(()),
    }
}

/// Adds the indenter to the conductor that it is one with.
pub(super) fn join(scene: &mut [Body], terminals: &[Terminal], with: &str, indenter: Body) {
    let terminal = terminals.iter().find(|terminal| terminal.holds(with));
    let name = terminal.map_or(with, |terminal| terminal.name.as_str());
    if let Some(body) = scene.iter_mut().find(|body| body.is_conductor() && body.name == name) {
        body.parts.extend(indenter.parts);
    }
}

/// Whether the load bends or stretches a body along with the material of the layer.
fn moves_with_material(body: &Body) -> bool {
    match body.purpose {
        Purpose::Electrode | Purpose::InLayer => true,
        Purpose::Layer
        | Purpose::Substrate
        | Purpose::Cover
        | Purpose::OnTop
        | Purpose::Indenter
        | Purpose::OnIndenter
        | Purpose::Fixed => false,
    }
}

/// Under an indenter that bends the surface, no conductor in that surface may be told from one that touches the indenter.
fn check_surface(case: &Case, pose: &Pose) -> Result<(), SceneError> {
    let bends = case.mechanics.is_some_and(|own| own.is_finite_element());
    let is_metal = indenter_in_field(case).is_some_and(|own| !matches!(own.role, Role::Dielectric { .. }));
    let Some(layer) = case.layer.as_ref().filter(|_| bends && is_metal && pose.distance == 0.0) else {
        return Ok(());
    };
    let reaches = |region: &Box3| region.max[1] >= layer.thickness * (1.0 - ROUNDING);
    // In the coordinates of the file, which is where the material of the surface is known.
    let bodies = case.bodies.iter().filter(|body| body.is_conductor() && body.purpose == Purpose::InLayer);
    let bodies = bodies.map(|body| (body.name.as_str(), body.boxes().unwrap_or_default()));
    let pair = case.electrodes.iter().flat_map(|own| own.names().into_iter().zip(own.regions()));
    let pair = pair.map(|(name, region)| (name, vec![region]));
    match bodies.chain(pair).find(|(_, regions)| regions.iter().any(reaches)) {
        Some((body, _)) => Err(SceneError::ShortedByIndenter { body: body.to_owned() }),
        None => Ok(()),
    }
}

/// Whether the indenter is the box that the scene has for it at every load, with no map that makes another form of that.
fn is_straight(case: &Case) -> bool {
    let Some(mechanics) = case.mechanics.filter(|own| own.covers_all()) else { return false };
    let is_bent =
        case.electrodes.is_some() || case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
    !(is_bent && mechanics.is_finite_element())
}

/// Conductors where a step has them.
struct Places<'a, 'b> {
    case: &'a Case,
    /// Each with its shapes, turned as the pose says.
    conductors: Vec<(&'b Body, Vec<Shape>)>,
    /// m.
    rounding: f64,
}

impl<'a, 'b> Places<'a, 'b> {
    fn of(case: &'a Case, conductors: &[&'b Body], tilt: Option<&Tilt>) -> Self {
        let turned = |body: &&'b Body| {
            let turned = |part: &Shape| match (tilt, part.as_box()) {
                (Some(tilt), Some(region)) if is_attached(body) => {
                    Shape::Surface(TriangleSurface::of_box(&region, |x| tilt.image(x)))
                }
                _ => part.clone(),
            };
            (*body, body.parts.iter().map(turned).collect())
        };
        let thickness = case.layer.as_ref().map_or(0.0, |layer| layer.thickness);
        Self { case, conductors: conductors.iter().map(turned).collect(), rounding: ROUNDING * thickness }
    }

    /// Whether two shapes share a point. Of two of which none is a box the meshers know.
    fn touch(&self, one: &Shape, other: &Shape) -> bool {
        let around = |region: &Box3| Box3 {
            min: region.min.map(|x| x - self.rounding),
            max: region.max.map(|x| x + self.rounding),
        };
        match (one.as_box(), other.as_box()) {
            (_, Some(region)) => one.touches_box(&around(&region)),
            (Some(region), None) => other.touches_box(&around(&region)),
            (None, None) => false,
        }
    }

    fn any_touch(&self, one: &[Shape], other: &[Shape]) -> bool {
        one.iter().any(|one| other.iter().any(|other| self.touch(one, other)))
    }

    /// Refuses two that have come together. `is_stretched`: those in the layer move against one another.
    fn check_apart(&self, is_stretched: bool) -> Result<(), SceneError> {
        let terminals = &self.case.terminals;
        for (k, (body, shapes)) in self.conductors.iter().enumerate() {
            for (other, others) in &self.conductors[..k] {
                let moves = body.purpose != other.purpose || (is_stretched && moves_with_material(body));
                let joined = || terminals.iter().any(|all| all.holds(&body.name) && all.holds(&other.name));
                if moves && self.any_touch(shapes, others) && !joined() {
                    let (first, second) = (other.name.clone(), body.name.clone());
                    return Err(SceneError::BodiesMeet { first, second });
                }
            }
        }
        Ok(())
    }

    /// Refuses those that touch an indenter of metal with its lowest point at a height, m, but for one that is grounded as the indenter is,
    /// of which it returns the name.
    fn check_indenter(&self, lowest: f64) -> Result<Option<&'b str>, SceneError> {
        let Some(own) = indenter_in_field(self.case) else { return Ok(None) };
        let Role::Conductor { potential } = own.role else { return Ok(None) };
        let Some(form) = IndenterForm::of(self.case, own.height) else { return Ok(None) };
        let shapes = form.shapes(lowest);
        let mut one: Option<&str> = None;
        for (body, _) in self.conductors.iter().filter(|(_, parts)| self.any_touch(parts, &shapes)) {
            let terminal = self.case.terminals.iter().find(|terminal| terminal.holds(&body.name));
            let is_grounded = potential == Potential::Grounded && terminal.is_some_and(|own| own.is_grounded);
            let is_same = one.is_none_or(|one| terminal.is_some_and(|own| own.holds(one)));
            if !(is_grounded && is_same && is_straight(self.case)) {
                return Err(SceneError::TouchesIndenter { body: body.name.clone() });
            }
            one = one.or(Some(body.name.as_str()));
        }
        Ok(one)
    }
}

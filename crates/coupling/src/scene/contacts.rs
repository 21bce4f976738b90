//! Conductors that touch in a step: bodies that the load or the pose brings together, and the indenter.
//!
//! The case reader refuses conductors that touch as given in the file. Bodies that finite elements bend are
//! not checked here: maps keep separate bodies apart.

use elastocap_case::{Case, Pose, Terminal};
use elastocap_geometry::scene::{Body, Box3, Potential, Purpose, Role};
use elastocap_geometry::shapes::{Shape, TriangleSurface};

use super::SceneError;
use super::attached::{Tilt, is_attached, moved};
use super::indenter::{self, IndenterForm};
use super::neutral::indenter_in_field;
use super::walls::outer_walls;
use crate::deform::Deformation;

/// Gaps up to this share of the layer's thickness count as rounding errors of sums of lengths. Not tuned: it
/// only has to lie above rounding errors and below distances that matter.
const ROUNDING: f64 = 1e-9;

/// Refuses a step in which conductors touch. `conductors` are those of its scene before terminals are joined,
/// without the indenter, whose lowest point is at the height `lowest`, m.
///
/// Returns the name of the grounded conductor that a grounded indenter touches.
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

/// Refuses a step, before its finite elements are solved, in which conductors that these do not bend touch
/// one another or a wall. The top of the layer sinks by `sinks`, m.
///
/// # Errors
/// Two conductors of different terminals that touch, or one that reaches a wall.
pub(crate) fn check_pressed(case: &Case, sinks: f64, pose: &Pose) -> Result<(), SceneError> {
    let Some(layer) = &case.layer else { return Ok(()) };
    let unbent = case.bodies.iter().filter(|body| !moves_with_material(body));
    let bodies = moved(unbent.cloned().collect(), -sinks, pose)?;
    let known: Vec<&Body> = bodies.iter().filter(|body| body.is_conductor()).collect();
    let places = Places::of(case, &known, Tilt::of(&bodies, pose).as_ref());
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

/// Adds the indenter to the conductor `with` that it touches.
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

/// Refuses conductors in the surface of a layer that a metal indenter bends: they cannot be distinguished
/// from conductors that touch it.
fn check_surface(case: &Case, pose: &Pose) -> Result<(), SceneError> {
    let bends = case.mechanics.is_some_and(|mechanics| mechanics.is_finite_element());
    let indenter = indenter_in_field(case);
    let is_metal = indenter.is_some_and(|indenter| !matches!(indenter.role, Role::Dielectric { .. }));
    let Some(layer) = case.layer.as_ref().filter(|_| bends && is_metal && pose.distance == 0.0) else {
        return Ok(());
    };
    let reaches = |region: &Box3| region.max[1] >= layer.thickness * (1.0 - ROUNDING);
    // Compared in the coordinates of the file, before loading.
    let bodies = case.bodies.iter().filter(|body| body.is_conductor() && body.purpose == Purpose::InLayer);
    let bodies = bodies.map(|body| (body.name.as_str(), body.boxes().unwrap_or_default()));
    let pair = case.electrodes.iter().flat_map(|pair| pair.names().into_iter().zip(pair.regions()));
    let pair = pair.map(|(name, region)| (name, vec![region]));
    match bodies.chain(pair).find(|(_, regions)| regions.iter().any(reaches)) {
        Some((body, _)) => Err(SceneError::ShortedByIndenter { body: body.to_owned() }),
        None => Ok(()),
    }
}

/// Whether no map changes the box of the indenter at any load.
fn is_straight(case: &Case) -> bool {
    let Some(mechanics) = case.mechanics.filter(|mechanics| mechanics.covers_all()) else { return false };
    let is_bent =
        case.electrodes.is_some() || case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
    !(is_bent && mechanics.is_finite_element())
}

/// The conductors at their positions in a step.
struct Places<'a, 'b> {
    case: &'a Case,
    /// Each conductor with its shapes, tilted as the pose says.
    conductors: Vec<(&'b Body, Vec<Shape>)>,
    /// The largest gap that counts as touching, m.
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

    /// Whether two shapes touch. Pairs without a box are left to the meshers.
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

    /// Refuses two conductors that have come together. `is_stretched`: bodies in the layer move relative to
    /// one another.
    fn check_apart(&self, is_stretched: bool) -> Result<(), SceneError> {
        let terminals = &self.case.terminals;
        for (k, (body, shapes)) in self.conductors.iter().enumerate() {
            for (other, others) in &self.conductors[..k] {
                let moves = body.purpose != other.purpose || (is_stretched && moves_with_material(body));
                let joined = || terminals.iter().any(|t| t.holds(&body.name) && t.holds(&other.name));
                if moves && self.any_touch(shapes, others) && !joined() {
                    let (first, second) = (other.name.clone(), body.name.clone());
                    return Err(SceneError::BodiesMeet { first, second });
                }
            }
        }
        Ok(())
    }

    /// Refuses conductors that touch a metal indenter whose lowest point is at the height `lowest`, m. A
    /// conductor that is grounded like the indenter may touch it; its name is returned.
    fn check_indenter(&self, lowest: f64) -> Result<Option<&'b str>, SceneError> {
        let Some(indenter) = indenter_in_field(self.case) else { return Ok(None) };
        let Role::Conductor { potential } = indenter.role else { return Ok(None) };
        let Some(form) = IndenterForm::of(self.case, indenter.height) else { return Ok(None) };
        let shapes = form.shapes(lowest);
        let mut touched: Option<&str> = None;
        for (body, _) in self.conductors.iter().filter(|(_, parts)| self.any_touch(parts, &shapes)) {
            let terminal = self.case.terminals.iter().find(|terminal| terminal.holds(&body.name));
            let is_grounded = potential == Potential::Grounded && terminal.is_some_and(|t| t.is_grounded);
            let is_same = touched.is_none_or(|touched| terminal.is_some_and(|t| t.holds(touched)));
            if !(is_grounded && is_same && is_straight(self.case)) {
                return Err(SceneError::TouchesIndenter { body: body.name.clone() });
            }
            touched = touched.or(Some(body.name.as_str()));
        }
        Ok(touched)
    }
}

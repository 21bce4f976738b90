//! A sharp punch in contact: which point of the surface lies at its corner.
//!
//! Under a flat punch with a sharp corner, without friction, the surface is split by one of its points: on one side of it the face
//! carries it, on the other it is free or lies at the flank. Which point that is, its place `X` at rest, is part of the solution: the
//! surface slides around the corner until the energy `E(X)` of the layer, least for every `X`, is least over `X` too. What does not
//! enter the punch is then all that is asked of the layer, and its least energy is the limit of punches whose corners
//! are rounded by a radius `r -> 0`.
//!
//! For each `X` the mesh has a fan around that point; the point is held at the corner, where it takes a force along both axes, and
//! everything else moves without friction along face and flank. `dE/dX`, with the deformed places of all nodes held, follows from the
//! energies of the elements of the fan, whose nodes at rest move with its centre. Secants find its zero, mostly in three to five steps.
//!
//! Under a force, compressions are pressed to from rest until one has nearly that force; secants go on from there.
//!
//! At a distance `d` from the corner the surface is stretched by about `d^(-1/2)`. That is integrable, the stored energy near the
//! corner falls with `d`, and the forces converge with the rings of the fan.

use super::press::PlaneLayer;
use crate::solid::dimension::{Element, Plane};
use crate::solid::element::ReferenceElement;
use crate::solid::force_goal::{NEAR, meet_force};
use crate::solid::layer::{LayerMesh, LayerModel, LayerStep};
use crate::solid::model::State;
use crate::solid::newton::{Effort, NewtonSettings, StopReason, Stopped};
use crate::solid::press::Goal;

/// How far the surface slides around the corner, over the compression and the half width, as observed from 0.5 to 3 thicknesses: a first
/// guess.
const SLIDE: f64 = 1.35;
/// The least part of the half width that a first guess leaves under the punch.
const LEAST: f64 = 0.1;
/// `X` over the thickness has this error, at most about. A force changes by less than 1e-4 with 1e-5.
const TOLERANCE: f64 = 2e-6;
/// The error of `X` over the compression, where that is less: the punch moves the point at its corner by about as much as itself.
const RELATIVE_TOLERANCE: f64 = 1e-4;
/// The least error of `X` over the thickness that rounding allows for.
const LEAST_TOLERANCE: f64 = 1e-11;
/// Steps to the zero of `dE/dX`.
const MAX_STEPS: usize = 25;
/// The longest of them, over the reach of the fan.
const LONGEST_STEP: f64 = 0.1;
/// How far the centre of a fan may move off the middle between its sides, over its reach, before a new mesh is made.
const FARTHEST: f64 = 0.3;
/// Step of the difference that gives `dE/dX`, over the reach of the fan.
const DIFFERENCE: f64 = 1e-5;
/// Relative distance from a force that is asked for.
const FORCE_TOLERANCE: f64 = 1e-5;
/// Newton steps after which a move of `X` is given up and halved.
const MAX_ITERATIONS: usize = 30;

/// A layer under a sharp punch on a mesh of one level.
struct Sliding<'a> {
    layer: &'a PlaneLayer,
    half_width: f64,
    level: usize,
    settings: NewtonSettings<'a>,
    mesh: LayerMesh,
    model: LayerModel,
    effort: Effort,
}

impl PlaneLayer {
    /// Presses a sharp punch of this half-width (m) to `goal` on the mesh of a level, starting from the equilibrium on a coarser one
    /// where there is one. The model has a mesh of its own, since the point at the corner depends on the load.
    ///
    /// # Errors
    /// [`Stopped`] says why no equilibrium was found.
    pub(super) fn press_sharp(
        &self,
        half_width: f64,
        level: usize,
        coarser: Option<(&LayerModel, &State)>,
        goal: Goal,
        settings: &NewtonSettings,
    ) -> Result<(LayerModel, LayerStep), Box<Stopped>> {
        let (mut sliding, start) = match (goal, coarser) {
            (Goal::Compression(compression), _) => {
                Sliding::at(self, half_width, level, compression, coarser, settings)?
            }
            (Goal::Force(_), Some((model, _))) => {
                Sliding::at(self, half_width, level, model.compression(), coarser, settings)?
            }
            (Goal::Force(force), None) => Sliding::near_force(self, half_width, level, force, settings)?,
        };
        let step = match goal {
            Goal::Compression(_) => start,
            Goal::Force(force) => {
                let press = &mut |next: f64, _: &NewtonSettings| sliding.press(next);
                meet_force(force, FORCE_TOLERANCE, settings, start, press)?
            }
        };
        Ok((sliding.model, step))
    }
}

/// Where the search for a force begins, and how many compressions are tried until one is near it.
pub(super) const FIRST_COMPRESSION: f64 = 0.05;
const MAX_TRIES: usize = 8;

/// Place at rest, in m, of the point of the surface that is at the corner of a punch of this half-width (m) under a compression: a first
/// guess.
pub(super) fn slid(half_width: f64, compression: f64) -> f64 {
    half_width * (1.0 - SLIDE * compression).max(LEAST)
}

fn stopped(reason: StopReason, effort: Effort) -> Box<Stopped> {
    let smallest_j = effort.smallest_j;
    Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j, element: 0, effort })
}

impl<'a> Sliding<'a> {
    /// The layer at rest, on a mesh for the point `end` (m) of the surface at the corner.
    fn new(
        layer: &'a PlaneLayer,
        half_width: f64,
        level: usize,
        end: f64,
        settings: &NewtonSettings<'a>,
    ) -> Result<Self, Box<Stopped>> {
        // Only a fan without room has no mesh, or an element that is turned inside out.
        let no_room = |_| stopped(StopReason::NoRoom, Effort::default());
        let mesh = layer.around_corner(end, level).map_err(no_room)?;
        let model = layer.model_on(&mesh).map_err(no_room)?;
        let effort = Effort::default();
        Ok(Self { layer, half_width, level, settings: *settings, mesh, model, effort })
    }

    /// The layer under a punch at a compression, on a mesh made for it: from the equilibrium on a coarser one where there is one.
    fn at(
        layer: &'a PlaneLayer,
        half_width: f64,
        level: usize,
        compression: f64,
        coarser: Option<(&LayerModel, &State)>,
        settings: &NewtonSettings<'a>,
    ) -> Result<(Self, LayerStep), Box<Stopped>> {
        let end = match coarser.and_then(|(model, _)| model.corner()) {
            Some(corner) => corner.end,
            None => slid(half_width, compression),
        };
        let mut sliding = Self::new(layer, half_width, level, end, settings)?;
        sliding.begin(compression, coarser)?;
        let step = sliding.slide()?;
        Ok((sliding, step))
    }

    /// The layer under about a force (N per metre of width). Forces grow about as a power of the compression. Each compression is pressed to
    /// from rest: that takes fewer linear systems than going on from a smaller one, since the surface slides around the corner on the way.
    fn near_force(
        layer: &'a PlaneLayer,
        half_width: f64,
        level: usize,
        force: f64,
        settings: &NewtonSettings<'a>,
    ) -> Result<(Self, LayerStep), Box<Stopped>> {
        let at = |compression| Self::at(layer, half_width, level, compression, None, settings);
        let (mut now, mut step) = at(FIRST_COMPRESSION)?;
        let mut power = 1.0;
        for _ in 0..MAX_TRIES {
            if (step.force / force - 1.0).abs() <= NEAR {
                break;
            }
            let before = step;
            let next = before.compression * (force / before.force).powf(1.0 / power);
            let effort = now.effort;
            (now, step) = match at(next.min(0.5 * (1.0 + before.compression))) {
                Ok(there) => there,
                Err(stopped) if stopped.reason == StopReason::Cancelled => return Err(stopped),
                // It may be too deep; secants go on from what there is in smaller steps.
                Err(_) => break,
            };
            now.effort = now.effort.after(effort);
            step.effort = step.effort.after(effort);
            let growth = (step.force / before.force).ln() / (step.compression / before.compression).ln();
            power = if growth >= 1.0 { growth } else { 1.0 };
        }
        Ok((now, step))
    }

    /// Finds the equilibrium at a compression for the point at the corner that the mesh was made for.
    fn begin(
        &mut self,
        compression: f64,
        coarser: Option<(&LayerModel, &State)>,
    ) -> Result<(), Box<Stopped>> {
        let taken = coarser
            .and_then(|(model, state)| self.model.take_over(model, state, compression, &self.settings));
        let step = match taken {
            Some(step) => step,
            None => self.model.press(compression, &self.settings)?,
        };
        self.count(step.effort);
        Ok(())
    }

    fn count(&mut self, effort: Effort) {
        self.effort = effort.after(self.effort);
    }

    /// Reach of the fan towards either side, in m; the smaller one.
    fn reach(&self) -> f64 {
        let Some(fan) = &self.mesh.punch else { return 0.0 };
        let [left, right] = fan.along.map(|k| self.mesh.along[k]);
        0.5 * (right - left)
    }

    /// Place at rest, in m, of the point at the corner.
    fn end(&self) -> f64 {
        self.mesh.punch.as_ref().map_or(self.half_width, |fan| fan.corner)
    }

    /// Moves the indenter on to a compression, and lets the surface slide.
    fn press(&mut self, compression: f64) -> Result<LayerStep, Box<Stopped>> {
        // It has slid in proportion to the compression, nearly.
        let slid = self.half_width - self.end();
        let end = self.half_width - slid * compression / self.model.compression();
        let end = end.clamp(LEAST * self.half_width, self.half_width);
        if self.move_to(end).is_err() || self.model.press(compression, &self.settings).is_err() {
            self.renew(end, compression)?;
        }
        self.slide()
    }

    /// A new mesh for the point `end` at the corner, and the equilibrium there.
    fn renew(&mut self, end: f64, compression: f64) -> Result<(), Box<Stopped>> {
        let effort = self.effort;
        *self = Self::new(self.layer, self.half_width, self.level, end, &self.settings)?;
        self.effort = effort;
        self.begin(compression, None)
    }

    /// Takes the equilibrium to that with the point `end` (m) at the corner.
    fn move_to(&mut self, end: f64) -> Result<(), Box<Stopped>> {
        let Some(fan) = &self.mesh.punch else { return Ok(()) };
        let [left, right] = fan.along.map(|k| self.mesh.along[k]);
        if (end - 0.5 * (left + right)).abs() > FARTHEST * self.reach() {
            return self.renew(end, self.model.compression());
        }
        let mesh = with_corner(&self.mesh, end);
        let settings = NewtonSettings { max_iterations: MAX_ITERATIONS, ..self.settings };
        match self.model.slide_to(&mesh, &settings) {
            Ok(effort) => {
                self.mesh = mesh;
                self.count(effort);
                Ok(())
            }
            Err(_) => self.renew(end, self.model.compression()),
        }
    }

    /// Lets the surface slide around the corner until the energy is least.
    fn slide(&mut self) -> Result<LayerStep, Box<Stopped>> {
        let thickness = self.mesh.thickness();
        let of_compression = RELATIVE_TOLERANCE * self.model.compression();
        let tolerance = of_compression.clamp(LEAST_TOLERANCE, TOLERANCE) * thickness;
        let longest = LONGEST_STEP * self.reach();
        let (mut at, mut slope) = (self.end(), self.material_force());
        let modulus = self.layer.rubber.shear_modulus();
        // A guess for the first step: as observed.
        let mut stiffness = modulus * (1.0 + 10.0 * self.model.compression());
        let (mut low, mut high) = (0.0, self.half_width);
        for _ in 0..MAX_STEPS {
            if slope > 0.0 {
                high = at
            } else {
                low = at
            }
            let step = -slope / stiffness;
            if step.abs() <= tolerance {
                let effort = Effort { smallest_j: self.model.smallest_j(), ..self.effort };
                return Ok(self.model.step(effort));
            }
            let mut next = at + step.clamp(-longest, longest);
            if !(low < next && next < high) {
                next = 0.5 * (low + high);
            }
            self.move_to(next)?;
            let found = self.material_force();
            let secant = (found - slope) / (next - at);
            // Where the energy is not a valley here, the next step is a long one downhill.
            stiffness = if secant > 0.0 { secant } else { stiffness };
            (at, slope) = (next, found);
        }
        Err(stopped(StopReason::NoConvergence, self.effort))
    }

    /// `dE/dX` in N per metre of width of the half that is solved.
    fn material_force(&self) -> f64 {
        let step = DIFFERENCE * self.reach();
        let [before, after] = [-step, step].map(|by| with_corner(&self.mesh, self.end() + by).mesh().nodes);
        let (equations, state) = (self.model.equations(), self.model.state());
        let body = equations.body();
        let energy = |e: usize, nodes: &[[f64; 2]]| -> f64 {
            let rest = &body.mesh.nodes;
            let numbers = body.mesh.elements[e].iter().map(|&n| n as usize);
            let places: Vec<[f64; 2]> = numbers.clone().map(|n| nodes[n]).collect();
            // The deformed places stay.
            let u: Vec<f64> = numbers
                .flat_map(|n| [0, 1].map(|k| state.displacement[2 * n + k] + rest[n][k] - nodes[n][k]))
                .collect();
            let rubber = &body.rubbers[body.material[e] as usize];
            <ReferenceElement as Element<Plane>>::new(&places)
                .map_or(0.0, |element| element.energy(rubber, &u, &state.pressure[e]))
        };
        let moves =
            |e: &usize| body.mesh.elements[*e].iter().any(|&n| before[n as usize] != after[n as usize]);
        (0..body.mesh.elements.len())
            .filter(moves)
            .map(|e| (energy(e, &after) - energy(e, &before)) / (2.0 * step))
            .sum()
    }
}

/// The `mesh` with the centre of its fan at `corner` (m).
fn with_corner(mesh: &LayerMesh, corner: f64) -> LayerMesh {
    let mut mesh = mesh.clone();
    if let Some(fan) = &mut mesh.punch {
        fan.corner = corner;
    }
    mesh
}

impl LayerModel {
    /// Makes the centre of the fan of `mesh`, which differs in nothing else from that of the model, the point at the corner, and finds
    /// the equilibrium; deformed places are the first guess.
    fn slide_to(&mut self, mesh: &LayerMesh, settings: &NewtonSettings) -> Result<Effort, StopReason> {
        let nodes = mesh.mesh().nodes;
        let before = self.equations().body().mesh.nodes.clone();
        let mut state = self.state().clone();
        let keep_places = |state: &mut State| {
            for (n, (old, new)) in before.iter().zip(&nodes).enumerate() {
                for k in 0..2 {
                    state.displacement[2 * n + k] += old[k] - new[k];
                }
            }
        };
        keep_places(&mut state);
        if let Some(moving) = &mut state.moving {
            keep_places(moving);
        }
        self.settle_on(nodes, mesh.punch.as_ref().map_or(0.0, |fan| fan.corner), state, settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::layer::{End, Indenter};
    use elastocap_materials::Rubber;

    const HALF_WIDTH: f64 = 500.0 / 450.0;

    fn layer() -> PlaneLayer {
        PlaneLayer {
            thickness: 1.0,
            half_length: 6.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: Indenter::Sharp { half_width: HALF_WIDTH },
            position: 0.0,
            end: End::Free,
        }
    }

    fn pressed(goal: Goal) -> (LayerModel, LayerStep) {
        let layer = layer();
        layer.press_sharp(HALF_WIDTH, 1, None, goal, &NewtonSettings::default()).unwrap()
    }

    /// Of both halves.
    fn stored_energy(model: &LayerModel) -> f64 {
        let (equations, state, rubber) = (model.equations(), model.state(), layer().rubber_in_use());
        let of_element = |e: usize| {
            let u = equations.gather(e, &state.displacement);
            equations.elements[e].energy(&rubber, &u, &state.pressure[e])
        };
        2.0 * (0..equations.elements.len()).map(of_element).sum::<f64>()
    }

    #[test]
    fn the_force_is_the_slope_of_the_energy_though_the_surface_slides_around_the_corner() {
        let [before, here, after] =
            [0.199, 0.2, 0.201].map(|compression| pressed(Goal::Compression(compression)));
        let slope = (stored_energy(&after.0) - stored_energy(&before.0)) / 2e-3;
        let slid = |model: &LayerModel| HALF_WIDTH - model.corner().unwrap().end;
        println!("{slope} {} {}", here.1.force, slid(&here.0));
        assert!((slope / here.1.force - 1.0).abs() < 2e-4, "{slope} and not {}", here.1.force);
        assert!(slid(&before.0) < slid(&here.0) && slid(&here.0) < slid(&after.0));
        // 0.307 on finer meshes.
        assert!((slid(&here.0) - 0.307).abs() < 0.01, "{}", slid(&here.0));
        assert!(here.1.imbalance < 1e-6 && here.0.fault(here.1.force).is_none());
    }

    #[test]
    fn a_large_force_on_a_wide_punch_leads_to_the_compression_that_has_it() {
        let half_width = 6.0;
        let indenter = Indenter::Sharp { half_width };
        let wide = PlaneLayer { half_length: 24.0, end: End::FreeOnSubstrate, indenter, ..layer() };
        let press = |goal| {
            wide.press_sharp(half_width, 0, None, goal, &NewtonSettings::default()).map(|(_, step)| step)
        };
        let found = press(Goal::Force(160.0)).unwrap();
        let there = press(Goal::Compression(found.compression)).unwrap();
        assert!((found.force / 160.0 - 1.0).abs() < 2.0 * FORCE_TOLERANCE, "{found:?}");
        // Its fan lies elsewhere on the coarsest mesh, whose force is known to 1e-3.
        assert!((there.force / 160.0 - 1.0).abs() < 1e-3, "{there:?}");
    }

    #[test]
    fn at_the_corner_the_energy_is_least_over_the_point_that_lies_there() {
        let layer = layer();
        let settings = NewtonSettings::default();
        let (model, _) = layer.press_sharp(HALF_WIDTH, 0, None, Goal::Compression(0.1), &settings).unwrap();
        let found = model.corner().unwrap().end;
        let mut sliding = Sliding::new(&layer, HALF_WIDTH, 0, found, &settings).unwrap();
        sliding.begin(0.1, None).unwrap();
        let mut at = |by: f64| {
            sliding.move_to(found + by).unwrap();
            (stored_energy(&sliding.model), 2.0 * sliding.material_force())
        };
        let [low, least, high] = [-0.01, 0.0, 0.01].map(&mut at);
        println!("{low:?} {least:?} {high:?}");
        assert!(low.0 > least.0 && high.0 > least.0);
        assert!(low.1 < -0.03 && high.1 > 0.03 && least.1.abs() < 5e-3);
        // The slope of the energy is what its values say, by Simpson's rule.
        let slope = (low.1 + 4.0 * least.1 + high.1) / 6.0;
        let difference = (high.0 - low.0) / 0.02;
        assert!((difference - slope).abs() < 5e-3 * high.1, "{difference} and not {slope}");
    }

    #[test]
    fn a_force_leads_back_to_the_compression_that_it_came_from() {
        let (_, step) = pressed(Goal::Compression(0.13));
        let (model, back) = pressed(Goal::Force(step.force));
        // The fan has another rim: that is another mesh.
        assert!((back.compression / 0.13 - 1.0).abs() < 1e-3, "{}", back.compression);
        assert!((model.compression() - back.compression).abs() < 1e-12);
    }
}

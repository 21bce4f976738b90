//! The first mesh of a load: from a sharp punch of the same width, which a rounded one is seen from afar.
//!
//! Off the middle of the layer no sharp punch is solved. What lies to the right of the middle of the punch is taken for one half of a
//! layer with the punch on its middle, and so is what lies to the left. The two find their first meshes each for itself; put together, they
//! are a first guess for the whole, which differs from them by how the one side pushes the other one along.

use super::super::layer::{Inclusion, Indenter, LayerMesh, LayerModel, RoundedPunch};
use super::super::layer_mesh::about;
use super::super::levels::around_corners;
use super::super::newton::{NewtonSettings, StopReason, Stopped};
use super::super::press::{Goal, PlaneLayer, deepest};
use super::mesh::Fineness;
use super::{Other, Pressed, Rounded, compression_at, stopped};

/// Linear systems that following the load from rest may take.
const MAX_SOLVES_FROM_REST: usize = 3000;
/// Radius over the thickness that the coarsest fan under a sharp punch serves; each level of refinement serves half of it.
const SHARP_RADIUS: f64 = 0.02;
/// The finest level that is used for that.
const MAX_SHARP_LEVEL: f64 = 8.0;
/// Other values of [`Fineness::passing`] on the first mesh, where the usual one leads to no equilibrium.
const OTHER_FIRST: [f64; 4] = [0.5, 0.3, 0.75, 0.25];
/// Force over that of a sharp punch up to which the surface counts as free on a coarse mesh.
const HELD_BACK: f64 = 1.01;
/// Parts of a load from which it is followed where a sharp punch gives no first guess, and the least of them that is worth while where
/// there is one on which the surface is held back.
const SMALLER: [f64; 5] = [0.99, 0.97, 0.9, 0.75, 0.5];
const LEAST_WORTH: f64 = 0.95;
/// Longest step on that way from mesh to mesh, over the radius and the thickness, and the shortest one, over the longest.
const STEP: f64 = 1.0;
const SHORTEST_STEP: f64 = 0.1;
/// How many of them are tried.
const MAX_STEPS: usize = 20;
/// Sides of the first mesh that pass the corner up to which following the load from rest costs less than run-ups on that mesh and others.
const FEW_SIDES: f64 = 40.0;

/// A layer under a sharp punch.
struct Sharp {
    model: LayerModel,
    force: f64,
}

impl Sharp {
    /// Whether a rounded punch of the same width takes no more force, as it should. On coarse meshes the sides at the corner may hold the
    /// surface back, as friction does, and finer meshes that start from there are slow to lose that.
    fn is_free(&self, rounded: &Pressed) -> bool {
        rounded.step.force <= HELD_BACK * self.force
    }
}

/// Takes a layer over from its state on another mesh.
type Begin<'a> = dyn Fn(Other<'_>, Fineness) -> Result<Pressed, Box<Stopped>> + 'a;

impl Rounded<'_> {
    /// The layer on the coarsest mesh: from a sharp punch or, off the middle, from its two halves. Where they lead to no equilibrium, by
    /// following the load from rest on a mesh that is fine all along the way.
    pub(super) fn first(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let begun = match self.punch.position {
            0.0 => self.begin_from_sharp(goal),
            _ => self.begin_from_halves(goal),
        };
        match begun {
            Err(stopped) if stopped.reason != StopReason::Cancelled => self.follow_from_rest(goal),
            first => first,
        }
    }

    /// The layer on the coarsest mesh by following the load from rest, on a mesh that is fine all along the way.
    fn follow_from_rest(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let (layer, punch, fineness) = (self.layer, &self.punch, Fineness::FIRST);
        let [height, length] = [layer.thickness, layer.half_length];
        let cells = fineness.cells as usize;
        let mut mesh =
            LayerMesh::under_rounded_punch(height, length, punch, deepest(&[goal]), cells, fineness.passing);
        layer.fit_to_inclusions([&mut mesh.along, &mut mesh.up], [&[], &[]], fineness.at_edges * height);
        let mut model = self.model(&mesh)?;
        let settings = NewtonSettings {
            cancel: self.cancel,
            max_solves: MAX_SOLVES_FROM_REST,
            ..around_corners(punch.corner_radius, fineness.passing)
        };
        let step = match goal {
            Goal::Compression(compression) => model.press(compression, &settings)?,
            Goal::Force(force) => model.press_with(force, &settings)?,
        };
        Ok(Pressed { mesh, model, step, fineness })
    }

    /// The layer on the mesh of the first level from its halves, each of them pressed as one half of a layer with the punch on its middle.
    fn begin_from_halves(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let halves = [1.0, -1.0].map(|side| self.half(side));
        let punch = RoundedPunch { position: 0.0, ..self.punch };
        let [right, left] = halves.each_ref().map(|layer| Rounded { layer, punch, ..*self });
        let compression = match goal {
            Goal::Compression(compression) => compression,
            // The shorter half yields more than the longer one. Between the two:
            Goal::Force(_) => {
                let [right, left] = [right.first(goal)?, left.first(goal)?];
                0.5 * (right.model.compression() + left.model.compression())
            }
        };
        let fineness = Fineness::of(0);
        let press = |half: &Rounded<'_>| {
            let first = half.first(Goal::Compression(compression))?;
            half.next(&first, fineness, compression)
        };
        let [right, left] = [press(&right)?, press(&left)?];
        let position = self.punch.position;
        let mesh = LayerMesh {
            along: about(position, &left.mesh.along, &right.mesh.along),
            end_top: right.mesh.end_top.iter().map(|x| position + x).collect(),
            ..right.mesh
        };
        let mut joined = self.model(&mesh)?;
        if !joined.join([&right.model, &left.model], position, compression) {
            return Err(stopped(StopReason::NoConvergence, &joined));
        }
        self.take_over((&joined, joined.state(), fineness), fineness, compression, 0)
    }

    /// What lies to one side of the middle of the punch, 1 to the right and -1 to the left, as one half of a layer with the punch on its
    /// middle.
    fn half(&self, side: f64) -> PlaneLayer {
        let position = self.punch.position;
        let away = |x: f64| side * (x - position);
        let inclusions = self.layer.inclusions.iter().map(|inclusion| {
            let [one, other] = [inclusion.min[0], inclusion.max[0]].map(away);
            let (min, max) = ([one.min(other), inclusion.min[1]], [one.max(other), inclusion.max[1]]);
            Inclusion { min, max, rubber: inclusion.rubber.clone() }
        });
        let half_length = self.layer.half_length - side * position;
        PlaneLayer { half_length, position: 0.0, inclusions: inclusions.collect(), ..self.layer.clone() }
    }

    /// The layer on the coarsest mesh from a sharp punch of the same width. Where the two are too far apart at this load, from one at a
    /// smaller load, and from there on mesh after mesh.
    fn begin_from_sharp(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let half_width = self.punch.half_width;
        let layer = PlaneLayer { indenter: Indenter::Sharp { half_width }, ..self.layer.clone() };
        let press = |coarser: Option<&Sharp>, level: usize, goal| -> Result<Sharp, Box<Stopped>> {
            let settings = NewtonSettings { cancel: self.cancel, ..layer.settings(level) };
            let coarser = coarser.map(|sharp| (&sharp.model, sharp.model.state()));
            let (model, step) = layer.press_sharp(half_width, level, coarser, goal, &settings)?;
            Ok(Sharp { model, force: step.force })
        };
        // The fan of the sharp punch has to be about as fine as the corner.
        let halvings = (SHARP_RADIUS * layer.thickness / self.punch.corner_radius).log2().ceil();
        let level = halvings.clamp(0.0, MAX_SHARP_LEVEL) as usize;
        let sharp =
            |goal| (1..=level).try_fold(press(None, 0, goal)?, |last, level| press(Some(&last), level, goal));
        let there = sharp(goal)?;
        let asked = compression_at(goal, &there.model);
        let is_free = |best: &Result<Pressed, _>| best.as_ref().is_ok_and(|found| there.is_free(found));
        let found = |from: Other<'_>, to| self.take_over(from, to, asked, 0);
        let sides = self.punch.sides_passing(layer.thickness, asked, Fineness::FIRST.passing);
        let mut best;
        if sides <= FEW_SIDES {
            best = self.begin_from_state_of(&there, &|from: Other<'_>, to| {
                self.near(from, to, asked).ok_or_else(|| stopped(StopReason::NoConvergence, from.0))
            });
            if !is_free(&best) && !self.cancelled() {
                best = least_force(best, self.follow_from_rest(Goal::Compression(asked)));
            }
            if !is_free(&best) && !self.cancelled() {
                let run_up = |from: Other<'_>, to| self.run_up(from, to, asked);
                best = least_force(best, self.begin_from_state_of(&there, &run_up));
            }
        } else {
            best = self.begin_from_state_of(&there, &found);
        }
        if !is_free(&best) && !self.cancelled() {
            let finer = press(Some(&there), level + 1, goal);
            best = least_force(best, finer.and_then(|finer| self.begin_from_state_of(&finer, &found)));
        }
        for part in SMALLER {
            if is_free(&best) || best.is_ok() && part < LEAST_WORTH || self.cancelled() {
                break;
            }
            let smaller = part * asked;
            let found = |from: Other<'_>, to| self.take_over(from, to, smaller, 0);
            let sharp = sharp(Goal::Compression(smaller));
            let before = sharp.and_then(|sharp| self.begin_from_state_of(&sharp, &found));
            best = least_force(best, before.and_then(|before| self.further(before, asked)));
        }
        best
    }

    /// The layer on the coarsest mesh from a sharp punch: on one of several meshes, until the surface is free on it, or on that where it
    /// is held back the least.
    fn begin_from_state_of(&self, sharp: &Sharp, begin: &Begin<'_>) -> Result<Pressed, Box<Stopped>> {
        let from = (&sharp.model, sharp.model.state(), Fineness::FIRST);
        let mut best = begin(from, Fineness::FIRST);
        for passing in OTHER_FIRST {
            if best.as_ref().is_ok_and(|found| sharp.is_free(found)) || self.cancelled() {
                break;
            }
            best = least_force(best, begin(from, Fineness { passing, ..Fineness::FIRST }));
        }
        best
    }

    /// From a layer to the same under a larger load, with a new mesh wherever another piece of the surface has come to the corner.
    fn further(&self, mut now: Pressed, compression: f64) -> Result<Pressed, Box<Stopped>> {
        let longest = STEP * self.punch.corner_radius / self.layer.thickness;
        let mut step = longest;
        for _ in 0..MAX_STEPS {
            let left = compression - now.model.compression();
            let next = if left <= 1.001 * step { compression } else { now.model.compression() + step };
            match self.take_over((&now.model, now.model.state(), now.fineness), now.fineness, next, 0) {
                Ok(there) if next == compression => return Ok(there),
                Ok(there) => (now, step) = (there, (2.0 * step).min(longest)),
                Err(stopped) if step < SHORTEST_STEP * longest || self.cancelled() => return Err(stopped),
                Err(_) => step *= 0.5,
            }
        }
        Err(stopped(StopReason::TooLong, &now.model))
    }
}

/// The one with less force.
fn least_force(
    one: Result<Pressed, Box<Stopped>>,
    other: Result<Pressed, Box<Stopped>>,
) -> Result<Pressed, Box<Stopped>> {
    match (one, other) {
        (Ok(one), Ok(other)) if other.step.force < one.step.force => Ok(other),
        (Err(_), other) => other,
        (one, _) => one,
    }
}

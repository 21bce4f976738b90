//! A punch with rounded corners: a mesh for each load.
//!
//! The surface slides around the corner and is stretched there, six times and more. What lies at the corner has to have sides that are short
//! against its radius; what has passed it, or has not reached it yet, need not. Equilibrium without friction has no memory, so that each
//! load gets a mesh of its own, fine only where the surface lies at the corner under this load. Where that is, and how much the
//! surface is stretched there, is read off the deformed surface on a coarser mesh: its sides are given their lengths after
//! loading. On the first mesh the surface is that under a sharp punch of the same width, which is a rounded one seen from afar.
//!
//! The equilibrium is searched near that of the coarser mesh. Where Newton's method does not find it, a mesh is put between the two, and
//! in the end the punch starts a little above the load, clear of the surface, and goes the rest of the way.

use std::sync::atomic::{AtomicBool, Ordering};

use super::force_goal::meet_force;
use super::layer::{Indenter, LayerMesh, LayerModel, LayerStep, RoundedPunch};
use super::levels::{around_corners, move_to, refine_toward};
use super::mesh::{geometric, graded, graded_between, uniform};
use super::model::State;
use super::newton::{Effort, FromCoarser, NewtonSettings, StopReason, Stopped};
use super::press::{Goal, PlaneLayer, deepest};

/// Distance from the middle of the corner's arc, over its radius, within which sides are equally short.
const PLATEAU: f64 = 1.5;
/// Growth of the length of sides per distance from there, and of the height of elements per depth.
const GROWTH: f64 = 0.25;
/// The same from the edges of inclusions, where stress is singular and strain small.
const GROWTH_FROM_EDGES: f64 = 0.4;
/// Pieces of the line between two nodes of the surface in which the length of sides is constant.
const PIECES: usize = 8;
/// Linear systems after which an equilibrium near that of the coarser mesh is not searched any longer.
const MAX_SOLVES_NEAR: usize = 70;
/// The same where the load is followed from rest.
const MAX_SOLVES_FROM_REST: usize = 3000;
/// Longest move of the punch where it goes the rest of the way, in sides at its corner.
const LONGEST_MOVE: f64 = 0.45;
/// Radius over the thickness that the coarsest fan under a sharp punch serves; each level of refinement serves half of it.
const SHARP_RADIUS: f64 = 0.02;
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
/// Places on either side of the corner between which the length of sides at rest is read off.
const AT_REST: usize = 100;
/// How often a mesh half as fine is put between two whose equilibria are too far apart.
const HALFWAY: usize = 2;
/// Compressions that differ by no more than this, over the radius and the thickness, share a mesh.
const SAME_MESH: f64 = 0.5;

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fineness {
    /// Sides over the radius of the corner, where the surface lies at it.
    passing: f64,
    /// Elements over the thickness far from the corner.
    cells: f64,
    /// Size of the elements at the edges of inclusions, over the thickness.
    at_edges: f64,
}

impl Fineness {
    /// Of the mesh that takes over from a sharp punch.
    const FIRST: Self = Self { passing: 0.375, cells: 8.0, at_edges: 0.1 };

    fn of(level: usize) -> Self {
        let halved = 0.5_f64.powi(level as i32);
        Self { passing: 1.0 / halved, cells: 8.0 / halved.powf(0.25), at_edges: 0.00625 * halved }
    }

    /// Between this and a finer one.
    fn halfway(self, to: Self) -> Self {
        Self {
            passing: (self.passing * to.passing).sqrt(),
            cells: (self.cells * to.cells).sqrt(),
            at_edges: (self.at_edges * to.at_edges).sqrt(),
        }
    }
}

/// A layer on a mesh for one load.
struct Pressed {
    model: LayerModel,
    step: LayerStep,
    fineness: Fineness,
}

/// A layer under a punch with rounded corners on the middle of its top.
struct Rounded<'a> {
    layer: &'a PlaneLayer,
    punch: RoundedPunch,
    cancel: Option<&'a AtomicBool>,
}

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

impl PlaneLayer {
    /// Presses a punch with rounded corners to `goal` on a mesh of a level, starting from the equilibrium on a coarser one where there is
    /// one. The model has a mesh of its own.
    ///
    /// # Errors
    /// Why there is no equilibrium.
    pub(super) fn press_rounded(
        &self,
        punch: RoundedPunch,
        level: usize,
        coarser: Option<(&LayerModel, &State)>,
        goal: Goal,
        settings: &NewtonSettings,
    ) -> Result<(LayerModel, LayerStep), Box<Stopped>> {
        let rounded = Rounded { layer: self, punch, cancel: settings.cancel };
        let fineness = Fineness::of(level);
        let start = match coarser {
            Some((model, state)) => {
                let from = (model, state, level.checked_sub(1).map_or(Fineness::FIRST, Fineness::of));
                rounded.take_over(from, fineness, compression_at(goal, model), HALFWAY)?
            }
            None => {
                let first = rounded.first(goal)?;
                let compression = compression_at(goal, &first.model);
                let next = |from: Pressed, level| rounded.next(&from, Fineness::of(level), compression);
                (0..=level).try_fold(first, next)?
            }
        };
        let Goal::Force(force) = goal else { return Ok((start.model, start.step)) };
        let mut now = start;
        let first = now.step;
        let tolerance = settings.tolerance.max(1e-10);
        let step = meet_force(force, tolerance, settings, first, &mut |next, _| {
            let far = SAME_MESH * punch.corner_radius / self.thickness;
            let near = (next - now.model.compression()).abs() <= far;
            let on_same_mesh =
                near.then(|| now.model.press(next, &rounded.settings(fineness)).ok()).flatten();
            match on_same_mesh {
                Some(step) => now.step = step,
                None => now = rounded.next(&now, fineness, next)?,
            }
            Ok(now.step)
        })?;
        Ok((now.model, step))
    }

    /// The mesh for a punch with rounded corners on the middle of the layer before it is pressed.
    pub(super) fn mesh_at_corner(&self, punch: RoundedPunch, level: usize) -> LayerMesh {
        // Places ever closer to the corner.
        let [to_axis, to_end] = [punch.half_width, self.half_length - punch.half_width];
        let inside = geometric(0.8, AT_REST).into_iter().rev().map(|part| punch.half_width - part * to_axis);
        let outside =
            geometric(0.8, AT_REST).into_iter().skip(1).map(|part| punch.half_width + part * to_end);
        let at_rest: Vec<_> = inside.chain(outside).map(|x| [[x, self.thickness]; 2]).collect();
        self.mesh_where_corner_is(punch, Fineness::of(level), &at_rest, 0.0)
    }

    /// The mesh for a punch at a compression under which the top lies about at `surface`: places at rest and after loading, in m.
    fn mesh_where_corner_is(
        &self,
        punch: RoundedPunch,
        fineness: Fineness,
        surface: &[[[f64; 2]; 2]],
        compression: f64,
    ) -> LayerMesh {
        let (height, body, radius) = (self.thickness, self.half_length - self.thickness, punch.corner_radius);
        let (coarse, fine) = (height / fineness.cells, radius / fineness.passing);
        let from_edges = |x: f64, axis: usize| {
            self.edges(axis).fold(f64::INFINITY, |least, edge| {
                least.min(fineness.at_edges * height + GROWTH_FROM_EDGES * (x - edge).abs())
            })
        };
        // The middle of the corner's arc.
        let inside = radius * (1.0 - 0.5_f64.sqrt());
        let arc = [punch.half_width - inside, height * (1.0 - compression) + inside];
        let (mut places, mut steps) = (Vec::new(), Vec::new());
        for two in surface.windows(2) {
            let [[from, start], [to, end]] = [two[0], two[1]];
            let (rest, now) = (to[0] - from[0], (end[0] - start[0]).hypot(end[1] - start[1]));
            for part in (0..PIECES).map(|k| k as f64 / PIECES as f64) {
                let place = from[0] + part * rest;
                if place >= (1.0 - 1e-9) * body {
                    break;
                }
                let middle: [f64; 2] =
                    std::array::from_fn(|k| start[k] + (part + 0.5 / PIECES as f64) * (end[k] - start[k]));
                let away = (middle[0] - arc[0]).hypot(middle[1] - arc[1]) - PLATEAU * radius;
                let after = fine + GROWTH * away.max(0.0);
                let far = if place < punch.half_width { coarse } else { 2.0 * coarse };
                let before = far.min(from_edges(place, 0));
                places.push(place);
                steps.push((now / after).max(rest / before) / PIECES as f64);
            }
        }
        places.push(body);
        let mut along = graded_between(&places, |k| steps[k]);
        let size = |y: f64| (fine + GROWTH * (height - y)).min(coarse).min(from_edges(y, 1));
        let mut up = graded(0.0, height, size);
        move_to(&mut along, &[], self.edges(0));
        move_to(&mut up, &[], self.edges(1));
        // Between places of the surface that are far apart an edge may have been missed.
        refine_toward(&mut along, self.edges(0), fineness.at_edges * height);
        refine_toward(&mut up, self.edges(1), fineness.at_edges * height);
        let end = (0.5 * fineness.cells).round() as usize;
        let end_top = uniform(body, self.half_length, end);
        LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: None, whole: false }
    }
}

impl<'a> Rounded<'a> {
    /// The layer on the coarsest mesh: from a sharp punch, or, where that one has no equilibrium, by following the load from rest on a mesh
    /// that is fine all along the way.
    fn first(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let fineness = Fineness::FIRST;
        match self.from_sharp(goal) {
            Err(stopped) if stopped.reason != StopReason::Cancelled => {}
            first => return first,
        }
        let (layer, punch) = (self.layer, &self.punch);
        let [height, length] = [layer.thickness, layer.half_length];
        let cells = fineness.cells as usize;
        let mesh =
            LayerMesh::under_rounded_punch(height, length, punch, deepest(&[goal]), cells, fineness.passing);
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
        Ok(Pressed { model, step, fineness })
    }

    /// The layer on the coarsest mesh from a sharp punch of the same width. Where the two are too far apart at this load, from one at a
    /// smaller load, and from there on mesh after mesh.
    fn from_sharp(&self, goal: Goal) -> Result<Pressed, Box<Stopped>> {
        let half_width = self.punch.half_width;
        let layer = PlaneLayer { indenter: Indenter::Sharp { half_width }, ..self.layer.clone() };
        let press = |coarser: Option<&Sharp>, level: usize, goal| -> Result<Sharp, Box<Stopped>> {
            let settings = NewtonSettings { cancel: self.cancel, ..layer.settings(level) };
            let coarser = coarser.map(|sharp| (&sharp.model, sharp.model.state()));
            let (model, step) = layer.press_sharp(half_width, level, coarser, goal, &settings)?;
            Ok(Sharp { model, force: step.force })
        };
        // The fan of the sharp punch has to be about as fine as the corner.
        let level =
            (SHARP_RADIUS * layer.thickness / self.punch.corner_radius).log2().ceil().max(0.0) as usize;
        let sharp =
            |goal| (1..=level).try_fold(press(None, 0, goal)?, |last, level| press(Some(&last), level, goal));
        let there = sharp(goal)?;
        let asked = compression_at(goal, &there.model);
        let mut best = self.from_state_of(&there, asked);
        if !best.as_ref().is_ok_and(|found| there.is_free(found)) && !self.cancelled() {
            let finer = press(Some(&there), level + 1, goal);
            best = least_force(best, finer.and_then(|finer| self.from_state_of(&finer, asked)));
        }
        for part in SMALLER {
            let free = best.as_ref().is_ok_and(|found| there.is_free(found));
            if free || best.is_ok() && part < LEAST_WORTH || self.cancelled() {
                break;
            }
            let goal = Goal::Compression(part * asked);
            let before = sharp(goal).and_then(|sharp| self.from_state_of(&sharp, part * asked));
            best = least_force(best, before.and_then(|before| self.further(before, asked)));
        }
        best
    }

    /// The layer on the coarsest mesh from a sharp punch: on one of several meshes, until the surface is free on it, or on that where it
    /// is held back the least.
    fn from_state_of(&self, sharp: &Sharp, compression: f64) -> Result<Pressed, Box<Stopped>> {
        let from = (&sharp.model, sharp.model.state(), Fineness::FIRST);
        let mut best = self.take_over(from, Fineness::FIRST, compression, 0);
        for passing in OTHER_FIRST {
            if best.as_ref().is_ok_and(|found| sharp.is_free(found)) || self.cancelled() {
                break;
            }
            let other = self.take_over(from, Fineness { passing, ..Fineness::FIRST }, compression, 0);
            best = least_force(best, other);
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

    fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// The layer at rest.
    fn model(&self, mesh: &LayerMesh) -> Result<LayerModel, Box<Stopped>> {
        let layer = self.layer;
        let rubber = layer.rubber_in_use();
        let model = LayerModel::with_inclusions(mesh, &rubber, &layer.inclusions, layer.indenter, layer.end);
        // Only a mesh too large for the numbers of its nodes has none.
        model.map_err(|_| {
            let (reason, effort) = (StopReason::TooLong, Effort::default());
            Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j: 1.0, element: 0, effort })
        })
    }

    fn settings(&self, fineness: Fineness) -> NewtonSettings<'a> {
        let radius = self.punch.corner_radius;
        NewtonSettings {
            cancel: self.cancel,
            longest_move: LONGEST_MOVE * radius / fineness.passing,
            ..around_corners(radius, fineness.passing)
        }
    }

    /// From a layer on one mesh to another one.
    fn next(&self, from: &Pressed, to: Fineness, compression: f64) -> Result<Pressed, Box<Stopped>> {
        self.take_over((&from.model, from.model.state(), from.fineness), to, compression, HALFWAY)
    }

    /// The layer at a compression on a mesh of the fineness `to`, from its state on another one at about that compression. Where that is
    /// too far away, by meshes between the two, which are put there up to `halfway` times; at last by a run-up.
    fn take_over(
        &self,
        from: (&LayerModel, &State, Fineness),
        to: Fineness,
        compression: f64,
        halfway: usize,
    ) -> Result<Pressed, Box<Stopped>> {
        let (other, state, fineness) = from;
        let mesh = self.layer.mesh_where_corner_is(self.punch, to, &surface(other, state), compression);
        let mut model = self.model(&mesh)?;
        let run_up = self.settings(to);
        let near =
            NewtonSettings { from_coarser: FromCoarser::Equilibrium, max_solves: MAX_SOLVES_NEAR, ..run_up };
        let mut found = |settings| {
            let step = model.take_over(other, state, compression, &settings)?;
            model.fault(step.force).is_none().then_some(step)
        };
        if let Some(step) = found(near) {
            return Ok(Pressed { model, step, fineness: to });
        }
        if halfway > 0 && !self.cancelled() {
            let between = self.take_over(from, fineness.halfway(to), compression, halfway - 1);
            let there = between.and_then(|between| {
                let from = (&between.model, between.model.state(), between.fineness);
                self.take_over(from, to, compression, halfway - 1)
            });
            if there.is_ok() {
                return there;
            }
        }
        if self.cancelled() {
            return Err(stopped(StopReason::Cancelled, other));
        }
        match found(run_up) {
            Some(step) => Ok(Pressed { model, step, fineness: to }),
            None if self.cancelled() => Err(stopped(StopReason::Cancelled, other)),
            None => Err(stopped(StopReason::NoConvergence, other)),
        }
    }
}

/// That no equilibrium was found near that of a layer.
fn stopped(reason: StopReason, near: &LayerModel) -> Box<Stopped> {
    let effort = Effort::default();
    Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j: near.smallest_j(), element: 0, effort })
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

/// The compression that a goal asks for, or that of a layer that has met it.
fn compression_at(goal: Goal, model: &LayerModel) -> f64 {
    match goal {
        Goal::Compression(compression) => compression,
        Goal::Force(_) => model.compression(),
    }
}

/// The places of the nodes of the top at rest and after loading, from the axis outwards, in m.
fn surface(model: &LayerModel, state: &State) -> Vec<[[f64; 2]; 2]> {
    let nodes = &model.equations().body().mesh.nodes;
    let top = model.thickness * (1.0 - 1e-9);
    let after = |n: usize| std::array::from_fn(|k| nodes[n][k] + state.displacement[2 * n + k]);
    let on_top = (0..nodes.len()).filter(|&n| nodes[n][1] > top);
    let mut surface: Vec<[[f64; 2]; 2]> = on_top.map(|n| [nodes[n], after(n)]).collect();
    surface.sort_by(|a, b| a[0][0].total_cmp(&b[0][0]));
    surface
}

#[cfg(test)]
mod tests {
    use super::super::layer::{End, Inclusion};
    use super::super::obstacle::IndenterProfile;
    use super::super::press::{Pressing, Refinement};
    use super::*;
    use elastocap_materials::Rubber;

    fn layer(half_width: f64, corner_radius: f64) -> PlaneLayer {
        PlaneLayer {
            thickness: 1.0,
            half_length: 6.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: Indenter::Smooth(IndenterProfile::Punch { half_width, corner_radius }),
            position: 0.0,
            end: End::Free,
        }
    }

    fn pressed(layer: &PlaneLayer, goals: &[Goal], meshes: Vec<usize>) -> Pressing {
        let refinement = Refinement { relative_tolerance: 1e-9, meshes };
        layer.press(goals, &refinement, &AtomicBool::new(false), &|_, _| ()).unwrap()
    }

    /// The force at a compression, and the layer, on the mesh of a level.
    fn at(layer: &PlaneLayer, compression: f64, level: usize) -> (f64, LayerModel) {
        let punch = layer.centred_punch().unwrap();
        let goal = Goal::Compression(compression);
        let (model, step) = layer.press_rounded(punch, level, None, goal, &layer.settings(level)).unwrap();
        (step.force, model)
    }

    #[test]
    fn meshes_for_one_load_have_the_force_of_following_the_load_on_one_that_is_fine_all_along() {
        let layer = layer(500.0 / 450.0, 0.1);
        let punch = layer.centred_punch().unwrap();
        let mesh = LayerMesh::under_rounded_punch(1.0, 6.0, &punch, 0.3, 12, 4.0);
        let mut followed = LayerModel::new(&mesh, layer.rubber_in_use(), layer.indenter, layer.end).unwrap();
        for compression in [0.15, 0.3] {
            let step = followed.press(compression, &around_corners(0.1, 4.0)).unwrap();
            let (force, model) = at(&layer, compression, 2);
            println!("{force}, followed {}", step.force);
            assert!((force / step.force - 1.0).abs() < 1e-3, "{compression}: {force} and not {}", step.force);
            let unknowns = [&model, &followed].map(|model| model.equations().mixed_unknowns());
            assert!(2 * unknowns[0] < unknowns[1], "{unknowns:?}");
        }
    }

    #[test]
    fn at_the_corner_sides_have_the_length_after_loading_that_was_asked_for_and_are_stretched_alike() {
        let layer = layer(500.0 / 450.0, 0.02);
        for (compression, level) in [(0.05, 2), (0.3, 1), (0.3, 2)] {
            let (_, model) = at(&layer, compression, level);
            let passing = Fineness::of(level).passing;
            // Without the nodes in the middle of sides.
            let corners: Vec<_> = surface(&model, model.state()).into_iter().step_by(2).collect();
            let after = |two: &[[[f64; 2]; 2]]| {
                let [[_, a], [_, b]] = [two[0], two[1]];
                (b[0] - a[0]).hypot(b[1] - a[1])
            };
            let arc = [500.0 / 450.0 - 0.006, 1.0 - compression + 0.006];
            let near = |x: [f64; 2]| (x[0] - arc[0]).hypot(x[1] - arc[1]) < PLATEAU * 0.02;
            let at_arc = corners.windows(2).filter(|two| near(two[0][1]) && near(two[1][1]));
            let lengths: Vec<f64> = at_arc.map(|two| after(two) * passing / 0.02).collect();
            println!("{compression}: {lengths:.2?}");
            assert!(lengths.len() > passing as usize, "{compression}: {lengths:?}");
            assert!(lengths.iter().all(|l| (0.5..1.6).contains(l)), "{compression}: {lengths:?}");
            let stretch = |two: &[[[f64; 2]; 2]]| (after(two) / (two[1][0][0] - two[0][0][0])).ln();
            let stretches: Vec<f64> = corners.windows(2).map(stretch).collect();
            let most = stretches.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            assert!(most < 0.6, "{compression}: {most}");
        }
    }

    #[test]
    fn the_error_stated_at_three_meshes_covers_what_the_fourth_changes() {
        let layer = PlaneLayer {
            inclusions: vec![Inclusion {
                min: [0.06, 0.48],
                max: [0.72, 0.52],
                rubber: Rubber::neo_hookean(11.0),
            }],
            ..layer(1.0, 0.05)
        };
        let goals = [0.05, 0.25].map(Goal::Compression);
        let four = pressed(&layer, &goals, vec![0, 1, 2, 3]);
        let three = pressed(&layer, &goals, vec![0, 1, 2]);
        for (three, four) in three.goals.iter().zip(&four.goals) {
            let [three, four] = [three, four].map(|goal| goal.as_ref().unwrap());
            let (moved, error) = ((three.step.force - four.step.force).abs(), three.error.unwrap());
            println!("{:?}: moved by {moved:.1e}, stated {error:.1e}", four.refinement);
            assert!(moved < error && error < 6e-3 * four.step.force, "{:?}", four.refinement);
        }
    }

    #[test]
    fn a_force_leads_back_to_the_compression_that_it_came_from() {
        let layer = layer(1.0, 0.05);
        let (force, _) = at(&layer, 0.13, 1);
        let found = pressed(&layer, &[Goal::Force(force)], vec![0, 1]);
        let step = found.goals[0].as_ref().unwrap().step;
        // The mesh was made for another compression.
        assert!((step.compression / 0.13 - 1.0).abs() < 2e-3, "{step:?}");
        assert!((step.force / force - 1.0).abs() < 1e-6, "{step:?}");
    }

    #[test]
    fn a_load_that_no_sharp_punch_leads_to_is_reached_from_smaller_ones() {
        let layer = layer(0.5, 0.02);
        let (force, model) = at(&layer, 0.5, 0);
        // 6.88 on finer meshes.
        assert!((force / 6.88 - 1.0).abs() < 0.03 && model.fault(force).is_none(), "{force}");
    }

    #[test]
    fn a_load_that_is_not_reached_does_not_keep_others_from_being_reached() {
        let layer = PlaneLayer { half_length: 2.5, ..layer(1.0, 0.5) };
        let found = pressed(&layer, &[0.1, 0.95, 0.2].map(Goal::Compression), vec![0]);
        let reached = found.goals.iter().map(Result::is_ok).collect::<Vec<_>>();
        assert_eq!(reached, [true, false, true]);
    }

    #[test]
    fn loads_on_meshes_of_their_own_do_not_depend_on_each_other() {
        let layer = layer(1.0, 0.05);
        let goals = [0.3, 0.0, 0.1].map(Goal::Compression);
        let together = pressed(&layer, &goals, vec![0, 1]);
        for (goal, found) in goals.into_iter().zip(&together.goals) {
            let alone = pressed(&layer, &[goal], vec![0, 1]);
            let forces = [found, &alone.goals[0]].map(|found| found.as_ref().unwrap().step.force);
            assert_eq!(forces[0], forces[1], "{goal:?}");
        }
    }
}

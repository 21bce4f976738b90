//! A punch with rounded corners: a mesh for each load.
//!
//! The surface slides around the corner and is stretched there, six times and more. What lies at the corner has to have sides that are short
//! against its radius; what has passed it, or has not reached it yet, need not. Equilibrium without friction has no memory, so that each
//! load gets a mesh of its own, fine only where the surface lies at the corner under this load. Where that is, and how much the
//! surface is stretched there, is read off the deformed surface on a coarser mesh: its sides are given their lengths after
//! loading. On the first mesh the surface is that under a sharp punch of the same width, which is a rounded one seen from afar. On the
//! middle of the layer one half of it is solved, which has one corner; elsewhere the whole layer, which has two.
//!
//! The equilibrium is searched near that of the coarser mesh. Where Newton's method does not find it, a mesh is put between the two, and
//! in the end the punch starts a little above the load, clear of the surface, and goes the rest of the way.

mod first;
mod mesh;

use std::sync::atomic::{AtomicBool, Ordering};

use super::force_goal::meet_force;
use super::layer::{LayerMesh, LayerModel, LayerStep, RoundedPunch};
use super::levels::{around_corners, within_limit};
use super::model::State;
use super::newton::{Effort, FromCoarser, NewtonSettings, StopReason, Stopped};
use super::press::{Goal, PlaneLayer};
use mesh::{Fineness, surface};

/// Linear systems, for each corner on the mesh, after which an equilibrium near that of the coarser mesh is not searched any longer.
const MAX_SOLVES_NEAR: usize = 70;
/// The same of a run-up.
const MAX_SOLVES_RUN_UP: usize = 600;
/// Longest move of the punch where it goes the rest of the way, in sides at its corner.
const LONGEST_MOVE: f64 = 0.45;
/// How often a mesh half as fine is put between two whose equilibria are too far apart.
const HALFWAY: usize = 2;
/// Compressions that differ by no more than this, over the radius and the thickness, share a mesh.
const SAME_MESH: f64 = 0.5;

/// A layer on a mesh for one load.
struct Pressed {
    mesh: LayerMesh,
    model: LayerModel,
    step: LayerStep,
    fineness: Fineness,
}

/// A layer on another mesh, and its state.
type Other<'a> = (&'a LayerModel, &'a State, Fineness);

/// A layer under a punch with rounded corners.
struct Rounded<'a> {
    layer: &'a PlaneLayer,
    punch: RoundedPunch,
    cancel: Option<&'a AtomicBool>,
}

impl PlaneLayer {
    /// Presses a punch with rounded corners to `goal` on a mesh of a level, starting from the equilibrium on a coarser one where there is
    /// one. The model has a mesh of its own.
    ///
    /// # Errors
    /// [`Stopped`] says why no equilibrium was found.
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
                // Off the middle it is on the mesh of a level already.
                let from = if first.fineness == Fineness::of(0) { 1 } else { 0 };
                (from..=level).try_fold(first, next)?
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
}

impl<'a> Rounded<'a> {
    fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// The layer at rest.
    fn model(&self, mesh: &LayerMesh) -> Result<LayerModel, Box<Stopped>> {
        let model = within_limit(mesh.elements_at_most()).and_then(|()| self.layer.model_on(mesh));
        // Only a mesh with too many elements has none.
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
            max_solves: MAX_SOLVES_RUN_UP,
            ..around_corners(radius, fineness.passing)
        }
    }

    /// From a layer on one mesh to another one.
    fn next(&self, from: &Pressed, to: Fineness, compression: f64) -> Result<Pressed, Box<Stopped>> {
        self.take_over((&from.model, from.model.state(), from.fineness), to, compression, HALFWAY)
    }

    /// The layer at a compression on a mesh of the fineness `to`, if its equilibrium is found near its state on another one.
    fn near(&self, (other, state, _): Other<'_>, to: Fineness, compression: f64) -> Option<Pressed> {
        let mesh = self.layer.mesh_where_corners_are(self.punch, to, &surface(other, state), compression);
        let mut model = self.model(&mesh).ok()?;
        let max_solves = if mesh.is_whole() { 2 * MAX_SOLVES_NEAR } else { MAX_SOLVES_NEAR };
        let from_coarser = FromCoarser::Equilibrium;
        let settings = NewtonSettings { from_coarser, max_solves, ..self.settings(to) };
        let step = model.take_over(other, state, compression, &settings)?;
        model.fault(step.force).is_none().then_some(Pressed { mesh, model, step, fineness: to })
    }

    /// The layer at a compression on a mesh of the fineness `to`, from its state on another one at about that compression. Where that is
    /// too far away, by meshes between the two, which are put there up to `halfway` times; at last by a run-up.
    fn take_over(
        &self,
        from: Other<'_>,
        to: Fineness,
        compression: f64,
        halfway: usize,
    ) -> Result<Pressed, Box<Stopped>> {
        if let Some(found) = self.near(from, to, compression) {
            return Ok(found);
        }
        if halfway > 0 && !self.cancelled() {
            let between = self.take_over(from, from.2.halfway(to), compression, halfway - 1);
            let there = between.and_then(|between| {
                let from = (&between.model, between.model.state(), between.fineness);
                self.take_over(from, to, compression, halfway - 1)
            });
            if there.is_ok() {
                return there;
            }
        }
        if self.cancelled() {
            return Err(stopped(StopReason::Cancelled, from.0));
        }
        self.run_up(from, to, compression)
    }

    /// The same by a run-up alone: the punch starts a little above the load, clear of the surface.
    fn run_up(
        &self,
        (other, state, _): Other<'_>,
        to: Fineness,
        compression: f64,
    ) -> Result<Pressed, Box<Stopped>> {
        let mesh = self.layer.mesh_where_corners_are(self.punch, to, &surface(other, state), compression);
        let mut model = self.model(&mesh)?;
        let found = model.take_over(other, state, compression, &self.settings(to));
        match found.filter(|step| model.fault(step.force).is_none()) {
            Some(step) => Ok(Pressed { mesh, model, step, fineness: to }),
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

/// The compression that a goal asks for, or that of a layer that has met it.
fn compression_at(goal: Goal, model: &LayerModel) -> f64 {
    match goal {
        Goal::Compression(compression) => compression,
        Goal::Force(_) => model.compression(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::layer::{End, Inclusion, Indenter};
    use super::super::obstacle::IndenterProfile;
    use super::super::press::{Pressing, Refinement};
    use super::mesh::PLATEAU;
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
        layer.press(goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap()
    }

    /// The force at a compression, and the layer, on the mesh of a level.
    fn at(layer: &PlaneLayer, compression: f64, level: usize) -> (f64, LayerModel) {
        let punch = layer.punch_on_own_meshes().unwrap();
        let goal = Goal::Compression(compression);
        let (model, step) = layer.press_rounded(punch, level, None, goal, &layer.settings(level)).unwrap();
        (step.force, model)
    }

    #[test]
    fn meshes_for_one_load_have_the_force_of_following_the_load_on_one_that_is_fine_all_along() {
        let layer = layer(500.0 / 450.0, 0.1);
        let punch = layer.punch_on_own_meshes().unwrap();
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
    fn a_large_force_on_a_wide_punch_is_met_within_the_resolution_of_the_first_mesh() {
        let layer = PlaneLayer { half_length: 24.0, end: End::FreeOnSubstrate, ..layer(6.0, 0.2) };
        let found = pressed(&layer, &[Goal::Force(160.0)], vec![0]);
        let step = found.goals[0].as_ref().unwrap().step;
        // 0.1911 to 0.1912 on finer meshes.
        assert!((step.compression / 0.1912 - 1.0).abs() < 0.015, "{step:?}");
        assert!((step.force / 160.0 - 1.0).abs() < 1e-6, "{step:?}");
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

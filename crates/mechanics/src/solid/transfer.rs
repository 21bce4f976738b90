//! The configuration on one mesh as a first guess on another mesh of the same body.
//!
//! The equilibrium of a coarse mesh is near that of a finer one under the same load: Newton's method finds
//! the second from the first in a few steps, where following the load from rest takes several times as many.
//! Displacements are evaluated at the nodes of the finer mesh, pressures at the centres of its elements; the
//! contact forces are those of the coarse surface. Between the coarse nodes the finer surface may lie a
//! little inside an obstacle: from there Newton's method starts without bounds for the gaps, or, where that
//! fails, with obstacles that are moved out of the surface first.

use std::ops::Range;

use super::dimension::{Dimension, Element, Numbers};
use super::mesh::Mesh;
use super::model::{Equations, Load, State};
use super::newton::{Effort, NewtonSettings};
use super::obstacle::ObstacleShape;
use super::shape_functions::shape;
use elastocap_materials::space::{Tensor, cofactor, determinant};

/// The largest number of Newton steps from the guess to the equilibrium. With more, following the load takes
/// no longer. Tuned: `benches/layer_errors.py`.
const MAX_ITERATIONS: usize = 12;

/// Smallest distance of an obstacle from the guessed surface, over the gap where the pressure equals the
/// shear modulus. Tuned: `benches/layer_errors.py`.
const CLEARANCE: f64 = 0.3;
/// The largest number of times that an obstacle is moved out of the surface, each time at least twice as far.
/// Not tuned: a limit that ordinary cases do not reach.
const MAX_MOVES: usize = 8;

/// Distance from an element, over its size, within which a point still belongs to it. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const SLACK: f64 = 1e-7;

/// Largest coordinate in a reference element at which a point inside the element is searched. It is not
/// tuned.
const FARTHEST: f64 = 1.5;

/// The largest number of intervals of an axis for the sorting of elements. Not tuned: a limit that ordinary
/// cases do not reach.
const MAX_INTERVALS: usize = 256;

/// Finds the elements in which points lie.
pub(super) struct Finder<'a, S: Dimension> {
    pub(super) mesh: &'a Mesh<S>,
    /// Lower and upper ends of the box around each element.
    boxes: Vec<(S::Point, S::Point)>,
    /// For each of the equal rectangles that divide the extent along the first two axes, the numbers of the
    /// elements that overlap it. Rectangles that are neighbours along the second axis are neighbours in the
    /// list.
    bins: Vec<Vec<u32>>,
    /// Along each of these axes: where the first rectangle begins, the number of rectangles per metre, and
    /// the total number of rectangles.
    intervals: [(f64, f64, usize); 2],
}

impl<'a, S: Dimension> Finder<'a, S> {
    /// A finder of the elements of `mesh`.
    pub(super) fn new(mesh: &'a Mesh<S>) -> Self {
        let around = |e: &S::Nodes| {
            let end = |start: f64, pick: fn(f64, f64) -> f64| {
                S::Point::from_fn(|k| {
                    e.as_ref().iter().fold(start, |m, &n| pick(m, mesh.nodes[n as usize][k]))
                })
            };
            (end(f64::INFINITY, f64::min), end(f64::NEG_INFINITY, f64::max))
        };
        let boxes: Vec<_> = mesh.elements.iter().map(around).collect();
        // Half as many rectangles as elements.
        let count = ((0.5 * boxes.len() as f64).sqrt() as usize).clamp(1, MAX_INTERVALS);
        let intervals = [0, 1].map(|k| {
            let first = boxes.iter().fold(f64::INFINITY, |m, b| m.min(b.0[k]));
            let last = boxes.iter().fold(f64::NEG_INFINITY, |m, b| m.max(b.1[k]));
            (first, count as f64 / (last - first), count)
        });
        let mut finder = Self { mesh, boxes, bins: vec![Vec::new(); count * count], intervals };
        for e in 0..finder.boxes.len() {
            let (low, high) = finder.boxes[e];
            let [along, up] = [0, 1].map(|k| {
                let room = SLACK * (high[k] - low[k]);
                finder.interval(k, low[k] - room)..=finder.interval(k, high[k] + room)
            });
            for column in along {
                for row in up.clone() {
                    finder.bins[column * count + row].push(e as u32);
                }
            }
        }
        finder
    }

    /// The number of the interval along an axis that `x` lies in, or is nearest to.
    fn interval(&self, axis: usize, x: f64) -> usize {
        let (first, per_length, count) = self.intervals[axis];
        (((x - first) * per_length).max(0.0) as usize).min(count - 1)
    }

    /// The elements that may contain `x`.
    fn near(&self, x: S::Point) -> &[u32] {
        let [along, up] = [0, 1].map(|k| self.interval(k, x[k]));
        &self.bins[along * self.intervals[1].2 + up]
    }

    /// An element that contains the reference position `x` (m), and the coordinates of `x` in the reference
    /// element.
    pub(super) fn find(&self, x: S::Point) -> Option<(usize, [f64; 3])> {
        self.near(x).iter().find_map(|&e| {
            let (low, high) = &self.boxes[e as usize];
            let outside = |k: usize| {
                let room = SLACK * (high[k] - low[k]);
                x[k] < low[k] - room || x[k] > high[k] + room
            };
            if (0..S::AXES).any(outside) {
                return None;
            }
            self.within(e as usize, x).map(|local| (e as usize, local))
        })
    }

    /// The coordinates of `x` in the reference element of `e`, if it is inside.
    fn within(&self, e: usize, x: S::Point) -> Option<[f64; 3]> {
        let (low, high) = &self.boxes[e];
        let size = (0..S::AXES).fold(0.0, |m: f64, k| m.max(high[k] - low[k]));
        let mut local = [0.0f64; 3];
        for _ in 0..30 {
            let shape = shape::<S>(local);
            let mut miss = [0.0; 3];
            let mut jacobian = [[0.0; 3]; 3];
            for k in 0..S::AXES {
                miss[k] = x[k];
                for (&n, (value, slopes)) in self.mesh.elements[e].as_ref().iter().zip(&shape) {
                    let node = self.mesh.nodes[n as usize][k];
                    miss[k] -= value * node;
                    for m in 0..S::AXES {
                        jacobian[k][m] += slopes[m] * node;
                    }
                }
            }
            if miss.iter().all(|m| m.abs() < SLACK * size) {
                let inside = local.iter().all(|s| s.abs() <= 1.0 + SLACK.sqrt());
                return inside.then(|| local.map(|s| s.clamp(-1.0, 1.0)));
            }
            // The shortest step that minimises the squared miss: in the centre of a fan the Jacobian is
            // singular.
            let product = |a: usize, b: usize| (0..3).map(|k| jacobian[k][a] * jacobian[k][b]).sum::<f64>();
            let mut normal: Tensor = std::array::from_fn(|n| product(n / 3, n % 3));
            let trace = normal[0] + normal[4] + normal[8];
            for k in 0..3 {
                normal[4 * k] += if k < S::AXES { 1e-12 * trace } else { trace };
            }
            let (inverse, volume) = (cofactor(&normal), determinant(&normal));
            let toward: [f64; 3] = std::array::from_fn(|m| (0..3).map(|k| jacobian[k][m] * miss[k]).sum());
            for m in 0..S::AXES {
                let step = (0..3).map(|k| inverse[3 * m + k] * toward[k]).sum::<f64>() / volume;
                if step.is_nan() {
                    return None;
                }
                local[m] = (local[m] + step).clamp(-FARTHEST, FARTHEST);
            }
        }
        None
    }
}

/// A configuration on a mesh that can be evaluated at any position.
struct Source<'a, S: Dimension> {
    finder: Finder<'a, S>,
    equations: &'a Equations<S>,
    state: &'a State<S>,
    /// Contact pressure at the nodes in Pa.
    pressed: Vec<f64>,
}

impl<'a, S: Dimension> Source<'a, S> {
    /// The configuration `state` of the body of `equations`.
    fn new(equations: &'a Equations<S>, state: &'a State<S>) -> Self {
        let pressed = equations.nodal_contact_pressure(state);
        Self { finder: Finder::new(&equations.body.mesh), equations, state, pressed }
    }

    /// The displacement in m and the contact pressure in Pa at the reference position `x` (m).
    fn at(&self, x: S::Point) -> Option<(S::Point, f64)> {
        let (e, local) = self.finder.find(x)?;
        let (mut displacement, mut contact) = (S::Point::default(), 0.0);
        for (&node, (value, _)) in self.equations.body.mesh.elements[e].as_ref().iter().zip(shape::<S>(local))
        {
            contact += value * self.pressed[node as usize];
            for k in 0..S::AXES {
                displacement[k] += value * self.state.displacement[S::AXES * node as usize + k];
            }
        }
        Some((displacement, contact))
    }

    /// The coefficients of the pressure in an element with this centre and size (m).
    fn pressure(&self, centre: S::Point, size: S::Point) -> Option<S::Pressure> {
        let (near, _) = self.finder.find(centre)?;
        let (from, unit) = self.equations.elements[near].pressure_frame();
        let known = &self.state.pressure[near];
        Some(S::Pressure::from_fn(|m| match m {
            0 => known[0] + (0..S::AXES).map(|k| known[k + 1] * (centre[k] - from[k]) / unit[k]).sum::<f64>(),
            m => known[m] * size[m - 1] / unit[m - 1],
        }))
    }
}

impl<S: Dimension> Equations<S> {
    /// A configuration of this body for `load`, from the `state` of the same body on `other` mesh, and the
    /// contact pressures at its nodes in Pa; points may lie inside obstacles. `None` where the meshes do not
    /// cover the same body, or where an element would be turned inside out or extended beyond the limit of
    /// its rubber.
    fn read_off(&self, other: &Self, state: &State<S>, load: &Load<S>) -> Option<(State<S>, Vec<f64>)> {
        let source = Source::new(other, state);
        let mut guess = self.body.at_rest();
        guess.shift.clone_from(&load.shift);
        let contact =
            self.interpolate(&mut guess, |x| source.at(x), |centre, size| source.pressure(centre, size))?;
        for (d, u) in guess.displacement.iter_mut().enumerate() {
            if self.body.held[d] {
                *u = load.displacement[d];
            }
        }
        self.let_follow(&mut guess.displacement);
        let rest = vec![0.0; guess.displacement.len()];
        let (smallest, ..) = self.smallest_j(&rest, &guess.displacement, false);
        if smallest.is_nan() || smallest <= 0.0 {
            return None;
        }
        if self.extension_left(&rest, &guess.displacement).is_some_and(|(left, _)| left <= 0.0) {
            return None;
        }
        Some((guess, contact))
    }

    /// The configuration that [`Equations::read_off`] gives, with the obstacles moved out of the surface, and
    /// with contact forces. `None` also where the obstacles cannot be moved out.
    fn guess(&self, other: &Self, state: &State<S>, load: &Load<S>) -> Option<State<S>> {
        let (mut guess, contact) = self.read_off(other, state, load)?;
        if !self.clear_obstacles(&mut guess) {
            return None;
        }
        self.guess_contact(&mut guess, &contact);
        Some(guess)
    }

    /// Sets the displacements of the `guess` by `at`, which gives the displacement and the contact pressure
    /// at a reference position, and its pressures by `pressure`, which gives the coefficients for an element
    /// with a given centre and size (m). Returns the contact pressures at the nodes in Pa.
    fn interpolate(
        &self,
        guess: &mut State<S>,
        at: impl Fn(S::Point) -> Option<(S::Point, f64)>,
        pressure: impl Fn(S::Point, S::Point) -> Option<S::Pressure>,
    ) -> Option<Vec<f64>> {
        let mut contact = Vec::with_capacity(self.body.mesh.nodes.len());
        for (u, x) in guess.displacement.chunks_mut(S::AXES).zip(&self.body.mesh.nodes) {
            let (displacement, pressed) = at(*x)?;
            u.copy_from_slice(displacement.as_slice());
            contact.push(pressed);
        }
        for (new, element) in guess.pressure.iter_mut().zip(&self.elements) {
            let (centre, size) = element.pressure_frame();
            *new = pressure(centre, size)?;
        }
        Some(contact)
    }

    /// The configuration from [`Equations::guess`] with the gaps of a moving load or, if that is smaller,
    /// with [`NewtonSettings::first_gap`].
    fn guess_in_motion(
        &mut self,
        other: &Self,
        state: &State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
    ) -> Option<State<S>> {
        self.gap_times_pressure = settings.first_gap.min(settings.moving_gap) * self.modulus_times_size;
        let closed = settings.first_gap < settings.moving_gap;
        self.guess(other, if closed { state } else { state.moving.as_deref().unwrap_or(state) }, load)
    }

    /// Moves obstacles out of the guessed surface. Returns whether that succeeded.
    fn clear_obstacles(&self, guess: &mut State<S>) -> bool {
        let clearance = CLEARANCE * self.gap_times_pressure / self.modulus;
        (0..self.body.obstacles.len()).all(|o| {
            let mut away = clearance;
            let sideways = self.sideways(o, guess.shift[o]);
            for _ in 0..MAX_MOVES {
                let least = self.least_gap(o, guess);
                if least >= 0.5 * clearance {
                    return true;
                }
                // Where its surface is oblique or steep, the obstacle has to move farther than the gap grows.
                away = (2.0 * away).max(clearance - least);
                match self.body.obstacles[o].shape {
                    ObstacleShape::Substrate => guess.shift[o][1] -= away,
                    ObstacleShape::Flank { side } => guess.shift[o][0] -= side * away,
                    ObstacleShape::Indenter(profile) => {
                        guess.shift[o][1] += away;
                        // Moving up does not clear a vertical flank.
                        if profile.flat_face().is_some() {
                            for k in 0..S::AXES {
                                guess.shift[o][k] += sideways[k] * away;
                            }
                        }
                    }
                }
            }
            false
        })
    }

    /// Along each axis, the direction (1 or -1) in which an obstacle at `place` (m) can be moved sideways
    /// away from all sides that may touch it, because these are on one side of its middle. 0 where there is
    /// none.
    fn sideways(&self, obstacle: usize, place: S::Point) -> S::Point {
        let nodes = &self.body.mesh.nodes;
        let sides = &self.body.obstacles[obstacle].sides;
        S::Point::from_fn(|k| {
            let every = |on: fn(f64) -> bool| sides.iter().all(|side| on(nodes[side.middle()][k] - place[k]));
            match k {
                1 => 0.0,
                _ if every(|away| away >= 0.0) => -1.0,
                _ if every(|away| away < 0.0) => 1.0,
                _ => 0.0,
            }
        })
    }

    /// Finds an equilibrium under `load` from `state`, one of the same body on `other` mesh under about the
    /// same load. Where the force of obstacles is `given`, the load gets the places in which they press with
    /// it. `None` where that fails.
    pub(crate) fn equilibrium_from(
        &mut self,
        other: &Self,
        state: &State<S>,
        load: &mut Load<S>,
        given: Option<(Range<usize>, f64)>,
        settings: &NewtonSettings,
    ) -> Option<(State<S>, Effort)> {
        let Some(given) = given else { return self.equilibrium_near(other, state, load, settings) };
        self.with_force(given, load, |equations, load| {
            equations.equilibrium_near(other, state, load, settings)
        })
    }

    /// Finds an equilibrium under `load` near the `state` of the same body on `other` mesh.
    fn equilibrium_near(
        &mut self,
        other: &Self,
        state: &State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
    ) -> Option<(State<S>, Effort)> {
        let mut effort = Effort::default();
        // With a first gap that is no smaller than that of a moving load, the method without bounds would
        // have little advantage: the interior method takes as few systems.
        let is_shorter = settings.first_gap < settings.moving_gap;
        if is_shorter
            && let Some(found) = self.settled_without_bounds(other, state, load, settings, &mut effort)
        {
            return Some((found, effort));
        }
        let found = self.settled_within_bounds(other, state, load, settings, &mut effort)?;
        Some((found, effort))
    }

    /// Finds an equilibrium under `load` near the `state` of the same body on `other` mesh by the interior
    /// method alone, which keeps all gaps open on the way.
    fn settled_within_bounds(
        &mut self,
        other: &Self,
        state: &State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Option<State<S>> {
        let few = NewtonSettings { max_iterations: MAX_ITERATIONS, ..*settings };
        let mut state = self.guess_in_motion(other, state, load, &few)?;
        self.follow_to(&mut state, load, &few, effort).ok()?;
        let closing = NewtonSettings { moving_gap: settings.first_gap.min(settings.moving_gap), ..*settings };
        let found = self.close_gaps(&mut state, load, &closing, false, effort);
        (found.is_ok() && effort.negative_pivots == 0).then_some(state)
    }

    /// Finds an equilibrium under `load` near the `state` of the same body on `other` mesh by Newton's method
    /// without bounds alone, which takes about half as many steps.
    fn settled_without_bounds(
        &mut self,
        other: &Self,
        state: &State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Option<State<S>> {
        // Where there are equilibria with ripples beside the one that the surface reaches, long steps may
        // lead to them.
        if !self.has_contact() {
            return None;
        }
        let (mut guess, contact) = self.read_off(other, state, load)?;
        self.press_with_nodal(&mut guess, &contact);
        let found = self.settle_without_bounds(&mut guess, load, settings, effort);
        (found.is_ok() && effort.negative_pivots == 0).then_some(guess)
    }
}

#[cfg(test)]
mod tests {
    use super::super::layer::{End, Indenter, LayerMesh, LayerModel};
    use super::super::obstacle::IndenterProfile;
    use super::super::space::layer::{SideCondition, SpaceLayerMesh};
    use super::*;
    use crate::solid::dimension::{Plane, Space};
    use elastocap_materials::Rubber;

    const CYLINDER: Indenter = Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.5 });

    fn section(n: usize) -> LayerMesh {
        LayerMesh::uniform(1.0, 3.0, n, 0.5, n / 2)
    }

    fn in_plane(n: usize) -> LayerModel<Plane> {
        LayerModel::new(&section(n), Rubber::neo_hookean(1.0), CYLINDER, End::FreeOnSubstrate).unwrap()
    }

    fn in_space(n: usize) -> LayerModel<Space> {
        let mesh = SpaceLayerMesh::new(section(n), 0.8, n);
        let rubber = Rubber::neo_hookean(1.0);
        LayerModel::of_finite_width(&mesh, rubber, CYLINDER, End::Free, SideCondition::Free).unwrap()
    }

    /// Checks that functions that are linear over the whole body are transferred exactly, in fans too.
    fn linear_fields_stay<S: Dimension>(coarse: &LayerModel<S>, fine: &LayerModel<S>) {
        let displacement = |x: S::Point, k: usize| {
            (0..S::AXES).map(|m| 0.01 * (1.0 + k as f64 - 0.7 * m as f64) * x[m]).sum::<f64>()
        };
        let pressure = |x: S::Point| 0.3 + (0..S::AXES).map(|m| (0.2 + m as f64) * x[m]).sum::<f64>();
        let (from, to) = (coarse.equations(), fine.equations());
        let mut state = from.body().at_rest();
        for (n, x) in from.body().mesh.nodes.iter().enumerate() {
            for k in 0..S::AXES {
                state.displacement[S::AXES * n + k] = displacement(*x, k);
            }
        }
        for (p, element) in state.pressure.iter_mut().zip(&from.elements) {
            let (centre, size) = element.pressure_frame();
            *p = S::Pressure::from_fn(|m| match m {
                0 => pressure(centre),
                m => (0.2 + (m - 1) as f64) * size[m - 1],
            });
        }
        let mut load = to.body().no_load();
        load.shift[0][1] = 2.0;
        for (n, x) in to.body().mesh.nodes.iter().enumerate() {
            for k in 0..S::AXES {
                load.displacement[S::AXES * n + k] = displacement(*x, k);
            }
        }
        let guess = to.guess(from, &state, &load).unwrap();
        for (a, b) in guess.displacement.iter().zip(&load.displacement) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
        for (p, element) in guess.pressure.iter().zip(&to.elements) {
            let (centre, size) = element.pressure_frame();
            assert!((p[0] - pressure(centre)).abs() < 1e-8);
            for m in 0..S::AXES {
                assert!((p[m + 1] - (0.2 + m as f64) * size[m]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn linear_displacements_and_pressures_are_the_same_on_another_mesh() {
        linear_fields_stay(&in_plane(4), &in_plane(6));
        linear_fields_stay(&in_space(2), &in_space(3));
    }

    /// Following the load and starting from a coarser mesh give the same force; the second takes fewer
    /// systems.
    fn both_ways_agree<S: Dimension>(mut coarse: LayerModel<S>, model: impl Fn() -> LayerModel<S>) {
        let settings = NewtonSettings::default();
        coarse.press(0.2, &settings).unwrap();
        let (mut followed, mut taken) = (model(), model());
        let by_load = followed.press(0.2, &settings).unwrap();
        let by_mesh = taken.take_over(&coarse, coarse.state(), 0.2, None, &settings).unwrap();
        assert!((by_load.force / by_mesh.force - 1.0).abs() < 1e-7, "{by_load:?} {by_mesh:?}");
        assert!(4 * by_mesh.effort.solves < 3 * by_load.effort.solves, "{by_load:?} {by_mesh:?}");
        assert!((by_mesh.compression - 0.2).abs() < 1e-15);
        // From there the load goes on as from any equilibrium, and back.
        let on = taken.press(0.22, &settings).unwrap().force;
        assert!((on / followed.press(0.22, &settings).unwrap().force - 1.0).abs() < 1e-7);
        let back = taken.press_with(by_load.force, &settings).unwrap();
        assert!((back.compression - 0.2).abs() < 1e-7, "{back:?}");
    }

    #[test]
    fn an_equilibrium_found_from_a_coarser_mesh_is_the_one_that_the_load_leads_to() {
        both_ways_agree(in_plane(4), || in_plane(8));
        both_ways_agree(in_space(2), || in_space(3));
    }

    /// Newton's method without bounds and the interior method, from `coarse` to `fine` at a compression: the
    /// same state. Returns the numbers of systems that they take.
    fn without_and_within_bounds<S: Dimension>(
        mut coarse: LayerModel<S>,
        fine: &LayerModel<S>,
        compression: f64,
        settings: &NewtonSettings,
    ) -> [usize; 2] {
        coarse.press(compression, settings).unwrap();
        let mut load = fine.load().clone();
        load.shift.clone_from(&coarse.load().shift);
        let mut equations = Equations::new(fine.equations().body().clone()).unwrap();
        let [mut without, mut within] = [Effort::default(); 2];
        let (from, state) = (coarse.equations(), coarse.state());
        let a = equations.settled_without_bounds(from, state, &load, settings, &mut without).unwrap();
        assert!(equations.penetration(&a) < 0.0 && a.contact.iter().all(|force| *force > 0.0));
        let residual = equations.assemble(&a, &load);
        assert!(residual.contact < 2e-3 && residual.force < 2.0 * settings.tolerance, "{residual:?}");
        let b = equations.settled_within_bounds(from, state, &load, settings, &mut within).unwrap();
        let size = a.displacement.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        for (u, v) in a.displacement.iter().zip(&b.displacement) {
            assert!((u - v).abs() < 3e-5 * size, "{u} {v}");
        }
        let [force, other] = [&a, &b].map(|state| equations.contact_force(0, state)[1]);
        assert!((force / other - 1.0).abs() < 1e-5, "{force} {other}");
        [without.solves, within.solves]
    }

    #[test]
    fn without_bounds_newtons_method_ends_where_the_interior_method_does_and_takes_fewer_systems() {
        let settings = NewtonSettings {
            tolerance: 1e-7,
            moving_gap: 3e-3,
            final_gap: 1e-5,
            first_gap: 3e-5,
            ..Default::default()
        };
        let under = |profile, n: usize| {
            let mesh = SpaceLayerMesh::new(section(n), 0.8, n);
            let indenter = Indenter::Smooth(profile);
            let rubber = Rubber::neo_hookean(1.0);
            LayerModel::<Space>::of_finite_width(&mesh, rubber, indenter, End::Far, SideCondition::Free)
                .unwrap()
        };
        let block = IndenterProfile::Block { half_widths: [1.0, 0.5], corner_radius: 0.2 };
        let [without, within] = without_and_within_bounds(under(block, 2), &under(block, 4), 0.1, &settings);
        assert!(4 * without <= 3 * within, "{without} {within}");
        let ball = IndenterProfile::Sphere { radius: 1.5 };
        let [without, within] = without_and_within_bounds(under(ball, 2), &under(ball, 4), 0.1, &settings);
        assert!(without < within, "{without} {within}");
        for settings in [settings, NewtonSettings::default()] {
            let [without, within] = without_and_within_bounds(in_plane(4), &in_plane(8), 0.2, &settings);
            assert!(without < within, "{without} {within}");
        }
    }

    #[test]
    fn a_configuration_that_does_not_fit_leaves_the_model_as_it_was() {
        let settings = NewtonSettings::default();
        let (mut coarse, mut fine) = (in_plane(2), in_plane(4));
        coarse.press(0.1, &settings).unwrap();
        let before = fine.press(0.05, &settings).unwrap();
        let mut folded = coarse.state().clone();
        folded.displacement.iter_mut().for_each(|u| *u *= -20.0);
        folded.moving = None;
        assert!(fine.take_over(&coarse, &folded, 0.1, None, &settings).is_none());
        assert_eq!(fine.step(before.effort).force, before.force);
        // A longer layer covers this one, and not the other way round.
        let mesh = LayerMesh::uniform(1.0, 4.0, 2, 0.5, 1);
        let mut longer = LayerModel::new(&mesh, Rubber::neo_hookean(1.0), CYLINDER, End::Free).unwrap();
        assert!(longer.take_over(&coarse, coarse.state(), 0.1, None, &settings).is_none());
    }
}

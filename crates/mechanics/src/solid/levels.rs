//! The meshes that a layer is pressed on, coarse to fine, with the barriers and settings that belong to them.

use super::contact_end::{FIRST_COMPRESSION, slid};
use super::forecast::PressingRegime;
use super::layer::{End, Indenter, LayerMesh, PunchFan, RoundedPunch};
use super::mesh::{geometric, uniform};
use super::model::ModelError;
use super::newton::{FromCoarser, NewtonSettings};
use super::obstacle::IndenterProfile;
use super::press::{Goal, PlaneLayer};
use elastocap_materials::Rubber;

/// Barrier against `J -> 0` where the surface passes a rounded corner; see [`Rubber::volume_barrier`].
const ROUNDED_BARRIER: f64 = 20.0;
/// The same where the surface piles up at a sharp corner.
const SHARP_BARRIER: f64 = 5.0;

/// Extent of the equal quadrilaterals around the bonded corner of an end that folds, over the thickness.
const ROLL: f64 = 0.1;

/// Sides over the radius of a rounded corner while they pass it, on the first mesh.
const COARSEST_PASSING: f64 = 0.375;
/// Longest punch move, in element sides at its corner. With longer moves Newton's method finds equilibria with ripples that the
/// surface does not reach in reality.
const LONGEST_MOVE: f64 = 0.15;
/// [`NewtonSettings::final_gap`] at rounded corners: it changes a force by less than 1e-4, and smaller gaps are hard to close where
/// sides pass.
const FINAL_GAP: f64 = 1e-5;
/// [`NewtonSettings::max_solves`] at rounded corners: a small radius takes many steps.
const MAX_SOLVES: usize = 10_000;
/// Number of coarse meshes whose sides are so long that the equilibria depend on the path to them.
pub(super) const RIPPLED: usize = 2;
/// How far before a load finer meshes begin to follow it, over the radius: several sides pass on the way.
const RUN_UP: f64 = 0.5;

/// Least length over the thickness of either half of a layer beside the middle of a punch that has a mesh of its own for each load.
const SHORTEST_HALF: f64 = 1.5;

/// Ratio of the sizes of successive rings around the end of a sharp punch; two more rings halve the smallest.
const SHRINK: f64 = 0.7;
const COARSEST_RINGS: usize = 8;
const RINGS_PER_LEVEL: usize = 2;
/// The same where the surface slides around the corner.
const COARSEST_SLIDING_RINGS: usize = 3;
/// [`PunchFan::narrowing`] there. At a distance `d` from the corner the surface is stretched by about `d^(-1/2)`: what comes to lie within
/// `d` was as wide as `d^(3/2)` at rest, and as deep as `d^(1/2)`.
const NARROWING: f64 = 1.5;
/// Quadrilaterals over the thickness around that fan. They have to shrink too: beyond a compression of some per cent
/// they contribute as much to the error as the corner.
const COARSEST_CELLS: usize = 8;
const CELLS_PER_LEVEL: usize = 2;
/// Least length over the thickness between the corner of a sharp punch and the elements at the end of the layer.
const LEAST_ROOM: f64 = 1e-3;
/// The same that may be missing at a rounded corner, where a sharp punch is no more than the first guess.
const MISSING_ROOM: f64 = 0.05;
/// Size of the elements at the edges of inclusions on the first mesh, over the thickness; each level halves it.
const AT_EDGES: f64 = 0.0125;

impl PlaneLayer {
    /// The mesh of this layer at a level of refinement, for compressions up to `deepest`: each level halves what limits the
    /// accuracy of the one before.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`].
    pub fn mesh(&self, level: usize, deepest: f64) -> Result<LayerMesh, ModelError> {
        let (height, length) = (self.thickness, self.half_length);
        if length <= height && !self.folds() {
            return Err(ModelError::NoRoom);
        }
        if let Some(punch) = self.punch_on_own_meshes() {
            return Ok(self.mesh_at_corners(punch, level));
        }
        let mut mesh = match self.indenter {
            Indenter::Sharp { half_width } => {
                // At rest the corner may be too near the end of the layer, and the surface slides away from there.
                return self
                    .around_corner(half_width, level)
                    .or_else(|_| self.around_corner(slid(half_width, deepest), level));
            }
            Indenter::Held { half_width } | Indenter::Bonded { half_width } => {
                return self.under_sharp_punch(half_width, level);
            }
            Indenter::Smooth(profile) => {
                let Some(punch) = self.rounded_punch(profile) else {
                    return Ok(self.first_mesh(level, deepest));
                };
                let n = COARSEST_CELLS + level;
                LayerMesh::under_rounded_punch(height, length, &punch, deepest, n, passing(level))
            }
            Indenter::WholeTop if !self.folds() => return Ok(self.first_mesh(level, deepest)),
            Indenter::WholeTop => {
                // The roll at the corner is small at small loads, and the rest of the layer is smooth: it is the
                // quadrilaterals at the corner that have to be halved, and those on the way to it.
                let (cells, growth) = (24 << level, 1.0 + 0.5 / (1 + level) as f64);
                LayerMesh::folding_end(height, length, 5 + level, cells, ROLL, growth)
            }
        };
        if self.position != 0.0 && !mesh.is_whole() {
            mesh = mesh.mirrored();
        }
        self.fit_to_inclusions([&mut mesh.along, &mut mesh.up], [&[], &[]], smallest_at_edges(height, level));
        Ok(mesh)
    }

    /// Refuses a punch whose corner has no room for elements around it before the end of the layer, where the surface is at any of
    /// `goals`.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`].
    pub fn check_room(&self, goals: &[Goal]) -> Result<(), ModelError> {
        if self.half_length <= self.thickness && !self.folds() {
            return Err(ModelError::NoRoom);
        }
        let slides = |half_width: f64| {
            let compression = |goal: &Goal| match goal {
                Goal::Compression(compression) => *compression,
                Goal::Force(_) => FIRST_COMPRESSION,
            };
            let least = goals.iter().map(compression).filter(|c| *c > 0.0).fold(f64::INFINITY, f64::min);
            slid(half_width, if least.is_finite() { least } else { 0.0 })
        };
        // What is known of a rounded corner is less exact, and there are other ways to begin there.
        let (end, least) = match self.indenter {
            Indenter::Sharp { half_width } => (slides(half_width), LEAST_ROOM),
            Indenter::Held { half_width } | Indenter::Bonded { half_width } => (half_width, LEAST_ROOM),
            Indenter::Smooth(_) => match self.punch_on_own_meshes() {
                Some(punch) => (punch.position.abs() + slides(punch.half_width), -MISSING_ROOM),
                None => return Ok(()),
            },
            Indenter::WholeTop => return Ok(()),
        };
        let room = self.half_length - self.thickness - end;
        if room > least * self.thickness { Ok(()) } else { Err(ModelError::NoRoom) }
    }

    /// [`fit_to_edges`] of the inclusions, along both axes.
    pub(super) fn fit_to_inclusions(
        &self,
        breakpoints: [&mut Vec<f64>; 2],
        kept: [&[f64]; 2],
        smallest: f64,
    ) {
        for (axis, (breakpoints, kept)) in breakpoints.into_iter().zip(kept).enumerate() {
            fit_to_edges(breakpoints, kept, &self.edges(axis).collect::<Vec<f64>>(), smallest);
        }
    }

    /// Lower and upper ends of the inclusions along an axis.
    pub(super) fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// The mesh of this layer at a level of refinement, as [`PlaneLayer::mesh`] gives it, unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`], [`ModelError::NoRoom`].
    pub fn mesh_within_limit(&self, level: usize, deepest: f64) -> Result<LayerMesh, ModelError> {
        let mesh = self.mesh(level, deepest)?;
        within_limit(mesh.elements_at_most())?;
        mesh.check()?;
        if let Some(punch) = self.punch_on_own_meshes() {
            // Where the load has to be followed after all, the first mesh has to be fine all along the way.
            let (height, length) = (self.thickness, self.half_length);
            let along =
                LayerMesh::under_rounded_punch(height, length, &punch, deepest, COARSEST_CELLS, passing(0));
            within_limit(along.elements_at_most())?;
        }
        Ok(mesh)
    }

    /// The indenter as a punch with rounded corners that has a mesh of its own for each load, if it is one: any such punch but one at
    /// the very end of the layer, where the half of the layer beyond its middle is too short to be solved alone.
    pub(super) fn punch_on_own_meshes(&self) -> Option<RoundedPunch> {
        let Indenter::Smooth(profile) = self.indenter else { return None };
        let shorter_half = self.half_length - self.position.abs();
        let solved_alone = self.position == 0.0 || shorter_half >= SHORTEST_HALF * self.thickness;
        self.rounded_punch(profile).filter(|_| solved_alone)
    }

    /// The indenter as a punch with rounded corners, if it has a flat face.
    fn rounded_punch(&self, profile: IndenterProfile) -> Option<RoundedPunch> {
        let (half_width, corner_radius) = profile.flat_face()?;
        Some(RoundedPunch { half_width, corner_radius, position: self.position })
    }

    /// What decides how many linear systems loads up to the compression `deepest` take.
    pub fn regime(&self, deepest: f64) -> PressingRegime {
        match self.indenter {
            Indenter::WholeTop if self.folds() => PressingRegime::Folds,
            Indenter::Smooth(_) if self.punch_on_own_meshes().is_some() => PressingRegime::RoundedCorner,
            Indenter::Smooth(profile) => match self.rounded_punch(profile) {
                Some(punch) => {
                    let sides = punch.sides_passing(self.thickness, deepest, passing(0));
                    PressingRegime::PassedCorner(sides)
                }
                None => PressingRegime::Smooth,
            },
            Indenter::Sharp { .. } => PressingRegime::Sharp,
            Indenter::Held { .. } | Indenter::Bonded { .. } => PressingRegime::Patch,
            Indenter::WholeTop => PressingRegime::Smooth,
        }
    }

    /// The rubber with the barrier that the corners need; see [`Rubber::volume_barrier`].
    pub(super) fn rubber_in_use(&self) -> Rubber {
        let without = self.rubber.volume_barrier == 0.0 || self.folds();
        let needed = match self.indenter {
            Indenter::Smooth(_) => ROUNDED_BARRIER,
            Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => SHARP_BARRIER,
            Indenter::WholeTop => self.rubber.volume_barrier,
        };
        let volume_barrier = if without { 0.0 } else { needed };
        Rubber { volume_barrier, ..self.rubber.clone() }
    }

    /// How this layer is pressed on the mesh of a level.
    pub(super) fn settings(&self, level: usize) -> NewtonSettings<'static> {
        match self.indenter {
            Indenter::WholeTop if self.folds() => NewtonSettings::through_folds(),
            Indenter::Smooth(profile) => match self.rounded_punch(profile) {
                Some(punch) if level < RIPPLED => {
                    let settings = around_corners(punch.corner_radius, passing(level));
                    NewtonSettings { from_coarser: FromCoarser::Nothing, ..settings }
                }
                Some(punch) => around_corners(punch.corner_radius, passing(level)),
                None => NewtonSettings::default(),
            },
            Indenter::WholeTop | Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => {
                NewtonSettings::default()
            }
        }
    }

    /// Whether the end folds through itself at the bonded corner, as a free end without a substrate does. A rubber whose energy is
    /// defined for `J > 0` only cannot follow: its mesh gets a fan there, and is too stiff.
    pub(super) fn folds(&self) -> bool {
        let smooth = Rubber { volume_barrier: 0.0, ..self.rubber.clone() };
        self.indenter == Indenter::WholeTop && self.end == End::Free && smooth.knows_inside_out()
    }

    /// The mesh under a sharp punch: each level has more quadrilaterals over the thickness and more rings in the fan around the end
    /// of the punch. The fan stays clear of the inclusions below it.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`] where the fan has no room before the end of the layer.
    fn under_sharp_punch(&self, corner: f64, level: usize) -> Result<LayerMesh, ModelError> {
        let (height, length) = (self.thickness, self.half_length);
        if length - height - corner <= LEAST_ROOM * height {
            return Err(ModelError::NoRoom);
        }
        let highest = self.edges(1).fold(0.0, f64::max);
        let reach =
            (0.5 * height).min(0.9 * (height - highest)).min(corner).min(0.5 * (length - height - corner));
        let (left, right, low) = (corner - reach, corner + reach, height - reach);
        let body = length - height;
        let cells = (COARSEST_CELLS + CELLS_PER_LEVEL * level) as f64;
        let count = |length: f64| ((cells * length / height).round() as usize).max(1);
        let fine = count(reach).max(4);
        let mut along = if left > 0.0 { uniform(0.0, left, count(left)) } else { vec![0.0] };
        along.extend(uniform(left, right, 2 * fine).iter().skip(1));
        along.extend(uniform(right, body, count(0.6 * (body - right))).iter().skip(1));
        let mut up = uniform(0.0, low, count(low));
        up.extend(uniform(low, height, fine).iter().skip(1));
        self.fit_to_inclusions(
            [&mut along, &mut up],
            [&[left, right], &[low]],
            smallest_at_edges(height, level),
        );
        let at = |x: f64, of: &[f64]| of.iter().position(|y| *y == x).unwrap_or(0);
        let punch = PunchFan {
            along: [at(left, &along), at(right, &along)],
            up: at(low, &up),
            corner,
            radii: geometric(SHRINK, COARSEST_RINGS + RINGS_PER_LEVEL * level),
            narrowing: 1.0,
        };
        let end_top = uniform(body, length, count(0.6 * height));
        Ok(LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: Some(punch) })
    }

    /// The mesh under a sharp punch at whose corner the point `end` (m) of the surface lies. Its fan needs fewer rings than that of
    /// a patch that is held: the corner does not hold the surface, and what is singular there is weaker.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`].
    pub(super) fn around_corner(&self, end: f64, level: usize) -> Result<LayerMesh, ModelError> {
        let mut mesh = self.under_sharp_punch(end, level)?;
        if let Some(fan) = &mut mesh.punch {
            fan.radii = geometric(SHRINK, COARSEST_SLIDING_RINGS + RINGS_PER_LEVEL * level);
            fan.narrowing = NARROWING;
        }
        Ok(mesh)
    }
}

/// Whether a mesh of so many elements, at most, is made.
///
/// # Errors
/// [`ModelError::TooManyElements`].
pub(super) fn within_limit(elements: usize) -> Result<(), ModelError> {
    let limit = LayerMesh::MAX_ELEMENTS;
    if elements > limit { Err(ModelError::TooManyElements { elements, limit }) } else { Ok(()) }
}

/// Settings with which the surface follows corners of a radius (m), side by side, with so many sides `passing` over the radius.
pub(super) fn around_corners(corner_radius: f64, passing: f64) -> NewtonSettings<'static> {
    NewtonSettings {
        from_coarser: FromCoarser::RunUp(RUN_UP * corner_radius),
        longest_move: LONGEST_MOVE * corner_radius / passing,
        final_gap: FINAL_GAP,
        max_solves: MAX_SOLVES,
        ..NewtonSettings::default()
    }
}

/// Sides over the radius of a rounded corner while they pass it.
fn passing(level: usize) -> f64 {
    COARSEST_PASSING * (1 << level) as f64
}

/// Size (m) of the elements at the edges of inclusions in a layer of a thickness (m) on the mesh of a level.
fn smallest_at_edges(thickness: f64, level: usize) -> f64 {
    AT_EDGES * thickness * 0.5_f64.powi(level as i32)
}

/// Makes the edges of inclusions along an axis breakpoints without moving those that are `kept`, and halves the steps that are longer
/// than `smallest` (m) and their distance from the nearest edge: stress is singular at the edges of a stiff body, and a mesh that is
/// coarse there makes it stiffer.
pub(super) fn fit_to_edges(breakpoints: &mut Vec<f64>, kept: &[f64], edges: &[f64], smallest: f64) {
    move_to(breakpoints, kept, edges);
    refine_toward(breakpoints, edges, smallest);
}

/// Halves steps between breakpoints until none is longer than `smallest` and its distance from the nearest of `edges`.
fn refine_toward(breakpoints: &mut Vec<f64>, edges: &[f64], smallest: f64) {
    let mut k = 1;
    while k < breakpoints.len() {
        let (from, to) = (breakpoints[k - 1], breakpoints[k]);
        let away = edges.iter().map(|edge| (from - edge).max(edge - to)).fold(f64::INFINITY, f64::min);
        if to - from > smallest + away.max(0.0) {
            breakpoints.insert(k, 0.5 * (from + to));
        } else {
            k += 1;
        }
    }
}

/// Moves the nearest inner breakpoint to each of `edges`, or inserts one where the nearest is an edge already or one of `kept`.
fn move_to(breakpoints: &mut Vec<f64>, kept: &[f64], edges: &[f64]) {
    let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let tiny = 1e-9 * last;
    let mut fixed = vec![first, last];
    fixed.extend(kept);
    for &edge in edges.iter().filter(|e| **e > first + tiny && **e < last - tiny) {
        if fixed.iter().any(|f| (f - edge).abs() < tiny) {
            continue;
        }
        let after = breakpoints.partition_point(|x| *x < edge).min(breakpoints.len() - 1);
        let near = if edge - breakpoints[after - 1] < breakpoints[after] - edge { after - 1 } else { after };
        if fixed.contains(&breakpoints[near]) {
            breakpoints.insert(after, edge);
        } else {
            breakpoints[near] = edge;
        }
        fixed.push(edge);
    }
}

#[cfg(test)]
mod tests {
    use super::super::layer::Inclusion;
    use super::super::mesh::Mesh;
    use super::*;

    fn problem(indenter: Indenter, end: End) -> PlaneLayer {
        PlaneLayer {
            thickness: 1.0,
            half_length: 6.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter,
            position: 0.0,
            end,
        }
    }

    #[test]
    fn a_punch_anywhere_near_the_end_has_a_sound_mesh_or_none() {
        for half_length in [0.5, 1.0, 1.2, 2.0, 6.0] {
            for reach in (1..20).map(|k| 0.05 * f64::from(k) * half_length).chain([half_length - 1.0]) {
                let half_width = reach.max(1e-3);
                let profile = IndenterProfile::Punch { half_width: 0.5 * half_width, corner_radius: 0.02 };
                for (indenter, position) in [
                    (Indenter::Sharp { half_width }, 0.0),
                    (Indenter::Held { half_width }, 0.0),
                    (Indenter::Bonded { half_width }, 0.0),
                    (Indenter::Smooth(profile), 0.0),
                    (Indenter::Smooth(profile), 0.5 * half_width),
                    (Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 }), -half_width),
                ] {
                    let layer =
                        PlaneLayer { half_length, position, ..problem(indenter, End::FreeOnSubstrate) };
                    for compression in [0.01, 0.3] {
                        let room = layer.check_room(&[Goal::Compression(compression)]);
                        let mesh = layer.mesh_within_limit(0, compression);
                        assert!(mesh.is_ok() || room.is_err(), "{indenter:?} on {half_length}");
                        if let Ok(mesh) = mesh {
                            assert_eq!(mesh.check(), Ok(()), "{indenter:?} on {half_length}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn every_mesh_is_finer_than_the_one_before() {
        let half_width = 500.0 / 450.0;
        for indenter in [
            Indenter::Held { half_width },
            Indenter::Bonded { half_width },
            Indenter::Smooth(IndenterProfile::Punch { half_width, corner_radius: 0.02 }),
            Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 }),
            Indenter::WholeTop,
        ] {
            for end in [End::Free, End::FreeOnSubstrate, End::Far] {
                let problem = problem(indenter, end);
                let meshes = [0, 1, 2, 3].map(|level| problem.mesh(level, 0.3).unwrap().mesh());
                let counts: Vec<usize> = meshes.iter().map(|mesh| mesh.elements.len()).collect();
                assert!(counts.windows(2).all(|two| two[0] < two[1]), "{indenter:?}, {end:?}: {counts:?}");
                // The free end of a layer that does not fold, and what presses, are where elements have to shrink.
                let smallest = |mesh: &Mesh| {
                    let side = |e: &[u32; 9]| {
                        let at = |k: usize| mesh.nodes[e[k] as usize];
                        let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
                        // The longer diagonal, which a quadrilateral collapsed in the centre of a fan has too.
                        apart(at(0), at(8)).max(apart(at(2), at(6)))
                    };
                    mesh.elements.iter().map(side).fold(f64::INFINITY, f64::min)
                };
                let sizes: Vec<f64> = meshes.iter().map(smallest).collect();
                assert!(
                    sizes.windows(2).all(|two| two[1] < 0.9 * two[0]),
                    "{indenter:?}, {end:?}: {sizes:?}"
                );
            }
        }
    }

    #[test]
    fn elements_at_the_edges_of_inclusions_shrink_from_level_to_level_under_punches_and_at_ends_that_fold() {
        let inclusion = Inclusion { min: [0.1, 0.48], max: [0.7, 0.52], rubber: Rubber::neo_hookean(11.0) };
        let rounded = Indenter::Smooth(IndenterProfile::Punch { half_width: 1.0, corner_radius: 0.05 });
        let sharp = Indenter::Sharp { half_width: 1.0 };
        for (indenter, position) in [(rounded, 0.0), (rounded, 0.4), (sharp, 0.0), (Indenter::WholeTop, 0.0)]
        {
            let layer =
                PlaneLayer { inclusions: vec![inclusion.clone()], position, ..problem(indenter, End::Free) };
            for level in 0..3 {
                let mesh = layer.mesh(level, 0.1).unwrap();
                let beside = |lines: &[f64], edge: f64| {
                    let at = lines.iter().position(|x| (x - edge).abs() < 1e-9).unwrap();
                    (lines[at] - lines[at - 1]).max(lines[at + 1] - lines[at])
                };
                let lines = [&mesh.along, &mesh.up];
                for (axis, lines) in lines.into_iter().enumerate() {
                    for edge in [inclusion.min[axis], inclusion.max[axis]] {
                        let size = beside(lines, edge) * 2_f64.powi(level as i32);
                        assert!(size < 0.016, "{indenter:?} at {position}, level {level}, {edge}: {size}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_mesh_under_a_punch_off_the_middle_is_fine_at_both_its_corners() {
        let punch = IndenterProfile::Punch { half_width: 1.0, corner_radius: 0.05 };
        let centred = problem(Indenter::Smooth(punch), End::Free);
        let off = PlaneLayer { position: 0.4, ..centred.clone() };
        let side = |problem: &PlaneLayer, at: f64| {
            let along = problem.mesh(2, 0.1).unwrap().along;
            let after = along.partition_point(|x| *x < at);
            along[after] - along[after - 1]
        };
        // Four sides over the radius.
        let fine = 0.05 / 4.0;
        for at in [1.4, -0.6] {
            assert!(side(&off, at - 0.01) < 1.1 * fine && side(&off, at + 0.01) < 1.1 * fine, "{at}");
        }
        // Nor is it fine at their mirror images.
        assert!([-1.4, 0.6, 3.0].iter().all(|&at| side(&off, at) > 3.0 * fine));
        assert!(side(&centred, 0.99) < 1.1 * fine && side(&centred, 1.4) > 1.5 * fine);
    }
}

//! The meshes of a layer at a level of refinement.

use super::contact_end::{FIRST_COMPRESSION, slid};
use super::press::PlaneLayer;
use crate::solid::first_mesh::fit_to_edges;
use crate::solid::layer::{Indenter, LayerMesh, PunchFan};
use crate::solid::mesh::{geometric, uniform};
use crate::solid::model::ModelError;
use crate::solid::press::Goal;

/// Meshes at most under a punch with sharp corners, and of an end that folds.
const LEVELS: usize = 4;
/// Extent of the equal quadrilaterals around the bonded corner of an end that folds, over the thickness.
const ROLL: f64 = 0.1;

/// Ratio of the sizes of successive rings around the end of a sharp punch; two more rings halve the smallest.
const SHRINK: f64 = 0.7;
const COARSEST_RINGS: usize = 8;
const RINGS_PER_LEVEL: usize = 2;
/// Rings on the coarsest mesh where the surface slides around the corner. The corner does not hold it then, and the singularity is weaker.
const COARSEST_SLIDING_RINGS: usize = 3;
/// [`PunchFan::narrowing`] of those rings. At a distance `d` from the corner the surface is stretched by about `d^(-1/2)`: what
/// comes to lie within `d` was as wide as `d^(3/2)` at rest, and as deep as `d^(1/2)`.
const NARROWING: f64 = 1.5;
/// Quadrilaterals over the thickness around that fan. They have to shrink too: beyond a compression of some per cent
/// they contribute as much to the error as the corner.
const COARSEST_CELLS: usize = 8;
const CELLS_PER_LEVEL: usize = 2;
/// Least length over the thickness between the corner of a sharp punch and the elements at the end of the layer.
const LEAST_ROOM: f64 = 1e-3;
/// Size of the elements at the edges of inclusions on the first mesh, over the thickness; each level halves it.
const AT_EDGES: f64 = 0.0125;

/// The size of the elements of a level over that of the first one.
pub(super) fn halved(level: usize) -> f64 {
    0.5_f64.powi(level as i32)
}

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
        match self.indenter {
            // At rest the corner may be too near the end of the layer, and the surface slides away from there.
            Indenter::Sharp { half_width } => self
                .around_corner(half_width, level)
                .or_else(|_| self.around_corner(slid(half_width, deepest), level)),
            Indenter::WholeTop if self.folds() => {
                // The roll at the corner is small at small loads, and the rest of the layer is smooth: it is the
                // quadrilaterals at the corner that have to be halved, and those on the way to it.
                let (cells, growth) = (24 << level, 1.0 + 0.5 / (1 + level) as f64);
                let mut mesh = LayerMesh::folding_end(height, length, 5 + level, cells, ROLL, growth);
                self.fit_to_inclusions([&mut mesh.along, &mut mesh.up], [&[], &[]], level);
                Ok(mesh)
            }
            Indenter::Held { half_width } | Indenter::Bonded { half_width } => {
                self.under_sharp_punch(half_width, level)
            }
            Indenter::WholeTop | Indenter::Smooth(_) => {
                Ok(self.first_mesh(deepest).section(Self::cells(level)))
            }
        }
    }

    /// The levels that there are.
    pub(super) fn levels(&self) -> std::ops::Range<usize> {
        0..LEVELS
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
        let end = match self.indenter {
            Indenter::Sharp { half_width } => slides(half_width),
            Indenter::Held { half_width } | Indenter::Bonded { half_width } => half_width,
            Indenter::Smooth(_) | Indenter::WholeTop => return Ok(()),
        };
        let room = self.half_length - self.thickness - end;
        if room > LEAST_ROOM * self.thickness { Ok(()) } else { Err(ModelError::NoRoom) }
    }

    /// [`fit_to_edges`] of the inclusions, along both axes, with elements there as small as at a level.
    fn fit_to_inclusions(&self, breakpoints: [&mut Vec<f64>; 2], kept: [&[f64]; 2], level: usize) {
        let smallest = AT_EDGES * self.thickness * halved(level);
        for (axis, (breakpoints, kept)) in breakpoints.into_iter().zip(kept).enumerate() {
            fit_to_edges(breakpoints, kept, &self.edges(axis).collect::<Vec<f64>>(), smallest);
        }
    }

    /// Lower and upper ends of the inclusions along an axis.
    pub(super) fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// The mesh under a sharp punch that ends at `corner` (m). Each level has more quadrilaterals over the thickness, and more
    /// rings in the fan around the end of the punch. The fan stays clear of the inclusions below it.
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
        self.fit_to_inclusions([&mut along, &mut up], [&[left, right], &[low]], level);
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

    /// The mesh under a sharp punch that the surface slides around; its point `end` (m) at rest lies at the corner.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::layer::{End, Inclusion};
    use crate::solid::mesh::Mesh;
    use crate::solid::obstacle::IndenterProfile;
    use elastocap_materials::Rubber;

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
                let meshes: Vec<_> = problem.levels().map(|k| problem.mesh(k, 0.3).unwrap().mesh()).collect();
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
    fn the_edges_of_inclusions_are_sides_of_elements_under_any_indenter() {
        let inclusion = Inclusion { min: [0.1, 0.48], max: [0.7, 0.52], rubber: Rubber::neo_hookean(11.0) };
        let rounded = Indenter::Smooth(IndenterProfile::Punch { half_width: 1.0, corner_radius: 0.05 });
        let sharp = Indenter::Sharp { half_width: 1.0 };
        let cylinder = Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 });
        for (indenter, position) in
            [(rounded, 0.0), (rounded, 0.4), (sharp, 0.0), (cylinder, 0.0), (Indenter::WholeTop, 0.0)]
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
                        assert!(size < 0.5, "{indenter:?} at {position}, level {level}, {edge}: {size}");
                    }
                }
            }
        }
    }
}

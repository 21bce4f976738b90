//! The meshes that a layer is pressed on, coarse to fine, and what goes with them.

use super::layer::{End, Indenter, LayerMesh, PunchFan};
use super::material::Rubber;
use super::mesh::{geometric, graded, uniform};
use super::newton::NewtonSettings;
use super::obstacle::Shape;
use super::press::LayerProblem;

/// Half-length over the thickness of a layer that is solved with equal elements all along.
const SHORT: f64 = 4.0;

/// Barriers against `J -> 0` where the surface passes a rounded corner, and where it piles up at a sharp one.
const ROUNDED_BARRIER: f64 = 20.0;
const SHARP_BARRIER: f64 = 5.0;

/// How far equal quadrilaterals go from the bonded corner of an end that folds, over the thickness.
const ROLL: f64 = 0.1;

/// Rings around the end of a sharp punch: each is so much smaller than the one around it, two more halve the smallest.
const SHRINK: f64 = 0.7;
const COARSEST_RINGS: usize = 8;
const RINGS_PER_LEVEL: usize = 2;
/// Quadrilaterals over the thickness around that fan. They have to shrink too: beyond a compression of some per cent
/// what is left of the error is theirs as much as the corner's.
const COARSEST_CELLS: usize = 8;
const CELLS_PER_LEVEL: usize = 2;

impl LayerProblem {
    /// The mesh of this layer at a level of refinement: each halves what limits the accuracy of the one before.
    pub fn mesh(&self, level: usize) -> LayerMesh {
        let (height, length) = (self.thickness, self.half_length);
        let n = 5 << level;
        let mut mesh = match self.indenter {
            Indenter::Sharp { half_width } | Indenter::Bonded { half_width } => {
                return self.under_sharp_punch(half_width, level);
            }
            Indenter::Smooth(Shape::Punch { half_width, corner_radius }) => {
                let per_radius = (1 << level) as f64;
                LayerMesh::under_rounded_punch(height, length, half_width, corner_radius, 8, per_radius)
            }
            _ if self.folds() => {
                // The roll at the corner is small at small loads, and the rest of the layer is smooth: it is the
                // quadrilaterals at the corner that have to be halved, and those on the way to it.
                let (cells, growth) = (24 << level, 1.0 + 0.5 / (1 + level) as f64);
                LayerMesh::folding_end(height, length, 5 + level, cells, ROLL, growth)
            }
            _ => {
                let mut mesh = LayerMesh::uniform(height, length, n, 0.8, 4 + n / 2);
                if self.end == End::Far {
                    mesh.radii.clear();
                }
                if self.indenter == Indenter::WholeTop && length > SHORT * height {
                    mesh.along = self.long(n);
                }
                mesh
            }
        };
        mesh.whole = self.position != 0.0;
        move_to(&mut mesh.along, &[], self.edges(0));
        move_to(&mut mesh.up, &[], self.edges(1));
        mesh
    }

    /// What the corners need in the energy; see [`Rubber::volume_barrier`].
    pub(super) fn rubber_in_use(&self) -> Rubber {
        let volume_barrier = match self.indenter {
            _ if self.rubber.volume_barrier == 0.0 || self.folds() => 0.0,
            Indenter::Smooth(_) => ROUNDED_BARRIER,
            Indenter::Sharp { .. } | Indenter::Bonded { .. } => SHARP_BARRIER,
            Indenter::WholeTop => self.rubber.volume_barrier,
        };
        Rubber { volume_barrier, ..self.rubber.clone() }
    }

    pub(super) fn settings(&self) -> NewtonSettings {
        if self.folds() {
            return NewtonSettings::through_folds();
        }
        // Side by side the surface passes a rounded corner, and each that has passed leaves a ripple.
        let path_counts = matches!(self.indenter, Indenter::Smooth(Shape::Punch { .. }));
        NewtonSettings { path_counts, ..NewtonSettings::default() }
    }

    /// Whether the end folds through itself at the bonded corner, as a free end does that nothing carries. A
    /// rubber whose energy needs `J > 0` cannot follow: it gets a fan there, and is too stiff.
    fn folds(&self) -> bool {
        let smooth = Rubber { volume_barrier: 0.0, ..self.rubber.clone() };
        self.indenter == Indenter::WholeTop && self.end == End::Free && smooth.knows_inside_out()
    }

    /// Breakpoints along a long layer: away from its end and its inclusions the solution varies over its length only, and
    /// the elements are up to so many times longer than high as the layer is longer than [`SHORT`] of its heights.
    fn long(&self, n: usize) -> Vec<f64> {
        let (size, end) = (self.thickness / n as f64, self.half_length - self.thickness);
        let longest = size * self.half_length / (SHORT * self.thickness);
        graded(0.0, end, |x| {
            let from_inclusions = self.inclusions.iter().map(|i| (i.min[0] - x).max(x - i.max[0]));
            let away = from_inclusions.fold(end - x, f64::min) - self.thickness;
            (size + 0.25 * away.max(0.0)).min(longest)
        })
    }

    /// Lower and upper ends of the inclusions along an axis.
    fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// More quadrilaterals over the thickness and more rings in the fan around the end of the punch, level by level. The fan
    /// stays clear of what lies in the layer below it.
    fn under_sharp_punch(&self, corner: f64, level: usize) -> LayerMesh {
        let (height, length) = (self.thickness, self.half_length);
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
        move_to(&mut along, &[left, right], self.edges(0));
        move_to(&mut up, &[low], self.edges(1));
        let at = |x: f64, of: &[f64]| of.iter().position(|y| *y == x).unwrap_or(0);
        let punch = PunchFan {
            along: [at(left, &along), at(right, &along)],
            up: at(low, &up),
            corner,
            radii: geometric(SHRINK, COARSEST_RINGS + RINGS_PER_LEVEL * level),
        };
        let end_top = uniform(body, length, count(0.6 * height));
        LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: Some(punch), whole: false }
    }
}

/// Moves the nearest inner breakpoint to each of `edges`, or puts one in where that is an edge already or one of `kept`.
fn move_to(breakpoints: &mut Vec<f64>, kept: &[f64], edges: impl Iterator<Item = f64>) {
    let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let tiny = 1e-9 * last;
    let mut fixed = vec![first, last];
    fixed.extend(kept);
    for edge in edges.filter(|e| *e > first + tiny && *e < last - tiny) {
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
    use super::super::mesh::Mesh;
    use super::super::press::Refinement;
    use super::*;

    fn problem(indenter: Indenter, end: End) -> LayerProblem {
        LayerProblem {
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
    fn every_mesh_is_finer_than_the_one_before() {
        let half_width = 500.0 / 450.0;
        for indenter in [
            Indenter::Sharp { half_width },
            Indenter::Bonded { half_width },
            Indenter::Smooth(Shape::Punch { half_width, corner_radius: 0.02 }),
            Indenter::Smooth(Shape::Cylinder { radius: 1.0 }),
            Indenter::WholeTop,
        ] {
            for end in [End::Free, End::FreeOnSubstrate, End::Far] {
                let problem = problem(indenter, end);
                let meshes: Vec<_> =
                    Refinement::to(0.01).meshes.iter().map(|&level| problem.mesh(level).mesh()).collect();
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
}

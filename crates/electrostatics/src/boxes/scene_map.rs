//! A map of space that carries a scene of boxes to one of bent bodies.
//!
//! The displacement is a continuous polynomial of some degree on each cell of a coarse grid, given by its
//! values at Chebyshev points, and zero beyond the grid.

use super::tensor::adjugate;
use crate::solution::{Field, FieldSection};
use elastocap_fem::tensor::{Dims, SparseRows, Strips, along, axpy, target};
use elastocap_geometry::scene::{Box3, Scene, Wall};
use faer::Mat;
use std::ops::Range;

/// Lengths that differ by less than this share of the grid's size are the same. Not tuned: it only has to lie
/// above rounding errors and below distances that matter.
const SAME: f64 = 1e-9;

/// Displacements that differ by less than this share of the largest one differ by rounding. It is not tuned.
const ROUNDING: f64 = 1e-12;

/// One axis of the grid of a [`SceneMap`].
#[derive(Debug, Clone, PartialEq)]
pub struct MapAxis {
    /// The ends of the polynomials, ascending, m. On a mirrored axis the first is 0.
    pub breaks: Vec<f64>,
    /// The degree in each interval between two breaks, at least 1: one entry fewer than breaks.
    pub degrees: Vec<usize>,
    /// Whether the axis continues below 0 as the mirror image.
    pub mirrored: bool,
}

impl MapAxis {
    /// The coordinates at which the displacement is given, ascending, m.
    pub fn nodes(&self) -> Vec<f64> {
        let mut nodes: Vec<f64> = self.breaks.first().copied().into_iter().collect();
        for (ends, &degree) in self.breaks.windows(2).zip(&self.degrees) {
            let middle = 0.5 * (ends[0] + ends[1]);
            let half = 0.5 * (ends[1] - ends[0]);
            nodes.extend(chebyshev(degree)[1..degree].iter().map(|s| middle + half * s));
            nodes.push(ends[1]);
        }
        nodes
    }

    /// The range of nodes on each interval between two breaks, its ends included.
    fn node_ranges(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.degrees.iter().scan(0, |first, degree| {
            let range = *first..*first + degree + 1;
            *first += degree;
            Some(range)
        })
    }

    /// Whether the displacement at `x` (m) may differ from zero.
    pub(crate) fn reaches(&self, x: f64) -> bool {
        let x = if self.mirrored { x.abs() } else { x };
        self.breaks.first().is_some_and(|first| *first <= x)
            && self.breaks.last().is_some_and(|last| x <= *last)
    }

    /// The interval between two breaks that holds `place` (m), and whether it is that of the mirror image.
    fn interval(&self, place: f64) -> (usize, bool) {
        let reflected = self.mirrored && place < 0.0;
        let x = if reflected { -place } else { place };
        let last = self.degrees.len().saturating_sub(1);
        (self.breaks.partition_point(|b| *b <= x).saturating_sub(1).min(last), reflected)
    }

    /// The matrices from values at the nodes to values and to slopes (1/m) at `places` (m) within the grid,
    /// of a function that is odd across 0, or else even, where the axis is mirrored.
    fn matrices(&self, places: &[f64], odd: bool) -> [SparseRows<f64>; 2] {
        let count = self.degrees.iter().sum::<usize>() + 1;
        let mut matrices = [Mat::zeros(places.len(), count), Mat::zeros(places.len(), count)];
        for (row, &place) in places.iter().enumerate() {
            let (interval, reflected) = self.interval(place);
            let x = if reflected { -place } else { place };
            let (Some(ends), Some(&degree)) =
                (self.breaks.get(interval..interval + 2), self.degrees.get(interval))
            else {
                continue;
            };
            let half = 0.5 * (ends[1] - ends[0]);
            let first: usize = self.degrees[..interval].iter().sum();
            let parity = if reflected && odd { -1.0 } else { 1.0 };
            let direction = if reflected { -parity } else { parity };
            for (k, (value, slope)) in lagrange(degree, (x - ends[0]) / half - 1.0).into_iter().enumerate() {
                matrices[0][(row, first + k)] = parity * value;
                matrices[1][(row, first + k)] = direction * slope / half;
            }
        }
        matrices.map(|m| SparseRows::from_mat(m.as_ref()))
    }
}

/// A continuous map x -> x + u(x), the identity beyond its grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMap {
    pub(crate) axes: [MapAxis; 3],
    /// Components of u at all nodes, `[component][i][j][k]`, m.
    displacement: [Vec<f64>; 3],
    /// For each interval of the third axis, whether the displacement is the same all along it.
    steady: Vec<bool>,
    /// The box whose image has no edges, if there is one.
    rounded: Option<Rounded>,
}

/// A box whose image has no edges, as that of a ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// The box, m.
    pub region: Box3,
    /// Whether its image is smooth where the faces across each axis meet others.
    pub across: [bool; 3],
}

impl SceneMap {
    /// The map whose displacement (m) at the nodes of the axes is that of `displacement` (all lengths in m).
    pub fn new(axes: [MapAxis; 3], displacement: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let [x, y, z] = axes.each_ref().map(MapAxis::nodes);
        let mut values: [Vec<f64>; 3] = Default::default();
        for &x in &x {
            for &y in &y {
                for &z in &z {
                    for (component, value) in values.iter_mut().zip(displacement([x, y, z])) {
                        component.push(value);
                    }
                }
            }
        }
        let mut map = Self { axes, displacement: values, steady: Vec::new(), rounded: None };
        map.make_steady();
        map
    }

    /// Makes the displacement the same all along an interval of the third axis where it changes by rounding
    /// alone.
    fn make_steady(&mut self) {
        let largest = self.displacement.iter().flatten().fold(0.0_f64, |m, u| m.max(u.abs()));
        let [_, _, n2] = self.counts();
        for nodes in self.axes[2].node_ranges() {
            let is_same = |line: &[f64]| {
                let line = line.get(nodes.clone()).unwrap_or_default();
                line.first().is_some_and(|u| line.iter().all(|v| (u - v).abs() <= ROUNDING * largest))
            };
            let is_steady = self.displacement.iter().all(|values| values.chunks_exact(n2).all(is_same));
            self.steady.push(is_steady);
            if is_steady {
                for line in self.displacement.iter_mut().flat_map(|values| values.chunks_exact_mut(n2)) {
                    let first = line[nodes.start];
                    line[nodes.clone()].fill(first);
                }
            }
        }
    }

    /// This map with a box whose image has no edges: fields are then smooth at the edges of the box, and
    /// grids need not be refined there.
    pub fn with_rounded(self, rounded: Rounded) -> Self {
        Self { rounded: Some(rounded), ..self }
    }

    /// Whether the image of the body that `region` belongs to is smooth where the faces of `region` across
    /// axis `a` meet others.
    pub(crate) fn is_round(&self, region: &Box3, a: usize) -> bool {
        self.rounded.is_some_and(|rounded| rounded.region == *region && rounded.across[a])
    }

    /// The axes of the map's grid.
    pub fn axes(&self) -> &[MapAxis; 3] {
        &self.axes
    }

    /// The image of a point (m), m.
    pub fn image(&self, point: [f64; 3]) -> [f64; 3] {
        self.images(&point.map(|x| vec![x])).first().copied().unwrap_or(point)
    }

    /// The images of the tensor product of places (m), m, `[i][j][k]`.
    pub fn images(&self, places: &[Vec<f64>; 3]) -> Vec<[f64; 3]> {
        let [x, y, z] = places;
        let mut points = Vec::with_capacity(x.len() * y.len() * z.len());
        for x in x {
            points.extend(y.iter().flat_map(|y| z.iter().map(|z| [*x, *y, *z])));
        }
        let (within, numbers) = self.within(places);
        let displacement = [0, 1, 2].map(|c| self.component(c, &within));
        for (n, index) in numbers.into_iter().enumerate() {
            (0..3).for_each(|c| points[index][c] += displacement[c][n]);
        }
        points
    }

    /// The smallest determinant of the map's gradient between two heights, m. It is sampled along each axis
    /// at one place more than the degree of each polynomial, so that a map may fold between samples although
    /// this is positive.
    pub fn smallest_volume(&self, heights: [f64; 2]) -> f64 {
        let mut places = self.axes.each_ref().map(|axis| {
            let between = |(ends, &degree): (&[f64], &usize)| {
                let width = ends[1] - ends[0];
                let from = ends[0];
                (0..=degree).map(move |k| from + width * (k as f64 + 0.5) / (degree + 1) as f64)
            };
            axis.breaks.windows(2).zip(&axis.degrees).flat_map(between).collect::<Vec<f64>>()
        });
        places[1].retain(|y| heights[0] <= *y && *y <= heights[1]);
        let gradients = self.gradients(&places);
        let all_gradients = (0..places[0].len()).flat_map(|i| gradients.slab(i));
        all_gradients.map(|f| adjugate(&f).1).fold(f64::INFINITY, f64::min)
    }

    /// Whether the map is continuous in a scene: at each end of its grid there is a wall, or the displacement
    /// is zero.
    pub(crate) fn is_continuous(&self, scene: &Scene) -> bool {
        let counts = self.counts();
        let strides = [counts[1] * counts[2], counts[2], 1];
        let size = self.axes.iter().flat_map(|axis| &axis.breaks).fold(0.0_f64, |m, x| m.max(x.abs()));
        let is_wall = |x: f64, a: usize, side: usize| {
            let wall = if side == 0 { scene.domain.min[a] } else { scene.domain.max[a] };
            scene.walls[a][side] != Wall::Open && (x - wall).abs() < SAME * size
        };
        (0..3).flat_map(|a| [(a, 0), (a, 1)]).all(|(a, side)| {
            let axis = &self.axes[a];
            let at_mirror = axis.mirrored && side == 0;
            let end = if side == 0 { axis.breaks.first() } else { axis.breaks.last() };
            // A mirrored axis ends at the mirror image of this end, too.
            let at_wall = |x: &f64| is_wall(*x, a, side) && (!axis.mirrored || is_wall(-x, a, 0));
            if !at_mirror && end.is_some_and(at_wall) {
                return true;
            }
            let face = if side == 0 { 0 } else { counts[a] - 1 };
            let rests = |u: &Vec<f64>| {
                u.iter().enumerate().all(|(n, u)| n / strides[a] % counts[a] != face || u.abs() < SAME * size)
            };
            // At a mirror plane points may slide along it.
            (0..3).all(|c| (at_mirror && c != a) || rests(&self.displacement[c]))
        })
    }

    /// Gradients F of the map, `F[row][column]` = change of component `row` along axis `column`, at the
    /// tensor product of places (m) within the grid, slab by slab along the first axis.
    pub(crate) fn gradients(&self, places: &[Vec<f64>; 3]) -> MapGradients<'_> {
        let matrices = |a: usize| [false, true].map(|odd| self.axes[a].matrices(&places[a], odd));
        let strips = |a: usize| matrices(a).map(|parity| parity.map(|matrix| Strips::new(&matrix)));
        MapGradients { map: self, first: matrices(0), across: [strips(1), strips(2)] }
    }

    /// A field that was sampled in the coordinates of the boxes, carried to the bent scene: its points move,
    /// and E becomes F^-T E.
    pub(crate) fn bend(&self, mut field: Field) -> Field {
        // The gradient of the map may jump where its polynomials meet: its limits from below and from above
        // are evaluated next to the nodes.
        for (side, towards) in [-1.0, 1.0].into_iter().enumerate() {
            let beside = field.nodes.each_ref().map(|x| {
                let size = x.last().zip(x.first()).map_or(0.0, |(last, first)| last - first);
                x.iter().map(|x| x + towards * SAME * size).collect()
            });
            let (within, nodes) = self.within(&beside);
            let gradients = self.gradients(&within);
            let all_gradients = (0..within[0].len()).flat_map(|i| gradients.slab(i));
            for (f, index) in all_gradients.zip(nodes) {
                let (adjugate, volume) = adjugate(&f);
                if let Some(limits) = field.electric_field.get_mut(index).filter(|_| volume > 0.0) {
                    let straight = limits[side];
                    limits[side] =
                        [0, 1, 2].map(|r| (0..3).map(|k| adjugate[k][r] * straight[k]).sum::<f64>() / volume);
                }
            }
        }
        field.points = Some(self.images(&field.nodes));
        let bent = |section: FieldSection| FieldSection { field: self.bend(section.field), ..section };
        field.sections = field.sections.into_iter().map(bent).collect();
        field
    }

    /// The places on each axis that lie within the grid, and the indices of their tensor product in that of
    /// all `places`.
    fn within(&self, places: &[Vec<f64>; 3]) -> ([Vec<f64>; 3], Vec<usize>) {
        let inside = [0, 1, 2].map(|a| -> Vec<usize> {
            (0..places[a].len()).filter(|i| self.axes[a].reaches(places[a][*i])).collect()
        });
        let mut numbers = Vec::new();
        for i in &inside[0] {
            for j in &inside[1] {
                numbers.extend(inside[2].iter().map(|k| (i * places[1].len() + j) * places[2].len() + k));
            }
        }
        ([0, 1, 2].map(|a| inside[a].iter().map(|i| places[a][*i]).collect()), numbers)
    }

    /// The number of nodes on each axis.
    fn counts(&self) -> Dims {
        self.axes.each_ref().map(|axis| axis.degrees.iter().sum::<usize>() + 1)
    }

    /// For each place on the third axis, m, its interval between two breaks and whether that is the mirror
    /// image's, if the displacement does not change along the interval; `None` if it does.
    pub(crate) fn steady_pieces(&self, places: &[f64]) -> Vec<Option<(usize, bool)>> {
        let piece = |place: &f64| {
            let (interval, reflected) = self.axes[2].interval(*place);
            self.steady.get(interval).is_some_and(|steady| *steady).then_some((interval, reflected))
        };
        places.iter().map(piece).collect()
    }

    /// A component of the displacement at the tensor product of places.
    fn component(&self, component: usize, places: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut dims = self.counts();
        let mut out = self.displacement[component].clone();
        for a in 0..3 {
            let [values, _] = self.axes[a].matrices(&places[a], a == component);
            (out, dims) = along(a, &values, &out, dims);
        }
        out
    }
}

/// Gradients of a map at the tensor product of places. The matrices of the axes are computed once for all
/// slabs: from values at the nodes to values and slopes, of even and of odd functions.
pub(crate) struct MapGradients<'m> {
    map: &'m SceneMap,
    /// The matrices of the first axis, `[even or odd][value or slope]`.
    first: [[SparseRows<f64>; 2]; 2],
    /// The matrices of the second and the third axis, `[axis][even or odd][value or slope]`.
    across: [[[Strips; 2]; 2]; 2],
}

impl MapGradients<'_> {
    /// The gradients at the places of the second and the third axis, `[j][k]`, for one place of the first
    /// axis.
    pub(crate) fn slab(&self, i: usize) -> Vec<[[f64; 3]; 3]> {
        let [_, n1, n2] = self.map.counts();
        let identity = [0, 1, 2].map(|r| [0, 1, 2].map(|c| if r == c { 1.0 } else { 0.0 }));
        let [rows, columns] = self.across.each_ref().map(|parities| parities[0][0].rows());
        let mut out = vec![identity; rows * columns];
        let (mut half, mut slopes) = (vec![0.0; rows * n2], vec![0.0; rows * columns]);
        for (component, displacement) in self.map.displacement.iter().enumerate() {
            let parity = |a: usize| usize::from(a == component);
            let [value, slope] = self.first[parity(0)].each_ref().map(|matrix| {
                let mut plane = vec![0.0; n1 * n2];
                for (s, weight) in matrix.row(i) {
                    axpy(&mut plane, *weight, &displacement[s * n1 * n2..(s + 1) * n1 * n2]);
                }
                plane
            });
            let (second, third) = (&self.across[0][parity(1)], &self.across[1][parity(2)]);
            // For each column of the gradient, the part of the first axis, and for each of the other two axes
            // 1 where the slope is taken along it.
            for (column, (plane, by)) in
                [(&slope, [0, 0]), (&value, [1, 0]), (&value, [0, 1])].into_iter().enumerate()
            {
                second[by[0]].times(plane, n2, &mut half, false);
                third[by[1]].times_rows(&half, rows, n2, target(&mut slopes, 0, columns), false);
                out.iter_mut().zip(&slopes).for_each(|(f, slope)| f[component][column] += slope);
            }
        }
        out
    }
}

/// The extrema of a Chebyshev polynomial in [-1, 1], ascending.
fn chebyshev(degree: usize) -> Vec<f64> {
    (0..=degree).map(|k| -(std::f64::consts::PI * k as f64 / degree as f64).cos()).collect()
}

/// Values and slopes at `s` of the polynomials that are 1 at one of the points of [`chebyshev`] and 0 at the
/// others.
fn lagrange(degree: usize, s: f64) -> Vec<(f64, f64)> {
    let nodes = chebyshev(degree);
    let polynomial = |k: usize| {
        let (mut value, mut slope) = (1.0, 0.0);
        for (_, node) in nodes.iter().enumerate().filter(|(j, _)| *j != k) {
            let width = nodes[k] - node;
            slope = slope * (s - node) / width + value / width;
            value *= (s - node) / width;
        }
        (value, slope)
    };
    (0..=degree).map(polynomial).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(mirrored: bool) -> MapAxis {
        MapAxis { breaks: vec![0.0, 0.5, 2.0], degrees: vec![3, 4], mirrored }
    }

    fn displacement([x, y, z]: [f64; 3]) -> [f64; 3] {
        [x * (0.1 + y * z * z), 0.2 * x * x * y * y * y, z * z * z * (x * x + 0.3)]
    }

    #[test]
    fn polynomials_and_their_gradients_are_exact() {
        let map = SceneMap::new([axis(false), axis(false), axis(false)], displacement);
        let point = [0.3, 1.7, 0.45];
        let expected = displacement(point);
        let image = map.image(point);
        assert!((0..3).all(|c| (image[c] - point[c] - expected[c]).abs() < 1e-13));
        let gradient = map.gradients(&point.map(|x| vec![x])).slab(0)[0];
        let step = 1e-6;
        for column in 0..3 {
            let at = |sign: f64| {
                let mut moved = point;
                moved[column] += sign * step;
                displacement(moved)
            };
            for row in 0..3 {
                let identity = if row == column { 1.0 } else { 0.0 };
                let slope = (at(1.0)[row] - at(-1.0)[row]) / (2.0 * step);
                assert!((gradient[row][column] - identity - slope).abs() < 1e-8, "{row} {column}");
            }
        }
    }

    #[test]
    fn the_smallest_volume_is_that_of_the_thinnest_place_between_two_heights() {
        // Heights shrink by (x / 2) y^2 / 4, so that volumes are 1 - x y / 4: 0 in the upper corner.
        let map =
            SceneMap::new([axis(false), axis(false), axis(false)], |[x, y, _]| [0.0, -x * y * y / 8.0, 0.0]);
        let whole = map.smallest_volume([0.0, 2.0]);
        assert!(whole > 0.0 && whole < 0.4, "{whole}");
        let below = map.smallest_volume([0.0, 0.5]);
        assert!(below > 0.75 && below < 0.9, "{below}");
        let folded =
            SceneMap::new([axis(false), axis(false), axis(false)], |[x, y, _]| [0.0, -x * y * y, 0.0]);
        assert!(folded.smallest_volume([0.0, 2.0]) < 0.0);
    }

    #[test]
    fn the_mirrored_side_is_the_image_of_the_other() {
        let map = SceneMap::new([axis(true), axis(false), axis(true)], displacement);
        let [x, y, z] = map.image([0.3, 1.1, 0.7]);
        let [a, b, c] = map.image([-0.3, 1.1, -0.7]);
        assert!((x + a).abs() + (y - b).abs() + (z + c).abs() < 1e-14);
        let f = map.gradients(&[vec![0.3], vec![1.1], vec![0.7]]).slab(0)[0];
        let g = map.gradients(&[vec![-0.3], vec![1.1], vec![0.7]]).slab(0)[0];
        let sign = |a: usize| if a == 0 { -1.0 } else { 1.0 };
        for row in 0..3 {
            for column in 0..3 {
                assert!((f[row][column] - sign(row) * sign(column) * g[row][column]).abs() < 1e-13);
            }
        }
        assert_eq!(map.image([3.0, 1.0, 1.0]), [3.0, 1.0, 1.0]);
    }
}

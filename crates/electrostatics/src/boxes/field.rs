//! The potential and the electric field of one state of the scene, sampled for export.

use crate::boxes::domain::{Axis, Domain};
use crate::boxes::half_turn::halves::{on_whole, whole_axes};
use crate::boxes::layout::Layout;
use crate::boxes::scene_map::SceneMap;
use crate::solution::{CellBody, Field, FieldSection};
use elastocap_fem::line::{Element, Numbering, hierarchical};
use elastocap_fem::tensor::{Dims, SparseRows, along};
use elastocap_geometry::scene::{Box3, Filling, Scene, Wall};
use elastocap_geometry::section::SectionPlane;
use faer::Mat;

/// Largest number of cells that the elements are divided into for a field in space. More cells show more, and
/// take longer to write: `cargo bench --bench curve`, every output.
const MAX_CELLS: usize = 12_000;
/// Largest number of cells that the elements are divided into for a section. Not tuned: it trades the size of
/// a picture for detail.
const MAX_CELLS_OF_SECTION: usize = 1_500;
/// Largest number of cells for a section under a map: they are oblique, and show less of the field between
/// their corners. It is not tuned.
const MAX_CELLS_OF_BENT_SECTION: usize = 8_000;
/// Largest number of cells where a map turns large cells inside out, and finer ones are tried instead. Not
/// tuned: a limit that ordinary cases do not reach.
const MAX_CELLS_OF_FOLDED: usize = 100_000;
/// Numbers of cells of an element along an axis, over its degree there: the first that does not lead to too
/// many is taken. Not tuned: they fall slowly enough that most of the allowed cells are used.
const DIVISIONS: [f64; 14] = [2.5, 2.0, 1.75, 1.5, 1.25, 1.1, 1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.25];
/// Elements shorter than this share of what is shown are one cell: more detail would be invisible.
const TINY: f64 = 4e-3;
/// Pieces of an element that are no longer than this, in the reference coordinate from -1 to 1, are not
/// shown. Not tuned: only rounding makes pieces so short.
const SLIVER: f64 = 1e-6;

/// The share of one symmetric part in the state.
pub(crate) struct Share<'a> {
    /// Axes of the grid of the reduced layout; where a half turn reduces it, of the whole scene.
    axes: [&'a Axis; 3],
    /// Coefficients of the state on that grid.
    coefficients: Vec<f64>,
    /// Whether the potential is odd across the mirror plane of each axis.
    odd: [bool; 3],
}

impl<'a> Share<'a> {
    /// The share of a part, given by the coefficients of the state on the part's domain.
    pub(crate) fn new(domain: &'a Domain, coefficients: Vec<f64>, odd: [bool; 3]) -> Self {
        let turn = domain.turn.as_deref();
        match turn.and_then(|turn| Some((whole_axes(domain, turn), on_whole(domain, turn, &coefficients)?))) {
            Some((axes, coefficients)) => Self { axes, coefficients, odd },
            None => Self { axes: domain.axes.each_ref(), coefficients, odd },
        }
    }

    fn dims(&self) -> Dims {
        self.axes.map(|axis| axis.functions().len())
    }

    /// The factor of the share's potential on one side (-1 or 1) of the mirror plane of axis `a`.
    fn parity(&self, a: usize, side: f64) -> f64 {
        if self.odd[a] { side } else { 1.0 }
    }
}

/// The sample points of one axis, and the axis functions there.
struct Samples {
    /// Node coordinates, scaled.
    nodes: Vec<f64>,
    /// Values of the axis functions at the nodes: rows nodes, columns functions.
    value: SparseRows<f64>,
    /// Slopes of the functions in the cell below each node, and in the one above it; at an end of the axis
    /// both are those of the only cell.
    slopes: [SparseRows<f64>; 2],
}

/// Which images of the part that is solved are shown along an axis. The part itself lies above the mirror
/// plane, its mirror image below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Images {
    /// The part itself.
    Part,
    /// The part and its mirror image.
    Both,
    /// The mirror image alone.
    Mirrored,
}

impl Images {
    /// Number of times that the cells of the part are shown.
    fn count(self) -> usize {
        match self {
            Self::Part | Self::Mirrored => 1,
            Self::Both => 2,
        }
    }
}

/// The repetition of the cells of the part that is solved in the whole scene.
struct Reflection {
    /// The images that are shown along each axis.
    images: [Images; 3],
    /// Cells of the part along each axis.
    part: [usize; 3],
    /// Cells of the whole scene along each axis.
    whole: [usize; 3],
}

impl Reflection {
    fn new(images: [Images; 3], part: [usize; 3]) -> Self {
        Self { images, part, whole: [0, 1, 2].map(|a| part[a] * images[a].count()) }
    }

    /// The node of the part whose image is node `i` of the whole on axis `a`, and the side of the mirror
    /// plane that the image lies on: -1 below it, else 1. The node on the plane belongs to both halves; it
    /// counts as above.
    fn node(&self, a: usize, i: usize) -> (usize, f64) {
        let n = self.part[a];
        match (self.images[a], i < n) {
            (Images::Part, _) => (i, 1.0),
            (Images::Mirrored, _) | (Images::Both, true) => (n - i, -1.0),
            (Images::Both, false) => (i - n, 1.0),
        }
    }

    /// Where to find the slope at node `i` on axis `a`, on its side `above` or below: the node of the part,
    /// whether on its upper side, and the side of the mirror plane (-1 or 1).
    fn slope(&self, a: usize, i: usize, above: bool) -> (usize, bool, f64) {
        let n = self.part[a];
        let is_image = match self.images[a] {
            Images::Part => false,
            Images::Mirrored => true,
            Images::Both => i < n || (i == n && !above),
        };
        if is_image {
            (n - i, !above, -1.0)
        } else {
            let (node, side) = self.node(a, i);
            (node, above, side)
        }
    }

    /// Node coordinates of the whole scene on axis `a`, m, from those of the part, which are in units of the
    /// layout.
    fn coordinates(&self, a: usize, part_nodes: &[f64], layout: &Layout) -> Vec<f64> {
        let image = |from: usize| part_nodes.iter().skip(from).rev().map(|x| -x);
        let places: Vec<f64> = match self.images[a] {
            Images::Part => part_nodes.to_vec(),
            Images::Both => image(1).chain(part_nodes.iter().copied()).collect(),
            Images::Mirrored => image(0).collect(),
        };
        places.into_iter().map(|x| layout.origin[a] + layout.unit * x).collect()
    }
}

/// Samples one state of the scene: its potential and its electric field as the sum of the shares of all
/// parts.
///
/// `potentials`, V, are those of the scene's conductors in this state; they are handed on in the result. The
/// samples fill [`Scene::sensor`], and are denser in sections through it, one of which is where the scene is
/// loaded. Without shares, all lists of the result are empty.
pub(crate) fn sample(
    (scene, loaded_at): (&Scene, Option<[f64; 2]>),
    layout: &Layout,
    shares: &[Share<'_>],
    mirrored: [bool; 3],
    potentials: Vec<f64>,
) -> Field {
    let shown = scene.sensor();
    let sampled = |shown: &Box3, flat: Option<usize>, images: [Images; 3]| {
        sample_in(scene, layout, shares, (shown, flat), images, potentials.clone())
    };
    let images = mirrored.map(|mirrored| if mirrored { Images::Both } else { Images::Part });
    let planes = SectionPlane::of_scene(&scene.conductor_bounds().collect::<Vec<_>>(), loaded_at);
    let section = |plane: SectionPlane| {
        let (a, mut slab, mut images) = (plane.axis, shown, images);
        let [low, high] = plane.slab();
        [slab.min[a], slab.max[a]] = [low, high];
        let of_mirror = layout.origin[a];
        if mirrored[a] && high <= of_mirror {
            // The part that is solved lies on the other side.
            [slab.min[a], slab.max[a]] = [2.0 * of_mirror - high, 2.0 * of_mirror - low];
            images[a] = Images::Mirrored;
        } else if mirrored[a] && low > of_mirror {
            images[a] = Images::Part;
        }
        let ends = [slab.min[a], slab.max[a]].map(|x| (x - of_mirror) / layout.unit);
        // Beyond the finite elements, nothing is known.
        let is_within = |share: &Share<'_>| !cells_of_axis(share.axes[a], layout.reach, ends, 0.0).is_empty();
        let is_known = shares.first().is_some_and(is_within);
        is_known.then(|| FieldSection { plane, field: sampled(&slab, Some(a), images) })
    };
    Field { sections: planes.into_iter().filter_map(section).collect(), ..sampled(&shown, None, images) }
}

/// Samples the box `shown`. It may be flat along one axis, where one cell is enough.
fn sample_in(
    scene: &Scene,
    layout: &Layout,
    shares: &[Share<'_>],
    (shown, flat): (&Box3, Option<usize>),
    images: [Images; 3],
    potentials: Vec<f64>,
) -> Field {
    let Some(first) = shares.first() else {
        return Field {
            nodes: Default::default(),
            points: None,
            potential: Vec::new(),
            electric_field: Vec::new(),
            relative_permittivity: Vec::new(),
            body: Vec::new(),
            potentials,
            sections: Vec::new(),
        };
    };
    let pieces = pieces(first.axes, (shown, flat), layout, images);
    let reflection = Reflection::new(images, [0, 1, 2].map(|a| pieces[a].len()));
    let mut nodes: [Vec<f64>; 3] = Default::default();
    let mut potential = vec![0.0; reflection.whole.iter().map(|n| n + 1).product()];
    let mut electric_field = vec![[[0.0; 3]; 2]; potential.len()];
    for share in shares {
        let samples = [0, 1, 2].map(|a| samples(share.axes[a], &pieces[a]));
        add_potential(&mut potential, share, &samples, &reflection);
        add_field(&mut electric_field, share, &samples, &reflection, layout.unit);
        if nodes[0].is_empty() {
            nodes = [0, 1, 2].map(|a| reflection.coordinates(a, &samples[a].nodes, layout));
        }
    }
    let lookup = scene.lookup();
    let (mut relative_permittivity, mut body) = (Vec::new(), Vec::new());
    for index in 0..reflection.whole.iter().product() {
        let cell = split(index, reflection.whole);
        let point = [0, 1, 2].map(|a| 0.5 * (nodes[a][cell[a]] + nodes[a][cell[a] + 1]));
        relative_permittivity.push(lookup.permittivity_at(point));
        body.push(match lookup.body_at(point) {
            Filling::Background => CellBody::Background,
            Filling::Conductor(c) => CellBody::Conductor(c.index),
            Filling::Dielectric(d) => CellBody::Dielectric(d.index),
        });
    }
    Field {
        nodes,
        points: None,
        potential,
        electric_field,
        relative_permittivity,
        body,
        potentials,
        sections: Vec::new(),
    }
}

/// The cells of each axis, as [`cells_of_axis`] gives them: as many per element as leads to no more than
/// [`MAX_CELLS`], or in a section, which is flat along an axis, [`MAX_CELLS_OF_SECTION`] or
/// [`MAX_CELLS_OF_BENT_SECTION`].
fn pieces(
    axes: [&Axis; 3],
    (shown, flat): (&Box3, Option<usize>),
    layout: &Layout,
    images: [Images; 3],
) -> [Vec<(usize, f64, f64)>; 3] {
    let plan = |division: f64| -> [Vec<(usize, f64, f64)>; 3] {
        [0, 1, 2].map(|a| {
            let ends = [shown.min[a], shown.max[a]].map(|x| (x - layout.origin[a]) / layout.unit);
            cells_of_axis(axes[a], layout.reach, ends, if flat == Some(a) { 0.0 } else { division })
        })
    };
    let cells = |pieces: &[Vec<(usize, f64, f64)>; 3]| -> usize {
        (0..3).map(|a| pieces[a].len() * images[a].count()).product()
    };
    let most = match (flat, &layout.map) {
        (None, _) => MAX_CELLS,
        (Some(_), None) => MAX_CELLS_OF_SECTION,
        (Some(_), Some(_)) => MAX_CELLS_OF_BENT_SECTION,
    };
    let plans = || DIVISIONS.into_iter().map(plan);
    let chosen = plans().find(|pieces| cells(pieces) <= most).unwrap_or_else(|| plan(0.0));
    let Some(placed) = &layout.map else { return chosen };
    let is_valid = |pieces: &[Vec<(usize, f64, f64)>; 3]| {
        let reflection = Reflection::new(images, [0, 1, 2].map(|a| pieces[a].len()));
        let nodes = [0, 1, 2].map(|a| reflection.coordinates(a, &places(axes[a], &pieces[a]), layout));
        has_volume_everywhere(&placed.map, &nodes)
    };
    if is_valid(&chosen) {
        return chosen;
    }
    // Straight sides of large cells do not follow a map that bends much; those of finer cells may.
    let finer: Vec<_> = plans().filter(|pieces| cells(pieces) > cells(&chosen)).collect();
    let valid = finer
        .into_iter()
        .rev()
        .filter(|pieces| cells(pieces) <= MAX_CELLS_OF_FOLDED)
        .find(|pieces| is_valid(pieces));
    valid.unwrap_or(chosen)
}

/// The nodes of the cells of one axis, scaled.
fn places(axis: &Axis, pieces: &[(usize, f64, f64)]) -> Vec<f64> {
    let place = |e: usize, s: f64| match axis.line.element(e) {
        Element::Finite { start, length } => Some(start + 0.5 * (s + 1.0) * length),
        _ => None,
    };
    let first = pieces.first().and_then(|&(e, s, _)| place(e, s));
    first.into_iter().chain(pieces.iter().filter_map(|&(e, _, s)| place(e, s))).collect()
}

/// Whether no cell between these nodes is flat or inside out under a map, judged by the middles of its faces.
fn has_volume_everywhere(map: &SceneMap, nodes: &[Vec<f64>; 3]) -> bool {
    let points = map.images(nodes);
    let [_, ny, nz] = nodes.each_ref().map(Vec::len);
    let cells = nodes.each_ref().map(|places| places.len().saturating_sub(1));
    (0..cells.iter().product()).all(|index| {
        let cell = split(index, cells);
        let corner = |n: usize| {
            let [i, j, k] = [cell[0] + (n >> 2), cell[1] + (n >> 1 & 1), cell[2] + (n & 1)];
            points[(i * ny + j) * nz + k]
        };
        let across = [4, 2, 1].map(|bit| {
            let mut sum = [0.0; 3];
            for n in 0..8 {
                let sign = if n & bit == 0 { -0.25 } else { 0.25 };
                let vertex = corner(n);
                (0..3).for_each(|r| sum[r] += sign * vertex[r]);
            }
            sum
        });
        let [a, b, c] = across;
        let normal = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (0..3).map(|r| a[r] * normal[r]).sum::<f64>() > 0.0
    })
}

/// Adds the share's potential, V, to that of all nodes `[i][j][k]` of the whole scene.
fn add_potential(potential: &mut [f64], share: &Share<'_>, samples: &[Samples; 3], reflection: &Reflection) {
    let [s0, s1, s2] = samples;
    let at_nodes = evaluate(&share.coefficients, [&s0.value, &s1.value, &s2.value], share.dims());
    let cells = reflection.part;
    for (index, value) in potential.iter_mut().enumerate() {
        let node = split(index, reflection.whole.map(|n| n + 1));
        let [(i, si), (j, sj), (k, sk)] = [0, 1, 2].map(|a| reflection.node(a, node[a]));
        let sign = share.parity(0, si) * share.parity(1, sj) * share.parity(2, sk);
        *value += sign * at_nodes[(i * (cells[1] + 1) + j) * (cells[2] + 1) + k];
    }
}

/// Adds the share's field, V/m, at all nodes `[i][j][k]` of the whole scene: the limits of each component
/// from the cells below and above the node along the axis of the component. `unit` is the layout's unit of
/// length, m.
fn add_field(
    electric_field: &mut [[[f64; 3]; 2]],
    share: &Share<'_>,
    samples: &[Samples; 3],
    reflection: &Reflection,
    unit: f64,
) {
    let nodes = reflection.part.map(|n| n + 1);
    for d in 0..3 {
        let slopes = [0, 1].map(|above| {
            let pick = |a: usize| if a == d { &samples[a].slopes[above] } else { &samples[a].value };
            evaluate(&share.coefficients, [pick(0), pick(1), pick(2)], share.dims())
        });
        for (index, e) in electric_field.iter_mut().enumerate() {
            let node = split(index, reflection.whole.map(|n| n + 1));
            let images = [0, 1, 2].map(|a| reflection.node(a, node[a]));
            for (above, limit) in e.iter_mut().enumerate() {
                let (slope_node, slope_above, slope_side) = reflection.slope(d, node[d], above == 1);
                let place = |a: usize| if a == d { slope_node } else { images[a].0 };
                let side = |a: usize| if a == d { slope_side } else { images[a].1 };
                let sign: f64 = (0..3).map(|a| share.parity(a, side(a))).product();
                let source = (place(0) * nodes[1] + place(1)) * nodes[2] + place(2);
                // The slope across the mirror plane changes sign with the side as well.
                limit[d] -= sign * slope_side * slopes[usize::from(slope_above)][source] / unit;
            }
        }
    }
}

/// The multi-index [i, j, k] of an entry of an array with these dimensions.
fn split(index: usize, n: [usize; 3]) -> [usize; 3] {
    [index / (n[1] * n[2]), index / n[2] % n[1], index % n[2]]
}

/// Cells of one axis between `ends`, as (element, lower, upper) in the reference coordinate of the element.
/// An element has about `division` times as many cells as its degree.
fn cells_of_axis(axis: &Axis, reach: f64, ends: [f64; 2], division: f64) -> Vec<(usize, f64, f64)> {
    let line = &axis.line;
    let mut out = Vec::new();
    for e in 0..line.elements() {
        let Element::Finite { start, length } = line.element(e) else { continue };
        let far = |end: usize| axis.walls[end] == Wall::Open;
        if (far(1) && start + length > 1.001 * reach) || (far(0) && start < -1.001 * reach) {
            continue;
        }
        let [from, to] = ends.map(|end| (2.0 * (end - start) / length - 1.0).clamp(-1.0, 1.0));
        // The shown region may end at a plane of the grid but for rounding, and a cell between the two would
        // be flat.
        if to - from <= SLIVER {
            continue;
        }
        let visible = length > TINY * (ends[1] - ends[0]);
        let pieces = if visible { (division * line.degree(e) as f64).round().max(1.0) as usize } else { 1 };
        let s = |i: usize| if i == pieces { to } else { from + (to - from) * i as f64 / pieces as f64 };
        out.extend((0..pieces).map(|i| (e, s(i), s(i + 1))));
    }
    out
}

/// Samples an axis at the ends of cells, which are given as by [`cells_of_axis`].
fn samples(axis: &Axis, pieces: &[(usize, f64, f64)]) -> Samples {
    let numbering = Numbering::new(&axis.line);
    let functions = axis.functions();
    let (rows, n) = (pieces.len() + 1, functions.len());
    let mut nodes = Vec::new();
    let mut value = Mat::zeros(rows, n);
    let mut slopes = [Mat::zeros(rows, n), Mat::zeros(rows, n)];
    for (cell, &(e, s0, s1)) in pieces.iter().enumerate() {
        let Element::Finite { start, length } = axis.line.element(e) else { continue };
        for (row, s) in [(cell, s0), (cell + 1, s1)] {
            if row == nodes.len() {
                nodes.push(start + 0.5 * (s + 1.0) * length);
            }
            let (v, d) = hierarchical(axis.line.degree(e), s);
            for (local, index) in numbering.element(&axis.line, e).into_iter().enumerate() {
                let Some(column) = index.filter(|i| functions.contains(i)).map(|i| i - functions.start)
                else {
                    continue;
                };
                value[(row, column)] = v[local];
                // A cell has the slopes above its lower node and below its upper one; beyond an end of the
                // axis there is no other.
                let slope = 2.0 / length * d[local];
                if row == cell || row + 1 == rows {
                    slopes[1][(row, column)] = slope;
                }
                if row == cell + 1 || row == 0 {
                    slopes[0][(row, column)] = slope;
                }
            }
        }
    }
    let sparse = |m: Mat<f64>| SparseRows::from_mat(m.as_ref());
    Samples { nodes, value: sparse(value), slopes: slopes.map(sparse) }
}

/// Values of the function with coefficients `u` at the tensor product of three axes' samples, `[i][j][k]`.
fn evaluate(u: &[f64], m: [&SparseRows<f64>; 3], mut dims: Dims) -> Vec<f64> {
    // The axis with the fewest samples comes first: for a section, the one across it.
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&a| m[a].rows());
    let mut out: Option<Vec<f64>> = None;
    for a in axes {
        let (next, shape) = along(a, m[a], out.as_deref().unwrap_or(u), dims);
        (out, dims) = (Some(next), shape);
    }
    out.unwrap_or_default()
}

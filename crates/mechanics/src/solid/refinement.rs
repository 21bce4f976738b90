//! Local refinement of a mesh: elements are cut in two along some of their axes.
//!
//! Where an element is finer than its neighbour, its side is a part of a larger side. The nodes of the finer
//! side that are not nodes of the larger one *hang*: their displacements follow from those of the larger side
//! by its shape functions, so that displacements stay continuous. A side must be at least half as long as
//! that of a neighbour along either direction, and of two sides that meet one must be a part of the other;
//! neighbours of the marked elements are cut too until both rules hold.

use std::collections::{BTreeMap, HashMap};

use super::dimension::{Dimension, Numbering, Numbers};
use super::hanging::add;
use super::mesh::Mesh;
use super::nodes_by_place::NodesByPlace;
use super::shape_functions::quadratic;

pub use super::hanging::{Hanging, HangingSide};

/// A mesh whose elements can be cut.
#[derive(Debug, Clone)]
pub struct Refinable<S: Dimension> {
    mesh: Mesh<S>,
    /// For each element the sides that belong to the surface of the body, as bits by their numbers.
    outside: Vec<u8>,
}

/// Points that are this close, over the extent of a mesh, are one node. Not tuned: it only has to lie above
/// rounding errors and below distances that matter.
const SAME: f64 = 1e-9;
/// The largest number of halvings of a side along either direction for which its parts are searched among the
/// sides of neighbours.
const MAX_HALVINGS: u32 = 2;
/// Weights of masters below this are zeros of shape functions, up to rounding. It is not tuned.
const ZERO: f64 = 1e-13;

/// An element during refinement: its nodes, its sides on the surface as bits, and the element of the initial
/// mesh that it is a part of.
#[derive(Debug, Clone)]
struct Leaf<S: Dimension> {
    nodes: S::Nodes,
    outside: u8,
    parent: u32,
}

/// A side of a leaf that is a part of a larger one.
#[derive(Debug, Clone, Copy)]
struct Within {
    /// The smaller side: the number of its leaf, and of the side in the leaf.
    fine: (u32, usize),
    /// The larger side, likewise.
    coarse: (u32, usize),
    /// The number of halvings of the larger side along its two directions, and the index of the part along
    /// each.
    halvings: [u32; 2],
    part: [u32; 2],
}

impl<S: Dimension> Refinable<S> {
    /// A mesh without hanging nodes.
    pub fn new(mesh: Mesh<S>) -> Self {
        let mut outside = vec![0; mesh.elements.len()];
        for side in mesh.boundary() {
            let nodes = &mesh.elements[side.element as usize];
            let middle = side.middle() as u32;
            for (k, local) in S::SIDES.iter().enumerate() {
                if nodes.as_ref()[local[local.len() / 2]] == middle {
                    outside[side.element as usize] |= 1 << k;
                }
            }
        }
        Self { mesh, outside }
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh<S> {
        &self.mesh
    }

    /// Whether a side of an element is collapsed into a point or line, as in the middle of a fan.
    pub(crate) fn is_collapsed(&self, element: usize) -> bool {
        let mut nodes = self.mesh.elements[element].as_ref().to_vec();
        let count = nodes.len();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.len() < count
    }

    /// Whether a side of an element belongs to the surface of the body.
    pub(crate) fn is_at_surface(&self, element: usize) -> bool {
        self.outside[element] != 0
    }

    /// The mean length in m of the edges of an element along one of its axes.
    pub(crate) fn length(&self, element: usize, axis: usize) -> f64 {
        let (nodes, stride) = (self.mesh.elements[element].as_ref(), 3_usize.pow(axis as u32));
        let is_corner = |n: usize| [n % 3, n / 3 % 3, n / 9].iter().all(|k| *k != 1);
        let place = |n: usize| S::in_space(&self.mesh.nodes[nodes[n] as usize]);
        let first = (0..nodes.len()).filter(|&n| is_corner(n) && n / stride % 3 == 0);
        let lengths = first.map(|n| {
            let (a, b) = (place(n), place(n + 2 * stride));
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
        });
        lengths.sum::<f64>() / (1 << (S::AXES - 1)) as f64
    }

    /// Cuts each element along the axes whose bits are set in its entry of `axes`, and others where the rules
    /// of the module require it. Returns the finer mesh, whose first nodes are those of this one, and for
    /// each of its elements the one that it is a part of.
    pub fn cut(&self, axes: &[u8]) -> (Self, Vec<u32>) {
        let places = self.mesh.nodes.iter().map(S::in_space);
        let extent = places.clone().flatten().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let mut nodes = NodesByPlace::new(SAME * extent);
        for place in places {
            nodes.node_at(place);
        }
        let elements = self.mesh.elements.iter().zip(&self.outside).enumerate();
        let mut leaves: Vec<Leaf<S>> = elements
            .map(|(e, (nodes, outside))| Leaf { nodes: *nodes, outside: *outside, parent: e as u32 })
            .collect();
        let mut marks = axes.to_vec();
        let within = loop {
            leaves = leaves.iter().zip(&marks).flat_map(|(leaf, &axes)| leaf.cut(axes, &mut nodes)).collect();
            let sides = Sides { leaves: &leaves, nodes: &nodes, by_corners: by_corners(&leaves) };
            let within = sides.all_within();
            marks = sides.marks(&within);
            if marks.iter().all(|axes| *axes == 0) {
                break within;
            }
        };
        let sides = Sides { leaves: &leaves, nodes: &nodes, by_corners: HashMap::new() };
        let hanging = Hanging {
            nodes: resolved(&sides.followed(&within)),
            sides: within.iter().map(|w| sides.hanging_side(w)).collect(),
        };
        let mesh = Mesh {
            nodes: nodes.places().iter().map(|x| S::Point::from_fn(|k| x[k])).collect(),
            elements: leaves.iter().map(|leaf| leaf.nodes).collect(),
            hanging,
        };
        let outside = leaves.iter().map(|leaf| leaf.outside).collect();
        (Self { mesh, outside }, leaves.iter().map(|leaf| leaf.parent).collect())
    }
}

/// The axis of an element along which the indices of consecutive nodes differ by `step`.
fn axis_of(step: usize) -> usize {
    match step {
        1 => 0,
        3 => 1,
        _ => 2,
    }
}

/// The axes of an element along the first and the second direction of its side `local`; in the plane there is
/// no second one.
fn directions<S: Dimension>(local: &[usize]) -> [usize; 2] {
    let along = |n: usize| axis_of(local[n].abs_diff(local[0]));
    [along(1), if S::AXES == 3 { along(3) } else { 0 }]
}

impl<S: Dimension> Leaf<S> {
    /// The parts of the leaf when it is cut along the axes whose bits are set.
    fn cut(&self, axes: u8, nodes: &mut NodesByPlace) -> Vec<Self> {
        let mut parts = vec![self.clone()];
        for axis in (0..S::AXES).filter(|axis| axes >> axis & 1 == 1) {
            parts = parts.iter().flat_map(|part| part.halves(axis, nodes)).collect();
        }
        parts
    }

    /// The lower and the upper half of the leaf along an axis.
    fn halves(&self, axis: usize, nodes: &mut NodesByPlace) -> [Self; 2] {
        let stride = 3_usize.pow(axis as u32);
        let nodes_before = self.nodes.as_ref();
        [0, 1].map(|half| {
            let children = S::Nodes::from_fn(|n| {
                let along = n / stride % 3;
                let node_at = |along: usize| nodes_before[n - n / stride % 3 * stride + along * stride];
                if along != 1 {
                    return node_at(half + along / 2);
                }
                let [a, b] = [half, half + 1].map(|k| nodes.places()[node_at(k) as usize]);
                nodes.node_at([0, 1, 2].map(|k| 0.5 * (a[k] + b[k])))
            });
            // The side at which the two halves meet is inside.
            let inner =
                S::SIDES.iter().position(|local| local.iter().all(|n| n / stride % 3 == 2 * (1 - half)));
            let outside = inner.map_or(self.outside, |side| self.outside & !(1 << side));
            Self { nodes: children, outside, parent: self.parent }
        })
    }
}

/// Corners of a side in ascending order; in the plane each of the two is repeated.
type Corners = [u32; 4];

/// The sides of leaves with given corners: the number of each leaf, and of the side in the leaf.
type ByCorners = HashMap<Corners, Vec<(u32, usize)>>;

/// The corners in ascending order.
fn sorted(mut corners: Corners) -> Corners {
    corners.sort_unstable();
    corners
}

/// The sides of all `leaves` by their corners.
fn by_corners<S: Dimension>(leaves: &[Leaf<S>]) -> ByCorners {
    let mut sides = ByCorners::new();
    for (e, leaf) in leaves.iter().enumerate() {
        for (side, local) in S::SIDES.iter().enumerate() {
            let corners = corners_of::<S>(|k| leaf.nodes.as_ref()[local[k]]);
            sides.entry(sorted(corners)).or_default().push((e as u32, side));
        }
    }
    sides
}

/// The corners of a side from its nodes.
fn corners_of<S: Dimension>(node: impl Fn(usize) -> u32) -> Corners {
    let count = S::SIDE_CORNERS.len();
    std::array::from_fn(|k| node(S::SIDE_CORNERS[k * count / 4]))
}

/// The sides of some leaves.
struct Sides<'a, S: Dimension> {
    leaves: &'a [Leaf<S>],
    nodes: &'a NodesByPlace,
    by_corners: ByCorners,
}

impl<S: Dimension> Sides<'_, S> {
    /// Node number `k` of a side.
    fn node(&self, (e, side): (u32, usize), k: usize) -> u32 {
        self.leaves[e as usize].nodes.as_ref()[S::SIDES[side][k]]
    }

    /// Sides inside the body whose neighbours have no side with the same corners, without those that are
    /// collapsed into a point or line.
    fn unmatched(&self) -> Vec<(u32, usize)> {
        let alone = self.by_corners.iter().filter(|(corners, sides)| {
            let mut distinct = corners.to_vec();
            distinct.dedup();
            sides.len() == 1 && distinct.len() >= S::AXES
        });
        let mut alone: Vec<_> = alone.map(|(_, sides)| sides[0]).collect();
        alone.retain(|(e, side)| self.leaves[*e as usize].outside >> side & 1 == 0);
        alone.sort_unstable();
        alone
    }

    /// The place in m of a point of a side, from 0 to 1 along both of its directions.
    fn place(&self, side: (u32, usize), at: [f64; 2]) -> [f64; 3] {
        let corner = |k: usize| self.nodes.places()[self.node(side, k) as usize];
        let weights = at.map(|s| [1.0 - s, s]);
        let mut place = [0.0; 3];
        for (k, &corner_at) in S::SIDE_CORNERS.iter().enumerate() {
            let weight = weights[0][k % 2] * if S::AXES == 3 { weights[1][k / 2] } else { 1.0 };
            let x = corner(corner_at);
            for a in 0..3 {
                place[a] += weight * x[a];
            }
        }
        place
    }

    /// The sides that are parts of larger ones.
    fn all_within(&self) -> Vec<Within> {
        let second = if S::AXES == 3 { MAX_HALVINGS } else { 0 };
        let mut parts = Vec::new();
        for coarse in self.unmatched() {
            for first in 0..=MAX_HALVINGS {
                for halvings in (0..=second).map(|second| [first, second]).filter(|h| *h != [0, 0]) {
                    for n in 0..1_u32 << (halvings[0] + halvings[1]) {
                        let part = [n % (1 << halvings[0]), n >> halvings[0]];
                        if let Some(fine) = self.part(coarse, halvings, part) {
                            parts.push(Within { fine, coarse, halvings, part });
                        }
                    }
                }
            }
        }
        parts
    }

    /// The side of another leaf that is the given part of a side.
    fn part(&self, coarse: (u32, usize), halvings: [u32; 2], part: [u32; 2]) -> Option<(u32, usize)> {
        let corner = |k: usize| {
            let at = [k % 2, k / 2];
            let along = |d: usize| (part[d] as usize + at[d]) as f64 / f64::from(1 << halvings[d]);
            self.nodes.find(self.place(coarse, [along(0), along(1)]))
        };
        let count = S::SIDE_CORNERS.len();
        let mut corners = [0; 4];
        for (k, node) in corners.iter_mut().enumerate() {
            *node = corner(k * count / 4)?;
        }
        let sides = self.by_corners.get(&sorted(corners))?;
        sides.first().copied().filter(|_| sides.len() == 1)
    }

    /// The axes along which leaves have to be cut for the rules to hold.
    fn marks(&self, within: &[Within]) -> Vec<u8> {
        let mut marks = vec![0; self.leaves.len()];
        let mut known: std::collections::HashSet<(u32, usize)> = std::collections::HashSet::new();
        for w in within {
            known.extend([w.fine, w.coarse]);
            let axes = directions::<S>(S::SIDES[w.coarse.1]);
            for d in (0..S::AXES - 1).filter(|&d| w.halvings[d] > 1) {
                marks[w.coarse.0 as usize] |= 1 << axes[d];
            }
        }
        // Where two sides that meet are each cut along another direction, both are also cut along the
        // direction of the other.
        let mut is_corner = vec![false; self.nodes.places().len()];
        for leaf in self.leaves {
            for local in S::SIDES {
                for &k in S::SIDE_CORNERS {
                    is_corner[leaf.nodes.as_ref()[local[k]] as usize] = true;
                }
            }
        }
        for side in self.unmatched().into_iter().filter(|side| !known.contains(side)) {
            let axes = directions::<S>(S::SIDES[side.1]);
            let cut = |a: usize, b: usize| [a, b].iter().any(|&k| is_corner[self.node(side, k) as usize]);
            let along = if S::AXES == 3 { [cut(1, 7), cut(3, 5)] } else { [true, false] };
            let neither = along == [false, false];
            for d in (0..S::AXES - 1).filter(|&d| neither || along[d]) {
                marks[side.0 as usize] |= 1 << axes[d];
            }
        }
        marks
    }

    /// For each hanging node the nodes of the larger side, which may hang themselves, and the values of their
    /// shape functions at it.
    fn followed(&self, within: &[Within]) -> BTreeMap<u32, Vec<(u32, f64)>> {
        let mut followed = BTreeMap::new();
        for w in within {
            let count = S::SIDES[w.coarse.1].len();
            let coarse: Vec<u32> = (0..count).map(|k| self.node(w.coarse, k)).collect();
            for k in 0..count {
                let along = |d: usize| {
                    let within_part = 0.5 * [k % 3, k / 3][d] as f64;
                    (f64::from(w.part[d]) + within_part) / f64::from(1 << w.halvings[d])
                };
                let at = [along(0), if S::AXES == 3 { along(1) } else { 0.0 }];
                let Some(node) = self.nodes.find(self.place(w.coarse, at)) else { continue };
                if coarse.contains(&node) || followed.contains_key(&node) {
                    continue;
                }
                let lines = at.map(|s| quadratic(2.0 * s - 1.0).0);
                let mut masters: Vec<(u32, f64)> = Vec::new();
                for (m, &master) in coarse.iter().enumerate() {
                    let weight = lines[0][m % 3] * if S::AXES == 3 { lines[1][m / 3] } else { 1.0 };
                    if weight.abs() > ZERO {
                        add(&mut masters, master, weight);
                    }
                }
                followed.insert(node, masters);
            }
        }
        followed
    }

    /// The two sides by their elements and middle nodes.
    fn hanging_side(&self, w: &Within) -> HangingSide {
        let name = |side: (u32, usize)| (side.0, self.node(side, S::SIDES[side.1].len() / 2));
        HangingSide { fine: name(w.fine), coarse: name(w.coarse) }
    }
}

/// The masters of hanging nodes, with masters that hang themselves replaced by their masters. A master
/// belongs to a larger side than the nodes that follow it, so that there are no cycles.
fn resolved(followed: &BTreeMap<u32, Vec<(u32, f64)>>) -> BTreeMap<u32, Vec<(u32, f64)>> {
    let mut done: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
    let mut waiting: Vec<u32> = followed.keys().copied().collect();
    while let Some(&node) = waiting.last() {
        let open = followed[&node].iter().map(|m| m.0);
        let open: Vec<u32> = open.filter(|m| followed.contains_key(m) && !done.contains_key(m)).collect();
        if done.contains_key(&node) {
            waiting.pop();
        } else if open.is_empty() {
            let mut masters = Vec::new();
            for &(master, weight) in &followed[&node] {
                match done.get(&master) {
                    Some(further) => {
                        further.iter().for_each(|&(m, part)| add(&mut masters, m, weight * part));
                    }
                    None => add(&mut masters, master, weight),
                }
            }
            masters.retain(|m| m.1.abs() > ZERO);
            masters.sort_unstable_by_key(|m| m.0);
            done.insert(node, masters);
            waiting.pop();
        } else {
            waiting.extend(open);
        }
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::dimension::{Plane, Space};
    use crate::solid::layer::LayerMesh;
    use crate::solid::mesh::{Patch, geometric, uniform};
    use crate::solid::space::layer::SpaceLayerMesh;

    /// Checks that hanging nodes reproduce quadratic functions, that masters do not hang, and that the
    /// surface keeps its size.
    fn sound<S: Dimension>(coarse: &Refinable<S>, fine: &Refinable<S>) {
        let mesh = fine.mesh();
        let value = |n: u32| {
            let x = S::in_space(&mesh.nodes[n as usize]);
            1.0 + x[0] - 2.0 * x[1] * x[1] + 0.5 * x[0] * x[2] + x[2] * x[2]
        };
        for (&node, masters) in &mesh.hanging.nodes {
            let sum: f64 = masters.iter().map(|m| m.1 * value(m.0)).sum();
            assert!((sum - value(node)).abs() < 1e-9, "{node}: {sum} {}", value(node));
            assert!(masters.iter().all(|m| !mesh.hanging.nodes.contains_key(&m.0)));
        }
        let surface = |mesh: &Mesh<S>| -> f64 {
            let sides = mesh.boundary();
            sides.iter().flat_map(|side| mesh.side_points(side, 2)).map(|point| point.weight).sum()
        };
        let (before, after) = (surface(coarse.mesh()), surface(mesh));
        assert!((before - after).abs() < 1e-9 * before, "{before} {after}");
    }

    fn marks<S: Dimension>(mesh: &Mesh<S>, wanted: impl Fn([f64; 3]) -> u8) -> Vec<u8> {
        let middle = |e: &S::Nodes| e.as_ref()[e.as_ref().len() / 2] as usize;
        mesh.elements.iter().map(|e| wanted(S::in_space(&mesh.nodes[middle(e)]))).collect()
    }

    #[test]
    fn cut_towards_a_corner_of_a_fan_in_the_plane_nothing_comes_apart() {
        let left = Patch::tensor(&uniform(0.0, 1.0, 2), &uniform(0.0, 1.0, 2));
        let mut rim: Vec<[f64; 2]> = uniform(0.0, 1.0, 2).iter().map(|&y| [1.0, y]).collect();
        rim.extend(uniform(1.0, 2.0, 2).iter().skip(1).map(|&x| [x, 1.0]));
        let fan = Patch::fan([2.0, 0.0], &rim, &geometric(0.5, 2));
        let coarse = Refinable::<Plane>::new(Mesh::from_patches(&[left, fan]));
        let mut fine = coarse.clone();
        for step in 0..4 {
            let axes = marks(fine.mesh(), |x| {
                let near = (x[0] - 0.7).hypot(x[1] - 0.3) < 0.5_f64.powi(step);
                if near { 3 } else { 0 }
            });
            fine = fine.cut(&axes).0;
            sound(&coarse, &fine);
        }
        assert!(!fine.mesh().hanging.nodes.is_empty());
    }

    #[test]
    fn cut_along_any_axes_in_space_nothing_comes_apart() {
        let cuts = uniform(0.0, 1.0, 2);
        cut_anyhow(&Refinable::new(Mesh::<Space>::tensor(&cuts, &cuts, &[0.0, 0.3, 1.0])), 4);
        // With fans that meet in a mitre, whose innermost hexahedra are wedges.
        let layer = SpaceLayerMesh {
            section: LayerMesh::uniform(1.0, 3.0, 2, 0.5, 1),
            across: uniform(0.0, 0.6, 1),
            side_fan: Some(0.4),
        };
        cut_anyhow(&Refinable::new(layer.mesh()), 3);
    }

    /// Cuts a fifth of the elements along random axes, again and again.
    fn cut_anyhow(coarse: &Refinable<Space>, times: usize) {
        let mut fine = coarse.clone();
        let mut state = 1_u64;
        for _ in 0..times {
            let axes: Vec<u8> = fine
                .mesh()
                .elements
                .iter()
                .map(|_| {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let random = state >> 33;
                    if random.is_multiple_of(5) { (random / 5 % 8) as u8 } else { 0 }
                })
                .collect();
            let (next, parents) = fine.cut(&axes);
            assert!(parents.iter().all(|&p| (p as usize) < fine.mesh().elements.len()));
            fine = next;
            sound(coarse, &fine);
        }
        assert!(fine.mesh().hanging.nodes.len() > 100, "{}", fine.mesh().hanging.nodes.len());
    }
}

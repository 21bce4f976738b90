//! The surfaces of the deformed layer and electrodes for a viewer, from the finite elements.

use std::collections::{HashMap, HashSet};

use elastocap_geometry::export::surfaces::{Corners, prism};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::model::{Body, State};

use super::curves::{Curve, DeformedCurves, simplified, through};

/// Surfaces of the whole layer as triangles with anticlockwise corners as seen from outside, m.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skin {
    /// The layer, electrodes included.
    pub layer: Vec<Corners>,
    /// Each electrode, in the order of their names.
    pub electrodes: Vec<Vec<Corners>>,
}

/// Largest distance of outlines from the finite elements, over the thickness of the layer.
const WITHIN: f64 = 2e-4;

/// The surfaces of a layer in plane strain; `width` is that of the layer along x3, and `electrode_width` that
/// of the electrodes, m. If a `pair` lies on both sides of the plane x1 = 0, one solved electrode represents
/// both.
pub(super) fn of_plane(
    body: &Body,
    state: &State,
    curves: &DeformedCurves,
    pair: bool,
    [width, electrode_width]: [f64; 2],
) -> Skin {
    let thickness = body.mesh.nodes.iter().map(|x| x[1]).fold(0.0, f64::max);
    let solid = |outline: &[[f64; 2]], width: f64| {
        let outline = simplified(outline, WITHIN * thickness);
        if outline.len() < 3 { Vec::new() } else { prism(2, [-0.5 * width, 0.5 * width], &outline) }
    };
    let mut layer = boundary(body, state, curves.half).unwrap_or_default();
    if curves.half {
        let left: Curve = layer.iter().rev().filter(|p| p[0] > 0.0).map(|p| [-p[0], p[1]]).collect();
        layer.extend(left);
    }
    let solved = curves.electrodes.iter().map(|faces| solid(&faces.concat(), electrode_width));
    let electrodes = match (curves.half, pair) {
        (false, _) => solved.collect(),
        (true, true) => solved.flat_map(both_sides).collect(),
        (true, false) => solved.map(|half| whole(&half, [true, false])).collect(),
    };
    Skin { layer: solid(&layer, width), electrodes }
}

/// The mirror image of a body on the left, and the body.
fn both_sides(right: Vec<Corners>) -> [Vec<Corners>; 2] {
    [right.iter().map(|triangle| mirrored(triangle, 0)).collect(), right]
}

/// The deformed boundary of the mesh, once around; for a right half, without the axis, from its lower to its
/// upper end.
fn boundary(body: &Body, state: &State, half: bool) -> Option<Curve> {
    let at_rest = |n: u32| body.mesh.nodes[n as usize];
    let moved = |n: u32| {
        let (x, u) = (at_rest(n), &state.displacement[2 * n as usize..]);
        [x[0] + u[0], x[1] + u[1]]
    };
    let size = body.mesh.nodes.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
    let on_axis = |n: u32| half && at_rest(n)[0].abs() < 1e-9 * size;
    let sides = body.mesh.boundary().into_iter().map(|side| side.nodes);
    let shown = sides.filter(|[from, _, to]| !(on_axis(*from) && on_axis(*to)));
    let next: HashMap<u32, [u32; 3]> = shown.map(|side| (side[0], side)).collect();
    let begin = if half {
        let lowest = next.keys().filter(|n| on_axis(**n));
        lowest.min_by(|a, b| at_rest(**a)[1].total_cmp(&at_rest(**b)[1]))
    } else {
        next.keys().min()
    };
    let mut nodes = vec![*begin?];
    while let Some([_, middle, to]) = nodes.last().and_then(|n| next.get(n)).copied() {
        nodes.extend([middle, to]);
        if to == nodes[0] || nodes.len() > 2 * next.len() + 1 {
            break;
        }
    }
    let mut curve = through(&nodes.iter().map(|&n| moved(n)).collect::<Vec<_>>());
    if !half {
        curve.pop();
    }
    Some(curve)
}

/// The nine nodes of each face of a hexahedron, row by row; rows and columns turn anticlockwise as seen from
/// outside.
const FACES: [[usize; 9]; 6] = [
    [0, 9, 18, 3, 12, 21, 6, 15, 24],
    [2, 5, 8, 11, 14, 17, 20, 23, 26],
    [0, 1, 2, 9, 10, 11, 18, 19, 20],
    [6, 15, 24, 7, 16, 25, 8, 17, 26],
    [0, 3, 6, 1, 4, 7, 2, 5, 8],
    [18, 19, 20, 21, 22, 23, 24, 25, 26],
];

/// The surfaces of a layer in three dimensions, of which the quarter at positive x1 and x3 was solved. An
/// electrode is completed by its mirror images; if a `pair` lies on both sides of the plane x1 = 0, these are
/// two electrodes.
pub(super) fn of_space(body: &Body<Space>, state: &State<Space>, electrodes: usize, pair: bool) -> Skin {
    let layer = whole(&quarter(body, state, |_| true), [true; 2]);
    let inclusion = |k: usize| quarter(body, state, |material| usize::from(material) == k + 1);
    let electrodes = if pair {
        both_sides(whole(&inclusion(0), [false, true])).into()
    } else {
        (0..electrodes).map(|k| whole(&inclusion(k), [true; 2])).collect()
    };
    Skin { layer, electrodes }
}

/// The surface of the elements of some materials, without the faces in the planes of symmetry.
fn quarter(body: &Body<Space>, state: &State<Space>, wanted: impl Fn(u16) -> bool) -> Vec<Corners> {
    let size = body.mesh.nodes.iter().map(|x| x[0].abs().max(x[2].abs())).fold(0.0, f64::max);
    let is_wanted = |e: u32| wanted(body.material[e as usize]);
    // Two faces that a hanging side joins are both interior.
    let inside =
        body.mesh.hanging.sides.iter().filter(|side| is_wanted(side.fine.0) && is_wanted(side.coarse.0));
    let inside: HashSet<(u32, u32)> = inside.flat_map(|side| [side.fine, side.coarse]).collect();
    let mut faces: HashMap<[u32; 4], [u32; 9]> = HashMap::new();
    for (number, e) in (0..).zip(&body.mesh.elements).filter(|(number, _)| is_wanted(*number)) {
        let faces_of = FACES.map(|face| face.map(|k| e[k]));
        for face in faces_of.into_iter().filter(|face| !inside.contains(&(number, face[4]))) {
            let mut key = [0, 2, 6, 8].map(|k| face[k]);
            key.sort_unstable();
            if faces.remove(&key).is_none() {
                faces.insert(key, face);
            }
        }
    }
    let in_plane =
        |face: &[u32; 9], a: usize| face.iter().all(|&n| body.mesh.nodes[n as usize][a].abs() < 1e-9 * size);
    let mut shown: Vec<_> =
        faces.into_values().filter(|face| !in_plane(face, 0) && !in_plane(face, 2)).collect();
    shown.sort_unstable();
    let moved = |n: u32| {
        let (x, u) = (body.mesh.nodes[n as usize], &state.displacement[3 * n as usize..]);
        [0, 1, 2].map(|k| x[k] + u[k])
    };
    let edges = Edges::of(&shown);
    let triangles = |face: &[u32; 9]| {
        let corners = [face[0], face[2], face[8], face[6]];
        let rim: Vec<u32> = (0..4).flat_map(|k| edges.chain(corners[k], corners[(k + 1) % 4])).collect();
        let (middle, count) = (moved(face[4]), rim.len());
        (0..count).map(|k| [middle, moved(rim[k]), moved(rim[(k + 1) % count])]).collect::<Vec<_>>()
    };
    shown.iter().flat_map(triangles).collect()
}

/// The edges of faces, by the numbers of their nodes.
struct Edges {
    /// The node in the middle of an edge between two corners, the smaller number first.
    middles: HashMap<[u32; 2], u32>,
}

impl Edges {
    fn of(faces: &[[u32; 9]]) -> Self {
        let edges = |face: &[u32; 9]| {
            [[0, 1, 2], [2, 5, 8], [8, 7, 6], [6, 3, 0]]
                .map(|[a, middle, b]| (key(face[a], face[b]), face[middle]))
        };
        Self { middles: faces.iter().flat_map(edges).collect() }
    }

    /// The nodes on the edge from corner `a` to corner `b`, without the last. On a face that is larger than
    /// its neighbour they include the nodes of the neighbour's edges, so that no crack is left between the
    /// two.
    fn chain(&self, a: u32, b: u32) -> Vec<u32> {
        match self.middles.get(&key(a, b)) {
            Some(&middle) if middle != a && middle != b => {
                let mut nodes = self.chain(a, middle);
                nodes.extend(self.chain(middle, b));
                nodes
            }
            Some(_) | None => vec![a],
        }
    }
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The triangles with their mirror images across the planes x1 = 0 and x3 = 0, as selected by `across`.
fn whole(triangles: &[Corners], across: [bool; 2]) -> Vec<Corners> {
    let mut completed = triangles.to_vec();
    for (axis, _) in [0, 2].into_iter().zip(across).filter(|(_, across)| *across) {
        let images: Vec<Corners> = completed.iter().map(|triangle| mirrored(triangle, axis)).collect();
        completed.extend(images);
    }
    completed
}

fn mirrored([a, b, c]: &Corners, axis: usize) -> Corners {
    let image = |p: &[f64; 3]| {
        let mut p = *p;
        p[axis] = -p[axis];
        p
    };
    [image(a), image(c), image(b)]
}

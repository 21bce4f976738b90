//! The surface of the deformed layer and of the electrodes in it, for a viewer: that of the finite elements themselves.

use std::collections::HashMap;

use elastocap_geometry::export::surfaces::{Corners, prism};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::model::{Body, State};

use super::curves::{Curve, DeformedCurves, simplified, through};

/// Surfaces in the order of the corners of the triangles, anticlockwise as seen from outside, m. All of the layer, whatever part of it
/// was solved.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skin {
    /// The layer, electrodes included.
    pub layer: Vec<Corners>,
    /// Each electrode, in the order of their names.
    pub electrodes: Vec<Vec<Corners>>,
}

/// How far outlines may be from the finite elements, over the thickness of the layer.
const WITHIN: f64 = 2e-4;

/// A layer in plane strain of this width along x3, m, and the electrodes in it of the width after that. If a `pair` lies on both sides
/// of the plane x1 = 0, one of them may stand for both.
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
    let own = curves.electrodes.iter().map(|faces| solid(&faces.concat(), electrode_width));
    let electrodes = match (curves.half, pair) {
        (false, _) => own.collect(),
        (true, true) => own.flat_map(both_sides).collect(),
        (true, false) => own.map(|half| whole(&half, [true, false])).collect(),
    };
    Skin { layer: solid(&layer, width), electrodes }
}

/// A body on the right, and after its mirror image on the left.
fn both_sides(right: Vec<Corners>) -> [Vec<Corners>; 2] {
    [right.iter().map(|triangle| mirrored(triangle, 0)).collect(), right]
}

/// The boundary of the mesh once around, deformed; of the right half without the axis, from its lower end to its upper one.
fn boundary(body: &Body, state: &State, half: bool) -> Option<Curve> {
    let at_rest = |n: u32| body.mesh.nodes[n as usize];
    let moved = |n: u32| {
        let (x, u) = (at_rest(n), &state.displacement[2 * n as usize..]);
        [x[0] + u[0], x[1] + u[1]]
    };
    let size = body.mesh.nodes.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
    let on_axis = |n: u32| half && at_rest(n)[0].abs() < 1e-9 * size;
    let mut sides: HashMap<[u32; 2], [u32; 3]> = HashMap::new();
    for e in &body.mesh.elements {
        for side in [[0, 1, 2], [2, 5, 8], [8, 7, 6], [6, 3, 0]].map(|side| side.map(|k| e[k])) {
            let [from, _, to] = side;
            // A side that is collapsed into a point bounds nothing; one that two elements share is inside.
            if from != to && sides.remove(&[to, from]).is_none() {
                sides.insert([from, to], side);
            }
        }
    }
    sides.retain(|_, [from, _, to]| !(on_axis(*from) && on_axis(*to)));
    let next: HashMap<u32, [u32; 3]> = sides.values().map(|side| (side[0], *side)).collect();
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

/// The nine nodes of each face of a hexahedron, row after row, so that rows and columns turn anticlockwise as seen from outside.
const FACES: [[usize; 9]; 6] = [
    [0, 9, 18, 3, 12, 21, 6, 15, 24],
    [2, 5, 8, 11, 14, 17, 20, 23, 26],
    [0, 1, 2, 9, 10, 11, 18, 19, 20],
    [6, 15, 24, 7, 16, 25, 8, 17, 26],
    [0, 3, 6, 1, 4, 7, 2, 5, 8],
    [18, 19, 20, 21, 22, 23, 24, 25, 26],
];

/// A layer in space of which the quarter at positive x1 and x3 was solved. An electrode is as whole as its two mirror images make it;
/// if a `pair` lies on both sides of the plane x1 = 0, they are two.
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

/// The surface of the elements of some materials without what lies in the planes of symmetry.
fn quarter(body: &Body<Space>, state: &State<Space>, wanted: impl Fn(u16) -> bool) -> Vec<Corners> {
    let size = body.mesh.nodes.iter().map(|x| x[0].abs().max(x[2].abs())).fold(0.0, f64::max);
    let mut faces: HashMap<[u32; 4], [u32; 9]> = HashMap::new();
    let chosen = body.mesh.elements.iter().zip(&body.material).filter(|(_, material)| wanted(**material));
    for (e, _) in chosen {
        for face in FACES.map(|face| face.map(|k| e[k])) {
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
    let pieces = |face: &[u32; 9]| {
        let at = face.map(moved);
        [0, 1, 3, 4].into_iter().flat_map(move |k| {
            let [a, b, c, d] = [at[k], at[k + 1], at[k + 4], at[k + 3]];
            [[a, b, c], [a, c, d]]
        })
    };
    shown.iter().flat_map(pieces).collect()
}

/// The triangles with their images across the planes x1 = 0 and x3 = 0, where `across` says so.
fn whole(triangles: &[Corners], across: [bool; 2]) -> Vec<Corners> {
    let mut all = triangles.to_vec();
    for (axis, _) in [0, 2].into_iter().zip(across).filter(|(_, across)| *across) {
        let images: Vec<Corners> = all.iter().map(|triangle| mirrored(triangle, axis)).collect();
        all.extend(images);
    }
    all
}

fn mirrored([a, b, c]: &Corners, axis: usize) -> Corners {
    let image = |p: &[f64; 3]| {
        let mut p = *p;
        p[axis] = -p[axis];
        p
    };
    [image(a), image(c), image(b)]
}

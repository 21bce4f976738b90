//! Scenes that tests of several parts begin with.

use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};

/// Conductors c0, c1, .. in vacuum between walls of one kind.
pub(crate) fn scene(domain: Box3, wall: Wall, shapes: Vec<Shape>) -> Scene {
    Scene {
        bodies: (0..).zip(shapes).map(|(k, shape)| Body::conductor(format!("c{k}"), shape)).collect(),
        background_permittivity: 1.0,
        domain,
        walls: [[wall; 2]; 3],
    }
}

/// A cube of twelve triangles around `center`, all diagonals where a file of quadrangles would have them.
pub(crate) fn cube(center: [f64; 3], half: f64) -> TriangleSurface {
    let points =
        (0..8).map(|k| [0, 1, 2].map(|a| center[a] + if k >> a & 1 == 0 { -half } else { half })).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    TriangleSurface { points, faces }
}

//! Planes of symmetry: a scene that is its own mirror image needs only one half of it solved.
//!
//! Potentials that are even about a plane, as those of conductors that all cross it are, have no flux through it: it takes the
//! place of an insulated wall.

use crate::meshing::tets::{bounds, flat_parts};
use crate::scene::{Box3, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Distances this small, relative to the extent of the scene, are none.
const TOLERANCE: f64 = 1e-9;

/// For each axis where the scene is its own mirror image about a plane normal to it, and each part of a body its own, m; at most one
/// plane per axis.
///
/// There is none for an axis along which nothing ends, for groups of a volume mesh, where a sheet lies in the plane, and
/// where a surface has edges on one side that the other side has not.
pub fn planes(scene: &Scene) -> [Option<f64>; 3] {
    let shapes: Vec<&Shape> = scene.shapes().collect();
    let boxes: Vec<Box3> = shapes.iter().map(|s| bounds(s)).chain([scene.domain]).collect();
    let extents = boxes.iter().flat_map(|b| (0..3).map(|a| b.extent(a)));
    let near = TOLERANCE * extents.filter(|e| e.is_finite()).fold(0.0, f64::max);
    [0, 1, 2].map(|axis| {
        let at = shapes.iter().zip(&boxes).find_map(|(shape, b)| middle(shape, b, axis))?;
        let plane = Plane { axis, at, near };
        let even = scene.walls[axis][0] == scene.walls[axis][1] && plane.halves(&scene.domain);
        let sheet = |b: &Box3| b.min[axis] == b.max[axis];
        let bodies = || shapes.iter().zip(&boxes);
        (even && bodies().all(|(shape, b)| !sheet(b) && plane.halves(b) && plane.keeps(shape))).then_some(at)
    })
}

/// The part of the scene above the planes, which become insulated walls. Bodies reach across them as before.
pub fn part(scene: &Scene, planes: [Option<f64>; 3]) -> Scene {
    let mut out = scene.clone();
    for (axis, at) in planes.into_iter().enumerate() {
        if let Some(at) = at {
            out.domain.min[axis] = at;
            out.walls[axis][0] = Wall::Insulated;
        }
    }
    out
}

/// Where the plane of a body would be.
fn middle(shape: &Shape, b: &Box3, axis: usize) -> Option<f64> {
    match shape {
        Shape::Sphere { center, .. } | Shape::Shell { center, .. } => Some(center[axis]),
        Shape::Cylinder { axis: along, base, .. } if *along != axis => Some(base[axis]),
        Shape::Box(_)
        | Shape::Cylinder { .. }
        | Shape::Extrusion { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => Some(0.5 * (b.min[axis] + b.max[axis])).filter(|at| at.is_finite()),
    }
}

#[derive(Debug, Clone, Copy)]
struct Plane {
    axis: usize,
    at: f64,
    near: f64,
}

impl Plane {
    /// Whether it goes through the middle of the box, or the box is everywhere along the axis.
    fn halves(&self, b: &Box3) -> bool {
        let (min, max) = (b.min[self.axis], b.max[self.axis]);
        let everywhere = min == f64::NEG_INFINITY && max == f64::INFINITY;
        everywhere || (min + max - 2.0 * self.at).abs() <= 2.0 * self.near
    }

    /// Whether a shape whose bounds it halves is its own image.
    fn keeps(&self, shape: &Shape) -> bool {
        match shape {
            Shape::Box(_) | Shape::Sphere { .. } | Shape::Shell { .. } | Shape::Cylinder { .. } => true,
            Shape::Extrusion { axis, .. } if *axis == self.axis => true,
            Shape::Extrusion { axis, outline, .. } => {
                self.keeps_outline(outline, usize::from([2, 2, 1][*axis] == self.axis))
            }
            Shape::Surface(surface) => self.keeps_surface(surface),
            Shape::Physical(_) => false,
        }
    }

    /// The same corners one after the other, the other way round.
    fn keeps_outline(&self, outline: &[[f64; 2]], k: usize) -> bool {
        let n = outline.len();
        let image = |i: usize| {
            let mut p = outline[i];
            p[k] = 2.0 * self.at - p[k];
            p
        };
        let same = |p: [f64; 2], q: [f64; 2]| (0..2).all(|m| (p[m] - q[m]).abs() <= 4.0 * self.near);
        (0..n).any(|start| (0..n).all(|i| same(image(i), outline[(start + n - i) % n])))
    }

    /// Every flat part is the image of one: they have the same edges, and a flat part is what lies within its edges.
    fn keeps_surface(&self, surface: &TriangleSurface) -> bool {
        let parts = flat_parts(surface);
        let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (t, f) in surface.faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                edges.entry([a.min(b), a.max(b)]).or_default().push(parts[t]);
            }
        }
        let mut outlines: BTreeMap<usize, Vec<[u32; 2]>> = BTreeMap::new();
        for (edge, sides) in &edges {
            if sides.len() != 2 {
                return false;
            }
            if sides[0] != sides[1] {
                sides.iter().for_each(|&part| outlines.entry(part).or_default().push(*edge));
            }
        }
        let corners: BTreeSet<u32> = outlines.values().flatten().flatten().copied().collect();
        let Some(images) = self.images(surface, &corners) else { return false };
        let all: BTreeSet<&Vec<[u32; 2]>> = outlines.values().collect();
        outlines.values().all(|outline| {
            let mut image: Vec<[u32; 2]> = outline
                .iter()
                .map(|e| {
                    let [a, b] = e.map(|p| images[&p]);
                    [a.min(b), a.max(b)]
                })
                .collect();
            image.sort_unstable();
            all.contains(&image)
        })
    }

    /// The corner at the image of each corner, if each has one and no two the same.
    fn images(&self, surface: &TriangleSurface, corners: &BTreeSet<u32>) -> Option<HashMap<u32, u32>> {
        let cell = 1e3 * self.near;
        let place = |p: [f64; 3]| p.map(|x| (x / cell).floor() as i64);
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for &c in corners {
            cells.entry(place(surface.points[c as usize])).or_default().push(c);
        }
        let step = |x: i64, k: i64| x.saturating_add(k - 1);
        let mut taken = BTreeSet::new();
        let mut out = HashMap::new();
        for &c in corners {
            let mut p = surface.points[c as usize];
            p[self.axis] = 2.0 * self.at - p[self.axis];
            let same = |q: u32| {
                let q = surface.points[q as usize];
                (0..3).all(|k| (p[k] - q[k]).abs() <= 4.0 * self.near)
            };
            let [x, y, z] = place(p);
            let image = (0..27)
                .filter_map(|k| cells.get(&[step(x, k % 3), step(y, k / 3 % 3), step(z, k / 9)]))
                .flatten()
                .copied()
                .find(|&q| same(q))?;
            if !taken.insert(image) {
                return None;
            }
            out.insert(c, image);
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests;

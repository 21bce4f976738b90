//! Meshes of scenes in layers: boxes, sheets, slabs, cylinders and extruded polygons along one axis.
//!
//! The outlines of all bodies together are triangulated once; the triangles are pulled along the axis through graded layers,
//! and each of the prisms is split into three tetrahedra. Layers and triangles know nothing of one another's size, so that a
//! thin gap does not ask for small triangles.

use super::TetMesh;
use super::faces::{Filling, Prisms, prisms};
use crate::meshing::plane::{self as planar, Fault, Planar, Ring, triangulate};
use crate::scene::{Box3, Scene, Wall};
use crate::shapes::Shape;

/// How fine a first mesh is; it is refined afterwards where that pays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayeredSizing {
    /// Size of triangles at an outline over the smaller side of the rectangle around it.
    pub near: f64,
    /// How much larger triangles and layers become per distance from bodies.
    pub growth: f64,
    /// Sides of the polygon, of equal area, that stands for a circle; at least 3.
    pub circle: usize,
    /// Thickness of the first layer at an end of a conductor over the thinner of what adjoins.
    pub first: f64,
    /// Where the mesh of open space ends, over the size of the scene; more than 1.
    pub reach: f64,
}

impl Default for LayeredSizing {
    fn default() -> Self {
        Self { near: 0.25, growth: 0.7, circle: 32, first: 0.4, reach: 25.0 }
    }
}

/// Why a scene in layers cannot be meshed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayeredError {
    /// A coordinate or size is not a number that a body can have.
    #[error("{name}: not a size or place that a body can have")]
    Size {
        /// The body.
        name: String,
    },
    /// An outline has fewer than three different corners, or no area.
    #[error("{name}: its outline encloses no area")]
    Degenerate {
        /// The body.
        name: String,
    },
    /// An outline crosses or touches itself.
    #[error("{name}: its outline crosses or touches itself")]
    Crossing {
        /// The body.
        name: String,
    },
    /// Two conductors have a point in common, or have in the mesh.
    #[error("{first} and {second} touch")]
    Touching {
        /// One conductor.
        first: String,
        /// The other.
        second: String,
    },
    /// Walls on both sides of one axis, open space along another: rays to infinity would hit the walls.
    #[error("open space between two opposite walls cannot be meshed; make one of the two open, or none")]
    OpenBetweenWalls,
    /// Nothing is left to mesh: there are no conductors, or the walls are inside out.
    #[error("there is no space around conductors to mesh")]
    NoSpace,
    /// The outlines need more triangles than are allowed, or smaller ones than can be.
    #[error("outlines lie so close together that the triangles between them are too many or too small")]
    TooFine,
}

/// Mesh of a scene in layers, or `None` if the scene is none: all bodies must be boxes, sheets across, cylinders or
/// extrusions along one and the same axis.
///
/// Circles become polygons of the same area; all other surfaces are met exactly.
///
/// # Errors
/// [`LayeredError`] names the body and what is wrong with it.
pub fn layered(scene: &Scene, sizing: &LayeredSizing) -> Option<Result<TetMesh, LayeredError>> {
    let extent = |axis: usize| {
        let ends = scene.conductor_parts().filter_map(|(_, part)| ends(part, axis));
        let all =
            ends.fold([f64::INFINITY, f64::NEG_INFINITY], |all, e| [all[0].min(e[0]), all[1].max(e[1])]);
        all[1] - all[0]
    };
    let axis = (0..3)
        .filter(|&axis| scene.shapes().all(|s| stands(s, axis)))
        .min_by(|&a, &b| extent(a).total_cmp(&extent(b)))?;
    Some(mesh(scene, sizing, axis))
}

/// Whether a shape is a planar figure pulled along an axis.
fn stands(shape: &Shape, along: usize) -> bool {
    match shape {
        Shape::Box(b) => b.sheet_normal().is_none_or(|normal| normal == along),
        Shape::Cylinder { axis, .. } | Shape::Extrusion { axis, .. } => *axis == along,
        _ => false,
    }
}

/// Lower and upper end of a shape along any axis.
fn ends(shape: &Shape, a: usize) -> Option<[f64; 2]> {
    match shape {
        Shape::Box(b) => Some([b.min[a], b.max[a]]),
        Shape::Cylinder { axis, base, height, .. } if *axis == a => Some([base[a], base[a] + height]),
        Shape::Cylinder { base, radius, .. } => Some([base[a] - radius, base[a] + radius]),
        Shape::Extrusion { axis, from, to, .. } if *axis == a => Some([*from, *to]),
        Shape::Extrusion { axis, outline, .. } => {
            let k = usize::from(across(*axis)[1] == a);
            let fold = |all: [f64; 2], p: &[f64; 2]| [all[0].min(p[k]), all[1].max(p[k])];
            Some(outline.iter().fold([f64::INFINITY, f64::NEG_INFINITY], fold))
        }
        _ => None,
    }
}

/// The two other axes.
pub(super) fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

/// A part of a body in layers.
pub(super) struct Body {
    /// What it fills space with.
    pub(super) filling: Filling,
    /// `None` for what fills the whole plane.
    pub(super) ring: Option<usize>,
    /// Ends along the axis, m, as they are among the planes.
    pub(super) ends: [f64; 2],
}

/// Where the mesh ends, and from where its rays start.
fn frame(scene: &Scene, reach: f64) -> Result<(Box3, [f64; 3]), LayeredError> {
    let open = |a: usize| scene.walls[a].map(|w| w == Wall::Open);
    if (0..3).any(|a| open(a) == [false; 2]) && (0..3).any(|a| open(a) != [false; 2]) {
        return Err(LayeredError::OpenBetweenWalls);
    }
    let mut center = [0.0; 3];
    let mut size = 0.0_f64;
    for a in 0..3 {
        let held = scene.conductor_parts().filter_map(|(_, part)| ends(part, a));
        let held =
            held.fold([f64::INFINITY, f64::NEG_INFINITY], |all, e| [all[0].min(e[0]), all[1].max(e[1])]);
        // Rays from a point of the only wall stay on its inner side.
        center[a] = match open(a) {
            [false, true] => scene.domain.min[a],
            [true, false] => scene.domain.max[a],
            _ => 0.5 * (held[0] + held[1]),
        };
        let filled = scene.dielectric_parts().filter_map(|(_, part)| ends(part, a));
        let bounds = held.into_iter().chain(filled.flatten());
        size = bounds.filter(|b| b.is_finite()).fold(size, |size, b| size.max((b - center[a]).abs()));
    }
    let mut frame = scene.domain;
    for a in 0..3 {
        let far = [center[a] - reach * size, center[a] + reach * size];
        if open(a)[0] {
            frame.min[a] = far[0];
        }
        if open(a)[1] {
            frame.max[a] = far[1];
        }
        let usable = frame.min[a].is_finite() && frame.max[a].is_finite() && frame.extent(a) > 0.0;
        if !usable || !center[a].is_finite() {
            return Err(LayeredError::NoSpace);
        }
    }
    Ok((frame, center))
}

/// The outline of a shape; empty if it fills the plane.
fn outline(shape: &Shape, axis: usize, frame: &Box3, circle: usize) -> Vec<[f64; 2]> {
    let [u, v] = across(axis);
    match shape {
        Shape::Box(b) => {
            let clip = |a: usize| [b.min[a].max(frame.min[a]), b.max[a].min(frame.max[a])];
            let ([u0, u1], [v0, v1]) = (clip(u), clip(v));
            let all = [u, v].into_iter().all(|a| clip(a) == [frame.min[a], frame.max[a]]);
            if all { Vec::new() } else { vec![[u0, v0], [u1, v0], [u1, v1], [u0, v1]] }
        }
        Shape::Cylinder { base, radius, .. } => {
            let turn = std::f64::consts::TAU / circle.max(3) as f64;
            let wide = radius * (turn / turn.sin()).sqrt();
            let corner = |i: usize| (i as f64 * turn).sin_cos();
            (0..circle.max(3)).map(corner).map(|(s, c)| [base[u] + wide * c, base[v] + wide * s]).collect()
        }
        Shape::Extrusion { outline, .. } => outline.clone(),
        _ => Vec::new(),
    }
}

/// Whether all numbers of a shape are such as it can have; a conductor is finite.
fn sound(shape: &Shape, conductor: bool) -> bool {
    let ordered = (0..3).filter_map(|a| ends(shape, a)).all(|[low, high]| {
        (low < high || (conductor && low == high)) && (!conductor || (low.is_finite() && high.is_finite()))
    });
    let flat = (0..3).filter_map(|a| ends(shape, a)).filter(|[low, high]| low == high).count();
    let inner = match shape {
        Shape::Cylinder { radius, height, base, .. } => {
            *radius > 0.0
                && *height > 0.0
                && (radius + height).is_finite()
                && base.iter().all(|x| x.is_finite())
        }
        Shape::Extrusion { outline, .. } => outline.iter().flatten().all(|x| x.is_finite()),
        _ => true,
    };
    ordered && flat <= 1 && inner
}

fn mesh(scene: &Scene, sizing: &LayeredSizing, axis: usize) -> Result<TetMesh, LayeredError> {
    let conductors = scene
        .conductors()
        .flat_map(|c| c.body.parts.iter().map(move |part| (&c.body.name, part, Filling::Conductor(c.index))));
    let dielectrics = scene.dielectrics().flat_map(|d| {
        d.body.parts.iter().map(move |part| (&d.body.name, part, Filling::Region(d.index as u32 + 1)))
    });
    if conductors.clone().next().is_none() {
        return Err(LayeredError::NoSpace);
    }
    let shapes: Vec<_> = conductors.chain(dielectrics).collect();
    for &(name, shape, filling) in &shapes {
        if let Shape::Extrusion { outline, .. } = shape
            && outline.len() < 3
        {
            return Err(LayeredError::Degenerate { name: name.clone() });
        }
        if !sound(shape, matches!(filling, Filling::Conductor(_))) {
            return Err(LayeredError::Size { name: name.clone() });
        }
    }
    let (frame, center) = frame(scene, sizing.reach.max(1.5))?;
    let [u, v] = across(axis);
    let plane = [[frame.min[u], frame.min[v]], [frame.max[u], frame.max[v]]];
    let growth = sizing.growth.max(0.05);
    let mut rings: Vec<Ring> = Vec::new();
    let mut bodies = Vec::new();
    for &(name, shape, filling) in &shapes {
        let corners = outline(shape, axis, &frame, sizing.circle);
        let [min, max] = bounds(&corners);
        let size = (max[0] - min[0]).max(max[1] - min[1]);
        let mut ring = None;
        // What a wall cuts off altogether has no outline left.
        let ends = ends(shape, axis).unwrap_or_default();
        let outside = (0..2).any(|k| min[k] >= plane[1][k] || max[k] <= plane[0][k]);
        let cut_off = outside && matches!(shape, Shape::Box(_));
        if !corners.is_empty() && !cut_off {
            let corners = planar::cleaned(&corners, size).map_err(|fault| match fault {
                Fault::Degenerate => LayeredError::Degenerate { name: name.clone() },
                Fault::Crossing => LayeredError::Crossing { name: name.clone() },
            })?;
            let narrow = (max[0] - min[0]).min(max[1] - min[1]);
            ring = Some(rings.len());
            rings.push(Ring { corners, near: sizing.near.clamp(1e-3, 1.0) * narrow });
        }
        let ends = if corners.is_empty() || ring.is_some() { ends } else { [f64::INFINITY; 2] };
        bodies.push(Body { filling, ring, ends });
    }
    planar::snapped(&mut rings, plane);
    let planar = triangulate(&rings, plane, growth).ok_or(LayeredError::TooFine)?;
    let widest = rings.iter().map(|r| r.near).fold(f64::INFINITY, f64::min);
    let nodes = layers(&mut bodies, [frame.min[axis], frame.max[axis]], widest, growth, sizing.first);
    let inside = rings.iter().map(|r| covered(&planar, &r.corners)).collect();
    let parts = Prisms { scene, axis, planar, nodes, bodies, inside, center };
    let mesh = prisms(&parts)?;
    if mesh.tets.is_empty() {
        return Err(LayeredError::NoSpace);
    }
    // Outlines that are apart by little more than rounding have triangles of no area between them.
    if (0..mesh.tets.len()).any(|t| mesh.determinant(t) <= 0.0) {
        return Err(LayeredError::TooFine);
    }
    Ok(mesh)
}

fn bounds(corners: &[[f64; 2]]) -> [[f64; 2]; 2] {
    corners.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
        [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
    })
}

/// Which triangles lie in an outline.
fn covered(planar: &Planar, corners: &[[f64; 2]]) -> Vec<bool> {
    let middle = |t: &[u32; 3]| {
        let p = t.map(|p| planar.points[p as usize]);
        [0, 1].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0)
    };
    planar.triangles.iter().map(|t| planar::contains(corners, middle(t))).collect()
}

/// The planes of the axis, ascending, between `span`: graded, thin at the ends of conductors, and nowhere thicker than the triangles at outlines, `widest`, ask for. Ends of bodies that differ by rounding become equal.
fn layers(bodies: &mut [Body], span: [f64; 2], widest: f64, growth: f64, first: f64) -> Vec<f64> {
    let same = 1e-9
        * bodies
            .iter()
            .flat_map(|b| b.ends)
            .filter(|z| z.is_finite())
            .fold(0.0, |size, z| f64::max(size, (z - 0.5 * (span[0] + span[1])).abs()));
    let mut planes = vec![(span[0], false), (span[1], false)];
    for body in bodies {
        let held = matches!(body.filling, Filling::Conductor(_));
        for z in &mut body.ends {
            match planes.iter_mut().find(|p| (p.0 - *z).abs() <= same) {
                Some(plane) => {
                    *z = plane.0;
                    plane.1 |= held;
                }
                None if *z > span[0] && *z < span[1] => planes.push((*z, held)),
                None => {}
            }
        }
    }
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = planes.len();
    let sizes: Vec<(f64, f64)> = (0..count)
        .filter_map(|i| {
            let below = if i > 0 { planes[i].0 - planes[i - 1].0 } else { f64::INFINITY };
            let above = if i + 1 < count { planes[i + 1].0 - planes[i].0 } else { f64::INFINITY };
            let part = if planes[i].1 { first.clamp(1e-3, 1.0) } else { 1.0 };
            let end = i == 0 || i + 1 == count;
            (!end || planes[i].1).then_some((planes[i].0, (part * below.min(above)).min(widest)))
        })
        .collect();
    let wanted = |z: f64| {
        sizes.iter().map(|(at, size)| size + growth * (z - at).abs()).fold(span[1] - span[0], f64::min)
    };
    let mut nodes = vec![planes[0].0];
    for pair in planes.windows(2) {
        let (a, b) = (pair[0].0, pair[1].0);
        // Steps that are small against the layers count how many of those there are up to each of them.
        let mut steps = vec![(a, 0.0)];
        let (mut z, mut sum) = (a, 0.0);
        while z < b {
            let size = wanted(z);
            let step = (0.05 * size).min(b - z);
            sum += step / wanted(z + 0.5 * step);
            z = if step < 0.05 * size { b } else { z + step };
            steps.push((z, sum));
        }
        let count = sum.ceil().max(1.0) as usize;
        for i in 1..count {
            let target = sum * i as f64 / count as f64;
            let k = steps.partition_point(|s| s.1 < target).clamp(1, steps.len() - 1);
            let (low, high) = (steps[k - 1], steps[k]);
            nodes.push(low.0 + (high.0 - low.0) * (target - low.1) / (high.1 - low.1));
        }
        nodes.push(b);
    }
    nodes
}

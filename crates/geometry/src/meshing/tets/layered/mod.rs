//! Meshes of scenes in layers: boxes, sheets, slabs, cylinders and extruded polygons along one axis.
//!
//! The outlines of all bodies together are triangulated once. The triangles are extruded along the axis
//! through graded layers, and each of the resulting prisms is divided into three tetrahedra. Layers and
//! triangles are sized independently, so that a thin gap does not call for small triangles.

mod layer_planes;
mod prisms;

use super::TetMesh;
use crate::meshing::plane::{self, Outline, OutlineFault, PlaneMesh, triangulate};
use crate::outline::on_circle;
use crate::scene::{Box3, Scene, Wall, across};
use crate::shapes::Shape;
use layer_planes::{Layering, layer_planes};
use prisms::{Filling, Prisms, prisms};

/// How fine a mesh in layers is. It is meant as the first mesh of an adaptive refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayeredSizing {
    /// Size of triangles at an outline, relative to the shorter side of the rectangle around it.
    pub near: f64,
    /// Growth of the size of triangles and layers per distance from bodies.
    pub growth: f64,
    /// Number of sides, at least 3, of the polygon of equal area that replaces a circle.
    pub circle: usize,
    /// Thickness of the first layer at an end of a conductor, relative to the thinner of the two adjacent
    /// intervals.
    pub first: f64,
    /// Distance from the centre at which the mesh ends in open space, relative to the size of the scene; at
    /// least 1.5.
    pub reach: f64,
}

impl Default for LayeredSizing {
    fn default() -> Self {
        Self { near: 0.25, growth: 0.7, circle: 32, first: 0.4, reach: 25.0 }
    }
}

/// The least [`LayeredSizing::reach`]; a smaller one is raised to it. It is not tuned.
const MIN_REACH: f64 = 1.5;

/// Why a scene in layers cannot be meshed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayeredError {
    /// A coordinate or size of a body is not finite, not positive or out of order.
    #[error(
        "{name}: its coordinates or sizes are not those of a body; use finite numbers and positive sizes"
    )]
    Size {
        /// The body.
        name: String,
    },
    /// An outline has fewer than three distinct corners, or no area.
    #[error("{name}: its outline encloses no area; give at least three corners that do not lie on a line")]
    Degenerate {
        /// The body.
        name: String,
    },
    /// An outline crosses or touches itself.
    #[error("{name}: its outline crosses or touches itself; make it a simple polygon")]
    Crossing {
        /// The body.
        name: String,
    },
    /// Two conductors have a point in common, or their approximations in the mesh do.
    #[error("{first} and {second} touch; keep them apart")]
    Touching {
        /// One conductor.
        first: String,
        /// The other.
        second: String,
    },
    /// Walls on both sides of one axis and open space along another: rays to infinity would hit the walls.
    #[error(
        "open space between two opposite walls cannot be meshed; make one of the two walls open, or all sides walls"
    )]
    OpenBetweenWalls,
    /// There is nothing to mesh: the scene has no conductors, or its walls enclose no space outside them.
    #[error("there is no space around conductors to mesh; add a conductor, or move the walls outwards")]
    NoSpace,
    /// The outlines need too many triangles, or triangles without area.
    #[error(
        "outlines lie so close together that the triangles between them are too many or too small; keep them further apart, \
         or let them coincide"
    )]
    TooFine,
}

/// Meshes a scene in layers, in which all bodies are boxes, sheets normal to an axis, cylinders or extrusions
/// along this axis. `None` if there is no such axis.
///
/// Circles become polygons of the same area; all other surfaces are exact.
///
/// # Errors
/// [`LayeredError`] names the body and its fault.
pub fn layered(scene: &Scene, sizing: &LayeredSizing) -> Option<Result<TetMesh, LayeredError>> {
    let extent = |axis: usize| {
        let ends = scene.conductor_parts().filter_map(|(_, part)| ends(part, axis));
        let range = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |r, e| [r[0].min(e[0]), r[1].max(e[1])]);
        range[1] - range[0]
    };
    // The fewer triangles along outlines, the better; then the fewer layers.
    let length = |axis: usize| lengths_of_outlines(scene, sizing, axis);
    let axis = (0..3)
        .filter(|&axis| scene.shapes().all(|s| is_extruded(s, axis)))
        .min_by(|&a, &b| length(a).total_cmp(&length(b)).then(extent(a).total_cmp(&extent(b))))?;
    Some(mesh(scene, sizing, axis))
}

/// The sum of the lengths of all outlines over their widths: a measure of the number of triangles. A shape
/// that fills the plane has no outline.
fn lengths_of_outlines(scene: &Scene, sizing: &LayeredSizing, axis: usize) -> f64 {
    let Ok((frame, _)) = frame(scene, sizing.reach.max(MIN_REACH)) else { return 0.0 };
    let relative = |shape: &Shape| {
        let corners = outline(shape, axis, &frame, sizing.circle);
        if corners.is_empty() { 0.0 } else { plane::perimeter(&corners) / width(&corners) }
    };
    scene.shapes().map(relative).sum()
}

/// The shorter side of the rectangle around an outline, m.
fn width(corners: &[[f64; 2]]) -> f64 {
    let [min, max] = bounds(corners);
    (max[0] - min[0]).min(max[1] - min[1])
}

/// Whether a shape is a plane figure extruded along an axis.
fn is_extruded(shape: &Shape, along: usize) -> bool {
    match shape {
        Shape::Box(b) => b.sheet_normal().is_none_or(|normal| normal == along),
        Shape::Cylinder { axis, .. } | Shape::Extrusion { axis, .. } => *axis == along,
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => false,
    }
}

/// Lower and upper end of a shape along any axis, m; `None` for shapes that are never in layers.
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
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => None,
    }
}

/// A part of a body in layers.
struct Body {
    /// The conductor or region that fills it.
    filling: Filling,
    /// The index of its outline in the list of outlines; `None` for a body that fills the whole plane.
    outline: Option<usize>,
    /// Ends along the axis, m. [`layer_planes()`] makes them equal to the planes between layers in which they
    /// lie.
    ends: [f64; 2],
}

/// The box that the mesh fills, and the point where the rays to infinity start, m.
fn frame(scene: &Scene, reach: f64) -> Result<(Box3, [f64; 3]), LayeredError> {
    let open = |a: usize| scene.walls[a].map(|w| w == Wall::Open);
    if (0..3).any(|a| open(a) == [false; 2]) && (0..3).any(|a| open(a) != [false; 2]) {
        return Err(LayeredError::OpenBetweenWalls);
    }
    let mut center = [0.0; 3];
    let mut size = 0.0_f64;
    for a in 0..3 {
        let of_conductors = scene.conductor_parts().filter_map(|(_, part)| ends(part, a));
        let conductors = of_conductors
            .fold([f64::INFINITY, f64::NEG_INFINITY], |all, e| [all[0].min(e[0]), all[1].max(e[1])]);
        // Rays that start on the only wall stay on its inner side.
        center[a] = match open(a) {
            [false, true] => scene.domain.min[a],
            [true, false] => scene.domain.max[a],
            _ => 0.5 * (conductors[0] + conductors[1]),
        };
        let dielectrics = scene.dielectric_parts().filter_map(|(_, part)| ends(part, a));
        let bounds = conductors.into_iter().chain(dielectrics.flatten());
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

/// The outline of a shape, m; empty if it fills the plane.
fn outline(shape: &Shape, axis: usize, frame: &Box3, circle: usize) -> Vec<[f64; 2]> {
    let [u, v] = across(axis);
    match shape {
        Shape::Box(b) => {
            let clip = |a: usize| [b.min[a].max(frame.min[a]), b.max[a].min(frame.max[a])];
            let ([u0, u1], [v0, v1]) = (clip(u), clip(v));
            let fills_plane = [u, v].into_iter().all(|a| clip(a) == [frame.min[a], frame.max[a]]);
            if fills_plane { Vec::new() } else { vec![[u0, v0], [u1, v0], [u1, v1], [u0, v1]] }
        }
        Shape::Cylinder { base, radius, .. } => {
            let turn = std::f64::consts::TAU / circle.max(3) as f64;
            let wide = radius * (turn / turn.sin()).sqrt();
            on_circle([base[u], base[v]], wide, circle.max(3))
        }
        Shape::Extrusion { outline, .. } => outline.clone(),
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => Vec::new(),
    }
}

/// Whether the coordinates of a shape are in order, sizes positive and, for a conductor, everything finite.
fn valid(shape: &Shape, conductor: bool) -> bool {
    let ordered = (0..3).filter_map(|a| ends(shape, a)).all(|[low, high]| {
        (low < high || (conductor && low == high)) && (!conductor || (low.is_finite() && high.is_finite()))
    });
    let flat = (0..3).filter_map(|a| ends(shape, a)).filter(|[low, high]| low == high).count();
    let inner = match shape {
        Shape::Cylinder { radius, height, base, .. } => {
            *radius > 0.0
                && *height >= 0.0
                && (radius + height).is_finite()
                && base.iter().all(|x| x.is_finite())
        }
        Shape::Extrusion { outline, .. } => outline.iter().flatten().all(|x| x.is_finite()),
        Shape::Box(_)
        | Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => true,
    };
    ordered && flat <= 1 && inner
}

/// Meshes a scene in layers along this axis.
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
        if !valid(shape, filling.is_conductor()) {
            return Err(LayeredError::Size { name: name.clone() });
        }
    }
    let (frame, center) = frame(scene, sizing.reach.max(MIN_REACH))?;
    let [u, v] = across(axis);
    let rectangle = [[frame.min[u], frame.min[v]], [frame.max[u], frame.max[v]]];
    let growth = sizing.growth.max(0.05);
    let mut outlines: Vec<Outline> = Vec::new();
    let mut bodies = Vec::new();
    for &(name, shape, filling) in &shapes {
        let corners = outline(shape, axis, &frame, sizing.circle);
        let [min, max] = bounds(&corners);
        let size = (max[0] - min[0]).max(max[1] - min[1]);
        let mut outline = None;
        let ends = ends(shape, axis).unwrap_or_default();
        // A box that lies wholly beyond a wall has no outline left.
        let outside = (0..2).any(|k| min[k] >= rectangle[1][k] || max[k] <= rectangle[0][k]);
        let cut_off = outside && matches!(shape, Shape::Box(_));
        if !corners.is_empty() && !cut_off {
            let corners = plane::cleaned(&corners, size).map_err(|fault| match fault {
                OutlineFault::Degenerate => LayeredError::Degenerate { name: name.clone() },
                OutlineFault::Crossing => LayeredError::Crossing { name: name.clone() },
            })?;
            let near = sizing.near.clamp(1e-3, 1.0) * width(&corners);
            outline = Some(outlines.len());
            outlines.push(Outline { corners, near });
        }
        // A box that is cut off gets ends between which there is nothing.
        let ends = if corners.is_empty() || outline.is_some() { ends } else { [f64::INFINITY; 2] };
        bodies.push(Body { filling, outline, ends });
    }
    plane::join_coincident_corners(&mut outlines, rectangle);
    let planar = triangulate(&outlines, rectangle, growth).ok_or(LayeredError::TooFine)?;
    let near = outlines.iter().map(|r| r.near).fold(f64::INFINITY, f64::min);
    let layering = Layering { span: [frame.min[axis], frame.max[axis]], near, growth, first: sizing.first };
    let nodes = layer_planes(&mut bodies, &layering);
    let inside = outlines.iter().map(|r| covered(&planar, &r.corners)).collect();
    let parts = Prisms { scene, axis, planar, nodes, bodies, inside, center };
    let mesh = prisms(&parts)?;
    if mesh.tets.is_empty() {
        return Err(LayeredError::NoSpace);
    }
    // Between outlines whose distance is little more than rounding, triangles may have no area.
    if (0..mesh.tets.len()).any(|t| mesh.determinant(t) <= 0.0) {
        return Err(LayeredError::TooFine);
    }
    Ok(mesh)
}

/// The lower and the upper corner of the smallest rectangle around some points, m.
fn bounds(corners: &[[f64; 2]]) -> [[f64; 2]; 2] {
    corners.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
        [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
    })
}

/// For each triangle whether it lies in an outline.
fn covered(planar: &PlaneMesh, corners: &[[f64; 2]]) -> Vec<bool> {
    let middle = |t: &[u32; 3]| {
        let p = t.map(|p| planar.points[p as usize]);
        [0, 1].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0)
    };
    planar.triangles.iter().map(|t| plane::contains(corners, middle(t))).collect()
}

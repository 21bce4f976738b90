//! From the bodies of a scene to points, segments and facets.

use super::body_surfaces::{BodySurface, Cut};
use super::box_surfaces::add_boxes;
use super::faceting::faceted;
use super::piecewise_linear_complex::{PartInfo, PiecewiseLinearComplex, Seed};
use super::surface_intersections::resolve_intersections;
use super::thin_gaps::nearly_coincide;
use super::{MeshError, Point, Sizing};
use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::Shape;

/// Bodies smaller than this share of the scene cannot be distinguished from points. Not tuned: it only has to
/// lie above rounding errors and below distances that matter.
const SMALLEST: f64 = 1e-9;

/// The smallest box around a shape, infinite where the shape is; a point at the origin for a group of a
/// volume mesh.
pub(crate) fn bounds(shape: &Shape) -> Box3 {
    shape.bounds().unwrap_or(Box3 { min: [0.0; 3], max: [0.0; 3] })
}

/// The box in which the mesh ends: at the walls, and far from the bodies on open sides. Around a shell it
/// ends a little outside the hollow, or at walls that lie inside it.
///
/// # Errors
/// [`MeshError::Empty`] if nothing has an extent.
pub(super) fn domain(scene: &Scene, sizing: &Sizing) -> Result<Box3, MeshError> {
    if let Some(shell) = scene.shapes().find(|s| matches!(s, Shape::Shell { .. })) {
        let b = bounds(shell);
        let grown = 0.25 * b.largest_extent();
        let mut out = Box3 { min: b.min.map(|x| x - grown), max: b.max.map(|x| x + grown) };
        for a in 0..3 {
            if scene.domain.min[a] > b.min[a] {
                out.min[a] = scene.domain.min[a];
            }
            if scene.domain.max[a] < b.max[a] {
                out.max[a] = scene.domain.max[a];
            }
        }
        return Ok(out);
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for b in scene.shapes().map(bounds).chain([scene.domain]) {
        for a in 0..3 {
            for x in [b.min[a], b.max[a]].into_iter().filter(|x| x.is_finite()) {
                low[a] = low[a].min(x);
                high[a] = high[a].max(x);
            }
        }
    }
    let size = (0..3).map(|a| high[a] - low[a]).filter(|x| x.is_finite()).fold(0.0, f64::max);
    if size <= 0.0 {
        return Err(MeshError::Empty);
    }
    let far = 0.5 * sizing.far * size;
    let mut out = scene.domain;
    for a in 0..3 {
        let middle = if low[a] <= high[a] { 0.5 * (low[a] + high[a]) } else { 0.0 };
        if out.min[a].is_infinite() {
            out.min[a] = middle - far;
        }
        if out.max[a].is_infinite() {
            out.max[a] = middle + far;
        }
    }
    Ok(out)
}

/// A part of a body, with its number among all parts: those of conductors first, then those of dielectrics.
#[derive(Clone, Copy)]
struct BodyPart<'a> {
    /// The number among all parts.
    number: u32,
    /// The name of the body.
    name: &'a str,
    /// The shape of the part.
    shape: &'a Shape,
    /// The conductor that the part belongs to; `None` for a dielectric.
    conductor: Option<u32>,
}

impl BodyPart<'_> {
    /// The error that the body cannot be meshed because of a property.
    fn unsupported(&self, what: &'static str) -> MeshError {
        MeshError::Unsupported { body: self.name.into(), what }
    }

    /// The error that the surface of the body is not closed.
    fn not_closed(&self) -> MeshError {
        self.unsupported("a surface that is not closed")
    }
}

/// All parts of the bodies of a scene.
fn parts(scene: &Scene) -> Vec<BodyPart<'_>> {
    fn of(body: &Body, conductor: Option<u32>) -> impl Iterator<Item = (&str, &Shape, Option<u32>)> {
        body.parts.iter().map(move |shape| (body.name.as_str(), shape, conductor))
    }
    let conductors = scene.conductors().flat_map(|c| of(c.body, Some(c.index as u32)));
    let dielectrics = scene.dielectrics().flat_map(|d| of(d.body, None));
    let numbered = (0..).zip(conductors.chain(dielectrics));
    numbered.map(|(number, (name, shape, conductor))| BodyPart { number, name, shape, conductor }).collect()
}

/// All surfaces of the scene, with the points and segments in which they meet.
///
/// # Errors
/// Bodies that cannot be meshed, conductors that meet each other or a grounded wall, and round bodies whose
/// surfaces almost coincide.
pub(super) fn complex(
    scene: &Scene,
    domain: &Box3,
    sizing: &Sizing,
) -> Result<PiecewiseLinearComplex, MeshError> {
    let mut out = PiecewiseLinearComplex::default();
    let parts = parts(scene);
    out.parts.extend(parts.iter().map(|part| PartInfo {
        name: part.name.into(),
        conductor: part.conductor,
        ball: matches!(part.shape, Shape::Sphere { .. } | Shape::Shell { .. }),
    }));
    let tiny = SMALLEST * domain.largest_extent();
    let too_small = |part: &&BodyPart<'_>| {
        // A group of a volume mesh has no bounds.
        part.shape.bounds().is_some_and(|b| (0..3).all(|a| b.extent(a) < tiny))
    };
    if let Some(part) = parts.iter().find(too_small) {
        return Err(MeshError::TooSmall { body: part.name.into() });
    }
    add_boxes(&mut out, scene, domain, sizing)?;
    let mut planes = [0, 1, 2].map(|a| {
        let boxes = parts.iter().filter_map(|part| part.shape.as_box());
        boxes.chain([*domain]).flat_map(|b| [b.min[a], b.max[a]]).filter(|x| x.is_finite()).collect()
    });
    for part in &parts {
        add_part(&mut out, *part, scene, domain, sizing, &mut planes)?;
    }
    out.join_to_planes(domain);
    resolve_intersections(&mut out)?;
    for &[first, second] in &out.crossing_parts {
        let [one, other] = [first, second].map(|part| parts[part as usize]);
        if nearly_coincide(one.shape, other.shape, sizing.facet) {
            return Err(MeshError::Near { first: one.name.into(), second: other.name.into() });
        }
    }
    Ok(out)
}

/// Adds the surface of a part that is no box, within the walls and cut along slabs that it goes through.
///
/// `planes` holds, per axis, the coordinates of flat faces so far; faces that differ from one of these by
/// rounding move there.
fn add_part(
    out: &mut PiecewiseLinearComplex,
    part: BodyPart,
    scene: &Scene,
    domain: &Box3,
    sizing: &Sizing,
    planes: &mut [Vec<f64>; 3],
) -> Result<(), MeshError> {
    let size = match part.shape {
        Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
            add_center(out, domain, *center, sizing.facet * radius);
            sizing.facet * radius
        }
        Shape::Capsule { from, to, radius } => {
            if from == to {
                add_center(out, domain, *from, sizing.facet * radius);
            }
            sizing.facet * radius
        }
        Shape::Cylinder { radius, .. } | Shape::Tube { radii: [radius, _], .. } => sizing.facet * radius,
        Shape::Box(_) | Shape::Extrusion { .. } | Shape::Surface(_) | Shape::Physical(_) => {
            sizing.facet * bounds(part.shape).largest_extent()
        }
    };
    let ball = out.parts[part.number as usize].ball;
    for piece in faceted(part.shape, sizing) {
        let surface = match piece {
            Shape::Extrusion { axis, from, to, outline, .. } => {
                // Infinite bodies end at the end of the mesh.
                let ends = [from, to].map(|end| match end.is_finite() {
                    true => end,
                    false => end.clamp(domain.min[axis], domain.max[axis]),
                });
                BodySurface::prism(axis, ends, &outline, part.conductor)
            }
            Shape::Surface(surface) => BodySurface::triangles(&surface, !ball),
            Shape::Physical(_) => {
                return Err(part.unsupported("a group of a volume mesh, which is a mesh already"));
            }
            // The surfaces of boxes have been added already, and no piece is round.
            Shape::Box(_)
            | Shape::Sphere { .. }
            | Shape::Shell { .. }
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. }
            | Shape::Tube { .. } => continue,
        };
        add_surface(out, surface, part, scene, domain, size, planes)?;
    }
    Ok(())
}

/// Adds the surface of a piece of a part, with facets of about `size`, cut where [`add_part`] says.
fn add_surface(
    out: &mut PiecewiseLinearComplex,
    mut surface: BodySurface,
    part: BodyPart,
    scene: &Scene,
    domain: &Box3,
    size: f64,
    planes: &mut [Vec<f64>; 3],
) -> Result<(), MeshError> {
    surface.align(planes);
    for axis in 0..3 {
        for (at, above, wall) in
            [(domain.min[axis], true, scene.walls[axis][0]), (domain.max[axis], false, scene.walls[axis][1])]
        {
            surface.cut(Cut { axis, at, above }).ok_or_else(|| part.not_closed())?;
            if let Some(at) = surface.point_in_plane(axis, at)
                && part.conductor.is_some()
                && wall == Wall::Grounded
            {
                let second = "a grounded wall".into();
                return Err(MeshError::Crossing { first: part.name.into(), second, at });
            }
        }
    }
    let mut pieces = vec![surface];
    for (axis, at) in planes_through(scene, domain, &bounds(part.shape)) {
        let split = pieces.into_iter().map(|piece| piece.split(axis, at)).collect::<Option<Vec<_>>>();
        pieces = split.ok_or_else(|| part.not_closed())?.into_iter().flatten().collect();
    }
    for piece in pieces {
        piece.add_to(out, part.number, size).ok_or_else(|| part.unsupported("a face without an area"))?;
    }
    Ok(())
}

/// The planes of dielectric boxes and slabs that go all the way through a part with the bounds `around`: axis
/// and coordinate, m.
fn planes_through(scene: &Scene, domain: &Box3, around: &Box3) -> Vec<(usize, f64)> {
    // The flat faces of a round body stand out from it a little.
    let room = 0.1 * around.largest_extent();
    let mut out = Vec::new();
    for (_, part) in scene.dielectric_parts() {
        let Some(b) = part.as_box() else { continue };
        for axis in 0..3 {
            let covers = |a: usize| {
                b.min[a] <= (around.min[a] - room).max(domain.min[a])
                    && b.max[a] >= (around.max[a] + room).min(domain.max[a])
            };
            if (0..3).all(|a| a == axis || covers(a)) {
                let inside = |x: &f64| domain.min[axis] < *x && *x < domain.max[axis];
                out.extend([b.min[axis], b.max[axis]].into_iter().filter(inside).map(|at| (axis, at)));
            }
        }
    }
    out.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    out.dedup();
    out
}

/// Gives a ball a point at its centre, without which all points would lie on spheres.
fn add_center(out: &mut PiecewiseLinearComplex, domain: &Box3, center: Point, size: f64) {
    let on_wall = (0..3).any(|a| center[a] == domain.min[a] || center[a] == domain.max[a]);
    if on_wall && domain.contains(center) {
        out.point(center, size);
    } else {
        out.seeds.push(Seed { at: center, size });
    }
}

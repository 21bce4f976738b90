//! The scene of a bent layer: electrodes and layer as outlines in the plane of x1 and x2, pulled along x3.
//!
//! Finite elements of the layer in plane strain know the shape of every electrode and of the surface. The field solver for any
//! shape takes them as polygons, near enough to the curves that the capacitance does not see the difference.

use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::scene::{Box3, Wall};
use elastocap_geometry::shapes::{Shape, ShapeScene};

use crate::deform::{Curve, DeformedCurves, simplified};
use crate::scene_of::DeformedScene;

/// What part of the tolerance the polygons may take.
const SHARE: f64 = 0.2;

/// A scene, and the relative error that its flat faces add to a capacitance: an estimate.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BentScene {
    pub(crate) scene: ShapeScene,
    pub(crate) facets: f64,
}

/// `deformed` with its pair, and its layer where the surface is known to where walls end it, in the shape of `curves`.
pub(crate) fn bent_scene(deformed: &DeformedScene, curves: &DeformedCurves, tolerance: f64) -> BentScene {
    let mut scene = ShapeScene::from(&deformed.scene);
    let regions = || deformed.scene.conductors.iter().map(|c| &c.region).take(2);
    let gap = deformed.pair.map_or(f64::INFINITY, |pair| pair.gap);
    let smallest = regions().map(|r| r.extent(0).min(r.extent(1))).fold(gap, f64::min);
    let within = SHARE * tolerance * smallest;
    let outlines = outlines(curves, within);
    let ends: Vec<[f64; 2]> = regions().map(|r| [r.min[2], r.max[2]]).collect();
    for ((conductor, outline), [from, to]) in scene.conductors.iter_mut().zip(outlines).zip(ends) {
        conductor.shape = Shape::Extrusion { axis: 2, from, to, outline };
    }
    if surface_is_followed(deformed) {
        let domain = deformed.scene.domain;
        let height = domain.max[1] - domain.min[1];
        let surface = simplified(&curves.surface, SHARE * tolerance * height);
        let surface = if curves.half { both_halves(&surface) } else { surface };
        let outline = under(&surface, &domain);
        if outline.len() > 2 {
            // The cover fills what the layer leaves, down to the substrate, and the case's own bodies stay in all of them.
            let rank = |role: &BodyRole| match role {
                BodyRole::Cover => 0,
                BodyRole::Substrate => 1,
                BodyRole::Layer => 2,
                _ => 3,
            };
            let mut bodies: Vec<_> = deformed.roles.iter().zip(scene.dielectrics).collect();
            bodies.sort_by_key(|(role, _)| rank(role));
            for (role, body) in &mut bodies {
                match (role, &mut body.shape) {
                    (BodyRole::Cover, Shape::Box(region)) => region.min[1] = f64::NEG_INFINITY,
                    (BodyRole::Layer, shape) => {
                        let (from, to) = (domain.min[2], domain.max[2]);
                        *shape = Shape::Extrusion { axis: 2, from, to, outline: outline.clone() };
                    }
                    _ => {}
                }
            }
            scene.dielectrics = bodies.into_iter().map(|(_, body)| body).collect();
        }
    }
    BentScene { scene, facets: within / smallest }
}

/// Whether the scene can have the bulging surface: there is a medium above it, and walls end it at the sides.
pub(crate) fn surface_is_followed(deformed: &DeformedScene) -> bool {
    let scene = &deformed.scene;
    let ended = [0, 2].iter().all(|&a| scene.walls[a].iter().all(|wall| *wall != Wall::Open));
    ended && deformed.roles.contains(&BodyRole::Cover)
}

/// Whether the surface is a plane.
pub(crate) fn is_flat(curves: &DeformedCurves) -> bool {
    let heights = || curves.surface.iter().map(|p| p[1]);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    high - low <= 1e-9 * high.abs()
}

/// Outlines of the pair, in the order of its conductors.
fn outlines(curves: &DeformedCurves, within: f64) -> Vec<Curve> {
    let along = |faces: &[Curve]| {
        let mut path: Curve = Vec::new();
        for face in faces {
            let few = simplified(face, within);
            path.extend(&few[usize::from(!path.is_empty()).min(few.len())..]);
        }
        path
    };
    let closed = |faces: &[Curve]| {
        let mut outline = along(faces);
        outline.pop();
        outline
    };
    let own = curves.electrodes.iter();
    if !curves.half {
        return own.map(|faces| closed(faces)).collect();
    }
    match curves.electrodes.as_slice() {
        [right] => {
            let right = closed(right);
            vec![mirrored(&right), right]
        }
        // The left face is the axis.
        _ => own.map(|faces| both_halves(&along(&faces[..3]))).collect(),
    }
}

fn mirrored(curve: &[[f64; 2]]) -> Curve {
    curve.iter().rev().map(|p| [-p[0], p[1]]).collect()
}

/// A curve on the right of the axis together with its mirror image, as one. It begins on the axis, and may end there.
fn both_halves(curve: &[[f64; 2]]) -> Curve {
    let size = curve.iter().map(|p| p[0]).fold(0.0, f64::max);
    let on_axis = |p: &[f64; 2]| p[0].abs() <= 1e-9 * size;
    let mut whole = mirrored(curve);
    whole.retain(|p| !on_axis(p));
    whole.extend(curve.iter().map(|p| if on_axis(p) { [0.0, p[1]] } else { *p }));
    whole
}

/// The region below a curve that runs to the right and above the bottom of the layer, x2 = 0, within the domain; beyond its ends
/// the curve goes on at their height.
fn under(curve: &[[f64; 2]], domain: &Box3) -> Curve {
    let (Some(first), Some(last)) = (curve.first(), curve.last()) else { return Curve::new() };
    let left = domain.min[0].min(first[0]);
    let right = domain.max[0].max(last[0]);
    let mut outline = vec![[left, 0.0], [right, 0.0], [right, last[1]]];
    outline.extend(curve.iter().rev());
    outline.push([left, first[1]]);
    outline.dedup();
    for (axis, at, above) in
        [(0, domain.min[0], true), (0, domain.max[0], false), (1, 0.0, true), (1, domain.max[1], false)]
    {
        outline = cut(&outline, axis, at, above);
    }
    outline
}

/// The part of a polygon on one side of a line (Sutherland and Hodgman, Comm. ACM 17, 1974).
fn cut(polygon: &[[f64; 2]], axis: usize, at: f64, above: bool) -> Curve {
    let inside = |p: &[f64; 2]| if above { p[axis] >= at } else { p[axis] <= at };
    let mut part = Curve::new();
    for (k, p) in polygon.iter().enumerate() {
        let q = &polygon[(k + 1) % polygon.len()];
        if inside(p) {
            part.push(*p);
        }
        if inside(p) != inside(q) {
            let s = (at - p[axis]) / (q[axis] - p[axis]);
            let mut crossing = [0, 1].map(|a| p[a] + s * (q[a] - p[a]));
            crossing[axis] = at;
            part.push(crossing);
        }
    }
    part
}

//! The layer below a bent surface, as extruded outlines.
//!
//! The surface is followed up to the end of the finite elements, or to the walls. In open space it is
//! followed up to where it is level again, and the layer continues from there to infinity as a slab.

use elastocap_geometry::scene::{Body, Box3, Purpose, Scene, Wall};
use elastocap_geometry::shapes::Shape;

use super::{SHARE, SHARE_OF_CURVES, Sides, both_halves, polygon};
use crate::deform::{Curve, DeformedCurves, PIECES, simplified};
use crate::failure::SurfaceCrossesItself;
use crate::outline_curves::{Curved, both_halves as both_curved_halves, followed, under as under_curves};
use crate::scene::DeformedScene;

/// The largest loop of the surface that is cut out, over the height of the scene; larger ones are refused.
/// Not tuned: a limit that ordinary cases do not reach.
const LOOP: f64 = 0.02;

/// The distance from the last bent part of the surface to the slab that extends to infinity, over the height
/// of the layer. It is not tuned.
const BESIDE: f64 = 0.25;

/// The parts of the layer below a surface.
pub(super) struct Below {
    /// The parts of the whole layer, side by side.
    pub(super) parts: Vec<Shape>,
    /// The largest distance of the parts from the surface, over its height or that of the scene.
    pub(super) facets: f64,
    /// Whether some outlines contain cubics.
    pub(super) is_curved: bool,
    /// The estimated relative error of a capacitance from the ends of the surface; see
    /// [`super::LayerScene::ends`].
    pub(super) ends: f64,
}

/// The layer of a scene below its surface; `flat` is the height of the surface at rest, m. `None` where the
/// scene has no medium above the layer: its upper face is then a wall, which is flat.
///
/// # Errors
/// The surface crosses itself.
pub(super) fn below_surface(
    deformed: &DeformedScene,
    curves: &DeformedCurves,
    flat: f64,
    tolerance: f64,
    sides: Sides,
) -> Result<Option<Below>, SurfaceCrossesItself> {
    let scene = &deformed.scene;
    let (Some(first), Some(last)) = (curves.surface.first(), curves.surface.last()) else { return Ok(None) };
    if !scene.bodies.iter().any(|body| body.purpose == Purpose::Cover) {
        return Ok(None);
    }
    let is_open = scene.walls[0].map(|wall| wall == Wall::Open);
    // The heights at which the surface continues beyond its left and right end, and x1 of these ends.
    let levels = if curves.half { [last[1]; 2] } else { [first[1], last[1]] };
    let reach = if curves.half { [-last[0], last[0]] } else { [first[0], last[0]] };
    let height = if is_open.contains(&true) {
        levels[0].max(levels[1])
    } else {
        scene.domain.max[1] - scene.domain.min[1]
    };
    let within = SHARE * tolerance * height;
    let surface =
        without_loops(&curves.surface, LOOP * height).map_err(|[x1, x2]| SurfaceCrossesItself { x1, x2 })?;
    let is_whole = sides == Sides::Curves && surface.len() == curves.surface.len();
    let mut domain = scene.domain;
    let mut bent = surface;
    let of_curves = SHARE_OF_CURVES * tolerance * height;
    if is_open[1] {
        domain.max[0] = back_to_level(&mut bent, of_curves) + BESIDE * height;
        if curves.half {
            domain.min[0] = -domain.max[0];
        }
    }
    if is_open[0] && !curves.half {
        bent.reverse();
        bent.iter_mut().for_each(|p| p[0] = -p[0]);
        domain.min[0] = -back_to_level(&mut bent, of_curves) - BESIDE * height;
        bent.reverse();
        bent.iter_mut().for_each(|p| p[0] = -p[0]);
    }
    let chain = || {
        let pieces = followed(&bent, PIECES, of_curves);
        under_curves(if curves.half { both_curved_halves(pieces) } else { pieces }, &domain, within)
    };
    let Curved { outline, arcs, off } = is_whole.then(chain).flatten().unwrap_or_else(|| {
        let surface = simplified(&bent, within);
        let surface = if curves.half { both_halves(&surface) } else { surface };
        polygon(under(&surface, &domain), within)
    });
    if outline.len() < 3 {
        return Ok(None);
    }
    let is_curved = !arcs.is_empty();
    let mut parts = vec![Shape::Extrusion { axis: 2, from: domain.min[2], to: domain.max[2], outline, arcs }];
    for side in (0..2).filter(|side| is_open[*side]) {
        let mut slab = Box3 { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };
        slab.min[1] = 0.0;
        if levels[side] < domain.max[1] {
            slab.max[1] = levels[side];
        }
        match side {
            0 => slab.max[0] = domain.min[0],
            _ => slab.min[0] = domain.max[0],
        }
        parts.push(Shape::Box(slab));
    }
    let cut = if is_open.contains(&true) { of_curves } else { 0.0 };
    let facets = (off + cut) / height;
    let ends =
        (0..2).map(|side| left_at_end(scene, side, reach[side], levels[side] - flat)).fold(0.0, f64::max);
    Ok(Some(Below { parts, facets, is_curved, ends }))
}

/// Replaces the layer of a scene by these `parts`. The cover is extended down to the substrate, and the
/// bodies are sorted so that the layer overrides the cover, and all bodies but the substrate override both.
pub(super) fn fill(scene: &mut Scene, parts: &[Shape]) {
    scene.bodies.sort_by_key(|body| match body.purpose {
        Purpose::Cover => 0,
        Purpose::Substrate => 1,
        Purpose::Layer => 2,
        Purpose::Electrode
        | Purpose::InLayer
        | Purpose::OnTop
        | Purpose::Indenter
        | Purpose::OnIndenter
        | Purpose::Fixed => 3,
    });
    for Body { purpose, parts: shapes, .. } in &mut scene.bodies {
        match purpose {
            Purpose::Cover => {
                for part in shapes {
                    if let Shape::Box(region) = part {
                        region.min[1] = 0.0;
                    }
                }
            }
            Purpose::Layer => *shapes = parts.to_vec(),
            Purpose::Substrate
            | Purpose::Electrode
            | Purpose::InLayer
            | Purpose::OnTop
            | Purpose::Indenter
            | Purpose::OnIndenter
            | Purpose::Fixed => {}
        }
    }
}

/// The relative error of a capacitance for a bent surface on which a wall lies, which is flat: the share of
/// the layer's height in which the surface lies. An estimate; zero where a medium lies on the layer.
pub(crate) fn under_wall(scene: &Scene, curves: &DeformedCurves) -> f64 {
    let lies_on = |purpose: Purpose| scene.bodies.iter().any(|body| body.purpose == purpose);
    match curves.bent_between() {
        Some([low, high]) if lies_on(Purpose::Layer) && !lies_on(Purpose::Cover) => {
            (high / low - 1.0).min(1.0)
        }
        Some(_) | None => 0.0,
    }
}

/// Truncates a curve that runs to the right: drops its last part, which is within the distance `within` (m)
/// of the height of its end, and places the new end at that height. Returns the largest x1 of what is kept,
/// m.
fn back_to_level(curve: &mut Curve, within: f64) -> f64 {
    let level = curve.last().map_or(0.0, |p| p[1]);
    let bent = curve.iter().rposition(|p| (p[1] - level).abs() > within);
    // Keeps whole sides of elements.
    curve.truncate(bent.map_or(0, |k| k + 1).next_multiple_of(PIECES).max(PIECES) + 1);
    if let Some(last) = curve.last_mut() {
        last[1] = level;
    }
    curve.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max)
}

/// The relative error of a capacitance, by [`far_off`], for a surface that continues beyond its end at a
/// height that differs by `off` from that at rest, m. It is zero where a wall is nearer than the end.
fn left_at_end(scene: &Scene, side: usize, end: f64, off: f64) -> f64 {
    let outward = if side == 0 { -1.0 } else { 1.0 };
    let wall = if side == 0 { scene.domain.min[0] } else { scene.domain.max[0] };
    if outward * wall <= outward * end {
        return 0.0;
    }
    let bounds = scene.conductors().filter_map(|conductor| conductor.body.bounds());
    bounds.reduce(|a, b| a.union(&b)).map_or(0.0, |hull| {
        let room = if side == 0 { hull.min[0] - end } else { end - hull.max[0] };
        far_off(off, room, &hull)
    })
}

/// An estimate of the relative error of a capacitance for a surface whose height differs by `off` at this
/// distance from the conductors, m, with their bounding box `hull`. Of the energy of a charge, a share of
/// about the size of the conductors over the distance is farther away, and of that share, the height
/// difference over the distance is affected. Opposite charges have less energy there.
pub(crate) fn far_off(off: f64, distance: f64, hull: &Box3) -> f64 {
    let size = 0.5 * (0..3).map(|a| hull.extent(a)).fold(0.0, f64::max);
    if distance > off.abs() { off.abs() / distance * (size / (size + distance)) } else { 1.0 }
}

/// The curve without loops. Finite elements allow the surface to penetrate itself, as in the crease beside
/// the edge of a sharp punch.
///
/// # Errors
/// The place of a loop larger than `most`, m, which is not a mere crease.
pub(super) fn without_loops(curve: &[[f64; 2]], most: f64) -> Result<Curve, [f64; 2]> {
    let mut outline = Curve::new();
    let mut rest = curve;
    while let Some((from, after)) = rest.split_first() {
        outline.push(*from);
        let Some(to) = after.first() else { break };
        let from_last = after.windows(2).enumerate().skip(1).rev();
        let last_crossing =
            from_last.into_iter().find_map(|(k, w)| Some((k, crossing([*from, *to], [w[0], w[1]])?)));
        rest = match last_crossing {
            // Continues after the crossing.
            Some((k, at)) => {
                let far = after[..=k].iter().map(|p| (p[0] - at[0]).hypot(p[1] - at[1])).fold(0.0, f64::max);
                if far > most {
                    return Err(at);
                }
                outline.push(at);
                &after[k + 1..]
            }
            None => after,
        };
    }
    Ok(outline)
}

/// The point at which two segments cross, if they do.
fn crossing([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let turn =
        |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let (of_c, of_d) = (turn(a, b, c), turn(a, b, d));
    let apart = (of_c > 0.0) == (of_d > 0.0) || (turn(c, d, a) > 0.0) == (turn(c, d, b) > 0.0);
    let s = of_c / (of_c - of_d);
    (!apart && s.is_finite()).then(|| [0, 1].map(|k| c[k] + s * (d[k] - c[k])))
}

/// The region below a curve that runs to the right and above the bottom of the layer, x2 = 0, within the
/// domain. Beyond its ends the curve continues at their height.
pub(super) fn under(curve: &[[f64; 2]], domain: &Box3) -> Curve {
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

/// The part of a polygon on one side of the line at the coordinate `at` of an axis: on the side of larger
/// coordinates with `above` (Sutherland and Hodgman, Comm. ACM 17, 1974).
pub(super) fn cut(polygon: &[[f64; 2]], axis: usize, at: f64, above: bool) -> Curve {
    let is_inside = |p: &[f64; 2]| if above { p[axis] >= at } else { p[axis] <= at };
    let mut part = Curve::new();
    for (k, p) in polygon.iter().enumerate() {
        let q = &polygon[(k + 1) % polygon.len()];
        if is_inside(p) {
            part.push(*p);
        }
        if is_inside(p) != is_inside(q) {
            let s = (at - p[axis]) / (q[axis] - p[axis]);
            let mut crossing = [0, 1].map(|a| p[a] + s * (q[a] - p[a]));
            crossing[axis] = at;
            part.push(crossing);
        }
    }
    part
}

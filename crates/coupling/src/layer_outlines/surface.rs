//! The space below the surface of a layer that the load has bent.
//!
//! The surface is followed as far as the finite elements know it, or as far as walls let it. In open space it is followed to where it has
//! come back to a level, and the layer goes on from there to infinity as a slab.

use elastocap_geometry::scene::{Body, Box3, Purpose, Scene, Wall};
use elastocap_geometry::shapes::Shape;

use super::{SHARE, SHARE_OF_CURVES, Sides, both_halves, polygon};
use crate::deform::{Curve, DeformedCurves, PIECES, simplified};
use crate::failure::SurfaceCrossesItself;
use crate::outline_curves::{Curved, both_halves as both_curved_halves, followed, under as under_curves};
use crate::scene::DeformedScene;

/// Loops of the surface larger than this share of the scene's height are not cut out but refused.
const LOOP: f64 = 0.02;

/// How far beyond the last bent part of the surface the slab begins that goes on to infinity, over its height.
const BESIDE: f64 = 0.25;

/// The parts of the layer below a surface.
pub(super) struct Below {
    /// The parts of the layer, side by side; of the whole layer.
    pub(super) parts: Vec<Shape>,
    /// How far they may be from the surface, over its height or that of the scene.
    pub(super) facets: f64,
    /// Whether outlines have curves in them.
    pub(super) is_curved: bool,
    /// See [`super::LayerScene::ends`].
    pub(super) ends: f64,
}

/// The layer of a scene below its surface, which lies `flat` at this height where nothing bends it, m. `None` where the scene has no
/// medium above the layer: its upper face is a wall then, which is flat.
///
/// # Errors
/// A surface that crosses itself.
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
    // The heights at which the surface goes on beyond its ends, and where these are.
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
        let own = followed(&bent, PIECES, of_curves);
        under_curves(if curves.half { both_curved_halves(own) } else { own }, &domain, within)
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

/// Puts the parts of the layer into a scene. The cover fills what they leave above the substrate, and fixed bodies stay in all of them.
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
    for Body { purpose, parts: own, .. } in &mut scene.bodies {
        match purpose {
            Purpose::Cover => {
                for part in own {
                    if let Shape::Box(region) = part {
                        region.min[1] = 0.0;
                    }
                }
            }
            Purpose::Layer => *own = parts.to_vec(),
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

/// The relative error of a capacitance for a bent surface on which a wall lies, which is flat: the share of the layer's height in which the
/// surface lies. An estimate; zero where a medium lies on the layer.
pub(crate) fn under_wall(scene: &Scene, curves: &DeformedCurves) -> f64 {
    let lies_on = |purpose: Purpose| scene.bodies.iter().any(|body| body.purpose == purpose);
    match curves.bent_between() {
        Some([low, high]) if lies_on(Purpose::Layer) && !lies_on(Purpose::Cover) => {
            (high / low - 1.0).min(1.0)
        }
        Some(_) | None => 0.0,
    }
}

/// Ends a curve, which runs to the right, where all that follows is within a distance of its end's height, m; there it comes to lie at that
/// height. Returns how far the rest reaches to the right, m.
fn back_to_level(curve: &mut Curve, within: f64) -> f64 {
    let level = curve.last().map_or(0.0, |p| p[1]);
    let bent = curve.iter().rposition(|p| (p[1] - level).abs() > within);
    // Up to the end of a side of an element.
    curve.truncate(bent.map_or(0, |k| k + 1).next_multiple_of(PIECES).max(PIECES) + 1);
    if let Some(last) = curve.last_mut() {
        last[1] = level;
    }
    curve.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max)
}

/// The relative error of a capacitance for a surface that goes on beyond its end at the height `off` from where it should come back to, m,
/// as far as there is no wall before it: see [`far_off`].
fn left_at_end(scene: &Scene, side: usize, end: f64, off: f64) -> f64 {
    let outward = if side == 0 { -1.0 } else { 1.0 };
    let wall = if side == 0 { scene.domain.min[0] } else { scene.domain.max[0] };
    if outward * wall <= outward * end {
        return 0.0;
    }
    let bounds = scene.conductors().filter_map(|own| own.body.bounds());
    bounds.reduce(|a, b| a.union(&b)).map_or(0.0, |hull| {
        let room = if side == 0 { hull.min[0] - end } else { end - hull.max[0] };
        far_off(off, room, &hull)
    })
}

/// The relative error of a capacitance for a surface that is off by some height at this distance from the conductors, whose `hull` is given,
/// m: an estimate. Of the energy of a charge, the size of what holds it over the distance is farther away, and of that the height over the
/// distance is where the surface is off. Charges that are opposite have less there.
pub(crate) fn far_off(off: f64, distance: f64, hull: &Box3) -> f64 {
    let size = 0.5 * (0..3).map(|a| hull.extent(a)).fold(0.0, f64::max);
    if distance > off.abs() { off.abs() / distance * (size / (size + distance)) } else { 1.0 }
}

/// The curve without the loops that it makes where finite elements press the surface into itself, which nothing hinders: as the
/// one beside the edge of a sharp punch.
///
/// # Errors
/// The place of a loop larger than `most`, m: that is no crease but a tangle.
pub(super) fn without_loops(curve: &[[f64; 2]], most: f64) -> Result<Curve, [f64; 2]> {
    let mut kept = Curve::new();
    let mut rest = curve;
    while let Some((from, after)) = rest.split_first() {
        kept.push(*from);
        let Some(to) = after.first() else { break };
        let last = after.windows(2).enumerate().skip(1).rev();
        let met = last.into_iter().find_map(|(k, w)| Some((k, crossing([*from, *to], [w[0], w[1]])?)));
        rest = match met {
            // On from where the curve comes back.
            Some((k, at)) => {
                let far = after[..=k].iter().map(|p| (p[0] - at[0]).hypot(p[1] - at[1])).fold(0.0, f64::max);
                if far > most {
                    return Err(at);
                }
                kept.push(at);
                &after[k + 1..]
            }
            None => after,
        };
    }
    Ok(kept)
}

/// Where two segments cross.
fn crossing([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let turn =
        |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let (of_c, of_d) = (turn(a, b, c), turn(a, b, d));
    let apart = (of_c > 0.0) == (of_d > 0.0) || (turn(c, d, a) > 0.0) == (turn(c, d, b) > 0.0);
    let s = of_c / (of_c - of_d);
    (!apart && s.is_finite()).then(|| [0, 1].map(|k| c[k] + s * (d[k] - c[k])))
}

/// The region below a curve that runs to the right and above the bottom of the layer, x2 = 0, within the domain; beyond its ends
/// the curve goes on at their height.
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

/// The part of a polygon on one side of a line (Sutherland and Hodgman, Comm. ACM 17, 1974).
pub(super) fn cut(polygon: &[[f64; 2]], axis: usize, at: f64, above: bool) -> Curve {
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

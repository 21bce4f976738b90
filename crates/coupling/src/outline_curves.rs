//! Outlines of bent electrodes and surfaces as chains of straight lines and cubics.
//!
//! A side of a biquadratic element deforms to a parabola, which a cubic represents exactly. One cubic
//! replaces several sides where it is within the tolerance, so that outlines have no more pieces than needed.

use crate::deform::off_segment;
use elastocap_geometry::cubic::Cubic;
use elastocap_geometry::scene::Box3;
use elastocap_geometry::shapes::{Arc, Curve};

/// Number of rounds that improve the parameters of points on a fitted cubic. Tuned:
/// `benches/outlines.py punched-pair`.
const ROUNDS: usize = 4;

/// Largest turning angle of a fitted cubic, radians. Tuned: `benches/outlines.py punched-pair`.
const MAX_TURN: f64 = 1.5;

/// Largest number of sides of the polygon that represents a cubic for viewers and on tetrahedra. It is not
/// tuned.
const MAX_SIDES: f64 = 64.0;

/// Distance from a wall below which points lie on it, over the distance of the wall from the axis. Not tuned:
/// it only has to lie above rounding errors and below distances that matter.
const ON_WALL: f64 = 1e-9;

/// A part of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    cubic: Cubic,
    is_straight: bool,
    /// The largest distance from the curve that it replaces, m.
    off: f64,
}

/// A closed outline with curves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curved {
    /// The corners, including those of the polygons that represent its curves.
    pub(crate) outline: Vec<[f64; 2]>,
    /// The curves, with the sides that represent them.
    pub(crate) arcs: Vec<Arc>,
    /// The largest distance of the outline from the curve that it represents, m.
    pub(crate) off: f64,
}

/// Pieces that follow a curve `within` a distance, m; single sides of elements are followed exactly.
///
/// The curve has `per_side` points for each side of an element, and one more at its end.
pub(crate) fn followed(curve: &[[f64; 2]], per_side: usize, within: f64) -> Vec<Piece> {
    let mut out = Vec::new();
    if curve.len() > 1 {
        follow(curve, per_side, within, &mut out);
    }
    out
}

fn follow(curve: &[[f64; 2]], per_side: usize, within: f64, out: &mut Vec<Piece>) {
    let last = curve.len() - 1;
    let ends = [curve[0], curve[last]];
    let off = curve.iter().map(|p| off_segment(*p, ends)).fold(0.0, f64::max);
    if off <= within {
        out.push(Piece { off, ..straight(ends[0], ends[1]) });
    } else if last <= per_side {
        out.push(Piece { cubic: parabola(curve), is_straight: false, off: 0.0 });
    } else if let Some((cubic, off)) = fitted(curve, within) {
        out.push(Piece { cubic, is_straight: false, off });
    } else {
        let mut passed = vec![0.0];
        for pair in curve.windows(2) {
            passed.push(passed[passed.len() - 1] + distance(pair[0], pair[1]));
        }
        let from_middle = |k: &usize| (passed[*k] - 0.5 * passed[last]).abs();
        let corners = (per_side..last).step_by(per_side);
        let middle = corners.min_by(|k, l| from_middle(k).total_cmp(&from_middle(l))).unwrap_or(per_side);
        follow(&curve[..=middle], per_side, within, out);
        follow(&curve[middle..], per_side, within, out);
    }
}

fn straight(a: [f64; 2], b: [f64; 2]) -> Piece {
    let at = |t: f64| [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
    Piece { cubic: Cubic { control: [a, at(1.0 / 3.0), at(2.0 / 3.0), b] }, is_straight: true, off: 0.0 }
}

/// The cubic of the side of one element, a parabola.
fn parabola(curve: &[[f64; 2]]) -> Cubic {
    let last = curve.len() - 1;
    let (a, m, b) = (curve[0], curve[last / 2], curve[last]);
    let control = [0, 1].map(|k| 2.0 * m[k] - 0.5 * (a[k] + b[k]));
    let towards = |p: [f64; 2]| [0, 1].map(|k| (p[k] + 2.0 * control[k]) / 3.0);
    Cubic { control: [a, towards(a), towards(b), b] }
}

/// The least-squares cubic between the ends of a curve, with its largest distance from the points; `None`
/// unless that is `within` a distance.
fn fitted(curve: &[[f64; 2]], within: f64) -> Option<(Cubic, f64)> {
    let last = curve.len() - 1;
    let mut at = vec![0.0];
    for pair in curve.windows(2) {
        at.push(at[at.len() - 1] + distance(pair[0], pair[1]));
    }
    let length = at[last];
    at.iter_mut().for_each(|t| *t /= length);
    for _ in 0..ROUNDS {
        let cubic = nearest(curve, &at)?;
        for (t, p) in at.iter_mut().zip(curve) {
            *t = projected(&cubic, *p, *t);
        }
        let far = at.iter().zip(curve).map(|(t, p)| distance(cubic.at(*t), *p)).fold(0.0, f64::max);
        if far <= within {
            return (cubic.turn() < MAX_TURN).then_some((cubic, far));
        }
    }
    None
}

/// The cubic whose inner control points minimise the sum of squared distances at the parameters `at`.
fn nearest(curve: &[[f64; 2]], at: &[f64]) -> Option<Cubic> {
    let (first, last) = (curve[0], curve[curve.len() - 1]);
    let (mut aa, mut ab, mut bb, mut ra, mut rb) = (0.0, 0.0, 0.0, [0.0; 2], [0.0; 2]);
    for (&t, p) in at.iter().zip(curve) {
        let s = 1.0 - t;
        let (a, b) = (3.0 * s * s * t, 3.0 * s * t * t);
        aa += a * a;
        ab += a * b;
        bb += b * b;
        for k in 0..2 {
            let rest = p[k] - s * s * s * first[k] - t * t * t * last[k];
            ra[k] += a * rest;
            rb[k] += b * rest;
        }
    }
    let det = aa * bb - ab * ab;
    let one = [0, 1].map(|k| (bb * ra[k] - ab * rb[k]) / det);
    let other = [0, 1].map(|k| (aa * rb[k] - ab * ra[k]) / det);
    one.iter().chain(&other).all(|x| x.is_finite()).then_some(Cubic { control: [first, one, other, last] })
}

/// The parameter near `t` of the point of a cubic nearest to `p`, by one step of Newton's method.
fn projected(cubic: &Cubic, p: [f64; 2], t: f64) -> f64 {
    let [a, b, c, d] = cubic.control;
    let s = 1.0 - t;
    let slope =
        [0, 1].map(|k| 3.0 * (s * s * (b[k] - a[k]) + 2.0 * s * t * (c[k] - b[k]) + t * t * (d[k] - c[k])));
    let bend = [0, 1].map(|k| 6.0 * (s * (a[k] - 2.0 * b[k] + c[k]) + t * (b[k] - 2.0 * c[k] + d[k])));
    let place = cubic.at(t);
    let off = [0, 1].map(|k| place[k] - p[k]);
    let dot = |u: [f64; 2], v: [f64; 2]| u[0] * v[0] + u[1] * v[1];
    let step = dot(off, slope) / (dot(slope, slope) + dot(off, bend));
    if step.is_finite() { (t - step).clamp(0.0, 1.0) } else { t }
}

/// The mirror image of a chain across the axis x = 0, in the opposite direction.
pub(crate) fn mirrored(pieces: &[Piece]) -> Vec<Piece> {
    let image = |piece: &Piece| {
        let control = piece.cubic.reversed().control.map(|[x, y]| [-x, y]);
        Piece { cubic: Cubic { control }, ..*piece }
    };
    pieces.iter().rev().map(image).collect()
}

/// The pieces on the right of the axis, with their mirror image. They begin on the axis, and may end there.
pub(crate) fn both_halves(mut right: Vec<Piece>) -> Vec<Piece> {
    let size = right.iter().map(|piece| piece.cubic.control[3][0]).fold(0.0, f64::max);
    for piece in &mut right {
        for end in [0, 3] {
            let x = &mut piece.cubic.control[end][0];
            *x = if x.abs() <= ON_WALL * size { 0.0 } else { *x };
        }
    }
    [mirrored(&right), right].concat()
}

/// A closed chain of pieces as an outline whose polygon is `within` a distance of the curves, m.
pub(crate) fn closed(pieces: &[Piece], within: f64) -> Curved {
    let (mut outline, mut arcs) = (Vec::new(), Vec::new());
    for Piece { cubic, is_straight, .. } in pieces {
        let begin = outline.len();
        outline.push(cubic.control[0]);
        if *is_straight {
            continue;
        }
        let [a, b, c, d] = cubic.control;
        let bend = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (p[0] - 2.0 * q[0] + r[0]).hypot(p[1] - 2.0 * q[1] + r[1])
        };
        // A chord is off by an eighth of the second derivative times the square of its share of the
        // parameter.
        let sides = (0.75 * bend(a, b, c).max(bend(b, c, d)) / within).sqrt().ceil().clamp(2.0, MAX_SIDES);
        outline.extend((1..sides as usize).map(|k| cubic.at(k as f64 / sides)));
        arcs.push(Arc { curve: Curve::Cubic(*cubic), sides: begin..outline.len() });
    }
    let off = pieces.iter().map(|piece| piece.off).fold(0.0, f64::max);
    Curved { outline, arcs, off }
}

/// The region below a chain that runs to the right and above the bottom of the layer, x2 = 0, between the
/// walls of the domain. Beyond its ends the chain continues at their height. `None` where the chain crosses a
/// wall more than once, or the bottom or the top.
pub(crate) fn under(surface: Vec<Piece>, domain: &Box3, within: f64) -> Option<Curved> {
    let [left, right] = [domain.min[0], domain.max[0]];
    let surface = up_to(surface, right)?;
    let surface = mirrored(&up_to(mirrored(&surface), -left)?);
    let is_between = |p: &[f64; 2]| 0.0 < p[1] && p[1] < domain.max[1];
    if !surface.iter().all(|piece| piece.cubic.control.iter().all(is_between)) {
        return None;
    }
    let (first, last) = (surface.first()?.cubic.control[0], surface.last()?.cubic.control[3]);
    let corners = [first, [left, 0.0], [right, 0.0], last];
    let below = corners.windows(2).map(|ends| straight(ends[0], ends[1]));
    let back = surface.iter().rev().map(|piece| Piece { cubic: piece.cubic.reversed(), ..*piece });
    Some(closed(&below.chain(back).collect::<Vec<_>>(), within))
}

/// The part of a chain that runs to the right up to a wall; a chain that ends before the wall is continued at
/// its height. `None` where it crosses the wall more than once.
fn up_to(chain: Vec<Piece>, wall: f64) -> Option<Vec<Piece>> {
    let near = ON_WALL * wall.abs();
    let crossings = |piece: &Piece| piece.cubic.crossings([[wall, 0.0], [wall, wall.abs()]]);
    let mut out: Vec<Piece> = Vec::new();
    let mut rest = chain.into_iter();
    for piece in rest.by_ref() {
        match crossings(&piece)[..] {
            [] => out.push(piece),
            [t] => {
                let mut part = Piece { cubic: piece.cubic.part([0.0, t]), ..piece };
                part.cubic.control[3][0] = wall;
                let [from, .., to] = part.cubic.control;
                if distance(from, to) > near {
                    out.push(part);
                } else {
                    out.last_mut()?.cubic.control[3] = to;
                }
                let comes_back = rest.any(|piece| crossings(&piece).iter().any(|t| *t > ON_WALL));
                return (!comes_back).then_some(out);
            }
            _ => return None,
        }
    }
    let end = out.last()?.cubic.control[3];
    if end[0] >= wall {
        return None;
    }
    out.push(straight(end, [wall, end[1]]));
    Some(out)
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a bent line of `sides` parabolas with 8 parts each.
    fn bent(sides: usize) -> Vec<[f64; 2]> {
        let node = |k: usize| {
            let x = k as f64 / (2 * sides) as f64;
            [x, 1.0 + 0.1 * (3.0 * x).sin()]
        };
        let mut curve = vec![node(0)];
        for side in 0..sides {
            let [a, m, b] = [0, 1, 2].map(|k| node(2 * side + k));
            curve.extend((1..=8).map(|k| {
                let t = f64::from(k) / 8.0;
                let weights = [(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)];
                [0, 1].map(|i| weights[0] * a[i] + weights[1] * m[i] + weights[2] * b[i])
            }));
        }
        curve
    }

    fn farthest(curve: &[[f64; 2]], pieces: &[Piece]) -> f64 {
        let places: Vec<[f64; 2]> =
            pieces.iter().flat_map(|piece| (0..=1000).map(|k| piece.cubic.at(f64::from(k) / 1e3))).collect();
        let off = |p: &[f64; 2]| {
            places.windows(2).map(|ends| off_segment(*p, [ends[0], ends[1]])).fold(f64::INFINITY, f64::min)
        };
        curve.iter().map(off).fold(0.0, f64::max)
    }

    fn area(outline: &[[f64; 2]]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>()
    }

    #[test]
    fn sides_of_elements_are_followed_exactly_and_several_by_one_cubic_where_that_is_near_enough() {
        let curve = bent(16);
        let exact = followed(&curve, 8, 1e-14);
        assert_eq!(exact.len(), 16);
        assert!(exact.iter().all(|piece| piece.off == 0.0 && !piece.is_straight));
        let at = |piece: &Piece, t: f64| piece.cubic.at(t);
        for (piece, points) in exact.iter().zip(curve.windows(9).step_by(8)) {
            let off = (0..9).map(|k| distance(at(piece, k as f64 / 8.0), points[k])).fold(0.0, f64::max);
            assert!(off < 1e-15, "{off:e}");
        }
        for within in [1e-3, 1e-4, 1e-5] {
            let few = followed(&curve, 8, within);
            let off = farthest(&curve, &few);
            let stated = few.iter().map(|piece| piece.off).fold(0.0, f64::max);
            // The sampled points are a thousandth of a piece apart.
            assert!(few.len() < 16 && off < within + 1e-7 && stated <= within, "{within:e}: {off:e}");
            assert!(few.windows(2).all(|two| two[0].cubic.control[3] == two[1].cubic.control[0]));
        }
        assert!(followed(&curve, 8, 1e-1).iter().all(|piece| piece.is_straight));
        assert_eq!(followed(&[], 8, 1.0), []);
    }

    #[test]
    fn a_surface_ends_at_the_walls_and_goes_on_level_where_it_ends_before() {
        let domain = |x: [f64; 2]| Box3 { min: [x[0], -1.0, 0.0], max: [x[1], 3.0, 1.0] };
        let (curve, within) = (bent(16), 1e-5);
        let chain = || both_halves(followed(&curve, 8, 1e-9));
        let fine = |x: f64| 1.0 + 0.1 * (3.0 * x).sin();
        // A sum over fine strips, up to the end of the curve.
        let below = |x: f64| (0..10_000).map(|k| fine(x.min(1.0) * (f64::from(k) + 0.5) / 1e4)).sum::<f64>();
        let exact = |x: f64| 1e-4 * x.min(1.0) * below(x) + fine(1.0) * (x - 1.0).max(0.0);
        for [left, right] in [[-0.7, 0.7], [-0.3, 0.9], [-1.5, 2.0]] {
            let found = under(chain(), &domain([left, right]), within).unwrap();
            let expected = exact(-left) + exact(right);
            assert!((area(&found.outline) - expected).abs() < 2e-5, "{} {expected}", area(&found.outline));
            assert!(found.outline.iter().all(|p| left <= p[0] && p[0] <= right && p[1] >= 0.0));
            assert!(found.outline.contains(&[left, 0.0]) && !found.arcs.is_empty() && found.off <= 1e-9);
            let ends = |arc: &Arc| [arc.sides.start, arc.sides.end % found.outline.len()];
            assert!(found.arcs.iter().all(|arc| {
                let Curve::Cubic(cubic) = arc.curve else { return false };
                ends(arc).map(|k| found.outline[k]) == [cubic.control[0], cubic.control[3]]
            }));
        }
        // A domain that ends below the top of the curve.
        let low = Box3 { max: [0.7, 1.05, 1.0], ..domain([-0.7, 0.7]) };
        assert_eq!(under(chain(), &low, within), None);
        // An overhanging chain.
        let hanging = vec![straight([-1.0, 1.0], [0.8, 1.0]), straight([0.8, 1.0], [0.6, 1.2])];
        assert_eq!(under(hanging, &domain([-0.5, 0.7]), within), None);
    }
}

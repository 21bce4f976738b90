//! Division of outlines with holes, extruded along an axis, into parts without holes that touch one another.
//!
//! Code that handles one simple outline at a time then needs to know nothing of holes. The cuts between parts
//! lead from corner to corner, so that no corner is added and curves stay the curves that they are.

use crate::drawing::Drawn;
use crate::meshing::plane::constrained_triangles;
use crate::outline;
use crate::recognition::boxes_of_outlines;
use crate::shapes::{Arc, Curve, Shape};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// The largest number of cells, in the grid of the coordinates of all corners, from which boxes are made. The
/// limit is that of `validate/recognised.rs` in elastocap-case, which says how it was measured.
const MAX_CELLS: usize = 12_000;

/// The space between an outline and the holes in it, extruded along an axis between two ends: boxes where all
/// sides are parallel to the axes, otherwise extrusions. Holes lie inside the outline and apart from one
/// another. `None` where the plane cannot be divided.
pub fn perforated(axis: usize, ends: [f64; 2], outline: &Drawn, holes: &[Drawn]) -> Option<Vec<Shape>> {
    let drawings: Vec<&Drawn> = std::iter::once(outline).chain(holes).collect();
    let polygons: Vec<&[[f64; 2]]> = drawings.iter().map(|drawn| drawn.outline.as_slice()).collect();
    if drawings.iter().all(|drawn| drawn.arcs.is_empty())
        && let Some(boxes) = boxes_of_outlines(axis, ends, &polygons, MAX_CELLS)
    {
        return Some(boxes.into_iter().map(Shape::Box).collect());
    }
    let points: Vec<[f64; 2]> = polygons.concat();
    let mut sides = Vec::with_capacity(points.len());
    let mut first = 0;
    for polygon in &polygons {
        let count = polygon.len();
        sides.extend((0..count).map(|k| [first + k, first + (k + 1) % count]));
        first += count;
    }
    let inside =
        |p: [f64; 2]| polygons.iter().filter(|polygon| outline::contains(polygon, p)).count() % 2 == 1;
    let triangles = constrained_triangles(&points, &sides, &[], inside);
    let curved = curved_sides(&drawings);
    let pieces = joined(&triangles);
    // Every side of an outline is a side of a piece; where one is missing, the triangulation has left it out.
    let on_pieces: HashSet<[usize; 2]> = pieces.iter().flat_map(|piece| sides_of(piece)).collect();
    if pieces.is_empty() || !sides.iter().all(|[a, b]| on_pieces.contains(&[*a.min(b), *a.max(b)])) {
        return None;
    }
    let [from, to] = ends;
    let shape = |piece: &Vec<usize>| {
        let (outline, arcs) = outline_and_arcs(piece, &points, &curved);
        Shape::Extrusion { axis, from, to, outline, arcs }
    };
    Some(pieces.iter().map(shape).collect())
}

/// A side that stands for a part of a curve.
struct CurvedSide {
    /// The whole curve.
    curve: Curve,
    /// The number of the curve among those of all outlines.
    number: usize,
    /// The places along the curve at which the side begins and ends, from 0 to 1.
    range: [f64; 2],
    /// The corner in which the side begins, in the direction of the curve.
    from: usize,
}

/// The sides of all outlines that stand for curves, by the numbers of their two ends in ascending order.
fn curved_sides(outlines: &[&Drawn]) -> HashMap<[usize; 2], CurvedSide> {
    let mut out = HashMap::new();
    let (mut first, mut number) = (0, 0);
    for drawn in outlines {
        let count = drawn.outline.len();
        for Arc { curve, sides } in &drawn.arcs {
            let length = sides.len() as f64;
            for (k, side) in sides.clone().enumerate() {
                let [a, b] = [first + side, first + (side + 1) % count];
                let range = [k as f64 / length, (k + 1) as f64 / length];
                out.insert([a.min(b), a.max(b)], CurvedSide { curve: *curve, number, range, from: a });
            }
            number += 1;
        }
        first += count;
    }
    out
}

/// The sides of a polygon, each as the numbers of its two ends in ascending order.
fn sides_of(piece: &[usize]) -> impl Iterator<Item = [usize; 2]> {
    let next = piece.iter().cycle().skip(1);
    piece.iter().zip(next).map(|(a, b)| [*a.min(b), *a.max(b)])
}

/// Joins triangles to simple polygons, and returns the corners of each polygon. Each polygon grows while a
/// triangle beside it has a corner that it does not have yet.
fn joined(triangles: &[[usize; 3]]) -> Vec<Vec<usize>> {
    let mut beside: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        sides_of(triangle).for_each(|side| beside.entry(side).or_default().push(t));
    }
    let mut is_taken = vec![false; triangles.len()];
    let mut out = Vec::new();
    for start in 0..triangles.len() {
        if is_taken[start] {
            continue;
        }
        is_taken[start] = true;
        let mut piece = triangles[start].to_vec();
        let mut corners: HashSet<usize> = piece.iter().copied().collect();
        let mut open: Vec<[usize; 2]> = sides_of(&piece).collect();
        while let Some(side) = open.pop() {
            let free = beside[&side].iter().find(|t| !is_taken[**t]);
            let Some(&t) = free else { continue };
            let Some(&tip) = triangles[t].iter().find(|corner| !side.contains(corner)) else { continue };
            let Some(before) = (0..piece.len()).find(|k| {
                let [a, b] = [piece[*k], piece[(k + 1) % piece.len()]];
                [a.min(b), a.max(b)] == side
            }) else {
                continue;
            };
            if corners.insert(tip) {
                is_taken[t] = true;
                piece.insert(before + 1, tip);
                open.extend(side.map(|end| [end.min(tip), end.max(tip)]));
            }
        }
        out.push(piece);
    }
    out
}

/// A polygon and the curves that its sides stand for.
fn outline_and_arcs(
    piece: &[usize],
    points: &[[f64; 2]],
    curved: &HashMap<[usize; 2], CurvedSide>,
) -> (Vec<[f64; 2]>, Vec<Arc>) {
    let n = piece.len();
    let curved_side = |k: usize| {
        let [a, b] = [piece[k % n], piece[(k + 1) % n]];
        curved.get(&[a.min(b), a.max(b)])
    };
    // Whether the side before side `k` is a part of the same curve.
    let goes_on = |k: usize| {
        let (before, this) = (curved_side(k + n - 1), curved_side(k));
        before.zip(this).is_some_and(|(before, this)| before.number == this.number)
    };
    // The outline begins in a corner that is not in the middle of a curve.
    let start = (0..n).find(|k| !goes_on(*k)).unwrap_or(0);
    let outline: Vec<[f64; 2]> = (start..start + n).map(|k| points[piece[k % n]]).collect();
    let mut arcs = Vec::new();
    let mut k = 0;
    while k < n {
        let Some(first) = curved_side(start + k) else {
            k += 1;
            continue;
        };
        let begin = k;
        k += 1;
        while k < n && goes_on(start + k) {
            k += 1;
        }
        let Some(last) = curved_side(start + k - 1) else { continue };
        let is_forward = first.from == piece[(start + begin) % n];
        let sides: Range<usize> = begin..k;
        let curve = match first.curve {
            Curve::Circle { .. } => first.curve,
            Curve::Cubic(cubic) if is_forward => Curve::Cubic(cubic.part([first.range[0], last.range[1]])),
            Curve::Cubic(cubic) => Curve::Cubic(cubic.part([last.range[0], first.range[1]]).reversed()),
        };
        arcs.push(Arc { curve, sides });
    }
    (outline, arcs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Entry, drawn};
    use crate::scene::Box3;

    fn area(shape: &Shape) -> f64 {
        let Shape::Extrusion { outline, .. } = shape else { panic!("{shape:?}") };
        let sides = outline.iter().zip(outline.iter().cycle().skip(1));
        0.5 * sides.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>().abs()
    }

    fn polygon(corners: &[[f64; 2]]) -> Drawn {
        drawn(&corners.iter().map(|p| Entry::Corner(*p)).collect::<Vec<_>>()).unwrap()
    }

    fn disc(center: [f64; 2], radius: f64) -> Drawn {
        let at = |x: f64, y: f64| [center[0] + radius * x, center[1] + radius * y];
        drawn(&[
            Entry::Arc { through: at(0.0, -1.0), to: at(1.0, 0.0) },
            Entry::Arc { through: at(0.0, 1.0), to: at(-1.0, 0.0) },
        ])
        .unwrap()
    }

    #[test]
    fn a_frame_of_straight_sides_is_four_boxes_with_the_planes_of_its_corners() {
        let square = |half: f64| polygon(&[[-half, -half], [half, -half], [half, half], [-half, half]]);
        let parts = perforated(1, [0.3, 0.3], &square(2.0), &[square(1.0)]).unwrap();
        let boxes: Vec<_> = parts.iter().map(|part| part.as_box().unwrap()).collect();
        assert_eq!(boxes.len(), 4);
        let area: f64 = boxes.iter().map(|b| b.extent(0) * b.extent(2)).sum();
        assert_eq!(area, 12.0);
        assert!(boxes.iter().all(|b| b.sheet_normal() == Some(1) && b.min[1] == 0.3));
        let mirrored =
            |b: &Box3| Box3 { min: [b.min[0], b.min[1], -b.max[2]], max: [b.max[0], b.max[1], -b.min[2]] };
        assert!(boxes.iter().all(|b| boxes.contains(&mirrored(b))), "{boxes:?}");
        assert!(boxes.iter().all(|b| [b.min[0], b.max[2]].iter().all(|x| [1.0, 2.0].contains(&x.abs()))));
    }

    #[test]
    fn what_lies_between_slanted_outlines_is_covered_once() {
        let plate = polygon(&[[-3.0, -2.0], [3.0, -2.5], [3.5, 2.0], [-2.0, 2.5]]);
        let holes = [
            polygon(&[[-1.5, -1.0], [-0.5, -1.0], [-1.0, 1.0]]),
            polygon(&[[0.5, 0.0], [1.5, -0.5], [1.0, 1.0]]),
        ];
        let parts = perforated(0, [0.0, 1.0], &plate, &holes).unwrap();
        let total: f64 = parts.iter().map(area).sum();
        let area_inside = |drawn: &Drawn| {
            let (outline, arcs) = (drawn.outline.clone(), Vec::new());
            area(&Shape::Extrusion { axis: 0, from: 0.0, to: 1.0, outline, arcs })
        };
        let wanted = area_inside(&plate) - holes.iter().map(area_inside).sum::<f64>();
        assert!((total - wanted).abs() < 1e-12 && parts.len() < 6, "{total} {wanted} {}", parts.len());
        let held = |p: [f64; 2]| parts.iter().filter(|part| part.contains([0.5, p[0], p[1]])).count();
        assert_eq!([[-1.0, 0.1], [1.0, 0.1], [0.1, 0.13], [2.7, -1.3]].map(held), [0, 0, 1, 1]);
    }

    #[test]
    fn arcs_around_and_in_a_plate_stay_arcs_of_their_circles_on_the_parts() {
        let parts = perforated(2, [0.0, 0.1], &disc([0.0, 0.0], 2.0), &[disc([0.5, 0.2], 0.7)]).unwrap();
        let mut sides = 0;
        for part in &parts {
            let Shape::Extrusion { outline, arcs, .. } = part else { panic!("{part:?}") };
            for Arc { curve, sides: range } in arcs {
                let Curve::Circle { center, radius } = curve else { panic!("{curve:?}") };
                for k in range.start..=range.end {
                    let p = outline[k % outline.len()];
                    assert!(((p[0] - center[0]).hypot(p[1] - center[1]) / radius - 1.0).abs() < 1e-12);
                }
                sides += range.len();
            }
        }
        assert_eq!(sides, 256, "each side of either circle belongs to one arc");
    }
}

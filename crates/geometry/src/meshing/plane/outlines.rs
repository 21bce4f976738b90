//! Outlines: closed polygons in the plane.

/// Points closer together than this, relative to the size of the pattern, are one. Not tuned: it only has to
/// lie above rounding errors and below distances that matter.
pub(super) const SAME: f64 = 1e-9;

/// A closed outline.
#[derive(Debug, Clone)]
pub(crate) struct Outline {
    /// Corners of a simple polygon, anticlockwise, m.
    pub(crate) corners: Vec<[f64; 2]>,
    /// Size of the triangles at its sides, m.
    pub(crate) near: f64,
}

/// A fault of an outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutlineFault {
    /// Fewer than three corners, or no area.
    Degenerate,
    /// It crosses or touches itself.
    Crossing,
}

pub(super) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The distance of a point from a segment, m.
pub(super) fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, to) = (minus(b, a), minus(p, a));
    let square = dot(along, along);
    let s = if square > 0.0 { (dot(to, along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - s * along[0]).hypot(to[1] - s * along[1])
}

/// The signed area of a polygon, m^2, positive if anticlockwise.
pub(crate) fn area(corners: &[[f64; 2]]) -> f64 {
    let from = corners.first().copied().unwrap_or_default();
    sides(corners).map(|[a, b]| 0.5 * cross(minus(a, from), minus(b, from))).sum()
}

/// The length of all sides of a polygon, m.
pub(crate) fn perimeter(corners: &[[f64; 2]]) -> f64 {
    sides(corners).map(|[a, b]| minus(b, a)).map(|along| along[0].hypot(along[1])).sum()
}

/// The sides of a polygon, each by its ends.
pub(super) fn sides(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]])
}

/// Whether a point lies in a polygon; either answer on its sides.
pub(crate) fn contains(corners: &[[f64; 2]], p: [f64; 2]) -> bool {
    let crossed = sides(corners).filter(|[a, b]| {
        (a[1] > p[1]) != (b[1] > p[1]) && {
            let turn = cross(minus(*b, *a), minus(p, *a));
            (turn > 0.0) == (b[1] > a[1])
        }
    });
    crossed.count() % 2 == 1
}

/// Whether the boxes around two segments come closer than `room`. This alone excludes most pairs of sides.
fn boxes_meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2], room: f64) -> bool {
    (0..2).all(|k| a[k].min(b[k]) - room <= c[k].max(d[k]) && c[k].min(d[k]) - room <= a[k].max(b[k]))
}

/// The polygon anticlockwise and without repeated corners. `scale` is the size of the pattern, m.
///
/// # Errors
/// [`OutlineFault`] if it encloses no area or is not simple.
pub(crate) fn cleaned(outline: &[[f64; 2]], scale: f64) -> Result<Vec<[f64; 2]>, OutlineFault> {
    let same = SAME * scale;
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) > same;
    let mut corners: Vec<[f64; 2]> = Vec::with_capacity(outline.len());
    for &p in outline {
        if corners.last().is_none_or(|&last| apart(last, p)) {
            corners.push(p);
        }
    }
    while corners.len() > 1 && !apart(corners[0], corners[corners.len() - 1]) {
        corners.pop();
    }
    let count = corners.len();
    if count < 3 {
        return Err(OutlineFault::Degenerate);
    }
    let segments: Vec<_> = sides(&corners).collect();
    for i in 0..count {
        let ([a, b], [_, c]) = (segments[i], segments[(i + 1) % count]);
        let (u, v) = (minus(b, a), minus(c, b));
        if dot(u, v) < 0.0 && (distance(c, segments[i]) <= same || distance(a, [b, c]) <= same) {
            return Err(OutlineFault::Crossing);
        }
        for j in i + 2..count - usize::from(i == 0) {
            if !boxes_meet(segments[i], segments[j], same) {
                continue;
            }
            let [c, d] = segments[j];
            let turn = |[a, b]: [[f64; 2]; 2], p| cross(minus(b, a), minus(p, a)) > 0.0;
            let through =
                turn(segments[i], c) != turn(segments[i], d) && turn(segments[j], a) != turn(segments[j], b);
            let touch = [(a, segments[j]), (b, segments[j]), (c, segments[i]), (d, segments[i])];
            if through || touch.into_iter().any(|(p, side)| distance(p, side) <= same) {
                return Err(OutlineFault::Crossing);
            }
        }
    }
    let area = area(&corners);
    if area.abs() <= same * scale {
        return Err(OutlineFault::Degenerate);
    }
    if area < 0.0 {
        corners.reverse();
    }
    Ok(corners)
}

/// Moves corners that nearly coincide with corners of other outlines onto them, and adds corners to sides
/// that pass that close by another corner. Refinement of the hair-thin triangles in between would not end.
///
/// `frame` is the lower and the upper corner of a rectangle, m; corners move onto its sides in the same way.
pub(crate) fn join_coincident_corners(outlines: &mut [Outline], frame: [[f64; 2]; 2]) {
    let same = SAME * (frame[1][0] - frame[0][0]).max(frame[1][1] - frame[0][1]).max(0.0);
    let same = outlines.iter().fold(same, |same, r| same.min(1e-3 * r.near));
    let mut known: Vec<[f64; 2]> = Vec::new();
    for outline in outlines.iter_mut() {
        for p in &mut outline.corners {
            for axis in 0..2 {
                for end in frame {
                    if (p[axis] - end[axis]).abs() <= same {
                        p[axis] = end[axis];
                    }
                }
            }
            let near = |q: &&[f64; 2]| {
                // The distance takes longer to compute than the differences, which exclude nearly all points.
                (p[0] - q[0]).abs() <= same && (p[0] - q[0]).hypot(p[1] - q[1]) <= same
            };
            match known.iter().find(near) {
                Some(&q) => *p = q,
                None => known.push(*p),
            }
        }
    }
    for outline in outlines.iter_mut() {
        let mut corners = Vec::with_capacity(outline.corners.len());
        for [a, b] in sides(&outline.corners) {
            corners.push(a);
            let close = |p: [f64; 2]| boxes_meet([a, b], [p, p], same) && distance(p, [a, b]) <= same;
            let mut on_side: Vec<[f64; 2]> =
                known.iter().copied().filter(|&p| p != a && p != b && close(p)).collect();
            let along = minus(b, a);
            on_side.sort_by(|p, q| dot(minus(*p, a), along).total_cmp(&dot(minus(*q, a), along)));
            corners.extend(on_side);
        }
        outline.corners = corners;
    }
}

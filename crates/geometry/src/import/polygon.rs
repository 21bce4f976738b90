//! Triangulation of plane polygons, concave ones too, by ear clipping.

use crate::intersect::{Point, flat_turn};

/// Polygons with more corners than this are cut as a fan, which only some of them allow: the time of ear
/// clipping grows with the third power of the number of corners. Not tuned: a limit that ordinary cases do
/// not reach.
const MAX_CLIPPED: usize = 256;

/// The reason why a polygon cannot be cut into triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum PolygonFault {
    /// No corner is left whose triangle lies inside the outline.
    #[error("a face whose outline crosses or touches itself")]
    CrossesItself,
    /// Too many corners for ear clipping, and no fan from the first corner covers the polygon.
    #[error("a face with more than {MAX_CLIPPED} corners that is not convex; export triangles")]
    LongAndNotConvex,
}

/// Appends the triangles of a plane polygon to `faces`, oriented as the polygon is. `points` are the
/// coordinates of all points, and `corners` the indices of those that are its corners; the list is used up.
///
/// Repeated corners are dropped first. A triangle, or a polygon that has become one, is passed on as it is;
/// one with fewer corners left gives no triangles.
///
/// # Errors
/// [`PolygonFault`] if the outline crosses itself or is too long to be cut.
pub(super) fn triangulate(
    points: &[Point],
    corners: &mut Vec<u32>,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), PolygonFault> {
    if corners.len() > 3 {
        corners.dedup();
        while corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
    }
    if let [a, b, c] = corners[..] {
        faces.push([a, b, c]);
    }
    if corners.len() < 4 {
        return Ok(());
    }
    let point = |p: u32| points[p as usize];
    let axes = projection_axes(points, corners);
    let turn = |a: u32, b: u32, c: u32| flat_turn(axes, point(a), point(b), point(c));
    if corners.len() > MAX_CLIPPED {
        let first = corners[0];
        if !corners[1..].windows(2).all(|w| turn(first, w[0], w[1]) > 0.0) {
            return Err(PolygonFault::LongAndNotConvex);
        }
        faces.extend(corners[1..].windows(2).map(|w| [first, w[0], w[1]]));
        return Ok(());
    }
    while corners.len() > 3 {
        let n = corners.len();
        let ear = (0..n).find(|&k| {
            let [a, b, c] = [corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]];
            turn(a, b, c) > 0.0
                && corners.iter().all(|&p| {
                    [a, b, c].iter().any(|&q| point(p) == point(q))
                        || turn(a, b, p) < 0.0
                        || turn(b, c, p) < 0.0
                        || turn(c, a, p) < 0.0
                })
        });
        let Some(k) = ear else { return Err(PolygonFault::CrossesItself) };
        faces.push([corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]]);
        corners.remove(k);
    }
    faces.push([corners[0], corners[1], corners[2]]);
    Ok(())
}

/// The two axes onto which the polygon projects with the largest area, in the order in which the projection
/// runs anticlockwise.
fn projection_axes(points: &[Point], corners: &[u32]) -> [usize; 2] {
    let origin = points[corners[0] as usize];
    let local = |p: u32| [0, 1, 2].map(|a| points[p as usize][a] - origin[a]);
    let mut area = [0.0; 3];
    for w in corners.windows(2) {
        let (p, q) = (local(w[0]), local(w[1]));
        for a in 0..3 {
            let (i, j) = ((a + 1) % 3, (a + 2) % 3);
            area[a] += p[i] * q[j] - p[j] * q[i];
        }
    }
    let largest = (0..3).fold(0, |m, a| if area[a].abs() > area[m].abs() { a } else { m });
    let axes = [(largest + 1) % 3, (largest + 2) % 3];
    if area[largest] < 0.0 { [axes[1], axes[0]] } else { axes }
}

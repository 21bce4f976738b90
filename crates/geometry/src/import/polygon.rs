//! Plane polygons cut into triangles.

use super::intersect::{Point, flat_turn};

/// Above this many corners only polygons that a fan covers are cut: clipping ears takes up to the third power of them.
const MOST_CLIPPED: usize = 256;

/// Appends the triangles of a polygon, turned as it is; `corners` are used up.
///
/// Repeated corners are dropped first; a triangle, or what has become one, is passed on as it is.
///
/// # Errors
/// A message if the outline crosses itself or is too long to be cut.
pub(super) fn triangulate(
    points: &[Point],
    corners: &mut Vec<u32>,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), &'static str> {
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
    let at = |p: u32| points[p as usize];
    let axes = view(points, corners);
    let turn = |a: u32, b: u32, c: u32| flat_turn(axes, at(a), at(b), at(c));
    if corners.len() > MOST_CLIPPED {
        let first = corners[0];
        if !corners[1..].windows(2).all(|w| turn(first, w[0], w[1]) > 0.0) {
            return Err("a face with more than 256 corners that is not convex; export triangles");
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
                    [a, b, c].iter().any(|&q| at(p) == at(q))
                        || turn(a, b, p) < 0.0
                        || turn(b, c, p) < 0.0
                        || turn(c, a, p) < 0.0
                })
        });
        let Some(k) = ear else { return Err("a face whose outline crosses or touches itself") };
        faces.push([corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]]);
        corners.remove(k);
    }
    faces.push([corners[0], corners[1], corners[2]]);
    Ok(())
}

/// The two axes, in the order in which the polygon turns anticlockwise, that show the most of it.
fn view(points: &[Point], corners: &[u32]) -> [usize; 2] {
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
    let most = (0..3).fold(0, |m, a| if area[a].abs() > area[m].abs() { a } else { m });
    let axes = [(most + 1) % 3, (most + 2) % 3];
    if area[most] < 0.0 { [axes[1], axes[0]] } else { axes }
}

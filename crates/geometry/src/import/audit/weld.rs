//! Merging of points that differ only by rounding.

use std::collections::HashMap;

/// The largest distance, along each axis and relative to the size of the body, at which two points count as
/// one. Not tuned: it only has to lie above rounding errors and below distances that matter.
const TOLERANCE: f64 = 1e-12;

/// For every point the index of the first point at the same place. `size` is the largest extent of the body,
/// m.
pub(super) fn weld(points: &[[f64; 3]], size: f64) -> Vec<u32> {
    let tolerance = TOLERANCE * size;
    let cell = 4.0 * tolerance;
    let key = |p: [f64; 3], shift: [f64; 3]| {
        [0, 1, 2].map(|a| ((p[a] + shift[a] * tolerance) / cell).floor() as i64)
    };
    let mut first_in_cell: HashMap<[i64; 3], u32> = HashMap::new();
    let mut out = Vec::with_capacity(points.len());
    for (k, &p) in points.iter().enumerate() {
        let (low, high) = (key(p, [-1.0; 3]), key(p, [1.0; 3]));
        let mut earlier = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let Some(&other) = first_in_cell.get(&[x, y, z]) else { continue };
                    let q: [f64; 3] = points[other as usize];
                    let near = (0..3).all(|a| (p[a] - q[a]).abs() <= tolerance);
                    if near && earlier.is_none_or(|f| other < f) {
                        earlier = Some(other);
                    }
                }
            }
        }
        // One point per cell is enough. A second one in it that is not merged lies within four tolerances of
        // the first, and no body has details as small as that.
        let point = earlier.unwrap_or(k as u32);
        if earlier.is_none() {
            first_in_cell.entry(key(p, [0.0; 3])).or_insert(point);
        }
        out.push(point);
    }
    out
}

/// The points that faces use, and the number of other points, which are dropped; the faces are renumbered.
pub(super) fn used(points: &[[f64; 3]], faces: &mut [[u32; 3]]) -> (Vec<[f64; 3]>, usize) {
    let mut number = vec![u32::MAX; points.len()];
    for &p in faces.iter().flatten() {
        number[p as usize] = 0;
    }
    let mut used = Vec::new();
    for (k, n) in number.iter_mut().enumerate() {
        if *n == 0 {
            *n = used.len() as u32;
            used.push(points[k]);
        }
    }
    for face in faces {
        *face = face.map(|p| number[p as usize]);
    }
    let dropped = points.len() - used.len();
    (used, dropped)
}

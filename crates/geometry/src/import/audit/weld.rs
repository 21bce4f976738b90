//! Points that are the same but for rounding.

use std::collections::HashMap;

/// How far apart two points may be, relative to the size of the body, and still count as one.
const TOLERANCE: f64 = 1e-12;

/// For every point the first one at its place.
pub(super) fn weld(points: &[[f64; 3]], size: f64) -> Vec<u32> {
    let tolerance = TOLERANCE * size;
    let cell = 4.0 * tolerance;
    let key = |p: [f64; 3], shift: [f64; 3]| {
        [0, 1, 2].map(|a| ((p[a] + shift[a] * tolerance) / cell).floor() as i64)
    };
    let mut first: HashMap<[i64; 3], u32> = HashMap::new();
    let mut out = Vec::with_capacity(points.len());
    for (k, &p) in points.iter().enumerate() {
        let (low, high) = (key(p, [-1.0; 3]), key(p, [1.0; 3]));
        let mut found = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let Some(&other) = first.get(&[x, y, z]) else { continue };
                    let q: [f64; 3] = points[other as usize];
                    let near = (0..3).all(|a| (p[a] - q[a]).abs() <= tolerance);
                    if near && found.is_none_or(|f| other < f) {
                        found = Some(other);
                    }
                }
            }
        }
        // One point per cell is enough: a second one in it that is not welded is more than a tolerance away from the first,
        // and closer than that no body has detail.
        let here = found.unwrap_or(k as u32);
        if found.is_none() {
            first.entry(key(p, [0.0; 3])).or_insert(here);
        }
        out.push(here);
    }
    out
}

/// Drops the points that no face uses, renumbers the faces; how many were dropped.
pub(super) fn used(points: &[[f64; 3]], faces: &mut [[u32; 3]]) -> (Vec<[f64; 3]>, usize) {
    let mut number = vec![u32::MAX; points.len()];
    for &p in faces.iter().flatten() {
        number[p as usize] = 0;
    }
    let mut kept = Vec::new();
    for (k, n) in number.iter_mut().enumerate() {
        if *n == 0 {
            *n = kept.len() as u32;
            kept.push(points[k]);
        }
    }
    for face in faces {
        *face = face.map(|p| number[p as usize]);
    }
    let dropped = points.len() - kept.len();
    (kept, dropped)
}

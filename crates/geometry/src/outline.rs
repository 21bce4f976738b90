//! Polygons in a plane.

use std::f64::consts::TAU;

/// Whether a point lies in a simple polygon.
///
/// Two polygons with a common edge neither share a point next to it nor leave one out: the edge is always taken from its lower
/// end up, whichever way the polygon passes it, so that rounding puts a point on the same side of it for both.
pub fn contains(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    sides.filter(|(a, b)| passes(**a, **b, p)).count() % 2 == 1
}

/// Whether the ray from a point in the direction of the first axis meets the side between two corners.
pub fn passes(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> bool {
    let [low, high] = if a[1] < b[1] { [a, b] } else { [b, a] };
    (a[1] > p[1]) != (b[1] > p[1])
        && p[0] < low[0] + (high[0] - low[0]) * (p[1] - low[1]) / (high[1] - low[1])
}

/// Corners of a regular polygon on a circle, the first in the direction of the first axis.
pub fn on_circle(center: [f64; 2], radius: f64, corners: usize) -> Vec<[f64; 2]> {
    let angle = |k: usize| k as f64 * TAU / corners as f64;
    let corner = |angle: f64| [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()];
    (0..corners).map(|k| corner(angle(k))).collect()
}

/// The two halves of what lies between two polygons with the same even number of corners, side by side: each a simple polygon.
pub fn halves_between(inner: &[[f64; 2]], outer: &[[f64; 2]]) -> [Vec<[f64; 2]>; 2] {
    let half = outer.len() / 2;
    [0, half].map(|first| {
        let around = |k: usize| (first + k) % outer.len();
        let out = (0..=half).map(|k| outer[around(k)]);
        let back = (0..=half).rev().map(|k| inner[around(k)]);
        out.chain(back).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halves_of_a_ring_hold_what_lies_in_it_once() {
        let center = [0.3, -0.2];
        let [inner, outer] = [0.5, 1.0].map(|radius| on_circle(center, radius, 24));
        let halves = halves_between(&inner, &outer);
        for k in 0..400 {
            let (angle, radius) = (0.1 + 0.7 * f64::from(k), 1.5 * f64::from(k) / 400.0);
            let point = [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()];
            let held = halves.iter().filter(|half| contains(half, point)).count();
            assert_eq!(held, usize::from(contains(&outer, point) && !contains(&inner, point)), "{point:?}");
        }
    }
}

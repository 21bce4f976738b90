//! Polygons in a plane.

use std::cmp::Ordering;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Whether a point lies in a simple polygon.
///
/// Two polygons with a common edge neither share a point next to it nor leave one out: the edge is always
/// taken from its lower end up, whichever way the polygon passes it, so that rounding puts a point on the
/// same side of it for both.
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

/// Corners of a regular polygon on a circle, the first in the direction of the first axis. Corners in the
/// direction of an axis have the other coordinate of the center without rounding, and those that are mirror
/// images about an axis are so to the last digit: faces of boxes often lie there.
pub fn on_circle(center: [f64; 2], radius: f64, corners: usize) -> Vec<[f64; 2]> {
    // Sines and cosines are taken within an eighth of a turn only. All other corners have the same numbers,
    // exchanged or with other signs.
    let within_quarter = |part: usize| {
        let angle = |part: usize| part as f64 * TAU / (4 * corners) as f64;
        let (sine, cosine) = angle(part.min(corners - part)).sin_cos();
        match (2 * part).cmp(&corners) {
            Ordering::Less => [cosine, sine],
            Ordering::Equal => [FRAC_1_SQRT_2; 2],
            Ordering::Greater => [sine, cosine],
        }
    };
    let corner = |k: usize| {
        let [c, s] = within_quarter(4 * k % corners);
        let [c, s] = [[c, s], [-s, c], [-c, -s], [s, -c]][4 * k / corners];
        [center[0] + radius * c, center[1] + radius * s]
    };
    (0..corners).map(corner).collect()
}

/// The two halves of the area between two polygons with the same even number of corners: each a simple
/// polygon.
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
    fn corners_of_a_circle_are_on_its_axes_and_each_others_mirror_images_exactly() {
        for corners in [8, 12, 36, 40, 400] {
            let found = on_circle([0.3, 0.7], 0.1, corners);
            for quarter in 0..4 {
                assert_eq!(found[quarter * corners / 4][(quarter + 1) % 2], [0.3, 0.7][(quarter + 1) % 2]);
            }
            let about_zero = on_circle([0.0; 2], 0.1, corners);
            for (k, at) in about_zero.iter().enumerate().skip(1) {
                assert_eq!([at[0], -at[1]], about_zero[corners - k]);
                let turn = TAU * k as f64 / corners as f64;
                assert!((at[0] - 0.1 * turn.cos()).abs() + (at[1] - 0.1 * turn.sin()).abs() < 1e-15);
            }
        }
        // The first and the opposite of five corners.
        let odd = on_circle([0.0; 2], 1.0, 5);
        assert!((odd[2][0] - (TAU * 0.4).cos()).abs() + (odd[2][1] - (TAU * 0.4).sin()).abs() < 1e-15);
    }

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

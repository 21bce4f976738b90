//! Rules of integration on straight and on bent triangles.

use super::{Folded, Triangle};
use crate::bent::{LEAST_EVENNESS, Needle, Stretch};
use crate::quadrature::gauss_legendre;

/// By how many points along each direction the rule of a bent triangle exceeds that of a straight one: each
/// pair is a least evenness ([`Stretch::evenness`]) and this number for triangles that reach it. The errors
/// of energies are then below 1e-10 (see the tests). Measured:
/// `more_points_change_no_energy_on_a_bent_triangle_by_the_allowance_for_them`.
pub(super) const MORE_POINTS: [(f64, usize); 7] =
    [(0.8, 6), (0.7, 8), (0.5, 10), (0.4, 12), (0.25, 16), (0.2, 20), (LEAST_EVENNESS, 28)];

/// Rules for needles are repeated towards the tip, each time on this share of the remaining distance.
/// Measured: `needles_between_an_arc_and_its_tangent_are_integrated_up_to_the_tip_or_refused`.
const TOWARDS_TIP: f64 = 0.2;

/// The least number of additional points for needles: the integrand is nearly singular at the tip. Measured:
/// `needles_between_an_arc_and_its_tangent_are_integrated_up_to_the_tip_or_refused`.
const MORE_IN_NEEDLES: usize = 12;

/// Needles whose `blunt` is below this are integrated as sharp: their bluntness changes any energy by a
/// smaller share. It is not tuned.
const SHARP: f64 = 1e-12;

/// A point of a rule on a bent triangle.
pub(super) struct MapPoint {
    /// The point of the reference triangle.
    pub(super) point: [f64; 2],
    /// The weight for integrals over the reference triangle.
    pub(super) weight: f64,
    /// The image of the point.
    pub(super) place: [f64; 2],
    /// The derivative of the map, by columns.
    pub(super) columns: [[f64; 2]; 2],
    /// The determinant of the derivative.
    pub(super) determinant: f64,
}

impl Triangle {
    /// The points of a rule with their weights, the derivative of the map and its determinant. On a straight
    /// triangle the rule integrates polynomials of degree `2 n - 2` exactly. On a bent one it has `further`
    /// points more along each direction than needed.
    ///
    /// # Errors
    /// [`Folded`], also if the map is so uneven that no rule of a reasonable size is exact enough.
    pub(super) fn rule(&self, n: usize, further: usize) -> Result<Vec<MapPoint>, Folded> {
        let points = match &self.bent {
            None => triangle_rule(n),
            Some((bent, part)) => {
                let stretch = bent.stretch(*part);
                let evenness = stretch.evenness();
                let more = MORE_POINTS.iter().find(|(least, _)| evenness >= *least).ok_or(Folded)?.1;
                let n = n + further;
                match stretch {
                    Stretch::Even(_) => triangle_rule(n + more),
                    Stretch::Needle(needle) => needle_rule(n + more.max(MORE_IN_NEEDLES), &needle),
                }
            }
        };
        let mut out = Vec::with_capacity(points.len());
        let mut sign = 0.0;
        for (point, weight) in points {
            let (place, columns) = self.map(point);
            let [u, v] = columns;
            let determinant = u[0] * v[1] - u[1] * v[0];
            if sign * determinant < 0.0 || determinant == 0.0 || !determinant.is_finite() {
                return Err(Folded);
            }
            sign = determinant.signum();
            out.push(MapPoint { point, weight, place, columns, determinant });
        }
        Ok(out)
    }
}

/// Points and weights of a rule on the reference triangle that is exact for polynomials of degree `2 n - 2`:
/// `n * n` points.
pub(super) fn triangle_rule(n: usize) -> Vec<([f64; 2], f64)> {
    let (nodes, weights) = gauss_legendre(n);
    let unit: Vec<(f64, f64)> = nodes.iter().zip(&weights).map(|(s, w)| (0.5 * (s + 1.0), 0.5 * w)).collect();
    let mut out = Vec::with_capacity(n * n);
    for &(y, v) in &unit {
        for &(s, w) in &unit {
            out.push(([s * (1.0 - y), y], w * v * (1.0 - y)));
        }
    }
    out
}

/// Points and weights of a rule for a needle. In coordinates that collapse to its tip the energies of
/// polynomials are integrals of smooth functions if the tip is sharp. If it is blunt, the integrands are
/// nearly singular at a distance from the tip of about [`Needle::blunt`], so that [`triangle_rule`] is
/// repeated towards the tip.
fn needle_rule(n: usize, needle: &Needle) -> Vec<([f64; 2], f64)> {
    let rule = triangle_rule(n);
    let mut shells = vec![[0.0, 1.0]];
    while let Some([low @ 0.0, high]) = shells.last().copied()
        && needle.blunt > SHARP
        && high > needle.blunt
    {
        let next = TOWARDS_TIP * high;
        shells.pop();
        shells.extend([[next, high], [low, next]]);
    }
    let in_shell = |[low, high]: [f64; 2]| {
        rule.iter().map(move |([x, y], weight)| {
            // The coordinates of the rule: `from_tip` from 0 to 1, and across.
            let (from_tip, across) = (1.0 - y, x / (1.0 - y));
            let distance = low + (high - low) * from_tip;
            let weight = weight / from_tip * distance * (high - low);
            let shares = [1.0 - distance, distance * (1.0 - across), distance * across];
            // The first share is that of the tip.
            let share = |corner: usize| shares[(corner + 3 - needle.tip) % 3];
            ([share(1), share(2)], weight)
        })
    };
    shells.into_iter().flat_map(in_shell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_every_monomial_that_it_promises() {
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        for n in 1..8 {
            for i in 0..=2 * n - 2 {
                for j in 0..=2 * n - 2 - i {
                    let sum: f64 = triangle_rule(n)
                        .iter()
                        .map(|(x, w)| w * x[0].powi(i as i32) * x[1].powi(j as i32))
                        .sum();
                    let exact = factorial(i) * factorial(j) / factorial(i + j + 2);
                    assert!((sum - exact).abs() < 1e-15, "{n} {i} {j}");
                }
            }
        }
    }
}

//! Parametric cubics in a plane, and splines of them.

/// A parametric cubic by its four control points in Bernstein-Bezier form, from the first to the last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// The control points; the first and the last one are the ends of the curve.
    pub control: [[f64; 2]; 4],
}

/// The point at a share of the way from one point to another.
fn interpolated(t: f64, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
}

impl Cubic {
    /// The point at a parameter from 0 to 1.
    pub fn at(&self, t: f64) -> [f64; 2] {
        self.blossom([t; 3])
    }

    /// The polar form of the cubic, which is linear in each of three parameters (de Casteljau's algorithm).
    fn blossom(&self, [r, s, t]: [f64; 3]) -> [f64; 2] {
        let [a, b, c, d] = self.control;
        let [a, b, c] = [interpolated(r, a, b), interpolated(r, b, c), interpolated(r, c, d)];
        let [a, b] = [interpolated(s, a, b), interpolated(s, b, c)];
        interpolated(t, a, b)
    }

    /// The part between two parameters, from the first to the second. At 0 and 1 its ends are those of the
    /// whole to the last bit.
    #[must_use]
    pub fn part(&self, [from, to]: [f64; 2]) -> Self {
        let end = |t: f64| match t {
            0.0 => self.control[0],
            1.0 => self.control[3],
            t => self.at(t),
        };
        let inner = [[from, from, to], [from, to, to]].map(|at| self.blossom(at));
        Self { control: [end(from), inner[0], inner[1], end(to)] }
    }

    /// This cubic in the opposite direction.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let [a, b, c, d] = self.control;
        Self { control: [d, c, b, a] }
    }

    /// How far the curve bends away from its chord: the larger distance of the two inner control points from
    /// where they would be on a straight line of constant speed, over the length of the chord.
    pub fn bow(&self) -> f64 {
        let [a, b, c, d] = self.control;
        let offsets = [(1.0 / 3.0, b), (2.0 / 3.0, c)].map(|(t, p)| distance(p, interpolated(t, a, d)));
        offsets[0].max(offsets[1]) / distance(a, d)
    }

    /// The sum of the absolute angles between successive lines of the control polygon, rad: the curve itself
    /// turns by no more.
    pub fn turn(&self) -> f64 {
        let legs: Vec<[f64; 2]> =
            self.control.windows(2).map(|p| [p[1][0] - p[0][0], p[1][1] - p[0][1]]).collect();
        let angle = |p: &[[f64; 2]]| {
            let [u, v] = [p[0], p[1]];
            (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]).abs()
        };
        legs.windows(2).map(angle).sum()
    }

    /// The unit vector along the curve where it begins.
    pub fn begins(&self) -> [f64; 2] {
        let [from, rest @ ..] = self.control;
        let next = rest.into_iter().find(|p| *p != from).unwrap_or(from);
        let length = distance(from, next);
        [0, 1].map(|k| (next[k] - from[k]) / length)
    }

    /// Parameters from 0 to 1, ascending, at which the polynomial with these Bernstein coefficients vanishes.
    /// Roots at which it does not change its sign may be missed.
    fn roots(values: [f64; 4]) -> Vec<f64> {
        let polynomial = Self { control: values.map(|value| [value, 0.0]) };
        let value = |t: f64| polynomial.at(t)[0];
        let [a, b, c, d] = values;
        // Between these parameters, the polynomial rises or falls throughout.
        let mut ends = vec![0.0];
        ends.extend(quadratic_roots([b - a, c - b, d - c]));
        ends.push(1.0);
        let mut out: Vec<f64> = Vec::new();
        for pair in ends.windows(2) {
            let [mut low, mut high] = [pair[0], pair[1]];
            let (at_low, at_high) = (value(low), value(high));
            if at_low == 0.0 {
                out.push(low);
            } else if at_high != 0.0 && (at_low < 0.0) != (at_high < 0.0) {
                while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
                    let middle = 0.5 * (low + high);
                    let is_before = (value(middle) < 0.0) == (at_low < 0.0);
                    *(if is_before { &mut low } else { &mut high }) = middle;
                }
                out.push(low);
            }
        }
        if d == 0.0 {
            out.push(1.0);
        }
        out.dedup();
        out
    }

    /// Parameters at which the curve crosses the line through two points.
    pub fn crossings(&self, [a, b]: [[f64; 2]; 2]) -> Vec<f64> {
        let length = distance(a, b);
        let normal = [(a[1] - b[1]) / length, (b[0] - a[0]) / length];
        let side = |p: [f64; 2]| normal[0] * (p[0] - a[0]) + normal[1] * (p[1] - a[1]);
        Self::roots(self.control.map(side))
    }

    /// The number of crossings of the curve with the ray from a point in the direction of the first axis,
    /// counted by the same rule as for straight sides ([`crate::outline::passes`]).
    pub fn passes(&self, p: [f64; 2]) -> usize {
        let [a, b, c, d] = self.control.map(|q| q[1]);
        // Between these parameters, the second coordinate rises or falls throughout.
        let mut ends = vec![0.0];
        ends.extend(quadratic_roots([b - a, c - b, d - c]));
        ends.push(1.0);
        let height = |t: f64| {
            if t == 0.0 {
                a
            } else if t == 1.0 {
                d
            } else {
                self.at(t)[1]
            }
        };
        let meets_ray = |pair: &[f64]| {
            let [mut low, mut high] = [pair[0], pair[1]];
            let is_above = height(low) > p[1];
            if is_above == (height(high) > p[1]) {
                return false;
            }
            while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
                let middle = 0.5 * (low + high);
                *(if (height(middle) > p[1]) == is_above { &mut low } else { &mut high }) = middle;
            }
            p[0] < self.at(low)[0]
        };
        ends.windows(2).filter(|pair| meets_ray(pair)).count()
    }

    /// A rectangle that contains the curve, by its lower and upper corner: the bounds of the control points.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let corner = |start: f64, least: fn(f64, f64) -> f64| {
            [0, 1].map(|k| self.control.iter().map(|p| p[k]).fold(start, least))
        };
        [corner(f64::INFINITY, f64::min), corner(f64::NEG_INFINITY, f64::max)]
    }
}

/// Parameters between 0 and 1, ascending, at which the quadratic with these Bernstein coefficients changes
/// its sign.
fn quadratic_roots([a, b, c]: [f64; 3]) -> Vec<f64> {
    // a (1 - t)^2 + 2 b t (1 - t) + c t^2 = square t^2 + 2 half t + a
    let (square, half) = (a - 2.0 * b + c, b - a);
    let root = half * half - square * a;
    if root <= 0.0 {
        return Vec::new();
    }
    // With this sign of the square root, neither of the roots suffers from cancellation.
    let far = -(half + root.sqrt().copysign(half));
    let mut roots = vec![far / square, a / far];
    roots.retain(|t| *t > 0.0 && *t < 1.0);
    roots.sort_by(f64::total_cmp);
    roots
}

/// The distance between two points.
pub(crate) fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// The cubic spline through points, with continuous first and second derivatives. Its parameter grows by the
/// distance between neighbouring points from each to the next. An open spline is natural: its second
/// derivative vanishes at the first and the last point. A `closed` one returns from the last point to the
/// first. Neighbouring points must differ, and there must be at least two of them, or three of a closed
/// spline.
pub fn spline(points: &[[f64; 2]], closed: bool) -> Vec<Cubic> {
    let n = points.len();
    let pieces = if closed { n } else { n - 1 };
    let ends = |k: usize| [points[k % n], points[(k + 1) % n]];
    let chords: Vec<f64> = (0..pieces).map(ends).map(|[p, q]| distance(p, q)).collect();
    let chord_slope = |k: usize| {
        let [p, q] = ends(k);
        [0, 1].map(|m| (q[m] - p[m]) / chords[k])
    };
    // One equation for the slope at each point, in which that slope has the factor 2: the factors of the
    // slopes before and after it, and the right-hand side.
    let rows: Vec<([f64; 2], [f64; 2])> = (0..n)
        .map(|k| {
            let (before, after) = ((k + pieces - 1) % pieces, k % pieces);
            match closed || (k > 0 && k < n - 1) {
                false if k == 0 => ([0.0, 1.0], chord_slope(0).map(|x| 3.0 * x)),
                false => ([1.0, 0.0], chord_slope(pieces - 1).map(|x| 3.0 * x)),
                true => {
                    let share = chords[after] / (chords[before] + chords[after]);
                    let (one, other) = (chord_slope(before), chord_slope(after));
                    let right = [0, 1].map(|m| 3.0 * (share * one[m] + (1.0 - share) * other[m]));
                    ([share, 1.0 - share], right)
                }
            }
        })
        .collect();
    let slopes = slopes(&rows, closed);
    (0..pieces)
        .map(|k| {
            let ([p, q], third) = (ends(k), chords[k] / 3.0);
            let (u, v) = (slopes[k], slopes[(k + 1) % n]);
            let first = [0, 1].map(|m| p[m] + third * u[m]);
            let second = [0, 1].map(|m| q[m] - third * v[m]);
            Cubic { control: [p, first, second, q] }
        })
        .collect()
}

/// Solves the equations for the slopes, which are tridiagonal, and cyclic if the spline is closed.
fn slopes(rows: &[([f64; 2], [f64; 2])], closed: bool) -> Vec<[f64; 2]> {
    let n = rows.len();
    // The matrix of a closed spline has entries in two of its corners too. It is the sum of a tridiagonal
    // matrix and a product of two vectors, and is inverted by the Sherman-Morrison formula. The product has
    // entries in all four corners, of which `top_left` may be chosen freely.
    let (top_right, bottom_left) = (rows[0].0[0], rows[n - 1].0[1]);
    let top_left = if closed { -2.0 } else { 0.0 };
    let (mut diagonal, mut x) = (vec![2.0; n], Vec::with_capacity(n));
    if closed {
        diagonal[0] -= top_left;
        diagonal[n - 1] -= top_right * bottom_left / top_left;
    }
    // Three right-hand sides: the two coordinates, and the first vector of the product.
    for (k, (_, right)) in rows.iter().enumerate() {
        let column = if k == 0 {
            top_left
        } else if k == n - 1 && closed {
            bottom_left
        } else {
            0.0
        };
        x.push([right[0], right[1], column]);
    }
    for k in 1..n {
        let factor = rows[k].0[0] / diagonal[k - 1];
        diagonal[k] -= factor * rows[k - 1].0[1];
        let before: [f64; 3] = x[k - 1];
        (0..3).for_each(|m| x[k][m] -= factor * before[m]);
    }
    for k in (0..n).rev() {
        let after = x.get(k + 1).copied().unwrap_or_default();
        let factor = if k + 1 < n { rows[k].0[1] } else { 0.0 };
        (0..3).for_each(|m| x[k][m] = (x[k][m] - factor * after[m]) / diagonal[k]);
    }
    if !closed {
        return x.into_iter().map(|[u, v, _]| [u, v]).collect();
    }
    let along = |m: usize| x[0][m] + x[n - 1][m] * top_right / top_left;
    let share = [0, 1].map(|m| along(m) / (1.0 + along(2)));
    x.iter().map(|x| [0, 1].map(|m| x[m] - share[m] * x[2])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    const CURVE: Cubic = Cubic { control: [[0.0, 0.0], [1.0, 2.0], [2.5, -1.5], [3.0, 0.5]] };

    #[test]
    fn a_part_lies_on_the_whole_and_ends_where_it_says() {
        let part = CURVE.part([0.2, 0.7]);
        for t in [0.0, 0.3, 0.9, 1.0] {
            let [p, q] = [part.at(t), CURVE.at(0.2 + 0.5 * t)];
            assert!(distance(p, q) < 1e-15, "{t}");
        }
        assert_eq!(CURVE.part([1.0, 0.0]), CURVE.reversed());
    }

    #[test]
    fn a_line_crosses_a_curve_where_both_are_and_the_ray_of_a_point_meets_it_as_often() {
        let line = [[-1.0, -0.1], [4.0, 0.6]];
        let found = CURVE.crossings(line);
        assert_eq!(found.len(), 3);
        for t in found {
            let p = CURVE.at(t);
            let off = (line[1][0] - line[0][0]) * (p[1] - line[0][1])
                - (line[1][1] - line[0][1]) * (p[0] - line[0][0]);
            assert!(off.abs() < 1e-14);
        }
        for (k, y) in [0.1, 0.2, 0.3, 0.6, 1.0, -0.2].into_iter().enumerate() {
            for x in [-1.0, 0.5, 1.2, 2.0, 4.0] {
                let fine: Vec<[f64; 2]> = (0..=10_000).map(|k| CURVE.at(f64::from(k) / 1e4)).collect();
                let count = fine.windows(2).filter(|s| crate::outline::passes(s[0], s[1], [x, y])).count();
                assert_eq!(CURVE.passes([x, y]), count, "{k} {x} {y}");
            }
        }
    }

    #[test]
    fn a_spline_passes_through_its_points_with_continuous_slope_and_curvature() {
        let points = [[0.0, 0.0], [1.0, 0.3], [1.4, 1.5], [0.2, 1.9], [-0.3, 1.0]];
        for closed in [false, true] {
            let pieces = spline(&points, closed);
            assert_eq!(pieces.len(), 4 + usize::from(closed));
            let joints = pieces.iter().zip(pieces.iter().cycle().skip(1)).take(if closed { 5 } else { 3 });
            for (one, other) in joints {
                let step = |c: &Cubic| distance(c.control[0], c.control[3]);
                let (h, g) = (step(one), step(other));
                let ([_, b, c, d], [a, e, f, _]) = (one.control, other.control);
                assert_eq!(a, d);
                for m in 0..2 {
                    assert!(((d[m] - c[m]) / h - (e[m] - a[m]) / g).abs() < 1e-14);
                    let bend = [(b[m] - 2.0 * c[m] + d[m]) / (h * h), (a[m] - 2.0 * e[m] + f[m]) / (g * g)];
                    assert!((bend[0] - bend[1]).abs() < 1e-13, "{bend:?}");
                }
            }
            if !closed {
                let [a, b, c, _] = pieces[0].control;
                assert!((0..2).all(|m| (a[m] - 2.0 * b[m] + c[m]).abs() < 1e-15));
            }
        }
    }

    #[test]
    fn a_spline_through_points_of_a_circle_comes_nearer_to_it_with_the_fourth_power_of_their_number() {
        let farthest = |n: u32| {
            let angle =
                |k: u32| TAU * f64::from(k) / f64::from(n) + 0.1 * (PI * f64::from(k)).cos() / f64::from(n);
            let points: Vec<[f64; 2]> = (0..n).map(|k| [angle(k).cos(), angle(k).sin()]).collect();
            let on = |piece: &Cubic| [0.25, 0.5, 0.75].map(|t| (distance(piece.at(t), [0.0; 2]) - 1.0).abs());
            spline(&points, true).iter().flat_map(on).fold(0.0, f64::max)
        };
        let [coarse, fine] = [farthest(8), farthest(16)];
        assert!(coarse < 2e-3 && fine < coarse / 13.0, "{coarse:e} {fine:e}");
    }
}

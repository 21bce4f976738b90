//! Triangles with one side on a curve.

use crate::jet::{Jet, barycentric};

/// The curve that takes the place of a straight side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// An arc of a circle, of less than half a turn.
    Arc {
        /// Middle of the circle.
        center: [f64; 2],
    },
    /// A parametric cubic in Bernstein-Bezier form.
    Cubic {
        /// Its two control points between the ends, from the first end on.
        control: [[f64; 2]; 2],
    },
}

/// A triangle with one curved side: a map of the straight triangle that moves this side onto the curve, and
/// the other points the less the farther they are from it.
///
/// A point of the straight triangle is named by its *shares* of the second and the third corner, which are
/// its barycentric coordinates for these corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bent {
    /// The ends of the curve, then the third corner.
    pub corners: [[f64; 2]; 3],
    /// The curve from the first corner to the second.
    pub curve: Curve,
}

impl Bent {
    /// The image of a point of the straight triangle, by its shares of the second and the third corner.
    pub fn place(&self, shares: [f64; 2]) -> [f64; 2] {
        self.jets(shares).map(|x| x.value)
    }

    /// The image of a point of the straight triangle, by its shares of the second and the third corner, with
    /// the gradient in these shares.
    pub(crate) fn jets(&self, shares: [f64; 2]) -> [Jet; 2] {
        let [a, b, c] = barycentric(shares);
        let [p, q, r] = self.corners;
        // `t` is the parameter of the curve, whose distance from its chord is t (1 - t) times `bow`.
        let t = b.minus(a).plus(Jet::constant(1.0)).scaled(0.5);
        let bow = match self.curve {
            Curve::Arc { center } => {
                let [from, to] = [p, q].map(|x| [x[0] - center[0], x[1] - center[1]]);
                // The quotient by the share of the arc from the nearer end, which may be zero, in closed
                // form.
                match t.value <= 0.5 {
                    true => bow_of_arc(from, turn(from, to), t),
                    false => bow_of_arc(to, turn(to, from), Jet::constant(1.0).minus(t)),
                }
            }
            Curve::Cubic { control: [first, second] } => {
                let back = Jet::constant(1.0).minus(t);
                [0, 1].map(|k| {
                    let early = first[k] - (2.0 * p[k] + q[k]) / 3.0;
                    let late = second[k] - (p[k] + 2.0 * q[k]) / 3.0;
                    back.scaled(early).plus(t.scaled(late)).scaled(3.0)
                })
            }
        };
        let weight = a.times(b);
        [0, 1].map(|k| {
            let straight = a.scaled(p[k]).plus(b.scaled(q[k])).plus(c.scaled(r[k]));
            straight.plus(weight.times(bow[k]))
        })
    }

    /// The shares of the second and the third corner at a point of the straight triangle.
    pub fn shares(&self, point: [f64; 2]) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let w = [point[0] - a[0], point[1] - a[1]];
        let determinant = u[0] * v[1] - u[1] * v[0];
        [(w[0] * v[1] - w[1] * v[0]) / determinant, (u[0] * w[1] - u[1] * w[0]) / determinant]
    }

    /// How evenly the map stretches areas in a part of the triangle that is given by the shares of its
    /// corners.
    pub fn stretch(&self, part: [[f64; 2]; 3]) -> Stretch {
        let even = evenness(grid().map(|at| self.determinant(place(part, at))));
        if even > EVEN_ENOUGH {
            return Stretch::Even(even);
        }
        let is_end = |share: [f64; 2]| {
            [[0.0, 0.0], [1.0, 0.0]].iter().any(|end| (0..2).all(|k| (share[k] - end[k]).abs() < SAME))
        };
        let tips = (0..3).filter(|k| is_end(part[*k]));
        // With the tip as the first corner of the part, the stretch is `blunt + s * slope`, where s is the
        // distance from the tip in shares of the part.
        let as_needle = tips.map(|tip| {
            let turned = [0, 1, 2].map(|k| part[(tip + k) % 3]);
            let blunt = self.determinant(turned[0]);
            let slopes = grid().filter(|[x, y]| x + y > 0.0);
            let slopes = slopes.map(|[x, y]| (self.determinant(place(turned, [x, y])) - blunt) / (x + y));
            let (least, most) = slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), slope| {
                (least.min(slope), most.max(slope))
            });
            // A tip that is turned over by rounding alone counts as perfectly sharp.
            let sign = if most.abs() > least.abs() { 1.0 } else { -1.0 };
            let blunt = sign * blunt / most.abs().max(least.abs());
            let evenness =
                if blunt < -SAME { f64::NEG_INFINITY } else { evenness([least, most].into_iter()) };
            Needle { tip, blunt: blunt.max(0.0), evenness }
        });
        match as_needle.max_by(|a, b| a.evenness.total_cmp(&b.evenness)) {
            Some(needle) if needle.evenness > even => Stretch::Needle(needle),
            _ => Stretch::Even(even),
        }
    }

    /// The factor by which the map stretches areas, times twice the area of the straight triangle.
    fn determinant(&self, shares: [f64; 2]) -> f64 {
        let [x, y] = self.jets(shares);
        x.slope[0] * y.slope[1] - x.slope[1] * y.slope[0]
    }
}

/// How evenly the map of a bent triangle stretches areas in a part of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stretch {
    /// The least stretch over the greatest one; negative if the map folds.
    Even(f64),
    /// The stretch is nearly zero at one corner and grows in proportion to the distance from it.
    Needle(Needle),
}

/// A part of a bent triangle between the curve and a side that is tangent to it, or nearly so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needle {
    /// The corner of the part at which the curve and the side touch.
    pub tip: usize,
    /// The stretch at the tip over the greatest one.
    pub blunt: f64,
    /// The least over the greatest growth of the stretch from the tip, per distance from it.
    pub evenness: f64,
}

impl Stretch {
    /// The least over the greatest stretch, or in a needle the least over the greatest growth of the stretch
    /// from the tip. The error of integrals depends on it; see the tests of [`triangle`](crate::triangle).
    pub fn evenness(&self) -> f64 {
        match self {
            Self::Even(evenness) | Self::Needle(Needle { evenness, .. }) => *evenness,
        }
    }
}

/// The points of a regular lattice on the reference triangle.
fn grid() -> impl Iterator<Item = [f64; 2]> {
    const STEPS: usize = 4;
    (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| [i, j].map(|k| k as f64 / STEPS as f64)))
}

/// The shares of a point in the whole triangle, from its shares `x` and `y` in a part whose corners have the
/// shares `p`, `q` and `r`.
fn place([p, q, r]: [[f64; 2]; 3], [x, y]: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| p[k] + x * (q[k] - p[k]) + y * (r[k] - p[k]))
}

/// The ratio of the least to the greatest number, or of the greatest to the least where that is smaller in
/// magnitude; negative if signs differ.
fn evenness(numbers: impl Iterator<Item = f64>) -> f64 {
    let (least, most) =
        numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (least.min(x), most.max(x)));
    if most.abs() >= least.abs() { least / most } else { most / least }
}

/// Angle from one direction to another, less than half a turn.
fn turn(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1])
}

/// The distance of an arc from its chord over t (1 - t), where t, at most 1/2, is the share of the angle
/// `turn` of the arc. The arc begins at `from`, relative to its centre. With g(x) = (exp(i x) - 1) / (i x)
/// and `from` as a complex number, the distance is i turn (g(t turn) - g(turn)) / (1 - t) from.
fn bow_of_arc(from: [f64; 2], turn: f64, t: Jet) -> [Jet; 2] {
    let [partial, whole] = [t.scaled(turn), Jet::constant(turn)].map(mean_turn);
    let back = Jet::constant(1.0).minus(t);
    let [re, im] = [0, 1].map(|k| partial[k].minus(whole[k]).over(back).scaled(turn));
    [im.scaled(-from[0]).minus(re.scaled(from[1])), re.scaled(from[0]).minus(im.scaled(from[1]))]
}

/// (exp(i x) - 1) / (i x), real and imaginary part: sin x / x and (1 - cos x) / x, by their series where x is
/// small.
fn mean_turn(x: Jet) -> [Jet; 2] {
    if x.value.abs() > 0.25 {
        let [cosine, sine] = x.cosine_and_sine();
        return [sine.over(x), Jet::constant(1.0).minus(cosine).over(x)];
    }
    // The sums of (-1)^k x^2k / (2k + 1)! and (-1)^k x^(2k + 1) / (2k + 2)!; the last terms are below 1e-17.
    let square = x.times(x);
    let mut sums = [Jet::constant(0.0); 2];
    for k in (0..=5).rev() {
        let k = f64::from(k);
        let factors = [(2.0 * k + 2.0) * (2.0 * k + 3.0), (2.0 * k + 3.0) * (2.0 * k + 4.0)];
        sums = [0, 1].map(|i| Jet::constant(1.0).minus(square.times(sums[i]).scaled(1.0 / factors[i])));
    }
    [sums[0], x.times(sums[1]).scaled(0.5)]
}

/// A part of a triangle that is stretched more evenly than this is not a needle. It is not tuned.
const EVEN_ENOUGH: f64 = 0.4;

/// Shares that differ by less are the same. Not tuned: it only has to lie above rounding errors and below
/// distances that matter.
const SAME: f64 = 1e-12;

/// Triangles that are less even are refused, since no rule of a reasonable size integrates over them
/// ([`Stretch::evenness`]).
pub const LEAST_EVENNESS: f64 = 0.1;

/// The shares of the corners of the whole triangle.
pub const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

//! Triangles with one side on a curve.

use crate::triangle::{Jet, barycentric};

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

/// A triangle with a round side: the straight one, moved along that side onto a curve, and less and less away from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bent {
    /// The ends of the curve, then the third corner.
    pub corners: [[f64; 2]; 3],
    /// The curve from the first corner to the second.
    pub curve: Curve,
}

impl Bent {
    /// Where a point of the straight triangle goes, by its shares of the second and the third corner.
    pub fn place(&self, shares: [f64; 2]) -> [f64; 2] {
        self.jets(shares).map(|x| x.value)
    }

    /// The same with slopes in the shares.
    pub(crate) fn jets(&self, shares: [f64; 2]) -> [Jet; 2] {
        let [a, b, c] = barycentric(shares);
        let [p, q, r] = self.corners;
        let straight = [0, 1].map(|k| a.scaled(p[k]).plus(b.scaled(q[k])).plus(c.scaled(r[k])));
        // How far along the curve, and how much of its distance from the chord.
        let t = b.minus(a).plus(Jet::constant(1.0)).scaled(0.5);
        let back = Jet::constant(1.0).minus(t);
        match self.curve {
            Curve::Arc { center } => {
                let rest = t.times(back);
                if rest.value <= 0.0 {
                    return straight;
                }
                let weight = a.times(b).over(rest);
                let [from, to] = [p, q].map(|x| [x[0] - center[0], x[1] - center[1]]);
                let turn = (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
                let [cosine, sine] = t.scaled(turn).cosine_and_sine();
                let along = [
                    cosine.scaled(from[0]).minus(sine.scaled(from[1])),
                    sine.scaled(from[0]).plus(cosine.scaled(from[1])),
                ];
                [0, 1].map(|k| {
                    let chord = t.scaled(to[k] - from[k]).plus(Jet::constant(from[k]));
                    straight[k].plus(weight.times(along[k].minus(chord)))
                })
            }
            // The distance of a cubic from its chord is divisible by t (1 - t), so that the map is a polynomial.
            Curve::Cubic { control: [first, second] } => {
                let weight = a.times(b).scaled(3.0);
                [0, 1].map(|k| {
                    let early = first[k] - (2.0 * p[k] + q[k]) / 3.0;
                    let late = second[k] - (p[k] + 2.0 * q[k]) / 3.0;
                    straight[k].plus(weight.times(back.scaled(early).plus(t.scaled(late))))
                })
            }
        }
    }

    /// The shares of the second and the third corner at a point of the straight triangle.
    pub fn shares(&self, point: [f64; 2]) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let w = [point[0] - a[0], point[1] - a[1]];
        let determinant = u[0] * v[1] - u[1] * v[0];
        [(w[0] * v[1] - w[1] * v[0]) / determinant, (u[0] * w[1] - u[1] * w[0]) / determinant]
    }

    /// The least factor by which the map stretches areas over the greatest one, at points all over a part of the triangle that is given
    /// by the shares of its corners; negative if it folds. The error of integrals depends on it: see the tests of
    /// [`triangle`](crate::triangle).
    pub fn evenness(&self, [p, q, r]: [[f64; 2]; 3]) -> f64 {
        const STEPS: usize = 8;
        let points =
            (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| [i, j].map(|k| k as f64 / STEPS as f64)));
        let place = |[x, y]: [f64; 2]| [0, 1].map(|k| p[k] + x * (q[k] - p[k]) + y * (r[k] - p[k]));
        let [u, v] = [1, 2].map(|c| [0, 1].map(|k| self.corners[c][k] - self.corners[0][k]));
        let straight = u[0] * v[1] - u[1] * v[0];
        let [least, most] = points.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], point| {
            let [x, y] = self.jets(place(point));
            let stretch = (x.slope[0] * y.slope[1] - x.slope[1] * y.slope[0]) / straight;
            [least.min(stretch), most.max(stretch)]
        });
        least / most
    }
}

/// Integrals over triangles that are less even than this are less exact than others ([`Bent::evenness`]).
pub const LEAST_EVENNESS: f64 = 0.1;

/// The shares of the corners of the whole triangle.
pub const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

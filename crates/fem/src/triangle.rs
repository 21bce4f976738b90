//! Polynomials on triangles: continuous potentials, Raviart-Thomas fluxes and their traces.
//!
//! The reference triangle has the corners (0, 0), (1, 0) and (0, 1), in this order; its sides are numbered by [`SIDES`] and run from
//! the first to the second of their corners. A triangle of a mesh is its affine image. Where all triangles list their corners by
//! ascending number, every side runs the same way in both triangles that it belongs to, and no function needs a sign.
//!
//! A triangle may also be a part of one with a side on a curve ([`Bent`]). Potentials keep their values under the map, fluxes their
//! integrals over curves (Piola), so that neither continuity nor divergence is lost; integrals are then by a rule of higher order.
//!
//! The continuous functions of degree p are the three barycentric coordinates, p - 1 functions of each side, whose trace is that of
//! [`hierarchical`](crate::line::hierarchical), and those that vanish on all sides (Szabo and Babuska, *Finite Element Analysis*,
//! 1991). The fluxes of degree p are Raviart-Thomas's of order p - 1, without any continuity: their divergences are all
//! polynomials of degree p - 1, and so are their normal components on each side.

use crate::bent::{Bent, LEAST_EVENNESS, Needle, Stretch};
use crate::quadrature::{gauss_legendre, legendre};
use elastocap_linalg::dense::{self, Llt};
use faer::Mat;

/// Points of a rule along each direction beyond what straight triangles need, where the map is not linear: the second numbers, for
/// triangles at least as even as the first ones ([`Stretch::evenness`]). With them energies are wrong by less than 1e-10 (see the
/// tests).
const MORE_POINTS: [(f64, usize); 7] =
    [(0.8, 6), (0.7, 8), (0.5, 10), (0.4, 12), (0.25, 16), (0.2, 20), (LEAST_EVENNESS, 28)];

/// Rules for needles are repeated towards the tip, each time on this share of what is left.
const TOWARDS_TIP: f64 = 0.2;

/// The least that the rules for needles have more: the tip, to which they are close, is nearly singular.
const MORE_IN_NEEDLES: usize = 12;

/// Needles that are sharper than this count as sharp: what they are blunt by adds less than this to any energy.
const SHARP: f64 = 1e-12;

/// Corners of the sides.
pub const SIDES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Outward normals of the sides of the reference triangle, as long as the sides.
const NORMALS: [[f64; 2]; 3] = [[0.0, -1.0], [-1.0, 0.0], [1.0, 1.0]];

/// A value with its gradient in the reference triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) slope: [f64; 2],
}

impl Jet {
    pub(crate) const fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; 2] }
    }

    pub(crate) fn times(self, other: Self) -> Self {
        let slope = [0, 1].map(|k| self.value * other.slope[k] + other.value * self.slope[k]);
        Self { value: self.value * other.value, slope }
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, slope: self.slope.map(|s| factor * s) }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: [0, 1].map(|k| self.slope[k] + other.slope[k]) }
    }

    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(other.scaled(-1.0))
    }

    pub(crate) fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, slope: [0, 1].map(|k| (self.slope[k] - value * other.slope[k]) / other.value) }
    }

    /// Its cosine and its sine.
    pub(crate) fn cosine_and_sine(self) -> [Self; 2] {
        let (sine, cosine) = self.value.sin_cos();
        [
            Self { value: cosine, slope: self.slope.map(|s| -sine * s) },
            Self { value: sine, slope: self.slope.map(|s| cosine * s) },
        ]
    }
}

/// A triangle is so bent that its map folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a triangle of the mesh is too bent")]
pub struct Folded;

/// The barycentric coordinates at a point.
pub(crate) fn barycentric([x, y]: [f64; 2]) -> [Jet; 3] {
    [
        Jet { value: 1.0 - x - y, slope: [-1.0, -1.0] },
        Jet { value: x, slope: [1.0, 0.0] },
        Jet { value: y, slope: [0.0, 1.0] },
    ]
}

/// Legendre polynomials of degree up to `degree`, made homogeneous: t^n L_n(x / t).
fn scaled_legendre(degree: usize, x: Jet, t: Jet) -> Vec<Jet> {
    let square = t.times(t);
    let mut out = vec![Jet::constant(1.0), x];
    for n in 1..degree {
        let k = n as f64;
        let next = x.times(out[n]).scaled(2.0 * k + 1.0).minus(square.times(out[n - 1]).scaled(k));
        out.push(next.scaled(1.0 / (k + 1.0)));
    }
    out.truncate(degree + 1);
    out
}

/// Polynomials of degree up to `p` that are orthonormal on the reference triangle (Dubiner, J. Sci. Comput. 6, 1991), by ascending
/// degree; the first one is constant.
fn orthonormal(p: usize, point: [f64; 2]) -> Vec<Jet> {
    let [l0, l1, l2] = barycentric(point);
    let along = scaled_legendre(p, l1.minus(l0), l0.plus(l1));
    let mut out = Vec::with_capacity((p + 1) * (p + 2) / 2);
    for degree in 0..=p {
        for i in 0..=degree {
            let j = degree - i;
            let across = jacobi(j, (2 * i + 1) as f64, l2.scaled(2.0).minus(Jet::constant(1.0)));
            let norm = (2.0 * (2 * i + 1) as f64 * (degree + 1) as f64).sqrt();
            out.push(along[i].times(across).scaled(norm));
        }
    }
    out
}

/// The Jacobi polynomial P_n^(a, 0).
fn jacobi(n: usize, a: f64, x: Jet) -> Jet {
    let mut before = Jet::constant(1.0);
    if n == 0 {
        return before;
    }
    let mut now = x.scaled(0.5 * (a + 2.0)).plus(Jet::constant(0.5 * a));
    for k in 2..=n {
        let k = k as f64;
        let c = 2.0 * k + a;
        let first = x.scaled(c * (c - 2.0)).plus(Jet::constant(a * a)).scaled(c - 1.0);
        let second = 2.0 * (k + a - 1.0) * (k - 1.0) * c;
        let next =
            first.times(now).minus(before.scaled(second)).scaled(1.0 / (2.0 * k * (k + a) * (c - 2.0)));
        (before, now) = (now, next);
    }
    now
}

/// Number of continuous functions of degree `p` on a triangle.
pub fn continuous_functions(p: usize) -> usize {
    (p + 1) * (p + 2) / 2
}

/// Number of the orthonormal polynomials of degree below `p`: the divergences of the fluxes of degree `p`.
pub fn divergences(p: usize) -> usize {
    p * (p + 1) / 2
}

/// The continuous functions of degree `p` at a point: corners, sides, inside.
fn continuous(p: usize, point: [f64; 2]) -> Vec<Jet> {
    let corners = barycentric(point);
    let mut out = corners.to_vec();
    for [a, b] in SIDES {
        let (a, b) = (corners[a], corners[b]);
        let square = a.plus(b).times(a.plus(b));
        let l = scaled_legendre(p, b.minus(a), a.plus(b));
        for j in 2..=p {
            let norm = 1.0 / (2.0 * (2 * j - 1) as f64).sqrt();
            out.push(l[j].minus(square.times(l[j - 2])).scaled(norm));
        }
    }
    if p >= 3 {
        let bubble = corners[0].times(corners[1]).times(corners[2]);
        out.extend(orthonormal(p - 3, point).into_iter().map(|q| bubble.times(q)));
    }
    out
}

/// Points and weights of a rule on the reference triangle that is exact for polynomials of degree `2 n - 2`: `n * n` points.
pub fn triangle_rule(n: usize) -> Vec<([f64; 2], f64)> {
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

/// The same for a needle. In coordinates that collapse to its tip the energies of polynomials are integrals of smooth functions if the tip
/// is sharp, and nearly singular at a distance from there as large as it is blunt, so that the rule is repeated towards it.
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
            // The rule's own coordinates: `from_tip` from 0 to 1, and across.
            let (from_tip, across) = (1.0 - y, x / (1.0 - y));
            let distance = low + (high - low) * from_tip;
            let weight = weight / from_tip * distance * (high - low);
            let shares = [1.0 - distance, distance * (1.0 - across), distance * across];
            // By the numbers of the corners, of which the tip has the first of these shares.
            let of = |corner: usize| shares[(corner + 3 - needle.tip) % 3];
            ([of(1), of(2)], weight)
        })
    };
    shells.into_iter().flat_map(in_shell).collect()
}

/// The points of a rule with their weights and the continuous functions of degree `p` there.
fn rule_with_functions(p: usize, n: usize) -> Vec<([f64; 2], f64, Vec<Jet>)> {
    triangle_rule(n).into_iter().map(|(x, w)| (x, w, continuous(p, x))).collect()
}

/// A triangle of a mesh, as far as the integrals over it need it.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Its corners, m (or any other unit).
    pub corners: [[f64; 2]; 3],
    /// What it is a part of, if that is bent, and the shares of its corners there.
    pub bent: Option<(Bent, [[f64; 2]; 3])>,
}

impl Triangle {
    /// Columns are the images of the reference triangle's two sides at its first corner.
    fn sides(&self) -> [[f64; 2]; 2] {
        let [a, b, c] = self.corners;
        [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]]
    }

    /// Positions and the derivative of the map at a point of the reference triangle: columns are those along its two sides.
    fn map(&self, point: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let [u, v] = self.sides();
        let Some((bent, [p, q, r])) = &self.bent else {
            let a = self.corners[0];
            return ([0, 1].map(|k| a[k] + point[0] * u[k] + point[1] * v[k]), [u, v]);
        };
        let along = [[q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]];
        let shares = [0, 1].map(|k| p[k] + point[0] * along[0][k] + point[1] * along[1][k]);
        let x = bent.jets(shares);
        let column = |d: [f64; 2]| [0, 1].map(|k| x[k].slope[0] * d[0] + x[k].slope[1] * d[1]);
        (x.map(|x| x.value), [column(along[0]), column(along[1])])
    }

    /// Points of a rule with their weights, and the derivative of the map and its determinant there; of the straight triangle it would
    /// integrate polynomials of degree `2 n - 2` exactly. `further` points along each direction more than needed.
    ///
    /// # Errors
    /// [`Folded`], also if the map is so uneven that no rule of a reasonable size is exact enough.
    fn rule(&self, n: usize, further: usize) -> Result<Vec<MapPoint>, Folded> {
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

    /// Twice its area, m^2; that of the straight triangle with the same corners.
    pub fn double_area(&self) -> f64 {
        let [u, v] = self.sides();
        (u[0] * v[1] - u[1] * v[0]).abs()
    }

    /// Length of a side, m.
    pub fn length(&self, side: usize) -> f64 {
        let [a, b] = SIDES[side].map(|c| self.corners[c]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    /// Products of the columns of the map from the reference triangle: xx, xy, yy, m^2.
    fn metric(&self) -> [f64; 3] {
        let [u, v] = self.sides();
        let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        [product(u, u), product(u, v), product(v, v)]
    }
}

/// A point of a rule on a bent triangle.
struct MapPoint {
    point: [f64; 2],
    weight: f64,
    place: [f64; 2],
    columns: [[f64; 2]; 2],
    determinant: f64,
}

/// Integrals of the continuous functions over the reference triangle.
#[derive(Debug)]
pub struct PotentialIntegrals {
    degree: usize,
    /// Products of values.
    mass: Mat<f64>,
    /// Products of slopes: xx, xy + yx, yy.
    stiffness: [Mat<f64>; 3],
    /// The points of the rule and their weights, with the functions there.
    rule: Vec<([f64; 2], f64, Vec<Jet>)>,
}

impl PotentialIntegrals {
    /// Of degree `p`, at least 1.
    pub fn new(p: usize) -> Self {
        let n = continuous_functions(p);
        let mut mass = Mat::zeros(n, n);
        let mut stiffness = [0, 1, 2].map(|_| Mat::zeros(n, n));
        let rule = rule_with_functions(p, p + 2);
        for (_, w, f) in &rule {
            for i in 0..n {
                for j in 0..n {
                    let (a, b) = (f[i].slope, f[j].slope);
                    mass[(i, j)] += w * f[i].value * f[j].value;
                    stiffness[0][(i, j)] += w * a[0] * b[0];
                    stiffness[1][(i, j)] += w * (a[0] * b[1] + a[1] * b[0]);
                    stiffness[2][(i, j)] += w * a[1] * b[1];
                }
            }
        }
        Self { degree: p, mass, stiffness, rule }
    }

    /// Mass, m^2, and stiffness of a triangle for unit coefficient.
    ///
    /// # Errors
    /// [`Folded`].
    pub fn on(&self, triangle: &Triangle) -> Result<(Mat<f64>, Mat<f64>), Folded> {
        if triangle.bent.is_some() {
            return self.on_bent(triangle, 0);
        }
        let (area, [uu, uv, vv]) = (triangle.double_area(), triangle.metric());
        let n = self.mass.nrows();
        let [xx, xy, yy] = &self.stiffness;
        let mass = Mat::from_fn(n, n, |i, j| area * self.mass[(i, j)]);
        let stiffness =
            Mat::from_fn(n, n, |i, j| (vv * xx[(i, j)] - uv * xy[(i, j)] + uu * yy[(i, j)]) / area);
        Ok((mass, stiffness))
    }

    fn on_bent(&self, triangle: &Triangle, further: usize) -> Result<(Mat<f64>, Mat<f64>), Folded> {
        let n = self.mass.nrows();
        let (mut mass, mut stiffness) = (Mat::zeros(n, n), Mat::zeros(n, n));
        for at in triangle.rule(self.degree + 2, further)? {
            let [u, v] = at.columns;
            let f = continuous(self.degree, at.point);
            let slopes: Vec<[f64; 2]> = f
                .iter()
                .map(|f| {
                    let [a, b] = f.slope;
                    [(v[1] * a - u[1] * b) / at.determinant, (u[0] * b - v[0] * a) / at.determinant]
                })
                .collect();
            let w = at.weight * at.determinant.abs();
            for i in 0..n {
                for j in 0..n {
                    mass[(i, j)] += w * f[i].value * f[j].value;
                    stiffness[(i, j)] += w * (slopes[i][0] * slopes[j][0] + slopes[i][1] * slopes[j][1]);
                }
            }
        }
        Ok((mass, stiffness))
    }
}

impl PotentialIntegrals {
    /// The energy of potentials that continue along rays, as u(s x) = u(x) / s, beyond a plane parallel to the triangle's at the
    /// distance `radius` from the point where the rays come from, which is over the origin: the integral of
    /// (u + x . grad u)^2 / radius + radius |grad u|^2 over the triangle.
    ///
    /// # Errors
    /// [`Folded`].
    pub fn beyond(&self, triangle: &Triangle, radius: f64) -> Result<Mat<f64>, Folded> {
        if triangle.bent.is_some() {
            return self.beyond_bent(triangle, radius, 0);
        }
        let (_, columns) = triangle.map([0.0; 2]);
        let at = self.rule.iter().map(|(point, weight, functions)| {
            (triangle.map(*point).0, columns, *weight, functions.as_slice())
        });
        Ok(beyond(self.mass.nrows(), radius, at))
    }

    fn beyond_bent(&self, triangle: &Triangle, radius: f64, further: usize) -> Result<Mat<f64>, Folded> {
        let points = triangle.rule(self.degree + 2, further)?;
        let functions: Vec<Vec<Jet>> = points.iter().map(|at| continuous(self.degree, at.point)).collect();
        let at = points.iter().zip(&functions).map(|(at, f)| (at.place, at.columns, at.weight, f.as_slice()));
        Ok(beyond(self.mass.nrows(), radius, at))
    }
}

/// The energies of [`PotentialIntegrals::beyond`] from the points of a rule: places, derivatives of the map, weights and the `n`
/// functions there.
fn beyond<'a>(
    n: usize,
    radius: f64,
    rule: impl Iterator<Item = ([f64; 2], [[f64; 2]; 2], f64, &'a [Jet])>,
) -> Mat<f64> {
    let mut out = Mat::zeros(n, n);
    let mut of: Vec<[f64; 3]> = vec![[0.0; 3]; n];
    for (place, [u, v], weight, functions) in rule {
        let determinant = u[0] * v[1] - u[1] * v[0];
        for (of, f) in of.iter_mut().zip(functions) {
            let [a, b] = f.slope;
            let slope = [(v[1] * a - u[1] * b) / determinant, (u[0] * b - v[0] * a) / determinant];
            let radial = f.value + place[0] * slope[0] + place[1] * slope[1];
            *of = [radial / radius.sqrt(), radius.sqrt() * slope[0], radius.sqrt() * slope[1]];
        }
        let weight = weight * determinant.abs();
        for i in 0..n {
            for j in 0..n {
                out[(i, j)] += weight * (0..3).map(|k| of[i][k] * of[j][k]).sum::<f64>();
            }
        }
    }
    out
}

/// Integrals of the fluxes over the reference triangle and its sides.
#[derive(Debug)]
pub struct FluxIntegrals {
    degree: usize,
    /// Products of components: xx, xy + yx, yy.
    mass: [Mat<f64>; 3],
    /// Row: orthonormal polynomial, column: flux whose divergence it is multiplied by.
    divergence: Mat<f64>,
    /// The same for the outward flux through each side and its orthonormal polynomials, for sides of length 1.
    traces: [Mat<f64>; 3],
}

impl FluxIntegrals {
    /// Of degree `p`, at least 1.
    pub fn new(p: usize) -> Self {
        let (n, count) = (p * (p + 2), divergences(p));
        let mut mass = [0, 1, 2].map(|_| Mat::zeros(n, n));
        let mut divergence = Mat::zeros(count, n);
        for (point, w) in triangle_rule(p + 2) {
            let (values, of) = fluxes(p, point);
            let tests = orthonormal(p - 1, point);
            for i in 0..n {
                for j in 0..n {
                    let (a, b) = (values[i], values[j]);
                    mass[0][(i, j)] += w * a[0] * b[0];
                    mass[1][(i, j)] += w * (a[0] * b[1] + a[1] * b[0]);
                    mass[2][(i, j)] += w * a[1] * b[1];
                }
                for (k, test) in tests.iter().enumerate() {
                    divergence[(k, i)] += w * test.value * of[i];
                }
            }
        }
        let (nodes, weights) = gauss_legendre(p + 1);
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let traces = [0, 1, 2].map(|side| {
            let [a, b] = SIDES[side].map(|c| corners[c]);
            let mut trace = Mat::zeros(p, n);
            for (&s, &w) in nodes.iter().zip(&weights) {
                let at = [0, 1].map(|k| 0.5 * ((1.0 - s) * a[k] + (1.0 + s) * b[k]));
                let l = legendre(p - 1, s);
                for (i, f) in fluxes(p, at).0.iter().enumerate() {
                    let out = f[0] * NORMALS[side][0] + f[1] * NORMALS[side][1];
                    for m in 0..p {
                        trace[(m, i)] += 0.5 * w * ((2 * m + 1) as f64).sqrt() * l[m] * out;
                    }
                }
            }
            trace
        });
        Self { degree: p, mass, divergence, traces }
    }

    /// The forms of a triangle. On a bent one the functions inside are such that the densities which they stand for, as polynomials on
    /// the reference triangle over the determinant of the map, are orthonormal.
    ///
    /// # Errors
    /// [`Folded`].
    pub fn on(&self, triangle: &Triangle) -> Result<FluxForms, Folded> {
        if triangle.bent.is_some() {
            return self.on_bent(triangle, 0);
        }
        let (area, [uu, uv, vv]) = (triangle.double_area(), triangle.metric());
        let (p, n, count) = (self.degree, self.divergence.ncols(), self.divergence.nrows());
        let [xx, xy, yy] = &self.mass;
        let mass = Mat::from_fn(n, n, |i, j| (uu * xx[(i, j)] + uv * xy[(i, j)] + vv * yy[(i, j)]) / area);
        let lengths = [0, 1, 2].map(|side| triangle.length(side).sqrt());
        let constraints = Mat::from_fn(count + 3 * p, n, |i, j| match i.checked_sub(count) {
            None => self.divergence[(i, j)] / area.sqrt(),
            Some(row) => self.traces[row / p][(row % p, j)] / lengths[row / p],
        });
        let mut one = vec![0.0; count];
        one[0] = (0.5 * area).sqrt();
        Ok(FluxForms { mass, constraints, one })
    }

    fn on_bent(&self, triangle: &Triangle, further: usize) -> Result<FluxForms, Folded> {
        let (p, n, count) = (self.degree, self.divergence.ncols(), self.divergence.nrows());
        let (mut mass, mut gram) = (Mat::zeros(n, n), Mat::zeros(count, count));
        for at in triangle.rule(p + 2, further)? {
            let [u, v] = at.columns;
            let w = at.weight / at.determinant.abs();
            let values: Vec<[f64; 2]> =
                fluxes(p, at.point).0.iter().map(|f| [0, 1].map(|k| u[k] * f[0] + v[k] * f[1])).collect();
            for i in 0..n {
                for j in 0..n {
                    mass[(i, j)] += w * (values[i][0] * values[j][0] + values[i][1] * values[j][1]);
                }
            }
            let tests = orthonormal(p - 1, at.point);
            for i in 0..count {
                for j in 0..count {
                    gram[(i, j)] += w * tests[i].value * tests[j].value;
                }
            }
        }
        let root = Llt::new(gram.as_ref()).map_err(|_| Folded)?;
        let inside = dense::product(root.lower().transpose(), self.divergence.as_ref());
        let lengths = [0, 1, 2].map(|side| triangle.length(side).sqrt());
        let constraints = Mat::from_fn(count + 3 * p, n, |i, j| match i.checked_sub(count) {
            None => inside[(i, j)],
            Some(row) => self.traces[row / p][(row % p, j)] / lengths[row / p],
        });
        // Of the orthonormal polynomials the first is the root of 2.
        let mut one = Mat::zeros(count, 1);
        one[(0, 0)] = 0.5_f64.sqrt();
        dense::solve_lower_triangular(root.lower(), one.as_mut());
        Ok(FluxForms { mass, constraints, one: (0..count).map(|i| one[(i, 0)]).collect() })
    }
}

/// The forms of the fluxes of one triangle, for unit permittivity.
#[derive(Debug, Clone, PartialEq)]
pub struct FluxForms {
    /// Products of the fluxes.
    pub mass: Mat<f64>,
    /// Fluxes by columns; one row for each orthonormal polynomial of degree below p that their divergence is multiplied by, then one
    /// for each such polynomial of each side and the outward flux through it.
    pub constraints: Mat<f64>,
    /// Coefficients of the constant 1 in the polynomials inside.
    pub one: Vec<f64>,
}

/// The fluxes of degree `p` at a point of the reference triangle, and their divergences.
fn fluxes(p: usize, point: [f64; 2]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let (mut values, mut of) = (Vec::with_capacity(p * (p + 2)), Vec::with_capacity(p * (p + 2)));
    let tests = orthonormal(p - 1, point);
    for q in &tests {
        values.extend([[q.value, 0.0], [0.0, q.value]]);
        of.extend(q.slope);
    }
    let from = [point[0] - 1.0 / 3.0, point[1] - 1.0 / 3.0];
    for q in &tests[tests.len() - p..] {
        values.push(from.map(|x| x * q.value));
        of.push(2.0 * q.value + from[0] * q.slope[0] + from[1] * q.slope[1]);
    }
    (values, of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bent::{Curve, LEAST_EVENNESS, WHOLE};
    use crate::line::hierarchical;

    const SKEW: Triangle = Triangle { corners: [[0.3, -0.1], [1.7, 0.4], [0.1, 0.9]], bent: None };

    /// Between an arc of 45 degrees of the unit circle and a point, inside or outside of it, and a part of that at the arc.
    fn bent(third: [f64; 2]) -> [Triangle; 2] {
        let end = [0.5_f64.sqrt(); 2];
        let curve = Curve::Arc { center: [0.0; 2] };
        let whole = Bent { corners: [[1.0, 0.0], end, third], curve };
        let places = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [0.2, 0.0], [0.1, 0.3]]];
        places.map(|shares| Triangle { corners: shares.map(|s| whole.place(s)), bent: Some((whole, shares)) })
    }

    #[test]
    fn the_area_of_a_bent_triangle_is_that_of_the_straight_one_and_of_the_segment_of_the_circle() {
        let angle = std::f64::consts::FRAC_PI_4;
        let segment = 0.5 * (angle - angle.sin());
        for (third, sign) in [([0.0, 0.0], 1.0), ([1.2, 0.9], -1.0)] {
            let [whole, _] = bent(third);
            let (mass, _) = PotentialIntegrals::new(3).on(&whole).unwrap();
            let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
            let exact = 0.5 * whole.double_area() + sign * segment;
            assert!((area - exact).abs() < 1e-13, "{third:?}: {area} {exact}");
        }
    }

    /// Between a cubic and a point, and a part of that at the cubic; the control points are off a third of the chord by `bow` times what
    /// `random` says.
    fn at_cubic(bow: f64, mut random: impl FnMut() -> f64) -> [Triangle; 2] {
        let mut off = |place: f64| [place + bow * random(), bow * random()];
        let control = [off(1.0 / 3.0), off(2.0 / 3.0)];
        let third = [0.5 + 0.6 * random(), 0.6 + 0.4 * random()];
        let whole = Bent { corners: [[0.0; 2], [1.0, 0.0], third], curve: Curve::Cubic { control } };
        [WHOLE, [[0.1, 0.0], [0.3, 0.0], [0.2, 0.4]]]
            .map(|shares| Triangle { corners: shares.map(|s| whole.place(s)), bent: Some((whole, shares)) })
    }

    /// Numbers between -1/2 and 1/2.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        }
    }

    /// At least the greatest relative difference of the energies that two forms give.
    fn relative_error(found: &Mat<f64>, exact: &Mat<f64>) -> f64 {
        let root = Llt::new(exact.as_ref()).unwrap();
        let mut differ = Mat::from_fn(exact.nrows(), exact.ncols(), |i, j| found[(i, j)] - exact[(i, j)]);
        dense::solve_lower_triangular(root.lower(), differ.as_mut());
        let mut differ = differ.transpose().to_owned();
        dense::solve_lower_triangular(root.lower(), differ.as_mut());
        differ.norm_l2()
    }

    #[test]
    fn more_points_change_no_energy_on_a_bent_triangle_by_the_allowance_for_them() {
        let mut random = noise();
        let cubics = (0..40).flat_map(|k| at_cubic(0.04 * f64::from(k % 20), &mut random));
        let triangles = bent([0.0, 0.0]).into_iter().chain(bent([1.3, 0.7])).chain(cubics);
        let degrees = [2, 6].map(|p| (p, PotentialIntegrals::new(p), FluxIntegrals::new(p)));
        let mut used = std::collections::BTreeSet::new();
        for (k, triangle) in triangles.enumerate() {
            let (p, potentials, fluxes) = &degrees[k / 2 % 2];
            let p = *p;
            let Some((whole, part)) = triangle.bent else { panic!() };
            let evenness = whole.stretch(part).evenness();
            let Some(rule) = MORE_POINTS.iter().position(|(least, _)| evenness >= *least) else { continue };
            used.insert(rule);
            compare(&triangle, potentials, fluxes, 0.0);
        }
        assert!(used.len() == MORE_POINTS.len(), "{used:?}");
    }

    /// Compares the energies on a bent triangle with those by more points.
    fn compare(triangle: &Triangle, potentials: &PotentialIntegrals, fluxes: &FluxIntegrals, rounding: f64) {
        let forms = |further: usize| {
            let (mass, stiffness) = potentials.on_bent(triangle, further).unwrap();
            let beyond = potentials.beyond_bent(triangle, 1.0, further).unwrap();
            [&mass + &stiffness, mass, fluxes.on_bent(triangle, further).unwrap().mass, beyond]
        };
        for (found, exact) in forms(0).iter().zip(&forms(12)) {
            let mut exact = exact.clone();
            // Energies that are much smaller than others of the same triangle, as in slivers, are lost in rounding.
            let greatest = (0..exact.nrows()).map(|i| exact[(i, i)]).fold(0.0, f64::max);
            let mut found = found.clone();
            for i in 0..exact.nrows() {
                exact[(i, i)] += rounding * greatest;
                found[(i, i)] += rounding * greatest;
            }
            let error = relative_error(&found, &exact);
            assert!(
                error < 5e-11,
                "{triangle:?}: {:?}, {error:e}",
                triangle.bent.map(|(b, part)| b.stretch(part))
            );
        }
    }

    /// Between an arc from (1, 0) and a point on the tangent there, or off it by an angle, either way round.
    fn needles(angle: f64, off: f64, length: f64) -> [Triangle; 3] {
        let [p, q] = [[1.0, 0.0], [angle.cos(), angle.sin()]];
        let third = [1.0 + length * off.sin(), length * off.cos()];
        let curve = Curve::Arc { center: [0.0; 2] };
        let whole = Bent { corners: [p, q, third], curve };
        let reversed = Bent { corners: [q, p, third], curve };
        let [a, b, c] = WHOLE;
        let part = [[0.0, 0.0], [0.2, 0.0], [0.1, 0.3]];
        [(whole, WHOLE), (reversed, [c, a, b]), (whole, part)].map(|(whole, shares)| Triangle {
            corners: shares.map(|s| whole.place(s)),
            bent: Some((whole, shares)),
        })
    }

    #[test]
    fn needles_between_an_arc_and_its_tangent_are_integrated_up_to_the_tip_or_refused() {
        let degrees = [2, 5].map(|p| (PotentialIntegrals::new(p), FluxIntegrals::new(p)));
        let [mut found, mut refused] = [0; 2];
        for angle in [0.3_f64, 0.78] {
            for off in [0.0, 1e-13, 1e-6, 1e-2] {
                for share in [0.3, 0.5, 0.6, 1.0] {
                    for triangle in needles(angle, off, share * angle) {
                        for (potentials, fluxes) in &degrees {
                            match potentials.on(&triangle) {
                                Ok(_) => {
                                    found += 1;
                                    compare(&triangle, potentials, fluxes, 1e-3);
                                }
                                Err(Folded) => {
                                    refused += 1;
                                    assert!(share <= 0.6, "{angle} {off} {share}");
                                }
                            }
                        }
                    }
                }
            }
        }
        assert!(found > 90 && refused > 0, "{found} {refused}");
    }

    #[test]
    fn the_area_of_a_needle_is_that_between_the_tangent_and_the_circle() {
        let angle = 0.4_f64;
        for triangle in &needles(angle, 0.0, angle)[..2] {
            let (mass, _) = PotentialIntegrals::new(3).on(triangle).unwrap();
            let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
            let exact = 0.5 * triangle.double_area() - 0.5 * (angle - angle.sin());
            assert!((area - exact).abs() < 1e-15, "{area} {exact}");
        }
    }

    #[test]
    fn the_area_at_a_cubic_is_that_of_the_straight_triangle_and_of_what_lies_between_the_cubic_and_its_chord()
    {
        let mut random = noise();
        for _ in 0..10 {
            let [whole, _] = at_cubic(0.2, &mut random);
            let Some((Bent { curve: Curve::Cubic { control: [p, q] }, .. }, _)) = whole.bent else {
                panic!()
            };
            let (mass, _) = PotentialIntegrals::new(2).on(&whole).unwrap();
            let area: f64 = (0..3).map(|i| (0..3).map(|j| mass[(i, j)]).sum::<f64>()).sum();
            // From Green's formula: the integral of (x dy - y dx) / 2 along a Bezier curve from (0, 0) to (1, 0).
            let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
            let beside = 0.15 * (cross(p, q) + cross(p, [1.0, 0.0]) + 2.0 * cross(q, [1.0, 0.0]));
            let exact = 0.5 * whole.double_area() + beside;
            assert!((area - exact).abs() < 1e-14, "{area} {exact}");
        }
    }

    #[test]
    fn the_constant_has_no_flux_and_leaves_none_on_a_bent_triangle() {
        let cubics = (0..4).flat_map(|_| at_cubic(0.2, noise()));
        for triangle in bent([0.0, 0.0]).into_iter().chain(bent([1.3, 0.7])).chain(cubics) {
            let p = 4;
            let FluxForms { constraints, one, .. } = FluxIntegrals::new(p).on(&triangle).unwrap();
            for flux in 0..constraints.ncols() {
                let inside: f64 = one.iter().enumerate().map(|(i, x)| x * constraints[(i, flux)]).sum();
                let through: f64 = (0..3)
                    .map(|side| constraints[(divergences(p) + side * p, flux)] * triangle.length(side).sqrt())
                    .sum();
                assert!((inside - through).abs() < 1e-12, "{flux}: {inside} {through}");
            }
        }
    }

    #[test]
    fn a_triangle_on_the_wrong_side_of_its_arc_is_refused() {
        let [whole, _] = bent([0.9, 0.38]);
        assert_eq!(PotentialIntegrals::new(2).on(&whole).err(), Some(Folded));
        assert_eq!(FluxIntegrals::new(2).on(&whole), Err(Folded));
    }

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

    #[test]
    fn the_orthonormal_polynomials_are_orthonormal() {
        let p = 7;
        let n = (p + 1) * (p + 2) / 2;
        let mut gram = vec![0.0; n * n];
        for (point, w) in triangle_rule(p + 2) {
            let q = orthonormal(p, point);
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += w * q[i].value * q[j].value;
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                assert!((gram[i * n + j] - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn slopes_are_differences_of_values() {
        let (at, h) = ([0.23, 0.41], 1e-6);
        for p in 1..6 {
            let f = continuous(p, at);
            for k in 0..2 {
                let step = |sign: f64| {
                    let mut x = at;
                    x[k] += sign * h;
                    continuous(p, x)
                };
                for ((f, up), down) in f.iter().zip(step(1.0)).zip(step(-1.0)) {
                    assert!((f.slope[k] - (up.value - down.value) / (2.0 * h)).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn on_a_side_the_functions_are_those_of_a_line() {
        let (p, s) = (6, 0.3);
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let line = hierarchical(p, s).0;
        for (side, ends) in SIDES.iter().enumerate() {
            let [a, b] = ends.map(|c| corners[c]);
            let f = continuous(p, [0, 1].map(|k| 0.5 * ((1.0 - s) * a[k] + (1.0 + s) * b[k])));
            let first = 3 + side * (p - 1);
            for (i, f) in f.iter().enumerate() {
                let expected = match i {
                    i if i == ends[0] => line[0],
                    i if i == ends[1] => line[1],
                    i if (first..first + p - 1).contains(&i) => line[2 + i - first],
                    _ => 0.0,
                };
                assert!((f.value - expected).abs() < 1e-14, "{side} {i}");
            }
        }
    }

    #[test]
    fn a_linear_potential_has_the_energy_of_its_gradient() {
        let (mass, stiffness) = PotentialIntegrals::new(4).on(&SKEW).unwrap();
        let area = 0.5 * SKEW.double_area();
        // 2 x - 3 y has its values at the corners as coefficients.
        let u = SKEW.corners.map(|c| 2.0 * c[0] - 3.0 * c[1]);
        let form = |m: &Mat<f64>, u: &[f64; 3]| {
            (0..3).map(|i| (0..3).map(|j| u[i] * m[(i, j)] * u[j]).sum::<f64>()).sum::<f64>()
        };
        assert!((form(&stiffness, &u) - 13.0 * area).abs() < 1e-12);
        assert!((form(&mass, &[1.0; 3]) - area).abs() < 1e-14);
    }

    #[test]
    fn what_a_flux_diverges_leaves_through_the_sides_in_either_orientation() {
        let [a, b, c] = SKEW.corners;
        for (p, triangle) in [(1, SKEW), (3, SKEW), (4, Triangle { corners: [a, c, b], bent: None })] {
            let constraints = FluxIntegrals::new(p).on(&triangle).unwrap().constraints;
            let count = divergences(p);
            for flux in 0..constraints.ncols() {
                let inside = constraints[(0, flux)] * (0.5 * triangle.double_area()).sqrt();
                let through: f64 = (0..3)
                    .map(|side| constraints[(count + side * p, flux)] * triangle.length(side).sqrt())
                    .sum();
                assert!((inside - through).abs() < 1e-12, "{p} {flux}: {inside} {through}");
            }
        }
    }

    #[test]
    fn the_flux_between_the_traces_of_a_linear_potential_is_its_gradient() {
        let (p, triangle) = (3, SKEW);
        let FluxForms { mass, constraints, .. } = FluxIntegrals::new(p).on(&triangle).unwrap();
        // On each side the trace of 2 x - 3 y, inside minus its mean: the flux has no divergence then.
        let u = |x: [f64; 2]| 2.0 * x[0] - 3.0 * x[1];
        let mut drive = Mat::zeros(constraints.nrows(), 1);
        for (side, [a, b]) in SIDES.iter().enumerate() {
            let (from, to) = (u(triangle.corners[*a]), u(triangle.corners[*b]));
            let root = triangle.length(side).sqrt();
            let first = divergences(p) + side * p;
            drive[(first, 0)] = 0.5 * (from + to) * root;
            drive[(first + 1, 0)] = 0.5 * (to - from) * root / 3.0_f64.sqrt();
        }
        for (point, w) in triangle_rule(p + 2) {
            let [v, t] = triangle.sides();
            let a = triangle.corners[0];
            let x = [0, 1].map(|k| a[k] + point[0] * v[k] + point[1] * t[k]);
            for (i, q) in orthonormal(p - 1, point).iter().enumerate() {
                drive[(i, 0)] -= w * q.value * u(x) * triangle.double_area().sqrt();
            }
        }
        let source = dense::product(constraints.transpose(), drive.as_ref());
        let flux = Llt::new(mass.as_ref()).unwrap().solve(source.as_ref());
        let energy = dense::product(flux.transpose(), source.as_ref())[(0, 0)];
        assert!((energy - 13.0 * 0.5 * triangle.double_area()).abs() < 1e-11, "{energy}");
        let rest = dense::product(constraints.as_ref(), flux.as_ref());
        assert!((0..divergences(p)).all(|i| rest[(i, 0)].abs() < 1e-11));
    }
}

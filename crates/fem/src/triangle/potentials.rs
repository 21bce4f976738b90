//! Energies of continuous potentials.

use super::functions::{continuous, continuous_functions};
use super::rules::triangle_rule;
use super::{Folded, Triangle};
use crate::jet::Jet;
use faer::Mat;

/// The points of a rule with their weights and the continuous functions of degree `p` there.
fn rule_with_functions(p: usize, n: usize) -> Vec<([f64; 2], f64, Vec<Jet>)> {
    triangle_rule(n).into_iter().map(|(x, w)| (x, w, continuous(p, x))).collect()
}

/// Integrals of the continuous functions over the reference triangle.
#[derive(Debug)]
pub struct PotentialIntegrals {
    /// The degree of the functions.
    degree: usize,
    /// Integrals of products of values.
    mass: Mat<f64>,
    /// Integrals of products of slopes: xx, xy + yx, yy.
    stiffness: [Mat<f64>; 3],
    /// The points of the rule and their weights, with the functions there.
    rule: Vec<([f64; 2], f64, Vec<Jet>)>,
}

impl PotentialIntegrals {
    /// Computes the integrals for functions of degree `p`, at least 1.
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
    /// [`Folded`] if a bent triangle folds or is too uneven to integrate over.
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

    /// Mass and stiffness of a bent triangle, by a rule with `further` points more along each direction than
    /// needed.
    pub(super) fn on_bent(
        &self,
        triangle: &Triangle,
        further: usize,
    ) -> Result<(Mat<f64>, Mat<f64>), Folded> {
        let n = self.mass.nrows();
        let (mut mass, mut stiffness) = (Mat::zeros(n, n), Mat::zeros(n, n));
        for node in triangle.rule(self.degree + 2, further)? {
            let [u, v] = node.columns;
            let f = continuous(self.degree, node.point);
            let slopes: Vec<[f64; 2]> = f
                .iter()
                .map(|f| {
                    let [a, b] = f.slope;
                    [(v[1] * a - u[1] * b) / node.determinant, (u[0] * b - v[0] * a) / node.determinant]
                })
                .collect();
            let w = node.weight * node.determinant.abs();
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
    /// The energy of potentials that continue along rays, as u(s x) = u(x) / s, beyond a plane parallel to
    /// the triangle's at the distance `radius` from the point where the rays come from, which is over the
    /// origin: the integral of (u + x . grad u)^2 / radius + radius |grad u|^2 over the triangle.
    ///
    /// # Errors
    /// [`Folded`] if a bent triangle folds or is too uneven to integrate over.
    pub fn beyond(&self, triangle: &Triangle, radius: f64) -> Result<Mat<f64>, Folded> {
        if triangle.bent.is_some() {
            return self.beyond_bent(triangle, radius, 0);
        }
        let (_, columns) = triangle.map([0.0; 2]);
        let rule = self.rule.iter().map(|(point, weight, functions)| {
            (triangle.map(*point).0, columns, *weight, functions.as_slice())
        });
        Ok(beyond(self.mass.nrows(), radius, rule))
    }

    /// [`PotentialIntegrals::beyond`] for a bent triangle; `further` is as for `on_bent`.
    pub(super) fn beyond_bent(
        &self,
        triangle: &Triangle,
        radius: f64,
        further: usize,
    ) -> Result<Mat<f64>, Folded> {
        let points = triangle.rule(self.degree + 2, further)?;
        let functions: Vec<Vec<Jet>> =
            points.iter().map(|node| continuous(self.degree, node.point)).collect();
        let rule = points
            .iter()
            .zip(&functions)
            .map(|(node, f)| (node.place, node.columns, node.weight, f.as_slice()));
        Ok(beyond(self.mass.nrows(), radius, rule))
    }
}

/// The energies of [`PotentialIntegrals::beyond`] from the points of a rule: places, derivatives of the map,
/// weights and the `n` functions there.
fn beyond<'a>(
    n: usize,
    radius: f64,
    rule: impl Iterator<Item = ([f64; 2], [[f64; 2]; 2], f64, &'a [Jet])>,
) -> Mat<f64> {
    let mut out = Mat::zeros(n, n);
    let mut components: Vec<[f64; 3]> = vec![[0.0; 3]; n];
    for (place, [u, v], weight, functions) in rule {
        let determinant = u[0] * v[1] - u[1] * v[0];
        for (component, f) in components.iter_mut().zip(functions) {
            let [a, b] = f.slope;
            let slope = [(v[1] * a - u[1] * b) / determinant, (u[0] * b - v[0] * a) / determinant];
            let radial = f.value + place[0] * slope[0] + place[1] * slope[1];
            *component = [radial / radius.sqrt(), radius.sqrt() * slope[0], radius.sqrt() * slope[1]];
        }
        let weight = weight * determinant.abs();
        for i in 0..n {
            for j in 0..n {
                out[(i, j)] += weight * (0..3).map(|k| components[i][k] * components[j][k]).sum::<f64>();
            }
        }
    }
    out
}

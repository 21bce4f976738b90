//! The reference tetrahedron: Lagrange functions of order p and their integrals.
//!
//! A function is identified by the lattice point at which it is one: barycentric coordinates alpha / p with
//! integer alpha. Each is a product of one polynomial per barycentric coordinate, on a triangle as well as on
//! a tetrahedron.

use elastocap_fem::quadrature::gauss_legendre;

/// Edges of a tetrahedron by its corners, in the order of their functions.
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
/// Faces of a tetrahedron by its corners, in the order of their functions.
pub(crate) const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
/// Largest number of functions of a tetrahedron, that of order 3.
pub(super) const MAX_FUNCTIONS: usize = 20;

/// Lattice points of order `order` (0 to 3) of a tetrahedron (4 corners) or a triangle (3, the fourth entry
/// zero): corners, edges from their first corner to their second, faces. Order 0 has one point, at no
/// particular place.
pub(super) fn lattice(order: usize, corners: usize) -> Vec<[u8; 4]> {
    let p = order as u8;
    if p == 0 {
        return vec![[0; 4]];
    }
    let mut points = Vec::new();
    for k in 0..corners {
        let mut point = [0; 4];
        point[k] = p;
        points.push(point);
    }
    for [a, b] in EDGES.into_iter().filter(|e| e[1] < corners) {
        for step in 1..p {
            let mut point = [0; 4];
            point[a] = p - step;
            point[b] = step;
            points.push(point);
        }
    }
    if p == 3 {
        for face in FACES.into_iter().filter(|f| f[2] < corners) {
            let mut point = [0; 4];
            for k in face {
                point[k] = 1;
            }
            points.push(point);
        }
    }
    points
}

/// Value and derivatives by the barycentric coordinates, taken as independent, of the function of order
/// `order` that is one at the lattice point `point`, at the point with the barycentric coordinates `at`.
pub(super) fn shape(order: usize, point: [u8; 4], at: [f64; 4]) -> (f64, [f64; 4]) {
    let p = order as f64;
    let (mut value, mut slope) = ([1.0; 4], [0.0; 4]);
    for k in 0..4 {
        for m in 0..point[k] {
            let factor = (p * at[k] - f64::from(m)) / f64::from(m + 1);
            slope[k] = slope[k] * factor + value[k] * p / f64::from(m + 1);
            value[k] *= factor;
        }
    }
    let others = |k: usize| (0..4).filter(|j| *j != k).map(|j| value[j]).product::<f64>();
    (value.iter().product(), [0, 1, 2, 3].map(|k| slope[k] * others(k)))
}

/// Points (barycentric) and weights on the triangle, exact to degree 6; the weights add to 1.
pub(super) fn triangle_rule() -> Vec<([f64; 4], f64)> {
    let (x, w) = unit_rule();
    let mut rule = Vec::new();
    for (a, wa) in x.iter().zip(&w) {
        for (b, wb) in x.iter().zip(&w) {
            let second = b * (1.0 - a);
            rule.push(([1.0 - a - second, *a, second, 0.0], 2.0 * wa * wb * (1.0 - a)));
        }
    }
    rule
}

/// Points (barycentric) and weights on the tetrahedron, exact to degree 5; the weights add to 1 / 6.
pub(super) fn tetrahedron_rule() -> Vec<([f64; 4], f64)> {
    let (x, w) = unit_rule();
    let mut rule = Vec::new();
    for (a, wa) in x.iter().zip(&w) {
        for (b, wb) in x.iter().zip(&w) {
            for (c, wc) in x.iter().zip(&w) {
                let second = b * (1.0 - a);
                let third = c * (1.0 - a) * (1.0 - b);
                let weight = wa * wb * wc * (1.0 - a).powi(2) * (1.0 - b);
                rule.push(([1.0 - a - second - third, *a, second, third], weight));
            }
        }
    }
    rule
}

/// Four Gauss points on [0, 1].
fn unit_rule() -> (Vec<f64>, Vec<f64>) {
    let (x, w) = gauss_legendre(4);
    (x.iter().map(|x| 0.5 * (x + 1.0)).collect(), w.iter().map(|w| 0.5 * w).collect())
}

/// Integrals over the reference tetrahedron, and gradients at its lattice points.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    /// The number of functions of a tetrahedron.
    pub(super) functions: usize,
    /// `[i][m][j]`: the integral of d_a phi_i d_b phi_j + d_b phi_i d_a phi_j, halved where a = b; m counts
    /// the pairs a <= b: 11, 12, 13, 22, 23, 33.
    pub(super) stiffness: Vec<f64>,
    /// `[lattice point of order p - 1][i]`: derivatives by the barycentric coordinates 1, 2, 3.
    pub(super) gradients: Vec<Vec<[f64; 3]>>,
}

impl Reference {
    /// The integrals of the functions of order `order`, 1 to 3.
    pub(super) fn new(order: usize) -> Self {
        let points = lattice(order, 4);
        let n = points.len();
        let gradients_at = |at: [f64; 4]| -> Vec<[f64; 3]> {
            let by_three = |d: [f64; 4]| [d[1] - d[0], d[2] - d[0], d[3] - d[0]];
            points.iter().map(|&point| by_three(shape(order, point, at).1)).collect()
        };
        let mut stiffness = vec![0.0; n * 6 * n];
        for (at, weight) in tetrahedron_rule() {
            let d = gradients_at(at);
            for i in 0..n {
                for (m, [a, b]) in PAIRS.into_iter().enumerate() {
                    for j in 0..n {
                        let product =
                            if a == b { d[i][a] * d[j][a] } else { d[i][a] * d[j][b] + d[i][b] * d[j][a] };
                        stiffness[(i * 6 + m) * n + j] += weight * product;
                    }
                }
            }
        }
        let places = lattice(order - 1, 4).into_iter().map(|point| match order {
            1 => [0.25; 4],
            _ => point.map(|alpha| f64::from(alpha) / (order - 1) as f64),
        });
        Self { functions: n, stiffness, gradients: places.map(gradients_at).collect() }
    }

    /// Row `i` of the stiffness of an element with this metric.
    pub(super) fn row(&self, i: usize, metric: &[f64; 6], row: &mut [f64; MAX_FUNCTIONS]) {
        let n = self.functions;
        let row = &mut row[..n];
        row.fill(0.0);
        for m in 0..6 {
            let part = &self.stiffness[(i * 6 + m) * n..(i * 6 + m + 1) * n];
            for (sum, k) in row.iter_mut().zip(part) {
                *sum += metric[m] * k;
            }
        }
    }
}

/// Pairs of reference coordinates, as a metric lists them.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_function_is_one_at_its_point_and_zero_at_the_others() {
        for order in 1..=3 {
            for corners in [3, 4] {
                let points = lattice(order, corners);
                let expected = if corners == 4 { [4, 10, 20] } else { [3, 6, 10] };
                assert_eq!(points.len(), expected[order - 1]);
                for (i, point) in points.iter().enumerate() {
                    let at = point.map(|a| f64::from(a) / order as f64);
                    for (j, other) in points.iter().enumerate() {
                        let value = shape(order, *other, at).0;
                        assert!((value - f64::from(u8::from(i == j))).abs() < 1e-13);
                    }
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let at = [0.13, 0.24, 0.31, 0.32];
        for order in 1..=3 {
            for point in lattice(order, 4) {
                for k in 0..4 {
                    let (mut low, mut high) = (at, at);
                    low[k] -= 1e-5;
                    high[k] += 1e-5;
                    let slope = (shape(order, point, high).0 - shape(order, point, low).0) / 2e-5;
                    assert!((shape(order, point, at).1[k] - slope).abs() < 1e-8);
                }
            }
        }
    }
}

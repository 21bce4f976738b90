//! The shape functions of the elements, quadratic along each direction, and the fit to their quadrature
//! points, linear along each.

use super::dimension::Dimension;

/// Nodes of the largest element.
const MAX_NODES: usize = 27;

/// Values of the quadratic Lagrange polynomials for the nodes -1, 0, 1 at `s`, and their slopes.
pub(super) fn quadratic(s: f64) -> ([f64; 3], [f64; 3]) {
    ([0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)], [s - 0.5, -2.0 * s, s + 0.5])
}

/// Values of the shape functions at a `point` of the reference element, and their slopes along its axes.
/// Entries beyond the number of nodes of the element are meaningless.
pub(super) fn shape<S: Dimension>(point: [f64; 3]) -> [(f64, [f64; 3]); MAX_NODES] {
    let lines = point.map(quadratic);
    let of_node = |n: usize| {
        if S::AXES == 2 && n >= 9 {
            return (0.0, [0.0; 3]);
        }
        let mut value = 1.0;
        let mut slopes = [1.0; 3];
        let places = [n % 3, n / 3 % 3, n / 9];
        for (k, (line, i)) in lines.iter().zip(places).enumerate().take(S::AXES) {
            value *= line.0[i];
            for (m, slope) in slopes.iter_mut().enumerate() {
                *slope *= if m == k { line.1[i] } else { line.0[i] };
            }
        }
        (value, slopes)
    };
    std::array::from_fn(of_node)
}

/// The weights with which the values `v_q` at the three quadrature points along one direction of an element
/// give the value at node `n` (0 the first, 1 the middle, 2 the last) of a linear polynomial. The polynomial
/// is fitted by least squares with the weights of the quadrature: `sum_q w_q (1/2 + 3/2 s_q s) v_q`.
pub(super) fn linear_fit_weights(n: usize) -> [f64; 3] {
    let abscissa = 0.6f64.sqrt();
    let weight = |q: f64, w: f64| w * (0.5 + 1.5 * q * (n as f64 - 1.0));
    [weight(-abscissa, 5.0 / 9.0), weight(0.0, 8.0 / 9.0), weight(abscissa, 5.0 / 9.0)]
}

//! Tensors at a point: the gradient of a map, and the symmetric tensors that it turns a permittivity into.

use elastocap_linalg::vector::{cross, dot};

/// A symmetric tensor, by its entries 00, 11, 22, 01, 02 and 12.
pub(crate) type Symmetric = [f64; 6];

/// The adjugate J F^-1 and the determinant J of a gradient F, which is given by rows.
#[inline]
pub(super) fn adjugate(f: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let [x, y, z] = *f;
    let first = cross(y, z);
    (transposed(&[first, cross(z, x), cross(x, y)]), dot(x, first))
}

/// The transpose of a matrix.
#[inline]
pub(super) fn transposed([x, y, z]: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

/// The tensor times a number.
#[inline]
pub(super) fn scaled(by: f64, k: &Symmetric) -> Symmetric {
    [by * k[0], by * k[1], by * k[2], by * k[3], by * k[4], by * k[5]]
}

/// The tensor times a vector.
#[inline]
pub(crate) fn times(k: &Symmetric, x: [f64; 3]) -> [f64; 3] {
    [
        k[0] * x[0] + k[3] * x[1] + k[4] * x[2],
        k[3] * x[0] + k[1] * x[1] + k[5] * x[2],
        k[4] * x[0] + k[5] * x[1] + k[2] * x[2],
    ]
}

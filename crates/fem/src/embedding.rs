//! Functions of a line as functions of a finer one.

use crate::line::{Element, Line, Numbering, hierarchical};
use crate::mixed::potential_offsets;
use crate::quadrature::{gauss_legendre, legendre};
use faer::Mat;
use std::ops::Range;

/// Coordinates that differ by less than this share of an element are the same. Not tuned: it only has to lie
/// above rounding errors and below distances that matter.
const ALIKE: f64 = 1e-9;

/// The matrix that expresses the functions of `coarse` (columns) in those of `fine` (rows), both in the order
/// of [`Numbering`]: exact where the elements of the fine line have at least the degree of those around them,
/// and otherwise the best approximation. `None` if an element of the fine line is not inside one of the
/// coarse line.
pub fn embedding(coarse: &Line, fine: &Line) -> Option<Mat<f64>> {
    let (from, to) = (Numbering::new(coarse), Numbering::new(fine));
    let mut out = Mat::zeros(to.len, from.len);
    for e in 0..fine.elements() {
        let (outer, ends) = (0..coarse.elements())
            .find_map(|c| within(coarse.element(c), fine.element(e)).map(|ends| (c, ends)))?;
        let (rows, outer_columns) = (to.element(fine, e), from.element(coarse, outer));
        let (degree, outer_degree) = (fine.degree(e), coarse.degree(outer));
        let columns: Vec<(usize, usize)> =
            outer_columns.iter().enumerate().filter_map(|(k, column)| Some((k, (*column)?))).collect();
        for (row, s) in rows.iter().zip(ends) {
            let (values, _) = hierarchical(outer_degree, s);
            for (row, (k, column)) in row.iter().flat_map(|row| columns.iter().map(move |c| (*row, *c))) {
                out[(row, column)] = values[k];
            }
        }
        // The stiffness of the functions inside an element is the identity.
        let (points, weights) = gauss_legendre(degree.max(outer_degree) + 1);
        let half = 0.5 * (ends[1] - ends[0]);
        for (t, w) in points.iter().zip(&weights) {
            let (_, outer_slopes) = hierarchical(outer_degree, ends[0] + half * (t + 1.0));
            let (_, slopes) = hierarchical(degree, *t);
            for (row, slope) in rows.iter().zip(&slopes).skip(2) {
                let Some(row) = row else { continue };
                for &(k, column) in &columns {
                    out[(*row, column)] += w * half * outer_slopes[k] * slope;
                }
            }
        }
    }
    Some(out)
}

/// The matrix that interpolates the functions of a line `from` (columns) by those of a line `to` (rows) on a
/// run of its finite elements; other rows are zero. The interpolant has the same values at the nodes, and
/// within each element the slopes that are nearest in the mean square. `common` is a refinement of both
/// lines; `None` if it is not.
pub fn interpolation(from: &Line, to: &Line, common: &Line, elements: Range<usize>) -> Option<Mat<f64>> {
    let (rows, refined) = (Numbering::new(to), Numbering::new(common));
    let (from_in_common, to_in_common) = (embedding(from, common)?, embedding(to, common)?);
    let mut out = Mat::zeros(rows.len, from_in_common.ncols());
    let (first, first_common) = (to.first_finite(), common.first_finite());
    let node = |at: f64| common.nodes.iter().position(|x| *x == at);
    for e in elements {
        let Element::Finite { start, length } = to.element(e) else { return None };
        let ends = [node(start)?, node(to.nodes[e - first + 1])?];
        for (k, at) in ends.iter().enumerate() {
            for column in 0..from_in_common.ncols() {
                out[(rows.vertex[e - first + k], column)] = from_in_common[(refined.vertex[*at], column)];
            }
        }
        for bubble in rows.bubble[e]..rows.bubble[e] + to.degree(e) - 1 {
            for piece in ends[0]..ends[1] {
                let Element::Finite { length: part, .. } = common.element(piece + first_common) else {
                    return None;
                };
                let local = refined.element(common, piece + first_common);
                let [Some(below), Some(above)] = [local[0], local[1]] else { return None };
                // The stiffness of the inner functions of an element is the identity times 2 over its length.
                let weight = length / part;
                let rise = |m: &Mat<f64>, c: usize| m[(above, c)] - m[(below, c)];
                let inner: Vec<usize> = local.iter().skip(2).flatten().copied().collect();
                for column in 0..from_in_common.ncols() {
                    let straight = 0.5 * rise(&to_in_common, bubble) * rise(&from_in_common, column);
                    let bent: f64 =
                        inner.iter().map(|r| to_in_common[(*r, bubble)] * from_in_common[(*r, column)]).sum();
                    out[(bubble, column)] += weight * (straight + bent);
                }
            }
        }
    }
    Some(out)
}

/// The matrix that expresses the potential modes of `coarse` (columns) in those of `fine` (rows), both in the
/// order of [`potential_offsets`], for lines without infinite elements: exact where the elements of the fine
/// line have at least the degree of those around them, and otherwise the best approximation. `None` if an
/// element of the fine line is infinite or not inside one of the coarse line.
pub fn mode_embedding(coarse: &Line, fine: &Line) -> Option<Mat<f64>> {
    let [from, to] = [coarse, fine].map(potential_offsets);
    let mut out = Mat::zeros(to[fine.elements()], from[coarse.elements()]);
    for e in 0..fine.elements() {
        let (outer, ends) = (0..coarse.elements())
            .find_map(|c| within(coarse.element(c), fine.element(e)).map(|ends| (c, ends)))?;
        let (Element::Finite { length, .. }, Element::Finite { length: outer_length, .. }) =
            (fine.element(e), coarse.element(outer))
        else {
            return None;
        };
        let (degree, outer_degree) = (fine.degree(e), coarse.degree(outer));
        let (points, weights) = gauss_legendre(degree.max(outer_degree));
        for (t, w) in points.iter().zip(&weights) {
            let s = ends[0] + 0.5 * (ends[1] - ends[0]) * (t + 1.0);
            let polynomials = legendre(outer_degree - 1, s);
            for (n, polynomial) in legendre(degree - 1, *t).iter().enumerate() {
                let weighed = 0.5 * w * (length / outer_length * (2 * n + 1) as f64).sqrt() * polynomial;
                for (m, polynomial) in polynomials.iter().enumerate() {
                    out[(to[e] + n, from[outer] + m)] += weighed * ((2 * m + 1) as f64).sqrt() * polynomial;
                }
            }
        }
    }
    Some(out)
}

/// The coordinates of the ends of the element `inner` in the element `outer`, from -1 to 1; `None` if it is
/// not inside `outer`.
fn within(outer: Element, inner: Element) -> Option<[f64; 2]> {
    match (outer, inner) {
        (Element::Finite { start, length }, Element::Finite { start: inner, length: short }) => {
            let ends = [inner, inner + short].map(|x| 2.0 * (x - start) / length - 1.0);
            (ends[0] > -1.0 - ALIKE && ends[1] < 1.0 + ALIKE).then_some(ends)
        }
        (Element::Infinite { pole, reach }, Element::Infinite { pole: inner_pole, reach: inner_reach }) => {
            let tolerance = ALIKE * reach.abs();
            let is_same = (inner_reach - reach).abs() <= tolerance && (inner_pole - pole).abs() <= tolerance;
            is_same.then_some([-1.0, 1.0])
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::LineEnd;
    use elastocap_linalg::dense;

    fn value(line: &Line, coefficients: &[f64], e: usize, s: f64) -> f64 {
        let functions = Numbering::new(line).element(line, e);
        let (values, _) = hierarchical(line.degree(e), s);
        functions.iter().zip(values).filter_map(|(n, v)| Some(coefficients[(*n)?] * v)).sum()
    }

    #[test]
    fn an_interpolant_has_the_values_at_nodes_and_the_nearest_slopes_between_them() {
        let from =
            Line { nodes: vec![0.0, 0.7, 2.0, 5.0], degrees: vec![3, 4, 2], ends: [LineEnd::Finite; 2] };
        let to = Line { nodes: vec![0.0, 1.5, 2.0, 5.0], degrees: vec![4, 2, 3], ends: [LineEnd::Finite; 2] };
        let common =
            Line { nodes: vec![0.0, 0.7, 1.5, 2.0, 5.0], degrees: vec![4; 4], ends: [LineEnd::Finite; 2] };
        let given: Vec<f64> = (0..Numbering::new(&from).len).map(|k| (1.7 * k as f64).cos()).collect();
        let times = |m: &Mat<f64>, x: &[f64]| -> Vec<f64> {
            (0..m.nrows()).map(|i| x.iter().enumerate().map(|(j, x)| m[(i, j)] * x).sum()).collect()
        };
        let found = times(&interpolation(&from, &to, &common, 0..3).unwrap(), &given);
        // At the node 1.5 of the second line, and on the last element, where the function is in the space of
        // that line.
        assert!((value(&to, &found, 0, 1.0) - value(&from, &given, 1, 2.0 * 0.8 / 1.3 - 1.0)).abs() < 1e-13);
        assert!((value(&to, &found, 2, 0.3) - value(&from, &given, 2, 0.3)).abs() < 1e-13);
        // The slopes of the error are orthogonal to those of the functions that vanish at the nodes.
        let [known, interpolant] = [
            times(&embedding(&from, &common).unwrap(), &given),
            times(&embedding(&to, &common).unwrap(), &found),
        ];
        let rest: Vec<f64> = known.iter().zip(&interpolant).map(|(x, y)| x - y).collect();
        let (_, stiffness) = crate::line::line_matrices(&common, &[1.0; 4]);
        let functions = embedding(&to, &common).unwrap();
        let slopes = times(&stiffness, &rest);
        let numbering = Numbering::new(&to);
        for bubble in numbering.bubble[0]..numbering.bubble[0] + 3 {
            let product: f64 = slopes.iter().enumerate().map(|(i, s)| functions[(i, bubble)] * s).sum();
            assert!(product.abs() < 1e-12, "{bubble}: {product:e}");
        }
        // Rows of other elements stay zero.
        let part = interpolation(&from, &to, &common, 2..3).unwrap();
        assert!((0..numbering.bubble[0] + 3).all(|i| (0..part.ncols()).all(|j| part[(i, j)] == 0.0)));
    }

    #[test]
    fn functions_of_a_line_are_the_same_on_a_finer_one() {
        let far = |degree| LineEnd::Infinite { degree, pole: 0.3 };
        let coarse =
            Line { nodes: vec![0.0, 1.0, 3.0], degrees: vec![2, 4], ends: [LineEnd::Finite, far(3)] };
        let fine = Line {
            nodes: vec![0.0, 0.13, 1.0, 2.5, 3.0],
            degrees: vec![2, 3, 5, 4],
            ends: [LineEnd::Finite, far(4)],
        };
        let given: Vec<f64> = (0..Numbering::new(&coarse).len).map(|k| (1.3 * k as f64).sin()).collect();
        let embedded = embedding(&coarse, &fine).unwrap();
        let found: Vec<f64> = (0..embedded.nrows())
            .map(|i| given.iter().enumerate().map(|(j, g)| embedded[(i, j)] * g).sum())
            .collect();
        // Each element of the fine line, the element of the coarse line around it, and its ends in that.
        for (e, c, ends) in [
            (0, 0, [-1.0, -0.74]),
            (1, 0, [-0.74, 1.0]),
            (2, 1, [-1.0, 0.5]),
            (3, 1, [0.5, 1.0]),
            (4, 2, [-1.0, 1.0]),
        ] {
            for s in [-1.0, -0.3, 0.6, 0.9] {
                let outer = ends[0] + 0.5 * (s + 1.0) * (ends[1] - ends[0]);
                let [a, b] = [value(&fine, &found, e, s), value(&coarse, &given, c, outer)];
                assert!((a - b).abs() < 1e-13, "{e} at {s}: {a} {b}");
            }
        }
        // Discontinuous modes keep their products: those on the finer line are orthonormal too.
        let finite = |line: &Line| Line { ends: [LineEnd::Finite; 2], ..line.clone() };
        let modes = mode_embedding(&finite(&coarse), &finite(&fine)).unwrap();
        let products = dense::product(modes.transpose(), modes.as_ref());
        for i in 0..products.nrows() {
            for j in 0..products.ncols() {
                let exact = if i == j { 1.0 } else { 0.0 };
                assert!((products[(i, j)] - exact).abs() < 1e-14, "{i} {j}: {}", products[(i, j)]);
            }
        }
        // The first mode is constant on the first element, which the fine line divides into two.
        let constant: Vec<f64> = (0..modes.nrows()).map(|i| modes[(i, 0)]).collect();
        let expected = [0.13_f64.sqrt(), 0.0, 0.87_f64.sqrt(), 0.0, 0.0];
        assert!(constant.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{constant:?}");
        assert!(mode_embedding(&coarse, &fine).is_none());
        let longer = Line { nodes: vec![0.0, 4.0], degrees: vec![2], ends: [LineEnd::Finite, far(3)] };
        assert!(embedding(&coarse, &longer).is_none());
    }
}

//! The reflection of functions on a symmetric line at its centre.

use crate::line::{Element, Line, LineEnd, Numbering};
use crate::mixed::potential_offsets;
use faer::Mat;

/// Coordinates that differ by less than this share of the line's length are the same. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const ALIKE: f64 = 1e-12;

/// Whether a line is symmetric about its centre: its elements, their degrees and its ends.
pub fn is_symmetric(line: &Line) -> bool {
    let alike = |x: f64, y: f64| is_centre(line, 0.5 * (x + y));
    let ends = match line.ends {
        [LineEnd::Finite, LineEnd::Finite] => true,
        [LineEnd::Infinite { degree, pole }, LineEnd::Infinite { degree: other, pole: opposite }] => {
            degree == other && alike(pole, opposite)
        }
        _ => false,
    };
    ends && line.nodes.iter().zip(line.nodes.iter().rev()).all(|(x, y)| alike(*x, *y))
        && line.degrees.iter().eq(line.degrees.iter().rev())
}

/// Whether a coordinate is that of the centre of a line's nodes.
pub fn is_centre(line: &Line, x: f64) -> bool {
    match (line.nodes.first(), line.nodes.last()) {
        (Some(first), Some(last)) => (first + last - 2.0 * x).abs() <= ALIKE * (last - first),
        _ => false,
    }
}

/// The matrix that reflects the continuous functions of a symmetric line, in the order of [`Numbering`]. A
/// reflected function has the values of the function at the mirrored points.
pub fn reflected_functions(line: &Line) -> Mat<f64> {
    let numbering = Numbering::new(line);
    let elements = line.elements();
    let mut out = Mat::zeros(numbering.len, numbering.len);
    for (from, to) in numbering.vertex.iter().zip(numbering.vertex.iter().rev()) {
        out[(*to, *from)] = 1.0;
    }
    for e in 0..elements {
        let (from, to) = (numbering.bubble[e], numbering.bubble[elements - 1 - e]);
        for k in 0..line.degree(e) - 1 {
            out[(to + k, from + k)] = parity(k);
        }
    }
    out
}

/// The matrix that reflects the modes of the discontinuous potential of [`crate::mixed`] on the finite
/// elements of a symmetric line, as [`reflected_functions`] does for continuous functions.
pub fn reflected_modes(line: &Line) -> Mat<f64> {
    let offsets = potential_offsets(line);
    let elements = line.elements();
    let len = offsets[elements];
    let mut out = Mat::zeros(len, len);
    for e in (0..elements).filter(|e| matches!(line.element(*e), Element::Finite { .. })) {
        for n in 0..line.degree(e) {
            out[(offsets[elements - 1 - e] + n, offsets[e] + n)] = parity(n);
        }
    }
    out
}

/// 1 for an even degree and -1 for an odd one: the parity of Legendre polynomials, and of the functions
/// derived from them.
fn parity(n: usize) -> f64 {
    if n.is_multiple_of(2) { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::hierarchical;
    use crate::quadrature::legendre;

    fn line(degrees: [usize; 3]) -> Line {
        let far = LineEnd::Infinite { degree: 4, pole: 0.5 };
        Line { nodes: vec![-1.0, 0.25, 0.75, 2.0], degrees: degrees.to_vec(), ends: [far; 2] }
    }

    #[test]
    fn a_reflected_function_has_the_values_of_the_function_at_the_mirrored_points() {
        let line = line([3, 5, 3]);
        assert!(is_symmetric(&line));
        let numbering = Numbering::new(&line);
        let value = |function: &dyn Fn(usize) -> f64, e: usize, s: f64| -> f64 {
            let (values, _) = hierarchical(line.degree(e), s);
            let indices = numbering.element(&line, e);
            indices.iter().zip(values).filter_map(|(n, v)| Some(function((*n)?) * v)).sum()
        };
        let coefficient = |n: usize| 1.0 + (n * n % 7) as f64;
        let reflection = reflected_functions(&line);
        let reflected = |n: usize| (0..numbering.len).map(|m| reflection[(n, m)] * coefficient(m)).sum();
        for e in 0..line.elements() {
            for s in [-0.7, -0.1, 0.4] {
                let found = value(&reflected, e, s);
                let exact = value(&coefficient, line.elements() - 1 - e, -s);
                assert!((found - exact).abs() < 1e-13, "element {e} at {s}: {found} and {exact}");
            }
        }
    }

    #[test]
    fn a_reflected_mode_has_the_values_of_the_mode_at_the_mirrored_points() {
        let line = Line { ends: [LineEnd::Finite; 2], ..line([2, 4, 2]) };
        let offsets = potential_offsets(&line);
        let reflection = reflected_modes(&line);
        let value = |mode: &dyn Fn(usize) -> f64, e: usize, s: f64| -> f64 {
            legendre(line.degree(e) - 1, s).iter().enumerate().map(|(n, v)| mode(offsets[e] + n) * v).sum()
        };
        let coefficient = |n: usize| 1.0 + (n * n % 5) as f64;
        let reflected = |n: usize| (0..offsets[3]).map(|m| reflection[(n, m)] * coefficient(m)).sum();
        for e in 0..3 {
            let (found, exact) = (value(&reflected, e, 0.3), value(&coefficient, 2 - e, -0.3));
            assert!((found - exact).abs() < 1e-13, "element {e}: {found} and {exact}");
        }
    }

    #[test]
    fn a_line_with_other_degrees_or_nodes_on_either_side_is_not_symmetric() {
        assert!(!is_symmetric(&line([3, 5, 4])));
        let mut shifted = line([3, 5, 3]);
        shifted.nodes[1] += 1e-9;
        assert!(!is_symmetric(&shifted));
        let half_open = Line { ends: [LineEnd::Finite, line([3, 5, 3]).ends[1]], ..line([3, 5, 3]) };
        assert!(!is_symmetric(&half_open));
    }
}

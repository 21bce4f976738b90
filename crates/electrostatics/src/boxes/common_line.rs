//! The common refinement of two lines.

use elastocap_fem::line::{Line, LineEnd};

/// Two nodes closer than this share of the element next to them are the same but for rounding. Not tuned: it
/// only has to lie above rounding errors and below distances that matter.
const SAME: f64 = 1e-12;

/// The line with the nodes of both lines and, in every element, the larger of their degrees. `None` where the
/// lines do not begin and end at the same nodes.
pub(super) fn common_line(a: &Line, b: &Line) -> Option<Line> {
    let (mut i, mut j) = (0, 0);
    let (mut nodes, mut degrees) = (Vec::new(), Vec::new());
    let larger = |i: usize, j: usize| Some(*a.degrees.get(i)?.max(b.degrees.get(j)?));
    loop {
        let (x, y) = (*a.nodes.get(i)?, *b.nodes.get(j)?);
        let near = nodes.last().map_or(0.0, |last| x.max(y) - last);
        let apart = if (x - y).abs() <= SAME * near { std::cmp::Ordering::Equal } else { x.total_cmp(&y) };
        match apart {
            std::cmp::Ordering::Equal => {
                nodes.push(x);
                (i, j) = (i + 1, j + 1);
            }
            std::cmp::Ordering::Less => {
                nodes.push(x);
                i += 1;
            }
            std::cmp::Ordering::Greater => {
                nodes.push(y);
                j += 1;
            }
        }
        // Both must begin and end at the same nodes.
        match (i == a.nodes.len(), j == b.nodes.len()) {
            (true, true) => break,
            _ if i == 0 || j == 0 => return None,
            _ => degrees.push(larger(i - 1, j - 1)?),
        }
    }
    let end = |side: usize| match (a.ends[side], b.ends[side]) {
        (LineEnd::Finite, LineEnd::Finite) => Some(LineEnd::Finite),
        (LineEnd::Infinite { degree, pole }, LineEnd::Infinite { degree: other, pole: other_pole })
            if pole == other_pole =>
        {
            Some(LineEnd::Infinite { degree: degree.max(other), pole })
        }
        _ => None,
    };
    Some(Line { nodes, degrees, ends: [end(0)?, end(1)?] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_common_refinement_has_the_nodes_of_both_lines_and_the_larger_degrees() {
        let line = |nodes: &[f64], degrees: &[usize]| Line {
            nodes: nodes.to_vec(),
            degrees: degrees.to_vec(),
            ends: [LineEnd::Finite; 2],
        };
        let (a, b) = (line(&[0.0, 1.0, 3.0, 4.0], &[2, 5, 2]), line(&[0.0, 0.2, 1.0, 4.0], &[3, 4, 3]));
        let expected = line(&[0.0, 0.2, 1.0, 3.0, 4.0], &[3, 4, 5, 3]);
        assert_eq!(common_line(&a, &b), Some(expected.clone()));
        assert_eq!(common_line(&b, &a), Some(expected));
        // Nodes that differ by rounding are one.
        let rounded = line(&[0.0, 1.0 + 1e-15, 4.0], &[2, 2]);
        assert_eq!(common_line(&a, &rounded).map(|line| line.nodes), Some(a.nodes.clone()));
        // Lines that end elsewhere have none.
        for other in [line(&[0.5, 4.0], &[2]), line(&[0.0, 5.0], &[2]), line(&[0.0, 3.0], &[2])] {
            assert_eq!(common_line(&a, &other), None, "{other:?}");
            assert_eq!(common_line(&other, &a), None, "{other:?}");
        }
    }
}

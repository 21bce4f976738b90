//! The axes of a map: the breaks between its polynomial pieces and their degrees, merged from the pieces that
//! its parts need.

use elastocap_electrostatics::MapAxis;

/// An interval of an axis, m, in which a part of the map is a polynomial of this degree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Where the interval begins and ends.
    pub(super) ends: [f64; 2],
    /// The degree of the polynomial.
    pub(super) degree: usize,
}

impl Piece {
    /// A piece between two coordinates, m.
    pub(super) fn new(from: f64, to: f64, degree: usize) -> Self {
        Self { ends: [from, to], degree }
    }
}

/// The pieces of an axis.
pub(super) fn pieces(axis: &MapAxis) -> Vec<Piece> {
    let intervals = axis.breaks.windows(2).zip(&axis.degrees);
    intervals.map(|(ends, &degree)| Piece::new(ends[0], ends[1], degree)).collect()
}

/// The axis on which all `pieces` are polynomials: it breaks at the ends of each piece, and takes the largest
/// degree of overlapping ones. Breaks less than `tiny` (m) apart are merged. Of a `mirrored` axis, only the
/// half above 0 is described.
pub(super) fn joined(pieces: &[Piece], tiny: f64, mirrored: bool) -> MapAxis {
    let mut breaks: Vec<f64> = pieces.iter().flat_map(|piece| piece.ends).collect();
    if mirrored {
        breaks.push(0.0);
        breaks.retain(|x| *x >= 0.0);
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|next, last| *next - *last < tiny);
    let degree = |ends: &[f64]| {
        let middle = 0.5 * (ends[0] + ends[1]);
        let overlapping = pieces.iter().filter(|piece| piece.ends[0] < middle && middle < piece.ends[1]);
        overlapping.map(|piece| piece.degree).fold(1, usize::max)
    };
    let degrees = breaks.windows(2).map(degree).collect();
    MapAxis { breaks, degrees, mirrored }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_breaks_where_a_piece_ends_and_has_the_largest_degree_there() {
        let pieces = [Piece::new(-1.0, 2.0, 3), Piece::new(1.0, 4.0, 5), Piece::new(1.0 + 1e-9, 1.5, 2)];
        let axis = joined(&pieces, 1e-6, true);
        assert_eq!(axis.breaks, [0.0, 1.0, 1.5, 2.0, 4.0]);
        assert_eq!(axis.degrees, [3, 5, 5, 5]);
        let whole = joined(&pieces, 1e-6, false);
        assert_eq!((whole.breaks[0], whole.degrees[0]), (-1.0, 3));
    }
}

//! Changes of a graded axis: splitting elements, raising degrees, reflecting it, extending it.

use super::GradedAxis;
use elastocap_fem::line::LineEnd;

/// A change of one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// An increase of the degree by this much.
    Raise(usize),
    /// A new node at this share of the length of the element from its lower end.
    Split(f64),
}

impl GradedAxis {
    /// The interval in which element `e` lies.
    pub fn interval_of(&self, e: usize) -> usize {
        self.cuts.partition_point(|c| *c <= e) - 1
    }

    /// Whether element `e` touches an edge of a conductor at its lower and at its upper end.
    pub fn touches(&self, e: usize) -> [bool; 2] {
        let m = self.interval_of(e);
        [self.cuts[m] == e && self.edges[m], self.cuts[m + 1] == e + 1 && self.edges[m + 1]]
    }

    /// The length of element `e`, m; `None` if it is infinite.
    pub fn length(&self, e: usize) -> Option<f64> {
        let i = e.checked_sub(self.line.first_finite())?;
        Some(self.line.nodes.get(i + 1)? - self.line.nodes[i])
    }

    /// Carries out changes, each given with its element, in ascending order. Splits of infinite elements are
    /// ignored.
    pub fn change(&mut self, changes: &[(usize, Change)]) {
        let first = self.line.first_finite();
        for (e, change) in changes.iter().rev() {
            let finite = e.checked_sub(first).filter(|i| *i < self.line.degrees.len());
            match (*change, finite) {
                (Change::Raise(by), Some(i)) => self.line.degrees[i] += by,
                (Change::Raise(by), None) => {
                    if let LineEnd::Infinite { degree, .. } = &mut self.line.ends[usize::from(*e >= first)] {
                        *degree += by;
                    }
                }
                (Change::Split(share), Some(i)) => {
                    let (lo, hi) = (self.line.nodes[i], self.line.nodes[i + 1]);
                    let at =
                        if share < 0.5 { lo + share * (hi - lo) } else { hi - (1.0 - share) * (hi - lo) };
                    if !(lo < at && at < hi) {
                        continue;
                    }
                    let [below, above] = self.touches(*e);
                    let p = self.line.degrees[i];
                    self.line.nodes.insert(i + 1, at);
                    self.line.degrees.insert(i, p);
                    // The field is smoother in the part that no longer touches the edge.
                    if below != above {
                        self.line.degrees[if below { i + 1 } else { i }] += 1;
                    }
                    self.cuts.iter_mut().filter(|c| **c > *e).for_each(|c| *c += 1);
                }
                (Change::Split(_), None) => {}
            }
        }
    }

    /// The axis without its infinite elements.
    pub fn finite(mut self) -> Self {
        let (first, elements) = (self.line.first_finite(), self.line.degrees.len());
        self.cuts.iter_mut().for_each(|c| *c = c.saturating_sub(first).min(elements));
        self.line.ends = [LineEnd::Finite; 2];
        self
    }

    /// The axis and its mirror image below its lowest node, which must be at zero.
    pub fn reflected(&self) -> Self {
        let mut out = self.clone();
        let elements = self.line.elements();
        let mirror = |values: &[f64]| values.iter().skip(1).rev().map(|x| -x).collect::<Vec<f64>>();
        out.line.nodes = [mirror(&self.line.nodes), self.line.nodes.clone()].concat();
        let reversed: Vec<usize> = self.line.degrees.iter().rev().copied().collect();
        out.line.degrees = [reversed, self.line.degrees.clone()].concat();
        out.line.ends[0] = match self.line.ends[1] {
            LineEnd::Infinite { degree, pole } => LineEnd::Infinite { degree, pole: -pole },
            LineEnd::Finite => LineEnd::Finite,
        };
        let below = self.cuts.iter().skip(1).rev().map(|c| elements - c);
        out.cuts = below.chain(self.cuts.iter().map(|c| elements + c)).collect();
        let below = self.edges.iter().skip(1).rev();
        out.edges = below.chain(&self.edges).copied().collect();
        out
    }

    /// Moves the last node of an open side, 0 below or 1 above, to the distance `radius` from the pole. Adds
    /// an element where the outermost one would become much longer than those inside.
    pub fn reach_to(&mut self, side: usize, pole: f64, radius: f64) {
        // Largest distance of the outer end of an element from the pole, relative to that of its inner end.
        // Tuned: `cargo bench --bench targets`, the isolated cube.
        const LONGEST: f64 = 12.0;
        let n = self.line.nodes.len();
        let (outer, inner) = if side == 0 { (0, 1) } else { (n - 1, n - 2) };
        let at = if side == 0 { pole - radius } else { pole + radius };
        // The node is already there, up to rounding: a new element would have no length.
        if ((self.line.nodes[outer] - pole).abs() - radius).abs() <= 1e-9 * radius {
            self.line.nodes[outer] = at;
            return;
        }
        let from_pole = |k: usize| (self.line.nodes[k] - pole).abs();
        let extent = from_pole(inner).max(from_pole(outer) / LONGEST);
        // If the outermost finite element begins at a body, it stays, and a new element is added beyond it.
        let m = if side == 0 { 0 } else { self.cuts.len() - 2 };
        let is_alone = self.cuts[m + 1] - self.cuts[m] == 1;
        if radius > LONGEST * extent || is_alone {
            let degree = self.line.degrees[if side == 0 { 0 } else { n - 2 }];
            if side == 0 {
                self.line.nodes.insert(0, at);
                self.line.degrees.insert(0, degree);
                self.cuts[1..].iter_mut().for_each(|c| *c += 1);
            } else {
                self.line.nodes.push(at);
                self.line.degrees.push(degree);
                if let Some(last) = self.cuts.last_mut() {
                    *last += 1;
                }
            }
        } else {
            self.line.nodes[outer] = at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meshing::grid::{End, Plane, Resolution, graded_axis};

    fn axis() -> GradedAxis {
        let planes = [0.0, 1.0, 3.0].map(|at| Plane { at, edge: at == 1.0 });
        let resolution = Resolution { order: 3, levels: 1, ratio: 0.1, slope: 1.0, first: 2 };
        graded_axis(&planes, [End::Closed; 2], &resolution)
    }

    #[test]
    fn splitting_an_element_at_an_edge_keeps_the_low_degree_at_the_edge() {
        let mut a = axis();
        let e = a.cuts[1];
        assert_eq!(a.touches(e), [true, false]);
        let (elements, lower) = (a.line.elements(), a.line.nodes[e]);
        let length = a.length(e).unwrap();
        a.change(&[(e, Change::Split(0.1)), (e + 1, Change::Raise(2))]);
        assert_eq!(a.line.elements(), elements + 1);
        assert!((a.line.nodes[e + 1] - lower - 0.1 * length).abs() < 1e-15);
        assert_eq!(a.line.degrees[e..], [2, 3, 5]);
        assert_eq!((a.touches(e), a.touches(e + 1)), ([true, false], [false, false]));
    }

    #[test]
    fn a_reflected_axis_is_its_own_mirror_image() {
        let whole = axis().reflected();
        let n = whole.line.nodes.len();
        assert!((0..n).all(|i| whole.line.nodes[i] == -whole.line.nodes[n - 1 - i]));
        assert_eq!(whole.cuts.len(), 5);
        assert_eq!(whole.cuts[2], axis().line.elements());
        assert_eq!(whole.edges, [false, true, false, true, false]);
    }

    #[test]
    fn a_side_that_reaches_to_a_place_already_has_no_element_without_length() {
        let planes = [-1.0, 0.25].map(|at| Plane { at, edge: false });
        for (radius, levels) in [2.0, 3.0, 4.4, 20.0].into_iter().flat_map(|r| [(r, 0), (r, 1)]) {
            let resolution = Resolution { order: 3, levels, ratio: 0.13, slope: 1.0, first: 2 };
            let open = End::Open { pole: 0.1, reach: 2.0, radius };
            let mut axis = graded_axis(&planes, [open; 2], &resolution).finite();
            let elements = axis.line.elements();
            for (side, off) in [(0, 0.0), (1, f64::EPSILON), (1, -f64::EPSILON)] {
                axis.reach_to(side, 0.1, radius * (1.0 + off));
            }
            assert_eq!(axis.line.elements(), elements);
            assert!(axis.line.nodes.windows(2).all(|pair| pair[0] < pair[1]), "{:?}", axis.line.nodes);
        }
    }
}

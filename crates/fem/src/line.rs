//! One axis of a tensor-product grid: its elements, their degrees, and the 1D matrices on it.
//!
//! Each line carries two spaces. The *primal* one, continuous piecewise polynomials, holds potentials. The
//! *mixed* pair, the same continuous functions for one component of the flux and their derivatives for a
//! discontinuous potential, holds the Raviart-Thomas fluxes of Thomson's principle; see [`crate::mixed`].
//!
//! A line may run to infinity. The last element is then mapped by x = pole + reach / xi, 0 < xi <= 1, and
//! carries polynomials in xi that vanish at xi = 0: all integrals stay finite, the functions are admissible
//! in both variational principles on the whole space, and no truncation enters.

use crate::quadrature::{gauss_legendre, legendre};
use faer::Mat;

/// The kind of an end of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineEnd {
    /// The line ends at its outermost node.
    Finite,
    /// The line reaches infinity, by one more element of the given degree, mapped about `pole` (inside the
    /// line).
    Infinite {
        /// Degree of the mapped element, at least 1.
        degree: usize,
        /// Centre of the inversion, m.
        pole: f64,
    },
}

/// Elements of one axis, in ascending order; an infinite element, where there is one, counts as first or
/// last.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Finite nodes, strictly ascending, m.
    pub nodes: Vec<f64>,
    /// Polynomial degree of each finite element, at least 1; one fewer than nodes.
    pub degrees: Vec<usize>,
    /// The lower and the upper end.
    pub ends: [LineEnd; 2],
}

/// One element of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Element {
    /// `[start, start + length]`.
    Finite {
        /// Lower node, m.
        start: f64,
        /// Length, m.
        length: f64,
    },
    /// From `pole + reach` (reach < 0: downwards) to infinity.
    Infinite {
        /// Centre of the inversion, m.
        pole: f64,
        /// Signed distance of the first node from the pole, m.
        reach: f64,
    },
}

impl Line {
    /// Number of elements, infinite ones included.
    pub fn elements(&self) -> usize {
        self.degrees.len() + self.ends.iter().filter(|e| **e != LineEnd::Finite).count()
    }

    /// 1 if the first element is infinite, else 0: the index of the first finite element.
    pub fn first_finite(&self) -> usize {
        usize::from(self.ends[0] != LineEnd::Finite)
    }

    /// Polynomial degree of element `e`.
    pub fn degree(&self, e: usize) -> usize {
        let first = self.first_finite();
        let end_degree = |end: usize| match self.ends[end] {
            LineEnd::Infinite { degree, .. } => degree,
            LineEnd::Finite => 1,
        };
        if e < first {
            end_degree(0)
        } else if e - first < self.degrees.len() {
            self.degrees[e - first]
        } else {
            end_degree(1)
        }
    }

    /// The extent of element `e`.
    pub fn element(&self, e: usize) -> Element {
        let first = self.first_finite();
        let last = self.nodes.len() - 1;
        let infinite = |end: usize, node: f64| match self.ends[end] {
            LineEnd::Infinite { pole, .. } => Element::Infinite { pole, reach: node - pole },
            LineEnd::Finite => Element::Finite { start: node, length: 0.0 },
        };
        if e < first {
            infinite(0, self.nodes[0])
        } else if e - first < last {
            let i = e - first;
            Element::Finite { start: self.nodes[i], length: self.nodes[i + 1] - self.nodes[i] }
        } else {
            infinite(1, self.nodes[last])
        }
    }
}

/// Values and s-derivatives at `s` in [-1, 1] of the hierarchical basis of degree `p`: the two hats, then
/// `(L_j - L_{j-2}) / sqrt(2 (2 j - 1))`, j = 2..=p, whose stiffness is the identity.
pub fn hierarchical(p: usize, s: f64) -> (Vec<f64>, Vec<f64>) {
    let l = legendre(p, s);
    let mut value = vec![0.5 * (1.0 - s), 0.5 * (1.0 + s)];
    let mut slope = vec![-0.5, 0.5];
    for j in 2..=p {
        let k = (2 * j - 1) as f64;
        value.push((l[j] - l[j - 2]) / (2.0 * k).sqrt());
        slope.push((0.5 * k).sqrt() * l[j - 1]);
    }
    (value, slope)
}

/// Mass and stiffness of one element for unit coefficient, in the order lower vertex, upper vertex, bubbles.
///
/// For an infinite element the vertex at infinity has no function: its row and column are zero.
pub fn element_matrices(element: Element, p: usize) -> (Mat<f64>, Mat<f64>) {
    let mut mass = Mat::zeros(p + 1, p + 1);
    let mut stiffness = Mat::zeros(p + 1, p + 1);
    let (points, weights) = gauss_legendre(p + 2);
    for (&s, &w) in points.iter().zip(&weights) {
        let (value, slope) = hierarchical(p, s);
        // dx/ds, and the vertex at infinity, which has no function
        let (jacobian, skip) = match element {
            Element::Finite { length, .. } => (0.5 * length, None),
            Element::Infinite { reach, .. } => {
                // xi runs from 1 at the finite node to 0; s ascends with x on either side
                let (xi, far) = if reach > 0.0 { (0.5 * (1.0 - s), 1) } else { (0.5 * (1.0 + s), 0) };
                (0.5 * reach.abs() / (xi * xi), Some(far))
            }
        };
        for i in (0..=p).filter(|i| Some(*i) != skip) {
            for j in (0..=p).filter(|j| Some(*j) != skip) {
                mass[(i, j)] += w * jacobian * value[i] * value[j];
                stiffness[(i, j)] += w / jacobian * slope[i] * slope[j];
            }
        }
    }
    (mass, stiffness)
}

/// Numbering of the continuous functions of a line, in ascending order along it: vertex, bubbles of the
/// element above it, next vertex, and so on. A vertex at infinity has no function.
#[derive(Debug, Clone)]
pub struct Numbering {
    /// Index of the function of each finite node.
    pub vertex: Vec<usize>,
    /// First bubble of each element (infinite ones included).
    pub bubble: Vec<usize>,
    /// Number of functions.
    pub len: usize,
}

impl Numbering {
    /// Numbers the functions of `line`.
    pub fn new(line: &Line) -> Self {
        let (mut vertex, mut bubble, mut n) = (Vec::new(), Vec::new(), 0);
        for e in 0..line.elements() {
            if !(e == 0 && line.first_finite() == 1) {
                vertex.push(n);
                n += 1;
            }
            bubble.push(n);
            n += line.degree(e) - 1;
        }
        if line.ends[1] == LineEnd::Finite {
            vertex.push(n);
            n += 1;
        }
        Self { vertex, bubble, len: n }
    }

    /// Global index of each local function of element `e` (lower vertex, upper vertex, bubbles); `None` at
    /// infinity.
    pub fn element(&self, line: &Line, e: usize) -> Vec<Option<usize>> {
        let first = line.first_finite();
        // node below element e has index e - first
        let below = (e >= first).then(|| self.vertex[e - first]);
        let above = self.vertex.get(e + 1 - first).copied();
        let bubbles = (0..line.degree(e) - 1).map(|b| Some(self.bubble[e] + b));
        [below, above].into_iter().chain(bubbles).collect()
    }
}

/// Mass and stiffness of the continuous functions of a line, each weighted by a coefficient per element.
pub fn line_matrices(line: &Line, coefficient: &[f64]) -> (Mat<f64>, Mat<f64>) {
    let numbering = Numbering::new(line);
    let mut mass = Mat::zeros(numbering.len, numbering.len);
    let mut stiffness = Mat::zeros(numbering.len, numbering.len);
    for e in 0..line.elements() {
        let (m, k) = element_matrices(line.element(e), line.degree(e));
        let indices = numbering.element(line, e);
        for (i, gi) in indices.iter().enumerate() {
            for (j, gj) in indices.iter().enumerate() {
                if let (Some(gi), Some(gj)) = (gi, gj) {
                    mass[(*gi, *gj)] += coefficient[e] * m[(i, j)];
                    stiffness[(*gi, *gj)] += coefficient[e] * k[(i, j)];
                }
            }
        }
    }
    (mass, stiffness)
}

/// Integrals of `phi_i r phi_j'` (row i) and `r^2 phi_i' phi_j'` over the elements, each weighted by its
/// coefficient, with r the distance from `pole`: the terms of the energy of a potential that decays along
/// rays.
///
/// Infinite elements have none: their coefficient must be zero.
pub fn radial_matrices(line: &Line, coefficient: &[f64], pole: f64) -> (Mat<f64>, Mat<f64>) {
    let numbering = Numbering::new(line);
    let mut first = Mat::zeros(numbering.len, numbering.len);
    let mut second = Mat::zeros(numbering.len, numbering.len);
    for e in 0..line.elements() {
        let (Element::Finite { start, length }, p) = (line.element(e), line.degree(e)) else { continue };
        if coefficient[e] == 0.0 {
            continue;
        }
        let indices = numbering.element(line, e);
        let (points, weights) = gauss_legendre(p + 2);
        for (&s, &w) in points.iter().zip(&weights) {
            let (value, slope) = hierarchical(p, s);
            // dx/ds cancels in the first integral, and in the second against one of the two factors 2 /
            // length.
            let r = start + 0.5 * (s + 1.0) * length - pole;
            for (i, gi) in indices.iter().enumerate() {
                for (j, gj) in indices.iter().enumerate() {
                    if let (Some(gi), Some(gj)) = (gi, gj) {
                        first[(*gi, *gj)] += coefficient[e] * w * r * value[i] * slope[j];
                        second[(*gi, *gj)] += coefficient[e] * w * r * r * 2.0 / length * slope[i] * slope[j];
                    }
                }
            }
        }
    }
    (first, second)
}

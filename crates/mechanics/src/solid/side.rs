//! The surface of a mesh: sides of elements and their quadrature.

use std::collections::HashMap;

use elastocap_fem::quadrature::gauss_legendre;

use super::dimension::{Dimension, Numbering, Numbers, Plane, Space};
use super::mesh::Mesh;
use super::shape_functions::quadratic;

/// One side of an element that no other element shares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side<S: Dimension> {
    /// In the plane, the first end, the middle and the second end, with the material on the left. In space,
    /// node `3 b + a` is at `(a - 1, b - 1)` of the reference square, and the first direction, the second one
    /// and the outward normal are right-handed.
    pub nodes: S::SideNodes,
    /// The element that the side belongs to.
    pub element: u32,
}

impl<S: Dimension> Side<S> {
    /// The node in the middle of the side.
    pub(super) fn middle(&self) -> usize {
        let nodes = self.nodes.as_ref();
        nodes[nodes.len() / 2] as usize
    }
}

/// A side of a quadrilateral.
pub type BoundaryEdge = Side<Plane>;
/// A side of a hexahedron.
pub type BoundaryFace = Side<Space>;

/// A quadrature point of a side.
#[derive(Debug, Clone, PartialEq)]
pub struct SidePoint<S: Dimension> {
    /// Values of the shape functions of the side's nodes.
    pub shape: Vec<f64>,
    /// Reference position in m.
    pub position: S::Point,
    /// Outward unit normal of the reference configuration.
    pub normal: S::Point,
    /// Area that belongs to the point in m^2; in the plane, a length in m.
    pub weight: f64,
}

impl<S: Dimension> Mesh<S> {
    /// The sides that belong to one element only, without those that are collapsed into a point or line or
    /// are parts of a larger side of a neighbour.
    pub fn boundary(&self) -> Vec<Side<S>> {
        let middle = |nodes: &S::SideNodes| nodes.as_ref()[nodes.as_ref().len() / 2];
        let side = |element: &S::Nodes, side: &[usize]| S::SideNodes::from_fn(|n| element.as_ref()[side[n]]);
        // The number of sides with each middle node. Sides that are next to a larger or smaller one count
        // twice.
        let mut shared: HashMap<u32, u32> =
            self.hanging.sides.iter().flat_map(|s| [(s.fine.1, 1), (s.coarse.1, 1)]).collect();
        for element in &self.elements {
            for local in S::SIDES {
                *shared.entry(middle(&side(element, local))).or_default() += 1;
            }
        }
        let mut sides = Vec::new();
        for (e, element) in self.elements.iter().enumerate() {
            for local in S::SIDES {
                let nodes = side(element, local);
                let mut corners: Vec<u32> = S::SIDE_CORNERS.iter().map(|&k| nodes.as_ref()[k]).collect();
                corners.sort_unstable();
                corners.dedup();
                if corners.len() >= S::AXES && shared[&middle(&nodes)] == 1 {
                    sides.push(Side { nodes, element: e as u32 });
                }
            }
        }
        sides
    }

    /// The boundary sides all of whose nodes satisfy `on`.
    pub fn boundary_where(&self, on: impl Fn(S::Point) -> bool) -> Vec<Side<S>> {
        let is_on = |side: &Side<S>| side.nodes.as_ref().iter().all(|&n| on(self.nodes[n as usize]));
        self.boundary().into_iter().filter(is_on).collect()
    }

    /// The points of a Gauss rule with `n` points along each direction of `side`.
    pub fn side_points(&self, side: &Side<S>, n: usize) -> Vec<SidePoint<S>> {
        let nodes: Vec<S::Point> = side.nodes.as_ref().iter().map(|&n| self.nodes[n as usize]).collect();
        let (points, weights) = gauss_legendre(n);
        let line: Vec<_> = points.iter().map(|&s| quadratic(s)).collect();
        let directions = S::AXES - 1;
        (0..n.pow(directions as u32))
            .map(|q| {
                let at = [q % n, q / n];
                // The product of the values, with the slope instead of the value in the direction `slope`.
                let product = |a: usize, slope: Option<usize>| -> f64 {
                    let factor = |d: usize| {
                        let polynomial = &line[at[d]];
                        (if slope == Some(d) { polynomial.1 } else { polynomial.0 })[[a % 3, a / 3][d]]
                    };
                    (0..directions).map(factor).product()
                };
                let sum = |slope: Option<usize>| {
                    S::Point::from_fn(|k| (0..nodes.len()).map(|a| product(a, slope) * nodes[a][k]).sum())
                };
                let normal = S::normal(sum(Some(0)), sum(Some(1)));
                let size = normal.dot(&normal).sqrt();
                SidePoint {
                    shape: (0..nodes.len()).map(|a| product(a, None)).collect(),
                    position: sum(None),
                    normal: S::Point::from_fn(|k| normal[k] / size),
                    weight: size * (0..directions).map(|d| weights[at[d]]).product::<f64>(),
                }
            })
            .collect()
    }
}

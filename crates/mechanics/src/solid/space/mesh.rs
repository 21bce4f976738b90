//! Meshes of 27-node hexahedra, made by sweeping plane meshes along the third direction.
//!
//! A [`Sweep`] carries a plane mesh, the *section*, along breakpoints, and puts the result into its place by
//! a map. A fan of the section becomes a fan around an edge; its hexahedra are collapsed into wedges there.
//! Sweeps that share points share nodes.

use crate::solid::dimension::Space;
use crate::solid::mesh::{Mesh, Patch};
use crate::solid::nodes_by_place::NodesByPlace;

/// A plane mesh carried along the third direction.
pub struct Sweep<'a> {
    /// The mesh in the plane.
    pub section: &'a Mesh,
    /// The breakpoints of the third coordinate, ascending, in m.
    pub along: &'a [f64],
    /// Takes a point of the straight sweep to its place. Lines of three nodes should stay straight and evenly
    /// spaced where sweeps meet, so that both sides agree.
    pub map: &'a dyn Fn([f64; 3]) -> [f64; 3],
}

impl std::fmt::Debug for Sweep<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Sweep({} quadrilaterals, {} layers)", self.section.elements.len(), self.along.len() - 1)
    }
}

impl Mesh<Space> {
    /// The mesh of `sweeps`; points closer than `1e-9` of the extent are one node.
    pub fn from_sweeps(sweeps: &[Sweep<'_>]) -> Self {
        let mut mesh = Self::default();
        let placed: Vec<Vec<[f64; 3]>> = sweeps.iter().map(Sweep::points).collect();
        let extent = placed.iter().flatten().flatten().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let mut known = NodesByPlace::new(1e-9 * extent);
        for (sweep, points) in sweeps.iter().zip(&placed) {
            let number: Vec<u32> = points.iter().map(|p| known.node_at(*p)).collect();
            mesh.nodes.extend(&known.places()[mesh.nodes.len()..]);
            let plane = sweep.section.nodes.len();
            for layer in 0..sweep.along.len() - 1 {
                for quadrilateral in &sweep.section.elements {
                    let mut element: [u32; 27] = std::array::from_fn(|n| {
                        number[(2 * layer + n / 9) * plane + quadrilateral[n % 9] as usize]
                    });
                    if mesh.signed_volume(&element) < 0.0 {
                        element = std::array::from_fn(|n| element[n - n % 3 + (2 - n % 3)]);
                    }
                    mesh.elements.push(element);
                }
            }
        }
        mesh
    }

    /// A box `[0, x1] x [0, x2] x [0, x3]` cut at the given breakpoints (m).
    pub fn tensor(x1: &[f64], x2: &[f64], x3: &[f64]) -> Self {
        let section = Mesh::from_patches(&[Patch::tensor(x1, x2)]);
        Self::from_sweeps(&[Sweep { section: &section, along: x3, map: &|x| x }])
    }

    /// The triple product of the mean edges of an element along its three directions, whose sign tells
    /// whether the element is right-handed.
    fn signed_volume(&self, element: &[u32; 27]) -> f64 {
        let mean_edge = |axis: usize| -> [f64; 3] {
            let stride = [1, 3, 9][axis];
            let mut sum = [0.0; 3];
            for n in (0..27).filter(|n| n / stride % 3 != 1) {
                let sign = if n / stride % 3 == 2 { 1.0 } else { -1.0 };
                for k in 0..3 {
                    sum[k] += sign * self.nodes[element[n] as usize][k];
                }
            }
            sum
        };
        let (a, b, c) = (mean_edge(0), mean_edge(1), mean_edge(2));
        dot(cross(a, b), c)
    }
}

impl Sweep<'_> {
    /// Nodes of the sweep in their places, plane after plane: one plane at each breakpoint, and one in the
    /// middle between two breakpoints.
    fn points(&self) -> Vec<[f64; 3]> {
        (0..2 * self.along.len() - 1)
            .map(|k| 0.5 * (self.along[k / 2] + self.along[k.div_ceil(2)]))
            .flat_map(|x3| self.section.nodes.iter().map(move |x| (self.map)([x[0], x[1], x3])))
            .collect()
    }
}

/// The cross product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The scalar product.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::mesh::{geometric, uniform};

    /// A layer of unit thickness, 3 x 2 long, whose free sides have fans that meet in a mitre.
    fn mitred() -> Mesh<Space> {
        let fan = Patch::fan(
            [0.0, 0.0],
            &[[1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [0.5, 1.0], [0.0, 1.0]],
            &geometric(0.5, 1),
        );
        let fan = Mesh::from_patches(&[fan]);
        let body = Mesh::rectangle(2.0, 1.0, 2, 2);
        Mesh::from_sweeps(&[
            Sweep { section: &body, along: &uniform(0.0, 1.0, 2), map: &|x| x },
            Sweep {
                section: &fan,
                along: &uniform(0.0, 1.0, 2),
                map: &|x| [3.0 - x[0], x[1], x[2] * (2.0 - x[0])],
            },
            Sweep {
                section: &fan,
                along: &uniform(0.0, 2.0, 2),
                map: &|x| [x[2] * (3.0 - x[0]) / 2.0, x[1], 2.0 - x[0]],
            },
        ])
    }

    #[test]
    fn the_boundary_of_a_mitred_layer_is_closed_and_has_the_layers_area() {
        let mesh = mitred();
        let mut sum = [0.0; 3];
        let mut area = 0.0;
        for face in mesh.boundary() {
            let at = |n: usize| mesh.nodes[face.nodes[n] as usize];
            let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| a[k] - b[k]);
            // Flat quadrilaterals: half the cross product of the diagonals.
            let normal = cross(minus(at(8), at(0)), minus(at(6), at(2))).map(|x| 0.5 * x);
            area += dot(normal, normal).sqrt();
            for k in 0..3 {
                sum[k] += normal[k];
            }
            let centre = at(4);
            let out: [f64; 3] = minus(centre, [1.5, 0.5, 1.0]);
            assert!(dot(normal, out) > 0.0, "{face:?}");
        }
        assert!((area - 22.0).abs() < 1e-12, "{area}");
        assert!(sum.iter().all(|x| x.abs() < 1e-12), "{sum:?}");
    }
}

//! Cauchy stress of a state at the nodes, by way of the quadrature points as in [`crate::solid::stress`].

use rayon::prelude::*;

use super::element::{NODES, POINTS};
use crate::solid::dimension::{Element, Space};
use crate::solid::model::{Equations, State};
use crate::solid::shape_functions::linear_fit_weights;

pub use crate::solid::point_stress::SpaceStress;

impl Equations<Space> {
    /// The stress of `state` at each node of the mesh: the average of the elements around it, weighted by
    /// volume.
    ///
    /// # Panics
    /// If `state` is not one of this body.
    pub fn nodal_stress(&self, state: &State<Space>) -> Vec<SpaceStress> {
        let mesh = &self.body().mesh;
        let of_elements: Vec<[SpaceStress; NODES]> = (0..mesh.elements.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|e| self.element_stress(state, e))
            .collect();
        let mut nodal = vec![SpaceStress::default(); mesh.nodes.len()];
        let mut volume = vec![0.0; mesh.nodes.len()];
        for (e, values) in of_elements.iter().enumerate() {
            let weight = self.elements[e].volume();
            for (n, value) in mesh.elements[e].iter().zip(values) {
                nodal[*n as usize].add(weight, value);
                volume[*n as usize] += weight;
            }
        }
        for (value, volume) in nodal.iter_mut().zip(&volume) {
            let sum = std::mem::take(value);
            value.add(1.0 / volume, &sum);
        }
        nodal
    }

    /// Stress at the nodes of element `e`, from the trilinear fit to its quadrature points.
    fn element_stress(&self, state: &State<Space>, e: usize) -> [SpaceStress; NODES] {
        let (body, element) = (self.body(), &self.elements[e]);
        let rubber = &body.rubbers[body.material[e] as usize];
        let u = self.gather(e, &state.displacement);
        let at_points: [SpaceStress; POINTS] = std::array::from_fn(|q| {
            let f = element.deformation_gradient(q, &u);
            SpaceStress::new(rubber, &f, element.pressure_at(q, &state.pressure[e]))
        });
        std::array::from_fn(|n| {
            let line = [n % 3, n / 3 % 3, n / 9].map(linear_fit_weights);
            let mut sum = SpaceStress::default();
            for (q, value) in at_points.iter().enumerate() {
                sum.add(line[0][q % 3] * line[1][q / 3 % 3] * line[2][q / 9], value);
            }
            sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::dimension::Space;
    use crate::solid::mesh::Mesh;
    use crate::solid::model::Body;
    use elastocap_materials::Rubber;

    #[test]
    fn a_uniform_stress_is_found_at_every_node() {
        let rubber = Rubber::neo_hookean(2.0);
        let cuts = [0.0, 0.4, 1.0];
        let equations =
            Equations::new(Body::new(Mesh::<Space>::tensor(&cuts, &cuts, &cuts), rubber)).unwrap();
        // A pure stretch that keeps the volume: sigma = mu (F F' - 1) + p.
        let (stretch, p) = ([1.25, 0.8, 1.0], 0.3);
        let mut state = equations.body().at_rest();
        for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
            for k in 0..3 {
                state.displacement[3 * n + k] = (stretch[k] - 1.0) * x[k];
            }
        }
        state.pressure.fill([p, 0.0, 0.0, 0.0]);
        for stress in equations.nodal_stress(&state) {
            for (k, l) in stretch.iter().enumerate() {
                assert!((stress.cauchy[k] - 2.0 * (l * l - 1.0) - p).abs() < 1e-12, "{stress:?}");
            }
            assert!(stress.cauchy[3..].iter().all(|s| s.abs() < 1e-12) && (stress.j - 1.0).abs() < 1e-12);
        }
    }
}

//! Cauchy stress of a state at the nodes, by way of the quadrature points as in [`crate::solid::stress`].

use rayon::prelude::*;

use super::element::{NODES, POINTS};
use crate::solid::dimension::{Element, Space};
use crate::solid::model::{Equations, State};
use crate::solid::stress::on_a_line;
use elastocap_materials::Rubber;
use elastocap_materials::space::{Tensor, cofactor, determinant};

/// Stress and change of volume at a point. Tension is positive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpaceStress {
    /// Cauchy stress in Pa: 11, 22, 33, 12, 23, 13.
    pub cauchy: [f64; 6],
    /// `J`, deformed volume over reference volume.
    pub j: f64,
}

impl SpaceStress {
    /// The stress of `rubber` under the deformation gradient `f` with the pressure field at `pressure` (Pa, positive in
    /// tension; without effect where the rubber has no such field).
    pub fn new(rubber: &Rubber, f: &Tensor, pressure: f64) -> Self {
        let j = determinant(f);
        let mut stress = rubber.response(f).stress;
        if rubber.pressure_compliance().is_some() {
            for (s, c) in stress.iter_mut().zip(cofactor(f)) {
                *s += pressure * c;
            }
        }
        // sigma = P F' / J
        let entry = |i: usize, k: usize| (0..3).map(|m| stress[3 * i + m] * f[3 * k + m]).sum::<f64>() / j;
        Self { cauchy: [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(i, k)| entry(i, k)), j }
    }

    /// Minus the mean normal stress, in Pa: positive in compression.
    pub fn pressure(&self) -> f64 {
        -(self.cauchy[0] + self.cauchy[1] + self.cauchy[2]) / 3.0
    }

    /// `factor` times `other` is added.
    fn add(&mut self, factor: f64, other: &Self) {
        for (a, b) in self.cauchy.iter_mut().zip(&other.cauchy) {
            *a += factor * b;
        }
        self.j += factor * other.j;
    }
}

impl Equations<Space> {
    /// The stress of `state` at each node of the mesh: what the elements around it say, averaged by volume.
    ///
    /// # Panics
    /// If `state` is not one of this body.
    pub fn nodal_stress(&self, state: &State<Space>) -> Vec<SpaceStress> {
        let mesh = &self.body().mesh;
        let each: Vec<[SpaceStress; NODES]> = (0..mesh.elements.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|e| self.element_stress(state, e))
            .collect();
        let mut nodal = vec![SpaceStress::default(); mesh.nodes.len()];
        let mut volume = vec![0.0; mesh.nodes.len()];
        for (e, values) in each.iter().enumerate() {
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
            let line = [n % 3, n / 3 % 3, n / 9].map(on_a_line);
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
    use crate::solid::stress::PointStress;
    use elastocap_materials::{HyperelasticLaw, Volume};

    #[test]
    fn where_the_third_stretch_is_one_the_stress_is_that_of_plane_strain() {
        // Functions of one invariant, of both, and of the stretches; the laws themselves are tested with the materials.
        let laws = [
            HyperelasticLaw::Yeoh { constants: [0.5, -0.04, 0.02] },
            HyperelasticLaw::MooneyRivlin { c10: 0.2, c01: 0.5 },
            HyperelasticLaw::Ogden { terms: vec![(1.2, 1.3), (0.02, 5.0), (-0.1, -2.0)] },
        ];
        let volumes = [
            Volume::Incompressible,
            Volume::BulkModulus(30.0),
            Volume::LogLame(3.0),
            Volume::DisplacementOnly(7.0),
        ];
        let p = [1.2, 0.4, -0.1, 0.8];
        let f = [p[0], p[1], 0.0, p[2], p[3], 0.0, 0.0, 0.0, 1.0];
        for (distortion, volume) in laws.iter().flat_map(|d| volumes.map(|v| (d, v))) {
            let rubber = Rubber { distortion: distortion.clone(), volume, volume_barrier: 0.7 };
            // A bulk modulus' pressure is the field's only where the volume is the field's.
            let (plane, space) = (PointStress::new(&rubber, &p, 0.6), SpaceStress::new(&rubber, &f, 0.6));
            let expected = [plane.s11, plane.s22, plane.s33, plane.s12, 0.0, 0.0];
            for (a, b) in space.cauchy.iter().zip(expected) {
                assert!((a - b).abs() < 1e-12, "{rubber:?}: {:?} {expected:?}", space.cauchy);
            }
            assert!((space.pressure() - plane.pressure()).abs() < 1e-12 && (space.j - plane.j).abs() < 1e-15);
        }
    }

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

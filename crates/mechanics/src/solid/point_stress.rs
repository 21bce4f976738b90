//! Cauchy stress at a point, from the deformation gradient there and the pressure field.
//!
//! In plane strain `sigma = (2 w_I / J) F F^T + (w_J + p) 1` in the plane. The stress across the plane,
//! `sigma_33`, does not follow from `w(I, J)`, which does not depend on `F33`, but from the energy in three
//! dimensions.

use elastocap_materials::{Rubber, plane, space};

/// Stress and change of volume at a point in plane strain. Tension is positive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointStress {
    /// Cauchy stress `sigma_11` in Pa.
    pub s11: f64,
    /// Cauchy stress `sigma_22` in Pa.
    pub s22: f64,
    /// Cauchy stress `sigma_12` in Pa.
    pub s12: f64,
    /// Cauchy stress `sigma_33` in Pa, across the plane.
    pub s33: f64,
    /// `J`, deformed volume over reference volume.
    pub j: f64,
    /// Deformation gradient `[F11, F12, F21, F22]`.
    pub deformation: plane::Tensor,
}

impl PointStress {
    /// The stress of `rubber` under the in-plane deformation gradient `f` with the pressure field at
    /// `pressure` (Pa, positive in tension; without effect where the rubber has no such field).
    pub fn new(rubber: &Rubber, f: &plane::Tensor, pressure: f64) -> Self {
        let j = plane::determinant(f);
        let d = rubber.derivatives(f);
        let field = if rubber.pressure_compliance().is_some() { pressure } else { 0.0 };
        let (stretching, isotropic) = (2.0 * d.i / j, d.j + field);
        let s11 = stretching * (f[0] * f[0] + f[1] * f[1]) + isotropic;
        let s22 = stretching * (f[2] * f[2] + f[3] * f[3]) + isotropic;
        let s12 = stretching * (f[0] * f[2] + f[1] * f[3]);
        Self { s11, s22, s12, s33: rubber.third_normal_stress(f, &d, field, s11 + s22), j, deformation: *f }
    }

    /// Minus the mean normal stress, in Pa: positive in compression.
    pub fn pressure(&self) -> f64 {
        -(self.s11 + self.s22 + self.s33) / 3.0
    }

    /// The paper's `T = J F^-1 sigma` in Pa, `[T11, T12, T21, T22]`: `T_ij` acts on the reference face with
    /// normal `i` in direction `j`. Most books call it the nominal stress.
    pub fn nominal(&self) -> plane::Tensor {
        // J F^-1 is the cofactor transposed.
        let [a, b, c, d] = plane::cofactor(&self.deformation);
        [
            a * self.s11 + c * self.s12,
            a * self.s12 + c * self.s22,
            b * self.s11 + d * self.s12,
            b * self.s12 + d * self.s22,
        ]
    }

    /// Adds `factor` times `other`.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        self.s11 += factor * other.s11;
        self.s22 += factor * other.s22;
        self.s12 += factor * other.s12;
        self.s33 += factor * other.s33;
        self.j += factor * other.j;
        for (a, b) in self.deformation.iter_mut().zip(&other.deformation) {
            *a += factor * b;
        }
    }

    /// The sum of `values` with `weights`.
    pub(super) fn blend(values: &[Self], weights: &[f64]) -> Self {
        let mut sum = Self::default();
        for (value, weight) in values.iter().zip(weights) {
            sum.add(*weight, value);
        }
        sum
    }
}

/// Stress and change of volume at a point in space. Tension is positive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpaceStress {
    /// Cauchy stress in Pa: 11, 22, 33, 12, 23, 13.
    pub cauchy: [f64; 6],
    /// `J`, deformed volume over reference volume.
    pub j: f64,
}

impl SpaceStress {
    /// The stress of `rubber` under the deformation gradient `f` with the pressure field at `pressure` (Pa,
    /// positive in tension; without effect where the rubber has no such field).
    pub fn new(rubber: &Rubber, f: &space::Tensor, pressure: f64) -> Self {
        let j = space::determinant(f);
        let mut stress = rubber.response(f).stress;
        if rubber.pressure_compliance().is_some() {
            for (s, c) in stress.iter_mut().zip(space::cofactor(f)) {
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

    /// Adds `factor` times `other`.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        for (a, b) in self.cauchy.iter_mut().zip(&other.cauchy) {
            *a += factor * b;
        }
        self.j += factor * other.j;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_materials::{HyperelasticLaw, Volume};

    #[test]
    fn stress_turns_with_the_body() {
        let rubber = Rubber::neo_hookean(2.0);
        let (s, c) = 0.4f64.sin_cos();
        let f = [1.25, 0.3, 0.0, 0.8];
        let turned = [c * f[0] - s * f[2], c * f[1] - s * f[3], s * f[0] + c * f[2], s * f[1] + c * f[3]];
        let (a, b) = (PointStress::new(&rubber, &f, 0.1), PointStress::new(&rubber, &turned, 0.1));
        let s11 = c * c * a.s11 - 2.0 * s * c * a.s12 + s * s * a.s22;
        let s12 = s * c * (a.s11 - a.s22) + (c * c - s * s) * a.s12;
        assert!((b.s11 - s11).abs() + (b.s12 - s12).abs() + (b.s33 - a.s33).abs() < 1e-13);
    }

    #[test]
    fn where_the_third_stretch_is_one_the_stress_is_that_of_plane_strain() {
        // Functions of one invariant, of both, and of the stretches; the laws themselves are tested with the
        // materials.
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
}

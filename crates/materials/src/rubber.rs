//! A rubber: a law of distortion together with a law of volume, as energy, stress and tangent.

use crate::gent;
use crate::law::HyperelasticLaw;
use crate::plane::{self, EnergyDerivatives};
use crate::space::{self, Measure, Response};

/// How a material resists a change of volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volume {
    /// `J = 1`, enforced by a pressure field.
    Incompressible,
    /// `kappa/2 (J - 1)^2` with the bulk modulus `kappa` in Pa, and the pressure as a separate field.
    BulkModulus(f64),
    /// The compressible neo-Hookean solid `mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2` with `lambda` in Pa
    /// and the shear modulus of the law, whichever law that is. It has no pressure field and is for materials
    /// far from incompressible.
    LogLame(f64),
    /// `kappa/4 (J^2 - 1 - 2 ln J)` in addition to the distortion, with `kappa` in Pa and without a pressure
    /// field. Elements lock where `kappa/mu` is large.
    DisplacementOnly(f64),
    /// Nothing beside the law, which contains the volume: for [`HyperelasticLaw::Hyperfoam`]. It has no
    /// pressure field.
    OfLaw,
}

/// A rubber: how it distorts and how it changes volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Rubber {
    /// The law of distortion.
    pub distortion: HyperelasticLaw,
    /// The law of volume.
    pub volume: Volume,
    /// Factor of `mu (J - 1 - ln J)`, added to the energy of an *incompressible* rubber at every quadrature
    /// point.
    ///
    /// The term and its slope vanish where `J = 1`, so that it changes only the discretisation: it keeps `J`
    /// of single points from running to zero where the mesh is coarse, and suppresses wrinkles of the size of
    /// an element, which would stop Newton's method. [`Rubber::USUAL_BARRIER`] gives the smallest error on
    /// the closed form of the layer over 5 to 40 % compression.
    pub volume_barrier: f64,
}

impl Rubber {
    /// The [`Rubber::volume_barrier`] to use unless there is a reason for another one. Tuned:
    /// `cargo bench --bench mechanics`.
    pub const USUAL_BARRIER: f64 = 1.5;

    /// An incompressible neo-Hookean rubber with shear modulus `mu` in Pa and the usual barrier.
    pub fn neo_hookean(shear_modulus: f64) -> Self {
        Self::of_law(HyperelasticLaw::NeoHookean { shear_modulus }, None)
    }

    /// A rubber with this `bulk_modulus` in Pa or, without one, an incompressible rubber with the usual
    /// barrier. For a hyperfoam, whose law contains the volume, `bulk_modulus` is ignored.
    pub fn of_law(distortion: HyperelasticLaw, bulk_modulus: Option<f64>) -> Self {
        match bulk_modulus {
            _ if matches!(distortion, HyperelasticLaw::Hyperfoam { .. }) => {
                Self { distortion, volume: Volume::OfLaw, volume_barrier: 0.0 }
            }
            Some(kappa) => Self { distortion, volume: Volume::BulkModulus(kappa), volume_barrier: 0.0 },
            None => Self { distortion, volume: Volume::Incompressible, volume_barrier: Self::USUAL_BARRIER },
        }
    }

    /// Shear modulus at zero strain in Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.distortion.shear_modulus()
    }

    /// The compliance `1/kappa` in 1/Pa that the pressure field sees, or `None` if there is no such field.
    pub fn pressure_compliance(&self) -> Option<f64> {
        match self.volume {
            Volume::Incompressible => Some(0.0),
            Volume::BulkModulus(kappa) => Some(1.0 / kappa),
            Volume::LogLame(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => None,
        }
    }

    /// Whether the energy is defined where `J <= 0`, as that of an incompressible rubber without barrier
    /// whose law is a polynomial. Single points of an element can then turn inside out while the element
    /// keeps its volume.
    pub fn knows_inside_out(&self) -> bool {
        self.keeps_volume() && self.volume_barrier == 0.0 && self.distortion.is_polynomial()
    }

    fn keeps_volume(&self) -> bool {
        self.volume == Volume::Incompressible
    }

    /// Whether there is a limit of extension at which the energy becomes infinite; see
    /// [`Rubber::extension_left`].
    pub fn has_extension_limit(&self) -> bool {
        self.limiting_invariant().is_some()
    }

    /// The extension that is left at the in-plane tensor `f` before the limit of the law: 1 at rest, 0 or
    /// less where the energy is infinite. `None` for a law without limit.
    pub fn extension_left(&self, f: &plane::Tensor) -> Option<f64> {
        let i = f.iter().map(|x| x * x).sum::<f64>();
        let w = plane::first_invariant_for(i, plane::determinant(f), self.keeps_volume()).w;
        self.limiting_invariant().map(|limit| gent::margin(w, limit))
    }

    /// The extension that is left at the tensor `f` in three dimensions before the limit of the law; see
    /// [`Rubber::extension_left`].
    pub fn extension_left_in_space(&self, f: &space::Tensor) -> Option<f64> {
        let limit = self.limiting_invariant()?;
        let measure = Measure::first_invariant(f);
        Some(gent::margin(measure.distortion(space::determinant(f), self.keeps_volume()).w, limit))
    }

    fn limiting_invariant(&self) -> Option<f64> {
        match self.volume {
            // This solid uses nothing but the shear modulus of the law.
            Volume::LogLame(_) => None,
            Volume::Incompressible | Volume::BulkModulus(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => {
                self.distortion.limiting_invariant()
            }
        }
    }

    /// The part of the energy that follows from the displacement alone (all but the pressure field's) at the
    /// in-plane tensor `f`.
    ///
    /// `w` is infinite, and its derivatives are zero, where `J <= 0`, unless [`Rubber::knows_inside_out`],
    /// and beyond the [limit of extension](Rubber::extension_left).
    pub fn derivatives(&self, f: &plane::Tensor) -> EnergyDerivatives {
        let infinite = EnergyDerivatives { w: f64::INFINITY, ..Default::default() };
        let j = plane::determinant(f);
        if j.is_nan() || (j <= 0.0 && !self.knows_inside_out()) {
            return infinite;
        }
        let distortion = match self.volume {
            Volume::LogLame(_) => {
                // The classical form is not split: mu/2 (I1 - 3 - 2 ln J).
                let i = f.iter().map(|x| x * x).sum::<f64>();
                let mu = self.shear_modulus();
                Some(EnergyDerivatives {
                    w: 0.5 * mu * (i - 2.0) - mu * j.ln(),
                    i: 0.5 * mu,
                    j: -mu / j,
                    jj: mu / (j * j),
                    ..Default::default()
                })
            }
            Volume::Incompressible | Volume::BulkModulus(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => {
                self.distortion.in_plane(f, j, self.keeps_volume())
            }
        };
        let Some(mut d) = distortion else { return infinite };
        let volume = self.volume_derivatives(j);
        d.w += volume.w;
        d.j += volume.j;
        d.jj += volume.jj;
        d
    }

    /// The part of energy, stress and tangent that follows from the displacement alone (all but the pressure
    /// field's) at the deformation gradient `f`.
    ///
    /// The energy is infinite, and the rest is not to be used, where `J <= 0` and beyond the
    /// [limit of extension](Rubber::extension_left_in_space).
    pub fn response(&self, f: &space::Tensor) -> Response {
        let mut response = Response { energy: 0.0, stress: [0.0; 9], tangent: [[0.0; 9]; 9] };
        let j = space::determinant(f);
        if j.is_nan() || j <= 0.0 {
            response.energy = f64::INFINITY;
            return response;
        }
        let g = space::cofactor(f);
        let mut slope_by_j = 0.0;
        let mut add = |measure: &Measure, d: &EnergyDerivatives| {
            slope_by_j += d.j;
            response.add(measure, d, &g);
        };
        let finite = match self.volume {
            Volume::LogLame(_) => {
                // The classical form is not split: mu/2 (I1 - 3 - 2 ln J).
                let (mu, e) = (self.shear_modulus(), Measure::first_invariant(f));
                let w = 0.5 * mu * (e.value - 3.0) - mu * j.ln();
                let d =
                    EnergyDerivatives { w, i: 0.5 * mu, j: -mu / j, jj: mu / (j * j), ..Default::default() };
                add(&e, &d);
                Some(())
            }
            Volume::Incompressible | Volume::BulkModulus(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => {
                self.distortion.in_space(f, j, self.keeps_volume(), &mut add)
            }
        };
        if finite.is_none() {
            response.energy = f64::INFINITY;
            return response;
        }
        let d = self.volume_derivatives(j);
        slope_by_j += d.j;
        response.energy += d.w;
        for r in 0..9 {
            response.stress[r] += d.j * g[r];
            for c in 0..9 {
                response.tangent[r][c] += d.jj * g[r] * g[c];
            }
        }
        space::add_cofactor_slope(f, slope_by_j, &mut response.tangent);
        response
    }

    /// `sigma_33` in Pa in plane strain at `f`, from `J sigma_33 = dW/dF33` at `F33 = 1`: `w(I, J)` does not
    /// contain it.
    ///
    /// `d` are the [derivatives](Rubber::derivatives) at `f`, `field` is the pressure field in Pa (zero where
    /// the rubber has none) and `in_plane` is `sigma_11 + sigma_22` in Pa.
    pub fn third_normal_stress(
        &self,
        f: &plane::Tensor,
        d: &EnergyDerivatives,
        field: f64,
        in_plane: f64,
    ) -> f64 {
        let j = plane::determinant(f);
        match self.volume {
            // The distortion is a function of F / J^(1/3): its stress has no trace.
            Volume::BulkModulus(_) => 3.0 * field - in_plane,
            Volume::DisplacementOnly(kappa) => 1.5 * kappa * (j - 1.0 / j) - in_plane,
            // W = W(I1, J), of which w_I is the first derivative and w_J the other.
            Volume::LogLame(_) => 2.0 * d.i / j + (d.j + field),
            Volume::OfLaw => self.distortion.third_normal_stress(f, j, d, 0.0, 0.0),
            Volume::Incompressible => {
                let barrier = self.volume_barrier * self.shear_modulus() * (1.0 - 1.0 / j);
                self.distortion.third_normal_stress(f, j, d, field, barrier)
            }
        }
    }

    /// The volumetric part of the energy and its derivatives by `J`.
    fn volume_derivatives(&self, j: f64) -> EnergyDerivatives {
        let (w, slope, curvature) = match self.volume {
            Volume::Incompressible if self.volume_barrier == 0.0 => (0.0, 0.0, 0.0),
            Volume::Incompressible => {
                let b = self.volume_barrier * self.shear_modulus();
                (b * (j - 1.0 - (j - 1.0).ln_1p()), b * (1.0 - 1.0 / j), b / (j * j))
            }
            Volume::BulkModulus(_) | Volume::OfLaw => (0.0, 0.0, 0.0),
            Volume::LogLame(lambda) => {
                let log = j.ln();
                (0.5 * lambda * log * log, lambda * log / j, lambda * (1.0 - log) / (j * j))
            }
            Volume::DisplacementOnly(kappa) => (
                0.25 * kappa * (j * j - 1.0 - 2.0 * j.ln()),
                0.5 * kappa * (j - 1.0 / j),
                0.5 * kappa * (1.0 + 1.0 / (j * j)),
            ),
        };
        EnergyDerivatives { w, j: slope, jj: curvature, ..Default::default() }
    }
}

//! The laws of distortion, and what each of them contributes in the plane and in space.

use crate::hyperfoam::HyperfoamTerm;
use crate::mooney_rivlin::MooneyRivlin;
use crate::plane::{self, EnergyDerivatives};
use crate::space::{self, Measure};
use crate::{gent, ogden, yeoh};

/// A law of distortion: the strain energy of a rubber per reference volume, in Pa.
///
/// Where the volume can change, the energy is a function of `F / J^(1/3)`. An incompressible rubber takes it
/// as a function of `F` itself, less its slope at rest times `J - 1`. Where `J = 1` that is the same; for
/// Mooney-Rivlin, neo-Hookean and Yeoh rubbers it is a polynomial, so that the quadrature of the element is
/// exact.
#[derive(Debug, Clone, PartialEq)]
pub enum HyperelasticLaw {
    /// `W = mu/2 (I1 - 3)`.
    NeoHookean {
        /// Shear modulus `mu` in Pa.
        shear_modulus: f64,
    },
    /// `W = c10 (I1 - 3) + c01 (I2 - 3)`.
    MooneyRivlin {
        /// Factor of `I1 - 3` in Pa.
        c10: f64,
        /// Factor of `I2 - 3` in Pa.
        c01: f64,
    },
    /// `W = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3`.
    Yeoh {
        /// The factors `c10`, `c20`, `c30` in Pa.
        constants: [f64; 3],
    },
    /// `W = sum_p mu_p / alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3)`, so that `mu = sum mu_p alpha_p
    /// / 2`.
    Ogden {
        /// The pairs `(mu_p in Pa, alpha_p)`; no exponent may be zero.
        terms: Vec<(f64, f64)>,
    },
    /// `W = -mu/2 J_m ln(1 - (I1 - 3)/J_m)`, infinite from `I1 - 3 = J_m` on.
    Gent {
        /// Shear modulus `mu` in Pa.
        shear_modulus: f64,
        /// `J_m`, the value of `I1 - 3` at which the chains are fully extended; positive.
        limiting_invariant: f64,
    },
    /// The law of foams, which contains the volume: see [`hyperfoam`](crate::hyperfoam). It is used with
    /// [`Volume::OfLaw`](crate::Volume::OfLaw): its energy is not split into one of distortion and one of
    /// volume.
    Hyperfoam {
        /// The terms, each with a positive shear modulus.
        terms: Vec<HyperfoamTerm>,
    },
}

impl HyperelasticLaw {
    /// Shear modulus at zero strain in Pa.
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::NeoHookean { shear_modulus } | Self::Gent { shear_modulus, .. } => *shear_modulus,
            Self::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
            Self::Yeoh { constants } => 2.0 * constants[0],
            Self::Ogden { terms } => terms.iter().map(|(mu, alpha)| 0.5 * mu * alpha).sum(),
            Self::Hyperfoam { terms } => terms.iter().map(|term| term.shear_modulus).sum(),
        }
    }

    /// The constants of the law if it is a Mooney-Rivlin or neo-Hookean one: these have a closed form of the
    /// pressed layer.
    pub fn as_mooney_rivlin(&self) -> Option<MooneyRivlin> {
        match self {
            Self::NeoHookean { shear_modulus } => Some(MooneyRivlin::neo_hookean(*shear_modulus)),
            Self::MooneyRivlin { c10, c01 } => Some(MooneyRivlin { c10: *c10, c01: *c01 }),
            Self::Yeoh { .. } | Self::Ogden { .. } | Self::Gent { .. } | Self::Hyperfoam { .. } => None,
        }
    }

    /// Whether the energy of an incompressible rubber is a polynomial in `F`, so that it has a value where `J
    /// <= 0`.
    pub(crate) fn is_polynomial(&self) -> bool {
        match self {
            Self::NeoHookean { .. } | Self::MooneyRivlin { .. } | Self::Yeoh { .. } => true,
            Self::Ogden { .. } | Self::Gent { .. } | Self::Hyperfoam { .. } => false,
        }
    }

    /// The value of the first invariant less 3 from which on the energy is infinite, if there is one.
    pub(crate) fn limiting_invariant(&self) -> Option<f64> {
        match self {
            Self::Gent { limiting_invariant, .. } => Some(*limiting_invariant),
            Self::NeoHookean { .. }
            | Self::MooneyRivlin { .. }
            | Self::Yeoh { .. }
            | Self::Ogden { .. }
            | Self::Hyperfoam { .. } => None,
        }
    }

    /// Energy and derivatives in plane strain at `f` with `J = j > 0`; a polynomial law of a rubber that
    /// `keeps_volume` takes any `j`. `None` beyond the limit of the law, where the energy is infinite.
    pub(crate) fn in_plane(
        &self,
        f: &plane::Tensor,
        j: f64,
        keeps_volume: bool,
    ) -> Option<EnergyDerivatives> {
        let i = f.iter().map(|x| x * x).sum::<f64>();
        let first = || plane::first_invariant_for(i, j, keeps_volume);
        Some(match self {
            Self::NeoHookean { shear_modulus } => first().scaled(0.5 * shear_modulus),
            Self::MooneyRivlin { c10, c01 } => {
                let second = if keeps_volume {
                    plane::plain_second_invariant(i, j)
                } else {
                    plane::second_invariant(i, j)
                };
                first().scaled(*c10).plus(&second.scaled(*c01))
            }
            Self::Yeoh { constants } => {
                let first = first();
                first.chained(&yeoh::energy(first.w, constants))
            }
            Self::Ogden { terms } => {
                let powers = if keeps_volume { ogden::plain_stretch_powers } else { ogden::stretch_powers };
                let spread = stretch_spread(f);
                terms.iter().fold(EnergyDerivatives::default(), |sum, (mu, alpha)| {
                    sum.plus(&powers(spread, j, *alpha).scaled(mu / alpha))
                })
            }
            Self::Gent { shear_modulus, limiting_invariant } => {
                let first = first();
                first.chained(&gent::energy(first.w, *shear_modulus, *limiting_invariant)?)
            }
            Self::Hyperfoam { terms } => {
                let spread = stretch_spread(f);
                terms.iter().fold(EnergyDerivatives::default(), |sum, term| {
                    let powers = ogden::plain_stretch_powers(spread, j, term.exponent);
                    sum.plus(&powers.plus(&term.volume_part(j)).scaled(term.scale()))
                })
            }
        })
    }

    /// Calls `add` with each measure of deformation at `f` that the energy depends on, and with the energy's
    /// derivatives by that measure and by `J = j > 0`. `None`, and nothing added, beyond the limit of the
    /// law, where the energy is infinite.
    pub(crate) fn in_space(
        &self,
        f: &space::Tensor,
        j: f64,
        keeps_volume: bool,
        add: &mut dyn FnMut(&Measure, &EnergyDerivatives),
    ) -> Option<()> {
        match self {
            Self::NeoHookean { shear_modulus } => {
                let e = Measure::first_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(0.5 * shear_modulus));
            }
            Self::MooneyRivlin { c10, c01 } => {
                let e = Measure::first_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(*c10));
                let e = Measure::second_invariant(f);
                add(&e, &e.distortion(j, keeps_volume).scaled(*c01));
            }
            Self::Yeoh { constants } => {
                let e = Measure::first_invariant(f);
                let first = e.distortion(j, keeps_volume);
                add(&e, &first.chained(&yeoh::energy(first.w, constants)));
            }
            Self::Ogden { terms } => {
                for (mu, alpha) in terms {
                    let e = Measure::power_sum(f, *alpha);
                    add(&e, &e.distortion(j, keeps_volume).scaled(mu / alpha));
                }
            }
            Self::Gent { shear_modulus, limiting_invariant } => {
                let e = Measure::first_invariant(f);
                let first = e.distortion(j, keeps_volume);
                add(&e, &first.chained(&gent::energy(first.w, *shear_modulus, *limiting_invariant)?));
            }
            Self::Hyperfoam { terms } => {
                for term in terms {
                    let e = Measure::power_sum(f, term.exponent);
                    add(&e, &e.distortion(j, true).plus(&term.volume_part(j)).scaled(term.scale()));
                }
            }
        }
        Some(())
    }

    /// `sigma_33` in Pa of an *incompressible* rubber or of a hyperfoam in plane strain, from `J sigma_33 =
    /// dW/dF33` at `F33 = 1`.
    ///
    /// `d` are the derivatives of the whole energy at `f` with `J = j`; `field` is the pressure field and
    /// `barrier` the slope of the volume barrier by `J`, both in Pa.
    pub(crate) fn third_normal_stress(
        &self,
        f: &plane::Tensor,
        j: f64,
        d: &EnergyDerivatives,
        field: f64,
        barrier: f64,
    ) -> f64 {
        let volumetric = d.j + field;
        match self {
            // W = W(I1, J), of which w_I is the first derivative and w_J the other.
            Self::NeoHookean { .. } | Self::Yeoh { .. } | Self::Gent { .. } => 2.0 * d.i / j + volumetric,
            // dI2/dF33 = 2 I. The 2 J that I2 = I + J^2 contributes to w_J does not belong here.
            Self::MooneyRivlin { c10, c01 } => {
                let i = f.iter().map(|x| x * x).sum::<f64>();
                2.0 * (c10 + c01 * i) / j + volumetric - 2.0 * j * c01
            }
            // In each term only l3^alpha - alpha (J - 1) depends on F33. The barrier and the field depend on
            // J.
            Self::Ogden { terms } => {
                let sum: f64 = terms.iter().map(|(mu, _)| mu).sum();
                sum * (1.0 - j) / j + barrier + field
            }
            // In each term F33 enters as l3^a and through J in the volume part, here without the a (J - 1)
            // that `volume_part` adds to it.
            Self::Hyperfoam { terms } => {
                let stress = |term: &HyperfoamTerm| {
                    let volume = term.volume_part(j).j - term.exponent;
                    term.scale() * (term.exponent / j + volume)
                };
                terms.iter().map(stress).sum()
            }
        }
    }
}

/// `I - 2J` in the plane without cancellation: it vanishes where the two stretches agree.
fn stretch_spread(f: &plane::Tensor) -> f64 {
    (f[0] - f[3]).powi(2) + (f[1] + f[2]).powi(2)
}

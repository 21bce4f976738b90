//! The deformation of the layer: sections 2.1, 2.2 and 2.6 of the paper.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use nalgebra::Matrix3;

use super::phase::{Phase, stretch_excess};
use crate::error::{MechanicsError, require_positive};
use crate::numerics::integrate_from_zero;

/// The deformation of the compressed layer, `y = (x1 f(x2), g(x2), x3)` (10).
///
/// Points are given by their reference coordinates in metres. The formulas hold for `0 <= x2 <= H`; a point a
/// rounding error outside is mapped smoothly, one far outside has no meaning and may give `NaN`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerMap {
    /// Reference thickness `H` in m.
    thickness: f64,
    /// The state of compression.
    phase: Phase,
}

impl LayerMap {
    /// The deformation of a layer of reference `thickness` `H` (m) under a `compression` `U/H` in `[0, 1)`.
    ///
    /// # Errors
    /// [`MechanicsError::NotPositive`] for the thickness, [`MechanicsError::Compression`] for the
    /// compression.
    pub fn new(thickness: f64, compression: f64) -> Result<Self, MechanicsError> {
        let thickness = require_positive("thickness of the layer", thickness, "m")?;
        Ok(Self { thickness, phase: Phase::from_compression(compression)? })
    }

    pub(crate) fn from_phase(thickness: f64, phase: Phase) -> Self {
        Self { thickness, phase }
    }

    pub(crate) fn phase(&self) -> &Phase {
        &self.phase
    }

    /// Reference thickness `H` in m.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Compression `U/H`, without unit.
    pub fn compression(&self) -> f64 {
        self.phase.compression
    }

    /// Displacement `U` of the top surface towards the substrate, in m; never negative.
    pub fn top_displacement(&self) -> f64 {
        self.thickness * self.phase.compression
    }

    /// Deformed thickness `h = H - U` in m.
    pub fn deformed_thickness(&self) -> f64 {
        self.thickness * self.phase.thickness_ratio
    }

    /// Phase angle `theta = alpha H` in rad, in `[0, pi/2)` (40).
    pub fn theta(&self) -> f64 {
        self.phase.theta
    }

    /// Wave number `alpha = theta / H` in 1/m (34).
    pub fn alpha(&self) -> f64 {
        self.phase.theta / self.thickness
    }

    /// Stretch of the top surface, `lambda = f(H) = 1 / cos(theta)` (36).
    pub fn lambda(&self) -> f64 {
        self.phase.lambda()
    }

    /// `n = asinh(tan theta)` (46).
    pub fn n(&self) -> f64 {
        self.phase.n
    }

    /// Stretch `f` along `x1` of the fibres at reference height `x2` (m), from (37); at least 1.
    pub fn stretch(&self, x2: f64) -> f64 {
        let (sin, cos) = (self.alpha() * x2).sin_cos();
        cos + self.phase.n.sinh() * sin
    }

    /// `f(x2) - 1`, with all its digits when the compression is tiny.
    pub fn stretch_excess(&self, x2: f64) -> f64 {
        stretch_excess(self.phase.theta, self.phase.n, self.alpha() * x2)
    }

    /// Slope `f'(x2)` of the stretch in 1/m; zero at the top.
    pub fn stretch_slope(&self, x2: f64) -> f64 {
        let alpha = self.alpha();
        alpha * (alpha * (self.thickness - x2)).sin() * self.lambda()
    }

    /// Deformed height `g(x2)` in m of the plane at reference height `x2` (m), from (38).
    ///
    /// (38) is a difference of logarithms; here it is one logarithm of a ratio, written as a sum of two
    /// positive parts, so that heights close to the substrate keep their digits.
    pub fn height(&self, x2: f64) -> f64 {
        let n = self.phase.n;
        if n == 0.0 {
            return x2;
        }
        let tangent = (0.5 * self.alpha() * x2).tan();
        let difference = (n.exp() * tangent).ln_1p() - (-(-n).exp() * tangent).ln_1p();
        difference / (self.alpha() * n.cosh())
    }

    /// Slope `g'(x2) = 1 / f(x2)`, the stretch along `x2` (constant volume), without unit.
    pub fn height_slope(&self, x2: f64) -> f64 {
        1.0 / self.stretch(x2)
    }

    /// Deformed position `y` (m) of the point with reference position `x` (m) (10).
    pub fn deform(&self, x: [f64; 3]) -> [f64; 3] {
        [x[0] * self.stretch(x[1]), self.height(x[1]), x[2]]
    }

    /// Displacement `y - x` (m) of the point with reference position `x` (m).
    ///
    /// Accurate relative to itself also when the compression is tiny.
    pub fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        let sideways = x[0] * self.stretch_excess(x[1]);
        let up = if self.phase.is_small() {
            -integrate_from_zero(x[1], |s| {
                let excess = self.stretch_excess(s);
                excess / (1.0 + excess)
            })
        } else {
            self.height(x[1]) - x[1]
        };
        [sideways, up, 0.0]
    }

    /// Deformation gradient `F` at reference position `x` (m), `F_ij = dy_i / dx_j` (11); its determinant is
    /// 1.
    pub fn deformation_gradient(&self, x: [f64; 3]) -> Matrix3<f64> {
        let stretch = self.stretch(x[1]);
        let shear = x[0] * self.stretch_slope(x[1]);
        Matrix3::new(stretch, shear, 0.0, 0.0, 1.0 / stretch, 0.0, 0.0, 0.0, 1.0)
    }
}

//! The shear length `L` of the closed form, from finite elements.
//!
//! The closed form knows the pressure only up to the constant `B`, and (45) gives `B` if one knows over which
//! length `L` from the axis the bonded bottom carries the closed form's shear stress. At the end of the layer
//! or of the punch the closed form is wrong, so that `L` must come from elsewhere. Each of two conditions
//! gives it in closed form from a force of the finite elements:
//!
//! - **Balance**, (43) of the paper: the compressive force `N` through the cross-section `x1 = 0` is that of
//!   the finite elements, `L^2 = 2 N / (mu alpha tan(theta))`. `B`, and with it the stress around the axis,
//!   where the electrodes are, is then right in the mean over the section. This is the `L` of (45).
//! - **Force**: the force (50) on the contact is that of the finite elements. This shifts `B` by the error of
//!   the closed form's pressure profile at the edge of the contact; the curve C(F) is then right in F, the
//!   stress less so.
//!
//! `L/H` depends on `U/H`, on the contact's half-length over `H`, and on the layer outside the contact. It
//! does not depend on the material as long as the rubber is an incompressible neo-Hookean or Mooney-Rivlin
//! one.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

use super::forecast::MeshSize;
use super::layer::{End, Indenter, LayerMesh, LayerModel, LayerStep, PunchFan};
use super::layer_mesh::check_elements;
use super::mesh::{geometric, uniform};
use super::model::{ModelError, State};
use super::newton::{NewtonSettings, Stopped};
use super::stress::Fields;
use crate::closed_form::{ForceCurve, Phase, shear_ratio_for_axial_force};
use crate::error::MechanicsError;
use elastocap_materials::Rubber;

/// The shear length of one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShearLength {
    /// `U/H`.
    pub compression: f64,
    /// `L/H` from the balance along `x1`, eq. (43). `None` without compression, and where the section `x1 =
    /// 0` pulls.
    pub from_balance: Option<f64>,
    /// `L/H` from the force, eq. (50). `None` without compression, and where the force is below what the
    /// closed form gives with no shear at all on the bottom.
    pub from_force: Option<f64>,
    /// Compressive force `N` through the cross-section `x1 = 0` over `mu H`, per width.
    pub axial_force: f64,
    /// Force of the indenter on both halves of the layer, over `mu H`, per width.
    pub force: f64,
}

impl ShearLength {
    /// The shear length of `model` after `step`, for a contact of half-length `contact_half_length` (m).
    ///
    /// # Errors
    /// [`MechanicsError::Compression`] if that of the step is not in `[0, 1)`.
    pub fn of(
        model: &LayerModel,
        step: &LayerStep,
        contact_half_length: f64,
    ) -> Result<Self, MechanicsError> {
        let body = model.equations().body();
        let thickness = body.mesh.nodes.iter().fold(0.0, |m: f64, x| m.max(x[1]));
        let unit = body.rubbers.first().map_or(f64::NAN, Rubber::shear_modulus) * thickness;
        let axial_force = model.equations().reaction(0, |x| x[0] == 0.0) / unit;
        Self::from_forces(step.compression, contact_half_length / thickness, axial_force, step.force / unit)
    }

    /// The shear length with which the closed form has these forces (over `mu H`, per width) at the
    /// compression `U/H` on a contact of half-length `contact_ratio` (over `H`).
    ///
    /// # Errors
    /// [`MechanicsError::Compression`] if it is not in `[0, 1)`.
    pub fn from_forces(
        compression: f64,
        contact_ratio: f64,
        axial_force: f64,
        force: f64,
    ) -> Result<Self, MechanicsError> {
        let phase = Phase::from_compression(compression)?;
        let mean = force / (2.0 * contact_ratio);
        Ok(Self {
            compression,
            from_balance: shear_ratio_for_axial_force(&phase, axial_force),
            from_force: ForceCurve::shear_ratio_for(&phase, contact_ratio, mean),
            axial_force,
            force,
        })
    }
}

/// The load on the top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contact {
    /// The whole top of a layer of this half-length over its thickness.
    WholeTop(f64),
    /// A held patch of this half-width over the thickness that is moved down without friction, on a layer
    /// that continues beyond it: the model of a punch in Figs. 4, 6 and 7 of the paper and in the closed
    /// form. A punch of that width in contact needs less force, since the rubber under it slides around its
    /// corners.
    Punch(f64),
}

/// The fans of elements around the singular corner at the end of the layer or of the punch, from fine to
/// coarse: the ratio in which the rings of each shrink, and their number. With a finer fan the result is more
/// exact, but the solver stops at a smaller compression. Measured:
/// `cargo run --release -p elastocap-mechanics --example shear_length`.
pub const FANS: [(f64, usize); 3] = [(0.5, 5), (0.7, 6), (0.5, 1)];

/// Length of the layer beyond the punch, in thicknesses. Four would make `L` shorter by 0.2 %, eight longer
/// by 0.01 %. Measured: `cargo run --release -p elastocap-mechanics --example shear_length`.
pub const LENGTH_BEYOND_PUNCH: f64 = 6.0;

impl Contact {
    /// Half-length of the contact over the thickness.
    pub fn half_length(self) -> f64 {
        let (Self::WholeTop(ratio) | Self::Punch(ratio)) = self;
        ratio
    }

    /// The layer, of thickness 1 m and shear modulus 1 Pa, with about `n` quadrilaterals over the thickness
    /// and `fan` of [`FANS`] at the singular corner. Under a punch it continues for [`LENGTH_BEYOND_PUNCH`]
    /// thicknesses beyond it.
    ///
    /// # Errors
    /// See [`ModelError`]; the half-length must be larger than 1 under the whole top, and positive.
    pub fn model(self, n: usize, end: End, fan: (f64, usize)) -> Result<LayerModel, ModelError> {
        let rubber = Rubber::neo_hookean(1.0);
        match self {
            Self::WholeTop(half_length) => {
                let mesh = LayerMesh::uniform(1.0, half_length, n, fan.0, fan.1);
                check_elements(mesh.elements_at_most())?;
                LayerModel::new(&mesh, rubber, Indenter::WholeTop, end)
            }
            Self::Punch(half_width) => {
                let mesh = under_punch(half_width, n, fan);
                check_elements(mesh.elements_at_most())?;
                LayerModel::new(&mesh, rubber, Indenter::Held { half_width }, end)
            }
        }
    }
}

/// The sizes of the meshes that [`shear_lengths`] solves on at the same time, one for each of [`FANS`].
///
/// # Errors
/// See [`ModelError`].
pub fn mesh_sizes(contact: Contact, end: End, n: usize) -> Result<Vec<MeshSize>, ModelError> {
    let size = |fan: &(f64, usize)| -> Result<MeshSize, ModelError> {
        let model = contact.model(n, end, *fan)?;
        let mesh = &model.equations().body().mesh;
        let elements = mesh.elements.len();
        Ok(MeshSize { elements, unknowns: 2 * mesh.nodes.len() + 3 * elements })
    };
    FANS.iter().map(size).collect()
}

/// A mesh of a layer of thickness 1 under a punch of any half-width, [`LENGTH_BEYOND_PUNCH`] thicknesses
/// longer than the punch.
///
/// The fan around the end of the punch is as wide as fits between it and the axis, half a thickness at most.
fn under_punch(corner: f64, n: usize, (ratio, rings): (f64, usize)) -> LayerMesh {
    let radius = corner.min(0.5);
    let (left, right, low) = (corner - radius, corner + radius, 1.0 - radius);
    let count = |length: f64| ((length * n as f64).round() as usize).max(1);
    // Around a narrow punch the quadrilaterals are as small as the punch requires.
    let fine = count(radius).max(n / 2).max(2);
    let mut along = if left > 0.0 { uniform(0.0, left, count(left)) } else { vec![0.0] };
    let first = along.len() - 1;
    along.extend(uniform(left, right, 2 * fine).iter().skip(1));
    let last = along.len() - 1;
    let body = corner + LENGTH_BEYOND_PUNCH - 1.0;
    along.extend(uniform(right, body, count(0.6 * (body - right))).iter().skip(1));
    let mut up = uniform(0.0, low, count(low));
    let floor = up.len() - 1;
    up.extend(uniform(low, 1.0, fine).iter().skip(1));
    let (along_fan, radii) = ([first, last], geometric(ratio, rings));
    let punch = PunchFan { along: along_fan, up: floor, corner, radii };
    let end_top = uniform(body, body + 1.0, count(0.6));
    LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: Some(punch) }
}

/// Shear lengths over the compression for one contact, with the states they are from.
#[derive(Debug)]
pub struct ShearLengths {
    /// The contact.
    pub contact: Contact,
    /// The layer, once for each of [`FANS`] that was used.
    pub models: Vec<LayerModel>,
    /// The results, one for each compression that was reached.
    pub points: Vec<StudiedPoint>,
    /// The relative differences of `from_balance` and of the force between the coarsest fan and the finest
    /// one that got equally far, at the largest compression that the coarsest and a finer fan both reached.
    /// They indicate the errors of the points that only the coarsest fan reached.
    pub disagreement: Option<[f64; 2]>,
    /// Why not all compressions were reached.
    pub stopped: Option<Box<Stopped>>,
}

/// One compression of [`ShearLengths`].
#[derive(Debug, Clone)]
pub struct StudiedPoint {
    /// The shear length.
    pub shear: ShearLength,
    /// Index in [`FANS`] and in [`ShearLengths::models`] of the finest fan that reached the compression.
    pub fan: usize,
    /// The state of that model.
    pub state: State,
}

impl ShearLengths {
    /// The point at `compression`, if it was reached.
    pub fn at(&self, compression: f64) -> Option<&StudiedPoint> {
        self.points.iter().find(|p| (p.shear.compression - compression).abs() < 1e-9)
    }

    /// Displacement and stress of a point.
    pub fn fields<'a>(&'a self, point: &'a StudiedPoint) -> Fields<'a> {
        self.models[point.fan].equations().fields(&point.state)
    }
}

/// The shear lengths at the ascending `compressions` under `contact`, with about `n` quadrilaterals over the
/// thickness (8 will do: the fan at the corner matters more). A coarser fan is used where a finer one stops.
/// `cancel` stops the work before the next linear system; the results so far are kept.
///
/// # Errors
/// See [`ModelError`]. Where the solver stops, the other compressions are left out and the reason is in the
/// result.
pub fn shear_lengths(
    contact: Contact,
    end: End,
    compressions: &[f64],
    n: usize,
    cancel: Option<&AtomicBool>,
) -> Result<ShearLengths, ModelError> {
    // Smaller load steps would take too long.
    let settings = NewtonSettings { smallest_step: 1e-2, cancel, ..NewtonSettings::default() };
    let run = |fan: (f64, usize)| -> Result<_, ModelError> {
        let mut model = contact.model(n, end, fan)?;
        let mut points = Vec::new();
        for compression in compressions {
            let step = match model.press(*compression, &settings) {
                Ok(step) => step,
                Err(stopped) => return Ok((model, points, Some(stopped))),
            };
            let Ok(shear) = ShearLength::of(&model, &step, contact.half_length()) else { break };
            points.push((shear, model.state().clone()));
        }
        Ok((model, points, None))
    };
    let runs = FANS.par_iter().map(|fan| run(*fan)).collect::<Result<Vec<_>, _>>()?;
    let mut lengths =
        ShearLengths { contact, models: Vec::new(), points: Vec::new(), disagreement: None, stopped: None };
    for (fan, (model, points, stopped)) in runs.into_iter().enumerate() {
        for (k, (shear, state)) in points.into_iter().enumerate() {
            if let Some(finer) = lengths.points.get(k) {
                let relative = |a: f64, b: f64| (b / a - 1.0).abs();
                let pair = finer.shear.from_balance.zip(shear.from_balance);
                let difference =
                    pair.map(|(a, b)| [relative(a, b), relative(finer.shear.force, shear.force)]);
                lengths.disagreement = difference.or(lengths.disagreement);
            } else {
                lengths.points.push(StudiedPoint { shear, fan, state });
            }
        }
        lengths.models.push(model);
        lengths.stopped = stopped;
    }
    if lengths.points.len() == compressions.len() {
        lengths.stopped = None;
    }
    Ok(lengths)
}

//! Errors of the mechanical models as shares of the change of a capacitance: upper estimates of the results
//! of `benches/model_errors.py`.

use elastocap_case::{Case, Indenter, Layer, Mechanics, Stiffness};
use elastocap_geometry::scene::Purpose;

/// Largest ratio of the shear modulus of a pair to that of the layer at which the pair follows the rubber. It
/// is not tuned.
const SOFT: f64 = 2.0;
/// Errors of the closed form as shares of its change (second) at ratios of the pair's shear modulus to that
/// of the layer (first). Measured: `benches/total_errors.py`.
const OF_CLOSED_FORM: [[f64; 2]; 3] = [[1.0, 0.15], [11.0, 1.5], [1000.0, 3.0]];
/// Additional error of the closed form, as a share, under a given force for which no table has the contact.
const OF_FORCE: f64 = 0.5;

/// Errors of plane strain with a soft pair as shares of its change: under a contact as long along x3 as it is
/// wide, and the largest. Measured: `benches/total_errors.py`.
const OF_SOFT: [f64; 2] = [1.5, 2.0];
/// The same shares with a stiff pair. Measured: `benches/total_errors.py`.
const OF_STIFF: [f64; 2] = [1.2, 1.0];
/// The same shares with bodies on the faces of a layer that a punch bends. Measured:
/// `benches/total_errors.py`.
const OF_SURFACE: [f64; 2] = [0.5, 0.5];
/// Largest gain of capacitance per unit of stretch by bodies that stretch along x3 with the rubber, which
/// plane strain neglects. Among 246 random cases (`benches/total_errors.py --seed 2`), two combs whose
/// changes nearly cancel gain 0.5.
const OF_STRETCH: f64 = 0.75;
/// Largest share by which a pair that is stiffer than the layer increases the force of a punch. Measured:
/// `benches/model_errors.py`.
const OF_FORCE_BY_PAIR: f64 = 0.25;
/// Share by which forces in plane strain exceed those in three dimensions under a contact that is two
/// thicknesses wide and as long along x3. It grows as the square root of the width. Measured:
/// `benches/forces_in_space.py`.
const OF_FORCE_IN_PLANE: f64 = 0.78;

/// The bodies that move with the rubber of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contents {
    /// All bodies lie on the faces of the layer, or beside it.
    Nothing,
    /// The bodies stretch with the rubber. Motion along x3 may raise a capacitance that falls in plane
    /// strain.
    Soft,
    /// The pair is stiffer than the rubber, by this ratio of shear moduli.
    Stiff(f64),
}

impl Contents {
    fn of(case: &Case, layer: &Layer) -> Self {
        let layer_modulus = layer.material.as_ref().map(|material| material.shear_modulus());
        match (&case.electrodes, layer_modulus) {
            (Some(pair), Some(layer_modulus)) => match pair.stiffness {
                Stiffness::Rigid => Self::Stiff(f64::INFINITY),
                Stiffness::ShearModulus(modulus) if modulus > SOFT * layer_modulus => {
                    Self::Stiff(modulus / layer_modulus)
                }
                Stiffness::ShearModulus(_) => Self::Soft,
            },
            (Some(_) | None, _) if case.bodies.iter().any(|body| body.purpose == Purpose::InLayer) => {
                Self::Soft
            }
            (Some(_) | None, _) => Self::Nothing,
        }
    }
}

/// The errors of the model of a case as shares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shares {
    /// The error of the closed form against plane strain, over the change by the closed form; zero for other
    /// models.
    pub(super) closed_form: f64,
    /// The additional error of the closed form where the load is a force and no table has the contact.
    pub(super) closed_form_force: f64,
    /// The share by which changes in plane strain exceed those in three dimensions at a given compression.
    pub(super) in_plane: f64,
    /// The share by which changes in plane strain are too small under a given force, since its layer is too
    /// stiff.
    pub(super) in_plane_force: f64,
    /// The share by which the capacitance may be larger per unit of compression, independent of its change in
    /// plane strain.
    pub(super) of_stretch: f64,
    /// The share by which a stiff pair increases the force of the rubber alone.
    pub(super) of_force_by_pair: f64,
}

impl Shares {
    /// The shares of a case with the closed form or plane strain; `None` for other cases.
    pub(super) fn of(case: &Case) -> Option<Self> {
        let layer = case.layer.as_ref()?;
        let contents = Contents::of(case, layer);
        let slenderness = slenderness(case, layer, contents)?;
        let at = |[at_equal_sides, most]: [f64; 2]| (at_equal_sides / slenderness).min(most);
        let (is_closed_form, is_flat) = match case.mechanics? {
            Mechanics::ClosedForm { .. } => (true, true),
            Mechanics::PlaneStrain(_) if layer.gets_no_wider() => return None,
            Mechanics::PlaneStrain(model) => (false, model.indenter == Indenter::WholeTop),
            Mechanics::Solid(_) => return None,
        };
        let (closed_form, in_plane) = match contents {
            // Only the displacement of the top matters.
            Contents::Nothing if is_flat => (0.0, 0.0),
            Contents::Nothing => (0.0, at(OF_SURFACE)),
            Contents::Soft => (OF_CLOSED_FORM[0][1], at(OF_SOFT)),
            Contents::Stiff(ratio) => (of_closed_form(ratio), at(OF_STIFF)),
        };
        Some(Self {
            closed_form: if is_closed_form { closed_form } else { 0.0 },
            closed_form_force: if is_closed_form { OF_FORCE } else { 0.0 },
            in_plane,
            in_plane_force: of_force_in_plane(case, layer)?,
            // The rubber moves to the nearest side: half of it along x3 under a contact that is as long as it
            // is wide.
            of_stretch: if contents == Contents::Soft {
                OF_STRETCH * (0.5 / slenderness).min(1.0)
            } else {
                0.0
            },
            of_force_by_pair: if matches!(contents, Contents::Stiff(_)) { OF_FORCE_BY_PAIR } else { 0.0 },
        })
    }
}

/// The half width along x1 and the length along x3 of the contact, m; `None` in three dimensions.
fn contact(case: &Case, layer: &Layer) -> Option<(f64, f64)> {
    Some(match case.mechanics? {
        Mechanics::ClosedForm { contact_half_length, contact_width, .. } => {
            (contact_half_length, contact_width)
        }
        Mechanics::PlaneStrain(model) => {
            let half_width = match model.indenter {
                Indenter::WholeTop => layer.half_length?,
                Indenter::FlatPunch { half_width, .. } => half_width,
                Indenter::Cylinder { radius, .. } => radius.min((radius * layer.thickness).sqrt()),
                Indenter::Block { .. } | Indenter::Sphere { .. } => return None,
            };
            (half_width, model.width)
        }
        Mechanics::Solid(_) => return None,
    })
}

/// The share by which a force in plane strain exceeds that in three dimensions. Incompressible rubber flows
/// to the nearest side, and the resistance of a wide layer grows with the third power of the distance: a
/// contact that is shorter along x3 than along x1 loses more than in proportion. Fitted to plates and punches
/// of 1 to 8 thicknesses in three dimensions: `benches/forces_in_space.py`.
fn of_force_in_plane(case: &Case, layer: &Layer) -> Option<f64> {
    let (half_width, depth) = contact(case, layer)?;
    let [wide, long] =
        [half_width, 0.5 * depth].map(|half| half.max(0.5 * layer.thickness) / layer.thickness);
    let ratio = wide / long;
    let power = if ratio < 1.0 { 1.0 } else { 1.7 };
    Some(OF_FORCE_IN_PLANE * (0.5 * wide).sqrt() * ratio.powf(power))
}

/// The length of the contact along x3, over its width along x1 or the thickness of the layer, whichever is
/// larger. Rubber under the contact flows to the nearest side, and under a long contact along x3 only near
/// its ends. A stiff pair counts as the contact if it is shorter. `None` in three dimensions.
fn slenderness(case: &Case, layer: &Layer, contents: Contents) -> Option<f64> {
    let (half_width, depth) = contact(case, layer)?;
    let pair = case.electrodes.as_ref().filter(|_| matches!(contents, Contents::Stiff(_)));
    let depth = pair.map_or(depth, |pair| depth.min(pair.width));
    Some(depth / layer.thickness.max(2.0 * half_width))
}

/// The error of the closed form against plane strain, as a share of the change, for electrodes stiffer than
/// the layer by this ratio.
fn of_closed_form(stiffness: f64) -> f64 {
    let [.., [_, stiffest]] = OF_CLOSED_FORM;
    let within = |piece: &[[f64; 2]]| match piece {
        [[from, low], [to, high]] if (*from..=*to).contains(&stiffness) => {
            Some(low + (high - low) * (stiffness / from).ln() / (to / from).ln())
        }
        _ => None,
    };
    OF_CLOSED_FORM.windows(2).find_map(within).unwrap_or(stiffest)
}

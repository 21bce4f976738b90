//! Errors of models as shares of the change of a capacitance. They are upper estimates of what `benches/model_errors.py` finds.

use elastocap_case::{Case, Indenter, Layer, Mechanics, Stiffness};
use elastocap_geometry::scene::Purpose;

/// A pair follows the rubber up to this ratio of its shear modulus to that of the layer.
const SOFT: f64 = 2.0;
/// The closed form is off by these shares of its own change (second) at these ratios of the pair's shear modulus to that of the layer (first).
const OF_CLOSED_FORM: [[f64; 2]; 3] = [[1.0, 0.15], [11.0, 1.5], [1000.0, 3.0]];
/// It is off by this share more under a given force for which no table has that of the contact.
const OF_FORCE: f64 = 0.5;

/// Plane strain is off by these shares of its change with a soft pair: under something as long along x3 as it is wide, and at most.
const OF_SOFT: [f64; 2] = [1.5, 2.0];
/// These are the same shares with a stiff pair.
const OF_STIFF: [f64; 2] = [1.2, 1.0];
/// These are the same shares with bodies on the faces of a layer that a punch bends.
const OF_SURFACE: [f64; 2] = [0.5, 0.5];
/// Bodies that stretch with the rubber gain capacitance where that moves along x3, which it does not in the plane: at most this share for each
/// unit of stretch. Of 246 drawn cases (`benches/total_errors.py --seed 2`), two combs whose own changes nearly cancel gain 0.5.
const OF_STRETCH: f64 = 0.75;
/// A pair that is stiffer than the layer makes the force of a punch larger by at most this share.
const OF_FORCE_BY_PAIR: f64 = 0.25;
/// Forces in plane strain are larger than in space by this share under what is two thicknesses wide and as long along x3; it grows as the root of the width.
const OF_FORCE_IN_PLANE: f64 = 0.78;

/// The bodies that move with the rubber of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contents {
    /// All bodies lie on the faces of the layer, or beside it.
    Nothing,
    /// The bodies stretch with the rubber. Where that moves along x3 too, the capacitance may rise where it falls in the plane.
    Soft,
    /// The pair is stiffer than the rubber, by this ratio of shear moduli.
    Stiff(f64),
}

impl Contents {
    fn of(case: &Case, layer: &Layer) -> Self {
        let own = layer.material.as_ref().map(|material| material.shear_modulus());
        match (&case.electrodes, own) {
            (Some(pair), Some(own)) => match pair.stiffness {
                Stiffness::Rigid => Self::Stiff(f64::INFINITY),
                Stiffness::ShearModulus(modulus) if modulus > SOFT * own => Self::Stiff(modulus / own),
                Stiffness::ShearModulus(_) => Self::Soft,
            },
            (Some(_) | None, _) if case.bodies.iter().any(|body| body.purpose == Purpose::InLayer) => {
                Self::Soft
            }
            (Some(_) | None, _) => Self::Nothing,
        }
    }
}

/// The shares by which the model of a case is off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shares {
    /// The closed form against plane strain, of the change that it has itself; zero of other models.
    pub(super) closed_form: f64,
    /// A further share of the closed form where the load is a force and no table has that of the contact.
    pub(super) closed_form_force: f64,
    /// Plane strain against three dimensions: by so much its changes are too large, at a compression.
    pub(super) in_plane: f64,
    /// By so much its changes are too small besides where the load is a force, since its layer is too stiff.
    pub(super) in_plane_force: f64,
    /// The capacitance may be larger by this share for each unit of compression, however small its change in the plane is.
    pub(super) of_stretch: f64,
    /// The force is larger by so much for a pair that the rubber alone does not have.
    pub(super) of_force_by_pair: f64,
}

impl Shares {
    /// Finds the shares of a case with the closed form or plane strain; other cases have none.
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
            // Where the top goes is all that counts.
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
            // The rubber takes the nearest way: half of it along x3 under what is as long as it is wide.
            of_stretch: if contents == Contents::Soft {
                OF_STRETCH * (0.5 / slenderness).min(1.0)
            } else {
                0.0
            },
            of_force_by_pair: if matches!(contents, Contents::Stiff(_)) { OF_FORCE_BY_PAIR } else { 0.0 },
        })
    }
}

/// Gives the half-width along x1 and the length along x3 of what presses; `None` in three dimensions.
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
            };
            (half_width, model.width)
        }
        Mechanics::Solid(_) => return None,
    })
}

/// Gives the share by which a force in plane strain is larger than in space. Incompressible rubber flows to the nearest side, and a wide layer resists
/// with the third power of the way: what is shorter along x3 than along x1 loses more than in proportion. Compared with plates and punches of 1 to
/// 8 thicknesses in three dimensions: `benches/forces_in_space.py`.
fn of_force_in_plane(case: &Case, layer: &Layer) -> Option<f64> {
    let (half_width, depth) = contact(case, layer)?;
    let [wide, long] =
        [half_width, 0.5 * depth].map(|half| half.max(0.5 * layer.thickness) / layer.thickness);
    let ratio = wide / long;
    let power = if ratio < 1.0 { 1.0 } else { 1.7 };
    Some(OF_FORCE_IN_PLANE * (0.5 * wide).sqrt() * ratio.powf(power))
}

/// Gives the length along x3 of what presses, over its width along x1 or the thickness of the layer, whichever is larger. Rubber under it moves to
/// the nearest side: along x3 only near the ends of what is long. A stiff pair counts as what presses if it is shorter. `None` in three
/// dimensions.
fn slenderness(case: &Case, layer: &Layer, contents: Contents) -> Option<f64> {
    let (half_width, depth) = contact(case, layer)?;
    let pair = case.electrodes.as_ref().filter(|_| matches!(contents, Contents::Stiff(_)));
    let depth = pair.map_or(depth, |pair| depth.min(pair.width));
    Some(depth / layer.thickness.max(2.0 * half_width))
}

/// Gives the share by which the closed form is off against plane strain, for electrodes that are stiffer than the layer by this ratio.
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

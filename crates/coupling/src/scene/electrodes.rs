//! The positions of the electrodes after loading.
//!
//! Electrodes move with the layer: see [`ElectrodePose`], with one additional rule. An electrode with a face
//! on the surface of the layer before loading keeps that face there, because the layer beside it stays
//! bonded; its mid-plane then follows from its thickness. Without the rule the electrode would protrude from
//! the surface, or sink below it, by a small length, since the pose takes its thinning at the mid-plane.

use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use elastocap_geometry::scene::Box3;
use elastocap_mechanics::{ElectrodePose, ElectrodeStiffness, LayerState};

use super::{DeformedPair, ElectrodePlace, SceneError};
use crate::deform::{Deformation, Ends, FiniteElementStep};
use elastocap_case::{Electrodes, Layer, Layout, Stiffness};

/// Lengths that differ by less than this share of the layer's thickness are the same. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const ROUNDING: f64 = 1e-12;

/// The positions of the electrodes in a scene before terminals are joined: they are added first.
const PLACES: [ElectrodePlace; 2] =
    [ElectrodePlace { conductor: 0, part: 0 }, ElectrodePlace { conductor: 1, part: 0 }];

/// The two electrodes of a scene.
pub(super) struct Placed {
    /// Boxes in the order of the electrodes' names. Bent electrodes are represented by the mean positions of
    /// their faces.
    pub(super) regions: [Box3; 2],
    pub(super) pair: DeformedPair,
    /// See [`super::DeformedScene::electrodes_are_bent`].
    pub(super) are_bent: bool,
}

/// The electrodes with the layer in `state`; `None` for the unloaded layer.
///
/// # Errors
/// Electrodes that do not fit into the deformed layer, or meet.
pub(super) fn electrodes(
    electrodes: &Electrodes,
    layer: &Layer,
    state: Option<&Deformation<'_>>,
) -> Result<Placed, SceneError> {
    let (regions, pair) = match state {
        Some(Deformation::FiniteElement(step)) => {
            let (regions, pair) = place_solved(electrodes, layer, step)?;
            // At rest they are boxes up to rounding.
            let are_boxes = step.electrodes.iter().all(|e| e.deviation <= ROUNDING * layer.thickness);
            return Ok(Placed { regions, pair, are_bent: !are_boxes });
        }
        Some(Deformation::ClosedForm(state)) => place(electrodes, layer, Some(state))?,
        Some(Deformation::Foam(_)) => return Err(SceneError::WithinFoam),
        None => place(electrodes, layer, None)?,
    };
    Ok(Placed { regions, pair, are_bent: false })
}

/// Places the electrodes by the closed form, or at rest.
fn place(
    electrodes: &Electrodes,
    layer: &Layer,
    state: Option<&LayerState>,
) -> Result<([Box3; 2], DeformedPair), SceneError> {
    let permittivity = layer
        .permittivity_at(state.map_or(0.0, LayerState::compression))
        .ok_or(SceneError::Missing("relative_permittivity in [layer]"))?
        * VACUUM_PERMITTIVITY;
    let width = electrodes.width;
    let block = |x1: [f64; 2], x2: [f64; 2]| Box3 {
        min: [x1[0], x2[0], -0.5 * width],
        max: [x1[1], x2[1], 0.5 * width],
    };
    let [first, second] = electrodes.names();
    match electrodes.layout {
        Layout::InPlane => {
            let plate = Plate::new(first, electrodes.height, electrodes, layer, state)?;
            let gap = plate.pose.gap(electrodes.gap);
            let (near, far) = (0.5 * gap, 0.5 * gap + plate.length);
            let x2 = [plate.low, plate.high];
            let deformed = DeformedPair {
                places: PLACES,
                gap,
                height: plate.mid,
                thickness: plate.thickness,
                parallel_plate: permittivity * plate.thickness * width / gap,
            };
            Ok(([block([-far, -near], x2), block([near, far], x2)], deformed))
        }
        Layout::Stacked => {
            let offset = 0.5 * electrodes.gap + 0.5 * electrodes.thickness;
            let lower = Plate::new(first, electrodes.height - offset, electrodes, layer, state)?;
            let upper = Plate::new(second, electrodes.height + offset, electrodes, layer, state)?;
            let gap = upper.low - lower.high;
            if gap <= ROUNDING * layer.thickness {
                return Err(SceneError::GapCloses { gap });
            }
            let region =
                |plate: &Plate| block([-0.5 * plate.length, 0.5 * plate.length], [plate.low, plate.high]);
            let facing = lower.length.min(upper.length);
            let deformed = DeformedPair {
                places: PLACES,
                gap,
                height: 0.5 * (lower.high + upper.low),
                thickness: 0.5 * (lower.thickness + upper.thickness),
                parallel_plate: permittivity * facing * width / gap,
            };
            Ok(([region(&lower), region(&upper)], deformed))
        }
    }
}

/// By finite elements: boxes at the mean positions of the electrodes' faces.
fn place_solved(
    electrodes: &Electrodes,
    layer: &Layer,
    step: &FiniteElementStep,
) -> Result<([Box3; 2], DeformedPair), SceneError> {
    let permittivity =
        layer.relative_permittivity.ok_or(SceneError::Missing("relative_permittivity in [layer]"))?
            * VACUUM_PERMITTIVITY;
    let block = |[x1, x2, x3]: Ends| Box3 { min: [x1[0], x2[0], x3[0]], max: [x1[1], x2[1], x3[1]] };
    let slack = ROUNDING * layer.thickness;
    let regions = match (electrodes.layout, step.electrodes.as_slice()) {
        (Layout::InPlane, [right]) => {
            let [[near, far], x2, x3] = right.mean;
            [block([[-far, -near], x2, x3]), block([[near, far], x2, x3])]
        }
        (Layout::InPlane, [left, right]) => [left.mean, right.mean].map(block),
        (Layout::Stacked, [lower, upper]) => [lower.mean, upper.mean].map(|[x1, x2, x3]| {
            // On the right half alone the left end is the axis of symmetry.
            block([[if x1[0].abs() <= slack { -x1[1] } else { x1[0] }, x1[1]], x2, x3])
        }),
        (Layout::InPlane | Layout::Stacked, _) => {
            return Err(SceneError::Missing("electrodes in its finite elements"));
        }
    };
    let along = match electrodes.layout {
        Layout::InPlane => 0,
        Layout::Stacked => 1,
    };
    let gap = regions[1].min[along] - regions[0].max[along];
    if gap <= slack {
        return Err(SceneError::GapCloses { gap });
    }
    let thickness = |b: &Box3| b.extent(1);
    let width = regions[0].extent(2).min(regions[1].extent(2));
    let pair = match electrodes.layout {
        Layout::InPlane => DeformedPair {
            places: PLACES,
            gap,
            height: 0.25 * (regions[0].min[1] + regions[0].max[1] + regions[1].min[1] + regions[1].max[1]),
            thickness: 0.5 * (thickness(&regions[0]) + thickness(&regions[1])),
            parallel_plate: permittivity * thickness(&regions[0]).min(thickness(&regions[1])) * width / gap,
        },
        Layout::Stacked => DeformedPair {
            places: PLACES,
            gap,
            height: 0.5 * (regions[0].max[1] + regions[1].min[1]),
            thickness: 0.5 * (thickness(&regions[0]) + thickness(&regions[1])),
            parallel_plate: permittivity * regions[0].extent(0).min(regions[1].extent(0)) * width / gap,
        },
    };
    Ok((regions, pair))
}

/// One electrode after loading, m.
struct Plate {
    pose: ElectrodePose,
    mid: f64,
    thickness: f64,
    length: f64,
    low: f64,
    high: f64,
}

impl Plate {
    fn new(
        name: &'static str,
        reference_height: f64,
        electrodes: &Electrodes,
        layer: &Layer,
        state: Option<&LayerState>,
    ) -> Result<Self, SceneError> {
        let total = layer.thickness;
        let stiffness = match electrodes.stiffness {
            Stiffness::Rigid => ElectrodeStiffness::Rigid,
            Stiffness::ShearModulus(modulus) => ElectrodeStiffness::ShearModulus(modulus),
        };
        let pose = match state {
            Some(state) => state.electrode_pose(reference_height, stiffness)?,
            None => ElectrodePose {
                height: reference_height,
                layer_stretch: 1.0,
                thickness_stretch: 1.0,
                length_stretch: 1.0,
            },
        };
        let top = state.map_or(total, LayerState::deformed_thickness);
        let thickness = pose.thickness(electrodes.thickness);
        let (mut low, mut high) = (pose.height - 0.5 * thickness, pose.height + 0.5 * thickness);
        let half = 0.5 * electrodes.thickness;
        let flush = |room: f64| room.abs() <= ROUNDING * total;
        match (flush(reference_height - half), flush(total - reference_height - half)) {
            (true, false) => (low, high) = (0.0, thickness),
            (false, true) => (low, high) = (top - thickness, top),
            (true, true) if flush(top - thickness) => (low, high) = (0.0, top),
            _ => {}
        }
        if low < 0.0 {
            return Err(SceneError::LeavesLayer { electrode: name, side: "bottom", by: -low });
        }
        if high > top {
            return Err(SceneError::LeavesLayer { electrode: name, side: "top", by: high - top });
        }
        // The pose is kept unless a face is flush: the middle of rounded faces may differ in the last digit.
        let is_flush = low == 0.0 || high == top;
        let mid = if is_flush { 0.5 * (low + high) } else { pose.height };
        Ok(Self { pose, mid, thickness, length: pose.length(electrodes.length), low, high })
    }
}

//! The scene that the box solver takes, from a case and one state of its layer.
//!
//! Electrodes float with the layer: see [`ElectrodePose`]. One rule is added to it. An electrode with a face on the
//! layer's surface before loading keeps that face there, because the layer next to it stays bonded; its mid-plane then
//! follows from its thickness. By the pose alone, whose thinning is that of the mid-plane, it would poke out of the
//! surface (or leave it) by a sliver.

use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::scene::{Box3, BoxScene, Conductor, Dielectric, Wall};
use elastocap_mechanics::{ElectrodePose, ElectrodeStiffness, LayerState, MechanicsError};

use crate::deform::{Deformation, ElectrodeBox, Ends, FiniteElementStep};
use elastocap_case::{Case, Electrodes, Extent, Face, Layer, Layout, Stiffness, Surroundings};

/// Lengths that differ by less than this share of the layer's thickness are the same.
const ROUNDING: f64 = 1e-12;

/// A case in one state of its layer, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct DeformedScene {
    /// What the solver takes; its lengths are those after loading.
    pub scene: BoxScene,
    /// What each of the scene's dielectrics is, in their order.
    pub roles: Vec<BodyRole>,
    /// The pair of electrodes, if the case has one; they are the scene's first two conductors.
    pub pair: Option<DeformedPair>,
    /// Boxes inside and around the two electrodes where they are no boxes themselves, or why there are none. Their places in
    /// `scene` are then boxes of their means.
    pub bent: Option<Result<Enclosing, SceneError>>,
}

impl DeformedScene {
    /// The scene with the pair replaced.
    pub fn with_pair(&self, regions: [Box3; 2]) -> BoxScene {
        let mut scene = self.scene.clone();
        for (conductor, region) in scene.conductors.iter_mut().zip(regions) {
            conductor.region = region;
        }
        scene
    }
}

/// Between what the electrodes of a pair lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosing {
    /// Boxes that lie inside them.
    pub inside: [Box3; 2],
    /// Boxes that hold them.
    pub around: [Box3; 2],
}

/// What a designer asks of the electrodes after loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeformedPair {
    /// Between the facing surfaces, m.
    pub gap: f64,
    /// Above the substrate, m: of the mid-plane of an in-plane pair, of the middle of the gap of a stacked one.
    pub height: f64,
    /// Along x2, m; the mean of the two plates of a stacked pair, which thin each by the stretch at its own height.
    pub thickness: f64,
    /// The parallel-plate formula, F: the facing area times permittivity over the gap, no fringing.
    pub parallel_plate: f64,
}

/// Why a load step has no scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The layer or an electrode cannot be deformed so.
    #[error(transparent)]
    Mechanics(#[from] MechanicsError),
    /// The plates of a stacked pair meet.
    #[error(
        "the gap of the stacked pair closes: its plates would overlap by {:.4} um; compress less, or make the plates \
         thinner or softer",
        -gap * 1e6
    )]
    GapCloses {
        /// Distance of the facing surfaces, m; not positive.
        gap: f64,
    },
    /// An electrode is thicker than what the deformed layer leaves to it.
    #[error(
        "`{electrode}` would leave the deformed layer at the {side} by {:.4} um; compress less, make it thinner or \
         softer, or place it farther from that face",
        by * 1e6
    )]
    LeavesLayer {
        /// Its name.
        electrode: &'static str,
        /// "top" or "bottom".
        side: &'static str,
        /// How far, m.
        by: f64,
    },
    /// A body that stays in place is met by a wall that moves with the layer.
    #[error(
        "the conductor `{conductor}` stays in place, and the wall {side} the layer, which moves with it, reaches it; make \
         the medium {side} the layer thicker"
    )]
    ReachesWall {
        /// Its name.
        conductor: String,
        /// "below" or "above".
        side: &'static str,
    },
    /// An electrode of the finite-element layer is tilted or bent too much.
    #[error(
        "the electrodes are no boxes any more: tilted by {:.2} degrees and bent by {:.3} um, so that {what}; the solver for \
         boxes cannot take them",
        tilt.atan().to_degrees(),
        deviation * 1e6
    )]
    NotABox {
        /// Slope of its middle line.
        tilt: f64,
        /// How far it is from being a box, m.
        deviation: f64,
        /// What does not fit.
        what: &'static str,
    },
    /// The file lacks what the scene needs; the case reader refuses such a file.
    #[error("the case has no {0}")]
    Missing(&'static str),
}

/// The scene of `case` with its layer in `state`; `None` for the layer as it is without load.
///
/// # Errors
/// When the deformed bodies do not fit together: see [`SceneError`].
pub fn scene_of(case: &Case, state: Option<&Deformation<'_>>) -> Result<DeformedScene, SceneError> {
    let surroundings = case.surroundings.as_ref().ok_or(SceneError::Missing("[surroundings]"))?;
    let mut conductors = Vec::new();
    let mut pair = None;
    let mut bent = None;
    if let Some(electrodes) = &case.electrodes {
        let layer = case.layer.as_ref().ok_or(SceneError::Missing("[layer]"))?;
        let (regions, deformed) = match state {
            Some(Deformation::FiniteElement(step)) => {
                let solved = place_solved(electrodes, layer, step)?;
                // At rest they are boxes, but for rounding.
                if step.electrodes.iter().any(|e| e.deviation() > ROUNDING * layer.thickness) {
                    bent = Some(solved.enclosing);
                }
                (solved.mean, solved.pair)
            }
            Some(Deformation::ClosedForm(state)) => place(electrodes, layer, Some(state))?,
            None => place(electrodes, layer, None)?,
        };
        for (name, region) in electrodes.names().into_iter().zip(regions) {
            conductors.push(Conductor { name: name.to_owned(), region, floating_charge: None });
        }
        pair = Some(deformed);
    }
    conductors.extend(case.conductors.iter().cloned());

    let top = case.layer.as_ref().map(|layer| state.map_or(layer.thickness, Deformation::deformed_thickness));
    let placed = conductors.iter().map(|c: &Conductor| (c.name.as_str(), c.region));
    let shaped = case.beside.iter().flat_map(|b| &b.conductors);
    let placed = placed.chain(shaped.filter_map(|c| Some((c.name.as_str(), c.shape.bounds()?))));
    let placed: Vec<_> = placed.collect();
    let (domain, walls) = outer_walls(surroundings, top.unwrap_or(0.0), &placed)?;
    let mut dielectrics = Vec::new();
    let mut roles = Vec::new();
    let mut add = |name: &str, role, region: Box3, relative_permittivity| {
        if let Some(region) = within(&region, &domain) {
            dielectrics.push(Dielectric { name: name.to_owned(), region, relative_permittivity });
            roles.push(role);
        }
    };
    let slab = |low: f64, high: f64| {
        let mut region = Box3::SPACE;
        (region.min[1], region.max[1]) = (low, high);
        region
    };
    if let (Some(layer), Some(top)) = (&case.layer, top) {
        let own =
            layer.relative_permittivity.ok_or(SceneError::Missing("relative_permittivity in [layer]"))?;
        add("layer", BodyRole::Layer, slab(0.0, top), own);
        if let Extent::AroundLayer { below, above, .. } = &surroundings.extent {
            if let Face::Medium { relative_permittivity, thickness } = *below {
                let depth = thickness.unwrap_or(f64::INFINITY);
                add("substrate", BodyRole::Substrate, slab(-depth, 0.0), relative_permittivity);
            }
            if let Face::Medium { relative_permittivity, thickness } = *above {
                let depth = thickness.unwrap_or(f64::INFINITY);
                add("cover", BodyRole::Cover, slab(top, top + depth), relative_permittivity);
            }
        }
    }
    for body in &case.dielectrics {
        add(&body.name, BodyRole::Dielectric, body.region, body.relative_permittivity);
    }
    let background_permittivity = surroundings.relative_permittivity;
    let scene = BoxScene { conductors, dielectrics, background_permittivity, domain, walls };
    Ok(DeformedScene { scene, roles, pair, bent })
}

/// The region without the bounds that lie outside the domain; `None` if nothing of it is inside.
fn within(region: &Box3, domain: &Box3) -> Option<Box3> {
    let mut inside = *region;
    for a in 0..3 {
        if region.min[a] >= domain.max[a] || region.max[a] <= domain.min[a] {
            return None;
        }
        if region.min[a] < domain.min[a] {
            inside.min[a] = f64::NEG_INFINITY;
        }
        if region.max[a] > domain.max[a] {
            inside.max[a] = f64::INFINITY;
        }
    }
    Some(inside)
}

type Walls = [[Wall; 2]; 3];

fn outer_walls(
    surroundings: &Surroundings,
    top: f64,
    conductors: &[(&str, Box3)],
) -> Result<(Box3, Walls), SceneError> {
    let boundary = surroundings.boundary;
    let (side_margin, below, above) = match &surroundings.extent {
        Extent::Everywhere => return Ok((Box3::SPACE, [[Wall::Open; 2]; 3])),
        Extent::Walls(walls) => return Ok((*walls, [[boundary; 2]; 3])),
        Extent::AroundLayer { side_margin, below, above } => (*side_margin, *below, *above),
    };
    let mut domain = Box3::SPACE;
    let mut walls = [[boundary; 2]; 3];
    if let Some(margin) = side_margin {
        let bodies = conductors.iter().map(|(_, region)| *region).reduce(|a, b| a.union(&b));
        let bodies = bodies.ok_or(SceneError::Missing("conductor"))?;
        for a in [0, 2] {
            domain.min[a] = bodies.min[a] - margin;
            domain.max[a] = bodies.max[a] + margin;
        }
    }
    let end = |face: Face, from: f64, outward: f64| match face {
        Face::Insulated => (from, Wall::Insulated),
        Face::Grounded => (from, Wall::Grounded),
        Face::Medium { thickness: Some(depth), .. } if boundary != Wall::Open => {
            (from + outward * depth, boundary)
        }
        Face::Medium { .. } => (outward * f64::INFINITY, Wall::Open),
    };
    (domain.min[1], walls[1][0]) = end(below, 0.0, -1.0);
    (domain.max[1], walls[1][1]) = end(above, top, 1.0);
    for (conductor, region) in conductors {
        let reaches = |side: usize| {
            let room = [region.min[1] - domain.min[1], domain.max[1] - region.max[1]][side];
            room < 0.0 || (room == 0.0 && walls[1][side] == Wall::Grounded)
        };
        for (side, name) in ["below", "above"].into_iter().enumerate() {
            if reaches(side) {
                return Err(SceneError::ReachesWall { conductor: (*conductor).to_owned(), side: name });
            }
        }
    }
    Ok((domain, walls))
}

/// Where the two electrodes are after loading.
fn place(
    electrodes: &Electrodes,
    layer: &Layer,
    state: Option<&LayerState>,
) -> Result<([Box3; 2], DeformedPair), SceneError> {
    let permittivity =
        layer.relative_permittivity.ok_or(SceneError::Missing("relative_permittivity in [layer]"))?
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
                gap,
                height: 0.5 * (lower.high + upper.low),
                thickness: 0.5 * (lower.thickness + upper.thickness),
                parallel_plate: permittivity * facing * width / gap,
            };
            Ok(([region(&lower), region(&upper)], deformed))
        }
    }
}

/// The electrodes of a finite-element solution.
struct SolvedPair {
    /// The boxes of their means.
    mean: [Box3; 2],
    enclosing: Result<Enclosing, SceneError>,
    pair: DeformedPair,
}

fn place_solved(
    electrodes: &Electrodes,
    layer: &Layer,
    step: &FiniteElementStep,
) -> Result<SolvedPair, SceneError> {
    let permittivity =
        layer.relative_permittivity.ok_or(SceneError::Missing("relative_permittivity in [layer]"))?
            * VACUUM_PERMITTIVITY;
    let block = |[x1, x2, x3]: Ends| Box3 { min: [x1[0], x2[0], x3[0]], max: [x1[1], x2[1], x3[1]] };
    let shapes = step.electrodes.as_slice();
    let slack = ROUNDING * layer.thickness;
    let pair_of = |pick: fn(&ElectrodeBox) -> Ends| match (electrodes.layout, shapes) {
        (Layout::InPlane, [right]) => {
            let [[near, far], x2, x3] = pick(right);
            Ok([block([[-far, -near], x2, x3]), block([[near, far], x2, x3])])
        }
        (Layout::InPlane, [left, right]) => Ok([pick(left), pick(right)].map(block)),
        (Layout::Stacked, [lower, upper]) => Ok([pick(lower), pick(upper)].map(|[x1, x2, x3]| {
            // On the right half alone the left end is the axis of symmetry.
            block([[if x1[0].abs() <= slack { -x1[1] } else { x1[0] }, x1[1]], x2, x3])
        })),
        _ => Err(SceneError::Missing("electrodes in its finite elements")),
    };
    let [mean, inside, around] = [pair_of(|e| e.mean)?, pair_of(|e| e.inside)?, pair_of(|e| e.around)?];
    let refused = |what| {
        let deviation = shapes.iter().map(ElectrodeBox::deviation).fold(0.0, f64::max);
        let tilt = shapes.iter().map(|e| e.tilt).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        SceneError::NotABox { tilt, deviation, what }
    };
    let along = match electrodes.layout {
        Layout::InPlane => 0,
        Layout::Stacked => 1,
    };
    let gap = mean[1].min[along] - mean[0].max[along];
    if gap <= slack {
        return Err(SceneError::GapCloses { gap });
    }
    let enclosing = if around[1].min[along] - around[0].max[along] <= slack {
        Err(refused("the boxes around them touch"))
    } else if inside.iter().any(|b| (0..3).any(|a| b.extent(a) <= slack)) {
        Err(refused("no box fits inside them"))
    } else if around.iter().any(|b| b.min[1] < -slack || b.max[1] > step.deformed_thickness + slack) {
        Err(refused("the boxes around them reach out of the layer"))
    } else {
        Ok(Enclosing { inside, around })
    };
    let thickness = |b: &Box3| b.extent(1);
    let width = mean[0].extent(2).min(mean[1].extent(2));
    let pair = match electrodes.layout {
        Layout::InPlane => DeformedPair {
            gap,
            height: 0.25 * (mean[0].min[1] + mean[0].max[1] + mean[1].min[1] + mean[1].max[1]),
            thickness: 0.5 * (thickness(&mean[0]) + thickness(&mean[1])),
            parallel_plate: permittivity * thickness(&mean[0]).min(thickness(&mean[1])) * width / gap,
        },
        Layout::Stacked => DeformedPair {
            gap,
            height: 0.5 * (mean[0].max[1] + mean[1].min[1]),
            thickness: 0.5 * (thickness(&mean[0]) + thickness(&mean[1])),
            parallel_plate: permittivity * mean[0].extent(0).min(mean[1].extent(0)) * width / gap,
        },
    };
    Ok(SolvedPair { mean, enclosing, pair })
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
        // Kept as the pose says where nothing moved it: the middle of the rounded faces may differ in the last digit.
        let moved = low == 0.0 || high == top;
        let mid = if moved { 0.5 * (low + high) } else { pose.height };
        Ok(Self { pose, mid, thickness, length: pose.length(electrodes.length), low, high })
    }
}

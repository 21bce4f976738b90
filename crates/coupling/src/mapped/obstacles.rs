//! A forecast of the bodies and walls in the way of a map, before the finite elements are solved.
//!
//! A map does not change bodies that are far enough above the layer, and those below it. It ends at walls,
//! and in open space at distances from the corners of the surface that depend on the solution, between known
//! limits: a body within the narrower limits is in the way in any case, and a body outside the wider ones is
//! not.

use elastocap_case::{Case, Mechanics, Pose};
use elastocap_geometry::scene::{Box3, Purpose, Scene, Wall};

use super::films::Films;
use super::in_layer::InLayer;
use super::indenter::{IndenterMap, Under};
use super::room::{ABOVE, Others};
use super::surface::{DECAY, DECAY_OF_SLIDING, FOLLOWED};
use crate::load_steps::StepLoad;
use crate::scene::SceneError;
use crate::scene::indenter::{IndenterForm, Rounding};
use crate::scene::neutral::indenter_in_field;

/// The lower and the upper limit of a quantity.
type Range = [f64; 2];

/// The smallest and the largest possible zone of a map.
struct Zone {
    least: Box3,
    most: Box3,
}

/// A pressed layer before it is solved.
struct Pressed<'a> {
    case: &'a Case,
    scene: &'a Scene,
    form: IndenterForm,
    /// Half length, thickness and half width of the layer before loading, m.
    pad: [f64; 3],
    /// Whether the layer is in plane strain.
    is_plane: bool,
    /// Whether the indenter covers the whole top of the layer.
    covers_all: bool,
    /// Limits of the compression U/H.
    compression: Range,
}

/// Looks for bodies in the way of the map of a step, from the scene at rest. Returns the reason that the step
/// may fail once the layer is solved, or `None` if no body can be in the way.
///
/// # Errors
/// The reason that the step will fail with any solution of the layer.
pub(crate) fn in_the_way(
    case: &Case,
    scene: &Scene,
    load: StepLoad,
    pose: &Pose,
) -> Result<Option<SceneError>, SceneError> {
    let Some((layer, mechanics)) = case.layer.as_ref().zip(case.mechanics) else { return Ok(None) };
    let (width, is_plane) = match mechanics {
        Mechanics::ClosedForm { .. } => return Ok(None),
        Mechanics::PlaneStrain(model) => (model.width, true),
        Mechanics::Solid(model) => (model.width, false),
    };
    let in_field = indenter_in_field(case);
    let form = IndenterForm::of(case, in_field.and_then(|indenter| indenter.height));
    let (Some(form), Some(half_length)) = (form, layer.half_length) else { return Ok(None) };
    let is_in_layer = case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
    let is_pair = case.electrodes.is_some() && !is_in_layer;
    let compression = match load {
        StepLoad::Compression(compression) => [compression; 2],
        StepLoad::ForceN(force) if force != 0.0 => [0.0, 1.0],
        StepLoad::None | StepLoad::ForceN(_) => [0.0; 2],
    };
    let pad = [half_length, layer.thickness, 0.5 * width];
    let covers_all = mechanics.covers_all();
    let pressed = Pressed { case, scene, form, pad, is_plane, covers_all, compression };
    let mut zones = Vec::new();
    if pose.distance <= 0.0 {
        zones.push(if is_pair { pressed.of_pair() } else { pressed.of_surface() });
    }
    let mut doubt = None;
    if in_field.is_some() {
        if load.is_zero() {
            zones.extend(pressed.of_resting_indenter(pose.distance)?);
        } else {
            doubt = pressed.check_walls()?;
            zones.push(pressed.of_indenter());
        }
    }
    let [low, high] = compression.map(|c| c * layer.thickness);
    // The displacements of the top that are examined.
    let displacements = if low == high { vec![low] } else { vec![low, 0.5 * (low + high), high] };
    let others: Result<Vec<Others>, _> =
        displacements.iter().map(|sinks| Others::of(case, scene, -sinks, pose)).collect();
    let others = others?;
    for Zone { least, .. } in &zones {
        let in_zone: Vec<&str> = others.iter().filter_map(|others| others.first_in(least)).collect();
        if let Some(body) = in_zone.first().filter(|_| in_zone.len() == others.len()) {
            return Err(SceneError::InTheIndentersWay { body: (*body).to_owned() });
        }
    }
    let mut possible =
        zones.iter().flat_map(|zone| others.iter().filter_map(|bodies| bodies.first_in(&zone.most)));
    let possible = possible.next();
    Ok(doubt.or_else(|| possible.map(|body| SceneError::InTheIndentersWay { body: body.to_owned() })))
}

impl Pressed<'_> {
    /// The ends of the narrower and of the wider zone along x1 and x3. `open` gives the limits of the
    /// distance from the middle at which a map ends in open space, by axis and side.
    fn ends(&self, open: &dyn Fn(usize, usize) -> Range) -> [[[f64; 2]; 2]; 2] {
        let end = |k: usize, side: usize, which: usize| {
            let (a, outward) = (2 * k, [-1.0, 1.0][side]);
            let wall = [self.scene.domain.min[a], self.scene.domain.max[a]][side];
            let is_walled = self.scene.walls[a][side] != Wall::Open && wall.is_finite();
            if is_walled { wall } else { outward * open(k, side)[which] }
        };
        [0, 1].map(|which| [0, 1].map(|k| [0, 1].map(|side| end(k, side, which))))
    }

    /// The zone of the map of a layer.
    fn around_layer(&self, open: &dyn Fn(usize, usize) -> Range) -> Zone {
        let above = (1.0 + ABOVE) * self.pad[1];
        let [least, most] = self.ends(open).map(|[along, across]| Box3 {
            min: [along[0], 0.0, across[0]],
            max: [along[1], above, across[1]],
        });
        Zone { least, most }
    }

    /// The zone of the map of a layer that contains only a pair of electrodes.
    fn of_pair(&self) -> Zone {
        let thickness = self.pad[1];
        let regions = self.case.electrodes.iter().flat_map(|pair| pair.regions());
        let last = regions.fold([0.0_f64; 2], |last, region| [0, 1].map(|k| last[k].max(region.max[2 * k])));
        let cover = |k: usize| match (self.form.rounding, k) {
            _ if indenter_in_field(self.case).is_none() => [0.0; 2],
            (Rounding::Ball { radius }, _) | (Rounding::AlongX3 { radius, is_cylinder: true }, 0) => {
                [0.0, 1.2 * radius]
            }
            (Rounding::Sharp | Rounding::AlongX3 { .. }, _) => [self.form.half_widths[k]; 2],
        };
        self.around_layer(&|k, _| {
            let moved = [0.5 * last[k], 1.5 * last[k] + thickness];
            let electrodes = if self.is_plane && k == 1 { [last[k]; 2] } else { moved };
            [0, 1].map(|which| electrodes[which].max(cover(k)[which]) + DECAY * thickness)
        })
    }

    /// The zone of the map of a layer with any bodies in it, or none.
    fn of_surface(&self) -> Zone {
        let thickness = self.pad[1];
        let high = self.compression[1];
        let lowest = if self.covers_all { 1.0 - high } else { 1.0 };
        let pair = self.case.electrodes.as_ref().map(|pair| pair.regions());
        let inside = InLayer::of(self.case, 1.0, pair.as_ref().map_or(&[][..], |regions| &regions[..]));
        self.around_layer(&|k, side| {
            let (a, corner) = (2 * k, self.corner(k, [-1.0, 1.0][side]));
            // A mirror-symmetric map reaches equally far on both sides.
            let farther = inside.reach(a, 0).max(inside.reach(a, 1));
            let is_straight = self.is_plane && k == 1;
            let followed = if is_straight || self.covers_all { [0.0; 2] } else { FOLLOWED };
            let slides = match (is_straight, self.covers_all) {
                (true, _) => 0.0,
                // Incompressible material that leaves at the end comes from above the substrate.
                (false, true) => 2.0 * high / (1.0 - high).max(0.1) * self.pad[a],
                (false, false) => thickness,
            };
            let least = corner[0].max(inside.reach(a, side)) + (followed[0] + DECAY) * lowest * thickness;
            let falls = (DECAY * thickness).max(DECAY_OF_SLIDING * slides);
            [least, corner[1].max(farther) + followed[1] * thickness + falls]
        })
    }

    /// Limits of the distance from the middle to the outermost corner of the surface, along x1 (`k` 0) or x3
    /// (1) in the direction `outward` (1 or -1).
    fn corner(&self, k: usize, outward: f64) -> Range {
        let IndenterForm { position, half_widths, rounding, .. } = self.form;
        let (half, thickness, end) = (half_widths[k], self.pad[1], self.pad[2 * k]);
        if self.is_plane && k == 1 {
            return [end; 2];
        }
        if self.covers_all {
            return [(end - thickness).max(0.5 * end); 2];
        }
        let middle = if k == 0 { outward * position } else { 0.0 };
        match rounding {
            // The material may slide out from under the punch.
            Rounding::Sharp => [middle + 0.5 * half, middle + half + 0.5 * thickness],
            Rounding::AlongX3 { .. } if k == 1 => [half; 2],
            Rounding::AlongX3 { radius, .. } => {
                let flat = self.form.flat();
                [middle + 0.5 * flat, middle + flat + radius.max(6.0 * thickness)]
            }
            Rounding::Ball { radius } => [0.0, radius.min(4.0 * thickness)],
        }
    }

    /// The zone of the map of an indenter on or above an unloaded layer.
    fn of_resting_indenter(&self, distance: f64) -> Result<Option<Zone>, SceneError> {
        let tolerance = self.case.electrostatics.map_or(1e-2, |settings| settings.relative_tolerance);
        let Some(film) = Films::new(self.case, tolerance).next() else { return Ok(None) };
        let thickness = self.pad[1];
        let image = |x: [f64; 3]| x;
        let under = Under { image: &image, surface: thickness, thickness, film };
        let is_half = !self.is_plane || self.form.position == 0.0;
        let Some(map) = IndenterMap::new(self.form, thickness + distance, &under, is_half) else {
            return Ok(None);
        };
        let map = map.between_walls(&self.scene.domain).ok_or(SceneError::IndenterAtWall)?;
        Ok(Some(Zone { least: map.zone(thickness), most: map.zone(0.0) }))
    }

    /// Checks the walls around a pressed indenter. Returns the reason that the step may fail.
    ///
    /// # Errors
    /// The indenter reaches a wall in any case.
    fn check_walls(&self) -> Result<Option<SceneError>, SceneError> {
        let IndenterForm { position, half_widths: [along, across], rounding, height } = self.form;
        let (domain, thickness) = (&self.scene.domain, self.pad[1]);
        // The least half width of the box of the indenter.
        let least = match rounding {
            Rounding::Sharp => 0.5 * along,
            Rounding::AlongX3 { .. } => 0.5 * self.form.flat(),
            Rounding::Ball { radius } => 0.3 * radius,
        };
        let across = match rounding {
            Rounding::Ball { .. } => [least, across],
            Rounding::Sharp | Rounding::AlongX3 { .. } => [across; 2],
        };
        let reaches = |along: f64, across: f64| {
            position - along <= domain.min[0]
                || position + along >= domain.max[0]
                || -across <= domain.min[2]
                || across >= domain.max[2]
        };
        // The wall above the layer sinks with its top.
        let [top, highest] =
            [self.compression[1], self.compression[0]].map(|c| domain.max[1] - c * thickness);
        let is_box = rounding == Rounding::Sharp;
        let low = thickness * (1.0 - self.compression[1]) + if is_box { height } else { 0.0 };
        let high = 1.5 * thickness + if is_box { height } else { 1.6 * height };
        if reaches(least, across[0]) || low >= highest {
            return Err(SceneError::IndenterAtWall);
        }
        Ok((reaches(along, across[1]) || high >= top).then_some(SceneError::IndenterAtWall))
    }

    /// The zone of the map of an indenter that is pressed into the layer.
    fn of_indenter(&self) -> Zone {
        let IndenterForm { position, half_widths, rounding, height } = self.form;
        let (domain, thickness) = (&self.scene.domain, self.pad[1]);
        let bulge = |k: usize| match (rounding, k) {
            (Rounding::Sharp, 0) => 1.5 * thickness,
            (Rounding::Sharp | Rounding::AlongX3 { .. }, _) if k == 1 => thickness,
            _ => (2.0 * half_widths[k]).max(thickness),
        };
        let beside = |k: usize| [half_widths[k] + thickness, half_widths[k] + bulge(k)];
        let [along, across] = [beside(0), beside(1)];
        let up = (0.5 * height).max(thickness);
        let zone = |which: usize, low: f64, high: f64| {
            let region = Box3 {
                min: [position - along[which], low, -across[which]],
                max: [position + along[which], high, across[which]],
            };
            Box3 {
                min: [0, 1, 2].map(|a| region.min[a].max(domain.min[a])),
                max: [0, 1, 2].map(|a| region.max[a].min(domain.max[a])),
            }
        };
        let lowest = thickness * (1.0 - self.compression[1]);
        Zone {
            least: zone(0, thickness, (lowest + up).max(thickness)),
            most: zone(1, 0.0, 1.5 * thickness + 1.6 * height + up),
        }
    }
}

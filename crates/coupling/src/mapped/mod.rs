//! Scenes of boxes and maps that carry these to where the load puts layer, electrodes and indenter.
//!
//! A map has two parts. That of the layer takes the surface, and electrodes in the layer, to where the finite elements put them:
//! [`pair_frame`] for a pair alone, [`surface`] for any bodies in the layer and for none. The other, [`indenter`], makes a
//! round indenter of a box above the surface. Any map that takes faces of bodies to their places gives the same capacitances.

mod axes;
mod beyond;
mod contact;
mod films;
mod foretold;
mod in_layer;
mod indenter;
mod pair_frame;
mod profile;
mod remembered;
mod room;
mod surface;

use std::sync::Arc;

use elastocap_case::{Case, Mechanics, Pose};
use elastocap_electrostatics::{MapAxis, SceneMap};
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::surfaces::{Corners, SurfaceBody};
use elastocap_geometry::scene::{Body, Box3, Purpose, Scene};
use elastocap_geometry::shapes::Shape;

use crate::deform::{Displacement, FiniteElementStep, Material, Rods};
use crate::scene::in_layer::{lowered, scale_of_heights};
use crate::scene::indenter::{IndenterForm, Rounding, edges_left_out};
use crate::scene::neutral::indenter_in_field;
use crate::scene::{DeformedScene, SceneError};
use axes::{joined, pieces};
use beyond::level_beyond;
use contact::{Surface, edges};
use films::Contact;
pub(crate) use films::{Film, Films};
pub(crate) use foretold::in_the_way;
use in_layer::InLayer;
use indenter::{IndenterMap, Under, last_within};
use pair_frame::Frame;
use profile::Profile;
use remembered::Remembered;
use room::Others;
use surface::{Below, Bent, SurfaceMap};

/// A scene under a map.
pub(crate) struct BentScene {
    /// The boxes before the map.
    pub(crate) scene: Scene,
    pub(crate) map: Arc<SceneMap>,
    /// How far faces of electrodes and the surface lie from where the finite elements put them, over the distances that matter: an
    /// estimate of the relative error of capacitances.
    pub(crate) deviation: f64,
    /// The part of it that the film between indenter and layer leaves.
    pub(crate) film_error: f64,
    /// The relative error of capacitances for a surface that is level where the map ends: an estimate.
    pub(crate) beyond: f64,
}

/// The name of what fills the film between indenter and layer where the two touch.
const FILM: &str = "layer in contact";

/// Smallest volume of a blend below the surface, over that before the map, that is taken.
const LEAST_VOLUME: f64 = 0.15;

/// Sides into which the edges of boxes are divided for a viewer.
const SHOWN: usize = 16;

impl BentScene {
    /// The bent bodies for a viewer, cut off at the `window`; without the cover, which is everywhere else.
    pub(crate) fn surfaces(&self, window: &Box3) -> Vec<SurfaceBody> {
        let conductors = self.scene.conductors().map(|c| c.body);
        let shown = conductors.chain(self.scene.dielectrics().map(|d| d.body));
        let surface = |body: &Body| {
            let regions = body.boxes().unwrap_or_default();
            let triangles = regions.iter().flat_map(|region| self.surface(region, window)).collect();
            SurfaceBody { name: body.name.clone(), role: BodyRole::from(body), triangles }
        };
        shown.filter(|body| body.purpose != Purpose::Cover && body.name != FILM).map(surface).collect()
    }

    /// How far from the origin anything lies that is a conductor or bent, m.
    pub(crate) fn reach(&self) -> f64 {
        let hulls = self.scene.conductors().filter_map(|own| own.body.bounds());
        let faces = hulls.flat_map(|hull| hull.min.into_iter().chain(hull.max));
        let bent = self.map.axes().iter().flat_map(|axis| axis.breaks.iter().copied());
        faces.chain(bent).map(f64::abs).filter(|x| x.is_finite()).fold(0.0, f64::max)
    }

    /// The faces of a box under the map, seen from outside.
    fn surface(&self, region: &Box3, window: &Box3) -> Vec<Corners> {
        let places = [0, 1, 2].map(|a| {
            let ends = [region.min[a].max(window.min[a]), region.max[a].min(window.max[a])];
            (0..=SHOWN).map(|i| ends[0] + (ends[1] - ends[0]) * i as f64 / SHOWN as f64).collect::<Vec<f64>>()
        });
        let mut out = Vec::new();
        for axis in 0..3 {
            for at in [places[axis][0], places[axis][SHOWN]] {
                let mut own = places.clone();
                own[axis] = vec![at];
                let points = self.map.images(&own);
                // The other two axes, in the order of the array.
                let point = |s: usize, t: usize| points[s * (SHOWN + 1) + t];
                // Around x1 and x3 the two follow right-handed, around x2 left-handed.
                let outward = (at == places[axis][SHOWN]) == (axis != 1);
                for (s, t) in (0..SHOWN).flat_map(|s| (0..SHOWN).map(move |t| (s, t))) {
                    let [a, b, c, d] = [point(s, t), point(s + 1, t), point(s + 1, t + 1), point(s, t + 1)];
                    out.extend(if outward { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                }
            }
        }
        out
    }
}

/// The map of the layer.
enum LayerMap<'a> {
    Pair(&'a Frame, &'a Material<'a>),
    Surface(&'a SurfaceMap<'a>),
}

impl LayerMap<'_> {
    fn image(&self, x: [f64; 3]) -> [f64; 3] {
        match self {
            // The solved quarter, and its mirror images.
            Self::Pair(frame, material) => {
                let to = frame.image([x[0].abs(), x[1], x[2].abs()], material);
                [to[0].copysign(x[0]), to[1], to[2].copysign(x[2])]
            }
            Self::Surface(own) => own.image(x),
        }
    }

    fn surface(&self) -> f64 {
        match self {
            Self::Pair(frame, _) => frame.surface(),
            Self::Surface(own) => own.surface(),
        }
    }

    /// Whether it is its own mirror image across x1 = 0 and across x3 = 0.
    fn mirrored(&self) -> [bool; 2] {
        match self {
            Self::Pair(..) => [true; 2],
            Self::Surface(own) => own.mirrored(),
        }
    }

    /// All that it bends above the substrate.
    fn zone(&self) -> Box3 {
        match self {
            Self::Pair(frame, _) => frame.zone(),
            Self::Surface(own) => own.zone(),
        }
    }

    /// The height of the highest electrode in the layer, m.
    fn highest(&self) -> f64 {
        match self {
            Self::Pair(frame, _) => frame.highest(),
            Self::Surface(own) => own.highest(),
        }
    }

    /// The shortest side of the electrodes in the surface, m; infinite without any.
    fn narrowest(&self) -> f64 {
        match self {
            Self::Pair(..) => f64::INFINITY,
            Self::Surface(own) => own.narrowest(),
        }
    }
}

/// The result of the layer's finite elements for a step.
pub(crate) struct Found<'a> {
    pub(crate) step: &'a FiniteElementStep,
    /// The displacement of the layer.
    pub(crate) displacement: &'a Displacement<'a>,
    /// How indenter and what is attached are moved besides; the distance of the indenter is zero from contact on.
    pub(crate) pose: &'a Pose,
}

/// The scene of a layer by finite elements under a map, with what lies between it and a round indenter. `None` where the planes of the
/// bodies do not ascend.
///
/// # Errors
/// A body or a wall in the way of the map.
pub(crate) fn bent_scene(
    case: &Case,
    deformed: &DeformedScene,
    found: &Found<'_>,
    film: Film,
) -> Result<Option<BentScene>, SceneError> {
    let Some(layer) = &case.layer else { return Ok(None) };
    let step = found.step;
    let is_plane = matches!(case.mechanics, Some(Mechanics::PlaneStrain(_)));
    let is_half = !is_plane || step.curves.half;
    let looked_up = |x: [f64; 3]| found.displacement.at(x);
    let remembered = Remembered::new(&looked_up);
    let solved = |x: [f64; 3]| remembered.at(x);
    let Some(material) = Material::of(case, is_half, &solved) else { return Ok(None) };
    let (pad, tiny) = (material.pad, material.tiny);
    let displacement = |x: [f64; 3]| material.displacement(x);
    // What presses bends the surface, whether it is part of the field or not.
    let own = indenter_in_field(case);
    let form = IndenterForm::of(case, own.and_then(|own| own.height));
    let in_field = form.filter(|_| own.is_some());
    let distance = found.pose.distance;
    let lowest = step.deformed_thickness + distance;
    let others = Others::of(case, &deformed.scene, step.deformed_thickness - layer.thickness, found.pose)?;
    let top = |x: f64, z: f64| {
        let u = displacement([x, pad[1], z]);
        [x + u[0], pad[1] + u[1], z + u[2]]
    };
    let rods = Rods::of(case);
    let contrast = layer.relative_permittivity.unwrap_or(1.0) / cover_permittivity(&deformed.scene);
    let is_in_layer = case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
    // A pair among other bodies is one of them.
    let scale = scale_of_heights(case, step);
    let covers_all = case.mechanics.is_some_and(|mechanics| mechanics.covers_all());
    let pair = case.electrodes.as_ref().map(|own| own.regions().map(|region| lowered(&region, scale)));
    let scene = pair.map_or_else(|| deformed.scene.clone(), |regions| deformed.with_pair(regions));
    let joined = |part: &LayerMap<'_>| -> Result<Option<BentScene>, SceneError> {
        let rests = distance > 0.0 && (step.deformed_thickness - layer.thickness).abs() < tiny;
        let parts = Parts {
            layer: part,
            rests,
            form: in_field,
            lowest,
            film,
            pad,
            tiny,
            contrast,
            rods: &rods,
            others: &others,
            scale,
        };
        let scene = match part {
            LayerMap::Pair(frame, _) => frame.scene(deformed, step),
            LayerMap::Surface(own) => Some(own.scene(&scene)),
        };
        let Some(mut scene) = scene else { return Ok(None) };
        let Some(mut bent) = parts.join(&mut scene, is_half, layer.relative_permittivity.unwrap_or(1.0))?
        else {
            return Ok(None);
        };
        if !parts.rests && !covers_all {
            let image = |x: [f64; 3]| part.image(x);
            bent.beyond = level_beyond(&scene, &image, part.surface(), layer.thickness, &material, is_plane);
        }
        Ok(Some(bent))
    };
    let mut bent = match &case.electrodes {
        Some(electrodes) if !is_in_layer => {
            if !is_half {
                return Ok(None);
            }
            // Under a punch the surface bends sharply at its edges, whether it is part of the field or not.
            let has_edges = |form: &IndenterForm| form.has_flat_face() && form.half_widths[0] < pad[0];
            let followed = form.filter(|form| in_field.is_some() || has_edges(form));
            let cover = followed.map_or([0.0; 2], |form| {
                let gap = |x: f64, z: f64| {
                    let place = [x.abs(), z.abs()];
                    lowest + form.lower_side(x, z) - material.height_at([place[0], pad[1], place[1]], place)
                };
                covered(&form, distance, &gap)
            });
            let Some(frame) = Frame::new(deformed, electrodes, step, &material, cover, &others) else {
                return Ok(None);
            };
            let Some(mut bent) = joined(&LayerMap::Pair(&frame, &material))? else { return Ok(None) };
            let gap = deformed.pair.map_or(layer.thickness, |pair| pair.gap);
            bent.deviation = bent.deviation.max(frame.deviation(&bent.map, &material, gap));
            bent
        }
        Some(_) | None => {
            let Some(form) = form else { return Ok(None) };
            let mut corners = if covers_all {
                // The layer bulges within a thickness of its ends, which the field does not have.
                let before_end = |a: usize| (pad[a] - pad[1]).max(0.5 * pad[a]);
                [vec![-before_end(0), before_end(0)], vec![before_end(2)]]
            } else {
                match corners(&form, lowest, &top, pad[1], film, is_half) {
                    Some(corners) => corners,
                    None => return Ok(None),
                }
            };
            if is_plane {
                corners[1] = vec![pad[2]];
            }
            let inside = InLayer::of(case, scale, pair.as_ref().map_or(&[][..], |regions| &regions[..]));
            let with = |below: Below| {
                let (electrodes, corners) = (highest_electrode(&scene, layer.thickness), corners.clone());
                let thickness = layer.thickness;
                let bodies = inside.clone();
                let bent = Bent { below, electrodes, thickness, corners, is_plane, is_half, scale, bodies };
                joined(&LayerMap::Surface(&SurfaceMap::new(&scene, &others, bent, &displacement)))
            };
            let blend = if is_in_layer { None } else { Some(with(Below::Blend)?) };
            let is_wide = |bent: &BentScene| bent.map.smallest_volume([0.0, layer.thickness]) >= LEAST_VOLUME;
            match blend {
                Some(None) => return Ok(None),
                Some(Some(blend)) if is_wide(&blend) => blend,
                Some(Some(_)) | None => {
                    let Some(material) = with(Below::Material)? else { return Ok(None) };
                    material
                }
            }
        }
    };
    if own.is_some() {
        let edges = edges_left_out(case);
        bent.deviation += 0.25 * edges / pad[1];
    }
    Ok(Some(bent))
}

/// The height of the highest face of a conductor in the layer, m.
fn highest_electrode(scene: &Scene, thickness: f64) -> f64 {
    let bodies = scene.conductors().filter(|own| own.body.purpose != Purpose::Indenter);
    let tops = bodies.flat_map(|own| own.body.boxes().unwrap_or_default()).map(|region| region.max[1]);
    tops.filter(|top| *top < thickness).fold(0.0, f64::max)
}

/// The permittivity of what lies above the layer.
fn cover_permittivity(scene: &Scene) -> f64 {
    let cover = scene.dielectrics().find(|d| d.body.purpose == Purpose::Cover);
    cover.map_or(scene.background_permittivity, |d| d.relative_permittivity)
}

/// How far along x1 and x3 the surface must be followed under an indenter at this distance, with this gap below it.
fn covered(form: &IndenterForm, distance: f64, gap: &dyn Fn(f64, f64) -> f64) -> [f64; 2] {
    if distance > 0.0 {
        return [0.0; 2];
    }
    let [along, across] = form.half_widths;
    match form.rounding {
        Rounding::Ball { radius } => {
            let contact = last_within(&|x| gap(x, 0.0), 1e-2 * radius, 0.0, radius);
            [1.2 * contact; 2]
        }
        Rounding::AlongX3 { radius, is_cylinder: true } => {
            [1.2 * last_within(&|x| gap(x, 0.0), 1e-2 * radius, 0.0, radius), across]
        }
        Rounding::Sharp | Rounding::AlongX3 { .. } => [along, across],
    }
}

/// The material points along x1 and x3 at which the surface under an indenter bends sharply, given where its points go; `None` where it
/// does not leave the indenter. `thickness` is that of the layer, m.
fn corners(
    form: &IndenterForm,
    lowest: f64,
    top: &dyn Fn(f64, f64) -> [f64; 3],
    thickness: f64,
    film: Film,
    is_half: bool,
) -> Option<[Vec<f64>; 2]> {
    let [along, across] = form.half_widths;
    let middle = form.position;
    if let Some(profile) = Profile::of(form) {
        let image = |x: f64| {
            let to = top(middle + x, 0.0);
            [to[0] - middle, to[1] - lowest]
        };
        let contact = Contact::of(form, film, lowest - top(middle, 0.0)[1]);
        let surface = Surface { image: &image, thickness, contact };
        let [left, right] = edges(&profile, &surface, is_half)?;
        let both = left.marks.iter().map(|x| middle - x).chain(right.marks.iter().map(|x| middle + x));
        return Some([both.collect(), vec![across]]);
    }
    // The material point that comes to lie at a place.
    let material = |place: f64, axis: usize| {
        let mut x = place;
        for _ in 0..20 {
            let to = if axis == 0 { top(x, 0.0) } else { top(0.0, x) };
            x += place - to[axis];
        }
        x
    };
    Some(match form.rounding {
        Rounding::Ball { radius } => {
            let gap = |x: f64| {
                let to = top(x, 0.0);
                lowest + form.lower_side(to[0], 0.0) - to[1]
            };
            let touching = Contact::Film(film.thickness).touching();
            let contact = last_within(&gap, touching, 0.0, radius.min(4.0 * thickness));
            [vec![-contact, contact], vec![contact]]
        }
        Rounding::Sharp | Rounding::AlongX3 { .. } => {
            let [left, right] = [middle - along, middle + along].map(|x| material(x, 0));
            [vec![left, right], vec![material(across, 2)]]
        }
    })
}

/// The parts of a map, to be joined.
struct Parts<'a> {
    layer: &'a LayerMap<'a>,
    /// Whether the indenter does not touch the layer, which therefore stays as it is.
    rests: bool,
    form: Option<IndenterForm>,
    /// The height of the indenter's lowest point, m.
    lowest: f64,
    film: Film,
    /// Half length, thickness and half width of the layer before loading, m.
    pad: [f64; 3],
    tiny: f64,
    /// The permittivity of the layer over that of what is above it.
    contrast: f64,
    /// The rods of the bodies in the layer: see [`Rods`].
    rods: &'a Rods,
    /// The bodies that are not bent along with the layer.
    others: &'a Others,
    /// Heights of the boxes of the layer over those of its material before loading, where bodies lie in it.
    scale: f64,
}

impl Parts<'_> {
    /// `None` where the surface does not leave the indenter.
    fn join(
        &self,
        scene: &mut Scene,
        is_half: bool,
        permittivity: f64,
    ) -> Result<Option<BentScene>, SceneError> {
        let (layer, surface) = (self.layer, self.layer.surface());
        let at_rest = |x: [f64; 3]| layer.image(x);
        let under = |image| Under { image, surface, thickness: self.pad[1], film: self.film };
        let indenter = match self.form {
            None => None,
            Some(form) => {
                let Some(own) = IndenterMap::new(form, self.lowest, &under(&at_rest), is_half) else {
                    return Ok(None);
                };
                Some(own.between_walls(&scene.domain).ok_or(SceneError::IndenterAtWall)?)
            }
        };
        let highest = layer.highest();
        let lowered = |x: [f64; 3]| {
            let mut to = layer.image(x);
            if let Some(own) = &indenter {
                let film = own.lowered(x, highest, &under(&at_rest));
                (0..3).for_each(|a| to[a] += film[a]);
            }
            to
        };
        let remembered = Remembered::new(&lowered);
        let lowered = |x: [f64; 3]| remembered.at(x);
        let below = under(&lowered);
        let face = |c: [f64; 3]| indenter.as_ref().map_or([0.0; 3], |own| own.on_face(c, &below));
        let faces = Remembered::new(&face);
        let on_face = |c: [f64; 3]| faces.at(c);
        let exact = |x: [f64; 3]| {
            let to = lowered(x);
            let more = indenter.as_ref().map_or([0.0; 3], |own| own.displacement(x, &on_face));
            [0, 1, 2].map(|a| to[a] - x[a] + more[a])
        };
        let of_layer = match layer {
            LayerMap::Pair(frame, _) => frame.axes(),
            LayerMap::Surface(own) => own.axes(self.tiny),
        };
        let mut all = of_layer.each_ref().map(|axis| {
            let mut own = if self.rests { Vec::new() } else { pieces(axis) };
            if axis.mirrored && !self.rests {
                own.extend(
                    pieces(axis).into_iter().map(|p| axes::Piece::new(-p.ends[1], -p.ends[0], p.degree)),
                );
            }
            own
        });
        if let Some(own) = &indenter {
            for (all, more) in all.iter_mut().zip(own.pieces()) {
                all.extend(more);
            }
            if own.film() > 0.0 {
                all[1].push(axes::Piece::new(highest, surface, 1));
            }
        }
        let [along, across] = layer.mirrored();
        let mirrored = [is_half && along, false, across];
        let axes: [MapAxis; 3] = [0, 1, 2].map(|a| joined(&all[a], self.tiny, mirrored[a]));
        if !self.rests {
            self.others.check(&layer.zone())?;
        }
        if let Some(own) = &indenter {
            self.others.check(&own.zone(highest))?;
        }
        let map = SceneMap::new(axes, exact);
        let map = match indenter.as_ref().and_then(IndenterMap::rounded) {
            Some(rounded) => map.with_rounded(rounded),
            None => map,
        };
        let mut film_error = 0.0;
        if let Some(own) = &indenter {
            // Over a sheet in the surface the field falls off within about half of its width.
            let distance = (surface - highest).min(0.5 * layer.narrowest());
            film_error = own.film_error(distance, self.contrast);
            let filled: Vec<Shape> = own.filled().into_iter().map(Shape::Box).collect();
            for body in scene.bodies.iter_mut().filter(|body| body.purpose == Purpose::Indenter) {
                body.parts = vec![Shape::Box(own.region())];
                if own.is_joined() {
                    body.parts.extend(filled.iter().cloned());
                }
            }
            if let Some(first) = filled.first().cloned().filter(|_| !own.is_joined()) {
                let body = Body::dielectric(FILM, first, permittivity).with_purpose(Purpose::Layer);
                scene.bodies.push(Body { parts: filled, ..body });
            }
        }
        let of_box = |x: [f64; 3]| [x[0], self.scale * x[1], x[2]];
        let position = |x: [f64; 3]| {
            let (x, u) = (of_box(x), exact(of_box(x)));
            [0, 1, 2].map(|a| x[a] + u[a])
        };
        let lengths = self.rods.lengths(&position);
        let mapped = self.rods.lengths(&|x| map.image(of_box(x)));
        let of_rods = self.rods.error(mapped.iter().zip(&lengths).map(|(own, length)| own / length - 1.0));
        let deviation = self.deviation(&map, &exact, surface, highest).max(of_rods) + film_error;
        Ok(Some(BentScene { scene: scene.clone(), map: Arc::new(map), deviation, film_error, beyond: 0.0 }))
    }

    /// How far the polynomials leave surface and indenter, over the distance from the electrodes.
    fn deviation(
        &self,
        map: &SceneMap,
        exact: &dyn Fn([f64; 3]) -> [f64; 3],
        surface: f64,
        highest: f64,
    ) -> f64 {
        const COUNT: usize = 9;
        let axis = |a: usize| -> Vec<f64> {
            let breaks = &map.axes()[a].breaks;
            let ends = [breaks.first().copied().unwrap_or(0.0), breaks.last().copied().unwrap_or(0.0)];
            (0..COUNT * COUNT).map(|k| ends[0] + (ends[1] - ends[0]) * (k as f64 + 0.5) / 81.0).collect()
        };
        let (x, z) = (axis(0), axis(2));
        let z: Vec<f64> = z.into_iter().skip(COUNT / 2).step_by(COUNT).collect();
        let images = map.images(&[x.clone(), vec![surface], z.clone()]);
        let mut sum = 0.0;
        for (i, x) in x.iter().enumerate() {
            for (k, z) in z.iter().enumerate() {
                let to = exact([*x, surface, *z]);
                sum += (images[i * COUNT + k][1] - surface - to[1]).powi(2);
            }
        }
        (sum / images.len().max(1) as f64).sqrt() / (surface - highest).max(self.tiny)
    }
}

//! Scenes of axis-aligned boxes, and the maps that deform them into the loaded layer, electrodes and
//! indenter.
//!
//! A map has two parts. The map of the layer moves its surface, and electrodes in the layer, to their
//! positions in the finite-element solution: [`pair_frame`] for a pair of electrodes alone, [`surface`] for
//! any bodies in the layer or for none. The map of the indenter, [`indenter`], turns a box above the surface
//! into a round indenter. All maps that agree on the faces of the bodies give the same capacitances.

mod axes;
mod contact;
mod films;
mod in_layer;
mod indenter;
mod level_outside;
mod memoized;
mod obstacles;
mod pair_frame;
mod profile;
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
use contact::{Surface, edges};
use films::Contact;
pub(crate) use films::{Film, Films};
use in_layer::InLayer;
use indenter::{IndenterMap, Under, last_within};
use level_outside::level_beyond;
use memoized::Memoized;
pub(crate) use obstacles::in_the_way;
use pair_frame::Frame;
use profile::Profile;
use room::Others;
use surface::{Below, Bent, SurfaceMap};

/// A scene under a map.
pub(crate) struct BentScene {
    /// The scene of boxes before the map.
    pub(crate) scene: Scene,
    /// The map of the whole scene.
    pub(crate) map: Arc<SceneMap>,
    /// The distance of the mapped electrode faces and surface from their finite-element positions, over the
    /// gap or height that it distorts: an estimate of the relative error of capacitances.
    pub(crate) deviation: f64,
    /// The part of `deviation` that is due to the film between indenter and layer.
    pub(crate) film_error: f64,
    /// The estimated relative error of capacitances because the surface is taken as level outside the map.
    pub(crate) beyond: f64,
}

/// The name of the body that fills the film between indenter and layer in the contact.
const FILM: &str = "layer in contact";

/// Smallest ratio of mapped to unmapped volume below the surface for which [`Below::Blend`] is used.
const LEAST_VOLUME: f64 = 0.15;

/// Segments per edge of a box in the surfaces for a viewer.
const SEGMENTS: usize = 16;

impl BentScene {
    /// The bent bodies for a viewer, clipped to the `window`; without the cover, which fills the rest of the
    /// space.
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

    /// Largest distance (m), along an axis, of a face of a conductor or of a break of the map from the
    /// origin.
    pub(crate) fn reach(&self) -> f64 {
        let hulls = self.scene.conductors().filter_map(|conductor| conductor.body.bounds());
        let faces = hulls.flat_map(|hull| hull.min.into_iter().chain(hull.max));
        let bent = self.map.axes().iter().flat_map(|axis| axis.breaks.iter().copied());
        faces.chain(bent).map(f64::abs).filter(|x| x.is_finite()).fold(0.0, f64::max)
    }

    /// The mapped faces of a box as triangles that are oriented outwards.
    fn surface(&self, region: &Box3, window: &Box3) -> Vec<Corners> {
        let places = [0, 1, 2].map(|a| {
            let ends = [region.min[a].max(window.min[a]), region.max[a].min(window.max[a])];
            (0..=SEGMENTS)
                .map(|i| ends[0] + (ends[1] - ends[0]) * i as f64 / SEGMENTS as f64)
                .collect::<Vec<f64>>()
        });
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for at in [places[axis][0], places[axis][SEGMENTS]] {
                let mut grid = places.clone();
                grid[axis] = vec![at];
                let points = self.map.images(&grid);
                // The other two axes, in the order of the array.
                let point = |s: usize, t: usize| points[s * (SEGMENTS + 1) + t];
                // The order of the other two axes is right-handed about x1 and x3, and left-handed about x2.
                let outward = (at == places[axis][SEGMENTS]) == (axis != 1);
                for (s, t) in (0..SEGMENTS).flat_map(|s| (0..SEGMENTS).map(move |t| (s, t))) {
                    let [a, b, c, d] = [point(s, t), point(s + 1, t), point(s + 1, t + 1), point(s, t + 1)];
                    triangles.extend(if outward { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                }
            }
        }
        triangles
    }
}

/// The map of the layer.
enum LayerMap<'a> {
    /// That of a layer that contains only a pair of electrodes.
    Pair(&'a Frame, &'a Material<'a>),
    /// That of a layer with any bodies in it, or none.
    Surface(&'a SurfaceMap<'a>),
}

impl LayerMap<'_> {
    /// The image of a point, m.
    fn image(&self, x: [f64; 3]) -> [f64; 3] {
        match self {
            // The frame covers one quarter; the others are its mirror images.
            Self::Pair(frame, material) => {
                let to = frame.image([x[0].abs(), x[1], x[2].abs()], material);
                [to[0].copysign(x[0]), to[1], to[2].copysign(x[2])]
            }
            Self::Surface(map) => map.image(x),
        }
    }

    /// The height of the surface before the map, m.
    fn surface(&self) -> f64 {
        match self {
            Self::Pair(frame, _) => frame.surface(),
            Self::Surface(map) => map.surface(),
        }
    }

    /// Whether the map is mirror-symmetric about x1 = 0 and about x3 = 0.
    fn mirrored(&self) -> [bool; 2] {
        match self {
            Self::Pair(..) => [true; 2],
            Self::Surface(map) => map.mirrored(),
        }
    }

    /// The region above the substrate that the map changes.
    fn zone(&self) -> Box3 {
        match self {
            Self::Pair(frame, _) => frame.zone(),
            Self::Surface(map) => map.zone(),
        }
    }

    /// The height of the highest electrode below the surface before the map, m.
    fn highest(&self) -> f64 {
        match self {
            Self::Pair(frame, _) => frame.highest(),
            Self::Surface(map) => map.highest(),
        }
    }

    /// The shortest side of the electrodes in the surface, m; infinite without such electrodes.
    fn narrowest(&self) -> f64 {
        match self {
            Self::Pair(..) => f64::INFINITY,
            Self::Surface(map) => map.narrowest(),
        }
    }
}

/// The finite-element solution of the layer for one step.
pub(crate) struct LayerSolution<'a> {
    /// Thicknesses and outlines of the deformed layer.
    pub(crate) step: &'a FiniteElementStep,
    /// The displacement of the layer.
    pub(crate) displacement: &'a Displacement<'a>,
    /// The pose of the indenter and of attached bodies; the distance of the indenter is zero once it touches
    /// the layer.
    pub(crate) pose: &'a Pose,
}

/// The scene of a layer solved by finite elements under its map, including the space between layer and a
/// round indenter. `None` where no valid map exists: planes of bodies coincide or cross, or the surface does
/// not separate from the indenter.
///
/// # Errors
/// A body or a wall lies where the map would change it.
pub(crate) fn bent_scene(
    case: &Case,
    deformed: &DeformedScene,
    solution: &LayerSolution<'_>,
    film: Film,
) -> Result<Option<BentScene>, SceneError> {
    let Some(layer) = &case.layer else { return Ok(None) };
    let step = solution.step;
    let is_plane = matches!(case.mechanics, Some(Mechanics::PlaneStrain(_)));
    let is_half = !is_plane || step.curves.half;
    let looked_up = |x: [f64; 3]| solution.displacement.at(x);
    let memoized = Memoized::new(&looked_up);
    let solved = |x: [f64; 3]| memoized.at(x);
    let Some(material) = Material::of(case, is_half, &solved) else { return Ok(None) };
    let (pad, tiny) = (material.pad, material.tiny);
    let displacement = |x: [f64; 3]| material.displacement(x);
    // The indenter bends the surface whether or not it is part of the field.
    let indenter = indenter_in_field(case);
    let form = IndenterForm::of(case, indenter.and_then(|indenter| indenter.height));
    let in_field = form.filter(|_| indenter.is_some());
    let distance = solution.pose.distance;
    let lowest = step.deformed_thickness + distance;
    let others = Others::of(case, &deformed.scene, step.deformed_thickness - layer.thickness, solution.pose)?;
    let top = |x: f64, z: f64| {
        let u = displacement([x, pad[1], z]);
        [x + u[0], pad[1] + u[1], z + u[2]]
    };
    let rods = Rods::of(case);
    let contrast = layer.relative_permittivity.unwrap_or(1.0) / cover_permittivity(&deformed.scene);
    let is_in_layer = case.bodies.iter().any(|body| body.purpose == Purpose::InLayer);
    // A pair among other bodies in the layer is treated like these.
    let scale = scale_of_heights(case, step);
    let covers_all = case.mechanics.is_some_and(|mechanics| mechanics.covers_all());
    let pair = case.electrodes.as_ref().map(|pair| pair.regions().map(|region| lowered(&region, scale)));
    let scene = pair.map_or_else(|| deformed.scene.clone(), |regions| deformed.with_pair(regions));
    let scene_under = |part: &LayerMap<'_>| -> Result<Option<BentScene>, SceneError> {
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
            LayerMap::Surface(map) => Some(map.scene(&scene)),
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
            // The surface bends sharply at the edges of a punch, even if the punch is not part of the field.
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
            let Some(mut bent) = scene_under(&LayerMap::Pair(&frame, &material))? else { return Ok(None) };
            let gap = deformed.pair.map_or(layer.thickness, |pair| pair.gap);
            bent.deviation = bent.deviation.max(frame.deviation(&bent.map, &material, gap));
            bent
        }
        Some(_) | None => {
            let Some(form) = form else { return Ok(None) };
            let mut corners = if covers_all {
                // The ends of the layer, within one thickness of which it bulges, are not part of the field.
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
            let bent_with = |below: Below| {
                let (electrodes, corners) = (highest_electrode(&scene, layer.thickness), corners.clone());
                let thickness = layer.thickness;
                let bodies = inside.clone();
                let bent = Bent { below, electrodes, thickness, corners, is_plane, is_half, scale, bodies };
                scene_under(&LayerMap::Surface(&SurfaceMap::new(&scene, &others, bent, &displacement)))
            };
            let blend = if is_in_layer { None } else { Some(bent_with(Below::Blend)?) };
            let is_wide = |bent: &BentScene| bent.map.smallest_volume([0.0, layer.thickness]) >= LEAST_VOLUME;
            match blend {
                Some(None) => return Ok(None),
                Some(Some(blend)) if is_wide(&blend) => blend,
                Some(Some(_)) | None => {
                    let Some(material) = bent_with(Below::Material)? else { return Ok(None) };
                    material
                }
            }
        }
    };
    if indenter.is_some() {
        let edges = edges_left_out(case);
        bent.deviation += 0.25 * edges / pad[1];
    }
    Ok(Some(bent))
}

/// The height of the highest conductor face below the surface of the layer, m.
fn highest_electrode(scene: &Scene, thickness: f64) -> f64 {
    let conductors = scene.conductors().map(|conductor| conductor.body);
    let bodies = conductors.filter(|body| body.purpose != Purpose::Indenter);
    let tops = bodies.flat_map(|body| body.boxes().unwrap_or_default()).map(|region| region.max[1]);
    tops.filter(|top| *top < thickness).fold(0.0, f64::max)
}

/// The relative permittivity of the cover, or of the background without one.
fn cover_permittivity(scene: &Scene) -> f64 {
    let cover = scene.dielectrics().find(|d| d.body.purpose == Purpose::Cover);
    cover.map_or(scene.background_permittivity, |d| d.relative_permittivity)
}

/// The half widths along x1 and x3 (m) within which the map follows the surface under an indenter at this
/// `distance` from the layer, given the `gap` below it.
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

/// The coordinates along x1 and x3 of the material points at which the surface under an indenter bends
/// sharply. `lowest` is the height of the indenter's lowest point, `top` gives the deformed position of a
/// point of the surface, and `thickness` is the thickness of the layer, m. `None` where the surface does not
/// separate from the indenter.
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
        let marks = left.marks.iter().map(|x| middle - x).chain(right.marks.iter().map(|x| middle + x));
        return Some([marks.collect(), vec![across]]);
    }
    // The material point whose deformed coordinate along `axis` is `place`.
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

/// The map of the layer and what the map of the indenter depends on, which are combined into one.
struct Parts<'a> {
    /// The map of the layer.
    layer: &'a LayerMap<'a>,
    /// Whether the indenter does not touch the layer, which is therefore undeformed.
    rests: bool,
    /// The form of the indenter, if it is part of the field.
    form: Option<IndenterForm>,
    /// The height of the indenter's lowest point, m.
    lowest: f64,
    /// The film in the contact.
    film: Film,
    /// Half length, thickness and half width of the layer before loading, m.
    pad: [f64; 3],
    /// The length, m, below which differences of coordinates are ignored.
    tiny: f64,
    /// The permittivity of the layer over that of the medium above it.
    contrast: f64,
    /// The rods of the bodies in the layer: see [`Rods`].
    rods: &'a Rods,
    /// The bodies that do not deform with the layer.
    others: &'a Others,
    /// Height of the boxes in the layer over the height of their material before loading.
    scale: f64,
}

impl Parts<'_> {
    /// Combines the map of the layer and that of the indenter, and adapts the bodies of the scene to them.
    /// `permittivity` is the relative one of the layer. `None` where the surface does not separate from the
    /// indenter.
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
                let Some(map) = IndenterMap::new(form, self.lowest, &under(&at_rest), is_half) else {
                    return Ok(None);
                };
                Some(map.between_walls(&scene.domain).ok_or(SceneError::IndenterAtWall)?)
            }
        };
        let highest = layer.highest();
        let lowered = |x: [f64; 3]| {
            let mut to = layer.image(x);
            if let Some(indenter) = &indenter {
                let film = indenter.lowered(x, highest, &under(&at_rest));
                (0..3).for_each(|a| to[a] += film[a]);
            }
            to
        };
        let memoized = Memoized::new(&lowered);
        let lowered = |x: [f64; 3]| memoized.at(x);
        let below = under(&lowered);
        let displacement_of_face =
            |c: [f64; 3]| indenter.as_ref().map_or([0.0; 3], |indenter| indenter.on_face(c, &below));
        let faces = Memoized::new(&displacement_of_face);
        let on_face = |c: [f64; 3]| faces.at(c);
        let exact = |x: [f64; 3]| {
            let to = lowered(x);
            let more = indenter.as_ref().map_or([0.0; 3], |indenter| indenter.displacement(x, &on_face));
            [0, 1, 2].map(|a| to[a] - x[a] + more[a])
        };
        let of_layer = match layer {
            LayerMap::Pair(frame, _) => frame.axes(),
            LayerMap::Surface(map) => map.axes(self.tiny),
        };
        let mut all_pieces = of_layer.each_ref().map(|axis| {
            let mut axis_pieces = if self.rests { Vec::new() } else { pieces(axis) };
            if axis.mirrored && !self.rests {
                axis_pieces.extend(
                    pieces(axis).into_iter().map(|p| axes::Piece::new(-p.ends[1], -p.ends[0], p.degree)),
                );
            }
            axis_pieces
        });
        if let Some(indenter) = &indenter {
            for (axis_pieces, more) in all_pieces.iter_mut().zip(indenter.pieces()) {
                axis_pieces.extend(more);
            }
            if indenter.film() > 0.0 {
                all_pieces[1].push(axes::Piece::new(highest, surface, 1));
            }
        }
        let [along, across] = layer.mirrored();
        let mirrored = [is_half && along, false, across];
        let axes: [MapAxis; 3] = [0, 1, 2].map(|a| joined(&all_pieces[a], self.tiny, mirrored[a]));
        if !self.rests {
            self.others.check(&layer.zone())?;
        }
        if let Some(indenter) = &indenter {
            self.others.check(&indenter.zone(highest))?;
        }
        let map = SceneMap::new(axes, exact);
        let map = match indenter.as_ref().and_then(IndenterMap::rounded) {
            Some(rounded) => map.with_rounded(rounded),
            None => map,
        };
        let mut film_error = 0.0;
        if let Some(indenter) = &indenter {
            // The field of a sheet in the surface decays over about half the width of the sheet.
            let distance = (surface - highest).min(0.5 * layer.narrowest());
            film_error = indenter.film_error(distance, self.contrast);
            let filled: Vec<Shape> = indenter.filled().into_iter().map(Shape::Box).collect();
            for body in scene.bodies.iter_mut().filter(|body| body.purpose == Purpose::Indenter) {
                body.parts = vec![Shape::Box(indenter.region())];
                if indenter.is_joined() {
                    body.parts.extend(filled.iter().cloned());
                }
            }
            if let Some(first) = filled.first().cloned().filter(|_| !indenter.is_joined()) {
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
        let of_rods =
            self.rods.error(mapped.iter().zip(&lengths).map(|(mapped, exact)| mapped / exact - 1.0));
        let deviation = self.deviation(&map, &exact, surface, highest).max(of_rods) + film_error;
        Ok(Some(BentScene { scene: scene.clone(), map: Arc::new(map), deviation, film_error, beyond: 0.0 }))
    }

    /// The root mean square, on the surface, of the difference between the height by the polynomials and the
    /// exact one, over the distance of the surface from the highest electrode.
    fn deviation(
        &self,
        map: &SceneMap,
        exact: &dyn Fn([f64; 3]) -> [f64; 3],
        surface: f64,
        highest: f64,
    ) -> f64 {
        // Not tuned: the places only have to be close together.
        const COUNT: usize = 9;
        let axis = |a: usize| -> Vec<f64> {
            let breaks = &map.axes()[a].breaks;
            let ends = [breaks.first().copied().unwrap_or(0.0), breaks.last().copied().unwrap_or(0.0)];
            (0..COUNT * COUNT)
                .map(|k| ends[0] + (ends[1] - ends[0]) * (k as f64 + 0.5) / (COUNT * COUNT) as f64)
                .collect()
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

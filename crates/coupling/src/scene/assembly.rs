//! Assembles all bodies of a case into a scene.

use elastocap_geometry::scene::{Body, Box3, Purpose, Scene};
use elastocap_geometry::shapes::Shape;

use super::attached::Tilt;
use super::electrodes::{self, Placed};
use super::neutral::neutral_bodies;
use super::walls::outer_walls;
use super::{DeformedScene, ElectrodePlace, SceneError, attached, contacts, in_layer, indenter};
use crate::deform::Deformation;
use elastocap_case::{Case, Extent, Face, Pose, Terminal};

/// The scene of `case` with its layer in `state` (`None` for the unloaded layer), and with attached bodies
/// moved as `pose` says.
///
/// Its conductors are the electrodes, the conducting bodies and the indenter; those of a terminal are one
/// conductor. Its dielectrics are the layer, the substrate, the cover, the dielectric bodies and the
/// indenter. The indenter is represented by its bounding box.
///
/// # Errors
/// When the deformed bodies do not fit together: see [`SceneError`].
pub fn scene_of(
    case: &Case,
    state: Option<&Deformation<'_>>,
    pose: &Pose,
) -> Result<DeformedScene, SceneError> {
    let surroundings = case.surroundings.as_ref().ok_or(SceneError::Missing("[surroundings]"))?;
    let mut bodies = Vec::new();
    let (mut pair, mut electrodes_are_bent) = (None, false);
    if let Some(electrodes) = &case.electrodes {
        let layer = case.layer.as_ref().ok_or(SceneError::Missing("[layer]"))?;
        let placed: Placed = electrodes::electrodes(electrodes, layer, state)?;
        for (name, region) in electrodes.names().into_iter().zip(placed.regions) {
            bodies.push(Body::conductor(name, Shape::Box(region)).with_purpose(Purpose::Electrode));
        }
        (pair, electrodes_are_bent) = (Some(placed.pair), placed.are_bent);
    }
    let sinks =
        case.layer.as_ref().zip(state).map_or(0.0, |(layer, s)| s.deformed_thickness() - layer.thickness);
    let with_layer = in_layer::with_material(case, state)?;
    let beside = attached::moved(with_layer, sinks, pose)?;
    let fixed = |conductors: bool| beside.iter().filter(move |body| body.is_conductor() == conductors);
    bodies.extend(fixed(true).cloned());
    let top = case.layer.as_ref().map(|layer| state.map_or(layer.thickness, Deformation::deformed_thickness));
    let lowest = top.unwrap_or(0.0) + pose.distance;
    let tilt = Tilt::of(&beside, pose);
    let touched = contacts::check(case, &bodies, state, lowest, (pose, tilt.as_ref()))?.map(str::to_owned);
    let indenter = top.and_then(|_| indenter::body(case, lowest));
    let (metal, indenter) = match indenter {
        Some(indenter) if indenter.is_conductor() => (Some(indenter), None),
        other => (None, other),
    };
    let conductors: Vec<(&str, Box3)> =
        bodies.iter().chain(&metal).filter_map(|body| Some((body.name.as_str(), body.bounds()?))).collect();
    let (domain, walls) = outer_walls(case, surroundings, top.unwrap_or(0.0), &conductors)?;
    if let (Some(pair), Some(electrodes)) = (&mut pair, &case.electrodes) {
        pair.places = places_of(electrodes.names(), &case.terminals, &bodies);
    }
    // Taken before terminals are joined, whose bodies may be attached or not.
    let mut stays: Vec<Body> = Vec::new();
    if tilt.is_some() {
        stays.extend(bodies.iter().chain(&metal).filter(|body| !attached::is_attached(body)).cloned());
    }
    let mut bodies = case.joined(bodies);
    match (metal, touched) {
        (Some(metal), Some(with)) => contacts::join(&mut bodies, &case.terminals, &with, metal),
        (metal, _) => bodies.extend(metal),
    }
    if let (Some(layer), Some(top)) = (&case.layer, top) {
        let compression = state.map_or(0.0, Deformation::compression);
        let permittivity = layer
            .permittivity_at(compression)
            .ok_or(SceneError::Missing("relative_permittivity in [layer]"))?;
        let mut slabs = vec![("layer", Purpose::Layer, [0.0, top], permittivity)];
        if let Extent::AroundLayer { below, above, .. } = &surroundings.extent {
            if let Face::Medium { relative_permittivity, thickness, .. } = *below {
                let depth = thickness.unwrap_or(f64::INFINITY);
                slabs.push(("substrate", Purpose::Substrate, [-depth, 0.0], relative_permittivity));
            }
            if let Face::Medium { relative_permittivity, thickness, .. } = *above {
                let depth = thickness.unwrap_or(f64::INFINITY);
                slabs.push(("cover", Purpose::Cover, [top, top + depth], relative_permittivity));
            }
        }
        for (name, purpose, [low, high], relative_permittivity) in slabs {
            let mut slab = Box3::SPACE;
            (slab.min[1], slab.max[1]) = (low, high);
            let body = Body::dielectric(name, Shape::Box(slab), relative_permittivity).with_purpose(purpose);
            bodies.extend(cut_at_walls(body, &domain));
        }
    }
    let background_permittivity = surroundings.relative_permittivity;
    let slabs = bodies.iter().filter(|body| !body.is_conductor());
    let dielectrics: Vec<&Body> = fixed(false).chain(&indenter).chain(slabs).collect();
    let neutral = neutral_bodies(&dielectrics, background_permittivity);
    let not_neutral: Vec<Body> = fixed(false)
        .enumerate()
        .filter(|(place, _)| !neutral.contains(place))
        .map(|(_, body)| body.clone())
        .collect();
    if bodies.iter().chain(&not_neutral).all(|body| body.boxes().is_some()) {
        bodies.extend(not_neutral.into_iter().filter_map(|body| cut_at_walls(body, &domain)));
    } else {
        // The mesher cuts bodies at the walls itself.
        bodies.extend(not_neutral);
    }
    bodies.extend(indenter);
    let tilt = match tilt {
        None => None,
        Some(tilt) => {
            let is_other = |body: &&Body| matches!(body.purpose, Purpose::Fixed | Purpose::Indenter);
            let others = bodies.iter().filter(|body| !body.is_conductor()).filter(is_other).chain(&stays);
            Some(attached::tilted(&tilt, others, &domain)?)
        }
    };
    let scene = Scene { bodies, background_permittivity, domain, walls };
    Ok(DeformedScene { scene, pair, electrodes_are_bent, tilt })
}

/// The positions of the electrodes of these names once `bodies` are joined to terminals. Each electrode has
/// one part, and the electrodes come first.
fn places_of(names: [&str; 2], terminals: &[Terminal], bodies: &[Body]) -> [ElectrodePlace; 2] {
    let joined = Terminal::join(terminals, bodies.to_vec());
    let place = |name: &str, earlier: &[&str]| {
        let terminal = terminals.iter().find(|terminal| terminal.holds(name));
        let joined_name = terminal.map_or(name, |terminal| terminal.name.as_str());
        let conductor = joined.iter().position(|body| body.name == joined_name).unwrap_or(0);
        let part = earlier.iter().filter(|other| terminal.is_some_and(|t| t.holds(other))).count();
        ElectrodePlace { conductor, part }
    };
    [place(names[0], &[]), place(names[1], &names[..1])]
}

/// A body of boxes without the faces that lie outside the walls; `None` if nothing of it is inside.
fn cut_at_walls(mut body: Body, domain: &Box3) -> Option<Body> {
    body.parts = body.boxes()?.iter().filter_map(|region| within(region, domain)).map(Shape::Box).collect();
    (!body.parts.is_empty()).then_some(body)
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

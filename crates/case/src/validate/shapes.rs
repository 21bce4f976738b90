//! Checks bodies of any shape, for the solver on tetrahedra.

use std::ops::Range;
use std::path::Path;

use elastocap_geometry::import::obj::{Placement, surface_from_path};
use elastocap_geometry::scene::Purpose;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Body, Box3, Electrodes, Extent, Role, Shape, Surroundings, Terminal, Wall};
use super::super::quantities::Position;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::bodies::{
    boxes, check_count, check_names, check_touching_pair, conductor_of, purpose_of, refuse_all_floating,
};
use super::given;
use super::layer_room::{LayerRoom, check_body};
use super::outlines::extruded;
use super::overlaps::{PlacedConductor, check_touching};
use super::placed_boxes::PlacedBoxes;
use super::regions::{AXES, axis_index, box_region, sheet, slab};

/// Whether a body is not a box, sheet or slab.
pub(super) fn any_shaped(raw: &Document) -> bool {
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get);
    conductors.into_iter().any(|c| {
        c.sphere.is_some()
            || c.capsule.is_some()
            || c.shell.is_some()
            || c.cylinder.is_some()
            || c.extrusion.is_some()
            || c.surface.is_some()
    }) || dielectrics.into_iter().any(|d| {
        d.sphere.is_some()
            || d.capsule.is_some()
            || d.cylinder.is_some()
            || d.extrusion.is_some()
            || d.surface.is_some()
    })
}

/// The names of bodies whose outlines have holes, which may have become boxes.
pub(super) fn perforated(raw: &Document) -> Vec<&str> {
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get);
    let bodies = conductors.map(|c| (&c.name, &c.extrusion));
    let bodies = bodies.chain(dielectrics.map(|d| (&d.name, &d.extrusion)));
    let with_holes =
        bodies.filter(|(_, extrusion)| given(extrusion).is_some_and(|outline| outline.holes.is_some()));
    with_holes.filter_map(|(name, _)| Some(name.get()?.0.as_str())).collect()
}

/// A body with the place in the file that gives its shape.
pub(super) type Located = (Body, Range<usize>);

/// All conductors, then all dielectrics; `None` if one of them is invalid, with the reason in the log.
fn placed(
    raw: &Document,
    electrodes: Option<&Electrodes>,
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Vec<Located>> {
    let empty = Vec::new();
    let of_conductors = given(&raw.conductor).unwrap_or(&empty);
    let empty = Vec::new();
    let of_dielectrics = given(&raw.dielectric).unwrap_or(&empty);
    if !check_count(of_conductors.len(), of_dielectrics.len(), log) {
        return None;
    }
    check_names(raw, of_conductors, of_dielectrics, electrodes, log);
    let conductors = of_conductors.iter().map(|read| {
        let raw = read.get()?;
        let (parts, span) = conductor_parts(raw, origin, log)?;
        Some((conductor_of(raw, parts)?, span))
    });
    // Every body is read, so that every mistake is reported.
    let mut located: Vec<Option<Located>> = conductors.collect();
    located.extend(of_dielectrics.iter().map(|read| {
        let raw = read.get()?;
        let (parts, span) = dielectric_parts(raw, origin, log)?;
        let role = Role::Dielectric { relative_permittivity: raw.relative_permittivity.get()?.value };
        let name = raw.name.get()?.0.clone();
        let purpose = purpose_of(&raw.attached);
        Some((Body { name, parts, role, purpose }, span))
    }));
    located.into_iter().collect()
}

/// Whether a body is a shell around the scene.
fn is_shell(body: &Body) -> bool {
    body.parts.iter().any(|part| matches!(part, Shape::Shell { .. }))
}

/// The fixed bodies of a scene with a layer, its electrodes and terminals; `None` if one of them is invalid,
/// with the reason in the log.
pub(super) fn with_layer(
    raw: &Document,
    surroundings: Option<&Surroundings>,
    (electrodes, terminals): (Option<&Electrodes>, &[Terminal]),
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Vec<Body>> {
    let located = placed(raw, electrodes, origin, log)?;
    check_touching(&PlacedConductor::of(&located), terminals, log);
    let layer = LayerRoom::of(raw)?;
    for (body, span) in located.iter().filter(|(body, _)| body.purpose == Purpose::InLayer) {
        match body.boxes() {
            Some(regions) if body.is_conductor() => {
                check_touching_pair((&body.name, span), &regions, (electrodes, terminals), raw, log);
            }
            Some(_) => {}
            None if raw.load.is_some() => log.push(
                Diagnostic::at(
                    span,
                    format!(
                        "how \"{}\" moves with the material of the layer is not known",
                        shown(&body.name)
                    ),
                )
                .label("is neither a box nor a sheet")
                .help("make it of `boxes`, or lay it on a face of the layer"),
            ),
            None => {}
        }
    }
    for (body, span) in &located {
        if let (Some(Surroundings { extent: Extent::AroundLayer { below, above, .. }, .. }), Some(region)) =
            (surroundings, body.bounds())
        {
            let is_slab = (0..3).any(|a| region.extent(a).is_infinite());
            let what = if body.is_conductor() { "conductor" } else { "dielectric" };
            let (name, floating_charge, regions) = (&body.name, None, vec![region]);
            let (purpose, is_boxes, span) = (body.purpose, body.boxes().is_some(), span.clone());
            let body = PlacedBoxes { name, regions, span, what, floating_charge, is_slab, is_boxes, purpose };
            check_body(&body, &layer, [*below, *above], log);
        }
    }
    for (_, span) in located.iter().filter(|(body, _)| is_shell(body)) {
        log.push(
            Diagnostic::at(span, "there is no layer in a shell")
                .label("is metal everywhere outside of a ball")
                .help("end the scene with `boundary = \"grounded\"`, or write the layer as a [[dielectric]]"),
        );
    }
    if electrodes.is_none() {
        check_one_is_driven(&located, log);
    }
    log.is_empty().then(|| located.into_iter().map(|(body, _)| body).collect())
}

/// The bodies of a scene without a layer; `None` if one of them is invalid, with the reason in the log.
pub(super) fn without_layer(
    raw: &Document,
    surroundings: Option<&Surroundings>,
    terminals: &[Terminal],
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Vec<Body>> {
    let located = placed(raw, None, origin, log)?;
    check_touching(&PlacedConductor::of(&located), terminals, log);
    let (domain, wall) = outer(&located, surroundings?, log)?;
    for (body, span) in &located {
        check_inside(body, span, &domain, log);
    }
    for (body, span) in located.iter().filter(|(body, _)| wall == Wall::Grounded && body.is_conductor()) {
        check_apart_from_ground(body, span, &domain, log);
    }
    check_one_is_driven(&located, log);
    log.is_empty().then(|| located.into_iter().map(|(body, _)| body).collect())
}

/// Checks that a conductor is driven: without one there is no capacitance matrix.
pub(super) fn check_one_is_driven(bodies: &[Located], log: &mut Log<'_>) {
    if let Some((body, first)) = bodies.iter().find(|(body, _)| body.is_conductor())
        && !bodies.iter().any(|(body, _)| body.is_driven())
    {
        refuse_all_floating(first, &body.name, log);
    }
}

/// The end of the field: at the walls, at a shell, or nowhere.
fn outer(bodies: &[Located], surroundings: &Surroundings, log: &mut Log<'_>) -> Option<(Box3, Wall)> {
    let mut shells = bodies.iter().filter(|(body, _)| is_shell(body));
    match (shells.next(), shells.next()) {
        (Some(_), Some((_, again))) => {
            log.push(
                Diagnostic::at(again, "a scene has one shell at most")
                    .label("nothing outside a shell is solved")
                    .help("write the inner one as a `sphere`"),
            );
            None
        }
        (Some(_) | None, None) | (None, Some(_)) => {
            surroundings.end_without_layer(bodies.iter().map(|(body, _)| body))
        }
    }
}

/// The parts of a body, and the place in the file that gives them.
type Parts = (Vec<Shape>, Range<usize>);

/// The parts of a conductor; `None` if its shape is invalid, with the reason in the log.
fn conductor_parts(body: &raw::Conductor, origin: &Path, log: &mut Log<'_>) -> Option<Parts> {
    if let Some(read) = &body.r#box {
        return Some((vec![Shape::Box(box_region(read, log)?)], read.span.clone()));
    }
    if let Some(read) = &body.boxes {
        return Some((boxes(read, log)?.into_iter().map(Shape::Box).collect(), read.span.clone()));
    }
    if let Some(read) = &body.sheet {
        return Some((vec![Shape::Box(sheet(read, log)?)], read.span.clone()));
    }
    if let Some(read) = &body.shell {
        let Shape::Sphere { center, radius } = ball(read.get()?)? else { return None };
        return Some((vec![Shape::Shell { center, radius }], read.span.clone()));
    }
    if let Some(read) = &body.capsule {
        return Some((vec![capsule(read.get()?)?], read.span.clone()));
    }
    any_parts(&body.sphere, &body.cylinder, &body.extrusion, &body.surface, true, origin, log)
}

/// The parts of a dielectric; `None` if its shape is invalid, with the reason in the log.
fn dielectric_parts(body: &raw::Dielectric, origin: &Path, log: &mut Log<'_>) -> Option<Parts> {
    if let Some(read) = &body.r#box {
        return Some((vec![Shape::Box(box_region(read, log)?)], read.span.clone()));
    }
    if let Some(read) = &body.slab {
        return Some((vec![Shape::Box(slab(read, log)?)], read.span.clone()));
    }
    if let Some(read) = &body.capsule {
        return Some((vec![capsule(read.get()?)?], read.span.clone()));
    }
    any_parts(&body.sphere, &body.cylinder, &body.extrusion, &body.surface, false, origin, log)
}

/// The parts of a body of one of the shapes that conductors and dielectrics may both have.
fn any_parts(
    sphere: &Option<Read<raw::Ball>>,
    cylinder: &Option<Read<raw::Tube>>,
    extrusion: &Option<Read<raw::Extruded>>,
    surface: &Option<Read<raw::SurfaceFile>>,
    may_be_flat: bool,
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Parts> {
    if let Some(read) = sphere {
        return Some((vec![ball(read.get()?)?], read.span.clone()));
    }
    if let Some(read) = cylinder {
        return Some((vec![round(read.get()?, may_be_flat, log)?], read.span.clone()));
    }
    if let Some(read) = extrusion {
        return Some((extruded(read.get()?, may_be_flat, log)?, read.span.clone()));
    }
    let read = surface.as_ref()?;
    Some((vec![imported(read.get()?, origin, log)?], read.span.clone()))
}

/// The coordinates of a point, m.
fn point(read: &[Read<Position>; 3]) -> Option<[f64; 3]> {
    Some([read[0].get()?.si, read[1].get()?.si, read[2].get()?.si])
}

/// A ball, if its values could be read.
fn ball(raw: &raw::Ball) -> Option<Shape> {
    Some(Shape::Sphere { center: point(raw.center.get()?)?, radius: raw.radius.get()?.si })
}

/// A capsule, if its values could be read.
fn capsule(raw: &raw::Capsule) -> Option<Shape> {
    let (from, to) = (point(raw.from.get()?)?, point(raw.to.get()?)?);
    Some(Shape::Capsule { from, to, radius: raw.radius.get()?.si })
}

/// A cylinder or disc, or a tube or ring.
fn round(raw: &raw::Tube, may_be_flat: bool, log: &mut Log<'_>) -> Option<Shape> {
    let (axis, base) = (axis_index(*raw.axis.get()?), point(raw.base.get()?)?);
    let (radius, height) = (raw.radius.get()?.si, raw.height.get()?.si);
    if height == 0.0 && !may_be_flat {
        log.push(
            Diagnostic::at(&raw.height.span, "a dielectric without thickness has no effect")
                .label("must be greater than zero")
                .help("only a conductor may be a disc without thickness"),
        );
        return None;
    }
    let Some(inner_radius) = given(&raw.inner_radius) else {
        return raw.inner_radius.is_none().then_some(Shape::Cylinder { axis, base, radius, height });
    };
    let inner = inner_radius.si;
    if inner >= radius {
        let span = raw.inner_radius.as_ref().map_or(&raw.radius.span, |read| &read.span);
        log.push(
            Diagnostic::at(span, "the tube is inside-out: `inner_radius` must be less than `radius`")
                .label("not less than `radius`")
                .related(&raw.radius.span, "`radius`")
                .help("the wall of the tube lies between the two radii"),
        );
        return None;
    }
    Some(Shape::Tube { axis, base, radii: [inner, radius], height })
}

/// The surface in a file; `None` if it cannot be used, with the reason in the log.
fn imported(raw: &raw::SurfaceFile, origin: &Path, log: &mut Log<'_>) -> Option<Shape> {
    let file = &raw.file.get()?.0;
    let translate = match &raw.translate {
        Some(read) => point(read.get()?)?,
        None => [0.0; 3],
    };
    let unit = raw.unit.get()?.si;
    let path = origin.parent().unwrap_or(Path::new("")).join(file);
    match surface_from_path(&path, Placement { unit, translate }) {
        Ok((surface, _)) => Some(Shape::Surface(surface)),
        Err(error) => {
            log.push(
                Diagnostic::at(&raw.file.span, format!("the surface cannot be used: {}", error.problem))
                    .label(format!("read from {}", shown(&path.display().to_string())))
                    .help("a surface is an OBJ file of a closed body; its path is relative to the case file"),
            );
            None
        }
    }
}

/// Checks that a body lies inside the walls.
fn check_inside(body: &Body, span: &Range<usize>, domain: &Box3, log: &mut Log<'_>) {
    let Some(region) = body.bounds() else { return };
    // Slabs are cut off at the walls.
    let bounded = |a: usize| region.min[a].is_finite() || region.max[a].is_finite();
    let outside = |a: usize| bounded(a) && (region.min[a] < domain.min[a] || region.max[a] > domain.max[a]);
    if let Some(axis) = (0..3).find(|&a| outside(a)) {
        log.push(
            Diagnostic::at(
                span,
                format!("\"{}\" reaches outside the walls along {}", shown(&body.name), AXES[axis]),
            )
            .label("not inside the walls")
            .help("make `walls` in [surroundings] larger, or move the body"),
        );
    }
}

/// Checks that a conductor does not touch a grounded wall.
fn check_apart_from_ground(body: &Body, span: &Range<usize>, domain: &Box3, log: &mut Log<'_>) {
    let Some(region) = body.bounds() else { return };
    if let Some(axis) = (0..3).find(|&a| region.min[a] == domain.min[a] || region.max[a] == domain.max[a]) {
        log.push(
            Diagnostic::at(
                span,
                format!("\"{}\" touches the grounded wall along {}", shown(&body.name), AXES[axis]),
            )
            .label("shares a point with the walls")
            .help("leave a gap between the two"),
        );
    }
}

//! Converts conductors and dielectrics of boxes, sheets and slabs. Checks their number and names, that
//! conductors do not touch, and that all bodies lie where there is a field.

use std::collections::BTreeMap;
use std::ops::Range;

use elastocap_geometry::scene::{Potential, Purpose};

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Body, Box3, Electrodes, Extent, Role, Shape, Surroundings, Terminal, Wall};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Text;
use super::given;
use super::layer_room::{LayerRoom, check_body};
use super::overlaps::check_touching;
use super::placed_boxes::PlacedBoxes;
use super::regions::{AXES, box_or_sheet, box_region, sheet, slab};

/// The largest number of conductors: the results are matrices of this size.
const MAX_CONDUCTORS: usize = 1_000;

/// The largest number of dielectrics.
const MAX_DIELECTRICS: usize = 5_000;

/// Checks the number of bodies; `false` if there are too many.
pub(super) fn check_count(conductors: usize, dielectrics: usize, log: &mut Log<'_>) -> bool {
    for (what, count, limit) in
        [("conductors", conductors, MAX_CONDUCTORS), ("dielectrics", dielectrics, MAX_DIELECTRICS)]
    {
        if count > limit {
            log.push_sole(
                Diagnostic::of_file(format!(
                    "{count} {what} are more than elastocap takes, which is {limit}"
                ))
                .help("leave some out, or make several parts one body with an OBJ file"),
            );
            return false;
        }
    }
    true
}

/// All conductors, then all dielectrics, if all of them are boxes, sheets and slabs; `None` if one of them is
/// invalid.
pub(super) fn bodies(
    raw: &Document,
    surroundings: Option<&Surroundings>,
    electrodes: Option<&Electrodes>,
    terminals: &[Terminal],
    log: &mut Log<'_>,
) -> Option<Vec<Body>> {
    let empty = Vec::new();
    let of_conductors = given(&raw.conductor).unwrap_or(&empty);
    let empty = Vec::new();
    let of_dielectrics = given(&raw.dielectric).unwrap_or(&empty);
    if !check_count(of_conductors.len(), of_dielectrics.len(), log) {
        return None;
    }
    let conductors: Vec<_> = of_conductors.iter().map(|read| conductor(read, log)).collect();
    let dielectrics: Vec<_> = of_dielectrics.iter().map(|read| dielectric(read, log)).collect();
    check_names(raw, of_conductors, of_dielectrics, electrodes, log);

    check_touching(
        &conductors.iter().flatten().map(PlacedBoxes::conductor).collect::<Vec<_>>(),
        terminals,
        log,
    );
    let in_layer = conductors.iter().flatten().filter(|body| body.purpose == Purpose::InLayer);
    for body in in_layer {
        check_touching_pair((body.name, &body.span), &body.regions, (electrodes, terminals), raw, log);
    }
    let layer = LayerRoom::of(raw);
    let walls_span = given(&raw.surroundings).and_then(|s| s.walls.as_ref()).map(|walls| walls.span.clone());
    for body in conductors.iter().chain(&dielectrics).flatten() {
        match surroundings.map(|s| (&s.extent, s.boundary)) {
            Some((Extent::Walls(walls), boundary)) => {
                check_in_walls(body, walls, boundary, walls_span.as_ref(), log);
            }
            Some((Extent::AroundLayer { below, above, .. }, _)) => {
                if let Some(layer) = &layer {
                    check_body(body, layer, [*below, *above], log);
                }
            }
            Some((Extent::Everywhere, _)) | None => {}
        }
    }
    check_one_is_driven(&conductors, raw, log);

    let conductors = conductors.into_iter().zip(of_conductors);
    let parts = |placed: PlacedBoxes<'_>| placed.regions.into_iter().map(Shape::Box).collect::<Vec<_>>();
    let conductors = conductors.map(|(placed, read)| conductor_of(read.get()?, parts(placed?)));
    let dielectrics = dielectrics.into_iter().zip(of_dielectrics).map(|(placed, read)| {
        let placed = placed?;
        let relative_permittivity = read.get()?.relative_permittivity.get()?.value;
        let (name, purpose) = (placed.name, placed.purpose);
        let body = Body::dielectric(name, Shape::Box(Box3::SPACE), relative_permittivity);
        Some(Body { parts: parts(placed), ..body.with_purpose(purpose) })
    });
    conductors.chain(dielectrics).collect()
}

/// The conductor with these parts, floating if it has a charge and otherwise held at a potential.
pub(super) fn conductor_of(raw: &raw::Conductor, parts: Vec<Shape>) -> Option<Body> {
    let charge = match &raw.charge {
        Some(read) => Some(read.get()?.si),
        None => None,
    };
    let role = Role::Conductor { potential: Potential::of_charge(charge) };
    Some(Body { name: raw.name.get()?.0.clone(), parts, role, purpose: purpose_of(&raw.attached) })
}

/// The purpose of a body, by what it is attached to.
pub(super) fn purpose_of(attached: &Option<Read<raw::Attached>>) -> Purpose {
    match given(attached) {
        Some(raw::Attached::Layer) => Purpose::InLayer,
        Some(raw::Attached::LayerTop) => Purpose::OnTop,
        Some(raw::Attached::Indenter) => Purpose::OnIndenter,
        Some(raw::Attached::Fixed) | None => Purpose::Fixed,
    }
}

/// The boxes of one conductor; `None` if any of them is invalid.
pub(super) fn boxes(read: &Read<Vec<Read<raw::BoxRegion>>>, log: &mut Log<'_>) -> Option<Vec<Box3>> {
    let entries = read.get()?;
    if entries.is_empty() {
        log.push(
            Diagnostic::at(&read.span, "`boxes` of a conductor has no box in it")
                .label("a conductor is somewhere")
                .help("list boxes, for example `{ min = [.., .., ..], max = [.., .., ..] }`"),
        );
        return None;
    }
    let boxes: Vec<Option<Box3>> = entries.iter().map(|entry| box_or_sheet(entry, log)).collect();
    boxes.into_iter().collect()
}

/// The boxes of a conductor; `None` if they are invalid, with the reason in the log.
fn conductor<'a>(read: &'a Read<raw::Conductor>, log: &mut Log<'_>) -> Option<PlacedBoxes<'a>> {
    let raw = read.get()?;
    let (regions, span) = match (&raw.r#box, &raw.sheet, &raw.boxes) {
        (Some(read), ..) => (box_region(read, log).map(|region| vec![region]), read.span.clone()),
        (None, Some(read), _) => (sheet(read, log).map(|region| vec![region]), read.span.clone()),
        (None, None, Some(read)) => (boxes(read, log), read.span.clone()),
        (None, None, None) => return None,
    };
    let floating_charge = match &raw.charge {
        Some(read) => Some(read.get()?.si),
        None => None,
    };
    let (name, regions) = (&raw.name.get()?.0, regions?);
    let purpose = purpose_of(&raw.attached);
    Some(PlacedBoxes {
        name,
        regions,
        span,
        what: "conductor",
        floating_charge,
        is_slab: false,
        is_boxes: true,
        purpose,
    })
}

/// The box or slab of a dielectric; `None` if it is invalid, with the reason in the log.
fn dielectric<'a>(read: &'a Read<raw::Dielectric>, log: &mut Log<'_>) -> Option<PlacedBoxes<'a>> {
    let raw = read.get()?;
    let (region, span, is_slab) = match (&raw.r#box, &raw.slab) {
        (Some(read), _) => (box_region(read, log), read.span.clone(), false),
        (None, Some(read)) => (slab(read, log), read.span.clone(), true),
        (None, None) => return None,
    };
    let (name, regions) = (&raw.name.get()?.0, vec![region?]);
    let purpose = purpose_of(&raw.attached);
    Some(PlacedBoxes {
        name,
        regions,
        span,
        what: "dielectric",
        floating_charge: None,
        is_slab,
        is_boxes: true,
        purpose,
    })
}

/// Checks that no two bodies have the same name, electrodes included.
pub(super) fn check_names(
    raw: &Document,
    conductors: &[Read<raw::Conductor>],
    dielectrics: &[Read<raw::Dielectric>],
    electrodes: Option<&Electrodes>,
    log: &mut Log<'_>,
) {
    let mut seen: BTreeMap<&str, &Range<usize>> = BTreeMap::new();
    if let (Some(electrodes), Some(read)) = (electrodes, raw.pair()) {
        seen.extend(electrodes.names().map(|name| (name, &read.span)));
    }
    let names = conductors.iter().filter_map(|c| c.get().map(|c| &c.name));
    let names = names.chain(dielectrics.iter().filter_map(|d| d.get().map(|d| &d.name)));
    for name in names {
        let Some(Text(text)) = name.get() else { continue };
        if let Some(first) = seen.get(text.as_str()) {
            log.push(
                Diagnostic::at(&name.span, format!("the name \"{}\" is used twice", shown(text)))
                    .label("used again")
                    .related(first, "first used here")
                    .help(format!("write for example `name = \"{} 2\"`", shown(text))),
            );
        } else {
            seen.insert(text, &name.span);
        }
    }
}

/// Checks that a conductor in the layer shares a point with the pair of electrodes only if a terminal joins
/// them.
pub(super) fn check_touching_pair(
    (body, span): (&str, &Range<usize>),
    regions: &[Box3],
    (electrodes, terminals): (Option<&Electrodes>, &[Terminal]),
    raw: &Document,
    log: &mut Log<'_>,
) {
    let (Some(electrodes), Some(pair)) = (electrodes, raw.pair()) else { return };
    for (name, region) in electrodes.names().into_iter().zip(electrodes.regions()) {
        let touches = regions.iter().any(|part| part.touches(&region));
        if touches && !Terminal::joins(terminals, name, body) {
            log.push(
                Diagnostic::at(
                    span,
                    format!("the conductor \"{}\" touches the electrode \"{name}\"", shown(body)),
                )
                .label("shares a point with it")
                .related(&pair.span, format!("\"{name}\" is here"))
                .help("leave a gap between the two, or join them in one [[terminal]]"),
            );
            return;
        }
    }
}

/// Checks that a body lies inside the walls, a slab at least in part, and a conductor apart from grounded
/// ones.
fn check_in_walls(
    body: &PlacedBoxes<'_>,
    walls: &Box3,
    boundary: Wall,
    walls_span: Option<&Range<usize>>,
    log: &mut Log<'_>,
) {
    let (regions, what, name) = (&body.regions, body.what, shown(body.name));
    let mut report = |message: String, label: &str, help: &str| {
        let mut diagnostic = Diagnostic::at(&body.span, message).label(label).help(help);
        if let Some(span) = walls_span {
            diagnostic = diagnostic.related(span, "the walls");
        }
        log.push(diagnostic);
    };
    if body.is_slab {
        // A slab is cut off at the walls; only one entirely outside of them is a mistake.
        let misses =
            |region: &Box3| (0..3).any(|a| region.max[a] <= walls.min[a] || region.min[a] >= walls.max[a]);
        if regions.iter().all(misses) {
            report(
                format!("the slab \"{name}\" lies outside the walls"),
                "of no effect",
                "move it, or leave it out",
            );
        }
        return;
    }
    let outside = |a: usize, region: &Box3| region.min[a] < walls.min[a] || region.max[a] > walls.max[a];
    let at_wall =
        |region: &Box3| (0..3).any(|a| region.min[a] == walls.min[a] || region.max[a] == walls.max[a]);
    if let Some(axis) = (0..3).find(|&a| regions.iter().any(|region| outside(a, region))) {
        report(
            format!("the {what} \"{name}\" reaches outside the walls along {}", AXES[axis]),
            "not inside the walls",
            "make `walls` in [surroundings] larger, or move the body",
        );
    } else if boundary == Wall::Grounded && what == "conductor" && regions.iter().any(at_wall) {
        report(
            format!("the conductor \"{name}\" touches the grounded wall, which would short it"),
            "shares a point with the walls",
            "leave a gap between the two",
        );
    }
}

/// Checks that a conductor is held at a potential: if all of them float, there is no capacitance matrix.
fn check_one_is_driven(conductors: &[Option<PlacedBoxes<'_>>], raw: &Document, log: &mut Log<'_>) {
    let all_float = conductors.iter().all(|c| c.as_ref().is_some_and(|b| b.floating_charge.is_some()));
    let (true, None, Some(first)) = (all_float, raw.pair(), conductors.iter().flatten().next()) else {
        return;
    };
    let charge = given(&raw.conductor).and_then(|bodies| bodies.first()?.get()?.charge.as_ref());
    refuse_all_floating(charge.map_or(&first.span, |read| &read.span), first.name, log);
}

/// The error for conductors that all float; `name` is that of the first one.
pub(super) fn refuse_all_floating(span: &Range<usize>, name: &str, log: &mut Log<'_>) {
    log.push(
        Diagnostic::at(span, "all conductors float: a capacitance needs one that is held at a potential")
            .label(format!("\"{}\" floats, and so do the others", shown(name)))
            .help("leave out `charge` of at least one [[conductor]], which is then held at a potential"),
    );
}

//! Checks that conductors and dielectrics do not get in one another's way and lie where there is a field.

use std::collections::BTreeMap;
use std::ops::Range;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Body, Box3, Electrodes, Extent, Face, Shape, Surroundings, Wall};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Text;
use super::layered::micrometres;
use super::regions::{AXES, box_region, sheet, slab};
use super::{any, given};

/// More conductors than this are refused: the results would be matrices of this size.
const MAX_CONDUCTORS: usize = 1_000;

/// More dielectrics than this are refused.
const MAX_DIELECTRICS: usize = 5_000;

/// Refuses more bodies than there can be; whether there are few enough.
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

/// A conductor or dielectric by the box around it, with the place in the file that says where it is.
pub(super) struct PlacedBox<'a> {
    pub(super) name: &'a str,
    pub(super) region: Box3,
    pub(super) span: Range<usize>,
    pub(super) what: &'static str,
    pub(super) floating_charge: Option<f64>,
    pub(super) is_slab: bool,
}

/// All conductors, then all dielectrics, where all of them are boxes, sheets and slabs; `None` if one of them cannot be used.
pub(super) fn bodies(
    raw: &Document,
    surroundings: Option<&Surroundings>,
    electrodes: Option<&Electrodes>,
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

    check_touching(&conductors, log);
    let thickness = given(&raw.layer).and_then(|layer| layer.thickness.get()).map(|h| h.si);
    let walls_span = given(&raw.surroundings).and_then(|s| s.walls.as_ref()).map(|walls| walls.span.clone());
    for body in conductors.iter().chain(&dielectrics).flatten() {
        match surroundings.map(|s| (&s.extent, s.boundary)) {
            Some((Extent::Walls(walls), boundary)) => {
                check_in_walls(body, walls, boundary, walls_span.as_ref(), log);
            }
            Some((Extent::AroundLayer { below, above, .. }, boundary)) => {
                if let Some(thickness) = thickness {
                    check_fixed_body(body, thickness, [*below, *above], boundary, log);
                }
            }
            Some((Extent::Everywhere, _)) | None => {}
        }
    }
    if let Some(surroundings) = surroundings {
        check_flux_has_an_end(&conductors, electrodes, raw, surroundings, log);
    }
    check_one_is_driven(&conductors, raw, log);

    let conductors = conductors.into_iter().zip(of_conductors);
    let conductors = conductors.map(|(placed, read)| conductor_of(read.get()?, Shape::Box(placed?.region)));
    let dielectrics = dielectrics.into_iter().zip(of_dielectrics).map(|(placed, read)| {
        let placed = placed?;
        let relative_permittivity = read.get()?.relative_permittivity.get()?.value;
        Some(Body::dielectric(placed.name, Shape::Box(placed.region), relative_permittivity))
    });
    conductors.chain(dielectrics).collect()
}

/// The conductor of this shape, driven or floating.
pub(super) fn conductor_of(raw: &raw::Conductor, shape: Shape) -> Option<Body> {
    let name = &raw.name.get()?.0;
    Some(match &raw.charge {
        Some(read) => Body::floating(name, shape, read.get()?.si),
        None => Body::conductor(name, shape),
    })
}

fn conductor<'a>(read: &'a Read<raw::Conductor>, log: &mut Log<'_>) -> Option<PlacedBox<'a>> {
    let raw = read.get()?;
    let (region, span) = match (&raw.r#box, &raw.sheet) {
        (Some(read), _) => (box_region(read, log), read.span.clone()),
        (None, Some(read)) => (sheet(read, log), read.span.clone()),
        (None, None) => return None,
    };
    let floating_charge = match &raw.charge {
        Some(read) => Some(read.get()?.si),
        None => None,
    };
    let (name, region) = (&raw.name.get()?.0, region?);
    Some(PlacedBox { name, region, span, what: "conductor", floating_charge, is_slab: false })
}

fn dielectric<'a>(read: &'a Read<raw::Dielectric>, log: &mut Log<'_>) -> Option<PlacedBox<'a>> {
    let raw = read.get()?;
    let (region, span, is_slab) = match (&raw.r#box, &raw.slab) {
        (Some(read), _) => (box_region(read, log), read.span.clone(), false),
        (None, Some(read)) => (slab(read, log), read.span.clone(), true),
        (None, None) => return None,
    };
    let (name, region) = (&raw.name.get()?.0, region?);
    Some(PlacedBox { name, region, span, what: "dielectric", floating_charge: None, is_slab })
}

pub(super) fn check_names(
    raw: &Document,
    conductors: &[Read<raw::Conductor>],
    dielectrics: &[Read<raw::Dielectric>],
    electrodes: Option<&Electrodes>,
    log: &mut Log<'_>,
) {
    let mut seen: BTreeMap<&str, &Range<usize>> = BTreeMap::new();
    if let (Some(electrodes), Some(read)) = (electrodes, &raw.electrodes) {
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

/// Two conductors that share a point are one conductor, and it must be said which.
fn check_touching(conductors: &[Option<PlacedBox<'_>>], log: &mut Log<'_>) {
    let bodies: Vec<_> = conductors.iter().flatten().collect();
    for (k, second) in bodies.iter().enumerate() {
        for first in &bodies[..k] {
            if log.is_full() {
                return;
            }
            if first.region.touches(&second.region) {
                let (a, b) = (shown(first.name), shown(second.name));
                log.push(
                    Diagnostic::at(
                        &second.span,
                        format!("the conductors \"{a}\" and \"{b}\" touch or overlap"),
                    )
                    .label(format!("\"{b}\" shares a point with \"{a}\""))
                    .related(&first.span, format!("\"{a}\" is here"))
                    .help("leave a gap between the two, or write them as one conductor"),
                );
            }
        }
    }
}

fn check_in_walls(
    body: &PlacedBox<'_>,
    walls: &Box3,
    boundary: Wall,
    walls_span: Option<&Range<usize>>,
    log: &mut Log<'_>,
) {
    let (region, what, name) = (&body.region, body.what, shown(body.name));
    let mut at = |message: String, label: &str, help: &str| {
        let mut diagnostic = Diagnostic::at(&body.span, message).label(label).help(help);
        if let Some(span) = walls_span {
            diagnostic = diagnostic.related(span, "the walls");
        }
        log.push(diagnostic);
    };
    if body.is_slab {
        // A slab is cut off at the walls; only one that misses them altogether is a slip.
        if (0..3).any(|a| region.max[a] <= walls.min[a] || region.min[a] >= walls.max[a]) {
            at(
                format!("the slab \"{name}\" lies outside the walls"),
                "of no effect",
                "move it, or leave it out",
            );
        }
        return;
    }
    if let Some(axis) = (0..3).find(|&a| region.min[a] < walls.min[a] || region.max[a] > walls.max[a]) {
        at(
            format!("the {what} \"{name}\" reaches outside the walls along {}", AXES[axis]),
            "not inside the walls",
            "make `walls` in [surroundings] larger, or move the body",
        );
    } else if boundary == Wall::Grounded
        && what == "conductor"
        && (0..3).any(|a| region.min[a] == walls.min[a] || region.max[a] == walls.max[a])
    {
        at(
            format!("the conductor \"{name}\" touches the grounded wall, which would short it"),
            "shares a point with the walls",
            "leave a gap between the two",
        );
    }
}

pub(super) fn check_fixed_body(
    body: &PlacedBox<'_>,
    thickness: f64,
    [below, above]: [Face; 2],
    boundary: Wall,
    log: &mut Log<'_>,
) {
    let (low, high) = (body.region.min[1], body.region.max[1]);
    let (what, name) = (body.what, shown(body.name));
    let is_conductor = what == "conductor";
    let mut at = |message: String, label: String, help: &str| {
        log.push(Diagnostic::at(&body.span, message).label(label).help(help));
    };
    // A dielectric may lie on the layer, a conductor may not: it would have to move with it.
    let apart = if is_conductor { high < 0.0 || low > thickness } else { high <= 0.0 || low >= thickness };
    if !apart {
        at(
            format!("the {what} \"{name}\" touches or overlaps the layer"),
            format!("the layer is between x2 = 0 and x2 = {}", micrometres(thickness)),
            "move it below x2 = 0 or above the layer; conductors in the layer are [electrodes]",
        );
        return;
    }
    let is_below = high <= 0.0;
    let (side, face) = if is_below { ("below", below) } else { ("above", above) };
    let reach = if is_below { -low } else { high - thickness };
    match face {
        Face::Insulated | Face::Grounded => at(
            format!("the {what} \"{name}\" lies where there is no field"),
            format!("the field ends at the plane {side} the layer"),
            &format!("give `{side}` in [surroundings] a medium, or leave the body out"),
        ),
        Face::Medium { thickness: Some(depth), .. } if boundary != Wall::Open => {
            let shorted = is_conductor && boundary == Wall::Grounded && reach >= depth;
            if shorted || (reach > depth && !body.is_slab) {
                at(
                    format!("the {what} \"{name}\" reaches the wall {side} the layer"),
                    format!("the wall is {} from the layer", micrometres(depth)),
                    &format!("make the medium `{side}` thicker, or move the body"),
                );
            }
        }
        Face::Medium { .. } => {}
    }
}

/// One driven conductor alone among insulated walls, floating ones or not: all its capacitances are zero, and no relative error can be reached.
fn check_flux_has_an_end(
    conductors: &[Option<PlacedBox<'_>>],
    electrodes: Option<&Electrodes>,
    raw: &Document,
    surroundings: &Surroundings,
    log: &mut Log<'_>,
) {
    let grounded_face = matches!(
        surroundings.extent,
        Extent::AroundLayer { below: Face::Grounded, .. } | Extent::AroundLayer { above: Face::Grounded, .. }
    );
    if surroundings.boundary != Wall::Insulated || grounded_face || raw.electrodes.is_some() {
        return;
    }
    // What could not be read may have been a second one.
    let driven: Vec<_> =
        conductors.iter().filter(|c| c.as_ref().is_none_or(|b| b.floating_charge.is_none())).collect();
    if let ([Some(only)], None, true) = (driven.as_slice(), electrodes, any(&raw.conductor)) {
        log.push(
            Diagnostic::at(
                &only.span,
                format!(
                    "the conductor \"{}\" is alone inside insulated walls: its capacitance is zero",
                    shown(only.name)
                ),
            )
            .label("its flux can end nowhere")
            .help("set `boundary` in [surroundings] to \"open\" or \"grounded\", or add another conductor"),
        );
    }
}

/// Potentials are counted from something: without a driven conductor there is no matrix.
fn check_one_is_driven(conductors: &[Option<PlacedBox<'_>>], raw: &Document, log: &mut Log<'_>) {
    let all_float = conductors.iter().all(|c| c.as_ref().is_some_and(|b| b.floating_charge.is_some()));
    let (true, None, Some(first)) = (all_float, &raw.electrodes, conductors.iter().flatten().next()) else {
        return;
    };
    let charge = given(&raw.conductor).and_then(|all| all.first()?.get()?.charge.as_ref());
    refuse_all_floating(charge.map_or(&first.span, |read| &read.span), first.name, log);
}

/// The message for conductors that all float; `name` is that of the first one.
pub(super) fn refuse_all_floating(span: &Range<usize>, name: &str, log: &mut Log<'_>) {
    log.push(
        Diagnostic::at(span, "all conductors float: a capacitance needs one that is held at a potential")
            .label(format!("\"{}\" floats, and so do the others", shown(name)))
            .help("leave out `charge` of at least one [[conductor]], which is then held at a potential"),
    );
}

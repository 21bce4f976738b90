//! Checks the space around the bodies, and the end of the field.

use std::ops::Range;

use super::super::diagnostics::Diagnostic;
use super::super::model::{Extent, Face, Surroundings, Wall};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::given;
use super::imported::any_physical;
use super::regions::box_region;

/// The surroundings; `None` if they are invalid, with the reason in the log.
pub(super) fn surroundings(
    read: &Read<raw::Surroundings>,
    document: &Document,
    log: &mut Log<'_>,
) -> Option<Surroundings> {
    let raw = read.get()?;
    let boundary = raw.boundary.get().copied().map(wall);
    let relative_permittivity = match &raw.relative_permittivity {
        Some(read) => read.get().map(|value| value.value),
        None => Some(1.0),
    };
    let extent = if document.layer.is_some() {
        around_layer(read, raw, boundary, relative_permittivity, log)
    } else {
        without_layer(read, raw, boundary, document, log)
    };
    Some(Surroundings { boundary: boundary?, relative_permittivity: relative_permittivity?, extent: extent? })
}

/// The condition at the end of the field.
fn wall(boundary: raw::Boundary) -> Wall {
    match boundary {
        raw::Boundary::Insulated => Wall::Insulated,
        raw::Boundary::Grounded => Wall::Grounded,
        raw::Boundary::Open => Wall::Open,
    }
}

/// Refuses a key of [surroundings] that has no meaning in this case.
fn refuse_key<T>(read: &Option<Read<T>>, key: &str, why: &str, help: &str, log: &mut Log<'_>) {
    if let Some(read) = read {
        log.push(
            Diagnostic::at(&read.span, format!("`{key}` in [surroundings] has no meaning here: {why}"))
                .label("cannot be used in this case")
                .help(help),
        );
    }
}

/// Reports a key of [surroundings] that is missing in this case.
fn lacks_key(span: &Range<usize>, key: &str, why: &str, help: &str, log: &mut Log<'_>) {
    log.push(
        Diagnostic::at(span, format!("[surroundings] lacks `{key}`: {why}"))
            .label("a key is missing here")
            .help(help),
    );
}

/// The extent of the field in a case without a layer.
fn without_layer(
    read: &Read<raw::Surroundings>,
    raw: &raw::Surroundings,
    boundary: Option<Wall>,
    document: &Document,
    log: &mut Log<'_>,
) -> Option<Extent> {
    let why = "there is no layer";
    refuse_key(&raw.side_margin, "side_margin", why, "give the box of the walls as `walls`", log);
    for (face, key) in [(&raw.below, "below"), (&raw.above, "above")] {
        let help = match face.as_ref().and_then(Read::get) {
            Some(Either::First(raw::Plane::Grounded)) => {
                "write the ground plane as a [[conductor]] with a `sheet`, in a [[terminal]] with `potential = \"ground\"`; or, as a wall of all \
                 sides, `boundary = \"grounded\"` with `walls`"
            }
            Some(Either::First(raw::Plane::Insulated)) => {
                "end the field on all sides: `boundary = \"insulated\"` with `walls`"
            }
            Some(Either::Second(_)) | None => "write the medium as a [[dielectric]] with a `slab`",
        };
        refuse_key(face, key, why, help, log);
    }
    let sample =
        "`walls = { min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], max = [\"1 mm\", \"1 mm\", \"1 mm\"] }`";
    if any_physical(document) {
        refuse_key(
            &raw.walls,
            "walls",
            "the field ends at the outer faces of [mesh]",
            "leave it out; `boundary` holds on the outer faces that are not a conductor's",
            log,
        );
        return (boundary.is_some() && raw.walls.is_none()).then_some(Extent::Everywhere);
    }
    match (boundary?, &raw.walls) {
        (Wall::Open, None) => Some(Extent::Everywhere),
        (Wall::Open, Some(_)) => {
            refuse_key(
                &raw.walls,
                "walls",
                "the boundary is open",
                "leave it out, or set `boundary` to \"insulated\" or \"grounded\"",
                log,
            );
            None
        }
        (_, Some(walls)) => box_region(walls, log).map(Extent::Walls),
        // A shell is the boundary itself.
        (_, None) if has_shell(document) => Some(Extent::Everywhere),
        (_, None) => {
            let help = format!("add for example {sample}, or set `boundary = \"open\"`");
            lacks_key(&read.span, "walls", "the boundary must be somewhere", &help, log);
            None
        }
    }
}

/// Whether a conductor is a shell around the scene.
fn has_shell(document: &Document) -> bool {
    given(&document.conductor).into_iter().flatten().filter_map(Read::get).any(|c| c.shell.is_some())
}

/// The extent of the field in a case with a layer.
fn around_layer(
    read: &Read<raw::Surroundings>,
    raw: &raw::Surroundings,
    boundary: Option<Wall>,
    relative_permittivity: Option<f64>,
    log: &mut Log<'_>,
) -> Option<Extent> {
    refuse_key(
        &raw.walls,
        "walls",
        "with a layer the walls follow from it",
        "give `side_margin`, and what lies `below` and `above`",
        log,
    );
    let boundary = boundary?;
    match (boundary, &raw.side_margin) {
        (Wall::Open, Some(_)) => refuse_key(
            &raw.side_margin,
            "side_margin",
            "the boundary is open, so there are no walls",
            "leave it out, or set `boundary` to \"insulated\" or \"grounded\"",
            log,
        ),
        (Wall::Insulated | Wall::Grounded, None) => lacks_key(
            &read.span,
            "side_margin",
            "the walls must be somewhere",
            "add for example `side_margin = \"1 mm\"`, or set `boundary = \"open\"`",
            log,
        ),
        (Wall::Open, None) | (Wall::Insulated | Wall::Grounded, Some(_)) => {}
    }
    let below = face(&raw.below, "below", boundary, relative_permittivity, log);
    let above = face(&raw.above, "above", boundary, relative_permittivity, log);
    let side_margin = match (boundary, &raw.side_margin) {
        (Wall::Open, _) => None,
        (_, read) => Some(given(read)?.si),
    };
    Some(Extent::AroundLayer { side_margin, below: below?, above: above? })
}

/// What lies below or above the layer; by default it follows from the boundary.
fn face(
    read: &Option<Read<raw::Face>>,
    key: &str,
    boundary: Wall,
    surrounding_permittivity: Option<f64>,
    log: &mut Log<'_>,
) -> Option<Face> {
    let Some(read) = read else {
        return Some(match boundary {
            Wall::Insulated => Face::Insulated,
            Wall::Grounded => Face::Grounded,
            Wall::Open => Face::Medium {
                relative_permittivity: surrounding_permittivity?,
                thickness: None,
                then: Wall::Open,
            },
        });
    };
    let medium = match read.get()? {
        Either::First(raw::Plane::Insulated) => return Some(Face::Insulated),
        Either::First(raw::Plane::Grounded) => return Some(Face::Grounded),
        Either::Second(medium) => medium,
    };
    let relative_permittivity = medium.relative_permittivity.get()?.value;
    let thickness = match medium.thickness.get()? {
        Either::Second(size) => Some(size.si),
        Either::First(raw::OpenEnd::Open) if boundary == Wall::Open => None,
        Either::First(raw::OpenEnd::Open) => {
            log.push(
                Diagnostic::at(
                    &medium.thickness.span,
                    format!("`{key}` cannot be open where the boundary is not"),
                )
                .label("infinitely thick")
                .help("give a length, for example `thickness = \"1 mm\"`, or set `boundary = \"open\"`"),
            );
            return None;
        }
    };
    let then = match &medium.then {
        None => boundary,
        Some(read) => wall(*read.get()?),
    };
    if let (Some(read), None) = (&medium.then, thickness) {
        log.push(
            Diagnostic::at(&read.span, format!("nothing lies behind what is `{key}`"))
                .label("behind what is infinitely thick")
                .related(&medium.thickness.span, "has no end")
                .help("leave `then` out, or give a thickness"),
        );
    }
    if let (Some(read), Wall::Open) = (&medium.then, then)
        && boundary != Wall::Open
    {
        log.push(
            Diagnostic::at(&read.span, format!("`{key}` cannot be open where the boundary is not"))
                .label("opens into space")
                .help("leave `then` out, or set `boundary = \"open\"`"),
        );
    }
    Some(Face::Medium { relative_permittivity, thickness, then })
}

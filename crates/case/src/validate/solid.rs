//! Checks `[mechanics.solid]`, the layer in three dimensions.

use super::super::diagnostics::Diagnostic;
use super::super::model::{Indenter, LayerEnd, LayerSide, PunchContact, Solid};
use super::super::quantities::Size;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::layer_end::{check_outlet, end, half_length};
use super::punch_contact::contact;

/// The default tolerance of the relative discretisation error of the force, larger than in plane strain
/// because meshes in space are coarse.
const DEFAULT_TOLERANCE: f64 = 2e-2;

/// The model of the layer; `None` if a key could not be read or is refused.
pub(super) fn solid(raw: &raw::Solid, document: &Document, log: &mut Log<'_>) -> Option<Solid> {
    let relative_tolerance = match &raw.relative_tolerance {
        Some(read) => read.get()?.value,
        None => DEFAULT_TOLERANCE,
    };
    let side = match &raw.side {
        Some(read) => match read.get()? {
            raw::LayerSide::Free => LayerSide::Free,
            raw::LayerSide::Symmetric => LayerSide::Symmetric,
        },
        None => LayerSide::Free,
    };
    let indenter = match raw.indenter.get()? {
        Either::First(raw::WholeTop::WholeTop) => Indenter::WholeTop,
        Either::Second(raw::SolidIndenter::FlatPunch(raw)) => punch(raw, log)?,
        Either::Second(raw::SolidIndenter::Cylinder(raw)) => {
            Indenter::Cylinder { radius: raw.radius.get()?.si, position: 0.0 }
        }
        Either::Second(raw::SolidIndenter::Sphere(raw)) => Indenter::Sphere { radius: raw.radius.get()?.si },
    };
    let (end, width) = (end(raw.end.get()?), raw.width.get()?.si);
    let model = Solid { indenter, end, width, side, relative_tolerance };
    check_room(&model, raw, document, log);
    if let (Indenter::WholeTop, LayerEnd::Far, LayerSide::Symmetric) = (indenter, end, side) {
        let way_out = "leave out `side = \"symmetric\"`, make the end";
        check_outlet(&raw.end, &raw.indenter, document, way_out, log);
    }
    Some(model)
}

fn punch(raw: &raw::SolidPunch, log: &mut Log<'_>) -> Option<Indenter> {
    let half_width = raw.half_width.get()?.si;
    let contact = contact(&raw.contact)?;
    let is_smooth = matches!(contact, PunchContact::Smooth { .. });
    let Some(radius) = &raw.corner_radius else {
        if let Some(depth) = &raw.half_depth {
            log.push(
                Diagnostic::at(&depth.span, "a punch with a `half_depth` needs a `corner_radius`")
                    .label("sharp punches go all along x3")
                    .help("add for example `corner_radius = \"0.1 mm\"`"),
            );
            return None;
        }
        if is_smooth {
            log.push(
                Diagnostic::at(&raw.half_width.span, "a punch without friction needs a `corner_radius` in three dimensions")
                    .label("contact with sharp corners is known to [mechanics.plane_strain] only")
                    .help(
                        "add for example `corner_radius = \"0.1 mm\"`, or write `contact = \"held\"` to move down the patch that \
                         lies under the punch at rest",
                    ),
            );
            return None;
        }
        return Some(Indenter::FlatPunch { half_width, contact, position: 0.0 });
    };
    let corner_radius = radius.get()?.si;
    if !is_smooth {
        let what = match contact {
            PunchContact::Held => "a patch that is held has no rounded corners",
            PunchContact::Bonded | PunchContact::Smooth { .. } => {
                "a bonded punch has no rounded corners in three dimensions"
            }
        };
        log.push(
            Diagnostic::at(&radius.span, what)
                .label("this radius cannot be kept")
                .help("leave `corner_radius` out, or `contact`"),
        );
        return None;
    }
    let fits = |across: &Read<Size>, size: f64, what: &str, log: &mut Log<'_>| {
        if corner_radius > size {
            log.push(
                Diagnostic::at(
                    &radius.span,
                    format!("the corner radius is larger than half the {what} of the punch"),
                )
                .label("no flat face is left")
                .related(&across.span, format!("half the {what}"))
                .help("use [mechanics.solid.indenter.cylinder] or a sphere, or a smaller radius"),
            );
        }
        corner_radius <= size
    };
    if !fits(&raw.half_width, half_width, "width", log) {
        return None;
    }
    match &raw.half_depth {
        None => {
            let contact = PunchContact::Smooth { corner_radius: Some(corner_radius) };
            Some(Indenter::FlatPunch { half_width, contact, position: 0.0 })
        }
        Some(read) => {
            let half_depth = read.get()?.si;
            fits(read, half_depth, "depth", log)
                .then_some(Indenter::Block { half_widths: [half_width, half_depth], corner_radius })
        }
    }
}

/// Checks that the layer has a half-length, and that the indenter does not reach over its end or side. Only a
/// punch without friction may, where the end or the side is free.
fn check_room(model: &Solid, raw: &raw::Solid, document: &Document, log: &mut Log<'_>) {
    let Some(read) = half_length(document, "[mechanics.solid]", log) else { return };
    let Some(half_length) = read.get().map(|size| size.si) else { return };
    let (end_is_free, side_is_free) = (model.end != LayerEnd::Far, model.side == LayerSide::Free);
    let reaches_over = match model.indenter {
        Indenter::WholeTop | Indenter::Cylinder { .. } | Indenter::Sphere { .. } => false,
        Indenter::FlatPunch { half_width, contact, .. } => {
            half_width >= half_length && !(end_is_free && matches!(contact, PunchContact::Smooth { .. }))
        }
        Indenter::Block { half_widths, .. } => {
            half_widths[0] >= half_length && !end_is_free
                || 2.0 * half_widths[1] >= model.width && !side_is_free
        }
    };
    if reaches_over {
        log.push(
            Diagnostic::at(&raw.indenter.span, "the indenter reaches over the end or the side of the layer")
                .label("does not fit")
                .related(&read.span, "the layer ends here")
                .help(
                    "make the layer longer or wider, leave out `half_depth`, or write `indenter = \"whole-top\"`",
                ),
        );
    }
}

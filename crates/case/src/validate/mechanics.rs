//! Checks the mechanical model of the layer.

use super::super::diagnostics::Diagnostic;
use super::super::model::{Indenter, LayerEnd, Mechanics, PlaneStrain, PunchContact, ShearLength};
use super::super::raw::{self, Document};
use super::super::reader::Log;
use super::super::values::Either;
use super::layer_end::{check_outlet, end, half_length};
use super::punch_contact::contact;
use super::{given, solid};
use crate::material;

/// The default tolerance of the relative discretisation error of the force.
const DEFAULT_TOLERANCE: f64 = 5e-3;

pub(super) fn mechanics(raw: &raw::Mechanics, document: &Document, log: &mut Log<'_>) -> Option<Mechanics> {
    match raw {
        // `auto` has been replaced by another table.
        raw::Mechanics::Auto(_) => None,
        raw::Mechanics::ClosedForm(raw) => {
            check_closed_form(document, log);
            let shear_length = match raw.shear_length.get()? {
                Either::First(raw::FiniteElement::FiniteElement) => ShearLength::FiniteElement,
                Either::Second(length) => ShearLength::Given(length.si),
            };
            Some(Mechanics::ClosedForm {
                contact_half_length: raw.contact_half_length.get()?.si,
                contact_width: raw.contact_width.get()?.si,
                shear_length,
            })
        }
        raw::Mechanics::PlaneStrain(raw) => plane_strain(raw, document, log).map(Mechanics::PlaneStrain),
        raw::Mechanics::Solid(raw) => solid::solid(raw, document, log).map(Mechanics::Solid),
    }
}

/// Checks that the closed form covers the material: an incompressible one whose stress is linear in the left
/// Cauchy-Green tensor and its inverse, or a foam.
fn check_closed_form(document: &Document, log: &mut Log<'_>) {
    let Some(read) = given(&document.layer).and_then(|layer| layer.material.as_ref()) else { return };
    let Some(table) = read.get() else { return };
    let (span, what) = match (material::bulk_modulus(table), material::without_closed_form(table)) {
        (Some(read), _) => (&read.span, "a bulk modulus"),
        (None, Some(what)) => (&read.span, what),
        (None, None) => return,
    };
    log.push(
        Diagnostic::at(span, format!("[mechanics.closed_form] does not know {what}"))
            .label("only incompressible Mooney-Rivlin and neo-Hookean layers have a closed form")
            .help("use [mechanics.plane_strain] or [mechanics.solid], or another material"),
    );
}

fn plane_strain(raw: &raw::PlaneStrain, document: &Document, log: &mut Log<'_>) -> Option<PlaneStrain> {
    let relative_tolerance = match &raw.relative_tolerance {
        Some(read) => read.get()?.value,
        None => DEFAULT_TOLERANCE,
    };
    let indenter = match raw.indenter.get()? {
        Either::First(raw::WholeTop::WholeTop) => Indenter::WholeTop,
        Either::Second(raw::Indenter::FlatPunch(raw)) => punch(raw, log)?,
        Either::Second(raw::Indenter::Cylinder(raw)) => Indenter::Cylinder {
            radius: raw.radius.get()?.si,
            position: raw.position.as_ref().map_or(Some(0.0), |read| Some(read.get()?.si))?,
        },
    };
    let model =
        PlaneStrain { indenter, end: end(raw.end.get()?), width: raw.width.get()?.si, relative_tolerance };
    check_length(&model, raw, document, log);
    if let (Indenter::WholeTop, LayerEnd::Far) = (model.indenter, model.end) {
        check_outlet(&raw.end, &raw.indenter, document, "make the end", log);
    }
    Some(model)
}

fn punch(raw: &raw::FlatPunch, log: &mut Log<'_>) -> Option<Indenter> {
    let half_width = raw.half_width.get()?.si;
    let corner_radius = raw.corner_radius.as_ref().map_or(Some(0.0), |read| Some(read.get()?.si))?;
    let contact = contact(&raw.contact)?;
    let is_smooth = matches!(contact, PunchContact::Smooth { .. });
    let position = raw.position.as_ref().map_or(Some(0.0), |read| Some(read.get()?.si))?;
    if let (Some(read), true) = (&raw.corner_radius, corner_radius > half_width) {
        log.push(
            Diagnostic::at(&read.span, "the corner radius is larger than half the width of the punch")
                .label("no flat face is left")
                .related(&raw.half_width.span, "half the width")
                .help("use [mechanics.plane_strain.indenter.cylinder], or a smaller radius"),
        );
        return None;
    }
    let refused = match (&raw.contact, &raw.position) {
        (Some(read), _) if !is_smooth && corner_radius > 0.0 => Some((
            &read.span,
            match contact {
                PunchContact::Held => "a patch that is held has no rounded corners",
                PunchContact::Bonded | PunchContact::Smooth { .. } => {
                    "a punch with rounded corners cannot be bonded"
                }
            },
            "leave out `corner_radius`, or write `contact = \"smooth\"`",
        )),
        (_, Some(read)) if position != 0.0 && !is_smooth => Some((
            &read.span,
            "a patch that is held or bonded must lie in the middle of the layer",
            "write `contact = \"smooth\"`, or `position = \"0 mm\"`",
        )),
        _ => None,
    };
    if let Some((span, what, help)) = refused {
        log.push(Diagnostic::at(span, what).label("not supported").help(help));
        return None;
    }
    let contact = match is_smooth {
        true => PunchContact::Smooth { corner_radius: Some(corner_radius).filter(|radius| *radius > 0.0) },
        false => contact,
    };
    Some(Indenter::FlatPunch { half_width, contact, position })
}

/// Checks that the layer has a half-length, and that the indenter presses on it. Only a punch without
/// friction may reach over the end, where that is free.
fn check_length(model: &PlaneStrain, raw: &raw::PlaneStrain, document: &Document, log: &mut Log<'_>) {
    let Some(length) = half_length(document, "[mechanics.plane_strain]", log) else { return };
    let Some(half_length) = length.get().map(|size| size.si) else { return };
    let end_is_free = model.end != LayerEnd::Far;
    let reach = match model.indenter {
        Indenter::WholeTop => return,
        Indenter::FlatPunch { half_width, position, contact: PunchContact::Smooth { .. } } if end_is_free => {
            position.abs() - half_width
        }
        Indenter::FlatPunch { half_width, position, .. } => position.abs() + half_width,
        Indenter::Cylinder { position, .. } => position.abs(),
        // Without an end along x3 there is none of these.
        Indenter::Block { .. } | Indenter::Sphere { .. } => return,
    };
    if reach >= half_length {
        log.push(
            Diagnostic::at(&raw.indenter.span, "the indenter reaches over the end of the layer")
                .label("too wide, or too far from the middle")
                .related(&length.span, "the layer ends here")
                .help("make the layer longer, or write `indenter = \"whole-top\"`"),
        );
    }
}

//! Checks that a foam layer, by `foam` in [layer] or by a foam law as its material, has a suitable model.

use std::ops::Range;

use super::super::diagnostics::Diagnostic;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::given;
use crate::material::{self, MaterialTable};

/// Refuses combinations that the models of a foam do not cover: a force without a foam law, finite elements
/// with a table or with a permittivity that depends on the compression, an indenter in the field, and
/// electrodes within a uniformly compressed foam.
pub(super) fn check(raw: &Document, log: &mut Log<'_>) {
    let Some(layer) = given(&raw.layer) else { return };
    let law = layer.material.as_ref().filter(|read| read.get().is_some_and(material::is_foam));
    let by_finite_elements =
        given(&raw.mechanics).is_some_and(|mechanics| !matches!(mechanics, raw::Mechanics::ClosedForm(_)));
    if let (Some(read), true) = (law, by_finite_elements)
        && let Some(MaterialTable::FoamTable(_)) = read.get()
    {
        log.push(
            Diagnostic::at(
                &read.span,
                "[layer.material.foam_table] cannot be used with a layer by finite elements",
            )
            .label("a test along one axis does not say what the foam does along the others")
            .help("fit `[layer.material.hyperfoam]` to the table, or use [mechanics.closed_form]"),
        );
        return;
    }
    if let (Some(read), false, true) = (law, by_finite_elements, raw.load.is_some()) {
        check_contents(&read.span, raw, log);
    }
    let Some(foam) = &layer.foam else { return };
    let force = load_by_force(raw);
    if let (Some(force), None) = (force, law) {
        log.push(
            Diagnostic::at(force, "[layer.foam] cannot be loaded by a force: the material of the layer is that of a rubber")
                .label("the compression that this gives is not known")
                .related(&foam.span, "a foam")
                .help(
                    "give the foam a law of force, `[layer.material.hyperfoam]` or `[layer.material.foam_table]`, or load by \
                     `compression`",
                ),
        );
        return;
    }
    let other = if by_finite_elements && !stays_even(layer, raw) {
        "a layer by finite elements that is not compressed evenly"
    } else if raw.indenter.is_some() {
        "an indenter in the field, beside which the layer is not compressed"
    } else {
        return;
    };
    log.push(
        Diagnostic::at(&foam.span, format!("[layer.foam] cannot be used with {other}"))
            .label("the field solver takes one permittivity for the whole layer, and the volume differs from place to place")
            .help(
                "use [mechanics.closed_form] without [indenter]; press the whole top of a `[layer.material.hyperfoam]` with \
                 `poisson_ratio = 0.0` and nothing in it; or give `relative_permittivity`: the same at every load",
            ),
    );
}

/// Whether finite elements leave the foam uniformly compressed: its whole top is pressed, no term of its law
/// widens, and it contains no bodies.
fn stays_even(layer: &raw::Layer, raw: &Document) -> bool {
    let whole_top = match given(&raw.mechanics) {
        Some(raw::Mechanics::PlaneStrain(model)) => matches!(model.indenter.get(), Some(Either::First(_))),
        Some(raw::Mechanics::Solid(model)) => matches!(model.indenter.get(), Some(Either::First(_))),
        Some(raw::Mechanics::ClosedForm(_) | raw::Mechanics::Auto(_)) | None => false,
    };
    whole_top && given(&layer.material).is_some_and(material::gets_no_wider) && first_within(raw).is_none()
}

/// The first force of a load, if there is one.
fn load_by_force(raw: &Document) -> Option<&Range<usize>> {
    let load = given(&raw.load)?;
    let of_steps = given(&load.steps).into_iter().flatten().filter_map(Read::get);
    let spans = load.force.iter().map(|read| &read.span);
    spans.chain(of_steps.filter_map(|step| step.force.as_ref().map(|read| &read.span))).next()
}

/// Refuses electrodes within a uniformly compressed foam: their displacement, and their effect on its
/// stiffness, are unknown.
fn check_contents(law: &Range<usize>, raw: &Document, log: &mut Log<'_>) {
    let Some(span) = first_within(raw) else { return };
    log.push(
        Diagnostic::at(span, "[mechanics.closed_form] does not know what lies within a foam")
            .label("this moves with the material of the layer")
            .related(law, "a law of foams")
            .help(
                "put conductors on the substrate and on the top of the layer, for example with `[electrodes.array]` and its \
                 `common_plate`, or use [mechanics.plane_strain] or [mechanics.solid]",
            ),
    );
}

/// The first electrodes or bodies that move with the material of the layer.
fn first_within(raw: &Document) -> Option<&Range<usize>> {
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get);
    let attached = conductors.map(|body| &body.attached).chain(dielectrics.map(|body| &body.attached));
    let in_layer = || {
        attached
            .flatten()
            .find(|read| matches!(read.get(), Some(raw::Attached::Layer)))
            .map(|read| &read.span)
    };
    raw.pair().map(|read| &read.span).or_else(in_layer)
}

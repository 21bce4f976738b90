//! Refuses a terminal alone inside insulated walls: its flux cannot end anywhere, and its capacitance is
//! zero.

use std::ops::Range;

use elastocap_geometry::scene::{Potential, Role};

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Case, Extent, Face, Wall};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::given;

/// Refuses a case, with bodies of any shape, in which a single terminal is driven, and neither a boundary nor
/// another conductor can take its flux; floating conductors cannot. The capacitance is then zero, and no
/// relative tolerance of zero can be met.
pub(super) fn check_flux_has_an_end(case: &Case, raw: &Document, log: &mut Log<'_>) {
    let Some(surroundings) = &case.surroundings else { return };
    let takes_flux = |face: Face| match face {
        Face::Insulated => false,
        Face::Grounded => true,
        Face::Medium { then, .. } => then != Wall::Insulated,
    };
    let face_takes_flux = match surroundings.extent {
        Extent::AroundLayer { below, above, .. } => takes_flux(below) || takes_flux(above),
        Extent::Everywhere | Extent::Walls(_) => false,
    };
    let indenter_takes_flux = case.indenter.as_ref().is_some_and(|indenter| match indenter.role {
        Role::Conductor { potential: Potential::Grounded | Potential::Driven } => true,
        Role::Conductor { potential: Potential::Floating { .. } } | Role::Dielectric { .. } => false,
    });
    let flux_ends = surroundings.boundary != Wall::Insulated
        || face_takes_flux
        || indenter_takes_flux
        || case.has_grounded_terminals();
    let terminals = case.driven_terminals();
    let ([only], false) = (terminals.as_slice(), flux_ends) else { return };
    let what =
        if case.terminals.iter().any(|terminal| terminal.name == *only) { "terminal" } else { "conductor" };
    let of_terminal =
        |name: &str| case.terminals.iter().any(|terminal| terminal.name == *only && terminal.holds(name));
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let mut named = conductors
        .filter(|conductor| conductor.name.get().is_some_and(|name| name.0 == *only || of_terminal(&name.0)));
    let span = named.next().map(place).or_else(|| raw.pair().map(|pair| pair.span.clone()));
    log.push(
        Diagnostic::at(
            &span.unwrap_or_default(),
            format!(
                "the {what} \"{}\" is alone inside insulated walls: its capacitance is zero",
                shown(only)
            ),
        )
        .label("its flux can end nowhere")
        .help("set `boundary` in [surroundings] to \"open\" or \"grounded\", or add another conductor"),
    );
}

/// The place in the file that gives the shape of a conductor.
fn place(conductor: &raw::Conductor) -> Range<usize> {
    fn span<T>(read: &Option<Read<T>>) -> Option<&Range<usize>> {
        read.as_ref().map(|read| &read.span)
    }
    let round = span(&conductor.sphere)
        .or(span(&conductor.shell))
        .or(span(&conductor.capsule))
        .or(span(&conductor.cylinder));
    let boxes = span(&conductor.r#box).or(span(&conductor.boxes)).or(span(&conductor.sheet));
    let others = span(&conductor.extrusion).or(span(&conductor.surface)).or(span(&conductor.physical));
    boxes.or(round).or(others).unwrap_or(&conductor.name.span).clone()
}

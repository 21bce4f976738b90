//! Checks the indenter as a part of the field, and its approach.

use elastocap_geometry::scene::Potential;

use super::super::diagnostics::Diagnostic;
use super::super::model::Surroundings;
use super::super::model::{Extent, Face, FieldIndenter, Indenter, Mechanics, PunchContact, Role};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::{Either, Text};
use super::given;

/// The indenter as a part of the field; `Some(None)` if it is absent from it.
pub(super) fn indenter(
    read: &Read<raw::FieldIndenter>,
    raw: &Document,
    mechanics: Option<&Mechanics>,
    surroundings: Option<&Surroundings>,
    log: &mut Log<'_>,
) -> Option<Option<FieldIndenter>> {
    let table = read.get()?;
    let conductor = |potential| Role::Conductor { potential };
    let role = match table.role.get()? {
        Either::First(raw::IndenterRole::Absent) => return Some(None),
        Either::First(raw::IndenterRole::Grounded) => conductor(Potential::Grounded),
        Either::First(raw::IndenterRole::Floating) => conductor(Potential::Floating { charge: 0.0 }),
        Either::Second(medium) => {
            Role::Dielectric { relative_permittivity: medium.relative_permittivity.get()?.value }
        }
    };
    let height = match &table.height {
        Some(read) => Some(read.get()?.si),
        None => None,
    };
    if raw.load.is_none() {
        log.push(
            Diagnostic::at(&read.span, "[indenter] needs [load]")
                .label("nothing presses on the layer")
                .help("add [load] with [mechanics], or write what stands above the layer as a [[conductor]] or [[dielectric]]"),
        );
    }
    if mechanics.is_some_and(is_held) {
        log.push(
            Diagnostic::at(&read.span, "a patch that is held has no indenter")
                .label("`contact = \"held\"` moves a patch of the surface, and no body")
                .help("write `role = \"absent\"`, or another `contact`"),
        );
    }
    if let (Some(height), Some(mechanics)) = (&table.height, mechanics)
        && is_round(mechanics)
    {
        log.push(
            Diagnostic::at(&height.span, "cylinders and spheres have no `height`")
                .label("their radius says how tall they are")
                .help("leave it out"),
        );
    }
    if let Some(Extent::AroundLayer { above: Face::Insulated | Face::Grounded, .. }) =
        surroundings.map(|all| &all.extent)
    {
        log.push(
            Diagnostic::at(&read.span, "there is no room for the indenter: a wall lies on the layer")
                .label("is above the layer")
                .help("write for example `above = { relative_permittivity = 1.0, thickness = \"open\" }` in [surroundings]"),
        );
    }
    check_name(raw, log);
    Some(Some(FieldIndenter { role, height }))
}

/// Whether a patch of the surface is moved without an indenter.
fn is_held(mechanics: &Mechanics) -> bool {
    matches!(mechanics.indenter(), Some((Indenter::FlatPunch { contact: PunchContact::Held, .. }, _)))
}

fn is_round(mechanics: &Mechanics) -> bool {
    matches!(mechanics.indenter(), Some((Indenter::Cylinder { .. } | Indenter::Sphere { .. }, _)))
}

/// Checks that no body has the indenter's name in the results.
fn check_name(raw: &Document, log: &mut Log<'_>) {
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get).map(|c| &c.name);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get).map(|d| &d.name);
    let terminals = given(&raw.terminal).into_iter().flatten().filter_map(Read::get).map(|t| &t.name);
    for name in conductors.chain(dielectrics).chain(terminals) {
        if name.get().is_some_and(|Text(name)| name == FieldIndenter::NAME) {
            log.push(
                Diagnostic::at(&name.span, "a body has the name of the indenter")
                    .label("[indenter] is called so in the results")
                    .help("choose another name"),
            );
        }
    }
}

/// Refuses steps before contact if no body approaches.
pub(super) fn check_approach(raw: &Document, is_in_field: bool, log: &mut Log<'_>) {
    let Some(read) = given(&raw.load).and_then(|load| load.approach.as_ref()) else { return };
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get).map(|c| &c.attached);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get).map(|d| &d.attached);
    let moves =
        |attached: &Option<Read<raw::Attached>>| matches!(given(attached), Some(raw::Attached::Indenter));
    if !is_in_field && !conductors.chain(dielectrics).any(moves) {
        log.push(
            Diagnostic::at(&read.span, "`approach` moves nothing")
                .label("the indenter is no part of the field")
                .help("add [indenter] with for example `role = \"grounded\"`, or leave `approach` out"),
        );
    }
    let by_steps = given(&raw.load).and_then(|load| load.steps.as_ref());
    if let Some(steps) = by_steps {
        log.push(
            Diagnostic::at(&read.span, "[load] has both `approach` and `steps`")
                .label("goes with `compression` or `force`")
                .related(&steps.span, "beside this")
                .help("write two cases"),
        );
    }
}

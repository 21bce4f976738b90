//! Checks that the parts of a file fit together, and converts the raw types to a [`Case`].
//!
//! A value that could not be read is `Some(Read { value: None })`, with the reason in the log; a missing
//! table is `None`. Only the latter is reported here as missing, so that one mistake gives one message.

mod alone;
mod attached;
mod auto;
mod bodies;
mod foam;
mod forms;
mod imported;
mod indenter;
mod layer_end;
mod layer_room;
mod layered;
mod measured_points;
mod mechanics;
mod outlines;
mod overlaps;
mod placed_boxes;
mod punch_contact;
mod recognised;
mod regions;
mod shapes;
mod solid;
mod steps;
mod surroundings;
mod terminals;

use std::ops::Range;
use std::path::Path;

pub(crate) use auto::choose as choose_mechanics;
pub(crate) use forms::write_out as write_forms_out;

use super::diagnostics::Diagnostic;
use super::model::{Case, Electrostatics, FieldSolver};
use super::raw::{self, Document};
use super::reader::{Log, Read};

/// The default of `relative_tolerance`.
const DEFAULT_TOLERANCE: f64 = 1e-3;

/// The value, if it is present and could be read.
fn given<T>(read: &Option<Read<T>>) -> Option<&T> {
    read.as_ref().and_then(Read::get)
}

/// Whether the array is present with entries in it, or could not be read.
fn has_entries<T>(array: &Option<Read<Vec<T>>>) -> bool {
    array.as_ref().is_some_and(|array| array.get().is_none_or(|entries| !entries.is_empty()))
}

/// Checks that the tables fit together and converts them; `None` only if the log says why.
///
/// `mechanics_chosen` is the result of [`choose_mechanics`]. `flawed` says that there are unknown keys at the
/// top level, any of which may stand for a missing table.
pub(super) fn validate(
    raw: &Document,
    mechanics_chosen: Option<String>,
    flawed: bool,
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Case> {
    let wants_capacitance = raw.electrodes.is_some() || has_entries(&raw.conductor);
    let wants_mechanics = raw.load.is_some();
    if !flawed {
        check_presence(raw, wants_capacitance, log);
    }

    let layer = raw.layer.as_ref().map(|l| layered::layer(l, wants_capacitance, wants_mechanics, log));
    foam::check(raw, log);
    let pair_read = raw.pair();
    let electrodes = pair_read.map(|e| layered::electrodes(e, wants_mechanics, log));
    let load = raw.load.as_ref().map(|l| steps::load(l, log));
    steps::check_change(raw, load.as_ref(), log);
    if let (Some(read), Some(electrodes), Some(layer)) =
        (pair_read, electrodes.as_ref().and_then(Option::as_ref), given(&raw.layer))
    {
        layered::check_fit(read, electrodes, layer, log);
    }
    let mechanics = raw.mechanics.as_ref().map(|m| mechanics::mechanics(m.get()?, raw, log));
    let surroundings = match (&raw.surroundings, wants_capacitance) {
        (Some(read), true) => Some(surroundings::surroundings(read, raw, log)),
        _ => None,
    };
    if let (Some(surroundings), Some(layer), Some(electrodes)) = (
        surroundings.as_ref().and_then(Option::as_ref),
        given(&raw.layer),
        electrodes.as_ref().and_then(Option::as_ref),
    ) {
        layered::check_shorted(electrodes, layer, surroundings, raw, log);
    }
    let checked_surroundings = surroundings.as_ref().and_then(Option::as_ref);
    let indenter = raw.indenter.as_ref().map(|read| {
        indenter::indenter(read, raw, mechanics.as_ref().and_then(Option::as_ref), checked_surroundings, log)
    });
    // An unreadable indenter counts as present.
    indenter::check_approach(
        raw,
        indenter.is_some_and(|found| found.is_none_or(|indenter| indenter.is_some())),
        log,
    );
    let pair = electrodes.as_ref().and_then(Option::as_ref);
    let terminals = terminals::terminals(raw, pair, log);
    let joined = terminals.as_ref().map_or(&[][..], |(terminals, _)| terminals);
    let mut mesh = None;
    let bodies = if imported::any_physical(raw) {
        imported::bodies(raw, flawed, checked_surroundings, joined, origin, log).map(|imported| {
            mesh = Some(imported.mesh);
            (imported.bodies, imported.shapes)
        })
    } else if !shapes::any_shaped(raw) {
        bodies::bodies(raw, checked_surroundings, pair, joined, log).map(|bodies| (bodies, None))
    } else if raw.layer.is_some() {
        shapes::with_layer(raw, checked_surroundings, (pair, joined), origin, log)
            .map(|bodies| (bodies, None))
    } else {
        shapes::without_layer(raw, checked_surroundings, joined, origin, log).map(|bodies| (bodies, None))
    };
    // The bodies as shapes; those of a mesh only if their shapes are simple enough for other solvers.
    let as_shapes = bodies.as_ref().and_then(|(bodies, shapes)| match (&mesh, shapes) {
        (Some(_), shapes) => shapes.as_ref().map(|shapes| &shapes.bodies),
        (None, _) => Some(bodies),
    });
    let as_boxes =
        as_shapes.filter(|_| may_be_recognised_for(raw, raw::FieldSolver::Boxes)).and_then(|bodies| {
            let boundary = checked_surroundings.map(|surroundings| surroundings.boundary);
            recognised::as_boxes(bodies, &shapes::perforated(raw), joined, boundary, &electrostatics(raw)?)
        });
    let any_shaped = imported::any_physical(raw) || shapes::any_shaped(raw);
    if !any_shaped {
        check_order(raw, log);
    } else if bodies.is_none() || as_boxes.is_none() {
        check_solver(raw, log);
    }
    let as_extrusions = || {
        let shapes = as_shapes.filter(|_| may_be_recognised_for(raw, raw::FieldSolver::Extruded))?;
        recognised::as_extrusions(shapes, mesh.is_some())
    };
    let simpler = as_boxes.or_else(as_extrusions);
    let (bodies, shapes) = bodies?;
    let (terminals, measured) = terminals?;
    let poses = match &raw.load {
        Some(read) => steps::poses(read)?,
        None => Vec::new(),
    };
    attached::check(raw, &poses, log);
    let measured_points =
        raw.measurement.as_ref().map(|read| measured_points::measured_points(read, raw, flawed, origin, log));
    let mut surroundings = all_given(surroundings)?;
    let (bodies, recognised) = match simpler {
        Some(simpler) => {
            mesh = None;
            if let (Some(surroundings), Some(shapes)) = (&mut surroundings, shapes) {
                surroundings.extent = shapes.extent;
            }
            simpler
        }
        None => (bodies, Vec::new()),
    };

    raw.format.get()?;
    let case = Case {
        title: title(raw, origin)?,
        source: origin.to_owned(),
        layer: all_given(layer)?,
        electrodes: all_given(electrodes)?,
        mechanics: all_given(mechanics)?,
        mechanics_chosen,
        load: all_given(load)?,
        poses,
        indenter: all_given(indenter)?.flatten(),
        bodies,
        terminals,
        measured,
        recognised,
        mesh,
        surroundings,
        electrostatics: if wants_capacitance { Some(electrostatics(raw)?) } else { None },
        measured_points: all_given(measured_points)?,
    };
    alone::check_flux_has_an_end(&case, raw, log);
    Some(case)
}

/// Turns a part that is present but unreadable, `Some(None)`, into `None` for the whole case.
fn all_given<T>(part: Option<Option<T>>) -> Option<Option<T>> {
    match part {
        Some(None) => None,
        Some(Some(value)) => Some(Some(value)),
        None => Some(None),
    }
}

/// Reports missing tables that others need.
fn check_presence(raw: &Document, wants_capacitance: bool, log: &mut Log<'_>) {
    let mut lacks = |span: &Range<usize>, who: &str, what: &str, why: &str, example: &str| {
        let help = format!("add {what}{example}");
        log.push(Diagnostic::at(span, format!("{who} needs {what}")).label(why).help(help));
    };
    if let Some(load) = &raw.load {
        if raw.layer.is_none() {
            lacks(&load.span, "[load]", "[layer]", "there is no layer to press", "");
        }
        if raw.mechanics.is_none() {
            let example = ", for example with `indenter = { flat_punch = { half_width = \"2 mm\", half_depth = \"2 mm\", corner_radius = \"0.1 \
                           mm\" } }`, or with `indenter = \"whole-top\"` and a `width` for a plate over everything";
            lacks(
                &load.span,
                "[load]",
                "[mechanics.auto]",
                "nothing says what presses on the layer",
                example,
            );
        }
    }
    if let (Some(electrodes), None) = (raw.pair(), &raw.layer) {
        lacks(&electrodes.span, "[electrodes]", "[layer]", "there is no layer for them to lie in", "");
    }
    let first_conductor = given(&raw.conductor).and_then(|conductors| conductors.first()).map(|c| &c.span);
    let first = raw.electrodes.as_ref().map(|e| &e.span).or(first_conductor);
    if let (None, Some(span)) = (&raw.surroundings, first) {
        let who = if raw.electrodes.is_some() { "[electrodes]" } else { "[[conductor]]" };
        log.push(
            Diagnostic::at(span, format!("{who} needs [surroundings]"))
                .label("nothing says where the field ends")
                .help("add for example `[surroundings]` with `boundary = \"open\"`"),
        );
    }
    if !wants_capacitance && raw.load.is_none() && log.is_empty() {
        log.push(
            Diagnostic::at(
                &(0..0),
                "nothing to solve: this case has no electrodes, no conductors and no load",
            )
            .help("add [electrodes.in_plane_pair] or another form, a [[conductor]], or a [load]"),
        );
    }
}

/// The title of the case, or else the name of its file without the ending.
fn title(raw: &Document, origin: &Path) -> Option<String> {
    match &raw.title {
        Some(read) => read.get().map(|text| text.0.clone()),
        None => Some(origin.file_stem().unwrap_or(origin.as_os_str()).to_string_lossy().into_owned()),
    }
}

/// Refuses bodies of other shapes where the box solver is asked for.
fn check_solver(raw: &Document, log: &mut Log<'_>) {
    let solver = given(&raw.electrostatics).and_then(|table| table.solver.as_ref());
    if let Some(read) = solver
        && let Some(raw::FieldSolver::Boxes) = read.get()
    {
        log.push(
            Diagnostic::at(&read.span, "the solver for boxes cannot take bodies of other shapes")
                .label("a conductor or dielectric here is no box, sheet or slab")
                .help("leave `solver` out, or say `solver = \"tetrahedra\"`"),
        );
    }
}

/// Whether bodies that the file gives in other forms may be recognised for this solver: not if the file asks
/// for another one, or gives the order of tetrahedra. Without such bodies there is nothing to recognise.
fn may_be_recognised_for(raw: &Document, solver: raw::FieldSolver) -> bool {
    if !shapes::any_shaped(raw) && !imported::any_physical(raw) {
        return false;
    }
    let Some(table) = &raw.electrostatics else { return true };
    let Some(table) = table.get() else { return false };
    let named = table.solver.as_ref().map(Read::get);
    table.order.is_none() && named.is_none_or(|named| named == Some(&solver))
}

/// Refuses an `order` in scenes for the box solver, which chooses it itself.
fn check_order(raw: &Document, log: &mut Log<'_>) {
    let Some(table) = given(&raw.electrostatics) else { return };
    let solver = table.solver.as_ref().and_then(|read| read.get());
    if let (Some(read), None | Some(raw::FieldSolver::Boxes | raw::FieldSolver::Extruded)) =
        (&table.order, solver)
    {
        log.push(
            Diagnostic::at(&read.span, "only the solver on tetrahedra has an `order`")
                .label("this scene of boxes goes to the solver for boxes, which chooses its own")
                .help("leave it out, or say `solver = \"tetrahedra\"`"),
        );
    }
}

/// The settings of the field solver, with their defaults; `None` if one of them could not be read.
fn electrostatics(raw: &Document) -> Option<Electrostatics> {
    let (mut relative_tolerance, mut bounds, mut solver, mut order) = (DEFAULT_TOLERANCE, true, None, None);
    let (mut absolute_tolerance, mut change_tolerance) = (None, None);
    if let Some(read) = &raw.electrostatics {
        let table = read.get()?;
        if let Some(read) = &table.relative_tolerance {
            relative_tolerance = read.get()?.value;
        }
        if let Some(read) = &table.absolute_tolerance {
            absolute_tolerance = Some(read.get()?.si);
        }
        if let Some(read) = &table.change_tolerance {
            change_tolerance = Some(read.get()?.value);
        }
        if let Some(read) = &table.bounds {
            bounds = read.get()?.0;
        }
        if let Some(read) = &table.solver {
            solver = Some(match read.get()? {
                raw::FieldSolver::Boxes => FieldSolver::Boxes,
                raw::FieldSolver::Extruded => FieldSolver::Extruded,
                raw::FieldSolver::Tetrahedra => FieldSolver::Tetrahedra,
            });
        }
        if let Some(read) = &table.order {
            order = Some(read.get()?.0);
        }
    }
    Some(Electrostatics { relative_tolerance, absolute_tolerance, change_tolerance, bounds, solver, order })
}

//! Checks the terminals, that is conductors on one wire, and the measurements between them.

use std::collections::HashSet;
use std::ops::Range;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Electrodes, FieldIndenter, Measured, MeasuredEntry, Terminal};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read, nearest};
use super::super::values::{Either, Text};
use super::given;

/// The largest number of names in one message.
const MAX_NAMES: usize = 20;

/// A conductor as the file names it.
struct Named<'a> {
    name: &'a str,
    /// The place of the conductor in the file.
    span: &'a Range<usize>,
    /// Whether it has a given charge instead of a potential.
    floats: bool,
}

/// The terminals of the file, and the measured capacitances, if the file names some; `None` if they are
/// invalid, with the reason in the log.
pub(super) fn terminals(
    raw: &Document,
    electrodes: Option<&Electrodes>,
    log: &mut Log<'_>,
) -> Option<(Vec<Terminal>, Option<Measured>)> {
    let conductors = conductors(raw, electrodes)?;
    let empty = Vec::new();
    let of_file = match &raw.terminal {
        Some(read) => read.get()?,
        None => &empty,
    };
    let mut terminals: Vec<(Terminal, &Read<Text>)> = Vec::new();
    // Every entry is read, so that every mistake is reported.
    let mut all_read = true;
    for read in of_file {
        match terminal(read, raw, &conductors, &terminals, log) {
            Some(found) => terminals.push(found),
            None => all_read = false,
        }
    }
    if !all_read {
        return None;
    }
    check_names(&terminals, &conductors, raw, log);
    check_one_is_driven(&terminals, &conductors, log);
    let mut terminals: Vec<Terminal> = terminals.into_iter().map(|(terminal, _)| terminal).collect();
    guards(&mut terminals, of_file, &conductors, log)?;
    let measured = match &raw.measure {
        Some(read) => Some(measured(read.get()?, &terminals, &conductors, log)?),
        None => {
            let followed = terminals.iter().find_map(|terminal| terminal.follows.clone());
            followed.map(|name| Measured::Entries(vec![MeasuredEntry::Own(name)]))
        }
    };
    Some((terminals, measured))
}

/// The conductors that a terminal may name; `None` if some could not be read.
fn conductors<'a>(raw: &'a Document, electrodes: Option<&'a Electrodes>) -> Option<Vec<Named<'a>>> {
    let mut out = Vec::new();
    match (raw.pair(), electrodes) {
        (Some(read), Some(electrodes)) => {
            out.extend(electrodes.names().map(|name| Named { name, span: &read.span, floats: false }));
        }
        (Some(_), None) => return None,
        (None, _) => {}
    }
    if let Some(read) = &raw.conductor {
        for conductor in read.get()? {
            let table = conductor.get()?;
            let name = &table.name.get()?.0;
            out.push(Named { name, span: &table.name.span, floats: table.charge.is_some() });
        }
    }
    Some(out)
}

/// One terminal of a file, after those of `before`.
fn terminal<'a>(
    read: &'a Read<raw::Terminal>,
    raw: &Document,
    conductors: &[Named<'_>],
    before: &[(Terminal, &Read<Text>)],
    log: &mut Log<'_>,
) -> Option<(Terminal, &'a Read<Text>)> {
    let table = read.get()?;
    let name = table.name.get()?.0.clone();
    let is_grounded = match &table.potential {
        Some(read) => matches!(read.get()?, raw::TerminalPotential::Ground),
        None => false,
    };

    let entries = table.conductors.get()?;
    if entries.is_empty() {
        log.push(
            Diagnostic::at(
                &table.conductors.span,
                format!("the terminal \"{}\" has no conductors", shown(&name)),
            )
            .label("nothing is on this wire")
            .help(match known(conductors.iter().map(|c| c.name)) {
                Some(names) => format!("list some of {names}"),
                None => "add a [[conductor]] first".to_owned(),
            }),
        );
        return None;
    }
    let mut members: Vec<String> = Vec::new();
    let mut listed: HashSet<&str> = HashSet::new();
    let mut all_usable = true;
    for entry in entries {
        let member = &entry.get()?.0;
        if let Some(role) = raw.indenter.as_ref().filter(|_| member == FieldIndenter::NAME) {
            let is_ground = given(&raw.indenter)
                .and_then(|table| table.role.get())
                .is_some_and(|role| matches!(role, Either::First(raw::IndenterRole::Grounded)));
            // A grounded indenter belongs to the ground of the terminal.
            if is_ground && is_grounded {
                continue;
            }
            log.push(
                Diagnostic::at(&entry.span, "the indenter belongs to no wire but that of the ground")
                    .label("the indenter of the field")
                    .related(&role.span, "its `role`")
                    .help(
                        "write `role = \"grounded\"` in [indenter] and `potential = \"ground\"` here, or leave \"indenter\" out",
                    ),
            );
            return None;
        }
        let is_again = !listed.insert(member);
        let conductor = conductors.iter().find(|c| c.name == *member);
        let elsewhere = before.iter().find(|(terminal, _)| terminal.holds(member));
        if conductor.is_none() && log.is_full() {
            // With a full log the message is only counted, and the search for a similar name would take long.
            log.push(Diagnostic::at(&entry.span, "there is no such conductor"));
        } else if conductor.is_none() {
            log.push(unknown("conductor", member, &entry.span, conductors.iter().map(|c| c.name)));
        } else if let Some((other, first)) = elsewhere {
            log.push(
                Diagnostic::at(
                    &entry.span,
                    format!("the conductor \"{}\" belongs to two terminals", shown(member)),
                )
                .label("on a second wire")
                .related(&first.span, format!("it belongs to \"{}\"", shown(&other.name)))
                .help("leave it out of one of the two, or make the two one terminal"),
            );
        } else if is_again {
            log.push(
                Diagnostic::at(&entry.span, format!("the conductor \"{}\" is listed twice", shown(member)))
                    .label("listed again")
                    .help("list each conductor once"),
            );
        } else if conductor.is_some_and(|c| c.floats) {
            log.push(
                Diagnostic::at(
                    &entry.span,
                    format!("the conductor \"{}\" floats, so that it is on no wire", shown(member)),
                )
                .label("has a `charge`")
                .help("leave out its `charge`, or leave it out of the terminal"),
            );
        } else {
            members.push(member.clone());
            continue;
        }
        all_usable = false;
    }
    if members.is_empty() && all_usable {
        log.push(
            Diagnostic::at(&table.conductors.span, "the grounded indenter alone is no terminal")
                .label("nothing else is on this wire")
                .help("leave this [[terminal]] out: `role = \"grounded\"` says it all"),
        );
        return None;
    }
    all_usable.then_some((Terminal { name, conductors: members, is_grounded, follows: None }, &table.name))
}

/// Refuses names with two meanings.
fn check_names(
    terminals: &[(Terminal, &Read<Text>)],
    conductors: &[Named<'_>],
    raw: &Document,
    log: &mut Log<'_>,
) {
    for (k, (terminal, read)) in terminals.iter().enumerate() {
        let name = &terminal.name;
        if let Some((_, first)) = terminals[..k].iter().find(|(other, _)| other.name == *name) {
            log.push(
                Diagnostic::at(&read.span, format!("two terminals have the name \"{}\"", shown(name)))
                    .label("used again")
                    .related(&first.span, "first used here")
                    .help("give each a name of its own, or make them one terminal"),
            );
        } else if let Some(other) = conductors.iter().find(|c| c.name == *name && !terminal.holds(c.name)) {
            log.push(
                Diagnostic::at(
                    &read.span,
                    format!(
                        "the terminal \"{}\" has the name of a conductor that does not belong to it",
                        shown(name)
                    ),
                )
                .label("the name of something else")
                .related(other.span, "the conductor")
                .help(format!("rename one of the two, or add \"{}\" to `conductors`", shown(name))),
            );
        } else if let Some(other) = given(&raw.dielectric)
            .into_iter()
            .flatten()
            .filter_map(|read| Some(&read.get()?.name))
            .find(|other| other.get().is_some_and(|text| text.0 == *name))
        {
            log.push(
                Diagnostic::at(&read.span, format!("the name \"{}\" is used twice", shown(name)))
                    .label("the name of a dielectric")
                    .related(&other.span, "first used here")
                    .help("rename one of the two"),
            );
        }
    }
}

/// Checks that a terminal is driven: a capacitance needs a source.
fn check_one_is_driven(terminals: &[(Terminal, &Read<Text>)], conductors: &[Named<'_>], log: &mut Log<'_>) {
    let on_ground =
        |name: &str| terminals.iter().any(|(terminal, _)| terminal.is_grounded && terminal.holds(name));
    let driven = conductors.iter().any(|c| !c.floats && !on_ground(c.name));
    if let (false, Some((_, read))) = (driven, terminals.iter().find(|(terminal, _)| terminal.is_grounded)) {
        log.push(
            Diagnostic::at(&read.span, "no terminal is driven: all conductors are grounded, or float")
                .label("grounded")
                .help("leave out `potential` of the terminal whose capacitance you want"),
        );
    }
}

/// Checks the driven guard and notes the terminal that it follows.
fn guards(
    terminals: &mut [Terminal],
    of_file: &[Read<raw::Terminal>],
    conductors: &[Named<'_>],
    log: &mut Log<'_>,
) -> Option<()> {
    let is_driven = |table: &raw::Terminal| {
        table
            .potential
            .as_ref()
            .and_then(Read::get)
            .is_some_and(|potential| matches!(potential, raw::TerminalPotential::Driven))
    };
    let driven: Vec<bool> = of_file.iter().map(|read| read.get().is_some_and(is_driven)).collect();
    for (k, read) in of_file.iter().enumerate() {
        let table = read.get()?;
        let follows = match (&table.follows, driven[k]) {
            (None, false) => continue,
            (Some(follows), true) => follows,
            (Some(follows), false) => {
                log.push(
                    Diagnostic::at(&follows.span, "`follows` belongs to a driven guard")
                        .label("this terminal has a potential of its own")
                        .help("add `potential = \"driven\"`, or leave `follows` out"),
                );
                return None;
            }
            (None, true) => {
                let span = table.potential.as_ref().map_or(&table.name.span, |read| &read.span);
                log.push(
                    Diagnostic::at(span, "a driven guard needs `follows`")
                        .label("driven by whom?")
                        .help("add `follows = \"...\"` with the name of the terminal whose potential it has"),
                );
                return None;
            }
        };
        let name = &follows.get()?.0;
        let before = driven[..k].iter().position(|is_guard| *is_guard);
        if let Some(first) = before.and_then(|first| of_file[first].get()) {
            log.push(
                Diagnostic::at(&table.name.span, "two terminals are driven guards")
                    .label("a second guard")
                    .related(&first.name.span, "the first")
                    .help("join their conductors in one terminal, or ground one of them"),
            );
            return None;
        }
        let other = terminals.iter().position(|terminal| terminal.name == *name);
        if other.is_some_and(|other| driven[other] || terminals[other].is_grounded) {
            log.push(
                Diagnostic::at(&follows.span, format!("a guard cannot follow \"{}\"", shown(name)))
                    .label("grounded, or a guard itself")
                    .help("name a terminal that is measured"),
            );
            return None;
        }
        terminal_named(name, &follows.span, terminals, conductors, log)?;
        terminals[k].follows = Some(name.clone());
    }
    Some(())
}

/// The measured capacitances.
fn measured(
    read: &raw::Measure,
    terminals: &[Terminal],
    conductors: &[Named<'_>],
    log: &mut Log<'_>,
) -> Option<Measured> {
    let entries = measured_entries(&read.capacitance, terminals, conductors, log)?;
    let kind = match &read.kind {
        Some(kind) => Some((kind.get()?, &kind.span)),
        None => None,
    };
    let refused = match (kind, entries.as_slice()) {
        (Some((raw::MeasureKind::TwoTerminal, _)), [MeasuredEntry::Mutual(pair)]) => {
            let measured = Measured::TwoTerminal(pair.clone());
            return check_guard(&measured, read, terminals, log).then_some(measured);
        }
        (Some((raw::MeasureKind::TwoTerminal, span)), _) => {
            (span, "a two-terminal capacitance is that of two terminals alone")
        }
        (Some((raw::MeasureKind::Mutual, span)), [MeasuredEntry::Own(_)]) => {
            (span, "a mutual capacitance is that of two terminals")
        }
        (Some((raw::MeasureKind::Mutual, _)) | None, _) => {
            let measured = Measured::Entries(entries);
            return check_guard(&measured, read, terminals, log).then_some(measured);
        }
    };
    let (span, message) = refused;
    log.push(
        Diagnostic::at(span, message)
            .label("of two names")
            .help("name two terminals in `capacitance`, or leave `kind` out"),
    );
    None
}

/// The capacitances that a list of names, or a list of such lists, stands for.
fn measured_entries(
    read: &Read<Vec<Read<raw::OneOrMore<Text>>>>,
    terminals: &[Terminal],
    conductors: &[Named<'_>],
    log: &mut Log<'_>,
) -> Option<Vec<MeasuredEntry>> {
    let mut names: Vec<(&String, &Range<usize>)> = Vec::new();
    let mut entries: Vec<MeasuredEntry> = Vec::new();
    for item in read.get()? {
        match item.get()? {
            Either::Second(text) => names.push((&text.0, &item.span)),
            Either::First(list) => {
                let list: Option<Vec<_>> =
                    list.iter().map(|name| Some((&name.get()?.0, &name.span))).collect();
                let entry = measured_entry(&list?, &item.span, terminals, conductors, log)?;
                if entries.contains(&entry) {
                    log.push(
                        Diagnostic::at(&item.span, "this capacitance is measured twice")
                            .label("named again")
                            .help("leave it out"),
                    );
                    return None;
                }
                entries.push(entry);
            }
        }
    }
    match (names.first(), entries.is_empty()) {
        (None, false) => Some(entries),
        (_, true) => Some(vec![measured_entry(&names, &read.span, terminals, conductors, log)?]),
        (Some((_, span)), false) => {
            log.push(
                Diagnostic::at(span, "names stand beside lists of names")
                    .label("not a list")
                    .help("put the names of each capacitance in brackets: [[\"a\", \"b\"], [\"a\", \"c\"]]"),
            );
            None
        }
    }
}

/// Checks that a driven guard, if there is one, is compatible with the measurement.
fn check_guard(measured: &Measured, read: &raw::Measure, terminals: &[Terminal], log: &mut Log<'_>) -> bool {
    let Some(guard) = terminals.iter().find(|terminal| terminal.follows.is_some()) else { return true };
    let is_one_against_ground =
        matches!(measured, Measured::Entries(entries) if matches!(entries[..], [MeasuredEntry::Own(_)]));
    let names_guard = measured.names().any(|name| name == guard.name);
    let names_followed = measured.names().any(|name| guard.follows.as_deref() == Some(name));
    if !names_guard && (is_one_against_ground || !names_followed) {
        return true;
    }
    log.push(
        Diagnostic::at(
            &read.capacitance.span,
            "a driven guard goes with the capacitance of one terminal against ground, that which it follows",
        )
        .label("not the capacitance of a guarded terminal")
        .help("measure the terminal that the guard follows, alone; or write `potential = \"ground\"` for the guard"),
    );
    false
}

/// One measured capacitance, from the names of its terminals and their positions in the file.
fn measured_entry(
    entries: &[(&String, &Range<usize>)],
    span: &Range<usize>,
    terminals: &[Terminal],
    conductors: &[Named<'_>],
    log: &mut Log<'_>,
) -> Option<MeasuredEntry> {
    let entry = match entries {
        [(name, _)] => MeasuredEntry::Own((*name).clone()),
        [(first, _), (second, at)] if first == second => {
            log.push(
                Diagnostic::at(at, format!("\"{}\" is measured against itself", shown(second)))
                    .label("named again")
                    .help("name two terminals, or this one once for its capacitance against ground"),
            );
            return None;
        }
        [(first, _), (second, _)] => MeasuredEntry::Mutual([(*first).clone(), (*second).clone()]),
        _ => {
            log.push(
                Diagnostic::at(span, "a capacitance is that between two terminals, or of one against ground")
                    .label(format!("{} names", entries.len()))
                    .help("name one terminal or two; write lists of them for several capacitances: [[\"a\", \"b\"], [\"a\", \"c\"]]"),
            );
            return None;
        }
    };
    for (name, at) in entries {
        terminal_named(name, at, terminals, conductors, log)?;
    }
    Some(entry)
}

/// Checks that a terminal of this name can be measured or followed.
fn terminal_named(
    name: &String,
    span: &Range<usize>,
    terminals: &[Terminal],
    conductors: &[Named<'_>],
    log: &mut Log<'_>,
) -> Option<()> {
    let is_free = |c: &&Named<'_>| !c.floats && !terminals.iter().any(|terminal| terminal.holds(c.name));
    let mut refuse = |message: String, label: &str, help: &str| {
        log.push(Diagnostic::at(span, message).label(label).help(help));
    };
    let written = shown(name);
    let terminal = terminals.iter().find(|terminal| terminal.name == *name);
    let holder = terminals.iter().find(|terminal| terminal.holds(name));
    let conductor = conductors.iter().find(|c| c.name == *name);
    if terminal.is_some_and(|terminal| terminal.is_grounded) {
        refuse(
            format!("the terminal \"{written}\" is grounded, so that it has no capacitance of its own"),
            "at potential zero",
            "leave out its `potential`, or measure another terminal",
        );
    } else if let (None, Some(holder)) = (terminal, holder) {
        let holder = shown(&holder.name);
        refuse(
            format!("the conductor \"{written}\" is measured with the terminal that it belongs to"),
            "not a terminal by itself",
            &format!("write \"{holder}\""),
        );
    } else if terminal.is_none() && conductor.is_some_and(|c| c.floats) {
        refuse(
            format!("the conductor \"{written}\" floats, so that it is no terminal"),
            "has a `charge`",
            "leave out its `charge`, or measure another terminal",
        );
    } else if terminal.is_none() && conductor.is_none() {
        let driven =
            terminals.iter().filter(|terminal| !terminal.is_grounded).map(|terminal| terminal.name.as_str());
        let names = driven.chain(conductors.iter().filter(is_free).map(|c| c.name));
        log.push(unknown("terminal", name, span, names));
    } else {
        return Some(());
    }
    None
}

/// The message for an unknown name.
fn unknown<'a>(
    what: &str,
    name: &str,
    span: &Range<usize>,
    names: impl Iterator<Item = &'a str> + Clone,
) -> Diagnostic {
    let help = match (nearest(name, names.clone()), known(names)) {
        (Some(near), _) => format!("write \"{}\"", shown(near)),
        (None, Some(names)) => format!("this case has {names}"),
        (None, None) => "this case has no conductors".to_owned(),
    };
    Diagnostic::at(span, format!("there is no {what} \"{}\"", shown(name)))
        .label(format!("not the name of a {what}"))
        .help(help)
}

/// A list of the first few names; `None` without names.
fn known<'a>(all_names: impl Iterator<Item = &'a str>) -> Option<String> {
    let mut names: Vec<String> =
        all_names.take(MAX_NAMES + 1).map(|name| format!("\"{}\"", shown(name))).collect();
    if names.len() > MAX_NAMES {
        names[MAX_NAMES] = "...".to_owned();
    }
    (!names.is_empty()).then(|| names.join(", "))
}

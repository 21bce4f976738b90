//! Checks the load steps, given as a list or as a range.

use std::ops::Range;

use super::super::diagnostics::Diagnostic;
use super::super::model::{Load, Pose};
use super::super::quantities::{Compression, Force};
use super::super::raw;
use super::super::reader::{FromToml, Log, Read};
use super::super::values::{Count, Either};
use super::given;

/// The loads of all steps, with zero before contact.
pub(super) fn load(read: &Read<raw::Load>, log: &mut Log<'_>) -> Option<Load> {
    let from_contact = from_contact(read, log);
    let before = distances(read)?.len();
    let after = |loads: Vec<f64>| std::iter::repeat_n(0.0, before).chain(loads).collect();
    Some(match from_contact? {
        Load::Compression(loads) => Load::Compression(after(loads)),
        Load::Force(loads) => Load::Force(after(loads)),
    })
}

/// The distances of the steps before contact, m.
fn distances(read: &Read<raw::Load>) -> Option<Vec<f64>> {
    let Some(approach) = &read.get()?.approach else { return Some(Vec::new()) };
    approach.get()?.iter().map(|distance| Some(distance.get()?.si)).collect()
}

/// The loads of the steps from contact on.
fn from_contact(read: &Read<raw::Load>, log: &mut Log<'_>) -> Option<Load> {
    let raw = read.get()?;
    if let Some(read) = &raw.compression {
        let value = |compression: &Compression| compression.value;
        return match read.get()? {
            Either::First(list) => steps(list, value, &read.span, "compression", raw, log),
            Either::Second(range) => spaced(&range.from, &range.to, &range.points, value, log),
        }
        .map(Load::Compression);
    }
    if let Some(read) = &raw.steps {
        return listed(read, log);
    }
    let value = |force: &Force| force.si;
    let span = &raw.force.as_ref()?.span;
    match given(&raw.force)? {
        Either::First(list) => steps(list, value, span, "force", raw, log),
        Either::Second(range) => spaced(&range.from, &range.to, &range.points, value, log),
    }
    .map(Load::Force)
}

/// Checks that a change has two steps, and bounds at both. `load` is `None` if the file has none.
pub(super) fn check_change(raw: &raw::Document, load: Option<&Option<Load>>, log: &mut Log<'_>) {
    let Some(table) = given(&raw.electrostatics) else { return };
    let Some(read) = &table.change_tolerance else { return };
    let steps = match load {
        None => 0,
        Some(Some(load)) => load.steps(),
        // The reason is in the log.
        Some(None) => return,
    };
    if steps < 2 {
        let found = if steps == 0 { "there is no [load]" } else { "[load] has one step" };
        log.push(
            Diagnostic::at(&read.span, "`change_tolerance` needs at least two load steps")
                .label(format!("{found}, so that nothing changes"))
                .help("the change is that against the first step: begin [load] with the unloaded sensor, or leave out `change_tolerance`"),
        );
    }
    if let Some(bounds) = &table.bounds
        && bounds.get().is_some_and(|flag| !flag.0)
    {
        log.push(
            Diagnostic::at(&read.span, "`change_tolerance` needs bounds")
                .label("asks for a proved change")
                .related(&bounds.span, "leaves out the lower bounds")
                .help("leave out `bounds = false`, or `change_tolerance`"),
        );
    }
}

/// The loads of steps that are tables: all with a compression, or all with a force.
fn listed(read: &Read<Vec<Read<raw::LoadStep>>>, log: &mut Log<'_>) -> Option<Load> {
    let list = read.get()?;
    let Some(first) = list.first() else {
        log.push(
            Diagnostic::at(&read.span, "no load steps: `steps` in [load] is empty")
                .label("at least one step is needed")
                .help("write for example `steps = [{ compression = 0.0 }, { compression = 0.2 }]`"),
        );
        return None;
    };
    let by_force = first.get()?.force.is_some();
    if let Some(other) = list.iter().find(|step| step.get().is_some_and(|s| s.force.is_some() != by_force)) {
        let (here, there) = if by_force { ("compression", "force") } else { ("force", "compression") };
        log.push(
            Diagnostic::at(&other.span, "some of the load steps give a compression, some a force")
                .label(format!("gives a {here}"))
                .related(&first.span, format!("gives a {there}"))
                .help(format!("give all steps a `{there}`, or write two cases")),
        );
        return None;
    }
    if by_force {
        let force = |step: &Read<raw::LoadStep>| Some(given(&step.get()?.force)?.si);
        list.iter().map(force).collect::<Option<_>>().map(Load::Force)
    } else {
        let compression = |step: &Read<raw::LoadStep>| Some(given(&step.get()?.compression)?.value);
        list.iter().map(compression).collect::<Option<_>>().map(Load::Compression)
    }
}

/// The displacement of the indenter and of the attached bodies at each step; empty if no step has one.
pub(super) fn poses(read: &Read<raw::Load>) -> Option<Vec<Pose>> {
    let Some(steps) = &read.get()?.steps else {
        // There is no distance from contact on.
        let before = distances(read)?.into_iter();
        return Some(before.map(|distance| Pose { distance, ..Pose::default() }).collect());
    };
    let pose = |step: &Read<raw::LoadStep>| {
        let step = step.get()?;
        let shift = match &step.shift {
            Some(read) => {
                let [x1, x3] = read.get()?;
                [x1.get()?.si, x3.get()?.si]
            }
            None => [0.0; 2],
        };
        let tilt = match &step.tilt {
            Some(read) => {
                let [x3, x1] = read.get()?;
                [x3.get()?.si, x1.get()?.si]
            }
            None => [0.0; 2],
        };
        Some(Pose { shift, tilt, distance: 0.0 })
    };
    let poses: Vec<Pose> = steps.get()?.iter().map(pose).collect::<Option<_>>()?;
    Some(if poses.iter().all(|pose| *pose == Pose::default()) { Vec::new() } else { poses })
}

/// The values of a list. It may be empty only if `load` has steps before contact: an approach without
/// contact.
fn steps<T: FromToml>(
    list: &[Read<T>],
    value: impl Fn(&T) -> f64,
    span: &Range<usize>,
    key: &str,
    load: &raw::Load,
    log: &mut Log<'_>,
) -> Option<Vec<f64>> {
    let approaches = given(&load.approach).is_some_and(|distances| !distances.is_empty());
    if list.is_empty() && !approaches {
        let sample = T::sample(log);
        log.push(
            Diagnostic::at(span, format!("no load steps: `{key}` in [load] is empty"))
                .label("at least one step is needed")
                .help(format!(
                    "write for example `{key} = [{sample}]`, or leave out [load] for the unloaded sensor"
                )),
        );
        return None;
    }
    list.iter().map(|read| read.get().map(&value)).collect()
}

/// Equally spaced steps; the ends are exact, and the values between are rounded to 15 digits for printing.
fn spaced<T>(
    from: &Read<T>,
    to: &Read<T>,
    points: &Read<Count>,
    value: impl Fn(&T) -> f64,
    log: &mut Log<'_>,
) -> Option<Vec<f64>> {
    let (first, last, count) = (value(from.get()?), value(to.get()?), points.get()?.0);
    if count == 1 && first.to_bits() != last.to_bits() {
        log.push(
            Diagnostic::at(&points.span, "one point cannot be at both ends of the range")
                .label("too few")
                .related(&from.span, "one end")
                .related(&to.span, "the other end")
                .help("write for example `points = 2`"),
        );
        return None;
    }
    let step = |k: u32| match k {
        0 => first,
        k if k + 1 == count => last,
        k => {
            let share = f64::from(k) / f64::from(count - 1);
            let exact = first * (1.0 - share) + last * share;
            format!("{exact:.14e}").parse().unwrap_or(exact)
        }
    };
    Some((0..count).map(step).collect())
}

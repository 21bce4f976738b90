//! Checks boxes, sheets and slabs, whose corners must be in ascending order.

use super::super::diagnostics::Diagnostic;
use super::super::model::Box3;
use super::super::quantities::Position;
use super::super::raw;
use super::super::reader::{Log, Read};

/// The smallest length of a side, m.
const THINNEST: f64 = 1e-15;

/// The names of the axes in the file.
pub(super) const AXES: [&str; 3] = ["x1", "x2", "x3"];

/// A box with three positive sides.
pub(super) fn box_region(read: &Read<raw::BoxRegion>, log: &mut Log<'_>) -> Option<Box3> {
    with_sides(read, false, log)
}

/// A box with three positive sides, or a sheet with two.
pub(super) fn box_or_sheet(read: &Read<raw::BoxRegion>, log: &mut Log<'_>) -> Option<Box3> {
    with_sides(read, true, log)
}

/// A box with three positive sides, or with two if it `may_be_flat`; `None` if it is invalid, with the reason
/// in the log.
fn with_sides(read: &Read<raw::BoxRegion>, mut may_be_flat: bool, log: &mut Log<'_>) -> Option<Box3> {
    let raw = read.get()?;
    let (min, max) = (raw.min.get()?, raw.max.get()?);
    let mut region = Box3::SPACE;
    let mut is_valid = true;
    for (axis, (low, high)) in min.iter().zip(max).enumerate() {
        let (Some(from), Some(to)) = (low.get(), high.get()) else {
            is_valid = false;
            continue;
        };
        (region.min[axis], region.max[axis]) = (from.si, to.si);
        if may_be_flat && to.si == from.si {
            may_be_flat = false;
        } else if is_valid && to.si - from.si < THINNEST {
            is_valid = false;
            log.push(not_a_box(axis, low, high, min, max, log));
        }
    }
    is_valid.then_some(region)
}

/// The message for a box or sheet that has no extent along `axis`.
fn not_a_box(
    axis: usize,
    low: &Read<Position>,
    high: &Read<Position>,
    min: &[Read<Position>],
    max: &[Read<Position>],
    log: &Log<'_>,
) -> Diagnostic {
    let (from, to) = (low.get().map_or(0.0, |p| p.si), high.get().map_or(0.0, |p| p.si));
    let name = AXES[axis];
    if to < from {
        let sorted = |larger: bool| {
            let texts = min.iter().zip(max).map(|(low, high)| {
                let swap = matches!((low.get(), high.get()), (Some(l), Some(h)) if h.si < l.si);
                log.text(if swap == larger { &low.span } else { &high.span })
            });
            texts.collect::<Vec<_>>().join(", ")
        };
        Diagnostic::at(&high.span, format!("the box is inside-out along {name}: `max` is less than `min`"))
            .label("less than `min`")
            .related(&low.span, "`min`")
            .help(format!("write `min = [{}], max = [{}]`", sorted(false), sorted(true)))
    } else if to == from {
        Diagnostic::at(&high.span, format!("the box has no thickness along {name}"))
            .label("the same as `min`")
            .related(&low.span, "`min`")
            .help(format!(
                "a flat conductor is a sheet: `sheet = {{ normal = \"{name}\", at = {}, ... }}`",
                log.text(&low.span)
            ))
    } else {
        Diagnostic::at(&high.span, format!("the box is thinner along {name} than elastocap computes: 1 fm"))
            .label("too close to `min`")
            .related(&low.span, "`min`")
            .help("is the prefix of the unit right?")
    }
}

/// The number of an axis, from 0.
pub(super) fn axis_index(axis: raw::Axis) -> usize {
    match axis {
        raw::Axis::X1 => 0,
        raw::Axis::X2 => 1,
        raw::Axis::X3 => 2,
    }
}

/// A rectangle with two positive sides.
pub(super) fn sheet(read: &Read<raw::Sheet>, log: &mut Log<'_>) -> Option<Box3> {
    let raw = read.get()?;
    let (min, max) = (raw.min.get()?, raw.max.get()?);
    let normal = axis_index(*raw.normal.get()?);
    let mut region = Box3::SPACE;
    let axes = (0..3).filter(|axis| *axis != normal);
    let mut is_valid = true;
    for (axis, (low, high)) in axes.zip(min.iter().zip(max)) {
        let (Some(from), Some(to)) = (low.get(), high.get()) else {
            is_valid = false;
            continue;
        };
        (region.min[axis], region.max[axis]) = (from.si, to.si);
        if is_valid && to.si - from.si < THINNEST {
            is_valid = false;
            let mut diagnostic = not_a_box(axis, low, high, min, max, log);
            diagnostic.message = diagnostic.message.replacen("box", "sheet", 1);
            if to.si == from.si {
                diagnostic.help = Some("a sheet needs two sides; a line is not a conductor".to_owned());
            }
            log.push(diagnostic);
        }
    }
    let at = raw.at.get()?.si;
    (region.min[normal], region.max[normal]) = (at, at);
    is_valid.then_some(region)
}

/// All space between two planes.
pub(super) fn slab(read: &Read<raw::Slab>, log: &mut Log<'_>) -> Option<Box3> {
    let raw = read.get()?;
    let (from, to) = (raw.from.get()?.si, raw.to.get()?.si);
    let axis = axis_index(*raw.axis.get()?);
    if to - from < THINNEST {
        let (from, to) = (log.text(&raw.from.span), log.text(&raw.to.span));
        log.push(
            Diagnostic::at(&raw.to.span, "the slab is inside-out: `to` must be greater than `from`")
                .label("not greater than `from`")
                .related(&raw.from.span, "`from`")
                .help(format!("write for example `from = {to}, to = {from}`")),
        );
        return None;
    }
    let mut region = Box3::SPACE;
    (region.min[axis], region.max[axis]) = (from, to);
    Some(region)
}

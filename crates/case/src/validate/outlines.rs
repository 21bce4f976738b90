//! Outlines that are pulled along an axis.

use elastocap_geometry::drawing::{Drawn, Entry, Flaw, drawn};

use super::super::diagnostics::Diagnostic;
use super::super::model::Shape;
use super::super::quantities::Position;
use super::super::raw;
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::regions::axis_index;

/// Largest number of corners of an outline, those on curves among them.
const MAX_CORNERS: usize = 20_000;

pub(super) fn extruded(raw: &raw::Extruded, may_be_flat: bool, log: &mut Log<'_>) -> Option<Shape> {
    let (from, to) = (raw.from.get()?.si, raw.to.get()?.si);
    if to < from || (to == from && !may_be_flat) {
        log.push(
            Diagnostic::at(&raw.to.span, "the extrusion is inside-out: `to` must be greater than `from`")
                .label("not greater than `from`")
                .related(&raw.from.span, "`from`")
                .help(format!(
                    "write `from = {}, to = {}`",
                    log.text(&raw.to.span),
                    log.text(&raw.from.span)
                )),
        );
        return None;
    }
    let entries = raw.outline.get()?;
    let refused = |count: usize, log: &mut Log<'_>| {
        log.push(
            Diagnostic::at(
                &raw.outline.span,
                format!("an outline has 3 to {MAX_CORNERS} corners, this one {count}"),
            )
            .label("corners in the two other axes, in order")
            .help("the last corner is joined to the first one by itself"),
        );
    };
    if entries.is_empty() || entries.len() > MAX_CORNERS {
        refused(entries.len(), log);
        return None;
    }
    let read: Vec<Option<Entry>> = entries.iter().map(|entry| entry_of(entry, log)).collect();
    let read: Vec<Entry> = read.into_iter().collect::<Option<_>>()?;
    let points =
        |entry: &Entry| if let Entry::Spline { through, .. } = entry { through.len() + 1 } else { 1 };
    let count = read.iter().map(points).sum();
    if count > MAX_CORNERS {
        refused(count, log);
        return None;
    }
    let Drawn { outline, arcs, entries: numbers } = match drawn(&read) {
        Ok(drawn) => drawn,
        Err(flaw) => {
            log.push(refusal(flaw, entries));
            return None;
        }
    };
    if !(3..=MAX_CORNERS).contains(&outline.len()) {
        refused(outline.len(), log);
        return None;
    }
    if let Some([k, l]) = crossing(&outline) {
        let of = |k: usize| (numbers[k] + 1, numbers[(k + 1) % outline.len()] + 1);
        let side = |k: usize| match of(k) {
            (a, b) if a == b => format!("the curve of entry {a}"),
            (a, b) => format!("the side from corner {a} to {b}"),
        };
        log.push(
            Diagnostic::at(&raw.outline.span, "the outline crosses or touches itself")
                .label(match (side(k), side(l)) {
                    (one, other) if one == other => format!("{one} meets itself"),
                    (one, other) => format!("{one} meets {other}"),
                })
                .help("list the corners in order around the figure, without a hole"),
        );
        return None;
    }
    if is_flat(&outline) {
        log.push(
            Diagnostic::at(&raw.outline.span, "the outline encloses no area")
                .label("all corners lie on a line, or nearly so")
                .help("list the corners of a figure; a thin one may be a millionth as wide as it is long"),
        );
        return None;
    }
    Some(Shape::Extrusion { axis: axis_index(*raw.axis.get()?), from, to, outline, arcs })
}

/// An entry of an outline; `None` if it cannot be used, and the log says why.
fn entry_of(read: &Read<raw::OutlineEntry>, log: &mut Log<'_>) -> Option<Entry> {
    let place = |point: &[Read<Position>; 2]| Some([point[0].get()?.si, point[1].get()?.si]);
    let places = |points: &Vec<Read<[Read<Position>; 2]>>| -> Option<Vec<[f64; 2]>> {
        points.iter().map(|point| place(point.get()?)).collect()
    };
    let given = |point: &Option<Read<[Read<Position>; 2]>>| point.as_ref().map(|read| place(read.get()?));
    let round = match read.get()? {
        Either::First(corner) => return Some(Entry::Corner(place(corner)?)),
        Either::Second(round) => round,
    };
    let (to, through, corner) = (given(&round.to), given(&round.through), given(&round.corner));
    match (to, through, &round.spline, corner, &round.radius) {
        (Some(to), Some(through), None, None, None) => Some(Entry::Arc { through: through?, to: to? }),
        (Some(to), None, Some(points), None, None) => {
            let through = places(points.get()?)?;
            if through.is_empty() {
                log.push(
                    Diagnostic::at(&points.span, "a spline passes through one point or more on its way")
                        .label("no point")
                        .help("write a straight side as a corner, `[.., ..]`"),
                );
                return None;
            }
            Some(Entry::Spline { through, to: to? })
        }
        (None, None, None, Some(corner), Some(radius)) => {
            Some(Entry::Rounded { corner: corner?, radius: radius.get()?.si })
        }
        // Neither or both were told already.
        (Some(_), _, _, Some(_), _) | (None, _, _, None, _) => None,
        _ => {
            let what = "an entry of an outline is a corner, an arc, a spline or a rounded corner";
            log.push(
                Diagnostic::at(&read.span, what)
                    .label("neither `to` with one of `through` and `spline`, nor `corner` and `radius`")
                    .help(
                        "write an arc as `{ through = [..], to = [..] }`, a spline as `{ spline = [[..], ..], to = [..] }`, a rounded corner as `{ corner = [..], radius = .. }`",
                    ),
            );
            None
        }
    }
}

/// What is wrong with an outline that cannot be drawn.
fn refusal(flaw: Flaw, entries: &[Read<raw::OutlineEntry>]) -> Diagnostic {
    let (entry, what, label, help) = match flaw {
        Flaw::Straight(entry) => (
            entry,
            "the arc has no circle",
            "its ends and `through` lie on a line, or two of them are one point",
            "an arc begins where the entry before ends; take `through` from about its middle",
        ),
        Flaw::Coincident(entry) => (
            entry,
            "two neighbouring points of the spline are one",
            if entries.len() == 1 {
                "the only entry of the outline: it begins where it ends, and needs two other points at least"
            } else {
                "a spline begins where the entry before ends"
            },
            "list different points, in order from the first after that to the last before `to`",
        ),
        Flaw::BesideArc(entry) => (
            entry,
            "a rounded corner lies between two straight sides",
            "there is an arc or a spline beside it",
            "write the rounding as an arc, `{ through = [..], to = [..] }`",
        ),
        Flaw::TooLarge(entry) => (
            entry,
            "the sides are too short for this rounding",
            "and that of the corners beside it",
            "make `radius` smaller, or the sides longer",
        ),
        Flaw::NoCorner(entry) => (
            entry,
            "this corner cannot be rounded",
            "the outline does not turn here, or it turns back",
            "leave the entry out, or write a corner without `radius`",
        ),
    };
    let span = entries.get(entry).map_or(0..0, |read| read.span.clone());
    Diagnostic::at(&span, what).label(label).help(help)
}

/// Least area of an outline, over the square of its extent.
const LEAST_AREA: f64 = 1e-12;

/// Whether an outline has no area to speak of.
fn is_flat(outline: &[[f64; 2]]) -> bool {
    let extent = (0..2).map(|k| {
        let [low, high] = outline
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
        high - low
    });
    let scale = extent.fold(0.0, f64::max);
    let Some(&first) = outline.first() else { return true };
    // In units of the extent: squares of lengths may underflow.
    let from_first = |p: [f64; 2]| [(p[0] - first[0]) / scale, (p[1] - first[1]) / scale];
    let next = outline.iter().cycle().skip(1);
    let double: f64 = outline
        .iter()
        .zip(next)
        .map(|(p, q)| (from_first(*p), from_first(*q)))
        .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
        .sum();
    let share = 0.5 * double.abs();
    share.is_nan() || share <= LEAST_AREA
}

/// Two sides of an outline that meet anywhere but at a common corner, by their first corners.
fn crossing(outline: &[[f64; 2]]) -> Option<[usize; 2]> {
    let n = outline.len();
    let apart = |k: usize, l: usize| {
        let [a, b, c, d] = [k, (k + 1) % n, l, (l + 1) % n].map(|i| outline[i]);
        (0..2).any(|x| a[x].max(b[x]) < c[x].min(d[x]) || c[x].max(d[x]) < a[x].min(b[x]))
    };
    let side =
        |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let within = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (0..2).all(|k| p[k].min(q[k]) <= r[k] && r[k] <= p[k].max(q[k]))
    };
    let meet = |k: usize, l: usize| {
        let [a, b, c, d] = [k, (k + 1) % n, l, (l + 1) % n].map(|i| outline[i]);
        let (of_c, of_d, of_a, of_b) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
        (of_c * of_d < 0.0 && of_a * of_b < 0.0)
            || (of_c == 0.0 && within(a, b, c))
            || (of_d == 0.0 && within(a, b, d))
            || (of_a == 0.0 && within(c, d, a))
            || (of_b == 0.0 && within(c, d, b))
    };
    // A side that goes back along the one before it has more than the corner in common with it.
    let goes_back = |k: usize| {
        let [a, b, c] = [k, (k + 1) % n, (k + 2) % n].map(|i| outline[i]);
        let along = (0..2).map(|x| (b[x] - a[x]) * (c[x] - b[x])).sum::<f64>();
        side(a, b, c) == 0.0 && along < 0.0
    };
    if let Some(k) = (0..n).find(|&k| goes_back(k)) {
        return Some([k, (k + 1) % n]);
    }
    (0..n).find_map(|k| {
        let neighbours = |l: usize| (l + 1) % n == k || (k + 1) % n == l;
        (k + 1..n).find(|&l| !apart(k, l) && !neighbours(l) && meet(k, l)).map(|l| [k, l])
    })
}

//! Checks and draws the outlines of extruded bodies.

use elastocap_geometry::drawing::{Drawn, Entry, Flaw, drawn};
use elastocap_geometry::outline::contains;
use elastocap_geometry::perforated::perforated;

use super::super::diagnostics::Diagnostic;
use super::super::model::Shape;
use super::super::quantities::Position;
use super::super::raw;
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::regions::axis_index;

/// The largest number of corners of an outline, including those on curves.
const MAX_CORNERS: usize = 20_000;

/// The parts of an extruded outline: one, if it has no holes.
pub(super) fn extruded(raw: &raw::Extruded, may_be_flat: bool, log: &mut Log<'_>) -> Option<Vec<Shape>> {
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
    let whole = closed(&raw.outline, log);
    let empty = Vec::new();
    let holes = match &raw.holes {
        Some(read) => read.get()?,
        None => &empty,
    };
    // Every hole is read, so that every mistake is reported.
    let drawn: Vec<Option<Drawn>> = holes.iter().map(|hole| closed(hole, log)).collect();
    let (whole, drawn) = (whole?, drawn.into_iter().collect::<Option<Vec<Drawn>>>()?);
    let axis = axis_index(*raw.axis.get()?);
    if drawn.is_empty() {
        return Some(vec![Shape::Extrusion { axis, from, to, outline: whole.outline, arcs: whole.arcs }]);
    }
    check_holes(raw, &whole, holes, &drawn, log)?;
    let parts = perforated(axis, [from, to], &whole, &drawn);
    if parts.is_none() {
        log.push(
            Diagnostic::at(&raw.outline.span, "the outline cannot be divided around its holes")
                .label("some of its corners are too close to those of a hole, or to one another")
                .help("leave more room between them, or use fewer corners"),
        );
    }
    parts
}

/// Refuses holes that do not lie inside the outline and apart from one another.
fn check_holes(
    raw: &raw::Extruded,
    whole: &Drawn,
    holes: &[Read<Vec<Read<raw::OutlineEntry>>>],
    drawn: &[Drawn],
    log: &mut Log<'_>,
) -> Option<()> {
    let is_inside =
        |hole: &Drawn| hole.outline.first().is_some_and(|corner| contains(&whole.outline, *corner));
    for (k, (read, hole)) in holes.iter().zip(drawn).enumerate() {
        if meet(&whole.outline, &hole.outline) || !is_inside(hole) {
            log.push(
                Diagnostic::at(&read.span, "the hole does not lie inside the outline")
                    .label("touches the outline, crosses it, or lies outside")
                    .related(&raw.outline.span, "the outline")
                    .help("leave metal all around the hole; a notch in the edge belongs to `outline`"),
            );
            return None;
        }
        let within =
            |one: &Drawn, other: &Drawn| one.outline.first().is_some_and(|p| contains(&other.outline, *p));
        let overlaps = |other: &&(&Read<_>, &Drawn)| {
            meet(&other.1.outline, &hole.outline) || within(hole, other.1) || within(other.1, hole)
        };
        let before: Vec<_> = holes.iter().zip(drawn).take(k).collect();
        if let Some((first, _)) = before.iter().find(overlaps) {
            log.push(
                Diagnostic::at(&read.span, "two holes touch or overlap")
                    .label("shares a point with another hole")
                    .related(&first.span, "the other hole")
                    .help("leave metal between the two, or draw them as one hole"),
            );
            return None;
        }
    }
    Some(())
}

/// A closed outline, drawn; `None` if it is invalid, with the reason in the log.
fn closed(read: &Read<Vec<Read<raw::OutlineEntry>>>, log: &mut Log<'_>) -> Option<Drawn> {
    let entries = read.get()?;
    let refused = |count: usize, log: &mut Log<'_>| {
        log.push(
            Diagnostic::at(
                &read.span,
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
    // Every entry is checked, so that every mistake is reported.
    let checked: Vec<Option<Entry>> = entries.iter().map(|entry| entry_of(entry, log)).collect();
    let checked: Vec<Entry> = checked.into_iter().collect::<Option<_>>()?;
    let points =
        |entry: &Entry| if let Entry::Spline { through, .. } = entry { through.len() + 1 } else { 1 };
    let count = checked.iter().map(points).sum();
    if count > MAX_CORNERS {
        refused(count, log);
        return None;
    }
    let Drawn { outline, arcs, entries: numbers } = match drawn(&checked) {
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
        let ends = |k: usize| (numbers[k] + 1, numbers[(k + 1) % outline.len()] + 1);
        let side = |k: usize| match ends(k) {
            (a, b) if a == b => format!("the curve of entry {a}"),
            (a, b) => format!("the side from corner {a} to {b}"),
        };
        log.push(
            Diagnostic::at(&read.span, "the outline crosses or touches itself")
                .label(match (side(k), side(l)) {
                    (one, other) if one == other => format!("{one} meets itself"),
                    (one, other) => format!("{one} meets {other}"),
                })
                .help("list the corners in order around the figure; a hole in it belongs into `holes`"),
        );
        return None;
    }
    if is_flat(&outline) {
        log.push(
            Diagnostic::at(&read.span, "the outline encloses no area")
                .label("all corners lie on a line, or nearly so")
                .help("list the corners of a figure; a thin one may be a millionth as wide as it is long"),
        );
        return None;
    }
    Some(Drawn { outline, arcs, entries: numbers })
}

/// An entry of an outline; `None` if it is invalid, with the reason in the log.
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
        // Entries with neither or both are already reported.
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

/// The error message for an outline that cannot be drawn.
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

/// The least area of an outline, over the square of its extent. Not tuned: it only has to lie above rounding
/// errors and below errors that matter.
const LEAST_AREA: f64 = 1e-12;

/// Whether the area of an outline is practically zero.
fn is_flat(outline: &[[f64; 2]]) -> bool {
    let extent = (0..2).map(|k| {
        let [low, high] = outline
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])]);
        high - low
    });
    let scale = extent.fold(0.0, f64::max);
    let Some(&first) = outline.first() else { return true };
    // In units of the extent, since squares of lengths may underflow.
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

/// The first corners of two sides of an outline that meet elsewhere than at a common corner.
fn crossing(outline: &[[f64; 2]]) -> Option<[usize; 2]> {
    let n = outline.len();
    let ends = |k: usize| [outline[k], outline[(k + 1) % n]];
    let apart = |k: usize, l: usize| are_apart(ends(k), ends(l));
    let meet = |k: usize, l: usize| have_a_point_in_common(ends(k), ends(l));
    // A side that goes back along the side before it has more than the corner in common with it.
    let goes_back = |k: usize| {
        let [a, b, c] = [k, (k + 1) % n, (k + 2) % n].map(|i| outline[i]);
        let along = (0..2).map(|x| (b[x] - a[x]) * (c[x] - b[x])).sum::<f64>();
        turn(a, b, c) == 0.0 && along < 0.0
    };
    if let Some(k) = (0..n).find(|&k| goes_back(k)) {
        return Some([k, (k + 1) % n]);
    }
    (0..n).find_map(|k| {
        let neighbours = |l: usize| (l + 1) % n == k || (k + 1) % n == l;
        (k + 1..n).find(|&l| !apart(k, l) && !neighbours(l) && meet(k, l)).map(|l| [k, l])
    })
}

/// Whether two outlines have a point in common.
fn meet(one: &[[f64; 2]], other: &[[f64; 2]]) -> bool {
    let sides = |outline: &[[f64; 2]]| -> Vec<[[f64; 2]; 2]> {
        outline.iter().zip(outline.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]).collect()
    };
    let others = sides(other);
    let met = |candidate: [[f64; 2]; 2]| {
        others.iter().any(|side| !are_apart(candidate, *side) && have_a_point_in_common(candidate, *side))
    };
    sides(one).into_iter().any(met)
}

/// Whether the boxes around two sides have no point in common.
fn are_apart([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    (0..2).any(|x| a[x].max(b[x]) < c[x].min(d[x]) || c[x].max(d[x]) < a[x].min(b[x]))
}

/// The side of the line from the first to the second point on which the third point lies: positive on the
/// left, zero on the line.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Whether two sides have a point in common.
fn have_a_point_in_common([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let within = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (0..2).all(|k| p[k].min(q[k]) <= r[k] && r[k] <= p[k].max(q[k]))
    };
    let (of_c, of_d, of_a, of_b) = (turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b));
    (of_c * of_d < 0.0 && of_a * of_b < 0.0)
        || (of_c == 0.0 && within(a, b, c))
        || (of_d == 0.0 && within(a, b, d))
        || (of_a == 0.0 && within(c, d, a))
        || (of_b == 0.0 && within(c, d, b))
}

//! `[measurement]`: reads the points of a CSV file. Errors in that file are reported with its name and line,
//! at the key of the case that names it.

use std::ops::Range;
use std::path::Path;

use elastocap_files::ReadError;

use super::super::diagnostics::{Diagnostic, shown, shown_path};
use super::super::model::{Correction, MeasuredLoad, MeasuredPoint, MeasuredPoints};
use super::super::raw::{self, Document, MeasuredColumn};
use super::super::reader::{Log, Read, nearest};
use super::super::units::{self, CAPACITANCE, Dimension, FORCE, LENGTH};
use super::super::values::Either;
use super::has_entries;

/// The largest size of the file, bytes.
const LARGEST_FILE: u64 = 16 << 20;
/// The largest number of points.
const MAX_POINTS: usize = 100_000;
/// The largest number of names of columns in one message.
const MAX_NAMES: usize = 12;

/// A column, with the factor from its numbers to SI units.
#[derive(Debug, Clone, Copy)]
struct Column<'a> {
    name: &'a str,
    /// The place in the case that names the column.
    span: &'a Range<usize>,
    /// A number of the column times this factor is its value in SI units.
    factor: f64,
}

/// The columns and rows that hold the points.
struct Layout<'a> {
    load: Column<'a>,
    /// The kind of load in the column `load`.
    kind: MeasuredLoad,
    capacitance: Column<'a>,
    deviation: Option<Column<'a>>,
    /// A column and the text that it has in the rows to read; `None` for all rows.
    rows: Option<(Column<'a>, &'a str)>,
}

/// The points of the file; `None` if they are invalid, with the reason in the log.
///
/// `flawed` says that an unknown key at the top level may stand for a missing table.
pub(super) fn measured_points(
    read: &Read<raw::MeasurementFile>,
    raw: &Document,
    flawed: bool,
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<MeasuredPoints> {
    let table = read.get()?;
    if !flawed {
        check_use(read, raw, log);
    }
    let layout = layout(table.columns.get()?, &table.columns.span, table.rows.as_ref(), log);
    let constant = match &table.deviation {
        Some(read) => Some(read.get()?.si),
        None => None,
    };
    if let (Some(given), Some(column)) =
        (&table.deviation, layout.as_ref().and_then(|layout| layout.deviation))
    {
        log.push(
            Diagnostic::at(&given.span, "the deviation of [measurement] is given twice")
                .label("here for all points")
                .related(column.span, "and here by a column")
                .help("leave one of them out"),
        );
        return None;
    }
    let correction = correction(table, layout.as_ref().map(|layout| layout.kind), log)?;
    let file = &table.file;
    let (name, layout) = (file.get()?.0.as_str(), layout?);
    let path = origin.parent().unwrap_or(Path::new("")).join(name);
    let text = match text_of(&path) {
        Ok(text) => text,
        Err(reason) => {
            log.push(
                Diagnostic::at(&file.span, format!("cannot use the measured points of `{}`: {reason}", shown_path(&path)))
                    .label("named here")
                    .help("name a CSV file whose first line has the names of the columns; its path is relative to the case file"),
            );
            return None;
        }
    };
    let points = points(&text, &path, &layout, constant, &file.span).map_err(|why| log.push(why)).ok()?;
    Some(MeasuredPoints { file: name.to_owned(), load: layout.kind, points, correction })
}

/// The correction: offset, parasitic capacitance and gain.
fn correction(
    table: &raw::MeasurementFile,
    kind: Option<MeasuredLoad>,
    log: &mut Log<'_>,
) -> Option<Correction> {
    let usual = Correction::default();
    let parasitic = match &table.parasitic {
        Some(read) => read.get()?.si,
        None => usual.parasitic,
    };
    let gain = match &table.gain {
        Some(read) => read.get()?.value,
        None => usual.gain,
    };
    let (Some(read), Some(kind)) = (&table.offset, kind) else {
        return Some(Correction { parasitic, gain, ..usual });
    };
    let dimension = match kind {
        MeasuredLoad::Force => Some(FORCE),
        MeasuredLoad::Displacement => Some(LENGTH),
        MeasuredLoad::Compression => None,
    };
    let offset = match (read.get()?, dimension) {
        (Either::First(number), None) => Some(number.value),
        (Either::Second(text), Some(dimension)) => {
            units::parse(&text.0).ok().filter(|found| found.dimension == dimension).map(|found| found.si)
        }
        (Either::First(_), Some(_)) | (Either::Second(_), None) => None,
    };
    if offset.is_none() {
        let right = dimension
            .map_or_else(|| "0.05".to_owned(), |dimension| format!("\"0.5 {}\"", usual_unit(dimension)));
        log.push(
            Diagnostic::at(
                &read.span,
                format!("the offset of [measurement] must be a {}, as its loads are", kind.name()),
            )
            .label("something else")
            .help(format!("write for example `offset = {right}`")),
        );
    }
    Some(Correction { offset: offset?, parasitic, gain })
}

/// Checks that there is a curve to compare the points with.
fn check_use(read: &Read<raw::MeasurementFile>, raw: &Document, log: &mut Log<'_>) {
    if raw.load.is_none() {
        log.push(
            Diagnostic::at(&read.span, "[measurement] needs [load]")
                .label("there is no curve to compare the points with")
                .help("add for example `[load]` with `compression = { from = 0.0, to = 0.3, points = 7 }`"),
        );
    } else if raw.electrodes.is_none() && !has_entries(&raw.conductor) {
        log.push(
            Diagnostic::at(&read.span, "[measurement] needs [electrodes] or a [[conductor]]")
                .label("there is no capacitance to compare the points with")
                .help("add the electrodes, or leave [measurement] out"),
        );
    }
}

/// The columns and rows to read; `None` if they are invalid, with the reason in the log.
fn layout<'a>(
    columns: &'a raw::MeasuredColumns,
    span: &Range<usize>,
    rows: Option<&'a Read<raw::MeasuredRows>>,
    log: &mut Log<'_>,
) -> Option<Layout<'a>> {
    let loads = [
        (MeasuredLoad::Force, columns.force.as_ref(), Some(FORCE)),
        (MeasuredLoad::Displacement, columns.displacement.as_ref(), Some(LENGTH)),
        (MeasuredLoad::Compression, columns.compression.as_ref(), None),
    ];
    let given: Vec<_> = loads.iter().filter_map(|(kind, read, of)| Some((*kind, (*read)?, *of))).collect();
    let [(kind, load, of)] = given.as_slice() else {
        let found = if given.is_empty() { "none of them is here" } else { "more than one is here" };
        log.push(
            Diagnostic::at(
                span,
                "`columns` in [measurement] needs exactly one of `force`, `displacement` and `compression`",
            )
            .label(found)
            .help("write for example `force = { name = \"force_n\", unit = \"N\" }`"),
        );
        return None;
    };
    let load = column(load, *of, log);
    let capacitance = column(&columns.capacitance, Some(CAPACITANCE), log);
    let deviation = columns.deviation.as_ref().map(|read| column(read, Some(CAPACITANCE), log));
    let rows = match rows {
        None => None,
        Some(read) => {
            let table = read.get()?;
            let column = Column { name: &table.column.get()?.0, span: &table.column.span, factor: 1.0 };
            Some((column, table.equals.get()?.0.as_str()))
        }
    };
    let deviation = match deviation {
        Some(None) => return None,
        Some(found) => found,
        None => None,
    };
    Some(Layout { load: load?, kind: *kind, capacitance: capacitance?, deviation, rows })
}

/// A column with its unit, which must have the dimension; without a dimension the column has plain numbers or
/// percentages.
fn column<'a>(
    read: &'a Read<MeasuredColumn>,
    of: Option<Dimension>,
    log: &mut Log<'_>,
) -> Option<Column<'a>> {
    let table = read.get()?;
    let (name, span) = (table.name.get()?.0.as_str(), &table.name.span);
    let unit = match &table.unit {
        None => None,
        Some(unit) => Some((unit.get()?.0.trim(), &unit.span)),
    };
    let factor = match (of, unit) {
        (None, None) => Some(1.0),
        (None, Some((text, at))) => match text {
            "" | "1" => Some(1.0),
            "%" => Some(0.01),
            other => {
                log.push(
                    Diagnostic::at(at, format!("a compression has no unit, found \"{}\"", shown(other)))
                        .label("a unit")
                        .help("leave `unit` out, or write `unit = \"%\"`"),
                );
                None
            }
        },
        (Some(dimension), None) => {
            log.push(
                Diagnostic::at(&read.span, format!("the column `{}` needs a unit", shown(name)))
                    .label("a unit is missing here")
                    .help(format!("add for example `unit = \"{}\"`", usual_unit(dimension))),
            );
            None
        }
        (Some(dimension), Some((text, at))) => {
            let one_unit = format!("1 {text}");
            let known =
                units::parse(&one_unit).ok().filter(|unit| unit.dimension == dimension).map(|unit| unit.si);
            if known.is_none() {
                let near = units::nearest_unit(text, dimension).unwrap_or(usual_unit(dimension));
                log.push(
                    Diagnostic::at(at, format!("\"{}\" is not a unit of {}", shown(text), dimension.name()))
                        .label("not a unit that can be used here")
                        .help(format!("write for example `unit = \"{near}\"`")),
                );
            }
            known
        }
    };
    Some(Column { name, span, factor: factor? })
}

/// The unit that messages propose for a column.
fn usual_unit(dimension: Dimension) -> &'static str {
    if dimension == FORCE {
        "N"
    } else if dimension == LENGTH {
        "mm"
    } else {
        "pF"
    }
}

/// The reason why the text of a file of points cannot be read.
#[derive(Debug, thiserror::Error)]
enum NoText {
    #[error("its name does not end in .csv")]
    OtherEnding,
    #[error("it is not a text in UTF-8")]
    NotUtf8,
    #[error(transparent)]
    Unreadable(#[from] ReadError),
}

/// The text of a CSV file. Anything but a regular file with that ending is refused before it is opened: a
/// case from others must not reveal the content of other files.
fn text_of(path: &Path) -> Result<String, NoText> {
    let is_csv = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
    if !is_csv {
        return Err(NoText::OtherEnding);
    }
    String::from_utf8(elastocap_files::read(path, LARGEST_FILE)?).map_err(|_| NoText::NotUtf8)
}

/// The points in the text of a file. `constant` is the deviation of all points, if it is given, and `file`
/// the place of the file's name in the case.
fn points(
    text: &str,
    path: &Path,
    layout: &Layout<'_>,
    constant: Option<f64>,
    file: &Range<usize>,
) -> Result<Vec<MeasuredPoint>, Diagnostic> {
    let text = text.trim_start_matches('\u{feff}');
    let shown_file = shown_path(path);
    let at_line = |line: u64, what: String, help: &str| {
        Diagnostic::at(file, format!("{shown_file}:{line}: {what}")).label("in this file").help(help)
    };
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let broken = |error: &csv::Error| {
        let line = error.position().map_or(1, |at| line_of(text, at));
        at_line(
            line,
            "a line with another number of columns than the first".to_owned(),
            "give each line as many values as there are names of columns; a value with a comma in it stands in quotes",
        )
    };
    let names = reader.headers().map_err(|error| broken(&error))?.clone();
    let place = |column: &Column<'_>| {
        names.iter().position(|name| name == column.name).ok_or_else(|| match is_table(text) {
            true => no_column(column, &names, &shown_file),
            false => Diagnostic::at(file, format!("{shown_file} is no table of measured points"))
                .label("in none of its lines are numbers under the names of columns")
                .help("name a CSV file whose first line has the names of the columns, with numbers below"),
        })
    };
    let load_at = place(&layout.load)?;
    let capacitance_at = place(&layout.capacitance)?;
    let deviation_at = layout.deviation.as_ref().map(&place).transpose()?;
    let rows_at = layout.rows.as_ref().map(|(column, equals)| Ok((place(column)?, *equals))).transpose()?;
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| broken(&error))?;
        let line = record.position().map_or(0, |at| line_of(text, at));
        if rows_at.is_some_and(|(at, equals)| record.get(at) != Some(equals)) {
            continue;
        }
        let number = |at: usize, column: &Column<'_>| {
            let cell = record.get(at).unwrap_or("");
            let value =
                cell.parse::<f64>().ok().filter(|value| value.is_finite()).map(|value| value * column.factor);
            value.ok_or_else(|| {
                let what =
                    format!("\"{}\" in the column `{}` is not a number", shown(cell), shown(column.name));
                at_line(
                    line,
                    what,
                    "numbers have a decimal point and no unit; leave out the rows without a value",
                )
            })
        };
        let load = number(load_at, &layout.load)?;
        let capacitance = number(capacitance_at, &layout.capacitance)?;
        let deviation = match (deviation_at, &layout.deviation) {
            (Some(at), Some(column)) => Some(number(at, column)?),
            _ => constant,
        };
        if deviation.is_some_and(|deviation| deviation <= 0.0) {
            let what = "a deviation that is not greater than zero".to_owned();
            return Err(at_line(
                line,
                what,
                "give the standard deviation of the capacitance, or leave the column out",
            ));
        }
        if points.len() == MAX_POINTS {
            return Err(at_line(
                line,
                format!("more than {MAX_POINTS} points"),
                "take the mean of neighbouring points",
            ));
        }
        points.push(MeasuredPoint { line, load, capacitance, deviation });
    }
    if points.is_empty() {
        let what = match &layout.rows {
            Some((column, equals)) => {
                format!(
                    "{shown_file} has no row with \"{}\" in the column `{}`",
                    shown(equals),
                    shown(column.name)
                )
            }
            None => format!("{shown_file} has no row below the names of its columns"),
        };
        return Err(Diagnostic::at(file, what).label("no measured point").help("check the file and `rows`"));
    }
    Ok(points)
}

/// The line of a record that begins at or after a position: the reader gives the position before comments and
/// empty lines.
fn line_of(text: &str, at: &csv::Position) -> u64 {
    let start = usize::try_from(at.byte()).unwrap_or(usize::MAX);
    let rest = text.get(start..).unwrap_or("");
    let skipped = rest.split('\n').take_while(|line| line.trim().is_empty() || line.starts_with('#')).count();
    at.line() + skipped as u64
}

/// Whether one of the first lines of a file has a number under a name. If not, the file may be anything, and
/// messages show nothing of it.
fn is_table(text: &str) -> bool {
    // Not tuned: names of columns come before the numbers.
    const LOOKED_AT: usize = 20;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let is_name = |cell: &str| !cell.is_empty() && cell.parse::<f64>().is_err();
    let has_names = reader.headers().is_ok_and(|names| names.len() > 1 && names.iter().any(is_name));
    let has_number = |record: &csv::StringRecord| record.iter().any(|cell| cell.parse::<f64>().is_ok());
    has_names && reader.records().take(LOOKED_AT).flatten().any(|record| has_number(&record))
}

/// The message for a column that the file does not have.
fn no_column(column: &Column<'_>, names: &csv::StringRecord, file: &str) -> Diagnostic {
    let near = nearest(column.name, names.iter());
    let listed: Vec<String> = names.iter().take(MAX_NAMES).map(|name| format!("`{}`", shown(name))).collect();
    let more = if names.len() > MAX_NAMES { ", ..." } else { "" };
    let help = match near {
        Some(near) => format!("perhaps `{}`; its columns are {}{more}", shown(near), listed.join(", ")),
        None => format!("its columns are {}{more}", listed.join(", ")),
    };
    Diagnostic::at(column.span, format!("{file} has no column `{}`", shown(column.name)))
        .label("named here")
        .help(help)
}

//! The lines of an OBJ file that describe points and faces, and their faults.

use super::super::ImportProblem;
use super::super::polygon::PolygonFault;
use super::super::shown_word;

/// Keywords of lines that do not affect the shape.
const SKIPPED: [&[u8]; 22] = [
    b"vt",
    b"vn",
    b"vp",
    b"p",
    b"l",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"mtllib",
    b"usemtl",
    b"maplib",
    b"usemap",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"call",
    b"csh",
    b"deg",
];
/// Keywords of curves and surfaces that are not made of plain faces.
const FREE_FORM: [&[u8]; 10] =
    [b"cstype", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"end"];

/// A line with a point or a face: the text after its keyword, without a comment.
#[derive(Clone, Copy)]
pub(super) enum Statement<'a> {
    /// `v`: three coordinates, perhaps with a weight or a colour.
    Point(&'a [u8]),
    /// `f`: corners by the numbers of their points, perhaps with texture coordinates and normals.
    Face(&'a [u8]),
}

/// The reason why a line of an OBJ file is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum LineFault {
    #[error("unknown keyword {0}")]
    UnknownKeyword(String),
    #[error("a free-form curve or surface")]
    FreeForm,
    #[error("a point with {0} coordinates")]
    CoordinateCount(usize),
    #[error("{0} is not a finite number")]
    NotFinite(String),
    #[error("a point with the weight {0}")]
    Weight(f64),
    #[error("a face with {0} corners")]
    CornerCount(usize),
    #[error("a face with {corners} corners, more than {limit}; export triangles")]
    TooManyCorners { corners: usize, limit: usize },
    #[error("{0} is not a corner")]
    NotACorner(String),
    #[error("corner {corner} of {points} points above")]
    MissingPoint { corner: i64, points: usize },
    #[error("{0}")]
    Outline(#[from] PolygonFault),
    #[error("{0}")]
    Refused(tobj::LoadError),
}

impl LineFault {
    /// The fault with its place; lines are counted from 1.
    pub(super) fn at(self, line: usize) -> ImportProblem {
        match self {
            Self::FreeForm => ImportProblem::Unsupported {
                what: format!("{self} (line {line})"),
                cure: "export triangles".into(),
            },
            Self::UnknownKeyword(_)
            | Self::CoordinateCount(_)
            | Self::NotFinite(_)
            | Self::Weight(_)
            | Self::CornerCount(_)
            | Self::TooManyCorners { .. }
            | Self::NotACorner(_)
            | Self::MissingPoint { .. }
            | Self::Outline(_)
            | Self::Refused(_) => {
                ImportProblem::Malformed { place: format!("line {line}"), what: self.to_string() }
            }
        }
    }
}

/// The points and faces of a file in order, each with its line, counted from 1; an error for a line that is
/// neither and cannot be skipped.
pub(super) fn statements(
    bytes: &[u8],
) -> impl Iterator<Item = Result<(usize, Statement<'_>), ImportProblem>> + '_ {
    let mut has_points = false;
    bytes.split(|&b| b == b'\n').enumerate().filter_map(move |(above, line)| {
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let rest = &rest[..rest.iter().position(|&b| b == b'#').unwrap_or(rest.len())];
        let fault = match keyword {
            b"v" => {
                has_points = true;
                return Some(Ok((above + 1, Statement::Point(rest))));
            }
            b"f" => return Some(Ok((above + 1, Statement::Face(rest)))),
            [] | [b'#', ..] => return None,
            _ if SKIPPED.contains(&keyword) => return None,
            _ if FREE_FORM.contains(&keyword) => LineFault::FreeForm,
            _ if !has_points => return Some(Err(ImportProblem::NoObj { line: above + 1 })),
            _ => LineFault::UnknownKeyword(shown_word(keyword)),
        };
        Some(Err(fault.at(above + 1)))
    })
}

/// The words of a line.
pub(super) fn words(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    rest.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The first fault of a file, with its line, for the messages: errors of `tobj` do not name the line.
pub(super) fn first_fault(bytes: &[u8]) -> Option<ImportProblem> {
    let mut points = 0;
    for statement in statements(bytes) {
        let (line, fault) = match statement {
            Ok((line, Statement::Point(rest))) => {
                points += 1;
                (line, point_fault(rest))
            }
            Ok((line, Statement::Face(rest))) => (line, face_fault(rest, points)),
            Err(problem) => return Some(problem),
        };
        if let Some(fault) = fault {
            return Some(fault.at(line));
        }
    }
    None
}

/// The fault of a point, if it has one.
pub(super) fn point_fault(rest: &[u8]) -> Option<LineFault> {
    let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse().ok().filter(|x: &f64| x.is_finite());
    let not_finite = words(rest).take(4).find(|word| number(word).is_none());
    match words(rest).count() {
        _ if not_finite.is_some() => not_finite.map(|word| LineFault::NotFinite(shown_word(word))),
        count @ 0..=2 => Some(LineFault::CoordinateCount(count)),
        4 => words(rest).last().and_then(number).filter(|&w| w != 1.0).map(LineFault::Weight),
        _ => None,
    }
}

/// The fault of a face that has `points` points above it, if it has one.
fn face_fault(rest: &[u8], points: usize) -> Option<LineFault> {
    for word in words(rest) {
        let mut parts = word.split(|&b| b == b'/');
        let number = |part: &[u8]| std::str::from_utf8(part).ok()?.parse::<i64>().ok();
        let corner = parts.next().and_then(number);
        let others = parts.clone().count() <= 2 && parts.all(|p| p.is_empty() || number(p).is_some());
        let Some(corner) = corner.filter(|_| others) else {
            return Some(LineFault::NotACorner(shown_word(word)));
        };
        if corner == 0 || corner.unsigned_abs() > points as u64 {
            return Some(LineFault::MissingPoint { corner, points });
        }
    }
    let count = words(rest).count();
    (count < 3).then_some(LineFault::CornerCount(count))
}

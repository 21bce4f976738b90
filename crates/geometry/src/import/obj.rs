//! Surfaces of triangles from Wavefront OBJ files.
//!
//! Only corners (`v`) and faces (`f`) count; names, materials, normals and texture coordinates are skipped, free-form curves
//! and unknown lines are refused. Faces with more than three corners are cut into triangles.

use std::path::Path;

use super::audit::{Repairs, audit};
use super::polygon::triangulate;
use super::{ImportError, Problem};
use crate::shapes::TriangleSurface;

/// From the coordinates of a file to those of the scene: `unit` times them, then `translate` added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// m per unit of the file, positive.
    pub unit: f64,
    /// m.
    pub translate: [f64; 3],
}

impl Placement {
    /// Scales and moves points.
    ///
    /// # Errors
    /// [`Problem::Placement`] if the unit is not positive and finite, or the translation not finite.
    pub(super) fn apply(&self, file: &str, points: &mut [[f64; 3]]) -> Result<(), ImportError> {
        let Self { unit, translate } = *self;
        if !(unit > 0.0 && unit.is_finite() && translate.iter().all(|t| t.is_finite())) {
            return Err(ImportError::new(file, Problem::Placement { unit, translate }));
        }
        for p in points {
            for a in 0..3 {
                p[a] = p[a] * unit + translate[a];
            }
        }
        Ok(())
    }
}

/// What a file says, unaudited: indices are valid, coordinates finite, nothing else.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Triangles {
    /// In units of the file.
    pub points: Vec<[f64; 3]>,
    /// Indices into `points`.
    pub faces: Vec<[u32; 3]>,
    /// Line of the file per face, counted from 1.
    pub lines: Vec<u32>,
}

/// Reads a file, places and audits its surface.
///
/// # Errors
/// Whatever keeps the file from being one valid closed surface.
pub fn surface_from_path(
    path: &Path,
    placement: Placement,
) -> Result<(TriangleSurface, Repairs), ImportError> {
    let file = path.display().to_string();
    let bytes =
        std::fs::read(path).map_err(|e| ImportError::new(&file, Problem::Unreadable(e.to_string())))?;
    surface(&bytes, &file, placement)
}

/// Reads the bytes of an OBJ file, places and audits its surface; `file` is its name in messages.
///
/// # Errors
/// Whatever keeps the file from being one valid closed surface.
pub fn surface(
    bytes: &[u8],
    file: &str,
    placement: Placement,
) -> Result<(TriangleSurface, Repairs), ImportError> {
    let mut triangles = read(bytes, file)?;
    placement.apply(file, &mut triangles.points)?;
    audit(triangles, file, placement.unit)
}

/// Reads the bytes of an OBJ file; `file` is its name in messages. Takes less memory than ten times the bytes.
///
/// # Errors
/// Malformed lines, corners that do not exist, coordinates that are not finite, features beyond plain faces.
pub fn read(bytes: &[u8], file: &str) -> Result<Triangles, ImportError> {
    let fail = |problem| ImportError::new(file, problem);
    let mut out = reserved(bytes).ok_or_else(|| fail(Problem::TooLarge))?;
    let mut corners = Vec::new();
    for (number, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let number = number + 1;
        let malformed = |what: String| fail(Problem::Malformed { place: format!("line {number}"), what });
        let (keyword, rest) = split(line);
        match keyword {
            b"v" => out.points.push(corner(rest).map_err(malformed)?),
            b"f" => {
                corners.clear();
                for token in tokens(rest) {
                    corners.push(index(token, out.points.len()).map_err(malformed)?);
                }
                if corners.len() < 3 {
                    return Err(malformed(format!("a face with {} corners", corners.len())));
                }
                triangulate(&out.points, &mut corners, &mut out.faces).map_err(|e| malformed(e.into()))?;
                out.lines.resize(out.faces.len(), number as u32);
            }
            _ if keyword.is_empty() || keyword[0] == b'#' || IGNORED.contains(&keyword) => {}
            _ if FREE_FORM.contains(&keyword) => {
                return Err(fail(Problem::Unsupported {
                    what: format!("a free-form curve or surface (line {number})"),
                    cure: "export triangles".into(),
                }));
            }
            _ => return Err(malformed(format!("unknown keyword {}", shown(keyword)))),
        }
    }
    if out.faces.is_empty() {
        return Err(fail(Problem::Empty("faces")));
    }
    Ok(out)
}

const IGNORED: [&[u8]; 22] = [
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
const FREE_FORM: [&[u8]; 10] =
    [b"cstype", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"end"];

/// Room for exactly what the lines can hold, so that nothing grows by doubling.
fn reserved(bytes: &[u8]) -> Option<Triangles> {
    let (mut points, mut faces) = (0_usize, 0_usize);
    for line in bytes.split(|&b| b == b'\n') {
        let (keyword, rest) = split(line);
        match keyword {
            b"v" => points += 1,
            b"f" => faces += tokens(rest).count().saturating_sub(2),
            _ => {}
        }
    }
    let most = u32::MAX as usize;
    (points < most && faces < most && bytes.len() / 2 < most).then(|| Triangles {
        points: Vec::with_capacity(points),
        faces: Vec::with_capacity(faces),
        lines: Vec::with_capacity(faces),
    })
}

fn split(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line.split_at(end)
}

fn tokens(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = rest.iter().position(|&b| b == b'#').unwrap_or(rest.len());
    rest[..end].split(u8::is_ascii_whitespace).filter(|t| !t.is_empty())
}

/// A short, printable form of bytes that may be anything.
fn shown(token: &[u8]) -> String {
    format!("{:?}", String::from_utf8_lossy(&token[..token.len().min(30)]))
}

fn corner(rest: &[u8]) -> Result<[f64; 3], String> {
    let mut values = [0.0; 4];
    let mut count = 0;
    // Three numbers, or with a weight, or with colours.
    for token in tokens(rest) {
        let text = std::str::from_utf8(token).ok();
        let value = text.and_then(|t| t.parse::<f64>().ok()).filter(|v| v.is_finite());
        let value = value.ok_or_else(|| format!("{} is not a finite number", shown(token)))?;
        if count < 4 {
            values[count] = value;
        }
        count += 1;
    }
    match count {
        0..=2 => Err(format!("a point with {count} coordinates")),
        4 if values[3] != 1.0 => Err(format!("a point with the weight {}", values[3])),
        _ => Ok([values[0], values[1], values[2]]),
    }
}

/// The first part of `7/1/3`, counted from 1, or from the end if negative; only points above the line count.
fn index(token: &[u8], count: usize) -> Result<u32, String> {
    let first = token.split(|&b| b == b'/').next().unwrap_or_default();
    let text = std::str::from_utf8(first).ok();
    let value = text.and_then(|t| t.parse::<i64>().ok());
    let value = value.ok_or_else(|| format!("{} is not a corner", shown(token)))?;
    let at = if value > 0 { value - 1 } else { value.saturating_add(count as i64) };
    if value == 0 || at < 0 || at >= count as i64 {
        return Err(format!("corner {value} of {count} points above"));
    }
    Ok(at as u32)
}

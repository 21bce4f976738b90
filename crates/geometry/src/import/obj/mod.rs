//! Surfaces of triangles from Wavefront OBJ files.
//!
//! Only points (`v`) and faces (`f`) count. Names, materials, colours, normals, texture coordinates, lines
//! and single points are skipped; free-form curves and surfaces, weighted points and unknown keywords are
//! refused.
//!
//! `tobj` parses the numbers of points and faces (`parse.rs`). The rest is done around it: the selection of
//! the lines that it gets, and the number of the line in every message (`statements.rs`); the triangulation
//! of faces with more than three corners (`polygon.rs`), since that of `tobj` is wrong for concave ones; and
//! the audit of the surface ([`super::audit`]).

mod parse;
mod statements;

use std::path::Path;

use super::audit::{Repairs, audit};
use super::kinds::Wanted;
use super::{ImportError, ImportProblem, read_file};
use crate::shapes::TriangleSurface;

pub use super::triangles::Triangles;

/// The map from the coordinates of a file to those of the scene: multiply by `unit`, then add `translate`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Metres per unit of the file, positive.
    pub unit: f64,
    /// Translation along x1, x2, x3, m.
    pub translate: [f64; 3],
}

impl Placement {
    /// Scales and moves points in place: units of the file before, m after.
    ///
    /// # Errors
    /// [`ImportProblem::Placement`] if the unit is not positive and finite, or the translation not finite.
    pub(super) fn apply(&self, file: &str, points: &mut [[f64; 3]]) -> Result<(), ImportError> {
        let Self { unit, translate } = *self;
        if !(unit > 0.0 && unit.is_finite() && translate.iter().all(|t| t.is_finite())) {
            return Err(ImportError::new(file, ImportProblem::Placement { unit, translate }));
        }
        for p in points {
            for a in 0..3 {
                p[a] = p[a] * unit + translate[a];
            }
        }
        Ok(())
    }
}

/// Reads a file, then places and audits its surface.
///
/// # Errors
/// Anything that keeps the file from being one valid closed surface.
pub fn surface_from_path(
    path: &Path,
    placement: Placement,
) -> Result<(TriangleSurface, Repairs), ImportError> {
    let file = path.display().to_string();
    let bytes = read_file(path, Wanted::Obj).map_err(|problem| ImportError::new(&file, problem))?;
    surface(&bytes, &file, placement)
}

/// Reads the bytes of an OBJ file, then places and audits its surface; `file` names it in messages.
///
/// # Errors
/// Anything that keeps the file from being one valid closed surface.
pub fn surface(
    bytes: &[u8],
    file: &str,
    placement: Placement,
) -> Result<(TriangleSurface, Repairs), ImportError> {
    let mut triangles = read(bytes, file)?;
    placement.apply(file, &mut triangles.points)?;
    audit(triangles, file, placement.unit)
}

/// Reads the bytes of an OBJ file; `file` names it in messages. Takes at most half a
/// megabyte of memory more than ten times the size of the file.
///
/// # Errors
/// Malformed lines, corners that do not exist, coordinates that are not finite, features beyond plain faces,
/// no faces.
pub fn read(bytes: &[u8], file: &str) -> Result<Triangles, ImportError> {
    parse::triangles(bytes).map_err(|problem| ImportError::new(file, problem))
}

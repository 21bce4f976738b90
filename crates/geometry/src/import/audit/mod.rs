//! Checks that triangles form the closed surface of a body. Faults that can be repaired without changing the
//! shape are repaired, all others are refused.

mod topology;
mod weld;

use super::triangles::Triangles;
use super::{ImportError, ImportProblem, Place};
use crate::intersect;
use crate::shapes::TriangleSurface;
use crate::winding::contains;

/// Smallest and largest size of a body, m. Not tuned: limits that ordinary cases do not reach.
const SIZES: [f64; 2] = [1e-12, 1e6];
/// Largest distance of a body from the origin, in sizes of the body: double precision resolves 1e-16 of the
/// distance.
const MAX_DISTANCE: f64 = 1e9;

/// Repairs that leave the shape as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Points merged with an earlier one that lies within 1e-12 of the size of the body.
    pub welded_points: usize,
    /// Points that no face uses.
    pub unused_points: usize,
    /// Faces with two equal corners.
    pub dropped_faces: usize,
    /// Faces turned so that all run anticlockwise as seen from outside.
    pub turned_faces: usize,
}

/// Audits triangles with coordinates in m; messages name the `file` and the `unit`, m, by which they were
/// scaled.
///
/// The surface returned is closed, turned outward and free of self-intersections, without unused points and
/// faces.
///
/// # Errors
/// The first fault that cannot be repaired without guessing at the shape.
pub fn audit(triangles: Triangles, file: &str, unit: f64) -> Result<(TriangleSurface, Repairs), ImportError> {
    let fail = |problem| ImportError::new(file, problem);
    let Triangles { points, mut faces, mut lines } = triangles;
    if faces.is_empty() {
        return Err(fail(ImportProblem::Empty("faces")));
    }
    let size = check_size(faces.iter().flatten().map(|&p| points[p as usize]), unit).map_err(fail)?;
    let welded = weld::weld(&points, size);
    let mut repairs = Repairs::default();
    for face in &mut faces {
        *face = face.map(|p| welded[p as usize]);
    }
    let whole: Vec<bool> = faces.iter().map(|[a, b, c]| a != b && b != c && c != a).collect();
    let mut keep = whole.iter();
    faces.retain(|_| keep.next().copied().unwrap_or(false));
    let mut keep = whole.iter();
    lines.retain(|_| keep.next().copied().unwrap_or(false));
    repairs.dropped_faces = whole.len() - faces.len();
    let (points, dropped) = weld::used(&points, &mut faces);
    repairs.welded_points = welded.iter().enumerate().filter(|(k, p)| **p != *k as u32).count();
    repairs.unused_points = dropped - repairs.welded_points;
    if faces.is_empty() {
        return Err(fail(ImportProblem::Empty("faces with an area")));
    }
    let mut surface = TriangleSurface { points, faces };
    let place = |surface: &TriangleSurface, f: usize| Place {
        at: middle(surface.faces[f].map(|p| surface.points[p as usize])),
        line: lines.get(f).map(|&l| l as usize),
    };
    let flat = |f: &[u32; 3]| intersect::collinear(f.map(|p| surface.points[p as usize]));
    if let Some(f) = surface.faces.iter().position(flat) {
        return Err(fail(ImportProblem::DegenerateFace(place(&surface, f))));
    }
    let components = topology::components(&mut surface, &lines).map_err(fail)?;
    if let Some((f, g)) = intersect::within(&surface.points, &surface.faces) {
        return Err(fail(ImportProblem::SelfIntersection(place(&surface, f), place(&surface, g))));
    }
    repairs.turned_faces = topology::outward(&mut surface, &components, &lines).map_err(fail)?;
    Ok((surface, repairs))
}

/// Checks that named surfaces have no point in common and that none lies inside another.
///
/// All surfaces must have passed [`audit`].
///
/// # Errors
/// [`ImportProblem::Overlap`] or [`ImportProblem::Inside`], with the name of a surface in place of that of a
/// file.
pub fn apart(surfaces: &[(&str, &TriangleSurface)]) -> Result<(), ImportError> {
    let place = |s: &TriangleSurface, f: usize| Place {
        at: middle(s.faces[f].map(|p| s.points[p as usize])),
        line: None,
    };
    for (k, (name, surface)) in surfaces.iter().enumerate() {
        for (other, around) in &surfaces[..k] {
            let (left, right) =
                ((&surface.points[..], &surface.faces[..]), (&around.points[..], &around.faces[..]));
            if let Some((f, _)) = intersect::between(left, right) {
                let problem = ImportProblem::Overlap { other: (*other).to_owned(), place: place(surface, f) };
                return Err(ImportError::new(name, problem));
            }
            // Without a common point each closed part is inside or outside as a whole, and any part may be
            // inside.
            let inside = |inner: &TriangleSurface, outer: &TriangleSurface| {
                topology::representatives(inner).into_iter().find(|&p| contains(outer, p))
            };
            let inner = [(name, other, surface, around), (other, name, around, surface)]
                .into_iter()
                .find_map(|(name, other, s, o)| inside(s, o).map(|at| (name, other, at)));
            if let Some((name, other, at)) = inner {
                let problem =
                    ImportProblem::Inside { other: (*other).to_owned(), place: Place { at, line: None } };
                return Err(ImportError::new(name, problem));
            }
        }
    }
    Ok(())
}

/// The largest extent of points, m.
///
/// # Errors
/// A size out of bounds or too small for the distance from the origin; coordinates that are not finite count
/// as huge.
pub(super) fn check_size(points: impl Iterator<Item = [f64; 3]>, unit: f64) -> Result<f64, ImportProblem> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in points {
        for a in 0..3 {
            // Scaling may have made a coordinate infinite or NaN: then the check of the size below fails.
            let x = if p[a].is_finite() { p[a] } else { f64::MAX };
            low[a] = low[a].min(x);
            high[a] = high[a].max(x);
        }
    }
    let size = (0..3).fold(0.0, |s: f64, a| s.max(high[a] - low[a]));
    let distance = (0..3).fold(0.0, |s: f64, a| s.max(high[a].abs()).max(low[a].abs()));
    if !(SIZES[0]..=SIZES[1]).contains(&size) {
        return Err(ImportProblem::Size { size, unit });
    }
    if distance > MAX_DISTANCE * size {
        return Err(ImportProblem::FarAway { size, distance });
    }
    Ok(size)
}

/// The mean of some points.
pub(super) fn middle<const N: usize>(corners: [[f64; 3]; N]) -> [f64; 3] {
    [0, 1, 2].map(|a| corners.iter().map(|p| p[a]).sum::<f64>() / N as f64)
}

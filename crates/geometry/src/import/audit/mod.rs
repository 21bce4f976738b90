//! Is a heap of triangles the closed surface of a body? What cannot change the shape is repaired, the rest refused.

mod topology;
mod weld;

use super::obj::Triangles;
use super::{ImportError, Place, Problem, intersect};
use crate::shapes::TriangleSurface;
use crate::winding::contains;

/// Sizes in between are taken, m.
const SIZES: [f64; 2] = [1e-12, 1e6];
/// How many times its size a body may be from the origin: 10^-16 of that is what its points are known to.
const FARTHEST: f64 = 1e9;

/// What was repaired without changing the shape.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Points within 1e-12 of the size of an earlier one.
    pub welded_points: usize,
    /// Points that no face uses.
    pub unused_points: usize,
    /// Faces with two equal corners.
    pub dropped_faces: usize,
    /// Faces turned so that all are seen anticlockwise from outside.
    pub turned_faces: usize,
}

/// Audits triangles, coordinates in metres; `file` and the `unit` they were scaled by are for messages.
///
/// The surface comes back closed, turned outward, free of points and faces that do nothing, and free of self-intersections.
///
/// # Errors
/// The first finding that cannot be repaired without a guess at the shape.
pub fn audit(triangles: Triangles, file: &str, unit: f64) -> Result<(TriangleSurface, Repairs), ImportError> {
    let fail = |problem| ImportError::new(file, problem);
    let Triangles { points, mut faces, mut lines } = triangles;
    if faces.is_empty() {
        return Err(fail(Problem::Empty("faces")));
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
        return Err(fail(Problem::Empty("faces with an area")));
    }
    let mut surface = TriangleSurface { points, faces };
    let place = |surface: &TriangleSurface, f: usize| Place {
        at: middle(surface.faces[f].map(|p| surface.points[p as usize])),
        line: lines.get(f).map(|&l| l as usize),
    };
    let flat = |f: &[u32; 3]| intersect::collinear(f.map(|p| surface.points[p as usize]));
    if let Some(f) = surface.faces.iter().position(flat) {
        return Err(fail(Problem::DegenerateFace(place(&surface, f))));
    }
    let components = topology::components(&mut surface, &lines).map_err(fail)?;
    if let Some((f, g)) = intersect::within(&surface.points, &surface.faces) {
        return Err(fail(Problem::SelfIntersection(place(&surface, f), place(&surface, g))));
    }
    repairs.turned_faces = topology::outward(&mut surface, &components, &lines).map_err(fail)?;
    Ok((surface, repairs))
}

/// Checks that named surfaces have no point in common and that none lies inside another.
///
/// All must have passed [`audit`].
///
/// # Errors
/// [`Problem::Overlap`] or [`Problem::Inside`], with the name of the one in the place of the file.
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
                let problem = Problem::Overlap { other: (*other).to_owned(), place: place(surface, f) };
                return Err(ImportError::new(name, problem));
            }
            // Without a common point each part is inside or outside as a whole; any part may be the one inside.
            let inside = |inner: &TriangleSurface, outer: &TriangleSurface| {
                topology::representatives(inner).into_iter().find(|&p| contains(outer, p))
            };
            let found = [(name, other, surface, around), (other, name, around, surface)]
                .into_iter()
                .find_map(|(name, other, s, o)| inside(s, o).map(|at| (name, other, at)));
            if let Some((name, other, at)) = found {
                let problem = Problem::Inside { other: (*other).to_owned(), place: Place { at, line: None } };
                return Err(ImportError::new(name, problem));
            }
        }
    }
    Ok(())
}

/// The largest extent of finite points, m, if it and their distance make sense.
pub(super) fn check_size(points: impl Iterator<Item = [f64; 3]>, unit: f64) -> Result<f64, Problem> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in points {
        for a in 0..3 {
            // Not finite once scaled: left to the size below, which NaN and infinity fail.
            let x = if p[a].is_finite() { p[a] } else { f64::MAX };
            low[a] = low[a].min(x);
            high[a] = high[a].max(x);
        }
    }
    let size = (0..3).fold(0.0, |s: f64, a| s.max(high[a] - low[a]));
    let distance = (0..3).fold(0.0, |s: f64, a| s.max(high[a].abs()).max(low[a].abs()));
    if !(SIZES[0]..=SIZES[1]).contains(&size) {
        return Err(Problem::Size { size, unit });
    }
    if distance > FARTHEST * size {
        return Err(Problem::FarAway { size, distance });
    }
    Ok(size)
}

pub(super) fn middle<const N: usize>(corners: [[f64; 3]; N]) -> [f64; 3] {
    [0, 1, 2].map(|a| corners.iter().map(|p| p[a]).sum::<f64>() / N as f64)
}

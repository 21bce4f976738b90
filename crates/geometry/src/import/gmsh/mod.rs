//! Volume meshes from Gmsh: .msh files of the versions 2.2 and 4.1, ASCII and binary.
//!
//! Tetrahedra with four corners are read, and triangles that belong to physical groups; meshes with other
//! volume elements, or curved ones, are refused.
//!
//! No existing crate would do. The crate for this format, `mshio` 0.4.2 of 2020, reads version 4.1 only,
//! while many programs still write 2.2. It skips the names of physical groups, by which a case says what is a
//! conductor, and it does not check the numbers that it reads against one another. Here every message names a
//! line or a byte, and a count in a file never reserves more memory than its bytes can fill.

mod cursor;
mod roles;
mod sections;
mod shapes;

use std::path::Path;

use super::audit::{check_size, middle};
use super::kinds::Wanted;
use super::obj::Placement;
use super::{ImportError, ImportProblem, Place, read_file};
use crate::intersect;
use crate::meshing::tets::determinant;

/// A physical group of surfaces or volumes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// 2 for surfaces, 3 for volumes.
    pub dimension: u8,
    /// Its name in the file, or its number as text where the file has no name for it.
    pub name: String,
}

/// A conforming mesh of tetrahedra in named groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VolumeMesh {
    /// The file, for messages.
    pub file: String,
    /// Positions of the points, m. Every point belongs to a tetrahedron.
    pub points: Vec<[f64; 3]>,
    /// Corners of the tetrahedra, indices into `points`, with det(p1 - p0, p2 - p0, p3 - p0) > 0.
    pub tets: Vec<[u32; 4]>,
    /// The group of each tetrahedron: 0 for none, 1 + k for `groups[k]`.
    pub tet_groups: Vec<u32>,
    /// Triangles in physical groups of surfaces, each a face of a tetrahedron.
    pub faces: Vec<[u32; 3]>,
    /// The group of each of these triangles: 1 + k for `groups[k]`.
    pub face_groups: Vec<u32>,
    /// The physical groups of surfaces and volumes.
    pub groups: Vec<Group>,
}

/// Repairs that leave the shape of the mesh as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MeshRepairs {
    /// Tetrahedra whose corners were listed in the mirrored order.
    pub turned_tets: usize,
    /// Points that no tetrahedron uses.
    pub unused_points: usize,
}

/// Reads a file, then places and audits its mesh.
///
/// # Errors
/// Anything that keeps the file from being one conforming mesh.
pub fn mesh_from_path(path: &Path, placement: Placement) -> Result<(VolumeMesh, MeshRepairs), ImportError> {
    let file = path.display().to_string();
    let bytes = read_file(path, Wanted::Msh).map_err(|problem| ImportError::new(&file, problem))?;
    mesh(&bytes, &file, placement)
}

/// Reads the bytes of a .msh file, then places and audits its mesh; `file` names it in messages.
///
/// # Errors
/// Anything that keeps the file from being one conforming mesh.
pub fn mesh(
    bytes: &[u8],
    file: &str,
    placement: Placement,
) -> Result<(VolumeMesh, MeshRepairs), ImportError> {
    let raw = sections::read(&mut cursor::Cursor::new(bytes, file))?;
    let mut mesh = VolumeMesh {
        file: file.to_owned(),
        points: raw.points,
        tets: raw.tets,
        tet_groups: raw.tet_groups,
        faces: raw.faces,
        face_groups: raw.face_groups,
        groups: raw.groups,
    };
    placement.apply(file, &mut mesh.points)?;
    let repairs = audit(&mut mesh, placement.unit).map_err(|p| ImportError::new(file, p))?;
    Ok((mesh, repairs))
}

/// A face of a tetrahedron: its corners in ascending order, its number, which is 4 t + k for face k of
/// tetrahedron t, and whether the sorted corners run anticlockwise as seen from outside.
type Side = ([u32; 3], u32, bool);

/// Faces of the tetrahedra for which `keep` holds, sorted by their corners.
fn sides(mesh: &VolumeMesh, keep: impl Fn(usize) -> bool) -> Vec<Side> {
    let mut out = Vec::with_capacity(4 * (0..mesh.tets.len()).filter(|&t| keep(t)).count());
    for (t, [a, b, c, d]) in mesh.tets.iter().copied().enumerate().filter(|(t, _)| keep(*t)) {
        // The four faces, anticlockwise as seen from outside.
        for (k, mut face) in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]].into_iter().enumerate() {
            let mut even = true;
            for (i, j) in [(0, 1), (1, 2), (0, 1)] {
                if face[i] > face[j] {
                    face.swap(i, j);
                    even = !even;
                }
            }
            out.push((face, (4 * t + k) as u32, even));
        }
    }
    out.sort_unstable();
    out
}

/// The triangle of a side, anticlockwise as seen from outside.
fn outward(&([a, b, c], _, even): &Side) -> [u32; 3] {
    if even { [a, b, c] } else { [a, c, b] }
}

/// Checks that a mesh is conforming, and carries out the repairs that need no guessing.
fn audit(mesh: &mut VolumeMesh, unit: f64) -> Result<MeshRepairs, ImportProblem> {
    if mesh.tets.len() >= (u32::MAX / 4) as usize {
        return Err(ImportProblem::TooLarge);
    }
    let used = mesh.tets.iter().flatten().map(|&p| mesh.points[p as usize]);
    check_size(used, unit)?;
    let mut repairs = MeshRepairs { unused_points: drop_unused(mesh)?, ..MeshRepairs::default() };
    for tet in &mut mesh.tets {
        let corners = tet.map(|p| mesh.points[p as usize]);
        let [a, b, c, d] = corners;
        let six_volumes = determinant(a, b, c, d);
        let longest = [b, c, d].iter().flat_map(|p| (0..3).map(|k| (p[k] - a[k]).abs())).fold(0.0, f64::max);
        // A smaller determinant may have the wrong sign from rounding alone.
        if six_volumes.abs() <= 1e-14 * longest.powi(3) {
            return Err(ImportProblem::FlatTet(Place { at: middle(corners), line: None }));
        }
        if six_volumes < 0.0 {
            tet.swap(2, 3);
            repairs.turned_tets += 1;
        }
    }
    let place = |face: [u32; 3]| Place { at: middle(face.map(|p| mesh.points[p as usize])), line: None };
    let sides = sides(mesh, |_| true);
    let mut outer = Vec::new();
    for group in sides.chunk_by(|a, b| a.0 == b.0) {
        match group {
            [one] => outer.push(outward(one)),
            [one, two] if one.2 != two.2 => {}
            _ => return Err(ImportProblem::SharedFace { count: group.len(), place: place(group[0].0) }),
        }
    }
    for (face, &group) in mesh.faces.iter().zip(&mesh.face_groups) {
        let mut sorted = *face;
        sorted.sort_unstable();
        if sides.binary_search_by_key(&sorted, |s| s.0).is_err() {
            let name = mesh.groups[group as usize - 1].name.clone();
            return Err(ImportProblem::LooseFace { name, place: place(*face) });
        }
    }
    drop(sides);
    if let Some(flat) = outer.iter().find(|f| intersect::collinear(f.map(|p| mesh.points[p as usize]))) {
        return Err(ImportProblem::FlatTet(place(*flat)));
    }
    // Where the mesh does not conform, faces inside it belong to one tetrahedron alone, as outer ones do, and
    // meet others.
    if let Some((f, g)) = intersect::within(&mesh.points, &outer) {
        return Err(ImportProblem::NonConforming(place(outer[f]), place(outer[g])));
    }
    Ok(repairs)
}

/// Drops the points that no tetrahedron uses, and returns how many they are.
fn drop_unused(mesh: &mut VolumeMesh) -> Result<usize, ImportProblem> {
    let mut number = vec![u32::MAX; mesh.points.len()];
    for &p in mesh.tets.iter().flatten() {
        number[p as usize] = 0;
    }
    if let Some((face, group)) =
        mesh.faces.iter().zip(&mesh.face_groups).find(|(f, _)| f.iter().any(|&p| number[p as usize] != 0))
    {
        let name = mesh.groups[*group as usize - 1].name.clone();
        let at = middle(face.map(|p| mesh.points[p as usize]));
        return Err(ImportProblem::LooseFace { name, place: Place { at, line: None } });
    }
    let mut next = 0;
    for n in number.iter_mut().filter(|n| **n == 0) {
        *n = next;
        next += 1;
    }
    let dropped = mesh.points.len() - next as usize;
    let mut keep = number.iter().map(|&n| n != u32::MAX);
    mesh.points.retain(|_| keep.next().unwrap_or(false));
    for tet in &mut mesh.tets {
        *tet = tet.map(|p| number[p as usize]);
    }
    for face in &mut mesh.faces {
        *face = face.map(|p| number[p as usize]);
    }
    Ok(dropped)
}

//! Graded bisection: the places where edges are cut, so that tetrahedra become thin towards the edges of
//! conductors and stay long along them.
//!
//! In a sector of angle w between conductors the potential grows as r^a, a = pi / w, with the distance r from
//! the edge, and is smooth along it. A mesh edge with one end on such an edge is cut closer to this end, at a
//! share k of its length: after n cuts the tetrahedra are k^n wide and 2^-n long, which resolves the
//! singularity with fewer of them (Li, SIAM J. Numer. Anal. 56, 2018). The shares are k = 2^-b with b = (1 +
//! 1/a) / 2, found by measurement: for potentials alone b = 1/a or more would be better, but the flux in
//! tetrahedra that are long and slanted loses more than the potential gains.
//!
//! All new points lie on edges of the mesh before, so that no surface moves and no tetrahedron is turned
//! inside out. The order in which edges are bisected follows from the lengths that they would have if all
//! were halved.

use super::{FaceRole, TetMesh};
use elastocap_linalg::vector::{cross, dot, length, minus};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

/// Cuts are graded towards edges at which the potential grows with a lower power of the distance than this.
/// Tuned: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const SINGULAR: f64 = 0.9;

/// Largest value of the exponent b (see the head of this file). Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const MAX_EXPONENT: f64 = 1.5;

/// No grading towards an edge that is this many times longer than the tetrahedra at it are wide: these are
/// graded already. Tuned: `cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3`.
const LONG: f64 = 3.0;

/// The grading of a mesh towards the edges of conductors. It belongs to one mesh, and bisection updates it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grading {
    /// The positions of the points if all edges were halved, m.
    pub(super) places: Vec<[f64; 3]>,
    /// Mesh edges on edges of conductors, by ascending ends, with the share at which edges that end there are
    /// cut.
    edges: HashMap<[u32; 2], f64>,
    /// The share for each point; one half for points that are not ends of `edges`.
    shares: Vec<f64>,
}

impl Grading {
    /// No grading: all edges are halved.
    pub fn none(mesh: &TetMesh) -> Self {
        Self { places: mesh.points.clone(), edges: HashMap::new(), shares: vec![0.5; mesh.points.len()] }
    }

    /// Grading towards the edges of conductors and grounded walls at which the field is singular.
    pub fn towards_edges(mesh: &TetMesh) -> Self {
        let mut grading = Self::none(mesh);
        for (edge, power) in powers(mesh) {
            if power < SINGULAR {
                let share = 0.5_f64.powf((0.5 + 0.5 / power).min(MAX_EXPONENT));
                grading.edges.insert(edge, share);
                for p in edge {
                    let point_share = &mut grading.shares[p as usize];
                    *point_share = point_share.min(share);
                }
            }
        }
        grading
    }

    /// The share of its length, from the first end on, at which an edge is cut. Registers the new point.
    pub(super) fn cut(&mut self, [a, b]: [u32; 2]) -> f64 {
        let [p, q] = [a, b].map(|p| self.places[p as usize]);
        let new = self.places.len() as u32;
        self.places.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
        if let Some(share) = self.edges.remove(&[a.min(b), a.max(b)]) {
            self.edges.insert([a, new], share);
            self.edges.insert([b, new], share);
            self.shares.push(share);
            return 0.5;
        }
        self.shares.push(0.5);
        match [a, b].map(|p| self.shares[p as usize]) {
            [near, 0.5] => near,
            [0.5, near] => 1.0 - near,
            _ => 0.5,
        }
    }
}

/// For each mesh edge on a conductor or a grounded wall, the power of the distance with which the potential
/// grows if the permittivity is the same all around; infinite for an edge that calls for no grading.
fn powers(mesh: &TetMesh) -> Vec<([u32; 2], f64)> {
    // For each edge, the third corners of the faces at a fixed potential that meet in it.
    let mut held: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for face in mesh.boundary.iter().filter(|f| !matches!(f.role, FaceRole::Open { .. })) {
        let [a, b, c] = face.face;
        for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
            held.entry([p.min(q), p.max(q)]).or_default().push(r);
        }
    }
    // For each of these edges, the two other corners of each tetrahedron around it.
    let mut around: BTreeMap<[u32; 2], Vec<[u32; 2]>> = BTreeMap::new();
    for &[a, b, c, d] in &mesh.tets {
        for [p, q, r, s] in
            [[a, b, c, d], [a, c, b, d], [a, d, b, c], [b, c, a, d], [b, d, a, c], [c, d, a, b]]
        {
            let edge = [p.min(q), p.max(q)];
            if held.contains_key(&edge) {
                around.entry(edge).or_default().push([r, s]);
            }
        }
    }
    let power = |(edge, tets): ([u32; 2], Vec<[u32; 2]>)| {
        let ends = &held[&edge];
        let width =
            tets.iter().flatten().map(|&p| distance(mesh, edge, p)).sum::<f64>() / (2 * tets.len()) as f64;
        let [p, q] = edge.map(|p| mesh.points[p as usize]);
        if length(minus(q, p)) > LONG * width {
            return (edge, f64::INFINITY);
        }
        let sectors = sectors(tets, ends);
        let least = sectors.iter().map(|sector| {
            let angle: f64 = sector.iter().map(|&sides| angle(mesh, edge, sides)).sum();
            match sector.iter().flatten().filter(|p| ends.contains(p)).count() {
                0 => f64::INFINITY,
                1 => 0.5 * PI / angle,
                _ => PI / angle,
            }
        });
        (edge, least.fold(f64::INFINITY, f64::min))
    };
    around.into_iter().map(power).collect()
}

/// The distance of a point from the line through an edge, m.
fn distance(mesh: &TetMesh, edge: [u32; 2], point: u32) -> f64 {
    let [p, q] = edge.map(|p| mesh.points[p as usize]);
    let (along, out) = (minus(q, p), minus(mesh.points[point as usize], p));
    length(cross(along, out)) / length(along)
}

/// The tetrahedra around an edge, each given by its two other corners, in groups. Between the groups lie the
/// faces whose third corner is one of `ends`.
fn sectors(mut tets: Vec<[u32; 2]>, ends: &[u32]) -> Vec<Vec<[u32; 2]>> {
    let mut sectors = Vec::new();
    while let Some(first) = tets.pop() {
        let mut sector = vec![first];
        let mut next = 0;
        while next < sector.len() {
            for side in sector[next].into_iter().filter(|p| !ends.contains(p)) {
                while let Some(k) = tets.iter().position(|t| t.contains(&side)) {
                    sector.push(tets.swap_remove(k));
                }
            }
            next += 1;
        }
        sectors.push(sector);
    }
    sectors
}

/// The angle of a tetrahedron at an edge, from its two other corners, rad.
fn angle(mesh: &TetMesh, edge: [u32; 2], sides: [u32; 2]) -> f64 {
    let point = |p: u32| mesh.points[p as usize];
    let along = minus(point(edge[1]), point(edge[0]));
    let [n, m] = sides.map(|p| cross(along, minus(point(p), point(edge[0]))));
    length(cross(n, m)).atan2(dot(n, m))
}

#[cfg(test)]
mod tests {
    use super::super::of_boxes;
    use super::*;
    use crate::scene::{Body, Box3, Scene, Wall};
    use crate::shapes::Shape;

    /// A plate and a sheet in a box with insulated walls, one above the other; the plate reaches one wall.
    fn mesh() -> TetMesh {
        let conductor = |name: &str, min, max| Body::conductor(name, Shape::Box(Box3 { min, max }));
        let scene = Scene {
            bodies: vec![
                conductor("plate", [-2.0, 0.0, -1.0], [1.0, 1.0, 1.0]),
                conductor("sheet", [-1.0, -1.0, -1.0], [1.0, -1.0, 1.0]),
            ],
            background_permittivity: 1.0,
            domain: Box3 { min: [-2.0; 3], max: [2.0; 3] },
            walls: [[Wall::Insulated; 2]; 3],
        };
        let line: Vec<f64> = (0..=8).map(|i| -2.0 + 0.5 * f64::from(i)).collect();
        of_boxes(&scene, &[line.clone(), line.clone(), line])
    }

    #[test]
    fn the_power_is_two_thirds_at_edges_of_bodies_one_half_at_rims_of_sheets_and_one_on_flat_faces() {
        let mesh = mesh();
        let mut found = [0; 3];
        for (edge, power) in powers(&mesh) {
            let [p, q] = edge.map(|p| mesh.points[p as usize]);
            let along = (0..3).filter(|&k| p[k] != q[k]).count() == 1;
            let at_one_of = |k: usize, at: &[f64]| p[k] == q[k] && at.contains(&p[k]);
            let of_plate = along
                && p[1].min(q[1]) >= 0.0
                && (at_one_of(1, &[0.0, 1.0]) && (at_one_of(2, &[-1.0, 1.0]) || at_one_of(0, &[1.0]))
                    || at_one_of(0, &[1.0]) && at_one_of(2, &[-1.0, 1.0]));
            let of_sheet =
                along && at_one_of(1, &[-1.0]) && (at_one_of(0, &[-1.0, 1.0]) || at_one_of(2, &[-1.0, 1.0]));
            let (kind, expected) = match (of_plate, of_sheet) {
                (true, _) => (0, 2.0 / 3.0),
                (_, true) => (1, 0.5),
                // Flat between two faces, or at a right angle to the wall.
                _ => (2, 1.0),
            };
            found[kind] += 1;
            assert!((power - expected).abs() < 1e-12, "{p:?} {q:?}: {power}");
        }
        // Four edges along x of six halves, four along z and two along y ...
        assert_eq!(found[..2], [4 * 6 + 2 * 4 + 2 * 2, 4 * 4]);
    }

    #[test]
    fn cuts_are_graded_towards_a_rim_and_the_rim_itself_is_halved() {
        let mut mesh = mesh();
        let mut grading = Grading::towards_edges(&mesh);
        for _ in 0..4 {
            let at_rim = |tet: &[u32; 4]| {
                tet.iter().any(|&p| {
                    (mesh.points[p as usize][0] - 1.0).abs() < 1e-9
                        && mesh.points[p as usize][1] == -1.0
                        && mesh.points[p as usize][2].abs() < 1e-9
                })
            };
            let wanted: Vec<u8> = mesh.tets.iter().map(|tet| if at_rim(tet) { 3 } else { 0 }).collect();
            mesh = mesh.bisected_towards(&wanted, &mut grading).mesh;
        }
        let near = mesh.points.iter().filter(|p| p[2].abs() < 0.2);
        let across = near.map(|p| (p[0] - 1.0).hypot(p[1] + 1.0)).filter(|d| *d > 0.0);
        let across = across.fold(f64::INFINITY, f64::min);
        let on_rim = mesh.points.iter().filter(|p| p[0] == 1.0 && p[1] == -1.0 && p[2] > 0.0);
        let along = on_rim.map(|p| p[2]).fold(f64::INFINITY, f64::min);
        assert_eq!(along, 0.5_f64.powi(5));
        // Half of the first edge there, cut four times.
        assert!(across < 0.5 * 0.354_f64.powi(4), "{across}");
        assert_eq!(grading.places.len(), mesh.points.len());
    }
}

//! Local refinement of a mesh of tetrahedra by bisection of longest edges.
//!
//! An edge is bisected only once it is the longest one of every tetrahedron around it; otherwise the longer
//! edge is bisected first (longest-edge propagation path: Rivara, Int. J. Numer. Methods Eng. 40, 1997). The
//! mesh conforms after every bisection, and a face is only ever bisected at its longest edge, so that the
//! tetrahedra on both sides agree.

use super::tetrahedron::EDGES;
use super::{BoundaryFace, Grading, TetMesh};
use crate::meshing::indices::OptionalIndex;

/// A refined mesh with the origin of its points and tetrahedra.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bisected {
    /// The refined mesh; the points of the old one come first, unchanged.
    pub mesh: TetMesh,
    /// For each new point, in order, the two points between which it lies: old ones, or new ones that precede
    /// it.
    pub parents: Vec<[u32; 2]>,
    /// For each tetrahedron, the old one of which it is a part.
    pub origin: Vec<u32>,
}

impl TetMesh {
    /// Bisects each of the tetrahedra `marked` (by index; invalid ones are ignored) `generations` times, so
    /// that none of their parts is larger than 2^-`generations` of the whole.
    ///
    /// See [`TetMesh::bisected_towards`].
    pub fn bisected(&self, marked: &[u32], generations: u8) -> Bisected {
        let mut of_tets = vec![0; self.tets.len()];
        for &t in marked {
            of_tets.get_mut(t as usize).into_iter().for_each(|count| *count = generations);
        }
        self.bisected_towards(&of_tets, &mut Grading::none(self))
    }

    /// Bisects each tetrahedron as many times as `generations` has for it, so that none of its parts is
    /// larger than 2^-`generations` of the whole; not at all where the list has no entry for it. Tetrahedra
    /// around them are bisected as far as conformity requires. Edges are cut where `grading` places the cut,
    /// so that parts may be of unequal size.
    ///
    /// `grading` must belong to this mesh, else it is replaced by [`Grading::none`]; it becomes that of the
    /// refined mesh. Regions and roles of faces are inherited. The result depends on nothing but the
    /// arguments.
    pub fn bisected_towards(&self, generations: &[u8], grading: &mut Grading) -> Bisected {
        if grading.places.len() != self.points.len() {
            *grading = Grading::none(self);
        }
        let mut refinement = Refinement::of(self, grading);
        refinement.refine(generations);
        refinement.finish(self)
    }
}

/// The order of edges by length. Of edges of the same length, the older one ranks higher, so that no two
/// edges have the same rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    /// The bits of the square of the length, rounded.
    length: u64,
    /// The ends, the newer one first.
    age: [std::cmp::Reverse<u32>; 2],
}

/// A mesh that is being refined.
struct Refinement<'a> {
    /// Positions of all points, m.
    points: Vec<[f64; 3]>,
    /// Where edges are cut.
    grading: &'a mut Grading,
    /// Corners of all tetrahedra.
    tets: Vec<[u32; 4]>,
    /// Which of [`EDGES`] is the longest of each tetrahedron.
    longest: Vec<u8>,
    /// As [`Bisected::origin`].
    origin: Vec<u32>,
    /// The number of bisections that have led to each tetrahedron.
    depth: Vec<u8>,
    /// As [`Bisected::parents`].
    parents: Vec<[u32; 2]>,
    /// For each point, the first entry of the list of tetrahedra at it. Lists may also hold some that have
    /// lost the point since.
    first: Vec<OptionalIndex>,
    /// The entries of all lists.
    entries: Vec<Entry>,
    /// Edges on the propagation path to one that can be bisected; empty in between.
    path: Vec<[u32; 2]>,
    /// The tetrahedra around the edge at hand.
    star: Vec<u32>,
    /// The number of list entries examined, which determines the time.
    #[cfg(test)]
    looked_at: usize,
}

/// An entry of a list of tetrahedra.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// The tetrahedron.
    tet: u32,
    /// The next entry of the same list.
    next: OptionalIndex,
}

impl<'a> Refinement<'a> {
    /// A mesh that has not been refined yet.
    fn of(mesh: &TetMesh, grading: &'a mut Grading) -> Self {
        let count = mesh.tets.len();
        let mut refinement = Self {
            points: mesh.points.clone(),
            grading,
            tets: mesh.tets.clone(),
            longest: Vec::with_capacity(count),
            origin: (0..count as u32).collect(),
            depth: vec![0; count],
            parents: Vec::new(),
            first: vec![OptionalIndex::NONE; mesh.points.len()],
            entries: Vec::with_capacity(4 * count),
            path: Vec::new(),
            star: Vec::new(),
            #[cfg(test)]
            looked_at: 0,
        };
        for t in 0..count {
            refinement.longest.push(longest(&refinement.grading.places, refinement.tets[t]));
            for p in refinement.tets[t] {
                refinement.enter(p, t as u32);
            }
        }
        refinement
    }

    /// Adds a tetrahedron to the list of a point.
    fn enter(&mut self, point: u32, tet: u32) {
        let entry = self.entries.len() as u32;
        self.entries.push(Entry { tet, next: self.first[point as usize] });
        self.first[point as usize] = OptionalIndex::some(entry);
    }

    /// Bisects tetrahedra as many times as `generations` says for the old tetrahedron that each is a part of.
    fn refine(&mut self, generations: &[u8]) {
        for generation in 1..=generations.iter().copied().max().unwrap_or(0) {
            let mut t = 0;
            while t < self.tets.len() {
                let wanted = generations.get(self.origin[t] as usize).is_some_and(|g| *g >= generation);
                while wanted && self.depth[t] < generation {
                    self.cut(self.longest_of(t));
                }
                t += 1;
            }
        }
    }

    /// The longest edge of a tetrahedron.
    fn longest_of(&self, t: usize) -> [u32; 2] {
        EDGES[self.longest[t] as usize].map(|k| self.tets[t][k])
    }

    /// Bisects an edge, and before it all longer edges on its propagation path.
    fn cut(&mut self, edge: [u32; 2]) {
        self.path.push(edge);
        while let Some(&edge) = self.path.last() {
            self.gather(edge);
            let rank = rank(&self.grading.places, edge);
            let longer = self.star.iter().map(|&t| self.longest_of(t as usize)).find(|&e| {
                let other = self::rank(&self.grading.places, e);
                other > rank
            });
            if let Some(longer) = longer {
                self.path.push(longer);
            } else {
                self.halve(edge);
                self.path.pop();
            }
        }
    }

    /// Fills `star` with the tetrahedra around an edge.
    fn gather(&mut self, [a, b]: [u32; 2]) {
        self.star.clear();
        // The newer point has the shorter list.
        let (newer, older) = (a.max(b), a.min(b));
        let mut entry = self.first[newer as usize];
        while let Some(k) = entry.get() {
            let Entry { tet: t, next } = self.entries[k as usize];
            #[cfg(test)]
            {
                self.looked_at += 1;
            }
            let tet = &self.tets[t as usize];
            if tet.contains(&older) && tet.contains(&newer) {
                self.star.push(t);
            }
            entry = next;
        }
    }

    /// Bisects the tetrahedra of `star`, which are those around the edge.
    fn halve(&mut self, [a, b]: [u32; 2]) {
        let middle = self.points.len() as u32;
        let share = self.grading.cut([a, b]);
        let [p, q] = [a, b].map(|p| self.points[p as usize]);
        // Where the ends agree in a coordinate, the new point has exactly the same.
        let between = |p: f64, q: f64| if share == 0.5 { 0.5 * (p + q) } else { p + share * (q - p) };
        self.points.push([0, 1, 2].map(|k| between(p[k], q[k])));
        self.parents.push([a, b]);
        self.first.push(OptionalIndex::NONE);
        let star = std::mem::take(&mut self.star);
        for &t in &star {
            let slot = t as usize;
            let half = self.tets.len() as u32;
            let whole = self.tets[slot];
            let low = whole.map(|p| if p == b { middle } else { p });
            let high = whole.map(|p| if p == a { middle } else { p });
            self.tets[slot] = low;
            self.tets.push(high);
            self.longest[slot] = longest(&self.grading.places, low);
            self.longest.push(longest(&self.grading.places, high));
            self.depth[slot] = self.depth[slot].saturating_add(1);
            self.depth.push(self.depth[slot]);
            self.origin.push(self.origin[slot]);
            self.enter(middle, t);
            for p in high {
                self.enter(p, half);
            }
        }
        self.star = star;
    }

    /// The refined mesh, given the old one.
    fn finish(self, old: &TetMesh) -> Bisected {
        let boundary = self.boundary(&old.boundary, old.points.len());
        let regions = self.origin.iter().map(|&t| old.regions[t as usize]).collect();
        let mesh = TetMesh { points: self.points, tets: self.tets, regions, boundary, center: old.center };
        Bisected { mesh, parents: self.parents, origin: self.origin }
    }

    /// The boundary faces, divided as the tetrahedra at them. The first `old_points` points are those of the
    /// old mesh.
    fn boundary(&self, old: &[BoundaryFace], old_points: usize) -> Vec<BoundaryFace> {
        // New points in lists by the older end of the edge that they lie on.
        let mut first = vec![OptionalIndex::NONE; self.points.len()];
        let mut next = Vec::with_capacity(self.parents.len());
        for (k, &[a, b]) in (0..).zip(&self.parents) {
            let older = a.min(b) as usize;
            next.push(first[older]);
            first[older] = OptionalIndex::some(k);
        }
        let middle = |a: u32, b: u32| {
            let mut entry = first[a.min(b) as usize];
            while let Some(k) = entry.get() {
                let [c, d] = self.parents[k as usize];
                if c.max(d) == a.max(b) {
                    return Some(old_points as u32 + k);
                }
                entry = next[k as usize];
            }
            None
        };
        let mut boundary = Vec::with_capacity(old.len());
        let mut open = Vec::new();
        for &BoundaryFace { face, role } in old {
            open.push(face);
            while let Some(face) = open.pop() {
                let [a, b, c] = face;
                let turns = [[a, b, c], [b, c, a], [c, a, b]];
                let [a, b, c] = turns
                    .into_iter()
                    .max_by_key(|t| rank(&self.grading.places, [t[0], t[1]]))
                    .unwrap_or(face);
                if let Some(m) = middle(a, b) {
                    open.push([m, b, c]);
                    open.push([a, m, c]);
                } else {
                    boundary.push(BoundaryFace { face, role });
                }
            }
        }
        boundary
    }
}

/// The rank of an edge.
fn rank(points: &[[f64; 3]], [a, b]: [u32; 2]) -> Rank {
    let (p, q) = (points[a as usize], points[b as usize]);
    let length = (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>();
    // The bits of positive numbers are ordered as the numbers are. The last ones are dropped, so that edges
    // whose lengths differ by rounding only are bisected in the order of their age everywhere.
    let length = (length.to_bits() + (1 << 23)) >> 24;
    Rank { length, age: [a.max(b), a.min(b)].map(std::cmp::Reverse) }
}

/// Which of [`EDGES`] of a tetrahedron is the longest.
fn longest(points: &[[f64; 3]], tet: [u32; 4]) -> u8 {
    let rank = |e: usize| rank(points, EDGES[e].map(|k| tet[k]));
    (1..6).fold((0, rank(0)), |best, e| if rank(e) > best.1 { (e as u8, rank(e)) } else { best }).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meshing::tets::{of_boxes, tests::mesh_checks};
    use crate::scene::{Body, Box3, Scene, Wall};
    use crate::shapes::Shape;

    /// A plate over a grounded floor in a box, with a sheet beside it: `n` cells per unit.
    fn plate(n: usize, height: f64) -> TetMesh {
        let sides = |min, max| Box3 { min, max };
        let scene = Scene {
            bodies: vec![
                Body::conductor("plate", Shape::Box(sides([-1.0, 0.0, -1.0], [0.0, height, 1.0]))),
                Body::conductor("sheet", Shape::Box(sides([1.0, 0.0, -1.0], [2.0, 0.0, 1.0]))),
            ],
            background_permittivity: 1.0,
            domain: sides([-3.0, -2.0 * height, -3.0], [3.0, 2.0 * height, 3.0]),
            walls: [[Wall::Insulated; 2], [Wall::Grounded; 2], [Wall::Insulated; 2]],
        };
        let line = |low: f64, cells: usize, step: f64| {
            (0..=cells).map(|i| low + step * i as f64).collect::<Vec<_>>()
        };
        let across = line(-3.0, 6 * n, 1.0 / n as f64);
        of_boxes(&scene, &[across.clone(), line(-2.0 * height, 4 * n, height / n as f64), across])
    }

    fn next(state: &mut u64) -> u64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        *state >> 33
    }

    #[test]
    fn any_marks_give_a_conforming_mesh_of_the_same_volume_and_faces() {
        let mut state = 7;
        for (height, generations) in [(1.0, 1), (1.0, 3), (0.03, 2), (0.03, 3), (20.0, 3)] {
            for graded in [false, true] {
                let mut mesh = plate(1, height);
                let mut grading = if graded { Grading::towards_edges(&mesh) } else { Grading::none(&mesh) };
                let (volume, areas) = (mesh_checks::volume(&mesh), mesh_checks::areas(&mesh));
                mesh_checks::conforming(&mesh);
                for _ in 0..2 {
                    let count = mesh.tets.len() as u64;
                    let mut wanted = vec![0; mesh.tets.len()];
                    for k in 0..count / 10 + 1 {
                        // That many times, or once less.
                        wanted[(next(&mut state) % count) as usize] = generations - (k % 2) as u8;
                    }
                    let fine = mesh.bisected_towards(&wanted, &mut grading);
                    mesh_checks::conforming(&fine.mesh);
                    let change = mesh_checks::volume(&fine.mesh) / volume - 1.0;
                    assert!(change.abs() < 1e-11, "{change:e}");
                    for ((role, old), (other, new)) in areas.iter().zip(mesh_checks::areas(&fine.mesh)) {
                        assert_eq!(*role, other);
                        assert!((old - new).abs() < 1e-12 * old);
                    }
                    let mut parts = vec![0.0; mesh.tets.len()];
                    for (t, &origin) in fine.origin.iter().enumerate() {
                        let (part, whole) = (fine.mesh.determinant(t), mesh.determinant(origin as usize));
                        parts[origin as usize] += part / whole;
                        assert_eq!(fine.mesh.regions[t], mesh.regions[origin as usize]);
                        if !graded {
                            let wanted = wanted[origin as usize];
                            assert!(part < whole * 0.5_f64.powi(wanted.into()) * (1.0 + 1e-9));
                        }
                    }
                    assert!(parts.iter().all(|p| (p - 1.0).abs() < 1e-9));
                    assert_eq!(&fine.mesh.points[..mesh.points.len()], &mesh.points[..]);
                    for (k, &[a, b]) in fine.parents.iter().enumerate() {
                        let m = mesh.points.len() + k;
                        assert!((a as usize) < m && (b as usize) < m);
                        let [m, a, b] = [m, a as usize, b as usize].map(|p| fine.mesh.points[p]);
                        assert!((0..3).all(|x| a[x].min(b[x]) <= m[x] && m[x] <= a[x].max(b[x])));
                        assert!(graded || (0..3).all(|x| m[x] == 0.5 * (a[x] + b[x])));
                    }
                    mesh = fine.mesh;
                }
            }
        }
    }

    /// The least over the tetrahedra of volume over longest edge cubed.
    fn worst(mesh: &TetMesh) -> f64 {
        let ratio = |t: usize| {
            let tet = mesh.tets[t];
            let [a, b] = EDGES[longest(&mesh.points, tet) as usize].map(|k| mesh.points[tet[k] as usize]);
            let length = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt();
            mesh.determinant(t) / length.powi(3)
        };
        (0..mesh.tets.len()).map(ratio).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn refined_to_a_corner_again_and_again_the_tetrahedra_stay_well_shaped_and_few() {
        let mut mesh = plate(1, 1.0);
        let before = worst(&mesh);
        let corner = mesh.points.iter().position(|&p| p == [0.0, 1.0, 1.0]).unwrap() as u32;
        let mut counts = vec![mesh.tets.len()];
        for _ in 0..25 {
            let at: Vec<u32> =
                (0..mesh.tets.len() as u32).filter(|&t| mesh.tets[t as usize].contains(&corner)).collect();
            mesh = mesh.bisected(&at, 3).mesh;
            counts.push(mesh.tets.len());
        }
        mesh_checks::conforming(&mesh);
        assert!(worst(&mesh) > 0.25 * before, "{} {before}", worst(&mesh));
        let added: Vec<usize> = counts.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(added.iter().all(|&n| n < 4 * added[1]), "{added:?}");
    }

    #[test]
    fn the_same_marks_in_any_order_give_the_same_mesh() {
        let mesh = plate(2, 0.7);
        let marked: Vec<u32> = (0..mesh.tets.len() as u32).step_by(13).collect();
        let backward: Vec<u32> = marked.iter().rev().chain(&marked).copied().collect();
        assert_eq!(mesh.bisected(&marked, 3), mesh.bisected(&backward, 3));
        assert_eq!(mesh.bisected(&[], 3).mesh, mesh);
        assert_eq!(mesh.bisected(&marked, 0).mesh, mesh);
    }

    #[test]
    fn refining_everything_looks_at_as_many_tetrahedra_for_each_new_one_however_many_there_are() {
        let looked_at = [2, 4].map(|n| {
            let mesh = plate(n, 1.0);
            let mut grading = Grading::none(&mesh);
            let mut work = Refinement::of(&mesh, &mut grading);
            work.refine(&vec![3; mesh.tets.len()]);
            let (count, looked_at) = (work.tets.len(), work.looked_at);
            println!("{} to {count} tetrahedra, {looked_at} entries", mesh.tets.len());
            assert!(count >= 8 * mesh.tets.len());
            looked_at as f64 / count as f64
        });
        // Eight times as many tetrahedra, up to the share of the outer faces.
        assert!((looked_at[1] / looked_at[0] - 1.0).abs() < 0.1 && looked_at[1] < 10.0, "{looked_at:?}");
    }
}

//! Replacement of the tetrahedra that a region of a facet pierces by others that have its triangles as faces.
//!
//! The pierced tetrahedra form a cavity. The region divides it in two halves, and each is filled with
//! tetrahedra anew ([`Delaunay::filled`](super::delaunay::Delaunay::filled)). Once all segments are edges of
//! a Delaunay triangulation, such tetrahedra exist (Shewchuk, Proc. 14th Symp. Comput. Geom., 1998; Si and
//! Gärtner, Int. J. Numer. Methods Eng. 83, 2010). Exceptions are corners on common spheres, and rounding:
//! then the halves grow, and the region is tried with other diagonals.
//!
//! Which points lie on a facet is known from their numbers. Rounding leaves them a little off its plane, to
//! one side or the other, and no decision depends on which.
//!
//! In the methods here `f` is the number of the facet, and `triangles` are all those that it is divided
//! into.

use super::Point;
use super::boundary_recovery::MeshInProgress;
use super::delaunay::{TetFace, orientation, rotated, sorted};
use super::facet_recovery::Region;
use crate::meshing::tets::tetrahedron::EDGES;
use elastocap_linalg::vector::{length, normal};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// The largest number of times that half of a cavity may grow before the exchange is given up. Not tuned: a
/// limit that ordinary cases do not reach.
const MAX_GROWTHS: usize = 200;

/// The largest number of diagonals of a region to try. It is not tuned.
const MAX_DIAGONALS: usize = 12;

/// The part of a cavity on one side of a region.
struct Half {
    /// The triangles of the region, in the orientation that shows the side of this half.
    region: Vec<[u32; 3]>,
    /// The other faces around the half, in the orientation that shows its inside, each with its place in the
    /// mesh before the half is filled anew.
    rim: BTreeMap<[u32; 3], TetFace>,
    /// The points that the new tetrahedra may have as corners.
    corners: BTreeSet<u32>,
}

/// The tetrahedra that a region pierces.
#[derive(Default)]
struct PiercedTets {
    /// The tetrahedra.
    tets: Vec<u32>,
    /// Edges that pierce the region, upper end first.
    edges: BTreeSet<[u32; 2]>,
}

impl MeshInProgress {
    /// Replaces the tetrahedra that a region pierces by others that have its triangles as faces. Where that
    /// is not possible, other diagonals of two adjacent triangles are tried: if their four corners lie on a
    /// circle, either diagonal will do. Returns the region with the triangles that are faces now; `None` if
    /// no attempt succeeds.
    pub(super) fn exchange_any(
        &mut self,
        f: usize,
        triangles: &[[u32; 3]],
        region: &Region,
    ) -> Option<Region> {
        if self.exchange(f, triangles, region) {
            return Some(Region { triangles: region.triangles.clone() });
        }
        let pairs = adjacent_pairs(&region.triangles);
        for [s, t] in pairs.into_iter().take(MAX_DIAGONALS) {
            let Some(flipped) = self.flipped(f, region, s, t) else { continue };
            if self.exchange(f, triangles, &flipped) {
                return Some(flipped);
            }
        }
        None
    }

    /// The region with the other diagonal of two of its adjacent triangles, `s` and `t`, if they form a
    /// convex quadrangle.
    fn flipped(&self, f: usize, region: &Region, s: usize, t: usize) -> Option<Region> {
        let (one, other) = (region.triangles[s], region.triangles[t]);
        let i = one.iter().position(|p| !other.contains(p))?;
        let d = *other.iter().find(|p| !one.contains(p))?;
        let [a, b, c] = [0, 1, 2].map(|k| one[(i + k) % 3]);
        let facet = &self.complex.facets[f];
        let [p, q, r, e] = [a, b, c, d].map(|v| facet.project(self.mesh.points[v as usize]));
        let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let least = 1e-6 * turn(p, q, r).min(turn(q, e, r));
        if turn(p, q, e) <= least || turn(p, e, r) <= least {
            return None;
        }
        let mut triangles = region.triangles.clone();
        (triangles[s], triangles[t]) = ([a, b, d], [a, d, c]);
        Some(Region { triangles })
    }

    /// Replaces the tetrahedra that a region pierces by others that have its triangles as faces. Returns
    /// whether that was possible.
    fn exchange(&mut self, f: usize, triangles: &[[u32; 3]], region: &Region) -> bool {
        let widest = self.widest(triangles);
        let Some(mut cavity) = self.pierced(f, widest, region).map(|pierced| pierced.tets) else {
            return false;
        };
        let Some(halves) = self.halves(f, widest, region, &cavity) else { return false };
        let mut tets = Vec::new();
        for mut half in halves {
            let mut growths = 0;
            loop {
                match self.filled_half(&half) {
                    Ok(filled) => {
                        tets.extend(filled);
                        break;
                    }
                    Err(stuck) => {
                        growths += 1;
                        if growths > MAX_GROWTHS
                            || self.cancelled()
                            || !self.grow_half(&mut half, &mut cavity, stuck)
                        {
                            return false;
                        }
                    }
                }
            }
        }
        if !self.keeps_edges(&cavity, &tets) {
            return false;
        }
        let replaced = self.mesh.replace(&cavity, &tets);
        if replaced && let Some(&t) = self.mesh.new_tets.first() {
            self.last_tet = t;
        }
        replaced
    }

    /// Tetrahedra that fill one half of a cavity.
    ///
    /// # Errors
    /// The face at which filling got stuck.
    fn filled_half(&self, half: &Half) -> Result<Vec<[u32; 4]>, [u32; 3]> {
        let surface: Vec<[u32; 3]> = half.region.iter().chain(half.rim.keys()).copied().collect();
        let corners: Vec<u32> = half.corners.iter().copied().collect();
        self.mesh.filled(&surface, &corners, &|orientations| {
            self.count_orientations(orientations);
            !self.cancelled()
        })
    }

    /// The two parts, above and below, into which a region of a facet divides the tetrahedra that it pierces.
    /// `None` if it divides them in another way, which is due to rounding.
    fn halves(&self, f: usize, widest: [Point; 3], region: &Region, pierced: &[u32]) -> Option<[Half; 2]> {
        let members: HashSet<u32> = pierced.iter().copied().collect();
        let half = |triangles: Vec<[u32; 3]>| Half {
            corners: triangles.iter().flatten().copied().collect(),
            region: triangles,
            rim: BTreeMap::new(),
        };
        let turned = region.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let mut halves = [half(region.triangles.clone()), half(turned)];
        for &t in pierced {
            for p in self.mesh.tets[t as usize] {
                let side = self.side(f, widest, p);
                if side != 0.0 {
                    halves[usize::from(side < 0.0)].corners.insert(p);
                } else if !halves[0].corners.contains(&p) {
                    // The point lies on the facet, but is no corner of the region.
                    return None;
                }
            }
            for i in 0..4 {
                let across = self.mesh.neighbour(t, i);
                if across.is_some_and(|n| members.contains(&n)) && self.mesh.kept_face(t, i).is_none() {
                    continue;
                }
                let face = self.mesh.face(t, i);
                let sides = face.map(|p| self.side(f, widest, p));
                let above = sides.iter().any(|&s| s > 0.0);
                if above == sides.iter().any(|&s| s < 0.0) {
                    return None;
                }
                halves[usize::from(!above)].rim.insert(rotated(face), TetFace { tet: t, opposite: i });
            }
        }
        Some(halves)
    }

    /// Lets one half of a cavity grow across those faces of its rim that have an edge, or else a corner, in
    /// common with the face at which filling it got stuck. Returns whether it could. Corners on a common
    /// sphere may call for that.
    fn grow_half(&self, half: &mut Half, cavity: &mut Vec<u32>, stuck: [u32; 3]) -> bool {
        let common = |face: &[u32; 3]| face.iter().filter(|p| stuck.contains(p)).count();
        let is_crossable = |face: &TetFace| {
            let across = self.mesh.neighbour(face.tet, face.opposite);
            self.mesh.kept_face(face.tet, face.opposite).is_none()
                && across.is_some_and(|n| !cavity.contains(&n))
        };
        let next_to = |least: usize| -> Vec<TetFace> {
            let near =
                half.rim.iter().filter(|(corners, face)| common(corners) >= least && is_crossable(face));
            near.map(|(_, face)| *face).collect()
        };
        let mut faces = next_to(2);
        if faces.is_empty() {
            faces = next_to(1);
        }
        let mut grown = false;
        for TetFace { tet, opposite } in faces {
            let Some(n) = self.mesh.neighbour(tet, opposite) else { continue };
            if cavity.contains(&n) {
                continue;
            }
            grown = true;
            cavity.push(n);
            half.corners.extend(self.mesh.tets[n as usize]);
            for i in 0..4 {
                let face = self.mesh.face(n, i);
                let [a, b, c] = face;
                let was_rim = half.rim.remove(&rotated([a, c, b])).is_some();
                if !was_rim {
                    half.rim.insert(rotated(face), TetFace { tet: n, opposite: i });
                }
            }
        }
        grown
    }

    /// Whether the kept edges of the tetrahedra `before` the exchange are also edges of those `after` it.
    fn keeps_edges(&self, before: &[u32], after: &[[u32; 4]]) -> bool {
        let edges = |t: [u32; 4]| {
            EDGES
                .map(|[i, j]| sorted(t[i], t[j]))
                .into_iter()
                .filter(|e| self.mesh.kept_edges.contains_key(e))
        };
        let after: HashSet<[u32; 2]> = after.iter().flat_map(|&t| edges(t)).collect();
        before.iter().flat_map(|&t| edges(self.mesh.tets[t as usize])).all(|e| after.contains(&e))
    }

    /// The tetrahedra that a region of a facet pierces. `None` if they cannot be determined.
    fn pierced(&mut self, f: usize, widest: [Point; 3], region: &Region) -> Option<PiercedTets> {
        let mut out = PiercedTets::default();
        let corners: BTreeSet<u32> = region.triangles.iter().flatten().copied().collect();
        let mut stack: Vec<[u32; 2]> = Vec::new();
        for &v in &corners {
            for t in self.mesh.star(v) {
                for edge in self.edges_through(f, widest, t) {
                    if !out.edges.contains(&edge) && self.pierces(edge, region) {
                        out.edges.insert(edge);
                        stack.push(edge);
                    }
                }
            }
        }
        let mut members = HashSet::new();
        while let Some([p, q]) = stack.pop() {
            for t in self.mesh.star(p) {
                if !self.mesh.tets[t as usize].contains(&q) || !members.insert(t) {
                    continue;
                }
                out.tets.push(t);
                for edge in self.edges_through(f, widest, t) {
                    if out.edges.insert(edge) {
                        stack.push(edge);
                    }
                }
            }
        }
        (!out.tets.is_empty()).then_some(out)
    }

    /// The edges of a tetrahedron from one side of a facet's plane to the other, upper end first.
    fn edges_through(&self, f: usize, widest: [Point; 3], t: u32) -> Vec<[u32; 2]> {
        let ids = self.mesh.tets[t as usize];
        let sides = ids.map(|p| self.side(f, widest, p));
        let below =
            |i: usize| (0..4).filter(|&j| sides[j] < 0.0).map(|j| [ids[i], ids[j]]).collect::<Vec<_>>();
        (0..4).filter(|&i| sides[i] > 0.0).flat_map(below).collect()
    }

    /// Whether an edge pierces a triangle of a region. It cannot meet the outline of the region, which
    /// consists of edges too.
    fn pierces(&self, edge: [u32; 2], region: &Region) -> bool {
        let point = |p: u32| self.mesh.points[p as usize];
        let [p, q] = edge.map(point);
        region.triangles.iter().any(|t| {
            let sides = [0, 1, 2].map(|k| orientation(p, q, point(t[k]), point(t[(k + 1) % 3])));
            (sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0))
                && sides.iter().any(|&s| s != 0.0)
        })
    }

    /// The side of a facet on which a point lies: positive above, negative below, zero for points of the
    /// facet. The plane is that through its widest triangle.
    fn side(&self, f: usize, widest: [Point; 3], p: u32) -> f64 {
        if self.is_on(p, f as u32) {
            return 0.0;
        }
        let [a, b, c] = widest;
        orientation(a, b, c, self.mesh.points[p as usize])
    }

    /// The corners of the triangle with the largest area.
    fn widest(&self, triangles: &[[u32; 3]]) -> [Point; 3] {
        let places = |t: &[u32; 3]| t.map(|p| self.mesh.points[p as usize]);
        let area = |t: &[Point; 3]| length(normal(*t));
        let corners = triangles.iter().map(places);
        corners.reduce(|best, t| if area(&t) > area(&best) { t } else { best }).unwrap_or_default()
    }
}

/// The pairs of triangles with a common side, by their indices in the list.
fn adjacent_pairs(triangles: &[[u32; 3]]) -> Vec<[usize; 2]> {
    let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (k, t) in triangles.iter().enumerate() {
        for i in 0..3 {
            sides.entry(sorted(t[i], t[(i + 1) % 3])).or_default().push(k);
        }
    }
    sides.into_values().filter_map(|beside| <[usize; 2]>::try_from(beside).ok()).collect()
}

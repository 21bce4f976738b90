//! Exchanging a few tetrahedra for others with the same corners, where that makes the worst of them better.
//!
//! Two tetrahedra with a common face become three around the line between their other corners, and the
//! tetrahedra around an edge become those above and below the best triangulation of the ring of their other
//! corners (Freitag and Ollivier-Gooch, Int. J. Numer. Methods Eng. 40, 1997). Kept faces and edges stay.

use super::boundary_recovery::MeshInProgress;
use super::delaunay::{orientation, sorted};
use crate::meshing::tets::tetrahedron::{EDGES, angle_below_flat};

/// Largest number of tetrahedra around an edge that is removed. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const MAX_RING: usize = 9;

/// A change of a few tetrahedra.
struct Flip {
    /// The tetrahedra that are removed.
    before: Vec<u32>,
    /// The corners of the new tetrahedra.
    after: Vec<[u32; 4]>,
    /// The least [`angle_below_flat`] of the new tetrahedra.
    worst: f64,
}

impl MeshInProgress {
    /// Exchanges a tetrahedron and some next to it for others whose angles are farther from 180 degrees, by
    /// more than the factor `gain`. Returns whether that was possible.
    pub(super) fn flip_flat(&mut self, t: u32, gain: f64) -> bool {
        let quality = angle_below_flat(self.mesh.corners(t));
        let mut best: Option<Flip> = None;
        let ids = self.mesh.tets[t as usize];
        let faces = (0..4).filter_map(|i| self.face_flip(t, i));
        let mut flips: Vec<Flip> = faces.collect();
        for [i, j] in EDGES {
            flips.extend(self.edge_flip(ids[i], ids[j]));
        }
        for flip in flips {
            let least = best.as_ref().map_or(gain * quality, |best| best.worst);
            if flip.worst > least {
                best = Some(flip);
            }
        }
        best.is_some_and(|best| self.mesh.replace(&best.before, &best.after))
    }

    /// The measure [`angle_below_flat`] of a tetrahedron that is to be made; negative if it must not be made.
    fn worth(&self, tet: [u32; 4]) -> f64 {
        let [a, b, c, d] = tet.map(|p| self.mesh.points[p as usize]);
        if orientation(a, b, c, d) <= 0.0 || self.mesh.on_one_facet(&tet) {
            return -1.0;
        }
        angle_below_flat([a, b, c, d])
    }

    /// The three tetrahedra in place of a tetrahedron and its neighbour across the face opposite corner `i`.
    fn face_flip(&self, t: u32, i: usize) -> Option<Flip> {
        if self.mesh.kept_face(t, i).is_some() {
            return None;
        }
        let n = self.mesh.neighbour(t, i)?;
        let [a, b, c] = self.mesh.face(t, i);
        let d = self.mesh.tets[t as usize][i];
        let e = self.mesh.tets[n as usize].into_iter().find(|p| ![a, b, c].contains(p))?;
        let after = vec![[a, b, e, d], [b, c, e, d], [c, a, e, d]];
        let worst = after.iter().fold(f64::INFINITY, |worst, &tet| worst.min(self.worth(tet)));
        (worst > 0.0).then_some(Flip { before: vec![t, n], after, worst })
    }

    /// The tetrahedra without an edge in place of those around it.
    fn edge_flip(&mut self, a: u32, b: u32) -> Option<Flip> {
        if self.mesh.kept_edges.contains_key(&sorted(a, b)) {
            return None;
        }
        let around: Vec<u32> =
            self.mesh.star(a).into_iter().filter(|&t| self.mesh.tets[t as usize].contains(&b)).collect();
        if around.len() > MAX_RING {
            return None;
        }
        let mut steps = Vec::new();
        for &t in &around {
            let ids = self.mesh.tets[t as usize];
            let [i, j] = [a, b].map(|p| ids.iter().position(|&q| q == p));
            let (i, j) = (i?, j?);
            let mut others = (0..4).filter(|&k| k != i && k != j);
            let (k, l) = (others.next()?, others.next()?);
            if self.mesh.kept_face(t, k).is_some() || self.mesh.kept_face(t, l).is_some() {
                return None;
            }
            // Around the edge from a to b, k comes before l if a, b, k, l is an even permutation of the
            // corners.
            let order = [i, j, k, l];
            let swaps = EDGES.iter().filter(|[m, n]| order[*m] > order[*n]).count();
            steps.push(if swaps % 2 == 0 { [ids[k], ids[l]] } else { [ids[l], ids[k]] });
        }
        let mut ring = vec![steps.first()?[0]];
        while ring.len() < steps.len() {
            let last = *ring.last()?;
            ring.push(steps.iter().find(|step| step[0] == last)?[1]);
        }
        let (first, last) = (*ring.first()?, *ring.last()?);
        let is_closed = steps.contains(&[last, first]);
        let has_repetition = (1..ring.len()).any(|k| ring[..k].contains(&ring[k]));
        if ring.len() < 3 || !is_closed || has_repetition {
            return None;
        }
        let (worst, triangles) = self.best_triangles(&ring, a, b)?;
        let after = triangles.into_iter().flat_map(|[p, q, r]| [[p, q, r, b], [p, r, q, a]]).collect();
        Some(Flip { before: around, after, worst })
    }

    /// The triangulation of a ring whose tetrahedra with the corners `a` below and `b` above are best, and
    /// the quality of the worst of these tetrahedra. It is found for all parts of the ring between two of its
    /// corners, from short ones to the whole (Klincsek, 1980).
    fn best_triangles(&self, ring: &[u32], a: u32, b: u32) -> Option<(f64, Vec<[u32; 3]>)> {
        let n = ring.len();
        let mut best = vec![vec![(f64::INFINITY, 0_usize); n]; n];
        for length in 2..n {
            for i in 0..n - length {
                let j = i + length;
                let mut best_split = (f64::NEG_INFINITY, 0);
                for k in i + 1..j {
                    let [p, q, r] = [i, k, j].map(|m| ring[m]);
                    let worth = self.worth([p, q, r, b]).min(self.worth([p, r, q, a]));
                    let worst = worth.min(best[i][k].0).min(best[k][j].0);
                    if worst > best_split.0 {
                        best_split = (worst, k);
                    }
                }
                best[i][j] = best_split;
            }
        }
        let worst = best[0][n - 1].0;
        if worst <= 0.0 {
            return None;
        }
        let mut triangles = Vec::new();
        let mut parts = vec![(0, n - 1)];
        while let Some((i, j)) = parts.pop() {
            if j > i + 1 {
                let k = best[i][j].1;
                triangles.push([i, k, j].map(|m| ring[m]));
                parts.extend([(i, k), (k, j)]);
            }
        }
        Some((worst, triangles))
    }
}

//! Recovery of facets as faces of tetrahedra, without additional points wherever possible.
//!
//! A facet is divided into triangles by the constrained Delaunay triangulation, in its plane, of its points,
//! its segments and the edges of tetrahedra that lie on it. Triangles that are not faces of tetrahedra are
//! joined to regions whose outlines consist of edges, and the tetrahedra that a region pierces are exchanged
//! for others ([`super::facet_exchange`]). Where that is not possible, the region gets a point.

use super::boundary_recovery::MeshInProgress;
use super::delaunay::{Encroachment, FlatTets, Insertion, Refusal, circumcenter, sorted};
use super::{MeshError, Point};
use crate::meshing::indices::OptionalIndex;
use crate::meshing::plane::constrained_triangles;
use crate::outline;
use elastocap_linalg::vector::{length, minus, normal};
use std::collections::{BTreeMap, BTreeSet};

/// The largest number of rounds over all facets. In each round, facets that got points are divided anew. Not
/// tuned: a limit that ordinary cases do not reach.
const MAX_ROUNDS: usize = 200;

/// Triangles of a facet that are not faces of tetrahedra, joined across sides that are not edges of
/// tetrahedra.
pub(super) struct Region {
    /// Corners of the triangles, each anticlockwise as seen from above the facet.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl MeshInProgress {
    /// Adds points and exchanges tetrahedra until every facet consists of faces, which are kept from then on.
    /// All segments must consist of kept edges.
    ///
    /// # Errors
    /// [`MeshError::Unreachable`] if that takes too many points, and [`MeshError::Cancelled`].
    pub(super) fn recover_facets(&mut self, max_points: usize) -> Result<(), MeshError> {
        let mut open: Vec<usize> = (0..self.complex.facets.len()).collect();
        for _ in 0..MAX_ROUNDS {
            let mut incomplete = Vec::new();
            for f in open {
                self.go_on()?;
                if !self.recover_facet(f, max_points)? {
                    incomplete.push(f);
                }
            }
            if incomplete.is_empty() {
                return Ok(());
            }
            open = incomplete;
        }
        let at = open
            .first()
            .and_then(|&f| self.points_of_facet(f).first())
            .map(|&p| self.mesh.points[p as usize]);
        Err(self.unreachable(at.unwrap_or_default()))
    }

    /// Recovers one facet as faces, or adds points to it where that is not possible. Returns whether it is
    /// complete.
    fn recover_facet(&mut self, f: usize, max_points: usize) -> Result<bool, MeshError> {
        let triangles = self.facet_triangles(f);
        let mut missing = Vec::new();
        for &t in &triangles {
            if !self.keep_face(f, t) {
                missing.push(t);
            }
        }
        let mut complete = true;
        for region in self.regions(missing) {
            self.go_on()?;
            if self.mesh.points.len() > max_points {
                return Err(self.unreachable(self.centroid(region.triangles[0])));
            }
            if let Some(region) = self.exchange_any(f, &triangles, &region) {
                for &t in &region.triangles {
                    complete &= self.keep_face(f, t);
                }
            } else {
                self.go_on()?;
                self.add_point_in(f, &region)?;
                complete = false;
            }
        }
        Ok(complete)
    }

    /// Marks the face with these corners as a kept part of a facet. Returns whether there is such a face.
    fn keep_face(&mut self, f: usize, corners: [u32; 3]) -> bool {
        let mut is_face = false;
        for t in self.mesh.star(corners[0]) {
            let ids = self.mesh.tets[t as usize];
            if corners.iter().all(|p| ids.contains(p))
                && let Some(i) = (0..4).find(|&i| !corners.contains(&ids[i]))
            {
                self.mesh.kept_faces[t as usize][i] = OptionalIndex::some(f as u32);
                is_face = true;
            }
        }
        is_face
    }

    /// The triangles of a facet, anticlockwise as seen from above it.
    fn facet_triangles(&mut self, f: usize) -> Vec<[u32; 3]> {
        let facet_id = f as u32;
        let points = self.points_of_facet(f).to_vec();
        let facet = &self.complex.facets[f];
        let flat: Vec<[f64; 2]> =
            points.iter().map(|&p| facet.project(self.mesh.points[p as usize])).collect();
        let segments: BTreeSet<[u32; 2]> = self.kept_edges_of(f).clone();
        let mut edges = BTreeSet::new();
        if points.len() > 3 {
            for &p in &points {
                for t in self.mesh.star(p) {
                    let others = self.mesh.tets[t as usize].into_iter().filter(|&q| q > p);
                    edges.extend(others.filter(|&q| self.is_on(q, facet_id)).map(|q| [p, q]));
                }
            }
        }
        let number: BTreeMap<u32, usize> = points.iter().enumerate().map(|(k, &p)| (p, k)).collect();
        let numbered = |list: &mut dyn Iterator<Item = &[u32; 2]>| -> Vec<[usize; 2]> {
            list.filter_map(|[a, b]| Some([*number.get(a)?, *number.get(b)?])).collect()
        };
        let outlines = numbered(&mut segments.iter());
        let further = numbered(&mut edges.difference(&segments));
        let facet = &self.complex.facets[f];
        let inside = |q: [f64; 2]| facet.contains_projected(q);
        let triangles = constrained_triangles(&flat, &outlines, &further, inside);
        triangles.into_iter().map(|t| t.map(|k| points[k])).collect()
    }

    /// Joins triangles across sides that are not edges of tetrahedra.
    fn regions(&mut self, triangles: Vec<[u32; 3]>) -> Vec<Region> {
        let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (k, t) in triangles.iter().enumerate() {
            for i in 0..3 {
                sides.entry(sorted(t[i], t[(i + 1) % 3])).or_default().push(k);
            }
        }
        let mut adjacent: Vec<Vec<usize>> = vec![Vec::new(); triangles.len()];
        for (edge, beside) in sides {
            if let [s, t] = beside[..]
                && !self.mesh.has(&edge)
            {
                adjacent[s].push(t);
                adjacent[t].push(s);
            }
        }
        let mut seen = vec![false; triangles.len()];
        let mut out = Vec::new();
        for first in 0..triangles.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let mut members = vec![first];
            let mut next = 0;
            while next < members.len() {
                for &n in &adjacent[members[next]] {
                    if !std::mem::replace(&mut seen[n], true) {
                        members.push(n);
                    }
                }
                next += 1;
            }
            out.push(Region { triangles: members.into_iter().map(|k| triangles[k]).collect() });
        }
        out
    }

    /// Adds a point in a region of a facet that cannot be recovered as faces, or splits an edge of a segment
    /// in its way.
    fn add_point_in(&mut self, f: usize, region: &Region) -> Result<(), MeshError> {
        let facet_id = f as u32;
        let places = |t: [u32; 3]| t.map(|p| self.mesh.points[p as usize]);
        let squared = |a: Point, b: Point| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        let centers = region.triangles.iter().filter_map(|&t| {
            let center = circumcenter(places(t))?;
            Some((squared(center, places(t)[0]), center))
        });
        let largest = centers.reduce(|best, next| if next.0 > best.0 { next } else { best });
        let widest = region.triangles.iter().copied().reduce(|best, t| {
            let area = |t| length(normal(places(t)));
            if area(t) > area(best) { t } else { best }
        });
        let Some(widest) = widest else { return Ok(()) };
        let mut candidates = Vec::new();
        if let Some((_, center)) = largest {
            let encroached = self.kept_edges_of(f).iter().copied().find(|ends| {
                let [a, b] = ends.map(|p| self.mesh.points[p as usize]);
                squared(a, center) + squared(b, center) <= squared(a, b) * (1.0 + 1e-12)
            });
            if encroached.is_some_and(|ends| self.split_kept_edge(ends)) {
                return Ok(());
            }
            let facet = &self.complex.facets[f];
            let within = region.triangles.iter().any(|t| {
                let flat = t.map(|p| facet.project(self.mesh.points[p as usize]));
                outline::contains(&flat, facet.project(center))
            });
            if within {
                candidates.push(facet.nearest(center));
            }
        }
        candidates.push(self.complex.facets[f].nearest(self.centroid(widest)));
        let size = self.smallest_size(&widest);
        for at in candidates {
            for flat_tets in [FlatTets::Avoid, FlatTets::Allow] {
                for hint in self.mesh.star(widest[0]) {
                    let insertion = Insertion {
                        at,
                        hint,
                        facets: &[facet_id],
                        splits: None,
                        flat_tets,
                        encroachment: Encroachment::GoAround,
                        apart: 0.0,
                    };
                    match self.mesh.insert(&insertion) {
                        Ok(v) => {
                            self.note_point(v, &[facet_id], size);
                            return Ok(());
                        }
                        Err(Refusal::KeptEdge(edge)) if self.split_kept_edge(edge) => return Ok(()),
                        Err(Refusal::BehindKeptFace(_)) => {}
                        Err(_) => break,
                    }
                }
            }
        }
        let mut sides: Vec<(f64, [u32; 2])> = region
            .triangles
            .iter()
            .flat_map(|t| [0, 1, 2].map(|k| sorted(t[k], t[(k + 1) % 3])))
            .filter(|e| self.mesh.kept_edges.contains_key(e))
            .map(|e| (length(minus(self.mesh.points[e[0] as usize], self.mesh.points[e[1] as usize])), e))
            .collect();
        sides.sort_by(|a, b| b.0.total_cmp(&a.0));
        if sides.into_iter().any(|(_, edge)| self.split_kept_edge(edge)) {
            return Ok(());
        }
        Err(self.unreachable(self.centroid(widest)))
    }

    /// Splits a kept edge without removing another one. Returns whether that was possible.
    fn split_kept_edge(&mut self, ends: [u32; 2]) -> bool {
        let [a, b] = ends;
        let at = self.split_point(ends);
        let Some(&segment) = self.mesh.kept_edges.get(&ends) else { return false };
        let hint = self.mesh.star(a).into_iter().find(|&t| self.mesh.tets[t as usize].contains(&b));
        let Some(hint) = hint.filter(|_| !self.is_short(ends, segment)) else { return false };
        let facets = self.segments[segment as usize].clone();
        for flat_tets in [FlatTets::Avoid, FlatTets::Allow] {
            let result = self.mesh.insert(&Insertion {
                at,
                hint,
                facets: &facets,
                splits: Some(segment),
                flat_tets,
                encroachment: Encroachment::GoAround,
                apart: 0.0,
            });
            if let Ok(v) = result {
                self.note_point(v, &facets, self.smallest_size(&ends));
                self.split_kept(ends, v);
                return true;
            }
        }
        false
    }
}

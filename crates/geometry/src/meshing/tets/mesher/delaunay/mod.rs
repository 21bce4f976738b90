//! A Delaunay triangulation of points in a box, built point by point, in which faces and edges can be kept.
//!
//! A new point replaces the tetrahedra whose circumspheres contain it ([`insertion`]; Bowyer, Comput. J. 24,
//! 1981; Watson, ibid.). Orientation and sphere tests are exact ([`predicates`]), so that points on common
//! spheres and planes do no harm. The hull is the box of the start: every later point lies in it or, with the
//! very same coordinate, on it. Once the surfaces of the bodies consist of faces of the triangulation, these
//! faces and the edges along their outlines are marked as kept, and no later point removes them.

mod insertion;
mod predicates;
mod retriangulation;

use super::Point;
use super::region::Region;
use crate::meshing::indices::OptionalIndex;
use crate::meshing::tets::tetrahedron::{FACES, Measure};
pub(super) use insertion::{Encroachment, FlatTets, Insertion, Refusal};
pub(super) use predicates::{circumcenter, circumsphere_center, orientation};
pub(super) use retriangulation::rotated;
use std::collections::HashMap;

/// A face of a tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TetFace {
    /// The tetrahedron.
    pub(super) tet: u32,
    /// The corner that the face is opposite to, 0 to 3.
    pub(super) opposite: usize,
}

/// The triangulation. Slots of removed tetrahedra are used again.
#[derive(Debug, Default)]
pub(super) struct Delaunay {
    /// Positions, m.
    pub(super) points: Vec<Point>,
    /// The facets on which each point lies.
    pub(super) facets_of_point: Vec<Vec<u32>>,
    /// Corners, with a positive determinant; undefined where [`Delaunay::alive`] is false.
    pub(super) tets: Vec<[u32; 4]>,
    /// The tetrahedron across the face opposite each corner; none at the hull.
    pub(super) neighbours: Vec<[OptionalIndex; 4]>,
    /// The facet of which the face opposite each corner is a kept part.
    pub(super) kept_faces: Vec<[OptionalIndex; 4]>,
    /// The region of each tetrahedron. Tetrahedra that replace it on the same side of all kept faces inherit
    /// the region.
    pub(super) regions: Vec<Region>,
    /// Edges to be kept, by ascending ends, and the segments of which they are parts.
    pub(super) kept_edges: HashMap<[u32; 2], u32>,
    /// The tetrahedra that the last insertion made.
    pub(super) new_tets: Vec<u32>,
    /// New tetrahedra must be better than this by the measure, or the point is refused.
    pub(super) min_quality: f64,
    /// The measure of shape for `min_quality`.
    pub(super) measure: Measure,
    /// The tetrahedron that the next insertion must remove, or else it is refused.
    pub(super) must_remove: Option<u32>,
    /// The number of attempts to insert a point.
    pub(super) insertions: usize,
    /// Whether each slot holds a tetrahedron.
    alive: Vec<bool>,
    /// Some tetrahedron at each point.
    tet_of_point: Vec<u32>,
    /// Slots of removed tetrahedra that are not used again yet.
    free: Vec<u32>,
    /// Marks of tetrahedra by the current search; each search uses numbers above those of all searches
    /// before.
    stamps: Vec<u32>,
    /// Marks of points, in the same way.
    point_stamps: Vec<u32>,
    /// The largest number used as a mark so far.
    stamp: u32,
    /// State of a linear congruential generator: a walk that tries faces in a fixed order may not end.
    random: u32,
}

/// The ends of an edge in ascending order.
pub(super) fn sorted(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

impl Delaunay {
    /// The box alone, in six tetrahedra. Its eight corners are points 0 to 7, axis 0 fastest.
    pub(super) fn new(min: Point, max: Point) -> Self {
        let mut out = Self { random: 1, min_quality: f64::NEG_INFINITY, ..Self::default() };
        for corner in 0..8 {
            out.points.push([0, 1, 2].map(|a| if corner >> a & 1 == 0 { min[a] } else { max[a] }));
            out.facets_of_point.push(Vec::new());
            out.tet_of_point.push(0);
            out.point_stamps.push(0);
        }
        for (a, b) in [(1, 2), (2, 1), (1, 4), (4, 1), (2, 4), (4, 2)] {
            let mut tet = [0, a, a + b, 7];
            let [p, q, r, s] = tet.map(|p: u32| out.points[p as usize]);
            if orientation(p, q, r, s) < 0.0 {
                tet.swap(2, 3);
            }
            let slot = out.slot();
            out.tets[slot as usize] = tet;
            for p in tet {
                out.tet_of_point[p as usize] = slot;
            }
        }
        let mut unmatched: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
        for t in 0..6 {
            for i in 0..4 {
                let mut face = FACES[i].map(|k| out.tets[t][k]);
                face.sort_unstable();
                if let Some((n, j)) = unmatched.remove(&face) {
                    out.neighbours[t][i] = OptionalIndex::some(n as u32);
                    out.neighbours[n][j] = OptionalIndex::some(t as u32);
                } else {
                    unmatched.insert(face, (t, i));
                }
            }
        }
        out
    }

    /// A free slot for a tetrahedron, marked as alive; all but its region is reset.
    fn slot(&mut self) -> u32 {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.tets.push([0; 4]);
            self.neighbours.push([OptionalIndex::NONE; 4]);
            self.kept_faces.push([OptionalIndex::NONE; 4]);
            self.regions.push(Region::Background);
            self.stamps.push(0);
            self.alive.push(false);
            self.tets.len() as u32 - 1
        });
        self.neighbours[slot as usize] = [OptionalIndex::NONE; 4];
        self.kept_faces[slot as usize] = [OptionalIndex::NONE; 4];
        self.alive[slot as usize] = true;
        slot
    }

    /// Whether a slot holds a tetrahedron.
    pub(super) fn alive(&self, t: u32) -> bool {
        self.alive[t as usize]
    }

    /// The corners of a tetrahedron, m.
    pub(super) fn corners(&self, t: u32) -> [Point; 4] {
        self.tets[t as usize].map(|p| self.points[p as usize])
    }

    /// The points of the face opposite corner `i`.
    pub(super) fn face(&self, t: u32, i: usize) -> [u32; 3] {
        FACES[i].map(|k| self.tets[t as usize][k])
    }

    /// The tetrahedron across the face opposite corner `i`.
    pub(super) fn neighbour(&self, t: u32, i: usize) -> Option<u32> {
        self.neighbours[t as usize][i].get()
    }

    /// The facet of which the face opposite corner `i` is a kept part.
    pub(super) fn kept_face(&self, t: u32, i: usize) -> Option<u32> {
        self.kept_faces[t as usize][i].get()
    }

    /// All tetrahedra at a point.
    pub(super) fn star(&mut self, v: u32) -> Vec<u32> {
        self.stamp += 1;
        let mut out = vec![self.tet_of_point[v as usize]];
        self.stamps[out[0] as usize] = self.stamp;
        let mut next = 0;
        while next < out.len() {
            let t = out[next];
            next += 1;
            for i in 0..4 {
                if self.tets[t as usize][i] == v {
                    continue;
                }
                if let Some(n) = self.neighbour(t, i)
                    && self.stamps[n as usize] != self.stamp
                {
                    self.stamps[n as usize] = self.stamp;
                    out.push(n);
                }
            }
        }
        out
    }

    /// Whether the points are corners of one tetrahedron: then they span an edge or a face of the
    /// triangulation.
    pub(super) fn has(&mut self, simplex: &[u32]) -> bool {
        let star = self.star(simplex[0]);
        star.iter().any(|&t| simplex.iter().all(|p| self.tets[t as usize].contains(p)))
    }

    /// Some tetrahedron at the point.
    pub(super) fn tet_at(&self, v: u32) -> u32 {
        self.tet_of_point[v as usize]
    }

    /// The first kept face on the straight line from the centroid of a tetrahedron to `p`.
    pub(super) fn kept_face_towards(&self, mut t: u32, p: Point) -> Option<TetFace> {
        let corners = self.corners(t);
        let from = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
        for _ in 0..1000 {
            let i = (0..4).find(|&i| {
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                let sides = [[a, b], [b, c], [c, a]].map(|[q, r]| orientation(from, p, q, r));
                let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
                through && orientation(a, b, c, p) < 0.0 && orientation(a, b, c, from) > 0.0
            })?;
            if self.kept_face(t, i).is_some() {
                return Some(TetFace { tet: t, opposite: i });
            }
            t = self.neighbour(t, i)?;
        }
        None
    }

    /// The tetrahedra that the straight line from the centroid of one of them to `p` goes through; `None` if
    /// there is a kept face in its way, or if it leaves the triangulation.
    pub(super) fn tets_towards(&self, mut t: u32, p: Point) -> Option<Vec<u32>> {
        let corners = self.corners(t);
        let from = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
        let mut out = vec![t];
        for _ in 0..1000 {
            let through = (0..4).find(|&i| {
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                let sides = [[a, b], [b, c], [c, a]].map(|[q, r]| orientation(from, p, q, r));
                let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
                through && orientation(a, b, c, p) < 0.0 && orientation(a, b, c, from) > 0.0
            });
            let Some(i) = through else { return Some(out) };
            if self.kept_face(t, i).is_some() {
                return None;
            }
            t = self.neighbour(t, i)?;
            out.push(t);
        }
        None
    }

    /// Moves a point by the best of `offsets` if this raises the least `worth` of the tetrahedra at it.
    /// Returns whether the point moved.
    ///
    /// `worth` must be negative for tetrahedra with a negative volume.
    pub(super) fn improve(&mut self, v: u32, worth: impl Fn([Point; 4]) -> f64, offsets: &[Point]) -> bool {
        // The flattest tetrahedra first: most places are worse for one of these.
        let mut star: Vec<(f64, u32)> =
            self.star(v).into_iter().map(|t| (worth(self.corners(t)), t)).collect();
        star.sort_by(|a, b| a.0.total_cmp(&b.0));
        let start = self.points[v as usize];
        let before = star.first().map_or(f64::INFINITY, |flattest| flattest.0);
        let mut best = (before, start);
        for d in offsets {
            self.points[v as usize] = [0, 1, 2].map(|k| start[k] + d[k]);
            let mut least = f64::INFINITY;
            for &(_, t) in &star {
                least = least.min(worth(self.corners(t)));
                if least <= best.0 {
                    break;
                }
            }
            if least > best.0 {
                best = (least, self.points[v as usize]);
            }
        }
        self.points[v as usize] = best.1;
        best.0 > before
    }
}

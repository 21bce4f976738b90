//! Filling a cavity with tetrahedra that have its whole surface as faces: constrained gift wrapping.
//!
//! A face of the surface gets the corner whose sphere is emptiest among those that it sees, the new
//! tetrahedron leaves a smaller cavity, and so on until nothing is left (Shewchuk, Discrete Comput. Geom. 39,
//! 2008; Diazzi, Panozzo, Vaxman and Attene, ACM Trans. Graph. 42, 2023). Whether a tetrahedron fits is
//! decided by exact predicates, so that the result is valid for rounded points.

use super::predicates::{in_sphere, orientation};
use super::{Delaunay, OptionalIndex, Point, TetFace};
use crate::intersect::flat_turn;
use crate::meshing::tets::tetrahedron::FACES;
use std::cell::Cell;
use std::collections::{BTreeMap, HashMap};

/// The corners of a face in the order that shows its inner side, the smallest first.
type OrientedFace = [u32; 3];

/// The surroundings of a face on the surface of a cavity.
#[derive(Debug, Clone, Copy)]
struct Border {
    /// The tetrahedron across the face.
    neighbour: OptionalIndex,
    /// The facet of which the face is a kept part.
    kept: OptionalIndex,
    /// The tetrahedron of the cavity behind the face, and the corner opposite to it.
    inside: TetFace,
}

/// The corners of a face with the smallest first, in the same cyclic order.
pub(crate) fn rotated([a, b, c]: [u32; 3]) -> OrientedFace {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The corners of a face in the order that shows its other side.
fn reversed([a, b, c]: [u32; 3]) -> OrientedFace {
    rotated([a, c, b])
}

/// The largest number of orientation tests for the comparison of a triangle with a tetrahedron.
const ORIENTATIONS_PER_COMPARISON: usize = 140;

/// A face of the surface of the unfilled part of the cavity.
#[derive(Debug, Clone, Copy)]
struct OpenFace {
    /// The corners, in the order that shows the unfilled side.
    corners: OrientedFace,
    /// The lower corner of the box around the face, m.
    low: Point,
    /// The upper corner of that box, m.
    high: Point,
}

/// The lower and the upper corner of the box around some points, m.
fn bounds(points: &[Point]) -> [Point; 2] {
    let pick = |f: fn(f64, f64) -> f64| {
        [0, 1, 2].map(|a| points.iter().skip(1).fold(points[0][a], |m, p| f(m, p[a])))
    };
    [pick(f64::min), pick(f64::max)]
}

/// The surface of the unfilled part of the cavity.
struct Front<'a> {
    /// The points of the triangulation, m.
    points: &'a [Point],
    /// Faces, some of which are not open any more.
    faces: Vec<OpenFace>,
    /// The indices in `faces` of those that are open.
    open: HashMap<OrientedFace, usize>,
    /// The approximate number of orientation tests since the caller was last told of it.
    orientations: Cell<usize>,
}

impl Front<'_> {
    /// Adds a face. Returns whether it was not open yet.
    fn add(&mut self, corners: [u32; 3]) -> bool {
        let corners = rotated(corners);
        let [low, high] = bounds(&corners.map(|p| self.points[p as usize]));
        let index = self.faces.len();
        self.faces.push(OpenFace { corners, low, high });
        self.open.insert(corners, index).is_none()
    }

    /// Counts orientation tests.
    fn count(&self, orientations: usize) {
        self.orientations.set(self.orientations.get() + orientations);
    }

    /// Whether a tetrahedron on an open face is inside the unfilled part, and leaves a valid surface.
    fn admits(&self, tet: [u32; 4], corners: &[u32]) -> bool {
        let places = tet.map(|p| self.points[p as usize]);
        let [low, high] = bounds(&places);
        let inside = |p: u32| {
            let q = self.points[p as usize];
            (0..3).all(|a| low[a] <= q[a] && q[a] <= high[a])
                && FACES.iter().all(|f| {
                    let [a, b, c] = f.map(|k| places[k]);
                    orientation(a, b, c, q) >= 0.0
                })
        };
        self.count(corners.len());
        if corners.iter().any(|&p| !tet.contains(&p) && inside(p)) {
            return false;
        }
        // No new face may be open twice from the other side.
        let would_open_twice = |f: &[usize; 3]| {
            let face = rotated(f.map(|k| tet[k]));
            !self.open.contains_key(&face) && self.open.contains_key(&reversed(face))
        };
        if FACES[..3].iter().any(would_open_twice) {
            return false;
        }
        self.faces.iter().enumerate().all(|(index, face)| {
            let apart = (0..3).any(|a| face.high[a] < low[a] || high[a] < face.low[a]);
            if apart || self.open.get(&face.corners) != Some(&index) {
                return true;
            }
            self.count(ORIENTATIONS_PER_COMPARISON);
            !self.enters(face.corners, tet) && !self.crosses(face.corners, tet)
        })
    }

    /// Whether a triangle has a point inside a tetrahedron. If it has none, a plane through three of the
    /// corners of the two separates them.
    fn enters(&self, triangle: [u32; 3], tet: [u32; 4]) -> bool {
        let mut ids = tet.to_vec();
        ids.extend(triangle.iter().filter(|p| !tet.contains(p)));
        let point = |k: usize| self.points[ids[k] as usize];
        let belongs = |k: usize| (k < 4, k >= 4 || triangle.contains(&ids[k]));
        let n = ids.len();
        for i in 0..n {
            for j in i + 1..n {
                for k in j + 1..n {
                    // Whether the tetrahedron (`solid`) and the triangle (`flat`) have a corner below and a
                    // corner above the plane.
                    let (mut solid, mut flat) = ([false; 2], [false; 2]);
                    for l in (0..n).filter(|l| ![i, j, k].contains(l)) {
                        let side = orientation(point(i), point(j), point(k), point(l));
                        let (of_tet, of_triangle) = belongs(l);
                        if side != 0.0 {
                            solid[usize::from(side > 0.0)] |= of_tet;
                            flat[usize::from(side > 0.0)] |= of_triangle;
                        }
                    }
                    let separates = |s: usize| solid[s] && !solid[1 - s] && !flat[s];
                    if separates(0) || separates(1) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Whether an edge of a triangle crosses, in a common plane, one of the edges at the last corner of a
    /// tetrahedron.
    fn crosses(&self, triangle: [u32; 3], tet: [u32; 4]) -> bool {
        (0..3).any(|i| {
            let (a, d) = (tet[i], tet[3]);
            (0..3).any(|k| {
                let (u, v) = (triangle[k], triangle[(k + 1) % 3]);
                if [a, d].contains(&u) || [a, d].contains(&v) {
                    return false;
                }
                let [a, d, u, v] = [a, d, u, v].map(|p| self.points[p as usize]);
                orientation(a, d, u, v) == 0.0
                    && [[0, 1], [1, 2], [2, 0]].into_iter().any(|axes| {
                        let turn = |p, q, r| flat_turn(axes, p, q, r);
                        let opposite = |s: f64, t: f64| (s < 0.0 && t > 0.0) || (s > 0.0 && t < 0.0);
                        opposite(turn(a, d, u), turn(a, d, v)) && opposite(turn(u, v, a), turn(u, v, d))
                    })
            })
        })
    }
}

impl Delaunay {
    /// Whether all points lie on one facet.
    pub(crate) fn on_one_facet(&self, points: &[u32]) -> bool {
        let Some((&first, rest)) = points.split_first() else { return false };
        let facets_of = |p: u32| &self.facets_of_point[p as usize];
        facets_of(first).iter().any(|f| rest.iter().all(|&p| facets_of(p).contains(f)))
    }

    /// Tetrahedra that fill the space inside a closed surface and have no other corners than `corners`. The
    /// surface is given by faces that show their inner sides: the fourth corner of a positive tetrahedron is
    /// on that side. None of them has all its corners on one facet.
    ///
    /// `goes_on` receives the approximate number of orientation tests since its last call, which take most of
    /// the time, and returns whether to go on.
    ///
    /// # Errors
    /// A face for which no corner is found, or at which the work was given up.
    pub(crate) fn filled(
        &self,
        surface: &[[u32; 3]],
        corners: &[u32],
        goes_on: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<[u32; 4]>, [u32; 3]> {
        let (faces, open, orientations) = (Vec::new(), HashMap::new(), Cell::new(0));
        let mut front = Front { points: &self.points, faces, open, orientations };
        for &face in surface {
            if !front.add(face) {
                return Err(face);
            }
        }
        if let Some(&face) = surface.first()
            && !is_closed(surface)
        {
            return Err(face);
        }
        let point = |p: u32| self.points[p as usize];
        let mut tets = Vec::new();
        let mut next = 0;
        while next < front.faces.len() {
            let [a, b, c] = front.faces[next].corners;
            if front.open.get(&[a, b, c]) != Some(&next) {
                next += 1;
                continue;
            }
            let sees = |d: &u32| {
                ![a, b, c].contains(d)
                    && orientation(point(a), point(b), point(c), point(*d)) > 0.0
                    && !self.on_one_facet(&[a, b, c, *d])
            };
            if !goes_on(front.orientations.take()) {
                return Err([a, b, c]);
            }
            front.count(corners.len());
            let mut candidates: Vec<u32> = corners.iter().copied().filter(sees).collect();
            let in_sphere_of = |d: u32, e: u32| in_sphere([a, b, c, d].map(point), point(e));
            let apex = loop {
                let emptier = |best: u32, d: u32| {
                    if in_sphere_of(best, d) || (d < best && !in_sphere_of(d, best)) { d } else { best }
                };
                let best = candidates.iter().copied().reduce(emptier).ok_or([a, b, c])?;
                if front.admits([a, b, c, best], corners) {
                    break best;
                }
                candidates.retain(|&d| d != best);
            };
            let tet = [a, b, c, apex];
            for face in FACES {
                let face = rotated(face.map(|k| tet[k]));
                if front.open.remove(&face).is_none() {
                    front.add(reversed(face));
                }
            }
            tets.push(tet);
            next += 1;
        }
        Ok(tets)
    }

    /// Replaces tetrahedra by others that fill the same space; both must have the same corners. Returns
    /// whether that was possible; the triangulation is as before if not.
    pub(crate) fn replace(&mut self, cavity: &[u32], tets: &[[u32; 4]]) -> bool {
        self.stamp += 1;
        cavity.iter().for_each(|&t| self.stamps[t as usize] = self.stamp);
        let mut border: HashMap<OrientedFace, Border> = HashMap::new();
        for &t in cavity {
            for i in 0..4 {
                let neighbour = self.neighbours[t as usize][i];
                let kept = self.kept_faces[t as usize][i];
                let outside = neighbour.get().is_none_or(|n| self.stamps[n as usize] != self.stamp);
                if outside || kept.get().is_some() {
                    let inside = TetFace { tet: t, opposite: i };
                    border.insert(rotated(self.face(t, i)), Border { neighbour, kept, inside });
                }
            }
        }
        // Each new face has another one opposite to it, or lies on the border; all of the border is used.
        let mut sides: BTreeMap<OrientedFace, TetFace> = BTreeMap::new();
        for (k, tet) in tets.iter().enumerate() {
            for i in 0..4 {
                let face = rotated(FACES[i].map(|c| tet[c]));
                if sides.insert(face, TetFace { tet: k as u32, opposite: i }).is_some() {
                    return false;
                }
            }
        }
        let matched = |f: &OrientedFace| border.contains_key(f) || sides.contains_key(&reversed(*f));
        if !sides.keys().all(matched) || !border.keys().all(|f| sides.contains_key(f)) {
            return false;
        }
        let corners = |list: &mut dyn Iterator<Item = u32>| {
            let mut ids: Vec<u32> = list.collect();
            ids.sort_unstable();
            ids.dedup();
            ids
        };
        let before = corners(&mut cavity.iter().flat_map(|&t| self.tets[t as usize]));
        if before != corners(&mut tets.iter().flatten().copied()) {
            return false;
        }
        let region = cavity.first().map(|&t| self.regions[t as usize]);
        self.new_tets.clear();
        for tet in tets {
            let slot = self.slot();
            self.tets[slot as usize] = *tet;
            self.regions[slot as usize] = region.unwrap_or_default();
            tet.iter().for_each(|&p| self.tet_of_point[p as usize] = slot);
            self.new_tets.push(slot);
        }
        let new = |side: &TetFace| TetFace { tet: self.new_tets[side.tet as usize], ..*side };
        let mut links = Vec::new();
        for (face, side) in &sides {
            let link = match border.get(face) {
                None => sides
                    .get(&reversed(*face))
                    .map(|other| (OptionalIndex::some(new(other).tet), OptionalIndex::NONE)),
                Some(&Border { neighbour, kept, inside }) => {
                    // A kept face amid the cavity has new tetrahedra on both sides.
                    let across =
                        neighbour.get().filter(|&n| self.stamps[n as usize] == self.stamp && self.alive(n));
                    match across.and_then(|_| sides.get(&reversed(*face))) {
                        Some(other) => Some((OptionalIndex::some(new(other).tet), kept)),
                        None => {
                            if let Some(n) = neighbour.get()
                                && let Some(back) = (0..4).find(|&j| {
                                    self.neighbours[n as usize][j] == OptionalIndex::some(inside.tet)
                                })
                            {
                                self.neighbours[n as usize][back] = OptionalIndex::some(new(side).tet);
                            }
                            Some((neighbour, kept))
                        }
                    }
                }
            };
            links.push((new(side), link));
        }
        for (TetFace { tet, opposite }, link) in links {
            if let Some((neighbour, kept)) = link {
                self.neighbours[tet as usize][opposite] = neighbour;
                self.kept_faces[tet as usize][opposite] = kept;
            }
        }
        for &t in cavity {
            self.alive[t as usize] = false;
            self.free.push(t);
        }
        true
    }
}

/// Whether each edge of the faces is passed as often one way as the other.
fn is_closed(faces: &[[u32; 3]]) -> bool {
    let mut passes: HashMap<[u32; 2], i32> = HashMap::new();
    for f in faces {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            let (edge, way) = if a < b { ([a, b], 1) } else { ([b, a], -1) };
            *passes.entry(edge).or_default() += way;
        }
    }
    passes.values().all(|&n| n == 0)
}

//! Insertion of a point into the triangulation.
//!
//! The tetrahedra that the point replaces form its *cavity*; the faces around the cavity are its *rim*. The
//! cavity starts with the tetrahedron that contains the point, takes in neighbours whose circumspheres
//! contain it, stops at kept faces, and loses those from which the point could not see the whole rim.

use super::predicates::{circumcenter, in_sphere, orientation};
use super::{Delaunay, OptionalIndex, Point, TetFace, sorted};
use crate::meshing::tets::tetrahedron::EDGES;

/// Longest walk of the search for the tetrahedron that contains a point, in tetrahedra. Not tuned: a limit
/// that ordinary cases do not reach.
const MAX_STEPS: usize = 20_000;

/// Where new tetrahedra must be round, a cavity grows to this many tetrahedra at most. It is not tuned.
const MAX_ROUND_CAVITY: usize = 100;

/// The rule of an insertion for tetrahedra whose corners would all lie on one facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FlatTets {
    /// Such tetrahedra may arise.
    Allow,
    /// The cavity grows beyond the facet so that none arises, or the point is refused.
    Avoid,
}

/// The rule of an insertion for a point in the smallest sphere around a kept face or edge that does not
/// contain it (it *encroaches* upon the face or edge: Shewchuk, Comput. Geom. 22, 2002).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encroachment {
    /// The point is inserted.
    Allow,
    /// The point is refused.
    Refuse,
    /// The point is inserted, and the cavity leaves out the tetrahedra that kept edges need.
    GoAround,
}

/// A point to be inserted into the triangulation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Insertion<'a> {
    /// The position of the point, m.
    pub(crate) at: Point,
    /// The tetrahedron at which the search for the point starts.
    pub(crate) hint: u32,
    /// The facets on which it lies; kept faces of these may be replaced.
    pub(crate) facets: &'a [u32],
    /// The segment that it splits; a kept edge of this may be replaced.
    pub(crate) splits: Option<u32>,
    /// The rule for flat tetrahedra.
    pub(crate) flat_tets: FlatTets,
    /// The rule if the point encroaches upon a kept face or edge.
    pub(crate) encroachment: Encroachment,
    /// The point is refused as a duplicate if a corner of the tetrahedron that contains it is no farther away
    /// than this, m.
    pub(crate) apart: f64,
}

impl Insertion<'_> {
    /// A point on no facet, inserted whatever is near it.
    pub(crate) fn free(at: Point, hint: u32) -> Self {
        Insertion {
            at,
            hint,
            facets: &[],
            splits: None,
            flat_tets: FlatTets::Allow,
            encroachment: Encroachment::Allow,
            apart: 0.0,
        }
    }

    /// Whether a face may be replaced: it is not kept, or it is part of a facet of the point.
    fn may_replace(&self, kept: OptionalIndex) -> bool {
        kept.get().is_none_or(|facet| self.facets.contains(&facet))
    }
}

/// The reason why a point was not inserted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Refusal {
    /// The given point of the triangulation is at the same place or counts as a duplicate.
    Duplicate(u32),
    /// The point is outside the box.
    Outside,
    /// The given kept face is between the point and the start of the search.
    BehindKeptFace(TetFace),
    /// The point would remove the given kept edge, or encroaches upon it.
    KeptEdge([u32; 2]),
    /// The point encroaches upon the given kept face.
    NearKeptFace(TetFace),
    /// The tetrahedron that this insertion must remove would stay, because kept faces separate it from the
    /// point.
    MissesTarget,
    /// New tetrahedra would be degenerate, or another point would be lost.
    Degenerate,
}

/// The tetrahedra that a point replaces.
struct Cavity {
    /// The tetrahedron that contains the point.
    start: u32,
    /// All tetrahedra of the cavity.
    tets: Vec<u32>,
    /// The faces around the cavity.
    rim: Vec<TetFace>,
    /// The mark of tetrahedra in the cavity.
    inside: u32,
    /// The mark of tetrahedra that were removed from the cavity for good.
    banned: u32,
}

/// The square of the distance between two points, m^2.
fn squared_distance(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

impl Delaunay {
    /// Inserts a point into the triangulation and returns its number.
    ///
    /// # Errors
    /// The reason why the point cannot be inserted. The triangulation is then unchanged.
    pub(crate) fn insert(&mut self, point: &Insertion) -> Result<u32, Refusal> {
        self.insert_instead_of(&[], point)
    }

    /// Inserts a point whose cavity starts with the given tetrahedra, whatever their circumspheres: those of
    /// flat tetrahedra may lie anywhere. The point is refused unless it sees the rim of a cavity with all of
    /// them from inside.
    ///
    /// # Errors
    /// The reason why the point cannot be inserted. The triangulation is then unchanged.
    pub(crate) fn insert_instead_of(&mut self, tets: &[u32], point: &Insertion) -> Result<u32, Refusal> {
        self.insertions += 1;
        let start = self.locate(point)?;
        let is_near = |&&q: &&u32| squared_distance(self.points[q as usize], point.at) <= point.apart.powi(2);
        if let Some(&known) = self.tets[start as usize].iter().find(is_near) {
            return Err(Refusal::Duplicate(known));
        }
        let mut cavity = self.cavity(start, tets);
        self.settle(point, &mut cavity)?;
        if self.must_remove.is_some_and(|t| self.stamps[t as usize] != cavity.inside) {
            return Err(Refusal::MissesTarget);
        }
        loop {
            match self.check(point, &cavity) {
                Ok(()) => return Ok(self.fill(point, &cavity)),
                Err(Refusal::KeptEdge(edge)) if point.encroachment == Encroachment::GoAround => {
                    self.go_around(edge, &mut cavity)?;
                    self.settle(point, &mut cavity)?;
                }
                Err(refusal) => return Err(refusal),
            }
        }
    }

    /// The tetrahedron that contains the point, by a walk that crosses no kept face except those of the
    /// point's facets.
    fn locate(&mut self, point: &Insertion) -> Result<u32, Refusal> {
        let mut t = point.hint;
        'walk: for _ in 0..MAX_STEPS {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let first = (self.random >> 16) as usize;
            for k in 0..4 {
                let i = (first + k) % 4;
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                if orientation(a, b, c, point.at) < 0.0 {
                    if !point.may_replace(self.kept_faces[t as usize][i]) {
                        return Err(Refusal::BehindKeptFace(TetFace { tet: t, opposite: i }));
                    }
                    t = self.neighbour(t, i).ok_or(Refusal::Outside)?;
                    continue 'walk;
                }
            }
            return Ok(t);
        }
        Err(Refusal::Degenerate)
    }

    /// A cavity of the tetrahedron `start`, which contains the point, and others.
    fn cavity(&mut self, start: u32, others: &[u32]) -> Cavity {
        self.stamp += 2;
        let (inside, banned) = (self.stamp, self.stamp - 1);
        let mut tets = vec![start];
        tets.extend(others.iter().filter(|&&t| t != start));
        tets.iter().for_each(|&t| self.stamps[t as usize] = inside);
        Cavity { start, tets, rim: Vec::new(), inside, banned }
    }

    /// Grows a cavity, and trims it, until the point sees all of its rim from inside.
    fn settle(&mut self, point: &Insertion, cavity: &mut Cavity) -> Result<(), Refusal> {
        // The number of tetrahedra at the start of the list whose neighbours have been checked: none of the
        // neighbours outside the cavity will join it.
        let mut checked = 0;
        loop {
            self.grow(point, cavity, checked);
            if point.flat_tets == FlatTets::Allow && self.min_quality <= 0.0 {
                self.throw_out_hidden(point, cavity)?;
                cavity.tets.retain(|&t| self.stamps[t as usize] == cavity.inside);
            }
            let before = cavity.tets.len();
            if !self.trim(point, cavity)? {
                return Ok(());
            }
            let stays = |&&t: &&u32| self.stamps[t as usize] == cavity.inside;
            checked = cavity.tets[..before].iter().filter(stays).count();
            cavity.tets.retain(|&t| self.stamps[t as usize] == cavity.inside);
        }
    }

    /// Removes the tetrahedra with rim faces that the point does not see from inside, for a cavity that does
    /// not grow any more: then the order of removal does not matter, and each is checked again only after the
    /// removal of a neighbour. The rounds of [`Self::trim`] would check a large cavity as a whole for each
    /// layer that is removed.
    fn throw_out_hidden(&mut self, point: &Insertion, cavity: &Cavity) -> Result<(), Refusal> {
        let mut open = cavity.tets.clone();
        while let Some(t) = open.pop() {
            if self.stamps[t as usize] != cavity.inside {
                continue;
            }
            let hidden = (0..4).any(|i| {
                let n = self.neighbour(t, i);
                let across = n.is_some_and(|n| self.stamps[n as usize] == cavity.inside);
                let replaced = point.may_replace(self.kept_faces[t as usize][i]);
                if across && replaced {
                    return false;
                }
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                let side = orientation(a, b, c, point.at);
                side < 0.0 || (side == 0.0 && n.is_some())
            });
            if !hidden {
                continue;
            }
            if t == cavity.start {
                return Err(Refusal::Degenerate);
            }
            self.stamps[t as usize] = cavity.banned;
            open.extend((0..4).filter_map(|i| self.neighbour(t, i)));
        }
        Ok(())
    }

    /// Removes the tetrahedra at an edge from a cavity, except the one that contains the point.
    fn go_around(&mut self, edge: [u32; 2], cavity: &mut Cavity) -> Result<(), Refusal> {
        let before = cavity.tets.len();
        for &t in &cavity.tets {
            if t != cavity.start && edge.iter().all(|p| self.tets[t as usize].contains(p)) {
                self.stamps[t as usize] = cavity.banned;
            }
        }
        cavity.tets.retain(|&t| self.stamps[t as usize] == cavity.inside);
        if cavity.tets.len() == before { Err(Refusal::KeptEdge(edge)) } else { Ok(()) }
    }

    /// Adds the neighbours whose circumspheres contain the point. Only the neighbours of the tetrahedra from
    /// place `from` of the list on are looked at.
    fn grow(&mut self, point: &Insertion, cavity: &mut Cavity, from: usize) {
        let mut next = from;
        while next < cavity.tets.len() {
            let t = cavity.tets[next];
            next += 1;
            for i in 0..4 {
                let Some(n) = self.neighbour(t, i) else { continue };
                let marked = self.stamps[n as usize] >= cavity.banned;
                if marked || !point.may_replace(self.kept_faces[t as usize][i]) {
                    continue;
                }
                if in_sphere(self.corners(n), point.at) {
                    self.stamps[n as usize] = cavity.inside;
                    cavity.tets.push(n);
                }
            }
        }
    }

    /// Lists the rim, and removes tetrahedra with rim faces that the point does not see from inside. Adds the
    /// tetrahedra beyond rim faces at which a new tetrahedron would not be round enough, or would be flat
    /// where that is to be avoided. Returns whether the cavity changed.
    fn trim(&mut self, point: &Insertion, cavity: &mut Cavity) -> Result<bool, Refusal> {
        cavity.rim.clear();
        let mut changed = false;
        for k in 0..cavity.tets.len() {
            let t = cavity.tets[k];
            for i in 0..4 {
                let n = self.neighbour(t, i);
                let outside = |n: u32| self.stamps[n as usize] != cavity.inside;
                // The cavity may reach around a kept face: then the tetrahedra behind it have to be removed.
                let across = n.is_some_and(|n| !outside(n));
                if outside(t) || (across && point.may_replace(self.kept_faces[t as usize][i])) {
                    continue;
                }
                let face = self.face(t, i);
                if point.flat_tets == FlatTets::Avoid
                    && let Some(n) = n
                    && !across
                    && point.facets.iter().any(|f| self.all_on(&face, *f))
                {
                    if self.stamps[n as usize] == cavity.banned {
                        return Err(Refusal::Degenerate);
                    }
                    self.stamps[n as usize] = cavity.inside;
                    cavity.tets.push(n);
                    changed = true;
                    continue;
                }
                let [a, b, c] = face.map(|q| self.points[q as usize]);
                let side = orientation(a, b, c, point.at);
                let face = TetFace { tet: t, opposite: i };
                // A tetrahedron that would be too flat at this face may be round enough at the faces of the
                // next tetrahedron.
                if self.min_quality > 0.0
                    && let Some(n) = n
                    && self.stamps[n as usize] != cavity.banned
                    && point.may_replace(self.kept_faces[t as usize][i])
                    && self.measure.of([a, b, c, point.at]) <= self.min_quality
                {
                    if cavity.tets.len() > MAX_ROUND_CAVITY {
                        return Err(Refusal::Degenerate);
                    }
                    self.stamps[n as usize] = cavity.inside;
                    cavity.tets.push(n);
                    changed = true;
                    continue;
                }
                if side == 0.0 && n.is_none() {
                    // A point in the plane of a kept face that is not known to lie on its facet could be
                    // moved off it later.
                    if !point.may_replace(self.kept_faces[t as usize][i]) {
                        return Err(Refusal::NearKeptFace(face));
                    }
                } else if side <= 0.0 {
                    if t == cavity.start {
                        return Err(Refusal::Degenerate);
                    }
                    self.stamps[t as usize] = cavity.banned;
                    changed = true;
                } else {
                    cavity.rim.push(face);
                }
            }
        }
        Ok(changed)
    }

    /// Whether all corners of a face lie on a facet.
    fn all_on(&self, face: &[u32; 3], facet: u32) -> bool {
        face.iter().all(|&q| self.facets_of_point[q as usize].contains(&facet))
    }

    /// Fails if new tetrahedra would be too flat, if the cavity would lose a point or a kept edge, or if the
    /// point encroaches.
    fn check(&mut self, point: &Insertion, cavity: &Cavity) -> Result<(), Refusal> {
        self.stamp += 1;
        let mut rim_edges = Vec::new();
        for &TetFace { tet, opposite } in &cavity.rim {
            let face = self.face(tet, opposite);
            if self.min_quality.is_finite() {
                let [a, b, c] = face.map(|q| self.points[q as usize]);
                if self.measure.of([a, b, c, point.at]) <= self.min_quality {
                    return Err(Refusal::Degenerate);
                }
            }
            for k in 0..3 {
                self.point_stamps[face[k] as usize] = self.stamp;
                rim_edges.push(sorted(face[k], face[(k + 1) % 3]));
            }
        }
        let on_rim = |&q: &u32| self.point_stamps[q as usize] == self.stamp;
        if !cavity.tets.iter().all(|&t| self.tets[t as usize].iter().all(on_rim)) {
            return Err(Refusal::Degenerate);
        }
        if self.kept_edges.is_empty() {
            return Ok(());
        }
        rim_edges.sort_unstable();
        self.check_kept_edges(point, cavity, &rim_edges)?;
        if point.encroachment == Encroachment::Refuse && point.facets.is_empty() {
            self.check_kept_faces(point, cavity)?;
        }
        Ok(())
    }

    /// Fails if a kept edge of the cavity is not among the `rim_edges`, which are sorted, or if the point
    /// encroaches upon one.
    fn check_kept_edges(
        &self,
        point: &Insertion,
        cavity: &Cavity,
        rim_edges: &[[u32; 2]],
    ) -> Result<(), Refusal> {
        for &t in &cavity.tets {
            for [i, j] in EDGES {
                let edge = sorted(self.tets[t as usize][i], self.tets[t as usize][j]);
                if self.facets_of_point[edge[0] as usize].is_empty() {
                    continue;
                }
                let Some(&segment) = self.kept_edges.get(&edge) else { continue };
                if point.splits == Some(segment) {
                    continue;
                }
                let [a, b] = edge.map(|q| self.points[q as usize]);
                let (to_a, to_b) = (squared_distance(a, point.at), squared_distance(b, point.at));
                let encroaches =
                    point.encroachment == Encroachment::Refuse && to_a + to_b < squared_distance(a, b);
                if encroaches || rim_edges.binary_search(&edge).is_err() {
                    return Err(Refusal::KeptEdge(edge));
                }
            }
        }
        Ok(())
    }

    /// Fails if the point encroaches upon a kept face of the rim.
    fn check_kept_faces(&self, point: &Insertion, cavity: &Cavity) -> Result<(), Refusal> {
        for &face in &cavity.rim {
            let TetFace { tet, opposite } = face;
            if point.may_replace(self.kept_faces[tet as usize][opposite]) {
                continue;
            }
            let corners = self.face(tet, opposite).map(|q| self.points[q as usize]);
            if let Some(center) = circumcenter(corners)
                && squared_distance(center, point.at) < squared_distance(center, corners[0])
            {
                return Err(Refusal::NearKeptFace(face));
            }
        }
        Ok(())
    }

    /// Replaces the tetrahedra of the cavity by those between the point and the rim. Returns the number of
    /// the point.
    fn fill(&mut self, point: &Insertion, cavity: &Cavity) -> u32 {
        let v = self.points.len() as u32;
        self.points.push(point.at);
        self.facets_of_point.push(point.facets.to_vec());
        self.point_stamps.push(0);
        self.tet_of_point.push(0);
        let outline = self.kept_outline(point, cavity);
        self.new_tets.clear();
        let mut sides: Vec<([u32; 2], TetFace)> = Vec::with_capacity(3 * cavity.rim.len());
        for &TetFace { tet: old, opposite } in &cavity.rim {
            let [a, b, c] = self.face(old, opposite);
            let neighbour = self.neighbours[old as usize][opposite];
            let kept_face = self.kept_faces[old as usize][opposite];
            let region = self.regions[old as usize];
            let new = self.slot();
            let slot = new as usize;
            self.tets[slot] = [a, b, c, v];
            self.neighbours[slot][3] = neighbour;
            self.kept_faces[slot][3] = kept_face;
            self.regions[slot] = region;
            if let Some(n) = neighbour.get() {
                let back = self.neighbours[n as usize].iter().position(|&x| x == OptionalIndex::some(old));
                if let Some(back) = back {
                    self.neighbours[n as usize][back] = OptionalIndex::some(new);
                }
            }
            for q in [a, b, c, v] {
                self.tet_of_point[q as usize] = new;
            }
            for (k, edge) in [(0, sorted(b, c)), (1, sorted(a, c)), (2, sorted(a, b))] {
                sides.push((edge, TetFace { tet: new, opposite: k }));
                if let Some(&(_, facet)) = outline.iter().find(|e| e.0 == edge) {
                    self.kept_faces[slot][k] = facet;
                }
            }
            self.new_tets.push(new);
        }
        sides.sort_unstable_by_key(|&(edge, side)| (edge, side.tet, side.opposite));
        for pair in sides.windows(2) {
            if pair[0].0 == pair[1].0 {
                let (one, other) = (pair[0].1, pair[1].1);
                self.neighbours[one.tet as usize][one.opposite] = OptionalIndex::some(other.tet);
                self.neighbours[other.tet as usize][other.opposite] = OptionalIndex::some(one.tet);
            }
        }
        for &t in &cavity.tets {
            self.alive[t as usize] = false;
            self.free.push(t);
        }
        v
    }

    /// The outline of the kept faces that the cavity removes from the facets of the point: edges of one such
    /// face only, each with its facet. New faces between these edges and the point take the place of the
    /// removed ones.
    fn kept_outline(&self, point: &Insertion, cavity: &Cavity) -> Vec<([u32; 2], OptionalIndex)> {
        let mut outline: Vec<([u32; 2], OptionalIndex)> = Vec::new();
        for &t in &cavity.tets {
            for i in 0..4 {
                let kept = self.kept_faces[t as usize][i];
                let on_facet = kept.get().is_some_and(|facet| point.facets.contains(&facet));
                let first = self.neighbour(t, i).is_none_or(|n| t < n);
                if !on_facet || !first || cavity.rim.contains(&TetFace { tet: t, opposite: i }) {
                    continue;
                }
                let face = self.face(t, i);
                for k in 0..3 {
                    let edge = (sorted(face[k], face[(k + 1) % 3]), kept);
                    if let Some(twin) = outline.iter().position(|&e| e == edge) {
                        outline.swap_remove(twin);
                    } else {
                        outline.push(edge);
                    }
                }
            }
        }
        outline
    }
}

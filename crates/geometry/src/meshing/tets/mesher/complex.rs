//! What a mesh has to keep: points, straight segments and flat facets.

use super::delaunay::sorted;
use super::{MeshError, meet};
use crate::scene::Box3;
use elastocap_linalg::vector::{cross, dot, minus};
use std::collections::{BTreeMap, BTreeSet, HashMap};

type P = [f64; 3];

/// A flat part of a surface: polygons in one plane.
#[derive(Debug)]
pub(super) struct Facet {
    /// The axis it is normal to, and where, if it is normal to one.
    pub(super) plane: Option<(usize, f64)>,
    origin: P,
    directions: [P; 2],
    normal: P,
    pub(super) polygons: Vec<Vec<[f64; 2]>>,
    /// The body that each polygon is of, counted through those of the complex.
    pub(super) owners: Vec<u32>,
    /// Sheets of no thickness in it: the conductor and its polygon.
    pub(super) sheets: Vec<(u32, usize)>,
}

/// Whether a point lies in a polygon. Polygons that share an edge share no point and lose none: an edge is taken from its lower
/// end up, whichever way it is passed, so that rounding puts a point on the same side of it for both.
pub(super) fn in_polygon(polygon: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut inside = false;
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        if (a[1] > p[1]) != (b[1] > p[1]) {
            let [low, high] = if a[1] < b[1] { [a, b] } else { [b, a] };
            if p[0] < low[0] + (high[0] - low[0]) * (p[1] - low[1]) / (high[1] - low[1]) {
                inside = !inside;
            }
        }
    }
    inside
}

impl Facet {
    /// Coordinates within the plane.
    pub(super) fn flat(&self, p: P) -> [f64; 2] {
        let d = [0, 1, 2].map(|k| p[k] - self.origin[k]);
        self.directions.map(|u| dot(u, d))
    }

    /// The point of the plane with these coordinates.
    pub(super) fn raise(&self, q: [f64; 2]) -> P {
        let [u, v] = self.directions;
        let mut p = [0, 1, 2].map(|k| self.origin[k] + q[0] * u[k] + q[1] * v[k]);
        if let Some((axis, at)) = self.plane {
            p[axis] = at;
        }
        p
    }

    /// The distance of a point from the plane, negative on one side of it.
    pub(super) fn height(&self, p: P) -> f64 {
        match self.plane {
            Some((axis, at)) => p[axis] - at,
            None => dot(self.normal, minus(p, self.origin)),
        }
    }

    /// Whether a point of the plane lies in one of the polygons.
    pub(super) fn holds(&self, p: P) -> bool {
        let q = self.flat(p);
        self.polygons.iter().any(|polygon| in_polygon(polygon, q))
    }

    /// The sheet a point of the plane lies on.
    pub(super) fn sheet(&self, p: P) -> Option<u32> {
        let q = self.flat(p);
        self.sheets.iter().find(|s| in_polygon(&self.polygons[s.1], q)).map(|s| s.0)
    }
}

/// Whose surface something is: a part of a body.
#[derive(Debug)]
pub(super) struct Owner {
    /// Of the body.
    pub(super) name: String,
    /// The conductor that it is a part of.
    pub(super) conductor: Option<u32>,
    pub(super) ball: bool,
}

/// Points, segments, facets.
#[derive(Debug, Default)]
pub(super) struct Complex {
    pub(super) bodies: Vec<Owner>,
    pub(super) points: Vec<P>,
    /// The facets each point is on.
    pub(super) on: Vec<Vec<u32>>,
    /// The size of elements wanted at each point, m.
    pub(super) sizes: Vec<f64>,
    pub(super) facets: Vec<Facet>,
    /// Ends, and the facets each segment is on.
    pub(super) segments: BTreeMap<[u32; 2], Vec<u32>>,
    /// Pairs of owners whose surfaces cross.
    pub(super) crossed: BTreeSet<[u32; 2]>,
    /// Points inside bodies, to start from.
    pub(super) seeds: Vec<(P, f64)>,
    planes: HashMap<(usize, u64), u32>,
    known: HashMap<[u64; 3], u32>,
}

impl Complex {
    /// The number of the point; points at the same place are one.
    pub(super) fn point(&mut self, p: P, size: f64) -> u32 {
        let p = p.map(|x| x + 0.0);
        let next = self.points.len() as u32;
        let index = *self.known.entry(p.map(f64::to_bits)).or_insert(next);
        if index == next {
            self.points.push(p);
            self.on.push(Vec::new());
            self.sizes.push(size);
        }
        let own = &mut self.sizes[index as usize];
        *own = own.min(size);
        index
    }

    /// The facet of a whole plane normal to an axis.
    pub(super) fn plane(&mut self, axis: usize, at: f64) -> u32 {
        let next = self.facets.len() as u32;
        let index = *self.planes.entry((axis, (at + 0.0).to_bits())).or_insert(next);
        if index == next {
            let mut origin = [0.0; 3];
            origin[axis] = at;
            let mut directions = [[0.0; 3]; 2];
            directions[0][(axis + 1) % 3] = 1.0;
            directions[1][(axis + 2) % 3] = 1.0;
            let plane = Some((axis, at));
            self.facets.push(Facet {
                plane,
                origin,
                normal: cross(directions[0], directions[1]),
                directions,
                polygons: Vec::new(),
                owners: Vec::new(),
                sheets: Vec::new(),
            });
        }
        index
    }

    /// The facet through these points: that of their plane if it is normal to an axis, else a new one.
    pub(super) fn facet(&mut self, corners: &[P]) -> Option<u32> {
        let at = |k: usize| corners[k];
        for axis in 0..3 {
            if (1..corners.len()).all(|k| at(k)[axis] == at(0)[axis]) {
                let coordinate = at(0)[axis];
                return Some(self.plane(axis, coordinate));
            }
        }
        let (u, w) = (minus(at(1), at(0)), minus(at(2), at(0)));
        let length = dot(u, u).sqrt();
        let u = u.map(|x| x / length);
        let along = dot(u, w);
        let v = [0, 1, 2].map(|k| w[k] - along * u[k]);
        let across = dot(v, v).sqrt();
        let v = v.map(|x| x / across);
        if !(length > 0.0 && across > 0.0 && dot(v, v).is_finite()) {
            return None;
        }
        self.facets.push(Facet {
            plane: None,
            origin: at(0),
            directions: [u, v],
            normal: cross(u, v),
            polygons: Vec::new(),
            owners: Vec::new(),
            sheets: Vec::new(),
        });
        Some(self.facets.len() as u32 - 1)
    }

    /// Says that a point is on a facet.
    pub(super) fn touch(&mut self, point: u32, facet: u32) {
        let on = &mut self.on[point as usize];
        if !on.contains(&facet) {
            on.push(facet);
        }
    }

    /// Adds a polygon of a body whose corners need not be points of the mesh. The first three span its plane best.
    pub(super) fn area(&mut self, facet: u32, corners: &[P], owner: u32) {
        let facet = &mut self.facets[facet as usize];
        let mut polygon: Vec<[f64; 2]> = corners.iter().map(|&p| facet.flat(p)).collect();
        let n = polygon.len();
        let wide = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| polygon[(k + i) % n]);
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
        };
        let first = (1..n).fold(0, |best, k| if wide(k) > wide(best) { k } else { best });
        polygon.rotate_left(first);
        facet.polygons.push(polygon);
        facet.owners.push(owner);
    }

    /// Adds a segment of a facet.
    pub(super) fn segment(&mut self, a: u32, b: u32, facet: u32) {
        self.touch(a, facet);
        self.touch(b, facet);
        let facets = self.segments.entry(sorted(a, b)).or_default();
        if !facets.contains(&facet) {
            facets.push(facet);
        }
    }

    /// Finds what touches or crosses without having been said to, and refuses conductors that do. The walls are whole sides of `domain`.
    pub(super) fn close(&mut self, domain: &Box3) -> Result<(), MeshError> {
        let wall = |plane: Option<(usize, f64)>| {
            plane.is_some_and(|(axis, at)| at == domain.min[axis] || at == domain.max[axis])
        };
        for p in 0..self.points.len() {
            for axis in 0..3 {
                let at = self.points[p];
                let Some(&f) = self.planes.get(&(axis, at[axis].to_bits())) else { continue };
                let facet = &self.facets[f as usize];
                if wall(facet.plane) || facet.holds(at) {
                    self.touch(p as u32, f);
                }
            }
        }
        self.part();
        let edges: Vec<[u32; 2]> = self.segments.keys().copied().collect();
        for [a, b] in edges {
            let common: Vec<u32> = self.on[a as usize]
                .iter()
                .copied()
                .filter(|f| {
                    let facet = &self.facets[*f as usize];
                    let [p, q] = [a, b].map(|i| self.points[i as usize]);
                    self.on[b as usize].contains(f)
                        && facet.plane.is_some()
                        && (wall(facet.plane) || facet.holds([0, 1, 2].map(|k| 0.5 * (p[k] + q[k]))))
                })
                .collect();
            for f in common {
                self.segment(a, b, f);
            }
        }
        meet::resolve(self)
    }

    /// Cuts segments along an axis at the points on them.
    fn part(&mut self) {
        let line = |p: P, axis: usize| (axis, p[(axis + 1) % 3].to_bits(), p[(axis + 2) % 3].to_bits());
        let mut lines: HashMap<(usize, u64, u64), Vec<u32>> = HashMap::new();
        for (k, &p) in self.points.iter().enumerate() {
            (0..3).for_each(|axis| lines.entry(line(p, axis)).or_default().push(k as u32));
        }
        for ([a, b], facets) in std::mem::take(&mut self.segments) {
            let [p, q] = [a, b].map(|i| self.points[i as usize]);
            let mut chain = vec![a, b];
            if let Some(axis) = (0..3).find(|&k| line(p, k) == line(q, k)) {
                let along = |i: &u32| self.points[*i as usize][axis];
                let [low, high] = [p[axis].min(q[axis]), p[axis].max(q[axis])];
                let all = lines.get(&line(p, axis)).map_or(&[][..], |all| all);
                chain.extend(all.iter().filter(|i| low < along(i) && along(i) < high));
                chain.sort_by(|i, j| along(i).total_cmp(&along(j)));
            }
            for pair in chain.windows(2) {
                facets.iter().for_each(|&f| self.segment(pair[0], pair[1], f));
            }
        }
    }
}

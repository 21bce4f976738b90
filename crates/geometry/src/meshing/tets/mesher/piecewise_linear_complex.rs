//! The piecewise linear complex that a mesh has to contain: points, straight segments and flat facets.

use super::Point;
use super::delaunay::sorted;
use crate::outline;
use crate::scene::Box3;
use elastocap_linalg::vector::{cross, dot, minus};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A plane normal to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisPlane {
    /// The axis, 0 to 2.
    pub(super) axis: usize,
    /// The coordinate along the axis, m.
    pub(super) at: f64,
}

impl AxisPlane {
    /// Whether the plane contains one of the sides of a box.
    pub(super) fn is_side_of(self, b: &Box3) -> bool {
        self.at == b.min[self.axis] || self.at == b.max[self.axis]
    }
}

/// A polygon of a facet.
#[derive(Debug)]
pub(super) struct Polygon {
    /// Corners in coordinates of the facet, m.
    pub(super) corners: Vec<[f64; 2]>,
    /// The part of a body whose surface the polygon belongs to; `None` for walls, and where it does not
    /// matter any more.
    pub(super) part: Option<u32>,
}

/// A polygon that a sheet of no thickness covers.
#[derive(Debug)]
pub(super) struct Sheet {
    /// The conductor that the sheet is.
    pub(super) conductor: u32,
    /// The index of the polygon among those of the facet.
    pub(super) polygon: usize,
}

/// A flat part of a surface: polygons in one plane.
#[derive(Debug)]
pub(super) struct Facet {
    /// The plane of the facet, if it is normal to an axis. Points of the facet then have exactly this
    /// coordinate.
    pub(super) plane: Option<AxisPlane>,
    /// The point of the plane with the coordinates zero, m.
    origin: Point,
    /// Two orthonormal directions within the plane.
    directions: [Point; 2],
    /// The unit vector normal to the plane.
    normal: Point,
    /// The polygons that make up the facet.
    pub(super) polygons: Vec<Polygon>,
    /// The polygons that sheets cover.
    pub(super) sheets: Vec<Sheet>,
}

impl Facet {
    /// The coordinates, within the plane, of a point's projection to it, m.
    pub(super) fn project(&self, p: Point) -> [f64; 2] {
        let d = [0, 1, 2].map(|k| p[k] - self.origin[k]);
        self.directions.map(|u| dot(u, d))
    }

    /// The point of the plane with these coordinates.
    pub(super) fn point(&self, q: [f64; 2]) -> Point {
        let [u, v] = self.directions;
        let mut p = [0, 1, 2].map(|k| self.origin[k] + q[0] * u[k] + q[1] * v[k]);
        if let Some(AxisPlane { axis, at }) = self.plane {
            p[axis] = at;
        }
        p
    }

    /// The point of the plane nearest to another point.
    pub(super) fn nearest(&self, p: Point) -> Point {
        self.point(self.project(p))
    }

    /// The distance of a point from the plane, m, negative on one side of it.
    pub(super) fn height(&self, p: Point) -> f64 {
        match self.plane {
            Some(AxisPlane { axis, at }) => p[axis] - at,
            None => dot(self.normal, minus(p, self.origin)),
        }
    }

    /// Whether a point of the plane lies in one of the polygons.
    pub(super) fn contains(&self, p: Point) -> bool {
        self.contains_projected(self.project(p))
    }

    /// Whether a point with these coordinates within the plane lies in one of the polygons.
    pub(super) fn contains_projected(&self, q: [f64; 2]) -> bool {
        self.polygons.iter().any(|polygon| outline::contains(&polygon.corners, q))
    }

    /// The conductor of the sheet on which a point of the plane lies.
    pub(super) fn sheet(&self, p: Point) -> Option<u32> {
        let q = self.project(p);
        let covers = |s: &&Sheet| outline::contains(&self.polygons[s.polygon].corners, q);
        self.sheets.iter().find(covers).map(|s| s.conductor)
    }
}

/// The data of a part of a body whose surface is in the complex.
#[derive(Debug)]
pub(super) struct PartInfo {
    /// The name of the body.
    pub(super) name: String,
    /// The conductor that the part belongs to; `None` for a dielectric.
    pub(super) conductor: Option<u32>,
    /// Whether a sphere bounds the part.
    pub(super) ball: bool,
}

/// A point inside a body at which the mesh gets a point too.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    /// The position of the point, m.
    pub(super) at: Point,
    /// The element size wanted there, m.
    pub(super) size: f64,
}

/// Points, segments and facets of all surfaces.
#[derive(Debug, Default)]
pub(super) struct PiecewiseLinearComplex {
    /// All parts of bodies: those of conductors first, then those of dielectrics.
    pub(super) parts: Vec<PartInfo>,
    /// Positions, m.
    pub(super) points: Vec<Point>,
    /// The facets on which each point lies.
    pub(super) facets_of_point: Vec<Vec<u32>>,
    /// The element size wanted at each point, m.
    pub(super) sizes: Vec<f64>,
    /// All facets.
    pub(super) facets: Vec<Facet>,
    /// The facets on which each segment lies, by its ends in ascending order.
    pub(super) segments: BTreeMap<[u32; 2], Vec<u32>>,
    /// Whether any two surfaces cross, walls included.
    pub(super) surfaces_cross: bool,
    /// Pairs of parts whose surfaces cross, each in ascending order.
    pub(super) crossing_parts: BTreeSet<[u32; 2]>,
    /// Points inside bodies at which the mesh gets points.
    pub(super) seeds: Vec<Seed>,
    /// Facets normal to an axis, by the axis and the bits of their coordinate.
    planes: HashMap<(usize, u64), u32>,
    /// Points by the bits of their coordinates.
    known: HashMap<[u64; 3], u32>,
}

impl PiecewiseLinearComplex {
    /// The number of the point at this place, which is added if there is none. The smallest of the sizes
    /// given for it counts.
    pub(super) fn point(&mut self, p: Point, size: f64) -> u32 {
        // Minus zero and zero are the same place.
        let p = p.map(|x| x + 0.0);
        let next = self.points.len() as u32;
        let index = *self.known.entry(p.map(f64::to_bits)).or_insert(next);
        if index == next {
            self.points.push(p);
            self.facets_of_point.push(Vec::new());
            self.sizes.push(size);
        }
        let point_size = &mut self.sizes[index as usize];
        *point_size = point_size.min(size);
        index
    }

    /// The facet in a plane normal to an axis, which is added if there is none.
    pub(super) fn plane(&mut self, axis: usize, at: f64) -> u32 {
        let next = self.facets.len() as u32;
        let index = *self.planes.entry((axis, (at + 0.0).to_bits())).or_insert(next);
        if index == next {
            let mut origin = [0.0; 3];
            origin[axis] = at;
            let mut directions = [[0.0; 3]; 2];
            directions[0][(axis + 1) % 3] = 1.0;
            directions[1][(axis + 2) % 3] = 1.0;
            self.facets.push(Facet {
                plane: Some(AxisPlane { axis, at }),
                origin,
                normal: cross(directions[0], directions[1]),
                directions,
                polygons: Vec::new(),
                sheets: Vec::new(),
            });
        }
        index
    }

    /// A facet through these points: that of their plane if it is normal to an axis, else a new one through
    /// the first three. `None` if these three span no plane.
    pub(super) fn facet(&mut self, corners: &[Point]) -> Option<u32> {
        for axis in 0..3 {
            if (1..corners.len()).all(|k| corners[k][axis] == corners[0][axis]) {
                let coordinate = corners[0][axis];
                return Some(self.plane(axis, coordinate));
            }
        }
        let (u, w) = (minus(corners[1], corners[0]), minus(corners[2], corners[0]));
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
            origin: corners[0],
            directions: [u, v],
            normal: cross(u, v),
            polygons: Vec::new(),
            sheets: Vec::new(),
        });
        Some(self.facets.len() as u32 - 1)
    }

    /// Records that a point lies on a facet.
    pub(super) fn put_on_facet(&mut self, point: u32, facet: u32) {
        let facets = &mut self.facets_of_point[point as usize];
        if !facets.contains(&facet) {
            facets.push(facet);
        }
    }

    /// Adds a polygon to a facet and returns its index there. Its corners need not be points of the complex.
    /// They are listed from that corner on with which the first three span its plane best.
    pub(super) fn add_polygon(&mut self, facet: u32, corners: &[Point], part: Option<u32>) -> usize {
        let facet = &mut self.facets[facet as usize];
        let mut polygon: Vec<[f64; 2]> = corners.iter().map(|&p| facet.project(p)).collect();
        let n = polygon.len();
        let twice_area = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| polygon[(k + i) % n]);
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
        };
        let first = (1..n).fold(0, |best, k| if twice_area(k) > twice_area(best) { k } else { best });
        polygon.rotate_left(first);
        facet.polygons.push(Polygon { corners: polygon, part });
        facet.polygons.len() - 1
    }

    /// Adds a segment of a facet.
    pub(super) fn add_segment(&mut self, a: u32, b: u32, facet: u32) {
        self.put_on_facet(a, facet);
        self.put_on_facet(b, facet);
        let facets = self.segments.entry(sorted(a, b)).or_default();
        if !facets.contains(&facet) {
            facets.push(facet);
        }
    }

    /// The points on each facet, ascending.
    pub(super) fn points_of_facets(&self) -> Vec<Vec<u32>> {
        let mut out: Vec<Vec<u32>> = vec![Vec::new(); self.facets.len()];
        for (p, facets) in (0..).zip(&self.facets_of_point) {
            facets.iter().for_each(|&f| out[f as usize].push(p));
        }
        out
    }

    /// Puts points and segments on the facets normal to an axis in whose polygons they lie exactly, or in
    /// whose plane if it is a wall, a side of `domain`. Segments along an axis are divided at the points on
    /// them.
    pub(super) fn join_to_planes(&mut self, domain: &Box3) {
        let is_wall = |facet: &Facet| facet.plane.is_some_and(|plane| plane.is_side_of(domain));
        for p in 0..self.points.len() {
            for axis in 0..3 {
                let at = self.points[p];
                let Some(&f) = self.planes.get(&(axis, at[axis].to_bits())) else { continue };
                let facet = &self.facets[f as usize];
                if is_wall(facet) || facet.contains(at) {
                    self.put_on_facet(p as u32, f);
                }
            }
        }
        self.divide_axis_segments();
        let edges: Vec<[u32; 2]> = self.segments.keys().copied().collect();
        for [a, b] in edges {
            let common: Vec<u32> = self.facets_of_point[a as usize]
                .iter()
                .copied()
                .filter(|f| {
                    let facet = &self.facets[*f as usize];
                    let [p, q] = [a, b].map(|i| self.points[i as usize]);
                    self.facets_of_point[b as usize].contains(f)
                        && facet.plane.is_some()
                        && (is_wall(facet) || facet.contains([0, 1, 2].map(|k| 0.5 * (p[k] + q[k]))))
                })
                .collect();
            for f in common {
                self.add_segment(a, b, f);
            }
        }
    }

    /// Divides segments along an axis at the points on them.
    fn divide_axis_segments(&mut self) {
        let line = |p: Point, axis: usize| (axis, p[(axis + 1) % 3].to_bits(), p[(axis + 2) % 3].to_bits());
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
                let on_line = lines.get(&line(p, axis)).map_or(&[][..], |points| points);
                chain.extend(on_line.iter().filter(|i| low < along(i) && along(i) < high));
                chain.sort_by(|i, j| along(i).total_cmp(&along(j)));
            }
            for pair in chain.windows(2) {
                facets.iter().for_each(|&f| self.add_segment(pair[0], pair[1], f));
            }
        }
    }
}

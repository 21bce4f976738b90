//! Joins facets that lie in one plane, so that their overlap does not count as a crossing.

use super::{Intersections, Point, PolygonId};

impl Intersections<'_> {
    /// Joins facets of different parts of bodies that touch and lie in one plane, unless this is normal to an
    /// axis: facets in such a plane are one already.
    pub(super) fn join_coplanar_facets(&mut self) {
        let mut root: Vec<u32> = (0..self.complex.facets.len() as u32).collect();
        fn find(root: &mut [u32], mut f: u32) -> u32 {
            while root[f as usize] != f {
                root[f as usize] = root[root[f as usize] as usize];
                f = root[f as usize];
            }
            f
        }
        for k in 0..self.polygons.len() {
            let PolygonId { facet: f, polygon: i } = self.polygons[k];
            let facet = &self.complex.facets[f as usize];
            if facet.plane.is_some() {
                continue;
            }
            let corners: Vec<Point> = facet.polygons[i].corners.iter().map(|&q| facet.point(q)).collect();
            let part = facet.polygons[i].part;
            for PolygonId { facet: g, polygon: j } in self.candidates(&corners) {
                let (facet, other) = (&self.complex.facets[f as usize], &self.complex.facets[g as usize]);
                if g <= f || other.plane.is_some() || other.polygons[j].part == part {
                    continue;
                }
                let theirs = other.polygons[j].corners.iter().map(|&q| other.point(q));
                let coplanar = corners.iter().all(|&p| other.height(p).abs() <= self.near)
                    && theirs.into_iter().all(|p| facet.height(p).abs() <= self.near);
                if coplanar {
                    let (a, b) = (find(&mut root, f), find(&mut root, g));
                    root[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let root: Vec<u32> = (0..root.len() as u32).map(|f| find(&mut root, f)).collect();
        if root.iter().enumerate().all(|(f, &r)| f as u32 == r) {
            return;
        }
        for f in 0..root.len() {
            let to = root[f] as usize;
            if to != f {
                for polygon in std::mem::take(&mut self.complex.facets[f].polygons) {
                    let facet = &self.complex.facets[f];
                    let corners: Vec<Point> = polygon.corners.iter().map(|&q| facet.point(q)).collect();
                    self.complex.add_polygon(to as u32, &corners, polygon.part);
                }
            }
        }
        let rename = |list: &mut Vec<u32>| {
            list.iter_mut().for_each(|f| *f = root[*f as usize]);
            list.sort_unstable();
            list.dedup();
        };
        self.complex.facets_of_point.iter_mut().for_each(rename);
        self.complex.segments.values_mut().for_each(rename);
        self.index_polygons();
    }
}

//! Points where tetrahedra are too large or too long (Delaunay refinement: Ruppert, Shewchuk).

use super::Sizing;
use super::conform::Work;
use super::delaunay::{Refusal, circumcenter, sorted, sphere_center};
use std::collections::VecDeque;

type P = [f64; 3];

fn distance(a: P, b: P) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

impl Work {
    fn size_at(&self, p: P, points: &[u32], growth: f64) -> f64 {
        points.iter().fold(f64::INFINITY, |size, &q| {
            size.min(self.sizes[q as usize] + growth * distance(p, self.mesh.points[q as usize]))
        })
    }

    /// The middle of the sphere around a tetrahedron, if that needs a point.
    fn bad(&self, t: u32, sizing: &Sizing) -> Option<P> {
        if !self.mesh.alive(t) || self.mesh.regions[t as usize] < 0 {
            return None;
        }
        let corners = self.mesh.corners(t);
        let center = sphere_center(corners);
        let radius = distance(center, corners[0]);
        if !radius.is_finite() {
            return None;
        }
        let ids = self.mesh.tets[t as usize];
        let size = ids.iter().fold(f64::INFINITY, |s, &q| s.min(self.sizes[q as usize]));
        let mut shortest = f64::INFINITY;
        for i in 0..4 {
            for j in 0..i {
                shortest = shortest.min(distance(corners[i], corners[j]));
            }
        }
        let large = radius > size + sizing.growth * radius;
        let long = radius > sizing.radius_to_edge * shortest && radius > 0.05 * size;
        (large || long).then_some(center)
    }

    /// Refines until sizes and shapes are met; `false` if the limit on points came first.
    pub(super) fn refine(&mut self, sizing: &Sizing) -> bool {
        let mut queue: VecDeque<u32> = (0..self.mesh.tets.len() as u32).collect();
        while let Some(t) = queue.pop_front() {
            let Some(center) = self.bad(t, sizing) else { continue };
            if self.mesh.points.len() >= sizing.most_points {
                return false;
            }
            let before = self.mesh.points.len();
            let ids = self.mesh.tets[t as usize];
            match self.mesh.insert(center, t, &[], None, false, true) {
                Ok(_) => self.sizes.push(self.size_at(center, &ids, sizing.growth)),
                Err(Refusal::Behind(n, i) | Refusal::Near(n, i)) => self.split_face(n, i, sizing),
                Err(Refusal::Edge(a, b)) => self.split_edge([a, b], sizing),
                Err(Refusal::Outside | Refusal::Known(_) | Refusal::Shape) => {}
            }
            if self.mesh.points.len() > before {
                queue.extend(&self.mesh.fresh);
                if self.mesh.tets[t as usize] == ids {
                    queue.push_back(t);
                }
            }
        }
        true
    }

    fn split_face(&mut self, t: u32, i: usize, sizing: &Sizing) {
        let ids = self.mesh.face(t, i);
        let corners = ids.map(|p| self.mesh.points[p as usize]);
        let Some(f) = self.mesh.walls[t as usize][i].checked_sub(1) else { return };
        let Some(center) = circumcenter(corners) else { return };
        let size = ids.iter().fold(f64::INFINITY, |s, &q| s.min(self.sizes[q as usize]));
        if distance(center, corners[0]) < 0.25 * size {
            return;
        }
        let facet = &self.complex.facets[f as usize];
        let center = facet.raise(facet.flat(center));
        match self.mesh.insert(center, t, &[f], None, true, true) {
            Ok(_) => self.sizes.push(self.size_at(center, &ids, sizing.growth)),
            Err(Refusal::Edge(a, b)) => self.split_edge([a, b], sizing),
            // The middle lies beyond an edge of the facet.
            Err(Refusal::Behind(..) | Refusal::Outside) => {
                let longest = [[0, 1], [1, 2], [2, 0]]
                    .map(|[a, b]| sorted(ids[a], ids[b]))
                    .into_iter()
                    .filter(|e| self.mesh.kept.contains_key(e))
                    .max_by(|a, b| self.length(*a).total_cmp(&self.length(*b)));
                if let Some(edge) = longest {
                    self.split_edge(edge, sizing);
                }
            }
            Err(_) => {}
        }
    }

    fn length(&self, ends: [u32; 2]) -> f64 {
        distance(self.mesh.points[ends[0] as usize], self.mesh.points[ends[1] as usize])
    }

    fn split_edge(&mut self, [a, b]: [u32; 2], sizing: &Sizing) {
        let Some(&segment) = self.mesh.kept.get(&[a, b]) else { return };
        let size = self.sizes[a as usize].min(self.sizes[b as usize]);
        if self.length([a, b]) < 0.5 * size {
            return;
        }
        let p = self.cut([a, b]);
        let own = self.segments[segment as usize].clone();
        let star = self.mesh.star(a);
        let Some(&hint) = star.iter().find(|&&t| self.mesh.tets[t as usize].contains(&b)) else { return };
        if let Ok(v) = self.mesh.insert(p, hint, &own, Some(segment), true, false) {
            self.sizes.push(self.size_at(p, &[a, b], sizing.growth));
            self.mesh.kept.remove(&[a, b]);
            self.mesh.kept.insert(sorted(a, v), segment);
            self.mesh.kept.insert(sorted(v, b), segment);
        }
    }
}

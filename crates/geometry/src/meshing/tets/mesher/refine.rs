//! Points where tetrahedra are too large or too long (Delaunay refinement: Ruppert, Shewchuk).

use super::Sizing;
use super::conform::Work;
use super::delaunay::{EDGES, NONE, Refusal, circumcenter, sorted, sphere_center};
use elastocap_linalg::vector::{length, minus};
use std::collections::VecDeque;

type P = [f64; 3];

fn distance(a: P, b: P) -> f64 {
    length(minus(a, b))
}

/// 1 for a regular tetrahedron, 0 for a flat one: volume over the third power of the root mean square of the edges.
pub(super) fn roundness(corners: [P; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let squares: f64 = EDGES.iter().map(|&[i, j]| distance(corners[i], corners[j]).powi(2)).sum();
    crate::meshing::tets::determinant(a, b, c, d) * 2.0_f64.sqrt() / (squares / 6.0).powf(1.5)
}

impl Work {
    /// Gives tetrahedra that are still flat a point of their own near their middle, whatever is near.
    ///
    /// # Errors
    ///
    /// A corner of a tetrahedron that stays without a volume.
    pub(super) fn unflatten(&mut self, sizing: &Sizing) -> Result<(), P> {
        for round in 0..6 {
            let mut left = None;
            let before = self.mesh.points.len();
            for t in 0..self.mesh.tets.len() as u32 {
                if !self.mesh.alive(t) || self.mesh.regions[t as usize] < 0 {
                    continue;
                }
                let corners = self.mesh.corners(t);
                let round_enough = roundness(corners);
                if round_enough > 0.01 {
                    continue;
                }
                if round_enough < 1e-10 {
                    left = Some(corners[0]);
                }
                if round == 5 {
                    continue;
                }
                let ids = self.mesh.tets[t as usize];
                // Not quite the middle, and another place each time.
                let weights = [0, 1, 2, 3].map(|k| 1.0 + 0.1 * f64::from((k + round) % 4));
                let sum: f64 = weights.iter().sum();
                let middle = [0, 1, 2].map(|a| (0..4).map(|k| weights[k] * corners[k][a]).sum::<f64>() / sum);
                // Where faces to be kept leave no room for rounder ones it stays as it is.
                self.mesh.least = round_enough;
                if self.mesh.insert(middle, t, &[], None, false, false).is_ok() {
                    self.sizes.push(self.size_at(middle, &ids, sizing.growth));
                }
                self.mesh.least = f64::NEG_INFINITY;
            }
            if round == 5 || self.mesh.points.len() == before {
                return left.map_or(Ok(()), Err);
            }
            self.smooth();
        }
        Ok(())
    }

    /// Moves points that lie on no facet to where the flattest tetrahedron at them is rounder.
    pub(super) fn smooth(&mut self) {
        for round in 0..4 {
            for v in 8..self.mesh.points.len() as u32 {
                let t = self.mesh.at(v);
                if !self.mesh.on[v as usize].is_empty() || self.mesh.regions[t as usize] < 0 {
                    continue;
                }
                let star = self.mesh.star(v);
                let worst =
                    star.iter().map(|&t| roundness(self.mesh.corners(t))).fold(f64::INFINITY, f64::min);
                if worst > 0.3 {
                    continue;
                }
                let at = self.mesh.points[v as usize];
                let others: Vec<P> = star
                    .iter()
                    .flat_map(|&t| self.mesh.tets[t as usize])
                    .filter(|&q| q != v)
                    .map(|q| self.mesh.points[q as usize])
                    .collect();
                let n = others.len() as f64;
                let middle = [0, 1, 2].map(|k| others.iter().map(|q| q[k]).sum::<f64>() / n - at[k]);
                let reach = others.iter().map(|&q| distance(q, at)).fold(f64::INFINITY, f64::min);
                let mut offsets = vec![middle, middle.map(|x| 0.5 * x)];
                let step = reach * [0.3, 0.2, 0.1, 0.05][round];
                for k in 0..3 {
                    for l in 0..3 {
                        for s in [-step, step] {
                            let mut d = [0.0; 3];
                            d[k] += s;
                            d[l] += step;
                            offsets.push(d);
                            offsets.push(d.map(|x| -x));
                        }
                    }
                }
                self.mesh.improve(v, roundness, &offsets);
            }
        }
    }

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
        let ids = self.mesh.tets[t as usize];
        let size = ids.iter().fold(f64::INFINITY, |s, &q| s.min(self.sizes[q as usize]));
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        for i in 0..4 {
            for j in 0..i {
                shortest = shortest.min(distance(corners[i], corners[j]));
                longest = longest.max(distance(corners[i], corners[j]));
            }
        }
        // Four points nearly in a plane: the middle of their sphere is anywhere.
        if !radius.is_finite() || radius >= 100.0 * longest {
            let middle = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            return (longest > 0.5 * size).then_some(middle);
        }
        let flat = roundness(corners) < 0.05 && radius > 0.4 * size;
        let large = radius > size + sizing.growth * radius;
        let long = radius > sizing.radius_to_edge * shortest && radius > 0.05 * size;
        (large || long || flat).then_some(center)
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
            self.mesh.doomed = t;
            let taken = self.mesh.insert(center, t, &[], None, false, true);
            self.mesh.doomed = NONE;
            match taken {
                Ok(_) => self.sizes.push(self.size_at(center, &ids, sizing.growth)),
                Err(Refusal::Far) => {
                    if let Some((n, i)) = self.mesh.wall_before(t, center) {
                        self.split_face(n, i, sizing);
                    }
                }
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

//! Direct solution with A + lambda M on a part of the plan, for all modes of a line, in the preconditioner
//! and the repair.
//!
//! Both matrices of a triangle are diagonal in its inner unknowns, which are eliminated one by one. The
//! remaining system for corners and sides is factorised for [`LANES`] modes at a time.

use super::inner_unknowns::InnerUnknowns;
use super::local::{Local, Place, combined, entry_or_zero};
use elastocap_fem::tensor::Real;
use elastocap_linalg::lanes::{ABREAST, Elimination, Lane, LaneFactor, Root, vectorized};
use elastocap_linalg::ordering::dissection_order;

/// A form on some corners and sides besides those of the triangles: the energy beyond the frame.
#[derive(Debug, Clone)]
pub(super) struct Beyond {
    /// The corners and sides, as numbered by [`Numbering`].
    pub entities: Vec<u32>,
    /// The part of the form that is added to A, row by row.
    pub a: Vec<f64>,
    /// The part of the form that is added to M, row by row; empty where it is zero.
    pub m: Vec<f64>,
}

/// The numbering of unknowns on a mesh: *entities*, corners or sides with some unknowns each, then the inner
/// ones of the triangles.
#[derive(Debug)]
pub(super) struct Numbering {
    /// The entities of each triangle, in the order of its local matrices.
    pub entities: Vec<Vec<u32>>,
    /// The first row of each entity, and one past the last.
    pub rows: Vec<u32>,
    /// The first inner row of each triangle, and one past the last.
    pub inner_rows: Vec<u32>,
    /// Where each entity is, for the order of elimination.
    pub places: Vec<[f64; 2]>,
}

impl Numbering {
    /// The number of unknowns of an entity.
    pub(super) fn size(&self, entity: u32) -> usize {
        (self.rows[entity as usize + 1] - self.rows[entity as usize]) as usize
    }

    /// The number of all rows.
    pub(super) fn len(&self) -> usize {
        self.inner_rows.last().map_or(0, |r| *r as usize)
    }
}

/// A part of the plan with a weight for each of its triangles.
#[derive(Debug)]
pub(super) struct PlaneSystem {
    elimination: Elimination,
    /// Triangles, each with the root of its weight.
    triangles: Vec<(u32, f64)>,
    /// For each triangle the places of its free unknowns, in its local matrices and among all unknowns.
    places: Vec<Vec<Place>>,
    /// The forms beyond the frame, each with the first unknown of each of its entities; `None` for entities
    /// that are held.
    beyond: Vec<(Beyond, Vec<Option<u32>>)>,
    /// The row of each unknown: those of the skeleton in the order of elimination, then inner ones.
    pub rows: Vec<u32>,
}

impl PlaneSystem {
    /// The system on the triangles with a weight, with the forms `beyond`; `free` says which entities are
    /// unknown.
    pub(super) fn new(
        numbering: &Numbering,
        weights: &[Option<f64>],
        free: impl Fn(u32) -> bool,
        beyond: &[Beyond],
    ) -> Self {
        let triangles: Vec<(u32, f64)> =
            weights.iter().zip(0..).filter_map(|(w, t)| w.map(|w| (t, w.sqrt()))).collect();
        let order = order(numbering, &triangles);
        let mut block = vec![None; numbering.places.len()];
        let mut sizes = Vec::new();
        let mut starts = Vec::new();
        let mut rows: Vec<u32> = Vec::new();
        for entity in order {
            let size = numbering.size(entity);
            if size > 0 && free(entity) {
                block[entity as usize] = Some(sizes.len() as u32);
                sizes.push(size);
                starts.push(rows.len() as u32);
                let first = numbering.rows[entity as usize];
                rows.extend(first..first + size as u32);
            }
        }
        for (t, _) in &triangles {
            rows.extend(numbering.inner_rows[*t as usize]..numbering.inner_rows[*t as usize + 1]);
        }
        let blocks = |entities: &[u32]| entities.iter().map(|e| block[*e as usize]).collect::<Vec<_>>();
        let beyond: Vec<&Beyond> =
            beyond.iter().filter(|b| b.entities.iter().any(|e| block[*e as usize].is_some())).collect();
        let mut groups: Vec<Vec<Option<u32>>> =
            triangles.iter().map(|(t, _)| blocks(&numbering.entities[*t as usize])).collect();
        groups.extend(beyond.iter().map(|b| blocks(&b.entities)));
        let first = |group: &Vec<Option<u32>>| -> Vec<Option<u32>> {
            group.iter().map(|b| b.map(|b| starts[b as usize])).collect()
        };
        let (of_triangles, of_beyond) = groups.split_at(triangles.len());
        let of_triangle = |(group, (t, _)): (&Vec<Option<u32>>, &(u32, f64))| {
            places(&numbering.entities[*t as usize], &first(group), numbering)
        };
        Self {
            elimination: Elimination::new(&sizes, &groups),
            places: of_triangles.iter().zip(&triangles).map(of_triangle).collect(),
            beyond: beyond.into_iter().cloned().zip(of_beyond.iter().map(first)).collect(),
            triangles,
            rows,
        }
    }

    /// Factorises A + lambda M for some modes. `None` if one of the matrices is not positive definite.
    pub(super) fn factorise<T: Real + Root>(
        &self,
        numbering: &Numbering,
        locals: &[Local],
        lambda: &Lane<f64>,
    ) -> Option<LaneFactor<T>> {
        let sizes = |group: u32| -> Vec<usize> {
            let entities = match self.triangles.get(group as usize) {
                Some((t, _)) => &numbering.entities[*t as usize],
                None => &self.beyond[group as usize - self.triangles.len()].0.entities,
            };
            entities.iter().map(|e| numbering.size(*e)).collect()
        };
        let mut coupling: Vec<Lane<f64>> = Vec::new();
        self.elimination.factorise(sizes, |group, out| {
            let Some((t, root)) = self.triangles.get(group as usize) else {
                let (beyond, firsts) = &self.beyond[group as usize - self.triangles.len()];
                let places = places(&beyond.entities, firsts, numbering);
                let n: usize = beyond.entities.iter().map(|e| numbering.size(*e)).sum();
                for (i, _) in &places {
                    for (j, _) in &places {
                        let k = *i as usize * n + *j as usize;
                        out.push(combined(beyond.a[k], entry_or_zero(&beyond.m, k), lambda));
                    }
                }
                return;
            };
            let local = &locals[*t as usize];
            let places = &self.places[group as usize];
            vectorized(|| local.without_inner(places, root * root, lambda, &mut coupling, out));
        })
    }

    /// The couplings of the inner unknowns to the others.
    pub(super) fn inner_unknowns<T: Real>(&self, locals: &[Local]) -> InnerUnknowns<T> {
        InnerUnknowns::new(locals, &self.triangles, &self.places)
    }

    /// Overwrites each of the right-hand sides `vectors`, which have a lane for each unknown, with its
    /// solution.
    pub(super) fn solve<T: Real + Root>(
        &self,
        inner: &InnerUnknowns<T>,
        lambda: &Lane<T>,
        factor: &LaneFactor<T>,
        vectors: &mut [&mut [Lane<T>]],
    ) {
        for batch in vectors.chunks_mut(ABREAST) {
            match batch {
                [a] => self.solve_together(inner, lambda, factor, [&mut **a]),
                [a, b] => self.solve_together(inner, lambda, factor, [&mut **a, &mut **b]),
                [a, b, c] => self.solve_together(inner, lambda, factor, [&mut **a, &mut **b, &mut **c]),
                [a, b, c, d] => {
                    self.solve_together(inner, lambda, factor, [&mut **a, &mut **b, &mut **c, &mut **d]);
                }
                _ => {}
            }
        }
    }

    /// [`PlaneSystem::solve`] for right-hand sides that share one pass over the factors.
    fn solve_together<T: Real + Root, const R: usize>(
        &self,
        couplings: &InnerUnknowns<T>,
        lambda: &Lane<T>,
        factor: &LaneFactor<T>,
        mut vectors: [&mut [Lane<T>]; R],
    ) {
        let unknowns = self.elimination.unknowns();
        couplings.eliminate(&self.places, lambda, unknowns, &mut vectors);
        self.elimination.solve(factor, &mut vectors.each_mut().map(|x| &mut x[..unknowns]));
        couplings.substitute(&self.places, lambda, unknowns, &mut vectors);
    }
}

/// The places of the free unknowns of some entities in a local matrix and among all unknowns, given the first
/// unknown of each.
fn places(entities: &[u32], firsts: &[Option<u32>], numbering: &Numbering) -> Vec<Place> {
    let mut out = Vec::new();
    let mut local = 0;
    for (entity, first) in entities.iter().zip(firsts) {
        let size = numbering.size(*entity);
        if let Some(first) = first {
            out.extend((0..size as u32).map(|k| (local + k, first + k)));
        }
        local += size as u32;
    }
    out
}

/// The order in which entities are eliminated: nested dissection.
fn order(numbering: &Numbering, triangles: &[(u32, f64)]) -> Vec<u32> {
    let entities = |t: u32| &numbering.entities[t as usize];
    match triangles.first().map(|(t, _)| entities(*t).len()) {
        None => Vec::new(),
        Some(3) => {
            let elements: Vec<[u32; 3]> =
                triangles.iter().map(|(t, _)| [0, 1, 2].map(|k| entities(*t)[k])).collect();
            dissection_order(&numbering.places, &elements)
        }
        Some(_) => {
            let elements: Vec<[u32; 6]> =
                triangles.iter().map(|(t, _)| [0, 1, 2, 3, 4, 5].map(|k| entities(*t)[k])).collect();
            dissection_order(&numbering.places, &elements)
        }
    }
}

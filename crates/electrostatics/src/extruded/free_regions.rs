//! The maximal regions without conductors that are a part of the plan times a part of the axis.

use super::columns::{Chain, Column};
use super::mesh::PlanMesh;
use elastocap_geometry::scene::Wall;

/// A part of the axis and the columns that hold no conductor in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FreeRegion {
    /// The numbers of the cuts of the axis at which it begins and ends.
    pub cuts: [usize; 2],
    /// Whether the potential is held at either end: by a conductor there, or because the region ends inside
    /// the scene.
    pub held: [bool; 2],
    /// For each column of the mesh whether it belongs to the region.
    pub columns: Vec<bool>,
    /// For each chain of the mesh whether it belongs to the region.
    pub chains: Vec<bool>,
}

/// All maximal regions without conductors, for the columns and the chains of a plan.
pub(super) fn free_regions(columns: &[Column], chains: &[Chain], walls: [Wall; 2]) -> Vec<FreeRegion> {
    let intervals = columns.first().map_or(0, |c| c.conductor.len());
    let mut regions: Vec<FreeRegion> = Vec::new();
    // Ends may be held anywhere; at an outer cut that no wall holds they may be free as well.
    let ends = |side: usize| {
        let outer = if side == 0 { 0 } else { intervals };
        let mut ends: Vec<(usize, bool)> = (0..=intervals).map(|m| (m, true)).collect();
        if walls[side] != Wall::Grounded {
            ends.insert(0, (outer, false));
        }
        ends
    };
    for (lo, held_lo) in ends(0) {
        for (hi, held_hi) in ends(1) {
            if lo >= hi {
                continue;
            }
            let is_free = |conductor: &[Option<u32>], held: &[Option<u32>]| {
                let inside =
                    (lo..hi).all(|m| conductor[m].is_none()) && (lo + 1..hi).all(|m| held[m].is_none());
                inside && (held_lo || held[lo].is_none()) && (held_hi || held[hi].is_none())
            };
            let columns: Vec<bool> = columns.iter().map(|c| is_free(&c.conductor, &c.held)).collect();
            let chains = chains.iter().map(|c| is_free(&c.conductor, &c.held)).collect();
            if columns.contains(&true) {
                regions.push(FreeRegion { cuts: [lo, hi], held: [held_lo, held_hi], columns, chains });
            }
        }
    }
    // Whether all functions of region `a` are functions of region `b`.
    let is_contained = |a: &FreeRegion, b: &FreeRegion| {
        let reaches = |side: usize| {
            let (cut, other) = (a.cuts[side], b.cuts[side]);
            let farther = if side == 0 { other < cut } else { other > cut };
            farther || (cut == other && (a.held[side] || !b.held[side]))
        };
        let holds = |a: &[bool], b: &[bool]| a.iter().zip(b).all(|(a, b)| !a || *b);
        a != b && reaches(0) && reaches(1) && holds(&a.columns, &b.columns) && holds(&a.chains, &b.chains)
    };
    let maximal = |a: &&FreeRegion| !regions.iter().any(|b| is_contained(a, b));
    regions.iter().filter(maximal).cloned().collect()
}

/// An approximation of the permittivity by a product: a factor for each interval, and one for each column in
/// a part of the axis.
#[derive(Debug, Clone)]
pub(super) struct Product {
    /// The factor of each interval.
    pub along: Vec<f64>,
}

impl Product {
    /// The factors of the intervals: geometric means of the permittivity over the plan, weighted by area.
    pub(super) fn new(mesh: &PlanMesh) -> Self {
        let mut area = vec![0.0; mesh.columns.len()];
        for t in 0..mesh.triangles.len() {
            area[mesh.column[t] as usize] += mesh.triangle(t).double_area();
        }
        let intervals = mesh.columns.first().map_or(0, |c| c.conductor.len());
        let along = (0..intervals)
            .map(|m| {
                let free = || mesh.columns.iter().zip(&area).filter(move |(c, _)| c.conductor[m].is_none());
                let first = free().next().map_or(1.0, |(c, _)| c.permittivity[m]);
                if free().all(|(c, _)| c.permittivity[m] == first) {
                    return first;
                }
                let total: f64 = free().map(|(_, a)| a).sum();
                (free().map(|(c, a)| a * c.permittivity[m].ln()).sum::<f64>() / total).exp()
            })
            .collect();
        Self { along }
    }

    /// The factor of a column in a part of the axis: the geometric mean of its permittivity over the factors
    /// of the intervals.
    pub(super) fn across(&self, column: &Column, [lo, hi]: [usize; 2]) -> f64 {
        let ratios: Vec<f64> = (lo..hi)
            .filter(|&m| column.conductor[m].is_none())
            .map(|m| column.permittivity[m] / self.along[m])
            .collect();
        match ratios.first() {
            None => 1.0,
            Some(first) if ratios.iter().all(|r| r == first) => *first,
            Some(_) => (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp(),
        }
    }
}

//! Which tetrahedra hold the gap between the bounds, and how much of it lies beyond the mesh.

use crate::floating::Floating;
use crate::matrix::MatrixBounds;
use faer::Mat;

/// For each driven conductor, the state with 1 V on it, 0 V on the other driven ones and no charge on the floating ones: the
/// potentials of all conductors, V, and the state's energy, F V^2.
pub(super) fn states(floating: &Floating, all: &MatrixBounds) -> Vec<(Vec<f64>, f64)> {
    let driven = floating.driven.len();
    let uncharged = vec![0.0; floating.floating.len()];
    (0..driven)
        .map(|d| {
            let unit: Vec<f64> = (0..driven).map(|e| f64::from(u8::from(d == e))).collect();
            let potentials = floating.potentials(&all.upper, &unit, &uncharged);
            let n = potentials.len();
            let energy = (0..n)
                .flat_map(|i| (0..n).map(move |j| (i, j)))
                .map(|(i, j)| potentials[i] * all.upper[(i, j)] * potentials[j]);
            let energy = energy.sum();
            (potentials, energy)
        })
        .collect()
}

/// Tetrahedra by how much of the gap they hold.
pub(super) struct ByGap {
    /// Those that hold any, from the most on.
    pub(super) tets: Vec<u32>,
    /// What each of them holds together with those before it, relative to the energy, summed over all states.
    held: Vec<f64>,
}

impl ByGap {
    /// How many of the first hold this share of the gap.
    pub(super) fn holding(&self, share: f64) -> usize {
        let goal = share * self.held.last().copied().unwrap_or(0.0);
        self.tets.len().min(self.held.partition_point(|held| *held < goal) + usize::from(goal > 0.0))
    }
}

/// Sorts tetrahedra by how much of the gap they hold.
///
/// Where conductors float, a state is a sum of unit states. The root of its local gap is at most the sum of the roots of theirs
/// (the gap is a squared norm).
pub(super) fn by_gap(states: &[(Vec<f64>, f64)], gaps: &[Vec<f64>]) -> ByGap {
    let tets = gaps.first().map_or(0, Vec::len);
    let mut size: Vec<f64> = vec![0.0; tets];
    for (potentials, energy) in states.iter().filter(|(_, energy)| *energy > 0.0) {
        for (t, size) in size.iter_mut().enumerate() {
            let root: f64 =
                potentials.iter().zip(gaps).map(|(v, gap)| v.abs() * gap[t].max(0.0).sqrt()).sum();
            *size += root * root / energy;
        }
    }
    let mut tets: Vec<u32> = (0..tets as u32).filter(|&t| size[t as usize] > 0.0).collect();
    // Equal sizes keep their order, so that the same mesh is refined the same way.
    tets.sort_by(|&a, &b| size[b as usize].total_cmp(&size[a as usize]));
    let mut sum = 0.0;
    let held = tets.iter().map(|&t| {
        sum += size[t as usize];
        sum
    });
    let held = held.collect();
    ByGap { tets, held }
}

/// The share of the spread (upper minus lower bound) that lies in open space beyond the mesh.
///
/// There the potential and the flux are continued along rays, each by its own law. Refining the mesh reduces this part only as
/// long as the two differ on the outer faces because the mesh is coarse. `gap` is over the mesh, m; `scale`, F/m, includes all
/// mirrored copies.
pub(super) fn beyond(states: &[(Vec<f64>, f64)], all: &MatrixBounds, gap: &Mat<f64>, scale: f64) -> f64 {
    let (mut inside, mut total) = (0.0, 0.0);
    for (potentials, energy) in states.iter().filter(|(_, energy)| *energy > 0.0) {
        for (i, v) in potentials.iter().enumerate() {
            for (j, w) in potentials.iter().enumerate() {
                inside += v * w * scale * gap[(i, j)] / energy;
                total += v * w * (all.upper[(i, j)] - all.lower[(i, j)]) / energy;
            }
        }
    }
    if total > inside { 1.0 - inside / total } else { 0.0 }
}

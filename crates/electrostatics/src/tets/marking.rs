//! Which tetrahedra hold the gap between the bounds, and how much of it lies beyond the mesh.

use crate::floating::Floating;
use crate::matrix::MatrixBounds;
use faer::Mat;

/// A state of the field.
pub(super) struct State {
    /// The potentials of all conductors, or the shares of all right-hand sides, V.
    pub(super) potentials: Vec<f64>,
    /// Twice the energy, V . C V, F V^2.
    pub(super) energy: f64,
}

/// For each of these rows of the driven conductors, the state with 1 V on it, 0 V on the other driven ones
/// and no charge on the floating ones.
pub(super) fn states(floating: &Floating, bounds: &MatrixBounds, rows: &[usize]) -> Vec<State> {
    let driven = floating.driven.len();
    let uncharged = vec![0.0; floating.floating.len()];
    rows.iter()
        .map(|&d| {
            let unit: Vec<f64> = (0..driven).map(|e| f64::from(u8::from(d == e))).collect();
            let potentials = floating.potentials(&bounds.upper, &unit, &uncharged);
            let n = potentials.len();
            let energy = (0..n)
                .flat_map(|i| (0..n).map(move |j| (i, j)))
                .map(|(i, j)| potentials[i] * bounds.upper[(i, j)] * potentials[j]);
            let energy = energy.sum();
            State { potentials, energy }
        })
        .collect()
}

/// Share of a tetrahedron's gap that is left after 0 to 3 bisections, those of its neighbours included, as
/// measured at edges (three halve all edges in most cases). Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const LEFT: [f64; 4] = [1.0, 0.45, 0.3, 0.15];

/// A tetrahedron is bisected once more where its gap is this many times larger: half of it is left, on two
/// halves.
const ONCE_MORE: f64 = 4.0;

/// Gaps that differ by less than this factor are treated as equal, so that few limits have to be tried. It is
/// not tuned.
const STEP: f64 = 1.1;

/// Ratio of the smallest gap that matters to the largest. Not tuned: a limit that ordinary cases do not
/// reach.
const RANGE: f64 = 1e-12;

/// How much of the gap each tetrahedron holds.
pub(super) struct Gaps {
    /// The gap of each tetrahedron relative to the energy, summed over all states.
    of_tets: Vec<f64>,
    /// The sum of these gaps.
    total: f64,
    /// The largest of these gaps.
    largest: f64,
}

impl Gaps {
    /// `states` are sums of right-hand sides, for each of which `gaps` has what each tetrahedron holds. The
    /// root of the local gap of a state is at most the sum of the roots of theirs (the gap is a squared
    /// norm).
    pub(super) fn new(states: &[State], gaps: &[&[f64]]) -> Self {
        let mut of_tets: Vec<f64> = vec![0.0; gaps.first().map_or(0, |gap| gap.len())];
        for State { potentials, energy } in states.iter().filter(|state| state.energy > 0.0) {
            for (t, size) in of_tets.iter_mut().enumerate() {
                let root: f64 =
                    potentials.iter().zip(gaps).map(|(v, gap)| v.abs() * gap[t].max(0.0).sqrt()).sum();
                *size += root * root / energy;
            }
        }
        let (total, largest) = (of_tets.iter().sum(), of_tets.iter().copied().fold(0.0, f64::max));
        Self { of_tets, total, largest }
    }

    /// Whether no tetrahedron holds any of the gap.
    pub(super) fn are_zero(&self) -> bool {
        self.largest <= 0.0
    }

    /// How often to bisect a tetrahedron where those with a gap above `limit` are bisected.
    fn bisections(gap: f64, limit: f64) -> u8 {
        let above = |k: i32| u8::from(gap > limit * ONCE_MORE.powi(k));
        above(0) + above(1) + above(2)
    }

    /// How often to bisect each tetrahedron, so that the gaps of all parts are of one size: as often as it
    /// takes to leave this share of the whole gap by forecast, but with hardly more tetrahedra than `growth`
    /// allows.
    pub(super) fn bisected_to(&self, share: f64, growth: &Growth) -> Bisections {
        // For each class of gaps of about one size, by descending size, their number and their sum.
        let mut sizes: Vec<(usize, f64)> = Vec::new();
        let class = |gap: f64| ((self.largest / gap).ln() / STEP.ln()) as usize;
        for &gap in self.of_tets.iter().filter(|gap| **gap > RANGE * self.largest) {
            let class = class(gap);
            if sizes.len() <= class {
                sizes.resize(class + 1, (0, 0.0));
            }
            sizes[class].0 += 1;
            sizes[class].1 += gap;
        }
        // Limits descend so far that even the smallest gap may be bisected three times.
        let classes = sizes.len() + (ONCE_MORE.powi(3).ln() / STEP.ln()) as usize;
        let middle = |class: usize| self.largest * STEP.powf(-(class as f64) - 0.5);
        // Limits, each with the share of the gap that it leaves: the first one whose mesh grows beyond
        // `growth.usual`, and the first one that leaves no more than `share`.
        let mut usual = None;
        let mut last = None;
        for limit in (1..=classes).map(|class| self.largest * STEP.powi(-(class as i32))) {
            let (mut left, mut more) = (self.total, 0.0);
            for (class, (count, gap)) in sizes.iter().enumerate() {
                let times = Self::bisections(middle(class), limit);
                left -= (1.0 - LEFT[usize::from(times)]) * gap;
                more += (f64::from(1_u32 << times) - 1.0) * *count as f64;
            }
            let (left, grown) = (left / self.total, 1.0 + more / self.of_tets.len() as f64);
            if left <= share {
                last = Some((limit, left));
                break;
            }
            if grown > growth.usual {
                usual.get_or_insert((limit, left));
            }
            if grown > growth.last {
                break;
            }
        }
        // If no limit does either, all gaps that matter are divided.
        let (limit, left) = last.or(usual).unwrap_or((RANGE * self.largest, LEFT[3]));
        let times = self.of_tets.iter().map(|&gap| Self::bisections(gap, limit)).collect();
        Bisections { times, left }
    }
}

/// Ratios of the tetrahedra of a mesh to those of the mesh before at which a mesh counts as fine enough,
/// without the bisections for conformity.
pub(super) struct Growth {
    /// Where further meshes follow: gaps on a coarse mesh say little about where a much finer one should be
    /// fine.
    pub(super) usual: f64,
    /// Where the mesh is forecast to meet the goal, so that no other follows.
    pub(super) last: f64,
}

/// How a mesh is to be refined.
pub(super) struct Bisections {
    /// How often each tetrahedron is to be bisected.
    pub(super) times: Vec<u8>,
    /// The share of the gap that should be left.
    pub(super) left: f64,
}

/// The share of the spread (upper minus lower bound) that lies in open space beyond the mesh.
///
/// There the potential and the flux are continued along rays, by different laws. Refining the mesh reduces
/// this part only as long as the two differ on the outer faces because the mesh is coarse. `gap` is over the
/// mesh, m; `scale`, F/m, includes all mirrored copies.
pub(super) fn beyond(states: &[State], bounds: &MatrixBounds, gap: &Mat<f64>, scale: f64) -> f64 {
    let (mut inside, mut total) = (0.0, 0.0);
    for State { potentials, energy } in states.iter().filter(|state| state.energy > 0.0) {
        for (i, v) in potentials.iter().enumerate() {
            for (j, w) in potentials.iter().enumerate() {
                inside += v * w * scale * gap[(i, j)] / energy;
                total += v * w * (bounds.upper[(i, j)] - bounds.lower[(i, j)]) / energy;
            }
        }
    }
    if total > inside { 1.0 - inside / total } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gaps that fall by a constant factor from one tetrahedron to the next.
    fn falling(tets: usize, factor: f64) -> Gaps {
        let gaps: Vec<f64> = (0..tets).map(|t| factor.powi(t as i32)).collect();
        let state = State { potentials: vec![1.0], energy: 1.0 };
        Gaps::new(&[state], &[&gaps])
    }

    #[test]
    fn tetrahedra_with_more_of_the_gap_are_bisected_more_often_until_so_much_is_left() {
        let gaps = falling(100, 0.8);
        for share in [0.9, 0.6, 0.3] {
            let Bisections { times, left: forecast } =
                gaps.bisected_to(share, &Growth { usual: 10.0, last: 10.0 });
            assert!(times.is_sorted_by(|a, b| a >= b), "{times:?}");
            let left: f64 =
                times.iter().enumerate().map(|(t, &k)| LEFT[usize::from(k)] * 0.8_f64.powi(t as i32)).sum();
            let left = left / gaps.total;
            assert!(left <= 1.02 * share && left > 0.7 * share, "{left} of {share}");
            assert!((forecast / left - 1.0).abs() < 0.1, "{forecast} and {left}");
        }
    }

    #[test]
    fn no_more_tetrahedra_are_made_than_allowed_and_equal_ones_are_treated_alike() {
        let count = |share: f64, last: f64| -> usize {
            let bisections = falling(1000, 0.999).bisected_to(share, &Growth { usual: 1.5, last });
            bisections.times.iter().map(|&k| 1 << k).sum()
        };
        assert!((1500..1700).contains(&count(0.1, 1.5)));
        // More of them if they are enough, and not if they are not.
        assert!((1900..3000).contains(&count(0.4, 3.0)), "{}", count(0.4, 3.0));
        assert!((1500..1700).contains(&count(0.1, 3.0)));
        let equal = falling(1000, 1.0).bisected_to(0.5, &Growth { usual: 1.1, last: 1.1 }).times;
        assert!(equal.iter().all(|k| *k == equal[0]) && equal[0] > 0);
    }

    #[test]
    fn tetrahedra_that_hold_no_more_than_rounding_are_not_bisected_where_few_hold_the_gap() {
        let gaps: Vec<f64> = (0..100).map(|t| if t < 3 { 1.0 } else { 1e-30 }).collect();
        let state = State { potentials: vec![1.0], energy: 1.0 };
        let times = Gaps::new(&[state], &[&gaps]).bisected_to(0.2, &Growth { usual: 10.0, last: 10.0 }).times;
        assert_eq!(times[..3], [3; 3]);
        assert!(times[3..].iter().all(|k| *k == 0));
    }

    #[test]
    fn a_state_with_conductors_at_several_potentials_holds_no_more_than_its_parts_may_add_up_to() {
        let gaps: [&[f64]; 2] = [&[1.0, 4.0], &[9.0, 0.0]];
        let state = State { potentials: vec![1.0, -2.0], energy: 7.0 };
        let weighted = Gaps::new(&[state], &gaps);
        assert_eq!(weighted.of_tets, [49.0 / 7.0, 4.0 / 7.0]);
        assert!(!weighted.are_zero() && Gaps::new(&[], &gaps).are_zero());
    }
}

//! The operator: T along every line of every axis, as [`elastocap_fem::condensed`] applies it.

use super::lines::{Bundle, Run, Segment};
use super::rays::shares;
use super::{Dual, Lines, OtherLines};
use elastocap_fem::tensor::{axpy, left, right, sized, target};
use elastocap_linalg::conjugate_gradients::Operator;
use rayon::prelude::*;

/// Least number of entries for a parallel task. Tuned: `cargo bench --bench solver`.
const SMALL_TASK: usize = 65_536;

impl Operator for Dual {
    type Precision = f32;
    fn unknowns(&self) -> usize {
        self.lines.unknowns()
    }
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        apply(&self.lines, x, y);
        if let Some(OtherLines { lines, exchange, parity, work: [on_other, product] }) = &mut self.other {
            exchange.write_second(x, *parity, on_other);
            sized(product, on_other.len());
            product.par_chunks_mut(SMALL_TASK).for_each(|chunk| chunk.fill(0.0));
            along_slabs(lines, on_other, product);
            exchange.add_to_first(product, *parity, y);
        }
        self.clear_conductors(y);
    }
    fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.schwarz.apply(r, z, &mut self.work);
    }
}

/// y = A x for all lines of one array of unknowns.
fn apply(lines: &Lines, x: &[f64], y: &mut [f64]) {
    let (segments, bundles) = (&lines.segments, &lines.bundles);
    let [_, n1, n2] = lines.dims;
    let plane = n1 * n2;
    let across = [0, 1, 2].map(|a| shares(&lines.basis, a));
    y.par_chunks_mut(plane).enumerate().with_min_len((2048 / plane.max(1)).max(1)).for_each_init(
        Vec::new,
        |work, (i, slab)| {
            slab.fill(0.0);
            let source = &x[i * plane..(i + 1) * plane];
            for bundle in bundles[2].iter().filter(|b| b.across[0].contains(&i)) {
                for run in &bundle.runs {
                    along_rows(bundle, run, &segments[2][run.segment], across[2], i, source, slab, n2, work);
                }
            }
            for bundle in bundles[1].iter().filter(|b| b.across[0].contains(&i)) {
                for run in &bundle.runs {
                    along_columns(
                        bundle,
                        run,
                        &segments[1][run.segment],
                        across[1],
                        i,
                        source,
                        slab,
                        n2,
                        work,
                    );
                }
            }
        },
    );
    along_slabs(lines, x, y);
}

/// Adds the products with T along the lines of a run of the last axis in slab `i`.
#[expect(clippy::too_many_arguments, reason = "an inner loop")]
fn along_rows(
    bundle: &Bundle,
    run: &Run,
    segment: &Segment,
    across: [&[f64]; 2],
    i: usize,
    source: &[f64],
    slab: &mut [f64],
    n2: usize,
    work: &mut Vec<f64>,
) {
    let (js, len) = (&bundle.across[1], run.range.len());
    let start = js.start * n2 + run.range.start;
    segment.operator.add_along_rows(left(source, start, js.len(), len, n2), target(slab, start, n2), work);
    if let Some(leaving) = &segment.leaving {
        for j in js.clone() {
            let row = j * n2 + run.range.start..j * n2 + run.range.end;
            let mut t = [0.0; 2];
            for (t, v) in t.iter_mut().zip(&leaving.vectors) {
                *t = super::rays::inner(v, &source[row.clone()]);
            }
            let damped = leaving.damp(across[0][i] + across[1][j], t);
            for (d, v) in damped.iter().zip(&leaving.vectors) {
                axpy(&mut slab[row.clone()], -d, v);
            }
        }
    }
}

/// Adds the products with T along the lines of a run of the second axis in slab `i`.
#[expect(clippy::too_many_arguments, reason = "an inner loop")]
fn along_columns(
    bundle: &Bundle,
    run: &Run,
    segment: &Segment,
    across: [&[f64]; 2],
    i: usize,
    source: &[f64],
    slab: &mut [f64],
    n2: usize,
    work: &mut Vec<f64>,
) {
    let ks = &bundle.across[1];
    let start = run.range.start * n2 + ks.start;
    segment.operator.add_along_columns(right(source, start, ks.len(), n2), target(slab, start, n2), work);
    if let Some(leaving) = &segment.leaving {
        let rows = || run.range.clone().map(|j| j * n2 + ks.start..j * n2 + ks.end);
        let mut traces = [vec![0.0; ks.len()], vec![0.0; ks.len()]];
        for (t, v) in traces.iter_mut().zip(&leaving.vectors) {
            rows().zip(v).for_each(|(row, v)| axpy(t, *v, &source[row]));
        }
        for (column, k) in ks.clone().enumerate() {
            let damped = leaving.damp(across[0][i] + across[1][k], [traces[0][column], traces[1][column]]);
            [traces[0][column], traces[1][column]] = damped;
        }
        for (t, v) in traces.iter().zip(&leaving.vectors) {
            rows().zip(v).for_each(|(row, v)| axpy(&mut slab[row], -v, t));
        }
    }
}

/// Adds the products with T along all lines of the first axis.
fn along_slabs(lines: &Lines, x: &[f64], y: &mut [f64]) {
    let (bundles, segments) = (&lines.bundles[0], &lines.segments[0]);
    let [n0, n1, n2] = lines.dims;
    let plane = n1 * n2;
    let across = shares(&lines.basis, 0);
    // The flux through the two ends of the lines of each run, over their rectangle.
    let damped = |bundle: &Bundle, run: &Run| -> Option<[Vec<f64>; 2]> {
        let leaving = segments[run.segment].leaving.as_ref()?;
        let (js, ks) = (&bundle.across[0], &bundle.across[1]);
        let mut traces = [vec![0.0; js.len() * ks.len()], vec![0.0; js.len() * ks.len()]];
        let [lower, upper] = &mut traces;
        let width = ks.len().max(1);
        lower.par_chunks_mut(width).zip(upper.par_chunks_mut(width)).zip(js.clone()).for_each(
            |((lower, upper), j)| {
                for (t, v) in [&mut *lower, &mut *upper].into_iter().zip(&leaving.vectors) {
                    for (i, v) in run.range.clone().zip(v) {
                        let start = i * plane + j * n2;
                        axpy(t, *v, &x[start + ks.start..start + ks.end]);
                    }
                }
                for (k, (a, b)) in ks.clone().zip(lower.iter_mut().zip(upper)) {
                    [*a, *b] = leaving.damp(across[0][j] + across[1][k], [*a, *b]);
                }
            },
        );
        Some(traces)
    };
    let damped: Vec<Vec<Option<[Vec<f64>; 2]>>> =
        bundles.iter().map(|b| b.runs.iter().map(|r| damped(b, r)).collect()).collect();
    // The results of `Condensed::between` for the lines of each run, one row of the first transverse axis
    // after the other.
    let between = |bundle: &Bundle, run: &Run| -> Vec<f64> {
        let (operator, (js, ks)) = (&segments[run.segment].operator, (&bundle.across[0], &bundle.across[1]));
        let start = run.range.start * plane + js.start * n2 + ks.start;
        operator.between_each(right(x, start, ks.len(), plane), js.len(), n2)
    };
    let between: Vec<Vec<Vec<f64>>> =
        bundles.iter().map(|b| b.runs.iter().map(|r| between(b, r)).collect()).collect();
    let block = n0.div_ceil((n0 * plane / 16_384).clamp(1, 4));
    y.par_chunks_mut(block * plane).enumerate().for_each(|(b, slabs)| {
        let slab_range = b * block..b * block + slabs.len() / plane;
        for (bundle, (damped, between)) in bundles.iter().zip(damped.iter().zip(&between)) {
            let (js, ks) = (&bundle.across[0], &bundle.across[1]);
            for (run, (damped, between)) in bundle.runs.iter().zip(damped.iter().zip(between)) {
                let shared = run.range.start.max(slab_range.start)..run.range.end.min(slab_range.end);
                if shared.is_empty() {
                    continue;
                }
                let segment = &segments[run.segment];
                let local = shared.start - run.range.start..shared.end - run.range.start;
                let width = segment.operator.nodes() * ks.len();
                for (row, j) in js.clone().enumerate() {
                    let across = j * n2 + ks.start;
                    segment.operator.add_rows(
                        local.clone(),
                        right(x, run.range.start * plane + across, ks.len(), plane),
                        &between[row * width..(row + 1) * width],
                        target(slabs, (shared.start - slab_range.start) * plane + across, plane),
                    );
                }
                let (Some(damped), Some(leaving)) = (damped, &segment.leaving) else { continue };
                for i in shared.clone() {
                    for (t, v) in damped.iter().zip(&leaving.vectors) {
                        let weight = -v[i - run.range.start];
                        for (j, t) in js.clone().zip(t.chunks_exact(ks.len().max(1))) {
                            let start = (i - slab_range.start) * plane + j * n2;
                            axpy(&mut slabs[start + ks.start..start + ks.end], weight, t);
                        }
                    }
                }
            }
        }
    });
}

//! The flux that the lower bound under a map aims at: that of the primal solution.

use super::Dual;
use crate::boxes::domain::Domain;
use crate::boxes::mapped::gradients::{EXTRA, Gradients};
use crate::boxes::mapped::points::{AxisPoints, Evaluation};
use elastocap_fem::tensor::along;

/// Potentials that are taken off others.
#[derive(Clone, Copy)]
pub(crate) struct Less<'a> {
    /// One for each right-hand side.
    pub(crate) potentials: &'a [Vec<f64>],
    /// The permittivity that their gradients are multiplied by, in each cell.
    pub(crate) permittivity: &'a [f64],
}

impl Less<'_> {
    /// Their permittivity over that of a domain at Gauss points; `None` where both are the same everywhere.
    pub(super) fn ratio(&self, domain: &Domain, points: &[AxisPoints; 3]) -> Option<Vec<f64>> {
        if self.permittivity == domain.permittivity.as_slice() {
            return None;
        }
        let cells = domain.cells();
        let [n0, n1, n2] = points.each_ref().map(AxisPoints::len);
        let all = (0..n0).flat_map(|i| (0..n1).flat_map(move |j| (0..n2).map(move |k| [i, j, k])));
        let ratio = |at: [usize; 3]| {
            let cell = [0, 1, 2].map(|a| points[a].interval[at[a]]);
            let own = self.permittivity[(cell[0] * cells[1] + cell[1]) * cells[2] + cell[2]];
            own / domain.permittivity_of(cell)
        };
        Some(all.map(ratio).collect())
    }
}

/// Integrals of K grad u / eps with the potential modes of the two other axes, at Gauss points along each axis in turn: the target of
/// the projection.
pub(super) struct Target {
    pub(super) points: [AxisPoints; 3],
    /// `[point or mode]` on each axis: points along the component's own.
    pub(super) parts: [Vec<f64>; 3],
}

/// That of a potential under a map, less what there is of another one.
pub(super) fn target(
    domain: &Domain,
    dual: &Dual,
    less: Option<(&Less<'_>, &[f64])>,
    (u, bent): (&[f64], Option<&Gradients>),
) -> Target {
    let dims = domain.primal_dims();
    let points = all_points(domain);
    let difference: Option<Vec<f64>> = less.map(|(_, p)| u.iter().zip(p).map(|(u, p)| u - p).collect());
    // Where the permittivity of the other one is not that of the domain, another share of it is taken off.
    let other = less.and_then(|(less, p)| Some((p, less.ratio(domain, &points)?)));
    let shape = points.each_ref().map(AxisPoints::len);
    let evaluate = [0, 1, 2].map(|a| {
        let axis = &domain.axes[a];
        let window = 0..axis.functions().len();
        points[a].functions(axis, &window).map(|m| Evaluation::new(&m))
    });
    let added = bent.map(|bent| (bent.added_flux(u, dims), bent.points()));
    let whole = domain.truncated();
    let parts = [0, 1, 2].map(|component| {
        let gradient = |u: &[f64]| {
            let (mut t, mut now) = (u.to_vec(), dims);
            for a in (0..3).rev() {
                let [value, slope] = &evaluate[a];
                let matrix = if a == component { slope } else { value };
                (t, now) = along(a, &matrix.forward, &t, now);
            }
            (t, now)
        };
        let (mut t, mut now) = gradient(difference.as_deref().unwrap_or(u));
        if let Some((p, ratio)) = &other {
            let own = gradient(p).0;
            t.iter_mut().zip(own).zip(ratio).for_each(|((t, own), ratio)| *t += (1.0 - ratio) * own);
        }
        for (index, t) in t.iter_mut().enumerate() {
            let at = [index / (shape[1] * shape[2]), index / shape[2] % shape[1], index % shape[2]];
            *t *= (0..3).map(|a| points[a].weights[at[a]]).product::<f64>();
        }
        if let Some((added, bent)) = &added {
            add_at(&mut t, &points, &added[component], bent, domain);
        }
        for a in (0..3).filter(|a| *a != component) {
            let radial = dual.basis[a].as_ref().map(|basis| &basis.radial);
            let modes = Evaluation::new(&points[a].modes(&whole.axes[a], radial));
            (t, now) = along(a, &modes.back, &t, now);
        }
        t
    });
    Target { points, parts }
}

/// Points on all finite elements.
fn all_points(domain: &Domain) -> [AxisPoints; 3] {
    [0, 1, 2].map(|a| {
        let line = &domain.axes[a].line;
        let first = line.first_finite();
        AxisPoints::new(&domain.axes[a], first..first + line.degrees.len(), EXTRA)
    })
}

/// Adds `part`, a weighted flux at the points `bent` among all `points`, over the permittivity.
fn add_at(all: &mut [f64], points: &[AxisPoints; 3], part: &[f64], bent: &[AxisPoints; 3], domain: &Domain) {
    let first = [0, 1, 2].map(|a| {
        let start = bent[a].element.first().copied().unwrap_or(0);
        points[a].element.partition_point(|e| *e < start)
    });
    let (n, m) = (points.each_ref().map(AxisPoints::len), bent.each_ref().map(AxisPoints::len));
    for (index, value) in part.iter().enumerate() {
        let at = [index / (m[1] * m[2]), index / m[2] % m[1], index % m[2]];
        let cell = [0, 1, 2].map(|a| bent[a].interval[at[a]]);
        let [i, j, k] = [0, 1, 2].map(|a| first[a] + at[a]);
        all[(i * n[1] + j) * n[2] + k] += value / domain.permittivity_of(cell);
    }
}

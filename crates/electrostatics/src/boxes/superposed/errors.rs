//! The difference between the flux of a base and the gradient of its potential, in the block that a map bends
//! and in a ball around a body.

use super::added::Added;
use super::grids::at_planes;
use super::sight::Sight;
use super::squares::{size, trace};
use crate::boxes::domain::{Axis, Domain};
use crate::boxes::dual::superposed::Weights;
use crate::boxes::mapped::gradients::{add_with_error, gradients_at};
use crate::boxes::mapped::metric::{Metric, TensorKind};
use crate::boxes::mapped::points::AxisPoints;
use crate::error::SolveError;
use faer::{Mat, Scale};
use std::ops::Range;

/// Number of Gauss points on each element, counted beyond its degree, with which the rule is exact without a
/// map.
const EXACT: usize = 1;

/// Two such numbers for integrals under a map: the difference of the two results estimates the error.
const RULES: [usize; 2] = [0, 1];

/// The usual ratio of a norm on B with K^-1 to the same norm without a map. Tuned: time the runs of the balls
/// in docs/change.md, section "Reach".
const BENT: f64 = 3.0;

/// Share of the error of the base below which a contribution need not be computed accurately. Tuned: time the
/// runs of the balls in docs/change.md, section "Reach".
const NEGLIGIBLE: f64 = 0.03;

impl Added<'_> {
    /// The square of d0 - eps grad u0 on B, and how much larger it is in the norm of K^-1. `largest` is the
    /// largest ratio of the two norms.
    pub(super) fn under_map(
        &self,
        coarse: &Domain,
        known: &Mat<f64>,
        largest: f64,
    ) -> Result<[Mat<f64>; 2], SolveError> {
        let domain = self.divided(coarse, &Default::default())?;
        let block = self.elements(&domain);
        // The norm without a map times that ratio is an upper bound, good enough where it is negligible.
        let on_block = self.errors(coarse, &domain, &block, TensorKind::Permittivity, EXACT)?;
        let most = &on_block * Scale(largest - 1.0);
        if trace(&most) <= NEGLIGIBLE * trace(known) {
            return Ok([on_block, most]);
        }
        let [coarser, finer] =
            RULES.map(|extra| self.errors(coarse, &domain, &block, TensorKind::Resistance, extra));
        let mut out = Mat::zeros(known.nrows(), known.ncols());
        add_with_error(&mut out, &coarser?, &finer?, 1.0);
        Ok([on_block, out])
    }

    /// A forecast of the spread of the energies, over those of the base, if the base were the only source of
    /// error. The energies are those that include the energies of the error of the base.
    pub(crate) fn least_apart(&self, domain: &Domain, sight: &Sight) -> Result<f64, SolveError> {
        let [gap, energies] = self.base_forms();
        let seen =
            size(&(&gap * Scale(sight.share(self.is_odd())))) + size(&self.errors_around(domain, sight)?);
        let divided = self.divided(domain, &Default::default())?;
        let on_block = size(&self.errors(
            domain,
            &divided,
            &self.elements(&divided),
            TensorKind::Permittivity,
            EXACT,
        )?);
        let mismatch = on_block * (1.0 + BENT);
        Ok((seen * seen + 4.0 * size(&gap) * mismatch + mismatch * mismatch) / trace(&energies))
    }

    /// The elements of B in a grid from [`Added::divided`].
    fn elements(&self, divided: &Domain) -> [Range<usize>; 3] {
        [0, 1, 2].map(|a| {
            let axis = &divided.axes[a];
            axis.cuts[self.block.lo[a]]..axis.cuts[self.block.hi[a]]
        })
    }

    /// An upper bound on the square of d0 - eps grad u0 in the ball of `sight`, in the norm of 1 / eps,
    /// whatever is added there: the square on all elements that the ball touches.
    ///
    /// # Errors
    /// A ball that reaches beyond the last node of an axis that continues to infinity.
    pub(super) fn errors_around(&self, coarse: &Domain, sight: &Sight) -> Result<Mat<f64>, SolveError> {
        let coarse = Domain { conductors: Vec::new(), ..coarse.clone() };
        let ends = [0, 1, 2].map(|a| vec![sight.middle[a] - sight.clear, sight.middle[a] + sight.clear]);
        let domain = self.divided(&coarse, &ends)?;
        let is_inside = (0..3).all(|a| {
            let line = &domain.axes[a].line;
            let [low, high] = [ends[a][0], ends[a][1]];
            (line.first_finite() == 0 || line.nodes.first().is_some_and(|first| *first <= low))
                && line.nodes.last().is_some_and(|last| high <= *last)
        });
        if !is_inside {
            return Err(SolveError::Superposition);
        }
        let around = [0, 1, 2].map(|a| {
            let line = &domain.axes[a].line;
            let [low, high] = [ends[a][0], ends[a][1]];
            let from = line.nodes.partition_point(|x| *x <= low).saturating_sub(1);
            let to = line.nodes.partition_point(|x| *x < high).min(line.nodes.len() - 1);
            line.first_finite() + from..line.first_finite() + to
        });
        self.errors(&coarse, &domain, &around, TensorKind::Permittivity, EXACT)
    }

    /// The grid of the base, divided at the planes of a scene as well, and at `more` places of each axis.
    fn divided(&self, coarse: &Domain, more: &[Vec<f64>; 3]) -> Result<Domain, SolveError> {
        Ok(at_planes(&self.base.domain, coarse, more).ok_or(SolveError::Superposition)?.truncated())
    }

    /// The square of d0 - eps grad u0 on elements of a grid from [`Added::divided`], by `extra` more Gauss
    /// points on each element than its degree: in the norm of 1 / eps, or how much larger it is in that of
    /// K^-1.
    fn errors(
        &self,
        coarse: &Domain,
        whole: &Domain,
        elements: &[Range<usize>; 3],
        tensor: TensorKind,
        extra: usize,
    ) -> Result<Mat<f64>, SolveError> {
        let n = self.base_index.len();
        let without =
            self.without.as_ref().map_or(&coarse.permittivity, |without| &without.domain.permittivity);
        let metric = match tensor {
            TensorKind::Permittivity => None,
            TensorKind::Resistance => Metric::new(whole, extra, TensorKind::Resistance)?,
        };
        let places = match &metric {
            Some(metric) => metric.points.clone(),
            None => [0, 1, 2].map(|a| AxisPoints::new(&whole.axes[a], elements[a].clone(), extra)),
        };
        let points = |axes: &[Axis; 3]| [0, 1, 2].map(|a| places[a].on(&axes[a]));
        let (of_flux, of_potential) = (points(self.base.fluxes.axes()), points(&self.base.domain.axes));
        let weights = Weights::new(&Domain { permittivity: without.clone(), ..whole.clone() }, &places);
        let with = self.without.as_ref().map(|_| Weights::new(whole, &places));
        let error = |k: usize| -> Result<[Vec<f64>; 3], SolveError> {
            let base = &self.base;
            let gradient = gradients_at(&base.domain, &of_potential, &[&base.coefficients[k]]).pop();
            let mut error = weights.times_permittivity(gradient.ok_or(SolveError::Superposition)?);
            let flux = base.fluxes.flux_at(k, &of_flux).ok_or(SolveError::Superposition)?;
            for (error, flux) in error.iter_mut().zip(&flux) {
                error.iter_mut().zip(flux).for_each(|(e, d)| *e -= d);
            }
            Ok(error)
        };
        let errors: Vec<Option<[Vec<f64>; 3]>> =
            self.base_index.iter().map(|k| k.map(error).transpose()).collect::<Result<_, _>>()?;
        Ok(Mat::from_fn(n, n, |i, j| match (&errors[i], &errors[j], &metric) {
            (Some(x), Some(y), Some(metric)) => {
                let of_body = with
                    .as_ref()
                    .map_or(0.0, |with| with.over_permittivity(x, y) - weights.over_permittivity(x, y));
                metric.product(x, y) + of_body
            }
            (Some(x), Some(y), None) => weights.over_permittivity(x, y),
            _ => 0.0,
        }))
    }
}

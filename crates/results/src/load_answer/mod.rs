//! The load that several measured capacitances belong to, from the steps of a run: normal force, shift and
//! tilt, with their covariance.
//!
//! Each capacitance is a polynomial of the quantities that differ between the steps (`surfaces.rs`). The load
//! is the one that meets the measured capacitances best, each weighted by its variance, from the measurement,
//! the bounds of the steps and the polynomial. Limits count as the ends of a uniform distribution, whose
//! variance is a third of their square.

mod surfaces;
mod table;

use elastocap_case::MeasuredCapacitance;
use nalgebra::{DMatrix, DVector};

use surfaces::Surfaces;
pub use table::{LoadTable, LoadTableError, read_table};

/// Names and units of the quantities of a step, in the order of [`table::LoadStep::load`].
const QUANTITIES: [(&str, &str); 5] = [
    ("force", "N"),
    ("shift along x1", "m"),
    ("shift along x3", "m"),
    ("tilt about x3", "rad"),
    ("tilt about x1", "rad"),
];
/// Names and units of the horizontal forces.
const SIDEWAYS: [(&str, &str); 2] = [("force along x1", "N"), ("force along x3", "N")];

/// The largest number of steps of the iteration for the load. Not tuned: a limit that ordinary cases do not
/// reach.
const MAX_ITERATIONS: usize = 100;
/// The distance from the middle up to which loads are looked for, in halves of the range of the steps. Not
/// tuned: a limit that ordinary cases do not reach.
const FARTHEST: f64 = 100.0;
/// The distance beyond the steps up to which a load is accepted, as a share of half their range and in
/// addition to the load's error. It is not tuned.
const BEYOND: f64 = 0.02;
/// The largest accepted sum of squared differences between measurements and polynomials, over their standard
/// deviations, where there are `to_spare` more measurements than unknown quantities: consistent measurements
/// exceed it in one of some ten thousand cases.
fn accepted(to_spare: f64) -> f64 {
    to_spare + 5.0 * (2.0 * to_spare).sqrt() + 10.0
}

/// An entry of the capacitance matrix that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredEntry {
    /// The terminal, by its position among [`LoadTable::terminals`].
    pub terminal: usize,
    /// The other terminal of a mutual capacitance; `None` for the capacitance of the terminal against all
    /// others at potential zero.
    pub other: Option<usize>,
    /// The measured capacitance.
    pub capacitance: MeasuredCapacitance,
}

/// One quantity of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadQuantity {
    /// The name of the quantity.
    pub name: &'static str,
    /// The unit: N, m or rad.
    pub unit: &'static str,
    /// The most likely value, in that unit.
    pub value: f64,
    /// The standard deviation, in the same unit.
    pub deviation: f64,
}

/// The load that belongs to measured capacitances.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadAnswer {
    /// The quantities that differ between the steps, and the horizontal forces where these are known.
    pub quantities: Vec<LoadQuantity>,
    /// The covariance of the quantities, in the products of their units.
    pub covariance: Vec<Vec<f64>>,
    /// The sum of squared differences between measurements and polynomials, over their standard deviations.
    pub chi_squared: f64,
    /// The number of measured capacitances less that of the unknown quantities.
    pub to_spare: usize,
}

/// The reason why no load belongs to measured capacitances.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoLoad {
    /// All steps have the same load.
    #[error("all steps of the result have the same load")]
    OneLoad,
    /// The steps do not determine polynomials and their errors.
    #[error(
        "the {steps} steps of the result do not tell how each capacitance depends on {quantities}, and how well: run the case with three \
         values or more of each, in at least {least} steps, such as shifts of -100, 0 and 100 um at each of four forces"
    )]
    TooFewSteps {
        /// The number of steps.
        steps: usize,
        /// The quantities that differ between the steps.
        quantities: String,
        /// The number of steps that a linear dependence needs.
        least: usize,
    },
    /// There are more unknowns than measurements.
    #[error(
        "{measured} measured capacitances do not tell {unknown} quantities ({quantities}): give more of them, or run the case with steps \
         that vary fewer"
    )]
    TooFewMeasured {
        /// The number of measured capacitances.
        measured: usize,
        /// The number of unknown quantities.
        unknown: usize,
        /// Their names.
        quantities: String,
    },
    /// Different loads have the same capacitances.
    #[error(
        "the measured capacitances hardly depend on some of {0}, or only on them together; give others as well"
    )]
    NotDetermined(String),
    /// No load has all of these capacitances.
    #[error(
        "no load of the result has these capacitances together: they miss the nearest by {0:.1} standard deviations (root mean square); \
         check units, offsets and the order of the terminals"
    )]
    NoFit(f64),
    /// The load is outside the range of the steps.
    #[error(
        "the {name} would be {value:.4e} {unit}, and the steps of the result reach from {low:.4e} to {high:.4e}; add steps there"
    )]
    Outside {
        /// The quantity that is not within the range of the steps.
        name: &'static str,
        /// The unit of the quantity.
        unit: &'static str,
        /// The value found.
        value: f64,
        /// The least value of the quantity at the steps.
        low: f64,
        /// The largest value of the quantity at the steps.
        high: f64,
    },
}

/// A quantity that differs between the steps.
struct Axis {
    /// The position of the quantity among [`QUANTITIES`].
    index: usize,
    /// The middle of the range of the steps, in the unit of the quantity.
    middle: f64,
    /// Half of that range, in the same unit.
    half: f64,
}

impl LoadTable {
    /// The load that belongs to measured capacitances.
    ///
    /// # Errors
    /// [`NoLoad`] where steps or measurements do not determine the load.
    pub fn load(&self, measured: &[MeasuredEntry]) -> Result<LoadAnswer, NoLoad> {
        let axes = self.axes();
        let names = axes.iter().map(|axis| QUANTITIES[axis.index].0).collect::<Vec<_>>().join(", ");
        if axes.is_empty() {
            return Err(NoLoad::OneLoad);
        }
        let scaled = |step: &table::LoadStep| {
            axes.iter().map(|axis| (step.load[axis.index] - axis.middle) / axis.half).collect::<Vec<f64>>()
        };
        let places: Vec<Vec<f64>> = self.steps.iter().map(scaled).collect();
        // An entry at all steps: its lower bounds, its values or its upper bounds, for k = 0, 1 or 2.
        let entry_values = |entry: &MeasuredEntry, k: usize| -> Vec<f64> {
            let value = |step: &table::LoadStep| match entry.other {
                None => step.maxwell[k][entry.terminal][entry.terminal],
                Some(other) => -step.maxwell[k][entry.terminal][other],
            };
            self.steps.iter().map(value).collect()
        };
        let values: Vec<Vec<f64>> = measured.iter().map(|entry| entry_values(entry, 1)).collect();
        let too_few =
            || NoLoad::TooFewSteps { steps: places.len(), quantities: names.clone(), least: axes.len() + 2 };
        let surfaces = Surfaces::fitted(&places, &values).ok_or_else(too_few)?;
        if measured.len() < axes.len() {
            return Err(NoLoad::TooFewMeasured {
                measured: measured.len(),
                unknown: axes.len(),
                quantities: names,
            });
        }
        let deviation = |(k, entry): (usize, &MeasuredEntry)| {
            let (low, high) = (entry_values(entry, 0), entry_values(entry, 2));
            let spread = low.iter().zip(&high).map(|(a, b)| 0.5 * (b - a).abs()).fold(0.0, f64::max);
            let limits = (entry.capacitance.error.powi(2) + spread.powi(2)) / 3.0;
            (limits + surfaces.errors[k].powi(2)).sqrt()
        };
        let deviations: Vec<f64> = measured.iter().enumerate().map(deviation).collect();
        let search = Search { surfaces: &surfaces, measured, deviations };
        let start = places.iter().min_by(|a, b| search.misses(a).total_cmp(&search.misses(b)));
        let place = search.nearest(start.cloned().unwrap_or_default());
        let covariance = search.covariance(&place).ok_or_else(|| NoLoad::NotDetermined(names.clone()))?;
        let (chi_squared, to_spare) = (search.misses(&place), measured.len() - axes.len());
        let spare = to_spare as f64;
        if chi_squared > accepted(spare) {
            return Err(NoLoad::NoFit((chi_squared / spare.max(1.0)).sqrt()));
        }
        for (k, axis) in axes.iter().enumerate() {
            let (name, unit) = QUANTITIES[axis.index];
            if place[k].abs() > 1.0 + BEYOND + covariance[(k, k)].sqrt() {
                let [low, high] = [-1.0, 1.0].map(|end| axis.middle + end * axis.half);
                let value = axis.middle + place[k] * axis.half;
                return Err(NoLoad::Outside { name, unit, value, low, high });
            }
        }
        Ok(self.answer(&axes, &places, &place, &covariance, (chi_squared, to_spare)))
    }

    /// The quantities that differ between the steps.
    fn axes(&self) -> Vec<Axis> {
        let axis = |index: usize| {
            let values = || self.steps.iter().map(|step| step.load[index]);
            let (low, high) =
                (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            (high > low).then_some(Axis { index, middle: 0.5 * (low + high), half: 0.5 * (high - low) })
        };
        (0..QUANTITIES.len()).filter_map(axis).collect()
    }

    /// The answer in the units of the quantities, with the resulting horizontal forces.
    fn answer(
        &self,
        axes: &[Axis],
        places: &[Vec<f64>],
        place: &[f64],
        covariance: &DMatrix<f64>,
        (chi_squared, to_spare): (f64, usize),
    ) -> LoadAnswer {
        let mut named: Vec<(&'static str, &'static str, f64)> = Vec::new();
        let mut slopes = DMatrix::zeros(0, axes.len());
        for (k, axis) in axes.iter().enumerate() {
            let (name, unit) = QUANTITIES[axis.index];
            named.push((name, unit, axis.middle + place[k] * axis.half));
            slopes = slopes.insert_row(k, 0.0);
            slopes[(k, k)] = axis.half;
        }
        // Horizontal forces, from shift and normal force.
        let forces: Option<Vec<[f64; 2]>> = self.steps.iter().map(|step| step.sideways).collect();
        for (k, (name, unit)) in SIDEWAYS.into_iter().enumerate() {
            let along_axis = forces.iter().flatten().map(|force| force[k]).collect::<Vec<f64>>();
            let is_moved = along_axis.iter().any(|force| *force != 0.0);
            if let Some(surface) = is_moved.then(|| Surfaces::fitted(places, &[along_axis])).flatten() {
                let row = slopes.nrows();
                slopes = slopes.insert_row(row, 0.0);
                slopes.row_mut(row).copy_from(&surface.slopes(place).row(0));
                named.push((name, unit, surface.at(place)[0]));
            }
        }
        let covariance = &slopes * covariance * slopes.transpose();
        let quantity = |(k, (name, unit, value)): (usize, (&'static str, &'static str, f64))| LoadQuantity {
            name,
            unit,
            value,
            deviation: covariance[(k, k)].max(0.0).sqrt(),
        };
        LoadAnswer {
            quantities: named.into_iter().enumerate().map(quantity).collect(),
            covariance: covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            chi_squared,
            to_spare,
        }
    }
}

/// The Gauss-Newton search for the best load, with Levenberg's damping.
struct Search<'a> {
    surfaces: &'a Surfaces,
    measured: &'a [MeasuredEntry],
    /// Standard deviation of the difference between each measurement and its polynomial, F.
    deviations: Vec<f64>,
}

impl Search<'_> {
    /// The excess of each capacitance at a place over the measured one, in standard deviations.
    fn excess(&self, place: &[f64]) -> DVector<f64> {
        let mut found = self.surfaces.at(place);
        for (k, entry) in self.measured.iter().enumerate() {
            found[k] = (found[k] - entry.capacitance.value) / self.deviations[k];
        }
        found
    }

    /// The sum of the squared excesses at a place.
    fn misses(&self, place: &[f64]) -> f64 {
        self.excess(place).norm_squared()
    }

    /// The derivatives of the excesses: a row for each capacitance.
    fn slopes(&self, place: &[f64]) -> DMatrix<f64> {
        let mut slopes = self.surfaces.slopes(place);
        for (k, deviation) in self.deviations.iter().enumerate() {
            slopes.row_mut(k).unscale_mut(*deviation);
        }
        slopes
    }

    /// The place that meets the measured capacitances best, by iteration from a place near it.
    fn nearest(&self, mut place: Vec<f64>) -> Vec<f64> {
        let mut damping = 1e-3;
        for _ in 0..MAX_ITERATIONS {
            let (excess, slopes) = (self.excess(&place), self.slopes(&place));
            let normal = slopes.transpose() * &slopes;
            let mut damped = normal.clone();
            for k in 0..place.len() {
                damped[(k, k)] += damping * normal[(k, k)].max(f64::MIN_POSITIVE);
            }
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&(slopes.transpose() * &excess)))
            else {
                damping *= 10.0;
                continue;
            };
            let next: Vec<f64> =
                place.iter().zip(step.iter()).map(|(x, dx)| (x - dx).clamp(-FARTHEST, FARTHEST)).collect();
            if self.misses(&next) < self.misses(&place) {
                place = next;
                damping = (0.1 * damping).max(1e-12);
            } else {
                damping *= 10.0;
            }
            if step.norm() < 1e-12 || damping > 1e12 {
                break;
            }
        }
        place
    }

    /// The covariance of the place; `None` where the capacitances do not determine it.
    fn covariance(&self, place: &[f64]) -> Option<DMatrix<f64>> {
        let slopes = self.slopes(place);
        let values = slopes.singular_values();
        let is_determined = values.min() > 1e-9 * values.max();
        let inverse = (slopes.transpose() * &slopes).try_inverse()?;
        (is_determined && inverse.iter().all(|x| x.is_finite())).then_some(inverse)
    }
}

#[cfg(test)]
mod tests;

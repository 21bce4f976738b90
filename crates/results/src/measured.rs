//! Measured points beside the computed curve: residuals, and the share of them within the errors.

use elastocap_case::{Case, MeasuredLoad, MeasuredPoint};
use elastocap_coupling::outcome::Outcome;
use serde::Serialize;

use crate::load_curve::{LoadCurve, NoCurve};
use crate::plot::{Axis, Chart, Panels, Scale, Series, Style};

/// The measured points of a case beside its curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The file of the points, as the case names it.
    pub file: String,
    /// "force", "displacement" or "compression".
    pub load: &'static str,
    /// The points, in the order of the file.
    pub points: Vec<ComparedPoint>,
    /// The number of points whose residual is at most the errors: bounds, stated errors, interpolation, and
    /// deviation of the point.
    pub within_error: usize,
    /// The number of points whose load the curve does not reach; they are not compared.
    pub beyond_curve: usize,
    /// Share of the compared points that are within the error; `None` if none could be compared.
    pub fraction_within_error: Option<f64>,
    /// Root of the mean square of the residuals, F.
    pub rms_residual_f: Option<f64>,
    /// The largest residual, by size, F.
    pub max_residual_f: Option<f64>,
    /// The largest estimated error of interpolation at a point, F; `None` where it is not known.
    pub max_interpolation_error_f: Option<f64>,
}

/// A measured point and the value of the curve at its load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComparedPoint {
    /// The line of the point in the file.
    pub line: u64,
    /// The load less the offset: N, m, or U/H.
    pub load: f64,
    /// The measured capacitance, F; parasitic capacitance and gain are taken off.
    pub capacitance_f: f64,
    /// The standard deviation of the measured capacitance, F; `None` where it is not known.
    pub deviation_f: Option<f64>,
    /// The capacitance of the curve, F; `None` where the curve does not reach the load.
    pub computed_f: Option<f64>,
    /// The residual, measured less computed, F.
    pub residual_f: Option<f64>,
    /// The error: bounds, stated errors, interpolation and deviation, F.
    pub error_f: Option<f64>,
    /// Whether the residual is at most the error.
    pub within_error: Option<bool>,
}

/// Compares the measured points of a case with the curve of a run; `None` if the case has none.
///
/// # Errors
/// [`NoCurve`] if the run has fewer than two steps to compare them with.
pub fn compare(case: &Case, outcome: &Outcome) -> Option<Result<Comparison, NoCurve>> {
    let measured = case.measured_points.as_ref()?;
    let curve = match LoadCurve::of(case, outcome, measured.load) {
        Ok(curve) => curve,
        Err(error) => return Some(Err(error)),
    };
    Some(Ok(Comparison::new(&measured.file, measured.load, &measured.corrected(), &curve)))
}

impl Comparison {
    /// Compares points, which are already corrected, with a curve over loads of the same kind; `file` is the
    /// source of the points.
    pub fn new(file: &str, load: MeasuredLoad, points: &[MeasuredPoint], curve: &LoadCurve) -> Self {
        let mut interpolation = Some(0.0_f64);
        let mut compared = |point: &MeasuredPoint| {
            let value = curve.at(point.load);
            let residual = value.map(|value| point.capacitance - value.capacitance);
            if let Some(value) = value {
                interpolation =
                    interpolation.zip(value.interpolation_error).map(|(most, error)| most.max(error));
            }
            let error = value.map(|value| value.whole_error() + point.deviation.unwrap_or(0.0));
            ComparedPoint {
                line: point.line,
                load: point.load,
                capacitance_f: point.capacitance,
                deviation_f: point.deviation,
                computed_f: value.map(|value| value.capacitance),
                residual_f: residual,
                error_f: error,
                within_error: residual.zip(error).map(|(residual, error)| residual.abs() <= error),
            }
        };
        let points: Vec<ComparedPoint> = points.iter().map(&mut compared).collect();
        let residuals: Vec<f64> = points.iter().filter_map(|point| point.residual_f).collect();
        let within = points.iter().filter(|point| point.within_error == Some(true)).count();
        let count = residuals.len() as f64;
        let is_compared = !residuals.is_empty();
        Self {
            file: file.to_owned(),
            load: load.name(),
            within_error: within,
            beyond_curve: points.len() - residuals.len(),
            fraction_within_error: is_compared.then(|| within as f64 / count),
            rms_residual_f: is_compared
                .then(|| (residuals.iter().map(|r| r * r).sum::<f64>() / count).sqrt()),
            max_residual_f: residuals.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())),
            max_interpolation_error_f: interpolation.filter(|_| is_compared),
            points,
        }
    }

    /// The number of points within the range of the curve.
    pub fn compared(&self) -> usize {
        self.points.len() - self.beyond_curve
    }
}

/// The curve of a case with its measured points over it, the residuals below, and the second chart of the
/// figure at the bottom.
pub(crate) fn panels(
    title: String,
    curve: Chart,
    measured: MeasuredLoad,
    comparison: &Comparison,
    last: Option<Chart>,
) -> Panels {
    let mut main = curve;
    main.series.push(points_series(&comparison.points, &comparison.file));
    let second = residuals(&main.x, &comparison.points, measured);
    Panels { title, main, second: Some(second), third: last }
}

/// The axis of loads of this kind.
pub fn load_axis(load: MeasuredLoad) -> Axis {
    let label = match load {
        MeasuredLoad::Force => "force",
        MeasuredLoad::Displacement => "displacement of the layer's top",
        MeasuredLoad::Compression => "compression U/H",
    };
    Axis { label: label.to_owned(), unit: load.unit().to_owned(), scale: Scale::Linear }
}

/// The measured points as a series, with their deviations as bars.
pub fn points_series(points: &[ComparedPoint], name: &str) -> Series {
    let bar = |point: &ComparedPoint| {
        let deviation = point.deviation_f.unwrap_or(f64::NAN);
        (point.capacitance_f - deviation, point.capacitance_f + deviation)
    };
    let has_bars = points.iter().any(|point| point.deviation_f.is_some());
    Series {
        name: format!("measured, {name}"),
        points: points.iter().map(|point| (point.load, point.capacitance_f)).collect(),
        band: has_bars.then(|| points.iter().map(bar).collect()),
        style: Style::Markers,
    }
}

/// The chart of the residuals, measured less computed, with the errors as bars, and the zero line.
pub fn residuals(x: &Axis, points: &[ComparedPoint], load: MeasuredLoad) -> Chart {
    let known = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let bar = |point: &ComparedPoint| {
        let (residual, error) = (known(point.residual_f), known(point.error_f));
        (residual - error, residual + error)
    };
    let loads = || points.iter().map(|point| point.load);
    let ends = [loads().fold(f64::INFINITY, f64::min), loads().fold(f64::NEG_INFINITY, f64::max)];
    Chart {
        title: String::new(),
        x: Axis { label: load_axis(load).label, ..x.clone() },
        y: Axis { label: "measured less computed".to_owned(), unit: "F".to_owned(), scale: Scale::Linear },
        series: vec![
            Series {
                name: String::new(),
                points: ends.map(|load| (load, 0.0)).to_vec(),
                band: None,
                style: Style::DashedLine,
            },
            Series {
                name: "residual, and the error that bounds, mechanics, interpolation and deviation allow"
                    .to_owned(),
                points: points.iter().map(|point| (point.load, known(point.residual_f))).collect(),
                band: Some(points.iter().map(bar).collect()),
                style: Style::Markers,
            },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_curve::CurveStep;

    fn comparison(deviation: Option<f64>) -> Comparison {
        let step = |load: f64| CurveStep { load, load_error: 0.0, capacitance: 10.0 - load, error: 0.01 };
        let curve = LoadCurve::through([0.0, 1.0, 2.0, 3.0].map(step).to_vec()).unwrap();
        let point = |(line, load, capacitance)| MeasuredPoint { line, load, capacitance, deviation };
        let points = [(2, 0.5, 9.505), (3, 1.0, 9.2), (4, 2.5, 7.45), (5, 3.5, 6.5)].map(point);
        Comparison::new("points.csv", MeasuredLoad::Force, &points, &curve)
    }

    #[test]
    fn points_count_as_explained_if_bounds_and_deviation_reach_them() {
        let exact = comparison(None);
        assert_eq!((exact.within_error, exact.beyond_curve, exact.compared()), (1, 1, 3));
        assert_eq!(exact.fraction_within_error, Some(1.0 / 3.0));
        assert!((exact.max_residual_f.unwrap() - 0.2).abs() < 1e-12);
        let scattered = comparison(Some(0.05));
        assert_eq!(scattered.within_error, 2);
        assert_eq!(scattered.points[3].residual_f, None);
    }

    #[test]
    fn a_point_beyond_the_curve_has_no_residual_in_the_chart() {
        let compared = comparison(Some(0.05));
        let x = load_axis(MeasuredLoad::Force);
        let chart = residuals(&x, &compared.points, MeasuredLoad::Force);
        assert!(chart.series[1].points[3].1.is_nan());
        assert_eq!(points_series(&compared.points, "p").points.len(), 4);
    }
}

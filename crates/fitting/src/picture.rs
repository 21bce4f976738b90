//! The picture `fit.svg`: measured points, the curve before and after the fit, and the residuals.

use elastocap_case::{Correction, MeasuredPoint, MeasuredPoints};
use elastocap_results::load_curve::LoadCurve;
use elastocap_results::measured::{ComparedPoint, load_axis, points_series, residuals};
use elastocap_results::plot::{Axis, Chart, Panels, Scale, Series, Style};

use crate::fit::Fit;

/// The number of points of a drawn curve.
const DRAWN: u32 = 120;

/// The picture of a fit to these points: the reading of the meter against the measured load.
pub fn picture(title: &str, measured: &MeasuredPoints, fit: &Fit) -> Panels {
    let curves = &fit.curves;
    let loads = measured.points.iter().map(|point| point.load);
    let [least, most] =
        [loads.clone().fold(f64::INFINITY, f64::min), loads.fold(f64::NEG_INFINITY, f64::max)];
    let line = |curve: &LoadCurve, correction: &Correction| -> Vec<(f64, f64)> {
        let at = |k: u32| {
            let load = least + (most - least) * f64::from(k) / f64::from(DRAWN);
            let value = curve.at(load - correction.offset);
            (load, value.map_or(f64::NAN, |value| correction.gain * value.capacitance + correction.parasitic))
        };
        (0..=DRAWN).map(at).collect()
    };
    let x = load_axis(measured.load);
    // The points as measured, with the residuals of the fit in the reading of the meter.
    let shown: Vec<ComparedPoint> = measured
        .points
        .iter()
        .zip(&fit.measured_points.points)
        .map(|(point, compared)| as_measured(point, compared, &curves.correction))
        .collect();
    let series = vec![
        Series {
            name: "fitted".to_owned(),
            points: line(&curves.fitted, &curves.correction),
            band: None,
            style: Style::Line,
        },
        points_series(&shown, &measured.file),
        Series {
            name: "where the fit began".to_owned(),
            points: line(&curves.start, &curves.start_correction),
            band: None,
            style: Style::DashedLine,
        },
    ];
    let y = Axis { label: "capacitance, as measured".to_owned(), unit: "F".to_owned(), scale: Scale::Linear };
    let second = residuals(&x, &shown, measured.load);
    let main = Chart { title: String::new(), x, y, series };
    Panels { title: format!("{title}: fit"), main, second: Some(second), third: None }
}

/// A compared point before its correction: load, capacitances and errors as they were measured.
fn as_measured(point: &MeasuredPoint, compared: &ComparedPoint, correction: &Correction) -> ComparedPoint {
    let Correction { offset: _, parasitic, gain } = *correction;
    ComparedPoint {
        load: point.load,
        capacitance_f: point.capacitance,
        deviation_f: point.deviation,
        computed_f: compared.computed_f.map(|value| gain * value + parasitic),
        residual_f: compared.residual_f.map(|value| gain * value),
        error_f: compared.error_f.map(|value| gain * value),
        ..*compared
    }
}

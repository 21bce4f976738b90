//! The figure `accuracy.svg`: error against run time.

use super::{Choice, Kind, Run, Study};
use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};

/// The figure of a study; `None` where nothing was proved.
pub fn figure(study: &Study) -> Option<Chart> {
    let reference = study.reference?;
    let least = reference.half_width();
    let timed = |run: &Run| run.found().map(|found| found.seconds);
    // A true error below the uncertainty of the reference is drawn at that uncertainty.
    let known = |run: &Run| study.true_error(run).map(|error| error.max(least));
    let certified = |run: &Run| study.certified_error(run);
    let points = |kind: Kind, choice: Choice, error: &dyn Fn(&Run) -> Option<f64>| {
        let chosen = study.runs.iter().filter(|run| run.kind == kind && run.choice == choice);
        let mut points: Vec<_> = chosen.filter_map(|run| Some((timed(run)?, error(run)?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let mut series = Vec::new();
    let mut clouds: Vec<Series> = Vec::new();
    for (kind, error, name) in [
        (Kind::Bounds, &certified as &dyn Fn(&Run) -> Option<f64>, "bounds: half the spread"),
        (Kind::Bounds, &known, "bounds: true error of their middle"),
        (Kind::Estimate, &certified, "no bounds: error estimate"),
        (Kind::Estimate, &known, "no bounds: true error"),
    ] {
        let style = Style::Cloud { like: series.len() };
        // One entry in the legend explains the faint markers.
        let legend = if clouds.is_empty() { "faint: given order and layers" } else { "" };
        clouds.push(Series {
            name: legend.to_owned(),
            points: points(kind, Choice::Table, error),
            band: None,
            style,
        });
        series.push(Series {
            name: name.to_owned(),
            points: points(kind, Choice::Own, error),
            band: None,
            style: Style::LineAndMarkers,
        });
    }
    let times = || clouds.iter().chain(&series).flat_map(|s| s.points.iter().map(|p| p.0));
    let (from, to) = times().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
    let horizontal_line = |name: String, error: f64| Series {
        name,
        points: vec![(from, error), (to, error)],
        band: None,
        style: Style::DashedLine,
    };
    if let Some(error) = study.parallel_plates().and_then(|run| study.true_error(run)) {
        series.push(horizontal_line("parallel plates".to_owned(), error));
    }
    if least > 0.0 {
        series.push(horizontal_line("uncertainty of the reference".to_owned(), least));
    }
    series.extend(clouds.into_iter().filter(|cloud| !cloud.points.is_empty()));
    let stopped = if study.stopped { " (stopped)" } else { "" };
    Some(Chart {
        title: format!("{}{stopped}", study.title),
        x: Axis { label: "run time".into(), unit: "s".into(), scale: Scale::Logarithmic },
        y: Axis { label: "relative error".into(), unit: String::new(), scale: Scale::Logarithmic },
        series,
    })
}

//! `curve.svg`: capacitance against force with its bounds beside parallel plates, or force against compression.

use crate::plot::{Axis, Chart, Scale, Series, Style};
use elastocap_coupling::outcome::{Outcome, Row};
use elastocap_coupling::plan::{HELD_PATCH, Kind};
use elastocap_coupling::terminals::in_words;

/// The figure of a curve; `None` for a scene without load.
pub fn figure(title: &str, outcome: &Outcome) -> Option<Chart> {
    let axis =
        |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear };
    let known = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let held = !outcome.layer_meshes.is_empty()
        && outcome.plan.layer.as_ref().is_some_and(|layer| layer.indenter == HELD_PATCH);
    let title = if held { format!("{title} (under {HELD_PATCH})") } else { title.to_owned() };
    let rows = || outcome.steps.iter().map(|step| &step.row);
    match outcome.plan.kind {
        Kind::Capacitance => None,
        Kind::Mechanics => Some(Chart {
            title,
            x: axis("compression U/H", ""),
            y: axis("force", "N"),
            series: vec![Series {
                name: if outcome.layer_meshes.is_empty() {
                    "closed form".to_owned()
                } else {
                    "finite elements, and their error".to_owned()
                },
                points: rows().map(|r| (known(r.compression), known(r.force_n))).collect(),
                band: (!outcome.layer_meshes.is_empty()).then(|| {
                    let band = |r: &Row| {
                        let (force, error) = (known(r.force_n), known(r.relative_error_estimate));
                        (force * (1.0 - error), force * (1.0 + error))
                    };
                    rows().map(band).collect()
                }),
                style: Style::LineAndMarkers,
            }],
        }),
        Kind::Curve => {
            let label =
                outcome.measurement.map_or_else(String::new, |own| in_words(own, &outcome.conductors));
            let bounds = rows().map(|r| (known(r.capacitance_lower_f), known(r.capacitance_upper_f)));
            let mut series = vec![Series {
                name: "with the fringing field, and its bounds".to_owned(),
                points: rows().map(|r| (known(r.force_n), known(r.capacitance_f))).collect(),
                band: Some(bounds.collect()),
                style: Style::LineAndMarkers,
            }];
            if rows().any(|r| r.parallel_plate_f.is_some()) {
                series.push(Series {
                    name: "parallel plates".to_owned(),
                    points: rows().map(|r| (known(r.force_n), known(r.parallel_plate_f))).collect(),
                    band: None,
                    style: Style::DashedLine,
                });
            }
            Some(Chart { title, x: axis("force", "N"), y: axis(&label, "F"), series })
        }
    }
}

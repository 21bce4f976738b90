//! One pair of axes: closed form as lines, finite elements as points of the same colour, and both as CSV.

use std::fmt::Write as _;

use crate::plot::{Axis, Chart, Scale, Series, Style};

/// A quantity: as the picture and as the CSV file name it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Named(pub(super) &'static str, pub(super) &'static str);

/// A curve at one value of the parameter: at each abscissa the closed form's value and the finite elements'; NaN where
/// there is none.
pub(super) struct Curve {
    pub(super) parameter: f64,
    pub(super) rows: Vec<[f64; 3]>,
}

/// A picture with its data.
pub(super) struct Panel {
    /// Of the files, without extension.
    pub(super) file: String,
    pub(super) title: String,
    pub(super) x: Named,
    pub(super) y: Named,
    pub(super) parameter: Named,
    pub(super) curves: Vec<Curve>,
    /// Every how many abscissae a point is drawn.
    pub(super) stride: usize,
}

impl Panel {
    /// The SVG and the CSV file.
    pub(super) fn files(&self) -> [(String, String); 2] {
        [(format!("{}.svg", self.file), self.svg()), (format!("{}.csv", self.file), self.csv())]
    }

    fn svg(&self) -> String {
        let mut series: Vec<Series> = self
            .curves
            .iter()
            .map(|curve| Series {
                name: format!("{} = {}", self.parameter.0, curve.parameter),
                points: curve.rows.iter().map(|r| (r[0], r[1])).collect(),
                band: None,
                style: Style::Line,
            })
            .collect();
        for (of, curve) in self.curves.iter().enumerate() {
            let points = curve.rows.iter().step_by(self.stride).filter(|r| r[2].is_finite());
            series.push(Series {
                name: String::new(),
                points: points.map(|r| (r[0], r[2])).collect(),
                band: None,
                style: Style::Points { of },
            });
        }
        let axis = |named: Named| Axis { label: named.0.into(), unit: String::new(), scale: Scale::Linear };
        Chart { title: self.title.clone(), x: axis(self.x), y: axis(self.y), series }.to_svg()
    }

    fn csv(&self) -> String {
        let mut out =
            format!("{},{},closed_form_{y},finite_element_{y}\n", self.parameter.1, self.x.1, y = self.y.1);
        for curve in &self.curves {
            for [x, closed, found] in &curve.rows {
                let _ = writeln!(out, "{},{},{},{}", curve.parameter, cell(*x), cell(*closed), cell(*found));
            }
        }
        out
    }

    /// Largest difference between points and lines, and the largest point, both in size.
    pub(super) fn difference(&self) -> (f64, f64) {
        let rows = self.curves.iter().flat_map(|c| &c.rows).filter(|r| r[1].is_finite() && r[2].is_finite());
        rows.fold((0.0, 0.0), |(d, m): (f64, f64), r| (d.max((r[1] - r[2]).abs()), m.max(r[2].abs())))
    }

    /// The difference as a sentence.
    pub(super) fn finding(&self) -> String {
        let (difference, largest) = self.difference();
        format!(
            "{}: {} differs by at most {} ({:.2} % of the largest, {})",
            self.file,
            self.y.0,
            figure(difference),
            100.0 * difference / largest.max(f64::MIN_POSITIVE),
            figure(largest)
        )
    }
}

/// Four significant digits.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let places = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.places$}")
}

/// Ten significant digits; empty where there is no value.
pub(super) fn cell(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let rounded: f64 = format!("{value:.9e}").parse().unwrap_or(value);
    format!("{}", rounded + 0.0)
}

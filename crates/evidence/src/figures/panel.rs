//! One pair of axes: closed form as lines, finite elements as points of the same colour, and both as CSV.

use std::fmt::Write as _;

use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};

/// The name of a quantity in the picture and in the CSV file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Named(pub(super) &'static str, pub(super) &'static str);

/// A curve at one value of the parameter: at each abscissa the values of the closed form and of the finite
/// elements; NaN where there is none.
pub(super) struct Curve {
    pub(super) parameter: f64,
    /// Abscissa, closed form and finite elements.
    pub(super) rows: Vec<[f64; 3]>,
}

/// A picture with its data.
pub(super) struct Panel {
    /// The name of the files, without extension.
    pub(super) file: String,
    pub(super) title: String,
    /// The quantity on the horizontal axis.
    pub(super) x: Named,
    /// The quantity on the vertical axis.
    pub(super) y: Named,
    /// The quantity that differs between the curves.
    pub(super) parameter: Named,
    pub(super) curves: Vec<Curve>,
    /// Whether the abscissa, and not the parameter, is `x1`.
    pub(super) x_is_x1: bool,
    /// The number of abscissae from one point of finite elements to the next.
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
        for (line, curve) in self.curves.iter().enumerate() {
            let points = curve.rows.iter().step_by(self.stride).filter(|r| r[2].is_finite());
            series.push(Series {
                name: String::new(),
                points: points.map(|r| (r[0], r[2])).collect(),
                band: None,
                style: Style::Points { of: line },
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

    /// The largest difference between points and lines up to `x1 = limit`, and the largest value of all
    /// points, both absolute.
    fn difference(&self, limit: f64) -> (f64, f64) {
        let (mut difference, mut largest) = (0.0f64, 0.0f64);
        for curve in &self.curves {
            for [x, closed, found] in &curve.rows {
                let x1 = if self.x_is_x1 { *x } else { curve.parameter };
                if found.is_finite() {
                    largest = largest.max(found.abs());
                    if closed.is_finite() && x1 <= limit {
                        difference = difference.max((closed - found).abs());
                    }
                }
            }
        }
        (difference, largest)
    }

    /// The difference between closed form and finite elements as a sentence.
    pub(super) fn finding(&self) -> String {
        let (near, largest) = self.difference(1.0);
        let (far, _) = self.difference(f64::INFINITY);
        let per_cent = |d: f64| figure_of(100.0 * d / largest.max(f64::MIN_POSITIVE), 2);
        format!(
            "{}: the two differ by at most {} % of the largest {} ({}) up to x₁ = H, {} % up to 2H",
            self.file,
            per_cent(near),
            self.y.0,
            figure(largest),
            per_cent(far)
        )
    }
}

/// The value with four significant digits.
pub(super) fn figure(value: f64) -> String {
    figure_of(value, 4)
}

/// The value with so many significant digits.
fn figure_of(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let places = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.places$}")
}

/// The value with ten significant digits; empty where there is none.
pub(super) fn cell(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let rounded: f64 = format!("{value:.9e}").parse().unwrap_or(value);
    format!("{}", rounded + 0.0)
}

//! Plots as SVG: line charts ([`Chart`]) such as capacitance against force with its bounds, several charts as
//! one picture ([`Panels`]), and fields as bands of colour ([`Fringes`]).
//!
//! Text stays text, in the sans-serif font of the reader; the same chart gives the same bytes. Points that
//! are not finite, or not positive on a logarithmic axis, are left out, and the line is broken there.

mod axis;
mod draw;
mod fringe;
mod section;
mod text;

pub use fringe::{Cell, Fringes};
pub use section::{Section, SectionCell};

/// A chart: one pair of axes and the series in it.
///
/// ```
/// use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};
///
/// let chart = Chart {
///     title: "Capacitance against force".into(),
///     x: Axis { label: "force".into(), unit: "N".into(), scale: Scale::Linear },
///     y: Axis { label: "two-terminal capacitance".into(), unit: "F".into(), scale: Scale::Linear },
///     series: vec![Series {
///         name: "with fringing field".into(),
///         points: vec![(0.0, 31.2e-15), (0.25, 30.1e-15)],
///         band: None,
///         style: Style::LineAndMarkers,
///     }],
/// };
/// assert!(chart.to_svg().contains("two-terminal capacitance (fF)"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// The title above the chart; wrapped if it is long.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series in the order of the legend; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
}

/// An axis of a plot: its quantity, its unit and its scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity, without its unit.
    pub label: String,
    /// Unit of the numbers given, empty if they have none; an SI unit gets a prefix that suits the numbers.
    pub unit: String,
    /// The scale of the axis.
    pub scale: Scale,
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scale {
    /// Linear; zero is included if the values reach near it.
    Linear,
    /// Logarithmic.
    Logarithmic,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The name in the legend; an empty one has no entry there.
    pub name: String,
    /// The points (x, y), joined in this order.
    pub points: Vec<(f64, f64)>,
    /// (lower, upper) for each point, in the same order: a shaded band, or bars where no line joins the
    /// points.
    pub band: Option<Vec<(f64, f64)>>,
    /// The style of the line; colour and marker come from the position in the chart.
    pub style: Style,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Style {
    /// A line with a marker at each point.
    LineAndMarkers,
    /// A line alone, for dense data.
    Line,
    /// A dashed line, for a reference or an approximation.
    DashedLine,
    /// Markers alone, for data that no line joins.
    Markers,
    /// Points that belong to the line of another series: in its colour, and in its entry of the legend.
    Points {
        /// The position of the line in [`Chart::series`].
        of: usize,
    },
    /// Small and faint points behind the other series, around the series at the position `like`, with its
    /// colour and marker.
    Cloud {
        /// The position of the series in [`Chart::series`].
        like: usize,
    },
}

impl Chart {
    /// The chart as an SVG file, 800 units wide.
    pub fn to_svg(&self) -> String {
        draw::svg(self)
    }
}

/// Charts below each other, the main one first, under one title.
#[derive(Debug, Clone, PartialEq)]
pub struct Panels {
    /// The title above the first chart; wrapped if it is long.
    pub title: String,
    /// The large chart on top. Its title is not shown.
    pub main: Chart,
    /// The smaller chart below, if there is one. Its title is not shown.
    pub second: Option<Chart>,
    /// A third chart at the bottom, if there is one. Its title is not shown.
    pub third: Option<Chart>,
}

/// Heights of the first and of each other of [`Panels`], the title included in the first.
const PANEL_HEIGHTS: [f64; 2] = [460.0, 290.0];

impl Panels {
    /// The charts as one SVG file, 800 units wide.
    pub fn to_svg(&self) -> String {
        let [high, low] = PANEL_HEIGHTS;
        let below: Vec<_> = self.second.iter().chain(&self.third).map(|chart| (chart, low)).collect();
        if below.is_empty() {
            return draw::svg(&Chart { title: self.title.clone(), ..self.main.clone() });
        }
        draw::page(&self.title, &[vec![(&self.main, high)], below].concat())
    }
}

#[cfg(test)]
mod tests;

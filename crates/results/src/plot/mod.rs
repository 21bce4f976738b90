//! Plots as SVG: lines ([`Chart`]), as error against run time, two such charts as one picture ([`Panels`]), as C(F) with its
//! bounds, and fields as bands of colour ([`Fringes`]).
//!
//! Text stays text, in the reader's own sans-serif font; the same chart gives the same bytes. Points that are not
//! finite, or not positive on a logarithmic axis, are left out, and the line is broken there rather than drawn across
//! what is not known.

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
    /// Above the chart; wrapped where it is long.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Upward.
    pub y: Axis,
    /// In the order of the legend; a later one is drawn over an earlier one.
    pub series: Vec<Series>,
}

/// An axis of a plot: its quantity, its unit and its scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity, without its unit.
    pub label: String,
    /// Unit of the numbers given, empty if they have none; an SI unit gets the prefix that suits the numbers.
    pub unit: String,
    /// How values are laid out.
    pub scale: Scale,
}

/// How an axis lays out its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scale {
    /// In proportion; zero is included when the values reach near it.
    Linear,
    /// By the logarithm.
    Logarithmic,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// In the legend; empty leaves it out of there.
    pub name: String,
    /// (x, y), joined in this order.
    pub points: Vec<(f64, f64)>,
    /// (lower, upper) for each point, in the same order: a shaded band, or bars where no line joins the points.
    pub band: Option<Vec<(f64, f64)>>,
    /// How it is drawn; colour and marker come from its place in the chart.
    pub style: Style,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Style {
    /// The usual one.
    LineAndMarkers,
    /// For dense data.
    Line,
    /// For what stands beside the result: a reference, an approximation.
    DashedLine,
    /// For data that no line joins.
    Markers,
    /// Data that belong to a line of another series: in its colour, and in its entry of the legend.
    Points {
        /// Place of the line in [`Chart::series`].
        of: usize,
    },
    /// Small and faint, behind the others: what stands around the series at the place `like`, in its colour and with its
    /// marker.
    Cloud {
        /// Place in [`Chart::series`].
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
    /// Above the first; wrapped where it is long.
    pub title: String,
    /// The large one on top. Its own title is not shown.
    pub main: Chart,
    /// The smaller one below, if there is one. Its own title is not shown.
    pub second: Option<Chart>,
    /// A third one at the bottom, if there is one. Its own title is not shown.
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

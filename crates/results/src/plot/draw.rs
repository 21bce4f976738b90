//! Draws charts as SVG.

use std::fmt::Write as _;

use super::axis::{Layout, Text};
use super::text::{coordinate, escape, markup, text_width, width, wrapped};
use super::{Chart, Series, Style};

pub(super) const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 500.0;
pub(super) const TITLE_SIZE: f64 = 18.0;
pub(super) const LABEL_SIZE: f64 = 15.0;
pub(super) const TICK_SIZE: f64 = 13.0;
const LEGEND_SIZE: f64 = 14.0;
/// The distance of lines of text, over the size of the text.
pub(super) const LEADING: f64 = 1.35;
pub(super) const EDGE: f64 = 14.0;
/// The height below the x axis: ticks and label.
pub(super) const BELOW: f64 = EDGE + LABEL_SIZE * LEADING + TICK_SIZE * LEADING + 6.0;
/// The width of line and marker in the legend, with the space after it.
const SWATCH: f64 = 38.0;

/// Colours that colour-blind readers can distinguish, too (Okabe and Ito), without yellow, which is faint.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#333333"];
/// The largest number of points with markers; more would hide the line.
const MOST_MARKERS: usize = 80;

/// The place of the axes on the page.
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
    pub(super) x: Layout,
    pub(super) y: Layout,
}

/// The place of a point of a series on the page.
struct Spot {
    x: f64,
    y: f64,
    /// The ends of its error bar, upper end first, if it has one.
    bar: Option<(f64, f64)>,
    /// The values shown when the pointer is over the point.
    value: (f64, f64),
}

impl Frame {
    pub(super) fn x(&self, value: f64) -> Option<f64> {
        self.x.position(value).map(|t| self.left + t * (self.right - self.left))
    }

    pub(super) fn y(&self, value: f64) -> Option<f64> {
        self.y.position(value).map(|t| self.bottom - t * (self.bottom - self.top))
    }

    /// The series in pieces, divided at missing points.
    fn pieces(&self, series: &Series) -> Vec<Vec<Spot>> {
        let mut pieces = vec![Vec::new()];
        for (i, &(x, y)) in series.points.iter().enumerate() {
            let bar = (series.band.as_ref().and_then(|band| band.get(i)))
                .filter(|(lower, upper)| lower.is_finite() && upper.is_finite())
                // A lower bound that a logarithmic axis cannot show is drawn at its end.
                .and_then(|&(lower, upper)| Some((self.y(upper)?, self.y(lower).unwrap_or(self.bottom))));
            match (self.x(x), self.y(y), pieces.last_mut()) {
                (Some(at_x), Some(at_y), Some(piece)) => {
                    piece.push(Spot { x: at_x, y: at_y, bar, value: (x, y) });
                }
                _ => pieces.push(Vec::new()),
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        pieces
    }
}

/// The colour, marker and dashes of the n-th series.
struct Pen {
    colour: &'static str,
    marker: usize,
    dashes: &'static str,
    line: bool,
    markers: bool,
    faint: bool,
}

impl Pen {
    fn new(index: usize, series: &Series) -> Self {
        if let Style::Cloud { like } = series.style {
            let (colour, marker) = (COLOURS[like % COLOURS.len()], like % 7);
            return Self { colour, marker, dashes: "", line: false, markers: true, faint: true };
        }
        if let Style::Points { of } = series.style {
            let (colour, marker) = (COLOURS[of % COLOURS.len()], of % 7);
            return Self { colour, marker, dashes: "", line: false, markers: true, faint: false };
        }
        let line = series.style != Style::Markers;
        let wanted = matches!(series.style, Style::LineAndMarkers | Style::Markers);
        // Once all colours are in use, dots distinguish the lines.
        let dashes = match (series.style, index / COLOURS.len()) {
            (Style::DashedLine, _) => "8 5",
            (_, 0) => "",
            _ => "2 4",
        };
        let markers = !line || (wanted && series.points.len() <= MOST_MARKERS);
        Self {
            colour: COLOURS[index % COLOURS.len()],
            marker: index % 7,
            dashes,
            line,
            markers,
            faint: false,
        }
    }

    fn stroke(&self) -> String {
        let dashes = if self.dashes.is_empty() {
            String::new()
        } else {
            format!(" stroke-dasharray=\"{}\"", self.dashes)
        };
        format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"2.2\" stroke-linejoin=\"round\"{dashes}",
            self.colour
        )
    }

    /// The marker, with the text shown under the pointer.
    fn marker(&self, x: f64, y: f64, tip: &str) -> String {
        let scale = if self.faint { 0.65 } else { 1.0 };
        let polygon = |points: &[(f64, f64)]| {
            let points = points
                .iter()
                .map(|(dx, dy)| format!("{},{}", coordinate(x + scale * dx), coordinate(y + scale * dy)));
            format!("<polygon points=\"{}\"", points.collect::<Vec<_>>().join(" "))
        };
        let shape = match self.marker {
            0 => {
                let (x, y, r) = (coordinate(x), coordinate(y), coordinate(scale * 4.5));
                format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"")
            }
            1 => polygon(&[(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)]),
            2 => polygon(&[(0.0, -5.5), (5.0, 3.5), (-5.0, 3.5)]),
            3 => polygon(&[(0.0, -5.8), (5.2, 0.0), (0.0, 5.8), (-5.2, 0.0)]),
            4 => polygon(&[(0.0, 5.5), (5.0, -3.5), (-5.0, -3.5)]),
            5 => polygon(&[
                (-4.8, -1.8),
                (-1.8, -4.8),
                (1.8, -4.8),
                (4.8, -1.8),
                (4.8, 1.8),
                (1.8, 4.8),
                (-1.8, 4.8),
                (-4.8, 1.8),
            ]),
            _ => polygon(&[(0.0, -5.5), (5.2, -1.7), (3.2, 4.4), (-3.2, 4.4), (-5.2, -1.7)]),
        };
        let tip = if tip.is_empty() { String::new() } else { format!("<title>{}</title>", escape(tip)) };
        let look = if self.faint {
            format!("fill=\"{}\" fill-opacity=\"0.4\"", self.colour)
        } else {
            format!("fill=\"{}\" stroke=\"#fff\" stroke-width=\"1\"", self.colour)
        };
        format!("{shape} {look}>{tip}{}", if self.marker == 0 { "</circle>\n" } else { "</polygon>\n" })
    }
}

pub(super) fn svg(chart: &Chart) -> String {
    page(&chart.title, &[(chart, HEIGHT)])
}

/// Charts below each other under one title, each with its height; that of the first includes the title.
pub(super) fn page(title: &str, charts: &[(&Chart, f64)]) -> String {
    let lines = wrapped(title, WIDTH - 2.0 * EDGE, TITLE_SIZE);
    let mut out = open_page(title, &lines, charts.iter().map(|(_, height)| height).sum());
    let mut panels = Vec::with_capacity(charts.len());
    let (mut top, mut end) = (EDGE + lines.len() as f64 * TITLE_SIZE * LEADING, 0.0);
    for (chart, height) in charts {
        end += height;
        let legend = Legend::new(chart);
        let below_legend = top + legend.rows as f64 * LEGEND_SIZE * LEADING * 1.1;
        panels.push((*chart, legend, top, lay_out(chart, below_legend + 10.0, end - BELOW)));
        top = end;
    }
    // All panels share their left and right edges, so that equal x are below each other.
    let left = panels.iter().map(|panel| panel.3.left).fold(0.0, f64::max);
    let right = panels.iter().map(|panel| panel.3.right).fold(WIDTH, f64::min);
    for (chart, legend, top, frame) in panels {
        let frame = Frame { left, right, ..frame };
        legend.draw(&mut out, chart, top);
        draw_axes(&mut out, &frame);
        if chart.series.iter().all(|series| frame.pieces(series).is_empty()) {
            let x = coordinate(0.5 * (frame.left + frame.right));
            let y = coordinate(0.5 * (frame.top + frame.bottom));
            let _ = writeln!(
                out,
                "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" font-size=\"{LABEL_SIZE}\" fill=\"#777\">no data</text>"
            );
        }
        draw_series(&mut out, chart, &frame);
    }
    out.push_str("</svg>\n");
    out
}

/// The start of the file: a white page of this height with the title's lines on it.
pub(super) fn open_page(title: &str, lines: &[String], height: f64) -> String {
    let mut out = String::new();
    let height = coordinate(height);
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         role=\"img\" aria-label=\"{}\" font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\" \
         fill=\"#222\">",
        escape(title)
    );
    let _ = writeln!(out, "<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>");
    for (i, line) in lines.iter().enumerate() {
        let baseline = EDGE + TITLE_SIZE * (0.85 + LEADING * i as f64);
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"{TITLE_SIZE}\" font-weight=\"bold\">{}</text>",
            coordinate(0.5 * WIDTH),
            coordinate(baseline),
            escape(line)
        );
    }
    out
}

/// Chooses the margins that the text needs.
fn lay_out(chart: &Chart, top: f64, bottom: f64) -> Frame {
    let xs = || chart.series.iter().flat_map(|s| s.points.iter().map(|p| p.0));
    let ys = || {
        chart.series.iter().flat_map(|s| {
            let bounds = s.band.iter().flatten().flat_map(|&(lower, upper)| [lower, upper]);
            s.points.iter().map(|p| p.1).chain(bounds)
        })
    };
    // Long titles and legends must leave room for the chart.
    let top = top.min(bottom - 150.0);
    let y = Layout::new(&chart.y, ys(), ((bottom - top) / 50.0) as usize);
    let widest =
        |layout: &Layout| layout.ticks.iter().map(|t| width(&t.label, TICK_SIZE)).fold(0.0, f64::max);
    let left = EDGE + LABEL_SIZE * LEADING + 8.0 + widest(&y) + 8.0;
    let mut x = Layout::new(&chart.x, xs(), 8);
    let mut most = 8;
    while most > 2 && x.ticks.len() as f64 * (widest(&x) + 18.0) > WIDTH - left - EDGE {
        most -= 1;
        x = Layout::new(&chart.x, xs(), most);
    }
    // A label centred under a tick at the end of the axis sticks out.
    let overhang =
        x.ticks.iter().map(|t| 0.5 * width(&t.label, TICK_SIZE) * t.at.powi(4)).fold(8.0, f64::max);
    Frame { left, right: WIDTH - EDGE - overhang, top, bottom, x, y }
}

pub(super) fn draw_axes(out: &mut String, frame: &Frame) {
    let Frame { left, right, top, bottom, x, y } = frame;
    let at_x = |t: f64| coordinate(left + t * (right - left));
    let at_y = |t: f64| coordinate(bottom - t * (bottom - top));
    let (x1, x2, y1, y2) = (coordinate(*left), coordinate(*right), coordinate(*top), coordinate(*bottom));
    let mut grid = |positions: &mut dyn Iterator<Item = String>, colour: &str| {
        let path: String = positions.collect();
        if !path.is_empty() {
            let _ =
                writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1\"/>");
        }
    };
    grid(&mut x.minor.iter().map(|&t| format!("M{} {y1}V{y2}", at_x(t))), "#f1f1f1");
    grid(&mut y.minor.iter().map(|&t| format!("M{x1} {}H{x2}", at_y(t))), "#f1f1f1");
    grid(&mut x.ticks.iter().map(|t| format!("M{} {y1}V{y2}", at_x(t.at))), "#dcdcdc");
    grid(&mut y.ticks.iter().map(|t| format!("M{x1} {}H{x2}", at_y(t.at))), "#dcdcdc");
    let _ = writeln!(
        out,
        "<rect x=\"{x1}\" y=\"{y1}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#555\" stroke-width=\"1\"/>",
        coordinate(right - left),
        coordinate(bottom - top)
    );
    let _ = writeln!(out, "<g font-size=\"{TICK_SIZE}\" text-anchor=\"middle\">");
    for tick in &x.ticks {
        let baseline = coordinate(bottom + 6.0 + TICK_SIZE);
        let _ =
            writeln!(out, "<text x=\"{}\" y=\"{baseline}\">{}</text>", at_x(tick.at), markup(&tick.label));
    }
    let _ = writeln!(out, "</g>\n<g font-size=\"{TICK_SIZE}\" text-anchor=\"end\">");
    for tick in &y.ticks {
        let baseline = coordinate(bottom - tick.at * (bottom - top) + 0.35 * TICK_SIZE);
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{baseline}\">{}</text>",
            coordinate(left - 8.0),
            markup(&tick.label)
        );
    }
    out.push_str("</g>\n");
    let size = |text: &Text, room: f64| {
        coordinate(LABEL_SIZE.min(LABEL_SIZE * room / width(text, LABEL_SIZE).max(1.0)))
    };
    let _ = writeln!(
        out,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"{}\">{}</text>",
        coordinate(0.5 * (left + right)),
        coordinate(bottom + BELOW - EDGE),
        size(&x.label, right - left),
        markup(&x.label)
    );
    let (across, along) = (coordinate(EDGE + LABEL_SIZE), coordinate(0.5 * (top + bottom)));
    let _ = writeln!(
        out,
        "<text transform=\"translate({across} {along}) rotate(-90)\" text-anchor=\"middle\" font-size=\"{}\">{}</text>",
        size(&y.label, bottom - top + 40.0),
        markup(&y.label)
    );
}

fn draw_series(out: &mut String, chart: &Chart, frame: &Frame) {
    let drawn: Vec<(Pen, Vec<Vec<Spot>>, &str)> = (chart.series.iter().enumerate())
        .map(|(i, series)| (Pen::new(i, series), frame.pieces(series), series.name.as_str()))
        .collect();
    // All bands come first, so that no band hides the line of another series.
    for (pen, pieces, _) in &drawn {
        for piece in pieces.iter().filter(|_| pen.line) {
            for run in piece.split(|spot| spot.bar.is_none()).filter(|run| run.len() > 1) {
                let bars = || run.iter().filter_map(|spot| spot.bar.map(|bar| (spot.x, bar)));
                let forth = bars().map(|(x, (upper, _))| (x, upper));
                let back = bars().rev().map(|(x, (_, lower))| (x, lower));
                let points: Vec<_> = forth.chain(back).map(pair).collect();
                let _ = writeln!(
                    out,
                    "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"0.2\"/>",
                    points.join(" "),
                    pen.colour
                );
            }
        }
    }
    let (faint, strong): (Vec<_>, Vec<_>) = drawn.iter().partition(|(pen, ..)| pen.faint);
    for (pen, pieces, name) in faint.into_iter().chain(strong) {
        for piece in pieces {
            if pen.line && piece.len() > 1 {
                let points: Vec<_> = piece.iter().map(|spot| pair((spot.x, spot.y))).collect();
                let _ = writeln!(out, "<polyline points=\"{}\" {}/>", points.join(" "), pen.stroke());
            }
            for spot in piece.iter().filter(|_| !pen.line || piece.len() == 1) {
                if let Some((upper, lower)) = spot.bar {
                    let (x, from, to) = (coordinate(spot.x), coordinate(upper), coordinate(lower));
                    let (a, b) = (coordinate(spot.x - 5.0), coordinate(spot.x + 5.0));
                    let _ = writeln!(
                        out,
                        "<path d=\"M{x} {from}V{to}M{a} {from}H{b}M{a} {to}H{b}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\"/>",
                        pen.colour
                    );
                }
            }
            // A single point has no line that would show it.
            for spot in piece.iter().filter(|_| pen.markers || piece.len() == 1) {
                let (x, y) = spot.value;
                let tip = format!("{name}: ({x:e}{}, {y:e}{})", spaced(&chart.x.unit), spaced(&chart.y.unit));
                out.push_str(&pen.marker(spot.x, spot.y, &tip));
            }
        }
    }
}

/// The legend: rows of names above the chart, clear of its curves.
struct Legend {
    /// The series, the row, and the distance from the start of the row of each entry.
    entries: Vec<(usize, usize, f64)>,
    row_widths: Vec<f64>,
    rows: usize,
}

impl Legend {
    fn new(chart: &Chart) -> Self {
        let room = WIDTH - 2.0 * EDGE;
        let mut legend = Self { entries: Vec::new(), row_widths: Vec::new(), rows: 0 };
        for (i, series) in chart.series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
            let needed = SWATCH + text_width(&series.name, LEGEND_SIZE);
            let after = legend.row_widths.last().map(|used| used + 26.0);
            match (after, legend.row_widths.last_mut()) {
                (Some(start), Some(used)) if start + needed <= room => {
                    *used = start + needed;
                    legend.entries.push((i, legend.rows - 1, start));
                }
                _ => {
                    legend.row_widths.push(needed.min(room));
                    legend.entries.push((i, legend.rows, 0.0));
                    legend.rows += 1;
                }
            }
        }
        legend
    }

    fn draw(&self, out: &mut String, chart: &Chart, top: f64) {
        for &(i, row, start) in &self.entries {
            let series = &chart.series[i];
            let mut pen = Pen::new(i, series);
            // A line and its points share one entry.
            pen.markers |= chart.series.iter().any(|other| other.style == Style::Points { of: i });
            let x = 0.5 * (WIDTH - self.row_widths[row]) + start;
            let y = top + LEGEND_SIZE * (0.7 + 1.1 * LEADING * row as f64);
            if series.band.is_some() && pen.line {
                let (x, y) = (coordinate(x), coordinate(y - 6.0));
                let _ = writeln!(
                    out,
                    "<rect x=\"{x}\" y=\"{y}\" width=\"28\" height=\"12\" fill=\"{}\" fill-opacity=\"0.2\"/>",
                    pen.colour
                );
            }
            if pen.line {
                let (from, to, y) = (coordinate(x), coordinate(x + 28.0), coordinate(y));
                let _ = writeln!(out, "<path d=\"M{from} {y}H{to}\" {}/>", pen.stroke());
            }
            if pen.markers {
                out.push_str(&pen.marker(x + 14.0, y, ""));
            }
            let room = WIDTH - 2.0 * EDGE - SWATCH;
            let size = LEGEND_SIZE.min(LEGEND_SIZE * room / text_width(&series.name, LEGEND_SIZE).max(1.0));
            let _ = writeln!(
                out,
                "<text x=\"{}\" y=\"{}\" font-size=\"{}\">{}</text>",
                coordinate(x + SWATCH - 3.0),
                coordinate(y + 0.35 * LEGEND_SIZE),
                coordinate(size),
                escape(&series.name)
            );
        }
    }
}

fn pair((x, y): (f64, f64)) -> String {
    format!("{},{}", coordinate(x), coordinate(y))
}

fn spaced(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}

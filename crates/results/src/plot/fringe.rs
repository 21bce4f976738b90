//! Pictures of a field over a deformed body, in bands of colour between round levels.

use std::fmt::Write as _;

use super::Axis;
use super::axis::{Layout, round_values};
use super::draw::{
    BELOW, EDGE, Frame, LABEL_SIZE, LEADING, TICK_SIZE, TITLE_SIZE, WIDTH, draw_axes, open_page,
};
use super::text::{coordinate, escape, text_width, wrapped};

/// A field drawn over the deformed body. Both axes have the same scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Fringes {
    /// The title above the picture; wrapped if it is long.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The quantity shown by colours, with its unit.
    pub quantity: String,
    /// The range of values with different colours; values outside have the colours of the ends. `None` draws
    /// the cells alone.
    pub range: Option<(f64, f64)>,
    /// The cells of the body.
    pub cells: Vec<Cell>,
    /// Whether the cells are outlined.
    pub outlines: bool,
}

/// Nine points `(x, y, value)` of a quadrilateral, row after row: corners, middles of the sides, centre.
pub type Cell = [(f64, f64, f64); 9];

/// The colours from low to high for values of one sign, darker away from zero.
const ONE_SIGN: [(f64, f64, f64); 4] =
    [(255.0, 247.0, 236.0), (253.0, 187.0, 132.0), (215.0, 60.0, 45.0), (90.0, 0.0, 20.0)];
/// The colours from below to above zero.
const TWO_SIGNS: [(f64, f64, f64); 5] = [
    (8.0, 64.0, 129.0),
    (107.0, 174.0, 214.0),
    (247.0, 247.0, 247.0),
    (244.0, 140.0, 95.0),
    (140.0, 10.0, 30.0),
];
/// The points around the boundary of a cell.
const RING: [usize; 8] = [0, 1, 2, 5, 8, 7, 6, 3];
/// Width of the colour bar.
const BAR: f64 = 18.0;

impl Fringes {
    /// The picture as an SVG file, 800 units wide and as high as its content.
    pub fn to_svg(&self) -> String {
        let title = wrapped(&self.title, WIDTH - 2.0 * EDGE, TITLE_SIZE);
        let levels = self.levels();
        let labels: f64 = levels.iter().map(|(_, text)| text_width(text, TICK_SIZE)).fold(0.0, f64::max);
        let right =
            WIDTH - EDGE - if levels.is_empty() { 8.0 } else { BAR + 20.0 + labels + LABEL_SIZE * LEADING };
        let points = || self.cells.iter().flatten();
        let left = EDGE + LABEL_SIZE * LEADING + 8.0 + 3.5 * TICK_SIZE;
        let x = Layout::new(&self.x, points().map(|p| p.0), 8);
        let mut y = Layout::new(&self.y, points().map(|p| p.1), 6);
        let high = ((right - left) * y.span() / x.span()).clamp(60.0, 700.0);
        y = Layout::new(&self.y, points().map(|p| p.1), ((high / 40.0) as usize).clamp(2, 8));
        let top = EDGE + title.len() as f64 * TITLE_SIZE * LEADING + 10.0;
        let frame = Frame { left, right, top, bottom: top + high, x, y };
        let height = frame.bottom + BELOW;
        let mut out = open_page(&self.title, &title, height);
        draw_axes(&mut out, &frame);
        self.draw_bands(&mut out, &frame, &levels);
        if self.outlines {
            self.draw_outlines(&mut out, &frame);
        }
        draw_bar(&mut out, &frame, &levels, &self.quantity);
        out.push_str("</svg>\n");
        out
    }

    /// The levels between bands, with their labels.
    fn levels(&self) -> Vec<(f64, String)> {
        let Some((low, high)) = self.range.filter(|(low, high)| low < high) else { return Vec::new() };
        round_values(low, high, 0, 12)
    }

    fn draw_bands(&self, out: &mut String, frame: &Frame, levels: &[(f64, String)]) {
        let mut paths = vec![String::new(); levels.len() + 1];
        let band = |value: f64| levels.iter().take_while(|(level, _)| value >= *level).count();
        for cell in &self.cells {
            let first = band(cell[0].2);
            if cell.iter().all(|p| band(p.2) == first) {
                append(&mut paths[first], frame, &RING.map(|k| cell[k]));
                continue;
            }
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let at = |a: usize, b: usize| cell[3 * (j + b) + i + a];
                for triangle in [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]] {
                    let bands = triangle.map(|p| band(p.2));
                    let (low, high) = bands.iter().fold((usize::MAX, 0), |(l, h), b| (l.min(*b), h.max(*b)));
                    for (k, path) in paths.iter_mut().enumerate().take(high + 1).skip(low) {
                        let mut polygon = triangle.to_vec();
                        if k > low {
                            polygon = clip(&polygon, levels[k - 1].0, 1.0);
                        }
                        if k < high {
                            polygon = clip(&polygon, levels[k].0, -1.0);
                        }
                        append(path, frame, &polygon);
                    }
                }
            }
        }
        for (k, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
            // The thin line closes the seams that renderers leave between polygons.
            let colour = if levels.is_empty() { "#e8eef4".to_owned() } else { colour(levels, k) };
            let _ = writeln!(
                out,
                "<path d=\"{path}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0.4\"/>"
            );
        }
    }

    fn draw_outlines(&self, out: &mut String, frame: &Frame) {
        let mut path = String::new();
        for cell in &self.cells {
            append(&mut path, frame, &RING.map(|k| cell[k]));
        }
        let _ = writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"#345\" stroke-width=\"0.6\"/>");
    }
}

/// Draws the colour bar between these levels, with the levels and the quantity beside it.
pub(super) fn draw_bar(out: &mut String, frame: &Frame, levels: &[(f64, String)], quantity: &str) {
    if levels.is_empty() {
        return;
    }
    let (x, height) = (frame.right + 14.0, (frame.bottom - frame.top) / (levels.len() + 1) as f64);
    let edge = |k: usize| frame.bottom - height * k as f64;
    for k in 0..=levels.len() {
        let _ = writeln!(
            out,
            "<rect x=\"{}\" y=\"{}\" width=\"{BAR}\" height=\"{}\" fill=\"{}\"/>",
            coordinate(x),
            coordinate(edge(k + 1)),
            coordinate(height + 0.3),
            colour(levels, k)
        );
    }
    // Where bands are narrower than text, only every second or third level is labelled.
    let stride = (1.25 * TICK_SIZE / height).ceil().max(1.0) as usize;
    let _ = writeln!(out, "<g font-size=\"{TICK_SIZE}\">");
    for (k, (_, label)) in levels.iter().enumerate().filter(|(k, _)| k % stride == 0) {
        let (x, y) = (coordinate(x + BAR + 5.0), coordinate(edge(k + 1) + 0.35 * TICK_SIZE));
        let _ = writeln!(out, "<text x=\"{x}\" y=\"{y}\">{}</text>", escape(label));
    }
    let room = frame.bottom - frame.top + 60.0;
    let size = LABEL_SIZE.min(LABEL_SIZE * room / text_width(quantity, LABEL_SIZE).max(1.0));
    let _ = writeln!(
        out,
        "</g>\n<text transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\" font-size=\"{}\">{}</text>",
        coordinate(WIDTH - EDGE),
        coordinate(0.5 * (frame.top + frame.bottom)),
        coordinate(size),
        escape(quantity)
    );
}

/// The part of a polygon where `side * value >= side * level`.
pub(super) fn clip(polygon: &[(f64, f64, f64)], level: f64, side: f64) -> Vec<(f64, f64, f64)> {
    clip_by(polygon, |p| side * (p.2 - level))
}

/// The part of a polygon, or of a line, where this linear function of its points is not negative.
pub(super) fn clip_by(
    polygon: &[(f64, f64, f64)],
    distance: impl Fn(&(f64, f64, f64)) -> f64,
) -> Vec<(f64, f64, f64)> {
    let mut clipped = Vec::with_capacity(polygon.len() + 1);
    for (k, b) in polygon.iter().enumerate() {
        let a = &polygon[(k + polygon.len() - 1) % polygon.len()];
        let (da, db) = (distance(a), distance(b));
        if (da >= 0.0) != (db >= 0.0) {
            let t = da / (da - db);
            clipped.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1), a.2 + t * (b.2 - a.2)));
        }
        if db >= 0.0 {
            clipped.push(*b);
        }
    }
    clipped
}

/// Appends a closed polygon to the path, in tenths of a unit, without collinear points.
pub(super) fn append(path: &mut String, frame: &Frame, polygon: &[(f64, f64, f64)]) {
    let tenths = |v: f64| (10.0 * v).round() as i64;
    let mut points: Vec<(i64, i64)> =
        polygon.iter().filter_map(|p| Some((tenths(frame.x(p.0)?), tenths(frame.y(p.1)?)))).collect();
    points.dedup();
    let mut k = 0;
    while points.len() > 2 && k < points.len() {
        let n = points.len();
        let (a, b, c) = (points[(k + n - 1) % n], points[k], points[(k + 1) % n]);
        // Twice the area of the triangle at the corner, in hundredths of a square unit.
        if ((b.0 - a.0) * (c.1 - b.1) - (b.1 - a.1) * (c.0 - b.0)).abs() <= 4 {
            points.remove(k);
        } else {
            k += 1;
        }
    }
    if points.len() < 3 {
        return;
    }
    let text = |v: i64| {
        let sign = if v < 0 { "-" } else { "" };
        if v % 10 == 0 { format!("{}", v / 10) } else { format!("{sign}{}.{}", v.abs() / 10, v.abs() % 10) }
    };
    let mut last = points[0];
    let _ = write!(path, "M{} {}", text(last.0), text(last.1));
    path.push('l');
    for (k, point) in points.iter().enumerate().skip(1) {
        let (dx, dy) = (text(point.0 - last.0), text(point.1 - last.1));
        let gap = if k == 1 || dx.starts_with('-') { "" } else { " " };
        let between = if dy.starts_with('-') { "" } else { " " };
        let _ = write!(path, "{gap}{dx}{between}{dy}");
        last = *point;
    }
    path.push('z');
}

/// The colour of band `k`, which lies below level `k`.
pub(super) fn colour(levels: &[(f64, String)], k: usize) -> String {
    let (low, high) = (levels[0].0, levels[levels.len() - 1].0);
    let step = if levels.len() > 1 { levels[1].0 - low } else { 1.0 };
    let middle = low + step * (k as f64 - 0.5);
    let (low, high) = (low - 0.5 * step, high + 0.5 * step);
    let (stops, t): (&[_], f64) = if low < -0.6 * step && high > 0.6 * step {
        (&TWO_SIGNS, 0.5 + 0.5 * middle / low.abs().max(high.abs()))
    } else {
        (&ONE_SIGN, (middle / if high.abs() > low.abs() { high } else { low }).abs())
    };
    let place = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let k = (place as usize).min(stops.len() - 2);
    let mix = |a: f64, b: f64| (a + (place - k as f64) * (b - a)).round() as u8;
    let (a, b) = (stops[k], stops[k + 1]);
    format!("#{:02x}{:02x}{:02x}", mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Scale;

    fn area(polygon: &[(f64, f64, f64)]) -> f64 {
        let next = |k: usize| polygon[(k + 1) % polygon.len()];
        0.5 * (0..polygon.len()).map(|k| polygon[k].0 * next(k).1 - polygon[k].1 * next(k).0).sum::<f64>()
    }

    #[test]
    fn a_level_cuts_a_triangle_into_two_that_are_the_whole() {
        let triangle = [(0.0, 0.0, 1.0), (2.0, 0.0, 3.0), (0.5, 1.5, -1.0)];
        let (above, below) = (clip(&triangle, 0.4, 1.0), clip(&triangle, 0.4, -1.0));
        assert_eq!((above.len(), below.len()), (4, 3));
        assert!((area(&above) + area(&below) - area(&triangle)).abs() < 1e-14 && area(&below) > 0.0);
        assert!(clip(&triangle, 5.0, 1.0).is_empty() && clip(&triangle, 5.0, -1.0).len() == 3);
    }

    #[test]
    fn a_field_has_a_band_between_any_two_levels_and_cells_alone_have_outlines() {
        let cell: Cell = std::array::from_fn(|k| {
            let (s, t) = ((k % 3) as f64, (k / 3) as f64);
            (s, 0.5 * t, s - 1.0)
        });
        let axis = || Axis { label: "x & y".into(), unit: String::new(), scale: Scale::Linear };
        let mut picture = Fringes {
            title: "a <field>".into(),
            x: axis(),
            y: axis(),
            quantity: "value".into(),
            range: Some((-1.0, 1.0)),
            cells: vec![cell],
            outlines: false,
        };
        let levels = picture.levels();
        let svg = picture.to_svg();
        // One path for each band between levels.
        assert_eq!(svg.matches("stroke-width=\"0.4\"").count(), levels.len() - 1, "{levels:?}");
        assert_eq!(svg.matches("<rect").count(), 2 + levels.len() + 1);
        assert!(svg.contains("a &lt;field&gt;") && svg.contains("\u{2212}1.0"), "{svg}");
        picture.range = None;
        picture.outlines = true;
        let svg = picture.to_svg();
        assert!(svg.contains("stroke-width=\"0.6\"") && svg.matches("<rect").count() == 2);
    }
}

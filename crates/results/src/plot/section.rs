//! Pictures of the potential in a plane: bands of colour, equipotential lines between them, and arrows along
//! the field.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::Axis;
use super::axis::{Layout, round_values};
use super::draw::{
    BELOW, EDGE, Frame, LABEL_SIZE, LEADING, TICK_SIZE, TITLE_SIZE, WIDTH, draw_axes, open_page,
};
use super::fringe::{append, clip, clip_by, colour, draw_bar};
use super::text::{coordinate, escape, text_width, wrapped};

/// A section through a field. Both axes have the same scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// The title above the picture; wrapped if it is long.
    pub title: String,
    /// The position of the plane, in words; below the picture on the right.
    pub plane: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The visible region, as (lower, upper) along both axes. Metal fills the part without cells.
    pub window: [(f64, f64); 2],
    /// The cells with the potential at their corners.
    pub cells: Vec<SectionCell>,
    /// Conductors without thickness, from end to end.
    pub sheets: Vec<[[f64; 2]; 2]>,
    /// Names, and the middles of the named bodies.
    pub names: Vec<(String, [f64; 2])>,
}

/// A convex cell of a section.
///
/// Neighbouring cells of one body share corners, and cells of two bodies do not: a side that belongs to one
/// cell only is drawn as the outline of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionCell {
    /// The corners, once around, each with a number that identifies it, its coordinates x and y, and the
    /// potential there, V.
    pub corners: Vec<(u64, [f64; 3])>,
}

/// The approximate number of bands.
const BANDS: usize = 20;
/// The colour of metal.
const METAL: &str = "#4d4d4d";
/// Distance between arrows, and the length of the longest one.
const ARROWS: f64 = 26.0;
const ARROW: f64 = 21.0;
/// The length of an arrow is proportional to this power of the field, because fields at edges are much larger
/// than elsewhere.
const POWER: f64 = 0.3;
const NAME_SIZE: f64 = 12.0;

type Point = (f64, f64, f64);

impl Section {
    /// The picture as an SVG file, 800 units wide and as high as its content.
    pub fn to_svg(&self) -> String {
        let title = wrapped(&self.title, WIDTH - 2.0 * EDGE, TITLE_SIZE);
        let levels = self.levels();
        let labels: f64 = levels.iter().map(|(_, text)| text_width(text, TICK_SIZE)).fold(0.0, f64::max);
        let right = WIDTH - EDGE - 38.0 - labels - LABEL_SIZE * LEADING;
        let left = EDGE + LABEL_SIZE * LEADING + 8.0 + 3.5 * TICK_SIZE;
        let top = EDGE + title.len() as f64 * TITLE_SIZE * LEADING + 10.0;
        let [across, upward] = self.window.map(|(from, to)| to - from);
        // The full width, unless the picture would be too high.
        let scale = ((right - left) / across).min(640.0 / upward);
        let (wide, high) = (scale * across, scale * upward);
        let layout = |axis: &Axis, (from, to), length: f64, tick: f64| {
            Layout::between(axis, from, to, ((length / tick) as usize).clamp(2, 8))
        };
        let frame = Frame {
            left,
            right: left + wide,
            top,
            bottom: top + high,
            x: layout(&self.x, self.window[0], wide, 70.0),
            y: layout(&self.y, self.window[1], high, 40.0),
        };
        let mut out = open_page(&self.title, &title, frame.bottom + BELOW);
        draw_axes(&mut out, &frame);
        // Covers the grid lines of the axes, which do not belong in a picture.
        let place = format!(
            "x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"",
            coordinate(left),
            coordinate(top),
            coordinate(wide),
            coordinate(high)
        );
        let _ = writeln!(out, "<rect {place} fill=\"{METAL}\"/>");
        let triangles = self.triangles();
        draw_bands(&mut out, &frame, &levels, &triangles);
        draw_levels(&mut out, &frame, &levels, &triangles);
        draw_arrows(&mut out, &frame, &triangles);
        self.draw_outlines(&mut out, &frame);
        self.draw_names(&mut out, &frame);
        let _ = writeln!(out, "<rect {place} fill=\"none\" stroke=\"#555\" stroke-width=\"1\"/>");
        draw_bar(&mut out, &frame, &levels, "potential (V)");
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{}\" font-size=\"{TICK_SIZE}\" text-anchor=\"end\">{}</text>",
            coordinate(WIDTH - EDGE),
            coordinate(frame.bottom + BELOW - EDGE),
            escape(&self.plane)
        );
        out.push_str("</svg>\n");
        out
    }

    /// The levels between bands, with their labels.
    fn levels(&self) -> Vec<(f64, String)> {
        let values = || self.cells.iter().flat_map(|cell| &cell.corners).map(|(_, p)| p[2]);
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if low < high { round_values(low, high, 0, BANDS) } else { Vec::new() }
    }

    /// The part of the cells in the window, as triangles.
    fn triangles(&self) -> Vec<[Point; 3]> {
        let [(x0, x1), (y0, y1)] = self.window;
        let mut triangles = Vec::new();
        for cell in &self.cells {
            let mut polygon: Vec<Point> = cell.corners.iter().map(|(_, p)| (p[0], p[1], p[2])).collect();
            let inside = |p: &Point| p.0 >= x0 && p.0 <= x1 && p.1 >= y0 && p.1 <= y1;
            if !polygon.iter().all(inside) {
                polygon = clip_by(&polygon, |p| p.0 - x0);
                polygon = clip_by(&polygon, |p| x1 - p.0);
                polygon = clip_by(&polygon, |p| p.1 - y0);
                polygon = clip_by(&polygon, |p| y1 - p.1);
            }
            for k in 1..polygon.len().saturating_sub(1) {
                triangles.push([polygon[0], polygon[k], polygon[k + 1]]);
            }
        }
        triangles
    }

    /// Draws sides that belong to one cell only, and sheets.
    fn draw_outlines(&self, out: &mut String, frame: &Frame) {
        let mut sides: HashMap<[u64; 2], Option<[[f64; 3]; 2]>> = HashMap::new();
        for SectionCell { corners } in &self.cells {
            for (k, (from, p)) in corners.iter().enumerate() {
                let (to, q) = &corners[(k + 1) % corners.len()];
                let key = [*from.min(to), *from.max(to)];
                sides.entry(key).and_modify(|side| *side = None).or_insert(Some([*p, *q]));
            }
        }
        let mut single: Vec<_> = sides.into_iter().filter_map(|(key, side)| Some((key, side?))).collect();
        single.sort_by_key(|(key, _)| *key);
        let mut path = String::new();
        for (_, [p, q]) in single {
            self.append_line(&mut path, frame, [[p[0], p[1]], [q[0], q[1]]]);
        }
        let _ = writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.2\"/>");
        let mut path = String::new();
        self.sheets.iter().for_each(|sheet| self.append_line(&mut path, frame, *sheet));
        if !path.is_empty() {
            let _ =
                writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"{METAL}\" stroke-width=\"3.5\"/>");
        }
    }

    /// Appends the part of a line in the window to the path.
    fn append_line(&self, path: &mut String, frame: &Frame, line: [[f64; 2]; 2]) {
        let [(x0, x1), (y0, y1)] = self.window;
        let mut ends: Vec<Point> = line.iter().map(|p| (p[0], p[1], 0.0)).collect();
        ends = clip_by(&ends, |p| p.0 - x0);
        ends = clip_by(&ends, |p| x1 - p.0);
        ends = clip_by(&ends, |p| p.1 - y0);
        ends = clip_by(&ends, |p| y1 - p.1);
        // Clipping a line as a polygon repeats one of its ends.
        let Some(from) = ends.first() else { return };
        let apart = |p: &Point| (p.0 - from.0).hypot(p.1 - from.1);
        if let Some(to) = ends.iter().max_by(|p, q| apart(p).total_cmp(&apart(q))) {
            segment(path, frame, [*from, *to]);
        }
    }

    fn draw_names(&self, out: &mut String, frame: &Frame) {
        let [(x0, x1), (y0, y1)] = self.window;
        let _ = writeln!(out, "<g font-size=\"{NAME_SIZE}\" text-anchor=\"middle\">");
        let shown = self.names.iter().filter(|(_, [x, y])| (x0..=x1).contains(x) && (y0..=y1).contains(y));
        for (name, [x, y]) in shown {
            let (Some(x), Some(y)) = (frame.x(*x), frame.y(*y)) else { continue };
            let half = 0.5 * text_width(name, NAME_SIZE);
            let x = x.clamp(frame.left + half, (frame.right - half).max(frame.left + half));
            let (x, y) = (coordinate(x), coordinate(y + 0.35 * NAME_SIZE));
            // A white rim makes letters readable on dark and on light.
            let rim = "stroke=\"#fff\" stroke-width=\"3\" stroke-linejoin=\"round\" ";
            for look in [rim, ""] {
                let _ = writeln!(out, "<text {look}x=\"{x}\" y=\"{y}\">{}</text>", escape(name));
            }
        }
        out.push_str("</g>\n");
    }
}

fn draw_bands(out: &mut String, frame: &Frame, levels: &[(f64, String)], triangles: &[[Point; 3]]) {
    let mut paths = vec![String::new(); levels.len() + 1];
    let band = |value: f64| levels.partition_point(|(level, _)| *level <= value);
    for triangle in triangles {
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
    for (k, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
        // The thin line closes the seams that renderers leave between polygons.
        let colour = if levels.is_empty() { "#e8eef4".to_owned() } else { colour(levels, k) };
        let _ =
            writeln!(out, "<path d=\"{path}\" fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"0.5\"/>");
    }
}

/// Draws equipotential lines.
fn draw_levels(out: &mut String, frame: &Frame, levels: &[(f64, String)], triangles: &[[Point; 3]]) {
    let mut path = String::new();
    for triangle in triangles {
        let values = triangle.map(|p| p.2);
        let low =
            levels.partition_point(|(level, _)| *level <= values.iter().copied().fold(f64::MAX, f64::min));
        let high =
            levels.partition_point(|(level, _)| *level <= values.iter().copied().fold(f64::MIN, f64::max));
        for (level, _) in &levels[low..high] {
            let crossings: Vec<Point> = (0..3)
                .filter_map(|k| {
                    let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
                    if (p.2 >= *level) == (q.2 >= *level) {
                        return None;
                    }
                    let t = (level - p.2) / (q.2 - p.2);
                    Some((p.0 + t * (q.0 - p.0), p.1 + t * (q.1 - p.1), *level))
                })
                .collect();
            if let [from, to] = crossings.as_slice() {
                segment(&mut path, frame, [*from, *to]);
            }
        }
    }
    let _ = writeln!(
        out,
        "<path d=\"{path}\" fill=\"none\" stroke=\"#000\" stroke-opacity=\"0.45\" stroke-width=\"0.6\"/>"
    );
}

/// Draws arrows along the in-plane component of the field, on a square lattice.
fn draw_arrows(out: &mut String, frame: &Frame, triangles: &[[Point; 3]]) {
    let mut arrows: HashMap<[i64; 2], [f64; 2]> = HashMap::new();
    for triangle in triangles {
        let page = triangle.map(|p| Some([frame.x(p.0)?, frame.y(p.1)?, p.2]));
        let [Some(a), Some(b), Some(c)] = page else { continue };
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let twice = u[0] * v[1] - u[1] * v[0];
        if twice == 0.0 {
            continue;
        }
        let ends = |k: usize, start: f64| {
            let at = [a[k], b[k], c[k]].map(|x| (x - start) / ARROWS - 0.5);
            let (low, high) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
            low.ceil() as i64..=high.floor() as i64
        };
        for i in ends(0, frame.left) {
            for j in ends(1, frame.top) {
                let at = [frame.left + ARROWS * (i as f64 + 0.5), frame.top + ARROWS * (j as f64 + 0.5)];
                let w = [at[0] - a[0], at[1] - a[1]];
                let (s, t) = ((w[0] * v[1] - w[1] * v[0]) / twice, (u[0] * w[1] - u[1] * w[0]) / twice);
                if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
                    let (du, dv) = (b[2] - a[2], c[2] - a[2]);
                    let field =
                        [(du * v[1] - dv * u[1]) / twice, (dv * u[0] - du * v[0]) / twice].map(|g| -g);
                    arrows.insert([i, j], field);
                }
            }
        }
    }
    let strongest = arrows.values().map(|e| e[0].hypot(e[1])).fold(0.0, f64::max);
    let mut sorted: Vec<_> = arrows.into_iter().collect();
    sorted.sort_by_key(|(at, _)| *at);
    let mut path = String::new();
    for ([i, j], [e0, e1]) in sorted {
        let strength = e0.hypot(e1);
        let length = ARROW * (strength / strongest).powf(POWER);
        if !length.is_finite() || length < 4.0 {
            continue;
        }
        let (dx, dy) = (length * e0 / strength, length * e1 / strength);
        let (x, y) = (frame.left + ARROWS * (i as f64 + 0.5), frame.top + ARROWS * (j as f64 + 0.5));
        let (tip_x, tip_y) = (x + 0.5 * dx, y + 0.5 * dy);
        // The head: two strokes at 25 degrees from the shaft.
        let (c, s, share) = (0.906, 0.423, (5.0 / length).min(0.45));
        let side = |s: f64| (tip_x - share * (c * dx - s * dy), tip_y - share * (s * dx + c * dy));
        let (p, q) = (side(s), side(-s));
        let _ = write!(
            path,
            "M{} {}L{} {}M{} {}L{} {}L{} {}",
            coordinate(x - 0.5 * dx),
            coordinate(y - 0.5 * dy),
            coordinate(tip_x),
            coordinate(tip_y),
            coordinate(p.0),
            coordinate(p.1),
            coordinate(tip_x),
            coordinate(tip_y),
            coordinate(q.0),
            coordinate(q.1)
        );
    }
    let _ = writeln!(out, "<path d=\"{path}\" fill=\"none\" stroke=\"#111\" stroke-width=\"0.9\"/>");
}

/// Appends a line in tenths of a unit, unless it is shorter than one tenth.
fn segment(path: &mut String, frame: &Frame, ends: [Point; 2]) {
    let page = ends.map(|p| Some([frame.x(p.0)?, frame.y(p.1)?]));
    let [Some(a), Some(b)] = page else { return };
    // Coordinates on the page are positive.
    let [a, b] = [a, b].map(|p| p.map(|x| (10.0 * x).round() as u64));
    if a != b {
        for (command, [x, y]) in [('M', a), ('L', b)] {
            let _ = write!(path, "{command}{}.{} {}.{}", x / 10, x % 10, y / 10, y % 10);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Scale;

    #[test]
    fn a_uniform_field_has_straight_levels_arrows_across_them_and_an_outline_once_around() {
        // Two by one cells of side 1 in one body; the potential falls to the right.
        let corner = |i: u64, j: u64| (10 * i + j, [i as f64, j as f64, 1.0 - 0.5 * i as f64]);
        let cell = |i: u64| SectionCell {
            corners: vec![corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)],
        };
        let axis = || Axis { label: "x".into(), unit: "m".into(), scale: Scale::Linear };
        let section = Section {
            title: "a <field>".into(),
            plane: "plane x3 = 2 mm".into(),
            x: axis(),
            y: axis(),
            window: [(0.0, 2.0), (0.0, 1.0)],
            cells: vec![cell(0), cell(1)],
            sheets: vec![[[0.0, 0.5], [9.0, 0.5]]],
            names: vec![("plate & co".into(), [1.0, 0.5]), ("elsewhere".into(), [5.0, 0.5])],
        };
        let svg = section.to_svg();
        assert!(
            svg.contains("plane x3 = 2 mm")
                && svg.contains("a &lt;field&gt;")
                && svg.contains("plate &amp; co")
                && !svg.contains("elsewhere")
        );
        let path = |look: &str| -> Vec<Vec<f64>> {
            let line = svg.lines().find(|line| line.contains(look)).unwrap();
            let d = line.split('"').nth(1).unwrap();
            let numbers = |piece: &str| piece.split([' ', 'L']).map(|n| n.parse().unwrap()).collect();
            d.split('M').skip(1).map(numbers).collect()
        };
        let levels = path("stroke-opacity=\"0.45\"");
        assert!(levels.len() > 20 && levels.iter().all(|l| (l[0] - l[2]).abs() < 0.11), "{levels:?}");
        // From high potential to low: to the right, all of one length.
        let arrows = path("stroke=\"#111\"");
        let shafts: Vec<_> = arrows.iter().filter(|shaft| shaft.len() == 4).collect();
        assert!(shafts.len() > 50);
        assert!(shafts.iter().all(|s| (s[2] - s[0] - ARROW).abs() < 0.02 && (s[3] - s[1]).abs() < 0.02));
        // Six sides around the two cells, and none between the two.
        assert_eq!(path("stroke-width=\"1.2\"").len(), 6);
        // The sheet ends where the window does.
        let sheet = &path("stroke-width=\"3.5\"")[0];
        let wide = levels.iter().map(|l| l[0]).fold(0.0, f64::max);
        let end = sheet[0].max(sheet[2]);
        assert!(end > wide && end < WIDTH, "{sheet:?}");
    }
}

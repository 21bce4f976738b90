//! Graded tensor-product grids of box scenes.
//!
//! The field is singular at conductor edges, so that only elements that shrink geometrically towards every edge, with
//! degrees that grow away from it, make the error fall exponentially (Babuska and Guo's hp method).

mod refine;

pub use refine::Change;

use elastocap_fem::line::{Line, LineEnd};

/// How finely one axis is resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Degree of the elements farthest from the edges, at least 1.
    pub order: usize,
    /// Geometric layers at each conductor face.
    pub levels: usize,
    /// Size of a layer over the next larger one.
    pub ratio: f64,
    /// Degree gained per layer away from an edge.
    pub slope: f64,
    /// Degree of the element that touches an edge.
    pub first: usize,
}

/// A coordinate at which a body or the scene begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// m (or any one unit).
    pub at: f64,
    /// Whether a conductor begins or ends there: the field is singular at its edges.
    pub edge: bool,
}

/// Where the scene ends on one side of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// At the outermost plane.
    Closed,
    /// At infinity; what reaches there begins `radius` away from `pole`.
    Open {
        /// Centre of open space.
        pole: f64,
        /// Distance from the pole at which the scene looks small, beyond the outermost plane.
        reach: f64,
        /// Distance from the pole of the last finite node, at least `reach`.
        radius: f64,
    },
}

/// A graded axis: its elements, and the first element of every interval between planes (one more entry than
/// intervals). An open side adds one interval, from the outermost plane to infinity.
#[derive(Debug, Clone, PartialEq)]
pub struct GradedAxis {
    /// The elements.
    pub line: Line,
    /// First element of each interval, and one past the last.
    pub cuts: Vec<usize>,
    /// Whether the field is singular at the plane below each interval (and at the last one's upper end): at the edge of
    /// a conductor.
    pub edges: Vec<bool>,
}

/// Grades one axis.
pub fn graded_axis(planes: &[Plane], ends: [End; 2], resolution: &Resolution) -> GradedAxis {
    let mut nodes = Vec::new();
    let mut degrees = Vec::new();
    let mut cuts = vec![0];
    let mut line_ends = [LineEnd::Finite; 2];
    if let (End::Open { pole, reach, radius }, Some(first)) = (ends[0], planes.first()) {
        let (steps, degree) = outward(first, pole, [reach, radius], resolution);
        for (distance, p) in steps.iter().rev() {
            nodes.push(first.at - distance);
            degrees.push(*p);
        }
        line_ends[0] = LineEnd::Infinite { degree, pole };
        cuts.push(1 + degrees.len());
    }
    let shift = usize::from(line_ends[0] != LineEnd::Finite);
    let layers = layers(planes, ends, resolution);
    for (i, pair) in planes.windows(2).enumerate() {
        let (a, b) = (pair[0], pair[1]);
        for (start, p) in interval(a, b, [layers[i][1], layers[i + 1][0]], resolution) {
            nodes.push(start);
            degrees.push(p);
        }
        cuts.push(shift + degrees.len());
    }
    if let Some(last) = planes.last() {
        nodes.push(last.at);
        if let End::Open { pole, reach, radius } = ends[1] {
            let (steps, degree) = outward(last, pole, [reach, radius], resolution);
            for (distance, p) in &steps {
                nodes.push(last.at + distance);
                degrees.push(*p);
            }
            line_ends[1] = LineEnd::Infinite { degree, pole };
            cuts.push(shift + degrees.len() + 1);
        }
    }
    let open = line_ends.map(|end| end != LineEnd::Finite);
    let mut edges: Vec<bool> = planes.iter().map(|p| p.edge).collect();
    if open[0] {
        edges.insert(0, false);
    }
    if open[1] {
        edges.push(false);
    }
    GradedAxis { line: Line { nodes, degrees, ends: line_ends }, cuts, edges }
}

/// Degree of the element that is `layer` layers away from an edge.
fn degree(layer: usize, r: &Resolution) -> usize {
    (r.first + (r.slope * layer as f64).round() as usize).min(r.order).max(1)
}

/// Layers on the two sides of every plane, `[below, above]`; none at planes that are no edges.
///
/// Where intervals of unequal length meet, the shorter one needs fewer layers to reach elements of the same size: what
/// happens at the corners of a thin electrode matters as little as the electrode is thin.
fn layers(planes: &[Plane], ends: [End; 2], r: &Resolution) -> Vec<[usize; 2]> {
    // Length that is graded towards a plane: half of an interval with edges at both ends.
    let run = |i: usize, above: bool| -> f64 {
        let other = if above { i.checked_add(1) } else { i.checked_sub(1) };
        match other.and_then(|o| planes.get(o)) {
            Some(o) => (o.at - planes[i].at).abs() * if o.edge { 0.5 } else { 1.0 },
            None => match ends[usize::from(above)] {
                End::Open { pole, reach, .. } => reach - (planes[i].at - pole).abs(),
                End::Closed => 0.0,
            },
        }
    };
    (0..planes.len())
        .map(|i| {
            if !planes[i].edge {
                return [0, 0];
            }
            let runs = [run(i, false), run(i, true)];
            let longest = runs[0].max(runs[1]);
            runs.map(|length| {
                if length <= 0.0 {
                    return 0;
                }
                let fewer = ((longest / length).ln() / -r.ratio.ln() + SHIFT).floor().max(0.0) as usize;
                r.levels.saturating_sub(fewer)
            })
        })
        .collect()
}

/// How readily the shorter run loses a layer: 0 loses one when it is shorter by a whole layer, 1 at once.
const SHIFT: f64 = 0.5;

/// Lower node and degree of the elements between two planes, ascending, with so many layers at either.
fn interval(a: Plane, b: Plane, levels: [usize; 2], r: &Resolution) -> Vec<(f64, usize)> {
    let length = b.at - a.at;
    let mut out = Vec::new();
    let rising = |out: &mut Vec<(f64, usize)>, from: f64, length: f64, levels: usize| {
        out.push((from, degree(0, r)));
        for layer in 1..=levels {
            out.push((from + length * r.ratio.powi((levels + 1 - layer) as i32), degree(layer, r)));
        }
    };
    let falling = |out: &mut Vec<(f64, usize)>, from: f64, length: f64, levels: usize| {
        out.push((from, degree(levels, r)));
        for layer in (0..levels).rev() {
            out.push((from + length - length * r.ratio.powi((levels - layer) as i32), degree(layer, r)));
        }
    };
    match (a.edge, b.edge) {
        (true, true) => {
            rising(&mut out, a.at, 0.5 * length, levels[0]);
            falling(&mut out, a.at + 0.5 * length, 0.5 * length, levels[1]);
        }
        (true, false) => rising(&mut out, a.at, length, levels[0]),
        (false, true) => falling(&mut out, a.at, length, levels[1]),
        (false, false) => out.push((a.at, r.order)),
    }
    out
}

/// Distances from the outermost plane of the nodes outside it, with the degree of the element below each, and the
/// degree of the mapped element beyond.
///
/// The last node lies exactly `radius` from the pole.
fn outward(
    plane: &Plane,
    pole: f64,
    [reach, radius]: [f64; 2],
    r: &Resolution,
) -> (Vec<(f64, usize)>, usize) {
    let offset = (plane.at - pole).abs();
    // The first run of elements ends where the scene looks small, graded like any other interval.
    let length = reach - offset;
    let mut steps = Vec::new();
    if plane.edge {
        for layer in 0..=r.levels {
            let far = if layer == r.levels { 2 } else { 0 };
            steps.push((length * r.ratio.powi((r.levels - layer) as i32), degree(layer, r) + far));
        }
    } else {
        steps.push((length, r.order + 2));
    }
    // Farther out the elements are as coarse as they come and must be of higher degree; less and less energy is left
    // there, so that the degree may fall again.
    let mut p = r.order + 3;
    let layers = ((radius / reach).ln() / -r.ratio.ln() - 0.4).ceil().max(0.0) as i32;
    for layer in 1..=layers {
        let distance = reach * (radius / reach).powf(f64::from(layer) / f64::from(layers));
        steps.push((distance - offset, p));
        p = p.saturating_sub(1).max(2);
    }
    if let (0, Some(last)) = (layers, steps.last_mut()) {
        last.0 = radius - offset;
    }
    (steps, p)
}

//! Graded tensor-product grids for scenes of boxes.
//!
//! The field is singular at the edges of conductors. The error falls exponentially only if elements shrink
//! geometrically towards every edge while their degrees grow away from it (the hp method of Babuska and Guo,
//! Comput. Mech. 1, 1986).

mod changes;

pub use changes::Change;

use elastocap_fem::line::{Line, LineEnd};

/// The resolution of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Largest degree, that of the elements farthest from the edges; at least 1.
    pub order: usize,
    /// Number of geometric layers at each conductor face.
    pub levels: usize,
    /// Size of a layer relative to the next larger one, below 1.
    pub ratio: f64,
    /// Increase of the degree per layer away from an edge.
    pub slope: f64,
    /// Degree of the element at an edge.
    pub first: usize,
}

/// A coordinate at which a body or the scene begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The coordinate, m (or in another unit, if all planes have the same).
    pub at: f64,
    /// Whether a conductor begins or ends there, at whose edges the field is singular.
    pub edge: bool,
}

/// The end of the scene on one side of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The scene ends at the outermost plane.
    Closed,
    /// The scene extends to infinity. The infinite element begins at the distance `radius` from `pole`.
    Open {
        /// The coordinate from which the infinite element extends, m.
        pole: f64,
        /// Distance from the pole, beyond the outermost plane, at which the scene looks small, m.
        reach: f64,
        /// Distance of the last finite node from the pole, at least `reach`, m.
        radius: f64,
    },
}

/// A graded axis: its elements, and which of them lie in which interval between planes. An open side adds one
/// interval, from the outermost plane to infinity.
#[derive(Debug, Clone, PartialEq)]
pub struct GradedAxis {
    /// The elements.
    pub line: Line,
    /// The first element of each interval, and then the number of elements.
    pub cuts: Vec<usize>,
    /// Whether a conductor begins or ends at the lower end of each interval, and then at the upper end of the
    /// last one.
    pub edges: Vec<bool>,
}

/// Grades one axis between `planes`, which are ascending.
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

/// Numbers of layers on the two sides of every plane, `[below, above]`; zero at planes that are not edges.
///
/// Where intervals of unequal length meet, the shorter one needs fewer layers for elements of the same size:
/// the thinner an electrode, the less its corners matter.
fn layers(planes: &[Plane], ends: [End; 2], r: &Resolution) -> Vec<[usize; 2]> {
    // The length that is graded towards a plane is half the interval if there are edges at both of its ends.
    let graded_length = |i: usize, above: bool| -> f64 {
        let other = if above { i.checked_add(1) } else { i.checked_sub(1) };
        match other.and_then(|other| planes.get(other)) {
            Some(other) => (other.at - planes[i].at).abs() * if other.edge { 0.5 } else { 1.0 },
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
            let lengths = [graded_length(i, false), graded_length(i, true)];
            let longest = lengths[0].max(lengths[1]);
            lengths.map(|length| {
                if length <= 0.0 {
                    return 0;
                }
                let fewer = ((longest / length).ln() / -r.ratio.ln() + SHIFT).floor().max(0.0) as usize;
                r.levels.saturating_sub(fewer)
            })
        })
        .collect()
}

/// Controls when the shorter interval loses a layer: at 0 if it is shorter by a whole layer, at 1
/// immediately. Tuned: `cargo bench --bench targets`, the table of layers.
const SHIFT: f64 = 0.5;

/// The lower nodes and degrees of the elements between two planes, ascending, with these numbers of layers at
/// either plane.
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

/// The nodes outside the outermost plane, by their distances from it, each with the degree of the element on
/// its inner side; and the degree of the infinite element beyond.
///
/// The last node lies exactly at the distance `radius` from the pole.
fn outward(
    plane: &Plane,
    pole: f64,
    [reach, radius]: [f64; 2],
    r: &Resolution,
) -> (Vec<(f64, usize)>, usize) {
    let offset = (plane.at - pole).abs();
    // The first interval ends where the scene looks small, and is graded like any other.
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
    // Farther out, elements are as coarse as possible and need a higher degree. Since they hold less and less
    // energy, the degree may fall again.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_of_mirrored_planes_is_the_mirror_image_of_the_axis() {
        let at = [(0.0, false), (1.0, true), (1.3, true), (3.0, false), (3.5, true)];
        let planes = at.map(|(at, edge)| Plane { at, edge });
        let mut mirrored = at.map(|(at, edge)| Plane { at: -at, edge });
        mirrored.reverse();
        let open = |pole: f64| End::Open { pole, reach: 8.0, radius: 30.0 };
        for levels in 0..4 {
            let resolution = Resolution { order: levels + 2, levels, ratio: 0.13, slope: 1.0, first: 2 };
            let axis = graded_axis(&planes, [End::Closed, open(0.5)], &resolution);
            let image = graded_axis(&mirrored, [open(-0.5), End::Closed], &resolution);
            let nodes: Vec<f64> = image.line.nodes.iter().rev().map(|x| -x).collect();
            assert_eq!(nodes.len(), axis.line.nodes.len());
            assert!(
                nodes.iter().zip(&axis.line.nodes).all(|(a, b)| (a - b).abs() < 1e-14),
                "{axis:?} {image:?}"
            );
            assert!(image.line.degrees.iter().rev().eq(&axis.line.degrees), "{axis:?} {image:?}");
            let elements = axis.line.elements();
            assert!(image.cuts.iter().rev().map(|cut| elements - cut).eq(axis.cuts.iter().copied()));
            assert!(image.edges.iter().rev().eq(&axis.edges));
        }
    }
}

//! The first mesh of a layer: coarse, and fitted to the inclusions in the layer and to its indenter.

use super::layer::{End, Indenter, LayerMesh};
use super::layer_mesh::end_reach;
use super::mesh::{geometric, graded_to_edges, uniform};
use super::obstacle::IndenterProfile;

/// The approximate ratio of the squared contact radius of a round indenter to its radius times its
/// displacement: 1 on a half-space, and 2 where the surface around the contact does not move.
const CONTACT: f64 = 1.5;
/// Size of the elements at the edges of inclusions, over those where the layer is smooth. Tuned:
/// `benches/layer_growth.py`.
const AT_EDGES: f64 = 0.4;
/// Growth of the size of elements per distance, times the number of elements over the thickness, at more than
/// a thickness from the indenter. Tuned: `benches/layer_errors.py`.
const FAR_GROWTH: f64 = 2.0;
/// Distance over which the elements grow, over the thickness. Tuned: `benches/layer_errors.py`.
const FARTHEST_GROWTH: f64 = 2.0;
/// The largest half-length, over the thickness, of a layer with equal elements over its whole length. Tuned:
/// `benches/forces_in_space.py`.
const SHORT: f64 = 4.0;

/// The data that the first mesh depends on. Lengths in m.
#[derive(Debug, Clone)]
pub(crate) struct FirstMesh {
    /// Thickness at rest.
    pub(crate) thickness: f64,
    /// The distance from the middle of the layer to its end.
    pub(crate) half_length: f64,
    /// The coordinates along each axis at which inclusions begin and end.
    pub(crate) edges: [Vec<f64>; 3],
    /// The indenter that presses.
    pub(crate) indenter: Indenter,
    /// `x1` of the middle of the indenter. Where that is not 0, the whole layer is meshed, and not one half.
    pub(crate) position: f64,
    /// The condition at the end.
    pub(crate) end: End,
    /// The deepest compression among the goals.
    pub(crate) deepest: f64,
}

/// Where a fan around a bonded edge is cut into rings on the mesh with `n` elements over the thickness:
/// fractions of the way from that edge. The smallest ring is halved where `n` grows by two.
fn fan(n: usize) -> Vec<f64> {
    let rings = n.div_ceil(2);
    geometric(0.5_f64.powf(0.5 * n as f64 / rings as f64), rings)
}

impl FirstMesh {
    /// The section `x3 = 0` with about `n` elements over the thickness.
    pub(crate) fn section(&self, n: usize) -> LayerMesh {
        let (height, length, end) = (self.thickness, self.half_length, self.end_reach());
        let mut section = match self.indenter {
            // The fan takes up half the thickness, or less where an inclusion, the axis or the end of the
            // layer is near.
            Indenter::Held { half_width } | Indenter::Bonded { half_width } => {
                let highest = self.edges[1].iter().copied().fold(0.0, f64::max);
                let room = 0.5 * (length - end - half_width).min(half_width);
                let reach = (0.5 * height).min(0.9 * (height - highest)).min(room);
                LayerMesh::under_punch(height, length, [half_width, reach], n, 0.5, n / 2)
            }
            Indenter::WholeTop | Indenter::Smooth(_) => {
                let size = self.size(n, 0);
                let begin = if self.position == 0.0 { 0.0 } else { end - length };
                LayerMesh {
                    along: graded_to_edges(begin, length - end, &self.edges[0], |x| size(x - self.position)),
                    up: graded_to_edges(0.0, height, &self.edges[1], |y| {
                        (self.finest(n) + 0.5 * (height - y)).min(height / n as f64)
                    }),
                    end_top: uniform(length - end, length, n.div_ceil(2)),
                    radii: if self.end == End::Far { Vec::new() } else { fan(n) },
                    punch: None,
                }
            }
        };
        let LayerMesh { along, up, punch, .. } = &mut section;
        let fan_edges = punch.as_ref().map(|p| (p.along.map(|k| along[k]), up[p.up]));
        // Stress is singular at the edges of electrodes. Beside a fan, refinement there would take minutes
        // per load, and is left out; the stated error covers it.
        let smallest = if fan_edges.is_none() { AT_EDGES * height / n as f64 } else { f64::INFINITY };
        fit_to_edges(along, fan_edges.as_ref().map_or(&[][..], |k| &k.0[..]), &self.edges[0], smallest);
        fit_to_edges(
            up,
            fan_edges.as_ref().map_or(&[][..], |k| std::slice::from_ref(&k.1)),
            &self.edges[1],
            smallest,
        );
        if let (Some(punch), Some((ends, low))) = (punch, fan_edges) {
            let index = |x: f64, places: &[f64]| places.iter().position(|y| *y == x).unwrap_or(0);
            (punch.along, punch.up) = (ends.map(|x| index(x, along)), index(low, up));
        }
        section
    }

    /// The distance over which the elements at the end of the layer extend inwards, in m.
    pub(crate) fn end_reach(&self) -> f64 {
        end_reach(self.thickness, self.half_length, self.indenter.patch().unwrap_or(0.0))
    }

    /// Size of the smallest elements at the surface, in m, with about `n` over the thickness.
    pub(crate) fn finest(&self, n: usize) -> f64 {
        let part = if self.indenter.is_rounded() { 0.5 } else { 1.0 };
        part * self.thickness / n as f64
    }

    /// Size in m of the elements as a function of the distance from the middle of the indenter along `x1`
    /// (`axis` 0) or `x3` (1). They are finer where the surface bends around the indenter: for a round
    /// indenter, at the edge of the contact under the largest load and up to a thickness inside it, where the
    /// edge is under smaller loads.
    pub(crate) fn size(&self, n: usize, axis: usize) -> impl Fn(f64) -> f64 {
        let thickness = self.thickness;
        let depth = self.deepest * thickness;
        // The edge of the contact, and the distance inside it over which elements are as fine.
        let round = |radius: f64| ((CONTACT * radius * depth).sqrt().min(radius), thickness);
        let along_x1 = |edge: (f64, f64)| (axis == 0).then_some(edge);
        let edge = match self.indenter {
            Indenter::Smooth(profile) => match profile {
                IndenterProfile::Block { half_widths, .. } => Some((half_widths[axis], 0.0)),
                IndenterProfile::Sphere { radius } => Some(round(radius)),
                IndenterProfile::Cylinder { radius } => along_x1(round(radius)),
                IndenterProfile::Punch { half_width, .. } => along_x1((half_width, 0.0)),
            },
            Indenter::WholeTop | Indenter::Held { .. } | Indenter::Bonded { .. } => None,
        };
        let (fine, coarse, growth) = (self.finest(n), thickness / n as f64, FAR_GROWTH / n as f64);
        // Away from its end and its inclusions a layer under a plate varies over the length only.
        let longest = coarse * (self.half_length / (SHORT * thickness)).max(1.0);
        let end = self.half_length - self.end_reach();
        let edges = self.edges[axis * 2].clone();
        move |x: f64| {
            let x = x.abs();
            // Away from the indenter the displacement decays over about a thickness.
            match edge {
                Some((edge, inside)) => {
                    let away = (x - edge).max(edge - inside - x).max(0.0);
                    let far = (x - edge - thickness).clamp(0.0, FARTHEST_GROWTH * thickness);
                    (fine + 0.5 * away).min(coarse) + growth * far
                }
                None if axis == 0 => {
                    let away = edges.iter().map(|edge| (x - edge).abs()).fold(end - x, f64::min);
                    (coarse + 0.5 * (away - thickness).max(0.0)).min(longest)
                }
                None => coarse,
            }
        }
    }
}

/// Makes the `edges` of inclusions along an axis breakpoints, without moving the breakpoints that are `kept`,
/// and halves steps until none is longer than the sum of `smallest` (m) and its distance from the nearest
/// edge: stress is singular at the edges of a stiff body, and a mesh that is coarse there is too stiff.
pub(super) fn fit_to_edges(breakpoints: &mut Vec<f64>, kept: &[f64], edges: &[f64], smallest: f64) {
    move_to(breakpoints, kept, edges);
    refine_toward(breakpoints, edges, smallest);
}

/// Halves steps between breakpoints until none is longer than the sum of `smallest` and its distance from the
/// nearest of `edges`.
fn refine_toward(breakpoints: &mut Vec<f64>, edges: &[f64], smallest: f64) {
    let mut k = 1;
    while k < breakpoints.len() {
        let (from, to) = (breakpoints[k - 1], breakpoints[k]);
        let away = edges.iter().map(|edge| (from - edge).max(edge - to)).fold(f64::INFINITY, f64::min);
        if to - from > smallest + away.max(0.0) {
            breakpoints.insert(k, 0.5 * (from + to));
        } else {
            k += 1;
        }
    }
}

/// Moves the nearest breakpoint to each of `edges`. Inserts a new one where the nearest is the first or the
/// last, one of `kept`, or on another edge already.
fn move_to(breakpoints: &mut Vec<f64>, kept: &[f64], edges: &[f64]) {
    let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let tiny = 1e-9 * last;
    let mut fixed = vec![first, last];
    fixed.extend(kept);
    for &edge in edges.iter().filter(|e| **e > first + tiny && **e < last - tiny) {
        if fixed.iter().any(|f| (f - edge).abs() < tiny) {
            continue;
        }
        let after = breakpoints.partition_point(|x| *x < edge).min(breakpoints.len() - 1);
        let near = if edge - breakpoints[after - 1] < breakpoints[after] - edge { after - 1 } else { after };
        if fixed.contains(&breakpoints[near]) {
            breakpoints.insert(after, edge);
        } else {
            breakpoints[near] = edge;
        }
        fixed.push(edge);
    }
}

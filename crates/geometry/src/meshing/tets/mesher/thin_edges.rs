//! Points along the edges of thin metal, so that most triangles on its sides have right angles.
//!
//! The side of a plate is a strip as high as the plate is thick. Divided at the same places above and below,
//! it becomes rectangles, and these right-angled triangles, whatever their ratio of length to height: that
//! does no harm to bounds and solver. Bisecting the triangles of a strip that was left in long pieces instead
//! gives angles near 180 degrees, with which fluxes lose all accuracy. So the edges of thin bodies get their
//! points before anything is meshed, as near to each other as the tolerance calls for, and the mesh grows
//! from there.

use super::piecewise_linear_complex::PiecewiseLinearComplex;
use super::{Point, Sizing};
use crate::scene::{Box3, Scene};
use crate::shapes::Shape;
use elastocap_linalg::vector::{length, minus};

/// A point counts as inside a box if it is outside by no more than this share of the size of the box. Not
/// tuned: it only has to lie above rounding errors and below distances that matter.
const ROUNDING: f64 = 1e-9;

/// A conductor is thin if its thickness is less than this share of its width. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3`.
const THIN: f64 = 0.05;

/// The surroundings of a thin body, and how long edges there may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ThinEdges {
    /// The box around the body, which contains its edges.
    around: Box3,
    /// Largest length of an edge, m.
    pub(super) size: f64,
}

/// The thickness of a body with an extent in all directions, and the width that the field at its edges
/// extends over, m.
fn thickness_and_width(shape: &Shape, b: &Box3) -> [f64; 2] {
    let mut extents = [0, 1, 2].map(|a| b.extent(a));
    extents.sort_by(f64::total_cmp);
    let [thickness, width, _] = extents;
    let Shape::Extrusion { from, to, outline, .. } = shape else { return [thickness, width] };
    if to - from > thickness {
        return [thickness, width];
    }
    // Four times the area over the perimeter is the width of a square, and twice the width of a long strip or
    // of the arms of an outline that has many.
    let next = || outline.iter().cycle().skip(1);
    let area = 0.5 * outline.iter().zip(next()).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>().abs();
    let perimeter: f64 = outline.iter().zip(next()).map(|(p, q)| (q[0] - p[0]).hypot(q[1] - p[1])).sum();
    [thickness, width.min(4.0 * area / perimeter)]
}

/// The thin conductors of a scene. Sheets are not among them, since they have no sides.
pub(super) fn thin_edges(scene: &Scene, sizing: &Sizing) -> Vec<ThinEdges> {
    let thin = |(_, shape): (usize, &Shape)| {
        let around = shape.bounds()?;
        let [thickness, width] = thickness_and_width(shape, &around);
        // Shorter edges than this would not help: the sides need several rows of triangles then.
        let size = (sizing.thin_edge * width).max(0.5 * thickness);
        let is_thin = 0.0 < thickness && thickness < THIN * width && size < f64::INFINITY;
        is_thin.then_some(ThinEdges { around, size })
    };
    scene.conductor_parts().filter_map(thin).collect()
}

/// The approximate number of points along the edges of thin conductors: two rows of them around each
/// conductor. `None` if there are no thin conductors.
pub(super) fn points_along(thin: &[ThinEdges], domain: &Box3) -> Option<f64> {
    let points_around = |body: &ThinEdges| {
        let extents = [0, 1, 2].map(|a| {
            let inside = body.around.max[a].min(domain.max[a]) - body.around.min[a].max(domain.min[a]);
            inside.max(0.0)
        });
        let perimeter =
            2.0 * (extents.iter().sum::<f64>() - extents.iter().copied().fold(f64::INFINITY, f64::min));
        2.0 * perimeter / body.size
    };
    (!thin.is_empty()).then(|| thin.iter().map(points_around).sum())
}

/// Whether a point is in a box or next to it.
fn near(b: &Box3, p: Point) -> bool {
    let room = ROUNDING * [0, 1, 2].map(|a| b.extent(a)).into_iter().fold(0.0, f64::max);
    (0..3).all(|a| b.min[a] - room <= p[a] && p[a] <= b.max[a] + room)
}

impl PiecewiseLinearComplex {
    /// Divides the segments at thin bodies into equal parts that are short enough, and requires elements of
    /// that size there.
    pub(super) fn divide_edges(&mut self, thin: &[ThinEdges]) {
        if thin.is_empty() {
            return;
        }
        for ([a, b], facets) in std::mem::take(&mut self.segments) {
            let [p, q] = [a, b].map(|i| self.points[i as usize]);
            let around = thin.iter().filter(|body| near(&body.around, p) && near(&body.around, q));
            let size = around.map(|body| body.size).fold(f64::INFINITY, f64::min);
            let parts = if size < f64::INFINITY { (length(minus(q, p)) / size).ceil().max(1.0) } else { 1.0 };
            let mut last = a;
            for k in 1..=parts as usize {
                let share = k as f64 / parts;
                let next = if k == parts as usize {
                    b
                } else {
                    // Where the ends agree in a coordinate, the point between them has exactly the same.
                    self.point([0, 1, 2].map(|c| p[c] + share * (q[c] - p[c])), size)
                };
                facets.iter().for_each(|&f| self.add_segment(last, next, f));
                last = next;
            }
            for end in [a, b] {
                let end_size = &mut self.sizes[end as usize];
                *end_size = end_size.min(size);
            }
        }
    }
}

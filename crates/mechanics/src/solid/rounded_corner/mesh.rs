//! The mesh under a punch with rounded corners for one load: sides have the lengths that are asked for after loading.

use super::super::layer::{LayerMesh, LayerModel, RoundedPunch};
use super::super::mesh::{geometric, graded, graded_between, uniform};
use super::super::model::State;
use super::super::press::PlaneLayer;

/// Distance from the middle of the corner's arc, over its radius, within which sides are equally short.
pub(super) const PLATEAU: f64 = 1.5;
/// Growth of the length of sides per distance from there, and of the height of elements per depth.
const GROWTH: f64 = 0.25;
/// The same from the edges of inclusions, where stress is singular and strain small.
const GROWTH_FROM_EDGES: f64 = 0.4;
/// Pieces of the line between two nodes of the surface in which the length of sides is constant.
const PIECES: usize = 8;
/// Places on either side of the corner between which the length of sides at rest is read off.
const AT_REST: usize = 100;

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fineness {
    /// Sides over the radius of the corner, where the surface lies at it.
    pub(super) passing: f64,
    /// Elements over the thickness far from the corner.
    pub(super) cells: f64,
    /// Size of the elements at the edges of inclusions, over the thickness.
    pub(super) at_edges: f64,
}

impl Fineness {
    /// Of the mesh that takes over from a sharp punch.
    pub(super) const FIRST: Self = Self { passing: 0.375, cells: 8.0, at_edges: 0.1 };

    pub(super) fn of(level: usize) -> Self {
        let halved = 0.5_f64.powi(level as i32);
        Self { passing: 1.0 / halved, cells: 8.0 / halved.powf(0.25), at_edges: 0.00625 * halved }
    }

    /// Between this and a finer one.
    pub(super) fn halfway(self, to: Self) -> Self {
        Self {
            passing: (self.passing * to.passing).sqrt(),
            cells: (self.cells * to.cells).sqrt(),
            at_edges: (self.at_edges * to.at_edges).sqrt(),
        }
    }
}

impl PlaneLayer {
    /// The mesh for a punch with rounded corners on the middle of the layer before it is pressed.
    pub(in crate::solid) fn mesh_at_corner(&self, punch: RoundedPunch, level: usize) -> LayerMesh {
        // Places ever closer to the corner.
        let [to_axis, to_end] = [punch.half_width, self.half_length - punch.half_width];
        let inside = geometric(0.8, AT_REST).into_iter().rev().map(|part| punch.half_width - part * to_axis);
        let outside =
            geometric(0.8, AT_REST).into_iter().skip(1).map(|part| punch.half_width + part * to_end);
        let at_rest: Vec<_> = inside.chain(outside).map(|x| [[x, self.thickness]; 2]).collect();
        self.mesh_where_corner_is(punch, Fineness::of(level), &at_rest, 0.0)
    }

    /// The mesh for a punch at a compression under which the top lies about at `surface`: places at rest and after loading, in m.
    pub(super) fn mesh_where_corner_is(
        &self,
        punch: RoundedPunch,
        fineness: Fineness,
        surface: &[[[f64; 2]; 2]],
        compression: f64,
    ) -> LayerMesh {
        let (height, body, radius) = (self.thickness, self.half_length - self.thickness, punch.corner_radius);
        let (coarse, fine) = (height / fineness.cells, radius / fineness.passing);
        let from_edges = |x: f64, axis: usize| {
            self.edges(axis).fold(f64::INFINITY, |least, edge| {
                least.min(fineness.at_edges * height + GROWTH_FROM_EDGES * (x - edge).abs())
            })
        };
        // The middle of the corner's arc.
        let inside = radius * (1.0 - 0.5_f64.sqrt());
        let arc = [punch.half_width - inside, height * (1.0 - compression) + inside];
        let (mut places, mut steps) = (Vec::new(), Vec::new());
        for two in surface.windows(2) {
            let [[from, start], [to, end]] = [two[0], two[1]];
            let (rest, now) = (to[0] - from[0], (end[0] - start[0]).hypot(end[1] - start[1]));
            for part in (0..PIECES).map(|k| k as f64 / PIECES as f64) {
                let place = from[0] + part * rest;
                if place >= (1.0 - 1e-9) * body {
                    break;
                }
                let middle: [f64; 2] =
                    std::array::from_fn(|k| start[k] + (part + 0.5 / PIECES as f64) * (end[k] - start[k]));
                let away = (middle[0] - arc[0]).hypot(middle[1] - arc[1]) - PLATEAU * radius;
                let after = fine + GROWTH * away.max(0.0);
                let far = if place < punch.half_width { coarse } else { 2.0 * coarse };
                let before = far.min(from_edges(place, 0));
                places.push(place);
                steps.push((now / after).max(rest / before) / PIECES as f64);
            }
        }
        places.push(body);
        let mut along = graded_between(&places, |k| steps[k]);
        let size = |y: f64| (fine + GROWTH * (height - y)).min(coarse).min(from_edges(y, 1));
        let mut up = graded(0.0, height, size);
        // Between places of the surface that are far apart an edge may have been missed.
        self.fit_to_inclusions([&mut along, &mut up], [&[], &[]], fineness.at_edges * height);
        let end = (0.5 * fineness.cells).round() as usize;
        let end_top = uniform(body, self.half_length, end);
        LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: None, whole: false }
    }
}

/// The places of the nodes of the top at rest and after loading, from the axis outwards, in m.
pub(super) fn surface(model: &LayerModel, state: &State) -> Vec<[[f64; 2]; 2]> {
    let nodes = &model.equations().body().mesh.nodes;
    let top = model.thickness * (1.0 - 1e-9);
    let after = |n: usize| std::array::from_fn(|k| nodes[n][k] + state.displacement[2 * n + k]);
    let on_top = (0..nodes.len()).filter(|&n| nodes[n][1] > top);
    let mut surface: Vec<[[f64; 2]; 2]> = on_top.map(|n| [nodes[n], after(n)]).collect();
    surface.sort_by(|a, b| a[0][0].total_cmp(&b[0][0]));
    surface
}

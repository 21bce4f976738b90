//! The mesh under a punch with rounded corners for one load: sides have the lengths that are asked for after loading.

use super::super::layer::{LayerMesh, LayerModel, RoundedPunch};
use super::super::layer_mesh::about;
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

/// Places of the top at rest and after loading, in m, ascending.
type Surface = [[[f64; 2]; 2]];

impl PlaneLayer {
    /// The mesh for a punch with rounded corners before it is pressed.
    pub(in crate::solid) fn mesh_at_corners(&self, punch: RoundedPunch, level: usize) -> LayerMesh {
        let RoundedPunch { half_width, position, .. } = punch;
        // On each side places ever closer to the corner.
        let at_rest = |side: f64| {
            let to_end = self.half_length - side * position - half_width;
            let inside = geometric(0.8, AT_REST).into_iter().rev().map(|part| half_width - part * half_width);
            let outside = geometric(0.8, AT_REST).into_iter().skip(1).map(|part| half_width + part * to_end);
            inside.chain(outside).collect::<Vec<_>>()
        };
        let along =
            if position == 0.0 { at_rest(1.0) } else { about(position, &at_rest(-1.0), &at_rest(1.0)) };
        let at_rest: Vec<_> = along.into_iter().map(|x| [[x, self.thickness]; 2]).collect();
        self.mesh_where_corners_are(punch, Fineness::of(level), &at_rest, 0.0)
    }

    /// The mesh for a punch at a compression under which the top lies about at `surface`.
    pub(super) fn mesh_where_corners_are(
        &self,
        punch: RoundedPunch,
        fineness: Fineness,
        surface: &Surface,
        compression: f64,
    ) -> LayerMesh {
        let (height, body) = (self.thickness, self.half_length - self.thickness);
        let along = |side: f64| {
            let seen = seen_from(punch.position, side, surface);
            self.along_one_side(punch, side, fineness, &seen, compression)
        };
        let mut along = match punch.position {
            0.0 => along(1.0),
            position => about(position, &along(-1.0), &along(1.0)),
        };
        let (coarse, fine) = (height / fineness.cells, punch.corner_radius / fineness.passing);
        let size =
            |y: f64| (fine + GROWTH * (height - y)).min(coarse).min(self.size_from_edges(fineness, y, 1));
        let mut up = graded(0.0, height, size);
        // Between places of the surface that are far apart an edge may have been missed.
        let smallest = fineness.at_edges * height;
        self.fit_to_inclusions([&mut along, &mut up], [&[punch.position], &[]], smallest);
        let end = (0.5 * fineness.cells).round() as usize;
        let end_top = uniform(body, self.half_length, end);
        LayerMesh { along, up, end_top, radii: geometric(0.5, 1), punch: None }
    }

    /// Breakpoints from the middle of the punch to one side, 1 to the right and -1 to the left: distances from there in m. `surface` is the
    /// top [as seen from there](seen_from).
    fn along_one_side(
        &self,
        punch: RoundedPunch,
        side: f64,
        fineness: Fineness,
        surface: &Surface,
        compression: f64,
    ) -> Vec<f64> {
        let (height, radius) = (self.thickness, punch.corner_radius);
        let body = self.half_length - height - side * punch.position;
        let (coarse, fine) = (height / fineness.cells, radius / fineness.passing);
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
                let before = far.min(self.size_from_edges(fineness, punch.position + side * place, 0));
                places.push(place);
                steps.push((now / after).max(rest / before) / PIECES as f64);
            }
        }
        places.push(body);
        graded_between(&places, |k| steps[k])
    }

    /// Size (m) of elements at `x` (m) on an axis that the inclusions ask for.
    fn size_from_edges(&self, fineness: Fineness, x: f64, axis: usize) -> f64 {
        self.edges(axis).fold(f64::INFINITY, |least, edge| {
            least.min(fineness.at_edges * self.thickness + GROWTH_FROM_EDGES * (x - edge).abs())
        })
    }
}

/// The top to one side of a punch whose middle is at `position` (m), 1 to the right and -1 to the left, by the distance from there: the
/// left side as in a mirror.
fn seen_from(position: f64, side: f64, surface: &Surface) -> Vec<[[f64; 2]; 2]> {
    let away = |[x, y]: [f64; 2]| [side * (x - position), y];
    let mut seen: Vec<_> = surface.iter().map(|place| place.map(away)).collect();
    if side < 0.0 {
        seen.reverse();
    }
    let first = seen.partition_point(|[rest, _]| rest[0] < 0.0);
    if first > 0 && first < seen.len() {
        // The place on the middle, which nearly is one of the surface already.
        let [before, after] = [seen[first - 1], seen[first]];
        let part = before[0][0] / (before[0][0] - after[0][0]);
        let between = |n: usize| std::array::from_fn(|k| before[n][k] + part * (after[n][k] - before[n][k]));
        seen[first - 1] = [[0.0, before[0][1]], between(1)];
        seen.drain(..first - 1);
    }
    seen
}

/// The places of the nodes of the top at rest and after loading, from the axis or the left end to the right, in m.
pub(super) fn surface(model: &LayerModel, state: &State) -> Vec<[[f64; 2]; 2]> {
    let nodes = &model.equations().body().mesh.nodes;
    let top = model.thickness * (1.0 - 1e-9);
    let after = |n: usize| std::array::from_fn(|k| nodes[n][k] + state.displacement[2 * n + k]);
    let on_top = (0..nodes.len()).filter(|&n| nodes[n][1] > top);
    let mut surface: Vec<[[f64; 2]; 2]> = on_top.map(|n| [nodes[n], after(n)]).collect();
    surface.sort_by(|a, b| a[0][0].total_cmp(&b[0][0]));
    surface
}

//! The map of a layer that contains only a pair of electrodes: boxes, and their positions in the
//! finite-element solution.
//!
//! Every point of the boxes of the layer is assigned a material point: faces of electrodes and the surface
//! are assigned their own material points, which move as in the finite-element solution. Towards walls the
//! points slide along the layer instead: they keep their coordinates along x1 and x3, at the height of the
//! layer there. In open space the layer continues outside the map at the mean height of its surface there.
//! Above the layer the displacement falls to zero at the wall, or over [`DECAY`] thicknesses; likewise below,
//! where points slide along the substrate. All maps with these properties give the same scene, so that the
//! polynomials of the solver's map may differ from the finite elements between electrodes. Their difference
//! on faces is part of the geometric error.

use elastocap_case::{Electrodes, Layout};
use elastocap_electrostatics::{MapAxis, SceneMap};
use elastocap_geometry::scene::{Box3, Purpose, Scene, Wall};
use elastocap_geometry::shapes::Shape;

use super::room::Others;
use super::surface::DECAY;
use crate::deform::{FiniteElementStep, Material};
use crate::scene::DeformedScene;

/// Degree of the map's polynomials along and across the electrodes, over their height, between them and the
/// faces of the layer, and beside them. Tuned: time and `geometry_error_estimate` of
/// `elastocap run cases/pair-under-sphere.toml`.
const ALONG: usize = 8;
const OVER_ELECTRODE: usize = 2;
const BETWEEN: usize = 4;
const BESIDE: usize = 6;

/// The frame of the map: the coordinates in which the boxes are given that the map starts from. Planes before
/// loading are planes in the frame, too.
pub(super) struct Frame {
    /// Planes of each axis before loading and in the frame: `[material, frame]`, ascending. On the first and
    /// the third axis the last plane is the end of the map.
    planes: [Vec<[f64; 2]>; 3],
    /// The height at which the map ends below the layer, m; `None` where it ends at the lower face of the
    /// layer.
    below: Option<f64>,
    /// The height at which the map ends above the layer, m; `None` where the upper face of the layer is a
    /// wall.
    above: Option<f64>,
    /// Whether the layer continues outside the map.
    is_open: bool,
    /// The coordinate on each axis, in the frame, up to which points keep their material point: at least the
    /// last plane of an electrode.
    last: [f64; 3],
    /// The electrodes before loading: of a pair in one plane the right one, of a stacked pair both.
    electrodes: Vec<Box3>,
    layout: Layout,
}

impl Frame {
    /// The frame around the pair, in which the surface is followed at least up to `cover` along x1 and x3, m.
    /// `None` without a pair, where the planes do not ascend, or where there is no room above the layer.
    pub(super) fn new(
        deformed: &DeformedScene,
        electrodes: &Electrodes,
        step: &FiniteElementStep,
        material: &Material<'_>,
        cover: [f64; 2],
        others: &Others,
    ) -> Option<Self> {
        let pair = deformed.pair?;
        let before = electrodes.regions();
        let mut after = Vec::new();
        for place in pair.places {
            let conductor = deformed.scene.conductors().nth(place.conductor)?;
            after.push(conductor.body.parts.get(place.part)?.bounds()?);
        }
        let before_and_after: Vec<(Box3, Box3)> = before.into_iter().zip(after).collect();
        let tiny = material.tiny;
        let mut planes: [Vec<[f64; 2]>; 3] = Default::default();
        for (axis, planes) in planes.iter_mut().enumerate() {
            // Planes of several electrodes that coincide before loading stay one plane, at their mean.
            let mut pairs: Vec<[f64; 2]> = before_and_after
                .iter()
                .flat_map(|(b, a)| [[b.min[axis], a.min[axis]], [b.max[axis], a.max[axis]]])
                .collect();
            pairs.retain(|p| axis == 1 || p[0] > tiny);
            pairs.sort_by(|p, q| p[0].total_cmp(&q[0]));
            for group in pairs.chunk_by(|p, q| q[0] - p[0] < tiny) {
                let mean = |k: usize| group.iter().map(|p| p[k]).sum::<f64>() / group.len() as f64;
                planes.push([mean(0), mean(1)]);
            }
        }
        for (axis, cover) in [(0, cover[0]), (2, cover[1])] {
            let [before, after] = *planes[axis].last()?;
            if cover > after + tiny {
                planes[axis].push([before + cover - after, cover]);
            }
        }
        let last = [0, 1, 2].map(|a| planes[a].last().map_or(0.0, |p| p[1]));
        let domain = &deformed.scene.domain;
        for axis in [0, 2] {
            let [before, after] = *planes[axis].last()?;
            let end =
                if domain.max[axis].is_finite() { domain.max[axis] } else { after + DECAY * material.pad[1] };
            planes[axis].insert(0, [0.0, 0.0]);
            planes[axis].push([before + end - after, end]);
        }
        let is_open = [0, 2].iter().any(|&a| deformed.scene.walls[a][1] == Wall::Open);
        let surface = surface(&planes, is_open, material);
        planes[1].retain(|p| p[0] > tiny && p[0] < material.pad[1] - tiny);
        planes[1].insert(0, [0.0, 0.0]);
        planes[1].push([material.pad[1], surface]);
        let depth = if domain.min[1].is_finite() { domain.min[1] } else { -DECAY * material.pad[1] };
        let below = (depth < -tiny).then_some(depth);
        let is_wall = domain.max[1] <= step.deformed_thickness + tiny;
        let reach = surface + DECAY * material.pad[1];
        let ends = [0, 2].map(|a| planes[a].last().map_or(0.0, |p| p[1]));
        let above = if domain.max[1].is_finite() { domain.max[1] } else { reach };
        let above = (!is_wall).then_some(above.min(others.ceiling(&ends.map(|end| [-end, end]))));
        let ascending =
            |p: &[[f64; 2]]| p.windows(2).all(|w| w[1][0] - w[0][0] > tiny && w[1][1] - w[0][1] > tiny);
        let has_room = above.is_none_or(|above| above > surface + tiny);
        let layout = electrodes.layout;
        let solved = match layout {
            Layout::InPlane => vec![before[1]],
            Layout::Stacked => before.to_vec(),
        };
        (planes.iter().all(|p| ascending(p)) && has_room).then_some(Self {
            planes,
            below,
            above,
            is_open,
            last,
            electrodes: solved,
            layout,
        })
    }

    /// The height of the surface in the frame, m.
    pub(super) fn surface(&self) -> f64 {
        self.planes[1].last().map_or(0.0, |p| p[1])
    }

    /// The height of the highest electrode in the frame, m.
    pub(super) fn highest(&self) -> f64 {
        self.last[1]
    }

    /// The coordinate in the frame that belongs to the coordinate `y` before loading.
    fn of_material(&self, axis: usize, y: f64) -> f64 {
        between(&self.planes[axis], y, 0, 1)
    }

    /// The image in the frame of a box before loading.
    fn of_box(&self, region: &Box3) -> Box3 {
        // The frame is mirror-symmetric on each axis.
        let coordinate = |axis: usize, y: f64| {
            if y < 0.0 { -self.of_material(axis, -y) } else { self.of_material(axis, y) }
        };
        Box3 {
            min: [0, 1, 2].map(|a| coordinate(a, region.min[a])),
            max: [0, 1, 2].map(|a| coordinate(a, region.max[a])),
        }
    }

    /// The scene with the bodies as boxes in the coordinates of the frame; `None` where the layout and the
    /// electrodes do not fit together.
    pub(super) fn scene(&self, deformed: &DeformedScene, step: &FiniteElementStep) -> Option<Scene> {
        let pair = match (self.layout, self.electrodes.as_slice()) {
            (Layout::InPlane, [right]) => {
                let right = self.of_box(right);
                let mut left = right;
                (left.min[0], left.max[0]) = (-right.max[0], -right.min[0]);
                [left, right]
            }
            (Layout::Stacked, [lower, upper]) => [self.of_box(lower), self.of_box(upper)],
            (Layout::InPlane | Layout::Stacked, _) => return None,
        };
        let mut scene = deformed.with_pair(pair);
        let surface = self.planes[1].last()?[1];
        for body in &mut scene.bodies {
            for part in &mut body.parts {
                let Shape::Box(region) = part else { continue };
                match body.purpose {
                    Purpose::Layer if region.max[1].is_finite() => region.max[1] = surface,
                    Purpose::Cover => region.min[1] = surface,
                    Purpose::Layer
                    | Purpose::Substrate
                    | Purpose::Electrode
                    | Purpose::InLayer
                    | Purpose::OnTop
                    | Purpose::Indenter
                    | Purpose::OnIndenter
                    | Purpose::Fixed => {}
                }
            }
        }
        if self.above.is_none() && scene.domain.max[1] <= step.deformed_thickness * (1.0 + 1e-9) {
            scene.domain.max[1] = surface;
        }
        Some(scene)
    }

    /// The region above the substrate that the map changes.
    pub(super) fn zone(&self) -> Box3 {
        let [along, surface, across] = [0, 1, 2].map(|a| self.planes[a].last().map_or(0.0, |p| p[1]));
        Box3 { min: [-along, 0.0, -across], max: [along, self.above.unwrap_or(surface), across] }
    }

    /// The grid of the map's polynomials.
    pub(super) fn axes(&self) -> [MapAxis; 3] {
        let breaks = |a: usize| self.planes[a].iter().map(|p| p[1]).collect::<Vec<f64>>();
        let mut across: Vec<f64> = breaks(1);
        let is_electrode = |ends: &[[f64; 2]]| {
            let middle = 0.5 * (ends[0][0] + ends[1][0]);
            self.electrodes.iter().any(|e| e.min[1] < middle && middle < e.max[1])
        };
        let mut degrees: Vec<usize> = self.planes[1]
            .windows(2)
            .map(|w| if is_electrode(w) { OVER_ELECTRODE } else { BETWEEN })
            .collect();
        if let Some(above) = self.above {
            across.push(above);
            degrees.push(1);
        }
        if let Some(below) = self.below {
            across.insert(0, below);
            degrees.insert(0, 1);
        }
        let horizontal = |a: usize| {
            let breaks = breaks(a);
            let mut degrees = vec![ALONG; breaks.len() - 1];
            if let Some(last) = degrees.last_mut() {
                *last = BESIDE;
            }
            MapAxis { breaks, degrees, mirrored: true }
        };
        [horizontal(0), MapAxis { breaks: across, degrees, mirrored: false }, horizontal(2)]
    }

    /// The image of a point of the frame in the solved quarter.
    pub(super) fn image(&self, x: [f64; 3], material: &Material<'_>) -> [f64; 3] {
        let surface = self.planes[1].last().map_or(0.0, |p| p[1]);
        let beyond = match (self.below, self.above) {
            (Some(below), _) if x[1] < 0.0 => Some((0.0, below)),
            (_, Some(above)) if x[1] > surface => Some((surface, above)),
            _ => None,
        };
        if let Some((face, end)) = beyond {
            let rest = ((end - x[1]) / (end - face)).clamp(0.0, 1.0);
            let on_face = [x[0], face, x[2]];
            let to = self.image(on_face, material);
            return [0, 1, 2].map(|a| x[a] + rest * (to[a] - on_face[a]));
        }
        let y = [0, 1, 2].map(|a| between(&self.planes[a], x[a], 1, 0));
        let to = material.position(y);
        let rest = |a: usize| {
            let end = self.planes[a].last().map_or(0.0, |p| p[1]);
            ((end - x[a]) / (end - self.last[a])).clamp(0.0, 1.0)
        };
        let share = rest(0) * rest(2);
        if share == 1.0 {
            return to;
        }
        let place = [x[0] + share * (to[0] - x[0]), x[2] + share * (to[2] - x[2])];
        let height = material.height_at(y, place);
        let up = if self.is_open { x[1] + share * (height - x[1]) } else { height };
        [place[0], up, place[1]]
    }

    /// The distance of the mapped faces of the electrodes and of the mapped surface from their finite-element
    /// positions, over the size that it distorts, see [`super::BentScene::deviation`]. `gap` is the gap
    /// between the electrodes, m.
    pub(super) fn deviation(&self, map: &SceneMap, material: &Material<'_>, gap: f64) -> f64 {
        // Not tuned: the places only have to be close together.
        /// Samples along each direction of a face.
        const COUNT: usize = 7;
        let sample =
            |ends: [f64; 2], i: usize| ends[0] + (ends[1] - ends[0]) * (i as f64 + 0.5) / COUNT as f64;
        let root_mean_square = |points: &[(usize, [f64; 3])]| {
            let difference =
                |(axis, x): &(usize, [f64; 3])| map.image(*x)[*axis] - self.image(*x, material)[*axis];
            (points.iter().map(|p| difference(p).powi(2)).sum::<f64>() / points.len().max(1) as f64).sqrt()
        };
        let mut worst: f64 = 0.0;
        for region in &self.electrodes {
            let solved =
                self.of_box(&Box3 { min: [region.min[0].max(0.0), region.min[1], 0.0], max: region.max });
            let smallest = (0..3).map(|a| solved.extent(a)).fold(gap, f64::min);
            for axis in 0..3 {
                let [p, q] = [(axis + 1) % 3, (axis + 2) % 3];
                let ends = |a: usize| [solved.min[a], solved.max[a]];
                let points: Vec<(usize, [f64; 3])> = (0..2 * COUNT * COUNT)
                    .map(|n| {
                        let mut x = [0.0; 3];
                        x[axis] = ends(axis)[n % 2];
                        (x[p], x[q]) = (sample(ends(p), n / 2 % COUNT), sample(ends(q), n / 2 / COUNT));
                        (axis, x)
                    })
                    .collect();
                worst = worst.max(root_mean_square(&points) / smallest);
            }
        }
        let surface = self.planes[1].last().map_or(0.0, |p| p[1]);
        let ends = |a: usize| [0.0, self.planes[a].last().map_or(0.0, |p| p[1])];
        let points: Vec<(usize, [f64; 3])> = (0..COUNT * COUNT)
            .map(|n| (1, [sample(ends(0), n % COUNT), surface, sample(ends(2), n / COUNT)]))
            .collect();
        // The surface matters by its distance from the electrodes.
        worst.max(root_mean_square(&points) / (surface - self.last[1]).max(gap))
    }
}

/// The height of the surface in the frame, m: a mean of its heights in the finite-element solution, given the
/// `planes` along x1 and x3.
fn surface(planes: &[Vec<[f64; 2]>; 3], is_open: bool, material: &Material<'_>) -> f64 {
    // Not tuned: the mean height only has to be typical.
    /// Sampled places, over the distance from the middle to an end.
    const PLACES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
    let end = |a: usize, from_end: usize| planes[a].iter().rev().nth(from_end).map_or(0.0, |p| p[0]);
    let top = |x1: f64, x3: f64| material.position([x1, material.pad[1], x3])[1];
    if is_open {
        // The layer outside the map begins at the ends of the map.
        let edges = PLACES.map(|s| top(end(0, 0), s * end(2, 0)) + top(s * end(0, 0), end(2, 0)));
        return edges.iter().sum::<f64>() / 10.0;
    }
    // With this height the map stretches the space above the electrodes least.
    let above = PLACES.iter().flat_map(|s| PLACES.map(|t| top(s * end(0, 1), t * end(2, 1))));
    above.sum::<f64>() / 25.0
}

/// Converts the coordinate `x` by linear interpolation between the planes, each of which has two coordinates:
/// from those with the index `from` to those with the index `to`. Extrapolates beyond the last plane.
fn between(planes: &[[f64; 2]], x: f64, from: usize, to: usize) -> f64 {
    let last = planes.len().saturating_sub(2);
    let k = planes.partition_point(|p| p[from] <= x).saturating_sub(1).min(last);
    let Some(&[low, high]) = planes.get(k..k + 2) else { return x };
    if x == high[from] {
        return high[to];
    }
    low[to] + (x - low[from]) * (high[to] - low[to]) / (high[from] - low[from])
}

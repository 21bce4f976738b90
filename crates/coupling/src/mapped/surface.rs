//! The map of a layer with any bodies in it, or none: points of its surface move as in the finite-element
//! solution.
//!
//! With bodies in the layer, its whole material moves as in the solution, over the extent of the bodies.
//! Without bodies the map below the surface is free. Near the surface it then takes the displacement of the
//! material, and towards the substrate that displacement times 2 t - t^2, where t rises linearly from 0 above
//! the electrodes on the substrate to 1. So it leaves the neighbourhood of the electrodes unchanged, where
//! the field is singular, and distorts the field where it is smooth. Where such a map would fold, the
//! material below the surface moves as in the solution, too.
//!
//! Under a plate over the whole top, the boxes of the layer are as high as the loaded layer, and the layer
//! continues at this height outside the map.
//!
//! The map follows the surface from its first sharp bend to the last, and beyond them to where it is flat.
//! Beside that part the displacement falls to zero in open space. Towards walls, points keep their
//! coordinates along x1 and x3, at the height of the layer there. Above the layer the displacement of the
//! surface falls to zero.

use elastocap_electrostatics::MapAxis;
use elastocap_geometry::scene::{Box3, Purpose, Scene, Wall};
use elastocap_geometry::shapes::Shape;

use super::axes::{Piece, joined};
use super::in_layer::InLayer;
use super::room::Others;

/// Distance over which a displacement falls to zero in open space, in thicknesses of the layer. Tuned: time
/// and `geometry_error_estimate` of `elastocap run cases/pair-under-sphere.toml`.
pub(super) const DECAY: f64 = 1.5;

/// Least distance over which a displacement falls to zero, over its component along x1 or x3. Tuned: time and
/// `geometry_error_estimate` of `elastocap run cases/comb-in-layer.toml`.
pub(super) const DECAY_OF_SLIDING: f64 = 2.5;

/// Degree of the map's polynomials along the surface, without and with bodies in the layer, and over the
/// height of the layer near the substrate and near the surface. The degree near the substrate is two higher
/// for a blend, and with bodies. Tuned: time and `geometry_error_estimate` of `elastocap run` with
/// cases/comb-in-layer.toml and cases/comb-on-board.toml.
const ALONG: usize = 10;
const WITH_BODIES: usize = 6;
const OVER_LAYER: [usize; 2] = [4, 6];

/// The height at which the polynomials over the height of the layer break, over the thickness. Tuned: time
/// and `geometry_error_estimate` of `elastocap run cases/comb-on-board.toml`.
const NEAR_SURFACE: f64 = 0.6;

/// Height above the electrodes up to which points stay in place, and the largest height up to which they may,
/// over the thickness. Tuned: time and `geometry_error_estimate` of `elastocap run cases/comb-on-board.toml`.
const AT_REST: f64 = 0.15;
const HIGHEST_AT_REST: f64 = 0.4;

/// Distances from the outermost corner at which the polynomials break, in thicknesses of the layer. Tuned:
/// time and `geometry_error_estimate` of `elastocap run cases/comb-in-layer.toml`.
const BESIDE: [f64; 3] = [0.12, 0.4, 1.0];

/// Displacement along x2, as a share of the thickness, below which the surface is no longer followed. Tuned:
/// time and `geometry_error_estimate` of `elastocap run cases/comb-in-layer.toml`.
const FLAT: f64 = 2e-3;

/// Least and largest distance from the outermost corner up to which the surface is followed, in thicknesses
/// of the layer. Tuned: time and `geometry_error_estimate` of `elastocap run cases/comb-in-layer.toml`.
pub(super) const FOLLOWED: [f64; 2] = [1.0, 5.0];

/// Distances of walls that differ by less than this share of the thickness are equal. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const SAME: f64 = 1e-9;

/// Steps of the search for the material point at a place.
const SEARCH_STEPS: usize = 12;

/// The displacement of points below the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Below {
    /// That of the material, reduced towards the substrate.
    Blend,
    /// That of the material.
    Material,
}

/// The description of the layer for a [`SurfaceMap`]. Lengths in m.
pub(super) struct Bent {
    /// The displacement of points below the surface.
    pub(super) below: Below,
    /// The height of the highest electrode on the substrate.
    pub(super) electrodes: f64,
    /// The thickness of the undeformed layer.
    pub(super) thickness: f64,
    /// The coordinates along x1 and x3 of the material points at which the surface bends sharply. It is
    /// followed from the first of them to the last and beyond.
    pub(super) corners: [Vec<f64>; 2],
    /// Whether the displacement is independent of x3.
    pub(super) is_plane: bool,
    /// Whether the displacement is mirror-symmetric about x1 = 0.
    pub(super) is_half: bool,
    /// Height of the boxes in the layer over the height of their material before loading.
    pub(super) scale: f64,
    /// The bodies in the layer that move with it.
    pub(super) bodies: InLayer,
}

/// The map of a layer.
pub(super) struct SurfaceMap<'a> {
    /// The displacement of a material point, m.
    displacement: &'a dyn Fn([f64; 3]) -> [f64; 3],
    /// The description of the layer.
    bent: Bent,
    /// The height at which the map ends, m.
    above: f64,
    /// The height up to which points stay in place, m.
    rest: f64,
    /// The interval along x1 and along x3 in which the surface is followed, m.
    followed: [[f64; 2]; 2],
    /// The interval along x1 and along x3 outside which points stay in place, m.
    ends: [[f64; 2]; 2],
    /// Whether the map ends at a wall, by axis and side.
    at_wall: [[bool; 2]; 2],
    /// Whether the map is mirror-symmetric about x1 = 0 and about x3 = 0: walls at unequal distances break
    /// the symmetry of a symmetric layer.
    mirrored: [bool; 2],
    /// Whether a wall lies on the layer and deforms with its surface.
    is_under_wall: bool,
}

impl<'a> SurfaceMap<'a> {
    /// The map of the layer of a `scene` from the `displacement` of its material points, m.
    pub(super) fn new(
        scene: &Scene,
        others: &Others,
        bent: Bent,
        displacement: &'a dyn Fn([f64; 3]) -> [f64; 3],
    ) -> Self {
        let surface = bent.scale * bent.thickness;
        let covers_all = bent.scale != 1.0;
        let (mut followed, mut ends, mut at_wall) = ([[0.0; 2]; 2], [[0.0; 2]; 2], [[false; 2]; 2]);
        let mut mirrored = [true; 2];
        for (k, a) in [(0, 0), (1, 2)] {
            // The distances of the walls from the middle, below and above it on the axis.
            let walls = [-scene.domain.min[a], scene.domain.max[a]];
            let walls = [0, 1].map(|side| {
                let is_walled = scene.walls[a][side] != Wall::Open && walls[side].is_finite();
                is_walled.then_some(walls[side])
            });
            let has_equal_walls = match walls {
                [Some(left), Some(right)] => (left - right).abs() < SAME * bent.thickness,
                [left, right] => left == right,
            };
            let is_symmetric = k == 1 || bent.is_half;
            mirrored[k] = is_symmetric && has_equal_walls;
            for side in 0..2 {
                let outward = if side == 0 { -1.0 } else { 1.0 };
                let corners =
                    || bent.corners[k].iter().map(|x| if is_symmetric { x.abs() } else { outward * x });
                // Corners behind a wall are not part of the field.
                let corners_inside = corners().filter(|x| walls[side].is_none_or(|wall| *x < wall));
                let bodies = match mirrored[k] {
                    true => bent.bodies.reach(a, 0).max(bent.bodies.reach(a, 1)),
                    false => bent.bodies.reach(a, side),
                };
                let has_corner_behind_wall = corners_inside.clone().count() < corners().count();
                let corner = corners_inside.fold(bodies, f64::max);
                let corner = if corner.is_finite() { corner } else { 0.0 };
                let displacement_at = |beyond: f64| {
                    let mut x = [0.0, bent.thickness, 0.0];
                    x[a] = outward * (corner + beyond);
                    displacement(x)
                };
                let [least, most] = FOLLOWED.map(|d| d * surface);
                let is_straight = k == 1 && bent.is_plane;
                // A surface that stays flat under load does not return to its height at rest.
                let beyond = if has_corner_behind_wall {
                    f64::INFINITY
                } else if is_straight || covers_all {
                    0.0
                } else {
                    let places = (0..=20).map(|i| least + (most - least) * f64::from(i) / 20.0);
                    places.into_iter().find(|d| displacement_at(*d)[1].abs() < FLAT * surface).unwrap_or(most)
                };
                (followed[k][side], ends[k][side]) = if let Some(wall) = walls[side] {
                    (outward * (corner + beyond.min(0.5 * (wall - corner).max(0.0))), outward * wall)
                } else {
                    let slides = if is_straight { 0.0 } else { displacement_at(beyond)[a].abs() };
                    let reach = (DECAY * surface).max(DECAY_OF_SLIDING * slides);
                    (outward * (corner + beyond), outward * (corner + beyond + reach))
                };
                at_wall[k][side] = walls[side].is_some();
            }
        }
        let is_under_wall = scene.walls[1][1] != Wall::Open
            && !scene.bodies.iter().any(|body| body.purpose == Purpose::Cover);
        let top = scene.domain.max[1];
        let above = match top.is_finite() {
            true if is_under_wall => surface,
            true => top.min(others.ceiling(&ends)),
            false => (surface + DECAY * surface).min(others.ceiling(&ends)),
        };
        let at_rest = bent.electrodes + AT_REST * surface;
        let rest = match bent.below {
            Below::Blend if at_rest <= HIGHEST_AT_REST * surface => at_rest,
            Below::Blend | Below::Material => 0.0,
        };
        Self { displacement, bent, above, rest, followed, ends, at_wall, mirrored, is_under_wall }
    }

    /// The height of the surface before the map, m.
    pub(super) fn surface(&self) -> f64 {
        self.bent.scale * self.bent.thickness
    }

    /// Whether the map is mirror-symmetric about x1 = 0 and about x3 = 0.
    pub(super) fn mirrored(&self) -> [bool; 2] {
        self.mirrored
    }

    /// The height of the highest body in the layer, m.
    pub(super) fn highest(&self) -> f64 {
        self.bent.bodies.highest
    }

    /// The shortest side of the bodies in the surface, m; infinite without such bodies.
    pub(super) fn narrowest(&self) -> f64 {
        self.bent.bodies.narrowest
    }

    /// The share of the displacement that the map takes at the coordinate `x` along x1 (`k` 0) or x3 (1): 1
    /// where the surface is followed and 0 at the end of the map. Also whether the place is beyond the
    /// followed part, on a side where the map ends at a wall.
    fn share(&self, k: usize, x: f64) -> (f64, bool) {
        let side = usize::from(x > self.followed[k][1]);
        let [near, far] = [self.followed[k][side], self.ends[k][side]];
        let beyond = if side == 0 { near - x } else { x - near };
        if beyond <= 0.0 {
            return (1.0, false);
        }
        ((1.0 - beyond / (far - near).abs()).clamp(0.0, 1.0), self.at_wall[k][side])
    }

    /// The image of a point, m.
    pub(super) fn image(&self, x: [f64; 3]) -> [f64; 3] {
        let (along, across) = (self.share(0, x[0]), self.share(1, x[2]));
        // Towards walls, only the displacement along x1 and x3 falls to zero, not that of the height.
        let shares_of_height = [along, across].map(|(share, at_wall)| if at_wall { 1.0 } else { share });
        let (share, share_of_height) = (along.0 * across.0, shares_of_height[0] * shares_of_height[1]);
        let surface = self.surface();
        if x[1] <= self.rest || share_of_height == 0.0 {
            return x;
        }
        let height_in_box = x[1].min(surface);
        let mut material = [x[0], height_in_box / self.bent.scale, x[2]];
        let stays_flat = self.bent.scale != 1.0;
        if stays_flat {
            // The ends of the layer, which bulge, are not part of the field.
            for (k, a) in [(0, 0), (1, 2)] {
                material[a] = x[a].clamp(self.followed[k][0], self.followed[k][1]);
            }
        }
        let mut moved = self.moved(material);
        if share < share_of_height {
            let place = [x[0] + share * moved[0], x[2] + share * moved[2]];
            let height = if stays_flat { material[1] + moved[1] } else { self.height_at(material, place) };
            moved = [share * moved[0], share_of_height * (height - height_in_box), share * moved[2]];
        } else {
            moved = [share * moved[0], share * (material[1] + moved[1] - height_in_box), share * moved[2]];
        }
        let fade = match x[1] > surface {
            true => ((self.above - x[1]) / (self.above - surface)).max(0.0),
            false => 1.0,
        };
        [0, 1, 2].map(|a| x[a] + fade * moved[a])
    }

    /// The displacement that the map gives a material point where the surface is followed, m.
    fn moved(&self, x: [f64; 3]) -> [f64; 3] {
        let displacement = (self.displacement)(x);
        match self.bent.below {
            Below::Material => displacement,
            Below::Blend => {
                let t =
                    ((x[1] - self.rest) / (NEAR_SURFACE * self.bent.thickness - self.rest)).clamp(0.0, 1.0);
                displacement.map(|u| t * (2.0 - t) * u)
            }
        }
    }

    /// The deformed height, m, at a place along x1 and x3, of the material plane that was at the height of
    /// `material`. The search for the point of the plane that arrives there starts at `material`.
    fn height_at(&self, mut material: [f64; 3], place: [f64; 2]) -> f64 {
        let mut moved = self.moved(material);
        for _ in 0..SEARCH_STEPS {
            let miss = [place[0] - material[0] - moved[0], place[1] - material[2] - moved[2]];
            if miss.iter().all(|m| m.abs() < 1e-9 * self.bent.thickness) {
                break;
            }
            (material[0], material[2]) = (material[0] + miss[0], material[2] + miss[1]);
            moved = self.moved(material);
        }
        material[1] + moved[1]
    }

    /// The region that the map changes.
    pub(super) fn zone(&self) -> Box3 {
        let [along, across] = self.ends;
        Box3 { min: [along[0], self.rest, across[0]], max: [along[1], self.above, across[1]] }
    }

    /// The grid of the map's polynomials; breaks less than `tiny` (m) apart are merged.
    pub(super) fn axes(&self, tiny: f64) -> [MapAxis; 3] {
        let thickness = self.bent.thickness;
        let pieces = |k: usize, is_symmetric: bool| {
            let [from, to] = self.followed[k];
            let mut places = self.bent.corners[k].clone();
            let sides = [-1.0, 1.0];
            let outermost =
                sides.map(|side| places.iter().copied().max_by(|x, y| (side * x).total_cmp(&(side * y))));
            let has_bodies = !self.bent.bodies.is_empty();
            let (marks, degree) = if has_bodies { (&BESIDE[1..], WITH_BODIES) } else { (&BESIDE[..], ALONG) };
            for (side, outermost) in sides.into_iter().zip(outermost) {
                let marked = |side: f64| {
                    let places = outermost
                        .into_iter()
                        .flat_map(|x| marks.iter().map(move |d| x + side * d * thickness));
                    places.filter(|x| from < *x && *x < to).collect::<Vec<f64>>()
                };
                // Bodies in the layer also see the bending on the inner side of a corner.
                let mut more = if has_bodies { marked(-side) } else { Vec::new() };
                more.retain(|x| places.iter().all(|place| (x - place).abs() > BESIDE[0] * thickness));
                places.extend(more.into_iter().chain(marked(side)));
            }
            let planes = &self.bent.bodies.planes[if k == 0 { 0 } else { 2 }];
            places.extend(planes.iter().filter(|x| from < **x && **x < to));
            if is_symmetric {
                places.extend(places.clone().iter().map(|x| -x));
            }
            places.retain(|x| self.ends[k][0] < *x && *x < self.ends[k][1]);
            places.extend(self.followed[k].into_iter().chain(self.ends[k]));
            places.sort_by(f64::total_cmp);
            places.windows(2).map(|ends| Piece::new(ends[0], ends[1], degree)).collect::<Vec<_>>()
        };
        let along = pieces(0, self.bent.is_half);
        let across = if self.bent.is_plane {
            let ([from, to], [first, last]) = (self.followed[1], self.ends[1]);
            [[first, from], [from, to], [to, last]].map(|[a, b]| Piece::new(a, b, 1)).to_vec()
        } else {
            pieces(1, true)
        };
        let surface = self.surface();
        let middle = NEAR_SURFACE * surface;
        let more_degrees =
            if self.bent.below == Below::Blend || !self.bent.bodies.is_empty() { 2 } else { 0 };
        let mut up = vec![
            Piece::new(self.rest, middle, OVER_LAYER[0] + more_degrees),
            Piece::new(middle, surface, OVER_LAYER[1]),
            Piece::new(surface, self.above, 1),
        ];
        up.extend(self.bent.bodies.planes[1].windows(2).map(|ends| Piece::new(ends[0], ends[1], 1)));
        let [of_along, of_across] = self.mirrored;
        [joined(&along, tiny, of_along), joined(&up, tiny, false), joined(&across, tiny, of_across)]
    }

    /// The scene before the map: the layer is as high as its surface in the coordinates of the boxes.
    pub(super) fn scene(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        for body in &mut scene.bodies {
            for part in &mut body.parts {
                let Shape::Box(region) = part else { continue };
                match body.purpose {
                    Purpose::Layer if region.max[1].is_finite() => region.max[1] = self.surface(),
                    Purpose::Cover => region.min[1] = self.surface(),
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
        if self.is_under_wall {
            scene.domain.max[1] = self.surface();
        }
        scene
    }
}

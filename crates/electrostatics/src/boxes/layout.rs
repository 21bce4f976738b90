//! A scene reduced to planes, blocks and cells, from which grids of any resolution are made.
//!
//! Planes are the coordinates at which a body or the scene begins or ends; nearly equal ones are merged. The
//! layout also finds the mirror planes of the scene and cuts itself in half there.

use crate::boxes::domain::{Axis, Block, Domain, Rays};
use crate::boxes::holders::{ACROSS, HalfTurn, Holders};
use crate::boxes::placed_map::PlacedMap;
use crate::boxes::scene_map::SceneMap;
use crate::error::SolveError;
use crate::solution::ResolutionLevel;
use elastocap_geometry::meshing::grid::{End, GradedAxis, Plane, Resolution, graded_axis};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use std::sync::Arc;

/// Two planes closer than this share of their distance from the origin, or of the unit of length, are merged:
/// they are the same but for the rounding of coordinates. The distance of other planes hardly matters; a wall
/// may be a million times as far as two conductors are apart. It is not tuned.
const SAME: f64 = 1e-13;

/// Rounding error that far planes cause in all coordinates, over the distance of the farthest plane; and its
/// largest value, over the unit.
const FROM_AFAR: [f64; 2] = [4.0 * f64::EPSILON, 1e-9];

/// The error that the coordinate `at` of a plane may have where the farthest plane is at `farthest`.
fn coordinate_error(at: f64, farthest: f64) -> f64 {
    let [share, most] = FROM_AFAR;
    (SAME * at.abs().max(1.0)).max((share * farthest).min(most))
}

/// Distance of the farthest plane from the origin.
fn farthest(planes: impl Iterator<Item = f64>) -> f64 {
    planes.map(f64::abs).fold(0.0, f64::max)
}

/// Two planes closer than this share of the unit of length are merged, too, if nothing lies between them,
/// neither a body nor the gap between two bodies. The shift is within the rounding error of the field there.
/// It is not tuned.
const ALIKE: f64 = 1e-11;

/// Distance of the centre of the walls from the centre of the conductors, over the size of the conductors, up
/// to which the centre of the walls is the origin of the coordinates. With a farther origin, coordinates of
/// conductors would lose digits. This one loses two digits at most.
const NEAR: f64 = 100.0;

/// A break of a map closer than this to a plane of a body, over the unit of length, is taken to lie on it.
/// Not tuned: it only has to lie above rounding errors and below distances that matter.
const SAME_BREAK: f64 = 1e-9;

/// Planes, conductors as blocks of intervals, permittivity per cell; lengths in units of `unit`, from
/// `origin`.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// The unit of length, m.
    pub unit: f64,
    /// The origin of the scaled coordinates, m.
    pub origin: [f64; 3],
    /// Planes of each axis, ascending, scaled.
    pub planes: [Vec<Plane>; 3],
    /// The wall at each end of each axis, `[axis][side]`.
    pub walls: [[Wall; 2]; 3],
    /// The blocks of each conductor, in the scene's order; empty where a reduced layout does not contain the
    /// conductor.
    pub conductors: Vec<Vec<Block>>,
    /// Relative permittivity of each cell `[i][j][k]`.
    pub permittivity: Vec<f64>,
    /// 1 + index of the dielectric of each cell, 0 for the background.
    pub material: Vec<i32>,
    /// Distance from the origin at which open space may begin.
    pub reach: f64,
    /// Per axis, the plane of mirror symmetry, if there is one.
    pub mirror: [Option<usize>; 3],
    /// Set where the first and the last axis have no mirror plane, but a half turn about the second takes the
    /// layout to itself.
    pub turn: Option<Turned>,
    /// The map that bends the scene, if one does.
    pub map: Option<PlacedMap>,
}

/// The half turn about the second axis that takes a layout to itself: see
/// [`crate::boxes::half_turn::halves`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Turned {
    /// The planes in the middle of the first and of the last axis.
    pub(crate) planes: [usize; 2],
    /// For each conductor, the index of the one that the turn takes it to.
    pub(crate) images: Vec<usize>,
}

/// The origin of a layout's coordinates, and their unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// The origin, m.
    pub origin: [f64; 3],
    /// The unit of length, m.
    pub unit: f64,
}

impl Frame {
    /// The frame that a scene has unless another one is given.
    ///
    /// # Errors
    /// A conductor that consists neither of boxes nor of sheets.
    pub(crate) fn of(scene: &Scene) -> Result<Self, SolveError> {
        let mut hull: Option<Box3> = None;
        for conductor in scene.conductors() {
            let regions = boxes(conductor.body)?;
            hull = regions.into_iter().chain(hull).reduce(|a, b| a.union(&b));
        }
        let hull = hull.unwrap_or(Box3 { min: [0.0; 3], max: [1.0; 3] });
        let unit = (0..3).map(|a| hull.extent(a)).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let middle = |b: &Box3, a: usize| 0.5 * (b.min[a] + b.max[a]);
        let origin = [0, 1, 2].map(|a| {
            let [centre, walls] = [&hull, &scene.domain].map(|b| middle(b, a));
            if (walls - centre).abs() <= NEAR * unit { walls } else { centre }
        });
        Ok(Self { origin, unit })
    }
}

/// The boxes and sheets that a body consists of.
fn boxes(body: &Body) -> Result<Vec<Box3>, SolveError> {
    body.boxes().ok_or_else(|| SolveError::NotBoxes { body: body.name.clone() })
}

impl Layout {
    /// Lays out a scene whose cells take no more than `memory_limit` bytes.
    ///
    /// # Errors
    /// A body that is neither a box nor a sheet; too many cells.
    pub(crate) fn new(scene: &Scene, memory_limit: u64) -> Result<Self, SolveError> {
        Self::in_frame(scene, None, None, memory_limit)
    }

    /// Lays out a scene that a `map` may bend: elements end where its polynomials do. A `frame` replaces that
    /// of the scene.
    pub(crate) fn in_frame(
        scene: &Scene,
        map: Option<&Arc<SceneMap>>,
        frame: Option<Frame>,
        memory_limit: u64,
    ) -> Result<Self, SolveError> {
        let Frame { origin, unit } = match frame {
            Some(frame) => frame,
            None => Frame::of(scene)?,
        };
        let conductors: Vec<Vec<Box3>> =
            scene.conductors().map(|c| boxes(c.body)).collect::<Result<_, _>>()?;
        let dielectrics: Vec<Vec<Box3>> =
            scene.dielectrics().map(|d| boxes(d.body)).collect::<Result<_, _>>()?;
        let scaled = |x: f64, a: usize| (x - origin[a]) / unit;
        let mut planes: [Vec<Plane>; 3] = Default::default();
        for a in 0..3 {
            let mut sided = Vec::new();
            let is_sharp = |region: &Box3| map.is_none_or(|map| !map.is_round(region, a));
            for region in conductors.iter().flatten() {
                let edge = is_sharp(region);
                sided.push((Plane { at: scaled(region.min[a], a), edge }, Side::Lower));
                sided.push((Plane { at: scaled(region.max[a], a), edge }, Side::Upper));
            }
            for region in dielectrics.iter().flatten() {
                // A slab has no edges; where faces meet, the field is singular as at a conductor's edge, if
                // less so.
                let inside = |a: usize, x: f64| x > scene.domain.min[a] && x < scene.domain.max[a];
                let bounded = |a: usize| inside(a, region.min[a]) || inside(a, region.max[a]);
                let edge = (0..3).filter(|&a| bounded(a)).count() > 1 && is_sharp(region);
                let faces = [(region.min[a], Side::Lower), (region.max[a], Side::Upper)];
                for (x, side) in faces.into_iter().filter(|(x, _)| inside(a, *x)) {
                    sided.push((Plane { at: scaled(x, a), edge }, side));
                }
            }
            let walls = [(scene.domain.min[a], Side::Upper), (scene.domain.max[a], Side::Lower)];
            for (x, side) in walls.into_iter().filter(|(x, _)| x.is_finite()) {
                sided.push((Plane { at: scaled(x, a), edge: false }, side));
            }
            planes[a] = merged(sided);
        }
        let map = map.map(|map| PlacedMap { map: Arc::clone(map), origin, unit });
        for (a, planes) in planes.iter_mut().enumerate() {
            for at in map.iter().flat_map(|map| map.breaks(a)) {
                if planes.iter().all(|p| (p.at - at).abs() > SAME_BREAK) {
                    planes.push(Plane { at, edge: false });
                }
            }
            planes.sort_by(|p, q| p.at.total_cmp(&q.at));
        }
        let mut layout = Self {
            unit,
            origin,
            planes,
            walls: scene.walls,
            conductors: Vec::new(),
            permittivity: Vec::new(),
            material: Vec::new(),
            reach: 0.0,
            mirror: [None; 3],
            turn: None,
            map,
        };
        layout.check_cells(memory_limit)?;
        layout.fill(scene, &conductors);
        for a in 0..3 {
            let bent_otherwise = layout.map.as_ref().is_some_and(|m| !m.map.axes[a].mirrored);
            if !bent_otherwise && layout.mirrored(a) {
                layout.mirror[a] = Some(layout.insert_centre(a));
                layout.fill(scene, &conductors);
            }
        }
        if let Some(images) = layout.turned() {
            layout.turn = Some(Turned { planes: ACROSS.map(|a| layout.insert_centre(a)), images });
            layout.fill(scene, &conductors);
        }
        Ok(layout)
    }

    /// Checks that the cells fit into the memory: with many bodies whose faces share no planes, there are
    /// about the third power of their number.
    fn check_cells(&self, limit: u64) -> Result<(), SolveError> {
        // A permittivity and a material for each cell, twice where a mirror is found, and at least one
        // function on the coarsest grid.
        let cells = (0..3).map(|a| self.planes[a].len() as u64 + 1).fold(1, u64::saturating_mul);
        let bytes = cells.saturating_mul(100);
        if bytes > limit { Err(SolveError::TooLarge { bytes, limit }) } else { Ok(()) }
    }

    /// Computes the blocks of conductors, given as their boxes, the permittivity and the reach for the
    /// current planes.
    fn fill(&mut self, scene: &Scene, conductors: &[Vec<Box3>]) {
        let nearest_plane = |a: usize, x: f64| {
            let s = (x - self.origin[a]) / self.unit;
            let (mut best, mut distance) = (0, f64::INFINITY);
            for (i, p) in self.planes[a].iter().enumerate() {
                if (p.at - s).abs() < distance {
                    (best, distance) = (i, (p.at - s).abs());
                }
            }
            best + usize::from(self.walls[a][0] == Wall::Open)
        };
        let block = |region: &Box3| Block {
            lo: [0, 1, 2].map(|a| nearest_plane(a, region.min[a])),
            hi: [0, 1, 2].map(|a| nearest_plane(a, region.max[a])),
        };
        let conductors = conductors
            .iter()
            .map(|regions| {
                // Sorted, so that the mirror images of conductors are found by comparison.
                let mut blocks: Vec<Block> = regions.iter().map(block).collect();
                blocks.sort_unstable();
                blocks.dedup();
                blocks
            })
            .collect();
        let centres = [0, 1, 2].map(|a| self.centres(a));
        let counts = centres.each_ref().map(Vec::len);
        let cells: usize = counts.iter().product();
        let mut permittivity = vec![scene.background_permittivity; cells];
        let mut material = vec![0; cells];
        // Painted one over the other: later dielectrics take precedence. To look up the body of every cell
        // would take the number of cells times that of bodies.
        let places = [0, 1, 2].map(|a| {
            centres[a].iter().map(|centre| self.origin[a] + self.unit * centre).collect::<Vec<f64>>()
        });
        for dielectric in scene.dielectrics() {
            let boxes = dielectric.body.boxes().unwrap_or_default();
            for b in boxes.iter().filter(|b| b.sheet_normal().is_none()) {
                let [i, j, k] = [0, 1, 2].map(|a| {
                    places[a].partition_point(|x| *x < b.min[a])
                        ..places[a].partition_point(|x| *x <= b.max[a])
                });
                for (x, y) in i.flat_map(|x| j.clone().map(move |y| (x, y))) {
                    let row = (x * counts[1] + y) * counts[2];
                    permittivity[row + k.start..row + k.end.max(k.start)]
                        .fill(dielectric.relative_permittivity);
                    material[row + k.start..row + k.end.max(k.start)].fill(dielectric.index as i32 + 1);
                }
            }
        }
        self.conductors = conductors;
        self.permittivity = permittivity;
        self.material = material;
        // Twice as far as any plane is from the pole.
        self.reach = (0..3)
            .map(|a| self.planes[a].iter().map(|p| 2.0 * (p.at - self.pole(a)).abs()).fold(1.0, f64::max))
            .fold(1.0, f64::max);
    }

    /// Centre of open space on axis `a`. It lies on a closed side if there is one: rays from it then never
    /// leave the scene.
    fn pole(&self, a: usize) -> f64 {
        let open = self.walls[a].map(|w| w == Wall::Open);
        match open {
            [true, false] => self.planes[a].last().map_or(0.0, |p| p.at),
            [false, true] => self.planes[a].first().map_or(0.0, |p| p.at),
            // The field of a charge on the face between two half-spaces is radial: the best place for the
            // pole is there.
            [true, true] => {
                let last = self.cells()[a] - 1;
                let permittivity_in = |m: usize| {
                    let mut cell = [0; 3];
                    cell[a] = m;
                    self.permittivity.get(self.cell(cell)).copied()
                };
                let nearest = |x: f64, y: f64| if y.abs() < x.abs() { y } else { x };
                let faces = (0..last)
                    .filter(|&m| permittivity_in(m) != permittivity_in(m + 1))
                    .map(|m| self.planes[a][m].at);
                if permittivity_in(0) == permittivity_in(last) {
                    0.0
                } else {
                    faces.reduce(nearest).unwrap_or(0.0)
                }
            }
            _ => 0.0,
        }
    }

    /// Distance of the farthest face of a conductor from the pole, on any axis.
    pub(crate) fn size(&self) -> f64 {
        let shift = |a: usize| usize::from(self.walls[a][0] == Wall::Open);
        let face = |a: usize, interval: usize| (self.planes[a][interval - shift(a)].at - self.pole(a)).abs();
        let farthest = |b: &Block| (0..3).map(|a| face(a, b.lo[a]).max(face(a, b.hi[a]))).fold(0.0, f64::max);
        self.conductors.iter().flatten().map(farthest).fold(0.0, f64::max)
    }

    /// A point inside each interval of axis `a`, scaled.
    fn centres(&self, a: usize) -> Vec<f64> {
        let p = &self.planes[a];
        let mut out: Vec<f64> = p.windows(2).map(|w| 0.5 * (w[0].at + w[1].at)).collect();
        if let (Wall::Open, Some(first)) = (self.walls[a][0], p.first()) {
            out.insert(0, first.at - 1e3 * (1.0 + first.at.abs()));
        }
        if let (Wall::Open, Some(last)) = (self.walls[a][1], p.last()) {
            out.push(last.at + 1e3 * (1.0 + last.at.abs()));
        }
        out
    }

    /// Numbers of intervals.
    pub(crate) fn cells(&self) -> [usize; 3] {
        [0, 1, 2]
            .map(|a| self.planes[a].len() - 1 + self.walls[a].iter().filter(|w| **w == Wall::Open).count())
    }

    /// The index of a cell in [`Layout::permittivity`].
    fn cell(&self, c: [usize; 3]) -> usize {
        let n = self.cells();
        (c[0] * n[1] + c[1]) * n[2] + c[2]
    }

    /// Whether the layout is mirror-symmetric across the origin of axis `a`.
    fn mirrored(&self, a: usize) -> bool {
        self.is_even(a) && self.conductors.iter().all(|c| self.conductors.contains(&self.flipped(c, a)))
    }

    /// Whether the planes, walls and permittivity of the layout, conductors aside, are mirror-symmetric
    /// across the origin of axis `a`.
    fn is_even(&self, a: usize) -> bool {
        let p = &self.planes[a];
        let n = p.len();
        if self.walls[a][0] != self.walls[a][1] {
            return false;
        }
        let size = farthest(p.iter().map(|p| p.at));
        let apart = |i: usize| (p[i].at + p[n - 1 - i].at).abs();
        if (0..n).any(|i| apart(i) > coordinate_error(p[i].at, size) || p[i].edge != p[n - 1 - i].edge) {
            return false;
        }
        let cells = self.cells();
        (0..cells[0]).all(|i| {
            (0..cells[1]).all(|j| {
                (0..cells[2]).all(|k| {
                    let cell = [i, j, k];
                    let mut mirrored = cell;
                    mirrored[a] = cells[a] - 1 - cell[a];
                    self.permittivity[self.cell(cell)] == self.permittivity[self.cell(mirrored)]
                })
            })
        })
    }

    /// Makes the planes of axis `a` exactly symmetric, with one at the centre, and returns the index of that
    /// plane.
    fn insert_centre(&mut self, a: usize) -> usize {
        let p = &mut self.planes[a];
        let n = p.len();
        for i in 0..n / 2 {
            let x = 0.5 * (p[n - 1 - i].at - p[i].at);
            p[i].at = -x;
            p[n - 1 - i].at = x;
        }
        if n % 2 == 1 {
            p[n / 2].at = 0.0;
        } else {
            p.insert(n / 2, Plane { at: 0.0, edge: false });
        }
        n / 2
    }

    /// For each conductor, the index of the one that a half turn about the second axis takes it to; `None`
    /// unless the turn takes the layout to itself and no mirror across the two other axes does. Permittivity
    /// and map must be mirror-symmetric across either of these two axes.
    fn turned(&self) -> Option<Vec<usize>> {
        let is_mirrored = |a: usize| self.map.as_ref().is_none_or(|map| map.is_mirrored(a));
        if !ACROSS.iter().all(|&a| self.mirror[a].is_none() && self.is_even(a) && is_mirrored(a)) {
            return None;
        }
        let blocks =
            self.conductors.iter().enumerate().flat_map(|(c, blocks)| blocks.iter().map(move |b| (c, b)));
        let pairs = Holders::new(self.cells(), blocks).pairs(HalfTurn::across([true, false, true]))?;
        let image = |c: usize| {
            let mut images = pairs.iter().filter(|(from, _)| *from == c).map(|(_, to)| *to);
            images.next().filter(|_| images.next().is_none())
        };
        (0..self.conductors.len()).map(image).collect()
    }

    /// The mirror image of a conductor's blocks across axis `a`.
    pub(crate) fn flipped(&self, blocks: &[Block], a: usize) -> Vec<Block> {
        let n = self.cells()[a];
        let flip = |b: &Block| {
            let mut f = *b;
            (f.lo[a], f.hi[a]) = (n - b.hi[a], n - b.lo[a]);
            f
        };
        let mut flipped: Vec<Block> = blocks.iter().map(flip).collect();
        flipped.sort_unstable();
        flipped
    }

    /// Index of the conductor that is the mirror image of conductor `c` across axis `a`.
    pub(crate) fn image(&self, c: usize, a: usize) -> usize {
        let flipped = self.flipped(&self.conductors[c], a);
        self.conductors.iter().position(|b| *b == flipped).unwrap_or(c)
    }

    /// The half of the layout above the mirror plane of axis `a`, with the potential even or odd across it.
    pub(crate) fn half(&self, a: usize, odd: bool) -> Self {
        let Some(centre) = self.mirror[a] else { return self.clone() };
        // A block that ends at the plane is the mirror image of one that begins there.
        let belongs = |b: &Block, first: usize| b.hi[a] > first || (b.lo[a] == b.hi[a] && b.lo[a] == first);
        self.above(a, centre, if odd { Wall::Grounded } else { Wall::Insulated }, belongs)
    }

    /// The half of the layout above a plane of axis `a`, where a `wall` is put. It keeps the part above the
    /// plane of each block for which `belongs` holds, given the first interval above the plane.
    pub(crate) fn above(
        &self,
        a: usize,
        plane: usize,
        wall: Wall,
        belongs: impl Fn(&Block, usize) -> bool,
    ) -> Self {
        let first = plane + usize::from(self.walls[a][0] == Wall::Open);
        let mut out = self.clone();
        out.planes[a].drain(..plane);
        out.walls[a][0] = wall;
        out.mirror[a] = None;
        // The half has no half turn if the cut is across one of the turn's axes.
        out.turn = out.turn.take().filter(|_| !ACROSS.contains(&a));
        for blocks in &mut out.conductors {
            blocks.retain(|b| belongs(b, first));
            for b in blocks {
                b.lo[a] = b.lo[a].saturating_sub(first);
                b.hi[a] -= first;
            }
        }
        let n = self.cells();
        out.permittivity = cells_from(&self.permittivity, n, a, first);
        out.material = cells_from(&self.material, n, a, first);
        out
    }

    /// Largest over smallest permittivity among the cells that have no end, through which rays go to
    /// infinity; `None` if the scene is closed.
    pub(crate) fn endless_contrast(&self) -> Option<f64> {
        let cells = self.cells();
        let endless = |c: [usize; 3]| {
            (0..3).any(|a| {
                let open = self.walls[a].map(|w| w == Wall::Open);
                (open[0] && c[a] == 0) || (open[1] && c[a] + 1 == cells[a])
            })
        };
        let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
        for (index, e) in self.permittivity.iter().enumerate() {
            if endless([index / (cells[1] * cells[2]), index / cells[2] % cells[1], index % cells[2]]) {
                (least, greatest) = (least.min(*e), greatest.max(*e));
            }
        }
        (greatest > 0.0).then(|| greatest / least)
    }

    /// Whether both sides of some axis are closed: flux cannot spread in three dimensions, so none is
    /// continued to infinity.
    fn confined(&self) -> bool {
        self.walls.iter().any(|w| w.iter().all(|w| *w != Wall::Open))
    }

    /// A graded grid of the layout; rays to infinity begin `far` times as far from the pole as the farthest
    /// conductor.
    pub(crate) fn grid(&self, resolution: &Resolution, far: f64) -> Grid {
        let radius = self.grid_radius(far);
        let axes = [0, 1, 2].map(|a| {
            let ends = self.walls[a].map(|wall| match wall {
                Wall::Open => End::Open { pole: self.pole(a), reach: self.reach, radius },
                Wall::Insulated | Wall::Grounded => End::Closed,
            });
            let axis = graded_axis(&self.planes[a], ends, resolution);
            if self.confined() { axis } else { axis.finite() }
        });
        Grid { axes, radius }
    }

    /// Distance from the pole at which rays begin: `far` times that of the farthest conductor, and at least
    /// the reach.
    pub(crate) fn grid_radius(&self, far: f64) -> f64 {
        self.reach.max(far * self.size())
    }

    /// Moves the beginning of the rays out to `radius`, if there are any.
    pub(crate) fn reach_to(&self, grid: &mut Grid, radius: f64) {
        if self.confined() {
            return;
        }
        for a in 0..3 {
            for side in (0..2).filter(|&side| self.walls[a][side] == Wall::Open) {
                grid.axes[a].reach_to(side, self.pole(a), radius);
            }
        }
        grid.radius = radius;
    }

    /// For each block of the domain the index of the scene's conductor that it belongs to.
    pub(crate) fn held(&self) -> Vec<usize> {
        self.conductors.iter().enumerate().flat_map(|(c, blocks)| blocks.iter().map(move |_| c)).collect()
    }

    /// The layout on a grid, and for each block of the domain the index of the scene's conductor that it
    /// belongs to.
    pub(crate) fn domain(&self, grid: &Grid) -> (Domain, Vec<usize>) {
        let axes = [0, 1, 2].map(|a| {
            let GradedAxis { line, cuts, .. } = grid.axes[a].clone();
            let rays = (!self.confined()).then(|| Rays { pole: self.pole(a), radius: grid.radius });
            Axis { line, cuts, walls: self.walls[a], rays }
        });
        let blocks =
            self.conductors.iter().enumerate().flat_map(|(c, blocks)| blocks.iter().map(move |b| (*b, c)));
        let (conductors, held) = blocks.unzip();
        let domain = Domain {
            axes,
            conductors,
            permittivity: self.permittivity.clone(),
            map: self.map.clone(),
            turn: None,
        };
        (domain, held)
    }
}

/// The grid of a layout: its axes, and where rays to infinity begin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    /// Three axes.
    pub axes: [GradedAxis; 3],
    /// Distance of the last nodes of open sides from the pole, scaled.
    pub radius: f64,
}

impl Grid {
    /// The grid and its mirror images across the lowest planes of some axes.
    pub(crate) fn reflected(&self, mirrored: [bool; 3]) -> Self {
        let axes =
            [0, 1, 2].map(|a| if mirrored[a] { self.axes[a].reflected() } else { self.axes[a].clone() });
        Self { axes, radius: self.radius }
    }

    /// Largest degree, and largest number of layers at an edge: the elements of an interval, or half of them
    /// where both of its ends are edges, minus one.
    pub(crate) fn level(&self) -> ResolutionLevel {
        let lines = || self.axes.iter();
        let order = lines().flat_map(|a| a.line.degrees.iter().copied()).max().unwrap_or(1);
        let layers = |a: &GradedAxis, m: usize| {
            let elements = a.cuts[m + 1] - a.cuts[m];
            if a.edges[m] && a.edges[m + 1] { elements.div_ceil(2) } else { elements }.saturating_sub(1)
        };
        let levels =
            lines().flat_map(|a| (0..a.cuts.len() - 1).map(move |m| layers(a, m))).max().unwrap_or(0);
        ResolutionLevel { order, levels }
    }
}

/// The values of the cells from interval `first` of axis `a` on.
fn cells_from<T: Copy>(values: &[T], n: [usize; 3], a: usize, first: usize) -> Vec<T> {
    let mut out = Vec::new();
    for i in 0..n[0] {
        for j in 0..n[1] {
            for k in 0..n[2] {
                if [i, j, k][a] >= first {
                    out.push(values[(i * n[1] + j) * n[2] + k]);
                }
            }
        }
    }
    out
}

/// The side of a body on which a face lies; for a wall, the side of the exterior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Lower,
    Upper,
}

/// The planes in ascending order, with those merged that differ by rounding alone.
fn merged(mut planes: Vec<(Plane, Side)>) -> Vec<Plane> {
    planes.sort_by(|(p, _), (q, _)| p.at.total_cmp(&q.at));
    // Between two faces with the same outward normal there is neither a body nor a gap.
    let size = farthest(planes.iter().map(|(p, _)| p.at));
    let largest_gap = |at: f64, alike: bool| coordinate_error(at, size).max(if alike { ALIKE } else { 0.0 });
    let mut out: Vec<(Plane, Side)> = Vec::new();
    for (p, side) in planes {
        match out.last_mut() {
            Some((last, before)) if p.at - last.at <= largest_gap(p.at, side == *before) => {
                last.edge |= p.edge;
                *before = side;
            }
            _ => out.push((p, side)),
        }
    }
    out.into_iter().map(|(p, _)| p).collect()
}

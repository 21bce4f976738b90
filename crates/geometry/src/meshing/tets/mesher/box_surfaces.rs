//! The surfaces of boxes, sheets and slabs, and the walls.
//!
//! The planes of all boxes and walls make a grid. Faces of this grid between cells that are filled
//! differently belong to surfaces; so do faces covered by a sheet.

use super::piecewise_linear_complex::{PiecewiseLinearComplex, Sheet};
use super::region::Region;
use super::{MeshError, Point, Sizing};
use crate::scene::{Box3, Scene};

/// Largest number of cells of the grid that the planes of all boxes make: some seconds' work. Not tuned: a
/// limit that ordinary cases do not reach.
const MAX_CELLS: usize = 10_000_000;

/// A box and what fills it.
struct FilledBox {
    /// The box, or a sheet.
    region: Box3,
    /// The body that fills it.
    filling: Region,
}

/// The regions on the two sides of a face of the grid, and the sheet that covers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct GridFace {
    /// The region that fills the cell below; `None` outside the walls.
    below: Option<Region>,
    /// The region that fills the cell above; `None` outside the walls.
    above: Option<Region>,
    /// The sheet that covers the face.
    sheet: Option<Region>,
}

impl GridFace {
    /// The regions on both sides, and the sheet.
    fn fillings(self) -> impl Iterator<Item = Region> {
        [self.below, self.above, self.sheet].into_iter().flatten()
    }

    /// The body whose surface the face is on: a conductor if there is one, else a dielectric; `None` for a
    /// wall.
    fn body(self) -> Option<Region> {
        let dielectric = |filling: &Region| matches!(filling, Region::Dielectric(_));
        self.fillings().find(|filling| filling.is_conductor()).or_else(|| self.fillings().find(dielectric))
    }
}

/// The planes of all boxes and of the walls, with the cells between them.
struct BoxGrid {
    /// Dielectrics, then conductors: the last one that contains a cell fills it.
    boxes: Vec<FilledBox>,
    /// The body of each part: conductors first, then dielectrics.
    parts: Vec<Region>,
    /// Coordinates of the planes per axis, ascending, m; the first and the last are walls.
    planes: [Vec<f64>; 3],
    /// Numbers of the planes per axis. They are signed, because the cells next to the walls have neighbours
    /// outside.
    counts: [isize; 3],
    /// The region that fills each cell; the last axis runs fastest.
    cells: Vec<Region>,
    /// The sheets in each plane of each axis, by their places in `boxes`.
    sheets: [Vec<Vec<usize>>; 3],
}

/// The region that fills each cell between planes, given the numbers of cells per axis: where boxes that are
/// not flat overlap, the last one counts.
fn filled(boxes: &[FilledBox], planes: &[Vec<f64>; 3], cells: [usize; 3]) -> Vec<Region> {
    let middles = planes
        .each_ref()
        .map(|line| -> Vec<f64> { line.windows(2).map(|ends| 0.5 * (ends[0] + ends[1])).collect() });
    let mut out = vec![Region::Background; cells.iter().product()];
    for FilledBox { region: b, filling } in boxes.iter().filter(|b| b.region.sheet_normal().is_none()) {
        let [i, j, k] = [0, 1, 2].map(|a| {
            middles[a].partition_point(|x| *x < b.min[a])..middles[a].partition_point(|x| *x <= b.max[a])
        });
        for (x, y) in i.flat_map(|x| j.clone().map(move |y| (x, y))) {
            let row = (x * cells[1] + y) * cells[2];
            out[row + k.start..row + k.end.max(k.start)].fill(*filling);
        }
    }
    out
}

impl BoxGrid {
    /// The grid of the boxes of a scene.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] where it has too many cells.
    fn new(scene: &Scene, domain: &Box3) -> Result<Self, MeshError> {
        let conductors = scene.conductor_parts().map(|(c, part)| (Region::Conductor(c as u32), part));
        let dielectrics = scene.dielectric_parts().map(|(d, part)| (Region::Dielectric(d as u32), part));
        let parts = conductors.clone().chain(dielectrics.clone()).map(|(filling, _)| filling).collect();
        let boxes: Vec<FilledBox> = dielectrics
            .chain(conductors)
            .filter_map(|(filling, part)| Some(FilledBox { region: part.as_box()?, filling }))
            .collect();
        let planes = [0, 1, 2].map(|a| {
            let mut line = vec![domain.min[a], domain.max[a]];
            for FilledBox { region: b, .. } in &boxes {
                let inside = |x: &f64| domain.min[a] < *x && *x < domain.max[a];
                line.extend([b.min[a], b.max[a]].into_iter().filter(inside));
            }
            line.sort_unstable_by(f64::total_cmp);
            line.dedup();
            line
        });
        let counts = [0, 1, 2].map(|a| planes[a].len() as isize);
        let cells = planes.each_ref().map(|line| line.len().saturating_sub(1));
        if cells.iter().fold(1_usize, |all, n| all.saturating_mul(*n)) > MAX_CELLS {
            return Err(MeshError::TooMany);
        }
        let cells = filled(&boxes, &planes, cells);
        let mut sheets = planes.each_ref().map(|line| vec![Vec::new(); line.len()]);
        for (number, b) in boxes.iter().enumerate() {
            let Some(axis) = b.region.sheet_normal() else { continue };
            let plane = planes[axis].partition_point(|x| *x < b.region.min[axis]);
            if let Some(in_plane) = sheets[axis].get_mut(plane) {
                in_plane.push(number);
            }
        }
        Ok(Self { boxes, parts, planes, counts, cells, sheets })
    }

    /// The part to whose surface a face belongs: the first one of its body, because the boxes of a body are
    /// not distinguished.
    fn part(&self, face: GridFace) -> Option<u32> {
        let body = face.body()?;
        self.parts.iter().position(|&part| part == body).map(|part| part as u32)
    }

    /// The position of a grid point, m.
    fn point(&self, at: [isize; 3]) -> Point {
        [0, 1, 2].map(|a| self.planes[a][at[a] as usize])
    }

    /// The region that fills a cell; `None` outside the walls.
    fn cell(&self, cell: [isize; 3]) -> Option<Region> {
        if (0..3).any(|a| cell[a] < 0 || cell[a] + 1 >= self.counts[a]) {
            return None;
        }
        let [i, j, k] = cell.map(|k| k as usize);
        let [_, m, n] = self.counts.map(|n| n as usize - 1);
        self.cells.get((i * m + j) * n + k).copied()
    }

    /// The face normal to `axis` whose lowest corner is `at`, if it belongs to a surface.
    fn face(&self, axis: usize, at: [isize; 3]) -> Option<GridFace> {
        if (0..3).any(|a| a != axis && (at[a] < 0 || at[a] + 1 >= self.counts[a])) {
            return None;
        }
        let mut below = at;
        below[axis] -= 1;
        let middle = [0, 1, 2].map(|a| {
            let low = self.planes[a][at[a] as usize];
            if a == axis { low } else { 0.5 * (low + self.planes[a][at[a] as usize + 1]) }
        });
        let in_plane = self.sheets[axis][at[axis] as usize].iter().map(|number| &self.boxes[*number]);
        let sheet = in_plane.into_iter().find(|b| b.region.contains(middle)).map(|b| b.filling);
        let face = GridFace { below: self.cell(below), above: self.cell(at), sheet };
        (face.below != face.above || face.sheet.is_some()).then_some(face)
    }

    /// The four faces around the grid edge along `axis` from `at`: two normal to the axis after next, two to
    /// the next one.
    fn faces_around_edge(&self, axis: usize, at: [isize; 3]) -> [Option<GridFace>; 4] {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let (mut before_u, mut before_v) = (at, at);
        before_u[u] -= 1;
        before_v[v] -= 1;
        [self.face(v, before_u), self.face(v, at), self.face(u, before_v), self.face(u, at)]
    }
}

/// Adds the surfaces of all boxes, sheets and slabs, and the walls.
///
/// # Errors
/// [`MeshError::TooMany`] where the planes of the boxes make too many cells.
pub(super) fn add_boxes(
    out: &mut PiecewiseLinearComplex,
    scene: &Scene,
    domain: &Box3,
    sizing: &Sizing,
) -> Result<(), MeshError> {
    let grid = BoxGrid::new(scene, domain)?;
    for axis in 0..3 {
        for i in 0..grid.counts[0] {
            for j in 0..grid.counts[1] {
                for k in 0..grid.counts[2] {
                    let at = [i, j, k];
                    if let Some(face) = grid.face(axis, at) {
                        add_face(out, &grid, (axis, at), face);
                    }
                    if at[axis] + 1 < grid.counts[axis] {
                        add_edge(out, &grid, (axis, at), domain, sizing);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Adds a face of the grid that belongs to a surface, normal to `axis` and with its lowest corner `at`.
fn add_face(
    out: &mut PiecewiseLinearComplex,
    grid: &BoxGrid,
    (axis, at): (usize, [isize; 3]),
    face: GridFace,
) {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let facet = out.plane(axis, grid.planes[axis][at[axis] as usize]);
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|step| {
        let mut to = at;
        to[u] += step[0];
        to[v] += step[1];
        grid.point(to)
    });
    let polygon = out.add_polygon(facet, &corners, grid.part(face));
    if let Some(conductor) = face.sheet.and_then(Region::conductor) {
        out.facets[facet as usize].sheets.push(Sheet { conductor, polygon });
    }
}

/// Adds the grid edge along `axis` that starts at `at`, unless it lies within one flat face or an edge added
/// before.
///
/// As long as the same faces meet along it, it is one segment: planes that cross it far from the body they
/// belong to must not cut it.
fn add_edge(
    out: &mut PiecewiseLinearComplex,
    grid: &BoxGrid,
    (axis, at): (usize, [isize; 3]),
    domain: &Box3,
    sizing: &Sizing,
) {
    let faces @ [a, b, c, d] = grid.faces_around_edge(axis, at);
    if a == b && c == d && (a.is_none() || c.is_none()) {
        return;
    }
    let mut before = at;
    before[axis] -= 1;
    if at[axis] > 0 && grid.faces_around_edge(axis, before) == faces {
        return;
    }
    let mut end = at;
    end[axis] += 1;
    while end[axis] + 1 < grid.counts[axis] && grid.faces_around_edge(axis, end) == faces {
        end[axis] += 1;
    }
    let adjoins = |b: &&FilledBox| {
        b.filling.is_conductor() && faces.iter().flatten().any(|f| f.fillings().any(|x| x == b.filling))
    };
    let size = grid
        .boxes
        .iter()
        .filter(adjoins)
        .map(|b| sizing.facet * b.region.largest_extent())
        .fold(domain.largest_extent(), f64::min);
    let [p, q] = [at, end].map(|x| out.point(grid.point(x), size));
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (normal, face) in [(v, a.or(b)), (u, c.or(d))] {
        if face.is_some() {
            let facet = out.plane(normal, grid.planes[normal][at[normal] as usize]);
            out.add_segment(p, q, facet);
        }
    }
}

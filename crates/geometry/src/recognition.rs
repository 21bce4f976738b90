//! Recognition of boxes and prisms in surfaces of triangles, and of boxes in polygons extruded along an axis.
//!
//! The test for boxes is exact. Every edge of an outline must be parallel to an axis, and every triangle must
//! lie in a plane normal to one, with coordinates that are equal to the last bit. Such a body fills or leaves
//! out each cell of the grid of its coordinates as a whole, and the filled cells are joined to few boxes,
//! whose faces are exactly those of the body.

mod prisms;

pub use prisms::{Prism, outlines_in_plane, prisms_of};

use crate::outline;
use crate::scene::Box3;
use crate::shapes::{Shape, TriangleSurface};
use elastocap_linalg::vector::{cross, minus};
use std::ops::Range;

/// The largest relative difference, due to rounding, between the volume of some boxes or prisms and the sum
/// over the triangles of a surface. Not tuned: it only has to lie above rounding errors and below errors that
/// matter.
const ROUNDING: f64 = 1e-9;

/// The boxes that a body consists of, which share faces at most; `None` if it does not consist of boxes with
/// faces normal to the axes, or if the grid of its coordinates has more cells than `max_cells`.
pub fn boxes_of(shape: &Shape, max_cells: usize) -> Option<Vec<Box3>> {
    match shape {
        Shape::Box(region) => Some(vec![*region]),
        Shape::Extrusion { axis, from, to, outline, .. } => {
            boxes_of_outlines(*axis, [*from, *to], &[outline], max_cells)
        }
        Shape::Surface(surface) => boxes_of_surface(surface, max_cells),
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Physical(_) => None,
    }
}

/// The boxes, as [`boxes_of`] gives them, of the area that an odd number of outlines contains, pulled along
/// an axis between two ends: an outline inside another one is a hole.
pub fn boxes_of_outlines(
    axis: usize,
    [from, to]: [f64; 2],
    outlines: &[&[[f64; 2]]],
    max_cells: usize,
) -> Option<Vec<Box3>> {
    let cells = Cells::of_outlines(axis, [from.min(to), from.max(to)], outlines, max_cells)?;
    // Around holes, `Cells::boxes` would divide a body and its mirror image in different ways.
    Some(if outlines.len() > 1 { cells.strips() } else { cells.boxes() })
}

/// The number of cells into which the planes of all faces of some boxes divide the box around them.
pub fn cells_between(boxes: impl Iterator<Item = Box3>) -> usize {
    let boxes: Vec<Box3> = boxes.collect();
    let along = |axis: usize| {
        let ends = boxes.iter().flat_map(|region| [region.min[axis], region.max[axis]]);
        ascending(ends.filter(|at| at.is_finite()).collect()).len().saturating_sub(1).max(1)
    };
    (0..3).map(along).fold(1, usize::saturating_mul)
}

/// The boxes of which a closed surface of triangles consists, as [`boxes_of`] gives them.
fn boxes_of_surface(surface: &TriangleSurface, max_cells: usize) -> Option<Vec<Box3>> {
    let boxes = Cells::of_surface(surface, max_cells)?.boxes();
    let volume: f64 = boxes.iter().map(|b| [0, 1, 2].map(|a| b.extent(a)).iter().product::<f64>()).sum();
    encloses(surface, volume).then_some(boxes)
}

/// Whether a surface is closed and turned outward around this volume, m^3, by Gauss's theorem. The other
/// tests ignore how the triangles are turned, and some of the triangles altogether.
fn encloses(surface: &TriangleSurface, volume: f64) -> bool {
    let (mut enclosed, mut total, mut areas) = (0.0, 0.0, [0.0; 3]);
    for face in &surface.faces {
        let [p, q, r] = face.map(|k| surface.points[k as usize]);
        let area = cross(minus(q, p), minus(r, p));
        enclosed += volume_below(surface, face);
        total += area.iter().map(|x| x.abs()).sum::<f64>();
        (0..3).for_each(|a| areas[a] += area[a]);
    }
    let is_closed = areas.iter().all(|sum| sum.abs() <= ROUNDING * total);
    is_closed && volume > 0.0 && (enclosed - volume).abs() <= ROUNDING * volume
}

/// The signed volume between a triangle and the plane through the first point of the surface that is normal
/// to x1, m^3: the sum over a closed surface that is turned outward is the volume inside.
fn volume_below(surface: &TriangleSurface, face: &[u32; 3]) -> f64 {
    let from = surface.points[0];
    let [p, q, r] = face.map(|k| [0, 1, 2].map(|a| surface.points[k as usize][a] - from[a]));
    let area = 0.5 * ((q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1]));
    area * (p[0] + q[0] + r[0]) / 3.0
}

/// The cells of a grid that a body fills.
struct Cells {
    /// Planes of the grid along each axis, ascending, m. Two equal planes are the ends of a sheet.
    planes: [Vec<f64>; 3],
    /// Whether each cell is filled, the first axis fastest.
    filled: Vec<bool>,
}

/// Coordinates in ascending order, each once.
fn ascending(mut coordinates: Vec<f64>) -> Vec<f64> {
    coordinates.sort_by(f64::total_cmp);
    coordinates.dedup();
    coordinates
}

/// The index of the plane at a coordinate, which must be among the planes.
fn plane_index(planes: &[f64], at: f64) -> usize {
    planes.partition_point(|plane| *plane < at)
}

/// The coordinate halfway between a plane and the next one.
fn middle(planes: &[f64], k: usize) -> f64 {
    planes[k] + 0.5 * (planes[k + 1] - planes[k])
}

impl Cells {
    /// Cells between these planes, none of them filled; `None` if there are no cells, or more than
    /// `max_cells`.
    fn empty(planes: [Vec<f64>; 3], max_cells: usize) -> Option<Self> {
        let counts = planes.each_ref().map(|p| p.len().saturating_sub(1));
        let cells = counts.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))?;
        (1..=max_cells).contains(&cells).then(|| Self { planes, filled: vec![false; cells] })
    }

    /// The number of cells along each axis.
    fn counts(&self) -> [usize; 3] {
        self.planes.each_ref().map(|p| p.len() - 1)
    }

    /// The position of a cell in `filled`.
    fn index(&self, cell: [usize; 3]) -> usize {
        let [n, m, _] = self.counts();
        cell[0] + n * (cell[1] + m * cell[2])
    }

    /// Cells, filled where they lie in an odd number of polygons pulled along an axis.
    fn of_outlines(axis: usize, ends: [f64; 2], outlines: &[&[[f64; 2]]], max_cells: usize) -> Option<Self> {
        let mut edges =
            outlines.iter().flat_map(|outline| outline.iter().zip(outline.iter().cycle().skip(1)));
        if !edges.all(|(a, b)| a[0] == b[0] || a[1] == b[1]) {
            return None;
        }
        let across: [usize; 2] = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let mut planes = [0; 3].map(|_| ends.to_vec());
        for (k, &a) in across.iter().enumerate() {
            planes[a] = ascending(outlines.iter().flat_map(|outline| outline.iter().map(|q| q[k])).collect());
        }
        let mut cells = Self::empty(planes, max_cells)?;
        let [columns, rows] = across.map(|a| cells.counts()[a]);
        for row in 0..rows {
            for column in 0..columns {
                let centre =
                    [(across[0], column), (across[1], row)].map(|(a, k)| middle(&cells.planes[a], k));
                let mut cell = [0; 3];
                (cell[across[0]], cell[across[1]]) = (column, row);
                let index = cells.index(cell);
                let holding = outlines.iter().filter(|polygon| outline::contains(polygon, centre));
                cells.filled[index] = holding.count() % 2 == 1;
            }
        }
        Some(cells)
    }

    /// Cells, filled where they lie in a closed surface of triangles.
    fn of_surface(surface: &TriangleSurface, max_cells: usize) -> Option<Self> {
        let corners = |face: &[u32; 3]| face.map(|k| surface.points[k as usize]);
        let flat = |face: &[u32; 3], axis: usize| {
            let [p, q, r] = corners(face).map(|corner| corner[axis]);
            p == q && q == r
        };
        if !surface.faces.iter().all(|face| (0..3).any(|axis| flat(face, axis))) {
            return None;
        }
        let used = |axis: usize| surface.faces.iter().flat_map(corners).map(move |p| p[axis]).collect();
        let mut cells = Self::empty([0, 1, 2].map(|axis| ascending(used(axis))), max_cells)?;
        // Along x1, cells change from empty to filled and back where a triangle normal to x1 covers their
        // middle.
        let [n, rows, layers] = cells.counts();
        let mut changes = vec![false; (n + 1) * rows * layers];
        for face in surface.faces.iter().filter(|face| flat(face, 0)) {
            let triangle = corners(face);
            let [y, z] = [1, 2].map(|axis| {
                let ends = triangle.map(|p| plane_index(&cells.planes[axis], p[axis]));
                ends.into_iter().min().unwrap_or(0)..ends.into_iter().max().unwrap_or(0)
            });
            let plane = plane_index(&cells.planes[0], triangle[0][0]);
            for layer in z {
                for row in y.clone() {
                    let centre = [middle(&cells.planes[1], row), middle(&cells.planes[2], layer)];
                    let change = &mut changes[plane + (n + 1) * (row + rows * layer)];
                    *change ^= outline::contains(&triangle.map(|p| [p[1], p[2]]), centre);
                }
            }
        }
        for (filled, changes) in cells.filled.chunks_mut(n).zip(changes.chunks(n + 1)) {
            let mut inside = false;
            for (filled, change) in filled.iter_mut().zip(changes) {
                inside ^= change;
                *filled = inside;
            }
            if inside != changes[n] {
                return None;
            }
        }
        Some(cells)
    }

    /// The filled cells as boxes: from the first cell that is left, each box goes as far as it can along x1,
    /// then x2, then x3.
    fn boxes(mut self) -> Vec<Box3> {
        let mut boxes = Vec::new();
        let counts = self.counts();
        for layer in 0..counts[2] {
            for row in 0..counts[1] {
                for column in 0..counts[0] {
                    let from = [column, row, layer];
                    if !self.filled[self.index(from)] {
                        continue;
                    }
                    let mut to = from.map(|k| k + 1);
                    for axis in 0..3 {
                        while to[axis] < counts[axis] && self.all_filled(from, to, axis) {
                            to[axis] += 1;
                        }
                    }
                    self.clear(from, to);
                    boxes.push(Box3 {
                        min: [0, 1, 2].map(|a| self.planes[a][from[a]]),
                        max: [0, 1, 2].map(|a| self.planes[a][to[a]]),
                    });
                }
            }
        }
        boxes
    }

    /// The filled cells as boxes that are each as long along x1 as they can be. Whole rows and layers of
    /// cells are joined only where they are alike, so that the boxes of a mirror image are the mirror images
    /// of the boxes.
    fn strips(&self) -> Vec<Box3> {
        let [n, rows, layers] = self.counts();
        let row = |row: usize, layer: usize| &self.filled[n * (row + rows * layer)..][..n];
        let layer = |layer: usize| &self.filled[n * rows * layer..][..n * rows];
        let mut boxes = Vec::new();
        for z in alike(layers, |k, l| layer(k) == layer(l)) {
            for y in alike(rows, |k, l| row(k, z.start) == row(l, z.start)) {
                let cells = row(y.start, z.start);
                for x in alike(n, |k, l| cells[k] == cells[l]).into_iter().filter(|x| cells[x.start]) {
                    let blocks = [x, y.clone(), z.clone()];
                    boxes.push(Box3 {
                        min: [0, 1, 2].map(|a| self.planes[a][blocks[a].start]),
                        max: [0, 1, 2].map(|a| self.planes[a][blocks[a].end]),
                    });
                }
            }
        }
        boxes
    }

    /// Whether all cells next to a block, above it along an axis, are filled.
    fn all_filled(&self, from: [usize; 3], to: [usize; 3], axis: usize) -> bool {
        let (mut from, mut to) = (from, to);
        (from[axis], to[axis]) = (to[axis], to[axis] + 1);
        block(from, to).all(|cell| self.filled[self.index(cell)])
    }

    /// Marks all cells of a block as not filled.
    fn clear(&mut self, from: [usize; 3], to: [usize; 3]) {
        for cell in block(from, to) {
            let index = self.index(cell);
            self.filled[index] = false;
        }
    }
}

/// The numbers below `count`, as ranges of neighbours that are the same.
fn alike(count: usize, same: impl Fn(usize, usize) -> bool) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for k in 0..count {
        match out.last_mut() {
            Some(last) if same(last.start, k) => last.end = k + 1,
            Some(_) | None => out.push(k..k + 1),
        }
    }
    out
}

/// The cells of a block, from the cell `from` to the cell before `to` along each axis.
fn block(from: [usize; 3], to: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let plane = move |k| (from[1]..to[1]).flat_map(move |j| (from[0]..to[0]).map(move |i| [i, j, k]));
    (from[2]..to[2]).flat_map(plane)
}

#[cfg(test)]
mod tests;

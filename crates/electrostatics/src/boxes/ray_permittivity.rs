//! The permittivities that the rays of open space cross on their way to infinity.

use crate::boxes::domain::Domain;

/// The least and the greatest permittivity that a ray from each cell can meet.
///
/// Rays point away from the pole: on every axis a ray runs towards the side on which it starts.
#[derive(Debug)]
pub(crate) struct RayPermittivity {
    /// The least permittivity, by direction and then by cell. Bit a of a direction is set where it points
    /// towards lower coordinates on axis a. The table is empty where all permittivities are the same.
    least: Vec<Vec<f64>>,
    /// The greatest permittivity, as `least` has the least.
    greatest: Vec<Vec<f64>>,
    /// For each interval of each axis, whether rays that start there can run upwards, and whether downwards.
    runs: [Vec<[bool; 2]>; 3],
    /// Numbers of intervals.
    cells: [usize; 3],
}

impl RayPermittivity {
    /// The extreme permittivities of a domain. Without rays, or with a uniform permittivity, the tables are
    /// empty.
    pub(crate) fn new(domain: &Domain) -> Self {
        let cells = domain.cells();
        let uniform = domain.permittivity.iter().all(|e| *e == domain.permittivity[0]);
        if uniform || domain.axes.iter().any(|a| a.rays.is_none()) {
            return Self { least: Vec::new(), greatest: Vec::new(), runs: Default::default(), cells };
        }
        let runs = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            let pole = axis.rays.map_or(0.0, |r| r.pole);
            let node = |m: usize| axis.line.nodes[axis.cuts[m]];
            (0..cells[a]).map(|m| [node(m + 1) > pole, node(m) < pole]).collect()
        });
        Self {
            least: (0..8).map(|d| extremes(domain, d, f64::min)).collect(),
            greatest: (0..8).map(|d| extremes(domain, d, f64::max)).collect(),
            runs,
            cells,
        }
    }

    /// Permittivity of a cell over the least that rays from it meet.
    pub(crate) fn contrast(&self, domain: &Domain, cell: [usize; 3]) -> f64 {
        let permittivity = domain.permittivity_of(cell);
        permittivity / self.met(&self.least, cell).fold(permittivity, f64::min)
    }

    /// The largest contrast of any cell.
    pub(crate) fn greatest_contrast(&self, domain: &Domain) -> f64 {
        let [n0, n1, n2] = self.cells;
        let cells = (0..n0 * n1 * n2).map(|c| [c / (n1 * n2), c / n2 % n1, c % n2]);
        if self.least.is_empty() { 1.0 } else { cells.map(|c| self.contrast(domain, c)).fold(1.0, f64::max) }
    }

    /// The greatest permittivity that rays from a cell meet.
    pub(crate) fn greatest(&self, domain: &Domain, cell: [usize; 3]) -> f64 {
        self.met(&self.greatest, cell).fold(domain.permittivity_of(cell), f64::max)
    }

    /// The entries of a table of extremes for a cell, in all directions in which rays from it can run.
    fn met<'a>(&'a self, extreme: &'a [Vec<f64>], cell: [usize; 3]) -> impl Iterator<Item = f64> + 'a {
        let index = (cell[0] * self.cells[1] + cell[1]) * self.cells[2] + cell[2];
        let possible = move |direction: usize| (0..3).all(|a| self.runs[a][cell[a]][direction >> a & 1]);
        extreme.iter().enumerate().filter(move |(d, _)| possible(*d)).map(move |(_, e)| e[index])
    }
}

/// The extreme of the permittivities of each cell and of all cells that a ray from it in one direction can
/// reach.
fn extremes(domain: &Domain, direction: usize, extreme: fn(f64, f64) -> f64) -> Vec<f64> {
    let cells = domain.cells();
    let index = |c: [usize; 3]| (c[0] * cells[1] + c[1]) * cells[2] + c[2];
    let down = |a: usize| direction >> a & 1 == 1;
    let mut out = domain.permittivity.clone();
    // Cells farther along the direction come first.
    let along = |a: usize, n: usize| if down(a) { n } else { cells[a] - 1 - n };
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in 0..cells[2] {
                let cell = [along(0, i), along(1, j), along(2, k)];
                for (a, n) in [i, j, k].into_iter().enumerate() {
                    if n > 0 {
                        let mut next = cell;
                        next[a] = if down(a) { cell[a] - 1 } else { cell[a] + 1 };
                        out[index(cell)] = extreme(out[index(cell)], out[index(next)]);
                    }
                }
            }
        }
    }
    out
}

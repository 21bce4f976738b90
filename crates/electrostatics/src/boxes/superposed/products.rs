//! Products of potentials of two grids without a map. They are computed from the matrices of each axis on the
//! common refinement; no array of the common refinement is ever made.

use super::grids::joined_domain;
use crate::boxes::domain::{Block, Domain, per_element};
use crate::boxes::primal::faces::Faces;
use crate::boxes::primal::terms::separable_terms;
use elastocap_fem::line::line_matrices;
use elastocap_fem::tensor::{Dims, SparseRows, Window, along, axpy, dot};
use elastocap_geometry::scene::across;
use elastocap_linalg::dense;
use faer::{Mat, MatRef};
use std::borrow::Cow;
use std::ops::Range;

/// The space that coefficients belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Space {
    /// That of the base.
    Base,
    /// That of the base, restricted to the functions of the common refinement that do not vanish on the
    /// block.
    BaseOnBlock,
    /// That of the coarse grid.
    Coarse,
    /// That of the coarse grid, restricted to the functions of the common refinement that do not vanish on
    /// the block.
    CoarseOnBlock,
}

/// The spaces of the two grids in that of their common refinement.
pub(super) struct Joint {
    /// The common refinement, without a map.
    domain: Domain,
    /// Numbers of functions on the axes of the base and of the coarse grid.
    dims: [Dims; 2],
    /// Functions of base and coarse grid (columns) in those of the common refinement (rows), by axis.
    embeddings: [[Mat<f64>; 3]; 2],
    /// Functions of the common refinement that do not vanish on the block, by axis.
    window: Window,
    /// Mass and stiffness of each term and axis.
    terms: Vec<[[Mat<f64>; 2]; 3]>,
    /// Open space beyond the last nodes.
    faces: Faces,
}

/// The matrices of each axis between two spaces, for each term: mass and stiffness. Rows and columns that are
/// zero along an axis are left out: few functions of a fine grid are nonzero on the block.
struct Between {
    /// Mass and stiffness of each term and axis.
    terms: Vec<[[SparseRows<f64>; 2]; 3]>,
    /// The functions of the rows that remain.
    rows: Window,
    /// The functions of the columns that remain.
    columns: Window,
}

impl Joint {
    /// The spaces of a base and of a coarse grid, for products over all cells. `None` where the grids have no
    /// common refinement.
    pub(super) fn new(base: &Domain, coarse: &Domain, block: &Block) -> Option<Self> {
        Self::within(base, coarse, block, &Block { lo: [0; 3], hi: coarse.cells() })
    }

    /// The spaces of a base and of a coarse grid, for products over some `cells` only. `None` where the grids
    /// have no common refinement.
    pub(super) fn within(base: &Domain, coarse: &Domain, block: &Block, cells: &Block) -> Option<Self> {
        let domain = Domain { map: None, ..joined_domain(base, coarse)? };
        let [x, y, z] = [0, 1, 2].map(|a| base.axes[a].functions_in(&domain.axes[a]));
        let [u, v, w] = [0, 1, 2].map(|a| coarse.axes[a].functions_in(&domain.axes[a]));
        let matrices = |a: usize, factors: &[f64]| {
            let axis = &domain.axes[a];
            let inside = |(m, factor): (usize, &f64)| {
                if (cells.lo[a]..cells.hi[a]).contains(&m) { *factor } else { 0.0 }
            };
            let factors: Vec<f64> = factors.iter().enumerate().map(inside).collect();
            let (mass, stiffness) = line_matrices(&axis.line, &per_element(axis, &factors));
            let f = axis.functions();
            [mass, stiffness].map(|m| m.as_ref().submatrix(f.start, f.start, f.len(), f.len()).to_owned())
        };
        let terms = separable_terms(&domain)
            .iter()
            .map(|(_, factors)| [0, 1, 2].map(|a| matrices(a, &factors[a])))
            .collect();
        Some(Self {
            dims: [base.primal_dims(), coarse.primal_dims()],
            embeddings: [[x?, y?, z?], [u?, v?, w?]],
            window: [0, 1, 2].map(|a| domain.axes[a].closed(block.lo[a], block.hi[a])),
            terms,
            faces: Faces::new(&domain),
            domain,
        })
    }

    /// The index of the grid that a space belongs to: 0 for the base, 1 for the coarse grid.
    fn grid(space: Space) -> usize {
        match space {
            Space::Base | Space::BaseOnBlock => 0,
            Space::Coarse | Space::CoarseOnBlock => 1,
        }
    }

    /// The functions of a space in those of the common refinement, along an axis.
    fn functions(&self, space: Space, a: usize) -> Mat<f64> {
        let whole = &self.embeddings[Self::grid(space)][a];
        match space {
            Space::Base | Space::Coarse => whole.clone(),
            Space::BaseOnBlock | Space::CoarseOnBlock => {
                let window = &self.window[a];
                Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| {
                    if window.contains(&i) { whole[(i, j)] } else { 0.0 }
                })
            }
        }
    }

    /// The matrices between two spaces.
    fn between(&self, rows: Space, columns: Space) -> Between {
        let functions = [rows, columns].map(|space| [0, 1, 2].map(|a| self.functions(space, a)));
        let term = |matrices: &[[Mat<f64>; 2]; 3]| {
            [0, 1, 2].map(|a| {
                matrices[a].each_ref().map(|m| {
                    let right = dense::product(m.as_ref(), functions[1][a].as_ref());
                    dense::product(functions[0][a].transpose(), right.as_ref())
                })
            })
        };
        let terms: Vec<[[Mat<f64>; 2]; 3]> = self.terms.iter().map(term).collect();
        let of_axis = |a: usize| terms.iter().flat_map(move |term| &term[a]);
        let rows = [0, 1, 2].map(|a| hull(of_axis(a).map(Mat::as_ref)));
        let columns = [0, 1, 2].map(|a| hull(of_axis(a).map(Mat::transpose)));
        let cut = |m: &Mat<f64>, a: usize| {
            let (rows, columns) = (&rows[a], &columns[a]);
            let part = m.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len());
            SparseRows::from_mat(part)
        };
        let cut_term = |term: &[[Mat<f64>; 2]; 3]| [0, 1, 2].map(|a| term[a].each_ref().map(|m| cut(m, a)));
        Between { terms: terms.iter().map(cut_term).collect(), rows, columns }
    }

    /// The products of potentials of one space with those of another, open space beyond the last nodes left
    /// out.
    pub(super) fn products(
        &self,
        (rows, x): (Space, &[&[f64]]),
        (columns, y): (Space, &[&[f64]]),
    ) -> Mat<f64> {
        // Products with the matrices go from the larger array to the smaller one.
        if self.dims[Self::grid(columns)].iter().product::<usize>()
            < self.dims[Self::grid(rows)].iter().product()
        {
            return self.products((columns, y), (rows, x)).transpose().to_owned();
        }
        let between = self.between(rows, columns);
        let [of_rows, of_columns] = [rows, columns].map(|space| self.dims[Self::grid(space)]);
        let x: Vec<Cow<'_, [f64]>> = x.iter().map(|x| part(x, of_rows, &between.rows)).collect();
        let mut out = Mat::zeros(x.len(), y.len());
        for (j, y) in y.iter().enumerate() {
            let image = between.apply(&part(y, of_columns, &between.columns));
            for (i, x) in x.iter().enumerate() {
                out[(i, j)] += dot(x, &image);
            }
        }
        out
    }

    /// The products of sums of potentials of base and coarse grid in open space beyond the last nodes.
    pub(super) fn beyond(&self, base: &[Option<&[f64]>], coarse: &[&[f64]]) -> Mat<f64> {
        let dims = self.domain.primal_dims();
        let on_face = |k: usize| {
            move |a: usize, side: usize| {
                let mut sum = vec![0.0; dims[across(a)[0]] * dims[across(a)[1]]];
                let potentials = [base[k], Some(coarse[k])];
                for (grid, u) in potentials.into_iter().enumerate() {
                    let Some(u) = u else { continue };
                    axpy(&mut sum, 1.0, &self.face(grid, a, side, u));
                }
                sum
            }
        };
        let sums: Vec<_> = (0..coarse.len()).map(on_face).collect();
        self.faces.products(&sums, dims)
    }

    /// The coefficients of a potential of one of the grids on a face, in the functions of the common
    /// refinement.
    fn face(&self, grid: usize, a: usize, side: usize, u: &[f64]) -> Vec<f64> {
        let dims = self.dims[grid];
        let index = if side == 0 { 0 } else { dims[a] - 1 };
        let mut now = dims;
        now[a] = 1;
        let mut out = Vec::with_capacity(now.iter().product());
        let range = |b: usize| if b == a { index..index + 1 } else { 0..dims[b] };
        for (i, j) in range(0).flat_map(|i| range(1).map(move |j| (i, j))) {
            out.extend(range(2).map(|k| u[(i * dims[1] + j) * dims[2] + k]));
        }
        for b in across(a) {
            let matrix = SparseRows::from_mat(self.embeddings[grid][b].as_ref());
            (out, now) = along(b, &matrix, &out, now);
        }
        out
    }
}

impl Between {
    /// The sum of all terms applied to `x`, the coefficients of the functions of the columns that remain. The
    /// result has a number for each function of the rows that remains.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let dims = self.columns.each_ref().map(Range::len);
        let mut total: Vec<f64> = Vec::new();
        for [first, second, third] in &self.terms {
            let (by_mass, now) = along(2, &third[0], x, dims);
            let (by_stiffness, _) = along(2, &third[1], x, dims);
            let (mass_only, after) = along(1, &second[0], &by_mass, now);
            let (mut with_stiffness, _) = along(1, &second[1], &by_mass, now);
            let (other, _) = along(1, &second[0], &by_stiffness, now);
            axpy(&mut with_stiffness, 1.0, &other);
            for (matrix, from) in [(&first[1], &mass_only), (&first[0], &with_stiffness)] {
                let (product, _) = along(0, matrix, from, after);
                if total.is_empty() { total = product } else { axpy(&mut total, 1.0, &product) }
            }
        }
        total
    }
}

/// The range of rows from the first to the last that is nonzero in any of the matrices.
fn hull<'m>(matrices: impl Iterator<Item = MatRef<'m, f64>>) -> Range<usize> {
    let mut out = 0..0;
    for m in matrices {
        for i in (0..m.nrows()).filter(|i| (0..m.ncols()).any(|j| m[(*i, j)] != 0.0)) {
            out = if out.is_empty() { i..i + 1 } else { out.start.min(i)..out.end.max(i + 1) };
        }
    }
    out
}

/// The entries of an array in a window.
fn part<'x>(x: &'x [f64], dims: Dims, window: &Window) -> Cow<'x, [f64]> {
    if (0..3).all(|a| window[a] == (0..dims[a])) {
        return Cow::Borrowed(x);
    }
    let mut out = Vec::with_capacity(window.iter().map(Range::len).product());
    for i in window[0].clone() {
        for j in window[1].clone() {
            let row = (i * dims[1] + j) * dims[2];
            out.extend_from_slice(&x[row + window[2].start..row + window[2].end]);
        }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::layout::Layout;
    use crate::boxes::primal::Primal;
    use crate::boxes::resolution::graded;
    use crate::boxes::superposed::grids::only;
    use crate::solution::ResolutionLevel;
    use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
    use elastocap_geometry::shapes::Shape;

    /// A cube in open space, half in a slab, optionally with the planes of a second body.
    fn domain(order: usize, second: bool) -> Domain {
        let cuboid = |min: [f64; 3], max: [f64; 3]| Shape::Box(Box3 { min, max });
        let mut bodies = vec![
            Body::conductor("cube", cuboid([-0.5; 3], [0.5; 3])),
            Body::dielectric("slab", cuboid([-2.0, 0.0, -1.5], [1.5, 1.0, 2.0]), 3.0),
        ];
        if second {
            bodies.push(Body::dielectric("air", cuboid([-0.3, 1.2, -0.4], [0.6, 1.7, 0.4]), 1.0));
        }
        let scene =
            Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] };
        let layout = Layout::new(&scene, u64::MAX).unwrap();
        let mut grid = layout.grid(&graded(ResolutionLevel { order, levels: 1 }), 4.0);
        layout.reach_to(&mut grid, 20.0);
        layout.domain(&grid).0
    }

    #[test]
    fn products_are_those_on_the_common_refinement() {
        let (base, coarse) = (domain(4, false), domain(3, true));
        let block = Block { lo: [3, 3, 3], hi: [5, 5, 5] };
        let joint = Joint::new(&base, &coarse, &block).unwrap();
        let random = |n: usize, seed: usize| -> Vec<f64> {
            (0..n).map(|k| (((k + seed) * 2_654_435_761) % 1009) as f64 / 1009.0 - 0.5).collect()
        };
        let [x, y] = [&base, &coarse].map(|d| random(d.primal_dims().iter().product(), 7));
        let refined = Primal::without_preconditioner(&joint.domain).unwrap();
        let dims = joint.domain.primal_dims();
        let embedded = |space: Space, u: &[f64]| {
            let (mut out, mut now) = (u.to_vec(), joint.dims[Joint::grid(space)]);
            for a in 0..3 {
                let matrix = SparseRows::from_mat(joint.embeddings[Joint::grid(space)][a].as_ref());
                (out, now) = along(a, &matrix, &out, now);
            }
            if matches!(space, Space::BaseOnBlock | Space::CoarseOnBlock) {
                only(&mut out, dims, &joint.window);
            }
            out
        };
        let all =
            [(Space::Base, &x), (Space::BaseOnBlock, &x), (Space::Coarse, &y), (Space::CoarseOnBlock, &y)];
        let beyond = {
            let coarse: Vec<&[f64]> = vec![&y];
            joint.beyond(&[Some(x.as_slice())], &coarse)[(0, 0)]
                - joint.beyond(&[Some(x.as_slice())], &[vec![0.0; y.len()].as_slice()])[(0, 0)]
                - joint.beyond(&[None], &coarse)[(0, 0)]
        };
        for (i, (rows, u)) in all.iter().enumerate() {
            for (columns, v) in &all[i..] {
                let product = joint.products((*rows, &[u.as_slice()]), (*columns, &[v.as_slice()]))[(0, 0)];
                let expected = refined.product_of(&embedded(*rows, u), &embedded(*columns, v));
                // Between whole grids, the products in open space beyond the last nodes are added.
                let more = match (rows, columns) {
                    (Space::Base, Space::Coarse) => 0.5 * beyond,
                    (Space::Base, Space::Base) => {
                        joint.beyond(&[Some(u.as_slice())], &[vec![0.0; y.len()].as_slice()])[(0, 0)]
                    }
                    (Space::Coarse, Space::Coarse) => joint.beyond(&[None], &[v.as_slice()])[(0, 0)],
                    _ => 0.0,
                };
                println!("{rows:?} {columns:?}: {:e} {expected:e}", product + more);
                assert!(
                    (product + more - expected).abs() < 1e-10 * expected.abs().max(1.0),
                    "{rows:?} {columns:?}"
                );
            }
        }
    }
}

//! Potentials that are even or odd about mirror planes, on one part of a symmetric scene.
//!
//! Where conductors change places about a plane, a potential is the sum of one that is even about it and one
//! that is odd. The plane is an insulated wall to the first and a grounded one to the second, and energies of
//! the two add up. A [`Parity`] says for each such plane which of the two is meant. Planes that cut every
//! conductor in two have even potentials only.

use crate::projection::projected;
use elastocap_geometry::scene::MirrorPlane;
use elastocap_linalg::dense::product;
use faer::Mat;

/// The potentials of one parity.
#[derive(Debug, Clone)]
pub(crate) struct Parity {
    /// Planes that are at zero potential, m.
    pub(crate) grounded: [Option<f64>; 3],
    /// For each conductor of the whole scene the right-hand side in which it has one volt; `None` if it is at
    /// zero in all of them.
    pub(crate) side: Vec<Option<u32>>,
    /// The projection of the potentials of all conductors (columns) onto the right-hand sides (rows).
    projection: Mat<f64>,
    /// Whether the only right-hand side of this parity is one potential everywhere, which has no field.
    constant: bool,
}

impl Parity {
    /// The parities of the part above the planes, in which only some of the whole scene's conductors are
    /// `present`. `grounded` says which of all conductors are at potential zero, so that nothing is solved
    /// for them alone. The part is `enclosed` where nothing but its conductors and the planes can hold
    /// charge.
    pub(crate) fn all(
        planes: &[Option<MirrorPlane>; 3],
        present: &[bool],
        grounded: &[bool],
        enclosed: bool,
    ) -> Vec<Self> {
        let conductors = present.len();
        let exchanging: Vec<(usize, &MirrorPlane)> = planes
            .iter()
            .enumerate()
            .filter_map(|(axis, plane)| Some((axis, plane.as_ref().filter(|p| !p.keeps_conductors())?)))
            .collect();
        if exchanging.is_empty() {
            let solved: Vec<usize> = (0..conductors).filter(|c| !grounded[*c]).collect();
            let side = |c: usize| solved.iter().position(|other| *other == c).map(|side| side as u32);
            return vec![Self {
                grounded: [None; 3],
                side: (0..conductors).map(side).collect(),
                projection: Mat::from_fn(solved.len(), conductors, |i, c| {
                    f64::from(u8::from(solved[i] == c))
                }),
                constant: false,
            }];
        }
        let any_grounded = grounded.contains(&true);
        let parity = |odd: usize| {
            let is_odd = |k: usize| odd >> k & 1 == 1;
            let projection_row = |conductor: usize| {
                let image = |conductor: usize, k: usize| exchanging[k].1.conductors[conductor];
                let mut row = projected(conductor, conductors, exchanging.len(), odd, image);
                row.iter_mut().for_each(|x| *x /= f64::from(1_u32 << exchanging.len()));
                row
            };
            let mut rows: Vec<Vec<f64>> = Vec::new();
            let side = (0..conductors).map(|c| {
                let row = projection_row(c);
                let is_needed = row.iter().zip(grounded).any(|(x, grounded)| *x != 0.0 && !grounded);
                if !present[c] || !is_needed {
                    return None;
                }
                let known = rows.iter().position(|other| *other == row);
                Some(known.unwrap_or_else(|| {
                    rows.push(row);
                    rows.len() - 1
                }) as u32)
            });
            let side = side.collect();
            let mut grounded = [None; 3];
            for (k, (axis, plane)) in exchanging.iter().enumerate() {
                grounded[*axis] = is_odd(k).then_some(plane.at);
            }
            let projection = Mat::from_fn(rows.len(), conductors, |i, j| rows[i][j]);
            let constant = enclosed && odd == 0 && rows.len() == 1 && !any_grounded;
            Self { grounded, side, projection, constant }
        };
        (0..1_usize << exchanging.len()).map(parity).filter(|parity| parity.sides() > 0).collect()
    }

    /// Whether the only right-hand side of this parity is one potential everywhere, which has no field.
    pub(crate) fn is_constant(&self) -> bool {
        self.constant
    }

    /// Number of right-hand sides.
    pub(crate) fn sides(&self) -> usize {
        self.projection.nrows()
    }

    /// The projection of these potentials of all conductors, V, onto each right-hand side.
    pub(crate) fn of(&self, potentials: &[f64]) -> impl Iterator<Item = f64> {
        (0..self.sides())
            .map(|i| potentials.iter().enumerate().map(|(j, v)| self.projection[(i, j)] * v).sum())
    }

    /// A quadratic form in the right-hand sides as one in the potentials of all conductors.
    pub(crate) fn form_of_conductors(&self, form: &Mat<f64>) -> Mat<f64> {
        let half = product(form.as_ref(), self.projection.as_ref());
        product(self.projection.transpose(), half.as_ref())
    }
}

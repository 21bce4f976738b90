//! The solution of the scene without the body that comes near.

use crate::boxes::domain::Domain;
use crate::boxes::dual::across_grids::Fluxes;
use crate::boxes::layout::Frame;
use crate::boxes::symmetry::Part;
use faer::Mat;

/// The solution of a scene without the body that comes near: other scenes differ from it by that body and by
/// what a map bends around the body. See [`solve_superposed`](crate::solve_superposed).
#[derive(Debug)]
pub struct Base {
    /// Number of conductors: they are the first ones of the other scenes.
    pub(crate) conductors: usize,
    /// The frame that the base and the other scenes are laid out in.
    pub(crate) frame: Frame,
    /// Where rays to infinity begin, in the frame.
    pub(crate) radius: f64,
    /// The symmetric parts that were solved.
    pub(crate) parts: Vec<BasePart>,
    /// The relative spread of the target to which it was solved.
    pub spread: f64,
    /// Whether its error is meant to cancel in differences: it may then exceed the tolerance of the scenes.
    pub(crate) cancels: bool,
    /// The value of the target, F, if it has one.
    pub(crate) value: Option<f64>,
    /// Unknowns of the largest problem, primal and dual.
    pub unknowns: usize,
}

/// One symmetric part of a [`Base`].
#[derive(Debug)]
pub(crate) struct BasePart {
    /// Whether the potentials are odd across the mirror plane of each axis.
    pub(crate) odd: [bool; 3],
    /// The potentials of the conductors, one list for each right-hand side.
    pub(crate) potentials: Vec<Vec<f64>>,
    /// The domain of the grid.
    pub(crate) domain: Domain,
    /// The coefficients of the potential of each right-hand side, in the functions of the domain.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// Upper energies.
    pub(crate) upper: Mat<f64>,
    /// Lower energies.
    pub(crate) lower: Mat<f64>,
    /// The fluxes of the dual problem.
    pub(crate) fluxes: Fluxes,
}

impl BasePart {
    /// Whether its potentials are odd across a mirror plane.
    pub(crate) fn is_odd(&self) -> bool {
        self.odd.contains(&true)
    }

    /// The gap between the upper and lower energies, as a form.
    pub(crate) fn gap(&self) -> Mat<f64> {
        &self.upper - &self.lower
    }
}

impl Base {
    /// The part of the base that a `part` of another scene is added to, and for each right-hand side of
    /// `part` the right-hand side of the base with the same potentials of the electrodes, `None` where these
    /// are zero. `None` if the base has no such part.
    pub(crate) fn part_of(&self, part: &Part) -> Option<(&BasePart, Vec<Option<usize>>)> {
        let number = |base_part: &BasePart, v: &Vec<f64>| {
            let electrodes = v.get(..self.conductors)?;
            if electrodes.iter().all(|v| *v == 0.0) {
                return Some(None);
            }
            base_part.potentials.iter().position(|v| v.as_slice() == electrodes).map(Some)
        };
        // Without mirrors several parts lie on the same scene.
        self.parts.iter().filter(|candidate| candidate.odd == part.odd).find_map(|candidate| {
            let indices: Option<Vec<_>> = part.potentials.iter().map(|v| number(candidate, v)).collect();
            Some((candidate, indices?))
        })
    }

    /// Whether its error is meant to cancel in differences, and may exceed the tolerance of the scenes.
    pub fn cancels(&self) -> bool {
        self.cancels
    }

    /// Memory that the base occupies, bytes.
    pub fn bytes(&self) -> u64 {
        let count = |part: &BasePart| {
            let n: usize = part.domain.primal_dims().iter().product();
            // A potential, and the three components of a flux with the potentials they are computed from.
            (n * part.potentials.len() * 6 * 8) as u64
        };
        self.parts.iter().map(count).sum()
    }
}

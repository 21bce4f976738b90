//! The solution of the scene without the body that comes near.

use crate::boxes::domain::Domain;
use crate::boxes::dual::across_grids::Fluxes;
use crate::boxes::layout::Frame;
use crate::boxes::symmetry::Part;
use faer::Mat;

/// The solution of a scene that other scenes differ from by one body, and by what a map bends around it: see
/// [`solve_superposed`](crate::solve_superposed).
#[derive(Debug)]
pub struct Base {
    /// How many conductors it has: the first ones of the other scenes.
    pub(crate) conductors: usize,
    pub(crate) frame: Frame,
    /// Where rays to infinity begin, in the frame.
    pub(crate) radius: f64,
    pub(crate) parts: Vec<BasePart>,
    /// The relative spread of the target that it was solved to.
    pub spread: f64,
    /// Whether its error is to cancel in differences: it is then larger than what is added to it may be known to.
    pub(crate) cancels: bool,
    /// The value of the target, F, if it has one.
    pub(crate) value: Option<f64>,
    /// Unknowns of the largest problem, primal and dual.
    pub unknowns: usize,
}

/// One symmetric part.
#[derive(Debug)]
pub(crate) struct BasePart {
    pub(crate) odd: [bool; 3],
    /// The potentials of the conductors, one list for each right-hand side.
    pub(crate) potentials: Vec<Vec<f64>>,
    pub(crate) domain: Domain,
    /// The coefficients of the potential of each right-hand side, in the functions of the domain.
    pub(crate) coefficients: Vec<Vec<f64>>,
    pub(crate) upper: Mat<f64>,
    pub(crate) lower: Mat<f64>,
    pub(crate) fluxes: Fluxes,
}

impl BasePart {
    /// Whether its potentials are odd across a mirror plane.
    pub(crate) fn is_odd(&self) -> bool {
        self.odd.contains(&true)
    }

    /// By how much its energies are known, as a form.
    pub(crate) fn gap(&self) -> Mat<f64> {
        &self.upper - &self.lower
    }
}

impl Base {
    /// The part that another scene's part is added to, and which of its right-hand sides belongs to each one there: none where the
    /// conductors of the base are at zero. `None` where it has no such part.
    pub(crate) fn part_of(&self, part: &Part) -> Option<(&BasePart, Vec<Option<usize>>)> {
        let number = |own: &BasePart, v: &Vec<f64>| {
            let electrodes = v.get(..self.conductors)?;
            if electrodes.iter().all(|v| *v == 0.0) {
                return Some(None);
            }
            own.potentials.iter().position(|own| own.as_slice() == electrodes).map(Some)
        };
        // Without mirrors several parts lie on the same scene.
        self.parts.iter().filter(|own| own.odd == part.odd).find_map(|own| {
            let of: Option<Vec<_>> = part.potentials.iter().map(|v| number(own, v)).collect();
            Some((own, of?))
        })
    }

    /// Whether its error cancels in differences of what is added to it, and is larger than these may be known to.
    pub fn cancels(&self) -> bool {
        self.cancels
    }

    /// Memory that it takes, bytes.
    pub fn bytes(&self) -> u64 {
        let count = |part: &BasePart| {
            let n: usize = part.domain.primal_dims().iter().product();
            // A potential, and three components of a flux with what they are made from.
            (n * part.potentials.len() * 6 * 8) as u64
        };
        self.parts.iter().map(count).sum()
    }
}

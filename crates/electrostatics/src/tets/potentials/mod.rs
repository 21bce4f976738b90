//! Dirichlet's principle on tetrahedra: continuous potentials of order 1 to 3, whose energies bound the
//! capacitance of any shape from above.

mod reference;
mod space;
mod stiffness;
#[cfg(test)]
mod tests;
mod transfer;

pub(crate) use space::{Held, Space};
pub(crate) use transfer::{CoarserPotentials, Start};

use crate::error::{NotReached, PotentialError};
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use elastocap_linalg::conjugate_gradients::{self, Goal};
use elastocap_linalg::multigrid::{CoarseLevel, Multigrid};
use faer::Mat;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use stiffness::Stiffness;

/// Iterations before the solver gives up. Flat tetrahedra around thin metal take many: 800 and more where the
/// metal is a hundredth as thick as it is wide. Measured:
/// `cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3`.
const ITERATION_LIMIT: usize = 3000;

/// A mesh with its permittivities and conductors, on which potentials are solved for.
#[derive(Debug, Clone, Copy)]
pub struct PotentialProblem<'a> {
    /// The space around the conductors.
    pub mesh: &'a TetMesh,
    /// eps_r of each region of the mesh, positive: the background, then the dielectrics.
    pub permittivity: &'a [f64],
    /// Number of conductors; their indices in the mesh are below it.
    pub conductors: usize,
}

/// Order and accuracy of the potentials.
#[derive(Debug, Clone, Copy)]
pub struct PotentialSettings<'a> {
    /// Order of the potentials, 1 to 3.
    pub order: usize,
    /// Error of the linear solver over the energy: the relative error that it may add to the capacitances.
    pub share: f64,
    /// Set from outside to stop at the next iteration, with [`PotentialError::Cancelled`].
    pub cancel: Option<&'a AtomicBool>,
}

/// Potentials for one volt on each conductor in turn, zero on the others.
#[derive(Debug, Clone)]
pub struct Potentials {
    /// The functions, and which of them are prescribed.
    pub(crate) space: Space,
    /// Per conductor the coefficients of its potential, V, held ones included.
    pub values: Vec<Vec<f64>>,
    /// The energy form of each two potentials, m, open space included. Times [`crate::VACUUM_PERMITTIVITY`]
    /// it is the Maxwell matrix of this space, F, and as a quadratic form an upper bound on the true one.
    pub energies: Mat<f64>,
    /// Largest number of iterations of a right-hand side.
    pub iterations: usize,
    /// Number of unknowns.
    pub unknowns: usize,
    /// How far the linear solver ended from its goal, if it did not meet it. The energies are upper bounds
    /// all the same.
    pub shortfall: Option<NotReached>,
    /// The energy form, from which energies and gradients are computed.
    stiffness: Stiffness,
}

impl Potentials {
    /// Solves for all conductors.
    ///
    /// # Errors
    /// See [`PotentialError`]: a mesh that is not what [`TetMesh`] promises, or a request to stop.
    pub fn solve(
        problem: PotentialProblem<'_>,
        settings: PotentialSettings<'_>,
    ) -> Result<Self, PotentialError> {
        Self::solve_from(problem, settings, None)
    }

    /// Solves as [`Potentials::solve`] does, starting from potentials on a coarser mesh.
    pub(crate) fn solve_from(
        problem: PotentialProblem<'_>,
        settings: PotentialSettings<'_>,
        start: Option<Start<'_>>,
    ) -> Result<Self, PotentialError> {
        let PotentialProblem { mesh, conductors, .. } = problem;
        let space = Space::new(mesh, settings.order)?;
        for held in space.held() {
            if let Held::Conductor(c) = *held
                && c as usize >= conductors
            {
                return Err(PotentialError::Conductor(c));
            }
        }
        let solved = if add_up_to_one(mesh, conductors) { conductors - 1 } else { conductors };
        let mut data = match start {
            Some(start) => start.values(mesh, &space, solved),
            None => vec![vec![0.0; space.functions()]; solved],
        };
        for (c, data) in (0..).zip(&mut data) {
            for (value, held) in data.iter_mut().zip(space.held()).filter(|(_, held)| **held != Held::Free) {
                *value = f64::from(u8::from(*held == Held::Conductor(c)));
            }
        }
        let mut potentials = Self::solve_held(problem, settings, space, data)?;
        if solved < conductors {
            potentials.add_last();
        }
        Ok(potentials)
    }

    /// Adds the potential of the last conductor, with which all of them add up to one.
    fn add_last(&mut self) {
        let rest = |d: usize| 1.0 - self.values.iter().map(|u| u[d]).sum::<f64>();
        self.values.push((0..self.space.functions()).map(rest).collect());
        self.energies = self.stiffness.energies(&self.space, &self.values);
    }

    /// The space and the values of the potentials, from which a solve on a finer mesh starts.
    pub(crate) fn into_coarser(self) -> CoarserPotentials {
        CoarserPotentials { space: self.space, values: self.values }
    }

    /// Solves for the values that `data` prescribes at held functions, starting from those that it has at the
    /// others.
    fn solve_held(
        problem: PotentialProblem<'_>,
        settings: PotentialSettings<'_>,
        space: Space,
        data: Vec<Vec<f64>>,
    ) -> Result<Self, PotentialError> {
        let PotentialProblem { mesh, permittivity, .. } = problem;
        let stiffness = Stiffness::new(mesh, permittivity, &space)?;
        let system = stiffness.assemble(&space);
        // Below the potentials of order p come those of order 1 on the same mesh.
        let linear = if settings.order > 1 {
            let linear = Space::new(mesh, 1)?;
            let matrix = Stiffness::new(mesh, permittivity, &linear)?.assemble(&linear).matrix;
            Some(CoarseLevel { prolongation: space.prolongation(&linear), matrix })
        } else {
            None
        };
        let multigrid = Multigrid::new(system.matrix, linear);
        let start = stiffness.energies(&space, &data);
        let solve_one = |(k, mut u): (usize, Vec<f64>)| {
            let mut b = vec![0.0; space.unknowns()];
            system.held.product(&u, &mut b, |product, _| -product);
            let free = || u.iter().zip(space.unknown()).filter(|(_, unknown)| **unknown != space::NONE);
            let free_values: Vec<f64> = free().map(|(u, _)| *u).collect();
            multigrid.matrix().product(&free_values, &mut b, |product, b| b - product);
            let mut x = vec![0.0; space.unknowns()];
            let goal = Goal {
                share: settings.share,
                start: start[(k, k)],
                iteration_limit: ITERATION_LIMIT,
                cancel: settings.cancel,
            };
            let end = conjugate_gradients::solve(&mut multigrid.cycle(), &b, &mut x, &mut Vec::new(), goal);
            for (u, &unknown) in u.iter_mut().zip(space.unknown()) {
                if unknown != space::NONE {
                    *u += x[unknown as usize];
                }
            }
            (u, end)
        };
        let solved: Vec<_> = data.into_par_iter().enumerate().map(solve_one).collect();
        let mut values = Vec::new();
        let mut iterations = 0;
        let mut shortfall = None;
        for (k, (u, end)) in solved.into_iter().enumerate() {
            values.push(u);
            iterations = iterations.max(end.iterations);
            if settings.cancel.is_some_and(|c| c.load(std::sync::atomic::Ordering::Relaxed)) {
                return Err(PotentialError::Cancelled);
            }
            if !end.reached {
                let left = end.energy_left / start[(k, k)];
                shortfall.get_or_insert(NotReached { iterations: end.iterations, left });
            }
        }
        let energies = stiffness.energies(&space, &values);
        let unknowns = space.unknowns();
        Ok(Self { space, values, energies, iterations, unknowns, shortfall, stiffness })
    }

    /// Gradient of the potential of conductor `k`, V/m: for each tetrahedron the values at its lattice points
    /// of order p - 1. That is one value for p = 1, those at the four corners for p = 2, and for p = 3 those
    /// at the corners and at the middles of the edges 01, 02, 03, 12, 13, 23.
    pub fn gradients(&self, mesh: &TetMesh, k: usize) -> Vec<[f64; 3]> {
        self.stiffness.gradients(mesh, &self.space, &self.values[k])
    }
}

/// Whether the potentials of all conductors add up to one everywhere: no grounded wall and no open space
/// holds them at zero. The last of them follows from the others then.
pub(crate) fn add_up_to_one(mesh: &TetMesh, conductors: usize) -> bool {
    let on_conductor = |role: FaceRole| matches!(role, FaceRole::Conductor(_));
    conductors > 1 && mesh.boundary.iter().all(|f| on_conductor(f.role))
}

//! Potentials, fluxes and the bounds that follow from them, on one mesh.

use crate::bounded::Bounded;
use crate::error::SolveError;
use crate::floating::Floating;
use crate::matrix::{MatrixBounds, contrast_of, of_squares, rounding_scale};
use crate::parity::Parity;
use crate::shortfall::Shortfall;
use crate::solution::PhaseSeconds;
use crate::tets::flux::{Flux, equilibrate};
use crate::tets::marking::{Gaps, State, beyond, states};
use crate::tets::mesh_scene::{MeshScene, MeshSolution};
use crate::tets::parity::{mesh_of, parities};
use crate::tets::potentials::{
    CoarserPotentials, PotentialProblem, PotentialSettings, Potentials, Start, add_up_to_one,
};
use crate::tets::settings::TetrahedraSettings;
use crate::tets::spread::{Spread, spread};
use crate::vacuum::VACUUM_PERMITTIVITY;
use elastocap_geometry::meshing::tets::TetMesh;
use faer::Mat;
use std::time::Instant;

/// Error of the linear solver over the energy, as a share of the tolerance. It is small because the residual
/// is charge that the fluxes must carry to a conductor, which costs more energy than the error of the
/// potential itself. Tuned: `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`.
const ITERATION: f64 = 1e-5;

/// Bytes per tetrahedron for each order: for matrices, multigrid and flux moments, and for each right-hand
/// side. Measured: `benches/forecast.py`.
pub(super) const BYTES: [(u64, u64); 3] = [(1_000, 200), (1_800, 400), (8_000, 1_500)];

/// The results on the mesh before the last refinement.
pub(super) struct Coarser {
    /// The mesh and the capacitances on it.
    pub(super) solved: MeshSolution,
    /// The potentials of each parity with a field.
    pub(super) potentials: Vec<CoarserPotentials>,
    /// For each tetrahedron of the refined mesh the one that it is a part of.
    pub(super) origin: Vec<u32>,
    /// The relative spread.
    pub(super) error: f64,
}

/// Potentials and fluxes of one parity on one mesh.
pub(super) struct SolvedParity {
    pub(super) potentials: Potentials,
    pub(super) flux: Flux,
}

/// The data that stay the same on all meshes of one solve.
pub(super) struct Task<'a> {
    scene: MeshScene<'a>,
    pub(super) settings: &'a TetrahedraSettings,
    pub(super) floating: Floating,
    /// The parities with a field.
    pub(super) parities: Vec<Parity>,
    /// The parity without a field, if there is one.
    constant: Vec<Parity>,
    /// The factor, F/m, from energies on the mesh to those of the whole scene in farads.
    scale: f64,
}

/// Bounds found on one mesh.
pub(super) struct MeshBounds {
    /// Bounds on the capacitance matrix of all conductors, the floating ones included.
    pub(super) unreduced: MatrixBounds,
    /// The Maxwell matrix of the driven conductors, F.
    pub(super) maxwell: Vec<Vec<Bounded>>,
    /// Two-terminal capacitance, F.
    pub(super) two_terminal: Option<Bounded>,
    /// The capacitance that the target names, F.
    pub(super) measured: Option<Bounded>,
    /// How far apart the bounds on the target are.
    pub(super) spread: Spread,
}

impl<'a> Task<'a> {
    /// The data for the meshes that begin with `mesh`.
    pub(super) fn new(mesh: &TetMesh, scene: MeshScene<'a>, settings: &'a TetrahedraSettings) -> Self {
        let floating = Floating::of(scene.potentials);
        let parities = parities(mesh, scene.planes, scene.potentials);
        let (constant, parities) = parities.into_iter().partition(Parity::is_constant);
        Self {
            scene,
            settings,
            floating,
            parities,
            constant,
            scale: VACUUM_PERMITTIVITY * f64::from(scene.copies()),
        }
    }

    /// Potentials and fluxes on one mesh, and the bounds that follow.
    ///
    /// Any potentials give bounds. Those that the linear solver did not bring to its goal are an error only
    /// where the bounds are too far apart for that reason: other tetrahedra would serve better then.
    pub(super) fn bounded(
        &self,
        mesh: &TetMesh,
        coarser: Option<&Coarser>,
        seconds: &mut PhaseSeconds,
    ) -> Result<(Vec<SolvedParity>, MeshBounds), SolveError> {
        let solved = self.on_mesh(mesh, coarser, seconds)?;
        let bounds = self.bounds(&solved)?;
        let tolerance = self.settings.relative_tolerance;
        match solved.iter().find_map(|parity| parity.potentials.shortfall) {
            Some(short)
                if bounds.spread.error > tolerance
                    && self.rounding_spread(&bounds.unreduced) <= tolerance =>
            {
                Err(short.into())
            }
            _ => Ok((solved, bounds)),
        }
    }

    /// Potentials and fluxes of all parities on one mesh.
    fn on_mesh(
        &self,
        mesh: &TetMesh,
        coarser: Option<&Coarser>,
        seconds: &mut PhaseSeconds,
    ) -> Result<Vec<SolvedParity>, SolveError> {
        let (settings, permittivity) = (self.settings, self.scene.permittivity);
        let share = (ITERATION * settings.relative_tolerance).min(1e-6);
        let potential_settings =
            PotentialSettings { order: settings.order, share, cancel: settings.cancel.as_deref() };
        let solve_parity = |(k, parity): (usize, &Parity)| {
            let begin = Instant::now();
            let mesh = mesh_of(parity, mesh);
            let problem = PotentialProblem { mesh: &mesh, permittivity, conductors: parity.sides() };
            let first = coarser.map(|c| Start {
                mesh: &c.solved.mesh,
                potentials: &c.potentials[k],
                origin: &c.origin,
            });
            let potentials = Potentials::solve_from(problem, potential_settings, first);
            seconds.primal += begin.elapsed().as_secs_f64();
            let potentials = potentials?;
            let begin = Instant::now();
            let gradients: Vec<_> =
                (0..parity.sides()).map(|side| potentials.gradients(&mesh, side)).collect();
            let add_up = add_up_to_one(&mesh, parity.sides());
            let flux = equilibrate(&mesh, permittivity, settings.order, &gradients, add_up);
            seconds.dual += begin.elapsed().as_secs_f64();
            Ok(SolvedParity { potentials, flux: flux? })
        };
        self.parities.iter().enumerate().map(solve_parity).collect()
    }

    /// Bounds from the potentials and the fluxes on one mesh.
    ///
    /// # Errors
    /// Bounds that contradict each other.
    fn bounds(&self, solved: &[SolvedParity]) -> Result<MeshBounds, SolveError> {
        let n = self.scene.potentials.len();
        let mut bounds = MatrixBounds { lower: Mat::zeros(n, n), upper: Mat::zeros(n, n) };
        for (parity, SolvedParity { potentials, flux }) in self.parities.iter().zip(solved) {
            let units = Mat::<f64>::identity(flux.charges.nrows(), parity.sides());
            bounds.lower += faer::Scale(self.scale) * parity.form_of_conductors(&flux.lower(units.as_ref()));
            bounds.upper += faer::Scale(self.scale) * parity.form_of_conductors(&potentials.energies);
        }
        bounds
            .count_rounding(&self.rounding_scale(&bounds), of_squares(contrast_of(self.scene.permittivity)));
        if let Some(what) = bounds.crossing() {
            return Err(SolveError::Contradiction(what));
        }
        bounds.uncross();
        Ok(self.reduced(bounds))
    }

    /// For each conductor, the potential with 1 V on it, V, at the first `points` of the mesh.
    pub(super) fn potentials(&self, solved: &[SolvedParity], points: usize) -> Vec<Vec<f64>> {
        let n = self.scene.potentials.len();
        let unit = |c: usize| (0..n).map(|k| f64::from(u8::from(k == c))).collect::<Vec<f64>>();
        let of_conductor = |c: usize| {
            let unit = unit(c);
            let constant: f64 = self.constant.iter().flat_map(|parity| parity.of(&unit)).sum();
            let mut sum = vec![constant; points];
            for (parity, SolvedParity { potentials, .. }) in self.parities.iter().zip(solved) {
                for (v, u) in parity.of(&unit).zip(&potentials.values).filter(|(v, _)| *v != 0.0) {
                    sum.iter_mut().zip(u).for_each(|(sum, u)| *sum += v * u);
                }
            }
            sum
        };
        (0..n).map(of_conductor).collect()
    }

    /// The capacitances that follow from bounds on the matrix of all conductors, and how far apart their
    /// bounds are.
    fn reduced(&self, bounds: MatrixBounds) -> MeshBounds {
        let reduced = self.floating.reduced(&bounds);
        let (maxwell, two_terminal) = (reduced.entries(), reduced.two_terminal());
        let measured = self.settings.target.of(&reduced);
        // The capacitance of each driven conductor with all others at zero potential.
        let alone: Vec<f64> = self.floating.driven.iter().map(|&i| bounds.upper[(i, i)]).collect();
        let spread = spread(&maxwell, two_terminal.as_ref(), measured.as_ref(), &alone, self.settings);
        MeshBounds { unreduced: bounds, maxwell, two_terminal, measured, spread }
    }

    /// The form that rounding of the bounds is a share of: the right-hand sides are the conductors
    /// themselves.
    fn rounding_scale(&self, bounds: &MatrixBounds) -> Mat<f64> {
        let n = bounds.upper.nrows();
        rounding_scale(&Mat::identity(n, n), &bounds.upper)
    }

    /// The spread that rounding alone leaves, however fine the mesh.
    pub(super) fn rounding_spread(&self, bounds: &MatrixBounds) -> f64 {
        let factor = of_squares(contrast_of(self.scene.permittivity));
        self.reduced(bounds.upper_with_rounding(&self.rounding_scale(bounds), factor)).spread.error
    }

    /// The part of the gap between the bounds in each tetrahedron, and the share of the spread that lies
    /// beyond the mesh.
    pub(super) fn gaps(&self, solved: &[SolvedParity], bounds: &MatrixBounds) -> (Gaps, f64) {
        let rows = self.settings.target.rows(self.floating.driven.len());
        let states = states(&self.floating, bounds, &rows);
        let on_sides = |state: &State| State {
            potentials: self.parities.iter().flat_map(|parity| parity.of(&state.potentials)).collect(),
            energy: state.energy,
        };
        let on_sides: Vec<State> = states.iter().map(on_sides).collect();
        let gaps: Vec<&[f64]> =
            solved.iter().flat_map(|parity| parity.flux.gaps.iter().map(Vec::as_slice)).collect();
        let mut gap = Mat::zeros(bounds.upper.nrows(), bounds.upper.nrows());
        for (parity, SolvedParity { flux, .. }) in self.parities.iter().zip(solved) {
            gap += parity.form_of_conductors(&flux.gap);
        }
        (Gaps::new(&on_sides, &gaps), beyond(&states, bounds, &gap, self.scale))
    }

    /// The shortfall of a target that includes a capacitance which may be zero.
    pub(super) fn may_be_zero(&self) -> Shortfall {
        Shortfall::MayBeZero { share: self.settings.relative_tolerance }
    }
}

/// Estimated memory, bytes, that a mesh with this many tetrahedra takes.
pub(super) fn memory_of(tetrahedra: usize, parities: &[Parity], settings: &TetrahedraSettings) -> u64 {
    let (each, per_side) = BYTES[settings.order.clamp(1, 3) - 1];
    let sides: usize = parities.iter().map(Parity::sides).sum();
    tetrahedra as u64 * (parities.len() as u64 * each + sides as u64 * per_side)
}

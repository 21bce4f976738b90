//! The scene without the body that comes near: solved once, for all its positions.

use crate::SolveError;
use crate::boxes::domain::Domain;
use crate::boxes::dual::across_grids::Fluxes;
use crate::boxes::grid_problem::{GridProblem, InFrame};
use crate::boxes::grid_search::Search;
use crate::boxes::layout::{Frame, Layout};
use crate::boxes::mapped::map::SceneMap;
use crate::boxes::open_space::OpenSpace;
use crate::boxes::symmetry::Part;
use crate::floating::Floating;
use crate::solution::Settings;
use elastocap_geometry::scene::Scene;
use faer::Mat;
use std::sync::Arc;

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
    /// The value of the target, F, if it has one.
    pub(crate) value: Option<f64>,
    /// Unknowns of the largest problem, primal and dual.
    pub unknowns: usize,
}

/// One symmetric part.
#[derive(Debug)]
pub(crate) struct BasePart {
    pub(crate) odd: [bool; 3],
    /// Of the conductors, for each right-hand side.
    pub(crate) potentials: Vec<Vec<f64>>,
    pub(crate) domain: Domain,
    /// Of the potentials, for each right-hand side.
    pub(crate) coefficients: Vec<Vec<f64>>,
    pub(crate) upper: Mat<f64>,
    pub(crate) lower: Mat<f64>,
    pub(crate) fluxes: Fluxes,
}

/// The largest relative spread of a base over the tolerance of what is added to it, and over the one aimed for, where that is a small share.
const MOST: f64 = 0.8;
const MOST_OF_SHARE: f64 = 2.0;

/// What is added to a base.
#[derive(Debug, Clone, Copy)]
pub struct Additions {
    /// Distance from the middle of the conductors beyond which no face of any scene lies, m.
    pub reach: f64,
    /// What they change of the target at most, over its value without them; one where nothing is known of it. Where the grids end in open
    /// space follows from it: bounds hold whatever is given, but too small a value makes them wide.
    pub change: f64,
    /// Relative spread to aim for of the base, over the tolerance that the scenes are to have.
    pub share: f64,
}

/// Where rays begin at least, over the distance of the farthest face: twice as far as any plane, and a little more for the places from which
/// the two distances are measured.
const NEAREST: f64 = 2.5;

/// The energy of what is added over the change that it makes, where the grids end.
const ENERGY: f64 = 2.0;

/// Solves a scene as the base of others, for the tolerance that these are to have. `like` is one of these, whose symmetry all have. `None`
/// where the scene cannot serve as a base.
///
/// # Errors
/// Those of [`crate::solve`].
pub fn solve_base(
    scene: &Scene,
    like: (&Scene, &Arc<SceneMap>),
    additions: Additions,
    settings: &Settings,
) -> Result<Option<Base>, SolveError> {
    let frame = Frame::of(scene)?;
    let other = Layout::in_frame(like.0, Some(like.1), Some(frame), settings.memory_limit)?;
    let mirrored = other.mirror.map(|plane| plane.is_some());
    let settings = Settings { field: false, ..settings.clone() };
    let tolerance = settings.relative_tolerance;
    let of_energy = tolerance / (ENERGY * additions.change).min(1.0);
    let far = OpenSpace::new(&other, &Floating::new(like.0), &settings).distance(of_energy);
    let in_frame =
        InFrame { frame, mirrored, reach: additions.reach / frame.unit, far: far.max(NEAREST), radius: None };
    let mut problem = GridProblem::new(scene, None, Some(&in_frame), &settings)?;
    problem.keeps_fluxes = true;
    let mut search = Search::new(&problem)?;
    let met = search
        .pursue(additions.share * tolerance, (MOST_OF_SHARE * additions.share).min(MOST) * tolerance)?;
    let found = search.finish(met)?;
    if !met {
        return Ok(None);
    }
    let radius = found.grid.radius;
    let mut out = Base {
        conductors: problem.layout.conductors.len(),
        frame,
        radius,
        parts: Vec::new(),
        spread: found.outcome.error(&settings),
        value: settings.target.value(&found.outcome.bounds.upper),
        unknowns: found.outcome.unknowns,
    };
    let solved = problem.parts.iter().filter(|part| !part.potentials.is_empty());
    for (part, (_, own)) in solved.zip(found.outcome.solved) {
        let (Some(mut fluxes), Some(lower)) = (own.fluxes, own.lower) else { return Ok(None) };
        fluxes.prepare()?;
        out.parts.push(BasePart {
            odd: part.odd,
            potentials: part.potentials.clone(),
            domain: own.domain,
            coefficients: own.energies.coefficients,
            upper: own.energies.matrix,
            lower,
            fluxes,
        });
    }
    Ok(Some(out))
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

//! A layer pressed to given loads on finer and finer meshes, until its force is known to a tolerance.
//!
//! Every mesh halves the size of the elements of the one before. The error of a force is told from the differences of
//! the last three meshes: the corners of a pressed layer are singular and the force converges with the first power of the
//! element size or better, so that the error that is left is at most the last difference.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::dimension::{Dimension, Plane};
use super::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel, LayerStep};
use super::material::Rubber;
use super::model::{Load, ModelError, State};
use super::newton::{NewtonSettings, Stopped};

/// A layer, what is in it and what presses it. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerProblem {
    /// Thickness `H` at rest.
    pub thickness: f64,
    /// From the middle of the layer to its end, at rest.
    pub half_length: f64,
    /// What the layer is made of.
    pub rubber: Rubber,
    /// Bodies of another rubber in it.
    pub inclusions: Vec<Inclusion>,
    /// What presses.
    pub indenter: Indenter,
    /// What becomes of the end.
    pub end: End,
}

/// What to press to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Displacement of the indenter over the thickness.
    Compression(f64),
    /// Force on the whole layer, positive in compression: in N, in the plane in N per metre of width.
    Force(f64),
}

/// How far to refine.
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    /// Error of the force to reach, relative to the force.
    pub relative_tolerance: f64,
    /// Elements over the thickness of each mesh, about, ascending.
    pub over_thickness: Vec<usize>,
}

impl Refinement {
    /// Up to four meshes, from 5 to 40 elements over the thickness.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, over_thickness: vec![5, 10, 20, 40] }
    }
}

/// One mesh that was solved on.
#[derive(Debug)]
pub struct Level<S: Dimension = Plane> {
    /// The layer on this mesh.
    pub model: LayerModel<S>,
    /// Elements over the thickness, about.
    pub over_thickness: usize,
    /// Wall-clock seconds that it took.
    pub seconds: f64,
    /// Equilibria found, goal by goal; the goals that were not reached are not in it.
    reached: Vec<Option<Reached<S>>>,
    stopped: Vec<Option<Box<Stopped>>>,
}

#[derive(Debug, Clone)]
struct Reached<S: Dimension> {
    step: LayerStep,
    state: State<S>,
    load: Load<S>,
}

/// What is known of one goal.
#[derive(Debug, Clone)]
pub struct Pressed<S: Dimension = Plane> {
    /// Forces and contact on the finest mesh that reached it.
    pub step: LayerStep,
    /// Number of that mesh among the levels.
    pub level: usize,
    /// Its equilibrium.
    pub state: State<S>,
    /// The load of that equilibrium.
    pub load: Load<S>,
    /// Error of the force (of the compression, where the goal is a force), absolute; `None` with less than three meshes.
    pub error: Option<f64>,
    /// The value that `error` belongs to, on each mesh that reached the goal, coarse to fine.
    pub refinement: Vec<f64>,
    /// Whether `error` is within the tolerance.
    pub converged: bool,
}

/// Why a goal was not reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PressError {
    /// Newton's method stopped before it.
    #[error("{stopped}; the layer was followed to a compression of {compression:.4}")]
    Stopped {
        /// Compression of the last equilibrium.
        compression: f64,
        /// Where and why.
        stopped: Box<Stopped>,
    },
    /// The run was stopped on request.
    #[error("stopped on request")]
    Cancelled,
}

/// All goals, in the order they were asked for.
#[derive(Debug)]
pub struct Pressing<S: Dimension = Plane> {
    /// The meshes, coarse to fine.
    pub levels: Vec<Level<S>>,
    /// What is known of each goal.
    pub goals: Vec<Result<Pressed<S>, PressError>>,
    /// Why the next mesh was not solved on, where it was too large for the memory.
    pub too_large: Option<ModelError>,
}

impl LayerProblem {
    /// The mesh of this layer with about `n` elements over its thickness.
    pub fn mesh(&self, n: usize) -> LayerMesh {
        let (height, length) = (self.thickness, self.half_length);
        match self.indenter {
            Indenter::Sharp { half_width } | Indenter::Bonded { half_width } => {
                LayerMesh::under_punch(height, length, half_width, n, 0.7, 6)
            }
            _ if self.folds() => {
                let mut mesh = LayerMesh::folding_end(height, length, n, 12 * n / 5, 0.3);
                let edges =
                    |axis: usize| self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]]);
                move_to(&mut mesh.along, edges(0));
                move_to(&mut mesh.up, edges(1));
                mesh
            }
            _ => {
                let mut mesh = LayerMesh::uniform(height, length, n, 0.8, 4 + n / 2);
                if self.end == End::Far {
                    mesh.radii.clear();
                }
                let edges =
                    |axis: usize| self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]]);
                mesh.along = through(&mesh.along, edges(0));
                mesh.up = through(&mesh.up, edges(1));
                mesh
            }
        }
    }

    /// Whether the end folds through itself at the bonded corner, as a free end does that nothing carries. A
    /// rubber whose energy needs `J > 0` cannot follow: it gets a fan there, and is too stiff.
    fn folds(&self) -> bool {
        let smooth = Rubber { volume_barrier: 0.0, ..self.rubber.clone() };
        self.indenter == Indenter::WholeTop && self.end == End::Free && smooth.knows_inside_out()
    }

    /// Presses the layer to each of `goals`, all of them compressions or all of them forces.
    ///
    /// `cancel` stops the work at the next goal; `tell` is told how many goals of how many are done on which mesh.
    ///
    /// # Errors
    /// [`ModelError`] where there is no mesh. A goal that is not reached is no error: it says so itself.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        cancel: &AtomicBool,
        tell: &dyn Fn(usize, usize),
    ) -> Result<Pressing, ModelError> {
        let (mut rubber, mut settings) = (self.rubber.clone(), NewtonSettings::default());
        if self.folds() {
            rubber.volume_barrier = 0.0;
            settings = NewtonSettings::through_folds();
        }
        press_on(goals, refinement, &settings, cancel, tell, &|n| {
            LayerModel::with_inclusions(&self.mesh(n), &rubber, &self.inclusions, self.indenter, self.end)
        })
    }
}

/// Presses layers to each of `goals`, mesh after mesh: `layer` makes the one with about so many elements over the
/// thickness. A mesh too large for the memory ends the refinement.
pub(crate) fn press_on<S: Dimension>(
    goals: &[Goal],
    refinement: &Refinement,
    settings: &NewtonSettings,
    cancel: &AtomicBool,
    tell: &dyn Fn(usize, usize),
    layer: &dyn Fn(usize) -> Result<LayerModel<S>, ModelError>,
) -> Result<Pressing<S>, ModelError> {
    let mut order: Vec<usize> = (0..goals.len()).collect();
    order.sort_by(|&a, &b| goals[a].value().total_cmp(&goals[b].value()));
    let mut levels: Vec<Level<S>> = Vec::new();
    let mut too_large = None;
    for (k, &n) in refinement.over_thickness.iter().enumerate() {
        let start = Instant::now();
        let model = match layer(n) {
            Ok(model) => model,
            Err(error @ ModelError::TooLarge { .. }) if k > 0 => {
                too_large = Some(error);
                break;
            }
            Err(error) => return Err(error),
        };
        let mut level = Level {
            model,
            over_thickness: n,
            seconds: 0.0,
            reached: vec![None; goals.len()],
            stopped: vec![None; goals.len()],
        };
        level.walk(goals, &order, settings, cancel, &|done| tell(k, done));
        level.model.release_factors();
        level.seconds = start.elapsed().as_secs_f64();
        let further = level.reached.iter().filter(|r| r.is_some()).count();
        let before = levels.last().map_or(0, |l: &Level<S>| l.reached.iter().filter(|r| r.is_some()).count());
        levels.push(level);
        let known = |g: usize| judge(&levels, goals, g, refinement).is_some_and(|p| p.converged);
        if cancel.load(Ordering::Relaxed) || further < before || (0..goals.len()).all(known) {
            break;
        }
    }
    let goals = (0..goals.len())
        .map(|g| judge(&levels, goals, g, refinement).ok_or_else(|| why_not(&levels, g)))
        .collect();
    Ok(Pressing { levels, goals, too_large })
}

impl Goal {
    fn value(self) -> f64 {
        match self {
            Self::Compression(value) | Self::Force(value) => value,
        }
    }
}

/// The breakpoints with `edges` among them: the nearest inner breakpoint moves to an edge if none else needs it, or one
/// more is put in.
fn through(breakpoints: &[f64], edges: impl Iterator<Item = f64>) -> Vec<f64> {
    let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
    let size = (last - first) / (breakpoints.len() - 1) as f64;
    let tiny = 1e-9 * (last - first);
    let mut fixed = vec![first, last];
    fixed.extend(edges.filter(|e| *e > first + tiny && *e < last - tiny));
    fixed.sort_by(f64::total_cmp);
    fixed.dedup_by(|a, b| (*a - *b).abs() < tiny);
    let mut all = vec![first];
    for pair in fixed.windows(2) {
        let count = ((pair[1] - pair[0]) / size).round().max(1.0) as usize;
        all.extend(super::mesh::uniform(pair[0], pair[1], count).iter().skip(1));
    }
    all
}

/// Moves the nearest inner breakpoint to each of `edges`, or puts one in where that is an edge already.
fn move_to(breakpoints: &mut Vec<f64>, edges: impl Iterator<Item = f64>) {
    let tiny = 1e-9 * breakpoints[breakpoints.len() - 1];
    let mut fixed = vec![breakpoints[0], breakpoints[breakpoints.len() - 1]];
    for edge in edges.filter(|e| *e > fixed[0] + tiny && *e < fixed[1] - tiny).collect::<Vec<f64>>() {
        if fixed.iter().any(|f| (f - edge).abs() < tiny) {
            continue;
        }
        let after = breakpoints.partition_point(|x| *x < edge).min(breakpoints.len() - 1);
        let near = if edge - breakpoints[after - 1] < breakpoints[after] - edge { after - 1 } else { after };
        if fixed.contains(&breakpoints[near]) {
            breakpoints.insert(after, edge);
        } else {
            breakpoints[near] = edge;
        }
        fixed.push(edge);
    }
}

impl<S: Dimension> Level<S> {
    /// Goes through the goals from the smallest up; what is beyond the first that is not reached is not tried.
    fn walk(
        &mut self,
        goals: &[Goal],
        order: &[usize],
        settings: &NewtonSettings,
        cancel: &AtomicBool,
        tell: &dyn Fn(usize),
    ) {
        for (done, &g) in order.iter().enumerate() {
            if cancel.load(Ordering::Relaxed) {
                return;
            }
            let step = match goals[g] {
                Goal::Compression(compression) => self.model.press(compression, settings),
                Goal::Force(force) => self.model.press_with(force, settings),
            };
            match step {
                Ok(step) => {
                    let (state, load) = (self.model.state().clone(), self.model.load().clone());
                    self.reached[g] = Some(Reached { step, state, load });
                }
                Err(stopped) => {
                    for &g in &order[done..] {
                        self.stopped[g] = Some(stopped.clone());
                    }
                    return;
                }
            }
            tell(done + 1);
        }
    }
}

/// What the levels say of goal `g`; `None` if none reached it.
fn judge<S: Dimension>(
    levels: &[Level<S>],
    goals: &[Goal],
    g: usize,
    refinement: &Refinement,
) -> Option<Pressed<S>> {
    let (level, reached) =
        levels.iter().enumerate().rev().find_map(|(k, l)| Some((k, l.reached[g].as_ref()?)))?;
    let value = |r: &Reached<S>| match goals[g] {
        Goal::Compression(_) => r.step.force,
        Goal::Force(_) => r.step.compression,
    };
    let values: Vec<(f64, f64)> = levels
        .iter()
        .filter_map(|l| Some((1.0 / l.over_thickness as f64, value(l.reached[g].as_ref()?))))
        .collect();
    let now = value(reached);
    let error = match values.as_slice() {
        // Nothing presses: no mesh can be wrong about it.
        _ if goals[g].value() == 0.0 => Some(0.0),
        [.., first, before, now] => Some(error_of([*first, *before, *now])),
        _ => None,
    };
    let converged = error.is_some_and(|e| e <= refinement.relative_tolerance * now.abs());
    Some(Pressed {
        step: reached.step,
        level,
        state: reached.state.clone(),
        load: reached.load.clone(),
        error,
        refinement: values.iter().map(|v| v.1).collect(),
        converged,
    })
}

/// Error of the last of three values on meshes with elements of the given sizes, `(size, value)`.
///
/// Convergence with the first power of the size makes the error the last difference, over the factor in size less one.
/// The difference of two meshes can vanish by accident, that of three hardly: the last one is taken to be at least what
/// convergence of the second power would leave of the one before.
fn error_of([first, before, now]: [(f64, f64); 3]) -> f64 {
    let square = |of: (f64, f64)| of.0 * of.0;
    let left = (square(before) - square(now)) / (square(first) - square(before));
    let difference = (now.1 - before.1).abs().max(left * (before.1 - first.1).abs());
    difference / (before.0 / now.0 - 1.0)
}

fn why_not<S: Dimension>(levels: &[Level<S>], g: usize) -> PressError {
    // The mesh that came farthest tells most.
    let stopped = levels.iter().filter_map(|l| {
        let stopped = l.stopped[g].clone()?;
        Some((l.model.step(stopped.effort).compression, stopped))
    });
    match stopped.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((compression, stopped)) => PressError::Stopped { compression, stopped },
        None => PressError::Cancelled,
    }
}

//! A layer pressed to given loads on finer and finer meshes, until its force is known to a tolerance.
//!
//! Every mesh halves the size of the elements of the one before. The error of a force is told from the differences of
//! the last three meshes: the corners of a pressed layer are singular and the force converges with the first power of the
//! element size or better, so that the error that is left is at most the last difference.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel, LayerStep};
use super::material::Rubber;
use super::mesh::graded;
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
    /// Force on the whole layer in N per metre of width, positive in compression.
    Force(f64),
}

/// How far to refine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Error of the force to reach, relative to the force.
    pub relative_tolerance: f64,
    /// Elements over the thickness of the first mesh.
    pub first: usize,
    /// Meshes at most.
    pub meshes: usize,
}

impl Refinement {
    /// Up to four meshes, from 5 to 40 elements over the thickness.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, first: 5, meshes: 4 }
    }
}

/// One mesh that was solved on.
#[derive(Debug)]
pub struct Level {
    /// The layer on this mesh.
    pub model: LayerModel,
    /// Elements over the thickness, about.
    pub over_thickness: usize,
    /// Wall-clock seconds that it took.
    pub seconds: f64,
    /// Equilibria found, goal by goal; the goals that were not reached are not in it.
    reached: Vec<Option<Reached>>,
    stopped: Vec<Option<Box<Stopped>>>,
}

#[derive(Debug, Clone)]
struct Reached {
    step: LayerStep,
    state: State,
    load: Load,
}

/// What is known of one goal.
#[derive(Debug, Clone)]
pub struct Pressed {
    /// Forces and contact on the finest mesh that reached it.
    pub step: LayerStep,
    /// Number of that mesh among the levels.
    pub level: usize,
    /// Its equilibrium.
    pub state: State,
    /// The load of that equilibrium.
    pub load: Load,
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
pub struct Pressing {
    /// The meshes, coarse to fine.
    pub levels: Vec<Level>,
    /// What is known of each goal.
    pub goals: Vec<Result<Pressed, PressError>>,
}

/// Half-length over the thickness of a layer that is solved with equal elements all along.
const SHORT: f64 = 4.0;

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
                if self.indenter == Indenter::WholeTop && length > SHORT * height {
                    mesh.along = self.long(n);
                    move_to(&mut mesh.along, edges(0));
                } else {
                    mesh.along = through(&mesh.along, edges(0));
                }
                mesh.up = through(&mesh.up, edges(1));
                mesh
            }
        }
    }

    /// Breakpoints along a long layer: away from its end and its inclusions the solution varies over its length only, and
    /// the elements are up to so many times longer than high as the layer is longer than [`SHORT`] of its heights.
    fn long(&self, n: usize) -> Vec<f64> {
        let (size, end) = (self.thickness / n as f64, self.half_length - self.thickness);
        let longest = size * self.half_length / (SHORT * self.thickness);
        graded(0.0, end, |x| {
            let from_inclusions = self.inclusions.iter().map(|i| (i.min[0] - x).max(x - i.max[0]));
            let away = from_inclusions.fold(end - x, f64::min) - self.thickness;
            (size + 0.25 * away.max(0.0)).min(longest)
        })
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
        let mut order: Vec<usize> = (0..goals.len()).collect();
        order.sort_by(|&a, &b| goals[a].value().total_cmp(&goals[b].value()));
        let mut levels: Vec<Level> = Vec::new();
        let (mut rubber, mut settings) = (self.rubber.clone(), NewtonSettings::default());
        if self.folds() {
            rubber.volume_barrier = 0.0;
            settings = NewtonSettings::through_folds();
        }
        for k in 0..refinement.meshes {
            let n = refinement.first << k;
            let start = Instant::now();
            let mesh = self.mesh(n);
            let model =
                LayerModel::with_inclusions(&mesh, &rubber, &self.inclusions, self.indenter, self.end)?;
            let mut level = Level {
                model,
                over_thickness: n,
                seconds: 0.0,
                reached: vec![None; goals.len()],
                stopped: vec![None; goals.len()],
            };
            level.walk(goals, &order, &settings, cancel, &|done| tell(k, done));
            level.seconds = start.elapsed().as_secs_f64();
            let further = level.reached.iter().filter(|r| r.is_some()).count();
            levels.push(level);
            let known = |g: usize| judge(&levels, goals, g, refinement).is_some_and(|p| p.converged);
            let done = order.iter().all(|&g| known(g));
            // What neither this mesh nor one before reached, or only one before, takes longest on the next one.
            if k > 0 {
                order.truncate(further);
            }
            if cancel.load(Ordering::Relaxed) || done || order.is_empty() {
                break;
            }
        }
        let goals = (0..goals.len())
            .map(|g| judge(&levels, goals, g, refinement).ok_or_else(|| why_not(&levels, g)))
            .collect();
        Ok(Pressing { levels, goals })
    }
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

impl Level {
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
fn judge(levels: &[Level], goals: &[Goal], g: usize, refinement: &Refinement) -> Option<Pressed> {
    let (level, reached) =
        levels.iter().enumerate().rev().find_map(|(k, l)| Some((k, l.reached[g].as_ref()?)))?;
    let value = |r: &Reached| match goals[g] {
        Goal::Compression(_) => r.step.force,
        Goal::Force(_) => r.step.compression,
    };
    let values: Vec<f64> = levels.iter().filter_map(|l| l.reached[g].as_ref().map(value)).collect();
    let now = value(reached);
    let error = match values.as_slice() {
        // Nothing presses: no mesh can be wrong about it.
        _ if goals[g].value() == 0.0 => Some(0.0),
        // The difference of two meshes can vanish by accident, that of three hardly: a quarter of the one before is
        // what convergence of the second power would leave.
        [.., first, before, now] => Some((now - before).abs().max(0.25 * (before - first).abs())),
        _ => None,
    };
    let converged = error.is_some_and(|e| e <= refinement.relative_tolerance * now.abs());
    Some(Pressed {
        step: reached.step,
        level,
        state: reached.state.clone(),
        load: reached.load.clone(),
        error,
        refinement: values,
        converged,
    })
}

fn why_not(levels: &[Level], g: usize) -> PressError {
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

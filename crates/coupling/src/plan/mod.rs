//! What a case asks to be solved, what of it can be left out, and what it will take: known before anything is solved.

mod forecast;
mod layer;

use elastocap_electrostatics::{Forecast, ResolutionLevel, Settings, Target, forecast};
use elastocap_geometry::mirror;
use elastocap_geometry::scene::Scene;
use elastocap_mechanics::ForceLimit;
use serde::Serialize;

pub use layer::LayerForecast;
use layer::may_bend;

use crate::deform::{Deformation, layer_state};
use crate::faceting_error::curvature_error;
use crate::scene::{DeformedScene, scene_of};
use crate::tetrahedra::order;
use elastocap_case::{Case, FieldSolver, Load};

/// What is wanted of a run besides the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Whether what the scene does not need is left out. Without it the numbers are the same, and take longer.
    pub prune: bool,
    /// Whether the fields are wanted, as one `.vtu` per step.
    pub fields: bool,
    /// Whether `scene.glb` is wanted.
    pub scene: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { prune: true, fields: true, scene: true }
    }
}

/// What is solved, in which order, and what is left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// What the case asks for.
    pub kind: Kind,
    /// The load steps in the order of the case; one, without load, for a scene that nothing presses.
    pub steps: Vec<PlannedStep>,
    /// What is solved and written.
    pub solved: Vec<Planned>,
    /// What is not, and why.
    pub left_out: Vec<LeftOut>,
    /// Unknowns of the largest problem, primal plus dual; 0 if there is no field problem.
    pub unknowns: usize,
    /// Peak memory of the field solves, bytes: an upper estimate.
    pub memory_bytes: u64,
    /// Expected seconds of all field solves on two cores.
    pub seconds: f64,
    /// What the finite elements of the layer take; `None` without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerForecast>,
    /// Mirror planes used, by axis.
    pub mirrored: [bool; 3],
    /// Field problems that run at the same time, at most.
    pub at_once: usize,
    /// What the user should know before the run.
    pub warnings: Vec<String>,
    /// Memory that one solve may take, bytes.
    #[serde(skip)]
    pub memory_limit: u64,
    /// Memory that the finite elements of the layer may take, bytes.
    #[serde(skip)]
    pub layer_memory_limit: u64,
    /// How far eq. (50) can be used.
    #[serde(skip)]
    pub force_limit: Option<ForceLimit>,
    /// Whether what the scene does not need is left out.
    pub pruned: bool,
}

/// What a case asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Capacitance against load.
    Curve,
    /// The capacitances of a scene that nothing presses.
    Capacitance,
    /// Force against compression, without conductors.
    Mechanics,
}

/// One load step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedStep {
    /// Position in the case.
    pub index: usize,
    /// What presses.
    pub load: StepLoad,
    /// The earlier step whose result is this one's too.
    pub same_as: Option<usize>,
    /// Why the step cannot be solved, if that is known beforehand.
    pub failure: Option<String>,
}

/// What presses in one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepLoad {
    /// Nothing.
    None,
    /// U/H.
    Compression(f64),
    /// N.
    ForceN(f64),
}

/// One thing that is done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    /// Mechanics, electrostatics, or files.
    pub part: &'static str,
    /// In words.
    pub what: String,
}

/// One thing that is not done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// In words.
    pub what: String,
    /// The reason.
    pub why: String,
    /// Whose choice it is; only the plan's own are undone by `--no-prune`.
    pub by: Decision,
    /// What it saves, in words.
    pub saving: String,
    /// Unknowns that need not be solved for.
    pub saved_unknowns: Option<usize>,
    /// Expected seconds that it saves.
    pub saved_seconds: Option<f64>,
}

/// Whose choice it was to leave something out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// The plan's: the result does not need it.
    Plan,
    /// The case's: it does not ask for it.
    Case,
    /// The caller's.
    Caller,
}

impl LeftOut {
    fn new(by: Decision, what: impl Into<String>, why: impl Into<String>, saving: impl Into<String>) -> Self {
        let (what, why, saving) = (what.into(), why.into(), saving.into());
        Self { what, why, by, saving, saved_unknowns: None, saved_seconds: None }
    }
}

/// Most field problems at the same time, whatever the machine.
const MOST_AT_ONCE: usize = 8;

impl Plan {
    /// Plans a case. Nothing is solved but the closed-form mechanics, which takes microseconds.
    pub fn new(case: &Case, options: &Options) -> Self {
        let steps = planned_steps(case, options);
        let kind = match (&case.load, case.has_conductors()) {
            (Some(_), true) => Kind::Curve,
            (None, _) => Kind::Capacitance,
            (Some(_), false) => Kind::Mechanics,
        };
        let mut plan = Self {
            kind,
            steps,
            solved: Vec::new(),
            left_out: Vec::new(),
            unknowns: 0,
            memory_bytes: 0,
            seconds: 0.0,
            layer: None,
            mirrored: [false; 3],
            at_once: 1,
            warnings: Vec::new(),
            memory_limit: Settings::default().memory_limit,
            layer_memory_limit: most_memory(),
            force_limit: None,
            pruned: options.prune,
        };
        plan.mechanics(case);
        plan.electrostatics(case, options);
        plan.repeated_steps();
        plan.files(case, options);
        plan
    }

    /// The steps that are solved, not taken over from another one.
    pub fn distinct_steps(&self) -> impl Iterator<Item = &PlannedStep> {
        self.steps.iter().filter(|step| step.same_as.is_none())
    }

    /// The settings of every field solve of the case; `field` if the potential is to be kept.
    pub fn solver_settings(&self, case: &Case, options: &Options) -> Settings {
        let asked = case.electrostatics;
        Settings {
            relative_tolerance: asked.map_or(1e-3, |e| e.relative_tolerance),
            bounds: asked.is_none_or(|e| e.bounds),
            // A sensor is read as one capacitance; a scene of conductors is asked for its matrix.
            target: if case.electrodes.is_some() { Target::TwoTerminal } else { Target::Matrix },
            symmetry: options.prune,
            // Without pruning the fields are computed even if nobody wants the files.
            field: options.fields || !options.prune,
            memory_limit: self.memory_limit,
            // Only cases for tetrahedra have one.
            resolution: asked
                .and_then(|e| e.order)
                .map(|order| ResolutionLevel { order: order.into(), levels: 0 }),
            ..Settings::default()
        }
    }

    fn electrostatics(&mut self, case: &Case, options: &Options) {
        if !case.has_conductors() {
            let why = "there are no electrodes and no conductors";
            self.left_out.push(LeftOut::new(Decision::Case, "electrostatics", why, "all field solves"));
            return;
        }
        self.memory_limit = most_memory();
        let distinct = self.distinct_steps().filter(|s| s.failure.is_none()).count();
        let settings = self.solver_settings(case, options);
        if self.on_tetrahedra(case) {
            if let Some(deformed) = self.scene_at_first(case, options) {
                self.tetrahedra(case, &deformed.scene, options);
            }
            return;
        }
        let scene = self.scene_at_first(case, options);
        let foretold = scene.as_ref().and_then(|s| forecast(&s.scene, &settings).ok());
        let mut where_solved = "the whole scene";
        if let Some(own) = &foretold {
            self.unknowns = own.unknowns;
            self.mirrored = own.mirrored;
            self.seconds = own.seconds * distinct as f64;
            where_solved =
                ["the whole scene", "half of the scene", "a quarter of the scene", "an eighth of the scene"]
                    [own.mirrored.iter().filter(|m| **m).count()];
            self.mirror_images(own, distinct);
        }
        let memory = foretold.as_ref().map_or(0, |f| f.memory_bytes);
        let room = self.memory_limit.checked_div(memory).map_or(MOST_AT_ONCE, |n| n.min(64) as usize);
        let most = distinct.clamp(1, MOST_AT_ONCE);
        if room >= most {
            // Not by the number of threads: what a solve may take must not depend on it.
            self.memory_limit /= most as u64;
        }
        self.at_once = if room >= most { most.min(rayon::current_num_threads()) } else { 1 };
        self.memory_bytes = memory.saturating_mul(self.at_once as u64);
        let problems = if settings.bounds {
            "primal and dual problem, which prove an upper and a lower bound,"
        } else {
            "primal problem, with an error estimate,"
        };
        let what = format!(
            "{problems} on {where_solved} at {} to a relative {} of {:e}",
            counted(distinct, if case.load.is_some() { "load step" } else { "state" }),
            if settings.bounds { "spread" } else { "error" },
            settings.relative_tolerance
        );
        self.solved.push(Planned { part: "electrostatics", what });
        if may_bend(case) {
            // Which wants all threads and all memory for itself.
            self.at_once = 1;
            self.memory_limit = most_memory();
            let what = "where the load bends the electrodes so much that boxes inside and around them do not bound the capacitance as \
                        asked: their outlines, pulled along x3, on tetrahedra, which takes seconds to minutes per step"
                .to_owned();
            self.solved.push(Planned { part: "electrostatics", what });
        }
        let floating = case.bodies.iter().filter(|body| body.is_conductor() && !body.is_driven());
        let floating: Vec<String> = floating.map(|body| format!("`{}`", body.name)).collect();
        if !floating.is_empty() {
            let (number, them) = match floating.as_slice() {
                [_] => ("potential", "it is"),
                _ => ("potentials", "they are"),
            };
            let what = format!(
                "the {number} of {}, from the same fields; {them} not in the matrix",
                listed(&floating)
            );
            self.solved.push(Planned { part: "floating", what });
        }
        if !settings.bounds {
            let why = "`bounds = false` under [electrostatics]";
            self.left_out.push(LeftOut::new(
                Decision::Case,
                "dual problem",
                why,
                "about half of the field solves",
            ));
        }
    }

    /// Whether boxes go to the tetrahedra even where nothing bends them.
    fn on_tetrahedra(&self, case: &Case) -> bool {
        case.electrostatics.and_then(|e| e.solver) == Some(FieldSolver::Tetrahedra) || !case.has_only_boxes()
    }

    /// The scene of the first step that can be solved.
    fn scene_at_first(&self, case: &Case, options: &Options) -> Option<DeformedScene> {
        self.distinct_steps().filter(|s| s.failure.is_none()).find_map(|step| {
            // The finite-element layer is not solved for a forecast: its scene is about as large as the one at rest.
            let state = layer_state(case, step.load, options.prune).ok()?.map(Deformation::ClosedForm);
            scene_of(case, state.as_ref()).ok()
        })
    }

    /// Bodies of any shape: how many tetrahedra they take is known only when they are meshed.
    fn tetrahedra(&mut self, case: &Case, scene: &Scene, options: &Options) {
        let settings = self.solver_settings(case, options);
        if let Some(mesh) = &case.mesh {
            let count = mesh.tets.tets.len();
            let mut what = format!(
                "{count} tetrahedra of `{}`; the bounds are those of the bodies as it has them",
                mesh.file
            );
            if !mesh.unnamed.is_empty() {
                let unnamed: Vec<String> = mesh.unnamed.iter().map(|name| format!("`{name}`")).collect();
                what.push_str(&format!("; {} filled with the surroundings", listed(&unnamed)));
            }
            self.solved.push(Planned { part: "mesh", what });
            let error = curvature_error(&mesh.tets);
            if error > 0.1 * settings.relative_tolerance {
                self.warnings.push(format!(
                    "faces of conductors in `{}` meet at small angles, as those that stand for a curved surface do: that adds a \
                     relative error of about {error:.0e} (an estimate), more where the gap is less than the radius; a finer mesh \
                     has less",
                    mesh.file
                ));
            }
        }
        let what = format!(
            "potentials of order {} on tetrahedra, and fluxes made from them, which prove an upper and a lower bound; refined \
             to a relative spread of {:e}",
            order(&settings),
            settings.relative_tolerance
        );
        self.solved.push(Planned { part: "electrostatics", what });
        let floating = scene.conductors().filter(|c| c.floating_charge.is_some());
        let floating: Vec<String> = floating.map(|c| format!("`{}`", c.body.name)).collect();
        if !floating.is_empty() {
            let what =
                format!("potentials of {}, from the same fields; not in the matrix", listed(&floating));
            self.solved.push(Planned { part: "floating", what });
        }
        if settings.symmetry {
            self.mirrored = mirror::planes(scene).map(|at| at.is_some());
        }
        let planes: Vec<_> = (0..3).filter(|a| self.mirrored[*a]).map(|a| format!("x{}", a + 1)).collect();
        if !planes.is_empty() {
            let what = format!("mirror images along {}", listed(&planes));
            let saving = format!("all but one in {} tetrahedra", 1 << planes.len());
            self.left_out.push(LeftOut::new(
                Decision::Plan,
                what,
                "the scene is its own mirror image",
                saving,
            ));
        }
    }

    fn mirror_images(&mut self, own: &Forecast, solves: usize) {
        let planes: Vec<_> = (0..3).filter(|a| own.mirrored[*a]).map(|a| format!("x{}", a + 1)).collect();
        if planes.is_empty() {
            return;
        }
        let what = format!("mirror images along {}", listed(&planes));
        let (unknowns, seconds) = own.unmirrored;
        let seconds = (seconds - own.seconds).max(0.0) * solves as f64;
        let saving = format!("{} instead of {unknowns} unknowns, about {seconds:.2} s", own.unknowns);
        let mut left = LeftOut::new(Decision::Plan, what, "the scene is its own mirror image", saving);
        left.saved_unknowns = Some(unknowns.saturating_sub(own.unknowns));
        left.saved_seconds = Some(seconds);
        self.left_out.push(left);
    }

    fn repeated_steps(&mut self) {
        let repeated: Vec<_> = self.steps.iter().filter(|s| s.same_as.is_some()).map(|s| s.index).collect();
        if repeated.is_empty() {
            return;
        }
        let distinct = self.steps.len() - repeated.len();
        let seconds = self.seconds / distinct.max(1) as f64 * repeated.len() as f64;
        let list: Vec<_> = repeated.iter().take(8).map(ToString::to_string).collect();
        let more = if repeated.len() > 8 { ", ..." } else { "" };
        let mut left = LeftOut::new(
            Decision::Plan,
            format!("step{} {}{more}", if repeated.len() == 1 { "" } else { "s" }, list.join(", ")),
            "an earlier step has the same load: its result is taken over",
            format!("{} of {}, about {seconds:.2} s", counted(repeated.len(), "step"), self.steps.len()),
        );
        left.saved_seconds = Some(seconds);
        self.left_out.push(left);
    }

    fn files(&mut self, case: &Case, options: &Options) {
        let table = match self.kind {
            Kind::Curve => "curve.csv, curve.svg",
            Kind::Capacitance => "capacitance.csv",
            Kind::Mechanics => "curve.csv, curve.svg",
        };
        let mut files = format!("{table}, result.json");
        if options.scene {
            files.push_str(", scene.glb");
        } else {
            self.left_out.push(LeftOut::new(Decision::Caller, "scene.glb", "not asked for", "milliseconds"));
        }
        if case.mechanics.is_some_and(|m| m.is_finite_element()) && case.load.is_some() {
            files.push_str(", mechanics.csv, layer_NNN.vtu and profile_NNN.csv for each step, layer.pvd");
        }
        if self.kind == Kind::Mechanics {
            // There is no field.
        } else if options.fields {
            files.push_str(", step_NNN.vtu for each step, fields.pvd");
        } else {
            let saving = "evaluating and compressing the field of each step";
            self.left_out.push(LeftOut::new(Decision::Caller, "fields (.vtu)", "not asked for", saving));
        }
        self.solved.push(Planned { part: "files", what: files });
    }
}

/// "a", "a and b", "a, b and c".
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [only] => only.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

/// "1 step", "6 steps".
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn planned_steps(case: &Case, options: &Options) -> Vec<PlannedStep> {
    let loads: Vec<StepLoad> = match &case.load {
        None => vec![StepLoad::None],
        Some(Load::Compression(steps)) => steps.iter().map(|c| StepLoad::Compression(*c)).collect(),
        Some(Load::Force(steps)) => steps.iter().map(|f| StepLoad::ForceN(*f)).collect(),
    };
    let mut first_with = std::collections::HashMap::new();
    let mut steps: Vec<PlannedStep> = Vec::with_capacity(loads.len());
    for (index, load) in loads.into_iter().enumerate() {
        let key = match load {
            StepLoad::None => 0,
            StepLoad::Compression(x) | StepLoad::ForceN(x) => (x + 0.0).to_bits(),
        };
        let first = *first_with.entry(key).or_insert(index);
        let same_as = (options.prune && first != index).then_some(first);
        let failure = match same_as {
            Some(first) => steps[first].failure.clone(),
            None => known_failure(case, load, options.prune),
        };
        steps.push(PlannedStep { index, load, same_as, failure });
    }
    steps
}

fn known_failure(case: &Case, load: StepLoad, prune: bool) -> Option<String> {
    let state = match layer_state(case, load, prune) {
        Ok(state) => state.map(Deformation::ClosedForm),
        Err(error) => return Some(error.to_string()),
    };
    let scene = case.has_conductors().then(|| scene_of(case, state.as_ref()));
    scene.and_then(Result::err).map(|error| error.to_string())
}

/// Memory that may be taken, bytes: what can be had, less a fifth.
fn most_memory() -> u64 {
    let available = available_memory();
    available - available / 5
}

/// Memory that can be had without swapping, bytes; 4 GiB where the system does not say.
fn available_memory() -> u64 {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
    });
    let number = |path: &str| read(path).and_then(|text| text.trim().parse::<u64>().ok());
    // A container's own limit, where there is one.
    let quota = number("/sys/fs/cgroup/memory.max")
        .map(|most| most.saturating_sub(number("/sys/fs/cgroup/memory.current").unwrap_or(0)));
    let known = [free, quota].into_iter().flatten().min();
    known.unwrap_or(4 << 30).max(64 << 20)
}

//! The part of a plan about the field solves: the solver of each step, the part of the scene that is solved,
//! and the memory.

use elastocap_case::{Body, Case, FieldSolver, ImportedMesh, Measurement};
use elastocap_electrostatics::{SolveError, extrusion_axis};
use elastocap_geometry::mirror;
use elastocap_geometry::scene::{Purpose, Scene};
use elastocap_geometry::turn::to_mirror_planes;

use super::{Decision, LeftOut, Options, Plan, Planned, PlannedStep};
use crate::faceting_error::curvature_error;
use crate::failure::StepFailure;
use crate::memory::max_memory;
use crate::route::Route;
use crate::settings::{FieldSettings, NO_CHANGE};
use crate::step_messages::lines;
use crate::words::{counted, grouped, listed};

/// The part of a plan that says which capacitance is measured.
pub const MEASURED: &str = "measured";

/// Largest number of field problems that are solved at the same time, on any machine. It is not tuned.
const MAX_AT_ONCE: usize = 8;

/// Memory of the process outside its solves, bytes: the program, stacks of threads, and files while they are
/// written. Measured: `benches/forecast.py`.
pub(super) const PROGRAM: u64 = 20 << 20;

/// Share of the tolerance that the facets of an imported mesh may take without a warning.
const FACETS: f64 = 0.1;

impl Plan {
    pub(super) fn electrostatics(&mut self, case: &Case, options: &Options) {
        if !case.has_conductors() {
            let why = "there are no electrodes and no conductors";
            let saving = "Saves all field solves.";
            self.left_out.push(LeftOut::new(Decision::Case, "electrostatics", why, saving));
            return;
        }
        self.memory_limit = max_memory();
        let settings = self.solver_settings(case, options);
        if !case.recognised.is_empty() {
            let names: Vec<String> = case.recognised.iter().map(|name| format!("`{name}`")).collect();
            let (one, several) = match case.has_only_boxes() {
                true => ("consists of boxes", "consist of boxes"),
                false => ("is an outline pulled along an axis", "are outlines pulled along an axis"),
            };
            let what = format!(
                "{}; `solver = \"tetrahedra\"` takes them as they are given",
                match names.as_slice() {
                    [name] => format!("{name} {one}"),
                    _ => format!("{} {several}", shortened(&names)),
                }
            );
            self.solved.push(Planned { part: "bodies", what });
        }
        self.terminals(case);
        self.in_the_layer(case);
        let by_boxes = self.count(is_by_boxes);
        if by_boxes > 0 {
            self.by_boxes(case, options, &settings, by_boxes);
        }
        self.around_bent_electrodes(case);
        let by_outlines = |route| route == Route::EXTRUDED;
        if let Some((_, scene)) = self.first_scene(case, options, by_outlines) {
            self.by_outlines(&scene, &settings);
        }
        let on_tetrahedra = |route| route == Route::TETRAHEDRA;
        if let Some((_, scene)) = self.first_scene(case, options, on_tetrahedra) {
            self.on_tetrahedra(case.mesh.as_ref(), &scene, &settings);
        }
        if self.solvable_steps().next().is_some() {
            self.change(case);
            self.floating_conductors(case);
            self.warn_of_what_stays_behind(case);
            self.warn_of_doubts();
        }
    }

    /// Warns of steps that may turn out to have no solution.
    fn warn_of_doubts(&mut self) {
        let doubt = |step: &PlannedStep| Some((step.index, step.doubt.as_ref()?.to_string()));
        let doubts = self.solvable_steps().filter_map(doubt);
        let lines = lines(
            doubts.map(|(step, why)| (step, format!("may fail, as the deformed layer will show: {why}"))),
        );
        self.warnings.extend(lines);
    }

    /// Notes which bodies move with the material of the layer, and that they do not stiffen it.
    fn in_the_layer(&mut self, case: &Case) {
        let bodies = case.bodies.iter().filter(|body| body.purpose == Purpose::InLayer);
        let names: Vec<String> = bodies.map(|body| format!("`{}`", body.name)).collect();
        if names.is_empty() || case.load.is_none() {
            return;
        }
        let (moves, it, is) = if names.len() == 1 { ("moves", "it", "is") } else { ("move", "they", "are") };
        let what = format!(
            "{} {moves} with the layer's material, which deforms as if {it} were not there: {it} {is} taken to be as soft as the layer",
            shortened(&names)
        );
        self.solved.push(Planned { part: "bodies", what });
    }

    /// Warns of fixed conductors that the sinking top of the layer leaves behind: in most such files they
    /// were meant to move with it.
    fn warn_of_what_stays_behind(&mut self, case: &Case) {
        let (Some(layer), true) = (&case.layer, self.steps.iter().any(|step| !step.load.is_zero())) else {
            return;
        };
        let near = |body: &&Body| {
            let above = body.bounds().map(|region| region.min[1] - layer.thickness);
            body.purpose == Purpose::Fixed
                && above.is_some_and(|above| (0.0..layer.thickness).contains(&above))
        };
        let names: Vec<String> = case
            .bodies
            .iter()
            .filter(|b| b.is_conductor())
            .filter(near)
            .map(|b| format!("`{}`", b.name))
            .collect();
        if !names.is_empty() {
            let (stay, them, it) = match names.len() {
                1 => ("stays where it is", "it", "it is"),
                _ => ("stay where they are", "them", "they are"),
            };
            self.warnings.push(format!(
                "{} {stay} while the layer's top sinks away from under {them}; if {it} to move with the top or with the indenter, add \
                 `attached = \"layer-top\"` or `attached = \"indenter\"`",
                shortened(&names)
            ));
        }
    }

    /// Describes the repeated solves for the change from the first step, where the case sets a tolerance for
    /// it.
    fn change(&mut self, case: &Case) {
        let Some(tolerance) = case.electrostatics.and_then(|settings| settings.change_tolerance) else {
            return;
        };
        let what = format!(
            "C less that of the first load step to a relative spread of {tolerance:e}, or as none to {NO_CHANGE:e} of C: steps whose bounds \
             do not give it are solved again, as sharply as the changes found take; memory and time of that are not in the estimates"
        );
        self.solved.push(Planned { part: "change", what });
        if self.count(is_on_tetrahedra) > 0 {
            self.warnings.push(
                "`change_tolerance`: on tetrahedra, bounds that are some 1e-5 of C apart are mostly out of reach, and a change that is \
                 small takes such bounds"
                    .to_owned(),
            );
        }
    }

    /// Plans the `solves` steps that the box solver takes, at least at first.
    fn by_boxes(&mut self, case: &Case, options: &Options, settings: &FieldSettings, solves: usize) {
        let expected = self.forecast_boxes(case, options, settings);
        let mut memory = 0;
        let mut part = "the whole scene";
        match &expected {
            Ok(Some(forecast)) => {
                self.unknowns = forecast.unknowns;
                self.is_rough = forecast.is_rough;
                self.mirrored = forecast.mirrored;
                self.seconds = forecast.seconds * solves as f64;
                memory = forecast.memory_bytes;
                part = [
                    "the whole scene",
                    "half of the scene",
                    "a quarter of the scene",
                    "an eighth of the scene",
                ][forecast.mirrored.iter().filter(|m| **m).count()];
                self.mirror_images(forecast, solves);
            }
            Ok(None) => {}
            // The first grid of a step is about the same at every load.
            Err(error @ SolveError::TooLarge { .. }) => {
                return self.fail(is_by_boxes, &StepFailure::Field(error.clone()));
            }
            Err(error) => {
                self.warnings.push(format!("unknowns, memory and time of the fields are not known: {error}"));
            }
        }
        self.share_memory(memory);
        let problems = if settings.bounds {
            "primal and dual problem, which prove an upper and a lower bound,"
        } else {
            "primal problem, with an error estimate,"
        };
        let what = format!(
            "{problems} on {part} at {} to a relative {} of {:e}",
            counted(solves, if case.load.is_some() { "load step" } else { "state" }),
            if settings.bounds { "spread" } else { "error" },
            settings.relative_tolerance
        );
        self.solved.push(Planned { part: "electrostatics", what });
        if !settings.bounds {
            let why = "`bounds = false` under [electrostatics]";
            let saving = "Saves about half of the field solves.";
            self.left_out.push(LeftOut::new(Decision::Case, "dual problem", why, saving));
        }
    }

    /// Divides the memory among solves at the same time; `each` is the forecast of one of them, bytes.
    fn share_memory(&mut self, each: u64) {
        self.at_once = 1;
        if self.count(|route| !is_by_boxes(route)) == 0 {
            let room = self.memory_limit.checked_div(each).map_or(MAX_AT_ONCE, |n| n.min(64) as usize);
            let wanted = self.solvable_steps().count().clamp(1, MAX_AT_ONCE);
            if room >= wanted {
                // Divided by the number of solves, not of threads: the memory of a solve must not depend on
                // the machine.
                self.memory_shares = wanted as u64;
                self.at_once = wanted.min(rayon::current_num_threads());
            }
        }
        self.memory_bytes = each.saturating_mul(self.at_once as u64).saturating_add(PROGRAM);
    }

    /// Describes the solvers for electrodes that the load bends.
    fn around_bent_electrodes(&mut self, case: &Case) {
        for route in [Route::MAPPED_BOXES, Route::OUTLINES, Route::OUTLINES_ON_TETRAHEDRA] {
            let steps = self.count(|planned| planned == route);
            if steps == 0 {
                continue;
            }
            let steps = counted(steps, if case.load.is_some() { "load step" } else { "state" });
            let how = match route.solver() {
                FieldSolver::Boxes => {
                    "electrodes and layer in three dimensions: boxes under a map that bends them in the same way"
                }
                FieldSolver::Extruded => {
                    "the electrodes: their outlines, pulled along x3, which the extruded solver takes"
                }
                FieldSolver::Tetrahedra => {
                    "the electrodes: their outlines, pulled along x3, on tetrahedra, which takes seconds to minutes per step"
                }
            };
            let what = format!("at {steps}, where the load bends {how}");
            self.solved.push(Planned { part: "electrostatics", what });
        }
    }

    /// Describes the solver for outlines that are extruded along one axis.
    fn by_outlines(&mut self, scene: &Scene, settings: &FieldSettings) {
        let extruded = extrusion_axis(scene);
        let axis = extruded.map_or_else(|| "an axis".to_owned(), |axis| format!("x{}", axis + 1));
        let what = format!(
            "outlines pulled along {axis}: potentials and fluxes of high degree on triangles times that axis, which prove an upper and a \
             lower bound, to a relative spread of {:e}",
            settings.relative_tolerance
        );
        self.solved.push(Planned { part: "electrostatics", what });
        if settings.symmetry {
            let turned = extruded.and_then(|axis| to_mirror_planes(scene, axis));
            let (turn, scene) = turned.as_ref().map_or((None, scene), |(turn, scene)| (Some(turn), scene));
            self.mirrored = mirror::planes(scene).each_ref().map(Option::is_some);
            let turn =
                turn.map(|turn| format!(" after a turn by {:.4} degrees about {axis}", turn.degrees()));
            self.mirrored_mesh(turn.as_deref().unwrap_or(""));
        }
    }

    /// Describes the solver for bodies of any shape. The number of tetrahedra is known only after meshing.
    fn on_tetrahedra(&mut self, mesh: Option<&ImportedMesh>, scene: &Scene, settings: &FieldSettings) {
        if let Some(mesh) = mesh {
            let mut what = format!(
                "{} tetrahedra of `{}`; the bounds are those of the bodies as it has them",
                grouped(mesh.tets.tets.len()),
                mesh.file
            );
            if !mesh.unnamed.is_empty() {
                let unnamed: Vec<String> = mesh.unnamed.iter().map(|name| format!("`{name}`")).collect();
                what.push_str(&format!("; {} filled with the surroundings", listed(&unnamed)));
            }
            self.solved.push(Planned { part: "mesh", what });
            let error = curvature_error(&mesh.tets, |_| true);
            if error > FACETS * settings.relative_tolerance {
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
            settings.tetrahedra_order, settings.relative_tolerance
        );
        self.solved.push(Planned { part: "electrostatics", what });
        if settings.symmetry {
            self.mirrored = mirror::planes(scene).each_ref().map(Option::is_some);
            self.mirrored_mesh("");
        }
    }

    /// Describes the terminals, and the capacitance that is measured.
    fn terminals(&mut self, case: &Case) {
        for terminal in &case.terminals {
            let members: Vec<String> = terminal.conductors.iter().map(|name| format!("`{name}`")).collect();
            let ground = if terminal.is_grounded { ", at potential zero" } else { "" };
            let what = format!("`{}`: {} on one wire{ground}", terminal.name, shortened(&members));
            self.solved.push(Planned { part: "terminal", what });
        }
        let names = case.driven_terminals();
        let quoted = |k: usize| names.get(k).map_or_else(String::new, |name| format!("`{name}`"));
        let what = match case.measurement() {
            Measurement::TwoTerminal([i, j]) => format!(
                "the two-terminal capacitance of {} and {}{}",
                quoted(i),
                quoted(j),
                if names.len() > 2 { ", all others at potential zero" } else { "" }
            ),
            Measurement::Mutual([i, j]) => format!(
                "the mutual capacitance of {} and {}, everything else at potential zero",
                quoted(i),
                quoted(j)
            ),
            Measurement::Own(i) => format!("the capacitance of {} against ground", quoted(i)),
            Measurement::Guarded([i, j]) => format!(
                "the capacitance of {} against ground, with its guard {} at the same potential and everything else at zero",
                quoted(i),
                quoted(j)
            ),
            Measurement::Matrix { .. } if !case.measured_entries().is_empty() => {
                let entry = |[i, j]: [usize; 2]| match i == j {
                    true => format!("the capacitance of {} against ground", quoted(i)),
                    false => format!("the mutual capacitance of {} and {}", quoted(i), quoted(j)),
                };
                let entries: Vec<String> = case.measured_entries().into_iter().map(entry).collect();
                let curve = if case.load.is_some() { "; the curve shows the first" } else { "" };
                format!("{}, everything else at potential zero{curve}", shortened(&entries))
            }
            Measurement::Matrix { terminals: count, shown: [i, j] } => {
                let terminals: Vec<String> = (0..count).map(quoted).collect();
                let curve = match (case.load.is_some(), i == j) {
                    (false, _) => String::new(),
                    (true, true) => {
                        format!("; the curve shows the capacitance of {} against ground", quoted(i))
                    }
                    (true, false) => {
                        format!("; the curve shows the mutual capacitance of {} and {}", quoted(i), quoted(j))
                    }
                };
                format!("the whole matrix of {}{curve}", shortened(&terminals))
            }
        };
        let is_chosen = case.measured.is_none() && names.len() > 1 && !case.electrodes_are_measured();
        let hint = if is_chosen { "; [measure] may name another capacitance" } else { "" };
        self.solved.push(Planned { part: MEASURED, what: format!("{what}{hint}") });
    }

    fn floating_conductors(&mut self, case: &Case) {
        let floating: Vec<String> =
            case.bodies.iter().filter(|body| body.floats()).map(|body| format!("`{}`", body.name)).collect();
        let (number, them) = match floating.as_slice() {
            [] => return,
            [_] => ("potential", "it is"),
            _ => ("potentials", "they are"),
        };
        let names = listed(&floating);
        let what = format!("the {number} of {names}, from the same fields; {them} not in the matrix");
        self.solved.push(Planned { part: "floating", what });
    }
}

/// A list of names, the first five at most.
fn shortened(names: &[String]) -> String {
    let (shown, more) = names.split_at(names.len().min(5));
    if more.is_empty() { listed(shown) } else { format!("{} and {} more", shown.join(", "), more.len()) }
}

/// Whether a step on this route is solved on tetrahedra, by what is known before it is solved.
pub(super) fn is_on_tetrahedra(route: Route) -> bool {
    route.solver() == FieldSolver::Tetrahedra
}

/// Whether the box solver takes a step on this route.
pub(super) fn is_by_boxes(route: Route) -> bool {
    route.solver() == FieldSolver::Boxes
}

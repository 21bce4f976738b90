//! The search for a mesh of an extruded scene that meets the tolerance.
//!
//! Meshes differ in their degrees, layers and strips, in the plan and along the axis (`family.rs`). A few
//! small ones are solved for the upper bound alone. From the falls of that bound, and from the energy in the
//! last functions along the axis, follows the mesh that should meet the tolerance, which is solved for both
//! bounds.

use super::confined::{changed, distance_of_ends, open_sides, with_open_sides, without_common_potential};
use super::family::{Expectation, Gained, HIGHEST, Level};
use super::layout::{Layout, Plan, PlanError};
use super::mesh::PlanMesh;
use super::one_mesh::{Energies, Problem};
use super::shown::{prisms, tetrahedra};
use super::size::Size;
use crate::boxes::domain::{Axis, Rays};
use crate::boxes::one_grid::error_of;
use crate::boxes::resolution::iteration_share;
use crate::consistency::{contradiction, is_usable};
use crate::error::SolveError;
use crate::far::without_far_faces;
use crate::floating::Floating;
use crate::matrix::{MatrixBounds, contrast_of, of_products, rounding_scale};
use crate::parity::Parity;
use crate::shortfall::Shortfall;
use crate::solution::{Discretisation, PhaseSeconds, ResolutionLevel, Settings, Solution};
use crate::target::{SHARE_OF_DIAGONAL, Target};
use crate::vacuum::VACUUM_PERMITTIVITY;
use elastocap_geometry::meshing::grid::{End, Plane, Resolution, graded_axis};
use elastocap_geometry::meshing::plane::graded::Layers;
use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_geometry::mirror;
use elastocap_geometry::scene::{MirrorPlane, Potential, Scene, Wall, across};
use elastocap_geometry::turn::Turn;
use faer::Mat;
use std::time::Instant;

/// Size of a layer over the next larger one, in the plan and along the axis. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const RATIO: f64 = 0.15;

/// The relative error that integrals over bent triangles may have, for each conductor: see the tests of
/// `elastocap_fem::triangle`.
const INTEGRALS: f64 = 1e-10;

/// The result of [`solve_extruded`](super::solve::solve_extruded).
#[derive(Debug, Clone)]
pub struct ExtrudedSolution {
    /// The capacitances.
    pub solution: Solution,
    /// The turn that was applied to the scene, if any: planes and field are those of the turned scene.
    pub turn: Option<Turn>,
    /// For each axis the mirror plane of the scene, if only one half was solved.
    pub planes: [Option<MirrorPlane>; 3],
    /// If [`Settings::field`] asks for it, the mesh of the part that was solved as tetrahedra, and for each
    /// conductor of the whole scene the potential with 1 V on it and 0 V on all others: V, at the points of
    /// the mesh. Where the mesh of the bounds has too many elements to be shown, it is a coarser one.
    pub field: Option<(TetMesh, Vec<Vec<f64>>)>,
}

/// Largest number of prisms in a mesh for a viewer. Not tuned: it trades the size of a file for detail.
const MAX_SHOWN: usize = 60_000;

/// The distance at which rays to infinity begin for a tolerance, over the distance beyond which nothing
/// begins or ends. The spread due to the rays was measured on a pad and a disc on a board of relative
/// permittivity 4.5, and on plates in a uniform medium.
fn beginning_of_rays(tolerance: f64, contrast: f64, neutral: bool) -> f64 {
    let allowed = 0.25 * tolerance;
    let far = if neutral {
        (0.15 * contrast.powf(0.7) / allowed).powf(1.0 / 3.0)
    } else {
        // Rays count as oblique as they are at the least favourable point of a triangle; that costs a share
        // of the exterior energy.
        let oblique = 0.1 / allowed;
        let of_charge = (0.35 * (contrast - 1.0).min(10.0) / allowed).powf(1.0 / 1.9);
        of_charge.max(oblique)
    };
    far.clamp(1.5, 4e3)
}

/// Ratio of an error to the expected one above which the expectation counts as wrong. Tuned:
/// `benches/outlines.py`.
const SURPRISE: f64 = 2.0;

/// Ratio of an unexpected error to the tolerance above which edges of dielectrics may be its cause. Tuned:
/// `benches/outlines.py`.
const FAR: f64 = 3.0;

/// Largest ratio of the unknowns of the next mesh to those of one that cannot be solved.
const SHRINKAGE: f64 = 0.7;

/// How often open sides may be moved outward because finer meshes do not help.
const MAX_WIDENINGS: usize = 2;

/// The factor by which open sides are moved outward.
const WIDENING: f64 = 4.0;

/// The results of one mesh.
struct MeshResult {
    /// Bounds between all conductors.
    unreduced: MatrixBounds,
    /// Bounds between the driven conductors: see [`Floating::reduced`].
    bounds: MatrixBounds,
    /// Largest number of unknowns of both problems of a parity.
    unknowns: usize,
    /// Largest number of iterations that a right-hand side took.
    iterations: usize,
    /// Whether the linear solver reached its goals.
    converged: bool,
    /// Largest share of an energy by which the repair lowers it.
    repair_share: f64,
    /// The largest shares of an energy that the last functions of the axis carry, at edges and elsewhere: see
    /// [`Axis::last_functions`]. From upper bounds alone.
    last_along_axis: [f64; 2],
    /// See [`ExtrudedSolution::field`]; `None` also where the mesh has too many elements to be shown.
    field: Option<(TetMesh, Vec<Vec<f64>>)>,
}

/// The state of a search.
pub(super) struct Search<'a> {
    settings: &'a Settings,
    /// The layout of the part of the scene above the mirror planes.
    layout: Layout,
    plan: Plan,
    /// Where the axis is graded: at edges of conductors, and at those of dielectrics once these are known to
    /// matter.
    axis_planes: Vec<Plane>,
    /// Whether plan and axis are graded at edges of dielectrics too.
    at_dielectrics: bool,
    /// Distance from the origin at which open sides end, and rays begin if the scene is not confined; `None`
    /// in a closed scene.
    radius: Option<f64>,
    /// Whether the scene is confined, none of its conductors is grounded, and nothing but they can hold
    /// charge.
    neutral: bool,
    /// How the scene was turned before, if it was.
    turn: Option<Turn>,
    /// For each axis the mirror plane of the scene, if only one half is solved.
    pub(super) planes: [Option<MirrorPlane>; 3],
    /// The parities with a field.
    pub(super) parities: Vec<Parity>,
    floating: Floating,
    /// The largest over the smallest permittivity.
    contrast: f64,
    /// The largest relative change of any capacitance where faces that are far away were left out.
    left_out: f64,
    pub(super) seconds: PhaseSeconds,
    /// The number of meshes solved on so far.
    meshes: usize,
    /// The part of the scene above the mirror planes.
    part: Scene,
    /// The parity without a field, if there is one.
    constant: Vec<Parity>,
    /// The field on the finest mesh so far that can be shown.
    coarse_field: Option<(TetMesh, Vec<Vec<f64>>)>,
}

impl<'a> Search<'a> {
    /// Prepares the search for a scene that is extruded along `axis`; `turn` is how the scene was turned
    /// before, if it was.
    pub(super) fn new(
        scene: &Scene,
        axis: usize,
        turn: Option<Turn>,
        settings: &'a Settings,
    ) -> Result<Self, SolveError> {
        let nearer = without_far_faces(scene, settings.relative_tolerance);
        let (scene, left_out) = nearer.as_ref().map_or((scene, 0.0), |(nearer, share)| (nearer, *share));
        let planes = if settings.symmetry { mirror::planes(scene) } else { Default::default() };
        let part = mirror::part(scene, &planes);
        let layout = Layout::new(&part, axis).ok_or(SolveError::NotExtruded)?;
        let floating = Floating::new(scene);
        let grounded: Vec<bool> =
            scene.conductors().map(|conductor| conductor.potential == Potential::Grounded).collect();
        let mut permittivities = vec![scene.background_permittivity];
        permittivities.extend(scene.dielectrics().map(|d| d.relative_permittivity));
        let contrast = contrast_of(&permittivities);
        let radius = layout.is_open().then(|| {
            if layout.is_confined() {
                return distance_of_ends(&layout, scene.walls, settings.relative_tolerance);
            }
            let neutral = floating.is_neutral(settings.target);
            layout.reach.max(1.0) * beginning_of_rays(settings.relative_tolerance, contrast, neutral)
        });
        let name =
            |c: u32| scene.conductors().nth(c as usize).map_or_else(String::new, |c| c.body.name.clone());
        let plan = layout.plan(radius.unwrap_or(f64::INFINITY), false).map_err(|error| match error {
            PlanError::NoMesh => SolveError::NoPlan,
            PlanError::OnGround(c) => SolveError::OnGround { conductor: name(c) },
            PlanError::Touching([a, b]) => SolveError::Touching { first: name(a), second: name(b) },
        })?;
        let conductors = scene.conductors().count();
        let mut present = vec![false; conductors];
        let held = plan.columns.iter().map(|c| &c.held).chain(plan.chains.iter().map(|c| &c.held));
        held.flatten().flatten().for_each(|c| present[*c as usize] = true);
        // Mirror planes are insulated in the part.
        let holds_no_charge = |w: &Wall| *w == Wall::Insulated || (*w == Wall::Open && layout.is_confined());
        let enclosed = part.walls.iter().flatten().all(holds_no_charge);
        let parities = Parity::all(&planes, &present, &grounded, enclosed);
        let (constant, parities) = parities.into_iter().partition(Parity::is_constant);
        Ok(Self {
            settings,
            neutral: enclosed && layout.is_confined() && !floating.any_grounded(),
            axis_planes: layout.planes.clone(),
            at_dielectrics: false,
            layout,
            plan,
            radius,
            turn,
            planes,
            parities,
            constant,
            part,
            coarse_field: None,
            floating,
            contrast,
            left_out,
            seconds: PhaseSeconds::default(),
            meshes: 0,
        })
    }

    /// Distance at which rays begin, if there are any.
    fn rays(&self) -> Option<f64> {
        self.radius.filter(|_| !self.layout.is_confined())
    }

    /// Moves open sides outward. Returns whether that was possible: whether there are open sides, and a plan
    /// for the wider frame.
    fn widen(&mut self) -> bool {
        let Some(radius) = self.radius.map(|radius| WIDENING * radius) else { return false };
        let Ok(plan) = self.layout.plan(radius, self.at_dielectrics) else { return false };
        (self.plan, self.radius) = (plan, Some(radius));
        true
    }

    /// Grades plan and axis toward the edges of dielectrics too. Returns whether that changes them.
    fn grade_at_dielectrics(&mut self) -> bool {
        if self.at_dielectrics {
            return false;
        }
        self.at_dielectrics = true;
        if self.plan.dielectric_edges().next().is_none() {
            return false;
        }
        let Ok(plan) = self.layout.plan(self.radius.unwrap_or(f64::INFINITY), true) else { return false };
        self.axis_planes = self.layout.planes_at_dielectrics(&plan);
        self.plan = plan;
        true
    }

    /// The mesh that is solved for both bounds first, with its unknowns.
    pub(super) fn first(&self, expected: &Expectation) -> (Level, f64) {
        self.cheapest(expected, None, f64::INFINITY).unwrap_or((Level::EXPLORED[0], 0.0))
    }

    /// The mesh to be solved after one with the error `spread`, with fewer than `max_unknowns`.
    fn finer(
        &self,
        expected: &mut Expectation,
        solved: Level,
        spread: f64,
        max_unknowns: f64,
    ) -> Option<(Level, f64)> {
        // The cause of an error far above the expected one is unknown, and everything is made finer.
        let higher = usize::from(spread > SURPRISE * expected.error(solved));
        if spread.is_finite() {
            expected.learn(solved, spread);
        }
        let least = Level {
            degree: (solved.degree + higher).min(HIGHEST),
            axis_degree: (solved.axis_degree + higher).min(HIGHEST),
            layers: solved.layers + higher,
            axis_layers: solved.axis_layers + higher,
            ..solved
        };
        self.cheapest(expected, Some(least), max_unknowns)
    }

    /// The result of [`Expectation::cheapest`] for the tolerance and the axis of this scene.
    fn cheapest(
        &self,
        expected: &Expectation,
        least: Option<Level>,
        max_unknowns: f64,
    ) -> Option<(Level, f64)> {
        let functions = |axis_degree, axis_layers| {
            self.axis(Level { axis_degree, axis_layers, ..Level::EXPLORED[0] }).functions().len()
        };
        // After a first mesh the expectation was wrong once, and needs a margin.
        let share = if least.is_some() { 0.8 } else { 1.0 };
        expected.cheapest(share * self.settings.relative_tolerance, least, max_unknowns, functions)
    }

    /// The elements of the axis on a mesh.
    pub(super) fn axis(&self, level: Level) -> Axis {
        let radius = self.radius.unwrap_or(1.0);
        let ends = self.layout.axis_walls.map(|wall| match wall {
            Wall::Open => End::Open { pole: 0.0, reach: (1.5 * self.layout.reach).min(radius), radius },
            Wall::Insulated | Wall::Grounded => End::Closed,
        });
        let (order, levels) = (level.axis_degree, level.axis_layers);
        let resolution = Resolution { order, levels, ratio: RATIO, slope: 1.0, first: 2.min(order) };
        let graded = graded_axis(&self.axis_planes, ends, &resolution).finite();
        Axis {
            line: graded.line,
            cuts: graded.cuts,
            walls: self.layout.axis_walls,
            rays: self.rays().map(|radius| Rays { pole: 0.0, radius }),
        }
    }

    /// The triangles of the plan on a mesh.
    pub(super) fn mesh(&self, level: Level) -> PlanMesh {
        let layers = Layers { corners: level.layers, edges: level.strips, ratio: RATIO };
        PlanMesh::new(&self.plan, layers)
    }

    /// Both bounds on one mesh, or the upper one alone. The linear solver stops when its error is about
    /// `share` of the energy.
    fn on_mesh(&mut self, level: Level, share: f64, lower_too: bool) -> Result<MeshResult, SolveError> {
        let begin = Instant::now();
        self.meshes += 1;
        let mesh = self.mesh(level);
        let axis = self.axis(level);
        let sides = self.parities.iter().map(Parity::sides).max().unwrap_or(1);
        let (bytes, limit) = (Size::of(&mesh, &axis, level.degree).memory(sides), self.settings.memory_limit);
        if bytes > limit {
            return Err(SolveError::TooLarge { bytes, limit });
        }
        self.seconds.setup += begin.elapsed().as_secs_f64();
        let n = self.floating.conductors;
        let mut result = MeshResult {
            unreduced: MatrixBounds { lower: Mat::zeros(n, n), upper: Mat::zeros(n, n) },
            bounds: MatrixBounds { lower: Mat::zeros(0, 0), upper: Mat::zeros(0, 0) },
            unknowns: 0,
            iterations: 0,
            converged: true,
            repair_share: 0.0,
            last_along_axis: [0.0; 2],
            field: None,
        };
        let is_shown = self.settings.field && prisms(&mesh, &axis) <= MAX_SHOWN;
        let shown = is_shown.then(|| tetrahedra(&self.part, &self.layout, &mesh, &axis));
        let mut potentials_shown = vec![vec![0.0; shown.as_ref().map_or(0, |(_, places)| places.len())]; n];

        let copies = f64::from(1_u32 << self.planes.iter().flatten().count());
        let scale = VACUUM_PERMITTIVITY * self.layout.unit * copies;
        for parity in &self.parities {
            let mut axis = axis.clone();
            let mut walls = self.layout.plan_walls;
            let [p, q] = across(self.layout.axis);
            for a in (0..3).filter(|a| parity.grounded[*a].is_some()) {
                match a {
                    a if a == p => walls[0][0] = Wall::Grounded,
                    a if a == q => walls[1][0] = Wall::Grounded,
                    _ => axis.walls[0] = Wall::Grounded,
                }
            }
            let open = open_sides(self.layout.is_confined());
            let axes = open.map(|open| Axis { walls: with_open_sides(axis.walls, open), ..axis.clone() });
            let [upper_problem, lower_problem] = [0, 1].map(|problem| Problem {
                mesh: &mesh,
                axis: &axes[problem],
                walls: walls.map(|pair| with_open_sides(pair, open[problem])),
                degree: level.degree,
                radius: self.rays(),
                cancel: self.settings.cancel.as_deref(),
            });
            let potentials: Vec<Vec<f64>> = (0..parity.sides() as u32)
                .map(|s| parity.side.iter().map(|side| f64::from(u8::from(*side == Some(s)))).collect())
                .collect();
            let (upper, lower) = rayon::join(
                || upper_problem.upper(&potentials, share),
                || lower_too.then(|| lower_problem.lower(&potentials, share)).transpose(),
            );
            let ((upper, primal, solutions), lower) = (upper?, lower?);
            if !lower_too {
                // Elements at edges have the second degree.
                let last = axis.last_functions([2, level.axis_degree]);
                for (side, u) in solutions.iter().enumerate() {
                    let along = primal.energies_along_axis(u);
                    for (largest, functions) in result.last_along_axis.iter_mut().zip(&last) {
                        let energy: f64 = functions.iter().map(|f| along[*f]).sum();
                        *largest = largest.max(energy / upper.matrix[(side, side)]);
                    }
                }
            }
            if let Some((_, places)) = &shown {
                let vertices = axes[0].vertex_functions();
                for (c, sum) in potentials_shown.iter_mut().enumerate() {
                    let unit: Vec<f64> = (0..n).map(|k| f64::from(u8::from(k == c))).collect();
                    for (v, u) in parity.of(&unit).zip(&solutions).filter(|(v, _)| *v != 0.0) {
                        let values = places.iter().map(|place| v * primal.value_at(u, *place, &vertices));
                        sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                    }
                }
            }
            result.unreduced.upper += faer::Scale(scale) * parity.form_of_conductors(&upper.matrix);
            let lower_or_upper = lower.as_ref().unwrap_or(&upper);
            result.unreduced.lower += faer::Scale(scale) * parity.form_of_conductors(&lower_or_upper.matrix);
            self.seconds.setup += upper.seconds[0];
            self.seconds.primal += upper.seconds[1];
            result.note(&upper, lower.as_ref());
            if let Some(lower) = &lower {
                self.seconds.dual += lower.seconds.iter().sum::<f64>();
            }
        }
        if !self.plan.coarse.arcs.is_empty() {
            for i in 0..n {
                result.unreduced.upper[(i, i)] *= 1.0 + INTEGRALS;
                result.unreduced.lower[(i, i)] *= 1.0 - INTEGRALS;
            }
        }
        let mut rounding = rounding_scale(&Mat::identity(n, n), &result.unreduced.upper);
        if self.neutral {
            let change = without_common_potential(&result.unreduced.upper);
            result.unreduced.upper = changed(&result.unreduced.upper, &change);
            rounding = changed(&rounding, &change);
        }
        result.unreduced.count_rounding(&rounding, of_products(self.contrast));
        // Without a lower bound the upper one stands in for it, and a crossing by rounding proves nothing.
        if let Some(what) = result.unreduced.crossing().filter(|_| lower_too) {
            return Err(SolveError::Contradiction(what));
        }
        result.unreduced.widen(&rounding, self.left_out);
        result.unreduced.uncross();
        result.bounds = self.floating.reduced(&result.unreduced);
        result.field = shown.map(|(mesh, _)| {
            for (c, sum) in potentials_shown.iter_mut().enumerate() {
                let unit: Vec<f64> = (0..n).map(|k| f64::from(u8::from(k == c))).collect();
                let constant: f64 = self.constant.iter().flat_map(|parity| parity.of(&unit)).sum();
                sum.iter_mut().for_each(|x| *x += constant);
            }
            (mesh, potentials_shown)
        });
        Ok(result)
    }

    /// The relative change of the target from one upper bound to the next.
    fn fall(&self, before: &MeshResult, now: &MeshResult) -> f64 {
        let relative = |a: f64, b: f64| ((a - b) / b).abs();
        let target = self.settings.target;
        if let Target::TwoTerminal | Target::Pair(_) = target
            && let Some((a, b)) = target.value(&before.bounds.upper).zip(target.value(&now.bounds.upper))
        {
            return relative(a, b);
        }
        let diagonal = |result: &MeshResult, i: usize| result.bounds.upper[(i, i)];
        let rows = target.rows(now.bounds.upper.nrows()).into_iter();
        rows.map(|i| relative(diagonal(before, i), diagonal(now, i))).fold(0.0, f64::max)
            * self.amplification(now)
    }

    /// The largest ratio between the relative error of the target, or of an entry, and that of the energies
    /// it follows from.
    fn amplification(&self, result: &MeshResult) -> f64 {
        let m = &result.bounds.upper;
        let target = self.settings.target;
        let least = match (target, target.value(m)) {
            (Target::TwoTerminal | Target::Pair(_) | Target::Own(_), Some(_)) => return 1.0,
            (Target::Guarded([i, j]), Some(charge)) => {
                let with_guard = m[(i, i)] + 2.0 * m[(i, j)] + m[(j, j)];
                let ratio = (m[(i, i)] * with_guard.max(0.0)).sqrt() / charge;
                return if ratio.is_finite() { ratio.max(1.0) } else { 1.0 };
            }
            (Target::Mutual(_), Some(_)) => 0.0,
            (_, None) | (Target::Matrix, Some(_)) => SHARE_OF_DIAGONAL,
        };
        let rows = target.rows(m.nrows());
        let pairs = rows.iter().flat_map(|i| rows.iter().filter(move |j| *j < i).map(move |j| (*i, *j)));
        let ratio = |(i, j): (usize, usize)| {
            let mean = (m[(i, i)] * m[(j, j)]).sqrt();
            mean / m[(i, j)].abs().max(least * mean)
        };
        pairs.map(ratio).filter(|r| r.is_finite()).fold(1.0, f64::max)
    }

    /// The levels of [`Level::EXPLORED`] that are solved.
    pub(super) fn explored(&self) -> impl Iterator<Item = Level> {
        let count = match (self.plan.marks.edges.is_empty(), self.layout.has_sheets()) {
            (true, _) => 2,
            (false, false) => 3,
            (false, true) => 4,
        };
        Level::EXPLORED.into_iter().take(count)
    }

    /// Solves the first meshes for the upper bound, from which the errors expected on finer ones follow.
    pub(super) fn explore(&mut self) -> Result<Expectation, SolveError> {
        let exploring = Instant::now();
        let loose = (1e-2 * self.settings.relative_tolerance).clamp(1e-8, 1e-4);
        let [first, second, striped, layered] = Level::EXPLORED;
        let triangles = [first, second, striped].map(|level| self.mesh(level).triangles.len());
        let mut coarse = self.on_mesh(first, loose, false)?;
        let mut finer = self.on_mesh(second, loose, false)?;
        self.coarse_field = finer.field.take().or(coarse.field.take());
        let amplification = self.amplification(&finer);
        let mut gained = Gained {
            refined: self.fall(&coarse, &finer),
            last_along_axis: finer.last_along_axis.map(|share| amplification * share),
            striped: 0.0,
            layered: f64::INFINITY,
        };
        if !self.plan.marks.edges.is_empty() {
            let with_strip = self.on_mesh(striped, loose, false)?;
            gained.last_along_axis = with_strip.last_along_axis.map(|share| amplification * share);
            gained.striped = self.fall(&finer, &with_strip);
            if self.layout.has_sheets() {
                let with_layer = self.on_mesh(layered, loose, false)?;
                gained.layered = self.fall(&with_strip, &with_layer);
            }
        }
        self.seconds.choosing = exploring.elapsed().as_secs_f64();
        Ok(Expectation::new(gained, triangles, self.layout.has_sheets()))
    }

    /// Searches until the tolerance is met, or no other mesh is expected to help.
    pub(super) fn run(mut self) -> Result<ExtrudedSolution, SolveError> {
        let tolerance = self.settings.relative_tolerance;
        if let Some(ResolutionLevel { order, levels }) = self.settings.resolution {
            let degree = order.max(1);
            let level =
                Level { degree, layers: levels, strips: levels, axis_degree: degree, axis_layers: levels };
            let result = self.on_mesh(level, iteration_share(tolerance), true)?;
            let spread = error_of(&result.bounds, self.settings);
            let shortfall = (spread.is_nan() || spread > tolerance)
                .then_some(Shortfall::FixedResolution { error: spread });
            return self.finish(Some((spread, result, level)), shortfall);
        }
        let mut expected = self.explore()?;
        let share = iteration_share(tolerance);
        let mut best: Option<(f64, MeshResult, Level)> = None;
        let (mut max_unknowns, mut widened, mut just_widened) = (f64::INFINITY, 0, false);
        let (mut level, mut unknowns) = self.first(&expected);
        loop {
            let result = match self.on_mesh(level, share, true) {
                Err(SolveError::Cancelled) if best.is_some() => {
                    return self.finish(best, Some(Shortfall::Stopped));
                }
                // The search is for the finest mesh that fits and whose triangles are not too flat for double
                // precision.
                Err(
                    error @ (SolveError::TooLarge { .. }
                    | SolveError::Eigenvalues
                    | SolveError::IllConditioned(_)),
                ) if best.is_none() => {
                    max_unknowns = SHRINKAGE * unknowns;
                    match self.cheapest(&expected, None, max_unknowns) {
                        Some(next) => (level, unknowns) = next,
                        None => return Err(error),
                    }
                    continue;
                }
                Err(error @ SolveError::Contradiction(_)) => return Err(error),
                // Triangles or elements that are too flat for double precision.
                Err(error) if best.is_some() => {
                    return self.finish(best, Some(Shortfall::FinerMesh(Box::new(error))));
                }
                result => result?,
            };
            let spread = error_of(&result.bounds, self.settings);
            let before = best.as_ref().map_or(f64::INFINITY, |(before, ..)| *before);
            let better = spread < before || before.is_nan();
            // An error that stays while the mesh becomes finer comes from open space.
            let stays = spread > 0.6 * before && spread > tolerance;
            if better {
                best = Some((spread, result, level));
            }
            if spread <= tolerance {
                return self.finish(best, None);
            }
            if stays && widened < MAX_WIDENINGS && self.widen() {
                (widened, just_widened) = (widened + 1, true);
                continue;
            }
            // Grading costs unknowns, and edges of dielectrics seldom matter: they do where the error is far
            // above the expected one, and where no finer mesh helps.
            let is_far = spread > FAR * tolerance && spread > SURPRISE * expected.error(level);
            if is_far && self.grade_at_dielectrics() {
                (expected, just_widened, max_unknowns) = (self.explore()?, true, f64::INFINITY);
                (level, unknowns) = self.first(&expected);
                continue;
            }
            let next = self.finer(&mut expected, level, spread, max_unknowns);
            match next.filter(|(next, _)| *next != level && (better || just_widened)) {
                Some(next) => ((level, unknowns), just_widened) = (next, false),
                None if self.grade_at_dielectrics() => {
                    (expected, just_widened, max_unknowns) = (self.explore()?, true, f64::INFINITY);
                    (level, unknowns) = self.first(&expected);
                }
                None => {
                    let least = best.as_ref().map_or(f64::NAN, |(spread, ..)| *spread);
                    return self.finish(best, Some(Shortfall::FinestMesh { error: least }));
                }
            }
        }
    }

    /// The solution from the best mesh: its spread, its results and its level.
    fn finish(
        self,
        best: Option<(f64, MeshResult, Level)>,
        shortfall: Option<Shortfall>,
    ) -> Result<ExtrudedSolution, SolveError> {
        let Some((spread, result, level)) = best else { return Err(SolveError::Cancelled) };
        if shortfall.is_some() && !is_usable(result.converged, spread) {
            return Err(SolveError::NotConverged);
        }
        let solution = Solution {
            maxwell: result.bounds.entries(),
            two_terminal: result.bounds.two_terminal(),
            measured: self.settings.target.of(&result.bounds),
            floating: self.floating.proved(&result.unreduced),
            reached: shortfall.is_none(),
            shortfall,
            unknowns: result.unknowns,
            iterations: result.iterations,
            grids: self.meshes,
            mirrored: self.planes.each_ref().map(Option::is_some),
            resolution: Discretisation::Grid(ResolutionLevel {
                order: level.degree.max(level.axis_degree),
                levels: level.layers.max(level.axis_layers),
            }),
            repair_share: result.repair_share,
            seconds: self.seconds,
            field: None,
            foresight: None,
            with_error_of_base: None,
        };
        match contradiction(&solution, &result.unreduced, &self.floating) {
            Some(what) => Err(SolveError::Contradiction(what)),
            None => Ok(ExtrudedSolution {
                solution,
                turn: self.turn,
                planes: self.planes,
                field: result.field.or(self.coarse_field),
            }),
        }
    }
}

impl MeshResult {
    /// Takes account of the problems of one parity.
    fn note(&mut self, upper: &Energies, lower: Option<&Energies>) {
        self.unknowns = self.unknowns.max(upper.unknowns + lower.map_or(0, |l| l.unknowns));
        self.converged &= upper.converged && lower.is_none_or(|l| l.converged);
        self.iterations = self.iterations.max(upper.iterations).max(lower.map_or(0, |l| l.iterations));
        self.repair_share = self.repair_share.max(lower.map_or(0.0, |l| l.repair_share));
    }
}

//! A scene laid out for the box solver, with its symmetric parts and the settings.

use crate::boxes::half_turn::halves::core_of;
use crate::boxes::holders::ACROSS;
use crate::boxes::layout::{Frame, Grid, Layout};
use crate::boxes::resolution::{first, memory};
use crate::boxes::scene_map::SceneMap;
use crate::boxes::superposed::{Base, Sight};
use crate::boxes::symmetry::{Part, leave_opposite, parts};
use crate::error::SolveError;
use crate::far::without_far_faces;
use crate::floating::Floating;
use crate::solution::Settings;
use elastocap_fem::tensor::Dims;
use elastocap_geometry::scene::{Potential, Scene};
use faer::Mat;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A scene laid out for the box solver, with its symmetric parts and the settings.
pub(crate) struct GridProblem<'a> {
    /// The layout of the whole scene.
    pub(crate) layout: Layout,
    /// The symmetric parts of its potentials.
    pub(crate) parts: Vec<Part>,
    /// Whether only the state is solved in which two conductors have opposite potentials, so that the matrix
    /// is not that of the scene.
    pub(crate) opposite_alone: bool,
    /// The half, quarter or eighth of the scene that grids are made for; a quarter where a half turn leaves
    /// half of it.
    pub(crate) core: Layout,
    /// Axes across which a grid is reflected before it is solved on: none where only mirrors are used, the
    /// last where a half turn is.
    pub(crate) reflected: [bool; 3],
    /// Largest relative change of any capacitance due to the far faces that were left out.
    pub(crate) left_out: f64,
    /// Which conductors float.
    pub(crate) floating: Floating,
    pub(crate) settings: &'a Settings,
    /// Whether fluxes are kept, for products with those on another grid.
    pub(crate) keeps_fluxes: bool,
    /// The base that the solution is added to, if there is one.
    pub(crate) base: Option<&'a Base>,
    /// Set where the error of that base is to cancel in differences between scenes: the body that is added,
    /// and how much it sees of the error.
    pub(crate) sight: Option<Sight>,
    /// Set where the problem is a base whose error is to cancel in differences: a body that will be added,
    /// and how much it sees of the error.
    pub(crate) seen_by: Option<Sight>,
    /// Whether the problem is the base of a single symmetric part.
    pub(crate) is_part: bool,
    /// Least distance to which a grid reaches into open space, and whether that distance is exact.
    pub(crate) reach: Option<(f64, bool)>,
}

/// The frame of another scene in which a scene is laid out.
pub(crate) struct InFrame {
    /// The frame.
    pub(crate) frame: Frame,
    /// Mirror planes that may be used.
    pub(crate) mirrored: [bool; 3],
    /// Distance of the farthest face from the origin of the frame, in its unit.
    pub(crate) reach: f64,
    /// Least distance at which rays to infinity begin, over `reach`.
    pub(crate) far: f64,
    /// Where rays to infinity begin, if that is given.
    pub(crate) radius: Option<f64>,
}

impl<'a> GridProblem<'a> {
    /// Lays out a scene, which a `map` may bend, in its own frame or in that of another scene.
    ///
    /// # Errors
    /// As for [`Layout::new`].
    pub(crate) fn new(
        scene: &Scene,
        map: Option<&Arc<SceneMap>>,
        in_frame: Option<&InFrame>,
        settings: &'a Settings,
    ) -> Result<Self, SolveError> {
        let frame = in_frame.map(|in_frame| in_frame.frame);
        let is_alone = map.is_none() && in_frame.is_none();
        let nearer = if is_alone { without_far_faces(scene, settings.relative_tolerance) } else { None };
        let (scene, left_out) = nearer.as_ref().map_or((scene, 0.0), |(nearer, share)| (nearer, *share));
        let mut layout = Layout::in_frame(scene, map, frame, settings.memory_limit)?;
        if let Some(in_frame) = in_frame {
            (0..3).filter(|a| !in_frame.mirrored[*a]).for_each(|a| layout.mirror[a] = None);
            layout.turn = None;
        }
        let reach = in_frame.map(|in_frame| {
            in_frame.radius.map_or((in_frame.reach * in_frame.far, false), |radius| (radius, true))
        });
        let grounded: Vec<bool> =
            scene.conductors().map(|conductor| conductor.potential == Potential::Grounded).collect();
        let floating = Floating::new(scene);
        let mut parts = parts(&layout, &grounded, settings.symmetry);
        let pair = settings.target.opposite(floating.driven.len());
        let pair = pair.filter(|_| settings.target_alone && settings.bounds && floating.floating.is_empty());
        let opposite_alone =
            pair.is_some_and(|pair| leave_opposite(&mut parts, pair.map(|k| floating.driven[k])));
        let mirrored =
            |a: usize| layout.mirror[a].is_some() || (layout.turn.is_some() && ACROSS.contains(&a));
        let reflected = [0, 1, 2].map(|a| match settings.symmetry {
            true => layout.turn.is_some() && a == ACROSS[1],
            false => mirrored(a),
        });
        Ok(Self {
            parts,
            opposite_alone,
            core: core_of(&layout),
            reflected,
            left_out,
            floating,
            layout,
            settings,
            keeps_fluxes: false,
            base: None,
            sight: None,
            seen_by: None,
            is_part: false,
            reach,
        })
    }

    /// The first grid of a search, on which rays to infinity begin `far` times as far from the pole as the
    /// farthest conductor, or where the grid of a base has them.
    ///
    /// # Errors
    /// [`SolveError::Superposition`] where a plane of the scene is more than half as far out as the rays of
    /// the base begin.
    pub(crate) fn first_grid(&self, far: f64) -> Result<Grid, SolveError> {
        let Some((radius, is_exact)) = self.reach else { return Ok(first(&self.core, far)) };
        // Graded all the way out: one long element would converge slowly.
        let far = if is_exact { 0.0 } else { far };
        let mut grid = first(&self.core, far.max(radius / self.core.size()));
        if is_exact && self.core.grid_radius(0.0) > radius {
            return Err(SolveError::Superposition);
        }
        let radius = if is_exact { radius } else { grid.radius.max(radius) };
        self.core.reach_to(&mut grid, radius);
        Ok(grid)
    }

    /// The potentials of all right-hand sides, in columns: a basis of all potentials of the conductors.
    pub(super) fn basis(&self) -> Mat<f64> {
        let columns: Vec<&Vec<f64>> = self.parts.iter().flat_map(Part::basis).collect();
        let n = self.layout.conductors.len();
        Mat::from_fn(n, n, |c, k| columns.get(k).map_or(0.0, |v| v[c]))
    }

    /// Refuses a grid that does not fit into the memory.
    pub(crate) fn check_memory(&self, grid: &Grid) -> Result<(), SolveError> {
        let (bytes, limit) = (self.memory(grid), self.settings.memory_limit);
        if bytes > limit { Err(SolveError::TooLarge { bytes, limit }) } else { Ok(()) }
    }

    /// Memory, bytes, that the solve of the largest part takes on a grid.
    pub(crate) fn memory(&self, grid: &Grid) -> u64 {
        let (domain, _) = self.core.domain(grid);
        self.memory_of(domain.primal_dims())
    }

    /// Memory, bytes, that the solve of the largest part takes on a grid with `dims` functions on the axes of
    /// the core.
    pub(crate) fn memory_of(&self, dims: Dims) -> u64 {
        let dims = self.reflected_dims(dims);
        let right_hand_sides = self.parts.iter().map(|p| p.potentials.len()).max().unwrap_or(0);
        // Under a map, tensors and gradients are held at Gauss points: at most two along each axis for every
        // function. A solve that is added to a base holds fluxes at these points as well.
        let points = dims.iter().map(|n| 2 * *n as u64).product::<u64>();
        let under_map = self.layout.map.as_ref().map_or(0, |_| points.saturating_mul(100));
        // Where a half turn is used, 64 bytes more for each unknown: the unknowns on the other half, their
        // parts on quarters, and copies of both.
        let halves = if self.layout.turn.is_some() && self.settings.symmetry { 64 } else { 0 };
        let halves = halves * dims.iter().map(|n| *n as u64).product::<u64>();
        let boxes = memory(dims, self.layout.conductors.len().max(right_hand_sides), self.settings.bounds);
        boxes.saturating_add(under_map).saturating_add(halves)
    }

    /// Numbers of functions on the axes of the grid that is solved on, from those on the axes of the core.
    fn reflected_dims(&self, dims: Dims) -> Dims {
        [0, 1, 2].map(|a| if self.reflected[a] { 2 * dims[a] } else { dims[a] })
    }

    /// Unknowns of the largest part on a grid, primal plus dual.
    pub(crate) fn unknowns(&self, grid: &Grid) -> usize {
        let (domain, _) = self.core.domain(grid);
        let n: usize = self.reflected_dims(domain.primal_dims()).iter().product();
        if self.settings.bounds { 2 * n } else { n }
    }

    /// Whether the problem is a base, to whose solution others are to be added.
    pub(crate) fn is_base(&self) -> bool {
        matches!(self.reach, Some((_, false)))
    }

    /// Leaves only the right-hand sides of one part to be solved for.
    pub(crate) fn leave_part(&mut self, index: usize) {
        for (_, part) in self.parts.iter_mut().enumerate().filter(|(k, _)| *k != index) {
            let left = std::mem::take(&mut part.potentials);
            part.unsolved.splice(0..0, left);
        }
        self.is_part = true;
    }

    /// Whether the caller wants the solve to stop.
    pub(crate) fn cancelled(&self) -> bool {
        self.settings.cancel.as_ref().is_some_and(|c| c.load(Ordering::Relaxed))
    }
}

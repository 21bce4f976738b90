//! The layer of section 3.2 of the paper: half of it, bonded to the substrate, its end free.
//!
//! Reference coordinates: the axis of symmetry at `x1 = 0`, the substrate at `x2 = 0`, the top at `x2 = H`.

use super::dimension::{Dimension, Numbers, Plane};
use super::material::Rubber;
use super::mesh::{Mesh, Patch, geometric, graded, uniform};
use super::model::{Body, Equations, Load, ModelError, State};
use super::newton::{Effort, NewtonSettings, StopReason, Stopped};
use super::obstacle::{Obstacle, Shape};
use super::side::Side;

/// What becomes of the layer's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No traction all the way: the face may fold below the plane of the substrate, as in the paper's model.
    Free,
    /// The substrate goes on, and carries what folds over; smooth, unilateral contact.
    FreeOnSubstrate,
    /// The layer goes on: no motion along `x1` there, no traction along it.
    Far,
}

/// A rectangle of another rubber in the layer, bonded to it. Where two overlap, the later one counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Inclusion {
    /// Its lower left corner at rest in m.
    pub min: [f64; 2],
    /// Its upper right corner at rest in m.
    pub max: [f64; 2],
    /// What it is made of.
    pub rubber: Rubber,
}

/// What presses on the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A smooth plate over the whole top: `u2 = -U` there.
    WholeTop,
    /// A smooth punch or cylinder that starts in touch with the top; the layer may leave it and touch its flank.
    Smooth(Shape),
    /// A sharp flat punch: the points under it at the start, `x1 <= half_width` (m), are the ones pressed; smooth.
    Sharp {
        /// Half the width of the punch in m.
        half_width: f64,
    },
    /// A sharp flat punch that the layer sticks to.
    Bonded {
        /// Half the width of the punch in m.
        half_width: f64,
    },
}

/// How fine the mesh is.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerMesh {
    /// Breakpoints along `x1` from the axis to one thickness before the end, in m.
    pub along: Vec<f64>,
    /// Breakpoints from the substrate to the top, in m.
    pub up: Vec<f64>,
    /// Breakpoints along the top over the last thickness, in m, from `half_length - thickness` to `half_length`.
    pub end_top: Vec<f64>,
    /// Fractions of the way from the bonded corner of the end, from 0 to 1. Empty for a mesh without a fan there: a
    /// tensor product, which turns inside out at that corner.
    pub radii: Vec<f64>,
    /// A fan around the point of the top where a sharp punch ends, if there is one.
    pub punch: Option<PunchFan>,
    /// Both halves of the layer: what this describes and its mirror image. For loads that are not symmetric.
    pub whole: bool,
}

/// Sectors around the point where a sharp punch ends: the surface beside it turns up by 90 degrees and more, which two
/// quadrilaterals that meet there cannot follow.
#[derive(Debug, Clone, PartialEq)]
pub struct PunchFan {
    /// First and last of the breakpoints along `x1` that the fan takes the place of; its centre is between them.
    pub along: [usize; 2],
    /// First of the breakpoints upwards that it takes the place of.
    pub up: usize,
    /// `x1` of its centre in m.
    pub corner: f64,
    /// Fractions of the way from the centre, from 0 to 1.
    pub radii: Vec<f64>,
}

impl LayerMesh {
    /// A mesh with `n` equal quadrilaterals over the thickness and as many over each thickness of length; the fan at
    /// the bonded end has `rings` rings that shrink by `ratio`.
    pub fn uniform(thickness: f64, half_length: f64, n: usize, ratio: f64, rings: usize) -> Self {
        let body = half_length - thickness;
        let along = ((body / thickness) * n as f64).round().max(1.0) as usize;
        Self {
            along: uniform(0.0, body, along),
            up: uniform(0.0, thickness, n),
            end_top: uniform(body, half_length, n),
            radii: geometric(ratio, rings),
            punch: None,
            whole: false,
        }
    }

    /// A tensor product for an end that folds: equal quadrilaterals of `thickness / cells` within `block` thicknesses of
    /// the bonded corner, from there each `growth` times as large as the one before, to `thickness / n`.
    pub fn folding_end(
        thickness: f64,
        half_length: f64,
        n: usize,
        cells: usize,
        block: f64,
        growth: f64,
    ) -> Self {
        let (fine, coarse) = (thickness / cells.max(n) as f64, thickness / n as f64);
        let graded = |length: f64| {
            let count = (block * thickness / fine).round().max(1.0);
            let mut x = uniform(0.0, count * fine, count as usize);
            let (mut at, mut size) = (count * fine, growth * fine);
            // One of the last size has to fit in.
            while size < coarse && at + (1.0 + growth) * size < length {
                at += size;
                x.push(at);
                size *= growth;
            }
            let rest = ((length - at) / coarse).round().max(1.0) as usize;
            x.extend(uniform(at, length, rest).iter().skip(1));
            x
        };
        let from_axis: Vec<f64> = graded(half_length).iter().rev().map(|x| half_length - x).collect();
        // Any breakpoint will do between what `mesh` puts together again.
        let cut = from_axis.partition_point(|x| *x <= half_length - thickness).max(1);
        Self {
            along: from_axis[..cut].to_vec(),
            up: graded(thickness),
            end_top: from_axis[cut - 1..].to_vec(),
            radii: Vec::new(),
            punch: None,
            whole: false,
        }
    }

    /// A mesh with about `n` quadrilaterals over the thickness for a sharp punch that ends at `corner` (m), with a
    /// fan there of half the thickness; its `rings` shrink by `ratio`. The fan at the bonded end has two rings.
    pub fn under_punch(
        thickness: f64,
        half_length: f64,
        corner: f64,
        n: usize,
        ratio: f64,
        rings: usize,
    ) -> Self {
        let (body, half) = (half_length - thickness, 0.5 * thickness);
        let (left, right, low) = (corner - half, corner + half, thickness - half);
        let count = |length: f64| ((length / thickness) * n as f64).round().max(1.0) as usize;
        let mut along = uniform(0.0, left, count(left));
        let first = along.len() - 1;
        along.extend(uniform(left, right, count(thickness)).iter().skip(1));
        let last = along.len() - 1;
        along.extend(uniform(right, body, count(0.6 * (body - right))).iter().skip(1));
        let mut up = uniform(0.0, low, count(low));
        let floor = up.len() - 1;
        up.extend(uniform(low, thickness, count(half)).iter().skip(1));
        let punch =
            Some(PunchFan { along: [first, last], up: floor, corner, radii: geometric(ratio, rings) });
        let end_top = uniform(body, half_length, count(0.6 * thickness));
        Self { along, up, end_top, radii: geometric(0.5, 1), punch, whole: false }
    }

    /// A mesh for a smooth punch with rounded corners: about `n` quadrilaterals over the thickness far away, and
    /// `per_radius` over the length of the corner's radius in that part of the surface that slides past the corner, half a
    /// thickness inwards of it. The surface is stretched there by a factor of three and more: two to four are needed.
    pub fn under_rounded_punch(
        thickness: f64,
        half_length: f64,
        half_width: f64,
        corner_radius: f64,
        n: usize,
        per_radius: f64,
    ) -> Self {
        let (coarse, fine) = (thickness / n as f64, corner_radius / per_radius);
        let body = half_length - thickness;
        let band = [(half_width - 0.5 * thickness).max(0.0), half_width];
        let along = |x: f64| {
            let away = (band[0] - x).max(x - band[1]).max(0.0);
            (fine + 0.25 * away).min(if x > band[1] { 2.0 * coarse } else { coarse })
        };
        Self {
            along: graded(0.0, body, along),
            up: graded(0.0, thickness, |y| (3.0 * fine + 0.25 * (thickness - y)).min(coarse)),
            end_top: uniform(body, half_length, (n / 2).max(2)),
            radii: geometric(0.5, 1),
            punch: None,
            whole: false,
        }
    }

    /// Thickness of the layer in m.
    pub fn thickness(&self) -> f64 {
        self.up[self.up.len() - 1]
    }

    /// Half its length in m.
    pub fn half_length(&self) -> f64 {
        self.end_top[self.end_top.len() - 1]
    }

    /// The mesh.
    pub fn mesh(&self) -> Mesh {
        let (body, top) = (self.along[self.along.len() - 1], self.up[self.up.len() - 1]);
        if self.radii.is_empty() {
            let along: Vec<f64> = self.along.iter().chain(self.end_top.iter().skip(1)).copied().collect();
            return self.of_patches(vec![Patch::tensor(&along, &self.up)]);
        }
        let corner = [self.end_top[self.end_top.len() - 1], 0.0];
        let mut rim: Vec<[f64; 2]> = self.up.iter().map(|&y| [body, y]).collect();
        rim.extend(self.end_top.iter().skip(1).map(|&x| [x, top]));
        let mut patches = vec![Patch::fan(corner, &rim, &self.radii)];
        if let Some(PunchFan { along: [first, last], up: floor, corner, radii }) = &self.punch {
            let (low, high) = (&self.up[..=*floor], &self.up[*floor..]);
            let under = &self.along[*first..=*last];
            patches.push(Patch::tensor(&self.along, low));
            patches.push(Patch::tensor(&self.along[..=*first], high));
            patches.push(Patch::tensor(&self.along[*last..], high));
            let mut rim: Vec<[f64; 2]> = high.iter().rev().map(|&y| [under[0], y]).collect();
            rim.extend(under.iter().skip(1).map(|&x| [x, high[0]]));
            rim.extend(high.iter().skip(1).map(|&y| [under[under.len() - 1], y]));
            patches.push(Patch::fan([*corner, top], &rim, radii));
        } else {
            patches.push(Patch::tensor(&self.along, &self.up));
        }
        self.of_patches(patches)
    }

    fn of_patches(&self, mut patches: Vec<Patch>) -> Mesh {
        if self.whole {
            let mirrored: Vec<Patch> = patches.iter().map(|p| p.clone().mapped(|x| [-x[0], x[1]])).collect();
            patches.extend(mirrored);
        }
        Mesh::from_patches(&patches)
    }
}

/// How high above the layer, over the thickness, an indenter starts.
const START: f64 = 0.02;

/// A layer under an indenter, ready to be pressed.
#[derive(Debug)]
pub struct LayerModel<S: Dimension = Plane> {
    equations: Equations<S>,
    indenter: Indenter,
    thickness: f64,
    state: State<S>,
    load: Load<S>,
    /// Number of the indenter among the obstacles.
    punch: Option<usize>,
    substrate: Option<usize>,
    symmetry: Symmetry,
}

/// One step of a pressed layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerStep {
    /// Displacement of the indenter over the thickness.
    pub compression: f64,
    /// Force of the indenter on the *whole* layer (all that symmetry adds) in N, positive in compression; in the plane in
    /// N per metre of width.
    pub force: f64,
    /// Force that the substrate carries by contact beyond the bonded bottom, of the whole layer, in N or N/m.
    pub end_contact_force: f64,
    /// Sum of all vertical forces on the layer over the largest of them.
    pub imbalance: f64,
    /// Deepest penetration of a node in m, at least 0.
    pub penetration: f64,
    /// What it took.
    pub effort: Effort,
}

impl LayerModel {
    /// The layer at rest.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn new(mesh: &LayerMesh, rubber: Rubber, indenter: Indenter, end: End) -> Result<Self, ModelError> {
        Self::with_inclusions(mesh, &rubber, &[], indenter, end)
    }

    /// The layer at rest with bodies of other rubbers in it; the mesh must have their edges among its breakpoints, or
    /// they are as large as the elements whose centres they hold.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn with_inclusions(
        mesh: &LayerMesh,
        rubber: &Rubber,
        inclusions: &[Inclusion],
        indenter: Indenter,
        end: End,
    ) -> Result<Self, ModelError> {
        let length = (1.0 - 1e-9) * mesh.half_length();
        let mut body = Body::new(mesh.mesh(), rubber.clone());
        for (k, inclusion) in inclusions.iter().enumerate() {
            body.rubbers.push(inclusion.rubber.clone());
            for (e, element) in body.mesh.elements.iter().enumerate() {
                let centre = body.mesh.nodes[element[4] as usize];
                if (0..2).all(|a| inclusion.min[a] < centre[a] && centre[a] < inclusion.max[a]) {
                    body.material[e] = k as u16 + 1;
                }
            }
        }
        let symmetry = if mesh.whole { Symmetry::None } else { Symmetry::Half };
        Self::with(body, mesh.thickness(), indenter, end, symmetry, |x| x[0].abs() > length)
    }
}

/// How much of the layer the mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Symmetry {
    /// All of it.
    None,
    /// One side of `x1 = 0`.
    Half,
    /// One side of `x1 = 0` and of `x3 = 0`.
    Quarter,
}

impl<S: Dimension> LayerModel<S> {
    /// The layer `body` at rest; the faces that satisfy `outside` are the ones that may fold over. Of symmetry only the
    /// plane `x1 = 0` is held here.
    pub(crate) fn with(
        mut body: Body<S>,
        top: f64,
        indenter: Indenter,
        end: End,
        symmetry: Symmetry,
        outside: impl Fn(S::Point) -> bool,
    ) -> Result<Self, ModelError> {
        let tiny = 1e-9 * top;
        body.hold(0, |x| x[0] == 0.0 && symmetry != Symmetry::None);
        for axis in 0..S::AXES {
            body.hold(axis, |x| x[1] == 0.0);
        }
        if end == End::Far {
            let length = body.mesh.nodes.iter().map(|x| x[0]).fold(0.0, f64::max);
            body.hold(0, |x| x[0].abs() > length - tiny);
        }
        let (mut punch, mut substrate) = (None, None);
        let mut hold = None;
        let mut obstacles = match indenter {
            Indenter::WholeTop => {
                hold = Some((f64::INFINITY, false));
                Vec::new()
            }
            Indenter::Sharp { half_width } => {
                hold = Some((half_width + tiny, false));
                walls(&body, half_width, top, symmetry, false)
            }
            Indenter::Bonded { half_width } => {
                hold = Some((half_width + tiny, true));
                walls(&body, half_width, top, symmetry, true)
            }
            Indenter::Smooth(shape) => {
                punch = Some(0);
                let sides = body.mesh.boundary_where(|x| x[1] > top - tiny);
                vec![Obstacle { shape, sides, carrier: None }]
            }
        };
        if end == End::FreeOnSubstrate {
            substrate = Some(obstacles.len());
            let sides = body.mesh.boundary_where(outside);
            obstacles.push(Obstacle { shape: Shape::Below, sides, carrier: None });
        }
        body.obstacles = obstacles;
        if let Some((limit, bonded)) = hold {
            for axis in (0..S::AXES).filter(|&axis| axis == 1 || bonded) {
                body.hold(axis, |x| x[1] > top - tiny && x[0].abs() <= limit);
            }
        }
        let mut load = body.no_load();
        if let Some(punch) = punch {
            load.shift[punch][1] = top;
        }
        let mut shift = load.shift.clone();
        if let Some(punch) = punch {
            // A contact force needs a gap.
            shift[punch][1] += START * top;
        }
        let state = State { shift, ..body.at_rest() };
        let equations = Equations::new(body)?;
        Ok(Self { equations, indenter, thickness: top, state, load, punch, substrate, symmetry })
    }

    /// Pressure of indenter and substrate on each node in Pa; zero where nothing touches. `s22` are the normal stresses of
    /// `state` at the nodes in Pa: where the top is held, the pressure is theirs.
    pub fn contact_pressure(&self, state: &State<S>, s22: &[f64]) -> Vec<f64> {
        let body = self.equations.body();
        let mut pressure = self.equations.nodal_contact_pressure(state);
        let tiny = 1e-9 * self.thickness;
        for (n, x) in body.mesh.nodes.iter().enumerate() {
            if x[1] > self.thickness - tiny && body.held[S::AXES * n + 1] {
                pressure[n] = -s22[n];
            }
        }
        pressure
    }

    /// Gives the memory of the factors back until the next load.
    pub(crate) fn release_factors(&mut self) {
        self.equations.release_factors();
    }

    /// The equations behind the model.
    pub fn equations(&self) -> &Equations<S> {
        &self.equations
    }

    /// The last equilibrium.
    pub fn state(&self) -> &State<S> {
        &self.state
    }

    /// The load of the last equilibrium.
    pub fn load(&self) -> &Load<S> {
        &self.load
    }

    /// Displacement (m) of the node nearest to the reference position `x` (m).
    pub fn displacement_near(&self, x: S::Point) -> S::Point {
        let n = self.equations.body().mesh.nearest_node(x);
        S::Point::from_fn(|k| self.state.displacement[S::AXES * n + k])
    }

    /// Moves the indenter to `compression`, its displacement over the thickness.
    ///
    /// # Errors
    /// [`Stopped`]; the model is then in the last equilibrium on the way.
    pub fn press(&mut self, compression: f64, settings: &NewtonSettings) -> Result<LayerStep, Box<Stopped>> {
        let next = self.load_at(compression);
        let effort = self.equations.advance(&mut self.state, &mut self.load, &next, settings)?;
        Ok(self.step(effort))
    }

    /// The equilibrium at `compression`, from that of `other`, a model of the same layer on another mesh, in `state` at about that
    /// compression. `None`, and the model where it was, if none was found like that.
    pub(crate) fn take_over(
        &mut self,
        other: &Self,
        state: &State<S>,
        compression: f64,
        settings: &NewtonSettings,
    ) -> Option<LayerStep> {
        let load = self.load_at(compression);
        match self.equations.equilibrium_from(&other.equations, state, &load, settings) {
            Some((state, effort)) => {
                (self.state, self.load) = (state, load);
                Some(self.step(effort))
            }
            None => {
                // Reactions are those of the last assembly.
                self.equations.assemble(&self.state, &self.load);
                None
            }
        }
    }

    /// The load with the indenter at `compression`.
    fn load_at(&self, compression: f64) -> Load<S> {
        let depth = compression * self.thickness;
        let mut next = self.load.clone();
        if let Some(punch) = self.punch {
            next.shift[punch][1] = self.thickness - depth;
        } else {
            let tiny = 1e-9 * self.thickness;
            for (n, x) in self.equations.body().mesh.nodes.iter().enumerate() {
                if x[1] > self.thickness - tiny {
                    next.displacement[S::AXES * n + 1] = -depth;
                }
            }
        }
        next
    }

    /// Places the axis of a smooth indenter at `x1 = offset` (m). Only for a layer at rest, and a mesh of both halves.
    pub fn place_indenter(&mut self, offset: f64) {
        if let Some(punch) = self.punch {
            self.load.shift[punch][0] = offset;
            self.state.shift[punch][0] = offset;
        }
    }

    /// Moves the indenter until the force on the *whole* layer is `target` (N, in the plane N per metre of width): secants on the
    /// displacement, kept between one that is too small and one that is too large, until the force is met as well as
    /// equilibrium is.
    ///
    /// # Errors
    /// [`Stopped`]; the model is then in the last equilibrium on the way.
    pub fn press_with(&mut self, target: f64, settings: &NewtonSettings) -> Result<LayerStep, Box<Stopped>> {
        const MOST_TRIES: usize = 60;
        // Forces jitter by rounding, with stiff inclusions more than 1e-10.
        const FORCE_TOLERANCE: f64 = 1e-6;
        // Distance from the goal, over it, that is a short way.
        const NEAR: f64 = 0.1;
        let mut last = self.step(Effort::default());
        let mut low = (last.compression, last.force - target);
        let mut high: Option<(f64, f64)> = None;
        let mut slope = None;
        if low.1 > 0.0 {
            high = Some(low);
            low = (0.0, -target);
        }
        if last.force > 0.0 && low.1.abs().min(high.map_or(f64::INFINITY, |h| h.1)) < NEAR * target {
            // A layer becomes stiffer: this slope is too small rather than too large, for a way this short either does.
            slope = Some(last.force / last.compression);
        }
        let mut left = *settings;
        for _ in 0..MOST_TRIES {
            let miss = last.force - target;
            if miss.abs() <= settings.tolerance.max(1e-10) * target.abs() || target == 0.0 && miss == 0.0 {
                return Ok(last);
            }
            let newton = slope.map(|s: f64| last.compression - miss / s).filter(|c: &f64| c.is_finite());
            let next = match high {
                Some(high) => {
                    let inside = |c: &f64| *c > low.0 && *c < high.0;
                    newton.filter(inside).unwrap_or(0.5 * (low.0 + high.0))
                }
                // Nothing above the goal is known yet: not too far at a time, and short of a closed layer.
                None => {
                    let most = low.0 + (0.1_f64).min(0.5 * (1.0 - low.0));
                    newton.unwrap_or(low.0 + 0.01).clamp(low.0 + 1e-12, most)
                }
            };
            let before = last;
            last = self.press(next, &left)?;
            left.most_solves = left.most_solves.saturating_sub(last.effort.solves);
            let miss = last.force - target;
            if miss < 0.0 {
                low = (last.compression, miss)
            } else {
                high = Some((last.compression, miss))
            }
            let moved = last.compression - before.compression;
            if moved != 0.0 {
                slope = Some((last.force - before.force) / moved).filter(|s| *s > 0.0);
            }
            if high.is_some_and(|h| h.0 - low.0 <= 1e-13 * h.0) {
                break;
            }
        }
        if (last.force - target).abs() <= FORCE_TOLERANCE * target.abs() {
            return Ok(last);
        }
        let effort = last.effort;
        let (reason, smallest_j) = (StopReason::NoConvergence, effort.smallest_j);
        Err(Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j, element: 0, effort }))
    }

    /// Forces and contact in the last equilibrium.
    pub fn step(&self, effort: Effort) -> LayerStep {
        let tiny = 1e-9 * self.thickness;
        let top = self.thickness;
        let contact = |o: Option<usize>| o.map_or(0.0, |o| self.equations.contact_force(o, &self.state)[1]);
        let part = match self.indenter {
            Indenter::Smooth(_) => -contact(self.punch),
            _ => -self.equations.reaction(1, |x| x[1] > top - tiny),
        };
        let end = contact(self.substrate);
        let bottom = self.equations.reaction(1, |x| x[1] == 0.0);
        let shift = match self.punch {
            Some(punch) => top - self.load.shift[punch][1],
            None => {
                let axis = S::Point::from_fn(|k| if k == 1 { top } else { 0.0 });
                let n = self.equations.body().mesh.nearest_node(axis);
                -self.load.displacement[S::AXES * n + 1]
            }
        };
        let parts = self.symmetry.parts();
        LayerStep {
            compression: shift / top,
            force: parts * part,
            end_contact_force: parts * end,
            imbalance: (bottom + end - part).abs() / part.abs().max(f64::MIN_POSITIVE),
            penetration: self.equations.penetration(&self.state).max(0.0),
            effort,
        }
    }
}

impl Symmetry {
    /// How many such parts the layer has.
    fn parts(self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Half => 2.0,
            Self::Quarter => 4.0,
        }
    }
}

/// What keeps the surface beside a sharp punch out of it: the free surface turns up, and the punch's flank goes along with
/// the last point under it. For the same reason the points under a smooth punch may not pass that point. In space each
/// strip of the surface has its own.
fn walls<S: Dimension>(
    body: &Body<S>,
    half_width: f64,
    top: f64,
    symmetry: Symmetry,
    bonded: bool,
) -> Vec<Obstacle<S>> {
    let tiny = 1e-9 * top;
    let nodes = &body.mesh.nodes;
    let mut obstacles = Vec::new();
    let ends: &[f64] = if symmetry == Symmetry::None { &[1.0, -1.0] } else { &[1.0] };
    for &end in ends {
        let out = |x: &S::Point| end * x[0] - half_width;
        let corners = (0..nodes.len()).filter(|&n| nodes[n][1] > top - tiny && out(&nodes[n]).abs() < tiny);
        let corners: Vec<usize> = corners.collect();
        for beside in if bonded { vec![true] } else { vec![true, false] } {
            let surface = body.mesh.boundary_where(|x| {
                let on = if beside { out(&x) > -tiny } else { out(&x) < tiny && end * x[0] > -tiny };
                x[1] > top - tiny && on
            });
            let mut strips: Vec<(usize, Vec<Side<S>>)> = corners.iter().map(|&n| (n, Vec::new())).collect();
            for side in surface {
                let middle = nodes[side.nodes.as_ref()[side.nodes.as_ref().len() / 2] as usize];
                let along = |n: usize| (2..S::AXES).map(|k| (nodes[n][k] - middle[k]).abs()).sum::<f64>();
                if let Some(strip) = strips.iter_mut().min_by(|a, b| along(a.0).total_cmp(&along(b.0))) {
                    strip.1.push(side);
                }
            }
            let shape = Shape::Wall { side: if beside { end } else { -end } };
            let strips = strips.into_iter().filter(|strip| !strip.1.is_empty());
            obstacles.extend(strips.map(|(n, sides)| Obstacle { shape, sides, carrier: Some(n as u32) }));
        }
    }
    obstacles
}

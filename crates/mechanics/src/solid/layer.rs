//! The layer under an indenter: half of it or all of it, bonded to the substrate.
//!
//! With a free end it is the one of section 3.2 of the paper "Large deformation mechanics of a soft
//! elastomeric layer under compressive loading for a MEMS tactile sensor application".
//!
//! Reference coordinates: the axis of symmetry at `x1 = 0`, the substrate at `x2 = 0`, the top at `x2 = H`.

use std::ops::Range;

use super::dimension::{Dimension, Numbers, Plane};
use super::estimate::{Estimate, Wanted, WantedNumber};
use super::flanks::flanks;
use super::force_goal::meet_force;
use super::model::{Body, Equations, Load, ModelError, State};
use super::newton::{Effort, NewtonSettings, Stopped};
use super::obstacle::{IndenterProfile, Obstacle, ObstacleShape};
use super::symmetry::Symmetry;
use elastocap_materials::Rubber;

pub use super::layer_mesh::{LayerMesh, PunchFan};
pub use super::layer_step::LayerStep;

/// The condition at the end of the layer, at `x1 = half_length`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// Free of traction everywhere: the face may fold below the plane of the substrate, as in the paper's
    /// model.
    Free,
    /// Free, on a substrate that continues beyond it and carries what folds over, by contact without
    /// friction.
    FreeOnSubstrate,
    /// The layer continues: no displacement along `x1` and no shear traction there.
    Far,
}

/// A box (in the plane a rectangle) of another rubber in the layer, bonded to it. Where two overlap, the
/// later one wins.
#[derive(Debug, Clone, PartialEq)]
pub struct Inclusion<S: Dimension = Plane> {
    /// Lowest corner at rest in m.
    pub min: S::Point,
    /// Highest corner at rest in m.
    pub max: S::Point,
    /// The rubber that it is made of.
    pub rubber: Rubber,
}

/// The indenter that presses on the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A smooth plate over the whole top: `u2 = -U` there.
    WholeTop,
    /// A rigid body without friction that starts in contact with the top. The layer may separate from it and
    /// touch its flank.
    Smooth(IndenterProfile),
    /// A patch of the surface without friction: the points with `|x1| <= half_width` at rest are displaced by
    /// `U`, wherever they go along `x1`. It is wider than a punch of that width once it spreads, and stiffer.
    Held {
        /// Half the width of the patch at rest in m.
        half_width: f64,
    },
    /// A sharp flat punch that the layer is bonded to.
    Bonded {
        /// Half the width of the punch in m.
        half_width: f64,
    },
}

impl Indenter {
    /// Whether it is a rounded body in contact with the surface, and not a prescribed displacement of the
    /// top.
    pub(crate) fn is_rounded(&self) -> bool {
        match self {
            Self::Smooth(_) => true,
            Self::WholeTop | Self::Held { .. } | Self::Bonded { .. } => false,
        }
    }

    /// Half the width in m if the indenter has a flat face.
    pub fn half_width(&self) -> Option<f64> {
        match self {
            Self::WholeTop => None,
            Self::Smooth(profile) => profile.flat_face().map(|(half_width, _)| half_width),
            Self::Held { half_width } | Self::Bonded { half_width } => Some(*half_width),
        }
    }

    /// The radius (m) of rounded corners, but at least `least` (m) or half the width of the indenter,
    /// whichever is smaller.
    pub(crate) fn corner_radius(&self, least: f64) -> Option<f64> {
        match self {
            Self::Smooth(profile) => profile.corner_radius(least),
            Self::WholeTop | Self::Held { .. } | Self::Bonded { .. } => None,
        }
    }

    /// Half the width in m of a held or bonded patch, whose edge needs a fan in the mesh.
    pub(crate) fn patch(&self) -> Option<f64> {
        match *self {
            Self::Held { half_width } | Self::Bonded { half_width } => Some(half_width),
            Self::WholeTop | Self::Smooth(_) => None,
        }
    }
}

/// Height above the layer at which an indenter starts, over the thickness. It is not tuned.
const START: f64 = 0.02;

/// The relative distance from a force within which the place of the indenter becomes an unknown. From farther
/// away, the contact would grow too much at once for Newton's method. Tuned:
/// `time elastocap run cases/comb-on-board.toml`.
const ROUGHLY: f64 = 0.3;

/// A safety factor on the errors that are estimated from stresses in the plane, where the surface passes a
/// corner or leaves the indenter: they do not include the errors of the contact. In randomly drawn layers the
/// true error was up to 2.3 times the estimate. Meshes in space are coarser, and there the errors of the
/// stresses prevail. Tuned:
/// `benches/layer_errors.py --plane`.
const CAUTION: f64 = 3.0;
/// The safety factor in place of [`CAUTION`] under a patch that is held or bonded, for the singular stress at
/// its edge. Tuned: `benches/layer_errors.py --plane`.
const CAUTION_AT_EDGE: f64 = 1.5;

/// A layer under an indenter, ready to be pressed.
#[derive(Debug)]
pub struct LayerModel<S: Dimension = Plane> {
    equations: Equations<S>,
    pub(super) indenter: Indenter,
    /// The thickness at rest in m.
    pub(super) thickness: f64,
    /// The last equilibrium.
    pub(super) state: State<S>,
    /// The load of the last equilibrium.
    load: Load<S>,
    /// Indices of the obstacles of a smooth indenter: one for each side of its middle that the mesh covers.
    indenters: Range<usize>,
    /// The index of the obstacle under an end that may fold over, if there is one.
    substrate: Option<usize>,
    /// The part of the layer that is modelled.
    symmetry: Symmetry,
}

impl LayerModel {
    /// The layer at rest.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn new(mesh: &LayerMesh, rubber: Rubber, indenter: Indenter, end: End) -> Result<Self, ModelError> {
        Self::with_inclusions(mesh, &rubber, &[], indenter, end)
    }

    /// The layer at rest with bodies of other rubbers in it. Each element belongs to the body that contains
    /// its centre, so that the breakpoints of the mesh should include the edges of the bodies.
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
        Self::with_indenter_at(0.0, mesh, rubber, inclusions, indenter, end)
    }

    /// The layer at rest with bodies of other rubbers in it, as [`LayerModel::with_inclusions`] makes it, and
    /// with the middle of a [smooth](Indenter::Smooth) indenter at `x1 = position` (m). Off the middle of the
    /// layer that needs a mesh of the whole of it.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn with_indenter_at(
        position: f64,
        mesh: &LayerMesh,
        rubber: &Rubber,
        inclusions: &[Inclusion],
        indenter: Indenter,
        end: End,
    ) -> Result<Self, ModelError> {
        mesh.check()?;
        let length = (1.0 - 1e-9) * mesh.half_length();
        let mut body = Body::new(mesh.mesh(), rubber.clone());
        include(&mut body, inclusions);
        let symmetry = if mesh.is_whole() { Symmetry::None } else { Symmetry::Half };
        Self::with(body, mesh.thickness(), (indenter, position), end, symmetry, |x| x[0].abs() > length)
    }
}

/// Gives the elements whose centres lie in `inclusions` their rubbers.
pub(crate) fn include<S: Dimension>(body: &mut Body<S>, inclusions: &[Inclusion<S>]) {
    for (k, inclusion) in inclusions.iter().enumerate() {
        body.rubbers.push(inclusion.rubber.clone());
        for (e, element) in body.mesh.elements.iter().enumerate() {
            let nodes = element.as_ref();
            let centre = body.mesh.nodes[nodes[nodes.len() / 2] as usize];
            if (0..S::AXES).all(|a| inclusion.min[a] < centre[a] && centre[a] < inclusion.max[a]) {
                body.material[e] = k as u16 + 1;
            }
        }
    }
}

impl<S: Dimension> LayerModel<S> {
    /// The layer `body` of thickness `top` (m) at rest, under an indenter whose middle is at `x1 = position`
    /// (m). Faces that satisfy `outside` may fold over onto the substrate. Of the planes of symmetry only
    /// `x1 = 0` is held here.
    pub(crate) fn with(
        mut body: Body<S>,
        top: f64,
        (indenter, position): (Indenter, f64),
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
        // Of a part of the top that is held: its largest |x1|, and whether it is bonded to the indenter.
        let mut held_part = None;
        let mut substrate = None;
        let mut obstacles = match indenter {
            Indenter::WholeTop => {
                held_part = Some((f64::INFINITY, false));
                Vec::new()
            }
            Indenter::Held { half_width } => {
                held_part = Some((half_width + tiny, false));
                flanks(&body, half_width, top, symmetry, false)
            }
            Indenter::Bonded { half_width } => {
                held_part = Some((half_width + tiny, true));
                flanks(&body, half_width, top, symmetry, true)
            }
            Indenter::Smooth(profile) => {
                let sides = body.mesh.boundary_where(|x| x[1] > top - tiny);
                // Each half of the indenter is an obstacle: a first guess can then be cleared of either flank
                // by a sideways motion of the half.
                let (right, left): (Vec<_>, Vec<_>) =
                    sides.into_iter().partition(|side| body.mesh.nodes[side.middle()][0] >= position);
                let shape = ObstacleShape::Indenter(profile);
                let parts = [right, left].into_iter().filter(|sides| !sides.is_empty());
                parts.map(|sides| Obstacle { shape, sides, carrier: None }).collect()
            }
        };
        let indenters = if indenter.is_rounded() { 0..obstacles.len() } else { 0..0 };
        if end == End::FreeOnSubstrate {
            substrate = Some(obstacles.len());
            let sides = body.mesh.boundary_where(outside);
            obstacles.push(Obstacle { shape: ObstacleShape::Substrate, sides, carrier: None });
        }
        body.obstacles = obstacles;
        if let Some((limit, bonded)) = held_part {
            for axis in (0..S::AXES).filter(|&axis| axis == 1 || bonded) {
                body.hold(axis, |x| x[1] > top - tiny && x[0].abs() <= limit);
            }
        }
        let mut load = body.no_load();
        for part in indenters.clone() {
            load.shift[part] = S::Point::from_fn(|k| [position, top, 0.0][k]);
        }
        let mut shift = load.shift.clone();
        for part in indenters.clone() {
            // A contact force needs a gap.
            shift[part][1] += START * top;
        }
        let state = State { shift, ..body.at_rest() };
        let equations = Equations::new(body)?;
        Ok(Self { equations, indenter, thickness: top, state, load, indenters, substrate, symmetry })
    }

    /// Pressure of indenter and substrate on each node in Pa, zero without contact. `s22` are the normal
    /// stresses of `state` at the nodes in Pa; they give the pressure where the displacement of the top is
    /// prescribed.
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

    /// Lets the surface slide around corners of at least the radius `least` (m), or of half the width of a
    /// punch that is narrower.
    pub(crate) fn round_corners(&mut self, least: f64) {
        if let Some(radius) = self.indenter.corner_radius(least) {
            self.equations.set_corner_radius(radius);
        }
    }

    /// Releases the memory that is only needed for pressing, until the next load.
    pub(crate) fn release(&mut self) {
        self.equations.release();
    }

    /// Estimates the errors of the force of the last equilibrium, `step`, and of the `numbers` computed from
    /// it.
    pub(crate) fn estimate(
        &mut self,
        step: &LayerStep,
        force_tolerance: f64,
        numbers: Vec<WantedNumber>,
    ) -> Estimate {
        let work = step.force * step.compression * self.thickness / self.symmetry.parts();
        let caution = match self.indenter {
            Indenter::Smooth(_) if S::AXES == 2 => CAUTION,
            Indenter::Held { .. } | Indenter::Bonded { .. } if S::AXES == 2 => CAUTION_AT_EDGE,
            _ => 1.0,
        };
        self.equations.estimate(&self.state, &Wanted { work, caution, force_tolerance, numbers })
    }

    /// A copy of the layer in the same state.
    pub(super) fn twin(&self) -> Option<Self> {
        let equations = Equations::new(self.equations.body().clone()).ok()?;
        let (state, load, indenters) = (self.state.clone(), self.load.clone(), self.indenters.clone());
        Some(Self { equations, state, load, indenters, ..*self })
    }

    /// The equations behind the model.
    pub fn equations(&self) -> &Equations<S> {
        &self.equations
    }

    /// The thickness at rest in m.
    pub(super) fn thickness(&self) -> f64 {
        self.thickness
    }

    /// The last equilibrium.
    pub fn state(&self) -> &State<S> {
        &self.state
    }

    /// Sets the layer to an equilibrium that was found on the same mesh, for this layer or a copy of it.
    pub(super) fn set_equilibrium(&mut self, state: State<S>, load: Load<S>) {
        (self.state, self.load) = (state, load);
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

    /// Finds the equilibrium at `compression`, or near there under a given `force` (N, in the plane N per
    /// metre of width) on the whole layer, from the `state` of `other`, a model of the same layer on another
    /// mesh at about that compression. Returns `None`, and leaves the model as it was, if that fails.
    pub(crate) fn take_over(
        &mut self,
        other: &Self,
        state: &State<S>,
        compression: f64,
        force: Option<f64>,
        settings: &NewtonSettings,
    ) -> Option<LayerStep> {
        let mut load = self.load_at(compression);
        let given = force.filter(|force| self.may_be_pushed(*force, settings));
        let given = given.map(|force| (self.indenters.clone(), force / self.symmetry.parts()));
        let found = self.equations.equilibrium_from(&other.equations, state, &mut load, given, settings);
        let found = found.map(|(state, effort)| {
            (self.state, self.load) = (state, load);
            effort
        });
        if found.is_none() {
            // Reactions are those of the last assembly.
            self.equations.assemble(&self.state, &self.load);
        }
        found.map(|effort| self.step(effort))
    }

    /// The load with the indenter at `compression`.
    fn load_at(&self, compression: f64) -> Load<S> {
        let depth = compression * self.thickness;
        let mut next = self.load.clone();
        for part in self.indenters.clone() {
            next.shift[part][1] = self.thickness - depth;
        }
        if self.indenters.is_empty() {
            let tiny = 1e-9 * self.thickness;
            for (n, x) in self.equations.body().mesh.nodes.iter().enumerate() {
                if x[1] > self.thickness - tiny {
                    next.displacement[S::AXES * n + 1] = -depth;
                }
            }
        }
        next
    }

    /// Moves the indenter until the force on the *whole* layer is `target` (N, in the plane N per metre of
    /// width); see `meet_force`.
    ///
    /// # Errors
    /// [`Stopped`]; the model is then in the last equilibrium on the way.
    pub fn press_with(&mut self, target: f64, settings: &NewtonSettings) -> Result<LayerStep, Box<Stopped>> {
        let last = self.step(Effort::default());
        if !last.meets(target, settings) && self.may_be_pushed(target, settings) {
            let before = (self.state.clone(), self.load.clone());
            if let Some(step) = self.push(target, settings, last) {
                return Ok(step);
            }
            (self.state, self.load) = before;
        }
        meet_force(target, settings.force_tolerance(), settings, last, &mut |next, left| {
            self.press(next, left)
        })
    }

    /// Whether an equilibrium under a force is searched for with the place of the indenter as one more
    /// unknown.
    fn may_be_pushed(&self, force: f64, settings: &NewtonSettings) -> bool {
        !self.indenters.is_empty() && force > 0.0 && !settings.through_folds
    }

    /// Moves the indenter until its force is roughly `target`, with open gaps, and solves for the place with
    /// exactly that force from there. `None` if that fails; the model is then in an intermediate equilibrium.
    fn push(&mut self, target: f64, settings: &NewtonSettings, last: LayerStep) -> Option<LayerStep> {
        let mut effort = Effort::default();
        // The effort is counted over all attempts together, and so is the limit of linear systems.
        let roughly = meet_force(target, ROUGHLY, settings, last, &mut |next, _| {
            let to = self.load_at(next);
            self.equations.march(&mut self.state, &mut self.load, &to, settings, &mut effort)?;
            Ok(self.step(effort))
        });
        roughly.ok()?;
        let given = (self.indenters.clone(), target / self.symmetry.parts());
        let (state, effort) = self.equations.push(&self.state, &mut self.load, given, settings, effort)?;
        self.state = state;
        Some(self.step(effort))
    }

    /// Displacement of the indenter over the thickness in the last equilibrium.
    pub fn compression(&self) -> f64 {
        let top = self.thickness;
        let moved = match self.indenters.clone().next() {
            Some(obstacle) => top - self.load.shift[obstacle][1],
            None => {
                let axis = S::Point::from_fn(|k| if k == 1 { top } else { 0.0 });
                let n = self.equations.body().mesh.nearest_node(axis);
                // Minus a zero of the load would be a compression of -0.
                0.0 - self.load.displacement[S::AXES * n + 1]
            }
        };
        moved / top
    }

    /// Forces and contact in the last equilibrium, together with the `effort` it took.
    pub fn step(&self, effort: Effort) -> LayerStep {
        let tiny = 1e-9 * self.thickness;
        let top = self.thickness;
        let contact = |o: usize| self.equations.contact_force(o, &self.state)[1];
        let part = match self.indenter {
            Indenter::Smooth(_) => -self.indenters.clone().map(contact).sum::<f64>(),
            Indenter::WholeTop | Indenter::Held { .. } | Indenter::Bonded { .. } => {
                -self.equations.reaction(1, |x| x[1] > top - tiny)
            }
        };
        let end = self.substrate.map_or(0.0, contact);
        let bottom = self.equations.reaction(1, |x| x[1] == 0.0);
        let parts = self.symmetry.parts();
        LayerStep {
            compression: self.compression(),
            force: parts * part,
            end_contact_force: parts * end,
            imbalance: (bottom + end - part).abs() / part.abs().max(f64::MIN_POSITIVE),
            penetration: self.equations.penetration(&self.state).max(0.0),
            effort,
        }
    }
}

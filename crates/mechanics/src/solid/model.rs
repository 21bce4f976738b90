//! A body in plane strain, what holds it, and the equations of its equilibrium.

use elastocap_linalg::ldlt::{BlockPlaces, SymmetricSolver};
use rayon::prelude::*;

use super::contact::{POINTS, Pair};
use super::dimension::{Dimension, Element, ElementSystem, Numbers, Plane};
use super::material::Rubber;
use super::mesh::Mesh;
use super::obstacle::Obstacle;

/// The proximal modulus of an element over the shear modulus of its own rubber; see [`super::element`]. A soft element with
/// the proximal modulus of a stiff inclusion would be as hard to solve for as if its bulk modulus were that large.
const PROXIMAL: f64 = 1e5;

/// So many units of the last digit of a position are lost in the forces of an element: they were 1 to 2 where tried.
const LAST_DIGITS: f64 = 8.0;

/// The part of the largest force that rounding may leave unbalanced. Where it leaves more, inclusions of 1e9 times the
/// rubber's modulus for instance, there is no result.
const MOST_ROUNDING: f64 = 1e-6;

/// Why a model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A quadrilateral of the mesh is turned inside out.
    #[error(
        "element {element} of the mesh is turned inside out or has no area; check the patches it came from"
    )]
    InvertedElement {
        /// Its number.
        element: usize,
    },
    /// The lists of a body do not fit its mesh.
    #[error("{what} of the body does not fit its mesh of {nodes} nodes and {elements} elements")]
    Mismatch {
        /// Which list.
        what: &'static str,
        /// Nodes of the mesh.
        nodes: usize,
        /// Quadrilaterals of the mesh.
        elements: usize,
    },
    /// The matrix has no usable pattern.
    #[error("the body has no free displacement, or too many for this machine")]
    NoUnknowns,
    /// Solving would take more memory than there is; nothing was factorised.
    #[error("a mesh of {elements} elements needs about {:.1} GB of memory, and {:.1} GB may be taken", *.bytes as f64 * 1e-9, *.limit as f64 * 1e-9)]
    TooLarge {
        /// Elements of the mesh.
        elements: usize,
        /// Bytes it would take, about.
        bytes: u64,
        /// Bytes that may be taken.
        limit: u64,
    },
}

/// A body in plane strain and what may touch it. Lengths in m, forces in N per metre of width.
#[derive(Debug, Clone, PartialEq)]
pub struct Body<S: Dimension = Plane> {
    /// The reference configuration.
    pub mesh: Mesh<S>,
    /// The materials.
    pub rubbers: Vec<Rubber>,
    /// For each quadrilateral the number of its material.
    pub material: Vec<u16>,
    /// For each displacement (`axes node + axis`) whether it is prescribed.
    pub held: Vec<bool>,
    /// Rigid bodies, and what may touch them.
    pub obstacles: Vec<Obstacle<S>>,
}

/// What is done to a body: values at a moment of the loading.
#[derive(Debug, Clone, PartialEq)]
pub struct Load<S: Dimension = Plane> {
    /// Prescribed displacements in m, `axes node + axis`; read where the displacement is held.
    pub displacement: Vec<f64>,
    /// Dead nodal forces in N/m, `axes node + axis`.
    pub force: Vec<f64>,
    /// Where each obstacle is moved to, in m.
    pub shift: Vec<S::Point>,
}

/// A configuration of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct State<S: Dimension = Plane> {
    /// Displacements in m, `axes node + axis`.
    pub displacement: Vec<f64>,
    /// Pressure coefficients of each quadrilateral in Pa, positive in tension.
    pub pressure: Vec<S::Pressure>,
    /// Contact force of each point that may touch an obstacle in N/m, along the obstacle's normal.
    pub contact: Vec<f64>,
    /// Where each obstacle is, in m.
    pub shift: Vec<S::Point>,
    /// The configuration with larger gaps from which this one was reached, and from which the load moves on.
    pub moving: Option<Box<Self>>,
}

impl<S: Dimension> Body<S> {
    /// A body of one rubber with nothing held.
    pub fn new(mesh: Mesh<S>, rubber: Rubber) -> Self {
        let (material, held) = (vec![0; mesh.elements.len()], vec![false; S::AXES * mesh.nodes.len()]);
        Self { mesh, rubbers: vec![rubber], material, held, obstacles: Vec::new() }
    }

    /// Holds the displacement along `axis` of every node whose reference position satisfies `at`.
    pub fn hold(&mut self, axis: usize, at: impl Fn(S::Point) -> bool) {
        for (n, x) in self.mesh.nodes.iter().enumerate() {
            if at(*x) {
                self.held[S::AXES * n + axis] = true;
            }
        }
    }

    /// The body as it lies: no displacement, no force, obstacles where their shapes put them.
    pub fn no_load(&self) -> Load<S> {
        let n = self.held.len();
        Load {
            displacement: vec![0.0; n],
            force: vec![0.0; n],
            shift: vec![S::Point::default(); self.obstacles.len()],
        }
    }

    /// The body at rest, the obstacles where their shapes put them. Move [`State::shift`] to where they are clear of the body
    /// before the first load: a contact force needs a gap.
    pub fn at_rest(&self) -> State<S> {
        let points = |o: &Obstacle<S>| POINTS.pow(S::AXES as u32 - 1) * o.sides.len();
        State {
            displacement: vec![0.0; self.held.len()],
            pressure: vec![S::Pressure::default(); self.mesh.elements.len()],
            contact: vec![0.0; self.obstacles.iter().map(points).sum()],
            shift: vec![S::Point::default(); self.obstacles.len()],
            moving: None,
        }
    }
}

/// The residual of a state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Residual {
    /// Largest unbalanced force over the largest nodal force.
    pub(crate) force: f64,
    /// What rounding may leave of it: positions are known to some units of their last digit, and a stiff inclusion
    /// turns those into forces.
    pub(crate) rounding: f64,
    /// Largest mean volume error of an element.
    pub(crate) volume: f64,
    /// Largest relative error of the product of gap and contact force; see the contact module.
    pub(crate) contact: f64,
    /// Smallest `J` of all quadrature points, and the element it is in.
    pub(crate) smallest_j: (f64, usize),
}

/// The equations of a body: assembled, solved, and assembled again.
#[derive(Debug)]
pub struct Equations<S: Dimension = Plane> {
    pub(crate) body: Body<S>,
    pub(crate) elements: Vec<S::Element>,
    /// Number of each displacement among the unknowns, `u32::MAX` where it is held.
    pub(crate) unknown: Vec<u32>,
    systems: Vec<ElementSystem<S>>,
    /// For each element, then for each pair that may touch, where its matrix goes.
    pub(crate) places: Vec<BlockPlaces>,
    pub(crate) pairs: Vec<Pair<S>>,
    /// Product of gap and pressure in N/m; see the contact module.
    pub(crate) gap_times_pressure: f64,
    pub(crate) solver: SymmetricSolver,
    /// Unbalanced force of each displacement, held ones included.
    pub(crate) unbalanced: Vec<f64>,
    internal: Vec<f64>,
    pub(crate) right: Vec<f64>,
    force_floor: f64,
    /// For each element the force that a unit of displacement of one of its nodes makes, about, and its size in m.
    sensitivity: Vec<(f64, f64)>,
    /// The shortest side of the box around the body in m.
    pub(crate) shortest_side: f64,
    /// [`Equations::modulus`] times that side.
    pub(crate) modulus_times_size: f64,
    /// Shear modulus in Pa of the rubber that takes most of the room: the one that touches, folds and wrinkles, however
    /// stiff the inclusions are.
    pub(crate) modulus: f64,
    /// The same as the stiffness of a spring at a node: in the plane in Pa, in space times the shortest side of the body.
    spring: f64,
    /// A drag of so many Pa per unit of strain, and the displacements it pulls back to; see
    /// [`folds`](super::folds).
    pub(crate) drag: (f64, Vec<f64>),
}

impl<S: Dimension> Equations<S> {
    /// The equations of `body`. The symbolic factorisation and all memory but that of the factors are taken here.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn new(body: Body<S>) -> Result<Self, ModelError> {
        let (nodes, count) = (body.mesh.nodes.len(), body.mesh.elements.len());
        let mismatch = |what| ModelError::Mismatch { what, nodes, elements: count };
        if body.held.len() != S::AXES * nodes {
            return Err(mismatch("the list of held displacements"));
        }
        if body.material.len() != count || body.material.iter().any(|&m| m as usize >= body.rubbers.len()) {
            return Err(mismatch("the list of materials"));
        }
        let elements = body
            .mesh
            .elements
            .iter()
            .enumerate()
            .map(|(element, e)| {
                let x: Vec<S::Point> = e.as_ref().iter().map(|&n| body.mesh.nodes[n as usize]).collect();
                S::Element::new(&x).ok_or(ModelError::InvertedElement { element })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut unknown = vec![u32::MAX; S::AXES * nodes];
        let mut unknowns = 0;
        let mut order = S::order(&body.mesh.nodes, &body.mesh.elements);
        // A node that carries an obstacle is coupled to all that may touch it: eliminated early, it would couple them.
        order.sort_by_key(|&n| body.obstacles.iter().any(|o| o.carrier == Some(n)));
        for n in order {
            for d in Self::places_of_node(n as usize) {
                if !body.held[d] {
                    unknown[d] = unknowns;
                    unknowns += 1;
                }
            }
        }
        let known = |n: &u32| (*n as usize) < nodes;
        if body
            .obstacles
            .iter()
            .any(|o| !o.sides.iter().flat_map(|s| s.nodes.as_ref()).chain(&o.carrier).all(known))
        {
            return Err(mismatch("a list of touching sides"));
        }
        if unknowns == 0 {
            return Err(ModelError::NoUnknowns);
        }
        let pairs = Pair::all(&body);
        let number = |d: usize| (unknown[d] != u32::MAX).then_some(unknown[d]);
        let groups: Vec<Vec<Option<u32>>> = body
            .mesh
            .elements
            .iter()
            .map(|e| e.as_ref().iter().flat_map(|&n| Self::places_of_node(n as usize)).map(number).collect())
            .chain(pairs.iter().map(|p| p.displacements().map(number).collect()))
            .collect();
        let (solver, places) =
            SymmetricSolver::new(unknowns as usize, &groups).map_err(|_| ModelError::NoUnknowns)?;
        let mut room = vec![0.0; body.rubbers.len()];
        for (element, &m) in elements.iter().zip(&body.material) {
            room[m as usize] += element.volume();
        }
        let most = (0..room.len()).max_by(|&a, &b| room[a].total_cmp(&room[b]));
        let modulus = most.map_or(0.0, |m| body.rubbers[m].shear_modulus());
        let size = body.mesh.nodes.iter().flat_map(Numbers::as_slice).fold(0.0, |m: f64, x| m.max(x.abs()));
        let shortest = body.mesh.shortest_side();
        // In the plane a force is one per metre of width.
        let per_axis = shortest.powi(S::AXES as i32 - 2);
        let sensitivity = elements
            .iter()
            .zip(&body.material)
            .map(|(element, &m)| {
                let product = |a: usize| element.gradient_product(a, a);
                let most = (0..S::Element::NODES).map(product).fold(0.0, f64::max);
                (body.rubbers[m as usize].shear_modulus() * most, element.volume().powf(1.0 / S::AXES as f64))
            })
            .collect();
        Ok(Self {
            unbalanced: vec![0.0; S::AXES * nodes],
            internal: vec![0.0; S::AXES * nodes],
            right: vec![0.0; unknowns as usize],
            systems: vec![ElementSystem::new(S::AXES * S::Element::NODES); count],
            gap_times_pressure: 0.0,
            force_floor: 1e-9 * modulus * size * per_axis,
            sensitivity,
            modulus,
            shortest_side: shortest,
            modulus_times_size: modulus * shortest,
            spring: modulus * per_axis,
            drag: (0.0, vec![0.0; S::AXES * nodes]),
            body,
            elements,
            unknown,
            places,
            pairs,
            solver,
        })
    }

    /// The body.
    pub fn body(&self) -> &Body<S> {
        &self.body
    }

    /// Unknown displacements.
    pub fn unknowns(&self) -> usize {
        self.right.len()
    }

    /// Unknown displacements and pressures.
    pub fn mixed_unknowns(&self) -> usize {
        let rubber = |m: &u16| self.body.rubbers[*m as usize].pressure_compliance().is_some();
        self.right.len() + S::Pressure::COUNT * self.body.material.iter().filter(|m| rubber(m)).count()
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.solver.factor_entries()
    }

    /// Bytes that a mesh of `elements` takes before anything is factorised, about: the matrices of the elements, and where
    /// their entries go.
    pub fn element_bytes(elements: usize) -> u64 {
        let n = S::AXES * S::Element::NODES;
        (elements * n * (12 * n + 8 * S::Pressure::COUNT + 8 * S::Element::POINTS)) as u64
    }

    /// Bytes that solving takes, about.
    pub fn memory_bytes(&self) -> u64 {
        Self::element_bytes(self.elements.len()) + self.solver.memory_bytes()
    }

    /// Gives the memory of the factors back until the next load.
    pub(crate) fn release_factors(&mut self) {
        self.solver.release();
    }

    /// Displacements of the nodes of element `e`, out of those of all nodes.
    pub(crate) fn gather(&self, e: usize, u: &[f64]) -> Vec<f64> {
        self.places_of(e).map(|d| u[d]).collect()
    }

    /// Where the displacements of node `n` are.
    fn places_of_node(n: usize) -> std::ops::Range<usize> {
        S::AXES * n..S::AXES * (n + 1)
    }

    /// Where the displacements of element `e` are.
    fn places_of(&self, e: usize) -> impl Iterator<Item = usize> {
        self.body.mesh.elements[e].as_ref().iter().flat_map(|&n| Self::places_of_node(n as usize))
    }

    fn rubber(&self, e: usize) -> &Rubber {
        &self.body.rubbers[self.body.material[e] as usize]
    }

    /// Assembles residual, tangent and right-hand side at `state` under `load`. Prescribed displacements that
    /// `state` does not have yet go into the right-hand side.
    pub(crate) fn assemble(&mut self, state: &State<S>, load: &Load<S>) -> Residual {
        let mut systems = std::mem::take(&mut self.systems);
        let this = &*self;
        let missing = |d: usize| {
            if this.body.held[d] { load.displacement[d] - state.displacement[d] } else { 0.0 }
        };
        systems.par_iter_mut().enumerate().with_min_len(16).for_each(|(e, system)| {
            let u = this.gather(e, &state.displacement);
            let rubber = this.rubber(e);
            this.elements[e].assemble(
                rubber,
                &u,
                &state.pressure[e],
                PROXIMAL * rubber.shear_modulus(),
                system,
            );
            let (drag, anchor) = &this.drag;
            if *drag > 0.0 {
                this.elements[e].add_drag(*drag, &u, &this.gather(e, anchor), system);
            }
            for (c, d) in this.places_of(e).enumerate() {
                let step = missing(d);
                if step != 0.0 {
                    // The tangent is symmetric: a row is a column.
                    let column = &system.stiffness[c * u.len()..(c + 1) * u.len()];
                    for (force, stiffness) in system.condensed_force.iter_mut().zip(column) {
                        *force += stiffness * step;
                    }
                }
            }
        });
        self.systems = systems;
        self.assemble_again(state, load)
    }

    /// The same where the last assembly was of the same displacements, pressures and load, all of that taken on: only the
    /// contact has changed.
    pub(crate) fn assemble_again(&mut self, state: &State<S>, load: &Load<S>) -> Residual {
        self.solver.clear();
        self.right.fill(0.0);
        self.internal.fill(0.0);
        let mut volume: f64 = 0.0;
        let mut smallest_j = (f64::INFINITY, 0);
        for (e, system) in self.systems.iter().enumerate() {
            let nodes = self.body.mesh.elements[e].as_ref().iter();
            for (r, d) in nodes.flat_map(|&n| Self::places_of_node(n as usize)).enumerate() {
                self.internal[d] += system.force[r];
                if self.unknown[d] != u32::MAX {
                    self.right[self.unknown[d] as usize] -= system.condensed_force[r];
                }
            }
            for (place, value) in self.places[e].iter().zip(&system.stiffness) {
                if let Some(place) = *place {
                    self.solver.add(place, *value);
                }
            }
            let size = self.elements[e].volume();
            volume = system.volume_error.as_slice().iter().fold(volume, |v, x| v.max((x / size).abs()));
            if system.smallest_j < smallest_j.0 {
                smallest_j = (system.smallest_j, e);
            }
        }
        self.unbalanced.copy_from_slice(&self.internal);
        for (d, f) in load.force.iter().enumerate() {
            self.unbalanced[d] -= f;
            if self.unknown[d] != u32::MAX {
                self.right[self.unknown[d] as usize] += f;
            }
        }
        let contact = self.assemble_contact(state, load);
        let scale = self.internal.iter().fold(self.force_floor, |m, f| m.max(f.abs()));
        let rounding = self.sensitivity.iter().enumerate().fold(0.0, |most: f64, (e, (stiffness, size))| {
            let moved = self.places_of(e).fold(0.0, |m: f64, d| m.max(state.displacement[d].abs()));
            most.max(stiffness * (size + moved))
        });
        let rounding = (LAST_DIGITS * f64::EPSILON * rounding / scale).min(MOST_ROUNDING);
        let mut worst: f64 = 0.0;
        for (d, f) in self.unbalanced.iter().enumerate() {
            if f.is_nan() {
                worst = f64::INFINITY;
            } else if !self.body.held[d] {
                worst = worst.max(f.abs());
            }
        }
        Residual { force: worst / scale, rounding, volume, contact, smallest_j }
    }

    /// Factorises the last tangent. Returns the number of negative pivots, or `None` if it is singular.
    pub(crate) fn factorise(&mut self) -> Option<usize> {
        self.solver.factorise().ok()
    }

    /// Adds springs of `stiffness` times the shear modulus between every free displacement and where it is.
    pub(crate) fn damp(&mut self, stiffness: f64) {
        self.solver.add_to_diagonal(stiffness * self.spring);
    }

    /// Solves for the step that the last assembly asks for, with the last factors. Returns the step as a difference of
    /// states and the residual of the linear system, or `None` if the matrix is singular.
    pub(crate) fn solve(&mut self, state: &State<S>, load: &Load<S>) -> Option<(State<S>, f64)> {
        let mut x = std::mem::take(&mut self.right);
        let linear_residual = self.solver.solve(&mut x);
        let du: Vec<f64> = (0..self.unknown.len())
            .map(|d| match self.unknown[d] {
                u32::MAX => load.displacement[d] - state.displacement[d],
                k => x[k as usize],
            })
            .collect();
        self.right = x;
        if !linear_residual.is_finite() {
            return None;
        }
        let pressure = (0..self.elements.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|e| {
                let (rubber, du) = (self.rubber(e), self.gather(e, &du));
                let kappa_0 = PROXIMAL * rubber.shear_modulus();
                self.elements[e].pressure_increment(rubber, &du, kappa_0, &self.systems[e])
            })
            .collect();
        let shift = state.shift.iter().zip(&load.shift);
        let shift: Vec<S::Point> = shift.map(|(now, then)| S::Point::from_fn(|k| then[k] - now[k])).collect();
        let contact = self.contact_increment(state, &du, &shift);
        let step = State { displacement: du, pressure, contact, shift, moving: None };
        Some((step, linear_residual))
    }

    /// Smallest `J` after the displacement `after`, the element it is in, and the smallest ratio to `J` before;
    /// `folds` leaves out the elements whose rubber has an energy for any `J`.
    pub(crate) fn smallest_j(&self, before: &[f64], after: &[f64], folds: bool) -> (f64, usize, f64) {
        let each = |e: usize| {
            if folds && S::Element::ANY_VOLUME_RATIO && self.rubber(e).knows_inside_out() {
                return (f64::INFINITY, e, f64::INFINITY);
            }
            let (j, ratio) = self.elements[e].smallest_j(&self.gather(e, after), &self.gather(e, before));
            (j, e, ratio)
        };
        let least = |a: (f64, usize, f64), b: (f64, usize, f64)| {
            let (j, e) = if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { (b.0, b.1) } else { (a.0, a.1) };
            (j, e, a.2.min(b.2))
        };
        let none = || (f64::INFINITY, 0, f64::INFINITY);
        (0..self.elements.len()).into_par_iter().with_min_len(64).map(each).reduce(none, least)
    }

    /// The force in N/m that what holds a set of displacements exerts, from the last assembly: the sum of the reactions
    /// along `axis` of the nodes whose reference position satisfies `at`.
    pub fn reaction(&self, axis: usize, at: impl Fn(S::Point) -> bool) -> f64 {
        let nodes = self.body.mesh.nodes.iter().enumerate();
        nodes
            .filter(|(n, x)| self.body.held[S::AXES * n + axis] && at(**x))
            .map(|(n, _)| self.unbalanced[S::AXES * n + axis])
            .sum()
    }
}

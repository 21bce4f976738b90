//! Assembly of the equations at a configuration, their factorisation, and the solution for a step.

use elastocap_materials::Rubber;
use rayon::prelude::*;

use super::{Equations, Expanded, GivenForce, Load, State};
use crate::solid::dimension::{Dimension, Element, ElementSystem, Numbers};

/// The proximal modulus of an element over the shear modulus of its rubber; see [`crate::solid::element`]. A
/// soft element with the proximal modulus of a stiff inclusion would be as ill-conditioned as with a bulk
/// modulus of that size. Tuned: `cargo bench --bench mechanics`.
const PROXIMAL: f64 = 1e5;

/// Rounding error of a position in the forces of an element, in units of its last digit; 1 to 2 were
/// observed. It is not tuned.
const LAST_DIGITS: f64 = 8.0;

/// The largest unbalanced force from rounding, over the largest force. With more, as for inclusions of 1e9
/// times the modulus of the rubber, there is no result. It is not tuned.
const MAX_ROUNDING: f64 = 1e-6;

/// The residual of a state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Residual {
    /// Largest unbalanced force over the largest nodal force.
    pub(crate) force: f64,
    /// The part of `force` that may be due to rounding: positions are known to some units of their last
    /// digit, which correspond to forces in a stiff inclusion.
    pub(crate) rounding: f64,
    /// Largest mean volume error of an element.
    pub(crate) volume: f64,
    /// Largest relative error of the product of gap and contact force; see the contact module.
    pub(crate) contact: f64,
    /// Relative error of the force of the indenter, where that is given.
    pub(crate) given_force: f64,
    /// Smallest `J` of all quadrature points, and the element it is in.
    pub(crate) smallest_j: (f64, usize),
}

impl<S: Dimension> Equations<S> {
    /// Assembles residual, tangent and right-hand side at `state` under `load`. Prescribed displacements that
    /// `state` does not have yet go into the right-hand side.
    pub(crate) fn assemble(&mut self, state: &State<S>, load: &Load<S>) -> Residual {
        let mut systems = std::mem::take(&mut self.systems);
        systems.resize_with(self.elements.len(), || ElementSystem::new(S::AXES * S::Element::NODES));
        let mut expanded = std::mem::take(&mut self.expanded);
        expanded.resize_with(self.elements.len(), Expanded::default);
        let this = &*self;
        // The prescribed motion that is left to do.
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
        });
        systems.par_iter_mut().zip(&mut expanded).enumerate().with_min_len(16).for_each(
            |(e, (system, out))| {
                let (stiffness, force) = match &this.expansions[e] {
                    Some(expansion) => {
                        expansion.expand(system, out);
                        (&out.stiffness, &mut out.condensed_force)
                    }
                    None => (&system.stiffness, &mut system.condensed_force),
                };
                let count = force.len();
                for (c, d) in this.coupled_places(e).enumerate() {
                    let step = missing(d);
                    if step != 0.0 {
                        // The tangent is symmetric: a row is a column.
                        let column = &stiffness[c * count..(c + 1) * count];
                        for (force, stiffness) in force.iter_mut().zip(column) {
                            *force += stiffness * step;
                        }
                    }
                }
            },
        );
        (self.systems, self.expanded) = (systems, expanded);
        self.assemble_again(state, load)
    }

    /// Assembles residual, tangent and right-hand side as [`Equations::assemble`] does, after an assembly
    /// with the same displacements, pressures and load: only the contact has changed.
    pub(crate) fn assemble_again(&mut self, state: &State<S>, load: &Load<S>) -> Residual {
        self.solver.clear();
        self.right.fill(0.0);
        self.internal.fill(0.0);
        let mut volume: f64 = 0.0;
        let mut smallest_j = (f64::INFINITY, 0);
        for (e, system) in self.systems.iter().enumerate() {
            let (force, condensed_force, stiffness) = match &self.expansions[e] {
                Some(_) => {
                    let expanded = &self.expanded[e];
                    (&expanded.force, &expanded.condensed_force, &expanded.stiffness)
                }
                None => (&system.force, &system.condensed_force, &system.stiffness),
            };
            let nodes = match &self.expansions[e] {
                Some(more) => more.nodes.as_slice(),
                None => self.body.mesh.elements[e].as_ref(), // not through a method, which would borrow all of the equations
            };
            for (r, d) in nodes.iter().flat_map(|&n| Self::places_of_node(n as usize)).enumerate() {
                self.internal[d] += force[r];
                if let Some(number) = self.unknowns.index(d) {
                    self.right[number] -= condensed_force[r];
                }
            }
            for (place, value) in self.places[e].iter().zip(stiffness) {
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
            if let Some(number) = self.unknowns.index(d) {
                self.right[number] += f;
            }
        }
        let contact = self.assemble_contact(state, load);
        let scale = self.internal.iter().fold(self.force_floor, |m, f| m.max(f.abs()));
        let rounding = self.sensitivity.iter().enumerate().fold(0.0, |most: f64, (e, (stiffness, size))| {
            let moved = self.places_of(e).fold(0.0, |m: f64, d| m.max(state.displacement[d].abs()));
            most.max(stiffness * (size + moved))
        });
        let rounding = (LAST_DIGITS * f64::EPSILON * rounding / scale).min(MAX_ROUNDING);
        let mut worst: f64 = 0.0;
        for (d, f) in self.unbalanced.iter().enumerate() {
            if f.is_nan() {
                worst = f64::INFINITY;
            } else if !self.body.held[d] {
                worst = worst.max(f.abs());
            }
        }
        let given_force = self.given_force.as_ref().map_or(0.0, GivenForce::miss);
        Residual { force: worst / scale, rounding, volume, contact, given_force, smallest_j }
    }

    /// Factorises the last tangent. Returns the number of negative pivots, or `None` if it is singular.
    pub(crate) fn factorise(&mut self) -> Option<usize> {
        self.solver.factorise().ok()
    }

    /// Adds a spring to every free displacement, at rest in the present configuration: `stiffness` is over
    /// the shear modulus.
    pub(crate) fn damp(&mut self, stiffness: f64) {
        self.solver.add_to_diagonal(stiffness * self.spring);
    }

    /// Solves for the Newton step of the last assembly with the last factors. Returns the step as a
    /// difference of states and the residual of the linear system, or `None` if the matrix is singular or a
    /// given force cannot be followed.
    pub(crate) fn solve(&mut self, state: &State<S>, load: &Load<S>) -> Option<(State<S>, f64)> {
        let mut x = std::mem::take(&mut self.right);
        let linear_residual = self.solver.solve(&mut x);
        let moved = self.move_with_force(&mut x);
        let mut du: Vec<f64> = (0..self.unknowns.displacements())
            .map(|d| match self.unknowns.index(d) {
                None => load.displacement[d] - state.displacement[d],
                Some(number) => x[number],
            })
            .collect();
        self.right = x;
        self.let_follow(&mut du);
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
        let moved = moved?;
        let motion = |(o, (now, wanted)): (usize, (&S::Point, &S::Point))| {
            S::Point::from_fn(|k| if k == 1 && self.moves_with_force(o) { moved } else { wanted[k] - now[k] })
        };
        let shift: Vec<S::Point> = state.shift.iter().zip(&load.shift).enumerate().map(motion).collect();
        let contact = self.contact_increment(state, &du, &shift);
        let step = State { displacement: du, pressure, contact, shift, moving: None };
        Some((step, linear_residual))
    }

    /// The pressure that follows from the displacements `z` alone in element `e`, by the last assembly.
    pub(crate) fn pressure_response(&self, e: usize, z: &[f64]) -> S::Pressure {
        let rubber = self.rubber(e);
        // Without the residual of the volume, and without the matrix, which is not needed.
        let coupling = self.systems[e].coupling.clone();
        let system = ElementSystem { coupling, ..ElementSystem::new(0) };
        self.elements[e].pressure_increment(
            rubber,
            &self.gather(e, z),
            PROXIMAL * rubber.shear_modulus(),
            &system,
        )
    }

    /// The smallest `J` under the displacements `after`, the element it is in, and the smallest ratio of this
    /// `J` to that under `before`. With `folds`, elements whose rubber has an energy for any `J` are left
    /// out.
    pub(crate) fn smallest_j(&self, before: &[f64], after: &[f64], folds: bool) -> (f64, usize, f64) {
        let of_element = |e: usize| {
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
        (0..self.elements.len()).into_par_iter().with_min_len(64).map(of_element).reduce(none, least)
    }

    /// The least ratio, over all quadrature points, of the remaining extension under the displacements
    /// `after` to that under `before`, and the element it is in. `None` if no rubber has a limit of
    /// extension.
    pub(crate) fn extension_left(&self, before: &[f64], after: &[f64]) -> Option<(f64, usize)> {
        if !self.body.rubbers.iter().any(Rubber::has_extension_limit) {
            return None;
        }
        let of_element = |e: usize| {
            let (rubber, element) = (self.rubber(e), &self.elements[e]);
            let (before, after) = (self.gather(e, before), self.gather(e, after));
            let ratio = |q: usize| {
                let left = element.extension_left(rubber, q, &after)?;
                let ratio = left / element.extension_left(rubber, q, &before)?;
                Some(if left.is_nan() { f64::NEG_INFINITY } else { ratio })
            };
            let least = (0..S::Element::POINTS).filter_map(ratio).fold(f64::INFINITY, f64::min);
            (least, e)
        };
        let least = |a: (f64, usize), b: (f64, usize)| {
            if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }
        };
        let none = || (f64::INFINITY, 0);
        Some((0..self.elements.len()).into_par_iter().with_min_len(64).map(of_element).reduce(none, least))
    }

    /// The force (N, in the plane N/m) of the supports of a set of nodes, from the last assembly: the sum of
    /// the reactions along `axis` at the nodes whose reference position satisfies `selected`.
    pub fn reaction(&self, axis: usize, selected: impl Fn(S::Point) -> bool) -> f64 {
        let nodes = self.body.mesh.nodes.iter().enumerate();
        nodes
            .filter(|(n, x)| self.body.held[S::AXES * n + axis] && selected(**x))
            .map(|(n, _)| self.unbalanced[S::AXES * n + axis])
            .sum()
    }
}

//! Contact without friction between the surface of the body and rigid obstacles, by an interior-point method.
//!
//! Gap `g >= 0`, contact force `l >= 0` and `g l = 0` have a corner, at which Newton's method goes back and forth
//! between sets of touching nodes. It is rounded off: `g l = w s` with `g, l > 0`, the length `w` of surface that
//! belongs to the point and a small product `s` of gap and pressure. The forces are unknowns; their increments are
//!
//! `l + dl = (w s - l n'd) / g`, `d = du - (motion of the obstacle)`,
//!
//! so that a pair adds the stiffness `(l/g) n n' - l H`, `H` the Hessian of the distance, and the force `n w s / g`: the
//! pattern of the matrix does not depend on what touches. The steps of [`super::newton`] keep `g` and `l` positive, and
//! take `s` to where the remaining gaps do not matter. The distance from a convex body is a convex function: a step
//! that keeps the linear gap positive keeps the gap positive, round any corner.

use elastocap_fem::quadrature::gauss_legendre;

use super::element::quadratic;
use super::model::{Body, Equations, Load, State};
use super::obstacle::Gap;

/// The part of the way to `g = 0` or `l = 0` that one step may go.
const BOUNDARY_FRACTION: f64 = 0.995;

/// Points of a side that are kept out of an obstacle. Nodes alone are not enough: what lies between two of them would cut
/// through a corner of the obstacle, and the layer would slide past it there.
pub(crate) const POINTS: usize = 4;

/// A point of the surface that may touch an obstacle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pair {
    obstacle: usize,
    /// Displacements on which the place of the point relative to the obstacle depends: number, axis and factor.
    slots: Vec<(usize, usize, f64)>,
    /// Reference position of the point relative to the carrier of the obstacle, in m.
    reference: [f64; 2],
    /// Length of surface in m that belongs to the point.
    weight: f64,
}

/// Distance, force and tangent of one pair.
struct PairState {
    gap: Gap,
    force: f64,
    /// Derivative of the contact force by the distance vector, its sign changed.
    stiffness: [[f64; 2]; 2],
}

impl Pair {
    /// All pairs of `body`, obstacle after obstacle.
    pub(crate) fn all(body: &Body) -> Vec<Self> {
        let (points, weights) = gauss_legendre(POINTS);
        let mut pairs = Vec::new();
        for (o, obstacle) in body.obstacles.iter().enumerate() {
            for edge in &obstacle.edges {
                let x = edge.nodes.map(|n| body.mesh.nodes[n as usize]);
                let length = (x[2][0] - x[0][0]).hypot(x[2][1] - x[0][1]);
                for (s, w) in points.iter().zip(&weights) {
                    let shape = quadratic(*s).0;
                    let mut reference: [f64; 2] =
                        std::array::from_fn(|k| (0..3).map(|a| shape[a] * x[a][k]).sum());
                    let mut slots = Vec::with_capacity(7);
                    for (n, value) in edge.nodes.iter().zip(shape) {
                        slots.extend((0..2).map(|k| (2 * *n as usize + k, k, value)));
                    }
                    if let Some(n) = obstacle.carrier {
                        reference[0] -= body.mesh.nodes[n as usize][0];
                        slots.push((2 * n as usize, 0, -1.0));
                    }
                    pairs.push(Self { obstacle: o, slots, reference, weight: 0.5 * length * w });
                }
            }
        }
        pairs
    }

    /// The displacements that it couples.
    pub(crate) fn displacements(&self) -> impl Iterator<Item = usize> {
        self.slots.iter().map(|slot| slot.0)
    }
}

impl Equations {
    /// Whether anything may touch an obstacle.
    pub(crate) fn has_contact(&self) -> bool {
        !self.pairs.is_empty()
    }

    fn gap(&self, pair: &Pair, state: &State) -> Gap {
        let mut y = pair.reference;
        for &(d, k, factor) in &pair.slots {
            y[k] += factor * state.displacement[d];
        }
        self.body.obstacles[pair.obstacle].shape.gap(y, state.shift[pair.obstacle])
    }

    fn pair_state(&self, c: usize, state: &State) -> PairState {
        let gap = self.gap(&self.pairs[c], state);
        let force = state.contact[c];
        let stiffness = std::array::from_fn(|k| {
            std::array::from_fn(|m| {
                let along = gap.normal[k] * gap.normal[m];
                let across = if k == m { 1.0 - along } else { -along };
                force / gap.distance * along - force * gap.curvature * across
            })
        });
        PairState { gap, force, stiffness }
    }

    /// Sets every contact force to the product `s` over the gap: what a body has that has not been in contact yet.
    pub(crate) fn start_contact(&self, state: &mut State) {
        for (c, pair) in self.pairs.iter().enumerate() {
            if state.contact[c] <= 0.0 {
                state.contact[c] = self.gap_times_pressure * pair.weight / self.gap(pair, state).distance;
            }
        }
    }

    /// Adds contact forces and stiffness. Returns the largest relative error of `g l = w s`.
    pub(crate) fn assemble_contact(&mut self, state: &State, load: &Load) -> f64 {
        let mut worst: f64 = 0.0;
        let elements = self.elements.len();
        for c in 0..self.pairs.len() {
            let pair = &self.pairs[c];
            let obstacle = pair.obstacle;
            let PairState { gap, force, stiffness } = self.pair_state(c, state);
            let product = pair.weight * self.gap_times_pressure;
            worst = worst.max((force * gap.distance / product - 1.0).abs());
            let motion: [f64; 2] =
                std::array::from_fn(|k| load.shift[obstacle][k] - state.shift[obstacle][k]);
            let right: [f64; 2] = std::array::from_fn(|k| {
                gap.normal[k] * product / gap.distance
                    + stiffness[k][0] * motion[0]
                    + stiffness[k][1] * motion[1]
            });
            let slots = &pair.slots;
            for (r, &(d, k, sign)) in slots.iter().enumerate() {
                self.unbalanced[d] -= sign * force * gap.normal[k];
                if self.unknown[d] == u32::MAX {
                    continue;
                }
                self.right[self.unknown[d] as usize] += sign * right[k];
                for (m, &(e, l, other)) in slots.iter().enumerate() {
                    let place = self.places[elements + c][r * slots.len() + m];
                    if place != u32::MAX {
                        self.solver.values[place as usize] += sign * other * stiffness[k][l];
                    } else if self.unknown[e] == u32::MAX {
                        let step = load.displacement[e] - state.displacement[e];
                        self.right[self.unknown[d] as usize] -= sign * other * stiffness[k][l] * step;
                    }
                }
            }
        }
        worst
    }

    /// Increments of the contact forces for the displacement increments `du` and the obstacles' motions, in m.
    pub(crate) fn contact_increment(&self, state: &State, du: &[f64], motion: &[[f64; 2]]) -> Vec<f64> {
        let increment = |(c, pair): (usize, &Pair)| {
            let PairState { gap, force, .. } = self.pair_state(c, state);
            let closing: f64 =
                pair.slots.iter().map(|&(d, k, factor)| factor * gap.normal[k] * du[d]).sum::<f64>()
                    - gap.normal[0] * motion[pair.obstacle][0]
                    - gap.normal[1] * motion[pair.obstacle][1];
            (pair.weight * self.gap_times_pressure - force * closing) / gap.distance - force
        };
        self.pairs.iter().enumerate().map(increment).collect()
    }

    /// Whether the step from `before` to `after` leaves every gap a part of what it was. Contact forces that a step would
    /// take to zero or below are stopped short of it, one by one: they only weigh the next step.
    pub(crate) fn keeps_clear(&self, before: &State, after: &mut State) -> bool {
        let least = 1.0 - BOUNDARY_FRACTION;
        let clear = |pair: &Pair| self.gap(pair, after).distance > least * self.gap(pair, before).distance;
        if !self.pairs.iter().all(clear) {
            return false;
        }
        for (now, then) in after.contact.iter_mut().zip(&before.contact) {
            *now = now.max(least * then);
        }
        true
    }

    /// The force in N/m that obstacle `o` exerts on the body in `state`.
    pub fn contact_force(&self, o: usize, state: &State) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (pair, force) in self.pairs.iter().zip(&state.contact) {
            if pair.obstacle == o {
                let normal = self.gap(pair, state).normal;
                for k in 0..2 {
                    sum[k] += force * normal[k];
                }
            }
        }
        sum
    }

    /// For each point that may touch obstacle `o`: its reference position, its distance in m and the contact pressure
    /// in Pa of the reference area.
    pub fn contact_pressure(&self, o: usize, state: &State) -> Vec<([f64; 2], f64, f64)> {
        let pairs = self.pairs.iter().zip(&state.contact).filter(|(pair, _)| pair.obstacle == o);
        pairs.map(|(p, force)| (p.reference, self.gap(p, state).distance, force / p.weight)).collect()
    }

    /// Deepest penetration of a point into an obstacle, in m; negative where nothing touches.
    pub fn penetration(&self, state: &State) -> f64 {
        self.pairs.iter().map(|pair| -self.gap(pair, state).distance).fold(f64::NEG_INFINITY, f64::max)
    }
}

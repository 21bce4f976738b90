//! Contact without friction between the surface of the body and rigid obstacles, by an interior-point method.
//!
//! Gap `g >= 0`, contact force `l >= 0` and `g l = 0` have a corner, at which Newton's method goes back and
//! forth between sets of touching nodes. It is rounded off: `g l = w s` with `g, l > 0`, the length `w` of
//! surface that belongs to the point and a small product `s` of gap and pressure. The forces are unknowns;
//! their increments are
//!
//! `l + dl = (w s - l n'd) / g`, `d = du - (motion of the obstacle)`,
//!
//! where `n` is the normal of the obstacle. So a pair adds the stiffness `(l/g) n n' - l H`, with the Hessian
//! `H` of the distance, and the force `n w s / g`. The pattern of the matrix does not depend on which points
//! touch. The steps of [`super::newton`] keep `g` and `l` positive and reduce `s` until the remaining gaps do
//! not matter. The distance from a convex body is a convex function, so that a step that keeps the linear gap
//! positive keeps the gap positive, around any corner.
//!
//! A guessed configuration has points inside obstacles, and gaps whose errors are larger than the gaps. From
//! there the same solutions are found without the bounds `g, l > 0`: see [`Linearisation::Smoothed`].

use super::dimension::{Dimension, Numbers};
use super::model::{Equations, Linearisation, Load, Pair, State};
use super::obstacle::{Gap, IndenterProfile, ObstacleShape};

/// The fraction of the way to `g = 0` or `l = 0` that one step may go. Tuned:
/// `cargo bench --bench mechanics`.
const BOUNDARY_FRACTION: f64 = 0.995;

/// The fraction that is tried of the longest step that the linearised gaps admit. Tuned:
/// `cargo bench --bench mechanics`.
const TOWARD_BOUNDARY: f64 = 0.98;
/// The smallest factor by which a step is shortened at once. Tuned: `cargo bench --bench mechanics`.
const SHORTEST_PART: f64 = 0.1;

/// Stiffness of the surface under one point, over the shear modulus times the share of the side that belongs
/// to the point. The number of steps is about the same for values between 5 and 100. Tuned:
/// `cargo bench --bench mechanics`.
const STIFFNESS: f64 = 30.0;
/// The largest depth of a point inside an obstacle, over the radius of the obstacle's corners. It is not
/// tuned.
const DEEPEST: f64 = 0.5;

/// Distance, force and tangent of one pair.
struct PairState {
    gap: Gap,
    /// The contact force `l`.
    force: f64,
    /// The force after a step in which the point stays where it is.
    staying: f64,
    /// The decrease of the force for each metre that the point moves away.
    slope: f64,
    /// Minus the derivative of the vector of the contact force by the position of the point.
    stiffness: [[f64; 3]; 3],
}

/// The gap and the force on the curve `g l = product` with `g - l/stiffness = difference`.
fn on_curve(difference: f64, product: f64, stiffness: f64) -> (f64, f64) {
    let root = (difference * difference + 4.0 * product / stiffness).sqrt();
    if difference >= 0.0 {
        let gap = 0.5 * (root + difference);
        (gap, product / gap)
    } else {
        let force = 0.5 * stiffness * (root - difference);
        (product / force, force)
    }
}

impl<S: Dimension> Equations<S> {
    /// Whether anything may touch an obstacle.
    pub(crate) fn has_contact(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// Sets the radius of the corners of the punch, in m.
    pub(crate) fn set_corner_radius(&mut self, radius: f64) {
        for obstacle in &mut self.body.obstacles {
            if let ObstacleShape::Indenter(
                IndenterProfile::Punch { corner_radius, .. } | IndenterProfile::Block { corner_radius, .. },
            ) = &mut obstacle.shape
            {
                *corner_radius = radius;
            }
        }
    }

    /// The gap of a pair in `state`.
    fn gap(&self, pair: &Pair<S>, state: &State<S>) -> Gap {
        let mut y = pair.reference;
        for &(d, k, factor) in &pair.slots {
            y[k] += factor * state.displacement[d];
        }
        for k in 0..S::AXES {
            y[k] -= state.shift[pair.obstacle][k];
        }
        self.body.obstacles[pair.obstacle].shape.gap(S::in_space(&y))
    }

    /// Distance, force and tangent of pair number `c` in `state`.
    fn pair_state(&self, c: usize, state: &State<S>) -> PairState {
        let pair = &self.pairs[c];
        let gap = self.gap(pair, state);
        let force = state.contact[c];
        let product = pair.weight * self.gap_times_pressure;
        let (staying, slope) = match &self.linearisation {
            Linearisation::Smoothed(slopes) if gap.distance <= 0.0 || force <= 0.0 => {
                let rubber = STIFFNESS * self.modulus * pair.weight / pair.size;
                let stiffness = slopes.get(c).map_or(rubber, |slope| rubber.max(*slope));
                let (near, pressed) = on_curve(gap.distance - force / stiffness, product, stiffness);
                (pressed * (2.0 - gap.distance / near), pressed / near)
            }
            Linearisation::Smoothed(_) | Linearisation::Interior => {
                (product / gap.distance, force / gap.distance)
            }
        };
        let stiffness = std::array::from_fn(|k| {
            std::array::from_fn(|m| slope * gap.normal[k] * gap.normal[m] - force * gap.hessian[k][m])
        });
        PairState { gap, force, staying, slope, stiffness }
    }

    /// Sets every contact force that is not positive, as before the first contact, to `w s` over the gap.
    pub(crate) fn start_contact(&self, state: &mut State<S>) {
        for (c, pair) in self.pairs.iter().enumerate() {
            if state.contact[c] <= 0.0 {
                state.contact[c] = self.gap_times_pressure * pair.weight / self.gap(pair, state).distance;
            }
        }
    }

    /// Adds contact forces and stiffness. Returns the largest relative error of `g l = w s`.
    pub(crate) fn assemble_contact(&mut self, state: &State<S>, load: &Load<S>) -> f64 {
        let mut worst: f64 = 0.0;
        let elements = self.elements.len();
        // The motion of an indenter whose force is given is found with the step.
        let mut given = self.given_force.take();
        if let Some(given) = &mut given {
            given.clear(self.right.len());
        }
        for c in 0..self.pairs.len() {
            let pair = &self.pairs[c];
            let obstacle = pair.obstacle;
            let PairState { gap, force, staying, stiffness, .. } = self.pair_state(c, state);
            let product = pair.weight * self.gap_times_pressure;
            worst = worst.max((force * gap.distance / product - 1.0).abs());
            let mut given = given.as_mut().filter(|given| given.moves(obstacle));
            let is_given = given.is_some();
            let right = S::Point::from_fn(|k| {
                let motion = |m: usize| match m {
                    1 if is_given => 0.0,
                    _ => load.shift[obstacle][m] - state.shift[obstacle][m],
                };
                gap.normal[k] * staying + (0..S::AXES).map(|m| stiffness[k][m] * motion(m)).sum::<f64>()
            });
            if let Some(given) = &mut given {
                given.add_contact(force * gap.normal[1], right[1], stiffness[1][1]);
            }
            let slots = &pair.slots;
            for (r, &(d, k, sign)) in slots.iter().enumerate() {
                self.unbalanced[d] -= sign * force * gap.normal[k];
                // When the obstacle moves up by 1 m.
                let force_per_rise = sign * stiffness[k][1];
                let Some(row) = self.unknowns.index(d) else {
                    if let Some(given) = &mut given {
                        given.add_held(force_per_rise, load.displacement[d] - state.displacement[d]);
                    }
                    continue;
                };
                if let Some(given) = &mut given {
                    given.add_to_column(row, force_per_rise);
                }
                self.right[row] += sign * right[k];
                for (m, &(e, l, other)) in slots.iter().enumerate() {
                    if let Some(place) = self.places[elements + c][r * slots.len() + m] {
                        self.solver.add(place, sign * other * stiffness[k][l]);
                    } else if self.unknowns.index(e).is_none() {
                        let step = load.displacement[e] - state.displacement[e];
                        self.right[row] -= sign * other * stiffness[k][l] * step;
                    }
                }
            }
        }
        self.given_force = given;
        worst
    }

    /// Increments of the contact forces for the displacement increments `du` and the obstacles' motions, in
    /// m.
    pub(crate) fn contact_increment(&self, state: &State<S>, du: &[f64], motion: &[S::Point]) -> Vec<f64> {
        let increment = |(c, pair): (usize, &Pair<S>)| {
            let PairState { gap, force, staying, slope, .. } = self.pair_state(c, state);
            let opening: f64 =
                pair.slots.iter().map(|&(d, k, factor)| factor * gap.normal[k] * du[d]).sum::<f64>()
                    - (0..S::AXES).map(|k| gap.normal[k] * motion[pair.obstacle][k]).sum::<f64>();
            staying - slope * opening - force
        };
        self.pairs.iter().enumerate().map(increment).collect()
    }

    /// Returns 1 if the step from `before` to `after` keeps every gap above a fraction of its value, or if
    /// the method takes gaps of any sign, and otherwise the fraction of the step to try next. A contact force
    /// that the step would make zero or negative is set to a small positive value, since it only weights the
    /// next step.
    pub(crate) fn clear_part(&self, before: &State<S>, after: &mut State<S>) -> f64 {
        if self.linearisation != Linearisation::Interior {
            return 1.0;
        }
        let least = 1.0 - BOUNDARY_FRACTION;
        let ratio = |pair: &Pair<S>| self.gap(pair, after).distance / self.gap(pair, before).distance;
        let smallest = |m: f64, r: f64| if r.is_nan() { r } else { m.min(r) };
        let left = self.pairs.iter().map(ratio).fold(f64::INFINITY, smallest);
        if left.is_nan() || left <= least {
            // This is the fraction for a linear gap. The distance is convex, so that the gap closes no
            // earlier elsewhere.
            let part = TOWARD_BOUNDARY * BOUNDARY_FRACTION / (1.0 - left);
            return if part.is_nan() { 0.5 } else { part.clamp(SHORTEST_PART, TOWARD_BOUNDARY) };
        }
        for (now, then) in after.contact.iter_mut().zip(&before.contact) {
            *now = now.max(least * then);
        }
        1.0
    }

    /// The smallest distance of a point from obstacle `o` in m.
    pub(crate) fn least_gap(&self, o: usize, state: &State<S>) -> f64 {
        let pairs = self.pairs.iter().filter(|pair| pair.obstacle == o);
        pairs.map(|pair| self.gap(pair, state).distance).fold(f64::INFINITY, f64::min)
    }

    /// Sets every contact force to that of the nodal pressures `nodal` in Pa.
    pub(crate) fn press_with_nodal(&self, state: &mut State<S>, nodal: &[f64]) {
        for (pair, force) in self.pairs.iter().zip(&mut state.contact) {
            let slots = pair.slots.iter().filter(|slot| slot.1 == 0 && slot.2 != -1.0);
            let pressure: f64 = slots.map(|&(d, _, factor)| factor * nodal[d / S::AXES]).sum();
            *force = pair.weight * pressure;
        }
    }

    /// Sets every contact force to that of the nodal pressures `nodal` in Pa, or to `w s` over the gap where
    /// that is larger.
    pub(crate) fn guess_contact(&self, state: &mut State<S>, nodal: &[f64]) {
        self.press_with_nodal(state, nodal);
        for (c, pair) in self.pairs.iter().enumerate() {
            let far = pair.weight * self.gap_times_pressure / self.gap(pair, state).distance;
            state.contact[c] = state.contact[c].max(far);
        }
    }

    /// Stores the slopes of the tangents at `state` for the next step, if its linearisation needs them.
    pub(crate) fn keep_slopes(&mut self, state: &State<S>) {
        if self.linearisation != Linearisation::Interior {
            let slopes = (0..self.pairs.len()).map(|c| self.pair_state(c, state).slope).collect();
            self.linearisation = Linearisation::Smoothed(slopes);
        }
    }

    /// Whether every point is outside the obstacles, or so little inside that the nearest face of the
    /// obstacle is the one that it came through.
    pub(crate) fn is_near_surface(&self, state: &State<S>) -> bool {
        self.pairs.iter().all(|pair| {
            let deepest = DEEPEST * self.body.obstacles[pair.obstacle].shape.radius();
            self.gap(pair, state).distance > -deepest
        })
    }

    /// The force (N, in the plane N/m) that obstacle `o` exerts on the body in `state`.
    pub fn contact_force(&self, o: usize, state: &State<S>) -> S::Point {
        let mut sum = S::Point::default();
        for (pair, force) in self.pairs.iter().zip(&state.contact) {
            if pair.obstacle == o {
                let normal = self.gap(pair, state).normal;
                for k in 0..S::AXES {
                    sum[k] += force * normal[k];
                }
            }
        }
        sum
    }

    /// For each point that may touch obstacle `o`: its reference position, along `x1` relative to the carrier
    /// of the obstacle if it has one, its distance in m and the contact pressure in Pa of the reference area.
    pub fn contact_pressure(&self, o: usize, state: &State<S>) -> Vec<(S::Point, f64, f64)> {
        let pairs = self.pairs.iter().zip(&state.contact).filter(|(pair, _)| pair.obstacle == o);
        pairs.map(|(p, force)| (p.reference, self.gap(p, state).distance, force / p.weight)).collect()
    }

    /// Contact pressure at the nodes in Pa of the reference area: the mean over the points around a node, by
    /// its shape function; zero where there is nothing to touch.
    pub fn nodal_contact_pressure(&self, state: &State<S>) -> Vec<f64> {
        let nodes = self.body.mesh.nodes.len();
        let (mut force, mut area) = (vec![0.0; nodes], vec![0.0; nodes]);
        for (pair, l) in self.pairs.iter().zip(&state.contact) {
            for &(d, k, factor) in &pair.slots {
                // Carriers have negative factors, and so have nodes at the far end of the side. Neither is
                // near the point.
                if k == 0 && factor > 0.0 {
                    force[d / S::AXES] += factor * l;
                    area[d / S::AXES] += factor * pair.weight;
                }
            }
        }
        let mut nodal: Vec<f64> =
            force.iter().zip(&area).map(|(f, a)| if *a > 0.0 { f / a } else { 0.0 }).collect();
        for (&node, masters) in &self.body.mesh.hanging.nodes {
            nodal[node as usize] = masters.iter().map(|&(m, part)| part * nodal[m as usize]).sum();
        }
        nodal
    }

    /// Deepest penetration of a point into an obstacle, in m; negative where nothing touches.
    pub fn penetration(&self, state: &State<S>) -> f64 {
        self.pairs.iter().map(|pair| -self.gap(pair, state).distance).fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_point_of_the_curve_has_the_product_and_the_difference_whichever_is_larger() {
        let (product, stiffness) = (3e-7, 20.0);
        for difference in [-2.0, -1e-6, 0.0, 1e-6, 2.0] {
            let (gap, force) = on_curve(difference, product, stiffness);
            assert!(gap > 0.0 && force > 0.0);
            assert!((gap * force / product - 1.0).abs() < 1e-12, "{difference}: {gap} {force}");
            assert!((gap - force / stiffness - difference).abs() < 1e-12, "{difference}: {gap} {force}");
        }
    }
}

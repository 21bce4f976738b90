//! Continuation past loads at which an equilibrium ceases to exist: surfaces that fold and buckle.
//!
//! Where a compressed surface folds, an equilibrium ends at a certain load, and the body snaps into another
//! one that may be far away at the scale of the fold. Newton's method with ever smaller load steps stops
//! there. Here the load is held instead, and the body moves against a *drag* that pulls each step back to the
//! one before, `drag/2 |grad(u - u_before)|^2`. With a large drag this descends the energy, with none it is
//! Newton's method. The drag rises until a step converges and fades while steps converge. The last step has
//! no drag, so that the result is an equilibrium of the body alone.

use super::dimension::Dimension;
use super::model::{Equations, Load, State};
use super::newton::{Effort, Failure, NewtonSettings, StopReason, Stopped, Target};

/// The smallest drag, over the shear modulus. Tuned:
/// `cargo run --release -p elastocap-mechanics --example free_end`, which counts the linear systems solved.
const MIN_DRAG: f64 = 0.1;
/// Factor by which the drag grows after a step that failed. Tuned:
/// `cargo run --release -p elastocap-mechanics --example free_end`, which counts the linear systems solved.
const GROWTH: f64 = 4.0;
/// Relative unbalanced force that is accepted while the body still moves. Tuned:
/// `cargo run --release -p elastocap-mechanics --example free_end`, which counts the linear systems solved.
const ON_THE_WAY: f64 = 1e-3;
/// Number of unstable equilibria under one load that are abandoned. The next one is accepted; its negative
/// pivots are reported. Not tuned: a limit that ordinary cases do not reach.
const MAX_UNSTABLE: usize = 3;
/// The largest drag, over the shear modulus, and the largest number of steps under one load. Not tuned:
/// limits that ordinary cases do not reach.
const MAX_DRAG: f64 = 1e4;
const MAX_STEPS: usize = 400;

impl NewtonSettings<'_> {
    /// Settings for bodies whose surface folds. After twelve Newton steps without convergence a drag is
    /// added.
    pub fn through_folds() -> Self {
        Self { through_folds: true, from_coarser: false, max_iterations: 12, ..Self::default() }
    }
}

impl<S: Dimension> Equations<S> {
    /// Does what [`Equations::advance`] does, in equal load steps of about [`NewtonSettings::first_step`],
    /// none of which is cut.
    pub(crate) fn advance_through_folds(
        &mut self,
        state: &mut State<S>,
        from: &mut Load<S>,
        to: &Load<S>,
        settings: &NewtonSettings,
    ) -> Result<Effort, Box<Stopped>> {
        let start = from.clone();
        let parts = (1.0 / settings.first_step).ceil().max(1.0) as usize;
        let mut effort = Effort::default();
        for k in 1..=parts {
            let load = start.toward(to, k as f64 / parts as f64);
            let settled = self.settle(state, &load, settings, &mut effort);
            self.drag.0 = 0.0;
            match settled {
                Ok(settled) => *state = settled,
                Err((reason, (smallest_j, element))) => {
                    let (reached, step) = ((k - 1) as f64 / parts as f64, 1.0 / parts as f64);
                    return Err(Box::new(Stopped { reached, step, reason, smallest_j, element, effort }));
                }
            }
            *from = load;
            effort.steps += 1;
        }
        Ok(effort)
    }

    /// Finds the equilibrium under `load` that the body snaps into from `start`.
    fn settle(
        &mut self,
        start: &State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<State<S>, Failure> {
        let mut state = start.clone();
        let mut drag = 0.0;
        let mut unstable = 0;
        let target = Target { force: settings.tolerance, contact: 0.0 };
        for _ in 0..MAX_STEPS {
            let target = if drag > 0.0 { Target { force: ON_THE_WAY, ..target } } else { target };
            self.drag.0 = drag * self.modulus;
            self.drag.1.clone_from(&state.displacement);
            let mut trial = state.clone();
            match self.equilibrate(&mut trial, load, target, settings, effort) {
                Ok(_) if drag == 0.0 && (effort.negative_pivots == 0 || unstable == MAX_UNSTABLE) => {
                    return Ok(trial);
                }
                // A load step may end at an unstable equilibrium, which the body leaves under the drag.
                Ok(_) if drag == 0.0 => {
                    unstable += 1;
                    drag = MIN_DRAG;
                }
                Ok(iterations) => {
                    state = trial;
                    drag *= match iterations {
                        0..=4 => 0.2,
                        5..=6 => 0.5,
                        _ => 1.0,
                    };
                    if drag < 0.1 * MIN_DRAG {
                        drag = 0.0;
                    }
                }
                Err(failure @ (StopReason::Cancelled, _)) => return Err(failure),
                Err(failure) => {
                    effort.cuts += 1;
                    drag = (GROWTH * drag).max(MIN_DRAG);
                    if drag > MAX_DRAG {
                        return Err(failure);
                    }
                }
            }
        }
        Err((StopReason::NoConvergence, (effort.smallest_j, 0)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::layer::{End, Indenter, LayerMesh, LayerModel};
    use super::*;
    use elastocap_materials::{HyperelasticLaw, Rubber};

    fn mooney_rivlin() -> Rubber {
        // The rubber of the paper: mu = 2 (c10 + c01) = 1.
        let distortion = HyperelasticLaw::MooneyRivlin { c10: 0.007646, c01: 0.492354 };
        Rubber { distortion, volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) }
    }

    fn free_end(mesh: &LayerMesh, rubber: Rubber) -> LayerModel {
        LayerModel::new(mesh, rubber, Indenter::WholeTop, End::Free).unwrap()
    }

    fn stored_energy(model: &LayerModel, rubber: &Rubber) -> f64 {
        let (equations, state) = (model.equations(), model.state());
        let of_element = |e: usize| {
            let u = equations.gather(e, &state.displacement);
            // J - 1 is orthogonal to every pressure.
            equations.elements[e].energy(rubber, &u, &[0.0; 3])
        };
        (0..equations.elements.len()).map(of_element).sum()
    }

    #[test]
    fn the_free_end_rolls_up_and_its_force_is_the_slope_of_its_energy() {
        let settings = NewtonSettings::through_folds();
        let mut model = free_end(&LayerMesh::folding_end(1.0, 4.0, 8, 24, 0.3, 1.5), mooney_rivlin());
        // The limit for finer meshes, other elements and other rubbers: docs/free-end.md.
        for (compression, limit) in [(0.05, 8.575), (0.1, 19.134), (0.2, 47.2)] {
            let step = model.press(compression, &settings).unwrap();
            println!("{compression} {} {:?}", step.force, step.effort);
            assert!((step.force / limit - 1.0).abs() < 1e-2, "{compression} {}", step.force);
            assert!(step.imbalance < 1e-9 && step.effort.negative_pivots == 0);
        }
        let mut at = |u: f64| {
            let step = model.press(u, &settings).unwrap();
            (step.force, 2.0 * stored_energy(&model, &mooney_rivlin()))
        };
        let (before, middle, after) = (at(0.1995), at(0.2), at(0.2005));
        let slope = (after.1 - before.1) / 1e-3;
        assert!((slope / middle.0 - 1.0).abs() < 1e-5, "{slope} {}", middle.0);
    }

    #[test]
    fn a_neo_hookean_end_falls_from_fold_to_fold_and_goes_on() {
        let settings = NewtonSettings::through_folds();
        let neo_hookean = Rubber { volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) };
        let mesh = LayerMesh::folding_end(1.0, 4.0, 8, 12, 0.3, 1.5);
        let mut plain = free_end(&mesh, neo_hookean.clone());
        let mut model = free_end(&mesh, neo_hookean);
        let without_drag = NewtonSettings { first_step: 0.05, ..NewtonSettings::default() };
        assert!(plain.press(0.2, &without_drag).is_err());
        for (compression, limit) in [(0.1, 19.134), (0.2, 47.19)] {
            let step = model.press(compression, &settings).unwrap();
            println!("{compression} {} {:?}", step.force, step.effort);
            assert!((step.force / limit - 1.0).abs() < 2e-2, "{compression} {}", step.force);
            assert!(step.imbalance < 1e-9);
        }
        assert!(model.step(Effort::default()).compression == 0.2);
    }

    #[test]
    fn a_load_step_onto_a_barrier_goes_on_to_a_stable_equilibrium() {
        // Corner cells this fine have an unstable equilibrium near the end of the fourth load step: 8.638.
        let settings = NewtonSettings::through_folds();
        let mut model = free_end(&LayerMesh::folding_end(1.0, 4.0, 5, 192, 0.03, 1.5), mooney_rivlin());
        let step = model.press(0.05, &settings).unwrap();
        println!("{} {:?}", step.force, step.effort);
        assert!((step.force / 8.58 - 1.0).abs() < 2e-3, "{}", step.force);
        assert_eq!(step.effort.negative_pivots, 0);
    }

    #[test]
    fn an_equilibrium_that_needs_no_drag_is_found_as_it_is() {
        let mesh = LayerMesh::uniform(1.0, 4.0, 4, 0.5, 1);
        let [a, b] = [NewtonSettings::default(), NewtonSettings::through_folds()]
            .map(|settings| free_end(&mesh, mooney_rivlin()).press(0.1, &settings).unwrap().force);
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }

    #[test]
    fn stress_and_tangent_are_slopes_of_the_energy_where_a_point_is_inside_out() {
        let rubber = mooney_rivlin();
        let f = [0.6, 0.9, 1.1, -0.4];
        let d = rubber.derivatives(&f);
        let (stress, tangent) = (d.first_piola(&f), d.tangent(&f));
        let h = 1e-5;
        for k in 0..4 {
            let (mut up, mut down) = (f, f);
            up[k] += h;
            down[k] -= h;
            let (a, b) = (rubber.derivatives(&up), rubber.derivatives(&down));
            assert!(((a.w - b.w) / (2.0 * h) - stress[k]).abs() < 1e-8);
            let (p, q) = (a.first_piola(&up), b.first_piola(&down));
            for r in 0..4 {
                assert!(((p[r] - q[r]) / (2.0 * h) - tangent[r][k]).abs() < 1e-8);
            }
        }
        let barrier = Rubber { volume_barrier: 1.0, ..rubber };
        assert!(barrier.derivatives(&f).w.is_infinite());
    }
}

//! An indenter that is pressed with a given force: its place along `x2` is one more unknown.
//!
//! With the tangent `K` under an indenter that stays, the force `b` on the body for each metre that the
//! indenter moves up, and the stiffness `s` of the contact, a step `du` of the body and `dh` of the indenter
//! satisfy
//!
//! `K du - b dh = r`, `b' du - s dh = F - F0`,
//!
//! with the unbalanced force `r`, the given force `F`, and the force `F0` that remains after a step in which
//! neither the body nor the indenter moves.
//! Two solutions with the factors of `K` give both, so that a load by a force takes no more factorisations
//! than one by a displacement.

use std::ops::Range;

use super::dimension::{Dimension, Numbers};
use super::model::{Equations, GivenForce, Load, State};
use super::newton::{Effort, NewtonSettings};

impl<S: Dimension> Equations<S> {
    /// Where the force of obstacles is given, adds the effect of their motion to the step `x` of the unknown
    /// displacements, which was computed for obstacles that stay. Returns the upward motion of the obstacles
    /// in m; `None` if there is no such step, or if their force would not grow as they move down.
    pub(crate) fn move_with_force(&mut self, x: &mut [f64]) -> Option<f64> {
        let Some(given) = &self.given_force else { return Some(0.0) };
        let mut response = given.column.clone();
        let residual = self.solver.solve(&mut response);
        let product = |x: &[f64]| given.column.iter().zip(x).map(|(b, x)| b * x).sum::<f64>();
        let stiffness = given.stiffness - product(&response);
        let moved = (given.staying + product(x) - given.force) / stiffness;
        if !residual.is_finite() || !moved.is_finite() || stiffness <= 0.0 {
            return None;
        }
        x.iter_mut().zip(&response).for_each(|(x, response)| *x += moved * response);
        Some(moved)
    }

    /// Whether the place of `obstacle` along `x2` follows from its force.
    pub(crate) fn moves_with_force(&self, obstacle: usize) -> bool {
        self.given_force.as_ref().is_some_and(|given| given.moves(obstacle))
    }

    /// Finds the equilibrium in which obstacles press with a `given` force, from `state`, an equilibrium
    /// under about this force, and closes the gaps there. The `load` gets the places of these obstacles. The
    /// returned effort includes the `effort` so far. `None` where there is no such equilibrium near.
    pub(crate) fn push(
        &mut self,
        state: &State<S>,
        load: &mut Load<S>,
        given: (Range<usize>, f64),
        settings: &NewtonSettings,
        mut effort: Effort,
    ) -> Option<(State<S>, Effort)> {
        self.gap_times_pressure = settings.moving_gap * self.modulus_times_size;
        let mut found = state.moving.as_deref().unwrap_or(state).clone();
        self.start_contact(&mut found);
        self.with_force(given, load, |equations, load| {
            equations.follow_to(&mut found, load, settings, &mut effort).ok()?;
            equations.close_gaps(&mut found, load, settings, false, &mut effort).ok()?;
            Some((found, effort))
        })
    }

    /// Finds a configuration in which `obstacles` press with `force`, by `find`, which searches for it under
    /// `load`. The load gets the positions of the obstacles along `x2`. `None` where `find` finds none.
    pub(crate) fn with_force(
        &mut self,
        (obstacles, force): (Range<usize>, f64),
        load: &mut Load<S>,
        find: impl FnOnce(&mut Self, &Load<S>) -> Option<(State<S>, Effort)>,
    ) -> Option<(State<S>, Effort)> {
        self.given_force = Some(GivenForce::new(obstacles.clone(), force));
        let found = find(self, load);
        self.given_force = None;
        let (state, effort) = found?;
        for o in obstacles {
            let height = state.shift[o][1];
            load.shift[o] = S::Point::from_fn(|k| if k == 1 { height } else { load.shift[o][k] });
        }
        Some((state, effort))
    }
}

#[cfg(test)]
mod tests {
    use super::super::dimension::{Plane, Space};
    use super::super::layer::{End, Indenter, LayerMesh, LayerModel};
    use super::super::obstacle::IndenterProfile;
    use super::super::space::layer::{SideCondition, SpaceLayerMesh};
    use super::*;
    use elastocap_materials::Rubber;

    const BALL: Indenter = Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 });
    const PUNCH: Indenter = Indenter::Smooth(IndenterProfile::Punch { half_width: 0.5, corner_radius: 0.1 });

    fn section(n: usize) -> LayerMesh {
        LayerMesh::uniform(1.0, 3.0, n, 0.5, n / 2)
    }

    fn in_plane() -> LayerModel<Plane> {
        LayerModel::new(&section(6), Rubber::neo_hookean(1.0), PUNCH, End::FreeOnSubstrate).unwrap()
    }

    fn in_space(n: usize) -> LayerModel<Space> {
        let mesh = SpaceLayerMesh::new(section(n), 0.8, n);
        LayerModel::of_finite_width(&mesh, Rubber::neo_hookean(1.0), BALL, End::Far, SideCondition::Free)
            .unwrap()
    }

    /// Presses to compressions, and then another layer with the forces found there.
    fn comes_back_to_the_compressions<S: Dimension>(mut pressed: LayerModel<S>, mut pushed: LayerModel<S>) {
        let settings = NewtonSettings::default();
        for compression in [0.05, 0.2, 0.15] {
            let step = pressed.press(compression, &settings).unwrap();
            let found = pushed.press_with(step.force, &settings).unwrap();
            assert!((found.force / step.force - 1.0).abs() < 1e-8, "{step:?} {found:?}");
            assert!((found.compression / compression - 1.0).abs() < 1e-6, "{step:?} {found:?}");
            assert!((pushed.compression() - found.compression).abs() < 1e-15);
            assert!(found.imbalance < 1e-6 && found.penetration == 0.0, "{found:?}");
        }
    }

    #[test]
    fn a_force_leads_to_the_compression_that_has_it() {
        comes_back_to_the_compressions(in_plane(), in_plane());
        comes_back_to_the_compressions(in_space(3), in_space(3));
    }

    #[test]
    fn a_force_near_another_one_takes_hardly_more_systems_than_a_compression() {
        let settings = NewtonSettings::default();
        let (mut pressed, mut pushed) = (in_space(3), in_space(3));
        let first = pressed.press(0.1, &settings).unwrap();
        pushed.press_with(first.force, &settings).unwrap();
        let by_compression = pressed.press(0.11, &settings).unwrap();
        let by_force = pushed.press_with(by_compression.force, &settings).unwrap();
        let systems = |step: &super::super::layer::LayerStep| step.effort.solves;
        assert!(systems(&by_force) <= systems(&by_compression) + 3, "{by_force:?} {by_compression:?}");
    }

    #[test]
    fn a_force_is_met_on_a_finer_mesh_from_the_equilibrium_of_a_coarser_one() {
        let settings = NewtonSettings { first_gap: 1e-5, ..NewtonSettings::default() };
        let (mut coarse, mut fine) = (in_space(2), in_space(4));
        let step = coarse.press(0.2, &settings).unwrap();
        let found =
            fine.take_over(&coarse, coarse.state(), step.compression, Some(step.force), &settings).unwrap();
        assert!(found.meets(step.force, &settings), "{found:?}");
        let mut followed = in_space(4);
        let by_displacement = followed.press(found.compression, &settings).unwrap();
        assert!((by_displacement.force / step.force - 1.0).abs() < 1e-5, "{by_displacement:?} {found:?}");
    }
}

//! The closed form of the paper as a patch test: its tractions on `x1 = H`, its displacements nowhere but on
//! the top, the bottom and the axis.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber, Volume};
use elastocap_mechanics::solid::mesh::Mesh;
use elastocap_mechanics::solid::model::{Body, Equations, Load, State};
use elastocap_mechanics::solid::newton::{Effort, NewtonSettings, Stopped};
use elastocap_mechanics::solid::side::BoundaryEdge;
use elastocap_mechanics::{LayerMap, LayerStress, MooneyRivlin};

const C10: f64 = 682.15;
const C01: f64 = 43931.9;

/// A block `[0, H] x [0, H]` with `H` = 1 that carries the closed form's tractions at `x1 = H`.
pub(crate) struct Block {
    pub(crate) equations: Equations,
    pub(crate) state: State,
    load: Load,
    right: Vec<BoundaryEdge>,
    steps: u32,
}

impl Block {
    pub(crate) fn new(n: usize, volume_barrier: f64) -> Self {
        let rubber = Rubber {
            distortion: HyperelasticLaw::MooneyRivlin { c10: C10, c01: C01 },
            volume: Volume::Incompressible,
            volume_barrier,
        };
        let mut body = Body::new(Mesh::rectangle(1.0, 1.0, n, n), rubber);
        body.hold(0, |x| x[0] == 0.0);
        body.hold(0, |x| x[1] == 0.0);
        body.hold(1, |x| x[1] == 0.0 || x[1] == 1.0);
        let right = body.mesh.boundary_where(|x| x[0] == 1.0);
        assert_eq!(right.len(), n);
        let equations = Equations::new(body).unwrap();
        let (state, load) = (equations.body().at_rest(), equations.body().no_load());
        Self { equations, state, load, right, steps: 0 }
    }

    /// Goes on to the multiple `compression` of 0.025; returns the closed form there.
    ///
    /// Dead tractions are followed in small steps: in between they are interpolated, and far from the
    /// tractions of the closed form the block is not stable.
    pub(crate) fn press(&mut self, compression: f64) -> LayerStress {
        let last = (compression / 0.025).round() as u32;
        for step in self.steps + 1..=last {
            self.step(&closed_form(0.025 * f64::from(step))).unwrap();
        }
        self.steps = last;
        closed_form(0.025 * f64::from(last))
    }

    /// Force over that of the closed form, less 1, in the equilibrium that was found for it.
    pub(crate) fn error(&self, stress: &LayerStress) -> f64 {
        self.equations.reaction(1, |x| x[1] == 1.0) / force(stress) - 1.0
    }

    /// Goes on to the compression of `stress` in one step.
    pub(crate) fn step(&mut self, stress: &LayerStress) -> Result<Effort, Box<Stopped>> {
        let body = self.equations.body();
        let mut next = body.no_load();
        for (k, x) in body.mesh.nodes.iter().enumerate() {
            if x[1] == 1.0 {
                next.displacement[2 * k + 1] = -stress.map().top_displacement();
            }
        }
        body.add_traction(
            &self.right,
            |x, normal| {
                let p = stress.first_piola([x[0], x[1], 0.0]);
                [p[(0, 0)] * normal[0] + p[(0, 1)] * normal[1], p[(1, 0)] * normal[0] + p[(1, 1)] * normal[1]]
            },
            &mut next.force,
        );
        let settings = NewtonSettings { first_step: 1.0, ..Default::default() };
        self.equations.advance(&mut self.state, &mut self.load, &next, &settings)
    }
}

/// Force in N per metre of width on the top of the block, negative in compression.
fn force(stress: &LayerStress) -> f64 {
    let (points, weights) = elastocap_fem::quadrature::gauss_legendre(20);
    let along = points.iter().zip(&weights);
    along.map(|(s, w)| 0.5 * w * stress.first_piola([0.5 * (1.0 + s), 1.0, 0.0])[(1, 1)]).sum()
}

pub(crate) fn closed_form(compression: f64) -> LayerStress {
    let map = LayerMap::new(1.0, compression).unwrap();
    LayerStress::new(map, MooneyRivlin { c10: C10, c01: C01 }, 1.0).unwrap()
}

/// Force over `mu H` that the finite elements find, that of the closed form, and the largest error of a
/// displacement over `H`, at each compression.
fn solve(n: usize, volume_barrier: f64, compressions: &[f64]) -> Vec<(f64, f64, f64)> {
    let mut block = Block::new(n, volume_barrier);
    let mu = block.equations.body().rubbers[0].shear_modulus();
    let mut results = Vec::new();
    for compression in compressions {
        let stress = block.press(*compression);
        let Block { equations, state, .. } = &block;
        let force = -equations.reaction(1, |x| x[1] == 1.0) / mu;
        let exact = -self::force(&stress) / mu;
        let error = equations.body().mesh.nodes.iter().enumerate().fold(0.0f64, |m, (k, x)| {
            let u = stress.map().displacement([x[0], x[1], 0.0]);
            m.max((u[0] - state.displacement[2 * k]).abs()).max((u[1] - state.displacement[2 * k + 1]).abs())
        });
        results.push((force, exact, error));
    }
    results
}

#[test]
fn the_closed_form_with_its_own_tractions_comes_out() {
    let compressions = [0.05, 0.1, 0.2, 0.4];
    for (compression, (force, exact, error)) in
        compressions.iter().zip(solve(16, Rubber::USUAL_BARRIER, &compressions))
    {
        let relative = (force / exact - 1.0).abs();
        println!(
            "{compression}: force {force:.9} closed form {exact:.9} error {relative:.1e}, displacement {error:.1e}"
        );
        assert!(relative < if *compression < 0.3 { 1e-6 } else { 1e-5 });
    }
}

#[test]
fn the_orders_of_convergence_are_those_of_the_element() {
    let errors: Vec<(f64, f64)> = [2, 4, 8, 16]
        .iter()
        .map(|&n| {
            let (force, exact, displacement) = solve(n, 0.0, &[0.2])[0];
            ((force / exact - 1.0).abs(), displacement)
        })
        .collect();
    let order = |k: usize, pick: fn(&(f64, f64)) -> f64| (pick(&errors[k - 1]) / pick(&errors[k])).log2();
    for k in 1..errors.len() {
        println!(
            "orders: force {:.2}, displacement {:.2}; errors {:?}",
            order(k, |e| e.0),
            order(k, |e| e.1),
            errors[k]
        );
    }
    // In the energy norm the error is of second order, and that of the force would be its square if the
    // corner between bonded bottom and tractions were not there: the problem dual to the force is singular in
    // it.
    assert!((1..errors.len()).all(|k| order(k, |e| e.0) > 3.5), "{errors:?}");
    assert!((2..errors.len()).all(|k| order(k, |e| e.1) > 2.5), "{errors:?}");
}

//! What pressing a layer will take, told from the sizes of its meshes before anything is set up.
//!
//! Estimates, fitted to runs of every kind of indenter: memory is one from above, since the factors of longer and of
//! flatter layers are sparser than those fitted; times are those of two cores with nothing else to do, and may be off by a
//! factor of two, for punches with rounded corners by more.

use super::dimension::{Dimension, Numbers};
use super::levels::RIPPLED;
use super::model::Equations;

/// How large a mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSize {
    /// Elements.
    pub elements: usize,
    /// Displacements, held ones included, and pressures.
    pub unknowns: usize,
}

/// What presses, as far as it decides how many linear systems a load takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// A smooth surface; every mesh but the first starts from the one before.
    Smooth,
    /// The end of a sharp punch, at which the surface piles up.
    Sharp,
    /// A rounded corner in the plane, around which the surface slides side by side: so many of them on the first mesh.
    RoundedCorner(f64),
    /// An end that rolls up from fold to fold.
    Folds,
}

/// What of the memory is not counted one by one, over what is; and what a program takes without any layer, in bytes.
const SPARE: f64 = 1.25;
const PROGRAM: f64 = 32e6;

/// Bytes of a row of the matrix with what is taken along with it, and entries of the factor over the displacements to a
/// power: in plane and space.
const ROW: [f64; 2] = [560.0, 2800.0];
const FACTOR: [(f64, f64); 2] = [(7.5, 1.25), (6.0, 1.5)];

/// Seconds for a linear system, over the displacements to two powers.
const SECONDS: [[(f64, f64); 2]; 2] = [[(1.9e-7, 1.2), (0.0, 1.0)], [(4e-6, 1.0), (5.5e-10, 2.0)]];

/// Displacements that are found for a force, about.
const TRIES: f64 = 4.0;

impl MeshSize {
    fn displacements<S: Dimension>(self) -> f64 {
        self.unknowns.saturating_sub(S::Pressure::COUNT * self.elements) as f64
    }

    /// Seconds for one linear system on this mesh, about.
    fn system_seconds<S: Dimension>(self) -> f64 {
        SECONDS[S::AXES - 2]
            .iter()
            .map(|(factor, power)| factor * self.displacements::<S>().powf(*power))
            .sum()
    }
}

/// Bytes that pressing a layer to `loads` loads takes at most, on all of `meshes`, about.
pub fn memory_bytes<S: Dimension>(meshes: &[MeshSize], loads: usize) -> u64 {
    let each = |mesh: &MeshSize| {
        let displacements = mesh.displacements::<S>();
        // What is found at a load is kept twice, with its gaps closed and open, and so is the load.
        let of_states = 8.0 * 5.0 * mesh.unknowns as f64 * loads as f64;
        let (factor, power) = FACTOR[S::AXES - 2];
        let kept = Equations::<S>::element_bytes(mesh.elements) as f64 + ROW[S::AXES - 2] * displacements;
        (kept + of_states, 8.0 * factor * displacements.powf(power))
    };
    // The factors of one mesh are given back before the next one begins.
    let (kept, factors) = meshes
        .iter()
        .map(each)
        .fold((0.0, 0.0), |(sum, most): (f64, f64), (kept, factors)| (sum + kept, most.max(factors)));
    (SPARE * (kept + factors) + PROGRAM) as u64
}

/// Seconds that pressing a layer to `loads` loads takes on two cores if all of `meshes` are needed for each, about; `by_force`
/// where the loads are forces.
pub fn seconds<S: Dimension>(meshes: &[MeshSize], loads: usize, way: Way, by_force: bool) -> f64 {
    let tries = if by_force { TRIES } else { 1.0 };
    let systems = |level: usize| match way {
        Way::Smooth => 15.0 * loads as f64,
        Way::Sharp => 45.0 * loads as f64,
        Way::RoundedCorner(sides) if level < RIPPLED => 30.0 * sides * 2_f64.powi(level as i32),
        Way::RoundedCorner(_) => 150.0 * loads as f64,
        Way::Folds => 100.0 * loads as f64,
    };
    let of_mesh = |(level, mesh): (usize, &MeshSize)| systems(level) * mesh.system_seconds::<S>();
    tries * meshes.iter().enumerate().map(of_mesh).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::dimension::{Plane, Space};
    use crate::solid::layer::{End, Indenter, LayerModel};
    use crate::solid::material::Rubber;
    use crate::solid::mesh::Mesh;
    use crate::solid::obstacle::Shape;
    use crate::solid::press::LayerProblem;
    use crate::solid::space::layer::Side;
    use crate::solid::space::press::SpaceProblem;

    fn size<S: Dimension>(mesh: &Mesh<S>) -> MeshSize {
        let elements = mesh.elements.len();
        MeshSize { elements, unknowns: S::AXES * mesh.nodes.len() + S::Pressure::COUNT * elements }
    }

    /// The estimate covers what the equations themselves say of their memory, and is not thrice as much.
    fn covers(estimate: u64, meshes: &[u64]) {
        let (found, estimate) = (meshes.iter().sum::<u64>() as f64, estimate as f64 - PROGRAM);
        assert!(estimate > found && estimate < 3.0 * found, "{estimate:.2e} {found:.2e}");
    }

    #[test]
    fn the_memory_foretold_covers_that_of_the_equations_within_a_factor_of_three() {
        let rubber = Rubber::neo_hookean(1.0);
        let (half_width, corner_radius) = (1.2, 0.05);
        for indenter in [
            Indenter::WholeTop,
            Indenter::Smooth(Shape::Cylinder { radius: 1.0 }),
            Indenter::Smooth(Shape::Punch { half_width, corner_radius }),
            Indenter::Sharp { half_width },
        ] {
            let (end, inclusions) = (End::FreeOnSubstrate, Vec::new());
            let layer = LayerProblem {
                thickness: 1.0,
                half_length: 4.0,
                rubber: rubber.clone(),
                inclusions,
                indenter,
                position: 0.0,
                end,
            };
            let meshes = [0, 1, 2].map(|level| layer.mesh(level, 0.3));
            let found = meshes.each_ref().map(|m| {
                LayerModel::new(m, rubber.clone(), indenter, end).unwrap().equations().memory_bytes()
            });
            covers(memory_bytes::<Plane>(&meshes.map(|m| size(&m.mesh())), 3), &found);
        }
        for indenter in [
            Indenter::WholeTop,
            Indenter::Smooth(Shape::Sphere { radius: 1.5 }),
            Indenter::Sharp { half_width },
        ] {
            let (end, side) = (End::Free, Side::Free);
            let layer = SpaceProblem {
                thickness: 1.0,
                half_length: 3.0,
                half_width: 1.0,
                rubber: rubber.clone(),
                inclusions: Vec::new(),
                indenter,
                end,
                side,
            };
            let meshes = [2, 4].map(|n| layer.mesh(n));
            let model = |m| LayerModel::of_finite_width(m, rubber.clone(), indenter, end, side).unwrap();
            let found = meshes.each_ref().map(|m| model(m).equations().memory_bytes());
            covers(memory_bytes::<Space>(&meshes.map(|m| size(&m.mesh())), 3), &found);
        }
    }

    #[test]
    fn finer_meshes_more_loads_and_forces_take_longer() {
        let meshes =
            [MeshSize { elements: 500, unknowns: 5600 }, MeshSize { elements: 1800, unknowns: 20_000 }];
        let of =
            |meshes: &[MeshSize], loads, by_force| seconds::<Plane>(meshes, loads, Way::Smooth, by_force);
        assert!(of(&meshes[..1], 1, false) < of(&meshes, 1, false));
        assert!(
            of(&meshes, 1, false) < of(&meshes, 2, false) && of(&meshes, 2, false) < of(&meshes, 2, true)
        );
        assert!(seconds::<Space>(&meshes, 1, Way::Smooth, false) > of(&meshes, 1, false));
        assert_eq!(of(&meshes, 0, false), 0.0);
    }
}

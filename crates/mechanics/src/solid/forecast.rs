//! Forecast of the memory and the time that pressing a layer takes, from the sizes of its meshes alone.
//!
//! The estimates are fitted to runs with every kind of indenter. The memory is an upper estimate, since the
//! factors of longer and flatter layers are sparser than those of the runs. The times are those of two idle
//! cores; they may be off by a factor of two, and by more for punches with rounded corners.

use super::dimension::{Dimension, Numbers};
use super::model::Equations;

/// The size of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshSize {
    /// The number of elements.
    pub elements: usize,
    /// The number of displacements, including prescribed ones, and of pressures.
    pub unknowns: usize,
}

/// The kind of pressing, which determines the number of linear systems per load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressingRegime {
    /// A smooth surface; every mesh but the first starts from the one before.
    Smooth,
    /// The edge of a patch that is held or bonded, at which the surface piles up.
    Patch,
    /// A free end that rolls up, fold after fold.
    Folds,
}

/// Factor for memory that is not counted item by item. Measured: `benches/forecast.py`.
const SPARE: f64 = 1.25;
/// Bytes that the program takes without a layer. Measured: `benches/forecast.py`.
const PROGRAM: f64 = 32e6;

/// Bytes for each row of the matrix, including all memory in proportion to the number of rows, in the plane
/// and in space. Measured: `benches/forecast.py`.
const ROW: [f64; 2] = [560.0, 2800.0];
/// Entries of the factor are `a n^b` for `n` displacements: `(a, b)` in the plane and in space. Measured:
/// `benches/forecast.py`.
const FACTOR: [(f64, f64); 2] = [(7.5, 1.25), (6.0, 1.5)];

/// Seconds for a linear system are a sum of two terms `a n^b` for `n` displacements: `(a, b)` in the plane
/// and in space. Measured: `benches/forecast.py`.
const SECONDS: [[(f64, f64); 2]; 2] = [[(1.9e-7, 1.2), (0.0, 1.0)], [(4e-6, 1.0), (5.5e-10, 2.0)]];

/// The time of a load on all meshes but the first, over that on one thread: two loads are solved at the same
/// time, or one on two threads. Measured: `benches/forecast.py`.
const ON_TWO_THREADS: f64 = 0.6;

/// The approximate number of equilibria at prescribed displacements that are solved to meet one force.
/// Measured: `benches/forecast.py`.
const TRIES: f64 = 4.0;

impl MeshSize {
    /// The number of displacements.
    fn displacements<S: Dimension>(self) -> f64 {
        self.unknowns.saturating_sub(S::Pressure::COUNT * self.elements) as f64
    }

    /// Approximate time of one linear system on this mesh, in seconds.
    fn system_seconds<S: Dimension>(self) -> f64 {
        SECONDS[S::AXES - 2]
            .iter()
            .map(|(factor, power)| factor * self.displacements::<S>().powf(*power))
            .sum()
    }
}

/// Upper estimate of the bytes that pressing a layer to `loads` loads on all of `meshes` takes. On all meshes
/// but the first, the equilibria under two loads are searched for at the same time on two layers, where that
/// takes no more than `limit` bytes.
pub fn memory_bytes<S: Dimension>(meshes: &[MeshSize], loads: usize, limit: u64) -> u64 {
    // The bytes that are kept until the end, and those of the factors.
    let of_one_mesh = |mesh: &MeshSize| {
        let displacements = mesh.displacements::<S>();
        // The equilibrium at each load is stored twice, with closed and with open gaps, and so is the load.
        let of_states = 8.0 * 5.0 * mesh.unknowns as f64 * loads as f64;
        let (factor, power) = FACTOR[S::AXES - 2];
        let stored = Equations::<S>::element_bytes(mesh.elements) as f64 + ROW[S::AXES - 2] * displacements;
        (stored + of_states, 8.0 * factor * displacements.powf(power))
    };
    // The factors of one mesh, and the second layer on it, are released before the next mesh begins.
    let while_solving = |level: usize, (stored, factors): (f64, f64)| {
        let two_layers = stored + 2.0 * factors;
        let fits = SPARE * (stored + two_layers) <= limit as f64;
        if level > 0 && loads > 1 && fits { two_layers } else { factors }
    };
    let (mut stored, mut passing) = (0.0, 0.0_f64);
    for (level, mesh) in meshes.iter().enumerate() {
        let of_mesh = of_one_mesh(mesh);
        stored += of_mesh.0;
        passing = passing.max(while_solving(level, of_mesh));
    }
    (SPARE * (stored + passing) + PROGRAM) as u64
}

/// Estimate of the seconds that pressing a layer to `loads` loads takes on two cores if each needs all of
/// `meshes`. `by_force` says that the loads are forces and not compressions.
pub fn seconds<S: Dimension>(
    meshes: &[MeshSize],
    loads: usize,
    regime: PressingRegime,
    by_force: bool,
) -> f64 {
    let tries = if by_force { TRIES } else { 1.0 };
    let systems = match regime {
        PressingRegime::Smooth => 10.0 * loads as f64,
        PressingRegime::Patch => 45.0 * loads as f64,
        PressingRegime::Folds => 100.0 * loads as f64,
    };
    let shared = |level: usize| if S::AXES == 3 && level > 0 { ON_TWO_THREADS } else { 1.0 };
    let of_mesh = |(level, mesh): (usize, &MeshSize)| shared(level) * systems * mesh.system_seconds::<S>();
    // An empty sum is minus zero.
    0.0 + tries * meshes.iter().enumerate().map(of_mesh).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::dimension::{Plane, Space};
    use crate::solid::layer::{End, Indenter, LayerModel};
    use crate::solid::mesh::Mesh;
    use crate::solid::obstacle::IndenterProfile;
    use crate::solid::plane::press::PlaneLayer;
    use crate::solid::space::layer::SideCondition;
    use crate::solid::space::press::SpaceLayer;
    use elastocap_materials::Rubber;

    fn size<S: Dimension>(mesh: &Mesh<S>) -> MeshSize {
        let elements = mesh.elements.len();
        MeshSize { elements, unknowns: S::AXES * mesh.nodes.len() + S::Pressure::COUNT * elements }
    }

    /// Checks that the estimate covers the memory that the equations report on each mesh, on the last one
    /// twice, and is less than three times as much.
    fn covers(estimate: u64, meshes: &[u64]) {
        let twin = meshes[meshes.len() - 1];
        let (found, estimate) = ((meshes.iter().sum::<u64>() + twin) as f64, estimate as f64 - PROGRAM);
        assert!(estimate > found && estimate < 3.0 * found, "{estimate:.2e} {found:.2e}");
    }

    #[test]
    fn the_forecast_of_the_memory_covers_that_of_the_equations_within_a_factor_of_three() {
        let rubber = Rubber::neo_hookean(1.0);
        let (half_width, corner_radius) = (1.2, 0.05);
        for indenter in [
            Indenter::WholeTop,
            Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 }),
            Indenter::Smooth(IndenterProfile::Punch { half_width, corner_radius }),
            Indenter::Held { half_width },
        ] {
            let (end, inclusions) = (End::FreeOnSubstrate, Vec::new());
            let layer = PlaneLayer {
                thickness: 1.0,
                half_length: 4.0,
                rubber: rubber.clone(),
                inclusions,
                indenter,
                position: 0.0,
                end,
            };
            let meshes = [2, 4, 8].map(|n| layer.mesh(n, 0.3));
            let found = meshes.each_ref().map(|m| {
                LayerModel::new(m, rubber.clone(), indenter, end).unwrap().equations().memory_bytes()
            });
            covers(memory_bytes::<Plane>(&meshes.map(|m| size(&m.mesh())), 3, u64::MAX), &found);
        }
        for indenter in [
            Indenter::WholeTop,
            Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 }),
            Indenter::Held { half_width },
        ] {
            let (end, side) = (End::Free, SideCondition::Free);
            let layer = SpaceLayer {
                thickness: 1.0,
                half_length: 3.0,
                half_width: 1.0,
                rubber: rubber.clone(),
                inclusions: Vec::new(),
                indenter,
                end,
                side,
            };
            let meshes = [2, 4].map(|n| layer.mesh(n, 0.3));
            let model = |m| LayerModel::of_finite_width(m, rubber.clone(), indenter, end, side).unwrap();
            let found = meshes.each_ref().map(|m| model(m).equations().memory_bytes());
            covers(memory_bytes::<Space>(&meshes.map(|m| size(&m.mesh())), 3, u64::MAX), &found);
        }
    }

    #[test]
    fn finer_meshes_more_loads_and_forces_take_longer() {
        let meshes =
            [MeshSize { elements: 500, unknowns: 5600 }, MeshSize { elements: 1800, unknowns: 20_000 }];
        let time = |meshes: &[MeshSize], loads, by_force| {
            seconds::<Plane>(meshes, loads, PressingRegime::Smooth, by_force)
        };
        assert!(time(&meshes[..1], 1, false) < time(&meshes, 1, false));
        assert!(
            time(&meshes, 1, false) < time(&meshes, 2, false)
                && time(&meshes, 2, false) < time(&meshes, 2, true)
        );
        assert!(seconds::<Space>(&meshes, 1, PressingRegime::Smooth, false) > time(&meshes, 1, false));
        assert_eq!(time(&meshes, 0, false), 0.0);
    }
}

//! What every Maxwell matrix obeys, on random scenes of boxes and sheets.

use elastocap_electrostatics::{ResolutionLevel, Settings, solve};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use proptest::prelude::*;

fn wall() -> impl Strategy<Value = Wall> {
    prop_oneof![Just(Wall::Insulated), Just(Wall::Grounded), Just(Wall::Open)]
}

/// Up to three conductors (boxes, or sheets where the thickness is drawn so) in cells of a 3 x 3 x 3 lattice, so that
/// they never touch, and up to two dielectric boxes anywhere.
fn scene() -> impl Strategy<Value = Scene> {
    let body =
        (0..27usize, prop::array::uniform3(0.1..0.4f64), prop::array::uniform3(0.5..0.9f64), 0..4usize);
    let dielectric = (prop::array::uniform3(-1.0..3.0f64), prop::array::uniform3(0.1..2.0f64), 1.0..20.0f64);
    (prop::collection::vec(body, 1..=3), prop::collection::vec(dielectric, 0..=2), wall(), wall()).prop_map(
        |(bodies, dielectrics, side, top)| {
            let mut used = Vec::new();
            let mut conductors = Vec::new();
            for (cell, lo, hi, flat) in bodies {
                if used.contains(&cell) {
                    continue;
                }
                used.push(cell);
                let corner = [cell / 9, cell / 3 % 3, cell % 3].map(|c| c as f64);
                let mut region = Box3 { min: corner, max: corner };
                for a in 0..3 {
                    region.min[a] += lo[a];
                    region.max[a] += if flat == a { lo[a] } else { hi[a] };
                }
                conductors.push(Body::conductor(format!("c{cell}"), Shape::Box(region)));
            }
            // With all walls insulated a single conductor holds no charge.
            let side = if conductors.len() == 1 && side == Wall::Insulated { Wall::Grounded } else { side };
            let walls = [[side; 2], [side, top], [side; 2]];
            let mut domain = Box3::SPACE;
            for a in 0..3 {
                if walls[a][0] != Wall::Open {
                    domain.min[a] = -0.5;
                }
                if walls[a][1] != Wall::Open {
                    domain.max[a] = 3.6;
                }
            }
            let dielectrics = dielectrics.into_iter().enumerate().map(|(i, (min, size, eps))| {
                let region = Box3 { min, max: [0, 1, 2].map(|a| min[a] + size[a]) };
                Body::dielectric(format!("d{i}"), Shape::Box(region), eps)
            });
            let bodies = conductors.into_iter().chain(dielectrics).collect();
            Scene { bodies, background_permittivity: 1.0, domain, walls }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, ..ProptestConfig::default() })]

    #[test]
    fn maxwell_matrices_are_symmetric_diagonally_dominant_and_grow_with_permittivity(scene in scene()) {
        // A coarse grid: bounds hold on any.
        let resolution = Some(ResolutionLevel { order: 2, levels: 0 });
        let settings = Settings { relative_tolerance: 0.3, resolution, ..Settings::default() };
        let solution = solve(&scene, &settings).unwrap();
        let m = &solution.maxwell;
        for i in 0..m.len() {
            let mut row = 0.0;
            for j in 0..m.len() {
                prop_assert_eq!(m[i][j], m[j][i]);
                prop_assert!(m[i][j].lower <= m[i][j].value && m[i][j].value <= m[i][j].upper);
                if i != j {
                    prop_assert!(m[i][j].lower <= 1e-12 * m[i][i].value);
                }
                row += m[i][j].upper;
            }
            prop_assert!(m[i][i].upper > 0.0 && row >= -1e-12 * m[i][i].value);
        }
        // More permittivity anywhere: the capacitance does not fall.
        let mut denser = scene;
        let region = Box3 { min: [-0.2, 0.2, -0.3], max: [1.9, 2.2, 1.3] };
        denser.bodies.push(Body::dielectric("more", Shape::Box(region), 20.0));
        let more = solve(&denser, &settings).unwrap();
        for i in 0..m.len() {
            prop_assert!(more.maxwell[i][i].upper >= m[i][i].lower);
        }
    }
}

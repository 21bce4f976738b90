//! The layer of section 3.2, pressed over its whole top: force against compression on a mesh of one's choice.
//!
//! `cargo run --release -p elastocap-mechanics --example layer_end -- free 16 0.5 8 0.02` takes the end
//! (`free` or `substrate`), quadrilaterals over the thickness, the ratio and the number of the rings around
//! the bonded corner, the compression between two rows and the last of them; with `folding` in the place of
//! `free`, and the quadrilaterals per thickness at the corner in the place of the ratio, the end may fold
//! through itself.

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::newton::NewtonSettings;

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| words.get(k).and_then(|w| w.parse().ok()).unwrap_or(default);
    let end = if words.get(1).is_some_and(|w| w == "substrate") { End::FreeOnSubstrate } else { End::Free };
    let folding = words.get(1).is_some_and(|w| w == "folding");
    let mut mesh = LayerMesh::uniform(
        1.0,
        4.0,
        number(2, 8.0) as usize,
        number(3, 0.5),
        number(4, 6.0).max(0.0) as usize,
    );
    if number(4, 6.0) < 0.0 {
        mesh.radii.clear();
    }
    if folding {
        mesh = LayerMesh::folding_end(1.0, 4.0, number(2, 8.0) as usize, number(3, 24.0) as usize, 0.3, 1.5);
    }
    let settings = if folding { NewtonSettings::through_folds() } else { NewtonSettings::default() };
    let rubber =
        Rubber { volume_barrier: if folding { 0.0 } else { number(7, 2.0) }, ..Rubber::neo_hookean(1.0) };
    let start = std::time::Instant::now();
    let mut model = match LayerModel::new(&mesh, rubber, Indenter::WholeTop, end) {
        Ok(model) => model,
        Err(error) => return eprintln!("{error}"),
    };
    let equations = model.equations();
    println!(
        "# {end:?}: {} elements, {} unknowns with the pressures, {} without, {} in the factor, {:.2} s",
        equations.body().mesh.elements.len(),
        equations.mixed_unknowns(),
        equations.unknowns(),
        equations.factor_entries(),
        start.elapsed().as_secs_f64()
    );
    let (step, last) = (number(5, 0.05), number(6, 0.4));
    for k in 1..=(last / step + 1e-9) as usize {
        match model.press(step * k as f64, &settings) {
            Ok(s) => {
                let (a, b) = (model.displacement_near([0.5, 0.5]), model.displacement_near([0.5, 1.0]));
                println!(
                    "{:.4} force {:.6} end {:.5} u1 {:.6} {:.6} | imbalance {:.0e} penetration {:.0e} J {:.3} solves {} steps {} cuts {} neg {} lin {:.0e} | {:.2} s",
                    s.compression,
                    s.force,
                    s.end_contact_force,
                    a[0],
                    b[0],
                    s.imbalance,
                    s.penetration,
                    s.effort.smallest_j,
                    s.effort.solves,
                    s.effort.steps,
                    s.effort.cuts,
                    s.effort.negative_pivots,
                    s.effort.linear_residual,
                    start.elapsed().as_secs_f64()
                );
            }
            Err(stopped) => {
                println!("{stopped} {:?}", stopped.effort);
                break;
            }
        }
    }
}

//! A flat punch on the layer of `flat-punch.toml`: half width 500/450 H, half length 6 H.
//!
//! `cargo run --release -p elastocap-mechanics --example layer_punch -- 0.02 1 0.05 0.4`
//! takes the corner radius over H (0 for a sharp punch), the refinement, the compression between two rows and the last.

use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::material::Rubber;
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::Shape;

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| words.get(k).and_then(|w| w.parse().ok()).unwrap_or(default);
    let (half_width, corner_radius) = (500.0 / 450.0, number(1, 0.02));
    let indenter = if corner_radius > 0.0 {
        Indenter::Smooth(Shape::Punch { half_width, corner_radius })
    } else {
        Indenter::Sharp { half_width }
    };
    let mesh = if corner_radius > 0.0 {
        LayerMesh::under_rounded_punch(1.0, 6.0, half_width, corner_radius, number(2, 8.0) as usize)
    } else {
        LayerMesh::under_punch(
            1.0,
            6.0,
            half_width,
            number(2, 8.0) as usize,
            number(6, 0.7),
            number(7, 6.0) as usize,
        )
    };
    let rubber = Rubber { volume_barrier: number(5, 2.0), ..Rubber::neo_hookean(1.0) };
    let start = std::time::Instant::now();
    let mut model = match LayerModel::new(&mesh, rubber, indenter, End::Free) {
        Ok(model) => model,
        Err(error) => return eprintln!("{error}"),
    };
    let equations = model.equations();
    println!(
        "# {indenter:?}: {} elements, {} unknowns with the pressures",
        equations.body().mesh.elements.len(),
        equations.mixed_unknowns(),
    );
    let (step, last) = (number(3, 0.05), number(4, 0.4));
    for k in 1..=(last / step + 1e-9) as usize {
        match model.press(step * k as f64, &NewtonSettings::default()) {
            Ok(s) => println!(
                "{:.4} force {:.6} | imbalance {:.0e} penetration {:.0e} J {:.3} solves {} steps {} cuts {} negative pivots {} | {:.2} s",
                s.compression,
                s.force,
                s.imbalance,
                s.penetration,
                s.effort.smallest_j,
                s.effort.solves,
                s.effort.steps,
                s.effort.cuts,
                s.effort.negative_pivots,
                start.elapsed().as_secs_f64()
            ),
            Err(stopped) => {
                println!("{stopped} {:?}", stopped.effort);
                break;
            }
        }
    }
}

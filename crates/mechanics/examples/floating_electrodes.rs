//! How far electrodes float with the layer: gap, height and thickness of an in-plane pair by finite elements
//! over those of the closed form, as the Markdown table of `docs/floating-electrodes.md`.
//!
//! `cargo run --release -p elastocap-mechanics --example floating_electrodes -- 8`
//! takes the level of the mesh: 5, 10, 20, 40 elements over the thickness for 0, 1, 2, 3.

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Inclusion, Indenter, LayerModel};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::{ElectrodePose, ElectrodeStiffness, LayerMap};

const HALF_LENGTH: f64 = 4.0;
const HEIGHT: f64 = 0.5;
const LENGTH: f64 = 0.67;
const LOADS: [f64; 2] = [0.1, 0.2];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n = std::env::args().nth(1).and_then(|w| w.parse().ok()).unwrap_or(8);
    println!(
        "| mu_e/mu | T/H | D/H | gap 10 % | gap 20 % | height 10 % | height 20 % | thickness 10 % | thickness 20 % |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for modulus in [1.0, 10.0, 100.0, 1e4, 1e6] {
        for thickness in [0.02, 0.05, 0.1] {
            for gap in [0.05, 0.11, 0.25] {
                let ratios = ratios(n, modulus, thickness, gap)?;
                let columns = (0..3).flat_map(|k| ratios.iter().map(move |r| format!("{:.3}", r[k])));
                println!("| {modulus} | {thickness} | {gap} | {} |", columns.collect::<Vec<_>>().join(" | "));
            }
        }
    }
    Ok(())
}

/// Gap, height and thickness over those of the closed form, load after load. Lengths are over the thickness
/// of the layer, moduli over its modulus.
fn ratios(
    n: usize,
    modulus: f64,
    thickness: f64,
    gap: f64,
) -> Result<Vec<[f64; 3]>, Box<dyn std::error::Error>> {
    let electrode = Inclusion {
        min: [0.5 * gap, HEIGHT - 0.5 * thickness],
        max: [0.5 * gap + LENGTH, HEIGHT + 0.5 * thickness],
        rubber: Rubber::neo_hookean(modulus),
    };
    let problem = PlaneLayer {
        thickness: 1.0,
        half_length: HALF_LENGTH,
        rubber: Rubber::neo_hookean(1.0),
        inclusions: vec![electrode.clone()],
        indenter: Indenter::WholeTop,
        position: 0.0,
        end: End::FreeOnSubstrate,
    };
    let (rubber, inclusions) = (&problem.rubber, &problem.inclusions);
    let mut model = LayerModel::with_inclusions(
        &problem.mesh(n, 0.3),
        rubber,
        inclusions,
        problem.indenter,
        problem.end,
    )?;
    LOADS
        .iter()
        .map(|&compression| {
            model.press(compression, &NewtonSettings::default())?;
            let map = LayerMap::new(1.0, compression)?;
            let pose = ElectrodePose::new(&map, 1.0, HEIGHT, ElectrodeStiffness::ShearModulus(modulus))?;
            let inner = mean(&model, &electrode, 0, electrode.min[0]);
            let [lower, middle, upper] = [electrode.min[1], HEIGHT, electrode.max[1]]
                .map(|height| mean(&model, &electrode, 1, height));
            Ok([
                2.0 * inner / pose.gap(gap),
                middle / pose.height,
                (upper - lower) / pose.thickness(thickness),
            ])
        })
        .collect()
}

/// Mean deformed coordinate `axis` over the line of the electrode where that coordinate was `at`, by the
/// trapezoidal rule.
fn mean(model: &LayerModel, electrode: &Inclusion, axis: usize, at: f64) -> f64 {
    let along = 1 - axis;
    let nodes = model.equations().body().mesh.nodes.iter().enumerate();
    let mut points: Vec<(f64, f64)> = nodes
        .filter(|(_, x)| {
            (x[axis] - at).abs() < 1e-9
                && x[along] > electrode.min[along] - 1e-9
                && x[along] < electrode.max[along] + 1e-9
        })
        .map(|(n, x)| (x[along], at + model.state().displacement[2 * n + axis]))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sum: f64 = points.windows(2).map(|p| 0.5 * (p[1].0 - p[0].0) * (p[0].1 + p[1].1)).sum();
    sum / (electrode.max[along] - electrode.min[along])
}

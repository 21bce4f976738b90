//! A flat punch on the layer of `flat-punch.toml`: half width 500/450 H, half length 6 H.
//!
//! `cargo run --release -p elastocap-mechanics --example layer_punch`
//! prints the force on three meshes for a punch with a corner radius of 0.02 H and for a held patch.
//! `... --example layer_punch -- rounded 3` and `... -- held 14` take one mesh: quadrilaterals per corner radius where they pass
//! it, rings around the corner.

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel, RoundedPunch};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::IndenterProfile;

const HALF_WIDTH: f64 = 500.0 / 450.0;
const RADIUS: f64 = 0.02;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let size =
        |default: &[f64]| words.get(1).and_then(|w| w.parse().ok()).map_or(default.to_vec(), |n| vec![n]);
    let kind = words.first().map_or("", String::as_str);
    if kind != "held" {
        for per_radius in size(&[0.375, 0.75, 1.5]) {
            let punch = RoundedPunch { half_width: HALF_WIDTH, corner_radius: RADIUS, position: 0.0 };
            let mesh = LayerMesh::under_rounded_punch(1.0, 6.0, &punch, 0.4, 8, per_radius);
            let punch = IndenterProfile::Punch { half_width: HALF_WIDTH, corner_radius: RADIUS };
            let settings =
                NewtonSettings { longest_move: 0.15 * RADIUS / per_radius, ..NewtonSettings::default() };
            table(&format!("{per_radius} per radius"), &mesh, Indenter::Smooth(punch), 20.0, &settings);
        }
    }
    if kind != "rounded" {
        for rings in size(&[8.0, 10.0, 14.0]) {
            let mesh = LayerMesh::under_punch(1.0, 6.0, [HALF_WIDTH, 0.5], 8, 0.7, rings as usize);
            let settings = NewtonSettings::default();
            table(
                &format!("{rings} rings"),
                &mesh,
                Indenter::Held { half_width: HALF_WIDTH },
                5.0,
                &settings,
            );
        }
    }
}

fn table(name: &str, mesh: &LayerMesh, indenter: Indenter, volume_barrier: f64, settings: &NewtonSettings) {
    let rubber = Rubber { volume_barrier, ..Rubber::neo_hookean(1.0) };
    let start = std::time::Instant::now();
    let mut model = match LayerModel::new(mesh, rubber, indenter, End::Free) {
        Ok(model) => model,
        Err(error) => return eprintln!("{error}"),
    };
    println!("# {indenter:?}, {name}: {} unknowns with the pressures", model.equations().mixed_unknowns());
    println!("U/H   force/(mu H w)  imbalance  penetration  smallest J  solves  negative pivots  s");
    for compression in [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4] {
        match model.press(compression, settings) {
            Ok(s) => println!(
                "{:.2}  {:.5}  {:.0e}  {:.0e}  {:.3}  {}  {}  {:.1}",
                s.compression,
                s.force,
                s.imbalance,
                s.penetration,
                s.effort.smallest_j,
                s.effort.solves,
                s.effort.negative_pivots,
                start.elapsed().as_secs_f64()
            ),
            Err(stopped) => return println!("{stopped}"),
        }
    }
}

//! A punch on a layer of finite width: force against compression.
//!
//! `cargo run --release -p elastocap-mechanics --example punch_3d -- held 6 0.5 0.1 0.3` takes the indenter
//! (`top`, `held`, `bonded`, `flat`, `cylinder`, `sphere`, `block`, or `plane-strain` for a held punch on a
//! layer that cannot spread along its width), about how many hexahedra go over the thickness, half the width
//! over the thickness, the compression between two rows and in the last, and what becomes of the end and the
//! side: `free` or `substrate`.
//!
//! 1. A quarter of a layer of half-length 3, bonded below. All lengths are in thicknesses.
//! 2. The flat punches are 500/450 wide to each side, as in the paper; cylinder and sphere have the radius
//!    1.5.
//! 3. Forces are those on the whole layer, over the shear modulus and the thickness squared.

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::mesh::{geometric, graded, uniform};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::space::layer::{SideCondition, SpaceLayerMesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| words.get(k).map_or(Ok(default), |w| w.parse::<f64>());
    let kind = words.get(1).map_or("held", |w| w.as_str());
    let (n, half_width) = (number(2, 3.0)? as usize, number(3, 0.5)?);
    let (length, corner, corner_radius) = (3.0, 500.0 / 450.0, 0.1);
    let coarse = 1.0 / n as f64;
    let (indenter, reach) = match kind {
        "top" => (Indenter::WholeTop, length - 1.0),
        "held" | "plane-strain" => (Indenter::Held { half_width: corner }, corner),
        "bonded" => (Indenter::Bonded { half_width: corner }, corner),
        "flat" => (Indenter::Smooth(IndenterProfile::Punch { half_width: corner, corner_radius }), corner),
        "cylinder" => (Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.5 }), 1.0),
        "sphere" => (Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 }), 1.0),
        "block" => {
            let half_widths = [corner, 0.6 * half_width];
            (Indenter::Smooth(IndenterProfile::Block { half_widths, corner_radius }), corner)
        }
        _ => {
            return Err(
                "the indenter is top, held, bonded, plane-strain, flat, cylinder, sphere or block".into()
            );
        }
    };
    let flat = matches!(indenter, Indenter::Held { .. } | Indenter::Bonded { .. });
    let section = if flat {
        LayerMesh::under_punch(1.0, length, [corner, 0.5], n, 0.7, 1)
    } else {
        // Finer where the surface bends around the indenter.
        let fine = if kind == "top" { coarse } else { 0.5 * coarse };
        LayerMesh {
            along: graded(0.0, length - 1.0, |x| (fine + 0.5 * (x - reach).abs()).min(coarse)),
            up: graded(0.0, 1.0, |y| (fine + 0.5 * (1.0 - y)).min(coarse)),
            end_top: uniform(length - 1.0, length, n.div_ceil(2)),
            radii: geometric(0.5, 1),
            punch: None,
        }
    };
    let mesh = SpaceLayerMesh::new(section, half_width, (half_width * n as f64).round() as usize);
    let side = if kind == "plane-strain" { SideCondition::Symmetric } else { SideCondition::Free };
    let end = if words.get(6).is_some_and(|w| w == "substrate") { End::FreeOnSubstrate } else { End::Free };
    let start = std::time::Instant::now();
    let mut model = LayerModel::of_finite_width(&mesh, Rubber::neo_hookean(1.0), indenter, end, side)?;
    let equations = model.equations();
    println!(
        "# {kind}: {} hexahedra, {} displacements, {} unknowns with the pressures, {:.1e} in the factor, {:.2} s",
        equations.body().mesh.elements.len(),
        equations.unknowns(),
        equations.mixed_unknowns(),
        equations.factor_entries() as f64,
        start.elapsed().as_secs_f64()
    );
    let (step, last) = (number(4, 0.1)?, number(5, 0.3)?);
    // Gaps of 1e-5 thicknesses where the pressure is the shear modulus change the force by less than 1e-4.
    let settings = NewtonSettings {
        tolerance: 1e-7,
        first_step: if flat || kind == "top" { 1.0 } else { 0.5 },
        moving_gap: 3e-3,
        final_gap: 1e-5,
        ..Default::default()
    };
    for k in 1..=(last / step + 1e-9) as usize {
        let s = model.press(step * k as f64, &settings)?;
        println!(
            "{:.4} force {:.6} | imbalance {:.0e} penetration {:.0e} J {:.3} steps {} cuts {} solves {} negative pivots {} | {:.2} s",
            s.compression,
            s.force,
            s.imbalance,
            s.penetration,
            s.effort.smallest_j,
            s.effort.steps,
            s.effort.cuts,
            s.effort.solves,
            s.effort.negative_pivots,
            start.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

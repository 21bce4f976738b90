//! The free end of section 3.2 on one mesh, with the rubber of the paper: force, stored energy and its slope.
//!
//! `cargo run --release -p elastocap-mechanics --example free_end -- 5 96 0.05 1.5 0.0025 0.06` takes
//! quadrilaterals over the thickness, those per thickness at the bonded corner, how far from it they stay
//! equal, the growth of the others, the compression between two rows and the last of them. Lengths are in
//! thicknesses, stresses in shear moduli; the slope is that over the row before and the next one, printed one
//! row late.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::dimension::Element;
use elastocap_mechanics::solid::element::ReferenceElement;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::newton::NewtonSettings;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| words.get(k).map_or(Ok(default), |w| w.parse::<f64>());
    let (n, cells) = (number(1, 5.0)? as usize, number(2, 96.0)? as usize);
    let layer = LayerMesh::folding_end(1.0, 4.0, n, cells, number(3, 0.05)?, number(4, 1.5)?);
    let (step, last) = (number(5, 0.0025)?, number(6, 0.06)?);
    let distortion = HyperelasticLaw::MooneyRivlin { c10: 0.007646, c01: 0.492354 };
    let rubber = Rubber { distortion, volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) };
    let mut model = LayerModel::new(&layer, rubber.clone(), Indenter::WholeTop, End::Free)?;
    let mesh = layer.mesh();
    let elements: Vec<ReferenceElement> = mesh
        .elements
        .iter()
        .filter_map(|e| ReferenceElement::new(&e.map(|n| mesh.nodes[n as usize])))
        .collect();
    println!("# {} elements, {} unknowns", elements.len(), model.equations().mixed_unknowns());
    println!("U/H      force     energy      slope of two rows    solves  negative pivots");
    let settings = NewtonSettings { first_step: 1.0, ..NewtonSettings::through_folds() };
    let mut energies = Vec::new();
    for k in 1..=(last / step + 1e-9) as usize {
        let found = model.press(step * k as f64, &settings)?;
        let u = &model.state().displacement;
        let of_element = |(element, nodes): (&ReferenceElement, &[u32; 9])| {
            let u: Vec<f64> =
                nodes.iter().flat_map(|&n| [u[2 * n as usize], u[2 * n as usize + 1]]).collect();
            element.energy(&rubber, &u, &[0.0; 3])
        };
        // That of the other half too.
        energies.push(2.0 * elements.iter().zip(&mesh.elements).map(of_element).sum::<f64>());
        let slope = match energies.as_slice() {
            [.., before, _, now] => {
                format!("{:.4} at {:.5}", (now - before) / (2.0 * step), step * (k - 1) as f64)
            }
            _ => String::new(),
        };
        println!(
            "{:.5}  {:.5}  {:.7}  {slope:18}  {}  {}",
            found.compression,
            found.force,
            energies[k - 1],
            found.effort.solves,
            found.effort.negative_pivots
        );
    }
    Ok(())
}

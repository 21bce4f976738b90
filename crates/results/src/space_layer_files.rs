//! Fields and profiles of the layer in three dimensions.

use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray};
use elastocap_mechanics::solid::dimension::Space;
use elastocap_mechanics::solid::layer::LayerModel;
use elastocap_mechanics::solid::press::Pressed;
use elastocap_mechanics::solid::space::stress::SpaceStress;

use super::csv::number;

/// The deformed quarter of the layer with its fields, and the content of `profile_NNN.csv`.
pub(super) fn of(model: &LayerModel<Space>, pressed: &Pressed<Space>) -> (BodyMesh, String) {
    let stress = model.equations().nodal_stress(&pressed.state);
    (body(model, pressed, &stress), profiles(model, pressed, &stress))
}

fn body(model: &LayerModel<Space>, pressed: &Pressed<Space>, stress: &[SpaceStress]) -> BodyMesh {
    let layer = model.equations().body();
    let displacement = &pressed.state.displacement;
    let array = |name, components, values: Vec<f64>| NamedArray { name, components, values };
    let at_nodes = |value: &dyn Fn(&SpaceStress) -> f64| stress.iter().map(value).collect::<Vec<f64>>();
    let moved = |(x, u): (&[f64; 3], &[f64])| std::array::from_fn(|k| x[k] + u[k]);
    let contact = model.contact_pressure(&pressed.state, &at_nodes(&|s| s.cauchy[1]));
    BodyMesh {
        element: Element::Hexahedron,
        points: layer.mesh.nodes.iter().zip(displacement.chunks_exact(3)).map(moved).collect(),
        nodes: layer.mesh.elements.iter().flatten().copied().collect(),
        arrays: vec![
            array("displacement", 3, displacement.clone()),
            array("cauchy_stress", 6, stress.iter().flat_map(|s| s.cauchy).collect()),
            array("pressure", 1, at_nodes(&SpaceStress::pressure)),
            array("J", 1, at_nodes(&|s| s.j)),
            array("contact_pressure", 1, contact),
        ],
        in_elements: Vec::new(),
        body_id: layer.material.iter().map(|m| i32::from(*m)).collect(),
        body_names: vec!["layer".to_owned()],
    }
}

/// Displacements and stresses along the bonded bottom, the top and the axis in the plane of symmetry
/// `x3 = 0`, and along the bottom and the top in the plane of symmetry `x1 = 0`.
fn profiles(model: &LayerModel<Space>, pressed: &Pressed<Space>, stress: &[SpaceStress]) -> String {
    let nodes = &model.equations().body().mesh.nodes;
    let top = nodes.iter().map(|x| x[1]).fold(0.0, f64::max);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * top;
    let mut out =
        "line,x1_m,x2_m,x3_m,u1_m,u2_m,u3_m,sigma11_pa,sigma22_pa,sigma33_pa,sigma12_pa,sigma23_pa,\
                   sigma13_pa,pressure_pa,j\n"
            .to_owned();
    // The name of each line, the two axes along which its position is fixed, and the position along these.
    let lines = [
        ("bottom", [1, 2], [0.0, 0.0]),
        ("top", [1, 2], [top, 0.0]),
        ("axis", [0, 2], [0.0, 0.0]),
        ("bottom-across", [0, 1], [0.0, 0.0]),
        ("top-across", [0, 1], [0.0, top]),
    ];
    for (name, fixed, at) in lines {
        let along = 3 - fixed[0] - fixed[1];
        let on = |n: &usize| (0..2).all(|k| near(nodes[*n][fixed[k]], at[k]));
        let mut line: Vec<usize> = (0..nodes.len()).filter(on).collect();
        line.sort_by(|&a, &b| nodes[a][along].total_cmp(&nodes[b][along]));
        for n in line {
            out.push_str(name);
            let invariants = [stress[n].pressure(), stress[n].j];
            let values = nodes[n].iter().chain(&pressed.state.displacement[3 * n..3 * n + 3]);
            for value in values.chain(&stress[n].cauchy).chain(&invariants) {
                out.push(',');
                out.push_str(&number(*value));
            }
            out.push('\n');
        }
    }
    out
}

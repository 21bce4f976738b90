//! Files of the finite-element layer: fields for viewers, profiles along lines, and a table of its errors.

use crate::output_files::{LAYER, PROFILE};
use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray, body_vtu};
use elastocap_geometry::export::vtk::pvd;
use elastocap_mechanics::solid::dimension::Dimension;
use elastocap_mechanics::solid::layer::LayerModel;
use elastocap_mechanics::solid::press::{Pressed, Pressing};
use elastocap_mechanics::solid::stress::{Fields, Sample};

use super::csv::{number, optional, quoted};
use super::space_layer_files;
use elastocap_coupling::deform::Solution;
use elastocap_coupling::outcome::Outcome;

/// The files of a finite-element layer, ready to be written.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LayerFiles {
    /// The name and the content of at_nodes file.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// Warnings about what the formats cannot hold.
    pub(crate) warnings: Vec<String>,
}

/// The files with the fields and profiles of the layer at every load that was reached.
pub(crate) fn files(solution: &Solution) -> LayerFiles {
    match solution {
        Solution::Plane(pressing) => files_of(pressing, |model, pressed| {
            let fields = model.equations().fields(&pressed.state);
            (body(model, pressed, &fields), profiles(model, &fields))
        }),
        Solution::Space(pressing) => files_of(pressing, space_layer_files::of),
    }
}

/// The files at every load that was reached, with body and profiles by `body_and_profiles`.
fn files_of<S: Dimension>(
    pressing: &Pressing<S>,
    body_and_profiles: impl Fn(&LayerModel<S>, &Pressed<S>) -> (BodyMesh, String),
) -> LayerFiles {
    let mut layer_files = LayerFiles::default();
    let mut series = Vec::new();
    for (index, pressed) in pressing.goals.iter().enumerate() {
        let Ok(pressed) = pressed else { continue };
        let (body, profiles) = body_and_profiles(pressing.model_of(pressed), pressed);
        match body_vtu(&body) {
            Ok(bytes) => {
                let name = LAYER.at(index);
                layer_files.files.push((name.clone(), bytes));
                series.push((pressed.step.compression, name));
            }
            Err(error) => {
                layer_files.warnings.push(format!("the layer of step {index} is not written: {error}"))
            }
        }
        layer_files.files.push((PROFILE.at(index), profiles.into_bytes()));
    }
    if !series.is_empty() {
        match pvd(&series) {
            Ok(text) => layer_files.files.push(("layer.pvd".to_owned(), text.into_bytes())),
            Err(error) => layer_files.warnings.push(format!("layer.pvd is not written: {error}")),
        }
    }
    layer_files
}

/// The deformed layer in plane strain with its fields.
fn body(model: &LayerModel, pressed: &Pressed, fields: &Fields<'_>) -> BodyMesh {
    let layer = model.equations().body();
    let samples: Vec<Sample> = (0..layer.mesh.nodes.len()).map(|n| fields.at_node(n)).collect();
    let array = |name, components, values: Vec<f64>| NamedArray { name, components, values };
    let at_nodes = |value: &dyn Fn(&Sample) -> f64| samples.iter().map(value).collect::<Vec<f64>>();
    let displacement =
        samples.iter().flat_map(|s| [s.displacement[0], s.displacement[1], 0.0]).collect::<Vec<_>>();
    let stress = samples
        .iter()
        .flat_map(|s| [s.stress.s11, s.stress.s22, s.stress.s33, s.stress.s12, 0.0, 0.0])
        .collect::<Vec<_>>();
    let mut body_names = vec!["layer".to_owned()];
    body_names.extend((1..layer.rubbers.len()).map(|k| format!("electrode {k}")));
    BodyMesh {
        element: Element::Quadrilateral,
        points: samples
            .iter()
            .map(|s| [s.reference[0] + s.displacement[0], s.reference[1] + s.displacement[1], 0.0])
            .collect(),
        nodes: layer.mesh.elements.iter().flatten().copied().collect(),
        arrays: vec![
            array("displacement", 3, displacement),
            array("cauchy_stress", 6, stress),
            array("pressure", 1, at_nodes(&|s| s.stress.pressure())),
            array("J", 1, at_nodes(&|s| s.stress.j)),
            array(
                "contact_pressure",
                1,
                model.contact_pressure(&pressed.state, &at_nodes(&|s| s.stress.s22)),
            ),
        ],
        in_elements: Vec::new(),
        body_id: layer.material.iter().map(|m| i32::from(*m)).collect(),
        body_names,
    }
}

/// The content of `profile_NNN.csv`: displacements and stresses along the bonded bottom, the top and the axis
/// of symmetry.
fn profiles(model: &LayerModel, fields: &Fields<'_>) -> String {
    let mesh = &model.equations().body().mesh;
    let top = mesh.nodes.iter().map(|x| x[1]).fold(0.0, f64::max);
    let tiny = 1e-9 * top;
    let mut out =
        "line,x1_m,x2_m,u1_m,u2_m,sigma11_pa,sigma22_pa,sigma12_pa,sigma33_pa,pressure_pa,j\n".to_owned();
    let mut line = |name: &str, samples: Vec<Sample>| {
        for s in samples {
            let t = s.stress;
            let values = [
                s.reference[0],
                s.reference[1],
                s.displacement[0],
                s.displacement[1],
                t.s11,
                t.s22,
                t.s12,
                t.s33,
                t.pressure(),
                t.j,
            ];
            out.push_str(name);
            for value in values {
                out.push(',');
                out.push_str(&number(value));
            }
            out.push('\n');
        }
    };
    line("bottom", fields.on_boundary(|x| x[1].abs() < tiny));
    line("top", fields.on_boundary(|x| (x[1] - top).abs() < tiny));
    line("axis", fields.on_boundary(|x| x[0].abs() < tiny));
    out
}

/// `mechanics.csv`: one line for at_nodes load step, with the force on at_nodes mesh.
pub(crate) fn table(outcome: &Outcome) -> String {
    let meshes = outcome.layer_meshes.len();
    let by_force =
        outcome.steps.iter().any(|s| matches!(s.load, elastocap_coupling::load_steps::StepLoad::ForceN(_)));
    let value = if by_force { "compression" } else { "force_n" };
    let mut out =
        "compression,force_n,relative_error_estimate,end_contact_force_n,penetration_m,smallest_j,residual,\
                   negative_pivots,load_steps,cut_backs,linear_systems,mesh"
            .to_owned();
    for k in 0..meshes {
        out.push_str(&format!(",{value}_on_mesh_{}", k + 1));
    }
    out.push_str(",status\n");
    for step in &outcome.steps {
        let (row, layer) = (&step.row, step.layer.as_ref());
        let mut fields = vec![optional(row.compression), optional(row.force_n)];
        let known = |value: &dyn Fn(&elastocap_coupling::deform::FiniteElementStep) -> Option<f64>| {
            optional(layer.and_then(value))
        };
        let count = |value: &dyn Fn(&elastocap_coupling::deform::FiniteElementStep) -> usize| {
            layer.map_or_else(String::new, |l| value(l).to_string())
        };
        fields.push(known(&|l| l.relative_error_estimate));
        fields.push(known(&|l| Some(l.end_contact_force_n)));
        fields.push(known(&|l| Some(l.penetration_m)));
        fields.push(known(&|l| Some(l.smallest_j)));
        fields.push(known(&|l| Some(l.residual)));
        fields.push(count(&|l| l.negative_pivots));
        fields.extend((0..3).map(|k| count(&|l| l.effort[k])));
        fields.push(count(&|l| l.mesh + 1));
        fields.extend((0..meshes).map(|k| known(&|l| l.refinement.get(k).copied())));
        fields.push(quoted(&row.status.to_string()));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}

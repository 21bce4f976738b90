//! Layers of foam with a law of force: by hand, by force and by compression, in the closed form and by finite
//! elements.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;

use crate::common::{NUMBERS_ONLY, parse, solve};

const CLOSED_FORM: &str = "[mechanics.closed_form]\ncontact_half_length = \"10 mm\"\ncontact_width = \"20 mm\"\n\
                           shear_length = \"10 mm\"";

/// The area of the contact, m^2.
const AREA: f64 = 4e-4;

fn hyperfoam(poisson_ratio: f64) -> String {
    format!(
        "[layer.material.hyperfoam]\nterms = [{{ shear_modulus = \"15 kPa\", exponent = 8.0, poisson_ratio = {poisson_ratio:?} }}]"
    )
}

/// A pad under a plate with 3 mm of foam between them.
fn pad(material: &str, mechanics: &str, load: &str) -> String {
    format!(
        r#"format = 1
[layer]
thickness = "3 mm"
half_length = "10 mm"
foam = {{ solid_permittivity = 5.0, solid_fraction = 0.15 }}
{material}
[electrodes.array]
on = "substrate"
pads = [1, 1]
size = ["20 mm", "20 mm"]
pitch = ["20 mm", "20 mm"]
thickness = "35 um"
[electrodes.array.common_plate]
on = "layer-top"
thickness = "50 um"
{mechanics}
[load]
{load}
[surroundings]
boundary = "open"
below = {{ relative_permittivity = 4.5, thickness = "1.6 mm" }}
[electrostatics]
relative_tolerance = 1e-2
"#
    )
}

/// Nominal pressure of the foam without lateral stress, in Pa: 2 mu / a (l^(-a nu - 1) - l^(a - 1)).
fn pressure(poisson_ratio: f64, compression: f64) -> f64 {
    let l: f64 = 1.0 - compression;
    2.0 * 15e3 / 8.0 * (l.powf(-8.0 * poisson_ratio - 1.0) - l.powf(7.0))
}

fn forces(outcome: &Outcome) -> Vec<f64> {
    outcome.steps.iter().map(|step| step.row.force_n.unwrap()).collect()
}

#[test]
fn a_hyperfoam_has_the_force_that_is_computed_by_hand_and_the_force_leads_back() {
    for ratio in [0.0, 0.2] {
        let by_compression = solve(&pad(&hyperfoam(ratio), CLOSED_FORM, "compression = [0.0, 0.25, 0.5]"));
        let found = forces(&by_compression);
        for (force, compression) in found.iter().zip([0.0, 0.25, 0.5]) {
            let exact = AREA * pressure(ratio, compression);
            assert!((force - exact).abs() <= 1e-12 * exact, "{ratio} {compression}: {force} {exact}");
        }
        let by_force = solve(&pad(
            &hyperfoam(ratio),
            CLOSED_FORM,
            &format!("force = [\"0 N\", \"{:e} N\", \"{:e} N\"]", found[1], found[2]),
        ));
        for (a, b) in by_compression.steps.iter().zip(&by_force.steps) {
            let (a, b) = (&a.row, &b.row);
            assert!((a.compression.unwrap() - b.compression.unwrap()).abs() < 1e-12);
            assert!((a.capacitance_f.unwrap() / b.capacitance_f.unwrap() - 1.0).abs() < 1e-9);
        }
        let rows: Vec<_> = by_compression.steps.iter().map(|step| step.row.capacitance_f.unwrap()).collect();
        // The change of two plates without an edge, whose field adds some per cent.
        let plates = |compression: f64| {
            let share = 0.15 / (1.0 - compression).powf(1.0 - 2.0 * ratio);
            let permittivity = (1.0 + share * (5f64.cbrt() - 1.0)).powi(3);
            8.854_187_8e-12 * permittivity * AREA / (3e-3 * (1.0 - compression))
        };
        let over = (rows[2] - rows[0]) / (plates(0.5) - plates(0.0));
        assert!(over > 1.0 && over < 1.1, "{ratio} {over}: {rows:?}");
    }
}

#[test]
fn what_holds_the_faces_is_in_the_error_of_a_foam_that_gets_wider_and_of_no_other() {
    let with_models = Options { model_error: true, ..NUMBERS_ONLY };
    let errors = |ratio: f64| {
        let case = parse(&pad(&hyperfoam(ratio), CLOSED_FORM, "force = [\"0 N\", \"3 N\"]"));
        let plan = Plan::new(&case, &with_models);
        let outcome = run(&case, &plan, &with_models, &Arc::new(AtomicBool::new(false)), &());
        let error = |step: &elastocap_coupling::outcome::StepResult| step.row.model_error_estimate.unwrap();
        (outcome.steps.iter().map(error).collect::<Vec<f64>>(), outcome.warnings)
    };
    let (even, warnings) = errors(0.0);
    assert_eq!(even, [0.0, 0.0]);
    assert!(!warnings.iter().any(|text| text.contains("holds it at its faces")), "{warnings:?}");
    let (wider, warnings) = errors(0.3);
    assert_eq!(wider[0], 0.0);
    assert!(wider[1] > 0.02 && wider[1] < 0.5, "{wider:?}");
    assert!(warnings.iter().any(|text| text.contains("holds it at its faces")), "{warnings:?}");
}

#[test]
fn finite_elements_of_a_foam_that_gets_no_wider_give_what_even_compression_gives() {
    let load = "compression = [0.0, 0.5]";
    let closed = solve(&pad(&hyperfoam(0.0), CLOSED_FORM, load));
    let elements = "[mechanics.plane_strain]\nend = \"free\"\nwidth = \"20 mm\"\nindenter = \"whole-top\"";
    let solid = "[mechanics.solid]\nend = \"free\"\nwidth = \"20 mm\"\nindenter = \"whole-top\"";
    for mechanics in [elements, solid] {
        let found = solve(&pad(&hyperfoam(0.0), mechanics, load));
        for (step, closed) in found.steps.iter().zip(&closed.steps) {
            let (row, closed) = (&step.row, &closed.row);
            let (force, exact) = (row.force_n.unwrap(), closed.force_n.unwrap());
            assert!((force - exact).abs() <= 1e-9 * exact, "{force} {exact}");
            let ratio = row.capacitance_f.unwrap() / closed.capacitance_f.unwrap();
            assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
        }
    }
}

const TABLE: &str = "[layer.material.foam_table]\ncompression = [0.0, 0.1, 0.5]\nloading = [\"0 kPa\", \"4 kPa\", \"6 kPa\"]\n\
                     unloading = [\"0 kPa\", \"2 kPa\", \"6 kPa\"]";

#[test]
fn a_measured_foam_has_the_force_of_its_loading_branch_and_a_note_of_the_other() {
    let text = pad(TABLE, CLOSED_FORM, "force = [\"0 N\", \"2 N\"]");
    let outcome = solve(&text);
    // 2 N on 4 cm^2 are 5 kPa, half way between the last two points.
    let row = &outcome.steps[1].row;
    assert!((row.compression.unwrap() - 0.3).abs() < 1e-12 && row.force_n == Some(2.0), "{row:?}");
    let note = outcome.plan.warnings.iter().find(|text| text.contains("the forces are those of loading"));
    let note = note.unwrap_or_else(|| panic!("{:?}", outcome.plan.warnings));
    assert!(note.contains("1.6000 N in place of 2.0000 N at U/H = 0.3000"), "{note}");
}

#[test]
fn a_load_beyond_the_table_fails_with_the_end_of_the_table() {
    for (load, words) in
        [("force = [\"2 N\", \"3 N\"]", "reaches only 2.4"), ("compression = [0.3, 0.6]", "ends at 0.5")]
    {
        let case = parse(&pad(TABLE, CLOSED_FORM, load));
        let plan = Plan::new(&case, &NUMBERS_ONLY);
        let outcome = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &());
        assert!(outcome.steps[0].row.status.is_ok(), "{:?}", outcome.steps[0].row);
        let Status::Failed(reason) = &outcome.steps[1].row.status else {
            panic!("{:?}", outcome.steps[1].row)
        };
        assert!(reason.to_string().contains(words), "{reason}");
    }
}

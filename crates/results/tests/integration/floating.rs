//! Floating conductors from the case file to the results.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_results::{FieldFiles, RunSeconds, csv, document};

#[test]
fn the_floating_plate_leaves_the_matrix_and_its_potential_is_reported() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/floating-plate.toml");
    let mut case = elastocap_case::load(&path).expect("a case");
    // The tolerance of 1e-3 in the file takes longer and checks no more.
    case.electrostatics.as_mut().unwrap().relative_tolerance = 2e-2;
    let options = Options { prune: true, fields: false, scene: false, model_error: false };
    let plan = Plan::new(&case, &options);
    assert!(
        plan.solved.iter().any(|p| p.part == "floating" && p.what.contains("`float`")),
        "{:?}",
        plan.solved
    );
    let outcome = run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &());
    assert!(outcome.is_complete(), "{:?}", outcome.steps[0].reason);
    assert_eq!(outcome.conductors, ["lower", "upper"]);
    let step = &outcome.steps[0];
    assert_eq!(step.maxwell.as_ref().unwrap().len(), 2);
    let spread = 2.0 * step.measured.unwrap().relative_error();
    assert!(spread <= 2e-2, "{spread}");

    let text = document(
        &case,
        &outcome,
        &FieldFiles::default(),
        Vec::new(),
        Vec::new(),
        RunSeconds::default(),
        None,
    )
    .unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for place in [&json, &json["steps"][0]] {
        let float = &place["floating_conductors"][0];
        assert_eq!((float["name"].as_str(), float["charge_c"].as_f64()), (Some("float"), Some(0.0)));
        let number = |key: &str, k: usize| float[key][k].as_f64().unwrap();
        let [below, above] = [0, 1].map(|k| number("potential_per_volt", k));
        // The scene is symmetric about its middle plane; some flux goes to infinity, so that the two do not
        // add up to one.
        assert!((below - above).abs() < 1e-6 && 0.4 < below && below < 0.5, "{below} {above}");
        assert!(
            number("potential_per_volt_lower", 0) < below && below < number("potential_per_volt_upper", 0)
        );
    }
    let table = csv::capacitance(&case, &outcome);
    assert!(!table.contains("float"), "{table}");
    let numbers = |quantity: &str| -> [f64; 3] {
        let row = table.lines().find(|line| line.starts_with(&format!("0,{quantity},lower,upper,"))).unwrap();
        let fields: Vec<f64> = row.split(',').skip(4).take(3).map(|field| field.parse().unwrap()).collect();
        fields.try_into().unwrap()
    };
    let ([value, lower, upper], entry) = (numbers("maxwell"), step.maxwell.as_ref().unwrap()[0][1]);
    assert_eq!([value, lower, upper], [entry.value, entry.lower, entry.upper]);
    assert!(lower < value && value < upper && upper < 0.0, "{table}");
    // The mutual capacitance is minus the entry: its bounds change places.
    assert_eq!(numbers("mutual"), [-value, -upper, -lower]);
}

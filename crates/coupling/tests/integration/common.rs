//! Case files as text, and their outcomes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::Case;
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;

pub(crate) const NUMBERS_ONLY: Options =
    Options { prune: true, fields: false, scene: false, model_error: false };

pub(crate) fn parse(text: &str) -> Case {
    elastocap_case::parse(text, Path::new("test.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The outcome of a case whose steps all meet their tolerances.
pub(crate) fn solve(text: &str) -> Outcome {
    let case = parse(text);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let outcome = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &());
    let reasons: Vec<_> = outcome.steps.iter().filter_map(|step| step.reason.as_ref()).collect();
    assert!(outcome.is_complete(), "{reasons:?}");
    outcome
}

/// A layer on a board with these electrodes, mechanics and load.
pub(crate) fn layer(electrodes: &str, mechanics: &str, tolerance: f64) -> String {
    format!(
        r#"format = 1
[layer]
thickness = "400 um"
half_length = "2 mm"
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "100 kPa"
{electrodes}
{mechanics}
[surroundings]
boundary = "open"
below = {{ relative_permittivity = 4.4, thickness = "500 um" }}
above = {{ relative_permittivity = 1.0, thickness = "open" }}
[electrostatics]
relative_tolerance = {tolerance}
"#
    )
}

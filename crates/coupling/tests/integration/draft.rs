//! Drafts: an interrupted run has one for each step whose load a mesh of the layer has reached.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::run::{Observer, run};

use crate::common::{NUMBERS_ONLY, parse};

/// An observer that stops a run when it reports these words.
struct StopAt<'a> {
    words: &'a str,
    cancel: Arc<AtomicBool>,
}

impl Observer for StopAt<'_> {
    fn preparing(&self, what: &str) {
        if what.contains(self.words) {
            self.cancel.store(true, Ordering::Relaxed);
        }
    }
}

/// The pair under a block of the same size, at rest and at 10 %, stopped when the layer reports these words.
fn stopped_at(words: &str) -> Outcome {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/found3");
    let case = parse(&std::fs::read_to_string(folder.join("pair-own-footprint.toml")).unwrap());
    let cancel = Arc::new(AtomicBool::new(false));
    let observer = StopAt { words, cancel: Arc::clone(&cancel) };
    run(&case, &Plan::new(&case, &NUMBERS_ONLY), &NUMBERS_ONLY, &cancel, &observer)
}

#[test]
fn a_run_stopped_while_the_layer_is_refined_has_a_capacitance_with_its_error_for_each_load_that_was_reached()
{
    // The third mesh, of some 8,000 unknowns, is the first that is large enough to have drafts.
    let words = "mesh 4: 1 of 2";
    let outcome = stopped_at(words);
    assert!(outcome.stopped, "{words}");
    let [rest, pressed] = outcome.steps.as_slice() else { panic!("two steps") };
    assert!(rest.row.status.is_ok(), "{words}: {:?}", rest.row.status);
    assert_eq!((&pressed.row.status, pressed.interrupted), (&Status::Draft, true), "{words}");
    let row = &pressed.row;
    assert!(row.mechanics_error_estimate.is_some_and(|error| error > 0.0), "{words}: {row:?}");
    // The finished run has 43.46 fF to 9.8e-3, and 34.56 mN to 2.6e-2.
    let [lower, upper] = row.capacitance_limits().unwrap();
    assert!(lower < 43.46e-15 && 43.46e-15 < upper && upper < 1.2 * lower, "{words}: {lower:e} {upper:e}");
    let force = row.force_n.unwrap();
    assert!((force / 34.56e-3 - 1.0).abs() < 0.1, "{words}: {force:e}");
}

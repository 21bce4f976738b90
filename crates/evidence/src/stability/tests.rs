//! Tests that verdicts distinguish wrong values from right ones.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops by panicking")]

use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use std::collections::BTreeSet;

use super::text::{Scene, Sensor, to};
use super::*;

const LIMIT: Duration = Duration::from_secs(60);

/// A cube in a box, with a claim that its capacitance is `truth`.
fn cube(truth: f64, tolerance: f64) -> Entry {
    let case = Scene::new().cube("cube", [0.0; 3], 1.0).grounded([-1.0; 3], [1.0; 3], to(tolerance));
    Entry::new("test", "cube", [case], move |out| {
        let truth = Truth::value(truth, 1e-10);
        Ok(vec![Claim::capacitance("capacitance", claim::terminals(out, 0)?, truth)])
    })
}

fn verdict(entry: &Entry) -> Verdict {
    entry.run(2, LIMIT, &AtomicBool::new(false)).verdict
}

#[test]
fn a_planted_wrong_truth_is_told_and_the_right_one_is_not() {
    let truth = truths::CUBE_IN_CUBE * VACUUM_PERMITTIVITY;
    assert_eq!(verdict(&cube(truth, 1e-3)), Verdict::Right);
    for wrong in [1.01, 0.99, -1.0, 0.0, f64::NAN] {
        let found = verdict(&cube(wrong * truth, 1e-3));
        assert!(
            matches!(&found, Verdict::Wrong(reason) if reason.contains("truth in")),
            "{wrong}: {found:?}"
        );
    }
}

#[test]
fn where_the_iteration_gives_up_nothing_is_stated_and_the_tolerance_is_not_reached() {
    // The iteration gives up on a jacket of this permittivity, which is all but a conductor: a cube of 1.5 m
    // has 569.06 pF. No bounds are stated then, so that nothing can be wrong.
    let jacketed = |truth: f64| {
        let scene = Scene::new().cube("cube", [0.0; 3], 1.0).dielectric(1e6, [-0.75; 3], [0.75; 3]);
        let case = scene.grounded([-1.0; 3], [1.0; 3], to(1e-3));
        Entry::new("test", "jacket", [case], move |out| {
            let truth = Truth::value(truth, 1e-10);
            Ok(vec![Claim::capacitance("capacitance", claim::terminals(out, 0)?, truth)])
        })
    };
    assert!(matches!(verdict(&jacketed(5.69e-10)), Verdict::NotReached(_)));
    assert!(matches!(verdict(&jacketed(4e-9)), Verdict::NotReached(_)));
}

#[test]
fn a_refusal_is_right_only_where_it_is_expected() {
    let touching = || Scene::new().cube("a", [0.0; 3], 1.0).cube("b", [1.0, 0.0, 0.0], 1.0).open(to(0.1));
    let expected = Entry::refused("test", "touching", touching());
    assert!(matches!(verdict(&expected), Verdict::Refused(reason) if reason.contains("touch")));
    let unexpected = Entry::new("test", "touching", [touching()], |_| Ok(Vec::new()));
    assert!(matches!(verdict(&unexpected), Verdict::Wrong(_)));
    let fine = Scene::new().cube("a", [0.0; 3], 1.0).open(to(0.5));
    assert!(matches!(verdict(&Entry::refused("test", "fine", fine)), Verdict::Wrong(_)));
}

#[test]
fn a_force_beyond_the_limit_is_no_number() {
    let entry = |expect| {
        let case = Sensor { tolerance: 0.1, ..Sensor::default() }.compressed(0.95).text();
        Entry { expect, ..Entry::new("test", "0.95", [case], |_| Ok(Vec::new())) }
    };
    assert!(matches!(verdict(&entry(Expect::Refusal)), Verdict::Refused(_)));
    assert!(matches!(verdict(&entry(Expect::Number)), Verdict::Wrong(_)));
}

#[test]
fn an_entry_that_takes_too_long_is_not_reached_and_a_stopped_one_is_stopped() {
    let report = cube(0.0, 1e-9).run(1, Duration::from_millis(1), &AtomicBool::new(false));
    assert!(matches!(report.verdict, Verdict::NotReached(reason) if reason.contains("not done within")));
    let report = cube(0.0, 1e-9).run(1, LIMIT, &AtomicBool::new(true));
    assert_eq!(report.verdict, Verdict::Stopped);
}

#[test]
fn the_catalogue_has_its_subjects_and_no_name_twice() {
    let entries = catalogue();
    let names: BTreeSet<_> = entries.iter().map(|e| (e.subject, e.name.as_str())).collect();
    assert_eq!(names.len(), entries.len());
    assert!(entries.len() >= 45);
    let subjects: BTreeSet<_> = entries.iter().map(|e| e.subject).collect();
    assert!(subjects.iter().all(|subject| entries.iter().filter(|e| e.subject == *subject).count() >= 2));
    assert!(entries.iter().any(|e| e.quick));
}

#[test]
fn the_table_has_a_line_for_each_claim() {
    let report = cube(1.0, 0.5).run(1, LIMIT, &AtomicBool::new(false));
    let text = csv(std::slice::from_ref(&report));
    assert_eq!(text.lines().count(), 2);
    let columns = text.lines().next().unwrap().split(',').count();
    assert_eq!(text.lines().nth(1).unwrap().split('"').next().unwrap().split(',').count(), columns - 1);
}

//! Checks that no case of the catalogue has a wrong answer.

use crate::support::Sandbox;

#[test]
fn no_quick_case_of_the_catalogue_is_wrong() {
    let sandbox = Sandbox::new();
    let output = sandbox.elastocap(&["stability", "--quick", "--limit", "60", "-o", "out"]);
    let wrong: Vec<_> = output.stdout.lines().filter(|line| line.contains("  WRONG  ")).collect();
    assert!(wrong.is_empty(), "{}", output.stdout);
    assert!(output.stdout.contains(" 0 WRONG"), "{}", output.stdout);
    let output = output.exits_with(0);
    let table = sandbox.table("out/stability.csv");
    for verdict in ["right", "refused"] {
        assert!(table.texts("verdict").contains(&verdict), "{}", output.stdout);
    }
}

#[test]
fn the_catalogue_can_be_listed_and_chosen_from() {
    let sandbox = Sandbox::new();
    let list = sandbox.elastocap(&["stability", "--list"]).exits_with(0).stdout;
    let some = sandbox.elastocap(&["stability", "--list", "--only", "LAYERS IN series"]).exits_with(0).stdout;
    assert!(some.lines().count() >= 3 && some.lines().all(|line| list.contains(line)), "{some}");
    let none = sandbox.elastocap(&["stability", "--only", "no such case"]).exits_with(2);
    assert!(none.stderr.contains("--list"), "{}", none.stderr);
    let one = sandbox.elastocap(&["stability", "--only", "1 : 1e3"]).exits_with(0).stdout;
    assert!(one.contains("1 right") && one.contains("1 of 1 cases"), "{one}");
}

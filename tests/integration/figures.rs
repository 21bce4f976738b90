//! Tests of `elastocap figures`.

use crate::support::Sandbox;

#[test]
fn tables_and_a_figure_are_drawn_where_asked() {
    let sandbox = Sandbox::new();
    let output = sandbox.elastocap(&["figures", "--only", "table-1,6", "-o", "out"]).exits_with(0);
    assert!(
        output.stdout.contains("7 files in out") && output.stdout.contains("figure-6c"),
        "{}",
        output.stdout
    );
    let table = sandbox.table("out/table-1.csv");
    let theta = table.numbers("theta_rad");
    assert_eq!(theta.len(), 7);
    assert!((theta[6] / 1.085507127197 - 1.0).abs() < 1e-9);
    let shear = sandbox.table("out/figure-6a.csv").numbers("sigma_12_over_mu_over_compression");
    assert!(shear.len() > 500 && shear.iter().all(|s| s.is_finite()));
    assert!(sandbox.read("out/figure-6a.svg").starts_with("<svg"));
}

#[test]
fn quiet_is_quiet_and_others_files_stay() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("out")).expect("a folder");
    std::fs::write(sandbox.path("out/mine.txt"), "mine").expect("a file");
    let output = sandbox.elastocap(&["figures", "--quiet", "--only", "table-2", "-o", "out"]).exits_with(0);
    assert_eq!((output.stdout.as_str(), output.stderr.as_str()), ("", ""));
    assert_eq!(sandbox.names("out"), ["mine.txt", "table-2.csv"]);
}

#[test]
fn what_there_is_can_be_listed_and_nothing_else_asked_for() {
    let sandbox = Sandbox::new();
    let all = sandbox.elastocap(&["figures", "--list"]).exits_with(0).stdout;
    assert_eq!(all.lines().count(), 12, "{all}");
    let none = sandbox.elastocap(&["figures", "--only", "8"]).exits_with(2);
    assert!(none.stderr.contains("shear-length"), "{}", none.stderr);
    assert!(sandbox.names("results").is_empty());
}

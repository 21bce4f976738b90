//! Tests of the files of a layer deformed by finite elements.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Load, Mechanics};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_results::{FieldWriter, OutputFolder, Request, csv, save};

#[test]
fn the_layer_on_the_substrate_has_its_force_and_its_files_in_the_order_of_the_case() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/layer-on-substrate.toml");
    let mut case = elastocap_case::load(&path).unwrap();
    let Some(Mechanics::PlaneStrain(model)) = &mut case.mechanics else { panic!("{:?}", case.mechanics) };
    model.relative_tolerance = 2e-2;
    case.load = Some(Load::Compression(vec![0.1, 0.0, 0.05]));
    let options = Options { prune: true, fields: true, scene: false, model_error: false };
    let plan = Plan::new(&case, &options);
    let target = tempfile::tempdir().unwrap();
    let folder = OutputFolder::open(target.path()).unwrap();
    let never = Arc::new(AtomicBool::new(false));
    let writer = FieldWriter::new(&folder, &());
    let outcome = run(&case, &plan, &options, &never, &writer);
    let fields = writer.finish(&outcome).unwrap();
    assert!(outcome.is_complete(), "{}", csv::curve(&outcome));
    let force = |k: usize| outcome.steps[k].row.force_n.unwrap();
    // Reference values from one code, with contact by penalty: 0.7735 N and 1.762 N, to 1 %.
    assert!((force(0) / 1.762 - 1.0).abs() < 1e-2 && (force(2) / 0.7735 - 1.0).abs() < 1e-2);
    assert_eq!(force(1), 0.0);
    let saved = save(
        &case,
        &outcome,
        &options,
        &Request::of(&options),
        &folder,
        &fields,
        std::time::Instant::now(),
        std::time::Duration::ZERO,
    )
    .unwrap();
    let names: Vec<_> =
        saved.files.iter().map(|f| f.file_name().unwrap().to_string_lossy().into_owned()).collect();
    for name in
        ["mechanics.csv", "layer_000.vtu", "layer_002.vtu", "profile_001.csv", "layer.pvd", "curve.svg"]
    {
        assert!(names.iter().any(|n| n == name), "{name} is not among {names:?}");
    }
    // Shear along the bonded bottom: zero on the axis, outwards beside it.
    let text = std::fs::read_to_string(target.path().join("profile_000.csv")).unwrap();
    let shear: Vec<f64> = text
        .lines()
        .filter(|l| l.starts_with("bottom,"))
        .map(|l| l.split(',').nth(7).unwrap().parse().unwrap())
        .collect();
    assert!(shear.len() > 20 && shear[0].abs() < 0.02 * shear[shear.len() / 2].abs());
}

#[test]
fn a_layer_in_space_writes_its_fields() {
    let text = "format = 1\n[layer]\nthickness = \"1 mm\"\nhalf_length = \"1.6 mm\"\n[layer.material.neo_hookean]\n\
        shear_modulus = \"100 kPa\"\nbulk_modulus = \"10 MPa\"\n[mechanics.solid]\nrelative_tolerance = 5e-2\n\
        end = \"free-on-substrate\"\nindenter = \"whole-top\"\nwidth = \"0.8 mm\"\n[load]\ncompression = [0.05]\n";
    let case = elastocap_case::parse(text, Path::new("short.toml")).unwrap();
    let options = Options { prune: true, fields: true, scene: false, model_error: false };
    let plan = Plan::new(&case, &options);
    let place = tempfile::tempdir().unwrap();
    let folder = OutputFolder::open(&place.path().join("out")).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let writer = FieldWriter::new(&folder, &());
    let outcome = run(&case, &plan, &options, &stop, &writer);
    writer.finish(&outcome).unwrap();
    assert!(outcome.warnings.is_empty(), "{:?}", outcome.warnings);
    let files = folder.staged();
    assert_eq!(files, ["layer.pvd", "layer_000.vtu", "profile_000.csv"]);
}

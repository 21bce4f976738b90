//! The six-step curve of `cases/in-plane-pair.toml` within one process: everything that `elastocap run` does.
//!
//!     cargo bench --bench curve

mod common;

use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use criterion::{Criterion, SamplingMode};
use elastocap_case::Case;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_results::{FieldWriter, OutputFolder, Request, save};

/// The numbers alone.
fn numbers(case: &Case) -> common::Result<usize> {
    let options = Options { fields: false, scene: false, ..Options::default() };
    let plan = Plan::new(case, &options);
    let cancel = Arc::new(AtomicBool::new(false));
    Ok(run(case, &plan, &options, &cancel, &()).steps.len())
}

/// Reading, solving, writing every file.
fn everything(folder: &std::path::Path) -> common::Result<usize> {
    let started = Instant::now();
    let case = common::load("in-plane-pair.toml")?;
    let options = Options::default();
    let folder = OutputFolder::open(folder)?;
    let plan = Plan::new(&case, &options);
    let cancel = Arc::new(AtomicBool::new(false));
    let planning = started.elapsed();
    let writer = FieldWriter::new(&folder, &());
    let outcome = run(&case, &plan, &options, &cancel, &writer);
    let fields = writer.finish(&outcome)?;
    let request = Request::of(&options);
    Ok(save(&case, &outcome, &options, &request, &folder, &fields, started, planning)?.files.len())
}

fn main() -> common::Result<()> {
    common::two_threads()?;
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5))
        .without_plots()
        .configure_from_args();
    let case = common::load("in-plane-pair.toml")?;
    let folder = tempfile::tempdir()?;
    let mut group = criterion.benchmark_group("six-step curve");
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function("numbers", |bencher| bencher.iter(|| numbers(black_box(&case))));
    group.bench_function("every output", |bencher| bencher.iter(|| everything(black_box(folder.path()))));
    group.finish();
    criterion.final_summary();
    Ok(())
}

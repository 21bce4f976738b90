//! The field solver alone, on one thread pool of two threads.
//!
//!     cargo bench --bench solver
//!     cargo bench --bench solver -- "in-plane pair"

mod common;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode};
use elastocap_electrostatics::solve;

fn main() -> common::Result<()> {
    common::two_threads()?;
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .without_plots()
        .configure_from_args();
    for (known, accuracy, _) in common::solver_targets()? {
        let (settings, _) = accuracy.reached_on(&known)?;
        let mut group = criterion.benchmark_group(known.name);
        group.sampling_mode(SamplingMode::Flat);
        group.bench_function(BenchmarkId::from_parameter(accuracy.label()), |bencher| {
            bencher.iter(|| solve(black_box(&known.scene), black_box(&settings)));
        });
        group.finish();
    }
    criterion.final_summary();
    Ok(())
}

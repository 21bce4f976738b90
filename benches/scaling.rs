//! Time against unknowns: the primal problem of the unloaded in-plane pair at fixed resolutions.
//!
//!     cargo bench --bench scaling
//!     ELASTOCAP_LARGE=1 cargo bench --bench scaling     (up to ten million unknowns: some GB, some minutes)

mod common;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput};
use elastocap_electrostatics::solve;

fn main() -> common::Result<()> {
    common::two_threads()?;
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(2))
        .without_plots()
        .configure_from_args();
    let known = common::Known::in_plane_pair()?;
    let large = std::env::var_os("ELASTOCAP_LARGE").is_some();
    let mut group = criterion.benchmark_group("unknowns");
    group.sampling_mode(SamplingMode::Flat);
    for layers in common::SCALING.into_iter().chain(common::LARGE.into_iter().filter(|_| large)) {
        let settings = common::with_layers(layers);
        let unknowns = solve(&known.scene, &settings)?.unknowns;
        group.throughput(Throughput::Elements(unknowns as u64));
        group.bench_function(BenchmarkId::from_parameter(unknowns), |bencher| {
            bencher.iter(|| solve(black_box(&known.scene), black_box(&settings)));
        });
    }
    group.finish();
    criterion.final_summary();
    Ok(())
}

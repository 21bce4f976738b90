//! The layer by finite elements: three runs whose times are aimed at, on two threads.
//!
//!     cargo bench --bench mechanics
//!     cargo bench --bench mechanics -- --quick plane      (without the punch in space)
//!
//! 1. The layer on its substrate at the size of the paper's mesh (22,902 unknowns) to 40 %: 30 s asked.
//! 2. Its force at 20 % good to 0.5 %, on as many meshes as that takes: 1 s asked.
//! 3. A held patch on a layer of finite width, a quarter of it with about 60,000 displacements, to 30 %: 120
//!    s asked. Taken once, since it is long, and printed.

mod common;

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use criterion::{Criterion, SamplingMode};
use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, Refinement};
use elastocap_mechanics::solid::space::layer::{SideCondition, SpaceLayerMesh};

/// Unknowns, and the force at 40 %.
fn to_forty_per_cent(mesh: &LayerMesh) -> common::Result<(usize, f64)> {
    let rubber = Rubber::neo_hookean(1.0);
    let mut model = LayerModel::new(mesh, rubber, Indenter::WholeTop, End::FreeOnSubstrate)?;
    let step = model.press(0.4, &NewtonSettings::default())?;
    Ok((model.equations().mixed_unknowns(), step.force))
}

/// Stated relative error of the force at 20 %.
fn force_to_half_a_per_cent(layer: &PlaneLayer) -> common::Result<f64> {
    let (goals, never) = ([Goal::Compression(0.2)], AtomicBool::new(false));
    let mut pressing = layer.press(&goals, &Refinement::to(5e-3), None, &never, &|_, _| ())?;
    let found = pressing.goals.remove(0)?;
    if !found.converged {
        return Err("the force is not known to 0.5 %".into());
    }
    Ok(found.error.unwrap_or(f64::NAN) / found.step.force)
}

/// Displacements, and the force at 30 %.
fn punch_in_space() -> common::Result<(usize, f64)> {
    let (corner, n, half_width) = (500.0 / 450.0, 14, 0.5);
    let section = LayerMesh::under_punch(1.0, 3.0, [corner, 0.5], n, 0.7, 1);
    let mesh = SpaceLayerMesh::new(section, half_width, (half_width * n as f64).round() as usize);
    let indenter = Indenter::Held { half_width: corner };
    let mut model = LayerModel::of_finite_width(
        &mesh,
        Rubber::neo_hookean(1.0),
        indenter,
        End::Free,
        SideCondition::Free,
    )?;
    // Gaps of 1e-5 thicknesses where the pressure is the shear modulus change the force by less than 1e-4.
    let settings = NewtonSettings {
        tolerance: 1e-7,
        first_step: 1.0,
        moving_gap: 3e-3,
        final_gap: 1e-5,
        ..Default::default()
    };
    let mut force = 0.0;
    for compression in [0.1, 0.2, 0.3] {
        force = model.press(compression, &settings)?.force;
    }
    Ok((model.equations().unknowns(), force))
}

fn main() -> common::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(()); // `cargo test --benches` only asks whether it starts.
    }
    common::two_threads()?;
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(5))
        .without_plots()
        .configure_from_args();
    let mesh = LayerMesh::uniform(1.0, 4.0, 24, 0.7, 8);
    let layer = PlaneLayer {
        thickness: 1.0,
        half_length: 4.0,
        rubber: Rubber::neo_hookean(1.0),
        inclusions: Vec::new(),
        indenter: Indenter::WholeTop,
        position: 0.0,
        end: End::FreeOnSubstrate,
    };
    let (unknowns, force) = to_forty_per_cent(&mesh)?;
    println!("layer on its substrate: {unknowns} unknowns, force at 40 % {force:.3} mu H w");
    println!("force at 20 %: stated relative error {:.1e}", force_to_half_a_per_cent(&layer)?);
    let mut group = criterion.benchmark_group("plane strain");
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function("to 40 %", |bencher| bencher.iter(|| to_forty_per_cent(black_box(&mesh))));
    group.bench_function("20 % to 0.5 %", |bencher| {
        bencher.iter(|| force_to_half_a_per_cent(black_box(&layer)));
    });
    group.finish();
    criterion.final_summary();
    if !std::env::args().any(|argument| argument == "plane") {
        let start = Instant::now();
        let (displacements, force) = punch_in_space()?;
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "held patch in space: {displacements} displacements, {seconds:.1} s to 30 %, force {force:.4} mu H^2"
        );
    }
    Ok(())
}

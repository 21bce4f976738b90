//! Support for the tests: a pair of electrodes, points of its curve with noise, and reproducible random
//! numbers.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Correction, MeasuredLoad, MeasuredPoint, MeasuredPoints};
use elastocap_fitting::curves::Curves;
use elastocap_fitting::parameter::{Free, Parameter, parameters};

/// The case in the documentation, with steps and tolerance as given.
pub(crate) fn pair(tolerance: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/fits/pair.toml");
    let text = std::fs::read_to_string(path).expect("the case");
    let (text, _) = text.split_once("[measurement]").expect("measured points");
    text.replace("relative_tolerance = 1e-3", &format!("relative_tolerance = {tolerance}"))
}

pub(crate) fn parse(text: &str) -> Case {
    elastocap_case::parse(text, Path::new("pair.toml")).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn curves(text: &str) -> Curves {
    Curves::new(text, Path::new("pair.toml"), MeasuredLoad::Force, Arc::new(AtomicBool::new(false)))
}

pub(crate) fn free(text: &str, names: &[&str], measured: &MeasuredPoints) -> Vec<Parameter> {
    let free: Vec<Free> = names.iter().map(|name| name.parse().expect("a name")).collect();
    parameters(&free, text, Some(measured)).expect("keys of the case")
}

/// Points of a corrected curve at these loads, without noise.
pub(crate) fn points(
    curves: &Curves,
    values: &[(&str, String)],
    loads: impl Iterator<Item = f64>,
    correction: Correction,
) -> MeasuredPoints {
    let solved = curves.curve(values).expect("the true curve");
    let point = |(k, load): (usize, f64)| {
        let value = solved.curve.at(load - correction.offset).expect("a load on the curve");
        let capacitance = correction.gain * value.capacitance + correction.parasitic;
        MeasuredPoint { line: k as u64 + 2, load, capacitance, deviation: None }
    };
    MeasuredPoints {
        file: "points.csv".to_owned(),
        load: MeasuredLoad::Force,
        points: loads.enumerate().map(point).collect(),
        correction: Correction::default(),
    }
}

/// Normal random numbers of variance one.
pub(crate) fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    move || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

pub(crate) fn with_noise(
    measured: &MeasuredPoints,
    noise: f64,
    normal: &mut impl FnMut() -> f64,
) -> MeasuredPoints {
    let mut noisy = measured.clone();
    noisy.points.iter_mut().for_each(|point| point.capacitance += noise * normal());
    noisy
}

//! Prints the table of `mechanics::punch_force`: F / (mu U w) of a sharp flat punch without friction on a
//! long layer, with the largest relative error of each row.
//!
//! `cargo run --release -p elastocap-mechanics --example punch_forces [HALF_WIDTH ...]`

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::punch_force::{COMPRESSIONS, HALF_WIDTHS};
use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::plane::press::{PlaneLayer, sharp_punch};
use elastocap_mechanics::solid::press::{Goal, Refinement};

/// Length of the layer beyond the punch, in thicknesses: four would change forces by less than a thousandth.
const BEYOND: f64 = 6.0;

/// Relative error to reach.
const TOLERANCE: f64 = 5e-3;

fn main() {
    let half_widths: Vec<f64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let goals = COMPRESSIONS.map(Goal::Compression);
    for half_width in if half_widths.is_empty() { HALF_WIDTHS.to_vec() } else { half_widths } {
        let layer = PlaneLayer {
            thickness: 1.0,
            half_length: half_width + BEYOND,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: sharp_punch(half_width, 1.0),
            position: 0.0,
            end: End::Free,
        };
        let start = std::time::Instant::now();
        let pressing = match layer.press(
            &goals,
            &Refinement::to(TOLERANCE),
            None,
            &AtomicBool::new(false),
            &|_, _| (),
        ) {
            Ok(pressing) => pressing,
            Err(error) => return eprintln!("{half_width}: {error}"),
        };
        let mut row = Vec::new();
        let mut largest: f64 = 0.0;
        for (compression, goal) in COMPRESSIONS.iter().zip(&pressing.goals) {
            match goal {
                Ok(pressed) => {
                    row.push(format!("{:.4}", pressed.step.force / compression));
                    largest =
                        largest.max(pressed.error.map_or(f64::INFINITY, |error| error / pressed.step.force));
                }
                Err(error) => row.push(format!("{error}")),
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        println!("    [{}], // {half_width}: +- {largest:.1e}, {seconds:.0} s", row.join(", "));
    }
}

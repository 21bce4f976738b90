//! A sharp punch in contact on a layer of thickness 1, free end 5 thicknesses beyond it, and punches with
//! rounded corners that tend to it.
//!
//! `cargo run --release -p elastocap-mechanics --example sharp_punch -- HALF_WIDTH TOLERANCE [RADIUS ...] :
//! COMPRESSION ...`
//!
//! `HALF_WIDTH@POSITION` moves the punches off the middle of the layer, in thicknesses.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter};
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::plane::press::{PlaneLayer, sharp_punch};
use elastocap_mechanics::solid::press::{Goal, Refinement};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let numbers = |words: &[String]| words.iter().filter_map(|w| w.parse().ok()).collect::<Vec<f64>>();
    let (before, after) = words.split_at(words.iter().position(|w| w == ":").unwrap_or(words.len()));
    let usage = "usage: HALF_WIDTH[@POSITION] TOLERANCE [RADIUS ...] : COMPRESSION ...";
    let [punch, before @ ..] = before else { return eprintln!("{usage}") };
    let (half_width, position) = punch.split_once('@').unwrap_or((punch, "0"));
    let (Ok(half_width), Ok(position)) = (half_width.parse::<f64>(), position.parse::<f64>()) else {
        return eprintln!("{usage}");
    };
    let (first, compressions) = (numbers(before), numbers(after));
    let [relative_tolerance, radii @ ..] = first.as_slice() else { return eprintln!("{usage}") };
    let rounded = radii.iter().map(|&corner_radius| {
        (
            format!("radius {corner_radius}"),
            Indenter::Smooth(IndenterProfile::Punch { half_width, corner_radius }),
        )
    });
    let sharp = ("sharp".to_owned(), sharp_punch(half_width, 1.0));
    for (name, indenter) in std::iter::once(sharp).chain(rounded) {
        let layer = PlaneLayer {
            thickness: 1.0,
            half_length: half_width + 5.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter,
            position,
            end: End::Free,
        };
        let goals: Vec<Goal> = compressions.iter().map(|&c| Goal::Compression(c)).collect();
        let start = std::time::Instant::now();
        let refinement = Refinement::to(*relative_tolerance);
        match layer.press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()) {
            Ok(pressing) => {
                for (compression, goal) in compressions.iter().zip(&pressing.goals) {
                    match goal {
                        Ok(p) => {
                            let error = p.error.map_or(f64::NAN, |e| e / p.step.force);
                            let forces: Vec<String> =
                                p.refinement.iter().map(|f| format!("{f:.5}")).collect();
                            println!("{name}: {compression} {} +- {error:.1e}", forces.join(" "));
                        }
                        Err(error) => println!("{name}: {compression} {error}"),
                    }
                }
                println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
            }
            Err(error) => println!("{name}: {error}"),
        }
    }
}

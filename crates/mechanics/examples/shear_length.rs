//! The shear length L/H of the closed form over compression and contact length, from finite elements.
//!
//! `cargo run --release -p elastocap-mechanics --example shear_length -- 8` takes the quadrilaterals over the
//! thickness.

use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::shear_length::{Contact, shear_lengths};

fn main() {
    let n = std::env::args().nth(1).and_then(|w| w.parse().ok()).unwrap_or(8);
    let compressions = [0.01, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4];
    let punches = [0.25, 0.5, 1.0, 500.0 / 450.0, 2.0, 3.0, 4.0].map(|a| (Contact::Punch(a), End::Free));
    let ends = [End::Free, End::FreeOnSubstrate].map(|end| (Contact::WholeTop(4.0), end));
    for (contact, end) in punches.into_iter().chain(ends) {
        let start = std::time::Instant::now();
        match shear_lengths(contact, end, &compressions, n, None) {
            Ok(found) => {
                println!("{contact:?} {end:?} {:.2} s", start.elapsed().as_secs_f64());
                println!("  fans differ by {:.4?}", found.disagreement);
                for point in &found.points {
                    let (p, fan) = (point.shear, point.fan);
                    println!(
                        "  {:.2} fan {fan}: balance {:.4?} force {:.4?} N {:.5} F {:.5}",
                        p.compression, p.from_balance, p.from_force, p.axial_force, p.force
                    );
                }
                if let Some(stopped) = found.stopped {
                    println!("  {stopped}");
                }
            }
            Err(error) => println!("{contact:?}: {error}"),
        }
    }
}

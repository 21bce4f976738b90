//! Cases that cannot be answered and must be refused.

use super::super::Entry;
use super::super::text::{GROUNDED, Scene, Sensor, to};

const SUBJECT: &str = "refusals";

pub(super) fn entries() -> Vec<Entry> {
    let scene = Scene::new;
    let pair = |min: [f64; 3], max: [f64; 3]| {
        scene().conductor("first", [0.0; 3], [1.0; 3]).conductor("second", min, max).open(to(1e-3))
    };
    let refused = |name: &str, case: String| Entry::refused(SUBJECT, name, case);
    let sensor = Sensor::default;
    let closing = Sensor { stacked: true, thickness: 100e-6, modulus: None, ..sensor() };
    let short = Sensor { contact: 2e-3, ..sensor() };
    let flush =
        Sensor { height: sensor().layer - 0.5 * sensor().thickness, above: GROUNDED.to_owned(), ..sensor() };
    let grounded_cube = scene().cube("cube", [0.0; 3], 1.0);
    vec![
        refused("conductors that share a face", pair([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])),
        refused("conductors that share an edge", pair([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])),
        refused("conductors that share a corner", pair([1.0; 3], [2.0; 3])),
        refused("conductor in another", pair([0.25; 3], [0.75; 3])),
        refused(
            "conductor on a grounded wall",
            grounded_cube.clone().grounded([-0.5; 3], [1.0; 3], to(1e-3)),
        ),
        refused("conductor through a wall", grounded_cube.clone().grounded([-0.4; 3], [1.0; 3], to(1e-3))),
        refused("conductor alone in insulated walls", grounded_cube.insulated([-1.0; 3], [1.0; 3], to(1e-3))),
        refused("electrode on a grounded plane", flush.text()),
        refused("electrodes out of the layer", Sensor { height: 445e-6, ..sensor() }.text()),
        refused("plates that meet at 0.6", closing.compressed(0.6).text()),
        refused("contact that pulls from the start", short.compressed(0.1).text()),
        refused("compression 1", sensor().compressed(1.0).text()),
        refused("compression below 0", sensor().compressed(-1e-12).text()),
        refused("tensile force", sensor().pressed(-1e-12).text()),
        refused("layer of 1e10 m", Sensor { layer: 1e10, ..sensor() }.text()),
        refused("electrodes of 1e-16 m", Sensor { thickness: 1e-16, ..sensor() }.text()),
        refused("permittivity 0", Scene::new().cube("c", [0.0; 3], 1.0).open_in(0.0, to(1e-3))),
        refused("permittivity -1", Scene::new().cube("c", [0.0; 3], 1.0).open_in(-1.0, to(1e-3))),
        refused("tolerance 0", Scene::new().cube("c", [0.0; 3], 1.0).open(to(0.0))),
        refused("tolerance 1", Scene::new().cube("c", [0.0; 3], 1.0).open(to(1.0))),
    ]
}

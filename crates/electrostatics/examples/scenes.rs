//! scratch
use elastocap_electrostatics::*;
use elastocap_geometry::scene::*;
fn b(min: [f64; 3], max: [f64; 3]) -> Box3 {
    Box3 { min, max }
}
fn c(name: &str, region: Box3) -> Conductor {
    Conductor { name: name.into(), region }
}
fn main() {
    let arg: Vec<String> = std::env::args().collect();
    let um = 1e-6;
    let inf = f64::INFINITY;
    let (scene, exact) = match arg[1].as_str() {
        "cube" => (
            BoxScene {
                conductors: vec![c("a", b([0.; 3], [1.; 3]))],
                dielectrics: vec![],
                background_permittivity: 1.,
                domain: Box3::SPACE,
                walls: [[Wall::Open; 2]; 3],
            },
            7.351035848e-11,
        ),
        "cubes" => (
            BoxScene {
                conductors: vec![c("a", b([-0.5; 3], [0.5; 3]))],
                dielectrics: vec![],
                background_permittivity: 1.,
                domain: b([-1.; 3], [1.; 3]),
                walls: [[Wall::Grounded; 2]; 3],
            },
            1.6935524558e-10,
        ),
        "plates" => (
            BoxScene {
                conductors: vec![c("a", b([0.; 3], [1., 0., 1.])), c("b", b([0., 0.1, 0.], [1., 0.1, 1.]))],
                dielectrics: vec![],
                background_permittivity: 1.,
                domain: Box3::SPACE,
                walls: [[Wall::Open; 2]; 3],
            },
            1.1560932707e-10,
        ),
        "stacked" => (
            BoxScene {
                conductors: vec![
                    c("a", b([-500. * um, 115. * um, -500. * um], [500. * um, 125. * um, 500. * um])),
                    c("b", b([-500. * um, 325. * um, -500. * um], [500. * um, 335. * um, 500. * um])),
                ],
                dielectrics: vec![
                    Dielectric {
                        name: "board".into(),
                        region: b([-inf, -1600. * um, -inf], [inf, 0., inf]),
                        relative_permittivity: 4.5,
                    },
                    Dielectric {
                        name: "layer".into(),
                        region: b([-inf, 0., -inf], [inf, 450. * um, inf]),
                        relative_permittivity: 2.8,
                    },
                ],
                background_permittivity: 1.,
                domain: Box3::SPACE,
                walls: [[Wall::Open; 2]; 3],
            },
            1.0,
        ),
        "diel" => (
            BoxScene {
                conductors: vec![c("a", b([0.1; 3], [0.1, 0.5, 0.5]))],
                dielectrics: vec![Dielectric {
                    name: "m".into(),
                    region: b([-0.2, 0.2, -0.3], [1.9, 2.2, 1.3]),
                    relative_permittivity: 20.0,
                }],
                background_permittivity: 1.,
                domain: b([-inf; 3], [inf, 3.6, inf]),
                walls: [[Wall::Open; 2], [Wall::Open, Wall::Insulated], [Wall::Open; 2]],
            },
            1.0,
        ),
        _ => (
            BoxScene {
                conductors: vec![
                    c("l", b([-325. * um, 215. * um, -250. * um], [-25. * um, 235. * um, 250. * um])),
                    c("r", b([25. * um, 215. * um, -250. * um], [325. * um, 235. * um, 250. * um])),
                ],
                dielectrics: vec![Dielectric {
                    name: "layer".into(),
                    region: b([-inf, 0., -inf], [inf, 450. * um, inf]),
                    relative_permittivity: 2.8,
                }],
                background_permittivity: 1.,
                domain: b([-1325. * um, 0., -1250. * um], [1325. * um, 1450. * um, 1250. * um]),
                walls: [[Wall::Insulated; 2]; 3],
            },
            43.965892e-15,
        ),
    };
    let s = Settings {
        relative_tolerance: arg[2].parse().unwrap(),
        bounds: arg[3] == "b",
        symmetry: arg[4] == "s",
        target: if arg.len() > 5 { Target::TwoTerminal } else { Target::Matrix },
        ..Default::default()
    };
    let t = std::time::Instant::now();
    let r = solve(&scene, &s);
    let t = t.elapsed().as_secs_f64();
    match r {
        Ok(r) => {
            if let Some(v) = r.two_terminal {
                println!(
                    "{:.10e} [{:.10e} {:.10e}] spread {:.2e} err {:.2e} lowerr {:.2e} uperr {:.2e} ",
                    v.value,
                    v.lower,
                    v.upper,
                    (v.upper - v.lower) / v.value,
                    v.value / exact - 1.,
                    v.lower / exact - 1.,
                    v.upper / exact - 1.
                );
            }
            println!("maxwell {:?}", r.maxwell);
            println!(
                "reached {} {:?} unknowns {} it {} grids {} res {:?} mirrored {:?} repair {:.1e} {:?} total {:.4}",
                r.reached,
                r.shortfall,
                r.unknowns,
                r.iterations,
                r.grids,
                r.resolution,
                r.mirrored,
                r.repair_share,
                r.seconds,
                t
            );
        }
        Err(e) => println!("ERR {e}"),
    }
}

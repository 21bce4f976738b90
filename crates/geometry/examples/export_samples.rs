//! Writes sample scenes (.glb) and field series (.vtu, .pvd) into a folder, for other programs to read, and
//! says how long each took.
//!
//!     cargo run --release -p elastocap-geometry --example export_samples -- /tmp/samples
//!     node tests/readers/validate_glb.mjs /tmp/samples/*.glb
//!     python tests/readers/read_vtu.py /tmp/samples

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use elastocap_geometry::export::gltf::{BodyRole, SceneBody, glb};
use elastocap_geometry::export::vtk::{FieldGrid, pvd, vtu};
use elastocap_geometry::scene::Box3;

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args().nth(1).ok_or("usage: export_samples FOLDER")?.into();
    std::fs::create_dir_all(&folder)?;
    for (name, length) in [("nm", 1e-9), ("sensor", 450e-6), ("metre", 1.0), ("km", 1e3)] {
        for steps in [1, 6] {
            save(&folder, &format!("{name}-{steps}.glb"), || {
                Ok(glb(&sensor(length, steps), &labels(steps))?)
            })?;
        }
    }
    let one = [SceneBody {
        name: "cube".into(),
        role: BodyRole::Conductor,
        poses: vec![Box3 { min: [0.0; 3], max: [1.0; 3] }],
    }];
    save(&folder, "one-body.glb", || Ok(glb(&one, &labels(1))?))?;
    save(&folder, "sheets-6.glb", || Ok(glb(&sheets(), &labels(6))?))?;

    // 32 nodes along an axis fill a compressed block to the last byte.
    for (name, length, nodes) in [("cell", 1e-3, 2), ("nm", 1e-9, 32), ("km", 1e3, 9), ("fine", 1e-3, 47)] {
        let mut series = Vec::new();
        for step in 0..3 {
            let compression = 0.1 * f64::from(step);
            let file = format!("{name}-{step}.vtu");
            let grid = fields(length, compression, nodes);
            save(&folder, &file, || Ok(vtu(&grid)?))?;
            series.push((compression, file));
        }
        save(&folder, &format!("{name}.pvd"), || Ok(pvd(&series)?.into_bytes()))?;
    }
    Ok(())
}

fn save(
    folder: &Path,
    name: &str,
    make: impl FnOnce() -> Result<Vec<u8>, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let bytes = make()?;
    println!("{name:16} {:9} bytes {:7.2} ms", bytes.len(), 1e3 * start.elapsed().as_secs_f64());
    Ok(std::fs::write(folder.join(name), bytes)?)
}

fn labels(steps: usize) -> Vec<String> {
    (0..steps).map(|s| format!("U/H = {:.2}", 0.08 * s as f64)).collect()
}

/// An in-plane pair in a layer of thickness `height` on a substrate, under a cover, with its outer walls.
fn sensor(height: f64, steps: usize) -> Vec<SceneBody> {
    let scaled =
        |min: [f64; 3], max: [f64; 3]| Box3 { min: min.map(|x| x * height), max: max.map(|x| x * height) };
    let body = |name: &str, role, pose: &dyn Fn(f64) -> Box3| SceneBody {
        name: name.into(),
        role,
        poses: (0..steps).map(|s| pose(0.08 * s as f64)).collect(),
    };
    vec![
        body("substrate", BodyRole::Substrate, &|_| scaled([-2.0, -0.3, -1.2], [2.0, 0.0, 1.2])),
        body("left electrode", BodyRole::Conductor, &|c| {
            scaled([-0.72 - 0.3 * c, 0.48 - 0.5 * c, -0.55], [-0.05 - 0.3 * c, 0.52 - 0.52 * c, 0.55])
        }),
        body("right \"electrode\" <2>", BodyRole::Conductor, &|c| {
            scaled([0.05 + 0.3 * c, 0.48 - 0.5 * c, -0.55], [0.72 + 0.3 * c, 0.52 - 0.52 * c, 0.55])
        }),
        body("layer", BodyRole::Layer, &|c| {
            scaled([-1.1 - 0.5 * c, 0.0, -0.9], [1.1 + 0.5 * c, 1.0 - c, 0.9])
        }),
        body("cover", BodyRole::Cover, &|c| scaled([-1.1, 1.0 - c, -0.9], [1.1, 1.1 - c, 0.9])),
        body("insert", BodyRole::Dielectric, &|_| scaled([1.3, 0.0, -0.5], [1.8, 0.4, 0.5])),
        body("wall", BodyRole::Wall, &|_| scaled([-2.0, 0.0, -1.2], [-2.0, 2.0, 1.2])),
        body("air", BodyRole::Surroundings, &|_| scaled([-2.0, 0.0, -1.2], [2.0, 2.0, 1.2])),
    ]
}

/// One sheet across each axis; the last becomes a solid under load, and one is a millionth of the others.
fn sheets() -> Vec<SceneBody> {
    let mut bodies = Vec::new();
    for axis in 0..3 {
        let poses = (0..6).map(|s| {
            let mut region = Box3 { min: [0.0; 3], max: [1e-3; 3] };
            region.min[axis] = 1e-4 * f64::from(s);
            region.max[axis] = region.min[axis] + if axis == 2 { 1e-5 * f64::from(s) } else { 0.0 };
            region
        });
        bodies.push(SceneBody {
            name: format!("sheet {}", axis + 1),
            role: BodyRole::Conductor,
            poses: poses.collect(),
        });
    }
    bodies.push(SceneBody {
        name: "speck".into(),
        role: BodyRole::Dielectric,
        poses: vec![Box3 { min: [1e-3; 3], max: [1.000001e-3; 3] }; 6],
    });
    bodies
}

/// A smooth potential on a graded grid, and its exact field.
fn fields(length: f64, compression: f64, nodes: usize) -> FieldGrid {
    let axis = |stretch: f64| -> Vec<f64> {
        (0..nodes)
            .map(|i| i as f64 / (nodes - 1) as f64)
            .map(|t| stretch * length * (t + 0.5 * t * t))
            .collect()
    };
    let axes = [axis(1.0 + 0.5 * compression), axis(1.0 - compression), axis(1.0)];
    let potential = |x: [f64; 3]| (1.0 + x[0]) * (2.0 - x[1] * x[1]) + x[2];
    let field = |x: [f64; 3]| [x[1] * x[1] - 2.0, (1.0 + x[0]) * 2.0 * x[1], -1.0].map(|e| e / length);
    let middle = |x: &[f64]| -> Vec<f64> { x.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect() };
    let each = |axes: [&[f64]; 3]| -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        for &x1 in axes[0] {
            for &x2 in axes[1] {
                points.extend(axes[2].iter().map(|&x3| [x1 / length, x2 / length, x3 / length]));
            }
        }
        points
    };
    let corners = each([&axes[0], &axes[1], &axes[2]]);
    let centres = axes.each_ref().map(|x| middle(x));
    let centres = each([&centres[0], &centres[1], &centres[2]]);
    FieldGrid {
        potential: corners.iter().copied().map(potential).collect(),
        electric_field: corners.into_iter().map(|x| [field(x); 2]).collect(),
        relative_permittivity: centres.iter().map(|x| if x[1] < 0.5 { 2.8 } else { 1.0 }).collect(),
        body_id: centres.iter().map(|x| i32::from(x[1] < 0.5)).collect(),
        body_names: vec!["surroundings".into(), "layer -- \u{e9}lastom\u{e8}re".into()],
        bent: None,
        axes,
    }
}

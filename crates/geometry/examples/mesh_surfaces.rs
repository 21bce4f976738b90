//! Meshes the open space around closed surfaces from OBJ files, each alone, and prints how long that took and
//! how round the tetrahedra are: `cargo run --release -p elastocap-geometry --example mesh_surfaces --
//! FILE.obj ...`

use elastocap_geometry::import::obj::{Placement, surface_from_path};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::path::Path;
use std::time::Instant;

fn main() {
    println!("| surface | triangles | points | tetrahedra | smallest angle | time |");
    println!("|---|---|---|---|---|---|");
    for file in std::env::args().skip(1) {
        println!("{}", row(Path::new(&file)));
    }
}

/// A line of the table, for a surface or the reason why it is refused.
fn row(file: &Path) -> String {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let start = Instant::now();
    let surface = match surface_from_path(file, Placement { unit: 1e-3, translate: [0.0; 3] }) {
        Ok((surface, _)) => surface,
        Err(refused) => return format!("| {name} | refused: {} |", refused.to_string().replace('\n', " ")),
    };
    let triangles = surface.faces.len();
    let scene = Scene {
        bodies: vec![Body::conductor(name.clone(), Shape::Surface(surface))],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let read = start.elapsed().as_secs_f64();
    let start = Instant::now();
    match mesh(&scene, &Sizing::default()) {
        Err(error) => {
            format!("| {name} | {triangles} | {:.2} s: {error} |", start.elapsed().as_secs_f64())
        }
        Ok(found) => format!(
            "| {name} | {triangles} | {} | {} | {:.3} | {:.2} + {:.2} s{} |",
            found.mesh.points.len(),
            found.mesh.tets.len(),
            found.quality.smallest_angle,
            read,
            start.elapsed().as_secs_f64(),
            if found.refined { "" } else { " (limit on points)" },
        ),
    }
}

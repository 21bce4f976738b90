//! The bodies of all steps for the 3D view: boxes, or surfaces as simplified meshes.

use std::collections::HashMap;

use elastocap_geometry::export::gltf::{BodyRole, SceneBody};
use elastocap_geometry::export::surfaces::{Corners, SurfaceBody};
use elastocap_geometry::scene::Box3;
use serde_json::{Value, json};

use crate::scene_files::Shown;

/// The largest number of triangles of one step.
const MOST_TRIANGLES: usize = 14_000;
/// The largest number of triangles of all steps together.
const MOST_OF_ALL: usize = 120_000;
/// Bodies with fewer triangles than this are not simplified.
const FEW: usize = 400;
/// The largest coordinate: positions in a mesh are whole numbers from 0 to this over its extent.
const LARGEST_COORDINATE: f64 = 65_535.0;

/// The scene in the form that the page takes: a description, and the numbers of the meshes as bytes.
pub(super) struct SceneData {
    /// The labels of the steps and the bodies, as JSON.
    pub(super) description: Value,
    /// The points and triangles of the meshes, to which the description refers by their positions here.
    pub(super) bytes: Vec<u8>,
}

/// The scene; `None` where there is nothing to show.
pub(super) fn scene(shown: &Shown) -> Option<SceneData> {
    match shown {
        Shown::Boxes(bodies, labels) if !bodies.is_empty() => Some(of_boxes(bodies, labels)),
        Shown::Surfaces(steps) if steps.iter().any(|(_, bodies)| !bodies.is_empty()) => {
            Some(of_surfaces(steps))
        }
        Shown::Boxes(..) | Shown::Surfaces(_) => None,
    }
}

/// The role by the name that the page's script colours by.
fn role_name(role: BodyRole) -> &'static str {
    match role {
        BodyRole::Conductor => "conductor",
        BodyRole::FloatingConductor => "floating",
        BodyRole::GroundedConductor => "grounded",
        BodyRole::Layer => "layer",
        BodyRole::Dielectric => "dielectric",
        BodyRole::Substrate => "substrate",
        BodyRole::Cover => "cover",
        BodyRole::Wall => "wall",
        BodyRole::GroundedWall => "grounded-wall",
        BodyRole::Indenter => "indenter",
        BodyRole::ScaleBar => "scale",
        BodyRole::Surroundings => "surroundings",
    }
}

fn of_boxes(bodies: &[SceneBody], labels: &[String]) -> SceneData {
    let numbers =
        |pose: &Box3| -> Vec<f32> { pose.min.into_iter().chain(pose.max).map(|x| x as f32).collect() };
    let description = |body: &SceneBody| {
        let is_still = body.poses.windows(2).all(|pair| pair[0] == pair[1]);
        let poses = if is_still { &body.poses[..body.poses.len().min(1)] } else { &body.poses[..] };
        let poses: Vec<_> = poses.iter().map(numbers).collect();
        json!({ "name": body.name, "role": role_name(body.role), "poses": poses })
    };
    let bodies: Vec<Value> = bodies.iter().map(description).collect();
    SceneData { description: json!({ "labels": labels, "bodies": bodies }), bytes: Vec::new() }
}

/// A surface whose triangles share their corners.
struct Indexed {
    /// The least coordinates of the surface, m.
    min: [f64; 3],
    /// The extent of the surface along each axis, m.
    size: [f64; 3],
    /// The corners, from 0 to [`LARGEST_COORDINATE`] over the extent.
    points: Vec<[u16; 3]>,
    /// The corners of each triangle by their positions in `points`.
    triangles: Vec<[u32; 3]>,
}

fn of_surfaces(steps: &[(String, Vec<SurfaceBody>)]) -> SceneData {
    let share = (MOST_OF_ALL / steps.len().max(1)).min(MOST_TRIANGLES);
    let mut bytes = Vec::new();
    let mut names: Vec<(&str, BodyRole)> = Vec::new();
    let mut meshes: Vec<Vec<Value>> = Vec::new();
    // For each body: the triangles of its last mesh, and their position in `bytes`.
    let mut last: HashMap<usize, (Vec<[u32; 3]>, usize)> = HashMap::new();
    for (step, (_, bodies)) in steps.iter().enumerate() {
        let total: usize = bodies.iter().map(|body| body.triangles.len()).sum();
        for body in bodies.iter().filter(|body| !body.triangles.is_empty()) {
            let known = names.iter().position(|(name, _)| *name == body.name);
            let number = known.unwrap_or_else(|| {
                names.push((&body.name, body.role));
                meshes.push(vec![Value::Null; steps.len()]);
                names.len() - 1
            });
            let most = (share as f64 * body.triangles.len() as f64 / total as f64) as usize;
            // The indenter has few triangles, and its roundness matters.
            let most = if body.role == BodyRole::Indenter { usize::MAX } else { most.max(FEW) };
            let mesh = lightened(&body.triangles, most);
            let indices = match last.get(&number) {
                Some((triangles, position)) if *triangles == mesh.triangles => *position,
                _ => {
                    let position = bytes.len();
                    let numbers = mesh.triangles.as_flattened().iter().flat_map(|n| n.to_le_bytes());
                    bytes.extend(numbers);
                    last.insert(number, (mesh.triangles.clone(), position));
                    position
                }
            };
            let positions = bytes.len();
            bytes.extend(mesh.points.as_flattened().iter().flat_map(|n| n.to_le_bytes()));
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            if let Some(place) = meshes[number].get_mut(step) {
                *place = json!({
                    "min": mesh.min.map(|x| x as f32),
                    "size": mesh.size.map(|x| x as f32),
                    "points": [positions, mesh.points.len()],
                    "triangles": [indices, mesh.triangles.len()],
                });
            }
        }
    }
    let labels: Vec<&str> = steps.iter().map(|(label, _)| label.as_str()).collect();
    let bodies: Vec<Value> = names
        .iter()
        .zip(meshes)
        .map(|((name, role), meshes)| json!({ "name": name, "role": role_name(*role), "meshes": meshes }))
        .collect();
    SceneData { description: json!({ "labels": labels, "bodies": bodies }), bytes }
}

/// The surface with about `most` triangles or fewer: close points are merged where there are too many.
fn lightened(triangles: &[Corners], most: usize) -> Indexed {
    let corners = triangles.as_flattened();
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in corners {
        for a in 0..3 {
            (min[a], max[a]) = (min[a].min(p[a]), max[a].max(p[a]));
        }
    }
    let size = [0, 1, 2].map(|a| max[a] - min[a]);
    let whole = indexed(triangles, min, size, None);
    if whole.triangles.len() <= most {
        return whole;
    }
    // Ever coarser lattices of cubic cells, until few enough triangles are left.
    let largest = size.iter().copied().fold(0.0, f64::max);
    let mut cells = 256.0_f64;
    loop {
        let light = indexed(triangles, min, size, Some(largest / cells));
        if light.triangles.len() <= most || cells < 8.0 {
            return light;
        }
        cells *= 0.8;
    }
}

/// The surface with shared corners, merged by their positions, or by their cells in a lattice with cells no
/// longer than `cell`.
fn indexed(triangles: &[Corners], min: [f64; 3], size: [f64; 3], cell: Option<f64>) -> Indexed {
    let mut numbers: HashMap<[u16; 3], u32> = HashMap::new();
    let mut points: Vec<[u16; 3]> = Vec::new();
    // At least one cell along each axis keeps the two sides of a thin body apart.
    let counts = size.map(|s| cell.map(|cell| (s / cell).ceil().max(1.0)));
    let mut number = |p: &[f64; 3]| {
        let on_lattice = [0, 1, 2].map(|a| {
            let share = if size[a] > 0.0 { (p[a] - min[a]) / size[a] } else { 0.0 };
            let share = counts[a].map_or(share, |count| (share * count).round() / count);
            (share * LARGEST_COORDINATE).round() as u16
        });
        *numbers.entry(on_lattice).or_insert_with(|| {
            points.push(on_lattice);
            (points.len() - 1) as u32
        })
    };
    let mut shared: Vec<[u32; 3]> = triangles.iter().map(|t| t.each_ref().map(&mut number)).collect();
    if cell.is_some() {
        shared.retain(|[a, b, c]| a != b && b != c && c != a);
        let mut seen = std::collections::HashSet::new();
        shared.retain(|t| {
            let mut key = *t;
            key.sort_unstable();
            seen.insert(key)
        });
    }
    Indexed { min, size, points, triangles: shared }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square plate of n by n squares.
    fn plate(n: usize) -> Vec<Corners> {
        let at = |i: usize, j: usize| [i as f64, 0.0, j as f64];
        let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        squares
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    fn area(mesh: &Indexed) -> f64 {
        let place = |n: u32| {
            let p = mesh.points[n as usize];
            [0, 2].map(|a| mesh.size[a] * f64::from(p[a]) / LARGEST_COORDINATE)
        };
        let twice = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [*a, *b, *c].map(place);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        mesh.triangles.iter().map(twice).sum::<f64>().abs() / 2.0
    }

    #[test]
    fn a_mesh_that_is_too_fine_gets_lighter_and_keeps_its_area() {
        let fine = plate(60);
        let whole = lightened(&fine, 100_000);
        assert_eq!((whole.points.len(), whole.triangles.len()), (61 * 61, 7200));
        let light = lightened(&fine, 1000);
        assert!(light.triangles.len() <= 1000 && light.triangles.len() > 200, "{}", light.triangles.len());
        for mesh in [whole, light] {
            assert!((area(&mesh) / 3600.0 - 1.0).abs() < 1e-3, "{}", area(&mesh));
        }
    }

    #[test]
    fn what_presses_keeps_all_its_triangles_beside_a_layer_that_has_too_many() {
        let body = |name: &str, role, n| SurfaceBody { name: name.into(), role, triangles: plate(n) };
        let bodies = vec![body("layer", BodyRole::Layer, 200), body("ball", BodyRole::Indenter, 40)];
        let data = of_surfaces(&[("a".to_owned(), bodies)]);
        let count = |k: usize| data.description["bodies"][k]["meshes"][0]["triangles"][1].as_u64();
        assert!(count(0).is_some_and(|count| count <= MOST_TRIANGLES as u64));
        assert_eq!(count(1), Some(3200));
    }

    #[test]
    fn triangles_that_stay_the_same_are_kept_once() {
        let body = |shift: f64| {
            let moved = plate(4).iter().map(|t| t.map(|p| [p[0], p[1] + shift, p[2]])).collect();
            SurfaceBody { name: "plate".into(), role: BodyRole::Conductor, triangles: moved }
        };
        let steps = vec![("a".to_owned(), vec![body(0.0)]), ("b".to_owned(), vec![body(1.0)])];
        let data = of_surfaces(&steps);
        let meshes = &data.description["bodies"][0]["meshes"];
        assert_eq!(meshes[0]["triangles"], meshes[1]["triangles"]);
        assert_ne!(meshes[0]["points"], meshes[1]["points"]);
        assert_eq!(data.bytes.len(), 32 * 12 + 2 * (25_usize * 6).next_multiple_of(4));
    }
}

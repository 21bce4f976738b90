//! Pictures of the potential in plane sections through the field.
//!
//! `section_NNN.svg` is in a plane through the gap, or through the place where the load acts;
//! `section_NNN_electrodes.svg` is in a plane through the electrodes, if the load acts elsewhere.

use std::collections::HashMap;

use elastocap_coupling::outcome::StepResult;
use elastocap_coupling::words::prefixed;
use elastocap_geometry::export::body::BodyMesh;
use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::vtk::FieldGrid;
use elastocap_geometry::scene::{Box3, Purpose, across};
use elastocap_geometry::section::SectionPlane;

use crate::output_files::{SECTION, SECTION_OF_ELECTRODES};
use crate::plot::{Axis, Scale, Section, SectionCell};

/// The margin shown around the conductors, over their largest extent in the plane.
const AROUND: f64 = 0.3;

/// The name of a section of a step by its number: the first one, or the one through the electrodes.
pub(crate) fn section_file(index: usize, number: usize) -> String {
    match number {
        0 => SECTION.at(index),
        _ => SECTION_OF_ELECTRODES.at(index),
    }
}

/// The largest number of sections of a step.
pub(crate) const MOST_SECTIONS: usize = 2;

/// A conductor or one of its parts: its name and its bounds.
type Metal = (String, Box3);

/// The conductors of a step with their bounds: from their surfaces if the step has any, without the grounded
/// ones, otherwise from their shapes.
fn metal(step: &StepResult) -> Vec<Metal> {
    let surfaces = (step.surfaces.iter())
        .filter(|body| matches!(body.role, BodyRole::Conductor | BodyRole::FloatingConductor));
    let bounds = |corners: &[[f64; 3]]| {
        corners.iter().map(|&p| Box3 { min: p, max: p }).reduce(|bounds, p| bounds.union(&p))
    };
    let of_surfaces: Vec<Metal> = surfaces
        .filter_map(|body| Some((body.name.clone(), bounds(body.triangles.as_flattened())?)))
        .collect();
    if !of_surfaces.is_empty() {
        return of_surfaces;
    }
    let Some(scene) = &step.scene else { return Vec::new() };
    let parts = scene
        .scene
        .conductors()
        .flat_map(|c| c.body.parts.iter().filter_map(|part| Some((c.body.name.clone(), part.bounds()?))));
    parts.collect()
}

/// A section through a field in a thin slab around a plane; `metal_ids` are the bodies that are metal.
pub(crate) fn of_slab(
    step: &StepResult,
    title: &str,
    (plane, grid): (SectionPlane, &FieldGrid),
    metal_ids: std::ops::Range<i32>,
) -> Option<Section> {
    let metal = metal(step);
    let axis = plane.axis;
    let [p, q] = across(axis);
    // The section shows the middle of the slab's last cell. If the slab lies across a mirror plane, its first
    // cell is the mirror image of that.
    let nodes = &grid.axes[axis];
    let last_cell = nodes.len().checked_sub(2)?;
    let t = 0.5;
    let counts = grid.axes.each_ref().map(Vec::len);
    let index = |i: usize, j: usize, k: usize| {
        let mut at = [0; 3];
        (at[p], at[q], at[plane.axis]) = (i, j, k);
        at
    };
    let potential = |i: usize, j: usize| {
        let value = |k: usize| {
            let [a, b, c] = index(i, j, k);
            grid.potential[(a * counts[1] + b) * counts[2] + c]
        };
        (1.0 - t) * value(last_cell) + t * value(last_cell + 1)
    };
    // A component of the field at a node, as the limit from one side.
    let field = |i: usize, j: usize, a: usize, above: usize| {
        let value = |k: usize| {
            let [i, j, k] = index(i, j, k);
            grid.electric_field[(i * counts[1] + j) * counts[2] + k][above][a]
        };
        (1.0 - t) * value(last_cell) + t * value(last_cell + 1)
    };
    // The position of a node of the plane; the plane of a bent grid is bent too.
    let position = |i: usize, j: usize| match &grid.bent {
        None => [grid.axes[p][i], grid.axes[q][j]],
        Some(bent) => {
            let value = |k: usize, a: usize| {
                let [i, j, k] = index(i, j, k);
                bent[(i * counts[1] + j) * counts[2] + k][a]
            };
            [p, q].map(|a| (1.0 - t) * value(last_cell, a) + t * value(last_cell + 1, a))
        }
    };
    let (extent_p, extent_q) = (extent(&grid.axes[p]), extent(&grid.axes[q]));
    let pieces = |x: &[f64], i: usize, extent: f64| {
        let share = (x[i + 1] - x[i]) / extent;
        ((share / FINE).ceil() as usize).clamp(1, MOST_PIECES)
    };
    let mut cells = Vec::new();
    for i in 0..counts[p].saturating_sub(1) {
        for j in 0..counts[q].saturating_sub(1) {
            let [a, b, c] = index(i, j, last_cell);
            let body = grid.body_id[(a * (counts[1] - 1) + b) * (counts[2] - 1) + c];
            if metal_ids.contains(&body) {
                continue;
            }
            let at = |s: usize, t: usize| {
                // The limit from inside the cell: above its lower corners, below its upper ones. The
                // potential falls along the field. On a bent grid the slope along one axis involves all
                // components of the field, from the side of the cell along that axis.
                let along = |above: usize, from: [f64; 2], to: [f64; 2]| {
                    let field = [p, q].map(|a| field(i + s, j + t, a, above));
                    -(0..2).map(|k| field[k] * (to[k] - from[k])).sum::<f64>()
                };
                Corner {
                    place: position(i + s, j + t),
                    value: potential(i + s, j + t),
                    rises: [
                        along(1 - s, position(i, j + t), position(i + 1, j + t)),
                        along(1 - t, position(i + s, j), position(i + s, j + 1)),
                    ],
                }
            };
            let patch = Patch([[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]);
            let [m, n] = [pieces(&grid.axes[p], i, extent_p), pieces(&grid.axes[q], j, extent_q)];
            let corner = |(k, l): (usize, usize)| {
                let (place, value) = patch.at(k as f64 / m as f64, l as f64 / n as f64);
                // Neighbours have the same number of pieces along their common side.
                let key = |i: usize, k: usize, m: usize| {
                    let (i, k) = if k == m { (i + 1, 0) } else { (i, k) };
                    (i * MOST_PIECES + k) as u64
                };
                ((body as u64) << 44 | key(i, k, m) << 22 | key(j, l, n), [place[0], place[1], value])
            };
            for k in 0..m {
                for l in 0..n {
                    let corners = [(k, l), (k + 1, l), (k + 1, l + 1), (k, l + 1)].map(corner);
                    cells.push(SectionCell { corners: corners.into() });
                }
            }
        }
    }
    section(step, title, &metal, plane, cells)
}

/// The largest size of a piece of a cell, over that of the picture, unless that gives too many pieces. Not
/// tuned: it trades the size of a picture for detail.
const FINE: f64 = 0.02;
/// The largest number of pieces along one side of a cell.
const MOST_PIECES: usize = 4;

/// The distance from the first to the last of ascending nodes.
fn extent(nodes: &[f64]) -> f64 {
    nodes.last().zip(nodes.first()).map_or(0.0, |(last, first)| last - first)
}

/// A corner of a cell: its position, m, its potential, V, and the rises of the potential along both sides of
/// the cell if its slope there were constant, V.
#[derive(Clone, Copy)]
struct Corner {
    place: [f64; 2],
    value: f64,
    rises: [f64; 2],
}

/// A quadrilateral in which the potential is the cubic that has the values and slopes of the corners
/// (Ferguson, Journal of the ACM 11, 1964): without kinks from one cell of a body to the next.
struct Patch([[Corner; 2]; 2]);

impl Patch {
    /// The position and the potential at the fractions `s` and `t` of the sides.
    fn at(&self, s: f64, t: f64) -> ([f64; 2], f64) {
        // Weights of the values and of the slopes, at the lower end and at the upper one.
        let weights = |s: f64| {
            let (r, s2) = (1.0 - s, s * s);
            ([r * r * (1.0 + 2.0 * s), s2 * (3.0 - 2.0 * s)], [s * r * r, -s2 * r])
        };
        let (of_s, of_t) = (weights(s), weights(t));
        let mut value = 0.0;
        for (k, row) in self.0.iter().enumerate() {
            for (l, corner) in row.iter().enumerate() {
                value += of_s.0[k] * of_t.0[l] * corner.value;
                value += of_s.1[k] * of_t.0[l] * corner.rises[0];
                value += of_s.0[k] * of_t.1[l] * corner.rises[1];
            }
        }
        // Exact at both ends.
        let between = |a: f64, b: f64, s: f64| if s == 1.0 { b } else { a + s * (b - a) };
        let place = [0, 1].map(|a| {
            let [low, high] = [0, 1].map(|k| between(self.0[k][0].place[a], self.0[k][1].place[a], t));
            between(low, high, s)
        });
        (place, value)
    }
}

/// The sections through a field on tetrahedra; `loaded_at` is the place where the load acts, if it acts at
/// one place.
pub(crate) fn of_tetrahedra(
    step: &StepResult,
    title: &str,
    mesh: &BodyMesh,
    loaded_at: Option<[f64; 2]>,
) -> Vec<Section> {
    let metal = metal(step);
    let planes = SectionPlane::of_scene(&metal, loaded_at);
    planes.into_iter().filter_map(|plane| through_tetrahedra(step, title, mesh, (plane, &metal))).collect()
}

/// The section through a field on tetrahedra in one plane.
fn through_tetrahedra(
    step: &StepResult,
    title: &str,
    mesh: &BodyMesh,
    (plane, metal): (SectionPlane, &[Metal]),
) -> Option<Section> {
    let [p, q] = across(plane.axis);
    let values = &mesh.arrays.iter().find(|array| array.name == "potential")?.values;
    let above: Vec<f64> = mesh.points.iter().map(|x| x[plane.axis] - plane.at()).collect();
    let corner = |from: u32, to: u32| {
        let (a, b) = (from.min(to) as usize, from.max(to) as usize);
        let t = above[a] / (above[a] - above[b]);
        let between = |x: f64, y: f64| x + t * (y - x);
        let at = [p, q].map(|k| between(mesh.points[a][k], mesh.points[b][k]));
        ((a as u64) << 32 | b as u64, [at[0], at[1], between(values[a], values[b])])
    };
    let mut cells = Vec::new();
    for tet in mesh.nodes.chunks_exact(4) {
        let (high, low): (Vec<u32>, Vec<u32>) = tet.iter().partition(|n| above[**n as usize] >= 0.0);
        let corners = match (high.as_slice(), low.as_slice()) {
            ([a], [b, c, d]) | ([b, c, d], [a]) => vec![corner(*a, *b), corner(*a, *c), corner(*a, *d)],
            // Around the quadrilateral, whose corners are on the edges from the two nodes above the plane to
            // the two below it.
            ([a, b], [c, d]) => vec![corner(*a, *c), corner(*a, *d), corner(*b, *d), corner(*b, *c)],
            _ => continue,
        };
        cells.push(SectionCell { corners });
    }
    section(step, title, metal, plane, cells)
}

/// The lower and the upper end of the layer along x2, m; plus and minus infinity without a layer.
fn layer(step: &StepResult) -> [f64; 2] {
    let of_scene = step.scene.iter().flat_map(|scene| &scene.scene.bodies);
    let slabs = of_scene.filter(|body| body.purpose == Purpose::Layer).filter_map(|body| body.bounds());
    slabs.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], b| [low.min(b.min[1]), high.max(b.max[1])])
}

/// The picture of these cells in the window around the conductors that the plane cuts; `None` without
/// conductors, or if nothing of the field is near them.
fn section(
    step: &StepResult,
    title: &str,
    metal: &[Metal],
    plane: SectionPlane,
    cells: Vec<SectionCell>,
) -> Option<Section> {
    let [p, q] = across(plane.axis);
    let corners = || cells.iter().flat_map(|cell| cell.corners.iter().map(|(_, at)| [at[0], at[1]]));
    let cut: Vec<&Metal> = metal.iter().filter(|(_, bounds)| plane.cuts(bounds)).collect();
    let whole =
        |parts: &[&Metal]| parts.iter().map(|(_, part)| *part).reduce(|whole, part| whole.union(&part));
    // A plane that cuts no conductor shows what lies beside all of them.
    let shown = whole(&cut).or_else(|| whole(&metal.iter().collect::<Vec<_>>()))?;
    let margin = AROUND * shown.extent(p).max(shown.extent(q));
    // The window ends where the known field does.
    let ends = |k: usize, a: usize| {
        let known = corners()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at[k]), high.max(at[k])));
        let [low, high] = if a == 1 { layer(step) } else { [f64::INFINITY, f64::NEG_INFINITY] };
        ((shown.min[a] - margin).min(low).max(known.0), (shown.max[a] + margin).max(high).min(known.1))
    };
    let window = [ends(0, p), ends(1, q)];
    if window.iter().any(|(low, high)| low.partial_cmp(high) != Some(std::cmp::Ordering::Less)) {
        return None;
    }
    let flat = cut.iter().filter(|(_, b)| b.extent(p) == 0.0 || b.extent(q) == 0.0);
    let sheets = flat.map(|(_, b)| [[b.min[p], b.min[q]], [b.max[p], b.max[q]]]).collect();
    let mut bounds: HashMap<&str, Box3> = HashMap::new();
    for (name, part) in cut {
        bounds.entry(name).and_modify(|whole| *whole = whole.union(part)).or_insert(*part);
    }
    let middle = |b: &Box3| [p, q].map(|a| 0.5 * (b.min[a] + b.max[a]));
    let mut names: Vec<_> = bounds.iter().map(|(name, b)| ((*name).to_owned(), middle(b))).collect();
    names.sort_by(|a, b| a.0.cmp(&b.0));
    let axis = |a: usize| Axis { label: format!("x{}", a + 1), unit: "m".into(), scale: Scale::Linear };
    // The sum turns minus zero into zero.
    let place = prefixed(plane.middle + 0.0, 3, "m");
    let plane = format!("plane x{} = {place}", plane.axis + 1);
    Some(Section { title: title.to_owned(), plane, x: axis(p), y: axis(q), window, cells, sheets, names })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::sync::atomic::AtomicBool;
    use std::sync::{Arc, Mutex};

    use elastocap_case::Case;
    use elastocap_coupling::plan::{Options, Plan};
    use elastocap_coupling::run::{Observer, run};
    use elastocap_coupling::step::StepField;
    use std::ops::ControlFlow;

    /// Keeps the sections through the field of the first step.
    #[derive(Default)]
    struct First(Mutex<Vec<Section>>);

    impl Observer for First {
        fn field_solved(&self, step: &StepResult, field: StepField) -> ControlFlow<()> {
            let sections = match (field, &step.scene) {
                (StepField::Grid(field), Some(scene)) => {
                    let first = 1 + scene.scene.dielectrics().count() as i32;
                    let metal = first..first + scene.scene.conductors().count() as i32;
                    let drawn = |section: elastocap_electrostatics::FieldSection| {
                        let slab = crate::scene_files::field_grid(&scene.scene, section.field);
                        of_slab(step, "a section", (section.plane, &slab), metal.clone())
                    };
                    field.sections.into_iter().filter_map(drawn).collect()
                }
                (StepField::Grid(_), None) => Vec::new(),
                (StepField::Tetrahedra(mesh), _) => of_tetrahedra(step, "a section", &mesh, None),
            };
            if step.index == 0 {
                *self.0.lock().unwrap() = sections;
            }
            ControlFlow::Continue(())
        }
    }

    fn first_section(name: &str) -> Section {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(name);
        first_section_of(&elastocap_case::load(&path).unwrap())
    }

    fn first_section_of(case: &Case) -> Section {
        sections_of(case).remove(0)
    }

    fn sections_of(case: &Case) -> Vec<Section> {
        let options = Options { prune: true, fields: true, scene: false, model_error: false };
        let plan = Plan::new(case, &options);
        let found = First::default();
        run(case, &plan, &options, &Arc::new(AtomicBool::new(false)), &found);
        found.0.into_inner().unwrap()
    }

    fn corners(section: &Section) -> impl Iterator<Item = [f64; 3]> {
        section.cells.iter().flat_map(|cell| cell.corners.iter().map(|corner| corner.1))
    }

    #[test]
    fn a_section_through_boxes_meets_the_electrodes_at_their_potentials_and_is_its_own_image() {
        let section = &first_section("in-plane-pair.toml");
        assert_eq!(section.names[0].0, "electrode-left");
        // At rest the right electrode lies from 25 to 325 um, between 215 and 235 um above the substrate.
        let on = |p: &[f64; 3]| {
            let face = (p[1] - 215e-6).abs() < 1e-10 || (p[1] - 235e-6).abs() < 1e-10;
            face && p[0].abs() > 26e-6 && p[0].abs() < 324e-6
        };
        let held: Vec<_> = corners(section).filter(on).collect();
        assert!(held.len() > 40);
        for p in held {
            let volts = if p[0] > 0.0 { -0.5 } else { 0.5 };
            assert!((p[2] - volts).abs() < 1e-6, "{p:?}");
        }
        let inside = |p: &[f64; 3]| (p[0].abs() - 175e-6).abs() < 149e-6 && (p[1] - 225e-6).abs() < 9e-6;
        assert!(!corners(section).any(|p| inside(&p)), "there is no field in metal");
        assert!(corners(section).filter(|p| p[0].abs() < 1e-12).all(|p| p[2].abs() < 1e-6));
    }

    #[test]
    fn conductors_that_are_ten_thousand_times_as_long_as_their_walls_are_apart_are_cut_across_their_length() {
        let text = r#"
            format = 1
            conductor = [
                { name = "lower", box = { min = ["-5 um", "1 um", "-10 mm"], max = ["5 um", "1.2 um", "10 mm"] } },
                { name = "upper", box = { min = ["-5 um", "2 um", "-10 mm"], max = ["5 um", "2.2 um", "10 mm"] } },
            ]
            [surroundings]
            boundary = "grounded"
            walls = { min = ["-20 um", "0 um", "-12 mm"], max = ["20 um", "3 um", "12 mm"] }
            [electrostatics]
            relative_tolerance = 1e-2
        "#;
        let section = &first_section_of(&elastocap_case::parse(text, Path::new("thin.toml")).unwrap());
        assert_eq!((&*section.x.label, &*section.y.label), ("x1", "x2"));
        assert_eq!(section.names.len(), 2);
        let between = corners(section).filter(|p| p[0].abs() < 3e-6 && 1.2e-6 < p[1] && p[1] < 2e-6);
        let expected = |p: [f64; 3]| 0.5 - (p[1] - 1.2e-6) / 0.8e-6;
        assert!(between.map(|p| (p[2] - expected(p)).abs()).fold(0.0, f64::max) < 1e-2);
    }

    #[test]
    fn a_layer_in_three_dimensions_is_cut_where_it_is_loaded_and_again_where_its_electrodes_are() {
        let text = r#"
            format = 1
            [layer]
            thickness = "1 mm"
            half_length = "6 mm"
            relative_permittivity = 3.0
            material.neo_hookean = { shear_modulus = "50 kPa" }
            [[conductor]]
            name = "lower"
            sheet = { normal = "x2", at = "0 mm", min = ["-2 mm", "0.5 mm"], max = ["2 mm", "2 mm"] }
            [[conductor]]
            name = "upper"
            attached = "layer"
            sheet = { normal = "x2", at = "1 mm", min = ["-2 mm", "0.5 mm"], max = ["2 mm", "2 mm"] }
            [mechanics.solid]
            width = "12 mm"
            end = "far"
            side = "symmetric"
            indenter = { sphere = { radius = "2 mm" } }
            [load]
            compression = [0.0]
            [surroundings]
            boundary = "open"
            [electrostatics]
            relative_tolerance = 5e-2
        "#;
        let found = sections_of(&elastocap_case::parse(text, Path::new("beside.toml")).unwrap());
        let planes: Vec<(&str, usize)> =
            found.iter().map(|section| (&*section.plane, section.names.len())).collect();
        assert_eq!(planes, [("plane x3 = 0 m", 0), ("plane x3 = 1.25 mm", 2)]);
        // Between the electrodes the potential runs from one to the other; beside them it stays away from
        // theirs.
        let largest = |section: &Section| corners(section).map(|p| p[2].abs()).fold(0.0, f64::max);
        assert!(
            largest(&found[1]) > 0.998 && largest(&found[0]) < 0.9,
            "{} {}",
            largest(&found[1]),
            largest(&found[0])
        );
    }

    #[test]
    fn a_cubic_field_is_met_everywhere_in_a_patch() {
        let u = |x: f64, y: f64| x * x * x - 2.0 * x * x + y * y * y + 3.0 * y;
        let (x, y) = ([1.0, 1.5], [-1.0, 2.0]);
        let at = |k: usize, l: usize| Corner {
            place: [x[k], y[l]],
            value: u(x[k], y[l]),
            rises: [
                (3.0 * x[k] * x[k] - 4.0 * x[k]) * (x[1] - x[0]),
                (3.0 * y[l] * y[l] + 3.0) * (y[1] - y[0]),
            ],
        };
        let patch = Patch([[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]);
        for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.0), (1.0, 0.7), (0.4, 0.6)] {
            let ([px, py], found) = patch.at(s, t);
            assert!((found - u(px, py)).abs() < 1e-12, "{s} {t}: {found} {}", u(px, py));
        }
    }

    #[test]
    fn a_section_through_tetrahedra_leaves_the_metal_free_and_lies_in_the_window() {
        let section = &first_section("star-pad.toml");
        assert_eq!(section.names.len(), 2);
        assert!(corners(section).all(|p| (-0.51..=0.51).contains(&p[2])));
        let area: f64 = (section.cells.iter())
            .map(|cell| {
                let at: Vec<[f64; 3]> = cell.corners.iter().map(|corner| corner.1).collect();
                let next = |k: usize| at[(k + 1) % at.len()];
                (0..at.len()).map(|k| at[k][0] * next(k)[1] - at[k][1] * next(k)[0]).sum::<f64>().abs() / 2.0
            })
            .sum();
        // Both conductors are sheets: the cells cover the plane as far as the field is shown.
        let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max];
        let end = |pick: fn(f64, f64) -> f64, k: usize| corners(section).map(|p| p[k]).reduce(pick).unwrap();
        let whole = (end(high, 0) - end(low, 0)) * (end(high, 1) - end(low, 1));
        assert!((area / whole - 1.0).abs() < 1e-9, "{area} {whole}");
    }
}

//! The field that is kept for export.

use elastocap_electrostatics::{Field, Settings, SolveError, solve};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Two square sheets in open space.
fn two_sheets() -> Scene {
    let plate = |name: &str, x2: f64| {
        let region = Box3 { min: [-0.5, x2, -0.5], max: [0.5, x2, 0.5] };
        Body::conductor(name, Shape::Box(region))
    };
    Scene {
        bodies: vec![plate("lower", -0.2), plate("upper", 0.2)],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    }
}

/// A solve whose bounds meet the tolerance has its field, however late it was cancelled.
#[test]
fn a_solve_that_is_complete_when_it_is_asked_to_stop_has_its_field() {
    let scene = two_sheets();
    let settings = |cancel| Settings { relative_tolerance: 1e-2, field: true, cancel, ..Settings::default() };
    let begin = Instant::now();
    solve(&scene, &settings(None)).unwrap();
    // Later after a solve that was stopped, earlier after a complete one: most stops fall near the end,
    // however busy the machine is.
    let mut delay = begin.elapsed();
    let (mut complete, mut attempts) = (0, 0);
    while complete == 0 || attempts < 40 {
        attempts += 1;
        let cancel = Arc::new(AtomicBool::new(false));
        let of_solve = Arc::clone(&cancel);
        let solution = std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(delay);
                cancel.store(true, Ordering::Relaxed);
            });
            solve(&scene, &settings(Some(of_solve)))
        });
        match solution {
            Ok(solution) if solution.reached => {
                complete += 1;
                assert!(solution.field.is_some(), "attempt {attempts} has no field");
                delay = delay.mul_f64(0.93);
            }
            Ok(_) | Err(SolveError::Cancelled) => delay = delay.mul_f64(1.1),
            Err(other) => panic!("{other}"),
        }
    }
}

/// The field is minus the gradient of the potential, on either side of each mirror plane: the potential is
/// even about two of them and odd about the third.
#[test]
fn the_field_points_down_the_potential_on_both_sides_of_every_mirror_plane() {
    let scene = two_sheets();
    let settings = Settings { relative_tolerance: 1e-2, field: true, ..Settings::default() };
    let solution = solve(&scene, &settings).unwrap();
    assert_eq!(solution.mirrored, [true; 3]);
    let field = solution.field.unwrap();
    let nodes = field.nodes.each_ref().map(Vec::len);
    let cells = nodes.map(|n| n - 1);
    for axis in 0..3 {
        for upper_half in [false, true] {
            // Of the field along the axis and the falling potential over a cell: products and squares,
            // summed.
            let (mut product, mut squares) = (0.0, [0.0; 2]);
            for index in 0..cells[0] * cells[1] * cells[2] {
                let cell = [index / (cells[1] * cells[2]), index / cells[2] % cells[1], index % cells[2]];
                let [low, high] = [0, 1].map(|side| field.nodes[axis][cell[axis] + side]);
                if (low >= 0.0) != upper_half {
                    continue;
                }
                let (mut fall, mut along) = (0.0, 0.0);
                for corner in 0..8_usize {
                    let at = [0, 1, 2].map(|a| cell[a] + (corner >> a & 1));
                    let node = (at[0] * nodes[1] + at[1]) * nodes[2] + at[2];
                    let upper = corner >> axis & 1 == 1;
                    fall += if upper { -0.25 } else { 0.25 } * field.potential[node];
                    // The cell lies above its lower corners.
                    along += 0.125 * field.electric_field[node][usize::from(!upper)][axis];
                }
                let slope = fall / (high - low);
                product += slope * along;
                squares = [squares[0] + slope * slope, squares[1] + along * along];
            }
            let likeness = product / (squares[0] * squares[1]).sqrt();
            assert!(likeness > 0.9, "axis {axis}, upper half {upper_half}: {likeness}");
        }
    }
}

#[test]
fn a_section_is_the_field_in_the_middle_on_more_cells() {
    for symmetry in [true, false] {
        let settings = Settings { relative_tolerance: 1e-2, field: true, symmetry, ..Settings::default() };
        let field = solve(&two_sheets(), &settings).unwrap().field.unwrap();
        let [section] = field.sections.as_slice() else { panic!("{}", field.sections.len()) };
        assert!(section.plane.axis == 2 && section.field.sections.is_empty());
        assert!(section.field.nodes[2].iter().all(|x| x.abs() < 3e-4), "{:?}", section.field.nodes[2]);
        let cells = |field: &Field| (field.nodes[0].len() - 1) * (field.nodes[1].len() - 1);
        assert!(cells(&section.field) > 2 * cells(&field));
        let at = |field: &Field, [x, y]: [f64; 2]| {
            let place = |a: usize, x: f64| field.nodes[a].iter().position(|node| (node - x).abs() < 1e-12);
            let [i, j, k] = [place(0, x)?, place(1, y)?, place(2, 0.0)?];
            Some(field.potential[(i * field.nodes[1].len() + j) * field.nodes[2].len() + k])
        };
        // Both have the faces of the sheets among their nodes, and the middle along x3.
        let [first, second, _] = &section.field.nodes;
        let places = first.iter().flat_map(|x| second.iter().map(|y| [*x, *y]));
        let common = places.filter_map(|place| Some((at(&section.field, place)?, at(&field, place)?)));
        let common: Vec<(f64, f64)> = common.collect();
        assert!(common.len() > 20, "{}", common.len());
        assert!(common.iter().all(|(fine, coarse)| (fine - coarse).abs() < 1e-9), "{common:?}");
    }
}

#[test]
fn a_section_through_a_load_on_either_side_of_a_mirror_plane_is_that_of_the_whole_scene() {
    // Conductors that are their mirror image across x3, at opposite potentials along x1.
    for x3 in [-0.2, 0.2] {
        let sampled = |symmetry: bool| {
            let loaded_at = Some([0.0, x3]);
            let settings = Settings {
                relative_tolerance: 1e-2,
                field: true,
                symmetry,
                loaded_at,
                ..Settings::default()
            };
            solve(&two_sheets(), &settings).unwrap().field.unwrap().sections.remove(0)
        };
        let (part, whole) = (sampled(true), sampled(false));
        assert_eq!((part.plane.middle, part.field.nodes[2].len()), (x3, 2));
        assert!(
            (part.field.nodes[2][0] - x3).abs() < 1e-9 && part.field.nodes[2][0] < part.field.nodes[2][1]
        );
        assert_eq!(part.field.body, whole.field.body);
        let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert_eq!(part.field.potential.len(), whole.field.potential.len());
        let off = largest(&part.field.potential, &whole.field.potential);
        assert!(off < 1e-6, "{off}");
        // The component across the mirror plane has the sign of the side.
        let across = |section: &elastocap_electrostatics::FieldSection| -> Vec<f64> {
            section.field.electric_field.iter().map(|limits| limits[1][2]).collect()
        };
        let (a, b) = (across(&part), across(&whole));
        let scale = b.iter().map(|e| e.abs()).fold(0.0, f64::max);
        assert!(largest(&a, &b) < 1e-3 * scale, "{} of {scale}", largest(&a, &b));
    }
}

/// Plates that fill the walls, at right angles to `axis`, with a slab of eps_r 4 between layers of vacuum:
/// the field of capacitors in series, in both halves of a scene of some hundredths of a millimetre far from
/// the origin.
#[test]
fn the_field_between_plates_is_the_voltage_over_the_gap_wherever_they_lie() {
    let (unit, origin) = (1e-5, [3e-3, -2e-3, 5e-4]);
    for axis in 0..3 {
        let region = |low: f64, high: f64| {
            let (mut min, mut max) = (origin.map(|x| x - 2.0 * unit), origin.map(|x| x + 2.0 * unit));
            (min[axis], max[axis]) = (origin[axis] + low * unit, origin[axis] + high * unit);
            Box3 { min, max }
        };
        let scene = Scene {
            bodies: vec![
                Body::conductor("low", Shape::Box(region(-1.0, -0.5))),
                Body::conductor("high", Shape::Box(region(0.5, 1.0))),
                Body::dielectric("slab", Shape::Box(region(-0.25, 0.25)), 4.0),
            ],
            background_permittivity: 1.0,
            domain: region(-1.0, 1.0),
            walls: [[Wall::Insulated; 2]; 3],
        };
        let settings = Settings { relative_tolerance: 1e-6, field: true, ..Settings::default() };
        let solution = solve(&scene, &settings).unwrap();
        assert_eq!(solution.mirrored, [true; 3]);
        let field = solution.field.unwrap();
        for a in 0..3 {
            let (first, last) = (field.nodes[a][0], *field.nodes[a].last().unwrap());
            let near = |x: f64, exact: f64| (x - exact).abs() < 1e-9 * unit;
            assert!(near(first, scene.domain.min[a]) && near(last, scene.domain.max[a]), "{first} {last}");
            assert!(field.nodes[a].is_sorted_by(|x, y| x < y));
        }
        let [low, high] = [field.potentials[0], field.potentials[1]];
        // eps_r E is the same all over the gap: the layers of vacuum measure 1/2, the slab 1/2 over 4.
        let in_vacuum = (low - high) / ((0.5 + 0.125) * unit);
        let fall = |x: f64| match x / unit {
            s if s < -0.5 => 0.0,
            s if s < -0.25 => (s + 0.5) / 0.625,
            s if s < 0.25 => (0.25 + 0.25 * (s + 0.25)) / 0.625,
            s => (0.375 + (s.min(0.5) - 0.25)) / 0.625,
        };
        let nodes = field.nodes.each_ref().map(Vec::len);
        for (index, found) in field.potential.iter().enumerate() {
            let at = [index / (nodes[1] * nodes[2]), index / nodes[2] % nodes[1], index % nodes[2]];
            let exact = low + (high - low) * fall(field.nodes[axis][at[axis]] - origin[axis]);
            assert!(
                (found - exact).abs() < 1e-4 * (high - low).abs(),
                "axis {axis}, {at:?}: {found} {exact}"
            );
        }
        let cells = nodes.map(|n| n - 1);
        for index in 0..cells.iter().product() {
            let at = [index / (cells[1] * cells[2]), index / cells[2] % cells[1], index % cells[2]];
            let along = &field.nodes[axis][at[axis]..at[axis] + 2];
            let place = ((0.5 * (along[0] + along[1]) - origin[axis]) / unit).abs();
            let (permittivity, strength) = match place {
                s if s < 0.25 => (4.0, in_vacuum / 4.0),
                s if s < 0.5 => (1.0, in_vacuum),
                _ => (1.0, 0.0),
            };
            assert_eq!(field.relative_permittivity[index], permittivity, "axis {axis}, {at:?}");
            for (corner, a) in (0..8_usize).flat_map(|corner| [0, 1, 2].map(|a| (corner, a))) {
                let [i, j, k] = [0, 1, 2].map(|a| at[a] + (corner >> a & 1));
                // In the cell: above its lower corners, below its upper ones.
                let side = 1 - (corner >> a & 1);
                let found = field.electric_field[(i * nodes[1] + j) * nodes[2] + k][side][a];
                let exact = if a == axis { strength } else { 0.0 };
                assert!((found - exact).abs() < 1e-4 * in_vacuum.abs(), "axis {axis}, {at:?}: {found:?}");
            }
        }
    }
}

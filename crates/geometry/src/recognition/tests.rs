use super::*;
use crate::samples::cube;
use std::collections::BTreeMap;

fn found(shape: &Shape) -> Option<Vec<Box3>> {
    boxes_of(shape, 1000)
}

fn volume(boxes: &[Box3]) -> f64 {
    boxes.iter().map(|b| b.extent(0) * b.extent(1) * b.extent(2)).sum()
}

/// The surface of the union of unit cells, two triangles for each face between a filled cell and an empty
/// one.
fn surface_of(cells: &[[i32; 3]], at: impl Fn([i32; 3]) -> [f64; 3]) -> TriangleSurface {
    let mut known: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut surface = TriangleSurface::default();
    for cell in cells {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut beside = *cell;
                beside[axis] += 2 * side - 1;
                if cells.contains(&beside) {
                    continue;
                }
                let corner = |u: i32, v: i32| {
                    let mut p = *cell;
                    p[axis] += side;
                    p[(axis + 1) % 3] += u;
                    p[(axis + 2) % 3] += v;
                    p
                };
                let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| corner(u, v)).map(|p| {
                    *known.entry(p).or_insert_with(|| {
                        surface.points.push(at(p));
                        surface.points.len() as u32 - 1
                    })
                });
                if side == 0 {
                    quad.reverse();
                }
                surface.faces.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
    }
    surface
}

/// Coordinates that are not multiples of anything.
fn uneven(p: [i32; 3]) -> [f64; 3] {
    p.map(|k| 1e-6 * (f64::from(k) + 0.1 * f64::from(k * k) - 0.3))
}

#[test]
fn a_cube_of_triangles_is_one_box_to_the_last_bit() {
    let surface = cube([0.1, 0.2, 0.3], 0.07);
    let expected = Box3 { min: surface.points[0], max: surface.points[7] };
    assert_eq!(found(&Shape::Surface(surface)), Some(vec![expected]));
}

#[test]
fn a_plate_of_many_triangles_in_each_face_is_one_box() {
    let cells: Vec<_> = block([0; 3], [7, 1, 5]).map(|cell| cell.map(|k| k as i32)).collect();
    let surface = surface_of(&cells, uneven);
    assert!(surface.faces.len() > 180);
    let expected = Box3 { min: uneven([0; 3]), max: uneven([7, 1, 5]) };
    assert_eq!(found(&Shape::Surface(surface)), Some(vec![expected]));
}

#[test]
fn random_unions_of_cells_are_found_cell_by_cell() {
    let mut random = 1_u32;
    for _ in 0..200 {
        let cells: Vec<_> = block([0; 3], [4, 3, 3])
            .filter(|_| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                random >> 30 != 0
            })
            .map(|cell| cell.map(|k| k as i32))
            .collect();
        let boxes = found(&Shape::Surface(surface_of(&cells, uneven))).unwrap();
        for cell in block([0; 3], [4, 3, 3]) {
            let cell = cell.map(|k| k as i32);
            let (low, high) = (uneven(cell), uneven(cell.map(|k| k + 1)));
            let centre = [0, 1, 2].map(|a| 0.5 * (low[a] + high[a]));
            let holding = boxes.iter().filter(|b| b.contains(centre)).count();
            assert_eq!(holding, usize::from(cells.contains(&cell)), "{cell:?} of {cells:?}");
        }
    }
}

#[test]
fn a_box_with_a_hollow_is_the_boxes_around_the_hollow() {
    let cells: Vec<_> =
        block([0; 3], [3; 3]).map(|cell| cell.map(|k| k as i32)).filter(|cell| *cell != [1; 3]).collect();
    let boxes = found(&Shape::Surface(surface_of(&cells, |p| p.map(f64::from)))).unwrap();
    assert_eq!(volume(&boxes), 26.0);
    assert!(!boxes.iter().any(|b| b.contains([1.5; 3])) && boxes.len() <= 6, "{boxes:?}");
}

#[test]
fn a_corner_that_is_off_by_the_last_bit_is_no_box() {
    for k in 0..8 {
        for axis in 0..3 {
            let mut surface = cube([0.1; 3], 0.07);
            surface.points[k][axis] = surface.points[k][axis].next_up();
            assert_eq!(found(&Shape::Surface(surface)), None, "corner {k}, axis {axis}");
        }
    }
}

#[test]
fn a_right_angled_outline_is_cut_into_boxes_whichever_way_round_it_is() {
    let outline = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    for axis in 0..3 {
        for reversed in [false, true] {
            let mut outline = outline.clone();
            if reversed {
                outline.reverse();
            }
            let boxes =
                found(&Shape::Extrusion { axis, from: 0.5, to: 0.25, outline, arcs: Vec::new() }).unwrap();
            assert_eq!((boxes.len(), volume(&boxes)), (2, 1.0));
            assert!(boxes.iter().all(|b| (b.min[axis], b.max[axis]) == (0.25, 0.5)));
        }
    }
}

#[test]
fn an_outline_without_thickness_is_sheets_and_one_with_a_slope_is_nothing() {
    let outline = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
    let sheet = Shape::Extrusion { axis: 1, from: 2.0, to: 2.0, outline: outline.clone(), arcs: Vec::new() };
    assert_eq!(found(&sheet), Some(vec![Box3 { min: [0.0, 2.0, 0.0], max: [3.0, 2.0, 1.0] }]));
    let mut sloping = outline;
    sloping[0][1] = -1e-9;
    assert_eq!(
        found(&Shape::Extrusion { axis: 1, from: 0.0, to: 1.0, outline: sloping, arcs: Vec::new() }),
        None
    );
}

#[test]
fn round_bodies_are_no_boxes() {
    assert_eq!(found(&Shape::Sphere { center: [0.0; 3], radius: 1.0 }), None);
    assert_eq!(found(&Shape::Cylinder { axis: 0, base: [0.0; 3], radius: 1.0, height: 1.0 }), None);
}

#[test]
fn a_grid_of_more_cells_than_allowed_is_not_looked_at() {
    let surface = Shape::Surface(surface_of(&[[0; 3], [1, 0, 0], [1, 1, 0], [1, 1, 1]], uneven));
    assert_eq!(boxes_of(&surface, 8).map(|boxes| boxes.len()), Some(2));
    assert_eq!(boxes_of(&surface, 7), None);
}

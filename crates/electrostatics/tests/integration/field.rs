//! The field that is kept for export.

use elastocap_electrostatics::{Settings, solve};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// The field is minus the gradient of the potential, on either side of each mirror plane: the potential is even about two of
/// them and odd about the third.
#[test]
fn the_field_points_down_the_potential_on_both_sides_of_every_mirror_plane() {
    let plate = |name: &str, x2: f64| {
        let region = Box3 { min: [-0.5, x2, -0.5], max: [0.5, x2, 0.5] };
        Body::conductor(name, Shape::Box(region))
    };
    let scene = Scene {
        bodies: vec![plate("lower", -0.2), plate("upper", 0.2)],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let settings = Settings { relative_tolerance: 1e-2, field: true, ..Settings::default() };
    let solution = solve(&scene, &settings).unwrap();
    assert_eq!(solution.mirrored, [true; 3]);
    let field = solution.field.unwrap();
    let nodes = field.nodes.each_ref().map(Vec::len);
    let cells = nodes.map(|n| n - 1);
    for axis in 0..3 {
        for upper_half in [false, true] {
            // Of the field along the axis and the falling potential over a cell: products and squares, summed.
            let (mut product, mut squares) = (0.0, [0.0; 2]);
            for index in 0..cells[0] * cells[1] * cells[2] {
                let cell = [index / (cells[1] * cells[2]), index / cells[2] % cells[1], index % cells[2]];
                let [low, high] = [0, 1].map(|side| field.nodes[axis][cell[axis] + side]);
                if (low >= 0.0) != upper_half {
                    continue;
                }
                let fall: f64 = (0..8_usize)
                    .map(|corner| {
                        let at = [0, 1, 2].map(|a| cell[a] + (corner >> a & 1));
                        let potential = field.potential[(at[0] * nodes[1] + at[1]) * nodes[2] + at[2]];
                        if corner >> axis & 1 == 1 { -0.25 * potential } else { 0.25 * potential }
                    })
                    .sum();
                let (slope, along) = (fall / (high - low), field.electric_field[index][axis]);
                product += slope * along;
                squares = [squares[0] + slope * slope, squares[1] + along * along];
            }
            let likeness = product / (squares[0] * squares[1]).sqrt();
            assert!(likeness > 0.9, "axis {axis}, upper half {upper_half}: {likeness}");
        }
    }
}

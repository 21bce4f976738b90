//! Compares the files of figures with formulas and audited values.

use elastocap_evidence::figures::{Drawn, Item, Session};

/// `theta` at 40 % compression, and `mu/C1` of the paper's rubber.
const THETA: f64 = 1.085507127197;
const MU_OVER_C1: f64 = 89228.1 / 1364.3;

/// The rows of a CSV file as numbers, NaN where a cell is empty.
fn rows(drawn: &Drawn, name: &str) -> Vec<Vec<f64>> {
    let (_, text) = drawn.files.iter().find(|(file, _)| file == name).unwrap_or_else(|| panic!("{name}"));
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    text.lines().skip(1).map(|line| line.split(',').map(number).collect()).collect()
}

/// The row at parameter and abscissa.
fn at(rows: &[Vec<f64>], parameter: f64, x: f64) -> &[f64] {
    rows.iter().find(|r| (r[0] - parameter).abs() < 1e-9 && (r[1] - x).abs() < 1e-9).unwrap()
}

fn assert_near(found: f64, right: f64, tolerance: f64) {
    assert!((found - right).abs() <= tolerance * right.abs(), "{found} {right}");
}

#[test]
fn profiles_at_forty_per_cent_are_the_closed_forms_and_the_finite_elements_follow() {
    let mut session = Session::default();
    let (twelve, thirteen) = (session.draw(Item::Figure12).unwrap(), session.draw(Item::Figure13).unwrap());
    assert!(twelve.missing.is_empty() && thirteen.missing.is_empty(), "{twelve:?}");
    let lambda = 1.0 / THETA.cos();
    let s11 = rows(&twelve, "figure-12a.csv");
    // (44a): T11 f = mu (f^2 - 1/(2 f^2)) - B on the axis, whatever B.
    let rise = at(&s11, 1.0, 0.0)[2] - at(&s11, 0.0, 0.0)[2];
    assert_near(rise, MU_OVER_C1 * (lambda * lambda - 0.5 / (lambda * lambda) - 0.5), 1e-6);
    assert_near(
        at(&rows(&twelve, "figure-12c.csv"), 0.0, 2.0)[2],
        MU_OVER_C1 * 2.0 * THETA * THETA.tan(),
        1e-6,
    );
    assert_near(at(&rows(&twelve, "figure-12d.csv"), 1.0, 1.5)[2], 1.5 * (lambda - 1.0), 1e-9);
    assert_near(at(&rows(&thirteen, "figure-13a.csv"), 1.5, 1.0)[2], 1.5 * (lambda - 1.0), 1e-9);
    assert_near(at(&rows(&thirteen, "figure-13b.csv"), 0.5, 1.0)[2], -0.4, 1e-12);
    for panel in ["12a", "12b", "12c", "12d", "12e"] {
        let values = rows(&twelve, &format!("figure-{panel}.csv"));
        let largest = values.iter().fold(0.0f64, |m, r| m.max(r[3].abs()));
        assert_eq!(values.len(), 5 * 33);
        let near = values.iter().filter(|r| r[1] <= 1.0);
        let worst = near.fold(0.0f64, |m, r| m.max((r[2] - r[3]).abs())) / largest;
        println!("{panel}: {worst:.1e} of {largest}");
        // Far from the end the closed form is right; NaN would not pass.
        assert!(worst < 5e-3 && values.iter().all(|r| r[3].is_finite()), "{panel}: {worst}");
    }
}

#[test]
fn the_bonded_edge_is_in_balance_with_the_shear_length_of_its_figure() {
    let drawn = Session::default().draw(Item::Figure7).unwrap();
    let values = rows(&drawn, "figure-7.csv");
    for compression in [0.05, 0.1] {
        let edge: Vec<_> = values.iter().filter(|r| r[0] == compression).collect();
        assert_eq!(edge.len(), 121);
        // The closed form's straight line up to L and the finite elements' curve have the same area: that is
        // (43). The line is drawn up to the last abscissa before L; they are 0.05 apart.
        let slope = edge[1][2] / edge[1][1];
        let area: f64 = edge.windows(2).map(|p| 0.5 * (p[1][1] - p[0][1]) * (p[0][3] + p[1][3])).sum();
        let length = (2.0 * area / slope).sqrt();
        let last = edge.iter().rfind(|r| r[2].is_finite()).unwrap()[1];
        println!("{compression}: {length} {last}");
        assert!(length > last && length < last + 0.05, "{length} {last}");
    }
    // Points that the punch does not reach are listed, not drawn.
    assert!(drawn.missing.iter().all(|text| text.contains("beyond U/H")), "{drawn:?}");
    assert!(drawn.missing.is_empty() == values.iter().any(|r| r[0] == 0.4));
}

#[test]
fn names_lead_back_to_their_items_and_a_session_gives_the_same_files_twice() {
    for item in Item::ALL {
        assert_eq!(Item::from_name(item.name()), Some(item));
    }
    assert_eq!(Item::from_name("8"), None);
    let mut session = Session::default();
    let (first, second) = (session.draw(Item::Figure6).unwrap(), session.draw(Item::Figure6).unwrap());
    assert_eq!(first, second);
    assert_eq!(first, Session::default().draw(Item::Figure6).unwrap());
    assert!(first.files.iter().all(|(_, text)| text.len() < 150_000 && !text.contains("NaN")));
}

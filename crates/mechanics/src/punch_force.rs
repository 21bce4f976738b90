//! The force of a flat punch on a long layer, and of a plate over a layer that ends with it, from finite
//! elements: the reference for the closed form of the force.
//!
//! In plane strain an incompressible neo-Hookean or Mooney-Rivlin layer, bonded to its base, has a force of
//! `F / (mu H w)` that depends on two numbers only: the punch's half-width `a / H` and the compression
//! `U / H`, where `w` is the width along `x3` and `mu` the shear modulus. It is tabulated for a punch with
//! sharp corners, in contact without friction. The table is printed by
//! `cargo run --release -p elastocap-mechanics --example punch_forces`, to half a per cent.

/// The half-widths `a / H` of the punch for which there is a row of the table.
pub const HALF_WIDTHS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];

/// The compressions `U / H` for which there is a column in both tables.
pub const COMPRESSIONS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4];

/// `F / (mu U w)` of the punch, which has a finite limit without load.
const STIFFNESSES: [[f64; COMPRESSIONS.len()]; HALF_WIDTHS.len()] = [
    [5.4443, 5.4773, 5.5305, 5.6935, 6.0216, 6.6429],
    [10.3219, 10.3463, 10.4128, 10.6202, 11.1017, 12.0716],
    [24.9171, 24.8759, 24.8168, 24.9855, 25.8273, 27.7632],
    [77.7778, 77.3628, 76.8581, 77.1590, 79.7702, 85.6684],
    [319.3332, 317.3330, 316.1422, 322.5381, 339.6229, 370.7320],
];

/// The half-lengths `a / H` of the plate for which there is a row of its table.
const HALF_LENGTHS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// `F / (mu U w)` of a smooth plate over the whole top of a layer of half-length `a` whose ends are free,
/// bonded to a substrate that goes on: by `[mechanics.plane_strain]` with `indenter = "whole-top"` and `end =
/// "free-on-substrate"`, to 2 %. At large compressions the rubber rolls out under the plate and onto the
/// substrate.
const STIFFNESSES_OF_PLATES: [[f64; COMPRESSIONS.len()]; HALF_LENGTHS.len()] = [
    [2.2001, 2.3082, 2.5128, 3.0335, 3.7641, 4.8650],
    [4.6894, 4.9126, 5.3213, 6.2612, 7.5354, 9.5531],
    [10.8471, 11.3345, 12.1565, 14.0990, 17.3392, 23.9230],
    [33.2464, 34.9094, 37.8615, 47.6655, 65.9030, 98.9810],
    [162.8087, 173.5230, 198.4532, 273.7098, 395.3896, 608.0339],
    [1117.1306, 1217.2142, 1427.5553, 1989.5029, 2896.8118, 4499.3850],
];

/// `F / (mu H w)` of a flat punch of this half-width over the thickness, without friction, at a compression
/// `U / H`.
///
/// Known to 2 %, between the rows and columns of the table too. Wider punches than those of the table are
/// extrapolated: beyond a few thicknesses the cube root of the force is linear in the half-width, as in
/// lubrication. `None` for narrower ones, and beyond the compressions of the table.
pub fn punch_force(half_width: f64, compression: f64) -> Option<f64> {
    tabulated_force(&HALF_WIDTHS, &STIFFNESSES, half_width, compression)
}

/// `F / (mu H w)` of a smooth plate over the whole top of a layer of this half-length over the thickness,
/// which ends with the plate, at a compression `U / H`.
///
/// Known to 5 %. Longer plates than those of the table are extrapolated, and `None` is returned for others
/// outside the table, as by [`punch_force`].
pub fn plate_force(half_length: f64, compression: f64) -> Option<f64> {
    tabulated_force(&HALF_LENGTHS, &STIFFNESSES_OF_PLATES, half_length, compression)
}

/// `F / (mu H w)` by a table of `F / (mu U w)`, whose `rows` are these `a / H`.
fn tabulated_force(
    rows: &[f64],
    table: &[[f64; COMPRESSIONS.len()]],
    half_width: f64,
    compression: f64,
) -> Option<f64> {
    let [narrowest, .., before, last] = *rows else { return None };
    let largest = COMPRESSIONS[COMPRESSIONS.len() - 1] * (1.0 + 1e-9);
    if !(half_width >= narrowest * (1.0 - 1e-9)
        && half_width.is_finite()
        && (0.0..=largest).contains(&compression))
    {
        return None;
    }
    let stiffnesses: Vec<f64> =
        table.iter().map(|row| interpolated(&COMPRESSIONS, row, compression)).collect();
    let stiffness = if half_width > last {
        let [.., of_before, of_last] = stiffnesses[..] else { return None };
        let slope = (of_last.cbrt() - of_before.cbrt()) / (last - before);
        (of_last.cbrt() + slope * (half_width - last)).powi(3)
    } else {
        let half_widths: Vec<f64> = rows.iter().map(|a| a.ln()).collect();
        let logarithms: Vec<f64> = stiffnesses.iter().map(|k| k.ln()).collect();
        interpolated(&half_widths, &logarithms, half_width.ln()).exp()
    };
    Some(compression * stiffness)
}

/// The value at `x` of the cubic through the four points around it, from the `values` at the ascending
/// coordinates `xs`.
fn interpolated(xs: &[f64], values: &[f64], x: f64) -> f64 {
    let after = xs.partition_point(|known| *known < x);
    let first = after.saturating_sub(2).min(xs.len().saturating_sub(4));
    let near = first..xs.len().min(first + 4);
    near.clone()
        .map(|i| {
            let factor = |j: usize| (x - xs[j]) / (xs[i] - xs[j]);
            values[i] * near.clone().filter(|j| *j != i).map(factor).product::<f64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_between_the_rows_of_the_table_and_beyond_it_are_those_of_finite_elements() {
        // Another program run: `--example sharp_punch -- 1.1111 5e-3 : 0.05 0.1 0.2` gives 1.440, 2.883,
        // 5.80, and punches with corners rounded by 0.02 H and 0.005 H the same (docs/mechanics.md). Those of
        // half-width 3 are rounded by 0.05 H.
        let known = [
            (500.0 / 450.0, [(0.05, 1.440), (0.1, 2.883), (0.2, 5.82), (0.3, 8.99), (0.4, 12.87)].to_vec()),
            (3.0, [(0.05, 8.466), (0.2, 34.24), (0.3, 53.6)].to_vec()),
            (8.0, [(0.05, 83.71), (0.1, 168.9), (0.2, 354.8)].to_vec()),
        ];
        for (half_width, forces) in known {
            for (compression, force) in forces {
                let found = punch_force(half_width, compression).unwrap();
                assert!((found / force - 1.0).abs() < 0.02, "{half_width} {compression}: {found} {force}");
            }
        }
    }

    #[test]
    fn a_plate_over_a_layer_that_ends_with_it_has_less_force_than_a_punch_at_small_loads_and_may_have_more_at_large_ones()
     {
        for half_length in [0.3, 1.5, 6.0, 20.0] {
            let [punch, plate] = [punch_force, plate_force].map(|force| force(half_length, 0.05).unwrap());
            assert!((0.35..0.9).contains(&(plate / punch)), "{half_length}: {plate} {punch}");
        }
        assert!(plate_force(8.0, 0.4) > punch_force(8.0, 0.4));
        // Other half-lengths than those of the table, by runs of the same model.
        for (half_length, compression, stiffness) in
            [(1.5, 0.05, 20.7559), (1.5, 0.2, 26.7012), (6.0, 0.05, 530.4017), (6.0, 0.4, 1942.431)]
        {
            let found = plate_force(half_length, compression).unwrap() / compression;
            assert!((found / stiffness - 1.0).abs() < 0.05, "{half_length} {compression}: {found}");
        }
    }

    #[test]
    fn there_is_no_force_without_load_and_none_is_given_outside_the_table() {
        assert_eq!(punch_force(1.0, 0.0), Some(0.0));
        assert!(punch_force(1e3, 0.4).is_some_and(|force| force > 1e8 && force < 1e10));
        for (half_width, compression) in
            [(0.2, 0.1), (1.0, 0.41), (1.0, -0.1), (f64::NAN, 0.1), (1.0, f64::NAN), (f64::INFINITY, 0.1)]
        {
            assert_eq!(punch_force(half_width, compression), None, "{half_width} {compression}");
        }
    }
}

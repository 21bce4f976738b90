//! Tables 1 and 2 of the paper.

use elastocap_mechanics::LayerMap;

use super::panel::cell;
use super::{Drawn, FigureError};

/// `U/H` in per cent, and `alpha` and `1000 alpha^2` as printed, for `H = 50`.
const TABLE_1: [(f64, f64, f64); 7] = [
    (5.0, 0.007745108450011, 0.059986704902432),
    (10.0, 0.010949428377488, 0.119889981793739),
    (15.0, 0.013402082218189, 0.179615807783098),
    (20.0, 0.015461483663554, 0.239057477078347),
    (25.0, 0.017265407642140, 0.298094301049266),
    (30.0, 0.018883597411389, 0.356590251195417),
    (40.0, 0.021710142543939, 0.471330289278150),
];
/// `K0/mu0` and Poisson's ratio as printed.
const TABLE_2: [(f64, f64); 6] =
    [(10.0, 0.452), (20.0, 0.475), (50.0, 0.490), (100.0, 0.495), (1000.0, 0.4995), (10_000.0, 0.49995)];
/// The thickness that Table 1 is for.
const PRINTED_THICKNESS: f64 = 50.0;

/// Table 1: the phase angle over the compression.
pub(super) fn phase_angles() -> Result<Drawn, FigureError> {
    let mut csv = "compression_percent,theta_rad,alpha_for_h_50,thousand_alpha_squared_for_h_50,\
                   printed_alpha_h,printed_alpha_h_squared\n"
        .to_owned();
    let mut worst: f64 = 0.0;
    for (percent, printed, printed_square) in TABLE_1 {
        let theta = LayerMap::new(1.0, percent / 100.0)?.theta();
        let alpha = theta / PRINTED_THICKNESS;
        let square = 1000.0 * alpha * alpha;
        worst = worst.max((alpha / printed - 1.0).abs()).max((square / printed_square - 1.0).abs());
        let row = [percent, theta, alpha, square, printed, printed_square];
        csv.push_str(&row.map(cell).join(","));
        csv.push('\n');
    }
    Ok(Drawn {
        files: vec![("table-1.csv".into(), csv)],
        findings: vec![format!(
            "table-1: the printed columns are alpha and 1000 alpha^2 for H = 50 and agree to {worst:.0e}"
        )],
        missing: Vec::new(),
    })
}

/// Table 2: Poisson's ratio over the ratio of the moduli.
pub(super) fn poisson_ratios() -> Drawn {
    let mut csv = "bulk_over_shear_modulus,poisson_ratio,printed_poisson_ratio\n".to_owned();
    let mut worst: f64 = 0.0;
    for (ratio, printed) in TABLE_2 {
        let nu = poisson_ratio(ratio);
        worst = worst.max((nu - printed).abs());
        csv.push_str(&[ratio, nu, printed].map(cell).join(","));
        csv.push('\n');
    }
    Drawn {
        files: vec![("table-2.csv".into(), csv)],
        findings: vec![format!("table-2: the printed ratios are those of (47) to {worst:.0e}, as rounded")],
        missing: Vec::new(),
    }
}

/// Poisson's ratio for the ratio `K/mu` of the moduli, (47).
fn poisson_ratio(ratio: f64) -> f64 {
    (3.0 * ratio - 2.0) / (6.0 * ratio + 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_hold_what_is_known() {
        let table = phase_angles().unwrap().files[0].1.clone();
        // theta of the audited closed form; alpha for H = 50 is a fiftieth of it.
        let thetas = [
            0.387255422501,
            0.547471418874,
            0.670104110909,
            0.773074183178,
            0.863270382107,
            0.944179870569,
            1.085507127197,
        ];
        for (line, theta) in table.lines().skip(1).zip(thetas) {
            let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
            assert!((cells[1] / theta - 1.0f64).abs() < 1e-9, "{line}");
            assert!(
                (cells[2] / cells[4] - 1.0).abs() < 1e-9 && (cells[3] / cells[5] - 1.0).abs() < 1e-9,
                "{line}"
            );
        }
        assert_eq!(table.lines().count(), 8);
        for (ratio, nu) in TABLE_2 {
            // Three significant digits of 1/2 - nu are printed at most.
            assert!((poisson_ratio(ratio) - nu).abs() < 5.1e-4, "{ratio}: {}", poisson_ratio(ratio));
        }
        assert!((poisson_ratio(1e4) - 0.49995).abs() < 1e-7);
    }
}

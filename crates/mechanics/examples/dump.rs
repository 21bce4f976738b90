use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::material::Rubber;
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::obstacle::Shape;
fn main() {
    let words: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| words.get(k).and_then(|w| w.parse().ok()).unwrap_or(default);
    let v = |k: &str, d: f64| std::env::var(k).ok().and_then(|w| w.parse().ok()).unwrap_or(d);
    let (a, r) = (500.0 / 450.0, number(1, 0.02));
    let (mesh, ind) = if r > 0.0 {
        (
            LayerMesh::under_rounded_punch(1.0, 6.0, a, r, number(2, 8.0) as usize),
            Indenter::Smooth(Shape::Punch { half_width: a, corner_radius: r }),
        )
    } else {
        (
            LayerMesh::under_punch(
                1.0,
                6.0,
                a,
                number(2, 8.0) as usize,
                v("Q", 0.7),
                v("RINGS", 6.0) as usize,
            ),
            Indenter::Sharp { half_width: a },
        )
    };

    let d = NewtonSettings::default();
    let settings = NewtonSettings {
        moving_gap: v("GAP", d.moving_gap),
        smallest_ratio: v("RATIO", d.smallest_ratio),
        first_step: v("STEP", d.first_step),
        most_solves: v("SOLVES", 600.0) as usize,
        most_iterations: v("ITER", 20.0) as usize,
        ..d
    };
    let start = std::time::Instant::now();
    let rubber = Rubber { volume_barrier: number(4, 2.0), ..Rubber::neo_hookean(1.0) };
    let mut model = LayerModel::new(&mesh, rubber, ind, End::Free).unwrap();
    for k in 1..=20 {
        let u = number(3, 0.05) * k as f64 / 4.0;
        if k > v("N", 4.0) as usize {
            break;
        }
        match model.press(u, &settings) {
            Ok(s) => println!(
                "{} {} J {} {:?} {:?}",
                s.compression,
                s.force,
                s.effort.smallest_j,
                s.effort,
                start.elapsed()
            ),
            Err(e) => {
                println!("{e}");
                break;
            }
        }
    }
    let eq = model.equations();
    let mut top: Vec<_> = eq
        .body()
        .mesh
        .nodes
        .iter()
        .enumerate()
        .filter(|(_, x)| x[1] > 1.0 - 1e-9 && (x[0] - a).abs() < v("XX", 0.0))
        .map(|(n, x)| (x[0], n))
        .collect();
    top.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (x, n) in top {
        println!(
            "X {x:.6} y1 {:.6} u2 {:.6}",
            x + model.state().displacement[2 * n],
            model.state().displacement[2 * n + 1]
        );
    }
    let mut rows = model.equations().contact_pressure(0, model.state());
    rows.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    for (x, g, p) in rows {
        if x[0] > v("X0", 0.0) && x[0] < v("X1", 0.0) {
            println!("x {:.4} gap {g:.2e} p {p:.3}", x[0]);
        }
    }
}

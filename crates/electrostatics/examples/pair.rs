//! scratch
use elastocap_electrostatics::{domain::*, dual::Dual, krylov, primal::Primal};
use elastocap_fem::tensor::dot;
use elastocap_geometry::{grid::*, scene::Wall};
fn main() {
    let arg: Vec<f64> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
    let (order, levels, slope, first, ratio, tol) = (arg[0] as usize, arg[1] as usize, arg[2], arg[3] as usize, arg[4], arg[5]);
    let r = Resolution { order, levels, ratio, slope, first, outer: 0 };
    let e = |at: f64| Plane { at: at / 450.0, edge: true };
    let n = |at: f64| Plane { at: at / 450.0, edge: false };
    let ax = |planes: &[Plane], walls| {
        let g = graded_axis(planes, [End::Closed; 2], &r);
        Axis { line: g.line, cuts: g.cuts, walls }
    };
    use Wall::*;
    let t0 = std::time::Instant::now();
    let axes = [
        ax(&[n(0.), e(25.), e(325.), n(1325.)], [Grounded, Insulated]),
        ax(&[n(0.), e(215.), e(235.), n(450.), n(1450.)], [Insulated, Insulated]),
        ax(&[n(0.), e(250.), n(1250.)], [Insulated, Insulated]),
    ];
    let cells = [3, 4, 2];
    let mut permittivity = vec![];
    for _ in 0..cells[0] { for j in 0..cells[1] { for _ in 0..cells[2] { permittivity.push(if j < 3 { 2.8 } else { 1.0 }); } } }
    let d = Domain { axes, conductors: vec![Block { lo: [1, 1, 0], hi: [2, 2, 1] }], permittivity };
    let unit = 8.8541878128e-12 * 450e-6 * 1e15; // quarter energy with V=1 on one electrode -> C
    let exact = 43.96589;
    let mut p = Primal::new(&d).unwrap();
    let t1 = std::time::Instant::now();
    let u0 = p.lift(&[1.0]);
    let mut b = p.full_product(&u0);
    p.clear_prescribed(&mut b);
    for x in &mut b { *x = -*x; }
    let mut x = vec![0.0; b.len()];
    let mut res = vec![];
    let c = krylov::solve(&mut p, &b, &mut x, &mut res, tol * 1.0);
    for (x, u) in x.iter_mut().zip(&u0) { *x += u; }
    let ax_ = p.full_product(&x);
    let up = dot(&x, &ax_) * unit;
    let t2 = std::time::Instant::now();
    println!("primal N={} {:?} C={:.6} err {:.2e} setup {:.4} solve {:.4} {:?}", p.unknowns(), p.dims(), up, up / exact - 1.0, (t1 - t0).as_secs_f64(), (t2 - t1).as_secs_f64(), c);
    let mut q = Dual::new(&d).unwrap();
    let t3 = std::time::Instant::now();
    let b = q.source(&[1.0]);
    let mut x = vec![0.0; b.len()];
    let c = krylov::solve(&mut q, &b, &mut x, &mut res, tol * 1.0);
    let t4 = std::time::Instant::now();
    q.balance(&mut x, &mut res);
    let (psi, left) = q.repair(&res);
    let g = q.face_energy(&[1.0], &[1.0]);
    let rep = dot(&psi, &res) * unit;
    let low = g * unit - dot(&x, &b) * unit - dot(&x, &res) * unit - rep;
    let t5 = std::time::Instant::now();
    println!("dual N={} C={:.6} err {:.2e} setup {:.4} solve {:.4} bound {:.4} repair {:.2e} left {:.2e} g {:.3e} {:?}", q.unknowns(), low, low / exact - 1.0, (t3 - t2).as_secs_f64(), (t4 - t3).as_secs_f64(), (t5 - t4).as_secs_f64(), rep, left, g * unit, c);
    println!("spread {:.2e} mid err {:.2e}", (up - low) / exact, (up + low) / 2.0 / exact - 1.0);
}

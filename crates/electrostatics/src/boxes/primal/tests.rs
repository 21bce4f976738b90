//! The primal discretisation against a manufactured solution, and its algebra against physics.

use super::Primal;
use crate::boxes::domain::{Axis, Block, Domain};
use elastocap_fem::line::{Element, Line, LineEnd, Numbering, hierarchical};
use elastocap_fem::quadrature::gauss_legendre;
use elastocap_fem::tensor::dot;
use elastocap_geometry::scene::Wall;
use elastocap_linalg::conjugate_gradients::{Goal, ITERATION_LIMIT, Operator, solve};
use std::f64::consts::PI;

fn axis(nodes: Vec<f64>, degree: usize, cuts: Vec<usize>, wall: Wall) -> Axis {
    let degrees = vec![degree; nodes.len() - 1];
    let line = Line { nodes, degrees, ends: [LineEnd::Finite; 2] };
    Axis { line, cuts, walls: [wall; 2], rays: None }
}

/// Integrals of sin(pi x) against the functions of an axis with both ends held.
fn load(axis: &Axis) -> Vec<f64> {
    let numbering = Numbering::new(&axis.line);
    let mut out = vec![0.0; numbering.len];
    let (points, weights) = gauss_legendre(20);
    for e in 0..axis.line.elements() {
        let Element::Finite { start, length } = axis.line.element(e) else { continue };
        for (s, w) in points.iter().zip(&weights) {
            let x = start + 0.5 * (s + 1.0) * length;
            let (value, _) = hierarchical(axis.line.degree(e), *s);
            for (local, index) in numbering.element(&axis.line, e).into_iter().enumerate() {
                out[index.unwrap()] += 0.5 * length * w * (PI * x).sin() * value[local];
            }
        }
    }
    out[axis.functions()].to_vec()
}

/// Energy error of -div grad u = 3 pi^2 u, u = sin(pi x) sin(pi y) sin(pi z) on the unit cube.
fn energy_error(elements: usize, degree: usize) -> f64 {
    let nodes: Vec<f64> = (0..=elements).map(|i| i as f64 / elements as f64).collect();
    let one = || axis(nodes.clone(), degree, vec![0, elements], Wall::Grounded);
    let domain = Domain {
        axes: [one(), one(), one()],
        conductors: Vec::new(),
        permittivity: vec![1.0],
        map: None,
        turn: None,
    };
    let l = load(&domain.axes[0]);
    let mut b = Vec::new();
    for x in &l {
        for y in &l {
            b.extend(l.iter().map(|z| 3.0 * PI * PI * x * y * z));
        }
    }
    let mut primal = Primal::new(&domain).unwrap();
    let mut u = vec![0.0; b.len()];
    let mut r = Vec::new();
    assert!(
        solve(
            &mut primal,
            &b,
            &mut u,
            &mut r,
            Goal { share: 1e-22, start: 1.0, iteration_limit: ITERATION_LIMIT, cancel: None }
        )
        .iterations
            < 40
    );
    // Galerkin: the energy of the error is the energy of the solution less that of the approximation, b u.
    3.0 * PI * PI / 8.0 - dot(&b, &u)
}

#[test]
fn the_energy_error_of_a_smooth_solution_falls_with_twice_the_order() {
    for degree in 1..=4 {
        let (coarse, fine) = (energy_error(4, degree), energy_error(8, degree));
        let order = (coarse / fine).log2();
        assert!(coarse > 0.0 && fine > 0.0);
        assert!((order - 2.0 * degree as f64).abs() < 0.15, "degree {degree}: order {order}");
    }
}

/// Two unequal blocks in a grounded box with two dielectrics.
fn two_blocks() -> Domain {
    let one = |wall| axis(vec![0.0, 0.3, 0.5, 0.9, 1.2, 2.0], 3, vec![0, 1, 2, 3, 4, 5], wall);
    let permittivity = (0..125).map(|c| if c / 5 % 5 < 3 { 1.0 } else { 4.0 }).collect();
    Domain {
        axes: [one(Wall::Grounded), one(Wall::Grounded), one(Wall::Insulated)],
        conductors: vec![Block { lo: [1, 1, 1], hi: [2, 2, 3] }, Block { lo: [3, 3, 2], hi: [4, 4, 2] }],
        permittivity,
        map: None,
        turn: None,
    }
}

#[test]
fn charges_are_reciprocal_and_give_the_energy() {
    let mut primal = Primal::new(&two_blocks()).unwrap();
    let unit: Vec<Vec<f64>> = (0..2).map(|c| primal.lift(&[f64::from(c == 0), f64::from(c == 1)])).collect();
    let mut charge = [[0.0; 2]; 2];
    let mut energy = [0.0; 2];
    for c in 0..2 {
        let mut b = primal.full_product(&unit[c]);
        primal.clear_prescribed(&mut b);
        b.iter_mut().for_each(|x| *x = -*x);
        let mut u = vec![0.0; b.len()];
        let mut r = Vec::new();
        solve(
            &mut primal,
            &b,
            &mut u,
            &mut r,
            Goal { share: 1e-24, start: 1.0, iteration_limit: ITERATION_LIMIT, cancel: None },
        );
        u.iter_mut().zip(&unit[c]).for_each(|(u, l)| *u += l);
        let field = primal.full_product(&u);
        energy[c] = dot(&u, &field);
        for k in 0..2 {
            charge[k][c] = dot(&unit[k], &field);
        }
    }
    assert!((charge[0][1] - charge[1][0]).abs() < 1e-11 * charge[0][0]);
    for c in 0..2 {
        assert!((charge[c][c] - energy[c]).abs() < 1e-11 * energy[c], "{charge:?} {energy:?}");
        // Some flux goes to the grounded walls: the diagonal dominates.
        assert!(charge[c][c] > -charge[1 - c][c] && charge[1 - c][c] < 0.0);
    }
}

#[test]
fn the_iteration_does_not_feel_order_or_grading() {
    let iterations = |degree: usize, ratio: f64| {
        let mut nodes = vec![0.0];
        nodes.extend((0..6).rev().map(|k| 0.5 * ratio.powi(k)));
        nodes.push(1.0);
        let n = nodes.len() - 1;
        let one = |wall| axis(nodes.clone(), degree, vec![0, n - 1, n], wall);
        let domain = Domain {
            axes: [one(Wall::Grounded), one(Wall::Grounded), one(Wall::Insulated)],
            conductors: vec![Block { lo: [1, 1, 1], hi: [2, 2, 2] }],
            permittivity: vec![1.0; 8],
            map: None,
            turn: None,
        };
        let mut primal = Primal::new(&domain).unwrap();
        let lift = primal.lift(&[1.0]);
        let mut b = primal.full_product(&lift);
        let start = dot(&lift, &b);
        primal.clear_prescribed(&mut b);
        b.iter_mut().for_each(|x| *x = -*x);
        let mut u = vec![0.0; primal.unknowns()];
        solve(
            &mut primal,
            &b,
            &mut u,
            &mut Vec::new(),
            Goal { share: 1e-8, start, iteration_limit: ITERATION_LIMIT, cancel: None },
        )
        .iterations
    };
    for (degree, ratio) in [(2, 0.5), (6, 0.5), (2, 0.1), (6, 0.1)] {
        assert!(
            iterations(degree, ratio) <= 16,
            "degree {degree}, ratio {ratio}: {}",
            iterations(degree, ratio)
        );
    }
}

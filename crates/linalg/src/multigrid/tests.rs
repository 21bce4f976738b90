use super::*;
use crate::conjugate_gradients::{Goal, ITERATION_LIMIT, solve};
use crate::reduction::dot;

/// The seven-point Laplacian on n^3 points between zeros, with the coefficient `of` at each point to its next
/// ones.
fn laplacian(n: usize, of: impl Fn([usize; 3]) -> f64 + Sync) -> SparseMatrix {
    SparseMatrix::build(n * n * n, n * n * n, |i, terms| {
        let at = [i / (n * n), i / n % n, i % n];
        for axis in 0..3 {
            for (inside, step) in [(at[axis] > 0, -1), (at[axis] + 1 < n, 1)] {
                let mut next = at;
                let mut coefficient = of(at);
                if inside {
                    next[axis] = next[axis].wrapping_add_signed(step);
                    // The smaller of the two, so that the matrix is symmetric.
                    coefficient = coefficient.min(of(next));
                    terms.push((((next[0] * n + next[1]) * n + next[2]) as u32, -coefficient));
                }
                terms.push((i as u32, coefficient));
            }
        }
    })
}

/// Solves for a source of ones to 1e-10 of the energy and returns the iterations and the largest residual
/// over that of the start.
fn iterations(grid: &Multigrid) -> (usize, f64) {
    let n = grid.matrix().rows();
    let b = vec![1.0; n];
    let mut x = vec![0.0; n];
    // The energy at the solution is -b x / 2 <= 0: the iterations lower the energy from zero by its
    // magnitude.
    let goal = Goal { share: 1e-12, start: 0.0, iteration_limit: ITERATION_LIMIT, cancel: None };
    let end = solve(&mut grid.cycle(), &b, &mut x, &mut Vec::new(), goal);
    assert!(end.reached, "{end:?}");
    let mut residual = b;
    grid.matrix().product(&x, &mut residual, |product, b| b - product);
    (end.iterations, residual.iter().fold(0.0, |m: f64, r| m.max(r.abs())))
}

#[test]
fn iterations_for_a_laplacian_do_not_grow_with_its_size_nor_with_jumps_of_its_coefficient() {
    for n in [8, 16, 32] {
        let plain = Multigrid::new(laplacian(n, |_| 1.0), None);
        let layered =
            Multigrid::new(laplacian(n, |at| if (at[0] / 4).is_multiple_of(2) { 1.0 } else { 1e6 }), None);
        for (name, grid) in [("plain", plain), ("layered", layered)] {
            let (count, residual) = iterations(&grid);
            println!("{name} {n}: {count} iterations, residual {residual:e}, {} levels", grid.levels.len());
            assert!(count <= 15 && residual < 1e-2);
            assert!(grid.last.is_some());
        }
    }
}

#[test]
fn a_level_that_the_caller_knows_is_taken() {
    // Every second point of a line, linear between.
    let n = 2001;
    let line = |n: usize| {
        SparseMatrix::build(n, n, |i, terms| {
            terms.push((i as u32, 2.0));
            terms.extend((i > 0).then(|| (i as u32 - 1, -1.0)));
            terms.extend((i + 1 < n).then(|| (i as u32 + 1, -1.0)));
        })
    };
    let half = n / 2;
    let prolongation = SparseMatrix::build(n, half, |i, terms| {
        if i % 2 == 1 {
            terms.push((i as u32 / 2, 1.0));
        } else {
            terms.extend((i > 0).then(|| (i as u32 / 2 - 1, 0.5)));
            terms.extend((i / 2 < half).then_some((i as u32 / 2, 0.5)));
        }
    });
    let coarse = prolongation.transposed().times(&line(n).times(&prolongation));
    let grid = Multigrid::new(line(n), Some(CoarseLevel { prolongation, matrix: coarse }));
    assert_eq!(grid.levels[1].matrix.rows(), half);
    assert!(iterations(&grid).0 <= 25);
}

#[test]
fn the_cycle_is_symmetric() {
    let grid = Multigrid::new(laplacian(12, |_| 1.0), None);
    let n = grid.matrix().rows();
    let vector = |seed: f64| (0..n).map(|k| (seed * k as f64).sin()).collect::<Vec<_>>();
    let (a, b) = (vector(0.7), vector(1.9));
    let (mut of_a, mut of_b) = (vec![0.0; n], vec![0.0; n]);
    let mut cycle = grid.cycle();
    cycle.precondition(&a, &mut of_a);
    cycle.precondition(&b, &mut of_b);
    let (one, other) = (dot(&a, &of_b), dot(&b, &of_a));
    assert!((one - other).abs() < 1e-12 * (dot(&a, &of_a) * dot(&b, &of_b)).sqrt());
}

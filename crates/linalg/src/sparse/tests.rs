use super::*;
use faer::Mat;

/// A matrix with about a third of its entries, and the same as a dense one.
fn scattered(rows: usize, columns: usize, seed: usize) -> (SparseMatrix, Mat<f64>) {
    let value = |i: usize, j: usize| ((i * 31 + j * 17 + seed) as f64).sin();
    let present = |i: usize, j: usize| (i * 7 + j * 5 + i * j + seed).is_multiple_of(3);
    let sparse = SparseMatrix::build(rows, columns, |i, terms| {
        // From the last column on, and in two halves: rows take their terms in any order and add them up.
        for j in (0..columns).rev().filter(|&j| present(i, j)) {
            terms.push((j as u32, 0.5 * value(i, j)));
        }
        for j in (0..columns).filter(|&j| present(i, j)) {
            terms.push((j as u32, 0.5 * value(i, j)));
        }
    });
    let dense = Mat::from_fn(rows, columns, |i, j| if present(i, j) { value(i, j) } else { 0.0 });
    (sparse, dense)
}

fn dense(sparse: &SparseMatrix) -> Mat<f64> {
    let mut dense = Mat::zeros(sparse.rows(), sparse.columns());
    for i in 0..sparse.rows() {
        for (j, a) in sparse.terms(i) {
            dense[(i, j)] = a;
        }
    }
    dense
}

#[test]
fn the_product_with_a_vector_is_that_of_the_dense_matrix() {
    // More rows than one task has, and no multiple of it.
    let (sparse, dense) = scattered(2 * TASK + 37, 23, 4);
    let x = Mat::from_fn(23, 1, |j, _| (j as f64 * 0.3).cos());
    let expected = &dense * &x;
    let x: Vec<f64> = x.col(0).iter().copied().collect();
    let mut y = vec![1.0; sparse.rows()];
    sparse.product(&x, &mut y, |product, old| old - 2.0 * product);
    for (i, y) in y.iter().enumerate() {
        assert!((y - (1.0 - 2.0 * expected[(i, 0)])).abs() < 1e-13, "row {i}");
    }
}

#[test]
fn the_product_of_two_matrices_and_the_transpose_are_those_of_dense_ones() {
    let ((a, dense_a), (b, dense_b)) = (scattered(40, 23, 1), scattered(23, 31, 2));
    assert!((dense(&a.times(&b)) - &dense_a * &dense_b).norm_max() < 1e-13);
    assert!((dense(&a.transposed()) - dense_a.transpose()).norm_max() == 0.0);
    assert!((dense(&a) - &dense_a).norm_max() < 1e-15);
}

#[test]
fn the_diagonal_is_zero_where_it_has_no_entry() {
    let (a, dense) = scattered(20, 20, 5);
    let diagonal = a.diagonal();
    assert!(diagonal.contains(&0.0) && diagonal.iter().any(|d| *d != 0.0));
    assert!((0..20).all(|i| (diagonal[i] - dense[(i, i)]).abs() < 1e-15));
}

#[test]
fn products_are_the_same_bytes_at_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (a, _) = scattered(3 * TASK, 50, 0);
            let square = a.transposed().times(&a);
            let mut y = vec![0.0; 50];
            square.product(&[0.1; 50], &mut y, |product, _| product);
            y
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
#[should_panic(expected = "a column is too large")]
fn a_column_beyond_the_matrix_is_refused() {
    SparseMatrix::build(2, 3, |i, terms| terms.push((3 * i as u32, 1.0)));
}

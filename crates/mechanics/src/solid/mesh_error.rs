//! The error of a value on the finest of some meshes, from the differences between them.

/// Smallest order of convergence that is trusted: where the differences between meshes fall more slowly, or
/// grow, the meshes do not resolve the solution yet.
const MIN_ORDER: f64 = 1.0 / 3.0;

/// Factor of safety of Roache's grid convergence index for three meshes (J. Fluids Eng. 116, 405-413, 1994):
/// observed orders are never exact.
const SAFETY: f64 = 1.25;

/// Error of a value on the finest of meshes with elements of the given sizes, `(size, value)`, coarse to
/// fine. With two meshes, first order is assumed. `None` with one mesh.
pub fn error_on_finest(values: &[(f64, f64)]) -> Option<f64> {
    match *values {
        [.., first, before, now] => Some(error_of([first, before, now])),
        [before, now] => {
            let tail = 1.0 / (before.0 / now.0 - 1.0);
            Some((now.1 - before.1).abs() * tail.max(1.0))
        }
        _ => None,
    }
}

/// Error of the last of three values on meshes with elements of the given sizes, `(size, value)`.
///
/// The error of a value that converges with some power of the size is a geometric tail of the last
/// difference. The power is the observed one, limited to the range from [`MIN_ORDER`] to 1: singular corners
/// of the layer and of electrodes allow no more, and a higher one is not relied on. The error is never below
/// the last difference times [`SAFETY`]. The difference between two meshes can vanish by accident, but hardly
/// both differences between three: the last one counts as at least the one that second-order convergence
/// would leave of the one before.
pub(super) fn error_of([first, before, now]: [(f64, f64); 3]) -> f64 {
    // For a given order, the ratio of successive differences, and the ratio of the tail to the last
    // difference.
    let falls = |p: f64| (first.0.powf(p) - before.0.powf(p)) / (before.0.powf(p) - now.0.powf(p));
    let tail = |p: f64| 1.0 / ((before.0 / now.0).powf(p) - 1.0);
    let (earlier, last) = ((before.1 - first.1).abs(), (now.1 - before.1).abs());
    let left = earlier / falls(2.0);
    if left >= last {
        return SAFETY * left * tail(1.0).max(1.0);
    }
    // `falls` grows with the order.
    let (mut low, mut high) = (MIN_ORDER, 1.0);
    for _ in 0..30 {
        let order = 0.5 * (low + high);
        if earlier > falls(order) * last { low = order } else { high = order }
    }
    SAFETY * last * tail(low).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values on meshes of these sizes that converge to 1 with a power of the size.
    fn of_order(order: f64, sizes: [f64; 3]) -> [(f64, f64); 3] {
        sizes.map(|size: f64| (size, 1.0 - 0.1 * size.powf(order)))
    }

    #[test]
    fn the_error_is_a_quarter_above_the_true_one_at_any_order_up_to_the_first_and_more_beyond() {
        for sizes in [[1.0, 0.5, 0.25], [1.0 / 4.0, 1.0 / 6.0, 1.0 / 8.0], [0.0576, 0.0282, 0.0068]] {
            for order in [0.34, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0] {
                let values = of_order(order, sizes);
                let (found, truth) = (error_of(values), 1.0 - values[2].1);
                assert!(
                    found >= (SAFETY - 1e-6) * truth,
                    "order {order}, {sizes:?}: {found} is below {truth}"
                );
                if order <= 1.0 && sizes[0] == 1.0 {
                    assert!(found <= (SAFETY + 1e-6) * truth, "order {order}: {found} is above {truth}");
                }
                assert!(found >= values[2].1 - values[1].1);
            }
        }
    }

    #[test]
    fn the_error_on_three_meshes_is_that_of_the_last_three_and_on_two_that_of_first_order() {
        let values = of_order(0.7, [1.0, 0.5, 0.25]);
        let four = [(2.0, -5.0), values[0], values[1], values[2]];
        assert_eq!(error_on_finest(&four), Some(error_of(values)));
        assert_eq!(error_on_finest(&values), Some(error_of(values)));
        assert!((error_on_finest(&[(1.0, 1.3), (0.75, 1.2)]).unwrap() - 0.3).abs() < 1e-12);
        assert!((error_on_finest(&[(1.0, 1.3), (0.25, 1.2)]).unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(error_on_finest(&[(1.0, 3.0)]), None);
    }

    #[test]
    fn differences_that_do_not_fall_leave_more_than_the_last_one() {
        // The free end at 5 % on meshes that do not see its roll yet; finer ones have 8.58.
        let error = error_of([(1.0, 8.647), (0.5, 8.635), (0.25, 8.623)]);
        assert!(error > 8.623 - 8.575 && error < 1.5 * (8.623 - 8.575), "{error}");
    }

    #[test]
    fn where_meshes_converge_the_last_difference_counts_or_a_quarter_of_the_one_before() {
        // The end on the substrate at 30, 40 and 10 %.
        assert!(
            (error_of([(1.0, 118.610), (0.5, 118.591), (0.25, 118.591)]) - SAFETY * 0.25 * 0.019).abs()
                < 1e-9
        );
        assert!(
            (error_of([(1.0, 243.180), (0.5, 243.045), (0.25, 243.058)]) - SAFETY * 0.25 * 0.135).abs()
                < 1e-9
        );
        assert!((error_of([(1.0, 1.30), (0.5, 1.10), (0.25, 1.02)]) - SAFETY * 0.08).abs() < 1e-9);
        assert_eq!(error_of([(1.0, 2.0), (0.5, 2.0), (0.25, 2.0)]), 0.0);
    }
}

//! The few functions that the closed form needs beyond the standard library, free of cancellation.

/// Positive nodes and weights of the 16-point Gauss-Legendre rule on `[-1, 1]`.
const GAUSS_16: [(f64, f64); 8] = [
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_096),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_894),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_79),
    (0.755_404_408_355_003, 0.124_628_971_255_533_88),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_74),
    (0.458_016_777_657_227_37, 0.169_156_519_395_002_54),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
];

/// The integral of `integrand` from 0 to `end` by the 16-point Gauss-Legendre rule.
pub(crate) fn integrate_from_zero(end: f64, integrand: impl Fn(f64) -> f64) -> f64 {
    let half = 0.5 * end;
    let pairs =
        GAUSS_16.iter().map(|&(x, w)| w * (integrand(half * (1.0 - x)) + integrand(half * (1.0 + x))));
    half * pairs.sum::<f64>()
}

/// `sinh(x) / x - 1`, accurate relative to itself for `x >= 0`; zero at zero.
pub(crate) fn sinh_ratio_excess(x: f64) -> f64 {
    if x >= 2.0 {
        return x.sinh() / x - 1.0;
    }
    // The sum over k >= 1 of x^(2k) / (2k+1)!.
    let square = x * x;
    let mut term = square / 6.0;
    let mut sum = term;
    let mut k = 1.0;
    while term > 0.1 * f64::EPSILON * sum {
        term *= square / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
        sum += term;
        k += 1.0;
    }
    sum
}

/// `cosh(x) - sinh(x) / x`, accurate relative to itself for `x >= 0`; zero at zero.
pub(crate) fn cosh_minus_sinh_ratio(x: f64) -> f64 {
    if x >= 2.0 {
        return x.cosh() - x.sinh() / x;
    }
    // The sum over k >= 1 of 2k x^(2k) / (2k+1)!.
    let square = x * x;
    let mut term = square / 3.0;
    let mut sum = term;
    let mut k = 1.0;
    while term > 0.1 * f64::EPSILON * sum {
        term *= (k + 1.0) / k * square / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_and_the_direct_forms_meet() {
        let (below, above) = (2.0 - 4.0 * f64::EPSILON, 2.0);
        for function in [sinh_ratio_excess, cosh_minus_sinh_ratio] {
            assert!((function(below) / function(above) - 1.0).abs() < 8e-15);
            assert_eq!(function(0.0), 0.0);
        }
        assert!((sinh_ratio_excess(1e-8) / (1e-16 / 6.0) - 1.0).abs() < 1e-15);
        assert!((cosh_minus_sinh_ratio(1e-8) / (1e-16 / 3.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_quadrature_is_exact_for_polynomials_of_degree_31() {
        for degree in 0..=31 {
            let got = integrate_from_zero(1.0, |x| x.powi(degree));
            assert!((got * f64::from(degree + 1) - 1.0).abs() < 1e-14, "degree {degree}: {got}");
        }
    }
}

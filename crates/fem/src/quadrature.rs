//! Legendre polynomials and Gauss-Legendre quadrature on [-1, 1].

/// Values of the Legendre polynomials `L_0 .. L_degree` at `s`.
pub fn legendre(degree: usize, s: f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(degree + 1);
    values.push(1.0);
    if degree > 0 {
        values.push(s);
    }
    for n in 1..degree {
        let k = n as f64;
        values.push(((2.0 * k + 1.0) * s * values[n] - k * values[n - 1]) / (k + 1.0));
    }
    values
}

/// Nodes (ascending) and weights of the `n`-point Gauss-Legendre rule, exact for polynomials of degree `2 n -
/// 1`.
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut nodes = vec![0.0; n];
    let mut weights = vec![0.0; n];
    for i in 0..n.div_ceil(2) {
        // Newton's method from Tricomi's estimate of the i-th root: three steps reach rounding for every n,
        // six are safe.
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..6 {
            let values = legendre(n, x);
            slope = n as f64 * (x * values[n] - values[n - 1]) / (x * x - 1.0);
            x -= values[n] / slope;
        }
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        nodes[i] = -x;
        nodes[n - 1 - i] = x;
        weights[i] = weight;
        weights[n - 1 - i] = weight;
    }
    if n % 2 == 1 {
        nodes[n / 2] = 0.0;
    }
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rules_integrate_every_monomial_they_promise() {
        for n in 1..=20 {
            let (x, w) = gauss_legendre(n);
            for power in 0..2 * n {
                let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 2e-14, "n {n} power {power}: {sum} against {exact}");
            }
        }
    }
}

//! The permittivity as a sum of products of one factor per axis; each product is a term of the operator.

use crate::boxes::domain::{Block, Domain};

/// A product of one factor per axis and interval, and the block outside which it is zero.
pub(crate) type Product = (Block, [Vec<f64>; 3]);

/// The permittivity as a sum of products: a single one where possible, otherwise layers across one axis, each
/// with the least permittivity in it, and boxes with the excess. No product is negative, so that nothing
/// cancels.
pub(crate) fn separable_terms(domain: &Domain) -> Vec<Product> {
    let cells = domain.cells();
    let whole = Block { lo: [0; 3], hi: cells };
    if let Some(factors) = domain.product() {
        return vec![(whole, factors)];
    }
    // Layers lie across x2 mostly, so that this axis comes first: of equally good choices the first is taken.
    let choices = [1, 0, 2].map(|axis| {
        let layers = least(domain, axis);
        let boxes = boxes_above(domain, axis, &layers);
        (axis, layers, boxes)
    });
    let volume = |(block, _): &(Block, f64)| (0..3).map(|a| block.hi[a] - block.lo[a]).product::<usize>();
    let work = |boxes: &[(Block, f64)]| boxes.iter().map(volume).sum::<usize>();
    let best = choices.into_iter().min_by_key(|(.., boxes)| (work(boxes), boxes.len()));
    let Some((axis, layers, boxes)) = best else { return Vec::new() };
    let product_of = |along: usize, factors: Vec<f64>, block: &Block| {
        [0, 1, 2].map(|a| match a == along {
            true => factors.clone(),
            false => (0..cells[a]).map(|m| f64::from((block.lo[a]..block.hi[a]).contains(&m))).collect(),
        })
    };
    let of_box = |(block, excess): (Block, f64)| {
        let inside = |m: usize| (block.lo[axis]..block.hi[axis]).contains(&m);
        let factors = (0..cells[axis]).map(|m| if inside(m) { excess } else { 0.0 }).collect();
        (block, product_of(axis, factors, &block))
    };
    let layered = (whole, product_of(axis, layers, &whole));
    std::iter::once(layered).chain(boxes.into_iter().map(of_box)).collect()
}

/// The least permittivity in each interval of an axis.
fn least(domain: &Domain, axis: usize) -> Vec<f64> {
    let mut out = vec![f64::INFINITY; domain.cells()[axis]];
    for cell in all_cells(domain.cells()) {
        let least = &mut out[cell[axis]];
        *least = least.min(domain.permittivity_of(cell));
    }
    out
}

fn all_cells(n: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..n[0]).flat_map(move |i| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |k| [i, j, k])))
}

/// Boxes that do not overlap, each with the excess of the permittivity in it over that of layers across an
/// axis.
fn boxes_above(domain: &Domain, axis: usize, layers: &[f64]) -> Vec<(Block, f64)> {
    let n = domain.cells();
    let excess_in = |cell: [usize; 3]| domain.permittivity_of(cell) - layers[cell[axis]];
    let index = |[i, j, k]: [usize; 3]| (i * n[1] + j) * n[2] + k;
    let mut taken = vec![false; n.iter().product()];
    let mut out = Vec::new();
    for lo in all_cells(n) {
        let excess = excess_in(lo);
        if excess <= 0.0 || taken[index(lo)] {
            continue;
        }
        // Extended as far as possible along the last axis, then as a whole along the others.
        let mut hi = lo.map(|m| m + 1);
        for a in [2, 1, 0] {
            let (mut from, mut to) = (lo, hi);
            let is_alike = |cell: [usize; 3]| !taken[index(cell)] && excess_in(cell) == excess;
            while hi[a] < n[a] {
                (from[a], to[a]) = (hi[a], hi[a] + 1);
                if !cells_of(from, to).all(is_alike) {
                    break;
                }
                hi[a] += 1;
            }
        }
        cells_of(lo, hi).for_each(|cell| taken[index(cell)] = true);
        out.push((Block { lo, hi }, excess));
    }
    out
}

/// The cells of a block.
fn cells_of(lo: [usize; 3], hi: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (lo[0]..hi[0]).flat_map(move |i| (lo[1]..hi[1]).flat_map(move |j| (lo[2]..hi[2]).map(move |k| [i, j, k])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::domain::Axis;
    use elastocap_fem::line::{Line, LineEnd};
    use elastocap_geometry::scene::Wall;

    /// Six intervals along each axis.
    fn domain(permittivity: impl Fn([usize; 3]) -> f64) -> Domain {
        let axis = || {
            let nodes = (0..=6).map(f64::from).collect();
            let line = Line { nodes, degrees: vec![2; 6], ends: [LineEnd::Finite; 2] };
            Axis { line, cuts: (0..=6).collect(), walls: [Wall::Insulated; 2], rays: None }
        };
        Domain {
            axes: [axis(), axis(), axis()],
            conductors: Vec::new(),
            permittivity: all_cells([6; 3]).map(permittivity).collect(),
            map: None,
            turn: None,
        }
    }

    fn is_in(at: [usize; 3], lo: [usize; 3], hi: [usize; 3]) -> bool {
        (0..3).all(|a| (lo[a]..hi[a]).contains(&at[a]))
    }

    #[test]
    fn a_few_bodies_make_a_few_terms_that_add_up_to_the_permittivity_and_of_which_none_is_negative() {
        let layered = |[_, j, _]: [usize; 3]| if j < 3 { 7.3 } else { 1.0 };
        let bodies = |at: [usize; 3]| match at {
            _ if is_in(at, [1, 2, 1], [3, 5, 4]) => 9.1,
            _ if is_in(at, [4, 4, 2], [6, 5, 3]) => 2.7,
            _ if is_in(at, [0, 5, 4], [5, 6, 5]) => 1e4,
            at => layered(at),
        };
        // A body with a smaller permittivity than the layers around it leaves boxes on its four sides.
        let hollow = |at: [usize; 3]| if is_in(at, [2, 1, 2], [3, 2, 4]) { 1.5 } else { layered(at) };
        for (domain, most) in [(domain(layered), 1), (domain(bodies), 5), (domain(hollow), 5)] {
            let terms = separable_terms(&domain);
            assert!(terms.len() <= most, "{}", terms.len());
            for at in all_cells([6; 3]) {
                let term = |(block, factors): &Product| {
                    let value = factors[0][at[0]] * factors[1][at[1]] * factors[2][at[2]];
                    assert!(
                        value == 0.0 || value > 0.0 && is_in(at, block.lo, block.hi),
                        "{value} at {at:?}"
                    );
                    value
                };
                let (sum, exact) = (terms.iter().map(term).sum::<f64>(), domain.permittivity_of(at));
                assert!((sum - exact).abs() <= 4.0 * f64::EPSILON * exact, "{sum} for {exact} at {at:?}");
            }
        }
    }
}

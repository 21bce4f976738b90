//! The order of elimination: nested dissection by coordinates.

/// The nodes of a mesh in an order that keeps the factors of a matrix on it sparse.
///
/// The elements are cut in two along the axis or diagonal where the halves share the fewest nodes; those
/// nodes go last, and both halves are ordered in the same way. `nodes` are positions in any unit, `elements`
/// the numbers of their nodes, below `nodes.len()`. Returns the old numbers of the nodes in their new order,
/// without nodes that are in no element.
///
/// # Panics
/// If an element has a node that is not in `nodes`.
pub fn dissection_order<const D: usize, const N: usize>(
    nodes: &[[f64; D]],
    elements: &[[u32; N]],
) -> Vec<u32> {
    let centre = |e: &[u32; N]| -> [f64; D] {
        std::array::from_fn(|k| e.iter().map(|&n| nodes[n as usize][k]).sum::<f64>() / N as f64)
    };
    let mut cutter = Cutter::<D, N> {
        elements,
        centres: elements.iter().map(centre).collect(),
        mark: vec![0; nodes.len()],
        taken: vec![false; nodes.len()],
        stamp: 0,
        order: Vec::with_capacity(nodes.len()),
    };
    cutter.dissect(&mut (0..elements.len() as u32).collect::<Vec<_>>());
    cutter.order
}

/// The state of the dissection of a mesh.
struct Cutter<'a, const D: usize, const N: usize> {
    elements: &'a [[u32; N]],
    /// The mean of the nodes of each element.
    centres: Vec<[f64; D]>,
    /// For each node the stamp that it got last, which tells the cut and whether the node is on the left side
    /// of it alone or on both sides.
    mark: Vec<u32>,
    /// For each node whether it is in a separator or in the order already.
    taken: Vec<bool>,
    /// The last stamp used.
    stamp: u32,
    /// The nodes ordered so far.
    order: Vec<u32>,
}

impl<const D: usize, const N: usize> Cutter<'_, D, N> {
    /// Appends the nodes of some elements, without those that are taken, to the order.
    fn dissect(&mut self, part: &mut [u32]) {
        if part.len() <= 2 {
            for &e in part.iter() {
                for n in self.elements[e as usize] {
                    if !std::mem::replace(&mut self.taken[n as usize], true) {
                        self.order.push(n);
                    }
                }
            }
            return;
        }
        let mut best: Option<(usize, usize, usize)> = None;
        for direction in 0..3 * D {
            for cut in self.sort(part, direction) {
                let common = self.common_nodes(part, cut).len();
                if best.is_none_or(|(least, ..)| common < least) {
                    best = Some((common, direction, cut));
                }
            }
        }
        let Some((_, direction, cut)) = best else { return };
        self.sort(part, direction);
        let separator = self.common_nodes(part, cut);
        for &n in &separator {
            self.taken[n as usize] = true;
        }
        let (left, right) = part.split_at_mut(cut);
        self.dissect(left);
        self.dissect(right);
        self.order.extend(separator);
    }

    /// The coordinate of element `e` along a direction: an axis, or from `D` on the sum or the difference of
    /// two axes.
    fn along(&self, e: u32, direction: usize) -> f64 {
        let centre = &self.centres[e as usize];
        let (a, b) = (centre[direction % D], centre[(direction + 1) % D]);
        match direction / D {
            0 => a,
            1 => a + b,
            _ => a - b,
        }
    }

    /// Sorts elements along `direction` and returns where they may be cut: near the middle, where the gaps
    /// between centres are widest, so that layers of a regular mesh stay whole.
    fn sort(&self, part: &mut [u32], direction: usize) -> Vec<usize> {
        part.sort_unstable_by(|&a, &b| {
            // Along the direction first, then along the axes.
            let coordinate = |e: u32, k: usize| match k {
                0 => self.along(e, direction),
                k => self.centres[e as usize][(direction + k) % D],
            };
            let order = |k: usize| coordinate(a, k).total_cmp(&coordinate(b, k));
            (1..D).fold(order(0), |earlier, k| earlier.then(order(k))).then(a.cmp(&b))
        });
        let n = part.len();
        let gap = |k: usize| self.along(part[k], direction) - self.along(part[k - 1], direction);
        let mut cuts: Vec<usize> = ((n / 3).max(1)..(2 * n).div_ceil(3)).collect();
        cuts.sort_by(|&a, &b| gap(b).total_cmp(&gap(a)));
        cuts.truncate(8);
        cuts.sort_by_key(|&k| k.abs_diff(n / 2));
        cuts
    }

    /// The nodes, not taken yet, that the elements before `cut` share with the others.
    fn common_nodes(&mut self, part: &[u32], cut: usize) -> Vec<u32> {
        self.stamp += 2;
        let (left, both) = (self.stamp - 1, self.stamp);
        for &e in &part[..cut] {
            for n in self.elements[e as usize] {
                self.mark[n as usize] = left;
            }
        }
        let mut common = Vec::new();
        for &e in &part[cut..] {
            for n in self.elements[e as usize] {
                if self.mark[n as usize] == left && !self.taken[n as usize] {
                    self.mark[n as usize] = both;
                    common.push(n);
                }
            }
        }
        common
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular mesh of so many cells of side 1 along each axis: its nodes and its cells.
    fn grid(cells: [usize; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 8]>) {
        let [nx, ny, nz] = cells.map(|n| n + 1);
        let number = |i: usize, j: usize, k: usize| ((i * ny + j) * nz + k) as u32;
        let points = |counts: [usize; 3]| {
            let [a, b, c] = counts;
            (0..a * b * c).map(move |at| [at / (b * c), at / c % b, at % c])
        };
        let nodes = points([nx, ny, nz]).map(|p| p.map(|x| x as f64)).collect();
        let cell = |[i, j, k]: [usize; 3]| {
            std::array::from_fn(|corner| number(i + (corner >> 2), j + (corner >> 1 & 1), k + (corner & 1)))
        };
        (nodes, points(cells).map(cell).collect())
    }

    #[test]
    fn the_order_is_a_permutation() {
        let (nodes, elements) = grid([5, 4, 7]);
        let mut order = dissection_order(&nodes, &elements);
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..nodes.len() as u32));
    }

    #[test]
    fn the_last_nodes_are_those_of_a_plane_that_cuts_the_mesh_in_two() {
        let (nodes, elements) = grid([8, 4, 4]);
        let order = dissection_order(&nodes, &elements);
        let last = &order[order.len() - 25..];
        assert!(last.iter().all(|&n| nodes[n as usize][0] == 4.0));
    }

    #[test]
    fn nodes_without_an_element_are_left_out() {
        let (mut nodes, elements) = grid([2, 2, 2]);
        nodes.push([9.0; 3]);
        assert_eq!(dissection_order(&nodes, &elements).len(), nodes.len() - 1);
    }
}

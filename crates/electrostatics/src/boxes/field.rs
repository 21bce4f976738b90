//! The potential and the electric field of one state of the scene, sampled for export.

use crate::boxes::domain::{Axis, Domain};
use crate::boxes::layout::Layout;
use crate::solution::Field;
use elastocap_fem::line::{Element, Numbering, hierarchical};
use elastocap_fem::tensor::{Dense, Left, Right, Target, multiply};
use elastocap_geometry::scene::{Filling, Scene, Wall};
use faer::Mat;

/// More cells than this and every element is shown as one.
const MAX_CELLS: usize = 40_000;

/// One part's share of the state: its grid, the coefficients, and whether it is odd across each axis.
pub struct Share<'a> {
    /// Grid of the reduced layout.
    pub domain: &'a Domain,
    /// Coefficients of the state on it.
    pub coefficients: Vec<f64>,
    /// Odd across the mirror plane of each axis.
    pub odd: [bool; 3],
}

/// Where one axis is sampled.
struct Samples {
    /// Node coordinates, scaled.
    nodes: Vec<f64>,
    /// Values of the axis functions at the nodes: rows nodes, columns functions.
    value: Dense<f64>,
    /// Values and slopes at the cell centres.
    centre_value: Dense<f64>,
    centre_slope: Dense<f64>,
}

/// Samples the state with the given conductor potentials; the shares of all parts add up to it.
///
/// `reach` limits what is shown of open space (scaled distance from the origin).
pub fn sample(
    scene: &Scene,
    layout: &Layout,
    shares: &[Share<'_>],
    mirrored: [bool; 3],
    potentials: Vec<f64>,
) -> Field {
    let Some(first) = shares.first() else {
        return Field {
            nodes: Default::default(),
            potential: Vec::new(),
            electric_field: Vec::new(),
            relative_permittivity: Vec::new(),
            body: Vec::new(),
            potentials,
        };
    };
    let plan = |fine: bool| [0, 1, 2].map(|a| cuts(&first.domain.axes[a], layout.reach, fine));
    let whole = |cuts: &[Vec<(usize, f64, f64)>; 3]| -> usize {
        (0..3).map(|a| cuts[a].len() << usize::from(mirrored[a])).product()
    };
    let mut pieces = plan(true);
    if whole(&pieces) > MAX_CELLS {
        pieces = plan(false);
    }
    let cells = [0, 1, 2].map(|a| pieces[a].len());
    let full = [0, 1, 2].map(|a| cells[a] << usize::from(mirrored[a]));
    let mut nodes: [Vec<f64>; 3] = Default::default();
    let mut potential = vec![0.0; full.iter().map(|n| n + 1).product()];
    let mut field = vec![[0.0; 3]; full.iter().product()];
    for share in shares {
        let samples = [0, 1, 2].map(|a| samples(share.domain, a, &pieces[a]));
        let u = &share.coefficients;
        let at_nodes = evaluate(u, [&samples[0].value, &samples[1].value, &samples[2].value]);
        let slopes = [0, 1, 2].map(|d| {
            let pick = |a: usize| if a == d { &samples[a].centre_slope } else { &samples[a].centre_value };
            evaluate(u, [pick(0), pick(1), pick(2)])
        });
        // Node and cell (i, j, k) of the whole scene, its image in the part, and the sign it comes back with.
        let image = |a: usize, i: usize, n: usize| {
            // n is the number of nodes or cells of the part; nodes share the mirror plane.
            if !mirrored[a] {
                (i, 1.0)
            } else if n == cells[a] {
                if i < n { (n - 1 - i, -1.0) } else { (i - n, 1.0) }
            } else if i < n - 1 {
                (n - 1 - i, -1.0)
            } else {
                (i - (n - 1), 1.0)
            }
        };
        let parity = |a: usize, side: f64| if share.odd[a] { side } else { 1.0 };
        for (index, value) in potential.iter_mut().enumerate() {
            let at = split(index, full.map(|n| n + 1));
            let [(i, si), (j, sj), (k, sk)] = [0, 1, 2].map(|a| image(a, at[a], cells[a] + 1));
            let sign = parity(0, si) * parity(1, sj) * parity(2, sk);
            *value += sign * at_nodes[(i * (cells[1] + 1) + j) * (cells[2] + 1) + k];
        }
        for (index, e) in field.iter_mut().enumerate() {
            let at = split(index, full);
            let images = [0, 1, 2].map(|a| image(a, at[a], cells[a]));
            let sign: f64 = (0..3).map(|a| parity(a, images[a].1)).product();
            let source = (images[0].0 * cells[1] + images[1].0) * cells[2] + images[2].0;
            for d in 0..3 {
                // The slope across the mirror plane changes sign with the side as well.
                e[d] -= sign * images[d].1 * slopes[d][source] / layout.unit;
            }
        }
        if nodes[0].is_empty() {
            nodes = [0, 1, 2].map(|a| {
                let own = &samples[a].nodes;
                let mirror = own.iter().skip(1).rev().map(|x| -x).filter(|_| mirrored[a]);
                mirror.chain(own.iter().copied()).map(|x| layout.origin[a] + layout.unit * x).collect()
            });
        }
    }
    let lookup = scene.lookup();
    let (mut permittivity, mut body) = (Vec::new(), Vec::new());
    for index in 0..field.len() {
        let at = split(index, full);
        let point = [0, 1, 2].map(|a| 0.5 * (nodes[a][at[a]] + nodes[a][at[a] + 1]));
        permittivity.push(lookup.permittivity_at(point));
        body.push(match lookup.body_at(point) {
            Filling::Background => 0,
            Filling::Conductor(c) => -1 - c.index as i32,
            Filling::Dielectric(d) => d.index as i32 + 1,
        });
    }
    Field { nodes, potential, electric_field: field, relative_permittivity: permittivity, body, potentials }
}

fn split(index: usize, n: [usize; 3]) -> [usize; 3] {
    [index / (n[1] * n[2]), index / n[2] % n[1], index % n[2]]
}

/// Cells of one axis as (element, lower, upper) in the element's own coordinate s.
fn cuts(axis: &Axis, reach: f64, fine: bool) -> Vec<(usize, f64, f64)> {
    let line = &axis.line;
    let mut out = Vec::new();
    for e in 0..line.elements() {
        let Element::Finite { start, length } = line.element(e) else { continue };
        let far = |end: usize| axis.walls[end] == Wall::Open;
        if (far(1) && start + length > 1.001 * reach) || (far(0) && start < -1.001 * reach) {
            continue;
        }
        let pieces = if fine { line.degree(e).div_ceil(2) } else { 1 };
        for i in 0..pieces {
            let s = |i: usize| -1.0 + 2.0 * i as f64 / pieces as f64;
            out.push((e, s(i), s(i + 1)));
        }
    }
    out
}

fn samples(domain: &Domain, a: usize, pieces: &[(usize, f64, f64)]) -> Samples {
    let axis = &domain.axes[a];
    let numbering = Numbering::new(&axis.line);
    let functions = axis.functions();
    let n = functions.len();
    let mut nodes = Vec::new();
    let mut value = Mat::zeros(pieces.len() + 1, n);
    let mut centre_value = Mat::zeros(pieces.len(), n);
    let mut centre_slope = Mat::zeros(pieces.len(), n);
    let add = |m: &mut Mat<f64>, row: usize, e: usize, s: f64, scale: Option<f64>| {
        let (v, d) = hierarchical(axis.line.degree(e), s);
        for (local, index) in numbering.element(&axis.line, e).into_iter().enumerate() {
            if let Some(index) = index.filter(|i| functions.contains(i)) {
                m[(row, index - functions.start)] = scale.map_or(v[local], |h| 2.0 / h * d[local]);
            }
        }
    };
    for (row, &(e, s0, s1)) in pieces.iter().enumerate() {
        let Element::Finite { start, length } = axis.line.element(e) else { continue };
        let x = |s: f64| start + 0.5 * (s + 1.0) * length;
        nodes.push(x(s0));
        add(&mut value, row, e, s0, None);
        add(&mut centre_value, row, e, 0.5 * (s0 + s1), None);
        add(&mut centre_slope, row, e, 0.5 * (s0 + s1), Some(length));
        if row + 1 == pieces.len() {
            nodes.push(x(s1));
            add(&mut value, row + 1, e, s1, None);
        }
    }
    let dense = |m: Mat<f64>| Dense::from_mat(m.as_ref());
    Samples {
        nodes,
        value: dense(value),
        centre_value: dense(centre_value),
        centre_slope: dense(centre_slope),
    }
}

/// Values at the tensor product of samples.
fn evaluate(u: &[f64], m: [&Dense<f64>; 3]) -> Vec<f64> {
    let (n1, n2) = (m[1].cols, m[2].cols);
    let (r0, r1, r2) = (m[0].rows, m[1].rows, m[2].rows);
    let mut first = vec![0.0; r0 * n1 * n2];
    multiply(
        m[0].left(),
        Right { data: u, cols: n1 * n2, stride: n1 * n2 },
        Target { data: &mut first, stride: n1 * n2 },
        false,
    );
    let mut second = vec![0.0; r0 * r1 * n2];
    for i in 0..r0 {
        let b = Right { data: &first[i * n1 * n2..], cols: n2, stride: n2 };
        multiply(m[1].left(), b, Target { data: &mut second[i * r1 * n2..], stride: n2 }, false);
    }
    let mut transposed = vec![0.0; n2 * r2];
    for i in 0..r2 {
        for j in 0..n2 {
            transposed[j * r2 + i] = m[2].data[i * n2 + j];
        }
    }
    let mut out = vec![0.0; r0 * r1 * r2];
    let a = Left { data: &second, rows: r0 * r1, cols: n2, row: n2, col: 1 };
    multiply(
        a,
        Right { data: &transposed, cols: r2, stride: r2 },
        Target { data: &mut out, stride: r2 },
        false,
    );
    out
}

//! The potential and the electric field of one state of the scene, sampled for export.

use crate::boxes::domain::{Axis, Domain};
use crate::boxes::layout::Layout;
use crate::solution::{CellBody, Field};
use elastocap_fem::line::{Element, Numbering, hierarchical};
use elastocap_fem::tensor::{Dense, Left, Right, Target, multiply};
use elastocap_geometry::scene::{Filling, Scene, Wall};
use faer::Mat;

/// Largest number of cells with several cells per element; beyond it every element is one cell.
const MAX_CELLS: usize = 40_000;

/// One part's share of the state: its grid, the coefficients, and whether it is odd across each axis.
pub(crate) struct Share<'a> {
    /// Grid of the reduced layout.
    pub domain: &'a Domain,
    /// Coefficients of the state on it.
    pub coefficients: Vec<f64>,
    /// Odd across the mirror plane of each axis.
    pub odd: [bool; 3],
}

impl Share<'_> {
    /// The factor of the share's potential on one side (-1 or 1) of the mirror plane of axis `a`.
    fn parity(&self, a: usize, side: f64) -> f64 {
        if self.odd[a] { side } else { 1.0 }
    }
}

/// The sample points of one axis, and the axis functions there.
struct Samples {
    /// Node coordinates, scaled.
    nodes: Vec<f64>,
    /// Values of the axis functions at the nodes: rows nodes, columns functions.
    value: Dense<f64>,
    /// Values and slopes at the cell centres.
    centre_value: Dense<f64>,
    centre_slope: Dense<f64>,
}

/// How the cells of the part that is solved are repeated in the whole scene: mirrored halves lie below the solved ones.
struct Reflection {
    /// Axes across which the scene is mirrored.
    mirrored: [bool; 3],
    /// Cells of the part along each axis.
    part: [usize; 3],
    /// Cells of the whole scene along each axis.
    whole: [usize; 3],
}

impl Reflection {
    fn new(mirrored: [bool; 3], part: [usize; 3]) -> Self {
        Self { mirrored, part, whole: [0, 1, 2].map(|a| part[a] << usize::from(mirrored[a])) }
    }

    /// The cell of the part whose image is cell `i` of the whole on axis `a`, and the side of the mirror plane that the image
    /// lies on: -1 below it, else 1.
    fn cell(&self, a: usize, i: usize) -> (usize, f64) {
        let n = self.part[a];
        match (self.mirrored[a], i < n) {
            (false, _) => (i, 1.0),
            (true, true) => (n - 1 - i, -1.0),
            (true, false) => (i - n, 1.0),
        }
    }

    /// The same for node `i`. The node on the mirror plane belongs to both halves; it counts as above.
    fn node(&self, a: usize, i: usize) -> (usize, f64) {
        let n = self.part[a];
        match (self.mirrored[a], i < n) {
            (false, _) => (i, 1.0),
            (true, true) => (n - i, -1.0),
            (true, false) => (i - n, 1.0),
        }
    }

    /// Node coordinates of the whole scene on axis `a`, m, from those of the part, which are in units of the layout.
    fn coordinates(&self, a: usize, own: &[f64], layout: &Layout) -> Vec<f64> {
        let mirror = own.iter().skip(1).rev().map(|x| -x).filter(|_| self.mirrored[a]);
        mirror.chain(own.iter().copied()).map(|x| layout.origin[a] + layout.unit * x).collect()
    }
}

/// Samples one state of the scene: its potential and its electric field as the sum of the shares of all parts.
///
/// `potentials`, V, are those of the scene's conductors in this state, for the caller to find in the result. Open space is
/// shown as far as [`Layout::reach`]. Without any share there is no field, and the lists are empty.
pub(crate) fn sample(
    scene: &Scene,
    layout: &Layout,
    shares: &[Share<'_>],
    mirrored: [bool; 3],
    potentials: Vec<f64>,
) -> Field {
    let Some(first) = shares.first() else {
        return Field {
            nodes: Default::default(),
            points: None,
            potential: Vec::new(),
            electric_field: Vec::new(),
            relative_permittivity: Vec::new(),
            body: Vec::new(),
            potentials,
        };
    };
    let pieces = pieces(first.domain, layout.reach, mirrored);
    let reflection = Reflection::new(mirrored, [0, 1, 2].map(|a| pieces[a].len()));
    let mut nodes: [Vec<f64>; 3] = Default::default();
    let mut potential = vec![0.0; reflection.whole.iter().map(|n| n + 1).product()];
    let mut electric_field = vec![[0.0; 3]; reflection.whole.iter().product()];
    for share in shares {
        let samples = [0, 1, 2].map(|a| samples(share.domain, a, &pieces[a]));
        add_potential(&mut potential, share, &samples, &reflection);
        add_field(&mut electric_field, share, &samples, &reflection, layout.unit);
        if nodes[0].is_empty() {
            nodes = [0, 1, 2].map(|a| reflection.coordinates(a, &samples[a].nodes, layout));
        }
    }
    let lookup = scene.lookup();
    let (mut relative_permittivity, mut body) = (Vec::new(), Vec::new());
    for index in 0..electric_field.len() {
        let at = split(index, reflection.whole);
        let point = [0, 1, 2].map(|a| 0.5 * (nodes[a][at[a]] + nodes[a][at[a] + 1]));
        relative_permittivity.push(lookup.permittivity_at(point));
        body.push(match lookup.body_at(point) {
            Filling::Background => CellBody::Background,
            Filling::Conductor(c) => CellBody::Conductor(c.index),
            Filling::Dielectric(d) => CellBody::Dielectric(d.index),
        });
    }
    Field { nodes, points: None, potential, electric_field, relative_permittivity, body, potentials }
}

/// The cells of each axis, as [`cuts`] gives them: several per element, or one where that would be too many.
fn pieces(domain: &Domain, reach: f64, mirrored: [bool; 3]) -> [Vec<(usize, f64, f64)>; 3] {
    let plan = |fine: bool| [0, 1, 2].map(|a| cuts(&domain.axes[a], reach, fine));
    let fine = plan(true);
    let cells: usize = (0..3).map(|a| fine[a].len() << usize::from(mirrored[a])).product();
    if cells > MAX_CELLS { plan(false) } else { fine }
}

/// Adds the share's potential, V, to that of all nodes `[i][j][k]` of the whole scene.
fn add_potential(potential: &mut [f64], share: &Share<'_>, samples: &[Samples; 3], reflection: &Reflection) {
    let [s0, s1, s2] = samples;
    let at_nodes = evaluate(&share.coefficients, [&s0.value, &s1.value, &s2.value]);
    let cells = reflection.part;
    for (index, value) in potential.iter_mut().enumerate() {
        let at = split(index, reflection.whole.map(|n| n + 1));
        let [(i, si), (j, sj), (k, sk)] = [0, 1, 2].map(|a| reflection.node(a, at[a]));
        let sign = share.parity(0, si) * share.parity(1, sj) * share.parity(2, sk);
        *value += sign * at_nodes[(i * (cells[1] + 1) + j) * (cells[2] + 1) + k];
    }
}

/// Adds the share's field, V/m, to that at the centres of all cells `[i][j][k]` of the whole scene. `unit` is the layout's unit
/// of length, m.
fn add_field(
    electric_field: &mut [[f64; 3]],
    share: &Share<'_>,
    samples: &[Samples; 3],
    reflection: &Reflection,
    unit: f64,
) {
    let slopes = [0, 1, 2].map(|d| {
        let pick = |a: usize| if a == d { &samples[a].centre_slope } else { &samples[a].centre_value };
        evaluate(&share.coefficients, [pick(0), pick(1), pick(2)])
    });
    let cells = reflection.part;
    for (index, e) in electric_field.iter_mut().enumerate() {
        let at = split(index, reflection.whole);
        let images = [0, 1, 2].map(|a| reflection.cell(a, at[a]));
        let sign: f64 = (0..3).map(|a| share.parity(a, images[a].1)).product();
        let source = (images[0].0 * cells[1] + images[1].0) * cells[2] + images[2].0;
        for d in 0..3 {
            // The slope across the mirror plane changes sign with the side as well.
            e[d] -= sign * images[d].1 * slopes[d][source] / unit;
        }
    }
}

/// The place [i, j, k] of an index into an array with these numbers of entries.
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

/// Values of the function with coefficients `u` at the tensor product of three axes' samples, `[i][j][k]`.
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

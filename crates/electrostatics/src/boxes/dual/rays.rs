//! Flux that continues to infinity along rays from a pole.
//!
//! A flux that leaves the cube of half-width R around the pole with density g continues as g x / s^2 along x
//! -> s x. It has no divergence, and its energy per area of the face x = R is R (1 + (y^2 + z^2) / R^2) g^2
//! for unit permittivity. The field of a point charge at the pole is of this kind, so that only the higher
//! moments of a charged body are approximated. In the potentials' radial basis the weight is diagonal across
//! the lines; along each line it changes M by a matrix of rank one per open end, and T = D M^-1 D^T by
//! another.

use super::{Basis, others};
use elastocap_fem::mixed::MixedSegment;

/// The oblique part of the continuation beyond the open ends of one segment. For an open end, e is the vector
/// by which a flux is multiplied to give the flow through that end.
#[derive(Debug, Clone)]
pub(super) struct Leaving {
    /// D M^-1 e of each open end, M with the straight part of the continuation.
    pub(super) vectors: Vec<Vec<f64>>,
    /// The open ends: 0 for the lower one, 1 for the upper one.
    pub(super) sides: Vec<usize>,
    /// The products e M^-1 e of the open ends.
    gram: [[f64; 2]; 2],
    /// Energy of the straight continuation of each open end, by which the share of the squared distance is
    /// multiplied.
    pub(super) straight: Vec<f64>,
}

impl Leaving {
    /// The open ends of a segment. `straight` is the energy of the straight continuation per squared flux at
    /// either end, in the scale of the segment. `None` if no flux leaves it.
    pub(super) fn new(segment: &MixedSegment, straight: [f64; 2]) -> Option<Self> {
        let sides: Vec<usize> = (0..2).filter(|&s| straight[s] > 0.0).collect();
        if sides.is_empty() {
            return None;
        }
        let mut gram = [[0.0; 2]; 2];
        for (i, s) in sides.iter().enumerate() {
            for (j, t) in sides.iter().enumerate() {
                gram[i][j] = inner(&segment.face[*s], &segment.face[*t]);
            }
        }
        Some(Self {
            vectors: sides.iter().map(|s| segment.face_source(*s)).collect(),
            straight: sides.iter().map(|s| straight[*s]).collect(),
            sides,
            gram,
        })
    }

    /// K t with K = (W^-1 + e M^-1 e)^-1, W the resistance that obliqueness adds on a line whose squared
    /// distance across is `share` of R^2. M^-1 with the whole continuation is M^-1 - M^-1 e K e M^-1.
    pub(super) fn damp(&self, share: f64, t: [f64; 2]) -> [f64; 2] {
        let root = |i: usize| (self.straight[i] * share).sqrt();
        if self.sides.len() == 1 {
            let w = self.straight[0] * share;
            return [w / (1.0 + w * self.gram[0][0]) * t[0], 0.0];
        }
        let (a, b) = (root(0), root(1));
        let g = &self.gram;
        let (m00, m01, m11) = (1.0 + a * a * g[0][0], a * b * g[0][1], 1.0 + b * b * g[1][1]);
        let det = m00 * m11 - m01 * m01;
        let (x, y) = (a * t[0], b * t[1]);
        [a * (m11 * x - m01 * y) / det, b * (m00 * y - m01 * x) / det]
    }
}

impl Leaving {
    /// The energy that obliqueness adds to that of the straight continuation, as a product of two fluxes that
    /// leave.
    pub(super) fn oblique(&self, share: f64, x: [f64; 2], y: [f64; 2]) -> f64 {
        self.straight.iter().zip(x.iter().zip(&y)).map(|(straight, (x, y))| straight * share * x * y).sum()
    }
}

/// The inner product of two vectors.
pub(super) fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Squared distances across axis `a` from the pole over R^2: one factor per mode of the two other axes, to be
/// added.
pub(super) fn shares(basis: &[Option<Basis>; 3], a: usize) -> [&[f64]; 2] {
    let (p, q) = others(a);
    [p, q].map(|b| basis[b].as_ref().map_or(&[][..], |basis| &basis.shares))
}

//! Where a plan is graded: corners and edges near which the field is singular.

use super::columns::{Chain, ChainOfSide, Column};
use elastocap_geometry::meshing::plane::graded::{Coarse, Marks, bands};
use std::collections::{HashMap, HashSet};

/// Angles by which an outline of a conductor, or the boundary between two dielectrics, may turn without
/// having a corner, in degrees: those of polygons that stand for curves. The field is hardly singular there.
/// Tuned: `benches/outlines.py pattern`.
const SMOOTH: [f64; 2] = [12.0, 30.0];

/// Directions are at right angles if their cosine is less than this. Not tuned: it only has to lie above
/// rounding errors and below angles that matter.
const UPRIGHT: f64 = 1e-9;

/// The corners and edges of a plan near which the field is singular; `at_dielectrics` says whether edges of
/// dielectrics count.
pub(super) fn marks(
    coarse: &Coarse,
    of_triangle: &[u32],
    columns: &[Column],
    frame: [[f64; 2]; 2],
    (chains, of_side): (&[Chain], ChainOfSide),
    at_dielectrics: bool,
) -> Marks {
    let mesh = &coarse.mesh;
    let mut beside: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for ([a, b, c], column) in mesh.triangles.iter().zip(of_triangle) {
        for [p, q] in [[*a, *b], [*b, *c], [*c, *a]] {
            beside.entry([p.min(q), p.max(q)]).or_default().push(*column);
        }
    }
    // Boundaries at each point, by their directions.
    let mut at_point: Vec<Vec<([f64; 2], Boundary)>> = vec![Vec::new(); mesh.points.len()];
    let mut edges = HashSet::new();
    for (side, adjacent) in &beside {
        let (one, other) = match adjacent[..] {
            [one, other] => (one, other),
            // A side on the frame.
            [one] => (one, one),
            _ => continue,
        };
        let chain = of_side.get(side).copied();
        if one == other && chain.is_none() {
            continue;
        }
        let [p, q] = side.map(|p| mesh.points[p as usize]);
        let along = [q[0] - p[0], q[1] - p[1]];
        let length = along[0].hypot(along[1]);
        let along = along.map(|x| x / length);
        let boundary = Boundary { columns: [one.min(other), one.max(other)], chain };
        let arc = coarse.arcs.get(side);
        // A curve begins and ends along its tangents.
        let [begins, ends] = arc.map_or([along, along.map(|x| -x)], |arc| arc.directions([p, q]));
        at_point[side[0] as usize].push((begins, boundary));
        at_point[side[1] as usize].push((ends, boundary));
        let is_rim = chain.is_some_and(|chain| chains[chain as usize].ends_between());
        let [one, other] = [one, other].map(|column| &columns[column as usize]);
        let has_edge =
            ends_between(one, other) || at_dielectrics && dielectric_edges(one, other).next().is_some();
        if is_rim || has_edge {
            edges.insert(*side);
        }
    }
    let corners: Vec<bool> = at_point
        .iter()
        .zip(&mesh.points)
        .map(|(boundaries, point)| match &boundaries[..] {
            [] => false,
            [(a, x), (b, y)] => {
                let [one, other] = x.columns.map(|c| &columns[c as usize]);
                let metal = x.chain.is_some() || one.held != other.held;
                let least = SMOOTH[usize::from(!metal)].to_radians().cos();
                x != y || a[0] * b[0] + a[1] * b[1] > -least
            }
            // A boundary that meets the frame at a right angle continues straight in its mirror image.
            [(a, _)] => {
                let on_frame = (0..2).filter(|&k| point[k] == frame[0][k] || point[k] == frame[1][k]);
                !on_frame.into_iter().any(|k| a[1 - k].abs() < UPRIGHT)
            }
            _ => true,
        })
        .collect();
    let bands =
        bands(coarse, &edges, &of_side, &corners, |one, other| of_triangle[one] == of_triangle[other]);
    Marks { corners, edges, chains: of_side, bands }
}

/// The cuts at which three or four dielectrics meet between two columns, along an edge across the axis. Where
/// only two do, there is a plane between them, and a plane that ends at a conductor does so at a right angle.
pub(super) fn dielectric_edges<'a>(one: &'a Column, other: &'a Column) -> impl Iterator<Item = usize> + 'a {
    (1..one.held.len() - 1).filter(move |&m| {
        let [below, above] = [m - 1, m].map(|k| [one.permittivity[k], other.permittivity[k]]);
        let is_metal = [one, other].iter().any(|c| c.held[m].is_some());
        !is_metal && below != above && (below[0] != below[1] || above[0] != above[1])
    })
}

/// The two columns, or the two sides of a chain, that a side of triangles separates.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Boundary {
    /// The numbers of the columns on both sides, ascending.
    columns: [u32; 2],
    /// The chain that stands on it, if any does.
    chain: Option<u32>,
}

impl Chain {
    /// Whether a sheet ends inside the scene: it has an edge there.
    fn ends_between(&self) -> bool {
        (1..self.held.len() - 1)
            .any(|m| self.held[m].is_some() && self.conductor[m - 1..=m] != [self.held[m]; 2])
    }
}

/// Whether a conductor that only one of two columns has ends inside the scene: it has an edge there.
fn ends_between(one: &Column, other: &Column) -> bool {
    let cuts = one.held.len();
    (1..cuts - 1).any(|m| {
        one.held[m] != other.held[m]
            && [one, other].iter().any(|c| c.held[m].is_some() && c.conductor[m - 1..=m] != [c.held[m]; 2])
    })
}

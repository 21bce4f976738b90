//! Pairs of triangles between two marked edges that face each other, as there are in traces and in the gaps
//! between them. They are divided as one quadrilateral, into less than half as many parts as two triangles
//! that are each graded towards one edge alone.

use super::coarse::Coarse;
use super::key;
use std::collections::{HashMap, HashSet};

/// Quadrilaterals whose angles have a larger cosine are left as triangles: strips in them would have parts
/// that are too flat. Tuned: `benches/outlines.py`.
const MAX_COSINE: f64 = 0.8;

/// Two triangles of a coarse mesh that are divided together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Band {
    /// The two triangles.
    pub triangles: [u32; 2],
    /// The corners of the quadrilateral that the two fill, in their order around it. The sides between the
    /// first two and between the last two are marked edges, the other two are not.
    pub corners: [u32; 4],
}

/// Pairs of neighbouring triangles, each pair between two of the marked `edges`, that can be divided
/// together. Their triangles have no marked corner (`is_corner`) and no curved side. The side between the two
/// is not marked. No chain runs along it or along the two outer sides that are not marked, and `alike` holds
/// for the numbers of the two triangles. No triangle is in two pairs; of several choices the one with the
/// best angles is taken.
pub fn bands(
    coarse: &Coarse,
    edges: &HashSet<[u32; 2]>,
    chains: &HashMap<[u32; 2], u32>,
    is_corner: &[bool],
    alike: impl Fn(usize, usize) -> bool,
) -> Vec<Band> {
    let mesh = &coarse.mesh;
    let is_plain = |t: &[u32; 3]| {
        !t.iter().any(|p| is_corner[*p as usize])
            && !sides(t).iter().any(|side| coarse.arcs.contains_key(side))
    };
    let mut beside: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate().filter(|(_, t)| is_plain(t)) {
        sides(corners).into_iter().filter(|side| !edges.contains(side)).for_each(|side| {
            beside.entry(side).or_default().push(t);
        });
    }
    let mut candidates: Vec<(f64, Band)> = Vec::new();
    for (side, triangles) in &beside {
        let [one, other] = triangles[..] else { continue };
        if chains.contains_key(side) || !alike(one, other) {
            continue;
        }
        let apex = |t: usize| mesh.triangles[t].into_iter().find(|p| !side.contains(p));
        let (Some(x), Some(y)) = (apex(one), apex(other)) else { continue };
        let [p, q] = *side;
        for corners in [[p, x, q, y], [x, q, y, p]] {
            let [a, b, c, d] = corners;
            let marked = [key(a, b), key(c, d)].iter().all(|side| edges.contains(side));
            let crossing =
                [key(b, c), key(d, a)].iter().all(|side| !edges.contains(side) && !chains.contains_key(side));
            let cosine = largest_cosine(corners.map(|p| mesh.points[p as usize]));
            if marked && crossing && cosine <= MAX_COSINE {
                candidates.push((cosine, Band { triangles: [one as u32, other as u32], corners }));
            }
        }
    }
    // The order must not depend on that of the hash map.
    candidates.sort_by(|(x, one), (y, other)| x.total_cmp(y).then(one.triangles.cmp(&other.triangles)));
    let mut taken = vec![false; mesh.triangles.len()];
    let mut out = Vec::new();
    for (_, band) in candidates {
        let triangles = band.triangles.map(|t| t as usize);
        if triangles.iter().all(|t| !taken[*t]) {
            triangles.iter().for_each(|t| taken[*t] = true);
            out.push(band);
        }
    }
    out
}

/// The sides of a triangle.
fn sides([a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [key(*a, *b), key(*b, *c), key(*c, *a)]
}

/// The largest cosine, without its sign, of the angles of a convex quadrilateral; infinite if it is not
/// convex.
fn largest_cosine(corners: [[f64; 2]; 4]) -> f64 {
    let angles = [0, 1, 2, 3].map(|k| {
        let [before, at, after] = [3, 0, 1].map(|step| corners[(k + step) % 4]);
        let [u, v] = [before, after].map(|p| [p[0] - at[0], p[1] - at[1]]);
        let lengths = u[0].hypot(u[1]) * v[0].hypot(v[1]);
        [(u[0] * v[0] + u[1] * v[1]) / lengths, (v[0] * u[1] - v[1] * u[0]) / lengths]
    });
    let convex = [1.0, -1.0].iter().any(|way| angles.iter().all(|[_, sine]| way * sine > 0.0));
    if convex { angles.iter().map(|[cosine, _]| cosine.abs()).fold(0.0, f64::max) } else { f64::INFINITY }
}

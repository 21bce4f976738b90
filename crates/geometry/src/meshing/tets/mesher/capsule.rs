//! Flat faces in place of a capsule: two half balls with a cylinder between them.

use super::Point;
use crate::meshing::tets::determinant;
use crate::shapes::TriangleSurface;
use elastocap_linalg::vector::{cross, length, minus};
use std::f64::consts::{FRAC_PI_2, PI};

/// The least and the largest number of rings of a cap from the pole to the equator: at least 2, so that no
/// side of the cylinder is normal to an axis by chance.
const RINGS: [usize; 2] = [2, 100];

/// A polyhedron with the volume of the capsule around the segment between `ends`; the sides of its triangles
/// are about `side` times the radius, and those along the cylinder as long as that is. It has the capsule's
/// mirror planes.
///
/// Ring j of a cap has 4 j corners, so that triangles near its pole are no thinner than those elsewhere.
pub(super) fn capsule(ends: [Point; 2], radius: f64, side: f64) -> TriangleSurface {
    let rings = ((FRAC_PI_2 / side).ceil() as usize).clamp(RINGS[0], RINGS[1]);
    let [e1, e2, along] = frame(minus(ends[1], ends[0]));
    let mut surface = TriangleSurface::default();
    // Coordinates in the frame, of a ball of radius 1, and the end that each corner belongs to.
    let mut corners: Vec<(Point, usize)> = Vec::new();
    // The first corner on the equator of each cap.
    let caps = [0, 1].map(|end| {
        let first = corners.len() as u32;
        let sign = [-1.0, 1.0][end];
        corners.push(([0.0, 0.0, sign], end));
        for j in 1..=rings {
            let (sine, cosine) = (FRAC_PI_2 * j as f64 / rings as f64).sin_cos();
            let height = if j == rings { 0.0 } else { sign * cosine };
            corners.extend((0..4 * j).map(|k| {
                let [c, s] = on_circle(k, j);
                ([sine * c, sine * s, height], end)
            }));
        }
        let corner = |j: usize, k: usize| match j {
            0 => first,
            _ => first + 1 + (2 * j * (j - 1) + k % (4 * j)) as u32,
        };
        let mut add = |[a, b, c]: [u32; 3]| surface.faces.push(if end == 1 { [a, b, c] } else { [a, c, b] });
        for j in 0..rings {
            for quarter in 0..4 {
                let [inner, outer] = [quarter * j, quarter * (j + 1)];
                for k in 0..=j {
                    add([corner(j, inner + k), corner(j + 1, outer + k), corner(j + 1, outer + k + 1)]);
                }
                for k in 0..j {
                    add([corner(j, inner + k), corner(j + 1, outer + k + 1), corner(j, inner + k + 1)]);
                }
            }
        }
        first + 1 + (2 * rings * (rings - 1)) as u32
    });
    let distance = length(minus(ends[1], ends[0]));
    let around = 4 * rings as u32;
    if distance > 0.0 {
        for k in 0..around {
            let next = (k + 1) % around;
            let [[a, b], [d, c]] = caps.map(|equator| [equator + k, equator + next]);
            surface.faces.extend([[a, b, c], [a, c, d]]);
        }
    } else {
        // Both caps share one equator. It is the last ring of each, whose corners come last among those of
        // the cap.
        let (kept, dropped) = (caps[0], caps[1]);
        let moved = |p: u32| if p >= dropped { p - dropped + kept } else { p };
        surface.faces.iter_mut().for_each(|face| *face = face.map(moved));
        corners.truncate(dropped as usize);
    }
    let grown = radius * growth(&corners, &surface, around as usize, distance / radius);
    surface.points = corners
        .into_iter()
        .map(|(p, end)| {
            [0, 1, 2].map(|k| ends[end][k] + grown * (p[0] * e1[k] + p[1] * e2[k] + p[2] * along[k]))
        })
        .collect();
    surface
}

/// The factor, 1 + O(side^2), by which the corners move outwards so that the polyhedron has the volume of the
/// capsule, which has the radius 1 and the given length between its centres.
fn growth(corners: &[(Point, usize)], surface: &TriangleSurface, around: usize, distance: f64) -> f64 {
    // The volume of both caps, with their equators in one plane; the sides of the cylinder have no area then.
    let caps = surface.faces.iter().map(|face| {
        let [a, b, c] = face.map(|p| corners[p as usize].0);
        determinant([0.0; 3], a, b, c) / 6.0
    });
    let caps: f64 = caps.sum();
    let turn = 2.0 * PI / around as f64;
    let polygon = 0.5 * around as f64 * turn.sin();
    let volume = PI * (4.0 / 3.0 + distance);
    // caps f^3 + polygon distance f^2 = volume has one positive solution, and Newton's method from above goes
    // straight to it.
    let mut f = (volume / (caps + polygon * distance)).max(1.0);
    for _ in 0..30 {
        let value = (caps * f + polygon * distance) * f * f - volume;
        let step = value / ((3.0 * caps * f + 2.0 * polygon * distance) * f);
        f -= step;
        if step.abs() <= 1e-15 * f {
            break;
        }
    }
    f
}

/// Corner k of the 4 j on a circle of radius 1, the same to the last digit under the reflections of a square.
fn on_circle(k: usize, j: usize) -> [f64; 2] {
    let (quarter, part) = (k / j, k % j);
    let angle = |part: usize| (FRAC_PI_2 * part as f64 / j as f64).sin();
    let [c, s] = if part == 0 { [1.0, 0.0] } else { [angle(j - part), angle(part)] };
    match quarter % 4 {
        0 => [c, s],
        1 => [-s, c],
        2 => [-c, -s],
        _ => [s, -c],
    }
}

/// A right-handed frame of unit vectors, the third along a direction; the coordinate axes for a direction of
/// zero. The first is along an axis if one is normal to the direction, so that planes of symmetry go through
/// corners.
fn frame(direction: Point) -> [Point; 3] {
    let scale = direction.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if scale <= 0.0 {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    }
    let unit = |v: Point| v.map(|x| x / length(v));
    let along = unit(direction.map(|x| x / scale));
    let least = (1..3).fold(0, |least, k| if along[k].abs() < along[least].abs() { k } else { least });
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let second = unit(cross(along, axis));
    [unit(cross(second, along)), second, along]
}

/// Points spread over a capsule, m.
pub(super) fn samples(ends: [Point; 2], radius: f64) -> Vec<Point> {
    const ALONG: usize = 40;
    const AROUND: usize = 64;
    let caps = capsule(ends, radius, 0.2).points;
    let [e1, e2, _] = frame(minus(ends[1], ends[0]));
    let sides = (1..ALONG).flat_map(|k| {
        let share = k as f64 / ALONG as f64;
        let middle = [0, 1, 2].map(|a| ends[0][a] + share * (ends[1][a] - ends[0][a]));
        (0..AROUND).map(move |i| {
            let (s, c) = (2.0 * PI * i as f64 / AROUND as f64).sin_cos();
            [0, 1, 2].map(|a| middle[a] + radius * (c * e1[a] + s * e2[a]))
        })
    });
    caps.into_iter().chain(sides).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segments::distance_to_segment;
    use std::collections::HashMap;

    fn volume(surface: &TriangleSurface) -> f64 {
        let signed_volume = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|p| surface.points[p as usize]);
            determinant([0.3; 3], a, b, c) / 6.0
        };
        surface.faces.iter().map(signed_volume).sum()
    }

    #[test]
    fn a_capsule_is_closed_faces_outwards_and_has_its_volume() {
        let from = [0.2, -0.1, 0.4];
        for to in [from, [0.2, -0.1, 2.4], [1.0, 2.0, -3.0], [0.2 + 1e-6, -0.1, 0.4], [40.0, -0.1, 0.4]] {
            for side in [0.9, 0.3, 0.07] {
                let surface = capsule([from, to], 0.7, side);
                let exact = PI * 0.49 * (4.0 / 3.0 * 0.7 + length(minus(to, from)));
                assert!((volume(&surface) / exact - 1.0).abs() < 1e-9, "{to:?} {side}");
                let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
                for [a, b, c] in &surface.faces {
                    for (p, q) in [(*a, *b), (*b, *c), (*c, *a)] {
                        *edges.entry([p.min(q), p.max(q)]).or_default() += if p < q { 1 } else { -1 };
                        assert_ne!(p, q);
                    }
                }
                assert!(edges.values().all(|sum| *sum == 0), "every edge is passed both ways");
                // V - E + F of a sphere.
                assert_eq!(surface.points.len() + surface.faces.len() - edges.len(), 2);
                let off = |p: &Point| (distance_to_segment(*p, [from, to]) / 0.7 - 1.0).abs();
                assert!(surface.points.iter().all(|p| off(p) < 0.5 * side * side));
            }
        }
    }

    #[test]
    fn a_capsule_turned_round_is_the_same() {
        let ends = [[0.0, 0.1, 0.0], [1.0, 0.5, 2.0]];
        let [one, other] = [capsule(ends, 0.3, 0.3), capsule([ends[1], ends[0]], 0.3, 0.3)];
        let near = |p: &Point| other.points.iter().any(|q| length(minus(*p, *q)) < 1e-12);
        assert!(one.points.iter().all(near));
    }
}

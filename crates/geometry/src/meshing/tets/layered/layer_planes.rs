//! The planes between layers: graded towards the ends of conductors.

use super::Body;

/// The requirements on the thickness of layers.
pub(super) struct Layering {
    /// The ends of the mesh along the axis, m.
    pub(super) span: [f64; 2],
    /// The smallest size of triangles at outlines, m: layers at the ends of bodies are no thicker.
    pub(super) near: f64,
    /// Growth of the thickness per distance from the ends of bodies.
    pub(super) growth: f64,
    /// Thickness of the first layer at an end of a conductor, relative to the thinner of the two adjacent
    /// intervals.
    pub(super) first: f64,
}

/// A plane in which bodies begin or end.
#[derive(Debug, Clone, Copy)]
struct EndPlane {
    /// The coordinate along the axis, m.
    at: f64,
    /// Whether a conductor begins or ends there.
    conductor: bool,
}

/// The thickness of layers wanted at a plane.
struct Thickness {
    /// The coordinate of the plane along the axis, m.
    at: f64,
    /// The thickness, m.
    size: f64,
}

/// A step along the axis between two planes.
#[derive(Clone, Copy)]
struct Step {
    /// The coordinate along the axis, m.
    at: f64,
    /// The number of layers of the wanted thickness between the lower plane and this step.
    layers: f64,
}

/// The planes between layers, ascending, m. Ends of bodies that differ by rounding become equal.
pub(super) fn layer_planes(bodies: &mut [Body], layering: &Layering) -> Vec<f64> {
    let span = layering.span;
    let planes = end_planes(bodies, span);
    let sizes = thicknesses(&planes, layering);
    let wanted = |z: f64| {
        sizes.iter().map(|s| s.size + layering.growth * (z - s.at).abs()).fold(span[1] - span[0], f64::min)
    };
    let mut nodes = vec![planes[0].at];
    for pair in planes.windows(2) {
        let (a, b) = (pair[0].at, pair[1].at);
        // The number of layers of the wanted thickness is integrated in steps that are small against the
        // layers.
        let mut steps = vec![Step { at: a, layers: 0.0 }];
        let (mut z, mut sum) = (a, 0.0);
        while z < b {
            let size = wanted(z);
            let step = (0.05 * size).min(b - z);
            sum += step / wanted(z + 0.5 * step);
            z = if step < 0.05 * size { b } else { z + step };
            steps.push(Step { at: z, layers: sum });
        }
        let count = sum.ceil().max(1.0) as usize;
        for i in 1..count {
            let target = sum * i as f64 / count as f64;
            let k = steps.partition_point(|s| s.layers < target).clamp(1, steps.len() - 1);
            let (low, high) = (steps[k - 1], steps[k]);
            let beyond = (high.at - low.at) * (target - low.layers) / (high.layers - low.layers);
            nodes.push(low.at + beyond);
        }
        nodes.push(b);
    }
    nodes
}

/// The ends of the span and of all bodies within it, ascending. Ends that differ by rounding are moved to the
/// same plane.
fn end_planes(bodies: &mut [Body], span: [f64; 2]) -> Vec<EndPlane> {
    let same = 1e-9
        * bodies
            .iter()
            .flat_map(|b| b.ends)
            .filter(|z| z.is_finite())
            .fold(0.0, |size, z| f64::max(size, (z - 0.5 * (span[0] + span[1])).abs()));
    let mut planes = span.map(|at| EndPlane { at, conductor: false }).to_vec();
    for body in bodies {
        let conductor = body.filling.is_conductor();
        for z in &mut body.ends {
            match planes.iter_mut().find(|p| (p.at - *z).abs() <= same) {
                Some(plane) => {
                    *z = plane.at;
                    plane.conductor |= conductor;
                }
                None if *z > span[0] && *z < span[1] => planes.push(EndPlane { at: *z, conductor }),
                None => {}
            }
        }
    }
    planes.sort_by(|a, b| a.at.total_cmp(&b.at));
    planes
}

/// The thickness wanted at each plane. At the ends of the mesh, it matters only if a conductor ends there.
fn thicknesses(planes: &[EndPlane], layering: &Layering) -> Vec<Thickness> {
    let count = planes.len();
    let mut out = Vec::new();
    for (i, plane) in planes.iter().enumerate() {
        let is_end_of_mesh = i == 0 || i + 1 == count;
        if is_end_of_mesh && !plane.conductor {
            continue;
        }
        let below = if i > 0 { plane.at - planes[i - 1].at } else { f64::INFINITY };
        let above = if i + 1 < count { planes[i + 1].at - plane.at } else { f64::INFINITY };
        let part = if plane.conductor { layering.first.clamp(1e-3, 1.0) } else { 1.0 };
        out.push(Thickness { at: plane.at, size: (part * below.min(above)).min(layering.near) });
    }
    out
}

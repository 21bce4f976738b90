//! Permittivities in open space outside the mesh.

use crate::scene::Scene;

/// Bounds of the relative permittivity that rays from `center` through a face (corners in m) can meet beyond
/// it.
///
/// All bodies of finite extent lie within the mesh. A dielectric that extends to infinity counts if the box
/// around it meets the smallest box around the rays; a box that fills this one hides earlier dielectrics and
/// the background.
pub(super) fn permittivity_beyond(scene: &Scene, center: [f64; 3], corners: [[f64; 3]; 3]) -> [f64; 2] {
    // The smallest box around the rays, whose ends along each axis may be infinite.
    let range = [0, 1, 2].map(|a| {
        let out = corners.map(|p| p[a] - center[a]);
        let (low, high) = (out[0].min(out[1]).min(out[2]), out[0].max(out[1]).max(out[2]));
        let low = if low < 0.0 { f64::NEG_INFINITY } else { low + center[a] };
        let high = if high > 0.0 { f64::INFINITY } else { high + center[a] };
        [low, high]
    });
    let mut met = [f64::INFINITY, f64::NEG_INFINITY];
    let mut meet = |permittivity: f64| met = [met[0].min(permittivity), met[1].max(permittivity)];
    let permittivities = scene.permittivities();
    let parts: Vec<_> = scene.dielectric_parts().collect();
    for (dielectric, shape) in parts.into_iter().rev() {
        let Some(region) = shape.bounds() else { continue };
        let meets_rays = |a: usize| {
            let [low, high] = range[a];
            if low == high {
                region.min[a] <= low && low <= region.max[a]
            } else {
                region.min[a] < high && low < region.max[a]
            }
        };
        if (0..3).all(meets_rays) {
            meet(permittivities[1 + dielectric]);
        }
        let is_box = shape.as_box().is_some();
        if is_box && (0..3).all(|a| region.min[a] <= range[a][0] && range[a][1] <= region.max[a]) {
            return met;
        }
    }
    meet(scene.background_permittivity);
    met
}

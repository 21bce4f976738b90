//! The region that fills each tetrahedron.

use super::delaunay::Delaunay;
use super::faceting::faceted;
use super::region::Region;
use super::{MeshError, Point, Sizing};
use crate::meshing::tets::determinant;
use crate::scene::Scene;
use crate::shapes::Shape;
use elastocap_linalg::vector::{length, minus};

/// Each part between surfaces is sampled in at most this many tetrahedra. It is not tuned.
const MAX_SAMPLES: usize = 24;

/// A tetrahedron is sampled if its volume is at least this share of that of the largest one of its part. It
/// is not tuned.
const SAMPLED_VOLUME: f64 = 1e-3;

/// The meshed parts of bodies, for the lookup of the region at a point.
pub(super) struct Filling {
    /// Parts of conductors, each with the index of its conductor.
    conductors: Vec<(usize, FacetedPart)>,
    /// Parts of dielectrics, each with the index of its dielectric.
    dielectrics: Vec<(usize, FacetedPart)>,
}

/// A part of a body, as it is meshed.
struct FacetedPart {
    /// Shapes with flat faces ([`faceted`]).
    pieces: Vec<Shape>,
    /// Whether the part is everything outside the pieces.
    hollow: bool,
    /// The spheres around the facets of a part that a sphere bounds. At most points they decide, without the
    /// winding number of the facets.
    sphere: Option<SphereBounds>,
}

/// Two spheres between which all facets of a sphere lie.
struct SphereBounds {
    /// The middle of both spheres, m.
    center: Point,
    /// The radius of the inner sphere, m.
    inner: f64,
    /// The radius of the outer sphere, m.
    outer: f64,
}

impl FacetedPart {
    /// The part with this shape.
    fn new(shape: &Shape, sizing: &Sizing) -> Self {
        let faceting_error = 0.5 * sizing.facet * sizing.facet;
        let sphere = match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => Some(SphereBounds {
                center: *center,
                inner: (1.0 - faceting_error) * radius,
                outer: (1.0 + faceting_error) * radius,
            }),
            Shape::Box(_)
            | Shape::Capsule { .. }
            | Shape::Cylinder { .. }
            | Shape::Tube { .. }
            | Shape::Extrusion { .. }
            | Shape::Surface(_)
            | Shape::Physical(_) => None,
        };
        let hollow = matches!(shape, Shape::Shell { .. });
        Self { pieces: faceted(shape, sizing), hollow, sphere }
    }

    /// Whether a point lies in the part.
    fn contains(&self, p: Point) -> bool {
        if let Some(SphereBounds { center, inner, outer }) = self.sphere {
            let distance = length(minus(p, center));
            if distance < inner || distance > outer {
                return (distance < inner) != self.hollow;
            }
        }
        self.pieces.iter().any(|piece| piece.contains(p)) != self.hollow
    }
}

impl Filling {
    /// The meshed parts of a scene.
    pub(super) fn new(scene: &Scene, sizing: &Sizing) -> Self {
        let faceted = |(k, part): (usize, &Shape)| (k, FacetedPart::new(part, sizing));
        Self {
            conductors: scene.conductor_parts().map(faceted).collect(),
            dielectrics: scene.dielectric_parts().map(faceted).collect(),
        }
    }

    /// The region at a point: conductors take precedence over dielectrics, later dielectrics over earlier
    /// ones.
    pub(super) fn at(&self, p: Point) -> Region {
        if let Some((c, _)) = self.conductors.iter().find(|(_, part)| part.contains(p)) {
            return Region::Conductor(*c as u32);
        }
        let dielectric = self.dielectrics.iter().rfind(|(_, part)| part.contains(p));
        dielectric.map_or(Region::Background, |(d, _)| Region::Dielectric(*d as u32))
    }
}

/// Sets the region of every tetrahedron.
///
/// # Errors
/// [`MeshError::Leak`] where tetrahedra that no kept face separates are in different regions.
pub(super) fn assign_regions(mesh: &mut Delaunay, filling: &Filling) -> Result<(), MeshError> {
    let mut seen = vec![false; mesh.tets.len()];
    for first in 0..mesh.tets.len() as u32 {
        if seen[first as usize] || !mesh.alive(first) {
            continue;
        }
        let part = enclosed_part(mesh, first, &mut seen);
        // The centroids of large tetrahedra are the safest places to sample; all samples must agree.
        let volume = |t: u32| {
            let [a, b, c, d] = mesh.corners(t);
            determinant(a, b, c, d)
        };
        let mut large: Vec<(f64, u32)> = part.iter().map(|&t| (volume(t), t)).collect();
        large.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let least = large.first().map_or(0.0, |l| SAMPLED_VOLUME * l.0);
        large.retain(|l| l.0 >= least);
        let mut agreed = None;
        for (_, t) in large.iter().step_by(large.len().div_ceil(MAX_SAMPLES).max(1)) {
            let corners = mesh.corners(*t);
            let centroid = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            let region = filling.at(centroid);
            if *agreed.get_or_insert(region) != region {
                return Err(MeshError::Leak { at: centroid });
            }
        }
        let Some(region) = agreed else { continue };
        for t in part {
            mesh.regions[t as usize] = region;
        }
    }
    Ok(())
}

/// Checks that kept faces still separate all regions after refinement.
///
/// # Errors
/// [`MeshError::Leak`] where tetrahedra of different regions have a face in common that is not kept.
pub(super) fn check_regions(mesh: &Delaunay) -> Result<(), MeshError> {
    for t in (0..mesh.tets.len() as u32).filter(|&t| mesh.alive(t)) {
        let leaks = |i: &usize| {
            let region = |t: u32| mesh.regions[t as usize];
            mesh.kept_face(t, *i).is_none() && mesh.neighbour(t, *i).is_some_and(|n| region(n) != region(t))
        };
        if (0..4).any(|i| leaks(&i)) {
            return Err(MeshError::Leak { at: mesh.corners(t)[0] });
        }
    }
    Ok(())
}

/// The tetrahedra that can be reached from one without crossing a kept face; all are marked as seen.
fn enclosed_part(mesh: &Delaunay, first: u32, seen: &mut [bool]) -> Vec<u32> {
    seen[first as usize] = true;
    let mut part = vec![first];
    let mut next = 0;
    while next < part.len() {
        let t = part[next];
        next += 1;
        for i in 0..4 {
            if let Some(n) = mesh.neighbour(t, i)
                && mesh.kept_face(t, i).is_none()
                && !seen[n as usize]
            {
                seen[n as usize] = true;
                part.push(n);
            }
        }
    }
    part
}

//! Refusal of scenes in which two conductors touch, since they would have one potential.

use super::{Intersections, in_or_near_polygon};
use crate::meshing::tets::mesher::MeshError;
use crate::meshing::tets::mesher::piecewise_linear_complex::PiecewiseLinearComplex;

impl Intersections<'_> {
    /// Fails if two different conductors have a point of the complex in common.
    ///
    /// # Errors
    /// [`MeshError::Crossing`] names the two and the point.
    pub(super) fn refuse_conductor_contacts(&self) -> Result<(), MeshError> {
        let PiecewiseLinearComplex { parts, facets, points, facets_of_point, .. } = &*self.complex;
        let conductor = |part: u32| parts[part as usize].conductor;
        // The conductors to which each facet belongs.
        let conductors_of_facet: Vec<Vec<u32>> = facets
            .iter()
            .map(|f| {
                let mut conductors: Vec<u32> = f.polygons.iter().filter_map(|p| conductor(p.part?)).collect();
                conductors.sort_unstable();
                conductors.dedup();
                conductors
            })
            .collect();
        for (&point, facets_here) in points.iter().zip(facets_of_point) {
            let mut conductors: Vec<u32> =
                facets_here.iter().flat_map(|&f| conductors_of_facet[f as usize].iter().copied()).collect();
            conductors.sort_unstable();
            conductors.dedup();
            if conductors.len() < 2 {
                continue;
            }
            // A facet may belong to a conductor at other points only.
            let reaches = |c: &u32| {
                facets_here.iter().any(|&f| {
                    let facet = &facets[f as usize];
                    let q = facet.project(point);
                    let polygons = facet.polygons.iter();
                    let mut polygons = polygons.filter(|p| p.part.and_then(conductor) == Some(*c));
                    conductors_of_facet[f as usize].contains(c)
                        && polygons.any(|p| in_or_near_polygon(&p.corners, q, self.near))
                })
            };
            conductors.retain(reaches);
            if let [first, second, ..] = conductors[..] {
                let named = |c: u32| parts.iter().find(|part| part.conductor == Some(c));
                let name = |c: u32| named(c).map_or_else(String::new, |part| part.name.clone());
                return Err(MeshError::Crossing { first: name(first), second: name(second), at: point });
            }
        }
        Ok(())
    }
}

//! Meshes of a quarter of the layer, of finite width.
//!
//! Reference coordinates: planes of symmetry at `x1 = 0` and `x3 = 0`, the substrate at `x2 = 0`, the end at
//! `x1 = half_length`, the side at `x3 = half_width`.

use super::mesh::Sweep;
use crate::solid::dimension::Space;
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel, include};
use crate::solid::mesh::{Mesh, Patch, uniform};
use crate::solid::model::{Body, ModelError};
use crate::solid::symmetry::Symmetry;
use elastocap_materials::Rubber;

/// The breakpoints and fans of a mesh of a quarter of the layer.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLayerMesh {
    /// The section `x3 = 0`: of a mesh of the whole layer the half with `x1 > 0`.
    pub section: LayerMesh,
    /// Breakpoints along `x3` in m: from 0 to the half width, or to where the fan at the side begins.
    pub across: Vec<f64>,
    /// How far the fan around the bonded edge of the side extends inwards, in m. It has the shape of the fan
    /// at the end, scaled to this width, and the two meet in a mitre. `None` for plain hexahedra up to the
    /// side, which are needed where the section has no fan at its end, or one around a punch.
    pub side_fan: Option<f64>,
}

impl SpaceLayerMesh {
    /// A mesh with about `n` equal steps over the half width (m) and, where the section allows it, a fan at
    /// the side: over half the half width, but at most as wide as the fan at the end.
    pub fn new(section: LayerMesh, half_width: f64, n: usize) -> Self {
        let along = section.along[section.along.len() - 1];
        let possible = section.punch.is_none() && !section.radii.is_empty();
        let side_fan = possible.then(|| (0.5 * half_width).min(section.half_length() - along));
        let inner = half_width - side_fan.unwrap_or(0.0);
        let steps = (n as f64 * inner / half_width).round().max(1.0) as usize;
        Self { section, across: uniform(0.0, inner, steps), side_fan }
    }

    /// An upper estimate of the number of hexahedra, from the breakpoints alone.
    pub fn elements_at_most(&self) -> usize {
        // The fan at the side has no more layers than that at the end.
        let across = self.across.len() + self.section.radii.len();
        self.section.elements_at_most().saturating_mul(across)
    }

    /// Half the width of the layer in m.
    pub fn half_width(&self) -> f64 {
        self.across[self.across.len() - 1] + self.side_fan.unwrap_or(0.0)
    }

    /// The mesh.
    pub fn mesh(&self) -> Mesh<Space> {
        let section = self.section.clone().half();
        let Some(rim) = self.side_fan else {
            let section = section.mesh();
            return Mesh::from_sweeps(&[Sweep { section: &section, along: &self.across, map: &|x| x }]);
        };
        let LayerMesh { along, up, end_top, radii, .. } = &section;
        let (inner, length) = (along[along.len() - 1], end_top[end_top.len() - 1]);
        let (inner_width, width) = (self.across[self.across.len() - 1], self.half_width());
        let body = Mesh::from_patches(&[Patch::tensor(along, up)]);
        // The fan at the end, by the distance from the end. The fan at the side is the same, scaled to the
        // width `rim`.
        let end = length - inner;
        let top = up[up.len() - 1];
        let mut outline: Vec<[f64; 2]> = up.iter().map(|&y| [end, y]).collect();
        outline.extend(end_top.iter().skip(1).map(|&x| [length - x, top]));
        let fan = Mesh::from_patches(&[Patch::fan([0.0, 0.0], &outline, radii)]);
        // In the fans, the lines spread so that both fans end at the vertical edge where end and side meet.
        let spread = |distance: f64| (end - distance) / end;
        Mesh::from_sweeps(&[
            Sweep { section: &body, along: &self.across, map: &|x| x },
            Sweep {
                section: &fan,
                along: &self.across,
                map: &|[distance, y, x3]| {
                    [length - distance, y, x3 * (1.0 + spread(distance) * rim / inner_width)]
                },
            },
            Sweep {
                section: &fan,
                along,
                map: &|[distance, y, x1]| {
                    let x3 = width - distance * rim / end;
                    [x1 * (1.0 + spread(distance) * end / inner), y, x3]
                },
            },
        ])
    }
}

/// The condition at the side of the layer, at `x3 = half_width`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SideCondition {
    /// Free of traction, and where the end is [`End::FreeOnSubstrate`], on a substrate that continues beyond
    /// the side as well.
    Free,
    /// A plane of symmetry: with it on both sides, the layer is in plane strain.
    Symmetric,
}

impl LayerModel<Space> {
    /// A quarter of a layer of finite width at rest; a sharp punch goes all along `x3`.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn of_finite_width(
        mesh: &SpaceLayerMesh,
        rubber: Rubber,
        indenter: Indenter,
        end: End,
        side: SideCondition,
    ) -> Result<Self, ModelError> {
        Self::of_finite_width_with_inclusions(mesh, rubber, &[], indenter, end, side)
    }

    /// A quarter of a layer of finite width at rest with bodies of other rubbers in it. Each element belongs
    /// to the body that contains its centre, so that the breakpoints of the mesh should include the faces of
    /// the bodies.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn of_finite_width_with_inclusions(
        mesh: &SpaceLayerMesh,
        rubber: Rubber,
        inclusions: &[Inclusion<Space>],
        indenter: Indenter,
        end: End,
        side: SideCondition,
    ) -> Result<Self, ModelError> {
        mesh.section.check()?;
        Self::of_quarter(mesh.mesh(), rubber, inclusions, indenter, end, side)
    }

    /// A quarter of a layer of finite width at rest with bodies of other rubbers in it, on a mesh of the
    /// quarter that is given.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub(crate) fn of_quarter(
        mesh: Mesh<Space>,
        rubber: Rubber,
        inclusions: &[Inclusion<Space>],
        indenter: Indenter,
        end: End,
        side: SideCondition,
    ) -> Result<Self, ModelError> {
        let reach = |axis: usize| mesh.nodes.iter().map(|x| x[axis]).fold(0.0, f64::max);
        let [length, thickness, half_width] = [0, 1, 2].map(reach);
        let [length, half_width] = [length, half_width].map(|reach| (1.0 - 1e-9) * reach);
        let mut body = Body::new(mesh, rubber);
        include(&mut body, inclusions);
        body.hold(2, |x| x[2] == 0.0 || side == SideCondition::Symmetric && x[2] > half_width);
        Self::with(body, thickness, (indenter, 0.0), end, Symmetry::Quarter, |x| {
            x[0] > length || side == SideCondition::Free && x[2] > half_width
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fans_of_end_and_side_meet_and_fill_the_layer() {
        let section = LayerMesh::uniform(1.0, 3.0, 2, 0.5, 1);
        let layer = SpaceLayerMesh { section, across: uniform(0.0, 0.6, 2), side_fan: Some(0.4) };
        let mesh = layer.mesh();
        let outside = mesh.boundary().iter().all(|face| {
            let x = mesh.nodes[face.nodes[4] as usize];
            let near = |k: usize, at: f64| (x[k] - at).abs() < 1e-12;
            near(0, 0.0) || near(0, 3.0) || near(1, 0.0) || near(1, 1.0) || near(2, 0.0) || near(2, 1.0)
        });
        assert!(outside);
        let volume: f64 = mesh
            .elements
            .iter()
            .map(|e| {
                use crate::solid::dimension::Element;
                let x = e.map(|n| mesh.nodes[n as usize]);
                super::super::element::ReferenceElement::new(&x).unwrap().volume()
            })
            .sum();
        assert!((volume - 3.0).abs() < 1e-12, "{volume}");
    }
}

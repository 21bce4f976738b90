//! A layer of finite width, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::layer::{SideCondition, SpaceLayerMesh};
use crate::solid::dimension::Space;
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel};
use crate::solid::levels::{fit_to_edges, within_limit};
use crate::solid::mesh::{geometric, graded, uniform};
use crate::solid::model::{Equations, ModelError};
use crate::solid::newton::NewtonSettings;
use crate::solid::obstacle::IndenterProfile;
use crate::solid::press::{Goal, Pressing, Refinement, press_on};
use elastocap_materials::Rubber;

/// A layer of finite width and its indenter, both symmetric about `x1 = 0` and `x3 = 0`. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLayer {
    /// Thickness `H` at rest.
    pub thickness: f64,
    /// From the middle of the layer to its end along `x1`, at rest; more than the thickness.
    pub half_length: f64,
    /// From the middle of the layer to its side along `x3`, at rest.
    pub half_width: f64,
    /// What the layer is made of.
    pub rubber: Rubber,
    /// Bodies of another rubber in the quarter with `x1 > 0` and `x3 > 0`, within [`SpaceLayer::room`].
    pub inclusions: Vec<Inclusion<Space>>,
    /// What presses.
    pub indenter: Indenter,
    /// The condition at the end.
    pub end: End,
    /// The condition at the side.
    pub side: SideCondition,
}

impl Refinement {
    /// Up to four meshes of hexahedra, with 2 to 8 over the thickness: in space it would cost too much to halve their size each
    /// time. The numbers are even, so that the fans gain one ring each time.
    pub fn in_space(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: vec![2, 4, 6, 8] }
    }
}

impl SpaceLayer {
    /// The mesh of a quarter of this layer with about `n` hexahedra over its thickness.
    pub fn mesh(&self, n: usize) -> SpaceLayerMesh {
        let (height, length) = (self.thickness, self.half_length);
        let mut section = match self.indenter {
            // The fan takes up half the thickness, where an even number fits, but for what lies in the layer below it.
            Indenter::Sharp { half_width }
            | Indenter::Held { half_width }
            | Indenter::Bonded { half_width } => {
                let highest = self.edges(1).fold(0.0, f64::max);
                let reach = (0.5 * height).min(0.9 * (height - highest));
                LayerMesh::under_punch(height, length, [half_width, reach], n, 0.5, n / 2)
            }
            Indenter::WholeTop | Indenter::Smooth(_) => {
                let size = self.size(n, 0);
                LayerMesh {
                    along: graded(0.0, length - height, &size),
                    up: graded(0.0, height, |y| (self.finest(n) + 0.5 * (height - y)).min(height / n as f64)),
                    end_top: uniform(length - height, length, n.div_ceil(2)),
                    radii: if self.end == End::Far { Vec::new() } else { geometric(0.5, n / 2) },
                    punch: None,
                }
            }
        };
        let LayerMesh { along, up, punch, .. } = &mut section;
        let kept = punch.as_ref().map(|p| (p.along.map(|k| along[k]), up[p.up]));
        let edges: [Vec<f64>; 3] = std::array::from_fn(|axis| self.edges(axis).collect());
        // Refinement at edges, as in plane strain, would take minutes for a load here; the error states what is missing.
        let smallest = f64::INFINITY;
        fit_to_edges(along, kept.as_ref().map_or(&[][..], |k| &k.0[..]), &edges[0], smallest);
        fit_to_edges(up, kept.as_ref().map_or(&[][..], |k| std::slice::from_ref(&k.1)), &edges[1], smallest);
        if let (Some(punch), Some((ends, low))) = (punch, kept) {
            let at = |x: f64, of: &[f64]| of.iter().position(|y| *y == x).unwrap_or(0);
            (punch.along, punch.up) = (ends.map(|x| at(x, along)), at(low, up));
        }
        let side_fan = self.side_fan();
        let mut across = graded(0.0, self.half_width - side_fan.unwrap_or(0.0), self.size(n, 1));
        fit_to_edges(&mut across, &[], &edges[2], smallest);
        SpaceLayerMesh { section, across, side_fan }
    }

    /// The mesh of [`SpaceLayer::mesh`], unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`].
    pub fn mesh_within_limit(&self, n: usize) -> Result<SpaceLayerMesh, ModelError> {
        let mesh = self.mesh(n);
        within_limit(mesh.elements_at_most())?;
        Ok(mesh)
    }

    /// Inward reach of the fan at the side in m, if there is one: half the half width, and at most that of the fan at the end.
    fn side_fan(&self) -> Option<f64> {
        let straight = self.indenter.sharp_corner().is_some()
            || self.end == End::Far
            || self.side == SideCondition::Symmetric;
        (!straight).then(|| self.thickness.min(0.5 * self.half_width))
    }

    /// How far inclusions may reach from the middle along `x1` and `x3`, in m; the hexahedra beyond belong to fans.
    pub fn room(&self) -> [f64; 2] {
        [self.half_length - self.thickness, self.half_width - self.side_fan().unwrap_or(0.0)]
    }

    /// Lower and upper ends of the inclusions along an axis.
    fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// Size of the smallest hexahedra at the surface, in m, with about `n` over the thickness.
    pub fn finest(&self, n: usize) -> f64 {
        let part = if self.indenter.is_rounded() { 0.5 } else { 1.0 };
        part * self.thickness / n as f64
    }

    /// Size in m of the hexahedra as a function of the distance from the middle along `x1` (`axis` 0) or `x3` (1). They are finer where
    /// the surface bends around the indenter.
    fn size(&self, n: usize, axis: usize) -> impl Fn(f64) -> f64 {
        // How far a round indenter reaches that is pressed into a third of the layer.
        let reach = |radius: f64| (2.0 / 3.0 * radius * self.thickness).sqrt().min(radius);
        let along_x1 = |at: f64| (axis == 0).then_some(at);
        let at = match self.indenter {
            Indenter::Smooth(profile) => match profile {
                IndenterProfile::Block { half_widths, .. } => Some(half_widths[axis]),
                IndenterProfile::Sphere { radius } => Some(reach(radius)),
                IndenterProfile::Cylinder { radius } => along_x1(reach(radius)),
                IndenterProfile::Punch { half_width, .. } => along_x1(half_width),
            },
            Indenter::WholeTop | Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => {
                None
            }
        };
        let (fine, coarse) = (self.finest(n), self.thickness / n as f64);
        move |x| at.map_or(coarse, |at| (fine + 0.5 * (x - at).abs()).min(coarse))
    }

    /// Presses the layer to each of `goals`, all of them compressions or all of them forces.
    ///
    /// No mesh that would take more than `memory_limit` bytes is started. `cancel` stops the work before the next linear system; `tell` is
    /// called with the number of the mesh and the number of goals done on it.
    ///
    /// # Errors
    /// [`ModelError`] where there is no mesh, or none that fits into the memory. A goal that is not reached has its own error in the
    /// result.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        memory_limit: u64,
        cancel: &AtomicBool,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing<Space>, ModelError> {
        let rounded = self.indenter.is_rounded();
        // Gaps of 1e-5 sides of the mesh where the pressure is the shear modulus change a force by less than 1e-4.
        let settings = NewtonSettings {
            tolerance: 1e-7,
            first_step: if rounded { 0.5 } else { 1.0 },
            moving_gap: 3e-3,
            final_gap: 1e-5,
            ..Default::default()
        };
        press_on(goals, refinement, &|_| settings, None, cancel, tell, &|n| 1.0 / n as f64, &|n| {
            let mesh = self.mesh_within_limit(n)?;
            let elements = mesh.mesh().elements.len();
            let fits = |bytes: u64| match bytes <= memory_limit {
                true => Ok(()),
                false => Err(ModelError::TooLarge { elements, bytes, limit: memory_limit }),
            };
            // What the elements take is taken with the equations, what the factor takes only afterwards.
            fits(Equations::<Space>::element_bytes(elements))?;
            let model = LayerModel::of_finite_width_with_inclusions(
                &mesh,
                self.rubber.clone(),
                &self.inclusions,
                self.indenter,
                self.end,
                self.side,
            )?;
            fits(model.equations().memory_bytes())?;
            Ok(model)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer() -> SpaceLayer {
        SpaceLayer {
            thickness: 1.0,
            half_length: 2.0,
            half_width: 0.8,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: Indenter::WholeTop,
            end: End::Free,
            side: SideCondition::Free,
        }
    }

    #[test]
    fn a_mesh_that_does_not_fit_into_the_memory_is_not_begun() {
        let (layer, stop) = (layer(), AtomicBool::new(false));
        let press = |limit: u64| {
            let refinement = Refinement { relative_tolerance: 1e-9, meshes: vec![1, 2] };
            layer.press(&[Goal::Compression(0.05)], &refinement, limit, &stop, &|_, _| ())
        };
        assert!(matches!(press(1000), Err(ModelError::TooLarge { limit: 1000, .. })));
        let model = |n: usize| {
            let of = &layer;
            LayerModel::of_finite_width(&of.mesh(n), of.rubber.clone(), of.indenter, of.end, of.side).unwrap()
        };
        let [first, second] = [1, 2].map(|n| model(n).equations().memory_bytes());
        assert!(first < second);
        let pressing = press(second - 1).unwrap();
        assert_eq!(pressing.levels.len(), 1);
        assert!(matches!(pressing.too_large, Some(ModelError::TooLarge { bytes, .. }) if bytes == second));
        assert!(pressing.goals[0].is_ok());
        let all = press(second).unwrap();
        assert!(all.levels.len() == 2 && all.too_large.is_none());
    }
}

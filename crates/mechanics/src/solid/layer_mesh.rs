//! Meshes of a layer in the plane: tensor products with fans around the bonded end and the edge of a patch.

use super::mesh::{Mesh, Patch, geometric, uniform};
use super::model::ModelError;

/// The breakpoints and fans of a mesh of the layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerMesh {
    /// Breakpoints along `x1` in m, up to where the elements at the end of the layer begin. They start at the
    /// axis or, for a whole layer, where the elements at its other end begin.
    pub along: Vec<f64>,
    /// Breakpoints from the substrate to the top, in m.
    pub up: Vec<f64>,
    /// Breakpoints along the top in m, from the last one of `along` to the end. A whole layer has their
    /// mirror images at its other end.
    pub end_top: Vec<f64>,
    /// Where the fan around the bonded corner of the end is cut into rings: fractions of the way from that
    /// corner, from 0 to 1. Empty for a mesh without a fan there: a tensor product, which turns inside out at
    /// that corner.
    pub radii: Vec<f64>,
    /// A fan around the point of the top where a patch that is held or bonded ends, if there is one.
    pub punch: Option<PunchFan>,
}

/// Sectors around the point where a patch that is held or bonded ends: the surface next to it turns up by 90
/// degrees and more, which two quadrilaterals that meet there cannot follow.
#[derive(Debug, Clone, PartialEq)]
pub struct PunchFan {
    /// Indices of the breakpoints along `x1` at which the fan begins and ends; its centre is between them.
    pub along: [usize; 2],
    /// Index of the breakpoint from the substrate to the top at which the fan begins.
    pub up: usize,
    /// `x1` of the centre of the fan in m.
    pub corner: f64,
    /// Where the fan is cut into rings: fractions of the way from its centre, from 0 to 1.
    pub radii: Vec<f64>,
}

/// The distance from the end of a layer over which the elements at the end extend inwards: the `thickness`,
/// but at most half the way to `from`, the middle of the layer or the edge of a patch on it. All lengths in
/// m.
pub(crate) fn end_reach(thickness: f64, half_length: f64, from: f64) -> f64 {
    thickness.min(0.5 * (half_length - from))
}

/// Breakpoints at the ascending distances `left` and `right` from `middle`, to the left and to the right of
/// it, in m. The first distance is 0.
pub(super) fn about(middle: f64, left: &[f64], right: &[f64]) -> Vec<f64> {
    let left = left.iter().skip(1).rev().map(|away| middle - away);
    left.chain(right.iter().map(|away| middle + away)).collect()
}

impl LayerMesh {
    /// A mesh with `n` equal quadrilaterals over the thickness and as many over each thickness of length; the
    /// fan at the bonded end has `rings` rings that shrink by `ratio`.
    pub fn uniform(thickness: f64, half_length: f64, n: usize, ratio: f64, rings: usize) -> Self {
        let body = half_length - thickness;
        let along = ((body / thickness) * n as f64).round().max(1.0) as usize;
        Self {
            along: uniform(0.0, body, along),
            up: uniform(0.0, thickness, n),
            end_top: uniform(body, half_length, n),
            radii: geometric(ratio, rings),
            punch: None,
        }
    }

    /// A tensor product for an end that folds: equal quadrilaterals of `thickness / cells` within `block`
    /// thicknesses of the bonded corner, from there each `growth` times as large as the one before, to
    /// `thickness / n`.
    pub fn folding_end(
        thickness: f64,
        half_length: f64,
        n: usize,
        cells: usize,
        block: f64,
        growth: f64,
    ) -> Self {
        let (fine, coarse) = (thickness / cells.max(n) as f64, thickness / n as f64);
        let graded = |length: f64| {
            let count = (block * thickness / fine).round().max(1.0);
            let mut x = uniform(0.0, count * fine, count as usize);
            let (mut end, mut size) = (count * fine, growth * fine);
            // After each of these, one more element of the next size has to fit in.
            while size < coarse && end + (1.0 + growth) * size < length {
                end += size;
                x.push(end);
                size *= growth;
            }
            let rest = ((length - end) / coarse).round().max(1.0) as usize;
            x.extend(uniform(end, length, rest).iter().skip(1));
            x
        };
        let from_axis: Vec<f64> = graded(half_length).iter().rev().map(|x| half_length - x).collect();
        // Where the list is divided makes no difference: without a fan, `mesh` joins the two parts.
        let cut = from_axis.partition_point(|x| *x <= half_length - thickness).max(1);
        Self {
            along: from_axis[..cut].to_vec(),
            up: graded(thickness),
            end_top: from_axis[cut - 1..].to_vec(),
            radii: Vec::new(),
            punch: None,
        }
    }

    /// A mesh with about `n` quadrilaterals over the thickness for a patch of the top that ends at `corner`
    /// (m), with a fan there that goes as far as `reach` (m), mostly half the thickness; its `rings` shrink
    /// by `ratio`. The fan at the bonded end has one ring.
    pub fn under_punch(
        thickness: f64,
        half_length: f64,
        [corner, reach]: [f64; 2],
        n: usize,
        ratio: f64,
        rings: usize,
    ) -> Self {
        let end = end_reach(thickness, half_length, corner);
        let body = half_length - end;
        let (left, right, low) = (corner - reach, corner + reach, thickness - reach);
        let count = |length: f64| ((length / thickness) * n as f64).round().max(1.0) as usize;
        let mut along = uniform(0.0, left, count(left));
        let first = along.len() - 1;
        along.extend(uniform(left, right, count(2.0 * reach)).iter().skip(1));
        let last = along.len() - 1;
        along.extend(uniform(right, body, count(0.6 * (body - right))).iter().skip(1));
        let mut up = uniform(0.0, low, count(low));
        let floor = up.len() - 1;
        up.extend(uniform(low, thickness, count(reach)).iter().skip(1));
        let punch =
            Some(PunchFan { along: [first, last], up: floor, corner, radii: geometric(ratio, rings) });
        let end_top = uniform(body, half_length, count(0.6 * end));
        Self { along, up, end_top, radii: geometric(0.5, 1), punch }
    }

    /// Thickness of the layer in m.
    pub fn thickness(&self) -> f64 {
        self.up[self.up.len() - 1]
    }

    /// Half the length of the layer in m.
    pub fn half_length(&self) -> f64 {
        self.end_top[self.end_top.len() - 1]
    }

    /// Meshes with more elements than this are not made: a layer much longer than thick would have them, or
    /// one under a corner much sharper than the layer is thick. Pressing the layer on the largest takes some
    /// 10 GB. It is not tuned.
    pub const MAX_ELEMENTS: usize = 1_000_000;

    /// Refuses breakpoints that do not ascend: the patches of such a mesh would lie over one another.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`].
    pub fn check(&self) -> Result<(), ModelError> {
        let ascends = |x: &[f64]| x.windows(2).all(|two| two[0] < two[1]);
        let fan_fits =
            self.punch.as_ref().is_none_or(|PunchFan { along: [first, last], up, corner, .. }| {
                let side = |k: &usize| self.along.get(*k).copied().unwrap_or(f64::NAN);
                side(first) < *corner && *corner < side(last) && *up + 1 < self.up.len()
            });
        let lists = [&self.along, &self.up, &self.end_top];
        let fits = lists.into_iter().all(|x| ascends(x)) && fan_fits;
        if fits { Ok(()) } else { Err(ModelError::NoRoom) }
    }

    /// An upper estimate of the number of elements, from the breakpoints alone.
    pub fn elements_at_most(&self) -> usize {
        let (along, up) = (self.along.len(), self.up.len());
        let end = self.end_top.len();
        let fan = self.radii.len() * (up + end);
        let around_punch = self.punch.as_ref().map_or(0, |punch| {
            let [first, last] = punch.along;
            punch.radii.len() * (2 * up + last.saturating_sub(first))
        });
        let ends = if self.is_whole() { 2 } else { 1 };
        along.saturating_mul(up) + ends * (end.saturating_mul(up) + fan) + around_punch
    }

    /// The mesh.
    pub fn mesh(&self) -> Mesh {
        let (body, top) = (self.along[self.along.len() - 1], self.up[self.up.len() - 1]);
        if self.radii.is_empty() {
            let end = self.end_top.iter().skip(1);
            let other_end = end.clone().rev().filter(|_| self.is_whole()).map(|x| -x);
            let along: Vec<f64> = other_end.chain(self.along.iter().copied()).chain(end.copied()).collect();
            return Mesh::from_patches(&[Patch::tensor(&along, &self.up)]);
        }
        let corner = [self.end_top[self.end_top.len() - 1], 0.0];
        let mut rim: Vec<[f64; 2]> = self.up.iter().map(|&y| [body, y]).collect();
        rim.extend(self.end_top.iter().skip(1).map(|&x| [x, top]));
        let end = Patch::fan(corner, &rim, &self.radii);
        let other_end = self.is_whole().then(|| end.clone().mapped(|x| [-x[0], x[1]]));
        let mut patches = vec![end];
        patches.extend(other_end);
        if let Some(PunchFan { along: [first, last], up: floor, corner, radii }) = &self.punch {
            let (low, high) = (&self.up[..=*floor], &self.up[*floor..]);
            let under = &self.along[*first..=*last];
            patches.push(Patch::tensor(&self.along, low));
            patches.push(Patch::tensor(&self.along[..=*first], high));
            patches.push(Patch::tensor(&self.along[*last..], high));
            let mut rim: Vec<[f64; 2]> = high.iter().rev().map(|&y| [under[0], y]).collect();
            rim.extend(under.iter().skip(1).map(|&x| [x, high[0]]));
            rim.extend(high.iter().skip(1).map(|&y| [under[under.len() - 1], y]));
            patches.push(Patch::fan([*corner, top], &rim, radii));
        } else {
            patches.push(Patch::tensor(&self.along, &self.up));
        }
        Mesh::from_patches(&patches)
    }

    /// Whether the mesh covers the whole layer, and not one half of it.
    pub fn is_whole(&self) -> bool {
        self.along[0] < 0.0
    }

    /// A mesh of the whole layer, of this half and its mirror image, for loads that are not symmetric. A fan
    /// under a punch is not mirrored.
    pub fn mirrored(mut self) -> Self {
        let before = self.along.len() - 1;
        self.along = about(0.0, &self.along, &self.along);
        if let Some(fan) = &mut self.punch {
            fan.along = fan.along.map(|k| k + before);
        }
        self
    }

    /// The half of the mesh with `x1 > 0`.
    pub(super) fn half(mut self) -> Self {
        let before = self.along.partition_point(|x| *x <= 1e-9 * self.half_length());
        self.along.splice(..before, [0.0]);
        if let Some(fan) = &mut self.punch {
            fan.along = fan.along.map(|k| (k + 1).saturating_sub(before));
        }
        self
    }
}

/// Refuses a mesh that may have this number of `elements`, if that is too large.
///
/// # Errors
/// [`ModelError::TooManyElements`].
pub(crate) fn check_elements(elements: usize) -> Result<(), ModelError> {
    let limit = LayerMesh::MAX_ELEMENTS;
    if elements > limit { Err(ModelError::TooManyElements { elements, limit }) } else { Ok(()) }
}

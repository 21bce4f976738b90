//! A body by its boxes, with the place in the file that says where it is.

use std::borrow::Cow;
use std::ops::Range;

use elastocap_geometry::scene::Purpose;

use super::super::model::{Box3, Shape};
use super::overlaps::PlacedConductor;

/// A conductor or dielectric by its boxes, or by the box around it, with the place in the file that says where it is.
pub(super) struct PlacedBoxes<'a> {
    pub(super) name: &'a str,
    /// Never empty.
    pub(super) regions: Vec<Box3>,
    pub(super) span: Range<usize>,
    pub(super) what: &'static str,
    pub(super) floating_charge: Option<f64>,
    pub(super) is_slab: bool,
    /// Whether it is of no other shape than its regions.
    pub(super) is_boxes: bool,
    /// The purpose of the body, which says what it moves with.
    pub(super) purpose: Purpose,
}

impl PlacedBoxes<'_> {
    /// A conductor as it is compared with others for a point that they share.
    pub(super) fn conductor(&self) -> PlacedConductor<'_> {
        let parts = self.regions.iter().copied().map(Shape::Box).collect();
        PlacedConductor { name: self.name, span: &self.span, parts: Cow::Owned(parts) }
    }
}

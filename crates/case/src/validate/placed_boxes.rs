//! A body by its boxes, with the place in the file that gives its shape.

use std::borrow::Cow;
use std::ops::Range;

use elastocap_geometry::scene::Purpose;

use super::super::model::{Box3, Shape};
use super::overlaps::PlacedConductor;

/// A conductor or dielectric by its boxes, or by its bounding box, with the place in the file that gives its
/// shape.
pub(super) struct PlacedBoxes<'a> {
    pub(super) name: &'a str,
    /// The boxes, at least one.
    pub(super) regions: Vec<Box3>,
    /// The place in the file that gives the shape.
    pub(super) span: Range<usize>,
    /// "conductor" or "dielectric".
    pub(super) what: &'static str,
    /// The charge of a floating conductor, C.
    pub(super) floating_charge: Option<f64>,
    /// Whether the body is a slab, which goes on without end up to the walls.
    pub(super) is_slab: bool,
    /// Whether the body consists of exactly these boxes.
    pub(super) is_boxes: bool,
    /// The purpose of the body, which tells what it moves with.
    pub(super) purpose: Purpose,
}

impl PlacedBoxes<'_> {
    /// The conductor for tests of shared points.
    pub(super) fn conductor(&self) -> PlacedConductor<'_> {
        let parts = self.regions.iter().copied().map(Shape::Box).collect();
        PlacedConductor { name: self.name, span: &self.span, parts: Cow::Owned(parts) }
    }
}

//! The hanging nodes and sides of a mesh with elements of different sizes side by side.

use std::collections::BTreeMap;

/// The hanging nodes and sides of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hanging {
    /// For each hanging node its masters, none of which hangs, with their weights: its displacement is the
    /// weighted sum of those of its masters.
    pub nodes: BTreeMap<u32, Vec<(u32, f64)>>,
    /// The sides that are parts of a larger one.
    pub sides: Vec<HangingSide>,
}

/// A side of an element that is a part of a larger side of another. A side is identified by its element and
/// the node in its middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HangingSide {
    /// The smaller side.
    pub fine: (u32, u32),
    /// The larger side.
    pub coarse: (u32, u32),
}

/// Adds `weight` to the weight of a `master`, which is appended if it is not among the `masters`.
pub(super) fn add(masters: &mut Vec<(u32, f64)>, master: u32, weight: f64) {
    match masters.iter_mut().find(|known| known.0 == master) {
        Some(known) => known.1 += weight,
        None => masters.push((master, weight)),
    }
}

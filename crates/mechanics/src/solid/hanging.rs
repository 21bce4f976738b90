//! The hanging nodes and sides of a mesh with elements of different sizes side by side.

use std::collections::BTreeMap;

/// The hanging nodes and sides of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hanging {
    /// For each node that hangs the nodes that it follows, none of which hangs, and the part of each: its displacement is the sum of theirs times
    /// these parts.
    pub nodes: BTreeMap<u32, Vec<(u32, f64)>>,
    /// The sides that lie within a larger one.
    pub sides: Vec<HangingSide>,
}

/// A side of an element that lies within a larger side of another. A side is named by the element and by the node in its middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HangingSide {
    /// The smaller side.
    pub fine: (u32, u32),
    /// The larger one.
    pub coarse: (u32, u32),
}

/// Adds the part `weight` of a master to those of a node.
pub(super) fn add(masters: &mut Vec<(u32, f64)>, master: u32, weight: f64) {
    match masters.iter_mut().find(|own| own.0 == master) {
        Some(own) => own.1 += weight,
        None => masters.push((master, weight)),
    }
}

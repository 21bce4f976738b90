//! The displacement of a configuration between its nodes.

use super::dimension::Dimension;
use super::model::{Equations, State};
use super::shape_functions::shape;
use super::transfer::Finder;

/// Evaluates the displacements of a configuration.
pub struct Probe<'a, S: Dimension> {
    finder: Finder<'a, S>,
    state: &'a State<S>,
}

impl<'a, S: Dimension> Probe<'a, S> {
    /// A probe of a `state` of the body of these equations.
    pub fn new(equations: &'a Equations<S>, state: &'a State<S>) -> Self {
        Self { finder: Finder::new(&equations.body.mesh), state }
    }

    /// The displacement at the reference position `x`, both in m; `None` outside of the body.
    pub fn displacement(&self, x: S::Point) -> Option<S::Point> {
        let (e, at) = self.finder.find(x)?;
        let mut out = S::Point::default();
        for (&node, (value, _)) in self.finder.mesh.elements[e].as_ref().iter().zip(shape::<S>(at)) {
            for k in 0..S::AXES {
                out[k] += value * self.state.displacement[S::AXES * node as usize + k];
            }
        }
        Some(out)
    }

    /// The nodes from which the displacement at the reference position `x` (m) is interpolated, with their
    /// weights; `None` outside the body.
    pub fn weights(&self, x: S::Point) -> Option<Vec<(usize, f64)>> {
        let (e, at) = self.finder.find(x)?;
        let nodes = self.finder.mesh.elements[e].as_ref().iter().zip(shape::<S>(at));
        Some(nodes.map(|(&node, (value, _))| (node as usize, value)).collect())
    }
}

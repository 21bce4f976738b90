//! The displacements of a configuration at any points of the body, not only at its nodes.

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
        let (e, local) = self.finder.find(x)?;
        let mut displacement = S::Point::default();
        for (&node, (value, _)) in self.finder.mesh.elements[e].as_ref().iter().zip(shape::<S>(local)) {
            for k in 0..S::AXES {
                displacement[k] += value * self.state.displacement[S::AXES * node as usize + k];
            }
        }
        Some(displacement)
    }

    /// The nodes from which the displacement at the reference position `x` (m) is interpolated, with their
    /// weights; `None` outside the body.
    pub fn weights(&self, x: S::Point) -> Option<Vec<(usize, f64)>> {
        let (e, local) = self.finder.find(x)?;
        let nodes = self.finder.mesh.elements[e].as_ref().iter().zip(shape::<S>(local));
        Some(nodes.map(|(&node, (value, _))| (node as usize, value)).collect())
    }
}

//! A body of rubber: its mesh, materials, supports, obstacles, loads and configurations.
//!
//! Displacements and nodal forces are lists of `AXES` numbers for each node of the mesh, with the number
//! `AXES` of axes of the [`Dimension`]: entry `AXES n + k` belongs to node `n` and axis `k`. In the plane,
//! forces are per metre of width.

use elastocap_linalg::memory::bytes_in_words;
use elastocap_materials::Rubber;

use crate::solid::dimension::{Dimension, Plane};
use crate::solid::mesh::Mesh;
use crate::solid::obstacle::{Obstacle, SIDE_POINTS};
use crate::solid::side::Side;

/// Why a model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// An element of the mesh is turned inside out.
    #[error(
        "element {element} of the mesh is turned inside out or has no area; check the patches it came from"
    )]
    InvertedElement {
        /// The number of the element.
        element: usize,
    },
    /// The lists of a body do not fit its mesh.
    #[error("{what} of the body does not fit its mesh of {nodes} nodes and {elements} elements")]
    Mismatch {
        /// The name of the list.
        what: &'static str,
        /// The number of nodes of the mesh.
        nodes: usize,
        /// The number of elements of the mesh.
        elements: usize,
    },
    /// The matrix has no usable pattern.
    #[error("the body has no free displacement, or too many for this machine")]
    NoUnknowns,
    /// A patch that is held or bonded does not lie on the middle of the layer, as it has to.
    #[error(
        "a patch that is held or bonded lies on the middle of the layer; press a punch in contact, or move it to the middle"
    )]
    PatchOffTheMiddle,
    /// Between the edge of a patch or an indenter and the end of the layer there is no room for elements.
    #[error(
        "between the edge of the indenter and the end of the layer there is no room for elements: make the layer longer, or the indenter narrower"
    )]
    NoRoom,
    /// The mesh would have too many elements.
    #[error(
        "the finite elements would be {elements} or more, and at most {limit} are made: the layer is too long for its thickness, \
         or a corner or a contact too small"
    )]
    TooManyElements {
        /// Approximate number of elements of the mesh.
        elements: usize,
        /// The largest number of elements of a mesh.
        limit: usize,
    },
    /// A solve would take more memory than is available; nothing was factorised.
    #[error(
        "a mesh of {elements} elements needs about {} of memory, and {} may be taken",
        bytes_in_words(*bytes),
        bytes_in_words(*limit)
    )]
    TooLarge {
        /// The number of elements of the mesh.
        elements: usize,
        /// Approximate number of bytes that it would take.
        bytes: u64,
        /// The limit in bytes.
        limit: u64,
    },
}

/// A body and the obstacles that it may touch. Lengths in m, forces in N, in the plane per metre of width.
#[derive(Debug, Clone, PartialEq)]
pub struct Body<S: Dimension = Plane> {
    /// The reference configuration.
    pub mesh: Mesh<S>,
    /// The materials.
    pub rubbers: Vec<Rubber>,
    /// For each element the number of its material.
    pub material: Vec<u16>,
    /// For each displacement (`axes node + axis`) whether it is prescribed.
    pub held: Vec<bool>,
    /// Rigid bodies, and the sides of elements that may touch them.
    pub obstacles: Vec<Obstacle<S>>,
}

/// The load on a body at one moment: prescribed displacements, forces and positions of obstacles.
#[derive(Debug, Clone, PartialEq)]
pub struct Load<S: Dimension = Plane> {
    /// Prescribed displacements in m, `axes node + axis`; read where the displacement is held.
    pub displacement: Vec<f64>,
    /// Dead nodal forces in N, in the plane in N/m, `axes node + axis`.
    pub force: Vec<f64>,
    /// The displacement of each obstacle, in m.
    pub shift: Vec<S::Point>,
}

/// A configuration of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct State<S: Dimension = Plane> {
    /// Displacements in m, `axes node + axis`.
    pub displacement: Vec<f64>,
    /// Pressure coefficients of each element in Pa, positive in tension.
    pub pressure: Vec<S::Pressure>,
    /// Contact force of each point that may touch an obstacle, along the obstacle's normal, in N, in the
    /// plane in N/m.
    pub contact: Vec<f64>,
    /// The displacement of each obstacle in this configuration, in m.
    pub shift: Vec<S::Point>,
    /// The configuration under the same load with larger gaps from which this one was reached. The next load
    /// is followed from there.
    pub moving: Option<Box<Self>>,
}

impl<S: Dimension> Body<S> {
    /// A body of one rubber with nothing held.
    pub fn new(mesh: Mesh<S>, rubber: Rubber) -> Self {
        let (material, held) = (vec![0; mesh.elements.len()], vec![false; S::AXES * mesh.nodes.len()]);
        Self { mesh, rubbers: vec![rubber], material, held, obstacles: Vec::new() }
    }

    /// Prescribes the displacement along `axis` of every node whose reference position satisfies `at`.
    pub fn hold(&mut self, axis: usize, at: impl Fn(S::Point) -> bool) {
        for (n, x) in self.mesh.nodes.iter().enumerate() {
            if at(*x) {
                self.held[S::AXES * n + axis] = true;
            }
        }
    }

    /// The load at rest: no displacement, no force, and obstacles in their initial positions.
    pub fn no_load(&self) -> Load<S> {
        let n = self.held.len();
        Load {
            displacement: vec![0.0; n],
            force: vec![0.0; n],
            shift: vec![S::Point::default(); self.obstacles.len()],
        }
    }

    /// The body at rest, with the obstacles in their initial positions. Before the first load, set
    /// [`State::shift`] so that they are clear of the body: a contact force needs a gap.
    pub fn at_rest(&self) -> State<S> {
        let point_count = |o: &Obstacle<S>| SIDE_POINTS.pow(S::AXES as u32 - 1) * o.sides.len();
        State {
            displacement: vec![0.0; self.held.len()],
            pressure: vec![S::Pressure::default(); self.mesh.elements.len()],
            contact: vec![0.0; self.obstacles.iter().map(point_count).sum()],
            shift: vec![S::Point::default(); self.obstacles.len()],
            moving: None,
        }
    }

    /// Adds to `force` the nodal forces of a dead traction (Pa, per reference area) on reference sides.
    /// `traction` takes the reference position and the outward reference normal.
    pub fn add_traction(
        &self,
        sides: &[Side<S>],
        traction: impl Fn(S::Point, S::Point) -> S::Point,
        force: &mut [f64],
    ) {
        for side in sides {
            for point in self.mesh.side_points(side, 6) {
                let t = traction(point.position, point.normal);
                for (n, value) in side.nodes.as_ref().iter().zip(&point.shape) {
                    for k in 0..S::AXES {
                        force[S::AXES * *n as usize + k] += point.weight * value * t[k];
                    }
                }
            }
        }
    }
}

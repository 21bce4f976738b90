//! A body, its supports, and the equations of its equilibrium.
//!
//! | module | contents |
//! |---|---|
//! | `body` | the body, its loads and its configurations |
//! | `unknowns` | the numbering of the unknown displacements |
//! | `expansion` | elements with hanging nodes |
//! | `pairs` | the points that may touch an obstacle |
//! | `given_force` | an indenter whose force is given |
//! | `assembly` | residual, tangent and step at a configuration |

mod assembly;
mod body;
mod expansion;
mod given_force;
mod pairs;
mod unknowns;

use elastocap_linalg::ldlt::{BlockPlaces, SymmetricSolver};
use elastocap_materials::Rubber;

pub(crate) use assembly::Residual;
pub use body::{Body, Load, ModelError, State};
use expansion::{Expanded, Expansion};
pub(crate) use given_force::GivenForce;
pub(crate) use pairs::{Linearisation, Pair};
use unknowns::Unknowns;

use super::dimension::{Dimension, Element, ElementSystem, Numbers, Plane};
use super::obstacle::Obstacle;

/// The equations of a body: assembled, solved, and assembled again.
#[derive(Debug)]
pub struct Equations<S: Dimension = Plane> {
    pub(crate) body: Body<S>,
    pub(crate) elements: Vec<S::Element>,
    pub(crate) unknowns: Unknowns,
    /// The systems of the elements from the last assembly, if they were not released.
    systems: Vec<ElementSystem<S>>,
    /// For each element with hanging nodes, the nodes that it is coupled to.
    expansions: Vec<Option<Expansion>>,
    /// The forces and matrices of elements with hanging nodes from the last assembly, in terms of the nodes
    /// that they are coupled to.
    expanded: Vec<Expanded>,
    /// For each element, then for each pair that may touch, the places of the entries of its matrix in that
    /// of the solver.
    pub(crate) places: Vec<BlockPlaces>,
    /// The points that may touch an obstacle.
    pub(crate) pairs: Vec<Pair<S>>,
    /// Product of gap and pressure in N/m; see the contact module.
    pub(crate) gap_times_pressure: f64,
    /// How contact is made linear in the next assembly.
    pub(crate) linearisation: Linearisation,
    /// The force of the indenter, where that is given instead of its place.
    pub(crate) given_force: Option<GivenForce>,
    pub(crate) solver: SymmetricSolver,
    /// Unbalanced force of each displacement, including prescribed ones.
    pub(crate) unbalanced: Vec<f64>,
    /// Internal force of each displacement.
    internal: Vec<f64>,
    /// Right-hand side of the linear system, for each unknown displacement.
    pub(crate) right: Vec<f64>,
    /// The least force that unbalanced forces are compared with, in N.
    force_floor: f64,
    /// For each element the approximate force per unit displacement of one of its nodes, and its size in m.
    sensitivity: Vec<(f64, f64)>,
    /// The shortest side of the box around the body in m.
    pub(crate) shortest_side: f64,
    /// [`Equations::modulus`] times [`Equations::shortest_side`], in N/m: the product of gap and pressure for
    /// a gap of 1 in the settings of Newton's method.
    pub(crate) modulus_times_size: f64,
    /// Shear modulus in Pa of the rubber with the largest volume: the one that touches, folds and wrinkles,
    /// however stiff the inclusions are.
    pub(crate) modulus: f64,
    /// [`Equations::modulus`] as the stiffness of a spring at a node: in the plane in Pa, in space times the
    /// shortest side of the body.
    spring: f64,
    /// The drag in Pa, and the displacements in m that it pulls back to; see
    /// [`folds`](super::folds).
    pub(crate) drag: (f64, Vec<f64>),
}

impl<S: Dimension> Equations<S> {
    /// The equations of `body`. This does the symbolic factorisation and allocates all memory but that of the
    /// factors.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn new(body: Body<S>) -> Result<Self, ModelError> {
        body.check_lists()?;
        let elements = body.reference_elements()?;
        let unknowns = Unknowns::new(&body);
        body.check_sides()?;
        if unknowns.count() == 0 {
            return Err(ModelError::NoUnknowns);
        }
        let pairs = Pair::all(&body);
        let hanging = &body.mesh.hanging;
        let expansions: Vec<Option<Expansion>> =
            body.mesh.elements.iter().map(|e| Expansion::new(e.as_ref(), hanging)).collect();
        let number = |d: usize| unknowns.number(d);
        let coupled = body.mesh.elements.iter().zip(&expansions);
        let coupled = coupled
            .map(|(element, expansion)| expansion.as_ref().map_or(element.as_ref(), |more| &more.nodes));
        let groups: Vec<Vec<Option<u32>>> = coupled
            .map(|nodes| nodes.iter().flat_map(|&n| Self::places_of_node(n as usize)).map(number).collect())
            .chain(pairs.iter().map(|p| p.displacements().map(number).collect()))
            .collect();
        let (solver, places) =
            SymmetricSolver::new(unknowns.count(), &groups).map_err(|_| ModelError::NoUnknowns)?;
        let modulus = body.prevailing_modulus(&elements);
        let size = body.mesh.nodes.iter().flat_map(Numbers::as_slice).fold(0.0, |m: f64, x| m.max(x.abs()));
        let shortest = body.mesh.shortest_side();
        // In the plane a force is one per metre of width.
        let per_axis = shortest.powi(S::AXES as i32 - 2);
        let displacements = unknowns.displacements();
        Ok(Self {
            unbalanced: vec![0.0; displacements],
            internal: vec![0.0; displacements],
            right: vec![0.0; unknowns.count()],
            systems: Vec::new(),
            expansions,
            expanded: Vec::new(),
            gap_times_pressure: 0.0,
            linearisation: Linearisation::Interior,
            given_force: None,
            force_floor: 1e-9 * modulus * size * per_axis,
            sensitivity: body.sensitivity(&elements),
            modulus,
            shortest_side: shortest,
            modulus_times_size: modulus * shortest,
            spring: modulus * per_axis,
            drag: (0.0, vec![0.0; displacements]),
            body,
            elements,
            unknowns,
            places,
            pairs,
            solver,
        })
    }

    /// The body.
    pub fn body(&self) -> &Body<S> {
        &self.body
    }

    /// The number of unknown displacements.
    pub fn unknowns(&self) -> usize {
        self.right.len()
    }

    /// The number of unknown displacements and pressures.
    pub fn mixed_unknowns(&self) -> usize {
        let has_pressure = |m: &u16| self.body.rubbers[*m as usize].pressure_compliance().is_some();
        self.right.len() + S::Pressure::COUNT * self.body.material.iter().filter(|m| has_pressure(m)).count()
    }

    /// The number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.solver.factor_entries()
    }

    /// Estimate of the bytes of a mesh of `elements` before a factorisation: the matrices of the elements,
    /// and the places of their entries.
    pub fn element_bytes(elements: usize) -> u64 {
        let n = S::AXES * S::Element::NODES;
        (elements * n * (12 * n + 8 * S::Pressure::COUNT + 8 * S::Element::POINTS)) as u64
    }

    /// Estimate of the bytes that a solve takes.
    pub fn memory_bytes(&self) -> u64 {
        Self::element_bytes(self.elements.len()) + self.solver.memory_bytes()
    }

    /// Releases the memory of the factors and of the matrices of the elements until the next assembly.
    pub(crate) fn release(&mut self) {
        self.solver.release();
        self.systems = Vec::new();
        self.expanded = Vec::new();
    }

    /// The displacements of the nodes of element `e`, from those of all nodes.
    pub(crate) fn gather(&self, e: usize, u: &[f64]) -> Vec<f64> {
        self.places_of(e).map(|d| u[d]).collect()
    }

    /// The indices of the displacements of node `n`.
    fn places_of_node(n: usize) -> std::ops::Range<usize> {
        S::AXES * n..S::AXES * (n + 1)
    }

    /// The indices of the displacements of element `e`.
    fn places_of(&self, e: usize) -> impl Iterator<Item = usize> {
        self.body.mesh.elements[e].as_ref().iter().flat_map(|&n| Self::places_of_node(n as usize))
    }

    /// The nodes that element `e` is coupled to: its nodes, with hanging nodes replaced by those that they
    /// follow.
    fn coupled_nodes(&self, e: usize) -> &[u32] {
        self.expansions[e].as_ref().map_or(self.body.mesh.elements[e].as_ref(), |more| &more.nodes)
    }

    /// The indices of the displacements of the nodes that element `e` is coupled to.
    fn coupled_places(&self, e: usize) -> impl Iterator<Item = usize> {
        self.coupled_nodes(e).iter().flat_map(|&n| Self::places_of_node(n as usize))
    }

    /// Gives hanging nodes the displacements that follow from the nodes that do not hang.
    pub(crate) fn let_follow(&self, displacement: &mut [f64]) {
        for (&node, masters) in &self.body.mesh.hanging.nodes {
            for k in 0..S::AXES {
                let part = |&(m, part): &(u32, f64)| part * displacement[S::AXES * m as usize + k];
                displacement[S::AXES * node as usize + k] = masters.iter().map(part).sum();
            }
        }
    }

    /// The rubber of element `e`.
    pub(crate) fn rubber(&self, e: usize) -> &Rubber {
        &self.body.rubbers[self.body.material[e] as usize]
    }
}

impl<S: Dimension> Body<S> {
    /// The error of a list that does not fit the mesh; `what` is its name.
    fn mismatch(&self, what: &'static str) -> ModelError {
        ModelError::Mismatch { what, nodes: self.mesh.nodes.len(), elements: self.mesh.elements.len() }
    }

    /// Checks that the lists of displacements and materials fit the mesh.
    fn check_lists(&self) -> Result<(), ModelError> {
        if self.held.len() != S::AXES * self.mesh.nodes.len() {
            return Err(self.mismatch("the list of held displacements"));
        }
        let known = |m: &u16| (*m as usize) < self.rubbers.len();
        if self.material.len() != self.mesh.elements.len() || !self.material.iter().all(known) {
            return Err(self.mismatch("the list of materials"));
        }
        Ok(())
    }

    /// Checks that the nodes of the sides that may touch an obstacle are nodes of the mesh.
    fn check_sides(&self) -> Result<(), ModelError> {
        let known = |n: &u32| (*n as usize) < self.mesh.nodes.len();
        let fits =
            |o: &Obstacle<S>| o.sides.iter().flat_map(|s| s.nodes.as_ref()).chain(&o.carrier).all(known);
        if self.obstacles.iter().all(fits) { Ok(()) } else { Err(self.mismatch("a list of touching sides")) }
    }

    /// The elements in the reference configuration.
    fn reference_elements(&self) -> Result<Vec<S::Element>, ModelError> {
        let element = |(element, e): (usize, &S::Nodes)| {
            let x: Vec<S::Point> = e.as_ref().iter().map(|&n| self.mesh.nodes[n as usize]).collect();
            S::Element::new(&x).ok_or(ModelError::InvertedElement { element })
        };
        self.mesh.elements.iter().enumerate().map(element).collect()
    }

    /// Shear modulus in Pa of the rubber with the largest volume.
    fn prevailing_modulus(&self, elements: &[S::Element]) -> f64 {
        let mut volumes = vec![0.0; self.rubbers.len()];
        for (element, &m) in elements.iter().zip(&self.material) {
            volumes[m as usize] += element.volume();
        }
        let largest = (0..volumes.len()).max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]));
        largest.map_or(0.0, |m| self.rubbers[m].shear_modulus())
    }

    /// For each element the approximate force per unit displacement of one of its nodes, and its size in m.
    fn sensitivity(&self, elements: &[S::Element]) -> Vec<(f64, f64)> {
        let of_element = |(element, &m): (&S::Element, &u16)| {
            let product = |a: usize| element.gradient_product(a, a);
            let largest = (0..S::Element::NODES).map(product).fold(0.0, f64::max);
            (self.rubbers[m as usize].shear_modulus() * largest, element.volume().powf(1.0 / S::AXES as f64))
        };
        elements.iter().zip(&self.material).map(of_element).collect()
    }
}

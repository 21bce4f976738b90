//! The interface that the plane and space have in common: the solver is written once, generic over a
//! [`Dimension`].
//!
//! Code that has a type parameter `S: Dimension` works in plane strain with `S = Plane` and in three
//! dimensions with `S = Space`:
//!
//! | | [`Plane`] | [`Space`] |
//! |---|---|---|
//! | `S::AXES`, displacements per node | 2 | 3 |
//! | `S::Point`, a position or vector | `[f64; 2]` in m | `[f64; 3]` in m |
//! | `S::Nodes`, nodes of an element | 9, a quadrilateral | 27, a hexahedron |
//! | `S::SideNodes`, nodes of its sides | 3 | 9 |
//! | `S::Pressure`, pressure coefficients of an element | 3 | 4 |
//! | forces | N per metre of width | N |
//!
//! Lists of displacements and forces hold `S::AXES` numbers for each node: entry `S::AXES n + k` belongs to
//! node `n` and axis `k`.

use std::fmt::Debug;
use std::ops::IndexMut;

use elastocap_materials::Rubber;

/// Plane strain: two axes, forces per metre of width.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Plane;

/// Three dimensions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Space;

/// An array `[f64; N]` whose length depends on the dimension.
pub trait Numbers: Copy + Debug + Default + PartialEq + Send + Sync + IndexMut<usize, Output = f64> {
    /// Length of the array.
    const COUNT: usize;
    /// The array with `number(k)` at place `k`.
    fn from_fn(number: impl FnMut(usize) -> f64) -> Self;
    /// All numbers.
    fn as_slice(&self) -> &[f64];
    /// The scalar product with `other`.
    fn dot(&self, other: &Self) -> f64 {
        self.as_slice().iter().zip(other.as_slice()).map(|(a, b)| a * b).sum()
    }
}

macro_rules! numbers {
    ($($count:literal)*) => {
        $(impl Numbers for [f64; $count] {
            const COUNT: usize = $count;
            fn from_fn(number: impl FnMut(usize) -> f64) -> Self {
                std::array::from_fn(number)
            }
            fn as_slice(&self) -> &[f64] {
                self
            }
        })*
    };
}
numbers!(2 3 4);

/// An array `[u32; N]` of node numbers whose length depends on the dimension.
pub trait Numbering: AsRef<[u32]> + Copy + Debug + Eq + Send + Sync {
    /// The array with `node(k)` at place `k`.
    fn from_fn(node: impl FnMut(usize) -> u32) -> Self;
}

impl<const N: usize> Numbering for [u32; N] {
    fn from_fn(node: impl FnMut(usize) -> u32) -> Self {
        std::array::from_fn(node)
    }
}

/// The plane or space, with its element: sizes of arrays and the few functions that differ. The two are
/// written down beside their elements, in [`super::element`] and [`super::space::element`].
pub trait Dimension: Copy + Debug + Default + PartialEq + Send + Sync + 'static {
    /// The number of displacements of a node.
    const AXES: usize;
    /// A position or a vector.
    type Point: Numbers;
    /// The pressure's coefficients in one element.
    type Pressure: Numbers;
    /// The nodes of an element.
    type Nodes: Numbering;
    /// The nodes of an element's side.
    type SideNodes: Numbering;
    /// The element.
    type Element: Element<Self>;
    /// For each side of an element its nodes; see [`super::side::Side`].
    const SIDES: &'static [&'static [usize]];
    /// The corners among the nodes of a side.
    const SIDE_CORNERS: &'static [usize];
    /// The outward normal of a side, from the slopes along its first and second direction: as long as the
    /// side's size over that of the reference side. In the plane there is no second direction.
    fn normal(first: Self::Point, second: Self::Point) -> Self::Point;
    /// A point in space; in the plane, its third coordinate is zero.
    fn in_space(point: &Self::Point) -> [f64; 3];
    /// The nodes of a mesh in an order that keeps factors sparse; see [`elastocap_linalg::ordering`].
    fn order(nodes: &[Self::Point], elements: &[Self::Nodes]) -> Vec<u32>;
}

/// Components of a stress: 11, 22, 33, 12, 23, 13.
pub(crate) type Stress = [f64; 6];

/// An element with continuous displacements and a discontinuous pressure, condensed out.
///
/// Displacement `axes a + k` of an element is that of its node `a` along axis `k`, in m. In the plane, forces
/// and stiffnesses are per metre of width.
pub trait Element<S: Dimension>: Sized + Clone + Debug + Send + Sync {
    /// The number of nodes.
    const NODES: usize;
    /// The number of quadrature points.
    const POINTS: usize;
    /// Whether the element can be assembled with `J <= 0` if the energy of the rubber [is defined
    /// there](Rubber::knows_inside_out).
    const ANY_VOLUME_RATIO: bool;

    /// The element with nodes at `x` (m). Returns `None` if it is turned inside out at a quadrature point.
    fn new(x: &[S::Point]) -> Option<Self>;

    /// Reference volume in m^3; area in m^2 in the plane.
    fn volume(&self) -> f64;

    /// The origin and the units of the coordinates of the pressure, in m: the pressure is
    /// `p0 + p1 (x1 - origin)/unit + ...`.
    fn pressure_frame(&self) -> (S::Point, S::Point);

    /// `J` at quadrature point `q` under the displacements `u`.
    fn volume_ratio(&self, q: usize, u: &[f64]) -> f64;

    /// Cauchy stress in Pa at quadrature point `q` under the displacements `u` and the pressure coefficients
    /// `p`: 11, 22, 33, 12, 23, 13.
    fn stress(&self, rubber: &Rubber, q: usize, u: &[f64], p: &S::Pressure) -> Stress;

    /// Reference volume in m^3 that belongs to quadrature point `q`; area in m^2 in the plane.
    fn point_volume(&self, q: usize) -> f64;

    /// The remaining share of the extension limit of `rubber` at quadrature point `q` under the displacements
    /// `u`; `None` if it has no limit. See [`Rubber::extension_left`].
    fn extension_left(&self, rubber: &Rubber, q: usize, u: &[f64]) -> Option<f64>;

    /// Inverse of the pressure's mass matrix, row by row, in 1/m^3 (in the plane 1/m^2).
    fn mass_inverse(&self) -> &[S::Pressure];

    /// Fills `out` with the internal forces, the coupling, the volume error, the smallest `J` and the upper
    /// triangle of the tangent at constant pressure, under the displacements `u` and the pressure
    /// coefficients `p` (Pa, positive in tension).
    fn integrate(&self, rubber: &Rubber, u: &[f64], p: &S::Pressure, out: &mut ElementSystem<S>);

    /// Internal forces and tangent with the pressure eliminated, with the proximal modulus `kappa_0` (Pa);
    /// see [`super::element`].
    fn assemble(
        &self,
        rubber: &Rubber,
        u: &[f64],
        p: &S::Pressure,
        kappa_0: f64,
        out: &mut ElementSystem<S>,
    ) {
        self.integrate(rubber, u, p, out);
        out.condensed_force.clone_from(&out.force);
        if let Some(modulus) = proximal_modulus(rubber, kappa_0) {
            out.condense(modulus, self.mass_inverse());
        }
        let n = out.force.len();
        for r in 0..n {
            for c in 0..r {
                out.stiffness[r * n + c] = out.stiffness[c * n + r];
            }
        }
    }

    /// The pressure's increment that belongs to the displacement increment `du`, from the last assembly.
    fn pressure_increment(
        &self,
        rubber: &Rubber,
        du: &[f64],
        kappa_0: f64,
        system: &ElementSystem<S>,
    ) -> S::Pressure {
        let Some(modulus) = proximal_modulus(rubber, kappa_0) else { return S::Pressure::default() };
        let mut right = system.volume_error;
        for (coupling, du) in system.coupling.iter().zip(du) {
            for m in 0..S::Pressure::COUNT {
                right[m] += coupling[m] * du;
            }
        }
        S::Pressure::from_fn(|m| modulus * self.mass_inverse()[m].dot(&right))
    }

    /// Integral of the product of the reference gradients of shape functions `a` and `b`, in m; in the plane
    /// without unit.
    fn gradient_product(&self, a: usize, b: usize) -> f64;

    /// Adds a drag: the forces and the tangent of the energy `drag/2 |grad(u - anchor)|^2` with `drag` in Pa.
    fn add_drag(&self, drag: f64, u: &[f64], anchor: &[f64], out: &mut ElementSystem<S>) {
        let n = out.force.len();
        for a in 0..Self::NODES {
            for b in 0..Self::NODES {
                let stiffness = drag * self.gradient_product(a, b);
                for k in 0..S::AXES {
                    let (r, c) = (S::AXES * a + k, S::AXES * b + k);
                    let force = stiffness * (u[c] - anchor[c]);
                    out.stiffness[r * n + c] += stiffness;
                    out.force[r] += force;
                    out.condensed_force[r] += force;
                }
            }
        }
    }

    /// The smallest `J` over the quadrature points under `u`, and the smallest ratio of `J` under `u` to `J`
    /// under `before`.
    fn smallest_j(&self, u: &[f64], before: &[f64]) -> (f64, f64) {
        (0..Self::POINTS).fold((f64::INFINITY, f64::INFINITY), |(least, ratio), q| {
            let (now, then) = (self.volume_ratio(q, u), self.volume_ratio(q, before));
            if now.is_nan() {
                (f64::NEG_INFINITY, f64::NEG_INFINITY)
            } else {
                (least.min(now), ratio.min(now / then))
            }
        })
    }
}

/// The contributions of an element to the residual and to the tangent, in the plane per metre of width.
#[derive(Debug, Clone)]
pub struct ElementSystem<S: Dimension = Plane> {
    /// Internal forces of the displacements in N.
    pub force: Vec<f64>,
    /// Internal forces after the pressure is eliminated: the right-hand side with its sign changed.
    pub condensed_force: Vec<f64>,
    /// Tangent after the pressure is eliminated, row after row and symmetric, in N/m.
    pub stiffness: Vec<f64>,
    /// `G`: derivative of the internal forces by the pressure's coefficients, in m^2.
    pub coupling: Vec<S::Pressure>,
    /// The residual `r_p` of the volume in m^3, see [`super::element`]. Its first entry over the volume of
    /// the element is the mean volume error.
    pub volume_error: S::Pressure,
    /// Smallest `J` of the quadrature points.
    pub smallest_j: f64,
}

impl<S: Dimension> ElementSystem<S> {
    /// The system of an element with this number of `displacements`, all entries zero.
    pub fn new(displacements: usize) -> Self {
        Self {
            force: vec![0.0; displacements],
            condensed_force: vec![0.0; displacements],
            stiffness: vec![0.0; displacements * displacements],
            coupling: vec![S::Pressure::default(); displacements],
            volume_error: S::Pressure::default(),
            smallest_j: 1.0,
        }
    }

    /// Sets all entries to zero.
    pub(crate) fn clear(&mut self) {
        self.force.fill(0.0);
        self.coupling.fill(S::Pressure::default());
        self.stiffness.fill(0.0);
        self.volume_error = S::Pressure::default();
        self.smallest_j = f64::INFINITY;
    }

    /// Eliminates the pressure: adds `modulus G M^-1 G'` to the upper triangle of the tangent.
    fn condense(&mut self, modulus: f64, mass_inverse: &[S::Pressure]) {
        let n = self.force.len();
        for r in 0..n {
            let scaled = S::Pressure::from_fn(|m| modulus * self.coupling[r].dot(&mass_inverse[m]));
            self.condensed_force[r] += scaled.dot(&self.volume_error);
            for (value, coupling) in
                self.stiffness[r * n + r..(r + 1) * n].iter_mut().zip(&self.coupling[r..])
            {
                *value += scaled.dot(coupling);
            }
        }
    }
}

/// The modulus `1 / (1/kappa + 1/kappa_0)` by which the pressure is eliminated, or `None` if the rubber has
/// no pressure field.
fn proximal_modulus(rubber: &Rubber, kappa_0: f64) -> Option<f64> {
    rubber.pressure_compliance().map(|compliance| 1.0 / (compliance + 1.0 / kappa_0))
}

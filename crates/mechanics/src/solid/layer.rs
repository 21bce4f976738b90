//! The layer of section 3.2 of the paper: half of it, bonded to the substrate, its end free.
//!
//! Reference coordinates: the axis of symmetry at `x1 = 0`, the substrate at `x2 = 0`, the top at `x2 = H`.

use super::material::Rubber;
use super::mesh::{Mesh, Patch, geometric, uniform};
use super::model::{Body, Equations, Load, ModelError, State};
use super::newton::{Effort, NewtonSettings, Stopped};
use super::obstacle::Shape;
use super::stress::Fields;

/// What becomes of the layer's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No traction all the way: the face may fold below the plane of the substrate, as in the paper's model.
    Free,
    /// The substrate goes on, and carries what folds over; smooth, unilateral contact.
    FreeOnSubstrate,
    /// The layer goes on: no motion along `x1` there, no traction along it.
    Far,
}

/// A rectangle of another rubber in the layer, bonded to it. Where two overlap, the later one counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Inclusion {
    /// Its lower left corner at rest in m.
    pub min: [f64; 2],
    /// Its upper right corner at rest in m.
    pub max: [f64; 2],
    /// What it is made of.
    pub rubber: Rubber,
}

/// What presses on the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A smooth plate over the whole top: `u2 = -U` there.
    WholeTop,
    /// A smooth punch or cylinder that starts in touch with the top; the layer may leave it and touch its flank.
    Smooth(Shape),
    /// A sharp flat punch: the points under it at the start, `x1 <= half_width` (m), are the ones pressed; smooth.
    Sharp {
        /// Half the width of the punch in m.
        half_width: f64,
    },
    /// A sharp flat punch that the layer sticks to.
    Bonded {
        /// Half the width of the punch in m.
        half_width: f64,
    },
}

/// How fine the mesh is.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerMesh {
    /// Breakpoints along `x1` from the axis to one thickness before the end, in m.
    pub along: Vec<f64>,
    /// Breakpoints from the substrate to the top, in m.
    pub up: Vec<f64>,
    /// Breakpoints along the top over the last thickness, in m, from `half_length - thickness` to `half_length`.
    pub end_top: Vec<f64>,
    /// Fractions of the way from the bonded corner of the end, from 0 to 1. Empty for a mesh without a fan there: a
    /// tensor product, which turns inside out at that corner.
    pub radii: Vec<f64>,
    /// A fan around the point of the top where a sharp punch ends, if there is one.
    pub punch: Option<PunchFan>,
}

/// Sectors around the point where a sharp punch ends: the surface beside it turns up by 90 degrees and more, which two
/// quadrilaterals that meet there cannot follow.
#[derive(Debug, Clone, PartialEq)]
pub struct PunchFan {
    /// First and last of the breakpoints along `x1` that the fan takes the place of; its centre is between them.
    pub along: [usize; 2],
    /// First of the breakpoints upwards that it takes the place of.
    pub up: usize,
    /// `x1` of its centre in m.
    pub corner: f64,
    /// Fractions of the way from the centre, from 0 to 1.
    pub radii: Vec<f64>,
}

impl LayerMesh {
    /// A mesh with `n` equal quadrilaterals over the thickness and as many over each thickness of length; the fan at
    /// the bonded end has `rings` rings that shrink by `ratio`.
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

    /// A tensor product for an end that folds: equal quadrilaterals of `thickness / cells` within `block` thicknesses of
    /// the bonded corner, from there growing by half each to `thickness / n`.
    pub fn folding_end(thickness: f64, half_length: f64, n: usize, cells: usize, block: f64) -> Self {
        let (fine, coarse) = (thickness / cells.max(n) as f64, thickness / n as f64);
        let graded = |length: f64| {
            let count = (block * thickness / fine).round().max(1.0);
            let mut x = uniform(0.0, count * fine, count as usize);
            let (mut at, mut size) = (count * fine, 1.5 * fine);
            while size < coarse {
                at += size;
                x.push(at);
                size *= 1.5;
            }
            let rest = ((length - at) / coarse).round().max(1.0) as usize;
            x.extend(uniform(at, length, rest).iter().skip(1));
            x
        };
        let from_axis: Vec<f64> = graded(half_length).iter().rev().map(|x| half_length - x).collect();
        // Any breakpoint will do between what `mesh` puts together again.
        let cut = from_axis.partition_point(|x| *x <= half_length - thickness).max(1);
        Self {
            along: from_axis[..cut].to_vec(),
            up: graded(thickness),
            end_top: from_axis[cut - 1..].to_vec(),
            radii: Vec::new(),
            punch: None,
        }
    }

    /// A mesh with about `n` quadrilaterals over the thickness for a sharp punch that ends at `corner` (m), with a
    /// fan there of half the thickness; its `rings` shrink by `ratio`. The fan at the bonded end has two rings.
    pub fn under_punch(
        thickness: f64,
        half_length: f64,
        corner: f64,
        n: usize,
        ratio: f64,
        rings: usize,
    ) -> Self {
        let (body, half) = (half_length - thickness, 0.5 * thickness);
        let (left, right, low) = (corner - half, corner + half, thickness - half);
        let count = |length: f64| ((length / thickness) * n as f64).round().max(1.0) as usize;
        let mut along = uniform(0.0, left, count(left));
        let first = along.len() - 1;
        along.extend(uniform(left, right, count(thickness)).iter().skip(1));
        let last = along.len() - 1;
        along.extend(uniform(right, body, count(0.6 * (body - right))).iter().skip(1));
        let mut up = uniform(0.0, low, count(low));
        let floor = up.len() - 1;
        up.extend(uniform(low, thickness, count(half)).iter().skip(1));
        let punch =
            Some(PunchFan { along: [first, last], up: floor, corner, radii: geometric(ratio, rings) });
        let end_top = uniform(body, half_length, count(0.6 * thickness));
        Self { along, up, end_top, radii: geometric(0.5, 1), punch }
    }

    /// The mesh.
    pub fn mesh(&self) -> Mesh {
        let (body, top) = (self.along[self.along.len() - 1], self.up[self.up.len() - 1]);
        if self.radii.is_empty() {
            let along: Vec<f64> = self.along.iter().chain(self.end_top.iter().skip(1)).copied().collect();
            return Mesh::from_patches(&[Patch::tensor(&along, &self.up)]);
        }
        let corner = [self.end_top[self.end_top.len() - 1], 0.0];
        let mut rim: Vec<[f64; 2]> = self.up.iter().map(|&y| [body, y]).collect();
        rim.extend(self.end_top.iter().skip(1).map(|&x| [x, top]));
        let mut patches = vec![Patch::fan(corner, &rim, &self.radii)];
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
}

/// A layer under an indenter, ready to be pressed.
#[derive(Debug)]
pub struct LayerModel {
    equations: Equations,
    indenter: Indenter,
    thickness: f64,
    state: State,
    load: Load,
    /// Number of the indenter among the obstacles.
    punch: Option<usize>,
    substrate: Option<usize>,
}

/// One step of a pressed layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerStep {
    /// Displacement of the indenter over the thickness.
    pub compression: f64,
    /// Force of the indenter on the *whole* layer (both halves) in N per metre of width, positive in compression.
    pub force: f64,
    /// Force that the substrate carries by contact beyond the bonded bottom, both halves, in N per metre of width.
    pub end_contact_force: f64,
    /// Sum of all vertical forces on the half layer over the largest of them.
    pub imbalance: f64,
    /// Deepest penetration of a node in m, at least 0.
    pub penetration: f64,
    /// What it took.
    pub effort: Effort,
}

impl LayerModel {
    /// The layer at rest.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn new(mesh: &LayerMesh, rubber: Rubber, indenter: Indenter, end: End) -> Result<Self, ModelError> {
        Self::with_inclusions(mesh, &rubber, &[], indenter, end)
    }

    /// The layer at rest with bodies of other rubbers in it; the mesh must have their edges among its breakpoints, or
    /// they are as large as the elements whose centres they hold.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub fn with_inclusions(
        mesh: &LayerMesh,
        rubber: &Rubber,
        inclusions: &[Inclusion],
        indenter: Indenter,
        end: End,
    ) -> Result<Self, ModelError> {
        let top = mesh.up[mesh.up.len() - 1];
        let length = mesh.end_top[mesh.end_top.len() - 1];
        let mut body = Body::new(mesh.mesh(), rubber.clone());
        for (k, inclusion) in inclusions.iter().enumerate() {
            body.rubbers.push(inclusion.rubber.clone());
            for (e, element) in body.mesh.elements.iter().enumerate() {
                let centre = body.mesh.nodes[element[4] as usize];
                if (0..2).all(|a| inclusion.min[a] < centre[a] && centre[a] < inclusion.max[a]) {
                    body.material[e] = k as u16 + 1;
                }
            }
        }
        let tiny = 1e-9 * length;
        body.hold(0, |x| x[0] == 0.0);
        body.hold(0, |x| x[1] == 0.0);
        body.hold(1, |x| x[1] == 0.0);
        if end == End::Far {
            body.hold(0, |x| x[0] > length - tiny);
        }
        let list = |on: &dyn Fn([f64; 2]) -> bool| -> Vec<u32> {
            (0u32..).zip(&body.mesh.nodes).filter(|(_, x)| on(**x)).map(|(n, _)| n).collect()
        };
        let mut obstacles = Vec::new();
        let (mut punch, mut substrate) = (None, None);
        let mut hold = None;
        match indenter {
            Indenter::WholeTop => hold = Some((f64::INFINITY, false)),
            Indenter::Sharp { half_width } => hold = Some((half_width + tiny, false)),
            Indenter::Bonded { half_width } => hold = Some((half_width + tiny, true)),
            Indenter::Smooth(shape) => {
                punch = Some(obstacles.len());
                obstacles.push((shape, list(&|x| x[1] > top - tiny)));
            }
        }
        if end == End::FreeOnSubstrate {
            substrate = Some(obstacles.len());
            obstacles.push((Shape::Below, list(&|x| x[0] > length - tiny && x[1] > 0.0)));
        }
        body.obstacles = obstacles;
        if let Some((limit, bonded)) = hold {
            body.hold(1, |x| x[1] > top - tiny && x[0] <= limit);
            if bonded {
                body.hold(0, |x| x[1] > top - tiny && x[0] <= limit);
            }
        }
        let mut load = body.no_load();
        if let Some(punch) = punch {
            load.shift[punch] = [0.0, top];
        }
        let state = body.at_rest();
        Ok(Self { equations: Equations::new(body)?, indenter, thickness: top, state, load, punch, substrate })
    }

    /// The equations behind the model.
    pub fn equations(&self) -> &Equations {
        &self.equations
    }

    /// The last equilibrium.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The load of the last equilibrium.
    pub fn load(&self) -> &Load {
        &self.load
    }

    /// Pressure of indenter and substrate on each node in Pa, `-n.sigma.n` with the smoothed stress in `fields`; zero where
    /// nothing touches. `load` is the one that `state` is in equilibrium with.
    pub fn contact_pressure(&self, state: &State, load: &Load, fields: &Fields<'_>) -> Vec<f64> {
        let body = self.equations.body();
        let mut pressure = vec![0.0; body.mesh.nodes.len()];
        let tiny = 1e-9 * self.thickness;
        for (n, x) in body.mesh.nodes.iter().enumerate() {
            if x[1] > self.thickness - tiny && body.held[2 * n + 1] {
                pressure[n] = -fields.at_node(n).stress.s22;
            }
        }
        self.equations.for_each_contact(state, load, |n, normal| {
            let s = fields.at_node(n).stress;
            let [a, b] = normal;
            pressure[n] = -(a * a * s.s11 + 2.0 * a * b * s.s12 + b * b * s.s22);
        });
        pressure
    }

    /// Displacement (m) of the node nearest to the reference position `x` (m).
    pub fn displacement_near(&self, x: [f64; 2]) -> [f64; 2] {
        let n = self.equations.body().mesh.nearest_node(x);
        [self.state.displacement[2 * n], self.state.displacement[2 * n + 1]]
    }

    /// Moves the indenter to `compression`, its displacement over the thickness.
    ///
    /// # Errors
    /// [`Stopped`]; the model is then in the last equilibrium on the way.
    pub fn press(&mut self, compression: f64, settings: &NewtonSettings) -> Result<LayerStep, Box<Stopped>> {
        let depth = compression * self.thickness;
        let mut next = self.load.clone();
        if let Some(punch) = self.punch {
            next.shift[punch] = [0.0, self.thickness - depth];
        } else {
            let tiny = 1e-9 * self.thickness;
            for (n, x) in self.equations.body().mesh.nodes.iter().enumerate() {
                if x[1] > self.thickness - tiny {
                    next.displacement[2 * n + 1] = -depth;
                }
            }
        }
        let effort = self.equations.advance(&mut self.state, &mut self.load, &next, settings)?;
        Ok(self.step(effort))
    }

    /// Forces and contact in the last equilibrium.
    pub fn step(&self, effort: Effort) -> LayerStep {
        let tiny = 1e-9 * self.thickness;
        let top = self.thickness;
        let contact = |o: Option<usize>| {
            o.map_or([0.0; 2], |o| self.equations.contact_force(o, &self.state, &self.load))
        };
        let half = match self.indenter {
            Indenter::Smooth(_) => -contact(self.punch)[1],
            _ => -self.equations.reaction(1, |x| x[1] > top - tiny),
        };
        let end = contact(self.substrate)[1];
        let bottom = self.equations.reaction(1, |x| x[1] == 0.0);
        let shift = match self.punch {
            Some(punch) => top - self.load.shift[punch][1],
            None => {
                let n = self.equations.body().mesh.nearest_node([0.0, top]);
                -self.load.displacement[2 * n + 1]
            }
        };
        LayerStep {
            compression: shift / top,
            force: 2.0 * half,
            end_contact_force: 2.0 * end,
            imbalance: (bottom + end - half).abs() / half.abs().max(f64::MIN_POSITIVE),
            penetration: self.equations.penetration(&self.state, &self.load).max(0.0),
            effort,
        }
    }
}

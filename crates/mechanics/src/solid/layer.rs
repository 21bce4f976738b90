//! The layer of section 3.2 of the paper: half of it, bonded to the substrate, its end free.
//!
//! Reference coordinates: the axis of symmetry at `x1 = 0`, the substrate at `x2 = 0`, the top at `x2 = H`.

use super::material::Rubber;
use super::mesh::{Mesh, Patch, geometric, uniform};
use super::model::{Body, Equations, Load, ModelError, State};
use super::newton::{Effort, NewtonSettings, Stopped};
use super::obstacle::Shape;

/// What becomes of the layer's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// No traction all the way: the face may fold below the plane of the substrate, as in the paper's model.
    Free,
    /// The substrate goes on, and carries what folds over; smooth, unilateral contact.
    FreeOnSubstrate,
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
        }
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
        Mesh::from_patches(&[Patch::tensor(&self.along, &self.up), Patch::fan(corner, &rim, &self.radii)])
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
        let top = mesh.up[mesh.up.len() - 1];
        let length = mesh.end_top[mesh.end_top.len() - 1];
        let mut body = Body::new(mesh.mesh(), rubber);
        let tiny = 1e-9 * length;
        body.hold(0, |x| x[0] == 0.0);
        body.hold(0, |x| x[1] == 0.0);
        body.hold(1, |x| x[1] == 0.0);
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

/// A mesh for a punch whose corner is at `half_width` (m) on a layer of `thickness` and `half_length` (m): a tensor
/// product, graded along the top towards the corner down to a fifth of `corner_size` (m), and towards the top.
/// `refinement` 1, 2, ... divides every interval.
pub fn punch_mesh(
    thickness: f64,
    half_length: f64,
    half_width: f64,
    corner_size: f64,
    refinement: usize,
) -> LayerMesh {
    let body = half_length - thickness;
    let fine = 0.25 * corner_size;
    let along = graded(&[(0.0, thickness / 6.0), (half_width, fine), (body, thickness / 3.0)], 1.6, refinement);
    let up = graded(&[(0.0, thickness / 6.0), (0.5 * thickness, thickness / 6.0), (thickness, 2.0 * fine)], 1.6, refinement);
    LayerMesh {
        along,
        up,
        end_top: uniform(body, half_length, 3 * refinement),
        radii: geometric(0.5f64.powf(1.0 / refinement as f64), 2 * refinement),
    }
}

/// Breakpoints through the points `(x, size)` (m), the size of the intervals growing away from each point by at most
/// the factor `growth`, each interval then cut into `refinement` equal parts.
fn graded(points: &[(f64, f64)], growth: f64, refinement: usize) -> Vec<f64> {
    let size_at = |x: f64| {
        points.iter().map(|&(p, s)| s + (growth - 1.0) / growth * (x - p).abs()).fold(f64::INFINITY, f64::min)
    };
    let mut breaks = vec![points[0].0];
    for pair in points.windows(2) {
        let (a, b) = (pair[0].0, pair[1].0);
        // Equidistribute the integral of 1/size: as many intervals as it says, each with the same share.
        let samples = 2000;
        let mut total = vec![0.0];
        for k in 0..samples {
            let x = a + (b - a) * (k as f64 + 0.5) / f64::from(samples);
            total.push(total[total.len() - 1] + (b - a) / f64::from(samples) / size_at(x));
        }
        let intervals = total[samples as usize].ceil().max(1.0) as usize;
        let mut coarse = vec![a];
        let mut k = 0;
        for n in 1..intervals {
            let share = total[samples as usize] * n as f64 / intervals as f64;
            while total[k + 1] < share {
                k += 1;
            }
            let part = (share - total[k]) / (total[k + 1] - total[k]);
            coarse.push(a + (b - a) * (k as f64 + part) / f64::from(samples));
        }
        coarse.push(b);
        for cell in coarse.windows(2) {
            breaks.extend(uniform(cell[0], cell[1], refinement).iter().skip(1));
        }
    }
    breaks
}

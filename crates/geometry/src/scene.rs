//! The scene as the solvers see it: axis-aligned bodies in SI units, valid by construction.

/// An axis-aligned box in metres; index 0, 1, 2 are x1 (in-plane), x2 (up), x3 (along the width).
///
/// A bound may be infinite where the scene is open. A box with `min[a] == max[a]` on exactly one axis is a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box3 {
    /// Lower corner, m.
    pub min: [f64; 3],
    /// Upper corner, m.
    pub max: [f64; 3],
}

impl Box3 {
    /// Everything.
    pub const SPACE: Self = Self { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };

    /// Extent along `axis`, m; zero across a sheet.
    pub fn extent(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }

    /// The axis across which the box has no thickness, if it is a sheet.
    pub fn sheet_normal(&self) -> Option<usize> {
        (0..3).find(|&a| self.min[a] == self.max[a])
    }

    /// Whether the closed boxes share at least one point.
    pub fn touches(&self, other: &Self) -> bool {
        (0..3).all(|a| self.min[a] <= other.max[a] && other.min[a] <= self.max[a])
    }

    /// Whether the point lies in the closed box.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= point[a] && point[a] <= self.max[a])
    }

    /// The smallest box that holds both.
    pub fn union(&self, other: &Self) -> Self {
        let mut out = *self;
        for a in 0..3 {
            out.min[a] = out.min[a].min(other.min[a]);
            out.max[a] = out.max[a].max(other.max[a]);
        }
        out
    }
}

/// A perfect conductor: a box or a sheet at one potential.
#[derive(Debug, Clone, PartialEq)]
pub struct Conductor {
    /// Unique within the scene.
    pub name: String,
    /// Where it is.
    pub region: Box3,
    /// Its charge, C, if it floats: its potential is what this makes it. `None` for a driven conductor.
    pub floating_charge: Option<f64>,
}

/// A linear isotropic dielectric; where two overlap, the later one in [`BoxScene::dielectrics`] wins.
#[derive(Debug, Clone, PartialEq)]
pub struct Dielectric {
    /// Name for exports and messages.
    pub name: String,
    /// Where it is; bounds may be infinite.
    pub region: Box3,
    /// eps_r, positive and finite.
    pub relative_permittivity: f64,
}

/// What holds on one outer side of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wall {
    /// No flux through it.
    Insulated,
    /// At potential zero.
    Grounded,
    /// There is none: the field decays to zero at infinity.
    Open,
}

/// A scene of axis-aligned bodies: what the box solver takes.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxScene {
    /// Conductors, pairwise without a common point.
    pub conductors: Vec<Conductor>,
    /// Dielectrics, in the order in which they override one another.
    pub dielectrics: Vec<Dielectric>,
    /// eps_r wherever no dielectric is.
    pub background_permittivity: f64,
    /// Outer walls; a bound is infinite exactly where the wall is [`Wall::Open`].
    pub domain: Box3,
    /// `walls[axis][side]`, side 0 at `domain.min`, side 1 at `domain.max`.
    pub walls: [[Wall; 2]; 3],
}

impl BoxScene {
    /// Indices of the conductors that are held at a potential, ascending.
    pub fn driven(&self) -> impl Iterator<Item = usize> {
        self.conductors.iter().enumerate().filter(|(_, c)| c.floating_charge.is_none()).map(|(i, _)| i)
    }

    /// Indices of the floating conductors, ascending, each with its charge in C.
    pub fn floating(&self) -> impl Iterator<Item = (usize, f64)> {
        self.conductors.iter().enumerate().filter_map(|(i, c)| Some((i, c.floating_charge?)))
    }
}

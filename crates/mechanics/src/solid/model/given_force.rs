//! An indenter whose force is given, in the assembled equations; [`crate::solid::given_force`] finds its
//! place.

use std::ops::Range;

/// The indenter, its force, and their contributions from the last assembly.
#[derive(Debug)]
pub(crate) struct GivenForce {
    /// The obstacles that move together.
    obstacles: Range<usize>,
    /// The force in N, in the plane N per metre of width, by which they press the modelled part of the body.
    pub(crate) force: f64,
    /// The force by which they press in the assembled configuration, in the same unit.
    now: f64,
    /// The force by which they would press after a step in which neither the free displacements nor the
    /// obstacles move.
    pub(crate) staying: f64,
    /// The force on each unknown displacement, in N/m, when the obstacles move up by 1 m.
    pub(crate) column: Vec<f64>,
    /// The stiffness of all contact along `x2` in N/m.
    pub(crate) stiffness: f64,
}

impl GivenForce {
    /// A given force before the first assembly.
    pub(crate) fn new(obstacles: Range<usize>, force: f64) -> Self {
        Self { obstacles, force, now: 0.0, staying: 0.0, column: Vec::new(), stiffness: 0.0 }
    }

    /// Forgets the last assembly of `unknowns` displacements.
    pub(crate) fn clear(&mut self, unknowns: usize) {
        (self.now, self.staying, self.stiffness) = (0.0, 0.0, 0.0);
        self.column.clear();
        self.column.resize(unknowns, 0.0);
    }

    /// Whether the place of `obstacle` is unknown.
    pub(crate) fn moves(&self, obstacle: usize) -> bool {
        self.obstacles.contains(&obstacle)
    }

    /// Adds a contact with this `stiffness` along `x2` (N/m), whose force along `x2` on the body is `now`,
    /// and `staying` after a step in which nothing free moves, in N.
    pub(crate) fn add_contact(&mut self, now: f64, staying: f64, stiffness: f64) {
        self.now -= now;
        self.staying -= staying;
        self.stiffness += stiffness;
    }

    /// Adds the force (N/m) on an unknown displacement when the obstacle moves up by 1 m.
    pub(crate) fn add_to_column(&mut self, unknown: usize, force: f64) {
        self.column[unknown] += force;
    }

    /// Adds the contribution of a prescribed displacement that moves by `step` (m) to the force after the
    /// step; `force` is the contribution per metre.
    pub(crate) fn add_held(&mut self, force: f64, step: f64) {
        self.staying += force * step;
    }

    /// Relative difference between the force of the assembled configuration and the given one.
    pub(crate) fn miss(&self) -> f64 {
        (self.now / self.force - 1.0).abs()
    }
}

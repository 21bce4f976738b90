//! Terminals: conductors on one wire, and what is measured between them.

use elastocap_geometry::scene::{Body, Potential, Role};

use super::model::Case;

/// Conductors on one wire.
#[derive(Debug, Clone, PartialEq)]
pub struct Terminal {
    /// Unique among terminals, and no name of a body that does not belong to it.
    pub name: String,
    /// Names of its conductors, electrodes or fixed ones; never empty. None of them floats or belongs to another terminal.
    pub conductors: Vec<String>,
    /// Whether it is at potential zero, so that it has no row in the capacitance matrix.
    pub is_grounded: bool,
}

impl Terminal {
    /// Whether a conductor of this name belongs to it.
    pub fn holds(&self, conductor: &str) -> bool {
        self.conductors.iter().any(|own| own == conductor)
    }

    /// Whether two conductors belong to one of `terminals`, so that they may touch.
    pub(super) fn joins(terminals: &[Self], first: &str, second: &str) -> bool {
        terminals.iter().any(|terminal| terminal.holds(first) && terminal.holds(second))
    }

    /// Bodies with the conductors of each terminal as one, in the place of the first of them, with their parts in the order of the
    /// bodies.
    pub fn join(terminals: &[Self], bodies: Vec<Body>) -> Vec<Body> {
        let mut out: Vec<Body> = Vec::with_capacity(bodies.len());
        for body in bodies {
            let terminal =
                terminals.iter().find(|terminal| body.is_conductor() && terminal.holds(&body.name));
            let Some(Self { name, is_grounded, .. }) = terminal else {
                out.push(body);
                continue;
            };
            match out.iter_mut().find(|other| other.is_conductor() && other.name == *name) {
                Some(joined) => joined.parts.extend(body.parts),
                None => {
                    let potential = if *is_grounded { Potential::Grounded } else { Potential::Driven };
                    out.push(Body { name: name.clone(), role: Role::Conductor { potential }, ..body });
                }
            }
        }
        out
    }
}

/// The capacitance that a case is about, by rows of the Maxwell matrix: see [`Case::driven_terminals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measurement {
    /// Charge over voltage of two terminals with equal and opposite charges; all others are at potential zero.
    TwoTerminal([usize; 2]),
    /// The mutual capacitance of two terminals: what the first draws from the second at one volt, all others at potential zero.
    Mutual([usize; 2]),
    /// Charge over voltage of one terminal, all others at potential zero.
    Own(usize),
    /// The whole matrix of so many terminals.
    Matrix(usize),
}

impl Case {
    /// The terminal that a conductor belongs to, one that the file names or itself, and whether it is at potential zero: as the file
    /// says, or because something else is measured.
    fn terminal_of<'a>(&'a self, conductor: &'a str) -> (&'a str, bool) {
        let own = self.terminals.iter().find(|terminal| terminal.holds(conductor));
        let (name, is_grounded) =
            own.map_or((conductor, false), |terminal| (terminal.name.as_str(), terminal.is_grounded));
        (name, is_grounded || !self.is_measured(name))
    }

    /// Whether the capacitance of this terminal is asked for: without `[measure]`, that of each one that is not grounded.
    fn is_measured(&self, terminal: &str) -> bool {
        self.measured.as_ref().is_none_or(|names| names.iter().any(|name| name == terminal))
    }

    /// Joins the conductors of each terminal, as [`Terminal::join`] does, and grounds the terminals that are not measured: nothing has to
    /// be solved for them.
    pub fn joined(&self, bodies: Vec<Body>) -> Vec<Body> {
        let mut bodies = Terminal::join(&self.terminals, bodies);
        for body in &mut bodies {
            if body.is_driven() && !self.is_measured(&body.name) {
                body.role = Role::Conductor { potential: Potential::Grounded };
            }
        }
        bodies
    }

    /// The terminal of every conductor that does not float, and whether it is at potential zero. Those of electrodes come first, and a
    /// terminal of several conductors comes once for each.
    fn wired(&self) -> impl Iterator<Item = (&str, bool)> {
        let electrodes = self.electrodes.iter().flat_map(|own| own.names().map(|name| -> &str { name }));
        let fixed = self.bodies.iter().filter(|body| body.is_driven()).map(|body| body.name.as_str());
        electrodes.chain(fixed).map(|conductor| self.terminal_of(conductor))
    }

    /// Whether some conductor is at potential zero, as the file says or because something else is measured.
    pub fn has_grounded_terminals(&self) -> bool {
        self.wired().any(|(_, is_grounded)| is_grounded)
    }

    /// Names of the driven terminals, in the order of the capacitance matrix: that of their first conductors, of which electrodes come
    /// before the fixed ones. With `[measure]` they are those that it names.
    pub fn driven_terminals(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (name, is_grounded) in self.wired() {
            if !is_grounded && !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }

    /// Whether what is measured lies between the two electrodes, so that it can be compared with parallel plates.
    pub fn electrodes_are_measured(&self) -> bool {
        let names = self.driven_terminals();
        let own = self.electrodes.as_ref().map(|own| own.names().map(|name| self.terminal_of(name).0));
        let rows = own.map(|own| own.map(|name| names.iter().position(|known| known == name)));
        match (rows, self.measurement()) {
            (Some([Some(a), Some(b)]), Measurement::TwoTerminal(of) | Measurement::Mutual(of)) => {
                of == [a, b] || of == [b, a]
            }
            (Some(_) | None, _) => false,
        }
    }

    /// What is measured: what the file says, the pair of electrodes, or the only two terminals or the only one; of more, the matrix.
    pub fn measurement(&self) -> Measurement {
        let names = self.driven_terminals();
        let row = |name: &str| names.iter().position(|known| known == name);
        let asked =
            self.measured.as_deref().map(|names| names.iter().map(|name| row(name)).collect::<Vec<_>>());
        match asked.as_deref() {
            Some([Some(one)]) => return Measurement::Own(*one),
            Some([Some(first), Some(second)]) if first != second => {
                return Measurement::Mutual([*first, *second]);
            }
            Some(_) | None => {}
        }
        let electrodes =
            self.electrodes.as_ref().map(|own| own.names().map(|name| row(self.terminal_of(name).0)));
        match (electrodes, names.len()) {
            (Some([Some(first), Some(second)]), _) if first != second => {
                Measurement::TwoTerminal([first, second])
            }
            (_, 1) => Measurement::Own(0),
            (_, 2) => Measurement::TwoTerminal([0, 1]),
            (_, count) => Measurement::Matrix(count),
        }
    }
}

//! The rows of a case's capacitance matrix, one for each driven terminal, and the measured capacitance in
//! terms of them.

use elastocap_geometry::scene::Potential;
use elastocap_geometry::shapes::Shape;

use super::model::{Body, Case, Measured, MeasuredEntry, Role, Terminal};

/// The capacitance that a case is about, by rows of the Maxwell matrix: see [`Case::driven_terminals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measurement {
    /// Charge over voltage of two terminals with equal and opposite charges; all others are at potential
    /// zero.
    TwoTerminal([usize; 2]),
    /// The mutual capacitance of two terminals: minus the charge on the second per volt on the first, all
    /// others at potential zero.
    Mutual([usize; 2]),
    /// Charge over voltage of one terminal, all others at potential zero.
    Own(usize),
    /// Charge over voltage of the first terminal, with the second, a driven guard, at the same potential and
    /// all others at potential zero.
    Guarded([usize; 2]),
    /// The matrix of the driven terminals, of which curves show one entry.
    Matrix {
        /// Number of driven terminals.
        terminals: usize,
        /// Rows of the mutual capacitance in curves. One row twice stands for its capacitance against ground.
        shown: [usize; 2],
    },
}

impl Case {
    /// The terminal of a conductor, which is the conductor itself if the file names none, and whether it is
    /// at potential zero: by the file, or because another capacitance is measured.
    fn terminal_of<'a>(&'a self, conductor: &'a str) -> (&'a str, bool) {
        let named = self.terminals.iter().find(|terminal| terminal.holds(conductor));
        let (name, is_grounded) =
            named.map_or((conductor, false), |terminal| (terminal.name.as_str(), terminal.is_grounded));
        (name, is_grounded || !self.is_measured(name))
    }

    /// Whether the field of this terminal is solved: each one that is not grounded, or with `[measure]` those
    /// that it names and the guards that follow them.
    fn is_measured(&self, terminal: &str) -> bool {
        let Some(measured) = &self.measured else { return true };
        let followed = self
            .terminals
            .iter()
            .find(|other| other.name == terminal)
            .and_then(|found| found.follows.as_deref());
        measured.names().any(|name| name == terminal || followed == Some(name))
    }

    /// Whether infinity, a wall, the indenter or a conductor is at potential zero. Without such a ground all
    /// charge that one terminal of a pair receives comes from the other, so that the mutual and the
    /// two-terminal capacitance are equal.
    pub fn has_ground(&self) -> bool {
        let walls = self.surroundings.as_ref().is_some_and(|around| around.has_ground());
        let is_grounded = |role: &Role| matches!(role, Role::Conductor { potential: Potential::Grounded });
        let indenter = self.indenter.as_ref().is_some_and(|indenter| is_grounded(&indenter.role));
        let parts = || self.bodies.iter().flat_map(|body| &body.parts);
        walls
            || indenter
            || self.has_grounded_terminals()
            || self.bodies.iter().any(|body| is_grounded(&body.role))
            || parts().any(|part| matches!(part, Shape::Shell { .. }))
    }

    /// Joins the conductors of each terminal, as [`Terminal::join`] does, and grounds the terminals that are
    /// not measured: their fields need not be solved.
    pub fn joined(&self, bodies: Vec<Body>) -> Vec<Body> {
        let mut bodies = Terminal::join(&self.terminals, bodies);
        for body in &mut bodies {
            if body.is_driven() && !self.is_measured(&body.name) {
                body.role = Role::Conductor { potential: Potential::Grounded };
            }
        }
        bodies
    }

    /// The terminal of every conductor that does not float, and whether it is at potential zero. Those of
    /// electrodes come first, and a terminal of several conductors occurs once for each.
    fn wired(&self) -> impl Iterator<Item = (&str, bool)> {
        let electrodes = self.electrodes.iter().flat_map(|pair| pair.names().map(|name| -> &str { name }));
        let fixed = self.bodies.iter().filter(|body| body.is_driven()).map(|body| body.name.as_str());
        electrodes.chain(fixed).map(|conductor| self.terminal_of(conductor))
    }

    /// Whether some conductor is at potential zero, by the file or because another capacitance is measured.
    pub fn has_grounded_terminals(&self) -> bool {
        self.wired().any(|(_, is_grounded)| is_grounded)
    }

    /// Names of the driven terminals, in the order of the capacitance matrix: that of their first conductors,
    /// electrodes before fixed ones. With `[measure]` they are those that it names.
    pub fn driven_terminals(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (name, is_grounded) in self.wired() {
            if !is_grounded && !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }

    /// Whether the measured capacitance is between the two electrodes, so that it can be compared with
    /// parallel plates.
    pub fn electrodes_are_measured(&self) -> bool {
        let names = self.driven_terminals();
        let terminals =
            self.electrodes.as_ref().map(|pair| pair.names().map(|name| self.terminal_of(name).0));
        let rows = terminals.map(|pair| pair.map(|name| names.iter().position(|known| known == name)));
        match (rows, self.measurement()) {
            (
                Some([Some(a), Some(b)]),
                Measurement::TwoTerminal(measured) | Measurement::Mutual(measured),
            ) => measured == [a, b] || measured == [b, a],
            (Some(_) | None, _) => false,
        }
    }

    /// The measured capacitance. Without `[measure]` it is the mutual capacitance of the electrodes or of the
    /// only two terminals, the capacitance of the only terminal against ground, or the matrix of more than
    /// two terminals. Two terminals of a scene without ground have only one capacitance, which is solved as
    /// the two-terminal one because that needs one field.
    pub fn measurement(&self) -> Measurement {
        let names = self.driven_terminals();
        let row = |name: &str| names.iter().position(|known| known == name);
        let rows = |pair: [&str; 2]| match pair.map(row) {
            [Some(first), Some(second)] if first != second => Some([first, second]),
            _ => None,
        };
        let entry = |entry: &MeasuredEntry| match entry {
            MeasuredEntry::Own(name) => row(name).map(|row| [row; 2]),
            MeasuredEntry::Mutual(pair) => rows(pair.each_ref().map(String::as_str)),
        };
        let from_file = match &self.measured {
            Some(Measured::TwoTerminal(pair)) => {
                rows(pair.each_ref().map(String::as_str)).map(Measurement::TwoTerminal)
            }
            Some(Measured::Entries(entries)) => entries.first().and_then(entry).map(|shown| {
                let [first, second] = shown;
                match (entries.len(), self.guard_of(&names[first]).and_then(row)) {
                    (1, None) if first == second => Measurement::Own(first),
                    (1, Some(guard)) if first == second => Measurement::Guarded([first, guard]),
                    (1, _) => Measurement::Mutual(shown),
                    (_, _) => Measurement::Matrix { terminals: names.len(), shown },
                }
            }),
            None => None,
        };
        let electrodes = || rows(self.electrodes.as_ref()?.names().map(|name| self.terminal_of(name).0));
        from_file.unwrap_or_else(|| match (electrodes(), names.len()) {
            (None, 1) => Measurement::Own(0),
            (None, count) if count != 2 => Measurement::Matrix { terminals: count, shown: [0, 1] },
            (pair, _) => {
                let pair = pair.unwrap_or([0, 1]);
                if names.len() > 2 || self.has_ground() {
                    Measurement::Mutual(pair)
                } else {
                    Measurement::TwoTerminal(pair)
                }
            }
        })
    }

    /// The driven guard that follows this terminal, if there is one.
    fn guard_of(&self, terminal: &str) -> Option<&str> {
        let guard = self.terminals.iter().find(|guard| guard.follows.as_deref() == Some(terminal))?;
        Some(&guard.name)
    }

    /// Rows of every entry that `[measure]` names, in its order: see [`Measurement::Matrix`]. Empty if one
    /// capacitance is measured.
    pub fn measured_entries(&self) -> Vec<[usize; 2]> {
        let names = self.driven_terminals();
        let row = |name: &String| names.iter().position(|known| known == name);
        let entry = |entry: &MeasuredEntry| match entry {
            MeasuredEntry::Own(name) => row(name).map(|row| [row; 2]),
            MeasuredEntry::Mutual([first, second]) => row(first).zip(row(second)).map(|(i, j)| [i, j]),
        };
        match &self.measured {
            Some(Measured::Entries(entries)) if entries.len() > 1 => {
                entries.iter().filter_map(entry).collect()
            }
            Some(_) | None => Vec::new(),
        }
    }
}

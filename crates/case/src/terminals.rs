//! Terminals, that is conductors on one wire, and the capacitances measured between them.

use elastocap_geometry::scene::{Body, Potential, Role};

/// Conductors on one wire.
#[derive(Debug, Clone, PartialEq)]
pub struct Terminal {
    /// The name: unique among terminals, and not that of a body outside of the terminal.
    pub name: String,
    /// The names of its conductors, at least one. None of them floats or belongs to another terminal.
    pub conductors: Vec<String>,
    /// Whether the terminal is at potential zero, so that it has no row in the capacitance matrix.
    pub is_grounded: bool,
    /// The terminal whose potential the terminal has, if it is a driven guard. That one is neither grounded
    /// nor a guard.
    pub follows: Option<String>,
}

impl Terminal {
    /// Whether a conductor of this name belongs to the terminal.
    pub fn holds(&self, conductor: &str) -> bool {
        self.conductors.iter().any(|name| name == conductor)
    }

    /// Whether two conductors belong to the same one of `terminals`, so that they may touch.
    pub(super) fn joins(terminals: &[Self], first: &str, second: &str) -> bool {
        terminals.iter().any(|terminal| terminal.holds(first) && terminal.holds(second))
    }

    /// The bodies with the conductors of each terminal joined into one body, in the position of the first of
    /// them, with the parts in the order of the bodies.
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

/// The capacitances that a case file asks for, by the names of their terminals; all other terminals are at
/// potential zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Measured {
    /// Charge over voltage of two terminals with equal and opposite charges.
    TwoTerminal([String; 2]),
    /// Entries of the Maxwell matrix in the order of the file, at least one.
    Entries(Vec<MeasuredEntry>),
}

/// A capacitance that a chip reads, by the names of its terminals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MeasuredEntry {
    /// The capacitance of a terminal against ground.
    Own(String),
    /// The mutual capacitance of two terminals.
    Mutual([String; 2]),
}

impl Measured {
    /// The names of the terminals of the measured capacitances; a name occurs once for each of its
    /// capacitances.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let (pair, entries): (&[String], &[MeasuredEntry]) = match self {
            Self::TwoTerminal(pair) => (pair, &[]),
            Self::Entries(entries) => (&[], entries),
        };
        pair.iter().chain(entries.iter().flat_map(MeasuredEntry::names)).map(String::as_str)
    }
}

impl MeasuredEntry {
    fn names(&self) -> &[String] {
        match self {
            Self::Own(name) => std::slice::from_ref(name),
            Self::Mutual(names) => names,
        }
    }
}

//! Half turns and point reflections, which take a scene to itself though no mirror does.
//!
//! The potential of one conductor is then the turned potential of another ([`images`]). Where the two-terminal capacitance of the two is
//! all that is wanted, the state with opposite potentials is enough. It is odd under the turn, and is solved on half of the scene
//! ([`odd`]).

pub(crate) mod exchange;
pub(crate) mod fold;
pub(crate) mod images;
pub(crate) mod odd;

//! `[surroundings]`: the media around the bodies, and where the field ends.

use serde_json::{Value, json};
use toml::de::DeValue;

use super::BoxRegion;
use crate::quantities::{Permittivity, Size};
use crate::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use crate::tables::{Entries, TableKeys, TableSchema, key, table, unknown_word, words};
use crate::values::Either;

table! {
    /// The space around the bodies, and where the field ends.
    struct Surroundings {
        /// The outer walls: "insulated" (no flux), "grounded" (potential zero) or "open" (none, infinite
        /// space).
        boundary: Read<Boundary>,
        /// With a layer and walls: distance along x1 and x3 from the deformed electrodes to the walls.
        side_margin: Option<Read<Size>>,
        /// Without a layer: the box of the walls.
        walls: Option<Read<BoxRegion>>,
        /// Relative permittivity outside of all bodies. Default: 1.
        relative_permittivity: Option<Read<Permittivity>>,
        /// The medium below x2 = 0, or the plane at which the field ends there. Default: the boundary itself,
        /// or infinite space if it is open.
        below: Option<Read<Face>>,
        /// The medium above the layer, or the plane at which the field ends there. Default: the boundary
        /// itself, or infinite space if it is open.
        above: Option<Read<Face>>,
    }
}

words! {
    /// The outer walls.
    enum Boundary { "insulated" => Insulated, "grounded" => Grounded, "open" => Open, }
}

words! {
    /// A plane at which the field ends.
    enum Plane { "insulated" => Insulated, "grounded" => Grounded, }
}

pub(crate) type Face = Either<Plane, Medium>;

table! {
    /// A dielectric against the face of the layer.
    struct Medium {
        /// Relative permittivity.
        relative_permittivity: Read<Permittivity>,
        /// Thickness of the medium, up to the boundary; "open" for infinitely thick (needs boundary =
        /// "open").
        thickness: Read<Either<OpenEnd, Size>>,
        /// The outer wall behind the medium: "grounded" (a ground plane), "insulated", or "open". Default:
        /// the boundary.
        then: Option<Read<Boundary>>,
    }
}

words! {
    /// Infinitely thick.
    enum OpenEnd { "open" => Open, }
}
